/* Time a batch of stances, read from a file of columns, by one of the variants: FILE COUNT ROUNDS SAME_ROBOT VARIANT.
 *
 * Prints the least processor time of a round in ns a stance. Variant 0 is one call of hopform_solve_stance after the
 * other; no round at all is what reading costs, for a tool that counts instructions.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "hopform/hopform.h"

#define GLUE_(a, b) a##b
#define GLUE(a, b) GLUE_(a, b)
#define NAME(x) GLUE(x, SUFFIX)

enum { INPUTS = HOPFORM_ROBOT_FIELDS + 6, RESULTS = 7, PHASES = 128 };

typedef NAME(hopform_robot) robot;
typedef NAME(hopform_input) input;

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static double one_by_one(REAL **column, size_t count, int same, int32_t max_phases)
{
    NAME(hopform_plan) plan;
    NAME(hopform_stance) stance;
    NAME(hopform_phase) phases[PHASES];
    double sum = 0.0;
    for (size_t i = 0; i < count; i++) {
        if (i == 0 || !same) {
            REAL fields[HOPFORM_ROBOT_FIELDS];
            for (int n = 0; n < HOPFORM_ROBOT_FIELDS; n++) fields[n] = column[n][i];
            NAME(hopform_plan_init)(&plan, (const robot *)fields);
        }
        REAL **state = column + HOPFORM_ROBOT_FIELDS;
        const NAME(hopform_state) start = {state[0][i], state[1][i], state[2][i], state[3][i]};
        const NAME(hopform_step) step = {0, state[4][i]};
        NAME(hopform_solve_stance)(&plan, &start, &step, 1, state[5][i], max_phases, phases, PHASES, &stance);
        sum += (double)stance.duration;
    }
    return sum;
}

int main(int argc, char **argv)
{
    if (argc != 6) return 2;
    const size_t count = (size_t)atol(argv[2]);
    const int rounds = atoi(argv[3]), same = atoi(argv[4]), variant = atoi(argv[5]);
    const int32_t max_phases = 4096;
    REAL *column[INPUTS], *result[RESULTS];
    FILE *file = fopen(argv[1], "rb");
    for (int n = 0; n < INPUTS; n++) {
        column[n] = malloc(count * sizeof(REAL));
        if (file == NULL || fread(column[n], sizeof(REAL), count, file) != count) return 2;
    }
    for (int n = 0; n < RESULTS; n++) result[n] = calloc(count, sizeof(REAL));
    int32_t *status = calloc(count, sizeof *status), *events = calloc(count, sizeof *events);
    NAME(hopform_stances_in) in;
    NAME(hopform_stances_out) out;
    memset(&out, 0, sizeof out);
    input *inputs[] = {&in.x1, &in.v1, &in.v2, &in.y, &in.u, &in.horizon};
    for (int n = 0; n < INPUTS; n++) {
        input *place = n < HOPFORM_ROBOT_FIELDS ? &in.robot[n] : inputs[n - HOPFORM_ROBOT_FIELDS];
        place->first = column[n];
        place->stride = same && n < HOPFORM_ROBOT_FIELDS ? 0 : (ptrdiff_t)sizeof(REAL);
    }
    in.max_phases = max_phases;
    NAME(hopform_output) *outputs[] = {&out.duration, &out.x1, &out.v1, &out.x2, &out.v2, &out.apex, &out.aed};
    for (int n = 0; n < RESULTS; n++) {
        outputs[n]->first = result[n];
        outputs[n]->stride = sizeof(REAL);
    }
    out.status.first = status;
    out.event_count.first = events;
    out.status.stride = out.event_count.stride = sizeof *status;
    double least = 1e300, sum = 0.0;
    for (int n = 0; n < rounds; n++) {
        const double start = now();
        if (variant == 0) {
            sum += one_by_one(column, count, same, max_phases);
        } else if (NAME(hopform_solve_stances_by)(variant, (int64_t)count, &in, &out) < 0) {
            return 3;
        }
        const double spent = now() - start;
        least = spent < least ? spent : least;
    }
    fprintf(stderr, "%g\n", sum + (double)result[0][count / 2]);
    printf("%.17g\n", least / (double)count);
    return 0;
}
