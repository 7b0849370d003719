/* SPDX-License-Identifier: MIT-0
 *
 * Fixed cases that together visit every mode, kind of event, ending and branch of the kernels, and a hash of
 * all bits of what comes out: one word to compare between boards, compilers and a computer.
 */
#ifndef HOPFORM_SELFTEST_H_real
#define HOPFORM_SELFTEST_H_real

#include <stddef.h>
#include <string.h>

#include "facts.h"
#include "kernels_real.h"
#include "model_real.h"
#include "selftest_cases_real.h"

enum { TIMES_real = 5, GRID_real = 5 };

/* ---- the hash ---- */

static void mix_word_real(uint32_t *hash, uint32_t word) {
    uint32_t mixed = (*hash ^ word) * 2654435761u;
    mixed ^= mixed >> 15;
    mixed *= 2246822519u;
    *hash = mixed ^ (mixed >> 13);
}

static void mix_int_real(uint32_t *hash, int32_t value) {
    mix_word_real(hash, (uint32_t)value);
}

/* An array, or the leading members of a struct, that holds nothing but reals. */
static void mix_reals_real(uint32_t *hash, const void *reals, size_t size) {
    const unsigned char *bytes = (const unsigned char *)reals;
    for (size_t at = 0; at < size; at += sizeof(real)) {
        real value;
        (void)memcpy(&value, bytes + at, sizeof value);
        const uint64_t bits = bits_of_real_real(value);
        mix_word_real(hash, (uint32_t)bits);
        mix_word_real(hash, (uint32_t)(bits >> 32));
    }
}

/* ---- what is solved ---- */

static void mix_result_real(uint32_t *hash, const hopform_stance_real *stance, const hopform_phase_real *phases) {
    mix_reals_real(hash, stance, offsetof(hopform_stance_real, ending));
    mix_int_real(hash, stance->ending);
    mix_int_real(hash, stance->phase_count);
    mix_int_real(hash, stance->event_count);
    for (int32_t n = 0; n < stance->phases_kept; n++) {
        mix_reals_real(hash, &phases[n], offsetof(hopform_phase_real, mode));
        mix_int_real(hash, phases[n].mode);
        mix_int_real(hash, phases[n].event);
        mix_int_real(hash, phases[n].step);
    }
}

/* States, energies and a grid of a stance that was solved. */
static void mix_motion_real(uint32_t *hash, const hopform_plan_real *plan, const hopform_step_real *steps,
                            const hopform_phase_real *phases, const hopform_stance_real *stance) {
    real times[TIMES_real];
    hopform_energy_real energies[TIMES_real];
    hopform_ledger_real ledgers[TIMES_real];
    real losses[TIMES_real];
    real grid[HOPFORM_AXES][GRID_real];
    for (int32_t n = 0; n < TIMES_real; n++) {
        hopform_state_real state;
        times[n] = stance->duration * ((real)n / (real)(TIMES_real - 1));
        mix_int_real(hash, hopform_stance_at_real(plan, steps, phases, stance, times[n], &state));
        mix_reals_real(hash, &state, sizeof state);
    }
    mix_int_real(hash,
                 hopform_stance_energy_real(plan, steps, phases, stance, times, TIMES_real, energies, ledgers, losses));
    for (int32_t n = 0; n < TIMES_real; n++) {
        mix_reals_real(hash, &energies[n], sizeof energies[n]);
        mix_reals_real(hash, &ledgers[n], sizeof ledgers[n]);
        mix_reals_real(hash, &losses[n], sizeof losses[n]);
    }
    const real dt = stance->duration / (real)GRID_real;
    if (dt > 0.0) {
        real *columns[HOPFORM_AXES];
        for (int i = 0; i < HOPFORM_AXES; i++) {
            columns[i] = grid[i];
        }
        mix_int_real(hash, hopform_stance_grid_real(plan, steps, phases, stance, 0.0, dt, GRID_real, columns));
        mix_reals_real(hash, grid, sizeof grid);
    }
}

