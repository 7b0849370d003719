/* SPDX-License-Identifier: MIT-0
 *
 * Fixed stances, flights and searches that together visit every mode, kind of event, ending and branch of the kernels,
 * and a hash of all bits of what comes out: one word to compare between boards, compilers and the computer on the desk.
 */
#include "facts.h"
#include "kernels_real.h"
#include "selftest_cases_real.h"

enum { FLIGHT_PHASES_real = 16, TIMES_real = 5, GRID_real = 5, SAMPLES_real = 8, CURRENTS_real = 2 };

/* ---- the hash ---- */

static uint32_t with_word_real(uint32_t hash, uint32_t word)
{
    uint32_t mixed = (hash ^ word) * 2654435761u;
    mixed ^= mixed >> 15;
    mixed *= 2246822519u;
    return mixed ^ (mixed >> 13);
}

static uint32_t with_int_real(uint32_t hash, int32_t value)
{
    return with_word_real(hash, (uint32_t)value);
}

static uint32_t with_number_real(uint32_t hash, real value)
{
    const uint64_t bits = hopform_bits_of_real_real(value);
    return with_word_real(with_word_real(hash, (uint32_t)bits), (uint32_t)(bits >> 32));
}

#define WITH_MEMBER_real(name, domain) sum = with_number_real(sum, value->name);
#define WITH_RECORD_real(record, MEMBERS)                                                                              \
    static uint32_t with_##record##_real(uint32_t hash, const hopform_##record##_real *value)                          \
    {                                                                                                                  \
        uint32_t sum = hash;                                                                                           \
        MEMBERS(WITH_MEMBER_real)                                                                                      \
        return sum;                                                                                                    \
    }

WITH_RECORD_real(rates, HOPFORM_RATES_MEMBERS) WITH_RECORD_real(poles, HOPFORM_POLES_MEMBERS)
    WITH_RECORD_real(state, HOPFORM_STATE_MEMBERS) WITH_RECORD_real(energy, HOPFORM_ENERGY_MEMBERS)
        WITH_RECORD_real(ledger, HOPFORM_LEDGER_MEMBERS) WITH_RECORD_real(flight_ledger, HOPFORM_FLIGHT_LEDGER_MEMBERS)

    /* ---- what is solved ---- */

    static uint32_t with_plan_real(uint32_t hash, const hopform_plan_real *plan)
{
    uint32_t sum = with_rates_real(hash, &plan->rates);
    sum = with_poles_real(sum, &plan->both);
    sum = with_poles_real(sum, &plan->actuator);
    return with_poles_real(sum, &plan->body);
}

static uint32_t with_result_real(uint32_t hash, const hopform_stance_real *stance, const hopform_phase_real *phases)
{
    uint32_t sum = with_number_real(hash, stance->duration);
    sum = with_state_real(sum, &stance->end);
    sum = with_number_real(with_number_real(sum, stance->apex), stance->aed);
    sum = with_int_real(with_number_real(sum, stance->start_loss), stance->ending);
    sum = with_int_real(with_int_real(sum, stance->phase_count), stance->event_count);
    for (int32_t n = 0; n < stance->phases_kept; n++) {
        const hopform_state_real state = {phases[n].x1, phases[n].v1, phases[n].v2, phases[n].y};
        sum = with_state_real(with_number_real(sum, phases[n].t), &state);
        sum = with_int_real(with_int_real(with_int_real(sum, phases[n].mode), phases[n].event), phases[n].step);
    }
    return sum;
}

/* States, energies and a grid of a stance that was solved. */
static uint32_t with_motion_real(uint32_t hash, const hopform_plan_real *plan, const hopform_step_real *steps,
                                 const hopform_phase_real *phases, const hopform_stance_real *stance)
{
    uint32_t sum = hash;
    real times[TIMES_real];
    hopform_energy_real energies[TIMES_real];
    hopform_ledger_real ledgers[TIMES_real];
    real losses[TIMES_real];
    for (int32_t n = 0; n < TIMES_real; n++) {
        times[n] = stance->duration * ((real)n / (real)(TIMES_real - 1));
    }
    for (int32_t n = 0; n < TIMES_real; n++) {
        hopform_state_real state;
        sum = with_int_real(sum, hopform_stance_at_real(plan, steps, phases, stance, times[n], &state));
        sum = with_state_real(sum, &state);
    }
    sum = with_int_real(
        sum, hopform_stance_energy_real(plan, steps, phases, stance, times, TIMES_real, energies, ledgers, losses));
    for (int32_t n = 0; n < TIMES_real; n++) {
        sum = with_number_real(with_ledger_real(with_energy_real(sum, &energies[n]), &ledgers[n]), losses[n]);
    }
    return sum;
}

