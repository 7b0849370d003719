/* A libFuzzer target: what reads a solved stance (derivatives, tangents, states, the grid), on arbitrary bit patterns;
 * -DSINGLE in single precision.
 *
 * The bytes become numbers as they are or, by the first one, of a sensible size. An answer that is not finite, or not
 * within its own bounds, aborts. A horizon is cut to MOST_HALF_TURNS of the stiffest oscillation: an input takes
 * milliseconds.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "source.h"

enum { MOST_HALF_TURNS = 300, GRID = 70, MATRIX = HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS };

static T(phase) phases[MAX_PHASES + 1];

static void read_stance(const T(plan) *plan, const T(step) *step, const T(stance) *stance, real early)
{
    static real matrix[MATRIX], tangents[2 * HOPFORM_TANGENT_ROWS * HOPFORM_SENSITIVITY_COLUMNS], columns[4][GRID];
    static real *const rows[4] = {columns[0], columns[1], columns[2], columns[3]};
    const real times[2] = {early, stance->duration};
    T(state) states[2];
    const int32_t status = T(stance_sensitivities)(plan, step, phases, stance, NULL, 0, matrix);
    must(status == HOPFORM_OK || status == HOPFORM_NO_DERIVATIVE || status == HOPFORM_ERROR_TIME);
    for (int n = 0; n < MATRIX; n++) {
        must(isfinite(matrix[n]) && (status == HOPFORM_OK || !(fabs(matrix[n]) > 0)));
    }
    const int32_t tangent = T(stance_tangents)(plan, step, phases, stance, NULL, 0, times, 2, states, tangents);
    must(tangent == HOPFORM_OK || tangent == HOPFORM_NO_DERIVATIVE || tangent == HOPFORM_ERROR_TIME);
    const int32_t stated =
        T(stance_states)(plan, step, phases, stance, times, 2, rows);
    must((stated < 0) == (tangent < 0) || early > stance->duration); /* tangents want times in their order */
    const real dt = stance->duration / GRID;
    const int32_t drawn =
        T(stance_grid)(plan, step, phases, stance, early, dt, GRID, rows);
    must(drawn == HOPFORM_OK || drawn == HOPFORM_ERROR_TIME);
    T(stance_grid)(plan, step, phases, stance, 0, dt, GRID, rows);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    source from = {data, size};
    const int kind = next_byte(&from), sensible = kind & 1;
    const T(robot) robot = next_robot(&from, kind);
    T(plan) plan;
    if (T(plan_init)(&plan, &robot) < 0) {
        return 0;
    }
    T(state) start;
    start.x1 = sensible ? 0 : next_real(&from, 0, 0);
    start.v1 = next_real(&from, sensible, 0);
    start.v2 = next_real(&from, sensible, 0);
    start.y = sensible && (kind & 4) ? 0 : (real)(sensible ? next_real(&from, 1, 1) : next_real(&from, 0, 0));
    const T(step) step = {0, next_real(&from, sensible, 0)};
    const real horizon = bounded(next_real(&from, sensible, 1), &robot, MOST_HALF_TURNS);
    T(stance) stance;
    const int32_t status =
        T(solve_stance)(&plan, &start, &step, 1, horizon, MAX_PHASES, phases, MAX_PHASES + 1, &stance);
    if (status >= 0) {
        read_stance(&plan, &step, &stance, kind & 32 ? next_real(&from, 0, 0) : stance.duration / 3);
    }
    return 0;
}
