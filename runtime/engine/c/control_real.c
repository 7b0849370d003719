/* SPDX-License-Identifier: MIT-0
 *
 * The current after which the next apex is the desired one, (25)-(27) in their exact form: apex(u) = h_des.
 *
 * apex(u) is analytic where modes and events keep their order, bends where that changes, and jumps or has gaps where
 * the least contact force of a rebound passes zero. The search is branch and bound over intervals between candidate
 * currents. Evaluating a candidate gives its apex, largest x_1 and least contact force, with their slopes; the best
 * admissible one is the incumbent. An interval is pruned when its lower bound does not beat the incumbent; else it is
 * branched at the predicted root, extremum or limit, or in the middle. Two bounds are proofs: what a candidate does,
 * and that an actuator held at both ends of an interval is held in all of it, because the force on it is linear in u.
 * The others rest on slopes; docs/explanation/controller.md says which.
 */
#include "trial_real.h"

/* Intervals wider than this share of u_max have no bound from their ends: where the events are the same at both, and
 * where not. */
#define CONTROL_WIDE_real 0.5
#define COARSE_real 0.25
#define DOWN_real 0.0625

/* How far a slope may be off the cubic's, as a share of what the cubic's slopes differ by: of their sum, and of each.
 */
#define LEAN_real 0.25
#define BEND_real 0.03125

/* Where the events change: how much slopes may differ where the function still rises throughout, and how deep its
 * minimum may lie. */
#define KINK_real 0.5
#define DEPTH_real 1.0
#define STEP_real 0.00390625
#define EDGE_real 0.015625

/* A function of u on an interval, outward from 0: values and slopes at both ends; whether it is smooth in between. */
typedef struct {
    real from;
    real from_rate;
    real to;
    real to_rate;
    real width;
    bool smooth;
} curve_real;

/* ---- bounds from values and slopes at both ends ---- */

static real chord_real(const curve_real *c)
{
    return (c->to - c->from) / c->width;
}

/* How much the slopes differ from the chord's. */
static real spread_real(const curve_real *c)
{
    return fabs_real(c->from_rate - chord_real(c)) + fabs_real(c->to_rate - chord_real(c));
}

/* The slopes' sum less twice the chord's: 0 for a parabola. */
static real lean_real(const curve_real *c)
{
    return c->from_rate + c->to_rate - 2.0 * chord_real(c);
}

/* How far a slope in the interval may be off that of the cubic which the ends determine. */
static real slope_error_real(const curve_real *c)
{
    return LEAN_real * fabs_real(lean_real(c)) + BEND_real * spread_real(c);
}

/* The least slope of that cubic. */
static real least_slope_real(const curve_real *c)
{
    const real end = hopform_lesser_real(c->from_rate, c->to_rate);
    const real half = c->from_rate + lean_real(c) - chord_real(c);
    if (lean_real(c) > 0.0 && half > 0.0 && half < 3.0 * lean_real(c)) {
        const real inside = c->from_rate - half * half / (3.0 * lean_real(c));
        return hopform_lesser_real(inside, end);
    }
    return end;
}

static bool rises_real(const curve_real *c)
{
    if (c->smooth) {
        return least_slope_real(c) > 4.0 * slope_error_real(c);
    }
    const real end = hopform_lesser_real(c->from_rate, c->to_rate);
    return end > 0.0 && chord_real(c) > 0.0 && spread_real(c) <= KINK_real * end;
}

static curve_real mirrored_real(const curve_real *c)
{
    const curve_real other = {-c->from, -c->from_rate, -c->to, -c->to_rate, c->width, c->smooth};
    return other;
}

static bool is_monotone_real(const curve_real *c)
{
    const curve_real other = mirrored_real(c);
    return rises_real(c) || rises_real(&other);
}

/* Whether the slope rises throughout. */
static bool is_convex_real(const curve_real *c)
{
    const real from = lean_real(c) + c->from_rate - chord_real(c);
    const real to = lean_real(c) + c->to_rate - chord_real(c);
    return -from > 4.0 * slope_error_real(c) && to > 4.0 * slope_error_real(c);
}

