/* The contract on pointers for batches: NULL is refused and every result safe; a column of results whose elements
 * overlap what is read is refused, as a byte map of both finds it, and not written; interleaved columns are solved. In
 * double precision with -DDOUBLE. */
#include <fenv.h>
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
    COUNT = 3,
    STATES = 6,
    READ = HOPFORM_ROBOT_FIELDS + STATES,
    RESULTS = 9,
    EVENTS = 2,
    PHASES = 8,
    STEPS = 2,
    TIMES = 2,
    COLUMNS = 3,
    LISTS = 10, /* what has no column: events, phases, steps, and what is read of each stance */
    WRITTEN = RESULTS + LISTS,
    BYTES = 4096,
    MIDDLE = 2048,
    POISON = 0xa5
};

static const real numbers[READ] = {25.0f, 3.0f,  1200.0f, 0.4f,  0.0f, 150.0f, 5.0f,  0.78f, 0.6f, -65.0f, 9.81f,
                                   0.0f,  0.08f, 3.0f,    0.05f, 0.0f, 0.0f, 0.0f, 0.0f,   -1.9f, 0.0f,  2.0f, 2.0f};

/* Elements of a column. */
typedef struct {
    char *first;
    ptrdiff_t stride;
    size_t size;
} elements;

/* A batch with memory of its own for each column. */
typedef struct {
    OF(stances_in) in;
    OF(stances_out) out;
    real read[READ][COUNT];
    real results[RESULTS][COUNT];
    real event_time[COUNT * EVENTS];
    int8_t event_kind[COUNT * EVENTS];
    OF(phase) phases[PHASES];
    OF(step) steps[STEPS];
    OF(state) states[COUNT * TIMES];
    real matrices[COUNT * HOPFORM_SENSITIVITY_ROWS * COLUMNS];
    real tangents[COUNT * TIMES * HOPFORM_TANGENT_ROWS * COLUMNS];
    int32_t status[COUNT], tangent_status[COUNT];
    real compressions[COUNT];
    real step_times[STEPS], times[TIMES];
    int32_t columns[COLUMNS];
} batch;

static union {
    uint64_t aligned[BYTES / 8];
    char bytes[BYTES];
} arena;
static int32_t checks;
static int wrong;

static void holds(int truth, const char *what, long first, long second)
{
    checks++;
    if (!truth && wrong++ < 20) {
        printf("%s (%ld, %ld)\n", what, first, second);
    }
}

static OF(input) * input_of(batch *b, int n)
{
    OF(input) *const states[STATES] = {&b->in.x1, &b->in.v1, &b->in.v2, &b->in.y, &b->in.u, &b->in.horizon};
    return n < HOPFORM_ROBOT_FIELDS ? &b->in.robot[n] : states[n - HOPFORM_ROBOT_FIELDS];
}

static OF(output) * output_of(batch *b, int n)
{
    OF(output) *const results[RESULTS] = {&b->out.status, &b->out.event_count, &b->out.duration, &b->out.x1, &b->out.v1,
                                          &b->out.x2,     &b->out.v2,          &b->out.apex,     &b->out.aed};
    return results[n];
}

static size_t size_of_result(int n)
{
    return n < 2 ? sizeof(int32_t) : sizeof(real);
}

/* A list: what is written for each stance, or one memory for all of them. */
enum { BUFFER = 2, WORK = 3, STATUS = 7, TANGENT_STATUS = 8 };

static const size_t size_of_list[LISTS] = {
    EVENTS * sizeof(real),
    EVENTS,
    PHASES * sizeof(OF(phase)),
    STEPS * sizeof(OF(step)),
    TIMES * sizeof(OF(state)),
    HOPFORM_SENSITIVITY_ROWS * COLUMNS * sizeof(real),
    TIMES * HOPFORM_TANGENT_ROWS * COLUMNS * sizeof(real),
    sizeof(int32_t),
    sizeof(int32_t),
    sizeof(real),
};

static void *list_of(const batch *b, int n)
{
    void *const lists[LISTS] = {b->out.event_time,     b->out.event_kind,     b->out.phases,        b->out.steps,
                                b->out.states,         b->out.sensitivities,  b->out.tangents,      b->out.reading_status,
                                b->out.tangent_status, b->out.compressions};
    return lists[n];
}

