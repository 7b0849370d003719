/* The contract on pointers, for every public function: each mask of NULL arguments is refused with every other output
 * safe; a small input in an output gives the answer of separate memory, bit for bit; any other input that overlaps an
 * output is refused, and no refusal writes to it. In double precision with -DDOUBLE. */
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "board.h"
#include "hopform/hopform.h"

#ifdef DOUBLE
typedef double real;
#define OF(name) hopform_##name##_f64
#else
typedef float real;
#define OF(name) hopform_##name##_f32
#endif

enum { CAPACITY = 12, TIMES = 2, GRID = 2, MOST = 9, POISON = 0xa5 };

/* Bytes for an argument; none is larger than two searches. */
#define ROOM ((2 * sizeof(OF(search)) + 63) / 64 * 64)

/* What an argument is for. */
typedef enum {
    INPUT,    /* const */
    SMALL,    /* const, may lie in an output */
    OPTIONAL, /* the same, may be NULL */
    OUTPUT,   /* zeros after a refusal */
    COMMAND,  /* an output: u = 0 after a refusal */
    SEARCH,   /* an output: a step of it commands u = 0 after a refusal */
    STEPPED,  /* a search that goes on: an input to other arguments, safe as any search after a refusal */
    CONTACT,  /* read and written, as a plant: as it was after a refusal */
    BUFFER    /* phases: after a refusal none counts */
} role;

typedef struct {
    role is_for;
    const void *given; /* what it holds before the call; NULL: POISON */
    size_t size;       /* of an element */
    size_t payload;    /* of an element, without the padding at its end */
    size_t count;
    size_t written; /* elements that a call writes, from the first on */
} argument;

typedef struct {
    const char *name;
    int32_t (*call)(void *const *at);
    size_t count;
    argument arguments[MOST];
    int32_t fine;   /* status of a call with separate memory */
    uint32_t absent; /* bits of outputs that may be NULL, all at once */
    uint32_t optional; /* bits of those that may be NULL, each by itself */
} entry;

static const OF(robot) sound = {25.0f, 3.0f,   1200.0f, 0.4f, 0.0f,  150.0f, 5.0f, 0.78f,
                                0.6f,  -65.0f, 9.81f,   0.0f, 0.08f, 3.0f,   0.05f, 0.0f, 0.0f};
static const OF(state) start = {0.0f, 0.0f, -1.9f, 0.0f};
static const OF(state) away = {0.01f, 0.1f, 1.5f, 0.0f};
static const OF(step) steps[2] = {{0.0f, 2.0f}, {0.1f, 1.5f}};
static const OF(gains) law = {500.0f, 30.0f};
static const OF(target) target = {0.1f, 0.0f, 0.001f, 2.0f, 0, 0};
static const real times[TIMES] = {0.02f, 0.05f};
static const real currents[1] = {1.0f};
static const int32_t columns[HOPFORM_SENSITIVITY_COLUMNS] = {HOPFORM_COLUMN_OF_STEP_TIME(1), 4,
                                                             HOPFORM_COLUMN_OF_STEP(1), 3};
static const OF(detector) detector = {0.6f, 0.4f, 2};
static const OF(contact) contact = {0, 0, 1};
static const OF(start) coordinates = {0.0f, 0.0f, 0.4f, -1.9f};
static OF(plan) plan;
static OF(plant) plant;
static OF(stance) solved;
static OF(phase) phases[CAPACITY];
static OF(flight) flown;
static OF(flight_phase) flight_phases[CAPACITY];
static OF(search) begun;
static OF(phase) work[CAPACITY];
static OF(command) outcome; /* of the search that was begun last */

static uint64_t memory[2][MOST][ROOM / 8];
static uint64_t arena[3 * ROOM / 8]; /* an output in the middle, inputs around it */
static uint64_t reference[ROOM / 8];
static int32_t checks;
static int wrong;

static int holds(int truth, const char *name, const char *what, int32_t first, int32_t second)
{
    checks++;
    if (!truth && wrong++ < 20) {
        board_text(name);
        board_text(": ");
        board_text(what);
        board_text(" (");
        board_number(first);
        board_text(", ");
        board_number(second);
        board_text(")\n");
    }
    return truth;
}

/* ---- the functions ---- */

static int32_t plan_init(void *const *at)
{
    return OF(plan_init)((OF(plan) *)at[0], (const OF(robot) *)at[1]);
}

