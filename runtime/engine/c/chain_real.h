/* SPDX-License-Identifier: MIT-0
 *
 * One stance as a chain of phases: each is linear, has its closed form, and ends at the first of the events in
 * which an element reverses, sticks, slips or hits a stop, or in which the contact force returns to zero.
 */
#ifndef HOPFORM_CHAIN_H_real
#define HOPFORM_CHAIN_H_real

#include "alone_real.h"
#include "ledger_real.h"
#include "node_search_real.h"
#include "overlap_real.h"

/* ---- what ends a phase ---- */

#if HOPFORM_BOTH_MOVE
/* Where a phase of both ends: their rates, the state, by the axes of the core, and how far the position has moved. */
typedef struct {
    real z[HOPFORM_AXES];
    real moved;
    rates_by_row_real w;
    real terms;     /* the magnitudes that the rate of the velocity that has a position is a sum of */
    real stretched; /* those of the stretch */
} arrival_real;
#endif

/* When a phase ends, since it began, and what ends it. */
typedef struct {
    real t;
    bool certified; /* else the first event is not known: the phase is, up to then */
    bool stops;     /* the element has met a stop */
    int owner;      /* NO_OWNER where nothing happens until the current changes, or until the horizon */
    int side;       /* of an element that slips: where it goes */
    bool touches;   /* the element that comes to rest is at a stop within rounding */
#if HOPFORM_BOTH_MOVE
    arrival_real arrival; /* of both */
#endif
    alone_real alone; /* of one: its motion where the phase ends */
} stance_search_real;

/* Search a phase in which nothing moves: nothing happens until t. */
static inline void search_rest_real(stance_search_real *search, real t) {
    search->t = t;
    search->owner = NO_OWNER_real;
    search->stops = false;
    search->touches = false;
    search->certified = true;
}

/* The chain while it grows. */
typedef struct {
    const hopform_plan_real *plan;
    const hopform_step_real *steps;
    int32_t step_count;
    int32_t step;
    real horizon;
    real t;
    state_by_axis_real at;
    real from_lower; /* the position less its stops: the position itself has no digits for what is this close */
    real from_upper;
    row_real mode;
    int just_switched; /* the element that has just crossed its friction threshold: its acceleration is exactly zero */
    int came_to_rest; /* the element that has just come to rest, and whose free acceleration is known from the motion */
    real carried_acceleration; /* this acceleration, from before the state lost its digits */
    real most_stretched;       /* the largest magnitude of the stretch where phases have begun */
    real rounded_at_stop;      /* at a stop, what the spring's acceleration there has been rounded by; else 0 */
    real start_loss;
#if HOPFORM_HAS_CONTACT
    bool adds_up; /* the AED is the sum of its entries, not a difference of energies that are much larger */
    real aed;
#endif
    int32_t max_phases;
    hopform_phase_real *phases;
    int32_t capacity;
    int32_t count;
    int32_t event_count;
    real held_from; /* since when all are held, and how many phases there were then; 0 phases where one slips */
    int32_t held_count;
    int event;                   /* with which the phase began */
    drive_by_element_real drive; /* of the phase, as its numerators */
    numerators_by_axis_real numerators;
#if HOPFORM_BOTH_MOVE
    rates_by_row_real rates; /* in place of the numerators, where both slip */
#endif
    real draw;        /* where one slips alone, what has drawn it at the end of the last phase */
    bool keeps_rates; /* and that draw, over a step of the input that changes no force */
    evaluations_real *evaluations;
    observer_real *observer;
    current_variation_real *variation;
} stance_chain_real;

static inline real current_of_chain_real(const stance_chain_real *chain) {
    return input_of_mode_real(chain->plan, chain->mode, chain->steps[chain->step].u);
}

static inline const hopform_rates_real *rates_of_chain_real(const stance_chain_real *chain) {
    return rates_in_mode_real(chain->plan, chain->mode);
}

/* ---- the hold rule ---- */

/* Numerator of the free acceleration of an element that is held. */
static inline numerator_real free_numerator_real(const hopform_rates_real *rates, int element,
                                                 const numerators_real *numerators) {
    return element == 0 ? free_numerator_1_real(rates, numerators) : free_numerator_2_real(rates, numerators);
}

/* Enter the mode in which an element has another side. */
static inline void take_side_real(stance_chain_real *chain, int element, int side) {
    chain->mode = mode_with_side_real(chain->mode, element, side);
}

/* Whether a stop keeps an element at rest from going to a side. */
static inline bool stance_blocked_real(const stance_chain_real *chain, int element, int side) {
    const hopform_robot_real *robot = &chain->plan->robot;
    if (!HOPFORM_HAS_STOPS || element != HOPFORM_STOPPED_ELEMENT) { return false; }
    const bool locked = !(lower_stop_real(robot) < upper_stop_real(robot));
    return locked || (side < 0 && chain->from_lower <= 0.0) || (side > 0 && chain->from_upper >= 0.0);
}

/* The numerators from the chain's state in a mode. */
static inline numerators_by_axis_real numerators_of_chain_real(const stance_chain_real *chain, row_real mode) {
    numerators_by_axis_real made;
    made.named = motion_of_real(chain->plan, &chain->at.named, current_of_chain_real(chain), mode);
    return made;
}

/* First non-zero derivative of the free acceleration of an element that is held. */
static inline real drift_of_free_real(const stance_chain_real *chain, int element) {
    const numerators_by_axis_real numerators =
        numerators_of_chain_real(chain, mode_with_side_real(chain->mode, element, 0));
    const numerator_real free = free_numerator_real(rates_of_chain_real(chain), element, &numerators.named);
    return first_derivative_real(&free);
}

static inline free_by_element_real free_of_real(const stance_chain_real *chain, const hopform_state_real *state) {
    free_by_element_real free;
    free.named = free_accelerations_real(rates_of_chain_real(chain), state, current_of_chain_real(chain));
    return free;
}

/* The magnitudes that the free acceleration of an element, less its friction, is a sum of; at a stop with those of the
 * motion to it. */
static inline real terms_of_free_real(const stance_chain_real *chain, int element, real friction) {
    free_by_element_real terms;
    terms.named = free_terms_real(rates_of_chain_real(chain), &chain->at.named, current_of_chain_real(chain));
    return terms.of[element] + friction + (element == HOPFORM_STOPPED_ELEMENT ? chain->rounded_at_stop : 0.0);
}

/* Where an element at rest goes: held while |a_i| <= f_s,i, its friction at rest. On the threshold, which is where
 * rounding may have taken a_i - f_s,i from, its first non-zero derivative decides. Known from the motion, the
 * acceleration is exact. */
typedef struct {
    int side;
    bool on_threshold;
} direction_real;

static inline direction_real direction_from_rest_real(const stance_chain_real *chain, int element) {
    const bool known = chain->came_to_rest == element;
    const free_by_element_real free = free_of_real(chain, &chain->at.named);
    const real acceleration = known ? chain->carried_acceleration : free.of[element];
    const hopform_robot_real *robot = &chain->plan->robot;
    const real friction = level_at_rest_real(robot, element, acceleration < 0.0 ? -1 : 1);
    const real terms = known ? 0.0 : terms_of_free_real(chain, element, friction);
    const bool on_threshold = !(fabs_real(decided_real(fabs_real(acceleration) - friction, terms)) > 0.0);
    real goes = goes_real(acceleration, friction);
    if (on_threshold) {
        const real drift = HOPFORM_MOVES_ALONE ? 0.0 : drift_of_free_real(chain, element);
        const real level = level_at_rest_real(robot, element, drift < 0.0 ? -1 : 1);
        const bool has_none = !(decided_real(level, terms) > 0.0);
        goes = acceleration * drift > 0.0 || has_none ? goes_real(drift, 0.0) : 0.0;
    }
    const direction_real direction = {stance_blocked_real(chain, element, (int)goes) ? 0 : (int)goes, on_threshold};
    return direction;
}

