/* Runs of hops against flights and stances in turn, bit for bit, by robots and steps of the ground of which some trip,
 * stop or are refused; and the contract: NULL and overlap are refused, every result is safe, an input is not written.
 * Prints what is wrong. In double precision with -DDOUBLE. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "hopform/hopform.h"

#ifdef DOUBLE
typedef double real;
#define OF(name) hopform_##name##_f64
#else
typedef float real;
#define OF(name) hopform_##name##_f32
#endif

enum { RUNS = 240, HOPS = 9, FIELDS = HOPFORM_ROBOT_FIELDS, READ = FIELDS + 6, COLUMNS = 8, TABLES = 13 };

static const real hopper[READ] = {25.0f, 3.0f,  1200.0f, 0.4f,  0.0f, 150.0f, 5.0f,  0.78f, 0.6f, -65.0f, 9.81f,
                                  0.0f,  0.08f, 3.0f,    0.05f, 0.0f, 0.0f, 0.0f, 0.0f,   -1.9f, 0.0f,  2.0f, 2.0f};

/* Everything of a run in one place: columns and tables are read and written with strides of their own. */
typedef struct {
    real read[READ];
    real gains[2];
    real u[HOPS];
    real ground[HOPS];
} given;
typedef struct {
    int32_t status, hops;
    real numbers[COLUMNS - 2];
    struct {
        int32_t ending;
        real numbers[TABLES - 1];
    } hop[HOPS];
} answer;

static given inputs[RUNS];
static answer runs[RUNS];
static int wrong;
static uint64_t seed = 5;
static int seen[4], refused;

static void holds(int truth, const char *what, long first, long second)
{
    if (!truth && wrong++ < 20) {
        printf("%s (%ld, %ld)\n", what, first, second);
    }
}

static real uniform(double low, double high)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (real)(low + (high - low) * (double)(seed >> 11) / 9007199254740992.0);
}

static void draw(void)
{
    for (int i = 0; i < RUNS; i++) {
        given *one = &inputs[i];
        memcpy(one->read, i % 3 == 0 || i == 0 ? hopper : inputs[i - 1].read, sizeof hopper);
        for (int n = 0; n < 9 && i % 3 == 0; n++) { /* masses to friction, but for the offset */
            one->read[n] *= n == 4 ? 1 : (real)pow(10.0, (double)uniform(-0.5, 0.3));
        }
        one->read[FIELDS + 2] = -uniform(0.2, 3.0);
        one->read[FIELDS + 5] = i % 11 == 0 ? (real)0.15 : 2; /* some stances meet their longest time */
        one->gains[0] = uniform(0.0, 2e4), one->gains[1] = uniform(0.0, 1e3);
        for (int n = 0; n < HOPS; n++) {
            one->u[n] = uniform(0.5, 3.0), one->ground[n] = uniform(-0.1, 0.1);
        }
        if (i % 17 == 0) { one->read[2] = -1; }
        if (i % 19 == 0) { one->ground[3] = (real)INFINITY; }
        if (i % 23 == 0) { one->u[2] = (real)NAN; }
    }
}

static OF(hops_in) all_inputs(bool by_hop, bool gains, bool from_touchdown)
{
    OF(hops_in) in;
    memset(&in, 0, sizeof in);
    OF(input) *states[6] = {&in.runs.x1, &in.runs.v1, &in.runs.v2, &in.runs.y, &in.runs.u, &in.runs.horizon};
    for (int n = 0; n < READ; n++) {
        OF(input) *column = n < FIELDS ? &in.runs.robot[n] : states[n - FIELDS];
        column->first = &inputs[0].read[n], column->stride = sizeof inputs[0];
    }
    in.runs.max_phases = 60;
    if (by_hop) {
        in.u.first = inputs[0].u, in.ground.first = inputs[0].ground;
        in.u.stride = in.ground.stride = sizeof inputs[0];
        in.u.hop_stride = in.ground.hop_stride = sizeof(real);
    }
    if (gains) {
        in.Kp.first = &inputs[0].gains[0], in.Kd.first = &inputs[0].gains[1];
        in.Kp.stride = in.Kd.stride = sizeof inputs[0];
    }
    in.hops = HOPS, in.from_touchdown = from_touchdown;
    return in;
}

