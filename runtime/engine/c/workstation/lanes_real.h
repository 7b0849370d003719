/* SPDX-License-Identifier: MIT-0
 *
 * Many stances at a time, one in each lane of vector registers: every loop over the lanes is one that compilers turn
 * into vector instructions. The steps, their order and so the bits are those of stance_real.c. What is rare there is
 * not done here: such a stance is left to hopform_solve_stance_real. Numbers, flags (1 or 0) and kinds are all of one
 * type.
 *
 * Before it is included, LANES_NAME is the function to make, and LANES_CODE what goes before each function. Where the
 * lanes take more than one evaluation of all of them a stance, stances are solved one by one for a while.
 */
#ifndef HOPFORM_LANES_H_real
#define HOPFORM_LANES_H_real

#include <stdbool.h>
#include <string.h>

#include "facts.h"
#include "columns_real.h"
#include "first_event_real.h"
#include "phase_real.h"

enum {
    LANES = HOPFORM_LANE_COUNT_real,
    SLOTS = MOST_EVENT_FUNCTIONS_real,
    ROOT_STEPS = 6,
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

/* An event function, one a lane. */
typedef struct {
    column H3, H2, H1, start;
} function_columns;

typedef struct {
    column value, rate, curvature, third;
} jet_columns;

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
    column chi, omega, half_turn;
    motion_columns motion;
    column node_t, fades; /* as in the plan */
    basis_columns node;
    function_columns function[SLOTS];
    column on[SLOTS], kind[SLOTS], side[SLOTS];
    bool used[SLOTS]; /* whether one of the lanes has such a function */

