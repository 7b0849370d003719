/* SPDX-License-Identifier: MIT-0
 *
 * One stance as a chain of phases: each is linear, has its closed form, and ends at the first of the events in
 * which a mass reverses, sticks, slips or hits a stop, or in which the spring force returns to zero.
 */
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

static bool stance_blocked_real(const stance_chain_real *chain, int side)
{
    const bool locked = !(chain->plan->robot.x1_min < chain->plan->robot.x1_max);
    return locked || (side < 0 && chain->from_min <= 0.0) || (side > 0 && chain->from_max >= 0.0);
}

/* First non-zero derivative of the free acceleration of a mass that is held. */
static real drift_of_free_real(const stance_chain_real *chain, int mass)
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
static int direction_real(const stance_chain_real *chain, int mass)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const hopform_free_real free =
        hopform_free_accelerations_real(&chain->plan->rates, &chain->state, chain->steps[chain->step].u);
    const real acceleration = chain->alone == mass ? chain->free : (mass == 1 ? free.free_1 : free.free_2);
    const real friction = mass == 1 ? robot->f1 : robot->f2;
    real goes = hopform_goes_real(acceleration, friction);
    if (!(fabs_real(acceleration) < friction) && !(fabs_real(goes) > 0.0)) {
        const real drift = drift_of_free_real(chain, mass);
        goes = acceleration * drift >= 0.0 ? hopform_goes_real(drift, 0.0) : 0.0;
    }
    const int side = (int)goes;
    return mass == 1 && stance_blocked_real(chain, side) ? 0 : side;
}

/* Sides of the masses that are at rest; of two twice, because each may depend on what the other one does. */
static void stance_settle_real(stance_chain_real *chain, bool rests_1, bool rests_2)
{
    for (int n = 0; n < (rests_1 && rests_2 ? 2 : 1); n++) {
        chain->side_1 = rests_1 ? direction_real(chain, 1) : chain->side_1;
        chain->side_2 = rests_2 ? direction_real(chain, 2) : chain->side_2;
    }
}

/* ---- the end of a phase ---- */

/* The event functions of a phase, and what ends it in closed form. Not in it are the velocity of a mass that slips
 * alone, whose time to rest is known, and what cannot happen while v_1 and v_2 keep their signs. */
typedef struct {
    event_set_real set;
    const hopform_motion_real *motion;
    real rest_time; /* when the mass that slips alone comes to rest, or y, which rings about 0, vanishes */
    stance_end_kind_real rests;
} stance_events_real;

static void add_event_function_real(event_set_real *set, real H3, real H2, real H1, real start, real sign,
                                    stance_end_kind_real kind, int side)
{
    const event_function_real g = {{sign * H3, sign * H2, sign * H1}, sign * start, (int32_t)kind, side};
    set->function[set->count++] = g;
}

/* A held mass slips where its free acceleration leaves [-f, f]; a stop holds on its side whatever the force. */
static void add_thresholds_real(const stance_chain_real *chain, stance_events_real *events, int mass)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const hopform_rates_real *rates = &chain->plan->rates;
    const hopform_free_real at_rest =
        hopform_free_accelerations_real(rates, &chain->state, chain->steps[chain->step].u);
    const hopform_numerator_real h = mass == 1 ? hopform_free_numerator_1_real(rates, events->motion)
                                               : hopform_free_numerator_2_real(rates, events->motion);
    const real acceleration = mass == 1 ? at_rest.free_1 : at_rest.free_2;
    const real friction = mass == 1 ? robot->f1 : robot->f2;
    const int towards = hopform_side_of_slip_real(rates, chain->side_1, chain->side_2);
    for (int side = -1; side <= 1; side += 2) {
        if (side == -towards || (mass == 1 && stance_blocked_real(chain, side))) {
            continue;
        }
        const real sign = (real)side;
        const event_function_real g = {{-sign * h.H3, -sign * h.H2, -sign * h.H1},
                                       friction - sign * acceleration,
                                       (int32_t)(mass == 1 ? END_THRESHOLD_1_real : END_THRESHOLD_2_real),
                                       side};
        events->set.function[events->set.count++] = g;
    }
}

/* Where one mass is held and the forces on the other one cancel at y = 0, y rings about 0 as a velocity does: its first
 * zero is known however far it has faded by then. */