static OF(hops_out) all_outputs(void)
{
    OF(hops_out) out;
    memset(&out, 0, sizeof out);
    OF(output) *columns = &out.status;
    OF(hop_output) *tables = &out.ending;
    for (int n = 0; n < COLUMNS; n++) {
        columns[n].first = n < 2 ? (void *)(&runs[0].status + n) : (void *)&runs[0].numbers[n - 2];
        columns[n].stride = sizeof runs[0];
    }
    for (int n = 0; n < TABLES; n++) {
        tables[n].first = n == 0 ? (void *)&runs[0].hop[0].ending : (void *)&runs[0].hop[0].numbers[n - 1];
        tables[n].stride = sizeof runs[0], tables[n].hop_stride = sizeof runs[0].hop[0];
    }
    return out;
}

static bool same(real one, real other) { return memcmp(&one, &other, sizeof one) == 0 || (isnan(one) && isnan(other)); }

/* The run in turn, by the functions for one flight and one stance. */
static void compare(int i, const OF(hops_in) * in)
{
    const given *one = &inputs[i];
    OF(robot) robot;
    memcpy(&robot, one->read, sizeof robot);
    static OF(plan) plan;
    OF(state) at = {one->read[FIELDS], one->read[FIELDS + 1], one->read[FIELDS + 2], one->read[FIELDS + 3]};
    int32_t status = OF(plan_init)(&plan, &robot), done = 0;
    real time = 0;
    status = status < 0 ? status : 0;
    for (; status == 0 && done < HOPS; done++) {
        if (done > 0 || !in->from_touchdown) {
            const real step = in->ground.first != NULL ? one->ground[done] : 0;
            const OF(gains) gains = {one->gains[0], one->gains[1]};
            const real g = robot.g, rise = at.v2 * at.v2 + 2 * g * (1 + (real)fabs((double)step));
            const real longest = 10 + 2 * ((real)fabs((double)at.v2) + (real)sqrt((double)rise)) / g;
            OF(flight) flight;
            status = OF(solve_flight)(&plan, &at, step, in->Kp.first != NULL ? &gains : NULL, longest, 60, NULL, 0,
                                      &flight);
            if (status < 0) { break; }
            status = flight.ending == HOPFORM_FLIGHT_TOUCHDOWN ? 0 : flight.ending == HOPFORM_FLIGHT_TRIPPED ? 3 : 2;
            time += flight.duration;
            at = flight.end;
            if (status > 0) { break; }
            at.v2 = flight.v2_after;
        }
        const OF(step) step = {0, in->u.first != NULL ? one->u[done] : one->read[FIELDS + 4]};
        OF(stance) stance;
        status = OF(solve_stance)(&plan, &at, &step, 1, one->read[FIELDS + 5], 60, NULL, 0, &stance);
        if (status < 0) { break; }
        const bool lifts = stance.ending == HOPFORM_ENDING_TAKEOFF;
        const real numbers[TABLES - 1] = {time, at.x1, at.v1, at.v2, at.y, stance.duration, stance.end.x1,
                                          stance.end.v1, stance.end.v2, stance.end.y,
                                          lifts ? stance.apex : (real)NAN, stance.aed};
        for (int n = 0; n < TABLES - 1; n++) {
            holds(same(numbers[n], runs[i].hop[done].numbers[n]), "a number of a hop", i, 100 * done + n);
        }
        holds(stance.ending == runs[i].hop[done].ending, "an ending of a stance", i, done);
        time += stance.duration;
        at = stance.end;
        status = lifts ? 0 : HOPFORM_RUN_STOPPED;
    }
    status = status == 0 ? HOPFORM_RUN_COMPLETED : status;
    holds(runs[i].status == status, "a status", i, status);
    holds(runs[i].hops == done, "how many hops", i, done);
    const bool lost = status < 0;
    const real end[COLUMNS - 2] = {time, at.x1, at.v1, robot.L0 + robot.c, at.v2, at.y};
    for (int n = 0; n < COLUMNS - 2; n++) {
        const real shown = n == 3 ? (at.x1 - at.y) + end[n] : end[n];
        holds(same(runs[i].numbers[n], lost ? (real)NAN : shown), "the end of a run", i, n);
    }
    for (int hop = done; hop < HOPS; hop++) {
        holds(runs[i].hop[hop].ending == 0, "an ending behind the last hop", i, hop);
        for (int n = 0; n < TABLES - 1; n++) {
            holds(isnan(runs[i].hop[hop].numbers[n]), "a number behind the last hop", i, hop);
        }
    }
    seen[status > 0 ? status : 0]++;
    refused += lost && done > 0 ? 1 : 0;
}

