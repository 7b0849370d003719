/* SPDX-License-Identifier: MIT-0
 *
 * One stance as a chain of phases: each is linear, has its closed form, and ends at the first of the events in
 * which a mass reverses, sticks, slips or hits a stop, or in which the spring force returns to zero.
 */
#include "facts.h"
#include "events_real.h"
#include "ledger_real.h"

/* How a phase ends. */
typedef enum {
    STANCE_END_LIMIT_real,
    END_VELOCITY_1_real,
    END_THRESHOLD_1_real,
    STANCE_END_STOP_real,
    END_VELOCITY_2_real,
    END_THRESHOLD_2_real,
    END_TAKEOFF_real
} stance_end_kind_real;

typedef struct {
    real t; /* since the phase began */
    stance_end_kind_real kind;
    int side;                 /* of a threshold: where the mass goes */
    hopform_basis_real basis; /* at t */
    real touch;               /* how near x_1, where it turns, is to a stop that it touches */
} stance_phase_end_real;

/* The chain while it grows. */
typedef struct {
    const hopform_plan_real *plan;
    const hopform_step_real *steps;
    int32_t step_count;
    int32_t step;
    real horizon;
    real t;
    hopform_state_real state;
    real from_min; /* x1 - x1_min and x1 - x1_max: x1 itself has no digits for what is this close to a stop */
    real from_max;
    int side_1;
    int side_2;
    bool fresh_1; /* mass 1 has just crossed its friction threshold: its acceleration is exactly zero */
    bool fresh_2;
    int alone; /* the mass that has just come to rest and whose free acceleration is known from the motion, 0 if none
                  has */
    real free; /* this acceleration, from before the state lost its digits */
    real start_loss;
    bool adds_up; /* the AED is the sum of its entries, not a difference of energies that are much larger */
    real aed;
    int32_t max_phases;
    hopform_phase_real *phases;
    int32_t capacity;
    int32_t count;
    int32_t event_count;
} stance_chain_real;

static real stance_sign_of_real(real value)
{
    return value > 0.0 ? 1.0 : (value < 0.0 ? -1.0 : 0.0);
}

/* ---- the hold rule ---- */

static bool stance_blocked_real(const stance_chain_real *chain, int side)
{
    const bool locked = !(chain->plan->robot.x1_min < chain->plan->robot.x1_max);
    return locked || (side < 0 && chain->from_min <= 0.0) || (side > 0 && chain->from_max >= 0.0);
}

/* First non-zero derivative of the free acceleration of a mass that is held. */
static real drift_of_free_real(const stance_chain_real *chain, int mass)
{
    const int side_1 = mass == 1 ? 0 : chain->side_1;
    const int side_2 = mass == 2 ? 0 : chain->side_2;
    const hopform_motion_real motion =
        hopform_motion_of_real(chain->plan, &chain->state, chain->steps[chain->step].u, side_1, side_2);
    const hopform_numerator_real free = mass == 1 ? hopform_free_numerator_1_real(&chain->plan->rates, &motion)
                                                  : hopform_free_numerator_2_real(&chain->plan->rates, &motion);
    if (fabs_real(free.H3) > 0.0) {
        return free.H3;
    }
    return fabs_real(free.H2) > 0.0 ? free.H2 : free.H1;
}

/* Where a mass at rest goes: held while |a_i| <= f_i; on the threshold its first non-zero derivative decides. */
static int direction_real(const stance_chain_real *chain, int mass)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const hopform_free_real free =
        hopform_free_accelerations_real(&chain->plan->rates, &chain->state, chain->steps[chain->step].u);
    const real acceleration = chain->alone == mass ? chain->free : (mass == 1 ? free.free_1 : free.free_2);
    const real friction = mass == 1 ? robot->f1 : robot->f2;
    real goes = acceleration > friction ? 1.0 : (acceleration < -friction ? -1.0 : 0.0);
    if (!(fabs_real(acceleration) < friction) && !(fabs_real(goes) > 0.0)) {
        const real drift = drift_of_free_real(chain, mass);
        goes = acceleration * drift >= 0.0 ? stance_sign_of_real(drift) : 0.0;
    }
    const int side = (int)goes;
    return mass == 1 && stance_blocked_real(chain, side) ? 0 : side;
}

/* Sides of the masses that are at rest; of two twice, because each may depend on what the other one does. */
static void stance_settle_real(stance_chain_real *chain, bool rests_1, bool rests_2)
{
    for (int n = 0; n < (rests_1 && rests_2 ? 2 : 1); n++) {
        chain->side_1 = rests_1 ? direction_real(chain, 1) : chain->side_1;
        chain->side_2 = rests_2 ? direction_real(chain, 2) : chain->side_2;
    }
}

/* ---- the end of a phase ---- */

enum { MOST_WATCHES_real = 3 };

/* What is watched in a phase: take-off first, then what mass 1 does, then mass 2, which is also who wins a tie.
 * Not what cannot happen while v_1 and v_2 keep their signs, nor the velocity of a mass that slips alone: its zero is
 * known. */
typedef struct {
    const hopform_poles_real *poles;
    const hopform_motion_real *motion;
    hopform_watch_real watch[MOST_WATCHES_real];
    hopform_sample_real from[MOST_WATCHES_real];
    int32_t count;
    real doubt; /* of a threshold: what rounding may have done to friction less force */
    real frequency;
    real half_turn;
    real halt; /* when the mass that slips alone comes to rest, or y, which rings about 0, vanishes */
    stance_end_kind_real halts;
} stance_guard_real;

/* Where a held mass may slip to while the other one moves: where its free acceleration changes with y alone, which is
 * monotone then, to the side that it goes towards; 0 for either. */
static int side_of_slip_real(const stance_chain_real *chain, int mass)
{
    const hopform_rates_real *rates = &chain->plan->rates;
    const real per_y = mass == 1 ? rates->a1_y : rates->a2_y;
    const real per_v = mass == 1 ? rates->a1_v2 : rates->a2_v1;
    return fabs_real(per_v) > 0.0 ? 0 : (int)stance_sign_of_real(per_y) * (chain->side_1 - chain->side_2);
}