/* Where the cubic has its minimum, as a share of the interval; -1 if there is none in it. */
static real share_of_minimum_real(const curve_real *c)
{
    const real half = c->from_rate + lean_real(c) - chord_real(c);
    const real radicand = half * half - 3.0 * lean_real(c) * c->from_rate;
    if (!(radicand > 0.0)) {
        return -1.0;
    }
    const real root = sqrt_real(radicand);
    if (half >= 0.0 && !(fabs_real(lean_real(c)) > 0.0)) {
        return -1.0; /* the parabola falls for good */
    }
    const real share = half < 0.0 ? c->from_rate / (half - root) : (half + root) / (3.0 * lean_real(c));
    return share > 0.0 && share < 1.0 ? share : -1.0;
}

static real cubic_at_real(const curve_real *c, real share)
{
    const real rest = 1.0 - share;
    const real bend = (c->from_rate - chord_real(c)) * rest - (c->to_rate - chord_real(c)) * share;
    return c->from + c->width * share * (chord_real(c) + rest * bend);
}

/* The least that the function is taken to be on the interval. */
static real least_real(const curve_real *c)
{
    const real end = hopform_lesser_real(c->from, c->to);
    if (is_monotone_real(c)) {
        return end;
    }
    if (!c->smooth) {
        return end - DEPTH_real * c->width * spread_real(c);
    }
    if (is_convex_real(c)) {
        const real share = (c->to_rate - chord_real(c)) / (c->to_rate - c->from_rate);
        return c->from_rate < 0.0 && c->to_rate > 0.0 ? c->from + c->width * c->from_rate * share : end;
    }
    const real share = share_of_minimum_real(c);
    const real inside = share > 0.0 ? cubic_at_real(c, share) : end;
    return hopform_lesser_real(inside, end) - c->width * slope_error_real(c);
}

/* Where the function vanishes, as a share of the interval: the inverse as a cubic, the chord's where a slope is against
 * it.
 */
static real share_of_root_real(const curve_real *c)
{
    const real t = c->from / (c->from - c->to);
    if (!(c->from_rate * chord_real(c) > 0.0 && c->to_rate * chord_real(c) > 0.0)) {
        return t;
    }
    const real first = chord_real(c) / c->from_rate;
    const real last = chord_real(c) / c->to_rate;
    const real begin = hopform_lesser_real(first, 3.0); /* with which the cubic still rises */
    const real end = hopform_lesser_real(last, 3.0);
    return t * (begin + t * (3.0 - 2.0 * begin - end + t * (begin + end - 2.0)));
}

/* ---- an interval ---- */

static real width_of_real(const hopform_interval_real *c)
{
    return fabs_real(c->to.u - c->from.u);
}

static bool is_smooth_real(const hopform_interval_real *c)
{
    return c->from.events == c->to.events && c->from.smooth && c->to.smooth;
}

static curve_real curve_of_real(const hopform_interval_real *c, real from, real from_u, real to, real to_u)
{
    const real sign = c->to.u > c->from.u ? 1.0 : -1.0;
    const curve_real made = {from, sign * from_u, to, sign * to_u, width_of_real(c), is_smooth_real(c)};
    return made;
}

/* The apex less what is wanted; an end that reaches it counts as being on the side of the other one. */
static curve_real gap_of_real(const hopform_interval_real *c, real wanted)
{
    curve_real gap = curve_of_real(c, c->from.apex - wanted, c->from.apex_u, c->to.apex - wanted, c->to.apex_u);
    if (fabs_real(gap.to) <= HOPFORM_REACHED_WITHIN_real) {
        gap.to = gap.from > 0.0 ? HOPFORM_REACHED_WITHIN_real : -HOPFORM_REACHED_WITHIN_real;
    } else if (fabs_real(gap.from) <= HOPFORM_REACHED_WITHIN_real) {
        gap.from = gap.to > 0.0 ? HOPFORM_REACHED_WITHIN_real : -HOPFORM_REACHED_WITHIN_real;
    }
    return gap;
}

/* The largest x_1 less its limit; it goes on where x_1 is stopped. */
static curve_real peak_of_real(const hopform_interval_real *c, real limit)
{
    return curve_of_real(c, c->from.largest_x1 - limit, c->from.largest_x1_u, c->to.largest_x1 - limit,
                         c->to.largest_x1_u);
}

