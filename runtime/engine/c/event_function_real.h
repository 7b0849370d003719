/* SPDX-License-Identifier: MIT-0
 *
 * A function g of a phase, its jet, and what rounding has done to it; steps towards a root. Minima of the contact force
 * are looked for on it; of events it has the owners and what a value on a threshold is.
 *
 *     g(t) = start + H3 W' + H2 W + H1 W1        W, its derivative and integral: those of the phase's poles
 */
#ifndef HOPFORM_EVENT_FUNCTION_H_real
#define HOPFORM_EVENT_FUNCTION_H_real

#include "propagator_real.h"
#include "phase_real.h"

/* ---- on a threshold ---- */

/* A number, or 0 if it is within the rounding of the sum of these terms: its sign says nothing then. */
static inline real decided_real(real value, real terms) {
    return fabs_real(value) > 16.0 * HOPFORM_EPS_real * terms ? value : 0.0;
}

/* The first derivative at the start that is not zero. */
static inline real first_derivative_real(const numerator_real *h) {
    const real first = fabs_real(h->H3) > 0.0 ? h->H3 : h->H2;
    return fabs_real(first) > 0.0 ? first : h->H1;
}

enum { MOST_EVENT_FUNCTIONS_real = HOPFORM_MOST_EVENT_FUNCTIONS };

/* Owner of an event function: CONTACT, ELEMENT + index, or the LIMIT of a law, in order of tie-break priority. */
enum {
    NO_OWNER_real = -1,
    CONTACT_real = 0,
    ELEMENT_real = 1,
    LIMIT_real = ELEMENT_real + HOPFORM_ELEMENTS,
    NO_ELEMENT_real = -1
};

/* An event function. */
typedef struct {
    real H3, H2, H1; /* its numerator */
    real start;
    real cancels; /* a quarter of the magnitudes whose difference the start is: each is rounded four times */
} event_function_real;

/* A function with this numerator and value at the start, of which nothing is known. */
static inline event_function_real event_function_of_real(const numerator_real *h, real start) {
    const event_function_real g = {h->H3, h->H2, h->H1, start, 0.0};
    return g;
}

/* The first derivative at the start of an event function that is not zero. */
static inline real begins_with_real(const event_function_real *g) {
    const numerator_real h = {g->H3, g->H2, g->H1};
    return first_derivative_real(&h);
}

/* The start is a difference of terms, the sum of whose magnitudes is given. Within its rounding it is on the threshold,
 * where the function does not fall: as its first non-zero derivative has decided. */
static inline void put_on_threshold_real(event_function_real *g, real terms) {
    g->cancels = 0.25 * terms;
    if (!(fabs_real(decided_real(g->start, terms)) > 0.0) && !(begins_with_real(g) < 0.0)) { g->start = 0.0; }
}

/* Whether a function that begins below zero, or on its threshold, stays there. */
static inline bool begins_beyond_real(const event_function_real *g) {
    const real first = begins_with_real(g);
    return g->start < 0.0 ? !(first > 0.0) : first < 0.0;
}

/* ---- its jet ---- */

/* Value and derivatives of an event function. */
typedef struct {
    real value;
    real rate;
    real curvature;
    real third;
} jet_real;

static inline real sum_of_real(const event_function_real *g, const parts_real *parts) {
    return g->H3 * parts->first + g->H2 * parts->second + g->H1 * parts->third;
}

static inline real value_at_real(const event_function_real *g, const propagator_real *at) {
    return g->start + sum_of_real(g, &at->value);
}

static inline jet_real jet_at_start_real(const hopform_poles_real *poles, const event_function_real *g) {
    jet_real jet;
    jet.value = g->start;
    jet.rate = g->H3;
    jet.curvature = g->H2 - g->H3 * poles->s_1;
    jet.third = g->H1 - poles->s_1 * jet.curvature - poles->s_2 * jet.rate;
    return jet;
}

ALWAYS_real jet_real jet_at_real(const hopform_poles_real *poles, const event_function_real *g,
                                 const propagator_real *at) {
    const parts_real *w = &at->curvature;
    const real fourth = -(poles->s_1 * w->first + poles->s_2 * w->second + poles->s_3 * w->third);
    const parts_real third = {fourth, w->first, w->second};
    const jet_real jet = {value_at_real(g, at), sum_of_real(g, &at->rate), sum_of_real(g, w), sum_of_real(g, &third)};
    return jet;
}

/* The fourth derivative of an event function, but for its sign: the poles give it from the others. */
static inline real fourth_of_real(const hopform_poles_real *poles, const jet_real *at) {
    return poles->s_1 * at->third + poles->s_2 * at->curvature + poles->s_3 * at->rate;
}

/* The sum of the magnitudes of what the function or a derivative is a sum of, but for the last. */
static inline real terms_of_real(const event_function_real *g, const parts_real *parts) {
    return fabs_real(g->H3 * parts->first) + fabs_real(g->H2 * parts->second) + fabs_real(g->H1 * parts->third);
}

