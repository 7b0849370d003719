/* SPDX-License-Identifier: MIT-0
 *
 * Many runs of hops, one after the other: stance, take-off, flight, touchdown on the next ground, and so on, from
 * columns and tables to columns and tables.
 */
#include <fenv.h>

#include "columns_real.h"

/* Columns of results of a run, and tables of those of a hop, which stand one after the other in their struct: the first
 * two, and the first one, are codes. */
enum { RUN_COLUMNS = 8, HOP_TABLES = 13, CODES = 2, EXTRAS = 5 };

static real number_by_hop_real(const hopform_hop_input_real *table, int64_t i, int32_t hop) {
    const void *place = (const char *)table->first + table->stride * (ptrdiff_t)i + table->hop_stride * (ptrdiff_t)hop;
    return *(const real *)place;
}

/* A cell of a table, as a column of which there is one. */
static hopform_output_real cell_real(const hopform_hop_output_real *table, int64_t i, int32_t hop) {
    char *first = table->first;
    const ptrdiff_t distance = table->stride * (ptrdiff_t)i + table->hop_stride * (ptrdiff_t)hop;
    const hopform_output_real cell = {first != NULL ? first + distance : NULL, 0};
    return cell;
}

static void put_by_hop_real(const hopform_hop_output_real *table, int64_t i, int32_t hop, real value) {
    const hopform_output_real cell = cell_real(table, i, hop);
    put_real(&cell, 0, value);
}

/* A run while it hops. */
typedef struct {
    hopform_state_real at; /* where it goes on: in the air over the ground that was left, or at a touchdown */
    real time;
    int32_t done;   /* stances solved */
    int32_t status; /* HOPFORM_RUN_..., or an error; 0 while it goes on */
} hopping_real;

/* Longer than the body takes down to the ground ahead, by a rise of 1 m of the foot besides. */
static real longest_flight_real(const hopform_robot_real *robot, const hopform_state_real *at, real ground) {
    const real g = fall_of_real(robot);
    const real rise = at->v2 * at->v2 + 2.0 * g * (1.0 + fabs_real(ground));
    const real longest = 10.0 + 2.0 * (fabs_real(at->v2) + sqrt_real(rise)) / g;
    return longest <= HOPFORM_NEVER_real ? longest : HOPFORM_NEVER_real;
}

/* From take-off to the touchdown behind it. */
static void fly_real(hopping_real *run, const hopform_plan_real *plan, const hopform_hops_in_real *in, int64_t i) {
    const bool flat = in->ground.first == NULL;
    const real ground = flat ? 0.0 : number_by_hop_real(&in->ground, i, run->done);
    hopform_gains_real gains = {0.0, 0.0};
    const bool designed = in->Kp.first == NULL || in->Kd.first == NULL;
    if (!designed) {
        gains.Kp = number_real(&in->Kp, i);
        gains.Kd = number_real(&in->Kd, i);
    }
    const real longest = longest_flight_real(&plan->robot, &run->at, ground);
    hopform_flight_real flight;
    const int32_t status = hopform_solve_flight_real(plan, &run->at, ground, designed ? NULL : &gains, longest,
                                                     in->runs.max_phases, NULL, 0, &flight);
    if (status < 0) {
        run->status = status;
        return;
    }
    run->time += flight.duration;
    run->at = flight.end;
    if (flight.ending == HOPFORM_FLIGHT_TOUCHDOWN) {
        run->at.v2 = flight.v2_after;
    } else {
        run->status = flight.ending == HOPFORM_FLIGHT_TRIPPED ? HOPFORM_RUN_TRIPPED : HOPFORM_RUN_STOPPED;
    }
}

