/* Answers in double precision: stances, flights and commands of vectors.h, each also at times in between, and random
 * ones by what must be true of any. Nothing is compared bit for bit.
 *
 * Prints what is wrong and ends with 1, or is silent. An error may be 1e-14 of its scale, times the condition number.
 * With the argument `work` it prints what each call took, in basic blocks, if the library was compiled with
 * -fsanitize-coverage=trace-pc; with any other argument each error, and a summary. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hopform/hopform.h"
#include "vectors.h"

#define T(name) hopform_##name##_f64

static int row;
static int wrong;
static double worst;
static int verbose;
static int prints_work;
static unsigned long blocks;

void __sanitizer_cov_trace_pc(void);

void __sanitizer_cov_trace_pc(void)
{
    blocks++;
}

static void fail(const char *what, double share)
{
    if (verbose) {
        printf("row %d: %s (%g of what is allowed)\n", row, what, share);
    }
    if (wrong++ > 20 || !verbose) {
        exit(1);
    }
}

static void must(int truth, const char *what)
{
    if (!truth) {
        fail(what, INFINITY);
    }
}

static void near(double got, double wanted, double allowed, const char *what)
{
    const double share = fabs(got - wanted) / allowed;
    if (!(share <= 1.0)) {
        fail(what, share);
    } else if (share > worst) {
        worst = share;
    }
}

static double larger(double a, double b)
{
    return a > b ? a : b;
}

static uint64_t dice = 88172645463325252u; /* Marsaglia, "Xorshift RNGs", 2003 */

static double uniform(double low, double high)
{
    dice ^= dice << 13;
    dice ^= dice >> 7;
    dice ^= dice << 17;
    return low + (high - low) * ((double)(dice >> 11) / 9007199254740992.0);
}

static double over(double low, double high)
{
    return low * exp(uniform(0.0, 1.0) * log(high / low));
}

static double mostly(double value, double zero)
{
    return uniform(0.0, 1.0) < zero ? 0.0 : value;
}

static T(robot) any_robot(void)
{
    T(robot) r;
    r.m_s = over(0.3, 10.0);
    r.m_eff = r.m_s * over(0.02, 50.0);
    r.k = over(50.0, 50000.0);
    r.L0 = 0.4;
    r.c = mostly(uniform(-0.01, 0.01), 0.6);
    r.b1 = mostly(2.0 * sqrt(r.k * r.m_eff) * over(1e-3, 4.0), 0.15);
    r.b2 = mostly(2.0 * sqrt(r.k * r.m_s) * over(1e-3, 4.0), 0.15);
    r.f1 = mostly(over(0.02, 10.0), 0.15);
    r.f2 = mostly(over(0.02, 10.0), 0.15);
    r.u_max = 3.0;
    r.gamma2 = (uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0) * r.m_eff * over(0.1, 6.0);
    r.g = mostly(9.81, 0.08);
    r.x1_min = uniform(0.0, 1.0) < 0.5 ? -INFINITY : -mostly(over(1e-3, 0.05), 0.4);
    r.x1_max = isfinite(r.x1_min) ? over(1e-3, 0.08) : INFINITY;
    r.impact_loss = 0.05;
    r.f1_excess = mostly(over(1e-3, 5.0), 0.7);
    r.f2_excess = mostly(over(1e-3, 5.0), 0.7);
    return r;
}

static void listen(int argc, char **argv)
{
    prints_work = argc > 1 && strcmp(argv[1], "work") == 0;
    verbose = argc > 1 && !prints_work;
}

static int conclude(void)
{
    if (verbose) {
        printf("%d rows, worst share %g, wrong %d\n", row, worst, wrong);
    }
    return wrong > 0;
}

enum {
    CAPACITY = 64,
    TIMES = 16,
    ROWS = HOPFORM_SENSITIVITY_ROWS,
    COLUMNS = HOPFORM_SENSITIVITY_COLUMNS,
    FIELDS = HOPFORM_ROBOT_FIELDS
};

static T(phase) phases[CAPACITY];
static T(flight_phase) flight_phases[CAPACITY];
static T(search) search;
static const double *next_number = vectors;

/* The result of a call, whose work is printed: what the library has done since
 * this was last called. */
static int32_t spent(const char *kind, int32_t result)
{
    static unsigned long before;
    if (prints_work) {
        printf("%s %lu\n", kind, blocks - before);
    }
    before = blocks;
    return result;
}

static double take(void)
{
    const double number = *next_number++;
    return fabs(number) < ENDLESS ? number : (number > 0.0 ? INFINITY : -INFINITY);
}

static int take_int(void)
{
    return (int)take();
}

/* ---- a stance ---- */

typedef struct {
    T(plan) plan;
    T(state) start;
    T(step) steps[2];
    int step_count;
    double horizon;
} problem;

static int solve(const problem *p, T(stance) * stance)
{
    return spent("stance", T(solve_stance)(&p->plan, &p->start, p->steps, p->step_count, p->horizon, CAPACITY, phases,
                                           CAPACITY, stance));
}

static T(robot) take_robot(void)
{
    double fields[FIELDS];
    T(robot) robot;
    for (int n = 0; n < FIELDS; n++) {
        fields[n] = take();
    }
    memcpy(&robot, fields, sizeof robot);
    return robot;
}

static T(state) take_start(void)
{
    T(state) start;
    start.x1 = take();
    start.v1 = take();
    start.v2 = take();
    start.y = take();
    return start;
}

static double of_ledger(const T(ledger) * ledger, int n)
{
    double entries[7];
    memcpy(entries, ledger, sizeof entries);
    return entries[n];
}

/* Smaller buffers, a cap, and steps of the current that change nothing leave
 * the answer as it is. */
static void variants(const problem *p, const T(stance) * stance)
{
    T(stance) other;
    T(phase) few[2];
    must(T(solve_stance)(&p->plan, &p->start, p->steps, p->step_count, p->horizon, CAPACITY, few, 1, &other)
             == (stance->phase_count > 1 ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK),
         "a small buffer");
    must(memcmp(&other.end, &stance->end, sizeof other.end) == 0 && other.event_count == stance->event_count
             && other.phases_kept == 1 && other.phase_count == stance->phase_count,
         "a small buffer, another stance");
    T(state) state;
    must(other.phase_count == 1 || T(stance_at)(&p->plan, p->steps, few, &other, 0.0, &state) == HOPFORM_ERROR_TIME,
         "phases not kept");
    if (stance->phase_count > 1) {
        const int cap = stance->phase_count - 1;
        must(T(solve_stance)(&p->plan, &p->start, p->steps, p->step_count, p->horizon, cap, phases, CAPACITY, &other)
                     >= 0
                 && other.ending == HOPFORM_ENDING_TOO_MANY_PHASES && other.phase_count == cap
                 && other.phases_kept == cap,
             "a cap on phases");
        must(other.duration <= stance->duration, "a cap on phases, a longer stance");
    }
    if (p->step_count == 1) {
        problem twice = *p;
        twice.steps[1].t = 0.37 * stance->duration;
        twice.steps[1].u = p->steps[0].u;
        twice.step_count = 2;
        if (twice.steps[1].t > 0.0 && stance->ending == HOPFORM_ENDING_TAKEOFF) {
            must(solve(&twice, &other) >= 0 && other.ending == stance->ending
                     && other.event_count == stance->event_count,
                 "a step of the current to the same value");
        }
    }
}

/* States, energies and the grid at many times agree with each other, and are
 * continuous but for what a stop takes. */
static void consistent(const problem *p, const T(stance) * stance, double unit_energy, double condition)
{
    double times[TIMES], x1[4][TIMES], losses[TIMES];
    T(energy) energies[TIMES];
    T(ledger) ledgers[TIMES];
    T(state) states[TIMES];
    static double tangents[TIMES * HOPFORM_TANGENT_ROWS * COLUMNS];
    const double loose = 1e-13 * condition;
    for (int n = 0; n < TIMES; n++) {
        times[n] = stance->duration * ((double)n / (TIMES - 1));
    }
    (void)spent("other", 0);
    must(spent("states", T(stance_states)(&p->plan, p->steps, phases, stance, times, TIMES,
                                          (double *const[]){x1[0], x1[1], x1[2], x1[3]}))
             == HOPFORM_OK,
         "no states");
    double back[TIMES], from[4][TIMES];
    for (int n = 0; n < TIMES; n++) {
        back[n] = times[TIMES - 1 - n];
    }
    must(T(stance_states)(&p->plan, p->steps, phases, stance, back, TIMES,
                          (double *const[]){from[0], from[1], from[2], from[3]})
             == HOPFORM_OK,
         "no states back in time");
    (void)spent("other", 0);
    must(spent("energy", T(stance_energy)(&p->plan, p->steps, phases, stance, times, TIMES, energies, ledgers, losses))
             == HOPFORM_OK,
         "no energies");
    must(spent("tangents", T(stance_tangents)(&p->plan, p->steps, phases, stance, NULL, 0, times, TIMES, states, tangents)) >= 0,
         "no tangents");
    for (int n = 0; n < TIMES; n++) {
        T(state) at;
        must(T(stance_at)(&p->plan, p->steps, phases, stance, times[n], &at) == HOPFORM_OK, "no state");
        for (int i = 0; i < 4; i++) {
            must(memcmp(&x1[i][n], &from[i][TIMES - 1 - n], sizeof(double)) == 0, "states back in time");
        }
        near(x1[0][n], at.x1, 1e-13, "states x1");
        near(x1[1][n], at.v1, 1e-13, "states v1");
        near(x1[2][n], at.v2, 1e-13, "states v2");
        near(x1[3][n], at.y, 1e-13, "states y");
        near(states[n].x1, at.x1, loose * (1.0 + fabs(at.x1)), "tangents x1");
        near(states[n].v1, at.v1, loose * (1.0 + fabs(at.v1)), "tangents v1");
        near(states[n].v2, at.v2, loose * (1.0 + fabs(at.v2)), "tangents v2");
        near(states[n].y, at.y, loose * (1.0 + fabs(at.y)), "tangents y");
        must(at.y >= -1e-12 * condition, "below zero force");
        double sum = losses[n];
        for (int i = 0; i < 6; i++) {
            sum += of_ledger(&ledgers[n], i);
        }
        const double scale = unit_energy * 10.0 + fabs(energies[n].total) + fabs(energies[0].total);
        near(energies[n].total - energies[0].total + (losses[0] - 0.0), sum, loose * scale, "the ledger's sum");
        near(energies[n].body - energies[0].body, ledgers[n].spring_work + ledgers[n].viscous_2 + ledgers[n].coulomb_2,
             loose * (scale + fabs(ledgers[n].spring_work) + fabs(ledgers[n].viscous_2)), "the AED");
    }
    near(stance->aed, ledgers[TIMES - 1].spring_work + ledgers[TIMES - 1].viscous_2 + ledgers[TIMES - 1].coulomb_2,
         loose
             * (unit_energy * 10.0 + fabs(energies[0].body) + fabs(ledgers[TIMES - 1].spring_work)
                + fabs(ledgers[TIMES - 1].viscous_2)),
         "the stance's AED");
    if (stance->duration > 0.0) {
        enum { GRID = 150 };
        double g[4][GRID];
        const double t0 = 0.05 * stance->duration, dt = 0.94 * stance->duration / GRID;
        (void)spent("other", 0);
        must(spent("grid", T(stance_grid)(&p->plan, p->steps, phases, stance, t0, dt, GRID,
                                          (double *const[]){g[0], g[1], g[2], g[3]}))
                 == HOPFORM_OK,
             "no grid");
        for (int n = 0; n < GRID; n += 7) {
            T(state) at;
            must(T(stance_at)(&p->plan, p->steps, phases, stance, t0 + dt * (double)n, &at) == HOPFORM_OK, "no state");
            const double speed = 1.0 + fabs(at.v1) + fabs(at.v2);
            near(g[0][n], at.x1, loose * speed, "grid x1");
            near(g[1][n], at.v1, loose * speed, "grid v1");
            near(g[2][n], at.v2, loose * speed, "grid v2");
            near(g[3][n], at.y, loose * speed, "grid y");
        }
        if (row % 10 == 0) { /* over many blocks of samples */
            enum { LONG = 4700 };
            static double many[4][LONG];
            const double fine = stance->duration / (LONG - 1);
            must(spent("grid", T(stance_grid)(&p->plan, p->steps, phases, stance, 0.0, fine, LONG,
                                              (double *const[]){many[0], many[1], many[2], many[3]}))
                     == HOPFORM_OK,
                 "no fine grid");
            for (int n = 0; n < LONG; n += 61) {
                T(state) at;
                const double time = fine * (double)n < stance->duration ? fine * (double)n : stance->duration;
                must(T(stance_at)(&p->plan, p->steps, phases, stance, time, &at) == HOPFORM_OK, "no state");
                const double speed = 1.0 + fabs(at.v1) + fabs(at.v2);
                near(many[0][n], at.x1, loose * speed, "fine grid x1");
                near(many[1][n], at.v1, loose * speed, "fine grid v1");
                near(many[2][n], at.v2, loose * speed, "fine grid v2");
                near(many[3][n], at.y, loose * speed, "fine grid y");
            }
        }
        const int goes_on = stance->ending == HOPFORM_ENDING_REST;
        const double beyond[2] = {stance->duration * (1.0 - 1e-15), stance->duration * (1.0 + 1e-13)};
        for (int n = 0; n < 2; n++) { /* one sample at the end, and one just behind it */
            must(T(stance_grid)(&p->plan, p->steps, phases, stance, beyond[n], 1.0, 1,
                                (double *const[]){g[0], g[1], g[2], g[3]})
                     == (n == 0 || goes_on ? HOPFORM_OK : HOPFORM_ERROR_TIME),
                 "a grid that ends at the end");
        }
        must(T(stance_grid)(&p->plan, p->steps, phases, stance, t0, stance->duration, 3,
                            (double *const[]){g[0], g[1], g[2], g[3]})
                 == (stance->ending == HOPFORM_ENDING_REST ? HOPFORM_OK : HOPFORM_ERROR_TIME),
             "a grid beyond the end");
    }
    T(state) at;
    must((T(stance_at)(&p->plan, p->steps, phases, stance, 1.01 * stance->duration + 1e-3, &at) == HOPFORM_OK)
             == (stance->ending == HOPFORM_ENDING_REST),
         "a time beyond the end");
    must(T(stance_at)(&p->plan, p->steps, phases, stance, -1e-9, &at) == HOPFORM_ERROR_TIME, "a time before the start");
}

