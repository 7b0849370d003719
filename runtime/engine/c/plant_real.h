/* SPDX-License-Identifier: MIT-0
 *
 * A plant: a motion that continues from tick to tick. A tick is a chain of phases as a stance is, begun where the one
 * before has ended, in its mode; so ticks are the motion of the whole with a step of the input at each.
 */
#ifndef HOPFORM_PLANT_H_real
#define HOPFORM_PLANT_H_real

#include "stance_real.h"
#include "start_real.h"

#define HOPFORM_LONGEST_TICK_real 4294967040.0 /* whole seconds are counted in 32 bits */

/* Add a time to that of a plant: whole seconds apart, the rest with what its rounding leaves (Knuth's sum of two
 * numbers with its error). */
static void pass_time_real(hopform_plant_real *plant, real t) {
    const uint32_t whole = (uint32_t)t;
    const real rest = t - (real)whole;
    const real sum = plant->fraction + rest;
    const real part = sum - plant->fraction;
    const real error = (plant->fraction - (sum - part)) + (rest - part);
    const real carry = plant->carry + error;
    const real total = sum + carry;
    const bool full = total >= 1.0;
    plant->carry = carry - (total - sum);
    plant->fraction = full ? total - 1.0 : total;
    plant->seconds += whole + (full ? 1u : 0u);
}

/* Whether what a plant has kept can be continued, whatever the memory held. */
static bool is_sound_plant_real(const hopform_plant_real *plant) {
    if (plant->mode < 0 || plant->mode > 8 || !is_sound_state_real(&plant->state)) { return false; }
    bool sound = plant->from_lower >= -HOPFORM_NEVER_real && plant->from_upper <= HOPFORM_NEVER_real;
    sound = sound && is_finite_real(plant->largest_y) && is_finite_real(plant->rounding);
    sound = sound && plant->fraction >= -1.0 && plant->fraction <= 1.0 && is_finite_real(plant->carry);
    return sound && number_of_mode_real(mode_of_number_real(plant->mode)) == plant->mode;
}

/* Status of a tick: whether it can be made, else why not. */
static int32_t tick_status_real(const hopform_plant_real *plant, real u, real dt, const hopform_phase_real *phases,
                                int32_t capacity) {
    if (phases == NULL && capacity > 0) { return HOPFORM_ERROR_NULL; }
    if (!is_made_real(&plant->plan)) { return HOPFORM_ERROR_ROBOT; }
    const int32_t status = plant->begins != 0 ? state_status_real(&plant->plan.robot, &plant->state) : HOPFORM_OK;
    if (status < 0 || !is_sound_plant_real(plant)) { return status < 0 ? status : HOPFORM_ERROR_STATE; }
    if (!is_finite_real(u)) { return HOPFORM_ERROR_STEPS; }
    const bool lasts = dt > 0.0 && dt < HOPFORM_LONGEST_TICK_real;
    const bool counts = lasts && (uint32_t)dt < UINT32_MAX - plant->seconds;
    return counts && capacity >= 0 ? HOPFORM_OK : HOPFORM_ERROR_HORIZON;
}

/* Continue a chain in the mode of the plant; the ending if it is there at once, 0 if not. */
static int32_t resume_real(stance_chain_real *chain, const hopform_plant_real *plant) {
    chain->mode = mode_of_number_real(plant->mode);
    chain->from_lower = plant->from_lower;
    chain->from_upper = plant->from_upper;
    chain->most_stretched = plant->largest_y;
    chain->rounded_at_stop = plant->rounding;
    take_step_real(chain);
    return ending_before_phase_real(chain);
}

/* Put a plant to where a chain has ended; rounding does not leave it beyond a stop, from where no flight is taken. */
static void keep_chain_real(hopform_plant_real *plant, const stance_chain_real *chain, bool begins) {
    const hopform_robot_real *robot = &chain->plan->robot;
    state_by_axis_real at = chain->at;
    at.of[HOPFORM_POSITION_AXIS] =
        lesser_real(greater_real(at.of[HOPFORM_POSITION_AXIS], lower_stop_real(robot)), upper_stop_real(robot));
    plant->state = at.named;
    plant->from_lower = chain->from_lower;
    plant->from_upper = chain->from_upper;
    plant->largest_y = chain->most_stretched;
    plant->rounding = chain->rounded_at_stop;
    plant->mode = (int8_t)number_of_mode_real(chain->mode);
    plant->begins = begins ? 1 : 0;
}

/* Put a plant to a state that can be started from. */
static void begin_at_real(hopform_plant_real *plant, const hopform_state_real *state) {
    plant->state = *state;
    plant->from_lower = 0.0; /* these follow from the state when its tick begins */
    plant->from_upper = 0.0;
    plant->largest_y = 0.0;
    plant->rounding = 0.0;
    plant->mode = 4;
    plant->begins = 1;
}

/* Put a plant to a start at time 0, with the plan of a robot. Statuses are those of hopform_plan_init and of
 * hopform_state_of_start; a refusal zeroes the plant, and no tick takes it. robot and start may lie in it. */
