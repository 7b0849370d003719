/* SPDX-License-Identifier: MIT-0
 *
 * A flight as a chain of phases: what the contact has carried is ballistic, the element that has stops returns under
 * the law or at the limit of its input, slips or is held. It ends at the first downward crossing of the ground ahead.
 *
 * The element slips alone, as in a stance (alone_real.h): the distance to a stop is a guard, and the pull of the law a
 * function of s and v. The height over the ground is one that falls freely besides. A phase in which the element slips
 * ends at the latest where its velocity vanishes, within half a period of the pair (rule 3). While it is held the
 * height is a parabola, whose root is known. What a damper leaves of the leg's compression is in the height, too, and
 * fades as exp(-l t).
 */
#ifndef HOPFORM_FLIGHT_H_real
#define HOPFORM_FLIGHT_H_real

#include "chain_real.h"
#include "facts.h"
#include "linear_real.h"
#include "overlap_real.h"
#include "plan_real.h"

typedef enum {
    FLIGHT_STOP_real,
    FLIGHT_PULL_real,
    FLIGHT_TOUCHDOWN_real,
    FLIGHT_REST_real,
    FLIGHT_HORIZON_real
} flight_end_real;

/* A search for the height over the ground ahead, or for the sign of its rate. The last derivative that rule 2 goes by
 * is a motion of the pair alone: whether it begins below 0, and when it changes its sign. */
typedef struct {
    bool is_rate; /* it is the rate: one derivative less */
    real sign;
    real shift; /* by which it is lowered, of rounding: where it begins at a root it begins at 0 */
    bool is_negative;
    real turn;
} fall_real;

/* The element at a time of the phase, and such a function there. */
typedef struct {
    alone_real moved;
    jet_real jet;
} fall_at_real;

/* The chain while it grows. */
typedef struct {
    const hopform_robot_real *robot;
    hopform_gains_real gains;
    flight_rates_real rates;
    real largest, fall, horizon;
    hopform_state_real start;       /* its compression is that over the ground ahead */
    real leg, relaxes;              /* compression that a damper leaves in the leg, and the rate of that */
    hopform_flight_phase_real now;  /* the phase */
    hopform_poles_real poles;       /* of it */
    alone_pair_real pair;           /* the same */
    real height, rate;              /* of the foot over the ground ahead, without the leg's; of what falls: its start */
    alone_real last;                /* where it ends */
    bool airborne;                  /* the foot has been above the ground */
    real highest;                   /* else: how high it has been, where and when */
    hopform_flight_real at_highest; /* as far as it is filled */
    int32_t max_phases, capacity;
    int32_t intervals; /* of the phase, so far */
    hopform_flight_phase_real *phases;
    hopform_flight_real *flight;
} flight_chain_real;

/* ---- a phase over time ---- */

/* The largest force of the motor, 0 if it has none. */
static real largest_force_real(const hopform_robot_real *robot) {
    const real force = fabs_real(force_constant_real(robot)) * current_limit_real(robot);
    return fabs_real(force_constant_real(robot)) > 0.0 ? lesser_real(force, HOPFORM_NEVER_real) : 0.0;
}

static hopform_poles_real poles_in_flight_real(const flight_rates_real *rates, int limit) {
    return limit == 0 ? pair_alone_real(rates->p_law, rates->q_law) : pair_alone_real(rates->p_free, 0.0);
}

/* The start of a phase's motion. */
static inline alone_real start_in_flight_real(const hopform_poles_real *poles, const hopform_flight_phase_real *phase) {
    const numerator_real h = displacement_numerator_real(phase->v1, phase->acc1, poles);
    const alone_real start = {0.0, 0.0, (real)phase->side * h.H3, (real)phase->side * h.H2};
    return start;
}

/* The motion at a time of the phase. */
static inline alone_real moved_in_flight_real(const alone_pair_real *pair, const alone_real *start, real t) {
    const known_pair_real response = response_over_real(pair, t);
    return alone_after_real(pair, start, t, &response);
}

/* The state at a time of a phase; rounding or underflow may have put the position a last digit beyond a stop. */
static hopform_state_real state_in_flight_real(const hopform_robot_real *robot, const hopform_state_real *start,
                                               const hopform_flight_phase_real *phase, const alone_real *at) {
    const real side = (real)phase->side;
    const real g = fall_of_real(robot);
    const real t = phase->t + at->t;
    const real rise = (start->v2 - 0.5 * g * t) * t;
    const real moved = (phase->x1 - start->x1) + side * at->s;
    const real position = lesser_real(upper_stop_real(robot), phase->x1 + side * at->s);
    hopform_state_real state;
    state.x1 = greater_real(lower_stop_real(robot), position);
    state.v1 = side * at->v;
    state.v2 = start->v2 - g * t;
    state.y = start->y - (rise - moved);
    return state;
}

/* What a damper leaves of the leg's compression, at a time of the flight. */
static real left_in_leg_real(const flight_chain_real *chain, real t) {
    return HOPFORM_FLIGHT_HAS_DECAY ? chain->leg * exponential_real(-chain->relaxes * t) : 0.0;
}

/* ---- the height over the ground ---- */

static inline bool begins_to_fall_real(const jet_real *at) {
    return at->rate < 0.0 || (!(at->rate > 0.0) && at->curvature < 0.0);
}

/* The height at a time of a phase: counted from the take-off, so that nothing adds up. */
static real height_in_flight_real(const flight_chain_real *chain, const alone_real *at) {
    const real t = at->t;
    return chain->height + (chain->rate - 0.5 * chain->fall * t) * t - (real)chain->now.side * at->s
           + left_in_leg_real(chain, chain->now.t + t);
}

/* What rounding may have done to it. No term of s is much larger than s. */
static real rounding_in_flight_real(const flight_chain_real *chain, const alone_real *at, real rate) {
    const real t = at->t;
    return 16.0 * HOPFORM_EPS_real
           * (fabs_real(chain->height) + fabs_real(chain->rate * t) + 0.5 * chain->fall * t * t + at->s
              + t * fabs_real(rate));
}

