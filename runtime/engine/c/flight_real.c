/* SPDX-License-Identifier: MIT-0
 *
 * A flight as a chain of phases: the body is ballistic, the actuator returns under the law or at the limit of its
 * current, slips or is held. It ends at the first downward crossing of the ground ahead by the foot.
 *
 * Nothing is stepped over. In a phase v_1, the jerk and the rate of the law's pull are motions of the pair of poles
 * alone, whose zeros rule 3 of docs/explanation/certificate.md has in closed form. A phase in which the actuator slips
 * ends at the latest where v_1 vanishes, within a half turn of the pair, so the jerk and the pull's rate change sign at
 * most once in it. Between its change of sign the pull is monotone; between those of the jerk so is the foot's
 * acceleration, between the roots of that its rate, between the roots of that the foot itself: each root is bracketed.
 * A leg in which a damper acts relaxes as exp(-l t), and the foot with it: (D + l) takes that from the foot's third
 * derivative and leaves a motion of the pair, whose zero is where this derivative begins to have another root.
 */
#include "facts.h"
#include "first_event_real.h"
#include "overlap_real.h"

enum { MOST_POINTS_real = HOPFORM_LEG_HAS_DAMPER ? 17 : 9, MOST_TURNS_real = 3 };

/* How a phase ends. */
typedef enum {
    FLIGHT_END_LIMIT_real,
    END_VELOCITY_real,
    FLIGHT_END_STOP_real,
    END_PULL_real,
    END_TOUCHDOWN_real
} flight_end_kind_real;

/* What has a root; the foot's derivatives by their order. */
typedef enum {
    FOOT_real,
    FOOT_RATE_real,
    FOOT_CURVATURE_real,
    FOOT_THIRD_real,
    WAY_real,
    PULL_real
} function_of_time_real;

/* Everything at one time of a phase. */
typedef struct {
    real t; /* since the phase began */
    hopform_actuator_at_real actuator;
    hopform_pull_real pull;
    hopform_foot_at_real foot;
} instant_real;

/* What is kept of an instant where there are many: the foot there. The whole of it is looked up again by its time. */
typedef struct {
    real t;
    jet_real foot;
    real moved;
} foot_point_real;

typedef struct {
    instant_real at;
    flight_end_kind_real kind;
    int limit; /* of END_PULL: what the motor does from here on */
} flight_phase_end_real;

/* The chain while it grows. */
typedef struct {
    const hopform_robot_real *robot;
    hopform_gains_real gains;
    hopform_flight_rates_real rates;
    real largest;
    real horizon;
    real x1; /* at take-off, as the next two */
    real y;
    real v2;
    real leg; /* compression that a damper leaves in it, and the rate at which it relaxes */
    real relaxes;
    real t;
    hopform_actuator_real actuator;
    hopform_ballistic_real ballistic;
    hopform_poles_real poles;
    instant_real first; /* of the phase */
    int side;
    int limit;
    bool airborne;
    real start_loss;
    int32_t max_phases;
    hopform_flight_phase_real *phases;
    int32_t capacity;
    int32_t count;
    int32_t event_count;
    real highest; /* of the foot, while it is not above the ground yet: where and when */
    real highest_t;
    hopform_state_real highest_state;
    int32_t highest_count;
    int32_t highest_event_count;
} flight_chain_real;

/* x_1, which rounding or underflow may have put a last digit beyond a stop. */
static real within_stroke_real(const hopform_robot_real *robot, real x1)
{
    if (x1 < robot->x1_min) {
        return robot->x1_min;
    }
    return x1 > robot->x1_max ? robot->x1_max : x1;
}

static real stop_ahead_real(const hopform_robot_real *robot, int side)
{
    return side > 0 ? robot->x1_max : robot->x1_min;
}

/* ---- a phase over time ---- */

/* The largest force of the motor, 0 if it has none. */
static real largest_force_real(const hopform_robot_real *robot)
{
    if (!(fabs_real(robot->gamma2) > 0.0)) {
        return 0.0;
    }
    const real force = fabs_real(robot->gamma2) * robot->u_max;
    return hopform_lesser_real(force, HOPFORM_NEVER_real);
}

static hopform_poles_real poles_in_flight_real(const hopform_flight_rates_real *rates, int limit)
{
    const real p = limit == 0 ? rates->p_law : rates->p_free;
    const real q = limit == 0 ? rates->q_law : 0.0;
    const hopform_poles_real poles = {0.0, p, q, p, q, 0.0};
    return poles;
}

/* R, its derivative and its integral; with q = 0 R is the integral of exp(-p t). */
static hopform_pair_real response_at_real(const hopform_poles_real *poles, real t)
{
    if (!(t > 0.0)) {
        const hopform_pair_real start = {1.0, 0.0, 0.0, 0.0, 0.0};
        return start;
    }
    if (poles->q > 0.0) {
        return hopform_pair_at_real(poles, t);
    }
    const hopform_decay_real decay = hopform_decay_at_real(poles->p, t);
    const hopform_pair_real pair = {decay.e, decay.e1, decay.e2, decay.e3, 0.0};
    return pair;
}

static hopform_actuator_at_real move_real(const hopform_actuator_real *actuator, const hopform_poles_real *poles,
                                          int side, real t)
{
    if (side == 0) {
        const hopform_actuator_at_real held = {0.0, 0.0, 0.0, 0.0};
        return held;
    }
    const hopform_pair_real pair = response_at_real(poles, t);
    return hopform_actuator_in_flight_real(actuator, poles, &pair);
}

/* What is left of the leg's compression. */
static real leg_at_real(const flight_chain_real *chain, real t)
{
    return HOPFORM_LEG_HAS_DAMPER ? chain->leg * hopform_exp_real(-chain->relaxes * (chain->t + t)) : 0.0;
}