static void put_list(batch *b, int n, void *place)
{
    switch (n) {
    case 0: b->out.event_time = (real *)place; break;
    case 1: b->out.event_kind = (int8_t *)place; break;
    case 2: b->out.phases = (OF(phase) *)place; break;
    case 3: b->out.steps = (OF(step) *)place; break;
    case 4: b->out.states = (OF(state) *)place; break;
    case 5: b->out.sensitivities = (real *)place; break;
    case 6: b->out.tangents = (real *)place; break;
    case 7: b->out.reading_status = (int32_t *)place; break;
    case 8: b->out.tangent_status = (int32_t *)place; break;
    default: b->out.compressions = (real *)place; break;
    }
}

static void separate(batch *b)
{
    memset(b, POISON, sizeof *b);
    for (int n = 0; n < READ; n++) {
        for (int i = 0; i < COUNT; i++) {
            b->read[n][i] = numbers[n];
        }
        input_of(b, n)->first = b->read[n];
        input_of(b, n)->stride = sizeof(real);
    }
    b->in.max_phases = PHASES;
    for (int n = 0; n < RESULTS; n++) {
        output_of(b, n)->first = b->results[n];
        output_of(b, n)->stride = (ptrdiff_t)size_of_result(n);
    }
    b->out.phases = b->phases;
    b->out.phase_capacity = PHASES;
    b->out.event_time = b->event_time;
    b->out.event_kind = b->event_kind;
    b->out.event_capacity = EVENTS;
    b->out.steps = b->steps;
    b->out.states = b->states;
    b->out.sensitivities = b->matrices;
    b->out.tangents = b->tangents;
    b->out.reading_status = b->status;
    b->out.tangent_status = b->tangent_status;
    b->out.compressions = b->compressions;
    b->step_times[0] = 0;
    b->step_times[1] = 0.05f;
    b->times[0] = 0.02f;
    b->times[1] = 0.1f;
    b->columns[0] = 4;
    b->columns[1] = HOPFORM_COLUMN_OF_STEP_TIME(1);
    b->columns[2] = HOPFORM_COLUMN_OF_STEP(1);
    b->in.step_count = STEPS;
    b->in.step_stride = 0; /* of the same input */
    b->in.step_times = b->step_times;
    b->in.times = b->times;
    b->in.time_count = TIMES;
    b->in.columns = b->columns;
    b->in.column_count = COLUMNS;
}

static int32_t code(const void *place)
{
    int32_t value;
    memcpy(&value, place, sizeof value);
    return value;
}

static int is_nan(const void *place)
{
    real value;
    memcpy(&value, place, sizeof value);
    return isnan(value);
}

/* Whether each stance is refused with a status, in all columns but one. */
static int is_refused(batch *b, int32_t status, int without)
{
    int safe = 1;
    for (int i = 0; i < COUNT; i++) {
        for (int n = 0; n < RESULTS; n++) {
            const OF(output) *to = output_of(b, n);
            if (to->first != NULL && n != without) {
                const char *place = (const char *)to->first + i * to->stride;
                safe = safe && (n == 0 ? code(place) == status : (n == 1 ? code(place) == 0 : is_nan(place)));
            }
        }
    }
    for (int n = 0; n < LISTS; n++) {
        const char *place = (const char *)list_of(b, n);
        const size_t size = n == 1 ? 1 : n == STATUS || n == TANGENT_STATUS ? sizeof(int32_t) : sizeof(real);
        for (size_t at = 0; place != NULL && n != BUFFER && n != WORK && without != RESULTS + n
                            && at < COUNT * size_of_list[n];
             at += size) {
            safe = safe
                   && (n == 1                                   ? place[at] == HOPFORM_EVENT_NONE
                       : n == STATUS || n == TANGENT_STATUS ? code(place + at) == status
                                                            : is_nan(place + at));
        }
    }
    return safe;
}

/* Whether the results are those of separate memory, bit for bit. */
static int is_same(batch *b, batch *other)
{
    int same = 1;
    for (int n = 0; n < LISTS; n++) {
        const char *one = (const char *)list_of(b, n), *two = (const char *)list_of(other, n);
        const size_t size = n == 1 || n == STATUS || n == TANGENT_STATUS ? 1 : sizeof(real);
        for (size_t at = 0; n != BUFFER && n != WORK && at < COUNT * size_of_list[n]; at += size) {
            const int none = size == sizeof(real) && is_nan(one + at) && is_nan(two + at);
            same = same && (none || memcmp(one + at, two + at, size) == 0);
        }
    }
    for (int n = 0; n < RESULTS; n++) {
        for (int i = 0; i < COUNT; i++) {
            const char *place = (const char *)output_of(b, n)->first + i * output_of(b, n)->stride;
            const char *there = (const char *)output_of(other, n)->first + i * output_of(other, n)->stride;
            same = same && memcmp(place, there, size_of_result(n)) == 0;
        }
    }
    return same;
}

