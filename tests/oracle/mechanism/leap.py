"""Long steps over stretches where no event function can vanish, because its fast modes have died away.

    g(t) = sum of slow modes + sum_i kappa_i e^(lambda_i t),  |lambda_i| large        g > 0 if slow > what fast can take

The slow part is a Taylor polynomial over a step that suits it, bounded below by Bernstein coefficients. A complex pair
takes at most 2 |kappa|. Real modes are taken together: with rates rising, sum_i kappa_i e^(-a_i t) is a mean with
positive weights of the partial sums of kappa and 0, so it is at least the least of them.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ..polynomials import bernstein_floats
from .flow import Flow, Point
from .guards import Guard
from .numbers import Real, mp

SPAN = 3  # |lambda| H of a long step
DEGREE = 32  # 3^33/33! < 1e-21: what is cut off is below MARGIN
MARGIN = 1e-11  # relative; the floats here are good to 1e-13
WORTH = 4  # windows that a long step must replace
APART = mp.mpf("1e-12")  # relative distance of a fast eigenvalue from all others
NEGLIGIBLE = mp.mpf("1e-60")  # slow parts below this are rounding


@dataclass(frozen=True)
class Mode:
    """An eigenvalue of (w, a)' = A (w, a), its right and left eigenvector, left . right = 1."""

    rate: Any
    right: Sequence[Any]
    left: Sequence[Any]


@dataclass(frozen=True)
class Level:
    """A division into slow and fast modes: the largest slow |lambda|, the slow part of A, the fast modes."""

    slowest: Real
    slow: Sequence[Sequence[Any]]
    fast: Sequence[Mode]


def modes(flow: Flow) -> list[Mode]:
    """The eigenvalues by magnitude; empty where the eigenvectors cannot be had."""
    d = flow.order
    a = mp.zeros(2 * d)
    for i in range(d):
        a[i, d + i] = flow.rho
        for j in range(d):
            a[i, j], a[d + i, j] = -flow.D[i][j], -flow.S[i][j] / flow.rho
    values, right = mp.eig(a)
    columns = [[right[i, n] for i in range(2 * d)] for n in range(2 * d)]
    try:
        left = mp.inverse(right).tolist()
    except ZeroDivisionError:
        left = [[mp.zero] * 2 * d] * (2 * d)
    found = [Mode(*parts) for parts in zip(values, columns, left, strict=True)]
    return sorted(found, key=lambda mode: abs(mode.rate))


def simple(mode: Mode, others: Sequence[Mode]) -> bool:
    return all(abs(mode.rate - other.rate) > APART * abs(mode.rate) for other in others if other is not mode)


def levels(flow: Flow) -> list[Level]:
    """Every division into slow and fast modes with fast ones that stand alone, few slow ones first."""
    d, found, every = flow.order, list[Level](), modes(flow)
    for first in range(2 * d):
        fast = every[first:]
        torn = first and abs(mp.conj(every[first - 1].rate) - fast[0].rate) < APART * abs(fast[0].rate)
        if torn or not all(fast_mode.rate and simple(fast_mode, every) for fast_mode in fast):
            continue
        slowest = abs(every[first - 1].rate) if first else mp.zero
        if slowest <= APART * abs(fast[0].rate):
            slowest = mp.zero
        a = [[-q for q in flow.D[i]] + [flow.rho * int(i == j) for j in range(d)] for i in range(d)] + [
            [-q / flow.rho for q in flow.S[i]] + [mp.zero] * d for i in range(d)
        ]
        slow = [
            [mp.re(a[i][j] - mp.fsum(m.rate * m.right[i] * m.left[j] for m in fast)) for j in range(2 * d)]
            for i in range(2 * d)
        ]
        found.append(Level(slowest, slow, fast))
    return found


def leap(flow: Flow, z: Point, guards: Sequence[Guard], limit: Real, known: list[Level]) -> Real:
    """A step, in windows and a power of 2, over which no guard vanishes; 0 if none is worth it."""
    w, a, _ = flow.start(z)
    start = [*w, *(q / flow.rho for q in a)]
    best = 0
    for level in known:
        room = min(limit, SPAN / (level.slowest * flow.window)) if level.slowest else limit
        if room < max(WORTH, 2 * best):
            continue
        step = 2 ** int(mp.floor(mp.log(room, 2)))
        motion = divided(level, start, step * flow.window)
        shares = [4**n for n in range(64) if step // 4**n >= WORTH and step // 4**n > best]
        for guard in sorted(guards, key=lambda guard: guard.value / guard.scale if guard.scale else mp.inf):
            slow, fall = split(flow, level, motion, guard, step * flow.window)
            shares = [share for share in shares if clear([c / share**n for n, c in enumerate(slow)], fall)]
            if not shares:
                break
        else:
            best = step // shares[0] if shares else best
    return mp.mpf(best)


def divided(level: Level, start: Sequence[Real], h: Real) -> tuple[list[Any], list[Sequence[Real]]]:
    """The sizes of the fast modes at the start, and the Taylor coefficients over h of the slow part of (w, a)."""
    sizes = [mp.fdot(mode.left, start) for mode in level.fast]
    slow = list(start)
    for size, mode in zip(sizes, level.fast, strict=True):
        slow = [mp.re(q - size * r) for q, r in zip(slow, mode.right, strict=True)]
    terms = [slow]
    for n in range(1, DEGREE + 1):
        terms.append([mp.fdot(row, terms[-1]) * h / n for row in level.slow])
    return sizes, terms


def split(
    flow: Flow, level: Level, motion: tuple[list[Any], list[Sequence[Real]]], guard: Guard, h: Real
) -> tuple[list[float], float]:
    """Taylor coefficients over h of a guard's slow part, and how far its fast part may fall, in one unit."""
    d, reals, fall, whole, amplitudes = flow.order, list[Any](), mp.zero, guard.value, list[Real]()
    sizes, terms = motion
    for size, mode in zip(sizes, level.fast, strict=True):
        head = mode.right[:d]
        kappa = size * (mp.fdot(guard.x, head) / mode.rate + mp.fdot(guard.w, head))
        amplitudes.append(abs(kappa))
        whole -= mp.re(kappa)
        if abs(mp.im(mode.rate)) > APART * abs(mode.rate):
            fall += abs(kappa)
        else:
            reals.append(mp.re(kappa))
    sums = [mp.fsum(reals[: n + 1]) for n in range(len(reals))]
    coefficients = [whole]
    for n, (last, now) in enumerate(itertools.pairwise(terms), 1):
        coefficients.append(mp.fdot(guard.x, last[:d]) * h / n + mp.fdot(guard.w, now[:d]))
    top, most = max(abs(c) for c in coefficients), max(amplitudes, default=mp.zero)
    if top <= NEGLIGIBLE * most and not fall and all(q > NEGLIGIBLE * most for q in sums):
        return [1.0], 0.0  # nothing but real modes that stay above zero
    fall += max([-q for q in sums if q < 0], default=mp.zero)
    unit = max(top, fall) or mp.one
    return [float(c / unit) for c in coefficients], float(fall / unit)


def clear(slow: Sequence[float], fall: float) -> bool:
    """Whether the slow part is above what the fast one may take, on the whole step."""
    floor = fall + MARGIN * sum(map(abs, slow))
    return slow[0] > floor and (2 * slow[0] - sum(map(abs, slow)) > floor or min(bernstein_floats(list(slow))) > floor)
