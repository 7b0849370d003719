/* What a search for a current costs at most by its caps: instructions, sought by an adversary over robots, states and
 * wishes. It draws them at random, and changes a little what has cost the most so far.
 *
 * A line is `evaluations candidates step command capped`: the caps, the most of a candidate, the most of a command, how
 * many commands met a cap.
 */
#include <math.h>
#include <stdbool.h>

#include "board.h"
#include "hopform/hopform.h"

#define OF(name) hopform_##name##_f32

enum { CAPACITY = 32, GENES = 18, ROUNDS = 500 };

static OF(phase) phases[CAPACITY];
static OF(search) search;
static uint32_t draws = 2463534242u;
static uint32_t counts_of_1000;

static float uniform(void)
{
    draws ^= draws << 13;
    draws ^= draws >> 17;
    draws ^= draws << 5;
    return (float)(draws >> 8) / 16777216.0f;
}

/* A number between two, evenly over the decades. */
static float over(float gene, float low, float high)
{
    return low * powf(high / low, gene);
}

/* The same, or 0. */
static float mostly(float gene, float low, float high)
{
    return gene < 0.2f ? 0.0f : over((gene - 0.2f) / 0.8f, low, high);
}

typedef struct {
    uint32_t step, command;
} cost;

/* What the search costs for a robot, a state and a wish that follow from numbers between 0 and 1. */
static cost cost_of(const float *gene, int32_t evaluations, int32_t candidates, int32_t *status)
{
    OF(robot) robot = {0};
    robot.m_s = over(gene[0], 0.3f, 10.0f);
    robot.m_eff = robot.m_s * over(gene[1], 0.01f, 30.0f);
    robot.k = over(gene[2], 100.0f, 1e5f);
    robot.L0 = 0.4f;
    robot.b1 = 2.0f * sqrtf(robot.k * robot.m_eff) * mostly(gene[3], 1e-4f, 10.0f);
    robot.b2 = 2.0f * sqrtf(robot.k * robot.m_s) * mostly(gene[4], 1e-4f, 1.0f);
    robot.f1 = mostly(gene[5], 0.01f, 10.0f);
    robot.f2 = mostly(gene[6], 0.01f, 3.0f);
    robot.u_max = 3.0f;
    robot.gamma2 = -robot.m_eff * over(gene[7], 0.1f, 30.0f);
    robot.g = 9.81f;
    robot.x1_min = -mostly(gene[8], 1e-3f, 0.1f);
    robot.x1_max = mostly(gene[9], 1e-3f, 0.1f) + 0.001f;
    const float at = gene[10] < 0.5f ? robot.x1_min : robot.x1_min + (robot.x1_max - robot.x1_min) * gene[11];
    const OF(state) start = {at, gene[12] < 0.5f ? 0.0f : 2.0f * gene[12] - 1.5f, -over(gene[13], 0.05f, 4.0f),
                             gene[14] < 0.8f ? 0.0f : over(gene[14] * 5.0f - 4.0f, 1e-4f, 0.1f)};
    const OF(target) target = {mostly(gene[15], 0.005f, 0.6f), 0.0f, 0.0f, over(gene[16], 0.5f, 4.0f), evaluations,
                               candidates};
    OF(plan) plan;
    OF(command) command;
    cost found = {0, 0};
    *status = OF(plan_init)(&plan, &robot);
    if (*status < 0) {
        return found;
    }
    *status = OF(choose_current_begin)(&search, &plan, &start, &target, &command);
    while (*status == HOPFORM_SEARCHING) {
        board_start_counter();
        const uint32_t before = board_counter();
        *status = OF(choose_current_step)(&search, phases, CAPACITY, &command);
        const uint32_t took = board_counter() - before;
        found.step = took > found.step ? took : found.step;
        found.command += took;
    }
    return found;
}

static int32_t instructions(uint32_t counts)
{
    return (int32_t)((double)counts * 1000.0 / (double)counts_of_1000);
}

static float worst[2][GENES]; /* the dearest candidate's, and the dearest command's: the next attack begins with them */

static void attack(int32_t evaluations, int32_t candidates)
{
    uint32_t most[2] = {0, 0};
    int32_t capped = 0;
    for (int n = 0; n < ROUNDS; n++) {
        float gene[GENES];
        const bool known = n < 2, climbs = n % 4 != 0; /* three of four change the worst so far */
        for (int i = 0; i < GENES; i++) {
            const float change = !known && uniform() < 0.3f ? 0.2f * (uniform() - 0.5f) : 0.0f;
            const float moved = known || climbs ? worst[n % 2][i] + change : uniform();
            gene[i] = moved < 0.0f ? 0.0f : (moved < 1.0f ? moved : 0.999f);
        }
        int32_t status = 0;
        const cost found = cost_of(gene, evaluations, candidates, &status);
        const uint32_t now[2] = {found.step, found.command};
        capped += status == HOPFORM_CAPPED ? 1 : 0;
        for (int which = 0; which < 2; which++) {
            if (now[which] > most[which]) {
                most[which] = now[which];
                for (int i = 0; i < GENES; i++) {
                    worst[which][i] = gene[i];
                }
            }
        }
    }
    const int32_t line[] = {evaluations, candidates, instructions(most[0]), instructions(most[1]), capped};
    for (int i = 0; i < 5; i++) {
        board_number(line[i]);
        board_text(i < 4 ? " " : "\n");
    }
}

int main(void)
{
    counts_of_1000 = board_counts_of_1000();
    attack(40, 24);
    attack(40, 6);
    attack(100, 24);
    attack(500, 24);
    board_exit(0);
    return 0;
}
