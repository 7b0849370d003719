/* SPDX-License-Identifier: MIT-0
 *
 * The least minimum of an event function inside a phase that has been solved: of the contact force, for the controller;
 * of the compression, with the other sign, for its largest value.
 */
#ifndef HOPFORM_EXTREMA_H_real
#define HOPFORM_EXTREMA_H_real

#include "certificate_real.h"

/* The least of `count` minima, and when it is. */
typedef struct {
    real value, t;
    uint32_t count;
} minima_real;

/* The minimum between two times, between which the rate becomes positive. */
static inline void find_minimum_real(const hopform_poles_real *poles, const event_function_real *g,
                                     const jet_real *from, real low, const jet_real *to, real high, minima_real *least,
                                     evaluations_real *evaluations) {
    const propagator_real at = minimum_between_real(poles, g, 0.0, from, low, to, high, evaluations);
    const real value = value_at_real(g, &at);
    if (least->count == 0 || value < least->value) {
        least->value = value;
        least->t = at.t;
    }
    least->count++;
}

/* Whether rate and curvature of an event function are more than what rounding may have left of them. */
static inline bool is_decided_real(const event_function_real *g, const propagator_real *at, const jet_real *jet) {
    return fabs_real(jet->rate) > 64.0 * HOPFORM_EPS_real * terms_of_real(g, &at->rate)
           && bends_real(g, at, jet->curvature);
}

/* d' of an event function, the deflated derivative of its rate. */
static inline real deflated_rate_real(const hopform_poles_real *poles, const hopform_node_real *node,
                                      const event_function_real *g, const propagator_real *at) {
    const deflated_real d = deflated_at_real(poles, node, g, at);
    return (d.B - d.sum * d.A) * d.Rd - d.product * (d.A * d.R);
}

/* Rule 2 of docs/explanation/certificate.md for the rate of an event function, which has these jets: how often it may
 * vanish between two times that lie less than half a period of the pair apart; d and d_then are those of the rate. */
static inline int most_turns_real(const jet_real *from, real d, const jet_real *to, real d_then) {
    const int variations = (from->rate * from->curvature < 0.0 ? 1 : 0) + (from->curvature * d < 0.0 ? 1 : 0);
    const int variations_then = (to->rate * to->curvature < 0.0 ? 1 : 0) + (to->curvature * d_then < 0.0 ? 1 : 0);
    const bool decided = fabs_real(from->rate) > 0.0 && fabs_real(from->curvature) > 0.0 && fabs_real(d * d_then) > 0.0;
    return decided ? variations - variations_then + (d * d_then < 0.0 ? 1 : 0) : 3;
}

/* The minima inside a phase that ends at `end`, of a function of time by its numerator and its value at the start.
 * Where more than one is possible its rate is evaluated at times that double until they are a quarter of half a period
 * of the pair apart, at about `most` of them at most, and between three evaluations where it comes near zero and goes
 * back. */
static inline minima_real least_minimum_real(const hopform_poles_real *poles, const hopform_node_real *node,
                                             const numerator_real *h, real value, const propagator_real *end, real most,
                                             evaluations_real *evaluations) {
    const event_function_real function = event_function_of_real(h, value);
    const event_function_real *g = &function;
    const jet_real from = jet_at_start_real(poles, g);
    const jet_real to = jet_at_real(poles, g, end);
    minima_real least = {0.0, 0.0, 0};
    const bool turns = from.rate < 0.0 && to.rate > 0.0;
    const int odd = turns || (from.rate > 0.0 && to.rate < 0.0) ? 1 : 0;
    const propagator_real start = propagator_at_start_real(poles);
    const real d = deflated_rate_real(poles, node, g, &start);
    if (end->t < 0.95 * node->half_period && is_decided_real(g, end, &to)
        && most_turns_real(&from, d, &to, deflated_rate_real(poles, node, g, end)) <= 1 + odd) {
        if (turns) { find_minimum_real(poles, g, &from, 0.0, &to, end->t, &least, evaluations); }
        return least;
    }
    const real longest = greater_real(end->t / most, 0.77 / sqrt_real(poles->q));
    real apart = lesser_real(0.5 / (poles->s_1 + sqrt_real(poles->s_2)), longest);
    real earlier = 0.0; /* times of the jets before and last */
    real t = 0.0;
    jet_real before = from;
    jet_real last = from;
    bool ends = false;
    while (!ends) {
        use_evaluation_real(evaluations);
        ends = !(t + 1.5 * apart < end->t && evaluations->left > 0);
        const real next = ends ? end->t : t + apart;
        const propagator_real at = ends ? *end : propagator_at_real(poles, next);
        const jet_real now = ends ? to : jet_at_real(poles, g, &at);
        if (last.rate < 0.0 && now.rate >= 0.0) {
            find_minimum_real(poles, g, &last, t, &now, next, &least, evaluations);
        } else if (t > 0.0 && last.rate < 0.0 && last.rate > before.rate && last.rate > now.rate) {
            const real rise = (last.rate - before.rate) / (t - earlier);
            const real bend = ((now.rate - last.rate) / (next - t) - rise) / (next - earlier);
            /* of the parabola through the three; rates of subnormal numbers may leave none */
            const real top = bend < 0.0 ? t - 0.5 * (rise + bend * (t - earlier)) / bend : t;
            const propagator_real at_top = propagator_at_real(poles, top);
            const jet_real there = jet_at_real(poles, g, &at_top);
            if (there.rate > 0.0) { find_minimum_real(poles, g, &before, earlier, &there, top, &least, evaluations); }
        }
        earlier = t;
        t = next;
        before = last;
        last = now;
        apart = lesser_real(2.0 * apart, longest);
    }
    return least;
}

#endif