static instant_real look_real(const flight_chain_real *chain, real t)
{
    instant_real now;
    now.t = t;
    now.actuator = move_real(&chain->actuator, &chain->poles, chain->side, t);
    now.pull = hopform_pull_of_law_real(&chain->gains, &chain->actuator, &now.actuator);
    now.foot = hopform_foot_in_flight_real(chain->robot, &chain->ballistic, &now.actuator, t);
    if (HOPFORM_LEG_HAS_DAMPER) {
        const real leg = leg_at_real(chain, t);
        now.foot.foot_t += leg;
        now.foot.foot_rate -= chain->relaxes * leg;
        now.foot.foot_curvature += chain->relaxes * chain->relaxes * leg;
    }
    return now;
}

/* A function at an instant, with its derivatives up to the fourth. */
static approach_real sample_of_real(const flight_chain_real *chain, const instant_real *at,
                                    function_of_time_real function)
{
    const hopform_actuator_at_real *x = &at->actuator;
    const hopform_foot_at_real *foot = &at->foot;
    const hopform_pull_real *pull = &at->pull;
    const real p = chain->poles.p;
    const real q = chain->poles.q;
    const real snap = -p * x->jerk1_t - q * x->acc1_t;
    if (function == WAY_real) {
        const approach_real way = {{x->moved, x->v1_t, x->acc1_t, x->jerk1_t}, snap};
        return way;
    }
    if (function == PULL_real) {
        const real third = -p * pull->pull_curvature - q * pull->pull_rate;
        const approach_real force = {{pull->pull, pull->pull_rate, pull->pull_curvature, third},
                                     -p * third - q * pull->pull_curvature};
        return force;
    }
    const real crackle = -p * snap - q * x->jerk1_t;
    real of[] = {foot->foot_t, foot->foot_rate, foot->foot_curvature,  -x->jerk1_t,
                 -snap,        -crackle,        p * crackle + q * snap};
    if (HOPFORM_LEG_HAS_DAMPER) {
        real share = -chain->relaxes * chain->relaxes * chain->relaxes * leg_at_real(chain, at->t);
        for (int n = 3; n < 7; n++) { /* the first three have theirs */
            of[n] += share;
            share *= -chain->relaxes;
        }
    }
    const real *from = &of[function];
    const approach_real of_foot = {{from[0], from[1], from[2], from[3]},
                                   HOPFORM_LEG_HAS_DAMPER ? HOPFORM_NEVER_real : from[4]};
    return of_foot;
}

/* ---- roots ---- */

/* The one root of sign (f - level) between a time where it is positive and one where it is negative, looked for from
 * `last` on. */
static instant_real root_from_real(const flight_chain_real *chain, function_of_time_real function, real sign,
                                   real level, real low, real high, instant_real last)
{
    for (int n = 0; n < 100; n++) {
        const approach_real at = sample_of_real(chain, &last, function);
        const jet_real jet = {sign * (at.at.value - level), sign * at.at.rate, sign * at.at.curvature,
                              sign * at.at.third};
        const root_step_real step = step_between_real(&chain->poles, &jet, at.fourth, last.t, low, high);
        low = step.low;
        high = step.high;
        const bool follows = step.inside && !(n > 8 && n % 2 == 1);
        const real next = follows ? step.next : low + 0.5 * (high - low);
        if (step.arrives || !(next > low && next < high)) {
            return last;
        }
        last = look_real(chain, next);
        if (follows && step.lands) {
            return last;
        }
    }
    return last;
}

/* The same from its end on. */
static instant_real root_between_real(const flight_chain_real *chain, function_of_time_real function, real sign,
                                      real level, real low, const instant_real *end)
{
    return root_from_real(chain, function, sign, level, low, end->t, *end);
}

static foot_point_real foot_point_of_real(const flight_chain_real *chain, const instant_real *at)
{
    const foot_point_real point = {at->t, sample_of_real(chain, at, FOOT_real).at, at->actuator.moved};
    return point;
}

static real derivative_of_real(const foot_point_real *point, function_of_time_real function)
{
    const real of[] = {point->foot.value, point->foot.rate, point->foot.curvature, point->foot.third};
    return of[function];
}

/* Where a derivative of the foot changes sign between two points, between which it does so at most once;
 * false if it does not. */
static bool changes_between_real(const flight_chain_real *chain, function_of_time_real function,
                                 const foot_point_real *from, const foot_point_real *to, foot_point_real *root)
{
    const real before = derivative_of_real(from, function);
    const real after = derivative_of_real(to, function);
    if (!((before > 0.0 && after < 0.0) || (before < 0.0 && after > 0.0))) {
        return false;
    }
    const instant_real end = look_real(chain, to->t);
    const instant_real found = root_between_real(chain, function, before > 0.0 ? 1.0 : -1.0, 0.0, from->t, &end);
    *root = foot_point_of_real(chain, &found);
    return root->t > from->t && root->t < to->t;
}

/* Put the roots of a function, monotone between the points, among them; the new number of points. */
static int split_real(const flight_chain_real *chain, function_of_time_real function, foot_point_real *points,
                      int count)
{
    for (int n = 0; n < count - 1 && count < MOST_POINTS_real; n++) {
        foot_point_real root = points[n];
        if (changes_between_real(chain, function, &points[n], &points[n + 1], &root)) {
            for (int m = count; m > n + 1; m--) {
                const foot_point_real before = points[m - 1];
                points[m] = before;
            }
            points[n + 1] = root;
            count++;
            n++; /* between its root and the next point it keeps its sign */
        }
    }
    return count;
}

/* When a motion of the pair, which begins with a value and a rate, first vanishes behind the start of the phase; NEVER
 * if it does not. */
static real zero_of_pair_real(const hopform_poles_real *poles, real value, real rate)
{
    const real sign = hopform_goes_real(fabs_real(value) > 0.0 ? value : rate, 0.0);
    return time_to_rest_real(poles, sign * value, sign * rate);
}

/* When the jerk changes its sign, or what (D + l) leaves of it where the leg relaxes. */
static real turn_of_jerk_real(const flight_chain_real *chain)
{
    const hopform_actuator_at_real *x = &chain->first.actuator;
    const real p = chain->poles.p;
    const real q = chain->poles.q;
    const real snap = -p * x->jerk1_t - q * x->acc1_t;
    if (HOPFORM_LEG_HAS_DAMPER) {
        const real crackle = -p * snap - q * x->jerk1_t;
        return zero_of_pair_real(&chain->poles, snap + chain->relaxes * x->jerk1_t, crackle + chain->relaxes * snap);
    }
    return zero_of_pair_real(&chain->poles, x->jerk1_t, snap);
}

