/* SPDX-License-Identifier: MIT-0
 *
 * Many stances at a time, one in each lane of vector registers: every loop over the lanes is one that compilers turn
 * into vector instructions. The steps, their order and so the bits are those of stance_real.c. What is rare there is
 * not done here: such a stance is left to hopform_solve_stance_real. Numbers, flags (1 or 0) and kinds are all of one
 * type.
 *
 * Before it is included, LANES_NAME is the function to make, LANES_CODE what goes before each function, and LANES_WORTH
 * how many evaluations for all lanes a stance is worth: where it takes more, stances are solved one by one for a while.
 */
#ifndef HOPFORM_LANES_H_real
#define HOPFORM_LANES_H_real

#include <stdbool.h>
#include <string.h>

#include "facts.h"
#include "columns_real.h"
#include "events_real.h"
#include "phase_real.h"

enum {
    LANES = HOPFORM_LANE_COUNT_real,
    SLOTS = 3,
    ROOT_STEPS = 6,
    MOST_STEPS = 12,
    MOST_CUTS = 24,
    MOST_WINDOWS = 7,
    SHORT_RUN = 2 * LANES,
    LONG_RUN = 4096
};

/* Lanes wait for each other, so that most are alike: idle ones are filled when no more than so many are busy. */
enum { MOST_BUSY = LANES / 4 };

#if defined(__GNUC__)
typedef real column[LANES] __attribute__((aligned(64)));
#else
typedef real column[LANES];
#endif

/* How a phase ends. */
enum { NO_END, BY_TAKEOFF, BY_VELOCITY_1, BY_THRESHOLD_1, BY_VELOCITY_2, BY_THRESHOLD_2, BY_STOP, BY_LIMIT };

/* What is done about a watch. */
enum { NOTHING, LEAVE, FIND_BOTTOM, FIND_ROOT, CUT };

static inline bool within_range(real value)
{
    return (value >= -HOPFORM_NEVER_real) & (value <= HOPFORM_NEVER_real);
}

static inline real flag(bool yes)
{
    return yes ? 1.0 : 0.0;
}

static inline real is(real kind, int one)
{
    return flag(kind >= (real)one) * flag(kind <= (real)one);
}

/* A quotient whose divisor may be zero where the result is not used. */
static inline real over(real value, real divisor)
{
    return value / (fabs_real(divisor) > 0.0 ? divisor : 1.0);
}

static inline real one_of_three(bool first, bool second, real a, real b, real c)
{
    const real later = second ? b : c;
    return first ? a : later;
}

/* A number is put only where a flag says so. */
static inline void keep(real *place, bool yes, real value)
{
    const real before = *place;
    const real after = yes ? value : before;
    *place = after;
}

/* ---- records, a column for each member ---- */
#define COLUMN(name, domain) column name;
#define TAKE_MEMBER(name, domain) columns->name[l],
#define PUT_MEMBER(name, domain) columns->name[l] = one->name;
#define KEEP_MEMBER(name, domain) keep(&columns->name[l], yes, one->name);
#define RECORD_IN_COLUMNS(record, MEMBERS)                                                                             \
    typedef struct {                                                                                                   \
        MEMBERS(COLUMN)                                                                                                \
    } record##_columns;                                                                                                \
    static inline hopform_##record##_real one_of_##record##_columns(const record##_columns *columns, int l)            \
    {                                                                                                                  \
        const hopform_##record##_real one = {MEMBERS(TAKE_MEMBER)};                                                    \
        return one;                                                                                                    \
    }                                                                                                                  \
    static inline void put_##record##_columns(record##_columns *columns, int l, const hopform_##record##_real *one)    \
    {                                                                                                                  \
        MEMBERS(PUT_MEMBER)                                                                                            \
    }                                                                                                                  \
    static inline void keep_##record##_columns(record##_columns *columns, int l, bool yes,                             \
                                               const hopform_##record##_real *one)                                     \
    {                                                                                                                  \
        MEMBERS(KEEP_MEMBER)                                                                                           \
    }

RECORD_IN_COLUMNS(robot, HOPFORM_ROBOT_MEMBERS)
RECORD_IN_COLUMNS(rates, HOPFORM_RATES_MEMBERS)
RECORD_IN_COLUMNS(poles, HOPFORM_POLES_MEMBERS)
RECORD_IN_COLUMNS(state, HOPFORM_STATE_MEMBERS)
RECORD_IN_COLUMNS(motion, HOPFORM_MOTION_MEMBERS)
RECORD_IN_COLUMNS(basis, HOPFORM_BASIS_MEMBERS)

/* A watch, one a lane. */
typedef struct {
    column H3, H2, H1, A, B, start;
} watch_columns;

typedef struct {
    column value, rate, curvature, third, turning, noise;
} sample_columns;

/* The stances under way. */
typedef struct {
    robot_columns robot;
    rates_columns rates;
    poles_columns both; /* poles while both masses slip */

    column live;   /* 1 where there is a stance */
    column left;   /* 1 where it is left to the scalar code */
    column begins; /* 1 where a phase begins now */
    column u, horizon, max_phases;

    column t, side_1, side_2, fresh_1, fresh_2, count, events;
    column alone, free;  /* the mass that has come to rest while the other was held, and its free acceleration */
    state_columns start; /* of the stance */
    state_columns state;
    column from_min; /* x1 - x1_min and x1 - x1_max: x1 itself has no digits for what is this close to a stop */
    column from_max;

    column halt, limit; /* when a mass that slips alone comes to rest, and the end of the phase: since it began, as all
                           its times */
    poles_columns poles;
    column chi, omega, longest, half_turn;
    motion_columns motion;
    watch_columns watch[SLOTS];
    column on[SLOTS], kind[SLOTS], side[SLOTS];
    bool watched[SLOTS]; /* whether one of the lanes has such a watch */
    column doubt;        /* of a threshold: what rounding may have done to friction less force */

    column low, windows; /* the window, and what is known at its ends */
    sample_columns from[SLOTS];
    sample_columns to[SLOTS];
    column end_t, found, settled; /* 1 where a watch was found */
    basis_columns end;

    column event, ending; /* what a round has brought */
    int32_t busy;         /* lanes with a stance */
    int64_t evaluations;  /* of W for all lanes */
    int64_t solved;

    hopform_plan_real plan[LANES];
    int64_t index[LANES];
    int64_t robot_number[LANES];
    int32_t listed[LANES]; /* events in the caller's list */
} lanes;

/* Whether a flag is 1 somewhere; 0 has no bit that is set. */
static inline bool any(const real *flags)
{
    uint64_t words[sizeof(column) / (sizeof(uint64_t))];
    uint64_t found = 0;
    memcpy(words, flags, sizeof words);
    for (size_t n = 0; n < sizeof words / sizeof words[0]; n++) {
        found |= words[n];
    }
    return found != 0;
}

/* Stances that are left to the scalar code. */
static inline void leave(lanes *restrict w, const real *restrict who)
{
    if (!any(who)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        keep(&w->left[l], who[l] * w->live[l] > 0.0, 1.0);
    }
}

/* ---- kernels: as those of kernels_real.h, for all lanes ---- */

/* exp(x) and 1 - exp(x) for x <= 0. */
typedef struct {
    column left, gone;
} fade_columns;

LANES_CODE static void fades_by(const real *restrict x, fade_columns *restrict fade)
{
    column safe, power, near;
    hopform_bits_real bits[LANES];
    int32_t halvings[LANES];
    for (int l = 0; l < LANES; l++) {
        const real far = x[l] > HOPFORM_SMALLEST_EXPONENT_real ? x[l] : HOPFORM_SMALLEST_EXPONENT_real;
        safe[l] = far < 0.0 ? far : 0.0;
    }
    for (int l = 0; l < LANES; l++) {
        const int32_t n = (int32_t)(safe[l] * 1.4426950408889634 - 0.5);
        const real r = safe[l] - (real)n * HOPFORM_LOG_2_HIGH_real - (real)n * HOPFORM_LOG_2_LOW_real;
        real sum = 0.0;
#define ADD_TERM(coefficient) sum = sum * r + (coefficient);
        HOPFORM_EXPONENTIAL_real(ADD_TERM)
#undef ADD_TERM
            fade->left[l] = 1.0 + r * sum;
        fade->gone[l] = -r * sum;
        bits[l] = (hopform_bits_real)(hopform_signed_bits_real)(n + HOPFORM_EXPONENT_BIAS_real)
                  << HOPFORM_FRACTION_BITS_real;
        halvings[l] = n;
    }
    memcpy(power, bits, sizeof power);
    for (int l = 0; l < LANES; l++) {
        near[l] = (real)halvings[l];
        fade->left[l] *= power[l];
    }
    for (int l = 0; l < LANES; l++) {
        const real far = 1.0 - fade->left[l];
        fade->gone[l] = near[l] < 0.0 ? far : fade->gone[l];
    }
    for (int l = 0; l < LANES; l++) {
        fade->left[l] = x[l] > HOPFORM_SMALLEST_EXPONENT_real ? fade->left[l] : 0.0;
        fade->gone[l] = x[l] > HOPFORM_SMALLEST_EXPONENT_real ? fade->gone[l] : 1.0;
    }
}

/* sin(x) and cos(x) for 0 <= x < LARGEST_TURN. */
LANES_CODE static void turns(const real *restrict x, real *restrict sine, real *restrict cosine)
{
    column angle, swap, minus_sine, minus_cosine;
    int32_t quarter[LANES];
    for (int l = 0; l < LANES; l++) {
        const real small = x[l] < 1e6 ? x[l] : 0.0;
        angle[l] = small > 0.0 ? small : 0.0;
    }
    for (int l = 0; l < LANES; l++) {
        const int32_t n = (int32_t)(angle[l] * 0.6366197723675814 + 0.5);
        const real r = angle[l] - (real)n * HOPFORM_QUARTER_TURN_HIGH_real - (real)n * HOPFORM_QUARTER_TURN_MIDDLE_real
                       - (real)n * HOPFORM_QUARTER_TURN_LOW_real;
        const real rr = r * r;
        real s = 0.0;
        real c = 0.0;
#define ADD_TERM(coefficient) s = s * rr + (coefficient);
        HOPFORM_SINE_real(ADD_TERM)
#undef ADD_TERM
#define ADD_TERM(coefficient) c = c * rr + (coefficient);
            HOPFORM_COSINE_real(ADD_TERM)
#undef ADD_TERM
                sine[l] = s * r;
        cosine[l] = c;
        quarter[l] = n;
    }
    for (int l = 0; l < LANES; l++) {
        swap[l] = (real)(quarter[l] & 1);
        minus_sine[l] = (real)(quarter[l] & 2);
        minus_cosine[l] = (real)((quarter[l] + 1) & 2);
    }
    for (int l = 0; l < LANES; l++) {
        const real first = swap[l] > 0.0 ? cosine[l] : sine[l];
        const real second = swap[l] > 0.0 ? sine[l] : cosine[l];
        sine[l] = minus_sine[l] > 0.0 ? -first : first;
        cosine[l] = minus_cosine[l] > 0.0 ? -second : second;
    }
}

/* exp(-a t) and its integrals where `wanted`. */
typedef struct {
    column e, e1, e2;
} decay_columns;

LANES_CODE static void decays(const real *restrict a, const real *restrict t, const real *restrict wanted,
                              decay_columns *restrict decay)
{
    column slow, fast, exponent;
    fade_columns fade;
    for (int l = 0; l < LANES; l++) {
        const real z = a[l] * t[l];
        slow[l] = flag((wanted[l] > 0.0) & (fabs_real(z) < 1.0));
        fast[l] = flag((wanted[l] > 0.0) & !(fabs_real(z) < 1.0));
        exponent[l] = -z;
    }
    if (any(slow)) {
        for (int l = 0; l < LANES; l++) {
            const real z = a[l] * t[l];
            real sum = 0.0;
#define ADD_TERM(coefficient) sum = sum * z + (coefficient);
            HOPFORM_DECAY_TAIL_real(ADD_TERM)
#undef ADD_TERM
                const real e3 = t[l] * t[l] * t[l] * sum;
            decay->e2[l] = 0.5 * t[l] * t[l] - a[l] * e3;
            decay->e1[l] = t[l] - a[l] * decay->e2[l];
            decay->e[l] = 1.0 - a[l] * decay->e1[l];
        }
    }
    if (any(fast)) {
        fades_by(exponent, &fade);
        for (int l = 0; l < LANES; l++) {
            const real inverse = over(1.0, a[l]);
            const real e1 = (1.0 - fade.left[l]) * inverse;
            const real e2 = (t[l] - e1) * inverse;
            keep(&decay->e[l], fast[l] > 0.0, fade.left[l]);
            keep(&decay->e1[l], fast[l] > 0.0, e1);
            keep(&decay->e2[l], fast[l] > 0.0, e2);
        }
    }
}

typedef struct {
    column Rd, R, R1, R2, R3;
} pair_columns;