    jet_columns from[SLOTS]; /* at the ends of the phase's one interval: others are left to the scalar code */
    jet_columns to[SLOTS];
    column end_t, found; /* -1: none */
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

/* ---- jets ---- */

static inline event_function_real one_function(const function_columns *g, int l)
{
    const event_function_real one = {{g->H3[l], g->H2[l], g->H1[l]}, g->start[l], 0, 0};
    return one;
}

static inline jet_real one_jet(const jet_columns *jets, int l)
{
    const jet_real jet = {jets->value[l], jets->rate[l], jets->curvature[l], jets->third[l]};
    return jet;
}

static inline void put_jet(jet_columns *jets, int l, const jet_real *jet)
{
    jets->value[l] = jet->value;
    jets->rate[l] = jet->rate;
    jets->curvature[l] = jet->curvature;
    jets->third[l] = jet->third;
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
    }
    for (int l = 0; l < LANES; l++) {
        if (w->begins[l] > 0.0) {
            const hopform_node_real *node = hopform_node_of_real(&w->plan[l], (int)w->side_1[l], (int)w->side_2[l]);
            w->node_t[l] = node->t;
            w->fades[l] = node->fades;
            w->node.Wdd[l] = node->Wdd;
            w->node.Wd[l] = node->Wd;
            w->node.W[l] = node->W;
            w->node.W1[l] = node->W1;
            w->node.W2[l] = node->W2;
        }
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

/* When each mass that slips alone comes to rest, as time_to_rest_real of a pair that swings; the phase ends there
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

static inline void keep_function(lanes *w, int s, int l, bool yes, real on, real kind, real side,
                                 const function_columns *g)
{
    keep(&w->on[s][l], yes, on);
    keep(&w->kind[s][l], yes, kind);
    keep(&w->side[s][l], yes, side);
    keep(&w->function[s].H3[l], yes, g->H3[l]);
    keep(&w->function[s].H2[l], yes, g->H2[l]);
    keep(&w->function[s].H1[l], yes, g->H1[l]);
    keep(&w->function[s].start[l], yes, g->start[l]);
}

/* Take-off. */
LANES_CODE static void add_takeoffs(lanes *restrict w)
{
    function_columns leg;
    for (int l = 0; l < LANES; l++) {
        leg.H3[l] = w->motion.H3_y[l];
        leg.H2[l] = w->motion.H2_y[l];
        leg.H1[l] = w->motion.H1_y[l];
        leg.start[l] = w->state.y[l];
        const real falls = flag((w->side_1[l] < 0.0) | (w->side_2[l] > 0.0)
                                | (w->state.y[l] < 0.0)); /* else y only rises, from 0 or above */
        keep_function(w, 0, l, w->begins[l] > 0.0, falls, BY_TAKEOFF, 0.0, &leg);
    }
}

/* The velocities of both masses. */
LANES_CODE static void add_velocities(lanes *restrict w, const real *restrict who)
{
    function_columns first, second;
    for (int l = 0; l < LANES; l++) {
        const real side_1 = w->side_1[l];
        const real side_2 = w->side_2[l];
        first.H3[l] = side_1 * (w->fresh_1[l] > 0.0 ? 0.0 : w->motion.H3_1[l]);
        first.H2[l] = side_1 * w->motion.H2_1[l];
        first.H1[l] = side_1 * w->motion.H1_1[l];
        first.start[l] = side_1 * w->state.v1[l];
        second.H3[l] = side_2 * (w->fresh_2[l] > 0.0 ? 0.0 : w->motion.H3_2[l]);
        second.H2[l] = side_2 * w->motion.H2_2[l];
        second.H1[l] = side_2 * w->motion.H1_2[l];
        second.start[l] = side_2 * w->state.v2[l];
        keep_function(w, 1, l, who[l] > 0.0, 1.0, BY_VELOCITY_1, 0.0, &first);
        keep_function(w, 2, l, who[l] > 0.0, 1.0, BY_VELOCITY_2, 0.0, &second);
    }
}

/* Where a mass that is held slips to on either side, while the other one moves. */
LANES_CODE static void add_thresholds(lanes *restrict w, const real *restrict who)
{
    column blocked_below, blocked_above, free, friction;
    function_columns slips, below, above;
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
        const real held_1 = 1.0 - fabs_real(w->side_1[l]);
        below.H3[l] = slips.H3[l];
        below.H2[l] = slips.H2[l];
        below.H1[l] = slips.H1[l];
        below.start[l] = friction[l] + free[l];
        above.H3[l] = -slips.H3[l];
        above.H2[l] = -slips.H2[l];
        above.H1[l] = -slips.H1[l];
        above.start[l] = friction[l] - free[l];
        const real kind = held_1 * (real)BY_THRESHOLD_1 + (1.0 - held_1) * (real)BY_THRESHOLD_2;
        const real per_y = held_1 > 0.0 ? w->rates.a1_y[l] : w->rates.a2_y[l];
        const real per_v = held_1 > 0.0 ? w->rates.a1_v2[l] : w->rates.a2_v1[l];
        const real along = (flag(per_y > 0.0) - flag(per_y < 0.0)) * (w->side_1[l] - w->side_2[l]);
        const real towards = fabs_real(per_v) > 0.0 ? 0.0 : along; /* where it may slip to, 0 for either side */
        const real on_below = flag(!(towards > 0.0)) * (1.0 - held_1 * blocked_below[l]);
        const real on_above = flag(!(towards < 0.0)) * (1.0 - held_1 * blocked_above[l]);
        keep_function(w, 1, l, who[l] > 0.0, on_below, kind, -1.0, &below);
        keep_function(w, 2, l, who[l] > 0.0, on_above, kind, 1.0, &above);
    }
}

LANES_CODE static void start_functions(lanes *restrict w, mode_columns *restrict mode)
{
    add_takeoffs(w);
    if (any(mode->both)) {
        add_velocities(w, mode->both);
    }
    for (int l = 0; l < LANES; l++) {
        mode->body[l] += mode->actuator[l];
    }
    if (any(mode->body)) {
        add_thresholds(w, mode->body);
    }
}

/* The jets of a function when a phase begins, and whether it is below zero already. */
LANES_CODE static void start_jets(const lanes *restrict w, const function_columns *restrict functions,
                                  const real *restrict on, jet_columns *restrict from, real *restrict lost)
{
    column below;
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const event_function_real g = one_function(functions, l);
        const jet_real jet = jet_at_start_real(&poles, &g);
        put_jet(from, l, &jet);
        below[l] = flag(w->begins[l] > 0.0) * flag(on[l] > 0.0) * flag(jet.value < 0.0);
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
    start_functions(w, &mode);
    for (int s = 0; s < SLOTS; s++) {
        w->used[s] = any(w->on[s]);
        if (w->used[s]) {
            start_jets(w, &w->function[s], w->on[s], &w->from[s], lost);
        }
    }
    leave(w, lost);
}

/* ---- the first event ---- */

/* The jets of all functions at the end of the interval, where `wanted`; without third derivatives. */
LANES_CODE static void look_there(const lanes *restrict w, const function_columns *restrict functions,
                                  const real *restrict wanted, jet_columns *restrict to)
{
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_basis_real basis = one_of_basis_columns(&w->end, l);
        const propagator_real at = propagator_of_real(&poles, w->end_t[l], &basis);
        const event_function_real g = one_function(functions, l);
        const jet_real jet = short_jet_at_real(&g, &at);
        keep(&to->value[l], wanted[l] > 0.0, jet.value);
        keep(&to->rate[l], wanted[l] > 0.0, jet.rate);
        keep(&to->curvature[l], wanted[l] > 0.0, jet.curvature);
    }
}

