/* SPDX-License-Identifier: MIT-0
 *
 * Many stances of one robot at a time. Each is a chain, as one that is solved by itself, and its phases are searched as
 * that one's are, from their first interval on. What the lanes do for many phases at a time, one in each lane of vector
 * registers, is to evaluate the propagator at the end of that interval and to locate the first root in it: every loop
 * over the lanes is one that compilers turn into vector instructions. It is done by the functions of one stance, so the
 * bits are the same. A round takes one phase of the stances that are in the same mode; the others wait. Where a root is
 * not found soon, the search of one stance looks for it. Flags are 1 or 0 and of the type of all numbers.
 *
 * Before it is included, LANES_NAME is the function to make, and LANES_CODE what goes before each function. Where the
 * lanes take more than one evaluation of all of them a stance, stances are solved one by one for a while.
 */
#ifndef HOPFORM_LANES_H_real
#define HOPFORM_LANES_H_real

#include <stdbool.h>
#include <string.h>

#include "chain_real.h"
#include "columns_real.h"

#if defined(__GNUC__) && !defined(__clang__)
/* Each of these puts jumps into loops that had none. */
#pragma GCC optimize("no-thread-jumps", "no-tree-pre", "no-tree-sink", "no-tree-loop-im")
#endif

enum {
    LANES = HOPFORM_LANE_COUNT_real,
    SLOTS = MOST_EVENT_FUNCTIONS_real,
    MODES = 9,
    ROOT_STEPS = 6,
    PHASES_OF_LANE = 16, /* a stance whose list is wanted and takes more is solved by itself */
    RUN = 2 * LANES,     /* so many stances tell whether lanes are worth it */
    RUN_ALONE = 4096     /* and so many are solved one by one where they are not */
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

/* A number is put only where a flag says so. */
static inline void keep(real *place, bool yes, real value)
{
    const real before = *place;
    const real after = yes ? value : before;
    *place = after;
}

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

/* ---- records, a column for each member ---- */
#define COLUMN(name, domain) column name;
#define TAKE_MEMBER(name, domain) .name = columns->name[l],
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
    static inline void keep_##record(record##_columns *columns, int l, bool yes, const type *one)                      \
    {                                                                                                                  \
        MEMBERS(KEEP_MEMBER)                                                                                           \
    }
#define FUNCTION_MEMBERS(X) /* the others are 0 */                                                                     \
    X(H3, NUMBER) X(H2, NUMBER) X(H1, NUMBER) X(H0, NUMBER) X(start, NUMBER)
#define TERM_MEMBERS(X) X(earlier, NUMBER) X(before, NUMBER) X(term, NUMBER) X(W2, NUMBER) X(W3, NUMBER) X(W4, NUMBER)

RECORD_IN_COLUMNS(basis, hopform_basis_real, HOPFORM_BASIS_MEMBERS)
RECORD_IN_COLUMNS(function, event_function_real, FUNCTION_MEMBERS)
RECORD_IN_COLUMNS(terms, hopform_basis_terms_real, TERM_MEMBERS)

/* A stance under way. */
typedef struct {
    stance_chain_real chain;
    hopform_step_real step;
    hopform_state_real start;
    stance_search_real search;
    int64_t index;
    hopform_phase_real phases[PHASES_OF_LANE];
} lane;

typedef struct {
    /* The batch: where it is, and whose turn it is. */
    hopform_plan_real plan;
    const hopform_stances_in_real *in;
    const hopform_stances_out_real *out;
    int64_t next;
    int64_t last;
    int32_t kept;
    int32_t busy;        /* lanes with a stance */
    int64_t alone;       /* stances that are still solved one by one */
    int64_t evaluations; /* of W for all lanes, in this run */
    int64_t solved;

    lane stance[LANES];                                    /* in each lane */
    bool live[LANES];                                      /* whether there is one */
    int mode[LANES];                                       /* 3 (side_1 + 1) + side_2 + 1 */
    column limit;                                          /* the end of the phase */
    function_columns function[SLOTS];                      /* constants for those that it does not have */
    column turns[SLOTS], monotone[SLOTS], distance[SLOTS]; /* their shapes */
    column passed[SLOTS];                                  /* have no root before the end, being monotone */

    /* The round: the phases that have their turn, and the ends of their first intervals. */
    column turn, sure; /* what is certified */
    int side_1, side_2;
    int32_t slots; /* functions of each, at most */
    hopform_poles_real poles;
    hopform_node_real node;
    real chi, omega;
    column end_t, found; /* -1: none */
    basis_columns end;

    /* The root that is looked for: of which function, near which share of the interval, and the bracket. */
    function_columns falling;
    column number, share, low, high, t, going;
    basis_columns basis; /* at t */
} lanes;

/* ---- the propagator ---- */

/* W of three poles over a short time. Lanes whose series has ended wait for the others. */
LANES_CODE static void short_bases(const hopform_poles_real poles, const real *restrict t, const real *restrict wanted,
                                   basis_columns *restrict basis)
{
    column going;
    terms_columns terms;
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_terms_real first = hopform_first_basis_terms_real();
        keep_terms(&terms, l, true, &first);
        going[l] = wanted[l];
    }
    for (int n = 1; n < HOPFORM_TERMS_real - 2 && any(going); n += 3) {
        for (int l = 0; l < LANES; l++) {
            hopform_basis_terms_real one = one_terms(&terms, l);
            hopform_add_basis_terms_real(&one, -(poles.s_1 * t[l]), -(poles.s_2 * t[l] * t[l]),
                                         -(poles.s_3 * t[l] * t[l] * t[l]), n);
            keep_terms(&terms, l, going[l] > 0.0, &one);
            going[l] *= flag(!hopform_basis_terms_end_real(&one));
        }
    }
    for (int l = 0; l < LANES; l++) {
        const hopform_basis_terms_real one = one_terms(&terms, l);
        const hopform_basis_real there = hopform_basis_of_terms_real(&poles, t[l], &one);
        keep_basis(basis, l, wanted[l] > 0.0, &there);
    }
}

