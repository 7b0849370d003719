"""The motion inside one phase, a homogeneous linear system, as Taylor series and as a matrix exponential.

    x1' = v1            v1' = n1 - b1 v1/m_eff        n1' = -k (v1 - v2)/m_eff
    y'  = v1 - v2       v2' = n2 - b2 v2/m_s          n2' =  k (v1 - v2)/m_s
    n1  = (k (c - y) - gamma2 u)/m_eff - f1 sign_1                      n2  = k y/m_s - g - f2 sign_2

A held mass keeps v_i = 0; its n_i, with sign_i = 0, is what pulls at it. A window is a step h with L h <= 4, L a norm
of the system in the units (nu, rho nu): there the series is cut where the next term is below 2^-230 nu, and its
coefficients are fixed-point integers. Longer steps use exp(A h) by scaling and squaring.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..polynomials import horner
from .records import GUARD, Matrix, Point, Real, Robot, mp

REACH = 4  # L h of a window
MEMORY = 12  # halvings kept: long steps come in powers of two
LEADING = 8  # orders in which an exact zero at the left end is looked for: a system of order 6 has no later ones


class Flow:
    """The coefficients of one combination of moving and held masses."""

    def __init__(self, robot: Robot, moving: tuple[bool, bool]) -> None:
        self.robot, self.moving = robot, moving
        self.damp = (robot.b1 / robot.m_eff, robot.b2 / robot.m_s)
        self.stiff = (robot.k / robot.m_eff, robot.k / robot.m_s)
        both = 1 + (moving[0] and moving[1])
        rates = [mp.sqrt(both * self.stiff[i]) for i in (0, 1) if moving[i]]
        rates += [self.damp[i] for i in (0, 1) if moving[i]]
        self.rho = max(rates, default=mp.one)
        self.norm = 2 * self.rho  # of v: rho + damp <= 2 rho; of n/rho: both*stiff/rho <= rho
        self.window = REACH / self.norm
        self.bits = mp.prec + 24
        self.terms = series_length(self.bits - 48)
        self.spectrum: Any = None  # the groups of modes, filled by skip.py at first use
        self.powers: dict[Real, Matrix] = {}

    def matrix(self) -> Matrix:
        """A of z' = A z in the order of Point."""
        zero = mp.zero
        a = [[zero] * 6 for _ in range(6)]
        m1, m2 = (mp.mpf(int(flag)) for flag in self.moving)
        a[0][1] = m1
        a[1] = [zero, -self.damp[0] * m1, m1, zero, zero, zero]
        a[2][1], a[2][3] = -self.stiff[0] * m1, self.stiff[0] * m2
        a[3] = [zero, zero, zero, -self.damp[1] * m2, m2, zero]
        a[4][1], a[4][3] = self.stiff[1] * m1, -self.stiff[1] * m2
        a[5][1], a[5][3] = m1, -m2
        return a


def series_length(bits: int) -> int:
    """The order at which REACH^n/n! falls below 2^-bits; what follows is less than twice the next term."""
    order, term = 0, mp.one
    while term > mp.ldexp(1, -bits):
        order += 1
        term *= mp.mpf(REACH) / order
    return order


class Series(NamedTuple):
    """Fixed-point Taylor coefficients c_n h^n, and how large the terms summed into the first ones were."""

    h: Real
    nu: Real  # unit of v; n is in rho nu, x1 - x1(0) and y - y(0) in nu h
    v1: list[int]
    n1: list[int]
    v2: list[int]
    n2: list[int]
    size: tuple[list[int], ...]  # of v1, n1, v2, n2, orders below LEADING


def fixed(value: Real, bits: int) -> int:
    """value 2^bits as an integer."""
    return int(mp.nint(mp.ldexp(value, bits)))