/* ---- NULL ---- */

static int32_t solve(batch *b)
{
    return OF(solve_stances)(COUNT, &b->in, &b->out);
}

static void no_pointer(void)
{
    static batch b, apart;
    separate(&apart);
    holds(solve(&apart) == HOPFORM_OK, "separate memory", code(apart.results[0]), 0);
    holds(code(apart.results[0]) == HOPFORM_ENDING_TAKEOFF, "separate memory, no take-off", code(apart.results[0]), 0);
    holds(OF(solve_stances)(COUNT, NULL, NULL) == HOPFORM_ERROR_NULL, "nothing", 0, 0);
    holds(OF(solve_stances)(COUNT, &apart.in, NULL) == HOPFORM_ERROR_NULL, "no results", 0, 0);
    separate(&b);
    memset(b.states, 0, sizeof b.states);
    memset(b.matrices, 0, sizeof b.matrices);
    memset(b.tangents, 0, sizeof b.tangents);
    holds(OF(solve_stances)(COUNT, NULL, &b.out) == HOPFORM_ERROR_NULL, "no inputs", 0, 0);
    holds(!is_nan(b.states) && !is_nan(b.matrices) && !is_nan(b.tangents), "lists of unknown length are written", 0, 0);
    b.out.states = NULL;
    b.out.sensitivities = b.out.tangents = NULL;
    holds(is_refused(&b, HOPFORM_ERROR_NULL, -1), "no inputs, not safe", 0, 0);
    holds(b.read[READ - 1][COUNT - 1] == numbers[READ - 1], "what lies before the results is changed", 0, 0);
    struct {
        OF(stances_out) out;
        real duration[COUNT];
    } close;
    close.out = apart.out;
    close.out.duration.first = close.duration;
    (void)feclearexcept(FE_ALL_EXCEPT);
    holds(OF(solve_stances)(COUNT, &apart.in, &close.out) == HOPFORM_OK, "a column right behind the struct", 0, 0);
    holds(fetestexcept(FE_ALL_EXCEPT) == 0, "flags of the processor", fetestexcept(FE_ALL_EXCEPT), 0);
    for (int n = 0; n < READ; n++) {
        separate(&b);
        input_of(&b, n)->first = NULL;
        holds(solve(&b) == HOPFORM_ERROR_NULL && is_refused(&b, HOPFORM_ERROR_NULL, -1), "an input column is NULL",
              n, 0);
        holds(OF(solve_stances)(0, &b.in, &b.out) == HOPFORM_OK, "an input column of no stance is NULL", n, 0);
    }
    for (int n = 0; n < RESULTS; n++) {
        separate(&b);
        output_of(&b, n)->first = NULL;
        holds(solve(&b) == HOPFORM_OK, "a column of results is NULL", n, 0);
        output_of(&b, n)->first = apart.results[n];
        holds(is_same(&b, &apart), "a column of results is NULL: the others", n, 0);
    }
    for (int n = 4; n < LISTS; n++) {
        separate(&b);
        put_list(&b, n, NULL);
        holds(solve(&b) == HOPFORM_OK, "a list is not wanted", n, 0);
        put_list(&b, n, list_of(&apart, n));
        if (n == 5 || n == 6) { /* of what else is read the status stays */
            b.out.reading_status = n == 5 ? apart.status : b.status;
            b.out.tangent_status = n == 6 ? apart.tangent_status : b.tangent_status;
        }
        holds(is_same(&b, &apart), "a list is not wanted: the others", n, 0);
    }
    for (int mask = 1; mask < 8; mask++) {
        separate(&b);
        for (int n = 3; n < LISTS; n++) {
            put_list(&b, n, NULL);
        }
        b.in.step_times = NULL;
        b.in.step_count = mask & 1;
        b.out.phases = (mask & 1) != 0 ? NULL : b.phases;
        b.out.event_time = (mask & 2) != 0 ? NULL : b.event_time;
        b.out.event_kind = (mask & 4) != 0 ? NULL : b.event_kind;
        const int32_t status = solve(&b);
        const int fine = mask == 6; /* no events are wanted */
        holds(status == (fine ? HOPFORM_OK : HOPFORM_ERROR_NULL), "buffers are NULL", mask, status);
        holds(fine || is_refused(&b, HOPFORM_ERROR_NULL, -1), "buffers are NULL: results", mask, 0);
    }
}

