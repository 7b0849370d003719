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
#include "linear_real.h"
#include "overlap_real.h"

enum {
    MOST_POINTS_real = HOPFORM_LEG_HAS_DAMPER ? 17 : 9,
    MOST_TURNS_real = 3,
    DERIVATIVES_real = HOPFORM_LEG_HAS_DAMPER ? 5 : 4
};

/* How a phase ends. */
typedef enum {
    FLIGHT_END_LIMIT_real,
    END_VELOCITY_real,
    FLIGHT_END_STOP_real,
    END_PULL_real,
    END_TOUCHDOWN_real
} flight_end_kind_real;

/* One time of a phase. */
typedef struct {
    real t;                     /* since the phase began */
    real leg;                   /* what a damper leaves of the leg's compression */
    real way[DERIVATIVES_real]; /* how far the actuator has moved, and the derivatives of that */
} instant_real;

/* An event function of a phase, or its derivative of an order: start + rate t + curvature t^2/2, and shares of those of
 * the way, of its velocity, and of what is left in the leg. Its start is a sum of terms of that size. */
typedef struct {
    real start, rate, curvature;
    real of_way, of_velocity, of_leg;
    real size;
    int order;
} flight_function_real;

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
    real fall;
    real horizon;
    real x1; /* at take-off, as the next two */
    real y;
    real v2;
    real leg; /* compression that a damper leaves in it, and the rate at which it relaxes */
    real relaxes;
    real t;
    hopform_actuator_real actuator;
    flight_function_real foot; /* its height over the ground ahead */
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
    const hopform_actuator_at_real x = move_real(&chain->actuator, &chain->poles, chain->side, t);
    const instant_real now = {t, leg_at_real(chain, t), {x.moved, x.v1_t, x.acc1_t, x.jerk1_t}};
    return now;
}

/* ---- event functions ---- */

static inline real flight_value_real(const flight_function_real *g, const instant_real *at)
{
    const real *way = &at->way[g->order];
    const real moved = g->of_way * way[0] + g->of_velocity * way[1];
    return g->start + ((g->rate + 0.5 * g->curvature * at->t) * at->t + moved)
           + (HOPFORM_LEG_HAS_DAMPER ? g->of_leg * at->leg : 0.0);
}

static inline flight_function_real derivative_of_real(const flight_chain_real *chain, const flight_function_real *g)
{
    const flight_function_real of = {g->rate, g->curvature, 0.0, g->of_way, g->of_velocity, -chain->relaxes * g->of_leg,
                                     g->size, g->order + 1};
    return of;
}

static flight_function_real times_real(real sign, const flight_function_real *g)
{
    const flight_function_real of = {
        sign * g->start, sign * g->rate, sign * g->curvature, sign * g->of_way, sign * g->of_velocity, sign * g->of_leg,
        g->size,         g->order};
    return of;
}

/* Its value and derivatives, the fourth one apart. */
static jet_real flight_jet_real(const flight_chain_real *chain, const flight_function_real *g, const instant_real *at,
                                real *fourth)
{
    const real p = chain->poles.p;
    const real q = chain->poles.q;
    const real fourth_of_way = -p * at->way[3] - q * at->way[2];
    const real fifth = -p * fourth_of_way - q * at->way[3];
    const real sixth = -p * fifth - q * fourth_of_way;
    const real ways[] = {
        at->way[0], at->way[1], at->way[2], at->way[3], fourth_of_way, fifth, sixth, -p * sixth - q * fifth, 0.0};
    const real *way = &ways[g->order];
    jet_real jet = {
        flight_value_real(g, at), g->rate + g->curvature * at->t + g->of_way * way[1] + g->of_velocity * way[2],
        g->curvature + g->of_way * way[2] + g->of_velocity * way[3], g->of_way * way[3] + g->of_velocity * way[4]};
    *fourth = g->of_way * way[4] + g->of_velocity * way[5];
    if (HOPFORM_LEG_HAS_DAMPER && fabs_real(g->of_leg) > 0.0) {
        const real rate = -chain->relaxes * g->of_leg * at->leg;
        jet.rate += rate;
        jet.curvature -= chain->relaxes * rate;
        jet.third += chain->relaxes * chain->relaxes * rate;
        *fourth = HOPFORM_NEVER_real; /* its rate is no pole: no step is known to land */
    }
    return jet;
}

