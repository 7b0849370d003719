/* Batches against their stances one by one, bit for bit: with steps of the input, states at times,
 * derivatives and compressions. A batch is one robot, runs of robots, or a robot a stance; now and then a number is
 * out of its domain. Prints what is wrong. In double precision with -DDOUBLE. With the argument `work` it prints what
 * each variant takes, in basic blocks, if the library was compiled with -fsanitize-coverage=trace-pc. */
#include <math.h>
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

enum {
    BATCHES = 48,
    COUNT = 150,
    STATES = 8, /* u of three steps among them */
    ROBOT = HOPFORM_ROBOT_FIELDS,
    READ = ROBOT + STATES,
    RESULTS = 9,
    EVENTS = 24,
    PHASES = 64,
    ROWS = HOPFORM_SENSITIVITY_ROWS,
    APEX = 5
};

static const real hopper[READ] = {25.0f, 3.0f,  1200.0f, 0.4f,  0.0f, 150.0f, 5.0f,  0.78f, 0.6f, -65.0f, 9.81f,
                                  0.0f,  0.08f, 3.0f,    0.05f, 0.0f, 0.0f, 0.0f, 0.0f,   -1.9f, 0.0f,  2.0f, 0.0f,   2.0f, 2.0f};

typedef struct {
    real numbers[RESULTS - 2];
    int32_t status;
    int32_t event_count;
    real event_time[EVENTS];
    int8_t event_kind[EVENTS];
} answer;

static real read_from[COUNT][READ];
static OF(stances_in) in;
static answer alone[COUNT];
static answer together[COUNT];
static OF(phase) phases[PHASES];
static int kept; /* HOPFORM_OK, or HOPFORM_PHASES_NOT_KEPT */
static int batch;
static int wrong;
static unsigned long blocks;

void __sanitizer_cov_trace_pc(void);

void __sanitizer_cov_trace_pc(void)
{
    blocks++;
}

static void must(int truth, const char *what, int stance)
{
    if (!truth && wrong++ < 20) {
        printf("batch %d, stance %d: %s\n", batch, stance, what);
    }
}

static int same(const real *one, const real *other, int count)
{
    int all = 1;
    for (int n = 0; n < count; n++) {
        all = all && (memcmp(&one[n], &other[n], sizeof *one) == 0 || (isnan(one[n]) && isnan(other[n])));
    }
    return all;
}

/* ---- the draw ---- */

static uint64_t dice = 88172645463325252u; /* Marsaglia, "Xorshift RNGs", 2003 */

static uint32_t roll(void)
{
    dice ^= dice << 13;
    dice ^= dice >> 7;
    dice ^= dice << 17;
    return (uint32_t)(dice >> 32);
}

static real uniform(double low, double high)
{
    return (real)(low + (high - low) * ((double)roll() / 4294967296.0));
}

static real spoilt(void)
{
    const real numbers[] = {(real)NAN, (real)INFINITY, -(real)INFINITY, (real)1e30, (real)-1e30, (real)1e-30, -1, 0};
    return numbers[roll() % 8];
}

static void draw(void)
{
    real robot[ROBOT];
    const int kind = batch % 3, one = kind == 0;
    int left = 0;
    for (int i = 0; i < COUNT; i++) {
        real *row = read_from[i];
        if (left-- == 0) {
            memcpy(robot, hopper, sizeof robot);
            for (int n = 0; n < 9 && batch > 0; n++) {
                robot[n] *= roll() % 4 == 0 ? uniform(0.2, 4.0) : 1;
                robot[n] *= n >= 5 && roll() % 8 == 0 ? 0 : 1;
            }
            robot[10] *= roll() % 8 == 0 ? 0 : 1; /* no gravity, no apex */
            if (roll() % 16 == 0 && !one) {
                robot[roll() % ROBOT] = spoilt();
            }
            left = one ? COUNT : kind == 1 ? (int)(roll() % 50) : 0;
        }
        memcpy(row, robot, sizeof robot);
        memcpy(row + ROBOT, hopper + ROBOT, STATES * sizeof *row);
        row[ROBOT] = roll() % 4 == 0 ? uniform(0.0, 0.08) : 0;
        row[ROBOT + 1] = roll() % 4 == 0 ? uniform(-0.3, 0.3) : 0;
        row[ROBOT + 2] = uniform(-2.8, -0.2);
        row[ROBOT + 3] = roll() % 8 == 0 ? uniform(-0.05, 0.0) : 0;
        row[ROBOT + 4] = roll() % 4 == 0 ? 0 : uniform(-3.0, 3.0);
        row[ROBOT + 5] = uniform(-3.0, 3.0);
        row[ROBOT + 6] = uniform(-3.0, 3.0);
        row[ROBOT + 7] = roll() % 8 == 0 ? uniform(0.0, 0.3) : 2;
        if (roll() % 16 == 0) {
            row[ROBOT + roll() % STATES] = spoilt();
        }
    }
    OF(input) *const states[STATES] = {&in.x1, &in.v1, &in.v2, &in.y, &in.u, NULL, NULL, &in.horizon};
    for (int n = 0; n < READ; n++) {
        OF(input) *to = n < ROBOT ? &in.robot[n] : states[n - ROBOT];
        if (to == NULL) {
            continue;
        }
        to->first = &read_from[0][n];
        to->stride = one && n < ROBOT ? 0 : (ptrdiff_t)sizeof read_from[0];
    }
    in.max_phases = batch % 4 == 3 ? 1 + (int32_t)(roll() % 6) : PHASES;
}

