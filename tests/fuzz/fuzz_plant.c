/* A libFuzzer target: starts and plants, on arbitrary bit patterns; -DSINGLE in single precision.
 *
 * The bytes become numbers as they are or, by the first one, of a sensible size. A start that is taken must come back, a
 * tick must leave a plant that is finite and the next one takes, and its time must have passed. Some plants are memory
 * that holds anything behind a plan.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "source.h"

enum { MOST_HALF_TURNS = 100, TICKS = 6 };

static T(phase) phases[MAX_PHASES];

static int is_finite_state(const T(state) *state)
{
    return isfinite(state->x1) && isfinite(state->v1) && isfinite(state->v2) && isfinite(state->y);
}

static T(start) next_start(source *from, int sensible)
{
    T(start) start;
    start.x1 = sensible ? 0 : next_real(from, 0, 0);
    start.v1 = next_real(from, sensible, 0);
    start.x2 = next_real(from, sensible, 0);
    start.v2 = next_real(from, sensible, 0);
    return start;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    source from = {data, size};
    const int kind = next_byte(&from), sensible = kind & 1;
    const T(robot) robot = next_robot(&from, kind);
    const T(start) start = next_start(&from, sensible);
    T(plant) plant;
    T(start) back;
    if (T(plant_begin)(&plant, &robot, &start) < 0) {
        must(plant.plan.made == 0);
        return 0;
    }
    must(is_finite_state(&plant.state));
    must(T(start_of_state)(&plant.plan, &plant.state, &back) == HOPFORM_OK);
    if (kind & 64) { /* whatever the memory held */
        plant.mode = (int8_t)next_byte(&from);
        plant.begins = (int8_t)(next_byte(&from) & 1);
        plant.from_lower = next_real(&from, 0, 0);
        plant.rounding = next_real(&from, 0, 0);
        plant.largest_y = next_real(&from, 0, 0);
    }
    for (int n = 0; n < TICKS; n++) {
        const int8_t mode = plant.mode;
        const T(state) before = plant.state;
        const real passed = plant.fraction + plant.carry, u = next_real(&from, sensible, 0);
        const real dt = bounded(next_real(&from, sensible, 1), &robot, MOST_HALF_TURNS);
        const uint32_t seconds = plant.seconds;
        T(report) report = {.phases = phases, .capacity = kind & 32 ? MAX_PHASES : 0};
        const int32_t status = T(plant_step)(&plant, u, dt, &report);
        if (status < 0) {
            must(plant.mode == mode && memcmp(&plant.state, &before, sizeof before) == 0 && report.count == 0);
            continue;
        }
        must(is_finite_state(&plant.state) && plant.mode >= 0 && plant.mode <= 8 && report.count >= 0);
        must(isfinite(report.start.x2) && report.event_count <= report.count);
        const int over = report.ending == HOPFORM_ENDING_HORIZON || report.ending == HOPFORM_ENDING_REST;
        must(report.duration >= 0 && report.duration <= dt && (!over || !(report.duration < dt)));
        must(plant.seconds > seconds || plant.fraction + plant.carry >= passed);
    }
    return 0;
}
