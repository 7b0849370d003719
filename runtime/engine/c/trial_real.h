/* SPDX-License-Identifier: MIT-0
 *
 * One candidate current, followed while its stance is solved: the apex, the largest x_1, by how little the upper stop
 * is hit, the least minimum of the contact force, and how each of them changes with the current, through the events.
 *
 * A phase is linear, so its change d_z with u obeys the equations of motion without friction, weight and offset,
 * under the acceleration that 1 A gives. An event adds (z' before it - z' after it) d_tau, as in
 * sensitivity_real.inc. Extrema of x_1 and of the contact force move to first order as if their time stood still;
 * where they jump, at a stop, the time counts.
 */
#ifndef HOPFORM_TRIAL_H_real
#define HOPFORM_TRIAL_H_real

#include "extrema_real.h"
#include "facts.h"
#include "follow_real.h"

/* What is gathered along the phases of a stance. */
struct hopform_tally_real {
    const hopform_plan_real *plan;
    hopform_trial_real *trial;
    hopform_state_real change;  /* of x_1, v_1, v_2, y at a fixed time, per A */
    hopform_state_real arrived; /* at the end of the last phase, before its event */
    hopform_state_real speed;   /* x_1, v_1, v_2, y per time there */
    int side_1;                 /* of the last phase */
    int side_2;
    bool begun;
    bool moves; /* the actuator has */
};

/* A maximum of x_1: where the actuator starts, reverses, sticks, stops or lifts off. */
static inline void hopform_note_largest_real(hopform_trial_real *trial, real x1, real change)
{
    if (x1 > trial->largest_x1) {
        trial->largest_x1 = x1;
        trial->largest_x1_u = change;
    }
}

/* A minimum of the contact force before the ending, where the leg would have taken off with a little less of it. */
static inline void hopform_note_minimum_real(hopform_trial_real *trial, real contact, real change, uint32_t count)
{
    if (contact < trial->least_contact) {
        trial->least_contact = contact;
        trial->least_contact_u = change;
    }
    trial->minima = (uint8_t)(trial->minima + count < 255 ? trial->minima + count : 255);
}

/* The upper stop is hit: how far x_1 is from staying off it. It does where its velocity there vanishes, or where the
 * leg takes off before, its contact force being zero: the lesser of that and of the height from which a mass falls as
 * fast; smooth, as x_1 at rest is. `met` is the change of the state at the event, whose time moves. */
static inline void hopform_note_hit_real(const hopform_tally_real *tally, const hopform_state_real *met)
{
    const hopform_robot_real *robot = &tally->plan->robot;
    const hopform_state_real *at = &tally->arrived;
    const real height = 0.5 * at->v1 * at->v1 / hopform_fall_of_real(robot);
    const real contact = hopform_contact_of_real(robot, at);
    const bool slow = height < contact;
    const real change = slow ? at->v1 * met->v1 / hopform_fall_of_real(robot) : hopform_contact_slope_real(robot, met);
    hopform_note_largest_real(tally->trial, at->x1 + (slow ? height : contact), change);
}

/* Whether the contact force, which fell before the event between two phases, falls no more after it. Where both masses
 * stand still at the event, what they do before and after decides, and not what rounding leaves of their velocities. */
static inline bool hopform_turns_up_real(const hopform_tally_real *tally, const hopform_passage_real *now,
                                         real rate_after)
{
    const hopform_state_real *at = &now->start;
    const real rate = hopform_contact_slope_real(&tally->plan->robot, &tally->speed);
    if (!HOPFORM_CONTACT_IS_COMPRESSION || fabs_real(at->v1) > 0.0 || fabs_real(at->v2) > 0.0) {
        const bool jumps = !HOPFORM_CONTACT_IS_COMPRESSION && now->event == HOPFORM_EVENT_X1_HITS_STOP;
        return (rate < 0.0 || jumps) && !(rate_after < 0.0);
    }
    return tally->side_1 < tally->side_2 && now->side_1 >= now->side_2;
}

