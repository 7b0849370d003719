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

enum { ROBOT_real = HOPFORM_COLUMN_OF_ROBOT, CONVOLUTIONS_real = 7, SHARES_real = CORE_real + 1 };

static const signed char column_of_axis_real[HOPFORM_AXES] = HOPFORM_COLUMN_OF_AXIS;

/* How far a stance has been followed: where it is, and the change of that by the one of each chosen input. */
typedef struct {
    const hopform_plan_real *plan;
    const hopform_step_real *steps;
    const hopform_phase_real *phases;
    int32_t index; /* of the phase that it is in */
    real t;        /* since the start */
    mode_real mode;
    state_by_axis_real at;
    chosen_real chosen;
    real *change;  /* the caller's: a row for each axis, in it a number for each column */
    real *late;    /* how much later the event came that began the phase, 0 where its time is fixed; or NULL */
    bool is_timed; /* these are known: a velocity that fades to nothing has no time in proportion */
    bool exists;   /* the time of each event so far moves in proportion */
    bool holds;    /* what rested so far for a while stays so at every small change */
} variation_real;

static inline int32_t code_at_real(const variation_real *variation, int32_t column) {
    return code_of_real(&variation->chosen, column);
}

static inline state_by_axis_real change_of_column_real(const variation_real *variation, int32_t column) {
    state_by_axis_real change = {{0.0, 0.0, 0.0, 0.0}};
    UNROLLED_real for (int i = 0; i < HOPFORM_AXES; i++) {
        change.of[i] = variation->change[(ptrdiff_t)i * variation->chosen.count + column];
    }
    return change;
}

static inline void put_change_real(const variation_real *variation, int32_t column, const state_by_axis_real *change) {
    UNROLLED_real for (int i = 0; i < HOPFORM_AXES; i++) {
        variation->change[(ptrdiff_t)i * variation->chosen.count + column] = change->of[i];
    }
}

static inline void put_late_real(const variation_real *variation, int32_t column, real late) {
    if (variation->late != NULL) { variation->late[column] = late; }
}

static real current_real(const variation_real *variation, const hopform_phase_real *phase) {
    return input_of_phase_real(variation->plan, variation->steps, phase);
}

/* ---- W * W: its derivatives from the fourth down, itself, and two integrals ---- */

static const real factorial_real[HOPFORM_SQUARES_real + 2] = {HOPFORM_FACTORIALS_real};

/* Terms of the power series of W and of W * W, but for factorials: powers of 1/s in 1/P and in 1/P^2. */
typedef struct {
    real of_W[3], of_square[3];
} square_terms_real;

static inline void next_square_terms_real(square_terms_real *terms, real S_1, real S_2, real S_3) {
    UNROLLED_real for (int n = 0; n < 3; n++) { /* each in place of the oldest */
        const int second = (n + 1) % 3, first = (n + 2) % 3;
        terms->of_W[n] = S_1 * terms->of_W[first] + S_2 * terms->of_W[second] + S_3 * terms->of_W[n];
        terms->of_square[n] =
            terms->of_W[n] + S_1 * terms->of_square[first] + S_2 * terms->of_square[second] + S_3 * terms->of_square[n];
    }
}

/* Over a time that is short for all poles: the series of itself and of its integrals; its derivatives by P(s)/P(s)^2 =
 * 1/P(s), which cancels nothing there. */
