/* SPDX-License-Identifier: MIT-0
 *
 * The motion of one element that slips alone, in its own coordinate: how far it has gone to its side since the phase
 * began.
 *
 *     s' = v        v' = draw - p v        draw' = -q v
 *
 * v keeps its sign until the element rests, and s grows. The distance to a stop is linear in s, and so are the stretch
 * of a contact and, where velocities do not couple, the free acceleration of what is held. So of these the first event
 * is that of the least displacement, it comes if the element goes so far before it rests, and one root is looked for,
 * of a monotone function.
 *
 * A function of s and v is a motion of the same pair: what it falls by obeys the equations of s. Its rate has one zero
 * at most until the element rests, because zeros of two motions of a pair lie between each other, and this zero has the
 * closed form of a time to rest. So the function is monotone before it and behind it, and one root is looked for.
 */
#ifndef HOPFORM_ALONE_H_real
#define HOPFORM_ALONE_H_real

#include "certificate_real.h"
#include "transition_real.h"

/* Whether the stance of a model has event functions that are not linear in s. */
#define HOPFORM_ALONE_BENDS                                                                                            \
    (HOPFORM_IS_COUPLED || HOPFORM_HAS_LIMITS || (HOPFORM_HAS_CONTACT && !HOPFORM_CONTACT_IS_STRETCH))

/* Its pair of poles: both are slower than the root of `square`. */
typedef struct {
    const hopform_poles_real *poles;
    real p, q, square;
    bool rings;
} alone_pair_real;

/* A time since the phase began; displacement, velocity, and what draws the element then, times its side. */
typedef struct {
    real t, s, v, draw;
} alone_real;

static inline alone_pair_real alone_pair_of_real(const hopform_poles_real *poles) {
    const bool rings = rings_real(poles);
    const alone_pair_real pair = {poles, poles->p, poles->q, rings ? poles->q : poles->p * poles->p, rings};
    return pair;
}

static inline real alone_acceleration_real(const alone_pair_real *pair, const alone_real *at) {
    return at->draw - pair->p * at->v;
}

/* A time of either sign is short where the series of phi_1 over a node converges to rounding: |pole| t < 0.866. */
static inline bool is_short_real(const alone_pair_real *pair, real t) {
    return pair->square * t * t < 0.75;
}

/* By the first terms of t phi_1(M t), M the matrix of v'' = -(p v' + q v): divided by M^2 + p M + q, two products a
 * term, it is R + p R1 + R1 M. */
#define DEFINE_RESPONSE(length, TERMS)                                                                                 \
    ALWAYS_real known_pair_real response_over_##length##_real(const alone_pair_real *pair, real t) {                   \
        const real pt = pair->p * t;                                                                                   \
        const real tt = t * t;                                                                                         \
        const real qtt = pair->q * tt;                                                                                 \
        real first = 0.0, second = 0.0;                                                                                \
        TERMS(ADD_TERM)                                                                                                \
        const real R1 = tt * first;                                                                                    \
        const real R = t * (1.0 - (qtt * second + pt * first));                                                        \
        const known_pair_real response = {1.0 - (pair->p * R + pair->q * R1), R, R1};                                  \
        return response;                                                                                               \
    }
#define ADD_TERM(coefficient)                                                                                          \
    {                                                                                                                  \
        const real next = (coefficient) - (pt * first + qtt * second);                                                 \
        second = first;                                                                                                \
        first = next;                                                                                                  \
    }
#define NODE_TERMS(EACH) HOPFORM_NODE_FIRST_real(EACH) HOPFORM_NODE_real(EACH)
#define HALF_NODE_TERMS(EACH) HOPFORM_HALF_NODE_FIRST_real(EACH) HOPFORM_HALF_NODE_real(EACH)
DEFINE_RESPONSE(a_node, NODE_TERMS)
DEFINE_RESPONSE(half_a_node, HALF_NODE_TERMS)
DEFINE_RESPONSE(a_step, HOPFORM_STEP_real)
#undef NODE_TERMS
#undef HALF_NODE_TERMS
#undef ADD_TERM
#undef DEFINE_RESPONSE