static bool rings_about_zero_real(const stance_chain_real *chain)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const hopform_state_real slack = {0.0, 0.0, 0.0, 0.0};
    if ((chain->side_1 != 0 && chain->side_2 != 0) || chain->state.y < 0.0) {
        return false;
    }
    const hopform_free_real free =
        hopform_free_accelerations_real(&chain->plan->rates, &slack, chain->steps[chain->step].u);
    const real left = chain->side_2 == 0 ? free.free_1 - (real)chain->side_1 * robot->f1
                                         : free.free_2 - (real)chain->side_2 * robot->f2;
    return !(fabs_real(left) > 0.0);
}

static void put_events_real(stance_events_real *events, const stance_chain_real *chain, const hopform_poles_real *poles,
                            const hopform_motion_real *motion)
{
    const hopform_state_real *state = &chain->state;
    event_set_real *set = &events->set;
    set->poles = poles;
    set->node = hopform_node_of_real(chain->plan, chain->side_1, chain->side_2);
    set->count = 0;
    events->motion = motion;
    events->rest_time = HOPFORM_NEVER_real;
    events->rests = STANCE_END_LIMIT_real;
    const bool alone = chain->side_1 == 0 || chain->side_2 == 0;
    const bool rings = HOPFORM_CONTACT_IS_COMPRESSION && alone && rings_about_zero_real(chain);
    const bool may_fall = chain->side_1 < 0 || chain->side_2 > 0 || state->y < 0.0; /* else y rises, from 0 or above */
    if (!rings && (may_fall || !HOPFORM_CONTACT_IS_COMPRESSION)) {
        const hopform_numerator_real leg = hopform_contact_numerator_real(&chain->plan->robot, motion);
        add_event_function_real(set, leg.H3, leg.H2, leg.H1, hopform_contact_of_real(&chain->plan->robot, state), 1.0,
                                END_TAKEOFF_real, 0);
    }
    if (chain->side_1 == 0) {
        const real sign = (real)chain->side_2;
        add_thresholds_real(chain, events, 1);
        events->rest_time = time_to_rest_real(poles, sign * state->v2, sign * motion->H3_2);
        events->rests = END_VELOCITY_2_real;
    } else if (chain->side_2 == 0) {
        const real sign = (real)chain->side_1;
        add_thresholds_real(chain, events, 2);
        events->rest_time = time_to_rest_real(poles, sign * state->v1, sign * motion->H3_1);
        events->rests = END_VELOCITY_1_real;
    } else {
        add_event_function_real(set, chain->fresh_1 ? 0.0 : motion->H3_1, motion->H2_1, motion->H1_1, state->v1,
                                (real)chain->side_1, END_VELOCITY_1_real, 0);
        add_event_function_real(set, chain->fresh_2 ? 0.0 : motion->H3_2, motion->H2_2, motion->H1_2, state->v2,
                                (real)chain->side_2, END_VELOCITY_2_real, 0);
    }
    const real lift = rings ? time_to_rest_real(poles, state->y, state->v1 - state->v2) : HOPFORM_NEVER_real;
    if (rings && lift <= events->rest_time) {
        events->rest_time = lift;
        events->rests = END_TAKEOFF_real;
    }
}

static bool is_takeoff_real(const event_set_real *set, int32_t found)
{
    return found >= 0 && set->function[found].kind == END_TAKEOFF_real;
}

/* The state that a phase starts from, x_1 counted from the stop ahead. */
static hopform_state_real from_stop_real(const stance_chain_real *chain)
{
    hopform_state_real start = chain->state;
    start.x1 = chain->side_1 > 0 ? chain->from_max : chain->from_min;
    return start;
}

/* The stop ahead, which x_1, monotone within a phase, has met if it is beyond it at the end of an interval, and does
 * not just touch: the interval ends there. */
static bool meets_stop_real(const stance_chain_real *chain, const stance_events_real *events, propagator_real *end)
{
    const real sign = (real)chain->side_1;
    const hopform_state_real start = from_stop_real(chain);
    if (chain->side_1 == 0 || !hopform_is_finite_real(start.x1)) {
        return false;
    }
    propagator_real at = *end;
    if (!is_beyond_stop_real(events->motion, &start, sign, &at.basis)) {
        return false;
    }
    const hopform_poles_real *poles = events->set.poles;
    real low = 0.0;
    real high = end->t;
    for (int n = 0; n < 100; n++) {
        const approach_real to = approach_of_real(poles, events->motion, &start, sign, &at.basis);
        const root_step_real step = step_to_stop_real(poles, &to, at.t, low, high);
        if (step.arrives) {
            break;
        }
        if (step.lands) {
            const hopform_basis_real carried = carried_basis_real(poles, &at.basis, step.next - at.t);
            at = propagator_of_real(poles, step.next, &carried);
            break;
        }
        low = step.low;
        high = step.high;
        const real next = step.inside && !(n > 8 && n % 2 == 1) ? step.next : low + 0.5 * (high - low);
        if (!(next > low && next < high)) {
            break;
        }
        at = propagator_at_real(poles, next);
    }
    *end = at;
    return true;
}

