/* SPDX-License-Identifier: MIT-0
 *
 * An evaluation of each lane, in vector registers: every loop over the lanes is one that compilers turn into vector
 * instructions, and is made of the functions of one stance, so the bits are the same.
 *
 * Before it is included, LANES_NAME is the function to make, and LANES_CODE what goes before each function.
 */
#include <string.h>

#include "lanes_real.h"

#if defined(__GNUC__) && !defined(__clang__)
/* Each of these puts jumps into loops that had none. */
#pragma GCC optimize("no-thread-jumps", "no-tree-pre", "no-tree-sink", "no-tree-loop-im")
#endif

/* Whether a flag of a block is 1; 0 has no bit that is set. */
static inline bool any(const real *flags) {
    uint64_t words[BLOCK_real * sizeof(real) / sizeof(uint64_t)];
    uint64_t found = 0;
    memcpy(words, flags, sizeof words);
    for (size_t n = 0; n < sizeof words / sizeof words[0]; n++) {
        found |= words[n];
    }
    return found != 0;
}

#define TERM_MEMBERS(X) X(earlier, NUMBER) X(before, NUMBER) X(term, NUMBER) X(W2, NUMBER) X(W3, NUMBER) X(W4, NUMBER)

#define CUBIC_MEMBERS(X) X(c_1, NUMBER) X(c_2, NUMBER) X(c_3, NUMBER) X(mean, NUMBER) X(P, NUMBER) X(T, NUMBER)

RECORD_IN_COLUMNS(terms, hopform_basis_terms_real, TERM_MEMBERS)
RECORD_IN_COLUMNS(cubic, hopform_cubic_real, CUBIC_MEMBERS)

/* The guesses of roots, refined as refined_root does it. */
LANES_CODE static void refine_guesses(lanes_real *restrict w, int first) {
    for (int l = first; l < first + BLOCK_real; l++) {
        const jet_real from = one_jet(&w->from, l);
        const jet_real to = one_jet(&w->to, l);
        const real low = w->low[l];
        const real h = w->high[l] - low;
        const interpolant_real p = interpolant_of_real(&from, &to, h);
        real share = w->share[l];
        bool going = true;
        for (int n = 0; n < PREDICTION_STEPS_real; n++) {
            const real step = prediction_step_real(&p, share);
            const real next = share - step;
            share = (going & (next > 0.0) & (next < 1.0)) ? next : share;
            going = going & !(fabs_real(step) < HOPFORM_PREDICTION_real * share);
        }
        const real guess = low + h * share;
        const bool inside = (guess > low) & (guess < w->high[l]);
        const real t = inside ? guess : low + 0.5 * h;
        const bool refines = w->refines[l] > 0.0;
        keep(&w->t[l], refines, t);
        keep(&w->wants[l], refines, ((t > low) & (t < w->high[l])) ? 1.0 : GIVES_UP);
        keep(&w->steps[l], refines, 0.0);
        w->refines[l] = 0.0;
    }
}

/* W of three poles over a short time, of a block that waits for the longest series in it. */
LANES_CODE static void short_bases(lanes_real *restrict w, const real *restrict wanted, int first) {
    real going[BLOCK_real];
    terms_columns terms;
    for (int n = 0; n < BLOCK_real; n++) {
        const hopform_basis_terms_real none = hopform_first_basis_terms_real();
        keep_terms(&terms, n, true, &none);
        going[n] = wanted[first + n];
    }
    for (int k = 1; k < HOPFORM_TERMS_real - 2 && any(going); k += 3) {
        for (int n = 0; n < BLOCK_real; n++) {
            const hopform_poles_real poles = one_poles(&w->poles, first + n);
            const real t = w->t[first + n];
            hopform_basis_terms_real one = one_terms(&terms, n);
            hopform_add_basis_terms_real(&one, -(poles.s_1 * t), -(poles.s_2 * t * t), -(poles.s_3 * t * t * t), k);
            keep_terms(&terms, n, going[n] > 0.0, &one);
            going[n] *= flag(!hopform_basis_terms_end_real(&one));
        }
    }
    for (int n = 0; n < BLOCK_real; n++) {
        const hopform_poles_real poles = one_poles(&w->poles, first + n);
        const hopform_basis_terms_real one = one_terms(&terms, n);
        const hopform_basis_real there = hopform_basis_of_terms_real(&poles, w->t[first + n], &one);
        keep_basis(&w->basis, first + n, wanted[first + n] > 0.0, &there);
    }
}

