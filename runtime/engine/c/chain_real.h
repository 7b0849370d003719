/* SPDX-License-Identifier: MIT-0
 *
 * One stance as a chain of phases: each is linear, has its closed form, and ends at the first of the events in
 * which a mass reverses, sticks, slips or hits a stop, or in which the spring force returns to zero.
 */
#ifndef HOPFORM_CHAIN_H_real
#define HOPFORM_CHAIN_H_real

#include "facts.h"
#include "first_event_real.h"
#include "follow_real.h"
#include "ledger_real.h"

/* How a phase ends. */
typedef enum {
    STANCE_END_LIMIT_real,
    END_VELOCITY_1_real,
    END_THRESHOLD_1_real,
    STANCE_END_STOP_real,
    END_VELOCITY_2_real,
    END_THRESHOLD_2_real,
    END_TAKEOFF_real,
    END_UNCERTIFIED_real
} stance_end_kind_real;

typedef struct {
    real t; /* since the phase began */
    stance_end_kind_real kind;
    int side;                 /* of a threshold: where the mass goes */
    hopform_basis_real basis; /* at t */
    real touch;               /* how near x_1, where it turns, is to a stop that it touches */
} stance_phase_end_real;

/* The chain while it grows. */
typedef struct {
    const hopform_plan_real *plan;
    const hopform_step_real *steps;
    int32_t step_count;
    int32_t step;
    real horizon;
    real t;
    hopform_state_real state;
    real from_min; /* x1 - x1_min and x1 - x1_max: x1 itself has no digits for what is this close to a stop */
    real from_max;
    int side_1;
    int side_2;
    bool fresh_1; /* mass 1 has just crossed its friction threshold: its acceleration is exactly zero */
    bool fresh_2;
    int alone; /* the mass that has just come to rest and whose free acceleration is known from the motion, 0 if none
                  has */
    real free; /* this acceleration, from before the state lost its digits */
    real start_loss;
    bool adds_up; /* the AED is the sum of its entries, not a difference of energies that are much larger */
    real aed;
    int32_t max_phases;
    hopform_phase_real *phases;
    int32_t capacity;
    int32_t count;
    int32_t event_count;
    int event; /* with which the phase began */
    hopform_follow_real *follow;
    hopform_tally_real *tally;
} stance_chain_real;

/* ---- the hold rule ---- */

static inline real friction_of_mass_real(const stance_chain_real *chain, int mass)
{
    const hopform_friction_real friction = hopform_friction_of_real(&chain->plan->robot);
    return mass == 1 ? friction.level_1 : friction.level_2;
}

/* Whether a stop, or the ground that it is bolted to, keeps a mass at rest from going to a side. */
static inline bool stance_blocked_real(const stance_chain_real *chain, int mass, int side)
{
    if (mass == 2) {
        return HOPFORM_BODY_IS_FIXED;
    }
    const bool locked = !(chain->plan->robot.x1_min < chain->plan->robot.x1_max);
    return locked || (side < 0 && chain->from_min <= 0.0) || (side > 0 && chain->from_max >= 0.0);
}

/* First non-zero derivative of the free acceleration of a mass that is held. */
static inline real drift_of_free_real(const stance_chain_real *chain, int mass)
{
    const int side_1 = mass == 1 ? 0 : chain->side_1;
    const int side_2 = mass == 2 ? 0 : chain->side_2;
    const hopform_motion_real motion =
        hopform_motion_of_real(chain->plan, &chain->state, chain->steps[chain->step].u, side_1, side_2);
    const hopform_numerator_real free = mass == 1 ? hopform_free_numerator_1_real(&chain->plan->rates, &motion)
                                                  : hopform_free_numerator_2_real(&chain->plan->rates, &motion);
    if (fabs_real(free.H3) > 0.0) {
        return free.H3;
    }
    return fabs_real(free.H2) > 0.0 ? free.H2 : free.H1;
}

/* Where a mass at rest goes: held while |a_i| <= f_i; on the threshold its first non-zero derivative decides. */
static inline int direction_real(const stance_chain_real *chain, int mass)
{
    const hopform_free_real free =
        hopform_free_accelerations_real(&chain->plan->rates, &chain->state, chain->steps[chain->step].u);
    const real acceleration = chain->alone == mass ? chain->free : (mass == 1 ? free.free_1 : free.free_2);
    const real friction = friction_of_mass_real(chain, mass);
    real goes = hopform_goes_real(acceleration, friction);
    if (!(fabs_real(acceleration) < friction) && !(fabs_real(goes) > 0.0)) {
        const real drift = drift_of_free_real(chain, mass);
        goes = acceleration * drift >= 0.0 ? hopform_goes_real(drift, 0.0) : 0.0;
    }
    const int side = (int)goes;
    return stance_blocked_real(chain, mass, side) ? 0 : side;
}

