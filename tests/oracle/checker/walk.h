/* The chain of phases, pushed through its modes with Taylor series; included once per type REAL with NAME(x) to tell
 * them apart.
 *
 *     y' = v1 - v2        v1' = C1 - k y/m_eff - b1 v1/m_eff        v2' = C2 + k y/m_s - b2 v2/m_s        x' = v1
 */
typedef struct {
    REAL m_eff, m_s, k, L0, c, b1, b2, f1, f2, f1_excess, f2_excess, gamma2, g, x1_min, x1_max;
    REAL x1, v1, v2, u, y;
} NAME(inputs);

typedef struct {
    REAL x, y, v1, v2;
} NAME(point);

typedef struct {
    int moves_1, moves_2;
    REAL C1, C2;              /* constant accelerations */
    REAL y1, y2, d1, d2;      /* k/m_eff, k/m_s, b1/m_eff, b2/m_s */
    REAL rate;                /* a bound on the norm of the motion, in units in which y is as large as v */
} NAME(motion);

static REAL NAME(magnitude)(REAL x)
{
    return x < 0 ? -x : x;
}

/* Friction at rest: the force per mass that it takes to move a mass is f and the excess, what slips feels f alone. */
static REAL NAME(at_rest_1)(const NAME(inputs) *in)
{
    return in->f1 + in->f1_excess;
}

static REAL NAME(at_rest_2)(const NAME(inputs) *in)
{
    return in->f2 + in->f2_excess;
}

/* Free accelerations, those at rest without Coulomb friction. */
static REAL NAME(free_1)(const NAME(inputs) *in, REAL y)
{
    return (in->k * (in->c - y) - in->gamma2 * in->u) / in->m_eff;
}

static REAL NAME(free_2)(const NAME(inputs) *in, REAL y)
{
    return in->k * y / in->m_s - in->g;
}

static NAME(motion) NAME(motion_of)(const NAME(inputs) *in, int side_1, int side_2)
{
    NAME(motion) m;
    m.moves_1 = side_1 != 0;
    m.moves_2 = side_2 != 0;
    m.y1 = m.moves_1 ? in->k / in->m_eff : 0;
    m.y2 = m.moves_2 ? in->k / in->m_s : 0;
    m.d1 = m.moves_1 ? in->b1 / in->m_eff : 0;
    m.d2 = m.moves_2 ? in->b2 / in->m_s : 0;
    m.C1 = m.moves_1 ? (in->k * in->c - in->gamma2 * in->u) / in->m_eff - side_1 * in->f1 : 0;
    m.C2 = m.moves_2 ? -in->g - side_2 * in->f2 : 0;
    m.rate = 2 * ((REAL)(sqrt((double)m.y1) + sqrt((double)m.y2)) + m.d1 + m.d2);
    return m;
}

/* The state after h; `forced` = 0 leaves the constant accelerations out. rate*h <= 1/2. */
static NAME(point) NAME(series)(const NAME(motion) *m, NAME(point) z, int forced, REAL h)
{
    NAME(point) sum = z;
    for (int n = 1; n <= 27; n++) {
        const REAL s = h / n;
        const int first = forced && n == 1;
        const NAME(point) d = {s * z.v1, s * (z.v1 - z.v2), s * (-m->y1 * z.y - m->d1 * z.v1 + (first ? m->C1 : 0)),
                               s * (m->y2 * z.y - m->d2 * z.v2 + (first ? m->C2 : 0))};
        z = d;
        sum.x += z.x;
        sum.y += z.y;
        sum.v1 += z.v1;
        sum.v2 += z.v2;
    }
    return sum;
}

static NAME(point) NAME(combined)(const NAME(point) column[4], NAME(point) z, REAL one)
{
    NAME(point) r;
    r.x = z.x + column[0].x * z.y + column[1].x * z.v1 + column[2].x * z.v2 + column[3].x * one;
    r.y = column[0].y * z.y + column[1].y * z.v1 + column[2].y * z.v2 + column[3].y * one;
    r.v1 = column[0].v1 * z.y + column[1].v1 * z.v1 + column[2].v1 * z.v2 + column[3].v1 * one;
    r.v2 = column[0].v2 * z.y + column[1].v2 * z.v1 + column[2].v2 * z.v2 + column[3].v2 * one;
    return r;
}