/* No rebound in the interval takes off that does not do so at its ends: the least contact force of each
 * stays above zero. */
static bool minima_are_positive_real(const hopform_interval_real *c)
{
    const bool in_from = c->from.minima > 0;
    const bool in_to = c->to.minima > 0;
    if (!in_from && !in_to) {
        return true;
    }
    if (in_from && in_to) {
        const curve_real least = curve_of_real(c, c->from.least_contact, c->from.least_contact_u, c->to.least_contact,
                                               c->to.least_contact_u);
        return least_real(&least) > 0.0;
    }
    const hopform_trial_real *known = in_from ? &c->from : &c->to;
    return known->least_contact > width_of_real(c) * fabs_real(known->least_contact_u);
}

static bool is_admissible_real(const hopform_search_real *search, const hopform_trial_real *trial)
{
    return trial->takes_off && trial->largest_x1 < search->limit;
}

/* Where x_1 reaches its limit, as a share of the interval: by both ends where it rises from one to the other, else by
 * the slope at the admissible one, as where x_1 is stopped another slope holds. NEVER if that slope does not lead
 * there. */
static real share_of_limit_real(const hopform_search_real *search, const hopform_interval_real *c)
{
    const curve_real peak = peak_of_real(c, search->limit);
    if (is_monotone_real(&peak)) {
        return share_of_root_real(&peak);
    }
    const bool starts = is_admissible_real(search, &c->from);
    const real room = starts ? peak.from : peak.to;
    const real toward = (starts ? peak.from_rate : -peak.to_rate) * peak.width;
    const real share = room + toward >= 0.0 && toward > 0.0 ? -room / toward : HOPFORM_NEVER_real;
    return starts ? share : 1.0 - share;
}

/* The nearest that an admissible current can come in an interval of which only a part, next to one end, is admissible.
 */
static real lower_bound_at_limit_real(const hopform_search_real *search, const hopform_interval_real *c,
                                      const curve_real *gap)
{
    const curve_real peak = peak_of_real(c, search->limit);
    if (peak.width > EDGE_real * search->plan->robot.u_max && !is_monotone_real(&peak)) {
        return 0.0;
    }
    const bool starts = is_admissible_real(search, &c->from);
    const real there = share_of_limit_real(search, c);
    const real share = 2.0 * (starts ? there : 1.0 - there);
    const real rate = fabs_real(gap->from_rate) + fabs_real(gap->to_rate) + fabs_real(chord_real(gap));
    const real inside = fabs_real(starts ? gap->from : gap->to);
    return share <= 1.0 ? inside - rate * share * gap->width : 0.0;
}

/* Where one end takes off and the other does not: the apex ends like a square root. */
static real lower_bound_at_takeoff_real(const hopform_search_real *search, const hopform_interval_real *c)
{
    const hopform_trial_real *lifts = c->from.takes_off ? &c->from : &c->to;
    const real width = width_of_real(c);
    if (width > STEP_real * search->plan->robot.u_max) {
        return 0.0;
    }
    const bool hopeless = !(lifts->largest_x1 - 2.0 * width * fabs_real(lifts->largest_x1_u) < search->limit);
    return hopeless ? HOPFORM_NEVER_real
                    : fabs_real(lifts->apex - search->apex) - 3.0 * width * fabs_real(lifts->apex_u);
}

