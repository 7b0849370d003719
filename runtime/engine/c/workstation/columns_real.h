/* SPDX-License-Identifier: MIT-0
 *
 * Columns of a batch: where stances are read and results are written. Nothing is copied: every column has its own
 * stride.
 */
#ifndef HOPFORM_COLUMNS_H_real
#define HOPFORM_COLUMNS_H_real

#include <stdbool.h>

#include "model_real.h"

static inline real number_real(const hopform_input_real *column, int64_t i) {
    const void *place = (const char *)column->first + column->stride * (ptrdiff_t)i;
    return *(const real *)place;
}

static inline void put_real(const hopform_output_real *column, int64_t i, real value) {
    if (column->first != NULL) {
        void *place = (char *)column->first + column->stride * (ptrdiff_t)i;
        *(real *)place = value;
    }
}

static inline void put_code_real(const hopform_output_real *column, int64_t i, int32_t value) {
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
} elements_real;

/* Whether one of `count` elements of a column, whose first lies `distance` bytes behind the beginning of a range, has a
 * byte in common with it: the first element that ends behind that beginning decides. */
static inline bool meets_range_real(int64_t distance, int64_t stride, int64_t count, int64_t size, int64_t range) {
    const int64_t pace = stride < 0 ? -stride : stride;
    const int64_t length = (count - 1) * pace;
    const int64_t lowest = stride < 0 ? distance - length : distance;
    if (lowest >= range || lowest + length <= -size) { return false; }
    const int64_t n = lowest > -size ? 0 : (-size - lowest) / pace + 1;
    return lowest + n * pace < range;
}

/* Whether elements of two columns have a byte in common. Where their strides are equal, only the difference of two
 * elements' numbers counts; else each element of one is compared with the other column. */
static inline bool columns_meet_real(const elements_real *one, const elements_real *other, int64_t count) {
    const int64_t size = (int64_t)other->size, range = (int64_t)one->size;
    const int64_t distance = (int64_t)(uintptr_t)other->first - (int64_t)(uintptr_t)one->first;
    if (one->first == NULL || other->first == NULL || size == 0 || count <= 0) { return false; }
    const int64_t span = (count - 1) * one->stride;
    if (one->stride == other->stride) {
        return meets_range_real(distance - span, other->stride, 2 * count - 1, size, range);
    }
    const int64_t begin = span < 0 ? span : 0;
    if (!meets_range_real(distance - begin, other->stride, count, size, range + span - 2 * begin)) { return false; }
    const int64_t elements = one->stride == 0 ? 1 : count;
    bool meet = false;
    for (int64_t n = 0; n < elements && !meet; n++) {
        meet = meets_range_real(distance - n * one->stride, other->stride, count, size, range);
    }
    return meet;
}

/* The columns that are read stand one after the other in their struct: the robot's, the state's, input and horizon. So
 * do those of results: the status, a number for each row of the derivatives, the count of events. */
enum {
    HOPFORM_INPUTS_real = HOPFORM_ROBOT_FIELDS + HOPFORM_AXES + 2,
    HOPFORM_RESULTS_real = HOPFORM_SENSITIVITY_ROWS + 2
};

/* An array that all stances share, or one after the other works in. */
static inline elements_real shared_real(const void *first, int32_t count, size_t size) {
    const elements_real elements = {first, 0, first != NULL && count > 0 ? (size_t)count * size : 0};
    return elements;
}

/* Steps that may be read: none where there are too many. */
static inline int32_t steps_of_real(const hopform_stances_in_real *in) {
    return in->step_count <= HOPFORM_MOST_STEPS ? in->step_count : 0;
}

/* From the first to the last input of a stance's steps: nothing may be written between them either. */
static inline elements_real inputs_of_steps_real(const hopform_stances_in_real *in) {
    const ptrdiff_t span = steps_of_real(in) > 1 ? in->step_stride * (steps_of_real(in) - 1) : 0;
    const char *first = in->u.first;
    const size_t more = (size_t)(span < 0 ? -span : span);
    const elements_real column = {first == NULL || span >= 0 ? first : first + span, in->u.stride, more + sizeof(real)};
    return column;
}

