/* SPDX-License-Identifier: MIT-0
 *
 * The first event of a phase in which both elements slip, in modal coordinates: from node to node, each an interval
 * shorter than half a period of the pair, in which the event functions are certified to have no root but the one that
 * is located.
 *
 * An event function g is the stretch, or a velocity times its side. d = g'' + a g' is a motion of the pair alone,
 * so on a node it is the motion of the pair through its values at both ends: where both have one sign, d has it in
 * between. e^(at) g' grows where d is positive and falls where it is negative. All rules follow from that.
 */
#ifndef HOPFORM_MODAL_SEARCH_H_real
#define HOPFORM_MODAL_SEARCH_H_real

#include "first_event_real.h"
#include "modal_motion_real.h"

#if HOPFORM_HAS_MODAL
#ifndef MODAL_COUNT
#define MODAL_COUNT(what) (void)0
#endif

/* The event functions in order of tie-break priority; each is the owner of its event. */
enum { MODAL_FUNCTIONS_real = 3 };

/* A time, and what is known there. */
typedef struct {
    real t;
    modal_real m;
    real value[MODAL_FUNCTIONS_real], rate[MODAL_FUNCTIONS_real], deflated[MODAL_FUNCTIONS_real];
    real rest[MODAL_FUNCTIONS_real]; /* of the value without what fades, once that is counted from where it ends */
} modal_node_real;

typedef struct {
    const hopform_modal_real *modal;
    real sign[MODAL_FUNCTIONS_real]; /* of each function */
    int first;                       /* 1 where the stretch only grows, else 0 */
    real limit;
    bool from_the_end;       /* a value is z where both elements end, what rings, and what has not yet faded */
    modal_node_real node[2]; /* the ends of the interval */
    modal_node_real *low, *high;
    modal_gain_real gained; /* in the interval */
    /* What values are counted from: a time, the coordinates and values there, what of those is rounded, and what has
     * been gained until the interval begins. */
    real from;
    modal_real m;
    real z[MODAL_FUNCTIONS_real], rounded[MODAL_FUNCTIONS_real];
    real amplitude;
    modal_gain_real total;
    real moved; /* of the position until then */
    int32_t count;
    evaluations_real *evaluations;
} modal_search_real;

/* ---- what is known at a time ---- */

/* A function from that at another time, after a gain since then. */
ALWAYS_real real value_after_real(const modal_search_real *search, int n, const modal_node_real *from,
                                  const modal_gain_real *gain) {
    return from->value[n] + search->sign[n] * gain_by_row_real(&search->modal->row[n], gain);
}

/* The same where it is counted from where it ends: beside a fast pole what has not yet faded is no difference. */
SELDOM_real real value_from_the_end_real(const modal_search_real *search, int n, const modal_node_real *from,
                                         const modal_gain_real *gain, real *rest) {
    const hopform_modal_row_real *row = &search->modal->row[n];
    *rest = from->rest[n] + search->sign[n] * (row->rate_cosine * gain->c + row->rate_sine * gain->s);
    return *rest - search->sign[n] * row->rate_fade * gain->left / search->modal->a;
}

/* Rate and deflated derivative of a function. */
ALWAYS_real void put_rates_real(const modal_search_real *search, int n, modal_node_real *to) {
    const hopform_modal_row_real *row = &search->modal->row[n];
    to->rate[n] = search->sign[n] * rate_by_row_real(row, &to->m);
    to->deflated[n] = search->sign[n] * deflated_by_row_real(row, &to->m);
}

SELDOM_real void put_functions_from_the_end_real(const modal_search_real *search, const modal_gain_real *gain) {
    for (int n = 0; n < MODAL_FUNCTIONS_real; n++) {
        search->high->value[n] = value_from_the_end_real(search, n, search->low, gain, &search->high->rest[n]);
        put_rates_real(search, n, search->high);
    }
}

