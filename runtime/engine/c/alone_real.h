/* SPDX-License-Identifier: MIT-0
 *
 * The motion of one element that slips alone, in its own coordinate: how far it has gone to its side since the phase
 * began.
 *
 *     s' = v        v' = acc        acc' + p acc + q v = 0
 *
 * v keeps its sign until the element rests, and s grows. Where velocities do not couple, all event functions of the
 * phase are linear in s: the stretch of a contact, the distance to a stop, the free acceleration of what is held. So
 * the first event is that of the least displacement, it comes if the element goes so far before it rests, and one root
 * is looked for, of a monotone function.
 */
#ifndef HOPFORM_ALONE_H_real
#define HOPFORM_ALONE_H_real

#include "certificate_real.h"

/* Whether a library solves so (HOPFORM_ALONE), and has a model all of whose event functions are linear in s. */
#define HOPFORM_HAS_ALONE                                                                                              \
    (HOPFORM_ALONE && !HOPFORM_IS_COUPLED && !HOPFORM_HAS_LIMITS                                                       \
     && (HOPFORM_CONTACT_IS_STRETCH || !HOPFORM_HAS_CONTACT))

#if HOPFORM_HAS_ALONE
/* A time since the phase began, and displacement, velocity and acceleration then, times the side of the element. */
typedef struct {
    real t, s, v, acc;
} alone_real;

/* The integral of exp(M t), M = ((0, 1), (-q, -p)), is of_velocity + of_acceleration M. */
typedef struct {
    real of_velocity, of_acceleration;
} alone_gain_real;

/* A time of either sign is short where the series of phi_1 over a node converges to rounding: |pole| t < 0.866. */
static inline bool is_short_real(const hopform_poles_real *poles, real t) {
    return poles->q * t * t < 0.75;
}

/* By the first terms of t phi_1(M t), divided by M^2 + p M + q: two products a term. */
#define DEFINE_ALONE_GAIN(length, TERMS)                                                                               \
    ALWAYS_real alone_gain_real alone_gain_over_##length##_real(const hopform_poles_real *poles, real t) {             \
        const real pt = poles->p * t;                                                                                  \
        const real tt = t * t;                                                                                         \
        const real qtt = poles->q * tt;                                                                                \
        real first = 0.0, second = 0.0;                                                                                \
        TERMS(ADD_TERM)                                                                                                \
        const alone_gain_real gain = {t * (1.0 - qtt * second), tt * first};                                           \
        return gain;                                                                                                   \
    }
#define ADD_TERM(coefficient)                                                                                          \
    {                                                                                                                  \
        const real next = (coefficient) - (pt * first + qtt * second);                                                 \
        second = first;                                                                                                \
        first = next;                                                                                                  \
    }
DEFINE_ALONE_GAIN(a_node, HOPFORM_NODE_real)
DEFINE_ALONE_GAIN(half_a_node, HOPFORM_HALF_NODE_real)
DEFINE_ALONE_GAIN(a_step, HOPFORM_STEP_real)
#undef ADD_TERM
#undef DEFINE_ALONE_GAIN

/* Over two times that: the integral until then, and exp(M t) times it. */
ALWAYS_real alone_gain_real twice_the_gain_real(const hopform_poles_real *poles, const alone_gain_real *gain) {
    const real fades = poles->q * gain->of_acceleration;
    const real turns = gain->of_velocity - poles->p * gain->of_acceleration;
    const alone_gain_real twice = {(2.0 - fades) * gain->of_velocity - fades * turns,
                                   (2.0 - fades) * gain->of_acceleration + turns * turns};
    return twice;
}

/* Over a time t >= 0 that is not short: R + p R1 and R1. */
SELDOM_real alone_gain_real alone_gain_over_long_real(const hopform_poles_real *poles, real t) {
    const pair_real pair = pair_at_real(poles, t);
    const alone_gain_real gain = {pair.R + poles->p * pair.R1, pair.R1};
    return gain;
}

static inline alone_gain_real alone_gain_over_real(const hopform_poles_real *poles, real t) {
    const bool halves = !is_short_real(poles, t);
    if (!is_short_real(poles, 0.5 * t)) { return alone_gain_over_long_real(poles, t); }
    const alone_gain_real gain = alone_gain_over_a_node_real(poles, halves ? 0.5 * t : t);
    return halves ? twice_the_gain_real(poles, &gain) : gain;
}