/* No phases are kept where there is room for less than none. */
static void no_room(void)
{
    enum { MANY = 64 };
    static batch b;
    static int32_t endings[MANY];
    static real times[MANY];
    static int8_t kinds[MANY];
    for (int given = 0; given < 2; given++) {
        separate(&b);
        for (int n = 0; n < READ; n++) {
            input_of(&b, n)->stride = 0;
        }
        for (int n = 0; n < RESULTS; n++) {
            output_of(&b, n)->first = NULL;
        }
        for (int n = 0; n < LISTS; n++) {
            put_list(&b, n, NULL);
        }
        b.in.step_times = NULL;
        b.in.step_count = 0;
        b.out.status.first = endings;
        b.out.event_time = times;
        b.out.event_kind = kinds;
        b.out.event_capacity = 1;
        b.out.phases = given != 0 ? b.phases : NULL;
        b.out.phase_capacity = -1;
        holds(OF(solve_stances)(MANY, &b.in, &b.out) == HOPFORM_PHASES_NOT_KEPT
                  && endings[MANY - 1] == HOPFORM_ENDING_TAKEOFF,
              "room for less than none", given, 0);
    }
}

/* What is asked is refused: every result says so. */
static void is_asked_wrongly(void (*spoil)(batch *b), int32_t status, int which)
{
    static batch b;
    separate(&b);
    spoil(&b);
    const int32_t found = solve(&b);
    holds(found == status, "what is asked, status", which, found);
    if (b.in.time_count == TIMES && b.in.column_count == COLUMNS && b.in.columns != NULL) { /* as long as its lists are */
        holds(is_refused(&b, status, -1), "what is asked, not safe", which, status);
    }
}

static void no_memory_of_steps(batch *b) { b->out.steps = NULL; }
static void no_times_of_steps(batch *b) { b->in.step_times = NULL; }
static void no_steps(batch *b) { b->in.step_count = 0; }
static void less_than_no_steps(batch *b) { b->in.step_count = -3; }
static void too_many_steps(batch *b) { b->in.step_count = HOPFORM_MOST_STEPS + 1; }
static void late_steps(batch *b) { b->step_times[0] = 0.01f; }
static void no_times(batch *b) { b->in.times = NULL; }
static void times_before(batch *b) { b->times[0] = -0.1f; }
static void times_of_no_number(batch *b) { b->times[1] = (real)NAN; }
static void times_without_end(batch *b) { b->times[1] = (real)INFINITY; }
static void times_back(batch *b) { b->times[1] = 0.01f; }
static void less_than_no_times(batch *b) { b->in.time_count = -1; }
static void no_column(batch *b) { b->columns[1] = HOPFORM_COLUMN_OF_STEP_TIME(0); }
static void less_than_no_column(batch *b) { b->in.column_count = -1; }

static void times_back_without_tangents(batch *b)
{
    b->times[1] = 0.01f;
    b->out.tangents = NULL;
}

static void asked(void)
{
    static const struct {
        void (*spoil)(batch *b);
        int32_t status;
    } cases[] = {
        {no_memory_of_steps, HOPFORM_ERROR_NULL},   {no_times_of_steps, HOPFORM_ERROR_NULL},
        {no_steps, HOPFORM_ERROR_STEPS},            {less_than_no_steps, HOPFORM_ERROR_STEPS},
        {too_many_steps, HOPFORM_ERROR_STEPS},      {no_times, HOPFORM_ERROR_NULL},
        {times_before, HOPFORM_ERROR_TIME},         {times_of_no_number, HOPFORM_ERROR_TIME},
        {times_without_end, HOPFORM_ERROR_TIME},    {times_back, HOPFORM_ERROR_TIME},
        {less_than_no_times, HOPFORM_ERROR_TIME},   {no_column, HOPFORM_ERROR_COLUMNS},
        {less_than_no_column, HOPFORM_ERROR_COLUMNS},
    };
    for (int n = 0; n < (int)(sizeof cases / sizeof cases[0]); n++) {
        is_asked_wrongly(cases[n].spoil, cases[n].status, n);
    }
    static batch b;
    separate(&b);
    times_back_without_tangents(&b);
    holds(solve(&b) == HOPFORM_OK && b.status[0] == HOPFORM_OK, "states back in time", 0, 0);
    separate(&b);
    late_steps(&b);
    holds(solve(&b) == HOPFORM_OK && is_refused(&b, HOPFORM_ERROR_STEPS, -1), "steps that begin late", 0, 0);
}