/* Interval in which the first root is looked for: up to the node of the plan, or to the limit. */
LANES_CODE static void reach_nodes(lanes *restrict w, real *restrict wanted)
{
    for (int l = 0; l < LANES; l++) {
        const bool live = (w->live[l] > 0.0) & !(w->left[l] > 0.0);
        const bool node = live & (w->node_t[l] < w->limit[l]);
        const hopform_basis_real basis = one_of_basis_columns(&w->node, l);
        keep(&w->end_t[l], live, node ? w->node_t[l] : w->limit[l]);
        keep(&w->found[l], live, -1.0);
        keep_basis_columns(&w->end, l, node, &basis);
        wanted[l] = flag(live & !node);
    }
    if (any(wanted)) {
        bases_at(w, w->end_t, wanted, &w->end);
    }
}

/* The search for a root: which function, where it has got to, and the bracket. */
typedef struct {
    function_columns function;
    column crossed, number, share, low, high, t, next, going, lands;
    column found_rate, found_rounding; /* of the function that was found */
    basis_columns basis;
} search;

/* Where function s, if it has crossed zero by the end of the interval, did so: guesses of the share. True if it has in
 * some lane. */
LANES_CODE static bool guess_crossings(const lanes *restrict w, int s, const real *restrict wanted,
                                       search *restrict find)
{
    column going;
    const function_columns *functions = &w->function[s];
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_real basis = one_of_basis_columns(&w->end, l);
        const propagator_real at = {w->end_t[l], basis, 0.0};
        const event_function_real g = one_function(functions, l);
        const jet_real to = one_jet(&w->to[s], l);
        const real rounding = rounding_of_real(&g, &at, to.rate);
        const bool is_found = (w->found[l] >= (real)s) & (w->found[l] <= (real)s);
        const bool steep = (w->found[l] < 0.0) & (to.rate * w->end_t[l] < -rounding);
        const bool crossed = (to.value < 0.0) & !is_found & ((to.value < -rounding) | steep);
        going[l] = wanted[l] * flag((w->on[s][l] > 0.0) & crossed);
        find->crossed[l] = going[l];
    }
    if (!any(going)) {
        return false;
    }
    for (int l = 0; l < LANES; l++) {
        const jet_real from = one_jet(&w->from[s], l);
        const jet_real to = one_jet(&w->to[s], l);
        find->next[l] = rough_root_real(&from, &to, w->end_t[l]);
    }
    for (int n = 0; n < PREDICTION_STEPS_real && any(going); n++) {
        for (int l = 0; l < LANES; l++) {
            const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
            const hopform_basis_real basis = one_of_basis_columns(&w->end, l);
            const propagator_real at = propagator_of_real(&poles, w->end_t[l], &basis);
            const event_function_real g = one_function(functions, l);
            const jet_real from = one_jet(&w->from[s], l);
            const jet_real to = one_jet(&w->to[s], l);
            const interpolant_real p = interpolant_of_real(&from, &to, third_of_real(&poles, &g, &at), w->end_t[l]);
            const real x = find->next[l];
            const real step = prediction_step_real(&p, x);
            const real next = x - step;
            const bool inside = (next > 0.0) & (next < 1.0);
            keep(&find->next[l], (going[l] > 0.0) & inside, next);
            going[l] *= flag(!(fabs_real(step) < HOPFORM_PREDICTION_real));
        }
    }
    return true;
}