/* At the time of the limit a take-off comes before it, and before mass 2 comes to rest what mass 1 does. */
static void cross_at_the_limit_real(const stance_events_real *events, real limit, interval_real *in)
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

/* What ends the phase at the end of its last interval. */
static stance_phase_end_real end_of_real(const stance_events_real *events, const interval_real *in, bool stops,
                                         real limit)
{
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
    return result;
}

/* A take-off late in a phase: its time with all its digits. True if it comes later, so that something else may come
 * first. */
static bool sharpen_takeoff_real(const stance_chain_real *chain, const stance_events_real *events, real limit,
                                 interval_real *in)
{
    const event_set_real *set = &events->set;
    const int32_t found = in->found;
    if (!is_takeoff_real(set, found) || !(fabs_real(in->high.basis.Wdd) < 0.25)) {
        return false;
    }
    const event_function_real *leg = &set->function[found];
    const hopform_state_real slack = {0.0, 0.0, 0.0, 0.0};
    const hopform_motion_real from_slack =
        hopform_motion_of_real(chain->plan, &slack, chain->steps[chain->step].u, chain->side_1, chain->side_2);
    const hopform_state_real steady = {0.0, 0.0, 0.0,
                                       hopform_settled_y_real(set->poles, from_slack.H2_y, from_slack.H1_y)};
    const real settled = hopform_contact_of_real(&chain->plan->robot, &steady);
    const real before = in->high.t;
    for (int n = 0; n < 4; n++) {
        const real later =
            steady_state_correction_real(set->poles, &leg->numerator, leg->start, settled, &in->high.basis, in->high.t);
        if (!(fabs_real(later) > 0.0) || in->high.t + later > limit) {
            break;
        }
        end_interval_at_real(set, in, in->high.t + later);
        in->found = found;
    }
    return in->high.t > before;
}

/* The far end of the next interval: less than half a period of the pair away, and not so far that all has faded. */
static void reach_ahead_real(const event_set_real *set, interval_real *in, real limit)
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

/* The first event of the phase that starts at the chain's state. */
static stance_phase_end_real stance_find_end_real(const stance_chain_real *chain, const hopform_poles_real *poles,
                                                  const hopform_motion_real *motion, real until)
{
    const hopform_basis_real start = {1.0, 0.0, 0.0, 0.0, 0.0};
    if (chain->side_1 == 0 && chain->side_2 == 0) {
        const stance_phase_end_real result = {until, STANCE_END_LIMIT_real, 0, start, 0.0};
        return result;
    }
    stance_events_real events;
    put_events_real(&events, chain, poles, motion);
    const event_set_real *set = &events.set;
    const real limit = events.rest_time < until ? events.rest_time : until;
    interval_real in;
    in.low = 0.0;
    in.high = propagator_of_real(poles, 0.0, &start);
    for (int32_t n = 0; n < set->count; n++) {
        in.from[n] = jet_at_start_real(poles, &set->function[n]);
    }
    in.found = lost_at_once_real(set, &in);
    in.count = 0;
    bool stops = false;
    bool certified = true;
    for (int32_t intervals = 1; in.found < 0 && !stops && certified && in.high.t < limit; intervals++) {
        if (intervals > 1) {
            begin_interval_real(set, &in);
        }
        const real quiet = intervals > 1 ? quiet_until_real(set, &in) : 0.0;
        if (quiet > in.low + 2.0 * set->node->t) {
            end_interval_at_real(set, &in, quiet < limit ? quiet : limit);
        } else {
            reach_ahead_real(set, &in, limit);
            bool later = true; /* once at most, and then what else happens by then is looked at */
            for (int n = 0; n < 2 && later && certified; n++) {
                certified = find_first_root_real(set, &in);
                cross_at_the_limit_real(&events, limit, &in);
                later = n == 0 && sharpen_takeoff_real(chain, &events, limit, &in);
            }
        }
        const real t = in.high.t;
        stops = certified && meets_stop_real(chain, &events, &in.high)
                && !(is_takeoff_real(set, in.found) && t <= in.high.t * (1.0 + 8.0 * HOPFORM_EPS_real));
    }
    if (!certified) {
        const propagator_real last = propagator_at_real(poles, in.low);
        const stance_phase_end_real result = {in.low, END_UNCERTIFIED_real, 0, last.basis, 0.0};
        return result;
    }
    stance_phase_end_real result = end_of_real(&events, &in, stops, limit);
    if (result.kind == END_VELOCITY_1_real) {
        const hopform_state_real ahead = from_stop_real(chain);
        result.touch = hopform_is_finite_real(ahead.x1) ? grazing_tolerance_real(motion, &ahead, &in.high.basis) : 0.0;
    }
    return result;
}