/* The end of the interval, once the coordinates have gained that. Of the stretch the row is (rate_fade, 1, 0). */
ALWAYS_real void end_modal_interval_real(modal_search_real *search, real t, const modal_gain_real *gain) {
    const modal_node_real *low = search->low;
    modal_node_real *high = search->high;
    search->gained = *gain;
    high->t = t;
    high->m = modal_after_real(search->modal, &low->m, gain);
    if (search->from_the_end) {
        put_functions_from_the_end_real(search, gain);
        return;
    }
    if (search->first == 0) {
        const hopform_modal_row_real *row = &search->modal->row[0];
        high->value[0] = low->value[0] + (row->rate_fade * gain->f + gain->c);
        high->rate[0] = row->rate_fade * high->m.f + high->m.c;
        high->deflated[0] = deflated_by_row_real(row, &high->m);
    }
    high->value[1] = value_after_real(search, 1, low, gain);
    put_rates_real(search, 1, high);
    high->value[2] = value_after_real(search, 2, low, gain);
    put_rates_real(search, 2, high);
}

/* The bound of what rounding has done to a function, after a gain since the interval began. */
static inline real modal_rounding_real(const modal_search_real *search, int n, const modal_gain_real *gain, real t,
                                       real rate) {
    const hopform_modal_row_real *row = &search->modal->row[n];
    const real fades = search->from_the_end ? gain->left / search->modal->a : search->total.f + gain->f;
    const real fade = fabs_real(row->rate_fade * fades);
    const real reach = lesser_real(2.0 / search->modal->root_q, t - search->from); /* for so long at most */
    const real pair = row->amplitude * search->amplitude * reach;
    return 16.0 * HOPFORM_EPS_real * (search->rounded[n] + fade + pair + t * fabs_real(rate));
}

/* ---- the rules ---- */

/* Rule 2. Where it says yes g' changes its sign once at most in the interval, and from positive to negative: g is above
 * the lesser of its ends, and if it ends below zero it has one root. A rate that rounding has made 0 or given the other
 * sign lets g fall by no more than rounding. */
ALWAYS_real bool turns_down_only_real(real rate, real d, real rate_then, real d_then) {
    if (d >= 0.0) { return rate >= 0.0 || (d_then >= 0.0 && rate_then <= 0.0); }
    return rate_then <= 0.0 || d_then < 0.0;
}

/* Rule 2, whatever the sign of d: its amplitude does not grow, so g' falls by no more than that times the time, and g
 * by half of it times the square. Where d begins positive and g' does not end negative, e^(at) g' is never below what
 * it starts from. */
static inline bool falls_too_little_real(const modal_search_real *search, int n, real h, real amplitude) {
    const modal_node_real *from = search->low;
    const bool rises = (from->deflated[n] >= 0.0) & (search->high->rate[n] >= 0.0);
    const real d = rises ? 0.0 : search->modal->row[n].amplitude * search->modal->root_chi * amplitude;
    const real falls = 0.501 * h * d - lesser_real(from->rate[n], 0.0);
    return from->value[n] > h * falls;
}

/* Rule 1: see stays_positive_by_bernstein. The sixth derivative is the fifth of the rate. */
static inline bool has_modal_bernstein_real(const modal_search_real *search, int n, real h, real amplitude,
                                            real rounding) {
    const hopform_modal_real *modal = search->modal;
    const hopform_modal_row_real *row = &modal->row[n];
    const modal_node_real *from = search->low, *to = search->high;
    const real qq = modal->root_q * modal->root_q * modal->root_q * modal->root_q;
    const real aa = modal->a * modal->a;
    const real M6 =
        qq * modal->root_q * row->amplitude * amplitude + aa * aa * modal->a * fabs_real(row->rate_fade * from->m.f);
    const real f = 0.2 * h;
    const real tw = 0.05 * h * h;
    const real b1 = from->value[n] + f * from->rate[n];
    const real b2 = b1 + f * from->rate[n] + tw * (from->deflated[n] - modal->a * from->rate[n]);
    const real b4 = to->value[n] - f * to->rate[n];
    const real b3 = b4 - f * to->rate[n] + tw * (to->deflated[n] - modal->a * to->rate[n]);
    const real inside = lesser_real(lesser_real(b1, b2), lesser_real(b3, b4));
    const real at_start = lesser_real(inside, from->value[n]);
    const real low = lesser_real(from->value[n] > 0.0 ? at_start : inside, to->value[n]);
    const real hhh = h * h * h;
    return low > M6 * hhh * hhh / 43200.0 + rounding;
}

