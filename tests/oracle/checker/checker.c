/* The judgement: every event is where and what it is said to be, nothing happens in between, the ending is right. */
#include "checker.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { END_V1, END_V2, END_A1, END_A2, END_STOP, END_Y, END_TIME };

#define REAL quad
#define NAME(x) exact_##x
#define SETTLED ((quad)1e-31)
#include "walk.h"
#undef REAL
#undef NAME
#undef SETTLED

#define REAL long double
#define NAME(x) quick_##x
#define SETTLED 1e-16L
#include "walk.h"
#undef REAL
#undef NAME
#undef SETTLED

static const quad EXACT = (quad)1e-26; /* below this, relative, a number is zero */
static const quad CLOSE = (quad)1e-12; /* below this a decision is left to the reference */

/* How a phase ends. */
typedef struct {
    int what, side, side_1, side_2;
    double T;  /* as returned; then as found */
    quad time; /* of its end */
} link;

typedef struct {
    const checker_problem *problem;
    const checker_answer *answer;
    const checker_phase *phases;
    exact_inputs in;
    link *links; /* of each phase */
    quad time;
    exact_point z;
    double unit; /* of time */
    checker_verdict *verdict;
} judge;

static int blame(judge *j, int reason, int n, int close)
{
    j->verdict->outcome = close ? UNSETTLED : WRONG;
    j->verdict->reason = reason;
    j->verdict->phase = n;
    return 0;
}

static exact_inputs inputs_of(const checker_problem *p)
{
    const exact_inputs in = {p->m_eff, p->m_s,       p->k,         p->L0,     p->c, p->b1,     p->b2,     p->f1, p->f2,
                             p->f1_excess, p->f2_excess, p->gamma2, p->g, p->x1_min, p->x1_max, p->x1, p->v1, p->v2,
                             p->u,         p->y};
    return in;
}

static int sign(quad x)
{
    return (x > 0) - (x < 0);
}

static int is_blocked(const exact_inputs *in, quad x, int side)
{
    return !(in->x1_min < in->x1_max) || (side < 0 && x <= in->x1_min) || (side > 0 && x >= in->x1_max);
}

/* ---- the hold rule ---- */

/* The first derivative of y that is not zero while mass `held` is held; 0 if all are. */
static quad drift_of_y(const exact_inputs *in, const exact_point *z, int held, int other)
{
    const exact_motion m = exact_motion_of(in, held == 1 ? 0 : other, held == 2 ? 0 : other);
    const quad v1 = held == 1 ? 0 : z->v1, v2 = held == 2 ? 0 : z->v2;
    const quad a1 = m.C1 - m.y1 * z->y - m.d1 * v1, a2 = m.C2 + m.y2 * z->y - m.d2 * v2;
    const quad j1 = -m.y1 * (v1 - v2) - m.d1 * a1, j2 = m.y2 * (v1 - v2) - m.d2 * a2;
    const quad size = absolute(m.C1) + absolute(m.C2) + (m.y1 + m.y2) * absolute(z->y);
    if (v1 != v2) {
        return v1 - v2;
    }
    return absolute(a1 - a2) > EXACT * size ? a1 - a2 : j1 - j2;
}

/* Where a mass at rest goes; `close` if a little more or less force would send it elsewhere. */
static int goes(const exact_inputs *in, const exact_point *z, int mass, int other, int *close)
{
    const quad a = mass == 1 ? exact_free_1(in, z->y) : exact_free_2(in, z->y);
    const quad f = mass == 1 ? exact_at_rest_1(in) : exact_at_rest_2(in);
    const quad spring = in->k * (absolute(z->y) + absolute(in->c));
    const quad size = f + (mass == 1 ? (spring + absolute(in->gamma2 * in->u)) / in->m_eff : spring / in->m_s + in->g);
    const quad over = absolute(a) - f;
    *close = absolute(over) <= CLOSE * size;
    int side = over > 0 ? sign(a) : 0;
    if (absolute(over) <= EXACT * size) {
        const int drift = (mass == 1 ? -1 : 1) * sign(drift_of_y(in, z, mass, other));
        side = f > 0 && sign(a) != drift ? 0 : drift;
    }
    return mass == 1 && is_blocked(in, z->x, side) ? 0 : side;
}

