/* SPDX-License-Identifier: MIT-0
 *
 * Many flights, one after the other, from columns to columns; their states at shared times, and their derivatives.
 */
#include <fenv.h>
#include <string.h>

#include "chosen_real.h"
#include "columns_real.h"

/* The columns of results stand one after the other in their struct: the status, numbers, the count of events. */
enum { NUMBERS = 13, RESULTS = NUMBERS + 2, LISTS = 5, WRITTEN = LISTS + RESULTS, FURTHER_READ = 3 };

/* Where robots, starts and longest times are read, and what is asked, as of stances, with the ground in place of the
 * input. Without inputs nothing is asked. */
static hopform_stances_in_real as_stances(const hopform_flights_in_real *in) {
    hopform_stances_in_real like;
    (void)memset(&like, 0, sizeof like);
    if (in == NULL) { return like; }
    for (int n = 0; n < HOPFORM_ROBOT_FIELDS; n++) {
        like.robot[n] = in->robot[n];
    }
    like.x1 = in->x1;
    like.v1 = in->v1;
    like.v2 = in->v2;
    like.y = in->y;
    like.u = in->ground;
    like.horizon = in->horizon;
    like.max_phases = in->max_phases;
    like.times = in->times;
    like.columns = in->columns;
    like.time_count = in->time_count;
    like.column_count = in->column_count;
    return like;
}

static chosen_real columns_of(const hopform_stances_in_real *asked) {
    return chosen_of_real(asked->columns, asked->column_count, HOPFORM_FLIGHT_COLUMNS);
}

/* ---- one flight ---- */

/* The events among the phases, NaN behind the last one; true if they are all that there are. */
static bool put_events(const hopform_flights_out_real *out, int64_t i, const hopform_flight_real *flight) {
    int32_t from = 0;
    int32_t found = 0;
    for (int32_t n = 0; n < out->event_capacity; n++) {
        while (from < flight->phases_kept && out->phases[from].event == HOPFORM_EVENT_NONE) {
            from++;
        }
        const bool has = from < flight->phases_kept;
        if (out->event_time != NULL) {
            out->event_time[i * out->event_capacity + n] = has ? out->phases[from].t : (real)NAN;
        }
        if (out->event_kind != NULL) {
            out->event_kind[i * out->event_capacity + n] = has ? out->phases[from].event : HOPFORM_EVENT_NONE;
        }
        from++;
        found += has ? 1 : 0;
    }
    return out->event_time == NULL || found == flight->event_count;
}

/* The states at the times that a flight has, NaN behind its ending. */
static void put_states(const hopform_plan_real *plan, const hopform_stances_in_real *asked,
                       const hopform_flights_out_real *out, int64_t i, const hopform_flight_real *flight, bool whole) {
    const hopform_state_real none = {(real)NAN, (real)NAN, (real)NAN, (real)NAN};
    hopform_state_real *states = out->states + i * asked->time_count;
    int32_t has = 0;
    while (whole && has < asked->time_count && asked->times[has] <= flight->duration) {
        has++;
    }
    if (has > 0) { (void)hopform_flight_at_real(plan, out->phases, flight, asked->times, has, states); }
    for (int32_t n = has; n < asked->time_count; n++) {
        states[n] = none;
    }
}

static void put_sensitivities(const hopform_plan_real *plan, const hopform_stances_in_real *asked,
                              const hopform_flights_out_real *out, int64_t i, const hopform_flight_real *flight,
                              bool whole) {
    const int32_t count = columns_of(asked).count;
    const int64_t each = (int64_t)HOPFORM_FLIGHT_ROWS * count;
    real *matrix = out->sensitivities + i * each;
    const bool has =
        whole
        && hopform_flight_sensitivities_real(plan, out->phases, flight, asked->columns, count, matrix) == HOPFORM_OK;
    for (int64_t n = 0; !has && n < each; n++) {
        matrix[n] = (real)NAN;
    }
}

