/* SPDX-License-Identifier: MIT-0
 *
 * What a motion is made of at a time since its phase began, in one of two forms:
 *
 *     h(t) = h(0) + H3 W' + H2 W + H1 W1                   W the response of the poles: any poles, any time
 *     h(t) = final + fading E + cosine C + sine S          modal: E = exp(-a t); C, S = exp(-p t/2) cos, sin omega t
 *
 * Where the real pole is much faster than the pair the first is a small difference of large numbers once E has gone. In
 * the second each part has digits of its own.
 */
#ifndef HOPFORM_MODAL_H_real
#define HOPFORM_MODAL_H_real

#include "facts.h"
#include "kernels_real.h"
#include "model_real.h"

/* The functions that a motion is a sum of: W', W, W1 and W2, or E, C, S and t; or a derivative of each. */
typedef struct {
    real first, second, third, last;
} parts_real;

/* A time since the start of a phase, and those functions there; their first two derivatives. */
typedef struct {
    real t;
    parts_real value, rate, curvature;
    real omega; /* frequency of the pair in the modal form; 0 of W */
} propagator_real;

/* The modal form of a motion. */
typedef struct {
    numerators_by_axis_real
        by; /* fading, cosine and sine in place of H3, H2, H1; the position less that at the start */
    state_by_axis_real final;
    real drift; /* of the position */
} motion_modes_real;

/* ---- W ---- */

static inline real third_of_basis_real(const hopform_poles_real *poles, const basis_real *basis) {
    return -(poles->s_1 * basis->Wdd + poles->s_2 * basis->Wd + poles->s_3 * basis->W);
}

static inline propagator_real propagator_of_real(const hopform_poles_real *poles, real t, const basis_real *w) {
    const propagator_real at = {t,
                                {w->Wd, w->W, w->W1, w->W2},
                                {w->Wdd, w->Wd, w->W, w->W1},
                                {third_of_basis_real(poles, w), w->Wdd, w->Wd, w->W},
                                0.0};
    return at;
}

static inline propagator_real propagator_at_real(const hopform_poles_real *poles, real t) {
    const basis_real basis = basis_at_real(poles, t);
    return propagator_of_real(poles, t, &basis);
}

/* That of any poles at the start of a phase. */
static inline propagator_real propagator_at_start_real(const hopform_poles_real *poles) {
    const propagator_real at = {0.0, {0.0, 0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}, {-poles->s_1, 1.0, 0.0, 0.0}, 0.0};
    return at;
}

/* ---- the modes ---- */

static inline bool is_modal_real(const propagator_real *at) {
    return !HOPFORM_MOVES_ALONE && at->omega > 0.0; /* one mass has no real pole beside its pair */
}

/* Derivatives of E, C and S from those before, and that of t. */
static inline parts_real turned_parts_real(const hopform_poles_real *poles, real omega, const parts_real *from,
                                           real last) {
    const real mean = 0.5 * poles->p;
    const parts_real next = {-poles->a * from->first, -(mean * from->second) - omega * from->third,
                             omega * from->second - mean * from->third, last};
    return next;
}

static inline propagator_real propagator_of_modes_real(const hopform_poles_real *poles, real omega,
                                                       const parts_real *value) {
    propagator_real at;
    at.t = value->last;
    at.value = *value;
    at.rate = turned_parts_real(poles, omega, value, 1.0);
    at.curvature = turned_parts_real(poles, omega, &at.rate, 0.0);
    at.omega = omega;
    return at;
}

SELDOM_real propagator_real modes_at_real(const hopform_poles_real *poles, real omega, real t) {
    const real envelope = exponential_real(-0.5 * poles->p * t);
    const turn_real turn = turn_by_real(omega * t);
    const parts_real value = {exponential_real(-poles->a * t), envelope * turn.cosine, envelope * turn.sine, t};
    return propagator_of_modes_real(poles, omega, &value);
}

