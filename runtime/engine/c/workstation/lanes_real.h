/* SPDX-License-Identifier: MIT-0
 *
 * The lanes of vector registers: what is evaluated in each of them, a column for each number. Flags are 1 or 0 and of
 * the type of all numbers.
 */
#ifndef HOPFORM_LANES_H_real
#define HOPFORM_LANES_H_real

#include <stdbool.h>

#include "first_event_real.h"

#if defined(__GNUC__) && defined(__x86_64__)
#define HOPFORM_X86_LANES
#endif

enum {
    LANES_real = HOPFORM_LANE_COUNT_real,
    BLOCK_real = 16,    /* lanes that loops go over at a time */
    ROOT_STEPS_real = 8 /* towards a root, as many as locate_root takes before it halves */
};

#if defined(__GNUC__)
typedef real column_real[LANES_real] __attribute__((aligned(64)));
#else
typedef real column_real[LANES_real];
#endif

static inline real flag(bool yes) {
    return yes ? 1.0 : 0.0;
}

/* A number is put only where a flag says so. */
static inline void keep(real *place, bool yes, real value) {
    const real before = *place;
    const real after = yes ? value : before;
    *place = after;
}

/* ---- records, a column for each member ---- */
#define COLUMN(name, domain) column_real name;
#define TAKE_MEMBER(name, domain) .name = columns->name[l],
#define KEEP_MEMBER(name, domain) keep(&columns->name[l], yes, one->name);
#define RECORD_IN_COLUMNS(record, type, MEMBERS)                                                                       \
    typedef struct {                                                                                                   \
        MEMBERS(COLUMN)                                                                                                \
    } record##_columns;                                                                                                \
    static inline type one_##record(const record##_columns *columns, int l) {                                          \
        const type one = {MEMBERS(TAKE_MEMBER)};                                                                       \
        return one;                                                                                                    \
    }                                                                                                                  \
    static inline void keep_##record(record##_columns *columns, int l, bool yes, const type *one) {                    \
        MEMBERS(KEEP_MEMBER)                                                                                           \
    }
#define POLE_MEMBERS(X) X(a, NUMBER) X(p, NUMBER) X(q, NUMBER) X(s_1, NUMBER) X(s_2, NUMBER) X(s_3, NUMBER)
#define JET_MEMBERS(X) X(value, NUMBER) X(rate, NUMBER) X(curvature, NUMBER) X(third, NUMBER)
#define FUNCTION_MEMBERS(X) /* the others are 0 */                                                                     \
    X(H3, NUMBER) X(H2, NUMBER) X(H1, NUMBER) X(H0, NUMBER) X(start, NUMBER)
RECORD_IN_COLUMNS(poles, hopform_poles_real, POLE_MEMBERS)
RECORD_IN_COLUMNS(basis, hopform_basis_real, HOPFORM_BASIS_MEMBERS)
RECORD_IN_COLUMNS(jet, jet_real, JET_MEMBERS)
RECORD_IN_COLUMNS(function, event_function_real, FUNCTION_MEMBERS)

/* What a lane wants whose root is not found soon: it is located by itself. */
#define GIVES_UP (-1.0)

/* W is evaluated at t, where a lane wants it. Where it seeks the root of a function, that lies between two times; first
 * a guess is refined, a share of the interval between jets. */
typedef struct {
    poles_columns poles;
    column_real t, wants;
    basis_columns basis;
    column_real seeks, low, high, steps;
    function_columns function;
    column_real refines, share;
    jet_columns from, to;
} lanes_real;

/* What is done in vector registers of a kind: W is evaluated in each lane, with a step on towards the roots, and who
 * arrives, or seeks none, wants no more; the first BLOCK of some cubics are factored. NULL where the processor has
 * none. */
typedef struct {
    void (*evaluate)(lanes_real *w);
    void (*factor)(poles_columns *cubics);
} lanes_code_real;

/* Solves the stances of a batch; HOPFORM_PHASES_NOT_KEPT if events of one did not fit. */
int32_t hopform_solve_in_lanes_real(lanes_code_real code, int64_t count, const hopform_stances_in_real *in,
                                    const hopform_stances_out_real *out);

lanes_code_real hopform_lanes_baseline_real(void);
#if defined(HOPFORM_X86_LANES)
lanes_code_real hopform_lanes_avx2_real(void);
lanes_code_real hopform_lanes_avx512_real(void);
#endif

#endif
