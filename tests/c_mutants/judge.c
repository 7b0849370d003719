/* The tests in C that judge a mutant of the double precision sources: stances, flights and commands of vectors.h, each also
 * at times in between and by what must be true of any; kernels against long double; nothing is compared bit for bit.
 *
 * Prints what is wrong and ends with 1, or is silent. An error may be 1e-12 of its scale, times the condition number.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "events_f64.h"
#include "vectors.h"

#define T(name) hopform_##name##_f64

enum { CAPACITY = 64, TIMES = 16, ROWS = HOPFORM_SENSITIVITY_ROWS, COLUMNS = HOPFORM_SENSITIVITY_COLUMNS, FIELDS = HOPFORM_ROBOT_FIELDS };

static T(phase) phases[CAPACITY];
static T(flight_phase) flight_phases[CAPACITY];
static T(search) search;
static const double *next_number = vectors;
static int row;
static int wrong;
static double worst;
static int verbose;

static double take(void)
{
    const double number = *next_number++;
    return fabs(number) < ENDLESS ? number : (number > 0.0 ? INFINITY : -INFINITY);
}

static int take_int(void)
{
    return (int)take();
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

/* ---- kernels ---- */

static void elementary(void)
{
    for (int n = -4000; n <= 4000; n++) {
        const double x = (double)n * 0.0173;
        const long double e = expl((long double)-fabs(x));
        const T(fade) fade = hopform_fade_by_f64(-fabs(x));
        near(fade.left, (double)e, 4e-16 * (double)e, "exp");
        near(fade.gone, (double)-expm1l((long double)-fabs(x)), 5e-16 * fabs((double)expm1l((long double)-fabs(x))) + 1e-300, "1 - exp");
        const double turned = fabs(x) * 3.0;
        const T(turn) turn = hopform_turn_by_f64(turned);
        near(turn.sine, (double)sinl((long double)turned), 3e-16 + 5e-17 * turned, "sin");
        near(turn.cosine, (double)cosl((long double)turned), 3e-16 + 5e-17 * turned, "cos");
        near(hopform_log_f64(exp(x)), (double)logl((long double)exp(x)), 4e-16 * (1.0 + fabs(x)), "log");
        const double angle = ((double)n + 4000.5) / 8001.0 * 3.14159265358979;
        near(hopform_angle_f64(7.0 * cos(angle), 7.0 * sin(angle)), angle, 2e-15, "angle");
        const double power = exp(4.0 * x);
        near(hopform_cube_root_f64(power), (double)cbrtl((long double)power), 2.5e-16 * (double)cbrtl((long double)power), "cbrt");
    }
    must(fabs(hopform_exp_f64(-1e5)) <= 0.0 && hopform_fade_by_f64(-1e5).gone >= 1.0, "exp far below");
    must(fabs(hopform_cube_root_f64(0.0)) <= 0.0 && fabs(hopform_cube_root_f64(-1.0)) <= 0.0, "cbrt of what is not above 0");
    near(hopform_cube_root_f64(1e-315), (double)cbrtl(1e-315L), 1e-8 * 1e-105, "cbrt of a tiny number");
    for (int n = -17; n <= 17; n++) {
        const double s = (double)n * 0.01;
        near(hopform_area_tangent_f64(s), n ? (double)(atanhl((long double)s) / (long double)s) : 1.0, 4e-16, "artanh(s)/s");
    }
}