/* W of a pair that rings, or from it that of the pair and a real pole. */
LANES_CODE static void ringing_bases(const hopform_poles_real poles, real omega, real chi, const real *restrict t,
                                     const real *restrict wanted, basis_columns *restrict basis)
{
    for (int l = 0; l < LANES; l++) {
        const hopform_pair_core_real core = hopform_ringing_core_real(&poles, omega, t[l]);
        const hopform_pair_real pair = hopform_pair_of_core_real(&poles, t[l], &core);
        const hopform_basis_real held = {pair.Rd, pair.R, pair.R1, pair.R2, pair.R3};
        keep_basis(basis, l, wanted[l] > 0.0, &held);
    }
    for (int l = 0; l < LANES && fabs_real(poles.a) > 0.0; l++) {
        const hopform_basis_real held = one_basis(basis, l);
        const hopform_pair_real pair = {held.Wdd, held.Wd, held.W, held.W1, held.W2};
        const real z = poles.a * t[l];
        real tail = 0.0;
#define ADD_TERM(coefficient) tail = tail * z + (coefficient);
        HOPFORM_DECAY_TAIL_real(ADD_TERM)
#undef ADD_TERM
            const hopform_decay_real decay = hopform_decay_of_tail_real(poles.a, t[l], tail);
        const hopform_basis_real split = hopform_basis_of_split_real(&poles, chi, t[l], &decay, &pair);
        keep_basis(basis, l, wanted[l] > 0.0, &split);
    }
}

/* W at t where `wanted`, as hopform_basis_at_real, which itself gives it where neither is the time brief for all poles
 * nor does the pair ring by then. */
LANES_CODE static void bases_at(lanes *restrict w, const real *restrict t, const real *restrict wanted,
                                basis_columns *restrict basis)
{
    column brief, rings, rest;
    const hopform_poles_real poles = w->poles;
    const real chi = w->chi;
    const bool held = !(fabs_real(poles.a) > 0.0);
    w->evaluations++;
    for (int l = 0; l < LANES; l++) {
        const bool late = held | (chi * t[l] * t[l] >= 1.0);
        const bool splits = held | (fabs_real(poles.a * t[l]) < 1.0);
        brief[l] = wanted[l] * flag((!late) & (poles.s_1 * t[l] < 4.0));
        rings[l] = wanted[l] * flag(late & splits & !(poles.q * t[l] * t[l] < 1.0));
        rest[l] = wanted[l] - brief[l] - rings[l];
    }
    if (any(brief)) {
        short_bases(poles, t, brief, basis);
    }
    if (any(rings)) {
        ringing_bases(poles, w->omega, chi, t, rings, basis);
    }
    for (int l = 0; l < LANES && any(rest); l++) {
        if (rest[l] > 0.0) {
            const hopform_basis_real one = hopform_basis_at_real(&w->poles, t[l]);
            keep_basis(basis, l, true, &one);
        }
    }
}

