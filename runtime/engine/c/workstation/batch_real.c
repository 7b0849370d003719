/* SPDX-License-Identifier: MIT-0
 *
 * Many stances, from columns to columns, by the fastest way that the processor has.
 */
#include <fenv.h>

#include "columns_real.h"
#include "variants_real.h"

enum { PHASES_OF_LOOP = 4096, FEW_STANCES = 4 };

/* ---- variants ---- */

/* Solves stances `first` to `end` of one robot. */
typedef int32_t solver(const hopform_plan_real *plan, int64_t first, int64_t end, const hopform_stances_in_real *in,
                       const hopform_stances_out_real *out);

/* The solver of a variant; NULL if the processor has none. */
static solver *solver_of(int32_t variant)
{
#if defined(HOPFORM_X86_LANES)
    const bool is_512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")
                        && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
    if (is_512 && (variant == HOPFORM_VARIANT_AVX512 || variant == HOPFORM_VARIANT_BEST)) {
        return hopform_lanes_avx512_real;
    }
    if (__builtin_cpu_supports("avx2") && (variant == HOPFORM_VARIANT_AVX2 || variant == HOPFORM_VARIANT_BEST)) {
        return hopform_lanes_avx2_real;
    }
#endif
    if (variant == HOPFORM_VARIANT_BASELINE || variant == HOPFORM_VARIANT_BEST) {
        return hopform_lanes_baseline_real;
    }
    return variant == HOPFORM_VARIANT_ONE_BY_ONE ? hopform_one_by_one_real : NULL;
}

int32_t hopform_has_variant_real(int32_t variant)
{
    return solver_of(variant) != NULL ? 1 : 0;
}

/* Every one of some stances refused with a status. */
static int32_t refuse(int32_t status, const hopform_robot_real *robot, int64_t first, int64_t end,
                      const hopform_stances_out_real *out)
{
    for (int64_t i = first; i < end; i++) {
        (void)hopform_put_stance_real(out, i, robot, status, NULL, NULL);
    }
    return status;
}

/* The batch, one run of stances with the same robot after the other. A lane computes what it does not use as well: what
 * that does to the processor's flags is no news to the caller. */
static int32_t solve(solver *by, int64_t count, const hopform_stances_in_real *in, const hopform_stances_out_real *out)
{
    fenv_t before;
    (void)fegetenv(&before);
    int32_t kept = HOPFORM_OK;
    int64_t end = 0;
    for (int64_t first = 0; first < count; first = end) {
        hopform_plan_real plan;
        const hopform_robot_real robot = hopform_robot_of_real(in, first);
        const int32_t status = hopform_plan_init_real(&plan, &robot);
        end = hopform_end_of_run_real(in, first, count);
        solver *run = end - first < FEW_STANCES ? hopform_one_by_one_real : by;
        const int32_t put = status < 0 ? refuse(status, &robot, first, end, out) : run(&plan, first, end, in, out);
        kept = put > kept ? put : kept;
    }
    (void)fesetenv(&before);
    return kept;
}

/* ---- what users call ---- */

enum { WRITTEN = HOPFORM_RESULTS_real + 3 };

/* Status of a batch: HOPFORM_OK if it can be solved. */
static int32_t status_of(int32_t variant, int64_t count, const hopform_stances_in_real *in,
                         const hopform_stances_out_real *out)
{
    if (in == NULL || (out->phases == NULL && out->phase_capacity > 0)
        || (out->event_time == NULL) != (out->event_kind == NULL)) {
        return HOPFORM_ERROR_NULL;
    }
    if (solver_of(variant) == NULL) {
        return HOPFORM_ERROR_VARIANT;
    }
    const size_t events = out->event_capacity > 0 ? (size_t)out->event_capacity : 0;
    const size_t phases = out->phase_capacity > 0 ? (size_t)out->phase_capacity : 0;
    hopform_elements_real written[WRITTEN] = {
        {out->event_time, (ptrdiff_t)(events * sizeof(real)), events * sizeof(real)},
        {out->event_kind, (ptrdiff_t)events, events},
        {out->phases, 0, phases * sizeof *out->phases},
    };
    const void *first = out;
    const hopform_output_real *results = first;
    for (int n = 0; n < HOPFORM_RESULTS_real; n++) {
        const bool is_code = &results[n] == &out->status || &results[n] == &out->event_count;
        const hopform_elements_real column = {results[n].first, results[n].stride,
                                              is_code ? sizeof(int32_t) : sizeof(real)};
        written[n + 3] = column;
    }
    return hopform_batch_status_real(count, in, out, sizeof *out, written, WRITTEN);
}

int32_t hopform_solve_stances_by_real(int32_t variant, int64_t count, const hopform_stances_in_real *in,
                                      const hopform_stances_out_real *out)
{
    if (out == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const int32_t status = status_of(variant, count, in, out);
    if (status < 0) {
        const hopform_stances_out_real own = *out; /* which results may overwrite */
        const hopform_robot_real none = {0};
        return refuse(status, &none, 0, count, &own);
    }
    return solve(solver_of(variant), count, in, out);
}

int32_t hopform_solve_stances_real(int64_t count, const hopform_stances_in_real *in,
                                   const hopform_stances_out_real *out)
{
    return hopform_solve_stances_by_real(HOPFORM_VARIANT_BEST, count, in, out);
}

void hopform_stance_loop_real(char **args, const ptrdiff_t *dimensions, const ptrdiff_t *steps, void *data)
{
    (void)data;
    if (args == NULL || dimensions == NULL || steps == NULL) {
        return;
    }
    enum { STATES = HOPFORM_INPUTS_real - HOPFORM_ROBOT_FIELDS };
    const real none = (real)NAN;
    const bool fits = dimensions[1] == HOPFORM_ROBOT_FIELDS;
    hopform_stances_in_real in;
    hopform_stances_out_real out = {.phases = NULL};
    void *place = &in;
    hopform_input_real *inputs = place;
    for (int n = 0; n < STATES; n++) {
        inputs[HOPFORM_ROBOT_FIELDS + n].first = args[n];
        inputs[HOPFORM_ROBOT_FIELDS + n].stride = steps[n];
    }
    for (int n = 0; n < HOPFORM_ROBOT_FIELDS; n++) {
        in.robot[n].first =
            fits ? (const void *)(args[STATES] + n * steps[STATES + 1 + HOPFORM_RESULTS_real]) : (const void *)&none;
        in.robot[n].stride = fits ? steps[STATES] : 0;
    }
    in.max_phases = PHASES_OF_LOOP;
    place = &out;
    hopform_output_real *results = place;
    for (int n = 0; n < HOPFORM_RESULTS_real; n++) {
        results[n].first = args[STATES + 1 + n];
        results[n].stride = steps[STATES + 1 + n];
    }
    (void)solve(solver_of(HOPFORM_VARIANT_BEST), dimensions[0], &in, &out); /* NumPy copies what overlaps */
}
