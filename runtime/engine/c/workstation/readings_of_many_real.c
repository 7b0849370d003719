/* SPDX-License-Identifier: MIT-0
 *
 * Derivatives and compressions of many stances, one solved after the other, from columns to a row of matrices or
 * numbers.
 */
#include "facts.h"
#include "columns_real.h"

enum { APEX = 5, ROW = HOPFORM_SENSITIVITY_COLUMNS, MATRIX = HOPFORM_SENSITIVITY_ROWS * ROW };

/* Stances to be solved one after the other, and what is read of the one that has been: `each` numbers by `reading`. */
typedef struct row_solver row_solver;
struct row_solver {
    const hopform_stances_in_real *in;
    hopform_phase_real *phases;
    int32_t capacity;
    int32_t (*reading)(const row_solver *row, real *numbers);
    int64_t each;
    hopform_plan_real plan;
    int32_t plan_status;
    hopform_step_real step;
    hopform_stance_real stance;
};

static void no_numbers(real *numbers, int64_t count)
{
    for (int64_t n = 0; n < count; n++) {
        numbers[n] = (real)NAN;
    }
}

/* Solves stance i, and reads it. */
static int32_t read_row(row_solver *row, int64_t i, real *numbers)
{
    const hopform_stances_in_real *in = row->in;
    if (i == 0 || hopform_has_many_robots_real(in)) {
        const hopform_robot_real robot = hopform_robot_of_real(in, i);
        row->plan_status = hopform_plan_init_real(&row->plan, &robot);
    }
    const hopform_state_real start = hopform_start_of_real(in, i);
    row->step.t = 0.0;
    row->step.u = hopform_number_real(&in->u, i);
    int32_t status = row->plan_status;
    if (status >= 0) {
        status = hopform_solve_stance_real(&row->plan, &start, &row->step, 1, hopform_number_real(&in->horizon, i),
                                           in->max_phases, row->phases, row->capacity, &row->stance);
    }
    if (status == HOPFORM_OK) {
        status = row->reading(row, numbers);
    }
    if (status != HOPFORM_OK) {
        no_numbers(numbers, row->each);
    }
    return status;
}

/* All of them; where the call is refused, so is every stance. */
static int32_t read_all(row_solver *row, int64_t count, real *results, int32_t *status)
{
    int32_t whole = HOPFORM_ERROR_NULL;
    if (row->in != NULL && row->phases != NULL && results != NULL && status != NULL) {
        const size_t size = sizeof(real) * (size_t)row->each;
        const hopform_elements_real written[] = {
            {row->phases, 0, row->capacity > 0 ? (size_t)row->capacity * sizeof *row->phases : 0},
            {results, (ptrdiff_t)size, size},
            {status, sizeof *status, sizeof *status},
        };
        whole = hopform_batch_status_real(count, row->in, written, 3);
    }
    if (whole < 0) {
        no_numbers(results, results != NULL ? count * row->each : 0);
        for (int64_t i = 0; status != NULL && i < count; i++) {
            status[i] = whole;
        }
        return whole;
    }
    for (int64_t i = 0; i < count; i++) {
        status[i] = read_row(row, i, results + i * row->each);
        whole = status[i] == HOPFORM_PHASES_NOT_KEPT ? status[i] : whole;
    }
    return whole;
}

static int32_t read_sensitivities(const row_solver *row, real *matrix)
{
    const int32_t status = hopform_stance_sensitivities_real(&row->plan, &row->step, row->phases, &row->stance, matrix);
    no_numbers(matrix + APEX * ROW, hopform_fall_of_real(&row->plan.robot) > 0.0 ? 0 : ROW);
    return status;
}

int32_t hopform_stances_sensitivities_real(int64_t count, const hopform_stances_in_real *in, hopform_phase_real *phases,
                                           int32_t capacity, real *matrices, int32_t *status)
{
    row_solver row = {.in = in, .phases = phases, .capacity = capacity, .reading = read_sensitivities, .each = MATRIX};
    return read_all(&row, count, matrices, status);
}

static int32_t read_compression(const row_solver *row, real *compression)
{
    return hopform_stance_compression_real(&row->plan, &row->step, row->phases, &row->stance, compression);
}

int32_t hopform_stances_compressions_real(int64_t count, const hopform_stances_in_real *in, hopform_phase_real *phases,
                                          int32_t capacity, real *compressions, int32_t *status)
{
    row_solver row = {.in = in, .phases = phases, .capacity = capacity, .reading = read_compression, .each = 1};
    return read_all(&row, count, compressions, status);
}
