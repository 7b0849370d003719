/* SPDX-License-Identifier: MIT-0
 *
 * How a flight depends on its inputs, through its events. While the element slips x'' = a - p v - q x, so that changes
 * of the inputs change it by
 *
 *     d_x(h) = (R' + p R) d_x + R d_v + R1 d_a - d_p (R * v)(h) - d_q (R * x)(h)
 *     d_v(h) = -q R d_x + R' d_v + R d_a - d_p (R' * v)(h) - d_q (R' * x)(h)
 *
 * R the response of the pair, R1 its integral, (f * g)(h) = integral of f(h - s) g(s), 0 <= s <= h. A velocity that
 * vanishes jumps with its acceleration, and a stop takes it; nothing jumps at a limit of the law. The foot moves with x
 * and falls besides.
 */
#ifndef HOPFORM_FLIGHT_SENSITIVITY_H_real
#define HOPFORM_FLIGHT_SENSITIVITY_H_real

#include "chosen_real.h"
#include "flight_real.h"

/* What a column stands for: the change of the robot, of the gains, of the start, whose compression is over the ground
 * ahead, of the compression that a damper leaves in the leg, of the rate of that, and of how fast the body falls. */
typedef struct {
    robot_change_real robot;
    gains_change_real gains;
    state_change_real start;
    real leg, relaxes, fall;
} flight_column_real;

/* A flight while its changes are followed. Those of x1 and v1 stand where they belong in the matrix. */
typedef struct {
    const hopform_plan_real *plan;
    const hopform_flight_phase_real *phases;
    const hopform_flight_real *flight;
    flight_rates_real rates;
    chosen_real chosen;
    real *x1, *v1;
    bool exists; /* each event so far moves in proportion */
} flight_variation_real;

/* (n + 1)/(2 n + 3)!: (sin(x) - x cos(x))/(2 x^3) is their sum times (-x^2)^n; how many terms that and the integral of
 * t exp(-t) take. */
enum { NEAR_TERMS_real = 9, SLOW_TERMS_real = 18 };

static const real near_real[NEAR_TERMS_real] = {
    1.0 / 6.0,
    1.0 / 60.0,
    1.0 / 1680.0,
    1.0 / 90720.0,
    1.0 / 7983360.0,
    1.0 / 1037836800.0,
    1.0 / 186810624000.0,
    1.0 / 44460928512000.0,
    1.0 / 13516122267648000.0,
};

/* A phase over a time: how it moves, and what its motion answers to changes of p and q. */
typedef struct {
    alone_pair_real pair;
    alone_real start, end; /* times its side */
    known_pair_real response;
    real x_by_p, v_by_p, x_by_q, v_by_q;
} flight_answer_real;

/* ---- columns ---- */

/* How the gains of a column change: those that were designed with the start and the robot, too. */
static gains_change_real gains_change_of_real(const flight_variation_real *variation, int32_t code,
                                              const flight_column_real *column) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const hopform_state_real *start = &variation->flight->start;
    gains_change_real change = {0.0, 0.0};
    if (!(largest_force_real(robot) > 0.0)) { return change; }
    if (variation->flight->designed != 0) {
        const real early = time_of_fall_real(robot, start->v2, start->x1) - 0.05; /* as gains_for_real has it */
        const bool is_short = !(early > 0.02);
        const real later = is_short ? 0.0
                                    : time_of_fall_change_real(robot, start->v2, start->x1, &column->robot,
                                                               column->start.d_v2, column->start.d_x1);
        const real adds = variation->flight->gains.Kd > 0.0 ? 1.0 : 0.0;
        change = critical_gains_change_real(robot, is_short ? 0.02 : early, adds, &column->robot, later);
    }
    change.d_Kp += code == HOPFORM_COLUMN_OF_KP ? 1.0 : 0.0;
    change.d_Kd += code == HOPFORM_COLUMN_OF_KD ? 1.0 : 0.0;
    return change;
}

