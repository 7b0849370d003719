/* SPDX-License-Identifier: MIT-0
 *
 * Energies and the ledger at any time of a stance.
 */
#include <stdbool.h>

#include "facts.h"
#include "ledger_real.h"

static void energy_add_real(hopform_ledger_real *ledger, const hopform_ledger_real *part)
{
#define ADD_ENTRY(name, domain) ledger->name += part->name;
    HOPFORM_LEDGER_MEMBERS(ADD_ENTRY)
#undef ADD_ENTRY
}

/* Energy lost at the stop that phase n begins with, negative; 0 if it begins with something else. */
static real energy_loss_before_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                    const hopform_phase_real *phases, int32_t n)
{
    if (phases[n].event != HOPFORM_EVENT_X1_HITS_STOP) {
        return 0.0;
    }
    const hopform_phase_real *before = &phases[n - 1];
    const hopform_state_real hit =
        hopform_state_in_phase_real(plan, before, steps[before->step].u, phases[n].t - before->t);
    return -0.5 * plan->robot.m_eff * hit.v1 * hit.v1;
}

int32_t hopform_stance_energy_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                   const hopform_phase_real *phases, const hopform_stance_real *stance,
                                   const real *times, int32_t count, hopform_energy_real *energies,
                                   hopform_ledger_real *ledgers, real *stop_losses)
{
    const bool wanted = ledgers != NULL && stop_losses != NULL;
    const hopform_memory_real arrays[] = {
        hopform_array_real(energies, count, sizeof *energies),
        hopform_array_real(ledgers, count, sizeof *ledgers),
        hopform_array_real(stop_losses, count, sizeof *stop_losses),
    };
    const hopform_memory_real read_times = hopform_array_real(times, count, sizeof *times);
    int32_t reading = HOPFORM_ERROR_NULL;
    if (times != NULL && (ledgers == NULL) == (stop_losses == NULL)) {
        reading = hopform_reading_status_real(plan, steps, phases, stance, read_times, arrays, wanted ? 3 : 1);
    }
    if (reading < 0) {
        return hopform_refuse_real(reading, arrays, 3);
    }
    hopform_ledger_real sum = {0};
    real loss = stance->start_loss;
    int32_t n = 0;
    for (int32_t i = 0; i < count; i++) {
        hopform_state_real state;
        const int32_t status = hopform_stance_at_real(plan, steps, phases, stance, times[i], &state);
        if (status < 0 || (wanted && i > 0 && times[i] < times[i - 1])) {
            return hopform_refuse_real(HOPFORM_ERROR_TIME, arrays, 3);
        }
        energies[i] = hopform_energies_real(&plan->robot, &state);
        if (!wanted) {
            continue;
        }
        const real t = hopform_lesser_real(times[i], stance->duration);
        for (; n < stance->phases_kept - 1 && phases[n + 1].t <= t; n++) {
            const hopform_ledger_real whole =
                hopform_ledger_in_phase_real(plan, &phases[n], steps[phases[n].step].u, phases[n + 1].t - phases[n].t);
            energy_add_real(&sum, &whole);
            loss += energy_loss_before_real(plan, steps, phases, n + 1);
        }
        ledgers[i] = sum;
        stop_losses[i] = loss;
        if (t > phases[n].t) {
            const hopform_ledger_real part =
                hopform_ledger_in_phase_real(plan, &phases[n], steps[phases[n].step].u, t - phases[n].t);
            energy_add_real(&ledgers[i], &part);
        }
    }
    return HOPFORM_OK;
}