/* ---- the end of a phase ---- */

/* Whether x_1 is at the stop ahead within rounding. */
static bool is_at_stop_real(const flight_chain_real *chain, const instant_real *at)
{
    const real stop = stop_ahead_real(chain->robot, chain->side);
    const real beyond = at->actuator.moved - (stop - chain->actuator.x1);
    return hopform_is_finite_real(stop)
           && fabs_real(beyond)
                  <= 16.0 * HOPFORM_EPS_real
                         * (fabs_real(stop) + fabs_real(chain->actuator.x1) + fabs_real(at->actuator.moved));
}

/* The stop ahead; x_1 is monotone in a phase, so it has met it if it is beyond it at the end. One that comes to rest
 * there is at it when its velocity says so. */
static void watch_stop_real(const flight_chain_real *chain, flight_phase_end_real *end)
{
    const real stop = stop_ahead_real(chain->robot, chain->side);
    const real sign = (real)chain->side;
    const real way = stop - chain->actuator.x1;
    if (end->kind == END_VELOCITY_real && is_at_stop_real(chain, &end->at)) {
        end->kind = FLIGHT_END_STOP_real;
        return;
    }
    if (hopform_is_finite_real(stop) && sign * (end->at.actuator.moved - way) > 0.0) {
        end->at = root_between_real(chain, WAY_real, -sign, way, 0.0, &end->at);
        end->kind = FLIGHT_END_STOP_real;
    }
}

static real noise_of_pull_real(const flight_chain_real *chain, const instant_real *at)
{
    return 16.0 * HOPFORM_EPS_real
           * (chain->largest + chain->gains.Kp * (fabs_real(chain->actuator.x1) + fabs_real(at->actuator.moved))
              + chain->gains.Kd * (fabs_real(chain->actuator.v1) + fabs_real(at->actuator.v1_t)));
}

/* Where the pull passes the motor's limit of a side, outwards if that is the limit from there on, on pieces on which
 * the pull is monotone; a touch is none. */
static void watch_level_real(const flight_chain_real *chain, const instant_real *points, int count, int side, int limit,
                             flight_phase_end_real *end)
{
    const real sign = (real)(limit != 0 ? side : -side);
    const real level = (real)side * chain->largest;
    for (int n = 1; n < count; n++) {
        const instant_real *from = &points[n - 1];
        const bool crosses = sign * (level - from->pull.pull) > 0.0;
        const real after = sign * (level - points[n].pull.pull);
        if (after < -noise_of_pull_real(chain, &points[n])) {
            const instant_real root =
                crosses ? root_between_real(chain, PULL_real, -sign, level, from->t, &points[n]) : *from;
            if (root.t < end->at.t) {
                end->at = root;
                end->kind = END_PULL_real;
                end->limit = limit;
            }
            return;
        }
    }
}

/* Where the current reaches its limit or leaves it. */
static void watch_pull_real(const flight_chain_real *chain, flight_phase_end_real *end)
{
    if (!(chain->gains.Kp > 0.0 || chain->gains.Kd > 0.0)) {
        return;
    }
    instant_real points[MOST_TURNS_real];
    int count = 0;
    points[count++] = chain->first;
    const hopform_pull_real *pull = &chain->first.pull;
    const real turn = zero_of_pair_real(&chain->poles, pull->pull_rate, pull->pull_curvature);
    if (turn < end->at.t) {
        points[count++] = look_real(chain, turn);
    }
    points[count++] = end->at;
    if (chain->limit == 0) {
        watch_level_real(chain, points, count, 1, 1, end);
        watch_level_real(chain, points, count, -1, -1, end);
    } else {
        watch_level_real(chain, points, count, chain->limit, 0, end);
    }
}

static real noise_of_foot_real(const flight_chain_real *chain, real t, real moved)
{
    const real way = fabs_real(chain->ballistic.foot) + fabs_real(chain->ballistic.v2 * t)
                     + 0.5 * hopform_fall_of_real(chain->robot) * t * t + fabs_real(moved);
    return 16.0 * HOPFORM_EPS_real * (HOPFORM_LEG_HAS_DAMPER ? way + fabs_real(chain->leg) : way);
}

/* True if the foot certainly stays above the ground: the lower end of the body's parabola over the higher one of x_1.
 */
static bool stays_above_real(const flight_chain_real *chain, const instant_real *last)
{
    const real moved = last->actuator.moved;
    const real fallen = last->foot.foot_t + moved;
    return hopform_lesser_real(chain->ballistic.foot, fallen) - hopform_greater_real(moved, 0.0) > 0.0;
}

static hopform_state_real state_of_real(const flight_chain_real *chain, const instant_real *at)
{
    const real x1 = within_stroke_real(chain->robot, chain->actuator.x1 + at->actuator.moved);
    const hopform_state_real state = {
        x1, at->actuator.v1_t, chain->v2 - hopform_fall_of_real(chain->robot) * (chain->t + at->t),
        HOPFORM_LEG_HAS_DAMPER ? leg_at_real(chain, at->t) - at->foot.foot_t : -at->foot.foot_t};
    return state;
}

/* Time since take-off, not behind the horizon by rounding. */
static real time_of_real(const flight_chain_real *chain, const instant_real *at)
{
    return hopform_lesser_real(chain->t + at->t, chain->horizon);
}

static void remember_highest_real(flight_chain_real *chain, const instant_real *at)
{
    if (at->foot.foot_t > chain->highest) {
        chain->highest = at->foot.foot_t;
        chain->highest_t = time_of_real(chain, at);
        chain->highest_state = state_of_real(chain, at);
        chain->highest_count = chain->count;
        chain->highest_event_count = chain->event_count;
    }
}

/* True if the foot's way is certainly concave: its acceleration, monotone because the jerk keeps its sign, is negative
 * at both ends. */
