/* SPDX-License-Identifier: MIT-0
 *
 * Primitives: the roots of the cubic as factors, and the response W of the poles to an impulse over
 * time, by the regime that loses no digits. Its own exp, sin, cos, ln, angle and cube root give the same bits on every
 * processor; with HOPFORM_LIBM defined they are the C library's, and the bits as many as there are C libraries.
 */
#ifndef HOPFORM_KERNELS_H_real
#define HOPFORM_KERNELS_H_real

#include <stdbool.h>
#include <stdint.h>

#include "facts.h"
#include "formulas_real.h"
#include "series_real.h"

static inline real lesser_real(real a, real b) {
    return a < b ? a : b;
}

/* b if a is not a number. */
static inline real greater_real(real a, real b) {
    return a > b ? a : b;
}

static inline bool is_finite_real(real value) {
    return fabs_real(value) <= HOPFORM_NEVER_real;
}

/* The poles of an element that slips while the others are held. */
static inline hopform_poles_real pair_alone_real(real p, real q) {
    const hopform_poles_real poles = {0.0, p, q, p, q, 0.0};
    return poles;
}

/* Whether the pair rings. */
static inline bool rings_real(const hopform_poles_real *poles) {
    return 0.25 * poles->p * poles->p < poles->q;
}

/* 1/n for n from 1 on. */
static const real inverse_real[] = {0.0, HOPFORM_INVERSES_real};

/* What is left of 1, and what is gone. */
typedef struct {
    real left;
    real gone;
} fade_real;

typedef struct {
    real sine;
    real cosine;
} turn_real;

/* artanh(s)/s for |s| <= 0.1716, by its power series. */
static inline real area_tangent_real(real s) {
    const real ss = s * s;
    real sum = 0.0;
#define ADD_TERM(coefficient) sum = sum * ss + (coefficient);
    HOPFORM_AREA_TANGENT_real(ADD_TERM)
#undef ADD_TERM
        return sum;
}

/* The number whose bits are these. */
static inline real real_of_bits_real(bits_real bits) {
    const union {
        bits_real bits;
        real value;
    } number = {bits};
    return number.value;
}

static inline bits_real bits_of_real_real(real value) {
    union {
        bits_real bits;
        real value;
    } number;
    number.value = value;
    return number.bits;
}

#ifdef HOPFORM_LIBM

/* exp(x) and 1 - exp(x) for x <= 0; exp(x) counts as 0 below the normal numbers. */
static inline fade_real fade_by_real(real x) {
    fade_real fade = {0.0, 1.0};
    if (x > HOPFORM_SMALLEST_EXPONENT_real) {
        fade.left = exp_real(x);
        fade.gone = -expm1_real(x);
    }
    return fade;
}

/* sin(x) and cos(x) for x >= 0; an angle without a digit left counts as 0. */
static inline turn_real turn_by_real(real x) {
    const real angle = x > 0.0 && x < HOPFORM_LARGEST_ANGLE_real ? x : 0.0;
    const turn_real turn = {sin_real(angle), cos_real(angle)};
    return turn;
}

/* The angle of (x, y), y >= 0, from 0 to pi. */
static inline real angle_real(real x, real y) {
    return atan2_real(y, x);
}

/* ln(x) for a normal x > 0. */
static inline real logarithm_real(real x) {
    return log_real(x);
}

/* The cube root of x >= 0; 0 of what is not above 0. */
static inline real cube_root_real(real x) {
    return x > 0.0 ? cbrt_real(x) : 0.0;
}

#else

/* exp(x) and 1 - exp(x) for x <= 0, by x = n ln 2 + r with |r| <= ln(2)/2 and the power series of (exp(r) - 1)/r;
 * exp(x) counts as 0 below the normal numbers. No jump: loops over many x become vector instructions. */
