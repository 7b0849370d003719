# SPDX-License-Identifier: MIT-0
"""Primitives: the roots of the cubic as factors, and the response W of the poles to an impulse over time, by the regime
that loses no digits. Every argument is an array of one dimension or a record of such arrays.
"""

import math

import numpy as np

from hopform_solver import formulas
from hopform_solver.lanes import Array, blank, choose, put, take
from hopform_solver.limits import TERMS
from hopform_solver.records import (
    Basis,
    Decay,
    Pair,
    PairCore,
    PairSeries,
    Poles,
    Response,
    Series,
    ShiftedSeries,
)

# What is left of a series when its terms are below this adds nothing to sums above 1e-4, whichever lanes go together.
LOST = {np.dtype(np.float32): 1e-13, np.dtype(np.float64): 1e-22}
# 1/3!, -1/4!, 1/5!, ... as the Horner scheme wants them, the last one first.
DECAY_TAIL = {
    np.dtype(kind): [(-1.0) ** n / math.factorial(n + 3) for n in reversed(range(count))]
    for kind, count in ((np.float32, 11), (np.float64, 18))
}


def decay_at(a: Array, t: Array) -> Decay:
    """exp(-a t) and its integrals t phi_1(-a t), t^2 phi_2(-a t), t^3 phi_3(-a t)."""
    z = a * t
    short = np.abs(z) < 1.0
    if short.all():
        return _short_decay(a, t, z)
    if not short.any():
        return _long_decay(a, t, z)
    long, decay = ~short, blank(Decay, z)
    put(decay, short, _short_decay(a[short], t[short], z[short]))
    put(decay, long, _long_decay(a[long], t[long], z[long]))
    return decay


def _short_decay(a: Array, t: Array, z: Array) -> Decay:
    """By a series, from the highest integral down."""
    total = np.zeros_like(z)
    for coefficient in DECAY_TAIL[z.dtype]:
        total *= z
        total += coefficient
    e3 = t * t * t * total
    e2 = 0.5 * t * t - a * e3
    e1 = t - a * e2
    return Decay(1.0 - a * e1, e1, e2, e3)


def _long_decay(a: Array, t: Array, z: Array) -> Decay:
    """By quotients, up to the highest integral."""
    e = np.exp(-z)
    e1 = (1.0 - e) / a
    e2 = (t - e1) / a
    return Decay(e, e1, e2, (0.5 * t * t - e2) / a)


def short_pair(poles: Poles, t: Array) -> Pair:
    """R over a time that is short for the pair: the series of its two highest integrals."""
    pt, qtt = poles.p * t, poles.q * t * t
    before, term = np.zeros_like(t), np.full_like(t, 1.0 / 6.0)
    r2, r3 = term.copy(), np.full_like(t, 1.0 / 24.0)
    part = np.empty_like(t)
    for n in range(1, TERMS[t.dtype]):
        new = np.multiply(qtt, before, out=before)
        new *= 1.0 / (n + 2)
        new += np.multiply(pt, term, out=part)
        new *= -1.0 / (n + 3)
        before, term = term, new
        r2 += term
        r3 += np.multiply(term, 1.0 / (n + 4), out=part)
        if n % 4 == 0 and (np.abs(term) + np.abs(before)).max(initial=0.0) < LOST[t.dtype]:
            break
    series = PairSeries(r2 * (t * t * t), r3 * (t * t * t * t))
    known = formulas.pair_from_series(poles, series, t)
    return Pair(known.Rd, known.R, known.R1, series.R2, series.R3)


def distinct_pair(slow: Array, fast: Array, t: Array) -> Pair:
    """R of two real poles at least 1/t apart: quotients of differences, no quotient by q."""
    of_slow, of_fast = decay_at(slow, t), decay_at(fast, t)
    apart = fast - slow
    r = (of_slow.e - of_fast.e) / apart
    integrals = ((s - f) / apart for s, f in zip(of_slow[1:], of_fast[1:], strict=True))
    return Pair(of_fast.e - slow * r, r, *integrals)


