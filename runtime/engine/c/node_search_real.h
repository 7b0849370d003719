/* SPDX-License-Identifier: MIT-0
 *
 * The first event of a phase in which both elements slip, by their rates: from node to node, each an interval in which
 * the event functions are certified to have no root but the one that is located.
 *
 * An event function g is the contact force, or a velocity times its side: a row of numbers times (y, v_1, v_2). Its
 * rate is this row times w, and d = g'' + a g' the row times (M + a) w, a motion of the pair alone. An interval is
 * shorter than half a period of the pair, or the pair has two real poles: where d has one sign at both ends it has it
 * in between, and else it changes it once. e^(at) g' grows where d is positive and falls where it is negative. All
 * rules follow from that. The distance to a stop ahead only falls: its sign at the end says all.
 */
#ifndef HOPFORM_NODE_SEARCH_H_real
#define HOPFORM_NODE_SEARCH_H_real

#include "certificate_real.h"
#include "transition_real.h"

#if HOPFORM_BOTH_MOVE
#ifndef NODE_COUNT
#define NODE_COUNT(what) (void)0
#endif

/* Whether the contact force is not the stretch, and so a row of several numbers. */
#define HOPFORM_CONTACT_IS_ROW (HOPFORM_HAS_CONTACT && !HOPFORM_CONTACT_IS_STRETCH)

/* The event functions in order of tie-break priority, each the owner of its event; the distance to a stop is behind
 * them. */
enum { NODE_FUNCTIONS_real = 3, STOP_AHEAD_real = NODE_FUNCTIONS_real };

/* A time, and what is known there. */
typedef struct {
    real t;
    rates_by_row_real w;
    real value[NODE_FUNCTIONS_real], rate[NODE_FUNCTIONS_real], deflated[NODE_FUNCTIONS_real]; /* of the functions */
    real x; /* how far the position has moved */
    real y; /* the stretch, where that is no event function */
} search_node_real;

typedef struct {
    const hopform_plan_real *plan;
    real sign[NODE_FUNCTIONS_real]; /* of each function */
    real contact[3];                /* the row of the contact force */
    int first;                      /* 1 where the stretch only grows, else 0 */
    bool is_beyond;                 /* the contact force, at the start, and stays so */
    bool rings;                     /* the pair */
    bool stiff;                     /* the real pole beside it */
    real limit;
    real gap; /* to the stop ahead; NEVER without one */
    bool
        is_from_the_end; /* a value of some of the functions is z where both elements end, and what has not yet faded */
    bool from_the_end[NODE_FUNCTIONS_real]; /* of which */
    bool has_end;                           /* where both elements end, by their rates */
    core_by_row_real end;
    search_node_real node[2]; /* the ends of the interval */
    search_node_real *low, *high;
    /* What values are counted from: a time, the rates there, and what of the values is rounded. */
    real from;
    rates_by_row_real w;
    real rounded[NODE_FUNCTIONS_real];
    int32_t count;
    evaluations_real *evaluations;
} node_search_real;

/* ---- what is known at a time ---- */

static inline real pole_of_search_real(const node_search_real *search) {
    return search->plan->poles[0].a;
}

/* What a function is of a state, or of its rates. */
ALWAYS_real real function_of_real(const node_search_real *search, int n, const real of[3]) {
    const real *row = search->contact;
    return HOPFORM_CONTACT_IS_ROW && n == 0 ? row[0] * of[0] + row[1] * of[1] + row[2] * of[2] : of[n];
}

/* The sum of the magnitudes of its terms. */
static inline real function_terms_real(const node_search_real *search, int n, const real of[3]) {
    const real *row = search->contact;
    return HOPFORM_CONTACT_IS_ROW && n == 0
               ? fabs_real(row[0] * of[0]) + fabs_real(row[1] * of[1]) + fabs_real(row[2] * of[2])
               : fabs_real(of[n]);
}

/* A value where an interval begins: of an event function one that is rounding below zero counts as 0. */
static inline real above_zero_real(const node_search_real *search, int n, real value) {
    return n < search->first ? value : greater_real(value, 0.0);
}

