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

/* ---- overlap ---- */

/* Elements of `size` bytes, `stride` bytes from one stance to the next; NULL for none. */
typedef struct {
    const void *first;
    ptrdiff_t stride;
    size_t size;
} hopform_elements_real;

/* Whether one of `count` elements of a column, whose first lies `distance` bytes behind the beginning of a range, has a
 * byte in common with it: the first element that ends behind that beginning decides. */
static inline bool hopform_meets_range_real(int64_t distance, int64_t stride, int64_t count, int64_t size,
                                            int64_t range)
{
    const int64_t pace = stride < 0 ? -stride : stride;
    const int64_t length = (count - 1) * pace;
    const int64_t lowest = stride < 0 ? distance - length : distance;
    if (lowest >= range || lowest + length <= -size) {
        return false;
    }
    const int64_t n = lowest > -size ? 0 : (-size - lowest) / pace + 1;
    return lowest + n * pace < range;
}

/* Whether elements of two columns have a byte in common. Where their strides are equal, only the difference of two
 * elements' numbers counts; else each element of one is compared with the other column. */
static inline bool hopform_columns_meet_real(const hopform_elements_real *one, const hopform_elements_real *other,
                                             int64_t count)
{
    const int64_t size = (int64_t)other->size, range = (int64_t)one->size;
    const int64_t distance = (int64_t)(uintptr_t)other->first - (int64_t)(uintptr_t)one->first;
    if (one->first == NULL || other->first == NULL || size == 0 || count <= 0) {
        return false;
    }
    const int64_t span = (count - 1) * one->stride;
    if (one->stride == other->stride) {
        return hopform_meets_range_real(distance - span, other->stride, 2 * count - 1, size, range);
    }
    const int64_t begin = span < 0 ? span : 0;
    if (!hopform_meets_range_real(distance - begin, other->stride, count, size, range + span - 2 * begin)) {
        return false;
    }
    const int64_t elements = one->stride == 0 ? 1 : count;
    bool meet = false;
    for (int64_t n = 0; n < elements && !meet; n++) {
        meet = hopform_meets_range_real(distance - n * one->stride, other->stride, count, size, range);
    }
    return meet;
}

enum { HOPFORM_COLUMNS_READ_real = HOPFORM_ROBOT_FIELDS + 6 };

/* Where the numbers of stances are read. */
static inline void hopform_columns_of_real(const hopform_stances_in_real *in,
                                           hopform_elements_real columns[HOPFORM_COLUMNS_READ_real])
{
    const hopform_input_real *const states[] = {&in->x1, &in->v1, &in->v2, &in->y, &in->u, &in->horizon};
    for (int n = 0; n < HOPFORM_COLUMNS_READ_real; n++) {
        const hopform_input_real *from = n < HOPFORM_ROBOT_FIELDS ? &in->robot[n] : states[n - HOPFORM_ROBOT_FIELDS];
        const hopform_elements_real column = {from->first, from->stride, sizeof(real)};
        columns[n] = column;
    }
}

/* Status of a call that reads stances and writes some columns: HOPFORM_OK if it can. */
static inline int32_t hopform_batch_status_real(int64_t count, const hopform_stances_in_real *in,
                                                const hopform_elements_real *written, int written_count)
{
    hopform_elements_real read[HOPFORM_COLUMNS_READ_real + 1];
    hopform_columns_of_real(in, read);
    const hopform_elements_real itself = {in, 0, sizeof *in};
    read[HOPFORM_COLUMNS_READ_real] = itself;
    int32_t status = HOPFORM_OK;
    for (int i = 0; i <= HOPFORM_COLUMNS_READ_real; i++) {
        if (read[i].first == NULL && count > 0) {
            return HOPFORM_ERROR_NULL;
        }
        for (int j = 0; j < written_count; j++) {
            status = hopform_columns_meet_real(&read[i], &written[j], count) ? HOPFORM_ERROR_OVERLAP : status;
        }
    }
    return status;
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
    const bool flies = stance->ending == HOPFORM_ENDING_TAKEOFF && hopform_fall_of_real(robot) > 0.0;
    hopform_put_code_real(&out->status, i, stance->ending);
    hopform_put_real(&out->duration, i, stance->duration);
    hopform_put_real(&out->x1, i, stance->end.x1);
    hopform_put_real(&out->v1, i, stance->end.v1);
    hopform_put_real(&out->x2, i, hopform_body_height_real(robot, stance->end.x1, stance->end.y));
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
                                           const hopform_stance_real *stance, const hopform_phase_real *phases)
{
    real *times = out->event_time + i * out->event_capacity;
    int8_t *kinds = out->event_kind + i * out->event_capacity;
    int32_t found = 0;
    for (int32_t n = 0; n < stance->phases_kept && found < out->event_capacity; n++) {
        if (phases[n].event != HOPFORM_EVENT_NONE) {
            times[found] = phases[n].t;
            kinds[found] = phases[n].event;
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

/* How many phases of a stance are to be kept for its list. */
static inline int32_t hopform_phases_wanted_real(const hopform_stances_out_real *out)
{
    return out->phases == NULL || out->event_time == NULL ? 0 : out->phase_capacity;
}

static inline hopform_state_real hopform_start_of_real(const hopform_stances_in_real *in, int64_t i)
{
    const hopform_state_real start = {hopform_number_real(&in->x1, i), hopform_number_real(&in->v1, i),
                                      hopform_number_real(&in->v2, i), hopform_number_real(&in->y, i)};
    return start;
}

/* Put stance i, solved or refused, where it belongs; HOPFORM_PHASES_NOT_KEPT if its events do not fit. */
static inline int32_t hopform_put_solved_real(const hopform_stances_out_real *out, int64_t i,
                                              const hopform_robot_real *robot, int32_t status,
                                              const hopform_stance_real *stance, const hopform_phase_real *phases)
{
    if (status < 0) {
        hopform_put_refusal_real(out, i, status);
    } else {
        hopform_put_stance_real(out, i, robot, stance);
    }
    const bool listed = out->event_time == NULL || hopform_put_events_real(out, i, stance, phases);
    return listed ? HOPFORM_OK : HOPFORM_PHASES_NOT_KEPT;
}

/* Solve stance i by itself; HOPFORM_PHASES_NOT_KEPT if its events did not fit. */
static inline int32_t hopform_solve_column_real(const hopform_plan_real *plan, int32_t robot_status,
                                                const hopform_stances_in_real *in, const hopform_stances_out_real *out,
                                                int64_t i)
{
    const hopform_state_real start = hopform_start_of_real(in, i);
    const hopform_step_real step = {0.0, hopform_number_real(&in->u, i)};
    hopform_stance_real stance = {0, {0, 0, 0, 0}, 0, 0, 0, 0, 0, 0, 0};
    int32_t status = robot_status;
    if (status >= 0) {
        status = hopform_solve_stance_real(plan, &start, &step, 1, hopform_number_real(&in->horizon, i), in->max_phases,
                                           out->phases, hopform_phases_wanted_real(out), &stance);
    }
    return hopform_put_solved_real(out, i, &plan->robot, status, &stance, out->phases);
}

#endif
