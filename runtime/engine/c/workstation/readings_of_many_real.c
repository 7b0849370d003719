/* SPDX-License-Identifier: MIT-0
 *
 * Derivatives and compressions of many stances, one solved after the other, from columns to a row of matrices or
 * numbers.
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

/* One stance after the other. */
typedef struct {
    const hopform_stances_in_real *in;
    hopform_phase_real *phases;
    int32_t capacity;
    hopform_plan_real plan;
    int32_t plan_status;
    hopform_step_real step;
    hopform_stance_real stance;
} row_solver;

/* Solves stance i. */
static int32_t solve_row(row_solver *row, int64_t i)
{
    const hopform_stances_in_real *in = row->in;
    if (i == 0 || hopform_has_many_robots_real(in)) {
        const hopform_robot_real robot = hopform_robot_of_real(in, i);
        row->plan_status = hopform_plan_init_real(&row->plan, &robot);
    }
    if (row->plan_status < 0) {
        return row->plan_status;
    }
    const hopform_state_real start = {hopform_number_real(&in->x1, i), hopform_number_real(&in->v1, i),
                                      hopform_number_real(&in->v2, i), hopform_number_real(&in->y, i)};
    row->step.t = 0.0;
    row->step.u = hopform_number_real(&in->u, i);
    return hopform_solve_stance_real(&row->plan, &start, &row->step, 1, hopform_number_real(&in->horizon, i),
                                     in->max_phases, row->phases, row->capacity, &row->stance);
}

/* Status of the call: HOPFORM_OK if the stances can be solved. `size`: bytes of one result. */
static int32_t status_of(int64_t count, const row_solver *row, const real *first, size_t size, const int32_t *status)
{
    if (row->in == NULL || row->phases == NULL || first == NULL || status == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const hopform_elements_real written[] = {
        {row->phases, 0, row->capacity > 0 ? (size_t)row->capacity * sizeof *row->phases : 0},
        {first, (ptrdiff_t)size, size},
        {status, sizeof *status, sizeof *status},
    };
    return hopform_batch_status_real(count, row->in, written, 3);
}

/* Every stance refused with a status. */
static int32_t refuse(int32_t refused, int64_t count, real *results, int64_t each, int32_t *status)
{
    for (int64_t i = 0; results != NULL && i < count * each; i++) {
        results[i] = (real)NAN;
    }
    for (int64_t i = 0; status != NULL && i < count; i++) {
        status[i] = refused;
    }
    return refused;
}

/* The status of the whole, of which a row has one more. */
static int32_t status_with(int32_t whole, int32_t row)
{
    return row == HOPFORM_PHASES_NOT_KEPT ? HOPFORM_PHASES_NOT_KEPT : whole;
}

int32_t hopform_stances_sensitivities_real(int64_t count, const hopform_stances_in_real *in, hopform_phase_real *phases,
                                           int32_t capacity, real *matrices, int32_t *status)
{
    enum { APEX = 5, MATRIX = HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS };
    row_solver row = {.in = in, .phases = phases, .capacity = capacity};
    const int32_t refused = status_of(count, &row, matrices, sizeof(real) * MATRIX, status);
    if (refused < 0) {
        return refuse(refused, count, matrices, MATRIX, status);
    }
    int32_t whole = HOPFORM_OK;
    for (int64_t i = 0; i < count; i++) {
        real *matrix = matrices + i * MATRIX;
        status[i] = solve_row(&row, i);
        if (status[i] == HOPFORM_OK) {
            status[i] = hopform_stance_sensitivities_real(&row.plan, &row.step, phases, &row.stance, matrix);
        }
        if (status[i] != HOPFORM_OK) {
            no_rows(matrix, 0, HOPFORM_SENSITIVITY_ROWS);
        } else if (!(row.plan.robot.g > 0.0)) {
            no_rows(matrix, APEX, APEX + 1);
        }
        whole = status_with(whole, status[i]);
    }
    return whole;
}

int32_t hopform_stances_compressions_real(int64_t count, const hopform_stances_in_real *in, hopform_phase_real *phases,
                                          int32_t capacity, real *compressions, int32_t *status)
{
    row_solver row = {.in = in, .phases = phases, .capacity = capacity};
    const int32_t refused = status_of(count, &row, compressions, sizeof(real), status);
    if (refused < 0) {
        return refuse(refused, count, compressions, 1, status);
    }
    int32_t whole = HOPFORM_OK;
    for (int64_t i = 0; i < count; i++) {
        real *compression = compressions + i;
        status[i] = solve_row(&row, i);
        if (status[i] == HOPFORM_OK) {
            status[i] = hopform_stance_compression_real(&row.plan, &row.step, phases, &row.stance, compression);
        }
        if (status[i] != HOPFORM_OK) {
            *compression = (real)NAN;
        }
        whole = status_with(whole, status[i]);
    }
    return whole;
}
