/* SPDX-License-Identifier: MIT-0
 *
 * Many stances of one robot at a time, one in each lane of vector registers: every loop over the lanes is one that
 * compilers turn into vector instructions. What a lane computes is the text of one stance: the kernels, the formulas,
 * the certificate and the steps of the search are the functions of its headers, so the bits are those of stance_real.c.
 * A round takes one phase of the lanes that are in the same mode; the others wait. What is rare is not done here: such
 * a stance is left to hopform_solve_stance_real. Numbers, flags (1 or 0) and kinds are all of one type.
 *
 * Before it is included, LANES_NAME is the function to make, and LANES_CODE what goes before each function. Where the
 * lanes take more than one evaluation of all of them a stance, stances are solved one by one for a while.
 */
#ifndef HOPFORM_LANES_H_real
#define HOPFORM_LANES_H_real

#include <stdbool.h>
#include <string.h>

#if defined(__GNUC__) && !defined(__clang__)
/* Each of these puts jumps into loops that had none. */
#pragma GCC optimize("no-thread-jumps", "no-tree-pre", "no-tree-sink", "no-tree-loop-im")
#endif

#include "facts.h"
#include "columns_real.h"
#include "first_event_real.h"
#include "phase_real.h"

enum {
    LANES = HOPFORM_LANE_COUNT_real,
    SLOTS = MOST_EVENT_FUNCTIONS_real,
    MODES = 9,
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
#define RECORD_IN_COLUMNS(record, type, MEMBERS)                                                                       \
    typedef struct {                                                                                                   \
        MEMBERS(COLUMN)                                                                                                \
    } record##_columns;                                                                                                \
    static inline type one_##record(const record##_columns *columns, int l)                                            \
    {                                                                                                                  \
        const type one = {MEMBERS(TAKE_MEMBER)};                                                                       \
        return one;                                                                                                    \
    }                                                                                                                  \
    static inline void put_##record(record##_columns *columns, int l, const type *one)                                 \
    {                                                                                                                  \
        MEMBERS(PUT_MEMBER)                                                                                            \
    }                                                                                                                  \
    static inline void keep_##record(record##_columns *columns, int l, bool yes, const type *one)                      \
    {                                                                                                                  \
        MEMBERS(KEEP_MEMBER)                                                                                           \
    }
#define JET_MEMBERS(X) X(value, NUMBER) X(rate, NUMBER) X(curvature, NUMBER) X(third, NUMBER)
#define PAIR_MEMBERS(X) X(Rd, NUMBER) X(R, NUMBER) X(R1, NUMBER) X(R2, NUMBER) X(R3, NUMBER)
#define DECAY_MEMBERS(X) X(e, NUMBER) X(e1, NUMBER) X(e2, NUMBER) X(e3, NUMBER)
#define PAIR_TERM_MEMBERS(X) X(before, NUMBER) X(term, NUMBER) X(R2, NUMBER) X(R3, NUMBER)
#define BASIS_TERM_MEMBERS(X)                                                                                          \
    X(earlier, NUMBER) X(before, NUMBER) X(term, NUMBER) X(W2, NUMBER) X(W3, NUMBER) X(W4, NUMBER)

RECORD_IN_COLUMNS(state, hopform_state_real, HOPFORM_STATE_MEMBERS)
RECORD_IN_COLUMNS(motion, hopform_motion_real, HOPFORM_MOTION_MEMBERS)
RECORD_IN_COLUMNS(basis, hopform_basis_real, HOPFORM_BASIS_MEMBERS)
RECORD_IN_COLUMNS(jet, jet_real, JET_MEMBERS)
RECORD_IN_COLUMNS(pair, hopform_pair_real, PAIR_MEMBERS)
RECORD_IN_COLUMNS(decay, hopform_decay_real, DECAY_MEMBERS)
RECORD_IN_COLUMNS(pair_terms, hopform_pair_terms_real, PAIR_TERM_MEMBERS)
RECORD_IN_COLUMNS(basis_terms, hopform_basis_terms_real, BASIS_TERM_MEMBERS)

/* An event function, one a lane. */
typedef struct {
    column H3, H2, H1, start;
} function_columns;

static inline event_function_real one_function(const function_columns *g, int l)
{
    const event_function_real one = {{g->H3[l], g->H2[l], g->H1[l]}, g->start[l], 0, 0};
    return one;
}

static inline void put_function(function_columns *g, int l, real sign, const hopform_numerator_real *numerator,
                                real start)
{
    g->H3[l] = sign * numerator->H3;
    g->H2[l] = sign * numerator->H2;
    g->H1[l] = sign * numerator->H1;
    g->start[l] = start;
}

/* The stances under way. */
typedef struct {
    hopform_plan_real plan;
    real max_phases;

    column live; /* 1 where there is a stance */
    column left; /* 1 where it is left to the scalar code */
    column turn; /* 1 where this round takes a phase of it */
    column u, horizon, t, fresh_1, fresh_2, count, events;
    column mode;         /* 3 (side_1 + 1) + side_2 + 1 */
    column alone, free;  /* the mass that has come to rest while the other was held, and its free acceleration */
    state_columns start; /* of the stance */
    state_columns state;
    column from_min; /* x1 - x1_min and x1 - x1_max: x1 itself has no digits for what is this close to a stop */
    column from_max;

    /* Of the round. */
    int side_1, side_2;
    hopform_poles_real poles;
    hopform_node_real node;
    real chi, omega;
    column halt, limit; /* when a mass that slips alone comes to rest, and the end of the phase: since it began, as all
                           its times */
    motion_columns motion;
    function_columns function[SLOTS];
    column on[SLOTS];
    int kind[SLOTS], side[SLOTS];
    bool used[SLOTS];        /* whether one of the lanes has such a function */
    jet_columns from[SLOTS]; /* at the ends of the phase's one interval: others are left to the scalar code */
    jet_columns to[SLOTS];
    column end_t, found; /* -1: none */
    basis_columns end;
    column event, ending; /* what it has brought */

    int32_t busy;        /* lanes with a stance */
    int64_t evaluations; /* of W for all lanes */
    int64_t solved;
    int64_t index[LANES];
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

/* Stances of this round that are left to the scalar code. */
static inline void leave(lanes *restrict w, const real *restrict who)
{
    if (!any(who)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        const bool leaves = who[l] * w->turn[l] > 0.0;
        keep(&w->left[l], leaves, 1.0);
        keep(&w->turn[l], leaves, 0.0);
    }
}

/* ---- the propagator ---- */

/* The pair over a time that is short for it. Lanes whose series has ended wait for the others. */
LANES_CODE static void short_pairs(const hopform_poles_real poles, const real *restrict t, const real *restrict wanted,
                                   pair_columns *restrict pair)
{
    column going;
    pair_terms_columns terms;
    for (int l = 0; l < LANES; l++) {
        const hopform_pair_terms_real first = hopform_first_pair_terms_real();
        put_pair_terms(&terms, l, &first);
        going[l] = wanted[l];
    }
    for (int n = 1; n < HOPFORM_TERMS_real - 1 && any(going); n += 2) {
        for (int l = 0; l < LANES; l++) {
            hopform_pair_terms_real one = one_pair_terms(&terms, l);
            hopform_add_pair_terms_real(&one, -(poles.p * t[l]), -(poles.q * t[l] * t[l]), n);
            keep_pair_terms(&terms, l, going[l] > 0.0, &one);
            going[l] *= flag(!hopform_pair_terms_end_real(&one));
        }
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_pair_terms_real one = one_pair_terms(&terms, l);
        const hopform_pair_real there = hopform_pair_of_terms_real(&poles, t[l], &one);
        keep_pair(pair, l, wanted[l] > 0.0, &there);
    }
}

LANES_CODE static void ringing_pairs(const hopform_poles_real poles, real omega, const real *restrict t,
                                     const real *restrict wanted, pair_columns *restrict pair)
{
    for (int l = 0; l < LANES; l++) {
        const hopform_pair_core_real core = hopform_ringing_core_real(&poles, omega, t[l]);
        const hopform_pair_real there = hopform_pair_of_core_real(&poles, t[l], &core);
        keep_pair(pair, l, wanted[l] > 0.0, &there);
    }
}

/* W of three poles over a short time. */
LANES_CODE static void short_bases(const hopform_poles_real poles, const real *restrict t, const real *restrict wanted,
                                   basis_columns *restrict basis)
{
    column going;
    basis_terms_columns terms;
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_terms_real first = hopform_first_basis_terms_real();
        put_basis_terms(&terms, l, &first);
        going[l] = wanted[l];
    }
    for (int n = 1; n < HOPFORM_TERMS_real - 2 && any(going); n += 3) {
        for (int l = 0; l < LANES; l++) {
            hopform_basis_terms_real one = one_basis_terms(&terms, l);
            hopform_add_basis_terms_real(&one, -(poles.s_1 * t[l]), -(poles.s_2 * t[l] * t[l]),
                                         -(poles.s_3 * t[l] * t[l] * t[l]), n);
            keep_basis_terms(&terms, l, going[l] > 0.0, &one);
            going[l] *= flag(!hopform_basis_terms_end_real(&one));
        }
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_terms_real one = one_basis_terms(&terms, l);
        const hopform_basis_real there = hopform_basis_of_terms_real(&poles, t[l], &one);
        keep_basis(basis, l, wanted[l] > 0.0, &there);
    }
}

/* W at t where `wanted`, as hopform_basis_at_real; a lane whose poles lie close to each other is left. */
LANES_CODE static void bases_at(lanes *restrict w, const real *restrict t, const real *restrict wanted,
                                basis_columns *restrict basis)
{
    column brief, pairs, swift, rings, splits, close;
    const hopform_poles_real poles = w->poles;
    const real chi = w->chi, omega = w->omega;
    const bool held = !(fabs_real(poles.a) > 0.0);
    w->evaluations++;
    for (int l = 0; l < LANES; l++) {
        const real late = flag(chi * t[l] * t[l] >= 1.0);
        const real soon = flag(poles.s_1 * t[l] < 4.0);
        const real by_pair = held ? 1.0 : late;
        const real early = flag(poles.q * t[l] * t[l] < 1.0);
        brief[l] = wanted[l] * (1.0 - by_pair) * soon;
        close[l] = wanted[l] * (1.0 - by_pair) * (1.0 - soon);
        pairs[l] = wanted[l] * by_pair;
        swift[l] = pairs[l] * early;
        rings[l] = pairs[l] * (1.0 - early);
        splits[l] = held ? 0.0 : pairs[l];
    }
    leave(w, close);
    if (any(brief)) {
        short_bases(poles, t, brief, basis);
    }
    if (!any(pairs)) {
        return;
    }
    pair_columns pair = {{0}, {0}, {0}, {0}, {0}};
    if (any(rings)) {
        ringing_pairs(poles, omega, t, rings, &pair);
    }
    if (any(swift)) {
        short_pairs(poles, t, swift, &pair);
    }
    if (held) {
        for (int l = 0; l < LANES; l++) {
            const hopform_basis_real one = {pair.Rd[l], pair.R[l], pair.R1[l], pair.R2[l], pair.R3[l]};
            keep_basis(basis, l, pairs[l] > 0.0, &one);
        }
        return;
    }
    decay_columns decays;
    for (int l = 0; l < LANES; l++) {
        const real z = poles.a * t[l];
        const hopform_decay_real fast = hopform_decay_of_exp_real(poles.a, t[l], hopform_exp_real(-z));
        real tail = 0.0;
#define ADD_TERM(coefficient) tail = tail * z + (coefficient);
        HOPFORM_DECAY_TAIL_real(ADD_TERM)
#undef ADD_TERM
            const hopform_decay_real slow = hopform_decay_of_tail_real(poles.a, t[l], tail);
        put_decay(&decays, l, &slow);
        keep_decay(&decays, l, !(fabs_real(z) < 1.0), &fast);
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_decay_real decay = one_decay(&decays, l);
        const hopform_pair_real there = one_pair(&pair, l);
        const hopform_basis_real split = hopform_basis_of_split_real(&poles, chi, t[l], &decay, &there);
        keep_basis(basis, l, splits[l] > 0.0, &split);
    }
}

/* ---- the start of a phase ---- */

/* The mode of most stances has its turn; false if its pair does not ring, and the stances are left. */
static bool choose_mode(lanes *w)
{
    int32_t stances[MODES] = {0};
    int most = 0;
    for (int l = 0; l < LANES; l++) {
        stances[(int)w->mode[l]] += w->live[l] > 0.0 ? 1 : 0;
    }
    for (int mode = 1; mode < MODES; mode++) {
        most = stances[mode] > stances[most] ? mode : most;
    }
    for (int l = 0; l < LANES; l++) {
        w->turn[l] = w->live[l] * is(w->mode[l], most);
        w->event[l] = 0.0;
        w->ending[l] = 0.0;
    }
    w->side_1 = most / 3 - 1;
    w->side_2 = most % 3 - 1;
    w->poles = *hopform_poles_of_real(&w->plan, w->side_1, w->side_2);
    w->node = *hopform_node_of_real(&w->plan, w->side_1, w->side_2);
    const real mean = 0.5 * w->poles.p;
    const real square = w->poles.q - mean * mean;
    w->omega = square > 0.0 ? sqrt_real(square) : 1.0;
    w->chi = hopform_residue_real(&w->poles);
    if (!(square > 0.0)) {
        leave(w, w->turn);
    }
    return square > 0.0;
}

#define MOVE(moving)                                                                                                   \
    LANES_CODE static void move_##moving(lanes *restrict w)                                                            \
    {                                                                                                                  \
        const hopform_robot_real robot = w->plan.robot;                                                                \
        const hopform_rates_real rates = w->plan.rates;                                                                \
        const real side_1 = (real)w->side_1, side_2 = (real)w->side_2;                                                 \
        for (int l = 0; l < LANES; l++) {                                                                              \
            const hopform_state_real state = one_state(&w->state, l);                                                  \
            const hopform_drive_real drive = hopform_drive_of_real(&robot, &rates, w->u[l], side_1, side_2);           \
            const hopform_motion_real motion = hopform_motion_of_##moving##_real(&rates, &drive, &state);              \
            put_motion(&w->motion, l, &motion);                                                                        \
        }                                                                                                              \
    }

MOVE(both)
MOVE(actuator)
MOVE(body)

/* The motion of a mass that goes on alone from where it has come to rest. */
LANES_CODE static void move_on(lanes *restrict w)
{
    const real side = (real)(w->side_2 == 0 ? w->side_1 : w->side_2);
    const real friction = w->side_2 == 0 ? w->plan.robot.f1 : w->plan.robot.f2;
    const int mass = w->side_2 == 0 ? 1 : 2;
    column goes_on, rate;
    for (int l = 0; l < LANES; l++) {
        goes_on[l] = is(w->alone[l], mass);
        rate[l] = w->free[l] - side * friction;
    }
    if (!any(goes_on)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        hopform_motion_real motion = one_motion(&w->motion, l);
        hopform_go_on_real(&motion, mass, true, rate[l]);
        keep_motion(&w->motion, l, goes_on[l] > 0.0, &motion);
    }
}

static void start_motion(lanes *w)
{
    if (w->side_1 != 0 && w->side_2 != 0) {
        move_both(w);
    } else if (w->side_1 != 0) {
        move_actuator(w);
        move_on(w);
    } else {
        move_body(w);
        move_on(w);
    }
}

/* When a mass that slips alone comes to rest; the phase ends there at last. Lanes in which it does so at once, or in
 * which y rings about 0, as in stance_real.c, are left. */
LANES_CODE static void start_halts(lanes *restrict w)
{
    column left;
    const bool alone = w->side_1 == 0 || w->side_2 == 0;
    const hopform_robot_real robot = w->plan.robot;
    const hopform_rates_real rates = w->plan.rates;
    const hopform_poles_real poles = w->poles;
    const bool only_1 = w->side_2 == 0;
    const real sign = (real)(only_1 ? w->side_1 : w->side_2);
    const real friction = only_1 ? robot.f1 : robot.f2;
    const real *velocity = only_1 ? w->state.v1 : w->state.v2;
    const real *rate = only_1 ? w->motion.H3_1 : w->motion.H3_2;
    const real omega = w->omega;
    for (int l = 0; l < LANES; l++) {
        w->halt[l] = HOPFORM_NEVER_real;
        left[l] = 0.0;
    }
    if (alone) {
        for (int l = 0; l < LANES; l++) {
            const real v = sign * velocity[l];
            const real acc = sign * rate[l];
            w->halt[l] = time_to_rest_of_ringing_real(&poles, omega, v, acc);
            left[l] = flag(!(v > 0.0)) * flag(!(acc > 0.0));
        }
        for (int l = 0; l < LANES; l++) {
            const hopform_state_real slack = {0.0, 0.0, 0.0, 0.0};
            const hopform_free_real free = hopform_free_accelerations_real(&rates, &slack, w->u[l]);
            const real over = (only_1 ? free.free_1 : free.free_2) - sign * friction;
            left[l] += flag(!(w->state.y[l] < 0.0)) * flag(!(fabs_real(over) > 0.0));
        }
    }
    for (int l = 0; l < LANES; l++) {
        const real until = w->horizon[l] - w->t[l];
        w->limit[l] = w->halt[l] < until ? w->halt[l] : until;
    }
    leave(w, left);
}

/* Whether a lane's actuator is kept from moving up or down, a side. */
static inline bool blocks(const lanes *w, int l, int side)
{
    const bool locked = !(w->plan.robot.x1_min < w->plan.robot.x1_max);
    const bool at_end = side < 0 ? w->from_min[l] <= 0.0 : w->from_max[l] >= 0.0;
    return at_end | locked;
}

/* Take-off. */
LANES_CODE static void add_takeoffs(lanes *restrict w)
{
    const bool falls = w->side_1 < 0 || w->side_2 > 0; /* else y only rises, from 0 or above */
    w->kind[0] = BY_TAKEOFF;
    w->side[0] = 0;
    for (int l = 0; l < LANES; l++) {
        const hopform_numerator_real leg = {w->motion.H3_y[l], w->motion.H2_y[l], w->motion.H1_y[l]};
        put_function(&w->function[0], l, 1.0, &leg, w->state.y[l]);
        w->on[0][l] = w->turn[l] * flag(falls | (w->state.y[l] < 0.0));
    }
}

/* The velocities of both masses. */
LANES_CODE static void add_velocities(lanes *restrict w)
{
    const real side_1 = (real)w->side_1, side_2 = (real)w->side_2;
    w->kind[1] = BY_VELOCITY_1;
    w->kind[2] = BY_VELOCITY_2;
    w->side[1] = w->side[2] = 0;
    for (int l = 0; l < LANES; l++) {
        const real rate_1 = w->fresh_1[l] > 0.0 ? 0.0 : w->motion.H3_1[l];
        const real rate_2 = w->fresh_2[l] > 0.0 ? 0.0 : w->motion.H3_2[l];
        const hopform_numerator_real first = {rate_1, w->motion.H2_1[l], w->motion.H1_1[l]};
        const hopform_numerator_real second = {rate_2, w->motion.H2_2[l], w->motion.H1_2[l]};
        put_function(&w->function[1], l, side_1, &first, side_1 * w->state.v1[l]);
        put_function(&w->function[2], l, side_2, &second, side_2 * w->state.v2[l]);
        w->on[1][l] = w->on[2][l] = w->turn[l];
    }
}

/* Where a mass that is held slips to on either side, while the other one moves. */
LANES_CODE static void add_thresholds(lanes *restrict w)
{
    const bool held_1 = w->side_1 == 0;
    const hopform_rates_real rates = w->plan.rates;
    const real friction = held_1 ? w->plan.robot.f1 : w->plan.robot.f2;
    const int towards = hopform_side_of_slip_real(&rates, w->side_1, w->side_2);
    for (int s = 1; s < SLOTS; s++) {
        w->kind[s] = held_1 ? BY_THRESHOLD_1 : BY_THRESHOLD_2;
        w->side[s] = 2 * s - 3;
        const real sign = (real)w->side[s];
        for (int l = 0; l < LANES; l++) {
            const hopform_state_real state = one_state(&w->state, l);
            const hopform_motion_real motion = one_motion(&w->motion, l);
            const hopform_free_real at_rest = hopform_free_accelerations_real(&rates, &state, w->u[l]);
            const hopform_numerator_real free_1 = hopform_free_numerator_1_real(&rates, &motion);
            const hopform_numerator_real free_2 = hopform_free_numerator_2_real(&rates, &motion);
            const hopform_numerator_real slips = {held_1 ? free_1.H3 : free_2.H3, held_1 ? free_1.H2 : free_2.H2,
                                                  held_1 ? free_1.H1 : free_2.H1};
            const real free = held_1 ? at_rest.free_1 : at_rest.free_2;
            put_function(&w->function[s], l, -sign, &slips, friction - sign * free);
        }
        for (int l = 0; l < LANES; l++) {
            w->on[s][l] = w->turn[l] * flag(w->side[s] != -towards) * flag(!(held_1 & blocks(w, l, w->side[s])));
        }
    }
}

/* The jets of a function when a phase begins; lanes in which it is below zero already are left. */
LANES_CODE static void start_jets(lanes *restrict w, int s)
{
    column lost;
    const hopform_poles_real poles = w->poles;
    for (int l = 0; l < LANES; l++) {
        const event_function_real g = one_function(&w->function[s], l);
        jet_real jet = jet_at_start_real(&poles, &g);
        const bool below = jet.value < 0.0;
        lost[l] = w->on[s][l] * flag(below & (jet.rate <= 0.0));
        jet.value = below ? 0.0 : jet.value;
        put_jet(&w->from[s], l, &jet);
    }
    leave(w, lost);
}

static void start_phases(lanes *w)
{
    start_motion(w);
    start_halts(w);
    add_takeoffs(w);
    if (w->side_1 != 0 && w->side_2 != 0) {
        add_velocities(w);
    } else {
        add_thresholds(w);
    }
    for (int s = 0; s < SLOTS; s++) {
        w->used[s] = any(w->on[s]);
        if (w->used[s]) {
            start_jets(w, s);
        }
    }
}

/* ---- the first event ---- */

static inline propagator_real end_of_lane(const lanes *w, int l)
{
    const propagator_real at = {w->end_t[l], one_basis(&w->end, l), 0.0};
    return at;
}

/* The jets of all functions at the end of the interval; without third derivatives. */
LANES_CODE static void look_there(lanes *restrict w, int s, const real *restrict wanted)
{
    const hopform_poles_real poles = w->poles;
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_real basis = one_basis(&w->end, l);
        const propagator_real at = propagator_of_real(&poles, w->end_t[l], &basis);
        const event_function_real g = one_function(&w->function[s], l);
        const jet_real jet = short_jet_at_real(&g, &at);
        keep_jet(&w->to[s], l, wanted[l] > 0.0, &jet);
    }
}