static bool is_concave_real(const flight_chain_real *chain, const instant_real *last)
{
    if (!(chain->first.foot.foot_curvature < 0.0 && last->foot.foot_curvature < 0.0)) {
        return false;
    }
    return chain->side == 0 || !(turn_of_jerk_real(chain) < last->t);
}

/* A concave way of the foot has one root behind its start; it is looked for from where the body alone would come down.
 */
static void land_real(const flight_chain_real *chain, flight_phase_end_real *end)
{
    const real v2 = chain->ballistic.v2;
    const real g = hopform_fall_of_real(chain->robot);
    const real square = v2 * v2 + 2.0 * g * (chain->ballistic.foot - end->at.actuator.moved);
    const real guess = square > 0.0 ? (v2 + sqrt_real(square)) / g : 0.0;
    const instant_real from = guess > 0.0 && guess < end->at.t ? look_real(chain, guess) : end->at;
    end->at = root_from_real(chain, FOOT_real, 1.0, 0.0, 0.0, end->at.t, from);
    end->kind = END_TOUCHDOWN_real;
}

/* The foot's first downward crossing of the ground, or where it gets above it, on pieces on which it is monotone. */
static void search_foot_real(flight_chain_real *chain, flight_phase_end_real *end)
{
    foot_point_real points[MOST_POINTS_real] = {0};
    int count = 0;
    points[count++] = foot_point_of_real(chain, &chain->first);
    const real turn = chain->side == 0 ? HOPFORM_NEVER_real : turn_of_jerk_real(chain);
    if (turn < end->at.t) {
        const instant_real there = look_real(chain, turn);
        points[count++] = foot_point_of_real(chain, &there);
    }
    points[count++] = foot_point_of_real(chain, &end->at);
    count = HOPFORM_LEG_HAS_DAMPER ? split_real(chain, FOOT_THIRD_real, points, count) : count;
    count = split_real(chain, FOOT_CURVATURE_real, points, count);
    count = split_real(chain, FOOT_RATE_real, points, count);
    for (int n = 1; n < count; n++) {
        const foot_point_real *from = &points[n - 1];
        const foot_point_real *to = &points[n];
        const real noise = noise_of_foot_real(chain, to->t, to->moved);
        const bool falls = to->foot.value < from->foot.value;
        if (chain->airborne && falls && to->foot.value < 0.0
            && (to->foot.value < -noise || to->foot.rate * to->t < -noise)) {
            const instant_real last = look_real(chain, from->foot.value > 0.0 ? to->t : from->t);
            end->at = from->foot.value > 0.0 ? root_between_real(chain, FOOT_real, 1.0, 0.0, from->t, &last) : last;
            end->kind = END_TOUCHDOWN_real;
            return;
        }
        if (!chain->airborne) {
            const instant_real there = look_real(chain, to->t);
            remember_highest_real(chain, &there);
            chain->airborne = to->foot.value > noise;
        }
    }
}

/* The foot's first downward crossing of the ground after it has been above it: the usual cases first. */
static void watch_foot_real(flight_chain_real *chain, flight_phase_end_real *end)
{
    const hopform_foot_at_real *first = &chain->first.foot;
    const real last = end->at.foot.foot_t;
    if (!HOPFORM_LEG_HAS_DAMPER && chain->airborne && stays_above_real(chain, &end->at)) {
        return;
    }
    const bool rises = !(first->foot_t < 0.0) && first->foot_rate > 0.0;
    const bool starts = chain->airborne ? first->foot_t > 0.0 : rises;
    if (!HOPFORM_LEG_HAS_DAMPER && starts && is_concave_real(chain, &end->at)) {
        const real noise = noise_of_foot_real(chain, end->at.t, end->at.actuator.moved);
        if (last > noise) {
            chain->airborne = true;
            return;
        }
        if (last < -noise && first->foot_t > 0.0) {
            land_real(chain, end);
            return;
        }
    }
    search_foot_real(chain, end);
}

/* Height of the foot if the leg were the shortest. */
static real height_of_shortest_real(const flight_chain_real *chain)
{
    const real height = chain->ballistic.foot + (chain->actuator.x1 - chain->robot->x1_min);
    return HOPFORM_LEG_HAS_DAMPER ? height + hopform_greater_real(leg_at_real(chain, 0.0), 0.0) : height;
}

/* Up to when a phase may last: a foot that is above the ground is below it when not even the shortest leg would do. */
static real longest_phase_real(const flight_chain_real *chain)
{
    const real until = chain->horizon - chain->t;
    const real height = height_of_shortest_real(chain);
    if (!chain->airborne || !(height >= 0.0 && height <= HOPFORM_NEVER_real)) {
        return until;
    }
    const real fallen = 1.01 * hopform_time_of_fall_real(chain->robot, chain->ballistic.v2, height);
    return fallen < until && fallen > 0.0 ? fallen : until;
}

/* The acceleration under what the motor does now, at a velocity, with the friction of a side. */
static real acceleration_of_real(const flight_chain_real *chain, real v1, int side)
{
    const hopform_flight_rates_real *rates = &chain->rates;
    return chain->limit == 0
               ? hopform_acceleration_under_law_real(chain->robot, rates, chain->actuator.x1, v1, (real)side)
               : hopform_acceleration_at_limit_real(chain->robot, rates, v1, (real)side, (real)chain->limit);
}

static flight_phase_end_real flight_find_end_real(flight_chain_real *chain)
{
    const real until = longest_phase_real(chain);
    const hopform_actuator_at_real *x = &chain->first.actuator;
    /* Where nothing grows with x_1, and nothing would turn it back at rest, its velocity fades and never vanishes. */
    const bool fades =
        !(chain->poles.q > 0.0) && (real)chain->side * acceleration_of_real(chain, 0.0, chain->side) >= 0.0;
    const real rest = fades ? HOPFORM_NEVER_real : zero_of_pair_real(&chain->poles, x->v1_t, x->acc1_t);
    flight_phase_end_real end = {look_real(chain, rest < until ? rest : until),
                                 rest <= until ? END_VELOCITY_real : FLIGHT_END_LIMIT_real, chain->limit};
    if (chain->side != 0) {
        watch_stop_real(chain, &end);
        watch_pull_real(chain, &end);
    }
    watch_foot_real(chain, &end);
    return end;
}