/* Put flight i, solved or refused, where it belongs; HOPFORM_PHASES_NOT_KEPT if a list of it is not whole. */
static int32_t put_flight(const hopform_plan_real *plan, const hopform_stances_in_real *asked,
                          const hopform_flights_out_real *out, int64_t i, int32_t status,
                          const hopform_flight_real *solved) {
    const hopform_flight_real refused = {.ending = status};
    const hopform_flight_real *flight = status < 0 ? &refused : solved;
    const bool whole = status == HOPFORM_OK;
    const void *first = out;
    const hopform_output_real *results = first;
    real numbers[NUMBERS];
    for (int n = 0; n < NUMBERS; n++) {
        numbers[n] = (real)NAN;
    }
    if (status >= 0) {
        const real shown[NUMBERS] = {
            flight->duration,    HOPFORM_SHOWN_real(&plan->robot, &flight->end),
            flight->v2_after,    flight->end.y,
            flight->apex,        flight->apex_time,
            flight->impact_loss, flight->leg_loss,
            flight->gains.Kp,    flight->gains.Kd,
        };
        for (int n = 0; n < NUMBERS; n++) {
            numbers[n] = shown[n];
        }
    }
    put_code_real(&out->status, i, flight->ending);
    for (int n = 0; n < NUMBERS; n++) {
        put_real(&results[n + 1], i, numbers[n]);
    }
    put_code_real(&out->event_count, i, flight->event_count);
    bool kept = put_events(out, i, flight);
    if (out->states != NULL) { put_states(plan, asked, out, i, flight, whole); }
    if (out->sensitivities != NULL) { put_sensitivities(plan, asked, out, i, flight, whole); }
    kept = kept && (whole || status < 0 || (out->states == NULL && out->sensitivities == NULL));
    return kept ? HOPFORM_OK : HOPFORM_PHASES_NOT_KEPT;
}

static int32_t solve_flight(const hopform_plan_real *plan, const hopform_flights_in_real *in,
                            const hopform_stances_in_real *like, int64_t i, const hopform_flights_out_real *out,
                            hopform_flight_real *flight) {
    const bool lists = out->event_time != NULL || out->states != NULL || out->sensitivities != NULL;
    const int32_t capacity = lists && out->phase_capacity > 0 ? out->phase_capacity : 0;
    const hopform_state_real start = start_of_real(like, i);
    const bool designed = in->gains[0].first == NULL;
    hopform_gains_real gains = {0.0, 0.0};
    if (!designed) {
        gains.Kp = number_real(&in->gains[0], i);
        gains.Kd = number_real(&in->gains[1], i);
    }
    return hopform_solve_flight_real(plan, &start, number_real(&in->ground, i), designed ? NULL : &gains,
                                     number_real(&in->horizon, i), in->max_phases, out->phases, capacity, flight);
}

/* What flights do to the processor's flags is no news to the caller. */
static int32_t solve(int64_t count, const hopform_flights_in_real *in, const hopform_flights_out_real *out) {
    fenv_t before;
    (void)fegetenv(&before);
    const hopform_stances_in_real like = as_stances(in);
    hopform_plan_real plan;
    run_real run = {0, HOPFORM_OK};
    int32_t kept = HOPFORM_OK;
    for (int64_t i = 0; i < count; i++) {
        hopform_flight_real flight;
        const int32_t planned = plan_for_real(&plan, &run, &like, i, count);
        const int32_t status = planned < 0 ? planned : solve_flight(&plan, in, &like, i, out, &flight);
        const int32_t put = put_flight(&plan, &like, out, i, status, &flight);
        kept = put > kept ? put : kept;
    }
    (void)fesetenv(&before);
    return kept;
}

/* ---- what users call ---- */

/* Status of what is asked of each flight: times that do not decrease, columns that there are. */
static int32_t status_of_asked(const hopform_stances_in_real *asked, const hopform_flights_out_real *out) {
    bool in_order = out->states == NULL || asked->time_count >= 0;
    const chosen_real chosen = columns_of(asked);
    const bool known = out->sensitivities == NULL || are_columns_real(&chosen, HOPFORM_FLIGHT_COLUMNS, -1);
    for (int32_t n = 0; out->states != NULL && asked->times != NULL && n < asked->time_count; n++) {
        in_order = in_order && asked->times[n] >= (n > 0 ? asked->times[n - 1] : 0.0);
    }
    return !in_order ? HOPFORM_ERROR_TIME : (known ? HOPFORM_OK : HOPFORM_ERROR_COLUMNS);
}

