/* SPDX-License-Identifier: MIT-0
 *
 * The first event of a phase: the earliest root of its event functions, certified to be the earliest.
 *
 * An event function of a phase is g(t) = start + H3 W' + H2 W + H1 W1 + H0 W2 with the three poles of the phase,
 * positive right after its start; an event is its first root. H0 is 0 but for the distance to a stop and the height of
 * a foot that flies. A function that is known to be monotone needs no certificate. The search goes from interval to
 * interval. In each, roots are predicted from the values and derivatives at both ends, located by a step of
 * Householder's and one of Newton's, and certified to be the first by the numbered rules of
 * docs/explanation/certificate.md:
 *
 * Rule 1, Bernstein's coefficients: where the pair rings, those of the quintic through the jets at both ends exceed
 * what it may be off.
 * Rule 2, sign variations (Budan and Fourier for exponential polynomials): on an interval shorter than half a period of
 * the pair, the number of roots of g is at most V(from) - V(to) + c. V counts the sign changes of (g, g', d), c is 1 if
 * d changes its sign, and d = g'' + a g' is the derivative of g with the real pole removed (deflated), which has at
 * most one root there. Of three real poles the fastest is removed.
 * Rule 3, closed forms: the time to rest of a mass that slips alone.
 * Rule 4, minima: where g' has one root, the minimum is located.
 * Rule 5, quiet times: while the slow part of g exceeds the envelope of the pair there is no root; of three real poles,
 * while their kernels cannot take g to 0.
 */
#ifndef HOPFORM_FIRST_EVENT_H_real
#define HOPFORM_FIRST_EVENT_H_real

#include "phase_real.h"

/* A function may be located at a later root first, and so more than once: at each of its roots in an interval, of which
 * rule 2 leaves three at most, or four in flight. */
enum { MOST_EVENT_FUNCTIONS_real = 4, MOST_TRIES_real = 4 * MOST_EVENT_FUNCTIONS_real };

/* Intervals that are certified, or cut, in a phase at most. */
#ifndef HOPFORM_MOST_INTERVALS
#define HOPFORM_MOST_INTERVALS 10000
#endif

/* An event function. `owner` and `side` are the caller's. One that is monotone until the end of the phase crosses zero
 * once at most and needs no certificate. The distance to a limit is so until the velocity of its element vanishes, and
 * a touch of it is no event. */
typedef struct {
    real H3, H2, H1, H0; /* its numerator */
    real start;
    real cancels; /* the magnitudes that the start is a difference of, where it is rounded by more than its own */
    real decaying, decay; /* a further term and its rate: in flight, what a damper leaves of the leg's compression */
    int32_t owner;
    int32_t side;
    bool needs_certificate;
    bool touch_is_no_event;
} event_function_real;

/* A function with this numerator and value at the start, of which nothing is known. */
static inline event_function_real event_function_of_real(const numerator_real *h, real start) {
    const event_function_real g = {h->H3, h->H2, h->H1, 0.0, start, 0.0, 0.0, 0.0, 0, 0, true, false};
    return g;
}

/* The active event functions of a phase, in order of tie-break priority. */
typedef struct {
    const hopform_poles_real *poles;
    const hopform_node_real *node;
    int32_t count;
    event_function_real function[MOST_EVENT_FUNCTIONS_real];
} event_set_real;

/* A time since the start of the phase, and the propagator there. */
typedef struct {
    real t;
    basis_real basis;
    real W_third; /* W''' */
} propagator_real;

/* That of any poles at the start of a phase. */
static inline propagator_real propagator_at_start_real(const hopform_poles_real *poles) {
    const propagator_real at = {0.0, {1.0, 0.0, 0.0, 0.0, 0.0}, -poles->s_1};
    return at;
}

/* Value and derivatives of an event function. */
typedef struct {
    real value;
    real rate;
    real curvature;
    real third;
} jet_real;

static inline real third_of_basis_real(const hopform_poles_real *poles, const basis_real *basis) {
    return -(poles->s_1 * basis->Wdd + poles->s_2 * basis->Wd + poles->s_3 * basis->W);
}

static inline propagator_real propagator_of_real(const hopform_poles_real *poles, real t, const basis_real *basis) {
    const propagator_real at = {t, *basis, third_of_basis_real(poles, basis)};
    return at;
}

static inline propagator_real propagator_at_real(const hopform_poles_real *poles, real t) {
    const basis_real basis = basis_at_real(poles, t);
    return propagator_of_real(poles, t, &basis);
}

/* Whether a function has a further term, which decays: only where a damper is in the leg. */
static inline bool has_decay_real(const event_function_real *g) {
    return HOPFORM_LEG_HAS_DAMPER && fabs_real(g->decaying) > 0.0;
}

/* The n-th derivative of a function from that of its other terms. */
static inline real with_decay_real(const event_function_real *g, real t, int n, real others) {
    if (!has_decay_real(g)) { return others; }
    real value = g->decaying * exponential_real(-g->decay * t);
    for (int i = 0; i < n; i++) {
        value *= -g->decay;
    }
    return others + value;
}

static inline real value_at_real(const event_function_real *g, const propagator_real *at) {
    const basis_real *w = &at->basis;
    const real value = g->start + (g->H3 * w->Wd + g->H2 * w->W + g->H1 * w->W1 + g->H0 * w->W2);
    return with_decay_real(g, at->t, 0, value);
}

static inline real rate_at_real(const event_function_real *g, const propagator_real *at) {
    const basis_real *w = &at->basis;
    const real rate = g->H3 * w->Wdd + g->H2 * w->Wd + g->H1 * w->W + g->H0 * w->W1;
    return with_decay_real(g, at->t, 1, rate);
}