/* ---- the chain ---- */

static void flight_record_real(flight_chain_real *chain, int event)
{
    if (chain->count < chain->capacity) {
        const hopform_flight_phase_real phase = {chain->t,
                                                 chain->actuator.x1,
                                                 chain->actuator.v1,
                                                 chain->actuator.acc1,
                                                 (int8_t)chain->side,
                                                 (int8_t)chain->limit,
                                                 (int8_t)event,
                                                 0};
        chain->phases[chain->count] = phase;
    }
    if (event != HOPFORM_EVENT_NONE && chain->count < chain->max_phases && chain->event_count < chain->count) {
        chain->event_count++;
    }
    chain->count++;
}

static bool flight_blocked_real(const hopform_robot_real *robot, real x1, int side)
{
    const bool locked = !(robot->x1_min < robot->x1_max);
    return locked || (side < 0 && x1 <= robot->x1_min) || (side > 0 && x1 >= robot->x1_max);
}

/* Whether the motor is at its limit: where its pull is there exactly, the way in which that changes decides. */
static void choose_limit_real(flight_chain_real *chain)
{
    const real pull = chain->gains.Kp * chain->actuator.x1 + chain->gains.Kd * chain->actuator.v1;
    chain->limit = (int)hopform_goes_real(pull, chain->largest);
    if (chain->limit == 0 && !(fabs_real(pull) < chain->largest) && chain->side != 0) {
        const real rate = chain->gains.Kp * chain->actuator.v1
                          + chain->gains.Kd * acceleration_of_real(chain, chain->actuator.v1, chain->side);
        chain->limit = rate * pull > 0.0 ? (int)hopform_goes_real(pull, 0.0) : 0;
    }
}

/* An actuator at rest: held while the free acceleration is within the friction, which never changes as long as it is
 * held. */
static void flight_settle_real(flight_chain_real *chain)
{
    const real friction = hopform_friction_of_real(chain->robot).level_1;
    const real free = acceleration_of_real(chain, chain->actuator.v1, 0);
    const int side = (int)hopform_goes_real(free, friction);
    chain->side = flight_blocked_real(chain->robot, chain->actuator.x1, side) ? 0 : side;
    chain->actuator.acc1 = chain->side == 0 ? 0.0 : acceleration_of_real(chain, chain->actuator.v1, chain->side);
}

/* The actuator has come to rest. Without dry friction its acceleration goes on as it was. */
static void rest_real(flight_chain_real *chain, flight_end_kind_real kind)
{
    const hopform_robot_real *robot = chain->robot;
    const int before = chain->side;
    const real stop = stop_ahead_real(robot, before);
    const real acceleration = chain->actuator.acc1;
    chain->actuator.v1 = 0.0;
    if (kind == FLIGHT_END_STOP_real) {
        chain->actuator.x1 = stop;
        choose_limit_real(chain);
        flight_settle_real(chain);
        flight_record_real(chain, HOPFORM_EVENT_X1_HITS_STOP);
        return;
    }
    flight_settle_real(chain);
    if (!(hopform_friction_of_real(robot).level_1 > 0.0)) {
        const int side = (int)hopform_goes_real(acceleration, 0.0);
        chain->side = flight_blocked_real(robot, chain->actuator.x1, side) ? 0 : side;
        chain->actuator.acc1 = chain->side == 0 ? 0.0 : acceleration;
    }
    flight_record_real(chain, chain->side == 0
                                  ? HOPFORM_EVENT_X1_STICKS
                                  : (chain->side != before ? HOPFORM_EVENT_X1_REVERSES : HOPFORM_EVENT_NONE));
}

/* Body and foot where the next phase begins: from the take-off, so that nothing adds up. */
static void place_body_real(flight_chain_real *chain)
{
    const real g = hopform_fall_of_real(chain->robot);
    chain->ballistic.v2 = chain->v2 - g * chain->t;
    chain->ballistic.foot = (chain->x1 - chain->actuator.x1) + (chain->v2 - 0.5 * g * chain->t) * chain->t - chain->y;
    chain->poles = poles_in_flight_real(&chain->rates, chain->limit);
    chain->first = look_real(chain, 0.0);
}

/* What the actuator does at the start; no event. */
static void flight_begin_real(flight_chain_real *chain)
{
    const hopform_robot_real *robot = chain->robot;
    chain->side = (int)hopform_goes_real(chain->actuator.v1, 0.0);
    if (chain->side != 0 && flight_blocked_real(robot, chain->actuator.x1, chain->side)) {
        chain->start_loss = -0.5 * robot->m_eff * chain->actuator.v1 * chain->actuator.v1;
        chain->actuator.v1 = 0.0;
        chain->side = 0;
    }
    choose_limit_real(chain);
    if (chain->side == 0) {
        flight_settle_real(chain);
    } else {
        chain->actuator.acc1 = acceleration_of_real(chain, chain->actuator.v1, chain->side);
    }
    flight_record_real(chain, HOPFORM_EVENT_NONE);
}

/* True if the foot cannot come as high again as it was: the body falls, and is too low for the shortest leg. */
static bool too_low_real(const flight_chain_real *chain)
{
    return !chain->airborne && chain->ballistic.v2 < 0.0 && height_of_shortest_real(chain) < chain->highest;
}

static int32_t trip_real(flight_chain_real *chain, hopform_state_real *end)
{
    *end = chain->highest_state;
    chain->t = chain->highest_t;
    chain->count = chain->highest_count;
    chain->event_count = chain->highest_event_count;
    return HOPFORM_FLIGHT_TRIPPED;
}