/* The function that has crossed zero first by the end of the interval, by the guesses. */
LANES_CODE static void choose_crossings(const lanes *restrict w, const real *restrict wanted, search *restrict find)
{
    for (int l = 0; l < LANES; l++) {
        find->number[l] = -1.0;
        find->share[l] = 2.0;
    }
    for (int s = 0; s < SLOTS; s++) {
        if (!w->used[s] || !guess_crossings(w, s, wanted, find)) {
            continue;
        }
        for (int l = 0; l < LANES; l++) {
            const bool here = (find->crossed[l] > 0.0) & (find->next[l] < find->share[l]);
            keep(&find->number[l], here, (real)s);
            keep(&find->share[l], here, find->next[l]);
            keep(&find->function.H3[l], here, w->function[s].H3[l]);
            keep(&find->function.H2[l], here, w->function[s].H2[l]);
            keep(&find->function.H1[l], here, w->function[s].H1[l]);
            keep(&find->function.start[l], here, w->function[s].start[l]);
        }
    }
    for (int l = 0; l < LANES; l++) {
        find->low[l] = 0.0;
        find->high[l] = w->end_t[l];
        const real guess = w->end_t[l] * find->share[l];
        const bool inside = (guess > 0.0) & (guess < w->end_t[l]);
        find->t[l] = inside ? guess : 0.5 * w->end_t[l];
    }
}

/* Householder's steps to the roots, as located_root_real takes them; a lane in which they do not converge is left. */
LANES_CODE static void find_roots(lanes *restrict w, search *restrict find)
{
    for (int n = 0; n < ROOT_STEPS && any(find->going); n++) {
        bases_at(w, find->t, find->going, &find->basis);
        for (int l = 0; l < LANES; l++) {
            const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
            const hopform_basis_real basis = one_of_basis_columns(&find->basis, l);
            const real t = find->t[l];
            const propagator_real at = propagator_of_real(&poles, t, &basis);
            const event_function_real g = one_function(&find->function, l);
            jet_real jet = short_jet_at_real(&g, &at);
            jet.third = third_of_real(&poles, &g, &at);
            const bool going = find->going[l] > 0.0;
            const bool arrived = going & (fabs_real(jet.value) <= HOPFORM_EPS_real * t * fabs_real(jet.rate));
            const real step = step_to_root_real(&jet);
            const real next = t - step;
            const bool goes_on = going & !arrived;
            const real low = (goes_on & (jet.value > 0.0)) ? t : find->low[l];
            const real high = (goes_on & (jet.value < 0.0)) ? t : find->high[l];
            const bool inside = (next > low) & (next < high);
            const bool last =
                goes_on & inside & step_converges_real(&poles, &jet, fourth_of_real(&poles, &jet), next, step);
            keep_basis_columns(&w->end, l, arrived, &basis);
            keep(&w->end_t[l], arrived, t);
            find->low[l] = low;
            find->high[l] = high;
            find->lands[l] = flag(last);
            find->next[l] = inside ? next : low + 0.5 * (high - low);
            find->going[l] = flag(goes_on & !last);
        }
        if (any(find->lands)) {
            for (int l = 0; l < LANES; l++) {
                const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
                const hopform_basis_real basis = one_of_basis_columns(&find->basis, l);
                const hopform_basis_real there = carried_basis_real(&poles, &basis, find->next[l] - find->t[l]);
                keep_basis_columns(&w->end, l, find->lands[l] > 0.0, &there);
                keep(&w->end_t[l], find->lands[l] > 0.0, find->next[l]);
            }
        }
        for (int l = 0; l < LANES; l++) {
            find->t[l] = find->next[l];
        }
    }
    leave(w, find->going);
}

