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

#define BY_PARAMETER_real(name, domain) BY_##name##_real,
enum {
    BY_X1_real,
    BY_V1_real,
    BY_Y_real,
    BY_V2_real,
    BY_U_real,
    HOPFORM_ROBOT_MEMBERS(BY_PARAMETER_real) COLUMNS_real
};

/* Row and column of each share in M. */
enum { SHARES_real = 8 };
static const int share_row_real[SHARES_real] = {Z_V1, Z_V1, Z_V1, Z_V1, Z_V2, Z_V2, Z_V2, Z_V2};
static const int share_column_real[SHARES_real] = {Z_ONE, Z_Y, Z_V1, Z_V2, Z_ONE, Z_Y, Z_V1, Z_V2};

/* How far a stance has been followed: what is left of a phase, and the change of z where it begins by that of each
 * input. */
typedef struct {
    const hopform_plan_real *plan;
    const hopform_step_real *steps;
    const hopform_phase_real *phases; /* as they were solved */
    int32_t index;                    /* of the one that it is in */
    hopform_phase_real rest;
    real change[COLUMNS_real][Z_SIZE];
    bool exists; /* the time of each event so far moves in proportion */
} variation_real;

/* G of each share over a time h: Gauss's rule over what stands under the integral, whose places are their own mirror.
 */
static void short_responses_real(const hopform_plan_real *plan, const hopform_phase_real *phase, real u, real h,
                                 hopform_matrix_real shares[SHARES_real])
{
    hopform_matrix_real phi[HOPFORM_NODES_real] = {0};
    for (int node = 0; node < HOPFORM_NODES_real; node++) {
        phi[node] = hopform_transition_real(plan, phase, u, hopform_place_real[node] * h);
    }
    for (int share = 0; share < SHARES_real; share++) {
        for (int node = 0; node < HOPFORM_NODES_real; node++) {
            const hopform_matrix_real *rest = &phi[HOPFORM_NODES_real - 1 - node];
            const real *at = phi[node].at[share_column_real[share]];
            for (int i = Z_X; i < Z_SIZE; i++) {
                const real factor = rest->at[i][share_row_real[share]] * (hopform_weight_real[node] * h);
                for (int j = 0; j < Z_SIZE; j++) {
                    shares[share].at[i][j] += factor * at[j];
                }
            }
        }
    }
}

/* Add how z at time t of a phase answers to a change of each share. That of a mass that is held has no answer. */
static void responses_real(const hopform_plan_real *plan, const hopform_phase_real *phase, real u, real t,
                           real by_share[SHARES_real][Z_SIZE])
{
    real h = t;
    int doublings =
        hopform_halve_real(hopform_poles_of_real(plan, hopform_side_1_real(phase), hopform_side_2_real(phase)), &h);
    hopform_matrix_real shares[SHARES_real] = {0};
    short_responses_real(plan, phase, u, h, shares);
    for (; doublings > 0; doublings--) {
        const hopform_matrix_real phi = hopform_transition_real(plan, phase, u, h);
        for (int share = 0; share < SHARES_real; share++) {
            hopform_matrix_real twice = {{{0}}};
            hopform_add_product_real(&twice, &phi, &shares[share]);
            hopform_add_product_real(&twice, &shares[share], &phi);
            shares[share] = twice;
        }
        h *= 2.0;
    }
    const real start[Z_SIZE] = {1.0, 0.0, phase->y, phase->v1, phase->v2};
    for (int share = 0; share < SHARES_real; share++) {
        const int side = share_row_real[share] == Z_V1 ? hopform_side_1_real(phase) : hopform_side_2_real(phase);
        for (int i = 0; i < Z_SIZE; i++) {
            for (int j = 0; side != 0 && j < Z_SIZE; j++) {
                by_share[share][i] += shares[share].at[i][j] * start[j];
            }
        }
    }
}