def pair_at(poles: Poles, t: Array) -> Pair:
    """R, its derivative and integrals at t."""
    mean = 0.5 * poles.p
    discriminant = mean * mean - poles.q
    half = choose(poles.q > 0.0, np.sqrt(np.abs(discriminant)), mean)  # the square may underflow
    swings = discriminant < 0.0
    fast = mean + half
    short = (swings & (poles.q * t * t < 1.0)) | (~swings & (fast * t < 2.0))
    turning = swings & ~short
    if short.all():
        return short_pair(poles, t)
    if turning.all():
        return _by_quotient(poles, _turning_core(mean, half, t), t)
    apart = ~swings & ~short & (half * t >= 0.5)
    pair = blank(Pair, t)
    if short.any():
        put(pair, short, short_pair(take(poles, short), t[short]))
    if apart.any():
        f = fast[apart]
        put(pair, apart, distinct_pair(poles.q[apart] / f, f, t[apart]))
    core = blank(PairCore, t)
    if turning.any():
        put(core, turning, _turning_core(mean[turning], half[turning], t[turning]))
    if (close := ~swings & ~short & ~apart).any():
        t_c, fast_c = t[close], fast[close]
        envelope = np.exp(-fast_c * t_c)
        r = envelope * decay_at(-2.0 * half[close], t_c).e1
        rd = envelope - poles.q[close] / fast_c * r
        put(core, close, (rd, r, 1.0 - rd - poles.p[close] * r))
    if (rest := ~short & ~apart).any():
        put(pair, rest, _by_quotient(take(poles, rest), take(core, rest), t[rest]))
    return pair


def _turning_core(mean: Array, omega: Array, t: Array) -> PairCore:
    """Of a pair that swings."""
    gone = -np.expm1(-mean * t)
    envelope, sine, cosine = np.exp(-mean * t), np.sin(0.5 * omega * t), np.cos(0.5 * omega * t)
    versine = 2.0 * sine * sine
    r = envelope * (2.0 * sine * cosine / omega)
    return PairCore(envelope * (1.0 - versine) - mean * r, r, gone + envelope * versine - mean * r)


def _by_quotient(poles: Poles, known: PairCore, t: Array) -> Pair:
    return Pair(*known[:2], *formulas.pair_by_quotient(poles, known, t))


def short_basis(poles: Poles, t: Array) -> Basis:
    """W of s^3 + s_1 s^2 + s_2 s + s_3 over a time that is short for all three poles."""
    h, hh, hhh = poles.s_1 * t, poles.s_2 * t * t, poles.s_3 * t * t * t
    term, once, twice = np.full_like(t, 1.0 / 24.0), np.zeros_like(t), np.zeros_like(t)
    w2, w3, w4 = term.copy(), np.full_like(t, 1.0 / 120.0), np.full_like(t, 1.0 / 720.0)
    part = np.empty_like(t)
    for n in range(1, TERMS[t.dtype]):
        new = np.multiply(hhh, twice, out=twice)
        new *= 1.0 / (n + 2)
        new += np.multiply(hh, once, out=part)
        new *= 1.0 / (n + 3)
        new += np.multiply(h, term, out=part)
        new *= -1.0 / (n + 4)
        term, once, twice = new, term, once
        w2 += new
        w3 += np.multiply(new, 1.0 / (n + 5), out=part)
        part *= 1.0 / (n + 6)
        w4 += part
        if n % 4 == 0 and (np.abs(term) + np.abs(once) + np.abs(twice)).max(initial=0.0) < LOST[t.dtype]:
            break
    tt = t * t
    series = Series(w2 * (tt * tt), w3 * (tt * tt * t), w4 * (tt * tt * tt))
    known = formulas.all_from_series(poles, series, t)
    return Basis(*known, series.W2)


def close_basis(poles: Poles, t: Array) -> Basis:
    """W of three poles that lie within 1/t of each other and are not slow: a series around their mean."""
    shifted = formulas.shift(poles)
    zero = np.zeros_like(t)
    near = short_basis(Poles(zero, zero, zero, zero, shifted.Q_s, shifted.T_s), t)
    series = ShiftedSeries(near.Wdd, near.Wd, near.W, np.exp(-shifted.sigma * t))
    response = formulas.unshift(shifted.sigma, series)
    return Basis(*response, *formulas.integrals_by_recursion(poles, response, t))