/* ---- the limits of a law: the levels of its switching function ---- */

/* The switching function at the chain's state, the magnitudes that it is a sum of, and its levels. */
typedef struct {
    real value, terms;
    levels_real levels;
} switching_at_real;

static inline switching_at_real switching_of_chain_real(const stance_chain_real *chain) {
    const hopform_robot_real *robot = &chain->plan->robot;
    const real u = chain->steps[chain->step].u;
    const switching_at_real at = {switching_of_real(robot, &chain->at.named, u),
                                  switching_terms_real(robot, &chain->at.named, u), switching_levels_real(robot)};
    return at;
}

static inline real level_of_limit_real(const switching_at_real *at, int limit) {
    return limit < 0 ? at->levels.lower : at->levels.upper;
}

/* The magnitudes that the function less a level is a sum of: they are large where the law is stiff. */
static inline real terms_of_room_real(const switching_at_real *at, real level) {
    return at->terms + fabs_real(level);
}

/* How far the function is beyond the level of a limit, decided; below 0 where there is none. */
static inline real beyond_limit_real(const switching_at_real *at, int limit) {
    const real level = level_of_limit_real(at, limit);
    const real beyond = (real)limit * (at->value - level);
    return is_finite_real(level) ? decided_real(beyond, terms_of_room_real(at, level)) : -1.0;
}

/* The limit that the input is at; on a level 0. */
static inline void stance_choose_limit_real(stance_chain_real *chain) {
    if (!HOPFORM_HAS_LIMITS) { return; }
    const switching_at_real at = switching_of_chain_real(chain);
    const int below = beyond_limit_real(&at, -1) > 0.0 ? -1 : 0;
    chain->mode = mode_at_limit_real(chain->mode, beyond_limit_real(&at, 1) > 0.0 ? 1 : below);
}

/* On a level the first non-zero derivative of the function decides; the sides of the elements are known. */
static inline void stance_settle_limit_real(stance_chain_real *chain) {
    if (!HOPFORM_HAS_LIMITS || limit_of_mode_real(chain->mode) != 0 || rests_of_mode_real(chain->mode)) { return; }
    const switching_at_real at = switching_of_chain_real(chain);
    const int below = !(beyond_limit_real(&at, -1) < 0.0) ? -1 : 0;
    const int limit = !(beyond_limit_real(&at, 1) < 0.0) ? 1 : below;
    if (limit == 0) { return; }
    const numerators_by_axis_real numerators = numerators_of_chain_real(chain, chain->mode);
    const numerator_real h = switching_numerator_real(&chain->plan->robot, &chain->at.named, &numerators.named);
    chain->mode = mode_at_limit_real(chain->mode, (real)limit * first_derivative_real(&h) > 0.0 ? limit : 0);
}

/* The side of an element that is at rest. One that starts on its threshold has the acceleration of the excess there. */
static inline void settle_element_real(stance_chain_real *chain, int element) {
    const direction_real direction = direction_from_rest_real(chain, element);
    take_side_real(chain, element, direction.side);
    if (direction.on_threshold && direction.side != 0) { chain->just_switched = element; }
}

/* Those of the elements that are at rest, a bit each; where both are twice, because each may depend on what the other
 * does. */
SHARED_real void stance_settle_real(stance_chain_real *chain, uint32_t resting) {
    const bool several = !HOPFORM_MOVES_ALONE && (resting & (resting - 1u)) != 0;
    if (!several && resting == 0) { return; }
    const int first = several || HOPFORM_MOVES_ALONE ? 0 : (int)(resting >> 1u);
    for (int n = 0; n < (several ? 2 * HOPFORM_ELEMENTS : 1); n++) {
        settle_element_real(chain, several ? n % HOPFORM_ELEMENTS : first);
    }
}

static inline uint32_t held_elements_real(const stance_chain_real *chain) {
    uint32_t held = 0;
    for (int element = 0; element < HOPFORM_MOVING_ELEMENTS; element++) {
        held |= side_of_mode_real(chain->mode, element) == 0 ? 1u << (uint32_t)element : 0u;
    }
    return held;
}

/* Up to when the current stays as it is. */
static inline real end_of_step_real(const stance_chain_real *chain) {
    const int32_t next = chain->step + 1;
    const real until = next < chain->step_count ? chain->steps[next].t : chain->horizon;
    return lesser_real(until, chain->horizon);
}

/* ---- the end of a phase ---- */

#if HOPFORM_HAS_CONTACT
/* The magnitudes that the contact force is a sum of; 0 where it is the stretch alone. */
static inline real terms_of_contact_real(const stance_chain_real *chain) {
    return HOPFORM_CONTACT_IS_STRETCH ? 0.0 : contact_terms_real(&chain->plan->robot, &chain->at.named);
}
#endif

#if HOPFORM_BOTH_MOVE
/* ---- both slip, by their rates ---- */

/* The first of two derivatives that is not zero. */
static inline real first_of_real(real rate, real bend) {
    return fabs_real(rate) > 0.0 ? rate : bend;
}

/* How far it is to the stop ahead; NEVER without one. */
static inline real gap_ahead_real(const stance_chain_real *chain) {
    const real gap =
        side_of_mode_real(chain->mode, HOPFORM_STOPPED_ELEMENT) > 0 ? -chain->from_upper : chain->from_lower;
    return HOPFORM_HAS_STOPS && is_finite_real(gap) ? gap : HOPFORM_NEVER_real;
}

#if HOPFORM_HAS_CONTACT
/* The contact force at the start, a row of the state: within the rounding of its terms it is on 0, from where its first
 * derivative leads. */
static inline void begin_contact_by_row_real(const stance_chain_real *chain, node_search_real *search) {
    search_node_real *low = search->low;
    for (int axis = 0; axis < 3; axis++) {
        state_by_axis_real one = {{0.0, 0.0, 0.0, 0.0}};
        one.of[axis_of_row_real[axis]] = 1.0;
        search->contact[axis] = contact_slope_real(&chain->plan->robot, &one.named);
    }
    const real force = contact_of_real(&chain->plan->robot, &chain->at.named);
    const real terms = terms_of_contact_real(chain);
    const rates_by_row_real d = deflated_rates_real(chain->plan, &search->w);
    low->y = chain->at.of[HOPFORM_STRETCH_AXIS];
    low->rate[0] = function_of_real(search, 0, search->w.of);
    low->deflated[0] = function_of_real(search, 0, d.of);
    const real first = first_of_real(low->rate[0], low->deflated[0]);
    const bool is_decided = fabs_real(decided_real(force, terms)) > 0.0;
    search->rounded[0] = fabs_real(force) + 0.25 * terms;
    search->is_beyond = !(force > 0.0) && (is_decided ? !(first > 0.0) : first < 0.0);
    low->value[0] = is_decided || first < 0.0 ? greater_real(force, 0.0) : 0.0;
}
#endif