/* The pair over a time that is short for it; its series as in short_bases. */
LANES_CODE static void short_pairs(lanes *restrict w, const real *restrict t, const real *restrict wanted,
                                   pair_columns *restrict pair)
{
    column pt, qtt, before, term, R2, R3, going, small;
    for (int l = 0; l < LANES; l++) {
        pt[l] = w->poles.p[l] * t[l];
        qtt[l] = w->poles.q[l] * t[l] * t[l];
        before[l] = 0.0;
        term[l] = 1.0 / 6.0;
        R2[l] = 1.0 / 6.0;
        R3[l] = 1.0 / 24.0;
    }
    for (int n = 1; n < HOPFORM_TERMS_real - 1; n += 2) {
        const real *inverse = &hopform_inverse_real[n];
        for (int l = 0; l < LANES; l++) {
            const real first = -(pt[l] * term[l] + qtt[l] * before[l] * inverse[2]) * inverse[3];
            const real second = -(pt[l] * first + qtt[l] * term[l] * inverse[3]) * inverse[4];
            R2[l] = R2[l] + first + second;
            R3[l] = R3[l] + first * inverse[4] + second * inverse[5];
            before[l] = first;
            term[l] = second;
            going[l] = wanted[l] * flag(!(fabs_real(second) + fabs_real(first) < 0.01 * HOPFORM_EPS_real));
        }
        if (!any(going)) {
            break;
        }
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_pair_series_real series = {R2[l] * (t[l] * t[l] * t[l]), R3[l] * (t[l] * t[l] * t[l] * t[l])};
        const hopform_known_pair_real known = hopform_pair_from_series_real(&poles, &series, t[l]);
        const bool here = wanted[l] > 0.0;
        keep(&pair->Rd[l], here, known.Rd);
        keep(&pair->R[l], here, known.R);
        keep(&pair->R1[l], here, known.R1);
        keep(&pair->R2[l], here, series.R2);
        keep(&pair->R3[l], here, series.R3);
        small[l] = going[l] + wanted[l] * flag(!((R2[l] > 0.0625) & (R3[l] > 0.015625)));
    }
    leave(w, small);
}

/* A pair that swings. */
LANES_CODE static void swinging_pairs(const lanes *restrict w, const real *restrict t, const real *restrict wanted,
                                      pair_columns *restrict pair)
{
    column half_angle, exponent, sine, cosine;
    fade_columns fade;
    for (int l = 0; l < LANES; l++) {
        half_angle[l] = 0.5 * w->omega[l] * t[l];
        exponent[l] = -(0.5 * w->poles.p[l]) * t[l];
    }
    fades_by(exponent, &fade);
    turns(half_angle, sine, cosine);
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const real mean = 0.5 * poles.p;
        const real versine = 2.0 * sine[l] * sine[l];
        const real R = fade.left[l] * (2.0 * sine[l] * cosine[l] / w->omega[l]);
        const real Rd = fade.left[l] * (1.0 - versine) - mean * R;
        const hopform_pair_core_real core = {Rd, R, fade.gone[l] + fade.left[l] * versine - mean * R};
        const hopform_pair_integrals_real integrals = hopform_pair_by_quotient_real(&poles, &core, t[l]);
        const bool here = wanted[l] > 0.0;
        keep(&pair->Rd[l], here, core.Rd);
        keep(&pair->R[l], here, core.R);
        keep(&pair->R1[l], here, integrals.R1);
        keep(&pair->R2[l], here, integrals.R2);
        keep(&pair->R3[l], here, integrals.R3);
    }
}

/* W of three poles over a short time.
 *
 * Lanes whose series has ended go on with the others: three terms that are this small are followed by smaller ones,
 * which change no sum that is not small itself, and where one is, the lane is left.
 */
LANES_CODE static void short_bases(lanes *restrict w, const real *restrict t, const real *restrict wanted,
                                   basis_columns *restrict basis)
{
    column h, hh, hhh, term_0, term_1, term_2, W2, W3, W4, going, small;
    for (int l = 0; l < LANES; l++) {
        h[l] = w->poles.s_1[l] * t[l];
        hh[l] = w->poles.s_2[l] * t[l] * t[l];
        hhh[l] = w->poles.s_3[l] * t[l] * t[l] * t[l];
        term_0[l] = 1.0 / 24.0;
        term_1[l] = 0.0;
        term_2[l] = 0.0;
        W2[l] = 1.0 / 24.0;
        W3[l] = 1.0 / 120.0;
        W4[l] = 1.0 / 720.0;
    }
    for (int n = 1; n < HOPFORM_TERMS_real - 2; n += 3) {
        const real *inverse = &hopform_inverse_real[n];
        for (int l = 0; l < LANES; l++) {
            const real a = h[l];
            const real b = hh[l];
            const real c = hhh[l];
            const real first =
                -(a * term_0[l] + (b * term_1[l] + c * term_2[l] * inverse[2]) * inverse[3]) * inverse[4];
            const real second = -(a * first + (b * term_0[l] + c * term_1[l] * inverse[3]) * inverse[4]) * inverse[5];
            const real third = -(a * second + (b * first + c * term_0[l] * inverse[4]) * inverse[5]) * inverse[6];
            W2[l] = W2[l] + first + second + third;
            W3[l] = W3[l] + first * inverse[5] + second * inverse[6] + third * inverse[7];
            W4[l] = W4[l] + first * inverse[5] * inverse[6] + second * inverse[6] * inverse[7]
                    + third * inverse[7] * inverse[8];
            term_2[l] = first;
            term_1[l] = second;
            term_0[l] = third;
            going[l] =
                wanted[l] * flag(!(fabs_real(third) + fabs_real(second) + fabs_real(first) < 0.002 * HOPFORM_EPS_real));
        }
        if (!any(going)) {
            break;
        }
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const real tt = t[l] * t[l];
        const hopform_series_real series = {W2[l] * (tt * tt), W3[l] * (tt * tt * t[l]), W4[l] * (tt * tt * tt)};
        const hopform_known_basis_real known = hopform_all_from_series_real(&poles, &series, t[l]);
        const hopform_basis_real one = {known.Wdd, known.Wd, known.W, known.W1, series.W2};
        keep_basis_columns(basis, l, wanted[l] > 0.0, &one);
        small[l] =
            going[l] + wanted[l] * flag(!((W2[l] > 0.0078125) & (W3[l] > 0.0009765625) & (W4[l] > 0.0001220703125)));
    }
    leave(w, small);
}

/* W at t where `wanted`; a lane whose poles are of another kind is left. */
LANES_CODE static void bases_at(lanes *restrict w, const real *restrict t, const real *restrict wanted,
                                basis_columns *restrict basis)
{
    column brief, pairs, swift, swings, splits, close;
    w->evaluations++;
    for (int l = 0; l < LANES; l++) {
        const bool here = wanted[l] > 0.0;
        const bool held = !(fabs_real(w->poles.a[l]) > 0.0);
        const bool late = w->chi[l] * t[l] * t[l] >= 1.0;
        const bool soon = w->poles.s_1[l] * t[l] < 4.0;
        const bool early = w->poles.q[l] * t[l] * t[l] < 1.0;
        brief[l] = flag(here & !held & !late & soon);
        const bool faded = (0.5 * w->poles.p[l] - w->poles.a[l]) * t[l] > 10.0;
        const bool by_pair = held | late;
        const bool beyond = by_pair & !(w->omega[l] * t[l] < 1e6);
        const bool between = (faded | !(late | soon)) & !held;
        close[l] = flag(here & (between | beyond));
        pairs[l] = flag(here & by_pair);
        swift[l] = flag(here & by_pair & early);
        swings[l] = flag(here & by_pair & !early);
        splits[l] = flag(here & !held & late);
    }
    leave(w, close);
    if (any(brief)) {
        short_bases(w, t, brief, basis);
    }
    if (!any(pairs)) {
        return;
    }
    pair_columns pair = {{0}, {0}, {0}, {0}, {0}};
    if (any(swings)) {
        swinging_pairs(w, t, swings, &pair);
    }
    if (any(swift)) {
        short_pairs(w, t, swift, &pair);
    }
    for (int l = 0; l < LANES; l++) {
        const bool here = (pairs[l] > 0.0) & !(splits[l] > 0.0);
        keep(&basis->Wdd[l], here, pair.Rd[l]);
        keep(&basis->Wd[l], here, pair.R[l]);
        keep(&basis->W[l], here, pair.R1[l]);
        keep(&basis->W1[l], here, pair.R2[l]);
        keep(&basis->W2[l], here, pair.R3[l]);
    }
    if (!any(splits)) {
        return;
    }
    decay_columns decay = {{0}, {0}, {0}};
    decays(w->poles.a, t, splits, &decay);
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_decay_real one_decay = {decay.e[l], decay.e1[l], decay.e2[l], 0.0};
        const hopform_pair_real one_pair = {pair.Rd[l], pair.R[l], pair.R1[l], pair.R2[l], 0.0};
        const real chi = splits[l] > 0.0 ? w->chi[l] : 1.0;
        const hopform_basis_real split = hopform_split_real(&poles, chi, &one_decay, &one_pair);
        const real soon = hopform_split_soon_real(&poles, chi, &one_decay, &one_pair);
        keep_basis_columns(basis, l, splits[l] > 0.0, &split);
        keep(&basis->W[l], (splits[l] > 0.0) & (poles.a * t[l] < 0.5), soon);
        close[l] = flag((splits[l] > 0.0) & (chi < 0.05 * poles.q));
    }
    if (any(close)) {
        for (int l = 0; l < LANES; l++) {
            const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
            const hopform_basis_real one = one_of_basis_columns(basis, l);
            const hopform_response_real response = {one.Wdd, one.Wd, one.W};
            const hopform_poles_real safe = {poles.a,   poles.p,   poles.q,
                                             poles.s_1, poles.s_2, poles.s_3 > 0.0 ? poles.s_3 : 1.0};
            const hopform_integrals_real integrals = hopform_integrals_by_recursion_real(&safe, &response, t[l]);
            keep(&basis->W1[l], close[l] > 0.0, integrals.W1);
            keep(&basis->W2[l], close[l] > 0.0, integrals.W2);
        }
    }
}

/* ---- samples ---- */

static inline hopform_sample_real sample_of(const watch_columns *watch, const poles_columns *poles,
                                            const hopform_basis_real *basis, int l, real t)
{
    const hopform_poles_real one = one_of_poles_columns(poles, l);
    const hopform_numerator_real h = {watch->H3[l], watch->H2[l], watch->H1[l]};
    const hopform_pair_numerator_real left = {watch->A[l], watch->B[l]};
    const hopform_rise_real rise = hopform_rises_real(&one, &h, basis);
    const real noise = 16.0 * HOPFORM_EPS_real
                       * (fabs_real(watch->start[l]) + fabs_real(h.H3 * basis->Wd) + fabs_real(h.H2 * basis->W)
                          + fabs_real(h.H1 * basis->W1) + t * fabs_real(rise.rise_rate));
    const hopform_sample_real sample = {watch->start[l] + rise.rise,
                                        rise.rise_rate,
                                        rise.rise_curvature,
                                        rise.rise_third,
                                        hopform_turning_real(&one, &left, basis),
                                        noise};
    return sample;
}

static inline void keep_sample(sample_columns *samples, int l, bool yes, const hopform_sample_real *sample)
{
    keep(&samples->value[l], yes, sample->value);
    keep(&samples->rate[l], yes, sample->rate);
    keep(&samples->curvature[l], yes, sample->curvature);
    keep(&samples->third[l], yes, sample->third);
    keep(&samples->turning[l], yes, sample->turning);
    keep(&samples->noise[l], yes, sample->noise);
}

static inline hopform_sample_real one_sample(const sample_columns *samples, int l)
{
    const hopform_sample_real sample = {samples->value[l], samples->rate[l],    samples->curvature[l],
                                        samples->third[l], samples->turning[l], samples->noise[l]};
    return sample;
}

/* One watch where `wanted`. */
LANES_CODE static void sample_watch(const lanes *restrict w, const watch_columns *restrict watch,
                                    const basis_columns *restrict basis, const real *restrict t,
                                    const real *restrict wanted, sample_columns *restrict samples)
{
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_real one = one_of_basis_columns(basis, l);
        const hopform_sample_real sample = sample_of(watch, &w->poles, &one, l, t[l]);
        keep_sample(samples, l, wanted[l] > 0.0, &sample);
    }
}

/* All watches at the end of the window, where `wanted`. */
LANES_CODE static void sample_ends(lanes *restrict w, const real *restrict wanted)
{
    for (int s = 0; s < SLOTS; s++) {
        if (w->watched[s]) {
            sample_watch(w, &w->watch[s], &w->end, w->end_t, wanted, &w->to[s]);
        }
    }
}

/* ---- the start of a phase ---- */

/* Poles of the mode; lanes with two real poles in the pair are lost here. */
LANES_CODE static void start_poles(lanes *restrict w, real *restrict lost)
{
    for (int l = 0; l < LANES; l++) {
        const bool begins = w->begins[l] > 0.0;
        const bool held_1 = !(fabs_real(w->side_1[l]) > 0.0);
        const bool held = held_1 | !(fabs_real(w->side_2[l]) > 0.0);
        const real p_held = held_1 ? w->rates.p_2[l] : w->rates.p_1[l];
        const real q_held = held_1 ? w->rates.q_2[l] : w->rates.q_1[l];
        const hopform_poles_real both = one_of_poles_columns(&w->both, l);
        const hopform_poles_real poles = {held ? 0.0 : both.a,      held ? p_held : both.p,   held ? q_held : both.q,
                                          held ? p_held : both.s_1, held ? q_held : both.s_2, held ? 0.0 : both.s_3};
        keep_poles_columns(&w->poles, l, begins, &poles);
        const real mean = 0.5 * w->poles.p[l];
        const real square = w->poles.q[l] - mean * mean;
        const real omega = square > 0.0 ? sqrt_real(square) : 1.0;
        lost[l] = flag(begins & !(square > 0.0));
        const hopform_poles_real now = one_of_poles_columns(&w->poles, l);
        w->chi[l] = hopform_residue_real(&now);
        w->omega[l] = omega;
        w->half_turn[l] = 3.14159265358979323846 / omega;
        keep(&w->low[l], begins, 0.0);
        keep(&w->windows[l], begins, 0.0);
    }
}

/* The masses that move where a phase begins; in most rounds they are the same in all lanes. */
typedef struct {
    column both, actuator, body;
} mode_columns;

static inline hopform_drive_real drive_in(const lanes *w, int l)
{
    const hopform_robot_real robot = one_of_robot_columns(&w->robot, l);
    const hopform_rates_real rates = one_of_rates_columns(&w->rates, l);
    return hopform_drive_of_real(&robot, &rates, w->u[l], w->side_1[l], w->side_2[l]);
}