static int32_t solve_stance(void *const *at)
{
    return OF(solve_stance)((const OF(plan) *)at[0], (const OF(state) *)at[1], (const OF(step) *)at[2], 2, 2.0f,
                            CAPACITY, (OF(phase) *)at[3], CAPACITY, (OF(stance) *)at[4]);
}

static int32_t stance_at(void *const *at)
{
    return OF(stance_at)((const OF(plan) *)at[0], (const OF(step) *)at[1], (const OF(phase) *)at[2],
                         (const OF(stance) *)at[3], 0.05f, (OF(state) *)at[4]);
}

static int32_t state_of_start(void *const *at)
{
    return OF(state_of_start)((const OF(plan) *)at[0], (const OF(start) *)at[1], (OF(state) *)at[2]);
}

static int32_t start_of_state(void *const *at)
{
    return OF(start_of_state)((const OF(plan) *)at[0], (const OF(state) *)at[1], (OF(start) *)at[2]);
}

static int32_t stance_forces(void *const *at)
{
    return OF(stance_forces)((const OF(plan) *)at[0], (const OF(step) *)at[1], (const OF(phase) *)at[2],
                             (const OF(stance) *)at[3], (const real *)at[4], TIMES, (OF(forces) *)at[5]);
}

static int32_t stance_before(void *const *at)
{
    return OF(stance_before)((const OF(plan) *)at[0], (const OF(step) *)at[1], (const OF(phase) *)at[2],
                             (const OF(stance) *)at[3], 1, (OF(state) *)at[4]);
}

static int32_t plant_begin(void *const *at)
{
    return OF(plant_begin)((OF(plant) *)at[0], (const OF(robot) *)at[1], (const OF(start) *)at[2]);
}

static int32_t plant_place(void *const *at)
{
    return OF(plant_place)((OF(plant) *)at[0], (const OF(start) *)at[1]);
}

/* The buffer is a member of the report. */
static int32_t plant_step(void *const *at)
{
    OF(report) *report = (OF(report) *)at[2];
    if (report != NULL) {
        report->phases = (OF(phase) *)at[1];
        report->capacity = CAPACITY;
    }
    return OF(plant_step)((OF(plant) *)at[0], 2.0f, 0.05f, report);
}

static int32_t stance_states(void *const *at)
{
    return OF(stance_states)((const OF(plan) *)at[0], (const OF(step) *)at[1], (const OF(phase) *)at[2],
                             (const OF(stance) *)at[3], (const real *)at[4], TIMES,
                             (real *const[]){(real *)at[5], (real *)at[6], (real *)at[7], (real *)at[8]});
}

static int32_t stance_energy(void *const *at)
{
    return OF(stance_energy)((const OF(plan) *)at[0], (const OF(step) *)at[1], (const OF(phase) *)at[2],
                             (const OF(stance) *)at[3], (const real *)at[4], TIMES, (OF(energy) *)at[5],
                             (OF(ledger) *)at[6], (real *)at[7]);
}

/* Without ledgers: the energies alone. */
static int32_t stance_energies(void *const *at)
{
    return OF(stance_energy)((const OF(plan) *)at[0], (const OF(step) *)at[1], (const OF(phase) *)at[2],
                             (const OF(stance) *)at[3], (const real *)at[4], TIMES, (OF(energy) *)at[5], NULL, NULL);
}

static int32_t stance_compression(void *const *at)
{
    return OF(stance_compression)((const OF(plan) *)at[0], (const OF(step) *)at[1], (const OF(phase) *)at[2],
                                  (const OF(stance) *)at[3], (real *)at[4]);
}

static int32_t stance_sensitivities(void *const *at)
{
    return OF(stance_sensitivities)((const OF(plan) *)at[0], (const OF(step) *)at[1], (const OF(phase) *)at[2],
                                    (const OF(stance) *)at[3], (const int32_t *)at[5], HOPFORM_SENSITIVITY_COLUMNS,
                                    (real *)at[4]);
}

static int32_t stance_tangents(void *const *at)
{
    return OF(stance_tangents)((const OF(plan) *)at[0], (const OF(step) *)at[1], (const OF(phase) *)at[2],
                               (const OF(stance) *)at[3], (const int32_t *)at[7], HOPFORM_SENSITIVITY_COLUMNS,
                               (const real *)at[4], TIMES, (OF(state) *)at[5], (real *)at[6]);
}

