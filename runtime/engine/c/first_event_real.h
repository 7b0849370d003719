/* SPDX-License-Identifier: MIT-0
 *
 * The first event of a phase: the earliest root of its event functions, certified to be the earliest.
 *
 * The search goes from interval to interval. In each, roots are predicted from the values and derivatives at both ends,
 * located by a step of Householder's and one of Newton's, and certified to be the first; else the interval is cut.
 * docs/explanation/certificate.md has the steps in their order. What ends a phase in closed form comes with its event
 * functions, and is put between them by its time. The caller fills the event set and goes from interval to interval;
 * the search knows no more of the model than these functions.
 */
#ifndef HOPFORM_FIRST_EVENT_H_real
#define HOPFORM_FIRST_EVENT_H_real

#include "alone_real.h"
#include "certificate_real.h"
#include "transition_real.h"

/* Notes what is decided: which rule says of which function, by its number, that it has no root from when to when. True,
 * so that it can stand behind the decision, and nothing else but in a library for explanation (notes_real.c): there the
 * interval `in` that is looked at leads to the notes. */
#ifndef NOTE_real
#define NOTE_real(rule, function, from, to) true
#endif

/* A function may be located at a later root first, and so more than once: at each of its roots in an interval, of which
 * rule 2 leaves three at most, or four in flight. */
enum { MOST_TRIES_real = 4 * MOST_EVENT_FUNCTIONS_real };

/* Intervals that are certified, or cut, in a phase at most. */
#ifndef HOPFORM_MOST_INTERVALS
#define HOPFORM_MOST_INTERVALS 10000
#endif

/* ---- an interval ---- */

/* An interval of the search: its ends, the jets there, and which function has its first root at the second one. */
typedef struct {
    propagator_real low, high;
    int32_t found; /* -1: none */
    int32_t count; /* of the phase, so far */
    evaluations_real *evaluations;
    jet_real from[MOST_EVENT_FUNCTIONS_real];
    jet_real to; /* of the function that is looked at, or that has crossed zero first */
} interval_real;

static inline void end_interval_at_real(const event_set_real *set, interval_real *in, real t) {
    use_evaluation_real(in->evaluations);
    in->high = propagator_in_form_real(set->poles, in->high.omega, t);
    in->found = -1;
}

/* ---- predict, locate, again ---- */

/* The far end of an interval of length h has been passed below zero by more than rounding, or, where no other root has
 * been found before it, so steeply that the root is near. */
static inline bool has_crossed_real(const jet_real *to, real h, real rounding, bool is_last) {
    return (to->value < 0.0) & ((to->value < -rounding) | (is_last & (to->rate * h < -rounding)));
}

/* Where in (0, 1) of the interval a function that is below zero at its end has crossed zero, if it has: a rough guess;
 * 2 if it has not. Its jet there. */
static inline real guessed_crossing_real(const event_function_real *g, const interval_real *in, const jet_real *from,
                                         jet_real *to) {
    const real h = in->high.t - in->low.t;
    const bool is_last = in->found < 0 && !g->touch_is_no_event;
    *to = short_jet_at_real(g, &in->high);
    return has_crossed_real(to, h, rounding_of_real(g, &in->high, to->rate), is_last) ? rough_root_real(from, to, h)
                                                                                      : 2.0;
}

/* Where a function crosses zero in an interval: a guess, as a share of it. */
typedef struct {
    int32_t function;
    real share;
} crossing_real;

/* Which function has crossed zero first by the end of the interval, by rough guesses, if one has; of the distances
 * alone. */
static inline bool first_crossing_real(const event_set_real *set, interval_real *in, bool distances,
                                       crossing_real *first) {
    const propagator_real end = in->high; /* for registers */
    first->function = 0;
    first->share = 2.0;
    for (int32_t n = 0; n < set->count; n++) {
        const event_function_real *g = &set->function[n];
        if (n != in->found && (!distances || g->touch_is_no_event) && value_at_real(g, &end) < 0.0) {
            jet_real to;
            const real share = guessed_crossing_real(g, in, &in->from[n], &to);
            if (share < first->share) {
                first->function = n;
                first->share = share;
                in->to = to;
            }
        }
    }
    return first->share < 2.0;
}

/* Ends the interval at the root of a function that has crossed zero in it. */
static inline void end_at_crossing_real(const event_set_real *set, interval_real *in, const crossing_real *crossing) {
    const event_function_real *g = &set->function[crossing->function];
    const real h = in->high.t - in->low.t;
    const interpolant_real p = interpolant_of_real(&in->from[crossing->function], &in->to, h);
    locate_root_real(set->poles, g, in->low.t, &in->high, in->low.t + h * refined_root_real(&p, crossing->share),
                     in->evaluations);
    in->found = crossing->function;
}