static inline real third_of_real(const hopform_poles_real *poles, const event_function_real *g,
                                 const propagator_real *at) {
    const basis_real *w = &at->basis;
    const real fourth = -(poles->s_1 * at->W_third + poles->s_2 * w->Wdd + poles->s_3 * w->Wd);
    const real third = g->H3 * fourth + g->H2 * at->W_third + g->H1 * w->Wdd + g->H0 * w->Wd;
    return with_decay_real(g, at->t, 3, third);
}

static inline jet_real jet_at_start_real(const hopform_poles_real *poles, const event_function_real *g) {
    jet_real jet;
    jet.value = g->start;
    jet.rate = g->H3;
    jet.curvature = g->H2 - g->H3 * poles->s_1;
    jet.third = g->H1 - poles->s_1 * jet.curvature - poles->s_2 * jet.rate;
    return jet;
}

/* Value, rate and curvature; the third derivative is 0 here. */
static inline jet_real short_jet_at_real(const event_function_real *g, const propagator_real *at) {
    const basis_real *w = &at->basis;
    const real curvature = g->H3 * at->W_third + g->H2 * w->Wdd + g->H1 * w->Wd + g->H0 * w->W;
    const jet_real jet = {value_at_real(g, at), rate_at_real(g, at), with_decay_real(g, at->t, 2, curvature), 0.0};
    return jet;
}

static inline jet_real jet_at_real(const hopform_poles_real *poles, const event_function_real *g,
                                   const propagator_real *at) {
    jet_real jet = short_jet_at_real(g, at);
    jet.third = third_of_real(poles, g, at);
    return jet;
}

/* Bound of what rounding may have done to the value of an event function. */
static inline real rounding_of_real(const event_function_real *g, const propagator_real *at, real rate) {
    return 16.0 * HOPFORM_EPS_real
           * (fabs_real(g->start) + g->cancels + fabs_real(g->H3 * at->basis.Wd) + fabs_real(g->H2 * at->basis.W)
              + fabs_real(g->H1 * at->basis.W1) + fabs_real(g->H0 * at->basis.W2) + at->t * fabs_real(rate));
}

/* ---- prediction ---- */

/* Where in (0, 1) of an interval of length h a function has a root after a value (or slope) above 0 and before a value
 * below: roughly, as the parabola with its slope at the start. Where it starts at 0 it is divided by the time first. */
static inline real rough_root_real(const jet_real *from, const jet_real *to, real h) {
    const bool above = from->value > 0.0;
    const real rise = h * from->rate;
    const real start = above ? from->value : rise;
    const real slope = above ? rise : 0.5 * h * h * from->curvature;
    const real square = slope * slope + 4.0 * start * (start + slope - to->value);
    const real below = sqrt_real(greater_real(square, 0.0)) - slope;
    const real share = 2.0 * start / (below > 0.0 ? below : 1.0);
    return ((start > 0.0) & (share < 1.0)) ? share : 0.75;
}

/* The polynomial of degree 6 through value, rate and curvature at both ends of an interval, and the third derivative at
 * its start, in x from 0 to 1: c0 + c1 x + c2 x^2 + c3 x^3 + x^4 (r0 + s1 (x - 1) + s2 (x - 1)^2). */
typedef struct {
    real c0, c1, c2, c3, r0, s1, s2;
} interpolant_real;

static inline interpolant_real interpolant_of_real(const jet_real *from, const jet_real *to, real h) {
    const real hh = 0.5 * h * h;
    const real c0 = from->value;
    const real c1 = h * from->rate;
    const real c2 = hh * from->curvature;
    const real c3 = (1.0 / 3.0) * h * hh * from->third;
    const real r0 = to->value - (c0 + c1 + c2 + c3);
    const real s1 = h * to->rate - (c1 + 2.0 * c2 + 3.0 * c3) - 4.0 * r0;
    const real s2 = hh * to->curvature - (c2 + 3.0 * c3) - 4.0 * s1 - 6.0 * r0;
    const interpolant_real p = {c0, c1, c2, c3, r0, s1, s2};
    return p;
}

enum { PREDICTION_STEPS_real = 3 };

/* Halley's step from x towards a root of it. */
static inline real prediction_step_real(const interpolant_real *p, real x) {
    const real y = x - 1.0;
    const real tail = p->r0 + y * (p->s1 + y * p->s2);
    const real tail_1 = p->s1 + 2.0 * y * p->s2;
    const real value = p->c0 + x * (p->c1 + x * (p->c2 + x * (p->c3 + x * tail)));
    const real slope = p->c1 + x * (2.0 * p->c2 + x * (3.0 * p->c3 + x * (4.0 * tail + x * tail_1)));
    const real bend = p->c2 + x * (3.0 * p->c3 + x * (6.0 * tail + x * (4.0 * tail_1 + x * p->s2)));
    const real below = slope * slope - value * bend;
    const real step = value * slope / (below > 0.0 ? below : 1.0);
    return below > 0.0 ? step : 0.0;
}

/* A root of it, from a guess. It guesses, too: no bound rests on it. */
static inline real refined_root_real(const interpolant_real *p, real x) {
    for (int n = 0; n < PREDICTION_STEPS_real; n++) {
        const real step = prediction_step_real(p, x);
        const real next = x - step;
        x = ((next > 0.0) & (next < 1.0)) ? next : x;
        if (fabs_real(step) < HOPFORM_PREDICTION_real * x) { break; }
    }
    return x;
}

/* Householder's step of third order towards a root. */
static inline real step_to_root_real(const jet_real *at) {
    const real square = at->rate * at->rate;
    const real below =
        6.0 * square * at->rate - 6.0 * at->value * at->rate * at->curvature + at->value * at->value * at->third;
    const bool usable = fabs_real(below) > 0.0;
    const real step = at->value * (6.0 * square - 3.0 * at->value * at->curvature) / (usable ? below : 1.0);
    return usable ? step : HOPFORM_NEVER_real;
}