static void rows_of(const T(stance) * s, const T(robot) * r, double out[ROWS])
{
    out[0] = s->duration;
    out[1] = s->end.x1;
    out[2] = s->end.v1;
    out[3] = s->end.x1 - s->end.y + r->L0 + r->c;
    out[4] = s->end.v2;
    out[5] = s->apex;
    out[6] = s->aed;
}

/* An input of a problem, by the code of its column, moved by a step; false if it can not be moved both
 * ways. */
static int moved(const problem *p, int column, double step, problem *to)
{
    *to = *p;
    double fields[FIELDS];
    T(robot) robot = p->plan.robot;
    memcpy(fields, &robot, sizeof robot);
    switch (column) {
    case 0:
        to->start.x1 += step;
        break;
    case 1:
        to->start.v1 += step;
        break;
    case 2:
        to->start.y += step;
        break;
    case 3:
        to->start.v2 += step;
        break;
    case 4:
        to->steps[0].u += step;
        to->steps[1].u += step;
        break;
    case HOPFORM_COLUMN_OF_STEP(0):
        to->steps[0].u += step;
        break;
    case HOPFORM_COLUMN_OF_STEP(1):
        to->steps[1].u += step;
        break;
    case HOPFORM_COLUMN_OF_STEP_TIME(1):
        to->steps[1].t += step;
        break;
    default:
        fields[column - 5] += step;
        break;
    }
    memcpy(&robot, fields, sizeof robot);
    return T(plan_init)(&to->plan, &robot) == HOPFORM_OK;
}

/* Derivatives against differences, where the events stay the same ones. */
static void derivatives(const problem *p, const T(stance) * stance)
{
    enum { MOST = COLUMNS + 3 };
    static double matrix[ROWS * MOST], tangents[HOPFORM_TANGENT_ROWS * MOST];
    int32_t codes[MOST];
    const int count = COLUMNS + (p->step_count == 2 ? 3 : 1); /* a step at a time beyond the ending has zeros */
    for (int n = 0; n < COLUMNS; n++) {
        codes[n] = n;
    }
    codes[COLUMNS] = HOPFORM_COLUMN_OF_STEP(0);
    codes[COLUMNS + 1] = HOPFORM_COLUMN_OF_STEP(1);
    codes[COLUMNS + 2] = HOPFORM_COLUMN_OF_STEP_TIME(1);
    for (int n = 0; n < ROWS * count; n++) {
        matrix[n] = NAN;
    }
    (void)spent("other", 0);
    const int32_t status = spent("sensitivities", T(stance_sensitivities)(&p->plan, p->steps, phases, stance, codes, count, matrix));
    must(status >= 0
             && (status == HOPFORM_OK || stance->ending != HOPFORM_ENDING_TAKEOFF || stance->event_count > 0
                 || fabs(p->start.v1 - p->start.v2) < 1e-6),
         "no derivatives");
    for (int n = 0; n < ROWS * count; n++) {
        must(status == HOPFORM_OK ? isfinite(matrix[n]) : !(fabs(matrix[n]) > 0.0) && !isnan(matrix[n]),
             "a derivative that is no number");
    }
    const double middle = 0.6 * stance->duration;
    T(state) at;
    const int32_t has = T(stance_tangents)(&p->plan, p->steps, phases, stance, codes, count, &middle, 1, &at, tangents);
    for (int column = 0; column < count; column++) {
        double value = 0.1;
        if (column > 4 && column < COLUMNS) {
            double fields[FIELDS];
            memcpy(fields, &p->plan.robot, sizeof fields);
            value = fields[column - 5];
        }
        const double step = 1e-6 * larger(1e-2, isfinite(value) ? fabs(value) : 1.0);
        problem up, down;
        T(stance) s_up, s_down;
        T(state) at_up, at_down;
        T(phase) kept[CAPACITY];
        memcpy(kept, phases, sizeof kept);
        if (!moved(p, codes[column], step, &up) || !moved(p, codes[column], -step, &down) || solve(&up, &s_up) != HOPFORM_OK
            || s_up.event_count != stance->event_count || s_up.ending != stance->ending
            || s_up.phase_count != stance->phase_count
            || T(stance_at)(&up.plan, up.steps, phases, &s_up, middle, &at_up) != HOPFORM_OK
            || solve(&down, &s_down) != HOPFORM_OK || s_down.event_count != stance->event_count
            || s_down.phase_count != stance->phase_count || s_down.ending != stance->ending
            || T(stance_at)(&down.plan, down.steps, phases, &s_down, middle, &at_down) != HOPFORM_OK) {
            memcpy(phases, kept, sizeof kept);
            continue;
        }
        memcpy(phases, kept, sizeof kept);
        double high[ROWS], low[ROWS];
        rows_of(&s_up, &up.plan.robot, high);
        rows_of(&s_down, &down.plan.robot, low);
        if (status == HOPFORM_OK) {
            double whole[ROWS];
            rows_of(stance, &p->plan.robot, whole);
            for (int r = 0; r < ROWS; r++) {
                const double slope = (high[r] - low[r]) / (2.0 * step);
                const double curve =
                    fabs(high[r] + low[r] - 2.0 * whole[r]) / step; /* not straight: differences say less */
                near(matrix[r * count + column], slope,
                     1e-4 * (fabs(slope) + 0.02) + 2.0 * curve + (1e-11 + 8.9e-16 * fabs(whole[r])) / step,
                     "a sensitivity"); /* rounding of the answers, over the step */
            }
        }
        if (has == HOPFORM_OK && stance->event_count == 0) {
            const double slopes[4] = {at_up.x1 - at_down.x1, at_up.v1 - at_down.v1, at_up.v2 - at_down.v2,
                                      at_up.y - at_down.y};
            const double curves[4] = {at_up.x1 + at_down.x1 - 2.0 * at.x1, at_up.v1 + at_down.v1 - 2.0 * at.v1,
                                      at_up.v2 + at_down.v2 - 2.0 * at.v2, at_up.y + at_down.y - 2.0 * at.y};
            for (int r = 0; r < 4; r++) {
                const double slope = slopes[r] / (2.0 * step);
                near(tangents[r * count + column], slope,
                     1e-4 * (fabs(slope) + 0.02) + 2.0 * fabs(curves[r]) / step + 1e-11 / step, "a tangent");
            }
        }
    }
}

static void one_stance(void)
{
    problem p;
    T(stance) stance;
    const T(robot) robot = take_robot();
    must(T(plan_init)(&p.plan, &robot) == HOPFORM_OK, "no plan");
    p.start = take_start();
    p.step_count = take_int();
    p.steps[1].t = 100.0;
    p.steps[1].u = 0.0;
    for (int n = 0; n < p.step_count; n++) {
        p.steps[n].t = take();
        p.steps[n].u = take();
    }
    p.horizon = take();
    const int ending = take_int(), count = take_int();
    const double *events = next_number;
    next_number += 2 * count;
    double end[7];
    for (int n = 0; n < 7; n++) {
        end[n] = take();
    }
    const double unit_time = take(), unit_energy = take(), condition = take(), condition_aed = take();
    const double loose = 1e-14 * condition;
    must(solve(&p, &stance) == HOPFORM_OK && stance.ending == ending && stance.event_count == count, "another ending");
    int found = 0;
    for (int n = 1; n < stance.phases_kept && found < count; n++) {
        if (HOPFORM_IS_EVENT(phases[n].event)) {
            must(phases[n].event == (int)events[2 * found], "another event");
            near(phases[n].t, events[2 * found + 1], loose * unit_time, "the time of an event");
            found++;
        }
    }
    must(found == count, "too few events");
    near(stance.duration, end[0], loose * unit_time, "duration");
    near(stance.end.x1, end[1], loose * 0.1, "x1");
    near(stance.end.v1, end[2], loose, "v1");
    near(stance.end.v2, end[3], loose, "v2");
    near(stance.end.y, end[4], loose * 0.1, "y");
    near(stance.aed, end[5], 1e-13 * condition_aed * unit_energy, "aed");
    near(stance.apex, ending == HOPFORM_ENDING_TAKEOFF ? end[6] : 0.0, loose * (1.0 + fabs(end[6])), "apex");
    const int times = take_int();
    for (int n = 0; n < times; n++) {
        double at[14];
        for (int i = 0; i < 14; i++) {
            at[i] = take();
        }
        T(state) state;
        T(energy) energy;
        T(ledger) ledger;
        double loss;
        must(T(stance_at)(&p.plan, p.steps, phases, &stance, at[0], &state) == HOPFORM_OK, "no state");
        near(state.x1, at[1], loose * (0.1 + fabs(at[1])), "x1 in between");
        near(state.v1, at[2], loose * (1.0 + fabs(at[2])), "v1 in between");
        near(state.v2, at[3], loose * (1.0 + fabs(at[3])), "v2 in between");
        near(state.y, at[4], loose * (0.1 + fabs(at[4])), "y in between");
        must(T(stance_energy)(&p.plan, p.steps, phases, &stance, &at[0], 1, &energy, &ledger, &loss) == HOPFORM_OK,
             "no energies");
        const double scale = 5.0 * loose * (unit_energy + fabs(at[5]) + fabs(at[6]));
        near(energy.body, at[5], scale, "energy of the body");
        near(energy.total, at[6], scale, "energy of the robot");
        for (int i = 0; i < 7; i++) {
            near(of_ledger(&ledger, i), at[7 + i], scale, "ledger");
        }
        near(loss, take(), scale, "loss at stops");
    }
    consistent(&p, &stance, unit_energy, condition);
    derivatives(&p, &stance);
    variants(&p, &stance);
}

/* ---- a flight ---- */