/* W'', W', W and its two integrals: z' = M z to long double precision, by halving and a power series. */
static void exact_basis(const T(poles) *poles, double t, long double w[5])
{
    int halvings = 0;
    const long double size = (long double)(poles->s_1 + sqrt(poles->s_2)) * (long double)t;
    while (ldexpl(size, -halvings) > 0.25L && halvings < 60) {
        halvings++;
    }
    const long double h = ldexpl((long double)t, -halvings);
    long double phi[5][5];
    for (int column = 0; column < 5; column++) {
        long double term[5] = {0};
        term[column] = 1;
        for (int i = 0; i < 5; i++) {
            phi[i][column] = term[i];
        }
        for (int n = 1; n < 40; n++) { /* rates of (W'', W', W, int W, int int W) */
            const long double rate[5] = {-((long double)poles->s_1 * term[0] + (long double)poles->s_2 * term[1]
                                           + (long double)poles->s_3 * term[2]), term[0], term[1], term[2], term[3]};
            for (int i = 0; i < 5; i++) {
                term[i] = rate[i] * h / n;
                phi[i][column] += term[i];
            }
        }
    }
    for (; halvings > 0; halvings--) {
        long double twice[5][5] = {{0}};
        for (int i = 0; i < 5; i++) {
            for (int j = 0; j < 5; j++) {
                for (int k = 0; k < 5; k++) {
                    twice[i][j] += phi[i][k] * phi[k][j];
                }
            }
        }
        memcpy(phi, twice, sizeof phi);
    }
    for (int i = 0; i < 5; i++) {
        w[i] = phi[i][0]; /* from W'' = 1 */
    }
}

static void basis_of(const T(poles) *poles)
{
    const double speed = poles->s_1 + sqrt(poles->s_2);
    for (int n = -12; n <= 12; n++) {
        const double t = exp(0.55 * (double)n) / speed;
        long double w[5];
        exact_basis(poles, t, w);
        const T(basis) at = hopform_basis_at_f64(poles, t);
        const double scale[5] = {1.0, t, t * t / 2.0, t * t * t / 6.0, t * t * t * t / 24.0};
        const double got[5] = {at.Wdd, at.Wd, at.W, at.W1, at.W2};
        for (int i = 0; i < 5; i++) {
            near(got[i], (double)w[i], 4e-12 * larger(fabs((double)w[i]), 1e-3 * scale[i] / (1.0 + t * speed)), "the response of the poles");
        }
    }
}

static void all_poles(void)
{
    static const double cubics[][3] = { /* rates of a, then p, q of the pair */
        {1.0, 0.2, 30.0}, {40.0, 3.0, 900.0}, {5.0, 10.0, 25.0}, {5.0, 10.1, 25.5}, {3.0, 30.0, 200.0}, {0.01, 4.0, 900.0},
        {300.0, 1.0, 1.0}, {2.0, 4.0, 4.0}, {2.0, 4.000001, 4.0}, {7.0, 100.0, 2400.0}, {10.0, 20.5, 105.0}, {1.0, 2.2, 1.25}};
    for (size_t n = 0; n < sizeof cubics / sizeof cubics[0]; n++) {
        const double a = cubics[n][0], p = cubics[n][1], q = cubics[n][2];
        const T(poles) poles = hopform_factor_cubic_f64(a + p, q + a * p, a * q);
        near(poles.a + poles.p, a + p, 1e-14 * (a + p), "the factors, s_1");
        near(poles.q + poles.a * poles.p, q + a * p, 1e-14 * (q + a * p), "the factors, s_2");
        near(poles.a * poles.q, a * q, 1e-13 * a * q, "the factors, s_3");
        basis_of(&poles);
        const T(poles) held = {0.0, p, q, p, q, 0.0};
        basis_of(&held);
    }
    const T(poles) still = hopform_factor_cubic_f64(0.0, 900.0, 0.0);
    near(still.q, 900.0, 1e-12, "no friction");
    basis_of(&still);
}

/* ---- a stance ---- */

typedef struct {
    T(plan) plan;
    T(state) start;
    T(step) steps[2];
    int step_count;
    double horizon;
} problem;