/* ---- overlap ---- */

/* Whether elements of two columns in the arena have a byte in common, by a map of its bytes. */
static int meet(const elements *one, const elements *other)
{
    static char map[BYTES];
    memset(map, 0, sizeof map);
    for (int i = 0; i < COUNT; i++) {
        memset(map + (one->first - arena.bytes) + i * one->stride, 1, one->size);
    }
    for (int i = 0; i < COUNT; i++) {
        for (size_t n = 0; n < other->size; n++) {
            if (map[other->first - arena.bytes + i * other->stride + (ptrdiff_t)n] != 0) {
                return 1;
            }
        }
    }
    return 0;
}

/* Put what is written by column m into the arena. */
static elements place_output(batch *b, int m, ptrdiff_t stride)
{
    elements made = {arena.bytes + MIDDLE, stride, sizeof(real)};
    if (m < RESULTS) {
        made.size = size_of_result(m);
        output_of(b, m)->first = made.first;
        output_of(b, m)->stride = stride;
    } else {
        const int is_shared = m == RESULTS + BUFFER || m == RESULTS + WORK;
        made.size = size_of_list[m - RESULTS];
        made.stride = is_shared ? 0 : (ptrdiff_t)made.size;
        put_list(b, m - RESULTS, made.first);
    }
    return made;
}

static void placed(int n, int m, ptrdiff_t offset, ptrdiff_t read_stride, ptrdiff_t write_stride, batch *apart)
{
    static batch b;
    separate(&b);
    memset(&arena, POISON, sizeof arena);
    const elements to = place_output(&b, m, write_stride);
    const elements from = {arena.bytes + MIDDLE + offset, read_stride, sizeof(real)};
    for (int i = 0; i < COUNT; i++) {
        memcpy(from.first + i * read_stride, &numbers[n], sizeof(real));
    }
    input_of(&b, n)->first = from.first;
    input_of(&b, n)->stride = read_stride;
    const int overlap = meet(&from, &to);
    const int32_t status = solve(&b);
    holds(status == (overlap ? HOPFORM_ERROR_OVERLAP : HOPFORM_OK), "overlap of columns: input, result", n, m);
    holds(overlap ? is_refused(&b, HOPFORM_ERROR_OVERLAP, m) : is_same(&b, apart), "overlap of columns, results", n, m);
    for (int i = 0; overlap && i < COUNT; i++) {
        holds(memcmp(from.first + i * read_stride, &numbers[n], sizeof(real)) == 0, "a refusal writes to an input", n, m);
    }
}

/* Few columns in many places, and each in one. */
static void overlaps(void)
{
    static batch apart;
    separate(&apart);
    holds(solve(&apart) == HOPFORM_OK, "separate memory", 0, 0);
    enum { R = sizeof(real) };
    static const ptrdiff_t strides[][2] = {{R, R},          {0, R},           {R, 0},
                                           {0, 0},          {6 * R, 6 * R},   {-6 * R, 6 * R},
                                           {6 * R, -4 * R}, {-5 * R, -5 * R}, {16, 10 * R}};
    static const int some[] = {0, HOPFORM_ROBOT_FIELDS, READ - 1};
    for (size_t s = 0; s < sizeof strides / sizeof strides[0]; s++) {
        for (size_t k = 0; k < sizeof some / sizeof some[0]; k++) {
            for (int m = 0; m < WRITTEN; m += m == 2 ? RESULTS - 2 : 1) { /* results of one type are alike */
                for (ptrdiff_t offset = -30 * R; offset <= 30 * R; offset += R) {
                    if (strides[s][1] != 0 || m >= RESULTS) { /* a result for each stance */
                        placed(some[k], m, offset, strides[s][0], strides[s][1], &apart);
                    }
                }
            }
        }
    }
    for (int n = 0; n < READ; n++) {
        for (int m = 0; m < WRITTEN; m++) {
            placed(n, m, 0, R, R, &apart);
            placed(n, m, -3 * R, R, R, &apart);
        }
    }
}

