/* SPDX-License-Identifier: MIT-0
 *
 * Many stances, one after the other, from columns to columns.
 */
#include <fenv.h>

#include "columns_real.h"

/* What stances do to the processor's flags is no news to the caller. */
static int32_t solve(int64_t count, const hopform_stances_in_real *in, const hopform_stances_out_real *out) {
    fenv_t before;
    (void)fegetenv(&before);
    hopform_plan_real plan;
    run_real run = {0, HOPFORM_OK};
    int32_t kept = HOPFORM_OK;
    for (int64_t i = 0; i < count; i++) {
        const int32_t planned = plan_for_real(&plan, &run, in, i, count);
        const int32_t put = solve_alone_real(&plan, planned, in, i, out);
        kept = put > kept ? put : kept;
    }
    (void)fesetenv(&before);
    return kept;
}

/* ---- what users call ---- */

enum { WRITTEN = HOPFORM_RESULTS_real + 3 };

/* Status of a batch: HOPFORM_OK if it can be solved; which columns lie in an input. */
static int32_t status_of(int64_t count, const hopform_stances_in_real *in, const hopform_stances_out_real *out,
                         bool is_input[WRITTEN]) {
    const bool missing =
        (out->phases == NULL && out->phase_capacity > 0) || (out->event_time == NULL) != (out->event_kind == NULL);
    const size_t events = out->event_capacity > 0 ? (size_t)out->event_capacity : 0;
    const size_t phases = out->phase_capacity > 0 ? (size_t)out->phase_capacity : 0;
    elements_real written[WRITTEN] = {
        {out->event_time, (ptrdiff_t)(events * sizeof(real)), events * sizeof(real)},
        {out->event_kind, (ptrdiff_t)events, events},
        {out->phases, 0, phases * sizeof *out->phases},
    };
    const void *first = out;
    const hopform_output_real *results = first;
    for (int n = 0; n < HOPFORM_RESULTS_real; n++) {
        const bool is_code = &results[n] == &out->status || &results[n] == &out->event_count;
        const elements_real column = {results[n].first, results[n].stride, is_code ? sizeof(int32_t) : sizeof(real)};
        written[n + 3] = column;
    }
    const int32_t status = batch_status_real(count, in, out, sizeof *out, written, WRITTEN, is_input);
    return missing ? HOPFORM_ERROR_NULL : status;
}

/* Solve `count` stances, each as hopform_solve_stance does, to the same bits. The plan is made again only where the
 * robot changes. HOPFORM_PHASES_NOT_KEPT if the events of a stance did not fit, as its event_count shows. Columns of
 * inputs must not be NULL; they may be interleaved with columns of results. A negative status refuses every stance. */
int32_t hopform_solve_stances_real(int64_t count, const hopform_stances_in_real *in,
                                   const hopform_stances_out_real *out) {
    if (out == NULL) { return HOPFORM_ERROR_NULL; }
    bool is_input[WRITTEN];
    const int32_t status = status_of(count, in, out, is_input);
    if (status < 0) {
        hopform_stances_out_real own = *out;
        void *first = &own;
        hopform_output_real *results = first;
        own.event_time = is_input[0] ? NULL : own.event_time;
        own.event_kind = is_input[1] ? NULL : own.event_kind;
        for (int n = 0; n < HOPFORM_RESULTS_real; n++) {
            results[n].first = is_input[n + 3] ? NULL : results[n].first;
        }
        const hopform_robot_real none = {0};
        for (int64_t i = 0; i < count; i++) {
            (void)put_stance_real(&own, i, &none, status, NULL, NULL);
        }
        return status;
    }
    return solve(count, in, out);
}