static int32_t flight_run_real(flight_chain_real *chain, hopform_state_real *end_state)
{
    bool first = true;
    flight_begin_real(chain);
    while (chain->count <= chain->max_phases) {
        place_body_real(chain);
        if (first) {
            remember_highest_real(chain, &chain->first);
            first = false;
        }
        if (too_low_real(chain)) {
            return trip_real(chain, end_state);
        }
        const flight_phase_end_real end = flight_find_end_real(chain);
        const instant_real last = end.at;
        *end_state = state_of_real(chain, &last);
        chain->t = end.kind == FLIGHT_END_LIMIT_real ? chain->horizon : time_of_real(chain, &last);
        if (end.kind == END_TOUCHDOWN_real) {
            end_state->y = leg_at_real(chain, 0.0);
            return HOPFORM_FLIGHT_TOUCHDOWN;
        }
        if (end.kind == FLIGHT_END_LIMIT_real) {
            return chain->airborne ? HOPFORM_FLIGHT_HORIZON : trip_real(chain, end_state);
        }
        chain->actuator.x1 = within_stroke_real(chain->robot, chain->actuator.x1 + last.actuator.moved);
        chain->actuator.v1 = last.actuator.v1_t;
        chain->actuator.acc1 = last.actuator.acc1_t;
        if (end.kind == END_PULL_real) {
            chain->limit = end.limit;
            flight_record_real(chain,
                               end.limit == 0 ? HOPFORM_FLIGHT_EVENT_U_DESATURATES : HOPFORM_FLIGHT_EVENT_U_SATURATES);
        } else {
            rest_real(chain, end.kind);
        }
    }
    chain->count--;
    return HOPFORM_FLIGHT_TOO_MANY_PHASES;
}

/* ---- what users call ---- */

static const hopform_flight_real flight_nothing_real = {0};

static bool gains_are_sound_real(const hopform_gains_real *gains)
{
    return gains->Kp >= 0.0 && gains->Kp <= HOPFORM_NEVER_real && gains->Kd >= 0.0 && gains->Kd <= HOPFORM_NEVER_real;
}

/* Gains of a return that is settled 50 ms before the touchdown on the ground that was left, in 20 ms at least. */
static hopform_gains_real gains_for_real(const hopform_robot_real *robot, const hopform_state_real *start)
{
    const real time =
        hopform_time_of_fall_real(robot, start->v2, start->x1) - 0.05; /* NaN where it does not rise that high */
    return hopform_critical_gains_real(robot, hopform_greater_real(time, 0.02));
}

static void flight_report_real(const flight_chain_real *chain, int32_t ending, const hopform_state_real *end,
                               hopform_flight_real *flight)
{
    const real g = hopform_fall_of_real(chain->robot);
    const real top = hopform_lesser_real(hopform_greater_real(chain->v2, 0.0) / g, chain->t);
    flight->gains = chain->gains;
    flight->duration = chain->t;
    flight->end = *end;
    flight->v2_after =
        ending == HOPFORM_FLIGHT_TOUCHDOWN ? hopform_velocity_after_impact_real(chain->robot, end->v2) : end->v2;
    flight->apex_time = top;
    flight->apex = chain->x1 - chain->y + (chain->v2 - 0.5 * g * top) * top;
    flight->impact_loss = ending == HOPFORM_FLIGHT_TOUCHDOWN
                              ? -0.5 * chain->robot->m_s * end->v2 * end->v2 * chain->robot->impact_loss
                              : 0.0;
    flight->start_loss = chain->start_loss;
    if (HOPFORM_LEG_HAS_DAMPER) {
        flight->leg_loss = hopform_leg_energy_real(chain->robot, leg_at_real(chain, 0.0))
                           - hopform_leg_energy_real(chain->robot, chain->leg);
    }
    flight->ending = ending;
    flight->phase_count = chain->count;
    flight->phases_kept = chain->count < chain->capacity ? chain->count : chain->capacity;
    flight->event_count = chain->event_count;
}

/* Numbers out of range leave no phase, or show here. */
static bool is_sound_real(const hopform_flight_real *flight)
{
    const real numbers[] = {flight->duration,    flight->end.x1,     flight->end.v1,  flight->end.v2,
                            flight->end.y,       flight->v2_after,   flight->apex,    flight->apex_time,
                            flight->impact_loss, flight->start_loss, flight->leg_loss};
    bool sound = flight->phase_count > 0;
    for (size_t n = 0; n < sizeof numbers / sizeof numbers[0]; n++) {
        sound = sound && hopform_is_finite_real(numbers[n]);
    }
    return sound;
}

int32_t hopform_design_return_real(const hopform_plan_real *plan, real time, hopform_gains_real *gains)
{
    const hopform_gains_real none = {0.0, 0.0};
    hopform_gains_real found = none; /* the gains may lie in the plan */
    int32_t status = HOPFORM_ERROR_NULL;
    if (gains == NULL) {
        return status;
    }
    if (plan != NULL && plan->made != HOPFORM_PLAN_MADE) {
        status = HOPFORM_ERROR_ROBOT;
    } else if (plan != NULL && !(time > 0.0 && time <= HOPFORM_NEVER_real)) {
        status = HOPFORM_ERROR_TIME;
    } else if (plan != NULL) {
        found = hopform_critical_gains_real(&plan->robot, time);
        status = gains_are_sound_real(&found) ? HOPFORM_OK : HOPFORM_ERROR_NUMBERS;
    }
    *gains = status < 0 ? none : found;
    return status;
}