/* Ends the interval at the earliest root of the functions, or distances alone, that have crossed zero by its end. */
static inline void end_at_first_crossing_real(const event_set_real *set, interval_real *in, bool distances) {
    crossing_real first;
    for (int32_t n = 0;
         n < MOST_TRIES_real && in->evaluations->left > 0 && first_crossing_real(set, in, distances, &first); n++) {
        end_at_crossing_real(set, in, &first);
    }
}

/* ---- certify ---- */

/* Two roots within rounding are at the same time, and the owner that comes first wins, at its own root: the later one,
 * so that its time does not jump where the other one begins to count. Over a limit that is met it wins only where the
 * roots are within 8 ulp of the time. */
static inline void settle_ties_real(const event_set_real *set, interval_real *in) {
    const event_function_real *found = &set->function[in->found];
    const real other = rate_at_real(found, &in->high);
    const real share = is_modal_real(&in->high) ? 0.125 : 1.0;
    for (int32_t n = 0; n < in->found && set->function[n].owner < found->owner; n++) {
        const event_function_real *g = &set->function[n];
        const real rate = rate_at_real(g, &in->high);
        const real rounding = share * rounding_of_real(g, &in->high, rate);
        if (!(rate * (in->high.t - in->low.t) < -16.0 * rounding)) { continue; }
        const real value = value_at_real(g, &in->high);
        if (found->touch_is_no_event ? value < 8.0 * HOPFORM_EPS_real * in->high.t * fabs_real(rate)
                                     : (value - 4.0 * rounding) * fabs_real(other)
                                           < fabs_real(rate) * (share * rounding_of_real(found, &in->high, other))) {
            if (value > 0.0) { end_interval_at_real(set, in, in->high.t - value / rate); }
            in->found = n;
            return;
        }
    }
}

/* Whether a function crosses zero at the end of the interval, the time of the limit, and does not just touch it. */
static inline bool crosses_at_limit_real(const event_function_real *g, const propagator_real *at, real limit) {
    const real rate = rate_at_real(g, at);
    return value_at_real(g, at) < -8.0 * HOPFORM_EPS_real * limit * rate
           && rate * limit < -16.0 * rounding_of_real(g, at, rate);
}

/* Where d has its root within an interval: the chord's, but not behind the middle, because the chord of what fades fast
 * leads to the end each time; a quarter of it where d has no two signs. */
static inline real cut_between_real(real d, real d_then, real h) {
    const bool changes = (d < 0.0) != (d_then < 0.0) && fabs_real(d_then) > 0.0;
    const real share = changes ? d / (d - d_then) : 0.25;
    const real inside = share > 0.015625 ? (share < 0.5 ? share : 0.5) : 0.015625;
    return inside * h;
}

/* Whether function n, of d at the start, has no root before the end, by the rules that take no further evaluation. */
static inline bool is_certified_real(const event_set_real *set, interval_real *in, int32_t n, real d) {
    const event_function_real *g = &set->function[n];
    const jet_real *from = &in->from[n];
    jet_real *to = &in->to;
    *to = short_jet_at_real(g, &in->high);
    if (to->value < 0.0 && n != in->found && to->value < -rounding_of_real(g, &in->high, to->rate)) {
        return false; /* what the rules rest on: no function but that with its root there is below zero */
    }
    const real d_then = deflated_derivative_real(set, g, &in->high, -1.0);
    if (has_no_root_real(from, d, falls_for_certain_real(g, &in->high, to->rate), d_then)
        && NOTE_real(has_no_root, n, in->low.t, in->high.t)) {
        return true;
    }
    const real h = in->high.t - in->low.t;
    const real rounding = rounding_of_real(g, &in->high, to->rate);
    return (!(d < 0.0) && stays_positive_by_slope_real(set->node->pole, from, to, h, rounding)
            && NOTE_real(stays_positive_by_slope, n, in->low.t, in->high.t))
           || (quiet_time_real(set, g, &in->low, from, rounding) > h && NOTE_real(quiet_time, n, in->low.t, in->high.t))
           || (set->node->half_period < HOPFORM_NEVER_real
               && ((stays_positive_by_bernstein_real(set->poles, g, in->high.omega, from, to, h, n == in->found,
                                                     rounding)
                    && NOTE_real(stays_positive_by_bernstein, n, in->low.t, in->high.t))
                   || (has_faded_real(set, g, &in->low, from, h, rounding)
                       && NOTE_real(has_faded, n, in->low.t, in->high.t))));
}