LANES_CODE static void start_modes(const lanes *restrict w, mode_columns *restrict mode)
{
    for (int l = 0; l < LANES; l++) {
        mode->both[l] = w->begins[l] * fabs_real(w->side_1[l] * w->side_2[l]);
        mode->actuator[l] = w->begins[l] * fabs_real(w->side_1[l]) * (1.0 - fabs_real(w->side_2[l]));
        mode->body[l] = w->begins[l] * (1.0 - fabs_real(w->side_1[l]));
    }
}

#define MOVE(moving)                                                                                                   \
    LANES_CODE static void move_##moving(lanes *restrict w, const real *restrict who)                                  \
    {                                                                                                                  \
        for (int l = 0; l < LANES; l++) {                                                                              \
            const hopform_rates_real rates = one_of_rates_columns(&w->rates, l);                                       \
            const hopform_state_real state = one_of_state_columns(&w->state, l);                                       \
            const hopform_drive_real drive = drive_in(w, l);                                                           \
            const hopform_motion_real motion = hopform_motion_of_##moving##_real(&rates, &drive, &state);              \
            keep_motion_columns(&w->motion, l, who[l] > 0.0, &motion);                                                 \
        }                                                                                                              \
    }

MOVE(both)
MOVE(actuator)
MOVE(body)

LANES_CODE static void start_motion(lanes *restrict w, const mode_columns *restrict mode)
{
    column alone, alone_1, alone_2, alone_H2;
    if (any(mode->both)) {
        move_both(w, mode->both);
    }
    if (any(mode->actuator)) {
        move_actuator(w, mode->actuator);
    }
    if (any(mode->body)) {
        move_body(w, mode->body);
    }
    for (int l = 0; l < LANES; l++) {
        alone_1[l] = w->begins[l] * is(w->alone[l], 1) * fabs_real(w->side_1[l]);
        alone_2[l] = w->begins[l] * is(w->alone[l], 2) * fabs_real(w->side_2[l]);
        alone[l] = alone_1[l] + alone_2[l];
    }
    if (!any(alone)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        const real H3_1 = w->free[l] - w->side_1[l] * w->robot.f1[l];
        const real H3_2 = w->free[l] - w->side_2[l] * w->robot.f2[l];
        keep(&w->motion.H3_1[l], alone_1[l] > 0.0, H3_1);
        keep(&w->motion.N2_1[l], alone_1[l] > 0.0, H3_1);
        keep(&w->motion.H3_2[l], alone_2[l] > 0.0, H3_2);
        alone_H2[l] = alone_1[l] > 0.0 ? H3_1 : -H3_2;
    }
    for (int l = 0; l < LANES; l++) {
        keep(&w->motion.H2_y[l], alone[l] > 0.0, alone_H2[l]);
    }
}

/* Lanes in which y rings about 0, as in stance_real.c, are told. */
LANES_CODE static void rings_about_zero(const lanes *restrict w, const real *restrict alone, real *restrict rings)
{
    for (int l = 0; l < LANES; l++) {
        const hopform_rates_real rates = one_of_rates_columns(&w->rates, l);
        const hopform_state_real slack = {0.0, 0.0, 0.0, 0.0};
        const hopform_free_real free = hopform_free_accelerations_real(&rates, &slack, w->u[l]);
        const real left_1 = free.free_1 - w->side_1[l] * w->robot.f1[l];
        const real left_2 = free.free_2 - w->side_2[l] * w->robot.f2[l];
        const real left = fabs_real(w->side_2[l]) > 0.0 ? left_2 : left_1;
        rings[l] = alone[l] * flag(!(w->state.y[l] < 0.0)) * flag(!(fabs_real(left) > 0.0));
    }
}

/* When each mass that slips alone comes to rest, as hopform_halt_time_real of a pair that swings; the phase ends there
 * at last. */
LANES_CODE static void start_halts(lanes *restrict w, real *restrict lost)
{
    column alone, v, acc, x, steep, tangent, guess, sine, cosine, at_once, halt;
    for (int l = 0; l < LANES; l++) {
        const bool only_1 = !(fabs_real(w->side_2[l]) > 0.0);
        const real sign = only_1 ? w->side_1[l] : w->side_2[l];
        v[l] = sign * (only_1 ? w->state.v1[l] : w->state.v2[l]);
        acc[l] = sign * (only_1 ? w->motion.H3_1[l] : w->motion.H3_2[l]);
        alone[l] = w->begins[l] * (1.0 - fabs_real(w->side_1[l] * w->side_2[l]));
        halt[l] = HOPFORM_NEVER_real;
        at_once[l] = 0.0;
    }
    if (any(alone)) {
        rings_about_zero(w, alone, at_once);
        for (int l = 0; l < LANES; l++) {
            const real mean = 0.5 * w->poles.p[l];
            x[l] = -(acc[l] + mean * v[l]) / w->omega[l];
            steep[l] = flag(v[l] > fabs_real(x[l]));
        }
        for (int l = 0; l < LANES; l++) {
            const real below = steep[l] > 0.0 ? v[l] : fabs_real(x[l]);
            const real above = steep[l] > 0.0 ? fabs_real(x[l]) : v[l];
            tangent[l] = over(above, below);
        }
        for (int l = 0; l < LANES; l++) {
            const real near = tangent[l] * (1.0584 - 0.273 * tangent[l]);
            const real from_quarter = 1.5707963267948966 - near;
            guess[l] = steep[l] > 0.0 ? from_quarter : near;
        }
        for (int l = 0; l < LANES; l++) {
            const real back = 3.141592653589793 - guess[l];
            guess[l] = x[l] < 0.0 ? back : guess[l];
        }
        turns(guess, sine, cosine);
        for (int l = 0; l < LANES; l++) {
            const real e = over(v[l] * cosine[l] - x[l] * sine[l], x[l] * cosine[l] + v[l] * sine[l]);
            const real ee = e * e;
            const real angle = guess[l] + e * (1.0 - ee * (1.0 / 3.0 - ee * (0.2 - ee / 7.0)));
            halt[l] = angle / w->omega[l];
            at_once[l] += alone[l] * flag(!(v[l] > 0.0)) * flag(!(acc[l] > 0.0));
        }
        for (int l = 0; l < LANES; l++) {
            halt[l] = v[l] > 0.0 ? halt[l] : w->half_turn[l];
        }
        for (int l = 0; l < LANES; l++) {
            halt[l] = alone[l] > 0.0 ? halt[l] : HOPFORM_NEVER_real;
        }
    }
    for (int l = 0; l < LANES; l++) {
        const bool begins = w->begins[l] > 0.0;
        const real until = w->horizon[l] - w->t[l];
        keep(&w->halt[l], begins, halt[l]);
        keep(&w->limit[l], begins, halt[l] < until ? halt[l] : until);
        lost[l] += at_once[l];
    }
}

/* Whether a lane's actuator is kept from moving up or down, a side. */
static inline bool blocks(const lanes *w, int l, real side)
{
    const bool at_end = side < 0.0 ? w->from_min[l] <= 0.0 : w->from_max[l] >= 0.0;
    return at_end | !(w->robot.x1_min[l] < w->robot.x1_max[l]);
}

static inline void keep_watch(lanes *w, int s, int l, bool yes, real on, real kind, real side,
                              const hopform_watch_real *watch)
{
    keep(&w->on[s][l], yes, on);
    keep(&w->kind[s][l], yes, kind);
    keep(&w->side[s][l], yes, side);
    keep(&w->watch[s].H3[l], yes, watch->numerator.H3);
    keep(&w->watch[s].H2[l], yes, watch->numerator.H2);
    keep(&w->watch[s].H1[l], yes, watch->numerator.H1);
    keep(&w->watch[s].A[l], yes, watch->left.A);
    keep(&w->watch[s].B[l], yes, watch->left.B);
    keep(&w->watch[s].start[l], yes, watch->start);
}

/* Take-off. */
LANES_CODE static void watch_leg(lanes *restrict w)
{
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_motion_real m = one_of_motion_columns(&w->motion, l);
        const hopform_watch_real leg = hopform_watch_of_real(&poles, m.H3_y, m.H2_y, m.H1_y, w->state.y[l], 1.0, 0, 0);
        const real falls = flag((w->side_1[l] < 0.0) | (w->side_2[l] > 0.0)
                                | (w->state.y[l] < 0.0)); /* else y only rises, from 0 or above */
        keep_watch(w, 0, l, w->begins[l] > 0.0, falls, BY_TAKEOFF, 0.0, &leg);
    }
}

/* The velocities of both masses. */
LANES_CODE static void watch_velocities(lanes *restrict w, const real *restrict who)
{
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_motion_real m = one_of_motion_columns(&w->motion, l);
        const real H3_1 = w->fresh_1[l] > 0.0 ? 0.0 : m.H3_1;
        const real H3_2 = w->fresh_2[l] > 0.0 ? 0.0 : m.H3_2;
        const hopform_watch_real velocity_1 =
            hopform_watch_of_real(&poles, H3_1, m.H2_1, m.H1_1, w->state.v1[l], w->side_1[l], 0, 0);
        const hopform_watch_real velocity_2 =
            hopform_watch_of_real(&poles, H3_2, m.H2_2, m.H1_2, w->state.v2[l], w->side_2[l], 0, 0);
        keep_watch(w, 1, l, who[l] > 0.0, 1.0, BY_VELOCITY_1, 0.0, &velocity_1);
        keep_watch(w, 2, l, who[l] > 0.0, 1.0, BY_VELOCITY_2, 0.0, &velocity_2);
        keep(&w->doubt[l], who[l] > 0.0, 0.0);
    }
}

/* Where a mass that is held slips to on either side, while the other one moves. */
LANES_CODE static void watch_thresholds(lanes *restrict w, const real *restrict who)
{
    column blocked_below, blocked_above, free, friction;
    watch_columns slips;
    for (int l = 0; l < LANES; l++) {
        const hopform_rates_real rates = one_of_rates_columns(&w->rates, l);
        const hopform_state_real state = one_of_state_columns(&w->state, l);
        const hopform_motion_real m = one_of_motion_columns(&w->motion, l);
        const hopform_free_real at_rest = hopform_free_accelerations_real(&rates, &state, w->u[l]);
        const hopform_numerator_real free_1 = hopform_free_numerator_1_real(&rates, &m);
        const hopform_numerator_real free_2 = hopform_free_numerator_2_real(&rates, &m);
        const bool held_1 = !(fabs_real(w->side_1[l]) > 0.0);
        free[l] = held_1 ? at_rest.free_1 : at_rest.free_2;
        friction[l] = held_1 ? w->robot.f1[l] : w->robot.f2[l];
        slips.H3[l] = held_1 ? free_1.H3 : free_2.H3;
        slips.H2[l] = held_1 ? free_1.H2 : free_2.H2;
        slips.H1[l] = held_1 ? free_1.H1 : free_2.H1;
        blocked_below[l] = flag(blocks(w, l, -1.0));
        blocked_above[l] = flag(blocks(w, l, 1.0));
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const real held_1 = 1.0 - fabs_real(w->side_1[l]);
        const hopform_watch_real below =
            hopform_watch_of_real(&poles, slips.H3[l], slips.H2[l], slips.H1[l], friction[l] + free[l], 1.0, 0, 0);
        const hopform_watch_real above =
            hopform_watch_of_real(&poles, -slips.H3[l], -slips.H2[l], -slips.H1[l], friction[l] - free[l], 1.0, 0, 0);
        const real kind = held_1 * (real)BY_THRESHOLD_1 + (1.0 - held_1) * (real)BY_THRESHOLD_2;
        const real per_y = held_1 > 0.0 ? w->rates.a1_y[l] : w->rates.a2_y[l];
        const real per_v = held_1 > 0.0 ? w->rates.a1_v2[l] : w->rates.a2_v1[l];
        const real along = (flag(per_y > 0.0) - flag(per_y < 0.0)) * (w->side_1[l] - w->side_2[l]);
        const real towards = fabs_real(per_v) > 0.0 ? 0.0 : along; /* where it may slip to, 0 for either side */
        const real on_below = flag(!(towards > 0.0)) * (1.0 - held_1 * blocked_below[l]);
        const real on_above = flag(!(towards < 0.0)) * (1.0 - held_1 * blocked_above[l]);
        keep_watch(w, 1, l, who[l] > 0.0, on_below, kind, -1.0, &below);
        keep_watch(w, 2, l, who[l] > 0.0, on_above, kind, 1.0, &above);
        keep(&w->doubt[l], who[l] > 0.0, 4.0 * HOPFORM_EPS_real * (friction[l] + fabs_real(free[l])));
    }
}

LANES_CODE static void start_watches(lanes *restrict w, mode_columns *restrict mode)
{
    watch_leg(w);
    if (any(mode->both)) {
        watch_velocities(w, mode->both);
    }
    for (int l = 0; l < LANES; l++) {
        mode->body[l] += mode->actuator[l];
    }
    if (any(mode->body)) {
        watch_thresholds(w, mode->body);
    }
}

/* What is known of a watch when a phase begins, and whether it is below zero already. */
LANES_CODE static void start_samples(const lanes *restrict w, const watch_columns *restrict watch,
                                     const real *restrict on, sample_columns *restrict from, real *restrict lost)
{
    column below;
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_watch_real one = {
            {watch->H3[l], watch->H2[l], watch->H1[l]}, {watch->A[l], watch->B[l]}, watch->start[l], 0, 0};
        const hopform_sample_real sample = hopform_first_sample_real(&one, &poles);
        keep_sample(from, l, w->begins[l] > 0.0, &sample);
        below[l] = flag(w->begins[l] > 0.0) * flag(on[l] > 0.0) * flag(sample.value < 0.0);
    }
    for (int l = 0; l < LANES; l++) {
        keep(&from->value[l], below[l] > 0.0, 0.0);
        lost[l] += below[l] * flag(from->rate[l] <= 0.0);
    }
}