int32_t hopform_solve_flight_real(const hopform_plan_real *plan, const hopform_state_real *start, real ground,
                                  const hopform_gains_real *gains, real horizon, int32_t max_phases,
                                  hopform_flight_phase_real *phases, int32_t capacity, hopform_flight_real *flight)
{
    if (flight == NULL) {
        return HOPFORM_ERROR_NULL;
    }
    const hopform_state_real from =
        start != NULL ? *start : flight_nothing_real.start; /* may lie in what is written, as gains */
    const hopform_gains_real law = gains != NULL ? *gains : flight_nothing_real.gains;
    *flight = flight_nothing_real;
    if (plan == NULL || start == NULL || (phases == NULL && capacity > 0)) {
        return HOPFORM_ERROR_NULL;
    }
    const hopform_memory_real read = hopform_array_real(plan, 1, sizeof *plan);
    const hopform_memory_real written[] = {
        hopform_array_real(phases, capacity, sizeof *phases),
        hopform_array_real(flight, 1, sizeof *flight),
    };
    if (hopform_overlap_real(written, 2, &read, 1)) {
        return HOPFORM_ERROR_OVERLAP;
    }
    const hopform_robot_real *robot = &plan->robot;
    if (!hopform_hops_real(plan)) {
        return HOPFORM_ERROR_ROBOT;
    }
    if (!hopform_is_finite_real(from.x1) || !hopform_is_finite_real(from.v1) || !hopform_is_finite_real(from.v2)
        || !hopform_is_finite_real(from.y) || !hopform_is_finite_real(ground)
        || !(from.x1 >= robot->x1_min && from.x1 <= robot->x1_max)) {
        return HOPFORM_ERROR_STATE;
    }
    const real rest = hopform_compression_at_takeoff_real(robot, 0.0, 0.0);
    if (!(horizon > 0.0 && horizon <= HOPFORM_NEVER_real) || max_phases < 1 || capacity < 0) {
        return HOPFORM_ERROR_HORIZON;
    }
    if (!gains_are_sound_real(&law)) {
        return HOPFORM_ERROR_GAINS;
    }
    flight_chain_real chain = {0};
    chain.robot = robot;
    chain.largest = largest_force_real(robot);
    if (chain.largest > 0.0) {
        chain.gains = gains != NULL ? law : gains_for_real(robot, &from);
    }
    chain.rates = hopform_flight_rates_of_real(robot, &chain.gains, chain.largest);
    chain.horizon = horizon;
    chain.x1 = from.x1;
    chain.y = (from.y - rest) + ground;
    if (HOPFORM_LEG_HAS_DAMPER) {
        const real time = hopform_leg_time_real(robot);
        chain.relaxes = time > HOPFORM_FASTEST_LEG_real ? 1.0 / time : 0.0;
        chain.leg = time > HOPFORM_FASTEST_LEG_real ? from.y - rest : 0.0;
    }
    chain.v2 = from.v2;
    chain.actuator.x1 = from.x1;
    chain.actuator.v1 = from.v1;
    chain.airborne = chain.y < chain.leg;
    chain.max_phases = max_phases;
    chain.phases = phases;
    chain.capacity = capacity;
    chain.highest = -HOPFORM_NEVER_real;
    hopform_state_real end = from;
    const int32_t ending = flight_run_real(&chain, &end);
    end.y += rest;
    flight_report_real(&chain, ending, &end, flight);
    flight->start = from;
    flight->ground = ground;
    if (!is_sound_real(flight)) {
        *flight = flight_nothing_real;
        return HOPFORM_ERROR_NUMBERS;
    }
    return flight->phases_kept < flight->phase_count ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK;
}

/* ---- the flight at a time ---- */

static hopform_actuator_at_real actuator_in_phase_real(const hopform_flight_rates_real *rates,
                                                       const hopform_flight_phase_real *phase, real t)
{
    const hopform_actuator_real start = {phase->x1, phase->v1, phase->acc1};
    const hopform_poles_real poles = poles_in_flight_real(rates, phase->limit);
    return move_real(&start, &poles, phase->side, t);
}

/* Status of a call that reads a solved flight, and times, into arrays, all of which are given: HOPFORM_OK if it can. */
static int32_t reading_status_real(const hopform_plan_real *plan, const hopform_flight_phase_real *phases,
                                   const hopform_flight_real *flight, const real *times, int32_t count,
                                   const hopform_memory_real *arrays, int array_count)
{
    if (flight->phases_kept < flight->phase_count || flight->phases_kept < 1 || !hopform_is_made_real(plan)) {
        return HOPFORM_ERROR_TIME;
    }
    for (int32_t n = 0; n < count; n++) {
        if (!(times[n] >= 0.0 && times[n] <= flight->duration)) {
            return HOPFORM_ERROR_TIME;
        }
    }
    const hopform_memory_real read[] = {
        hopform_array_real(plan, 1, sizeof *plan),
        hopform_array_real(phases, flight->phases_kept, sizeof *phases),
        hopform_array_real(flight, 1, sizeof *flight),
        hopform_array_real(times, count, sizeof *times),
    };
    return hopform_overlap_real(arrays, array_count, read, 4) ? HOPFORM_ERROR_OVERLAP : HOPFORM_OK;
}

/* The state at a time of a flight that can be read. */
static hopform_state_real state_of_flight_real(const hopform_plan_real *plan, const hopform_flight_phase_real *phases,
                                               const hopform_flight_rates_real *rates,
                                               const hopform_flight_real *flight, real t)
{
    const real g = hopform_fall_of_real(&plan->robot);
    int32_t n = flight->phases_kept - 1;
    while (n > 0 && phases[n].t > t) {
        n--;
    }
    const hopform_flight_phase_real *phase = &phases[n];
    const hopform_actuator_at_real at = actuator_in_phase_real(rates, phase, t - phase->t);
    const real moved = (phase->x1 - flight->start.x1) + at.moved;
    const hopform_state_real state = {
        within_stroke_real(&plan->robot, phase->x1 + at.moved),
        at.v1_t,
        flight->start.v2 - g * t,
        (flight->start.y + flight->ground) - ((flight->start.v2 - 0.5 * g * t) * t - moved),
    };
    return state;
}

int32_t hopform_flight_at_real(const hopform_plan_real *plan, const hopform_flight_phase_real *phases,
                               const hopform_flight_real *flight, const real *times, int32_t count,
                               hopform_state_real *states)
{
    const hopform_memory_real array = hopform_array_real(states, count, sizeof *states);
    const bool given =
        plan != NULL && phases != NULL && flight != NULL && ((times != NULL && states != NULL) || count <= 0);
    const int32_t status =
        given ? reading_status_real(plan, phases, flight, times, count, &array, 1) : HOPFORM_ERROR_NULL;
    if (status < 0) {
        return hopform_refuse_real(status, &array, 1);
    }
    const hopform_flight_rates_real rates =
        hopform_flight_rates_of_real(&plan->robot, &flight->gains, largest_force_real(&plan->robot));
    for (int32_t n = 0; n < count; n++) {
        states[n] = state_of_flight_real(plan, phases, &rates, flight, times[n]);
    }
    return HOPFORM_OK;
}