/* A held mass slips where its free acceleration leaves [-f, f]; a stop holds on its side whatever the force. */
static void watch_thresholds_real(const stance_chain_real *chain, stance_guard_real *guard, int mass)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const hopform_rates_real *rates = &chain->plan->rates;
    const hopform_free_real at_rest =
        hopform_free_accelerations_real(rates, &chain->state, chain->steps[chain->step].u);
    const hopform_numerator_real h = mass == 1 ? hopform_free_numerator_1_real(rates, guard->motion)
                                               : hopform_free_numerator_2_real(rates, guard->motion);
    const real acceleration = mass == 1 ? at_rest.free_1 : at_rest.free_2;
    const real friction = mass == 1 ? robot->f1 : robot->f2;
    const int towards = side_of_slip_real(chain, mass);
    guard->doubt = 4.0 * HOPFORM_EPS_real * (friction + fabs_real(acceleration));
    for (int side = -1; side <= 1; side += 2) {
        if (side == -towards || (mass == 1 && stance_blocked_real(chain, side))) {
            continue;
        }
        const real sign = (real)side;
        guard->watch[guard->count++] = hopform_watch_of_real(
            guard->poles, -sign * h.H3, -sign * h.H2, -sign * h.H1, friction - sign * acceleration, 1.0,
            mass == 1 ? END_THRESHOLD_1_real : END_THRESHOLD_2_real, side);
    }
}

/* Where both masses slip, each watches its velocity. */
static void watch_velocity_real(const stance_chain_real *chain, stance_guard_real *guard, stance_end_kind_real kind)
{
    const hopform_motion_real *motion = guard->motion;
    if (kind == END_VELOCITY_1_real) {
        guard->watch[guard->count++] =
            hopform_watch_of_real(guard->poles, chain->fresh_1 ? 0.0 : motion->H3_1, motion->H2_1, motion->H1_1,
                                  chain->state.v1, (real)chain->side_1, (int32_t)kind, 0);
    } else {
        guard->watch[guard->count++] =
            hopform_watch_of_real(guard->poles, chain->fresh_2 ? 0.0 : motion->H3_2, motion->H2_2, motion->H1_2,
                                  chain->state.v2, (real)chain->side_2, (int32_t)kind, 0);
    }
}

/* Where one mass is held and the forces on the other one cancel at y = 0, y rings about 0 as a velocity does: its first
 * zero is known however far it has faded by then. */
static bool rings_about_zero_real(const stance_chain_real *chain)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const hopform_state_real slack = {0.0, 0.0, 0.0, 0.0};
    if ((chain->side_1 != 0 && chain->side_2 != 0) || chain->state.y < 0.0) {
        return false;
    }
    const hopform_free_real free =
        hopform_free_accelerations_real(&chain->plan->rates, &slack, chain->steps[chain->step].u);
    const real left = chain->side_2 == 0 ? free.free_1 - (real)chain->side_1 * robot->f1
                                         : free.free_2 - (real)chain->side_2 * robot->f2;
    return !(fabs_real(left) > 0.0);
}

static void put_guard_real(stance_guard_real *guard, const stance_chain_real *chain, const hopform_poles_real *poles,
                           const hopform_motion_real *motion)
{
    guard->poles = poles;
    guard->motion = motion;
    guard->count = 0;
    const bool rings = rings_about_zero_real(chain);
    if (!rings
        && (chain->side_1 < 0 || chain->side_2 > 0 || chain->state.y < 0.0)) { /* else y only rises, from 0 or above */
        guard->watch[guard->count++] = hopform_watch_of_real(poles, motion->H3_y, motion->H2_y, motion->H1_y,
                                                             chain->state.y, 1.0, END_TAKEOFF_real, 0);
    }
    guard->halt = HOPFORM_NEVER_real;
    guard->halts = STANCE_END_LIMIT_real;
    if (chain->side_1 == 0) {
        const real sign = (real)chain->side_2;
        watch_thresholds_real(chain, guard, 1);
        guard->halt = hopform_halt_time_real(poles, sign * chain->state.v2, sign * motion->H3_2);
        guard->halts = END_VELOCITY_2_real;
    } else if (chain->side_2 == 0) {
        const real sign = (real)chain->side_1;
        watch_thresholds_real(chain, guard, 2);
        guard->halt = hopform_halt_time_real(poles, sign * chain->state.v1, sign * motion->H3_1);
        guard->halts = END_VELOCITY_1_real;
    } else {
        watch_velocity_real(chain, guard, END_VELOCITY_1_real);
        watch_velocity_real(chain, guard, END_VELOCITY_2_real);
    }
    const real lift =
        rings ? hopform_halt_time_real(poles, chain->state.y, chain->state.v1 - chain->state.v2) : HOPFORM_NEVER_real;
    if (rings && lift <= guard->halt) {
        guard->halt = lift;
        guard->halts = END_TAKEOFF_real;
    }
    for (int32_t n = 0; n < guard->count; n++) {
        guard->from[n] = hopform_first_sample_real(&guard->watch[n], poles);
    }
    guard->frequency = hopform_frequency_real(poles);
    guard->half_turn = guard->frequency > 0.0 ? 3.14159265358979323846 / guard->frequency : HOPFORM_NEVER_real;
}

static bool is_takeoff_real(const stance_guard_real *guard, int32_t found)
{
    return found >= 0 && guard->watch[found].kind == END_TAKEOFF_real;
}

/* A window of a phase that ends at `t`, with what is known there. */
typedef struct {
    real t;
    hopform_basis_real basis;
    hopform_sample_real at[MOST_WATCHES_real];
    int32_t found; /* the watch that has its root at t, -1 for none */
} window_real;

static void sample_window_real(const stance_guard_real *guard, window_real *end)
{
    for (int32_t n = 0; n < guard->count; n++) {
        if (n != end->found) {
            end->at[n] = hopform_sample_at_real(&guard->watch[n], guard->poles, &end->basis, end->t);
        }
    }
}

static void close_window_real(const stance_guard_real *guard, window_real *end, real t)
{
    end->t = t;
    end->found = -1;
    end->basis = hopform_basis_at_real(guard->poles, t);
    sample_window_real(guard, end);
}

