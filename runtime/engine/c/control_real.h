/* SPDX-License-Identifier: MIT-0
 *
 * The current after which the next apex is the desired one, (25)-(27) in their exact form: apex(u) = h_des.
 *
 * apex(u) is analytic where modes and events keep their order, bends where that changes, and jumps or has gaps where
 * the least contact force of a rebound passes zero. The search is branch and bound over intervals between candidate
 * currents. Evaluating a candidate gives its apex, largest position and least contact force, with their slopes; the
 * best admissible one is the incumbent. An interval is pruned when its lower bound does not beat the incumbent. The
 * root comes first: where the ends have the desired apex between them. The proof that nothing smaller or nearer exists
 * comes last. Two bounds are proofs: what a candidate does, and that the driven element, held at both ends of an
 * interval, is held in all of it, because the force on it is linear in u. The others rest on slopes;
 * docs/explanation/controller.md says which.
 */
#ifndef HOPFORM_CONTROL_H_real
#define HOPFORM_CONTROL_H_real

#include "trial_real.h"

#include "reading_real.h"
#include "stance_real.h"

/* Intervals wider than this share of u_max have no bound from their ends: where the events are the same at both, where
 * not, and where neither takes off. */
#define WIDEST_ALIKE_real 0.5
#define WIDEST_UNLIKE_real 0.42
#define WIDEST_DOWN_real 0.0625

/* How far a function may be off the cubic in the middle of an interval, as shares of what its slopes differ by from the
 * chord's: of their sum, and of each; where the events change, of each alone. */
#define MARGIN_CUBIC_real 0.75
#define MARGIN_EACH_real 0.03125
#define MARGIN_KINK_real 1.5

/* An interval at one end of which alone there is a take-off is judged by that end where it is this narrow; by one that
 * is not admissible where it is a quarter of that. */
#define NARROW_JUMP_real 0.00390625

/* A current with which a search begins divides a side of 0 where the desired apex is within this share of it. */
#define NEAR_SHARE_real 0.25

/* A function of u on an interval: values at both ends, slopes times the interval's width, outward from 0; whether it is
 * smooth in between. */
typedef struct {
    real from;
    real from_rise;
    real to;
    real to_rise;
    bool smooth;
} curve_real;

/* The least that the function is taken to be on the interval lies above that of a quartic: of the cubic that the ends
 * determine, its middle coefficient lowered by what the function may be off. These are its Bernstein coefficients. */
enum { COEFFICIENTS_real = 5 };
static void put_coefficients_real(const curve_real *c, real row[COEFFICIENTS_real]) {
    const real first = c->from_rise - (c->to - c->from);
    const real last = c->to_rise - (c->to - c->from);
    const real spread = fabs_real(first) + fabs_real(last);
    const real off =
        c->smooth ? MARGIN_CUBIC_real * fabs_real(first + last) + MARGIN_EACH_real * spread : MARGIN_KINK_real * spread;
    row[0] = c->from;
    row[1] = c->from + 0.25 * c->from_rise;
    row[2] = 0.5 * (c->from + c->to) + (c->from_rise - c->to_rise) / 6.0 - off;
    row[3] = c->to - 0.25 * c->to_rise;
    row[4] = c->to;
}

/* The least coefficient, below which no value of the quartic lies. */
static real least_real(const curve_real *c) {
    real row[COEFFICIENTS_real];
    put_coefficients_real(c, row);
    const real inner = lesser_real(row[1], lesser_real(row[2], row[3]));
    return lesser_real(inner, lesser_real(row[0], row[4]));
}

/* The least coefficient of both halves of the quartic (de Casteljau): nearer to its least value. */
static real least_of_halves_real(const curve_real *c) {
    real row[COEFFICIENTS_real];
    put_coefficients_real(c, row);
    real least = lesser_real(row[0], row[4]);
    UNROLLED_real for (int n = COEFFICIENTS_real - 1; n > 0; n--) {
        UNROLLED_real for (int i = 0; i < n; i++) {
            row[i] = 0.5 * (row[i] + row[i + 1]);
        }
        least = lesser_real(least, lesser_real(row[0], row[n - 1]));
    }
    return least;
}

/* Where the cubic has its minimum, as a share of the interval, kept off its ends; the middle if there is none in it. */
static real share_of_minimum_real(const curve_real *c) {
    const real chord = c->to - c->from;
    const real cubic = c->from_rise + c->to_rise - 2.0 * chord;
    const real half = c->from_rise + cubic - chord;
    const real root = sqrt_real(greater_real(half * half - 3.0 * cubic * c->from_rise, 0.0));
    const real above = half < 0.0 ? -c->from_rise : half + root;
    const real below = half < 0.0 ? root - half : 3.0 * cubic;
    if (!(above > 0.0 && above < below)) { return 0.5; }
    return greater_real(lesser_real(above / below, 0.96875), 0.03125);
}