static int32_t stance_grid(void *const *at)
{
    return OF(stance_grid)((const OF(plan) *)at[0], (const OF(step) *)at[1], (const OF(phase) *)at[2],
                           (const OF(stance) *)at[3], 0.0f, 0.05f, GRID,
                           (real *const[]){(real *)at[4], (real *)at[5], (real *)at[6], (real *)at[7]});
}

static int32_t choose_current_near(void *const *at)
{
    return OF(choose_current_near)((OF(search) *)at[0], 1.0f);
}

static int32_t try_currents(void *const *at)
{
    return OF(try_currents)((const OF(plan) *)at[0], (const OF(state) *)at[1], 1, (const real *)at[2], 1, 2.0f,
                            (OF(phase) *)at[3], CAPACITY, (OF(trial) *)at[4]);
}

/* Where a search can begin it goes on to its end in memory of its own: what it begins with decides the outcome. */
static int32_t choose_current_begin(void *const *at)
{
    OF(search) *search = (OF(search) *)at[0];
    const int32_t status = OF(choose_current_begin)(search, (const OF(plan) *)at[1], (const OF(state) *)at[2],
                                                    (const OF(target) *)at[3], (OF(command) *)at[4]);
    int32_t goes_on = status;
    memset(&outcome, 0, sizeof outcome);
    while (goes_on == HOPFORM_SEARCHING) {
        goes_on = OF(choose_current_step)(search, work, CAPACITY, &outcome);
    }
    return status;
}

static int32_t choose_current_step(void *const *at)
{
    return OF(choose_current_step)((OF(search) *)at[0], (OF(phase) *)at[1], CAPACITY, (OF(command) *)at[2]);
}

static int32_t choose_current(void *const *at)
{
    return OF(choose_current)((OF(search) *)at[0], (const OF(plan) *)at[1], (const OF(state) *)at[2],
                              (const OF(target) *)at[3], (OF(phase) *)at[4], CAPACITY, (OF(command) *)at[5]);
}

static int32_t design_return(void *const *at)
{
    return OF(design_return)((const OF(plan) *)at[0], 0.1f, (OF(gains) *)at[1]);
}

static int32_t solve_flight(void *const *at)
{
    return OF(solve_flight)((const OF(plan) *)at[0], (const OF(state) *)at[1], 0, (const OF(gains) *)at[2], 2.0f,
                            CAPACITY, (OF(flight_phase) *)at[3], CAPACITY, (OF(flight) *)at[4]);
}

static int32_t flight_at(void *const *at)
{
    return OF(flight_at)((const OF(plan) *)at[0], (const OF(flight_phase) *)at[1], (const OF(flight) *)at[2],
                         (const real *)at[3], TIMES, (OF(state) *)at[4]);
}

static int32_t flight_sensitivities(void *const *at)
{
    return OF(flight_sensitivities)((const OF(plan) *)at[0], (const OF(flight_phase) *)at[1], (const OF(flight) *)at[2],
                                    NULL, 0, (real *)at[3]);
}

static int32_t flight_energy(void *const *at)
{
    return OF(flight_energy)((const OF(plan) *)at[0], (const OF(flight_phase) *)at[1], (const OF(flight) *)at[2],
                             (const real *)at[3], TIMES, (OF(energy) *)at[4], (OF(flight_ledger) *)at[5],
                             (real *)at[6]);
}

static int32_t touchdown(void *const *at)
{
    return OF(touchdown)((const OF(detector) *)at[0], (OF(contact) *)at[1], 0.7f);
}

/* ---- what they take ---- */

#define WHOLE(type, count) sizeof(type), sizeof(type), (count), (count)
#define ENDING_WITH(type, member, count, written)                                                                      \
    sizeof(type), offsetof(type, member) + sizeof(((type *)NULL)->member), (count), (written)
#define BIT(k) (1u << (k))
#define PLAN {INPUT, &plan, ENDING_WITH(OF(plan), made, 1, 1)}
#define STEPS {INPUT, steps, WHOLE(OF(step), 2)}
#define PHASES {INPUT, phases, WHOLE(OF(phase), of_stance)}
#define STANCE {INPUT, &solved, WHOLE(OF(stance), 1)}
#define START {SMALL, &start, WHOLE(OF(state), 1)}
#define INSTANTS {INPUT, times, WHOLE(real, TIMES)}
#define COLUMNS {INPUT, columns, WHOLE(int32_t, HOPFORM_SENSITIVITY_COLUMNS)}
#define COLUMN(count) {OUTPUT, NULL, WHOLE(real, count)}
#define WORK(written) {BUFFER, NULL, ENDING_WITH(OF(phase), step, CAPACITY, written)}
#define BEGUN {SEARCH, NULL, ENDING_WITH(OF(search), partial, 1, 0)}
#define CHOSEN {COMMAND, NULL, ENDING_WITH(OF(command), status, 1, 1)}

