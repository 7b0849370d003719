/* hopform in the loop of the peers, in the precision of -DSUFFIX=_f64 -DREAL=double; and its single pieces. */
#include "hopform/hopform.h"

#define JOIN_(name, suffix) name##suffix
#define JOIN(name, suffix) JOIN_(name, suffix)
#define OF(name) JOIN(name, SUFFIX)
enum { JOB = 19, MAX_PHASES = 64, HEAD = 8, WIDTH = HEAD + 2 * MAX_PHASES, SAMPLES = 100, MOST = 1024 };

static OF(hopform_plan) plans[MOST];
static OF(hopform_phase) kept[MOST][MAX_PHASES];
static OF(hopform_stance) stances[MOST];

static OF(hopform_robot) robot_of(const double *job)
{
    OF(hopform_robot) robot = {0}; /* friction at rest is no higher than in motion */
    REAL *field = &robot.m_eff;
    for (int n = 0; n < 15; n++) {
        field[n] = (REAL)job[n];
    }
    return robot;
}

static void answer_of(const OF(hopform_stance) *stance, const OF(hopform_phase) *phases, double *answer)
{
    int count = 0;
    for (int32_t n = 1; n < stance->phases_kept; n++) {
        if (HOPFORM_IS_EVENT(phases[n].event)) {
            answer[HEAD + 2 * count] = (double)phases[n].t;
            answer[HEAD + 2 * count + 1] = phases[n].event;
            count++;
        }
    }
    answer[0] = stance->ending;
    answer[1] = (double)stance->duration;
    answer[2] = (double)stance->end.x1;
    answer[3] = (double)stance->end.v1;
    answer[4] = (double)stance->end.v2;
    answer[5] = (double)stance->end.y;
    answer[6] = (double)stance->aed;
    answer[7] = count;
}

static void solve(const OF(hopform_plan) *plan, const double *job, OF(hopform_phase) *phases,
                  OF(hopform_stance) *stance)
{
    const OF(hopform_state) start = {(REAL)job[15], (REAL)job[16], (REAL)job[17], 0};
    const OF(hopform_step) step = {0, (REAL)job[18]};
    OF(hopform_solve_stance)(plan, &start, &step, 1, 2, MAX_PHASES, phases, MAX_PHASES, stance);
}

/* Make the plans of all jobs: what `planned` and the pieces below start from. */
void prepare(const double *jobs, int count)
{
    for (int n = 0; n < count && n < MOST; n++) {
        const OF(hopform_robot) robot = robot_of(jobs + n * JOB);
        OF(hopform_plan_init)(&plans[n], &robot);
        solve(&plans[n], jobs + n * JOB, kept[n], &stances[n]);
    }
}

void planned(const double *jobs, int count, double tolerance, int loops, double *answers)
{
    (void)tolerance;
    for (int loop = 0; loop < loops; loop++) {
        for (int n = 0; n < count; n++) {
            OF(hopform_phase) phases[MAX_PHASES];
            OF(hopform_stance) stance;
            solve(&plans[n], jobs + n * JOB, phases, &stance);
            answer_of(&stance, phases, answers + n * WIDTH);
        }
    }
}

void from_scratch(const double *jobs, int count, double tolerance, int loops, double *answers)
{
    (void)tolerance;
    for (int loop = 0; loop < loops; loop++) {
        for (int n = 0; n < count; n++) {
            const OF(hopform_robot) robot = robot_of(jobs + n * JOB);
            OF(hopform_plan) plan;
            OF(hopform_phase) phases[MAX_PHASES];
            OF(hopform_stance) stance;
            OF(hopform_plan_init)(&plan, &robot);
            solve(&plan, jobs + n * JOB, phases, &stance);
            answer_of(&stance, phases, answers + n * WIDTH);
        }
    }
}

/* ---- the pieces; `answers` keeps a number, so that nothing is optimised away ---- */

void only_plan(const double *jobs, int count, double tolerance, int loops, double *answers)
{
    (void)tolerance;
    for (int loop = 0; loop < loops; loop++) {
        for (int n = 0; n < count; n++) {
            const OF(hopform_robot) robot = robot_of(jobs + n * JOB);
            answers[n] = OF(hopform_plan_init)(&plans[n], &robot);
        }
    }
}

void only_at(const double *jobs, int count, double tolerance, int loops, double *answers)
{
    (void)tolerance;
    for (int loop = 0; loop < loops; loop++) {
        for (int n = 0; n < count; n++) {
            const OF(hopform_step) step = {0, (REAL)jobs[n * JOB + 18]};
            OF(hopform_state) state;
            for (int i = 0; i < SAMPLES; i++) {
                const REAL t = stances[n].duration * (REAL)i / SAMPLES;
                OF(hopform_stance_at)(&plans[n], &step, kept[n], &stances[n], t, &state);
                answers[n] = (double)state.y;
            }
        }
    }
}

void only_energy(const double *jobs, int count, double tolerance, int loops, double *answers)
{
    (void)tolerance;
    for (int loop = 0; loop < loops; loop++) {
        for (int n = 0; n < count; n++) {
            const OF(hopform_step) step = {0, (REAL)jobs[n * JOB + 18]};
            OF(hopform_energy) energy;
            OF(hopform_ledger) ledger;
            REAL loss;
            OF(hopform_stance_energy)(&plans[n], &step, kept[n], &stances[n], &stances[n].duration, 1, &energy, &ledger,
                                      &loss);
            answers[n] = (double)ledger.spring_work;
        }
    }
}

/* The flight that follows from where the stance ended, over the same ground, under the designed return. */
void only_flight(const double *jobs, int count, double tolerance, int loops, double *answers)
{
    (void)jobs;
    (void)tolerance;
    for (int loop = 0; loop < loops; loop++) {
        for (int n = 0; n < count; n++) {
            OF(hopform_state) start = stances[n].end;
            OF(hopform_flight_phase) phases[MAX_PHASES];
            OF(hopform_flight) flight;
            start.y = 0;
            OF(hopform_solve_flight)(&plans[n], &start, 0, NULL, 10, MAX_PHASES, phases, MAX_PHASES, &flight);
            answers[n] = (double)flight.duration;
        }
    }
}

#ifdef COUNT_INSTRUCTIONS
#include <stdio.h>
#include <stdlib.h>

/* Jobs as raw doubles from stdin; each piece once, for a tool that counts the instructions within a function. */
int main(int arguments, char **argument)
{
    static double jobs[MOST * JOB], answers[MOST * WIDTH];
    const int count = (int)(fread(jobs, sizeof(double) * JOB, MOST, stdin));
    const int piece = arguments > 1 ? atoi(argument[1]) : 0;
    void (*const pieces[])(const double *, int, double, int, double *) = {only_plan, planned, only_at, only_energy,
                                                                          only_flight};
    prepare(jobs, count);
    pieces[piece](jobs, count, 0.0, 1, answers);
    printf("%d\n", count);
    return 0;
}
#endif