/* The change of each parameter that a column stands for. */
static hopform_robot_change_real robot_change_real(int column)
{
#define IS_CHANGED(name, domain) column == BY_##name##_real ? 1.0 : 0.0,
    const hopform_robot_change_real change = {HOPFORM_ROBOT_MEMBERS(IS_CHANGED)};
#undef IS_CHANGED
    return change;
}

/* Follow the changes within a phase, up to a time of the stance. */
static void travel_real(variation_real *way, real t)
{
    const hopform_plan_real *plan = way->plan;
    const hopform_phase_real from = way->rest;
    const int side_1 = hopform_side_1_real(&from);
    const int side_2 = hopform_side_2_real(&from);
    const real u = way->steps[from.step].u;
    const real h = t - from.t;
    way->rest.t = t;
    if (!(h > 0.0) || (side_1 == 0 && side_2 == 0)) {
        return;
    }
    real by_share[SHARES_real][Z_SIZE] = {{0}};
    responses_real(plan, &from, u, h, by_share);
    const hopform_matrix_real phi = hopform_transition_real(plan, &from, u, h);
    for (int column = 0; column < COLUMNS_real; column++) {
        const hopform_robot_change_real robot = robot_change_real(column);
        const hopform_slopes_real slopes = hopform_slopes_of_real(&plan->robot, u, (real)side_1, (real)side_2, &robot,
                                                                  column == BY_U_real ? 1.0 : 0.0);
        const real of_share[SHARES_real] = {slopes.d_C_1, slopes.d_a1_y, slopes.d_a1_v1, slopes.d_a1_v2,
                                            slopes.d_C_2, slopes.d_a2_y, slopes.d_a2_v1, slopes.d_a2_v2};
        real end[Z_SIZE] = {0.0};
        for (int i = 0; i < Z_SIZE; i++) {
            for (int j = 0; j < Z_SIZE; j++) {
                end[i] += phi.at[i][j] * way->change[column][j];
            }
            for (int share = 0; share < SHARES_real; share++) {
                end[i] += by_share[share][i] * of_share[share];
            }
        }
        for (int i = 0; i < Z_SIZE; i++) {
            way->change[column][i] = end[i];
        }
    }
    const hopform_state_real state = hopform_state_in_phase_real(plan, &from, u, h);
    way->rest.x1 = state.x1;
    way->rest.v1 = state.v1;
    way->rest.v2 = state.v2;
    way->rest.y = state.y;
}

/* z' in the mode and under the current of a phase, at a state. */
static void speeds_real(const variation_real *way, const hopform_phase_real *phase, const hopform_state_real *state,
                        real speed[Z_SIZE])
{
    const hopform_motion_real motion = hopform_motion_of_real(way->plan, state, way->steps[phase->step].u,
                                                              hopform_side_1_real(phase), hopform_side_2_real(phase));
    speed[Z_ONE] = 0.0;
    speed[Z_X] = state->v1;
    speed[Z_Y] = motion.H3_y;
    speed[Z_V1] = motion.H3_1;
    speed[Z_V2] = motion.H3_2;
}

/* Follow the changes through the event behind a phase. It comes when a coordinate, at every change, has the value that
 * belongs to it; nothing jumps where a mass slips or the current steps. */