/* The window ends where a watch has its root. */
static void end_at_real(const stance_guard_real *guard, window_real *end, int32_t n, const hopform_point_real *root)
{
    end->t = root->t;
    end->basis = root->basis;
    end->found = n;
    end->at[n] = root->at;
    sample_window_real(guard, end);
}

/* Which root swinging on would bring first, and when. */
typedef struct {
    int32_t watch; /* -1 if none */
    real after;
} outlook_real;

static outlook_real look_ahead_real(const stance_guard_real *guard, bool has_faded)
{
    const real w = guard->frequency > 0.0 ? guard->frequency : sqrt_real(guard->poles->q);
    outlook_real ahead = {-1, 0.96875 * guard->half_turn};
    for (int32_t n = 0; n < guard->count && !has_faded; n++) {
        const real swing = hopform_swing_to_zero_real(&guard->from[n], w);
        if (swing < ahead.after) {
            ahead.watch = n;
            ahead.after = swing;
        }
    }
    if (ahead.watch >= 0 && guard->frequency > 0.0) {
        const real step = hopform_swing_step_real(guard->poles, &guard->from[ahead.watch], w, ahead.after);
        ahead.after -= fabs_real(step) < 0.25 * ahead.after ? step : 0.0;
    }
    return ahead;
}

/* Close the window at the root that is expected first, or a little beyond where it was expected. */
static void reach_ahead_real(const stance_guard_real *guard, real low, real limit, int32_t windows, window_real *end)
{
    const real p = guard->poles->p; /* a window in which the pair fades away tells little */
    const bool has_faded =
        -0.5 * p * low < HOPFORM_SMALLEST_EXPONENT_real; /* without a digit left: what goes on is monotone */
    const outlook_real ahead = look_ahead_real(guard, has_faded);
    const real fades = p * guard->half_turn > 8.0 ? 8.0 / p : guard->half_turn;
    const real half = 0.96875 * guard->half_turn;
    const real patient = fades > 3.0 * low ? fades : 3.0 * low;
    const real longest = has_faded || guard->count == 0 ? limit - low : (half < patient ? half : patient);
    const real far = longest < limit - low ? low + longest : limit;
    if (ahead.watch >= 0) {
        const hopform_point_real root = hopform_root_ahead_real(&guard->watch[ahead.watch], guard->poles, low,
                                                                low + ahead.after < far ? low + ahead.after : far, far);
        if (root.t > low
            && root.at.rate * (root.t - low) < -root.at.noise) { /* not what rounding makes of a g that fades */
            end_at_real(guard, end, ahead.watch, &root);
            return;
        }
    }
    const real least =
        windows > 3 ? (guard->frequency > 0.0 ? 0.125 * guard->half_turn : low) : 64.0 * HOPFORM_EPS_real * low;
    const real reach = ahead.watch >= 0 ? 1.015625 * ahead.after : longest;
    const real t = low + (reach > least ? reach : least);
    close_window_real(guard, end, t > low && t < far ? t : far);
}

static real doubt_of_real(const stance_guard_real *guard, int32_t n)
{
    const int32_t kind = guard->watch[n].kind;
    return kind == END_THRESHOLD_1_real || kind == END_THRESHOLD_2_real ? guard->doubt : 0.0;
}

/* Two events within rounding are at the same time, and the watch with the lower number wins: n, or the one that is
 * found. */
static bool is_before_real(const stance_guard_real *guard, const window_real *end, int32_t n, real h)
{
    const hopform_sample_real *at = &end->at[n];
    const hopform_sample_real *other = &end->at[end->found];
    const real blurred = other->noise + doubt_of_real(guard, end->found);
    const bool crosses = at->rate * h < -16.0 * at->noise;
    const bool ties = (at->value - 4.0 * at->noise) * fabs_real(other->rate) < fabs_real(at->rate) * blurred;
    return at->value < -(at->noise + doubt_of_real(guard, n)) || (n < end->found && crosses && ties);
}

/* Shorten the window until each watch is known to keep its sign in it, but for the one that is found at its end. */
static void settle_window_real(const stance_guard_real *guard, real low, window_real *end)
{
    const real a = guard->poles->a;
    int32_t lost = -1;
    for (int32_t n = 0, cuts = 0; n < guard->count && cuts < 400; n++) {
        const hopform_sample_real *from = &guard->from[n];
        const real h = end->t - low;
        const hopform_sample_real *to = &end->at[n];
        const real value =
            n == end->found ? -2.0 * to->noise : to->value; /* just beyond its root, which must be its first */
        hopform_verdict_real verdict = hopform_judge_real(from, to, value, a, h, h <= 0.5 * guard->half_turn);
        if (n == end->found && verdict == LOSES_SIGN_real) {
            continue;
        }
        if (verdict == KEEPS_SIGN_real && end->found > n && is_before_real(guard, end, n, h)) {
            end->found = n; /* a tie */
            continue;
        }
        if (verdict == LOSES_SIGN_real && end->found >= 0 && !is_before_real(guard, end, n, h)) {
            continue; /* a tie that the other wins */
        }
        if (verdict == DIPS_real) {
            const hopform_point_real bottom =
                hopform_bottom_between_real(&guard->watch[n], guard->poles, low, from, end->t, to);
            if (bottom.at.value < -bottom.at.noise) {
                close_window_real(guard, end, bottom.t);
                verdict = LOSES_SIGN_real;
            }
        }
        if (verdict == LOSES_SIGN_real) {
            if (!(from->value > 0.0) && (from->rate < 0.0 || (!(from->rate > 0.0) && !(from->turning > 0.0)))) {
                close_window_real(guard, end, low);
                end->found = n;
                return;
            }
            const hopform_point_real last = {end->t, end->basis, end->at[n]};
            const hopform_point_real root = hopform_root_between_real(&guard->watch[n], guard->poles, low, last);
            end_at_real(guard, end, n, &root);
            lost = n;
            n = -1; /* the others must keep their signs up to here */
            cuts++;
        } else if (verdict == UNDECIDED_real) {
            const real cut = low + hopform_turn_between_real(from, &end->at[n], h);
            if (cut > low && cut < end->t) { /* else there is no number in between */
                close_window_real(guard, end, cut);
                n = -1;
                cuts++;
            }
        }
    }
    end->found = end->t > low ? end->found : lost; /* no number lies between its root and the start */
}

