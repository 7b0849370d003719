/* SPDX-License-Identifier: MIT-0
 *
 * How the change of a state by that of an input passes an event, at which an axis is at a value: a velocity at 0, or a
 * position at a stop.
 */
#ifndef HOPFORM_CROSSING_H_real
#define HOPFORM_CROSSING_H_real

#include <stdbool.h>

#include "facts.h"

/* The axis that is at a value when an event comes; -1 where nothing jumps. */
static inline int hopform_axis_of_event_real(int event)
{
    static const signed char axis_of_event[] = HOPFORM_AXIS_OF_EVENT;
    return axis_of_event[event];
}

/* The change of z right after an event of `axis`, in place of that before it. The event comes `late`r, which adds (z'
 * before - z' after) late; the value changes by `wanted`, that of a velocity by 0. A stop takes the velocity at once,
 * and all that it acts on jumps. At rest the acceleration of the element jumps alone. */
static inline void hopform_cross_real(real change[HOPFORM_AXES], const real before[HOPFORM_AXES],
                                      const real after[HOPFORM_AXES], int axis, real wanted, real late)
{
    const bool stops = axis == HOPFORM_POSITION_AXIS;
    const int velocity = stops ? HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT) : axis;
    for (int i = 0; stops && i < HOPFORM_AXES; i++) {
        change[i] += (before[i] - after[i]) * late;
    }
    change[axis] = wanted;
    change[velocity] = 0.0 - after[velocity] * late;
}

#endif
