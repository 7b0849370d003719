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

/* How far a function may be off the cubic in the middle of an interval, as shares of what its slopes differ by from the
 * chord's: of their sum, and of each; where the events change, of each alone. */
#define LEAN_real 0.75
#define BEND_real 0.03125
#define KINK_real 1.0

/* An interval at one end of which the leg takes off is judged by that end where it is this narrow. */
#define STEP_real 0.00390625

/* One that x_1 leaves its limit in is judged by the slopes of both where x_1 does not turn, or it is this narrow. */
#define EDGE_real 0.015625

/* A function of u on an interval: values at both ends, slopes times the interval's width, outward from 0; whether it is
 * smooth in between. */
typedef struct {
    real from;
    real from_rise;
    real to;
    real to_rise;
    bool smooth;
} curve_real;

/* The least that the function is taken to be on the interval: the least of the Bernstein coefficients of the cubic that
 * the ends determine, as a quartic, less what the function may be off that in the middle. */
static real least_real(const curve_real *c)
{
    const real first = c->from_rise - (c->to - c->from);
    const real last = c->to_rise - (c->to - c->from);
    const real spread = fabs_real(first) + fabs_real(last);
    const real off = c->smooth ? LEAN_real * fabs_real(first + last) + BEND_real * spread : KINK_real * spread;
    const real middle = 0.5 * (c->from + c->to) + (c->from_rise - c->to_rise) / 6.0 - off;
    const real ends = hopform_lesser_real(c->from, c->to);
    const real quarters = hopform_lesser_real(c->from + 0.25 * c->from_rise, c->to - 0.25 * c->to_rise);
    return hopform_lesser_real(hopform_lesser_real(ends, quarters), middle);
}

/* Where the cubic has its minimum, as a share of the interval, kept off its ends; the middle if there is none in it. */
static real share_of_minimum_real(const curve_real *c)
{
    const real chord = c->to - c->from;
    const real lean = c->from_rise + c->to_rise - 2.0 * chord;
    const real half = c->from_rise + lean - chord;
    const real root = sqrt_real(hopform_greater_real(half * half - 3.0 * lean * c->from_rise, 0.0));
    const real above = half < 0.0 ? -c->from_rise : half + root;
    const real below = half < 0.0 ? root - half : 3.0 * lean;
    if (!(above > 0.0 && above < below)) {
        return 0.5;
    }
    return hopform_greater_real(hopform_lesser_real(above / below, 0.96875), 0.03125);
}

/* Where the function vanishes, as a share of the interval: the inverse as a cubic, the chord's where a slope is against
 * it. */
static real share_of_root_real(const curve_real *c)
{
    const real chord = c->to - c->from;
    const real t = -c->from / chord;
    if (!(c->from_rise * chord > 0.0 && c->to_rise * chord > 0.0)) {
        return t;
    }
    const real begin = hopform_lesser_real(chord / c->from_rise, 3.0); /* with which the cubic still rises */
    const real end = hopform_lesser_real(chord / c->to_rise, 3.0);
    return t * (begin + t * (3.0 - 2.0 * begin - end + t * (begin + end - 2.0)));
}

/* ---- an interval ---- */

static curve_real curve_of_real(const hopform_interval_real *c, real from, real from_u, real to, real to_u)
{
    const real width = c->to.u - c->from.u;
    const bool smooth = c->from.events == c->to.events && c->from.smooth && c->to.smooth;
    const curve_real made = {from, from_u * width, to, to_u * width, smooth};
    return made;
}

/* How far the apex is off what is wanted, positive at the nearer end; a far end that reaches it does not count as a
 * root. */
static curve_real gap_of_real(const hopform_interval_real *c, real wanted)
{
    const real sign = c->from.apex > wanted ? 1.0 : -1.0;
    curve_real gap = curve_of_real(c, sign * (c->from.apex - wanted), sign * c->from.apex_u,
                                   sign * (c->to.apex - wanted), sign * c->to.apex_u);
    if (fabs_real(gap.to) <= HOPFORM_REACHED_WITHIN_real) {
        gap.to = HOPFORM_REACHED_WITHIN_real;
    }
    return gap;
}