/* What rounding may have done to its value. */
static real flight_rounding_real(const flight_function_real *g, const instant_real *at)
{
    return 16.0 * HOPFORM_EPS_real
           * (g->size + fabs_real(g->rate * at->t) + fabs_real(0.5 * g->curvature * at->t * at->t)
              + fabs_real(g->of_way * at->way[0]) + fabs_real(g->of_velocity * at->way[1]));
}

/* ---- roots ---- */

/* The one root between an instant at which a function is above zero, and one at which it is below. */
static instant_real root_between_real(const flight_chain_real *chain, const flight_function_real *g,
                                      const instant_real *from, const instant_real *to)
{
    real low = from->t;
    real high = to->t;
    instant_real last = *to;
    for (int n = 0; n < 100; n++) {
        real fourth = 0.0;
        const jet_real jet = flight_jet_real(chain, g, &last, &fourth);
        const root_step_real step = step_between_real(&chain->poles, &jet, fourth, last.t, low, high);
        low = step.low;
        high = step.high;
        const bool follows = step.inside && !(n > 8 && n % 2 == 1);
        const real next = follows ? step.next : low + 0.5 * (high - low);
        if (step.arrives || !(next > low && next < high)) {
            break;
        }
        last = look_real(chain, next);
        if (follows && step.lands) {
            break;
        }
    }
    return last;
}

/* Put the roots of a function that is monotone between the points among them; the new number of points. */
static int split_real(const flight_chain_real *chain, flight_function_real g, instant_real *points, int count)
{
    for (int n = 0; n < count - 1 && count < MOST_POINTS_real; n++) {
        const real before = flight_value_real(&g, &points[n]);
        const real after = flight_value_real(&g, &points[n + 1]);
        if ((before > 0.0 && after < 0.0) || (before < 0.0 && after > 0.0)) {
            const flight_function_real falls = times_real(before > 0.0 ? 1.0 : -1.0, &g);
            const instant_real root = root_between_real(chain, &falls, &points[n], &points[n + 1]);
            if (root.t > points[n].t && root.t < points[n + 1].t) {
                for (int m = count; m > n + 1; m--) {
                    points[m] = points[m - 1];
                }
                points[n + 1] = root;
                count++;
                n++; /* between its root and the next point it keeps its sign */
            }
        }
    }
    return count;
}

/* Where a function that is monotone between the points falls below zero, by more than rounding or so steeply that the
 * root is near; a touch is none. */
static bool crosses_real(const flight_chain_real *chain, const flight_function_real *g, const instant_real *points,
                         int count, instant_real *root)
{
    for (int n = 1; n < count; n++) {
        const instant_real *from = &points[n - 1];
        const instant_real *to = &points[n];
        const real after = flight_value_real(g, to);
        if (after < 0.0) {
            const real before = flight_value_real(g, from);
            const real rounding = flight_rounding_real(g, to);
            const flight_function_real rate = derivative_of_real(chain, g);
            if (after < -rounding || (after < before && flight_value_real(&rate, to) * to->t < -rounding)) {
                *root = before > 0.0 ? root_between_real(chain, g, from, to) : *from;
                return true;
            }
        }
    }
    return false;
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
    const real *way = chain->first.way;
    const real snap = -chain->poles.p * way[3] - chain->poles.q * way[2];
    if (HOPFORM_LEG_HAS_DAMPER) {
        const real crackle = -chain->poles.p * snap - chain->poles.q * way[3];
        return zero_of_pair_real(&chain->poles, snap + chain->relaxes * way[3], crackle + chain->relaxes * snap);
    }
    return zero_of_pair_real(&chain->poles, way[3], snap);
}

/* ---- the end of a phase ---- */

/* The start of a phase, a time in it at which something turns, and its end; how many there are. */
static int points_of_real(const flight_chain_real *chain, real turn, const instant_real *end, instant_real *points)
{
    int count = 0;
    points[count++] = chain->first;
    if (turn < end->t) {
        points[count++] = look_real(chain, turn);
    }
    points[count++] = *end;
    return count;
}

