/* The events of a motion of any mechanism of one or two masses, found in 113 bits: the mode that velocities, the hold
 * rule and a law allow, then the first zero of the functions that are positive in it, and so on.
 *
 *     m_e q_e'' = F_e + g_e w - sum_j K_ej (q_j - q_j(0)) - sum_j B_ej q_j' - friction,      w = u, or what a law says
 *
 * F is the force at the start, F_size that of its terms. What is decided by less than the rounding of the numbers that come in, or at the same
 * time as something else, stays unsettled.
 */
#include <math.h>
#include <string.h>

#include "checker.h"

enum { MASSES = 2, STATES = 2 * MASSES, STEPS_OF_INPUT = 6, MOST_PHASES = 200, MOST_FUNCTIONS = 8 };
enum { REVERSES, STICKS, SLIPS, HITS_STOP, KINDS };
enum { OF_CONTACT, OF_VELOCITY, OF_HOLD, OF_LAW, OF_LIMIT };
enum { FOUND, UNSETTLED_MODE, UNSETTLED_ZERO, UNSETTLED_TIE, UNSETTLED_POLES };

typedef struct {
    long double m[MASSES], K[MASSES][MASSES], B[MASSES][MASSES], F[MASSES], F_size[MASSES], g[MASSES];
    long double slides[MASSES][2], rests[MASSES][2]; /* forward, backward */
    long double low[MASSES], high[MASSES];           /* less q(0) */
    long double lift[STATES], lift_0;                /* contact force by q - q(0), by q', and of q(0) alone */
    long double p, d, limit;                         /* law: w = sat((p (u - q_0) - d q_0')/g_0) */
    long double q, v[MASSES];                        /* q_0(0), q'(0) */
    long double horizon, t[STEPS_OF_INPUT], u[STEPS_OF_INPUT];
    int64_t size, stands, lawful, steps;
} motion_problem;

typedef struct {
    double t;
    int64_t kind; /* KINDS * mass + what */
} motion_event;

typedef struct {
    double duration;
    int64_t ending, outcome, count, first, phases, windows;
} motion_answer;

/* A mode under an input: slip directions, 0 held; the side of a saturated law. */
typedef struct {
    int side[MASSES], saturation;
    quad u;
} mode;

typedef struct {
    int what, mass, side;
    quad row[STATES], constant, size; /* of what the constant is made */
} function;

typedef struct {
    const motion_problem *p;
    quad z[STATES]; /* q - q(0), q' */
    int at_start, outcome;
    int32_t windows;
} walk;

static int direction(quad x)
{
    return (x > 0) - (x < 0);
}

static int gives_up(walk *w, int why)
{
    w->outcome = w->outcome == FOUND ? why : w->outcome;
    return 0;
}

static int is_shut(const walk *w, int mass, int side)
{
    const motion_problem *p = w->p;
    return (side > 0 && w->z[mass] >= p->high[mass]) || (side < 0 && w->z[mass] <= p->low[mass]);
}

/* ---- the motion of a mode ---- */

/* What a law asks for, in units of the input: row, constant. */
static function asked(const motion_problem *p, quad u)
{
    function f = {.what = OF_LAW, .constant = p->p / (quad)p->g[0] * (u - p->q)};
    f.row[0] = -p->p / (quad)p->g[0];
    f.row[MASSES] = -p->d / (quad)p->g[0];
    f.size = absolute(p->p / (quad)p->g[0]) * (absolute(u) + absolute(p->q));
    return f;
}

/* The force on a mass without friction. */
static function force_on(const motion_problem *p, const mode *m, int mass)
{
    function f = {.what = OF_HOLD, .mass = mass, .constant = p->F[mass]};
    f.size = p->F_size[mass];
    for (int j = 0; j < p->size; j++) {
        f.row[j] = -(quad)p->K[mass][j];
        f.row[MASSES + j] = -(quad)p->B[mass][j];
    }
    if (!p->lawful || m->saturation) {
        const quad input = (quad)p->g[mass] * (p->lawful ? m->saturation * (quad)p->limit : m->u);
        f.constant += input;
        f.size += absolute(input);
    } else {
        const function by_law = asked(p, m->u);
        for (int j = 0; j < STATES; j++) {
            f.row[j] += p->g[mass] * by_law.row[j];
        }
        f.constant += p->g[mass] * by_law.constant;
        f.size += absolute(p->g[mass] * by_law.size);
    }
    return f;
}