/* Where the tangents at both ends meet, as a share of the interval: where the function bends, if it does so once. */
static real share_of_bend_real(const curve_real *c) {
    const real turn = c->to_rise - c->from_rise;
    const real share = fabs_real(turn) > 0.0 ? (c->to_rise - (c->to - c->from)) / turn : 0.5;
    return greater_real(lesser_real(share, 0.75), 0.25);
}

/* Where the function vanishes, as a share of the interval: the inverse as a cubic, the chord's where a slope is against
 * it. */
static real share_of_root_real(const curve_real *c) {
    const real chord = c->to - c->from;
    const real t = -c->from / chord;
    if (!(c->from_rise * chord > 0.0 && c->to_rise * chord > 0.0)) { return t; }
    const real begin = lesser_real(chord / c->from_rise, 3.0); /* with which the cubic still rises */
    const real end = lesser_real(chord / c->to_rise, 3.0);
    return t * (begin + t * (3.0 - 2.0 * begin - end + t * (begin + end - 2.0)));
}

/* ---- an interval ---- */

/* An interval between two candidates that stand side by side, and what they say of it. */
typedef struct {
    const hopform_trial_real *from; /* the one nearer to 0 */
    const hopform_trial_real *to;
    real width;         /* its size */
    curve_real gap;     /* how far the apex is off what is wanted, positive at the nearer end */
    curve_real peak;    /* the largest position less its limit; it goes on where a stop is hit */
    curve_real contact; /* the least minimum of the contact force */
} control_interval_real;

static const hopform_trial_real *nearer_end_real(const hopform_search_real *search, int32_t n) {
    return &search->candidates[search->candidates[n + 1].u > 0.0 ? n : n + 1];
}

static control_interval_real interval_of_real(const hopform_search_real *search, int32_t n) {
    const hopform_trial_real *from = nearer_end_real(search, n);
    const hopform_trial_real *to = &search->candidates[n] + (from == &search->candidates[n] ? 1 : 0);
    const real along = to->u - from->u;
    const real side = from->apex > search->apex ? 1.0 : -1.0;
    const bool smooth = from->events == to->events && from->smooth && to->smooth;
    control_interval_real c = {
        from,
        to,
        fabs_real(along),
        {side * (from->apex - search->apex), side * from->apex_u * along, side * (to->apex - search->apex),
         side * to->apex_u * along, smooth},
        {from->largest_x1 - search->limit, from->largest_x1_u * along, to->largest_x1 - search->limit,
         to->largest_x1_u * along, smooth},
        {from->least_contact, from->least_contact_u * along, to->least_contact, to->least_contact_u * along, smooth},
    };
    if (fabs_real(c.gap.to) <= HOPFORM_REACHED_WITHIN_real) {
        c.gap.to = HOPFORM_REACHED_WITHIN_real; /* a far end that reaches it does not count as a root */
    }
    return c;
}

/* Whether the least contact force keeps its sign in an interval, by its value and slope at one end. */
static bool sign_is_constant_real(real value, real rise) {
    return value > 0.0 ? value > fabs_real(rise) : value + rise < 0.0;
}

/* No rebound in the interval takes off that does not do so at its ends, and none stays that takes off there. */
static bool contact_sign_is_constant_real(const control_interval_real *c) {
    const curve_real *contact = &c->contact;
    return c->from->minima > 0 && c->to->minima > 0 ? least_real(contact) > 0.0
                                                    : sign_is_constant_real(contact->from, contact->from_rise)
                                                          && sign_is_constant_real(contact->to, -contact->to_rise);
}

static bool is_admissible_real(const hopform_search_real *search, const hopform_trial_real *trial) {
    return trial->takes_off && trial->largest_x1 < search->limit;
}

/* Slope of the gap over that of the largest position: the multiplier of its limit. */
static real multiplier_real(const control_interval_real *c, bool starts) {
    const real rise = fabs_real(starts ? c->peak.from_rise : c->peak.to_rise);
    return (fabs_real(c->gap.from_rise) + fabs_real(c->gap.to_rise)) / greater_real(rise, HOPFORM_UNDERFLOW_real);
}

/* Lower bound of the gap in a narrow interval in which the apex ends, or jumps: on either side of a take-off like a
 * square root. */
static real bound_at_jump_real(const control_interval_real *c) {
    real bound = HOPFORM_NEVER_real;
    if (c->from->takes_off && c->peak.from - 2.0 * fabs_real(c->peak.from_rise) < 0.0) {
        bound = c->gap.from - 3.0 * fabs_real(c->gap.from_rise);
    }
    if (c->to->takes_off && c->peak.to - 2.0 * fabs_real(c->peak.to_rise) < 0.0) {
        bound = lesser_real(bound, fabs_real(c->gap.to) - 3.0 * fabs_real(c->gap.to_rise));
    }
    return greater_real(bound, 0.0);
}

/* Lower bound of the gap in an interval whose ends take off, without a root between them: of the gap alone, and where
 * the position leaves its limit without a turn, of the gap with that by its multiplier. */
