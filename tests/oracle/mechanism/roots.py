"""The first sign change of a Taylor polynomial on [0, 1], certified by Bernstein coefficients in integers.

    p(t) = sum_j b_j C(N, j) t^j (1 - t)^(N - j)        roots in (0, 1) <= sign changes of b_0, ..., b_N

p is positive just after 0. No sign change: no root. One: one root. Where p falls and rises once, its least value
decides; anything else is halved. A minimum within `touch` of zero is a touch and no crossing.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from math import comb

from .flow import BITS, horner

NOISE = 1 << 24  # rounding of the coefficients, in units of 2^-BITS
SCREEN = 36  # degree of the screening in floats
NEAR = 1e-6  # what comes closer to zero, relative to the largest coefficient, is looked at in integers
NARROW = BITS - 40  # halvings after which an interval is a point
NONE = -1  # no root


@dataclass
class Search:
    """One polynomial, what counts as a touch, and the extrema (place, value) that were looked at."""

    c: list[int]
    touch: int
    minima: list[tuple[int, int]] = field(default_factory=list[tuple[int, int]])

    @property
    def slope(self) -> list[int]:
        return [n * q for n, q in enumerate(self.c)][1:]


@lru_cache
def binomials(degree: int) -> tuple[int, ...]:
    return tuple(comb(degree, i) for i in range(degree + 1))


def bernstein_floats(coefficients: list[float]) -> list[float]:
    """Bernstein coefficients; every weight is below one, so the error is below 1e-14 of the sum of magnitudes."""
    degree = len(coefficients) - 1
    b = [c / n for c, n in zip(coefficients, binomials(degree), strict=True)]
    for j in range(1, degree + 1):
        for i in range(degree, j - 1, -1):
            b[i] += b[i - 1]
    return b


def bernstein(coefficients: list[int]) -> list[int]:
    degree = len(coefficients) - 1
    b = [c // n for c, n in zip(coefficients, binomials(degree), strict=True)]
    for j in range(1, degree + 1):
        for i in range(degree, j - 1, -1):
            b[i] += b[i - 1]
    return b


def stays_positive(c: list[int]) -> bool:
    """Whether the polynomial stays clear of zero on [0, 1], by its sum of magnitudes, then by Bernstein in floats."""
    if c[0] <= 0:
        return False
    rest = sum(map(abs, c[1:]))
    if c[0] > rest + (c[0] >> 10):
        return True
    scale = max(*map(abs, c), 1)
    floats = [q / scale for q in c[: SCREEN + 1]]
    tail = sum(map(abs, c[SCREEN + 1 :])) / scale
    return min(bernstein_floats(floats)) > tail + NEAR


def halves(b: list[int]) -> tuple[list[int], list[int]]:
    """De Casteljau: the coefficients on both halves."""
    left, right = [b[0]], [b[-1]]
    row: list[int] = b
    while len(row) > 1:
        row = [(p + q) >> 1 for p, q in zip(row, row[1:], strict=False)]
        left.append(row[0])
        right.append(row[-1])
    return left, right[::-1]


def changes(b: list[int]) -> int:
    signs = [q > 0 for q in b if abs(q) > NOISE]
    return sum(p != q for p, q in zip(signs, signs[1:], strict=False))


def bracketed(c: list[int], low: int, high: int) -> int:
    """The root in [low, high] of a polynomial that changes sign there once: Newton steps inside a shrinking bracket."""
    slope = [n * q for n, q in enumerate(c)][1:]
    rising = horner(c, high) > 0
    x = (low + high) >> 1
    for _ in range(2 * BITS):
        value = horner(c, x)
        if value == 0 or high - low <= 2:
            return x
        if (value > 0) == rising:
            high = x
        else:
            low = x
        rate = horner(slope, x)
        step = -(value << BITS) // rate if rate else 0
        if rate and abs(step) <= 1:
            return x
        x = x + step if rate and low < x + step < high else (low + high) >> 1
    return x


def first_root(search: Search) -> int | None:
    """The first place, in units of 2^-BITS of the window, where p, positive just after 0, falls through zero."""
    stack = [(bernstein(search.c), 0, 0)]  # coefficients, left end, halvings
    while stack:
        b, left, depth = stack.pop()
        found = decided(search, b, left, (1 << BITS) >> depth)
        if found == NONE:
            continue
        if found is not None:
            return found
        if depth >= NARROW:
            if b[-1] < -search.touch:
                return left
            continue
        near, far = halves(b)
        stack.append((far, left + ((1 << BITS) >> (depth + 1)), depth + 1))
        stack.append((near, left, depth + 1))
    return None


def decided(search: Search, b: list[int], left: int, width: int) -> int | None:
    """The root in an interval, NONE if there is none, None if that is not known yet."""
    count = changes(b)
    if count == 0:
        negative = any(q < -NOISE for q in b)
        return left if negative else NONE
    if count == 1:
        rises = next(q for q in reversed(b) if abs(q) > NOISE) > 0
        return left if rises else bracketed(search.c, left, left + width)
    differences = [q - p for p, q in zip(b, b[1:], strict=False)]
    bends = changes(differences)
    if bends == 0:
        return NONE
    if bends > 1 or differences[-1] < 0:
        return None
    bottom = bracketed(search.slope, left, left + width)
    value = horner(search.c, bottom)
    search.minima.append((bottom, value))
    return bracketed(search.c, left, bottom) if value < -search.touch else NONE
