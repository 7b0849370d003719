"""Long steps over stretches where the fast modes have died away: no event function can vanish there.

    g(t) = sum over groups of modes g_G(t),    chi_G(d/dt) g_G = 0,    g >= min sum slow g_G - sum depth fast g_G

The roots of t^2 or t times the characteristic polynomial are put in groups of like magnitude; the parts of g come from
its derivatives by one linear system per spectrum. Slow parts are Taylor polynomials over a step suited to them, bounded
below by Bernstein coefficients; fast parts by a norm that never grows or by their sign. So a stiff overdamped robot
needs some windows for each group of modes and not one for each of its shortest time constants.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial
from typing import Any, NamedTuple

from ..polynomials import bernstein_floats
from .motion import Flow
from .records import GUARD, Matrix, Real, mp

GAP = 4  # ratio of magnitudes that separates two groups
NARROW = 1e-15  # relative distance below which two roots are one pair of real ones
SPAN = 3  # L H of a long step
DEGREE = 32  # 3^33/33! < 1e-21: what is cut off is below MARGIN
MARGIN = 1e-11  # relative; the floats here are good to 1e-13
WORTH = 4  # windows a long step must replace


class Group(NamedTuple):
    """Modes of like magnitude: monic chi (low to high), norm of its companion, its part of a derivative vector."""

    chi: tuple[Real, ...]
    norm: Real
    rows: Matrix
    bound: Matrix | None  # Lyapunov matrix of three modes


def characteristic(flow: Flow) -> tuple[int, tuple[Real, ...]]:
    """Zero roots and the other factor (monic, low to high) for the positions, in units of the window."""
    h, (d1, d2), (s1, s2) = flow.window, flow.damp, flow.stiff
    if not all(flow.moving):
        d, s = (d1, s1) if flow.moving[0] else (d2, s2)
        return 1, (s * h**2, d * h, mp.one)
    linear = (d1 * d2 + s1 + s2) * h**2
    constant = flow.robot.k * (flow.robot.b1 + flow.robot.b2) / (flow.robot.m_eff * flow.robot.m_s) * h**3
    return 2, (constant, linear, (d1 + d2) * h, mp.one)


def factors(poly: Sequence[Real]) -> list[tuple[Real, ...]]:
    """A monic factor for each group of non-zero roots, slow first; multiple roots fall into one group."""
    degree = len(poly) - 1
    companion = mp.matrix(degree)
    for i in range(degree):
        companion[degree - 1, i] = -poly[i]
        if i:
            companion[i - 1, i] = 1
    roots = sorted(mp.eig(companion, left=False, right=False), key=abs)
    units = [[q] for q in roots if not oscillates(q)] + [
        [q, mp.conj(q)] for q in roots if oscillates(q) and mp.im(q) > 0
    ]
    groups: list[list[Real]] = []
    for unit in sorted(units, key=lambda unit: abs(unit[0])):
        if groups and alike(groups[-1][-1], unit[0]):
            groups[-1] += unit
        else:
            groups.append(unit)
    return [tuple(poly)] if len(groups) == 1 else [product(group) for group in groups]


def oscillates(root: Real) -> bool:
    """Whether a root is one of a pair that oscillates; nearly double real roots are left together as real ones."""
    return bool(abs(mp.im(root)) > abs(root) * NARROW)


def alike(slow: Real, fast: Real) -> bool:
    """Whether two roots belong into one group: of like magnitude, and not an oscillation beside a plain decay."""
    apart = oscillates(slow) != oscillates(fast) and abs(slow - fast) > abs(fast) / GAP
    return bool(abs(fast) < GAP * abs(slow)) and not apart


def product(roots: Sequence[Real]) -> tuple[Real, ...]:
    """The real monic polynomial of these roots, low to high."""
    poly = [mp.one]
    for root in roots:
        poly = [p - root * q for p, q in zip([mp.zero, *poly], [*poly, mp.zero], strict=True)]
    return tuple(mp.re(c) for c in poly)


def follow(chi: Sequence[Any], start: Sequence[Any], count: int) -> list[Any]:
    """The derivatives 0 ... count - 1 of a solution of chi(d/dt) g = 0."""
    found = list(start)[:count]
    while len(found) < count:
        found.append(-sum(c * q for c, q in zip(chi[:-1], found[1 - len(chi) :], strict=True)))
    return found


def companion_norm(chi: Sequence[Real]) -> Real:
    """A norm of the companion matrix, in units of the largest root."""
    degree = len(chi) - 1
    size = max((abs(c) ** (mp.one / (degree - j)) for j, c in enumerate(chi[:-1])), default=mp.zero)
    return size * max(1, sum(abs(c) * size ** (j - degree) for j, c in enumerate(chi[:-1]))) if size else size


def spectrum(flow: Flow) -> Sequence[Group]:
    """The groups of modes of a flow, slow first; the first one holds the zero roots. Kept in the flow."""
    if flow.spectrum is None:
        with mp.extradps(GUARD):
            zeros, poly = characteristic(flow)
            while poly[0] == 0:
                zeros, poly = zeros + 1, poly[1:]
            chis = [(*[mp.zero] * zeros, mp.one), *factors(poly)]
            order = sum(len(chi) - 1 for chi in chis)
            columns = [
                follow(chi, [mp.mpf(int(i == j)) for j in range(len(chi) - 1)], order)
                for chi in chis
                for i in range(len(chi) - 1)
            ]
            inverse = mp.inverse(mp.matrix(columns).T).tolist()
            groups, first = [], 0
            for chi in chis:
                last = first + len(chi) - 1
                groups.append(Group(chi, companion_norm(chi), inverse[first:last], lyapunov(chi)))
                first = last
            flow.spectrum = tuple(groups)
    found: Sequence[Group] = flow.spectrum
    return found


def lyapunov(chi: Sequence[Real]) -> Matrix | None:
    """Q > 0 with C^T Q + Q C = -1 for the companion C of three decaying modes: r^T Q r never grows."""
    if len(chi) != 4 or chi[0] == 0:
        return None
    size = chi[0] ** (mp.one / 3)
    c = [q * size ** (j - 3) for j, q in enumerate(chi[:-1])]
    places = [(i, j) for i in range(3) for j in range(i, 3)]
    companion = [[0, 1, 0], [0, 0, 1], [-c[0], -c[1], -c[2]]]
    system, right = mp.zeros(6), mp.zeros(6, 1)
    for row, (i, j) in enumerate(places):
        right[row] = -int(i == j)
        for m in range(3):
            system[row, places.index((min(m, j), max(m, j)))] += companion[m][i]
            system[row, places.index((min(i, m), max(i, m)))] += companion[m][j]
    q = mp.lu_solve(system, right)
    full = [[q[places.index((min(i, j), max(i, j)))] for j in range(3)] for i in range(3)]
    return [[full[i][j] * size ** (-i - j) for j in range(3)] for i in range(3)]


def depth(group: Group, start: Sequence[Real]) -> Real:
    """How far below zero g can come from now on, for modes that do not grow."""
    if len(start) == 1:
        return max(mp.zero, -start[0])
    if len(start) == 2:
        q, p, _ = group.chi
        if p**2 >= 4 * q and start[0] >= 0 and start[1] + (p + mp.sqrt(p**2 - 4 * q)) / 2 * start[0] >= 0:
            return mp.zero  # a being the faster rate, (e^(a t) g)' = e^(a t) (g' + a g) keeps its sign
        return mp.sqrt(start[0] ** 2 + start[1] ** 2 / q)  # g'^2 + q g^2 never grows
    assert group.bound is not None
    energy = mp.fsum(group.bound[i][j] * start[i] * start[j] for i in range(3) for j in range(3))
    return mp.sqrt(energy * mp.inverse(mp.matrix(group.bound))[0, 0])


def long_step(flow: Flow, functions: Sequence[Sequence[int]], limit: Real) -> Real:
    """A step, in windows, over which no function (given over one window) vanishes; 0 if none is worth it."""
    groups = spectrum(flow)
    order = sum(len(g.chi) - 1 for g in groups)
    parts = []
    for coefficients in functions:
        start = [mp.ldexp(mp.mpf(c * factorial(n)), -flow.bits) for n, c in enumerate(coefficients[:order])]
        parts.append([[mp.fdot(row, start) for row in g.rows] for g in groups])
    best = mp.zero
    for level in range(1, len(groups) + 1):
        norm = max(g.norm for g in groups[:level])
        step = min(limit, SPAN / norm) if norm else limit
        if step < WORTH:
            break
        step = mp.ldexp(1, int(mp.floor(mp.log(step, 2))))  # few different steps, so few matrix exponentials
        bounds = [lower_bound(groups, part, level, step) for part in parts] if step > best else []
        while step >= WORTH and step > best:
            if all(clear(slow, fast) for slow, fast in bounds):
                best = step
            step /= 4
            bounds = [([c / 4**n for n, c in enumerate(slow)], fast) for slow, fast in bounds]
    return best


def lower_bound(
    groups: Sequence[Group], part: Sequence[Sequence[Real]], level: int, step: Real
) -> tuple[list[float], float]:
    """Taylor coefficients over the step of the slow groups and a bound on the fast ones, in one unit."""
    starts = [[q * step**j for j, q in enumerate(start)] for start in part]
    fast = mp.fsum(depth(g, q) for g, q in zip(groups[level:], part[level:], strict=True))
    slow = max(abs(q) for start in starts[:level] for q in start)
    rest = max((abs(start[0]) for start in part[level:]), default=mp.zero)
    if not fast and slow <= mp.sqrt(mp.eps) * rest:
        return [1.0], 0.0  # nothing but modes that stay above zero
    scale = max(fast, slow) or mp.one
    total = [0.0] * (DEGREE + 1)
    for group, start in zip(groups[:level], starts, strict=False):
        chi = [float(c * step ** (len(start) - j)) for j, c in enumerate(group.chi)]
        for n, q in enumerate(follow(chi, [float(q / scale) for q in start], DEGREE + 1)):
            total[n] += q / factorial(n)
    return total, float(fast / scale)


def clear(slow: Sequence[float], fast: float) -> bool:
    """Whether the slow part is above the fast one on the whole step."""
    floor = fast + MARGIN * sum(map(abs, slow))
    return slow[0] > floor and (2 * slow[0] - sum(map(abs, slow)) > floor or min(bernstein_floats(slow)) > floor)