/* Values counted from where they end, by the rates. */
SELDOM_real void put_values_from_the_end_real(const node_search_real *search, search_node_real *to) {
    core_by_row_real left;
    left.named = unsettled_of_both_real(&search->plan->rates[0], &to->w.named);
    for (int n = 0; n < NODE_FUNCTIONS_real; n++) {
        if (!search->from_the_end[n]) { continue; }
        const real value = function_of_real(search, n, search->end.of) + function_of_real(search, n, left.of);
        to->value[n] = search->sign[n] * value;
        if (HOPFORM_CONTACT_IS_ROW && n == 0) { to->y = search->end.of[0] + left.of[0]; }
    }
}

/* A node that is a gain away from another. */
ALWAYS_real void put_node_real(const node_search_real *search, const search_node_real *from, const gained_real *gained,
                               real t, search_node_real *to) {
    to->t = t;
    to->w = gained->w;
    to->x = from->x + gained->x;
    const rates_by_row_real d = deflated_rates_real(search->plan, &to->w);
    UNROLLED_real for (int n = 0; n < NODE_FUNCTIONS_real; n++) {
        to->value[n] = from->value[n] + search->sign[n] * function_of_real(search, n, gained->z);
        to->rate[n] = search->sign[n] * function_of_real(search, n, to->w.of);
        to->deflated[n] = search->sign[n] * function_of_real(search, n, d.of);
    }
    if (HOPFORM_CONTACT_IS_ROW) { to->y = from->y + gained->z[0]; }
    if (search->is_from_the_end) { put_values_from_the_end_real(search, to); }
}

ALWAYS_real real velocity_of_node_real(const node_search_real *search, const search_node_real *at) {
    return search->sign[1 + HOPFORM_STOPPED_ELEMENT] * at->value[1 + HOPFORM_STOPPED_ELEMENT];
}

/* How far it is to the stop ahead. */
ALWAYS_real real distance_at_real(const node_search_real *search, const search_node_real *at) {
    return search->gap - search->sign[1 + HOPFORM_STOPPED_ELEMENT] * at->x;
}

/* The node a time behind another one, or before it. */
SELDOM_real void put_node_after_real(const node_search_real *search, const search_node_real *from, real later,
                                     search_node_real *to) {
    const gained_real gained = gained_over_real(search->plan, &from->w, velocity_of_node_real(search, from), later);
    const bool is_short = fabs_real(later) <= search->plan->transition.is_short_over;
    use_evaluations_real(search->evaluations, is_short ? 1 : EVALUATION_BY_W_real);
    NODE_COUNT(evaluation);
    put_node_real(search, from, &gained, from->t + later, to);
}

/* The magnitudes that the gain of a coordinate over a node is a sum of; over a shorter time, in which rates have hardly
 * become those of others, a share of these. */
static inline real gained_terms_real(const hopform_transition_real *transition, int n, const rates_by_row_real *w,
                                     real share) {
    const real *gains = transition->gains + 3 * n;
    const real parts[3] = {fabs_real(gains[0] * w->of[0]), fabs_real(gains[1] * w->of[1]),
                           fabs_real(gains[2] * w->of[2])};
    return share * (parts[0] + parts[1] + parts[2]) + (1.0 - share) * parts[n];
}

/* The magnitudes that a function is a sum of at a time: where it ends, and how far it is from there; or what it is
 * counted from, and what rates have brought since then, which is, of what rings, no more than in two nodes and a half.
 */
static inline real terms_of_node_real(const node_search_real *search, int n, const search_node_real *at) {
    if (search->from_the_end[n]) {
        return search->rounded[n]
               + fabs_real(search->sign[n] * at->value[n] - function_of_real(search, n, search->end.of));
    }
    const hopform_transition_real *transition = &search->plan->transition;
    const real t = at->t - search->from;
    const real share = lesser_real(1.3 * t * transition->fastest, 1.0);
    real sum = gained_terms_real(transition, n, &search->w, share);
    if (HOPFORM_CONTACT_IS_ROW && n == 0) {
        const real terms[3] = {sum, gained_terms_real(transition, 1, &search->w, share),
                               gained_terms_real(transition, 2, &search->w, share)};
        sum = function_terms_real(search, 0, terms);
    }
    return search->rounded[n] + sum * lesser_real(t / transition->h, 2.5);
}