/* The functions and what they are called with, once a stance and a flight are solved. */
static void each(void (*check)(const entry *))
{
    enum { MATRIX = HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS };
    enum { TANGENTS = TIMES * HOPFORM_TANGENT_ROWS * HOPFORM_SENSITIVITY_COLUMNS };
    const size_t of_stance = (size_t)solved.phases_kept;
    const size_t of_flight = (size_t)flown.phases_kept;
    const entry entries[] = {
        {.name = "plan_init", .call = plan_init, .count = 2,
         .arguments =
          {{OUTPUT, NULL, ENDING_WITH(OF(plan), made, 1, 1)}, {SMALL, &sound, WHOLE(OF(robot), 1)}}},
        {.name = "solve_stance", .call = solve_stance, .count = 5,
         .arguments =
          {PLAN, START, STEPS, WORK(of_stance), {OUTPUT, NULL, WHOLE(OF(stance), 1)}}},
        {.name = "stance_at", .call = stance_at, .count = 5,
         .arguments =
          {PLAN, STEPS, PHASES, STANCE, {OUTPUT, NULL, WHOLE(OF(state), 1)}}},
        {.name = "state_of_start", .call = state_of_start, .count = 3,
         .arguments =
          {PLAN, {SMALL, &coordinates, WHOLE(OF(start), 1)}, {OUTPUT, NULL, WHOLE(OF(state), 1)}}},
        {.name = "start_of_state", .call = start_of_state, .count = 3,
         .arguments =
          {PLAN, START, {OUTPUT, NULL, WHOLE(OF(start), 1)}}},
        {.name = "stance_forces", .call = stance_forces, .count = 6,
         .arguments =
          {PLAN, STEPS, PHASES, STANCE, INSTANTS, {OUTPUT, NULL, WHOLE(OF(forces), TIMES)}}},
        {.name = "stance_before", .call = stance_before, .count = 5,
         .arguments =
          {PLAN, STEPS, PHASES, STANCE, {OUTPUT, NULL, WHOLE(OF(state), 1)}}},
        {.name = "plant_begin", .call = plant_begin, .count = 3,
         .arguments =
          {{OUTPUT, NULL, ENDING_WITH(OF(plant), begins, 1, 1)}, {SMALL, &sound, WHOLE(OF(robot), 1)},
           {SMALL, &coordinates, WHOLE(OF(start), 1)}}},
        {.name = "plant_place", .call = plant_place, .count = 2,
         .arguments =
          {{CONTACT, &plant, ENDING_WITH(OF(plant), begins, 1, 1)}, {SMALL, &coordinates, WHOLE(OF(start), 1)}}},
        {.name = "plant_step", .call = plant_step, .count = 3,
         .arguments =
          {{CONTACT, &plant, ENDING_WITH(OF(plant), begins, 1, 1)},
           {BUFFER, NULL, ENDING_WITH(OF(phase), step, CAPACITY, 1)},
           {OUTPUT, NULL, ENDING_WITH(OF(report), event_count, 1, 1)}}},
        {.name = "stance_states", .call = stance_states, .count = 9,
         .arguments =
          {PLAN, STEPS, PHASES, STANCE, INSTANTS, COLUMN(TIMES), COLUMN(TIMES), COLUMN(TIMES), COLUMN(TIMES)}},
        {.name = "stance_energy", .call = stance_energy, .count = 8, .absent = BIT(6) | BIT(7),
         .arguments =
          {PLAN, STEPS, PHASES, STANCE, INSTANTS, {OUTPUT, NULL, WHOLE(OF(energy), TIMES)},
           {OUTPUT, NULL, WHOLE(OF(ledger), TIMES)}, COLUMN(TIMES)}},
        {.name = "stance_energy, energies alone", .call = stance_energies, .count = 6,
         .arguments =
          {PLAN, STEPS, PHASES, STANCE, INSTANTS, {OUTPUT, NULL, WHOLE(OF(energy), TIMES)}}},
        {.name = "stance_compression", .call = stance_compression, .count = 5,
         .arguments =
          {PLAN, STEPS, PHASES, STANCE, COLUMN(1)}},
        {.name = "stance_sensitivities", .call = stance_sensitivities, .count = 6, .optional = BIT(5),
         .arguments =
          {PLAN, STEPS, PHASES, STANCE, COLUMN(MATRIX), COLUMNS}},
        {.name = "stance_tangents", .call = stance_tangents, .count = 8, .optional = BIT(5) | BIT(7),
         .arguments =
          {PLAN, STEPS, PHASES, STANCE, INSTANTS, {OUTPUT, NULL, WHOLE(OF(state), TIMES)}, COLUMN(TANGENTS),
           COLUMNS}},
        {.name = "stance_grid", .call = stance_grid, .count = 8,
         .arguments =
          {PLAN, STEPS, PHASES, STANCE, COLUMN(GRID), COLUMN(GRID), COLUMN(GRID), COLUMN(GRID)}},
        {.name = "try_currents", .call = try_currents, .count = 5,
         .arguments =
          {PLAN, {INPUT, &start, WHOLE(OF(state), 1)}, {INPUT, currents, WHOLE(real, 1)}, WORK(0),
           {OUTPUT, NULL, ENDING_WITH(OF(trial), smooth, 1, 1)}}},
        {.name = "choose_current_begin", .call = choose_current_begin, .count = 5,
         .fine = HOPFORM_SEARCHING, .arguments =
          {BEGUN, PLAN, START, {SMALL, &target, WHOLE(OF(target), 1)}, CHOSEN}},
        {.name = "choose_current_near", .call = choose_current_near, .count = 1,
         .fine = HOPFORM_SEARCHING, .arguments = {{STEPPED, &begun, ENDING_WITH(OF(search), partial, 1, 1)}}},
        {.name = "choose_current_step", .call = choose_current_step, .count = 3,
         .fine = HOPFORM_SEARCHING, .arguments =
          {{STEPPED, &begun, ENDING_WITH(OF(search), partial, 1, 1)}, WORK(0), CHOSEN}},
        {.name = "choose_current", .call = choose_current, .count = 6,
         .arguments =
          {BEGUN, PLAN, START, {SMALL, &target, WHOLE(OF(target), 1)}, WORK(0), CHOSEN}},
        {.name = "design_return", .call = design_return, .count = 2,
         .arguments =
          {PLAN, {OUTPUT, NULL, WHOLE(OF(gains), 1)}}},
        {.name = "solve_flight", .call = solve_flight, .count = 5,
         .arguments =
          {PLAN, {SMALL, &away, WHOLE(OF(state), 1)}, {OPTIONAL, &law, WHOLE(OF(gains), 1)},
           {BUFFER, NULL, ENDING_WITH(OF(flight_phase), spare, CAPACITY, of_flight)},
           {OUTPUT, NULL, WHOLE(OF(flight), 1)}}},
        {.name = "flight_at", .call = flight_at, .count = 5,
         .arguments =
          {PLAN, {INPUT, flight_phases, WHOLE(OF(flight_phase), of_flight)}, {INPUT, &flown, WHOLE(OF(flight), 1)},
           INSTANTS, {OUTPUT, NULL, WHOLE(OF(state), TIMES)}}},
        {.name = "flight_sensitivities", .call = flight_sensitivities, .count = 4,
         .arguments =
          {PLAN, {INPUT, flight_phases, WHOLE(OF(flight_phase), of_flight)}, {INPUT, &flown, WHOLE(OF(flight), 1)},
           COLUMN(HOPFORM_FLIGHT_ROWS * HOPFORM_FLIGHT_COLUMNS)}},
        {.name = "flight_energy", .call = flight_energy, .count = 7,
         .arguments =
          {PLAN, {INPUT, flight_phases, WHOLE(OF(flight_phase), of_flight)}, {INPUT, &flown, WHOLE(OF(flight), 1)},
           INSTANTS, {OUTPUT, NULL, WHOLE(OF(energy), TIMES)}, {OUTPUT, NULL, WHOLE(OF(flight_ledger), TIMES)},
           COLUMN(TIMES)}},
        {.name = "touchdown", .call = touchdown, .count = 2, .fine = HOPFORM_CONTACT_TOUCHDOWN,
         .arguments =
          {{SMALL, &detector, WHOLE(OF(detector), 1)}, {CONTACT, &contact, WHOLE(OF(contact), 1)}}},
    };
    for (size_t n = 0; n < sizeof entries / sizeof entries[0]; n++) {
        check(&entries[n]);
    }
}

