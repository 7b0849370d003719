/* Stances of the 50-digit reference, solved on the target in single precision: same ending, same events, and errors of
 * at most 1e-5 of the scale times the condition number. Then the controller must find each of their apexes again. */
#include <stddef.h>

#include "board.h"
#include "golden.h"
#include "hopform/hopform.h"

enum { CAPACITY = 32 };
static hopform_phase_f32 phases[CAPACITY];
static hopform_search_f32 search;
static float worst;
static int wrong;

static float size_of(float value)
{
    return value < 0.0f ? -value : value;
}

/* The error as a share of what is allowed. */
static void judge(int number, const char *what, float got, float wanted, float scale, float condition)
{
    const float share = size_of(got - wanted) / (1e-5f * scale * condition);
    worst = share > worst ? share : worst;
    if (!(share <= 1.0f)) {
        wrong++;
        board_text("stance ");
        board_number(number);
        board_text(": wrong ");
        board_text(what);
        board_text(", permille of what is allowed: ");
        board_number(share < 1e6f ? (int32_t)(1000.0f * share) : -1);
        board_text("\n");
    }
}

static void must(int number, int truth, const char *what)
{
    if (!truth) {
        wrong++;
        board_text("stance ");
        board_number(number);
        board_text(": ");
        board_text(what);
        board_text("\n");
    }
}

static void events_of(int number, const golden *g, const hopform_stance_f32 *stance)
{
    int32_t found = 0;
    for (int32_t n = 1; n < stance->phases_kept; n++) {
        if (!HOPFORM_IS_EVENT(phases[n].event)) {
            continue;
        }
        if (found < g->event_count) {
            must(number, phases[n].event == g->event_kind[found], "another event");
            judge(number, "time of an event", phases[n].t, g->event_time[found], g->time_scale, g->condition);
        }
        found++;
    }
    must(number, found == g->event_count || (g->event_count == MOST_EVENTS && found > MOST_EVENTS),
         "another count of events");
}

static void stance_of(int number, const golden *g)
{
    hopform_robot_f32 robot;
    hopform_plan_f32 plan;
    hopform_stance_f32 stance;
    for (size_t n = 0; n < sizeof g->robot / sizeof g->robot[0]; n++) {
        ((float *)&robot)[n] = g->robot[n];
    }
    const hopform_state_f32 start = {g->x1, g->v1, g->v2, g->y};
    const hopform_step_f32 steps[] = {{0.0f, g->u}, {g->later, g->then}};
    must(number, hopform_plan_init_f32(&plan, &robot) == HOPFORM_OK, "no plan");
    const int32_t status = hopform_solve_stance_f32(&plan, &start, steps, g->later < 100.0f ? 2 : 1, g->horizon,
                                                    CAPACITY, phases, CAPACITY, &stance);
    must(number, status == HOPFORM_OK && stance.ending == g->ending, "another ending");
    events_of(number, g, &stance);
    judge(number, "duration", stance.duration, g->duration, g->time_scale, g->condition);
    judge(number, "x1", stance.end.x1, g->x1_end, 0.1f, g->condition);
    judge(number, "v1", stance.end.v1, g->v1_end, 1.0f, g->condition);
    judge(number, "v2", stance.end.v2, g->v2_end, 1.0f, g->condition);
    judge(number, "y", stance.end.y, g->y_end, 0.1f, g->condition);
    judge(number, "aed", stance.aed, g->aed, g->energy_scale, g->condition_aed);
    if (g->later < 100.0f || stance.ending != HOPFORM_ENDING_TAKEOFF || !(g->apex > 0.0f)) {
        return;
    }
    const hopform_target_f32 target = {g->apex, 0.0f, 0.0f, g->horizon, 0, 0};
    hopform_command_f32 command;
    must(number, hopform_choose_current_f32(&search, &plan, &start, &target, phases, CAPACITY, &command) == HOPFORM_OK,
         "no search");
    must(number, command.status == HOPFORM_COMMAND_REACHED, "an apex that is not found again");
    /* An apex within HOPFORM_NEAR_WITHIN counts as reached: where it hardly changes with u, u is known as well as that.
     */
    hopform_trial_f32 trial;
    must(number,
         hopform_try_currents_f32(&plan, &start, 1, &g->u, 1, g->horizon, phases, CAPACITY, &trial) == HOPFORM_OK,
         "no trial");
    const float slope = trial.smooth ? size_of(trial.apex_u) : 0.0f;
    const float room = slope > 0.0f ? 4e-6f / slope : 0.0f;
    must(number, size_of(command.u) <= size_of(g->u) + 1e-3f + room, "a larger current than is needed");
    judge(number, "apex", command.apex, g->apex, 1.0f, 1.0f);
}

int main(void)
{
    const int count = (int)(sizeof goldens / sizeof goldens[0]);
    for (int n = 0; n < count; n++) {
        stance_of(n, &goldens[n]);
    }
    board_number(count);
    board_text(" stances, worst permille ");
    board_number((int32_t)(1000.0f * worst));
    board_text(wrong > 0 ? ", WRONG " : ", wrong ");
    board_number(wrong);
    board_text("\n");
    board_exit(wrong > 0);
    return wrong > 0;
}
