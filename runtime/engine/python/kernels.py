# SPDX-License-Identifier: MIT-0
"""Primitives: the roots of the cubic as factors, and the response W of the poles to an impulse over time, by the regime
that loses no digits. Every argument is an array of one dimension or a record of such arrays.
"""

import math

import numpy as np

from . import formulas
from .lanes import Array, by_case, choose, put, take
from .records import Basis, Decay, Fades, Pair, PairCore, Poles, Response, Series, ShiftedSeries, SplitPoles

TERMS = {np.dtype(np.float32): 24, np.dtype(np.float64): 40}
"""Terms of the power series of W at most."""

# What is left of a series when its terms are below this adds nothing to sums above 1e-4, whichever lanes go together.
LOST = {np.dtype(np.float32): 1e-13, np.dtype(np.float64): 1e-22}
# 1/3!, -1/4!, 1/5!, ... as the Horner scheme wants them, the last one first.
DECAY_TAIL: dict[np.dtype[np.generic], Array] = {
    np.dtype(kind): np.array([(-1.0) ** n / math.factorial(n + 3) for n in reversed(range(count))], kind)
    for kind, count in ((np.float32, 11), (np.float64, 18))
}


def decay_at(a: Array, t: Array) -> Decay:
    """exp(-a t) and its integrals t phi_1(-a t), t^2 phi_2(-a t), t^3 phi_3(-a t)."""
    short = np.abs(a * t) < 1.0
    return by_case(((short, _short_decay), (~short, _long_decay)), a, t)


def _short_decay(a: Array, t: Array) -> Decay:
    """By a series, from the highest integral down."""
    z = a * t
    e3 = t * t * t * np.polyval(DECAY_TAIL[z.dtype], z)
    e2 = 0.5 * t * t - a * e3
    e1 = t - a * e2
    return Decay(1.0 - a * e1, e1, e2, e3)


def _long_decay(a: Array, t: Array) -> Decay:
    """By quotients, up to the highest integral."""
    e = np.exp(-a * t)
    e1 = (1.0 - e) / a
    e2 = (t - e1) / a
    return Decay(e, e1, e2, (0.5 * t * t - e2) / a)


def split_of(poles: Poles) -> SplitPoles:
    """The slowest real pole and the other two; where a pair rings, the real pole and the pair."""
    mean = 0.5 * poles.p
    discriminant = mean * mean - poles.q
    fast = mean + np.sqrt(np.maximum(discriminant, 0.0))
    slow = poles.q / choose(fast > 0.0, fast, np.inf)
    taken = (discriminant > 0.0) & (slow < poles.a)
    return SplitPoles(
        choose(taken, slow, poles.a), choose(taken, poles.a + fast, poles.p), choose(taken, poles.a * fast, poles.q)
    )  # fmt: skip


def fades_at(split: SplitPoles, t: Array) -> Fades:
    """exp(-r t) of the pole r that is split off, and the integrals of decays whose limits are where nothing damps."""
    r = split.a_least
    decay = decay_at(r, t)
    short = np.abs(r * t) < 1.0
    by_parts = t * decay.e2 - decay.e3 - 0.5 * r * decay.e2 * decay.e2
    quotient = (decay.e2 - 0.5 * decay.e1 * decay.e1) / choose(short, np.inf, r)
    return Fades(decay.e, decay.e1, choose(short, by_parts, quotient), decay_at(split.p_others, t).e1)


def pair_at(poles: Poles, t: Array) -> Pair:
    """R, its derivative and integrals at t."""
    mean = 0.5 * poles.p
    discriminant = mean * mean - poles.q
    half = choose(poles.q > 0.0, np.sqrt(np.abs(discriminant)), mean)  # the square may underflow
    rings = discriminant < 0.0
    short = (rings & (poles.q * t * t < 1.0)) | (~rings & ((mean + half) * t < 2.0))
    ringing, apart = rings & ~short, ~(rings | short) & (half * t >= 0.5)
    close = ~(short | ringing | apart)
    cases = (short, _short_pair), (ringing, _ringing_pair), (apart, _distinct_pair), (close, _close_pair)
    return by_case(cases, poles, half, t)


def _short_pair(poles: Poles, _: Array, t: Array) -> Pair:
    """Over a time that is short for the pair: R is W' with a pole at 0 besides."""
    return Pair(*short_basis(poles._replace(s_1=poles.p, s_2=poles.q, s_3=np.zeros_like(t)), t))


def _distinct_pair(poles: Poles, half: Array, t: Array) -> Pair:
    """Two real poles at least 1/t apart: quotients of differences, no quotient by q."""
    fast = 0.5 * poles.p + half
    slow, apart = poles.q / fast, fast - poles.q / fast
    of_slow, of_fast = decay_at(slow, t), decay_at(fast, t)
    r, *integrals = ((s - f) / apart for s, f in zip(of_slow, of_fast, strict=True))
    return Pair(of_fast.e - slow * r, r, *integrals)


