/* SPDX-License-Identifier: MIT-0
 *
 * Energies and the ledger at any time of a stance.
 */
#ifndef HOPFORM_ENERGY_H_real
#define HOPFORM_ENERGY_H_real

#include <stdbool.h>

#include "ledger_real.h"
#include "reading_real.h"

/* Add the work of the first t of a phase to a ledger. */
static void energy_add_real(hopform_ledger_real *ledger, const hopform_plan_real *plan, const hopform_phase_real *phase,
                            real u, real t) {
    const hopform_ledger_real part = ledger_in_phase_real(plan, phase, u, t);
    (void)ledger; /* of a model in which nothing does work */
    (void)part;
#define ADD_ENTRY(name, domain) ledger->name += part.name;
    HOPFORM_LEDGER_MEMBERS(ADD_ENTRY)
#undef ADD_ENTRY
}

/* Energies and ledgers from the start of a solved stance to each of `count` times, which must not decrease. Without
 * ledgers and stop_losses (both NULL) the energies alone, at a fraction of the cost, at times of any order. */
int32_t hopform_stance_energy_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                   const hopform_phase_real *phases, const hopform_stance_real *stance,
                                   const real *times, int32_t count, hopform_energy_real *energies,
                                   hopform_ledger_real *ledgers, real *stop_losses) {
    const bool wanted = ledgers != NULL || stop_losses != NULL;
    const memory_real arrays[3] = {
        array_real(energies, count, sizeof *energies),
        array_real(ledgers, count, sizeof *ledgers),
        array_real(stop_losses, count, sizeof *stop_losses),
    };
    const times_real when = {times, count, wanted};
    const int32_t status = reading_status_real(plan, steps, phases, stance, &when, NULL, arrays, wanted ? 3 : 1);
    if (status < 0) { return status; }
    hopform_ledger_real sum = {0};
    real loss = stance->start_loss;
    int32_t n = 0;
    for (int32_t i = 0; i < count; i++) {
        const hopform_state_real state = state_of_stance_real(plan, steps, phases, stance, times[i]);
        energies[i] = energies_real(&plan->robot, &state);
        if (!wanted) { continue; }
        const real t = lesser_real(times[i], stance->duration);
        for (; n < stance->phases_kept - 1 && phases[n + 1].t <= t; n++) {
            const real length = phases[n + 1].t - phases[n].t;
            const real u = input_of_phase_real(plan, steps, &phases[n]);
            energy_add_real(&sum, plan, &phases[n], u, length);
            if (phases[n + 1].event == HOPFORM_EVENT_HITS_STOP) {
                const hopform_state_real before = state_before_phase_real(plan, &phases[n], u, &phases[n + 1]);
                loss += loss_at_stop_real(&plan->robot, &before);
            }
        }
        ledgers[i] = sum;
        stop_losses[i] = loss;
        if (t > phases[n].t) {
            energy_add_real(&ledgers[i], plan, &phases[n], input_of_phase_real(plan, steps, &phases[n]),
                            t - phases[n].t);
        }
    }
    return HOPFORM_OK;
}

#endif
