/* SPDX-License-Identifier: MIT-0
 *
 * One stance as a chain of phases: each is linear, has its closed form, and ends at the first of the events in
 * which an element reverses, sticks, slips or hits a stop, or in which the contact force returns to zero.
 */
#ifndef HOPFORM_CHAIN_H_real
#define HOPFORM_CHAIN_H_real

#include "first_event_real.h"
#include "ledger_real.h"
#include "modal_search_real.h"
#include "overlap_real.h"

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
    motion_modes_real modes; /* of the motion, once the modal form is evaluated */
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

/* A held element slips where its free acceleration leaves [-f_s, f_s]; a stop holds on its side whatever the force.
 * While another one slips alone that acceleration is monotone, unless velocities act on it: then it may leave to one
 * side. */
static inline void add_thresholds_real(const stance_chain_real *chain, int element, bool needs_certificate,
                                       event_set_real *set) {
    const bool open[] = {!stance_blocked_real(chain, element, -1), !stance_blocked_real(chain, element, 1)};
    if (!open[0] && !open[1]) { return; }
    const numerator_real h = free_numerator_real(rates_of_chain_real(chain), element, &chain->numerators.named);
    const real drift = first_derivative_real(&h);
    const free_by_element_real free = free_of_real(chain, &chain->at.named);
    for (int side = -1; side <= 1; side += 2) {
        const real sign = (real)side;
        if (open[side > 0] && (sign * drift > 0.0 || HOPFORM_IS_COUPLED)) {
            const real level = level_at_rest_real(&chain->plan->robot, element, side);
            event_function_real *slips = add_event_function_real(set, &h, free.of[element] - sign * level, -sign,
                                                                 ELEMENT_real + element, needs_certificate);
            put_on_threshold_real(slips, terms_of_free_real(chain, element, level));
            slips->side = side;
        }
    }
}

#if HOPFORM_HAS_CONTACT
/* The magnitudes that the contact force is a sum of; 0 where it is the stretch alone. */
static inline real terms_of_contact_real(const stance_chain_real *chain) {
    return HOPFORM_CONTACT_IS_STRETCH ? 0.0 : contact_terms_real(&chain->plan->robot, &chain->at.named);
}
#endif

/* ---- the event functions of a phase, by the kinds of guards: each puts those that are active in the mode ---- */

/* Whether all but a velocity is monotone until the end of the phase. */
static inline bool is_monotone_real(row_real mode) {
    return alone_of_mode_real(mode) >= 0 && HOPFORM_CONTACT_IS_STRETCH && !HOPFORM_IS_COUPLED;
}

#if HOPFORM_HAS_CONTACT
/* Where one element slips alone and the forces on it cancel at no stretch, the stretch of a contact rings about 0 as a
 * velocity does: its first zero is known however far it has faded by then. Else it is one of those that are searched,
 * unless it is the contact force and only rises, from 0 on. */
static inline void put_contact_real(stance_events_real *events, const stance_chain_real *chain) {
    const row_real mode = chain->mode;
    const real stretch = chain->at.of[HOPFORM_STRETCH_AXIS];
    const int alone = alone_of_mode_real(mode);
    const bool may_ring = HOPFORM_CONTACT_IS_STRETCH && alone >= 0 && !(stretch < 0.0);
    if (may_ring && !(fabs_real(chain->drive.of[alone]) > 0.0)) {
        events->rest_time = time_to_rest_real(events->set.poles, stretch, chain->numerators.of.stretch.H3);
        events->rests = CONTACT_real;
    } else if (falls_of_mode_real(mode) || stretch < 0.0 || !HOPFORM_CONTACT_IS_STRETCH) {
        const numerator_real h = contact_numerator_real(&chain->plan->robot, &chain->numerators.named);
        const real start = contact_of_real(&chain->plan->robot, &chain->at.named);
        event_function_real *contact =
            add_event_function_real(&events->set, &h, start, 1.0, CONTACT_real, !is_monotone_real(mode));
        if (!HOPFORM_CONTACT_IS_STRETCH) { put_on_threshold_real(contact, terms_of_contact_real(chain)); }
    }
}
#endif

/* How far the position is from the stop ahead, if there is one. */
static inline void put_stop_real(stance_events_real *events, const stance_chain_real *chain) {
    const int side = side_of_mode_real(chain->mode, HOPFORM_STOPPED_ELEMENT);
    const real gap = side > 0 ? -chain->from_upper : chain->from_lower;
    if (side == 0 || !is_finite_real(gap)) { return; }
    const real away = -(real)side;
    const numerator_real *h = &chain->numerators.of.position;
    const numerator_real first = {chain->at.of[HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT)], h->H3, h->H2};
    event_function_real *stop =
        add_event_function_real(&events->set, &first, away * gap, away, ELEMENT_real + HOPFORM_STOPPED_ELEMENT, false);
    stop->touch_is_no_event = true;
    stop->H0 = away * h->H1;
}

