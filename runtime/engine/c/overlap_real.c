/* SPDX-License-Identifier: MIT-0
 *
 * Whether memory that a function writes holds some of what it reads, and whether a solved stance can be read into it.
 */
#include "phase_real.h"

/* Addresses are compared as numbers, because C orders pointers within one object only; the difference wraps around
 * where the other range begins first. */
bool hopform_overlap_real(const hopform_memory_real *written, int written_count, const hopform_memory_real *read,
                          int read_count)
{
    bool overlap = false;
    for (int i = 0; i < written_count; i++) {
        for (int j = 0; j < read_count && written[i].size > 0; j++) {
            const uintptr_t ahead = (uintptr_t)written[i].first - (uintptr_t)read[j].first;
            const uintptr_t behind = (uintptr_t)read[j].first - (uintptr_t)written[i].first;
            overlap = overlap || (read[j].size > 0 && (ahead < read[j].size || behind < written[i].size));
        }
    }
    return overlap;
}

int32_t hopform_refuse_real(int32_t status, const hopform_memory_real *written, int count)
{
    for (int n = 0; n < count; n++) {
        unsigned char *bytes = (unsigned char *)(uintptr_t)written[n].first; /* the caller's, who may write there */
        for (size_t i = 0; bytes != NULL && i < written[n].size; i++) {
            bytes[i] = 0;
        }
    }
    return status;
}

/* Whether a stance has each of the times; at rest it goes on for ever. */
static bool times_are_sound_real(const hopform_times_real *times, const hopform_stance_real *stance)
{
    const real latest = stance->ending == HOPFORM_ENDING_REST ? HOPFORM_NEVER_real : stance->duration;
    real earliest = 0.0;
    bool sound = true;
    for (int32_t n = 0; n < times->count; n++) {
        sound = sound && times->at[n] >= earliest && times->at[n] <= latest;
        earliest = times->in_order ? times->at[n] : 0.0;
    }
    return sound;
}

int32_t hopform_reading_status_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                    const hopform_phase_real *phases, const hopform_stance_real *stance,
                                    const hopform_times_real *times, const hopform_memory_real *arrays, int array_count)
{
    const hopform_times_real none = {NULL, 0, false};
    const hopform_times_real *when = times != NULL ? times : &none;
    bool given = plan != NULL && steps != NULL && phases != NULL && stance != NULL;
    given = given && (times == NULL || times->at != NULL);
    for (int n = 0; n < array_count; n++) {
        given = given && arrays[n].first != NULL;
    }
    int32_t status = HOPFORM_OK;
    if (!given) {
        status = HOPFORM_ERROR_NULL;
    } else if (stance->phases_kept < stance->phase_count || stance->phases_kept < 1 || !hopform_is_made_real(plan)) {
        status = HOPFORM_ERROR_TIME;
    } else {
        const hopform_memory_real read[] = {
            hopform_array_real(plan, 1, sizeof *plan),
            hopform_array_real(steps, phases[stance->phases_kept - 1].step + 1, sizeof *steps),
            hopform_array_real(phases, stance->phases_kept, sizeof *phases),
            hopform_array_real(stance, 1, sizeof *stance),
            hopform_array_real(when->at, when->count, sizeof *when->at),
        };
        if (hopform_overlap_real(arrays, array_count, read, 5)) {
            status = HOPFORM_ERROR_OVERLAP;
        } else if (!times_are_sound_real(when, stance)) {
            status = HOPFORM_ERROR_TIME;
        }
    }
    return status < 0 ? hopform_refuse_real(status, arrays, array_count) : status;
}