static jet_real jet_in_fall_real(const flight_chain_real *chain, const fall_real *fall, const alone_real *at) {
    const real p = chain->pair.p;
    const real q = chain->pair.q;
    const real side = (real)chain->now.side;
    const real sign = fall->sign;
    const real acc = at->draw - p * at->v;
    const real third = -(p * acc + q * at->v);
    const real fourth = -(p * third + q * acc);
    const real l = HOPFORM_FLIGHT_HAS_DECAY ? chain->relaxes : 0.0;
    const real left = left_in_leg_real(chain, chain->now.t + at->t);
    const real of_left = l * l * left;
    const jet_real jet = {height_in_flight_real(chain, at) - fall->shift,
                          chain->rate - chain->fall * at->t - side * at->v - l * left,
                          of_left - chain->fall - side * acc, -(side * third + l * of_left)};
    const jet_real of_rate = {sign * jet.rate - fall->shift, sign * jet.curvature, sign * jet.third,
                              sign * (l * l * of_left - side * fourth)};
    return fall->is_rate ? of_rate : jet;
}

/* What rounding may have done to such a function. */
static real rounding_in_fall_real(const flight_chain_real *chain, const fall_real *fall, const fall_at_real *at) {
    const real t = at->moved.t;
    if (!fall->is_rate) { return rounding_in_flight_real(chain, &at->moved, at->jet.rate); }
    return 16.0 * HOPFORM_EPS_real
           * (fabs_real(chain->rate) + chain->fall * t + fabs_real(chain->now.v1) + at->moved.v
              + t * fabs_real(at->jet.rate));
}

static fall_at_real fall_after_real(const flight_chain_real *chain, const fall_real *fall, real t) {
    const alone_real start = start_in_flight_real(&chain->poles, &chain->now);
    fall_at_real at;
    at.moved = moved_in_flight_real(&chain->pair, &start, t);
    at.jet = jet_in_fall_real(chain, fall, &at.moved);
    return at;
}

/* The search for a root of the height itself or of its rate, with a sign: three derivatives of the height remove what
 * falls freely, (D + l) what fades. */
static fall_real fall_search_real(const flight_chain_real *chain, bool is_rate, real sign) {
    const hopform_poles_real *poles = &chain->poles;
    const real l = chain->relaxes;
    real displacement[6] = {0.0, chain->now.v1, chain->now.acc1};
    for (int i = 3; i < 6; i++) {
        displacement[i] = -poles->p * displacement[i - 1] - poles->q * displacement[i - 2];
    }
    const real value =
        -sign * (HOPFORM_FLIGHT_HAS_DECAY && l > 0.0 ? displacement[4] + l * displacement[3] : displacement[3]);
    const real rate =
        -sign * (HOPFORM_FLIGHT_HAS_DECAY && l > 0.0 ? displacement[5] + l * displacement[4] : displacement[4]);
    const bool is_negative = value < 0.0 || (!(value > 0.0) && rate < 0.0);
    const real turn = time_to_rest_real(poles, fabs_real(value), is_negative ? -rate : rate); /* rule 3 */
    const fall_real fall = {is_rate, sign, 0.0, is_negative, turn};
    return fall;
}

/* Sign changes of (+, g', g'') for the height, (+, g') for its rate, where a leg relaxes of (D + l) of the last of
 * these, and of the last one, a motion of the pair alone; a zero goes with what follows on it. */
static int variations_in_fall_real(const fall_real *fall, real l, const jet_real *at, bool last) {
    const real relaxed = fall->is_rate ? at->curvature + l * at->rate : at->third + l * at->curvature;
    const bool third = HOPFORM_FLIGHT_HAS_DECAY && l > 0.0 ? relaxed < 0.0 || (!(relaxed > 0.0) && last) : last;
    const bool curvature = fall->is_rate ? third : at->curvature < 0.0 || (!(at->curvature > 0.0) && third);
    const bool rate = at->rate < 0.0 || (!(at->rate > 0.0) && curvature);
    return (rate ? 1 : 0) + (rate != curvature ? 1 : 0) + (curvature != third ? 1 : 0) + (third != last ? 1 : 0);
}

/* A bound of g from below over an interval of length h: g'' is above m <= 0, so g is above a parabola from either end.
 * The two meet once, and are concave. */
static real lower_bound_real(const jet_real *from, const jet_real *to, real m, real h) {
    const real meet = from->value - to->value + (to->rate - 0.5 * m * h) * h;
    const real steeper = to->rate - from->rate - m * h;
    const real t = meet > 0.0 && steeper > 0.0 ? lesser_real(meet / steeper, h) : 0.0;
    return from->value + (from->rate + 0.5 * m * t) * t;
}

/* Whether it has no root between two times; else where the interval is cut. Rule 2 with one pole at 0 more than in a
 * stance: g''' is a motion of the pair, or (D + l) g''' where a leg relaxes. */
static bool is_certified_in_fall_real(const flight_chain_real *chain, const fall_real *fall, const fall_at_real *low,
                                      const fall_at_real *high, real *cut) {
    const jet_real *from = &low->jet;
    const jet_real *to = &high->jet;
    const real l = chain->relaxes;
    const real h = high->moved.t - low->moved.t;
    const bool before = fall->is_negative != (low->moved.t >= fall->turn);
    const bool after = fall->is_negative != (high->moved.t > fall->turn);
    if (variations_in_fall_real(fall, l, from, before) + (before != after ? 1 : 0)
        <= variations_in_fall_real(fall, l, to, after)) {
        return true;
    }
    const bool has_minimum = begins_to_fall_real(from) && !(to->rate < 0.0); /* a rate may have faded */
    const real inside =
        has_minimum ? cut_between_real(from->rate, to->rate, h) : cut_between_real(from->curvature, to->curvature, h);
    *cut = before != after ? fall->turn : low->moved.t + inside;
    real m = lesser_real(lesser_real(from->curvature, to->curvature), 0.0);
    if (HOPFORM_FLIGHT_HAS_DECAY && l > 0.0 && from->third < 0.0 && to->third > 0.0) {
        m += h * from->third; /* exp(l t) g''' rises */
    }
    const bool bends_least_at_an_end = before == after && !(fall->is_rate && before);
    return (bends_least_at_an_end && lower_bound_real(from, to, m, h) > -rounding_in_fall_real(chain, fall, high))
           || !(*cut > low->moved.t && *cut < high->moved.t); /* too short to be cut */
}