/* The bound of what rounding has done to a function. */
static inline real rounding_at_node_real(const node_search_real *search, int n, const search_node_real *at, real rate) {
    return 16.0 * HOPFORM_EPS_real * (terms_of_node_real(search, n, at) + at->t * fabs_real(rate));
}

/* ---- the rules ---- */

/* Rule 2. Where it says yes g' changes its sign once at most in the interval, and from positive to negative: g is above
 * the lesser of its ends, and if it ends below zero it has one root. A rate that rounding has made 0 or given the other
 * sign lets g fall by no more than rounding. */
ALWAYS_real bool turns_down_only_real(real rate, real d, real rate_then, real d_then) {
    if (d >= 0.0) { return rate >= 0.0 || (d_then >= 0.0 && rate_then <= 0.0); }
    return rate_then <= 0.0 || d_then < 0.0;
}

/* d' of a function where the interval begins. */
static inline real rate_of_deflated_real(const node_search_real *search, int n) {
    rates_by_row_real d;
    for (int i = 0; i < NODE_FUNCTIONS_real; i++) {
        d.of[i] = search->sign[i] * search->low->deflated[i];
    }
    if (HOPFORM_CONTACT_IS_ROW) { d = deflated_rates_real(search->plan, &search->low->w); }
    const rates_by_row_real bend = bend_rates_real(search->plan, &d);
    return search->sign[n] * function_of_real(search, n, bend.of);
}

/* Rule 2, whatever the sign of d: q d^2 + d'^2 does not grow, so g' falls by no more than that amplitude of d times the
 * time, and g by half of it times the square. Where d begins positive and g' does not end negative, e^(at) g' is never
 * below what it starts from. */
static inline bool falls_too_little_real(const node_search_real *search, int n, real h, real d_rate) {
    const search_node_real *from = search->low;
    const bool rises = (from->deflated[n] >= 0.0) & (search->high->rate[n] >= 0.0);
    const real d = from->deflated[n];
    const real amplitude = rises ? 0.0 : sqrt_real(d * d + d_rate * d_rate / search->plan->poles[0].q);
    const real falls = 0.501 * h * amplitude - lesser_real(from->rate[n], 0.0);
    return from->value[n] > h * falls;
}

/* What of a rate belongs to the pair: r, of which r' + a r is d; and the amplitude of a motion of a pair that rings. */
static inline real rate_of_pair_real(const hopform_poles_real *poles, real d, real d_rate) {
    return (poles->a * d - (d_rate + poles->p * d)) / residue_real(poles);
}

static inline real amplitude_of_pair_real(const hopform_poles_real *poles, real r, real r_rate) {
    const real mean = 0.5 * poles->p;
    const real turns = r_rate + mean * r;
    return sqrt_real(r * r + turns * turns / (poles->q - mean * mean));
}

/* Behind which time, where the real pole is far beyond the pair, what stays and what fades, at the start of the
 * interval, are zero together: NEVER where they are not. */
static inline real faded_after_real(const node_search_real *search, real stays, real fades) {
    const real ratio = fabs_real(stays) > 0.0 ? -fades / stays : 0.0;
    return ratio > 1.0 && ratio <= HOPFORM_NEVER_real ? logarithm_real(ratio) / pole_of_search_real(search)
                                                      : HOPFORM_NEVER_real;
}

/* How far a function of a pair that rings is at most from the quintic through value, rate and curvature at both ends:
 * t^3 (h - t)^3/6! of its sixth derivative, the fifth of the rate, whose amplitude does not grow; 43200 for 46080. */
static inline real remainder_of_quintic_real(const node_search_real *search, int n, real h, real d_rate) {
    const hopform_poles_real *poles = &search->plan->poles[0];
    const search_node_real *from = search->low;
    const real r = rate_of_pair_real(poles, from->deflated[n], d_rate);
    const real amplitude = amplitude_of_pair_real(poles, r, from->deflated[n] - poles->a * r);
    const real aa = poles->a * poles->a;
    const real M6 =
        poles->q * poles->q * sqrt_real(poles->q) * amplitude + aa * aa * poles->a * fabs_real(from->rate[n] - r);
    const real hhh = h * h * h;
    return M6 * hhh * hhh / 43200.0;
}

