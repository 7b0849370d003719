/* SPDX-License-Identifier: MIT-0
 *
 * Many stances, from columns to columns, by the fastest way that the processor has.
 */
#include <fenv.h>

#include "columns_real.h"
#include "lanes_real.h"

enum { PHASES_OF_LOOP = 4096 };

/* ---- variants ---- */

static int32_t one_by_one(int64_t count, const hopform_stances_in_real *in, const hopform_stances_out_real *out) {
    hopform_plan_real plan;
    hopform_run_real run = {0, HOPFORM_OK};
    int32_t kept = HOPFORM_OK;
    for (int64_t i = 0; i < count; i++) {
        const int32_t planned = hopform_plan_for_real(&plan, &run, in, i, count);
        const int32_t put = hopform_solve_alone_real(&plan, planned, in, i, out);
        kept = put > kept ? put : kept;
    }
    return kept;
}

/* What a variant does in vector registers, that the processor has; NULL if nothing does. Registers that hold two
 * numbers are not worth it. */
static lanes_code_real code_of(int32_t variant) {
    const bool best = variant == HOPFORM_VARIANT_BEST;
#if defined(HOPFORM_X86_LANES)
    const bool is_512 = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")
                        && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
    if (is_512 && (variant == HOPFORM_VARIANT_AVX512 || best)) { return hopform_lanes_avx512_real(); }
    if (__builtin_cpu_supports("avx2") && (variant == HOPFORM_VARIANT_AVX2 || best)) {
        return hopform_lanes_avx2_real();
    }
#endif
    const lanes_code_real none = {NULL, NULL};
    return variant == HOPFORM_VARIANT_BASELINE || (best && sizeof(real) < 8) ? hopform_lanes_baseline_real() : none;
}

int32_t hopform_has_variant_real(int32_t variant) {
    const bool is_any = variant == HOPFORM_VARIANT_BEST || variant == HOPFORM_VARIANT_ONE_BY_ONE;
    return is_any || code_of(variant).evaluate != NULL ? 1 : 0;
}

/* A lane computes what it does not use as well: what that does to the processor's flags is no news to the caller. */
static int32_t solve(int32_t variant, int64_t count, const hopform_stances_in_real *in,
                     const hopform_stances_out_real *out) {
    fenv_t before;
    (void)fegetenv(&before);
    const lanes_code_real code = code_of(variant);
    const int32_t kept = code.evaluate == NULL || count < LANES_real / 2
                             ? one_by_one(count, in, out)
                             : hopform_solve_in_lanes_real(code, count, in, out);
    (void)fesetenv(&before);
    return kept;
}

/* ---- what users call ---- */

enum { WRITTEN = HOPFORM_RESULTS_real + 3 };

/* Status of a batch: HOPFORM_OK if it can be solved. */
static int32_t status_of(int32_t variant, int64_t count, const hopform_stances_in_real *in,
                         const hopform_stances_out_real *out) {
    if (in == NULL || (out->phases == NULL && out->phase_capacity > 0)
        || (out->event_time == NULL) != (out->event_kind == NULL)) {
        return HOPFORM_ERROR_NULL;
    }
    if (hopform_has_variant_real(variant) == 0) { return HOPFORM_ERROR_VARIANT; }
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
                                      const hopform_stances_out_real *out) {
    if (out == NULL) { return HOPFORM_ERROR_NULL; }
    const int32_t status = status_of(variant, count, in, out);
    if (status < 0) {
        const hopform_stances_out_real own = *out; /* which results may overwrite */
        const hopform_robot_real none = {0};
        for (int64_t i = 0; i < count; i++) {
            (void)hopform_put_stance_real(&own, i, &none, status, NULL, NULL);
        }
        return status;
    }
    return solve(variant, count, in, out);
}

int32_t hopform_solve_stances_real(int64_t count, const hopform_stances_in_real *in,
                                   const hopform_stances_out_real *out) {
    return hopform_solve_stances_by_real(HOPFORM_VARIANT_BEST, count, in, out);
}

void hopform_stance_loop_real(char **args, const ptrdiff_t *dimensions, const ptrdiff_t *steps, void *data) {
    (void)data;
    if (args == NULL || dimensions == NULL || steps == NULL) { return; }
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
    (void)solve(HOPFORM_VARIANT_BEST, dimensions[0], &in, &out); /* NumPy copies what overlaps */
}
