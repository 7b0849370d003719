/* SPDX-License-Identifier: MIT-0
 *
 * A motion of both elements slipping in modal coordinates m = (f, c, s): what they gain over a time, and what value,
 * rate and deflated derivative of a coordinate are by them.
 *
 *     z' = P m        z gains P (the integrals of m)        z'' + a z' = D (c, s)
 *
 * Integrals over a short time are products with it, never differences of two values: they have all their digits.
 */
#ifndef HOPFORM_MODAL_MOTION_H_real
#define HOPFORM_MODAL_MOTION_H_real

#include "modal_plan_real.h"

#if HOPFORM_HAS_MODAL
/* The coordinates of z'. */
typedef struct {
    real f, c, s;
} modal_real;

/* Their integrals over a time, and what is left of f behind it. */
typedef struct {
    real f, c, s, left;
} modal_gain_real;

/* Where a phase ends in modal coordinates: the state, by the axes of the core, how far the position has moved, and what
 * the rate of the velocity that has a position is a sum of. */
typedef struct {
    bool is_modal; /* else the propagator says where it ends */
    real z[HOPFORM_AXES];
    real moved;
    real rate[3];
    real stretched; /* the magnitudes that the stretch is a sum of */
} modal_arrival_real;

static inline modal_gain_real no_gain_real(const modal_real *m) {
    const modal_gain_real none = {0.0, 0.0, 0.0, m->f};
    return none;
}

ALWAYS_real modal_gain_real gain_and_real(const modal_gain_real *first, const modal_gain_real *then) {
    const modal_gain_real both = {first->f + then->f, first->c + then->c, first->s + then->s, then->left};
    return both;
}

/* (c, s)' of (c, s): the pair turns. */
ALWAYS_real modal_real modal_after_real(const hopform_modal_real *modal, const modal_real *m,
                                        const modal_gain_real *gain) {
    const modal_real later = {gain->left, m->c - (modal->mean * gain->c + modal->omega * gain->s),
                              m->s + (modal->omega * gain->c - modal->mean * gain->s)};
    return later;
}

/* Of integrals of 1, and of a cosine of 1, to those of m. */
ALWAYS_real modal_gain_real gain_of_turn_real(const modal_real *m, real fades, real left, real rings, real turns) {
    const modal_gain_real gain = {m->f * fades, m->c * rings - m->s * turns, m->c * turns + m->s * rings, m->f * left};
    return gain;
}

/* Over a node. */
ALWAYS_real modal_gain_real gain_of_node_real(const hopform_modal_real *modal, const modal_real *m) {
    return gain_of_turn_real(m, modal->fades, modal->left, modal->rings, modal->turns);
}

/* Whether the real pole is so fast that its exponential is no short series over a node. */
static inline bool fades_in_a_node_real(const hopform_modal_real *modal) {
    return modal->a * modal->h > 0.8;
}

/* Over a time of either sign: t phi_1 of the poles times t, by the first terms of its series. Its coefficients are
 * real, so of the pair it takes two products a term: what is left of a division by z^2 - 2 Re z + |z|^2. */
#define DEFINE_GAIN(length, TERMS)                                                                                     \
    ALWAYS_real modal_gain_real gain_over_##length##_real(const hopform_modal_real *modal, const modal_real *m,        \
                                                          real t) {                                                    \
        const real x = -modal->a * t;                                                                                  \
        const real re = -modal->mean * t;                                                                              \
        const real im = modal->omega * t;                                                                              \
        const real twice = re + re;                                                                                    \
        const real square = re * re + im * im;                                                                         \
        real fade = 0.0, first = 0.0, second = 0.0;                                                                    \
        TERMS(ADD_TERM)                                                                                                \
        const real rings = t * (1.0 + (re * first - square * second));                                                 \
        const real turns = t * (im * first);                                                                           \
        if (!fades_in_a_node_real(modal)) {                                                                            \
            const real share = 1.0 + x * fade;                                                                         \
            return gain_of_turn_real(m, t * share, 1.0 + x * share, rings, turns);                                     \
        }                                                                                                              \
        const fade_real faded = fade_by_real(x);                                                                       \
        return gain_of_turn_real(m, faded.gone / modal->a, faded.left, rings, turns);                                  \
    }
#define ADD_TERM(coefficient)                                                                                          \
    {                                                                                                                  \
        const real next = (coefficient) + (twice * first - square * second);                                           \
        second = first;                                                                                                \
        first = next;                                                                                                  \
        fade = fade * x + (coefficient);                                                                               \
    }
