/* SPDX-License-Identifier: MIT-0
 *
 * A start in the coordinates and velocities of the model's file, and the state that everything else takes.
 */
#ifndef HOPFORM_START_H_real
#define HOPFORM_START_H_real

#include "chain_real.h"

/* The state of a start. Where a contact may be touched, a stretch within 4 units in the last place of what it is a
 * difference of is none. */
static inline hopform_state_real state_from_start_real(const hopform_robot_real *robot,
                                                       const hopform_start_real *start) {
    state_by_axis_real at;
    at.named = state_of_start_real(robot, start);
#if HOPFORM_HAS_CONTACT
    real *stretch = &at.of[HOPFORM_STRETCH_AXIS];
    const real place = at.of[HOPFORM_POSITION_AXIS];
    const real height = second_position_real(robot, place, *stretch);
    const real length = second_position_real(robot, 0.0, 0.0);
    const real largest = greater_real(fabs_real(place), greater_real(fabs_real(height), fabs_real(length)));
    const bool touches = is_finite_real(largest) && fabs_real(*stretch) <= 4.0 * HOPFORM_EPS_real * largest;
    *stretch = touches ? 0.0 : *stretch;
#endif
    return at.named;
}

/* State of a start, which has the coordinates and velocities of the model's file. Refused is one that is not finite or
 * beyond a stop, and of a model with a contact one in which the contact is extended: y < 0. There y is 0 where it is
 * within 4 units in the last place of the largest coordinate and the length without load. */
int32_t hopform_state_of_start_real(const hopform_plan_real *plan, const hopform_start_real *start,
                                    hopform_state_real *state) {
    const memory_real read = array_real(plan, 1, sizeof *plan);
    const memory_real written = array_real(state, 1, sizeof *state);
    hopform_state_real found = {0.0, 0.0, 0.0, 0.0};
    int32_t status = HOPFORM_OK;
    if (plan == NULL || start == NULL || state == NULL) {
        status = HOPFORM_ERROR_NULL;
    } else if (overlap_real(&written, 1, &read, 1)) {
        status = HOPFORM_ERROR_OVERLAP;
    } else if (!is_made_real(plan)) {
        status = HOPFORM_ERROR_ROBOT;
    } else {
        found = state_from_start_real(&plan->robot, start);
        status = state_status_real(&plan->robot, &found);
    }
    if (status < 0) { return refuse_real(status, &written, 1, &read, 1); }
    *state = found;
    return HOPFORM_OK;
}

/* Coordinates and velocities of a state, as the model's file has them: the inverse of hopform_state_of_start, also for
 * a contact that is extended, as in flight. Refused is a state that is not finite, or in which moves what is fixed. */
int32_t hopform_start_of_state_real(const hopform_plan_real *plan, const hopform_state_real *state,
                                    hopform_start_real *start) {
    const memory_real read = array_real(plan, 1, sizeof *plan);
    const memory_real written = array_real(start, 1, sizeof *start);
    int32_t status = HOPFORM_OK;
    if (plan == NULL || state == NULL || start == NULL) {
        status = HOPFORM_ERROR_NULL;
    } else if (overlap_real(&written, 1, &read, 1)) {
        status = HOPFORM_ERROR_OVERLAP;
    } else if (!is_made_real(plan)) {
        status = HOPFORM_ERROR_ROBOT;
    } else if (!is_sound_state_real(state)) {
        status = HOPFORM_ERROR_STATE;
    }
    if (status < 0) { return refuse_real(status, &written, 1, &read, 1); }
    *start = start_of_state_real(&plan->robot, state);
    return HOPFORM_OK;
}

#endif