/* ---- energy ---- */

/* Integrals of v^2, v a and a^2 over a part of a phase. */
typedef struct {
    real vv;
    real va;
    real aa;
} squares_real;

/* Over a short time: the power series of (v^2, v a, a^2), each the derivative of the one before. */
static squares_real short_squares_real(const hopform_poles_real *poles, real v, real a, real h)
{
    squares_real term = {v * v * h, v * a * h, a * a * h};
    squares_real sum = term;
    for (int n = 2; n < 26; n++) {
        const real share = h / (real)n;
        const squares_real next = {2.0 * term.va * share, (term.aa - poles->p * term.va - poles->q * term.vv) * share,
                                   -2.0 * (poles->p * term.aa + poles->q * term.va) * share};
        term = next;
        sum.vv += term.vv;
        sum.va += term.va;
        sum.aa += term.aa;
    }
    return sum;
}

/* Integral of v_1^2 over the first t of a phase, I(2h) = I(h) + Phi(h) I(h) Phi(h)^T for z = (v, a) as in the stance's
 * ledger. */
static real square_of_velocity_real(const hopform_poles_real *poles, const hopform_flight_phase_real *phase, real t)
{
    if (phase->side == 0) {
        return 0.0;
    }
    const real fastest = poles->p + sqrt_real(poles->q);
    int doublings = 0;
    real h = t;
    while (fastest * h > 0.5 && doublings < 200) {
        h *= 0.5;
        doublings++;
    }
    squares_real sum = short_squares_real(poles, phase->v1, phase->acc1, h);
    for (; doublings > 0; doublings--) {
        const hopform_pair_real pair = response_at_real(poles, h);
        const real vv = pair.Rd + poles->p * pair.R;
        const real va = pair.R;
        const real av = -poles->q * pair.R;
        const real aa = pair.Rd;
        const squares_real moved = {vv * vv * sum.vv + 2.0 * vv * va * sum.va + va * va * sum.aa,
                                    vv * av * sum.vv + (vv * aa + va * av) * sum.va + va * aa * sum.aa,
                                    av * av * sum.vv + 2.0 * av * aa * sum.va + aa * aa * sum.aa};
        sum.vv += moved.vv;
        sum.va += moved.va;
        sum.aa += moved.aa;
        h *= 2.0;
    }
    return sum.vv;
}

/* Add the work of the first t of a phase to a ledger. */
static void add_work_real(hopform_flight_ledger_real *ledger, const hopform_plan_real *plan,
                          const hopform_flight_rates_real *rates, const hopform_flight_real *flight,
                          const hopform_flight_phase_real *phase, real t)
{
    const hopform_robot_real *robot = &plan->robot;
    const hopform_poles_real poles = poles_in_flight_real(rates, phase->limit);
    const real rise = (flight->start.v2 - hopform_fall_of_real(robot) * (phase->t + 0.5 * t)) * t;
    const hopform_way_real way = {actuator_in_phase_real(rates, phase, t).moved,
                                  square_of_velocity_real(&poles, phase, t), rise};
    const hopform_flight_ledger_real part = hopform_flight_ledger_of_real(
        robot, &flight->gains, largest_force_real(robot), phase->x1, (real)phase->side, (real)phase->limit, &way);
#define ADD_ENTRY(name, domain) ledger->name += part.name;
    HOPFORM_FLIGHT_LEDGER_MEMBERS(ADD_ENTRY)
#undef ADD_ENTRY
}

int32_t hopform_flight_energy_real(const hopform_plan_real *plan, const hopform_flight_phase_real *phases,
                                   const hopform_flight_real *flight, const real *times, int32_t count,
                                   hopform_energy_real *energies, hopform_flight_ledger_real *ledgers,
                                   real *stop_losses)
{
    const hopform_memory_real arrays[] = {
        hopform_array_real(energies, count, sizeof *energies),
        hopform_array_real(ledgers, count, sizeof *ledgers),
        hopform_array_real(stop_losses, count, sizeof *stop_losses),
    };
    const bool given = plan != NULL && phases != NULL && flight != NULL
                       && ((times != NULL && energies != NULL && ledgers != NULL && stop_losses != NULL) || count <= 0);
    const int32_t status =
        given ? reading_status_real(plan, phases, flight, times, count, arrays, 3) : HOPFORM_ERROR_NULL;
    if (status < 0) {
        return hopform_refuse_real(status, arrays, 3);
    }
    const hopform_flight_rates_real rates =
        hopform_flight_rates_of_real(&plan->robot, &flight->gains, largest_force_real(&plan->robot));
    hopform_flight_ledger_real sum = {0};
    real loss = flight->start_loss;
    int32_t n = 0;
    for (int32_t i = 0; i < count; i++) {
        if (i > 0 && times[i] < times[i - 1]) {
            return hopform_refuse_real(HOPFORM_ERROR_TIME, arrays, 3);
        }
        for (; n < flight->phases_kept - 1 && phases[n + 1].t <= times[i]; n++) {
            const real length = phases[n + 1].t - phases[n].t;
            add_work_real(&sum, plan, &rates, flight, &phases[n], length);
            if (phases[n + 1].event == HOPFORM_EVENT_X1_HITS_STOP) {
                const real v1 = actuator_in_phase_real(&rates, &phases[n], length).v1_t;
                loss -= 0.5 * plan->robot.m_eff * v1 * v1;
            }
        }
        ledgers[i] = sum;
        add_work_real(&ledgers[i], plan, &rates, flight, &phases[n], times[i] - phases[n].t);
        stop_losses[i] = loss;
        const hopform_state_real state = state_of_flight_real(plan, phases, &rates, flight, times[i]);
        energies[i] = hopform_flight_energies_real(&plan->robot, state.v1, state.v2, state.x1 - state.y);
    }
    return HOPFORM_OK;
}
