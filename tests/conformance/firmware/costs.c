/* Instructions and painted stack of each call, over a stated set: what the selftest solves, which visits every mode;
 * drops of both hoppers; drops of a robot of each regime of its poles; the flights of a run of hops.
 *
 * A line is `name set count mean max stack`; instructions as counted by the machine, less those of counting.
 */
#include <stddef.h>

#include "board.h"
#include "cost_cases.h"
#include "hopform/hopform.h"

#define OF(name) hopform_##name##_f32

enum { CAPACITY = 32, GRID = 64 };
static OF(phase) phases[CAPACITY];
static OF(flight_phase) flight_phases[CAPACITY];
static OF(search) search;
static float columns[4][GRID];
static float *const rows[4] = {columns[0], columns[1], columns[2], columns[3]};
static uint32_t counts_of_1000;
static uint32_t overhead;

typedef struct {
    const char *name;
    uint32_t calls;
    uint32_t most;
    uint32_t stack;
    float sum;
} tally;

static void add(tally *to, uint32_t counts)
{
    const uint32_t instructions =
        (uint32_t)((float)(counts > overhead ? counts - overhead : 0) * 1000.0f / (float)counts_of_1000);
    to->calls++;
    to->sum += (float)instructions;
    to->most = instructions > to->most ? instructions : to->most;
}

/* The instructions of so many phases. */
static void add_phases(tally *to, float instructions, int32_t count)
{
    const uint32_t each = (uint32_t)(instructions / (float)count);
    to->calls += (uint32_t)count;
    to->sum += instructions;
    to->most = each > to->most ? each : to->most;
}

static void print_tally(const tally *of, const char *set)
{
    board_text(of->name);
    board_text(" ");
    board_text(set);
    board_text(" ");
    board_number((int32_t)of->calls);
    board_text(" ");
    board_number(of->calls > 0 ? (int32_t)(of->sum / (float)of->calls) : 0);
    board_text(" ");
    board_number((int32_t)of->most);
    board_text(" ");
    board_number((int32_t)of->stack);
    board_text("\n");
}

#define COUNTED(what, call)                                                   \
    do {                                                                      \
        board_start_counter();                                                \
        const uint32_t before = board_counter();                              \
        (void)(call);                                                         \
        add(&(what), board_counter() - before);                               \
    } while (0)

/* Once more, with the stack painted. */
#define PAINTED(what, call)                                                   \
    do {                                                                      \
        board_paint_stack();                                                  \
        (void)(call);                                                         \
        const uint32_t used = board_used_stack();                             \
        (what).stack = used > (what).stack ? used : (what).stack;             \
    } while (0)

static int32_t search_to_its_end(OF(command) *command)
{
    while (OF(choose_current_step)(&search, phases, CAPACITY, command) == HOPFORM_SEARCHING) {
    }
    return search.status;
}