static int begins_well(judge *j)
{
    const checker_problem *p = j->problem;
    exact_point *z = &j->z;
    int close_1 = 0, close_2 = 0;
    *z = (exact_point){p->x1, p->y, p->v1, p->v2};
    if (z->v1 != 0 && is_blocked(&j->in, z->x, sign(z->v1))) {
        z->v1 = 0;
    }
    int side_1 = sign(z->v1), side_2 = sign(z->v2);
    for (int n = 0; n < 2; n++) {
        side_1 = z->v1 != 0 ? side_1 : goes(&j->in, z, 1, side_2, &close_1);
        side_2 = z->v2 != 0 ? side_2 : goes(&j->in, z, 2, side_1, &close_2);
    }
    if (side_1 != j->links[0].side_1 || side_2 != j->links[0].side_2) {
        return blame(j, START_MODE, 0, close_1 || close_2);
    }
    return 1;
}

/* ---- one phase ---- */

/* The watched function c0 + cy y + c1 v1 + c2 v2, between two states. */
static watched function_of(const exact_motion *m, const exact_point *from, const exact_point *to, quad c0, quad cy,
                           quad c1, quad c2)
{
    watched g;
    quad y = from->y, v1 = from->v1, v2 = from->v2;
    quad sy = absolute(y), s1 = absolute(v1), s2 = absolute(v2);
    for (int n = 0; n < 4; n++) {
        g.d[n] = cy * y + c1 * v1 + c2 * v2 + (n == 0 ? c0 : 0);
        g.scale[n] = absolute(cy) * sy + absolute(c1) * s1 + absolute(c2) * s2 + (n == 0 ? absolute(c0) : 0);
        const quad dy = v1 - v2, d1 = -m->y1 * y - m->d1 * v1 + (n == 0 ? m->C1 : 0);
        const quad d2 = m->y2 * y - m->d2 * v2 + (n == 0 ? m->C2 : 0);
        const quad ty = s1 + s2, t1 = m->y1 * sy + m->d1 * s1 + (n == 0 ? absolute(m->C1) : 0);
        const quad t2 = m->y2 * sy + m->d2 * s2 + (n == 0 ? absolute(m->C2) : 0);
        y = dy, v1 = d1, v2 = d2;
        sy = ty, s1 = t1, s2 = t2;
    }
    g.end[0] = c0 + cy * to->y + c1 * to->v1 + c2 * to->v2;
    g.end[1] = cy * (to->v1 - to->v2) + c1 * (m->C1 - m->y1 * to->y - m->d1 * to->v1)
             + c2 * (m->C2 + m->y2 * to->y - m->d2 * to->v2);
    const quad fastest = absolute(from->v1) + absolute(from->v2) + absolute(to->v1) + absolute(to->v2)
                       + m->rate * (absolute(from->y) + absolute(to->y));
    g.end_scale = absolute(c0) + absolute(cy) * fastest / m->rate + (absolute(c1) + absolute(c2)) * fastest;
    return g;
}

static int spectrum_of(const exact_inputs *in, int side_1, int side_2, spectrum *out)
{
    const quad d1 = in->b1 / in->m_eff, d2 = in->b2 / in->m_s, q1 = in->k / in->m_eff, q2 = in->k / in->m_s;
    memset(out, 0, sizeof *out);
    if (side_1 != 0 && side_2 != 0) {
        return checker_spectrum_of_three(d1 + d2, q1 + q2 + d1 * d2, d1 * q2 + d2 * q1, out);
    }
    checker_spectrum_of_two(side_1 != 0 ? d1 : d2, side_1 != 0 ? q1 : q2, out);
    return 1;
}

static int keeps(judge *j, int n, const spectrum *poles, watched g, quad T)
{
    const int found = checker_stays_positive(poles, &g, T, &j->verdict->windows);
    return found == CERTIFIED ? 1 : blame(j, MISSED, n, found == UNSETTLED);
}