/* Derivatives at the ending, and the state in between with those there. */
static void mix_derivatives_real(uint32_t *hash, const hopform_plan_real *plan, const hopform_step_real *steps,
                                 const hopform_phase_real *phases, const hopform_stance_real *stance) {
    real matrix[HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS];
    real tangents[HOPFORM_TANGENT_ROWS * HOPFORM_SENSITIVITY_COLUMNS];
    hopform_state_real state;
    real again[HOPFORM_AXES];
    real *columns[HOPFORM_AXES];
    const real half = 0.5 * stance->duration;
    mix_int_real(hash, hopform_stance_sensitivities_real(plan, steps, phases, stance, NULL, 0, matrix));
    mix_reals_real(hash, matrix, sizeof matrix);
    mix_int_real(hash, hopform_stance_tangents_real(plan, steps, phases, stance, NULL, 0, &half, 1, &state, tangents));
    mix_reals_real(hash, tangents, sizeof tangents);
    for (int i = 0; i < HOPFORM_AXES; i++) {
        columns[i] = again + i;
    }
    mix_int_real(hash, hopform_stance_states_real(plan, steps, phases, stance, &half, 1, columns));
    mix_reals_real(hash, &state, sizeof state);
    mix_reals_real(hash, again, sizeof again);
}

#if HOPFORM_HAS_CONTACT
enum { FLIGHT_PHASES_real = 16, SAMPLES_real = 8, CURRENTS_real = 2 };

/* The flight that follows a take-off, over a step down of 3 cm. */
static void mix_flight_real(uint32_t *hash, const hopform_plan_real *plan, const hopform_stance_real *stance) {
    hopform_flight_phase_real phases[FLIGHT_PHASES_real];
    hopform_flight_real flight;
    state_by_axis_real from;
    hopform_state_real state;
    hopform_energy_real energy;
    hopform_flight_ledger_real ledger;
    real loss;
    from.named = stance->end;
    from.of[HOPFORM_STRETCH_AXIS] = -0.03;
    const int32_t status = hopform_solve_flight_real(plan, &from.named, 0, NULL, 2.0, FLIGHT_PHASES_real, phases,
                                                     FLIGHT_PHASES_real, &flight);
    mix_int_real(hash, status);
    mix_reals_real(hash, &flight, offsetof(hopform_flight_real, ending));
    mix_int_real(hash, flight.ending);
    mix_int_real(hash, flight.event_count);
    if (status != HOPFORM_OK) { return; }
    const real half = 0.5 * flight.duration;
    mix_int_real(hash, hopform_flight_at_real(plan, phases, &flight, &half, 1, &state));
    mix_reals_real(hash, &state, sizeof state);
    mix_int_real(hash, hopform_flight_energy_real(plan, phases, &flight, &half, 1, &energy, &ledger, &loss));
    mix_reals_real(hash, &energy, sizeof energy);
    mix_reals_real(hash, &ledger, sizeof ledger);
    mix_reals_real(hash, &loss, sizeof loss);
}
#endif

/* ---- the cases ---- */

static void mix_case_real(uint32_t *hash, const selftest_case_real *one, hopform_phase_real *phases) {
    hopform_plan_real plan;
    hopform_stance_real stance;
    mix_int_real(hash, hopform_plan_init_real(&plan, &selftest_robots_real[one->robot]));
    mix_reals_real(hash, &plan, offsetof(hopform_plan_real, made));
    const int32_t status = hopform_solve_stance_real(&plan, &one->start, one->steps, 2, one->horizon,
                                                     HOPFORM_SELFTEST_PHASES, phases, HOPFORM_SELFTEST_PHASES, &stance);
    mix_int_real(hash, status);
    mix_result_real(hash, &stance, phases);
    if (status == HOPFORM_OK) {
        mix_motion_real(hash, &plan, one->steps, phases, &stance);
        mix_derivatives_real(hash, &plan, one->steps, phases, &stance);
#if HOPFORM_HAS_CONTACT
        if (stance.ending == HOPFORM_ENDING_TAKEOFF) { mix_flight_real(hash, &plan, &stance); }
#endif
    }
}

#if HOPFORM_HAS_CONTACT
/* The controller from the state of a case, for hop heights within and beyond what the robot can do. */
static void mix_search_real(uint32_t *hash, const selftest_case_real *one, real h_des, hopform_search_real *search,
                            hopform_phase_real *phases) {
    hopform_plan_real plan;
    hopform_command_real command = {0.0, 0.0, HOPFORM_COMMAND_NO_TAKEOFF}; /* gcc -flto warns of a bare one */
    const hopform_target_real target = {h_des, 0.0, 0.001, 2.0, 0, 0};
    mix_int_real(hash, hopform_plan_init_real(&plan, &selftest_robots_real[one->robot]));
    mix_int_real(hash, hopform_choose_current_real(search, &plan, &one->start, &target, phases, HOPFORM_SELFTEST_PHASES,
                                                   &command));
    mix_reals_real(hash, &command, offsetof(hopform_command_real, status));
    mix_int_real(hash, command.status);
    mix_int_real(hash, search->trials);
}