/* The largest x_1 less its limit; it goes on where x_1 is stopped. */
static curve_real peak_of_real(const hopform_interval_real *c, real limit)
{
    return curve_of_real(c, c->from.largest_x1 - limit, c->from.largest_x1_u, c->to.largest_x1 - limit,
                         c->to.largest_x1_u);
}

static curve_real contact_of_real(const hopform_interval_real *c)
{
    return curve_of_real(c, c->from.least_contact, c->from.least_contact_u, c->to.least_contact, c->to.least_contact_u);
}

/* No rebound in the interval takes off that does not do so at its ends: the least contact force of each
 * stays above zero. */
static bool minima_are_positive_real(const hopform_interval_real *c)
{
    const curve_real contact = contact_of_real(c);
    const bool in_from = c->from.minima > 0;
    const bool in_to = c->to.minima > 0;
    if (in_from && in_to) {
        return least_real(&contact) > 0.0;
    }
    return (!in_from || contact.from > fabs_real(contact.from_rise))
           && (!in_to || contact.to > fabs_real(contact.to_rise));
}

static bool is_admissible_real(const hopform_search_real *search, const hopform_trial_real *trial)
{
    return trial->takes_off && trial->largest_x1 < search->limit;
}

/* Slope of the gap over that of the largest x_1: the multiplier of its limit. */
static real multiplier_real(const curve_real *gap, const curve_real *peak, bool starts)
{
    const real rise = fabs_real(starts ? peak->from_rise : peak->to_rise);
    return (fabs_real(gap->from_rise) + fabs_real(gap->to_rise)) / hopform_greater_real(rise, HOPFORM_UNDERFLOW_real);
}

/* Lower bound of the gap of any admissible current in the interval, from its ends; NEVER if there is none in it. */
static real lower_bound_of_real(const hopform_search_real *search, const hopform_interval_real *c)
{
    const hopform_trial_real *from = &c->from;
    const hopform_trial_real *to = &c->to;
    const real range = search->plan->robot.u_max;
    const real width = fabs_real(to->u - from->u);
    const curve_real gap = gap_of_real(c, search->apex);
    const curve_real peak = peak_of_real(c, search->limit);
    if ((from->held && to->held) || width <= 2.0 * HOPFORM_EPS_real * fabs_real(to->u)) {
        return HOPFORM_NEVER_real;
    }
    const real widest = !from->takes_off && !to->takes_off ? DOWN_real : (gap.smooth ? CONTROL_WIDE_real : COARSE_real);
    if (width > widest * range) {
        return 0.0;
    }
    if (from->takes_off != to->takes_off) { /* the apex ends like a square root */
        const real off = from->takes_off ? gap.from - 3.0 * fabs_real(gap.from_rise)
                                         : fabs_real(gap.to) - 3.0 * fabs_real(gap.to_rise);
        const real beyond =
            from->takes_off ? peak.from - 2.0 * fabs_real(peak.from_rise) : peak.to - 2.0 * fabs_real(peak.to_rise);
        return width > STEP_real * range ? 0.0 : (beyond < 0.0 ? off : HOPFORM_NEVER_real);
    }
    if (width > HOPFORM_ROOT_EPS_real * range && !minima_are_positive_real(c)) {
        return 0.0;
    }
    if (!from->takes_off || least_real(&peak) >= 0.0) {
        return HOPFORM_NEVER_real;
    }
    const bool starts = is_admissible_real(search, from);
    const bool turns = least_real(&peak) < hopform_lesser_real(peak.from, peak.to);
    if (starts == is_admissible_real(search, to) || (turns && width > EDGE_real * range)) {
        return least_real(&gap);
    }
    const real weight = 2.0 * multiplier_real(&gap, &peak, starts);
    const curve_real both = {gap.from + weight * peak.from, gap.from_rise + weight * peak.from_rise,
                             gap.to + weight * peak.to, gap.to_rise + weight * peak.to_rise, gap.smooth};
    const real all = least_real(&gap);
    return hopform_greater_real(all, least_real(&both));
}