/* The change per A right after the event with which a phase begins, and the extrema there. Its time does not move in
 * proportion to u where the rate that vanishes is 0. */
static inline void hopform_cross_real(hopform_tally_real *tally, const hopform_passage_real *now,
                                      const hopform_state_real *after)
{
    const hopform_robot_real *robot = &tally->plan->robot;
    const hopform_state_real *before = &tally->speed;
    hopform_state_real *change = &tally->change;
    const bool stops = now->event == HOPFORM_EVENT_X1_HITS_STOP;
    const bool rests_1 = now->event == HOPFORM_EVENT_X1_REVERSES || now->event == HOPFORM_EVENT_X1_STICKS;
    const bool rests_2 = now->event == HOPFORM_EVENT_X2_REVERSES || now->event == HOPFORM_EVENT_X2_STICKS;
    const real rate = stops ? before->x1 : (rests_1 ? before->v1 : before->v2);
    const real off = stops ? change->x1 : (rests_1 ? change->v1 : change->v2);
    real late = 0.0;
    if (stops || rests_1 || rests_2) {
        if (fabs_real(rate) > 0.0) {
            late = -off / rate;
        } else {
            tally->trial->smooth = false;
        }
        if (stops && rate > 0.0) {
            const hopform_state_real met = {change->x1 + before->x1 * late, change->v1 + before->v1 * late,
                                            change->v2 + before->v2 * late, change->y + before->y * late};
            hopform_note_hit_real(tally, &met);
        }
        if (stops) { /* the only event at which more jumps than the acceleration of the mass that comes to rest */
            change->x1 = 0.0;
            change->v2 += (before->v2 - after->v2) * late;
            change->y += (before->y - after->y) * late;
        }
        if (rests_2) {
            change->v2 = -after->v2 * late;
        } else {
            change->v1 = -after->v1 * late;
        }
    }
    hopform_note_largest_real(tally->trial, now->start.x1, change->x1);
    if (hopform_turns_up_real(tally, now, hopform_contact_slope_real(robot, after))) {
        const hopform_state_real met = {0.0, change->v1 + after->v1 * late, change->v2 + after->v2 * late,
                                        change->y + after->y * late};
        hopform_note_minimum_real(tally->trial, hopform_contact_of_real(robot, &now->start),
                                  hopform_contact_slope_real(robot, &met), 1);
    }
}

/* A minimum of the contact force inside a phase. */
static inline void hopform_look_for_minimum_real(hopform_tally_real *tally, const hopform_passage_real *passage,
                                                 const hopform_motion_real *by_u)
{
    const hopform_robot_real *robot = &tally->plan->robot;
    const hopform_node_real *node = hopform_node_of_real(tally->plan, passage->side_1, passage->side_2);
    const hopform_numerator_real leg = hopform_contact_numerator_real(robot, passage->motion);
    const event_function_real contact = {
        leg.H3, leg.H2, leg.H1, 0.0, hopform_contact_of_real(robot, &passage->start), 0, 0, MAY_TURN_real};
    const propagator_real end = propagator_of_real(passage->poles, passage->length, passage->end);
    const hopform_least_real least = hopform_least_minimum_real(passage->poles, node, &contact, &end, 64.0);
    if (least.count > 0) {
        const hopform_state_real there =
            hopform_arrive_real(&tally->change, by_u, &least.basis, passage->side_1, passage->side_2);
        hopform_note_minimum_real(tally->trial, least.value, hopform_contact_slope_real(robot, &there), least.count);
    }
}

/* Follow the change through a phase, and through the event with which it began. The contact force has no minimum inside
 * where it is y and not both masses move in the same direction: y' keeps its sign. An actuator that has never moved
 * leaves nothing to follow. */