/* ---- inside an interval ---- */

/* Ends the interval so much later than it begins. */
static inline void cut_modal_interval_real(modal_search_real *search, real later) {
    const modal_gain_real gain = gain_over_a_node_real(search->modal, &search->low->m, later);
    use_evaluation_real(search->evaluations);
    MODAL_COUNT(evaluation);
    end_modal_interval_real(search, search->low->t + later, &gain);
}

/* Rule 4: of a function whose rate is negative at the start and not at the end, and has one root; the interval ends
 * there. */
SELDOM_real void cut_at_minimum_real(modal_search_real *search, int n) {
    const hopform_modal_row_real *row = &search->modal->row[n];
    real low = 0.0, high = search->high->t - search->low->t;
    real t = high * (search->low->rate[n] / (search->low->rate[n] - search->high->rate[n]));
    for (int step = 0; step < 100; step++) {
        if (!(t > low && t < high) || (step > 8 && step % 2 == 1)) { t = low + 0.5 * (high - low); }
        if (!(t > low && t < high)) { break; }
        const modal_gain_real gain = gain_over_a_node_real(search->modal, &search->low->m, t);
        const modal_real m = modal_after_real(search->modal, &search->low->m, &gain);
        const real rate = search->sign[n] * rate_by_row_real(row, &m);
        const real bend = search->sign[n] * deflated_by_row_real(row, &m) - search->modal->a * rate;
        const real less = bend > 0.0 ? rate / bend : HOPFORM_NEVER_real;
        use_evaluation_real(search->evaluations);
        MODAL_COUNT(evaluation);
        const real rounding = modal_rounding_real(search, n, &gain, search->low->t + t, 0.0);
        if (bend > 0.0 && fabs_real(less * rate) <= 0.0625 * rounding) { break; }
        if ((high - low) * fabs_real(rate) <= 0.0625 * rounding) { break; }
        low = rate < 0.0 ? t : low;
        high = rate < 0.0 ? high : t;
        t = t - less;
    }
    cut_modal_interval_real(search, t);
    search->high->rate[n] = 0.0;
}

/* Whether function n, which rule 2 does not settle by signs, has no root in the interval; else the interval is cut. */
SELDOM_real bool is_settled_inside_real(modal_search_real *search, int n) {
    const modal_node_real *from = search->low, *to = search->high;
    const real h = to->t - from->t;
    const real amplitude = amplitude_of_real(&from->m);
    const real rounding = modal_rounding_real(search, n, &search->gained, to->t, to->rate[n]);
    MODAL_COUNT(inside);
    if (!(to->value[n] < 0.0)) {
        if (falls_too_little_real(search, n, h, amplitude)) {
            MODAL_COUNT(amplitude);
            return true;
        }
        if (has_modal_bernstein_real(search, n, h, amplitude, rounding)) {
            MODAL_COUNT(bernstein);
            return true;
        }
    }
    if (from->rate[n] < 0.0 && !(to->rate[n] < 0.0)) {
        cut_at_minimum_real(search, n);
        MODAL_COUNT(minimum);
        return false;
    }
    const real cut = cut_between_real(from->deflated[n], to->deflated[n], h);
    MODAL_COUNT(cut);
    if (!(from->t + cut > from->t && from->t + cut < to->t)) { return true; } /* too short to be cut */
    cut_modal_interval_real(search, cut);
    return false;
}

/* What the rate of a function at the start of the phase, where the interval begins, is more than the coordinates say:
 * where an acceleration is known it has all its digits. */
static inline real known_beside_real(const modal_search_real *search, int n) {
    if (search->low->t > 0.0) { return 0.0; }
    return search->low->rate[n] - search->sign[n] * rate_by_row_real(&search->modal->row[n], &search->low->m);
}

/* Whether a function ends above zero and has no root in the interval by its signs: nearly all intervals are so. */
ALWAYS_real bool stays_above_real(const modal_search_real *search, int n) {
    const modal_node_real *low = search->low, *high = search->high;
    return high->value[n] >= 0.0
           && turns_down_only_real(low->rate[n], low->deflated[n], high->rate[n], high->deflated[n]);
}

