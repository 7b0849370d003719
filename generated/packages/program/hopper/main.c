/* Makes the robot of robot.h hop: (1) compare the digest, (2) compute one current, (3) hop, a tick a millisecond.
 * The board is behind the three functions of hardware.h. SPDX-License-Identifier: MIT-0 */
#include <math.h>
#if defined(ARDUINO)
#include <Arduino.h> /* the IDE includes it by itself, PlatformIO does not */
#if !defined(PLATFORMIO)
#include <hopform.h> /* the name by which the IDE finds the library */
#endif
#endif
#include "hardware.h"
#include "robot.h"

enum { PHASES = HOPFORM_SELFTEST_PHASES };
static hopform_plan_f32 plan;
static hopform_search_f32 search;
static hopform_phase_f32 phases[PHASES];
static hopform_flight_phase_f32 flight_phases[PHASES];
static hopform_flight_f32 flight;   /* zeros before the first: no current */
static hopform_command_f32 command; /* u = 0 until one is found */
static hopform_contact_f32 contact;
static bool searching;

/* Hop height, datum, stop margin, horizon; evaluations of a candidate, which a tick must have time for, candidates. Where
 * one of these caps is met the search ends as HOPFORM_CAPPED: the current is the best one that was found until then. */
static const hopform_target_f32 target = {H_DES, 0.0f, 0.0f, 2.0f, 100, 24};
static const hopform_detector_f32 detector = {0.0004f, 0.0002f, 1}; /* [m] high, low; samples in a row */

/* (1) The library on this board computes the bits that it computes elsewhere. */
static bool digest_is_right(void) {
    return hopform_selftest_f32(&search, phases, PHASES) == EXPECTED_DIGEST;
}

/* (2) The current for the touchdown of a drop from H_DES, with which the loop begins. */
static bool one_command(void) {
    const float fall = robot.g; /* how fast the body falls in flight */
    const float v2 = -sqrtf(2.0f * fall * H_DES * (1.0f - robot.impact_loss)); /* after the impact */
    const hopform_state_f32 touchdown = {0.0f, 0.0f, v2, 0.0f};                /* x1, v1, v2, compression */
    return hopform_choose_current_f32(&search, &plan, &touchdown, &target, phases, PHASES, &command) == HOPFORM_OK;
}

/* (3) At take-off: when and how the leg will touch down, and the search for the current of that stance. */
static void at_takeoff(const hardware_reading *now) {
    hopform_state_f32 start = now->state;
    const hopform_command_f32 none = {0.0f, 0.0f, HOPFORM_COMMAND_NO_TAKEOFF};
    const float released = 0.0f; /* the compression of the unloaded leg */
    const float seen = start.y; /* below that: a tick late, the foot is above the ground */
    const float ground = seen < released ? seen - released : 0.0f;
    start.y = released;
    searching = false;
    command = none;
    const int32_t status =
        hopform_solve_flight_f32(&plan, &start, ground, NULL, 2.0f, PHASES, flight_phases, PHASES, &flight);
    if (status == HOPFORM_OK && flight.ending == HOPFORM_FLIGHT_TOUCHDOWN) {
        const hopform_state_f32 touchdown = {flight.end.x1, flight.end.v1, flight.v2_after, flight.end.y};
        searching =
            hopform_choose_current_begin_f32(&search, &plan, &touchdown, &target, &command) == HOPFORM_SEARCHING;
    }
}

/* In flight the actuator returns by a law within the limit of the current. */
static float law_of_flight(const hardware_reading *now) {
    const hopform_state_f32 *at = &now->state;
    const float pull = flight.gains.Kp * at->x1 + flight.gains.Kd * at->v1;
    const float u = pull / robot.gamma2;
    const float most = robot.u_max;
    return u > most ? most : (u > -most ? u : -most);
}

/* A tick: detect touchdown and take-off, solve one stance more of the search, set the current: the best admissible one
 * so far, 0 before there is one, whether the search has ended or not. */
static bool tick(void) {
    hardware_reading now;
    if (!hardware_tick(&now)) { return false; }
    if (hopform_touchdown_f32(&detector, &contact, now.contact) == HOPFORM_CONTACT_TAKEOFF) {
        at_takeoff(&now);
    } else if (searching) {
        searching = hopform_choose_current_step_f32(&search, phases, PHASES, &command) == HOPFORM_SEARCHING;
    }
    hardware_current(contact.touches ? command.u : law_of_flight(&now));
    return true;
}

static bool begin(void) {
    if (!digest_is_right()) {
        hardware_print("The digest is not the expected one: other flags, or another version. Selftests passed: ", 0);
        return false;
    }
    hardware_print("The digest is the expected one. Selftests passed: ", 1);
    const int32_t status = hopform_plan_init_f32(&plan, &robot);
    if (status != HOPFORM_OK) {
        hardware_print("hopform_plan_init refuses the robot, or warns of it. Status: ", status);
        return false;
    }
    const bool found = one_command();
    const char *said = "No current is admissible. Current [mA]: ";
    if (command.status == HOPFORM_COMMAND_REACHED) {
        said = "The first current reaches H_DES. Current [mA]: ";
    } else if (command.status == HOPFORM_COMMAND_NEAREST) {
        said = "No current reaches H_DES, the first one comes nearest. Current [mA]: ";
    }
    hardware_print(said, (int32_t)(1000.0f * command.u));
    return found;
}

#if defined(ARDUINO)
void hardware_print(const char *text, int32_t number) {
    Serial.print(text);
    Serial.println(number);
}

static bool hopping;

void setup(void) {
    Serial.begin(115200);
    while (!Serial && millis() < 5000) {} /* a port that is USB opens with the monitor: what came before is lost */
    hopping = begin();
}

void loop(void) {
    hopping = hopping && tick();
}
#else
static int run(void) {
    if (!begin()) { return 1; }
    while (tick()) {}
    return 0;
}

#if defined(ESP_PLATFORM)
void app_main(void) {
    (void)run();
}
#else
int main(void) {
    return run();
}
#endif
#endif
