/* SPDX-License-Identifier: MIT-0
 *
 * One candidate current, followed while its stance is solved: the apex, the largest position, by how little the upper
 * stop is hit, the least minimum of the contact force, and how each of them changes with the current, through the
 * events.
 *
 * A phase is linear, so its change d_z with u obeys the equations of motion without friction, weight and offset, under
 * the acceleration that 1 A gives: it is a motion in the same mode, and is carried like one, by its rates in a few
 * short steps, or in the coordinate of what slips alone. Extrema of the position and of the contact force move to first
 * order as if their time stood still; where they jump, at a stop, the time counts.
 */
#ifndef HOPFORM_TRIAL_H_real
#define HOPFORM_TRIAL_H_real

#include "alone_real.h"
#include "extrema_real.h"

/* What is gathered along the phases of a stance. */
struct current_variation_real {
    const hopform_plan_real *plan;
    hopform_trial_real *trial;
    evaluations_real *evaluations; /* of its stance */
    state_by_axis_real change;     /* of the state at a fixed time, per A */
    state_by_axis_real arrived;    /* at the end of the last phase, before its event */
    state_by_axis_real speed;      /* z' there */
    row_real mode;                 /* of the last phase */
    bool moves;                    /* the element that the current drives has */
    real late;                     /* how much later the last event comes, per A; 0 before the first */
};

/* A maximum of the position: where its element starts, reverses, sticks, stops or lifts off. */
static inline void note_largest_real(hopform_trial_real *trial, real position, real change) {
    if (position > trial->largest_x1) {
        trial->largest_x1 = position;
        trial->largest_x1_u = change;
    }
}

/* A minimum of the contact force before the ending, where a little less of it would have been a take-off. */
static inline void note_minimum_real(hopform_trial_real *trial, real contact, real change, uint32_t count) {
    if (contact < trial->least_contact) {
        trial->least_contact = contact;
        trial->least_contact_u = change;
    }
    trial->minima = (uint8_t)(trial->minima + count < 255 ? trial->minima + count : 255);
}

/* The change of the state at an event that comes `late`r. */
static inline state_by_axis_real change_at_event_real(const state_by_axis_real *change, const state_by_axis_real *speed,
                                                      real late) {
    state_by_axis_real met = *change;
    UNROLLED_real for (int axis = 0; axis < HOPFORM_AXES; axis++) {
        met.of[axis] += speed->of[axis] * late;
    }
    return met;
}

/* The upper stop is hit: how far the position is from staying off it. It does where its velocity there vanishes, or
 * where the take-off comes before, the contact force being zero: the lesser of that and of the height from which a mass
 * falls as fast; smooth, as the position at rest is. `met` is the change of the state at the event, whose time moves.
 */
static inline void note_hit_real(const current_variation_real *variation, const state_by_axis_real *met) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const real *at = variation->arrived.of;
    const int velocity = HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT);
    const real height = 0.5 * at[velocity] * at[velocity] / fall_of_real(robot);
    const real contact = contact_of_real(robot, &variation->arrived.named);
    const bool slow = height < contact;
    const real change =
        slow ? at[velocity] * met->of[velocity] / fall_of_real(robot) : contact_slope_real(robot, &met->named);
    note_largest_real(variation->trial, at[HOPFORM_POSITION_AXIS] + (slow ? height : contact), change);
}

/* Whether the compression falls where nothing moves yet. */
static inline bool contact_unloads_real(row_real mode) {
    return falls_of_mode_real(mode) && !rises_of_mode_real(mode);
}

/* Whether the contact force, which fell before the event between two phases, falls no more after it. Where nothing
 * moves at the event, the sides before and after decide, and not what rounding leaves of the velocities. */
static inline bool turns_up_real(const current_variation_real *variation, const solved_phase_real *now,
                                 real rate_after) {
    const real rate = contact_slope_real(&variation->plan->robot, &variation->speed.named);
    const bool jumps = now->event == HOPFORM_EVENT_HITS_STOP;
    bool moves = !HOPFORM_CONTACT_IS_STRETCH;
    for (int element = 0; element < HOPFORM_ELEMENTS; element++) {
        moves = moves || fabs_real(now->start->of[HOPFORM_VELOCITY_AXIS(element)]) > 0.0;
    }
    if (moves) { return (rate < 0.0 || (jumps && !HOPFORM_CONTACT_IS_STRETCH)) && !(rate_after < 0.0); }
    return contact_unloads_real(variation->mode) && !contact_unloads_real(now->mode);
}

