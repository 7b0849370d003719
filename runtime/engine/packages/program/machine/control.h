/* What decides on the input at each tick. SPDX-License-Identifier: MIT-0 */
#ifndef MACHINE_CONTROL_H
#define MACHINE_CONTROL_H

#include "hopform/hopform.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CONTROL_TICKS 4000 /* of a millisecond, which the program runs */

/* Takes the reading of a tick, sets the input, and prints what came of it. */
void control(int32_t tick, const hopform_start_f32 *now);

/* A number in millionths, for hardware_print, as far as a whole number reaches. */
static inline int32_t millionths(float value) {
    const float many = 1e6f * value;
    return many > 2e9f ? 2000000000 : (many > -2e9f ? (int32_t)many : -2000000000);
}

#ifdef __cplusplus
}
#endif

#endif