/* z' = A z + b of a mode; |A| at least. */
typedef struct {
    quad A[STATES][STATES], b[STATES], rate;
} flow;

static flow flow_of(const motion_problem *p, const mode *m)
{
    flow f;
    quad stiff = 0, damped = 0;
    memset(&f, 0, sizeof f);
    for (int i = 0; i < p->size; i++) {
        if (!m->side[i]) {
            continue;
        }
        const function force = force_on(p, m, i);
        f.A[i][MASSES + i] = 1;
        f.b[MASSES + i] = (force.constant - m->side[i] * (quad)p->slides[i][m->side[i] < 0]) / p->m[i];
        for (int j = 0; j < p->size; j++) {
            const quad both = checker_sqrt((quad)p->m[i] * p->m[j]);
            f.A[MASSES + i][j] = m->side[j] ? force.row[j] / p->m[i] : 0;
            f.A[MASSES + i][MASSES + j] = m->side[j] ? force.row[MASSES + j] / p->m[i] : 0;
            stiff += m->side[j] ? absolute(force.row[j]) / both : 0;
            damped += m->side[j] ? absolute(force.row[MASSES + j]) / both : 0;
        }
    }
    /* Displacements of held masses stay: their forces are constant. */
    f.rate = 2 * (checker_sqrt(stiff) + damped);
    return f;
}

static void constant_forces(const walk *w, const mode *m, flow *f)
{
    for (int i = 0; i < w->p->size; i++) {
        for (int j = 0; m->side[i] && j < w->p->size; j++) {
            f->b[MASSES + i] += m->side[j] ? 0 : force_on(w->p, m, i).row[j] / w->p->m[i] * w->z[j];
        }
    }
}

/* z and `order` derivatives of it, each with the size of its terms. */
static void derivatives(const walk *w, const flow *f, quad z[5][STATES], quad size[5][STATES])
{
    for (int i = 0; i < STATES; i++) {
        z[0][i] = w->z[i];
        size[0][i] = absolute(w->z[i]);
    }
    for (int n = 1; n < 5; n++) {
        for (int i = 0; i < STATES; i++) {
            z[n][i] = n == 1 ? f->b[i] : 0;
            size[n][i] = absolute(z[n][i]);
            for (int j = 0; j < STATES; j++) {
                z[n][i] += f->A[i][j] * z[n - 1][j];
                size[n][i] += absolute(f->A[i][j]) * size[n - 1][j];
            }
        }
    }
}

static watched along(const function *g, const quad z[5][STATES], const quad size[5][STATES])
{
    watched found;
    memset(&found, 0, sizeof found);
    for (int n = 0; n < 4; n++) {
        found.d[n] = n == 0 ? g->constant : 0;
        found.scale[n] = n == 0 ? g->size : 0;
        for (int j = 0; j < STATES; j++) {
            found.d[n] += g->row[j] * z[n][j];
            found.scale[n] += absolute(g->row[j]) * size[n][j];
        }
    }
    return found;
}

