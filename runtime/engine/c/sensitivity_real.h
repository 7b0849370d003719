/* SPDX-License-Identifier: MIT-0
 *
 * How a stance depends on its inputs, through its events. Within a phase z' = M z, so a change d_p of an input changes
 * z by
 *
 *     d_z(h) = Phi(h) d_z(0) + sum d_M_rc (Phi_r * z_c)(h),      (f * g)(h) = integral of f(h - s) g(s), 0 <= s <= h
 *
 * over the entries of M that an input changes: the rows r of the equations of motion, and of a gear's ratio. Phi_r is
 * N(s)/P(s) and z_c is K(s)/(s P(s)), so that their convolution is N(s) K(s)/s over P(s)^2, the powers of s being
 * derivatives of W * W.
 *
 * An event at tau, which moves by d_tau, adds (z' before it - z' after it) d_tau, on top of what it does to the state.
 */
#ifndef HOPFORM_SENSITIVITY_H_real
#define HOPFORM_SENSITIVITY_H_real

#include <stdbool.h>
#include <string.h>

#include "linear_real.h"
#include "reading_real.h"

enum {
    COLUMNS_real = HOPFORM_SENSITIVITY_COLUMNS,
    ROBOT_real = HOPFORM_COLUMN_OF_ROBOT,
    CONVOLUTIONS_real = 7,
    SHARES_real = CORE_real + 1
};

static const signed char column_of_axis_real[HOPFORM_AXES] = HOPFORM_COLUMN_OF_AXIS;

/* How far a stance has been followed: where it is, and the change of that by the one of each input. */
typedef struct {
    const hopform_plan_real *plan;
    const hopform_step_real *steps;
    const hopform_phase_real *phases;
    int32_t index; /* of the phase that it is in */
    real t;        /* since the start */
    state_by_axis_real at;
    state_by_axis_real change[COLUMNS_real];
    real late[COLUMNS_real]; /* how much later the event came that began the phase; 0 where its time is fixed */
    bool is_timed;           /* these are known: a velocity that fades to nothing has no time in proportion */
    bool exists;             /* the time of each event so far moves in proportion */
} variation_real;

static real current_real(const variation_real *variation, const hopform_phase_real *phase) {
    return input_of_phase_real(variation->plan, variation->steps, phase);
}

/* ---- W * W: its derivatives from the fourth down, itself, and two integrals ---- */

/* Over a short time, by Gauss's rule, whose places are their own mirror: each is W with n primes times W with as many
 * or one less. */
static void short_self_convolution_real(const hopform_poles_real *poles, real h,
                                        real self_convolution[CONVOLUTIONS_real]) {
    basis_by_order_real W[HOPFORM_NODES_real];
    for (int node = 0; node < HOPFORM_NODES_real; node++) {
        W[node].named = basis_at_real(poles, place_real[node] * h);
    }
    for (int n = 0; n < CONVOLUTIONS_real; n++) {
        self_convolution[n] = 0.0;
        for (int node = 0; node < HOPFORM_NODES_real; node++) {
            const basis_by_order_real *mirrored = &W[HOPFORM_NODES_real - 1 - node];
            self_convolution[n] += weight_real[node] * h * W[node].of[n / 2] * mirrored->of[(n + 1) / 2];
        }
    }
}

/* Over twice the time h at which W is: integrals over one half of it each. For i up to 2, the (2 - i)-th derivative of
 * W at h + s is row i of `later` times (W'', W', W) at s, in which nothing cancels; its integral, that of W at h and
 * row 2 times (W', W, its integral). */
static void double_self_convolution_real(const hopform_poles_real *poles, const real W[ORDERS_real],
                                         real self_convolution[CONVOLUTIONS_real]) {
    const real later[POWERS_real][POWERS_real] = {
        {W[0], -poles->s_2 * W[1] - poles->s_3 * W[2], -poles->s_3 * W[1]},
        {W[1], W[0] + poles->s_1 * W[1], -poles->s_3 * W[2]},
        {W[2], W[1] + poles->s_1 * W[2], W[0] + poles->s_1 * W[1] + poles->s_2 * W[2]},
    };
    real doubled[CONVOLUTIONS_real];
    for (int n = 0; n < CONVOLUTIONS_real; n++) {
        const int order[2] = {n / 2, (n + 1) / 2};
        doubled[n] = 0.0;
        for (int half = 0; half < 2; half++) {
            const int i = order[half];
            const int j = order[1 - half];
            doubled[n] += i < POWERS_real ? applied_real(later[i], self_convolution + j)
                                          : applied_real(later[2], self_convolution + j + 1) + W[3] * W[j + 1];
        }
    }
    (void)memcpy(self_convolution, doubled, sizeof doubled);
}