/* W of a pair that rings, or from it that of the pair and a real pole, which may be fast. */
LANES_CODE static void ringing_bases(lanes_real *restrict w, const real *restrict wanted, int first, bool fast) {
    real left[BLOCK_real] = {0.0};
    for (int n = 0; n < BLOCK_real && fast; n++) {
        left[n] = hopform_exp_real(-(w->poles.a[first + n] * w->t[first + n]));
    }
    for (int l = first; l < first + BLOCK_real; l++) {
        const hopform_poles_real poles = one_poles(&w->poles, l);
        const real t = w->t[l];
        const real mean = 0.5 * poles.p;
        const real square = poles.q - mean * mean;
        const hopform_pair_core_real core =
            hopform_ringing_core_real(&poles, sqrt_real(square > 0.0 ? square : 1.0), t);
        const hopform_pair_real pair = hopform_pair_of_core_real(&poles, t, &core);
        const hopform_basis_real held = {pair.Rd, pair.R, pair.R1, pair.R2, pair.R3};
        keep_basis(&w->basis, l, wanted[l] > 0.0, &held);
    }
    for (int l = first; l < first + BLOCK_real; l++) {
        const hopform_poles_real poles = one_poles(&w->poles, l);
        const real t = w->t[l];
        const hopform_basis_real held = one_basis(&w->basis, l);
        const hopform_pair_real pair = {held.Wdd, held.Wd, held.W, held.W1, held.W2};
        const real z = poles.a * t;
        real tail = 0.0;
#define ADD_TERM(coefficient) tail = tail * z + (coefficient);
        HOPFORM_DECAY_TAIL_real(ADD_TERM)
#undef ADD_TERM
            const hopform_decay_real early = hopform_decay_of_tail_real(poles.a, t, tail);
        const hopform_decay_real late = hopform_decay_of_exp_real(poles.a, t, left[l - first]);
        const bool soon = fabs_real(z) < 1.0;
        const hopform_decay_real decay = {soon ? early.e : late.e, soon ? early.e1 : late.e1, soon ? early.e2 : late.e2,
                                          soon ? early.e3 : late.e3};
        const hopform_basis_real split =
            hopform_basis_of_split_real(&poles, hopform_residue_real(&poles), t, &decay, &pair);
        keep_basis(&w->basis, l, (wanted[l] > 0.0) & (fabs_real(poles.a) > 0.0), &split);
    }
}

/* W at t where a lane wants it, as hopform_basis_at_real, which itself gives it where neither is the time brief for all
 * poles nor does the pair ring by then. */
LANES_CODE static void bases_at(lanes_real *restrict w) {
    column_real brief, rings, fast, rest;
    for (int l = 0; l < LANES_real; l++) {
        const hopform_poles_real poles = one_poles(&w->poles, l);
        const real t = w->t[l];
        const real mean = 0.5 * poles.p;
        const bool late = !(fabs_real(poles.a) > 0.0) | (hopform_residue_real(&poles) * t * t >= 1.0);
        brief[l] = w->wants[l] * flag((!late) & (poles.s_1 * t < 4.0));
        rings[l] = w->wants[l] * flag(late & (mean * mean - poles.q < 0.0) & !(poles.q * t * t < 1.0));
        fast[l] = rings[l] * flag(!(fabs_real(poles.a * t) < 1.0));
        rest[l] = w->wants[l] - brief[l] - rings[l];
    }
    for (int n = 0; n < LANES_real; n += BLOCK_real) {
        if (any(rings + n)) { ringing_bases(w, rings, n, any(fast + n)); }
        if (any(brief + n)) { short_bases(w, brief, n); }
    }
    for (int l = 0; l < LANES_real; l++) {
        if (rest[l] > 0.0) {
            const hopform_poles_real poles = one_poles(&w->poles, l);
            const hopform_basis_real one = hopform_basis_at_real(&poles, w->t[l]);
            keep_basis(&w->basis, l, true, &one);
        }
    }
}