/* Status of a call that reads stances and writes some columns: HOPFORM_OK if it can. None of them may overlap `itself`
 * either. Says of each column whether it lies in an input: a refusal does not write there. */
static inline int32_t batch_status_real(int64_t count, const hopform_stances_in_real *in, const void *itself,
                                        size_t size, const elements_real *written, int written_count, bool *is_input) {
    enum { MORE = 5, READ = HOPFORM_INPUTS_real + MORE };
    elements_real read[READ] = {{in, 0, sizeof *in}, {itself, 0, size}};
    const void *first = in;
    const hopform_input_real *columns = first;
    bool missing = in == NULL;
    bool overlap = false;
    if (in != NULL) {
        read[2] = shared_real(in->step_times, steps_of_real(in), sizeof *in->step_times);
        read[3] = shared_real(in->times, in->time_count, sizeof *in->times);
        read[4] = shared_real(in->columns, in->column_count, sizeof *in->columns);
    }
    for (int n = 0; n < HOPFORM_INPUTS_real && in != NULL; n++) {
        const elements_real column = {columns[n].first, columns[n].stride, sizeof(real)};
        read[n + MORE] = &columns[n] == &in->u ? inputs_of_steps_real(in) : column;
        missing = missing || (column.first == NULL && count > 0);
    }
    for (int j = 0; j < written_count; j++) {
        is_input[j] = false;
        for (int i = 0; i < READ; i++) {
            is_input[j] = is_input[j] || columns_meet_real(&read[i], &written[j], count);
        }
        overlap = overlap || is_input[j];
    }
    return missing ? HOPFORM_ERROR_NULL : (overlap ? HOPFORM_ERROR_OVERLAP : HOPFORM_OK);
}

/* ---- the robot ---- */

static inline hopform_robot_real robot_of_real(const hopform_stances_in_real *in, int64_t i) {
    const hopform_input_real *column = in->robot;
    hopform_robot_real robot;
#define READ_PARAMETER(name, domain) robot.name = number_real(column++, i);
    HOPFORM_ROBOT_MEMBERS(READ_PARAMETER)
#undef READ_PARAMETER
    return robot;
}

/* Stances with the same robot, one after the other: where they end, and the status of their plan. */
typedef struct {
    int64_t end;
    int32_t planned;
} run_real;

/* Where the run ends that begins with stance i. NaN differs from everything. */
static inline int64_t end_of_run_real(const hopform_stances_in_real *in, int64_t i, int64_t count) {
    int64_t end = count;
    for (int n = 0; n < HOPFORM_ROBOT_FIELDS && end > i + 1; n++) {
        const real here = number_real(&in->robot[n], i);
        for (int64_t j = i + 1; j < end && in->robot[n].stride != 0; j++) {
            const real there = number_real(&in->robot[n], j);
            end = here <= there && here >= there ? end : j;
        }
    }
    return end;
}

/* Where stance i begins a run, make its plan and find its end; the status of the plan. */
static inline int32_t plan_for_real(hopform_plan_real *plan, run_real *run, const hopform_stances_in_real *in,
                                    int64_t i, int64_t count) {
    if (i == run->end) {
        const hopform_robot_real robot = robot_of_real(in, i);
        run->planned = hopform_plan_init_real(plan, &robot);
        run->end = end_of_run_real(in, i, count);
    }
    return run->planned;
}

/* ---- the results ---- */

/* The events among the phases kept, where they are wanted; true if they are all that there are. */
static inline bool put_events_real(const hopform_stances_out_real *out, int64_t i, const hopform_stance_real *stance,
                                   const hopform_phase_real *phases) {
    int32_t from = 0;
    int32_t found = 0;
    for (int32_t n = 0; n < out->event_capacity; n++) {
        while (from < stance->phases_kept && !HOPFORM_IS_EVENT(phases[from].event)) {
            from++;
        }
        const bool has = from < stance->phases_kept;
        if (out->event_time != NULL) {
            out->event_time[i * out->event_capacity + n] = has ? phases[from].t : (real)NAN;
        }
        if (out->event_kind != NULL) {
            out->event_kind[i * out->event_capacity + n] = (int8_t)(has ? phases[from].event : HOPFORM_EVENT_NONE);
        }
        from++;
        found += has ? 1 : 0;
    }
    return out->event_time == NULL || found == stance->event_count;
}