/* ---- the search ---- */

/* The root between two times, at the first of which it is positive, or 0 and rises, and at the second negative:
 * Householder's steps, until what one leaves is less than rounding of the time. */
static fall_at_real root_in_fall_real(const flight_chain_real *chain, const fall_real *fall, const fall_at_real *low,
                                      const fall_at_real *high) {
    real from = low->moved.t;
    fall_at_real beyond = *high;
    real t = from + (beyond.moved.t - from) * rough_root_real(&low->jet, &high->jet, beyond.moved.t - from);
    for (int n = 0; n < 100; n++) {
        const real to = beyond.moved.t;
        if (!(t > from && t < to) || (n > 8 && n % 2 == 1)) { t = from + 0.5 * (to - from); }
        if (!(t > from && t < to)) { break; }
        const fall_at_real at = fall_after_real(chain, fall, t);
        const jet_real *jet = &at.jet;
        if (fabs_real(jet->value) <= HOPFORM_EPS_real * t * fabs_real(jet->rate)) { return at; }
        if (jet->value < 0.0) {
            beyond = at;
        } else {
            from = t;
        }
        const real step = -step_to_root_real(jet);
        const real bend = jet->curvature / (jet->rate < 0.0 ? jet->rate : -1.0);
        const real third = jet->third / (jet->rate < 0.0 ? jet->rate : -1.0);
        const real share = step / t;
        const real square = step * step * (chain->pair.square + bend * bend + fabs_real(third));
        const real left = 0.25 * HOPFORM_EPS_real;
        t += step;
        if (jet->rate < 0.0 && t > from && t < beyond.moved.t
            && share * share * (square * square * square) <= left * left) {
            return fall_after_real(chain, fall, t);
        }
    }
    return beyond;
}

/* Whether it has a root between two times of the phase; the later one is put at the first root then. It ends without
 * one where the phase has had as many intervals as it may. */
static bool has_root_in_fall_real(flight_chain_real *chain, fall_real *fall, const alone_real *from, alone_real *end) {
    fall_at_real low = {*from, jet_in_fall_real(chain, fall, from)};
    if (low.jet.value < (low.jet.rate > 0.0 ? rounding_in_fall_real(chain, fall, &low) : 0.0)) {
        fall->shift = low.jet.value;
        low.jet.value = 0.0;
    }
    const fall_at_real last = {*end, jet_in_fall_real(chain, fall, end)};
    if (!(low.jet.value > 0.0) && begins_to_fall_real(&low.jet) && last.jet.value < 0.0) {
        *end = *from;
        return true;
    }
    fall_at_real high = last;
    for (; chain->intervals < HOPFORM_MOST_INTERVALS; chain->intervals++) {
        const real rounding = rounding_in_fall_real(chain, fall, &high);
        const real h = high.moved.t - low.moved.t;
        const bool found = high.jet.value < 0.0 && lesser_real(high.jet.value, high.jet.rate * h) < -rounding;
        if (found) { high = root_in_fall_real(chain, fall, &low, &high); }
        real cut;
        if (!is_certified_in_fall_real(chain, fall, &low, &high, &cut)) {
            high = fall_after_real(chain, fall, cut);
            continue;
        }
        if (found || !(high.moved.t < end->t)) {
            *end = high.moved;
            return found;
        }
        low = high;
        low.jet.value = greater_real(low.jet.value, 0.0);
        high = last;
    }
    return false;
}

/* ---- the end of a phase ---- */

/* How far the stop ahead is. */
static real gap_in_flight_real(const flight_chain_real *chain) {
    const real position = chain->now.x1;
    return chain->now.side > 0 ? upper_stop_real(chain->robot) - position : position - lower_stop_real(chain->robot);
}

/* The acceleration under what the motor does now, at a velocity, with the friction of a side. */
static real acceleration_of_real(const flight_chain_real *chain, real velocity, int side) {
    const flight_rates_real *rates = &chain->rates;
    const int limit = chain->now.limit;
    return limit == 0 ? acceleration_under_law_real(chain->robot, rates, chain->now.x1, velocity, (real)side)
                      : acceleration_at_limit_real(chain->robot, rates, velocity, (real)side, (real)limit);
}

/* The magnitudes that the room of the pull is a difference of. */
static real terms_of_room_in_flight_real(const flight_chain_real *chain) {
    const hopform_flight_phase_real *now = &chain->now;
    return fabs_real(chain->gains.Kp * now->x1) + fabs_real(chain->gains.Kd * now->v1) + chain->largest;
}

/* The room of the pull to the limits of the input, or at a limit what it is beyond that. */
static void put_room_in_flight_real(const flight_chain_real *chain, alone_search_real *search) {
    const hopform_flight_phase_real *now = &chain->now;
    const hopform_gains_real *gains = &chain->gains;
    const real start = gains->Kp * now->x1 + gains->Kd * now->v1;
    const real terms = terms_of_room_in_flight_real(chain);
    const numerator_real pull = pull_numerator_real(gains, now->v1, now->acc1, &chain->poles);
    for (int side = -1; side <= 1 && (gains->Kp > 0.0 || gains->Kd > 0.0); side += 2) {
        if (side != -now->limit) {
            const real sign = (real)(now->limit == 0 ? -side : side);
            (void)add_alone_function_real(search, &pull, start - (real)side * chain->largest, terms, sign, LIMIT_real,
                                          now->limit == 0 ? side : 0);
        }
    }
}

/* The end of a slipping phase at a time at the latest: a stop, a limit of the input, or rest. It touches a stop at rest
 * within rounding of where the phase begins, of the stop, and of the displacement between. */