ALWAYS_real bool all_stay_above_real(const modal_search_real *search) {
    return (search->first != 0 || stays_above_real(search, 0)) && stays_above_real(search, 1)
           && stays_above_real(search, 2);
}

/* Whether a function has crossed zero by the end of the interval: by more than rounding, or so steeply that the root is
 * near. */
static inline bool modal_has_crossed_real(const modal_search_real *search, int n) {
    const modal_node_real *to = search->high;
    if (!(to->value[n] < 0.0)) { return false; }
    const real rounding = modal_rounding_real(search, n, &search->gained, to->t, to->rate[n]);
    return (to->value[n] < -rounding) | (to->rate[n] * (to->t - search->low->t) < -rounding);
}

/* Certifies the interval, cut until that is so: no function has a root in it but those, a bit each, that have one and
 * end below zero. */
SELDOM_real uint32_t certify_modal_interval_real(modal_search_real *search) {
    uint32_t crossed = 0;
    int n = search->first;
    while (n < MODAL_FUNCTIONS_real) {
        const bool falls = modal_has_crossed_real(search, n);
        if (turns_down_only_real(search->low->rate[n], search->low->deflated[n], search->high->rate[n],
                                 search->high->deflated[n])
            || is_settled_inside_real(search, n)) {
            crossed |= falls ? 1u << (uint32_t)n : 0u;
            n++;
        } else { /* it has been cut: from the beginning */
            search->count++;
            crossed = 0;
            n = search->first;
            if (search->count > HOPFORM_MOST_INTERVALS || !(search->evaluations->left > 0)) { break; }
        }
    }
    return crossed;
}

/* ---- the root ---- */

/* A root in the interval: when since it began, and what is gained until then. */
typedef struct {
    real t;
    modal_gain_real gain;
} modal_root_real;

static inline jet_real modal_jet_real(const modal_search_real *search, const modal_node_real *at, int n) {
    const jet_real jet = {at->value[n], at->rate[n], at->deflated[n] - search->modal->a * at->rate[n], 0.0};
    return jet;
}

/* Of a function that has one root in the interval and ends below zero. From the nearer end: Halley's step, carried by a
 * short series, then Newton's. */