/* What a refusal leaves: its status in every run, and every input as it was. */
static void refuse(int32_t expected, const OF(hops_in) * in, const OF(hops_out) * out, const char *what)
{
    static given before[RUNS];
    memcpy(before, inputs, sizeof before);
    memset(runs, 0x5a, sizeof runs);
    holds(OF(solve_hops)(RUNS, in, out) == expected, what, expected, 0);
    holds(memcmp(before, inputs, sizeof before) == 0, "an input was written", expected, 0);
    for (int i = 0; i < RUNS && in != NULL && out != NULL && in->hops > 0; i++) {
        holds(runs[i].status == expected && runs[i].hops == 0 && isnan(runs[i].hop[HOPS - 1].numbers[0]), what, i, 1);
    }
}

static void contract(void)
{
    const OF(hops_in) in = all_inputs(true, true, false);
    const OF(hops_out) out = all_outputs();
    refuse(HOPFORM_ERROR_NULL, NULL, &out, "no inputs");
    refuse(HOPFORM_ERROR_NULL, &in, NULL, "no outputs");
    OF(hops_in) none = in;
    none.hops = 0;
    refuse(HOPFORM_ERROR_HORIZON, &none, &out, "no hops");
    none = in;
    none.runs.u.first = NULL;
    refuse(HOPFORM_ERROR_NULL, &none, &out, "a column is missing");
    const void *const overlapped[] = {inputs[0].ground + 1, inputs[RUNS - 1].u + HOPS - 1, inputs[2].gains,
                                      inputs[3].read + 2, &in.hops};
    for (int n = 0; n < 5; n++) {
        OF(hops_out) meets = out;
        meets.apex.first = (void *)(uintptr_t)overlapped[n];
        meets.apex.stride = 0, meets.apex.hop_stride = 0;
        refuse(HOPFORM_ERROR_OVERLAP, &in, &meets, "a table over an input");
        meets = out;
        meets.duration.first = (void *)(uintptr_t)overlapped[n];
        meets.duration.stride = 0;
        refuse(HOPFORM_ERROR_OVERLAP, &in, &meets, "a column over an input");
    }
    const OF(hops_out) nothing = {0};
    holds(OF(solve_hops)(RUNS, &in, &nothing) == HOPFORM_OK, "nothing is wanted", 0, 0);
}

int main(void)
{
    draw();
    for (int how = 0; how < 8; how++) {
        const OF(hops_in) in = all_inputs(how & 1, how & 2, how & 4);
        const OF(hops_out) out = all_outputs();
        memset(runs, 0x5a, sizeof runs);
        holds(OF(solve_hops)(RUNS, &in, &out) == HOPFORM_OK, "a batch", how, 0);
        for (int i = 0; i < RUNS; i++) {
            compare(i, &in);
        }
    }
    contract();
    holds(seen[1] > 50 && seen[2] > 50 && seen[3] > 50 && refused > 10, "a kind of ending is rare", seen[1], refused);
    printf("%d completed, %d stopped, %d tripped, %d refused, %d of these after a hop: wrong %d\n", seen[1], seen[2],
           seen[3], seen[0], refused, wrong);
    return wrong != 0;
}
