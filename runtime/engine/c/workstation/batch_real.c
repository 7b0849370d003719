/* SPDX-License-Identifier: MIT-0
 *
 * Many stances, from columns to columns, by the fastest way that the processor has.
 */
#include <fenv.h>

#include "columns_real.h"
#include "variants_real.h"

enum { PHASES_OF_LOOP = 4096, RESULTS = 9, FEW_STANCES = 4 };

/* ---- variants ---- */

int32_t hopform_has_variant_real(int32_t variant)
{
#if defined(HOPFORM_X86_LANES)
    if (variant == HOPFORM_VARIANT_AVX2) {
        return __builtin_cpu_supports("avx2") ? 1 : 0;
    }
    if (variant == HOPFORM_VARIANT_AVX512) {
        const bool has = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")
                         && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
        return has ? 1 : 0;
    }
#endif
    return variant == HOPFORM_VARIANT_BEST || variant == HOPFORM_VARIANT_ONE_BY_ONE
                   || variant == HOPFORM_VARIANT_BASELINE
               ? 1
               : 0;
}

static int32_t best_variant(void)
{
    if (hopform_has_variant_real(HOPFORM_VARIANT_AVX512)) {
        return HOPFORM_VARIANT_AVX512;
    }
    return hopform_has_variant_real(HOPFORM_VARIANT_AVX2) ? HOPFORM_VARIANT_AVX2 : HOPFORM_VARIANT_BASELINE;
}

/* Stances `first` to `end` of one robot, whose plan could not be made if its status is negative. */
static int32_t one_by_one(const hopform_plan_real *plan, int32_t robot_status, int64_t first, int64_t end,
                          const hopform_stances_in_real *in, const hopform_stances_out_real *out)
{
    int32_t kept = HOPFORM_OK;
    for (int64_t i = first; i < end; i++) {
        if (hopform_solve_column_real(plan, robot_status, in, out, i) != HOPFORM_OK) {
            kept = HOPFORM_PHASES_NOT_KEPT;
        }
    }
    return kept;
}

static int32_t by_variant(int32_t variant, const hopform_plan_real *plan, int64_t first, int64_t end,
                          const hopform_stances_in_real *in, const hopform_stances_out_real *out)
{
#if defined(HOPFORM_X86_LANES)
    if (variant == HOPFORM_VARIANT_AVX2) {
        return hopform_lanes_avx2_real(plan, first, end, in, out);
    }
    if (variant == HOPFORM_VARIANT_AVX512) {
        return hopform_lanes_avx512_real(plan, first, end, in, out);
    }
#endif
    return variant == HOPFORM_VARIANT_BASELINE ? hopform_lanes_baseline_real(plan, first, end, in, out)
                                               : one_by_one(plan, HOPFORM_OK, first, end, in, out);
}

/* The batch, one run of stances with the same robot after the other. */
static int32_t solve_by(int32_t variant, int64_t count, const hopform_stances_in_real *in,
                        const hopform_stances_out_real *out)
{
    const bool many_robots = hopform_has_many_robots_real(in);
    int32_t kept = HOPFORM_OK;
    int64_t end = 0;
    for (int64_t first = 0; first < count; first = end) {
        end = many_robots ? first + 1 : count;
        while (end < count && !hopform_robot_changes_real(in, end)) {
            end++;
        }
        hopform_plan_real plan;
        const hopform_robot_real robot = hopform_robot_of_real(in, first);
        const int32_t robot_status = hopform_plan_init_real(&plan, &robot);
        const bool few = robot_status < 0 || end - first < FEW_STANCES;
        const int32_t run = few ? one_by_one(&plan, robot_status, first, end, in, out)
                                : by_variant(variant, &plan, first, end, in, out);
        kept = run > kept ? run : kept;
    }
    return kept;
}

/* A lane computes what it does not use as well: what that does to the processor's flags is no news to the caller. */
static int32_t solve(int32_t variant, int64_t count, const hopform_stances_in_real *in,
                     const hopform_stances_out_real *out)
{
    fenv_t before;
    (void)fegetenv(&before);
    const int32_t kept = solve_by(variant == HOPFORM_VARIANT_BEST ? best_variant() : variant, count, in, out);
    (void)fesetenv(&before);
    return kept;
}

/* ---- what users call ---- */

enum { WRITTEN = RESULTS + 4 };