static void one_flight(void)
{
    T(plan) plan;
    T(flight) flight, other;
    const T(robot) robot = take_robot();
    must(T(plan_init)(&plan, &robot) == HOPFORM_OK, "no plan");
    const T(state) start = take_start();
    T(gains) gains;
    gains.Kp = take();
    gains.Kd = take();
    const double horizon = take();
    const int ending = take_int(), count = take_int();
    const double *events = next_number;
    next_number += 2 * count;
    double end[10];
    for (int n = 0; n < 10; n++) {
        end[n] = take();
    }
    const double unit_time = take(), unit_energy = take(), condition = take();
    const double loose = 4e-14 * condition;
    must(spent("flight", T(solve_flight)(&plan, &start, 0, &gains, horizon, CAPACITY, flight_phases, CAPACITY, &flight))
                 == HOPFORM_OK
             && flight.ending == ending && flight.event_count == count,
         "another ending of a flight");
    int found = 0;
    for (int n = 1; n < flight.phases_kept && found < count; n++) {
        if (flight_phases[n].event != HOPFORM_EVENT_NONE) {
            must(flight_phases[n].event == (int)events[2 * found], "another event of a flight");
            near(flight_phases[n].t, events[2 * found + 1], loose * unit_time, "the time of an event of a flight");
            found++;
        }
    }
    must(found == count, "too few events of a flight");
    near(flight.duration, end[0], loose * unit_time, "duration of a flight");
    near(flight.end.x1, end[1], loose * 0.1, "x1 of a flight");
    near(flight.end.v1, end[2], loose, "v1 of a flight");
    near(flight.end.v2, end[3], loose, "v2 of a flight");
    near(flight.end.y, end[4], loose, "y of a flight");
    const int lands = ending == HOPFORM_FLIGHT_TOUCHDOWN;
    near(flight.v2_after, lands ? flight.end.v2 * sqrt(1.0 - robot.impact_loss) : flight.v2_after,
         1e-13 * (1.0 + fabs(flight.end.v2)), "v2 after the impact");
    near(flight.impact_loss,
         lands ? -0.5 * robot.m_s * flight.end.v2 * flight.end.v2 * robot.impact_loss : flight.impact_loss,
         1e-12 * (1.0 + fabs(flight.impact_loss)), "loss of the impact");
    enum { N = 12 };
    double times[N], losses[N];
    T(state) states[N];
    T(energy) energies[N];
    T(flight_ledger) ledgers[N];
    for (int n = 0; n < N; n++) {
        times[n] = flight.duration * ((double)n / (N - 1));
    }
    must(T(flight_at)(&plan, flight_phases, &flight, times, N, states) == HOPFORM_OK, "no states of a flight");
    must(spent("flight_energy", T(flight_energy)(&plan, flight_phases, &flight, times, N, energies, ledgers, losses))
             == HOPFORM_OK,
         "no energies of a flight");
    double best = -INFINITY;
    for (int n = 0; n < N; n++) {
        const double t = times[n], fall = start.v2 * t - 0.5 * robot.g * t * t;
        near(states[n].v2, start.v2 - robot.g * t, 1e-15 * (1.0 + fabs(start.v2)), "v2 in flight");
        near(states[n].y - (states[n].x1 - start.x1), start.y - fall, 2e-14 * (1.0 + fabs(start.v2)),
             "the body's height in flight");
        best = larger(best, fall + start.x1 - start.y);
        const double scale = loose * (unit_energy + fabs(energies[n].total) + fabs(energies[0].total)) + 1e-300;
        near(energies[n].total - energies[0].total,
             ledgers[n].motor_work + ledgers[n].offset_work + ledgers[n].viscous_1 + ledgers[n].coulomb_1 + losses[n]
                 - losses[0],
             scale, "the sum of a flight's ledger");
    }
    near(states[N - 1].x1, flight.end.x1, 1e-14 * (0.1 + fabs(flight.end.x1)) * condition, "x1 at the end of a flight");
    near(states[N - 1].v1, flight.end.v1, 1e-14 * (1.0 + fabs(flight.end.v1)) * condition, "v1 at the end of a flight");
    const T(flight_ledger) *last = &ledgers[N - 1];
    const double scale = loose * unit_energy;
    near(last->motor_work, end[5], scale, "motor work in flight");
    near(last->offset_work, end[6], scale, "offset work in flight");
    near(last->viscous_1, end[7], scale, "viscous loss in flight");
    near(last->coulomb_1, end[8], scale, "Coulomb loss in flight");
    near(losses[N - 1], end[9], scale, "loss at stops in flight");
    const double rises = robot.g > 0.0 ? larger(start.v2, 0.0) / robot.g : 0.0;
    const double top = rises < flight.duration ? rises : flight.duration;
    near(flight.apex, start.v2 * top - 0.5 * robot.g * top * top + start.x1 - start.y,
         1e-14 * (1.0 + fabs(flight.apex)), "apex of a flight");
    near(flight.apex_time, top, 1e-15 * (1.0 + top), "time of the apex");
    must(T(solve_flight)(&plan, &start, 0, &gains, horizon, CAPACITY, flight_phases, 1, &other)
             == (flight.phase_count > 1 ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK),
         "a small buffer of a flight");
    must(memcmp(&other.end, &flight.end, sizeof other.end) == 0, "a small buffer, another flight");
    T(state) lower = start, at;
    lower.y -= 0.0625; /* over ground that is as much higher */
    must(T(solve_flight)(&plan, &lower, 0.0625, &gains, horizon, CAPACITY, flight_phases, CAPACITY, &other) >= 0
             && other.ending == flight.ending && other.event_count == flight.event_count
             && !(fabs(other.ground - 0.0625) > 0.0),
         "a flight over other ground");
    must(T(flight_at)(&plan, flight_phases, &other, &other.duration, 1, &at) == HOPFORM_OK, "no end over other ground");
    near(other.duration, flight.duration, 1e-12 * condition * unit_time, "duration over other ground");
    near(at.y - at.x1, flight.end.y - flight.end.x1, 1e-12 * condition * (1.0 + fabs(start.v2)), "y over other ground");
    if (flight.phase_count > 1 && ending != HOPFORM_FLIGHT_TRIPPED) {
        must(T(solve_flight)(&plan, &start, 0, &gains, horizon, flight.phase_count - 1, flight_phases, CAPACITY, &other)
                     >= 0
                 && other.ending == HOPFORM_FLIGHT_TOO_MANY_PHASES,
             "a cap on phases of a flight");
    }
    if (T(solve_flight)(&plan, &start, 0, NULL, horizon, CAPACITY, flight_phases, CAPACITY, &other) >= 0
        && other.gains.Kp > 0.0) {
        const double square = start.v2 * start.v2 + 2.0 * robot.g * start.x1;
        const double fall = square > 0.0 ? (start.v2 + sqrt(square)) / robot.g - 0.05 : 0.0;
        T(gains) designed;
        must(T(design_return)(&plan, larger(fall, 0.02), &designed) == HOPFORM_OK, "no design");
        near(other.gains.Kp, designed.Kp, 1e-14 * (1.0 + fabs(designed.Kp)), "designed Kp");
        near(other.gains.Kd, designed.Kd, 1e-14 * (1.0 + fabs(designed.Kd)), "designed Kd");
        const double rate = 20.0 / 3.0 / larger(fall, 0.02), damping = designed.Kd + robot.b1;
        near(designed.Kp, rate * (damping - robot.m_eff * rate), 1e-14 * rate * (damping + robot.m_eff * rate),
             "the rate of the return");
        must(designed.Kd >= 0.0 && damping >= 2.0 * robot.m_eff * rate * (1.0 - 1e-12), "a return that swings");
        must(designed.Kd <= 0.0 || damping <= 2.0 * robot.m_eff * rate * (1.0 + 1e-12), "a return that creeps");
    }
}

/* ---- a command ---- */

static void one_command(void)
{
    T(plan) plan;
    T(command) command, stepped;
    const T(robot) robot = take_robot();
    must(T(plan_init)(&plan, &robot) == HOPFORM_OK, "no plan");
    const T(state) start = take_start();
    T(target) target = {0.0, 0.0, 0.0, 0.0};
    target.h_des = take();
    target.stop_margin = take();
    target.horizon = take();
    const double u = take(), apex = take();
    const int status = take_int();
    must(spent("command", T(choose_current)(&search, &plan, &start, &target, phases, CAPACITY, &command)) == HOPFORM_OK
             && command.status == status,
         "another command");
    must(search.trials < 120, "a search that takes long");
    near(command.u, u, (status == HOPFORM_COMMAND_REACHED ? 1e-7 : 1e-3) * (1.0 + fabs(u)),
         "the current"); /* an extremum is flat */
    near(command.apex, apex, 1.5e-9, "the apex of the command");
    must(T(choose_current_begin)(&search, &plan, &start, &target, &stepped) == HOPFORM_SEARCHING, "no search");
    int32_t goes = HOPFORM_SEARCHING;
    double gap = INFINITY;
    for (int n = 0; goes == HOPFORM_SEARCHING && n < 1000; n++) {
        goes = T(choose_current_step)(&search, phases, CAPACITY, &stepped);
        must(fabs(stepped.u) <= robot.u_max, "a current beyond the limit");
        if (stepped.status != HOPFORM_COMMAND_NO_TAKEOFF) {
            must(fabs(stepped.apex - target.h_des) <= gap * (1.0 + 1e-9) + 1e-13, "a command that becomes worse");
            gap = fabs(stepped.apex - target.h_des);
        }
    }
    must(goes == HOPFORM_OK && stepped.status == command.status && !(fabs(stepped.u - command.u) > 0.0)
             && !(fabs(stepped.apex - command.apex) > 0.0),
         "step by step another command");
    must(T(choose_current_step)(&search, phases, CAPACITY, &stepped) == HOPFORM_OK, "a search that is done goes on");
    const double begins[5] = {command.u, 1.02 * command.u, 0.5 * command.u, -command.u, 0.9 * robot.u_max};
    for (int n = 0; n < 5; n++) { /* wherever a search begins, it ends as well */
        must(T(choose_current_begin)(&search, &plan, &start, &target, &stepped) == HOPFORM_SEARCHING
                 && T(choose_current_near)(&search, begins[n]) == HOPFORM_SEARCHING,
             "no search near a current");
        goes = HOPFORM_SEARCHING;
        for (int step = 0; goes == HOPFORM_SEARCHING && step < 1000; step++) {
            goes = T(choose_current_step)(&search, phases, CAPACITY, &stepped);
        }
        must(goes == HOPFORM_OK && stepped.status == command.status, "another end of a search near a current");
        near(fabs(stepped.apex - target.h_des), fabs(command.apex - target.h_des), 1.5e-9,
             "how near the apex of a search near a current comes");
        must(status != HOPFORM_COMMAND_REACHED || fabs(stepped.u) <= fabs(command.u) + 1e-3 * (1.0 + fabs(u)),
             "a larger current of a search near one");
    }
    target.datum = 0.02;
    target.h_des -= 0.02;
    if (target.h_des > 0.0) {
        must(T(choose_current)(&search, &plan, &start, &target, phases, CAPACITY, &stepped) == HOPFORM_OK,
             "a command over another ground");
        near(stepped.u, command.u, (status == HOPFORM_COMMAND_REACHED ? 1e-7 : 1e-3) * (1.0 + fabs(command.u)),
             "the current over another ground");
    }
    const double currents[3] = {0.0, command.u, 0.5 * robot.u_max};
    T(trial) trials[3];
    must(T(try_currents)(&plan, &start, 1, currents, 3, target.horizon, phases, CAPACITY, trials) >= 0, "no trials");
    for (int n = 0; n < 3; n++) {
        const double step = 1e-7;
        const double beside[2] = {currents[n] - step, currents[n] + step};
        T(trial) two[2];
        (void)T(try_currents)(&plan, &start, 1, beside, 2, target.horizon, phases, CAPACITY, two);
        if (trials[n].takes_off && two[0].events == two[1].events && two[0].events == trials[n].events
            && trials[n].smooth) {
            near(trials[n].apex_u, (two[1].apex - two[0].apex) / (2.0 * step), 1e-8 * (1.0 + fabs(trials[n].apex_u)),
                 "the apex' slope");
            near(trials[n].largest_x1_u, (two[1].largest_x1 - two[0].largest_x1) / (2.0 * step),
                 1e-8 * (1.0 + fabs(trials[n].largest_x1_u)), "the peak's slope");
        }
        if (trials[n].minima > 0 && two[0].minima == two[1].minima) {
            near(trials[n].least_contact_u, (two[1].least_contact - two[0].least_contact) / (2.0 * step),
                 1e-4 * (1.0 + fabs(trials[n].least_contact_u)), "the dip's slope");
        }
    }
}

