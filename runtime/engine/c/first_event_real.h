/* SPDX-License-Identifier: MIT-0
 *
 * The earliest root of event functions in an interval: roots are predicted from the values and derivatives at both
 * ends, and located by a step of Householder's and one of Newton's. That there is no earlier one is for the caller to
 * certify.
 */
#ifndef HOPFORM_FIRST_EVENT_H_real
#define HOPFORM_FIRST_EVENT_H_real

#include "certificate_real.h"

/* A function may be located at a later root first, and so more than once: at each of its roots in an interval, of which
 * rule 2 leaves three at most, or four in flight. */
enum { MOST_TRIES_real = 4 * MOST_EVENT_FUNCTIONS_real };

/* Intervals that are certified, or cut, in a phase at most. */
#ifndef HOPFORM_MOST_INTERVALS
#define HOPFORM_MOST_INTERVALS 10000
#endif

/* ---- an interval ---- */

/* An interval of the search: its ends, the jets there, and which function has its first root at the second one. */
typedef struct {
    propagator_real low, high;
    int32_t found; /* -1: none */
    int32_t count; /* of the phase, so far */
    evaluations_real *evaluations;
    jet_real from[MOST_EVENT_FUNCTIONS_real];
    jet_real to; /* of the function that is looked at, or that has crossed zero first */
} interval_real;

static inline void end_interval_at_real(const event_set_real *set, interval_real *in, real t) {
    use_evaluation_real(in->evaluations);
    in->high = propagator_at_real(set->poles, t);
    in->found = -1;
}

/* ---- predict, locate, again ---- */

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
    locate_root_real(set->poles, g, in->low.t, &in->high, in->low.t + h * refined_root_real(&p, crossing->share),
                     in->evaluations);
    in->found = crossing->function;
}

/* Ends the interval at the earliest root of the functions, or distances alone, that have crossed zero by its end. */
static inline void end_at_first_crossing_real(const event_set_real *set, interval_real *in, bool distances) {
    crossing_real first;
    for (int32_t n = 0;
         n < MOST_TRIES_real && in->evaluations->left > 0 && first_crossing_real(set, in, distances, &first); n++) {
        end_at_crossing_real(set, in, &first);
    }
}

/* ---- certify ---- */

/* Where d has its root within an interval: the chord's, but not behind the middle, because the chord of what fades fast
 * leads to the end each time; a quarter of it where d has no two signs. */
static inline real cut_between_real(real d, real d_then, real h) {
    const bool changes = (d < 0.0) != (d_then < 0.0) && fabs_real(d_then) > 0.0;
    const real share = changes ? d / (d - d_then) : 0.25;
    const real inside = share > 0.015625 ? (share < 0.5 ? share : 0.5) : 0.015625;
    return inside * h;
}

/* ---- the next interval ---- */

/* The next interval begins where this one has ended. */
static inline void begin_interval_real(const event_set_real *set, interval_real *in) {
    in->low = in->high;
    in->found = -1;
    for (int32_t n = 0; n < set->count; n++) {
        in->from[n] = jet_at_real(set->poles, &set->function[n], &in->high);
        in->from[n].value = greater_real(in->from[n].value, 0.0);
    }
}

#endif