/* The state after h of a flow, by series and their squares. */
static void push(const flow *f, const quad from[STATES], quad h, quad to[STATES])
{
    enum { ALL = STATES + 1 };
    quad E[ALL][ALL], term[ALL][ALL], A[ALL][ALL];
    int doublings = 0;
    for (quad reach = 2 * f->rate * absolute(h); reach > 1; reach /= 2) {
        doublings++;
        h /= 2;
    }
    memset(A, 0, sizeof A);
    memset(E, 0, sizeof E);
    for (int i = 0; i < STATES; i++) {
        for (int j = 0; j < STATES; j++) {
            A[i][j] = f->A[i][j];
        }
        A[i][STATES] = f->b[i];
    }
    for (int i = 0; i < ALL; i++) {
        E[i][i] = 1;
    }
    memcpy(term, E, sizeof term);
    for (int n = 1; n <= 27; n++) {
        quad next[ALL][ALL];
        for (int i = 0; i < ALL; i++) {
            for (int j = 0; j < ALL; j++) {
                next[i][j] = 0;
                for (int k = 0; k < ALL; k++) {
                    next[i][j] += A[i][k] != 0 ? A[i][k] * term[k][j] : 0;
                }
                next[i][j] *= h / n;
                E[i][j] += next[i][j];
            }
        }
        memcpy(term, next, sizeof term);
    }
    for (; doublings > 0; doublings--) {
        quad twice[ALL][ALL];
        for (int i = 0; i < ALL; i++) {
            for (int j = 0; j < ALL; j++) {
                twice[i][j] = 0;
                for (int k = 0; k < ALL; k++) {
                    twice[i][j] += E[i][k] * E[k][j];
                }
            }
        }
        memcpy(E, twice, sizeof E);
    }
    quad start[STATES];
    memcpy(start, from, sizeof start); /* which may be `to` */
    for (int i = 0; i < STATES; i++) {
        to[i] = E[i][STATES];
        for (int j = 0; j < STATES; j++) {
            to[i] += E[i][j] * start[j];
        }
    }
}

/* The poles of what the functions' derivatives do; 0 if they are not found. */
static int poles_of(const motion_problem *p, const mode *m, spectrum *out)
{
    memset(out, 0, sizeof *out);
    const int first = p->size == 1 || m->side[0] ? 0 : 1;
    function force[MASSES] = {force_on(p, m, 0), force_on(p, m, p->size - 1)};
    if (p->size == 1 || !m->side[0] || !m->side[1]) {
        checker_spectrum_of_two(-force[first].row[MASSES + first] / p->m[first], -force[first].row[first] / p->m[first],
                                out);
        return 1;
    }
    const quad mn = (quad)p->m[0] * p->m[1], a = p->K[0][0], b = p->K[1][1], k = p->K[0][1], c = p->B[0][0],
               d = p->B[0][1], e = p->B[1][1];
    if (absolute(a * b - k * k) > (quad)1e-17 * absolute(a * b)) {
        return 0; /* two pairs */
    }
    const quad s2 = (p->m[0] * b + p->m[1] * a + c * e - d * d) / mn;
    return s2 > 0 && checker_spectrum_of_three((p->m[0] * e + p->m[1] * c) / mn, s2, (c * b + e * a - 2 * d * k) / mn,
                                               out);
}

/* ---- modes ---- */

/* What is positive in a mode, in the order of the tie rules; limits apart. */
static int functions_of(const walk *w, const mode *m, function out[MOST_FUNCTIONS])
{
    const motion_problem *p = w->p;
    int count = 0;
    if (p->stands) {
        function f = {.what = OF_CONTACT, .constant = p->lift_0, .size = absolute(p->lift_0)};
        for (int j = 0; j < STATES; j++) {
            f.row[j] = p->lift[j];
        }
        out[count++] = f;
    }
    for (int e = 0; e < p->size; e++) {
        if (m->side[e]) {
            function f = {.what = OF_VELOCITY, .mass = e, .side = m->side[e]};
            f.row[MASSES + e] = m->side[e];
            out[count++] = f;
            continue;
        }
        for (int side = 1; side >= -1; side -= 2) {
            if (is_shut(w, e, side)) {
                continue;
            }
            function f = force_on(p, m, e);
            const quad level = p->rests[e][side < 0];
            f.side = side;
            f.constant = level - side * f.constant;
            f.size += level;
            for (int j = 0; j < STATES; j++) {
                f.row[j] *= -side;
            }
            out[count++] = f;
        }
    }
    for (int side = 1; p->lawful && isfinite(p->limit) && side >= -1; side -= 2) {
        if (m->saturation == -side) {
            continue;
        }
        const int inside = m->saturation == 0;
        function f = asked(p, m->u);
        f.side = side;
        f.constant = inside ? p->limit - side * f.constant : side * f.constant - p->limit;
        f.size += p->limit;
        for (int j = 0; j < STATES; j++) {
            f.row[j] *= inside ? -side : side;
        }
        out[count++] = f;
    }
    return count;
}