SELDOM_real modal_root_real modal_root_of_real(const modal_search_real *search, int n) {
    const hopform_modal_real *modal = search->modal;
    const hopform_modal_row_real *row = &modal->row[n];
    const real sign = search->sign[n];
    const real h = search->high->t - search->low->t;
    const real known = search->low->value[n] > 0.0 ? 0.0 : known_beside_real(search, n);
    jet_real from = modal_jet_real(search, search->low, n);
    const jet_real to = modal_jet_real(search, search->high, n);
    const modal_real *m_low = &search->low->m;
    from.third = sign
                     * (row->deflated_sine * (modal->omega * m_low->c - modal->mean * m_low->s)
                        - row->deflated_cosine * (modal->mean * m_low->c + modal->omega * m_low->s))
                 - modal->a * from.curvature;
    const interpolant_real p = interpolant_of_real(&from, &to, h);
    real t = h * refined_root_real(&p, rough_root_real(&from, &to, h));
    const bool back = t > 0.5 * h && !fades_in_a_node_real(modal) && !(fabs_real(known) > 0.0);
    const modal_node_real *base = back ? search->high : search->low;
    const real t_base = back ? h : 0.0;
    const real rates = modal->root_q * modal->root_q + modal->a * modal->a;
    real low = 0.0, high = h;
    modal_gain_real gain = no_gain_real(&base->m);
    bool ends = false;
    for (int step = 0; step < 100; step++) {
        if (!ends && (!(t > low && t < high) || (step > 8 && step % 2 == 1))) { t = low + 0.5 * (high - low); }
        if (!(t > low && t < high)) {
            t = ends ? t : high;
            ends = true;
        }
        gain = back || t < 0.5 * modal->h ? gain_over_half_a_node_real(modal, &base->m, t - t_base)
                                          : gain_over_a_node_real(modal, &base->m, t - t_base);
        const modal_real m = modal_after_real(modal, &base->m, &gain);
        real rest;
        const real value = (search->from_the_end ? value_from_the_end_real(search, n, base, &gain, &rest)
                                                 : value_after_real(search, n, base, &gain))
                           + known * (t - t_base);
        const real rate = sign * rate_by_row_real(row, &m) + known;
        const real bend = sign * deflated_by_row_real(row, &m) - modal->a * rate;
        const real below = 2.0 * rate * rate - value * bend;
        const real first = -2.0 * value * rate / (below > 0.0 ? below : 1.0);
        use_evaluation_real(search->evaluations);
        MODAL_COUNT(evaluation);
        if (ends || fabs_real(value) <= HOPFORM_EPS_real * (search->low->t + t) * fabs_real(rate)) { break; }
        const bool falls = (rate < 0.0) & (below > 0.0);
        if (falls && fades_in_a_node_real(modal)) { /* no series carries what fades: once more, and no further */
            ends = fabs_real(first) < HOPFORM_ROOT_EPS_real * t;
        } else if (falls & (first * first * rates < HOPFORM_SHORT_real)) {
            const modal_gain_real second = gain_over_a_step_real(modal, &m, first);
            const modal_real there = modal_after_real(modal, &m, &second);
            const real rate_there = sign * rate_by_row_real(row, &there) + known;
            const real value_there = value + (sign * gain_by_row_real(row, &second) + known * first);
            const real more = -value_there / (rate_there < 0.0 ? rate_there : -1.0);
            if ((rate_there < 0.0) & (more * more * rates < HOPFORM_EPS_real)) {
                const modal_gain_real third = {there.f * more, there.c * more, there.s * more,
                                               there.f - there.f * (modal->a * more)};
                const modal_gain_real last = gain_and_real(&second, &third);
                gain = gain_and_real(&gain, &last);
                t = t + (first + more);
                break;
            }
        }
        low = value > 0.0 ? t : low;
        high = value < 0.0 ? t : high;
        t = falls ? t + first : low;
    }
    const modal_root_real root = {t, back ? gain_and_real(&search->gained, &gain) : gain};
    return root;
}

/* Two roots within rounding are at the same time, and the owner that comes first wins, at its own root, the later one.
 */
static inline int modal_tie_real(const modal_search_real *search, int found, modal_root_real *root) {
    const hopform_modal_real *modal = search->modal;
    const real t = search->low->t + root->t;
    const modal_real m = modal_after_real(modal, &search->low->m, &root->gain);
    const real other = search->sign[found] * rate_by_row_real(&modal->row[found], &m);
    const real bound = 0.125 * modal_rounding_real(search, found, &root->gain, t, other); /* as of the modal form */
    for (int n = search->first; n < found; n++) {
        const real rate = search->sign[n] * rate_by_row_real(&modal->row[n], &m);
        const real rounding = 0.125 * modal_rounding_real(search, n, &root->gain, t, rate);
        if (!(rate * (search->high->t - search->low->t) < -16.0 * rounding)) { continue; }
        real rest;
        const real value = search->from_the_end ? value_from_the_end_real(search, n, search->low, &root->gain, &rest)
                                                : value_after_real(search, n, search->low, &root->gain);
        if ((value - 4.0 * rounding) * fabs_real(other) < fabs_real(rate) * bound) {
            if (value > 0.0) { /* so little later that no series is needed */
                const real later = -value / rate;
                const modal_gain_real gain = {m.f * later, m.c * later, m.s * later, m.f - m.f * (modal->a * later)};
                root->gain = gain_and_real(&root->gain, &gain);
                root->t += later;
            }
            return n;
        }
    }
    return found;
}

/* The first of the functions that have crossed zero in the interval, and its root. */
static inline int first_modal_root_real(const modal_search_real *search, uint32_t crossed, modal_root_real *first) {
    int found = -1;
    for (int n = search->first; n < MODAL_FUNCTIONS_real; n++) {
        if ((crossed & 1u << (uint32_t)n) == 0) { continue; }
        const modal_root_real root = modal_root_of_real(search, n);
        if (found < 0 || root.t < first->t) {
            found = n;
            *first = root;
        }
    }
    return found > search->first ? modal_tie_real(search, found, first) : found;
}

/* ---- the next interval ---- */