static real bound_of_gap_real(const hopform_search_real *search, const control_interval_real *c) {
    const curve_real *gap = &c->gap;
    const curve_real *peak = &c->peak;
    const bool starts = is_admissible_real(search, c->from);
    real bound = least_of_halves_real(gap);
    if (starts != is_admissible_real(search, c->to) && least_real(peak) >= lesser_real(peak->from, peak->to)) {
        const real weight = 2.0 * multiplier_real(c, starts);
        const curve_real both = {gap->from + weight * peak->from, gap->from_rise + weight * peak->from_rise,
                                 gap->to + weight * peak->to, gap->to_rise + weight * peak->to_rise, gap->smooth};
        bound = greater_real(bound, least_of_halves_real(&both));
    }
    return greater_real(bound, 0.0);
}

/* Whether a mass takes more to be moved than to be kept moving: then the apex may jump where one just slips, or sticks
 * as its velocity touches 0. Each changes the order of events. */
static bool jumps_between_real(const hopform_search_real *search, const control_interval_real *c) {
    const hopform_robot_real *robot = &search->plan->robot;
    bool excess = false;
    for (int element = 0; element < HOPFORM_ELEMENTS; element++) {
        excess =
            excess || excess_to_side_real(robot, element, 1) > 0.0 || excess_to_side_real(robot, element, -1) > 0.0;
    }
    return excess && c->from->events != c->to->events;
}

/* Lower bound of the gap of any admissible current in the interval, from its ends; NEVER if there is none in it, less
 * than 0 where the gap changes its sign. */
static real lower_bound_of_real(const hopform_search_real *search, const control_interval_real *c) {
    const real range = current_limit_real(&search->plan->robot);
    const bool alike = c->from->takes_off == c->to->takes_off;
    const bool none = alike && !c->from->takes_off;
    const real unknown = alike && !none && c->gap.to < 0.0 ? -1.0 : 0.0;
    if ((c->from->held && c->to->held) || c->width <= 2.0 * HOPFORM_EPS_real * fabs_real(c->to->u)) {
        return HOPFORM_NEVER_real;
    }
    const real widest = none ? WIDEST_DOWN_real : (c->gap.smooth ? WIDEST_ALIKE_real : WIDEST_UNLIKE_real);
    if (c->width > widest * range) { return unknown; }
    if (jumps_between_real(search, c)) {
        const real bound = c->width <= NARROW_JUMP_real * range ? bound_at_jump_real(c) : 0.0;
        return bound > 0.0 ? bound : unknown;
    }
    if (!alike || !contact_sign_is_constant_real(c)) {
        const bool judges = is_admissible_real(search, c->from) || is_admissible_real(search, c->to);
        const real jump = judges ? NARROW_JUMP_real : 0.25 * NARROW_JUMP_real;
        const real narrow = none ? HOPFORM_ROOT_EPS_real : jump;
        return c->width <= narrow * range ? bound_at_jump_real(c) : unknown;
    }
    if (none || (c->peak.from >= 0.0 && c->peak.to >= 0.0 && least_real(&c->peak) >= 0.0)) {
        return HOPFORM_NEVER_real;
    }
    return unknown < 0.0 ? unknown : bound_of_gap_real(search, c);
}

/* Newton's step into the interval, from an end; 1 if it leaves that. */
static real step_to_zero_real(real value, real rise) {
    return value * rise > 0.0 && fabs_real(value) < fabs_real(rise) ? value / rise : 1.0;
}

/* The root of the gap that both ends predict, as a share. The velocity at take-off is nearly linear in u, where the
 * order of events stays, and so is the root of its height. */
static real share_of_apex_real(const hopform_search_real *search, const control_interval_real *c) {
    const real wanted = sqrt_real(search->apex);
    const real from = sqrt_real(greater_real(c->from->apex, 0.0));
    const real to = sqrt_real(greater_real(c->to->apex, 0.0));
    const real along = c->to->u - c->from->u;
    if (!(from > 0.0 && to > 0.0 && fabs_real(to - from) > 0.0)) { /* large ones may have the same root */
        return share_of_root_real(&c->gap);
    }
    const curve_real root = {from - wanted, 0.5 * c->from->apex_u / from * along, to - wanted,
                             0.5 * c->to->apex_u / to * along, c->gap.smooth};
    if (root.smooth && root.from_rise * root.to_rise > 0.0) { return share_of_root_real(&root); }
    const real after = step_to_zero_real(-root.from, root.from_rise);
    const real before = step_to_zero_real(root.to, root.to_rise);
    if (before < 1.0 && !(after < before)) { return 1.0 - before; }
    return after < 1.0 ? after : -root.from / (root.to - root.from);
}

