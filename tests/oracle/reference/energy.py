"""Energies, and the work that went where: products of Taylor series in a window, Gramians over longer steps.

E = m_s v2^2/2 + m_s g x2 + k (x2 - L0 - c)^2/2
H = m_eff v1^2/2 + m_s v2^2/2 + m_s g x2 + k (x1 - x2 + L0 + c)^2/2
W(h) = int_0^h z z^T dt,    W(2 h) = W(h) + exp(A h) W(h) exp(A h)^T
"""

from __future__ import annotations

from collections.abc import Sequence

from .motion import Flow, advance, expand, exponential, in_window, integral, multiply
from .records import GUARD, Matrix, Point, Real, Robot, State, mp

FIELDS = (
    "motor_work",
    "offset_work",
    "viscous_1",
    "viscous_2",
    "coulomb_1",
    "coulomb_2",
    "stop_loss",
    "spring_work",
)


def energies(r: Robot, s: State, y: Real) -> tuple[Real, Real]:
    """Energy of the body with its spring coordinate, and of the whole robot."""
    body = r.m_s * s.v2**2 / 2 + r.m_s * r.g * s.x2
    return body + r.k * (s.x2 - r.L0 - r.c) ** 2 / 2, body + r.m_eff * s.v1**2 / 2 + r.k * y**2 / 2


def gramian(flow: Flow, z: Point, h: Real) -> Matrix:
    """int z z^T dt over [0, h] from z at 0."""
    with mp.extradps(GUARD):
        halvings = max(0, int(mp.ceil(mp.log(flow.norm * h, 2))) + 1)
        step = mp.ldexp(h, -halvings)
        a = [[q * step for q in row] for row in flow.matrix()]
        term = [[p * q for q in z] for p in z]
        total, n, weight = [[step * q for q in row] for row in term], 0, mp.one
        while n < 3 or weight > mp.eps:
            n += 1
            half = multiply(a, term)
            term = [[(half[i][j] + half[j][i]) / n for j in range(6)] for i in range(6)]
            total = [
                [p + q * step / (n + 1) for p, q in zip(*rows, strict=True)] for rows in zip(total, term, strict=True)
            ]
            weight *= mp.mpf(2) / n  # the terms fall like (2 |A| step)^n/n!
        e = exponential(flow, step)
        for _ in range(halvings):
            moved = multiply(multiply(e, total), [list(row) for row in zip(*e, strict=True)])
            total = [[p + q for p, q in zip(*rows, strict=True)] for rows in zip(total, moved, strict=True)]
            e = multiply(e, e)
        return total


def products(flow: Flow, z: Point, h: Real) -> dict[str, Real]:
    """int v1^2, v2^2 and x1 v2 dt over [0, h], h within a window: the products of the series, term by term."""
    s = expand(flow, z, h)
    v1, v2, x1 = (pairs(p, q, flow.bits) for p, q in ((s.v1, s.v1), (s.v2, s.v2), (integral(s.v1), s.v2)))
    unit = mp.ldexp(s.nu**2 * h, -flow.bits)
    dx2 = mp.ldexp(mp.mpf(sum(integral(s.v2))), -flow.bits) * s.nu * h
    return {"v1 v1": v1 * unit, "v2 v2": v2 * unit, "x1 v2": x1 * unit * h + z.x1 * dx2}


def pairs(p: Sequence[int], q: Sequence[int], bits: int) -> int:
    """int_0^1 of the product of two series."""
    rows = [0] * (len(p) + len(q))
    for i, a in enumerate(p):
        for j, b in enumerate(q, i):
            rows[j] += a * b
    return sum(c // (n + 1) for n, c in enumerate(rows)) >> bits


def quadratics(flow: Flow, z: Point, h: Real) -> dict[str, Real]:
    """The same integrals over any h."""
    if in_window(flow, h):
        return products(flow, z, h)
    w = gramian(flow, z, h)
    return {"v1 v1": w[1][1], "v2 v2": w[3][3], "x1 v2": w[0][3]}


def work(flow: Flow, modes: tuple[int, int], u: Real, z: Point, h: Real) -> dict[str, Real]:
    """The ledger of one stretch of a phase, from z over a time h; the stops are no part of it."""
    if not h or not any(flow.moving):
        return dict.fromkeys(FIELDS, mp.zero)
    r, end, q = flow.robot, advance(flow, z, h), quadratics(flow, z, h)
    dx1 = end.x1 - z.x1
    dx2 = dx1 - (end.y - z.y)
    return {
        "motor_work": -r.gamma2 * u * dx1,
        "offset_work": r.k * r.c * dx1,
        "viscous_1": -r.b1 * q["v1 v1"],
        "viscous_2": -r.b2 * q["v2 v2"],
        "coulomb_1": -r.m_eff * r.f1 * modes[0] * dx1,
        "coulomb_2": -r.m_s * r.f2 * modes[1] * dx2,
        "stop_loss": mp.zero,
        "spring_work": r.k * q["x1 v2"],
    }