int32_t hopform_plant_begin_real(hopform_plant_real *plant, const hopform_robot_real *robot,
                                 const hopform_start_real *start) {
    static const hopform_start_real at_zero = {0};
    if (plant == NULL) { return HOPFORM_ERROR_NULL; }
    const memory_real written = array_real(plant, 1, sizeof *plant);
    const hopform_start_real own = start != NULL ? *start : at_zero;
    hopform_state_real state = {0.0, 0.0, 0.0, 0.0};
    const int32_t planned = hopform_plan_init_real(&plant->plan, robot);
    int32_t status = start != NULL ? planned : HOPFORM_ERROR_NULL;
    if (status >= 0) {
        const int32_t placed = hopform_state_of_start_real(&plant->plan, &own, &state);
        status = placed < 0 ? placed : status;
    }
    if (status < 0) { return refuse_real(status, &written, 1, NULL, 0); }
    begin_at_real(plant, &state);
    plant->fraction = 0.0;
    plant->carry = 0.0;
    plant->seconds = 0;
    return status;
}

/* Put a plant to another start, at the time that it has: behind an impact, or as an observer corrects it. A start that
 * is refused leaves it as it is. start may lie in it. */
int32_t hopform_plant_place_real(hopform_plant_real *plant, const hopform_start_real *start) {
    hopform_state_real state;
    if (plant == NULL) { return HOPFORM_ERROR_NULL; }
    const int32_t status = hopform_state_of_start_real(&plant->plan, start, &state);
    if (status >= 0) { begin_at_real(plant, &state); }
    return status;
}

/* A tick that ends after so many phases at the latest, behind the event that ends the last of them. */
static int32_t tick_real(hopform_plant_real *plant, real u, real dt, int32_t max_phases, hopform_report_real *report) {
    static const hopform_start_real nowhere = {0};
    if (report == NULL) { return HOPFORM_ERROR_NULL; }
    hopform_phase_real *phases = report->phases;
    const int32_t capacity = report->capacity;
    const memory_real read = array_real(plant, 1, sizeof *plant);
    const memory_real written[2] = {
        array_real(report, 1, sizeof *report),
        array_real(phases, capacity, sizeof *phases),
    };
    if (overlap_real(written, 1, &read, 1)) { return HOPFORM_ERROR_OVERLAP; }
    report->count = 0;
    report->event_count = 0;
    report->ending = 0;
    report->duration = 0.0;
    report->start = nowhere;
    if (plant == NULL) { return HOPFORM_ERROR_NULL; }
    if (overlap_real(written + 1, 1, &read, 1)) { return HOPFORM_ERROR_OVERLAP; }
    const int32_t status = tick_status_real(plant, u, dt, phases, capacity);
    if (status < 0) { return status; }
    const hopform_step_real step = {0.0, u};
    evaluations_real evaluations = {UNBOUNDED_real};
    stance_chain_real chain;
    stance_start_real(&chain, &plant->plan, &plant->state, &step, 1, dt, max_phases, phases, capacity, &evaluations);
#if HOPFORM_HAS_CONTACT
    chain.adds_up = false; /* nobody asks for the AED */
#endif
    const int32_t begun = plant->begins != 0 ? stance_begin_real(&chain) : resume_real(&chain, plant);
    const int32_t ending = stance_run_real(&chain, begun);
    if (!is_finite_state_real(&chain.at.named) || !is_finite_real(chain.t)) { return HOPFORM_ERROR_NUMBERS; }
    const bool over = ending == HOPFORM_ENDING_HORIZON || ending == HOPFORM_ENDING_REST;
#if HOPFORM_HAS_CONTACT
    keep_chain_real(plant, &chain, ending == HOPFORM_ENDING_TAKEOFF);
#else
    keep_chain_real(plant, &chain, false);
#endif
    report->count = chain.count;
    report->event_count = chain.event_count;
    report->ending = ending;
    report->duration = over ? dt : chain.t;
    report->start = start_of_state_real(&plant->plan.robot, &plant->state);
    pass_time_real(plant, report->duration);
    return chain.count > capacity ? HOPFORM_PHASES_NOT_KEPT : HOPFORM_OK;
}

/* Continue for a tick of dt [s] under the input u, of a law its target. The report has a record for each phase, as a
 * stance has, and the coordinates behind the tick. Ticks of any lengths make the motion of hopform_solve_stance with a
 * step of u at each: it ends with HOPFORM_ENDING_HORIZON, or _REST where nothing moves until u changes. More than
 * HOPFORM_TICK_PHASES phases end it before, at `duration`, and so does a search that meets its bound; the next tick
 * continues from there. A refusal leaves the plant as it is. Neither report nor its phases may overlap the plant.
#if HOPFORM_HAS_CONTACT
 * A take-off ends it, too: then hopform_solve_flight continues from the plant's state, and hopform_plant_place from the
 * touchdown.
#endif
 */
int32_t hopform_plant_step_real(hopform_plant_real *plant, real u, real dt, hopform_report_real *report) {
    return tick_real(plant, u, dt, HOPFORM_TICK_PHASES, report);
}

#endif