/* Where to split an interval, as a share of it; `slow` in the middle. */
static real share_to_try_real(const hopform_search_real *search, const control_interval_real *c, bool slow) {
    const bool leaves = c->from->takes_off;
    if (slow || leaves != c->to->takes_off) { return 0.5; }
    if (leaves && c->gap.to < 0.0) { return share_of_apex_real(search, c); }
    if (c->width > WIDEST_ALIKE_real * current_limit_real(&search->plan->robot)) { return 0.5; }
    if (!leaves) { return c->from->minima > 0 && c->to->minima > 0 ? share_of_minimum_real(&c->contact) : 0.5; }
    const bool starts = is_admissible_real(search, c->from);
    if (starts != is_admissible_real(search, c->to)) { /* just inside the limit of the position */
        curve_real peak = c->peak;
        const real inside = 0.25 * HOPFORM_NEAR_WITHIN_real / multiplier_real(c, starts);
        peak.from += inside;
        peak.to += inside;
        return share_of_root_real(&peak);
    }
    return c->gap.smooth ? share_of_minimum_real(starts ? &c->gap : &c->peak) : share_of_bend_real(&c->gap);
}

/* ---- the search ---- */

/* Sides of 0 that are yet to be opened. */
enum { LOWER_SIDE_real = -1, UPPER_SIDE_real = 1, BOTH_SIDES_real = 2 };

/* A better candidate has a gap that is smaller than this. */
static real gap_of_best_real(const hopform_search_real *search) {
    return search->found ? fabs_real(search->best_apex - search->apex) : HOPFORM_NEVER_real;
}

static void update_incumbent_real(hopform_search_real *search, const hopform_trial_real *trial) {
    const real gap = fabs_real(trial->apex - search->apex);
    const bool reaches = gap <= HOPFORM_REACHED_WITHIN_real;
    const bool better = search->reached ? reaches && fabs_real(trial->u) < fabs_real(search->best_u)
                                        : reaches || gap < gap_of_best_real(search);
    if (is_admissible_real(search, trial) && better) {
        search->best_u = trial->u;
        search->best_apex = trial->apex;
        search->found = true;
        search->reached = reaches;
    }
}

/* Whether a better candidate may lie in an interval. */
static bool may_improve_real(const hopform_search_real *search, int32_t n) {
    const real bound = search->lower_bound[n];
    if (search->reached) {
        return fabs_real(nearer_end_real(search, n)->u) < fabs_real(search->best_u)
               && bound < HOPFORM_REACHED_WITHIN_real;
    }
    const real gap = gap_of_best_real(search) - 2.0 * HOPFORM_NEAR_WITHIN_real;
    return bound < HOPFORM_NEVER_real && bound <= greater_real(gap, 0.0);
}

/* Move a candidate and the interval behind it. */
static void move_real(hopform_search_real *search, int32_t to, int32_t from) {
    const hopform_trial_real moved = search->candidates[from];
    search->candidates[to] = moved;
    search->lower_bound[to] = search->lower_bound[from];
    search->slow[to] = search->slow[from];
}

/* Drop a candidate; the two intervals that it has ended become one. */
static void forget_real(hopform_search_real *search, int32_t n) {
    if (n > 0 && n < HOPFORM_SEARCH_CANDIDATES_real) {
        search->lower_bound[n - 1] = lesser_real(search->lower_bound[n - 1], search->lower_bound[n]);
        search->slow[n - 1] = 2;
    }
    search->count--;
    for (int32_t i = n; i < search->count; i++) {
        move_real(search, i, i + 1);
    }
}

/* Where memory is full, forget the candidate farthest from 0: it may be tried again, when those before it are done. */
static void make_room_real(hopform_search_real *search) {
    int32_t worst = 1;
    for (int32_t n = 2; n + 1 < search->count; n++) {
        worst = fabs_real(search->candidates[n].u) > fabs_real(search->candidates[worst].u) ? n : worst;
    }
    forget_real(search, worst);
}

/* Whether a current has been tried beside 0 before a side was opened. It is the outermost candidate of that side. */
static bool has_begun_near_real(const hopform_search_real *search) {
    return search->sides == BOTH_SIDES_real && search->count > 1;
}

/* Where the desired apex is from a candidate on, by its derivative, as a share of its current: positive beyond it. */
static real share_to_apex_real(const hopform_search_real *search, const hopform_trial_real *trial) {
    const real from = sqrt_real(greater_real(trial->apex, 0.0));
    const real rise = trial->apex_u * trial->u;
    return fabs_real(rise) > 0.0 ? 2.0 * from * (sqrt_real(search->apex) - from) / rise : HOPFORM_NEVER_real;
}

/* Behind the current with which the search began and 0 comes where the slope there puts the desired apex, and as much
 * farther that the interval that is left beside the root is not lost in rounding. */