def split_basis(poles: Poles, chi: Array, t: Array) -> Basis:
    """W split into the real pole and the pair."""
    decay, pair = decay_at(poles.a, t), pair_at(poles, t)
    basis = formulas.split(poles, chi, decay, pair)
    if (soon := poles.a * t < 0.5).any():
        basis.W[soon] = formulas.split_soon(take(poles, soon), chi[soon], take(decay, soon), take(pair, soon))
    if (close := chi < 0.05 * poles.q).any():
        response = take(Response(*basis[:3]), close)
        integrals = formulas.integrals_by_recursion(take(poles, close), response, t[close])
        put(basis[3:], close, integrals)
    return basis


def basis_at(poles: Poles, t: Array) -> Basis:
    """W, its derivatives and integrals at t. With a = 0, as where one mass is held, W is the integral of R.

    a must be the most isolated root, as `factor_cubic` gives it. Lanes that are all of one kind are not taken apart.
    """
    held = np.asarray(poles.a == 0.0)
    if held.all():
        return Basis(*pair_at(poles, t))
    chi = formulas.residue(poles)
    split = ~held & (chi * t * t >= 1.0)
    if split.all():
        return split_basis(poles, chi, t)
    short = ~held & ~split & (poles.s_1 * t < 4.0)
    if short.all():
        return short_basis(poles, t)
    basis = blank(Basis, t)
    if held.any():
        put(basis, held, pair_at(take(poles, held), t[held]))
    if split.any():
        put(basis, split, split_basis(take(poles, split), chi[split], t[split]))
    if short.any():
        put(basis, short, short_basis(take(poles, short), t[short]))
    if (close := ~held & ~split & ~short).any():
        put(basis, close, close_basis(take(poles, close), t[close]))
    return basis


def positive_root(P: Array, T: Array) -> Array:
    """The positive root z of z^3 + P z = T, T > 0: Newton from above, where the cubic is convex."""
    z = np.sqrt(np.abs(P)) + np.cbrt(T)
    going = np.ones(z.shape, dtype=bool)
    for _ in range(60):
        z_g, P_g = z[going], P[going]
        new = z_g - ((z_g * z_g + P_g) * z_g - T[going]) / (3.0 * z_g * z_g + P_g)
        lower = new < z_g
        z[going] = np.where(lower, new, z_g)
        going[going] = lower
        if not going.any():
            break
    return z


def factor_cubic(s_1: Array, s_2: Array, s_3: Array) -> Poles:
    """s^3 + s_1 s^2 + s_2 s + s_3 = (s + a)(s^2 + p s + q) with the most isolated real root as -a.

    The root beyond the inflection on the side where it is alone is simple unless all three coincide. The factors,
    not the roots, are then polished: the residual of the coefficients is what the motion sees.
    """
    scale = np.maximum(np.maximum(s_1, np.sqrt(s_2)), np.cbrt(s_3))
    c_1, c_2, c_3 = s_1 / scale, s_2 / (scale * scale), s_3 / scale / (scale * scale)
    mean = c_1 / 3.0
    P = c_2 - 3.0 * mean * mean
    T = c_3 - mean * (c_2 - 2.0 * mean * mean)
    offset = np.where(P < 0.0, np.sqrt(np.abs(P)), 0.0)
    lopsided = np.abs(T) > 0.0
    offset[lopsided] = positive_root(P[lopsided], np.abs(T[lopsided]))
    a = np.where(T > 0.0, mean + offset, mean - offset)
    p = c_1 - a
    large = a > mean
    q = c_2 - a * p
    q[large] = c_3[large] / a[large]
    for _ in range(3):
        r_1, r_2, r_3 = c_1 - (a + p), c_2 - (q + a * p), c_3 - a * q
        chi = q - a * (p - a)
        simple = chi != 0.0
        da = np.zeros_like(a)
        da[simple] = (r_3[simple] - a[simple] * (r_2[simple] - a[simple] * r_1[simple])) / chi[simple]
        good = simple & (da * da < np.finfo(a.dtype).eps)
        q = np.where(good, q + (r_2 - a * (r_1 - da) - p * da), q)
        p = np.where(good, p + (r_1 - da), p)
        a = np.where(good, a + da, a)
    drifts = ~(s_3 > 0.0)  # an integrator, whatever the pair is
    a, p, q = (
        np.where(drifts, of_drift, x) for of_drift, x in ((0.0, a * scale), (s_1, p * scale), (s_2, q * scale * scale))
    )
    return Poles(a, p, q, s_1, s_2, s_3)