/* The same by rule 4, a look inside the interval. If there is a root, or still no certificate, the interval ends there,
 * unless it is so short that a cut at 1/64 of it is no other number than its start. */
SELDOM_real bool is_certified_inside_real(const event_set_real *set, interval_real *in, int32_t n, real d) {
    const event_function_real *g = &set->function[n];
    const jet_real *from = &in->from[n];
    const jet_real *to = &in->to;
    const real h = in->high.t - in->low.t;
    const real d_then = deflated_derivative_real(set, g, &in->high, -1.0);
    if (from->rate < 0.0 && !(to->rate < 0.0)) { /* g' has one root */
        in->to.third = third_of_real(set->poles, g, &in->high);
        const propagator_real lowest =
            minimum_between_real(set->poles, g, in->high.omega, from, in->low.t, to, in->high.t, in->evaluations);
        const jet_real least = short_jet_at_real(g, &lowest);
        if (!(least.value < -rounding_of_real(g, &lowest, least.rate))) {
            return NOTE_real(minimum_between, n, in->low.t, in->high.t);
        }
        in->high = lowest;
        in->found = -1;
        return false;
    }
    const real cut = in->low.t + cut_between_real(d, d_then, h);
    if (!(cut > in->low.t && cut < in->high.t)) {
        return NOTE_real(too_short, n, in->low.t, in->high.t); /* to be cut */
    }
    end_interval_at_real(set, in, cut);
    return false;
}

/* Whether no function has a root before the end of the interval; among those that have one there, the first wins. */
static inline bool are_certified_real(const event_set_real *set, interval_real *in) {
    for (int32_t n = 0; n < set->count; n++) {
        const event_function_real *g = &set->function[n];
        if (!HOPFORM_CERTIFIES_real || !g->needs_certificate) { continue; }
        /* what is cheap of rule 2 comes first */
        const real d = deflated_derivative_real(set, g, &in->low, 1.0);
        const bool no_root_by_signs = d < 0.0 ? falls_for_certain_real(g, &in->high, rate_at_real(g, &in->high))
                                              : (d > 0.0) & !(in->from[n].rate < 0.0);
        if (!(no_root_by_signs && NOTE_real(has_no_root, n, in->low.t, in->high.t)) && !is_certified_real(set, in, n, d)
            && !is_certified_inside_real(set, in, n, d)) {
            return !NOTE_real(cut, n, in->low.t, in->high.t);
        }
    }
    if (HOPFORM_CERTIFIES_real && in->found > 0) { settle_ties_real(set, in); }
    return NOTE_real(certified, in->found, in->low.t, in->high.t);
}

/* Ends the interval at the first root in it, if it has one; false if no certificate is found within the bounds.
 * Requires in->from[n].value >= 0 of each function, as begin_interval and begin_at_start leave it. */
static inline bool find_first_root_real(const event_set_real *set, interval_real *in) {
    do {
        if (in->count >= HOPFORM_MOST_INTERVALS) { return false; }
        in->count++;
        end_at_first_crossing_real(set, in, false);
        if (!(in->evaluations->left > 0)) { return false; }
    } while (!are_certified_real(set, in));
    return in->evaluations->left > 0;
}

/* ---- the next interval ---- */

/* The next interval begins where this one has ended. */
static inline void begin_interval_real(const event_set_real *set, interval_real *in) {
    in->low = in->high;
    in->found = -1;
    for (int32_t n = 0; n < set->count; n++) {
        in->from[n] = jet_at_real(set->poles, &set->function[n], &in->high);
        in->from[n].value = greater_real(in->from[n].value, 0.0);
    }
}

/* Rule 5: until when no function has a root, for certain. */
static inline real root_free_until_real(const event_set_real *set, const interval_real *in) {
    real quiet = HOPFORM_NEVER_real;
    for (int32_t n = 0; n < set->count && quiet > 0.0; n++) {
        const event_function_real *g = &set->function[n];
        const real parts = is_modal_real(&in->low) ? fabs_real(g->H3) + fabs_real(g->H2) + fabs_real(g->H1) : 0.0;
        const real rounding = 16.0 * HOPFORM_EPS_real * (fabs_real(g->start) + g->cancels + parts);
        if (HOPFORM_CERTIFIES_real && !g->touch_is_no_event) { /* one that is monotone is looked at where it ends */
            quiet = lesser_real(quiet_time_real(set, &set->function[n], &in->low, &in->from[n], rounding), quiet);
        }
    }
    return in->low.t + quiet;
}