static bool goes_beyond_real(hopform_search_real *search) {
    if (search->trials != 2 || search->reached || !has_begun_near_real(search)) { return false; }
    const hopform_trial_real *begun = &search->candidates[search->candidates[0].u < 0.0 ? 0 : 1];
    const real share = share_to_apex_real(search, begun);
    const real further = 4.0 * HOPFORM_ROOT_EPS_real;
    search->next = begun->u * (1.0 + (share < 0.0 ? share - further : share + further));
    return fabs_real(search->next) < current_limit_real(&search->plan->robot);
}

/* The next side of 0, of which the limit is tried first; false if there is none. A current that pushes the driven
 * element harder onto the stop on which 0 leaves it holds it there as well: that side is not tried. */
static bool open_side_real(hopform_search_real *search) {
    const hopform_robot_real *robot = &search->plan->robot;
    const real position = search->start.x1;
    while (search->sides != 0) {
        const bool near = has_begun_near_real(search);
        const bool up = near ? !(search->candidates[0].u < 0.0) : search->sides > 0;
        const real sign = up ? 1.0 : -1.0;
        const real push = search->plan->rates[0].a1_u * sign;
        const bool has_room =
            (push > 0.0 && position < upper_stop_real(robot)) || (push < 0.0 && position > lower_stop_real(robot));
        search->sides = search->sides != BOTH_SIDES_real ? 0 : (up ? LOWER_SIDE_real : UPPER_SIDE_real);
        if ((!search->held || has_room) && !(near && search->reached)) { /* beyond it no current is less */
            search->next = sign * (search->reached ? fabs_real(search->best_u) : current_limit_real(robot));
            return true;
        }
    }
    return false;
}

/* Whether an interval is branched before another: of the lesser lower bound, of several the one nearer to 0. Where
 * memory is full that alone counts: what lies before it is done then, and nothing that is done is forgotten. */
static bool comes_first_real(const hopform_search_real *search, int32_t n, int32_t other) {
    const real bound = search->lower_bound[n];
    const real least = search->lower_bound[other];
    const bool is_nearer = fabs_real(nearer_end_real(search, n)->u) < fabs_real(nearer_end_real(search, other)->u);
    const bool is_full = search->count == HOPFORM_SEARCH_CANDIDATES_real;
    return (!is_full && bound < least) || ((is_full || !(bound > least)) && is_nearer);
}

/* Prune, then branch: choose the next candidate, in the interval of the least lower bound, of several in that nearest
 * to 0. One in which the gap changes its sign comes first; a side of 0 is opened before others. False if nothing is
 * left. */
static bool branch_real(hopform_search_real *search) {
    int32_t first = -1;
    bool open = false; /* the interval below */
    for (int32_t n = 0; n < search->count;) {
        bool improves = false;
        if (n + 1 < search->count && may_improve_real(search, n)) {
            improves = true;
            first = first < 0 || comes_first_real(search, n, first) ? n : first;
        } else {
            search->lower_bound[n] = HOPFORM_NEVER_real;
        }
        const bool is_zero = !(fabs_real(search->candidates[n].u) > 0.0);
        const bool is_last = has_begun_near_real(search) && (n == 0 || n + 1 == search->count);
        if (improves || open || (search->sides != 0 && is_zero) || is_last) {
            open = improves;
            n++;
        } else {
            forget_real(search, n);
        }
    }
    const bool waits = first >= 0 && (search->reached || search->lower_bound[first] < 0.0);
    if (!waits && open_side_real(search)) { return true; }
    if (first < 0) { return false; }
    const control_interval_real c = interval_of_real(search, first);
    const real along = c.to->u - c.from->u;
    const real share = share_to_try_real(search, &c, search->slow[first] >= 2);
    search->next = c.from->u + share * along;
    if (!(share > 0.0 && fabs_real(search->next) > fabs_real(c.from->u)
          && fabs_real(search->next) < fabs_real(c.to->u))) {
        search->next = c.from->u + 0.5 * along;
    }
    return true;
}

/* Whether another current than 0 may do anything, and be admissible. */
static bool has_choice_real(const hopform_search_real *search) {
    const hopform_robot_real *robot = &search->plan->robot;
    return current_limit_real(robot) > 0.0 && lower_stop_real(robot) < upper_stop_real(robot)
           && search->start.x1 < search->limit;
}

