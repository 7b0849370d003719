/* Every current on a grid, one after the other: what the controller's answer is measured against.
 *
 * The apex of each comes from the batch. Only a current that would be a better answer, and the neighbours of a sign
 * change, are solved again alone, which says whether they are admissible. A sign change between two admissible
 * neighbours is followed by bisection alone; it counts where it closes on a root, and not where it closes on a jump.
 */
#include <math.h>
#include <stddef.h>

#include "hopform/hopform.h"

enum { PHASES = 4096, BLOCK = 1024 };

typedef struct {
    double x1, v1, v2, y;
    double wanted; /* [m] apex over the ground */
    double limit;  /* [m] x_1 must stay below */
    double u_max;
    double stop;   /* [A] no root of |u| above this matters */
    double nearer; /* [m] no gap above this matters */
    int grid;      /* currents on each side */
} scan_task;

typedef struct {
    double gap; /* the least |apex - wanted| of an admissible current on the grid, HUGE_VAL if none is below `nearer` */
    double u;    /* where */
    double root; /* least |u| of a root below `stop`, HUGE_VAL if there is none */
} scan_result;

/* Apex less what is wanted; NaN if the current is not admissible. */
double scan_gap(const hopform_plan_f64 *plan, const scan_task *task, double u)
{
    static hopform_phase_f64 phases[PHASES];
    const hopform_state_f64 start = {task->x1, task->v1, task->v2, task->y};
    const hopform_step_f64 step = {0.0, u};
    hopform_stance_f64 stance;
    if (hopform_solve_stance_f64(plan, &start, &step, 1, 2.0, PHASES, phases, PHASES, &stance) < 0
        || stance.ending != HOPFORM_ENDING_TAKEOFF) {
        return NAN;
    }
    double peak = stance.end.x1;
    for (int n = 0; n < stance.phases_kept; n++) {
        peak = fmax(peak, phases[n].x1);
    }
    return peak < task->limit ? stance.apex - task->wanted : NAN;
}

static double root_between(const hopform_plan_f64 *plan, const scan_task *task, double low, double at_low, double high)
{
    for (int n = 0; n < 60; n++) {
        const double middle = 0.5 * (low + high);
        const double gap = scan_gap(plan, task, middle);
        if (isnan(gap)) {
            return HUGE_VAL;
        }
        if (fabs(gap) <= 1e-9 && high - low <= 1e-9 && low - high <= 1e-9) {
            return fabs(middle);
        }
        if ((gap < 0.0) == (at_low < 0.0)) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return HUGE_VAL;
}

static double current_of(const scan_task *task, int side, int n)
{
    return side * (n < task->grid ? task->u_max / task->grid * n : task->u_max);
}

/* The apices of `count` currents from the n-th on, NaN without take-off. */
static void block(const hopform_plan_f64 *plan, const scan_task *task, int side, int n, int count, double *apex)
{
    static double u[BLOCK];
    const double horizon = 2.0;
    for (int i = 0; i < count; i++) {
        u[i] = current_of(task, side, n + i);
    }
    hopform_stances_in_f64 in = {
        .x1 = {&task->x1, 0}, .v1 = {&task->v1, 0}, .v2 = {&task->v2, 0}, .y = {&task->y, 0},
        .u = {u, sizeof *u}, .horizon = {&horizon, 0}, .max_phases = PHASES,
    };
    for (int i = 0; i < HOPFORM_ROBOT_FIELDS; i++) {
        in.robot[i].first = (const double *)&plan->robot + i;
    }
    const hopform_stances_out_f64 out = {.apex = {apex, sizeof *apex}};
    hopform_solve_stances_f64(count, &in, &out);
}

static void look(const hopform_plan_f64 *plan, const scan_task *task, double u_before, double before, double u,
                 double gap, scan_result *result)
{
    if (fabs(gap) < result->gap && fabs(gap) < task->nearer && !isnan(scan_gap(plan, task, u))) {
        result->gap = fabs(gap);
        result->u = u;
    }
    if (gap * before <= 0.0 && !isnan(scan_gap(plan, task, u_before)) && !isnan(scan_gap(plan, task, u))) {
        const double root = root_between(plan, task, u_before, before, u);
        result->root = root < result->root ? root : result->root;
    }
}

void scan(const hopform_plan_f64 *plan, const scan_task *task, scan_result *result)
{
    static double apex[BLOCK];
    result->gap = HUGE_VAL;
    result->u = 0.0;
    result->root = HUGE_VAL;
    for (int side = -1; side <= 1; side += 2) {
        double before = NAN;
        double u_before = 0.0;
        for (int n = 0; n <= task->grid && u_before * side < task->stop; n++) {
            if (n % BLOCK == 0) {
                const int left = task->grid + 1 - n;
                block(plan, task, side, n, left < BLOCK ? left : BLOCK, apex);
            }
            const double u = current_of(task, side, n);
            const double gap = apex[n % BLOCK] - task->wanted;
            look(plan, task, u_before, before, u, gap, result);
            before = gap;
            u_before = u;
        }
    }
}