/* Whether a mode is the motion from here on: all that is at rest, or near a limit of the law, starts upwards. */
static int fits(walk *w, const mode *m, int *close)
{
    function g[MOST_FUNCTIONS];
    quad z[5][STATES], size[5][STATES];
    flow f = flow_of(w->p, m);
    constant_forces(w, m, &f);
    derivatives(w, &f, z, size);
    const int count = functions_of(w, m, g);
    for (int i = 0; i < count; i++) {
        if (g[i].what == OF_CONTACT || (g[i].what == OF_VELOCITY && w->z[MASSES + g[i].mass] != 0)) {
            continue;
        }
        const watched at = along(&g[i], z, size);
        const quad nothing = (quad)1e-26, rounding = w->at_start ? (quad)1e-17 : (quad)1e-24;
        int n = 0, sign = 0;
        for (; n < 4 && sign == 0; n++) {
            sign = absolute(at.d[n]) > nothing * at.scale[n] ? direction(at.d[n]) : 0;
            const int near = absolute(at.d[n]) <= rounding * at.scale[n] && at.scale[n] > 0;
            *close |= near && (sign != 0 || (n == 0 && w->at_start && g[i].what != OF_VELOCITY));
        }
        if (sign < 0 || (sign == 0 && g[i].what == OF_VELOCITY)) {
            return 0;
        }
    }
    return 1;
}

/* The mode that a state takes under u; 0 if it is unsettled. */
static int choose(walk *w, quad u, mode *out)
{
    const motion_problem *p = w->p;
    int sides[3] = {0, 1, -1}, count = 1, close = 0;
    if (p->lawful && isfinite(p->limit)) {
        function f = asked(p, u);
        quad value = f.constant, size = f.size + p->limit;
        for (int j = 0; j < STATES; j++) {
            value += f.row[j] * w->z[j];
            size += absolute(f.row[j] * w->z[j]);
        }
        const quad over = absolute(value) - p->limit;
        const int at = absolute(over) <= (quad)1e-26 * size;
        if (w->at_start && absolute(over) <= (quad)1e-17 * size) {
            return gives_up(w, UNSETTLED_MODE);
        }
        sides[0] = at || over < 0 ? 0 : direction(value);
        sides[1] = direction(value);
        count = at ? 2 : 1;
    }
    for (int held = (int)p->size; held >= 0; held--) {
        for (int first = 0; first < 3; first++) {
            for (int second = 0; second < (p->size == 2 ? 3 : 1); second++) {
                const int side[MASSES] = {(first + 1) % 3 - 1, p->size == 2 ? (second + 1) % 3 - 1 : 0};
                int at_rest = 0, allowed = 1;
                for (int e = 0; e < p->size; e++) {
                    const int moves = direction(w->z[MASSES + e]);
                    at_rest += side[e] == 0;
                    allowed &= moves ? side[e] == moves : side[e] == 0 || !is_shut(w, e, side[e]);
                }
                for (int n = 0; allowed && at_rest == held && n < count; n++) {
                    *out = (mode){{side[0], side[1]}, sides[n], u};
                    if (fits(w, out, &close)) {
                        return close ? gives_up(w, UNSETTLED_MODE) : 1;
                    }
                }
            }
        }
    }
    return gives_up(w, UNSETTLED_MODE);
}

/* ---- phases ---- */

