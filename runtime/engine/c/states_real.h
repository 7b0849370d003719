/* SPDX-License-Identifier: MIT-0
 *
 * States of a solved stance at many times, and on a uniform grid. On a grid the samples of a phase follow from those
 * before them, z(t + h) = Phi(h) z(t): the first from the closed form, the next seven from one before, the next 56 from
 * eight before, and so on. A sample lies behind 7 such steps for each factor of 8 in its number, so next to nothing
 * accumulates, and the loops vectorise.
 */
#ifndef HOPFORM_STATES_H_real
#define HOPFORM_STATES_H_real

#include <stdbool.h>
#include <string.h>

#include "linear_real.h"
#include "reading_real.h"

#ifdef __cplusplus
#define RESTRICT_real
#else
#define RESTRICT_real restrict
#endif

/* A workstation's wider registers take many samples in half the time, to the same bits. */
#if defined(__GNUC__) && defined(__x86_64__) && !defined(HOPFORM_PORTABLE)
#define HAS_WIDE_real __builtin_cpu_supports("avx2")
#define GRID_WIDE_real __attribute__((noinline, flatten, target("avx2")))
#else
#define HAS_WIDE_real 0
#define GRID_WIDE_real
#endif

enum { STRIDE_real = 8, BLOCK_real = 64 };

/* The samples' times, and where they go: a column for each axis. */
typedef struct {
    real t0;
    real dt;
    real *column[HOPFORM_AXES];
} grid_real;

static inline real moved_real(const real phi[HOPFORM_AXES_AND_ONE], real z_1, real z_2, real z_3) {
    return phi[1] * z_1 + phi[2] * z_2 + phi[3] * z_3 + phi[ONE_real];
}

/* z, axis by axis, a time h later. */
static inline void step_columns_real(const real *RESTRICT_real z_0, const real *RESTRICT_real z_1,
                                     const real *RESTRICT_real z_2, const real *RESTRICT_real z_3,
                                     real *RESTRICT_real later_0, real *RESTRICT_real later_1,
                                     real *RESTRICT_real later_2, real *RESTRICT_real later_3, const matrix_real *phi,
                                     int32_t count) {
    const matrix_real by = *phi;
    for (int32_t n = 0; n < count; n++) {
        later_0[n] = z_0[n] + moved_real(by.at[0], z_1[n], z_2[n], z_3[n]);
        later_1[n] = moved_real(by.at[1], z_1[n], z_2[n], z_3[n]);
        later_2[n] = moved_real(by.at[2], z_1[n], z_2[n], z_3[n]);
        later_3[n] = moved_real(by.at[3], z_1[n], z_2[n], z_3[n]);
    }
}

/* The samples from `behind` after `first` on, from those from `first` on. */
static inline void put_samples_real(const grid_real *grid, const matrix_real *phi, int32_t first, int32_t behind,
                                    int32_t count) {
    real *const *z = grid->column;
    const int32_t to = first + behind;
    step_columns_real(z[0] + first, z[1] + first, z[2] + first, z[3] + first, z[0] + to, z[1] + to, z[2] + to,
                      z[3] + to, phi, count);
}

/* A full block has a count known to the compiler. */
static GRID_WIDE_real void put_wide_real(const grid_real *grid, const matrix_real *phi, int32_t first, int32_t behind) {
    put_samples_real(grid, phi, first, behind, BLOCK_real);
}

/* The samples of a phase from number `first` on, before `end`. */
static void samples_of_phase_real(const hopform_plan_real *plan, const hopform_phase_real *phase, real u,
                                  const grid_real *grid, int32_t first, int32_t end) {
    state_by_axis_real start;
    start.named = state_in_phase_real(plan, phase, u, grid->t0 + (real)first * grid->dt - phase->t);
    const mode_real mode = mode_of_real(plan, phase, u);
    const int32_t count = end - first;
    for (int i = 0; i < HOPFORM_AXES; i++) {
        grid->column[i][first] = start.of[i];
    }
    for (int64_t behind = 1; behind < count; behind *= STRIDE_real) {
        const basis_by_order_real response = response_in_mode_real(&mode, (real)behind * grid->dt);
        const matrix_real phi = transition_real(&mode, response.of);
        const int64_t most = behind < BLOCK_real ? behind : (int64_t)BLOCK_real;
        for (int64_t n = behind; n < STRIDE_real * behind && n < count; n += most) {
            const int32_t from = first + (int32_t)(n - behind);
            const int32_t number = (int32_t)(count - n < most ? count - n : most);
            if (number < BLOCK_real) {
                put_samples_real(grid, &phi, from, (int32_t)behind, number);
            } else if (HAS_WIDE_real) {
                put_wide_real(grid, &phi, from, (int32_t)behind);
            } else {
                put_samples_real(grid, &phi, from, (int32_t)behind, BLOCK_real);
            }
        }
    }
}

