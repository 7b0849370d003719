/* SPDX-License-Identifier: MIT-0
 *
 * The plan of a robot, and a stance by it: what users call.
 */
#include "chain_real.h"

static bool steps_are_sound_real(const hopform_step_real *steps, int32_t count)
{
    if (count < 1 || count > HOPFORM_MOST_STEPS || fabs_real(steps[0].t) > 0.0) {
        return false;
    }
    for (int32_t n = 0; n < count; n++) {
        if (!hopform_is_finite_real(steps[n].t) || !hopform_is_finite_real(steps[n].u)
            || (n > 0 && !(steps[n].t > steps[n - 1].t))) {
            return false;
        }
    }
    return true;
}

/* The node lies at nearly half a period where the pair is not damped, sooner where it is: at 0.95 pi/sqrt(q). */
static hopform_node_real node_of_poles_real(const hopform_poles_real *poles)
{
    const bool draws = poles->q > HOPFORM_UNDERFLOW_real; /* else the node is never reached */
    const real t = draws ? 2.984 / sqrt_real(poles->q) : HOPFORM_NEVER_real;
    const hopform_basis_real basis = hopform_basis_at_real(poles, draws ? t : 0.0);
    const real mu = 0.5 * poles->p;
    const real square = mu * mu - poles->q;
    hopform_node_real node = {HOPFORM_NEVER_real, HOPFORM_NEVER_real, poles->a, 0.0,      0.0,     t,
                              basis.Wdd,          basis.Wd,           basis.W,  basis.W1, basis.W2};
    if (square < 0.0) {
        node.half_period = 3.14159265358979323846 / sqrt_real(-square);
        node.fades = poles->a > 0.0 && mu > poles->a ? 10.0 / (mu - poles->a) : HOPFORM_NEVER_real;
    } else {
        const real fast = mu + sqrt_real(square);
        const real slow = fast > 0.0 ? poles->q / fast : 0.0;
        node.pole = hopform_greater_real(poles->a, fast);
        node.second = hopform_lesser_real(fast, hopform_greater_real(poles->a, slow));
        node.third = hopform_lesser_real(poles->a, slow);
    }
    return node;
}

/* Fill a plan from its robot. */
static int32_t fill_plan_real(hopform_plan_real *plan)
{
    const hopform_robot_real *robot = &plan->robot;
#define OR_OUTSIDE(name, domain) || !HOPFORM_IN_##domain##_real(robot->name)
    if (!(robot->x1_min <= robot->x1_max) HOPFORM_ROBOT_MEMBERS(OR_OUTSIDE)) {
#undef OR_OUTSIDE
        return HOPFORM_ERROR_ROBOT;
    }
    const real lighter = robot->m_eff < robot->m_s ? robot->m_eff : robot->m_s;
    if (!(lighter * lighter > 0.0)) { /* derivatives by the masses divide by their squares */
        return HOPFORM_ERROR_NUMBERS;
    }
    const hopform_rates_real rates = hopform_rates_of_real(robot);
#define REFUSE_IF_NEGATIVE(value)                                                                                      \
    if ((value) < 0.0) {                                                                                               \
        return HOPFORM_ERROR_UNSTABLE;                                                                                 \
    }
    HOPFORM_STABILITY(REFUSE_IF_NEGATIVE)
#undef REFUSE_IF_NEGATIVE
    const hopform_poles_real actuator = {0.0, rates.p_1, rates.q_1, rates.p_1, rates.q_1, 0.0};
    const hopform_poles_real body = {0.0, rates.p_2, rates.q_2, rates.p_2, rates.q_2, 0.0};
    const hopform_poles_real both = hopform_factor_cubic_real(rates.s_1, rates.s_2, rates.s_3);
    if (!hopform_is_finite_real(rates.s_1 * rates.s_1) /* discriminants square it */
        || !hopform_is_finite_real(rates.s_2) || !hopform_is_finite_real(rates.s_3) || !hopform_is_finite_real(both.a)
        || !hopform_is_finite_real(both.p) || !(both.q <= HOPFORM_NEVER_real)
        || !(both.q > 0.0 || HOPFORM_BODY_IS_FIXED) /* both never move then */
        || !hopform_is_finite_real(rates.a1_0) || !hopform_is_finite_real(rates.a1_u)) {
        return HOPFORM_ERROR_NUMBERS;
    }
    plan->rates = rates;
    plan->both = both;
    plan->actuator = actuator;
    plan->body = body;
    plan->node_both = node_of_poles_real(&both);
    plan->node_actuator = node_of_poles_real(&actuator);
    plan->node_body = node_of_poles_real(&body);
    plan->made = HOPFORM_PLAN_MADE;
    return HOPFORM_OK;
}