static inline fade_real fade_by_real(real x) {
    const bool faded = !(x > HOPFORM_SMALLEST_EXPONENT_real);
    const real above = x > HOPFORM_SMALLEST_EXPONENT_real ? x : 0.0;
    const real down = above < 0.0 ? above : 0.0; /* above 0 by rounding at most */
    const int32_t n = (int32_t)(down * 1.4426950408889634 - 0.5);
    const real halvings = (real)n;
    const real r = down - halvings * HOPFORM_LOG_2_HIGH_real - halvings * HOPFORM_LOG_2_LOW_real;
    real sum = 0.0;
#define ADD_TERM(coefficient) sum = sum * r + (coefficient);
    HOPFORM_EXPONENTIAL_real(ADD_TERM)
#undef ADD_TERM
        const signed_bits_real exponent = n + HOPFORM_EXPONENT_BIAS_real;
    const real left = (1.0 + r * sum) * real_of_bits_real((bits_real)exponent << HOPFORM_FRACTION_BITS_real);
    const real gone = n < 0 ? 1.0 - left : -r * sum;
    const fade_real fade = {faded ? 0.0 : left, faded ? 1.0 : gone};
    return fade;
}

/* sin(x) and cos(x) for x >= 0, by quarter turns and power series; an angle without a digit left counts as 0. */
static inline turn_real turn_by_real(real x) {
    const real below = x < HOPFORM_LARGEST_ANGLE_real ? x : 0.0;
    const real angle = below > 0.0 ? below : 0.0;
    const real shifted = angle * 0.6366197723675814 + HOPFORM_ROUNDER_real;
    const bits_real n = bits_of_real_real(shifted);
    const real quarters = shifted - HOPFORM_ROUNDER_real;
    const real r = angle - quarters * HOPFORM_QUARTER_TURN_HIGH_real - quarters * HOPFORM_QUARTER_TURN_MIDDLE_real
                   - quarters * HOPFORM_QUARTER_TURN_LOW_real;
    const real rr = r * r;
    real sine = 0.0;
    real cosine = 0.0;
#define ADD_TERM(coefficient) sine = sine * rr + (coefficient);
    HOPFORM_SINE_real(ADD_TERM)
#undef ADD_TERM
#define ADD_TERM(coefficient) cosine = cosine * rr + (coefficient);
        HOPFORM_COSINE_real(ADD_TERM)
#undef ADD_TERM
            sine *= r;
    const bool swap = (n & 1) != 0;
    const real first = swap ? cosine : sine;
    const real second = swap ? sine : cosine;
    const turn_real turn = {(n & 2) != 0 ? -first : first, ((n + 1) & 2) != 0 ? -second : second};
    return turn;
}

/* The angle of (x, y), y >= 0, from 0 to pi: a rational guess, turned back, leaves an angle whose series is short. */
static inline real angle_real(real x, real y) {
    const bool steep = y > fabs_real(x);
    const real tangent = steep ? fabs_real(x) / y : y / fabs_real(x);
    const real near = tangent * (1.0584 - 0.273 * tangent);
    const real first = steep ? 1.5707963267948966 - near : near;
    const real guess = x < 0.0 ? 3.141592653589793 - first : first;
    const turn_real turn = turn_by_real(guess);
    const real e = (y * turn.cosine - x * turn.sine) / (x * turn.cosine + y * turn.sine);
    const real ee = e * e;
    return guess + e * (1.0 - ee * (1.0 / 3.0 - ee * (0.2 - ee / 7.0)));
}

/* ln(x) for a normal x > 0: x = 2^n m with m between sqrt(1/2) and sqrt(2), ln(m) = 2 artanh((m - 1)/(m + 1)). */
static inline real logarithm_real(real x) {
    const bits_real bits = bits_of_real_real(x);
    signed_bits_real n = (signed_bits_real)(bits >> HOPFORM_FRACTION_BITS_real) - HOPFORM_EXPONENT_BIAS_real;
    real m = real_of_bits_real(bits - ((bits_real)n << HOPFORM_FRACTION_BITS_real));
    if (m > 1.4142135623730951) {
        m *= 0.5;
        n++;
    }
    const real s = (m - 1.0) / (m + 1.0);
    return (real)n * HOPFORM_LOG_2_HIGH_real + ((real)n * HOPFORM_LOG_2_LOW_real + 2.0 * s * area_tangent_real(s));
}

/* A step of Halley's towards the cube root of x, from y to the third power of its relative error. */
static inline real toward_cube_root_real(real x, real y) {
    const real other = x / (y * y);
    return y + y * ((other - y) / (y + y + other));
}