/* Nothing happens before T in the phase from `from` to `to`. */
static int nothing_between(judge *j, int n, const exact_motion *m, const exact_point *from, const exact_point *to,
                           quad T)
{
    const exact_inputs *in = &j->in;
    const link *l = &j->links[n];
    spectrum poles;
    if (!spectrum_of(in, l->side_1, l->side_2, &poles)) {
        return blame(j, POLES, n, 1);
    }
    if (!keeps(j, n, &poles, function_of(m, from, to, 0, 1, 0, 0), T)) {
        return 0;
    }
    if (l->side_1 != 0 && !keeps(j, n, &poles, function_of(m, from, to, 0, 0, l->side_1, 0), T)) {
        return 0;
    }
    if (l->side_2 != 0 && !keeps(j, n, &poles, function_of(m, from, to, 0, 0, 0, l->side_2), T)) {
        return 0;
    }
    for (int side = -1; side <= 1; side += 2) {
        const quad left_1 = exact_at_rest_1(in) - side * exact_free_1(in, 0);
        const quad left_2 = exact_at_rest_2(in) - side * exact_free_2(in, 0);
        if (l->side_1 == 0 && !is_blocked(in, from->x, side)
            && !keeps(j, n, &poles, function_of(m, from, to, left_1, side * in->k / in->m_eff, 0, 0), T)) {
            return 0;
        }
        if (l->side_2 == 0
            && !keeps(j, n, &poles, function_of(m, from, to, left_2, -side * in->k / in->m_s, 0, 0), T)) {
            return 0;
        }
    }
    return 1;
}

/* v1 keeps its sign, so the end says whether a stop was passed. */
static int within_stroke(judge *j, int n, const exact_point *z)
{
    const link *l = &j->links[n];
    const quad beyond = l->side_1 > 0 ? z->x - j->in.x1_max : (l->side_1 < 0 ? j->in.x1_min - z->x : -1);
    if (l->what == END_STOP || beyond <= 0) {
        return 1;
    }
    return blame(j, PASSED_STOP, n, beyond <= CLOSE * (absolute(z->x) + (quad)0.1));
}

/* The mode after an event: that of the mass it is about by the hold rule, the other one as before. */
static int goes_on_well(judge *j, int n)
{
    const link *l = &j->links[n], *next = &j->links[n + 1];
    const int word = j->phases[n + 1].event;
    int close = 0;
    const int first = l->what == END_V1 || l->what == END_STOP || l->what == END_A1;
    const int before = first ? l->side_1 : l->side_2, after = first ? next->side_1 : next->side_2;
    if (first ? l->side_2 != next->side_2 : l->side_1 != next->side_1) {
        return blame(j, BAD_WORD, n + 1, 0);
    }
    if (l->what == END_A1 || l->what == END_A2) {
        return before == 0 && after != 0 ? 1 : blame(j, BAD_WORD, n + 1, 0);
    }
    const int side = goes(&j->in, &j->z, first ? 1 : 2, first ? l->side_2 : l->side_1, &close);
    if (side != after) {
        return blame(j, HOLD_RULE, n + 1, close);
    }
    const int reverses = word == X1_REVERSES || word == X2_REVERSES, sticks = word == X1_STICKS || word == X2_STICKS;
    if (before == 0 || (reverses && after != -before) || (sticks && after != 0)) {
        return blame(j, BAD_WORD, n + 1, 0);
    }
    return 1;
}

/* An event is a crossing: out of the band, into the stop, off the ground, through zero. */
static int crosses(judge *j, int n, const exact_motion *m, const exact_point *z)
{
    const link *l = &j->links[n];
    quad value, rate;
    if (l->what == END_TIME) {
        return 1;
    }
    exact_zero_at_end(&j->in, m, z, l->what, l->side, &value, &rate);
    const quad outwards = l->what == END_V1 ? -l->side_1 * rate
                        : l->what == END_V2 ? -l->side_2 * rate
                        : l->what == END_Y  ? -rate
                                            : l->side * rate;
    return outwards > 0 ? 1 : blame(j, WRONG_DIRECTION, n, 1);
}

