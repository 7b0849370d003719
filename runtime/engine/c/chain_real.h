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
    int side[HOPFORM_ELEMENTS]; /* with a law the second one is its limit */
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

/* The limit that the input of a law is at, 0 under it: the second side. */
static inline int limit_of_chain_real(const stance_chain_real *chain) {
    return HOPFORM_HAS_LAW ? chain->side[HOPFORM_ELEMENTS - 1] : 0;
}

static inline real current_of_chain_real(const stance_chain_real *chain) {
    return input_of_mode_real(chain->plan, limit_of_chain_real(chain), chain->steps[chain->step].u);
}

static inline const hopform_rates_real *rates_of_chain_real(const stance_chain_real *chain) {
    return rates_of_mode_real(chain->plan, limit_of_chain_real(chain));
}

/* ---- the hold rule ---- */

/* Numerator of the free acceleration of an element that is held. */
static inline numerator_real free_numerator_real(const hopform_rates_real *rates, int element,
                                                 const numerators_real *numerators) {
    return element == 0 ? free_numerator_1_real(rates, numerators) : free_numerator_2_real(rates, numerators);
}

/* What the elements do, by their sides; one that never moves rests. */
static inline bool both_slip_real(const int *side) {
    return !HOPFORM_MOVES_ALONE && side[0] != 0 && side[1] != 0;
}

static inline bool all_rest_real(const int *side) {
    return side[0] == 0 && (HOPFORM_MOVES_ALONE || side[1] == 0);
}

static inline bool other_rests_real(const int *side, int element) {
    return HOPFORM_MOVES_ALONE || side[1 - element] == 0;
}

/* Whether a stop, or that it never moves, keeps an element at rest from going to a side. */
static inline bool stance_blocked_real(const stance_chain_real *chain, int element, int side) {
    const hopform_robot_real *robot = &chain->plan->robot;
    if (HOPFORM_NEVER_MOVES(element)) { return true; }
    if (!HOPFORM_HAS_STOPS || element != HOPFORM_STOPPED_ELEMENT) { return false; }
    const bool locked = !(lower_stop_real(robot) < upper_stop_real(robot));
    return locked || (side < 0 && chain->from_lower <= 0.0) || (side > 0 && chain->from_upper >= 0.0);
}

/* The constant accelerations, and the numerators from the chain's state, with given sides. */
static inline drive_by_element_real drive_of_chain_real(const stance_chain_real *chain, const int *side) {
    drive_by_element_real drive;
    drive.named = drive_of_real(&chain->plan->robot, rates_of_chain_real(chain), current_of_chain_real(chain),
                                (real)side[0], (real)side[1]);
    return drive;
}

static inline numerators_by_axis_real numerators_of_chain_real(const stance_chain_real *chain, const int *side) {
    const drive_by_element_real drive = drive_of_chain_real(chain, side);
    numerators_by_axis_real made;
    made.named = motion_under_real(rates_of_chain_real(chain), &drive.named, &chain->at.named, side[0], side[1]);
    return made;
}