/* Sides of the masses that are at rest; of two twice, because each may depend on what the other one does. */
static inline void stance_settle_real(stance_chain_real *chain, bool rests_1, bool rests_2)
{
    for (int n = 0; n < (rests_1 && rests_2 ? 2 : 1); n++) {
        chain->side_1 = rests_1 ? direction_real(chain, 1) : chain->side_1;
        chain->side_2 = rests_2 ? direction_real(chain, 2) : chain->side_2;
    }
}

/* Up to when the current stays as it is. */
static inline real end_of_step_real(const stance_chain_real *chain)
{
    const int32_t next = chain->step + 1;
    const real until = next < chain->step_count ? chain->steps[next].t : chain->horizon;
    return hopform_lesser_real(until, chain->horizon);
}

/* ---- the end of a phase ---- */

/* The event functions of a phase, and what ends it in closed form. Not in it are the velocity of a mass that slips
 * alone, whose time to rest is known, and what cannot happen while v_1 and v_2 keep their signs. */
typedef struct {
    event_set_real set;
    event_function_real stop; /* how far x_1 is from the stop ahead */
    real rest_time;           /* when the mass that slips alone comes to rest, or y, which rings about 0, vanishes */
    stance_end_kind_real rests;
} stance_events_real;

static inline void add_event_function_real(event_set_real *set, const hopform_numerator_real *h, real start, real sign,
                                           stance_end_kind_real kind, int side)
{
    const event_function_real g = {sign * h->H3, sign * h->H2, sign * h->H1, 0.0, sign * start, (int32_t)kind, side};
    set->function[set->count++] = g;
}

/* A held mass slips where its free acceleration leaves [-f, f]; a stop holds on its side whatever the force. */
static inline void add_thresholds_real(const stance_chain_real *chain, const hopform_motion_real *motion, int mass,
                                       event_set_real *set)
{
    const hopform_rates_real *rates = &chain->plan->rates;
    const hopform_free_real at_rest =
        hopform_free_accelerations_real(rates, &chain->state, chain->steps[chain->step].u);
    const hopform_numerator_real h =
        mass == 1 ? hopform_free_numerator_1_real(rates, motion) : hopform_free_numerator_2_real(rates, motion);
    const real acceleration = mass == 1 ? at_rest.free_1 : at_rest.free_2;
    const real friction = friction_of_mass_real(chain, mass);
    const int towards = hopform_side_of_slip_real(rates, chain->side_1, chain->side_2);
    for (int side = -1; side <= 1; side += 2) {
        if (side != -towards && !stance_blocked_real(chain, mass, side)) {
            const real sign = (real)side;
            add_event_function_real(set, &h, acceleration - sign * friction, -sign,
                                    mass == 1 ? END_THRESHOLD_1_real : END_THRESHOLD_2_real, side);
        }
    }
}

/* Where one mass is held and the forces on the other one cancel at y = 0, y rings about 0 as a velocity does: its first
 * zero is known however far it has faded by then. */
static inline bool rings_about_zero_real(const stance_chain_real *chain)
{
    const hopform_state_real slack = {0.0, 0.0, 0.0, 0.0};
    if ((chain->side_1 != 0 && chain->side_2 != 0) || chain->state.y < 0.0) {
        return false;
    }
    const hopform_free_real free =
        hopform_free_accelerations_real(&chain->plan->rates, &slack, chain->steps[chain->step].u);
    const real left = chain->side_2 == 0 ? free.free_1 - (real)chain->side_1 * friction_of_mass_real(chain, 1)
                                         : free.free_2 - (real)chain->side_2 * friction_of_mass_real(chain, 2);
    return !(fabs_real(left) > 0.0);
}

/* How far x_1 is from the stop ahead. */
static inline real gap_ahead_real(const stance_chain_real *chain)
{
    return chain->side_1 > 0 ? -chain->from_max : chain->from_min;
}