/* ---- one by one ---- */

static int32_t solve_alone(int i, OF(plan) * plan, OF(step) * step, OF(stance) * stance)
{
    OF(robot) robot;
    memcpy(&robot, read_from[i], sizeof robot);
    const real *start = read_from[i] + ROBOT;
    const OF(state) state = {start[0], start[1], start[2], start[3]};
    step->t = 0;
    step->u = start[4];
    const int32_t status = OF(plan_init)(plan, &robot);
    return status < 0 ? status
                      : OF(solve_stance)(plan, &state, step, 1, start[7], in.max_phases, phases, PHASES, stance);
}

static void answers_alone(void)
{
    kept = HOPFORM_OK;
    for (int i = 0; i < COUNT; i++) {
        OF(plan) plan;
        OF(step) step;
        OF(stance) stance;
        answer *a = &alone[i];
        memset(a, 0, sizeof *a);
        a->status = solve_alone(i, &plan, &step, &stance);
        const int refused = a->status < 0, flies = !refused && stance.ending == HOPFORM_ENDING_TAKEOFF;
        int found = 0;
        for (int n = 0; !refused && n < stance.phases_kept && found < EVENTS; n++) {
            if (HOPFORM_IS_EVENT(phases[n].event)) {
                a->event_time[found] = phases[n].t;
                a->event_kind[found++] = phases[n].event;
            }
        }
        for (int n = found; n < EVENTS; n++) {
            a->event_time[n] = (real)NAN;
            a->event_kind[n] = HOPFORM_EVENT_NONE;
        }
        const real *robot = read_from[i];
        const real numbers[RESULTS - 2] = {
            stance.duration,
            stance.end.x1,
            stance.end.v1,
            stance.end.v2,
            flies && robot[10] > 0 ? stance.apex : (real)NAN,
            stance.aed,
            stance.end.x1 + robot[3] + robot[4] - stance.end.y, /* x2, but for its rounding */
        };
        for (int n = 0; n < RESULTS - 2; n++) {
            a->numbers[n] = refused ? (real)NAN : numbers[n];
        }
        a->status = refused ? a->status : stance.ending;
        a->event_count = refused ? 0 : stance.event_count;
        kept = found < a->event_count ? HOPFORM_PHASES_NOT_KEPT : kept;
    }
}

/* Some stances end exactly at one of their events, or at their end. */
static void end_at_events(void)
{
    for (int i = 0; i < COUNT; i++) {
        const answer *a = &alone[i];
        if (roll() % 5 == 0 && a->status > 0) {
            const uint32_t n = roll() % (EVENTS + 1u);
            read_from[i][ROBOT + 7] = n < EVENTS && !isnan(a->event_time[n]) ? a->event_time[n] : a->numbers[0];
        }
    }
}

/* ---- together ---- */

static OF(output) column(void *first)
{
    const OF(output) made = {first, (ptrdiff_t)sizeof together[0]};
    return made;
}