/* Bound of what rounding may have done to the value of an event function. */
static inline real rounding_of_real(const event_function_real *g, const propagator_real *at, real rate) {
    return 16.0 * HOPFORM_EPS_real
           * (fabs_real(g->start) + g->cancels + terms_of_real(g, &at->value) + at->t * fabs_real(rate));
}

/* ---- predict a root ---- */

/* Where in (0, 1) of an interval of length h a function has a root after a value (or slope) above 0 and before a value
 * below: roughly, as the parabola with its slope at the start. Where it starts at 0 it is divided by the time first.
 * Requires to->value < 0. */
static inline real rough_root_real(const jet_real *from, const jet_real *to, real h) {
    const bool above = from->value > 0.0;
    const real rise = h * from->rate;
    const real start = above ? from->value : rise;
    const real slope = above ? rise : 0.5 * h * h * from->curvature;
    const real square = slope * slope + 4.0 * start * (start + slope - to->value);
    const real below = sqrt_real(greater_real(square, 0.0)) - slope;
    const real share = 2.0 * start / (below > 0.0 ? below : 1.0);
    return ((start > 0.0) & (share < 1.0)) ? share : 0.75;
}

/* The polynomial of degree 6 through value, rate and curvature at both ends of an interval, and the third derivative at
 * its start, in x from 0 to 1: c0 + c1 x + c2 x^2 + c3 x^3 + x^4 (r0 + s1 (x - 1) + s2 (x - 1)^2). */
typedef struct {
    real c0, c1, c2, c3, r0, s1, s2;
} interpolant_real;

static inline interpolant_real interpolant_of_real(const jet_real *from, const jet_real *to, real h) {
    const real hh = 0.5 * h * h;
    const real c0 = from->value;
    const real c1 = h * from->rate;
    const real c2 = hh * from->curvature;
    const real c3 = (1.0 / 3.0) * h * hh * from->third;
    const real r0 = to->value - (c0 + c1 + c2 + c3);
    const real s1 = h * to->rate - (c1 + 2.0 * c2 + 3.0 * c3) - 4.0 * r0;
    const real s2 = hh * to->curvature - (c2 + 3.0 * c3) - 4.0 * s1 - 6.0 * r0;
    const interpolant_real p = {c0, c1, c2, c3, r0, s1, s2};
    return p;
}

enum { PREDICTION_STEPS_real = 3 };

/* Halley's step from x towards a root of it. */
static inline real prediction_step_real(const interpolant_real *p, real x) {
    const real y = x - 1.0;
    const real tail = p->r0 + y * (p->s1 + y * p->s2);
    const real tail_1 = p->s1 + 2.0 * y * p->s2;
    const real value = p->c0 + x * (p->c1 + x * (p->c2 + x * (p->c3 + x * tail)));
    const real slope = p->c1 + x * (2.0 * p->c2 + x * (3.0 * p->c3 + x * (4.0 * tail + x * tail_1)));
    const real bend = p->c2 + x * (3.0 * p->c3 + x * (6.0 * tail + x * (4.0 * tail_1 + x * p->s2)));
    const real below = slope * slope - value * bend;
    const real step = value * slope / (below > 0.0 ? below : 1.0);
    return below > 0.0 ? step : 0.0;
}

/* A root of it, from a guess. It guesses, too: no bound rests on it. */
static inline real refined_root_real(const interpolant_real *p, real x) {
    for (int n = 0; n < PREDICTION_STEPS_real; n++) {
        const real step = prediction_step_real(p, x);
        const real next = x - step;
        x = ((next > 0.0) & (next < 1.0)) ? next : x;
        if (fabs_real(step) < HOPFORM_PREDICTION_real * x) { break; }
    }
    return x;
}

/* ---- locate it ---- */

/* Householder's step of third order towards a root. */
static inline real step_to_root_real(const jet_real *at) {
    const real square = at->rate * at->rate;
    const real below =
        6.0 * square * at->rate - 6.0 * at->value * at->rate * at->curvature + at->value * at->value * at->third;
    const bool usable = fabs_real(below) > 0.0;
    const real step = at->value * (6.0 * square - 3.0 * at->value * at->curvature) / (usable ? below : 1.0);
    return usable ? step : HOPFORM_NEVER_real;
}

/* How often a motion may still be evaluated while a stance is solved: what its cost is in proportion to. */
typedef struct {
    int32_t left;
} evaluations_real;

enum { UNBOUNDED_real = 2147483647 };

/* What takes about as long as so many evaluations by a short series: one by exp and sin, and of a phase all that is no
 * evaluation. */
enum { EVALUATION_BY_W_real = 3, EVALUATIONS_OF_A_PHASE_real = 4 };

static inline void use_evaluations_real(evaluations_real *evaluations, int32_t count) {
    evaluations->left = evaluations->left > count ? evaluations->left - count : 0;
}

#endif
