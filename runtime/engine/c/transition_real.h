/* SPDX-License-Identifier: MIT-0
 *
 * A motion of both elements slipping by its rates w = (y', v_1', v_2'), which obey w' = M w: what they become, and what
 * the coordinates gain by them, from node to node by constants of the plan and over any other time.
 *
 *     z gains Phi w        w becomes E w        d = w' + a w = (M + a) w
 *
 * derive/maths/transition.py has the entries. Gains are sums of products with the rates, never differences of two
 * values: they have all their digits.
 */
#ifndef HOPFORM_TRANSITION_H_real
#define HOPFORM_TRANSITION_H_real

#include "facts.h"
#include "kernels_real.h"
#include "model_real.h"

/* Of y, v_1 and v_2; the entries of their transition by rows, as the plan has them. */
typedef union {
    rate_real named;
    bend_real bend;
    real of[3];
} rates_by_row_real;

typedef union {
    core_real named;
    real of[3];
} core_by_row_real;

typedef union {
    passed_real named;
    struct {
        real stays[9], gains[9], moves[3];
    } of;
} passed_by_row_real;

#if HOPFORM_BOTH_MOVE
/* What a coordinate gains over a time by w, M w and M^2 w; the position by v_1 t, and by the row of v_1 in them, once
 * more integrated. */
typedef struct {
    real first, second, third, last; /* W1 is the third, its integral the last */
} powers_real;

/* Over a time of either sign that is short for all poles, by the first terms of the series: exp integrated twice, in
 * powers of M t below the third. */
#define DEFINE_POWERS(length, TERMS)                                                                                   \
    ALWAYS_real powers_real powers_over_##length##_real(const hopform_poles_real *poles, real t) {                     \
        const real tt = t * t;                                                                                         \
        const real S_1 = poles->s_1 * t;                                                                               \
        const real S_2 = poles->s_2 * tt;                                                                              \
        const real S_3 = poles->s_3 * (tt * t);                                                                        \
        const real highest[3] = {TERMS##_FIRST_real(TAKE_TERM)};                                                       \
        real r_0 = highest[2], r_1 = highest[1], r_2 = highest[0];                                                     \
        TERMS##_real(ADD_TERM) const powers_real powers = {t * (1.0 - S_3 * r_2), tt * (r_0 - S_2 * r_2),              \
                                                           tt * t * (r_1 - S_1 * r_2), tt * tt * r_2};                 \
        return powers;                                                                                                 \
    }
#define TAKE_TERM(coefficient) (coefficient),
#define ADD_TERM(coefficient)                                                                                          \
    {                                                                                                                  \
        const real next = (coefficient) - S_3 * r_2;                                                                   \
        const real first = r_0 - S_2 * r_2;                                                                            \
        r_2 = r_1 - S_1 * r_2;                                                                                         \
        r_1 = first;                                                                                                   \
        r_0 = next;                                                                                                    \
    }
DEFINE_POWERS(half_a_node, HOPFORM_HALF_NODE)
DEFINE_POWERS(a_node, HOPFORM_NODE)
#undef ADD_TERM
#undef TAKE_TERM
#undef DEFINE_POWERS

/* W over the same time, by these: t phi_1(M t) is W' + W (M + s_1) + W1 N, and the last is W2. */
static inline basis_real basis_of_powers_real(const hopform_poles_real *poles, const powers_real *powers) {
    const real W = powers->second - poles->s_1 * powers->third;
    const real Wd = powers->first - (poles->s_1 * W + poles->s_2 * powers->third);
    const real Wdd = 1.0 - (poles->s_1 * Wd + poles->s_2 * W + poles->s_3 * powers->third);
    const basis_real basis = {Wdd, Wd, W, powers->third, powers->last};
    return basis;
}

/* Whether a pole is so fast that its exponential is no short series over a node. */
static inline bool fades_in_a_node_real(const hopform_transition_real *transition) {
    return transition->fastest * transition->h > 0.8;
}

static inline basis_real basis_over_a_node_real(const hopform_plan_real *plan) {
    const hopform_poles_real *poles = &plan->poles[0];
    const real h = plan->transition.h;
    if (fades_in_a_node_real(&plan->transition)) { return basis_at_real(poles, h); }
    const powers_real powers = powers_over_a_node_real(poles, h);
    return basis_of_powers_real(poles, &powers);
}

/* A pair that rings turns by a quarter of half a period at most, so that series over a node are short. Two real poles
 * have no period, and intervals grow from their mean on. The fourth power of a node is a number. */