/* Add an evaluated candidate, which splits its interval, and choose the next one. */
static bool add_candidate_real(hopform_search_real *search, const hopform_trial_real *trial) {
    update_incumbent_real(search, trial);
    if (search->trials < HOPFORM_SEARCH_TRIALS) { search->trials++; }
    const bool is_zero = !(fabs_real(trial->u) > 0.0);
    if (search->trials == 1 && !is_zero) {
        search->next = 0.0;
        if (!(trial->takes_off && fabs_real(share_to_apex_real(search, trial)) < NEAR_SHARE_real)) { return true; }
    }
    if (is_zero) {
        if ((search->reached && !(fabs_real(search->best_u) > 0.0)) || !has_choice_real(search)) { return false; }
        search->held = trial->held;
    }
    if (search->count < 0 || search->count > HOPFORM_SEARCH_CANDIDATES_real) {
        return false; /* memory in which no search was begun */
    }
    if (search->count == HOPFORM_SEARCH_CANDIDATES_real) { make_room_real(search); }
    int32_t n = search->count++;
    for (; n > 0 && search->candidates[n - 1].u > trial->u; n--) {
        move_real(search, n, n - 1);
    }
    search->candidates[n] = *trial;
    int8_t slow[] = {0, 0}; /* of the intervals below and above */
    if (n > 0 && n + 1 < search->count) {
        const hopform_trial_real *at = &search->candidates[n];
        const real least = lesser_real(fabs_real(at[-1].apex - search->apex), fabs_real(at[1].apex - search->apex));
        if (!(trial->takes_off && fabs_real(trial->apex - search->apex) < 0.25 * least)) {
            const int wider = at->u - at[-1].u > at[1].u - at->u ? 0 : 1;
            slow[wider] = search->slow[n - 1] < 2 ? (int8_t)(search->slow[n - 1] + 1) : (int8_t)2;
        }
    }
    for (int32_t i = n > 0 ? n - 1 : 0; i <= n && i + 1 < search->count; i++) {
        const control_interval_real c = interval_of_real(search, i);
        search->lower_bound[i] = lower_bound_of_real(search, &c);
        search->slow[i] = slow[i < n ? 0 : 1];
    }
    return (search->trials == 1 && !is_zero) || goes_beyond_real(search) || branch_real(search);
}

static void report_command_real(const hopform_search_real *search, hopform_command_real *command) {
    const bool reaches = gap_of_best_real(search) <= HOPFORM_NEAR_WITHIN_real;
    command->u = search->best_u;
    command->apex = search->found ? search->best_apex - search->datum : 0.0;
    command->status =
        reaches ? HOPFORM_COMMAND_REACHED : (search->found ? HOPFORM_COMMAND_NEAREST : HOPFORM_COMMAND_NO_TAKEOFF);
}

/* ---- a current ---- */

/* A candidate; HOPFORM_PHASES_NOT_KEPT where its stance outgrows the memory, HOPFORM_CAPPED where it takes more
 * evaluations, or an error. */
static int32_t evaluate_candidate_real(const hopform_plan_real *plan, const hopform_state_real *start, real u,
                                       real horizon, hopform_phase_real *phases, int32_t capacity, int32_t most,
                                       hopform_trial_real *trial) {
    const hopform_step_real step = {0.0, u};
    const state_by_axis_real none = {{0.0, 0.0, 0.0, 0.0}};
    const hopform_trial_real nothing = {0};
    *trial = nothing;
    trial->u = u;
    trial->largest_x1 = start->x1;
    trial->least_contact = HOPFORM_NEVER_real;
    trial->smooth = true;
    evaluations_real evaluations = {most};
    current_variation_real variation = {plan, trial, &evaluations, none, none, none, NULL, false, 0.0};
    hopform_stance_real stance;
    const int32_t status = solve_observed_real(plan, start, &step, 1, horizon, capacity, phases, capacity, &stance,
                                               &evaluations, carry_variation_real, &variation);
    if (status < 0) { return status; }
    close_trial_real(&variation, phases, &stance);
    if (!(evaluations.left > 0)) {
        trial->takes_off = false; /* what is not known of it is not admitted */
        trial->apex = 0.0;
        trial->apex_u = 0.0;
        return HOPFORM_CAPPED;
    }
    return stance.ending == HOPFORM_ENDING_TOO_MANY_PHASES ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK;
}

/* ---- what users call ---- */

static const hopform_command_real no_current_real = {0.0, 0.0, HOPFORM_COMMAND_NO_TAKEOFF};

/* End a search: from now on a step of it commands u = 0 and returns the status. NULL for what is not to be written. */
static int32_t end_search_real(hopform_search_real *search, int32_t status, hopform_command_real *command) {
    if (search != NULL) {
        search->status = status;
        search->best_u = 0.0;
        search->found = false;
        search->apex = 0.0;
        search->datum = 0.0;
    }
    if (command != NULL) { *command = no_current_real; }
    return status;
}

/* Begin to look for the current in [-u_max, u_max] after which the next apex is nearest to h_des, the least |u| if
 * several reach it. Admissible are currents with a take-off and x_1 < x1_max - stop_margin throughout (any if the
 * actuator is locked).
 *
 * start: state after the impact, y = 0 at touchdown. command: u = 0 for the time being. The plan is read by every step.
 */
