/* SPDX-License-Identifier: MIT-0
 *
 * Forces at any time of a stance, and the state just before an event.
 */
#ifndef HOPFORM_FORCES_H_real
#define HOPFORM_FORCES_H_real

#include "reading_real.h"

/* Whether the element with stops rests on one: all that friction does not carry is the stop's. */
static inline bool rests_on_stop_real(const hopform_robot_real *robot, const hopform_state_real *state, int side) {
    state_by_axis_real at;
    at.named = *state;
    const real position = at.of[HOPFORM_POSITION_AXIS];
    return side == 0 && (position <= lower_stop_real(robot) || position >= upper_stop_real(robot));
}

/* What friction takes of the free acceleration of an element: held as much as it can, up to its level at rest. */
static inline real resisted_of_real(const hopform_robot_real *robot, int element, int side, real free) {
    if (side != 0) { return (real)side * level_of_real(robot, element); }
    const real most = level_at_rest_real(robot, element, 1);
    const real least = -level_at_rest_real(robot, element, -1);
    return greater_real(least, lesser_real(free, most));
}

/* The forces at a state of a phase. */
static inline hopform_forces_real forces_in_phase_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                                       const hopform_phase_real *phase,
                                                       const hopform_state_real *state) {
    const hopform_robot_real *robot = &plan->robot;
    const row_real mode = mode_of_phase_real(phase);
    const real u = input_of_phase_real(plan, steps, phase);
    const real current = limit_of_mode_real(mode) == 0 ? current_of_law_real(robot, state, u) : u;
    free_by_element_real free;
    resisted_by_element_real resisted = {{0.0, 0.0}};
    free.named = free_accelerations_real(rates_in_mode_real(plan, mode), state, u);
    for (int element = 0; element < HOPFORM_MOVING_ELEMENTS; element++) {
        resisted.of[element] = resisted_of_real(robot, element, side_of_mode_real(mode, element), free.of[element]);
    }
    if (!rests_on_stop_real(robot, state, side_of_mode_real(mode, HOPFORM_STOPPED_ELEMENT))) {
        free.of[HOPFORM_STOPPED_ELEMENT] = resisted.of[HOPFORM_STOPPED_ELEMENT]; /* nothing is left for the stop */
    }
    return forces_of_real(robot, state, &free.named, &resisted.named, current);
}

/* Forces at `count` times of a solved stance, of any order. Friction on what is held is as much as it takes to hold it,
 * up to its level at rest; a stop carries of what it holds what friction does not, and a hit is an impulse. */
int32_t hopform_stance_forces_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                   const hopform_phase_real *phases, const hopform_stance_real *stance,
                                   const real *times, int32_t count, hopform_forces_real *forces) {
    const memory_real array = array_real(forces, count, sizeof *forces);
    const times_real when = {times, count, false};
    const int32_t status = reading_status_real(plan, steps, phases, stance, &when, NULL, &array, 1);
    if (status < 0) { return status; }
    for (int32_t i = 0; i < count; i++) {
        const real within = lesser_real(times[i], stance->duration);
        const hopform_phase_real *phase = &phases[phase_index_real(phases, stance->phases_kept, within)];
        const real u = input_of_phase_real(plan, steps, phase);
        const hopform_state_real state = state_in_phase_real(plan, phase, u, within - phase->t);
        forces[i] = forces_in_phase_real(plan, steps, phase, &state);
    }
    return HOPFORM_OK;
}

/* State of a solved stance just before phase n begins, 0 < n < phases_kept: a stop has not yet taken its velocity. */
int32_t hopform_stance_before_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                   const hopform_phase_real *phases, const hopform_stance_real *stance, int32_t n,
                                   hopform_state_real *state) {
    const memory_real array = array_real(state, 1, sizeof *state);
    const bool has = stance == NULL || (n > 0 && n < stance->phases_kept);
    const real never = -1.0; /* a time that no stance has */
    const times_real when = {&never, has ? 0 : 1, false};
    const int32_t status = reading_status_real(plan, steps, phases, stance, &when, NULL, &array, 1);
    if (status < 0) { return status; }
    const hopform_phase_real *phase = &phases[n - 1];
    *state = state_before_phase_real(plan, phase, input_of_phase_real(plan, steps, phase), &phases[n]);
    return HOPFORM_OK;
}

#endif