/* ---- how they are called ---- */

static int is_output(const argument *a)
{
    return a->is_for != INPUT && a->is_for != SMALL && a->is_for != OPTIONAL && a->is_for != STEPPED;
}

/* Each argument in memory of its own: what is read as given, what is written poisoned. */
static void separate(const entry *of, int set, void **at)
{
    for (size_t k = 0; k < of->count; k++) {
        const argument *a = &of->arguments[k];
        at[k] = memory[set][k];
        if (a->given != NULL) {
            memcpy(at[k], a->given, a->size * a->count);
        } else {
            memset(at[k], POISON, a->size * a->count);
        }
    }
}

static int is_all(const unsigned char *bytes, size_t count, int value)
{
    for (size_t n = 0; n < count; n++) {
        if (bytes[n] != value) {
            return 0;
        }
    }
    return 1;
}

static int is_safe_command(const OF(command) * command)
{
    return !(command->u > 0.0f || command->u < 0.0f) && command->u <= 0.0f
           && !(command->apex > 0.0f || command->apex < 0.0f) && command->apex <= 0.0f
           && command->status == HOPFORM_COMMAND_NO_TAKEOFF;
}

/* Whether an output is safe after a refusal. */
static int is_safe(const argument *a, void *at)
{
    OF(command) command = {1.0f, 1.0f, 0};
    switch (a->is_for) {
    case OUTPUT:
        for (size_t n = 0; n < a->count; n++) {
            if (!is_all((const unsigned char *)at + n * a->size, a->payload, 0)) {
                return 0;
            }
        }
        return 1;
    case COMMAND:
        return is_safe_command((const OF(command) *)at);
    case SEARCH:
    case STEPPED:
        return OF(choose_current_step)((OF(search) *)at, work, CAPACITY, &command) < 0 && is_safe_command(&command);
    case CONTACT:
        return memcmp(at, a->given, a->size) == 0;
    case INPUT:
    case SMALL:
    case OPTIONAL:
    case BUFFER:
    default:
        return 1;
    }
}