/* At a time that is not short, nor twice a short one. */
SELDOM_real known_pair_real response_over_long_real(const alone_pair_real *pair, real t) {
    const pair_real at = pair_at_real(pair->poles, t);
    const known_pair_real response = {at.Rd, at.R, at.R1};
    return response;
}

/* At twice the time: R as a sine of twice the angle. */
ALWAYS_real known_pair_real response_over_twice_real(const alone_pair_real *pair, const known_pair_real *half) {
    const known_pair_real response = {half->Rd * half->Rd - pair->q * (half->R * half->R),
                                      half->R * (2.0 * half->Rd + pair->p * half->R),
                                      half->R1 * (2.0 - pair->q * half->R1) + half->R * half->R};
    return response;
}

static inline known_pair_real response_over_real(const alone_pair_real *pair, real t) {
    const bool halves = !is_short_real(pair, t);
    if (!is_short_real(pair, 0.5 * t)) { return response_over_long_real(pair, t); }
    const known_pair_real response = response_over_a_node_real(pair, halves ? 0.5 * t : t);
    return halves ? response_over_twice_real(pair, &response) : response;
}

/* The start of a motion whose draw is known within a rounding. Two real poles settle, as do those that ring so slowly
 * that nothing is left after half a period: where no more than rounding is left of draw and velocity, what is left
 * fades with the slow pole, draw = fast v. By a draw that is rounding alone the element would rest, or turn. */
static inline alone_real alone_start_real(const alone_pair_real *pair, real v, real draw, real rounding) {
    alone_real start = {0.0, 0.0, v, draw};
    if (fabs_real(draw) + pair->p * v < rounding) {
        const real mean = 0.5 * pair->p;
        const real square = mean * mean - pair->q;
        if (square > -0.002 * pair->q) { start.draw = v * (mean + sqrt_real(greater_real(square, 0.0))); }
    }
    return start;
}

/* The motion at another time, by the response to the time between. */
ALWAYS_real alone_real alone_after_real(const alone_pair_real *pair, const alone_real *from, real t,
                                        const known_pair_real *response) {
    const real moved = response->R * from->v + response->R1 * from->draw;
    const alone_real at = {t, from->s + moved, response->Rd * from->v + response->R * from->draw,
                           from->draw - pair->q * moved};
    return at;
}

/* The motion where it comes to rest: the acceleration is the draw there, with all its digits. Of a pair that rings
 * acc (acc + p v) + q v^2 fades as exp(-p t); of two real poles acc + fast v fades with the slow one. Where a pair
 * rings and the time is not short, q s is a sum of the draw there and at the start. */
static inline alone_real alone_at_rest_real(const alone_pair_real *pair, const alone_real *start, real t) {
    const real mean = 0.5 * pair->p;
    const real square = mean * mean - pair->q;
    alone_real at = {t, 0.0, 0.0, 0.0};
    if (pair->rings) {
        const real along = start->draw - mean * start->v;
        at.draw = -sqrt_real(along * along - square * (start->v * start->v)) * exponential_real(-mean * t);
    } else {
        const real fast = mean + sqrt_real(greater_real(square, 0.0));
        const real slow = fast > 0.0 ? pair->q / fast : 0.0;
        at.draw = (start->draw - slow * start->v) * exponential_real(-slow * t);
    }
    if (is_short_real(pair, t) || !pair->rings) {
        const known_pair_real response = response_over_real(pair, t);
        at.s = response.R * start->v + response.R1 * start->draw;
    } else {
        at.s = (start->draw - at.draw) / pair->q;
    }
    return at;
}

/* ---- its first event ---- */

/* A displacement at which something happens, with what its rounding is of beside it; whose event that is. */
typedef struct {
    real s, cancels;
    int owner, side;
    bool stops;
    real settled; /* s less that where the motion ends, if it is known with digits of its own; else NEVER */
} alone_guard_real;

enum { MOST_ALONE_GUARDS_real = 3 };

/* An event function of s and v: its value at the start, and what it falls by, a motion of the pair from 0 on. */
typedef struct {
    real value, cancels; /* as of event_function_real */
    real settled;        /* where it ends, if it is known with digits of its own; else NEVER */
    alone_real fall;
    bool is_beyond; /* at the start, and stays so */
    int owner, side;
} alone_function_real;

