/* A libFuzzer target: flights and the touchdown detector on arbitrary bit patterns, -DSINGLE in single precision.
 *
 * The bytes become numbers as they are or, by the first one, of a sensible size, so that the solver is entered and not
 * only its gate. An answer that is not finite, or not within its own bounds, aborts.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "source.h"

static void detect(source *from)
{
    const T(detector) detector = {next_real(from, 0, 0), next_real(from, 0, 0), next_byte(from) - 8};
    T(contact) contact = {0, 0, 0};
    for (int n = 0; n < 8; n++) {
        const T(contact) before = contact;
        const int32_t event = T(touchdown)(&detector, &contact, next_real(from, 0, 0));
        must(event >= 0
             || (before.run == contact.run && before.above == contact.above && before.touches == contact.touches));
        must(event <= HOPFORM_CONTACT_TAKEOFF && (event != HOPFORM_CONTACT_TOUCHDOWN || contact.touches == 1));
        must(contact.run >= 0 && (event < 0 || contact.run < detector.count));
    }
}

static void read_flight(const T(plan) *plan, const T(flight_phase) *phases, const T(flight) *flight, real early)
{
    const real times[2] = {early, flight->duration};
    T(state) states[2];
    T(energy) energies[2];
    T(flight_ledger) ledgers[2];
    real losses[2];
    int32_t columns[3];
    real matrix[HOPFORM_FLIGHT_ROWS * HOPFORM_FLIGHT_COLUMNS];
    T(flight_at)(plan, phases, flight, times, 2, states);
    const int32_t known = T(flight_sensitivities)(plan, phases, flight, NULL, 0, matrix);
    for (int n = 0; n < HOPFORM_FLIGHT_ROWS * HOPFORM_FLIGHT_COLUMNS; n++) {
        must(isfinite(matrix[n]) && (known == HOPFORM_OK || matrix[n] == 0));
    }
    for (int n = 0; n < 3; n++) {
        columns[n] = early > n ? n * n : HOPFORM_FLIGHT_COLUMNS - n;
    }
    T(flight_sensitivities)(plan, phases, flight, columns, 3, matrix);
    T(flight_energy)(plan, phases, flight, times, 2, energies, ledgers, losses);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    source from = {data, size};
    const int kind = next_byte(&from), sensible = kind & 1;
    const T(robot) robot = next_robot(&from, kind);
    T(plan) plan;
    if (T(plan_init)(&plan, &robot) < 0) {
        detect(&from);
        return 0;
    }
    T(state) start;
    start.x1 = sensible ? 0 : next_real(&from, 0, 0);
    start.v1 = next_real(&from, sensible, 0);
    start.v2 = next_real(&from, sensible, 0);
    start.y = kind & 4 ? 0 : next_real(&from, sensible, 0);
    const T(gains) gains = {next_real(&from, sensible, 1), next_real(&from, sensible, 1)};
    const int32_t max_phases = 1 + next_byte(&from) % MAX_PHASES;
    const int32_t capacity = kind & 16 ? next_byte(&from) % MAX_PHASES : MAX_PHASES + 1;
    const real horizon = next_real(&from, sensible, 1);
    T(flight_phase) phases[MAX_PHASES + 1];
    T(flight) flight;
    const int32_t status =
        T(solve_flight)(&plan, &start, 0, kind & 8 ? NULL : &gains, horizon, max_phases, phases, capacity, &flight);
    if (status < 0) {
        return 0;
    }
    must(isfinite(flight.duration) && isfinite(flight.end.x1) && isfinite(flight.end.v1) && isfinite(flight.end.v2));
    must(isfinite(flight.end.y) && isfinite(flight.apex) && isfinite(flight.v2_after) && flight.start_loss <= 0);
    must(flight.duration >= 0 && flight.duration <= horizon && flight.ending >= 1 && flight.ending <= 4);
    must(flight.phases_kept <= capacity && flight.phase_count <= max_phases && flight.phase_count >= 1);
    must((status == HOPFORM_PHASES_NOT_KEPT) == (flight.phases_kept < flight.phase_count));
    for (int32_t n = 0; n < flight.phases_kept; n++) {
        must(phases[n].side >= -1 && phases[n].side <= 1 && phases[n].limit >= -1 && phases[n].limit <= 1);
        must(n == 0 || phases[n].t >= phases[n - 1].t);
    }
    read_flight(&plan, phases, &flight, kind & 32 ? next_real(&from, 0, 0) : flight.duration / 3);
    return 0;
}
