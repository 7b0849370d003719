/* A libFuzzer target: a batch on arbitrary bit patterns, -DSINGLE in single precision.
 *
 * A few robots and starts, with currents and velocities spread between two numbers each, are solved together and each as
 * a batch of one. Every bit of their answers must be the same. A horizon is cut to MOST_HALF_TURNS of the stiffest
 * oscillation: an input takes milliseconds.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "source.h"

enum { MOST_HALF_TURNS = 60, COUNT = 48, ROBOTS = 3, EVENTS = 6, RESULTS = 7 };

typedef struct {
    real robot[COUNT][ROBOT];
    real x1[COUNT], v1[COUNT], v2[COUNT], y[COUNT], u[COUNT], horizon[COUNT];
} inputs;

typedef struct {
    real numbers[RESULTS][COUNT];
    int32_t status[COUNT], event_count[COUNT];
    real event_time[COUNT * EVENTS];
    int8_t event_kind[COUNT * EVENTS];
    int32_t kept;
} answers;

static T(input) column(const void *first, size_t stride)
{
    const T(input) made = {first, (ptrdiff_t)stride};
    return made;
}

static T(output) results(void *first, size_t stride)
{
    const T(output) made = {first, (ptrdiff_t)stride};
    return made;
}

/* `count` stances from the `first` on */
static void solve(const inputs *from, int32_t first, int one_robot, int32_t count, int32_t max_phases, int32_t capacity,
                  int lists, answers *to)
{
    T(phase) phases[MAX_PHASES];
    T(stances_in) in;
    T(stances_out) out;
    memset(to, 0, sizeof *to);
    memset(&in, 0, sizeof in);
    memset(&out, 0, sizeof out);
    for (int n = 0; n < ROBOT; n++) {
        in.robot[n] = column(&from->robot[first][n], one_robot ? 0 : sizeof from->robot[0]);
    }
    in.x1 = column(from->x1 + first, sizeof(real));
    in.v1 = column(from->v1 + first, sizeof(real));
    in.v2 = column(from->v2 + first, sizeof(real));
    in.y = column(from->y + first, sizeof(real));
    in.u = column(from->u + first, sizeof(real));
    in.horizon = column(from->horizon + first, sizeof(real));
    in.max_phases = max_phases;
    T(output) *numbers[RESULTS] = {&out.duration, &out.x1, &out.v1, &out.x2, &out.v2, &out.apex, &out.aed};
    for (int n = 0; n < RESULTS; n++) {
        *numbers[n] = results(to->numbers[n], sizeof(real));
    }
    out.status = results(to->status, sizeof(int32_t));
    out.event_count = results(to->event_count, sizeof(int32_t));
    out.phases = lists ? phases : NULL;
    out.phase_capacity = lists ? capacity : 0;
    out.event_time = lists ? to->event_time : NULL;
    out.event_kind = lists ? to->event_kind : NULL;
    out.event_capacity = EVENTS;
    to->kept = T(solve_stances)(count, &in, &out);
}

static int same(const real *one, const real *other) /* to the last bit, or both NaN: a NaN's sign is fixed by no rule */
{
    return memcmp(one, other, sizeof *one) == 0 || (isnan(*one) && isnan(*other));
}

static void must_agree(const answers *together, int32_t i, const answers *alone)
{
    must(together->status[i] == alone->status[0] && together->event_count[i] == alone->event_count[0]);
    for (int n = 0; n < RESULTS; n++) {
        must(same(&together->numbers[n][i], &alone->numbers[n][0]));
    }
    for (int32_t n = 0; n < EVENTS; n++) {
        must(together->event_kind[i * EVENTS + n] == alone->event_kind[n]);
        must(same(&together->event_time[i * EVENTS + n], &alone->event_time[n]));
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static inputs made;
    source from = {data, size};
    const int kind = next_byte(&from), sensible = kind & 1;
    const int which = next_byte(&from), one_robot = which & 1;
    const int32_t count = 1 + next_byte(&from) % COUNT, max_phases = 1 + next_byte(&from) % MAX_PHASES;
    T(robot) robots[ROBOTS];
    real x1[ROBOTS], v1[ROBOTS], y[ROBOTS];
    for (int n = 0; n < (one_robot ? 1 : ROBOTS); n++) {
        robots[n] = next_robot(&from, kind);
    }
    for (int n = 0; n < ROBOTS; n++) {
        x1[n] = sensible && (kind & 4) ? 0 : next_real(&from, sensible, 0);
        v1[n] = next_real(&from, sensible, 0);
        y[n] = sensible && (kind & 8) ? 0 : next_real(&from, sensible, sensible);
    }
    const real u = next_real(&from, sensible, 0), more_u = next_real(&from, sensible, 0);
    const real v2 = next_real(&from, sensible, 0), more_v2 = next_real(&from, sensible, 0);
    const real longest = next_real(&from, sensible, 1);
    for (int i = 0; i < count; i++) {
        const T(robot) *robot = &robots[one_robot ? 0 : i / (1 + (which >> 4)) % ROBOTS];
        const real share = (real)i / COUNT;
        memcpy(made.robot[i], robot, sizeof made.robot[i]);
        made.x1[i] = x1[i % ROBOTS];
        made.v1[i] = v1[i / 2 % ROBOTS];
        made.y[i] = y[i / 4 % ROBOTS];
        made.u[i] = u + share * more_u;
        made.v2[i] = v2 + share * more_v2;
        made.horizon[i] = bounded(longest, robot, MOST_HALF_TURNS);
    }
    static answers together, alone;
    const int32_t capacity = which & 2 ? MAX_PHASES : 1 + max_phases % 5;
    solve(&made, 0, one_robot, count, max_phases, capacity, which & 4, &together);
    int32_t kept = HOPFORM_OK;
    for (int32_t i = 0; i < count; i++) {
        solve(&made, i, one_robot, 1, max_phases, capacity, which & 4, &alone);
        must_agree(&together, i, &alone);
        kept = alone.kept > kept ? alone.kept : kept;
    }
    must(together.kept == kept);
    return 0;
}