/* The room of the switching function to its levels, or at a limit what it is beyond that. */
static inline void put_limit_real(stance_events_real *events, const stance_chain_real *chain) {
    const int from = limit_of_mode_real(chain->mode);
    const switching_at_real at = switching_of_chain_real(chain);
    const numerator_real h = switching_numerator_real(&chain->plan->robot, &chain->at.named, &chain->numerators.named);
    for (int limit = -1; limit <= 1; limit += 2) {
        const real level = level_of_limit_real(&at, limit);
        if (is_finite_real(level) && (from == 0 || limit == from)) {
            event_function_real *room = add_event_function_real(&events->set, &h, at.value - level,
                                                                (real)(from == 0 ? -limit : limit), LIMIT_real, true);
            put_on_threshold_real(room, terms_of_room_real(&at, level));
            room->side = from == 0 ? limit : 0;
        }
    }
}

/* The velocity of each that slips beside others; of what slips alone its time to rest, in closed form. */
static inline void put_velocity_real(stance_events_real *events, const stance_chain_real *chain) {
    const row_real mode = chain->mode;
    const int alone = alone_of_mode_real(mode);
    for (int element = 0; element < HOPFORM_MOVING_ELEMENTS && alone < 0; element++) {
        (void)add_event_function_real(&events->set, &chain->numerators.of.velocity[element],
                                      chain->at.of[HOPFORM_VELOCITY_AXIS(element)],
                                      (real)side_of_mode_real(mode, element), ELEMENT_real + element, true);
    }
    if (alone < 0) { return; }
    const real sign = (real)side_of_mode_real(mode, alone);
    const real rest = time_to_rest_real(events->set.poles, sign * chain->at.of[HOPFORM_VELOCITY_AXIS(alone)],
                                        sign * chain->numerators.of.velocity[alone].H3);
    if (events->rests == NO_OWNER_real || !(events->rest_time <= rest)) {
        events->rest_time = rest;
        events->rests = ELEMENT_real + alone;
    }
}

/* What is held while another element slips alone. */
static inline void put_threshold_real(stance_events_real *events, const stance_chain_real *chain) {
    const int alone = alone_of_mode_real(chain->mode);
    if (alone >= 0) { add_thresholds_real(chain, 1 - alone, !is_monotone_real(chain->mode), &events->set); }
}

/* The event functions of a phase: of each guard that the model has. */
static inline void put_events_real(stance_events_real *events, const stance_chain_real *chain) {
    events->set.poles = poles_of_real(chain->plan, chain->mode);
    events->set.node = node_of_real(chain->plan, chain->mode);
    events->set.count = 0;
    events->rest_time = HOPFORM_NEVER_real;
    events->rests = NO_OWNER_real;
#define PUT_GUARD(kind) put_##kind##_real(events, chain);
    HOPFORM_GUARDS(PUT_GUARD)
#undef PUT_GUARD
}

#if HOPFORM_HAS_CONTACT
/* True late in a phase, when the steady-state form of the contact force is the more accurate one. */
static inline bool is_late_real(const basis_real *basis) {
    return fabs_real(basis->Wdd) < 0.25;
}

/* Correction to the time t of a take-off late in a phase, from the steady-state form of the contact force; 0 when it is
 * no more accurate. */
SELDOM_real real later_takeoff_real(const stance_chain_real *chain, const hopform_poles_real *poles,
                                    const event_function_real *contact, const basis_real *basis, real t) {
    if (!is_late_real(basis)) { return 0.0; }
    state_by_axis_real steady = {{0.0, 0.0, 0.0, 0.0}};
    numerators_by_axis_real from_slack;
    from_slack.named = motion_of_real(chain->plan, &steady.named, current_of_chain_real(chain), chain->mode);
    steady.of[HOPFORM_STRETCH_AXIS] = settled_real(poles, &from_slack.of.stretch);
    const real settled = contact_of_real(&chain->plan->robot, &steady.named);
    return steady_state_correction_real(poles, contact, settled, basis, t);
}
#endif

/* A root late in a phase, which was found: the interval ends at its time with all its digits. True if that is
 * later, so that something else may come first. */
static inline bool sharpen_root_real(const stance_chain_real *chain, stance_search_real *search) {
#if HOPFORM_HAS_CONTACT
    const event_set_real *set = &search->events.set;
    interval_real *in = &search->in;
    const real before = in->high.t;
    if (in->found != 0 || set->function[0].owner != CONTACT_real) { return false; }
    for (int n = 0; n < 4 && !is_modal_real(&in->high); n++) {
        const basis_real basis = basis_of_propagator_real(set->poles, &in->high);
        const real later = later_takeoff_real(chain, set->poles, &set->function[0], &basis, in->high.t);
        if (!(fabs_real(later) > 0.0) || in->high.t + later > search->limit) { break; }
        end_interval_at_real(set, in, in->high.t + later);
        in->found = 0;
    }
    return in->high.t > before;
#else
    (void)chain;
    (void)search;
    return false;
#endif
}

/* Continue in the modal form from where W loses its digits: beside a stiff pole every velocity behind the transient is
 * a small difference of large terms of W. A distance to a stop counts from where the phase begins. */