/* ---- the first interval of a phase ---- */

/* Put the phase that a stance has come to into its lane. */
static void put_phase(lanes *w, int l)
{
    lane *one = &w->stance[l];
    stance_chain_real *chain = &one->chain;
    const event_set_real *set = &one->search.events.set;
    stance_begin_phase_real(chain);
    stance_begin_search_real(chain, &one->search);
    w->mode[l] = 3 * (chain->side[0] + 1) + chain->side[1] + 1;
    w->limit[l] = one->search.limit;
    for (int s = 0; s < SLOTS; s++) {
        const event_function_real none = {0.0, 0.0, 0.0, 0.0, 1.0, 0, 0, MONOTONE_real};
        const event_function_real *g = s < set->count ? &set->function[s] : &none;
        keep_function(&w->function[s], l, true, g);
        w->turns[s][l] = flag(g->shape == MAY_TURN_real);
        w->monotone[s][l] = flag(g->shape == MONOTONE_real);
        w->distance[s][l] = flag(g->shape == DISTANCE_real);
        w->passed[s][l] = 0.0;
    }
}

/* The mode of most stances has its turn; false if its pair does not ring. */
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
    w->slots = 0;
    for (int l = 0; l < LANES; l++) {
        const int32_t count = w->stance[l].search.events.set.count;
        w->turn[l] = flag(w->live[l] && w->mode[l] == most);
        w->slots = w->turn[l] > 0.0 && count > w->slots ? count : w->slots;
    }
    w->side_1 = most / 3 - 1;
    w->side_2 = most % 3 - 1;
    w->poles = *hopform_poles_of_real(&w->plan, w->side_1, w->side_2);
    w->node = *hopform_node_of_real(&w->plan, w->side_1, w->side_2);
    w->chi = hopform_residue_real(&w->poles);
    const real mean = 0.5 * w->poles.p;
    const real square = w->poles.q - mean * mean;
    w->omega = sqrt_real(square > 0.0 ? square : 0.0);
    return square > 0.0;
}

/* The interval ends at the node of the plan, or at the limit. */
static void reach_ahead(lanes *w)
{
    const hopform_basis_real basis = {w->node.Wdd, w->node.Wd, w->node.W, w->node.W1, w->node.W2};
    for (int l = 0; l < LANES; l++) {
        const bool node = w->node.t < w->limit[l];
        w->end_t[l] = node ? w->node.t : w->limit[l];
        w->found[l] = -1.0;
        w->sure[l] = w->turn[l];
        keep_basis(&w->end, l, true, &basis);
        w->going[l] = w->turn[l] * flag((w->limit[l] > 0.0) & !node);
    }
    if (any(w->going)) {
        bases_at(w, w->end_t, w->going, &w->end);
    }
}

/* A function at both ends of the interval. */
typedef struct {
    event_function_real g;
    propagator_real high;
    jet_real from, to;
} ends_of_lane;

static inline ends_of_lane ends_of_function(const lanes *w, const hopform_poles_real *poles,
                                            const function_columns *function, int l)
{
    const hopform_basis_real basis = one_basis(&w->end, l);
    ends_of_lane ends;
    ends.g = one_function(function, l);
    ends.high = propagator_of_real(poles, w->end_t[l], &basis);
    ends.from = jet_at_start_real(poles, &ends.g);
    ends.from.value = ends.from.value < 0.0 ? 0.0 : ends.from.value;
    ends.to = short_jet_at_real(&ends.g, &ends.high);
    return ends;
}

static inline ends_of_lane look_there(const lanes *w, const hopform_poles_real *poles, int s, int l)
{
    return ends_of_function(w, poles, &w->function[s], l);
}

