/* A libFuzzer target: the C entry points on arbitrary bit patterns.
 *
 * -DENTRY=n picks what is called (1 hopform_plan_init, 2 hopform_solve_stance, 3 hopform_stance_at, 4
 * hopform_stance_energy, hopform_stance_compression), -DSINGLE single precision, -DDESCRIBE prints what the bytes
 * mean. The bytes become numbers as they are, or, by the first byte, numbers of a sensible size, so that the solver is
 * entered and not only its gate. An answer that is not finite, or not within its own bounds, aborts.
 *
 * Without friction a stance is followed half turn by half turn, and the quotient of two arbitrary numbers makes a
 * horizon of 1e7 half turns of the stiffest oscillation, which takes seconds and finds nothing that the first ones do
 * not. So a horizon is cut to MOST_HALF_TURNS of them, and there are never more than MAX_PHASES phases: an input takes
 * milliseconds.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "source.h"

enum { STEPS = 2, MOST_HALF_TURNS = 300 };

/* The numbers of a finding, robot first. */
static void describe(const char *what, const void *numbers, size_t bytes)
{
#ifdef DESCRIBE
    const real *values = numbers;
    fprintf(stderr, "%s:", what);
    for (size_t i = 0; i < bytes / sizeof(real); i++) {
        fprintf(stderr, " %.17g", (double)values[i]);
    }
    fprintf(stderr, "\n");
#else
    (void)what;
    (void)numbers;
    (void)bytes;
#endif
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    source from = {data, size};
    const int kind = next_byte(&from), sensible = kind & 1;
    const T(robot) robot = next_robot(&from, kind);
    T(plan) plan;
    describe("robot", &robot, sizeof robot);
    if (T(plan_init)(&plan, &robot) < 0 || ENTRY == 1) {
        return 0;
    }
    T(state) start;
    start.x1 = sensible ? 0 : next_real(&from, 0, 0);
    start.v1 = next_real(&from, sensible, 0);
    start.v2 = next_real(&from, sensible, 0);
    start.y = sensible && (kind & 4) ? 0 : (real)(sensible ? next_real(&from, 1, 1) : next_real(&from, 0, 0));
    const T(step) steps[STEPS] = {{0, next_real(&from, sensible, 0)},
                                  {next_real(&from, sensible, 1), next_real(&from, sensible, 0)}};
    const int32_t step_count = kind & 8 ? 2 : 1, max_phases = 1 + next_byte(&from) % MAX_PHASES;
    const int32_t capacity = kind & 16 ? next_byte(&from) % MAX_PHASES : MAX_PHASES + 1;
    const real horizon = bounded(next_real(&from, sensible, 1), &robot, MOST_HALF_TURNS);
    T(phase) phases[MAX_PHASES + 1];
    describe("x1 v1 v2 y", &start, sizeof start);
    describe("t u t u", steps, sizeof steps);
    describe("horizon", &horizon, sizeof horizon);
    T(stance) stance;
    const int32_t status =
        T(solve_stance)(&plan, &start, steps, step_count, horizon, max_phases, phases, capacity, &stance);
    if (status < 0) {
        return 0;
    }
    must(isfinite(stance.duration) && isfinite(stance.end.x1) && isfinite(stance.end.v1) && isfinite(stance.end.v2));
    must(isfinite(stance.end.y) && isfinite(stance.apex) && isfinite(stance.aed) && stance.start_loss <= 0);
    must(stance.duration >= 0 && stance.duration <= horizon);
    must(stance.ending >= 1 && stance.ending <= HOPFORM_ENDING_UNCERTIFIED);
    must(stance.phases_kept <= capacity && stance.phase_count <= max_phases && stance.phase_count >= 1);
    must((status == HOPFORM_PHASES_NOT_KEPT) == (stance.phases_kept < stance.phase_count));
    for (int32_t n = 0; n < stance.phases_kept; n++) {
        must(phases[n].mode >= 0 && phases[n].mode < 9 && phases[n].step < step_count);
        must(n == 0 || phases[n].t >= phases[n - 1].t);
    }
    const real times[2] = {kind & 32 ? next_real(&from, 0, 0) : stance.duration / 3, stance.duration};
    if (ENTRY == 3) {
        T(state) state;
        T(stance_at)(&plan, steps, phases, &stance, times[0], &state);
        T(stance_at)(&plan, steps, phases, &stance, times[1], &state);
    }
    if (ENTRY == 4) {
        T(energy) energies[2];
        T(ledger) ledgers[2];
        real losses[2];
        T(stance_energy)(&plan, steps, phases, &stance, times, 2, energies, ledgers, losses);
        real most;
        const int32_t read = T(stance_compression)(&plan, steps, phases, &stance, &most);
        must(isfinite(most) && (read < 0 || (most >= start.y && most >= stance.end.y)));
    }
    return 0;
}