/* Whether what a Taylor series of order CARRY leaves out over a time d before or after t is lost in rounding: its terms
 * fall as those of exp(r d) do, r above all poles, and near the start of a phase as powers of d/t. */
static inline bool is_near_real(const hopform_poles_real *poles, real t, real d) {
    const real share = t > 0.0 ? d / t : 1.0;
    return d * d * (poles->s_1 * poles->s_1 + poles->s_2) + share * share <= HOPFORM_CARRIED_SQUARE_real;
}

/* Five numbers, each the derivative of the one before it, a time d later, by Taylor series of order CARRY: of a
 * function whose derivatives behind the last of them obey w''' = -(s_1 w'' + s_2 w' + s_3 w). */
typedef struct {
    real w0, w1, w2, w3, w4;
} derivatives_real;

static inline derivatives_real carried_real(const hopform_poles_real *poles, const derivatives_real *from, real d) {
    derivatives_real w = *from;
    derivatives_real sum = w;
    real power = 1.0;
#define ADD_ORDER(inverse)                                                                                             \
    {                                                                                                                  \
        const real next = -(poles->s_1 * w.w4 + poles->s_2 * w.w3 + poles->s_3 * w.w2);                                \
        power *= d * (inverse);                                                                                        \
        w.w0 = w.w1;                                                                                                   \
        w.w1 = w.w2;                                                                                                   \
        w.w2 = w.w3;                                                                                                   \
        w.w3 = w.w4;                                                                                                   \
        w.w4 = next;                                                                                                   \
        sum.w0 += power * w.w0;                                                                                        \
        sum.w1 += power * w.w1;                                                                                        \
        sum.w2 += power * w.w2;                                                                                        \
        sum.w3 += power * w.w3;                                                                                        \
        sum.w4 += power * w.w4;                                                                                        \
    }
    HOPFORM_CARRY_ORDERS_real(ADD_ORDER)
#undef ADD_ORDER
        return sum;
}

/* The propagator's basis d later. */
static inline basis_real carried_basis_real(const hopform_poles_real *poles, const basis_real *from, real d) {
    const derivatives_real w = {from->W2, from->W1, from->W, from->Wd, from->Wdd};
    const derivatives_real later = carried_real(poles, &w, d);
    const basis_real basis = {later.w4, later.w3, later.w2, later.w1, later.w0};
    return basis;
}

/* The fourth derivative of an event function, but for its sign: the poles give it from the others. */
static inline real fourth_of_real(const hopform_poles_real *poles, const event_function_real *g, const jet_real *at) {
    return poles->s_1 * at->third + poles->s_2 * at->curvature + poles->s_3 * at->rate - g->H0;
}

/* A step towards a root between two times: whether it lands on the root, and else where that is looked for next. */
typedef struct {
    bool lands;
    real low, high, next;
} root_step_real;

/* Of a function that is above zero at the lower time and falls to its root; `fourth` is its fourth derivative, but for
 * the sign. Householder's step is corrected by Newton's on the carried jet. It lands where the last of these is so
 * small that nothing is left of its square, and where the propagator can be carried there. */
static inline root_step_real step_between_real(const hopform_poles_real *poles, const jet_real *at, real fourth, real t,
                                               real low, real high) {
    const derivatives_real g = {at->value, at->rate, at->curvature, at->third, -fourth};
    const real first = -step_to_root_real(at);
    const derivatives_real there = carried_real(poles, &g, first);
    const real more = -there.w0 / (there.w1 < 0.0 ? there.w1 : -1.0);
    const real step = first + more;
    const real next = t + step;
    const bool lands = (at->rate < 0.0) & (next > low) & (next < high) & is_near_real(poles, next, step)
                       & (more * more <= 0.25 * HOPFORM_EPS_real * t * fabs_real(step));
    const real from = at->value > 0.0 ? t : low;
    const real to = at->value < 0.0 ? t : high;
    const root_step_real towards = {lands, from, to, lands ? next : t + first};
    return towards;
}

/* Go from a time at which g < 0 to the root of g behind an earlier one at which g > 0, from a guess. */
static inline void locate_root_real(const hopform_poles_real *poles, const event_function_real *g, real low,
                                    propagator_real *at, real guess) {
    real high = at->t;
    real t = guess;
    for (int n = 0; n < 100; n++) {
        if (!(t > low && t < high) || (n > 8 && n % 2 == 1)) {
            t = low + 0.5 * (high - low);
            if (!(t > low && t < high)) {
                *at = propagator_at_real(poles, high);
                return;
            }
        }
        at->t = t;
        at->basis = basis_at_real(poles, t);
        at->W_third = third_of_basis_real(poles, &at->basis);
        const jet_real jet = jet_at_real(poles, g, at);
        if (fabs_real(jet.value) <= HOPFORM_EPS_real * t * fabs_real(jet.rate)) { return; }
        const root_step_real step = step_between_real(poles, &jet, fourth_of_real(poles, g, &jet), t, low, high);
        /* The rate of the further term is none of the poles: no step is known to land. */
        if (step.lands && !has_decay_real(g)) {
            at->basis = carried_basis_real(poles, &at->basis, step.next - t);
            at->W_third = third_of_basis_real(poles, &at->basis);
            at->t = step.next;
            return;
        }
        low = step.low;
        high = step.high;
        t = step.next;
    }
}

/* ---- certificate ---- */