/* The cube root of x >= 0, to two thirds of the last digit's unit; 0 of what is not above 0.
 *
 * A third of the exponent, fraction included, is right to 1/16; Halley's step makes that 1/6000, a second one more than
 * a type holds. The last one starts from half the digits, whose square is exact: only its quotient and its sum are
 * rounded. They are rounded up, so that the quotient lies below the root and is not coarser than it.
 */
static inline real cube_root_real(real x) {
    if (!(x > 0.0)) { return 0.0; }
    const bool tiny = x < HOPFORM_SMALLEST_NORMAL_real;
    const real scaled = tiny ? x * HOPFORM_TINY_UP_real : x;
    const bits_real third_of_bias = ((bits_real)HOPFORM_EXPONENT_BIAS_real << HOPFORM_FRACTION_BITS_real) / 3;
    real y = real_of_bits_real(bits_of_real_real(scaled) / 3 + 2 * third_of_bias);
    y = toward_cube_root_real(scaled, y);
    y = toward_cube_root_real(scaled, y);
    y = real_of_bits_real(((bits_of_real_real(y) >> HOPFORM_LOWER_HALF_real) + 1) << HOPFORM_LOWER_HALF_real);
    y = toward_cube_root_real(scaled, y);
    return tiny ? y * HOPFORM_TINY_DOWN_real : y;
}

#endif

static inline real exponential_real(real x) {
    return fade_by_real(x).left;
}

/* exp(-a t) and its integrals t phi_1(-a t), t^2 phi_2(-a t), t^3 phi_3(-a t), from the last one over t^3; where that
 * is beyond the range, as late beside a pole at 0, the others without it. */
static inline decay_real decay_of_tail_real(real a, real t, real tail) {
    decay_real decay;
    decay.e3 = t * t * t * tail;
    const bool is_finite = fabs_real(decay.e3) <= HOPFORM_NEVER_real;
    const real second = 0.5 - a * t * tail;
    decay.e2 = is_finite ? 0.5 * t * t - a * decay.e3 : t * t * second;
    decay.e1 = is_finite ? t - a * decay.e2 : t * (1.0 - a * t * second);
    decay.e = 1.0 - a * decay.e1;
    return decay;
}

/* The same from the first one. */
static inline decay_real decay_of_exp_real(real a, real t, real e) {
    const real inverse = 1.0 / a;
    decay_real decay;
    decay.e = e;
    decay.e1 = (1.0 - decay.e) * inverse;
    decay.e2 = (t - decay.e1) * inverse;
    decay.e3 = (0.5 * t * t - decay.e2) * inverse;
    return decay;
}

static inline decay_real decay_at_real(real a, real t) {
    const real z = a * t;
    if (fabs_real(z) < 1.0) {
        real tail = 0.0;
#define ADD_TERM(coefficient) tail = tail * z + (coefficient);
        HOPFORM_DECAY_TAIL_real(ADD_TERM)
#undef ADD_TERM
            return decay_of_tail_real(a, t, tail);
    }
    return decay_of_exp_real(a, t, exponential_real(-z));
}

/* R over a time that is short for the pair: the series of its two highest integrals, two terms at a time. */
static inline pair_real short_pair_real(const hopform_poles_real *poles, real t) {
    const real pt = -(poles->p * t);
    const real qtt = -(poles->q * t * t);
    real before = 0.0;
    real term = 1.0 / 6.0;
    real R2 = 1.0 / 6.0;
    real R3 = 1.0 / 24.0;
    for (int n = 1; n < HOPFORM_TERMS_real - 1; n += 2) {
        const real *inverse = &inverse_real[n];
        const real next = (pt * term + qtt * before * inverse[2]) * inverse[3];
        const real last = (pt * next + qtt * term * inverse[3]) * inverse[4];
        before = next;
        term = last;
        R2 = R2 + next + last;
        R3 = R3 + next * inverse[4] + last * inverse[5];
        if (fabs_real(term) + fabs_real(before) < 0.01 * HOPFORM_EPS_real) { break; }
    }
    const pair_series_real series = {R2 * (t * t * t), R3 * (t * t * t * t)};
    const known_pair_real known = pair_from_series_real(poles, &series, t);
    const pair_real pair = {known.Rd, known.R, known.R1, series.R2, series.R3};
    return pair;
}

