"""The first sign change of a Taylor polynomial on [0, 1], certified by Bernstein coefficients in exact integers.

    p(tau) = sum_j b_j C(N, j) tau^j (1 - tau)^(N - j)        roots in (0, 1) <= sign changes of b_0, ..., b_N

No change: no root. One change: one root, found by Newton steps inside its bracket. More: either the derivative changes
sign once, then the extremum decides, or the interval is halved. What was cut off the series is far below `noise`.
Coefficients and places are integers of unit 2^-bits. Both oracles find the events of a window here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from math import comb

Note = Callable[[int, int], None]  # called with (place, height) of each extremum that was looked at
SCREEN = 36  # degree of the screening in floats
NEAR = 1e-6  # what comes closer to zero than this, relative to the largest coefficient, is looked at in integers
DEEP = 160  # halvings; what is left is a cluster narrower than 1e-48


def horner(coefficients: Sequence[int], tau: int, bits: int) -> int:
    """The value of the polynomial at tau."""
    value = 0
    for c in reversed(coefficients):
        value = (value * tau >> bits) + c
    return value


@lru_cache
def binomials(degree: int) -> tuple[int, ...]:
    return tuple(comb(degree, i) for i in range(degree + 1))


def bernstein_floats(coefficients: Sequence[float]) -> list[float]:
    """Bernstein coefficients; every weight is below one, so the error is below 1e-14 of the sum of magnitudes."""
    degree = len(coefficients) - 1
    b = [c / n for c, n in zip(coefficients, binomials(degree), strict=True)]
    for j in range(1, degree + 1):
        for i in range(degree, j - 1, -1):
            b[i] += b[i - 1]
    return b


def bernstein(coefficients: Sequence[int]) -> list[int]:
    degree = len(coefficients) - 1
    b = [c // n for c, n in zip(coefficients, binomials(degree), strict=True)]
    for j in range(1, degree + 1):
        for i in range(degree, j - 1, -1):
            b[i] += b[i - 1]
    return b


def stays_positive(coefficients: Sequence[int]) -> bool:
    """Whether the polynomial stays clear of zero on [0, 1], by sums and then in floats."""
    if 2 * coefficients[0] > 2 * sum(map(abs, coefficients[1:])) + coefficients[0] // 1000:
        return True
    scale = max(map(abs, coefficients))
    if not scale:
        return False
    floats = [c / scale for c in coefficients]
    tail = sum(map(abs, floats[SCREEN + 1 :]))
    return min(bernstein_floats(floats[: SCREEN + 1])) > tail + NEAR


def changes(b: Sequence[int], noise: int) -> tuple[int, int]:
    """Sign changes, and the first sign; what is below the noise has none."""
    signs = [1 if c > 0 else -1 for c in b if abs(c) > noise]
    return sum(p != q for p, q in zip(signs, signs[1:], strict=False)), signs[0] if signs else 0


def halve(b: Sequence[int]) -> tuple[list[int], list[int]]:
    """De Casteljau: the coefficients on both halves."""
    row, left, right = list(b), [b[0]], [b[-1]]
    while len(row) > 1:
        row = [(p + q) >> 1 for p, q in zip(row, row[1:], strict=False)]
        left.append(row[0])
        right.append(row[-1])
    return left, right[::-1]


def derivative(coefficients: Sequence[int]) -> list[int]:
    return [n * c for n, c in enumerate(coefficients)][1:]


def refine(coefficients: Sequence[int], low: int, high: int, bits: int) -> int:
    """The root in [low, high] of a polynomial that changes sign there once: Newton, kept inside a shrinking bracket."""
    slope = derivative(coefficients)
    falling = horner(coefficients, low, bits) > 0
    tau = (low + high) >> 1
    newton = 60
    while high - low > 4:
        value = horner(coefficients, tau, bits)
        if (value > 0) == falling:
            low = tau
        else:
            high = tau
        rate = horner(slope, tau, bits)
        step = (value << bits) // rate if rate and newton else 0
        newton -= newton > 0
        following = tau - step
        if abs(step) <= 2 and rate and newton:
            return tau
        tau = following if newton and low < following < high else (low + high) >> 1
    return tau


def first_crossing(coefficients: Sequence[int], bits: int, touch: int, note: Note) -> int | None:
    """Where a polynomial that starts above zero first goes below it, as an integer of unit 2^-bits; None if it stays.

    A minimum not deeper than `touch` is no crossing. `note` is called for every extremum that decides.
    """
    if stays_positive(coefficients):
        return None
    noise = max(map(abs, coefficients)) >> (bits * 2 // 3)
    pieces = [(bernstein(coefficients), 0, 1 << bits)]  # a stack, leftmost piece on top
    while pieces:
        b, low, width = pieces.pop()
        count, sign = changes(b, noise)
        if sign < 0:
            return low  # the crossing fell on the border of two pieces
        if count == 1:
            return refine(coefficients, low, low + width, bits)
        if count == 0 and (sign == 0 or min(b) > max(b) >> 20):
            continue
        found = minimum(coefficients, b, low, width, bits, noise, note)
        if found is not None:
            lowest, height = found
            if height < -touch:
                return refine(coefficients, low, lowest, bits)
            continue
        if count == 0:
            continue
        if width >> (bits - DEEP) == 0:
            if sign > 0 > b[-1] + touch:
                return low
            continue
        left, right = halve(b)
        pieces += [(right, low + width // 2, width // 2), (left, low, width // 2)]
    return None


def minimum(
    coefficients: Sequence[int], b: Sequence[int], low: int, width: int, bits: int, noise: int, note: Note
) -> tuple[int, int] | None:
    """Place and height of the lowest point inside, if it is the only extremum between two ends above zero."""
    turns, direction = changes([q - p for p, q in zip(b, b[1:], strict=False)], noise)
    if turns != 1 or direction > 0 or b[-1] <= noise:
        return None
    place = refine(derivative(coefficients), low, low + width, bits)
    height = horner(coefficients, place, bits)
    note(place, height)
    return place, height
