/* A simulated robot in place of hardware: it knows nothing of the closed form, but integrates the equations of motion
 * (3), (4) in steps of 20 us. It is dropped from H_DES and prints the height of each hop.
 * SPDX-License-Identifier: MIT-0 */
#include "hardware.h"
#include "robot.h"

#include <math.h>

enum { HOPS = 10, STEPS = 50, LONGEST = 20000 };

static const float STEP = 0.001f / 50.0f; /* [s] */

static float x1, v1, x2, v2, u, apex;
static bool stance;
static int32_t hops, ticks;

static float sign_of(float value) {
    return value > 0.0f ? 1.0f : (value < 0.0f ? -1.0f : 0.0f);
}

/* A velocity after a step, under a free acceleration and Coulomb friction, which stops a mass and never pulls it back.
 */
static float velocity_after(float v, float acceleration, float friction) {
    if (v > 0.0f || v < 0.0f) {
        const float next = v + STEP * (acceleration - friction * sign_of(v));
        return next * v < 0.0f ? 0.0f : next;
    }
    return fabsf(acceleration) > friction ? STEP * (acceleration - friction * sign_of(acceleration)) : 0.0f;
}

static float compression(void) {
    return x1 - x2 + robot.L0 + robot.c;
}

static void move(void) {
    const float force = stance ? robot.k * compression() : 0.0f;
    const float on_1 = robot.k * robot.c - force - robot.b1 * v1 - robot.gamma2 * u;
    const float on_2 = force - (stance ? robot.b2 * v2 : 0.0f);
    const float before_1 = v1, before_2 = v2;
    v1 = velocity_after(v1, on_1 / robot.m_eff, robot.f1);
    v2 = velocity_after(v2, on_2 / robot.m_s - robot.g, stance ? robot.f2 : 0.0f);
    x1 += 0.5f * STEP * (before_1 + v1);
    x2 += 0.5f * STEP * (before_2 + v2);
    if (x1 < robot.x1_min || x1 > robot.x1_max) {
        x1 = x1 < robot.x1_min ? robot.x1_min : robot.x1_max;
        v1 = 0.0f;
    }
}

static void meet_ground(void) {
    if (!stance && compression() >= 0.0f && v2 < v1) {
        hops++;
        hardware_print("apex [0.1 mm]: ", (int32_t)(1e4f * apex + 0.5f));
        stance = true;
        v2 *= sqrtf(1.0f - robot.impact_loss);
    } else if (stance && compression() <= 0.0f && v2 > v1) {
        stance = false;
        apex = 0.0f;
    }
}

bool hardware_tick(hardware_reading *reading) {
    if (ticks++ == 0) { x2 = robot.L0 + robot.c + H_DES; }
    for (int32_t n = 0; n < STEPS; n++) {
        move();
        meet_ground();
        const float height = x2 - robot.L0 - robot.c;
        apex = height > apex ? height : apex;
    }
    reading->contact = stance ? compression() : 0.0f;
    reading->x1 = x1;
    reading->v1 = v1;
    reading->x2 = x2;
    reading->v2 = v2;
    return hops < HOPS && ticks < LONGEST;
}

void hardware_current(float current) {
    u = current;
}