static uint32_t with_grid_real(uint32_t hash, const hopform_plan_real *plan, const hopform_step_real *steps,
                               const hopform_phase_real *phases, const hopform_stance_real *stance)
{
    real x1[GRID_real];
    real v1[GRID_real];
    real v2[GRID_real];
    real y[GRID_real];
    const real dt = stance->duration / (real)GRID_real;
    if (!(dt > 0.0)) {
        return hash;
    }
    uint32_t sum =
        with_int_real(hash, hopform_stance_grid_real(plan, steps, phases, stance, 0.0, dt, GRID_real, x1, v1, v2, y));
    for (int32_t n = 0; n < GRID_real; n++) {
        const hopform_state_real state = {x1[n], v1[n], v2[n], y[n]};
        sum = with_state_real(sum, &state);
    }
    return sum;
}

/* The flight that follows a take-off, over a step down of 3 cm. */
static uint32_t with_flight_real(uint32_t hash, const hopform_plan_real *plan, const hopform_stance_real *stance)
{
    hopform_flight_phase_real phases[FLIGHT_PHASES_real];
    hopform_flight_real flight;
    hopform_state_real start = stance->end;
    hopform_state_real state;
    hopform_energy_real energy;
    hopform_flight_ledger_real ledger;
    real loss;
    start.y = -0.03;
    const int32_t status =
        hopform_solve_flight_real(plan, &start, 0, NULL, 2.0, FLIGHT_PHASES_real, phases, FLIGHT_PHASES_real, &flight);
    uint32_t sum = with_state_real(with_number_real(with_int_real(hash, status), flight.duration), &flight.end);
    sum = with_number_real(with_number_real(sum, flight.gains.Kp), flight.gains.Kd);
    sum = with_number_real(with_number_real(sum, flight.apex), flight.v2_after);
    sum = with_int_real(with_int_real(sum, flight.ending), flight.event_count);
    if (status != HOPFORM_OK) {
        return sum;
    }
    const real half = 0.5 * flight.duration;
    sum = with_int_real(sum, hopform_flight_at_real(plan, phases, &flight, &half, 1, &state));
    sum = with_state_real(sum, &state);
    sum = with_int_real(sum, hopform_flight_energy_real(plan, phases, &flight, &half, 1, &energy, &ledger, &loss));
    sum = with_flight_ledger_real(with_energy_real(sum, &energy), &ledger);
    return with_number_real(sum, loss);
}

/* Derivatives at take-off, and the state in between with those there. */
static uint32_t with_derivatives_real(uint32_t hash, const hopform_plan_real *plan, const hopform_step_real *steps,
                                      const hopform_phase_real *phases, const hopform_stance_real *stance)
{
    real matrix[HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS];
    real tangents[HOPFORM_TANGENT_ROWS * HOPFORM_SENSITIVITY_COLUMNS];
    hopform_state_real state;
    hopform_state_real again;
    const real half = 0.5 * stance->duration;
    uint32_t sum = with_int_real(hash, hopform_stance_sensitivities_real(plan, steps, phases, stance, matrix));
    for (int32_t n = 0; n < HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS; n++) {
        sum = with_number_real(sum, matrix[n]);
    }
    sum = with_int_real(sum, hopform_stance_tangents_real(plan, steps, phases, stance, &half, 1, &state, tangents));
    for (int32_t n = 0; n < HOPFORM_TANGENT_ROWS * HOPFORM_SENSITIVITY_COLUMNS; n++) {
        sum = with_number_real(sum, tangents[n]);
    }
    sum = with_int_real(sum, hopform_stance_states_real(plan, steps, phases, stance, &half, 1, &again.x1, &again.v1,
                                                        &again.v2, &again.y));
    return with_state_real(with_state_real(sum, &state), &again);
}

static uint32_t with_case_real(uint32_t hash, const hopform_selftest_case_real *one, hopform_phase_real *phases)
{
    hopform_plan_real plan;
    hopform_stance_real stance;
    const hopform_state_real start = {one->x1, one->v1, one->v2, one->y};
    const hopform_step_real steps[] = {{0.0, one->u}, {one->later, one->then}};
    uint32_t sum = with_int_real(hash, hopform_plan_init_real(&plan, &hopform_selftest_robots_real[one->robot]));
    sum = with_plan_real(sum, &plan);
    const int32_t status = hopform_solve_stance_real(&plan, &start, steps, 2, one->horizon, HOPFORM_SELFTEST_PHASES,
                                                     phases, HOPFORM_SELFTEST_PHASES, &stance);
    sum = with_result_real(with_int_real(sum, status), &stance, phases);
    if (status != HOPFORM_OK) {
        return sum;
    }
    sum = with_motion_real(sum, &plan, steps, phases, &stance);
    sum = with_grid_real(sum, &plan, steps, phases, &stance);
    sum = with_derivatives_real(sum, &plan, steps, phases, &stance);
    return stance.ending == HOPFORM_ENDING_TAKEOFF ? with_flight_real(sum, &plan, &stance) : sum;
}