/* ---- the chain ---- */

static void stance_record_real(stance_chain_real *chain, int event)
{
    if (chain->count < chain->capacity) {
        hopform_phase_real *phase = &chain->phases[chain->count];
        phase->t = chain->t;
        phase->x1 = chain->state.x1;
        phase->v1 = chain->state.v1;
        phase->v2 = chain->state.v2;
        phase->y = chain->state.y;
        phase->mode = (int8_t)(3 * (chain->side_1 + 1) + chain->side_2 + 1);
        phase->event = (int8_t)event;
        phase->step = (uint16_t)chain->step;
    }
    if (event != HOPFORM_EVENT_NONE && chain->count < chain->max_phases && chain->event_count < chain->count) {
        chain->event_count++;
    }
    chain->event = event;
    chain->count++;
}

static void after_rest_real(stance_chain_real *chain, int mass, int side_before, int event_if_it_sticks,
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
static void end_of_velocity_1_real(stance_chain_real *chain, const stance_phase_end_real *end)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const int before = chain->side_1;
    const real stop = before > 0 ? robot->x1_max : robot->x1_min;
    const real gap = before > 0 ? chain->from_max : chain->from_min;
    const bool hits = end->kind == STANCE_END_STOP_real;
    chain->state.v1 = 0.0; /* inelastic */
    if (hits || fabs_real(gap) <= end->touch) {
        chain->state.x1 = stop;
        chain->from_min = stop - robot->x1_min;
        chain->from_max = stop - robot->x1_max;
    }
    after_rest_real(chain, 1, before, hits ? HOPFORM_EVENT_X1_HITS_STOP : HOPFORM_EVENT_X1_STICKS,
                    hits ? HOPFORM_EVENT_X1_HITS_STOP : HOPFORM_EVENT_X1_REVERSES);
}

/* The current takes its next value: what is held may begin to slip. */
static void next_step_real(stance_chain_real *chain)
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
 * them is its acceleration before, told by the motion where that has faded.
 */
static void keep_faint_acceleration_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                         const hopform_basis_real *basis)
{
    const hopform_rates_real *rates = &chain->plan->rates;
    if (chain->plan->robot.f1 > 0.0 || fabs_real(rates->a1_v1) > 0.0) {
        return;
    }
    const hopform_free_real at_rest =
        hopform_free_accelerations_real(rates, &chain->state, chain->steps[chain->step].u);
    if (!hopform_is_faint_real(rates, &chain->state, at_rest.free_1)) {
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
static void keep_free_acceleration_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                        const stance_phase_end_real *end)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    chain->alone = 0;
    if (end->kind == END_VELOCITY_1_real && chain->side_2 == 0) {
        chain->alone = 1;
        chain->free =
            hopform_free_after_motion_real((real)chain->side_1, robot->f1, motion->H3_1, motion->H2_1, &end->basis);
    } else if (end->kind == END_VELOCITY_2_real && chain->side_1 == 0) {
        chain->alone = 2;
        chain->free =
            hopform_free_after_motion_real((real)chain->side_2, robot->f2, motion->H3_2, motion->H2_2, &end->basis);
    } else if ((end->kind == END_VELOCITY_1_real || end->kind == STANCE_END_STOP_real) && chain->side_2 != 0) {
        keep_faint_acceleration_real(chain, motion, &end->basis);
    }
}