static inline void put_events_real(stance_events_real *events, const stance_chain_real *chain,
                                   const hopform_motion_real *motion)
{
    const hopform_state_real *state = &chain->state;
    event_set_real *set = &events->set;
    const hopform_poles_real *poles = hopform_poles_of_real(chain->plan, chain->side_1, chain->side_2);
    const real away = -(real)chain->side_1;
    const event_function_real stop = {
        away * state->v1, away * motion->N2_1, away * motion->N1_1, away * motion->N0_1, gap_ahead_real(chain), 0, 0};
    set->poles = poles;
    set->node = hopform_node_of_real(chain->plan, chain->side_1, chain->side_2);
    set->count = 0;
    events->stop = stop;
    events->rest_time = HOPFORM_NEVER_real;
    events->rests = STANCE_END_LIMIT_real;
    const bool alone = chain->side_1 == 0 || chain->side_2 == 0;
    const bool rings = HOPFORM_CONTACT_IS_COMPRESSION && alone && rings_about_zero_real(chain);
    const bool may_fall = chain->side_1 < 0 || chain->side_2 > 0 || state->y < 0.0; /* else y rises, from 0 or above */
    if (!HOPFORM_FOOT_IS_FIXED && !rings && (may_fall || !HOPFORM_CONTACT_IS_COMPRESSION)) {
        const hopform_numerator_real leg = hopform_contact_numerator_real(&chain->plan->robot, motion);
        add_event_function_real(set, &leg, hopform_contact_of_real(&chain->plan->robot, state), 1.0, END_TAKEOFF_real,
                                0);
    }
    if (chain->side_1 == 0) {
        const real sign = (real)chain->side_2;
        add_thresholds_real(chain, motion, 1, set);
        events->rest_time = time_to_rest_real(poles, sign * state->v2, sign * motion->H3_2);
        events->rests = END_VELOCITY_2_real;
    } else if (chain->side_2 == 0) {
        const real sign = (real)chain->side_1;
        add_thresholds_real(chain, motion, 2, set);
        events->rest_time = time_to_rest_real(poles, sign * state->v1, sign * motion->H3_1);
        events->rests = END_VELOCITY_1_real;
    } else {
        const hopform_numerator_real h_1 = {chain->fresh_1 ? 0.0 : motion->H3_1, motion->H2_1, motion->H1_1};
        const hopform_numerator_real h_2 = {chain->fresh_2 ? 0.0 : motion->H3_2, motion->H2_2, motion->H1_2};
        add_event_function_real(set, &h_1, state->v1, (real)chain->side_1, END_VELOCITY_1_real, 0);
        add_event_function_real(set, &h_2, state->v2, (real)chain->side_2, END_VELOCITY_2_real, 0);
    }
    const real lift = rings ? time_to_rest_real(poles, state->y, state->v1 - state->v2) : HOPFORM_NEVER_real;
    if (rings && lift <= events->rest_time) {
        events->rest_time = lift;
        events->rests = END_TAKEOFF_real;
    }
}

static inline bool is_takeoff_real(const event_set_real *set, int32_t found)
{
    return found >= 0 && set->function[found].kind == END_TAKEOFF_real;
}

/* An extremum of x_1 that is this near to a stop is a grazing contact: 16 ulp of the terms. */
static inline real grazing_tolerance_real(const event_function_real *stop, const propagator_real *at)
{
    return rounding_of_real(stop, at, 0.0) + 16.0 * HOPFORM_EPS_real * fabs_real(stop->H0 * at->basis.W2);
}

/* Whether x_1, monotone within a phase, is beyond the stop ahead at a time, and does not just touch it. */
static inline bool is_beyond_stop_real(const event_function_real *stop, const propagator_real *at)
{
    const real distance = value_at_real(stop, at) + stop->H0 * at->basis.W2;
    return distance < 0.0 && distance < -grazing_tolerance_real(stop, at);
}

/* The interval ends where x_1 meets the stop ahead, if it does. */
static inline bool meets_stop_real(const stance_events_real *events, propagator_real *end)
{
    const event_function_real *stop = &events->stop;
    const hopform_poles_real *poles = events->set.poles;
    if (!is_beyond_stop_real(stop, end)) {
        return false;
    }
    const jet_real jet = jet_at_real(poles, stop, end);
    *end = located_root_real(poles, stop, 0.0, end, end->t - step_to_root_real(&jet));
    return true;
}

/* At the time of the limit a take-off comes before it, and before mass 2 comes to rest what mass 1 does. */
static inline void cross_at_the_limit_real(const stance_events_real *events, real limit, interval_real *in)
{
    const event_set_real *set = &events->set;
    for (int32_t n = 0; n < set->count && in->found < 0 && !(in->high.t < limit); n++) {
        const bool is_first = is_takeoff_real(set, n)
                              || (set->function[n].kind == END_THRESHOLD_1_real && events->rests == END_VELOCITY_2_real
                                  && !(events->rest_time > limit));
        const jet_real *at = &in->to[n]; /* found_first_root has looked at all of them there */
        const real rounding = rounding_of_real(&set->function[n], &in->high, at->rate);
        if (is_first && crosses_at_limit_real(at, rounding, limit)) {
            in->found = n;
        }
    }
}

/* Whether so much of a phase has passed that what y tends to may tell more of a take-off. */
static inline bool is_late_real(const hopform_basis_real *basis)
{
    return fabs_real(basis->Wdd) < 0.25;
}