/* The first sample from `first` on that lies at or behind a time. */
static int32_t sample_behind_real(real time, real t0, real dt, int32_t first, int32_t count) {
    const real guess = (time - t0) / dt;
    int32_t n = guess < (real)count ? (guess > (real)first ? (int32_t)guess : first) : count;
    while (n > first && t0 + (real)(n - 1) * dt >= time) {
        n--;
    }
    while (n < count && t0 + (real)n * dt < time) {
        n++;
    }
    return n;
}

/* The columns of an output, one for each axis. */
static void columns_of_real(real *const *columns, int32_t count, memory_real arrays[HOPFORM_AXES]) {
    for (int i = 0; i < HOPFORM_AXES; i++) {
        arrays[i] = array_real(columns != NULL ? columns[i] : NULL, count, sizeof **columns);
    }
}

/* States of a solved stance at the times t0 + i dt, i = 0 .. count - 1, in columns as those of hopform_stance_states.
 *
 * The grid ends at the stance's duration (a rest may be followed on for any time); dt > 0. About as exact as
 * hopform_stance_at at each time, at the cost of a few sums.
 */
int32_t hopform_stance_grid_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                 const hopform_phase_real *phases, const hopform_stance_real *stance, real t0, real dt,
                                 int32_t count, real *const *columns) {
    memory_real arrays[HOPFORM_AXES];
    columns_of_real(columns, count, arrays);
    const int32_t status = reading_status_real(plan, steps, phases, stance, NULL, NULL, arrays, HOPFORM_AXES);
    if (status < 0 || columns == NULL) { /* refused without */
        return status;
    }
    const bool rests = stance->ending == HOPFORM_ENDING_REST;
    const real last = t0 + (real)(count - 1) * dt;
    const real latest = rests ? HOPFORM_NEVER_real : stance->duration + 8.0 * HOPFORM_EPS_real * stance->duration;
    if (count < 0 || !(t0 >= 0.0) || !(dt > 0.0) || !(last <= latest)) {
        return refuse_real(HOPFORM_ERROR_TIME, arrays, HOPFORM_AXES, NULL, 0);
    }
    grid_real grid;
    grid.t0 = t0;
    grid.dt = dt;
    (void)memcpy(grid.column, columns, sizeof grid.column);
    int32_t first = 0;
    for (int32_t n = phase_index_real(phases, stance->phases_kept, t0); first < count; n++) {
        const bool is_last = n + 1 >= stance->phases_kept;
        const int32_t end = is_last ? count : sample_behind_real(phases[n + 1].t, t0, dt, first, count);
        const real u = input_of_phase_real(plan, steps, &phases[n]);
        if (end > first) { samples_of_phase_real(plan, &phases[n], u, &grid, first, end); }
        first = end;
    }
    return HOPFORM_OK;
}

/* States at `count` times of any order, each as hopform_stance_at gives it, in columns: an array for each member of
 * hopform_state, in their order. */
int32_t hopform_stance_states_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                   const hopform_phase_real *phases, const hopform_stance_real *stance,
                                   const real *times, int32_t count, real *const *columns) {
    memory_real arrays[HOPFORM_AXES];
    columns_of_real(columns, count, arrays);
    const times_real when = {times, count, false};
    const int32_t status = reading_status_real(plan, steps, phases, stance, &when, NULL, arrays, HOPFORM_AXES);
    if (status < 0 || columns == NULL) { /* refused without */
        return status;
    }
    real *column[HOPFORM_AXES]; /* where they point to may be written */
    (void)memcpy(column, columns, sizeof column);
    reader_real reader = reader_of_real(plan, steps, phases, stance->phases_kept);
    for (int32_t i = 0; i < count; i++) {
        state_by_axis_real state;
        state.named = read_state_real(&reader, lesser_real(times[i], stance->duration));
        for (int axis = 0; axis < HOPFORM_AXES; axis++) {
            column[axis][i] = state.of[axis];
        }
    }
    return HOPFORM_OK;
}

#endif