/* Status of a batch: HOPFORM_OK if it can be solved; which columns lie in an input. */
static int32_t status_of(int64_t count, const hopform_flights_in_real *in, const hopform_flights_out_real *out,
                         bool is_input[WRITTEN]) {
    const hopform_stances_in_real like = as_stances(in);
    const bool missing = (out->phases == NULL && out->phase_capacity > 0)
                         || (out->event_time == NULL) != (out->event_kind == NULL)
                         || (out->states != NULL && like.times == NULL && like.time_count > 0)
                         || (in != NULL && (in->gains[0].first == NULL) != (in->gains[1].first == NULL));
    const size_t events = out->event_capacity > 0 ? (size_t)out->event_capacity : 0;
    const size_t phases = out->phase_capacity > 0 ? (size_t)out->phase_capacity : 0;
    const size_t times = out->states != NULL && like.time_count > 0 ? (size_t)like.time_count : 0;
    const int32_t chosen = columns_of(&like).count;
    const size_t matrix = sizeof(real) * HOPFORM_FLIGHT_ROWS * (chosen > 0 ? (size_t)chosen : 0);
    elements_real written[WRITTEN] = {
        {out->event_time, (ptrdiff_t)(events * sizeof(real)), events * sizeof(real)},
        {out->event_kind, (ptrdiff_t)events, events},
        {out->phases, 0, phases * sizeof *out->phases},
        {out->states, (ptrdiff_t)(times * sizeof *out->states), times * sizeof *out->states},
        {out->sensitivities, (ptrdiff_t)matrix, matrix},
    };
    const void *first = out;
    const hopform_output_real *results = first;
    for (int n = 0; n < RESULTS; n++) {
        const bool is_code = &results[n] == &out->status || &results[n] == &out->event_count;
        const elements_real column = {results[n].first, results[n].stride, is_code ? sizeof(int32_t) : sizeof(real)};
        written[LISTS + n] = column;
    }
    int32_t status = batch_status_real(count, in != NULL ? &like : NULL, out, sizeof *out, written, WRITTEN, is_input);
    const elements_real read[FURTHER_READ] = {
        {in, 0, sizeof *in},
        {in != NULL ? in->gains[0].first : NULL, in != NULL ? in->gains[0].stride : 0, sizeof(real)},
        {in != NULL ? in->gains[1].first : NULL, in != NULL ? in->gains[1].stride : 0, sizeof(real)},
    };
    for (int j = 0; j < WRITTEN; j++) {
        for (int i = 0; i < FURTHER_READ; i++) {
            is_input[j] = is_input[j] || columns_meet_real(&read[i], &written[j], count);
        }
        status = status >= 0 && is_input[j] ? HOPFORM_ERROR_OVERLAP : status;
    }
    if (missing) { return HOPFORM_ERROR_NULL; }
    return status < 0 ? status : status_of_asked(&like, out);
}

/* Solve `count` flights, each as hopform_solve_flight does, to the same bits; what is asked for besides is read of it
 * at once: events, states at times that do not decrease, from 0 on, as hopform_flight_at, derivatives as
 * hopform_flight_sensitivities. For these `phase_capacity` phases are kept: HOPFORM_PHASES_NOT_KEPT if a flight has
 * more, whose states and derivatives are NaN, or if its events did not fit. The plan is made again only where the robot
 * changes. Columns of inputs must not be NULL, but for the gains. A negative status refuses every flight. */
int32_t hopform_solve_flights_real(int64_t count, const hopform_flights_in_real *in,
                                   const hopform_flights_out_real *out) {
    if (out == NULL) { return HOPFORM_ERROR_NULL; }
    bool is_input[WRITTEN];
    const int32_t status = status_of(count, in, out, is_input);
    if (status >= 0) { return solve(count, in, out); }
    const hopform_stances_in_real like = as_stances(in);
    hopform_flights_out_real own = *out;
    void *first = &own;
    hopform_output_real *results = first;
    own.event_time = is_input[0] ? NULL : own.event_time;
    own.event_kind = is_input[1] ? NULL : own.event_kind;
    own.states = is_input[3] ? NULL : own.states;
    const bool has_size = in != NULL && columns_of(&like).count >= 0;
    own.sensitivities = is_input[4] || !has_size ? NULL : own.sensitivities;
    for (int n = 0; n < RESULTS; n++) {
        results[n].first = is_input[n + LISTS] ? NULL : results[n].first;
    }
    for (int64_t i = 0; i < count; i++) {
        (void)put_flight(NULL, &like, &own, i, status, NULL);
    }
    return status;
}