/* Where a mass that slips meets its limit, if it does before T; its velocity keeps its sign until then. */
static int limit_before(walk *w, const flow *f, int mass, int side, quad T, quad *when)
{
    const quad end = side > 0 ? w->p->high[mass] : w->p->low[mass];
    quad z[STATES], low = 0, high = T;
    if (!isfinite((double)end)) {
        return 0;
    }
    push(f, w->z, T, z);
    if (side * (z[mass] - end) < 0) {
        return 0;
    }
    quad t = T;
    for (int n = 0; n < 200; n++) {
        const quad gap = side * (end - z[mass]), speed = side * z[MASSES + mass];
        quad next = speed > 0 ? t + gap / speed : (low + high) / 2;
        if (gap > 0) {
            low = t;
        } else {
            high = t;
        }
        if (absolute(next - t) <= (quad)1e-30 * T || gap == 0) {
            *when = next;
            return 1;
        }
        t = next > low && next < high ? next : (low + high) / 2;
        push(f, w->z, t, z);
    }
    return gives_up(w, UNSETTLED_ZERO);
}

/* The first function that ends a phase before T, moved to it; -1 for none. */
static int first_end(walk *w, const mode *m, const flow *f, const function *g, int count, quad *T, function *due)
{
    spectrum poles;
    quad z[5][STATES], size[5][STATES], whole = *T, next = 2 * *T;
    int found = -1;
    if (!poles_of(w->p, m, &poles)) {
        gives_up(w, UNSETTLED_POLES);
        return -1;
    }
    derivatives(w, f, z, size);
    for (int i = 0; i < count && *T > 0; i++) {
        const watched at = along(&g[i], z, size);
        quad zero;
        const quad within = found < 0 ? whole : *T * (1 + (quad)1e-12);
        const int said = checker_first_zero(&poles, &at, within, &zero, &w->windows);
        if (said == UNKNOWN) {
            gives_up(w, UNSETTLED_ZERO);
        } else if (said == A_ZERO) {
            next = found >= 0 && absolute(*T - zero) < next ? absolute(*T - zero) : next;
            found = zero < *T || found < 0 ? i : found;
            *T = zero < *T ? zero : *T;
            *due = g[found];
        }
    }
    for (int e = 0; e < w->p->size && *T > 0; e++) {
        quad when;
        if (m->side[e] && limit_before(w, f, e, m->side[e], *T, &when)) {
            next = found >= 0 && *T - when < next ? *T - when : next;
            found = count;
            *T = when;
            *due = (function){.what = OF_LIMIT, .mass = e, .side = m->side[e]};
        }
    }
    if (found >= 0 && *T > 0 && (next <= (quad)1e-12 * *T || (*T != whole && whole - *T <= (quad)1e-12 * whole))) {
        gives_up(w, UNSETTLED_TIE);
    }
    return found;
}

/* The state where a function is zero near T, by Newton's steps on the state itself, as far as they get shorter. */
static quad move_to_zero(walk *w, const flow *f, const function *g, quad T)
{
    quad z[STATES], last = T;
    for (int n = 0; n < 8; n++) {
        quad value = g->constant, rate = 0;
        push(f, w->z, T, z);
        for (int i = 0; i < STATES; i++) {
            quad speed = f->b[i];
            for (int j = 0; j < STATES; j++) {
                speed += f->A[i][j] * z[j];
            }
            value += g->row[i] * z[i];
            rate += g->row[i] * speed;
        }
        const quad step = rate < 0 ? -value / rate : 0;
        if (step == 0 || absolute(step) >= last) {
            break;
        }
        T += step;
        last = absolute(step);
    }
    push(f, w->z, T, w->z);
    return T;
}

static void land(walk *w, const function *due)
{
    const int e = due->mass;
    if (due->what == OF_LIMIT) {
        w->z[e] = due->side > 0 ? w->p->high[e] : w->p->low[e];
    }
    if (due->what == OF_LIMIT || due->what == OF_VELOCITY) {
        w->z[MASSES + e] = 0;
    }
}

static quad contact_force(const walk *w)
{
    quad value = w->p->lift_0;
    for (int j = 0; j < STATES; j++) {
        value += w->p->lift[j] * w->z[j];
    }
    return value;
}