int32_t hopform_choose_current_begin_real(hopform_search_real *search, const hopform_plan_real *plan,
                                          const hopform_state_real *start, const hopform_target_real *target,
                                          hopform_command_real *command) {
    const memory_real read = array_real(plan, 1, sizeof *plan);
    const memory_real written[2] = {
        array_real(search, 1, sizeof *search),
        array_real(command, 1, sizeof *command),
    };
    if (overlap_real(written, 2, &read, 1)) {
        return end_search_real(overlap_real(&written[0], 1, &read, 1) ? NULL : search, HOPFORM_ERROR_OVERLAP,
                               overlap_real(&written[1], 1, &read, 1) ? NULL : command);
    }
    if (search == NULL || plan == NULL || start == NULL || target == NULL || command == NULL) {
        return end_search_real(search, HOPFORM_ERROR_NULL, command);
    }
    const hopform_state_real from = *start; /* start and target may lie in what is written */
    const hopform_target_real wanted = *target;
    (void)end_search_real(search, HOPFORM_SEARCHING, command);
    const hopform_robot_real *robot = &plan->robot;
    if (!hops_real(plan) || !(current_limit_real(robot) <= HOPFORM_NEVER_real)) {
        search->status = HOPFORM_ERROR_ROBOT;
    } else if (!is_finite_real(wanted.h_des) || !is_finite_real(wanted.datum) || !(wanted.h_des + wanted.datum >= 0.0)
               || !(wanted.stop_margin >= 0.0 && wanted.stop_margin <= HOPFORM_NEVER_real) || wanted.max_evaluations < 0
               || wanted.max_candidates < 0) {
        search->status = HOPFORM_ERROR_TARGET;
    } else if (!(wanted.horizon > 0.0 && wanted.horizon <= HOPFORM_NEVER_real)) {
        search->status = HOPFORM_ERROR_HORIZON;
    }
    const bool locked = !(lower_stop_real(robot) < upper_stop_real(robot));
    search->plan = plan;
    search->start = from;
    search->apex = wanted.h_des + wanted.datum;
    search->datum = wanted.datum;
    search->limit = locked ? HOPFORM_NEVER_real : upper_stop_real(robot) - wanted.stop_margin - 16.0 * HOPFORM_EPS_real;
    search->horizon = wanted.horizon;
    search->count = 0;
    search->sides = BOTH_SIDES_real;
    search->next = 0.0;
    search->trials = 0;
    search->reached = false;
    search->max_evaluations = wanted.max_evaluations > 0 ? wanted.max_evaluations : HOPFORM_CANDIDATE_EVALUATIONS;
    const bool fewer = wanted.max_candidates > 0 && wanted.max_candidates < HOPFORM_SEARCH_TRIALS;
    search->max_candidates = fewer ? wanted.max_candidates : HOPFORM_SEARCH_TRIALS;
    search->partial = false;
    search->capped = false;
    return search->status;
}

/* Of a search that has begun: try this current before any other. Where it was the last command, which reached its wish,
 * and state and wish have changed little since, the search takes fewer stances. The command does not depend on it, but
 * within what counts as reached, or as nearest. One that is not within u_max, and any after a step, changes nothing.
 */
int32_t hopform_choose_current_near_real(hopform_search_real *search, real u) {
    if (search == NULL) { return HOPFORM_ERROR_NULL; }
    if (search->status == HOPFORM_SEARCHING && search->plan != NULL && search->trials == 0 && has_choice_real(search)
        && fabs_real(u) < current_limit_real(&search->plan->robot)) {
        search->next = u;
    }
    return search->status;
}

/* Solve one stance more, in the caller's buffer of phases. HOPFORM_SEARCHING while there is more to do; command is the
 * best admissible one so far. In the end HOPFORM_CAPPED if a cap of the target was met, HOPFORM_PHASES_NOT_KEPT if a
 * stance had more phases than fit: such stances are left out. A refusal ends the search.
 */
int32_t hopform_choose_current_step_real(hopform_search_real *search, hopform_phase_real *phases, int32_t capacity,
                                         hopform_command_real *command) {
    if (search == NULL) { return end_search_real(NULL, HOPFORM_ERROR_NULL, command); }
    const memory_real read[2] = {
        array_real(search, 1, sizeof *search),
        array_real(search->plan, 1, search->status == HOPFORM_SEARCHING ? sizeof *search->plan : 0),
    };
    const memory_real written[2] = {
        array_real(phases, capacity, sizeof *phases),
        array_real(command, 1, sizeof *command),
    };
    if (overlap_real(written, 2, read, 2)) {
        return end_search_real(search, HOPFORM_ERROR_OVERLAP, overlap_real(&written[1], 1, read, 2) ? NULL : command);
    }
    if (phases == NULL || command == NULL) { return end_search_real(search, HOPFORM_ERROR_NULL, command); }
    if (!HOPFORM_HAS_CONTACT || search->status != HOPFORM_SEARCHING || search->plan == NULL) {
        report_command_real(search, command);
        return search->status;
    }
    hopform_trial_real trial;
    const int32_t status = evaluate_candidate_real(search->plan, &search->start, search->next, search->horizon, phases,
                                                   capacity, search->max_evaluations, &trial);
    if (status < 0) {
        return end_search_real(search, status, command); /* for good: what was found does not count after an error */
    }
    search->partial = search->partial || status == HOPFORM_PHASES_NOT_KEPT;
    search->capped = search->capped || status == HOPFORM_CAPPED;
    const bool goes_on = add_candidate_real(search, &trial);
    if (goes_on && search->trials >= search->max_candidates) {
        search->status = HOPFORM_CAPPED;
    } else if (!goes_on) {
        const int32_t kept = search->partial ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK;
        search->status = search->capped ? HOPFORM_CAPPED : kept;
    }
    report_command_real(search, command);
    return search->status;
}

