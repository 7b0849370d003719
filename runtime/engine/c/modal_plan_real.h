/* SPDX-License-Identifier: MIT-0
 *
 * The modal coordinates of both elements slipping, as far as they are known of a robot: derive/maths/modal.py has the
 * rows, here are the distance from node to node and what the coordinates gain over it.
 *
 *     z'(t) = P (f, c, s)        f fades with the real pole, (c, s) turns with the pair
 */
#ifndef HOPFORM_MODAL_PLAN_H_real
#define HOPFORM_MODAL_PLAN_H_real

#include "facts.h"
#include "kernels_real.h"
#include "model_real.h"

/* Whether a library solves in modal coordinates (HOPFORM_MODAL), and has a model that may. */
#define HOPFORM_HAS_MODAL (HOPFORM_MODAL && HOPFORM_MAY_BE_MODAL)

#if HOPFORM_HAS_MODAL
/* Rows and shares by their names, and as the plan has them. */
typedef union {
    modal_rows_real named;
    struct {
        hopform_modal_row_real row[3];
        hopform_modal_share_real share[3];
    } of;
} modal_numbers_real;

/* A pair that hardly rings is close to the real pole or to be two real ones: shares are quotients by chi >= omega^2,
 * and grow with q/omega^2. The form of W has all digits there. A node is a quarter of half a period of what is not
 * damped, so that series over it are short. */
static inline void put_modal_real(hopform_plan_real *plan) {
    hopform_modal_real *modal = &plan->modal;
    const hopform_poles_real *poles = &plan->poles[0]; /* of both */
    const real mean = 0.5 * poles->p;
    const real square = poles->q - mean * mean;
    const real aa = poles->a * poles->a;
    modal->h = 0.0;
    if (!(square > 0.0625 * poles->q && poles->q * poles->q > HOPFORM_UNDERFLOW_real && aa * aa <= HOPFORM_NEVER_real
          && plan->rates[0].q_1 > HOPFORM_UNDERFLOW_real && plan->rates[0].q_2 > HOPFORM_UNDERFLOW_real)) {
        return;
    }
    const real omega = sqrt_real(square);
    const real chi = residue_real(poles);
    modal_numbers_real numbers;
    numbers.named = modal_rows_of_real(&plan->rates[0], poles, chi, omega);
    modal->a = poles->a;
    modal->mean = mean;
    modal->omega = omega;
    modal->root_q = sqrt_real(poles->q);
    modal->root_chi = sqrt_real(chi);
    modal->h = 0.7853981633974483 / modal->root_q;
    modal->fades = decay_at_real(poles->a, modal->h).e1;
    modal->left = exponential_real(-poles->a * modal->h);
    const fade_real fade = fade_by_real(-mean * modal->h);
    const turn_real half = turn_by_real(0.5 * omega * modal->h);
    const real cosine = fade.gone + fade.left * (2.0 * half.sine * half.sine); /* 1 less */
    const real sine = fade.left * (2.0 * half.sine * half.cosine);
    modal->rings = (mean * cosine + omega * sine) / poles->q;
    modal->turns = (omega * cosine - mean * sine) / poles->q;
    for (int n = 0; n < 3; n++) {
        modal->row[n] = numbers.of.row[n];
        modal->share[n] = numbers.of.share[n];
    }
}
#endif

#endif
