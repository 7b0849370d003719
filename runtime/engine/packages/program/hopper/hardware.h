/* What the program asks of a board, three functions: plant.c answers for a simulated robot; write them for yours.
 * SPDX-License-Identifier: MIT-0 */
#ifndef HOPPER_HARDWARE_H
#define HOPPER_HARDWARE_H

#include "hopform/hopform.h"

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What the sensors say at a tick. */
typedef struct {
    float contact;           /* [m] for the detector: contact force of the leg over its stiffness with its noise, which
                              * is the compression where no damper acts in the leg; about 0 in flight */
    hopform_state_f32 state; /* its compression is below 0 in flight: so far is the foot above the ground */
} hardware_reading;

/* Waits for the next tick, a millisecond after the last, and reads the sensors; false ends the program. */
bool hardware_tick(hardware_reading *reading);

/* Sets the current [A] until the next tick. */
void hardware_current(float u);

/* Prints a line: a text and a number. */
void hardware_print(const char *text, int32_t number);

#ifdef __cplusplus
}
#endif

#endif
