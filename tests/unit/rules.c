/* The rules of the certificate, each asked alone about intervals in which an event function comes near zero, and judged
 * in 113 bits: the propagator is one of its own, that a function stays above a value is proven by tests/oracle/checker.
 * In double precision with -DDOUBLE. */
#include <float.h>
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

/* Where the solver takes the modal form, g = final + F exp(-a t) + exp(-p t/2) (P cos w t + Q sin w t), those as they
 * are rounded, and the numerator that follows. */
typedef struct {
    quad s1, s2, s3, start, H3, H2, H1;
    int modal;
    quad a, mean, w, final, F, P, Q;
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
    const quad R = w->Wd + g->a * w->W, of_sine = g->w * R, of_cosine = w->Wdd + g->a * w->Wd + g->mean * R;
    const quad left = w->Wdd + 2 * g->mean * w->Wd + (g->w * g->w + g->mean * g->mean) * w->W;
    if (g->modal) {
        return absolute(g->final) + absolute(g->F * left) + absolute(g->P * of_cosine) + absolute(g->Q * of_sine)
             + t * absolute(rate_at(g, w));
    }
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

/* ---- an interval in which a function comes near zero ---- */

typedef struct {
    double a, p, q;      /* poles; a = 0: one mass is held */
    double H3, H2;       /* of the numerator; H1 and the start are chosen such that g comes near zero */
    double low, length;  /* of the interval: in nodes, and as a share of the longest that the solver takes from there */
    double place, depth; /* the share of it at which g' is 0, and g there in eps of its terms */
    double reach;        /* lengths for which a quiet time is followed */
    double from_zero;    /* 1: g begins at 0; H2 and H1 are chosen */
} drawn;

typedef struct {
    OF(hopform_poles) poles;
    OF(hopform_node) node;
    OF(event_set) set;
    OF(interval) in;
    OF(evaluations) evaluations;
    exact g;
    real high;
} asked;

/* The poles as the solver gets them: the pair of the mass that moves, or the factors of the cubic. */
static void take_poles(const drawn *it, asked *at)
{
    const double a = it->a, p = it->p, q = it->q;
    at->poles = a > 0.0 ? OF(factor_cubic)((real)(a + p), (real)(q + a * p), (real)(a * q))
                        : OF(pair_alone)((real)p, (real)q);
    at->node = OF(node_of_poles)(&at->poles, 1);
    at->g.s1 = (quad)at->poles.a + at->poles.p;
    at->g.s2 = at->poles.q + (quad)at->poles.a * at->poles.p;
    at->g.s3 = (quad)at->poles.a * at->poles.q;
}

/* An interval that the solver may take: up to the node, or four times as far as before, less than half a period. */
static void take_interval(const drawn *it, asked *at)
{
    const double node = at->node.t, low = it->low * node, far = 3.0 * low > node ? 3.0 * low : node;
    const double half = 0.95 * at->node.half_period;
    const real omega = (real)low >= at->node.modal ? at->node.omega : 0;
    at->g.modal = omega > 0;
    at->in.low = OF(propagator_in_form)(&at->poles, omega, (real)low);
    at->in.found = -1;
    at->in.count = 0;
    at->evaluations.left = INT32_MAX;
    at->in.evaluations = &at->evaluations;
    at->high = (real)(low + it->length * (far < half ? far : half));
    at->in.high = OF(propagator_in_form)(&at->poles, omega, at->high);
}

/* The numerator of the modal form. */
static void take_numerator(exact *g)
{
    const quad rate = g->w * g->Q - g->mean * g->P;
    const quad curvature = (g->mean * g->mean - g->w * g->w) * g->P - 2 * g->mean * g->w * g->Q;
    const quad third = -2 * g->mean * curvature - (g->w * g->w + g->mean * g->mean) * rate;
    const quad H3 = rate - g->a * g->F, second = curvature + g->a * g->a * g->F;
    g->start = g->final + g->F + g->P;
    g->H3 = H3;
    g->H2 = second + g->s1 * H3;
    g->H1 = third - g->a * g->a * g->a * g->F + g->s1 * second + g->s2 * H3;
}

/* The function in its modal form, rounded, which at t is above zero by so many eps of its terms. */
static void take_modes(asked *at, quad t, quad depth)
{
    exact *g = &at->g;
    const quad a = at->poles.a, p = at->poles.p, q = at->poles.q, chi = a * a - p * a + q;
    const quad e = (g->H1 - a * (g->H2 - a * g->H3)) / chi;
    const response w = response_at(g, t);
    g->a = a;
    g->mean = p / 2;
    g->w = checker_sqrt(q - g->mean * g->mean);
    g->F = (real)(-e / a);
    g->P = (real)(-(g->H2 - a * g->H3 - (p - a) * e) / q);
    g->Q = (real)((g->H3 - e + g->mean * g->P) / g->w);
    g->final = 0;
    take_numerator(g);
    g->final = -value_at(g, &w);
    g->final = (real)(g->final + depth * EPS * size_at(g, &w, t));
    take_numerator(g);
    const OF(event_function) function = {(real)g->F, (real)g->P, (real)g->Q, 0, (real)g->final, 0, 0, 0, 1, 0,
                                         true, false};
    at->set.function[0] = function;
}

/* The function that comes near zero where it is told to, rounded. */
static void take_function(const drawn *it, asked *at)
{
    exact *g = &at->g;
    const quad t = at->in.low.t + (quad)it->place * ((quad)at->high - at->in.low.t);
    const response w = response_at(g, t);
    g->start = 0;
    g->H3 = it->H3;
    g->H2 = it->H2;
    g->H1 = -(g->H3 * w.Wdd + g->H2 * w.Wd) / w.W;
    if (!(g->s3 > 0)) { /* of one mass alone there is no H1 */
        g->H2 = -g->H3 * w.Wdd / w.Wd;
        g->H1 = 0;
    } else if (it->from_zero > 0.0) {
        const quad other = w.Wd * w.W1 - w.W * w.W;
        g->H3 = absolute(g->H3);
        g->H2 = g->H3 * (w.Wd * w.W - w.Wdd * w.W1) / other;
        g->H1 = g->H3 * (w.Wdd * w.W - w.Wd * w.Wd) / other;
    }
    const quad start = it->from_zero > 0.0 ? 0 : -value_at(g, &w);
    const int sign = start < 0 ? -1 : 1;
    g->H3 = (real)(sign * g->H3);
    g->H2 = (real)(sign * g->H2);
    g->H1 = (real)(sign * g->H1);
    g->start = sign * start;
    g->start = (real)(it->from_zero > 0.0 ? 0 : g->start + (quad)it->depth * EPS * size_at(g, &w, t));
    const OF(event_function) function = {(real)g->H3, (real)g->H2, (real)g->H1, 0, (real)g->start, 0, 0, 0, 1, 0,
                                         true, false};
    at->set.poles = &at->poles;
    at->set.node = &at->node;
    at->set.count = 1;
    at->set.function[0] = function;
    if (g->modal) {
        take_modes(at, t, (quad)it->depth);
    }
}

/* The jets at both ends; 0 if g is not above zero there, or begins to rise from it, which all rules rest on. */
static int take_ends(asked *at)
{
    const OF(event_function) *g = &at->set.function[0];
    if (!(at->in.low.t > 0)) {
        at->in.low = OF(propagator_at_start)(&at->poles);
    }
    OF(jet) *from = &at->in.from[0], *to = &at->in.to;
    *from = at->in.low.t > 0 ? OF(jet_at)(&at->poles, g, &at->in.low) : OF(jet_at_start)(&at->poles, g);
    *to = OF(jet_at)(&at->poles, g, &at->in.high);
    return at->high > at->in.low.t && (from->value > 0 || (!(from->value < 0) && from->rate > 0))
        && !(to->value < -OF(rounding_of)(g, &at->in.high, to->rate));
}

enum { SIGNS, SLOPE, BERNSTEIN, QUIET, STILL, MINIMUM, SEARCH, RULES };

/* Whether a rule is asked, whether it says yes, and whether that is wrong. */
typedef struct {
    int32_t asked, says, wrong;
} said;

typedef struct {
    int32_t asked, intervals; /* that the search takes */
    said of[RULES];
} verdict;

/* What the page claims: so many eps of its terms g may lie below zero. */
typedef struct {
    double rounding;
} claim;

/* A rule that says of the time up to `high` that there is no zero: it is wrong if g falls below what the bound allows,
 * of terms of this size. */
static said no_zero(const asked *at, const claim *is, int may, int says, quad high, quad size)
{
    const int yes = may && says;
    const said it = {may, yes, yes && !stays_above(&at->g, -is->rounding * EPS * size, at->in.low.t, high)};
    return it;
}

static quad size_then(const asked *at, quad t)
{
    const response w = response_at(&at->g, t);
    return size_at(&at->g, &w, t);
}

/* The terms of which the bound is taken where the end of a quiet time is what is asked for. */
static quad start_size(const exact *g)
{
    return g->modal ? absolute(g->final) + absolute(g->F) + absolute(g->P) + absolute(g->Q) : absolute(g->start);
}

/* Rule 4: g is nowhere less than where its minimum is located, by what the bound allows there. */
static said minimum(const asked *at, const claim *is)
{
    const OF(jet) *from = &at->in.from[0], *to = &at->in.to;
    const OF(event_function) *f = &at->set.function[0];
    said it = {from->rate < 0 && !(to->rate < 0), 0, 0};
    if (it.asked) {
        OF(evaluations) evaluations = {INT32_MAX};
        const OF(propagator) least = OF(minimum_between)(&at->poles, f, at->in.high.omega, from, at->in.low.t, to,
                                                         at->high, &evaluations);
        const response w = response_at(&at->g, least.t);
        const quad floor = value_at(&at->g, &w) - is->rounding * EPS * size_at(&at->g, &w, least.t);
        it.says = 1;
        it.wrong = !stays_above(&at->g, floor, at->in.low.t, at->high);
    }
    return it;
}

static void judge_one(const drawn *it, asked *at, const claim *is, verdict *out)
{
    const OF(event_function) *f = &at->set.function[0];
    const OF(jet) *from = &at->in.from[0], *to = &at->in.to;
    const real low = at->in.low.t, h = at->high - low, bound = OF(rounding_of)(f, &at->in.high, to->rate);
    const real d = OF(deflated_derivative)(&at->set, f, &at->in.low, 1);
    const real d_then = OF(deflated_derivative)(&at->set, f, &at->in.high, -1);
    const bool falls = OF(falls_for_certain)(f, &at->in.high, to->rate);
    const quad size = size_then(at, at->high), high = at->high, last = low + (quad)it->reach * h;
    const int rings = at->node.half_period < OF(HOPFORM_NEVER);

    out->of[SIGNS] = no_zero(at, is, 1, OF(has_no_root)(from, d, falls, d_then), high, size);
    const int positive = OF(stays_positive_by_slope)(at->node.pole, from, to, h, bound);
    out->of[SLOPE] = no_zero(at, is, !(d < 0), positive, high, size);
    const int above = rings && OF(stays_positive_by_bernstein)(&at->poles, f, at->in.high.omega, from, to, h, 0, bound);
    out->of[BERNSTEIN] = no_zero(at, is, rings, above, high, size);
    const quad until = (quad)low + OF(quiet_time)(&at->set, f, &at->in.low, from, bound);
    out->of[QUIET] = no_zero(at, is, 1, until > high, until < last ? until : last, size);
    const quad still = OF(root_free_until)(&at->set, &at->in);
    out->of[STILL] = no_zero(at, is, 1, still > high, still < last ? still : last, start_size(&at->g));
    out->of[MINIMUM] = minimum(at, is);

    const int found = OF(find_first_root)(&at->set, &at->in);
    const quad end = at->in.high.t;
    out->intervals = at->in.count;
    out->of[SEARCH] = no_zero(at, is, 1, found, end, size_then(at, end));
}

void judge(const drawn *cases, int32_t count, const claim *is, verdict *verdicts)
{
    for (int32_t i = 0; i < count; i++) {
        asked at = {0};
        take_poles(&cases[i], &at);
        take_interval(&cases[i], &at);
        take_function(&cases[i], &at);
        verdicts[i].asked = take_ends(&at);
        if (verdicts[i].asked) {
            judge_one(&cases[i], &at, is, &verdicts[i]);
        }
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
        const OF(hopform_node) node = OF(node_of_poles)(&poles, false);
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
        const int says = OF(turns_as_seen)(&node, &from, &to, length);
        const said verdict = {changes, says, says && changes != (from.rate * to.rate < 0)};
        verdicts[i] = verdict;
    }
}