/* How fast the function falls that was found, and its rounding. */
LANES_CODE static void look_at_found(const lanes *restrict w, int s, search *restrict find)
{
    const function_columns *functions = &w->function[s];
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_real basis = one_of_basis_columns(&w->end, l);
        const propagator_real at = {w->end_t[l], basis, 0.0};
        const event_function_real g = one_function(functions, l);
        const bool is_found = (w->found[l] >= (real)s) & (w->found[l] <= (real)s);
        keep(&find->found_rate[l], is_found, fabs_real(w->to[s].rate[l]));
        keep(&find->found_rounding[l], is_found, rounding_of_real(&g, &at, w->to[s].rate[l]));
    }
}

/* Lanes in which a function has no certificate by the rules that take no further evaluation, or ties with the one that
 * was found, are left. */
LANES_CODE static void certify(lanes *restrict w, int s, const search *restrict find)
{
    column open, leaves;
    const function_columns *functions = &w->function[s];
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_real basis = one_of_basis_columns(&w->end, l);
        const real h = w->end_t[l];
        const propagator_real at = {h, basis, 0.0};
        const event_function_real g = one_function(functions, l);
        const jet_real from = one_jet(&w->from[s], l);
        const jet_real to = one_jet(&w->to[s], l);
        const real d = from.curvature + w->poles.a[l] * from.rate;
        const real d_then = to.curvature + w->poles.a[l] * to.rate;
        const real rounding = rounding_of_real(&g, &at, to.rate);
        const real live = w->live[l] * w->on[s][l] * (1.0 - w->left[l]);
        const bool ties =
            (w->found[l] > (real)s) & (to.rate * h < -16.0 * rounding)
            & ((to.value - 4.0 * rounding) * find->found_rate[l] < fabs_real(to.rate) * find->found_rounding[l]);
        leaves[l] = live * flag((h > w->fades[l]) | ties);
        open[l] = live * (1.0 - flag(has_no_root_real(&from, d, &to, d_then)));
    }
    leave(w, leaves);
    if (!any(open)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_basis_real basis = one_of_basis_columns(&w->end, l);
        const event_function_real g = one_function(functions, l);
        const real h = w->end_t[l];
        const propagator_real at = {h, basis, 0.0};
        const jet_real from = one_jet(&w->from[s], l);
        const real rounding = rounding_of_real(&g, &at, w->to[s].rate[l]);
        open[l] *= flag(!(quiet_time_of_ringing_real(&poles, &from, rounding) > h));
    }
    if (!any(open)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_poles_real poles = one_of_poles_columns(&w->poles, l);
        const hopform_basis_real basis = one_of_basis_columns(&w->end, l);
        const event_function_real g = one_function(functions, l);
        const propagator_real at = {w->end_t[l], basis, 0.0};
        const jet_real from = one_jet(&w->from[s], l);
        const jet_real to = one_jet(&w->to[s], l);
        const bool is_found = (w->found[l] >= (real)s) & (w->found[l] <= (real)s);
        const real rounding = rounding_of_real(&g, &at, to.rate);
        open[l] *= flag(!has_no_root_by_pair_real(&poles, &g, &at, &from, &to));
        open[l] *= flag(!is_held_up_by_bernstein_real(&poles, &g, &from, &to, w->end_t[l], is_found, rounding));
    }
    leave(w, open);
}

/* The first event of each phase. */
LANES_CODE static void find_first_events(lanes *restrict w, search *restrict find)
{
    column wanted, crossed;
    reach_nodes(w, wanted);
    for (int l = 0; l < LANES; l++) {
        wanted[l] = flag((w->live[l] > 0.0) & !(w->left[l] > 0.0));
        crossed[l] = wanted[l];
    }
    for (int n = 0; n <= MOST_EVENT_FUNCTIONS_real; n++) {
        for (int s = 0; s < SLOTS; s++) {
            if (w->used[s]) {
                look_there(w, &w->function[s], crossed, &w->to[s]);
            }
        }
        if (n == MOST_EVENT_FUNCTIONS_real) {
            break;
        }
        choose_crossings(w, crossed, find);
        for (int l = 0; l < LANES; l++) {
            crossed[l] = flag(find->number[l] >= 0.0);
            find->going[l] = crossed[l];
        }
        if (!any(crossed)) {
            break;
        }
        find_roots(w, find);
        for (int l = 0; l < LANES; l++) {
            keep(&w->found[l], crossed[l] > 0.0, find->number[l]);
        }
    }
    for (int s = 1; s < SLOTS; s++) { /* the first wins a tie */
        if (w->used[s]) {
            look_at_found(w, s, find);
        }
    }
    for (int s = 0; s < SLOTS; s++) {
        if (w->used[s]) {
            certify(w, s, find);
        }
    }
}

