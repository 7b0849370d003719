/* SPDX-License-Identifier: MIT-0
 *
 * The plan of a robot, and a stance by it: what users call.
 */
#ifndef HOPFORM_STANCE_H_real
#define HOPFORM_STANCE_H_real

#include "chain_real.h"
#include "plan_real.h"
#include "reading_real.h"

static bool steps_are_sound_real(const hopform_step_real *steps, int32_t count) {
    if (count < 1 || count > HOPFORM_MOST_STEPS || fabs_real(steps[0].t) > 0.0) { return false; }
    for (int32_t n = 0; n < count; n++) {
        if (!is_finite_real(steps[n].t) || !is_finite_real(steps[n].u) || (n > 0 && !(steps[n].t > steps[n - 1].t))) {
            return false;
        }
    }
    return true;
}

/* Whether what is left of velocities after the fastest pole's transient, w^2/a^2 of them, has no digits to decide
 * events by: a is that pole, a w^2 the product of all three. */
static bool is_stiff_real(const hopform_plan_real *plan) {
    const real a = plan->timescales[0].pole;
    return !HOPFORM_MOVES_ALONE && a * a * a > HOPFORM_STIFFEST_real * HOPFORM_STIFFEST_real * plan->rates[0].s_3;
}

/* Fill a plan from its robot. */
static int32_t fill_plan_real(hopform_plan_real *plan) {
    const int32_t status = rates_of_plan_real(plan);
    if (status < 0) { return status; }
    const hopform_rates_real *rates = &plan->rates[0];
    hopform_poles_real both = {0};
    if (!HOPFORM_MOVES_ALONE) { both = factor_cubic_real(rates->s_1, rates->s_2, rates->s_3); }
    const int32_t made = poles_of_plan_real(plan, &both);
    return made == HOPFORM_OK && is_stiff_real(plan) ? HOPFORM_ILL_CONDITIONED : made;
}

/* Coefficients and poles of a robot. A refusal zeroes the plan, and every function refuses it. HOPFORM_ILL_CONDITIONED
 * where mass 1 is too stiff for the precision: the plan is made, and what it solves may lack events of the creep after
 * the transient. */
int32_t hopform_plan_init_real(hopform_plan_real *plan, const hopform_robot_real *robot) {
    if (plan == NULL) { return HOPFORM_ERROR_NULL; }
    const hopform_robot_real none = {0};
    const hopform_plan_real zero = {0};
    const hopform_robot_real own = robot != NULL ? *robot : none; /* it may lie in the plan */
    plan->made = 0;
    plan->robot = own;
    const int32_t status = robot != NULL ? fill_plan_real(plan) : HOPFORM_ERROR_NULL;
    if (status < 0) { *plan = zero; }
    return status;
}

/* Whether a stance can be solved; else why not. */
static int32_t call_status_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                const hopform_step_real *steps, int32_t step_count, real horizon, int32_t max_phases,
                                const hopform_phase_real *phases, int32_t capacity) {
    if (plan == NULL || steps == NULL || (phases == NULL && capacity > 0)) { return HOPFORM_ERROR_NULL; }
    if (!is_made_real(plan)) { return HOPFORM_ERROR_ROBOT; }
    const int32_t status = stance_status_real(&plan->robot, start, horizon, max_phases);
    if (status < 0) { return status; }
    if (!steps_are_sound_real(steps, step_count)) { return HOPFORM_ERROR_STEPS; }
    return capacity < 0 ? HOPFORM_ERROR_HORIZON : HOPFORM_OK;
}

/* Run a chain that has begun to its ending, which is not 0 if it is there already. */
ALWAYS_real int32_t stance_run_real(stance_chain_real *chain, int32_t begun) {
    const alone_real still = {0.0, 0.0, 0.0, 0.0};
    stance_search_real search;
    search.side = 0;
    search.alone = still;
    int32_t ending = begun;
    while (ending == 0) {
        stance_begin_phase_real(chain);
        stance_find_end_real(chain, &search);
        ending = stance_end_phase_real(chain, &search);
    }
    return ending;
}

/* hopform_solve_stance that shows every phase to `observer`; NULL for none. With the last of its evaluations it ends,
 * uncertified. */
static int32_t solve_observed_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                   const hopform_step_real *steps, int32_t step_count, real horizon, int32_t max_phases,
                                   hopform_phase_real *phases, int32_t capacity, hopform_stance_real *stance,
                                   evaluations_real *evaluations, observer_real *observer,
                                   current_variation_real *variation) {
    if (stance == NULL) { return HOPFORM_ERROR_NULL; }
    const memory_real read[2] = {
        array_real(plan, 1, sizeof *plan),
        array_real(steps, step_count <= HOPFORM_MOST_STEPS ? step_count : 0, sizeof *steps),
    };
    const memory_real written[2] = {
        array_real(stance, 1, sizeof *stance),
        array_real(phases, capacity, sizeof *phases),
    };
    const hopform_state_real nothing = {0.0, 0.0, 0.0, 0.0};
    const hopform_state_real from = start != NULL ? *start : nothing; /* it may lie in the stance or in the phases */
    int32_t status = HOPFORM_ERROR_NULL;
    if (observer == NULL && overlap_real(written, 2, read, 2)) { /* who follows has looked */
        status = HOPFORM_ERROR_OVERLAP;
    } else if (start != NULL) {
        status = call_status_real(plan, &from, steps, step_count, horizon, max_phases, phases, capacity);
    }
    if (status < 0) { return refuse_real(status, written, 1, read, 2); }
    stance_chain_real chain;
    stance_start_real(&chain, plan, &from, steps, step_count, horizon, max_phases, phases, capacity, evaluations);
#if HOPFORM_HAS_CONTACT
    chain.adds_up = chain.adds_up && observer == NULL; /* who follows a candidate does not ask for the AED */
#endif
    chain.observer = observer;
    chain.variation = variation;
    const int32_t ending = stance_run_real(&chain, stance_begin_real(&chain));
    return stance_report_real(&chain, &from, ending, stance);
}

/* Solve one stance from its start; phases go into the caller's buffer as far as it reaches.
 *
 * start: the state at t = 0; of a hop that after the impact. steps: the input, at most HOPFORM_MOST_STEPS,
 * steps[0].t = 0, times increase. horizon [s]: longest time. max_phases: after so many phases the ending is
 * too_many_phases; where no first event of a phase is certified within 10 000 intervals it is uncertified, and the
 * stance is known up to its duration.
 */
int32_t hopform_solve_stance_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                  const hopform_step_real *steps, int32_t step_count, real horizon, int32_t max_phases,
                                  hopform_phase_real *phases, int32_t capacity, hopform_stance_real *stance) {
    evaluations_real evaluations = {UNBOUNDED_real};
    return solve_observed_real(plan, start, steps, step_count, horizon, max_phases, phases, capacity, stance,
                               &evaluations, NULL, NULL);
}

/* State at time t of a solved stance, 0 <= t <= duration (any t after rest). Here and in all that is read at a time,
 * t = phases[n].t belongs to phase n: at an event it is the state behind it, which a stop has left without velocity. */
int32_t hopform_stance_at_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                               const hopform_phase_real *phases, const hopform_stance_real *stance, real t,
                               hopform_state_real *state) {
    const memory_real array = array_real(state, 1, sizeof *state);
    const times_real when = {&t, 1, false};
    const int32_t status = reading_status_real(plan, steps, phases, stance, &when, NULL, &array, 1);
    if (status < 0) { return status; }
    *state = state_of_stance_real(plan, steps, phases, stance, t);
    return HOPFORM_OK;
}

#endif
