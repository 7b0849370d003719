/* Rules 3 and 4 of the certificate and how often a rate vanishes, each asked alone, and judged in 113 bits: the
 * propagator is one of its own, that a function stays above a value is proven by tests/oracle/checker. In double
 * precision with -DDOUBLE. */
#include <float.h>
#include <math.h>
#include <stdint.h>

#include "../oracle/checker/checker.h"

#ifdef DOUBLE
#include "hopform_f64.c"
typedef double real;
#define OF(name) name##_f64
static const quad EPS = DBL_EPSILON;
#else
#include "hopform_f32.c"
typedef float real;
#define OF(name) name##_f32
static const quad EPS = FLT_EPSILON;
#endif

/* ---- the exact function: g = start + H3 W' + H2 W + H1 int W, of poles and numerators as they are rounded ---- */

typedef struct {
    quad s1, s2, s3, start, H3, H2, H1;
} exact;

typedef struct {
    quad Wdd, Wd, W, W1;
} response;

/* W is what P(D) W = 0 and W'' = 1 at 0 make it: its power series over a time that is short for all poles, which is
 * doubled by the formulas of addition, W(t + s) = W(t) W''(s) + (W'(t) + s1 W(t)) W'(s) + (...) W(s). */
static response response_at(const exact *g, quad t)
{
    const quad s1 = g->s1, s2 = g->s2, s3 = g->s3, rate = s1 + checker_sqrt(s2);
    int doublings = 0;
    for (; t * rate > (quad)0.5; t /= 2) {
        doublings++;
    }
    quad d[4] = {1, -s1, s1 * s1 - s2, 0}; /* derivatives 2, 3, 4 and so on of W at 0 */
    response at = {0, 0, 0, 0};
    for (int n = 0; n < 30; n++) {
        quad power = d[0]; /* times t^n/n!, and of the integrals */
        for (int i = 1; i <= n; i++) {
            power *= t / i;
        }
        at.Wdd += power;
        at.Wd += power * t / (n + 1);
        at.W += power * t * t / ((n + 1) * (n + 2));
        at.W1 += power * t * t * t / ((n + 1) * (n + 2) * (n + 3));
        d[3] = -(s1 * d[2] + s2 * d[1] + s3 * d[0]);
        d[0] = d[1];
        d[1] = d[2];
        d[2] = d[3];
    }
    for (; doublings > 0; doublings--) {
        const response w = at;
        at.Wdd = w.Wdd * w.Wdd - s2 * w.Wd * w.Wd - 2 * s3 * w.W * w.Wd;
        at.Wd = 2 * w.Wd * w.Wdd + s1 * w.Wd * w.Wd - s3 * w.W * w.W;
        at.W = 2 * w.W * w.Wdd + w.Wd * w.Wd + 2 * s1 * w.W * w.Wd + s2 * w.W * w.W;
        at.W1 = w.W1 + w.W1 * w.Wdd + (w.W + s1 * w.W1) * w.Wd + (w.Wd + s1 * w.W + s2 * w.W1) * w.W;
    }
    return at;
}

/* W'', W', W and its integral of three poles, each as two numbers that add up to it. */
void propagator(double a, double p, double q, double t, double parts[4][2])
{
    const exact g = {.s1 = (quad)a + p, .s2 = q + (quad)a * p, .s3 = (quad)a * q};
    const response w = response_at(&g, t);
    const quad values[4] = {w.Wdd, w.Wd, w.W, w.W1};
    for (int i = 0; i < 4; i++) {
        parts[i][0] = (double)values[i];
        parts[i][1] = (double)(values[i] - parts[i][0]);
    }
}

static quad value_at(const exact *g, const response *w)
{
    return g->start + g->H3 * w->Wd + g->H2 * w->W + g->H1 * w->W1;
}

static quad rate_at(const exact *g, const response *w)
{
    return g->H3 * w->Wdd + g->H2 * w->Wd + g->H1 * w->W;
}

/* The sum of the magnitudes of its terms and of t g', of which the page's rounding bound is so many eps. */
static quad size_at(const exact *g, const response *w, quad t)
{
    return absolute(g->start) + absolute(g->H3 * w->Wd) + absolute(g->H2 * w->W) + absolute(g->H1 * w->W1)
         + t * absolute(rate_at(g, w));
}