/* The guards of a phase in order of tie-break priority, and what ends it in closed form. */
typedef struct {
    alone_pair_real pair;
    real half_period;
    int element;
    alone_real start, end;
    real rest_time;
    int rests;
    int count, nearest; /* the guard that is met first, -1 without any */
    alone_guard_real guard[MOST_ALONE_GUARDS_real];
    int functions;
    alone_function_real function[MOST_EVENT_FUNCTIONS_real];
    int owner, side; /* of what ends it: NO_OWNER where nothing happens until then */
    real slack;      /* by how much later an event of tie-break priority may be */
    bool stops, touches, certified;
} alone_search_real;

/* A search of which nothing is known but how the element moves. */
static inline void begin_alone_search_real(alone_search_real *search, int element, const hopform_poles_real *poles,
                                           real half_period) {
    search->pair = alone_pair_of_real(poles);
    search->half_period = half_period;
    search->element = element;
    search->rest_time = HOPFORM_NEVER_real;
    search->rests = NO_OWNER_real;
    search->count = 0;
    search->nearest = -1;
    search->functions = 0;
}

static inline alone_guard_real *add_alone_guard_real(alone_search_real *search, real s, int owner) {
    alone_guard_real *guard = &search->guard[search->count];
    guard->s = greater_real(s, 0.0);
    if (search->nearest < 0 || guard->s < search->guard[search->nearest].s) { search->nearest = search->count; }
    search->count++;
    guard->cancels = 0.0;
    guard->settled = HOPFORM_NEVER_real;
    guard->owner = owner;
    guard->side = 0;
    guard->stops = false;
    return guard;
}

/* The bound of what rounding has done to how far it is from a guard: no term of s is much larger than s. */
static inline real alone_rounding_real(const alone_guard_real *guard, const alone_real *at) {
    return 16.0 * HOPFORM_EPS_real * (guard->s + guard->cancels + at->s + at->t * at->v);
}

/* Whether it is passed by the end: by more than rounding, or so fast that the root is near. */
static inline bool is_guard_passed_real(const alone_guard_real *guard, const alone_real *end) {
    const real beyond = end->s - guard->s;
    const real rounding = alone_rounding_real(guard, end);
    const bool fast = end->v * end->t > rounding && !guard->stops;
    return beyond > rounding || (beyond > 0.0 && fast) || !(guard->s > 0.0);
}

/* How much later than at a time the displacement has gone so much further, which may be negative, as where the element
 * rests: by the parabola, then a step of Halley's on four derivatives. A guess: no bound rests on it. */
static inline real guessed_time_real(const alone_pair_real *pair, const alone_real *from, real further) {
    const real acc = alone_acceleration_real(pair, from);
    const real square = sqrt_real(greater_real(from->v * from->v + 2.0 * acc * further, 0.0));
    const real speeds = from->v + square;
    const real t = 2.0 * further / (speeds > 0.0 ? speeds : 1.0);
    const real third = -(pair->p * acc + pair->q * from->v);
    const real fourth = -(pair->p * third + pair->q * acc);
    const real bend = acc + t * (third + t * (0.5 * fourth));
    const real rate = from->v + t * (acc + t * (0.5 * third + t * ((1.0 / 6.0) * fourth)));
    const real value =
        t * (from->v + t * (0.5 * acc + t * ((1.0 / 6.0) * third + t * ((1.0 / 24.0) * fourth)))) - further;
    const real below = 2.0 * rate * rate - value * bend;
    return t - 2.0 * value * rate / (below > 0.0 ? below : HOPFORM_NEVER_real);
}

/* The same of two real poles once the fast one has faded, from the start on. */
SELDOM_real real guessed_late_real(const alone_pair_real *pair, const alone_real *from, real further) {
    const real t = guessed_time_real(pair, from, further);
    const real mean = 0.5 * pair->p;
    const real half = sqrt_real(greater_real(mean * mean - pair->q, 0.0));
    const real fast = mean + half;
    if (is_short_real(pair, t) || !(fast > 0.0)) { return t; }
    const real slow = pair->q / fast;
    const real back = from->draw - slow * from->v;
    if (!(fabs_real(back) > 0.0)) { return t; }
    const real later = (further - from->v / fast) * (2.0 * half) / back + 1.0 / fast;
    const real gone = slow * later;
    if (!(later * fast > 1.5 && gone < 1.0)) { return t; }
    return gone < 0.01 ? later * (1.0 + gone * (0.5 + gone * (1.0 / 3.0))) : -logarithm_real(1.0 - gone) / slow;
}