/* The state that a phase starts from, x_1 counted from the stop ahead. */
static hopform_state_real from_stop_real(const stance_chain_real *chain)
{
    hopform_state_real start = chain->state;
    start.x1 = chain->side_1 > 0 ? chain->from_max : chain->from_min;
    return start;
}

/* The stop ahead, which x_1, monotone within a phase, has met if it is beyond it at the end of the window, and does not
 * just touch. */
static bool meets_stop_real(const stance_chain_real *chain, const stance_guard_real *guard, window_real *end)
{
    const real sign = (real)chain->side_1;
    const hopform_state_real start = from_stop_real(chain);
    if (chain->side_1 == 0 || !hopform_is_finite_real(start.x1)) {
        return false;
    }
    real low = 0.0;
    real high = end->t;
    real t = end->t;
    hopform_basis_real basis = end->basis;
    const real beyond = sign * hopform_state_at_real(&start, guard->motion, &basis).x1_t;
    if (!(beyond > 0.0) || !(beyond > hopform_touch_real(guard->motion, &start, &basis))) {
        return false;
    }
    for (int n = 0; n < 100; n++) {
        if (n > 0) {
            basis = hopform_basis_at_real(guard->poles, t);
        }
        const hopform_approach_real to = hopform_approach_of_real(guard->poles, guard->motion, &start, sign, &basis);
        if (to.at.value > 0.0) {
            high = t;
        } else {
            low = t;
        }
        if (fabs_real(to.at.value) <= HOPFORM_EPS_real * t * to.at.rate) {
            break;
        }
        const real step = hopform_step_to_root_real(&to.at);
        real next = t - step;
        const bool inside = to.at.rate > 0.0 && next > low && next < high;
        if (inside && hopform_is_last_step_real(guard->poles, &to.at, to.fourth, next, step)) {
            basis = hopform_carried_basis_real(guard->poles, &basis, next - t);
            t = next;
            break;
        }
        next = inside && !(n > 8 && n % 2 == 1) ? next : low + 0.5 * (high - low);
        if (!(next > low && next < high)) {
            break;
        }
        t = next;
    }
    end->t = t;
    end->basis = basis;
    return true;
}

/* While nothing happens in many half turns: up to where all watches are known to keep quiet, `from` if that is not far.
 */
static real quiet_until_real(const stance_guard_real *guard, real from, real limit)
{
    for (real reach = limit - from; reach > 8.0 * guard->half_turn; reach *= 0.125) {
        bool quiet = true;
        for (int32_t n = 0; n < guard->count && quiet; n++) {
            quiet = hopform_is_quiet_real(&guard->watch[n], guard->poles, from, from + reach);
        }
        if (quiet) {
            return from + reach;
        }
    }
    return from;
}

/* A watch that is below zero already when the phase begins; -1 if there is none. */
static int32_t lost_at_once_real(stance_guard_real *guard)
{
    for (int32_t n = 0; n < guard->count; n++) {
        if (guard->from[n].value < 0.0) {
            if (guard->from[n].rate <= 0.0) {
                return n;
            }
            guard->from[n].value = 0.0;
        }
    }
    return -1;
}

/* At the time of the limit a take-off comes before it, and before mass 2 comes to rest what mass 1 does. */
static void cross_at_the_limit_real(const stance_guard_real *guard, real limit, window_real *end)
{
    for (int32_t n = 0; n < guard->count && end->found < 0 && !(end->t < limit); n++) {
        const bool is_first = is_takeoff_real(guard, n)
                              || (guard->watch[n].kind == END_THRESHOLD_1_real && guard->halts == END_VELOCITY_2_real
                                  && !(guard->halt > limit));
        const hopform_sample_real *at = &end->at[n];
        const bool crosses = at->rate * limit < -16.0 * at->noise; /* and does not just touch */
        if (is_first && crosses && at->value < -8.0 * HOPFORM_EPS_real * limit * at->rate) {
            end->found = n;
        }
    }
}

/* What ends the phase at the end of its last window. */
static stance_phase_end_real end_of_real(const stance_guard_real *guard, const window_real *end, bool stops, real limit)
{
    stance_phase_end_real result = {end->t, STANCE_END_LIMIT_real, 0, end->basis, 0.0};
    const bool halts = !(guard->halt > limit) && !(end->t < limit * (1.0 - 8.0 * HOPFORM_EPS_real));
    const bool wins =
        guard->halts != END_VELOCITY_2_real && !is_takeoff_real(guard, end->found); /* over mass 2 at the same time */
    if (stops) {
        result.kind = STANCE_END_STOP_real;
    } else if (end->found >= 0 && !(halts && wins)) {
        result.kind = (stance_end_kind_real)guard->watch[end->found].kind;
        result.side = guard->watch[end->found].side;
    } else if (halts) {
        result.kind = guard->halts;
    }
    return result;
}

/* A take-off late in a phase: its time with all its digits. True if it comes later, so that something else may come
 * first. */
static bool sharpen_takeoff_real(const stance_chain_real *chain, const stance_guard_real *guard, real limit,
                                 window_real *end)
{
    const int32_t found = end->found;
    if (found < 0 || !is_takeoff_real(guard, found) || !(fabs_real(end->basis.Wdd) < 0.25)) {
        return false;
    }
    const hopform_watch_real *leg = &guard->watch[found];
    const hopform_state_real slack = {0.0, 0.0, 0.0, 0.0};
    const hopform_motion_real from_slack =
        hopform_motion_of_real(chain->plan, &slack, chain->steps[chain->step].u, chain->side_1, chain->side_2);
    const real settled = hopform_settled_y_real(guard->poles, from_slack.H2_y, from_slack.H1_y);
    const real before = end->t;
    for (int n = 0; n < 4; n++) {
        const real later =
            hopform_root_is_later_real(guard->poles, &leg->numerator, leg->start, settled, &end->basis, end->t);
        if (!(fabs_real(later) > 0.0) || end->t + later > limit) {
            break;
        }
        close_window_real(guard, end, end->t + later);
        end->found = found;
    }
    return end->t > before;
}