/* Whether g is proven to stay above a value from one time to another. */
static int stays_above(const exact *g, quad floor, quad low, quad high)
{
    const response w = response_at(g, low), end = response_at(g, high);
    const quad third = -(g->s1 * w.Wdd + g->s2 * w.Wd + g->s3 * w.W);
    const quad fourth = -(g->s1 * third + g->s2 * w.Wdd + g->s3 * w.Wd);
    watched f;
    f.d[0] = value_at(g, &w) - floor;
    f.d[1] = rate_at(g, &w);
    f.d[2] = g->H3 * third + g->H2 * w.Wdd + g->H1 * w.Wd;
    f.d[3] = g->H3 * fourth + g->H2 * third + g->H1 * w.Wdd;
    f.end[0] = value_at(g, &end) - floor;
    f.end[1] = rate_at(g, &end);
    f.end_scale = size_at(g, &end, 0);
    f.scale[0] = size_at(g, &w, 0);
    for (int n = 1; n < 4; n++) {
        f.scale[n] = absolute(f.d[n]);
    }
    spectrum poles = {0, {0, 0, 0}, 0, 0, 0, 0, 0, 0, 0, 0};
    int32_t windows = 0;
    if (!(g->s3 > 0)) {
        checker_spectrum_of_two(g->s1, g->s2, &poles);
    } else if (!checker_spectrum_of_three(g->s1, g->s2, g->s3, &poles)) {
        return 0;
    }
    return high > low ? checker_stays_positive(&poles, &f, high - low, &windows) == CERTIFIED : f.d[0] > 0;
}

/* What a rule is asked, what it says, and whether that is wrong. */
typedef struct {
    int32_t asked, says, wrong;
} said;

/* ---- rule 4: the minimum between two times ---- */

typedef struct {
    double a, p, q;      /* poles; a = 0: one mass is held */
    double H3, H2;       /* of the numerator; H1 is chosen such that the rate is 0 inside */
    double low, length;  /* of the interval: in nodes, and as a share of the longest that a search takes from there */
    double place;        /* the share of it at which the rate is 0 */
} drawn;

static double node_of(const OF(hopform_poles) *poles, const OF(hopform_timescales) *scales)
{
    return (scales->half_period < OF(HOPFORM_NEVER) ? 0.785 : 2.984) / sqrt((double)poles->q);
}

/* The end of an interval that a search may take: a node, or four times as far as before, less than half a period. */
static real end_of_interval(const drawn *it, double node, double low, const OF(hopform_timescales) *scales)
{
    const double half = 0.95 * scales->half_period, far = 3.0 * low > node ? 3.0 * low : node;
    return (real)(low + it->length * (far < half ? far : half));
}

/* The function that falls, and whose rate vanishes where it is told to, rounded. */
static exact falling(const drawn *it, const OF(hopform_poles) *poles, quad t)
{
    exact g = {.s1 = (quad)poles->a + poles->p, .s2 = poles->q + (quad)poles->a * poles->p,
               .s3 = (quad)poles->a * poles->q, .H3 = it->H3, .H2 = it->H2};
    const response w = response_at(&g, t);
    if (g.s3 > 0) {
        g.H1 = -(g.H3 * w.Wdd + g.H2 * w.Wd) / w.W;
    } else { /* of one mass alone there is no H1 */
        g.H2 = -g.H3 * w.Wdd / w.Wd;
    }
    const quad start = -value_at(&g, &w);
    const int sign = start < 0 ? -1 : 1;
    const exact rounded = {g.s1, g.s2, g.s3, (real)(sign * start), (real)(sign * g.H3), (real)(sign * g.H2),
                           (real)(sign * g.H1)};
    return rounded;
}

/* It is asked where the rate is negative at the first time and not at the second, and says how many evaluations that
 * has taken. It is wrong if g falls below its value there by more than so many eps of its terms. */
void judge_minimum(const drawn *cases, int32_t count, double rounding, said *verdicts)
{
    for (int32_t i = 0; i < count; i++) {
        const drawn *it = &cases[i];
        const double a = it->a, p = it->p, q = it->q;
        const OF(hopform_poles) poles = a > 0.0 ? OF(factor_cubic)((real)(a + p), (real)(q + a * p), (real)(a * q))
                                                : OF(pair_alone)((real)p, (real)q);
        const OF(hopform_timescales) scales = OF(timescales_of_poles)(&poles);
        const double node = node_of(&poles, &scales);
        const real low = (real)(it->low * node), high = end_of_interval(it, node, low, &scales);
        const exact g = falling(it, &poles, low + (quad)it->place * ((quad)high - low));
        const OF(numerator) h = {(real)g.H3, (real)g.H2, (real)g.H1};
        const OF(event_function) f = OF(event_function_of)(&h, (real)g.start);
        const OF(propagator) begins = OF(propagator_at)(&poles, low), ends = OF(propagator_at)(&poles, high);
        const OF(jet) from = low > 0 ? OF(jet_at)(&poles, &f, &begins) : OF(jet_at_start)(&poles, &f);
        const OF(jet) to = OF(jet_at)(&poles, &f, &ends);
        said verdict = {high > low && from.rate < 0 && !(to.rate < 0), 0, 0};
        if (verdict.asked) {
            OF(evaluations) evaluations = {INT32_MAX};
            const OF(propagator) at = OF(minimum_between)(&poles, &f, &from, low, &to, high, &evaluations);
            const response w = response_at(&g, at.t);
            const quad floor = value_at(&g, &w) - rounding * EPS * size_at(&g, &w, at.t);
            verdict.says = (INT32_MAX - evaluations.left) / OF(EVALUATION_BY_W);
            verdict.wrong = !stays_above(&g, floor, low, high);
        }
        verdicts[i] = verdict;
    }
}

