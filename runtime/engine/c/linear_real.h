/* SPDX-License-Identifier: MIT-0
 *
 * A mode as a linear system: z = (1, x_1 - x_1(0), y, v_1, v_2) obeys z' = M z within a phase, and Phi(h) = exp(M h).
 */
#ifndef HOPFORM_LINEAR_H_real
#define HOPFORM_LINEAR_H_real

#include "axes.h"
#include "phase_real.h"
#include "series_real.h"

typedef struct {
    real at[Z_SIZE][Z_SIZE];
} hopform_matrix_real;

/* Phi(h) of a phase: its columns are the motions from rest under the drive and from unit initial values. */
static inline hopform_matrix_real hopform_transition_real(const hopform_plan_real *plan,
                                                          const hopform_phase_real *phase, real u, real h)
{
    const int side_1 = hopform_side_1_real(phase);
    const int side_2 = hopform_side_2_real(phase);
    const hopform_basis_real basis = hopform_basis_at_real(hopform_poles_of_real(plan, side_1, side_2), h);
    const hopform_drive_real drive = hopform_drive_of_real(&plan->robot, &plan->rates, u, (real)side_1, (real)side_2);
    const hopform_drive_real none = {0.0, 0.0};
    hopform_matrix_real phi = {{{0}}};
    phi.at[Z_ONE][Z_ONE] = 1.0;
    phi.at[Z_X][Z_X] = 1.0;
    for (int column = Z_ONE; column < Z_SIZE; column++) {
        if (column == Z_X || (column == Z_V1 && side_1 == 0) || (column == Z_V2 && side_2 == 0)) {
            continue;
        }
        const hopform_state_real start = {0.0, column == Z_V1 ? 1.0 : 0.0, column == Z_V2 ? 1.0 : 0.0,
                                          column == Z_Y ? 1.0 : 0.0};
        const hopform_motion_real motion =
            hopform_motion_under_real(&plan->rates, column == Z_ONE ? &drive : &none, &start, side_1, side_2);
        const hopform_state_real end = hopform_arrive_real(&start, &motion, &basis, side_1, side_2);
        phi.at[Z_X][column] = end.x1;
        phi.at[Z_Y][column] = end.y;
        phi.at[Z_V1][column] = end.v1;
        phi.at[Z_V2][column] = end.v2;
    }
    return phi;
}

/* sum += a b; half of what stands in M and Phi is zero. */
static inline void hopform_add_product_real(hopform_matrix_real *sum, const hopform_matrix_real *a,
                                            const hopform_matrix_real *b)
{
    for (int i = 0; i < Z_SIZE; i++) {
        for (int k = 0; k < Z_SIZE; k++) {
            const real factor = a->at[i][k];
            if (fabs_real(factor) > 0.0) {
                for (int j = 0; j < Z_SIZE; j++) {
                    sum->at[i][j] += factor * b->at[k][j];
                }
            }
        }
    }
}

/* Gauss's rule over 0 .. 1 (Abramowitz and Stegun, Handbook of Mathematical Functions, 25.4.30): exact to rounding for
 * a product of two motions over a time in which neither turns or fades by more than a factor of e^4. */
static const real hopform_place_real[HOPFORM_NODES_real] = {HOPFORM_GAUSS_PLACES_real};

static const real hopform_weight_real[HOPFORM_NODES_real] = {HOPFORM_GAUSS_WEIGHTS_real};

/* Halve a time until the rule is exact, no pole being further from 0 than s_1 + sqrt(s_2); how often. */
static inline int hopform_halve_real(const hopform_poles_real *poles, real *h)
{
    const real fastest = poles->s_1 + sqrt_real(poles->s_2);
    int times = 0;
    while (fastest * *h > 4.0 && times < 200) {
        *h *= 0.5;
        times++;
    }
    return times;
}

#endif