/* A lane that is lost to what this does is left. */
LANES_CODE static void start_phases(lanes *restrict w)
{
    column lost;
    mode_columns mode;
    start_poles(w, lost);
    start_modes(w, &mode);
    start_motion(w, &mode);
    start_halts(w, lost);
    start_watches(w, &mode);
    for (int s = 0; s < SLOTS; s++) {
        w->watched[s] = any(w->on[s]);
        if (w->watched[s]) {
            start_samples(w, &w->watch[s], w->on[s], &w->from[s], lost);
        }
    }
    leave(w, lost);
}

/* ---- a window ---- */

/* Time to the root of a watch if it swung with the pair's frequency about a constant, as hopform_swing_to_zero_real has
 * it. */
LANES_CODE static void swings_to_zero(const sample_columns *restrict from, const real *restrict per_omega,
                                      real *restrict swing)
{
    column above, below, falls, angle;
    for (int l = 0; l < LANES; l++) {
        const real value = from->value[l] > 0.0 ? from->value[l] : 0.0;
        const real per = per_omega[l];
        const real slope = from->rate[l] * per;
        const real bend = 2.0 * from->curvature[l] * (per * per);
        const real discriminant = slope * slope - (value + bend) * value;
        const real root = sqrt_real(discriminant > 0.0 ? discriminant : 0.0);
        const real least = slope < -bend ? slope : -bend;
        above[l] = value > 0.0 ? value : -2.0 * slope;
        below[l] = value > 0.0 ? root - slope : bend;
        falls[l] = value > 0.0 ? root - slope : least;
        angle[l] = discriminant;
    }
    for (int l = 0; l < LANES; l++) {
        falls[l] = angle[l] >= 0.0 ? falls[l] : -1.0;
    }
    for (int l = 0; l < LANES; l++) {
        const bool far = fabs_real(above[l]) > fabs_real(below[l]);
        const real less = far ? below[l] : above[l];
        const real more = far ? above[l] : below[l];
        const real near = over(less, more);
        const real close = near * (1.0584 - 0.273 * near);
        const real from_quarter = 1.5708 - close;
        angle[l] = far ? from_quarter : close;
    }
    for (int l = 0; l < LANES; l++) {
        const real time = 2.0 * angle[l] * per_omega[l];
        swing[l] = falls[l] > 0.0 ? time : HOPFORM_NEVER_real;
    }
}

/* A watch where a flag says so. */
LANES_CODE static void choose_watch(const watch_columns *restrict watch, const real *restrict yes,
                                    watch_columns *restrict chosen)
{
    for (int l = 0; l < LANES; l++) {
        const bool here = yes[l] > 0.0;
        keep(&chosen->H3[l], here, watch->H3[l]);
        keep(&chosen->H2[l], here, watch->H2[l]);
        keep(&chosen->H1[l], here, watch->H1[l]);
        keep(&chosen->A[l], here, watch->A[l]);
        keep(&chosen->B[l], here, watch->B[l]);
        keep(&chosen->start[l], here, watch->start[l]);
    }
}

/* The search for the first root that swinging on would bring. */
typedef struct {
    watch_columns watch;
    column number;     /* of the watch */
    column far, close; /* where the window ends at most, and if no root is found */
    column t, seeks, lands, closes;
} outlook;

/* What a guess takes of the sample of the watch with this number. */
static inline hopform_sample_real one_ahead(const lanes *w, real number, int l)
{
    const sample_columns *from = w->from;
    const bool first = number < 0.5;
    const bool second = number < 1.5;
    const hopform_sample_real sample = {
        one_of_three(first, second, from[0].value[l], from[1].value[l], from[2].value[l]),
        one_of_three(first, second, from[0].rate[l], from[1].rate[l], from[2].rate[l]),
        one_of_three(first, second, from[0].curvature[l], from[1].curvature[l], from[2].curvature[l]),
        one_of_three(first, second, from[0].third[l], from[1].third[l], from[2].third[l]),
        0.0,
        0.0};
    return sample;
}

/* The watch whose number a lane has. */
LANES_CODE static void choose_ahead(const lanes *restrict w, outlook *restrict ahead)
{
    const watch_columns *watch = w->watch;
    for (int l = 0; l < LANES; l++) {
        const bool first = ahead->number[l] < 0.5;
        const bool second = ahead->number[l] < 1.5;
        ahead->watch.H3[l] = one_of_three(first, second, watch[0].H3[l], watch[1].H3[l], watch[2].H3[l]);
        ahead->watch.H2[l] = one_of_three(first, second, watch[0].H2[l], watch[1].H2[l], watch[2].H2[l]);
        ahead->watch.H1[l] = one_of_three(first, second, watch[0].H1[l], watch[1].H1[l], watch[2].H1[l]);
        ahead->watch.A[l] = one_of_three(first, second, watch[0].A[l], watch[1].A[l], watch[2].A[l]);
        ahead->watch.B[l] = one_of_three(first, second, watch[0].B[l], watch[1].B[l], watch[2].B[l]);
        ahead->watch.start[l] = one_of_three(first, second, watch[0].start[l], watch[1].start[l], watch[2].start[l]);
    }
}

LANES_CODE static void look_ahead(const lanes *restrict w, outlook *restrict ahead)
{
    column after, swing, sooner, after_fade, watched, per_omega;
    for (int l = 0; l < LANES; l++) {
        per_omega[l] = 1.0 / w->omega[l];
        after[l] = 0.96875 * w->half_turn[l];
        ahead->number[l] = -1.0;
        watched[l] = 0.0;
    }
    for (int s = 0; s < SLOTS; s++) {
        const real *on = w->on[s];
        if (!w->watched[s]) {
            continue;
        }
        swings_to_zero(&w->from[s], per_omega, swing);
        for (int l = 0; l < LANES; l++) {
            sooner[l] = flag((on[l] > 0.0) & (swing[l] < after[l]));
            watched[l] += on[l];
        }
        for (int l = 0; l < LANES; l++) {
            keep(&after[l], sooner[l] > 0.0, swing[l]);
            keep(&ahead->number[l], sooner[l] > 0.0, (real)s);
        }
    }
    choose_ahead(w, ahead);
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_sample_real from = one_ahead(w, ahead->number[l], l);
        const real step = hopform_swing_step_real(&poles, &from, w->omega[l], after[l]);
        const bool nearer = (ahead->number[l] >= 0.0) & (fabs_real(step) < 0.25 * after[l]);
        const real moved = after[l] - step;
        keep(&after[l], nearer, moved);
    }
    for (int l = 0; l < LANES; l++) {
        const real p = w->poles.p[l];
        const real in_fade = over(8.0, p);
        after_fade[l] = p * w->half_turn[l] > 8.0 ? in_fade : w->half_turn[l];
    }
    for (int l = 0; l < LANES; l++) {
        const real low = 3.0 * w->low[l];
        after_fade[l] = after_fade[l] > low ? after_fade[l] : low;
    }
    for (int l = 0; l < LANES; l++) {
        const real half = 0.96875 * w->half_turn[l];
        after_fade[l] = half < after_fade[l] ? half : after_fade[l];
        keep(&after_fade[l], !(watched[l] > 0.0), HOPFORM_NEVER_real);
    }
    for (int l = 0; l < LANES; l++) {
        const real low = w->low[l];
        const real longest = after_fade[l];
        const real least = w->windows[l] > 3.0 ? 0.125 * w->half_turn[l] : 64.0 * HOPFORM_EPS_real * low;
        const real wanted = ahead->number[l] >= 0.0 ? 1.015625 * after[l] : longest;
        const real reach = wanted > least ? wanted : least;
        ahead->far[l] = longest < w->limit[l] - low ? low + longest : w->limit[l];
        ahead->close[l] = low + reach;
        ahead->t[l] = low + after[l];
    }
    for (int l = 0; l < LANES; l++) {
        const bool inside = (ahead->close[l] > w->low[l]) & (ahead->close[l] < ahead->far[l]);
        ahead->close[l] = inside ? ahead->close[l] : ahead->far[l];
        ahead->t[l] = ahead->t[l] < ahead->far[l] ? ahead->t[l] : ahead->far[l];
    }
    for (int l = 0; l < LANES; l++) {
        const bool seeks = ahead->number[l] >= 0.0;
        ahead->t[l] = seeks ? ahead->t[l] : ahead->close[l];
        ahead->seeks[l] = flag((w->live[l] > 0.0) & seeks);
        ahead->closes[l] = flag((w->live[l] > 0.0) & !seeks);
        ahead->lands[l] = 0.0;
    }
}

static inline real fourth_of(const poles_columns *poles, int l, const hopform_sample_real *at)
{
    return poles->s_1[l] * at->third + poles->s_2[l] * at->curvature + poles->s_3[l] * at->rate;
}

static inline bool one_step_left(const poles_columns *poles, int l, const hopform_sample_real *at, real fourth, real t,
                                 real step)
{
    const hopform_poles_real one = one_of_poles_columns(poles, l);
    const real per_rate = over(fabs_real(step), fabs_real(at->rate));
    const real bend = per_rate * fabs_real(at->curvature);
    const real twist = per_rate * fabs_real(step * at->third);
    const real error = bend * (0.7 * bend * bend + 0.5 * twist) + 0.05 * per_rate * fabs_real(step * step * fourth);
    return (fabs_real(at->value) <= 2.0 * fabs_real(step * at->rate))
           & (fabs_real(step) * error <= HOPFORM_EPS_real * t) & hopform_is_near_real(&one, t, step);
}

static inline real step_to_root(const hopform_sample_real *at)
{
    const real rate2 = at->rate * at->rate;
    const real below =
        6.0 * rate2 * at->rate - 6.0 * at->value * at->rate * at->curvature + at->value * at->value * at->third;
    const real step = over(at->value * (6.0 * rate2 - 3.0 * at->value * at->curvature), below);
    return fabs_real(below) > 0.0 ? step : HOPFORM_NEVER_real;
}

/* The last step to a root, by a Taylor series from `from_t`, where W is known. */
LANES_CODE static void carry_ahead(lanes *restrict w, outlook *restrict ahead, const basis_columns *restrict basis,
                                   const real *restrict from_t)
{
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_basis_real one = one_of_basis_columns(basis, l);
        const real t = ahead->t[l];
        const real low = w->low[l];
        const real d = t - from_t[l];
        const hopform_basis_real there = hopform_carried_basis_real(&poles, &one, d);
        const hopform_sample_real at = sample_of(&ahead->watch, &w->poles, &there, l, t);
        const bool lands = ahead->lands[l] > 0.0;
        const bool found = lands & (t > low) & (at.rate * (t - low) < -at.noise);
        const bool fails = lands & !found;
        keep_basis_columns(&w->end, l, found, &there);
        keep(&w->end_t[l], found, t);
        keep(&w->found[l], found, ahead->number[l]);
        keep(&ahead->closes[l], fails, 1.0);
        keep(&ahead->t[l], fails, ahead->close[l]);
    }
}

/* Householder's steps towards the root that is expected first; the window ends there, or where it would without it. */
LANES_CODE static void reach_ahead(lanes *restrict w, outlook *restrict ahead, basis_columns *restrict basis)
{
    column wanted, from_t;
    for (int n = 0; n < ROOT_STEPS + 2; n++) {
        for (int l = 0; l < LANES; l++) {
            wanted[l] = flag((ahead->seeks[l] > 0.0) | (ahead->closes[l] > 0.0));
        }
        if (!any(wanted)) {
            return;
        }
        bases_at(w, ahead->t, wanted, basis);
        for (int l = 0; l < LANES; l++) {
            const hopform_basis_real one = one_of_basis_columns(basis, l);
            const real t = ahead->t[l];
            const real low = w->low[l];
            const hopform_sample_real at = sample_of(&ahead->watch, &w->poles, &one, l, t);
            const real step = step_to_root(&at);
            const real next = t - step;
            const bool seeks = ahead->seeks[l] > 0.0;
            const bool closes = ahead->closes[l] > 0.0;
            const bool falls = at.rate < 0.0;
            const bool exact = fabs_real(at.value) <= HOPFORM_EPS_real * t * fabs_real(at.rate);
            const bool inside = (next > low) & (next < ahead->far[l]);
            const bool arrives = seeks & falls & exact;
            const bool real_root = (t > low) & (at.rate * (t - low) < -at.noise);
            const bool goes_on = seeks & falls & !exact & inside;
            const bool last = goes_on & one_step_left(&w->poles, l, &at, fourth_of(&w->poles, l, &at), next, step);
            const bool found = arrives & real_root;
            const bool more = goes_on & !last & (n + 1 < ROOT_STEPS);
            const bool fails = seeks & !found & !last & !more;
            keep_basis_columns(&w->end, l, found | closes, &one);
            keep(&w->end_t[l], found | closes, t);
            keep(&w->found[l], found | closes, closes ? -1.0 : ahead->number[l]);
            ahead->seeks[l] = flag(more);
            ahead->lands[l] = flag(last);
            ahead->closes[l] = flag(fails);
            ahead->t[l] = fails ? ahead->close[l] : (goes_on ? next : t);
            from_t[l] = t;
        }
        if (any(ahead->lands)) {
            carry_ahead(w, ahead, basis, from_t);
        }
    }
}

/* ---- what the window says ---- */

/* hopform_is_held_up_real by arithmetic with flags. */
static inline real held_up_by(const sample_columns *from, const sample_columns *to, int l, real value, real a, real h)
{
    const real last = a * h < 1.0 ? to->rate[l] * (1.0 + a * h) : HOPFORM_NEVER_real;
    const real steeper = last - from->rate[l];
    const real cross = fabs_real(steeper) > 0.0 ? over(from->value[l] - value + last * h, steeper) : h;
    const real ahead = cross > 0.0 ? cross : 0.0;
    const real reach = cross < h ? ahead : h;
    return flag(!(from->turning[l] < 0.0)) * flag(!(to->turning[l] < 0.0))
           * flag(from->value[l] + from->rate[l] * reach > from->noise[l] + to->noise[l]);
}