static void measure(const cost_case *cases, int count, const char *set, int with_controller)
{
    tally init = {"plan_init", 0, 0, 0, 0.0f}, solve = {"solve_stance", 0, 0, 0, 0.0f},
          at = {"stance_at", 0, 0, 0, 0.0f};
    tally energy = {"stance_energy", 0, 0, 0, 0.0f}, grid = {"stance_grid_64", 0, 0, 0, 0.0f};
    tally choose = {"choose_current", 0, 0, 0, 0.0f}, begin = {"choose_current_begin", 0, 0, 0, 0.0f};
    tally reached = {"choose_current_reached", 0, 0, 0, 0.0f}, missed = {"choose_current_missed", 0, 0, 0, 0.0f};
    tally again = {"choose_current_near", 0, 0, 0, 0.0f};
    tally step_of = {"choose_current_step", 0, 0, 0, 0.0f}, flown = {"solve_flight", 0, 0, 0, 0.0f};
    for (int n = 0; n < count; n++) {
        const cost_case *c = &cases[n];
        OF(plan) plan;
        OF(stance) stance;
        OF(state) state;
        OF(energy) energies;
        OF(ledger) ledger;
        OF(flight) flight;
        float loss;
        const OF(robot) *robot = &cost_robots[c->robot];
        const OF(state) start = {c->x1, c->v1, c->v2, c->y};
        const OF(step) steps[] = {{0.0f, c->u}, {c->later, c->then}};
        const int32_t step_count = c->later < 100.0f ? 2 : 1;
        COUNTED(init, OF(plan_init)(&plan, robot));
        PAINTED(init, OF(plan_init)(&plan, robot));
        COUNTED(solve,
                OF(solve_stance)(&plan, &start, steps, step_count, c->horizon, CAPACITY, phases, CAPACITY, &stance));
        PAINTED(solve,
                OF(solve_stance)(&plan, &start, steps, step_count, c->horizon, CAPACITY, phases, CAPACITY, &stance));
        for (int i = 0; i < 8; i++) {
            const float t = stance.duration * ((float)i * 0.125f);
            COUNTED(at, OF(stance_at)(&plan, steps, phases, &stance, t, &state));
            PAINTED(at, OF(stance_at)(&plan, steps, phases, &stance, t, &state));
        }
        const float end = stance.duration;
        COUNTED(energy, OF(stance_energy)(&plan, steps, phases, &stance, &end, 1, &energies, &ledger, &loss));
        PAINTED(energy, OF(stance_energy)(&plan, steps, phases, &stance, &end, 1, &energies, &ledger, &loss));
        if (end > 0.0f) {
            const float dt = end / (float)GRID;
            COUNTED(grid, OF(stance_grid)(&plan, steps, phases, &stance, 0.0f, dt, GRID, rows));
            PAINTED(grid, OF(stance_grid)(&plan, steps, phases, &stance, 0.0f, dt, GRID, rows));
        }
        if (!with_controller && stance.ending == HOPFORM_ENDING_TAKEOFF) {
            OF(state) away = stance.end;
            away.y = 0.0f;
            COUNTED(flown, OF(solve_flight)(&plan, &away, 0, NULL, 2.0f, CAPACITY, flight_phases, CAPACITY, &flight));
            PAINTED(flown, OF(solve_flight)(&plan, &away, 0, NULL, 2.0f, CAPACITY, flight_phases, CAPACITY, &flight));
        }
        for (int i = 0; with_controller && i < 3; i++) {
            const OF(target) target = {0.05f + 0.05f * (float)i, 0.0f, 0.001f, 2.0f, 0, 0};
            OF(command) command;
            COUNTED(begin, OF(choose_current_begin)(&search, &plan, &start, &target, &command));
            PAINTED(begin, OF(choose_current_begin)(&search, &plan, &start, &target, &command));
            uint32_t counts = 0;
            for (int k = 0; k < HOPFORM_SEARCH_TRIALS && search.status == HOPFORM_SEARCHING; k++) {
                board_start_counter();
                const uint32_t before = board_counter();
                (void)OF(choose_current_step)(&search, phases, CAPACITY, &command);
                const uint32_t took = board_counter() - before;
                add(&step_of, took);
                counts += took > overhead ? took - overhead : 0;
            }
            add(&choose, counts + overhead);
            add(command.status == HOPFORM_COMMAND_REACHED ? &reached : &missed, counts + overhead);
            PAINTED(choose, OF(choose_current)(&search, &plan, &start, &target, phases, CAPACITY, &command));
            if (command.status == HOPFORM_COMMAND_REACHED) { /* and at the next touchdown, 1 % faster */
                const float last = command.u;
                const OF(state) next = {c->x1, c->v1, 1.01f * c->v2, c->y};
                (void)OF(choose_current_begin)(&search, &plan, &next, &target, &command);
                (void)OF(choose_current_near)(&search, last);
                COUNTED(again, search_to_its_end(&command));
                PAINTED(again, OF(choose_current)(&search, &plan, &next, &target, phases, CAPACITY, &command));
            }
        }
    }
    step_of.stack = choose.stack;
    reached.stack = choose.stack;
    missed.stack = choose.stack;
    const tally *all[] = {&init, &solve, &at, &energy, &grid, &flown, &begin, &step_of, &choose, &reached, &missed,
                          &again};
    for (int n = 0; n < (int)(sizeof all / sizeof all[0]); n++) {
        if (all[n]->calls > 0) {
            print_tally(all[n], set);
        }
    }
}