/* How much later than t a take-off late in a phase is, by what y tends to; 0 where that tells no more. */
static inline real later_takeoff_real(const stance_chain_real *chain, const hopform_poles_real *poles,
                                      const event_function_real *leg, const hopform_basis_real *basis, real t)
{
    if (!is_late_real(basis)) {
        return 0.0;
    }
    const hopform_state_real slack = {0.0, 0.0, 0.0, 0.0};
    const hopform_motion_real from_slack =
        hopform_motion_of_real(chain->plan, &slack, chain->steps[chain->step].u, chain->side_1, chain->side_2);
    const hopform_state_real steady = {0.0, 0.0, 0.0, hopform_settled_y_real(poles, from_slack.H2_y, from_slack.H1_y)};
    const real settled = hopform_contact_of_real(&chain->plan->robot, &steady);
    return steady_state_correction_real(poles, leg, settled, basis, t);
}

/* A take-off late in a phase: its time with all its digits. True if it comes later, so that something else may come
 * first. */
static inline bool sharpen_takeoff_real(const stance_chain_real *chain, const stance_events_real *events, real limit,
                                        interval_real *in)
{
    const event_set_real *set = &events->set;
    const int32_t found = in->found;
    const real before = in->high.t;
    for (int n = 0; n < 4 && is_takeoff_real(set, found); n++) {
        const real later = later_takeoff_real(chain, set->poles, &set->function[found], &in->high.basis, in->high.t);
        if (!(fabs_real(later) > 0.0) || in->high.t + later > limit) {
            break;
        }
        end_interval_at_real(set, in, in->high.t + later);
        in->found = found;
    }
    return in->high.t > before;
}

/* The far end of the next interval: less than half a period of the pair away, and not so far that all has faded. */
static inline void reach_ahead_real(const event_set_real *set, interval_real *in, real limit)
{
    const real low = in->low;
    const real near = set->node->t > 3.0 * low ? set->node->t : 3.0 * low;
    const real half = 0.95 * set->node->half_period;
    const bool faded =
        -0.5 * set->poles->p * low < HOPFORM_SMALLEST_EXPONENT_real; /* the pair: what is left is monotone */
    const real far = faded ? limit : low + (near < half ? near : half);
    if (!(low > 0.0) && set->node->t < limit) {
        const hopform_node_real *node = set->node;
        const hopform_basis_real basis = {node->Wdd, node->Wd, node->W, node->W1, node->W2};
        in->high = propagator_of_real(set->poles, node->t, &basis);
        in->found = -1;
    } else {
        end_interval_at_real(set, in, far > low && far < limit && set->count > 0 ? far : limit);
    }
}

/* The event functions of a phase, and where their first root is searched; zeroed once, so that nothing is unset. */
typedef struct {
    stance_events_real events;
    interval_real in;
    real limit; /* the end of the phase: since it began, as all its times */
    bool open;  /* whether an event is still looked for */
} stance_search_real;

/* What ends the phase at the end of its last interval. */
static inline stance_phase_end_real end_of_real(const stance_search_real *search, bool stops)
{
    const stance_events_real *events = &search->events;
    const interval_real *in = &search->in;
    const real limit = search->limit;
    stance_phase_end_real result = {in->high.t, STANCE_END_LIMIT_real, 0, in->high.basis, 0.0};
    const bool rests = !(events->rest_time > limit) && !(in->high.t < limit * (1.0 - 8.0 * HOPFORM_EPS_real));
    const bool wins = events->rests != END_VELOCITY_2_real
                      && !is_takeoff_real(&events->set, in->found); /* over mass 2 at the same time */
    if (stops) {
        result.kind = STANCE_END_STOP_real;
    } else if (in->found >= 0 && !(rests && wins)) {
        result.kind = (stance_end_kind_real)events->set.function[in->found].kind;
        result.side = events->set.function[in->found].side;
    } else if (rests) {
        result.kind = events->rests;
    }
    if (result.kind == END_VELOCITY_1_real && hopform_is_finite_real(events->stop.start)) {
        result.touch = grazing_tolerance_real(&events->stop, &in->high);
    }
    return result;
}

/* The search at the start of the phase that starts at the chain's state. */
static inline void stance_begin_search_real(const stance_chain_real *chain, const hopform_motion_real *motion,
                                            stance_search_real *search)
{
    const real until = end_of_step_real(chain) - chain->t;
    const hopform_basis_real start = {1.0, 0.0, 0.0, 0.0, 0.0};
    put_events_real(&search->events, chain, motion);
    const event_set_real *set = &search->events.set;
    interval_real *in = &search->in;
    in->low = 0.0;
    in->high = propagator_of_real(set->poles, 0.0, &start);
    for (int32_t n = 0; n < set->count; n++) {
        in->from[n] = jet_at_start_real(set->poles, &set->function[n]);
    }
    in->found = lost_at_once_real(set, in);
    in->count = 0;
    search->limit = hopform_lesser_real(search->events.rest_time, until);
    search->open = in->found < 0 && search->limit > 0.0;
}

/* The next interval, which begins where this one has ended; true if nothing happens in it. */
static inline bool next_interval_real(const event_set_real *set, interval_real *in, real limit)
{
    begin_interval_real(set, in);
    const real quiet = quiet_until_real(set, in);
    if (quiet > in->low + 2.0 * set->node->t) {
        end_interval_at_real(set, in, quiet < limit ? quiet : limit);
        return true;
    }
    reach_ahead_real(set, in, limit);
    return false;
}