SELDOM_real void enter_modes_real(stance_chain_real *chain, stance_search_real *search) {
    event_set_real *set = &search->events.set;
    motion_modes_real *modes = &chain->modes;
    *modes = modes_of_motion_real(set->poles, set->node->omega, &chain->at.named, &chain->numerators.named);
    search->in.high = modes_at_real(set->poles, set->node->omega, search->in.high.t);
    for (int32_t n = 0; n < set->count; n++) {
        event_function_real *g = &set->function[n];
        const int element = g->owner - ELEMENT_real;
#if HOPFORM_HAS_CONTACT
        if (element < 0) {
            const numerator_real by = contact_numerator_real(&chain->plan->robot, &modes->by.named);
            take_modes_real(g, &by, contact_of_real(&chain->plan->robot, &modes->final.named), 0.0, 1.0);
            continue;
        }
#endif
        if (g->touch_is_no_event) {
            const real gap = side_of_mode_real(chain->mode, element) > 0 ? chain->from_upper : chain->from_lower;
            take_modes_real(g, &modes->by.of.position, gap + modes->final.of[HOPFORM_POSITION_AXIS], modes->drift,
                            -(real)side_of_mode_real(chain->mode, element));
        } else {
            take_modes_real(g, &modes->by.of.velocity[element], modes->final.of[HOPFORM_VELOCITY_AXIS(element)], 0.0,
                            (real)side_of_mode_real(chain->mode, element));
        }
    }
}

#if HOPFORM_HAS_MODAL
/* ---- both slip, in modal coordinates ---- */

/* Whether the phase is solved so: not where someone follows it by its propagator. */
static inline bool is_solved_in_modes_real(const stance_chain_real *chain) {
    return alone_of_mode_real(chain->mode) < 0 && !rests_of_mode_real(chain->mode) && chain->plan->modal.h > 0.0
           && chain->observer == NULL;
}

/* The axis of each event function of the search. */
static const int axis_of_function_real[MODAL_FUNCTIONS_real] = {HOPFORM_STRETCH_AXIS, HOPFORM_VELOCITY_AXIS(0),
                                                                HOPFORM_VELOCITY_AXIS(1)};

/* The search at the start of the phase. Rates and deflated derivatives are those of the numerators, which know what an
 * element that has just switched, or come to rest, begins with. */
static inline void begin_modal_search_real(const stance_chain_real *chain, modal_search_real *search) {
    const hopform_modal_real *modal = &chain->plan->modal;
    const numerator_real *core = chain->numerators.core;
    const real rate[MODAL_FUNCTIONS_real] = {core[HOPFORM_STRETCH_AXIS - 1].H3, core[HOPFORM_VELOCITY_AXIS(0) - 1].H3,
                                             core[HOPFORM_VELOCITY_AXIS(1) - 1].H3};
    modal_node_real *low = &search->node[0];
    real m[3];
    for (int n = 0; n < 3; n++) {
        const hopform_modal_share_real *share = &modal->share[n];
        m[n] = share->of_y * rate[0] + share->of_1 * rate[1] + share->of_2 * rate[2];
    }
    search->modal = modal;
    search->low = low;
    search->high = &search->node[1];
    search->limit = end_of_step_real(chain) - chain->t;
    search->first = 1;
    search->from_the_end = false;
#if HOPFORM_HAS_CONTACT
    if (falls_of_mode_real(chain->mode) || chain->at.of[HOPFORM_STRETCH_AXIS] < 0.0) { search->first = 0; }
#endif
    search->sign[0] = 1.0;
    search->sign[1] = (real)side_of_mode_real(chain->mode, 0);
    search->sign[2] = (real)side_of_mode_real(chain->mode, 1);
    low->t = 0.0;
    low->m.f = m[0];
    low->m.c = m[1];
    low->m.s = m[2];
    for (int n = 0; n < MODAL_FUNCTIONS_real; n++) {
        const int axis = axis_of_function_real[n];
        const numerator_real *h = &core[axis - 1];
        const real z = chain->at.of[axis];
        search->z[n] = z;
        search->rounded[n] = fabs_real(z);
        low->value[n] = greater_real(search->sign[n] * z, 0.0);
        low->rate[n] = search->sign[n] * h->H3;
        low->deflated[n] = search->sign[n] * (h->H2 - 2.0 * modal->mean * h->H3);
    }
    search->from = 0.0;
    search->m = low->m;
    search->amplitude = amplitude_of_real(&low->m);
    search->total = no_gain_real(&low->m);
    search->gained = search->total;
    search->moved = 0.0;
    search->count = 0;
    search->evaluations = chain->evaluations;
    use_evaluation_real(search->evaluations); /* a phase costs as much */
}

/* How far it is to the stop ahead; NEVER without one. */
static inline real gap_ahead_real(const stance_chain_real *chain) {
    const real gap =
        side_of_mode_real(chain->mode, HOPFORM_STOPPED_ELEMENT) > 0 ? -chain->from_upper : chain->from_lower;
    return HOPFORM_HAS_STOPS && is_finite_real(gap) ? gap : HOPFORM_NEVER_real;
}

/* When the position, which only goes to its side until a time, has met the stop ahead, and what is gained by then; how
 * far it is from there then, and its rate and curvature. */