/* hopform_judge_real without a jump, for watches of one number; `value` is g at the end. Where exp(a t) g' comes nearer
 * to zero and goes back, `nears` is 1 and more is to be asked. */
static inline real verdict_on(const lanes *w, const sample_columns *from, const sample_columns *to, int l, real value,
                              real *nears)
{
    const real h = w->end_t[l] - w->low[l];
    const real later = to->rate[l];
    const real turning = from->turning[l];
    const bool falls = from->rate[l] < 0.0;
    const bool turns =
        (turning * to->turning[l] < 0.0) | ((fabs_real(turning) > 0.0) & !(fabs_real(to->turning[l]) > 0.0));
    const bool pauses = !(fabs_real(later) * h > to->noise[l]);
    const bool below = (value < 0.0) & ((value < -to->noise[l]) | (later * h < -to->noise[l]));
    const bool alike = !(falls ^ (later < 0.0));
    const bool same = (pauses & turns) | (!pauses & alike);
    const bool dips = falls & !same; /* unless it is held up */
    const real of_dips = dips ? (real)DIPS_real : 0.0;
    *nears = flag(turns & same & !(falls ^ (turning > 0.0)));
    return below ? (real)LOSES_SIGN_real : of_dips;
}

/* What more there is to say where it nears zero; else what is known. */
static inline real verdict_near_zero(const lanes *w, const sample_columns *from, const sample_columns *to, int l,
                                     real value, real nears, real known)
{
    const real a = w->poles.a[l];
    const real h = w->end_t[l] - w->low[l];
    const bool slow = a * h < 1.0;
    const real grows = 1.0 + 2.0 * a * h;
    const real growth = slow ? grows : HOPFORM_NEVER_real;
    const real inverse = over(1.0, a);
    const real span = slow ? h : inverse;
    const real rate = from->rate[l];
    const real turning = fabs_real(from->turning[l]);
    const real grown = to->rate[l] * growth;
    const bool quarter = h <= 0.5 * w->half_turn[l];
    const real change = -turning * span;
    const real steepest = rate < grown ? rate : grown;
    const real lowest = quarter ? change : -HOPFORM_NEVER_real;
    const real slope = rate < 0.0 ? steepest : lowest;
    const bool away = quarter & (fabs_real(rate) > turning * h * growth);
    const bool far = (value > 0.0) & (from->value[l] + slope * h > from->noise[l] + to->noise[l]);
    const real undecided = far ? 0.0 : (real)UNDECIDED_real;
    const bool open = (nears > 0.0) & !away;
    return open ? undecided : known;
}

/* A search in the window of a lane: which watch, and where it has got to. */
typedef struct {
    watch_columns watch;
    sample_columns before; /* at the start of the window, and where a search for a minimum has got to from there */
    sample_columns at;     /* at its end */
    basis_columns basis;
    column number, low, high, t, going, done, turning;
} search;

/* How fast the watch falls that has been found, and what rounding may have done to it. */
typedef struct {
    column rate, blur;
} found_columns;

/* Whether something is to be done about watch s of a lane, and what. */
LANES_CODE static void act_on(const lanes *restrict w, int s, const real *restrict unsettled,
                              const real *restrict first, const found_columns *restrict other, real *restrict here,
                              real *restrict what)
{
    const sample_columns *from = &w->from[s];
    const sample_columns *to = &w->to[s];
    const real number = (real)s;
    column ends, nears, dipping;
    for (int l = 0; l < LANES; l++) {
        const real just_beyond = -2.0 * to->noise[l];
        const bool is_found = (w->found[l] >= number) & (w->found[l] <= number);
        const real value = is_found ? just_beyond : to->value[l];
        what[l] = verdict_on(w, from, to, l, value, &nears[l]);
        ends[l] = value;
    }
    if (any(nears)) {
        for (int l = 0; l < LANES; l++) {
            what[l] = verdict_near_zero(w, from, to, l, ends[l], nears[l], what[l]);
        }
    }
    for (int l = 0; l < LANES; l++) {
        dipping[l] = flag(what[l] > 1.5) * flag(what[l] < 2.5);
    }
    if (any(dipping)) {
        for (int l = 0; l < LANES; l++) {
            const real held_up = held_up_by(from, to, l, ends[l], w->poles.a[l], w->end_t[l] - w->low[l]);
            what[l] = dipping[l] * held_up > 0.0 ? 0.0 : what[l];
        }
    }
    for (int l = 0; l < LANES; l++) {
        const bool is_found = (w->found[l] >= number) & (w->found[l] <= number);
        const bool is_lost = (what[l] > 0.5) & !(is_found & (what[l] < 1.5));
        here[l] = unsettled[l] * w->on[s][l] * flag(is_lost | (w->found[l] > number));
    }
    if (!any(here)) { /* no watch that may lose its sign, and no tie */
        return;
    }
    for (int l = 0; l < LANES; l++) {
        const real h = w->end_t[l] - w->low[l];
        const real noise = to->noise[l];
        const real later_found = flag(w->found[l] > number);
        const real is_found = flag(w->found[l] >= number) - later_found;
        const real other_found = flag(w->found[l] >= 0.0) - is_found;
        const real early = flag(to->value[l] < -(noise + (s > 0 ? w->doubt[l] : 0.0)));
        const real ties_with =
            flag((to->value[l] - 4.0 * noise) * other->rate[l] < fabs_real(to->rate[l]) * other->blur[l]);
        const real nearly = flag(to->rate[l] * h < -16.0 * noise) * ties_with;
        const real at_once = flag(!(from->value[l] > 0.0))
                             * flag((from->rate[l] < 0.0) | ((from->rate[l] <= 0.0) & (from->turning[l] <= 0.0)));
        const real keeps = flag(what[l] < 0.5);
        const real loses = flag(what[l] < 1.5) - keeps;
        const real dips = flag(what[l] < 2.5) - keeps - loses;
        const real ties = early + nearly;
        const real goes_first = flag(early + later_found * nearly > 0.0);
        const real leaves = keeps * later_found * ties
                            + loses * (other_found * (1.0 - goes_first) + (1.0 - is_found) * at_once) + dips * is_found;
        const real acts = (1.0 - keeps) * (1.0 - loses * is_found);
        const real deed = (real)CUT + (real)(FIND_ROOT - CUT) * loses + (real)(FIND_BOTTOM - CUT) * dips;
        here[l] = unsettled[l] * flag(w->on[s][l] > 0.0) * flag(first[l] <= number) * flag(acts + leaves > 0.0);
        what[l] = leaves > 0.0 ? (real)LEAVE : deed;
    }
}

/* The first watch of each lane, from `first` on, about which something is to be done, and what. */
LANES_CODE static void settle_verdicts(const lanes *restrict w, const real *restrict unsettled,
                                       const real *restrict first, real *restrict what, search *restrict found)
{
    column here, deed;
    found_columns other;
    for (int l = 0; l < LANES; l++) {
        what[l] = NOTHING;
        found->number[l] = 0.0;
        const bool first_found = w->found[l] < 0.5;
        const bool second_found = w->found[l] < 1.5;
        const real later_rate = second_found ? w->to[1].rate[l] : w->to[2].rate[l];
        const real later_noise = second_found ? w->to[1].noise[l] : w->to[2].noise[l];
        other.rate[l] = fabs_real(first_found ? w->to[0].rate[l] : later_rate);
        other.blur[l] = first_found ? w->to[0].noise[l] : later_noise + w->doubt[l];
    }
    for (int s = SLOTS - 1; s >= 0; s--) {
        const sample_columns *from = &w->from[s];
        const sample_columns *to = &w->to[s];
        if (!w->watched[s]) {
            continue;
        }
        act_on(w, s, unsettled, first, &other, here, deed);
        if (!any(here)) {
            continue;
        }
        for (int l = 0; l < LANES; l++) {
            const bool yes = here[l] > 0.0;
            const hopform_sample_real begin = one_sample(from, l);
            const hopform_sample_real end = one_sample(to, l);
            const real h = w->end_t[l] - w->low[l];
            keep(&what[l], yes, deed[l]);
            keep(&found->number[l], yes, (real)s);
            keep(&found->turning[l], yes, from->turning[l]);
            keep(&found->t[l], yes, w->low[l] + h * over(from->rate[l], from->rate[l] - to->rate[l]));
            keep_sample(&found->before, l, yes, &begin);
            keep_sample(&found->at, l, yes, &end);
        }
        choose_watch(&w->watch[s], here, &found->watch);
    }
}

/* The minimum of a watch in the window; a lane where it is below zero, or hard to find, is left. */
LANES_CODE static void find_bottoms(lanes *restrict w, const real *restrict what, search *restrict find)
{
    column stuck, next, falls, ready, bisects;
    for (int l = 0; l < LANES; l++) {
        const real low = w->low[l];
        const real high = w->end_t[l];
        find->going[l] = is(what[l], FIND_BOTTOM);
        find->low[l] = low;
        find->high[l] = high;
        find->t[l] = ((find->t[l] > low) & (find->t[l] < high)) ? find->t[l] : low + 0.5 * (high - low);
    }
    for (int n = 0; n < MOST_STEPS && any(find->going); n++) {
        const bool halves = n > 8 && n % 2 == 1;
        bases_at(w, find->t, find->going, &find->basis);
        for (int l = 0; l < LANES; l++) {
            const hopform_basis_real one = one_of_basis_columns(&find->basis, l);
            const real t = find->t[l];
            const hopform_sample_real at = sample_of(&find->watch, &w->poles, &one, l, t);
            const bool usable = fabs_real(at.curvature) > 0.0;
            const real step = over(at.rate, at.curvature);
            next[l] = t - step;
            falls[l] = at.rate;
            ready[l] = flag(usable) * flag(fabs_real(step) <= 0.001 * HOPFORM_ROOT_EPS_real * t);
            bisects[l] = halves ? 1.0 : flag(!usable);
            find->done[l] = find->going[l] * flag(at.value < -at.noise);
            keep_sample(&find->before, l, (find->going[l] > 0.0) & (at.rate < 0.0), &at);
            keep_sample(&find->at, l, (find->going[l] > 0.0) & !(at.rate < 0.0), &at);
        }
        for (int l = 0; l < LANES; l++) {
            keep(&find->low[l], (find->going[l] > 0.0) & (falls[l] < 0.0), find->t[l]);
            keep(&find->high[l], (find->going[l] > 0.0) & !(falls[l] < 0.0), find->t[l]);
        }
        for (int l = 0; l < LANES; l++) {
            const real held_up =
                held_up_by(&find->before, &find->at, l, find->at.value[l], w->poles.a[l], find->high[l] - find->low[l]);
            ready[l] = held_up > 0.0 ? 1.0 : ready[l];
        }
        for (int l = 0; l < LANES; l++) {
            const bool inside = (next[l] > find->low[l]) & (next[l] < find->high[l]) & !(bisects[l] > 0.0);
            next[l] = inside ? next[l] : find->low[l] + 0.5 * (find->high[l] - find->low[l]);
        }
        for (int l = 0; l < LANES; l++) {
            const bool inside = (next[l] > find->low[l]) & (next[l] < find->high[l]);
            find->going[l] *= (1.0 - find->done[l]) * (1.0 - ready[l]) * flag(inside);
        }
        for (int l = 0; l < LANES; l++) {
            keep(&find->t[l], find->going[l] > 0.0, next[l]);
        }
        leave(w, find->done);
    }
    for (int l = 0; l < LANES; l++) {
        stuck[l] = find->going[l];
    }
    leave(w, stuck);
}

/* The window ends at the one root of a watch in it. */
LANES_CODE static void find_roots(lanes *restrict w, const real *restrict what, search *restrict find)
{
    column lands, arrived, ready, inside, next;
    for (int l = 0; l < LANES; l++) {
        const bool here = is(what[l], FIND_ROOT) > 0.0;
        find->going[l] = flag(here);
        find->low[l] = w->low[l];
        find->high[l] = w->end_t[l];
        keep(&find->t[l], here, w->end_t[l]);
        keep(&w->found[l], here, find->number[l]);
        lands[l] = 0.0;
        arrived[l] = 0.0;
    }
    for (int n = 0; n < MOST_STEPS && any(find->going); n++) {
        const bool halves = n > 8 && n % 2 == 1;
        for (int l = 0; l < LANES; l++) {
            const hopform_sample_real at = one_sample(&find->at, l);
            const real step = step_to_root(&at);
            next[l] = find->t[l] - step;
            lands[l] = flag(one_step_left(&w->poles, l, &at, fourth_of(&w->poles, l, &at), next[l], step));
            ready[l] =
                flag((arrived[l] > 0.0) | (fabs_real(at.value) <= HOPFORM_EPS_real * find->t[l] * fabs_real(at.rate)));
        }
        for (int l = 0; l < LANES; l++) {
            inside[l] = flag((next[l] > find->low[l]) & (next[l] < find->high[l]));
            lands[l] *= inside[l];
        }
        for (int l = 0; l < LANES; l++) {
            const real newton = halves ? lands[l] : inside[l];
            next[l] = newton > 0.0 ? next[l] : find->low[l] + 0.5 * (find->high[l] - find->low[l]);
        }
        for (int l = 0; l < LANES; l++) {
            const real between = flag((next[l] > find->low[l]) & (next[l] < find->high[l]));
            find->going[l] *= 1.0 - ready[l];
            find->done[l] = find->going[l] * (1.0 - between);
            find->going[l] *= between;
            lands[l] *= find->going[l];
        }
        if (any(lands)) {
            for (int l = 0; l < LANES; l++) {
                const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
                const hopform_basis_real one = one_of_basis_columns(&w->end, l);
                const hopform_basis_real there = hopform_carried_basis_real(&poles, &one, next[l] - find->t[l]);
                const bool here = lands[l] > 0.0;
                keep_basis_columns(&w->end, l, here, &there);
                keep(&w->end_t[l], here, next[l]);
                find->going[l] *= 1.0 - lands[l];
            }
        }
        for (int l = 0; l < LANES; l++) {
            keep(&find->t[l], find->going[l] > 0.0, next[l]);
        }
        leave(w, find->done);
        if (!any(find->going)) {
            break;
        }
        bases_at(w, find->t, find->going, &w->end);
        for (int l = 0; l < LANES; l++) {
            const hopform_basis_real one = one_of_basis_columns(&w->end, l);
            const real t = find->t[l];
            const hopform_sample_real at = sample_of(&find->watch, &w->poles, &one, l, t);
            const bool goes = find->going[l] > 0.0;
            keep_sample(&find->at, l, goes, &at);
            keep(&w->end_t[l], goes, t);
            arrived[l] = flag(!((at.value > 0.0) | (at.value < 0.0)));
            keep(&find->low[l], goes & (at.value > 0.0), t);
            keep(&find->high[l], goes & (at.value < 0.0), t);
            find->going[l] = flag(goes);
        }
    }
    leave(w, find->going);
}