def expand(flow: Flow, z: Point, h: Real, terms: int | None = None) -> Series:
    """The Taylor series of the velocities and loads from z over [0, h]."""
    bits, order = flow.bits, terms or flow.terms
    loads = [abs(n) / flow.rho for n, moves in zip((z.n1, z.n2), flow.moving, strict=True) if moves]
    nu = max(abs(z.v1), abs(z.v2), *loads) or mp.one
    start = [fixed(q, bits) for q in (z.v1 / nu, z.n1 / (nu * flow.rho), z.v2 / nu, z.n2 / (nu * flow.rho))]
    theta, d1, d2 = (fixed(q * h, bits) for q in (flow.rho, *flow.damp))
    s1, s2 = (fixed(q * h / flow.rho, bits) for q in flow.stiff)
    m1, m2 = flow.moving
    v1, n1, v2, n2 = ([q] for q in start)
    w1, l1, w2, l2 = ([abs(q)] for q in start)
    for n in range(order):
        p, q, rate, rest = v1[n], v2[n], (n + 1) << bits, v1[n] - v2[n]
        v1.append((theta * n1[n] - d1 * p) // rate if m1 else 0)
        v2.append((theta * n2[n] - d2 * q) // rate if m2 else 0)
        n1.append(-s1 * rest // rate)
        n2.append(s2 * rest // rate)
        if n + 1 < LEADING:
            w1.append((theta * l1[n] + d1 * w1[n]) // rate if m1 else 0)
            w2.append((theta * l2[n] + d2 * w2[n]) // rate if m2 else 0)
            l1.append(s1 * (w1[n] + w2[n]) // rate)
            l2.append(s2 * (w1[n] + w2[n]) // rate)
    return Series(h, nu, v1, n1, v2, n2, (w1, l1, w2, l2))


def integral(coefficients: Sequence[int]) -> list[int]:
    """The series of the integral from 0, in the unit times h."""
    return [0, *(c // (n + 1) for n, c in enumerate(coefficients[:-1]))]


def evaluate(flow: Flow, z: Point, s: Series, tau: int) -> Point:
    """The state at tau h, 0 <= tau <= 2^bits."""

    def value(coefficients: Sequence[int], unit: Real) -> Real:
        return mp.ldexp(mp.mpf(horner(coefficients, tau, flow.bits)), -flow.bits) * unit

    load = flow.rho * s.nu
    x1 = z.x1 + value(integral(s.v1), s.nu * s.h)
    y = z.y + value(integral([a - b for a, b in zip(s.v1, s.v2, strict=True)]), s.nu * s.h)
    return Point(x1, value(s.v1, s.nu), value(s.n1, load), value(s.v2, s.nu), value(s.n2, load), y)


def multiply(a: Matrix, b: Matrix) -> Matrix:
    """The product of two matrices; rows of a are sparse."""
    columns = len(b[0])
    product = []
    for row in a:
        terms = [(q, b[j]) for j, q in enumerate(row) if q]
        product.append([mp.fsum(q * other[i] for q, other in terms) for i in range(columns)])
    return product


def identity(size: int) -> Matrix:
    return [[mp.mpf(int(i == j)) for j in range(size)] for i in range(size)]


def exponential(flow: Flow, h: Real) -> Matrix:
    """exp(A h) by scaling and squaring, in units in which A has the norm 2 rho."""
    if h in flow.powers:
        return flow.powers[h]
    with mp.extradps(GUARD):
        if h / 2 in flow.powers:
            flow.powers[h] = multiply(flow.powers[h / 2], flow.powers[h / 2])
            return flow.powers[h]
        halvings = max(0, int(mp.ceil(mp.log(flow.norm * h, 2))) + 1)
        a = [[q * mp.ldexp(h, -halvings) for q in row] for row in flow.matrix()]
        total, term, n = identity(6), identity(6), 0
        while n < 3 or mp.mpf(2) ** -n > mp.eps * mp.factorial(n):
            n += 1
            term = [[q / n for q in row] for row in multiply(a, term)]
            total = [[p + q for p, q in zip(*rows, strict=True)] for rows in zip(total, term, strict=True)]
        for halving in range(halvings):
            if halvings - halving <= MEMORY:
                flow.powers[mp.ldexp(h, halving - halvings)] = total
            total = multiply(total, total)
    flow.powers[h] = total
    return total


def in_window(flow: Flow, h: Real) -> bool:
    """Whether the series may be used over h; a step read back from two times may be a rounding longer."""
    return bool(h <= flow.window * (1 + mp.ldexp(1, -20)))


def advance(flow: Flow, z: Point, h: Real) -> Point:
    """The state h later in the same phase."""
    if not any(flow.moving) or h == 0:
        return z
    if in_window(flow, h):
        return evaluate(flow, z, expand(flow, z, h), 1 << flow.bits)
    return Point(*(row[0] for row in multiply(exponential(flow, h), [[q] for q in z])))