/* Events lie one list behind the other; x2 comes last among the numbers. */
static int32_t solve_together(int lists)
{
    static real times[COUNT * EVENTS];
    static int8_t kinds[COUNT * EVENTS];
    OF(stances_out) out;
    memset(&out, 0, sizeof out);
    memset(together, 0x55, sizeof together);
    OF(output) *const numbers[RESULTS - 2] = {&out.duration, &out.x1, &out.v1, &out.v2, &out.apex, &out.aed, &out.x2};
    for (int n = 0; n < RESULTS - 2; n++) {
        *numbers[n] = column(&together[0].numbers[n]);
    }
    out.status = column(&together[0].status);
    out.event_count = column(&together[0].event_count);
    out.phases = lists ? phases : NULL;
    out.phase_capacity = lists ? PHASES : 0;
    out.event_time = lists ? times : NULL;
    out.event_kind = lists ? kinds : NULL;
    out.event_capacity = EVENTS;
    const int32_t status = OF(solve_stances)(COUNT, &in, &out);
    for (int i = 0; i < COUNT; i++) {
        memcpy(together[i].event_time, lists ? times + i * EVENTS : alone[i].event_time, sizeof together[i].event_time);
        memcpy(together[i].event_kind, lists ? kinds + i * EVENTS : alone[i].event_kind, sizeof together[i].event_kind);
    }
    return status;
}

static void must_agree(int32_t status, int lists)
{
    must(status == (lists ? kept : HOPFORM_OK), "the status of the batch", status);
    for (int i = 0; i < COUNT; i++) {
        const answer *a = &alone[i], *b = &together[i];
        const real x2 = a->numbers[RESULTS - 3], off = fabs(x2 - b->numbers[RESULTS - 3]);
        must(a->status == b->status, "status", i);
        must(a->event_count == b->event_count, "number of events", i);
        must(same(a->numbers, b->numbers, RESULTS - 3), "numbers", i);
        must(isnan(x2) ? isnan(b->numbers[RESULTS - 3]) : off <= 1e-5f * (1 + fabs(x2)), "x2", i);
        must(same(a->event_time, b->event_time, EVENTS), "times of events", i);
        must(memcmp(a->event_kind, b->event_kind, EVENTS) == 0, "kinds of events", i);
    }
}

/* ---- what is read of them ---- */

enum { STEPS = 3, TIMES = 5, CHOSEN = 6, DERIVED = ROWS * CHOSEN, TANGENTS = HOPFORM_TANGENT_ROWS * CHOSEN };

static const int32_t chosen[CHOSEN] = {4, 3, HOPFORM_COLUMN_OF_STEP(1), HOPFORM_COLUMN_OF_STEP_TIME(1), 7,
                                       HOPFORM_COLUMN_OF_STEP_TIME(2)};
static const real step_times[STEPS] = {0, 0.03f, 0.07f};
static const real times[TIMES] = {0, 0.02f, 0.07f, 0.1f, 3};

typedef struct {
    OF(state) states[TIMES];
    real matrix[DERIVED], tangents[TIMES][TANGENTS], compression;
    int32_t status, tangent_status;
} reading;

static void read_alone(int i, int32_t steps, int32_t capacity, reading *to)
{
    OF(plan) plan;
    OF(step) step[STEPS];
    OF(stance) stance;
    OF(robot) robot;
    memcpy(&robot, read_from[i], sizeof robot);
    const real *start = read_from[i] + ROBOT;
    const OF(state) state = {start[0], start[1], start[2], start[3]};
    for (int n = 0; n < STEPS; n++) {
        step[n].t = step_times[n];
        step[n].u = start[4 + n];
    }
    int32_t status = OF(plan_init)(&plan, &robot);
    status = status < 0 ? status
                        : OF(solve_stance)(&plan, &state, step, steps, start[4 + STEPS], in.max_phases, phases,
                                           capacity, &stance);
    memset(to, 0xff, sizeof *to); /* NaN */
    to->status = to->tangent_status = status;
    if (status != HOPFORM_OK) {
        return;
    }
    int32_t within = 0;
    for (; within < TIMES && (stance.ending == HOPFORM_ENDING_REST || times[within] <= stance.duration); within++) {
        must(OF(stance_at)(&plan, step, phases, &stance, times[within], &to->states[within]) == HOPFORM_OK, "at", i);
    }
    to->tangent_status = OF(stance_tangents)(&plan, step, phases, &stance, chosen, CHOSEN, times, within, NULL,
                                             to->tangents[0]);
    to->status = OF(stance_sensitivities)(&plan, step, phases, &stance, chosen, CHOSEN, to->matrix);
    const int flies = stance.ending == HOPFORM_ENDING_TAKEOFF && read_from[i][10] > 0;
    for (int n = 0; n < DERIVED; n++) {
        const int none = to->status != HOPFORM_OK || (n / CHOSEN == APEX && !flies);
        to->matrix[n] = none ? (real)NAN : to->matrix[n];
    }
    must(OF(stance_compression)(&plan, step, phases, &stance, &to->compression) == HOPFORM_OK, "compression", i);
}

static OF(output) nowhere(void)
{
    const OF(output) made = {NULL, 0};
    return made;
}