/* The change per A right after the event with which a phase begins, and the extrema there. Its time does not move in
 * proportion to u where the rate that vanishes is 0. */
static inline void pass_event_real(current_variation_real *variation, const solved_phase_real *now) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const state_by_axis_real *before = &variation->speed;
    const state_by_axis_real *after = &now->begins;
    state_by_axis_real *change = &variation->change;
    const int axis = axis_of_event_real(now->event);
    real late = 0.0;
    if (axis >= 0) {
        if (fabs_real(before->of[axis]) > 0.0) {
            late = -change->of[axis] / before->of[axis];
        } else {
            variation->trial->smooth = false;
        }
        if (axis == HOPFORM_POSITION_AXIS && before->of[axis] > 0.0) {
            const state_by_axis_real met = change_at_event_real(change, before, late);
            note_hit_real(variation, &met);
        }
        pass_event_at_axis_real(change->of, before->of, after->of, axis, 0.0, late);
    }
    const int slips = slips_at_event_real(now->event);
    if (slips >= 0 && excess_to_side_real(robot, slips, side_of_mode_real(now->mode, slips)) > 0.0) {
        const hopform_rates_real *rates = rates_in_mode_real(variation->plan, now->mode);
        const real rate = free_slope_real(rates, slips, before);
        const real by_u = slips == HOPFORM_DRIVEN_ELEMENT ? rates->a1_u : 0.0;
        if (fabs_real(rate) > 0.0) {
            late = -(free_slope_real(rates, slips, change) + by_u) / rate;
        } else {
            variation->trial->smooth = false;
        }
        pass_slip_real(change->of, slips, after->of[HOPFORM_VELOCITY_AXIS(slips)], late);
    }
    variation->late = late;
    note_largest_real(variation->trial, now->start->of[HOPFORM_POSITION_AXIS], change->of[HOPFORM_POSITION_AXIS]);
    if (turns_up_real(variation, now, contact_slope_real(robot, &after->named))) {
        const state_by_axis_real met = change_at_event_real(change, after, late);
        note_minimum_real(variation->trial, contact_of_real(robot, &now->start->named),
                          contact_slope_real(robot, &met.named), 1);
    }
}

/* ---- inside a phase ---- */

/* The acceleration that 1 A gives: under it the change goes on in a phase. */
static inline drive_by_element_real drive_per_ampere_real(const hopform_plan_real *plan, row_real mode) {
    drive_by_element_real drive = {{0.0, 0.0}};
    drive.of[HOPFORM_DRIVEN_ELEMENT] = rates_in_mode_real(plan, mode)->a1_u;
    return drive;
}

#if HOPFORM_BOTH_MOVE
/* Both elements slipping: what its rates bring, in steps that are short for all poles. */
static inline void carry_by_rates_real(const hopform_plan_real *plan, row_real mode, real t, int steps,
                                       state_by_axis_real *change) {
    const drive_by_element_real drive = drive_per_ampere_real(plan, mode);
    const real step = t / (real)steps;
    const powers_real powers = powers_over_a_node_real(&plan->poles[0], step);
    rates_by_row_real w;
    w.named = rates_of_both_real(&plan->rates[0], &drive.named, &change->named);
    for (int n = 0; n < steps; n++) {
        const derivatives_of_both_real at = derivatives_at_real(plan, &w);
        const real velocity = change->of[HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT)];
        const gained_real gained = gained_by_powers_real(plan, &at, velocity, step, &powers);
        change->of[HOPFORM_POSITION_AXIS] += gained.x;
        UNROLLED_real for (int row = 0; row < 3; row++) {
            change->of[axis_of_row_real[row]] += gained.z[row];
        }
        w = gained.w;
    }
}
#endif

/* One element slipping: in its own coordinate. From rest to rest is half a period, four times what the series of the
 * response reaches, so that it is doubled twice before exp and sin are asked. */