static void cross_real(variation_real *way)
{
    const hopform_phase_real *old = &way->phases[way->index];
    const hopform_phase_real *now = &way->phases[way->index + 1];
    hopform_state_real state = hopform_start_of_phase_real(now);
    real before[Z_SIZE];
    real after[Z_SIZE];
    int coordinate = Z_ONE;
    int bound = COLUMNS_real;
    speeds_real(way, now, &state, after);
    if (now->event == HOPFORM_EVENT_X1_HITS_STOP) {
        state.v1 = hopform_state_in_phase_real(way->plan, old, way->steps[old->step].u, now->t - old->t).v1;
        coordinate = Z_X;
        bound = hopform_side_1_real(old) > 0 ? BY_x1_max_real : BY_x1_min_real;
    } else if (now->event == HOPFORM_EVENT_X1_REVERSES || now->event == HOPFORM_EVENT_X1_STICKS) {
        coordinate = Z_V1;
    } else if (now->event == HOPFORM_EVENT_X2_REVERSES || now->event == HOPFORM_EVENT_X2_STICKS) {
        coordinate = Z_V2;
    }
    way->index++;
    way->rest = *now;
    speeds_real(way, old, &state, before);
    /* without friction nothing jumps, however little of a velocity is left */
    if (coordinate == Z_ONE || (coordinate != Z_X && !(fabs_real(before[coordinate] - after[coordinate]) > 0.0))) {
        return;
    }
    if (!(fabs_real(before[coordinate]) > 0.0)) {
        way->exists = false;
        return;
    }
    for (int column = 0; column < COLUMNS_real; column++) {
        real *change = way->change[column];
        const real wanted = column == bound ? 1.0 : 0.0;
        const real late = (wanted - change[coordinate]) / before[coordinate];
        for (int i = Z_X; i < Z_SIZE; i++) {
            change[i] += (before[i] - after[i]) * late;
        }
        if (coordinate == Z_X) {
            change[Z_X] = wanted;
            change[Z_V1] = -after[Z_V1] * late;
        } else {
            change[coordinate] = -after[coordinate] * late;
        }
    }
}

/* A stance from its start on: no velocity is left of a mass that is held, or that a stop took at once. */
static variation_real variation_of_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                        const hopform_phase_real *phases, const hopform_stance_real *stance)
{
    variation_real way = {plan, steps, phases, 0, *phases, {{0}}, true};
    way.change[BY_X1_real][Z_X] = 1.0;
    way.change[BY_Y_real][Z_Y] = 1.0;
    way.change[BY_V1_real][Z_V1] = hopform_side_1_real(phases) != 0 && !(stance->start_loss < 0.0) ? 1.0 : 0.0;
    way.change[BY_V2_real][Z_V2] = hopform_side_2_real(phases) != 0 ? 1.0 : 0.0;
    return way;
}

/* Follow a stance up to a time; `last` is the index of its last phase. */
static void follow_to_real(variation_real *way, int32_t last, real t)
{
    while (way->index < last && way->phases[way->index + 1].t <= t) {
        travel_real(way, way->phases[way->index + 1].t);
        cross_real(way);
    }
    travel_real(way, t);
}

/* The rows of the matrix from the changes at take-off, F = 0. */
static bool finish_real(variation_real *way, const hopform_state_real *start, const hopform_state_real *end,
                        real *matrix)
{
    const hopform_robot_real *robot = &way->plan->robot;
    real speed[Z_SIZE];
    speeds_real(way, &way->phases[way->index], end, speed);
    const hopform_state_real rate = {speed[Z_X], speed[Z_V1], speed[Z_V2], speed[Z_Y]};
    const real contact_rate = hopform_contact_slope_real(robot, &rate);
    const real fall = hopform_fall_of_real(robot);
    const bool underflows = fall > 0.0 && !(fall * fall > 0.0); /* by which the apex's derivative divides */
    if (!(fabs_real(contact_rate) > 0.0) || underflows) {
        return false;
    }
    for (int column = 0; column < COLUMNS_real; column++) {
        real *z = way->change[column];
        const hopform_robot_change_real by = robot_change_real(column);
        const hopform_state_change_real at_start = {column == BY_X1_real ? 1.0 : 0.0, column == BY_V1_real ? 1.0 : 0.0,
                                                    column == BY_V2_real ? 1.0 : 0.0, column == BY_Y_real ? 1.0 : 0.0};
        const hopform_state_change_real at_rest = {z[Z_X], z[Z_V1], z[Z_V2], z[Z_Y]};
        const real late = -hopform_contact_change_real(robot, end, &by, &at_rest) / contact_rate;
        for (int i = Z_X; i < Z_SIZE; i++) {
            z[i] += speed[i] * late;
        }
        z[Z_Y] = HOPFORM_CONTACT_IS_COMPRESSION ? 0.0 : z[Z_Y];
        const hopform_state_change_real at_end = {z[Z_X], z[Z_V1], z[Z_V2], z[Z_Y]};
        const real rows[HOPFORM_SENSITIVITY_ROWS] = {
            late,
            z[Z_X],
            z[Z_V1],
            z[Z_X] - z[Z_Y] + by.d_L0 + by.d_c,
            z[Z_V2],
            fall > 0.0 ? hopform_apex_change_real(robot, hopform_greater_real(end->v2, 0.0), &by, &at_end) : 0.0,
            hopform_body_energy_change_real(robot, end, &by, &at_end)
                - hopform_body_energy_change_real(robot, start, &by, &at_start)};
        for (int row = 0; row < HOPFORM_SENSITIVITY_ROWS; row++) {
            matrix[row * COLUMNS_real + column] = rows[row];
        }
    }
    return true;
}

