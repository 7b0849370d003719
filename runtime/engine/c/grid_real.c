/* SPDX-License-Identifier: MIT-0
 *
 * States on a uniform grid. Within a phase every coordinate is a sum of 1, W', W, W_1, W_2 and t, (18)-(21), and the
 * state after j steps follows from that before them by the same sums: W(j dt) and the numerators of the state there. So
 * a table of W over one block of samples, made once a phase, carries the phase block by block; there is no chain from
 * sample to sample, so nothing accumulates and the loops vectorise. The first state of every 32nd block is taken from
 * the closed form of the phase itself.
 */
#include <stdbool.h>

#include "phase_real.h"

#ifdef __cplusplus
#define RESTRICT_real
#else
#define RESTRICT_real restrict
#endif

enum { BLOCK_real = 64, FINE_real = 8, SEED_BLOCKS_real = 32 };

/* A workstation's wider registers take a block in half the time, to the same bits. */
#if defined(__GNUC__) && defined(__x86_64__) && !defined(HOPFORM_PORTABLE)
#define HAS_WIDE_real __builtin_cpu_supports("avx2")
#define GRID_WIDE_real __attribute__((noinline, flatten, target("avx2")))
#define ALIGNED_real __attribute__((aligned(64)))
#else
#define HAS_WIDE_real 0
#define GRID_WIDE_real
#define ALIGNED_real
#endif

/* W, its derivative and integrals at j dt, j = 0 .. BLOCK - 1. */
typedef struct {
    real t[BLOCK_real] ALIGNED_real;
    real Wd[BLOCK_real];
    real W[BLOCK_real];
    real W1[BLOCK_real];
    real W2[BLOCK_real];
} grid_table_real;

/* The samples' times, and where they go. */
typedef struct {
    real t0;
    real dt;
    real *x1;
    real *v1;
    real *v2;
    real *y;
} grid_real;

static void put_basis_real(grid_table_real *table, int32_t j, real t, const hopform_basis_real *basis)
{
    table->t[j] = t;
    table->Wd[j] = basis->Wd;
    table->W[j] = basis->W;
    table->W1[j] = basis->W1;
    table->W2[j] = basis->W2;
}

/* W at t + s from W at t and at s: the motion from (W, W', W'') at t, over s. */
static hopform_basis_real later_real(const hopform_poles_real *poles, const hopform_basis_real *at,
                                     const hopform_basis_real *by, real s)
{
    const real jerk = -(poles->s_1 * at->Wdd + poles->s_2 * at->Wd + poles->s_3 * at->W);
    const real from_rate = by->Wd + poles->s_1 * by->W;
    const real from_value = by->Wdd + poles->s_1 * by->Wd + poles->s_2 * by->W;
    const real rate_1 = by->W + poles->s_1 * by->W1;
    const real value_1 = from_rate + poles->s_2 * by->W1;
    const real rate_2 = by->W1 + poles->s_1 * by->W2;
    const real value_2 = rate_1 + poles->s_2 * by->W2;
    const hopform_basis_real basis = {
        0.0,
        at->Wd * from_value + at->Wdd * from_rate + jerk * by->W,
        at->W * from_value + at->Wd * from_rate + at->Wdd * by->W,
        at->W1 + (at->W * value_1 + at->Wd * rate_1 + at->Wdd * by->W1),
        at->W2 + (s * at->W1 + at->W * value_2 + at->Wd * rate_2 + at->Wdd * by->W2),
    };
    return basis;
}

/* The first `count` entries; seven of eight follow from those at less than 8 dt and at multiples of it. */
static void fill_table_real(grid_table_real *table, const hopform_poles_real *poles, real dt, int32_t count)
{
    hopform_basis_real fine[FINE_real];
    for (int32_t j = 0; j < count; j += FINE_real) {
        const hopform_basis_real coarse = hopform_basis_at_real(poles, (real)j * dt);
        put_basis_real(table, j, (real)j * dt, &coarse);
        for (int32_t n = 1; n < FINE_real && j + n < count; n++) {
            if (j == 0) {
                fine[n] = hopform_basis_at_real(poles, (real)n * dt);
            }
            const hopform_basis_real basis = j == 0 ? fine[n] : later_real(poles, &coarse, &fine[n], (real)n * dt);
            put_basis_real(table, j + n, (real)(j + n) * dt, &basis);
        }
    }
}

/* from + H3 f + H2 g + H1 h along a block: (18), (19), (21). A full block has a count known to the compiler. */
static inline void sum_up_real(real *RESTRICT_real out, const grid_table_real *RESTRICT_real table, real from, real h3,
                               real h2, real h1, int32_t count)
{
    for (int32_t j = 0; j < count; j++) {
        out[j] = from + (h1 * table->W1[j] + h2 * table->W[j] + h3 * table->Wd[j]);
    }
}

/* The displacement, (20): one integral further, and the time. */
static inline void sum_up_x1_real(real *RESTRICT_real out, const grid_table_real *RESTRICT_real table, real x1, real v1,
                                  real h3, real h2, real h1, int32_t count)
{
    for (int32_t j = 0; j < count; j++) {
        out[j] = x1 + (h1 * table->W2[j] + h2 * table->W1[j] + h3 * table->W[j] + v1 * table->t[j]);
    }
}

static inline void put_same_real(real *RESTRICT_real out, real value, int32_t count)
{
    for (int32_t j = 0; j < count; j++) {
        out[j] = value;
    }
}

