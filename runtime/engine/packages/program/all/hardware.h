/* What the program asks of a board, three functions: plant.c answers for a simulated robot; write them for yours.
 * SPDX-License-Identifier: MIT-0 */
#ifndef HOPPER_HARDWARE_H
#define HOPPER_HARDWARE_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What the sensors say at a tick; signs as in hopform/hopform.h. */
typedef struct {
    float
        contact; /* [m] of the sensor that detects the touchdown: compression of the leg, 0 in flight, with its noise */
    float x1;    /* [m] displacement of the actuator */
    float v1;    /* [m/s] velocity of the actuator */
    float x2;    /* [m] height of the body over the ground */
    float v2;    /* [m/s] velocity of the body */
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
