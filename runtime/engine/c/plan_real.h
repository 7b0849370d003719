/* SPDX-License-Identifier: MIT-0
 *
 * The plan of a robot: its rates, of each mode the poles, and the constants of a node of both masses.
 */
#ifndef HOPFORM_PLAN_H_real
#define HOPFORM_PLAN_H_real

#include "phase_real.h"
#include "transition_real.h"

/* What is known of poles in advance. */
static inline hopform_timescales_real timescales_of_poles_real(const hopform_poles_real *poles) {
    const real mu = 0.5 * poles->p;
    const real square = mu * mu - poles->q;
    const hopform_timescales_real rings = {
        square < 0.0 ? 3.14159265358979323846 / sqrt_real(-square) : HOPFORM_NEVER_real, poles->a};
    const hopform_timescales_real decays = {HOPFORM_NEVER_real, greater_real(poles->a, mu + sqrt_real(square))};
    return square < 0.0 ? rings : decays;
}

/* The rates of a plan's robot, if it is one. */
static inline int32_t rates_of_plan_real(hopform_plan_real *plan) {
    const hopform_robot_real *robot = &plan->robot;
#define OR_OUTSIDE(name, domain) || !HOPFORM_IN_##domain##_real(robot->name)
    if (!(lower_stop_real(robot) <= upper_stop_real(robot)) HOPFORM_ROBOT_MEMBERS(OR_OUTSIDE)) {
#undef OR_OUTSIDE
        return HOPFORM_ERROR_ROBOT;
    }
    if (HOPFORM_REST_MAY_LACK) {
        const excess_real more = excess_of_real(robot);
        if (!(more.up_1 >= 0.0 && more.down_1 >= 0.0 && more.up_2 >= 0.0 && more.down_2 >= 0.0)) {
            return HOPFORM_ERROR_ROBOT;
        }
    }
    const hopform_rates_real rates = rates_of_real(robot);
#define REFUSE_IF_NEGATIVE(value)                                                                                      \
    if ((value) < 0.0) { return HOPFORM_ERROR_UNSTABLE; }
    HOPFORM_STABILITY(REFUSE_IF_NEGATIVE)
#undef REFUSE_IF_NEGATIVE
    plan->rates[0] = rates;
#define PUT_RATES(index, formula) plan->rates[index] = formula##_real(robot);
    HOPFORM_FURTHER_RATES(PUT_RATES)
#undef PUT_RATES
    return HOPFORM_OK;
}

static inline bool are_finite_real(const hopform_rates_real *rates) {
    return is_finite_real(rates->s_1 * rates->s_1) /* discriminants square it */
           && is_finite_real(rates->s_2) && is_finite_real(rates->s_3) && is_finite_real(rates->a1_0)
           && is_finite_real(rates->a1_u);
}

/* The poles of a plan, once those of the cubic are known, and its nodes. */
static inline int32_t poles_of_plan_real(hopform_plan_real *plan, const hopform_poles_real *both) {
    bool finite = true;
    for (int n = 0; n < HOPFORM_RATES; n++) {
        finite = finite && are_finite_real(&plan->rates[n]);
    }
    if (!finite || !(both->q <= HOPFORM_NEVER_real)   /* a and p are within s_1, and NaN only if q is */
        || !(both->q > 0.0 || HOPFORM_MOVES_ALONE)) { /* both never move then */
        return HOPFORM_ERROR_NUMBERS;
    }
#define PUT_BOTH(form) plan->poles[form] = *both;
#define PUT_PAIR(form, index, p, q) plan->poles[form] = pair_alone_real(plan->rates[index].p, plan->rates[index].q);
    HOPFORM_FORMS(PUT_BOTH, PUT_PAIR)
#undef PUT_BOTH
#undef PUT_PAIR
    for (int form = 0; form < HOPFORM_POLES; form++) {
        plan->timescales[form] = timescales_of_poles_real(&plan->poles[form]);
    }
#if HOPFORM_BOTH_MOVE
    put_transition_real(plan);
#endif
    plan->made = HOPFORM_PLAN_MADE;
    return HOPFORM_OK;
}

#endif