/* ---- within a phase ---- */

/* How the axes at h answer to a change of each entry in the rows of the masses; those of one that is held to none. */
static void responses_real(const mode_real *mode, const real z[HOPFORM_AXES], real h, const real *W,
                           real response[HOPFORM_CHANGED_ROWS][SHARES_real][HOPFORM_AXES]) {
    real short_time = h;
    real self_convolution[CONVOLUTIONS_real];
    const int doublings = halve_real(mode->poles, &short_time);
    short_self_convolution_real(mode->poles, short_time, self_convolution);
    for (int n = 0; n < doublings; n++) {
        const basis_by_order_real at = response_in_mode_real(mode, short_time);
        double_self_convolution_real(mode->poles, at.of, self_convolution);
        short_time *= 2.0;
    }
    for (int c = 0; c < SHARES_real; c++) {
        real applied[POWERS_real + 1]; /* K(s)/s times the powers of s, over P(s) or, for z_c = 1, none of it */
        (void)memcpy(applied, W + 1, sizeof applied);
        if (c < CORE_real) {
            real K[POWERS_real + 1] = {0.0};
            for (int n = 0; n < POWERS_real; n++) {
                for (int j = 0; j < CORE_real; j++) {
                    K[n] += mode->transfer.at[c][j][n] * z[j + 1];
                }
                K[n + 1] += mode->transfer.at[c][CORE_real][n];
            }
            for (int n = 0; n <= POWERS_real; n++) {
                applied[n] = applied_real(K, self_convolution + n) + K[3] * self_convolution[n + 3];
            }
        }
        for (int row = 0; row < HOPFORM_CHANGED_ROWS; row++) {
            const bool moves = row >= HOPFORM_ELEMENTS || side_of_mode_real(mode->row, row) != 0;
            for (int i = 0; i < HOPFORM_AXES; i++) {
                const real *powers = mode->transfer.at[i > 0 ? i - 1 : 0][row];
                response[row][c][i] = moves ? applied_real(powers, i > 0 ? applied : applied + 1) : 0.0;
            }
        }
    }
}

/* The change of each parameter of the robot that a column stands for. */
static robot_change_real robot_change_of_column_real(int column) {
    robot_change_by_field_real change = {{0}};
    if (column >= ROBOT_real) { change.of[column - ROBOT_real] = 1.0; }
    return change.named;
}

/* How a stop moves with what a column stands for. */
static real stop_change_real(const hopform_plan_real *plan, int column, bool upper) {
    const robot_change_real by = robot_change_of_column_real(column);
    return upper ? upper_stop_change_real(&plan->robot, &by) : lower_stop_change_real(&plan->robot, &by);
}

/* How the accelerations of a mode change with the inputs of a column, by what their shares go with. */
static slopes_by_share_real slopes_of_column_real(const variation_real *variation, const mode_real *mode, int column) {
    const hopform_phase_real *phase = &variation->phases[variation->index];
    const robot_change_real robot = robot_change_of_column_real(column);
    const int limit = limit_of_mode_real(mode->row);
    real input = column == HOPFORM_COLUMN_OF_INPUT ? 1.0 : 0.0;
    if (limit != 0) { input = input_at_limit_change_real(&variation->plan->robot, (real)limit, &robot, input); }
    slopes_by_share_real slopes;
    slopes.named =
        slopes_of_real(&variation->plan->robot, current_real(variation, phase), (real)side_of_mode_real(mode->row, 0),
                       (real)side_of_mode_real(mode->row, 1), (real)limit, &robot, input);
    return slopes;
}