/* The first event of the phase that starts at the chain's state. */
static stance_phase_end_real stance_find_end_real(const stance_chain_real *chain, const hopform_poles_real *poles,
                                                  const hopform_motion_real *motion, real until)
{
    const hopform_basis_real start = {1.0, 0.0, 0.0, 0.0, 0.0};
    if (chain->side_1 == 0 && chain->side_2 == 0) {
        const stance_phase_end_real result = {until, STANCE_END_LIMIT_real, 0, start, 0.0};
        return result;
    }
    stance_guard_real guard = {0};
    put_guard_real(&guard, chain, poles, motion);
    const real limit = guard.halt < until ? guard.halt : until;
    window_real end = {0};
    end.basis = start;
    end.found = lost_at_once_real(&guard);
    bool stops = false;
    int32_t patience = 8;
    for (int32_t windows = 0; end.found < 0 && !stops && end.t < limit;
         windows = windows > 3 ? windows : windows + 1) { /* more are not told apart */
        const real low = end.t;
        real quiet = low;
        if (--patience <= 0) {
            quiet = quiet_until_real(&guard, low, limit);
            patience = quiet > low ? 1 : 8;
        }
        if (quiet > low) {
            close_window_real(&guard, &end, quiet);
        } else {
            reach_ahead_real(&guard, low, limit, windows, &end);
            bool later = true; /* once at most, and then what else happens by then is looked at */
            for (int n = 0; n < 2 && later; n++) {
                settle_window_real(&guard, low, &end);
                cross_at_the_limit_real(&guard, limit, &end);
                later = n == 0 && sharpen_takeoff_real(chain, &guard, limit, &end);
            }
        }
        const real t = end.t;
        stops = meets_stop_real(chain, &guard, &end)
                && !(is_takeoff_real(&guard, end.found) && t <= end.t * (1.0 + 8.0 * HOPFORM_EPS_real));
        for (int32_t n = 0; n < guard.count && end.found < 0 && !stops; n++) {
            guard.from[n] = end.at[n];
            guard.from[n].value = end.at[n].value > 0.0 ? end.at[n].value : 0.0;
        }
    }
    stance_phase_end_real result = end_of_real(&guard, &end, stops, limit);
    if (result.kind == END_VELOCITY_1_real) {
        const hopform_state_real ahead = from_stop_real(chain);
        result.touch = hopform_is_finite_real(ahead.x1) ? hopform_touch_real(motion, &ahead, &end.basis) : 0.0;
    }
    return result;
}

/* ---- the chain ---- */

static void stance_record_real(stance_chain_real *chain, int event)
{
    if (chain->count < chain->capacity) {
        hopform_phase_real *phase = &chain->phases[chain->count];
        phase->t = chain->t;
        phase->x1 = chain->state.x1;
        phase->v1 = chain->state.v1;
        phase->v2 = chain->state.v2;
        phase->y = chain->state.y;
        phase->mode = (int8_t)(3 * (chain->side_1 + 1) + chain->side_2 + 1);
        phase->event = (int8_t)event;
        phase->step = (uint16_t)chain->step;
    }
    if (event != HOPFORM_EVENT_NONE && chain->count < chain->max_phases && chain->event_count < chain->count) {
        chain->event_count++;
    }
    chain->count++;
}

static void after_rest_real(stance_chain_real *chain, int mass, int side_before, int event_if_it_sticks,
                            int event_if_it_reverses)
{
    stance_settle_real(chain, mass == 1, mass == 2);
    const int side = mass == 1 ? chain->side_1 : chain->side_2;
    if (side == 0) {
        stance_record_real(chain, event_if_it_sticks);
    } else if (side != side_before) {
        stance_record_real(chain, event_if_it_reverses);
    } else {
        stance_record_real(chain, HOPFORM_EVENT_NONE); /* a touch: it goes on */
    }
}

/* The actuator has come to rest, or has met a stop. One that it touches where it turns is no event, but that is where
 * it is. */
static void end_of_velocity_1_real(stance_chain_real *chain, const stance_phase_end_real *end)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const int before = chain->side_1;
    const real stop = before > 0 ? robot->x1_max : robot->x1_min;
    const real gap = before > 0 ? chain->from_max : chain->from_min;
    const bool hits = end->kind == STANCE_END_STOP_real;
    chain->state.v1 = 0.0; /* inelastic */
    if (hits || fabs_real(gap) <= end->touch) {
        chain->state.x1 = stop;
        chain->from_min = stop - robot->x1_min;
        chain->from_max = stop - robot->x1_max;
    }
    after_rest_real(chain, 1, before, hits ? HOPFORM_EVENT_X1_HITS_STOP : HOPFORM_EVENT_X1_STICKS,
                    hits ? HOPFORM_EVENT_X1_HITS_STOP : HOPFORM_EVENT_X1_REVERSES);
}

/* The current takes its next value: what is held may begin to slip. */
static void next_step_real(stance_chain_real *chain)
{
    if (chain->step + 1 < chain->step_count) {
        chain->step++;
    }
    const bool held_1 = chain->side_1 == 0;
    const bool held_2 = chain->side_2 == 0;
    stance_settle_real(chain, held_1, held_2);
    const bool slips_1 = held_1 && chain->side_1 != 0;
    const bool slips_2 = held_2 && chain->side_2 != 0;
    stance_record_real(chain,
                       slips_1 ? HOPFORM_EVENT_X1_SLIPS : (slips_2 ? HOPFORM_EVENT_X2_SLIPS : HOPFORM_EVENT_NONE));
    if (slips_1 && slips_2) {
        stance_record_real(chain, HOPFORM_EVENT_X2_SLIPS);
    }
}

/* An actuator without any friction that stops while the forces on it cancel to all digits of the state: what is left of
 * them is its acceleration before, told by the motion where that has faded.
 */