/* Windows in which a watch cannot be judged end where its m has its zero. */
LANES_CODE static void cut_windows(lanes *restrict w, const real *restrict what, search *restrict find)
{
    column inside;
    for (int l = 0; l < LANES; l++) {
        find->going[l] = is(what[l], CUT);
        inside[l] = over(find->turning[l], find->turning[l] - find->at.turning[l]);
    }
    for (int l = 0; l < LANES; l++) {
        inside[l] = fabs_real(find->at.turning[l]) > 0.0 ? inside[l] : 0.25;
    }
    for (int l = 0; l < LANES; l++) {
        inside[l] = inside[l] < 0.984375 ? inside[l] : 0.984375;
    }
    for (int l = 0; l < LANES; l++) {
        inside[l] = inside[l] > 0.015625 ? inside[l] : 0.015625;
        const real t = w->low[l] + inside[l] * (w->end_t[l] - w->low[l]);
        find->done[l] = find->going[l] * (1.0 - flag((t > w->low[l]) & (t < w->end_t[l])));
        keep(&w->end_t[l], find->going[l] > 0.0, t);
        keep(&w->found[l], find->going[l] > 0.0, -1.0);
    }
    leave(w, find->done);
    bases_at(w, w->end_t, find->going, &w->end);
}

/* Shorten each window until every watch is known to keep its sign in it, but for the one that is found at its end. */
LANES_CODE static void settle_windows(lanes *restrict w, search *restrict find)
{
    column what, first, unsettled, left, roots;
    for (int l = 0; l < LANES; l++) {
        first[l] = 0.0;
        unsettled[l] = flag((w->live[l] > 0.0) & !(w->left[l] > 0.0));
        roots[l] = unsettled[l];
    }
    for (int n = 0; n < MOST_CUTS; n++) {
        if (any(roots)) {
            sample_ends(w, roots);
        }
        settle_verdicts(w, unsettled, first, what, find);
        for (int l = 0; l < LANES; l++) {
            unsettled[l] = flag(what[l] > (real)LEAVE);
            left[l] = flag((what[l] > (real)NOTHING) & !(what[l] > (real)LEAVE));
            roots[l] = flag(what[l] > (real)FIND_BOTTOM); /* the window has another end */
            first[l] = roots[l] > 0.0 ? 0.0 : find->number[l] + 1.0;
        }
        leave(w, left);
        if (!any(unsettled)) {
            return;
        }
        if (any(roots)) {
            find_roots(w, what, find);
            cut_windows(w, what, find);
        }
        find_bottoms(w, what, find);
    }
    leave(w, unsettled);
}

/* At the time of the limit a take-off comes before it, and before mass 2 comes to rest what mass 1 does. */
LANES_CODE static void cross_at_the_limit(lanes *restrict w)
{
    column at_limit, crosses;
    for (int l = 0; l < LANES; l++) {
        at_limit[l] = w->live[l] * flag(!(w->end_t[l] < w->limit[l]));
    }
    if (!any(at_limit)) {
        return;
    }
    for (int s = SLOTS - 1; s >= 0; s--) {
        const sample_columns *to = &w->to[s];
        for (int l = 0; l < LANES; l++) {
            const real reached = at_limit[l] * flag(w->on[s][l] > 0.0);
            const real is_first = s == 0 ? 1.0 : is(w->kind[s][l], BY_THRESHOLD_1) * flag(!(w->halt[l] > w->limit[l]));
            crosses[l] = reached * is_first * flag(to->rate[l] * w->limit[l] < -16.0 * to->noise[l])
                         * flag(to->value[l] < -8.0 * HOPFORM_EPS_real * w->limit[l] * to->rate[l])
                         * (1.0 - w->settled[l]);
        }
        for (int l = 0; l < LANES; l++) {
            keep(&w->found[l], crosses[l] > 0.0, (real)s);
        }
    }
}

/* ---- stops ---- */

/* The search for the stop ahead: `gap` is x_1 counted from it at the start of the phase. */
typedef struct {
    column gap, low, high, t, next;
    column going, halves;
    basis_columns basis;
} stop_search;

/* One step towards the stops. */
LANES_CODE static void approach_stops(const lanes *restrict w, stop_search *restrict find)
{
    column value, rate, next, near, exact, last, moves;
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real from_stop = {find->gap[l], w->state.v1[l], w->state.v2[l], w->state.y[l]};
        const hopform_motion_real motion = one_of_motion_columns(&w->motion, l);
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_basis_real one = one_of_basis_columns(&find->basis, l);
        const real t = find->t[l];
        const hopform_approach_real to = hopform_approach_of_real(&poles, &motion, &from_stop, w->side_1[l], &one);
        const real step = step_to_root(&to.at);
        value[l] = to.at.value;
        rate[l] = to.at.rate;
        next[l] = t - step;
        near[l] = flag(one_step_left(&w->poles, l, &to.at, to.fourth, next[l], step));
        exact[l] = flag(fabs_real(to.at.value) <= HOPFORM_EPS_real * t * to.at.rate);
    }
    for (int l = 0; l < LANES; l++) {
        keep(&find->low[l], !(value[l] > 0.0), find->t[l]);
        keep(&find->high[l], value[l] > 0.0, find->t[l]);
        find->going[l] *= 1.0 - exact[l];
    }
    for (int l = 0; l < LANES; l++) {
        const bool inside = (rate[l] > 0.0) & (next[l] > find->low[l]) & (next[l] < find->high[l]);
        last[l] = find->going[l] * near[l] * flag(inside);
        moves[l] = flag(inside) * (1.0 - find->halves[l]) + last[l];
    }
    for (int l = 0; l < LANES; l++) {
        next[l] = moves[l] > 0.0 ? next[l] : find->low[l] + 0.5 * (find->high[l] - find->low[l]);
    }
    for (int l = 0; l < LANES; l++) {
        find->going[l] *= flag((next[l] > find->low[l]) & (next[l] < find->high[l]));
    }
    if (any(last)) {
        for (int l = 0; l < LANES; l++) {
            const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
            const hopform_basis_real one = one_of_basis_columns(&find->basis, l);
            const hopform_basis_real there = hopform_carried_basis_real(&poles, &one, next[l] - find->t[l]);
            keep_basis_columns(&find->basis, l, last[l] > 0.0, &there);
        }
    }
    for (int l = 0; l < LANES; l++) {
        keep(&find->t[l], find->going[l] > 0.0, next[l]);
        find->going[l] *= 1.0 - last[l];
    }
}

/* Windows end where x_1 meets its stop; `stops` says which. */
LANES_CODE static void meet_stops(lanes *restrict w, real *restrict stops)
{
    column tied;
    stop_search find;
    for (int l = 0; l < LANES; l++) {
        find.gap[l] = w->side_1[l] > 0.0 ? w->from_max[l] : w->from_min[l];
        find.low[l] = 0.0;
        find.high[l] = w->end_t[l];
        find.t[l] = w->end_t[l];
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real from_stop = {find.gap[l], w->state.v1[l], w->state.v2[l], w->state.y[l]};
        const hopform_motion_real motion = one_of_motion_columns(&w->motion, l);
        const hopform_basis_real one = one_of_basis_columns(&w->end, l);
        const hopform_at_real at = hopform_state_at_real(&from_stop, &motion, &one);
        const bool ahead = (fabs_real(w->side_1[l]) > 0.0) & within_range(find.gap[l]);
        const real beyond = w->side_1[l] * at.x1_t;
        const bool past = beyond > hopform_touch_real(&motion, &from_stop, &one);
        stops[l] = w->live[l] * flag(ahead & !(w->left[l] > 0.0) & past);
        find.going[l] = stops[l];
    }
    if (!any(stops)) {
        return;
    }
    memcpy(&find.basis, &w->end, sizeof find.basis);
    for (int n = 0; n < 100 && any(find.going); n++) {
        for (int l = 0; l < LANES; l++) {
            find.halves[l] = flag(n > 8 && n % 2 == 1);
        }
        if (n > 0) {
            bases_at(w, find.t, find.going, &find.basis);
        }
        approach_stops(w, &find);
    }
    leave(w, find.going);
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_real one = one_of_basis_columns(&find.basis, l);
        const bool here = stops[l] > 0.0;
        tied[l] = flag(here & (w->found[l] >= 0.0) & (w->found[l] <= 0.0)
                       & (w->end_t[l] <= find.t[l] * (1.0 + 8.0 * HOPFORM_EPS_real)));
        keep_basis_columns(&w->end, l, here, &one);
        keep(&w->end_t[l], here, find.t[l]);
    }
    leave(w, tied);
}

/* ---- what follows ---- */

/* Where a mass at rest goes; exactly on its threshold is left to the scalar code. */
static inline real side_from_rest(real acceleration, real friction, real blocked_below, real blocked_above)
{
    return flag(acceleration > friction) * (1.0 - blocked_above)
           - flag(acceleration < -friction) * (1.0 - blocked_below);
}

static inline real on_threshold(real acceleration, real friction)
{
    return flag(!(fabs_real(acceleration) < friction)) * (1.0 - flag(acceleration > friction))
           * (1.0 - flag(acceleration < -friction));
}

/* A mass that has come to rest stays there, is stopped, or goes on: its velocity is 0. */
LANES_CODE static void come_to_rest(lanes *restrict w, const real *restrict how, const real *restrict touches,
                                    real *restrict hits)
{
    column stop, there;
    for (int l = 0; l < LANES; l++) {
        stop[l] = w->side_1[l] > 0.0 ? w->robot.x1_max[l] : w->robot.x1_min[l];
        hits[l] = is(how[l], BY_STOP);
        there[l] = hits[l] + is(how[l], BY_VELOCITY_1) * touches[l];
    }
    for (int l = 0; l < LANES; l++) {
        keep(&w->state.x1[l], there[l] > 0.0, stop[l]);
        keep(&w->from_min[l], there[l] > 0.0, stop[l] - w->robot.x1_min[l]);
        keep(&w->from_max[l], there[l] > 0.0, stop[l] - w->robot.x1_max[l]);
        keep(&w->state.v1[l], is(how[l], BY_VELOCITY_1) + hits[l] > 0.0, 0.0);
        keep(&w->state.v2[l], is(how[l], BY_VELOCITY_2) > 0.0, 0.0);
        keep(&w->state.y[l], is(how[l], BY_TAKEOFF) > 0.0, 0.0);
    }
}

/* A mass that comes to rest alone: its free acceleration from the motion, not from the state. */
LANES_CODE static void keep_free_accelerations(lanes *restrict w, const real *restrict how)
{
    column alone, back, friction;
    for (int l = 0; l < LANES; l++) {
        const real back_1 = fabs_real(w->motion.H3_1[l] * w->end.Wdd[l] + w->motion.H2_1[l] * w->end.Wd[l]);
        const real back_2 = fabs_real(w->motion.H3_2[l] * w->end.Wdd[l] + w->motion.H2_2[l] * w->end.Wd[l]);
        const real alone_1 = is(how[l], BY_VELOCITY_1) * (1.0 - fabs_real(w->side_2[l]));
        const real alone_2 = is(how[l], BY_VELOCITY_2) * (1.0 - fabs_real(w->side_1[l]));
        alone[l] = alone_1 + 2.0 * alone_2;
        back[l] = alone_1 > 0.0 ? back_1 : back_2;
        friction[l] = alone_1 > 0.0 ? w->robot.f1[l] : w->robot.f2[l];
    }
    for (int l = 0; l < LANES; l++) {
        back[l] = back[l] > HOPFORM_UNDERFLOW_real ? back[l] : HOPFORM_UNDERFLOW_real;
    }
    for (int l = 0; l < LANES; l++) {
        const real side = is(alone[l], 1) * w->side_1[l] + is(alone[l], 2) * w->side_2[l];
        keep(&w->free[l], alone[l] > 0.0, side * (friction[l] - back[l]));
        keep(&w->alone[l], how[l] > (real)NO_END, alone[l]);
    }
}