/* A propagator in the form of another one, of which omega is known. */
static inline propagator_real propagator_in_form_real(const hopform_poles_real *poles, real omega, real t) {
    return !HOPFORM_MOVES_ALONE && omega > 0.0 ? modes_at_real(poles, omega, t) : propagator_at_real(poles, t);
}

/* ---- from one form to the other ---- */

/* The pair's impulse response R and its derivative, from the modes. */
static inline pair_core_real core_of_modes_real(const hopform_poles_real *poles, const propagator_real *at) {
    const real R = at->value.third / at->omega;
    const real Rd = at->value.second - 0.5 * poles->p * R;
    const pair_core_real core = {Rd, R, 1.0 - Rd - poles->p * R};
    return core;
}

SELDOM_real basis_real basis_of_modes_real(const hopform_poles_real *poles, const propagator_real *at) {
    const pair_core_real core = core_of_modes_real(poles, at);
    const pair_real pair = pair_of_core_real(poles, at->t, &core);
    const decay_real decay = decay_of_exp_real(poles->a, at->t, at->value.first);
    return basis_of_split_real(poles, residue_real(poles), at->t, &decay, &pair);
}

/* W of a propagator of either form. */
static inline basis_real basis_of_propagator_real(const hopform_poles_real *poles, const propagator_real *at) {
    const basis_real known = {at->rate.first, at->value.first, at->value.second, at->value.third, at->value.last};
    return is_modal_real(at) ? basis_of_modes_real(poles, at) : known;
}

/* ---- of a motion ---- */

/* The modal form of a motion from a state on. Of the velocity that has a position the whole numerator is known, in
 * which nothing cancels. */
SELDOM_real motion_modes_real modes_of_motion_real(const hopform_poles_real *poles, real omega,
                                                   const hopform_state_real *state, const numerators_real *numerators) {
    const real chi = residue_real(poles);
    motion_modes_real made;
    numerators_by_axis_real h;
    h.named = *numerators;
    made.final.named = *state;
    for (int i = 0; i < HOPFORM_CORE; i++) {
        const int axis = i + 1;
        const real z = made.final.of[axis];
        const whole_real plain = {z, h.core[i].H3 + poles->s_1 * z, h.core[i].H2 + poles->s_2 * z,
                                  axis == HOPFORM_STRETCH_AXIS ? h.core[i].H1 + poles->s_3 * z : numerators->N0_1};
        const whole_real known = {z, numerators->N2_1, numerators->N1_1, numerators->N0_1};
        const bool moves = axis == HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT);
        const modes_real modes = modes_of_real(poles, chi, omega, moves ? &known : &plain);
        const numerator_real by = {modes.h_fade, modes.h_cos, modes.h_sin};
        made.by.core[i] = by;
        made.final.of[axis] = modes.h_end;
        if (moves) {
            const integrated_real moved = integrated_modes_real(poles, omega, &modes);
            const numerator_real position = {moved.ih_fade, moved.ih_cos, moved.ih_sin};
            made.by.of.position = position;
            made.final.of[HOPFORM_POSITION_AXIS] = moved.ih_0;
            made.drift = modes.h_end;
        }
    }
    return made;
}

static inline real sum_of_parts_real(const numerator_real *by, const parts_real *parts) {
    return by->H3 * parts->first + by->H2 * parts->second + by->H1 * parts->third;
}

/* The state of a phase by its modal form. */
SELDOM_real hopform_state_real state_by_modes_real(const hopform_state_real *start, const motion_modes_real *modes,
                                                   const propagator_real *at) {
    state_by_axis_real state = modes->final;
    for (int i = 0; i < HOPFORM_CORE; i++) {
        state.of[i + 1] += sum_of_parts_real(&modes->by.core[i], &at->value);
    }
    state.named.x1 =
        start->x1 + (state.named.x1 + modes->drift * at->t + sum_of_parts_real(&modes->by.of.position, &at->value));
    return state.named;
}

#endif
