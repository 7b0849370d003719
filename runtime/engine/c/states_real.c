/* SPDX-License-Identifier: MIT-0
 *
 * States of a solved stance at many times: what a phase needs is made once for those that follow each other in it.
 */
#include "phase_real.h"

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
    const hopform_times_real when = {times, count, false};
    const int32_t status = hopform_reading_status_real(plan, steps, phases, stance, &when, arrays, 4);
    if (status < 0) {
        return status;
    }
    int32_t prepared = 0;
    hopform_motion_real motion = hopform_motion_in_phase_real(plan, phases, steps[phases->step].u);
    for (int32_t i = 0; i < count; i++) {
        const real within = hopform_lesser_real(times[i], stance->duration);
        const int32_t n = hopform_phase_index_real(phases, stance->phases_kept, within);
        const hopform_phase_real *phase = &phases[n];
        if (n != prepared) {
            motion = hopform_motion_in_phase_real(plan, phase, steps[phase->step].u);
            prepared = n;
        }
        const hopform_state_real state = hopform_state_by_motion_real(plan, phase, &motion, within - phase->t);
        x1[i] = state.x1;
        v1[i] = state.v1;
        v2[i] = state.v2;
        y[i] = state.y;
    }
    return HOPFORM_OK;
}