static int solve(const problem *p, T(stance) *stance)
{
    return T(solve_stance)(&p->plan, &p->start, p->steps, p->step_count, p->horizon, CAPACITY, phases, CAPACITY, stance);
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

static double of_ledger(const T(ledger) *ledger, int n)
{
    double entries[7];
    memcpy(entries, ledger, sizeof entries);
    return entries[n];
}

/* Smaller buffers, a cap, and steps of the current that change nothing leave the answer as it is. */
static void variants(const problem *p, const T(stance) *stance)
{
    T(stance) other;
    T(phase) few[2];
    must(T(solve_stance)(&p->plan, &p->start, p->steps, p->step_count, p->horizon, CAPACITY, few, 1, &other)
             == (stance->phase_count > 1 ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK), "a small buffer");
    must(memcmp(&other.end, &stance->end, sizeof other.end) == 0 && other.event_count == stance->event_count
             && other.phases_kept == 1 && other.phase_count == stance->phase_count, "a small buffer, another stance");
    T(state) state;
    must(other.phase_count == 1 || T(stance_at)(&p->plan, p->steps, few, &other, 0.0, &state) == HOPFORM_ERROR_TIME, "phases not kept");
    if (stance->phase_count > 1) {
        const int cap = stance->phase_count - 1;
        must(T(solve_stance)(&p->plan, &p->start, p->steps, p->step_count, p->horizon, cap, phases, CAPACITY, &other) >= 0
                 && other.ending == HOPFORM_ENDING_TOO_MANY_PHASES && other.phase_count == cap && other.phases_kept == cap, "a cap on phases");
        must(other.duration <= stance->duration, "a cap on phases, a longer stance");
    }
    if (p->step_count == 1) {
        problem twice = *p;
        twice.steps[1].t = 0.37 * stance->duration;
        twice.steps[1].u = p->steps[0].u;
        twice.step_count = 2;
        if (twice.steps[1].t > 0.0 && stance->ending == HOPFORM_ENDING_TAKEOFF) {
            must(solve(&twice, &other) >= 0 && other.ending == stance->ending && other.event_count == stance->event_count,
                 "a step of the current to the same value");
        }
    }
}

/* States, energies and the grid at many times agree with each other, and are continuous but for what a stop takes. */
static void consistent(const problem *p, const T(stance) *stance, double unit_energy, double condition)
{
    double times[TIMES], x1[4][TIMES], losses[TIMES];
    T(energy) energies[TIMES];
    T(ledger) ledgers[TIMES];
    T(state) states[TIMES];
    static double tangents[TIMES * HOPFORM_TANGENT_ROWS * COLUMNS];
    const double loose = 1e-11 * condition;
    for (int n = 0; n < TIMES; n++) {
        times[n] = stance->duration * ((double)n / (TIMES - 1));
    }
    must(T(stance_states)(&p->plan, p->steps, phases, stance, times, TIMES, x1[0], x1[1], x1[2], x1[3]) == HOPFORM_OK, "no states");
    must(T(stance_energy)(&p->plan, p->steps, phases, stance, times, TIMES, energies, ledgers, losses) == HOPFORM_OK, "no energies");
    must(T(stance_tangents)(&p->plan, p->steps, phases, stance, times, TIMES, states, tangents) >= 0, "no tangents");
    for (int n = 0; n < TIMES; n++) {
        T(state) at;
        must(T(stance_at)(&p->plan, p->steps, phases, stance, times[n], &at) == HOPFORM_OK, "no state");
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
        near(energies[n].body - energies[0].body, ledgers[n].spring_work + ledgers[n].viscous_2 + ledgers[n].coulomb_2, loose * scale, "the AED");
    }
    near(stance->aed, ledgers[TIMES - 1].spring_work + ledgers[TIMES - 1].viscous_2 + ledgers[TIMES - 1].coulomb_2,
         loose * (unit_energy * 10.0 + fabs(energies[0].body)), "the stance's AED");
    if (stance->duration > 0.0) {
        enum { GRID = 150 };
        double g[4][GRID];
        const double t0 = 0.05 * stance->duration, dt = 0.94 * stance->duration / GRID;
        must(T(stance_grid)(&p->plan, p->steps, phases, stance, t0, dt, GRID, g[0], g[1], g[2], g[3]) == HOPFORM_OK, "no grid");
        for (int n = 0; n < GRID; n += 7) {
            T(state) at;
            must(T(stance_at)(&p->plan, p->steps, phases, stance, t0 + dt * (double)n, &at) == HOPFORM_OK, "no state");
            const double speed = 1.0 + fabs(at.v1) + fabs(at.v2);
            near(g[0][n], at.x1, loose * speed, "grid x1");
            near(g[1][n], at.v1, loose * speed * 10.0, "grid v1");
            near(g[2][n], at.v2, loose * speed * 10.0, "grid v2");
            near(g[3][n], at.y, loose * speed, "grid y");
        }
        must(T(stance_grid)(&p->plan, p->steps, phases, stance, t0, stance->duration, 3, g[0], g[1], g[2], g[3])
                 == (stance->ending == HOPFORM_ENDING_REST ? HOPFORM_OK : HOPFORM_ERROR_TIME), "a grid beyond the end");
    }
    T(state) at;
    must((T(stance_at)(&p->plan, p->steps, phases, stance, 1.01 * stance->duration + 1e-3, &at) == HOPFORM_OK)
             == (stance->ending == HOPFORM_ENDING_REST), "a time beyond the end");
    must(T(stance_at)(&p->plan, p->steps, phases, stance, -1e-9, &at) == HOPFORM_ERROR_TIME, "a time before the start");
}

static void rows_of(const T(stance) *s, const T(robot) *r, double out[ROWS])
{
    out[0] = s->duration;
    out[1] = s->end.x1;
    out[2] = s->end.v1;
    out[3] = s->end.x1 - s->end.y + r->L0 + r->c;
    out[4] = s->end.v2;
    out[5] = s->apex;
    out[6] = s->aed;
}

/* An input of a problem moved by a step; false if it can not be moved both ways. */
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
    default:
        fields[column - 5] += step;
        break;
    }
    memcpy(&robot, fields, sizeof robot);
    return T(plan_init)(&to->plan, &robot) == HOPFORM_OK;
}