DEFINE_GAIN(half_a_node, HOPFORM_HALF_NODE_real)
DEFINE_GAIN(a_node, HOPFORM_NODE_real)
DEFINE_GAIN(a_step, HOPFORM_STEP_real)
#undef DEFINE_GAIN

/* Over any time. */
SELDOM_real modal_gain_real gain_over_real(const hopform_modal_real *modal, const modal_real *m, real t) {
    if (t <= modal->h) { return gain_over_a_node_real(modal, m, t); }
    const fade_real fade = fade_by_real(-modal->mean * t);
    const turn_real half = turn_by_real(0.5 * modal->omega * t);
    const real cosine = fade.gone + fade.left * (2.0 * half.sine * half.sine); /* 1 less */
    const real sine = fade.left * (2.0 * half.sine * half.cosine);
    const real q = modal->root_q * modal->root_q;
    return gain_of_turn_real(m, decay_at_real(modal->a, t).e1, exponential_real(-modal->a * t),
                             (modal->mean * cosine + modal->omega * sine) / q,
                             (modal->omega * cosine - modal->mean * sine) / q);
}

/* The coordinates after any time: what has faded is no difference of what has not. */
SELDOM_real modal_real modal_at_real(const hopform_modal_real *modal, const modal_real *m, real t) {
    const real envelope = exponential_real(-modal->mean * t);
    const turn_real turn = turn_by_real(modal->omega * t);
    const modal_real later = {m->f * exponential_real(-modal->a * t),
                              envelope * (m->c * turn.cosine - m->s * turn.sine),
                              envelope * (m->c * turn.sine + m->s * turn.cosine)};
    return later;
}

/* ---- rows ---- */

ALWAYS_real real rate_by_row_real(const hopform_modal_row_real *row, const modal_real *m) {
    return row->rate_fade * m->f + row->rate_cosine * m->c + row->rate_sine * m->s;
}

ALWAYS_real real gain_by_row_real(const hopform_modal_row_real *row, const modal_gain_real *gain) {
    return row->rate_fade * gain->f + row->rate_cosine * gain->c + row->rate_sine * gain->s;
}

ALWAYS_real real deflated_by_row_real(const hopform_modal_row_real *row, const modal_real *m) {
    return row->deflated_cosine * m->c + row->deflated_sine * m->s;
}

/* What of a value rings: the pair, integrated. */
static inline real swing_by_row_real(const hopform_modal_real *modal, const hopform_modal_row_real *row, real c,
                                     real s) {
    const real by_q = 1.0 / (modal->root_q * modal->root_q);
    const real cosine = (modal->omega * s - modal->mean * c) * by_q;
    const real sine = -(modal->omega * c + modal->mean * s) * by_q;
    return row->rate_cosine * cosine + row->rate_sine * sine;
}

/* The amplitude of the pair, which never grows. */
static inline real amplitude_of_real(const modal_real *m) {
    return sqrt_real(m->c * m->c + m->s * m->s);
}

/* What the position moves over a time in which the coordinates gain that, from the velocity at its start: of the row
 * of that velocity. A short time is not a difference of what long ones are. */
SELDOM_real real displacement_real(const hopform_modal_real *modal, const hopform_modal_row_real *row, real velocity,
                                   const modal_real *m, real t, const modal_gain_real *gain) {
    if (t <= modal->h) {
        const real x = -modal->a * t;
        const real re = -modal->mean * t;
        const real im = modal->omega * t;
        const real twice = re + re;
        const real square = re * re + im * im;
        real fade = 0.0, first = 0.0, second = 0.0;
        HOPFORM_NODE_TWICE_real(ADD_TERM)
#undef ADD_TERM
            const real tt = t * t;
        const real cosine = 0.5 + (re * first - square * second);
        const real sine = im * first;
        const real fades = fades_in_a_node_real(modal) ? decay_at_real(modal->a, t).e2 : tt * (0.5 + x * fade);
        return velocity * t
               + (row->rate_fade * m->f * fades
                  + tt
                        * (row->rate_cosine * (cosine * m->c - sine * m->s)
                           + row->rate_sine * (cosine * m->s + sine * m->c)));
    }
    const bool apart = modal->a * t > 0.5;
    const real fades = apart ? (m->f * t - gain->f) / modal->a : m->f * decay_at_real(modal->a, t).e2;
    const real swing = swing_by_row_real(modal, row, gain->c - m->c * t, gain->s - m->s * t);
    return velocity * t + (row->rate_fade * fades + swing);
}
#endif

#endif
