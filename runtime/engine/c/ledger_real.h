/* SPDX-License-Identifier: MIT-0
 *
 * The ledger over a part of a phase. Within a phase z = (1, x_1 - x_1(0), y, v_1, v_2) obeys z' = M z, so the integral
 * of z z^T obeys
 *
 *     I(2h) = I(h) + Phi(h) I(h) Phi(h)^T,        Phi(h) = exp(M h) from the closed form
 *
 * (Van Loan, "Computing integrals involving the matrix exponential", 1978): a sum of squares, in which nothing cancels,
 * and which knows no pole configuration. It starts from a time in which little moves.
 */
#ifndef HOPFORM_LEDGER_H_real
#define HOPFORM_LEDGER_H_real

#include "linear_real.h"

/* Integral of z z^T over a time h from the start of a phase, by Gauss's rule over its states: on and above the
 * diagonal. */
static inline hopform_matrix_real hopform_short_moments_real(const hopform_poles_real *poles,
                                                             const hopform_motion_real *motion,
                                                             const hopform_phase_real *phase, real h)
{
    const hopform_state_real start = {0.0, phase->v1, phase->v2, phase->y};
    hopform_matrix_real sum = {{{0}}};
    for (int node = 0; node < HOPFORM_NODES_real; node++) {
        const real t = hopform_place_real[node] * h;
        const hopform_basis_real basis = hopform_basis_at_real(poles, t);
        const hopform_state_real at =
            hopform_arrive_real(&start, motion, &basis, hopform_side_1_real(phase), hopform_side_2_real(phase));
        const real z[Z_SIZE] = {1.0, at.x1, at.y, at.v1, at.v2};
        for (int i = 0; i < Z_SIZE; i++) {
            const real weighed = z[i] * (hopform_weight_real[node] * h);
            for (int j = i; j < Z_SIZE; j++) {
                sum.at[i][j] += weighed * z[j];
            }
        }
    }
    return sum;
}

/* Integral of z z^T over the first t of a phase. */
static inline hopform_matrix_real hopform_moments_in_phase_real(const hopform_plan_real *plan,
                                                                const hopform_phase_real *phase, real u, real t)
{
    const int side_1 = hopform_side_1_real(phase);
    const int side_2 = hopform_side_2_real(phase);
    const hopform_drive_real drive = hopform_drive_of_real(&plan->robot, &plan->rates, u, (real)side_1, (real)side_2);
    const hopform_state_real start = {0.0, phase->v1, phase->v2, phase->y};
    const hopform_motion_real motion = hopform_motion_under_real(&plan->rates, &drive, &start, side_1, side_2);
    const hopform_poles_real *poles = hopform_poles_of_real(plan, side_1, side_2);
    real h = t;
    int doublings = hopform_halve_real(poles, &h);
    hopform_matrix_real sum = hopform_short_moments_real(poles, &motion, phase, h);
    for (; doublings > 0; doublings--) {
        for (int i = 1; i < Z_SIZE; i++) {
            for (int j = 0; j < i; j++) {
                sum.at[i][j] = sum.at[j][i];
            }
        }
        const hopform_matrix_real phi = hopform_transition_real(plan, phase, u, h);
        hopform_matrix_real left = {{{0}}};
        hopform_add_product_real(&left, &phi, &sum);
        for (int i = 0; i < Z_SIZE; i++) {
            for (int j = i; j < Z_SIZE; j++) {
                for (int k = 0; k < Z_SIZE; k++) {
                    sum.at[i][j] += left.at[i][k] * phi.at[j][k];
                }
            }
        }
        h *= 2.0;
    }
    return sum;
}

/* The ledger over the first t of a phase. */
static inline hopform_ledger_real hopform_ledger_in_phase_real(const hopform_plan_real *plan,
                                                               const hopform_phase_real *phase, real u, real t)
{
    const hopform_matrix_real sum = hopform_moments_in_phase_real(plan, phase, u, t);
    const hopform_moments_real moments = {sum.at[Z_ONE][Z_V1], sum.at[Z_ONE][Z_V2], sum.at[Z_V1][Z_V1],
                                          sum.at[Z_V1][Z_V2],  sum.at[Z_V2][Z_V2],  sum.at[Z_Y][Z_V1],
                                          sum.at[Z_Y][Z_V2],   sum.at[Z_X][Z_V2]};
    return hopform_ledger_of_real(&plan->robot, &moments, u, (real)hopform_side_1_real(phase),
                                  (real)hopform_side_2_real(phase), phase->x1);
}

#endif