/* The controller from the state of a case, for hop heights within and beyond what the robot can do. */
static uint32_t with_search_real(uint32_t hash, const hopform_selftest_case_real *one, real h_des,
                                 hopform_search_real *search, hopform_phase_real *phases)
{
    hopform_plan_real plan;
    hopform_command_real command;
    const hopform_state_real start = {one->x1, one->v1, one->v2, one->y};
    const hopform_target_real target = {h_des, 0.0, 0.001, 2.0};
    uint32_t sum = with_int_real(hash, hopform_plan_init_real(&plan, &hopform_selftest_robots_real[one->robot]));
    sum = with_int_real(
        sum, hopform_choose_current_real(search, &plan, &start, &target, phases, HOPFORM_SELFTEST_PHASES, &command));
    sum = with_number_real(with_number_real(sum, command.u), command.apex);
    return with_int_real(with_int_real(sum, command.status), search->trials);
}

/* What two currents do from the state of a case. */
static uint32_t with_trials_real(uint32_t hash, const hopform_selftest_case_real *one, hopform_phase_real *phases)
{
    hopform_plan_real plan;
    hopform_trial_real trials[CURRENTS_real];
    const hopform_state_real start = {one->x1, one->v1, one->v2, one->y};
    const real currents[CURRENTS_real] = {one->u, one->then};
    uint32_t sum = with_int_real(hash, hopform_plan_init_real(&plan, &hopform_selftest_robots_real[one->robot]));
    const int32_t status = hopform_try_currents_real(&plan, &start, 1, currents, CURRENTS_real, one->horizon, phases,
                                                     HOPFORM_SELFTEST_PHASES, trials);
    sum = with_int_real(sum, status);
    for (int32_t n = 0; status >= 0 && n < CURRENTS_real; n++) {
        sum = with_number_real(with_number_real(sum, trials[n].apex), trials[n].apex_u);
        sum = with_number_real(with_number_real(sum, trials[n].largest_x1), trials[n].largest_x1_u);
        sum = with_number_real(with_number_real(sum, trials[n].least_contact), trials[n].least_contact_u);
        sum = with_word_real(with_word_real(sum, trials[n].events), trials[n].minima);
    }
    return sum;
}

/* Contact that begins, is lost for one sample, and ends. */
static uint32_t with_contact_real(uint32_t hash)
{
    static const real samples[SAMPLES_real] = {0.5, 0.6, 0.5, 0.3, 0.6, 0.3, 0.5, 0.3};
    const hopform_detector_real detector = {0.6, 0.4, 2};
    hopform_contact_real contact = {0, 0, 0};
    uint32_t sum = hash;
    for (int32_t n = 0; n < SAMPLES_real; n++) {
        sum = with_int_real(sum, hopform_touchdown_real(&detector, &contact, samples[n]));
        sum = with_int_real(with_int_real(with_int_real(sum, contact.above), contact.touches), contact.run);
    }
    return sum;
}

uint32_t hopform_selftest_real(hopform_search_real *search, hopform_phase_real *phases, int32_t capacity)
{
    if (search == NULL || phases == NULL || capacity < HOPFORM_SELFTEST_PHASES) {
        return 0;
    }
    uint32_t sum = 1;
    for (uint32_t n = 0; n < sizeof hopform_selftest_cases_real / sizeof hopform_selftest_cases_real[0]; n++) {
        sum = with_case_real(sum, &hopform_selftest_cases_real[n], phases);
    }
    sum = with_search_real(sum, &hopform_selftest_cases_real[0], 0.15, search, phases);
    sum = with_search_real(sum, &hopform_selftest_cases_real[1], 0.02, search, phases);
    sum = with_search_real(sum, &hopform_selftest_cases_real[3], 0.5, search, phases);
    sum = with_trials_real(sum, &hopform_selftest_cases_real[0], phases);
    sum = with_trials_real(sum, &hopform_selftest_cases_real[8], phases);
    sum = with_contact_real(sum);
    return sum == 0 ? 1 : sum;
}