/* The motion at another time, from what is gained since the first one. */
ALWAYS_real alone_real alone_after_real(const hopform_poles_real *poles, const alone_real *from, real t,
                                        const alone_gain_real *gain) {
    const real jerk = -(poles->p * from->acc + poles->q * from->v);
    const real s = gain->of_velocity * from->v + gain->of_acceleration * from->acc;
    const real v = gain->of_velocity * from->acc + gain->of_acceleration * jerk;
    const alone_real at = {t, from->s + s, from->v + v, from->acc - (poles->p * v + poles->q * s)};
    return at;
}

/* The motion where it comes to rest. acc^2 + p acc v + q v^2 fades as exp(-p t), so acc is known with all its digits,
 * and q s = -(acc + p v), less what that is at the start, is a sum where the time is not short. Requires a pair that
 * rings. */
static inline alone_real alone_at_rest_real(const hopform_poles_real *poles, const alone_real *start, real t) {
    const real mean = 0.5 * poles->p;
    const real along = start->acc + mean * start->v;
    const real size = sqrt_real(along * along + (poles->q - mean * mean) * (start->v * start->v));
    const real acc = -size * exponential_real(-mean * t);
    alone_real at = {t, 0.0, 0.0, acc};
    if (is_short_real(poles, t)) {
        const alone_gain_real gain = alone_gain_over_a_node_real(poles, t);
        at.s = gain.of_velocity * start->v + gain.of_acceleration * start->acc;
    } else {
        at.s = (start->acc + poles->p * start->v - acc) / poles->q;
    }
    return at;
}

/* ---- its first event ---- */

/* A displacement at which something happens, with what its rounding is of beside it; whose event that is. */
typedef struct {
    real s, cancels;
    int owner, side;
    bool stops;
} alone_guard_real;

enum { MOST_ALONE_GUARDS_real = 3 };

/* The guards of a phase in order of tie-break priority, and what ends it in closed form. */
typedef struct {
    const hopform_poles_real *poles;
    real half_period;
    int element;
    alone_real start, end;
    real rest_time;
    int rests;
    int count;
    alone_guard_real guard[MOST_ALONE_GUARDS_real];
    int owner, side; /* of what ends it: NO_OWNER where nothing happens until then */
    bool stops, touches, certified;
} alone_search_real;

static inline alone_guard_real *add_alone_guard_real(alone_search_real *search, real s, int owner) {
    alone_guard_real *guard = &search->guard[search->count++];
    guard->s = greater_real(s, 0.0);
    guard->cancels = 0.0;
    guard->owner = owner;
    guard->side = 0;
    guard->stops = false;
    return guard;
}

/* The bound of what rounding has done to how far it is from a guard: no term of s is much larger than s. */
static inline real alone_rounding_real(const alone_guard_real *guard, const alone_real *at) {
    return 16.0 * HOPFORM_EPS_real * (guard->s + guard->cancels + at->s + at->t * at->v);
}

/* The guard that is met first, -1 without any. */
static inline int nearest_alone_guard_real(const alone_search_real *search) {
    int first = search->count > 0 ? 0 : -1;
    for (int n = 1; n < search->count; n++) {
        if (search->guard[n].s < search->guard[first].s) { first = n; }
    }
    return first;
}

/* Whether it is passed by the end: by more than rounding, or so fast that the root is near. */
static inline bool is_guard_passed_real(const alone_guard_real *guard, const alone_real *end) {
    const real beyond = end->s - guard->s;
    const real rounding = alone_rounding_real(guard, end);
    const bool fast = end->v * end->t > rounding && !guard->stops;
    return beyond > rounding || (beyond > 0.0 && fast) || !(guard->s > 0.0);
}

/* How much later than at a time the displacement has gone so much further, which may be negative, as where the element
 * rests: by the parabola, then a step of Halley's on five derivatives. A guess: no bound rests on it. */