/* Rule 5: how long from the start of the interval on no function has a root: what rings in it has an amplitude that
 * does not grow, what does not falls by no more than its rate times the time, or over a. */
SELDOM_real real modal_quiet_time_real(const modal_search_real *search) {
    const hopform_modal_real *modal = search->modal;
    const modal_node_real *at = search->low;
    const real amplitude = 1.001 * amplitude_of_real(&at->m) / modal->root_q;
    const modal_gain_real none = no_gain_real(&at->m);
    real quiet = HOPFORM_NEVER_real;
    for (int n = search->first; n < MODAL_FUNCTIONS_real && quiet > 0.0; n++) {
        const hopform_modal_row_real *row = &modal->row[n];
        const real rings = search->sign[n] * swing_by_row_real(modal, row, at->m.c, at->m.s);
        const real fades = search->sign[n] * row->rate_fade * at->m.f;
        const real rounding = modal_rounding_real(search, n, &none, at->t, at->rate[n]);
        const real left = at->value[n] - rings - row->amplitude * amplitude - rounding;
        const bool always = !(fades < 0.0) || left * modal->a > -fades;
        const real time = always ? HOPFORM_NEVER_real : -left / fades;
        quiet = left > 0.0 ? lesser_real(quiet, time) : 0.0;
    }
    return quiet;
}

/* The next interval begins where this one has ended; a value that is rounding below zero counts as 0. */
ALWAYS_real void begin_modal_interval_real(modal_search_real *search) {
    search->total = gain_and_real(&search->total, &search->gained);
    modal_node_real *low = search->high;
    search->high = search->low;
    search->low = low;
    for (int n = search->first; n < MODAL_FUNCTIONS_real; n++) {
        if (low->value[n] < 0.0) { low->value[n] = 0.0; }
    }
}

/* Values counted from where both elements end, once those are the smaller numbers: what has faded keeps its digits. */
SELDOM_real void count_from_the_end_real(modal_search_real *search, const equilibrium_real *settled) {
    const hopform_modal_real *modal = search->modal;
    const real ends[MODAL_FUNCTIONS_real] = {settled->y_end, settled->v_end, settled->v_end};
    const modal_real *m = &search->low->m;
    const real fades = m->f / (modal->a > 0.0 ? modal->a : 1.0);
    const real amplitude = amplitude_of_real(m);
    real z[MODAL_FUNCTIONS_real], rounded[MODAL_FUNCTIONS_real], rest[MODAL_FUNCTIONS_real];
    bool worse = !(modal->a > 0.0);
    bool better = false; /* one that ends near zero has no sign else */
    for (int n = 0; n < MODAL_FUNCTIONS_real; n++) {
        const hopform_modal_row_real *row = &modal->row[n];
        const real faded = row->rate_fade * fades;
        const real terms = fabs_real(ends[n]) + fabs_real(faded);
        const real before = search->rounded[n] + fabs_real(row->rate_fade * search->total.f)
                            + 2.0 * row->amplitude * search->amplitude / modal->root_q;
        rest[n] = ends[n] + swing_by_row_real(modal, row, m->c, m->s);
        z[n] = rest[n] - faded;
        rounded[n] = terms;
        const real then = terms + row->amplitude * amplitude / modal->root_q;
        worse = worse || then > before;
        better = better || then < 0.25 * before;
    }
    if (!(modal->a > 0.0) || !(fades_in_a_node_real(modal) || (better && !worse))) { return; }
    MODAL_COUNT(from_the_end);
    search->moved += displacement_real(modal, &modal->row[1], search->z[1], &search->m, search->low->t - search->from,
                                       &search->total);
    search->from = search->low->t;
    search->m = *m;
    search->amplitude = amplitude;
    search->total = no_gain_real(m);
    search->from_the_end = fades_in_a_node_real(modal);
    for (int n = 0; n < MODAL_FUNCTIONS_real; n++) {
        search->z[n] = z[n];
        search->rounded[n] = search->from_the_end ? fabs_real(ends[n]) : rounded[n];
        search->low->rest[n] = search->sign[n] * rest[n];
        search->low->value[n] = greater_real(search->sign[n] * z[n], 0.0);
    }
}
#endif

#endif