static void keep_faint_acceleration_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                         const hopform_basis_real *basis)
{
    const hopform_rates_real *rates = &chain->plan->rates;
    if (chain->plan->robot.f1 > 0.0 || fabs_real(rates->a1_v1) > 0.0) {
        return;
    }
    const hopform_free_real at_rest =
        hopform_free_accelerations_real(rates, &chain->state, chain->steps[chain->step].u);
    if (!(fabs_real(at_rest.free_1) < 64.0 * HOPFORM_EPS_real * fabs_real(rates->a1_y * chain->state.y))) {
        return;
    }
    const real terms[] = {motion->H3_1 * basis->Wdd, motion->H2_1 * basis->Wd, motion->H1_1 * basis->W};
    const real rate = terms[0] + terms[1] + terms[2];
    if (fabs_real(rate) > 16.0 * HOPFORM_EPS_real * (fabs_real(terms[0]) + fabs_real(terms[1]) + fabs_real(terms[2]))) {
        chain->alone = 1;
        chain->free = rate;
    }
}

/* A mass that rings alone fades far below the digits of the state; its acceleration at rest is known from the motion.
 * Without friction nothing but the sign is left of it in the end, and that is kept.
 */
static void keep_free_acceleration_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                        const stance_phase_end_real *end)
{
    chain->alone = 0;
    if (end->kind == END_VELOCITY_1_real && chain->side_2 == 0) {
        const real back = fabs_real(motion->H3_1 * end->basis.Wdd + motion->H2_1 * end->basis.Wd);
        chain->alone = 1;
        chain->free = (real)chain->side_1
                      * (chain->plan->robot.f1 - (back > HOPFORM_UNDERFLOW_real ? back : HOPFORM_UNDERFLOW_real));
    } else if (end->kind == END_VELOCITY_2_real && chain->side_1 == 0) {
        const real back = fabs_real(motion->H3_2 * end->basis.Wdd + motion->H2_2 * end->basis.Wd);
        chain->alone = 2;
        chain->free = (real)chain->side_2
                      * (chain->plan->robot.f2 - (back > HOPFORM_UNDERFLOW_real ? back : HOPFORM_UNDERFLOW_real));
    } else if ((end->kind == END_VELOCITY_1_real || end->kind == STANCE_END_STOP_real) && chain->side_2 != 0) {
        keep_faint_acceleration_real(chain, motion, &end->basis);
    }
}

/* How far from its stops the actuator is at the end of a phase. */
static void keep_distances_real(stance_chain_real *chain, const hopform_motion_real *motion,
                                const stance_phase_end_real *end)
{
    if (chain->side_1 != 0) {
        hopform_state_real start = chain->state;
        start.x1 = 0.0;
        const hopform_at_real moved = hopform_state_at_real(&start, motion, &end->basis);
        chain->from_min += moved.x1_t;
        chain->from_max += moved.x1_t;
    }
}

/* The numerators of the next phase. */
static hopform_motion_real motion_from_real(const stance_chain_real *chain)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    hopform_motion_real motion =
        hopform_motion_of_real(chain->plan, &chain->state, chain->steps[chain->step].u, chain->side_1, chain->side_2);
    if (chain->alone == 1 && chain->side_1 != 0) {
        motion.H3_1 = chain->free - (real)chain->side_1 * robot->f1;
        motion.H2_y = chain->side_2 == 0 ? motion.H3_1 : motion.H2_y;
        motion.N2_1 = motion.H3_1; /* v_1 is 0 */
    } else if (chain->alone == 2 && chain->side_2 != 0) {
        motion.H3_2 = chain->free - (real)chain->side_2 * robot->f2;
        motion.H2_y = -motion.H3_2;
    }
    return motion;
}

/* The AED of a phase that lasts for t. */
static real aed_in_phase_real(const stance_chain_real *chain, real t)
{
    const hopform_state_real *state = &chain->state;
    const hopform_phase_real phase = {
        0.0, state->x1, state->v1, state->v2, state->y, (int8_t)(3 * (chain->side_1 + 1) + chain->side_2 + 1), 0, 0};
    const hopform_ledger_real ledger =
        hopform_ledger_in_phase_real(chain->plan, &phase, chain->steps[chain->step].u, t);
    return hopform_aed_of_ledger_real(&ledger);
}

/* The state and modes right after the end of a phase, recorded as the next phase. */
static void stance_pass_real(stance_chain_real *chain, const hopform_motion_real *motion,
                             const stance_phase_end_real *end)
{
    keep_free_acceleration_real(chain, motion, end);
    chain->fresh_1 = end->kind == END_THRESHOLD_1_real;
    chain->fresh_2 = end->kind == END_THRESHOLD_2_real;
    switch (end->kind) {
    case END_VELOCITY_1_real:
    case STANCE_END_STOP_real:
        end_of_velocity_1_real(chain, end);
        break;
    case END_VELOCITY_2_real: {
        const int before = chain->side_2;
        chain->state.v2 = 0.0;
        after_rest_real(chain, 2, before, HOPFORM_EVENT_X2_STICKS, HOPFORM_EVENT_X2_REVERSES);
        break;
    }
    case END_THRESHOLD_1_real:
        chain->side_1 = end->side;
        stance_record_real(chain, HOPFORM_EVENT_X1_SLIPS);
        break;
    case END_THRESHOLD_2_real:
        chain->side_2 = end->side;
        stance_record_real(chain, HOPFORM_EVENT_X2_SLIPS);
        break;
    case STANCE_END_LIMIT_real:
        next_step_real(chain);
        break;
    case END_TAKEOFF_real:
    default:
        break;
    }
}

static bool last_step_real(const stance_chain_real *chain)
{
    return chain->step + 1 >= chain->step_count;
}

/* The leg leaves the ground at once: y = 0, and its first non-zero derivative is negative. */
static bool extends_at_once_real(const stance_chain_real *chain)
{
    const real rate = chain->state.v1 - chain->state.v2;
    if (fabs_real(chain->state.y) > 0.0 || fabs_real(rate) > 0.0) {
        return !(fabs_real(chain->state.y) > 0.0) && rate < 0.0;
    }
    const hopform_motion_real motion =
        hopform_motion_of_real(chain->plan, &chain->state, chain->steps[chain->step].u, chain->side_1, chain->side_2);
    return fabs_real(motion.H2_y) > 0.0 ? motion.H2_y < 0.0 : motion.H1_y < 0.0;
}