/* The first event, from the first interval on; a root in it that ends it may be known. */
static inline stance_phase_end_real stance_end_search_real(const stance_chain_real *chain, stance_search_real *search)
{
    const stance_events_real *events = &search->events;
    const event_set_real *set = &events->set;
    const real limit = search->limit;
    interval_real *in = &search->in;
    bool stops = false;
    bool certified = true;
    bool quiet = false;
    bool open = search->open;
    while (open) {
        bool later = !quiet; /* once at most, and then what else happens by then is looked at */
        for (int n = 0; n < 2 && later && certified; n++) {
            certified = find_first_root_real(set, in);
            cross_at_the_limit_real(events, limit, in);
            later = n == 0 && in->found >= 0 && sharpen_takeoff_real(chain, events, limit, in);
        }
        const real t = in->high.t;
        stops = certified && meets_stop_real(events, &in->high)
                && !(is_takeoff_real(set, in->found) && t <= in->high.t * (1.0 + 8.0 * HOPFORM_EPS_real));
        open = in->found < 0 && !stops && certified && in->high.t < limit;
        quiet = open && next_interval_real(set, in, limit);
    }
    if (!certified) {
        const propagator_real last = propagator_at_real(set->poles, in->low);
        const stance_phase_end_real result = {in->low, END_UNCERTIFIED_real, 0, last.basis, 0.0};
        return result;
    }
    return end_of_real(search, stops);
}

/* The first event of the phase that starts at the chain's state. */
static inline stance_phase_end_real stance_find_end_real(const stance_chain_real *chain,
                                                         const hopform_motion_real *motion, stance_search_real *search)
{
    if (chain->side_1 == 0 && chain->side_2 == 0) {
        const hopform_basis_real start = {1.0, 0.0, 0.0, 0.0, 0.0};
        const stance_phase_end_real result = {end_of_step_real(chain) - chain->t, STANCE_END_LIMIT_real, 0, start, 0.0};
        return result;
    }
    stance_begin_search_real(chain, motion, search);
    if (search->open) {
        reach_ahead_real(&search->events.set, &search->in, search->limit);
    }
    return stance_end_search_real(chain, search);
}

/* ---- the chain ---- */

/* The phase that begins at the chain's time, state and mode. */
static inline hopform_phase_real phase_of_chain_real(const stance_chain_real *chain, int event)
{
    const hopform_state_real *state = &chain->state;
    const int mode = 3 * (chain->side_1 + 1) + chain->side_2 + 1;
    const hopform_phase_real phase = {chain->t, state->x1,    state->v1,     state->v2,
                                      state->y, (int8_t)mode, (int8_t)event, (uint16_t)chain->step};
    return phase;
}

static inline void stance_record_real(stance_chain_real *chain, int event)
{
    if (chain->count < chain->capacity) {
        chain->phases[chain->count] = phase_of_chain_real(chain, event);
    }
    if (event != HOPFORM_EVENT_NONE && chain->count < chain->max_phases && chain->event_count < chain->count) {
        chain->event_count++;
    }
    chain->event = event;
    chain->count++;
}

static inline void after_rest_real(stance_chain_real *chain, int mass, int side_before, int event_if_it_sticks,
                                   int event_if_it_reverses)
{
    stance_settle_real(chain, mass == 1, mass == 2);
    const int side = mass == 1 ? chain->side_1 : chain->side_2;
    if (side == 0) {
        stance_record_real(chain, event_if_it_sticks);
    } else if (side != side_before) {
        stance_record_real(chain, event_if_it_reverses);
    } else {
        stance_record_real(chain, HOPFORM_EVENT_NONE); /* a touch: it goes on */
    }
}

/* The actuator has come to rest, or has met a stop. One that it touches where it turns is no event, but that is where
 * it is. */
static inline void end_of_velocity_1_real(stance_chain_real *chain, const stance_phase_end_real *end)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const int before = chain->side_1;
    const real stop = before > 0 ? robot->x1_max : robot->x1_min;
    const bool hits = end->kind == STANCE_END_STOP_real;
    chain->state.v1 = 0.0; /* inelastic */
    if (hits || fabs_real(gap_ahead_real(chain)) <= end->touch) {
        chain->state.x1 = stop;
        chain->from_min = stop - robot->x1_min;
        chain->from_max = stop - robot->x1_max;
    }
    after_rest_real(chain, 1, before, hits ? HOPFORM_EVENT_X1_HITS_STOP : HOPFORM_EVENT_X1_STICKS,
                    hits ? HOPFORM_EVENT_X1_HITS_STOP : HOPFORM_EVENT_X1_REVERSES);
}

