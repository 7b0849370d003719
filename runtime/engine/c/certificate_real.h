/* SPDX-License-Identifier: MIT-0
 *
 * Rules 3 and 4 of docs/explanation/certificate.md, which proves them: when a motion of a pair rests, and the minimum
 * of an event function between two times.
 */
#ifndef HOPFORM_CERTIFICATE_H_real
#define HOPFORM_CERTIFICATE_H_real

#include "event_function_real.h"

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
                                                   const jet_real *from, real low, const jet_real *to, real high,
                                                   evaluations_real *evaluations) {
    const jet_real rate_from = {-from->rate, -from->curvature, -from->third, fourth_of_real(poles, from)};
    const jet_real rate_to = {-to->rate, -to->curvature, -to->third, 0.0};
    const real apart = high - low;
    const interpolant_real p = interpolant_of_real(&rate_from, &rate_to, apart);
    real t = low + apart * refined_root_real(&p, rough_root_real(&rate_from, &rate_to, apart));
    real falls_by = -from->rate; /* at the lower time */
    propagator_real at = propagator_at_real(poles, t);
    for (int n = 0; n < 100 && evaluations->left > 0; n++) {
        use_evaluations_real(evaluations, EVALUATION_BY_W_real);
        const jet_real jet = jet_at_real(poles, g, &at);
        const jet_real falls = {-jet.rate, -jet.curvature, -jet.third, fourth_of_real(poles, &jet)};
        const real step = step_to_root_real(&falls);
        const real bound = rounding_of_real(g, &at, 0.0);
        const bool is_far = !(fabs_real(jet.rate * jet.third) < 0.01 * jet.curvature * jet.curvature); /* or fading */
        const bool is_near = !is_far & (jet.curvature > 0.0) & (fabs_real(step * jet.rate) <= bound);
        if (is_near && bends_real(g, &at, jet.curvature)) { break; }
        falls_by = jet.rate < 0.0 ? -jet.rate : falls_by;
        low = jet.rate < 0.0 ? t : low;
        high = jet.rate < 0.0 ? high : t;
        if ((high - low) * falls_by <= bound) {
            if (jet.rate > 0.0) { at = propagator_at_real(poles, low); } /* of which this is known */
            break;
        }
        t = n > 8 && n % 2 == 1 ? low : t - step;
        if (!(t > low && t < high)) { t = low + 0.5 * (high - low); }
        at = propagator_at_real(poles, t);
    }
    return at;
}

/* ---- where an interval is cut ---- */

/* Intervals that are certified, or cut, in a phase at most. */
#ifndef HOPFORM_MOST_INTERVALS
#define HOPFORM_MOST_INTERVALS 10000
#endif

/* Where d has its root within an interval: the chord's, but not behind the middle, because the chord of what fades fast
 * leads to the end each time; a quarter of it where d has no two signs. */
static inline real cut_between_real(real d, real d_then, real h) {
    const bool changes = (d < 0.0) != (d_then < 0.0) && fabs_real(d_then) > 0.0;
    const real share = changes ? d / (d - d_then) : 0.25;
    const real inside = share > 0.015625 ? (share < 0.5 ? share : 0.5) : 0.015625;
    return inside * h;
}

#endif
