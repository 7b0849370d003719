/* SPDX-License-Identifier: MIT-0
 *
 * Columns of a batch: where stances are read and results are written. Nothing is copied: every column has its own
 * stride.
 */
#ifndef HOPFORM_COLUMNS_H_real
#define HOPFORM_COLUMNS_H_real

#include <stdbool.h>

#include "facts.h"
#include "formulas_real.h"

static inline real hopform_number_real(const hopform_input_real *column, int64_t i)
{
    const void *place = (const char *)column->first + column->stride * (ptrdiff_t)i;
    return *(const real *)place;
}

static inline void hopform_put_real(const hopform_output_real *column, int64_t i, real value)
{
    if (column->first != NULL) {
        void *place = (char *)column->first + column->stride * (ptrdiff_t)i;
        *(real *)place = value;
    }
}

static inline void hopform_put_code_real(const hopform_output_real *column, int64_t i, int32_t value)
{
    if (column->first != NULL) {
        void *place = (char *)column->first + column->stride * (ptrdiff_t)i;
        *(int32_t *)place = value;
    }
}

/* ---- the robot ---- */

static inline hopform_robot_real hopform_robot_of_real(const hopform_stances_in_real *in, int64_t i)
{
    const hopform_input_real *column = in->robot;
    hopform_robot_real robot;
#define READ_PARAMETER(name, domain) robot.name = hopform_number_real(column++, i);
    HOPFORM_ROBOT_MEMBERS(READ_PARAMETER)
#undef READ_PARAMETER
    return robot;
}

/* Whether a robot's parameter has a place of its own for each stance. */
static inline bool hopform_has_many_robots_real(const hopform_stances_in_real *in)
{
    for (int n = 0; n < HOPFORM_ROBOT_FIELDS; n++) {
        if (in->robot[n].stride != 0) {
            return true;
        }
    }
    return false;
}

/* Whether stance i has another robot than the one before; NaN differs from everything. */
static inline bool hopform_robot_changes_real(const hopform_stances_in_real *in, int64_t i)
{
    for (int n = 0; n < HOPFORM_ROBOT_FIELDS; n++) {
        if (in->robot[n].stride != 0) {
            const real before = hopform_number_real(&in->robot[n], i - 1);
            const real now = hopform_number_real(&in->robot[n], i);
            if (!(before <= now && before >= now)) {
                return true;
            }
        }
    }
    return false;
}

/* ---- the results ---- */

static inline void hopform_put_stance_real(const hopform_stances_out_real *out, int64_t i,
                                           const hopform_robot_real *robot, const hopform_stance_real *stance)
{
    const bool flies = stance->ending == HOPFORM_ENDING_TAKEOFF && robot->g > 0.0;
    hopform_put_code_real(&out->status, i, stance->ending);
    hopform_put_real(&out->duration, i, stance->duration);
    hopform_put_real(&out->x1, i, stance->end.x1);
    hopform_put_real(&out->v1, i, stance->end.v1);
    hopform_put_real(&out->x2, i, stance->end.x1 - stance->end.y + (robot->L0 + robot->c));
    hopform_put_real(&out->v2, i, stance->end.v2);
    hopform_put_real(&out->apex, i, flies ? stance->apex : (real)NAN);
    hopform_put_real(&out->aed, i, stance->aed);
    hopform_put_code_real(&out->event_count, i, stance->event_count);
}

static inline void hopform_put_refusal_real(const hopform_stances_out_real *out, int64_t i, int32_t status)
{
    const hopform_output_real *numbers[] = {&out->duration, &out->x1,   &out->v1, &out->x2,
                                            &out->v2,       &out->apex, &out->aed};
    hopform_put_code_real(&out->status, i, status);
    hopform_put_code_real(&out->event_count, i, 0);
    for (int n = 0; n < (int)(sizeof numbers / sizeof numbers[0]); n++) {
        hopform_put_real(numbers[n], i, (real)NAN);
    }
}

/* The events among the phases kept; true if they are all that there are. */
static inline bool hopform_put_events_real(const hopform_stances_out_real *out, int64_t i,
                                           const hopform_stance_real *stance)
{
    real *times = out->event_time + i * out->event_capacity;
    int8_t *kinds = out->event_kind + i * out->event_capacity;
    int32_t found = 0;
    for (int32_t n = 0; n < stance->phases_kept && found < out->event_capacity; n++) {
        if (out->phases[n].event != HOPFORM_EVENT_NONE) {
            times[found] = out->phases[n].t;
            kinds[found] = out->phases[n].event;
            found++;
        }
    }
    for (int32_t n = found; n < out->event_capacity; n++) {
        times[n] = (real)NAN;
        kinds[n] = HOPFORM_EVENT_NONE;
    }
    return found == stance->event_count;
}

/* ---- one stance ---- */

static inline int32_t hopform_phases_kept_real(const hopform_stances_out_real *out)
{
    return out->phases == NULL ? 0 : out->phase_capacity;
}

/* Solve stance i by itself; HOPFORM_PHASES_NOT_KEPT if its events did not fit. */
static inline int32_t hopform_solve_column_real(const hopform_plan_real *plan, int32_t robot_status,
                                                const hopform_stances_in_real *in, const hopform_stances_out_real *out,
                                                int64_t i)
{
    const hopform_state_real start = {hopform_number_real(&in->x1, i), hopform_number_real(&in->v1, i),
                                      hopform_number_real(&in->v2, i), hopform_number_real(&in->y, i)};
    const hopform_step_real step = {0.0, hopform_number_real(&in->u, i)};
    hopform_stance_real stance = {0, {0, 0, 0, 0}, 0, 0, 0, 0, 0, 0, 0};
    int32_t status = robot_status;
    if (status >= 0) {
        status = hopform_solve_stance_real(plan, &start, &step, 1, hopform_number_real(&in->horizon, i), in->max_phases,
                                           out->phases, hopform_phases_kept_real(out), &stance);
    }
    if (status < 0) {
        hopform_put_refusal_real(out, i, status);
    } else {
        hopform_put_stance_real(out, i, &plan->robot, &stance);
    }
    const bool listed = out->event_time == NULL || hopform_put_events_real(out, i, &stance);
    return listed ? HOPFORM_OK : HOPFORM_PHASES_NOT_KEPT;
}

#endif