static int phase_is_right(judge *j, int n)
{
    link *l = &j->links[n];
    const exact_motion m = exact_motion_of(&j->in, l->side_1, l->side_2);
    const exact_point from = j->z;
    quad T = l->what == END_TIME ? (quad)j->problem->horizon - j->time : (quad)l->T;
    if (!exact_to_end(&j->in, &m, l->what, l->side, &T, &j->z)) {
        return blame(j, NO_SUCH_ZERO, n, 1);
    }
    if (absolute(T - l->T) > (quad)1e-6 * j->unit) {
        return blame(j, NO_SUCH_ZERO, n, 0);
    }
    const int at_once = absolute(T) <= (quad)1e-24 * j->unit;
    if (T < 0 && !at_once) {
        return blame(j, TIME_RUNS_BACK, n, -T <= CLOSE * j->unit);
    }
    if (!at_once
        && !(crosses(j, n, &m, &j->z) && within_stroke(j, n, &j->z) && nothing_between(j, n, &m, &from, &j->z, T))) {
        return 0;
    }
    l->T = (double)T;
    j->time += T;
    l->time = j->time;
    exact_land(&j->in, l->what, l->side, &j->z);
    return 1;
}

/* ---- the chain ---- */

static int sides_of(link *l, int mode)
{
    l->side_1 = mode / 3 - 1;
    l->side_2 = mode % 3 - 1;
    return mode >= 0 && mode < 9;
}

/* What ends a phase, by the event that starts the next one. */
static int end_by_word(link *l, const link *next, int word)
{
    switch (word) {
    case X1_REVERSES:
    case X1_STICKS:
        l->what = END_V1;
        return l->side_1 != 0;
    case X2_REVERSES:
    case X2_STICKS:
        l->what = END_V2;
        return l->side_2 != 0;
    case X1_HITS_STOP:
        l->what = END_STOP;
        l->side = l->side_1;
        return l->side_1 != 0;
    case X1_SLIPS:
        l->what = END_A1;
        l->side = next->side_1;
        return l->side_1 == 0 && next->side_1 != 0;
    case X2_SLIPS:
        l->what = END_A2;
        l->side = next->side_2;
        return l->side_2 == 0 && next->side_2 != 0;
    default:
        return 0;
    }
}

/* The event that stands at the end of a chain that was cut short is not told: the nearest zero. */
static void find_last_event(judge *j, link *l)
{
    const exact_motion m = exact_motion_of(&j->in, l->side_1, l->side_2);
    const exact_point z = exact_push(&m, j->z, l->T);
    const int what[6] = {END_V1, END_V2, END_A1, END_A1, END_A2, END_A2};
    quad nearest = -1;
    l->what = END_STOP;
    l->side = l->side_1;
    if (l->side_1 != 0 && isfinite(l->side_1 > 0 ? j->problem->x1_max : j->problem->x1_min)) {
        nearest = absolute(z.x - (l->side_1 > 0 ? j->in.x1_max : j->in.x1_min)) / absolute(z.v1);
    }
    for (int i = 0; i < 6; i++) {
        const int moves = what[i] == END_V1 || what[i] == END_A1 ? l->side_1 : l->side_2, side = i % 2 ? 1 : -1;
        quad value, rate;
        if ((moves != 0) != (i < 2) || (what[i] == END_A1 && is_blocked(&j->in, z.x, side))) {
            continue;
        }
        exact_zero_at_end(&j->in, &m, &z, what[i], side, &value, &rate);
        if (rate != 0 && (nearest < 0 || absolute(value / rate) < nearest)) {
            nearest = absolute(value / rate);
            l->what = what[i];
            l->side = side;
        }
    }
}

static int rests(judge *j, int n)
{
    int close_1, close_2;
    const link *l = &j->links[n];
    if (l->side_1 != 0 || l->side_2 != 0) {
        return blame(j, NO_REST, n, 0);
    }
    const int side_1 = goes(&j->in, &j->z, 1, 0, &close_1), side_2 = goes(&j->in, &j->z, 2, 0, &close_2);
    return side_1 == 0 && side_2 == 0 ? 1 : blame(j, NO_REST, n, close_1 || close_2);
}

