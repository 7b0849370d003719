/* SPDX-License-Identifier: MIT-0
 *
 * How a stance depends on its inputs, through its events. Within a phase z = (1, x_1, y, v_1, v_2) obeys z' = M z, so a
 * change d_p of an input changes z by
 *
 *     d_z(h) = Phi(h) d_z(0) + sum_j d_M_j G_j(h) z(0),     G_j(h) = integral of Phi(h - s) E_j Phi(s), 0 <= s <= h
 *
 * E_j being 1 in one place of the rows of (3), (4) in M. Doubling, G_j(2h) = Phi(h) G_j(h) + G_j(h) Phi(h), adds up
 * what does not cancel and knows no pole configuration (Van Loan, "Computing integrals involving the matrix
 * exponential", 1978).
 *
 * An event at tau, which moves by d_tau, adds (z' before it - z' after it) d_tau, on top of what it does to the state.
 */
#include <stdbool.h>

#include "facts.h"
#include "linear_real.h"

enum { SHARES_real = 8 };
enum { ROW_T_real, ROW_X1_real, ROW_V1_real, ROW_X2_real, ROW_V2_real, ROW_APEX_real, ROW_AED_real };
#define BY_PARAMETER_real(name, domain) BY_##name##_real,
enum {
    BY_X1_real,
    BY_V1_real,
    BY_Y_real,
    BY_V2_real,
    BY_U_real,
    HOPFORM_ROBOT_MEMBERS(BY_PARAMETER_real) COLUMNS_real
};

/* Changes of z by a change of each input. */
typedef struct {
    real at[Z_SIZE][COLUMNS_real];
} changes_real;

/* Phi of a phase, and how z at its end answers to a change of each share of (3), (4). */
typedef struct {
    hopform_matrix_real phi;
    real by_share[SHARES_real][Z_SIZE];
} response_real;

/* What a share changes in M: row V1 for the first four, V2 for the others; column 1, y, v_1, v_2. */
static int row_of_real(int share)
{
    return share < SHARES_real / 2 ? Z_V1 : Z_V2;
}

static int column_of_real(int share)
{
    const int place = share % (SHARES_real / 2);
    return place == 0 ? Z_ONE : Z_X + place;
}

/* G of each share over a time h: Gauss's rule over what stands under the integral, whose places are their own mirror.
 */
static void short_responses_real(const hopform_plan_real *plan, const hopform_drive_real *drive, int side_1, int side_2,
                                 real h, hopform_matrix_real shares[SHARES_real])
{
    hopform_matrix_real phi[HOPFORM_NODES_real] = {0};
    for (int node = 0; node < HOPFORM_NODES_real; node++) {
        phi[node] = hopform_transition_real(plan, drive, side_1, side_2, hopform_place_real[node] * h);
    }
    for (int share = 0; share < SHARES_real; share++) {
        for (int node = 0; node < HOPFORM_NODES_real; node++) {
            const hopform_matrix_real *rest = &phi[HOPFORM_NODES_real - 1 - node];
            const real *at = phi[node].at[column_of_real(share)];
            for (int i = Z_X; i < Z_SIZE; i++) {
                const real factor = rest->at[i][row_of_real(share)] * (hopform_weight_real[node] * h);
                for (int j = 0; j < Z_SIZE; j++) {
                    shares[share].at[i][j] += factor * at[j];
                }
            }
        }
    }
}

/* The response of a phase of length t. A share of a mass that is held has none. */
static response_real response_of_real(const hopform_plan_real *plan, const hopform_phase_real *phase, real u, real t)
{
    const int side_1 = hopform_side_1_real(phase);
    const int side_2 = hopform_side_2_real(phase);
    const hopform_drive_real drive = hopform_drive_of_real(&plan->robot, &plan->rates, u, (real)side_1, (real)side_2);
    const hopform_poles_real *poles = hopform_poles_of_real(plan, side_1, side_2);
    int doublings = hopform_doublings_real(poles, t);
    real h = hopform_halved_real(t, doublings);
    hopform_matrix_real shares[SHARES_real] = {0};
    short_responses_real(plan, &drive, side_1, side_2, h, shares);
    for (; doublings > 0; doublings--) {
        const hopform_matrix_real phi = hopform_transition_real(plan, &drive, side_1, side_2, h);
        for (int share = 0; share < SHARES_real; share++) {
            hopform_matrix_real twice = {{{0}}};
            hopform_add_product_real(&twice, &phi, &shares[share]);
            hopform_add_product_real(&twice, &shares[share], &phi);
            shares[share] = twice;
        }
        h *= 2.0;
    }
    response_real made = {0};
    made.phi = hopform_transition_real(plan, &drive, side_1, side_2, t);
    const real start[Z_SIZE] = {1.0, 0.0, phase->y, phase->v1, phase->v2};
    for (int share = 0; share < SHARES_real; share++) {
        const bool moves = (row_of_real(share) == Z_V1 ? side_1 : side_2) != 0;
        for (int i = 0; i < Z_SIZE; i++) {
            for (int j = 0; moves && j < Z_SIZE; j++) {
                made.by_share[share][i] += shares[share].at[i][j] * start[j];
            }
        }
    }
    return made;
}