static inline pair_real pair_of_core_real(const hopform_poles_real *poles, real t, const pair_core_real *core) {
    const pair_integrals_real integrals = pair_by_quotient_real(poles, core, t);
    const pair_real pair = {core->Rd, core->R, integrals.R1, integrals.R2, integrals.R3};
    return pair;
}

/* What R of a pair that rings with omega is made of. */
static inline pair_core_real ringing_core_real(const hopform_poles_real *poles, real omega, real t) {
    const real mean = 0.5 * poles->p;
    const fade_real fade = fade_by_real(-mean * t);
    const turn_real half = turn_by_real(0.5 * omega * t);
    const real versine = 2.0 * half.sine * half.sine;
    const real R = fade.left * (2.0 * half.sine * half.cosine / omega);
    const pair_core_real core = {fade.left * (1.0 - versine) - mean * R, R, fade.gone + fade.left * versine - mean * R};
    return core;
}

/* R of two real poles at least 1/t apart: quotients of differences, no quotient by q. */
static inline pair_real distinct_pair_real(real slow, real fast, real t) {
    const decay_real of_slow = decay_at_real(slow, t);
    const decay_real of_fast = decay_at_real(fast, t);
    const real apart = fast - slow;
    pair_real pair;
    pair.R = (of_slow.e - of_fast.e) / apart;
    pair.R1 = (of_slow.e1 - of_fast.e1) / apart;
    pair.R2 = (of_slow.e2 - of_fast.e2) / apart;
    pair.R3 = (of_slow.e3 - of_fast.e3) / apart;
    pair.Rd = of_fast.e - slow * pair.R;
    return pair;
}

/* R, its derivative and integrals at t. */
static inline pair_real pair_at_real(const hopform_poles_real *poles, real t) {
    const real mean = 0.5 * poles->p;
    const real discriminant = mean * mean - poles->q;
    pair_core_real core;
    if (discriminant < 0.0) {
        if (poles->q * t * t < 1.0) { return short_pair_real(poles, t); }
        core = ringing_core_real(poles, sqrt_real(-discriminant), t);
    } else {
        const real half = poles->q > 0.0 ? sqrt_real(discriminant) : mean; /* the square may underflow */
        const real fast = mean + half;
        if (!(fast * t >= 2.0)) { /* nor where a gain over a mass has overflowed */
            return short_pair_real(poles, t);
        }
        const real slow = poles->q / fast;
        if (half * t >= 0.5) { return distinct_pair_real(slow, fast, t); }
        const decay_real spread = decay_at_real(-2.0 * half, t);
        const real envelope = exponential_real(-fast * t);
        core.R = envelope * spread.e1;
        core.Rd = envelope - slow * core.R;
        core.turned = 1.0 - core.Rd - poles->p * core.R;
    }
    return pair_of_core_real(poles, t, &core);
}

/* The series of the three highest integrals of W, by its last three terms. */
typedef struct {
    real earlier, before, term, W2, W3, W4;
} basis_terms_real;

static inline basis_terms_real first_basis_terms_real(void) {
    const basis_terms_real terms = {0.0, 0.0, 1.0 / 24.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0};
    return terms;
}

/* Terms n to n + 2 of it: s_1 t, s_2 t^2 and s_3 t^3, times -1. */
static inline void add_basis_terms_real(basis_terms_real *terms, real h, real hh, real hhh, int n) {
    const real *inverse = &inverse_real[n];
    const real first =
        (h * terms->term + (hh * terms->before + hhh * terms->earlier * inverse[2]) * inverse[3]) * inverse[4];
    const real second = (h * first + (hh * terms->term + hhh * terms->before * inverse[3]) * inverse[4]) * inverse[5];
    const real third = (h * second + (hh * first + hhh * terms->term * inverse[4]) * inverse[5]) * inverse[6];
    terms->earlier = first;
    terms->before = second;
    terms->term = third;
    terms->W2 = terms->W2 + first + second + third;
    terms->W3 = terms->W3 + first * inverse[5] + second * inverse[6] + third * inverse[7];
    terms->W4 = terms->W4 + first * inverse[5] * inverse[6] + second * inverse[6] * inverse[7]
                + third * inverse[7] * inverse[8];
}