static inline void carry_alone_real(const hopform_plan_real *plan, row_real mode, real t, state_by_axis_real *change) {
    const int alone = alone_of_mode_real(mode);
    const hopform_rates_real *rates = rates_in_mode_real(plan, mode);
    const alone_pair_real pair = alone_pair_of_real(poles_of_real(plan, mode));
    const real draw = free_slope_real(rates, alone, change) + (alone == HOPFORM_DRIVEN_ELEMENT ? rates->a1_u : 0.0);
    const alone_real from = {0.0, 0.0, change->of[HOPFORM_VELOCITY_AXIS(alone)], draw};
    const bool is_long = !is_short_real(&pair, 0.5 * t) && is_short_real(&pair, 0.25 * t);
    known_pair_real response = response_over_real(&pair, is_long ? 0.5 * t : t);
    if (is_long) { response = response_over_twice_real(&pair, &response); }
    const alone_real there = alone_after_real(&pair, &from, t, &response);
    change->of[HOPFORM_VELOCITY_AXIS(alone)] = there.v;
    change->of[HOPFORM_STRETCH_AXIS] += (real)HOPFORM_STRETCH_FOLLOWS(rates, alone) * there.s;
    change->of[HOPFORM_POSITION_AXIS] += alone == HOPFORM_STOPPED_ELEMENT ? there.s : 0.0;
}

/* By W, where both slip for longer than a few short times. */
SELDOM_real void carry_far_real(const hopform_plan_real *plan, row_real mode, real t, state_by_axis_real *change) {
    const drive_by_element_real drive = drive_per_ampere_real(plan, mode);
    const course_real course = course_from_real(plan, mode, &change->named, &drive.named);
    change->named = state_on_course_real(&course, t);
}

/* Carry the change per A from the start of a phase to a time in it. */
static inline void carry_change_real(const hopform_plan_real *plan, row_real mode, real t, state_by_axis_real *change) {
    if (rests_of_mode_real(mode)) { return; }
    if (alone_of_mode_real(mode) >= 0) {
        carry_alone_real(plan, mode, t, change);
        return;
    }
#if HOPFORM_BOTH_MOVE
    const real step = 0.8 * plan->transition.is_short_over;
    if (t >= 0.0 && t < 4.0 * step) {
        carry_by_rates_real(plan, mode, t, 1 + (int)(t / step), change);
        return;
    }
#endif
    carry_far_real(plan, mode, t, change);
}

/* The contact force and its derivatives. */
ALWAYS_real jet_real contact_jet_real(const hopform_plan_real *plan, row_real mode, const hopform_state_real *state,
                                      const state_by_axis_real *speed) {
    const hopform_robot_real *robot = &plan->robot;
    const hopform_rates_real *rates = rates_in_mode_real(plan, mode);
    const state_by_axis_real bend = bend_in_mode_real(rates, mode, speed);
    const state_by_axis_real third = bend_in_mode_real(rates, mode, &bend);
    const jet_real jet = {contact_of_real(robot, state), contact_slope_real(robot, &speed->named),
                          contact_slope_real(robot, &bend.named), contact_slope_real(robot, &third.named)};
    return jet;
}

/* The minima of the contact force inside a phase. */
static inline void look_for_minimum_real(const current_variation_real *variation, const solved_phase_real *phase) {
    const hopform_plan_real *plan = variation->plan;
    const hopform_robot_real *robot = &plan->robot;
    const hopform_timescales_real *scales = timescales_of_real(plan, phase->mode);
    const jet_real from = contact_jet_real(plan, phase->mode, &phase->start->named, &phase->begins);
    const jet_real to = contact_jet_real(plan, phase->mode, &phase->arrived->named, &phase->ends);
    if (turns_as_seen_real(scales, &from, &to, phase->length) && !shows_minimum_real(&from, &to)) { return; }
    const course_real course = course_from_real(plan, phase->mode, &phase->start->named, &phase->drive->named);
    const numerator_real h = contact_numerator_real(robot, &course.numerators.named);
    const minima_real least =
        least_minimum_real(course.poles, scales, &h, &from, &to, phase->length, 64.0, variation->evaluations);
    if (least.count > 0) {
        state_by_axis_real there = variation->change;
        carry_change_real(plan, phase->mode, least.t, &there);
        note_minimum_real(variation->trial, least.value, contact_slope_real(robot, &there.named), least.count);
    }
}

/* Where a stance takes off without a minimum of the contact force before, that behind it, by the parabola there: how
 * far below zero the contact force would fall if the contact could pull. Where that is nothing, the stance goes on for
 * another rebound. The change has arrived at the end of the phase. */