/* The deflated derivative d = g'' + l g', l the real pole, or the fastest of three: a function of the two poles that
 * are left, d = A R' + B R, R their impulse response, A and B the deflated numerator. The sum of jets would lose
 * (a/w)^2 eps of it, w the frequency of the pair. */
typedef struct {
    real A, B;
    real R, Rd;
    real sum, product; /* of the poles that are left: R'' = -(sum R' + product R) */
} deflated_real;

static inline deflated_real deflated_at_real(const hopform_poles_real *poles, const hopform_node_real *node,
                                             const event_function_real *g, const propagator_real *at) {
    const bool rings = node->half_period < HOPFORM_NEVER_real;
    const real sum = rings ? poles->p : node->second + node->third;
    const real product = rings ? poles->q : node->second * node->third;
    deflated_real d = {g->H2 - sum * g->H3,
                       g->H1 - product * g->H3,
                       at->basis.Wd + node->pole * at->basis.W,
                       at->basis.Wdd + node->pole * at->basis.Wd,
                       sum,
                       product};
    if (at->t > node->fades) { /* beside the real pole the pair has faded in W */
        const pair_real pair = pair_at_real(poles, at->t);
        d.R = pair.R;
        d.Rd = pair.Rd;
    }
    return d;
}

/* A number, or 0 if it is within the rounding of the sum of these terms: its sign says nothing then. */
static inline real decided_real(real value, real terms) {
    return fabs_real(value) > 16.0 * HOPFORM_EPS_real * terms ? value : 0.0;
}

/* The deflated derivative at an end of an interval. Where it is rounding, its sign inside is that of its derivative at
 * the start, `side` 1, and the other one at the end, `side` -1; 0 where that is rounding, too. */
static inline real deflated_derivative_real(const event_set_real *set, const event_function_real *g,
                                            const propagator_real *at, real side) {
    const deflated_real d = deflated_at_real(set->poles, set->node, g, at);
    const real of_A = d.A * d.Rd, of_B = d.B * d.R;
    const real value = decided_real(of_A + of_B, fabs_real(of_A) + fabs_real(of_B));
    if (fabs_real(value) > 0.0) { return value; }
    const real of_Rd = (d.B - d.sum * d.A) * d.Rd, of_R = d.product * (d.A * d.R);
    const real terms = fabs_real(of_Rd) + fabs_real(of_R);
    if (!(terms > 0.0) && side > 0.0) { return 1.0; /* d is 0 for good, and e^(lt) g' keeps its sign */ }
    return side * decided_real(of_Rd - of_R, terms);
}

/* Whether a rate is negative by more than rounding. */
static inline bool falls_for_certain_real(const event_function_real *g, const propagator_real *at, real rate) {
    const basis_real *w = &at->basis;
    const real terms = fabs_real(g->H3 * w->Wdd) + fabs_real(g->H2 * w->Wd) + fabs_real(g->H1 * w->W);
    return decided_real(rate, terms) < 0.0;
}

/* Rule 2: true if g, above zero at both ends of an interval, has no root in it; d is g'' + l g', or 0 where its sign is
 * rounding, and `falls_then` whether g' is negative at the end for certain. With V = 0, 1, 1, 2 for the signs (+, +),
 * (+, -), (-, -), (-, +) of (g', d), V at the start, less V at the end, and 1 if d changes its sign, is 0 or less. */
static inline bool has_no_root_real(const jet_real *from, real d, bool falls_then, real d_then) {
    const bool after_negative = falls_then | (d_then < 0.0);
    const bool after_positive = (!(from->rate < 0.0)) | (falls_then & (d_then > 0.0));
    return (after_negative | (d > 0.0)) & (after_positive | (d < 0.0));
}

/* Rule 2 where d is not negative at the start: e^(lt) g' is at no time below the lesser of its ends, so g has lost no
 * more than that times h. 1 - lh stands for e^(-lh). */
static inline bool stays_positive_by_slope_real(real l, const jet_real *from, const jet_real *to, real h, real bound) {
    const real left = from->value + bound;
    return left > -h * from->rate && left * greater_real(1.0 - l * h, 0.0) > -h * to->rate;
}

/* Rule 2 of a pair that rings, whatever the sign of d: e^(lt) g' grows by d e^(lt), and d has an amplitude that does
 * not grow. So g' falls below 0 by no more than its start, with its rounding, and h times that amplitude, and g has
 * lost no more than h times it. What has faded below the rounding of g is certified so. */
static inline bool has_faded_real(const event_set_real *set, const event_function_real *g, const propagator_real *start,
                                  const jet_real *from, real h, real bound) {
    const hopform_poles_real *poles = set->poles;
    const basis_real *w = &start->basis;
    const deflated_real deflated = deflated_at_real(poles, set->node, g, start);
    const real mu = 0.5 * poles->p;
    const real d = deflated.A * deflated.Rd + deflated.B * deflated.R;
    const real wY =
        (deflated.B - mu * deflated.A) * deflated.Rd + (mu * deflated.B - poles->q * deflated.A) * deflated.R;
    const real amplitude = sqrt_real(d * d + wY * wY / (poles->q - mu * mu));
    const real rounding =
        16.0 * HOPFORM_EPS_real * (fabs_real(g->H3 * w->Wdd) + fabs_real(g->H2 * w->Wd) + fabs_real(g->H1 * w->W));
    const real falls = rounding - lesser_real(from->rate, 0.0) + 1.001 * h * amplitude;
    return from->value + bound > h * falls;
}