/* How far from its stops the actuator is at the end of a phase. */
static void keep_distances_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                const stance_phase_end_real *end)
{
    if (chain->side_1 != 0) {
        hopform_state_real start = chain->state;
        start.x1 = 0.0;
        const hopform_at_real moved = hopform_state_at_real(&start, motion, &end->basis);
        chain->from_min += moved.x1_t;
        chain->from_max += moved.x1_t;
    }
}

/* The numerators of the next phase. */
static hopform_motion_real motion_from_real(const stance_chain_real *chain)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    hopform_motion_real motion =
        hopform_motion_of_real(chain->plan, &chain->state, chain->steps[chain->step].u, chain->side_1, chain->side_2);
    if (chain->alone == 1 && chain->side_1 != 0) {
        hopform_go_on_real(&motion, 1, chain->side_2 == 0, chain->free - (real)chain->side_1 * robot->f1);
    } else if (chain->alone == 2 && chain->side_2 != 0) {
        hopform_go_on_real(&motion, 2, true, chain->free - (real)chain->side_2 * robot->f2);
    }
    return motion;
}

/* The AED of a phase that lasts for t. */
static real aed_in_phase_real(const stance_chain_real *chain, real t)
{
    const hopform_state_real *state = &chain->state;
    const hopform_phase_real phase = {
        0.0, state->x1, state->v1, state->v2, state->y, (int8_t)(3 * (chain->side_1 + 1) + chain->side_2 + 1), 0, 0};
    const hopform_ledger_real ledger =
        hopform_ledger_in_phase_real(chain->plan, &phase, chain->steps[chain->step].u, t);
    return hopform_aed_of_ledger_real(&ledger);
}

/* The state and modes right after the end of a phase, recorded as the next phase. */
static void stance_pass_real(stance_chain_real *chain, const hopform_motion_real *motion,
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

static bool last_step_real(const stance_chain_real *chain)
{
    return chain->step + 1 >= chain->step_count;
}

/* The leg leaves the ground at once: it pulls, or its contact force is 0 and the first non-zero derivative of that is
 * negative. */
static bool leaves_at_once_real(const stance_chain_real *chain)
{
    const real contact = hopform_contact_of_real(&chain->plan->robot, &chain->state);
    if (fabs_real(contact) > 0.0 || (HOPFORM_CONTACT_IS_COMPRESSION && chain->state.v1 > chain->state.v2)) {
        return contact < 0.0;
    }
    const hopform_motion_real motion =
        hopform_motion_of_real(chain->plan, &chain->state, chain->steps[chain->step].u, chain->side_1, chain->side_2);
    const hopform_numerator_real leg = hopform_contact_numerator_real(&chain->plan->robot, &motion);
    const real first = fabs_real(leg.H3) > 0.0 ? leg.H3 : leg.H2;
    return fabs_real(first) > 0.0 ? first < 0.0 : leg.H1 < 0.0;
}

/* What each mass does at the start; no event. */
static void stance_begin_real(stance_chain_real *chain)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    chain->side_1 = (int)hopform_goes_real(chain->state.v1, 0.0);
    chain->side_2 = (int)hopform_goes_real(chain->state.v2, 0.0);
    if (chain->side_1 != 0 && stance_blocked_real(chain, chain->side_1)) {
        chain->start_loss = -0.5 * robot->m_eff * chain->state.v1 * chain->state.v1;
        chain->state.v1 = 0.0;
        chain->side_1 = 0;
    }
    stance_settle_real(chain, chain->side_1 == 0, chain->side_2 == 0);
    stance_record_real(chain, HOPFORM_EVENT_NONE);
}