/* The search at the start of the phase. */
static inline void begin_node_search_real(const stance_chain_real *chain, node_search_real *search) {
    const hopform_poles_real *poles = &chain->plan->poles[0];
    search_node_real *low = &search->node[0];
    search->plan = chain->plan;
    search->low = low;
    search->high = &search->node[1];
    search->rings = rings_real(poles);
    search->stiff = search->rings && fades_in_a_node_real(&chain->plan->transition);
    search->limit = end_of_step_real(chain) - chain->t;
    search->gap = gap_ahead_real(chain);
    search->first = 1;
    search->is_beyond = false;
    search->is_from_the_end = false;
    search->has_end = false;
#if HOPFORM_HAS_CONTACT
    if (falls_of_mode_real(chain->mode) || chain->at.of[HOPFORM_STRETCH_AXIS] < 0.0 || HOPFORM_CONTACT_IS_ROW) {
        search->first = 0;
    }
#endif
    search->sign[0] = 1.0;
    search->sign[1] = (real)side_of_mode_real(chain->mode, 0);
    search->sign[2] = (real)side_of_mode_real(chain->mode, 1);
    search->w = chain->rates;
    search->from = 0.0;
    const rates_by_row_real d = deflated_rates_real(chain->plan, &search->w);
    low->t = 0.0;
    low->x = 0.0;
    low->w = search->w;
    UNROLLED_real for (int n = 0; n < NODE_FUNCTIONS_real; n++) {
        const real z = chain->at.of[axis_of_row_real[n]];
        search->rounded[n] = fabs_real(z);
        search->from_the_end[n] = false;
        low->value[n] = above_zero_real(search, n, search->sign[n] * z);
        low->rate[n] = search->sign[n] * search->w.of[n];
        low->deflated[n] = search->sign[n] * d.of[n];
    }
#if HOPFORM_HAS_CONTACT
    if (HOPFORM_CONTACT_IS_ROW) {
        begin_contact_by_row_real(chain, search);
    } else if (search->first == 0 && chain->at.of[HOPFORM_STRETCH_AXIS] < 0.0) {
        search->is_beyond = !(first_of_real(low->rate[0], low->deflated[0]) > 0.0);
    }
#endif
    search->count = 0;
    search->evaluations = chain->evaluations;
    use_evaluations_real(search->evaluations, EVALUATIONS_OF_A_PHASE_real);
}

/* Where the phase ends: at the stop ahead in place of what was found, or nothing, at a time in the interval, if it is
 * met before. */
static inline const search_node_real *meet_stop_real(node_search_real *search, const search_node_real *there,
                                                     search_node_real *root, stance_search_real *end) {
    const int element = HOPFORM_STOPPED_ELEMENT;
    const real speed = there->value[1 + element];
    const real left = distance_at_real(search, there);
    const real fastest = greater_real(search->rounded[1 + element], fabs_real(speed));
    const real rounding = 16.0 * HOPFORM_EPS_real * (search->gap + fabs_real(there->x) + there->t * fastest);
    bool meets = left < -rounding;
    if (!meets && end->owner == ELEMENT_real + 1 - element && speed * there->t > 16.0 * rounding) {
        const real rate = fabs_real(search->w.of[2 - element]); /* of the one that comes to rest */
        const real other = 16.0 * HOPFORM_EPS_real * (search->rounded[2 - element] + there->t * rate);
        meets = (left - 4.0 * rounding) * rate < speed * other && !(left > 0.0);
    }
    if (!meets) {
        end->touches = end->owner == ELEMENT_real + element && fabs_real(left) <= rounding;
        return there;
    }
    if (there != search->high) { *search->high = *there; } /* the interval ends there */
    put_root_real(search, STOP_AHEAD_real, root);
    end->owner = ELEMENT_real + element;
    end->stops = true;
    end->certified = true;
#if HOPFORM_HAS_CONTACT
    const real rate = root->rate[0];
    const real bound = rounding_at_node_real(search, 0, root, rate);
    if (search->first == 0 && rate * root->t < -16.0 * bound
        && root->value[0] < 8.0 * HOPFORM_EPS_real * root->t * fabs_real(rate)) {
        end->owner = CONTACT_real;
        end->stops = false;
    }
#endif
    return root;
}

/* The values of functions that have faded while nothing has happened, counted from where they end. */
SELDOM_real void sharpen_arrival_real(const stance_chain_real *chain, const node_search_real *search,
                                      const search_node_real *there, arrival_real *arrival) {
    const settling_real to = settling_of_real(rates_of_chain_real(chain), &chain->drive.named, &there->w);
    for (int n = HOPFORM_CONTACT_IS_ROW ? 1 : 0; n < NODE_FUNCTIONS_real; n++) {
        const real terms = fabs_real(to.end.of[n]) + fabs_real(to.left.of[n]);
        if (terms < 0.5 * terms_of_node_real(search, n, there)) {
            arrival->z[axis_of_row_real[n]] = to.end.of[n] + to.left.of[n];
        }
    }
}

/* Where the phase ends. */
static inline void arrive_at_node_real(const node_search_real *search, const search_node_real *there, int owner,
                                       arrival_real *arrival) {
    for (int n = 0; n < NODE_FUNCTIONS_real; n++) {
        arrival->z[axis_of_row_real[n]] = search->sign[n] * there->value[n];
    }
    if (HOPFORM_CONTACT_IS_ROW) { arrival->z[HOPFORM_STRETCH_AXIS] = there->y; }
    arrival->moved = there->x;
    arrival->w = there->w;
    if (owner != ELEMENT_real + HOPFORM_STOPPED_ELEMENT) { return; }
    arrival->terms = fabs_real(there->w.of[1 + HOPFORM_STOPPED_ELEMENT])
                     + fabs_real(there->deflated[1 + HOPFORM_STOPPED_ELEMENT]) / sqrt_real(search->plan->poles[0].q);
    arrival->stretched = terms_of_node_real(search, 0, there);
}

/* Once in a while: values are counted from where they end, and until when, since the interval begins, no function has a
 * root is asked; 0 where that is not worth it. */
SELDOM_real real pass_quiet_time_real(const stance_chain_real *chain, node_search_real *search) {
    if (rates_of_chain_real(chain)->s_3 > 0.0 && chain->came_to_rest < 0) {
        const core_real settled = settled_of_both_real(rates_of_chain_real(chain), &chain->drive.named);
        count_from_the_end_real(search, &settled);
    }
    const real quiet = search->rings ? quiet_time_at_node_real(search) : 0.0;
    if (!(quiet > 8.0 * chain->plan->transition.h)) { return 0.0; }
    NODE_COUNT(quiet);
    return quiet;
}

/* The root of a function that creeps to it has digits of the terms that the function is a sum of. Counted from where
 * both elements end, by what has not yet faded there, it has more where these terms are smaller: by steps of Newton's.
 */
SELDOM_real void sharpen_root_at_node_real(const stance_chain_real *chain, const node_search_real *search, int n,
                                           search_node_real *root) {
    for (int step = 0; step < 4 && root->rate[n] < 0.0; step++) {
        const settling_real to = settling_of_real(rates_of_chain_real(chain), &chain->drive.named, &root->w);
        const real terms = function_terms_real(search, n, to.end.of) + function_terms_real(search, n, to.left.of);
        const real value =
            search->sign[n] * (function_of_real(search, n, to.end.of) + function_of_real(search, n, to.left.of));
        const real later = -value / root->rate[n];
        if (!(terms < 0.25 * terms_of_node_real(search, n, root)) || !(fabs_real(later) < 0.01 * root->t)
            || fabs_real(later) <= HOPFORM_EPS_real * root->t) {
            return;
        }
        const search_node_real at = *root;
        put_node_after_real(search, &at, later, root);
    }
}