/* Bound of the sixth derivative of an event function whose pair rings: the envelopes of its modes. */
static inline real sixth_derivative_bound_real(const hopform_poles_real *poles, const event_function_real *g) {
    const real mu = 0.5 * poles->p;
    const real ww = poles->q - mu * mu;
    const real a = poles->a;
    const real e = (g->H1 - a * (g->H2 - a * g->H3)) / residue_real(poles);
    const real c = g->H3 - e;
    const real sw = g->H2 - g->H3 * poles->s_1 + a * e + mu * c;
    return poles->q * poles->q * sqrt_real(poles->q * (c * c + sw * sw / ww)) + a * a * a * a * a * fabs_real(e);
}

/* Rule 1: Bernstein's coefficients of the quintic through value, slope and curvature at both ends, from which g differs
 * by at most M6 t^3 (h - t)^3/720; those that a root of order 0 or 1 at an end makes 0 do not count. */
static inline bool stays_positive_by_bernstein_real(const hopform_poles_real *poles, const event_function_real *g,
                                                    const jet_real *from, const jet_real *to, real h, bool root_at_end,
                                                    real rounding) {
    const real M6 = sixth_derivative_bound_real(poles, g);
    const real f = 0.2 * h;
    const real tw = 0.05 * h * h;
    const real b1 = from->value + f * from->rate;
    const real b2 = b1 + f * from->rate + tw * from->curvature;
    const real b4 = to->value - f * to->rate;
    const real b3 = b4 - f * to->rate + tw * to->curvature;
    real low = lesser_real(lesser_real(b1, b2), lesser_real(b3, b4));
    const real at_start = lesser_real(low, from->value);
    low = from->value > 0.0 ? at_start : low;
    const real at_end = lesser_real(low, to->value);
    low = root_at_end ? low : at_end;
    const real hhh = h * h * h;
    return low > M6 * hhh * hhh / 43200.0 + rounding;
}

/* Whether the curvature of an event function is more than what rounding may have left of it. */
static inline bool bends_real(const event_function_real *g, const propagator_real *at, real curvature) {
    const basis_real *w = &at->basis;
    const real terms = fabs_real(g->H3 * at->W_third) + fabs_real(g->H2 * w->Wdd) + fabs_real(g->H1 * w->Wd);
    return fabs_real(curvature) > 64.0 * HOPFORM_EPS_real * terms;
}

/* Rule 4: the minimum of g between two times between which its rate becomes positive: a root of the rate, by
 * Householder's method, until a further step changes the value by less than rounding does. Where the curvature is
 * rounding, a step says nothing: then until g cannot fall by more than that between the times that enclose the root. */
static inline propagator_real minimum_between_real(const hopform_poles_real *poles, const event_function_real *g,
                                                   const jet_real *from, real low, const jet_real *to, real high) {
    const jet_real rate_from = {-from->rate, -from->curvature, -from->third, fourth_of_real(poles, g, from)};
    const jet_real rate_to = {-to->rate, -to->curvature, -to->third, 0.0};
    const real apart = high - low;
    const interpolant_real p = interpolant_of_real(&rate_from, &rate_to, apart);
    real t = low + apart * refined_root_real(&p, rough_root_real(&rate_from, &rate_to, apart));
    real falls_by = -from->rate; /* at the lower time */
    propagator_real at = propagator_at_real(poles, t);
    for (int n = 0; n < 100; n++) {
        const jet_real jet = jet_at_real(poles, g, &at);
        const jet_real falls = {-jet.rate, -jet.curvature, -jet.third, fourth_of_real(poles, g, &jet)};
        const real step = step_to_root_real(&falls);
        const real bound = rounding_of_real(g, &at, 0.0);
        const bool is_far = !(fabs_real(jet.rate * jet.third) < 0.01 * jet.curvature * jet.curvature); /* or fading */
        const bool is_near = !is_far & (jet.curvature > 0.0) & (fabs_real(step * jet.rate) <= bound);
        if (is_near && bends_real(g, &at, jet.curvature)) { break; }
        falls_by = jet.rate < 0.0 ? -jet.rate : falls_by;
        low = jet.rate < 0.0 ? t : low;
        high = jet.rate < 0.0 ? high : t;
        if ((high - low) * falls_by <= bound) { break; }
        t = n > 8 && n % 2 == 1 ? low : t - step;
        if (!(t > low && t < high)) { t = low + 0.5 * (high - low); }
        at = propagator_at_real(poles, t);
    }
    return at;
}

/* Where d has its root within an interval: the chord's, but not behind the middle, because the chord of what fades fast
 * leads to the end each time; a quarter of it where d has no two signs. */
static inline real cut_between_real(real d, real d_then, real h) {
    const bool changes = (d < 0.0) != (d_then < 0.0) && fabs_real(d_then) > 0.0;
    const real share = changes ? d / (d - d_then) : 0.25;
    const real inside = share > 0.015625 ? (share < 0.5 ? share : 0.5) : 0.015625;
    return inside * h;
}

/* Rule 5 of a pair that rings: how long from `at` on g, for certain, has no root; NEVER if it has none at all.
 *
 * g' = x + r, where x fades with the real pole and r rings. What rings in g is X = -(r' + p r)/q, of an amplitude that
 * does not grow; what does not, g - X, falls by no more than x times the time, or x/a. r and X are taken from d, whose
 * share of r is (a - p) r + (r' + p r): d' + p d = D gives both without a difference of larger numbers. */