/* ---- contact ---- */

static void contact(void)
{
    for (int count = 1; count <= 3; count++) {
        const T(detector) detector = {0.6, 0.4, count};
        T(contact) known = {0, 0, 0};
        uint32_t noise = 12345u;
        int above = 0, touches = 0, run = 0;
        for (int n = 0; n < 2000; n++) {
            noise = noise * 1664525u + 1013904223u;
            const double sample = n % 50 < 5 ? (n % 2 ? 0.6 : 0.4) : (double)(noise >> 8) / 16777216.0;
            above = above ? !(sample < detector.low) : sample >= detector.high;
            run = above == touches ? 0 : run + 1;
            int wanted = 0;
            if (run == count) {
                touches = above;
                run = 0;
                wanted = above ? HOPFORM_CONTACT_TOUCHDOWN : HOPFORM_CONTACT_TAKEOFF;
            }
            must(T(touchdown)(&detector, &known, sample) == wanted && known.touches == touches && known.above == above
                     && known.run == run,
                 "the detector");
        }
        for (int held = -2; held <= count + 2; held++) { /* a number of samples that can not be counts as none */
            T(contact) any = {0, 0, held};
            const int known_run = held > 0 && held < count ? held : 0;
            const int detects = known_run + 1 == count;
            must(T(touchdown)(&detector, &any, 0.9) == (detects ? HOPFORM_CONTACT_TOUCHDOWN : 0)
                     && any.run == (detects ? 0 : known_run + 1) && any.above == 1 && any.touches == detects,
                 "a detector whose memory holds anything");
        }
        T(contact) same = known;
        must(T(touchdown)(&detector, &known, NAN) == HOPFORM_ERROR_DETECTOR && memcmp(&same, &known, sizeof same) == 0,
             "a sample that is none");
    }
}

/* ---- any stance, flight and command: what must be true of it ---- */

/* Accelerations without dry friction, (3), (4). */
static void free_accelerations(const T(robot) * r, const T(state) * s, double u, double a[2])
{
    a[0] = (r->k * (r->c - s->y) - r->b1 * s->v1 - r->gamma2 * u) / r->m_eff;
    a[1] = (r->k * s->y - r->b2 * s->v2) / r->m_s - r->g;
}

static void is_a_mode(const T(robot) * r, const T(state) * s, double u, int side_1, int side_2)
{
    double a[2];
    free_accelerations(r, s, u, a);
    const double most_1 = r->f1 + r->f1_excess, most_2 = r->f2 + r->f2_excess;
    const double speed = 1e-9 * (1.0 + fabs(s->v1) + fabs(s->v2));
    const double size =
        1e-9
        * (1.0 + most_1 + most_2 + r->k * (fabs(s->y) + fabs(r->c)) * (1.0 / r->m_eff + 1.0 / r->m_s)
           + fabs(r->gamma2 * u) / r->m_eff + r->b1 * fabs(s->v1) / r->m_eff + r->b2 * fabs(s->v2) / r->m_s + r->g);
    must(side_1 != 0 ? side_1 * s->v1 >= -speed : fabs(s->v1) <= 0.0, "mass 1 against its mode");
    must(side_2 != 0 ? side_2 * s->v2 >= -speed : fabs(s->v2) <= 0.0, "mass 2 against its mode");
    must(side_2 != 0 || fabs(a[1]) <= most_2 + size, "mass 2 is held by too much");
    const int locked = !(r->x1_min < r->x1_max), low = s->x1 <= r->x1_min, high = s->x1 >= r->x1_max;
    must(side_1 != 0 || locked || ((a[0] <= most_1 + size || high) && (a[0] >= -most_1 - size || low)),
         "mass 1 is held by too much");
    must(s->x1 >= r->x1_min - 1e-12 && s->x1 <= r->x1_max + 1e-12, "out of its stroke");
    must(s->y >= -1e-9, "a spring that pulls");
}

/* ---- limits of what is taken ---- */

static const T(robot) usual = {25.0, 3.0, 1200.0, 0.4, 0.0, 150.0, 5.0, 0.78, 0.6, -65.0, 9.81, 0.0, 0.08, 3.0, 0.05, 0.0, 0.0};

/* Numbers up to 1e300 are taken, as far as it goes; those beyond are refused by
 * name. */
static void limits(void)
{
    T(plan) plan;
    T(stance) stance;
    T(flight) flight;
    T(command) command;
    T(contact) contact = {0, 0, 0};
    const T(state) start = {0.0, 0.0, -1.9, 0.0};
    must(T(plan_init)(&plan, &usual) == HOPFORM_OK, "no plan");
    for (int sign = -1; sign <= 1; sign += 2) {
        const double most = (double)sign * 1e300, more = (double)sign * 1.5e300;
        const T(detector) plain = {0.6, 0.4, 1}, wide = {1e300, -1e300, 1},
                          low = {sign > 0 ? more : 0.6, sign < 0 ? more : 0.4, 1};
        must(T(touchdown)(&plain, &contact, most) >= 0 && T(touchdown)(&wide, &contact, 0.0) >= 0, "a large sample");
        must(T(touchdown)(&wide, &contact, most) >= 0, "the largest sample");
        must(T(touchdown)(&plain, &contact, more) == HOPFORM_ERROR_DETECTOR
                 && T(touchdown)(&low, &contact, 0.0) == HOPFORM_ERROR_DETECTOR,
             "a sample that is too large");
        T(robot) unbound = usual;
        T(plan) free_plan;
        unbound.x1_min = -INFINITY;
        unbound.x1_max = INFINITY;
        must(T(plan_init)(&free_plan, &unbound) == HOPFORM_OK, "no plan");
        for (int field = 0; field < 4; field++) { /* what comes of them may be out of range */
            T(state) off = start;
            double fields[4] = {0.0, 0.0, -1.9, 0.0};
            fields[field] = most;
            memcpy(&off, fields, sizeof off);
            const T(step) strong[2] = {{0.0, most}, {1.0, 0.0}};
            must(T(solve_stance)(&free_plan, &off, strong, 2, 1.0, CAPACITY, phases, CAPACITY, &stance)
                         != (field == 3 && sign < 0 ? HOPFORM_OK : HOPFORM_ERROR_STATE)
                     && stance.ending >= 0,
                 "the largest start");
            must(T(solve_stance)(&free_plan, &start, strong, 1, 1e300, CAPACITY, phases, CAPACITY, &stance)
                     != HOPFORM_ERROR_STEPS,
                 "the largest current");
        }
        for (int field = 0; field < 4; field++) {
            T(state) off = start;
            double fields[4] = {0.0, 0.0, -1.9, 0.0};
            fields[field] = more;
            memcpy(&off, fields, sizeof off);
            const T(step) steps[1] = {{0.0, 0.0}};
            must(T(solve_stance)(&plan, &off, steps, 1, 1.0, CAPACITY, phases, CAPACITY, &stance)
                     == HOPFORM_ERROR_STATE,
                 "a start beyond numbers");
            must(T(solve_flight)(&plan, &off, 0, NULL, 1.0, CAPACITY, flight_phases, CAPACITY, &flight)
                     == HOPFORM_ERROR_STATE,
                 "a flight from beyond numbers");
        }
        const T(step) currents[2] = {{0.0, 0.0}, {0.1, more}}, times[2] = {{0.0, 0.0}, {more, 0.0}},
                      far[2] = {{0.0, 0.0}, {1e300, 0.0}};
        must(T(solve_stance)(&plan, &start, currents, 2, 1.0, CAPACITY, phases, CAPACITY, &stance)
                 == HOPFORM_ERROR_STEPS,
             "a current beyond numbers");
        must(T(solve_stance)(&plan, &start, times, 2, 1.0, CAPACITY, phases, CAPACITY, &stance) == HOPFORM_ERROR_STEPS,
             "a time beyond numbers");
        must(T(solve_stance)(&plan, &start, far, 2, 1.0, CAPACITY, phases, CAPACITY, &stance) == HOPFORM_OK,
             "a step that never comes");
        must(T(solve_stance)(&plan, &start, far, 1, more, CAPACITY, phases, CAPACITY, &stance) == HOPFORM_ERROR_HORIZON,
             "a horizon beyond numbers");
        const double wanted[4] = {0.1, 0.0, 0.0, 1.0};
        for (int field = 0; field < 4; field++) {
            double fields[4];
            memcpy(fields, wanted, sizeof fields);
            fields[field] = more;
            const T(target) target = {fields[0], fields[1], fields[2], fields[3]};
            fields[field] = 1e300;
            fields[1] = field == 1 && sign < 0 ? -1e300 : fields[1];
            fields[0] = field == 1 && sign < 0 ? 1e300 : fields[0];
            const T(target) largest = {fields[0], fields[1], fields[2], fields[3]};
            must(T(choose_current_begin)(&search, &plan, &start, &largest, &command) == HOPFORM_SEARCHING,
                 "the largest target");
            must(T(choose_current_begin)(&search, &plan, &start, &target, &command)
                     == (field == 3 ? HOPFORM_ERROR_HORIZON : HOPFORM_ERROR_TARGET),
                 "a target beyond numbers");
        }
        const T(gains) stiff = {more, 0.0}, damped = {0.0, more};
        must(T(solve_flight)(&plan, &start, 0, &stiff, 1.0, CAPACITY, flight_phases, CAPACITY, &flight)
                 == HOPFORM_ERROR_GAINS,
             "gains beyond numbers");
        must(T(solve_flight)(&plan, &start, 0, &damped, 1.0, CAPACITY, flight_phases, CAPACITY, &flight)
                 == HOPFORM_ERROR_GAINS,
             "gains beyond numbers");
        must(T(solve_flight)(&plan, &start, 0, NULL, more, CAPACITY, flight_phases, CAPACITY, &flight)
                 == HOPFORM_ERROR_HORIZON,
             "a horizon beyond numbers");
    }
    T(gains) gains;
    must(T(design_return)(&plan, 1.5e300, &gains) == HOPFORM_ERROR_TIME
             && T(design_return)(&plan, 1e300, &gains) == HOPFORM_OK,
         "a time to return in");
    T(robot) strong = usual;
    strong.u_max = 1.5e300;
    const T(target) target = {0.1, 0.0, 0.0, 1.0};
    must(T(plan_init)(&plan, &strong) == HOPFORM_OK
             && T(choose_current_begin)(&search, &plan, &start, &target, &command) == HOPFORM_ERROR_ROBOT,
         "a current without a limit");
    strong.u_max = 1e300;
    must(T(plan_init)(&plan, &strong) == HOPFORM_OK
             && T(choose_current_begin)(&search, &plan, &start, &target, &command) == HOPFORM_SEARCHING,
         "a current with a large limit");
    static T(step) steps[65536];
    for (int n = 0; n < 65536; n++) {
        steps[n].t = 10.0 * (double)n;
    }
    must(T(plan_init)(&plan, &usual) == HOPFORM_OK, "no plan");
    must(T(solve_stance)(&plan, &start, steps, 65535, 1.0, CAPACITY, phases, CAPACITY, &stance) == HOPFORM_OK,
         "many steps");
    must(T(solve_stance)(&plan, &start, steps, 65536, 1.0, CAPACITY, phases, CAPACITY, &stance) == HOPFORM_ERROR_STEPS,
         "too many steps");
    must(T(solve_stance)(&plan, &start, steps, 1, 1e300, CAPACITY, phases, CAPACITY, &stance) == HOPFORM_OK,
         "a long horizon");
    T(robot) stuck = usual; /* at rest for ever: any time can be asked for */
    stuck.f1 = 30.0;
    stuck.f2 = 25.0;
    const T(state) still = {0.04, 0.0, 0.0, 0.02};
    double x1, v1, v2, y;
    T(state) at;
    T(energy) energy;
    T(ledger) ledger;
    double loss;
    must(T(plan_init)(&plan, &stuck) == HOPFORM_OK
             && T(solve_stance)(&plan, &still, steps, 1, 1.0, CAPACITY, phases, CAPACITY, &stance) == HOPFORM_OK
             && stance.ending == HOPFORM_ENDING_REST,
         "a robot that rests");
    for (int n = 0; n < 2; n++) {
        const double t = n == 0 ? 1e300 : 1.5e300;
        const int wanted = n == 0 ? HOPFORM_OK : HOPFORM_ERROR_TIME;
        must(T(stance_at)(&plan, steps, phases, &stance, t, &at) == wanted, "a late time");
        must(T(stance_states)(&plan, steps, phases, &stance, &t, 1,
                              (double *const[]){&x1, &v1, &v2, &y}) == wanted, "a late state");
        must(T(stance_grid)(&plan, steps, phases, &stance, t, 1.0, 1,
                            (double *const[]){&x1, &v1, &v2, &y}) == wanted, "a late grid");
        must(T(stance_energy)(&plan, steps, phases, &stance, &t, 1, &energy, &ledger, &loss) == wanted,
             "a late energy");
    }
}