static void short_self_convolution_real(const hopform_poles_real *poles, real h, const real W[ORDERS_real],
                                        real self_convolution[CONVOLUTIONS_real]) {
    const real hh = h * h;
    const real S_1 = -(poles->s_1 * h);
    const real S_2 = -(poles->s_2 * hh);
    const real S_3 = -(poles->s_3 * (hh * h));
    square_terms_real terms = {{0.0, 0.0, 1.0}, {0.0, 0.0, 1.0}};
    real sum[3] = {factorial_real[0], factorial_real[1], factorial_real[2]};
    for (int n = 1; n < HOPFORM_SQUARES_real; n += 3) {
        next_square_terms_real(&terms, S_1, S_2, S_3);
        UNROLLED_real for (int i = 0; i < 3; i++) {
            const real *by = &factorial_real[n + i];
            sum[0] += terms.of_square[i] * by[0];
            sum[1] += terms.of_square[i] * by[1];
            sum[2] += terms.of_square[i] * by[2];
        }
        const real left = fabs_real(terms.of_square[0]) + fabs_real(terms.of_square[1]) + fabs_real(terms.of_square[2]);
        if (left * factorial_real[n + 2] < 2e-5 * HOPFORM_EPS_real) { break; }
    }
    real *V = self_convolution;
    V[4] = sum[0] * (hh * hh * h);
    V[5] = sum[1] * (hh * hh * hh);
    V[6] = sum[2] * (hh * hh * hh * h);
    for (int n = 3; n >= 0; n--) {
        V[n] = W[n + 1] - (poles->s_1 * V[n + 1] + poles->s_2 * V[n + 2] + poles->s_3 * V[n + 3]);
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

/* W * W at h, at which W is. */
static void self_convolution_real(const mode_real *mode, real h, const real W[ORDERS_real],
                                  real self_convolution[CONVOLUTIONS_real]) {
    real short_time = h;
    const int doublings = halve_real(mode->poles, &short_time);
    basis_by_order_real at = {{W[0], W[1], W[2], W[3], W[4]}};
    if (doublings > 0) { at = response_in_mode_real(mode, short_time); }
    short_self_convolution_real(mode->poles, short_time, at.of, self_convolution);
    for (int n = 0; n < doublings; n++) {
        double_self_convolution_real(mode->poles, at.of, self_convolution);
        short_time *= 2.0;
        if (n + 1 < doublings) { at = response_in_mode_real(mode, short_time); }
    }
}

/* ---- within a phase ---- */

/* How the axes at h answer to a change of each entry in the rows of the masses, as far as one has been asked for. */
typedef struct {
    const mode_real *mode;
    const real *z; /* where it begins */
    const real *W;
    real h;
    real self_convolution[CONVOLUTIONS_real];
    real applied[SHARES_real]
                [POWERS_real + 1]; /* K(s)/s times the powers of s, over P(s) or, for z_c = 1, none of it */
    real of[HOPFORM_CHANGED_ROWS][SHARES_real][HOPFORM_AXES];
    uint32_t known; /* a bit for each of these, for each share that is applied, and for W * W */
} answers_real;

enum { APPLIED_real = HOPFORM_CHANGED_ROWS * SHARES_real, CONVOLVED_real = APPLIED_real + SHARES_real };

/* Whether something of the answers is known; it is from now on. */
static inline bool knows_real(answers_real *answers, int what) {
    const uint32_t bit = 1u << (uint32_t)what;
    const bool known = (answers->known & bit) != 0;
    answers->known |= bit;
    return known;
}

static void begin_answers_real(answers_real *answers, const mode_real *mode, const real z[HOPFORM_AXES], real h,
                               const real W[ORDERS_real]) {
    answers->mode = mode;
    answers->z = z;
    answers->W = W;
    answers->h = h;
    answers->known = 0;
}

/* How the axes answer to an axis of the core, or to its row, of which axis 0 is one integral further: `at` has what the
 * powers of s are applied to. */
static inline void put_answer_real(const mode_real *mode, int axis, const real *at, real answer[HOPFORM_AXES]) {
    answer[0] = applied_real(mode->transfer.at[0][axis], at + 1);
    UNROLLED_real for (int i = 0; i < CORE_real; i++) {
        answer[i + 1] = applied_real(mode->transfer.at[i][axis], at);
    }
}

static inline void add_real(state_by_axis_real *sum, const real terms[HOPFORM_AXES], real times) {
    UNROLLED_real for (int i = 0; i < HOPFORM_AXES; i++) {
        sum->of[i] += terms[i] * times;
    }
}

/* What goes with z_c. */
static void apply_real(answers_real *answers, int c) {
    const mode_real *mode = answers->mode;
    real *applied = answers->applied[c];
    (void)memcpy(applied, answers->W + 1, sizeof answers->applied[c]);
    if (c == CORE_real) { return; }
    if (!knows_real(answers, CONVOLVED_real)) {
        self_convolution_real(mode, answers->h, answers->W, answers->self_convolution);
    }
    real K[POWERS_real + 1] = {0.0};
    for (int n = 0; n < POWERS_real; n++) {
        for (int j = 0; j < CORE_real; j++) {
            K[n] += mode->transfer.at[c][j][n] * answers->z[j + 1];
        }
        K[n + 1] += mode->transfer.at[c][CORE_real][n];
    }
    for (int n = 0; n <= POWERS_real; n++) {
        const real *convolved = answers->self_convolution + n;
        applied[n] = applied_real(K, convolved) + K[3] * convolved[3];
    }
}

/* How the axes answer to the entry of a row that goes with z_c; those of one that is held to none. */
static const real *answer_real(answers_real *answers, int row, int c) {
    real *answer = answers->of[row][c];
    if (!knows_real(answers, row * SHARES_real + c)) {
        const bool moves = row >= HOPFORM_ELEMENTS || side_of_mode_real(answers->mode->row, row) != 0;
        (void)memset(answer, 0, sizeof answers->of[row][c]);
        if (moves && !knows_real(answers, APPLIED_real + c)) { apply_real(answers, c); }
        if (moves) { put_answer_real(answers->mode, row, answers->applied[c], answer); }
    }
    return answer;
}

/* The change of each parameter of the robot that a column stands for. */
static inline robot_change_by_field_real robot_change_of_column_real(int32_t code) {
    robot_change_by_field_real change = {{0}};
    if (code >= ROBOT_real && code < COLUMNS_real) { change.of[code - ROBOT_real] = 1.0; }
    return change;
}

/* Whether a column stands for the input of a step, which that of all of them moves, too. */
static bool moves_input_real(int32_t code, int32_t step) {
    return code == HOPFORM_COLUMN_OF_INPUT || code == HOPFORM_COLUMN_OF_STEP(step);
}

/* How a stop moves with what a column stands for. */
static real stop_change_real(const hopform_plan_real *plan, int32_t code, bool upper) {
    const robot_change_by_field_real by = robot_change_of_column_real(code);
    return upper ? upper_stop_change_real(&plan->robot, &by.named) : lower_stop_change_real(&plan->robot, &by.named);
}

/* How the accelerations of a mode change with the inputs of a column, by what their shares go with. */
static slopes_by_share_real slopes_of_column_real(const variation_real *variation, const mode_real *mode,
                                                  int32_t code) {
    const hopform_phase_real *phase = &variation->phases[variation->index];
    const robot_change_by_field_real robot = robot_change_of_column_real(code);
    const int limit = limit_of_mode_real(mode->row);
    real input = moves_input_real(code, phase->step) ? 1.0 : 0.0;
    if (limit != 0) { input = input_at_limit_change_real(&variation->plan->robot, (real)limit, &robot.named, input); }
    slopes_by_share_real slopes;
    slopes.named =
        slopes_of_real(&variation->plan->robot, current_real(variation, phase), (real)side_of_mode_real(mode->row, 0),
                       (real)side_of_mode_real(mode->row, 1), (real)limit, &robot.named, input);
    return slopes;
}

/* Whether nothing of a column changes the equations of motion in the phase: it is a start's, or of another step, or of
 * a step's time. */
static bool is_free_real(int32_t code, int32_t step) {
    return code < HOPFORM_COLUMN_OF_INPUT || (code >= COLUMNS_real && code != HOPFORM_COLUMN_OF_STEP(step));
}

/* Whether a column is that of a step, or its time, behind the phase: it has changed nothing yet. */
static bool is_ahead_real(int32_t code, int32_t step) {
    return code >= HOPFORM_COLUMN_OF_STEP(step + 1);
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
    const bool never_moves = HOPFORM_NEVER_MOVES(element) != 0;
    const bool has_stops = element == HOPFORM_STOPPED_ELEMENT;
    const bool below = never_moves || (has_stops && at->of[HOPFORM_POSITION_AXIS] <= lower_stop_real(robot));
    const bool above = never_moves || (has_stops && at->of[HOPFORM_POSITION_AXIS] >= upper_stop_real(robot));
    return (below || free.of[element] > downwards) && (above || free.of[element] < upwards);
}

/* Whether what a phase holds where it begins stays held at every small change, or changes nothing in proportion if it
 * does not: one that the other mass's motion takes off its threshold gains nothing there, unless its friction falls as
 * it slips. */
static bool holds_in_proportion_real(const variation_real *variation) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const row_real row = variation->mode.row;
    bool holds = true;
    for (int element = 0; element < HOPFORM_ELEMENTS; element++) {
        const bool falls =
            excess_to_side_real(robot, element, -1) > 0.0 || excess_to_side_real(robot, element, 1) > 0.0;
        const bool counts = side_of_mode_real(row, element) == 0 && (rests_of_mode_real(row) || falls);
        holds = holds && (!counts || stays_held_real(variation, element));
    }
    return holds;
}

/* Follow the changes within a phase, up to a time of the stance; the state, too, where it is wanted. */
static void travel_real(variation_real *variation, real t, bool wants_state) {
    const hopform_plan_real *plan = variation->plan;
    const hopform_phase_real *phase = &variation->phases[variation->index];
    const mode_real *mode = &variation->mode;
    const real h = t - variation->t;
    const bool begins = !(variation->t > phase->t);
    if (h > 0.0 && begins) { variation->holds = variation->holds && holds_in_proportion_real(variation); }
    variation->t = t;
    if (!(h > 0.0) || rests_real(mode)) { return; }
    answers_real answers;
    const basis_by_order_real response = response_in_mode_real(mode, h);
    begin_answers_real(&answers, mode, variation->at.of, h, response.of);
    real phi[CORE_real][HOPFORM_AXES] = {{0.0}}; /* by columns, those that a change needs */
    bool is_put[CORE_real] = {false};
    for (int32_t column = 0; column < variation->chosen.count; column++) {
        const int32_t code = code_at_real(variation, column);
        if (is_ahead_real(code, phase->step)) { continue; }
        const state_by_axis_real change = change_of_column_real(variation, column);
        state_by_axis_real end = {{change.of[0], 0.0, 0.0, 0.0}};
        for (int j = 0; j < CORE_real; j++) {
            const real of_axis = change.of[j + 1];
            if (fabs_real(of_axis) <= 0.0) { continue; }
            if (!is_put[j]) { put_answer_real(mode, j, response.of, phi[j]); }
            is_put[j] = true;
            add_real(&end, phi[j], of_axis);
        }
        if (!is_free_real(code, phase->step)) {
            const slopes_by_share_real slopes = slopes_of_column_real(variation, mode, code);
            for (int row = 0; row < HOPFORM_CHANGED_ROWS; row++) {
                if (row < HOPFORM_ELEMENTS && HOPFORM_NEVER_MOVES(row)) { continue; }
                UNROLLED_real for (int c = 0; c < SHARES_real; c++) {
                    const real slope = slopes.of[row * SHARES_real + c];
                    if (fabs_real(slope) > 0.0) { add_real(&end, answer_real(&answers, row, c), slope); }
                }
            }
        }
        put_change_real(variation, column, &end);
    }
    if (wants_state) {
        variation->at.named = state_in_phase_real(plan, phase, current_real(variation, phase), t - phase->t);
    }
}

/* ---- through the events ---- */

static void not_late_real(const variation_real *variation) {
    for (int32_t column = 0; column < variation->chosen.count; column++) {
        put_late_real(variation, column, 0.0);
    }
}

/* How the acceleration of an element in a mode changes with the inputs of a column, at a state that does not. */
static real direct_slope_real(const variation_real *variation, const mode_real *mode, int element, int32_t code) {
    const slopes_by_share_real slopes = slopes_of_column_real(variation, mode, code);
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
static void cross_slip_real(variation_real *variation, int element, const state_by_axis_real *before) {
    const hopform_plan_real *plan = variation->plan;
    const mode_real *entered = &variation->mode;
    const hopform_phase_real *now = &variation->phases[variation->index];
    const int side = side_of_mode_real(entered->row, element);
    const real acceleration = (real)side * excess_to_side_real(&plan->robot, element, side);
    const bool at_step = now->step > 0 && !(now->t > variation->steps[now->step].t);
    if (at_step || !(fabs_real(acceleration) > 0.0)) { return; }
    const hopform_rates_real *rates = entered->rates;
    const real rate = free_slope_real(rates, element, before);
    variation->exists = variation->exists && fabs_real(rate) > 0.0;
    for (int32_t column = 0; column < variation->chosen.count && variation->exists; column++) {
        const int32_t code = code_at_real(variation, column);
        const robot_change_by_field_real robot = robot_change_of_column_real(code);
        state_by_axis_real change = change_of_column_real(variation, column);
        excess_by_side_real excess;
        excess.named = excess_change_real(&plan->robot, &robot.named);
        const real at_rest = (real)side * excess.of[side_index_real(element, side)];
        const real early =
            free_slope_real(rates, element, &change) + direct_slope_real(variation, entered, element, code) - at_rest;
        const real late = -early / rate;
        pass_slip_real(change.of, element, acceleration, late);
        put_change_real(variation, column, &change);
        put_late_real(variation, column, late);
    }
}

/* Follow the changes by the time of a step through it: the motion before goes on for longer. */
static void cross_step_real(variation_real *variation, const state_by_axis_real *before,
                            const state_by_axis_real *after) {
    const int32_t step = variation->phases[variation->index].step;
    for (int32_t column = 0; column < variation->chosen.count; column++) {
        if (code_at_real(variation, column) == HOPFORM_COLUMN_OF_STEP_TIME(step)) {
            state_by_axis_real change;
            for (int i = 0; i < HOPFORM_AXES; i++) {
                change.of[i] = before->of[i] - after->of[i];
            }
            put_change_real(variation, column, &change);
            put_late_real(variation, column, 1.0);
        }
    }
}

/* Follow the changes through the event behind a phase. It comes when an axis, at every change, has the value that
 * belongs to it; nothing jumps where the current steps. */
static void cross_real(variation_real *variation) {
    const hopform_phase_real *old = &variation->phases[variation->index];
    const hopform_phase_real *now = old + 1;
    const mode_real *mode = &variation->mode;
    const int axis = axis_of_event_real(now->event);
    const bool stops = axis == HOPFORM_POSITION_AXIS;
    const int velocity = HOPFORM_VELOCITY_AXIS(HOPFORM_STOPPED_ELEMENT);
    const bool upper = side_of_mode_real(mode->row, HOPFORM_STOPPED_ELEMENT) > 0;
    state_by_axis_real arrives;
    arrives.named = start_of_phase_real(now);
    const state_by_axis_real start = arrives;
    arrives.of[velocity] = stops ? variation->at.of[velocity] : arrives.of[velocity];
    const state_by_axis_real before = speeds_in_mode_real(mode, &arrives.named);
    put_mode_real(&variation->mode, variation->plan, now, current_real(variation, now));
    const state_by_axis_real after = speeds_in_mode_real(mode, &start.named);
    variation->index++;
    variation->t = now->t;
    variation->at = start;
    variation->is_timed = axis < 0;
    not_late_real(variation);
    const int slips = slips_at_event_real(now->event);
    if (slips >= 0) { cross_slip_real(variation, slips, &before); }
    if (now->step > old->step) { cross_step_real(variation, &before, &after); }
    /* without friction nothing jumps, however little of a velocity is left */
    if (axis < 0 || (!stops && !(fabs_real(before.of[axis] - after.of[axis]) > 0.0))) { return; }
    variation->exists = variation->exists && fabs_real(before.of[axis]) > 0.0;
    variation->is_timed = variation->exists;
    for (int32_t column = 0; column < variation->chosen.count && variation->exists; column++) {
        state_by_axis_real change = change_of_column_real(variation, column);
        const int32_t code = code_at_real(variation, column);
        const real wanted = stops ? stop_change_real(variation->plan, code, upper) : 0.0;
        const real late = (wanted - change.of[axis]) / before.of[axis];
        pass_event_at_axis_real(change.of, before.of, after.of, axis, wanted, late);
        put_change_real(variation, column, &change);
        put_late_real(variation, column, late);
    }
}

/* A stance from its start on, whose changes begin in the caller's memory: no velocity is left of a mass that is held,
 * unless it ends at once, or that a stop took at once. */
static void begin_variation_real(variation_real *variation, const hopform_plan_real *plan,
                                 const hopform_step_real *steps, const hopform_phase_real *phases,
                                 const hopform_stance_real *stance, const chosen_real *chosen, real *change,
                                 real *late) {
    variation->plan = plan;
    variation->steps = steps;
    variation->phases = phases;
    variation->index = 0;
    variation->t = 0.0;
    variation->chosen = *chosen;
    variation->change = change;
    variation->late = late;
    variation->is_timed = true;
    variation->exists = true;
    variation->holds = true;
    put_mode_real(&variation->mode, variation->plan, variation->phases, current_real(variation, variation->phases));
    const bool goes_on = !is_left_real(stance) || stance->duration > 0.0;
    bool moves[HOPFORM_AXES] = {true, true, true, true};
    for (int element = 0; element < HOPFORM_ELEMENTS; element++) {
        moves[HOPFORM_VELOCITY_AXIS(element)] =
            !((goes_on && side_of_mode_real(variation->mode.row, element) == 0) || HOPFORM_NEVER_MOVES(element)
              || (element == HOPFORM_STOPPED_ELEMENT && stance->start_loss < 0.0));
    }
    variation->at.named = start_of_phase_real(variation->phases);
    for (int32_t column = 0; column < variation->chosen.count; column++) {
        const int32_t code = code_at_real(variation, column);
        state_by_axis_real begun;
        for (int i = 0; i < HOPFORM_AXES; i++) {
            begun.of[i] = moves[i] && code == column_of_axis_real[i] ? 1.0 : 0.0;
        }
        put_change_real(variation, column, &begun);
    }
    not_late_real(variation);
}

/* Follow a stance up to a time, and where wanted its state; `last` is the index of its last phase. What a stop takes of
 * a velocity says the state before it alone. */
static void follow_to_real(variation_real *variation, int32_t last, real t, bool wants_state) {
    while (variation->index < last && variation->phases[variation->index + 1].t <= t) {
        const hopform_phase_real *next = &variation->phases[variation->index + 1];
        travel_real(variation, next->t, axis_of_event_real(next->event) == HOPFORM_POSITION_AXIS);
        cross_real(variation);
    }
    travel_real(variation, t, wants_state);
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
    for (int32_t column = 0; column < variation->chosen.count; column++) {
        const robot_change_by_field_real by = robot_change_of_column_real(code_at_real(variation, column));
        const hopform_state_real *end = &stance->end;
        const state_by_axis_real change = change_of_column_real(variation, column);
        put_late_real(variation, column, -contact_change_real(robot, end, &by.named, &change.change) / contact_rate);
    }
    return true;
#else
    (void)speed;
    return false;
#endif
}

#if HOPFORM_HAS_CONTACT
/* The rows of the apex, 0 without take-off, and of the AED; false where the apex has no derivative in range. */
static bool put_rows_of_contact_real(const variation_real *variation, const hopform_stance_real *stance, int32_t code,
                                     const state_by_axis_real *change, real rows[2]) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const hopform_state_real start = start_of_phase_real(variation->phases);
    const hopform_state_real *end = &stance->end;
    const real fall = is_left_real(stance) ? fall_of_real(robot) : 0.0;
    if (fall > 0.0 && !(fall * fall > 0.0)) { return false; } /* by which the apex's derivative divides */
    const robot_change_by_field_real by = robot_change_of_column_real(code);
    state_by_axis_real unit;
    for (int i = 0; i < HOPFORM_AXES; i++) {
        unit.of[i] = code == column_of_axis_real[i] ? 1.0 : 0.0;
    }
    rows[0] = fall > 0.0 ? apex_change_real(robot, end, &by.named, &change->change) : 0.0;
    rows[1] = body_energy_change_real(robot, end, &by.named, &change->change)
              - body_energy_change_real(robot, &start, &by.named, &unit.change);
    return true;
}
#endif

/* The rows of the matrix from the changes at the ending, in whose first rows these and what is late stand. */
static bool finish_real(variation_real *variation, const hopform_stance_real *stance, real *matrix) {
    const hopform_robot_real *robot = &variation->plan->robot;
    const state_by_axis_real speed = speeds_in_mode_real(&variation->mode, &stance->end);
    const int32_t count = variation->chosen.count;
    bool exists = ends_later_real(variation, stance, &speed.named);
    for (int32_t column = 0; exists && column < count; column++) {
        state_by_axis_real change = change_of_column_real(variation, column);
        const int32_t code = code_at_real(variation, column);
        const robot_change_by_field_real by = robot_change_of_column_real(code);
        const real late = variation->late[column];
        for (int i = 0; i < HOPFORM_AXES; i++) {
            change.of[i] += speed.of[i] * late;
        }
        real rows[HOPFORM_SENSITIVITY_ROWS];
#if HOPFORM_HAS_CONTACT
        if (is_left_real(stance) && HOPFORM_CONTACT_IS_STRETCH) { change.of[HOPFORM_STRETCH_AXIS] = 0.0; }
        exists = put_rows_of_contact_real(variation, stance, code, &change, rows + 5);
#endif
        rows[0] = late;
        rows[1] = change.of[0];
        rows[2] = change.of[1];
        rows[3] = height_change_real(robot, &stance->end, &by.named, &change.change);
        rows[4] = change.of[2];
        for (int row = 0; exists && row < HOPFORM_SENSITIVITY_ROWS; row++) {
            matrix[(ptrdiff_t)row * count + column] = rows[row];
            exists = exists && rows[row] >= -HOPFORM_NEVER_real && rows[row] <= HOPFORM_NEVER_real;
        }
    }
    return exists;
}

/* Derivatives of a solved stance at its ending, through its events: HOPFORM_SENSITIVITY_ROWS times column_count
 * numbers, row by row; zeros if there are none (positive status), as where an event grazes, where a small change ends a
 * rest, or a search has ended. Row T is 0 at a horizon; at rest it is that of the event that stopped the last mass.
 * With a contact it is also that of the stop where the contact force jumped below 0; one that pulls from the start ends
 * as it starts: T stays 0, the state moves with the start; and a row that only a rise has is 0 without one.
 *
 * columns: the inputs by which, column_count of them: numbers below HOPFORM_SENSITIVITY_COLUMNS, HOPFORM_COLUMN_OF_STEP
 * or HOPFORM_COLUMN_OF_STEP_TIME of a step, in any order; NULL for the HOPFORM_SENSITIVITY_COLUMNS in theirs, whatever
 * column_count is. A step that is not reached has zeros.
 *
 * Column y holds the others' at a fixed stretch. Column u moves every step's input alike. The velocity of a mass at
 * rest that is held stays 0, but where a contact is lost at once. Mass 1, if it starts on a stop, stays where it starts
 * until it departs; the ends of its stroke count where a stop is met later. A step's time moves that switch alone, and
 * with it what friction lets go there.
 */
int32_t hopform_stance_sensitivities_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                          const hopform_phase_real *phases, const hopform_stance_real *stance,
                                          const int32_t *columns, int32_t column_count, real *matrix) {
    const chosen_real chosen = chosen_of_real(columns, column_count, COLUMNS_real);
    const memory_real array = array_real(matrix, chosen.count, HOPFORM_SENSITIVITY_ROWS * sizeof *matrix);
    const int32_t status = reading_status_real(plan, steps, phases, stance, NULL, &chosen, &array, 1);
    if (status < 0) { return status; }
    variation_real variation;
    begin_variation_real(&variation, plan, steps, phases, stance, &chosen, matrix,
                         matrix + HOPFORM_AXES * (ptrdiff_t)chosen.count);
    follow_to_real(&variation, stance->phases_kept - 1, stance->duration, false);
    const bool exists = variation.exists && variation.holds && finish_real(&variation, stance, matrix);
    return exists ? HOPFORM_OK : refuse_real(HOPFORM_NO_DERIVATIVE, &array, 1, NULL, 0);
}