static inline bool is_found(const lanes *w, int s, int l)
{
    return fabs_real(w->found[l] - (real)s) < 0.5;
}

/* Where function s, if it has crossed zero by the end of the interval, did so, and whether it is the first: rough
 * guesses. One that is monotone and has not crossed zero by then has not before. */
LANES_CODE static void guess_crossings(lanes *restrict w, int s)
{
    const hopform_poles_real poles = w->poles;
    for (int l = 0; l < LANES; l++) {
        const ends_of_lane ends = look_there(w, &poles, s, l);
        const real rounding = rounding_of_real(&ends.g, &ends.high, ends.to.rate);
        const bool is_last = (w->found[l] < 0.0) & !(w->distance[s][l] > 0.0);
        const bool asked = (w->turn[l] > 0.0) & !(w->passed[s][l] > 0.0) & !is_found(w, s, l);
        const real share = rough_root_real(&ends.from, &ends.to, w->end_t[l]);
        const bool first = asked & has_crossed_real(&ends.to, w->end_t[l], rounding, is_last) & (share < w->share[l]);
        keep(&w->passed[s][l], asked & (w->monotone[s][l] > 0.0) & !(ends.to.value < 0.0), 1.0);
        keep(&w->going[l], first, 1.0);
        keep(&w->number[l], first, (real)s);
        keep(&w->share[l], first, share);
        keep_function(&w->falling, l, first, &ends.g);
    }
}

/* Refine the guesses of those that are first. */
LANES_CODE static void refine_guesses(lanes *restrict w)
{
    column going;
    const hopform_poles_real poles = w->poles;
    for (int l = 0; l < LANES; l++) {
        going[l] = w->going[l];
    }
    for (int n = 0; n < PREDICTION_STEPS_real && any(going); n++) {
        for (int l = 0; l < LANES; l++) {
            const ends_of_lane ends = ends_of_function(w, &poles, &w->falling, l);
            const interpolant_real p = interpolant_of_real(&ends.from, &ends.to, w->end_t[l]);
            const real step = prediction_step_real(&p, w->share[l]);
            const real next = w->share[l] - step;
            keep(&w->share[l], (going[l] > 0.0) & (next > 0.0) & (next < 1.0), next);
            going[l] *= flag(!(fabs_real(step) < HOPFORM_PREDICTION_real * w->share[l]));
        }
    }
    for (int l = 0; l < LANES; l++) {
        keep(&w->t[l], w->going[l] > 0.0, w->end_t[l] * w->share[l]);
    }
}

/* Steps from guesses to the roots of functions before the ends of the intervals, as located_root_real takes them, until
 * no lane goes on. */
LANES_CODE static void go_to_roots(lanes *restrict w)
{
    const hopform_poles_real poles = w->poles;
    for (int l = 0; l < LANES; l++) {
        const bool inside = (w->t[l] > 0.0) & (w->t[l] < w->end_t[l]);
        w->low[l] = 0.0;
        w->high[l] = w->end_t[l];
        w->t[l] = inside ? w->t[l] : 0.5 * w->end_t[l];
    }
    for (int n = 0; n < ROOT_STEPS && any(w->going); n++) {
        bases_at(w, w->t, w->going, &w->basis);
        for (int l = 0; l < LANES; l++) {
            const hopform_basis_real basis = one_basis(&w->basis, l);
            const event_function_real g = one_function(&w->falling, l);
            const propagator_real at = propagator_of_real(&poles, w->t[l], &basis);
            const jet_real jet = jet_at_real(&poles, &g, &at);
            const root_step_real step =
                step_between_real(&poles, &jet, fourth_of_real(&poles, &g, &jet), w->t[l], w->low[l], w->high[l]);
            const bool arrives = fabs_real(jet.value) <= HOPFORM_EPS_real * w->t[l] * fabs_real(jet.rate);
            const bool inside = (step.next > step.low) & (step.next < step.high);
            const real next = inside ? step.next : step.low + 0.5 * (step.high - step.low);
            const hopform_basis_real carried = carried_basis_real(&poles, &basis, next - w->t[l]);
            const bool goes = w->going[l] > 0.0;
            keep_basis(&w->basis, l, goes & step.lands & !arrives, &carried);
            keep(&w->t[l], goes & !arrives, next);
            keep(&w->going[l], arrives | step.lands, 0.0);
            w->low[l] = step.low;
            w->high[l] = step.high;
        }
    }
}