static flight_column_real flight_column_of_real(const flight_variation_real *variation, int32_t code) {
    static const signed char column_of_axis[HOPFORM_AXES] = HOPFORM_COLUMN_OF_AXIS;
    const hopform_robot_real *robot = &variation->plan->robot;
    robot_change_by_field_real by = {{0}};
    state_by_axis_real start;
    flight_column_real column;
    if (code >= HOPFORM_COLUMN_OF_ROBOT && code < HOPFORM_SENSITIVITY_COLUMNS) {
        by.of[code - HOPFORM_COLUMN_OF_ROBOT] = 1.0;
    }
    for (int axis = 0; axis < HOPFORM_AXES; axis++) {
        start.of[axis] = code == column_of_axis[axis] ? 1.0 : 0.0;
    }
    column.robot = by.named;
    column.leg = start.of[HOPFORM_STRETCH_AXIS];
    start.of[HOPFORM_STRETCH_AXIS] += code == HOPFORM_COLUMN_OF_GROUND ? 1.0 : 0.0;
    column.start = start.change;
    column.gains = gains_change_of_real(variation, code, &column);
    column.fall = fall_change_real(robot, &column.robot);
    column.relaxes = 0.0;
    if (HOPFORM_FLIGHT_HAS_DECAY) {
        const real time = leg_time_real(robot);
        const bool relaxes = time > HOPFORM_FASTEST_CONTACT_real; /* as hopform_solve_flight has it */
        column.leg = relaxes ? column.leg : 0.0;
        column.relaxes = relaxes ? -leg_time_change_real(robot, &column.robot) / time / time : 0.0;
    }
    return column;
}

/* How a phase's p, q and a change. */
static flight_slopes_real flight_slopes_of_column_real(const flight_variation_real *variation,
                                                       const hopform_flight_phase_real *phase,
                                                       const flight_column_real *column) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const real limit = (real)phase->limit;
    const real sign = force_constant_real(robot) < 0.0 ? -limit : limit;
    const bool limited = phase->limit != 0;
    return flight_slopes_of_real(robot, &variation->flight->gains, limited ? sign * current_limit_real(robot) : 0.0,
                                 (real)phase->side, limited ? 0.0 : 1.0, &column->robot, &column->gains,
                                 limited ? sign * current_limit_change_real(robot, &column->robot) : 0.0);
}

/* ---- within a phase ---- */

/* Its acceleration, with the friction of its side, at a place and velocity. */
static real acceleration_in_phase_real(const flight_variation_real *variation, const hopform_flight_phase_real *phase,
                                       real position, real velocity) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const real side = (real)phase->side;
    return phase->limit == 0 ? acceleration_under_law_real(robot, &variation->rates, position, velocity, side)
                             : acceleration_at_limit_real(robot, &variation->rates, velocity, side, (real)phase->limit);
}

/* Whether the element follows changes in a phase: it slips, or rests without friction where no force acts. One that is
 * held between the stops by no more than its friction has no derivative. */
static bool follows_real(flight_variation_real *variation, const hopform_flight_phase_real *phase) {
    const hopform_robot_real *robot = &variation->plan->robot;
    if (phase->side != 0) { return true; }
    if (!(phase->x1 > lower_stop_real(robot) && phase->x1 < upper_stop_real(robot))) { return false; }
    const real free = acceleration_in_phase_real(variation, phase, phase->x1, 0.0);
    const real friction = level_at_rest_real(robot, HOPFORM_STOPPED_ELEMENT, free < 0.0 ? -1 : 1);
    if (fabs_real(free) < friction) { return false; }
    variation->exists = variation->exists && !(friction > 0.0);
    return variation->exists;
}

static flight_answer_real flight_answer_of_real(const flight_variation_real *variation, const hopform_poles_real *poles,
                                                const hopform_flight_phase_real *phase, real h) {
    flight_answer_real answer;
    answer.pair = alone_pair_of_real(poles);
    answer.start = start_in_flight_real(poles, phase);
    if (!(poles->q > 0.0)) {
        answer.start.draw = (real)phase->side * acceleration_in_phase_real(variation, phase, phase->x1, 0.0);
    }
    answer.response = response_over_real(&answer.pair, h);
    answer.end = alone_after_real(&answer.pair, &answer.start, h, &answer.response);
    answer.x_by_p = 0.0; /* these, until they are convolved */
    answer.v_by_p = 0.0;
    answer.x_by_q = 0.0;
    answer.v_by_q = 0.0;
    return answer;
}

/* R' * R', R' * R and R * R. */
typedef struct {
    real both_rates, rate, none;
} convolved_real;