SELDOM_real modal_root_real modal_stop_real(const stance_chain_real *chain, const modal_real *m, real until,
                                            const jet_real *then) {
    const hopform_modal_real *modal = &chain->plan->modal;
    const int element = HOPFORM_STOPPED_ELEMENT;
    const hopform_modal_row_real *row = &modal->row[1 + element];
    const real side = (real)side_of_mode_real(chain->mode, element);
    const real velocity = chain->at.of[HOPFORM_VELOCITY_AXIS(element)];
    const real gap = gap_ahead_real(chain);
    const numerator_real *h = &chain->numerators.of.velocity[element];
    const jet_real from = {gap, -side * velocity, -side * h->H3,
                           -side * (h->H2 - rates_of_chain_real(chain)->s_1 * h->H3)};
    const interpolant_real p = interpolant_of_real(&from, then, until);
    modal_root_real root = {until * refined_root_real(&p, rough_root_real(&from, then, until)), no_gain_real(m)};
    real low = 0.0, high = until;
    for (int step = 0; step < 100; step++) {
        if (!(root.t > low && root.t < high) || (step > 8 && step % 2 == 1)) { root.t = low + 0.5 * (high - low); }
        const bool ends = !(root.t > low && root.t < high);
        root.t = ends ? high : root.t;
        root.gain = gain_over_real(modal, m, root.t);
        const modal_real at = modal_after_real(modal, m, &root.gain);
        const real left = gap - side * displacement_real(modal, row, velocity, m, root.t, &root.gain);
        const real speed = side * (velocity + gain_by_row_real(row, &root.gain));
        use_evaluation_real(chain->evaluations);
        MODAL_COUNT(evaluation);
        if (ends || fabs_real(left) <= HOPFORM_EPS_real * root.t * speed) { break; }
        low = left > 0.0 ? root.t : low;
        high = left > 0.0 ? high : root.t;
        const real below = 2.0 * speed * speed + left * (side * rate_by_row_real(row, &at));
        root.t = speed > 0.0 && below > 0.0 ? root.t + 2.0 * left * speed / below : low; /* Halley's */
    }
    return root;
}

/* Where the phase ends at a time, after a gain since the interval began, which may be the first of the phase, at some
 * coordinates. */
static inline void arrive_in_modes_real(const modal_search_real *search, const modal_gain_real *gain, real t,
                                        const modal_real *m, modal_arrival_real *arrival) {
    const modal_gain_real sum = gain_and_real(&search->total, gain);
    const modal_gain_real *total = &sum;
    const bool first = !(search->low->t > 0.0);
    const hopform_modal_real *modal = search->modal;
    const hopform_modal_row_real *row = &modal->row[1 + HOPFORM_STOPPED_ELEMENT];
    arrival->is_modal = true;
    for (int n = 0; n < MODAL_FUNCTIONS_real; n++) {
        const real known = first ? search->sign[n] * known_beside_real(search, n) * t : 0.0;
        real rest;
        arrival->z[axis_of_function_real[n]] =
            search->from_the_end ? search->sign[n] * value_from_the_end_real(search, n, search->low, gain, &rest)
                                 : search->z[n] + (gain_by_row_real(&modal->row[n], total) + known);
    }
    arrival->moved =
        search->moved
        + displacement_real(modal, row, search->z[1 + HOPFORM_STOPPED_ELEMENT], &search->m, t - search->from, total);
    arrival->rate[0] = row->rate_fade * m->f;
    arrival->rate[1] = row->rate_cosine * m->c;
    arrival->rate[2] = row->rate_sine * m->s;
    arrival->stretched = search->rounded[0] + fabs_real(modal->row[0].rate_fade * total->f)
                         + 2.0 * modal->row[0].amplitude * search->amplitude / modal->root_q;
}