/* Drops of a robot: a stance, and one phase of it on average. */
static void measure_regime(const cost_regime *of)
{
    tally solve = {"solve_stance", 0, 0, 0, 0.0f}, phase = {"phase_of_stance", 0, 0, 0, 0.0f};
    OF(plan) plan;
    (void)OF(plan_init)(&plan, &of->robot);
    for (int n = 0; n < (int)(sizeof cost_drops / sizeof cost_drops[0]); n++) {
        const OF(state) start = {0.0f, 0.0f, cost_drops[n].v2, 0.0f};
        const OF(step) step = {0.0f, cost_drops[n].u};
        OF(stance) stance;
        const float before = solve.sum;
        COUNTED(solve, OF(solve_stance)(&plan, &start, &step, 1, 2.0f, CAPACITY, phases, CAPACITY, &stance));
        PAINTED(solve, OF(solve_stance)(&plan, &start, &step, 1, 2.0f, CAPACITY, phases, CAPACITY, &stance));
        add_phases(&phase, solve.sum - before, stance.phase_count);
    }
    phase.stack = solve.stack;
    print_tally(&solve, of->name);
    print_tally(&phase, of->name);
}

/* The flights of a run of hops: from take-offs with the actuator out and moving, back to where it stood. */
static void measure_hops(const OF(robot) *robot)
{
    tally flown = {"solve_flight", 0, 0, 0, 0.0f}, phase = {"phase_of_flight", 0, 0, 0, 0.0f};
    OF(plan) plan;
    (void)OF(plan_init)(&plan, robot);
    OF(state) start = {0.0f, 0.0f, -1.6721f, 0.0f}; /* from cost_hops[0], less the loss of the impact */
    for (int n = 0; n < (int)(sizeof cost_hops / sizeof cost_hops[0]); n++) {
        const OF(target) target = {cost_hops[n], 0.0f, 0.001f, 2.0f, 0, 0};
        OF(command) command;
        OF(stance) stance;
        OF(flight) flight;
        (void)OF(choose_current)(&search, &plan, &start, &target, phases, CAPACITY, &command);
        const OF(step) step = {0.0f, command.u};
        (void)OF(solve_stance)(&plan, &start, &step, 1, 2.0f, CAPACITY, phases, CAPACITY, &stance);
        OF(state) away = stance.end;
        away.y = 0.0f;
        const float before = flown.sum;
        COUNTED(flown, OF(solve_flight)(&plan, &away, 0, NULL, 2.0f, CAPACITY, flight_phases, CAPACITY, &flight));
        PAINTED(flown, OF(solve_flight)(&plan, &away, 0, NULL, 2.0f, CAPACITY, flight_phases, CAPACITY, &flight));
        add_phases(&phase, flown.sum - before, flight.phase_count);
        start = flight.end;
        start.v2 = flight.v2_after;
        start.y = 0.0f;
    }
    phase.stack = flown.stack;
    print_tally(&flown, "hops");
    print_tally(&phase, "hops");
}

static void size(const char *name, size_t bytes)
{
    board_text("sizeof ");
    board_text(name);
    board_text(" ");
    board_number((int32_t)bytes);
    board_text("\n");
}

int main(void)
{
    counts_of_1000 = board_counts_of_1000();
    board_start_counter();
    const uint32_t before = board_counter();
    overhead = board_counter() - before;
    measure(cost_cases_modes, (int)(sizeof cost_cases_modes / sizeof cost_cases_modes[0]), "modes", 0);
    measure(cost_cases_drops, (int)(sizeof cost_cases_drops / sizeof cost_cases_drops[0]), "drops", 1);
    for (int n = 0; n < (int)(sizeof cost_regimes / sizeof cost_regimes[0]); n++) {
        measure_regime(&cost_regimes[n]);
    }
    measure_hops(&cost_regimes[0].robot);
    size("robot", sizeof(OF(robot)));
    size("plan", sizeof(OF(plan)));
    size("stance", sizeof(OF(stance)));
    size("phase", sizeof(OF(phase)));
    size("flight", sizeof(OF(flight)));
    size("flight_phase", sizeof(OF(flight_phase)));
    size("search", sizeof(OF(search)));
    size("command", sizeof(OF(command)));
    board_exit(0);
    return 0;
}