/* Those at t: 2 R' * R + p R * R = t R, R' * R' - q R * R = t R', and R * R = (R - t R' - p t R/2)/(2 q - p^2/2). The
 * last one is by the exponentials of two real poles, and near a double pole by its series. */

static convolved_real convolved_of_response_real(const alone_pair_real *pair, const known_pair_real *at, real t) {
    const real mean = 0.5 * pair->p;
    const real square = pair->q - mean * mean;
    const real z = square * t * t;
    if (z < -1.0) {
        const real half = sqrt_real(-square);
        const real fast = mean + half;
        const real slow = pair->q / fast;
        const real share = 0.25 / (half * half);
        const real of_slow = t * exponential_real(-slow * t);
        const real of_fast = t * exponential_real(-fast * t);
        const convolved_real apart = {
            share * (slow * slow * of_slow + fast * fast * of_fast - 2.0 * pair->q * at->R),
            share * (pair->p * at->R - slow * of_slow - fast * of_fast),
            share * (of_slow + of_fast - 2.0 * at->R),
        };
        return apart;
    }
    real none;
    if (z > 1.0) {
        none = 0.5 * (at->R * (1.0 - mean * t) - t * at->Rd) / square;
    } else {
        real sum = 0.0;
        for (int n = NEAR_TERMS_real - 1; n >= 0; n--) {
            sum = near_real[n] - z * sum;
        }
        none = exponential_real(-mean * t) * (t * t * t) * sum;
    }
    const convolved_real close = {t * at->Rd + pair->q * none, 0.5 * t * at->R - mean * none, none};
    return close;
}

/* R1 * R at t, where q t^2 < 1: of two real poles of integrals of t exp(-a t); else by the series of 1/(s P^2), of
 * which two terms give the next. */
SELDOM_real real convolved_integral_real(const alone_pair_real *pair, const known_pair_real *at, real t) {
    const real mean = 0.5 * pair->p;
    const real square = pair->q - mean * mean;
    if (square * t * t < -1.0) {
        const real half = sqrt_real(-square);
        const real fast = mean + half;
        const real z = pair->q / fast * t; /* < 1/2 */
        real of_slow = 0.0;
        for (int n = SLOW_TERMS_real; n > 0; n--) {
            of_slow = 1.0 / ((real)n + 1.0) - z / (real)n * of_slow;
        }
        const real of_fast = (1.0 - exponential_real(-fast * t) * (1.0 + fast * t)) / (fast * fast);
        return 0.25 * (t * t * of_slow + of_fast - 2.0 * at->R1) / (half * half);
    }
    real before = 0.0;
    real term = 1.0 / 24.0;
    real sum = term;
    for (int n = 1; n < 40 && fabs_real(term) + fabs_real(before) > 0.01 * HOPFORM_EPS_real; n++) {
        const real m = (real)n;
        const real next =
            -(pair->p * t * (m + 1.0) * term + pair->q * t * t * (m + 2.0) / (m + 3.0) * before) / (m * (m + 4.0));
        before = term;
        term = next;
        sum += term;
    }
    return t * t * t * t * sum;
}

/* The answers to changes of p and q. In a long time x is where it settles and what of it fades, so that what has faded
 * leaves no rounding. */
static void put_convolutions_real(const flight_variation_real *variation, const hopform_flight_phase_real *phase,
                                  real h, flight_answer_real *answer) {
    const alone_pair_real *pair = &answer->pair;
    const known_pair_real *at = &answer->response;
    const real side = (real)phase->side;
    const real v = side * answer->start.v;
    const real draw = side * answer->start.draw;
    const convolved_real of = convolved_of_response_real(pair, at, h);
    answer->x_by_p = v * of.rate + draw * of.none;
    answer->v_by_p = v * of.both_rates + draw * of.rate;
    if (pair->q * h * h < 1.0) {
        answer->x_by_q = phase->x1 * at->R1 + v * of.none + draw * convolved_integral_real(pair, at, h);
        answer->v_by_q = phase->x1 * at->R + v * of.rate + draw * of.none;
    } else {
        const real settled = acceleration_in_phase_real(variation, phase, 0.0, 0.0) / pair->q;
        const real fades = -draw / pair->q;
        answer->x_by_q = settled * at->R1 + fades * (of.rate + pair->p * of.none) + v * of.none;
        answer->v_by_q = settled * at->R + fades * (at->R - pair->q * of.none) + v * of.rate;
    }
}