/* Lower bound of the gap of any admissible current in the interval, from its ends; NEVER if there is none in it. */
static real lower_bound_of_real(const hopform_search_real *search, const hopform_interval_real *c)
{
    const hopform_trial_real *from = &c->from;
    const hopform_trial_real *to = &c->to;
    const real range = search->plan->robot.u_max;
    const real width = width_of_real(c);
    if ((from->held && to->held) || width <= 2.0 * HOPFORM_EPS_real * fabs_real(to->u)) {
        return HOPFORM_NEVER_real;
    }
    const real judged =
        !from->takes_off && !to->takes_off ? DOWN_real : (is_smooth_real(c) ? CONTROL_WIDE_real : COARSE_real);
    if (width > judged * range) {
        return 0.0;
    }
    if (from->takes_off != to->takes_off) {
        return lower_bound_at_takeoff_real(search, c);
    }
    if (width > HOPFORM_ROOT_EPS_real * range && !minima_are_positive_real(c)) {
        return 0.0;
    }
    if (!from->takes_off) {
        return HOPFORM_NEVER_real;
    }
    const curve_real gap = gap_of_real(c, search->apex);
    const curve_real peak = peak_of_real(c, search->limit);
    const curve_real below = mirrored_real(&gap);
    const real lower_bound = gap.from > 0.0 ? least_real(&gap) : least_real(&below);
    const bool in_from = is_admissible_real(search, from);
    const bool in_to = is_admissible_real(search, to);
    if (!in_from && !in_to && least_real(&peak) >= 0.0) {
        return HOPFORM_NEVER_real;
    }
    if (in_from == in_to) {
        return lower_bound;
    }
    const real edge = lower_bound_at_limit_real(search, c, &gap);
    return hopform_greater_real(edge, lower_bound);
}

/* Where a function that comes nearer to zero at both ends has its extremum. */
static real share_of_turn_real(const curve_real *c)
{
    const curve_real other = mirrored_real(c);
    const real share = share_of_minimum_real(c->from > 0.0 ? c : &other);
    return share > 0.0 ? hopform_greater_real(hopform_lesser_real(share, 0.96875), 0.03125) : 0.5;
}

/* Just inside the limit of x_1: short of where a slope at the admissible end leads to, which overshoots by the square
 * of the way, so some way off the other end. */
static real share_inside_real(const hopform_search_real *search, const hopform_interval_real *c, const curve_real *gap)
{
    const real steep = fabs_real(gap->from_rate) + fabs_real(gap->to_rate) + fabs_real(chord_real(gap));
    const real there = share_of_limit_real(search, c);
    const bool starts = is_admissible_real(search, &c->from);
    const real way = starts ? there : 1.0 - there;
    const real short_of = way > 0.0 && way <= 1.0 ? 0.0625 * way * way : 0.0;
    const real aside = short_of + 0.25 * HOPFORM_NEAR_WITHIN_real / (steep * gap->width + HOPFORM_NEAR_WITHIN_real);
    return starts ? there - aside : there + aside;
}

/* Where to split the interval, as a share of it. */
static real share_to_try_real(const hopform_search_real *search, const hopform_interval_real *c)
{
    const hopform_trial_real *from = &c->from;
    const hopform_trial_real *to = &c->to;
    if (width_of_real(c) > CONTROL_WIDE_real * search->plan->robot.u_max || c->slow >= 2
        || from->takes_off != to->takes_off) {
        return 0.5;
    }
    if (!from->takes_off) {
        const curve_real least =
            curve_of_real(c, from->least_contact, from->least_contact_u, to->least_contact, to->least_contact_u);
        return from->minima > 0 && to->minima > 0 ? share_of_turn_real(&least) : 0.5;
    }
    const curve_real gap = gap_of_real(c, search->apex);
    if (gap.from * gap.to < 0.0) {
        return share_of_root_real(&gap);
    }
    const curve_real peak = peak_of_real(c, search->limit);
    if (is_admissible_real(search, from) != is_admissible_real(search, to)) {
        return share_inside_real(search, c, &gap);
    }
    if (!is_smooth_real(c)) {
        return 0.5; /* slopes on either side of a bend say little of what lies between */
    }
    return is_admissible_real(search, from) ? share_of_turn_real(&gap) : share_of_turn_real(&peak);
}

/* ---- the search ---- */

static bool is_better_real(const hopform_search_real *search, const hopform_trial_real *trial)
{
    const real gap = fabs_real(trial->apex - search->apex);
    const real best = fabs_real(search->best.apex - search->apex);
    if (!search->found) {
        return true;
    }
    if (gap <= HOPFORM_REACHED_WITHIN_real) {
        return !search->reached || fabs_real(trial->u) < fabs_real(search->best.u);
    }
    return gap < best && !search->reached;
}

