/* SPDX-License-Identifier: MIT-0
 *
 * States of a solved stance at many times: what a phase needs is made once for those that follow each other in it.
 */
#include "phase_real.h"

static hopform_state_real states_start_of_real(const hopform_phase_real *phase)
{
    const hopform_state_real start = {phase->x1, phase->v1, phase->v2, phase->y};
    return start;
}

static hopform_motion_real motion_in_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                          const hopform_phase_real *phase)
{
    const hopform_state_real start = states_start_of_real(phase);
    return hopform_motion_of_real(plan, &start, steps[phase->step].u, hopform_side_1_real(phase),
                                  hopform_side_2_real(phase));
}

int32_t hopform_stance_states_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                   const hopform_phase_real *phases, const hopform_stance_real *stance,
                                   const real *times, int32_t count, real *x1, real *v1, real *v2, real *y)
{
    const hopform_memory_real arrays[] = {
        hopform_array_real(x1, count, sizeof *x1),
        hopform_array_real(v1, count, sizeof *v1),
        hopform_array_real(v2, count, sizeof *v2),
        hopform_array_real(y, count, sizeof *y),
    };
    const hopform_memory_real read_times = hopform_array_real(times, count, sizeof *times);
    const int32_t status = hopform_reading_status_real(plan, steps, phases, stance, &read_times, arrays, 4);
    if (status < 0) {
        return status;
    }
    const bool rests = stance->ending == HOPFORM_ENDING_REST;
    int32_t prepared = 0;
    hopform_state_real start = states_start_of_real(phases);
    hopform_motion_real motion = motion_in_real(plan, steps, phases);
    for (int32_t i = 0; i < count; i++) {
        const real t = times[i];
        if (!(t >= 0.0 && t <= HOPFORM_NEVER_real) || (t > stance->duration && !rests)) {
            return hopform_refuse_real(HOPFORM_ERROR_TIME, arrays, 4);
        }
        const real within = hopform_lesser_real(t, stance->duration);
        const int32_t n = hopform_phase_index_real(phases, stance->phases_kept, within);
        const hopform_phase_real *phase = &phases[n];
        const int side_1 = hopform_side_1_real(phase);
        const int side_2 = hopform_side_2_real(phase);
        if (n != prepared) {
            start = states_start_of_real(phase);
            motion = motion_in_real(plan, steps, phase);
            prepared = n;
        }
        hopform_state_real state = start;
        if (side_1 != 0 || side_2 != 0) {
            const real since = within - phase->t;
            const hopform_basis_real basis = hopform_basis_at_real(hopform_poles_of_real(plan, side_1, side_2), since);
            state = hopform_arrive_real(&start, &motion, &basis, side_1, side_2);
        }
        x1[i] = state.x1;
        v1[i] = state.v1;
        v2[i] = state.v2;
        y[i] = state.y;
    }
    return HOPFORM_OK;
}