static flight_end_real end_of_slip_real(flight_chain_real *chain, real until, int *to) {
    const hopform_flight_phase_real *now = &chain->now;
    const real gap = gap_in_flight_real(chain);
    evaluations_real evaluations = {UNBOUNDED_real};
    alone_search_real search;
    begin_alone_search_real(&search, HOPFORM_STOPPED_ELEMENT, &chain->poles,
                            timescales_of_poles_real(&chain->poles).half_period);
    search.start = start_in_flight_real(&chain->poles, now);
    if (!(chain->pair.q > 0.0)) { search.start.draw = (real)now->side * acceleration_of_real(chain, 0.0, now->side); }
    if (is_finite_real(gap)) { add_alone_guard_real(&search, gap, ELEMENT_real + search.element)->stops = true; }
    put_room_in_flight_real(chain, &search);
    find_alone_event_real(&search, true, until, &evaluations);
    chain->last = search.end;
    *to = search.side;
    const real size = fabs_real(now->x1) + gap + search.end.s;
    const real bound = 16.0 * HOPFORM_EPS_real * size;
    const bool touches = search.stops || (is_finite_real(gap) && fabs_real(gap - search.end.s) <= bound);
    const flight_end_real slips = search.owner == LIMIT_real ? FLIGHT_PULL_real : FLIGHT_HORIZON_real;
    const flight_end_real rests = touches ? FLIGHT_STOP_real : FLIGHT_REST_real;
    return search.owner == ELEMENT_real + search.element ? rests : slips;
}

/* Put how the flight would end at a time of the phase into it; not behind the horizon by rounding. */
static void put_ending_real(const flight_chain_real *chain, const alone_real *at) {
    chain->flight->duration = lesser_real(chain->now.t + at->t, chain->horizon);
    chain->flight->end = state_in_flight_real(chain->robot, &chain->start, &chain->now, at);
}

/* Before the foot has been above the ground: whether it is, and whether it is higher than before. */
static void look_at_foot_real(flight_chain_real *chain, const alone_real *at) {
    const real height = height_in_flight_real(chain, at);
    if (!chain->airborne && height > chain->highest) {
        chain->airborne = height > rounding_in_flight_real(chain, at, 0.0);
        chain->highest = height;
        put_ending_real(chain, at);
        chain->at_highest = *chain->flight;
    }
}

/* Height of the foot if the leg were the shortest. */
static real height_of_shortest_real(const flight_chain_real *chain) {
    const real longer = chain->now.x1 - lower_stop_real(chain->robot);
    return chain->height + longer + greater_real(left_in_leg_real(chain, chain->now.t), 0.0);
}

/* Up to when a phase may last: a foot that is above the ground is below it when not even the shortest leg would do. */
static real longest_phase_real(const flight_chain_real *chain) {
    const real until = chain->horizon - chain->now.t;
    const real height = height_of_shortest_real(chain);
    if (!chain->airborne || !(height >= 0.0 && height <= HOPFORM_NEVER_real)) { return until; }
    const real fallen = 1.01 * time_of_fall_real(chain->robot, chain->rate, height);
    return fallen < until && fallen > 0.0 ? fallen : until;
}

/* The end of a phase in which the foot moves on a parabola. */
static flight_end_real end_of_parabola_real(flight_chain_real *chain) {
    const real until = chain->horizon - chain->now.t;
    const real height = chain->height;
    const real rate = chain->rate;
    const real g = chain->fall;
    if (!chain->airborne && rate > 0.0) {
        const alone_real top = {lesser_real(rate / g, until), 0.0, 0.0, 0.0};
        look_at_foot_real(chain, &top);
    }
    const real square = rate * rate + 2.0 * g * height;
    const real then = square <= HOPFORM_NEVER_real ? sqrt_real(greater_real(square, 0.0)) : fabs_real(rate);
    const real slower = then - rate > 0.0 ? then - rate : 1.0;
    const real down = rate > 0.0 ? (rate + then) / g : 2.0 * greater_real(height, 0.0) / slower;
    const bool lands = chain->airborne && down <= until;
    const alone_real last = {lands ? down : until, 0.0, 0.0, 0.0};
    chain->last = last;
    return lands ? FLIGHT_TOUCHDOWN_real : FLIGHT_HORIZON_real;
}

/* Whether the foot stays above the ground until the last instant for certain. Its height less that of the body is a
 * displacement that only grows to one side, and the body's is concave in time: no less than at one of its ends. */
static bool foot_stays_above_real(const flight_chain_real *chain) {
    const real t = chain->last.t;
    const real rise = (chain->rate - 0.5 * chain->fall * t) * t;
    const real lower = chain->now.side > 0 ? chain->last.s : 0.0;
    const real rounding = 2.0 * rounding_in_flight_real(chain, &chain->last, 0.0);
    const real height = chain->height - lower;
    const bool relaxes = HOPFORM_FLIGHT_HAS_DECAY && fabs_real(chain->leg) > 0.0;
    const bool rises = !(chain->now.side > 0) && chain->rate > 0.0 && rise > rounding; /* from where it has begun */
    return chain->airborne && !relaxes && (rises || (height > rounding && height + rise > rounding));
}

/* Where the foot meets the ground after it has been above it, up to the last instant. Before, it is followed from where
 * it is highest, or lowest, to the next such point. */
static flight_end_real end_at_touchdown_real(flight_chain_real *chain, flight_end_real end) {
    if (foot_stays_above_real(chain)) { return end; }
    alone_real low = start_in_flight_real(&chain->poles, &chain->now);
    fall_real height = fall_search_real(chain, false, 1.0);
    const jet_real first = jet_in_fall_real(chain, &height, &low);
    real sign = begins_to_fall_real(&first) ? -1.0 : 1.0;
    while (!chain->airborne && low.t < chain->last.t) {
        fall_real onward = fall_search_real(chain, true, sign);
        alone_real turn = chain->last;
        (void)has_root_in_fall_real(chain, &onward, &low, &turn);
        low = turn;
        sign = -sign;
        look_at_foot_real(chain, &low);
    }
    if (!chain->airborne) { return end; }
    return has_root_in_fall_real(chain, &height, &low, &chain->last) ? FLIGHT_TOUCHDOWN_real : end;
}