/* Follow the changes within a phase, up to a time of the stance. */
static void travel_real(variation_real *variation, real t) {
    const hopform_plan_real *plan = variation->plan;
    const hopform_phase_real *phase = &variation->phases[variation->index];
    const real u = current_real(variation, phase);
    const mode_real mode = mode_of_real(plan, phase, u);
    const real h = t - variation->t;
    variation->t = t;
    if (!(h > 0.0) || rests_real(&mode)) { return; }
    real answer[HOPFORM_CHANGED_ROWS][SHARES_real][HOPFORM_AXES];
    const basis_by_order_real response = response_in_mode_real(&mode, h);
    responses_real(&mode, variation->at.of, h, response.of, answer);
    const matrix_real phi = transition_real(&mode, response.of);
    for (int column = 0; column < COLUMNS_real; column++) {
        const slopes_by_share_real slopes = slopes_of_column_real(variation, &mode, column);
        state_by_axis_real end = {{0.0, 0.0, 0.0, 0.0}};
        for (int i = 0; i < HOPFORM_AXES; i++) {
            for (int j = 0; j < HOPFORM_AXES; j++) {
                end.of[i] += phi.at[i][j] * variation->change[column].of[j];
            }
        }
        for (int n = 0; n < HOPFORM_CHANGED_ROWS * SHARES_real; n++) {
            for (int i = 0; i < HOPFORM_AXES && fabs_real(slopes.of[n]) > 0.0; i++) {
                end.of[i] += answer[n / SHARES_real][n % SHARES_real][i] * slopes.of[n];
            }
        }
        variation->change[column] = end;
    }
    variation->at.named = state_in_phase_real(plan, phase, u, t - phase->t);
}

/* ---- through the events ---- */

static void not_late_real(variation_real *variation) {
    for (int column = 0; column < COLUMNS_real; column++) {
        variation->late[column] = 0.0;
    }
}

/* How the acceleration of an element in a mode changes with the inputs of a column, at a state that does not. */
static real direct_slope_real(const variation_real *variation, const mode_real *mode, int element, int column) {
    const slopes_by_share_real slopes = slopes_of_column_real(variation, mode, column);
    const real *shares = slopes.of + element * SHARES_real;
    real slope = shares[CORE_real];
    for (int c = 0; c < CORE_real; c++) {
        slope += shares[c] * variation->at.of[c + 1];
    }
    return slope;
}

/* Follow the changes through the slip of an element, with which the phase begins that `variation` is in. Its free
 * acceleration has reached the friction at rest, so it starts with the excess of that. A current that steps lets it go
 * at a fixed time; without excess its velocity does not jump, whenever it slips. */
static void cross_slip_real(variation_real *variation, int element, const mode_real *entered,
                            const state_by_axis_real *before) {
    const hopform_plan_real *plan = variation->plan;
    const hopform_phase_real *now = &variation->phases[variation->index];
    const int side = side_of_mode_real(entered->row, element);
    const real acceleration = (real)side * excess_to_side_real(&plan->robot, element, side);
    const bool at_step = now->step > 0 && !(now->t > variation->steps[now->step].t);
    if (at_step || !(fabs_real(acceleration) > 0.0)) { return; }
    const hopform_rates_real *rates = entered->rates;
    const real rate = free_slope_real(rates, element, before);
    variation->exists = variation->exists && fabs_real(rate) > 0.0;
    for (int column = 0; column < COLUMNS_real && variation->exists; column++) {
        const robot_change_real robot = robot_change_of_column_real(column);
        excess_by_side_real excess;
        excess.named = excess_change_real(&plan->robot, &robot);
        const real at_rest = (real)side * excess.of[side_index_real(element, side)];
        const real early = free_slope_real(rates, element, &variation->change[column])
                           + direct_slope_real(variation, entered, element, column) - at_rest;
        const real late = -early / rate;
        pass_slip_real(variation->change[column].of, element, acceleration, late);
        variation->late[column] = late;
    }
}

/* Follow the changes through the event behind a phase. It comes when an axis, at every change, has the value that
 * belongs to it; nothing jumps where the current steps. */