/* The stop ahead in place of what was found at a time, or nothing, if it is met before. */
static inline void meet_stop_real(const stance_chain_real *chain, const modal_search_real *search, real t,
                                  stance_search_real *end) {
    const int element = HOPFORM_STOPPED_ELEMENT;
    const real side = (real)side_of_mode_real(chain->mode, element);
    const real gap = gap_ahead_real(chain);
    modal_arrival_real *arrival = &end->arrival;
    const real speed = side * arrival->z[HOPFORM_VELOCITY_AXIS(element)];
    const real left = gap - side * arrival->moved;
    const hopform_modal_row_real *row = &search->modal->row[1 + element];
    const real reach = lesser_real(1.0 / search->modal->root_q, t); /* for so long at most */
    const real swing = (row->amplitude * search->amplitude + fabs_real(row->rate_fade * search->m.f)) * reach * reach;
    const real rounding = 16.0 * HOPFORM_EPS_real * (gap + fabs_real(arrival->moved) + swing + t * fabs_real(speed));
    bool meets = left < -rounding;
    if (!meets && end->owner == ELEMENT_real + 1 - element && speed * t > 16.0 * rounding) {
        const real rate = fabs_real(chain->numerators.of.velocity[1 - element].H3); /* of the one that comes to rest */
        const real other = 16.0 * HOPFORM_EPS_real * (search->rounded[2 - element] + t * rate);
        meets = (left - 4.0 * rounding) * rate < speed * other && !(left > 0.0);
    }
    if (!meets) {
        end->touches = end->owner == ELEMENT_real + element && fabs_real(left) <= rounding;
        return;
    }
    modal_search_real start; /* values are counted from the start of the phase again */
    begin_modal_search_real(chain, &start);
    const jet_real then = {left, -speed, -side * (arrival->rate[0] + arrival->rate[1] + arrival->rate[2]), 0.0};
    const modal_root_real root = modal_stop_real(chain, &start.m, t, &then);
    const modal_real m = modal_at_real(search->modal, &start.m, root.t);
    arrive_in_modes_real(&start, &root.gain, root.t, &m, arrival);
    end->in.high.t = root.t;
    end->owner = ELEMENT_real + element;
    end->stops = true;
    end->certified = true;
#if HOPFORM_HAS_CONTACT
    const real value = arrival->z[HOPFORM_STRETCH_AXIS];
    const real rate = arrival->z[HOPFORM_VELOCITY_AXIS(0)] - arrival->z[HOPFORM_VELOCITY_AXIS(1)];
    const real bound = modal_rounding_real(&start, 0, &root.gain, root.t, rate);
    if (start.first == 0 && rate * root.t < -16.0 * bound
        && value < 8.0 * HOPFORM_EPS_real * root.t * fabs_real(rate)) {
        end->owner = CONTACT_real;
        end->stops = false;
    }
#endif
}

/* What goes on from an interval in which nothing has happened, once in a while: values are counted from where they end,
 * or what is quiet is passed at once. */
SELDOM_real void pass_quiet_time_real(const stance_chain_real *chain, modal_search_real *search) {
    const hopform_modal_real *modal = search->modal;
    if (rates_of_chain_real(chain)->s_3 > 0.0 && chain->came_to_rest < 0) {
        const equilibrium_real settled = settled_of_both_real(rates_of_chain_real(chain), &chain->drive.named);
        count_from_the_end_real(search, &settled);
    }
    const real quiet = modal_quiet_time_real(search);
    const real left = search->limit - search->low->t;
    if (quiet > 8.0 * modal->h) {
        const real t = lesser_real(quiet, left);
        const modal_gain_real gain = gain_over_real(modal, &search->low->m, t);
        use_evaluation_real(search->evaluations);
        MODAL_COUNT(quiet);
        const modal_real m = modal_at_real(modal, &search->low->m, t);
        end_modal_interval_real(search, t < left ? search->low->t + t : search->limit, &gain);
        search->high->m = m;
        for (int n = search->first; n < MODAL_FUNCTIONS_real; n++) {
            put_rates_real(search, n, search->high);
        }
        begin_modal_interval_real(search);
    }
}

/* The first event of the phase. */
static inline void find_end_in_modes_real(const stance_chain_real *chain, stance_search_real *end) {
    const hopform_modal_real *modal = &chain->plan->modal;
    modal_search_real search;
    begin_modal_search_real(chain, &search);
    modal_root_real root = {0.0, no_gain_real(&search.low->m)};
    int found = -1;
    bool certified = true;
#if HOPFORM_HAS_CONTACT
    if (search.first == 0 && search.z[0] < 0.0 && !(first_derivative_real(&chain->numerators.of.stretch) > 0.0)) {
        found = CONTACT_real;
    }
#endif
    int32_t nodes = fades_in_a_node_real(modal) ? 7 : 0;
    for (bool open = found < 0 && search.limit > 0.0; open; nodes++) {
        const real left = search.limit - search.low->t;
        const bool fades = fades_in_a_node_real(modal) && !(search.low->t > 0.0); /* for as long as that does not */
        const real length = fades ? 1.0 / modal->a : modal->h;
        const bool last = !(length < left);
        const modal_gain_real gain = last || fades ? gain_over_a_node_real(modal, &search.low->m, last ? left : length)
                                                   : gain_of_node_real(modal, &search.low->m);
        MODAL_COUNT(node);
        end_modal_interval_real(&search, last ? search.limit : search.low->t + length, &gain);
        search.count++;
        const uint32_t crossed = all_stay_above_real(&search) ? 0 : certify_modal_interval_real(&search);
        certified = search.count <= HOPFORM_MOST_INTERVALS && search.evaluations->left > 0;
        if (!certified) { break; }
        if (crossed != 0) {
            found = first_modal_root_real(&search, crossed, &root);
            break;
        }
        begin_modal_interval_real(&search);
        if (search.low->t < search.limit && (nodes & 7) == 7) { pass_quiet_time_real(chain, &search); }
        open = search.low->t < search.limit;
    }
#if HOPFORM_HAS_CONTACT
    if (found < 0 && certified && search.first == 0 && search.limit > 0.0) { /* over a step of the input */
        const modal_gain_real none = no_gain_real(&search.low->m);
        const real rounding = modal_rounding_real(&search, 0, &none, search.limit, search.low->rate[0]);
        if (search.low->value[0] < -8.0 * HOPFORM_EPS_real * search.limit * search.low->rate[0]
            && search.low->rate[0] * search.limit < -16.0 * rounding) {
            found = CONTACT_real;
        }
    }
#endif
    if (found < 0) { root.gain = no_gain_real(&search.low->m); }
    const real t = search.low->t + root.t;
    end->in.high.t = t;
    end->owner = found;
    end->side = 0;
    end->stops = false;
    end->touches = false;
    end->certified = certified;
    const modal_real m = modal_after_real(modal, &search.low->m, &root.gain);
    arrive_in_modes_real(&search, &root.gain, t, &m, &end->arrival);
    if (gap_ahead_real(chain) < HOPFORM_NEVER_real) { meet_stop_real(chain, &search, t, end); }
}
#endif