/* Finds the last instant of the phase, and what ends it; to what the pull changes. */
static flight_end_real find_end_in_flight_real(flight_chain_real *chain, int *to) {
    if (chain->now.side == 0 && !(HOPFORM_FLIGHT_HAS_DECAY && fabs_real(chain->leg) > 0.0)) {
        return end_of_parabola_real(chain);
    }
    const real until = longest_phase_real(chain);
    const alone_real last = {until, 0.0, 0.0, 0.0};
    chain->last = last;
    return end_at_touchdown_real(chain,
                                 chain->now.side != 0 ? end_of_slip_real(chain, until, to) : FLIGHT_HORIZON_real);
}

/* ---- the chain ---- */

static void record_in_flight_real(flight_chain_real *chain, int event) {
    hopform_flight_real *flight = chain->flight;
    chain->now.event = (int8_t)event;
    if (flight->phase_count < chain->capacity) { chain->phases[flight->phase_count] = chain->now; }
    if (event != HOPFORM_EVENT_NONE && flight->phase_count < chain->max_phases
        && flight->event_count < flight->phase_count) {
        flight->event_count++;
    }
    flight->phase_count++;
}

/* Whether the motor is at its limit: where its pull is on it, the sign of its rate decides. */
static void choose_limit_real(flight_chain_real *chain) {
    const hopform_flight_phase_real *now = &chain->now;
    const real pull = chain->gains.Kp * now->x1 + chain->gains.Kd * now->v1;
    const real beyond = decided_real(fabs_real(pull) - chain->largest, terms_of_room_in_flight_real(chain));
    chain->now.limit = beyond > 0.0 ? (int8_t)goes_real(pull, 0.0) : 0;
    if (!(fabs_real(beyond) > 0.0) && now->side != 0) {
        const real acceleration = acceleration_of_real(chain, now->v1, now->side);
        const real rate = chain->gains.Kp * now->v1 + chain->gains.Kd * acceleration;
        chain->now.limit = rate * pull > 0.0 ? (int8_t)goes_real(pull, 0.0) : 0;
    }
}

/* The element at rest: held while the free acceleration is within the friction at rest, or behind a stop, which never
 * changes as long as it is held. */
static void settle_in_flight_real(flight_chain_real *chain, real free) {
    const real friction = level_of_real(chain->robot, HOPFORM_STOPPED_ELEMENT);
    const real at_rest = level_at_rest_real(chain->robot, HOPFORM_STOPPED_ELEMENT, free < 0.0 ? -1 : 1);
    chain->now.side = (int8_t)goes_real(free, at_rest);
    if (!(gap_in_flight_real(chain) > 0.0)) { chain->now.side = 0; }
    chain->now.acc1 = chain->now.side == 0 ? 0.0 : free - friction * (real)chain->now.side;
}

/* The element has come to rest. Without dry friction its acceleration goes on as it was. */
static void rest_in_flight_real(flight_chain_real *chain, bool at_stop) {
    const hopform_robot_real *robot = chain->robot;
    const int before = chain->now.side;
    const bool sticks = level_of_real(robot, HOPFORM_STOPPED_ELEMENT) > 0.0;
    chain->now.v1 = 0.0;
    if (at_stop) {
        chain->now.x1 = before > 0 ? upper_stop_real(robot) : lower_stop_real(robot);
        choose_limit_real(chain);
    }
    settle_in_flight_real(chain, at_stop || sticks ? acceleration_of_real(chain, 0.0, 0) : chain->now.acc1);
    const int turned = chain->now.side != before ? HOPFORM_EVENT_REVERSES(HOPFORM_STOPPED_ELEMENT) : HOPFORM_EVENT_NONE;
    const int rested = chain->now.side == 0 ? HOPFORM_EVENT_STICKS(HOPFORM_STOPPED_ELEMENT) : turned;
    record_in_flight_real(chain, at_stop ? HOPFORM_EVENT_HITS_STOP : rested);
}

/* What the element does at the start; no event. */
static void begin_flight_real(flight_chain_real *chain) {
    chain->now.side = (int8_t)goes_real(chain->now.v1, 0.0);
    if (chain->now.side != 0 && !(gap_in_flight_real(chain) > 0.0)) {
        chain->flight->start_loss = loss_at_stop_real(chain->robot, &chain->start);
        chain->now.v1 = 0.0;
        chain->now.side = 0;
    }
    choose_limit_real(chain);
    if (chain->now.side == 0) {
        settle_in_flight_real(chain, acceleration_of_real(chain, 0.0, 0));
    } else {
        chain->now.acc1 = acceleration_of_real(chain, chain->now.v1, chain->now.side);
    }
    record_in_flight_real(chain, HOPFORM_EVENT_NONE);
}

/* The poles and the height of the phase that begins; whether the foot is above the ground at the start of the flight,
 * or on it and rises faster than rounding. From a leg that relaxes a take-off gives the foot no velocity: what is left
 * of it is rounding, of compressions that may have been larger by orders, so that the foot is followed to where it is
 * highest. */
static void begin_phase_real(flight_chain_real *chain) {
    chain->poles = poles_in_flight_real(&chain->rates, chain->now.limit);
    chain->pair = alone_pair_of_real(&chain->poles);
    const real t = chain->now.t;
    chain->rate = chain->start.v2 - chain->fall * t;
    chain->height = (chain->start.x1 - chain->now.x1) + (chain->start.v2 - 0.5 * chain->fall * t) * t - chain->start.y;
    chain->intervals = 0;
    if (chain->flight->phase_count == 1) {
        const alone_real first = start_in_flight_real(&chain->poles, &chain->now);
        const fall_real height = fall_search_real(chain, false, 1.0);
        const jet_real at = jet_in_fall_real(chain, &height, &first);
        const real rates = fabs_real(chain->start.v2) + fabs_real(chain->now.v1);
        const bool relaxes = HOPFORM_FLIGHT_HAS_DECAY && fabs_real(chain->leg) > 0.0;
        const bool rises = !(at.value < 0.0) && at.rate > 16.0 * HOPFORM_EPS_real * rates;
        chain->airborne = at.value > 0.0 || (rises && !relaxes);
        look_at_foot_real(chain, &first);
    }
}

