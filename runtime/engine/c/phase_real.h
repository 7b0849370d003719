/* SPDX-License-Identifier: MIT-0
 *
 * A phase: its poles and numerators by mode, and its state over time.
 */
#ifndef HOPFORM_PHASE_H_real
#define HOPFORM_PHASE_H_real

#include "facts.h"
#include "kernels_real.h"
#include "model_real.h"
#include "overlap_real.h"

/* True where the AED is a small difference of two energies of the body, and added up from the ledger instead. */
static inline bool hopform_stores_much_real(const hopform_robot_real *robot, const hopform_state_real *start)
{
    const real motion = 0.5 * robot->m_s * (1.0 + start->v2 * start->v2);
    return !(hopform_stored_energy_real(robot, start) <= 64.0 * motion);
}

/* The poles of a mode; side_i is the sign of v_i, 0 if mass i is held. */
static inline const hopform_poles_real *hopform_poles_of_real(const hopform_plan_real *plan, int side_1, int side_2)
{
    return side_1 == 0 ? &plan->body : (side_2 == 0 ? &plan->actuator : &plan->both);
}

static inline const hopform_node_real *hopform_node_of_real(const hopform_plan_real *plan, int side_1, int side_2)
{
    return side_1 == 0 ? &plan->node_body : (side_2 == 0 ? &plan->node_actuator : &plan->node_both);
}

/* The numerators of a mode from the state in which the phase starts, under constant accelerations. */
static inline hopform_motion_real hopform_motion_under_real(const hopform_rates_real *rates,
                                                            const hopform_drive_real *drive,
                                                            const hopform_state_real *state, int side_1, int side_2)
{
    if (side_1 != 0) {
        return side_2 != 0 ? hopform_motion_of_both_real(rates, drive, state)
                           : hopform_motion_of_actuator_real(rates, drive, state);
    }
    if (side_2 != 0) {
        return hopform_motion_of_body_real(rates, drive, state);
    }
    const hopform_motion_real rest = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    return rest;
}

/* The same under a current. */
static inline hopform_motion_real hopform_motion_of_real(const hopform_plan_real *plan, const hopform_state_real *state,
                                                         real u, int side_1, int side_2)
{
    const hopform_drive_real drive = hopform_drive_of_real(&plan->robot, &plan->rates, u, (real)side_1, (real)side_2);
    return hopform_motion_under_real(&plan->rates, &drive, state, side_1, side_2);
}

/* The numerator of the contact force over k. */
static inline hopform_numerator_real hopform_contact_numerator_real(const hopform_robot_real *robot,
                                                                    const hopform_motion_real *motion)
{
    const hopform_state_real H3 = {0.0, motion->H3_1, motion->H3_2, motion->H3_y};
    const hopform_state_real H2 = {0.0, motion->H2_1, motion->H2_2, motion->H2_y};
    const hopform_state_real H1 = {0.0, motion->H1_1, motion->H1_2, motion->H1_y};
    const hopform_numerator_real leg = {hopform_contact_slope_real(robot, &H3), hopform_contact_slope_real(robot, &H2),
                                        hopform_contact_slope_real(robot, &H1)};
    return leg;
}

/* What y of a mode tends to; NEVER where nothing that is left of k draws it. */
static inline real hopform_settled_y_real(const hopform_poles_real *poles, real H2_y, real H1_y)
{
    const bool slow = poles->s_3 > 0.0;
    const real draws = slow ? poles->s_3 : poles->s_2;
    const real settled = (slow ? H1_y : H2_y) / (draws > 0.0 ? draws : 1.0);
    return draws > 0.0 ? settled : HOPFORM_NEVER_real;
}

/* ---- the hold rule ---- */

/* Where a mass at rest goes, held while |a_i| <= f_i: 1 or -1, 0 if it stays. */
static inline real hopform_goes_real(real acceleration, real friction)
{
    const real down = acceleration < -friction ? -1.0 : 0.0;
    return acceleration > friction ? 1.0 : down;
}

/* Where the mass that is held may slip to while the other one moves: where its free acceleration changes with y alone,
 * which is monotone then, to the side that it goes towards; 0 for either. */
static inline int hopform_side_of_slip_real(const hopform_rates_real *rates, int side_1, int side_2)
{
    const real per_y = side_1 == 0 ? rates->a1_y : rates->a2_y;
    const real per_v = side_1 == 0 ? rates->a1_v2 : rates->a2_v1;
    return fabs_real(per_v) > 0.0 ? 0 : (int)hopform_goes_real(per_y, 0.0) * (side_1 - side_2);
}

/* The free acceleration of a mass that has come to rest alone, from its motion: it fades far below the digits of the
 * state. Without friction nothing but the sign is left of it in the end, and that is kept. */