/* At the time of the limit a take-off comes before it, and before mass 2 comes to rest what mass 1 does. */
LANES_CODE static void cross_at_the_limit(lanes *restrict w)
{
    column at_limit, crosses;
    for (int l = 0; l < LANES; l++) {
        at_limit[l] = w->live[l] * flag(!(w->end_t[l] < w->limit[l])) * flag(w->found[l] < 0.0);
    }
    if (!any(at_limit)) {
        return;
    }
    for (int s = SLOTS - 1; s >= 0; s--) {
        const jet_columns *to = &w->to[s];
        for (int l = 0; l < LANES; l++) {
            const hopform_basis_real basis = one_of_basis_columns(&w->end, l);
            const propagator_real at = {w->end_t[l], basis, 0.0};
            const event_function_real g = one_function(&w->function[s], l);
            const real rounding = rounding_of_real(&g, &at, to->rate[l]);
            const real reached = at_limit[l] * flag(w->on[s][l] > 0.0);
            const real is_first = s == 0 ? 1.0 : is(w->kind[s][l], BY_THRESHOLD_1) * flag(!(w->halt[l] > w->limit[l]));
            crosses[l] = reached * is_first * flag(to->rate[l] * w->limit[l] < -16.0 * rounding)
                         * flag(to->value[l] < -8.0 * HOPFORM_EPS_real * w->limit[l] * to->rate[l]);
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
        const approach_real to = approach_of_real(&poles, &motion, &from_stop, w->side_1[l], &one);
        const real step = step_to_root_real(&to.at);
        value[l] = to.at.value;
        rate[l] = to.at.rate;
        next[l] = t - step;
        near[l] = flag(step_converges_real(&poles, &to.at, to.fourth, next[l], step));
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
            const hopform_basis_real there = carried_basis_real(&poles, &one, next[l] - find->t[l]);
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
        const bool past = beyond > grazing_tolerance_real(&motion, &from_stop, &one);
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
        const real later = steady_state_correction_real(&poles, &leg, w->state.y[l], settled[l], &basis, w->end_t[l]);
        late[l] *= flag(fabs_real(later) > 0.0);
    }
    leave(w, late);
}

/* What follows the end of a phase; a lane in which the interval has brought nothing is left. */
LANES_CODE static void end_phases(lanes *restrict w, const real *restrict stops)
{
    column how, goes_on, touches;
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
    }
    leave(w, goes_on);
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
        const bool near_stop = fabs_real(gap + moved.x1_t) <= grazing_tolerance_real(&motion, &from_stop, &basis);
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

/* One phase of each stance. */
LANES_CODE static void advance(lanes *restrict w, search *restrict find)
{
    column stops;
    start_phases(w);
    find_first_events(w, find);
    cross_at_the_limit(w);
    meet_stops(w, stops);
    end_phases(w, stops);
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
        strange[l] = HOPFORM_CONTACT_IS_COMPRESSION ? 1.0 - sound : 1.0;
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
    const bool worth = w->evaluations <= w->solved;
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
        const real reached = hopform_apex_of_takeoff_real(&pulled, end.x1, end.y, end.v2 > 0.0 ? end.v2 : 0.0);
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
    search find;
    queue stances = {0};
    stances.count = count;
    stances.in = in;
    stances.out = out;
    stances.many_robots = hopform_has_many_robots_real(in);
    clear(&w);
    memset(&find, 0, sizeof find);
    for (;;) {
        if (stances.next < stances.pause && w.busy <= MOST_BUSY) {
            refill(&w, &stances);
        }
        if (w.busy > 0) {
            advance(&w, &find);
            collect(&w, &stances);
        } else if (stances.next < count) {
            look_back(&w, &stances);
        } else {
            return stances.kept;
        }
    }
}

#endif
