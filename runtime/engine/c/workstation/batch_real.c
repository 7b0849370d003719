/* SPDX-License-Identifier: MIT-0
 *
 * Many stances, one after the other, from columns to columns: each is solved once for all that is read of it.
 */
#include <fenv.h>

#include "chosen_real.h"
#include "columns_real.h"
#include "phase_real.h"

static void no_numbers(real *numbers, int64_t count) {
    for (int64_t n = 0; n < count; n++) {
        numbers[n] = (real)NAN;
    }
}

/* Without inputs it is not known how many times and columns were meant. */
static int64_t times_of(const hopform_stances_in_real *in) {
    return in != NULL && in->time_count > 0 ? in->time_count : 0;
}

static chosen_real columns_of(const hopform_stances_in_real *in) {
    const chosen_real none = {NULL, 0};
    return in != NULL ? chosen_of_real(in->columns, in->column_count, COLUMNS_real) : none;
}

static int64_t matrix_of(const chosen_real *chosen, int64_t rows) {
    return chosen->count > 0 ? rows * chosen->count : 0;
}

/* ---- what is read of a stance ---- */

/* Where that of a stance goes; NULL for what is not wanted. */
typedef struct {
    hopform_state_real *states;
    real *matrix;
    real *tangents;
    real *largest_y;
    int32_t *status;
    int32_t *tangent_status;
} places;

static places places_of(const hopform_stances_out_real *out, int64_t i, int64_t times, const chosen_real *chosen) {
    places to = {NULL, NULL, NULL, NULL, NULL, NULL};
    if (out->states != NULL) { to.states = out->states + i * times; }
    if (out->sensitivities != NULL) {
        to.matrix = out->sensitivities + i * matrix_of(chosen, HOPFORM_SENSITIVITY_ROWS);
    }
    if (out->tangents != NULL) { to.tangents = out->tangents + i * times * matrix_of(chosen, HOPFORM_TANGENT_ROWS); }
    if (out->reading_status != NULL) { to.status = out->reading_status + i; }
    if (out->tangent_status != NULL) { to.tangent_status = out->tangent_status + i; }
#if HOPFORM_HAS_CONTACT
    if (out->compressions != NULL) { to.largest_y = out->compressions + i; }
#endif
    return to;
}

static void no_state(hopform_state_real *state) {
    state_by_axis_real none;
    no_numbers(none.of, HOPFORM_AXES);
    *state = none.named;
}

/* Nothing can be read of a stance: why. */
static void read_nothing(const places *to, int64_t times, const chosen_real *chosen, int32_t status) {
    for (int64_t n = 0; to->states != NULL && n < times; n++) {
        no_state(to->states + n);
    }
    if (to->matrix != NULL) { no_numbers(to->matrix, matrix_of(chosen, HOPFORM_SENSITIVITY_ROWS)); }
    if (to->tangents != NULL) { no_numbers(to->tangents, times * matrix_of(chosen, HOPFORM_TANGENT_ROWS)); }
    if (to->largest_y != NULL) { no_numbers(to->largest_y, 1); }
    if (to->status != NULL) { *to->status = status; }
    if (to->tangent_status != NULL) { *to->tangent_status = status; }
}

/* A stance that has been solved, and how. */
typedef struct {
    const hopform_plan_real *plan;
    const hopform_step_real *steps;
    const hopform_phase_real *phases;
    const hopform_stance_real *stance;
} solved;

/* Until when a stance has states: at rest it goes on for ever. */
static real latest_of(const hopform_stance_real *stance) {
    return stance->ending == HOPFORM_ENDING_REST ? HOPFORM_NEVER_real : stance->duration;
}

static void read_states(const solved *of, const hopform_stances_in_real *in, hopform_state_real *states) {
    const real latest = latest_of(of->stance);
    reader_real reader = reader_of_real(of->plan, of->steps, of->phases, of->stance->phases_kept);
    for (int32_t n = 0; n < in->time_count; n++) {
        if (in->times[n] <= latest) {
            states[n] = read_state_real(&reader, lesser_real(in->times[n], of->stance->duration));
        } else {
            no_state(&states[n]);
        }
    }
}

static int32_t read_tangents(const solved *of, const hopform_stances_in_real *in, const chosen_real *chosen,
                             real *tangents) {
    const real latest = latest_of(of->stance);
    int32_t within = 0;
    while (within < in->time_count && in->times[within] <= latest) {
        within++;
    }
    const int64_t each = matrix_of(chosen, HOPFORM_TANGENT_ROWS);
    no_numbers(tangents + within * each, (times_of(in) - within) * each);
    return within == 0 ? HOPFORM_OK
                       : hopform_stance_tangents_real(of->plan, of->steps, of->phases, of->stance, in->columns,
                                                      in->column_count, in->times, within, NULL, tangents);
}

