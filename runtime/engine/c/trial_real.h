/* SPDX-License-Identifier: MIT-0
 *
 * One current, tried: the apex that follows, the largest x_1, by how little the upper stop is hit, the least spring
 * that the leg comes near to taking off with, and how each of them changes with the current, through the events.
 *
 * A phase is linear, so its change d_z with u obeys the equations of motion without friction, weight and offset, under
 * the acceleration that 1 A gives. An event adds (z' before it - z' after it) d_tau, as in sensitivity_real.c. Extrema
 * of x_1 and of y move to first order as if their time stood still; where y' jumps, at a stop, the time counts.
 */
#ifndef HOPFORM_TRIAL_H_real
#define HOPFORM_TRIAL_H_real

#include "phase_real.h"

/* What is gathered along the phases of a stance. */
typedef struct {
    const hopform_plan_real *plan;
    hopform_state_real change; /* of x_1, v_1, v_2, y at a fixed time, per A */
    real met_y;                /* change of y at the last event, whose time moves */
    hopform_trial_real *trial;
} hopform_tally_real;

/* x_1, v_1, v_2, y per time in a mode, at a state. */
static inline hopform_state_real hopform_speeds_real(const hopform_plan_real *plan, const hopform_state_real *state,
                                                     real u, int side_1, int side_2)
{
    const hopform_motion_real motion = hopform_motion_of_real(plan, state, u, side_1, side_2);
    const hopform_state_real speed = {state->v1, motion.H3_1, motion.H3_2, motion.H3_y};
    return speed;
}

/* A maximum of x_1: where the actuator starts, reverses, sticks, stops or lifts off. */
static inline void hopform_note_peak_real(hopform_tally_real *tally, real x1, real change)
{
    if (x1 > tally->trial->peak) {
        tally->trial->peak = x1;
        tally->trial->peak_u = change;
    }
}

/* The upper stop is hit: how far x_1 is from staying off it. It does where its velocity there vanishes, or where the
 * leg takes off before, y there being zero: the lesser of y and of the height from which a mass falls as fast; smooth,
 * as x_1 at rest is. */
static inline void hopform_note_hit_real(hopform_tally_real *tally, const hopform_state_real *met, real met_v1)
{
    const real g = tally->plan->robot.g;
    const real height = 0.5 * met->v1 * met->v1 / g;
    if (height < met->y) {
        hopform_note_peak_real(tally, met->x1 + height, met->v1 * met_v1 / g);
    } else {
        hopform_note_peak_real(tally, met->x1 + met->y, tally->met_y);
    }
}

/* A minimum of y before the ending, where the leg would have taken off with a little less of it. */
static inline void hopform_note_dip_real(hopform_tally_real *tally, real y, real change)
{
    if (y < tally->trial->dip) {
        tally->trial->dip = y;
        tally->trial->dip_u = change;
    }
    if (tally->trial->dips < INT16_MAX) {
        tally->trial->dips++;
    }
}

/* A phase that is followed, with the motion of its change. */
typedef struct {
    const hopform_poles_real *poles;
    hopform_state_real start;
    hopform_motion_real motion;
    hopform_motion_real by_u;
    int side_1;
    int side_2;
} hopform_stretch_real;

static inline real hopform_rate_of_y_real(const hopform_stretch_real *stretch, real t)
{
    const hopform_basis_real basis = hopform_basis_at_real(stretch->poles, t);
    const hopform_state_real at =
        hopform_arrive_real(&stretch->start, &stretch->motion, &basis, stretch->side_1, stretch->side_2);
    return at.v1 - at.v2;
}

/* The minimum of y between two times, at the first of which y falls and at the second rises: a root of y', few digits
 * of it. */
static inline void hopform_find_dip_real(hopform_tally_real *tally, const hopform_stretch_real *stretch, real low,
                                         real falls, real high, real rises)
{
    const real small = 1e-4 * (rises - falls);
    real t = low;
    for (int n = 0; n < 12; n++) {
        t = n % 3 == 2 ? low + 0.5 * (high - low) : low + (high - low) * (falls / (falls - rises));
        const real rate = hopform_rate_of_y_real(stretch, t);
        if (fabs_real(rate) <= small) {
            break;
        }
        if (rate < 0.0) {
            low = t;
            falls = rate;
        } else {
            high = t;
            rises = rate;
        }
    }
    const hopform_basis_real basis = hopform_basis_at_real(stretch->poles, t);
    const hopform_state_real at =
        hopform_arrive_real(&stretch->start, &stretch->motion, &basis, stretch->side_1, stretch->side_2);
    const hopform_state_real change =
        hopform_arrive_real(&tally->change, &stretch->by_u, &basis, stretch->side_1, stretch->side_2);
    hopform_note_dip_real(tally, at.y, change.y);
}

/* Whether y'' keeps its sign from the start of a phase to its end. (d/dt + a) y'' is a motion of the pair alone, with
 * one zero at most in a half turn: where it has the same sign at both ends, so has exp(a t) y'' no extremum in between.
 */