static inline real quiet_time_of_ringing_real(const event_set_real *set, const event_function_real *g,
                                              const propagator_real *start, const jet_real *at, real rounding) {
    const hopform_poles_real *poles = set->poles;
    const real mu = 0.5 * poles->p;
    const real ww = poles->q - mu * mu;
    const deflated_real deflated = deflated_at_real(set->poles, set->node, g, start);
    const real d = deflated.A * deflated.Rd + deflated.B * deflated.R;
    const real D = deflated.B * (deflated.Rd + poles->p * deflated.R) - poles->q * (deflated.A * deflated.R);
    const real r = (poles->a * d - D) / residue_real(poles);
    const bool stiff = poles->a * poles->a > poles->q;
    const real X = -(stiff ? (D + poles->q * r) / poles->a : d - (poles->a - poles->p) * r) / poles->q;
    const real x = at->rate - r;
    const real wY = r + mu * X;
    const real left = at->value - X - 1.001 * sqrt_real(X * X + wY * wY / ww) - rounding;
    const real time = -left / (x < 0.0 ? x : -1.0);
    const bool always = (!(x < 0.0)) | (left * poles->a > -x);
    const real quiet = always ? HOPFORM_NEVER_real : time;
    return left > 0.0 ? quiet : 0.0;
}

/* The same of three real poles, l_1 the fastest: g' is a sum of g', (D + l_1) g' and (D + l_2)(D + l_1) g' at the start
 * over kernels that are positive, of integrals 1/l_1, 1/(l_1 l_2) and 1/(l_1 l_2 l_3). The second is d, the third what
 * is left of its numerator without l_3, times R' + l_2 R. */
static inline real quiet_time_of_decay_real(const event_set_real *set, const event_function_real *g,
                                            const propagator_real *start, const jet_real *at, real rounding) {
    const real l_1 = set->node->pole;
    const real l_2 = set->node->second;
    const real l_3 = set->node->third;
    const real product = l_1 * l_2;
    if (!(product > 0.0)) { return 0.0; }
    const deflated_real d = deflated_at_real(set->poles, set->node, g, start);
    const real slowest = g->H1 - l_3 * (g->H2 - l_3 * g->H3);
    const real first = lesser_real(at->rate, 0.0);
    const real second = lesser_real(d.A * d.Rd + d.B * d.R, 0.0);
    const real third = lesser_real(slowest * (d.Rd + l_2 * d.R), 0.0);
    const real left = at->value + first / l_1 + second / product - rounding;
    const real falls = third / product;
    if (!(left > 0.0)) { return 0.0; }
    return !(falls < 0.0) || left * l_3 > -falls ? HOPFORM_NEVER_real : -left / falls;
}

/* Rule 5: how long from `at`, the jet at `start`, on g, for certain, has no root. */
static inline real quiet_time_real(const event_set_real *set, const event_function_real *g,
                                   const propagator_real *start, const jet_real *at, real rounding) {
    return set->node->half_period < HOPFORM_NEVER_real ? quiet_time_of_ringing_real(set, g, start, at, rounding)
                                                       : quiet_time_of_decay_real(set, g, start, at, rounding);
}

/* ---- the search ---- */

/* An interval of the search: its ends, the jets there, and which function has its first root at the second one. */
typedef struct {
    propagator_real low, high;
    int32_t found; /* -1: none */
    int32_t count; /* of the phase, so far */
    jet_real from[MOST_EVENT_FUNCTIONS_real];
    jet_real to; /* of the function that is looked at, or that has crossed zero first */
} interval_real;

static inline void end_interval_at_real(const event_set_real *set, interval_real *in, real t) {
    in->high = propagator_at_real(set->poles, t);
    in->found = -1;
}

/* The far end of an interval of length h has been passed below zero by more than rounding, or, where no other root has
 * been found before it, so steeply that the root is near. */
static inline bool has_crossed_real(const jet_real *to, real h, real rounding, bool is_last) {
    return (to->value < 0.0) & ((to->value < -rounding) | (is_last & (to->rate * h < -rounding)));
}

/* Where in (0, 1) of the interval a function that is below zero at its end has crossed zero, if it has: a rough guess;
 * 2 if it has not. Its jet there. */
static inline real guessed_crossing_real(const event_function_real *g, const interval_real *in, const jet_real *from,
                                         jet_real *to) {
    const real h = in->high.t - in->low.t;
    const bool is_last = in->found < 0 && !g->touch_is_no_event;
    *to = short_jet_at_real(g, &in->high);
    return has_crossed_real(to, h, rounding_of_real(g, &in->high, to->rate), is_last) ? rough_root_real(from, to, h)
                                                                                      : 2.0;
}

/* Where a function crosses zero in an interval: a guess, as a share of it. */
typedef struct {
    int32_t function;
    real share;
} crossing_real;

/* Which function has crossed zero first by the end of the interval, by rough guesses, if one has; of the distances
 * alone. */
static inline bool first_crossing_real(const event_set_real *set, interval_real *in, bool distances,
                                       crossing_real *first) {
    const propagator_real end = in->high; /* for registers */
    first->function = 0;
    first->share = 2.0;
    for (int32_t n = 0; n < set->count; n++) {
        const event_function_real *g = &set->function[n];
        if (n != in->found && (!distances || g->touch_is_no_event) && value_at_real(g, &end) < 0.0) {
            jet_real to;
            const real share = guessed_crossing_real(g, in, &in->from[n], &to);
            if (share < first->share) {
                first->function = n;
                first->share = share;
                in->to = to;
            }
        }
    }
    return first->share < 2.0;
}

/* Ends the interval at the root of a function that has crossed zero in it. */
static inline void end_at_crossing_real(const event_set_real *set, interval_real *in, const crossing_real *crossing) {
    const event_function_real *g = &set->function[crossing->function];
    const real h = in->high.t - in->low.t;
    const interpolant_real p = interpolant_of_real(&in->from[crossing->function], &in->to, h);
    locate_root_real(set->poles, g, in->low.t, &in->high, in->low.t + h * refined_root_real(&p, crossing->share));
    in->found = crossing->function;
}