/* The change of each parameter that a column stands for. */
static hopform_robot_change_real robot_change_real(int column)
{
#define IS_CHANGED(name, domain) column == BY_##name##_real ? 1.0 : 0.0,
    const hopform_robot_change_real change = {HOPFORM_ROBOT_MEMBERS(IS_CHANGED)};
#undef IS_CHANGED
    return change;
}

/* Changes at the start of the first phase: no velocity is left of a mass that is held, or that a stop took at once. */
static changes_real sensitivity_start_of_real(const hopform_phase_real *phase, const hopform_stance_real *stance)
{
    changes_real change = {{{0}}};
    change.at[Z_X][BY_X1_real] = 1.0;
    change.at[Z_Y][BY_Y_real] = 1.0;
    change.at[Z_V1][BY_V1_real] = hopform_side_1_real(phase) != 0 && !(stance->start_loss < 0.0) ? 1.0 : 0.0;
    change.at[Z_V2][BY_V2_real] = hopform_side_2_real(phase) != 0 ? 1.0 : 0.0;
    return change;
}

/* Changes at the end of a phase from those at its start. */
static void advance_real(const hopform_plan_real *plan, const hopform_phase_real *phase, real u, real t,
                         changes_real *change)
{
    const response_real made = response_of_real(plan, phase, u, t);
    for (int column = 0; column < COLUMNS_real; column++) {
        const hopform_robot_change_real robot = robot_change_real(column);
        const hopform_slopes_real slopes =
            hopform_slopes_of_real(&plan->robot, u, (real)hopform_side_1_real(phase), (real)hopform_side_2_real(phase),
                                   &robot, column == BY_U_real ? 1.0 : 0.0);
        const real of_share[SHARES_real] = {slopes.d_C_1, slopes.d_a1_y, slopes.d_a1_v1, slopes.d_a1_v2,
                                            slopes.d_C_2, slopes.d_a2_y, slopes.d_a2_v1, slopes.d_a2_v2};
        real end[Z_SIZE] = {0.0};
        for (int i = 0; i < Z_SIZE; i++) {
            for (int j = 0; j < Z_SIZE; j++) {
                end[i] += made.phi.at[i][j] * change->at[j][column];
            }
            for (int share = 0; share < SHARES_real; share++) {
                end[i] += made.by_share[share][i] * of_share[share];
            }
        }
        for (int i = 0; i < Z_SIZE; i++) {
            change->at[i][column] = end[i];
        }
    }
}

/* x_1, y, v_1, v_2 per time in the mode and under the current of a phase, at a state. */
static void speeds_real(const hopform_plan_real *plan, const hopform_step_real *steps, const hopform_phase_real *phase,
                        const hopform_state_real *state, real speed[Z_SIZE])
{
    const hopform_motion_real motion = hopform_motion_of_real(plan, state, steps[phase->step].u,
                                                              hopform_side_1_real(phase), hopform_side_2_real(phase));
    speed[Z_ONE] = 0.0;
    speed[Z_X] = state->v1;
    speed[Z_Y] = motion.H3_y;
    speed[Z_V1] = motion.H3_1;
    speed[Z_V2] = motion.H3_2;
}

/* Let a coordinate, which moves at a rate, reach at every change the value that belongs to the event: its time moves.
 */
static void sensitivity_meet_real(changes_real *change, int coordinate, real rate, int bound, const real before[Z_SIZE],
                                  const real after[Z_SIZE])
{
    for (int column = 0; column < COLUMNS_real; column++) {
        const real late = ((column == bound ? 1.0 : 0.0) - change->at[coordinate][column]) / rate;
        for (int i = Z_X; i < Z_SIZE; i++) {
            change->at[i][column] += (before[i] - after[i]) * late;
        }
        if (coordinate == Z_X) {
            change->at[Z_X][column] = (column == bound ? 1.0 : 0.0) - after[Z_X] * late;
            change->at[Z_V1][column] = -after[Z_V1] * late;
        } else {
            change->at[coordinate][column] = -after[coordinate] * late;
        }
    }
}

