/* SPDX-License-Identifier: MIT-0
 *
 * Derivatives of many stances, one after the other, from columns to one row of matrices.
 */
#include "facts.h"
#include "columns_real.h"

/* NaN in the rows from `first` to before `last` of a matrix. */
static void no_rows(real *matrix, int first, int last)
{
    for (int n = first * HOPFORM_SENSITIVITY_COLUMNS; n < last * HOPFORM_SENSITIVITY_COLUMNS; n++) {
        matrix[n] = (real)NAN;
    }
}

/* Status of the call: HOPFORM_OK if the stances can be solved. */
static int32_t status_of(int64_t count, const hopform_stances_in_real *in, const hopform_phase_real *phases,
                         int32_t capacity, const real *matrices, const int32_t *status)
{
    if (in == NULL || phases == NULL || matrices == NULL || status == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const size_t matrix = sizeof(real) * HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS;
    const hopform_elements_real written[] = {
        {phases, 0, capacity > 0 ? (size_t)capacity * sizeof *phases : 0},
        {matrices, (ptrdiff_t)matrix, matrix},
        {status, sizeof *status, sizeof *status},
    };
    return hopform_batch_status_real(count, in, written, 3);
}

/* Every stance refused with a status. */
static int32_t refuse(int32_t refused, int64_t count, real *matrices, int32_t *status)
{
    enum { MATRIX = HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS };
    for (int64_t i = 0; matrices != NULL && i < count; i++) {
        no_rows(matrices + i * MATRIX, 0, HOPFORM_SENSITIVITY_ROWS);
    }
    for (int64_t i = 0; status != NULL && i < count; i++) {
        status[i] = refused;
    }
    return refused;
}

int32_t hopform_stances_sensitivities_real(int64_t count, const hopform_stances_in_real *in, hopform_phase_real *phases,
                                           int32_t capacity, real *matrices, int32_t *status)
{
    enum { APEX = 5 };
    const int32_t refused = status_of(count, in, phases, capacity, matrices, status);
    if (refused < 0) {
        return refuse(refused, count, matrices, status);
    }
    const bool many_robots = hopform_has_many_robots_real(in);
    int32_t kept = HOPFORM_OK;
    int32_t robot_status = HOPFORM_OK;
    hopform_plan_real plan;
    for (int64_t i = 0; i < count; i++) {
        if (i == 0 || many_robots) {
            const hopform_robot_real robot = hopform_robot_of_real(in, i);
            robot_status = hopform_plan_init_real(&plan, &robot);
        }
        const hopform_state_real start = {hopform_number_real(&in->x1, i), hopform_number_real(&in->v1, i),
                                          hopform_number_real(&in->v2, i), hopform_number_real(&in->y, i)};
        const hopform_step_real step = {0.0, hopform_number_real(&in->u, i)};
        hopform_stance_real stance;
        real *matrix = matrices + i * (HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS);
        status[i] = robot_status;
        if (status[i] == HOPFORM_OK) {
            const real horizon = hopform_number_real(&in->horizon, i);
            status[i] =
                hopform_solve_stance_real(&plan, &start, &step, 1, horizon, in->max_phases, phases, capacity, &stance);
        }
        if (status[i] == HOPFORM_OK) {
            status[i] = hopform_stance_sensitivities_real(&plan, &step, phases, &stance, matrix);
        }
        if (status[i] != HOPFORM_OK) {
            no_rows(matrix, 0, HOPFORM_SENSITIVITY_ROWS);
        } else if (!(plan.robot.g > 0.0)) {
            no_rows(matrix, APEX, APEX + 1);
        }
        if (status[i] == HOPFORM_PHASES_NOT_KEPT) {
            kept = HOPFORM_PHASES_NOT_KEPT;
        }
    }
    return kept;
}