/* Follow the changes through a phase of some length. */
static flight_answer_real travel_in_flight_real(const flight_variation_real *variation, const hopform_poles_real *poles,
                                                const hopform_flight_phase_real *phase, real h) {
    flight_answer_real answer = flight_answer_of_real(variation, poles, phase, h);
    const real p = answer.pair.p;
    const real q = answer.pair.q;
    const known_pair_real by = answer.response;
    bool known = false;
    for (int32_t n = 0; n < variation->chosen.count && h > 0.0; n++) {
        const flight_column_real column = flight_column_of_real(variation, code_of_real(&variation->chosen, n));
        const flight_slopes_real slopes = flight_slopes_of_column_real(variation, phase, &column);
        const real x1 = variation->x1[n];
        const real v1 = variation->v1[n];
        variation->x1[n] = (by.Rd + p * by.R) * x1 + by.R * v1 + by.R1 * slopes.d_a;
        variation->v1[n] = by.Rd * v1 - q * by.R * x1 + by.R * slopes.d_a;
        if (fabs_real(slopes.d_p) > 0.0 || fabs_real(slopes.d_q) > 0.0) {
            if (!known) { put_convolutions_real(variation, phase, h, &answer); }
            known = true;
            variation->x1[n] -= slopes.d_p * answer.x_by_p + slopes.d_q * answer.x_by_q;
            variation->v1[n] -= slopes.d_p * answer.v_by_p + slopes.d_q * answer.v_by_q;
        }
    }
    return answer;
}

/* ---- through the events ---- */

/* Through a stop that takes a velocity; a velocity that is rounding alone grazes it. */
static void cross_stop_in_flight_real(flight_variation_real *variation, const hopform_flight_phase_real *old,
                                      const hopform_flight_phase_real *now, const flight_answer_real *answer) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const real velocity = (real)old->side * answer->end.v;
    const real terms = fabs_real(answer->response.Rd * answer->start.v)
                       + fabs_real(answer->response.R * answer->start.draw)
                       + fabs_real(answer->end.t * alone_acceleration_real(&answer->pair, &answer->end));
    const real after = now->side == 0 ? 0.0 : now->acc1;
    variation->exists = variation->exists && fabs_real(velocity) > 16.0 * HOPFORM_EPS_real * terms;
    for (int32_t n = 0; n < variation->chosen.count && variation->exists; n++) {
        const flight_column_real column = flight_column_of_real(variation, code_of_real(&variation->chosen, n));
        const real stop =
            old->side > 0 ? upper_stop_change_real(robot, &column.robot) : lower_stop_change_real(robot, &column.robot);
        const real late = (stop - variation->x1[n]) / velocity;
        variation->x1[n] = stop;
        variation->v1[n] = 0.0 - after * late;
    }
}

/* Through a velocity that vanishes. Without friction its acceleration goes on, and nothing jumps; one that touches 0
 * under friction grazes it. */
static void cross_rest_in_flight_real(flight_variation_real *variation, const hopform_flight_phase_real *old,
                                      const hopform_flight_phase_real *now, const flight_answer_real *answer) {
    const bool follows = follows_real(variation, now);
    const bool rubs = level_of_real(&variation->plan->robot, HOPFORM_STOPPED_ELEMENT) > 0.0;
    if (!rubs && follows) { return; }
    const alone_real rest = alone_at_rest_real(&answer->pair, &answer->start, now->t - old->t);
    const real before = (real)old->side * rest.draw;
    const bool turns = now->event != HOPFORM_EVENT_NONE && fabs_real(before) > 0.0;
    variation->exists = variation->exists && turns;
    for (int32_t n = 0; n < variation->chosen.count && variation->exists; n++) {
        variation->v1[n] = follows ? variation->v1[n] * (now->acc1 / before) : 0.0;
    }
}