/* Changes right after the event between two phases; false where the event's time does not move in proportion. */
static bool sensitivity_pass_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                  const hopform_phase_real *old, const hopform_phase_real *now, changes_real *change)
{
    hopform_state_real state = {now->x1, now->v1, now->v2, now->y};
    const int event = now->event;
    real before[Z_SIZE];
    real after[Z_SIZE];
    int coordinate = Z_ONE;
    int bound = COLUMNS_real;
    speeds_real(plan, steps, now, &state, after);
    if (event == HOPFORM_EVENT_X1_HITS_STOP) {
        state.v1 = hopform_state_in_phase_real(plan, old, steps[old->step].u, now->t - old->t).v1;
        coordinate = Z_X;
        bound = hopform_side_1_real(old) > 0 ? BY_x1_max_real : BY_x1_min_real;
    } else if (event == HOPFORM_EVENT_X1_REVERSES || event == HOPFORM_EVENT_X1_STICKS) {
        coordinate = Z_V1;
    } else if (event == HOPFORM_EVENT_X2_REVERSES || event == HOPFORM_EVENT_X2_STICKS) {
        coordinate = Z_V2;
    } else {
        return true; /* nothing jumps where a mass slips or the current steps */
    }
    speeds_real(plan, steps, old, &state, before);
    if (coordinate != Z_X && !(fabs_real(before[coordinate] - after[coordinate]) > 0.0)) {
        return true; /* without friction nothing jumps, however little of a velocity is left */
    }
    if (!(fabs_real(before[coordinate]) > 0.0)) {
        return false;
    }
    sensitivity_meet_real(change, coordinate, before[coordinate], bound, before, after);
    return true;
}

/* The rows of the matrix from the changes at take-off, F = 0. */
static bool finish_real(const hopform_plan_real *plan, const hopform_step_real *steps, const hopform_phase_real *phases,
                        const hopform_phase_real *last, const hopform_stance_real *stance, const changes_real *change,
                        real *matrix)
{
    const hopform_robot_real *robot = &plan->robot;
    const hopform_state_real start = {phases[0].x1, phases[0].v1, phases[0].v2, phases[0].y};
    const real v_up = hopform_greater_real(stance->end.v2, 0.0);
    real speed[Z_SIZE];
    speeds_real(plan, steps, last, &stance->end, speed);
    const hopform_state_real rate = {speed[Z_X], speed[Z_V1], speed[Z_V2], speed[Z_Y]};
    const real contact_rate = hopform_contact_slope_real(robot, &rate);
    const real fall = hopform_fall_of_real(robot);
    const bool underflows = fall > 0.0 && !(fall * fall > 0.0); /* by which the apex's derivative divides */
    if (!(fabs_real(contact_rate) > 0.0) || underflows) {
        return false;
    }
    for (int column = 0; column < COLUMNS_real; column++) {
        const hopform_robot_change_real by = robot_change_real(column);
        const hopform_state_change_real at_rest = {change->at[Z_X][column], change->at[Z_V1][column],
                                                   change->at[Z_V2][column], change->at[Z_Y][column]};
        const real late = -hopform_contact_change_real(robot, &stance->end, &by, &at_rest) / contact_rate;
        const real d_x1 = change->at[Z_X][column] + speed[Z_X] * late;
        const real d_v1 = change->at[Z_V1][column] + speed[Z_V1] * late;
        const real d_v2 = change->at[Z_V2][column] + speed[Z_V2] * late;
        const hopform_state_change_real at_start = {column == BY_X1_real ? 1.0 : 0.0, column == BY_V1_real ? 1.0 : 0.0,
                                                    column == BY_V2_real ? 1.0 : 0.0, column == BY_Y_real ? 1.0 : 0.0};
        const real d_y = HOPFORM_CONTACT_IS_COMPRESSION ? 0.0 : change->at[Z_Y][column] + speed[Z_Y] * late;
        const hopform_state_change_real at_end = {d_x1, d_v1, d_v2, d_y};
        matrix[ROW_T_real * COLUMNS_real + column] = late;
        matrix[ROW_X1_real * COLUMNS_real + column] = d_x1;
        matrix[ROW_V1_real * COLUMNS_real + column] = d_v1;
        matrix[ROW_X2_real * COLUMNS_real + column] = d_x1 - d_y + by.d_L0 + by.d_c;
        matrix[ROW_V2_real * COLUMNS_real + column] = d_v2;
        matrix[ROW_APEX_real * COLUMNS_real + column] =
            fall > 0.0 ? hopform_apex_change_real(robot, v_up, &by, d_x1, d_y, d_v2) : 0.0;
        matrix[ROW_AED_real * COLUMNS_real + column] =
            hopform_body_energy_change_real(robot, &stance->end, &by, &at_end)
            - hopform_body_energy_change_real(robot, &start, &by, &at_start);
    }
    return true;
}