/* First non-zero derivative of the free acceleration of an element that is held. */
static inline real drift_of_free_real(const stance_chain_real *chain, int element) {
    const int side[] = {element == 0 ? 0 : chain->side[0], element == 1 ? 0 : chain->side[1]};
    const numerators_by_axis_real numerators = numerators_of_chain_real(chain, side);
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

/* ---- the limit of a law ---- */

/* The magnitudes that the room of the pull is a difference of: they are large where the law is stiff. */
static inline real terms_of_room_real(const stance_chain_real *chain, real largest) {
    return terms_of_pull_real(&chain->plan->robot, &chain->at.named, chain->steps[chain->step].u) + largest;
}

static inline real pull_of_chain_real(const stance_chain_real *chain) {
    return pull_of_law_real(&chain->plan->robot, &chain->at.named, chain->steps[chain->step].u);
}

/* How far the pull is beyond the limits, decided. */
static inline real beyond_limit_real(const stance_chain_real *chain, real pull) {
    const real largest = largest_pull_real(&chain->plan->robot);
    return is_finite_real(largest) ? decided_real(fabs_real(pull) - largest, terms_of_room_real(chain, largest)) : -1.0;
}

/* The limit that the current is at; on the limit 0. */
static inline void stance_choose_limit_real(stance_chain_real *chain) {
    if (!HOPFORM_HAS_LAW) { return; }
    const real pull = pull_of_chain_real(chain);
    chain->side[HOPFORM_ELEMENTS - 1] = beyond_limit_real(chain, pull) > 0.0 ? (int)goes_real(pull, 0.0) : 0;
}

/* Where the pull is on the limit its first non-zero derivative decides; the sides of the elements are known. */
static inline void stance_settle_limit_real(stance_chain_real *chain) {
    if (!HOPFORM_HAS_LAW || limit_of_chain_real(chain) != 0 || all_rest_real(chain->side)) { return; }
    const real pull = pull_of_chain_real(chain);
    if (beyond_limit_real(chain, pull) < 0.0) { return; }
    const numerators_by_axis_real numerators = numerators_of_chain_real(chain, chain->side);
    const numerator_real h = law_numerator_real(&chain->plan->robot, &chain->at.named, &numerators.named);
    const real leaves = goes_real(pull, 0.0) * first_derivative_real(&h);
    chain->side[HOPFORM_ELEMENTS - 1] = leaves > 0.0 ? (int)goes_real(pull, 0.0) : 0;
}

/* The room of the pull to its limits, or at a limit what it is beyond that. */
static inline void add_limits_real(const stance_chain_real *chain, event_set_real *set) {
    const real largest = largest_pull_real(&chain->plan->robot);
    if (!is_finite_real(largest)) { return; }
    const int limit = limit_of_chain_real(chain);
    const hopform_robot_real *robot = &chain->plan->robot;
    const real terms = terms_of_room_real(chain, largest);
    const real pull = pull_of_chain_real(chain);
    const numerator_real h = law_numerator_real(robot, &chain->at.named, &chain->numerators.named);
    for (int side = -1; side <= 1; side += 2) {
        if (limit != 0 && side != limit) { continue; }
        event_function_real *room = add_event_function_real(set, &h, pull - (real)side * largest,
                                                            (real)(limit == 0 ? -side : side), LIMIT_real, true);
        put_on_threshold_real(room, terms);
        room->side = limit == 0 ? side : 0;
    }
}

/* Sides of the elements that are at rest, a bit each; of several as often as there are, because each may depend on what
 * the others do. One that starts on its threshold has the acceleration of the excess there. */
static inline void stance_settle_real(stance_chain_real *chain, uint32_t resting) {
    const bool several = !HOPFORM_MOVES_ALONE && (resting & (resting - 1u)) != 0;
    for (int n = 0; n < (several ? HOPFORM_ELEMENTS : 1); n++) {
        for (int element = 0; element < HOPFORM_MOVING_ELEMENTS; element++) {
            if ((resting & 1u << (uint32_t)element) != 0) {
                const direction_real direction = direction_from_rest_real(chain, element);
                chain->side[element] = direction.side;
                if (direction.on_threshold && direction.side != 0) { chain->just_switched = element; }
            }
        }
    }
}

static inline uint32_t held_elements_real(const stance_chain_real *chain) {
    uint32_t held = 0;
    for (int element = 0; element < HOPFORM_MOVING_ELEMENTS; element++) {
        held |= chain->side[element] == 0 ? 1u << (uint32_t)element : 0u;
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

/* How far the position is from the stop ahead, if there is one. */
static inline void add_stop_real(const stance_chain_real *chain, event_set_real *set) {
    const int side = chain->side[HOPFORM_STOPPED_ELEMENT];
    const real gap = side > 0 ? -chain->from_upper : chain->from_lower;
    if (!HOPFORM_HAS_STOPS || side == 0 || !is_finite_real(gap)) { return; }
    const real away = -(real)side;
    const numerator_real *h = &chain->numerators.of.position;
    const numerator_real first = {chain->at.of[HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT)], h->H3, h->H2};
    event_function_real *stop =
        add_event_function_real(set, &first, away * gap, away, ELEMENT_real + HOPFORM_STOPPED_ELEMENT, false);
    stop->touch_is_no_event = true;
    stop->H0 = away * h->H1;
}

/* The event functions of a phase. Where one element slips alone and the forces on it cancel at no stretch, the stretch
 * of a contact rings about 0 as a velocity does: its first zero is known however far it has faded by then. */
static inline void put_events_real(stance_events_real *events, const stance_chain_real *chain) {
    const real *at = chain->at.of;
    const int *side = chain->side;
    event_set_real *set = &events->set;
    const hopform_poles_real *poles = poles_of_real(chain->plan, side[0], side[1]);
    const bool several = both_slip_real(side);
    const int slips = HOPFORM_MOVES_ALONE || side[0] != 0 ? 0 : 1;
    const bool is_monotone = !several && HOPFORM_CONTACT_IS_STRETCH && !HOPFORM_IS_COUPLED;
    set->poles = poles;
    set->node = node_of_real(chain->plan, side[0], side[1]);
    set->count = 0;
    events->rest_time = HOPFORM_NEVER_real;
    events->rests = NO_OWNER_real;
#if HOPFORM_HAS_CONTACT
    const real stretch = at[HOPFORM_STRETCH_AXIS];
    const bool rings =
        HOPFORM_CONTACT_IS_STRETCH && !several && !(stretch < 0.0) && !(fabs_real(chain->drive.of[slips]) > 0.0);
    const bool may_fall = HOPFORM_STRETCH_MAY_FALL(side) || stretch < 0.0; /* else it rises, from 0 on */
    if (!rings && (may_fall || !HOPFORM_CONTACT_IS_STRETCH)) {
        const numerator_real h = contact_numerator_real(&chain->plan->robot, &chain->numerators.named);
        event_function_real *contact = add_event_function_real(
            set, &h, contact_of_real(&chain->plan->robot, &chain->at.named), 1.0, CONTACT_real, !is_monotone);
        if (!HOPFORM_CONTACT_IS_STRETCH) { put_on_threshold_real(contact, terms_of_contact_real(chain)); }
    }
#endif
    add_stop_real(chain, set);
    if (HOPFORM_HAS_LAW) { add_limits_real(chain, set); }
    for (int element = 0; element < HOPFORM_MOVING_ELEMENTS && several; element++) {
        (void)add_event_function_real(set, &chain->numerators.of.velocity[element], at[HOPFORM_VELOCITY_AXIS(element)],
                                      (real)side[element], ELEMENT_real + element, true);
    }
    if (several) { return; }
    const real sign = (real)side[slips];
    if (!HOPFORM_MOVES_ALONE) { add_thresholds_real(chain, 1 - slips, !is_monotone, set); }
    events->rest_time = time_to_rest_real(poles, sign * at[HOPFORM_VELOCITY_AXIS(slips)],
                                          sign * chain->numerators.of.velocity[slips].H3);
    events->rests = ELEMENT_real + slips;
#if HOPFORM_HAS_CONTACT
    const real lift = rings ? time_to_rest_real(poles, stretch, chain->numerators.of.stretch.H3) : HOPFORM_NEVER_real;
    if (rings && lift <= events->rest_time) {
        events->rest_time = lift;
        events->rests = CONTACT_real;
    }
#endif
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
    from_slack.named =
        motion_of_real(chain->plan, &steady.named, current_of_chain_real(chain), chain->side[0], chain->side[1]);
    steady.of[HOPFORM_STRETCH_AXIS] = settled_real(poles, &from_slack.of.stretch);
    const real settled = contact_of_real(&chain->plan->robot, &steady.named);
    return steady_state_correction_real(poles, contact, settled, basis, t);
}
#endif

/* A take-off late in a phase, which was found: the interval ends at its time with all its digits. True if that is
 * later, so that something else may come first. */
static inline bool sharpen_takeoff_real(const stance_chain_real *chain, stance_search_real *search) {
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
            const real gap = chain->side[element] > 0 ? chain->from_upper : chain->from_lower;
            take_modes_real(g, &modes->by.of.position, gap + modes->final.of[HOPFORM_POSITION_AXIS], modes->drift,
                            -(real)chain->side[element]);
        } else {
            take_modes_real(g, &modes->by.of.velocity[element], modes->final.of[HOPFORM_VELOCITY_AXIS(element)], 0.0,
                            (real)chain->side[element]);
        }
    }
}