/* Put stance i, solved or refused, where it belongs; HOPFORM_PHASES_NOT_KEPT if its events do not fit. */
static inline int32_t put_stance_real(const hopform_stances_out_real *out, int64_t i, const hopform_robot_real *robot,
                                      int32_t status, const hopform_stance_real *solved,
                                      const hopform_phase_real *phases) {
    const real none = (real)NAN;
    hopform_stance_real refused = {0};
    const hopform_stance_real *stance = status < 0 ? &refused : solved;
    const void *first = out;
    const hopform_output_real *results = first;
    real numbers[HOPFORM_RESULTS_real - 2];
    refused.ending = status;
    const real shown[] = {stance->duration, HOPFORM_SHOWN_real(robot, &stance->end)};
    for (size_t n = 0; n < sizeof shown / sizeof shown[0]; n++) {
        numbers[n] = status < 0 ? none : shown[n];
    }
#if HOPFORM_HAS_CONTACT
    const bool flies = stance->ending == HOPFORM_ENDING_TAKEOFF && fall_of_real(robot) > 0.0;
    numbers[5] = flies ? stance->apex : none;
    numbers[6] = status < 0 ? none : stance->aed;
#endif
    put_code_real(&out->status, i, stance->ending);
    for (int n = 0; n < HOPFORM_RESULTS_real - 2; n++) {
        put_real(&results[n + 1], i, numbers[n]);
    }
    put_code_real(&out->event_count, i, stance->event_count);
    return put_events_real(out, i, stance, phases) ? HOPFORM_OK : HOPFORM_PHASES_NOT_KEPT;
}

/* ---- one stance ---- */

/* Whether more than the events is read of the phases of a stance, all of which must then be kept. */
static inline bool reads_phases_real(const hopform_stances_out_real *out) {
#if HOPFORM_HAS_CONTACT
    if (out->compressions != NULL) { return true; }
#endif
    return out->states != NULL || out->sensitivities != NULL || out->tangents != NULL;
}

/* How many phases of a stance are to be kept for what is read of them; a capacity below 0 is none. */
static inline int32_t phases_wanted_real(const hopform_stances_out_real *out) {
    const bool wanted = out->event_time != NULL || reads_phases_real(out);
    return wanted && out->phase_capacity > 0 ? out->phase_capacity : 0;
}

static inline hopform_state_real start_of_real(const hopform_stances_in_real *in, int64_t i) {
    const void *first = in;
    const hopform_input_real *columns = first;
    state_by_axis_real start;
    for (int axis = 0; axis < HOPFORM_AXES; axis++) {
        start.of[axis] = number_real(&columns[HOPFORM_ROBOT_FIELDS + axis], i);
    }
    return start.named;
}

/* The steps of stance i: in the caller's memory, whose times stand there, or one from 0 on. */
static inline void put_steps_real(const hopform_stances_in_real *in, int64_t i, hopform_step_real *steps) {
    hopform_input_real input = in->u;
    const char *first = in->u.first;
    for (int32_t n = 0; n < in->step_count || n == 0; n++) {
        input.first = first + in->step_stride * (ptrdiff_t)n;
        steps[n].u = number_real(&input, i);
    }
}

/* Solve stance i of a robot by itself. */
static inline int32_t solve_column_real(const hopform_plan_real *plan, const hopform_stances_in_real *in, int64_t i,
                                        const hopform_step_real *steps, hopform_phase_real *phases, int32_t capacity,
                                        hopform_stance_real *stance) {
    const hopform_state_real start = start_of_real(in, i);
    return hopform_solve_stance_real(plan, &start, steps, in->step_times != NULL ? in->step_count : 1,
                                     number_real(&in->horizon, i), in->max_phases, phases, capacity, stance);
}

#endif