/* Zeros, if the derivatives do not exist or are out of range. */
static int32_t sound_real(bool exists, real *matrix)
{
    for (int n = 0; exists && n < HOPFORM_SENSITIVITY_ROWS * COLUMNS_real; n++) {
        exists = matrix[n] >= -HOPFORM_NEVER_real && matrix[n] <= HOPFORM_NEVER_real;
    }
    for (int n = 0; !exists && n < HOPFORM_SENSITIVITY_ROWS * COLUMNS_real; n++) {
        matrix[n] = 0.0;
    }
    return exists ? HOPFORM_OK : HOPFORM_NO_DERIVATIVE;
}

int32_t hopform_stance_sensitivities_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                          const hopform_phase_real *phases, const hopform_stance_real *stance,
                                          real *matrix)
{
    const hopform_memory_real array =
        hopform_array_real(matrix, HOPFORM_SENSITIVITY_ROWS * COLUMNS_real, sizeof *matrix);
    const int32_t status = hopform_reading_status_real(plan, steps, phases, stance, NULL, &array, 1);
    (void)hopform_refuse_real(status, &array, 1);
    if (status < 0) {
        return status;
    }
    if (stance->ending != HOPFORM_ENDING_TAKEOFF) {
        return HOPFORM_NO_DERIVATIVE;
    }
    changes_real change = sensitivity_start_of_real(&phases[0], stance);
    bool exists = true;
    const hopform_phase_real *last = phases;
    for (int32_t n = 0; exists && n < stance->phases_kept; n++) {
        last = &phases[n];
        const bool more = n + 1 < stance->phases_kept;
        const real end = more ? phases[n + 1].t : stance->duration;
        advance_real(plan, last, steps[last->step].u, end - last->t, &change);
        exists = !more || sensitivity_pass_real(plan, steps, last, &phases[n + 1], &change);
    }
    return sound_real(exists && finish_real(plan, steps, phases, last, stance, &change, matrix), matrix);
}

/* Go from one time in a phase to a later one: the state, and its changes. */
static void travel_real(const hopform_plan_real *plan, const hopform_step_real *steps, hopform_phase_real *place,
                        real t, changes_real *change)
{
    const real u = steps[place->step].u;
    const real h = t - place->t;
    if (h > 0.0 && (hopform_side_1_real(place) != 0 || hopform_side_2_real(place) != 0)) {
        const hopform_state_real state = hopform_state_in_phase_real(plan, place, u, h);
        advance_real(plan, place, u, h, change);
        place->x1 = state.x1;
        place->v1 = state.v1;
        place->v2 = state.v2;
        place->y = state.y;
    }
    place->t = t;
}

int32_t hopform_stance_tangents_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                     const hopform_phase_real *phases, const hopform_stance_real *stance,
                                     const real *times, int32_t count, hopform_state_real *states, real *tangents)
{
    const hopform_memory_real arrays[] = {
        hopform_array_real(states, count, sizeof *states),
        hopform_array_real(tangents, count, HOPFORM_TANGENT_ROWS * COLUMNS_real * sizeof *tangents),
    };
    const hopform_memory_real read_times = hopform_array_real(times, count, sizeof *times);
    const int32_t status = hopform_reading_status_real(plan, steps, phases, stance, &read_times, arrays, 2);
    if (status < 0) {
        return status;
    }
    const bool rests = stance->ending == HOPFORM_ENDING_REST;
    changes_real change = sensitivity_start_of_real(&phases[0], stance);
    hopform_phase_real place = phases[0];
    bool exists = true;
    int32_t n = 0;
    for (int32_t i = 0; i < count; i++) {
        const real t = times[i];
        if (!(t >= 0.0 && t <= HOPFORM_NEVER_real) || (t > stance->duration && !rests) || (i > 0 && t < times[i - 1])) {
            return hopform_refuse_real(HOPFORM_ERROR_TIME, arrays, 2);
        }
        const real within = hopform_lesser_real(t, stance->duration);
        for (; n < stance->phases_kept - 1 && phases[n + 1].t <= within; n++) {
            travel_real(plan, steps, &place, phases[n + 1].t, &change);
            exists = sensitivity_pass_real(plan, steps, &phases[n], &phases[n + 1], &change) && exists;
            place = phases[n + 1];
        }
        travel_real(plan, steps, &place, within, &change);
        states[i] = hopform_start_of_phase_real(&place);
        const int coordinate[HOPFORM_TANGENT_ROWS] = {Z_X, Z_V1, Z_V2, Z_Y};
        for (int row = 0; row < HOPFORM_TANGENT_ROWS; row++) {
            for (int column = 0; column < COLUMNS_real; column++) {
                tangents[(i * HOPFORM_TANGENT_ROWS + row) * COLUMNS_real + column] = change.at[coordinate[row]][column];
            }
        }
    }
    return exists ? HOPFORM_OK : HOPFORM_NO_DERIVATIVE;
}