static void cross_real(variation_real *variation) {
    const hopform_phase_real *old = &variation->phases[variation->index];
    const hopform_phase_real *now = old + 1;
    const mode_real left = mode_of_real(variation->plan, old, current_real(variation, old));
    const mode_real entered = mode_of_real(variation->plan, now, current_real(variation, now));
    const int axis = axis_of_event_real(now->event);
    const bool stops = axis == HOPFORM_POSITION_AXIS;
    const int velocity = HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT);
    const bool upper = side_of_mode_real(left.row, HOPFORM_STOPPED_ELEMENT) > 0;
    state_by_axis_real arrives;
    arrives.named = start_of_phase_real(now);
    const state_by_axis_real after = speeds_in_mode_real(&entered, &arrives.named);
    const state_by_axis_real start = arrives;
    arrives.of[velocity] = stops ? variation->at.of[velocity] : arrives.of[velocity];
    const state_by_axis_real before = speeds_in_mode_real(&left, &arrives.named);
    variation->index++;
    variation->t = now->t;
    variation->at = start;
    variation->is_timed = axis < 0;
    not_late_real(variation);
    const int slips = slips_at_event_real(now->event);
    if (slips >= 0) { cross_slip_real(variation, slips, &entered, &before); }
    /* without friction nothing jumps, however little of a velocity is left */
    if (axis < 0 || (!stops && !(fabs_real(before.of[axis] - after.of[axis]) > 0.0))) { return; }
    variation->exists = variation->exists && fabs_real(before.of[axis]) > 0.0;
    variation->is_timed = variation->exists;
    for (int column = 0; column < COLUMNS_real && variation->exists; column++) {
        real *change = variation->change[column].of;
        const real wanted = stops ? stop_change_real(variation->plan, column, upper) : 0.0;
        const real late = (wanted - change[axis]) / before.of[axis];
        pass_event_at_axis_real(change, before.of, after.of, axis, wanted, late);
        variation->late[column] = late;
    }
}

/* A stance from its start on: no velocity is left of a mass that is held, unless it ends at once, or that a stop took
 * at once. */
static variation_real variation_of_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                        const hopform_phase_real *phases, const hopform_stance_real *stance) {
    variation_real variation = {
        plan, steps, phases, 0, 0.0, {{0.0, 0.0, 0.0, 0.0}}, {{{0.0, 0.0, 0.0, 0.0}}}, {0.0}, true, true,
    };
    const mode_real mode = mode_of_real(plan, phases, current_real(&variation, phases));
    const bool goes_on = !is_left_real(stance) || stance->duration > 0.0;
    variation.at.named = start_of_phase_real(phases);
    for (int i = 0; i < HOPFORM_AXES; i++) {
        variation.change[column_of_axis_real[i]].of[i] = 1.0;
    }
    for (int element = 0; element < HOPFORM_ELEMENTS; element++) {
        const int axis = HOPFORM_VELOCITY_AXIS(element);
        if ((goes_on && side_of_mode_real(mode.row, element) == 0) || HOPFORM_NEVER_MOVES(element)
            || (element == HOPFORM_STOPPED_ELEMENT && stance->start_loss < 0.0)) {
            variation.change[column_of_axis_real[axis]].of[axis] = 0.0;
        }
    }
    return variation;
}

/* Follow a stance up to a time; `last` is the index of its last phase. */
static void follow_to_real(variation_real *variation, int32_t last, real t) {
    while (variation->index < last && variation->phases[variation->index + 1].t <= t) {
        travel_real(variation, variation->phases[variation->index + 1].t);
        cross_real(variation);
    }
    travel_real(variation, t);
}

/* Whether an element that is held at rest stays so at every small change of the inputs: its free acceleration is within
 * its friction at rest, or a stop carries it, or it never moves. */