#if HOPFORM_HAS_ALONE
/* ---- one slips alone, in its own coordinate: how far it has gone to its side ---- */

/* Whether the phase is solved so: not where someone follows it by its propagator. */
static inline bool is_solved_alone_real(const stance_chain_real *chain) {
    return alone_of_mode_real(chain->mode) >= 0 && !rests_of_mode_real(chain->mode) && chain->observer == NULL
           && !(chain->at.of[HOPFORM_STRETCH_AXIS] < 0.0 && HOPFORM_HAS_CONTACT);
}

/* How far the stretch goes with it. */
static inline real stretch_by_displacement_real(const stance_chain_real *chain, int alone) {
    return (real)(side_of_mode_real(chain->mode, alone) * HOPFORM_STRETCH_FOLLOWS(rates_of_chain_real(chain), alone));
}

#if HOPFORM_HAS_CONTACT
static inline void put_alone_contact_real(alone_search_real *search, const stance_chain_real *chain, int alone) {
    const real stretch = chain->at.of[HOPFORM_STRETCH_AXIS];
    const real follows = stretch_by_displacement_real(chain, alone);
    if (!(fabs_real(chain->drive.of[alone]) > 0.0)) {
        search->rest_time = time_to_rest_real(search->pair.poles, stretch, chain->numerators.of.stretch.H3);
        search->rests = CONTACT_real;
    } else if (follows < 0.0) {
        (void)add_alone_guard_real(search, stretch / -follows, CONTACT_real);
    }
}
#endif

static inline void put_alone_stop_real(alone_search_real *search, const stance_chain_real *chain, int alone) {
    const real gap = side_of_mode_real(chain->mode, alone) > 0 ? -chain->from_upper : chain->from_lower;
    if (alone == HOPFORM_STOPPED_ELEMENT && is_finite_real(gap)) {
        add_alone_guard_real(search, gap, ELEMENT_real + alone)->stops = true;
    }
}

/* Its own coordinate: the time to rest is found where it is asked for. What draws it is what the numerator of the
 * stretch has: v' + p v is a small difference beside a large p. */
static inline void put_alone_velocity_real(alone_search_real *search, const stance_chain_real *chain, int alone) {
    const real side = (real)side_of_mode_real(chain->mode, alone);
    const real draw =
        chain->numerators.of.stretch.H2 / (real)HOPFORM_STRETCH_FOLLOWS(rates_of_chain_real(chain), alone);
    const alone_real start = {0.0, 0.0, greater_real(side * chain->at.of[HOPFORM_VELOCITY_AXIS(alone)], 0.0),
                              side * draw};
    search->start = start;
}