/* Where a root is sought, t goes on towards it as locate_root goes; what arrives wants no more. */
LANES_CODE static void step_on(lanes_real *restrict w, int first) {
    for (int l = first; l < first + BLOCK_real; l++) {
        const hopform_poles_real poles = one_poles(&w->poles, l);
        const hopform_basis_real basis = one_basis(&w->basis, l);
        const event_function_real g = one_function(&w->function, l);
        const real t = w->t[l];
        const propagator_real at = propagator_of_real(&poles, t, &basis);
        const jet_real jet = jet_at_real(&poles, &g, &at);
        const root_step_real step =
            step_between_real(&poles, &jet, fourth_of_real(&poles, &g, &jet), t, w->low[l], w->high[l]);
        const bool inside = (step.next > step.low) & (step.next < step.high);
        const real next = inside ? step.next : step.low + 0.5 * (step.high - step.low);
        const hopform_basis_real carried = carried_basis_real(&poles, &basis, step.next - t);
        const bool arrives = fabs_real(jet.value) <= HOPFORM_EPS_real * t * fabs_real(jet.rate);
        const bool goes = (w->wants[l] > 0.0) & (w->seeks[l] > 0.0) & !arrives;
        const bool more = (w->steps[l] < (real)(ROOT_STEPS_real - 1)) & (next > step.low) & (next < step.high);
        keep_basis(&w->basis, l, goes & step.lands, &carried);
        keep(&w->t[l], goes, step.lands ? step.next : next);
        const real wants = (goes & !step.lands) ? (more ? 1.0 : GIVES_UP) : 0.0;
        w->wants[l] = w->wants[l] < 0.0 ? GIVES_UP : wants;
        w->low[l] = step.low;
        w->high[l] = step.high;
        w->steps[l] += 1.0;
    }
}

/* Cube roots of numbers that are not below 0. */
LANES_CODE static void cube_roots(real *restrict roots, const real *restrict numbers) {
    for (int l = 0; l < BLOCK_real; l++) {
        roots[l] = hopform_cube_root_real(fabs_real(numbers[l]));
    }
}

/* As hopform_factor_cubic_real. A step of Newton's that does not lead down, or of the polish that is not small, leaves
 * all as it is, so more of them do no harm. */
LANES_CODE static void factor(poles_columns *restrict cubics) {
    cubic_columns scaled;
    real scale[BLOCK_real], root[BLOCK_real], going[BLOCK_real];
    cube_roots(root, cubics->s_3);
    for (int l = 0; l < BLOCK_real; l++) {
        const hopform_poles_real s = one_poles(cubics, l);
        scale[l] = hopform_scale_of_cubic_real(s.s_1, sqrt_real(s.s_2), root[l]);
        const hopform_cubic_real one = hopform_scaled_cubic_real(s.s_1, s.s_2, s.s_3, scale[l]);
        keep_cubic(&scaled, l, true, &one);
    }
    cube_roots(root, scaled.T);
    for (int l = 0; l < BLOCK_real; l++) {
        root[l] = sqrt_real(fabs_real(scaled.P[l])) + root[l];
        going[l] = 1.0;
    }
    for (int n = 0; n < NEWTON_STEPS_real && any(going); n++) {
        for (int l = 0; l < BLOCK_real; l++) {
            const real next = hopform_toward_positive_root_real(scaled.P[l], fabs_real(scaled.T[l]), root[l]);
            going[l] = flag(next < root[l]);
            root[l] = next < root[l] ? next : root[l];
        }
    }
    for (int l = 0; l < BLOCK_real; l++) {
        const hopform_cubic_real cubic = one_cubic(&scaled, l);
        const real even = cubic.P < 0.0 ? sqrt_real(fabs_real(cubic.P)) : 0.0;
        const bool drifts = !(cubics->s_3[l] > 0.0);
        const bool slow = !(scale[l] * scale[l] * scale[l] > 0.0);
        hopform_poles_real poles = one_poles(cubics, l);
        hopform_factor_at_real(&cubic, fabs_real(cubic.T) > 0.0 ? root[l] : even, &poles);
        for (int n = 0; n < POLISHES_real; n++) {
            (void)hopform_polish_factors_real(&cubic, &poles);
        }
        cubics->a[l] = (slow | drifts) ? 0.0 : poles.a * scale[l];
        const real p = drifts ? poles.s_1 : poles.p * scale[l];
        const real q = drifts ? poles.s_2 : poles.q * scale[l] * scale[l];
        cubics->p[l] = slow ? 0.0 : p;
        cubics->q[l] = slow ? 0.0 : q;
    }
}

static void evaluate(lanes_real *w) {
    for (int n = 0; n < LANES_real; n += BLOCK_real) {
        if (any(w->refines + n)) { refine_guesses(w, n); }
    }
    bases_at(w);
    for (int n = 0; n < LANES_real; n += BLOCK_real) {
        step_on(w, n);
    }
}

lanes_code_real LANES_NAME(void) {
    const lanes_code_real code = {evaluate, factor};
    return code;
}