/* The intervals end at the first roots, where those are found soon. */
LANES_CODE static void find_roots(lanes *restrict w)
{
    go_to_roots(w);
    for (int l = 0; l < LANES; l++) {
        const bool found = (w->number[l] >= 0.0) & !(w->going[l] > 0.0);
        const hopform_basis_real basis = one_basis(&w->basis, l);
        keep_basis(&w->end, l, found, &basis);
        keep(&w->end_t[l], found, w->t[l]);
        keep(&w->found[l], found, w->number[l]);
    }
}

/* Where a root is found, another function may have crossed zero before. */
static void end_at_first_crossings(lanes *w)
{
    for (int n = 0; n < SLOTS; n++) {
        for (int l = 0; l < LANES; l++) {
            w->going[l] = 0.0;
            w->number[l] = -1.0;
            w->share[l] = 2.0;
        }
        for (int s = 0; s < w->slots; s++) {
            guess_crossings(w, s);
        }
        if (!any(w->going)) {
            return;
        }
        refine_guesses(w);
        find_roots(w);
    }
}

/* What has a certificate by the rules that take no further evaluation is sure. */
LANES_CODE static void certify(lanes *restrict w, int s)
{
    column open;
    const hopform_poles_real poles = w->poles;
    const real pole = w->node.pole;
    const real fades = w->node.fades;
    for (int l = 0; l < LANES; l++) {
        const ends_of_lane ends = look_there(w, &poles, s, l);
        const real h = w->end_t[l];
        const bool is_last = (w->found[l] < 0.0) & !(w->distance[s][l] > 0.0);
        const bool crossed = has_crossed_real(&ends.to, h, rounding_of_real(&ends.g, &ends.high, ends.to.rate), is_last)
                             & !(w->passed[s][l] > 0.0);
        const real d = ends.from.curvature + pole * ends.from.rate;
        const real d_then = ends.to.curvature + pole * ends.to.rate;
        const bool leaves = ((h > fades) & (w->turns[s][l] > 0.0)) | (crossed & !is_found(w, s, l));
        open[l] = w->sure[l] * w->turns[s][l] * flag((!leaves) & !has_no_root_real(&ends.from, d, &ends.to, d_then));
        w->sure[l] *= flag(!leaves);
    }
    if (!any(open)) {
        return;
    }
    for (int l = 0; l < LANES; l++) {
        const ends_of_lane ends = look_there(w, &poles, s, l);
        const real h = w->end_t[l];
        const real rounding = rounding_of_real(&ends.g, &ends.high, ends.to.rate);
        const bool quiet = quiet_time_of_ringing_real(&poles, &ends.from, rounding) > h;
        const bool none = has_no_root_by_pair_real(&poles, &ends.g, &ends.high, &ends.from, &ends.to);
        const bool held =
            is_held_up_by_bernstein_real(&poles, &ends.g, &ends.from, &ends.to, h, is_found(w, s, l), rounding);
        w->sure[l] -= open[l] * flag(!(quiet | none | held));
    }
}

/* The end of a phase whose first interval the lanes have ended: if nothing else can be first, that is it. */
static void end_phase(lanes *w, int l)
{
    lane *one = &w->stance[l];
    stance_search_real *search = &one->search;
    const event_set_real *set = &search->events.set;
    interval_real *in = &search->in;
    bool ends = false;
    if (search->open) {
        const hopform_basis_real basis = one_basis(&w->end, l);
        in->high = propagator_of_real(&w->poles, w->end_t[l], &basis);
        in->found = (int32_t)w->found[l];
    }
    if (search->open && w->sure[l] > 0.0) {
        if (in->found > 0) {
            settle_ties_real(set, in);
        }
        if (!(in->high.t < search->limit)) {
            cross_at_the_limit_real(&search->events, search->limit, in);
        }
        ends = in->found >= 0 || !(in->high.t < search->limit);
        if (is_takeoff_real(set, in->found)) {
            const event_function_real *leg = &set->function[in->found];
            ends = !(fabs_real(later_takeoff_real(&one->chain, set->poles, leg, &in->high.basis, in->high.t)) > 0.0);
        }
    }
    if (ends) {
        stance_conclude_real(search);
    } else {
        stance_end_search_real(&one->chain, search);
    }
}