static inline real guessed_time_real(const hopform_poles_real *poles, const alone_real *from, real further) {
    const real square = sqrt_real(greater_real(from->v * from->v + 2.0 * from->acc * further, 0.0));
    const real t = 2.0 * further / (from->v + square);
    const real third = -(poles->p * from->acc + poles->q * from->v);
    const real fourth = -(poles->p * third + poles->q * from->acc);
    const real bend = from->acc + t * (third + t * (0.5 * fourth));
    const real rate = from->v + t * (from->acc + t * (0.5 * third + t * ((1.0 / 6.0) * fourth)));
    const real value =
        t * (from->v + t * (0.5 * from->acc + t * ((1.0 / 6.0) * third + t * ((1.0 / 24.0) * fourth)))) - further;
    const real below = 2.0 * rate * rate - value * bend;
    return t - 2.0 * value * rate / (below > 0.0 ? below : HOPFORM_NEVER_real);
}

/* The motion where the displacement is s, greater than 0, from where it is known: the start, or where the element
 * rests, which is later than the root. Halley's steps, the last one by a short series, then Newton's. Until `high` it
 * is reached. */
static inline alone_real alone_at_displacement_real(const hopform_poles_real *poles, const alone_real *from, real s,
                                                    real high, evaluations_real *evaluations) {
    real low = 0.0;
    real t = from->t + guessed_time_real(poles, from, s - from->s);
    alone_real at = *from;
    bool near = false; /* so near to `at` that a short series leads there */
    real step = 0.0;
    for (int n = 0; n < 100; n++) {
        if (!(t > low && t < high) || (n > 8 && n % 2 == 1)) {
            t = low + 0.5 * (high - low);
            near = false;
        }
        if (!(t > low && t < high)) { break; }
        const alone_real *base = near ? &at : from;
        const alone_gain_real gain =
            near ? alone_gain_over_half_a_node_real(poles, step) : alone_gain_over_real(poles, t - from->t);
        at = alone_after_real(poles, base, t, &gain);
        use_evaluation_real(evaluations);
        const real left = s - at.s;
        const real below = 2.0 * at.v * at.v + left * at.acc;
        const bool goes = at.v > 0.0 && below > 0.0;
        step = goes ? 2.0 * left * at.v / below : 0.0;
        near = goes && is_short_real(poles, 2.0 * step);
        if (near && poles->q * (step * step) < HOPFORM_SHORT_real) {
            const alone_gain_real last = alone_gain_over_a_step_real(poles, step);
            const alone_real there = alone_after_real(poles, &at, t + step, &last);
            const real more = (s - there.s) / (there.v > 0.0 ? there.v : 1.0);
            if (there.v > 0.0 && more * more * fabs_real(there.acc) <= 0.5 * HOPFORM_EPS_real * t * there.v) {
                const alone_real root = {t + (step + more), s, there.v + more * there.acc, there.acc};
                return root;
            }
        }
        low = left > 0.0 ? t : low;
        high = left > 0.0 ? high : t;
        t = goes ? t + step : low;
    }
    at.s = s;
    return at;
}

/* Two events within rounding are at the same time, and the owner that comes first wins, at its own root, the later one.
 * Over a stop that is met it wins only where the roots are within 8 ulp of the time. */
static inline int alone_tie_real(const alone_search_real *search, int found, alone_real *at) {
    const alone_guard_real *first = &search->guard[found];
    for (int n = 0; n < found; n++) {
        const alone_guard_real *guard = &search->guard[n];
        const real rounding = alone_rounding_real(guard, at);
        if (!(at->v * at->t > 16.0 * rounding)) { continue; }
        const real further = guard->s - first->s;
        const real bound =
            first->stops ? 8.0 * HOPFORM_EPS_real * at->t * at->v : 4.0 * rounding + alone_rounding_real(first, at);
        if (further < bound) {
            at->t += further > 0.0 ? further / at->v : 0.0;
            at->s = guard->s;
            return n;
        }
    }
    return found;
}

/* Whether the element is at a stop within rounding. */
static inline bool is_alone_at_stop_real(const alone_search_real *search) {
    const real s = search->end.s;
    for (int n = 0; n < search->count; n++) {
        const alone_guard_real *guard = &search->guard[n];
        if (guard->stops && guard->owner == search->owner) {
            return fabs_real(s - guard->s) <= 16.0 * HOPFORM_EPS_real * (s + guard->s);
        }
    }
    return false;
}