/* States of a solved stance at `count` times, which must not decrease, or none (NULL), and their derivatives through
 * the events before them: HOPFORM_TANGENT_ROWS times column_count numbers a time, rows x1, v1, v2, y, columns as in
 * hopform_stance_sensitivities. Where an event grazes, or a rest that a small change ends goes on
 * (HOPFORM_NO_DERIVATIVE), they are those of a motion that does not notice it.
 */
int32_t hopform_stance_tangents_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                     const hopform_phase_real *phases, const hopform_stance_real *stance,
                                     const int32_t *columns, int32_t column_count, const real *times, int32_t count,
                                     hopform_state_real *states, real *tangents) {
    const chosen_real chosen = chosen_of_real(columns, column_count, COLUMNS_real);
    const size_t of_one = chosen.count > 0 ? (size_t)HOPFORM_TANGENT_ROWS * (size_t)chosen.count : 0;
    const memory_real arrays[2] = {
        array_real(tangents, count, of_one * sizeof *tangents),
        array_real(states, count, sizeof *states),
    };
    const times_real when = {times, count, true};
    const int32_t status =
        reading_status_real(plan, steps, phases, stance, &when, &chosen, arrays, states != NULL ? 2 : 1);
    if (status < 0) { return status; }
    if (count < 1) { return HOPFORM_OK; }
    variation_real variation;
    begin_variation_real(&variation, plan, steps, phases, stance, &chosen, tangents, NULL);
    for (int32_t i = 0; i < count; i++) {
        if (i > 0) { /* from the time before on */
            (void)memcpy(variation.change + of_one, variation.change, of_one * sizeof *tangents);
            variation.change += of_one;
        }
        follow_to_real(&variation, stance->phases_kept - 1, lesser_real(times[i], stance->duration), true);
        if (times[i] > stance->duration) { variation.holds = variation.holds && holds_in_proportion_real(&variation); }
        if (states != NULL) { states[i] = variation.at.named; }
    }
    return variation.exists && variation.holds ? HOPFORM_OK : HOPFORM_NO_DERIVATIVE;
}

#endif