static bool stays_held_real(const variation_real *variation, int element) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const hopform_phase_real *phase = &variation->phases[variation->index];
    const state_by_axis_real *at = &variation->at;
    free_by_element_real free;
    const hopform_rates_real *rates = rates_in_mode_real(variation->plan, mode_of_phase_real(phase));
    free.named = free_accelerations_real(rates, &at->named, current_real(variation, phase));
    const real downwards = -level_at_rest_real(robot, element, -1);
    const real upwards = level_at_rest_real(robot, element, 1);
    const bool never_moves = HOPFORM_NEVER_MOVES(element);
    const bool has_stops = element == HOPFORM_STOPPED_ELEMENT;
    const bool below = never_moves || (has_stops && at->of[HOPFORM_POSITION_AXIS] <= lower_stop_real(robot));
    const bool above = never_moves || (has_stops && at->of[HOPFORM_POSITION_AXIS] >= upper_stop_real(robot));
    return (below || free.of[element] > downwards) && (above || free.of[element] < upwards);
}

/* How much later the ending comes, from what ended the stance and what changes there; false where it is not in
 * proportion. It comes with the event that the last phase began with, at its time already, as long as what is held then
 * stays so; with a root of the contact force, whose rate is `speed`'s; at the horizon; or nothing is to be followed. */
static bool ends_later_real(variation_real *variation, const hopform_stance_real *stance,
                            const hopform_state_real *speed) {
    const int ended_by = ended_by_real(variation->plan, variation->phases, stance);
    if (ended_by == ENDED_BY_EVENT_real) {
        const bool rests = stance->ending == HOPFORM_ENDING_REST;
        return variation->is_timed && (!rests || (stays_held_real(variation, 0) && stays_held_real(variation, 1)));
    }
    if (ended_by == ENDED_BY_HORIZON_real) {
        not_late_real(variation);
        return true;
    }
#if HOPFORM_HAS_CONTACT
    const hopform_robot_real *robot = &variation->plan->robot;
    const real contact_rate = contact_slope_real(robot, speed);
    if (ended_by != ENDED_BY_ROOT_real || !(fabs_real(contact_rate) > 0.0)) { return false; }
    for (int column = 0; column < COLUMNS_real; column++) {
        const robot_change_real by = robot_change_of_column_real(column);
        const hopform_state_real *end = &stance->end;
        variation->late[column] =
            -contact_change_real(robot, end, &by, &variation->change[column].change) / contact_rate;
    }
    return true;
#else
    (void)speed;
    return false;
#endif
}

#if HOPFORM_HAS_CONTACT
/* The rows of the apex, 0 without take-off, and of the AED; false where the apex has no derivative in range. */
static bool put_rows_of_contact_real(const variation_real *variation, const hopform_stance_real *stance, int column,
                                     const state_by_axis_real *change, real *matrix) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const hopform_state_real start = start_of_phase_real(variation->phases);
    const hopform_state_real *end = &stance->end;
    const real fall = is_left_real(stance) ? fall_of_real(robot) : 0.0;
    if (fall > 0.0 && !(fall * fall > 0.0)) { return false; } /* by which the apex's derivative divides */
    const robot_change_real by = robot_change_of_column_real(column);
    state_by_axis_real unit;
    for (int i = 0; i < HOPFORM_AXES; i++) {
        unit.of[i] = column == column_of_axis_real[i] ? 1.0 : 0.0;
    }
    matrix[5 * COLUMNS_real + column] = fall > 0.0 ? apex_change_real(robot, end, &by, &change->change) : 0.0;
    matrix[6 * COLUMNS_real + column] = body_energy_change_real(robot, end, &by, &change->change)
                                        - body_energy_change_real(robot, &start, &by, &unit.change);
    return true;
}
#endif

/* The rows of the matrix from the changes at the ending. */
static bool finish_real(variation_real *variation, const hopform_stance_real *stance, real *matrix) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const hopform_phase_real *phase = &variation->phases[variation->index];
    const mode_real mode = mode_of_real(variation->plan, phase, current_real(variation, phase));
    const state_by_axis_real speed = speeds_in_mode_real(&mode, &stance->end);
    bool exists = ends_later_real(variation, stance, &speed.named);
    for (int column = 0; exists && column < COLUMNS_real; column++) {
        state_by_axis_real *change = &variation->change[column];
        const robot_change_real by = robot_change_of_column_real(column);
        const real late = variation->late[column];
        for (int i = 0; i < HOPFORM_AXES; i++) {
            change->of[i] += speed.of[i] * late;
        }
#if HOPFORM_HAS_CONTACT
        if (is_left_real(stance) && HOPFORM_CONTACT_IS_STRETCH) { change->of[HOPFORM_STRETCH_AXIS] = 0.0; }
        exists = put_rows_of_contact_real(variation, stance, column, change, matrix);
#endif
        const real rows[] = {late, change->of[0], change->of[1],
                             height_change_real(robot, &stance->end, &by, &change->change), change->of[2]};
        for (int row = 0; row < (int)(sizeof rows / sizeof rows[0]); row++) {
            matrix[row * COLUMNS_real + column] = rows[row];
        }
    }
    return exists;
}