/* The motion where the displacement is s, greater than 0, from where it is known: the start, or where the element
 * rests, which is later than the root. Halley's steps, the last one by a short series, then Newton's. Between `low` and
 * `high` it is reached. */
static inline alone_real alone_at_displacement_real(const alone_pair_real *pair, const alone_real *from, real s,
                                                    real low, real high, evaluations_real *evaluations) {
    real t = from->t
             + (pair->rings ? guessed_time_real(pair, from, s - from->s) : guessed_late_real(pair, from, s - from->s));
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
        const known_pair_real response =
            near ? response_over_half_a_node_real(pair, step) : response_over_real(pair, t - from->t);
        at = alone_after_real(pair, base, t, &response);
        use_evaluations_real(evaluations, 1);
        const real left = s - at.s;
        if (fabs_real(left) <= 0.25 * HOPFORM_EPS_real * t * at.v) { break; }
        const real below = 2.0 * at.v * at.v + left * alone_acceleration_real(pair, &at);
        const bool goes = at.v > 0.0 && below > 0.0;
        step = goes ? 2.0 * left * at.v / below : 0.0;
        near = goes && is_short_real(pair, 2.0 * step);
        if (near && pair->square * (step * step) < HOPFORM_SHORT_real) {
            const known_pair_real last = response_over_a_step_real(pair, step);
            const alone_real there = alone_after_real(pair, &at, t + step, &last);
            const real acc = alone_acceleration_real(pair, &there);
            const real more = (s - there.s) / (there.v > 0.0 ? there.v : 1.0);
            const real then = t + (step + more);
            const bool lands = (there.v > 0.0) & (then > low) & (then < high)
                               & (more * more * fabs_real(acc) <= 0.5 * HOPFORM_EPS_real * t * there.v);
            if (lands) {
                const alone_real root = {then, s, there.v + more * acc, there.draw};
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

/* Whether a guard is passed while the element is still drawn to its side, for certain: draw = draw at the start - q s,
 * and where the element rests it is drawn back. Requires a pair that rings. */
static inline bool is_passed_soon_real(const alone_search_real *search, const alone_guard_real *guard) {
    const real draw = search->start.draw;
    const real q = search->pair.q;
    return search->pair.rings && guard->s > 0.0
           && draw - q * guard->s > 16.0 * HOPFORM_EPS_real * (q * (guard->s + guard->cancels) + draw)
           && search->rests == NO_OWNER_real;
}

/* When a motion of the pair rests. */
static inline real alone_time_to_rest_real(const alone_search_real *search, const alone_real *start) {
    const real acc = alone_acceleration_real(&search->pair, start);
    if (search->pair.rings && !(start->v > 0.0) && acc > 0.0) { return search->half_period; }
    return time_to_rest_real(search->pair.poles, start->v, acc);
}

/* The end of the phase without a guard: where the element rests, or the time that it lasts until. */
static inline void end_without_guard_real(alone_search_real *search, real until, evaluations_real *evaluations) {
    const real rest = alone_time_to_rest_real(search, &search->start);
    if (search->rests == NO_OWNER_real || !(search->rest_time <= rest)) {
        search->rest_time = rest;
        search->rests = ELEMENT_real + search->element;
    }
    if (search->rests != CONTACT_real && !(search->rest_time > until)) {
        search->end = alone_at_rest_real(&search->pair, &search->start, rest);
    } else {
        const real limit = lesser_real(search->rest_time, until);
        const known_pair_real response = response_over_real(&search->pair, limit);
        use_evaluations_real(evaluations, 1);
        search->end = alone_after_real(&search->pair, &search->start, limit, &response);
    }
}

/* An event has the owner of a guard. */
static inline void take_guard_real(alone_search_real *search, const alone_guard_real *guard) {
    search->owner = guard->owner;
    search->side = guard->side;
    search->stops = guard->stops;
}

/* ---- event functions of s and v ---- */

/* Adds a function of a numerator, whose value at the start is a difference of terms, the sum of whose magnitudes is
 * given. */
static inline alone_function_real *add_alone_function_real(alone_search_real *search, const numerator_real *h,
                                                           real start, real terms, real sign, int owner, int side) {
    alone_function_real *function = &search->function[search->functions++];
    const numerator_real along = {sign * h->H3, sign * h->H2, 0.0};
    event_function_real g = event_function_of_real(&along, sign * start);
    put_on_threshold_real(&g, terms);
    const alone_real fall = {0.0, 0.0, -g.H3, -g.H2};
    function->value = greater_real(g.start, 0.0);
    function->cancels = g.cancels;
    function->settled = HOPFORM_NEVER_real;
    function->fall = fall;
    function->is_beyond = (g.start < 0.0 || (g.cancels > 0.0 && !(g.start > 0.0))) && begins_beyond_real(&g);
    function->owner = owner;
    function->side = side;
    return function;
}

/* Whether a function is beyond its zero as the phase begins: the first one is the event. */
static inline bool is_beyond_at_once_real(alone_search_real *search) {
    for (int n = 0; n < search->functions; n++) {
        if (search->function[n].is_beyond) {
            search->owner = search->function[n].owner;
            search->side = search->function[n].side;
            search->stops = false;
            return true;
        }
    }
    return false;
}

/* A function at a time. */
typedef struct {
    real value, rounding;
    alone_real fall;
} alone_function_at_real;

static inline alone_function_at_real alone_function_after_real(const alone_pair_real *pair,
                                                               const alone_function_real *function, real t,
                                                               const known_pair_real *response) {
    alone_function_at_real at;
    at.fall = alone_after_real(pair, &function->fall, t, response);
    at.value = function->value - at.fall.s;
    at.rounding = 16.0 * HOPFORM_EPS_real
                  * (function->value + function->cancels + fabs_real(response->R * function->fall.v)
                     + fabs_real(response->R1 * function->fall.draw) + t * fabs_real(at.fall.v));
    return at;
}

/* Whether it has crossed zero, h since it began to fall: by more than rounding, or so steeply that the root is near. */
static inline bool has_alone_function_crossed_real(const alone_function_at_real *at, real h) {
    return at->value < 0.0 && (at->value < -at->rounding || at->fall.v * h > at->rounding);
}

/* The first root of a function until a time at which it is known: what it falls by there; the time is NEVER without
 * one. */
SELDOM_real alone_real alone_root_real(const alone_search_real *search, const alone_function_real *function,
                                       const alone_function_at_real *end, evaluations_real *evaluations) {
    const alone_pair_real *pair = &search->pair;
    const alone_real none = {HOPFORM_NEVER_real, 0.0, 0.0, 0.0};
    const alone_real *start = &function->fall;
    const real limit = end->fall.t;
    const real acc = alone_acceleration_real(pair, start);
    if (start->v > 0.0 || (!(start->v < 0.0) && acc > 0.0)) {
        real high = limit;
        if (!has_alone_function_crossed_real(end, limit)) {
            if (!(end->value < 0.0) && end->fall.v > 0.0) { return none; } /* it has fallen all the time */
            high = alone_time_to_rest_real(search, start);
            if (!(high < limit)) { return none; }
            const known_pair_real response = response_over_real(pair, high);
            const alone_function_at_real least = alone_function_after_real(pair, function, high, &response);
            use_evaluations_real(evaluations, 1);
            if (!(least.value < -least.rounding)) { return none; }
        }
        return alone_at_displacement_real(pair, start, function->value, 0.0, high, evaluations);
    }
    if (!(end->value < 0.0)) { return none; }
    const alone_real rise = {0.0, 0.0, -start->v, -start->draw};
    const real low = alone_time_to_rest_real(search, &rise);
    if (!(low < limit) || !has_alone_function_crossed_real(end, limit - low)) { return none; }
    const alone_real most = alone_at_rest_real(pair, &rise, low);
    const alone_real from = {low, -most.s, 0.0, -most.draw};
    return alone_at_displacement_real(pair, &from, function->value, low, limit, evaluations);
}

/* A root late in a phase, by where the function ends and what has not yet faded of its fall, once these are the smaller
 * numbers. */
SELDOM_real void sharpen_alone_root_real(const alone_search_real *search, const alone_function_real *function,
                                         real limit, alone_real *root) {
    const alone_pair_real *pair = &search->pair;
    const alone_real *start = &function->fall;
    const real end = function->settled;
    if (!(fabs_real(end) < HOPFORM_NEVER_real) || is_short_real(pair, root->t)) { return; }
    for (int n = 0; n < 4; n++) {
        const real t = root->t;
        const known_pair_real by = response_over_real(pair, t);
        const real parts[2] = {start->draw * (by.Rd + pair->p * by.R) / pair->q, start->v * by.R};
        const real rate = by.Rd * start->v + by.R * start->draw;
        const real of_time = t * fabs_real(rate);
        const real from_start = function->value + fabs_real(by.R * start->v) + fabs_real(by.R1 * start->draw) + of_time;
        const real from_end = fabs_real(end) + fabs_real(parts[0]) + fabs_real(parts[1]) + of_time;
        const real value = end + (parts[0] - parts[1]);
        const bool better =
            (rate > 0.0) & (from_end < 0.25 * from_start) & (fabs_real(value) <= 16.0 * HOPFORM_EPS_real * from_start);
        const real later = better ? value / rate : 0.0;
        const bool counts = fabs_real(later) < 0.01 * t && fabs_real(later) > 16.0 * HOPFORM_EPS_real * t;
        if (!counts || t + later > limit) { return; }
        root->t = t + later;
        root->v = rate;
    }
}

/* The owner that comes before that of the event, and has its own within rounding of it: so much later, if it wins the
 * tie, and so near that its rate does not change until then. */
static inline void settle_alone_tie_real(alone_search_real *search, int before, bool is_tight) {
    const alone_pair_real *pair = &search->pair;
    alone_real *end = &search->end;
    real later = 0.0;
    for (int n = 0; n < search->functions; n++) {
        const alone_function_real *function = &search->function[n];
        if (!(function->owner < before)) { continue; }
        const known_pair_real response = response_over_real(pair, end->t);
        const alone_function_at_real at = alone_function_after_real(pair, function, end->t, &response);
        const real rate = at.fall.v;
        const bool bends = at.value > 0.0 && !(pair->square * at.value * at.value < 0.015625 * rate * rate);
        if (bends || !(rate * end->t > 16.0 * at.rounding)) { continue; }
        if (at.value < rate * search->slack + (is_tight ? 0.0 : 4.0 * at.rounding)) {
            before = function->owner;
            search->owner = before;
            search->side = function->side;
            search->stops = false;
            later = greater_real(at.value / rate, 0.0);
        }
    }
    for (int n = 0; n < search->count && !is_tight; n++) {
        const alone_guard_real *guard = &search->guard[n];
        const real rounding = alone_rounding_real(guard, end);
        const real further = guard->s - end->s;
        if (guard->owner < before && end->v * end->t > 16.0 * rounding
            && further < end->v * search->slack + 4.0 * rounding) {
            before = guard->owner;
            take_guard_real(search, guard);
            later = greater_real(further / end->v, 0.0);
        }
    }
    end->t += later;
    end->s += later * end->v;
    end->v += later * alone_acceleration_real(pair, end);
}

/* The functions, once it is known how the phase ends without them. */
static inline void meet_functions_real(alone_search_real *search, bool rests, evaluations_real *evaluations) {
    const alone_pair_real *pair = &search->pair;
    const real limit = search->end.t;
    const known_pair_real response = response_over_real(pair, limit);
    use_evaluations_real(evaluations, 1);
    int found = -1;
    alone_real root;
    for (int n = 0; n < search->functions; n++) {
        const alone_function_at_real end = alone_function_after_real(pair, &search->function[n], limit, &response);
        alone_real at = alone_root_real(search, &search->function[n], &end, evaluations);
        if (at.t <= limit) { sharpen_alone_root_real(search, &search->function[n], limit, &at); }
        if (at.t <= limit && (found < 0 || at.t < root.t)) {
            found = n;
            root = at;
        }
    }
    bool is_tight = rests || search->stops || search->owner == NO_OWNER_real;
    if (found >= 0) {
        const alone_function_real *function = &search->function[found];
        if (rests && search->owner < function->owner && !(root.t < limit * (1.0 - 8.0 * HOPFORM_EPS_real))) { return; }
        const known_pair_real until = response_over_real(pair, root.t);
        const alone_function_at_real at = alone_function_after_real(pair, function, root.t, &until);
        search->end = alone_after_real(pair, &search->start, root.t, &until);
        search->owner = function->owner;
        search->side = function->side;
        search->stops = false;
        search->slack = root.v > 0.0 ? at.rounding / root.v : 0.0;
        is_tight = false;
    }
    settle_alone_tie_real(search, search->owner == NO_OWNER_real ? ELEMENT_real : search->owner, is_tight);
}

/* The same of a guard to which the motion creeps. */
static inline void sharpen_alone_guard_real(alone_search_real *search, const alone_guard_real *guard, real limit) {
    if (!(search->end.t * search->end.v < 0.25 * guard->s)) { return; }
    const alone_function_real function = {guard->s, guard->cancels, guard->settled, search->start, false, 0, 0};
    alone_real root = search->end;
    sharpen_alone_root_real(search, &function, limit, &root);
    if (fabs_real(root.t - search->end.t) > 0.0) {
        const known_pair_real response = response_over_real(&search->pair, root.t);
        search->end = alone_after_real(&search->pair, &search->start, root.t, &response);
    }
}

/* The first of the guards, or the rest, until a time at most; true if the element rests. */
static inline bool meet_guards_real(alone_search_real *search, real until, evaluations_real *evaluations) {
    const alone_pair_real *pair = &search->pair;
    const int nearest = search->nearest;
    const alone_guard_real *guard = &search->guard[nearest < 0 ? 0 : nearest];
    int found = -1;
    bool rests = false;
    if (nearest >= 0 && is_passed_soon_real(search, guard)) {
        search->end = alone_at_displacement_real(pair, &search->start, guard->s, 0.0, HOPFORM_NEVER_real, evaluations);
        found = search->end.t < until ? nearest : -1;
    }
    if (found < 0) {
        end_without_guard_real(search, until, evaluations);
        const real limit = search->end.t;
        if (nearest >= 0 && is_guard_passed_real(guard, &search->end)) {
            const bool soon = search->start.draw > pair->q * guard->s || guard->s < 0.5 * search->end.s || !pair->rings;
            const alone_real from = soon ? search->start : search->end;
            found = nearest;
            search->end = guard->s > 0.0 ? alone_at_displacement_real(pair, &from, guard->s, 0.0, limit, evaluations)
                                         : search->start;
        } else {
            found = alone_guard_at_limit_real(search);
        }
        rests = !(search->rest_time > limit) && !(search->end.t < limit * (1.0 - 8.0 * HOPFORM_EPS_real));
    }
    found = found > 0 ? alone_tie_real(search, found, &search->end) : found;
    search->owner = rests ? search->rests : NO_OWNER_real;
    search->side = 0;
    search->stops = false;
    search->slack = 8.0 * HOPFORM_EPS_real * search->end.t;
    if (found >= 0 && (!rests || search->rests >= search->guard[found].owner)) {
        take_guard_real(search, &search->guard[found]);
        sharpen_alone_guard_real(search, &search->guard[found], until);
        rests = false;
    }
    return rests;
}

/* The first event of the phase, which lasts until a time at most; whether it may have functions of s and v. */
ALWAYS_real void find_alone_event_real(alone_search_real *search, bool bends, real until,
                                       evaluations_real *evaluations) {
    use_evaluations_real(evaluations, EVALUATIONS_OF_A_PHASE_real);
    search->end = search->start;
    if (!bends || !is_beyond_at_once_real(search)) {
        const bool rests = meet_guards_real(search, until, evaluations);
        if (bends && search->functions > 0) { meet_functions_real(search, rests, evaluations); }
    }
    search->touches = search->owner > CONTACT_real && is_alone_at_stop_real(search);
    search->certified = evaluations->left > 0;
    if (!search->certified) {
        search->end = search->start;
        search->owner = NO_OWNER_real;
    }
}

#endif