static int is_same(const argument *a, const void *one, const void *other)
{
    for (size_t n = 0; n < a->written; n++) {
        if (memcmp((const unsigned char *)one + n * a->size, (const unsigned char *)other + n * a->size, a->payload)
            != 0) {
            return 0;
        }
    }
    return 1;
}

/* ---- NULL ---- */

static void no_pointer(const entry *of)
{
    for (uint32_t mask = 0; mask < 1u << of->count; mask++) {
        void *at[MOST];
        int32_t expected = of->fine;
        separate(of, 0, at);
        for (size_t k = 0; k < of->count; k++) {
            if ((mask >> k & 1u) != 0) {
                at[k] = NULL;
                expected = of->arguments[k].is_for == OPTIONAL ? expected : HOPFORM_ERROR_NULL;
            }
        }
        expected = mask == of->absent || (mask & ~of->optional) == 0 ? of->fine : expected;
        const int32_t status = of->call(at);
        holds(status == expected, of->name, "mask of NULL, status", (int32_t)mask, status);
        for (size_t k = 0; expected < 0 && k < of->count; k++) {
            if (at[k] != NULL) {
                holds(is_safe(&of->arguments[k], at[k]), of->name, "mask of NULL, output not safe", (int32_t)mask,
                      (int32_t)k);
            }
        }
    }
}

/* ---- overlap ---- */

/* Input k so many bytes behind the beginning of output m, all else in memory of its own. */
static void place(const entry *of, size_t k, size_t m, ptrdiff_t offset, void **at)
{
    const argument *input = &of->arguments[k], *output = &of->arguments[m];
    unsigned char *host = (unsigned char *)arena + ROOM;
    separate(of, 0, at);
    memcpy(host, at[m], output->size * output->count);
    memcpy(host + offset, input->given, input->size * input->count);
    at[m] = host;
    at[k] = host + offset;
}