/* The end of the next interval. */
ALWAYS_real void end_next_interval_real(node_search_real *search, real quiet) {
    const hopform_transition_real *transition = &search->plan->transition;
    const search_node_real *low = search->low;
    const real left = search->limit - low->t;
    const bool far = search->stiff || (!search->rings && transition->fastest * transition->h > 30.0);
    const bool fades = far && !(low->t > 0.0); /* for as long as that does not */
    const bool grows = !search->rings && low->t > 0.0;
    const real one = fades ? 1.0 / transition->fastest : (grows && far ? 0.0 : transition->h);
    const real length = greater_real(quiet, grows ? greater_real(one, 3.0 * low->t) : one);
    NODE_COUNT(node);
    search->count++;
    if (!(length < left)) {
        put_node_after_real(search, low, left, search->high);
        search->high->t = search->limit;
    } else if (fades || grows || quiet > 0.0) {
        put_node_after_real(search, low, length, search->high);
    } else {
        const gained_real gained = gained_by_rows_real(transition->stays, transition->gains, transition->moves,
                                                       transition->h, velocity_of_node_real(search, low), &low->w);
        use_evaluations_real(search->evaluations, 1);
        put_node_real(search, low, &gained, low->t + length, search->high);
    }
}

/* Whether the contact is lost at the time of the limit: over a step of the input it wins. */
static inline bool is_lost_at_limit_real(const node_search_real *search) {
    const search_node_real *at = search->high;
    const real rate = at->rate[0];
    if (search->first != 0 || !(at->value[0] < -8.0 * HOPFORM_EPS_real * search->limit * rate)) { return false; }
    return rate * search->limit < -16.0 * rounding_at_node_real(search, 0, at, rate);
}

/* The first event of the phase. */
static inline void find_end_by_rates_real(const stance_chain_real *chain, stance_search_real *end) {
    node_search_real search;
    begin_node_search_real(chain, &search);
    search_node_real root; /* or the stop */
    const search_node_real *there = search.low;
    bool certified = true;
    end->owner = NO_OWNER_real;
    end->side = 0;
    end->stops = false;
    end->touches = false;
    if (search.is_beyond) { end->owner = CONTACT_real; }
    int32_t nodes = search.stiff ? 7 : 0;
    real quiet = 0.0;
    for (bool open = end->owner < 0 && search.limit > 0.0; open; nodes++) {
        end_next_interval_real(&search, quiet);
        const bool is_certain = quiet > 0.0 || all_stay_above_real(&search);
        const uint32_t crossed = is_certain ? 0 : certify_interval_real(&search);
        certified = search.count <= HOPFORM_MOST_INTERVALS && search.evaluations->left > 0;
        if (!certified) {
            there = search.low;
            break;
        }
        const bool ends = !(search.high->t < search.limit);
        open = crossed == 0 && !ends;
        if (crossed != 0) {
            const int found = first_root_of_real(&search, crossed, &root);
            const bool creeps = root.t * fabs_real(root.rate[found]) < 0.25 * terms_of_node_real(&search, found, &root);
            if (creeps && rates_of_chain_real(chain)->s_3 > 0.0 && chain->came_to_rest < 0) {
                sharpen_root_at_node_real(chain, &search, found, &root);
            }
            end->owner = found;
        } else if (ends && is_lost_at_limit_real(&search)) {
            end->owner = CONTACT_real;
        }
        const bool is_behind = HOPFORM_HAS_STOPS && distance_at_real(&search, search.high) < 0.0;
        if (!open || is_behind) {
            there = crossed != 0 ? &root : search.high;
            if (search.gap < HOPFORM_NEVER_real) { there = meet_stop_real(&search, there, &root, end); }
            open = open && end->owner == NO_OWNER_real;
        }
        if (open) {
            begin_next_interval_real(&search);
            const bool is_due = !search.rings || (nodes & 7) == 7; /* intervals beside real poles grow */
            quiet = is_due ? pass_quiet_time_real(chain, &search) : 0.0;
        }
    }
    end->certified = certified;
    end->t = there->t;
    arrive_at_node_real(&search, there, end->owner, &end->arrival);
    const bool has_faded = end->owner == NO_OWNER_real && end->t > 4.0 * chain->plan->transition.h;
    if (has_faded && rates_of_chain_real(chain)->s_3 > 0.0 && chain->came_to_rest < 0) {
        sharpen_arrival_real(chain, &search, there, &end->arrival);
    }
}
#endif

/* ---- one slips alone, in its own coordinate: how far it has gone to its side ---- */

/* How far the stretch goes with it. */
static inline real stretch_by_displacement_real(const stance_chain_real *chain, int alone) {
    const real follows = (real)HOPFORM_STRETCH_FOLLOWS(rates_of_chain_real(chain), alone);
    return (real)side_of_mode_real(chain->mode, alone) * follows;
}

#if HOPFORM_HAS_CONTACT
/* Where the forces on the element cancel at no stretch, the contact force rings about 0 as a velocity does: its first
 * zero is known however far it has faded by then. */
static inline void put_alone_contact_real(alone_search_real *search, const stance_chain_real *chain, int alone) {
    const hopform_robot_real *robot = &chain->plan->robot;
    const numerator_real h = contact_numerator_real(robot, &chain->numerators.named);
    const real force = contact_of_real(robot, &chain->at.named);
    const real follows = stretch_by_displacement_real(chain, alone);
    const real q = search->pair.q;
    state_by_axis_real settled = {{0.0, 0.0, 0.0, 0.0}};
    settled.of[HOPFORM_STRETCH_AXIS] =
        follows * (real)side_of_mode_real(chain->mode, alone) * chain->drive.of[alone] / (q > 0.0 ? q : 1.0);
    if (!(fabs_real(chain->drive.of[alone]) > 0.0) && !(force < 0.0)) {
        search->rest_time = time_to_rest_real(search->pair.poles, force, h.H3);
        search->rests = CONTACT_real;
    } else if (!HOPFORM_CONTACT_IS_STRETCH) {
        alone_function_real *contact =
            add_alone_function_real(search, &h, force, terms_of_contact_real(chain), 1.0, CONTACT_real, 0);
        if (q > 0.0) { contact->settled = contact_of_real(robot, &settled.named); }
    } else if (follows < 0.0) {
        alone_guard_real *contact = add_alone_guard_real(search, force / -follows, CONTACT_real);
        if (q > 0.0) { contact->settled = contact_of_real(robot, &settled.named) / -follows; }
    }
}
#endif

/* The room of the switching function to its levels, or at a limit what it is beyond that. */
static inline void put_alone_limit_real(alone_search_real *search, const stance_chain_real *chain, int alone) {
    (void)alone; /* the driven one */
    const int from = limit_of_mode_real(chain->mode);
    const switching_at_real at = switching_of_chain_real(chain);
    const numerator_real h = switching_numerator_real(&chain->plan->robot, &chain->at.named, &chain->numerators.named);
    for (int limit = -1; limit <= 1; limit += 2) {
        const real level = level_of_limit_real(&at, limit);
        if (is_finite_real(level) && (from == 0 || limit == from)) {
            (void)add_alone_function_real(search, &h, at.value - level, terms_of_room_real(&at, level),
                                          (real)(from == 0 ? -limit : limit), LIMIT_real, from == 0 ? limit : 0);
        }
    }
}