static inline bool basis_terms_end_real(const basis_terms_real *terms) {
    return fabs_real(terms->term) + fabs_real(terms->before) + fabs_real(terms->earlier) < 0.002 * HOPFORM_EPS_real;
}

static inline basis_real basis_of_terms_real(const hopform_poles_real *poles, real t, const basis_terms_real *terms) {
    const real tt = t * t;
    const series_real series = {terms->W2 * (tt * tt), terms->W3 * (tt * tt * t), terms->W4 * (tt * tt * tt)};
    const known_basis_real known = all_from_series_real(poles, &series, t);
    const basis_real basis = {known.Wdd, known.Wd, known.W, known.W1, series.W2};
    return basis;
}

/* W of s^3 + s_1 s^2 + s_2 s + s_3 over a time that is short for all three poles. */
static inline basis_real short_basis_real(const hopform_poles_real *poles, real t) {
    const real h = -(poles->s_1 * t);
    const real hh = -(poles->s_2 * t * t);
    const real hhh = -(poles->s_3 * t * t * t);
    basis_terms_real terms = first_basis_terms_real();
    for (int n = 1; n < HOPFORM_TERMS_real - 2; n += 3) {
        add_basis_terms_real(&terms, h, hh, hhh, n);
        if (basis_terms_end_real(&terms)) { break; }
    }
    return basis_of_terms_real(poles, t, &terms);
}

/* W of three poles that lie within 1/t of each other and are not slow: a series around their mean. */
SELDOM_real basis_real close_basis_real(const hopform_poles_real *poles, real t) {
    const shifted_real shifted = shift_real(poles);
    const hopform_poles_real around = {0.0, 0.0, 0.0, 0.0, shifted.Q_s, shifted.T_s};
    const basis_real near = short_basis_real(&around, t);
    const shifted_series_real series = {near.Wdd, near.Wd, near.W, exponential_real(-shifted.sigma * t)};
    const response_real response = unshift_real(shifted.sigma, &series);
    const integrals_real integrals = integrals_by_recursion_real(poles, &response, t);
    const basis_real basis = {response.Wdd, response.Wd, response.W, integrals.W1, integrals.W2};
    return basis;
}

/* W split into the real pole and the pair. */
static inline basis_real basis_of_split_real(const hopform_poles_real *poles, real chi, real t, const decay_real *decay,
                                             const pair_real *pair) {
    basis_real basis = split_real(poles, chi, decay, pair);
    if (poles->a * t < 0.5) { basis.W = split_soon_real(poles, chi, decay, pair); }
    if (chi < 0.05 * poles->q) {
        const response_real response = {basis.Wdd, basis.Wd, basis.W};
        const integrals_real integrals = integrals_by_recursion_real(poles, &response, t);
        basis.W1 = integrals.W1;
        basis.W2 = integrals.W2;
    }
    return basis;
}

/* W, its derivatives and integrals at t. With a = 0, as where one mass is held, W is the integral of R.
 * a must be the most isolated root, as factor_cubic_real gives it. */
static inline basis_real basis_at_real(const hopform_poles_real *poles, real t) {
    if (HOPFORM_MOVES_ALONE || !(fabs_real(poles->a) > 0.0)) {
        const pair_real pair = pair_at_real(poles, t);
        const basis_real basis = {pair.Rd, pair.R, pair.R1, pair.R2, pair.R3};
        return basis;
    }
    const real chi = residue_real(poles);
    if (chi * t * t >= 1.0) {
        const decay_real decay = decay_at_real(poles->a, t);
        const pair_real pair = pair_at_real(poles, t);
        return basis_of_split_real(poles, chi, t, &decay, &pair);
    }
    return poles->s_1 * t < 4.0 ? short_basis_real(poles, t) : close_basis_real(poles, t);
}

/* Steps towards a root of the cubic, and to polish its factors, at most. */
enum { NEWTON_STEPS_real = 60, POLISHES_real = 3 };

/* A step of Newton's towards the positive root z of z^3 + P z = T, T > 0. */
static inline real toward_positive_root_real(real P, real T, real z) {
    const real step = ((z * z + P) * z - T) / (3.0 * z * z + P);
    return z - step;
}

