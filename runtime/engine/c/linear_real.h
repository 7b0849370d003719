/* SPDX-License-Identifier: MIT-0
 *
 * A mode as a linear system: the axes z of a state obey z' = M (z_1 .. z_3, 1) within a phase, and the core of M,
 * without the first axis, has
 *
 *     (s - M)^-1 = adj(s - M)/P(s),        Phi(h) = exp(M h) = the powers of s in adj as derivatives of W at h.
 */
#ifndef HOPFORM_LINEAR_H_real
#define HOPFORM_LINEAR_H_real

#include "phase_real.h"
#include "series_real.h"

enum { CORE_real = HOPFORM_CORE, ONE_real = HOPFORM_AXES, POWERS_real = 3, ORDERS_real = 5 };

typedef struct {
    real at[HOPFORM_AXES_AND_ONE][HOPFORM_AXES_AND_ONE];
} matrix_real;

/* The mode of a phase under its current. */
typedef struct {
    union {
        transfer_real of;
        real at[CORE_real][HOPFORM_AXES][POWERS_real]; /* of s^2, s and 1 in adj(s - M), the core counted from 0 */
    } transfer;
    drive_real drive;
    row_real row;
    const hopform_poles_real *poles;
    const hopform_rates_real *rates;
} mode_real;

static inline void put_mode_real(mode_real *mode, const hopform_plan_real *plan, const hopform_phase_real *phase,
                                 real u) {
    mode->row = mode_of_phase_real(phase);
    mode->poles = poles_of_real(plan, mode->row);
    mode->rates = rates_in_mode_real(plan, mode->row);
    mode->drive = drive_in_mode_real(plan, mode->row, u);
    mode->transfer.of = transfer_of_real(mode->rates, &mode->drive, (real)side_of_mode_real(mode->row, 0),
                                         (real)side_of_mode_real(mode->row, 1));
}

static inline mode_real mode_of_real(const hopform_plan_real *plan, const hopform_phase_real *phase, real u) {
    mode_real mode;
    put_mode_real(&mode, plan, phase, u);
    return mode;
}

static inline bool rests_real(const mode_real *mode) {
    return rests_of_mode_real(mode->row);
}

/* z' of a state. */
static inline state_by_axis_real speeds_in_mode_real(const mode_real *mode, const hopform_state_real *state) {
    state_by_axis_real speeds;
    speeds.rates = speeds_of_real(mode->rates, &mode->drive, (real)side_of_mode_real(mode->row, 0),
                                  (real)side_of_mode_real(mode->row, 1), state);
    return speeds;
}

/* W'', W', W and its integrals at h; those of h = 0 where both masses are held. */
static inline basis_by_order_real response_in_mode_real(const mode_real *mode, real h) {
    basis_by_order_real response;
    response.named = basis_at_real(mode->poles, rests_real(mode) ? 0.0 : h);
    return response;
}

static inline real applied_real(const real powers[POWERS_real], const real *W) {
    return powers[0] * W[0] + powers[1] * W[1] + powers[2] * W[2];
}

/* Phi(h) from W at h: axis 0 and the constant part are one integral further each; the 1 of that part is left out. */
static inline matrix_real transition_real(const mode_real *mode, const real W[ORDERS_real]) {
    matrix_real phi = {{{0}}};
    phi.at[0][0] = 1.0;
    for (int j = 0; j <= CORE_real; j++) {
        const real *at = j < CORE_real ? W : W + 1;
        phi.at[0][j + 1] = applied_real(mode->transfer.at[0][j], at + 1);
        for (int i = 0; i < CORE_real; i++) {
            phi.at[i + 1][j + 1] = applied_real(mode->transfer.at[i][j], at);
        }
    }
    return phi;
}

/* Gauss's rule over 0 .. 1 (Abramowitz and Stegun, Handbook of Mathematical Functions, 25.4.30): exact to rounding for
 * a product of two motions over a time in which neither turns or fades by more than a factor of e^4. */
static const real place_real[HOPFORM_NODES_real] = {HOPFORM_GAUSS_PLACES_real};

static const real weight_real[HOPFORM_NODES_real] = {HOPFORM_GAUSS_WEIGHTS_real};

/* Halve a time until the rule is exact, no pole being further from 0 than s_1 + sqrt(s_2); how often. */
static inline int halve_real(const hopform_poles_real *poles, real *h) {
    const real fastest = poles->s_1 + sqrt_real(poles->s_2);
    int times = 0;
    while (fastest * *h > 4.0 && times < 200) {
        *h *= 0.5;
        times++;
    }
    return times;
}

#endif