/* What each mass does at the start; no event. */
static void stance_begin_real(stance_chain_real *chain)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    chain->side_1 = (int)stance_sign_of_real(chain->state.v1);
    chain->side_2 = (int)stance_sign_of_real(chain->state.v2);
    if (chain->side_1 != 0 && stance_blocked_real(chain, chain->side_1)) {
        chain->start_loss = -0.5 * robot->m_eff * chain->state.v1 * chain->state.v1;
        chain->state.v1 = 0.0;
        chain->side_1 = 0;
    }
    stance_settle_real(chain, chain->side_1 == 0, chain->side_2 == 0);
    stance_record_real(chain, HOPFORM_EVENT_NONE);
}

static int32_t stance_run_real(stance_chain_real *chain)
{
    stance_begin_real(chain);
    if (extends_at_once_real(chain)) {
        return HOPFORM_ENDING_TAKEOFF;
    }
    while (chain->count <= chain->max_phases) {
        if (chain->side_1 == 0 && chain->side_2 == 0 && last_step_real(chain)) {
            return HOPFORM_ENDING_REST;
        }
        const real until = chain->step + 1 >= chain->step_count || chain->steps[chain->step + 1].t > chain->horizon
                               ? chain->horizon
                               : chain->steps[chain->step + 1].t;
        const hopform_poles_real *poles = hopform_poles_of_real(chain->plan, chain->side_1, chain->side_2);
        const hopform_motion_real motion = motion_from_real(chain);
        const stance_phase_end_real end = stance_find_end_real(chain, poles, &motion, until - chain->t);
        chain->aed += chain->adds_up ? aed_in_phase_real(chain, end.t) : 0.0;
        keep_distances_real(chain, &motion, &end);
        chain->state = hopform_arrive_real(&chain->state, &motion, &end.basis, chain->side_1, chain->side_2);
        chain->t = end.kind == STANCE_END_LIMIT_real ? until : chain->t + end.t;
        if (end.kind == END_TAKEOFF_real) {
            chain->state.y = 0.0;
            return HOPFORM_ENDING_TAKEOFF;
        }
        if (end.kind == STANCE_END_LIMIT_real && !(until < chain->horizon)) {
            return HOPFORM_ENDING_HORIZON;
        }
        stance_pass_real(chain, &motion, &end);
    }
    chain->count = chain->max_phases; /* a step of the current may have begun two */
    return HOPFORM_ENDING_TOO_MANY_PHASES;
}

/* ---- what users call ---- */

static bool steps_are_sound_real(const hopform_step_real *steps, int32_t count)
{
    if (count < 1 || count > HOPFORM_MOST_STEPS || fabs_real(steps[0].t) > 0.0) {
        return false;
    }
    for (int32_t n = 0; n < count; n++) {
        if (!hopform_is_finite_real(steps[n].t) || !hopform_is_finite_real(steps[n].u)
            || (n > 0 && !(steps[n].t > steps[n - 1].t))) {
            return false;
        }
    }
    return true;
}

/* Whether what a stance is solved into holds some of what is read until its end. */
static bool stance_overwrites_inputs_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                          int32_t step_count, const hopform_phase_real *phases, int32_t capacity,
                                          const hopform_stance_real *stance)
{
    const hopform_memory_real read[] = {
        hopform_array_real(plan, 1, sizeof *plan),
        hopform_array_real(steps, step_count <= HOPFORM_MOST_STEPS ? step_count : 0, sizeof *steps),
    };
    const hopform_memory_real written[] = {
        hopform_array_real(phases, capacity, sizeof *phases),
        hopform_array_real(stance, 1, sizeof *stance),
    };
    return hopform_overlap_real(written, 2, read, 2);
}

static int32_t start_status_real(const hopform_robot_real *robot, const hopform_state_real *start)
{
    if (!hopform_is_finite_real(start->x1) || !hopform_is_finite_real(start->v1) || !hopform_is_finite_real(start->v2)
        || !hopform_is_finite_real(start->y) || !(start->x1 >= robot->x1_min && start->x1 <= robot->x1_max)) {
        return HOPFORM_ERROR_STATE;
    }
    return start->y < 0.0 ? HOPFORM_ERROR_EXTENDED : HOPFORM_OK;
}

static void stance_report_real(const stance_chain_real *chain, const hopform_state_real *start, int32_t ending,
                               hopform_stance_real *stance)
{
    const hopform_robot_real *robot = &chain->plan->robot;
    const hopform_state_real *end = &chain->state;
    const hopform_at_real at = {end->x1, end->v1, end->v2, end->y};
    stance->duration = chain->t;
    stance->end = *end;
    stance->aed = chain->adds_up ? chain->aed : hopform_body_energy_gain_real(robot, start, &at);
    stance->start_loss = chain->start_loss;
    stance->ending = ending;
    stance->phase_count = chain->count;
    stance->event_count = chain->event_count;
    stance->phases_kept = chain->count < chain->capacity ? chain->count : chain->capacity;
    stance->apex = 0.0;
    if (ending == HOPFORM_ENDING_TAKEOFF && robot->g > 0.0) {
        stance->apex = hopform_apex_of_takeoff_real(robot, end->x1, end->v2 > 0.0 ? end->v2 : 0.0);
    }
}