/* Where each mass would go from rest; exactly on its threshold is left to the scalar code. */
LANES_CODE static void sides_from_rest(lanes *restrict w, const real *restrict rests_1, const real *restrict rests_2,
                                       real *restrict side_1, real *restrict side_2)
{
    column free_1, free_2, threshold, blocked_below, blocked_above;
    for (int l = 0; l < LANES; l++) {
        const hopform_rates_real rates = one_of_rates_columns(&w->rates, l);
        const hopform_state_real state = one_of_state_columns(&w->state, l);
        const hopform_free_real free = hopform_free_accelerations_real(&rates, &state, w->u[l]);
        free_1[l] = free.free_1;
        free_2[l] = free.free_2;
        blocked_below[l] = flag(blocks(w, l, -1.0));
        blocked_above[l] = flag(blocks(w, l, 1.0));
    }
    for (int l = 0; l < LANES; l++) {
        keep(&free_1[l], is(w->alone[l], 1) > 0.0, w->free[l]);
        keep(&free_2[l], is(w->alone[l], 2) > 0.0, w->free[l]);
    }
    for (int l = 0; l < LANES; l++) {
        side_1[l] = side_from_rest(free_1[l], w->robot.f1[l], blocked_below[l], blocked_above[l]);
        side_2[l] = side_from_rest(free_2[l], w->robot.f2[l], 0.0, 0.0);
        const real faint =
            flag(fabs_real(free_1[l]) < 64.0 * HOPFORM_EPS_real * fabs_real(w->rates.a1_y[l] * w->state.y[l]));
        const real slides =
            fabs_real(w->side_2[l]) * flag(!(w->robot.f1[l] > 0.0)) * flag(!(fabs_real(w->rates.a1_v1[l]) > 0.0));
        threshold[l] = rests_1[l] * (on_threshold(free_1[l], w->robot.f1[l]) + faint * slides)
                       + rests_2[l] * on_threshold(free_2[l], w->robot.f2[l]);
    }
    leave(w, threshold);
}

/* The state and the modes after the end of a phase. */
LANES_CODE static void pass(lanes *restrict w, const real *restrict how, const real *restrict touches)
{
    column hits, rests_1, rests_2, slips_1, slips_2, side_1, side_2, side, goes_on, crowded;
    keep_free_accelerations(w, how);
    come_to_rest(w, how, touches, hits);
    for (int l = 0; l < LANES; l++) {
        rests_1[l] = is(how[l], BY_VELOCITY_1) + is(how[l], BY_STOP);
        rests_2[l] = is(how[l], BY_VELOCITY_2);
        slips_1[l] = is(how[l], BY_THRESHOLD_1);
        slips_2[l] = is(how[l], BY_THRESHOLD_2);
        goes_on[l] = rests_1[l] + rests_2[l] + slips_1[l] + slips_2[l];
    }
    sides_from_rest(w, rests_1, rests_2, side_1, side_2);
    for (int l = 0; l < LANES; l++) {
        const real number = w->found[l];
        side[l] = is(number, 1) * w->side[1][l] + is(number, 2) * w->side[2][l];
    }
    for (int l = 0; l < LANES; l++) {
        const real sticks_1 = rests_1[l] * (1.0 - fabs_real(side_1[l]));
        const real sticks_2 = rests_2[l] * (1.0 - fabs_real(side_2[l]));
        const real reverses_1 = rests_1[l] * flag(side_1[l] * w->side_1[l] < 0.0);
        const real reverses_2 = rests_2[l] * flag(side_2[l] * w->side_2[l] < 0.0);
        w->event[l] = hits[l] * (sticks_1 + reverses_1) * (real)HOPFORM_EVENT_X1_HITS_STOP
                      + (1.0 - hits[l])
                            * (sticks_1 * (real)HOPFORM_EVENT_X1_STICKS + reverses_1 * (real)HOPFORM_EVENT_X1_REVERSES)
                      + sticks_2 * (real)HOPFORM_EVENT_X2_STICKS + reverses_2 * (real)HOPFORM_EVENT_X2_REVERSES
                      + slips_1[l] * (real)HOPFORM_EVENT_X1_SLIPS + slips_2[l] * (real)HOPFORM_EVENT_X2_SLIPS;
        w->events[l] += flag(w->event[l] > 0.0);
        w->count[l] += goes_on[l];
        crowded[l] = goes_on[l] * flag(w->count[l] > w->max_phases[l]);
    }
    for (int l = 0; l < LANES; l++) {
        keep(&w->side_1[l], rests_1[l] > 0.0, side_1[l]);
        keep(&w->side_2[l], rests_2[l] > 0.0, side_2[l]);
        keep(&w->fresh_1[l], goes_on[l] > 0.0, slips_1[l]);
        keep(&w->fresh_2[l], goes_on[l] > 0.0, slips_2[l]);
        w->begins[l] = goes_on[l];
    }
    for (int l = 0; l < LANES; l++) {
        keep(&w->side_1[l], slips_1[l] > 0.0, side[l]);
        keep(&w->side_2[l], slips_2[l] > 0.0, side[l]);
    }
    for (int l = 0; l < LANES; l++) {
        const real rests = goes_on[l] * (1.0 - fabs_real(w->side_1[l])) * (1.0 - fabs_real(w->side_2[l]));
        w->ending[l] = is(how[l], BY_TAKEOFF) * (real)HOPFORM_ENDING_TAKEOFF
                       + is(how[l], BY_LIMIT) * (real)HOPFORM_ENDING_HORIZON + rests * (real)HOPFORM_ENDING_REST;
    }
    leave(w, crowded);
}

/* A window begins where the one before has ended. */
LANES_CODE static void next_samples(const sample_columns *restrict to, const real *restrict yes,
                                    sample_columns *restrict from)
{
    for (int l = 0; l < LANES; l++) {
        hopform_sample_real sample = one_sample(to, l);
        sample.value = sample.value > 0.0 ? sample.value : 0.0;
        keep_sample(from, l, yes[l] > 0.0, &sample);
    }
}

/* A take-off late in a phase whose time has not all its digits is left. */
LANES_CODE static void look_at_takeoffs(lanes *restrict w, const real *restrict how)
{
    column late, settled;
    for (int l = 0; l < LANES; l++) {
        late[l] = is(how[l], BY_TAKEOFF) * flag(fabs_real(w->end.Wdd[l]) < 0.25);
    }
    if (!any(late)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real slack = {0.0, 0.0, 0.0, 0.0};
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_rates_real rates = one_of_rates_columns(&w->rates, l);
        const hopform_drive_real drive = drive_in(w, l);
        const hopform_motion_real both = hopform_motion_of_both_real(&rates, &drive, &slack);
        const hopform_motion_real actuator = hopform_motion_of_actuator_real(&rates, &drive, &slack);
        const hopform_motion_real body = hopform_motion_of_body_real(&rates, &drive, &slack);
        const real side_2 = fabs_real(w->side_2[l]);
        const real H2_moves_1 = side_2 > 0.0 ? both.H2_y : actuator.H2_y;
        const real H1_moves_1 = side_2 > 0.0 ? both.H1_y : actuator.H1_y;
        const bool moves_1 = fabs_real(w->side_1[l]) > 0.0;
        settled[l] = hopform_settled_y_real(&poles, moves_1 ? H2_moves_1 : body.H2_y, moves_1 ? H1_moves_1 : body.H1_y);
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_basis_real basis = one_of_basis_columns(&w->end, l);
        const hopform_numerator_real leg = {w->motion.H3_y[l], w->motion.H2_y[l], w->motion.H1_y[l]};
        const real later = hopform_root_is_later_real(&poles, &leg, w->state.y[l], settled[l], &basis, w->end_t[l]);
        late[l] *= flag(fabs_real(later) > 0.0);
    }
    leave(w, late);
}

/* The next window of a phase, or what follows its end. */
LANES_CODE static void end_windows(lanes *restrict w, const real *restrict stops)
{
    column how, late, goes_on, touches;
    for (int l = 0; l < LANES; l++) {
        const real kind = is(w->found[l], 0) * w->kind[0][l] + is(w->found[l], 1) * w->kind[1][l]
                          + is(w->found[l], 2) * w->kind[2][l];
        const real only_1 = 1.0 - fabs_real(w->side_2[l]);
        const real halts =
            flag(!(w->halt[l] > w->limit[l])) * flag(!(w->end_t[l] < w->limit[l] * (1.0 - 8.0 * HOPFORM_EPS_real)));
        const real wins = halts * only_1 * flag(w->found[l] > 0.0); /* over mass 2 at the same time */
        const real happens = flag(w->found[l] >= 0.0) * (1.0 - wins);
        const real by_halt = only_1 * (real)BY_VELOCITY_1 + (1.0 - only_1) * (real)BY_VELOCITY_2;
        const real reached = flag(!(w->end_t[l] < w->limit[l])) * (real)BY_LIMIT;
        const real ends = flag(happens + wins > 0.0) + flag(reached > 0.0);
        const real at_the_end = halts * by_halt + (1.0 - halts) * reached;
        const real event = flag(ends > 0.0) * (happens * kind + (1.0 - happens) * at_the_end);
        how[l] = stops[l] * (real)BY_STOP + (1.0 - stops[l]) * event;
    }
    for (int l = 0; l < LANES; l++) {
        keep(&how[l], !(w->live[l] > 0.0), (real)NO_END);
        goes_on[l] = flag(w->live[l] > 0.0) * flag(how[l] <= (real)NO_END);
        w->windows[l] += goes_on[l];
        keep(&w->low[l], goes_on[l] > 0.0, w->end_t[l]);
        const bool has_faded = -0.5 * w->poles.p[l] * w->end_t[l] < HOPFORM_SMALLEST_EXPONENT_real;
        late[l] = goes_on[l] * flag((w->windows[l] >= (real)MOST_WINDOWS) | has_faded);
    }
    leave(w, late);
    if (any(goes_on)) {
        for (int s = 0; s < SLOTS; s++) {
            next_samples(&w->to[s], goes_on, &w->from[s]);
        }
    }
    look_at_takeoffs(w, how);
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real state = one_of_state_columns(&w->state, l);
        const hopform_motion_real motion = one_of_motion_columns(&w->motion, l);
        const hopform_basis_real basis = one_of_basis_columns(&w->end, l);
        const hopform_at_real at = hopform_state_at_real(&state, &motion, &basis);
        const hopform_state_real from_zero = {0.0, state.v1, state.v2, state.y};
        const hopform_at_real moved = hopform_state_at_real(&from_zero, &motion, &basis);
        const real gap = w->side_1[l] > 0.0 ? w->from_max[l] : w->from_min[l];
        const hopform_state_real from_stop = {gap, state.v1, state.v2, state.y};
        const bool near_stop = fabs_real(gap + moved.x1_t) <= hopform_touch_real(&motion, &from_stop, &basis);
        touches[l] = flag(within_range(gap) & near_stop);
        const bool ends = how[l] > (real)NO_END;
        const bool held_1 = !(fabs_real(w->side_1[l]) > 0.0);
        keep(&w->from_min[l], ends & !held_1, w->from_min[l] + moved.x1_t);
        keep(&w->from_max[l], ends & !held_1, w->from_max[l] + moved.x1_t);
        const bool held_2 = !(fabs_real(w->side_2[l]) > 0.0);
        keep(&w->state.x1[l], ends & !held_1, at.x1_t);
        keep(&w->state.v1[l], ends, held_1 ? 0.0 : at.v1_t);
        keep(&w->state.v2[l], ends, held_2 ? 0.0 : at.v2_t);
        keep(&w->state.y[l], ends, at.y_t);
        keep(&w->t[l], ends, how[l] > (real)BY_STOP ? w->horizon[l] : w->t[l] + w->end_t[l]);
    }
    pass(w, how, touches);
}

/* What a round works in; kept, so that no lane reads what was never written. */
typedef struct {
    outlook ahead;
    search find;
    basis_columns basis;
} workspace;

/* One window of each stance. */
LANES_CODE static void advance(lanes *restrict w, workspace *restrict work)
{
    column stops;
    start_phases(w);
    look_ahead(w, &work->ahead);
    reach_ahead(w, &work->ahead, &work->basis);
    settle_windows(w, &work->find);
    for (int l = 0; l < LANES; l++) {
        w->settled[l] = flag(w->found[l] >= 0.0);
    }
    cross_at_the_limit(w);
    meet_stops(w, stops);
    end_windows(w, stops);
}

/* ---- stances in and out ---- */

/* Where a batch is, and whose turn it is. */
typedef struct {
    int64_t count;
    const hopform_stances_in_real *in;
    const hopform_stances_out_real *out;
    int64_t next;
    int64_t pause;          /* where lanes are filled no further, to look whether they are worth it */
    hopform_plan_real plan; /* of the robot of the stance that was taken last */
    int64_t robot_number;
    int32_t robot_status;
    int32_t kept;
    bool many_robots; /* or one for all */
} queue;

static void put_robot(lanes *w, int l, const queue *from)
{
    if (w->robot_number[l] == from->robot_number) {
        return;
    }
    w->robot_number[l] = from->robot_number;
    w->plan[l] = from->plan;
    put_robot_columns(&w->robot, l, &from->plan.robot);
    put_rates_columns(&w->rates, l, &from->plan.rates);
    put_poles_columns(&w->both, l, &from->plan.both);
}

/* Put a stance into a lane; whether it can be solved there is still to be seen. */
static void take(lanes *w, int l, const queue *from, int64_t i)
{
    const hopform_stances_in_real *in = from->in;
    put_robot(w, l, from);
    w->start.x1[l] = hopform_number_real(&in->x1, i);
    w->start.v1[l] = hopform_number_real(&in->v1, i);
    w->start.v2[l] = hopform_number_real(&in->v2, i);
    w->start.y[l] = hopform_number_real(&in->y, i);
    w->u[l] = hopform_number_real(&in->u, i);
    w->horizon[l] = hopform_number_real(&in->horizon, i);
    w->index[l] = i;
    w->live[l] = w->begins[l] = 1.0;
}

/* The start of the stances that have just been taken; `odd` is 1 where one does not start as most do: a leg that is
 * compressed, or begins to be, no mass on its threshold. */