static int32_t run_flight_real(flight_chain_real *chain) {
    hopform_flight_real *flight = chain->flight;
    begin_flight_real(chain);
    while (flight->phase_count <= chain->max_phases) {
        begin_phase_real(chain);
        if (!chain->airborne && chain->rate < 0.0 && height_of_shortest_real(chain) < chain->highest) {
            /* The foot cannot come as high again: it falls, and is too low for the shortest leg. */
            *flight = chain->at_highest;
            return HOPFORM_FLIGHT_TRIPPED;
        }
        int side = 0;
        const flight_end_real end = find_end_in_flight_real(chain, &side);
        if (chain->intervals >= HOPFORM_MOST_INTERVALS) {
            flight->phase_count = 0; /* report_flight refuses it */
            return HOPFORM_FLIGHT_HORIZON;
        }
        put_ending_real(chain, &chain->last);
        chain->now.t = flight->duration;
        if (end == FLIGHT_TOUCHDOWN_real) {
            flight->end.y = left_in_leg_real(chain, flight->duration);
            return HOPFORM_FLIGHT_TOUCHDOWN;
        }
        if (end == FLIGHT_HORIZON_real) {
            flight->duration = chain->horizon;
            *flight = chain->airborne ? *flight : chain->at_highest;
            return chain->airborne ? HOPFORM_FLIGHT_HORIZON : HOPFORM_FLIGHT_TRIPPED;
        }
        const real goes = (real)chain->now.side;
        chain->now.x1 = flight->end.x1;
        chain->now.v1 = flight->end.v1;
        chain->now.acc1 = goes * alone_acceleration_real(&chain->pair, &chain->last);
        if (end == FLIGHT_PULL_real) {
            /* Through the law the acceleration would have the rounding of the position times Kp. */
            const real limit = (real)(side != 0 ? side : chain->now.limit);
            chain->now.acc1 = acceleration_at_limit_real(chain->robot, &chain->rates, chain->now.v1, goes, limit);
            chain->now.limit = (int8_t)side;
            record_in_flight_real(chain,
                                  side == 0 ? HOPFORM_FLIGHT_EVENT_U_DESATURATES : HOPFORM_FLIGHT_EVENT_U_SATURATES);
        } else {
            rest_in_flight_real(chain, end == FLIGHT_STOP_real);
        }
    }
    flight->phase_count--;
    return HOPFORM_FLIGHT_TOO_MANY_PHASES;
}

/* ---- what users call ---- */

static bool gains_are_sound_real(const hopform_gains_real *gains) {
    return gains->Kp >= 0.0 && gains->Kp <= HOPFORM_NEVER_real && gains->Kd >= 0.0 && gains->Kd <= HOPFORM_NEVER_real;
}

/* Gains of a return that is settled 50 ms before the touchdown on the ground that was left, in 20 ms at least. */
static hopform_gains_real gains_for_real(const hopform_robot_real *robot, const hopform_state_real *start) {
    const real time = time_of_fall_real(robot, start->v2, start->x1) - 0.05; /* NaN where it does not rise that high */
    return critical_gains_real(robot, greater_real(time, 0.02));
}

/* Fill in what depends on the ending. False if a number left the range of the type, or the search met its cap. */
static bool report_flight_real(const flight_chain_real *chain, hopform_flight_real *flight) {
    const hopform_state_real *start = &chain->start;
    const hopform_state_real *end = &flight->end;
    const real g = chain->fall;
    const real top = lesser_real(greater_real(start->v2, 0.0) / g, flight->duration);
    const real left = left_in_leg_real(chain, flight->duration);
    flight->gains = chain->gains;
    flight->v2_after = end->v2;
    if (flight->ending == HOPFORM_FLIGHT_TOUCHDOWN) {
        flight->v2_after = velocity_after_impact_real(chain->robot, end->v2);
        flight->impact_loss = loss_at_impact_real(chain->robot, end->v2);
    }
    flight->apex_time = top;
    flight->apex = start->x1 - start->y + (start->v2 - 0.5 * g * top) * top;
    flight->leg_loss = HOPFORM_FLIGHT_HAS_DECAY
                           ? leg_energy_real(chain->robot, left) - leg_energy_real(chain->robot, chain->leg)
                           : 0.0;
    flight->phases_kept = flight->phase_count < chain->capacity ? flight->phase_count : chain->capacity;
    const real others = fabs_real(flight->duration) + fabs_real(flight->v2_after) + fabs_real(flight->apex)
                        + fabs_real(top) - flight->impact_loss - flight->start_loss - flight->leg_loss;
    return flight->phase_count > 0 && is_finite_state_real(end) && others <= HOPFORM_NEVER_real;
}

/* Gains with which the actuator, from rest, is back within 1/100 of its displacement in a time [s], critically
 * damped. */
int32_t hopform_design_return_real(const hopform_plan_real *plan, real time, hopform_gains_real *gains) {
    const memory_real read = array_real(plan, 1, sizeof *plan);
    const memory_real written = array_real(gains, 1, sizeof *gains);
    int32_t status = HOPFORM_OK;
    if (plan == NULL || gains == NULL) {
        status = HOPFORM_ERROR_NULL;
    } else if (overlap_real(&written, 1, &read, 1)) {
        status = HOPFORM_ERROR_OVERLAP;
    } else if (!HOPFORM_HAS_CONTACT || !is_made_real(plan)) {
        status = HOPFORM_ERROR_ROBOT;
    } else if (!(time > 0.0 && time <= HOPFORM_NEVER_real)) {
        status = HOPFORM_ERROR_TIME;
    } else {
        *gains = critical_gains_real(&plan->robot, time);
        status = gains_are_sound_real(gains) ? HOPFORM_OK : HOPFORM_ERROR_NUMBERS;
    }
    return status < 0 ? refuse_real(status, &written, 1, &read, 1) : status;
}

/* Solve one flight, from take-off to the first downward crossing of the ground ahead by the foot after it has been
 * above it.
 *
 * start: state at take-off, as the stance has ended. ground: height of the ground ahead over that which is left, 0 if
 * it is flat. Where a damper acts in the leg, it relaxes from start's y; the end's y is what is left of that. gains: of
 * the law gamma2 u = Kp x1 + Kd v1, which stays within u_max; NULL for those of hopform_design_return, settled 50 ms
 * before the touchdown on the ground that was left (20 ms at least). A flight that never gets above the ground ahead
 * ends, tripped, where its foot came highest. One whose phase is not searched within 10 000 intervals is refused:
 * its numbers leave the range. g must be > 0.
 */