/* Samples from n on. */
static inline void put_samples_real(const grid_real *grid, int32_t n, const grid_table_real *table,
                                    const hopform_state_real *from, const hopform_motion_real *motion, int side_1,
                                    int side_2, int32_t count)
{
    if (side_1 != 0) {
        sum_up_x1_real(grid->x1 + n, table, from->x1, from->v1, motion->H3_1, motion->H2_1, motion->H1_1, count);
        sum_up_real(grid->v1 + n, table, from->v1, motion->H3_1, motion->H2_1, motion->H1_1, count);
    } else {
        put_same_real(grid->x1 + n, from->x1, count);
        put_same_real(grid->v1 + n, 0.0, count);
    }
    if (side_2 != 0) {
        sum_up_real(grid->v2 + n, table, from->v2, motion->H3_2, motion->H2_2, motion->H1_2, count);
    } else {
        put_same_real(grid->v2 + n, 0.0, count);
    }
    if (side_1 != 0 || side_2 != 0) {
        sum_up_real(grid->y + n, table, from->y, motion->H3_y, motion->H2_y, motion->H1_y, count);
    } else {
        put_same_real(grid->y + n, from->y, count);
    }
}

static GRID_WIDE_real void put_wide_real(const grid_real *grid, int32_t n, const grid_table_real *table,
                                         const hopform_state_real *from, const hopform_motion_real *motion, int side_1,
                                         int side_2)
{
    put_samples_real(grid, n, table, from, motion, side_1, side_2, BLOCK_real);
}

/* The samples of a phase from number `first` on, before `end`. Where both masses are held it takes no time. */
static void samples_of_phase_real(const hopform_plan_real *plan, const hopform_phase_real *phase, real u,
                                  const grid_real *grid, int32_t first, int32_t end)
{
    const int side_1 = hopform_side_1_real(phase);
    const int side_2 = hopform_side_2_real(phase);
    const hopform_poles_real *poles = hopform_poles_of_real(plan, side_1, side_2);
    const bool rests = side_1 == 0 && side_2 == 0;
    const real dt = rests ? 0.0 : grid->dt;
    const real t = grid->t0 + (real)first * grid->dt - phase->t;
    hopform_state_real from = hopform_state_in_phase_real(plan, phase, u, t);
    grid_table_real table;
    if (!rests) {
        fill_table_real(&table, poles, dt, end - first < BLOCK_real ? end - first : BLOCK_real);
    }
    hopform_basis_real next = {0.0, 0.0, 0.0, 0.0, 0.0};
    if (end - first > BLOCK_real) {
        next = hopform_basis_at_real(poles, (real)BLOCK_real * dt);
    }
    for (int32_t n = first; n < end; n += BLOCK_real) {
        if (n > first && (n - first) / BLOCK_real % SEED_BLOCKS_real == 0) {
            from = hopform_state_in_phase_real(plan, phase, u, t + (real)(n - first) * dt);
        }
        const hopform_motion_real motion = hopform_motion_of_real(plan, &from, u, side_1, side_2);
        if (end - n < BLOCK_real) {
            put_samples_real(grid, n, &table, &from, &motion, side_1, side_2, end - n);
        } else if (HAS_WIDE_real) {
            put_wide_real(grid, n, &table, &from, &motion, side_1, side_2);
        } else {
            put_samples_real(grid, n, &table, &from, &motion, side_1, side_2, BLOCK_real);
        }
        if (end - n > BLOCK_real) {
            from = hopform_arrive_real(&from, &motion, &next, side_1, side_2);
        }
    }
}

/* The first sample from `first` on that lies at or behind a time. */
static int32_t sample_behind_real(real time, real t0, real dt, int32_t first, int32_t count)
{
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

int32_t hopform_stance_grid_real(const hopform_plan_real *plan, const hopform_step_real *steps,
                                 const hopform_phase_real *phases, const hopform_stance_real *stance, real t0, real dt,
                                 int32_t count, real *x1, real *v1, real *v2, real *y)
{
    const hopform_memory_real arrays[] = {
        hopform_array_real(x1, count, sizeof *x1),
        hopform_array_real(v1, count, sizeof *v1),
        hopform_array_real(v2, count, sizeof *v2),
        hopform_array_real(y, count, sizeof *y),
    };
    const int32_t status = hopform_reading_status_real(plan, steps, phases, stance, NULL, arrays, 4);
    if (status < 0) {
        return status;
    }
    const bool rests = stance->ending == HOPFORM_ENDING_REST;
    const real last = t0 + (real)(count - 1) * dt;
    const real latest = rests ? HOPFORM_NEVER_real : stance->duration + 8.0 * HOPFORM_EPS_real * stance->duration;
    if (count < 0 || !(t0 >= 0.0) || !(dt > 0.0) || !(last <= latest)) {
        return hopform_refuse_real(HOPFORM_ERROR_TIME, arrays, 4);
    }
    const grid_real grid = {t0, dt, x1, v1, v2, y};
    int32_t first = 0;
    for (int32_t n = hopform_phase_index_real(phases, stance->phases_kept, t0); first < count; n++) {
        const bool is_last = n + 1 >= stance->phases_kept;
        const int32_t end = is_last ? count : sample_behind_real(phases[n + 1].t, t0, dt, first, count);
        if (end > first) {
            samples_of_phase_real(plan, &phases[n], steps[phases[n].step].u, &grid, first, end);
        }
        first = end;
    }
    return HOPFORM_OK;
}