/* Rule 1, of a pair that rings: the quintic through value, rate and curvature at both ends is above the least of its
 * coefficients by Bernstein; where the function begins at 0 that one does not count. */
static inline bool has_no_root_by_bernstein_real(const node_search_real *search, int n, real h, real d_rate,
                                                 real rounding) {
    const hopform_poles_real *poles = &search->plan->poles[0];
    const search_node_real *from = search->low, *to = search->high;
    const real f = 0.2 * h;
    const real tw = 0.05 * h * h;
    const real b1 = from->value[n] + f * from->rate[n];
    const real b2 = b1 + f * from->rate[n] + tw * (from->deflated[n] - poles->a * from->rate[n]);
    const real b4 = to->value[n] - f * to->rate[n];
    const real b3 = b4 - f * to->rate[n] + tw * (to->deflated[n] - poles->a * to->rate[n]);
    const real inside = lesser_real(lesser_real(b1, b2), lesser_real(b3, b4));
    const real at_start = lesser_real(inside, from->value[n]);
    const real low = lesser_real(from->value[n] > 0.0 ? at_start : inside, to->value[n]);
    return low > remainder_of_quintic_real(search, n, h, d_rate) + rounding;
}

/* ---- inside an interval ---- */

/* Ends the interval so much later than it begins. */
static inline void cut_interval_real(node_search_real *search, real later) {
    put_node_after_real(search, search->low, later, search->high);
}

/* Rule 4: of a function whose rate is negative at the start and not at the end, and has one root; the interval ends
 * there. */
SELDOM_real void cut_at_minimum_real(node_search_real *search, int n) {
    real low = 0.0, high = search->high->t - search->low->t;
    real t = high * (search->low->rate[n] / (search->low->rate[n] - search->high->rate[n]));
    if (search->plan->transition.apart > 0.0) {
        const real r =
            rate_of_pair_real(&search->plan->poles[0], search->low->deflated[n], rate_of_deflated_real(search, n));
        const real faded = faded_after_real(search, r, search->low->rate[n] - r);
        t = faded < high ? faded : t;
    }
    for (int step = 0; step < 100; step++) {
        if (!(t > low && t < high) || (step > 8 && step % 2 == 1)) { t = low + 0.5 * (high - low); }
        if (!(t > low && t < high)) { break; }
        cut_interval_real(search, t);
        const real rate = search->high->rate[n];
        const real bend = search->high->deflated[n] - pole_of_search_real(search) * rate;
        const real less = bend > 0.0 ? rate / bend : HOPFORM_NEVER_real;
        const real rounding = rounding_at_node_real(search, n, search->high, 0.0);
        if (bend > 0.0 && fabs_real(less * rate) <= 0.0625 * rounding) { break; }
        if ((high - low) * fabs_real(rate) <= 0.0625 * rounding) { break; }
        low = rate < 0.0 ? t : low;
        high = rate < 0.0 ? high : t;
        t = t - less;
    }
    cut_interval_real(search, t);
    search->high->rate[n] = 0.0; /* and g'' = d is not negative: a sign that rounding has given it is none */
    search->high->deflated[n] = greater_real(search->high->deflated[n], 0.0);
}

/* Whether function n, which rule 2 does not settle by signs, has no root in the interval; else the interval is cut. */
SELDOM_real bool is_settled_inside_real(node_search_real *search, int n) {
    const search_node_real *from = search->low, *to = search->high;
    const real h = to->t - from->t;
    NODE_COUNT(inside);
    if (!(to->value[n] < 0.0)) {
        const real d_rate = rate_of_deflated_real(search, n);
        if (falls_too_little_real(search, n, h, d_rate)) {
            NODE_COUNT(amplitude);
            return true;
        }
        const real rounding = rounding_at_node_real(search, n, to, to->rate[n]);
        if (search->rings && has_no_root_by_bernstein_real(search, n, h, d_rate, rounding)) {
            NODE_COUNT(bernstein);
            return true;
        }
    }
    if (from->rate[n] < 0.0 && !(to->rate[n] < 0.0)) {
        cut_at_minimum_real(search, n);
        NODE_COUNT(minimum);
        return false;
    }
    const real cut = cut_between_real(from->deflated[n], to->deflated[n], h);
    NODE_COUNT(cut);
    if (!(from->t + cut > from->t && from->t + cut < to->t)) { return true; } /* too short to be cut */
    cut_interval_real(search, cut);
    return false;
}