int32_t hopform_solve_flight_real(const hopform_plan_real *plan, const hopform_state_real *start, real ground,
                                  const hopform_gains_real *gains, real horizon, int32_t max_phases,
                                  hopform_flight_phase_real *phases, int32_t capacity, hopform_flight_real *flight) {
    static const hopform_flight_real nothing = {0};
    if (flight == NULL) { return HOPFORM_ERROR_NULL; }
    const hopform_state_real from = start != NULL ? *start : nothing.start; /* may lie in what is written, as gains */
    const hopform_gains_real law = gains != NULL ? *gains : nothing.gains;
    const memory_real read = array_real(plan, 1, sizeof *plan);
    const memory_real written[2] = {
        array_real(flight, 1, sizeof *flight),
        array_real(phases, capacity, sizeof *phases),
    };
    if (overlap_real(written, 2, &read, 1)) { return refuse_real(HOPFORM_ERROR_OVERLAP, written, 1, &read, 1); }
    *flight = nothing;
    if (plan == NULL || start == NULL || (phases == NULL && capacity > 0)) { return HOPFORM_ERROR_NULL; }
    const hopform_robot_real *robot = &plan->robot;
    if (!hops_real(plan)) { return HOPFORM_ERROR_ROBOT; }
    if (!is_finite_state_real(&from) || !is_finite_real(ground)
        || !(from.x1 >= lower_stop_real(robot) && from.x1 <= upper_stop_real(robot))) {
        return HOPFORM_ERROR_STATE;
    }
    if (!(horizon > 0.0 && horizon <= HOPFORM_NEVER_real) || max_phases < 1 || capacity < 0) {
        return HOPFORM_ERROR_HORIZON;
    }
    if (!gains_are_sound_real(&law)) { return HOPFORM_ERROR_GAINS; }
    const real time = HOPFORM_FLIGHT_HAS_DECAY ? leg_time_real(robot) : 0.0;
    flight_chain_real chain; /* what is not set here is set by its first phase */
    chain.robot = robot;
    chain.largest = largest_force_real(robot);
    chain.gains = nothing.gains;
    if (chain.largest > 0.0) { chain.gains = gains != NULL ? law : gains_for_real(robot, &from); }
    chain.rates = flight_rates_of_real(robot, &chain.gains, chain.largest);
    chain.horizon = horizon;
    chain.fall = fall_of_real(robot);
    chain.start = from;
    chain.start.y = from.y + ground;
    chain.relaxes = time > HOPFORM_FASTEST_CONTACT_real ? 1.0 / time : 0.0;
    chain.leg = time > HOPFORM_FASTEST_CONTACT_real ? from.y : 0.0;
    const hopform_flight_phase_real now = {0.0, from.x1, from.v1, 0.0, 0, 0, 0, 0};
    chain.now = now;
    chain.airborne = false;
    chain.highest = -HOPFORM_NEVER_real;
    chain.at_highest = nothing;
    chain.max_phases = max_phases;
    chain.capacity = capacity;
    chain.phases = phases;
    chain.flight = flight;
    flight->ending = run_flight_real(&chain);
    flight->start = from;
    flight->ground = ground;
    flight->designed = gains == NULL && chain.largest > 0.0 ? 1 : 0;
    if (!report_flight_real(&chain, flight)) {
        *flight = nothing;
        return HOPFORM_ERROR_NUMBERS;
    }
    return flight->phases_kept < flight->phase_count ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK;
}

/* ---- a solved flight over time ---- */

/* Status of a call that reads a solved flight, at times, into arrays: HOPFORM_OK if it can; else the arrays are zeros,
 * but for those that lie in an input. */
static int32_t flight_reading_status_real(const hopform_plan_real *plan, const hopform_flight_phase_real *phases,
                                          const hopform_flight_real *flight, const real *times, int32_t count,
                                          bool in_order, const memory_real *arrays, int array_count) {
    bool given = plan != NULL && phases != NULL && flight != NULL && (times != NULL || count <= 0);
    for (int n = 0; n < array_count; n++) {
        given = given && (arrays[n].first != NULL || count <= 0);
    }
    const memory_real read[4] = {
        array_real(plan, 1, sizeof *plan),
        array_real(phases, flight != NULL ? flight->phases_kept : 1, sizeof *phases),
        array_real(flight, 1, sizeof *flight),
        array_real(times, count, sizeof *times),
    };
    int32_t status = HOPFORM_OK;
    if (!given) {
        status = HOPFORM_ERROR_NULL;
    } else if (!HOPFORM_HAS_CONTACT || !is_made_real(plan)) {
        status = HOPFORM_ERROR_ROBOT;
    } else if (flight->phases_kept < flight->phase_count || flight->phases_kept < 1) {
        status = HOPFORM_ERROR_TIME;
    } else if (overlap_real(arrays, array_count, read, 4)) {
        status = HOPFORM_ERROR_OVERLAP;
    }
    for (int32_t n = 0; status >= 0 && n < count; n++) {
        const bool sound = times[n] >= (in_order && n > 0 ? times[n - 1] : 0.0) && times[n] <= flight->duration;
        status = sound ? status : HOPFORM_ERROR_TIME;
    }
    return status < 0 ? refuse_real(status, arrays, array_count, read, 4) : status;
}

/* The state at a time of a phase of a solved flight. */
static hopform_state_real state_of_flight_real(const hopform_plan_real *plan, const flight_rates_real *rates,
                                               const hopform_flight_real *flight,
                                               const hopform_flight_phase_real *phase, real t) {
    hopform_state_real start = flight->start;
    const hopform_poles_real poles = poles_in_flight_real(rates, phase->limit);
    const alone_pair_real pair = alone_pair_of_real(&poles);
    const alone_real from = start_in_flight_real(&poles, phase);
    const alone_real at = moved_in_flight_real(&pair, &from, t - phase->t);
    start.y += flight->ground;
    return state_in_flight_real(&plan->robot, &start, phase, &at);
}