#if HOPFORM_HAS_MODAL
/* ---- both slip, in modal coordinates ---- */

/* Whether the phase is solved so: not where someone follows it by its propagator. */
static inline bool is_solved_in_modes_real(const stance_chain_real *chain) {
    return both_slip_real(chain->side) && chain->plan->modal.h > 0.0 && chain->observer == NULL;
}

/* The axis of each event function of the search. */
static const int axis_of_function_real[MODAL_FUNCTIONS_real] = {HOPFORM_STRETCH_AXIS, HOPFORM_VELOCITY_AXIS(0),
                                                                HOPFORM_VELOCITY_AXIS(1)};

/* The search at the start of the phase. Rates and deflated derivatives are those of the numerators, which know what an
 * element that has just switched, or come to rest, begins with. */
static inline void begin_modal_search_real(const stance_chain_real *chain, modal_search_real *search) {
    const hopform_modal_real *modal = &chain->plan->modal;
    const numerator_real *core = chain->numerators.core;
    const int *side = chain->side;
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
    if (HOPFORM_STRETCH_MAY_FALL(side) || chain->at.of[HOPFORM_STRETCH_AXIS] < 0.0) { search->first = 0; }
#endif
    search->sign[0] = 1.0;
    search->sign[1] = (real)side[0];
    search->sign[2] = (real)side[1];
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
    const real gap = chain->side[HOPFORM_STOPPED_ELEMENT] > 0 ? -chain->from_upper : chain->from_lower;
    return HOPFORM_HAS_STOPS && is_finite_real(gap) ? gap : HOPFORM_NEVER_real;
}