/* Both, up to the end. */
int32_t hopform_choose_current_real(hopform_search_real *search, const hopform_plan_real *plan,
                                    const hopform_state_real *start, const hopform_target_real *target,
                                    hopform_phase_real *phases, int32_t capacity, hopform_command_real *command) {
    int32_t status = hopform_choose_current_begin_real(search, plan, start, target, command);
    while (status == HOPFORM_SEARCHING) { /* max_candidates times at most */
        status = hopform_choose_current_step_real(search, phases, capacity, command);
    }
    return status;
}

/* Try each of some currents from each of some states; trials, state by state, current by current. A stance with more
 * phases than fit into the buffer counts as one without take-off. */
int32_t hopform_try_currents_real(const hopform_plan_real *plan, const hopform_state_real *starts, int32_t start_count,
                                  const real *currents, int32_t current_count, real horizon, hopform_phase_real *phases,
                                  int32_t capacity, hopform_trial_real *trials) {
    const size_t row = current_count > 0 ? (size_t)current_count * sizeof *trials : 0;
    const memory_real read[3] = {
        array_real(plan, 1, sizeof *plan),
        array_real(starts, start_count, sizeof *starts),
        array_real(currents, current_count, sizeof *currents),
    };
    const memory_real written[2] = {
        array_real(trials, start_count, row),
        array_real(phases, capacity, sizeof *phases),
    };
    if (plan == NULL || starts == NULL || currents == NULL || phases == NULL || trials == NULL) {
        return refuse_real(HOPFORM_ERROR_NULL, written, 1, read, 3);
    }
    if (overlap_real(written, 2, read, 3)) { return refuse_real(HOPFORM_ERROR_OVERLAP, written, 1, read, 3); }
    if (!hops_real(plan)) { return refuse_real(HOPFORM_ERROR_ROBOT, written, 1, read, 3); }
    int32_t kept = HOPFORM_OK;
    for (int32_t i = 0; i < start_count; i++) {
        for (int32_t j = 0; j < current_count; j++) {
            const int32_t status = evaluate_candidate_real(plan, &starts[i], currents[j], horizon, phases, capacity,
                                                           UNBOUNDED_real, &trials[i * current_count + j]);
            if (status < 0) { return refuse_real(status, written, 1, read, 3); }
            kept = status != HOPFORM_OK ? status : kept;
        }
    }
    return kept;
}

/* ---- the largest compression, which shares the search for minima ---- */

/* The largest compression in a phase that lasts for t: at its start, or inside where its rate may change its sign. */
static real most_in_phase_real(const hopform_plan_real *plan, const hopform_phase_real *phase, real u, real t) {
    const row_real mode = mode_of_phase_real(phase);
    const real first = phase->y;
    if (!stretch_may_turn_real(mode) || !(t > 0.0)) { return first; }
    const course_real course = course_of_phase_real(plan, phase, u);
    const numerator_real *h = &course.numerators.of.stretch;
    const numerator_real extension = {-h->H3, -h->H2, -h->H1};
    const event_function_real g = event_function_of_real(&extension, -first);
    const propagator_real end = propagator_at_real(course.poles, t);
    const jet_real from = jet_at_start_real(course.poles, &g);
    const jet_real to = jet_at_real(course.poles, &g, &end);
    evaluations_real evaluations = {UNBOUNDED_real};
    const minima_real least = least_minimum_real(course.poles, timescales_of_real(plan, mode), &extension, &from, &to,
                                                 t, 65536.0, &evaluations);
    return greater_real(first, -least.value);
}

/* The largest compression of the leg in a solved stance [m], to be compared with its travel; 0 if it is refused. */
int32_t hopform_stance_compression_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                        const hopform_phase_real *phases, const hopform_stance_real *stance,
                                        real *compression_max) {
    const memory_real array = array_real(compression_max, 1, sizeof *compression_max);
    const int32_t status = reading_status_real(plan, steps, phases, stance, NULL, NULL, &array, 1);
    if (status < 0) { return status; }
    real most = stance->end.y;
    for (int32_t n = 0; n < stance->phases_kept; n++) {
        const real until = n + 1 < stance->phases_kept ? phases[n + 1].t : stance->duration;
        const real u = input_of_phase_real(plan, steps, &phases[n]);
        most = greater_real(most, most_in_phase_real(plan, &phases[n], u, until - phases[n].t));
    }
    *compression_max = most;
    return HOPFORM_OK;
}

#endif