/* Show the phase that has come to its end to who follows the stance. */
static void show_phase_real(const stance_chain_real *chain, const hopform_motion_real *motion,
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
static void show_ending_real(const stance_chain_real *chain)
{
    const hopform_basis_real now = {1.0, 0.0, 0.0, 0.0, 0.0};
    const hopform_motion_real motion = motion_from_real(chain);
    show_phase_real(chain, &motion, &chain->state, 0.0, &now);
}

static int32_t stance_run_real(stance_chain_real *chain)
{
    stance_begin_real(chain);
    if (leaves_at_once_real(chain)) {
        return HOPFORM_ENDING_TAKEOFF;
    }
    while (chain->count <= chain->max_phases) {
        if (chain->side_1 == 0 && chain->side_2 == 0 && last_step_real(chain)) {
            show_ending_real(chain);
            return HOPFORM_ENDING_REST;
        }
        const real until = chain->step + 1 >= chain->step_count || chain->steps[chain->step + 1].t > chain->horizon
                               ? chain->horizon
                               : chain->steps[chain->step + 1].t;
        const hopform_poles_real *poles = hopform_poles_of_real(chain->plan, chain->side_1, chain->side_2);
        const hopform_motion_real motion = motion_from_real(chain);
        const stance_phase_end_real end = stance_find_end_real(chain, poles, &motion, until - chain->t);
        chain->aed += chain->adds_up ? aed_in_phase_real(chain, end.t) : 0.0;
        keep_distances_real(chain, &motion, &end);
        const hopform_state_real start = chain->state;
        chain->state = hopform_arrive_real(&start, &motion, &end.basis, chain->side_1, chain->side_2);
        show_phase_real(chain, &motion, &start, end.t, &end.basis);
        chain->t = end.kind == STANCE_END_LIMIT_real ? until : chain->t + end.t;
        if (end.kind == END_TAKEOFF_real) {
            chain->state.y = HOPFORM_CONTACT_IS_COMPRESSION ? 0.0 : chain->state.y;
            return HOPFORM_ENDING_TAKEOFF;
        }
        if (end.kind == STANCE_END_LIMIT_real && !(until < chain->horizon)) {
            return HOPFORM_ENDING_HORIZON;
        }
        if (end.kind == END_UNCERTIFIED_real) {
            return HOPFORM_ENDING_UNCERTIFIED;
        }
        stance_pass_real(chain, &motion, &end);
        if (!HOPFORM_CONTACT_IS_COMPRESSION && end.kind == STANCE_END_STOP_real
            && hopform_contact_of_real(&chain->plan->robot, &chain->state) < 0.0) {
            show_ending_real(chain); /* what v_1 has lost at the stop was in the contact force */
            return HOPFORM_ENDING_TAKEOFF;
        }
    }
    chain->count = chain->max_phases; /* a step of the current may have begun two */
    return HOPFORM_ENDING_TOO_MANY_PHASES;
}

/* ---- what users call ---- */

static bool steps_are_sound_real(const hopform_step_real *steps, int32_t count)
{
    if (count < 1 || count > HOPFORM_MOST_STEPS || fabs_real(steps[0].t) > 0.0) {
        return false;
    }
    for (int32_t n = 0; n < count; n++) {
        if (!hopform_is_finite_real(steps[n].t) || !hopform_is_finite_real(steps[n].u)
            || (n > 0 && !(steps[n].t > steps[n - 1].t))) {
            return false;
        }
    }
    return true;
}

/* Whether what a stance is solved into holds some of what is read until its end. */
static bool stance_overwrites_inputs_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                          int32_t step_count, const hopform_phase_real *phases, int32_t capacity,
                                          const hopform_stance_real *stance)
{
    const hopform_memory_real read[] = {
        hopform_array_real(plan, 1, sizeof *plan),
        hopform_array_real(steps, step_count <= HOPFORM_MOST_STEPS ? step_count : 0, sizeof *steps),
    };
    const hopform_memory_real written[] = {
        hopform_array_real(phases, capacity, sizeof *phases),
        hopform_array_real(stance, 1, sizeof *stance),
    };
    return hopform_overlap_real(written, 2, read, 2);
}

static int32_t start_status_real(const hopform_robot_real *robot, const hopform_state_real *start)
{
    if (!hopform_is_finite_real(start->x1) || !hopform_is_finite_real(start->v1) || !hopform_is_finite_real(start->v2)
        || !hopform_is_finite_real(start->y) || !(start->x1 >= robot->x1_min && start->x1 <= robot->x1_max)) {
        return HOPFORM_ERROR_STATE;
    }
    return start->y < 0.0 ? HOPFORM_ERROR_EXTENDED : HOPFORM_OK;
}

static void stance_report_real(const stance_chain_real *chain, const hopform_state_real *start, int32_t ending,
                               hopform_stance_real *stance)
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
    if (ending == HOPFORM_ENDING_TAKEOFF && robot->g > 0.0) {
        stance->apex = hopform_apex_of_takeoff_real(robot, end->x1, end->y, end->v2 > 0.0 ? end->v2 : 0.0);
    }
}