static flight_rates_real rates_of_flight_real(const hopform_plan_real *plan, const hopform_flight_real *flight) {
    return flight_rates_of_real(&plan->robot, &flight->gains, largest_force_real(&plan->robot));
}

/* States at `count` times of a solved flight, 0 <= t <= duration. */
int32_t hopform_flight_at_real(const hopform_plan_real *plan, const hopform_flight_phase_real *phases,
                               const hopform_flight_real *flight, const real *times, int32_t count,
                               hopform_state_real *states) {
    const memory_real array = array_real(states, count, sizeof *states);
    const int32_t status = flight_reading_status_real(plan, phases, flight, times, count, false, &array, 1);
    if (!HOPFORM_HAS_CONTACT || status < 0) { return status; }
    const flight_rates_real rates = rates_of_flight_real(plan, flight);
    for (int32_t i = 0; i < count; i++) {
        int32_t n = flight->phases_kept - 1;
        while (n > 0 && phases[n].t > times[i]) {
            n--;
        }
        states[i] = state_of_flight_real(plan, &rates, flight, &phases[n], times[i]);
    }
    return HOPFORM_OK;
}

/* ---- energy ---- */

/* Integral of the square of the velocity over the first t of a phase: z = (v, a) has I(2h) = I(h) + Phi(h) I(h)
 * Phi(h)^T, as in the stance's ledger, from a short time by Gauss's rule. */
static real square_of_velocity_real(const alone_pair_real *pair, const alone_real *start, real t) {
    const hopform_poles_real *poles = pair->poles;
    real h = t;
    int doublings = halve_real(poles, &h);
    real squares[] = {0.0, 0.0, 0.0}; /* of v v, v a, a a */
    for (int node = 0; node < HOPFORM_NODES_real; node++) {
        const alone_real at = moved_in_flight_real(pair, start, place_real[node] * h);
        const real numerators[] = {at.v, alone_acceleration_real(pair, &at)};
        for (int n = 0; n < 3; n++) {
            squares[n] += weight_real[node] * h * numerators[n / 2] * numerators[(n + 1) / 2];
        }
    }
    for (; doublings > 0 && fabs_real(start->v) + fabs_real(start->draw) > 0.0; doublings--) {
        const known_pair_real by = response_over_real(pair, h);
        const real of_v[] = {by.Rd + pair->p * by.R, -pair->q * by.R};
        const real of_a[] = {by.R, by.Rd};
        const real before[] = {squares[0], squares[1], squares[2]};
        for (int n = 0; n < 3; n++) {
            const int i = n / 2;
            const int j = (n + 1) / 2;
            squares[n] += of_v[i] * of_v[j] * before[0] + (of_v[i] * of_a[j] + of_a[i] * of_v[j]) * before[1]
                          + of_a[i] * of_a[j] * before[2];
        }
        h *= 2.0;
    }
    return squares[0];
}

/* Add the work of the first t of a phase to a ledger. */
static void add_work_real(hopform_flight_ledger_real *ledger, const hopform_plan_real *plan,
                          const flight_rates_real *rates, const hopform_flight_real *flight,
                          const hopform_flight_phase_real *phase, real t) {
    const hopform_robot_real *robot = &plan->robot;
    const hopform_poles_real poles = poles_in_flight_real(rates, phase->limit);
    const alone_pair_real pair = alone_pair_of_real(&poles);
    const alone_real start = start_in_flight_real(&poles, phase);
    const alone_real at = moved_in_flight_real(&pair, &start, t);
    const real rise = (flight->start.v2 - fall_of_real(robot) * (phase->t + 0.5 * t)) * t;
    const flight_integrals_real integrals = {(real)phase->side * at.s, square_of_velocity_real(&pair, &start, t), rise};
    const hopform_flight_ledger_real part = flight_ledger_of_real(
        robot, &flight->gains, largest_force_real(robot), phase->x1, (real)phase->side, (real)phase->limit, &integrals);
    (void)ledger; /* of a model in which nothing does work */
    (void)part;
#define ADD_ENTRY(name, domain) ledger->name += part.name;
    HOPFORM_FLIGHT_LEDGER_MEMBERS(ADD_ENTRY)
#undef ADD_ENTRY
}

/* Energies and ledgers from take-off to each of `count` times, which must not decrease. */
int32_t hopform_flight_energy_real(const hopform_plan_real *plan, const hopform_flight_phase_real *phases,
                                   const hopform_flight_real *flight, const real *times, int32_t count,
                                   hopform_energy_real *energies, hopform_flight_ledger_real *ledgers,
                                   real *stop_losses) {
    const memory_real arrays[3] = {
        array_real(energies, count, sizeof *energies),
        array_real(ledgers, count, sizeof *ledgers),
        array_real(stop_losses, count, sizeof *stop_losses),
    };
    const int32_t status = flight_reading_status_real(plan, phases, flight, times, count, true, arrays, 3);
    if (!HOPFORM_HAS_CONTACT || status < 0) { return status; }
    const flight_rates_real rates = rates_of_flight_real(plan, flight);
    hopform_flight_ledger_real sum = {0};
    real loss = flight->start_loss;
    int32_t n = 0;
    for (int32_t i = 0; i < count; i++) {
        for (; n < flight->phases_kept - 1 && phases[n + 1].t <= times[i]; n++) {
            const real until = phases[n + 1].t;
            add_work_real(&sum, plan, &rates, flight, &phases[n], until - phases[n].t);
            if (phases[n + 1].event == HOPFORM_EVENT_HITS_STOP) {
                const hopform_state_real met = state_of_flight_real(plan, &rates, flight, &phases[n], until);
                loss += loss_at_stop_real(&plan->robot, &met);
            }
        }
        ledgers[i] = sum;
        add_work_real(&ledgers[i], plan, &rates, flight, &phases[n], times[i] - phases[n].t);
        stop_losses[i] = loss;
        const hopform_state_real state = state_of_flight_real(plan, &rates, flight, &phases[n], times[i]);
        energies[i] = flight_energies_real(&plan->robot, state.v1, state.v2, state.x1 - state.y);
    }
    return HOPFORM_OK;
}

#endif
