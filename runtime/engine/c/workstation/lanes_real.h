/* SPDX-License-Identifier: MIT-0
 *
 * Many stances of one robot at a time. Each is a chain, as one that is solved by itself; the first events of their
 * phases are looked for together, one phase in each lane of vector registers: every loop over the lanes is one that
 * compilers turn into vector instructions. What a lane computes is the text of one stance: the kernels, the formulas,
 * the certificate and the steps of the search are the functions of its headers, so the bits are the same. A round takes
 * one phase of the stances that are in the same mode; the others wait. A phase whose first event is not certified by
 * one interval, or is rare, is searched by itself. Flags are 1 or 0 and of the type of all numbers.
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

#include "chain_real.h"
#include "columns_real.h"

enum {
    LANES = HOPFORM_LANE_COUNT_real,
    SLOTS = MOST_EVENT_FUNCTIONS_real,
    MODES = 9,
    ROOT_STEPS = 6,
    PHASES_OF_LANE = 16, /* a stance whose list is wanted and takes more is solved by itself */
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

static inline real flag(bool yes)
{
    return yes ? 1.0 : 0.0;
}

static inline real is(real number, int one)
{
    return flag(number >= (real)one) * flag(number <= (real)one);
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
#define TAKE_MEMBER(name, domain) .name = columns->name[l],
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
#define FUNCTION_MEMBERS(X) X(H3, NUMBER) X(H2, NUMBER) X(H1, NUMBER) X(start, NUMBER) /* the others are 0 */
#define JET_MEMBERS(X) X(value, NUMBER) X(rate, NUMBER) X(curvature, NUMBER) X(third, NUMBER)
#define PAIR_MEMBERS(X) X(Rd, NUMBER) X(R, NUMBER) X(R1, NUMBER) X(R2, NUMBER) X(R3, NUMBER)
#define DECAY_MEMBERS(X) X(e, NUMBER) X(e1, NUMBER) X(e2, NUMBER) X(e3, NUMBER)
#define PAIR_TERM_MEMBERS(X) X(before, NUMBER) X(term, NUMBER) X(R2, NUMBER) X(R3, NUMBER)
#define BASIS_TERM_MEMBERS(X)                                                                                          \
    X(earlier, NUMBER) X(before, NUMBER) X(term, NUMBER) X(W2, NUMBER) X(W3, NUMBER) X(W4, NUMBER)

RECORD_IN_COLUMNS(state, hopform_state_real, HOPFORM_STATE_MEMBERS)
RECORD_IN_COLUMNS(motion, hopform_motion_real, HOPFORM_MOTION_MEMBERS)
RECORD_IN_COLUMNS(basis, hopform_basis_real, HOPFORM_BASIS_MEMBERS)
RECORD_IN_COLUMNS(function, event_function_real, FUNCTION_MEMBERS)
RECORD_IN_COLUMNS(jet, jet_real, JET_MEMBERS)
RECORD_IN_COLUMNS(pair, hopform_pair_real, PAIR_MEMBERS)
RECORD_IN_COLUMNS(decay, hopform_decay_real, DECAY_MEMBERS)
RECORD_IN_COLUMNS(pair_terms, hopform_pair_terms_real, PAIR_TERM_MEMBERS)
RECORD_IN_COLUMNS(basis_terms, hopform_basis_terms_real, BASIS_TERM_MEMBERS)

/* A stance under way. */
typedef struct {
    stance_chain_real chain;
    hopform_step_real step;
    hopform_state_real start;
    hopform_motion_real motion; /* of its phase */
    stance_search_real search;
    real limit;
    int64_t index;
    hopform_phase_real phases[PHASES_OF_LANE];
} lane;

typedef struct {
    hopform_plan_real plan;
    lane *stance;     /* in each lane */
    bool live[LANES]; /* whether there is a stance */
    int mode[LANES];  /* 3 (side_1 + 1) + side_2 + 1 */

    /* Of the round: the stances that have their turn, and those of them that are searched by themselves. */
    column turn, left;
    int side_1, side_2;
    hopform_poles_real poles;
    hopform_node_real node;
    real chi, omega;
    column gap; /* x1 counted from the stop ahead */
    state_columns state;
    motion_columns motion;
    column limit; /* the end of the phase: since it began, as all its times */
    function_columns function[SLOTS];
    column has[SLOTS], on[SLOTS];
    bool used[SLOTS];        /* whether one of the lanes has such a function */
    jet_columns from[SLOTS]; /* at the ends of the phase's one interval */
    jet_columns to[SLOTS];
    column end_t, found; /* -1: none */
    basis_columns end;
    column stops; /* whether it ends at a stop */

    int32_t busy;        /* lanes with a stance */
    int64_t evaluations; /* of W for all lanes */
    int64_t solved;
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

/* Phases of this round that are searched by themselves. */
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

/* Put the phase that a stance has come to into its lane. */
static void put_phase(lanes *w, int l)
{
    lane *one = &w->stance[l];
    const stance_chain_real *chain = &one->chain;
    const hopform_state_real from_stop = from_stop_real(chain);
    one->motion = motion_from_real(chain);
    put_motion(&w->motion, l, &one->motion);
    put_state(&w->state, l, &chain->state);
    w->mode[l] = 3 * (chain->side_1 + 1) + chain->side_2 + 1;
    w->gap[l] = from_stop.x1;
    put_events_real(&one->search.events, chain, &one->motion);
    const real until = end_of_step_real(chain) - chain->t;
    one->limit = one->search.events.rest_time < until ? one->search.events.rest_time : until;
    w->limit[l] = one->limit;
    for (int s = 0; s < SLOTS; s++) {
        const bool has = s < one->search.events.set.count;
        w->has[s][l] = flag(has);
        if (has) {
            put_function(&w->function[s], l, &one->search.events.set.function[s]);
        }
    }
}

/* The mode of most stances has its turn; false if its pair does not ring, and its phases are left. */
static bool choose_mode(lanes *w)
{
    int32_t stances[MODES] = {0};
    int most = 0;
    for (int l = 0; l < LANES; l++) {
        stances[w->mode[l]] += w->live[l] ? 1 : 0;
    }
    for (int mode = 1; mode < MODES; mode++) {
        most = stances[mode] > stances[most] ? mode : most;
    }
    for (int l = 0; l < LANES; l++) {
        w->turn[l] = flag(w->live[l] && w->mode[l] == most);
        w->left[l] = 0.0;
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

LANES_CODE static void start_phases(lanes *w)
{
    column over;
    for (int l = 0; l < LANES; l++) {
        over[l] = flag(!(w->limit[l] > 0.0));
    }
    leave(w, over);
    for (int s = 0; s < SLOTS; s++) {
        for (int l = 0; l < LANES; l++) {
            w->on[s][l] = w->turn[l] * w->has[s][l];
        }
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
            const event_function_real g = one_function(&w->function[s], l);
            keep_function(&find->function, l, here, &g);
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
        const bool is_found = is(w->found[l], s) > 0.0;
        const bool above = is_above_zero_real(&to, rounding);
        leaves[l] = w->on[s][l] * flag((at.t > fades) | ties | !(above | is_found));
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

/* ---- stops ---- */

/* Intervals end where x_1 meets its stop, as meets_stop_real finds it; lanes in which something else may happen at the
 * same time are left. */
LANES_CODE static void meet_stops(lanes *restrict w, search *restrict find)
{
    column tied;
    real *stops = w->stops;
    const real side = (real)w->side_1;
    const hopform_poles_real poles = w->poles;
    for (int l = 0; l < LANES; l++) {
        const hopform_state_real from_stop = {w->gap[l], w->state.v1[l], w->state.v2[l], w->state.y[l]};
        const hopform_motion_real motion = one_motion(&w->motion, l);
        const hopform_basis_real basis = one_basis(&w->end, l);
        const bool past = is_beyond_stop_real(&motion, &from_stop, side, &basis);
        stops[l] = w->turn[l] * fabs_real(side) * flag(hopform_is_finite_real(w->gap[l]) & past);
        find->low[l] = 0.0;
        find->high[l] = w->end_t[l];
        find->t[l] = w->end_t[l];
        find->going[l] = stops[l];
    }
    if (!any(stops)) {
        return;
    }
    memcpy(&find->basis, &w->end, sizeof find->basis);
    for (int n = 0; n < ROOT_STEPS && any(find->going); n++) {
        if (n > 0) {
            bases_at(w, find->t, find->going, &find->basis);
        }
        for (int l = 0; l < LANES; l++) {
            const hopform_state_real from_stop = {w->gap[l], w->state.v1[l], w->state.v2[l], w->state.y[l]};
            const hopform_motion_real motion = one_motion(&w->motion, l);
            const hopform_basis_real basis = one_basis(&find->basis, l);
            const approach_real to = approach_of_real(&poles, &motion, &from_stop, side, &basis);
            const root_step_real step = step_to_stop_real(&poles, &to, find->t[l], find->low[l], find->high[l]);
            const real next = step.inside ? step.next : step.low + 0.5 * (step.high - step.low);
            const real going =
                find->going[l] * (1.0 - flag(step.arrives)) * flag((next > step.low) & (next < step.high));
            find->low[l] = step.low;
            find->high[l] = step.high;
            find->next[l] = next;
            find->lands[l] = going * flag(step.lands);
            find->going[l] = going;
        }
        if (any(find->lands)) {
            for (int l = 0; l < LANES; l++) {
                const hopform_basis_real basis = one_basis(&find->basis, l);
                const hopform_basis_real there = carried_basis_real(&poles, &basis, find->next[l] - find->t[l]);
                keep_basis(&find->basis, l, find->lands[l] > 0.0, &there);
            }
        }
        for (int l = 0; l < LANES; l++) {
            keep(&find->t[l], find->going[l] > 0.0, find->next[l]);
            find->going[l] -= find->lands[l];
        }
    }
    leave(w, find->going);
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_real basis = one_basis(&find->basis, l);
        const bool here = stops[l] > 0.0;
        const bool other = (is(w->found[l], 0) > 0.0) | !(w->end_t[l] < w->limit[l]);
        tied[l] = stops[l] * flag(other & (w->end_t[l] <= find->t[l] * (1.0 + 8.0 * HOPFORM_EPS_real)));
        keep_basis(&w->end, l, here, &basis);
        keep(&w->end_t[l], here, find->t[l]);
    }
    leave(w, tied);
}

/* The end of a phase that the lanes have found, or that is searched by itself. */
static stance_phase_end_real end_of_phase(const lanes *w, int l)
{
    lane *one = &w->stance[l];
    const stance_chain_real *chain = &one->chain;
    const stance_events_real *events = &one->search.events;
    interval_real *in = &one->search.in;
    in->high = end_of_lane(w, l);
    in->found = (int32_t)w->found[l];
    for (int s = 0; s < events->set.count; s++) {
        in->to[s] = one_jet(&w->to[s], l);
    }
    cross_at_the_limit_real(events, one->limit, in);
    const bool stops = w->stops[l] > 0.0;
    bool alone = w->left[l] > 0.0 || (in->found < 0 && !stops && in->high.t < one->limit);
    if (!alone && !stops && is_takeoff_real(&events->set, in->found)) {
        const event_function_real *leg = &events->set.function[in->found];
        alone = fabs_real(later_takeoff_real(chain, &w->poles, leg, &in->high.basis, in->high.t)) > 0.0;
    }
    if (alone) {
        return stance_find_end_real(chain, &one->motion, &one->search);
    }
    stance_phase_end_real end = end_of_real(events, in, stops, one->limit);
    end.touch = touch_of_stop_real(chain, &one->motion, &end);
    return end;
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

/* Solve a stance by itself. */
static void solve_alone(queue *from, const hopform_plan_real *plan, int64_t i)
{
    const int32_t kept = hopform_solve_column_real(plan, HOPFORM_OK, from->in, from->out, i);
    from->kept = kept > from->kept ? kept : from->kept;
}

/* A stance goes on to its next phase, or leaves its lane. */
static void go_on(lanes *w, int l, int32_t ending, queue *to)
{
    const lane *one = &w->stance[l];
    w->live[l] = ending == 0;
    if (w->live[l]) {
        put_phase(w, l);
        return;
    }
    w->solved++;
    hopform_stance_real stance;
    const int32_t status = stance_report_real(&one->chain, &one->start, ending, &stance);
    if (status == HOPFORM_PHASES_NOT_KEPT && one->chain.capacity < hopform_phases_wanted_real(to->out)) {
        solve_alone(to, &w->plan, one->index);
        return;
    }
    const int32_t kept = hopform_put_solved_real(to->out, one->index, &w->plan.robot, status, &stance, one->phases);
    to->kept = kept > to->kept ? kept : to->kept;
}

/* Put the next stance into a lane; one that is refused is solved by itself, which says why. */
static void take(lanes *w, int l, queue *from)
{
    lane *one = &w->stance[l];
    const int64_t i = from->next++;
    const hopform_stances_in_real *in = from->in;
    const real horizon = hopform_number_real(&in->horizon, i);
    const int32_t wanted = hopform_phases_wanted_real(from->out);
    one->index = i;
    one->start = hopform_start_of_real(in, i);
    one->step.t = 0.0;
    one->step.u = hopform_number_real(&in->u, i);
    if (stance_status_real(&w->plan.robot, &one->start, horizon, in->max_phases) < 0
        || !hopform_is_finite_real(one->step.u)) {
        solve_alone(from, &w->plan, i);
        return;
    }
    one->chain = stance_chain_from_real(&w->plan, &one->start, &one->step, 1, horizon, in->max_phases, one->phases,
                                        wanted < PHASES_OF_LANE ? wanted : PHASES_OF_LANE);
    go_on(w, l, stance_begin_real(&one->chain), from);
}

/* Fill idle lanes. */
static void refill(lanes *w, queue *from)
{
    w->busy = 0;
    for (int l = 0; l < LANES; l++) {
        while (!w->live[l] && from->next < from->pause) {
            take(w, l, from);
        }
        w->busy += w->live[l] ? 1 : 0;
    }
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

/* One phase of the stances whose turn it is. */
static void advance(lanes *w, search *find, queue *to)
{
    if (choose_mode(w)) {
        start_phases(w);
        find_first_events(w, find);
        meet_stops(w, find);
    }
    for (int l = 0; l < LANES; l++) {
        if (w->turn[l] + w->left[l] > 0.0) {
            const stance_phase_end_real end = end_of_phase(w, l);
            const int32_t ending = stance_end_phase_real(&w->stance[l].chain, &w->stance[l].motion, &end);
            go_on(w, l, ending, to);
            w->busy -= ending != 0 ? 1 : 0;
        }
    }
}

int32_t LANES_NAME(const hopform_plan_real *plan, int64_t first, int64_t end, const hopform_stances_in_real *in,
                   const hopform_stances_out_real *out)
{
    lanes w;
    lane in_lanes[LANES];
    search find;
    queue stances = {in, out, first, first, end, HOPFORM_OK};
    memset(&w, 0, sizeof w);
    memset(&find, 0, sizeof find);
    w.plan = *plan;
    w.stance = in_lanes;
    for (;;) {
        if (stances.next < stances.pause && w.busy <= MOST_BUSY) {
            refill(&w, &stances);
        }
        if (w.busy > 0) {
            advance(&w, &find, &stances);
        } else if (stances.next < end) {
            look_back(&w, &stances);
        } else {
            return stances.kept;
        }
    }
}

#endif