/* The stance that begins with a touchdown. */
static void stand_real(hopping_real *run, const hopform_plan_real *plan, const hopform_hops_in_real *in, int64_t i,
                       const hopform_hops_out_real *out) {
    const int32_t hop = run->done;
    const real horizon = number_real(&in->runs.horizon, i);
    const hopform_step_real step = {0.0, in->u.first == NULL ? number_real(&in->runs.u, i)
                                                             : number_by_hop_real(&in->u, i, hop)};
    hopform_stance_real stance;
    const int32_t status =
        hopform_solve_stance_real(plan, &run->at, &step, 1, horizon, in->runs.max_phases, NULL, 0, &stance);
    if (status < 0) {
        run->status = status;
        return;
    }
    const bool lifts = stance.ending == HOPFORM_ENDING_TAKEOFF;
    const hopform_output_real ending = cell_real(&out->ending, i, hop);
    put_code_real(&ending, 0, stance.ending);
    put_by_hop_real(&out->touchdown, i, hop, run->time);
    put_by_hop_real(&out->start_x1, i, hop, run->at.x1);
    put_by_hop_real(&out->start_v1, i, hop, run->at.v1);
    put_by_hop_real(&out->start_v2, i, hop, run->at.v2);
    put_by_hop_real(&out->start_y, i, hop, run->at.y);
    put_by_hop_real(&out->stance, i, hop, stance.duration);
    put_by_hop_real(&out->end_x1, i, hop, stance.end.x1);
    put_by_hop_real(&out->end_v1, i, hop, stance.end.v1);
    put_by_hop_real(&out->end_v2, i, hop, stance.end.v2);
    put_by_hop_real(&out->end_y, i, hop, stance.end.y);
    put_by_hop_real(&out->apex, i, hop, lifts ? stance.apex : (real)NAN);
    put_by_hop_real(&out->aed, i, hop, stance.aed);
    run->done++;
    run->time += stance.duration;
    run->at = stance.end;
    run->status = lifts ? 0 : HOPFORM_RUN_STOPPED;
}

/* Nothing is known of the hops that a run has not made. */
static void put_no_hops_real(const hopform_hops_out_real *out, int64_t i, int32_t done, int32_t hops) {
    const void *first = &out->ending;
    const hopform_hop_output_real *tables = first;
    for (int32_t hop = done; hop < hops; hop++) {
        const hopform_output_real ending = cell_real(&out->ending, i, hop);
        put_code_real(&ending, 0, 0);
        for (int n = 1; n < HOP_TABLES; n++) {
            put_by_hop_real(&tables[n], i, hop, (real)NAN);
        }
    }
}

static void put_run_real(const hopform_hops_out_real *out, int64_t i, const hopform_robot_real *robot,
                         const hopping_real *run) {
    const bool refused = run->status < 0;
    const void *first = &out->duration;
    const hopform_output_real *columns = first;
    const real shown[] = {run->time, HOPFORM_SHOWN_real(robot, &run->at), run->at.y};
    put_code_real(&out->status, i, run->status);
    put_code_real(&out->hops, i, run->done);
    for (size_t n = 0; n < sizeof shown / sizeof shown[0]; n++) {
        put_real(&columns[n], i, refused ? (real)NAN : shown[n]);
    }
}

static void solve_run_real(const hopform_plan_real *plan, int32_t planned, const hopform_hops_in_real *in, int64_t i,
                           const hopform_hops_out_real *out) {
    hopping_real run = {{0.0, 0.0, 0.0, 0.0}, 0.0, 0, planned < 0 ? planned : 0};
    run.at = start_of_real(&in->runs, i);
    bool stands = in->from_touchdown != 0;
    while (run.status == 0 && run.done < in->hops) {
        if (!stands) { fly_real(&run, plan, in, i); }
        if (run.status == 0) { stand_real(&run, plan, in, i, out); }
        stands = false;
    }
    run.status = run.status == 0 ? HOPFORM_RUN_COMPLETED : run.status;
    put_no_hops_real(out, i, run.done, in->hops);
    put_run_real(out, i, &plan->robot, &run);
}

/* ---- what users call ---- */

/* The rows of a table as elements of a column; the bytes between the hops of a run belong to its row. */
static elements_real rows_real(const void *first, ptrdiff_t stride, ptrdiff_t hop_stride, int32_t hops, size_t size) {
    const ptrdiff_t length = hop_stride * (ptrdiff_t)(hops - 1);
    const ptrdiff_t low = length < 0 ? length : 0;
    const char *bytes = first;
    const elements_real rows = {bytes != NULL ? bytes + low : NULL, stride, (size_t)(length - 2 * low) + size};
    return rows;
}

