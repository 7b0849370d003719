/* SPDX-License-Identifier: MIT-0
 *
 * Whether a solved stance can be read into some arrays.
 */
#ifndef HOPFORM_READING_H_real
#define HOPFORM_READING_H_real

#include "chosen_real.h"
#include "overlap_real.h"
#include "phase_real.h"

/* Times at which a stance is read, which do not decrease if they are in order. */
typedef struct {
    const real *at;
    int32_t count;
    bool in_order;
} times_real;

/* Whether a stance has each of the times; at rest it goes on for ever. */
static bool times_are_sound_real(const times_real *times, const hopform_stance_real *stance) {
    const real latest = stance->ending == HOPFORM_ENDING_REST ? HOPFORM_NEVER_real : stance->duration;
    real earliest = 0.0;
    bool sound = true;
    for (int32_t n = 0; n < times->count; n++) {
        sound = sound && times->at[n] >= earliest && times->at[n] <= latest;
        earliest = times->in_order ? times->at[n] : 0.0;
    }
    return sound;
}

/* Status of a call that reads a solved stance, at times and in columns unless these are NULL, into arrays: HOPFORM_OK
 * if it can; else the arrays are zeros, but for those that lie in an input. */
static int32_t reading_status_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                   const hopform_phase_real *phases, const hopform_stance_real *stance,
                                   const times_real *times, const chosen_real *columns, const memory_real *arrays,
                                   int array_count) {
    const times_real none = {NULL, 0, false};
    const times_real *when = times != NULL ? times : &none;
    const chosen_real all = {NULL, 0};
    const chosen_real *chosen = columns != NULL ? columns : &all;
    const int32_t kept = stance != NULL ? stance->phases_kept : 1; /* one at least is an input */
    const bool whole = stance != NULL && kept >= 1 && kept >= stance->phase_count;
    bool given = plan != NULL && steps != NULL && phases != NULL && stance != NULL;
    given = given && (times == NULL || times->at != NULL);
    for (int n = 0; n < array_count; n++) {
        given = given && arrays[n].first != NULL;
    }
    const memory_real read[6] = {
        array_real(plan, 1, sizeof *plan),
        array_real(steps, whole && phases != NULL ? phases[kept - 1].step + 1 : 1, sizeof *steps),
        array_real(phases, kept, sizeof *phases),
        array_real(stance, 1, sizeof *stance),
        array_real(when->at, when->count, sizeof *when->at),
        array_real(chosen->codes, chosen->count, sizeof *chosen->codes),
    };
    int32_t status = HOPFORM_OK;
    if (!given) {
        status = HOPFORM_ERROR_NULL;
    } else if (!is_made_real(plan)) {
        status = HOPFORM_ERROR_ROBOT;
    } else if (!whole) {
        status = HOPFORM_ERROR_TIME;
    } else if (overlap_real(arrays, array_count, read, 6)) {
        status = HOPFORM_ERROR_OVERLAP;
    } else if (!times_are_sound_real(when, stance)) {
        status = HOPFORM_ERROR_TIME;
    } else if (!are_of_stance_real(chosen)) {
        status = HOPFORM_ERROR_COLUMNS;
    }
    return status < 0 ? refuse_real(status, arrays, array_count, read, 6) : status;
}

/* The state at a time of a solved stance, which has it. */
static inline hopform_state_real state_of_stance_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                                      const hopform_phase_real *phases,
                                                      const hopform_stance_real *stance, real t) {
    const real within = lesser_real(t, stance->duration);
    const hopform_phase_real *phase = &phases[phase_index_real(phases, stance->phases_kept, within)];
    return state_in_phase_real(plan, phase, input_of_phase_real(plan, steps, phase), within - phase->t);
}

#endif