static inline void put_transition_real(hopform_plan_real *plan) {
    hopform_transition_real *transition = &plan->transition;
    const hopform_poles_real *poles = &plan->poles[0]; /* of both */
    const real mean = 0.5 * poles->p;
    const real square = poles->q - mean * mean;
    const real aa = poles->a * poles->a;
    const real root_q = sqrt_real(poles->q);
    transition->fastest = greater_real(poles->a, square > 0.0 ? root_q : mean + sqrt_real(-square));
    const real longest = 0.001 * sqrt_real(sqrt_real(HOPFORM_NEVER_real));
    const real square_of_fastest = transition->fastest * transition->fastest;
    transition->is_short_over =
        square_of_fastest * square_of_fastest <= HOPFORM_NEVER_real ? 1.0 / transition->fastest : 0.0;
    transition->h = lesser_real((square > 0.0 ? 0.7853981633974483 : 2.984) / root_q, longest);
    const basis_real basis = basis_over_a_node_real(plan);
    passed_by_row_real passed;
    passed.named = transition_of_both_real(&plan->rates[0], &basis);
    for (int n = 0; n < 9; n++) {
        transition->stays[n] = passed.of.stays[n];
        transition->gains[n] = passed.of.gains[n];
    }
    for (int n = 0; n < 3; n++) {
        transition->moves[n] = passed.of.moves[n];
    }
    const bool far = transition->fastest * transition->h > 1.0 && aa > 4.0 * poles->q;
    transition->apart = far && square > 0.0 ? 1.0 : 0.0;
    above_real above = {poles->a - plan->rates[0].p_1, poles->a - plan->rates[0].p_2};
    if (far) { above = above_of_both_real(&plan->rates[0], poles, residue_real(poles)); }
    transition->above[0] = above.above_1;
    transition->above[1] = above.above_2;
}

ALWAYS_real real by_row_real(const real row[3], const rates_by_row_real *w) {
    return row[0] * w->of[0] + row[1] * w->of[1] + row[2] * w->of[2];
}

/* (M + a) w. */
ALWAYS_real rates_by_row_real deflated_rates_real(const hopform_plan_real *plan, const rates_by_row_real *w) {
    const above_real above = {plan->transition.above[0], plan->transition.above[1]};
    rates_by_row_real d;
    d.bend = deflated_of_both_real(&plan->rates[0], &plan->poles[0], &above, &w->named);
    return d;
}

/* M w. */
ALWAYS_real rates_by_row_real bend_rates_real(const hopform_plan_real *plan, const rates_by_row_real *w) {
    rates_by_row_real bend;
    bend.bend = bends_of_both_real(&plan->rates[0], &w->named);
    return bend;
}

/* w, M w and M^2 w. */
typedef struct {
    rates_by_row_real w, bend, third;
} derivatives_of_both_real;

ALWAYS_real derivatives_of_both_real derivatives_at_real(const hopform_plan_real *plan, const rates_by_row_real *w) {
    derivatives_of_both_real at;
    at.w = *w;
    at.bend = bend_rates_real(plan, w);
    at.third = bend_rates_real(plan, &at.bend);
    return at;
}

/* What y, v_1 and v_2 gain, and the position. */
typedef struct {
    rates_by_row_real w; /* the rates there */
    real z[3], x;
} gained_real;

ALWAYS_real gained_real gained_by_powers_real(const hopform_plan_real *plan, const derivatives_of_both_real *from,
                                              real velocity, real t, const powers_real *powers) {
    const hopform_poles_real *poles = &plan->poles[0];
    gained_real gained;
    rates_by_row_real gain;
    UNROLLED_real for (int n = 0; n < 3; n++) {
        gain.of[n] =
            powers->first * from->w.of[n] + powers->second * from->bend.of[n] + powers->third * from->third.of[n];
        gained.z[n] = gain.of[n];
    }
    const rates_by_row_real more = bend_rates_real(plan, &gain);
    UNROLLED_real for (int n = 0; n < 3; n++) {
        gained.w.of[n] = from->w.of[n] + more.of[n];
    }
    gained.x = velocity * t
               + ((powers->second + poles->s_2 * powers->last) * from->w.of[1]
                  + (powers->third + poles->s_1 * powers->last) * from->bend.of[1] + powers->last * from->third.of[1]);
    return gained;
}

/* By the constants of a node, or by those of any other time. */
ALWAYS_real gained_real gained_by_rows_real(const real stays[9], const real gains[9], const real moves[3], real t,
                                            real velocity, const rates_by_row_real *w) {
    gained_real gained;
    UNROLLED_real for (int n = 0; n < 3; n++) {
        gained.w.of[n] = by_row_real(stays + 3 * n, w);
        gained.z[n] = by_row_real(gains + 3 * n, w);
    }
    gained.x = velocity * t + by_row_real(moves, w);
    return gained;
}

/* Over any time, or one backwards that is short for all poles. */
SELDOM_real gained_real gained_over_real(const hopform_plan_real *plan, const rates_by_row_real *w, real velocity,
                                         real t) {
    if (fabs_real(t) <= plan->transition.is_short_over) {
        const derivatives_of_both_real from = derivatives_at_real(plan, w);
        const powers_real powers = powers_over_a_node_real(&plan->poles[0], t);
        return gained_by_powers_real(plan, &from, velocity, t, &powers);
    }
    const basis_real basis = basis_at_real(&plan->poles[0], t);
    passed_by_row_real passed;
    passed.named = transition_of_both_real(&plan->rates[0], &basis);
    return gained_by_rows_real(passed.of.stays, passed.of.gains, passed.of.moves, t, velocity, w);
}
#endif

#endif