/* Results over the structs that hold the addresses of the columns. */
static void over_the_structs(void)
{
    static batch b;
    for (int m = 0; m < WRITTEN; m++) {
        for (int which = 0; which < 2; which++) {
            separate(&b);
            OF(stances_out) out = b.out;
            OF(stances_in) in = b.in;
            const elements to = place_output(&b, m, sizeof(real));
            char *place = which == 0 ? (char *)&b.in : (char *)&b.out;
            if (m < RESULTS) {
                output_of(&b, m)->first = place;
            } else {
                put_list(&b, m - RESULTS, place);
                b.out.phase_capacity = m == RESULTS + BUFFER ? 2 : PHASES; /* which fit into either struct */
            }
            const OF(stances_out) given = b.out;
            holds(to.size > 0 && solve(&b) == HOPFORM_ERROR_OVERLAP, "results over a struct", m, which);
            holds(memcmp(&b.in, &in, sizeof in) == 0 && memcmp(&b.out, &given, sizeof given) == 0,
                  "a refusal writes to a struct", m, which);
            b.out = out;
            holds(is_refused(&b, HOPFORM_ERROR_OVERLAP, m), "results over a struct, not safe", m, which);
        }
    }
}

/* Results over what all stances share, and between the inputs of a stance's steps. */
static void over_what_is_asked(void)
{
    static batch b;
    for (int m = 0; m < WRITTEN; m++) {
        for (int which = 0; which < 3; which++) {
            separate(&b);
            memset(&arena, POISON, sizeof arena);
            const elements to = place_output(&b, m, m < RESULTS ? (ptrdiff_t)size_of_result(m) : 0);
            void *const place = to.first + (which == 0 ? to.size - 1 : 0) / sizeof(real) * sizeof(real);
            memcpy(place, which == 0 ? (void *)b.step_times : which == 1 ? (void *)b.times : (void *)b.columns,
                   which == 2 ? sizeof b.columns : sizeof b.times);
            b.in.step_times = which == 0 ? (const real *)place : b.step_times;
            b.in.times = which == 1 ? (const real *)place : b.times;
            b.in.columns = which == 2 ? (const int32_t *)place : b.columns;
            const real before = *(const real *)place;
            holds(solve(&b) == HOPFORM_ERROR_OVERLAP, "results over what is asked", m, which);
            holds(memcmp(&before, place, sizeof before) == 0, "a refusal writes to what is asked", m, which);
            holds(is_refused(&b, HOPFORM_ERROR_OVERLAP, m), "results over what is asked, not safe", m, which);
        }
    }
    for (int back = 0; back < 2; back++) {
        real inputs[3] = {2.0f, 7.0f, 2.0f};
        separate(&b);
        b.in.u.first = &inputs[back != 0 ? 2 : 0];
        b.in.u.stride = 0;
        b.in.step_stride = (back != 0 ? -2 : 2) * (ptrdiff_t)sizeof(real);
        holds(solve(&b) == HOPFORM_OK, "inputs of steps", back, 0);
        b.out.compressions = &inputs[1];
        holds(OF(solve_stances)(1, &b.in, &b.out) == HOPFORM_ERROR_OVERLAP && inputs[1] >= 7.0f,
              "a result between the inputs of steps", back, 0);
    }
}

/* ---- flights ---- */

enum { FLIGHT_READ = HOPFORM_ROBOT_FIELDS + 8, FLIGHT_RESULTS = 15 };

/* A batch of flights: its columns of inputs and results in the order of their structs. */
typedef struct {
    OF(flights_in) in;
    OF(flights_out) out;
    real read[FLIGHT_READ][COUNT];
    real results[FLIGHT_RESULTS][COUNT];
    real times[2];
    int32_t columns[2];
    OF(state) states[COUNT * 2];
    real matrices[COUNT * HOPFORM_FLIGHT_ROWS * 2];
    real event_time[COUNT * EVENTS];
    int8_t event_kind[COUNT * EVENTS];
    OF(flight_phase) phases[PHASES];
} flights;

