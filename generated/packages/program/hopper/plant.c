/* A simulated robot in place of hardware: it knows nothing of the closed form, but integrates the equations of motion
 * of the model in steps of 20 us. It is dropped from H_DES and prints the height of each hop.
 * SPDX-License-Identifier: MIT-0 */
#include "hardware.h"
#include "robot.h"

#include <math.h>

enum { HOPS = 10, STEPS = 50, LONGEST = 20000 };

static const float STEP = 0.001f / (float)STEPS; /* [s] */

static float position_1, velocity_1, position_2, velocity_2, u, apex;
static float left; /* [m] compression of the leg, which it keeps in flight where a damper lets go slowly */
static bool stance;
static int32_t hops, ticks;

static float sign_of(float value) {
    return value > 0.0f ? 1.0f : (value < 0.0f ? -1.0f : 0.0f);
}

/* A velocity after a step, under a free acceleration and Coulomb friction, which stops a mass, never pulls it back. At
 * rest it holds the mass up to `up` and `down`. */
static float velocity_after(float v, float acceleration, float friction, float up, float down) {
    if (v > 0.0f || v < 0.0f) {
        const float next = v + STEP * (acceleration - friction * sign_of(v));
        return next * v < 0.0f ? 0.0f : next;
    }
    return acceleration > up || acceleration < -down ? STEP * (acceleration - friction * sign_of(acceleration)) : 0.0f;
}

static float compression(void) {
    return position_1 - position_2 + robot.L0 + robot.c;
}

/* The contact force over the leg's stiffness: the foot takes off where it falls to 0. */
static float contact(void) {
    return compression();
}

static void move(void) {
    const float acceleration_1 = stance
        ? robot.c*robot.k/robot.m_eff - compression()*robot.k/robot.m_eff - robot.b1*velocity_1/robot.m_eff - robot.gamma2*u/robot.m_eff
        : robot.c*robot.k/robot.m_eff - robot.b1*velocity_1/robot.m_eff - robot.gamma2*u/robot.m_eff;
    const float acceleration_2 = stance
        ? compression()*robot.k/robot.m_s - robot.g - robot.b2*velocity_2/robot.m_s
        : -robot.g;
    const float before_1 = velocity_1, before_2 = velocity_2, leg_time = 0.0f;
    velocity_1 = velocity_after(velocity_1, acceleration_1, robot.f1, robot.f1 + robot.f1_excess, robot.f1 + robot.f1_excess);
    velocity_2 = stance
        ? velocity_after(velocity_2, acceleration_2, robot.f2, robot.f2 + robot.f2_excess, robot.f2 + robot.f2_excess)
        : velocity_after(velocity_2, acceleration_2, 0.0f, 0.0f, 0.0f);
    position_1 += 0.5f * STEP * (before_1 + velocity_1);
    position_2 += 0.5f * STEP * (before_2 + velocity_2);
    const float lowest = robot.x1_min, highest = robot.x1_max;
    if (position_1 < lowest || position_1 > highest) {
        position_1 = position_1 < lowest ? lowest : highest;
        velocity_1 = 0.0f;
    }
    left = stance ? compression() : (leg_time > 0.0f ? left * expf(-STEP / leg_time) : 0.0f);
}

static void meet_ground(void) {
    if (!stance && compression() >= left && velocity_2 < velocity_1) {
        hops++;
        hardware_print("apex [0.1 mm]: ", (int32_t)(1e4f * apex + 0.5f));
        stance = true;
        velocity_2 *= sqrtf(1.0f - robot.impact_loss);
    } else if (stance && contact() <= 0.0f && velocity_2 > velocity_1) {
        stance = false;
        apex = 0.0f;
    }
}

bool hardware_tick(hardware_reading *reading) {
    if (ticks++ == 0) { position_2 = robot.L0 + robot.c + H_DES; }
    for (int32_t n = 0; n < STEPS; n++) {
        move();
        meet_ground();
        const float height = position_2 - (robot.L0 + robot.c);
        apex = height > apex ? height : apex;
    }
    reading->contact = stance ? contact() : 0.0f;
    const hopform_state_f32 now = {position_1, velocity_1, velocity_2, compression()};
    reading->state = now;
    return hops < HOPS && ticks < LONGEST;
}

void hardware_current(float current) {
    u = current;
}