/* Fill a plan from its robot. */
static int32_t fill_plan_real(hopform_plan_real *plan)
{
    const hopform_robot_real *robot = &plan->robot;
#define OR_OUTSIDE(name, domain) || !HOPFORM_IN_##domain##_real(robot->name)
    if (!(robot->x1_min <= robot->x1_max) HOPFORM_ROBOT_MEMBERS(OR_OUTSIDE)) {
#undef OR_OUTSIDE
        return HOPFORM_ERROR_ROBOT;
    }
    const real lighter = robot->m_eff < robot->m_s ? robot->m_eff : robot->m_s;
    if (!(lighter * lighter > 0.0)) { /* derivatives by the masses divide by their squares */
        return HOPFORM_ERROR_NUMBERS;
    }
    const hopform_rates_real rates = hopform_rates_of_real(robot);
#define REFUSE_IF_NEGATIVE(value)                                                                                      \
    if ((value) < 0.0) {                                                                                               \
        return HOPFORM_ERROR_UNSTABLE;                                                                                 \
    }
    HOPFORM_STABILITY(REFUSE_IF_NEGATIVE)
#undef REFUSE_IF_NEGATIVE
    const hopform_poles_real actuator = {0.0, rates.p_1, rates.q_1, rates.p_1, rates.q_1, 0.0};
    const hopform_poles_real body = {0.0, rates.p_2, rates.q_2, rates.p_2, rates.q_2, 0.0};
    const hopform_poles_real both = hopform_factor_cubic_real(rates.s_1, rates.s_2, rates.s_3);
    if (!hopform_is_finite_real(rates.s_1) || !hopform_is_finite_real(rates.s_2) || !hopform_is_finite_real(rates.s_3)
        || !hopform_is_finite_real(both.a) || !hopform_is_finite_real(both.p)
        || !(both.q > 0.0 && both.q <= HOPFORM_NEVER_real) || !hopform_is_finite_real(rates.a1_0)
        || !hopform_is_finite_real(rates.a1_u)) {
        return HOPFORM_ERROR_NUMBERS;
    }
    plan->rates = rates;
    plan->both = both;
    plan->actuator = actuator;
    plan->body = body;
    plan->made = HOPFORM_PLAN_MADE;
    return HOPFORM_OK;
}

int32_t hopform_plan_init_real(hopform_plan_real *plan, const hopform_robot_real *robot)
{
    if (plan == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const hopform_robot_real none = {0};
    const hopform_plan_real zero = {0};
    const hopform_robot_real own = robot != NULL ? *robot : none; /* it may lie in the plan */
    plan->made = 0;
    plan->robot = own;
    const int32_t status = robot != NULL ? fill_plan_real(plan) : HOPFORM_ERROR_NULL;
    if (status < 0) {
        *plan = zero;
    }
    return status;
}

int32_t hopform_solve_stance_real(const hopform_plan_real *plan, const hopform_state_real *start,
                                  const hopform_step_real *steps, int32_t step_count, real horizon, int32_t max_phases,
                                  hopform_phase_real *phases, int32_t capacity, hopform_stance_real *stance)
{
    if (stance == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const hopform_state_real nothing = {0.0, 0.0, 0.0, 0.0};
    const hopform_state_real from = start != NULL ? *start : nothing; /* it may lie in the stance or in the phases */
    const hopform_stance_real zero = {0};
    *stance = zero;
    if (plan == NULL || start == NULL || steps == NULL || (phases == NULL && capacity > 0)) {
        return HOPFORM_ERROR_NULL;
    }
    if (stance_overwrites_inputs_real(plan, steps, step_count, phases, capacity, stance)) {
        return HOPFORM_ERROR_OVERLAP;
    }
    if (!hopform_is_made_real(plan)) {
        return HOPFORM_ERROR_ROBOT;
    }
    const int32_t status = start_status_real(&plan->robot, &from);
    if (status < 0) {
        return status;
    }
    if (!steps_are_sound_real(steps, step_count)) {
        return HOPFORM_ERROR_STEPS;
    }
    if (!(horizon > 0.0 && horizon <= HOPFORM_NEVER_real) || max_phases < 1 || capacity < 0) {
        return HOPFORM_ERROR_HORIZON;
    }
    stance_chain_real chain = {plan,
                               steps,
                               step_count,
                               0,
                               horizon,
                               0.0,
                               from,
                               from.x1 - plan->robot.x1_min,
                               from.x1 - plan->robot.x1_max,
                               0,
                               0,
                               false,
                               false,
                               0,
                               0.0,
                               0.0,
                               hopform_stores_much_real(&plan->robot, &from),
                               0.0,
                               max_phases,
                               phases,
                               capacity,
                               0,
                               0};
    const int32_t ending = stance_run_real(&chain);
    stance_report_real(&chain, &from, ending, stance);
    if (!hopform_is_finite_real(stance->duration) || !hopform_is_finite_real(stance->end.x1)
        || !hopform_is_finite_real(stance->end.v1) || !hopform_is_finite_real(stance->end.v2)
        || !hopform_is_finite_real(stance->end.y) || !hopform_is_finite_real(stance->apex)
        || !hopform_is_finite_real(stance->aed) || !hopform_is_finite_real(stance->start_loss)) {
        *stance = zero;
        return HOPFORM_ERROR_NUMBERS;
    }
    return stance->phases_kept < stance->phase_count ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK;
}

/* The state at a time, and the status; a refusal writes no state. */
static int32_t read_state_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                               const hopform_phase_real *phases, const hopform_stance_real *stance, real t,
                               hopform_state_real *state)
{
    if (plan == NULL || steps == NULL || phases == NULL || stance == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const bool rests = stance->ending == HOPFORM_ENDING_REST;
    if (!hopform_is_made_real(plan)) {
        return HOPFORM_ERROR_ROBOT;
    }
    if (!(t >= 0.0 && t <= HOPFORM_NEVER_real) || (t > stance->duration && !rests)
        || stance->phases_kept < stance->phase_count || stance->phases_kept < 1) {
        return HOPFORM_ERROR_TIME;
    }
    const real within = t < stance->duration ? t : stance->duration;
    const hopform_phase_real *phase = &phases[hopform_phase_index_real(phases, stance->phases_kept, within)];
    *state = hopform_state_in_phase_real(plan, phase, steps[phase->step].u, within - phase->t);
    return HOPFORM_OK;
}

int32_t hopform_stance_at_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                               const hopform_phase_real *phases, const hopform_stance_real *stance, real t,
                               hopform_state_real *state)
{
    if (state == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    hopform_state_real found = {0.0, 0.0, 0.0, 0.0}; /* the state may lie in what is read */
    const int32_t status = read_state_real(plan, steps, phases, stance, t, &found);
    *state = found;
    return status;
}
