/* Instructions and painted stack of a model without a contact, in the form of costs.c's lines: moves of a joint on its
 * spring under currents, or, with -DSERVO, of a servo to targets near and far, so that its current is within its limit
 * and at it. A tick is a millisecond of the same moves. */
#include <stddef.h>

#include "board.h"
#include "hopform/hopform.h"

#define OF(name) hopform_##name##_f32

enum { CAPACITY = 32, MOVES = 9, TIMES = 8, TICKS = 200 };
static OF(phase) phases[CAPACITY];

/* Inertia, friction and gains as the models ship, with friction at rest and stops. */
#ifdef SERVO
#define SET "servo"
static const OF(robot) robot = {.J = 0.031f, .b = 0.0085f, .F_p = 0.042f, .F_m = 0.042f, .F_sp = 0.02f, .F_sm = 0.02f,
                                .k_t = 0.1f, .K_p = 8.0f, .K_d = 0.9f, .load = 0.0f, .q_min = -1.0f, .q_max = 1.0f,
                                .i_max = 10.0f};
static const float inputs[MOVES] = {-0.8f, -0.4f, -0.1f, -0.05f, 0.02f, 0.07f, 0.2f, 0.5f, 0.9f}; /* [rad] */
static const OF(start) start = {0.0f, 0.0f};
#else
#define SET "joint"
static const OF(robot) robot = {.J = 0.031f, .k = 1.5f, .q_0 = 0.1f, .b = 0.0085f, .F_p = 0.042f, .F_m = 0.042f,
                                .F_sp = 0.02f, .F_sm = 0.02f, .k_t = 0.1f, .load = 0.0f, .q_min = -1.0f, .q_max = 1.0f,
                                .i_max = 10.0f};
static const float inputs[MOVES] = {-8.0f, -4.0f, -2.0f, -0.5f, 0.0f, 0.5f, 2.0f, 4.0f, 8.0f}; /* [A] */
static const OF(start) start = {0.5f, 0.0f};
#endif

typedef struct {
    const char *name;
    int32_t calls;
    uint32_t most;
    uint32_t stack;
    float sum;
} tally;

static uint32_t counts_of_1000;
static uint32_t overhead;

static uint32_t instructions_since(uint32_t before)
{
    const uint32_t counts = board_counter() - before;
    return (uint32_t)((float)(counts > overhead ? counts - overhead : 0) * 1000.0f / (float)counts_of_1000);
}

static void add(tally *to, uint32_t instructions, int32_t calls)
{
    const uint32_t each = instructions / (uint32_t)calls;
    to->calls += calls;
    to->sum += (float)instructions;
    to->most = each > to->most ? each : to->most;
}

#define COUNTED(what, call)                                  \
    do {                                                     \
        board_start_counter();                               \
        const uint32_t before = board_counter();             \
        wrong += (call) < 0;                                 \
        add(&(what), instructions_since(before), 1);         \
    } while (0)

/* The same, and what it takes of the stack. */
#define PAINTED(what, call)                                  \
    do {                                                     \
        board_paint_stack();                                 \
        COUNTED(what, call);                                 \
        note_stack(&(what));                                 \
    } while (0)

static void note_stack(tally *of)
{
    const uint32_t used = board_used_stack();
    of->stack = used > of->stack ? used : of->stack;
}

static void print_tally(const tally *of)
{
    board_text(of->name);
    board_text(" " SET " ");
    board_number(of->calls);
    board_text(" ");
    board_number((int32_t)(of->sum / (float)of->calls));
    board_text(" ");
    board_number((int32_t)of->most);
    board_text(" ");
    board_number((int32_t)of->stack);
    board_text("\n");
}

#define SIZEOF(name)                                         \
    do {                                                     \
        board_text("sizeof " SET "_" #name " ");            \
        board_number((int32_t)sizeof(OF(name)));             \
        board_text("\n");                                    \
    } while (0)

int main(void)
{
    tally init = {"plan_init", 0, 0, 0, 0.0f}, solve = {"solve_motion", 0, 0, 0, 0.0f};
    tally phase = {"phase_of_motion", 0, 0, 0, 0.0f}, at = {"motion_at", 0, 0, 0, 0.0f};
    tally tick = {"plant_step", 0, 0, 0, 0.0f};
    int wrong = 0;
    board_start_counter();
    overhead = board_counter();
    overhead = board_counter() - overhead;
    counts_of_1000 = board_counts_of_1000();
    for (int n = 0; n < MOVES; n++) {
        const OF(step) step = {0.0f, inputs[n]};
        OF(plan) plan;
        OF(state) state;
        OF(motion) motion;
        OF(plant) plant;
        OF(report) report = {.phases = phases, .capacity = CAPACITY};
        PAINTED(init, OF(plan_init)(&plan, &robot));
        wrong += OF(state_of_start)(&plan, &start, &state) < 0;
        const float sum = solve.sum;
        PAINTED(solve, OF(solve_motion)(&plan, &state, &step, 1, 2.0f, CAPACITY, phases, CAPACITY, &motion));
        add(&phase, (uint32_t)(solve.sum - sum), motion.phase_count);
        phase.stack = solve.stack;
        for (int i = 0; i < TIMES; i++) {
            PAINTED(at, OF(motion_at)(&plan, &step, phases, &motion, motion.duration * ((float)i / (float)TIMES), &state));
        }
        wrong += OF(plant_begin)(&plant, &robot, &start) < 0;
        PAINTED(tick, OF(plant_step)(&plant, inputs[n], 0.001f, &report));
        for (int i = 1; i < TICKS; i++) { COUNTED(tick, OF(plant_step)(&plant, inputs[n], 0.001f, &report)); }
        note_stack(&tick);
    }
    const tally *const all[] = {&init, &solve, &phase, &at, &tick};
    for (int n = 0; n < 5; n++) { print_tally(all[n]); }
    SIZEOF(robot);
    SIZEOF(plan);
    SIZEOF(motion);
    SIZEOF(phase);
    SIZEOF(plant);
    board_exit(wrong);
    return wrong;
}