static void update_incumbent_real(hopform_search_real *search, const hopform_trial_real *trial)
{
    if (is_admissible_real(search, trial) && is_better_real(search, trial)) {
        search->best = *trial;
        search->found = true;
        search->reached = fabs_real(trial->apex - search->apex) <= HOPFORM_REACHED_WITHIN_real;
    }
}

/* A better candidate has a gap that is smaller than this. */
static real gap_to_beat_real(const hopform_search_real *search)
{
    if (!search->found) {
        return HOPFORM_NEVER_real;
    }
    const real gap = fabs_real(search->best.apex - search->apex) - 2.0 * HOPFORM_NEAR_WITHIN_real;
    return hopform_greater_real(gap, 0.0);
}

static bool may_improve_real(const hopform_search_real *search, const hopform_interval_real *c)
{
    if (search->reached) {
        return fabs_real(c->from.u) < fabs_real(search->best.u) && c->lower_bound < HOPFORM_REACHED_WITHIN_real;
    }
    return c->lower_bound < HOPFORM_NEVER_real && c->lower_bound <= gap_to_beat_real(search);
}

/* Add the interval between two candidates if a better one may lie in it. */
static void add_interval_real(hopform_search_real *search, const hopform_trial_real *from, const hopform_trial_real *to,
                              int32_t slow)
{
    hopform_interval_real interval = {*from, *to, 0.0, slow};
    interval.lower_bound = lower_bound_of_real(search, &interval);
    if (!may_improve_real(search, &interval)) {
        return;
    }
    if (search->count < HOPFORM_SEARCH_INTERVALS_real) {
        search->intervals[search->count++] = interval;
    } else {
        search->partial = true;
    }
}

/* Prune the intervals that the incumbent beats; the one of the least lower bound, of several the one nearest to 0,
 * becomes the last. */
static void prune_real(hopform_search_real *search)
{
    int32_t kept = 0;
    int32_t first = 0;
    for (int32_t n = 0; n < search->count && n < HOPFORM_SEARCH_INTERVALS_real; n++) {
        const hopform_interval_real *c = &search->intervals[n];
        if (may_improve_real(search, c) && kept < HOPFORM_SEARCH_INTERVALS_real) {
            const hopform_interval_real *best = &search->intervals[first];
            const bool as_good = !(c->lower_bound > best->lower_bound) && !(c->lower_bound < best->lower_bound);
            if (kept == 0 || c->lower_bound < best->lower_bound
                || (as_good && fabs_real(c->from.u) < fabs_real(best->from.u))) {
                first = kept;
            }
            if (kept < n) {
                const hopform_interval_real moved = *c;
                search->intervals[kept] = moved;
            }
            kept++;
        }
    }
    search->count = kept;
    if (first + 1 < kept) {
        const hopform_interval_real swapped = search->intervals[first];
        const hopform_interval_real last = search->intervals[kept - 1];
        search->intervals[first] = last;
        search->intervals[kept - 1] = swapped;
    }
}

/* Whether a current of this sign pushes an actuator that 0 leaves on a stop harder onto it: it is held there as well.
 */
static bool changes_nothing_real(const hopform_search_real *search, real sign)
{
    const hopform_robot_real *robot = &search->plan->robot;
    const real push = -robot->gamma2 * sign;
    return search->zero.held && !(push > 0.0 && search->start.x1 < robot->x1_max)
           && !(push < 0.0 && search->start.x1 > robot->x1_min);
}

/* Branch: choose the next candidate, at a limit of the range, then in the interval of the least lower bound; false if
 * nothing is left. */
static bool branch_real(hopform_search_real *search)
{
    while (search->limits > 0) {
        const real sign = search->limits == 2 ? 1.0 : -1.0;
        search->limits--;
        if (!changes_nothing_real(search, sign)) {
            search->next = sign * search->plan->robot.u_max;
            return true;
        }
    }
    prune_real(search);
    if (search->count == 0) {
        return false;
    }
    const hopform_interval_real *c = &search->intervals[search->count - 1];
    const real share = share_to_try_real(search, c);
    search->next = c->from.u + share * (c->to.u - c->from.u);
    if (!(share > 0.0 && fabs_real(search->next) > fabs_real(c->from.u)
          && fabs_real(search->next) < fabs_real(c->to.u))) {
        search->next = c->from.u + 0.5 * (c->to.u - c->from.u);
    }
    return true;
}