/* The stop ahead, if x_1, monotone in a phase, is beyond it at the end, or comes to rest there within rounding. */
static void end_at_stop_real(const flight_chain_real *chain, flight_phase_end_real *end)
{
    const real stop = stop_ahead_real(chain->robot, chain->side);
    const real side = (real)chain->side;
    const real size = fabs_real(stop) + fabs_real(chain->actuator.x1);
    const flight_function_real gap = {side * (stop - chain->actuator.x1), 0.0, 0.0, -side, 0.0, 0.0, size, 0};
    if (!hopform_is_finite_real(stop) || flight_value_real(&gap, &end->at) > flight_rounding_real(&gap, &end->at)) {
        return;
    }
    const instant_real points[] = {chain->first, end->at};
    if (crosses_real(chain, &gap, points, 2, &end->at) || end->kind == END_VELOCITY_real) {
        end->kind = FLIGHT_END_STOP_real;
    }
}

/* Where the current reaches its limit, or leaves it. */
static void end_at_limit_of_pull_real(const flight_chain_real *chain, flight_phase_end_real *end)
{
    const hopform_gains_real *gains = &chain->gains;
    const hopform_actuator_real *x = &chain->actuator;
    if (!(gains->Kp > 0.0 || gains->Kd > 0.0)) {
        return;
    }
    const real size = chain->largest + gains->Kp * fabs_real(x->x1) + gains->Kd * fabs_real(x->v1);
    const flight_function_real pull = {gains->Kp * x->x1, 0.0, 0.0, gains->Kp, gains->Kd, 0.0, size, 0};
    const flight_function_real rate = derivative_of_real(chain, &pull);
    const flight_function_real curvature = derivative_of_real(chain, &rate);
    const real turn = zero_of_pair_real(&chain->poles, flight_value_real(&rate, &chain->first),
                                        flight_value_real(&curvature, &chain->first));
    instant_real points[MOST_TURNS_real] = {0};
    const int count = points_of_real(chain, turn, &end->at, points);
    for (int side = -1; side <= 1; side += 2) {
        flight_function_real beyond = pull;
        beyond.start -= (real)side * chain->largest;
        const flight_function_real left = times_real((real)(chain->limit == 0 ? -side : side), &beyond);
        instant_real root = end->at;
        if (side != -chain->limit && crosses_real(chain, &left, points, count, &root) && root.t < end->at.t) {
            end->at = root;
            end->kind = END_PULL_real;
            end->limit = chain->limit == 0 ? side : 0;
        }
    }
}

static hopform_state_real state_of_real(const flight_chain_real *chain, const instant_real *at)
{
    const real x1 = within_stroke_real(chain->robot, chain->actuator.x1 + at->way[0]);
    const hopform_state_real state = {x1, at->way[1], chain->v2 - chain->fall * (chain->t + at->t),
                                      at->leg - flight_value_real(&chain->foot, at)};
    return state;
}

/* Time since take-off, not behind the horizon by rounding. */
static real time_of_real(const flight_chain_real *chain, const instant_real *at)
{
    return hopform_lesser_real(chain->t + at->t, chain->horizon);
}

static void remember_highest_real(flight_chain_real *chain, const instant_real *at)
{
    const real height = flight_value_real(&chain->foot, at);
    if (height > chain->highest) {
        chain->highest = height;
        chain->highest_t = time_of_real(chain, at);
        chain->highest_state = state_of_real(chain, at);
        chain->highest_count = chain->count;
        chain->highest_event_count = chain->event_count;
    }
}

