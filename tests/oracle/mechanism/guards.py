"""Event functions: what stays >= 0 while a phase lasts, linear in the state.

contact     N                                  clearance  height of the foot
velocity    s c_e . v of a slipping element    limit      s (limit - c_e . q) of a slipping element
hold        F_e - s lambda_e of a held one     law        limit - s u, or s u - limit while it is saturated
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from .equations import Row, System
from .flow import BITS, LEADING, Flow, Point, Series, fixed
from .numbers import TINY, Real, Vector, dot, magnitude, mp, total

INVERSE = int(1 / TINY)


@dataclass(frozen=True)
class Mode:
    """Signs of the elements' slip, 0 held; side of the saturated law, 0 for none; whether touchdown is armed; what the law
    follows.
    """

    signs: tuple[int, ...]
    saturation: int = 0
    armed: bool = True
    aim: Real = mp.zero

    @property
    def held(self) -> tuple[int, ...]:
        return tuple(e for e, sign in enumerate(self.signs) if not sign)


@dataclass(frozen=True)
class Guard:
    """value + x . (displacement) + w . (velocity's change), >= 0; `scale` is the size of what it is made of."""

    kind: str
    element: int
    side: int
    value: Real
    scale: Real
    x: Vector
    w: Vector

    @property
    def label(self) -> tuple[str, int, int]:
        return self.kind, self.element, self.side


@dataclass(frozen=True)
class Polynomial:
    """A guard over a window: Taylor coefficients, sizes of the terms of the leading ones, and their unit."""

    guard: Guard
    c: list[int]
    size: list[int]
    unit: Real

    def leading(self) -> tuple[int, int]:
        """Order and sign of the first non-zero coefficient; sign 0 for a function that is zero."""
        for n, (c, size) in enumerate(zip(self.c, self.size, strict=False)):
            if abs(c) * INVERSE > size:
                return n, 1 if c > 0 else -1
        return LEADING, 0


def polynomial(guard: Guard, s: Series) -> Polynomial:
    """The guard's Taylor coefficients from the series of the motion."""
    flow, h = s.flow, s.flow.window if s.flow.order else mp.one
    parts = [
        (q * unit, c, size)
        for row, unit, cs, sizes in ((guard.x, s.nu * h, s.x, s.x_size), (guard.w, s.nu, s.w, s.w_size))
        for q, c, size in zip(row, cs, sizes, strict=True)
        if q
    ]
    unit = max((abs(q) for q, _, _ in parts), default=mp.zero) or abs(guard.value) or mp.one
    factors = [fixed(q / unit) for q, _, _ in parts]
    first = fixed(guard.value / unit)
    terms = len(s.w[0]) if flow.order else 1
    c = [sum(f * p[1][n] for f, p in zip(factors, parts, strict=True)) >> BITS for n in range(1, terms)]
    size = [sum(abs(f) * p[2][n] for f, p in zip(factors, parts, strict=True)) >> BITS for n in range(1, LEADING)]
    return Polynomial(guard, [first, *c], [abs(first), *(q + 1 for q in size)], unit)


def row_guard(flow: Flow, z: Point, row: Row, kind: str, sign: int, offset: Vector = (), side: int = 0) -> Guard:
    """sign (row - the sum of offset)."""
    terms = [*row.terms(z.q, z.v), *(-each for each in offset)]
    x, w = (tuple(sign * q for q in along(part, flow)) for part in (row.q, row.v))
    return Guard(kind, -1, side, sign * total(*terms), mp.fsum(terms, absolute=True), x, w)


def along(row: Vector, flow: Flow) -> Vector:
    """row Z: a row on coordinates as one on the free ones."""
    return tuple(dot(row, column) for column in zip(*flow.Z, strict=True)) if flow.order else ()


def guards(system: System, flow: Flow, z: Point, mode: Mode) -> Iterator[Guard]:
    """All event functions of a phase, in the order of the tie rules."""
    if system.contact is not None:
        yield row_guard(flow, z, system.contact.force, "contact", 1)
    if system.clearance is not None:
        yield row_guard(flow, z, system.clearance, "clearance" if mode.armed else "arming", 1 if mode.armed else -1)
    for e, sign in enumerate(mode.signs):
        if sign:
            yield from slipping(system, flow, z, e, sign)
        else:
            yield from holding(system, flow, z, e)
    yield from saturating(system, flow, z, mode)


def slipping(system: System, flow: Flow, z: Point, e: int, sign: int) -> Iterator[Guard]:
    """Distance to the limit ahead, and velocity."""
    element = system.elements[e]
    row, limit, none = along(element.direction, flow), element.limit(sign), (mp.zero,) * flow.order
    if mp.isfinite(limit):
        place = dot(element.direction, z.q)
        scale = abs(limit) + magnitude(element.direction, z.q)
        gap = sign * total(limit, -place)
        yield Guard("limit", e, sign, gap, scale, tuple(-sign * q for q in row), none)
    rate = dot(element.direction, z.v)
    yield Guard("velocity", e, sign, sign * rate, magnitude(element.direction, z.v), none, tuple(sign * q for q in row))


def blocked(system: System, e: int, q: Vector) -> tuple[int, ...]:
    """The directions in which a limit holds the element."""
    element, place = system.elements[e], dot(system.elements[e].direction, q)
    tiny = TINY * magnitude(element.direction, q)
    sides = [sign for sign in (1, -1) if mp.isfinite(element.limit(sign))]
    return tuple(s for s in sides if abs(place - element.limit(s)) <= max(tiny, TINY * abs(element.limit(s))))


def holding(system: System, flow: Flow, z: Point, e: int) -> Iterator[Guard]:
    """Friction level less the force that would move the element, in the directions that are not blocked."""
    element, G = system.elements[e], flow.G[flow.held.index(e)]
    pull = [
        *(p * q for p, q in zip(G, z.r, strict=True)),
        *(-p * dot(row, z.v) for p, row in zip(G, flow.B, strict=True)),
    ]
    x = tuple(dot(G, column) for column in zip(*flow.KZ, strict=True)) if flow.order else ()
    w = tuple(dot(G, column) for column in zip(*flow.BZ, strict=True)) if flow.order else ()
    loads = system.force_size(z.q, z.v, mp.zero)
    for side in (1, -1):
        if side in blocked(system, e, z.q):
            continue
        level = element.level(side)
        slack = total(level, *(-side * q for q in pull))
        scale = level + magnitude(G, loads) + mp.fsum(pull, absolute=True)
        yield Guard("hold", e, side, slack, scale, tuple(side * q for q in x), tuple(side * q for q in w))


def saturating(system: System, flow: Flow, z: Point, mode: Mode) -> Iterator[Guard]:
    """Distances of the law to its limits, or of a saturated one from where it comes back."""
    law = system.law
    if law is None or not mp.isfinite(law.limit):
        return
    for side in (1, -1) if not mode.saturation else (mode.saturation,):
        inside = not mode.saturation
        offset = side * law.limit, -law.target * mode.aim
        yield row_guard(flow, z, law.row, "law", -side if inside else side, offset, side)