/* Where to split the interval, as a share of it. */
static real share_to_try_real(const hopform_search_real *search, const hopform_interval_real *c)
{
    const hopform_trial_real *from = &c->from;
    const hopform_trial_real *to = &c->to;
    if (fabs_real(to->u - from->u) > CONTROL_WIDE_real * search->plan->robot.u_max || c->slow >= 2
        || from->takes_off != to->takes_off) {
        return 0.5;
    }
    if (!from->takes_off) {
        const curve_real contact = contact_of_real(c);
        return from->minima > 0 && to->minima > 0 ? share_of_minimum_real(&contact) : 0.5;
    }
    const curve_real gap = gap_of_real(c, search->apex);
    if (gap.to < 0.0) {
        return share_of_root_real(&gap);
    }
    curve_real peak = peak_of_real(c, search->limit);
    const bool starts = is_admissible_real(search, from);
    if (starts != is_admissible_real(search, to)) { /* just inside the limit of x_1 */
        const real inside = 0.25 * HOPFORM_NEAR_WITHIN_real / multiplier_real(&gap, &peak, starts);
        peak.from += inside;
        peak.to += inside;
        return share_of_root_real(&peak);
    }
    if (!gap.smooth) {
        return 0.5; /* slopes on either side of a bend say little of what lies between */
    }
    return share_of_minimum_real(starts ? &gap : &peak);
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

/* Whether an interval is branched before another: of the lesser lower bound, of several the one nearer to 0. */
static bool comes_first_real(const hopform_interval_real *c, const hopform_interval_real *other)
{
    const bool as_good = !(c->lower_bound > other->lower_bound) && !(c->lower_bound < other->lower_bound);
    return c->lower_bound < other->lower_bound || (as_good && fabs_real(c->from.u) < fabs_real(other->from.u));
}

/* Add the interval between two candidates if a better one may lie in it, behind those that come later. */
static void add_interval_real(hopform_search_real *search, const hopform_trial_real *from, const hopform_trial_real *to,
                              int32_t slow)
{
    hopform_interval_real interval = {*from, *to, 0.0, slow};
    interval.lower_bound = lower_bound_of_real(search, &interval);
    if (!may_improve_real(search, &interval)) {
        return;
    }
    if (search->count >= HOPFORM_SEARCH_INTERVALS_real) { /* the last to come goes */
        search->partial = search->partial || may_improve_real(search, &search->intervals[0]);
        search->count = HOPFORM_SEARCH_INTERVALS_real - 1;
        for (int32_t n = 0; n < search->count; n++) {
            const hopform_interval_real sooner = search->intervals[n + 1];
            search->intervals[n] = sooner;
        }
    }
    int32_t place = search->count++;
    for (; place > 0 && !comes_first_real(&interval, &search->intervals[place - 1]); place--) {
        const hopform_interval_real later = search->intervals[place - 1];
        search->intervals[place] = later;
    }
    search->intervals[place] = interval;
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
    int32_t kept = search->count < HOPFORM_SEARCH_INTERVALS_real ? search->count : HOPFORM_SEARCH_INTERVALS_real;
    while (kept > 0 && !may_improve_real(search, &search->intervals[kept - 1])) {
        kept--;
    }
    search->count = kept;
    if (kept <= 0) {
        return false;
    }
    const hopform_interval_real *c = &search->intervals[kept - 1];
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
    } else if (search->count > 0 && search->count <= HOPFORM_SEARCH_INTERVALS_real) {
        const hopform_interval_real split = search->intervals[--search->count];
        const real half = 0.5 * fabs_real(split.to.u - split.from.u);
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
    const event_function_real extension = {-motion.H3_y, -motion.H2_y, -motion.H1_y, 0.0, -phase->y, 0, 0};
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