/* The status of its ending's derivatives, which are NaN where there are none. */
static int32_t read_sensitivities(const solved *of, const hopform_stances_in_real *in, const chosen_real *chosen,
                                  real *matrix) {
    const int32_t status = hopform_stance_sensitivities_real(of->plan, of->steps, of->phases, of->stance, in->columns,
                                                             in->column_count, matrix);
    if (status != HOPFORM_OK) { no_numbers(matrix, matrix_of(chosen, HOPFORM_SENSITIVITY_ROWS)); }
#if HOPFORM_HAS_CONTACT
    enum { APEX = 5 };
    const bool has_apex = of->stance->ending == HOPFORM_ENDING_TAKEOFF && fall_of_real(&of->plan->robot) > 0.0;
    no_numbers(matrix + matrix_of(chosen, APEX), has_apex ? 0 : matrix_of(chosen, 1));
#endif
    return status;
}

/* Read what is wanted of a stance, all of whose phases are at hand. */
static void read_stance(const solved *of, const hopform_stances_in_real *in, const chosen_real *chosen,
                        const places *to) {
    int32_t status = HOPFORM_OK;
    int32_t tangent_status = HOPFORM_OK;
    if (to->states != NULL) { read_states(of, in, to->states); }
    if (to->matrix != NULL) { status = read_sensitivities(of, in, chosen, to->matrix); }
    if (to->tangents != NULL) { tangent_status = read_tangents(of, in, chosen, to->tangents); }
#if HOPFORM_HAS_CONTACT
    if (to->largest_y != NULL) {
        (void)hopform_stance_compression_real(of->plan, of->steps, of->phases, of->stance, to->largest_y);
    }
#endif
    if (to->status != NULL) { *to->status = status; }
    if (to->tangent_status != NULL) { *to->tangent_status = tangent_status; }
}

/* ---- all of them ---- */

/* What stances do to the processor's flags is no news to the caller. */
static int32_t solve(int64_t count, const hopform_stances_in_real *in, const hopform_stances_out_real *out) {
    fenv_t before;
    (void)fegetenv(&before);
    const chosen_real chosen = columns_of(in);
    hopform_plan_real plan;
    run_real run = {0, HOPFORM_OK};
    hopform_step_real step = {0.0, 0.0};
    hopform_step_real *const steps = in->step_times != NULL ? out->steps : &step;
    for (int32_t n = 0; in->step_times != NULL && n < in->step_count; n++) {
        steps[n].t = in->step_times[n];
    }
    int32_t kept = HOPFORM_OK;
    for (int64_t i = 0; i < count; i++) {
        hopform_stance_real stance;
        int32_t status = plan_for_real(&plan, &run, in, i, count);
        if (status >= 0) {
            put_steps_real(in, i, steps);
            status = solve_column_real(&plan, in, i, steps, out->phases, phases_wanted_real(out), &stance);
        }
        const int32_t put = put_stance_real(out, i, &plan.robot, status, &stance, out->phases);
        const places to = places_of(out, i, times_of(in), &chosen);
        const bool misses = status == HOPFORM_PHASES_NOT_KEPT && (out->event_time != NULL || reads_phases_real(out));
        if (status < 0 || misses) {
            read_nothing(&to, times_of(in), &chosen, status);
        } else {
            const solved of = {&plan, steps, out->phases, &stance};
            read_stance(&of, in, &chosen, &to);
        }
        kept = put > kept || (misses && reads_phases_real(out)) ? HOPFORM_PHASES_NOT_KEPT : kept;
    }
    (void)fesetenv(&before);
    return kept;
}

/* ---- what users call ---- */

enum { LISTS = 10, WRITTEN = HOPFORM_RESULTS_real + LISTS };

/* Whether times are finite and begin no earlier than 0, and are in order where they must be. */
static bool are_times(const hopform_stances_in_real *in, bool in_order) {
    real earliest = 0.0;
    bool sound = true;
    for (int32_t n = 0; in->times != NULL && n < in->time_count; n++) {
        sound = sound && in->times[n] >= earliest && in->times[n] <= HOPFORM_NEVER_real;
        earliest = in_order ? in->times[n] : 0.0;
    }
    return sound;
}

/* Status of what is asked of each stance, and of its steps. */
static int32_t status_of_asked(const hopform_stances_in_real *in, const hopform_stances_out_real *out) {
    const chosen_real chosen = columns_of(in);
    const bool has_steps = in->step_times != NULL ? out->steps != NULL || in->step_count < 1 : in->step_count <= 1;
    const bool at_times = out->states != NULL || out->tangents != NULL;
    if (!has_steps || (at_times && in->times == NULL && in->time_count > 0)) { return HOPFORM_ERROR_NULL; }
    if (in->step_times != NULL && (in->step_count < 1 || in->step_count > HOPFORM_MOST_STEPS)) {
        return HOPFORM_ERROR_STEPS;
    }
    if (at_times && (in->time_count < 0 || !are_times(in, out->tangents != NULL))) { return HOPFORM_ERROR_TIME; }
    return are_of_stance_real(&chosen) ? HOPFORM_OK : HOPFORM_ERROR_COLUMNS;
}

/* Memory of `each` numbers or codes of a size a stance. */
static elements_real list_of(const void *first, int64_t each, size_t size) {
    const size_t bytes = (size_t)each * size;
    const elements_real list = {first, (ptrdiff_t)bytes, bytes};
    return list;
}

