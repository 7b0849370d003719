"""The motion while one set of elements is held: a homogeneous linear system, as Taylor series and as an exponential.

    v = Z w     w' = a - D w     a' = -S w     x' = w     q = q(0) + Z x     r = r(0) - K Z x
    a = P r     P = (Z^T M Z)^-1 Z^T     D = P B Z     S = P K Z

Z spans the velocities that the held directions C leave, C Z = 0. r are the forces on the coordinates but the viscous
ones. The force that would move held elements is G (r - B v), G = (C M^-1 C^T)^-1 C M^-1. An unsaturated law
u = l_q q + l_v v + l_0 belongs to K and B. A window is a step h with 2 rho h = 4, the norm of the system in the units
(nu, rho nu) of (w, a) being at most 2 rho: there the series is cut where the next term is below 2^-BITS nu, and its
coefficients are fixed-point integers.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

from ..polynomials import horner
from .equations import Row, System
from .numbers import (
    Matrix,
    Real,
    Vector,
    apply,
    dot,
    free_rows,
    inverse,
    magnitude,
    mp,
    null_space,
    outer,
    plus,
    times,
    total,
    transpose,
)

REACH = 4  # 2 rho h of a window
BITS = 340
LEADING = 10  # orders in which an exact zero at the left end is looked for


@dataclass(frozen=True)
class Point:
    """Position, velocity, and the forces other than viscous ones: springs, constants, input, friction that slips."""

    q: Vector
    v: Vector
    r: Vector


def fixed(value: Real, bits: int = BITS) -> int:
    """value 2^bits as an integer."""
    return int(mp.nint(mp.ldexp(value, bits)))


def loose(value: int) -> Real:
    """The number that an integer stands for."""
    return mp.ldexp(mp.mpf(value), -BITS)


def series_length() -> int:
    """The order at which REACH^n/n! falls below 2^-BITS; what follows is less than twice the next term."""
    order, term = 0, mp.one
    while term > mp.ldexp(1, -BITS):
        order += 1
        term *= mp.mpf(REACH) / order
    return order


TERMS = series_length()


class Flow:
    """The system of one set of held elements, the law saturated or not. Raises ZeroDivisionError if they depend."""

    def __init__(self, system: System, held: tuple[int, ...], lawful: bool) -> None:
        self.system, self.held, self.lawful = system, held, lawful
        none = (mp.zero,) * system.size
        row = system.law.row if lawful and system.law is not None else Row(none, none, mp.zero)
        self.K = plus(system.stiffness, outer(system.input, row.q, -1))
        self.B = plus(system.damping, outer(system.input, row.v, -1))
        self.C: Matrix = tuple(system.elements[e].direction for e in held)
        self.Z = null_space(self.C, system.size)
        self.order = len(self.Z[0])
        if held:
            CM = times(self.C, system.mobility)
            self.G: Matrix = times(inverse(times(CM, transpose(self.C))), CM)
        if self.order:
            Zt = transpose(self.Z)
            self.P: Matrix = times(inverse(times(Zt, times(system.mass, self.Z))), Zt)
            self.KZ, self.BZ = times(self.K, self.Z), times(self.B, self.Z)
            self.S, self.D = times(self.P, self.KZ), times(self.P, self.BZ)
            self.MZ = times(system.mass, self.Z)
            unit = tuple(tuple(mp.mpf(int(i == j)) for j in range(system.size)) for i in range(system.size))
            self.blocked = plus(unit, times(self.MZ, tuple(tuple(-q for q in row) for row in self.P)))
        self.powers: dict[Real, Matrix] = {}  # solutions over long steps, and their integrals of w_i w_j
        self.gramians: dict[tuple[tuple[int, int], Real], Matrix] = {}

    @cached_property
    def free(self) -> tuple[int, ...]:
        """The coordinate that is each entry of w."""
        return free_rows(self.Z)

    @cached_property
    def rho(self) -> Real:
        stiff = max((mp.fsum(row, absolute=True) for row in self.S), default=mp.zero)
        damped = max((mp.fsum(row, absolute=True) for row in self.D), default=mp.zero)
        return max(mp.sqrt(stiff), damped, 1 / self.system.horizon)

    @cached_property
    def window(self) -> Real:
        return REACH / (2 * self.rho)

    def start(self, z: Point) -> tuple[Vector, Vector, Vector]:
        """w, a and the magnitudes that a is made of."""
        w = tuple(z.v[i] for i in self.free)
        return w, apply(self.P, z.r), tuple(magnitude(row, z.r) for row in self.P)

    @cached_property
    def integers(self) -> tuple[list[list[int]], list[list[int]], int]:
        """D h, S h/rho and rho h as fixed-point integers."""
        h = self.window
        d = [[fixed(q * h) for q in row] for row in self.D]
        s = [[fixed(q * h / self.rho) for q in row] for row in self.S]
        return d, s, fixed(self.rho * h)


@dataclass(frozen=True)
class Series:
    """Taylor coefficients of w in units of nu and of x in units of nu h, over one window h."""

    flow: Flow
    nu: Real
    w: list[list[int]]
    a: list[list[int]]  # in units of nu rho
    x: list[list[int]]
    w_size: list[list[int]] = field(
        default_factory=list[list[int]]
    )  # sums of magnitudes of the terms, orders below LEADING
    x_size: list[list[int]] = field(default_factory=list[list[int]])


def expand(flow: Flow, z: Point, terms: int = TERMS) -> Series:
    """The Taylor series from z over one window."""
    w0, a0, a_size = flow.start(z)
    nu = max((max(abs(p), abs(q) / flow.rho) for p, q in zip(w0, a0, strict=True)), default=mp.zero) or mp.one
    d, s, theta = flow.integers
    start = [fixed(q / nu) for q in w0], [fixed(q / (flow.rho * nu)) for q in a0]
    size = [abs(q) for q in start[0]], [max(fixed(q / (flow.rho * nu)), 1) for q in a_size]
    w, accelerations = recurrence(*start, d, s, theta, terms)
    spread, _ = recurrence(
        *size, [[-abs(q) for q in row] for row in d], [[-abs(q) for q in row] for row in s], theta, LEADING
    )
    return Series(flow, nu, w, accelerations, [integral(q) for q in w], spread, [integral(q) for q in spread])


def recurrence(
    w0: list[int], a0: list[int], d: list[list[int]], s: list[list[int]], theta: int, terms: int
) -> tuple[list[list[int]], list[list[int]]]:
    """w_(n+1) = (theta a_n - D w_n)/(n+1), a_(n+1) = -S w_n/(n+1)."""
    rows = range(len(w0))
    w, a = [[q] for q in w0], [[q] for q in a0]
    for n in range(1, terms):
        last, rate = [c[-1] for c in w], n << BITS
        for i in rows:
            w[i].append((theta * a[i][-1] - sum(p * q for p, q in zip(d[i], last, strict=True))) // rate)
        for i in rows:
            a[i].append(-sum(p * q for p, q in zip(s[i], last, strict=True)) // rate)
    return w, a


def integral(coefficients: list[int]) -> list[int]:
    """The series of the integral from 0, in the unit times h."""
    return [0, *(c // n for n, c in enumerate(coefficients[:-1], 1))]


def at(series: Series, z: Point, tau: int) -> Point:
    """The state at the place tau of the window."""
    flow, nu = series.flow, series.nu
    x = tuple(loose(horner(c, tau, BITS)) * nu * flow.window for c in series.x)
    w = tuple(loose(horner(c, tau, BITS)) * nu for c in series.w)
    a = tuple(loose(horner(c, tau, BITS)) * nu * flow.rho for c in series.a)
    return moved(flow, z, x, w, a)


def moved(flow: Flow, z: Point, x: Vector, w: Vector, a: Vector) -> Point:
    """The state after the displacement x, with w and a.

    r = M Z a + (1 - M Z P) (r(0) - K Z x): what accelerates keeps its relative accuracy while it dies away.
    """
    q = tuple(total(p, dot(row, x)) for p, row in zip(z.q, flow.Z, strict=True))
    r = tuple(total(p, -dot(row, x)) for p, row in zip(z.r, flow.KZ, strict=True))
    return Point(q, apply(flow.Z, w), plus_vectors(apply(flow.MZ, a), apply(flow.blocked, r)))


def plus_vectors(a: Vector, b: Vector) -> Vector:
    return tuple(total(p, q) for p, q in zip(a, b, strict=True))


def advance(flow: Flow, z: Point, h: Real) -> Point:
    """The state h later while the same elements are held."""
    if not flow.order or h == 0:
        return z
    if h <= flow.window:
        return at(expand(flow, z), z, fixed(h / flow.window))
    d = flow.order
    w, a, _ = flow.start(z)
    power = exponential(flow, h)
    state = tuple(mp.fdot(row, (*w, *a)) for row in power)
    return moved(flow, z, state[2 * d :], state[:d], state[d : 2 * d])


def exponential(flow: Flow, h: Real) -> Matrix:
    """The rows w, a, x at h of the solution from w, a: by its series, then doubled."""
    if h in flow.powers:
        return flow.powers[h]
    if h <= flow.window:
        found = short_exponential(flow, h)
    else:
        half = exponential(flow, h / 2)
        d = 2 * flow.order
        square = [[mp.fdot(row, column) for column in zip(*half[:d], strict=True)] for row in half]
        for i in range(flow.order):
            square[d + i] = [p + q for p, q in zip(square[d + i], half[d + i], strict=True)]
        found = tuple(tuple(row) for row in square)
    if len(flow.powers) < 64:
        flow.powers[h] = found
    return found


def short_exponential(flow: Flow, h: Real) -> Matrix:
    """The same within a window: w' = a - D w, a' = -S w, x' = w, a column per start."""
    d = flow.order
    columns = list[list[Real]]()
    for unit in range(2 * d):
        w = [mp.mpf(int(unit == i)) for i in range(d)]
        a = [mp.mpf(int(unit == d + i)) for i in range(d)]
        sums = [*w, *a, *[mp.zero] * d]
        for n in range(1, TERMS):
            x = [q * h / n for q in w]
            w, a = (
                [(a[i] - mp.fdot(flow.D[i], w)) * h / n for i in range(d)],
                [-mp.fdot(flow.S[i], w) * h / n for i in range(d)],
            )
            sums = [p + q for p, q in zip(sums, (*w, *a, *x), strict=True)]
        columns.append(sums)
    return tuple(zip(*columns, strict=True))