int32_t hopform_plan_init_real(hopform_plan_real *plan, const hopform_robot_real *robot)
{
    if (plan == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const hopform_robot_real none = {0};
    const hopform_plan_real zero = {0};
    const hopform_robot_real own = robot != NULL ? *robot : none; /* it may lie in the plan */
    plan->made = 0;
    plan->robot = own;
    const int32_t status = robot != NULL ? fill_plan_real(plan) : HOPFORM_ERROR_NULL;
    if (status < 0) {
        *plan = zero;
    }
    return status;
}

int32_t hopform_solve_stance_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                  const hopform_step_real *steps, int32_t step_count, real horizon, int32_t max_phases,
                                  hopform_phase_real *phases, int32_t capacity, hopform_stance_real *stance)
{
    return hopform_solve_followed_real(plan, start, steps, step_count, horizon, max_phases, phases, capacity, stance,
                                       NULL, NULL);
}

int32_t hopform_solve_followed_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                    const hopform_step_real *steps, int32_t step_count, real horizon,
                                    int32_t max_phases, hopform_phase_real *phases, int32_t capacity,
                                    hopform_stance_real *stance, hopform_follow_real *follow, hopform_tally_real *tally)
{
    if (stance == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const hopform_state_real nothing = {0.0, 0.0, 0.0, 0.0};
    const hopform_state_real from = start != NULL ? *start : nothing; /* it may lie in the stance or in the phases */
    const hopform_stance_real zero = {0};
    *stance = zero;
    if (plan == NULL || start == NULL || steps == NULL || (phases == NULL && capacity > 0)) {
        return HOPFORM_ERROR_NULL;
    }
    const hopform_memory_real read[] = {
        hopform_array_real(plan, 1, sizeof *plan),
        hopform_array_real(steps, step_count <= HOPFORM_MOST_STEPS ? step_count : 0, sizeof *steps),
    };
    const hopform_memory_real written[] = {
        hopform_array_real(phases, capacity, sizeof *phases),
        hopform_array_real(stance, 1, sizeof *stance),
    };
    if (hopform_overlap_real(written, 2, read, 2)) {
        return HOPFORM_ERROR_OVERLAP;
    }
    if (!hopform_is_made_real(plan)) {
        return HOPFORM_ERROR_ROBOT;
    }
    const int32_t status = stance_status_real(&plan->robot, &from, horizon, max_phases);
    if (status < 0) {
        return status;
    }
    if (!steps_are_sound_real(steps, step_count)) {
        return HOPFORM_ERROR_STEPS;
    }
    if (capacity < 0) {
        return HOPFORM_ERROR_HORIZON;
    }
    stance_chain_real chain =
        stance_chain_from_real(plan, &from, steps, step_count, horizon, max_phases, phases, capacity);
    chain.follow = follow;
    chain.tally = tally;
    stance_search_real search = {0};
    int32_t ending = stance_begin_real(&chain);
    while (ending == 0) {
        const hopform_motion_real motion = motion_from_real(&chain);
        const stance_phase_end_real end = stance_find_end_real(&chain, &motion, &search);
        ending = stance_end_phase_real(&chain, &motion, &end);
    }
    return stance_report_real(&chain, &from, ending, stance);
}

int32_t hopform_stance_at_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                               const hopform_phase_real *phases, const hopform_stance_real *stance, real t,
                               hopform_state_real *state)
{
    hopform_state_real found = {0.0, 0.0, 0.0, 0.0}; /* the state may lie in what is read */
    int32_t status = HOPFORM_OK;
    if (plan == NULL || steps == NULL || phases == NULL || stance == NULL || state == NULL) {
        status = HOPFORM_ERROR_NULL;
    } else if (!hopform_is_made_real(plan)) {
        status = HOPFORM_ERROR_ROBOT;
    } else if (!(t >= 0.0 && t <= HOPFORM_NEVER_real) || (t > stance->duration && stance->ending != HOPFORM_ENDING_REST)
               || stance->phases_kept < stance->phase_count || stance->phases_kept < 1) {
        status = HOPFORM_ERROR_TIME;
    } else {
        const real within = t < stance->duration ? t : stance->duration;
        const hopform_phase_real *phase = &phases[hopform_phase_index_real(phases, stance->phases_kept, within)];
        found = hopform_state_in_phase_real(plan, phase, steps[phase->step].u, within - phase->t);
    }
    if (state != NULL) {
        *state = found;
    }
    return status;
}
