/* Every current on a grid, one after the other: what the controller's answer is measured against.
 *
 * A sign change of the gap between two admissible neighbours is followed by bisection alone; it counts where it closes on
 * a root, and not where it closes on a jump.
 */
#include <math.h>
#include <stddef.h>

#include "hopform/hopform.h"

enum { PHASES = 4096 };

typedef struct {
    double x1, v1, v2, y;
    double wanted; /* [m] apex over the ground */
    double limit;  /* [m] x_1 must stay below */
    double u_max;
    double stop;   /* [A] no root of |u| above this matters */
    int grid;      /* currents on each side */
} scan_task;

typedef struct {
    double gap;  /* the least |apex - wanted| of an admissible current on the grid, HUGE_VAL if none is */
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

void scan(const hopform_plan_f64 *plan, const scan_task *task, scan_result *result)
{
    result->gap = HUGE_VAL;
    result->u = 0.0;
    result->root = HUGE_VAL;
    for (int side = -1; side <= 1; side += 2) {
        double before = NAN;
        double u_before = 0.0;
        for (int n = 0; n <= task->grid && u_before * side < task->stop; n++) {
            const double u = side * (n < task->grid ? task->u_max / task->grid * n : task->u_max);
            const double gap = scan_gap(plan, task, u);
            if (fabs(gap) < result->gap) {
                result->gap = fabs(gap);
                result->u = u;
            }
            if (gap * before <= 0.0) {
                const double root = root_between(plan, task, u_before, before, u);
                result->root = root < result->root ? root : result->root;
            }
            before = gap;
            u_before = u;
        }
    }
}