/* Whether the velocity of a mass that slips has faded to the rounding of the places, by which it would have any sign. */
static int has_faded(const walk *w, const mode *m, const flow *f)
{
    quad places = 0;
    int faded = 0;
    for (int e = 0; e < w->p->size; e++) {
        places += absolute(w->z[e]);
    }
    for (int e = 0; e < w->p->size; e++) {
        faded |= m->side[e] && absolute(w->z[MASSES + e]) < (quad)1e-24 * f->rate * places;
    }
    return faded;
}

/* The chain of phases; writes at most `room` events. */
static void follow(walk *w, motion_answer *a, motion_event *events, int64_t room)
{
    const motion_problem *p = w->p;
    quad t = 0, rest = -1;
    int piece = 0;
    mode m;
    for (int e = 0; e < p->size; e++) {
        w->z[e] = 0;
        w->z[MASSES + e] = p->v[e];
        if (is_shut(w, e, direction(p->v[e]))) {
            w->z[MASSES + e] = 0;
        }
    }
    if (!choose(w, p->u[0], &m)) {
        return;
    }
    for (a->phases = 1; a->phases <= MOST_PHASES; a->phases++) {
        const int last = piece + 1 >= p->steps || !(p->t[piece + 1] < p->horizon);
        const quad end = last ? (quad)p->horizon : (quad)p->t[piece + 1];
        const mode before = m;
        function g[MOST_FUNCTIONS], due = {.what = OF_LAW};
        int found = -1;
        w->at_start = 0;
        if (!m.side[0] && !m.side[1]) {
            if (p->stands && contact_force(w) < 0) {
                a->ending = TAKEOFF, a->duration = (double)t;
                return;
            }
            rest = rest < 0 ? t : rest;
            if (last) {
                a->ending = REST, a->duration = (double)rest;
                return;
            }
            t = end;
        } else {
            quad T = end - t;
            flow f = flow_of(p, &m);
            rest = -1;
            constant_forces(w, &m, &f);
            found = first_end(w, &m, &f, g, functions_of(w, &m, g), &T, &due);
            if (w->outcome != FOUND) {
                return;
            }
            if (found < 0 || due.what == OF_LIMIT || T == 0) {
                push(&f, w->z, T, w->z);
            } else {
                T = move_to_zero(w, &f, &due, T);
            }
            t = found < 0 ? end : t + T;
            if (found < 0 && !last && has_faded(w, &m, &f)) {
                gives_up(w, UNSETTLED_ZERO);
                return;
            }
        }
        if (found < 0 && last) {
            a->ending = HORIZON, a->duration = (double)p->horizon;
            return;
        }
        if (found >= 0 && due.what == OF_CONTACT) {
            a->ending = TAKEOFF, a->duration = (double)t;
            return;
        }
        if (found >= 0) {
            land(w, &due);
        } else {
            piece++;
        }
        w->at_start = found < 0; /* by the numbers of a step */
        if (!choose(w, p->u[piece], &m)) {
            return;
        }
        for (int e = 0; e < p->size; e++) {
            const int hits = found >= 0 && due.what == OF_LIMIT && due.mass == e, was = before.side[e];
            if (!hits && was == m.side[e]) {
                continue;
            }
            const int what = hits ? HITS_STOP : !was ? SLIPS : m.side[e] ? REVERSES : STICKS;
            if (a->count < room) {
                events[a->count] = (motion_event){(double)t, KINDS * e + what};
            }
            a->count++;
        }
    }
    a->ending = TOO_MANY_PHASES, a->duration = (double)t;
}

/* Motions of `count` problems; the number of events, of which as many as fit are written. */
int64_t checker_motions(const motion_problem *problems, int64_t count, motion_answer *answers, motion_event *events,
                        int64_t capacity)
{
    int64_t first = 0;
    for (int64_t i = 0; i < count; i++) {
        walk w = {.p = &problems[i], .at_start = 1, .outcome = FOUND};
        memset(&answers[i], 0, sizeof answers[i]);
        answers[i].first = first;
        follow(&w, &answers[i], events + (first < capacity ? first : capacity), first < capacity ? capacity - first : 0);
        answers[i].outcome = w.outcome;
        answers[i].windows = w.windows;
        first += answers[i].count;
    }
    return first;
}