/* Ends the interval at the earliest root of the functions, or distances alone, that have crossed zero by its end. */
static inline void end_at_first_crossing_real(const event_set_real *set, interval_real *in, bool distances) {
    crossing_real first;
    for (int32_t n = 0; n < MOST_TRIES_real && first_crossing_real(set, in, distances, &first); n++) {
        end_at_crossing_real(set, in, &first);
    }
}

/* Two roots within rounding are at the same time, and the owner that comes first wins, at its own root: the later one,
 * so that its time does not jump where the other one begins to count. Over a limit that is met it wins only where the
 * roots are within 8 ulp of the time. */
static inline void settle_ties_real(const event_set_real *set, interval_real *in) {
    const event_function_real *found = &set->function[in->found];
    const real other = rate_at_real(found, &in->high);
    for (int32_t n = 0; n < in->found && set->function[n].owner < found->owner; n++) {
        const event_function_real *g = &set->function[n];
        const real rate = rate_at_real(g, &in->high);
        const real rounding = rounding_of_real(g, &in->high, rate);
        if (!(rate * (in->high.t - in->low.t) < -16.0 * rounding)) { continue; }
        const real value = value_at_real(g, &in->high);
        if (found->touch_is_no_event ? value < 8.0 * HOPFORM_EPS_real * in->high.t * fabs_real(rate)
                                     : (value - 4.0 * rounding) * fabs_real(other)
                                           < fabs_real(rate) * rounding_of_real(found, &in->high, other)) {
            if (value > 0.0) { end_interval_at_real(set, in, in->high.t - value / rate); }
            in->found = n;
            return;
        }
    }
}

/* Whether a function crosses zero at the end of the interval, the time of the limit, and does not just touch it. */
static inline bool crosses_at_limit_real(const event_function_real *g, const propagator_real *at, real limit) {
    const real rate = rate_at_real(g, at);
    return value_at_real(g, at) < -8.0 * HOPFORM_EPS_real * limit * rate
           && rate * limit < -16.0 * rounding_of_real(g, at, rate);
}

/* Whether function n, of d at the start, has no root before the end, by the rules that take no further evaluation. */
static inline bool is_certified_real(const event_set_real *set, interval_real *in, int32_t n, real d) {
    const event_function_real *g = &set->function[n];
    const jet_real *from = &in->from[n];
    jet_real *to = &in->to;
    *to = short_jet_at_real(g, &in->high);
    if (to->value < 0.0 && n != in->found && to->value < -rounding_of_real(g, &in->high, to->rate)) {
        return false; /* what the rules rest on: no function but that with its root there is below zero */
    }
    const real d_then = deflated_derivative_real(set, g, &in->high, -1.0);
    if (has_no_root_real(from, d, falls_for_certain_real(g, &in->high, to->rate), d_then)) { return true; }
    const real h = in->high.t - in->low.t;
    const real rounding = rounding_of_real(g, &in->high, to->rate);
    return (!(d < 0.0) && stays_positive_by_slope_real(set->node->pole, from, to, h, rounding))
           || quiet_time_real(set, g, &in->low, from, rounding) > h
           || (set->node->half_period < HOPFORM_NEVER_real
               && (stays_positive_by_bernstein_real(set->poles, g, from, to, h, n == in->found, rounding)
                   || has_faded_real(set, g, &in->low, from, h, rounding)));
}

/* The same by rule 4, a look inside the interval. If there is a root, or still no certificate, the interval ends there,
 * unless it is so short that a cut at 1/64 of it is no other number than its start. */
static inline bool is_certified_inside_real(const event_set_real *set, interval_real *in, int32_t n, real d) {
    const event_function_real *g = &set->function[n];
    const jet_real *from = &in->from[n];
    const jet_real *to = &in->to;
    const real h = in->high.t - in->low.t;
    const real d_then = deflated_derivative_real(set, g, &in->high, -1.0);
    if (from->rate < 0.0 && !(to->rate < 0.0)) { /* g' has one root */
        in->to.third = third_of_real(set->poles, g, &in->high);
        const propagator_real lowest = minimum_between_real(set->poles, g, from, in->low.t, to, in->high.t);
        const jet_real least = short_jet_at_real(g, &lowest);
        if (!(least.value < -rounding_of_real(g, &lowest, least.rate))) { return true; }
        in->high = lowest;
        in->found = -1;
        return false;
    }
    const real cut = in->low.t + cut_between_real(d, d_then, h);
    if (!(cut > in->low.t && cut < in->high.t)) { return true; /* too short to be cut */ }
    end_interval_at_real(set, in, cut);
    return false;
}

/* Whether no function has a root before the end of the interval; among those that have one there, the first wins. */
static inline bool are_certified_real(const event_set_real *set, interval_real *in) {
    for (int32_t n = 0; n < set->count; n++) {
        const event_function_real *g = &set->function[n];
        if (!g->needs_certificate) { continue; }
        /* what is cheap of rule 2 comes first */
        const real d = deflated_derivative_real(set, g, &in->low, 1.0);
        const bool no_root_by_signs = d < 0.0 ? falls_for_certain_real(g, &in->high, rate_at_real(g, &in->high))
                                              : (d > 0.0) & !(in->from[n].rate < 0.0);
        if (!no_root_by_signs && !is_certified_real(set, in, n, d) && !is_certified_inside_real(set, in, n, d)) {
            return false;
        }
    }
    if (in->found > 0) { settle_ties_real(set, in); }
    return true;
}

/* Ends the interval at the first root in it, if it has one; false if no certificate is found within the bound. */
static inline bool find_first_root_real(const event_set_real *set, interval_real *in) {
    do {
        if (in->count >= HOPFORM_MOST_INTERVALS) { return false; }
        in->count++;
        end_at_first_crossing_real(set, in, false);
    } while (!are_certified_real(set, in));
    return true;
}