/* ---- ties and touches whose truth is known by algebra ---- */

static int ending_of(const T(robot) * robot, double v1, double v2, double y, double u, double horizon,
                     T(stance) * stance)
{
    problem p;
    must(T(plan_init)(&p.plan, robot) == HOPFORM_OK, "no plan");
    const T(state) start = {0.0, v1, v2, y};
    p.start = start;
    p.steps[0].t = 0.0;
    p.steps[0].u = u;
    p.step_count = 1;
    p.horizon = horizon;
    must(solve(&p, stance) >= 0, "a tie that is refused");
    return stance->ending;
}

/* A leg without compression and without a rate of it: the first derivative that
 * is not zero says whether it leaves the ground. */
static void leaving(void)
{
    T(stance) stance;
    for (row = 900; row < 920; row++) { /* F = 0 with the leg extending is a take-off at once, whatever
                                           the forces */
        const T(robot) r = any_robot();
        const double v = uniform(-2.0, 2.0);
        must(r.x1_min > -1e300
                 || (ending_of(&r, v, v + over(1e-6, 2.0), 0.0, uniform(-3.0, 3.0), 1.0, &stance)
                         == HOPFORM_ENDING_TAKEOFF
                     && !(stance.duration > 0.0) && stance.phase_count == 1),
             "a leg that extends at once");
    }
    for (row = 900; row < 960; row++) {
        const T(robot) r = any_robot();
        const double v = uniform(-2.0, 2.0), u = uniform(-3.0, 3.0);
        if (r.x1_min > -1e300 || fabs(v) < 0.1) {
            continue;
        }
        const T(state) start = {0.0, v, v, 0.0};
        double a[2];
        free_accelerations(&r, &start, u, a);
        const double rate = (a[0] - (v > 0.0 ? r.f1 : -r.f1)) - (a[1] - (v > 0.0 ? r.f2 : -r.f2));
        const int leaves =
            ending_of(&r, v, v, 0.0, u, 1.0, &stance) == HOPFORM_ENDING_TAKEOFF && !(stance.duration > 0.0);
        must(fabs(rate) < 1e-9 || leaves == (rate < 0.0), "the leg's acceleration decides");
        if (leaves) { /* its time does not move in proportion to anything */
            static double matrix[ROWS * COLUMNS];
            T(plan) plan;
            const T(step) step = {0.0, u};
            int zeros = 0;
            memset(matrix, 1, sizeof matrix);
            must(T(plan_init)(&plan, &r) == HOPFORM_OK
                     && T(stance_sensitivities)(&plan, &step, phases, &stance, NULL, 0, matrix) == HOPFORM_NO_DERIVATIVE,
                 "derivatives of what leaves at once");
            for (int n = 0; n < ROWS * COLUMNS; n++) {
                zeros += !(fabs(matrix[n]) > 0.0);
            }
            must(zeros == ROWS * COLUMNS, "derivatives that are none, and not 0");
        }
    }
    const T(robot) opens = {1.0, 1.0, 100.0, 0.4, 0.0, 0.0, 1.0, 0.0, 0.0, 9.0, 8.0, -INFINITY, INFINITY, 3.0, 0.0, 0.0, 0.0};
    must(ending_of(&opens, 1.0, 1.0, 0.0, 1.0, 1.0, &stance) == HOPFORM_ENDING_TAKEOFF && !(stance.duration > 0.0),
         "the third derivative leaves");
    const T(robot)
        weightless = {1.0, 1.0, 100.0, 0.4, 0.0, 0.0, 0.0, 0.0, 0.0, 8.0, 8.0, -INFINITY, INFINITY, 3.0, 0.0, 0.0, 0.0};
    must(ending_of(&weightless, -1.0, -1.0, 0.0, 1.0, 1.0, &stance) == HOPFORM_ENDING_HORIZON
             && stance.event_count == 0,
         "two masses that fall alike");
    const T(robot) closes = {2.0, 1.0, 100.0, 0.4, 0.0, 8.0, 0.0, 0.0, 0.0, 9.0, 8.0, -INFINITY, INFINITY, 3.0, 0.0, 0.0, 0.0};
    must(ending_of(&closes, 2.0, 2.0, 0.0, 0.0, 1.0, &stance) != HOPFORM_ENDING_TAKEOFF || stance.duration > 0.0,
         "the third derivative stays");
}

/* An actuator that meets its upper stop just when the forces on it at rest
 * cancel: with friction it is held there, without any the last digits of the
 * current decide. */
static void cancelling(void)
{
    T(robot) r = usual;
    problem p;
    T(stance) stance;
    for (row = 960; row < 963; row++) {
        r.f1 = row == 960 ? 0.78 : 0.0;
        r.b1 = row == 960 ? 150.0 : 0.0;
        const T(state) start = {0.079, 0.3, -0.2, 0.05};
        must(T(plan_init)(&p.plan, &r) == HOPFORM_OK, "no plan");
        p.start = start;
        p.step_count = 1;
        p.steps[0].t = 0.0;
        p.steps[0].u = 0.9;
        p.horizon = 1.0;
        for (int n = 0; n < 60; n++) {
            must(solve(&p, &stance) >= 0 && phases[1].event == HOPFORM_EVENT_X1_HITS_STOP, "no stop");
            p.steps[0].u = -r.k * phases[1].y / r.gamma2;
        }
        p.steps[0].u *= 1.0 + (row == 961 ? 24.0 : (row == 962 ? -24.0 : 0.0)) * 2.220446049250313e-16;
        must(solve(&p, &stance) >= 0 && phases[1].mode / 3 == (row == 962 ? 0 : 1), "forces that cancel");
    }
}

/* A contact force that fades to 0 is no take-off, however long one waits, and
 * its last digits take no work. */
static void fading(void)
{
    T(stance) stance;
    for (row = 965; row < 970; row++) {
        const double b2 = 498.8 + 3.0 * (row - 965);
        const T(robot)
            r = {3.24, 0.154, 534400.0, 0.4, 0.0, 0.0, b2, 0.0, 0.0224, -3.6, 9.81, -INFINITY, INFINITY, 3.0, 0.0,
                 0.0,  0.0};
        must(ending_of(&r, 0.909, -1.597, 0.0, 0.0, 2.0, &stance) == HOPFORM_ENDING_HORIZON && stance.event_count == 3,
             "a contact force that fades");
    }
}

/* So little weight that the apex's derivative by it is no number any more. */
static void out_of_range(void)
{
    static double matrix[ROWS * COLUMNS];
    T(robot) r = usual;
    problem p;
    T(stance) stance;
    r.g = 1e-152;
    const T(state) start = {0.0, 0.0, -1.9, 0.0};
    must(T(plan_init)(&p.plan, &r) == HOPFORM_OK, "no plan");
    p.start = start;
    p.step_count = 1;
    p.steps[0].t = 0.0;
    p.steps[0].u = 0.0;
    p.horizon = 2.0;
    must(solve(&p, &stance) >= 0 && stance.ending == HOPFORM_ENDING_TAKEOFF, "no take-off");
    must(T(stance_sensitivities)(&p.plan, p.steps, phases, &stance, NULL, 0, matrix) == HOPFORM_NO_DERIVATIVE,
         "derivatives out of range");
    for (int n = 0; n < ROWS * COLUMNS; n++) {
        must(!(fabs(matrix[n]) > 0.0), "derivatives out of range, and not 0");
    }
}

static void ties(void)
{
    T(stance) stance;
    for (row = 500; row < 700; row++) {
        T(robot)
        r = {1.0, over(0.1, 10.0), over(1.0, 2e4), 0.4, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 9.81, 0.0, 0.0, 3.0, 0.0};
        const double v = over(0.4, 7.0) * r.g / sqrt(r.k / r.m_s);
        const long double w = sqrtl((long double)r.k / (long double)r.m_s);
        const long double slope = (long double)v * w / (long double)r.g,
                          angle = atanl(slope); /* one call a line: tcc */
        const long double exact = 2.0L * (3.14159265358979323846264338L - angle) / w;
        const double nearest = (double)exact,
                     horizon = (long double)nearest < exact ? nextafter(nearest, INFINITY) : nearest;
        must(ending_of(&r, 0.0, -v, 0.0, 0.0, horizon, &stance) == HOPFORM_ENDING_TAKEOFF, "a take-off at the horizon");
        must(ending_of(&r, 0.0, -v, 0.0, 0.0, horizon * (1.0 - 64.0 * 2.22e-16), &stance) == HOPFORM_ENDING_HORIZON,
             "a horizon before the take-off");
        near(stance.duration, (double)exact, 1e-12, "a take-off by algebra"); /* of the horizon, which is that near */
        r.x1_min = -INFINITY;
        r.x1_max = INFINITY;
        r.m_eff = r.m_s * over(0.05, 20.0);
        const double turn = sqrt(r.k / r.m_s + r.k / r.m_eff),
                     fall = -10.0 * r.g * (1.0 + r.m_s / r.m_eff) / turn - 1.0;
        must(ending_of(&r, fall, fall, 0.0, r.m_s * r.g, 3.3 * 6.2831853 / turn, &stance) == HOPFORM_ENDING_HORIZON
                 && stance.event_count == 0,
             "a spring force that touches zero");
        r.k = ldexp(1.0, (int)uniform(4.0, 14.0));
        r.m_s = ldexp(1.0, (int)uniform(-3.0, 4.0));
        r.m_eff = r.m_s * over(1.1, 20.0);
        const double y = r.m_s * r.g / r.k;
        r.c = y * over(2.0, 1e5);
        must(ending_of(&r, 0.0, 0.0, y, 0.0, 8.3 * 6.2831853 / sqrt(r.k / r.m_s + r.k / r.m_eff), &stance)
                     == HOPFORM_ENDING_HORIZON
                 && stance.event_count == 0,
             "a velocity that pauses");
        T(robot)
        held = {over(0.15, 7.0),
                1.0,
                over(50.0, 3000.0),
                0.4,
                0.0,
                0.0,
                0.0,
                0.0,
                1e5,
                -1.0,
                9.81,
                -INFINITY,
                INFINITY,
                3.0,
                0.0,
                0.0,
                0.0};
        held.b1 = 2.0 * uniform(1.05, 4.0) * sqrt(held.k * held.m_eff);
        const double slow = (held.b1 - sqrt(held.b1 * held.b1 - 4.0 * held.k * held.m_eff)) / (2.0 * held.m_eff),
                     fast = held.b1 / held.m_eff - slow;
        const double first = 0.02 * uniform(0.1, 1.0), second = 0.01 * uniform(0.0, 1.0);
        must(ending_of(&held, first * slow + second * fast, 0.0, 0.1 - first - second, 0.1 * held.k, 80.0 / slow,
                       &stance)
                     == HOPFORM_ENDING_HORIZON
                 && stance.event_count == 0,
             "a velocity that fades away");
    }
    const T(robot) both = {1.0, 1.0, 100.0, 0.4, 0.0, 0.0, 0.0, 0.1, 8.0, 1.0, 8.0, -INFINITY, INFINITY, 3.0, 0.0, 0.0, 0.0};
    problem p;
    p.step_count = 2;
    p.horizon = 2.0;
    const T(state) still = {0.0, 0.0, 0.0, 0.0};
    const T(step) steps[2] = {{0.0, 0.0}, {0.1, 5.0}};
    p.start = still;
    memcpy(p.steps, steps, sizeof steps);
    must(T(plan_init)(&p.plan, &both) == HOPFORM_OK && solve(&p, &stance) >= 0
             && phases[1].event == HOPFORM_EVENT_X1_SLIPS && phases[2].event == HOPFORM_EVENT_X2_SLIPS
             && !(fabs(phases[1].t - 0.1) > 0.0) && !(fabs(phases[2].t - 0.1) > 0.0),
         "two masses that a step lets go");
    for (int most = 1; most < 3; most++) {
        must(T(solve_stance)(&p.plan, &p.start, p.steps, 2, 2.0, most, phases, CAPACITY, &stance) >= 0
                 && stance.ending == HOPFORM_ENDING_TOO_MANY_PHASES && stance.phase_count == most
                 && stance.event_count == most - 1,
             "a cap between two that slip at once");
    }
}

