/* SPDX-License-Identifier: MIT-0
 *
 * The ledger over a part of a phase. Within a phase z' = M z, so the integral of z z^T obeys
 *
 *     I(2h) = I(h) + Phi(h) I(h) Phi(h)^T,        Phi(h) = exp(M h) from the closed form
 *
 * (Van Loan, "Computing integrals involving the matrix exponential", 1978): a sum of squares, in which nothing cancels,
 * and which knows no pole configuration. It starts from a time in which little moves.
 */
#ifndef HOPFORM_LEDGER_H_real
#define HOPFORM_LEDGER_H_real

#include "linear_real.h"

/* A state, and behind its axes 1. */
typedef union {
    hopform_state_real named;
    real of[HOPFORM_AXES_AND_ONE];
} state_and_one_real;

/* Integral of z z^T over a time h from a state on, by Gauss's rule over its states: on and above the diagonal. */
static inline matrix_real short_moments_real(const hopform_plan_real *plan, const mode_real *mode,
                                             const hopform_state_real *start, real u, real h) {
    const numerators_real numerators = motion_of_real(plan, start, u, mode->row);
    matrix_real sum = {{{0}}};
    for (int node = 0; node < HOPFORM_NODES_real; node++) {
        const basis_real basis = basis_at_real(mode->poles, place_real[node] * h);
        state_and_one_real at;
        at.named = arrive_real(start, &numerators, &basis, mode->row);
        at.of[ONE_real] = 1.0;
        const real weight = weight_real[node] * h;
        for (int i = 0; i <= HOPFORM_AXES; i++) {
            for (int j = i; j <= HOPFORM_AXES; j++) {
                sum.at[i][j] += weight * at.of[i] * at.of[j];
            }
        }
    }
    return sum;
}

/* sum += Phi sum Phi^T, on and above the diagonal; Phi passes 1 on, and axis 0 to itself alone. */
static inline void double_moments_real(matrix_real *sum, const matrix_real *phi) {
    real left[HOPFORM_AXES][HOPFORM_AXES_AND_ONE];
    for (int i = 1; i <= HOPFORM_AXES; i++) {
        for (int j = 0; j < i; j++) {
            sum->at[i][j] = sum->at[j][i];
        }
    }
    for (int i = 0; i < HOPFORM_AXES; i++) {
        for (int j = 0; j <= HOPFORM_AXES; j++) {
            real product = i == 0 ? sum->at[0][j] : 0.0;
            for (int k = 1; k <= HOPFORM_AXES; k++) {
                product += phi->at[i][k] * sum->at[k][j];
            }
            left[i][j] = product;
        }
    }
    for (int i = 0; i < HOPFORM_AXES; i++) {
        for (int j = i; j < HOPFORM_AXES; j++) {
            real product = j == 0 ? left[i][0] : 0.0;
            for (int k = 1; k <= HOPFORM_AXES; k++) {
                product += left[i][k] * phi->at[j][k];
            }
            sum->at[i][j] += product;
        }
        sum->at[i][ONE_real] += left[i][ONE_real];
    }
    sum->at[ONE_real][ONE_real] *= 2.0;
}

/* The ledger over the first t of a phase; axis 0 counts from where it starts. */
static inline hopform_ledger_real ledger_in_phase_real(const hopform_plan_real *plan, const hopform_phase_real *phase,
                                                       real u, real t) {
    const mode_real mode = mode_of_real(plan, phase, u);
    state_by_axis_real from;
    from.named = start_of_phase_real(phase);
    const real origin = from.of[0];
    from.of[0] = 0.0;
    real h = t;
    const int doublings = halve_real(mode.poles, &h);
    matrix_real sum = short_moments_real(plan, &mode, &from.named, u, h);
    for (int n = 0; n < doublings; n++) {
        const basis_by_order_real response = response_in_mode_real(&mode, h);
        const matrix_real phi = transition_real(&mode, response.of);
        double_moments_real(&sum, &phi);
        h *= 2.0;
    }
#define TAKE_MOMENT(i, j) sum.at[i][j],
    const moments_real moments = {HOPFORM_AXES_OF_MOMENTS(TAKE_MOMENT)};
#undef TAKE_MOMENT
    return ledger_of_real(&plan->robot, &moments, u, (real)side_of_mode_real(mode.row, 0),
                          (real)side_of_mode_real(mode.row, 1), (real)limit_of_mode_real(mode.row), origin);
}

#endif