/* The current takes its next value: what is held may begin to slip. */
static inline void next_step_real(stance_chain_real *chain)
{
    if (chain->step + 1 < chain->step_count) {
        chain->step++;
    }
    const bool held_1 = chain->side_1 == 0;
    const bool held_2 = chain->side_2 == 0;
    stance_settle_real(chain, held_1, held_2);
    const bool slips_1 = held_1 && chain->side_1 != 0;
    const bool slips_2 = held_2 && chain->side_2 != 0;
    stance_record_real(chain,
                       slips_1 ? HOPFORM_EVENT_X1_SLIPS : (slips_2 ? HOPFORM_EVENT_X2_SLIPS : HOPFORM_EVENT_NONE));
    if (slips_1 && slips_2) {
        stance_record_real(chain, HOPFORM_EVENT_X2_SLIPS);
    }
}

/* An actuator without any friction that stops while the forces on it cancel to all digits of the state: what is left of
 * them is its acceleration before, known from the motion where that has faded.
 */
static inline void keep_faint_acceleration_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                                const hopform_basis_real *basis)
{
    const hopform_rates_real *rates = &chain->plan->rates;
    if (friction_of_mass_real(chain, 1) > 0.0 || fabs_real(rates->a1_v1) > 0.0) {
        return;
    }
    const hopform_free_real at_rest =
        hopform_free_accelerations_real(rates, &chain->state, chain->steps[chain->step].u);
    if (!(fabs_real(at_rest.free_1) < 64.0 * HOPFORM_EPS_real * fabs_real(rates->a1_y * chain->state.y))) {
        return;
    }
    const real terms[] = {motion->H3_1 * basis->Wdd, motion->H2_1 * basis->Wd, motion->H1_1 * basis->W};
    const real rate = terms[0] + terms[1] + terms[2];
    if (fabs_real(rate) > 16.0 * HOPFORM_EPS_real * (fabs_real(terms[0]) + fabs_real(terms[1]) + fabs_real(terms[2]))) {
        chain->alone = 1;
        chain->free = rate;
    }
}

/* What is known of the free acceleration of a mass that comes to rest from its motion. */
static inline void keep_free_acceleration_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                               const stance_phase_end_real *end)
{
    chain->alone = 0;
    if (end->kind == END_VELOCITY_1_real && chain->side_2 == 0) {
        chain->alone = 1;
        chain->free = hopform_free_after_motion_real((real)chain->side_1, friction_of_mass_real(chain, 1), motion->H3_1,
                                                     motion->H2_1, &end->basis);
    } else if (end->kind == END_VELOCITY_2_real && chain->side_1 == 0) {
        chain->alone = 2;
        chain->free = hopform_free_after_motion_real((real)chain->side_2, friction_of_mass_real(chain, 2), motion->H3_2,
                                                     motion->H2_2, &end->basis);
    } else if ((end->kind == END_VELOCITY_1_real || end->kind == STANCE_END_STOP_real) && chain->side_2 != 0) {
        keep_faint_acceleration_real(chain, motion, &end->basis);
    }
}

/* The state at the end of a phase, and how far from its stops the actuator is there. */
static inline void stance_arrive_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                      const stance_phase_end_real *end)
{
    hopform_state_real from_zero = chain->state;
    from_zero.x1 = 0.0;
    const hopform_state_real moved = hopform_arrive_real(&from_zero, motion, &end->basis, chain->side_1, chain->side_2);
    const real x1 = chain->state.x1 + moved.x1;
    chain->from_min += moved.x1;
    chain->from_max += moved.x1;
    chain->state = moved;
    chain->state.x1 = x1;
}

/* The numerators of the next phase. */
static inline hopform_motion_real motion_from_real(const stance_chain_real *chain)
{
    hopform_motion_real motion =
        hopform_motion_of_real(chain->plan, &chain->state, chain->steps[chain->step].u, chain->side_1, chain->side_2);
    if (chain->alone == 1 && chain->side_1 != 0) {
        hopform_go_on_real(&motion, 1, chain->side_2 == 0,
                           chain->free - (real)chain->side_1 * friction_of_mass_real(chain, 1));
    } else if (chain->alone == 2 && chain->side_2 != 0) {
        hopform_go_on_real(&motion, 2, true, chain->free - (real)chain->side_2 * friction_of_mass_real(chain, 2));
    }
    return motion;
}

/* The AED of a phase that lasts for t. */
static inline real aed_in_phase_real(const stance_chain_real *chain, real t)
{
    const hopform_phase_real phase = phase_of_chain_real(chain, HOPFORM_EVENT_NONE);
    const hopform_ledger_real ledger =
        hopform_ledger_in_phase_real(chain->plan, &phase, chain->steps[chain->step].u, t);
    return hopform_aed_of_ledger_real(&ledger);
}