static inline void put_alone_stop_real(alone_search_real *search, const stance_chain_real *chain, int alone) {
    const real gap = side_of_mode_real(chain->mode, alone) > 0 ? -chain->from_upper : chain->from_lower;
    if (alone == HOPFORM_STOPPED_ELEMENT && is_finite_real(gap)) {
        add_alone_guard_real(search, gap, ELEMENT_real + alone)->stops = true;
    }
}

/* Its own coordinate: the time to rest is found where it is asked for. What draws it is what the numerator of the
 * stretch has: v' + p v is a small difference beside a large p. What has faded has no digits in a state: over
 * a step of the input that changes no force it is that of the motion before. */
static inline void put_alone_velocity_real(alone_search_real *search, const stance_chain_real *chain, int alone) {
    const real side = (real)side_of_mode_real(chain->mode, alone);
    const real follows = (real)HOPFORM_STRETCH_FOLLOWS(rates_of_chain_real(chain), alone);
    const real draw = chain->numerators.of.stretch.H2 / follows;
    const real stretched = chain->most_stretched + fabs_real(chain->at.of[HOPFORM_STRETCH_AXIS]);
    const real rounding = 16.0 * HOPFORM_EPS_real * (fabs_real(chain->drive.of[alone]) + search->pair.q * stretched);
    const bool keeps = chain->keeps_rates && fabs_real(draw) < 64.0 * rounding;
    search->start =
        alone_start_real(&search->pair, greater_real(side * chain->at.of[HOPFORM_VELOCITY_AXIS(alone)], 0.0),
                         side * (keeps ? chain->draw : draw), keeps ? 0.0 : rounding);
}

/* The thresholds of the free acceleration of what is held, on which the velocity acts. */
static inline void put_alone_thresholds_real(alone_search_real *search, const stance_chain_real *chain, int held) {
    const numerator_real h = free_numerator_real(rates_of_chain_real(chain), held, &chain->numerators.named);
    const free_by_element_real free = free_of_real(chain, &chain->at.named);
    for (int side = -1; side <= 1; side += 2) {
        if (stance_blocked_real(chain, held, side)) { continue; }
        const real level = level_at_rest_real(&chain->plan->robot, held, side);
        (void)add_alone_function_real(search, &h, free.of[held] - (real)side * level,
                                      terms_of_free_real(chain, held, level), -(real)side, ELEMENT_real + held, side);
    }
}

/* The threshold to which the free acceleration of what is held goes. */
static inline void put_alone_threshold_real(alone_search_real *search, const stance_chain_real *chain, int alone) {
    const int held = 1 - alone;
    if (HOPFORM_IS_COUPLED) {
        put_alone_thresholds_real(search, chain, held);
        return;
    }
    state_by_axis_real change = {{0.0, 0.0, 0.0, 0.0}};
    change.of[HOPFORM_STRETCH_AXIS] = stretch_by_displacement_real(chain, alone);
    const real slope = free_slope_real(rates_of_chain_real(chain), held, &change);
    const int side = (int)goes_real(slope, 0.0);
    if (side == 0 || stance_blocked_real(chain, held, side)) { return; }
    const free_by_element_real free = free_of_real(chain, &chain->at.named);
    const real level = level_at_rest_real(&chain->plan->robot, held, side);
    const real by = 1.0 / fabs_real(slope);
    alone_guard_real *guard =
        add_alone_guard_real(search, by * (level - (real)side * free.of[held]), ELEMENT_real + held);
    guard->cancels = by * (0.25 * terms_of_free_real(chain, held, level));
    guard->side = side;
}

/* The search at the start of the phase. */
ALWAYS_real void put_alone_search_real(const stance_chain_real *chain, alone_search_real *search) {
    const int alone = alone_of_mode_real(chain->mode);
    begin_alone_search_real(search, alone, poles_of_real(chain->plan, chain->mode),
                            timescales_of_real(chain->plan, chain->mode)->half_period);
#define PUT_GUARD(kind) put_alone_##kind##_real(search, chain, alone);
    HOPFORM_GUARDS(PUT_GUARD)
#undef PUT_GUARD
}

/* The first event of the phase. */
static inline void find_end_alone_real(const stance_chain_real *chain, real until, stance_search_real *end) {
    alone_search_real search;
    put_alone_search_real(chain, &search);
    find_alone_event_real(&search, HOPFORM_ALONE_BENDS, until, chain->evaluations);
    end->alone = search.end;
    end->t = search.end.t;
    end->owner = search.owner;
    end->side = search.side;
    end->stops = search.stops;
    end->touches = search.touches;
    end->certified = search.certified;
}

/* The first event of the phase that starts at the chain's state. */
static inline void stance_find_end_real(stance_chain_real *chain, stance_search_real *search) {
    const real until = end_of_step_real(chain) - chain->t;
    if (rests_of_mode_real(chain->mode)) {
        search_rest_real(search, until);
        return;
    }
#if HOPFORM_BOTH_MOVE
    if (several_of_mode_real(chain->mode)) {
        find_end_by_rates_real(chain, search);
        return;
    }
#endif
    find_end_alone_real(chain, until, search);
}

/* ---- the chain ---- */

/* The phase that begins at the chain's time, state and mode. */
static inline hopform_phase_real phase_of_chain_real(const stance_chain_real *chain, int event) {
    hopform_phase_real phase;
#define PUT_MEMBER(name, domain) phase.name = chain->at.named.name;
    HOPFORM_STATE_MEMBERS(PUT_MEMBER)
#undef PUT_MEMBER
    phase.t = chain->t;
    phase.mode = (int8_t)number_of_mode_real(chain->mode);
    phase.event = (int8_t)event;
    phase.step = (uint16_t)chain->step;
    return phase;
}

static inline void stance_record_real(stance_chain_real *chain, int event) {
    if (chain->count < chain->capacity) { chain->phases[chain->count] = phase_of_chain_real(chain, event); }
    if (HOPFORM_IS_EVENT(event) && chain->count < chain->max_phases && chain->event_count <= chain->count) {
        chain->event_count++;
    }
    chain->event = event;
    chain->count++;
    if (!rests_of_mode_real(chain->mode)) {
        chain->held_count = 0;
    } else if (chain->held_count == 0) {
        chain->held_from = chain->t;
        chain->held_count = chain->count;
    }
}

/* An element has come to rest, or has met a stop: the event. A stop that it touches where it turns is none, but that is
 * where it is. */
static inline int end_of_velocity_real(stance_chain_real *chain, int element, bool stops, bool touches) {
    const int before = side_of_mode_real(chain->mode, element);
    chain->at.of[HOPFORM_VELOCITY_AXIS(element)] = 0.0; /* inelastic */
    if (stops || touches) {
        const real lower = lower_stop_real(&chain->plan->robot);
        const real upper = upper_stop_real(&chain->plan->robot);
        const real stop = before > 0 ? upper : lower;
        chain->at.of[HOPFORM_POSITION_AXIS] = stop;
        chain->from_lower = stop - lower;
        chain->from_upper = stop - upper;
    }
    stance_choose_limit_real(chain);
    stance_settle_real(chain, 1u << (uint32_t)element);
    stance_settle_limit_real(chain);
    const int after = side_of_mode_real(chain->mode, element);
    if ((stops && after != before) || (touches && after == 0)) { return HOPFORM_EVENT_HITS_STOP; }
    if (after == before) { return HOPFORM_EVENT_NONE; /* a touch, it goes on */ }
    return after == 0 ? HOPFORM_EVENT_STICKS(element) : HOPFORM_EVENT_REVERSES(element);
}