/* The threshold to which the free acceleration of what is held goes. */
static inline void put_alone_threshold_real(alone_search_real *search, const stance_chain_real *chain, int alone) {
    const int held = 1 - alone;
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

/* The first event of the phase. */
static inline void find_end_alone_real(const stance_chain_real *chain, real until, stance_search_real *end) {
    const int alone = alone_of_mode_real(chain->mode);
    alone_search_real search;
    search.half_period = node_of_real(chain->plan, chain->mode)->half_period;
    search.pair = alone_pair_of_real(poles_of_real(chain->plan, chain->mode), search.half_period < HOPFORM_NEVER_real);
    search.element = alone;
    search.count = 0;
    search.rest_time = HOPFORM_NEVER_real;
    search.rests = NO_OWNER_real;
#define PUT_GUARD(kind) put_alone_##kind##_real(&search, chain, alone);
    HOPFORM_GUARDS(PUT_GUARD)
#undef PUT_GUARD
    find_alone_event_real(&search, until, chain->evaluations);
    end->alone = search.end;
    end->in.high.t = search.end.t;
    end->owner = search.owner;
    end->side = search.side;
    end->stops = search.stops;
    end->touches = search.touches;
    end->certified = search.certified;
}
#endif

/* The first event of the phase that starts at the chain's state. */
static inline void stance_find_end_real(stance_chain_real *chain, stance_search_real *search) {
    const real until = end_of_step_real(chain) - chain->t;
#if HOPFORM_HAS_MODAL
    search->arrival.is_modal = is_solved_in_modes_real(chain);
#endif
#if HOPFORM_HAS_ALONE
    search->is_alone = is_solved_alone_real(chain);
    if (search->is_alone) {
        find_end_alone_real(chain, until, search);
        return;
    }
#endif
#if HOPFORM_HAS_MODAL
    if (search->arrival.is_modal) {
        find_end_in_modes_real(chain, search);
        return;
    }
#endif
    if (rests_of_mode_real(chain->mode)) {
        search_rest_real(search, &chain->plan->poles[0], until);
        return;
    }
    put_events_real(&search->events, chain);
    bool open = begin_search_real(search, until, chain->evaluations);
    bool quiet = false;
    bool is_sharp = false; /* the root in the interval: once */
    while (open) {
        open = search_interval_real(search, quiet);
        if (open) {
            const bool enters = !HOPFORM_MOVES_ALONE && search->in.high.t >= search->events.set.node->modal;
            if (enters && !is_modal_real(&search->in.high)) { enter_modes_real(chain, search); }
            quiet = next_interval_real(search);
            is_sharp = false;
        } else {
            is_sharp = !is_sharp && search->certified && sharpen_root_real(chain, search);
            open = is_sharp;
        }
    }
    conclude_real(search);
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

/* The magnitudes that the stretch is a sum of at the end of a phase. */
static inline real terms_of_stretch_real(const stance_chain_real *chain, const basis_real *basis) {
    const numerator_real *h = &chain->numerators.of.stretch;
    return fabs_real(chain->at.of[HOPFORM_STRETCH_AXIS]) + fabs_real(h->H3 * basis->Wd) + fabs_real(h->H2 * basis->W)
           + fabs_real(h->H1 * basis->W1);
}

/* The element with stops, without any friction, stops while the forces on it cancel to all digits of the state: what is
 * left of them is its acceleration before, known from the motion where that has faded. `terms` are those of that
 * acceleration, `stretched` the magnitudes that the stretch is a sum of. */
SELDOM_real void keep_small_acceleration_real(stance_chain_real *chain, const real terms[3], real stretched) {
    const int element = HOPFORM_STOPPED_ELEMENT;
    const hopform_rates_real *rates = rates_of_chain_real(chain);
    const hopform_robot_real *robot = &chain->plan->robot;
    const real friction = level_at_rest_real(robot, element, 1) + level_at_rest_real(robot, element, -1);
    if (friction > 0.0 || fabs_real(rates->a1_v1) > 0.0) { return; }
    const free_by_element_real at_rest = free_of_real(chain, &chain->at.named);
    const real by_spring = fabs_real(rates->a1_y * stretched);
    if (!(fabs_real(at_rest.of[element]) < 64.0 * HOPFORM_EPS_real * by_spring)) { return; }
    const real rate = terms[0] + terms[1] + terms[2];
    if (fabs_real(decided_real(rate, fabs_real(terms[0]) + fabs_real(terms[1]) + fabs_real(terms[2]))) > 0.0) {
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
#if HOPFORM_HAS_MODAL
    if (end->arrival.is_modal) {
        if (element == HOPFORM_STOPPED_ELEMENT) {
            keep_small_acceleration_real(chain, end->arrival.rate, end->arrival.stretched);
        }
        return;
    }
#endif
    const bool alone = alone_of_mode_real(chain->mode) == element;
    const bool at_stop = end->stops || end->touches;
#if HOPFORM_HAS_ALONE
    if (end->is_alone) {
        if (at_stop) {
            const real moved = stretch_by_displacement_real(chain, element) * end->alone.s;
            const real stretched =
                chain->most_stretched + fabs_real(chain->at.of[HOPFORM_STRETCH_AXIS]) + fabs_real(moved);
            chain->rounded_at_stop = fabs_real(rates_of_chain_real(chain)->a1_y * stretched);
        } else {
            chain->came_to_rest = element;
            chain->carried_acceleration =
                free_after_rest_real((real)side_of_mode_real(chain->mode, element),
                                     level_of_real(&chain->plan->robot, element), fabs_real(end->alone.draw));
        }
        return;
    }
#endif
    const basis_real basis = basis_of_propagator_real(end->events.set.poles, &end->in.high);
    if (alone && at_stop) { /* beside another one that moves no equilibrium lasts */
        const real stretched = chain->most_stretched + terms_of_stretch_real(chain, &basis);
        chain->rounded_at_stop = fabs_real(rates_of_chain_real(chain)->a1_y * stretched);
    }
    if (alone && !at_stop) {
        chain->came_to_rest = element;
        chain->carried_acceleration = free_after_motion_real((real)side_of_mode_real(chain->mode, element),
                                                             level_of_real(&chain->plan->robot, element),
                                                             &chain->numerators.of.velocity[element], &basis);
    } else if (element == HOPFORM_STOPPED_ELEMENT && !alone) {
        const numerator_real *h = &chain->numerators.of.velocity[element];
        const real terms[] = {h->H3 * basis.Wdd, h->H2 * basis.Wd, h->H1 * basis.W};
        keep_small_acceleration_real(chain, terms, terms_of_stretch_real(chain, &basis));
    }
}

/* The state at the end of a phase, and how far from its stops the position is there; what is held stays exactly where
 * it is. */
static inline void stance_arrive_real(stance_chain_real *chain, const stance_search_real *end) {
    real *position = &chain->at.of[HOPFORM_POSITION_AXIS];
    const real before = *position;
    chain->most_stretched = greater_real(chain->most_stretched, fabs_real(chain->at.of[HOPFORM_STRETCH_AXIS]));
    *position = 0.0;
#if HOPFORM_HAS_ALONE
    if (end->is_alone) {
        const int alone = alone_of_mode_real(chain->mode);
        const real side = (real)side_of_mode_real(chain->mode, alone);
        chain->at.of[HOPFORM_VELOCITY_AXIS(alone)] = side * end->alone.v;
        chain->at.of[HOPFORM_STRETCH_AXIS] += stretch_by_displacement_real(chain, alone) * end->alone.s;
        *position = alone == HOPFORM_STOPPED_ELEMENT ? side * end->alone.s : 0.0;
    } else
#endif
#if HOPFORM_HAS_MODAL
        if (end->arrival.is_modal) {
        for (int axis = 1; axis < HOPFORM_AXES; axis++) {
            chain->at.of[axis] = end->arrival.z[axis];
        }
        *position = end->arrival.moved;
    } else
#endif
    {
        chain->at.named =
            arrive_at_real(&chain->at.named, &chain->numerators.named, &chain->modes, &end->in.high, chain->mode);
    }
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

/* Put the constant acceleration of an element that starts on its threshold so that its acceleration there is exactly
 * that of the excess, and what follows from it, too: rounding would let it go back at once. */
static inline void start_on_threshold_real(stance_chain_real *chain) {
    const int element = chain->just_switched;
    if (element < 0 || !several_of_mode_real(chain->mode)) { return; }
    real *drive = &chain->drive.of[element];
    *drive = 0.0;
    numerators_by_axis_real others;
    others.named = motion_under_real(rates_of_chain_real(chain), &chain->drive.named, &chain->at.named, chain->mode);
    *drive = acceleration_on_threshold_real(chain, element) - others.of.velocity[element].H3;
}

/* The drive and the numerators of the phase that begins at the chain's state. */
static inline void stance_begin_phase_real(stance_chain_real *chain) {
    const int element = chain->came_to_rest;
    chain->drive.named = drive_in_mode_real(chain->plan, chain->mode, current_of_chain_real(chain));
    start_on_threshold_real(chain);
    chain->numerators.named =
        motion_under_real(rates_of_chain_real(chain), &chain->drive.named, &chain->at.named, chain->mode);
    const int starts = chain->just_switched;
    if (starts >= 0 && several_of_mode_real(chain->mode)) {
        const real acceleration = acceleration_on_threshold_real(chain, starts);
        if (fabs_real(acceleration) > 0.0) {
            set_acceleration_from_rest_real(&chain->numerators, rates_of_chain_real(chain), starts, false,
                                            acceleration);
        }
    }
    if (element >= 0 && side_of_mode_real(chain->mode, element) != 0) {
        const real level = (real)side_of_mode_real(chain->mode, element) * level_of_real(&chain->plan->robot, element);
        set_acceleration_from_rest_real(&chain->numerators, rates_of_chain_real(chain), element,
                                        alone_of_mode_real(chain->mode) == element,
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
    int event = HOPFORM_EVENT_SLIPS(element);
    if (end->owner == NO_OWNER_real) {
        chain->step = chain->step + 1 < chain->step_count ? chain->step + 1 : chain->step;
        take_step_real(chain);
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

/* Pass the finished phase to the observer, if there is one. */
static inline void notify_real(const stance_chain_real *chain, const state_by_axis_real *start,
                               const propagator_real *end, bool leaves) {
    if (chain->observer != NULL) {
        const solved_phase_real phase = {&chain->numerators, end,         &chain->modes, start,
                                         &chain->at,         chain->mode, chain->event,  leaves};
        chain->observer(chain->variation, &phase);
    }
}

/* The same of a last phase of no duration. */
static inline void notify_ending_real(stance_chain_real *chain) {
    if (chain->observer != NULL) {
        const propagator_real now = propagator_at_start_real(&chain->plan->poles[0]);
        stance_begin_phase_real(chain);
        notify_real(chain, &chain->at, &now, false);
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
    const real length = end->in.high.t;
#if HOPFORM_HAS_CONTACT
    chain->aed += chain->adds_up ? aed_in_phase_real(chain, length) : 0.0;
#endif
    stance_arrive_real(chain, end);
    notify_real(chain, &start, &end->in.high, end->owner == CONTACT_real);
    chain->t = passes ? until : lesser_real(chain->t + length, until); /* not behind it by rounding */
#if HOPFORM_HAS_CONTACT
    if (end->owner == CONTACT_real) {
        real *stretch = &chain->at.of[HOPFORM_STRETCH_AXIS]; /* of an extending leg that carries nothing */
        *stretch = HOPFORM_CONTACT_IS_STRETCH || *stretch < 0.0 ? 0.0 : *stretch;
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
    for (int axis = 0; axis < HOPFORM_AXES; axis++) {
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