/* y = 0 at the start with the leg extending is the ending. */
static int leaves_at_once(const judge *j)
{
    const link *l = &j->links[0];
    const exact_motion m = exact_motion_of(&j->in, l->side_1, l->side_2);
    if (j->z.y != 0 || (l->side_1 == 0 && l->side_2 == 0)) {
        return 0;
    }
    const watched g = function_of(&m, &j->z, &j->z, 0, 1, 0, 0);
    int order = 1;
    while (order < 3 && absolute(g.d[order]) <= EXACT * g.scale[order]) {
        order++;
    }
    return g.d[order] < 0;
}

static int chain_is_right(judge *j)
{
    const checker_answer *a = j->answer;
    const int last = a->count - 1;
    for (int n = 0; n <= last; n++) {
        if (!sides_of(&j->links[n], j->phases[n].mode)) {
            return blame(j, BAD_WORD, n, 0);
        }
        j->links[n].T = (n < last ? j->phases[n + 1].t : a->duration) - j->phases[n].t;
    }
    if (!begins_well(j)) {
        return 0;
    }
    if (leaves_at_once(j)) {
        return a->ending == TAKEOFF && last == 0 && a->duration == 0 ? 1 : blame(j, TAKES_OFF_AT_0, 0, 0);
    }
    for (int n = 0; n < last; n++) {
        if (!end_by_word(&j->links[n], &j->links[n + 1], j->phases[n + 1].event)) {
            return blame(j, BAD_WORD, n + 1, j->phases[n + 1].event == NOTHING);
        }
        if (!phase_is_right(j, n) || !goes_on_well(j, n)) {
            return 0;
        }
    }
    link *l = &j->links[last];
    l->what = a->ending == TAKEOFF ? END_Y : END_TIME;
    if (a->ending == REST) {
        return rests(j, last);
    }
    if (l->side_1 == 0 && l->side_2 == 0) {
        return blame(j, NO_REST, last, 0);
    }
    if (a->ending == TOO_MANY_PHASES) {
        find_last_event(j, l);
    }
    if (a->ending == HORIZON && a->duration != j->problem->horizon) {
        return blame(j, NO_HORIZON, last, 0);
    }
    return phase_is_right(j, last);
}

/* ---- errors and conditions ---- */

static double larger(double a, double b)
{
    return a > b || isnan(a) ? a : b;
}

static double energy_unit(const checker_problem *p)
{
    const double v = fabs(p->v2) > 1 ? fabs(p->v2) : 1;
    return p->m_s * v * v / 2;
}

static void measure(judge *j)
{
    const checker_answer *a = j->answer;
    const exact_point start = {j->problem->x1, j->problem->y, j->problem->v1, j->problem->v2};
    const exact_point *z = &j->z;
    double worst = fabs((double)(j->time - a->duration)) / j->unit;
    worst = larger(fabs((double)(z->x - a->x1)) / 0.1, worst);
    worst = larger(fabs((double)(z->x - z->y - ((quad)a->x1 - a->y))) / 0.1, worst);
    worst = larger(fabs((double)(z->v1 - a->v1)), worst);
    worst = larger(fabs((double)(z->v2 - a->v2)), worst);
    for (int n = 1; n < a->count; n++) {
        worst = larger(fabs((double)(j->links[n - 1].time - j->phases[n].t)) / j->unit, worst);
    }
    j->verdict->error_state = worst;
    j->verdict->error_aed = fabs((double)(exact_gain(&j->in, &start, z) - a->aed)) / energy_unit(j->problem);
}

enum { INPUTS = sizeof(quick_inputs) / sizeof(long double), X1_MIN = 13, X1_MAX, X1, OUTPUTS = 6 };

