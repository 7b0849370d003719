/* SPDX-License-Identifier: MIT-0
 *
 * What a motion is made of at a time since its phase began: h(t) = h(0) + H3 W' + H2 W + H1 W1, W the response of the
 * poles.
 */
#ifndef HOPFORM_PROPAGATOR_H_real
#define HOPFORM_PROPAGATOR_H_real

#include "facts.h"
#include "kernels_real.h"
#include "model_real.h"

/* The functions that a motion is a sum of: W', W and W1, or a derivative of each. */
typedef struct {
    real first, second, third;
} parts_real;

/* A time since the start of a phase, and those functions there; their first two derivatives. */
typedef struct {
    real t;
    parts_real value, rate, curvature;
} propagator_real;

static inline real third_of_basis_real(const hopform_poles_real *poles, const basis_real *basis) {
    return -(poles->s_1 * basis->Wdd + poles->s_2 * basis->Wd + poles->s_3 * basis->W);
}

static inline propagator_real propagator_of_real(const hopform_poles_real *poles, real t, const basis_real *w) {
    const propagator_real at = {
        t, {w->Wd, w->W, w->W1}, {w->Wdd, w->Wd, w->W}, {third_of_basis_real(poles, w), w->Wdd, w->Wd}};
    return at;
}

static inline propagator_real propagator_at_real(const hopform_poles_real *poles, real t) {
    const basis_real basis = basis_at_real(poles, t);
    return propagator_of_real(poles, t, &basis);
}

#endif