/* Follow the changes up to the start of the last phase. */
static void follow_flight_real(flight_variation_real *variation) {
    const hopform_flight_real *flight = variation->flight;
    const hopform_flight_phase_real *first = variation->phases;
    const bool moves = follows_real(variation, first) && !(flight->start_loss < 0.0);
    for (int32_t n = 0; n < variation->chosen.count; n++) {
        const flight_column_real column = flight_column_of_real(variation, code_of_real(&variation->chosen, n));
        variation->x1[n] = column.start.d_x1;
        variation->v1[n] = moves ? column.start.d_v1 : 0.0;
    }
    for (int32_t n = 1; n < flight->phases_kept && variation->exists; n++) {
        const hopform_flight_phase_real *old = &variation->phases[n - 1];
        const hopform_flight_phase_real *now = &variation->phases[n];
        const hopform_poles_real poles = poles_in_flight_real(&variation->rates, old->limit);
        const flight_answer_real answer = travel_in_flight_real(variation, &poles, old, now->t - old->t);
        if (now->event == HOPFORM_EVENT_HITS_STOP) {
            cross_stop_in_flight_real(variation, old, now, &answer);
        } else if (now->event != HOPFORM_FLIGHT_EVENT_U_SATURATES && now->event != HOPFORM_FLIGHT_EVENT_U_DESATURATES) {
            cross_rest_in_flight_real(variation, old, now, &answer);
        }
    }
}

/* ---- the ending ---- */

/* What sets the time of the ending: the foot that meets the ground, or is highest, the stop that it is highest at, or
 * nothing that moves. */
typedef enum { AT_GROUND_real, AT_TOP_real, AT_STOP_real, AT_FIXED_TIME_real, AT_NOTHING_real } flight_clock_real;

/* The ending, and the height of the foot there. */
typedef struct {
    flight_clock_real clock;
    real acceleration; /* of the element, before it */
    real left, relaxes;
    real rate, curvature; /* of the height */
    bool upper;           /* the stop */
} flight_ending_real;

static flight_clock_real clock_of_flight_real(const flight_variation_real *variation,
                                              const flight_ending_real *ending) {
    const hopform_flight_real *flight = variation->flight;
    const hopform_robot_real *robot = &variation->plan->robot;
    const hopform_state_real *end = &flight->end;
    const real rounding = 16.0 * HOPFORM_EPS_real
                          * (fabs_real(flight->start.v2) + fabs_real(end->v2) + fabs_real(end->v1)
                             + ending->relaxes * fabs_real(ending->left));
    if (flight->ending == HOPFORM_FLIGHT_HORIZON) { return AT_FIXED_TIME_real; }
    if (flight->ending == HOPFORM_FLIGHT_TOUCHDOWN) {
        return fabs_real(ending->rate) > rounding ? AT_GROUND_real : AT_NOTHING_real;
    }
    if (flight->ending != HOPFORM_FLIGHT_TRIPPED) { return AT_NOTHING_real; }
    if (!(flight->duration > 0.0)) { return ending->rate < -rounding ? AT_FIXED_TIME_real : AT_NOTHING_real; }
    if (!(ending->rate > rounding)) { return ending->curvature < 0.0 ? AT_TOP_real : AT_NOTHING_real; }
    const bool is_at_stop = !(end->x1 > lower_stop_real(robot) && end->x1 < upper_stop_real(robot));
    if (is_at_stop && fabs_real(end->v1) > 0.0) { return AT_STOP_real; }
    return AT_FIXED_TIME_real; /* the horizon */
}

/* The acceleration at the end, of what has not faded: draw goes as q moved, which does not fade. */
static real acceleration_at_end_real(const flight_answer_real *answer) {
    const alone_pair_real *pair = &answer->pair;
    const known_pair_real *by = &answer->response;
    const real draw = (by->Rd + pair->p * by->R) * answer->start.draw - pair->q * by->R * answer->start.v;
    return draw - pair->p * answer->end.v;
}

static flight_ending_real ending_of_flight_real(const flight_variation_real *variation,
                                                const flight_answer_real *answer) {
    const hopform_flight_real *flight = variation->flight;
    const hopform_robot_real *robot = &variation->plan->robot;
    const hopform_flight_phase_real *phase = &variation->phases[flight->phases_kept - 1];
    const real time = HOPFORM_FLIGHT_HAS_DECAY ? leg_time_real(robot) : 0.0;
    flight_ending_real ending;
    ending.acceleration = (real)phase->side * acceleration_at_end_real(answer);
    ending.relaxes = time > HOPFORM_FASTEST_CONTACT_real ? 1.0 / time : 0.0;
    ending.left = ending.relaxes > 0.0 ? flight->start.y * exponential_real(-ending.relaxes * flight->duration) : 0.0;
    ending.rate = flight->end.v2 - flight->end.v1 - ending.relaxes * ending.left;
    ending.curvature = ending.relaxes * ending.relaxes * ending.left - fall_of_real(robot) - ending.acceleration;
    ending.upper = phase->side > 0;
    ending.clock = clock_of_flight_real(variation, &ending);
    return ending;
}