static inline bool hopform_bends_one_way_real(const hopform_stretch_real *stretch, const hopform_basis_real *end,
                                              real length)
{
    const hopform_poles_real *poles = stretch->poles;
    const hopform_motion_real *motion = &stretch->motion;
    const hopform_numerator_real h = {motion->H3_y, motion->H2_y, motion->H1_y};
    const real bend = h.H2 - h.H3 * poles->s_1;
    const real jerk = h.H1 - h.H2 * poles->s_1 + h.H3 * (poles->s_1 * poles->s_1 - poles->s_2);
    const hopform_rise_real rise = hopform_step_response_real(poles, &h, end);
    const real swings = (poles->q - 0.25 * poles->p * poles->p) * length * length;
    const bool one_way = bend * rise.rise_curvature > 0.0;
    return swings < 9.0 && one_way
           && (jerk + poles->a * bend) * (rise.rise_third + poles->a * rise.rise_curvature) > 0.0;
}

/* The minima of y inside a phase. y' = v_1 - v_2 keeps its sign unless both masses move in the same direction; then it
 * is looked at four times in a half turn of the pair, and between three looks where it comes near zero and goes back.
 */
static inline void hopform_find_dips_real(hopform_tally_real *tally, const hopform_stretch_real *stretch,
                                          const hopform_basis_real *end, real length, real rate, real last_rate)
{
    if (stretch->side_1 == 0 || stretch->side_1 != stretch->side_2) {
        return;
    }
    if (!(rate < 0.0 && last_rate >= 0.0) && hopform_bends_one_way_real(stretch, end, length)) {
        return;
    }
    const real looks = 1.0 + 1.3 * sqrt_real(stretch->poles->q) * length;
    const int count = looks > 0.0 && looks < 64.0 ? (int)looks + 2 : 64;
    const real apart = length / (real)count;
    real before = rate;
    for (int n = 1; n <= count; n++) {
        const real t = apart * (real)n;
        const real now = n < count ? hopform_rate_of_y_real(stretch, t) : last_rate;
        if (rate < 0.0 && now >= 0.0) {
            hopform_find_dip_real(tally, stretch, t - apart, rate, t, now);
        } else if (n > 1 && rate < 0.0 && rate > before && rate > now) {
            const real shift = 0.5 * (now - before) / (2.0 * rate - before - now);
            const real top = t - apart + apart * shift;
            const real at_top = hopform_rate_of_y_real(stretch, top);
            if (at_top > 0.0) {
                hopform_find_dip_real(tally, stretch, t - 2.0 * apart, before, top, at_top);
            }
        }
        before = rate;
        rate = now;
    }
}

/* The change per A at the end of a phase, and the rate of y there. */
static inline real hopform_follow_real(hopform_tally_real *tally, const hopform_phase_real *phase, real u, real length)
{
    const int side_1 = hopform_side_1_real(phase);
    const int side_2 = hopform_side_2_real(phase);
    const hopform_state_real start = {phase->x1, phase->v1, phase->v2, phase->y};
    const hopform_drive_real per_ampere = {tally->plan->rates.a1_u, 0.0};
    const hopform_stretch_real stretch = {
        hopform_poles_of_real(tally->plan, side_1, side_2),
        start,
        hopform_motion_of_real(tally->plan, &start, u, side_1, side_2),
        hopform_motion_under_real(&tally->plan->rates, &per_ampere, &tally->change, side_1, side_2),
        side_1,
        side_2,
    };
    const hopform_basis_real basis = hopform_basis_at_real(stretch.poles, length);
    const hopform_state_real end = hopform_arrive_real(&start, &stretch.motion, &basis, side_1, side_2);
    const real rate = end.v1 - end.v2;
    hopform_find_dips_real(tally, &stretch, &basis, length, start.v1 - start.v2, rate);
    tally->change = hopform_arrive_real(&tally->change, &stretch.by_u, &basis, side_1, side_2);
    return rate;
}

/* Whether y, which changed by `rises` per time before the event between two phases, falls no more after it. Where both
 * masses stand still at the event, what they do before and after tells, and not what rounding leaves of their
 * velocities. */
static inline bool hopform_turns_up_real(const hopform_phase_real *old, const hopform_phase_real *now, real rises)
{
    if (fabs_real(now->v1) > 0.0 || fabs_real(now->v2) > 0.0) {
        return rises < 0.0 && !(now->v1 - now->v2 < 0.0);
    }
    return hopform_side_1_real(old) < hopform_side_2_real(old) && hopform_side_1_real(now) >= hopform_side_2_real(now);
}