int32_t hopform_stance_sensitivities_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                          const hopform_phase_real *phases, const hopform_stance_real *stance,
                                          real *matrix)
{
    const int32_t count = HOPFORM_SENSITIVITY_ROWS * COLUMNS_real;
    const hopform_memory_real array = hopform_array_real(matrix, count, sizeof *matrix);
    const int32_t status = hopform_reading_status_real(plan, steps, phases, stance, NULL, &array, 1);
    if (status < 0) {
        return status;
    }
    const hopform_state_real start = hopform_start_of_phase_real(phases);
    bool exists = stance->ending == HOPFORM_ENDING_TAKEOFF;
    if (exists) {
        variation_real way = variation_of_real(plan, steps, phases, stance);
        follow_to_real(&way, stance->phases_kept - 1, stance->duration);
        exists = way.exists && finish_real(&way, &start, &stance->end, matrix);
    }
    for (int32_t n = 0; exists && n < count; n++) {
        exists = matrix[n] >= -HOPFORM_NEVER_real && matrix[n] <= HOPFORM_NEVER_real;
    }
    return exists ? HOPFORM_OK : hopform_refuse_real(HOPFORM_NO_DERIVATIVE, &array, 1);
}

int32_t hopform_stance_tangents_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                     const hopform_phase_real *phases, const hopform_stance_real *stance,
                                     const real *times, int32_t count, hopform_state_real *states, real *tangents)
{
    const hopform_memory_real arrays[] = {
        hopform_array_real(states, count, sizeof *states),
        hopform_array_real(tangents, count, HOPFORM_TANGENT_ROWS * COLUMNS_real * sizeof *tangents),
    };
    const hopform_times_real when = {times, count, true};
    const int32_t status = hopform_reading_status_real(plan, steps, phases, stance, &when, arrays, 2);
    if (status < 0) {
        return status;
    }
    static const int coordinate[HOPFORM_TANGENT_ROWS] = {Z_X, Z_V1, Z_V2, Z_Y};
    variation_real way = variation_of_real(plan, steps, phases, stance);
    for (int32_t i = 0; i < count; i++) {
        follow_to_real(&way, stance->phases_kept - 1, hopform_lesser_real(times[i], stance->duration));
        states[i] = hopform_start_of_phase_real(&way.rest);
        for (int row = 0; row < HOPFORM_TANGENT_ROWS; row++) {
            for (int column = 0; column < COLUMNS_real; column++) {
                tangents[(i * HOPFORM_TANGENT_ROWS + row) * COLUMNS_real + column] =
                    way.change[column][coordinate[row]];
            }
        }
    }
    return way.exists ? HOPFORM_OK : HOPFORM_NO_DERIVATIVE;
}
