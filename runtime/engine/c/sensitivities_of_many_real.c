/* SPDX-License-Identifier: MIT-0
 *
 * Derivatives of many stances, one after the other, from columns to one row of matrices.
 */
#include "facts.h"
#include "formulas_real.h"

static real number(const hopform_input_real *column, int64_t i)
{
    const void *place = (const char *)column->first + column->stride * (ptrdiff_t)i;
    return *(const real *)place;
}

static hopform_robot_real robot_of(const hopform_stances_in_real *in, int64_t i)
{
    const hopform_input_real *column = in->robot;
    hopform_robot_real robot;
#define READ_PARAMETER(name, domain) robot.name = number(column++, i);
    HOPFORM_ROBOT_MEMBERS(READ_PARAMETER)
#undef READ_PARAMETER
    return robot;
}

/* Whether every stance has the same robot. */
static int one_robot(const hopform_stances_in_real *in)
{
    for (int n = 0; n < HOPFORM_ROBOT_FIELDS; n++) {
        if (in->robot[n].stride != 0) {
            return 0;
        }
    }
    return 1;
}

/* NaN in the rows from `first` to before `last` of a matrix. */
static void no_rows(real *matrix, int first, int last)
{
    for (int n = first * HOPFORM_SENSITIVITY_COLUMNS; n < last * HOPFORM_SENSITIVITY_COLUMNS; n++) {
        matrix[n] = (real)NAN;
    }
}

int32_t hopform_stances_sensitivities_real(int64_t count, const hopform_stances_in_real *in, hopform_phase_real *phases,
                                           int32_t capacity, real *matrices, int32_t *status)
{
    if (in == NULL || phases == NULL || matrices == NULL || status == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    enum { APEX = 5 };
    const int same = one_robot(in);
    int32_t kept = HOPFORM_OK;
    int32_t robot_status = HOPFORM_OK;
    hopform_plan_real plan;
    for (int64_t i = 0; i < count; i++) {
        if (i == 0 || !same) {
            const hopform_robot_real robot = robot_of(in, i);
            robot_status = hopform_plan_init_real(&plan, &robot);
        }
        const hopform_state_real start = {number(&in->x1, i), number(&in->v1, i), number(&in->v2, i),
                                          number(&in->y, i)};
        const hopform_step_real step = {0.0, number(&in->u, i)};
        hopform_stance_real stance;
        real *matrix = matrices + i * (HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS);
        status[i] = robot_status;
        if (status[i] == HOPFORM_OK) {
            status[i] = hopform_solve_stance_real(&plan, &start, &step, 1, number(&in->horizon, i), in->max_phases,
                                                  phases, capacity, &stance);
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