static inline real hopform_free_after_motion_real(real side, real friction, real H3, real H2,
                                                  const hopform_basis_real *basis)
{
    const real back = fabs_real(H3 * basis->Wdd + H2 * basis->Wd);
    return side * (friction - (back > HOPFORM_UNDERFLOW_real ? back : HOPFORM_UNDERFLOW_real));
}

/* Put the acceleration with which a mass goes on from rest in place of that of the state; alone, y follows it. */
static inline void hopform_go_on_real(hopform_motion_real *motion, int mass, bool alone, real acceleration)
{
    if (mass == 1) {
        motion->H3_1 = acceleration;
        motion->N2_1 = acceleration; /* v_1 is 0 */
        motion->H2_y = alone ? acceleration : motion->H2_y;
    } else {
        motion->H3_2 = acceleration;
        motion->H2_y = -acceleration;
    }
}

/* The state of a phase where the response of the poles is `basis`; what is held stays exactly where it is. */
static inline hopform_state_real hopform_arrive_real(const hopform_state_real *state, const hopform_motion_real *motion,
                                                     const hopform_basis_real *basis, int side_1, int side_2)
{
    const hopform_at_real at = hopform_state_at_real(state, motion, basis);
    hopform_state_real arrival = {at.x1_t, at.v1_t, at.v2_t, at.y_t};
    if (side_1 == 0) {
        arrival.x1 = state->x1;
        arrival.v1 = 0.0;
    }
    if (side_2 == 0) {
        arrival.v2 = 0.0;
    }
    return arrival;
}

/* A plan that hopform_plan_init made, not memory that holds anything. */
static inline bool hopform_is_made_real(const hopform_plan_real *plan)
{
    return plan->made == HOPFORM_PLAN_MADE;
}

/* A plan of a robot that can take off, and comes down again. */
static inline bool hopform_hops_real(const hopform_plan_real *plan)
{
    return hopform_is_made_real(plan) && !HOPFORM_FOOT_IS_FIXED && hopform_fall_of_real(&plan->robot) > 0.0;
}

/* Status of a call that reads a solved stance, at times unless that is NULL, into arrays: HOPFORM_OK if it can; else
 * the arrays are zeros. */
int32_t hopform_reading_status_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                    const hopform_phase_real *phases, const hopform_stance_real *stance,
                                    const hopform_times_real *times, const hopform_memory_real *arrays,
                                    int array_count);

/* Index of the last phase that starts at or before t. */
static inline int32_t hopform_phase_index_real(const hopform_phase_real *phases, int32_t count, real t)
{
    int32_t low = 0;
    int32_t high = count - 1;
    while (low < high) {
        const int32_t middle = (int32_t)(((uint32_t)low + (uint32_t)high + 1u) / 2u);
        if (phases[middle].t <= t) {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    return low;
}

static inline int hopform_side_1_real(const hopform_phase_real *phase)
{
    return phase->mode / 3 - 1;
}

static inline int hopform_side_2_real(const hopform_phase_real *phase)
{
    return phase->mode % 3 - 1;
}

static inline hopform_state_real hopform_start_of_phase_real(const hopform_phase_real *phase)
{
    const hopform_state_real start = {phase->x1, phase->v1, phase->v2, phase->y};
    return start;
}

/* The numerators of a phase. */
static inline hopform_motion_real hopform_motion_in_phase_real(const hopform_plan_real *plan,
                                                               const hopform_phase_real *phase, real u)
{
    const hopform_state_real start = hopform_start_of_phase_real(phase);
    return hopform_motion_of_real(plan, &start, u, hopform_side_1_real(phase), hopform_side_2_real(phase));
}

/* The state at time t since a phase with these numerators began. */
static inline hopform_state_real hopform_state_by_motion_real(const hopform_plan_real *plan,
                                                              const hopform_phase_real *phase,
                                                              const hopform_motion_real *motion, real t)
{
    const int side_1 = hopform_side_1_real(phase);
    const int side_2 = hopform_side_2_real(phase);
    const hopform_state_real start = hopform_start_of_phase_real(phase);
    if (side_1 == 0 && side_2 == 0) {
        return start;
    }
    const hopform_basis_real basis = hopform_basis_at_real(hopform_poles_of_real(plan, side_1, side_2), t);
    return hopform_arrive_real(&start, motion, &basis, side_1, side_2);
}

static inline hopform_state_real hopform_state_in_phase_real(const hopform_plan_real *plan,
                                                             const hopform_phase_real *phase, real u, real t)
{
    const hopform_motion_real motion = hopform_motion_in_phase_real(plan, phase, u);
    return hopform_state_by_motion_real(plan, phase, &motion, t);
}

#endif