def _ringing_pair(poles: Poles, omega: Array, t: Array) -> Pair:
    mean = 0.5 * poles.p
    envelope, sine, cosine = np.exp(-mean * t), np.sin(0.5 * omega * t), np.cos(0.5 * omega * t)
    versine = 2.0 * sine * sine
    r = envelope * (2.0 * sine * cosine / omega)
    turned = envelope * versine - np.expm1(-mean * t) - mean * r
    return _by_quotient(poles, PairCore(envelope * (1.0 - versine) - mean * r, r, turned), t)


def _close_pair(poles: Poles, half: Array, t: Array) -> Pair:
    """Two real poles less than 1/t apart."""
    fast = 0.5 * poles.p + half
    envelope = np.exp(-fast * t)
    r = envelope * decay_at(-2.0 * half, t).e1
    rd = envelope - poles.q / fast * r
    return _by_quotient(poles, PairCore(rd, r, 1.0 - rd - poles.p * r), t)


def _by_quotient(poles: Poles, known: PairCore, t: Array) -> Pair:
    return Pair(*known[:2], *formulas.pair_by_quotient(poles, known, t))


def short_basis(poles: Poles, t: Array) -> Basis:
    """W of s^3 + s_1 s^2 + s_2 s + s_3 over a time that is short for all three poles: its power series."""
    h, hh, hhh = poles.s_1 * t, poles.s_2 * t * t, poles.s_3 * t * t * t
    term, once, twice = np.full_like(t, 1.0 / 24.0), np.zeros_like(t), np.zeros_like(t)
    w2, w3, w4 = term.copy(), np.full_like(t, 1.0 / 120.0), np.full_like(t, 1.0 / 720.0)
    for n in range(1, TERMS[t.dtype]):
        twice *= hhh / (n + 2)
        twice += hh * once
        twice *= 1.0 / (n + 3)
        twice += h * term
        twice *= -1.0 / (n + 4)
        term, once, twice = twice, term, once
        w2 += term
        w3 += term / (n + 5)
        w4 += term / ((n + 5) * (n + 6))
        if n % 4 == 0 and (np.abs(term) + np.abs(once) + np.abs(twice)).max(initial=0.0) < LOST[t.dtype]:
            break
    tt = t * t
    series = Series(w2 * (tt * tt), w3 * (tt * tt * t), w4 * (tt * tt * tt))
    return Basis(*formulas.all_from_series(poles, series, t), series.W2)


def close_basis(poles: Poles, t: Array) -> Basis:
    """W of three poles that lie within 1/t of each other and are not slow: a series around their mean."""
    shifted = formulas.shift(poles)
    near = short_basis(poles._replace(s_1=np.zeros_like(t), s_2=shifted.Q_s, s_3=shifted.T_s), t)
    series = ShiftedSeries(near.Wdd, near.Wd, near.W, np.exp(-shifted.sigma * t))
    response = formulas.unshift(shifted.sigma, series)
    return Basis(*response, *formulas.integrals_by_recursion(poles, response, t))


def split_basis(poles: Poles, t: Array) -> Basis:
    """W split into the real pole and the pair."""
    chi, decay, pair = formulas.residue(poles), decay_at(poles.a, t), pair_at(poles, t)
    basis = formulas.split(poles, chi, decay, pair)
    if (soon := poles.a * t < 0.5).any():
        basis.W[soon] = formulas.split_soon(*take((poles, chi, decay, pair), soon))
    if (close := chi < 0.05 * poles.q).any():
        response = take(Response(*basis[:3]), close)
        put(basis[3:], close, formulas.integrals_by_recursion(take(poles, close), response, t[close]))
    return basis


def basis_at(poles: Poles, t: Array) -> Basis:
    """W, its derivatives and integrals at t. With a = 0, as where one mass is held, W is the integral of R.

    a must be the most isolated root, as `factor_cubic` gives it.
    """
    held = np.asarray(poles.a == 0.0)
    split = ~held & (formulas.residue(poles) * t * t >= 1.0)
    short = ~(held | split) & (poles.s_1 * t < 4.0)
    close = ~(held | split | short)
    cases = (split, split_basis), (short, short_basis), (close, close_basis)
    return by_case(((held, lambda *at: Basis(*pair_at(*at))), *cases), poles, t)


def positive_root(P: Array, T: Array) -> Array:
    """The positive root z of z^3 + P z = T, T > 0: Newton from above, where the cubic is convex."""
    z = np.sqrt(np.abs(P)) + np.cbrt(T)
    for _ in range(60):
        new = z - ((z * z + P) * z - T) / (3.0 * z * z + P)
        if not (lower := new < z).any():
            break
        z = choose(lower, new, z)
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
        da = (r_3 - a * (r_2 - a * r_1)) / choose(chi != 0.0, chi, np.inf)
        good = (chi != 0.0) & (da * da < np.finfo(a.dtype).eps)
        q = np.where(good, q + (r_2 - a * (r_1 - da) - p * da), q)
        p = np.where(good, p + (r_1 - da), p)
        a = np.where(good, a + da, a)
    drifts = ~(s_3 > 0.0)  # an integrator, whatever the pair is
    return Poles(
        choose(drifts, 0.0, a * scale), choose(drifts, s_1, p * scale), choose(drifts, s_2, q * scale * scale),
        s_1, s_2, s_3,
    )  # fmt: skip
