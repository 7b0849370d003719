/* SPDX-License-Identifier: MIT-0
 *
 * Derivatives and other numbers of many stances, one solved after the other, from columns to a row of matrices or
 * numbers.
 */
#include "columns_real.h"

enum { ROW = HOPFORM_SENSITIVITY_COLUMNS, MATRIX = HOPFORM_SENSITIVITY_ROWS * ROW };

/* What is read of a stance that has been solved. */
typedef int32_t reading(const hopform_plan_real *plan, const hopform_step_real *steps, const hopform_phase_real *phases,
                        const hopform_stance_real *stance, real *numbers);

static void no_numbers(real *numbers, int64_t count) {
    for (int64_t n = 0; n < count; n++) {
        numbers[n] = (real)NAN;
    }
}

/* `each` numbers of all of them; where the call is refused, so is every stance. */
static int32_t read_all(reading *read, int64_t each, int64_t count, const hopform_stances_in_real *in,
                        hopform_phase_real *phases, int32_t capacity, real *results, int32_t *status) {
    const size_t size = sizeof(real) * (size_t)each;
    const elements_real written[] = {
        {phases, 0, capacity > 0 ? (size_t)capacity * sizeof *phases : 0},
        {results, (ptrdiff_t)size, size},
        {status, sizeof *status, sizeof *status},
    };
    bool is_input[3];
    const bool missing = phases == NULL || results == NULL || status == NULL;
    const int32_t known = batch_status_real(count, in, NULL, 0, written, 3, is_input);
    int32_t whole = missing ? HOPFORM_ERROR_NULL : known;
    no_numbers(results, results != NULL && !is_input[1] ? count * each : 0);
    for (int64_t i = 0; status != NULL && !is_input[2] && i < count; i++) {
        status[i] = whole;
    }
    hopform_plan_real plan;
    run_real run = {0, HOPFORM_OK};
    for (int64_t i = 0; whole >= 0 && i < count; i++) {
        hopform_step_real step;
        hopform_stance_real stance;
        status[i] = plan_for_real(&plan, &run, in, i, count);
        if (status[i] >= 0) { status[i] = solve_column_real(&plan, in, i, &step, phases, capacity, &stance); }
        if (status[i] == HOPFORM_OK) { status[i] = read(&plan, &step, phases, &stance, results + i * each); }
        if (status[i] != HOPFORM_OK) { no_numbers(results + i * each, each); }
        whole = status[i] == HOPFORM_PHASES_NOT_KEPT ? status[i] : whole;
    }
    return whole;
}

static int32_t read_sensitivities(const hopform_plan_real *plan, const hopform_step_real *steps,
                                  const hopform_phase_real *phases, const hopform_stance_real *stance, real *matrix) {
    const int32_t status = hopform_stance_sensitivities_real(plan, steps, phases, stance, matrix);
#if HOPFORM_HAS_CONTACT
    enum { APEX = 5 };
    const bool has_apex = stance->ending == HOPFORM_ENDING_TAKEOFF && fall_of_real(&plan->robot) > 0.0;
    no_numbers(matrix + APEX * ROW, has_apex ? 0 : ROW);
#endif
    return status;
}

/* Derivatives of `count` stances, each as hopform_stance_sensitivities gives it: one matrix after the other, NaN
 * where there is none. phases: where one stance after the other is solved. status: one a stance, HOPFORM_OK,
 * HOPFORM_NO_DERIVATIVE, HOPFORM_PHASES_NOT_KEPT where `capacity` phases were too few (returned too, then), or an
 * error. A row that only a rise behind a contact has is NaN without one. A negative status refuses every stance. */
int32_t hopform_stances_sensitivities_real(int64_t count, const hopform_stances_in_real *in, hopform_phase_real *phases,
                                           int32_t capacity, real *matrices, int32_t *status) {
    return read_all(read_sensitivities, MATRIX, count, in, phases, capacity, matrices, status);
}

#if HOPFORM_HAS_CONTACT
/* The largest compressions of `count` stances [m], each as hopform_stance_compression gives it, NaN where there is
 * none; phases and statuses as in hopform_stances_sensitivities. */
int32_t hopform_stances_compressions_real(int64_t count, const hopform_stances_in_real *in, hopform_phase_real *phases,
                                          int32_t capacity, real *compressions, int32_t *status) {
    return read_all(hopform_stance_compression_real, 1, count, in, phases, capacity, compressions, status);
}
#endif