/* Whether a function ends above zero and has no root in the interval by its signs: nearly all intervals are so. */
ALWAYS_real bool stays_above_real(const node_search_real *search, int n) {
    const search_node_real *low = search->low, *high = search->high;
    return high->value[n] >= 0.0
           && turns_down_only_real(low->rate[n], low->deflated[n], high->rate[n], high->deflated[n]);
}

ALWAYS_real bool all_stay_above_real(const node_search_real *search) {
    return (search->first != 0 || stays_above_real(search, 0)) && stays_above_real(search, 1)
           && stays_above_real(search, 2);
}

/* Whether a function has crossed zero by the end of the interval: by more than rounding, or so steeply that the root is
 * near, and not beside a minimum, where it falls by no more than rounding. */
static inline bool has_crossed_at_node_real(const node_search_real *search, int n) {
    const search_node_real *to = search->high;
    if (!(to->value[n] < 0.0)) { return false; }
    const real rate = to->rate[n];
    const real bend = to->deflated[n] - pole_of_search_real(search) * rate;
    const real rounding = rounding_at_node_real(search, n, to, rate);
    const bool is_steep = rate * (to->t - search->low->t) < -rounding && !(rate * rate < bend * rounding);
    return to->value[n] < -rounding || is_steep;
}

/* Certifies the interval, cut until that is so: no function has a root in it but those, a bit each, that have one and
 * end below zero. */
