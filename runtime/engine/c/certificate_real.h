/* SPDX-License-Identifier: MIT-0
 *
 * The certificate that an event function has no root in an interval: the rules of docs/explanation/certificate.md,
 * which proves them, each a function of the jets at the ends. A rule that says yes is right; one that says no says
 * nothing.
 *
 * All but rules 3 and 5 require an interval shorter than half a period of the pair, and g above zero at both of its
 * ends, or zero at the start and rising, or zero at the end and falling; a start that is rounding below zero counts as
 * 0.
 */
#ifndef HOPFORM_CERTIFICATE_H_real
#define HOPFORM_CERTIFICATE_H_real

#include "event_function_real.h"

/* ---- the deflated derivative ---- */

/* The deflated derivative d = g'' + l g', l the real pole, or the fastest of three: a function of the two poles that
 * are left, d = A R' + B R, R their impulse response, A and B the deflated numerator. The sum of jets would lose
 * (a/w)^2 eps of it, w the frequency of the pair. */
typedef struct {
    real A, B;
    real R, Rd;
    real sum, product; /* of the poles that are left: R'' = -(sum R' + product R) */
} deflated_real;

SELDOM_real deflated_real deflated_in_modes_real(const hopform_poles_real *poles, const event_function_real *g,
                                                 const propagator_real *at) {
    const modes_real modes = {g->start, g->H3, g->H2, g->H1};
    const pair_numerator_real numerator = deflated_modes_real(poles, at->omega, &modes);
    const pair_core_real core = core_of_modes_real(poles, at);
    const deflated_real d = {numerator.A, numerator.B, core.R, core.Rd, poles->p, poles->q};
    return d;
}

/* The sum of the poles that are left. */
static inline real sum_of_left_real(const hopform_poles_real *poles, const hopform_node_real *node) {
    return node->half_period < HOPFORM_NEVER_real ? poles->p : node->second + node->third;
}

static inline deflated_real deflated_at_real(const hopform_poles_real *poles, const hopform_node_real *node,
                                             const event_function_real *g, const propagator_real *at) {
    if (is_modal_real(at)) { return deflated_in_modes_real(poles, g, at); }
    const bool rings = node->half_period < HOPFORM_NEVER_real;
    const real sum = sum_of_left_real(poles, node);
    const real product = rings ? poles->q : node->second * node->third;
    deflated_real d = {g->H2 - sum * g->H3,
                       g->H1 - product * g->H3,
                       at->value.first + node->pole * at->value.second,
                       at->rate.first + node->pole * at->value.first,
                       sum,
                       product};
    if (at->t > node->fades) { /* beside the real pole the pair has faded in W */
        const pair_real pair = pair_at_real(poles, at->t);
        d.R = pair.R;
        d.Rd = pair.Rd;
    }
    return d;
}

/* The deflated derivative at an end of an interval. Where it is rounding, its sign inside is that of its derivative at
 * the start, `side` 1, and the other one at the end, `side` -1; 0 where that is rounding, too. */
static inline real deflated_derivative_real(const event_set_real *set, const event_function_real *g,
                                            const propagator_real *at, real side) {
    if (!(at->t > 0.0)) { /* there R' = 1 and R = 0 */
        const real A = g->H2 - sum_of_left_real(set->poles, set->node) * g->H3;
        if (fabs_real(A) > 0.0) { return A; }
    }
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
    return decided_real(rate, terms_of_real(g, &at->rate)) < 0.0;
}

/* Bound of the sixth derivative of an event function whose pair rings: the envelopes of its modes. */
static inline real sixth_derivative_bound_real(const hopform_poles_real *poles, const event_function_real *g,
                                               real omega) {
    const real mu = 0.5 * poles->p;
    const real ww = poles->q - mu * mu;
    const real a = poles->a;
    if (omega > 0.0) {
        return poles->q * poles->q * poles->q * sqrt_real(g->H2 * g->H2 + g->H1 * g->H1)
               + a * a * a * (a * a * a) * fabs_real(g->H3);
    }
    const real e = (g->H1 - a * (g->H2 - a * g->H3)) / residue_real(poles);
    const real c = g->H3 - e;
    const real sw = g->H2 - g->H3 * poles->s_1 + a * e + mu * c;
    return poles->q * poles->q * sqrt_real(poles->q * (c * c + sw * sw / ww)) + a * a * a * a * a * fabs_real(e);
}

