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
    MATRIX = HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS,
    WRITTEN = RESULTS + 3, /* with times and kinds of events, and the buffer of phases */
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
    real matrices[COUNT][MATRIX];
    int32_t status[COUNT];
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
    for (int n = 0; n < COUNT * EVENTS; n++) {
        safe = safe && (b->out.event_time == NULL || without == RESULTS || is_nan(&b->out.event_time[n]));
        safe =
            safe && (b->out.event_kind == NULL || without == RESULTS + 1 || b->out.event_kind[n] == HOPFORM_EVENT_NONE);
    }
    return safe;
}

/* Whether the results are those of separate memory, bit for bit. */
static int is_same(batch *b, batch *other)
{
    int same = memcmp(b->out.event_kind, other->out.event_kind, COUNT * EVENTS) == 0;
    for (int n = 0; n < COUNT * EVENTS; n++) {
        const int none = is_nan(&b->out.event_time[n]) && is_nan(&other->out.event_time[n]);
        same = same && (none || memcmp(&b->out.event_time[n], &other->out.event_time[n], sizeof(real)) == 0);
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
    holds(OF(solve_stances)(COUNT, NULL, &b.out) == HOPFORM_ERROR_NULL && is_refused(&b, HOPFORM_ERROR_NULL, -1),
          "no inputs", 0, 0);
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
    for (int mask = 1; mask < 8; mask++) {
        separate(&b);
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

/* What reads each stance: its derivatives or its compression, in `each` numbers. */
typedef struct {
    const char *name;
    int32_t (*call)(int64_t count, const OF(stances_in) *in, OF(phase) *phases, int32_t capacity, real *numbers,
                    int32_t *status);
    int each;
} reading;

static const reading readings[2] = {{"derivatives", OF(stances_sensitivities), MATRIX},
                                    {"compressions", OF(stances_compressions), 1}};

/* Every number is NaN and every status the refusal, but in the buffer, the numbers or the statuses that are left out. */
static int are_refused(const batch *b, const reading *of, int32_t status, int without)
{
    int safe = 1;
    for (int n = 0; without != 1 && n < COUNT * of->each; n++) {
        safe = safe && isnan(b->matrices[n / MATRIX][n % MATRIX]);
    }
    for (int i = 0; without != 2 && i < COUNT; i++) {
        safe = safe && b->status[i] == status;
    }
    return safe;
}

static void no_pointer_to_a_reading(const reading *of)
{
    static batch b;
    for (int mask = 0; mask < 16; mask++) {
        separate(&b);
        const int32_t status =
            of->call(COUNT, (mask & 1) != 0 ? NULL : &b.in, (mask & 2) != 0 ? NULL : b.phases, PHASES,
                     (mask & 4) != 0 ? NULL : b.matrices[0], (mask & 8) != 0 ? NULL : b.status);
        holds(status == (mask == 0 ? HOPFORM_OK : HOPFORM_ERROR_NULL), of->name, mask, status);
        if ((mask & 4) != 0) {
            memset(b.matrices, 0xff, sizeof b.matrices);
        }
        for (int i = 0; (mask & 8) != 0 && i < COUNT; i++) {
            b.status[i] = HOPFORM_ERROR_NULL;
        }
        holds(mask == 0 || are_refused(&b, of, HOPFORM_ERROR_NULL, 0), "a reading, mask of NULL, not safe", mask, 0);
    }
    for (int n = 0; n < READ; n++) {
        separate(&b);
        input_of(&b, n)->first = NULL;
        holds(of->call(COUNT, &b.in, b.phases, PHASES, b.matrices[0], b.status) == HOPFORM_ERROR_NULL,
              "a reading, a column is NULL", n, 0);
        holds(are_refused(&b, of, HOPFORM_ERROR_NULL, 0), "a reading, a column is NULL, not safe", n, 0);
    }
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
    } else if (m == RESULTS) {
        made.stride = (ptrdiff_t)(made.size = EVENTS * sizeof(real));
        b->out.event_time = (real *)(void *)made.first;
    } else if (m == RESULTS + 1) {
        made.stride = (ptrdiff_t)(made.size = EVENTS);
        b->out.event_kind = (int8_t *)(void *)made.first;
    } else {
        made.stride = 0;
        made.size = PHASES * sizeof(OF(phase));
        b->out.phases = (OF(phase) *)(void *)made.first;
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
            } else if (m == RESULTS) {
                b.out.event_time = (real *)(void *)place;
            } else if (m == RESULTS + 1) {
                b.out.event_kind = (int8_t *)place;
            } else {
                b.out.phases = (OF(phase) *)(void *)place;
                b.out.phase_capacity = 2; /* which fit into either struct */
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

static void overlaps_of_a_reading(const reading *of)
{
    static batch b;
    for (int n = 0; n < READ; n++) {
        for (int m = 0; m < 3; m++) {
            separate(&b);
            const void *const inside = m == 0   ? (const void *)b.phases
                                       : m == 1 ? (const void *)(b.matrices[0] + COUNT * of->each - 1)
                                                : (const void *)b.status;
            real before;
            memcpy(&before, inside, sizeof before);
            input_of(&b, n)->first = inside;
            input_of(&b, n)->stride = 0;
            holds(of->call(COUNT, &b.in, b.phases, PHASES, b.matrices[0], b.status) == HOPFORM_ERROR_OVERLAP, of->name,
                  n, m);
            holds(are_refused(&b, of, HOPFORM_ERROR_OVERLAP, m), "a reading, overlap, not safe", n, m);
            holds(memcmp(&before, inside, sizeof before) == 0, "a refused reading writes to an input", n, m);
        }
    }
    separate(&b);
    const OF(stances_in) in = b.in;
    holds(of->call(COUNT, &b.in, b.phases, PHASES, b.matrices[0], (int32_t *)(void *)&b.in) == HOPFORM_ERROR_OVERLAP
              && memcmp(&b.in, &in, sizeof in) == 0,
          "a reading, a status over the struct", 0, 0);
}

int main(void)
{
    no_pointer();
    no_room();
    overlaps();
    over_the_structs();
    for (int n = 0; n < 2; n++) {
        no_pointer_to_a_reading(&readings[n]);
        overlaps_of_a_reading(&readings[n]);
    }
    printf("%d checks, wrong %d\n", (int)checks, wrong);
    return wrong > 0;
}