SELDOM_real uint32_t certify_interval_real(node_search_real *search) {
    uint32_t crossed = 0;
    int n = search->first;
    while (n < NODE_FUNCTIONS_real) {
        const bool falls = has_crossed_at_node_real(search, n);
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

/* Value, rate and curvature of a function, or of the distance to the stop ahead. */
ALWAYS_real jet_real jet_at_node_real(const node_search_real *search, const search_node_real *at, int n) {
    const int element = 1 + HOPFORM_STOPPED_ELEMENT;
    if (n == STOP_AHEAD_real) {
        const jet_real stop = {distance_at_real(search, at), -at->value[element], -at->rate[element], 0.0};
        return stop;
    }
    const jet_real jet = {at->value[n], at->rate[n], at->deflated[n] - pole_of_search_real(search) * at->rate[n], 0.0};
    return jet;
}

/* The same a short time from a node where w, M w and M^2 w are known. */
ALWAYS_real jet_real jet_by_powers_real(const node_search_real *search, const search_node_real *base,
                                        const derivatives_of_both_real *at, int n, real t) {
    const hopform_poles_real *poles = &search->plan->poles[0];
    const powers_real by = powers_over_half_a_node_real(poles, t);
    const bool stop = n == STOP_AHEAD_real;
    const int row = stop ? 1 + HOPFORM_STOPPED_ELEMENT : n;
    const real sign = stop ? -search->sign[row] : search->sign[row];
    const real k_1 = sign * function_of_real(search, row, at->w.of);
    const real k_2 = sign * function_of_real(search, row, at->bend.of);
    const real k_3 = sign * function_of_real(search, row, at->third.of);
    const real k_4 = -(poles->s_1 * k_3 + poles->s_2 * k_2 + poles->s_3 * k_1);
    const real first = by.first * k_1 + by.second * k_2 + by.third * k_3;
    const real second = k_1 + (by.first * k_2 + by.second * k_3 + by.third * k_4);
    if (stop) {
        const real moved =
            (by.second + poles->s_2 * by.last) * k_1 + (by.third + poles->s_1 * by.last) * k_2 + by.last * k_3;
        const jet_real jet = {distance_at_real(search, base) - base->value[row] * t + moved, -base->value[row] + first,
                              second, 0.0};
        return jet;
    }
    const real k_5 = -(poles->s_1 * k_4 + poles->s_2 * k_3 + poles->s_3 * k_2);
    const jet_real jet = {base->value[n] + first, second, k_2 + (by.first * k_3 + by.second * k_4 + by.third * k_5),
                          0.0};
    return jet;
}

/* Newton's step from so near a root that nothing has to be evaluated again. */
static inline void step_to_root_at_node_real(const node_search_real *search, int n, real h, search_node_real *there) {
    const jet_real jet = jet_at_node_real(search, there, n);
    const real step = -jet.value / (jet.rate < 0.0 ? jet.rate : -1.0);
    const real reach = step * search->plan->transition.fastest;
    if (!(jet.rate < 0.0) || !(fabs_real(step) < h) || !(reach * reach < HOPFORM_EPS_real)) { return; }
    if (!(there->t + step > search->low->t)) { return; }
    const real a = pole_of_search_real(search);
    there->t += step;
    there->x += step * velocity_of_node_real(search, there);
    const rates_by_row_real bends = bend_rates_real(search->plan, &there->w);
    if (HOPFORM_CONTACT_IS_ROW) { there->y += step * there->w.of[0]; }
    UNROLLED_real for (int i = 0; i < NODE_FUNCTIONS_real; i++) {
        const real bend = there->deflated[i] - a * there->rate[i];
        there->value[i] += step * there->rate[i];
        there->rate[i] += step * bend;
        there->w.of[i] += step * (HOPFORM_CONTACT_IS_ROW ? bends.of[i] : search->sign[i] * bend);
    }
}

/* The root in the interval of a function, or of the distance, that has one and ends below zero: what is known there.
 * Halley's steps, from the nearer end; the last one leaves less than rounding. */
SELDOM_real void put_root_real(const node_search_real *search, int n, search_node_real *there) {
    const search_node_real *low_end = search->low, *high_end = search->high;
    const hopform_poles_real *poles = &search->plan->poles[0];
    const real h = high_end->t - low_end->t;
    const jet_real from = jet_at_node_real(search, low_end, n);
    const jet_real to = jet_at_node_real(search, high_end, n);
    const bool is_short = !search->is_from_the_end && h <= 0.8 * search->plan->transition.is_short_over;
    const real rates = poles->q + poles->a * poles->a;
    real t = h * rough_root_real(&from, &to, h);
    if (search->plan->transition.apart > 0.0 && n != STOP_AHEAD_real) {
        const real r = rate_of_pair_real(poles, low_end->deflated[n], rate_of_deflated_real(search, n));
        const real fades = (r - from.rate) / poles->a;
        const real faded = faded_after_real(search, from.value - fades, fades);
        t = faded * fabs_real(r) < 0.25 * fabs_real(from.value - fades) && faded < h ? faded : t;
    }
    const search_node_real *base = is_short ? NULL : low_end;
    real t_base = 0.0;
    real low = 0.0, high = h;
    derivatives_of_both_real at;
    bool ends = false;
    for (int step = 0; step < 100; step++) {
        if (!ends && (!(t > low && t < high) || (step > 8 && step % 2 == 1))) { t = low + 0.5 * (high - low); }
        if (!(t > low && t < high)) {
            t = ends ? t : high;
            ends = true;
        }
        jet_real jet;
        if (is_short) {
            const bool back = t > 0.5 * h;
            const search_node_real *nearer = back ? high_end : low_end;
            if (base != nearer) {
                base = nearer;
                t_base = back ? h : 0.0;
                at = derivatives_at_real(search->plan, &base->w);
            }
            use_evaluations_real(search->evaluations, 1);
            NODE_COUNT(evaluation);
            jet = jet_by_powers_real(search, base, &at, n, t - t_base);
        } else {
            put_node_after_real(search, base, t, there);
            jet = jet_at_node_real(search, there, n);
        }
        const real digit = HOPFORM_EPS_real * (low_end->t + t);
        if (ends || fabs_real(jet.value) <= digit * fabs_real(jet.rate)) { break; }
        const real below = 2.0 * jet.rate * jet.rate - jet.value * jet.curvature;
        const bool falls = (jet.rate < 0.0) & (below > 0.0);
        const real first = -2.0 * jet.value * jet.rate / (falls ? below : 1.0);
        low = jet.value > 0.0 ? t : low;
        high = jet.value < 0.0 ? t : high;
        t = falls ? t + first : low;
        if (t > low && t < high) {
            const real bends = first * jet.curvature / jet.rate;
            const real left = first * (0.25 * bends * bends + first * first * rates); /* of Halley's step */
            if (left * left * rates <= HOPFORM_EPS_real
                && left * left * fabs_real(jet.curvature) <= digit * fabs_real(jet.rate)) {
                break;
            }
        }
    }
    t = t > 0.0 ? (t < h ? t : h) : 0.0;
    if (is_short) {
        const powers_real powers = powers_over_half_a_node_real(poles, t - t_base);
        const gained_real gained =
            gained_by_powers_real(search->plan, &at, velocity_of_node_real(search, base), t - t_base, &powers);
        put_node_real(search, base, &gained, low_end->t + t, there);
    } else {
        put_node_after_real(search, base, t, there);
        there->t = low_end->t + t;
    }
    step_to_root_at_node_real(search, n, h, there);
}

/* Two roots within rounding are at the same time, and the owner that comes first wins, at its own root, the later one:
 * so near that its rate does not change until then. */
static inline int tie_at_node_real(const node_search_real *search, int found, search_node_real *root) {
    const real other = root->rate[found];
    const real bound = 0.125 * rounding_at_node_real(search, found, root, other);
    for (int n = search->first; n < found; n++) {
        const real rate = root->rate[n];
        const real rounding = 0.125 * rounding_at_node_real(search, n, root, rate);
        if (!(rate * (search->high->t - search->low->t) < -16.0 * rounding)) { continue; }
        const real value = root->value[n];
        if (!(value * search->plan->transition.fastest < 0.125 * fabs_real(rate))) { continue; }
        if ((value - 4.0 * rounding) * fabs_real(other) < fabs_real(rate) * bound) {
            if (value > 0.0) { /* so little later that no series is needed */
                const search_node_real at = *root;
                put_node_after_real(search, &at, -value / rate, root);
            }
            return n;
        }
    }
    return found;
}

/* The first of the functions that have crossed zero in the interval, and its root. */
static inline int first_root_of_real(const node_search_real *search, uint32_t crossed, search_node_real *first) {
    int found = -1;
    for (int n = search->first; n < NODE_FUNCTIONS_real; n++) {
        if ((crossed & 1u << (uint32_t)n) == 0) { continue; }
        if (found < 0) {
            put_root_real(search, n, first);
            found = n;
            continue;
        }
        search_node_real root;
        put_root_real(search, n, &root);
        if (root.t < first->t) {
            found = n;
            *first = root;
        }
    }
    return found > search->first ? tie_at_node_real(search, found, first) : found;
}

/* ---- the next interval ---- */

/* Values of a function counted from where it ends, from now on: of what has faded over a long time nothing else has
 * digits. */
static inline void count_function_from_the_end_real(node_search_real *search, int n) {
    search->from_the_end[n] = true;
    search->is_from_the_end = true;
    search->rounded[n] = function_terms_real(search, n, search->end.of);
}

/* Whether a function that ends at zero, or above, has no root any more: what fades to there is more than the amplitude
 * of what rings beside it, a share of 1.001, and fades no faster. Amplitudes whose squares are numbers. */
static inline bool fades_from_above_real(const node_search_real *search, int n, real fading, real amplitude,
                                         real rounding) {
    const hopform_poles_real *poles = &search->plan->poles[0];
    return search->has_end && 2.0 * poles->a <= poles->p
           && search->sign[n] * function_of_real(search, n, search->end.of) >= 0.0
           && fading > 1.001 * amplitude + rounding && HOPFORM_EPS_real * fading * fading > 0.0;
}

/* Rule 5, of a pair that rings: how long from the start of the interval on no function has a root. What rings in it, X
 * with r its rate, has an amplitude that does not grow; what does not falls by no more than its rate times the time, or
 * over a. */
SELDOM_real real quiet_time_at_node_real(node_search_real *search) {
    const hopform_poles_real *poles = &search->plan->poles[0];
    const search_node_real *at = search->low;
    const bool stiff = poles->a * poles->a > poles->q;
    real quiet = HOPFORM_NEVER_real;
    for (int n = search->first; n < NODE_FUNCTIONS_real && quiet > 0.0; n++) {
        const real d = at->deflated[n], d_rate = rate_of_deflated_real(search, n);
        const real r = rate_of_pair_real(poles, d, d_rate);
        const real X =
            -(stiff ? (d_rate + poles->p * d + poles->q * r) / poles->a : d - (poles->a - poles->p) * r) / poles->q;
        const real fades = at->rate[n] - r;
        const real rounding = 16.0 * HOPFORM_EPS_real * fabs_real(d) / poles->q; /* of what d' is a difference of */
        const real amplitude = amplitude_of_pair_real(poles, X, r);
        const real left =
            at->value[n] - X - 1.001 * amplitude - (rounding_at_node_real(search, n, at, at->rate[n]) + rounding);
        const bool always = !(fades < 0.0) || left * poles->a > -fades;
        const real time = always ? HOPFORM_NEVER_real : -left / fades;
        const real fading = poles->a > 0.0 ? -fades / poles->a : 0.0;
        if (!always && fades_from_above_real(search, n, fading, amplitude, rounding)) {
            count_function_from_the_end_real(search, n);
            continue;
        }
        quiet = left > 0.0 ? lesser_real(quiet, time) : 0.0;
    }
    return quiet;
}

/* The bound of rounding counted from where the interval begins: where intervals grow, rates have faded since then. */
SELDOM_real void count_from_here_real(node_search_real *search) {
    real terms[NODE_FUNCTIONS_real];
    for (int n = 0; n < NODE_FUNCTIONS_real; n++) {
        terms[n] = terms_of_node_real(search, n, search->low);
    }
    for (int n = 0; n < NODE_FUNCTIONS_real; n++) {
        search->rounded[n] = terms[n];
    }
    search->from = search->low->t;
    search->w = search->low->w;
}

/* The next interval begins where this one has ended; a value that is rounding below zero counts as 0. */
ALWAYS_real void begin_next_interval_real(node_search_real *search) {
    search_node_real *low = search->high;
    search->high = search->low;
    search->low = low;
    for (int n = search->first; n < NODE_FUNCTIONS_real; n++) {
        if (low->value[n] < 0.0) { low->value[n] = 0.0; }
    }
    if (!search->rings) { count_from_here_real(search); }
}

/* Values counted from where both elements end, of each function of which those are the smaller numbers: what has faded
 * keeps its digits. Beside a fast pole that has faded its rate has no others. */
SELDOM_real void count_from_the_end_real(node_search_real *search, const core_real *end) {
    search_node_real *low = search->low;
    core_by_row_real left;
    left.named = unsettled_of_both_real(&search->plan->rates[0], &low->w.named);
    search->end.named = *end;
    search->has_end = true;
    const bool has_faded = search->stiff && low->t * search->plan->transition.fastest > 0.5;
    const real most = has_faded ? 8.0 : 0.5; /* times what they are now */
    real terms[NODE_FUNCTIONS_real], before[NODE_FUNCTIONS_real];
    bool any = false;
    for (int n = 0; n < NODE_FUNCTIONS_real; n++) {
        terms[n] = function_terms_real(search, n, search->end.of) + function_terms_real(search, n, left.of);
        before[n] = terms_of_node_real(search, n, low);
        any = any || terms[n] < most * before[n];
    }
    if (!any) { return; }
    NODE_COUNT(from_the_end);
    search->from = low->t;
    search->w = low->w;
    for (int n = 0; n < NODE_FUNCTIONS_real; n++) {
        search->rounded[n] = before[n];
        if (!(terms[n] < most * before[n])) { continue; }
        search->from_the_end[n] = search->stiff;
        search->rounded[n] = search->stiff ? function_terms_real(search, n, search->end.of) : terms[n];
        const real value = function_of_real(search, n, search->end.of) + function_of_real(search, n, left.of);
        low->value[n] = above_zero_real(search, n, search->sign[n] * value);
        if (HOPFORM_CONTACT_IS_ROW && n == 0) { low->y = search->end.of[0] + left.of[0]; }
    }
    search->is_from_the_end = search->stiff;
}
#endif

#endif