/* The node lies at nearly half a period where the pair is not damped, sooner where it is: at 0.95 pi/sqrt(q). */
static hopform_node_real node_of_poles_real(const hopform_poles_real *poles)
{
    const bool draws = poles->q > HOPFORM_UNDERFLOW_real; /* else the node is never reached */
    const real t = draws ? 2.984 / sqrt_real(poles->q) : HOPFORM_NEVER_real;
    const hopform_basis_real basis = hopform_basis_at_real(poles, draws ? t : 0.0);
    const real mu = 0.5 * poles->p;
    const real square = mu * mu - poles->q;
    hopform_node_real node = {HOPFORM_NEVER_real, HOPFORM_NEVER_real, poles->a, 0.0,      0.0,     t,
                              basis.Wdd,          basis.Wd,           basis.W,  basis.W1, basis.W2};
    if (square < 0.0) {
        node.half_period = 3.14159265358979323846 / sqrt_real(-square);
        node.fades = poles->a > 0.0 && mu > poles->a ? 10.0 / (mu - poles->a) : HOPFORM_NEVER_real;
    } else {
        const real fast = mu + sqrt_real(square);
        const real slow = fast > 0.0 ? poles->q / fast : 0.0;
        node.pole = hopform_greater_real(poles->a, fast);
        node.second = hopform_lesser_real(fast, hopform_greater_real(poles->a, slow));
        node.third = hopform_lesser_real(poles->a, slow);
    }
    return node;
}

/* Fill a plan from its robot. */
static int32_t fill_plan_real(hopform_plan_real *plan)
{
    const hopform_robot_real *robot = &plan->robot;
#define OR_OUTSIDE(name, domain) || !HOPFORM_IN_##domain##_real(robot->name)
    if (!(robot->x1_min <= robot->x1_max) HOPFORM_ROBOT_MEMBERS(OR_OUTSIDE)) {
#undef OR_OUTSIDE
        return HOPFORM_ERROR_ROBOT;
    }
    const real lighter = robot->m_eff < robot->m_s ? robot->m_eff : robot->m_s;
    if (!(lighter * lighter > 0.0)) { /* derivatives by the masses divide by their squares */
        return HOPFORM_ERROR_NUMBERS;
    }
    const hopform_rates_real rates = hopform_rates_of_real(robot);
#define REFUSE_IF_NEGATIVE(value)                                                                                      \
    if ((value) < 0.0) {                                                                                               \
        return HOPFORM_ERROR_UNSTABLE;                                                                                 \
    }
    HOPFORM_STABILITY(REFUSE_IF_NEGATIVE)
#undef REFUSE_IF_NEGATIVE
    const hopform_poles_real actuator = {0.0, rates.p_1, rates.q_1, rates.p_1, rates.q_1, 0.0};
    const hopform_poles_real body = {0.0, rates.p_2, rates.q_2, rates.p_2, rates.q_2, 0.0};
    const hopform_poles_real both = hopform_factor_cubic_real(rates.s_1, rates.s_2, rates.s_3);
    if (!hopform_is_finite_real(rates.s_1 * rates.s_1) /* discriminants square it */
        || !hopform_is_finite_real(rates.s_2) || !hopform_is_finite_real(rates.s_3) || !hopform_is_finite_real(both.a)
        || !hopform_is_finite_real(both.p) || !(both.q > 0.0 && both.q <= HOPFORM_NEVER_real)
        || !hopform_is_finite_real(rates.a1_0) || !hopform_is_finite_real(rates.a1_u)) {
        return HOPFORM_ERROR_NUMBERS;
    }
    plan->rates = rates;
    plan->both = both;
    plan->actuator = actuator;
    plan->body = body;
    plan->node_both = node_of_poles_real(&both);
    plan->node_actuator = node_of_poles_real(&actuator);
    plan->node_body = node_of_poles_real(&body);
    plan->made = HOPFORM_PLAN_MADE;
    return HOPFORM_OK;
}

int32_t hopform_plan_init_real(hopform_plan_real *plan, const hopform_robot_real *robot)
{
    if (plan == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const hopform_robot_real none = {0};
    const hopform_plan_real zero = {0};
    const hopform_robot_real own = robot != NULL ? *robot : none; /* it may lie in the plan */
    plan->made = 0;
    plan->robot = own;
    const int32_t status = robot != NULL ? fill_plan_real(plan) : HOPFORM_ERROR_NULL;
    if (status < 0) {
        *plan = zero;
    }
    return status;
}

int32_t hopform_solve_stance_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                  const hopform_step_real *steps, int32_t step_count, real horizon, int32_t max_phases,
                                  hopform_phase_real *phases, int32_t capacity, hopform_stance_real *stance)
{
    return hopform_solve_followed_real(plan, start, steps, step_count, horizon, max_phases, phases, capacity, stance,
                                       NULL, NULL);
}