/* Where results go, and the struct of their addresses, which no result may overlap. */
static void columns_written(const hopform_stances_out_real *out, hopform_elements_real columns[WRITTEN])
{
    const hopform_output_real *const results[RESULTS] = {
        &out->status, &out->event_count, &out->duration, &out->x1, &out->v1, &out->x2, &out->v2, &out->apex, &out->aed};
    for (int n = 0; n < RESULTS; n++) {
        const size_t size = n < 2 ? sizeof(int32_t) : sizeof(real);
        const hopform_elements_real column = {results[n]->first, results[n]->stride, size};
        columns[n] = column;
    }
    const size_t events = out->event_capacity > 0 ? (size_t)out->event_capacity : 0;
    const size_t phases = out->phase_capacity > 0 ? (size_t)out->phase_capacity : 0;
    const hopform_elements_real others[] = {
        {out->event_time, (ptrdiff_t)(events * sizeof(real)), events * sizeof(real)},
        {out->event_kind, (ptrdiff_t)events, events},
        {out->phases, 0, phases * sizeof *out->phases},
        {out, 0, sizeof *out},
    };
    for (int n = 0; n < WRITTEN - RESULTS; n++) {
        columns[RESULTS + n] = others[n];
    }
}

/* Status of a batch: HOPFORM_OK if it can be solved. */
static int32_t status_of(int32_t variant, int64_t count, const hopform_stances_in_real *in,
                         const hopform_stances_out_real *out)
{
    if (in == NULL || (out->phases == NULL && out->phase_capacity > 0)
        || (out->event_time == NULL) != (out->event_kind == NULL)) {
        return HOPFORM_ERROR_NULL;
    }
    if (!hopform_has_variant_real(variant)) {
        return HOPFORM_ERROR_VARIANT;
    }
    hopform_elements_real written[WRITTEN];
    columns_written(out, written);
    const int32_t status = hopform_batch_status_real(count, in, written, WRITTEN);
    bool overlap = false;
    for (int n = 0; n < WRITTEN - 1; n++) {
        overlap = overlap || hopform_columns_meet_real(&written[WRITTEN - 1], &written[n], count);
    }
    return status == HOPFORM_OK && overlap ? HOPFORM_ERROR_OVERLAP : status;
}

/* Every stance refused with a status. */
static int32_t refuse(int32_t status, int64_t count, const hopform_stances_out_real *out)
{
    const hopform_stances_out_real own = *out; /* which results may overwrite */
    const int64_t events = own.event_capacity > 0 ? count * own.event_capacity : 0;
    for (int64_t i = 0; i < count; i++) {
        hopform_put_refusal_real(&own, i, status);
    }
    for (int64_t n = 0; own.event_time != NULL && n < events; n++) {
        own.event_time[n] = (real)NAN;
    }
    for (int64_t n = 0; own.event_kind != NULL && n < events; n++) {
        own.event_kind[n] = HOPFORM_EVENT_NONE;
    }
    return status;
}

int32_t hopform_solve_stances_by_real(int32_t variant, int64_t count, const hopform_stances_in_real *in,
                                      const hopform_stances_out_real *out)
{
    if (out == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const int32_t status = status_of(variant, count, in, out);
    return status < 0 ? refuse(status, count, out) : solve(variant, count, in, out);
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
    hopform_stances_in_real in;
    hopform_input_real *states[] = {&in.x1, &in.v1, &in.v2, &in.y, &in.u, &in.horizon};
    const int inputs = (int)(sizeof states / sizeof states[0]);
    for (int n = 0; n < inputs; n++) {
        states[n]->first = args[n];
        states[n]->stride = steps[n];
    }
    const real none = (real)NAN;
    const int fits = dimensions[1] == HOPFORM_ROBOT_FIELDS;
    for (int n = 0; n < HOPFORM_ROBOT_FIELDS; n++) {
        in.robot[n].first = fits ? (const void *)(args[inputs] + n * steps[inputs + 1 + RESULTS]) : (const void *)&none;
        in.robot[n].stride = fits ? steps[inputs] : 0;
    }
    in.max_phases = PHASES_OF_LOOP;
    hopform_stances_out_real out;
    hopform_output_real *results[RESULTS] = {&out.status, &out.duration, &out.x1,  &out.v1,         &out.x2,
                                             &out.v2,     &out.apex,     &out.aed, &out.event_count};
    for (int n = 0; n < RESULTS; n++) {
        results[n]->first = args[inputs + 1 + n];
        results[n]->stride = steps[inputs + 1 + n];
    }
    out.phases = NULL;
    out.phase_capacity = 0;
    out.event_time = NULL;
    out.event_kind = NULL;
    out.event_capacity = 0;
    (void)solve(HOPFORM_VARIANT_BEST, dimensions[0], &in, &out); /* NumPy copies what overlaps */
}