/* The input has taken its value of a step: what is held may begin to slip. */
static inline void take_step_real(stance_chain_real *chain) {
    const uint32_t held = held_elements_real(chain);
    const int32_t count = chain->count;
    stance_choose_limit_real(chain);
    stance_settle_real(chain, held);
    stance_settle_limit_real(chain);
    for (int element = 0; element < HOPFORM_MOVING_ELEMENTS; element++) {
        if ((held & 1u << (uint32_t)element) != 0 && side_of_mode_real(chain->mode, element) != 0) {
            stance_record_real(chain, HOPFORM_EVENT_SLIPS(element));
        }
    }
    if (chain->count == count) { stance_record_real(chain, HOPFORM_EVENT_STEP); }
}

/* The element with stops, without any friction, stops while the forces on it cancel to all digits of the state: what is
 * left of them is its acceleration before, `rate`, known from the motion where that has faded. `terms` are the
 * magnitudes that it is a sum of, `stretched` those of the stretch. */
SELDOM_real void keep_small_acceleration_real(stance_chain_real *chain, real rate, real terms, real stretched) {
    const int element = HOPFORM_STOPPED_ELEMENT;
    const hopform_rates_real *rates = rates_of_chain_real(chain);
    const hopform_robot_real *robot = &chain->plan->robot;
    const real friction = level_at_rest_real(robot, element, 1) + level_at_rest_real(robot, element, -1);
    if (friction > 0.0 || fabs_real(rates->a1_v1) > 0.0) { return; }
    const free_by_element_real at_rest = free_of_real(chain, &chain->at.named);
    const real by_spring = fabs_real(rates->a1_y * stretched);
    if (!(fabs_real(at_rest.of[element]) < 64.0 * HOPFORM_EPS_real * by_spring)) { return; }
    if (fabs_real(decided_real(rate, terms)) > 0.0) {
        chain->came_to_rest = element;
        chain->carried_acceleration = rate;
    }
}

/* What is known of the free acceleration of an element that comes to rest from its motion. */
static inline void keep_free_acceleration_real(stance_chain_real *chain, const stance_search_real *end) {
    const int element = end->owner - ELEMENT_real;
    chain->came_to_rest = NO_ELEMENT_real;
    if (!rests_of_mode_real(chain->mode)) { chain->rounded_at_stop = 0.0; }
    if (element < 0 || (HOPFORM_HAS_LIMITS && end->owner == LIMIT_real)
        || side_of_mode_real(chain->mode, element) == 0) {
        return;
    }
#if HOPFORM_BOTH_MOVE
    if (several_of_mode_real(chain->mode)) {
        if (element == HOPFORM_STOPPED_ELEMENT) {
            keep_small_acceleration_real(chain, end->arrival.w.of[1 + element], end->arrival.terms,
                                         end->arrival.stretched);
        }
        return;
    }
#endif
    if (end->stops || end->touches) { /* beside another one that moves no equilibrium lasts */
        const real moved = stretch_by_displacement_real(chain, element) * end->alone.s;
        const real stretched = chain->most_stretched + fabs_real(chain->at.of[HOPFORM_STRETCH_AXIS]) + fabs_real(moved);
        chain->rounded_at_stop = fabs_real(rates_of_chain_real(chain)->a1_y * stretched);
    } else {
        chain->came_to_rest = element;
        chain->carried_acceleration =
            free_after_rest_real((real)side_of_mode_real(chain->mode, element),
                                 level_of_real(&chain->plan->robot, element), fabs_real(end->alone.draw));
    }
}

/* The state at the end of a phase, and how far from its stops the position is there; what is held stays exactly where
 * it is. */
static inline void stance_arrive_real(stance_chain_real *chain, const stance_search_real *end) {
    real *position = &chain->at.of[HOPFORM_POSITION_AXIS];
    const real before = *position;
    chain->most_stretched = greater_real(chain->most_stretched, fabs_real(chain->at.of[HOPFORM_STRETCH_AXIS]));
    *position = 0.0;
    const int alone = alone_of_mode_real(chain->mode);
    if (alone >= 0) {
        const real side = (real)side_of_mode_real(chain->mode, alone);
        chain->at.of[HOPFORM_VELOCITY_AXIS(alone)] = side * end->alone.v;
        chain->at.of[HOPFORM_STRETCH_AXIS] += stretch_by_displacement_real(chain, alone) * end->alone.s;
        *position = alone == HOPFORM_STOPPED_ELEMENT ? side * end->alone.s : 0.0;
    }
#if HOPFORM_BOTH_MOVE
    if (several_of_mode_real(chain->mode)) {
        for (int axis = 1; axis < HOPFORM_AXES; axis++) {
            chain->at.of[axis] = end->arrival.z[axis];
        }
        *position = end->arrival.moved;
    }
#endif
    const real moved = *position;
    *position = before + moved;
    chain->from_lower += moved;
    chain->from_upper += moved;
}

/* The acceleration with which an element starts on its threshold. */
static inline real acceleration_on_threshold_real(const stance_chain_real *chain, int element) {
    const int side = side_of_mode_real(chain->mode, element);
    return (real)side * excess_to_side_real(&chain->plan->robot, element, side);
}

#if HOPFORM_BOTH_MOVE
/* The rates of the phase that begins at the chain's state; of an element that starts on its threshold, or whose
 * acceleration is known from the motion before, they are exactly that. Over a step of the input that changes no force
 * they are those of the motion before: what has faded has no digits in a state. */
static inline void begin_with_rates_real(stance_chain_real *chain) {
    if (chain->keeps_rates) { return; }
    const int starts = chain->just_switched;
    const int rested = chain->came_to_rest;
    chain->rates.named = rates_of_both_real(rates_of_chain_real(chain), &chain->drive.named, &chain->at.named);
    if (starts >= 0) { chain->rates.of[1 + starts] = acceleration_on_threshold_real(chain, starts); }
    if (rested >= 0) {
        chain->rates.of[1 + rested] =
            chain->carried_acceleration
            - (real)side_of_mode_real(chain->mode, rested) * level_of_real(&chain->plan->robot, rested);
    }
}
#endif

/* The drive and the numerators of the phase that begins at the chain's state. */
static inline void stance_begin_phase_real(stance_chain_real *chain) {
    const int element = chain->came_to_rest;
    const drive_by_element_real before = chain->drive;
    chain->drive.named = drive_in_mode_real(chain->plan, chain->mode, current_of_chain_real(chain));
    for (int n = 0; n < HOPFORM_ELEMENTS; n++) {
        chain->keeps_rates = chain->keeps_rates && !(fabs_real(chain->drive.of[n] - before.of[n]) > 0.0);
    }
#if HOPFORM_BOTH_MOVE
    if (several_of_mode_real(chain->mode)) {
        begin_with_rates_real(chain);
        return;
    }
#endif
    chain->numerators.named =
        motion_under_real(rates_of_chain_real(chain), &chain->drive.named, &chain->at.named, chain->mode);
    if (element >= 0 && side_of_mode_real(chain->mode, element) != 0) {
        const real level = (real)side_of_mode_real(chain->mode, element) * level_of_real(&chain->plan->robot, element);
        set_acceleration_from_rest_real(&chain->numerators, rates_of_chain_real(chain), element,
                                        chain->carried_acceleration - level);
    }
}