static inline void look_behind_takeoff_real(const current_variation_real *variation, const solved_phase_real *phase) {
    const hopform_plan_real *plan = variation->plan;
    const hopform_robot_real *robot = &plan->robot;
    const hopform_rates_real *rates = rates_in_mode_real(plan, phase->mode);
    const row_real mode = phase->mode;
    const jet_real at = contact_jet_real(plan, mode, &phase->arrived->named, &phase->ends);
    if (!(at.rate < 0.0 && at.curvature > 0.0)) { return; }
    const drive_by_element_real drive = drive_per_ampere_real(plan, mode);
    state_by_axis_real speed_u;
    speed_u.rates = speeds_of_real(rates, &drive.named, (real)side_of_mode_real(mode, 0),
                                   (real)side_of_mode_real(mode, 1), &variation->change.named);
    const state_by_axis_real bend_u = bend_in_mode_real(rates, mode, &speed_u);
    const real value_u = contact_slope_real(robot, &variation->change.named);
    const real later = -at.rate / at.curvature;
    const real curvature_u = contact_slope_real(robot, &bend_u.named) - at.third * value_u / at.rate; /* and moves */
    const real change = value_u + later * (contact_slope_real(robot, &speed_u.named) + 0.5 * later * curvature_u);
    if (0.5 * later * -at.rate + fabs_real(change) <= HOPFORM_NEVER_real) {
        note_minimum_real(variation->trial, 0.5 * later * at.rate, change, 0);
    }
}

/* Follow the change through a phase, and through the event with which it began. The contact force has no minimum inside
 * where it is the compression and that keeps the sign of its rate. Before the driven element has ever moved there is
 * nothing to follow. */
static inline void carry_variation_real(current_variation_real *variation, const solved_phase_real *phase) {
    const row_real mode = phase->mode;
    if (HOPFORM_IS_EVENT(phase->event)) { pass_event_real(variation, phase); }
    variation->moves = variation->moves || side_of_mode_real(mode, HOPFORM_DRIVEN_ELEMENT) != 0;
    if (!HOPFORM_CONTACT_IS_STRETCH || stretch_may_turn_real(mode)) { look_for_minimum_real(variation, phase); }
    if (variation->moves) { carry_change_real(variation->plan, mode, phase->length, &variation->change); }
    if (phase->leaves && variation->trial->minima == 0) { look_behind_takeoff_real(variation, phase); }
    variation->arrived = *phase->arrived;
    variation->speed = phase->ends;
    variation->mode = mode;
}

/* The apex' change per A from that at take-off, whose time moves as that of what ended the stance; not smooth where the
 * contact force does not fall. A take-off at once comes under every current. */
static inline void lift_real(const current_variation_real *variation, const hopform_phase_real *phases,
                             const hopform_stance_real *stance) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const hopform_state_real *end = &stance->end;
    real late = variation->late;
    if (ended_by_real(variation->plan, phases, stance) == ENDED_BY_ROOT_real) {
        const real rate = contact_slope_real(robot, &variation->speed.named);
        if (!(fabs_real(rate) > 0.0)) {
            variation->trial->smooth = false;
            return;
        }
        late = -contact_slope_real(robot, &variation->change.named) / rate;
    }
    state_by_axis_real met = change_at_event_real(&variation->change, &variation->speed, late);
    if (HOPFORM_CONTACT_IS_STRETCH) { met.of[HOPFORM_STRETCH_AXIS] = 0.0; }
    variation->trial->apex_u = apex_slope_real(robot, end, &met.change);
    note_largest_real(variation->trial, end->x1, met.of[HOPFORM_POSITION_AXIS]);
}

/* What a stance says of its current, all of whose phases are at hand, and whose changes have been followed. `events` is
 * a hash (Fowler, Noll and Vo) of the order of modes and events, which differs where they do. */
static inline void close_trial_real(const current_variation_real *variation, const hopform_phase_real *phases,
                                    const hopform_stance_real *stance) {
    hopform_trial_real *trial = variation->trial;
    trial->takes_off = stance->ending == HOPFORM_ENDING_TAKEOFF;
    trial->events = 2166136261u;
    trial->held = true;
    for (int32_t n = 0; n < stance->phases_kept; n++) {
        trial->events = (trial->events ^ (uint32_t)(phases[n].mode + 16 * phases[n].event)) * 16777619u;
        trial->held = trial->held && side_of_mode_real(mode_of_phase_real(&phases[n]), HOPFORM_DRIVEN_ELEMENT) == 0;
    }
    if (trial->takes_off) {
        trial->apex = stance->apex;
        lift_real(variation, phases, stance);
    } else {
        note_largest_real(trial, stance->end.x1, variation->change.of[HOPFORM_POSITION_AXIS]);
    }
}

#endif