/* ---- the rules ---- */

/* Rule 1: Bernstein's coefficients of the quintic through value, slope and curvature at both ends, from which g differs
 * by at most M6 t^3 (h - t)^3/720; those that a root of order 0 or 1 at an end makes 0 do not count. Requires a pair
 * that rings. */
static inline bool stays_positive_by_bernstein_real(const hopform_poles_real *poles, const event_function_real *g,
                                                    real omega, const jet_real *from, const jet_real *to, real h,
                                                    bool root_at_end, real rounding) {
    const real M6 = sixth_derivative_bound_real(poles, g, omega);
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

/* Rule 2: true if g, above zero at both ends of an interval, has no root in it; d is g'' + l g', or 0 where its sign is
 * rounding, and `falls_then` whether g' is negative at the end for certain. With V = 0, 1, 1, 2 for the signs (+, +),
 * (+, -), (-, -), (-, +) of (g', d), V at the start, less V at the end, and 1 if d changes its sign, is 0 or less. */
static inline bool has_no_root_real(const jet_real *from, real d, bool falls_then, real d_then) {
    const bool after_negative = falls_then | (d_then < 0.0);
    const bool after_positive = (!(from->rate < 0.0)) | (falls_then & (d_then > 0.0));
    return (after_negative | (d > 0.0)) & (after_positive | (d < 0.0));
}

/* Rule 2. Requires that d is not negative at the start: e^(lt) g' is then at no time below the lesser of its ends, so g
 * has lost no more than that times h. 1 - lh stands for e^(-lh). */
static inline bool stays_positive_by_slope_real(real l, const jet_real *from, const jet_real *to, real h, real bound) {
    const real left = from->value + bound;
    return left > -h * from->rate && left * greater_real(1.0 - l * h, 0.0) > -h * to->rate;
}

/* Rule 2, whatever the sign of d. Requires a pair that rings: e^(lt) g' grows by d e^(lt), and d has an amplitude that
 * does not grow. So g' falls below 0 by no more than its start, with its rounding, and h times that amplitude, and g
 * has lost no more than h times it. What has faded below the rounding of g is certified so. */
static inline bool has_faded_real(const event_set_real *set, const event_function_real *g, const propagator_real *start,
                                  const jet_real *from, real h, real bound) {
    const hopform_poles_real *poles = set->poles;
    const deflated_real deflated = deflated_at_real(poles, set->node, g, start);
    const real mu = 0.5 * poles->p;
    const real d = deflated.A * deflated.Rd + deflated.B * deflated.R;
    const real wY =
        (deflated.B - mu * deflated.A) * deflated.Rd + (mu * deflated.B - poles->q * deflated.A) * deflated.R;
    const real amplitude = sqrt_real(d * d + wY * wY / (poles->q - mu * mu));
    const real rounding = 16.0 * HOPFORM_EPS_real * terms_of_real(g, &start->rate);
    const real falls = rounding - lesser_real(from->rate, 0.0) + 1.001 * h * amplitude;
    return from->value + bound > h * falls;
}

/* The time to rest where the pair rings with omega. From rest a mass moves for half a period. */
static inline real time_to_rest_of_ringing_real(const hopform_poles_real *poles, real omega, real v, real acc) {
    if (v > 0.0) { return angle_real(-(acc + 0.5 * poles->p * v) / omega, v) / omega; }
    const real at_once = acc < 0.0 ? 0.0 : HOPFORM_NEVER_real;
    return acc > 0.0 ? 3.141592653589793 / omega : at_once;
}

/* Rule 3: when a mass that slips alone comes to rest, NEVER if it does not: v and v' = acc at t = 0, times its sign.
 * Requires v >= 0, or v of rounding.
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

/* Whether the curvature of an event function is more than what rounding may have left of it. */
static inline bool bends_real(const event_function_real *g, const propagator_real *at, real curvature) {
    return fabs_real(curvature) > 64.0 * HOPFORM_EPS_real * terms_of_real(g, &at->curvature);
}

/* Rule 4: the minimum of g between two times. Requires a rate < 0 at the first and >= 0 at the second; the minimum is a
 * root of the rate, found by Householder's method, until a further step changes the value by less than rounding does.
 * Where the curvature is rounding, a step says nothing: then until g cannot fall by more than that between the times
 * that enclose the root. */
static inline propagator_real minimum_between_real(const hopform_poles_real *poles, const event_function_real *g,
                                                   real omega, const jet_real *from, real low, const jet_real *to,
                                                   real high, evaluations_real *evaluations) {
    const bool modal = omega > 0.0;
    const jet_real rate_from = {-from->rate, -from->curvature, -from->third, fourth_of_real(poles, g, modal, from)};
    const jet_real rate_to = {-to->rate, -to->curvature, -to->third, 0.0};
    const real apart = high - low;
    const interpolant_real p = interpolant_of_real(&rate_from, &rate_to, apart);
    real t = low + apart * refined_root_real(&p, rough_root_real(&rate_from, &rate_to, apart));
    real falls_by = -from->rate; /* at the lower time */
    propagator_real at = propagator_in_form_real(poles, omega, t);
    for (int n = 0; n < 100 && evaluations->left > 0; n++) {
        use_evaluation_real(evaluations);
        const jet_real jet = jet_at_real(poles, g, &at);
        const jet_real falls = {-jet.rate, -jet.curvature, -jet.third, fourth_of_real(poles, g, modal, &jet)};
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
        at = propagator_in_form_real(poles, omega, t);
    }
    return at;
}

/* What of a rate and of a function belongs to the pair that rings, r and X, and what of the rate to the real pole, x.
 * r and X are taken from d, whose share of r is (a - p) r + (r' + p r): d' + p d = D gives both without a difference of
 * larger numbers. */
typedef struct {
    real x, r, X;
} shares_real;

static inline shares_real shares_at_real(const event_set_real *set, const event_function_real *g,
                                         const propagator_real *at, real rate) {
    const hopform_poles_real *poles = set->poles;
    if (is_modal_real(at)) {
        const shares_real known = {g->H3 * at->rate.first, g->H2 * at->rate.second + g->H1 * at->rate.third,
                                   g->H2 * at->value.second + g->H1 * at->value.third};
        return known;
    }
    const deflated_real deflated = deflated_at_real(poles, set->node, g, at);
    const real d = deflated.A * deflated.Rd + deflated.B * deflated.R;
    const real D = deflated.B * (deflated.Rd + poles->p * deflated.R) - poles->q * (deflated.A * deflated.R);
    const real r = (poles->a * d - D) / residue_real(poles);
    const bool stiff = poles->a * poles->a > poles->q;
    const real X = -(stiff ? (D + poles->q * r) / poles->a : d - (poles->a - poles->p) * r) / poles->q;
    const shares_real shares = {rate - r, r, X};
    return shares;
}

/* The quiet time where the pair rings.
 *
 * g' = x + r, where x fades with the real pole and r rings. What rings in g is X = -(r' + p r)/q, of an amplitude that
 * does not grow; what does not, g - X, falls by no more than x times the time, or x/a. */
static inline real quiet_time_of_ringing_real(const event_set_real *set, const event_function_real *g,
                                              const propagator_real *start, const jet_real *at, real rounding) {
    const hopform_poles_real *poles = set->poles;
    const real mu = 0.5 * poles->p;
    const real ww = poles->q - mu * mu;
    const shares_real part = shares_at_real(set, g, start, at->rate);
    const real wY = part.r + mu * part.X;
    const real left = at->value - part.X - 1.001 * sqrt_real(part.X * part.X + wY * wY / ww) - rounding;
    const real time = -left / (part.x < 0.0 ? part.x : -1.0);
    const bool always = (!(part.x < 0.0)) | (left * poles->a > -part.x);
    const real quiet = always ? HOPFORM_NEVER_real : time;
    return left > 0.0 ? quiet : 0.0;
}

/* The quiet time of three real poles, l_1 the fastest: g' is a sum of g', (D + l_1) g' and (D + l_2)(D + l_1) g' at the
 * start over kernels that are positive, of integrals 1/l_1, 1/(l_1 l_2) and 1/(l_1 l_2 l_3). The second is d, the third
 * what is left of its numerator without l_3, times R' + l_2 R. */
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

#endif