/* Status of a batch: HOPFORM_OK if it can be solved; which columns lie in an input. */
static int32_t status_of(int64_t count, const hopform_stances_in_real *in, const hopform_stances_out_real *out,
                         bool is_input[WRITTEN]) {
    const chosen_real chosen = columns_of(in);
    const int64_t times = times_of(in);
    const bool missing =
        (out->phases == NULL && out->phase_capacity > 0) || (out->event_time == NULL) != (out->event_kind == NULL);
    const int64_t events = out->event_capacity > 0 ? out->event_capacity : 0;
#if HOPFORM_HAS_CONTACT
    const elements_real largest_y = list_of(out->compressions, 1, sizeof(real));
#else
    const elements_real largest_y = {NULL, 0, 0};
#endif
    elements_real written[WRITTEN] = {
        list_of(out->event_time, events, sizeof(real)),
        list_of(out->event_kind, events, sizeof(int8_t)),
        shared_real(out->phases, out->phase_capacity, sizeof *out->phases),
        shared_real(out->steps, in != NULL ? steps_of_real(in) : 0, sizeof *out->steps),
        list_of(out->states, times, sizeof *out->states),
        list_of(out->sensitivities, matrix_of(&chosen, HOPFORM_SENSITIVITY_ROWS), sizeof(real)),
        list_of(out->tangents, times * matrix_of(&chosen, HOPFORM_TANGENT_ROWS), sizeof(real)),
        list_of(out->reading_status, 1, sizeof(int32_t)),
        list_of(out->tangent_status, 1, sizeof(int32_t)),
        largest_y,
    };
    const void *first = out;
    const hopform_output_real *results = first;
    for (int n = 0; n < HOPFORM_RESULTS_real; n++) {
        const bool is_code = &results[n] == &out->status || &results[n] == &out->event_count;
        const elements_real column = {results[n].first, results[n].stride, is_code ? sizeof(int32_t) : sizeof(real)};
        written[n + LISTS] = column;
    }
    const int32_t status = batch_status_real(count, in, out, sizeof *out, written, WRITTEN, is_input);
    if (missing || status == HOPFORM_ERROR_NULL) { return HOPFORM_ERROR_NULL; }
    const int32_t of_asked = status_of_asked(in, out);
    return of_asked == HOPFORM_ERROR_NULL || status == HOPFORM_OK ? of_asked : status;
}

/* The results of a batch that is refused, but for those that lie in an input. */
static void refuse_all(int64_t count, const hopform_stances_in_real *in, const hopform_stances_out_real *out,
                       const bool is_input[WRITTEN], int32_t status) {
    const chosen_real chosen = columns_of(in);
    hopform_stances_out_real own = *out;
    void *first = &own;
    hopform_output_real *results = first;
    own.event_time = is_input[0] ? NULL : own.event_time;
    own.event_kind = is_input[1] ? NULL : own.event_kind;
    own.states = is_input[4] ? NULL : own.states;
    own.sensitivities = is_input[5] ? NULL : own.sensitivities;
    own.tangents = is_input[6] ? NULL : own.tangents;
    own.reading_status = is_input[7] ? NULL : own.reading_status;
    own.tangent_status = is_input[8] ? NULL : own.tangent_status;
#if HOPFORM_HAS_CONTACT
    own.compressions = is_input[9] ? NULL : own.compressions;
#endif
    for (int n = 0; n < HOPFORM_RESULTS_real; n++) {
        results[n].first = is_input[n + LISTS] ? NULL : results[n].first;
    }
    const hopform_robot_real none = {0};
    for (int64_t i = 0; i < count; i++) {
        (void)put_stance_real(&own, i, &none, status, NULL, NULL);
        const places to = places_of(&own, i, times_of(in), &chosen);
        read_nothing(&to, times_of(in), &chosen, status);
    }
}

/* Solve `count` stances, each as hopform_solve_stance does, to the same bits. The plan is made again only where the
 * robot changes. Columns of inputs must not be NULL; they may be interleaved with columns of results, but nothing may
 * be written between the inputs of a stance's steps. A negative status refuses every stance.
 *
 * What is read of a stance is what hopform_stance_at, _sensitivities and _tangents say of it, at `times`
 * and by `columns`: NaN behind an ending, which a rest has none, where there are no derivatives, and of a stance that
 * is refused; a row that only a rise behind a contact has is NaN without one. HOPFORM_PHASES_NOT_KEPT if the events of
 * a stance did not fit, as its event_count shows, or its phases did not, of which then nothing else is read: its
 * reading_status, which is HOPFORM_NO_DERIVATIVE where its ending has none. */
int32_t hopform_solve_stances_real(int64_t count, const hopform_stances_in_real *in,
                                   const hopform_stances_out_real *out) {
    if (out == NULL) { return HOPFORM_ERROR_NULL; }
    bool is_input[WRITTEN];
    const int32_t status = status_of(count, in, out, is_input);
    if (status < 0) {
        refuse_all(count, in, out, is_input, status);
        return status;
    }
    return solve(count, in, out);
}