/* A guard over the time at which the phase ends without it: the contact, over a step of the input. */
static inline int alone_guard_at_limit_real(const alone_search_real *search) {
    const alone_guard_real *guard = &search->guard[0];
    const alone_real *end = &search->end;
    const bool contact = search->count > 0 && guard->owner == CONTACT_real && search->rest_time > end->t;
    return contact && guard->s - end->s < 8.0 * HOPFORM_EPS_real * end->t * end->v
                   && end->v * end->t > 16.0 * alone_rounding_real(guard, end)
               ? 0
               : -1;
}

/* What draws the element at the start. q s = -(acc + p v), less what that is at the start, so it does so no more from
 * q s = that on, and where the element rests s is larger. */
static inline real draw_at_start_real(const alone_search_real *search) {
    return search->start.acc + search->poles->p * search->start.v;
}

/* Whether a guard is passed while that draws, for certain: then before the element rests. */
static inline bool is_passed_soon_real(const alone_search_real *search, const alone_guard_real *guard) {
    const real draws = draw_at_start_real(search);
    const real q = search->poles->q;
    return guard->s > 0.0 && draws - q * guard->s > 16.0 * HOPFORM_EPS_real * (q * (guard->s + guard->cancels) + draws)
           && search->rests == NO_OWNER_real;
}

/* The end of the phase without a guard: where the element rests, or the time that it lasts until. */
static inline void end_without_guard_real(alone_search_real *search, real until, evaluations_real *evaluations) {
    const hopform_poles_real *poles = search->poles;
    const alone_real *start = &search->start;
    const real rest =
        start->v > 0.0 || !(start->acc > 0.0) ? time_to_rest_real(poles, start->v, start->acc) : search->half_period;
    if (search->rests == NO_OWNER_real || !(search->rest_time <= rest)) {
        search->rest_time = rest;
        search->rests = ELEMENT_real + search->element;
    }
    if (search->rests != CONTACT_real && !(search->rest_time > until)) {
        search->end = alone_at_rest_real(poles, start, rest);
    } else {
        const real limit = lesser_real(search->rest_time, until);
        const alone_gain_real gain = alone_gain_over_real(poles, limit);
        use_evaluation_real(evaluations);
        search->end = alone_after_real(poles, start, limit, &gain);
    }
}

/* The first event of the phase, which lasts until a time at most. */
static inline void find_alone_event_real(alone_search_real *search, real until, evaluations_real *evaluations) {
    const hopform_poles_real *poles = search->poles;
    const int nearest = nearest_alone_guard_real(search);
    const alone_guard_real *guard = &search->guard[nearest < 0 ? 0 : nearest];
    int found = -1;
    bool rests = false;
    use_evaluation_real(evaluations); /* a phase costs as much */
    search->end = search->start;
    if (nearest >= 0 && is_passed_soon_real(search, guard)) {
        search->end = alone_at_displacement_real(poles, &search->start, guard->s, HOPFORM_NEVER_real, evaluations);
        found = search->end.t < until ? nearest : -1;
    }
    if (found < 0) {
        end_without_guard_real(search, until, evaluations);
        const real limit = search->end.t;
        if (nearest >= 0 && is_guard_passed_real(guard, &search->end)) {
            const bool soon = draw_at_start_real(search) > poles->q * guard->s || guard->s < 0.5 * search->end.s;
            const alone_real from = soon ? search->start : search->end;
            found = nearest;
            search->end =
                guard->s > 0.0 ? alone_at_displacement_real(poles, &from, guard->s, limit, evaluations) : search->start;
        } else {
            found = alone_guard_at_limit_real(search);
        }
        rests = !(search->rest_time > limit) && !(search->end.t < limit * (1.0 - 8.0 * HOPFORM_EPS_real));
    }
    found = found > 0 ? alone_tie_real(search, found, &search->end) : found;
    search->owner = rests ? search->rests : NO_OWNER_real;
    search->side = 0;
    search->stops = false;
    if (found >= 0 && (!rests || search->rests >= search->guard[found].owner)) {
        search->owner = search->guard[found].owner;
        search->side = search->guard[found].side;
        search->stops = search->guard[found].stops;
    }
    search->touches = search->owner > CONTACT_real && is_alone_at_stop_real(search);
    search->certified = evaluations->left > 0;
    if (!search->certified) {
        search->end = search->start;
        search->owner = NO_OWNER_real;
    }
}
#endif

#endif
