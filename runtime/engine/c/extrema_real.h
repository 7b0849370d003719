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
    const propagator_real at = minimum_between_real(poles, g, from, low, to, high, evaluations);
    const real value = value_at_real(g, &at);
    if (least->count == 0 || value < least->value) {
        least->value = value;
        least->t = at.t;
    }
    least->count++;
}

/* Whether the rate of a function, whose jets at two times so far apart these are, becomes 0 no more often than its
 * signs there say: rule 2 of docs/explanation/certificate.md for the rate, whose deflated derivative is g''' + l g''.
 * The times lie less than half a period of the pair apart, and nothing decides that rounding may have left. */
static inline bool turns_as_seen_real(const hopform_timescales_real *scales, const jet_real *from, const jet_real *to,
                                      real t) {
    const real bound = 16.0 * HOPFORM_EPS_real;
    const real curvature = fabs_real(from->curvature) + fabs_real(to->curvature);
    const real third = fabs_real(from->third) + fabs_real(to->third);
    const real d = from->third + scales->pole * from->curvature;
    const real d_then = to->third + scales->pole * to->curvature;
    const bool decided = fabs_real(to->rate) > bound * (fabs_real(from->rate) + fabs_real(to->rate) + t * curvature)
                         && fabs_real(to->curvature) > bound * (curvature + t * third)
                         && lesser_real(fabs_real(d), fabs_real(d_then)) > bound * (third + scales->pole * curvature)
                         && fabs_real(from->rate) > 0.0 && fabs_real(from->curvature) > 0.0;
    const int variations = (from->rate * from->curvature < 0.0 ? 1 : 0) + (from->curvature * d < 0.0 ? 1 : 0);
    const int variations_then = (to->rate * to->curvature < 0.0 ? 1 : 0) + (to->curvature * d_then < 0.0 ? 1 : 0);
    const int odd = from->rate * to->rate < 0.0 ? 1 : 0;
    return t < 0.95 * scales->half_period && decided
           && variations - variations_then + (d * d_then < 0.0 ? 1 : 0) <= 1 + odd;
}

/* Whether the jets at two times show a minimum between them. */
static inline bool shows_minimum_real(const jet_real *from, const jet_real *to) {
    return from->rate < 0.0 && to->rate > 0.0;
}

/* The minima inside a phase of length t, of a function of time by its numerator and its jets at both ends. Where more
 * than one is possible its rate is evaluated at times that double until they are a quarter of half a period of the pair
 * apart, at about `most` of them at most, and between three evaluations where it comes near zero and goes back. */
static inline minima_real least_minimum_real(const hopform_poles_real *poles, const hopform_timescales_real *scales,
                                             const numerator_real *h, const jet_real *start, const jet_real *to,
                                             real length, real most, evaluations_real *evaluations) {
    const event_function_real function = event_function_of_real(h, start->value);
    const event_function_real *g = &function;
    minima_real least = {0.0, 0.0, 0};
    if (turns_as_seen_real(scales, start, to, length)) {
        if (shows_minimum_real(start, to)) { find_minimum_real(poles, g, start, 0.0, to, length, &least, evaluations); }
        return least;
    }
    const real longest = greater_real(length / most, 0.77 / sqrt_real(poles->q));
    real apart = lesser_real(0.5 / (poles->s_1 + sqrt_real(poles->s_2)), longest);
    real earlier = 0.0; /* times of the jets before and last */
    real t = 0.0;
    jet_real before = *start;
    jet_real last = *start;
    bool ends = false;
    while (!ends) {
        use_evaluations_real(evaluations, EVALUATION_BY_W_real);
        ends = !(t + 1.5 * apart < length && evaluations->left > 0);
        const real next = ends ? length : t + apart;
        jet_real now = *to;
        if (!ends) {
            const propagator_real at = propagator_at_real(poles, next);
            now = jet_at_real(poles, g, &at);
        }
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