static OF(input) * flight_input(flights *b, int n)
{
    return (OF(input) *)(void *)&b->in + n;
}

static OF(output) * flight_output(flights *b, int n)
{
    return (OF(output) *)(void *)&b->out + n;
}

/* Of the stances' inputs all but the input, then the ground, gains and the horizon; a take-off. */
static void fly_apart(flights *b)
{
    const real takeoff[] = {0, (real)0.2, (real)1.5, 0, 0, 9000, 600, 3};
    memset(b, 0, sizeof *b);
    for (int n = 0; n < FLIGHT_READ; n++) {
        for (int i = 0; i < COUNT; i++) {
            b->read[n][i] = n < HOPFORM_ROBOT_FIELDS ? numbers[n] : takeoff[n - HOPFORM_ROBOT_FIELDS];
        }
        flight_input(b, n)->first = b->read[n];
        flight_input(b, n)->stride = sizeof(real);
    }
    b->in.max_phases = PHASES - 1;
    for (int n = 0; n < FLIGHT_RESULTS; n++) {
        flight_output(b, n)->first = b->results[n];
        flight_output(b, n)->stride = sizeof(real);
    }
    b->times[1] = (real)0.05;
    b->columns[1] = HOPFORM_COLUMN_OF_KP;
    b->out.phases = b->phases;
    b->out.phase_capacity = PHASES;
    b->out.event_time = b->event_time;
    b->out.event_kind = b->event_kind;
    b->out.event_capacity = EVENTS;
    b->in.times = b->times;
    b->in.columns = b->columns;
    b->in.time_count = 2;
    b->in.column_count = 2;
    b->out.states = b->states;
    b->out.sensitivities = b->matrices;
}

static int32_t fly(flights *b)
{
    return OF(solve_flights)(COUNT, &b->in, &b->out);
}

static void flights_refuse(void)
{
    static flights b;
    fly_apart(&b);
    (void)feclearexcept(FE_ALL_EXCEPT);
    holds(fly(&b) == HOPFORM_OK && code(b.results[0]) == HOPFORM_FLIGHT_TOUCHDOWN, "a flight", code(b.results[0]), 0);
    holds(fetestexcept(FE_ALL_EXCEPT) == 0, "flags of the processor", fetestexcept(FE_ALL_EXCEPT), 1);
    holds(OF(solve_flights)(COUNT, NULL, NULL) == HOPFORM_ERROR_NULL, "no flights", 0, 0);
    holds(OF(solve_flights)(COUNT, NULL, &b.out) == HOPFORM_ERROR_NULL && is_nan(b.results[1]), "no inputs", 1, 0);
    for (int n = 0; n < FLIGHT_READ; n++) {
        fly_apart(&b);
        flight_input(&b, n)->first = NULL;
        holds(fly(&b) == HOPFORM_ERROR_NULL && code(b.results[0]) == HOPFORM_ERROR_NULL && is_nan(b.results[1]),
              "an input of flights is NULL", n, code(b.results[0]));
        for (int m = 0; m < FLIGHT_RESULTS; m++) {
            fly_apart(&b);
            const real before = b.read[n][COUNT - 1];
            flight_output(&b, m)->first = b.read[n];
            holds(fly(&b) == HOPFORM_ERROR_OVERLAP && b.read[n][COUNT - 1] == before, "results of flights overlap", n, m);
            holds(m == 0 || code(b.results[0]) == HOPFORM_ERROR_OVERLAP, "flights, overlap, no status", n, m);
        }
    }
    const void *const inside[] = {b.phases, b.states, b.matrices, b.event_time, b.event_kind};
    for (int n = 0; n < 5; n++) {
        for (int what = 0; what < 2; what++) {
            fly_apart(&b);
            b.in.times = what == 0 ? (const real *)inside[n] : b.times;
            b.in.columns = what == 1 ? (const int32_t *)inside[n] : b.columns;
            holds(fly(&b) == HOPFORM_ERROR_OVERLAP && code(b.results[0]) == HOPFORM_ERROR_OVERLAP,
                  "times or columns in a list", n, what);
        }
        fly_apart(&b);
        flight_input(&b, 2)->first = inside[n];
        flight_input(&b, 2)->stride = 0;
        holds(fly(&b) == HOPFORM_ERROR_OVERLAP, "an input in a list", n, 0);
    }
    for (int n = 0; n < FLIGHT_RESULTS; n++) {
        fly_apart(&b);
        flight_output(&b, n)->first = NULL;
        holds(fly(&b) == HOPFORM_OK, "a column of flights is NULL", n, 0);
        flight_output(&b, n)->first = &b.in;
        flight_output(&b, n)->stride = 0;
        const OF(flights_in) in = b.in;
        holds(fly(&b) == HOPFORM_ERROR_OVERLAP && memcmp(&in, &b.in, sizeof in) == 0, "flights over their struct", n, 0);
    }
}