/* Add an evaluated candidate, which splits its interval, and choose the next one: first 0, then the limits, then in the
 * intervals. */
static bool add_candidate_real(hopform_search_real *search, const hopform_trial_real *trial)
{
    const hopform_robot_real *robot = &search->plan->robot;
    update_incumbent_real(search, trial);
    if (search->trials < HOPFORM_SEARCH_TRIALS) {
        search->trials++;
    }
    if (search->trials == 1) {
        search->zero = *trial;
        const bool chooses = robot->u_max > 0.0 && robot->x1_min < robot->x1_max;
        if (search->reached || !(chooses && search->start.x1 < search->limit)) {
            return false;
        }
    } else if (!(fabs_real(trial->u) < robot->u_max)) {
        add_interval_real(search, &search->zero, trial, 0);
    } else if (search->count > 0) {
        const hopform_interval_real split = search->intervals[--search->count];
        const real half = 0.5 * width_of_real(&split);
        const int32_t slower = split.slow < 2 ? split.slow + 1 : 2; /* of a search in any memory, too */
        add_interval_real(search, &split.from, trial, fabs_real(trial->u - split.from.u) > half ? slower : 0);
        add_interval_real(search, trial, &split.to, fabs_real(split.to.u - trial->u) > half ? slower : 0);
    }
    return branch_real(search);
}

static void report_command_real(const hopform_search_real *search, hopform_command_real *command)
{
    command->u = search->best.u;
    command->apex = search->found ? search->best.apex - search->datum : 0.0;
    const bool reaches = search->found && fabs_real(search->best.apex - search->apex) <= HOPFORM_NEAR_WITHIN_real;
    command->status =
        reaches ? HOPFORM_COMMAND_REACHED : (search->found ? HOPFORM_COMMAND_NEAREST : HOPFORM_COMMAND_NO_TAKEOFF);
}

/* ---- a current ---- */

static int32_t evaluate_candidate_real(const hopform_plan_real *plan, const hopform_state_real *start, real u,
                                       real horizon, hopform_phase_real *phases, int32_t capacity,
                                       hopform_trial_real *trial, bool *fits)
{
    const hopform_step_real step = {0.0, u};
    const hopform_state_real none = {0.0, 0.0, 0.0, 0.0};
    hopform_trial_real tried = {0};
    tried.u = u;
    tried.largest_x1 = start->x1;
    tried.least_contact = HOPFORM_NEVER_real;
    tried.smooth = true;
    hopform_tally_real tally = {plan, &tried, none, none, none, 0.0, 0, 0, false};
    hopform_stance_real stance;
    const int32_t status = hopform_solve_followed_real(plan, start, &step, 1, horizon, capacity, phases, capacity,
                                                       &stance, hopform_tally_up_real, &tally);
    if (status >= 0) {
        hopform_close_trial_real(&tally, phases, &stance);
        *fits = stance.ending != HOPFORM_ENDING_TOO_MANY_PHASES;
        *trial = tried;
    }
    return status;
}

/* ---- what users call ---- */

static const hopform_trial_real control_nothing_real = {0};
static const hopform_command_real no_current_real = {0.0, 0.0, HOPFORM_COMMAND_NO_TAKEOFF};

/* End a search: from now on a step of it commands u = 0 and returns the status. The command comes last, in case it lies
 * in the search. */
static int32_t end_search_real(hopform_search_real *search, int32_t status, hopform_command_real *command)
{
    if (search != NULL) {
        search->status = status;
        search->best = control_nothing_real;
        search->found = false;
        search->apex = 0.0;
        search->datum = 0.0;
    }
    if (command != NULL) {
        *command = no_current_real;
    }
    return status;
}