/* The state after t: a few series, or their propagator squared until it reaches. */
static NAME(point) NAME(push)(const NAME(motion) *m, NAME(point) z, REAL t)
{
    const REAL reach = 2 * m->rate * NAME(magnitude)(t);
    if (reach <= 5) {
        const int steps = (int)(double)reach + 1;
        for (int n = 0; n < steps; n++) {
            z = NAME(series)(m, z, 1, t / steps);
        }
        return z;
    }
    int doublings = 0;
    for (REAL left = reach; left > 1; left /= 2) {
        doublings++;
        t /= 2;
    }
    const NAME(point) unit[4] = {{0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}, {0, 0, 0, 0}};
    NAME(point) column[4];
    for (int n = 0; n < 4; n++) {
        column[n] = NAME(series)(m, unit[n], n == 3, t);
    }
    for (; doublings > 0; doublings--) {
        NAME(point) twice[4];
        for (int n = 0; n < 4; n++) {
            twice[n] = NAME(combined)(column, column[n], n == 3 ? 1 : 0);
        }
        memcpy(column, twice, sizeof column);
    }
    return NAME(combined)(column, z, 1);
}

/* What is zero at the end of a phase, and its rate. */
static void NAME(zero_at_end)(const NAME(inputs) *in, const NAME(motion) *m, const NAME(point) *z, int what, int side,
                              REAL *value, REAL *rate)
{
    switch (what) {
    case END_V1:
        *value = z->v1;
        *rate = m->C1 - m->y1 * z->y - m->d1 * z->v1;
        break;
    case END_V2:
        *value = z->v2;
        *rate = m->C2 + m->y2 * z->y - m->d2 * z->v2;
        break;
    case END_A1:
        *value = NAME(free_1)(in, z->y) - side * NAME(at_rest_1)(in);
        *rate = -in->k / in->m_eff * (z->v1 - z->v2);
        break;
    case END_A2:
        *value = NAME(free_2)(in, z->y) - side * NAME(at_rest_2)(in);
        *rate = in->k / in->m_s * (z->v1 - z->v2);
        break;
    case END_STOP:
        *value = z->x - (side > 0 ? in->x1_max : in->x1_min);
        *rate = z->v1;
        break;
    default:
        *value = z->y;
        *rate = z->v1 - z->v2;
    }
}

/* Push a phase to its end, which is moved to where the event is; 0 if Newton's steps do not settle. */
static int NAME(to_end)(const NAME(inputs) *in, const NAME(motion) *m, int what, int side, REAL *T, NAME(point) *z)
{
    const NAME(point) start = *z;
    *z = NAME(push)(m, start, *T);
    if (what == END_TIME) {
        return 1;
    }
    for (int n = 0; n < 12; n++) {
        REAL value, rate;
        NAME(zero_at_end)(in, m, z, what, side, &value, &rate);
        if (value == 0) {
            return 1;
        }
        if (rate == 0) {
            return 0;
        }
        const REAL step = -value / rate;
        *T += step;
        *z = NAME(magnitude)(step) * m->rate < 0.5 ? NAME(series)(m, *z, 1, step) : NAME(push)(m, start, *T);
        if (NAME(magnitude)(step) <= SETTLED * (NAME(magnitude)(*T) + 1 / m->rate)) {
            return 1;
        }
    }
    return 0;
}

/* What an event takes from the state. */
static void NAME(land)(const NAME(inputs) *in, int what, int side, NAME(point) *z)
{
    if (what == END_V1 || what == END_STOP) {
        z->v1 = 0;
    }
    if (what == END_STOP) {
        z->x = side > 0 ? in->x1_max : in->x1_min;
    }
    if (what == END_V2) {
        z->v2 = 0;
    }
    if (what == END_Y) {
        z->y = 0;
    }
}

static REAL NAME(gain)(const NAME(inputs) *in, const NAME(point) *from, const NAME(point) *to)
{
    const REAL before = from->x - from->y, after = to->x - to->y; /* x2 - L0 - c */
    return in->m_s * (to->v2 * to->v2 - from->v2 * from->v2) / 2 + in->m_s * in->g * (after - before)
         + in->k * (after * after - before * before) / 2;
}