/* How y falls and rises along a stance. A fall that lasts for less than
 * `patience` may be missed. */
typedef struct {
    double patience;
    double before;
    double since; /* when y began to fall */
    int falls;
    int dips;      /* that must be seen */
    double least;  /* y at them */
    int all;       /* that samples show */
    double lowest; /* y at them */
} rebounds;

static void follow(rebounds *r, double t, double y, int last)
{
    if (t > 0.0 && r->falls && (y >= r->before || last)) {
        const double dip = y >= r->before ? r->before : y;
        r->lowest = fmin(r->lowest, dip);
        r->all++;
        r->dips += t - r->since > r->patience;
        r->least = t - r->since > r->patience ? fmin(r->least, dip) : r->least;
    }
    r->since = r->falls ? r->since : t;
    r->falls = t > 0.0 && y < r->before;
    r->before = y;
}

/* What a trial says of its stance: the largest x_1, the least y of a rebound,
 * how many there are, and whether the actuator is held; and its slopes against
 * differences, where the events stay. */
static void tried(const problem *p, const T(stance) * stance)
{
    T(trial) trial, beside[2];
    int held = 1;
    for (int n = 0; n < stance->phases_kept; n++) {
        held = held && phases[n].mode / 3 == 1;
    }
    const double u = p->steps[0].u, step = 1e-7;
    double peak = -INFINITY, size = 0.0;
    rebounds seen = {0.0, p->start.y, 0.0, 0, 0, INFINITY, 0, INFINITY};
    int next = 1;
    const double turns =
        stance->duration * sqrt(p->plan.robot.k / p->plan.robot.m_eff + p->plan.robot.k / p->plan.robot.m_s);
    const int many = turns < 40.0 ? 2500 : 0;
    seen.patience =
        1.0 / (1.3 * sqrt(p->plan.poles[0].q)) + 2.0 * stance->duration / 2500.0; /* of a look to the next one */
    for (int n = 0; n <= many; n++) {
        T(state) at;
        const double t = stance->duration * ((double)n / larger(many, 1.0));
        must(T(stance_at)(&p->plan, p->steps, phases, stance, t, &at) == HOPFORM_OK, "no state");
        peak = larger(peak, at.x1);
        size = larger(size, at.y);
        for (; next < stance->phases_kept && phases[next].t < t; next++) { /* y turns at once where a stop is hit */
            follow(&seen, phases[next].t, phases[next].y, 0);
        }
        follow(&seen, t, at.y, n == many && stance->ending == HOPFORM_ENDING_REST); /* it rests where it has come to */
    }
    for (int n = 1; n < stance->phases_kept; n++) { /* where the upper stop is hit: how far that is from not being so
                                                     */
        T(state) at;
        const double just = phases[n].t - 1e-7 * (phases[n].t - phases[n - 1].t);
        if (phases[n].event == HOPFORM_EVENT_X1_HITS_STOP
            && T(stance_at)(&p->plan, p->steps, phases, stance, just, &at) == HOPFORM_OK && at.v1 > 0.0) {
            peak = larger(peak, phases[n].x1 + fmin(0.5 * at.v1 * at.v1 / p->plan.robot.g, phases[n].y));
        }
    }
    const double beside_u[3] = {u, u - step, u + step};
    T(phase) kept[CAPACITY];
    memcpy(kept, phases, sizeof kept);
    must(spent("trial", T(try_currents)(&p->plan, &p->start, 1, beside_u, 1, p->horizon, phases, CAPACITY, &trial))
             == HOPFORM_OK,
         "no trial");
    const int32_t fits = T(try_currents)(&p->plan, &p->start, 1, &beside_u[1], 2, p->horizon, phases, CAPACITY, beside);
    memcpy(phases, kept, sizeof kept);
    must(trial.held == held && trial.takes_off == (stance->ending == HOPFORM_ENDING_TAKEOFF), "held, or taking off");
    must(!trial.takes_off || !(fabs(trial.apex - stance->apex) > 0.0), "the apex of a trial");
    if (many > 0) {
        must(trial.largest_x1 >= peak - 1e-15 - 1e-5 * larger(peak - p->plan.robot.x1_max, 0.0)
                 && trial.largest_x1 <= peak + 1e-4 * (fabs(peak) + 0.01),
             "the largest x_1");
        double most;
        must(T(stance_compression)(&p->plan, p->steps, kept, stance, &most) == HOPFORM_OK
                 && most >= size * (1.0 - 1e-12) && most <= size * 1.002 + 1e-12,
             "the largest compression");
        must(trial.minima >= seen.dips || size < 1e-12, "a rebound that is not seen");
        must(trial.least_contact <= seen.least + 1e-5 * size
                 && (seen.all == 0 || trial.minima > seen.all || trial.least_contact >= seen.lowest - 1e-3 * size),
             "the least y of a rebound");
    }
    if (fits != HOPFORM_OK || beside[0].events != beside[1].events || beside[0].events != trial.events) {
        return;
    }
    const double apex_bend = fabs(beside[0].apex + beside[1].apex - 2.0 * trial.apex),
                 peak_bend = fabs(beside[0].largest_x1 + beside[1].largest_x1 - 2.0 * trial.largest_x1);
    if (trial.takes_off && trial.smooth && apex_bend < 1e-13) {
        near(trial.apex_u, (beside[1].apex - beside[0].apex) / (2.0 * step), 1e-6 * (1.0 + fabs(trial.apex_u)),
             "any slope of the apex");
    }
    if (peak_bend < 1e-13 && trial.smooth && fabs(beside[0].largest_x1 - p->start.x1) > 1e-9) {
        near(trial.largest_x1_u, (beside[1].largest_x1 - beside[0].largest_x1) / (2.0 * step),
             1e-6 * (1.0 + fabs(trial.largest_x1_u)), "any slope of the peak");
    }
    if (trial.minima > 0 && trial.minima == beside[0].minima && trial.minima == beside[1].minima && trial.smooth
        && fabs(beside[0].least_contact + beside[1].least_contact - 2.0 * trial.least_contact) < 1e-11) {
        near(trial.least_contact_u, (beside[1].least_contact - beside[0].least_contact) / (2.0 * step),
             1e-3 * (1e-3 + fabs(trial.least_contact_u)) + 1e-4, "any slope of the dip");
    }
}

/* A stiff spring between masses that slide on for many of its periods: a mean
 * that creeps, and what rings about it. */
static problem ringing(void)
{
    problem p;
    T(robot) r = any_robot();
    r.g = 9.81;
    r.c = 0.0;
    r.k = over(1e3, 3e6);
    r.b1 = (r.m_eff + r.m_s) * over(0.3, 30.0);
    r.b2 = mostly(2.0 * sqrt(r.k * r.m_s) * over(1e-6, 1e-2), 0.4);
    r.f1 = mostly(over(1e-3, 0.3), 0.7);
    r.f2 = mostly(over(1e-3, 0.3), 0.7);
    r.x1_min = -INFINITY;
    r.x1_max = INFINITY;
    const double mass = r.m_eff * r.m_s / (r.m_eff + r.m_s), w = sqrt(r.k / mass);
    p.start.v2 = uniform(-3.0, 1.0);
    p.start.v1 = p.start.v2 + uniform(-0.02, 0.1);
    p.start.y = (r.m_s * (r.g + uniform(-2.0, 2.0)) / r.k + larger(0.0, p.start.v2 - p.start.v1) / w) * over(0.7, 3.0);
    p.start.x1 = 0.0;
    p.step_count = uniform(0.0, 1.0) < 0.4 ? 2 : 1;
    p.steps[0].t = 0.0;
    p.steps[0].u = uniform(-1.0, 1.0) * r.m_s * r.g / fabs(r.gamma2);
    p.steps[1].t = over(0.05, 0.5);
    p.steps[1].u = uniform(-1.0, 1.0) * r.m_s * r.g / fabs(r.gamma2);
    p.horizon = larger(0.05, over(30.0, 1500.0) / w);
    must(T(plan_init)(&p.plan, &r) == HOPFORM_OK, "no plan");
    return p;
}

/* Three poles that nearly coincide, for a long time. */
static problem nearly_triple(void)
{
    problem p;
    T(robot) r = usual;
    const double rate = over(3.0, 30.0);
    r.m_eff = over(0.1, 10.0);
    r.m_s = 8.0 * r.m_eff;
    r.b1 = 3.0 * r.m_eff * rate;
    r.b2 = 0.0;
    r.k = r.m_s * rate * rate / 3.0 * (1.0 + mostly(uniform(-0.1, 0.1), 0.3));
    r.f1 = mostly(over(1e-3, 0.3), 0.5);
    r.f2 = mostly(over(1e-3, 0.3), 0.5);
    r.x1_min = -INFINITY;
    r.x1_max = INFINITY;
    const T(state) start = {0.01, uniform(-1.0, 1.0), uniform(-2.0, 0.0), over(0.01, 0.3)};
    must(T(plan_init)(&p.plan, &r) == HOPFORM_OK, "no plan");
    p.start = start;
    p.step_count = 1;
    p.steps[0].t = 0.0;
    p.steps[0].u = uniform(-1.0, 1.0) * r.m_s * r.g / fabs(r.gamma2);
    p.steps[1].t = 100.0;
    p.horizon = 1.0;
    return p;
}

/* Any robot, falling in or already on the ground. */
static problem falling(void)
{
    problem p;
    const T(robot) robot = any_robot();
    must(T(plan_init)(&p.plan, &robot) == HOPFORM_OK, "no plan");
    p.start.y = mostly(over(1e-4, 0.03), 0.8);
    p.start.x1 = mostly(uniform(0.0, 1.0), 0.5) * (isfinite(robot.x1_max) ? robot.x1_max : 0.02);
    p.start.v2 = -over(0.05, 4.0);
    p.start.v1 = mostly(uniform(-0.3, 1.0), 0.5);
    p.start.v1 = p.start.y > 0.0 || p.start.v1 > p.start.v2 ? p.start.v1 : 0.0;
    p.step_count = uniform(0.0, 1.0) < 0.3 ? 2 : 1;
    p.steps[0].t = 0.0;
    p.steps[0].u = mostly(uniform(-3.0, 3.0), 0.3);
    p.steps[1].t = p.step_count > 1 ? over(0.003, 0.3) : 100.0;
    p.steps[1].u = uniform(-3.0, 3.0);
    p.horizon = 1.0;
    return p;
}

/* Where a phase lasts for many turns, it is looked at often in each. */
static void all_along(const problem *p, const T(stance) * stance, double from, double to, double u, int side_1,
                      int side_2)
{
    const T(robot) *r = &p->plan.robot;
    const double turns = (to - from) * sqrt(r->k / r->m_eff + r->k / r->m_s);
    for (int n = 1; n < 4.0 * turns && n < 1200; n++) {
        T(state) at;
        must(T(stance_at)(&p->plan, p->steps, phases, stance,
                          from + (to - from) * ((double)n / (4.0 * turns < 1200.0 ? ceil(4.0 * turns) : 1200.0)), &at)
                 == HOPFORM_OK,
             "no state");
        is_a_mode(r, &at, u, side_1, side_2);
    }
}