/* Interval in which the first root is looked for: up to the node of the plan, or to the limit. */
LANES_CODE static void reach_nodes(lanes *restrict w)
{
    column wanted;
    const real node_t = w->node.t;
    const hopform_basis_real basis = {w->node.Wdd, w->node.Wd, w->node.W, w->node.W1, w->node.W2};
    for (int l = 0; l < LANES; l++) {
        const bool node = node_t < w->limit[l];
        w->end_t[l] = node ? node_t : w->limit[l];
        w->found[l] = -1.0;
        put_basis(&w->end, l, &basis);
        wanted[l] = w->turn[l] * flag(!node);
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
    const hopform_poles_real poles = w->poles;
    for (int l = 0; l < LANES; l++) {
        const propagator_real at = end_of_lane(w, l);
        const event_function_real g = one_function(&w->function[s], l);
        const jet_real to = one_jet(&w->to[s], l);
        const bool crossed = has_crossed_real(&to, at.t, rounding_of_real(&g, &at, to.rate), w->found[l] < 0.0);
        going[l] = wanted[l] * w->on[s][l] * flag(crossed) * (1.0 - is(w->found[l], s));
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
            const hopform_basis_real basis = one_basis(&w->end, l);
            const propagator_real at = propagator_of_real(&poles, w->end_t[l], &basis);
            const event_function_real g = one_function(&w->function[s], l);
            const jet_real from = one_jet(&w->from[s], l);
            const jet_real to = one_jet(&w->to[s], l);
            const interpolant_real p = interpolant_of_real(&from, &to, third_of_real(&poles, &g, &at), w->end_t[l]);
            const real step = prediction_step_real(&p, find->next[l]);
            const real next = find->next[l] - step;
            keep(&find->next[l], (going[l] > 0.0) & (next > 0.0) & (next < 1.0), next);
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

/* Steps to the roots, as located_root_real takes them; a lane in which they do not converge is left. */
LANES_CODE static void find_roots(lanes *restrict w, search *restrict find)
{
    const hopform_poles_real poles = w->poles;
    for (int n = 0; n < ROOT_STEPS && any(find->going); n++) {
        bases_at(w, find->t, find->going, &find->basis);
        for (int l = 0; l < LANES; l++) {
            const hopform_basis_real basis = one_basis(&find->basis, l);
            const event_function_real g = one_function(&find->function, l);
            const propagator_real at = propagator_of_real(&poles, find->t[l], &basis);
            const jet_real jet = jet_at_real(&poles, &g, &at);
            const root_step_real step =
                step_between_real(&poles, &jet, fourth_of_real(&poles, &jet), find->t[l], find->low[l], find->high[l]);
            const real going = find->going[l];
            const real arrives = going * flag(step.arrives);
            keep_basis(&w->end, l, arrives > 0.0, &basis);
            keep(&w->end_t[l], arrives > 0.0, find->t[l]);
            find->lands[l] = going * flag(step.lands);
            find->going[l] = going - arrives - find->lands[l];
            find->low[l] = step.low;
            find->high[l] = step.high;
            find->next[l] = step.inside ? step.next : step.low + 0.5 * (step.high - step.low);
        }
        if (any(find->lands)) {
            for (int l = 0; l < LANES; l++) {
                const hopform_basis_real basis = one_basis(&find->basis, l);
                const hopform_basis_real there = carried_basis_real(&poles, &basis, find->next[l] - find->t[l]);
                keep_basis(&w->end, l, find->lands[l] > 0.0, &there);
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
    for (int l = 0; l < LANES; l++) {
        const propagator_real at = end_of_lane(w, l);
        const event_function_real g = one_function(&w->function[s], l);
        const bool is_found = is(w->found[l], s) > 0.0;
        keep(&find->found_rate[l], is_found, w->to[s].rate[l]);
        keep(&find->found_rounding[l], is_found, rounding_of_real(&g, &at, w->to[s].rate[l]));
    }
}

/* Lanes in which a function has no certificate by the rules that take no further evaluation, or ties with the one that
 * was found, are left. */
LANES_CODE static void certify(lanes *restrict w, int s, const search *restrict find)
{
    column open, leaves;
    const hopform_poles_real poles = w->poles;
    const real fades = w->node.fades;
    for (int l = 0; l < LANES; l++) {
        const propagator_real at = end_of_lane(w, l);
        const event_function_real g = one_function(&w->function[s], l);
        const jet_real from = one_jet(&w->from[s], l);
        const jet_real to = one_jet(&w->to[s], l);
        const real d = from.curvature + poles.a * from.rate;
        const real d_then = to.curvature + poles.a * to.rate;
        const real rounding = rounding_of_real(&g, &at, to.rate);
        const bool ties =
            (w->found[l] > (real)s) & is_tie_real(&to, rounding, at.t, find->found_rate[l], find->found_rounding[l]);
        const bool above = is_above_zero_real(&to, rounding) | (is(w->found[l], s) > 0.0);
        leaves[l] = w->on[s][l] * flag((at.t > fades) | ties | !above);
        open[l] = w->turn[l] * w->on[s][l] * (1.0 - flag(has_no_root_real(&from, d, &to, d_then)));
    }
    leave(w, leaves);
    if (!any(open)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        const propagator_real at = end_of_lane(w, l);
        const event_function_real g = one_function(&w->function[s], l);
        const jet_real from = one_jet(&w->from[s], l);
        const real rounding = rounding_of_real(&g, &at, w->to[s].rate[l]);
        open[l] *= flag(!(quiet_time_of_ringing_real(&poles, &from, rounding) > at.t));
    }
    if (!any(open)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        const propagator_real at = end_of_lane(w, l);
        const event_function_real g = one_function(&w->function[s], l);
        const jet_real from = one_jet(&w->from[s], l);
        const jet_real to = one_jet(&w->to[s], l);
        const real rounding = rounding_of_real(&g, &at, to.rate);
        const bool is_found = is(w->found[l], s) > 0.0;
        open[l] *= flag(!has_no_root_by_pair_real(&poles, &g, &at, &from, &to));
        open[l] *= flag(!is_held_up_by_bernstein_real(&poles, &g, &from, &to, at.t, is_found, rounding));
    }
    leave(w, open);
}

/* The first event of each phase. */
static void find_first_events(lanes *w, search *find)
{
    column crossed;
    reach_nodes(w);
    memcpy(crossed, w->turn, sizeof crossed);
    for (int n = 0; n <= MOST_EVENT_FUNCTIONS_real; n++) {
        for (int s = 0; s < SLOTS; s++) {
            if (w->used[s]) {
                look_there(w, s, crossed);
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
    column at_limit;
    for (int l = 0; l < LANES; l++) {
        at_limit[l] = w->turn[l] * flag(!(w->end_t[l] < w->limit[l])) * flag(w->found[l] < 0.0);
    }
    if (!any(at_limit)) {
        return;
    }
    for (int s = SLOTS - 1; s >= 0; s--) {
        if (!w->used[s] || (s > 0 && w->kind[s] != BY_THRESHOLD_1)) {
            continue;
        }
        for (int l = 0; l < LANES; l++) {
            const propagator_real at = end_of_lane(w, l);
            const event_function_real g = one_function(&w->function[s], l);
            const jet_real to = one_jet(&w->to[s], l);
            const bool is_first = (s == 0) | !(w->halt[l] > w->limit[l]);
            const bool crosses = crosses_at_limit_real(&to, rounding_of_real(&g, &at, to.rate), w->limit[l]);
            keep(&w->found[l], (at_limit[l] * w->on[s][l] > 0.0) & is_first & crosses, (real)s);
        }
    }
}

/* ---- stops ---- */

/* The search for the stop ahead: `gap` is x_1 counted from it at the start of the phase. */
typedef struct {
    column gap, low, high, t, next, going, lands;
    basis_columns basis;
} stop_search;

/* Intervals end where x_1 meets its stop, as meets_stop_real finds it; `stops` says which. */
LANES_CODE static void meet_stops(lanes *restrict w, real *restrict stops)
{
    column tied;
    stop_search find;
    const real side = (real)w->side_1;
    const real *gap = w->side_1 > 0 ? w->from_max : w->from_min;
    const hopform_poles_real poles = w->poles;
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real from_stop = {gap[l], w->state.v1[l], w->state.v2[l], w->state.y[l]};
        const hopform_motion_real motion = one_motion(&w->motion, l);
        const hopform_basis_real basis = one_basis(&w->end, l);
        const bool past = is_beyond_stop_real(&motion, &from_stop, side, &basis);
        stops[l] = w->turn[l] * fabs_real(side) * flag(within_range(gap[l]) & past);
        find.gap[l] = gap[l];
        find.low[l] = 0.0;
        find.high[l] = w->end_t[l];
        find.t[l] = w->end_t[l];
        find.going[l] = stops[l];
    }
    if (!any(stops)) {
        return;
    }
    memcpy(&find.basis, &w->end, sizeof find.basis);
    for (int n = 0; n < ROOT_STEPS && any(find.going); n++) {
        if (n > 0) {
            bases_at(w, find.t, find.going, &find.basis);
        }
        for (int l = 0; l < LANES; l++) {
            const hopform_state_real from_stop = {find.gap[l], w->state.v1[l], w->state.v2[l], w->state.y[l]};
            const hopform_motion_real motion = one_motion(&w->motion, l);
            const hopform_basis_real basis = one_basis(&find.basis, l);
            const approach_real to = approach_of_real(&poles, &motion, &from_stop, side, &basis);
            const root_step_real step = step_to_stop_real(&poles, &to, find.t[l], find.low[l], find.high[l]);
            const real next = step.inside ? step.next : step.low + 0.5 * (step.high - step.low);
            const real going =
                find.going[l] * (1.0 - flag(step.arrives)) * flag((next > step.low) & (next < step.high));
            find.low[l] = step.low;
            find.high[l] = step.high;
            find.next[l] = next;
            find.lands[l] = going * flag(step.lands);
            find.going[l] = going;
        }
        if (any(find.lands)) {
            for (int l = 0; l < LANES; l++) {
                const hopform_basis_real basis = one_basis(&find.basis, l);
                const hopform_basis_real there = carried_basis_real(&poles, &basis, find.next[l] - find.t[l]);
                keep_basis(&find.basis, l, find.lands[l] > 0.0, &there);
            }
        }
        for (int l = 0; l < LANES; l++) {
            keep(&find.t[l], find.going[l] > 0.0, find.next[l]);
            find.going[l] -= find.lands[l];
        }
    }
    leave(w, find.going);
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_real basis = one_basis(&find.basis, l);
        const bool here = stops[l] > 0.0;
        tied[l] = stops[l] * is(w->found[l], 0) * flag(w->end_t[l] <= find.t[l] * (1.0 + 8.0 * HOPFORM_EPS_real));
        keep_basis(&w->end, l, here, &basis);
        keep(&w->end_t[l], here, find.t[l]);
    }
    leave(w, tied);
}

/* ---- what follows ---- */

/* What is told of a mass that has come to rest alone: its free acceleration from the motion, not from the state. */
LANES_CODE static void keep_free_accelerations(lanes *restrict w, const real *restrict how)
{
    const bool only_1 = w->side_2 == 0;
    const bool alone = only_1 || w->side_1 == 0;
    const int by_velocity = only_1 ? BY_VELOCITY_1 : BY_VELOCITY_2;
    const real side = (real)(only_1 ? w->side_1 : w->side_2);
    const real friction = only_1 ? w->plan.robot.f1 : w->plan.robot.f2;
    const real *H3 = only_1 ? w->motion.H3_1 : w->motion.H3_2;
    const real *H2 = only_1 ? w->motion.H2_1 : w->motion.H2_2;
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_real basis = one_basis(&w->end, l);
        const real rests = alone ? is(how[l], by_velocity) : 0.0;
        const real free = hopform_free_after_motion_real(side, friction, H3[l], H2[l], &basis);
        keep(&w->free[l], rests > 0.0, free);
        keep(&w->alone[l], how[l] > (real)NO_END, rests * (only_1 ? 1.0 : 2.0));
    }
}

/* A mass that has come to rest stays there, is stopped, or goes on: its velocity is 0. */
LANES_CODE static void come_to_rest(lanes *restrict w, const real *restrict how, const real *restrict touches,
                                    real *restrict hits)
{
    const hopform_robot_real robot = w->plan.robot;
    const real stop = w->side_1 > 0 ? robot.x1_max : robot.x1_min;
    for (int l = 0; l < LANES; l++) {
        hits[l] = is(how[l], BY_STOP);
        const real by_velocity = is(how[l], BY_VELOCITY_1);
        const bool there = hits[l] + by_velocity * touches[l] > 0.0;
        keep(&w->state.x1[l], there, stop);
        keep(&w->from_min[l], there, stop - robot.x1_min);
        keep(&w->from_max[l], there, stop - robot.x1_max);
        keep(&w->state.v1[l], by_velocity + hits[l] > 0.0, 0.0);
        keep(&w->state.v2[l], is(how[l], BY_VELOCITY_2) > 0.0, 0.0);
        keep(&w->state.y[l], is(how[l], BY_TAKEOFF) > 0.0, 0.0);
    }
}

static inline real on_threshold(real acceleration, real friction)
{
    return flag(!(fabs_real(acceleration) < friction)) * (1.0 - fabs_real(hopform_goes_real(acceleration, friction)));
}

/* Where each mass would go from rest. Lanes in which one that rests is exactly on its threshold are left. */
LANES_CODE static void sides_from_rest(lanes *restrict w, const real *restrict rests_1, const real *restrict rests_2,
                                       real *restrict side_1, real *restrict side_2)
{
    column threshold;
    const hopform_robot_real robot = w->plan.robot;
    const hopform_rates_real rates = w->plan.rates;
    const bool slides = w->side_2 != 0 && !(robot.f1 > 0.0) && !(fabs_real(rates.a1_v1) > 0.0);
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real state = one_state(&w->state, l);
        const hopform_free_real free = hopform_free_accelerations_real(&rates, &state, w->u[l]);
        const real free_1 = is(w->alone[l], 1) > 0.0 ? w->free[l] : free.free_1;
        const real free_2 = is(w->alone[l], 2) > 0.0 ? w->free[l] : free.free_2;
        const real goes_1 = hopform_goes_real(free_1, robot.f1);
        const real stops = flag((goes_1 < 0.0) & blocks(w, l, -1)) + flag((goes_1 > 0.0) & blocks(w, l, 1));
        side_1[l] = stops > 0.0 ? 0.0 : goes_1;
        side_2[l] = hopform_goes_real(free_2, robot.f2);
        const real faint = flag(slides & hopform_is_faint_real(&rates, &state, free_1));
        threshold[l] =
            rests_1[l] * (on_threshold(free_1, robot.f1) + faint) + rests_2[l] * on_threshold(free_2, robot.f2);
    }
    leave(w, threshold);
}

/* The state and the modes after the end of a phase. */
LANES_CODE static void pass(lanes *restrict w, const real *restrict how, const real *restrict touches)
{
    column hits, rests_1, rests_2, slips_1, slips_2, from_rest_1, from_rest_2, crowded;
    const real before_1 = (real)w->side_1, before_2 = (real)w->side_2;
    const real slot_1 = (real)w->side[1], slot_2 = (real)w->side[2];
    keep_free_accelerations(w, how);
    come_to_rest(w, how, touches, hits);
    for (int l = 0; l < LANES; l++) {
        rests_1[l] = is(how[l], BY_VELOCITY_1) + hits[l];
        rests_2[l] = is(how[l], BY_VELOCITY_2);
        slips_1[l] = is(how[l], BY_THRESHOLD_1);
        slips_2[l] = is(how[l], BY_THRESHOLD_2);
    }
    sides_from_rest(w, rests_1, rests_2, from_rest_1, from_rest_2);
    for (int l = 0; l < LANES; l++) {
        const real sticks_1 = rests_1[l] * (1.0 - fabs_real(from_rest_1[l]));
        const real sticks_2 = rests_2[l] * (1.0 - fabs_real(from_rest_2[l]));
        const real reverses_1 = rests_1[l] * flag(from_rest_1[l] * before_1 < 0.0);
        const real reverses_2 = rests_2[l] * flag(from_rest_2[l] * before_2 < 0.0);
        w->event[l] = hits[l] * (sticks_1 + reverses_1) * (real)HOPFORM_EVENT_X1_HITS_STOP
                      + (1.0 - hits[l])
                            * (sticks_1 * (real)HOPFORM_EVENT_X1_STICKS + reverses_1 * (real)HOPFORM_EVENT_X1_REVERSES)
                      + sticks_2 * (real)HOPFORM_EVENT_X2_STICKS + reverses_2 * (real)HOPFORM_EVENT_X2_REVERSES
                      + slips_1[l] * (real)HOPFORM_EVENT_X1_SLIPS + slips_2[l] * (real)HOPFORM_EVENT_X2_SLIPS;
        w->events[l] += flag(w->event[l] > 0.0);
    }
    for (int l = 0; l < LANES; l++) {
        const real goes_on = rests_1[l] + rests_2[l] + slips_1[l] + slips_2[l];
        const real slot = is(w->found[l], 1) * slot_1 + is(w->found[l], 2) * slot_2;
        const real other_1 = slips_1[l] > 0.0 ? slot : before_1;
        const real other_2 = slips_2[l] > 0.0 ? slot : before_2;
        const real side_1 = rests_1[l] > 0.0 ? from_rest_1[l] : other_1;
        const real side_2 = rests_2[l] > 0.0 ? from_rest_2[l] : other_2;
        const real rests = goes_on * (1.0 - fabs_real(side_1)) * (1.0 - fabs_real(side_2));
        w->count[l] += goes_on;
        crowded[l] = goes_on * flag(w->count[l] > w->max_phases);
        keep(&w->mode[l], goes_on > 0.0, 3.0 * (side_1 + 1.0) + side_2 + 1.0);
        keep(&w->fresh_1[l], goes_on > 0.0, slips_1[l]);
        keep(&w->fresh_2[l], goes_on > 0.0, slips_2[l]);
        w->ending[l] = is(how[l], BY_TAKEOFF) * (real)HOPFORM_ENDING_TAKEOFF
                       + is(how[l], BY_LIMIT) * (real)HOPFORM_ENDING_HORIZON + rests * (real)HOPFORM_ENDING_REST;
    }
    leave(w, crowded);
}

/* A take-off late in a phase whose time has not all its digits is left. */
LANES_CODE static void look_at_takeoffs(lanes *restrict w, const real *restrict how)
{
    column late;
    for (int l = 0; l < LANES; l++) {
        late[l] = is(how[l], BY_TAKEOFF) * flag(fabs_real(w->end.Wdd[l]) < 0.25);
    }
    if (!any(late)) {
        return;
    }
    const hopform_plan_real *plan = &w->plan;
    for (int l = 0; l < LANES; l++) { /* rare enough to be one after the other */
        if (late[l] > 0.0) {
            const hopform_state_real slack = {0.0, 0.0, 0.0, 0.0};
            const hopform_motion_real from_slack = hopform_motion_of_real(plan, &slack, w->u[l], w->side_1, w->side_2);
            const real settled = hopform_settled_y_real(&w->poles, from_slack.H2_y, from_slack.H1_y);
            const hopform_basis_real basis = one_basis(&w->end, l);
            const hopform_numerator_real leg = {w->motion.H3_y[l], w->motion.H2_y[l], w->motion.H1_y[l]};
            const real later =
                steady_state_correction_real(&w->poles, &leg, w->state.y[l], settled, &basis, w->end_t[l]);
            late[l] = flag(fabs_real(later) > 0.0);
        }
    }
    leave(w, late);
}

/* How a phase ends in each lane; one in which the interval has brought nothing is left. */
LANES_CODE static void choose_ends(lanes *restrict w, const real *restrict stops, real *restrict how)
{
    column nothing;
    const bool only_1 = w->side_2 == 0;
    const real by_halt = (real)(only_1 ? BY_VELOCITY_1 : BY_VELOCITY_2);
    const real kinds[SLOTS] = {(real)w->kind[0], (real)w->kind[1], (real)w->kind[2]};
    for (int l = 0; l < LANES; l++) {
        const real kind = is(w->found[l], 0) * kinds[0] + is(w->found[l], 1) * kinds[1] + is(w->found[l], 2) * kinds[2];
        const real halts =
            flag(!(w->halt[l] > w->limit[l])) * flag(!(w->end_t[l] < w->limit[l] * (1.0 - 8.0 * HOPFORM_EPS_real)));
        const real wins = halts * flag(only_1) * flag(w->found[l] > 0.0); /* over mass 2 at the same time */
        const real happens = flag(w->found[l] >= 0.0) * (1.0 - wins);
        const real reached = flag(!(w->end_t[l] < w->limit[l])) * (real)BY_LIMIT;
        const real at_the_end = halts > 0.0 ? by_halt : reached;
        const real event = happens > 0.0 ? kind : at_the_end;
        how[l] = w->turn[l] * (stops[l] > 0.0 ? (real)BY_STOP : event);
        nothing[l] = flag(how[l] <= (real)NO_END);
    }
    leave(w, nothing);
}

/* The states where the phases end. */
LANES_CODE static void arrive(lanes *restrict w, const real *restrict how, real *restrict touches)
{
    const bool moves_1 = w->side_1 != 0, moves_2 = w->side_2 != 0;
    const real *gaps = w->side_1 > 0 ? w->from_max : w->from_min;
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real state = one_state(&w->state, l);
        const hopform_motion_real motion = one_motion(&w->motion, l);
        const hopform_basis_real basis = one_basis(&w->end, l);
        const hopform_at_real at = hopform_state_at_real(&state, &motion, &basis);
        const hopform_state_real from_zero = {0.0, state.v1, state.v2, state.y};
        const hopform_at_real moved = hopform_state_at_real(&from_zero, &motion, &basis);
        const real gap = gaps[l];
        const hopform_state_real from_stop = {gap, state.v1, state.v2, state.y};
        const bool near_stop = fabs_real(gap + moved.x1_t) <= grazing_tolerance_real(&motion, &from_stop, &basis);
        const bool ends = how[l] > (real)NO_END;
        touches[l] = flag(within_range(gap) & near_stop);
        keep(&w->from_min[l], ends & moves_1, w->from_min[l] + moved.x1_t);
        keep(&w->from_max[l], ends & moves_1, w->from_max[l] + moved.x1_t);
        keep(&w->state.x1[l], ends & moves_1, at.x1_t);
        keep(&w->state.v1[l], ends, moves_1 ? at.v1_t : 0.0);
        keep(&w->state.v2[l], ends, moves_2 ? at.v2_t : 0.0);
        keep(&w->state.y[l], ends, at.y_t);
        keep(&w->t[l], ends, how[l] > (real)BY_STOP ? w->horizon[l] : w->t[l] + w->end_t[l]);
    }
}

/* One phase of the stances whose turn it is. */
static void advance(lanes *w, search *find)
{
    column stops, how, touches;
    if (!choose_mode(w)) {
        return;
    }
    start_phases(w);
    find_first_events(w, find);
    cross_at_the_limit(w);
    meet_stops(w, stops);
    choose_ends(w, stops, how);
    look_at_takeoffs(w, how);
    arrive(w, how, touches);
    pass(w, how, touches);
}

/* ---- stances in and out ---- */

/* Where a batch is, and whose turn it is. */
typedef struct {
    const hopform_stances_in_real *in;
    const hopform_stances_out_real *out;
    int64_t next;
    int64_t pause; /* where lanes are filled no further, to look whether they are worth it */
    int64_t end;
    int32_t kept;
} queue;

/* Put a stance into a lane; whether it can be solved there is still to be seen. */
static void take(lanes *w, int l, const hopform_stances_in_real *in, int64_t i)
{
    w->start.x1[l] = hopform_number_real(&in->x1, i);
    w->start.v1[l] = hopform_number_real(&in->v1, i);
    w->start.v2[l] = hopform_number_real(&in->v2, i);
    w->start.y[l] = hopform_number_real(&in->y, i);
    w->u[l] = hopform_number_real(&in->u, i);
    w->horizon[l] = hopform_number_real(&in->horizon, i);
    w->index[l] = i;
    w->listed[l] = 0;
    w->live[l] = 1.0;
    w->busy++;
}

/* The start of the stances that have just been taken; `odd` is 1 where one does not start as most do: a leg that is
 * compressed, or begins to be, no mass on its threshold. */
LANES_CODE static void start_stances(lanes *restrict w, const real *restrict fresh, real *restrict odd)
{
    column v1, strange;
    const hopform_robot_real robot = w->plan.robot;
    const hopform_rates_real rates = w->plan.rates;
    const bool locked = !(robot.x1_min < robot.x1_max);
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real state = one_state(&w->start, l);
        const real sound = flag(within_range(state.x1) & within_range(state.v1) & within_range(state.v2)
                                & within_range(state.y) & within_range(w->u[l]))
                           * flag((state.y >= 0.0) & (state.x1 >= robot.x1_min) & (state.x1 <= robot.x1_max))
                           * flag((w->horizon[l] > 0.0) & (w->horizon[l] <= HOPFORM_NEVER_real))
                           * flag(!hopform_stores_much_real(&robot, &state));
        strange[l] = HOPFORM_CONTACT_IS_COMPRESSION ? 1.0 - sound : 1.0;
        const real stops = flag(state.v1 > 0.0) * flag(locked | (state.x1 >= robot.x1_max))
                           + flag(state.v1 < 0.0) * flag(locked | (state.x1 <= robot.x1_min));
        v1[l] = stops > 0.0 ? 0.0 : state.v1;
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real state = {w->start.x1[l], v1[l], w->start.v2[l], w->start.y[l]};
        const hopform_free_real free = hopform_free_accelerations_real(&rates, &state, w->u[l]);
        const real goes_1 = hopform_goes_real(free.free_1, robot.f1);
        const real goes_2 = hopform_goes_real(free.free_2, robot.f2);
        const real blocked = flag(goes_1 > 0.0) * flag(locked | (state.x1 >= robot.x1_max))
                             + flag(goes_1 < 0.0) * flag(locked | (state.x1 <= robot.x1_min));
        const real from_rest_1 = blocked > 0.0 ? 0.0 : goes_1;
        const real rests_1 = flag(!(fabs_real(state.v1) > 0.0));
        const real rests_2 = flag(!(fabs_real(state.v2) > 0.0));
        const real doubt =
            rests_1 * on_threshold(free.free_1, robot.f1) + rests_2 * on_threshold(free.free_2, robot.f2);
        const real side_1 = rests_1 * from_rest_1 + flag(state.v1 > 0.0) - flag(state.v1 < 0.0);
        const real side_2 = rests_2 * goes_2 + flag(state.v2 > 0.0) - flag(state.v2 < 0.0);
        const real leaves = flag(!(state.y > 0.0)) * flag(!(state.v1 > state.v2));
        const real rests = (1.0 - fabs_real(side_1)) * (1.0 - fabs_real(side_2));
        const bool here = fresh[l] > 0.0;
        odd[l] = fresh[l] * flag(strange[l] + doubt + leaves + rests > 0.0);
        keep_state(&w->state, l, here, &state);
        keep(&w->from_min[l], here, state.x1 - robot.x1_min);
        keep(&w->from_max[l], here, state.x1 - robot.x1_max);
        keep(&w->mode[l], here, 3.0 * (side_1 + 1.0) + side_2 + 1.0);
    }
    for (int l = 0; l < LANES; l++) {
        const bool here = fresh[l] > 0.0;
        keep(&w->fresh_1[l], here, 0.0);
        keep(&w->fresh_2[l], here, 0.0);
        keep(&w->alone[l], here, 0.0);
        keep(&w->events[l], here, 0.0);
        keep(&w->left[l], here, 0.0);
        keep(&w->t[l], here, 0.0);
        keep(&w->count[l], here, 1.0);
    }
}

static void solve_alone(queue *from, const hopform_plan_real *plan, int64_t i)
{
    if (hopform_solve_column_real(plan, HOPFORM_OK, from->in, from->out, i) != HOPFORM_OK) {
        from->kept = HOPFORM_PHASES_NOT_KEPT;
    }
}

/* Lanes become idle; the stances that were there are solved by themselves where a flag says so. */
static void empty_lanes(lanes *w, queue *from, const real *leaves, const real *alone)
{
    for (int l = 0; l < LANES; l++) {
        if (leaves[l] > 0.0) {
            w->live[l] = 0.0;
            w->busy--;
            if (alone[l] > 0.0) {
                solve_alone(from, &w->plan, w->index[l]);
            }
        }
    }
}

/* Fill idle lanes with the next stances that can be solved here; those that cannot are solved on the way. */
static void refill(lanes *w, queue *from)
{
    column fresh, odd;
    do {
        for (int l = 0; l < LANES; l++) {
            fresh[l] = flag(!(w->live[l] > 0.0) && from->next < from->pause);
            if (fresh[l] > 0.0) {
                take(w, l, from->in, from->next++);
            }
        }
        start_stances(w, fresh, odd);
        empty_lanes(w, from, odd, odd);
    } while (any(odd));
}

/* With all lanes empty: if they have not been worth it, solve as many stances as a long run of them one by one. */
static void look_back(lanes *w, queue *from)
{
    const int64_t run = w->evaluations > 0 ? LONG_RUN : SHORT_RUN;
    const bool worth = w->evaluations <= w->solved;
    const int64_t until = from->end - from->next < run ? from->end : from->next + run;
    while (!worth && from->next < until) {
        solve_alone(from, &w->plan, from->next++);
    }
    const int64_t ahead = worth ? run : SHORT_RUN;
    from->pause = from->end - from->next < ahead ? from->end : from->next + ahead;
    w->evaluations = 0;
    w->solved = 0;
}

/* List the event that a round has ended with, if its phase could be kept. */
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
    const hopform_robot_real robot = w->plan.robot;
    const bool falls = robot.g > 0.0;
    hopform_robot_real pulled = robot;
    pulled.g = falls ? robot.g : 1.0;
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real start = one_state(&w->start, l);
        const hopform_state_real end = one_state(&w->state, l);
        const hopform_at_real at = {end.x1, end.v1, end.v2, end.y};
        const bool flies = falls & (is(w->ending[l], HOPFORM_ENDING_TAKEOFF) > 0.0);
        const real reached = hopform_apex_of_takeoff_real(&pulled, end.x1, end.y, end.v2 > 0.0 ? end.v2 : 0.0);
        const real apex = flies ? reached : 0.0;
        const real aed = hopform_body_energy_gain_real(&robot, &start, &at);
        const bool sound = within_range(w->t[l]) & within_range(end.x1) & within_range(end.v1) & within_range(end.v2)
                           & within_range(end.y) & within_range(apex) & within_range(aed)
                           & within_range(0.5 * robot.m_eff * start.v1 * start.v1);
        result->x2[l] = hopform_body_height_real(&robot, end.x1, end.y);
        result->apex[l] = flies ? apex : (real)NAN;
        result->aed[l] = aed;
        result->ended[l] = w->live[l] * flag(w->ending[l] > 0.0) * (1.0 - w->left[l]) * flag(sound);
    }
}

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

static void write_result(const lanes *w, int l, const result_columns *result, queue *to)
{
    const hopform_stances_out_real *out = to->out;
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
    if (out->event_time != NULL) {
        close_list(w, l, to);
    }
}

/* Whether stances leave their lanes: they have ended, or cannot be solved here. */
LANES_CODE static bool some_leave(const lanes *restrict w, real *restrict leaves)
{
    for (int l = 0; l < LANES; l++) {
        leaves[l] = w->live[l] * flag(w->left[l] + w->ending[l] > 0.0);
    }
    return any(leaves);
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
    for (int l = 0; l < LANES; l++) {
        alone[l] = leaves[l] * (1.0 - result.ended[l]);
        if (result.ended[l] > 0.0) {
            write_result(w, l, &result, to);
            w->solved++;
        }
    }
    empty_lanes(w, to, leaves, alone);
}

int32_t LANES_NAME(const hopform_plan_real *plan, int64_t first, int64_t end, const hopform_stances_in_real *in,
                   const hopform_stances_out_real *out)
{
    lanes w;
    search find;
    queue stances = {in, out, first, first, end, HOPFORM_OK};
    memset(&w, 0, sizeof w);
    memset(&find, 0, sizeof find);
    w.plan = *plan;
    w.max_phases = (real)in->max_phases;
    for (;;) {
        if (stances.next < stances.pause && w.busy <= MOST_BUSY) {
            refill(&w, &stances);
        }
        if (w.busy > 0) {
            advance(&w, &find);
            collect(&w, &stances);
        } else if (stances.next < end) {
            look_back(&w, &stances);
        } else {
            return stances.kept;
        }
    }
}

#endif