/* ---- rule 3: when a mass that slips alone comes to rest ---- */

typedef struct {
    double p, q, v, acceleration;
} slipping;

/* v'' + p v' + q v = 0 from v and v'. */
static exact velocity(quad p, quad q, quad v, quad acceleration)
{
    const exact it = {.s1 = p, .s2 = q, .start = v, .H3 = acceleration, .H2 = -q * v};
    return it;
}

/* The time is that of numbers within `eps` eps: with more v, v' and p and less q the mass comes to rest no sooner, with
 * less and more no later. A mass that never does is followed for a few time constants. */
void judge_rest(const slipping *cases, int32_t count, double eps, said *verdicts)
{
    for (int32_t i = 0; i < count; i++) {
        const real p = (real)cases[i].p, q = (real)cases[i].q, v = (real)cases[i].v, acc = (real)cases[i].acceleration;
        const OF(hopform_poles) poles = OF(pair_alone)(p, q);
        const real time = OF(time_to_rest)(&poles, v, acc);
        const quad k = eps * EPS, more = k * absolute(acc);
        const exact late = velocity(p * (1 + k), q * (1 - k), v * (1 + k), acc + more);
        const exact early = velocity(p * (1 - k), q * (1 + k), v * (1 - k), acc - more);
        const int rests = time < OF(HOPFORM_NEVER);
        const quad until = rests ? time : 3 * (p / (quad)q + 1 / checker_sqrt(q));
        const response then = response_at(&early, until);
        const int too_late = rests && value_at(&early, &then) > 0;
        const said it = {1, rests, too_late || !stays_above(&late, 0, 0, until)};
        verdicts[i] = it;
    }
}

/* ---- how often a rate may vanish between two times, by its jets there ---- */

typedef struct {
    double a, p, q, zeros[2], length; /* where the rate vanishes */
} turning;

enum { PLACES = 64 };

void judge_turns(const turning *cases, int32_t count, said *verdicts)
{
    for (int32_t i = 0; i < count; i++) {
        const real a = (real)cases[i].a, p = (real)cases[i].p, q = (real)cases[i].q, length = (real)cases[i].length;
        const OF(hopform_poles) poles = OF(factor_cubic)(a + p, q + a * p, a * q); /* the most isolated one alone */
        const OF(hopform_timescales) scales = OF(timescales_of_poles)(&poles);
        const quad alone = poles.a;
        exact it = {.s1 = alone + poles.p, .s2 = poles.q + alone * poles.p, .s3 = alone * poles.q};
        const response w = response_at(&it, cases[i].zeros[0]), v = response_at(&it, cases[i].zeros[1]);
        const quad H[3] = {w.Wd * v.W - w.W * v.Wd, w.W * v.Wdd - w.Wdd * v.W, w.Wdd * v.Wd - w.Wd * v.Wdd};
        const quad size = absolute(H[0]) + absolute(H[1]) + absolute(H[2]);
        const OF(numerator) h = {(real)(H[0] / size), (real)(H[1] / size), (real)(H[2] / size)};
        const OF(event_function) g = OF(event_function_of)(&h, 0);
        const OF(propagator) end = OF(propagator_at)(&poles, length);
        const OF(jet) from = OF(jet_at_start)(&poles, &g), to = OF(jet_at)(&poles, &g, &end);
        it.H3 = h.H3;
        it.H2 = h.H2;
        it.H1 = h.H1;
        const response step = response_at(&it, (quad)length / PLACES);
        const quad w2 = step.W, w1 = step.Wd, w0 = step.Wdd;
        const quad later[3][3] = {{w0 + it.s1 * w1 + it.s2 * w2, w1 + it.s1 * w2, w2},
                                  {-it.s3 * w2, w0 + it.s1 * w1, w1},
                                  {-it.s3 * w1, -it.s2 * w1 - it.s3 * w2, w0}};
        quad y[3] = {it.H3, it.H2 - it.s1 * it.H3, 0}; /* the rate and its derivatives */
        y[2] = it.H1 - it.s1 * y[1] - it.s2 * y[0];
        int changes = 0;
        for (int n = 1; n <= PLACES; n++) {
            const quad from_here[3] = {y[0], y[1], y[2]};
            for (int row = 0; row < 3; row++) {
                y[row] = later[row][0] * from_here[0] + later[row][1] * from_here[1] + later[row][2] * from_here[2];
            }
            changes += from_here[0] * y[0] < 0;
        }
        const int says = OF(turns_as_seen)(&scales, &from, &to, length);
        const said verdict = {changes, says, says && changes != (from.rate * to.rate < 0)};
        verdicts[i] = verdict;
    }
}