/* Begin the first interval. A function that falls below zero at once is found; -1 if there is none. */
static inline int32_t begin_at_start_real(const event_set_real *set, interval_real *in) {
    int32_t found = -1;
    in->low = propagator_at_start_real(set->poles);
    for (int32_t n = set->count - 1; n >= 0; n--) {
        in->from[n] = jet_at_start_real(set->poles, &set->function[n]);
        const real value = in->from[n].value;
        if (value < 0.0 || (set->function[n].cancels > 0.0 && !(value > 0.0))) {
            found = begins_beyond_real(&set->function[n]) ? n : found;
            in->from[n].value = 0.0;
        }
    }
    return found;
}

/* The far end of the next interval: less than half a period of the pair away, and not so far that all has faded. */
static inline real far_end_real(const event_set_real *set, real low, real limit) {
    const real near = greater_real(3.0 * low, set->node->t);
    const real half = 0.95 * set->node->half_period;
    const bool faded =
        -0.5 * set->poles->p * low < HOPFORM_SMALLEST_EXPONENT_real; /* the pair: what is left is monotone */
    const real far = faded ? limit : low + lesser_real(near, half);
    return far > low && far < limit && set->count > 0 ? far : limit;
}

/* That of the first interval: the node, which a pair that hardly draws has not. */
static inline real first_end_real(const event_set_real *set, real limit) {
    const real half = 0.95 * set->node->half_period;
    return lesser_real(lesser_real(set->node->t, half), limit);
}

/* The first interval, by what is known at its end. */
static inline void end_first_interval_real(const event_set_real *set, interval_real *in, real limit) {
    const hopform_node_real *node = set->node;
    if (!HOPFORM_MOVES_ALONE && node->modal < HOPFORM_NEVER_real) {
        end_interval_at_real(set, in, lesser_real(node->modal, limit));
    } else if (node->t < limit) {
        const basis_real basis = {node->Wdd, node->Wd, node->W, node->W1, node->W2};
        in->high = propagator_of_real(set->poles, node->t, &basis);
    } else {
        end_interval_at_real(set, in, first_end_real(set, limit));
    }
}

/* Where the next interval ends, which begins where this one has ended; true if nothing happens in it. */
static inline bool next_end_real(const event_set_real *set, interval_real *in, real limit, real *end) {
    begin_interval_real(set, in);
    const real until = root_free_until_real(set, in);
    const bool quiet = until > in->low.t + 2.0 * set->node->t;
    *end = quiet ? lesser_real(until, limit) : far_end_real(set, in->low.t, limit);
    return quiet && NOTE_real(all_quiet, set->count, in->low.t, *end);
}

/* ---- the first event ---- */

/* The event functions of a phase, and what ends it in closed form. Not in it are the velocity of an element that slips
 * alone, whose time to rest is known, and what cannot happen while the velocities keep their signs. */
typedef struct {
    event_set_real set;
    real rest_time; /* when what slips alone comes to rest, or the contact force, which rings about 0, vanishes */
    int rests;      /* whose event that is */
} stance_events_real;

#if HOPFORM_HAS_NODES
/* Where a phase ends that was solved by its rates: the state, by the axes of the core, how far the position has moved,
 * and the rate of the velocity that has a position. */
typedef struct {
    bool is_known; /* else the propagator says where it ends */
    real z[HOPFORM_AXES];
    real moved;
    real rate, terms; /* and the magnitudes that this is a sum of */
    real stretched;   /* those of the stretch */
} arrival_real;
#endif

/* The event functions of a phase, where their first root is searched, and what was found at the end of the interval. */
typedef struct {
    stance_events_real events;
    interval_real in;
    real limit;     /* the end of the phase: since it began, as all its times */
    bool certified; /* else the first event is not known: the phase is, up to the end of the interval */
    bool stops;     /* the element has met a stop */
    int owner;      /* NO_OWNER where nothing happens until the current changes, or until the horizon */
    int side;       /* of an element that slips: where it goes */
    bool touches;   /* the element that comes to rest is at a stop within rounding */
#if HOPFORM_HAS_NODES
    arrival_real arrival;
#endif
#if HOPFORM_HAS_ALONE
    bool is_alone;    /* one element has slipped alone, and by its own coordinate: */
    alone_real alone; /* the motion where the phase ends */
#endif
} stance_search_real;

/* A search of nothing, before its first phase: a number wherever one is read, so that the proof of it need not follow
 * how many functions each phase has; not zeros, for which compilers call memset. */
