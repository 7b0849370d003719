/* Solves one stance. SPDX-License-Identifier: MIT-0 */
#include "@prefix@/@prefix@.h"

int main(void)
{
    static @prefix@_plan_@real@ plan;
    static @prefix@_phase_@real@ phases[32];
    const @prefix@_robot_@real@ robot = {25.0f, 3.0f, 1200.0f, 0.4f, 0.0f, 150.0f, 5.0f, 0.78f, 0.6f, -65.0f, 9.81f, 0.0f, 0.08f, 3.0f, 0.05f};
    const @prefix@_state_@real@ touchdown = {0.0f, 0.0f, -1.93f, 0.0f};
    const @prefix@_step_@real@ current = {0.0f, 3.0f};
    @prefix@_stance_@real@ stance;
    if (@prefix@_plan_init_@real@(&plan, &robot) != @PREFIX@_OK) {
        return 1;
    }
    return @prefix@_solve_stance_@real@(&plan, &touchdown, &current, 1, 2.0f, 32, phases, 32, &stance) < 0;
}