/* The state and modes right after the end of a phase, recorded as the next phase. */
static inline void stance_pass_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                    const stance_phase_end_real *end)
{
    keep_free_acceleration_real(chain, motion, end);
    chain->fresh_1 = end->kind == END_THRESHOLD_1_real;
    chain->fresh_2 = end->kind == END_THRESHOLD_2_real;
    switch (end->kind) {
    case END_VELOCITY_1_real:
    case STANCE_END_STOP_real:
        end_of_velocity_1_real(chain, end);
        break;
    case END_VELOCITY_2_real: {
        const int before = chain->side_2;
        chain->state.v2 = 0.0;
        after_rest_real(chain, 2, before, HOPFORM_EVENT_X2_STICKS, HOPFORM_EVENT_X2_REVERSES);
        break;
    }
    case END_THRESHOLD_1_real:
        chain->side_1 = end->side;
        stance_record_real(chain, HOPFORM_EVENT_X1_SLIPS);
        break;
    case END_THRESHOLD_2_real:
        chain->side_2 = end->side;
        stance_record_real(chain, HOPFORM_EVENT_X2_SLIPS);
        break;
    case STANCE_END_LIMIT_real:
        next_step_real(chain);
        break;
    case END_TAKEOFF_real:
    case END_UNCERTIFIED_real:
    default:
        break;
    }
}

/* The leg leaves the ground at once: it pulls, or its contact force is 0 and the first non-zero derivative of that is
 * negative. */
static inline bool leaves_at_once_real(const stance_chain_real *chain)
{
    const real contact = hopform_contact_of_real(&chain->plan->robot, &chain->state);
    if (HOPFORM_FOOT_IS_FIXED) {
        return false;
    }
    if (fabs_real(contact) > 0.0 || (HOPFORM_CONTACT_IS_COMPRESSION && chain->state.v1 > chain->state.v2)) {
        return contact < 0.0;
    }
    const hopform_motion_real motion =
        hopform_motion_of_real(chain->plan, &chain->state, chain->steps[chain->step].u, chain->side_1, chain->side_2);
    const hopform_numerator_real leg = hopform_contact_numerator_real(&chain->plan->robot, &motion);
    const real first = fabs_real(leg.H3) > 0.0 ? leg.H3 : leg.H2;
    return fabs_real(first) > 0.0 ? first < 0.0 : leg.H1 < 0.0;
}

/* Show the phase that has come to its end to who follows the stance. */
static inline void show_phase_real(const stance_chain_real *chain, const hopform_motion_real *motion,
                                   const hopform_state_real *start, real length, const hopform_basis_real *end)
{
    if (chain->follow != NULL) {
        const hopform_passage_real passage = {
            hopform_poles_of_real(chain->plan, chain->side_1, chain->side_2),
            motion,
            end,
            length,
            *start,
            chain->state,
            chain->side_1,
            chain->side_2,
            chain->event,
        };
        chain->follow(chain->tally, &passage);
    }
}

/* The same of a last phase in which no time passes. */
static inline void show_ending_real(const stance_chain_real *chain)
{
    const hopform_basis_real now = {1.0, 0.0, 0.0, 0.0, 0.0};
    const hopform_motion_real motion = motion_from_real(chain);
    show_phase_real(chain, &motion, &chain->state, 0.0, &now);
}

/* The ending that comes before the next phase; 0 if the stance goes on. */
static inline int32_t ending_before_phase_real(stance_chain_real *chain)
{
    if (chain->count > chain->max_phases) {
        chain->count = chain->max_phases; /* a step of the current may have begun two */
        return HOPFORM_ENDING_TOO_MANY_PHASES;
    }
    if (chain->side_1 == 0 && chain->side_2 == 0 && chain->step + 1 >= chain->step_count) {
        show_ending_real(chain);
        return HOPFORM_ENDING_REST;
    }
    return 0;
}

/* What each mass does at the start, no event; the ending if that is there already, 0 if not. */
static inline int32_t stance_begin_real(stance_chain_real *chain)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    chain->side_1 = (int)hopform_goes_real(chain->state.v1, 0.0);
    chain->side_2 = (int)hopform_goes_real(chain->state.v2, 0.0);
    if (chain->side_1 != 0 && stance_blocked_real(chain, 1, chain->side_1)) {
        chain->start_loss = -0.5 * robot->m_eff * chain->state.v1 * chain->state.v1;
        chain->state.v1 = 0.0;
        chain->side_1 = 0;
    }
    stance_settle_real(chain, chain->side_1 == 0, chain->side_2 == 0);
    stance_record_real(chain, HOPFORM_EVENT_NONE);
    return leaves_at_once_real(chain) ? HOPFORM_ENDING_TAKEOFF : ending_before_phase_real(chain);
}