/* How much later it comes, where the changes of the element at its time are x1 and v1, that of the compression over the
 * ground y, and that of what is left in the leg `left`. */
static real later_in_flight_real(const flight_variation_real *variation, const flight_ending_real *ending,
                                 const flight_column_real *column, const state_change_real *change, real left) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const real of_left = column->relaxes * ending->left + ending->relaxes * left;
    switch (ending->clock) {
    case AT_GROUND_real:
        return (change->d_y - left) / ending->rate;
    case AT_TOP_real:
        return (change->d_v1 + of_left - change->d_v2) / ending->curvature;
    case AT_STOP_real: {
        const real stop = ending->upper ? upper_stop_change_real(robot, &column->robot)
                                        : lower_stop_change_real(robot, &column->robot);
        return (stop - change->d_x1) / variation->flight->end.v1;
    }
    case AT_FIXED_TIME_real:
    case AT_NOTHING_real:
    default:
        break;
    }
    return 0.0;
}

/* The change of the apex: of that of a take-off from the start, or of the ending where the body still rises. */
static real apex_change_in_flight_real(const flight_variation_real *variation, const flight_column_real *column,
                                       real late) {
    const hopform_flight_real *flight = variation->flight;
    const state_change_real *start = &column->start;
    const real T = flight->duration;
    hopform_state_real from = flight->start;
    from.y += flight->ground;
    if (flight->start.v2 > 0.0 && flight->end.v2 > 0.0) {
        return start->d_x1 - start->d_y + (start->d_v2 - 0.5 * column->fall * T) * T + flight->end.v2 * late;
    }
    return apex_change_real(&variation->plan->robot, &from, &column->robot, start);
}

/* The rows of a column, from the changes of x1 and v1 at the time of the ending. */
static void put_flight_rows_real(const flight_variation_real *variation, const flight_ending_real *ending, int32_t n,
                                 real *matrix) {
    const hopform_flight_real *flight = variation->flight;
    const hopform_robot_real *robot = &variation->plan->robot;
    const flight_column_real column = flight_column_of_real(variation, code_of_real(&variation->chosen, n));
    const state_change_real *start = &column.start;
    const real T = flight->duration;
    const bool lands = flight->ending == HOPFORM_FLIGHT_TOUCHDOWN;
    const real faded = ending->relaxes > 0.0 ? exponential_real(-ending->relaxes * T) : 0.0;
    const real left = faded * column.leg - column.relaxes * T * ending->left;
    state_change_real change = {variation->x1[n], variation->v1[n], start->d_v2 - column.fall * T, 0.0};
    const real rises = start->d_v2 * T - 0.5 * column.fall * T * T;
    change.d_y = start->d_y - rises + (change.d_x1 - start->d_x1);
    const real late = later_in_flight_real(variation, ending, &column, &change, left);
    change.d_y =
        lands ? left - ending->relaxes * ending->left * late : change.d_y + (flight->end.v1 - flight->end.v2) * late;
    change.d_x1 += flight->end.v1 * late;
    change.d_v1 += ending->acceleration * late;
    change.d_v2 -= fall_of_real(robot) * late;
    const real rows[HOPFORM_FLIGHT_ROWS] = {
        late,
        change.d_x1,
        change.d_v1,
        height_change_real(robot, &flight->end, &column.robot, &change),
        change.d_v2,
        lands ? velocity_after_impact_change_real(robot, flight->end.v2, &column.robot, change.d_v2) : change.d_v2,
        apex_change_in_flight_real(variation, &column, late),
    };
    for (int32_t row = 0; row < HOPFORM_FLIGHT_ROWS; row++) {
        matrix[row * variation->chosen.count + n] = rows[row];
    }
}