/* What two currents do from the state of a case. */
static void mix_trials_real(uint32_t *hash, const selftest_case_real *one, hopform_phase_real *phases) {
    hopform_plan_real plan;
    hopform_trial_real trials[CURRENTS_real];
    const real currents[CURRENTS_real] = {one->steps[0].u, one->steps[1].u};
    mix_int_real(hash, hopform_plan_init_real(&plan, &selftest_robots_real[one->robot]));
    const int32_t status = hopform_try_currents_real(&plan, &one->start, 1, currents, CURRENTS_real, one->horizon,
                                                     phases, HOPFORM_SELFTEST_PHASES, trials);
    mix_int_real(hash, status);
    for (int32_t n = 0; status >= 0 && n < CURRENTS_real; n++) {
        mix_reals_real(hash, &trials[n], offsetof(hopform_trial_real, events));
        mix_word_real(hash, trials[n].events);
        mix_word_real(hash, trials[n].minima);
    }
}

/* Contact that begins, is lost for one sample, and ends. */
static void mix_contact_real(uint32_t *hash) {
    static const real samples[SAMPLES_real] = {0.5, 0.6, 0.5, 0.3, 0.6, 0.3, 0.5, 0.3};
    const hopform_detector_real detector = {0.6, 0.4, 2};
    hopform_contact_real contact = {0, 0, 0};
    for (int32_t n = 0; n < SAMPLES_real; n++) {
        mix_int_real(hash, hopform_touchdown_real(&detector, &contact, samples[n]));
        mix_int_real(hash, contact.above);
        mix_int_real(hash, contact.touches);
        mix_int_real(hash, contact.run);
    }
}

/* Searches and trials from the states of some cases, and a contact. */
static void mix_hopping_real(uint32_t *hash, hopform_search_real *search, hopform_phase_real *phases) {
    mix_search_real(hash, &selftest_cases_real[0], 0.15, search, phases);
    mix_search_real(hash, &selftest_cases_real[1], 0.02, search, phases);
    mix_search_real(hash, &selftest_cases_real[3], 0.5, search, phases);
    mix_trials_real(hash, &selftest_cases_real[0], phases);
    mix_trials_real(hash, &selftest_cases_real[8], phases);
    mix_search_real(hash, &selftest_cases_real[FIRST_AT_REST_real], 0.1, search, phases);
    mix_trials_real(hash, &selftest_cases_real[FIRST_AT_REST_real], phases);
    mix_search_real(hash, &selftest_cases_real[LAST_OVERDAMPED_real], 0.1, search, phases);
    mix_trials_real(hash, &selftest_cases_real[LAST_OVERDAMPED_real], phases);
    mix_contact_real(hash);
}
#endif

/* The cases, hashed. */
static uint32_t hash_of_cases_real(hopform_phase_real *phases) {
    uint32_t hash = 1;
    for (size_t n = 0; n < sizeof selftest_cases_real / sizeof selftest_cases_real[0]; n++) {
        mix_case_real(&hash, &selftest_cases_real[n], phases);
    }
    return hash;
}

#if HOPFORM_HAS_CONTACT
/* Solves fixed cases that visit every mode, kind of event, ending and branch of the kernels, and hashes all bits of
 * what comes out: the same digest on every processor, with every compiler and optimisation that keeps to IEEE 754.
 * search, phases: memory to work in; capacity >= HOPFORM_SELFTEST_PHASES, else the digest is 0, which no selftest
 * gives. */
uint32_t hopform_selftest_real(hopform_search_real *search, hopform_phase_real *phases, int32_t capacity) {
    if (search == NULL || phases == NULL || capacity < HOPFORM_SELFTEST_PHASES) { return 0; }
    uint32_t hash = hash_of_cases_real(phases);
    mix_hopping_real(&hash, search, phases);
    return hash == 0 ? 1 : hash;
}
#else
/* Solves fixed cases that visit every mode, kind of event, ending and branch of the kernels, and hashes all bits of
 * what comes out: the same digest on every processor, with every compiler and optimisation that keeps to IEEE 754.
 * phases: memory to work in; capacity >= HOPFORM_SELFTEST_PHASES, else the digest is 0, which no selftest gives. */
uint32_t hopform_selftest_real(hopform_phase_real *phases, int32_t capacity) {
    if (phases == NULL || capacity < HOPFORM_SELFTEST_PHASES) { return 0; }
    const uint32_t hash = hash_of_cases_real(phases);
    return hash == 0 ? 1 : hash;
}
#endif

#endif