/* Status of a call: HOPFORM_OK if its runs can be solved; which results lie in an input. */
static int32_t hops_status_real(int64_t count, const hopform_hops_in_real *in, const hopform_hops_out_real *out,
                                bool is_input[RUN_COLUMNS + HOP_TABLES]) {
    elements_real written[RUN_COLUMNS + HOP_TABLES];
    const void *of_runs = out;
    const hopform_output_real *columns = of_runs;
    const void *of_hops = &out->ending;
    const hopform_hop_output_real *tables = of_hops;
    for (int n = 0; n < RUN_COLUMNS; n++) {
        const elements_real column = {columns[n].first, columns[n].stride, n < CODES ? sizeof(int32_t) : sizeof(real)};
        written[n] = column;
    }
    for (int n = 0; n < HOP_TABLES; n++) {
        written[RUN_COLUMNS + n] = rows_real(tables[n].first, tables[n].stride, tables[n].hop_stride, in->hops,
                                             n == 0 ? sizeof(int32_t) : sizeof(real));
    }
    const elements_real read[EXTRAS] = {
        {in, 0, sizeof *in},
        {in->Kp.first, in->Kp.stride, sizeof(real)},
        {in->Kd.first, in->Kd.stride, sizeof(real)},
        rows_real(in->u.first, in->u.stride, in->u.hop_stride, in->hops, sizeof(real)),
        rows_real(in->ground.first, in->ground.stride, in->ground.hop_stride, in->hops, sizeof(real)),
    };
    int32_t status = batch_status_real(count, &in->runs, out, sizeof *out, written, RUN_COLUMNS + HOP_TABLES, is_input);
    for (int j = 0; j < RUN_COLUMNS + HOP_TABLES; j++) {
        for (int n = 0; n < EXTRAS; n++) {
            is_input[j] = is_input[j] || columns_meet_real(&read[n], &written[j], count);
        }
        status = is_input[j] && status == HOPFORM_OK ? HOPFORM_ERROR_OVERLAP : status;
    }
    return status;
}

/* A refusal of every run, in all results that do not lie in an input. */
static int32_t refuse_runs_real(int32_t status, int64_t count, int32_t hops, const hopform_hops_out_real *out,
                                const bool is_input[RUN_COLUMNS + HOP_TABLES]) {
    hopform_hops_out_real own = *out;
    void *of_runs = &own;
    hopform_output_real *columns = of_runs;
    void *of_hops = &own.ending;
    hopform_hop_output_real *tables = of_hops;
    for (int n = 0; n < RUN_COLUMNS; n++) {
        columns[n].first = is_input[n] ? NULL : columns[n].first;
    }
    for (int n = 0; n < HOP_TABLES; n++) {
        tables[n].first = is_input[RUN_COLUMNS + n] ? NULL : tables[n].first;
    }
    const hopform_robot_real none = {0};
    const hopping_real refused = {{0.0, 0.0, 0.0, 0.0}, 0.0, 0, status};
    for (int64_t i = 0; i < count; i++) {
        put_no_hops_real(&own, i, 0, hops);
        put_run_real(&own, i, &none, &refused);
    }
    return status;
}

/* Solve `count` runs of hops: flight to the touchdown, stance, take-off, flight to the next ground, and so on until
 * `hops` stances are solved, each as hopform_solve_flight and hopform_solve_stance do one after the other, to the same
 * bits.
 *
 * in: as for hopform_solve_stances the robots, the states at the start, the input and the longest time of a stance;
 * beside them tables by hop. A run begins in the air, ground.first being as for hopform_solve_flight, or where
 * from_touchdown is not 0 with its first stance. A run ends, stopped, where a stance has no take-off; tripped, where
 * the foot never gets above the ground ahead; what is known until then stays. An error in a run ends it, with that
 * status; its hops before stand. Behind the last hop the numbers of a run are NaN and its endings 0. Tables must not be
 * interleaved with inputs. No memory is needed for phases. A negative status refuses every run. */
int32_t hopform_solve_hops_real(int64_t count, const hopform_hops_in_real *in, const hopform_hops_out_real *out) {
    if (in == NULL || out == NULL) { return HOPFORM_ERROR_NULL; }
    bool is_input[RUN_COLUMNS + HOP_TABLES];
    if (in->hops < 1) { return HOPFORM_ERROR_HORIZON; }
    const int32_t status = hops_status_real(count, in, out, is_input);
    if (status < 0) { return refuse_runs_real(status, count, in->hops, out, is_input); }
    fenv_t before;
    (void)fegetenv(&before);
    hopform_plan_real plan;
    run_real run = {0, HOPFORM_OK};
    for (int64_t i = 0; i < count; i++) {
        solve_run_real(&plan, plan_for_real(&plan, &run, &in->runs, i, count), in, i, out);
    }
    (void)fesetenv(&before);
    return HOPFORM_OK;
}
