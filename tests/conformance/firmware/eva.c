/* The driver for Frama-C's Eva: every public function on arbitrary bit patterns, NaN and infinities included, in every
 * number that a caller hands in; results of one call go into the next. Only pointers point somewhere, and counts are
 * those of the buffers. */
#include <stddef.h>
#include <stdint.h>

#include "hopform/hopform.h"

volatile uint32_t any_bits; /* what Eva takes a volatile for: any value at each reading */

enum { CAPACITY = 4, TIMES = 2 };

static float any(void)
{
    union {
        uint32_t bits;
        float value;
    } number;
    number.bits = any_bits;
    return number.value;
}

static void fill(float *numbers, int count)
{
    for (int n = 0; n < count; n++) {
        numbers[n] = any();
    }
}

static hopform_phase_f32 phases[CAPACITY];
static hopform_flight_phase_f32 flight_phases[CAPACITY];
static hopform_search_f32 search;
static hopform_robot_f32 robot;
static hopform_plan_f32 plan;
static hopform_state_f32 start, state, states[TIMES];
static hopform_step_f32 steps[2];
static hopform_stance_f32 stance;
static hopform_flight_f32 flight;
static hopform_gains_f32 gains;
static hopform_energy_f32 energies[TIMES];
static hopform_ledger_f32 ledgers[TIMES];
static hopform_flight_ledger_f32 flight_ledgers[TIMES];
static hopform_target_f32 target;
static hopform_command_f32 command;
static hopform_trial_f32 trials[1];
static hopform_start_f32 coordinates;
static hopform_forces_f32 forces[TIMES];
static hopform_plant_f32 plant;
static float times[TIMES], losses[TIMES], x1[TIMES], v1[TIMES], v2[TIMES], y[TIMES], current;
static float matrix[HOPFORM_SENSITIVITY_ROWS * HOPFORM_SENSITIVITY_COLUMNS];
static float flight_matrix[HOPFORM_FLIGHT_ROWS * HOPFORM_FLIGHT_COLUMNS];
static float tangents[TIMES * HOPFORM_TANGENT_ROWS * HOPFORM_SENSITIVITY_COLUMNS];

#ifdef ONLY_PLANT
#define WANTS(part) ((part) == 4)
#elif defined(ONLY_FLIGHT)
#define WANTS(part) ((part) == 2)
#elif defined(ONLY_STANCE)
#define WANTS(part) ((part) == 1)
#elif defined(ONLY_CONTROL)
#define WANTS(part) ((part) == 3)
#else
#define WANTS(part) 1
#endif

int main(void)
{
    fill((float *)&robot, HOPFORM_ROBOT_FIELDS); /* of memory that holds zeros: what is not written is still a number */
    fill((float *)&start, 4);
    fill((float *)steps, 4);
    fill(times, TIMES);
    (void)hopform_plan_init_f32(&plan, &robot);
    if (WANTS(1)) {
        const int32_t status =
            hopform_solve_stance_f32(&plan, &start, steps, 2, any(), CAPACITY, phases, CAPACITY, &stance);
        if (status >= 0) {
            (void)hopform_stance_at_f32(&plan, steps, phases, &stance, any(), &state);
            (void)hopform_stance_states_f32(&plan, steps, phases, &stance, times, TIMES,
                                            (float *const[]){x1, v1, v2, y});
            (void)hopform_stance_energy_f32(&plan, steps, phases, &stance, times, TIMES, energies, ledgers, losses);
            (void)hopform_stance_forces_f32(&plan, steps, phases, &stance, times, TIMES, forces);
            (void)hopform_stance_before_f32(&plan, steps, phases, &stance, (int32_t)any_bits, &state);
            (void)hopform_stance_grid_f32(&plan, steps, phases, &stance, any(), any(), TIMES,
                                          (float *const[]){x1, v1, v2, y});
            (void)hopform_stance_sensitivities_f32(&plan, steps, phases, &stance, NULL, 0, matrix);
            (void)hopform_stance_tangents_f32(&plan, steps, phases, &stance, NULL, 0, times, TIMES,
                                              states, tangents);
        }
    }
    if (WANTS(2)) {
        fill((float *)&gains, 2);
        (void)hopform_design_return_f32(&plan, any(), &gains);
        const int32_t status = hopform_solve_flight_f32(&plan, &start, any(), any_bits != 0 ? &gains : NULL, any(),
                                                         CAPACITY, flight_phases, CAPACITY, &flight);
        if (status >= 0) {
            (void)hopform_flight_at_f32(&plan, flight_phases, &flight, times, TIMES, states);
            (void)hopform_flight_energy_f32(&plan, flight_phases, &flight, times, TIMES, energies, flight_ledgers,
                                            losses);
            (void)hopform_flight_sensitivities_f32(&plan, flight_phases, &flight, NULL, 0, flight_matrix);
        }
        hopform_detector_f32 detector = {any(), any(), (int32_t)any_bits};
        hopform_contact_f32 contact = {0, 0, 0};
        for (int n = 0; n < 3; n++) {
            (void)hopform_touchdown_f32(&detector, &contact, any());
        }
    }
    if (WANTS(4)) {
        fill((float *)&coordinates, 4);
        (void)hopform_state_of_start_f32(&plan, &coordinates, &state);
        (void)hopform_start_of_state_f32(&plan, &start, &coordinates);
        (void)hopform_plant_begin_f32(&plant, &robot, &coordinates);
        hopform_report_f32 report = {.phases = phases, .capacity = CAPACITY};
        for (int n = 0; n < 2; n++) {
            (void)hopform_plant_step_f32(&plant, any(), any(), &report);
        }
        (void)hopform_plant_place_f32(&plant, &coordinates);
    }
    if (WANTS(3)) {
        current = any();
        fill((float *)&target, 4);
        (void)hopform_choose_current_f32(&search, &plan, &start, &target, phases, CAPACITY, &command);
        if (hopform_choose_current_begin_f32(&search, &plan, &start, &target, &command) == HOPFORM_SEARCHING) {
            (void)hopform_choose_current_near_f32(&search, current);
            (void)hopform_choose_current_step_f32(&search, phases, CAPACITY, &command);
        }
        (void)hopform_try_currents_f32(&plan, &start, 1, &current, 1, any(), phases, CAPACITY, trials);
        if (hopform_solve_stance_f32(&plan, &start, steps, 2, any(), CAPACITY, phases, CAPACITY, &stance) >= 0) {
            (void)hopform_stance_compression_f32(&plan, steps, phases, &stance, &current);
        }
    }
    return 0;
}