/* Each flight of a batch against the same flight alone, to the bits: its ending, gains, derivatives, and states at times,
 * NaN behind the ending. */
static void flights_one_by_one(int designs)
{
    static flights b;
    fly_apart(&b);
    b.times[1] = (real)0.3; /* behind the ending of the first ones */
    for (int i = 0; i < COUNT; i++) {
        b.read[HOPFORM_ROBOT_FIELDS + 2][i] = (real)(0.4 + 0.9 * i);
    }
    if (designs) {
        b.in.gains[0].first = NULL, b.in.gains[1].first = NULL;
    }
    holds(fly(&b) == HOPFORM_OK, "flights", designs, 0);
    int behind = 0;
    for (int i = 0; i < COUNT; i++) {
        static OF(plan) plan;
        static OF(flight_phase) phases[PHASES];
        OF(robot) robot;
        OF(flight) flight;
        OF(state) at;
        real one[FLIGHT_READ], matrix[HOPFORM_FLIGHT_ROWS * 2];
        for (int n = 0; n < FLIGHT_READ; n++) {
            one[n] = b.read[n][i];
        }
        memcpy(&robot, one, sizeof robot);
        const real *from = one + HOPFORM_ROBOT_FIELDS;
        const OF(state) start = {from[0], from[1], from[2], from[3]};
        const OF(gains) gains = {from[5], from[6]};
        holds(OF(plan_init)(&plan, &robot) == HOPFORM_OK, "a plan", i, 0);
        const int32_t status = OF(solve_flight)(&plan, &start, from[4], designs ? NULL : &gains, from[7], PHASES - 1,
                                                phases, PHASES, &flight);
        holds(status >= 0 && flight.ending == code(b.results[0] + i), "the ending of a flight", i, designs);
        const real expected[FLIGHT_RESULTS - 2] = {
            flight.duration, flight.end.x1, flight.end.v1, flight.end.x1 - flight.end.y + (robot.L0 + robot.c),
            flight.end.v2, flight.v2_after, flight.end.y, flight.apex, flight.apex_time, flight.impact_loss,
            flight.leg_loss, flight.gains.Kp, flight.gains.Kd};
        for (int n = 0; n < FLIGHT_RESULTS - 2; n++) {
            const real got = b.results[1 + n][i];
            const real off = n == 3 ? 4 * (real)1.2e-7 : 0; /* a sum in another order */
            holds(!(got - expected[n] > off) && !(expected[n] - got > off) && !isnan(got), "a number of a flight", i, n);
        }
        holds(OF(flight_sensitivities)(&plan, phases, &flight, b.columns, 2, matrix) == HOPFORM_OK
                  && memcmp(matrix, b.matrices + i * HOPFORM_FLIGHT_ROWS * 2, sizeof matrix) == 0,
              "derivatives of a flight", i, designs);
        for (int n = 0; n < 2; n++) {
            const OF(state) *got = &b.states[2 * i + n];
            if (b.times[n] > flight.duration) {
                behind++;
                holds(isnan(got->x1) && isnan(got->v1) && isnan(got->v2) && isnan(got->y), "a state behind the end", i, n);
            } else {
                holds(OF(flight_at)(&plan, phases, &flight, &b.times[n], 1, &at) == HOPFORM_OK
                          && memcmp(&at, got, sizeof at) == 0,
                      "a state of a flight", i, n);
            }
        }
    }
    holds(behind > 0 && behind < 2 * COUNT, "times behind an ending", behind, 0);
}

int main(void)
{
    flights_one_by_one(0);
    flights_one_by_one(1);
    flights_refuse();
    no_pointer();
    no_room();
    overlaps();
    over_the_structs();
    asked();
    over_what_is_asked();
    printf("%d checks, wrong %d\n", (int)checks, wrong);
    return wrong > 0;
}