/* Derivatives against differences, where the events stay the same ones. */
static void derivatives(const problem *p, const T(stance) *stance)
{
    static double matrix[ROWS * COLUMNS], tangents[HOPFORM_TANGENT_ROWS * COLUMNS];
    const int32_t status = T(stance_sensitivities)(&p->plan, p->steps, phases, stance, matrix);
    must(status >= 0 && (status == HOPFORM_OK || stance->ending != HOPFORM_ENDING_TAKEOFF || stance->event_count > 0
                         || fabs(p->start.v1 - p->start.v2) < 1e-6), "no derivatives");
    const double middle = 0.6 * stance->duration;
    T(state) at;
    const int32_t has = T(stance_tangents)(&p->plan, p->steps, phases, stance, &middle, 1, &at, tangents);
    for (int column = 0; column < COLUMNS; column++) {
        double value = 0.1;
        if (column > 4) {
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
        if (!moved(p, column, step, &up) || !moved(p, column, -step, &down) || solve(&up, &s_up) != HOPFORM_OK
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
                const double curve = fabs(high[r] + low[r] - 2.0 * whole[r]) / step; /* not straight: differences say less */
                near(matrix[r * COLUMNS + column], slope, 1e-4 * (fabs(slope) + 0.02) + 2.0 * curve + 1e-8 / step * 1e-3, "a sensitivity");
            }
        }
        if (has == HOPFORM_OK && stance->event_count == 0) {
            const double slopes[4] = {at_up.x1 - at_down.x1, at_up.v1 - at_down.v1, at_up.v2 - at_down.v2, at_up.y - at_down.y};
            const double curves[4] = {at_up.x1 + at_down.x1 - 2.0 * at.x1, at_up.v1 + at_down.v1 - 2.0 * at.v1,
                                      at_up.v2 + at_down.v2 - 2.0 * at.v2, at_up.y + at_down.y - 2.0 * at.y};
            for (int r = 0; r < 4; r++) {
                const double slope = slopes[r] / (2.0 * step);
                near(tangents[r * COLUMNS + column], slope, 1e-4 * (fabs(slope) + 0.02) + 2.0 * fabs(curves[r]) / step + 1e-11 / step, "a tangent");
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
    const double loose = 1e-12 * condition;
    must(solve(&p, &stance) == HOPFORM_OK && stance.ending == ending && stance.event_count == count, "another ending");
    int found = 0;
    for (int n = 1; n < stance.phases_kept && found < count; n++) {
        if (phases[n].event != HOPFORM_EVENT_NONE) {
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
    near(stance.aed, end[5], 1e-12 * condition_aed * unit_energy, "aed");
    near(stance.apex, ending == HOPFORM_ENDING_TAKEOFF ? end[6] : 0.0, 10.0 * loose * (1.0 + fabs(end[6])), "apex");
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
        near(state.x1, at[1], loose * 10.0 * (0.1 + fabs(at[1])), "x1 in between");
        near(state.v1, at[2], loose * 100.0 * (1.0 + fabs(at[2])), "v1 in between");
        near(state.v2, at[3], loose * 100.0 * (1.0 + fabs(at[3])), "v2 in between");
        near(state.y, at[4], loose * 10.0 * (0.1 + fabs(at[4])), "y in between");
        must(T(stance_energy)(&p.plan, p.steps, phases, &stance, &at[0], 1, &energy, &ledger, &loss) == HOPFORM_OK, "no energies");
        const double scale = 100.0 * loose * (unit_energy + fabs(at[5]) + fabs(at[6]));
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
    const double loose = 4e-12 * condition;
    must(T(solve_flight)(&plan, &start, &gains, horizon, CAPACITY, flight_phases, CAPACITY, &flight) == HOPFORM_OK
             && flight.ending == ending && flight.event_count == count, "another ending of a flight");
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
    near(flight.v2_after, lands ? flight.end.v2 * sqrt(1.0 - robot.impact_loss) : flight.v2_after, 1e-13 * (1.0 + fabs(flight.end.v2)), "v2 after the impact");
    near(flight.impact_loss, lands ? -0.5 * robot.m_s * flight.end.v2 * flight.end.v2 * robot.impact_loss : flight.impact_loss,
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
    must(T(flight_energy)(&plan, flight_phases, &flight, times, N, energies, ledgers, losses) == HOPFORM_OK, "no energies of a flight");
    double best = -INFINITY;
    for (int n = 0; n < N; n++) {
        const double t = times[n], fall = start.v2 * t - 0.5 * robot.g * t * t;
        near(states[n].v2, start.v2 - robot.g * t, 1e-12 * (1.0 + fabs(start.v2)), "v2 in flight");
        near(states[n].y - (states[n].x1 - start.x1), start.y - fall, 1e-12 * (1.0 + fabs(start.v2)), "the body's height in flight");
        best = larger(best, fall + start.x1 - start.y);
        const double scale = loose * (unit_energy + fabs(energies[n].total) + fabs(energies[0].total)) + 1e-300;
        near(energies[n].total - energies[0].total, ledgers[n].motor_work + ledgers[n].offset_work + ledgers[n].viscous_1
             + ledgers[n].coulomb_1 + losses[n] - losses[0], scale, "the sum of a flight's ledger");
    }
    near(states[N - 1].x1, flight.end.x1, 1e-12 * (0.1 + fabs(flight.end.x1)) * condition, "x1 at the end of a flight");
    near(states[N - 1].v1, flight.end.v1, 1e-12 * (1.0 + fabs(flight.end.v1)) * condition, "v1 at the end of a flight");
    const T(flight_ledger) *last = &ledgers[N - 1];
    const double scale = loose * unit_energy;
    near(last->motor_work, end[5], scale, "motor work in flight");
    near(last->offset_work, end[6], scale, "offset work in flight");
    near(last->viscous_1, end[7], scale, "viscous loss in flight");
    near(last->coulomb_1, end[8], scale, "Coulomb loss in flight");
    near(losses[N - 1], end[9], scale, "loss at stops in flight");
    const double rises = robot.g > 0.0 ? larger(start.v2, 0.0) / robot.g : 0.0;
    const double top = rises < flight.duration ? rises : flight.duration;
    near(flight.apex, start.v2 * top - 0.5 * robot.g * top * top + start.x1 - start.y, 1e-12 * (1.0 + fabs(flight.apex)), "apex of a flight");
    near(flight.apex_time, top, 1e-12 * (1.0 + top), "time of the apex");
    must(T(solve_flight)(&plan, &start, &gains, horizon, CAPACITY, flight_phases, 1, &other)
             == (flight.phase_count > 1 ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK), "a small buffer of a flight");
    must(memcmp(&other.end, &flight.end, sizeof other.end) == 0, "a small buffer, another flight");
    if (flight.phase_count > 1 && ending != HOPFORM_FLIGHT_TRIPPED) {
        must(T(solve_flight)(&plan, &start, &gains, horizon, flight.phase_count - 1, flight_phases, CAPACITY, &other) >= 0
                 && other.ending == HOPFORM_FLIGHT_TOO_MANY_PHASES, "a cap on phases of a flight");
    }
    if (T(solve_flight)(&plan, &start, NULL, horizon, CAPACITY, flight_phases, CAPACITY, &other) >= 0 && other.gains.Kp > 0.0) {
        const double square = start.v2 * start.v2 + 2.0 * robot.g * start.x1;
        const double fall = square > 0.0 ? (start.v2 + sqrt(square)) / robot.g - 0.05 : 0.0;
        T(gains) designed;
        must(T(design_return)(&plan, larger(fall, 0.02), &designed) == HOPFORM_OK, "no design");
        near(other.gains.Kp, designed.Kp, 1e-9 * (1.0 + fabs(designed.Kp)), "designed Kp");
        near(other.gains.Kd, designed.Kd, 1e-9 * (1.0 + fabs(designed.Kd)), "designed Kd");
        const double rate = 20.0 / 3.0 / larger(fall, 0.02), damping = designed.Kd + robot.b1;
        near(designed.Kp, rate * (damping - robot.m_eff * rate), 1e-12 * rate * (damping + robot.m_eff * rate), "the rate of the return");
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
    must(T(choose_current)(&search, &plan, &start, &target, phases, CAPACITY, &command) == HOPFORM_OK && command.status == status, "another command");
    must(search.trials < 120, "a search that takes long");
    near(command.u, u, (status == HOPFORM_COMMAND_REACHED ? 1e-7 : 1e-3) * (1.0 + fabs(u)), "the current"); /* an extremum is flat */
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
             && !(fabs(stepped.apex - command.apex) > 0.0), "step by step another command");
    must(T(choose_current_step)(&search, phases, CAPACITY, &stepped) == HOPFORM_OK, "a search that is done goes on");
    target.datum = 0.02;
    target.h_des -= 0.02;
    if (target.h_des > 0.0) {
        must(T(choose_current)(&search, &plan, &start, &target, phases, CAPACITY, &stepped) == HOPFORM_OK, "a command over another ground");
        near(stepped.u, command.u, (status == HOPFORM_COMMAND_REACHED ? 1e-7 : 1e-3) * (1.0 + fabs(command.u)), "the current over another ground");
    }
    const double currents[3] = {0.0, command.u, 0.5 * robot.u_max};
    T(trial) trials[3];
    must(T(try_currents)(&plan, &start, 1, currents, 3, target.horizon, phases, CAPACITY, trials) >= 0, "no trials");
    for (int n = 0; n < 3; n++) {
        const double step = 1e-7;
        const double beside[2] = {currents[n] - step, currents[n] + step};
        T(trial) two[2];
        (void)T(try_currents)(&plan, &start, 1, beside, 2, target.horizon, phases, CAPACITY, two);
        if (trials[n].takes_off && two[0].events == two[1].events && two[0].events == trials[n].events && trials[n].smooth) {
            near(trials[n].apex_u, (two[1].apex - two[0].apex) / (2.0 * step), 1e-5 * (1.0 + fabs(trials[n].apex_u)), "the apex' slope");
            near(trials[n].peak_u, (two[1].peak - two[0].peak) / (2.0 * step), 1e-5 * (1.0 + fabs(trials[n].peak_u)), "the peak's slope");
        }
        if (trials[n].dips > 0 && two[0].dips == two[1].dips) {
            near(trials[n].dip_u, (two[1].dip - two[0].dip) / (2.0 * step), 1e-4 * (1.0 + fabs(trials[n].dip_u)), "the dip's slope");
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
            must(T(touchdown)(&detector, &known, sample) == wanted && known.touches == touches, "the detector");
        }
        T(contact) same = known;
        must(T(touchdown)(&detector, &known, NAN) == HOPFORM_ERROR_DETECTOR && memcmp(&same, &known, sizeof same) == 0, "a sample that is none");
    }
}

int main(int argc, char **argv)
{
    (void)argv;
    verbose = argc > 1;
    elementary();
    all_poles();
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
    if (verbose) {
        printf("%d rows, worst share %g, wrong %d\n", row, worst, wrong);
    }
    return wrong > 0;
}