static inline void hopform_tally_up_real(hopform_tally_real *tally, const hopform_passage_real *passage)
{
    const hopform_plan_real *plan = tally->plan;
    const hopform_motion_real *motion = passage->motion;
    const hopform_basis_real *w = passage->end;
    const int side_1 = passage->side_1;
    const int side_2 = passage->side_2;
    if (tally->begun) {
        const hopform_state_real after = {passage->start.v1, motion->H3_1, motion->H3_2, motion->H3_y};
        hopform_cross_real(tally, passage, &after);
    }
    tally->moves = tally->moves || side_1 != 0;
    const bool turns = !HOPFORM_CONTACT_IS_COMPRESSION || (side_1 != 0 && side_1 == side_2);
    if (tally->moves || turns) {
        const hopform_drive_real per_ampere = {plan->rates.a1_u, 0.0};
        const hopform_motion_real by_u =
            hopform_motion_under_real(&plan->rates, &per_ampere, &tally->change, side_1, side_2);
        if (turns) {
            hopform_look_for_minimum_real(tally, passage, &by_u);
        }
        tally->change = hopform_arrive_real(&tally->change, &by_u, w, side_1, side_2);
    }
    tally->arrived = passage->arrived;
    tally->speed.x1 = passage->arrived.v1;
    tally->speed.v1 = motion->H3_1 * w->Wdd + motion->H2_1 * w->Wd + motion->H1_1 * w->W;
    tally->speed.v2 = motion->H3_2 * w->Wdd + motion->H2_2 * w->Wd + motion->H1_2 * w->W;
    tally->speed.y = motion->H3_y * w->Wdd + motion->H2_y * w->Wd + motion->H1_y * w->W;
    tally->side_1 = side_1;
    tally->side_2 = side_2;
    tally->begun = true;
}

/* The apex' change per A from that at take-off, whose time moves; not smooth where the contact force does not fall. A
 * leg that leaves at once does so under every current. */
static inline void hopform_lift_real(hopform_tally_real *tally, const hopform_state_real *end)
{
    const hopform_robot_real *robot = &tally->plan->robot;
    const hopform_state_real *speed = &tally->speed;
    const hopform_state_real *change = &tally->change;
    hopform_trial_real *trial = tally->trial;
    const real rate = hopform_contact_slope_real(robot, speed);
    if (!(fabs_real(rate) > 0.0)) {
        trial->smooth = false;
        return;
    }
    const real late = -hopform_contact_slope_real(robot, change) / rate;
    const real x1_u = change->x1 + speed->x1 * late;
    const real y_u = HOPFORM_CONTACT_IS_COMPRESSION ? 0.0 : change->y + speed->y * late;
    const real v2_u = change->v2 + speed->v2 * late;
    trial->apex_u = (x1_u - y_u) + hopform_greater_real(end->v2, 0.0) * v2_u / hopform_fall_of_real(robot);
    hopform_note_largest_real(trial, end->x1, x1_u);
}

/* The order of modes and events as a number, which differs where they do. */
static inline uint32_t hopform_fingerprint_real(const hopform_phase_real *phases, int32_t count)
{
    uint32_t mark = 2166136261u;
    for (int32_t n = 0; n < count; n++) {
        mark = (mark ^ (uint32_t)(phases[n].mode + 16 * phases[n].event)) * 16777619u;
    }
    return mark;
}

/* What a stance says of its current, all of whose phases are at hand, and whose changes have been followed. */
static inline void hopform_close_trial_real(hopform_tally_real *tally, const hopform_phase_real *phases,
                                            const hopform_stance_real *stance)
{
    hopform_trial_real *trial = tally->trial;
    trial->takes_off = stance->ending == HOPFORM_ENDING_TAKEOFF;
    trial->events = hopform_fingerprint_real(phases, stance->phases_kept);
    trial->held = true;
    for (int32_t n = 0; n < stance->phases_kept; n++) {
        trial->held = trial->held && hopform_side_1_real(&phases[n]) == 0;
    }
    if (trial->takes_off) {
        trial->apex = stance->apex;
        hopform_lift_real(tally, &stance->end);
    } else {
        hopform_note_largest_real(trial, stance->end.x1, tally->change.x1);
    }
}

#endif