int32_t hopform_solve_followed_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                    const hopform_step_real *steps, int32_t step_count, real horizon,
                                    int32_t max_phases, hopform_phase_real *phases, int32_t capacity,
                                    hopform_stance_real *stance, hopform_follow_real *follow, hopform_tally_real *tally)
{
    if (stance == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const hopform_state_real nothing = {0.0, 0.0, 0.0, 0.0};
    const hopform_state_real from = start != NULL ? *start : nothing; /* it may lie in the stance or in the phases */
    const hopform_stance_real zero = {0};
    *stance = zero;
    if (plan == NULL || start == NULL || steps == NULL || (phases == NULL && capacity > 0)) {
        return HOPFORM_ERROR_NULL;
    }
    if (stance_overwrites_inputs_real(plan, steps, step_count, phases, capacity, stance)) {
        return HOPFORM_ERROR_OVERLAP;
    }
    if (!hopform_is_made_real(plan)) {
        return HOPFORM_ERROR_ROBOT;
    }
    const int32_t status = start_status_real(&plan->robot, &from);
    if (status < 0) {
        return status;
    }
    if (!steps_are_sound_real(steps, step_count)) {
        return HOPFORM_ERROR_STEPS;
    }
    if (!(horizon > 0.0 && horizon <= HOPFORM_NEVER_real) || max_phases < 1 || capacity < 0) {
        return HOPFORM_ERROR_HORIZON;
    }
    stance_chain_real chain = {plan,
                               steps,
                               step_count,
                               0,
                               horizon,
                               0.0,
                               from,
                               from.x1 - plan->robot.x1_min,
                               from.x1 - plan->robot.x1_max,
                               0,
                               0,
                               false,
                               false,
                               0,
                               0.0,
                               0.0,
                               hopform_stores_much_real(&plan->robot, &from),
                               0.0,
                               max_phases,
                               phases,
                               capacity,
                               0,
                               0,
                               HOPFORM_EVENT_NONE,
                               follow,
                               tally};
    const int32_t ending = stance_run_real(&chain);
    stance_report_real(&chain, &from, ending, stance);
    if (!hopform_is_finite_real(stance->duration) || !hopform_is_finite_real(stance->end.x1)
        || !hopform_is_finite_real(stance->end.v1) || !hopform_is_finite_real(stance->end.v2)
        || !hopform_is_finite_real(stance->end.y) || !hopform_is_finite_real(stance->apex)
        || !hopform_is_finite_real(stance->aed) || !hopform_is_finite_real(stance->start_loss)) {
        *stance = zero;
        return HOPFORM_ERROR_NUMBERS;
    }
    return stance->phases_kept < stance->phase_count ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK;
}

/* The state at a time, and the status; a refusal writes no state. */
static int32_t read_state_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                               const hopform_phase_real *phases, const hopform_stance_real *stance, real t,
                               hopform_state_real *state)
{
    if (plan == NULL || steps == NULL || phases == NULL || stance == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const bool rests = stance->ending == HOPFORM_ENDING_REST;
    if (!hopform_is_made_real(plan)) {
        return HOPFORM_ERROR_ROBOT;
    }
    if (!(t >= 0.0 && t <= HOPFORM_NEVER_real) || (t > stance->duration && !rests)
        || stance->phases_kept < stance->phase_count || stance->phases_kept < 1) {
        return HOPFORM_ERROR_TIME;
    }
    const real within = t < stance->duration ? t : stance->duration;
    const hopform_phase_real *phase = &phases[hopform_phase_index_real(phases, stance->phases_kept, within)];
    *state = hopform_state_in_phase_real(plan, phase, steps[phase->step].u, within - phase->t);
    return HOPFORM_OK;
}

int32_t hopform_stance_at_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                               const hopform_phase_real *phases, const hopform_stance_real *stance, real t,
                               hopform_state_real *state)
{
    if (state == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    hopform_state_real found = {0.0, 0.0, 0.0, 0.0}; /* the state may lie in what is read */
    const int32_t status = read_state_real(plan, steps, phases, stance, t, &found);
    *state = found;
    return status;
}