/* Forces on each mass add up to its acceleration: those of friction and of the stop to none on one that is held. */
static void forces_of_phase(const problem *p, const T(stance) * stance, const double times[11], const T(state) at[11],
                            double u, int side_1, int side_2)
{
    const T(robot) *r = &p->plan.robot;
    T(forces) forces[11];
    must(T(stance_forces)(&p->plan, p->steps, phases, stance, times, 11, forces) == HOPFORM_OK, "no forces");
    for (int i = 0; i < 11; i++) {
        double a[2];
        free_accelerations(r, &at[i], u, a);
        const double size = 1e-12
                            * (r->m_eff * (r->f1 + r->f1_excess + r->b1 * fabs(at[i].v1) / r->m_eff)
                               + r->k * (fabs(at[i].y) + fabs(r->c)) + fabs(r->gamma2 * u)
                               + r->m_s * (r->g + r->f2 + r->f2_excess) + r->b2 * fabs(at[i].v2));
        near(forces[i].input, -r->gamma2 * u, size, "the force of the input");
        near(forces[i].contact, r->k * at[i].y, size, "the force of the ground");
        near(forces[i].friction_x1 + forces[i].stop_x1, side_1 != 0 ? -side_1 * r->f1 * r->m_eff : -r->m_eff * a[0], size,
             "the force on mass 1");
        near(forces[i].friction_x2, side_2 != 0 ? -side_2 * r->f2 * r->m_s : -r->m_s * a[1], size,
             "the force on mass 2");
        must(!(fabs(forces[i].stop_x1) > 0.0)
                 || (side_1 == 0 && (at[i].x1 <= r->x1_min || at[i].x1 >= r->x1_max)),
             "a stop that pushes from afar");
    }
}

/* Velocities, forces and stops agree with the modes all along; the motion obeys
 * (3), (4) in every phase. */
static void any_stance(problem p)
{
    T(stance) stance;
    const T(robot) robot = p.plan.robot;
    const int32_t status = solve(&p, &stance);
    must(status >= 0, "a stance that is refused");
    if (stance.phases_kept < stance.phase_count || stance.ending == HOPFORM_ENDING_TOO_MANY_PHASES) {
        return;
    }
    for (int n = 0; n < stance.phases_kept; n++) {
        const double from = phases[n].t, to = n + 1 < stance.phases_kept ? phases[n + 1].t : stance.duration;
        const double u = p.steps[phases[n].step].u;
        const int side_1 = phases[n].mode / 3 - 1, side_2 = phases[n].mode % 3 - 1;
        must(to >= from && phases[n].step == (p.step_count > 1 && from >= p.steps[1].t ? 1 : 0),
             "a phase out of its order");
        T(state) at[11];
        double times[11];
        for (int i = 0; i < 11; i++) {
            times[i] = from + (0.002 + 0.0996 * (double)i) * (to - from);
            must(T(stance_at)(&p.plan, p.steps, phases, &stance, times[i], &at[i]) == HOPFORM_OK, "no state");
            is_a_mode(&robot, &at[i], u, side_1, side_2);
        }
        if (to - from > 1e-9) {
            forces_of_phase(&p, &stance, times, at, u, side_1, side_2);
        }
        all_along(&p, &stance, from, to, u, side_1, side_2);
        if (n + 1 < stance.phases_kept
            && to - from > 1e-6) { /* what the next one begins with is where this one leads */
            T(state) end;
            must(T(stance_at)(&p.plan, p.steps, phases, &stance, from + (to - from) * (1.0 - 1e-9), &end) == HOPFORM_OK,
                 "no state");
            const double speed = 1e-8 * (1.0 + fabs(end.v1) + fabs(end.v2));
            near(end.x1, phases[n + 1].x1, speed, "a jump of x1");
            near(end.y, phases[n + 1].y, speed, "a jump of y");
            const int stops = phases[n + 1].event == HOPFORM_EVENT_X1_HITS_STOP;
            const double push =
                (robot.k * (0.1 + fabs(end.y)) / fmin(robot.m_eff, robot.m_s) + 1e3) * 1e-10 + 100.0 * speed;
            near(stops ? phases[n + 1].v1 : end.v1, phases[n + 1].v1, push, "a jump of v1");
            near(end.v2, phases[n + 1].v2, push, "a jump of v2");
            const int kind = phases[n + 1].event, sides_1 = phases[n + 1].mode / 3 - 1,
                      sides_2 = phases[n + 1].mode % 3 - 1;
            must(kind != HOPFORM_EVENT_X1_REVERSES || sides_1 == -side_1, "x1_reverses");
            must(kind != HOPFORM_EVENT_X2_REVERSES || sides_2 == -side_2, "x2_reverses");
            must(kind != HOPFORM_EVENT_X1_STICKS || (sides_1 == 0 && side_1 != 0), "x1_sticks");
            must(kind != HOPFORM_EVENT_X2_STICKS || (sides_2 == 0 && side_2 != 0), "x2_sticks");
            must(kind != HOPFORM_EVENT_X1_SLIPS || (sides_1 != 0 && side_1 == 0), "x1_slips");
            must(kind != HOPFORM_EVENT_X2_SLIPS || (sides_2 != 0 && side_2 == 0), "x2_slips");
            must(!stops || !(fabs(phases[n + 1].v1) > 0.0), "x1_hits_stop");
        }
        const double h = 0.0996 * (to - from); /* (3), (4) by differences of velocities over the
                                                  phase: Simpson's rule of the forces */
        for (int i = 0;
             i + 2 < 11 && h > 0.0
             && h * (sqrt(robot.k / robot.m_eff + robot.k / robot.m_s) + robot.b1 / robot.m_eff + robot.b2 / robot.m_s)
                    < 0.01;
             i += 2) {
            double a[3][2];
            for (int j = 0; j < 3; j++) {
                free_accelerations(&robot, &at[i + j], u, a[j]);
            }
            const double sum_1 = (a[0][0] + 4.0 * a[1][0] + a[2][0]) * h / 3.0 - 2.0 * h * side_1 * robot.f1;
            const double sum_2 = (a[0][1] + 4.0 * a[1][1] + a[2][1]) * h / 3.0 - 2.0 * h * side_2 * robot.f2;
            const double size = 1e-9 * (fabs(at[i].v1) + fabs(at[i].v2) + (fabs(a[0][0]) + fabs(a[0][1])) * h) + 1e-13;
            near(at[i + 2].v1 - at[i].v1, side_1 != 0 ? sum_1 : 0.0, size, "(3)");
            near(at[i + 2].v2 - at[i].v2, side_2 != 0 ? sum_2 : 0.0, size, "(4)");
            near(at[i + 2].x1 - at[i].x1, (at[i].v1 + 4.0 * at[i + 1].v1 + at[i + 2].v1) * h / 3.0,
                 size * h + 1e-15 + 1e-15 * fabs(at[i].x1), "x1'");
            near(at[i + 2].y - at[i].y,
                 (at[i].v1 - at[i].v2 + 4.0 * (at[i + 1].v1 - at[i + 1].v2) + at[i + 2].v1 - at[i + 2].v2) * h / 3.0,
                 size * h + 2e-15 + 1e-13 * fabs(at[i].y), "y'");
        }
    }
    if (stance.ending == HOPFORM_ENDING_TAKEOFF) {
        must(!(fabs(stance.end.y) > 0.0) && stance.end.v1 <= stance.end.v2 + 1e-9,
             "a take-off of a leg that does not extend");
    }
    must(stance.ending != HOPFORM_ENDING_HORIZON || !(fabs(stance.duration - p.horizon) > 0.0),
         "a horizon that is not reached");
    if (stance.ending == HOPFORM_ENDING_REST) {
        must(!(fabs(stance.end.v1) > 0.0) && !(fabs(stance.end.v2) > 0.0), "a rest that moves");
    }
    consistent(&p, &stance, 0.5 * robot.m_s * larger(p.start.v2 * p.start.v2, 1.0), 1e2);
    if (uniform(0.0, 1.0) < 0.3) {
        derivatives(&p, &stance);
    }
    if (p.step_count == 1 && robot.g > 0.0) {
        tried(&p, &stance);
    }
}

/* A flight from an input moved by a step; false if it can not be moved, or goes through other phases. */
static int beside_flight(const T(plan) * plan, const T(flight) * flight, int column, double step, T(flight) * to)
{
    T(plan) moved_plan;
    T(robot) robot = plan->robot;
    T(state) start = flight->start;
    T(gains) gains = flight->gains;
    double fields[FIELDS], ground = flight->ground;
    memcpy(fields, &robot, sizeof robot);
    double *const at[] = {&start.x1, &start.v1, &start.y, &start.v2, NULL};
    double *const behind[] = {&ground, &gains.Kp, &gains.Kd};
    double *const input = column < 5         ? at[column]
                          : column < COLUMNS ? &fields[column - 5]
                                             : behind[column - COLUMNS];
    if (input != NULL) { *input += step; }
    memcpy(&robot, fields, sizeof robot);
    const int designs = flight->designed && column <= HOPFORM_COLUMN_OF_GROUND;
    static T(flight_phase) others[CAPACITY];
    if (T(plan_init)(&moved_plan, &robot) != HOPFORM_OK
        || T(solve_flight)(&moved_plan, &start, ground, designs ? NULL : &gains, 1.0, CAPACITY, others, CAPACITY, to) < 0
        || to->ending != flight->ending || to->phase_count != flight->phase_count) {
        return 0;
    }
    for (int n = 0; n < to->phases_kept; n++) {
        if (others[n].side != flight_phases[n].side || others[n].limit != flight_phases[n].limit
            || others[n].event != flight_phases[n].event) {
            return 0;
        }
    }
    return 1;
}

static void flight_rows_of(const T(flight) * f, const T(robot) * r, double out[HOPFORM_FLIGHT_ROWS])
{
    const double rows[HOPFORM_FLIGHT_ROWS] = {
        f->duration, f->end.x1, f->end.v1, f->end.x1 - f->end.y + r->L0 + r->c, f->end.v2, f->v2_after, f->apex};
    memcpy(out, rows, sizeof rows);
}

static int flight_derivatives_compared, flights_with_derivatives;

/* Derivatives of a flight against differences, where the phases stay the same ones. */
static void flight_derivatives(const T(plan) * plan, const T(flight) * flight)
{
    enum { ALL = HOPFORM_FLIGHT_COLUMNS, R = HOPFORM_FLIGHT_ROWS };
    static double matrix[R * ALL];
    for (int n = 0; n < R * ALL; n++) {
        matrix[n] = NAN;
    }
    const int32_t status =
        spent("flight_sensitivities", T(flight_sensitivities)(plan, flight_phases, flight, NULL, 0, matrix));
    must(status == HOPFORM_OK || status == HOPFORM_NO_DERIVATIVE, "derivatives of a flight that are refused");
    static double none[2 * R];
    const int32_t columns[2] = {0, ALL};
    none[0] = NAN;
    must(T(flight_sensitivities)(plan, flight_phases, flight, columns, 2, none) == HOPFORM_ERROR_COLUMNS
             && !(fabs(none[0]) > 0.0) && !isnan(none[0]),
         "a column that is none");
    for (int n = 0; n < R * ALL; n++) {
        must(status == HOPFORM_OK ? isfinite(matrix[n]) : !(fabs(matrix[n]) > 0.0) && !isnan(matrix[n]),
             "a derivative of a flight that is no number");
    }
    if (status != HOPFORM_OK) { return; }
    flights_with_derivatives++;
    double whole[R], fields[FIELDS];
    flight_rows_of(flight, &plan->robot, whole);
    memcpy(fields, &plan->robot, sizeof fields);
    for (int column = 0; column < ALL; column++) {
        const double value = column == HOPFORM_COLUMN_OF_KP   ? flight->gains.Kp
                             : column == HOPFORM_COLUMN_OF_KD ? flight->gains.Kd
                             : column > 4 && column < COLUMNS ? fields[column - 5]
                                                              : 0.1;
        const double step = 1e-6 * larger(1e-2, isfinite(value) ? fabs(value) : 1.0);
        T(flight) up, down;
        T(robot) higher = plan->robot, lower = plan->robot;
        if (!beside_flight(plan, flight, column, step, &up) || !beside_flight(plan, flight, column, -step, &down)) {
            continue;
        }
        higher.L0 += column == 5 + 3 ? step : 0.0, lower.L0 -= column == 5 + 3 ? step : 0.0;
        higher.c += column == 5 + 4 ? step : 0.0, lower.c -= column == 5 + 4 ? step : 0.0;
        double high[R], low[R];
        flight_rows_of(&up, &higher, high);
        flight_rows_of(&down, &lower, low);
        for (int r = 0; r < R; r++) {
            const double slope = (high[r] - low[r]) / (2.0 * step);
            const double curve = fabs(high[r] + low[r] - 2.0 * whole[r]) / step;
            near(matrix[r * ALL + column], slope,
                 1e-5 * (fabs(slope) + 0.02) + 2.0 * curve + (1e-12 + 8.9e-16 * fabs(whole[r])) / step,
                 "a derivative of a flight");
            flight_derivatives_compared++;
        }
    }
}