/* Whether roots that gains and impact are formed by have a derivative: none is of 0. */
static bool has_roots_real(const hopform_plan_real *plan, const hopform_flight_real *flight) {
    const hopform_robot_real *robot = &plan->robot;
    const hopform_state_real *start = &flight->start;
    const real square = start->v2 * start->v2 + 2.0 * fall_of_real(robot) * start->x1;
    const bool lands = flight->ending == HOPFORM_FLIGHT_TOUCHDOWN;
    const bool is_short = !(start->v2 / fall_of_real(robot) - 0.05 > 0.02);
    const bool returns = flight->designed == 0 || is_short || square > 0.0 || square < 0.0;
    return returns && (!lands || velocity_after_impact_real(robot, 1.0) > 0.0);
}

/* The matrix of a solved flight; whether it has one. */
static bool put_flight_matrix_real(const hopform_plan_real *plan, const hopform_flight_phase_real *phases,
                                   const hopform_flight_real *flight, const chosen_real *chosen, real *matrix) {
    const int32_t count = chosen->count;
    flight_variation_real variation = {
        plan, phases, flight, rates_of_flight_real(plan, flight), *chosen, matrix + count, matrix + 2 * count, true,
    };
    if (!has_roots_real(plan, flight)) { return false; }
    follow_flight_real(&variation);
    const hopform_flight_phase_real *last = &phases[flight->phases_kept - 1];
    const hopform_poles_real poles = poles_in_flight_real(&variation.rates, last->limit);
    const real h = follows_real(&variation, last) ? flight->duration - last->t : 0.0;
    if (!variation.exists) { return false; }
    const flight_answer_real answer = travel_in_flight_real(&variation, &poles, last, h);
    const flight_ending_real ending = ending_of_flight_real(&variation, &answer);
    if (ending.clock == AT_NOTHING_real) { return false; }
    for (int32_t n = 0; n < count; n++) {
        put_flight_rows_real(&variation, &ending, n, matrix);
    }
    bool finite = true;
    for (int32_t n = 0; n < HOPFORM_FLIGHT_ROWS * count; n++) {
        finite = finite && is_finite_real(matrix[n]);
    }
    return finite;
}

/* Derivatives of a solved flight at its ending, through its events, by some columns: HOPFORM_FLIGHT_ROWS times
 * `column_count` numbers, row by row; columns NULL: all HOPFORM_FLIGHT_COLUMNS of them. Zeros if there are none
 * (HOPFORM_NO_DERIVATIVE): a velocity that meets a stop, or the foot the ground, grazes it; a velocity touches 0 under
 * friction; the cap on phases; a number out of range.
 *
 * Each is the total derivative: gains that were designed change with the start and the robot, given ones are held.
 * Columns Kp and Kd are by a change on top of either. Column y holds the ground ahead; with that of ground it is the
 * compression over the ground ahead. An element that starts on a stop stays where it starts until it departs; the
 * velocity of one that is held at the start stays 0.
 */
int32_t hopform_flight_sensitivities_real(const hopform_plan_real *plan, const hopform_flight_phase_real *phases,
                                          const hopform_flight_real *flight, const int32_t *columns,
                                          int32_t column_count, real *matrix) {
    const chosen_real chosen = chosen_of_real(columns, column_count, HOPFORM_FLIGHT_COLUMNS);
    const memory_real array = array_real(matrix, chosen.count, HOPFORM_FLIGHT_ROWS * sizeof *matrix);
    const memory_real codes = array_real(columns, chosen.count, sizeof *columns);
    int32_t status = flight_reading_status_real(plan, phases, flight, NULL, 0, false, &array, matrix != NULL ? 1 : 0);
    if (status < 0) { return status; }
    if (matrix == NULL && chosen.count != 0) { return HOPFORM_ERROR_NULL; }
    if (overlap_real(&array, 1, &codes, 1)) { return HOPFORM_ERROR_OVERLAP; }
    if (!are_columns_real(&chosen, HOPFORM_FLIGHT_COLUMNS, -1)) {
        return refuse_real(HOPFORM_ERROR_COLUMNS, &array, 1, NULL, 0);
    }
    if (put_flight_matrix_real(plan, phases, flight, &chosen, matrix)) { return HOPFORM_OK; }
    return refuse_real(HOPFORM_NO_DERIVATIVE, &array, 1, NULL, 0);
}

#endif