LANES_CODE static void start_stances(lanes *restrict w, const real *restrict fresh, real max_phases, real *restrict odd)
{
    column strange, blocked_below, blocked_above, rests_1, rests_2, doubt, side_1, side_2, v1;
    for (int l = 0; l < LANES; l++) {
        const hopform_robot_real robot = one_of_robot_columns(&w->robot, l);
        const hopform_state_real state = one_of_state_columns(&w->start, l);
        const real sound =
            flag(fabs_real(state.x1) <= HOPFORM_NEVER_real) * flag(fabs_real(state.v1) <= HOPFORM_NEVER_real)
            * flag(fabs_real(state.v2) <= HOPFORM_NEVER_real) * flag(state.y >= 0.0)
            * flag(state.y <= HOPFORM_NEVER_real) * flag(state.x1 >= robot.x1_min) * flag(state.x1 <= robot.x1_max)
            * flag(fabs_real(w->u[l]) <= HOPFORM_NEVER_real) * flag(w->horizon[l] > 0.0)
            * flag(w->horizon[l] <= HOPFORM_NEVER_real) * flag(!hopform_stores_much_real(&robot, &state));
        const real locked = flag(!(robot.x1_min < robot.x1_max));
        strange[l] = 1.0 - sound;
        blocked_below[l] = flag(locked + flag(state.x1 <= robot.x1_min) > 0.0);
        blocked_above[l] = flag(locked + flag(state.x1 >= robot.x1_max) > 0.0);
    }
    for (int l = 0; l < LANES; l++) {
        const real stops =
            flag(w->start.v1[l] > 0.0) * blocked_above[l] + flag(w->start.v1[l] < 0.0) * blocked_below[l];
        v1[l] = stops > 0.0 ? 0.0 : w->start.v1[l];
        rests_1[l] = flag(!(fabs_real(v1[l]) > 0.0));
        rests_2[l] = flag(!(fabs_real(w->start.v2[l]) > 0.0));
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_rates_real rates = one_of_rates_columns(&w->rates, l);
        const hopform_state_real state = {w->start.x1[l], v1[l], w->start.v2[l], w->start.y[l]};
        const hopform_free_real free = hopform_free_accelerations_real(&rates, &state, w->u[l]);
        const real from_rest_1 = side_from_rest(free.free_1, w->robot.f1[l], blocked_below[l], blocked_above[l]);
        const real from_rest_2 = side_from_rest(free.free_2, w->robot.f2[l], 0.0, 0.0);
        doubt[l] = rests_1[l] * on_threshold(free.free_1, w->robot.f1[l])
                   + rests_2[l] * on_threshold(free.free_2, w->robot.f2[l]);
        side_1[l] = rests_1[l] * from_rest_1 + flag(v1[l] > 0.0) - flag(v1[l] < 0.0);
        side_2[l] = rests_2[l] * from_rest_2 + flag(w->start.v2[l] > 0.0) - flag(w->start.v2[l] < 0.0);
    }
    for (int l = 0; l < LANES; l++) {
        const real leaves = flag(!(w->start.y[l] > 0.0)) * flag(!(v1[l] > w->start.v2[l]));
        const real rests = (1.0 - fabs_real(side_1[l])) * (1.0 - fabs_real(side_2[l]));
        odd[l] = fresh[l] * flag(strange[l] + doubt[l] + leaves + rests > 0.0);
    }
    for (int l = 0; l < LANES; l++) {
        const bool here = fresh[l] > 0.0;
        keep(&w->state.x1[l], here, w->start.x1[l]);
        keep(&w->state.v1[l], here, v1[l]);
        keep(&w->state.v2[l], here, w->start.v2[l]);
        keep(&w->state.y[l], here, w->start.y[l]);
        keep(&w->from_min[l], here, w->start.x1[l] - w->robot.x1_min[l]);
        keep(&w->from_max[l], here, w->start.x1[l] - w->robot.x1_max[l]);
        keep(&w->side_1[l], here, side_1[l]);
        keep(&w->side_2[l], here, side_2[l]);
    }
    for (int l = 0; l < LANES; l++) {
        const real before = 1.0 - fresh[l];
        const bool here = fresh[l] > 0.0;
        w->max_phases[l] = max_phases;
        w->fresh_1[l] *= before;
        w->fresh_2[l] *= before;
        w->alone[l] *= before;
        w->events[l] *= before;
        w->left[l] *= before;
        w->event[l] *= before;
        w->ending[l] *= before;
        keep(&w->t[l], here, 0.0);
        keep(&w->free[l], here, 0.0);
        keep(&w->count[l], here, 1.0);
    }
}

/* The number of the next stance, its robot at hand. */
static int64_t next_stance(queue *from)
{
    const int64_t i = from->next++;
    if (i == 0 || (from->many_robots && hopform_robot_changes_real(from->in, i))) {
        const hopform_robot_real robot = hopform_robot_of_real(from->in, i);
        from->robot_status = hopform_plan_init_real(&from->plan, &robot);
        from->robot_number++;
    }
    return i;
}

static void solve_alone(queue *from, const hopform_plan_real *plan, int32_t robot_status, int64_t i)
{
    if (hopform_solve_column_real(plan, robot_status, from->in, from->out, i) != HOPFORM_OK) {
        from->kept = HOPFORM_PHASES_NOT_KEPT;
    }
}

/* Fill idle lanes with the next stances that can be solved here; those that cannot are solved on the way. */
static void refill(lanes *w, queue *from)
{
    column fresh, odd;
    int32_t taken = 1;
    while (taken > 0) {
        taken = 0;
        for (int l = 0; l < LANES; l++) {
            fresh[l] = 0.0;
            while (!(w->live[l] > 0.0) && from->next < from->pause) {
                const int64_t i = next_stance(from);
                if (from->robot_status < 0) {
                    solve_alone(from, &from->plan, from->robot_status, i);
                } else {
                    take(w, l, from, i);
                    w->listed[l] = 0;
                    fresh[l] = 1.0;
                    taken++;
                    w->busy++;
                }
            }
        }
        start_stances(w, fresh, (real)from->in->max_phases, odd);
        if (!any(odd)) {
            return;
        }
        for (int l = 0; l < LANES; l++) {
            if (odd[l] > 0.0) {
                solve_alone(from, &w->plan[l], HOPFORM_OK, w->index[l]);
                w->live[l] = w->begins[l] = 0.0;
                w->busy--;
            }
        }
    }
}

/* With all lanes empty: if they have not been worth it, solve as many stances as a long run of them one by one. */
static void look_back(lanes *w, queue *from)
{
    const int64_t run = w->evaluations > 0 ? LONG_RUN : SHORT_RUN;
    const bool worth = w->evaluations <= LANES_WORTH * w->solved;
    const int64_t until = from->count - from->next < run ? from->count : from->next + run;
    while (!worth && from->next < until) {
        const int64_t i = next_stance(from);
        solve_alone(from, &from->plan, from->robot_status, i);
    }
    const int64_t ahead = worth ? run : SHORT_RUN;
    from->pause = from->count - from->next < ahead ? from->count : from->next + ahead;
    w->evaluations = 0;
    w->solved = 0;
}

/* List the event that a window has ended with, if its phase could be kept. */
static void list_event(lanes *w, int l, const hopform_stances_out_real *out)
{
    if (w->event[l] > 0.0 && w->listed[l] < out->event_capacity && w->count[l] <= (real)hopform_phases_kept_real(out)) {
        const int64_t place = w->index[l] * out->event_capacity + w->listed[l];
        out->event_time[place] = w->t[l];
        out->event_kind[place] = (int8_t)w->event[l];
        w->listed[l]++;
    }
}

/* What is told of stances that have ended. */
typedef struct {
    column ended, x2, apex, aed;
} result_columns;

/* The results; a stance whose numbers left the range of the type is left. */
LANES_CODE static void end_stances(lanes *restrict w, result_columns *restrict result)
{
    column strange;
    for (int l = 0; l < LANES; l++) {
        const hopform_robot_real robot = one_of_robot_columns(&w->robot, l);
        const hopform_state_real start = one_of_state_columns(&w->start, l);
        const hopform_state_real end = one_of_state_columns(&w->state, l);
        const hopform_at_real at = {end.x1, end.v1, end.v2, end.y};
        const real flies = is(w->ending[l], HOPFORM_ENDING_TAKEOFF) * flag(robot.g > 0.0);
        hopform_robot_real pulled = robot;
        pulled.g = flies > 0.0 ? robot.g : 1.0;
        const real reached = hopform_apex_of_takeoff_real(&pulled, end.x1, end.v2 > 0.0 ? end.v2 : 0.0);
        const real apex = flies > 0.0 ? reached : 0.0;
        const real aed = hopform_body_energy_gain_real(&robot, &start, &at);
        const real sound =
            flag(fabs_real(w->t[l]) <= HOPFORM_NEVER_real) * flag(fabs_real(end.x1) <= HOPFORM_NEVER_real)
            * flag(fabs_real(end.v1) <= HOPFORM_NEVER_real) * flag(fabs_real(end.v2) <= HOPFORM_NEVER_real)
            * flag(fabs_real(end.y) <= HOPFORM_NEVER_real) * flag(fabs_real(apex) <= HOPFORM_NEVER_real)
            * flag(fabs_real(aed) <= HOPFORM_NEVER_real)
            * flag(fabs_real(0.5 * robot.m_eff * start.v1 * start.v1) <= HOPFORM_NEVER_real);
        result->x2[l] = hopform_body_height_real(&robot, end.x1, end.y);
        result->apex[l] = flies > 0.0 ? apex : (real)NAN;
        result->aed[l] = aed;
        result->ended[l] = w->live[l] * flag(w->ending[l] > 0.0);
        strange[l] = result->ended[l] * (1.0 - sound);
    }
    leave(w, strange);
    for (int l = 0; l < LANES; l++) {
        result->ended[l] *= flag(!(w->left[l] > 0.0));
    }
}

/* Some of the lanes. */
typedef struct {
    int32_t count;
    int32_t lane[LANES];
} crew;

/* The list of a stance that has ended, closed. */
static void close_list(const lanes *w, int l, queue *to)
{
    const hopform_stances_out_real *out = to->out;
    for (int32_t n = w->listed[l]; n < out->event_capacity; n++) {
        out->event_time[w->index[l] * out->event_capacity + n] = (real)NAN;
        out->event_kind[w->index[l] * out->event_capacity + n] = HOPFORM_EVENT_NONE;
    }
    if (w->listed[l] != (int32_t)w->events[l]) {
        to->kept = HOPFORM_PHASES_NOT_KEPT;
    }
}

/* The results, and how many there are. */
static int32_t write(const lanes *w, const result_columns *result, queue *to)
{
    const hopform_stances_out_real *out = to->out;
    crew who;
    who.count = 0;
    for (int32_t l = 0; l < LANES; l++) {
        who.lane[who.count] = l;
        who.count += result->ended[l] > 0.0 ? 1 : 0;
    }
    for (int32_t n = 0; n < who.count; n++) {
        const int32_t l = who.lane[n];
        const int64_t i = w->index[l];
        hopform_put_code_real(&out->status, i, (int32_t)w->ending[l]);
        hopform_put_real(&out->duration, i, w->t[l]);
        hopform_put_real(&out->x1, i, w->state.x1[l]);
        hopform_put_real(&out->v1, i, w->state.v1[l]);
        hopform_put_real(&out->x2, i, result->x2[l]);
        hopform_put_real(&out->v2, i, w->state.v2[l]);
        hopform_put_real(&out->apex, i, result->apex[l]);
        hopform_put_real(&out->aed, i, result->aed[l]);
        hopform_put_code_real(&out->event_count, i, (int32_t)w->events[l]);
    }
    for (int32_t n = 0; n < who.count && out->event_time != NULL; n++) {
        close_list(w, who.lane[n], to);
    }
    return who.count;
}

/* Whether stances leave their lanes: they have ended, or cannot be solved here. */
LANES_CODE static bool some_leave(const lanes *restrict w, real *restrict leaves)
{
    for (int l = 0; l < LANES; l++) {
        leaves[l] = w->live[l] * flag(w->left[l] + w->ending[l] > 0.0);
    }
    return any(leaves);
}

/* Lanes become idle; `alone` is 1 where the stance that was there has no answer. */
LANES_CODE static bool empty_lanes(lanes *restrict w, const real *restrict leaves, const real *restrict ended,
                                   real *restrict alone)
{
    for (int l = 0; l < LANES; l++) {
        alone[l] = leaves[l] * (1.0 - ended[l]);
        w->live[l] *= 1.0 - leaves[l];
        w->begins[l] *= 1.0 - leaves[l];
    }
    return any(alone);
}

/* Take the stances that have ended out of their lanes, and those that cannot be solved here. */
static void collect(lanes *w, queue *to)
{
    column leaves, alone;
    result_columns result;
    for (int l = 0; l < LANES && to->out->event_time != NULL; l++) {
        if (w->live[l] > 0.0 && !(w->left[l] > 0.0)) {
            list_event(w, l, to->out);
        }
    }
    if (!some_leave(w, leaves)) {
        return;
    }
    end_stances(w, &result);
    const int32_t ended = write(w, &result, to);
    w->solved += ended;
    w->busy -= ended;
    if (!empty_lanes(w, leaves, result.ended, alone)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        if (alone[l] > 0.0) {
            solve_alone(to, &w->plan[l], HOPFORM_OK, w->index[l]);
            w->busy--;
        }
    }
}

/* An idle lane holds numbers that no step stumbles over. */
static void clear(lanes *w)
{
    memset(w, 0, sizeof *w);
    for (int l = 0; l < LANES; l++) {
        w->poles.p[l] = w->poles.q[l] = w->poles.s_1[l] = w->poles.s_2[l] = 1.0;
        w->chi[l] = w->omega[l] = w->half_turn[l] = 1.0;
    }
}

int32_t LANES_NAME(int64_t count, const hopform_stances_in_real *in, const hopform_stances_out_real *out)
{
    lanes w;
    workspace work;
    queue stances = {0};
    stances.count = count;
    stances.in = in;
    stances.out = out;
    stances.many_robots = hopform_has_many_robots_real(in);
    clear(&w);
    memset(&work, 0, sizeof work);
    for (;;) {
        if (stances.next < stances.pause && w.busy <= MOST_BUSY) {
            refill(&w, &stances);
        }
        if (w.busy > 0) {
            advance(&w, &work);
            collect(&w, &stances);
        } else if (stances.next < count) {
            look_back(&w, &stances);
        } else {
            return stances.kept;
        }
    }
}

#endif