/* The next interval begins where this one has ended. */
static inline void begin_interval_real(const event_set_real *set, interval_real *in) {
    in->low = in->high;
    in->found = -1;
    for (int32_t n = 0; n < set->count; n++) {
        in->from[n] = jet_at_real(set->poles, &set->function[n], &in->high);
        in->from[n].value = greater_real(in->from[n].value, 0.0);
    }
}

/* Rule 5: until when no function has a root, for certain. */
static inline real root_free_until_real(const event_set_real *set, const interval_real *in) {
    real quiet = HOPFORM_NEVER_real;
    for (int32_t n = 0; n < set->count && quiet > 0.0; n++) {
        const real rounding = 16.0 * HOPFORM_EPS_real * (fabs_real(set->function[n].start) + set->function[n].cancels);
        if (!set->function[n].touch_is_no_event) { /* one that is monotone is looked at where the interval ends */
            quiet = lesser_real(quiet_time_real(set, &set->function[n], &in->low, &in->from[n], rounding), quiet);
        }
    }
    return in->low.t + quiet;
}

/* Begin the first interval. A function that is below zero already and falls is found; -1 if there is none. */
static inline int32_t begin_at_start_real(const event_set_real *set, interval_real *in) {
    int32_t found = -1;
    in->low = propagator_at_start_real(set->poles);
    for (int32_t n = set->count - 1; n >= 0; n--) {
        in->from[n] = jet_at_start_real(set->poles, &set->function[n]);
        if (in->from[n].value < 0.0) {
            found = in->from[n].rate <= 0.0 ? n : found;
            in->from[n].value = 0.0;
        }
    }
    return found;
}

/* ---- closed forms, contacts ---- */

/* Rule 3 of a pair that rings with omega. From rest a mass moves for half a period. */
static inline real time_to_rest_of_ringing_real(const hopform_poles_real *poles, real omega, real v, real acc) {
    const real back = v > 0.0 ? -(acc + 0.5 * poles->p * v) / omega : 1.0;
    const real slowing = angle_real(back, v) / omega;
    const real at_once = acc < 0.0 ? 0.0 : HOPFORM_NEVER_real;
    const real from_rest = acc > 0.0 ? 3.141592653589793 / omega : at_once;
    return v > 0.0 ? slowing : from_rest;
}

/* Rule 3: when a mass that slips alone comes to rest, NEVER if it does not: v and v' = acc at t = 0, times its sign.
 *
 * v'' + p v' + q v = 0 without a constant force, so v keeps its relative accuracy however far it has faded: its first
 * zero is where v cos(w t) + (acc + p v/2) sin(w t)/w is 0, or where two decays have become equal.
 */
static inline real time_to_rest_real(const hopform_poles_real *poles, real v, real acc) {
    const real mean = 0.5 * poles->p;
    const real discriminant = mean * mean - poles->q;
    if (discriminant < 0.0) { return time_to_rest_of_ringing_real(poles, sqrt_real(-discriminant), v, acc); }
    if (!(v > 0.0)) { /* from rest it creeps; rounding may have left the other sign */
        return acc < 0.0 ? 0.0 : HOPFORM_NEVER_real;
    }
    const real half = sqrt_real(discriminant);
    const real slow = mean + half > 0.0 ? poles->q / (mean + half) : 0.0;
    const real back = -(acc + slow * v); /* what the slow decay alone would leave over */
    const real x = back > 0.0 ? 2.0 * half * (v / back) : 1.0;
    if (!(x < 1.0)) { return HOPFORM_NEVER_real; }
    const real s = x / (2.0 - x);
    if (s < 0.1716) { return 2.0 * (v / back) * area_tangent_real(s) / (2.0 - x); }
    const real ratio = -(acc + (mean + half) * v) / back;
    return ratio > 0.0 ? -logarithm_real(ratio) / (2.0 * half) : HOPFORM_NEVER_real;
}

/* Correction to a root estimate from the steady-state form of g, which keeps its digits after the transients have
 * decayed; 0 when it is no more accurate. */
static inline real steady_state_correction_real(const hopform_poles_real *poles, const event_function_real *g,
                                                real settled, const basis_real *basis, real t) {
    const real residual = settled - g->start;
    const bool slow = poles->s_3 > 0.0; /* else W does not fade, but is not in it */
    const real by_2 = residual * poles->s_2;
    const numerator_real fading = {g->H3, slow ? g->H2 : by_2, g->H1};
    const real value = settled - residual_to_steady_state_real(poles, &fading, basis, residual);
    const real rate = g->H3 * basis->Wdd + g->H2 * basis->Wd + g->H1 * basis->W;
    const real of_time = t * fabs_real(rate);
    const real of_rise = fabs_real(g->start) + fabs_real(g->H3 * basis->Wd) + fabs_real(g->H2 * basis->W)
                         + fabs_real(g->H1 * basis->W1) + of_time;
    const real of_residual = fabs_real(settled) + fabs_real(residual * basis->Wdd)
                             + (fabs_real(g->H3) + fabs_real(residual * poles->s_1)) * fabs_real(basis->Wd)
                             + (slow ? fabs_real(g->H2) + fabs_real(by_2) : 0.0) * fabs_real(basis->W) + of_time;
    const bool better =
        (rate < 0.0) & (of_residual < 0.25 * of_rise) & (fabs_real(value) <= 16.0 * HOPFORM_EPS_real * of_rise);
    const real later = -value / (better ? rate : -1.0);
    const bool counts = (fabs_real(later) < 0.01 * t) & (fabs_real(later) > 16.0 * HOPFORM_EPS_real * t);
    return (better & counts) ? later : 0.0;
}

#endif
