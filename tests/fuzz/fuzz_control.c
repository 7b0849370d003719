/* A libFuzzer target: the controller and the trials of a map on arbitrary bit patterns, -DSINGLE in single precision.
 *
 * The bytes become numbers as they are or, by the first one, of a sensible size, so that the search is entered and not
 * only its gate. A command that is not finite, above u_max, or other than u = 0 beside an error, aborts. The search is
 * also left after any of its steps. A horizon is cut to MOST_HALF_TURNS, the search to MOST_STEPS stances: an input
 * takes milliseconds.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "source.h"

enum { MOST_STEPS = 4, MOST_HALF_TURNS = 30, CURRENTS = 3 };

static void must_be_safe(const T(command) *command, int32_t status, const T(robot) *robot)
{
    must(isfinite(command->u) && isfinite(command->apex));
    if (status < 0) {
        must(command->u == 0 && command->status == HOPFORM_COMMAND_NO_TAKEOFF);
        return;
    }
    must(status == HOPFORM_SEARCHING || status == HOPFORM_OK || status == HOPFORM_PHASES_NOT_KEPT
         || status == HOPFORM_CAPPED);
    must(fabs(command->u) <= robot->u_max);
    must(command->status == HOPFORM_COMMAND_REACHED || command->status == HOPFORM_COMMAND_NEAREST
         || (command->status == HOPFORM_COMMAND_NO_TAKEOFF && command->u == 0));
}

static void try_some(source *from, const T(plan) *plan, const T(state) *start, real horizon, int sensible,
                     int32_t capacity)
{
    T(phase) phases[MAX_PHASES];
    T(trial) trials[CURRENTS];
    real currents[CURRENTS];
    for (int i = 0; i < CURRENTS; i++) {
        currents[i] = next_real(from, sensible, 0);
    }
    if (T(try_currents)(plan, start, 1, currents, CURRENTS, horizon, phases, capacity, trials) < 0) {
        return;
    }
    for (int i = 0; i < CURRENTS; i++) {
        must(isfinite(trials[i].u) && isfinite(trials[i].apex) && isfinite(trials[i].largest_x1));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    source from = {data, size};
    const int kind = next_byte(&from), sensible = kind & 1;
    const T(robot) robot = next_robot(&from, kind);
    T(plan) plan;
    const int made = T(plan_init)(&plan, &robot) >= 0;
    T(state) start;
    start.x1 = sensible ? 0 : next_real(&from, 0, 0);
    start.v1 = next_real(&from, sensible, 0);
    start.v2 = next_real(&from, sensible, 0);
    start.y = kind & 4 ? 0 : next_real(&from, sensible, 1);
    T(target) target = {0};
    target.h_des = next_real(&from, sensible, 1);
    target.datum = kind & 8 ? 0 : next_real(&from, sensible, 0);
    target.stop_margin = kind & 16 ? 0 : next_real(&from, sensible, 1);
    target.horizon =
        made ? bounded(next_real(&from, sensible, 1), &robot, MOST_HALF_TURNS) : next_real(&from, sensible, 1);
    const int32_t capacity = 1 + next_byte(&from) % MAX_PHASES, steps = next_byte(&from) % MOST_STEPS;
    T(phase) phases[MAX_PHASES];
    T(search) search;
    T(command) command;
    int32_t status = T(choose_current_begin)(&search, &plan, &start, &target, &command);
    must_be_safe(&command, status, &robot);
    must(made || status < 0);
    for (int n = 0; n < steps && status == HOPFORM_SEARCHING; n++) {
        status = T(choose_current_step)(&search, phases, capacity, &command);
        must_be_safe(&command, status, &robot);
    }
    try_some(&from, &plan, &start, target.horizon, sensible, capacity);
    return 0;
}