/* The change per A right after the event between two phases; false where its time does not move in proportion to u. */
static inline bool hopform_cross_real(hopform_tally_real *tally, const hopform_phase_real *old,
                                      const hopform_phase_real *now, real u, real rises)
{
    hopform_state_real *change = &tally->change;
    hopform_state_real state = {now->x1, now->v1, now->v2, now->y};
    const hopform_state_real after =
        hopform_speeds_real(tally->plan, &state, u, hopform_side_1_real(now), hopform_side_2_real(now));
    const bool stops = now->event == HOPFORM_EVENT_X1_HITS_STOP;
    tally->met_y = change->y;
    const bool rests_1 = now->event == HOPFORM_EVENT_X1_REVERSES || now->event == HOPFORM_EVENT_X1_STICKS;
    const bool rests_2 = now->event == HOPFORM_EVENT_X2_REVERSES || now->event == HOPFORM_EVENT_X2_STICKS;
    if (!stops && !rests_1 && !rests_2) {
        return true;
    }
    if (stops) {
        state.v1 = rises + state.v2; /* y' = v1 - v2 */
    }
    const hopform_state_real before =
        hopform_speeds_real(tally->plan, &state, u, hopform_side_1_real(old), hopform_side_2_real(old));
    const real rate = stops ? before.x1 : (rests_1 ? before.v1 : before.v2);
    const real off = stops ? change->x1 : (rests_1 ? change->v1 : change->v2);
    if (!(fabs_real(rate) > 0.0)) {
        return false;
    }
    const real late = -off / rate;
    tally->met_y += before.y * late;
    if (stops && rate > 0.0) {
        hopform_note_hit_real(tally, &state, change->v1 + before.v1 * late);
    }
    if (stops) { /* the only event at which more jumps than the acceleration of the mass that comes to rest */
        change->x1 = 0.0;
        change->v1 = -after.v1 * late;
        change->v2 += (before.v2 - after.v2) * late;
        change->y += (before.y - after.y) * late;
    } else if (rests_1) {
        change->v1 = -after.v1 * late;
    } else {
        change->v2 = -after.v2 * late;
    }
    return true;
}

/* The apex' change per A from that at take-off, whose time moves; false where the leg does not extend. */
static inline bool hopform_lift_real(hopform_tally_real *tally, const hopform_phase_real *last, real u,
                                     const hopform_state_real *end)
{
    const hopform_robot_real *robot = &tally->plan->robot;
    const hopform_state_real speed =
        hopform_speeds_real(tally->plan, end, u, hopform_side_1_real(last), hopform_side_2_real(last));
    if (!(fabs_real(speed.y) > 0.0)) {
        return false;
    }
    const real late = -tally->change.y / speed.y;
    const real x1_u = tally->change.x1 + speed.x1 * late;
    const real v2_u = tally->change.v2 + speed.v2 * late;
    const real v_up = hopform_greater_real(end->v2, 0.0);
    tally->trial->apex_u = x1_u + v_up * v2_u / robot->g;
    hopform_note_peak_real(tally, end->x1, x1_u);
    return true;
}

/* The order of modes and events as a number, which differs where they do. */
static inline uint32_t hopform_fingerprint_real(const hopform_phase_real *phases, int32_t count)
{
    uint32_t mark = 2166136261u;
    for (int32_t n = 0; n < count; n++) {
        mark = (mark ^ (uint32_t)(phases[n].mode + 16 * phases[n].event)) * 16777619u;
    }
    return mark;
}

/* What a solved stance says of its current u. All its phases are at hand. */
static inline hopform_trial_real hopform_trial_of_real(const hopform_plan_real *plan, real u,
                                                       const hopform_phase_real *phases,
                                                       const hopform_stance_real *stance)
{
    hopform_trial_real trial = {0};
    hopform_tally_real tally = {plan, {0.0, 0.0, 0.0, 0.0}, 0.0, &trial};
    trial.u = u;
    trial.peak = phases[0].x1;
    trial.dip = HOPFORM_NEVER_real;
    trial.held = true;
    trial.smooth = true;
    trial.takes_off = stance->ending == HOPFORM_ENDING_TAKEOFF;
    trial.events = hopform_fingerprint_real(phases, stance->phases_kept);
    real rises = 0.0;
    const hopform_phase_real *phase = phases;
    for (int32_t n = 0; n < stance->phases_kept; n++) {
        phase = &phases[n];
        const bool last = n + 1 == stance->phases_kept;
        trial.held = trial.held && hopform_side_1_real(phase) == 0;
        if (n > 0) {
            trial.smooth = hopform_cross_real(&tally, &phases[n - 1], phase, u, rises) && trial.smooth;
            hopform_note_peak_real(&tally, phase->x1, tally.change.x1);
            if (hopform_turns_up_real(&phases[n - 1], phase, rises)) {
                hopform_note_dip_real(&tally, phase->y, tally.met_y);
            }
        }
        rises = hopform_follow_real(&tally, phase, u, (last ? stance->duration : phases[n + 1].t) - phase->t);
    }
    if (trial.takes_off) {
        trial.apex = stance->apex;
        trial.smooth = hopform_lift_real(&tally, phase, u, &stance->end) && trial.smooth;
    } else {
        hopform_note_peak_real(&tally, stance->end.x1, tally.change.x1);
    }
    return trial;
}

#endif
