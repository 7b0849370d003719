/* Solves one stance. SPDX-License-Identifier: MIT-0 */
#include "hopform/hopform.h"

int main(void)
{
    static hopform_plan_f32 plan;
    static hopform_phase_f32 phases[32];
    const hopform_robot_f32 robot = {
        25.0f, 3.0f, 1.2e3f, 0.4f, 0.0f, 1.5e2f, 5.0f, 0.78f, 0.6f, -65.0f, 9.81f, 0.0f, 0.08f, 3.0f, 0.05f, 0.0f, 0.0f
    };
    const hopform_start_f32 start = {0.0f, 0.0f, 0.4f, -1.93f}; /* x1 [m], v1 [m/s], x2 [m], v2 [m/s] */
    const hopform_step_f32 input = {0.0f, 3.0f}; /* from 0 s on */
    hopform_state_f32 state;
    hopform_stance_f32 stance;
    if (hopform_plan_init_f32(&plan, &robot) < 0 || hopform_state_of_start_f32(&plan, &start, &state) < 0) {
        return 1;
    }
    return hopform_solve_stance_f32(&plan, &state, &input, 1, 2.0f, 32, phases, 32, &stance) < 0;
}