/* Time, end state and AED, scaled, of the chain from other inputs; 0 if it cannot be followed. */
static int outcome_of(const judge *j, const quick_inputs *in, long double out[OUTPUTS])
{
    const long double unit = j->unit;
    const quick_point start = {in->x1, in->y, in->v1, in->v2};
    quick_point z = start;
    long double time = 0;
    if (j->phases[0].v1 == 0) { /* against a stop it is lost at once, wherever it goes then */
        z.v1 = 0;
    }
    for (int n = 0; n < j->answer->count; n++) {
        const link *l = &j->links[n];
        const quick_motion m = quick_motion_of(in, l->side_1, l->side_2);
        long double T = l->what == END_TIME ? j->problem->horizon - time : l->T;
        if (n == j->answer->count - 1 && (j->answer->ending == REST || j->answer->duration == 0)) {
            break;
        }
        if (!quick_to_end(in, &m, l->what, l->side, &T, &z)) {
            return 0;
        }
        quick_land(in, l->what, l->side, &z);
        time += T;
    }
    const long double found[OUTPUTS] = {time / unit, z.x / 0.1L, z.v1, (z.x - z.y + in->L0 + in->c) / 0.1L, z.v2,
                                        quick_gain(in, &start, &z) / energy_unit(j->problem)};
    memcpy(out, found, sizeof found);
    return 1;
}

/* max |q(p (1 + d)) - q(p)|/(d scale) over outputs and inputs, which are those of the solver: y, not x2. */
static void condition(judge *j)
{
    const checker_problem *p = j->problem;
    const long double d = 1e-9L;
    const quick_inputs base = {p->m_eff, p->m_s,       p->k,         p->L0,     p->c, p->b1,     p->b2,     p->f1, p->f2,
                               p->f1_excess, p->f2_excess, p->gamma2, p->g, p->x1_min, p->x1_max, p->x1, p->v1, p->v2,
                               p->u,         p->y};
    long double here[OUTPUTS], there[OUTPUTS], values[INPUTS];
    double state = 0, aed = 0;
    int follows = outcome_of(j, &base, here);
    memcpy(values, &base, sizeof values);
    for (int i = 0; i < INPUTS && follows; i++) {
        quick_inputs other = base;
        if (!isfinite(values[i]) || values[i] == 0) {
            continue;
        }
        long double moved[INPUTS];
        memcpy(moved, &base, sizeof moved);
        moved[i] *= 1 + d;
        memcpy(&other, moved, sizeof other);
        if (i >= X1_MIN && i <= X1) { /* a start at a stop moves with it */
            other.x1 *= i != X1 && base.x1 == values[i] ? 1 + d : 1;
            other.x1_min *= i != X1_MIN && base.x1_min == values[i] ? 1 + d : 1;
            other.x1_max *= i != X1_MAX && base.x1_max == values[i] ? 1 + d : 1;
        }
        follows = outcome_of(j, &other, there);
        for (int q = 0; q < OUTPUTS - 1; q++) {
            state = larger(fabs((double)((there[q] - here[q]) / d)), state);
        }
        aed = larger(fabs((double)((there[OUTPUTS - 1] - here[OUTPUTS - 1]) / d)), aed);
    }
    j->verdict->condition_state = follows ? state : INFINITY;
    j->verdict->condition_aed = follows ? aed : INFINITY;
}

void checker_judge(const checker_problem *problems, const checker_answer *answers, const checker_phase *phases,
                   int64_t count, int32_t with_condition, checker_verdict *verdicts)
{
    for (int64_t i = 0; i < count; i++) {
        const checker_answer *a = &answers[i];
        const double unit = sqrt(problems[i].m_s / problems[i].k);
        checker_verdict *v = &verdicts[i];
        link *links = calloc((size_t)a->count, sizeof *links);
        judge j = {&problems[i], a, phases + a->first, inputs_of(&problems[i]), links, 0, {0, 0, 0, 0},
                   unit > a->duration ? unit : a->duration, v};
        memset(v, 0, sizeof *v);
        v->condition_state = v->condition_aed = NAN;
        v->error_state = v->error_aed = NAN;
        if (links == NULL) {
            v->outcome = UNSETTLED;
        } else if (chain_is_right(&j)) {
            measure(&j);
            if (with_condition) {
                condition(&j);
            }
        }
        free(links);
    }
}