/* The foot's first downward crossing of the ground after it has been above it. */
static void end_at_touchdown_real(flight_chain_real *chain, flight_phase_end_real *end)
{
    const flight_function_real *foot = &chain->foot;
    const flight_function_real rate = derivative_of_real(chain, foot);
    const flight_function_real curvature = derivative_of_real(chain, &rate);
    const real turn = chain->side == 0 ? HOPFORM_NEVER_real : turn_of_jerk_real(chain);
    instant_real points[MOST_POINTS_real] = {0};
    int count = points_of_real(chain, turn, &end->at, points);
    if (HOPFORM_LEG_HAS_DAMPER) {
        count = split_real(chain, derivative_of_real(chain, &curvature), points, count);
    }
    count = split_real(chain, curvature, points, count);
    /* A concave way has no more than one root behind its start. */
    const bool is_concave = count == 2 && flight_value_real(&curvature, &chain->first) < 0.0;
    const real start = flight_value_real(foot, &chain->first);
    const bool stays = start >= 0.0 && flight_value_real(foot, &end->at) > flight_rounding_real(foot, &end->at);
    if (!is_concave || !(start > 0.0 || stays)) {
        count = split_real(chain, rate, points, count);
    }
    int from = 0;
    while (!chain->airborne && from < count - 1) {
        from++;
        remember_highest_real(chain, &points[from]);
        chain->airborne = flight_value_real(foot, &points[from]) > flight_rounding_real(foot, &points[from]);
    }
    if (chain->airborne && crosses_real(chain, foot, &points[from], count - from, &end->at)) {
        end->kind = END_TOUCHDOWN_real;
    }
}

/* Height of the foot if the leg were the shortest. */
static real height_of_shortest_real(const flight_chain_real *chain)
{
    const real height = chain->foot.start + (chain->actuator.x1 - chain->robot->x1_min);
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
    const real fallen = 1.01 * hopform_time_of_fall_real(chain->robot, chain->foot.rate, height);
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
    const real *way = chain->first.way;
    /* Where nothing grows with x_1, and nothing would turn it back at rest, its velocity fades and never vanishes. */
    const bool fades =
        !(chain->poles.q > 0.0) && (real)chain->side * acceleration_of_real(chain, 0.0, chain->side) >= 0.0;
    const real rest = fades ? HOPFORM_NEVER_real : zero_of_pair_real(&chain->poles, way[1], way[2]);
    flight_phase_end_real end = {look_real(chain, rest < until ? rest : until),
                                 rest <= until ? END_VELOCITY_real : FLIGHT_END_LIMIT_real, chain->limit};
    if (chain->side != 0) {
        end_at_stop_real(chain, &end);
        end_at_limit_of_pull_real(chain, &end);
    }
    end_at_touchdown_real(chain, &end);
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
    const real g = chain->fall;
    const real foot = (chain->x1 - chain->actuator.x1) + (chain->v2 - 0.5 * g * chain->t) * chain->t - chain->y;
    const flight_function_real over_ground = {
        foot, chain->v2 - g * chain->t, -g, -1.0, 0.0, 1.0, fabs_real(foot) + fabs_real(chain->leg), 0};
    chain->foot = over_ground;
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
    return !chain->airborne && chain->foot.rate < 0.0 && height_of_shortest_real(chain) < chain->highest;
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
        chain->actuator.x1 = within_stroke_real(chain->robot, chain->actuator.x1 + last.way[0]);
        chain->actuator.v1 = last.way[1];
        chain->actuator.acc1 = last.way[2];
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
    const real g = chain->fall;
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
    chain.fall = hopform_fall_of_real(robot);
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

/* Over a short time, by Gauss's rule. */
static squares_real short_squares_real(const hopform_poles_real *poles, const hopform_actuator_real *start, int side,
                                       real h)
{
    squares_real sum = {0.0, 0.0, 0.0};
    for (int node = 0; node < HOPFORM_NODES_real; node++) {
        const hopform_actuator_at_real at = move_real(start, poles, side, hopform_place_real[node] * h);
        const real weight = hopform_weight_real[node] * h;
        sum.vv += weight * at.v1_t * at.v1_t;
        sum.va += weight * at.v1_t * at.acc1_t;
        sum.aa += weight * at.acc1_t * at.acc1_t;
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
    const hopform_actuator_real start = {phase->x1, phase->v1, phase->acc1};
    real h = t;
    int doublings = hopform_halve_real(poles, &h);
    squares_real sum = short_squares_real(poles, &start, phase->side, h);
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