/* A small input lies in an output: the answer is that of the same bytes in separate memory. */
static void small(const entry *of, size_t k, size_t m)
{
    void *at[MOST], *apart[MOST];
    separate(of, 1, apart);
    place(of, k, m, 0, at);
    memcpy(reference, at[m], of->arguments[m].size * of->arguments[m].count);
    apart[m] = reference;
    const int32_t fine = of->call(apart);
    const OF(command) outcome_apart = outcome;
    holds(of->call(at) == fine, of->name, "a small input in an output, status", (int32_t)k, (int32_t)m);
    for (size_t n = 0; n < of->count; n++) {
        holds(!is_output(&of->arguments[n]) || is_same(&of->arguments[n], at[n], apart[n]), of->name,
              "a small input in an output changes the answer", (int32_t)k, (int32_t)n);
    }
    holds(memcmp(&outcome, &outcome_apart, offsetof(OF(command), status)) == 0, of->name,
          "a small input in an output changes the outcome", (int32_t)k, (int32_t)m);
}

/* A call with another input in an output, one argument NULL if that is `absent`: it is refused, the input is as it was,
 * and every output that does not lie in it is safe. A search ends. */
static void refused(const entry *of, size_t k, size_t m, ptrdiff_t offset, size_t absent)
{
    const argument *input = &of->arguments[k];
    void *at[MOST];
    place(of, k, m, offset, at);
    const void *inside = at[k];
    if (absent < of->count) {
        at[absent] = NULL;
    }
    const int32_t status = of->call(at);
    holds(absent < of->count ? status < 0 : status == HOPFORM_ERROR_OVERLAP, of->name, "overlap is not refused",
          (int32_t)k, (int32_t)m);
    holds(input->is_for == STEPPED || memcmp(inside, input->given, input->size * input->count) == 0, of->name,
          "a refusal writes to an input", (int32_t)k, (int32_t)m);
    for (size_t n = 0; n < of->count; n++) {
        holds(n == m || at[n] == NULL || is_safe(&of->arguments[n], at[n]), of->name, "overlap, output not safe",
              (int32_t)m, (int32_t)n);
    }
}

/* An input in each place: at both ends of an output, over one number, and next to it, where it is none of its. */
static void overlaps(const entry *of)
{
    for (size_t k = 0; k < of->count; k++) {
        for (size_t m = 0; m < of->count; m++) {
            const argument *input = &of->arguments[k], *output = &of->arguments[m];
            if (is_output(input) || !is_output(output)) {
                continue;
            }
            if (input->is_for == SMALL || input->is_for == OPTIONAL) {
                small(of, k, m);
                continue;
            }
            const ptrdiff_t step = (ptrdiff_t)(input->is_for == STEPPED ? sizeof(void *) : sizeof(real));
            const ptrdiff_t behind = ((ptrdiff_t)(output->size * output->count) + step - 1) / step * step;
            const ptrdiff_t before = -(ptrdiff_t)(input->size * input->count);
            void *at[MOST];
            refused(of, k, m, 0, MOST);
            refused(of, k, m, behind - step, MOST);
            refused(of, k, m, before + step, MOST);
            for (size_t n = 0; n < of->count; n++) {
                if (n != k && n != m && of->arguments[n].is_for != OPTIONAL) {
                    refused(of, k, m, 0, n);
                }
            }
            place(of, k, m, behind, at);
            holds(of->call(at) == of->fine, of->name, "an input behind an output", (int32_t)k, (int32_t)m);
            place(of, k, m, before, at);
            holds(of->call(at) == of->fine, of->name, "an input before an output", (int32_t)k, (int32_t)m);
        }
    }
}

/* The plan of a search lies where a step of it writes: it is no argument, but it is read. */
static void plan_of_a_search(void)
{
    OF(plan) *const within = (OF(plan) *)arena;
    for (int n = 0; n < 3; n++) { /* the command in it, the same and no phases, the phases in it */
        OF(search) search;
        OF(command) command, *const told = n < 2 ? (OF(command) *)arena : &command;
        *within = plan;
        holds(OF(choose_current_begin)(&search, within, &start, &target, &command) == HOPFORM_SEARCHING,
              "choose_current_step", "begin", n, 0);
        holds(OF(choose_current_step)(&search, n == 0 ? work : (n == 1 ? NULL : (OF(phase) *)arena), CAPACITY, told)
                  == HOPFORM_ERROR_OVERLAP,
              "choose_current_step", "the plan of a search", n, 0);
        holds(memcmp(within, &plan, offsetof(OF(plan), made)) == 0, "choose_current_step", "the plan is written", n, 0);
        holds(OF(choose_current_step)(&search, work, CAPACITY, &command) < 0 && is_safe_command(&command),
              "choose_current_step", "the search goes on", n, 0);
    }
}

