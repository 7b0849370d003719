/* Instructions of a servo under its law, in the form of costs.c's lines: moves of one mass to targets near and far, so
 * that its current is within its limit and at it. */
#include <stddef.h>

#include "board.h"
#include "hopform/hopform.h"

#define OF(name) hopform_##name##_f32

enum { CAPACITY = 32, TARGETS = 9 };
static OF(phase) phases[CAPACITY];

/* Inertia, friction and gains of the servo as it ships, with friction at rest and stops. */
static const OF(robot) servo = {.J = 0.031f, .b = 0.0085f, .F_p = 0.042f, .F_m = 0.042f, .F_sp = 0.02f, .F_sm = 0.02f,
                                .k_t = 0.1f, .K_p = 8.0f, .K_d = 0.9f, .load = 0.0f, .q_min = -1.0f, .q_max = 1.0f,
                                .i_max = 10.0f};
static const float targets[TARGETS] = {-0.8f, -0.4f, -0.1f, -0.05f, 0.02f, 0.07f, 0.2f, 0.5f, 0.9f};

static uint32_t instructions_of(uint32_t counts, uint32_t overhead)
{
    return (uint32_t)((float)(counts > overhead ? counts - overhead : 0) * 1000.0f / (float)board_counts_of_1000());
}

static void print(const char *name, int32_t count, float sum, uint32_t most)
{
    board_text(name);
    board_text(" law ");
    board_number(count);
    board_text(" ");
    board_number((int32_t)(sum / (float)count));
    board_text(" ");
    board_number((int32_t)most);
    board_text(" ");
    board_number((int32_t)board_used_stack());
    board_text("\n");
}

int main(void)
{
    OF(plan) plan;
    int32_t phase_count = 0;
    float sum = 0.0f;
    uint32_t most = 0, most_a_phase = 0, overhead;
    board_start_counter();
    overhead = board_counter();
    overhead = board_counter() - overhead;
    int wrong = OF(plan_init)(&plan, &servo) != HOPFORM_OK;
    board_paint_stack();
    for (int n = 0; n < TARGETS; n++) {
        const OF(state) start = {0.0f, 0.0f, 0.0f, 0.0f};
        const OF(step) step = {0.0f, targets[n]};
        OF(stance) motion;
        board_start_counter();
        const uint32_t before = board_counter();
        wrong += OF(solve_stance)(&plan, &start, &step, 1, 2.0f, CAPACITY, phases, CAPACITY, &motion) != HOPFORM_OK;
        const uint32_t took = instructions_of(board_counter() - before, overhead);
        const uint32_t a_phase = took / (uint32_t)motion.phase_count;
        sum += (float)took;
        phase_count += motion.phase_count;
        most = took > most ? took : most;
        most_a_phase = a_phase > most_a_phase ? a_phase : most_a_phase;
    }
    print("solve_stance", TARGETS, sum, most);
    print("phase_of_stance", phase_count, sum, most_a_phase);
    board_exit(wrong);
    return wrong;
}