#if HOPFORM_HAS_CONTACT
/* The AED of a phase that lasts for t. */
SELDOM_real real aed_in_phase_real(const stance_chain_real *chain, real t) {
    const hopform_phase_real phase = phase_of_chain_real(chain, HOPFORM_EVENT_NONE);
    const hopform_ledger_real ledger = ledger_in_phase_real(chain->plan, &phase, current_of_chain_real(chain), t);
    return aed_of_ledger_real(&ledger);
}
#endif

/* The state and modes right after the end of a phase, recorded as the next phase. */
static inline void stance_pass_real(stance_chain_real *chain, const stance_search_real *end) {
    const int element = end->owner - ELEMENT_real;
    keep_free_acceleration_real(chain, end);
    chain->just_switched = NO_ELEMENT_real;
    chain->keeps_rates = false;
    int event = HOPFORM_EVENT_SLIPS(element);
    if (end->owner == NO_OWNER_real) {
        chain->step = chain->step + 1 < chain->step_count ? chain->step + 1 : chain->step;
        const int mode = number_of_mode_real(chain->mode);
        const int alone = alone_of_mode_real(chain->mode);
        if (alone >= 0) { chain->draw = (real)side_of_mode_real(chain->mode, alone) * end->alone.draw; }
#if HOPFORM_BOTH_MOVE
        if (several_of_mode_real(chain->mode)) { chain->rates = end->arrival.w; }
#endif
        take_step_real(chain);
        chain->keeps_rates = number_of_mode_real(chain->mode) == mode;
        return;
    }
    if (HOPFORM_HAS_LIMITS && end->owner == LIMIT_real) {
        chain->mode = mode_at_limit_real(chain->mode, end->side);
        event = HOPFORM_EVENT_OF_LIMIT(end->side);
    } else if (side_of_mode_real(chain->mode, element) != 0) {
        event = end_of_velocity_real(chain, element, end->stops, end->touches);
    } else {
        take_side_real(chain, element, end->side);
        chain->just_switched = element;
    }
    stance_record_real(chain, event);
}

#if HOPFORM_HAS_CONTACT
/* The contact is lost at once: it pulls, or its contact force is on 0 and the first non-zero derivative of that is
 * negative. */
static inline bool leaves_at_once_real(const stance_chain_real *chain) {
    const real contact =
        decided_real(contact_of_real(&chain->plan->robot, &chain->at.named), terms_of_contact_real(chain));
    const bool rises = HOPFORM_CONTACT_IS_STRETCH && stretch_rate_real(&chain->plan->robot, &chain->at.named) > 0.0;
    if (fabs_real(contact) > 0.0 || rises) { return contact < 0.0; }
    const numerators_by_axis_real numerators = numerators_of_chain_real(chain, chain->mode);
    const numerator_real h = contact_numerator_real(&chain->plan->robot, &numerators.named);
    return first_derivative_real(&h) < 0.0;
}
#endif

/* z' where the phase of the chain begins, at a state. */
static inline state_by_axis_real speeds_at_start_real(const stance_chain_real *chain, const state_by_axis_real *start) {
    state_by_axis_real speeds;
    speeds.of[HOPFORM_POSITION_AXIS] = start->of[HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT)];
#if HOPFORM_BOTH_MOVE
    if (several_of_mode_real(chain->mode)) {
        for (int n = 0; n < 3; n++) {
            speeds.of[axis_of_row_real[n]] = chain->rates.of[n];
        }
        return speeds;
    }
#endif
    for (int axis = 1; axis < HOPFORM_AXES; axis++) {
        speeds.of[axis] = chain->numerators.core[axis - 1].H3;
    }
    return speeds;
}

/* z' where it ends, at which the chain has arrived. */
static inline state_by_axis_real speeds_at_end_real(const stance_chain_real *chain, const stance_search_real *end) {
    const int alone = alone_of_mode_real(chain->mode);
    state_by_axis_real speeds = {{0.0, 0.0, 0.0, 0.0}};
    speeds.of[HOPFORM_POSITION_AXIS] = chain->at.of[HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT)];
    if (alone >= 0) {
        const alone_pair_real pair = alone_pair_of_real(poles_of_real(chain->plan, chain->mode));
        const real side = (real)side_of_mode_real(chain->mode, alone);
        speeds.of[HOPFORM_VELOCITY_AXIS(alone)] = side * alone_acceleration_real(&pair, &end->alone);
        speeds.of[HOPFORM_STRETCH_AXIS] = stretch_by_displacement_real(chain, alone) * end->alone.v;
    }
#if HOPFORM_BOTH_MOVE
    if (several_of_mode_real(chain->mode)) {
        for (int n = 0; n < 3; n++) {
            speeds.of[axis_of_row_real[n]] = end->arrival.w.of[n];
        }
    }
#endif
    return speeds;
}

/* Pass the finished phase to the observer, if there is one. */
static inline void notify_real(const stance_chain_real *chain, const state_by_axis_real *start,
                               const stance_search_real *end) {
    if (chain->observer != NULL) {
        const solved_phase_real phase = {
            start,       &chain->at, &chain->drive, speeds_at_start_real(chain, start), speeds_at_end_real(chain, end),
            chain->mode, end->t,     chain->event,  end->owner == CONTACT_real};
        chain->observer(chain->variation, &phase);
    }
}

/* The same of a last phase of no duration. */
static inline void notify_ending_real(stance_chain_real *chain) {
    if (chain->observer != NULL) {
        stance_begin_phase_real(chain);
        const state_by_axis_real now = speeds_at_start_real(chain, &chain->at);
        const solved_phase_real phase = {&chain->at,  &chain->at, &chain->drive, now,  now,
                                         chain->mode, 0.0,        chain->event,  false};
        chain->observer(chain->variation, &phase);
    }
}

/* The ending that comes before the next phase; 0 if the stance goes on. */
static inline int32_t ending_before_phase_real(stance_chain_real *chain) {
    if (chain->count > chain->max_phases) {
        chain->count = chain->max_phases; /* a step of the input may have begun two */
        return HOPFORM_ENDING_TOO_MANY_PHASES;
    }
    if (rests_of_mode_real(chain->mode) && chain->step + 1 >= chain->step_count) {
        chain->t = chain->held_from; /* steps of the input since then have moved nothing */
        chain->count = chain->held_count;
        notify_ending_real(chain);
        return HOPFORM_ENDING_REST;
    }
    return 0;
}

/* What each element does at the start, no event; the ending if that is there already, 0 if not. */
static inline int32_t stance_begin_real(stance_chain_real *chain) {
    chain->mode = mode_of_number_real(HOPFORM_MODE_AT_REST);
    for (int element = 0; element < HOPFORM_MOVING_ELEMENTS; element++) {
        real *velocity = &chain->at.of[HOPFORM_VELOCITY_AXIS(element)];
        const int side = (int)goes_real(*velocity, 0.0);
        const bool blocked =
            element == HOPFORM_STOPPED_ELEMENT && side != 0 && stance_blocked_real(chain, element, side);
        if (blocked) {
            chain->start_loss = loss_at_stop_real(&chain->plan->robot, &chain->at.named);
            *velocity = 0.0;
        }
        take_side_real(chain, element, blocked ? 0 : side);
    }
    stance_choose_limit_real(chain);
    stance_settle_real(chain, held_elements_real(chain));
    stance_settle_limit_real(chain);
    stance_record_real(chain, HOPFORM_EVENT_NONE);
#if HOPFORM_HAS_CONTACT
    if (leaves_at_once_real(chain)) { return HOPFORM_ENDING_TAKEOFF; }
#endif
    return ending_before_phase_real(chain);
}