/* That root, from above, where the cubic is convex. */
static inline real positive_root_real(real P, real T) {
    real z = sqrt_real(fabs_real(P)) + cube_root_real(T);
    for (int n = 0; n < NEWTON_STEPS_real; n++) {
        const real next = toward_positive_root_real(P, T, z);
        if (!(next < z)) { break; }
        z = next;
    }
    return z;
}

/* No root of a cubic exceeds three times this; root_i is the root of order i of s_i. */
static inline real scale_of_cubic_real(real s_1, real root_2, real root_3) {
    const real later = root_2 > root_3 ? root_2 : root_3;
    return s_1 > later ? s_1 : later;
}

/* A cubic in units of its scale, and around its mean root: z^3 + P z = T. */
typedef struct {
    real c_1, c_2, c_3, mean, P, T;
} cubic_real;

static inline cubic_real scaled_cubic_real(real s_1, real s_2, real s_3, real scale) {
    const real c_1 = s_1 / scale;
    const real c_2 = s_2 / (scale * scale);
    const real c_3 = s_3 / scale / (scale * scale);
    const real mean = c_1 / 3.0;
    const real P = c_2 - 3.0 * mean * mean;
    const cubic_real cubic = {c_1, c_2, c_3, mean, P, c_3 - mean * (c_2 - 2.0 * mean * mean)};
    return cubic;
}

/* Its factors, as far from its mean root as the real root is; s_i are left as they are. */
static inline void factor_at_real(const cubic_real *cubic, real offset, hopform_poles_real *poles) {
    poles->a = cubic->T > 0.0 ? cubic->mean + offset : cubic->mean - offset;
    poles->p = cubic->c_1 - poles->a;
    poles->q = poles->a > cubic->mean ? cubic->c_3 / poles->a : cubic->c_2 - poles->a * poles->p;
}

/* A step that takes the residual of the coefficients off the factors; false where there is none. */
static inline bool polish_factors_real(const cubic_real *cubic, hopform_poles_real *poles) {
    const real a = poles->a;
    const real p = poles->p;
    const real q = poles->q;
    const real r_1 = cubic->c_1 - (a + p);
    const real r_2 = cubic->c_2 - (q + a * p);
    const real r_3 = cubic->c_3 - a * q;
    const real chi = q - a * (p - a);
    const bool apart = fabs_real(chi) > 0.0; /* else three roots are one */
    const real da = (r_3 - a * (r_2 - a * r_1)) / (apart ? chi : 1.0);
    const bool small = apart & (da * da < HOPFORM_EPS_real);
    poles->q = small ? q + (r_2 - a * (r_1 - da) - p * da) : q;
    poles->p = small ? p + (r_1 - da) : p;
    poles->a = small ? a + da : a;
    return small;
}

/* s^3 + s_1 s^2 + s_2 s + s_3 = (s + a)(s^2 + p s + q) with the most isolated real root as -a.
 *
 * The root beyond the inflection on the side where it is alone is simple unless all three coincide. The
 * factors, not the roots, are then polished: the residual of the coefficients is what the motion sees.
 */
static inline hopform_poles_real factor_cubic_real(real s_1, real s_2, real s_3) {
    const real scale = scale_of_cubic_real(s_1, sqrt_real(s_2), cube_root_real(s_3));
    hopform_poles_real poles = {0.0, 0.0, 0.0, s_1, s_2, s_3};
    if (!(scale * scale * scale > 0.0)) { return poles; /* slower than the type can say */ }
    if (!(s_3 > 0.0)) { /* where both masses drift the real pole is an integrator, whatever the pair is */
        poles.p = s_1;
        poles.q = s_2;
        return poles;
    }
    const cubic_real cubic = scaled_cubic_real(s_1, s_2, s_3, scale);
    const real even = cubic.P < 0.0 ? sqrt_real(-cubic.P) : 0.0;
    const real offset = fabs_real(cubic.T) > 0.0 ? positive_root_real(cubic.P, fabs_real(cubic.T)) : even;
    factor_at_real(&cubic, offset, &poles);
    for (int n = 0; n < POLISHES_real && polish_factors_real(&cubic, &poles); n++) {}
    poles.a = poles.a * scale;
    poles.p = poles.p * scale;
    poles.q = poles.q * scale * scale;
    return poles;
}

#endif