/* When the position, which only goes to its side until a time, has met the stop ahead, and what is gained by then; how
 * far it is from there then, and its rate and curvature. */
SELDOM_real modal_root_real modal_stop_real(const stance_chain_real *chain, const modal_real *m, real until,
                                            const jet_real *then) {
    const hopform_modal_real *modal = &chain->plan->modal;
    const int element = HOPFORM_STOPPED_ELEMENT;
    const hopform_modal_row_real *row = &modal->row[1 + element];
    const real side = (real)chain->side[element];
    const real velocity = chain->at.of[HOPFORM_VELOCITY_AXIS(element)];
    const real gap = gap_ahead_real(chain);
    const numerator_real *h = &chain->numerators.of.velocity[element];
    const jet_real from = {gap, -side * velocity, -side * h->H3, -side * (h->H2 - chain->plan->rates.s_1 * h->H3)};
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
    const real side = (real)chain->side[element];
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
    if (chain->plan->rates.s_3 > 0.0 && chain->came_to_rest < 0) {
        const equilibrium_real settled = settled_of_both_real(&chain->plan->rates, &chain->drive.named);
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

/* The first event of the phase that starts at the chain's state. */
static inline void stance_find_end_real(stance_chain_real *chain, stance_search_real *search) {
    const real until = end_of_step_real(chain) - chain->t;
#if HOPFORM_HAS_MODAL
    search->arrival.is_modal = is_solved_in_modes_real(chain);
    if (search->arrival.is_modal) {
        find_end_in_modes_real(chain, search);
        return;
    }
#endif
    if (all_rest_real(chain->side)) {
        search_rest_real(search, any_poles_real(chain->plan), until);
        return;
    }
    put_events_real(&search->events, chain);
    bool open = begin_search_real(search, until, chain->evaluations);
    bool quiet = false;
    bool is_sharp = false; /* the take-off in the interval: once */
    while (open) {
        open = search_interval_real(search, quiet);
        if (open) {
            const bool enters = !HOPFORM_MOVES_ALONE && search->in.high.t >= search->events.set.node->modal;
            if (enters && !is_modal_real(&search->in.high)) { enter_modes_real(chain, search); }
            quiet = next_interval_real(search);
            is_sharp = false;
        } else {
            is_sharp = !is_sharp && search->certified && sharpen_takeoff_real(chain, search);
            open = is_sharp;
        }
    }
    conclude_real(search);
}

/* ---- the chain ---- */

/* The phase that begins at the chain's time, state and mode. */
static inline hopform_phase_real phase_of_chain_real(const stance_chain_real *chain, int event) {
    const int mode = 3 * (chain->side[0] + 1) + chain->side[1] + 1;
    hopform_phase_real phase;
#define PUT_MEMBER(name, domain) phase.name = chain->at.named.name;
    HOPFORM_STATE_MEMBERS(PUT_MEMBER)
#undef PUT_MEMBER
    phase.t = chain->t;
    phase.mode = (int8_t)mode;
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
    if (!all_rest_real(chain->side)) {
        chain->held_count = 0;
    } else if (chain->held_count == 0) {
        chain->held_from = chain->t;
        chain->held_count = chain->count;
    }
}

/* An element has come to rest, or has met a stop. One that it touches where it turns is no event, but that is where
 * it is. */
static inline void end_of_velocity_real(stance_chain_real *chain, int element, bool stops, bool touches) {
    const int before = chain->side[element];
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
    const int after = chain->side[element];
    const int event = after == 0 ? HOPFORM_EVENT_STICKS(element) : HOPFORM_EVENT_REVERSES(element);
    if ((stops && after != before) || (touches && after == 0)) {
        stance_record_real(chain, HOPFORM_EVENT_HITS_STOP);
    } else {
        stance_record_real(chain, after == before ? HOPFORM_EVENT_NONE : event); /* none: a touch, it goes on */
    }
}

/* The input has taken its value of a step: what is held may begin to slip. */
static inline void take_step_real(stance_chain_real *chain) {
    const uint32_t held = held_elements_real(chain);
    const int32_t count = chain->count;
    stance_choose_limit_real(chain);
    stance_settle_real(chain, held);
    stance_settle_limit_real(chain);
    for (int element = 0; element < HOPFORM_MOVING_ELEMENTS; element++) {
        if ((held & 1u << (uint32_t)element) != 0 && chain->side[element] != 0) {
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
    if (!all_rest_real(chain->side)) { chain->rounded_at_stop = 0.0; }
    if (element < 0 || (HOPFORM_HAS_LAW && end->owner == LIMIT_real) || chain->side[element] == 0) { return; }
#if HOPFORM_HAS_MODAL
    if (end->arrival.is_modal) {
        if (element == HOPFORM_STOPPED_ELEMENT) {
            keep_small_acceleration_real(chain, end->arrival.rate, end->arrival.stretched);
        }
        return;
    }
#endif
    const basis_real basis = basis_of_propagator_real(end->events.set.poles, &end->in.high);
    const bool alone = other_rests_real(chain->side, element);
    const bool at_stop = end->stops || end->touches;
    if (alone && at_stop) { /* beside another one that moves no equilibrium lasts */
        const real stretched = chain->most_stretched + terms_of_stretch_real(chain, &basis);
        chain->rounded_at_stop = fabs_real(rates_of_chain_real(chain)->a1_y * stretched);
    }
    if (alone && !at_stop) {
        chain->came_to_rest = element;
        chain->carried_acceleration =
            free_after_motion_real((real)chain->side[element], level_of_real(&chain->plan->robot, element),
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
#if HOPFORM_HAS_MODAL
    if (end->arrival.is_modal) {
        for (int axis = 1; axis < HOPFORM_AXES; axis++) {
            chain->at.of[axis] = end->arrival.z[axis];
        }
        *position = end->arrival.moved;
    } else
#endif
    {
        chain->at.named = arrive_at_real(&chain->at.named, &chain->numerators.named, &chain->modes, &end->in.high,
                                         chain->side[0], chain->side[1]);
    }
    const real moved = *position;
    *position = before + moved;
    chain->from_lower += moved;
    chain->from_upper += moved;
}

/* The acceleration with which an element starts on its threshold. */
static inline real acceleration_on_threshold_real(const stance_chain_real *chain, int element) {
    const int side = chain->side[element];
    return (real)side * excess_to_side_real(&chain->plan->robot, element, side);
}

/* Put the constant acceleration of an element that starts on its threshold so that its acceleration there is exactly
 * that of the excess, and what follows from it, too: rounding would let it go back at once. */
static inline void start_on_threshold_real(stance_chain_real *chain) {
    const int element = chain->just_switched;
    const int *side = chain->side;
    if (element < 0 || !both_slip_real(side)) { return; }
    real *drive = &chain->drive.of[element];
    *drive = 0.0;
    numerators_by_axis_real others;
    others.named =
        motion_under_real(rates_of_chain_real(chain), &chain->drive.named, &chain->at.named, side[0], side[1]);
    *drive = acceleration_on_threshold_real(chain, element) - others.of.velocity[element].H3;
}

/* The drive and the numerators of the phase that begins at the chain's state. */
static inline void stance_begin_phase_real(stance_chain_real *chain) {
    const int element = chain->came_to_rest;
    chain->drive = drive_of_chain_real(chain, chain->side);
    start_on_threshold_real(chain);
    chain->numerators.named = motion_under_real(rates_of_chain_real(chain), &chain->drive.named, &chain->at.named,
                                                chain->side[0], chain->side[1]);
    const int starts = chain->just_switched;
    if (starts >= 0 && both_slip_real(chain->side)) {
        const real acceleration = acceleration_on_threshold_real(chain, starts);
        if (fabs_real(acceleration) > 0.0) {
            set_acceleration_from_rest_real(&chain->numerators, starts, false, acceleration);
        }
    }
    if (element >= 0 && chain->side[element] != 0) {
        const real level = (real)chain->side[element] * level_of_real(&chain->plan->robot, element);
        set_acceleration_from_rest_real(&chain->numerators, element, other_rests_real(chain->side, element),
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
    if (end->owner == NO_OWNER_real) {
        chain->step = chain->step + 1 < chain->step_count ? chain->step + 1 : chain->step;
        take_step_real(chain);
    } else if (HOPFORM_HAS_LAW && end->owner == LIMIT_real) {
        chain->side[HOPFORM_ELEMENTS - 1] = end->side;
        stance_record_real(chain, HOPFORM_EVENT_OF_LIMIT(end->side));
    } else if (chain->side[element] != 0) {
        end_of_velocity_real(chain, element, end->stops, end->touches);
    } else {
        chain->side[element] = end->side;
        chain->just_switched = element;
        stance_record_real(chain, HOPFORM_EVENT_SLIPS(element));
    }
}

#if HOPFORM_HAS_CONTACT
/* The contact is lost at once: it pulls, or its contact force is on 0 and the first non-zero derivative of that is
 * negative. */
static inline bool leaves_at_once_real(const stance_chain_real *chain) {
    const real contact =
        decided_real(contact_of_real(&chain->plan->robot, &chain->at.named), terms_of_contact_real(chain));
    const bool rises = HOPFORM_CONTACT_IS_STRETCH && stretch_rate_real(&chain->at.named) > 0.0;
    if (fabs_real(contact) > 0.0 || rises) { return contact < 0.0; }
    const numerators_by_axis_real numerators = numerators_of_chain_real(chain, chain->side);
    const numerator_real h = contact_numerator_real(&chain->plan->robot, &numerators.named);
    return first_derivative_real(&h) < 0.0;
}
#endif

/* Pass the finished phase to the observer, if there is one. */
static inline void notify_real(const stance_chain_real *chain, const state_by_axis_real *start,
                               const propagator_real *end, bool leaves) {
    if (chain->observer != NULL) {
        const solved_phase_real phase = {&chain->numerators, end,         &chain->modes, start,
                                         &chain->at,         chain->side, chain->event,  leaves};
        chain->observer(chain->variation, &phase);
    }
}

/* The same of a last phase of no duration. */
static inline void notify_ending_real(stance_chain_real *chain) {
    if (chain->observer != NULL) {
        const propagator_real now = propagator_at_start_real(any_poles_real(chain->plan));
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
    if (all_rest_real(chain->side) && chain->step + 1 >= chain->step_count) {
        chain->t = chain->held_from; /* steps of the input since then have moved nothing */
        chain->count = chain->held_count;
        notify_ending_real(chain);
        return HOPFORM_ENDING_REST;
    }
    return 0;
}

/* What each element does at the start, no event; the ending if that is there already, 0 if not. */
static inline int32_t stance_begin_real(stance_chain_real *chain) {
    chain->side[HOPFORM_ELEMENTS - 1] = 0; /* of one that never moves */
    for (int element = 0; element < HOPFORM_MOVING_ELEMENTS; element++) {
        real *velocity = &chain->at.of[HOPFORM_VELOCITY_AXIS(element)];
        chain->side[element] = (int)goes_real(*velocity, 0.0);
        if (element == HOPFORM_STOPPED_ELEMENT && chain->side[element] != 0
            && stance_blocked_real(chain, element, chain->side[element])) {
            chain->start_loss = loss_at_stop_real(&chain->plan->robot, &chain->at.named);
            *velocity = 0.0;
            chain->side[element] = 0;
        }
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