int32_t hopform_choose_current_begin_real(hopform_search_real *search, const hopform_plan_real *plan,
                                          const hopform_state_real *start, const hopform_target_real *target,
                                          hopform_command_real *command)
{
    const hopform_target_real none = {0.0, 0.0, 0.0, 0.0};
    const hopform_state_real nowhere = {0.0, 0.0, 0.0, 0.0};
    const hopform_state_real from = start != NULL ? *start : nowhere; /* start and target may lie in what is written */
    const hopform_target_real wanted = target != NULL ? *target : none;
    const bool given = search != NULL && plan != NULL && start != NULL && target != NULL && command != NULL;
    const hopform_memory_real read = hopform_array_real(plan, 1, sizeof *plan);
    const hopform_memory_real written[] = {
        hopform_array_real(search, 1, sizeof *search),
        hopform_array_real(command, 1, sizeof *command),
    };
    if (!given) {
        return end_search_real(search, HOPFORM_ERROR_NULL, command);
    }
    if (hopform_overlap_real(written, 2, &read, 1) || hopform_overlap_real(&written[0], 1, &written[1], 1)) {
        return end_search_real(search, HOPFORM_ERROR_OVERLAP, command);
    }
    (void)end_search_real(search, HOPFORM_SEARCHING, command);
    const hopform_robot_real *robot = &plan->robot;
    if (!hopform_hops_real(plan) || !(robot->u_max <= HOPFORM_NEVER_real)) {
        search->status = HOPFORM_ERROR_ROBOT;
    } else if (!hopform_is_finite_real(wanted.h_des) || !hopform_is_finite_real(wanted.datum)
               || !(wanted.h_des + wanted.datum >= 0.0)
               || !(wanted.stop_margin >= 0.0 && wanted.stop_margin <= HOPFORM_NEVER_real)) {
        search->status = HOPFORM_ERROR_TARGET;
    } else if (!(wanted.horizon > 0.0 && wanted.horizon <= HOPFORM_NEVER_real)) {
        search->status = HOPFORM_ERROR_HORIZON;
    }
    const bool locked = !(robot->x1_min < robot->x1_max);
    search->plan = plan;
    search->start = from;
    search->apex = wanted.h_des + wanted.datum;
    search->datum = wanted.datum;
    search->limit = locked ? HOPFORM_NEVER_real : robot->x1_max - wanted.stop_margin - 16.0 * HOPFORM_EPS_real;
    search->horizon = wanted.horizon;
    search->count = 0;
    search->limits = 2;
    search->next = 0.0;
    search->trials = 0;
    search->reached = false;
    search->partial = false;
    return search->status;
}

int32_t hopform_choose_current_step_real(hopform_search_real *search, hopform_phase_real *phases, int32_t capacity,
                                         hopform_command_real *command)
{
    if (search == NULL || phases == NULL || command == NULL) {
        return end_search_real(search, HOPFORM_ERROR_NULL, command);
    }
    const hopform_memory_real read[] = {
        hopform_array_real(search, 1, sizeof *search),
        hopform_array_real(search->plan, 1, search->status == HOPFORM_SEARCHING ? sizeof *search->plan : 0),
    };
    const hopform_memory_real written[] = {
        hopform_array_real(phases, capacity, sizeof *phases),
        hopform_array_real(command, 1, sizeof *command),
    };
    if (hopform_overlap_real(written, 2, read, 2)) {
        return end_search_real(search, HOPFORM_ERROR_OVERLAP, command);
    }
    if (search->status != HOPFORM_SEARCHING || search->plan == NULL) {
        report_command_real(search, command);
        return search->status;
    }
    hopform_trial_real trial = search->best;
    bool fits = true;
    const int32_t status = evaluate_candidate_real(search->plan, &search->start, search->next, search->horizon, phases,
                                                   capacity, &trial, &fits);
    if (status < 0) {
        return end_search_real(search, status, command); /* for good: what was found does not count after an error */
    }
    search->partial = search->partial || !fits;
    if (!add_candidate_real(search, &trial)) {
        search->status = search->partial ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK;
    }
    report_command_real(search, command);
    return search->status;
}

int32_t hopform_choose_current_real(hopform_search_real *search, const hopform_plan_real *plan,
                                    const hopform_state_real *start, const hopform_target_real *target,
                                    hopform_phase_real *phases, int32_t capacity, hopform_command_real *command)
{
    int32_t status = hopform_choose_current_begin_real(search, plan, start, target, command);
    for (int n = 0; n < HOPFORM_SEARCH_TRIALS && status == HOPFORM_SEARCHING; n++) {
        status = hopform_choose_current_step_real(search, phases, capacity, command);
    }
    return status == HOPFORM_SEARCHING ? HOPFORM_PHASES_NOT_KEPT : status;
}