/* The law, its limit and the stops hold all along; the foot is above the ground
 * until it touches it, coming down. */
static void any_flight(void)
{
    T(plan) plan;
    T(flight) flight;
    T(robot) robot = any_robot();
    robot.g = 9.81;
    robot.u_max = uniform(0.0, 1.0) < 0.4 ? INFINITY : over(0.05, 3.0);
    robot.f1 = mostly(over(0.02, 5.0), 0.3);
    must(T(plan_init)(&plan, &robot) == HOPFORM_OK, "no plan");
    const double rate = over(1.0, 60.0),
                 damping = larger(0.0, mostly(2.0 * robot.m_eff * rate * over(0.05, 3.0), 0.2) - robot.b1);
    const T(gains) gains = {mostly(robot.m_eff * rate * rate, 0.15), damping};
    const T(state) start = {isfinite(robot.x1_max) ? uniform(robot.x1_min, robot.x1_max) : uniform(-0.05, 0.05),
                            mostly(uniform(-1.0, 1.0), 0.2), uniform(-0.5, 2.5), mostly(uniform(-0.1, 0.1), 0.4)};
    const int designs = uniform(0.0, 1.0) < 0.2;
    must(spent("flight",
               T(solve_flight)(&plan, &start, 0, designs ? NULL : &gains, 1.0, CAPACITY, flight_phases, CAPACITY,
                               &flight))
             >= 0,
         "a flight that is refused");
    if (flight.phases_kept < flight.phase_count || flight.ending == HOPFORM_FLIGHT_TOO_MANY_PHASES) {
        return;
    }
    if (designs) {
        const double square = start.v2 * start.v2 + 2.0 * robot.g * start.x1;
        const double fall = square > 0.0 ? (start.v2 + sqrt(square)) / robot.g - 0.05 : 0.0,
                     rate_of = 20.0 / 3.0 / larger(fall, 0.02);
        near(flight.gains.Kp, rate_of * (flight.gains.Kd + robot.b1 - robot.m_eff * rate_of),
             1e-14 * rate_of * (flight.gains.Kd + robot.b1 + robot.m_eff * rate_of), "the gains of any flight");
        near(flight.gains.Kd, larger(0.0, 2.0 * robot.m_eff * rate_of - robot.b1),
             1e-14 * (robot.m_eff * rate_of + robot.b1), "the damping of any flight");
    }
    const double largest = fabs(robot.gamma2) * robot.u_max;
    int above = start.y < 0.0;
    double highest = -INFINITY;
    for (int n = 0; n < flight.phases_kept; n++) {
        const double from = flight_phases[n].t,
                     to = n + 1 < flight.phases_kept ? flight_phases[n + 1].t : flight.duration;
        for (int i = 0; i < 12; i++) {
            const double t = fmin(from + (0.003 + 0.0903 * (double)i) * (to - from), flight.duration);
            T(state) s;
            must(T(flight_at)(&plan, flight_phases, &flight, &t, 1, &s) == HOPFORM_OK, "no state of a flight");
            const double pull = flight.gains.Kp * s.x1 + flight.gains.Kd * s.v1,
                         tiny = 1e-8 * (1.0 + fabs(pull) + flight.gains.Kd);
            const int limit = flight_phases[n].limit, side = flight_phases[n].side;
            must(limit != 0 ? limit * pull >= largest - tiny : fabs(pull) <= largest + tiny, "the motor's limit");
            must(side != 0 ? side * s.v1 >= -1e-9 * (1.0 + fabs(start.v1)) : !(fabs(s.v1) > 0.0),
                 "the actuator against its mode in flight");
            must(s.x1 >= robot.x1_min - 1e-12 && s.x1 <= robot.x1_max + 1e-12, "out of its stroke in flight");
            const double most = robot.m_eff * (robot.f1 + robot.f1_excess) * (1.0 + 1e-9);
            const double force = robot.k * robot.c - (limit != 0 ? limit * largest : pull);
            must(side != 0 || !(robot.x1_min < robot.x1_max)
                     || ((force <= most + tiny || s.x1 >= robot.x1_max)
                         && (force >= -most - tiny || s.x1 <= robot.x1_min)),
                 "held by too much in flight");
            must(!above || s.y <= 1e-9, "a foot that was below the ground");
            above = above || s.y < -1e-9;
            highest = larger(highest, -s.y);
        }
    }
    if (flight.ending == HOPFORM_FLIGHT_TOUCHDOWN) {
        must((above || flight.duration < 1e-4) && fabs(flight.end.y) <= 1e-9 && flight.end.v2 - flight.end.v1 <= 1e-9,
             "a touchdown of a foot that rises");
    }
    must(flight.ending != HOPFORM_FLIGHT_TRIPPED || (highest <= 1e-9 && -flight.end.y >= highest - 1e-9), "tripped");
    const double middle[2] = {0.5 * flight.duration, flight.duration};
    T(energy) e[2];
    T(flight_ledger) ledger[2];
    double loss[2];
    must(T(flight_energy)(&plan, flight_phases, &flight, middle, 2, e, ledger, loss) == HOPFORM_OK,
         "no energies of a flight");
    const double begin = 0.5 * robot.m_eff * start.v1 * start.v1 + 0.5 * robot.m_s * start.v2 * start.v2
                         + robot.m_s * robot.g * (start.x1 - start.y);
    for (int n = 0; n < 2; n++) {
        const double gained =
            ledger[n].motor_work + ledger[n].offset_work + ledger[n].viscous_1 + ledger[n].coulomb_1 + loss[n];
        const double other = e[1 - n].total
                             - (ledger[1 - n].motor_work + ledger[1 - n].offset_work + ledger[1 - n].viscous_1
                                + ledger[1 - n].coulomb_1 + loss[1 - n]);
        near(e[n].total - gained, other, 1e-12 * (fabs(begin) + fabs(e[n].total) + fabs(gained) + 1.0),
             "the sum of any flight's ledger");
        must(ledger[n].viscous_1 <= 1e-15 && ledger[n].coulomb_1 <= 1e-15 && loss[n] <= 0.0, "friction that drives");
    }
    flight_derivatives(&plan, &flight);
}

/* No current on a grid does better than the command: none with a smaller |u|
 * reaches it, none comes nearer. */
static void any_command(void)
{
    enum { GRID = 121 };
    static T(trial) trials[GRID];
    T(plan) plan;
    T(command) command;
    T(robot)
    hopper = {25.0, 3.0, 1200.0, 0.4, 0.0, 150.0, 5.0, 0.78, 0.6, -65.0, 9.81, 0.0, 0.08, 3.0, 0.05, 0.0, 0.0};
    if (row % 2 == 1) { /* a softer or stiffer one, with another drive and another stroke */
        hopper.m_eff *= over(0.05, 4.0);
        hopper.k *= over(0.3, 3.0);
        hopper.b1 *= mostly(over(0.1, 3.0), 0.15);
        hopper.f1 *= mostly(over(0.2, 2.0), 0.3);
        hopper.f2 *= mostly(over(0.2, 2.0), 0.3);
        hopper.gamma2 *= row % 4 == 1 ? -1.0 : 1.0;
        hopper.x1_min = -mostly(over(0.005, 0.05), 0.3);
        hopper.x1_max = over(0.02, 0.1);
    }
    hopper.x1_min = row % 12 == 0 ? 0.0 : hopper.x1_min;
    hopper.x1_max = row % 12 == 0 ? 0.0 : hopper.x1_max; /* locked: there is nothing to choose */
    const T(robot) *robot = &hopper;
    must(T(plan_init)(&plan, robot) == HOPFORM_OK, "no plan");
    const T(state) start = {uniform(0.0, 0.02) * (row % 12 == 0 ? 0.0 : 1.0), mostly(uniform(-0.1, 0.3), 0.4),
                            -over(0.4, 2.8), 0.0};
    const T(target) target = {over(0.003, 0.4), 0.0, mostly(over(1e-4, 0.05), 0.6), 1.0};
    must(spent("command", T(choose_current)(&search, &plan, &start, &target, phases, CAPACITY, &command)) >= 0,
         "a command that is refused");
    const double limit = robot->x1_min < robot->x1_max ? robot->x1_max - target.stop_margin : INFINITY;
    double currents[GRID];
    for (int n = 0; n < GRID; n++) {
        currents[n] = robot->u_max * (-1.0 + 2.0 * (double)n / (GRID - 1));
    }
    must(T(try_currents)(&plan, &start, 1, currents, GRID, target.horizon, phases, CAPACITY, trials) >= 0, "no trials");
    const double gap = command.status == HOPFORM_COMMAND_NO_TAKEOFF ? INFINITY : fabs(command.apex - target.h_des);
    must(command.status != HOPFORM_COMMAND_REACHED || gap <= 2.1e-10, "an apex that is not reached");
    for (int n = 0; n < GRID; n++) {
        const int admissible = trials[n].takes_off && trials[n].largest_x1 < limit - 1e-12;
        must(!admissible || fabs(trials[n].apex - target.h_des) >= gap - 2e-9, "a better current");
        if (n > 0 && command.status == HOPFORM_COMMAND_REACHED && trials[n].events == trials[n - 1].events && admissible
            && trials[n - 1].takes_off && trials[n - 1].largest_x1 < limit - 1e-12 && trials[n].minima == 0
            && trials[n - 1].minima == 0) {
            const double inner = fmin(fabs(currents[n]), fabs(currents[n - 1])),
                         outer = larger(fabs(currents[n]), fabs(currents[n - 1]));
            const int crosses = (trials[n].apex - target.h_des) * (trials[n - 1].apex - target.h_des) < 0.0;
            must(!crosses || fabs(command.u) <= outer + 1e-9 || inner > outer, "a smaller current");
        }
    }
    if (command.status != HOPFORM_COMMAND_NO_TAKEOFF) {
        T(trial) chosen;
        must(T(try_currents)(&plan, &start, 1, &command.u, 1, target.horizon, phases, CAPACITY, &chosen) >= 0
                 && chosen.takes_off && chosen.largest_x1 < limit,
             "a command that is not admissible");
        near(chosen.apex, command.apex, 1e-12, "the apex of any command");
    }
}

int main(int argc, char **argv)
{
    listen(argc, argv);
    contact();
    for (int kind = take_int(); kind != 0; kind = take_int()) {
        row++;
        if (kind == 1) {
            one_stance();
        } else if (kind == 2) {
            one_flight();
        } else {
            one_command();
        }
    }
    limits();
    leaving();
    fading();
    cancelling();
    out_of_range();
    ties();
    for (row = 1000; row < 1600; row++) {
        any_stance(falling());
    }
    for (row = 1600; row < 1800; row++) {
        any_stance(ringing());
    }
    for (row = 1800; row < 1900; row++) {
        any_stance(nearly_triple());
    }
    for (row = 2000; row < 3000; row++) {
        any_flight();
    }
    must(flights_with_derivatives > 700 && flight_derivatives_compared > 100000, "few derivatives of flights");
    for (row = 3000; row < 3120; row++) {
        any_command();
    }
    return conclude();
}
