/* Runs of hops, and then the stances of these as one batch: what each of the two calls costs is counted from outside.
 * The argument is 0 for one robot, 1 for random ones. Prints how many stances there are. */
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "hopform/hopform.h"

enum { RUNS = 1000, HOPS = 20, FIELDS = HOPFORM_ROBOT_FIELDS };

static const hopform_robot_f64 hopper_c = {25.0, 3.0,  1200.0, 0.4, 0.0,  150.0, 5.0, 0.78, 0.6,
                                           -65.0, 9.81, 0.0,   0.08, 3.0, 0.05,  0.0, 0.0};
static hopform_robot_f64 robots[RUNS], of_stance[RUNS * HOPS];
static double start[RUNS], u[RUNS], ground[RUNS][HOPS];
static double states[4][RUNS][HOPS], apex[RUNS][HOPS];
static double from[5][RUNS * HOPS], apexes[RUNS * HOPS];
static int32_t done[RUNS];
static uint64_t seed = 7;

static double uniform(double low, double high)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(seed >> 11) / 9007199254740992.0);
}

static hopform_input_f64 column(const void *first, size_t stride)
{
    const hopform_input_f64 input = {first, (ptrdiff_t)stride};
    return input;
}

int main(int count, char **words)
{
    const int random = count > 1 && words[1][0] == '1';
    for (int i = 0; i < RUNS; i++) {
        hopform_robot_f64 *robot = &robots[i];
        *robot = hopper_c;
        double *const some[] = {&robot->m_eff, &robot->m_s, &robot->k, &robot->b1, &robot->b2, &robot->f1, &robot->f2};
        for (int n = 0; n < 7 * random; n++) {
            *some[n] *= pow(10.0, uniform(n < 3 ? -0.5 : -1.0, 0.5));
        }
        u[i] = uniform(random ? 0.0 : 1.5, 3.0);
        start[i] = -sqrt(2.0 * 9.81 * uniform(0.1, 0.3) * 0.95);
        for (int n = 0; n < HOPS; n++) {
            ground[i][n] = uniform(-0.01, 0.01);
        }
    }
    static const double zero = 0.0, horizon = 2.0;
    hopform_hops_in_f64 in = {0};
    const size_t robot = random ? sizeof robots[0] : 0;
    for (int n = 0; n < FIELDS; n++) {
        in.runs.robot[n] = column((const double *)robots + n, robot);
    }
    in.runs.x1 = in.runs.v1 = in.runs.y = column(&zero, 0);
    in.runs.v2 = column(start, sizeof start[0]), in.runs.u = column(u, sizeof u[0]);
    in.runs.horizon = column(&horizon, 0), in.runs.max_phases = 4096;
    in.ground.first = ground, in.ground.stride = sizeof ground[0], in.ground.hop_stride = sizeof ground[0][0];
    in.hops = HOPS, in.from_touchdown = 1;
    hopform_hops_out_f64 out = {0};
    out.hops.first = done, out.hops.stride = sizeof done[0];
    hopform_hop_output_f64 *const tables[] = {&out.start_x1, &out.start_v1, &out.start_v2, &out.start_y, &out.apex};
    for (int n = 0; n < 5; n++) {
        tables[n]->first = n < 4 ? states[n] : apex;
        tables[n]->stride = sizeof apex[0], tables[n]->hop_stride = sizeof apex[0][0];
    }
    if (hopform_solve_hops_f64(RUNS, &in, &out) < 0) { return 1; }
    int64_t stances = 0;
    for (int i = 0; i < RUNS; i++) {
        for (int hop = 0; hop < done[i]; hop++, stances++) {
            of_stance[stances] = robots[i];
            from[4][stances] = u[i];
            for (int n = 0; n < 4; n++) {
                from[n][stances] = states[n][i][hop];
            }
        }
    }
    hopform_stances_in_f64 batch = in.runs;
    for (int n = 0; n < FIELDS; n++) {
        batch.robot[n] = column((const double *)of_stance + n, robot);
    }
    hopform_input_f64 *const inputs[] = {&batch.x1, &batch.v1, &batch.v2, &batch.y, &batch.u};
    for (int n = 0; n < 5; n++) {
        *inputs[n] = column(from[n], sizeof from[n][0]);
    }
    hopform_stances_out_f64 results = {0};
    results.apex.first = apexes, results.apex.stride = sizeof apexes[0];
    if (hopform_solve_stances_f64(stances, &batch, &results) < 0) { return 1; }
    printf("%ld\n", (long)stances);
    return 0;
}
