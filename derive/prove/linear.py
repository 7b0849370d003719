"""Linear systems z' = M z and their characteristic polynomials, as numbers of many digits."""

from collections.abc import Sequence
from operator import mul
from typing import Any

import mpmath

BITS = 640
"""Behind the point, of the integers that stand for z(t): 190 digits, for 40 of an integral that is 1e-45 at a time of 1e-6 s."""

Matrix = Sequence[Sequence[Any]]


def resolvent(matrix: Matrix) -> tuple[list[Any], list[Any]]:
    """The coefficients of det(s - M), and the matrices behind s^(n-1), s^(n-2), ... of (s - M)^-1 det(s - M), the highest
    first (Faddeev, Le Verrier).
    """
    whole = mpmath.matrix(matrix)
    size, largest = whole.rows, mpmath.mnorm(whole, 1)
    coefficients, adjugate = [mpmath.mpf(1)], [mpmath.eye(size)]
    for n in range(1, size + 1):
        moved = whole * adjugate[-1]
        c = -sum(moved[i, i] for i in range(size)) / n
        coefficients.append(mpmath.mpf(0) if abs(c) <= mpmath.mpf(10) ** -90 * largest**n else c)
        adjugate.append(moved + c * mpmath.eye(size))
    return coefficients, adjugate[:-1]


def roots(coefficients: Sequence[Any]) -> list[Any]:
    """The roots of a monic polynomial, by its coefficients behind the first; those at 0 are exact."""
    zeros = 0
    while zeros < len(coefficients) and coefficients[len(coefficients) - 1 - zeros] == 0:
        zeros += 1
    left = [1, *coefficients[: len(coefficients) - zeros]]
    if len(left) == 3:
        half, root = -left[1] / 2, mpmath.sqrt((left[1] / 2) ** 2 - left[2])
        found = [half + root, half - root]
    else:
        found = mpmath.polyroots(left, maxsteps=500, extraprec=1000) if len(left) > 1 else []
    return [*found, *[mpmath.mpf(0)] * zeros]


def chain(rates: Sequence[Any], count: int) -> list[list[Any]]:
    """M of f^(n-1), f^(n-2), ... f, its integral, ..., so many in all, with f the inverse transform of
    1/(s^n + c_1 s^(n-1) + ... + c_n): each is the integral of the one before, and at t = 0 the first is 1, the others 0.
    """
    below = [[mpmath.mpf(int(column == row)) for column in range(count)] for row in range(count - 1)]
    return [[*(-rate for rate in rates), *[mpmath.mpf(0)] * (count - len(rates))], *below]


def beside(one: Matrix, other: Matrix) -> list[list[Any]]:
    """M of two systems that share nothing."""
    return [[*row, *[mpmath.mpf(0)] * len(other)] for row in one] + [
        [*[mpmath.mpf(0)] * len(one), *row] for row in other
    ]


def response(rates: Sequence[Any], t: Any, count: int) -> list[Any]:
    """The members of a chain at t."""
    return along(chain(rates, count), [1, *[0] * (count - 1)], t)


def along(matrix: Matrix, start: Sequence[Any], t: Any) -> list[Any]:
    """z(t) = exp(M t) z(0)."""
    (*_, whole), _ = _propagators(matrix, t)
    z = [_fixed(value) for value in start]
    return [_number(_dot(row, z)) for row in whole]


def products(matrix: Matrix, start: Sequence[Any], t: Any) -> list[list[Any]]:
    """The integrals of z_i z_j from 0 to t: of Q' = M Q + Q M', by a series over a step, and then S(2h) = S + E S E'."""
    propagators, step = _propagators(matrix, t)
    z, h = [_fixed(value) for value in start], _fixed(t) >> len(propagators) - 1
    term = [[(one * other >> BITS) * h >> BITS for other in z] for one in z]
    total, n = term, 1
    while _counts(term):
        n += 1
        moved = _product(step, term)
        term = [[(moved[i][j] + moved[j][i]) // n for j in range(len(z))] for i in range(len(z))]
        total = _sum(total, term)
    for propagator in propagators[:-1]:
        total = _sum(total, _product(_product(propagator, total), [*zip(*propagator, strict=True)]))
    return [[_number(each) for each in row] for row in total]


def _propagators(matrix: Matrix, t: Any) -> tuple[list[list[list[int]]], list[list[int]]]:
    """exp(M h) of a step that is short beside all rates, of 2 h, ..., of t; and M h."""
    size, most = len(matrix), max(sum(map(abs, row)) for row in matrix) * t
    doublings = max(0, int(mpmath.ceil(mpmath.log(most, 2)))) if most else 0
    h = t / 2**doublings
    step = [[_fixed(value * h) for value in row] for row in matrix]
    term = found = [[int(i == j) << BITS for j in range(size)] for i in range(size)]
    n = 0
    while _counts(term):
        n += 1
        term = [[each // n for each in row] for row in _product(step, term)]
        found = _sum(found, term)
    propagators = [found]
    for _ in range(doublings):
        propagators.append(_product(propagators[-1], propagators[-1]))
    return propagators, step


def _counts(term: Matrix) -> bool:
    """Whether a term is more than what rounding leaves."""
    return any(abs(each) >> 32 for row in term for each in row)


def _fixed(value: Any) -> int:
    return int(mpmath.ldexp(mpmath.mpf(value), BITS))


def _number(value: int) -> Any:
    return mpmath.ldexp(mpmath.mpf(value), -BITS)


def _dot(one: Sequence[int], other: Sequence[int]) -> int:
    return sum(map(mul, one, other)) >> BITS


def _product(one: Sequence[Sequence[int]], other: Sequence[Sequence[int]]) -> list[list[int]]:
    columns = [*zip(*other, strict=True)]
    return [[_dot(row, column) for column in columns] for row in one]


def _sum(one: Sequence[Sequence[int]], other: Sequence[Sequence[int]]) -> list[list[int]]:
    return [[a + b for a, b in zip(*rows, strict=True)] for rows in zip(one, other, strict=True)]