static inline void search_nothing_real(const hopform_poles_real *poles, stance_search_real *search) {
    const numerator_real zero = {0.0, 0.0, 0.0};
    const event_function_real nothing = event_function_of_real(&zero, 1.0);
    const jet_real one = {1.0, 0.0, 0.0, 0.0};
    for (int n = 0; n < MOST_EVENT_FUNCTIONS_real; n++) {
        search->events.set.function[n] = nothing;
        search->in.from[n] = one;
    }
    search->in.to = one;
    search->in.high = propagator_at_start_real(poles);
    search->side = 0;
}

/* At the time of the limit the owner that comes first wins over what rests there, and a lost contact over a step of the
 * input. */
static inline void cross_at_the_limit_real(const stance_events_real *events, real limit, interval_real *in) {
    const event_set_real *set = &events->set;
    const int32_t before = events->rest_time > limit ? ELEMENT_real : events->rests;
    for (int32_t n = 0; n < set->count && in->found < 0; n++) {
        const event_function_real *g = &set->function[n];
        in->found = g->owner < before && crosses_at_limit_real(g, &in->high, limit) ? n : -1;
    }
}

/* Whether a distance of this owner is 0 within rounding: a grazing contact with the stop ahead. */
static inline bool is_at_stop_real(const event_set_real *set, int owner, const propagator_real *at) {
    for (int32_t n = 0; n < set->count; n++) {
        const event_function_real *g = &set->function[n];
        if (g->touch_is_no_event && g->owner == owner) {
            return fabs_real(value_at_real(g, at)) <= rounding_of_real(g, at, 0.0);
        }
    }
    return false;
}

/* What ends the phase at the end of its last interval. */
static inline void conclude_real(stance_search_real *search) {
    const stance_events_real *events = &search->events;
    const interval_real *in = &search->in;
    const real limit = search->limit;
    const bool rests = !(events->rest_time > limit) && !(in->high.t < limit * (1.0 - 8.0 * HOPFORM_EPS_real));
    int owner = rests ? events->rests : NO_OWNER_real;
    search->side = 0;
    search->stops = false;
    if (in->found >= 0) {
        const event_function_real *found = &events->set.function[in->found];
        if (owner == NO_OWNER_real || owner >= found->owner) {
            owner = found->owner;
            search->side = found->side;
            search->stops = found->touch_is_no_event;
        }
    }
    search->owner = owner;
    search->touches = owner > CONTACT_real && is_at_stop_real(&events->set, owner, &in->high);
    if (!search->certified) {
        search->in.high = in->low;
        search->owner = NO_OWNER_real;
    }
}

/* Search a phase in which nothing moves: nothing happens until t. */
static inline void search_rest_real(stance_search_real *search, const hopform_poles_real *poles, real t) {
    search->in.high = propagator_at_start_real(poles);
    search->in.high.t = t;
    search->owner = NO_OWNER_real;
    search->stops = false;
    search->touches = false;
    search->certified = true;
}

/* Begin the search of a phase that lasts until `until` at most, for the first root of its event functions, with its
 * first interval; false if an event comes at once. */
static inline bool begin_search_real(stance_search_real *search, real until, evaluations_real *evaluations) {
    const event_set_real *set = &search->events.set;
    interval_real *in = &search->in;
    in->count = 0;
    in->high.omega = 0.0; /* W at first */
    in->evaluations = evaluations;
    use_evaluation_real(in->evaluations); /* a phase costs as much */
    in->found = begin_at_start_real(set, in);
    search->limit = lesser_real(search->events.rest_time, until);
    search->certified = true;
    const bool open = in->found < 0 && search->limit > 0.0;
    if (open) {
        end_first_interval_real(set, in, search->limit);
    } else {
        in->high = propagator_at_start_real(set->poles);
    }
    return open;
}

/* Search the interval, a quiet one for distances alone: it ends at the first root in it, if it has one. True if the
 * search goes on: nothing has happened by its end. */
static inline bool search_interval_real(stance_search_real *search, bool quiet) {
    const event_set_real *set = &search->events.set;
    interval_real *in = &search->in;
    if (quiet) {
        end_at_first_crossing_real(set, in, true);
        search->certified = in->evaluations->left > 0;
    } else {
        search->certified = find_first_root_real(set, in);
        if (!(in->high.t < search->limit)) { cross_at_the_limit_real(&search->events, search->limit, in); }
    }
    return search->certified && in->found < 0 && in->high.t < search->limit;
}

/* The next interval, from where this one has ended; true if it is quiet. */
static inline bool next_interval_real(stance_search_real *search) {
    real end = search->limit;
    const bool quiet = next_end_real(&search->events.set, &search->in, search->limit, &end);
    end_interval_at_real(&search->events.set, &search->in, end);
    return quiet;
}

#endif