/* Derivatives of a solved stance at its ending, through its events: HOPFORM_SENSITIVITY_ROWS times
 * HOPFORM_SENSITIVITY_COLUMNS numbers, row by row; zeros if there are none (positive status), as where an event grazes,
 * or a search has ended. Row T is 0 at a horizon; at rest it is that of the event that stopped the last mass. With a
 * contact it is also that of the stop where the contact force jumped below 0; one that pulls from the start ends as it
 * starts: T stays 0, the state moves with the start; and a row that only a rise has is 0 without one.
 *
 * Column y holds the others' at a fixed stretch. Column u moves every step's input alike. The velocity of a mass at
 * rest that is held stays 0, but where a contact is lost at once. Mass 1, if it starts on a stop, stays where it starts
 * until it departs; the ends of its stroke count where a stop is met later.
 */
int32_t hopform_stance_sensitivities_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                          const hopform_phase_real *phases, const hopform_stance_real *stance,
                                          real *matrix) {
    const int32_t count = HOPFORM_SENSITIVITY_ROWS * COLUMNS_real;
    const memory_real array = array_real(matrix, count, sizeof *matrix);
    const int32_t status = reading_status_real(plan, steps, phases, stance, NULL, &array, 1);
    if (status < 0) { return status; }
    variation_real variation = variation_of_real(plan, steps, phases, stance);
    follow_to_real(&variation, stance->phases_kept - 1, stance->duration);
    bool exists = variation.exists && finish_real(&variation, stance, matrix);
    for (int32_t n = 0; exists && n < count; n++) {
        exists = matrix[n] >= -HOPFORM_NEVER_real && matrix[n] <= HOPFORM_NEVER_real;
    }
    return exists ? HOPFORM_OK : refuse_real(HOPFORM_NO_DERIVATIVE, &array, 1, NULL, 0);
}

/* States of a solved stance at `count` times, which must not decrease, and their derivatives through the events before
 * them: HOPFORM_TANGENT_ROWS times HOPFORM_SENSITIVITY_COLUMNS numbers a time, rows x1, v1, v2, y, columns as in
 * hopform_stance_sensitivities. Where an event grazes (HOPFORM_NO_DERIVATIVE) they are those of a motion that does not
 * notice it.
 */
int32_t hopform_stance_tangents_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                     const hopform_phase_real *phases, const hopform_stance_real *stance,
                                     const real *times, int32_t count, hopform_state_real *states, real *tangents) {
    const memory_real arrays[2] = {
        array_real(states, count, sizeof *states),
        array_real(tangents, count, HOPFORM_TANGENT_ROWS * COLUMNS_real * sizeof *tangents),
    };
    const times_real when = {times, count, true};
    const int32_t status = reading_status_real(plan, steps, phases, stance, &when, arrays, 2);
    if (status < 0) { return status; }
    variation_real variation = variation_of_real(plan, steps, phases, stance);
    for (int32_t i = 0; i < count; i++) {
        follow_to_real(&variation, stance->phases_kept - 1, lesser_real(times[i], stance->duration));
        states[i] = variation.at.named;
        for (int row = 0; row < HOPFORM_TANGENT_ROWS; row++) {
            for (int column = 0; column < COLUMNS_real; column++) {
                tangents[(i * HOPFORM_TANGENT_ROWS + row) * COLUMNS_real + column] = variation.change[column].of[row];
            }
        }
    }
    return variation.exists ? HOPFORM_OK : HOPFORM_NO_DERIVATIVE;
}

#endif