/* A report, or its phases, that lies in the plant: neither is written. */
static void within_a_plant(void)
{
    OF(plant) *const host = (OF(plant) *)arena;
    OF(report) report;
    const size_t size = offsetof(OF(plant), begins);
    for (int n = 0; n < 2; n++) {
        memcpy(host, &plant, sizeof plant);
        OF(report) *const told = n == 0 ? (OF(report) *)(void *)((unsigned char *)host + offsetof(OF(plant), state)) : &report;
        memset(&report, POISON, sizeof report);
        report.phases = (OF(phase) *)(void *)((unsigned char *)host + offsetof(OF(plant), state));
        report.capacity = 1;
        memcpy(reference, host, size);
        holds(OF(plant_step)(host, 1.0f, 0.01f, told) == HOPFORM_ERROR_OVERLAP, "plant_step", "overlap", n, 0);
        holds(memcmp(host, reference, size) == 0, "plant_step", "a refusal writes to the plant", n, 0);
    }
    holds(is_all((unsigned char *)&report, offsetof(OF(report), capacity), 0), "plant_step", "report not safe", 0, 0);
}

/* An output that has no other, and one ledger without its losses. */
static void others(void)
{
    OF(ledger) ledgers[TIMES];
    OF(energy) energies[TIMES];
    real losses[TIMES];
    memset(ledgers, POISON, sizeof ledgers);
    memset(energies, POISON, sizeof energies);
    memset(losses, POISON, sizeof losses);
    holds(OF(stance_energy)(&plan, steps, phases, &solved, times, TIMES, energies, ledgers, NULL) == HOPFORM_ERROR_NULL,
          "stance_energy", "ledgers without losses", 0, 0);
    holds(is_all((unsigned char *)ledgers, sizeof ledgers, 0) && is_all((unsigned char *)energies, sizeof energies, 0),
          "stance_energy", "ledgers without losses, not safe", 0, 0);
    memset(energies, POISON, sizeof energies);
    holds(OF(stance_energy)(&plan, steps, phases, &solved, times, TIMES, energies, NULL, losses) == HOPFORM_ERROR_NULL,
          "stance_energy", "losses without ledgers", 0, 0);
    holds(is_all((unsigned char *)losses, sizeof losses, 0) && is_all((unsigned char *)energies, sizeof energies, 0),
          "stance_energy", "losses without ledgers, not safe", 0, 0);
    OF(plan) again = plan;
    holds(OF(plan_init)(&again, NULL) == HOPFORM_ERROR_NULL, "plan_init", "no robot", 0, 0);
    OF(stance) stance;
    holds(OF(solve_stance)(&again, &start, steps, 2, 2.0f, CAPACITY, work, CAPACITY, &stance) == HOPFORM_ERROR_ROBOT,
          "plan_init", "the plan before it lives on", 0, 0);
    static const struct {
        int search;
        int buffer;
    } some[] = {{0, 0}, {0, 1}, {1, 0}};
    for (int n = 0; n < 3; n++) {
        holds(OF(selftest)(some[n].search ? &begun : NULL, some[n].buffer ? work : NULL, HOPFORM_SELFTEST_PHASES) == 0,
              "selftest", "NULL", n, 0);
    }
}

int main(void)
{
    OF(command) command;
    const int32_t made = OF(plan_init)(&plan, &sound);
    const int32_t stance = OF(solve_stance)(&plan, &start, steps, 2, 2.0f, CAPACITY, phases, CAPACITY, &solved);
    const int32_t flight = OF(solve_flight)(&plan, &away, 0, &law, 2.0f, CAPACITY, flight_phases, CAPACITY, &flown);
    memset(&begun, 0, sizeof begun);
    holds(OF(plant_begin)(&plant, &sound, &coordinates) == HOPFORM_OK, "plant_begin", "a sound start", 0, 0);
    const int32_t search = OF(choose_current_begin)(&begun, &plan, &start, &target, &command);
    holds(made == HOPFORM_OK && stance == HOPFORM_OK && flight == HOPFORM_OK && search == HOPFORM_SEARCHING, "contract",
          "what is read", stance, flight);
    each(no_pointer);
    each(overlaps);
    plan_of_a_search();
    within_a_plant();
    others();
    board_number(checks);
    board_text(" checks, wrong ");
    board_number(wrong);
    board_text("\n");
    board_exit(wrong > 0);
    return wrong > 0;
}