/* ---- stances in and out ---- */

/* Solve a stance by itself. */
static void solve_alone(lanes *w, int64_t i)
{
    const int32_t kept = hopform_one_by_one_real(&w->plan, i, i + 1, w->in, w->out);
    w->kept = kept > w->kept ? kept : w->kept;
}

/* A stance goes on to its next phase, or leaves its lane. */
static void go_on(lanes *w, int l, int32_t ending)
{
    const lane *one = &w->stance[l];
    w->live[l] = ending == 0;
    if (w->live[l]) {
        put_phase(w, l);
        return;
    }
    w->solved++;
    w->busy--;
    hopform_stance_real stance;
    const int32_t status = stance_report_real(&one->chain, &one->start, ending, &stance);
    if (status == HOPFORM_PHASES_NOT_KEPT && one->chain.capacity < hopform_phases_wanted_real(w->out)) {
        solve_alone(w, one->index);
        return;
    }
    const int32_t kept = hopform_put_stance_real(w->out, one->index, &w->plan.robot, status, &stance, one->phases);
    w->kept = kept > w->kept ? kept : w->kept;
}

/* Put the next stance into a lane; one that is refused is solved by itself, which says why. */
static void take(lanes *w, int l)
{
    lane *one = &w->stance[l];
    const int64_t i = w->next++;
    const real horizon = hopform_number_real(&w->in->horizon, i);
    const int32_t wanted = hopform_phases_wanted_real(w->out);
    one->index = i;
    one->start = hopform_start_of_real(w->in, i);
    one->step.t = 0.0;
    one->step.u = hopform_number_real(&w->in->u, i);
    if (w->alone > 0 || stance_status_real(&w->plan.robot, &one->start, horizon, w->in->max_phases) < 0
        || !hopform_is_finite_real(one->step.u)) {
        w->alone -= w->alone > 0 ? 1 : 0;
        solve_alone(w, i);
        return;
    }
    stance_start_real(&one->chain, &w->plan, &one->start, &one->step, 1, horizon, w->in->max_phases, one->phases,
                      wanted < PHASES_OF_LANE ? wanted : PHASES_OF_LANE);
    w->busy++;
    go_on(w, l, stance_begin_real(&one->chain));
}

/* Fill idle lanes; if the last run of stances has not been worth it, a long one is solved one by one. */
static void refill(lanes *w)
{
    if (w->solved >= RUN) {
        w->alone = w->evaluations > w->solved ? RUN_ALONE : 0;
        w->evaluations = 0;
        w->solved = 0;
    }
    for (int l = 0; l < LANES; l++) {
        while (!w->live[l] && w->next < w->last) {
            take(w, l);
        }
    }
}

/* One phase of the stances whose turn it is. */
static void advance(lanes *w)
{
    const bool rings = choose_mode(w);
    if (rings) {
        reach_ahead(w);
        end_at_first_crossings(w);
        for (int s = 0; s < w->slots; s++) {
            certify(w, s);
        }
    }
    for (int l = 0; l < LANES; l++) {
        if (w->turn[l] > 0.0) {
            lane *one = &w->stance[l];
            if (rings) {
                end_phase(w, l);
            } else {
                stance_find_end_real(&one->chain, &one->search);
            }
            go_on(w, l, stance_end_phase_real(&one->chain, &one->search));
        }
    }
}

int32_t LANES_NAME(const hopform_plan_real *plan, int64_t first, int64_t end, const hopform_stances_in_real *in,
                   const hopform_stances_out_real *out)
{
    lanes w = {.plan = *plan, .in = in, .out = out, .next = first, .last = end, .kept = HOPFORM_OK};
    do {
        if (w.busy <= MOST_BUSY) {
            refill(&w);
        }
        if (w.busy > 0) {
            advance(&w);
        }
    } while (w.busy > 0 || w.next < end);
    return w.kept;
}

#endif