/* Carry the chain to the end of a phase and through its event; the ending, 0 if another phase follows. */
static inline int32_t stance_end_phase_real(stance_chain_real *chain, const stance_search_real *end) {
    const real until = end_of_step_real(chain);
    const state_by_axis_real start = chain->at;
    const bool passes = end->owner == NO_OWNER_real && end->certified;
    const real length = end->t;
#if HOPFORM_HAS_CONTACT
    chain->aed += chain->adds_up ? aed_in_phase_real(chain, length) : 0.0;
#endif
    stance_arrive_real(chain, end);
    notify_real(chain, &start, end);
    chain->t = passes ? until : lesser_real(chain->t + length, until); /* not behind it by rounding */
#if HOPFORM_HAS_CONTACT
    if (end->owner == CONTACT_real) {
        real *stretch = &chain->at.of[HOPFORM_STRETCH_AXIS]; /* of an extending leg that carries nothing */
        const bool is_left = HOPFORM_CONTACT_IS_STRETCH || *stretch < 0.0;
        *stretch = is_left && is_finite_real(*stretch) ? 0.0 : *stretch; /* else the stance is refused */
        return HOPFORM_ENDING_TAKEOFF;
    }
#endif
    if (passes && !(until < chain->horizon)) { return HOPFORM_ENDING_HORIZON; }
    if (!end->certified) { return HOPFORM_ENDING_UNCERTIFIED; }
    stance_pass_real(chain, end);
#if HOPFORM_HAS_CONTACT
    if (!HOPFORM_CONTACT_IS_STRETCH && end->stops && leaves_at_once_real(chain) && chain->count <= chain->max_phases) {
        notify_ending_real(chain); /* what the velocity has lost at the stop was in the contact force */
        return HOPFORM_ENDING_TAKEOFF;
    }
#endif
    return ending_before_phase_real(chain);
}

/* ---- in and out ---- */

static inline bool is_finite_state_real(const hopform_state_real *state) {
    state_by_axis_real at;
    at.named = *state;
    real sum = 0.0;
    UNROLLED_real for (int axis = 0; axis < HOPFORM_AXES; axis++) {
        sum += fabs_real(at.of[axis]);
    }
    return sum <= HOPFORM_NEVER_real;
}

/* Whether a state is finite, and what never moves rests at 0. */
static inline bool is_sound_state_real(const hopform_state_real *state) {
    state_by_axis_real at;
    at.named = *state;
    bool fixed = !(HOPFORM_NEVER_MOVES(HOPFORM_STOPPED_ELEMENT) && fabs_real(at.of[HOPFORM_POSITION_AXIS]) > 0.0);
    for (int element = 0; element < HOPFORM_ELEMENTS; element++) {
        fixed = fixed && !(HOPFORM_NEVER_MOVES(element) && fabs_real(at.of[HOPFORM_VELOCITY_AXIS(element)]) > 0.0);
    }
    return is_finite_state_real(state) && fixed;
}

/* Status of a state that a stance is to start from. */
static inline int32_t state_status_real(const hopform_robot_real *robot, const hopform_state_real *start) {
    state_by_axis_real at;
    at.named = *start;
    const real position = at.of[HOPFORM_POSITION_AXIS];
    if (!is_sound_state_real(start) || !(position >= lower_stop_real(robot) && position <= upper_stop_real(robot))) {
        return HOPFORM_ERROR_STATE;
    }
#if HOPFORM_HAS_CONTACT
    if (at.of[HOPFORM_STRETCH_AXIS] < 0.0) { return HOPFORM_ERROR_EXTENDED; }
#endif
    return HOPFORM_OK;
}

/* Status of a stance that is to be solved, but for its input. */
static inline int32_t stance_status_real(const hopform_robot_real *robot, const hopform_state_real *start, real horizon,
                                         int32_t max_phases) {
    const int32_t status = state_status_real(robot, start);
    if (status < 0) { return status; }
    const bool ends = horizon > 0.0 && horizon <= HOPFORM_NEVER_real && max_phases >= 1;
    return ends ? HOPFORM_OK : HOPFORM_ERROR_HORIZON;
}

/* Put the chain of a stance at its start. What each element does there is no event. */
static inline void stance_start_real(stance_chain_real *chain, const hopform_plan_real *plan,
                                     const hopform_state_real *start, const hopform_step_real *steps,
                                     int32_t step_count, real horizon, int32_t max_phases, hopform_phase_real *phases,
                                     int32_t capacity, evaluations_real *evaluations) {
    chain->plan = plan;
    chain->evaluations = evaluations;
    chain->steps = steps;
    chain->step_count = step_count;
    chain->step = 0;
    chain->horizon = horizon;
    chain->t = 0.0;
    chain->at.named = *start;
    chain->from_lower = chain->at.of[HOPFORM_POSITION_AXIS] - lower_stop_real(&plan->robot);
    chain->from_upper = chain->at.of[HOPFORM_POSITION_AXIS] - upper_stop_real(&plan->robot);
    chain->just_switched = NO_ELEMENT_real;
    chain->came_to_rest = NO_ELEMENT_real;
    chain->carried_acceleration = 0.0;
    const drive_by_element_real none = {{0.0, 0.0}};
    chain->drive = none;
    chain->draw = 0.0;
    chain->keeps_rates = false;
    chain->most_stretched = 0.0;
    chain->rounded_at_stop = 0.0;
    chain->start_loss = 0.0;
#if HOPFORM_HAS_CONTACT
    chain->adds_up = stores_much_real(&plan->robot, start);
    chain->aed = 0.0;
#endif
    chain->max_phases = max_phases;
    chain->phases = phases;
    chain->capacity = capacity;
    chain->count = 0;
    chain->event_count = 0;
    chain->held_from = 0.0;
    chain->held_count = 0;
    chain->event = HOPFORM_EVENT_NONE;
    chain->observer = NULL;
    chain->variation = NULL;
}

/* Put a stance that has come to its ending into its record. */
static inline int32_t stance_report_real(const stance_chain_real *chain, const hopform_state_real *start,
                                         int32_t ending, hopform_stance_real *stance) {
    const hopform_state_real *end = &chain->at.named;
    real others = chain->t;
    stance->duration = chain->t;
    stance->end = *end;
    stance->start_loss = chain->start_loss;
    stance->ending = ending;
    stance->phase_count = chain->count;
    stance->event_count = chain->event_count;
    stance->phases_kept = chain->count < chain->capacity ? chain->count : chain->capacity;
#if HOPFORM_HAS_CONTACT
    const hopform_robot_real *robot = &chain->plan->robot;
    const bool rises = ending == HOPFORM_ENDING_TAKEOFF && fall_of_real(robot) > 0.0;
    stance->aed = chain->adds_up ? chain->aed : body_energy_gain_real(robot, start, &chain->at.later);
    stance->apex = rises ? apex_after_real(robot, end) : 0.0;
    others = fabs_real(others) + fabs_real(stance->apex) + fabs_real(stance->aed);
#else
    (void)start;
#endif
    if (!is_finite_state_real(end) || !(others - stance->start_loss <= HOPFORM_NEVER_real)) {
        const memory_real written = array_real(stance, 1, sizeof *stance);
        return refuse_real(HOPFORM_ERROR_NUMBERS, &written, 1, NULL, 0);
    }
    return stance->phases_kept < stance->phase_count ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK;
}

#endif