/* States, derivatives and compressions, by some inputs and steps; a buffer of phases that is too small, in every fourth
 * batch. All of it in one call, and each alone. */
static void readings(int32_t step_count)
{
    static OF(state) states[COUNT][TIMES];
    static real matrices[COUNT][DERIVED], tangents[COUNT][TIMES][TANGENTS], compressions[COUNT];
    static int32_t read[COUNT], grazed[COUNT];
    static OF(step) steps[STEPS];
    const int32_t capacity = batch % 4 == 0 ? 4 : PHASES;
    OF(stances_out) all;
    memset(&all, 0, sizeof all);
    all.status = all.event_count = nowhere();
    all.phases = phases;
    all.phase_capacity = capacity;
    all.steps = steps;
    all.states = states[0];
    all.sensitivities = matrices[0];
    all.tangents = tangents[0][0];
    all.compressions = compressions;
    all.reading_status = read;
    all.tangent_status = grazed;
    in.step_count = step_count;
    in.step_times = step_count > 1 ? step_times : NULL;
    in.step_stride = sizeof(real);
    in.times = times;
    in.time_count = TIMES;
    in.columns = chosen;
    in.column_count = CHOSEN;
    for (int what = 0; what < 5; what++) {
        OF(stances_out) out = all;
        out.states = what == 0 || what == 1 ? all.states : NULL;
        out.sensitivities = what == 0 || what == 2 ? all.sensitivities : NULL;
        out.tangents = what == 0 || what == 3 ? all.tangents : NULL;
        out.compressions = what == 0 || what == 4 ? all.compressions : NULL;
        memset(states, 0x55, sizeof states);
        memset(matrices, 0x55, sizeof matrices);
        memset(tangents, 0x55, sizeof tangents);
        memset(compressions, 0x55, sizeof compressions);
        const int32_t status = OF(solve_stances)(COUNT, &in, &out);
        int32_t short_of = HOPFORM_OK;
        for (int i = 0; i < COUNT; i++) {
            static reading alone_read;
            read_alone(i, step_count, capacity, &alone_read);
            const int32_t wanted =
                alone_read.status == HOPFORM_NO_DERIVATIVE && out.sensitivities == NULL ? HOPFORM_OK : alone_read.status;
            const int32_t touched = alone_read.tangent_status == HOPFORM_NO_DERIVATIVE && out.tangents == NULL
                                        ? HOPFORM_OK
                                        : alone_read.tangent_status;
            short_of = alone_read.status == HOPFORM_PHASES_NOT_KEPT ? HOPFORM_PHASES_NOT_KEPT : short_of;
            must(read[i] == wanted && grazed[i] == touched, "the status of a reading", i);
            must(out.states == NULL || same(&states[i][0].x1, &alone_read.states[0].x1, 4 * TIMES), "states", i);
            must(out.sensitivities == NULL || same(matrices[i], alone_read.matrix, DERIVED), "derivatives", i);
            must(out.tangents == NULL || same(tangents[i][0], alone_read.tangents[0], TIMES * TANGENTS), "tangents", i);
            must(out.compressions == NULL || same(&compressions[i], &alone_read.compression, 1), "compression", i);
        }
        must(status == short_of, "the status of readings", status);
    }
    in.step_count = 0;
    in.step_times = NULL;
}

int main(int argc, char **argv)
{
    const int prints_work = argc > 1 && strcmp(argv[1], "work") == 0;
    int32_t seen = 0;
    for (batch = 0; batch < BATCHES; batch++) {
        draw();
        answers_alone();
        end_at_events();
        answers_alone();
        const unsigned long before = blocks;
        must_agree(solve_together(1), 1);
        must_agree(solve_together(0), 0);
        if (prints_work) {
            printf("batch %lu\n", blocks - before);
        }
        for (int i = 0; i < COUNT; i++) {
            seen |= alone[i].status < 0 ? 1 << 16 : 1 << alone[i].status;
        }
        if (batch % 2 == 0) {
            readings(batch % 4 == 0 ? 1 : STEPS);
        }
    }
    must(seen
             == (1 << 16 | 1 << HOPFORM_ENDING_TAKEOFF | 1 << HOPFORM_ENDING_REST | 1 << HOPFORM_ENDING_HORIZON
                 | 1 << HOPFORM_ENDING_TOO_MANY_PHASES),
         "endings that do not occur", seen);
    printf("batches of %d stances: %d, wrong %d\n", COUNT, BATCHES, wrong);
    return wrong > 0;
}