int32_t hopform_try_currents_real(const hopform_plan_real *plan, const hopform_state_real *starts, int32_t start_count,
                                  const real *currents, int32_t current_count, real horizon, hopform_phase_real *phases,
                                  int32_t capacity, hopform_trial_real *trials)
{
    const size_t row = current_count > 0 ? (size_t)current_count * sizeof *trials : 0;
    const hopform_memory_real all = hopform_array_real(trials, start_count, row);
    const hopform_memory_real read[] = {
        hopform_array_real(plan, 1, sizeof *plan),
        hopform_array_real(starts, start_count, sizeof *starts),
        hopform_array_real(currents, current_count, sizeof *currents),
        all,
    };
    const hopform_memory_real written = hopform_array_real(phases, capacity, sizeof *phases);
    if (plan == NULL || starts == NULL || currents == NULL || phases == NULL || trials == NULL) {
        return hopform_refuse_real(HOPFORM_ERROR_NULL, &all, 1);
    }
    if (hopform_overlap_real(&written, 1, read, 4) || hopform_overlap_real(&all, 1, read, 3)) {
        return hopform_refuse_real(HOPFORM_ERROR_OVERLAP, &all, 1);
    }
    if (!hopform_hops_real(plan)) {
        return hopform_refuse_real(HOPFORM_ERROR_ROBOT, &all, 1);
    }
    int32_t kept = HOPFORM_OK;
    for (int32_t i = 0; i < start_count; i++) {
        for (int32_t j = 0; j < current_count; j++) {
            bool fits = true;
            const int32_t status = evaluate_candidate_real(plan, &starts[i], currents[j], horizon, phases, capacity,
                                                           &trials[i * current_count + j], &fits);
            if (status < 0) {
                return hopform_refuse_real(status, &all, 1);
            }
            kept = fits ? kept : HOPFORM_PHASES_NOT_KEPT;
        }
    }
    return kept;
}

/* ---- the largest compression, which shares the search for minima ---- */

/* The largest compression inside a phase that lasts for t and in which both masses move in the same direction: y' keeps
 * its sign in the others. 0 if there is no maximum. */
static real most_in_phase_real(const hopform_plan_real *plan, const hopform_phase_real *phase, real u, real t)
{
    const int side = hopform_side_1_real(phase);
    const hopform_motion_real motion = hopform_motion_in_phase_real(plan, phase, u);
    const hopform_poles_real *poles = hopform_poles_of_real(plan, side, side);
    const event_function_real extension = {-motion.H3_y, -motion.H2_y, -motion.H1_y, -phase->y, 0, 0};
    const event_set_real set = {poles, hopform_node_of_real(plan, side, side), 1, {extension}};
    const propagator_real end = propagator_at_real(poles, t);
    const jet_real from = jet_at_start_real(poles, &extension);
    const jet_real to = jet_at_real(set.poles, &extension, &end);
    return -hopform_least_minimum_real(&set, &from, &to, &end, 65536.0).value;
}

int32_t hopform_stance_compression_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                        const hopform_phase_real *phases, const hopform_stance_real *stance,
                                        real *compression_max)
{
    if (compression_max == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const int32_t status = hopform_reading_status_real(plan, steps, phases, stance, NULL, NULL, 0);
    real most = status < 0 ? 0.0 : stance->end.y;
    for (int32_t n = 0; status >= 0 && n < stance->phases_kept; n++) {
        const hopform_phase_real *phase = &phases[n];
        const real until = n + 1 < stance->phases_kept ? phases[n + 1].t : stance->duration;
        const int side = hopform_side_1_real(phase);
        most = hopform_greater_real(most, phase->y);
        if (side != 0 && side == hopform_side_2_real(phase) && until > phase->t) {
            most = hopform_greater_real(most, most_in_phase_real(plan, phase, steps[phase->step].u, until - phase->t));
        }
    }
    *compression_max = most;
    return status;
}