/* Go on to the end of a phase and behind it; the ending, 0 if another phase follows. */
static inline int32_t stance_end_phase_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                            const stance_phase_end_real *end)
{
    const real until = end_of_step_real(chain);
    const hopform_state_real start = chain->state;
    chain->aed += chain->adds_up ? aed_in_phase_real(chain, end->t) : 0.0;
    stance_arrive_real(chain, motion, end);
    show_phase_real(chain, motion, &start, end->t, &end->basis);
    chain->t = end->kind == STANCE_END_LIMIT_real ? until : chain->t + end->t;
    if (end->kind == END_TAKEOFF_real) {
        chain->state.y = HOPFORM_CONTACT_IS_COMPRESSION ? 0.0 : chain->state.y;
        return HOPFORM_ENDING_TAKEOFF;
    }
    if (end->kind == STANCE_END_LIMIT_real && !(until < chain->horizon)) {
        return HOPFORM_ENDING_HORIZON;
    }
    if (end->kind == END_UNCERTIFIED_real) {
        return HOPFORM_ENDING_UNCERTIFIED;
    }
    stance_pass_real(chain, motion, end);
    if (!HOPFORM_CONTACT_IS_COMPRESSION && !HOPFORM_FOOT_IS_FIXED && end->kind == STANCE_END_STOP_real
        && hopform_contact_of_real(&chain->plan->robot, &chain->state) < 0.0) {
        show_ending_real(chain); /* what v_1 has lost at the stop was in the contact force */
        return HOPFORM_ENDING_TAKEOFF;
    }
    return ending_before_phase_real(chain);
}

/* ---- in and out ---- */

/* Status of a stance that is to be solved, but for its current. */
static inline int32_t stance_status_real(const hopform_robot_real *robot, const hopform_state_real *start, real horizon,
                                         int32_t max_phases)
{
    if (!hopform_is_finite_real(start->x1) || !hopform_is_finite_real(start->v1) || !hopform_is_finite_real(start->v2)
        || !hopform_is_finite_real(start->y) || !(start->x1 >= robot->x1_min && start->x1 <= robot->x1_max)
        || (HOPFORM_BODY_IS_FIXED && fabs_real(start->v2) > 0.0)) {
        return HOPFORM_ERROR_STATE;
    }
    if (!HOPFORM_FOOT_IS_FIXED && start->y < 0.0) {
        return HOPFORM_ERROR_EXTENDED;
    }
    const bool ends = horizon > 0.0 && horizon <= HOPFORM_NEVER_real && max_phases >= 1;
    return ends ? HOPFORM_OK : HOPFORM_ERROR_HORIZON;
}

/* The chain of a stance at its start. What each mass does there is no event. */
static inline stance_chain_real stance_chain_from_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                                       const hopform_step_real *steps, int32_t step_count, real horizon,
                                                       int32_t max_phases, hopform_phase_real *phases, int32_t capacity)
{
    stance_chain_real chain = {0};
    chain.plan = plan;
    chain.steps = steps;
    chain.step_count = step_count;
    chain.horizon = horizon;
    chain.state = *start;
    chain.from_min = start->x1 - plan->robot.x1_min;
    chain.from_max = start->x1 - plan->robot.x1_max;
    chain.adds_up = hopform_stores_much_real(&plan->robot, start);
    chain.max_phases = max_phases;
    chain.phases = phases;
    chain.capacity = capacity;
    return chain;
}

/* Put a stance that has come to its ending into its record. */
static inline int32_t stance_report_real(const stance_chain_real *chain, const hopform_state_real *start,
                                         int32_t ending, hopform_stance_real *stance)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const hopform_state_real *end = &chain->state;
    const hopform_at_real at = {end->x1, end->v1, end->v2, end->y};
    stance->duration = chain->t;
    stance->end = *end;
    stance->aed = chain->adds_up ? chain->aed : hopform_body_energy_gain_real(robot, start, &at);
    stance->start_loss = chain->start_loss;
    stance->ending = ending;
    stance->phase_count = chain->count;
    stance->event_count = chain->event_count;
    stance->phases_kept = chain->count < chain->capacity ? chain->count : chain->capacity;
    stance->apex = 0.0;
    if (ending == HOPFORM_ENDING_TAKEOFF && hopform_fall_of_real(robot) > 0.0) {
        stance->apex = hopform_apex_of_takeoff_real(robot, end->x1, end->y, end->v2 > 0.0 ? end->v2 : 0.0);
    }
    if (!hopform_is_finite_real(stance->duration) || !hopform_is_finite_real(end->x1)
        || !hopform_is_finite_real(end->v1) || !hopform_is_finite_real(end->v2) || !hopform_is_finite_real(end->y)
        || !hopform_is_finite_real(stance->apex) || !hopform_is_finite_real(stance->aed)
        || !hopform_is_finite_real(stance->start_loss)) {
        const hopform_stance_real zero = {0};
        *stance = zero;
        return HOPFORM_ERROR_NUMBERS;
    }
    return stance->phases_kept < stance->phase_count ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK;
}

#endif
