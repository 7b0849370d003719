"""The stance as a chain of phases: which masses slip, which are held, and what ends each combination.

    held:      |a_i| <= f_i + excess_i, a_i the free acceleration at v_i = 0 (one-sided at a stop)
    slipping:  sign(v_i) constant        take-off:  F = k y falls through zero

Each condition is a function that is >= 0 while the phase lasts. At a change every combination of modes that the
velocities allow is tried, held ones first, and the one whose functions all start upwards is the motion: the first
non-zero derivative decides. What can be held is held: with more friction at rest than in motion a mass could slip, too.
A zero at the left end of a window is divided
out before roots are sought.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from ..polynomials import first_crossing, horner
from .motion import LEADING, Flow, Series, advance, evaluate, expand, fixed, integral
from .records import Event, Phase, Point, Real, Robot, State, mp
from .skip import long_step

SHORT_STEPS = 3  # windows of a phase before a long step is tried


class Condition(NamedTuple):
    """A function >= 0 inside a phase: Taylor coefficients, sizes of the leading sums, unit, scale for near misses."""

    kind: str
    c: list[int]
    size: list[int]
    unit: Real
    scale: Real


@dataclass
class Leg:
    """One stance in the making: robot, lift (x2 = x1 - y + lift) and what is found so far."""

    robot: Robot
    lift: Real
    digits: int
    given_v1: Real  # before a stop takes it at t = 0
    flows: dict[tuple[bool, bool], Flow] = field(default_factory=dict)
    phases: list[Phase] = field(default_factory=list)
    points: list[Point] = field(default_factory=list)  # at the start of each phase
    marks: list[tuple[Real, int, Point]] = field(default_factory=list)  # (time, phase, state) at each window
    events: list[Event] = field(default_factory=list)
    losses: list[tuple[Real, Real]] = field(default_factory=list)  # (time, energy) taken by the stops
    margin: Real = mp.inf
    fastest: Real = mp.zero
    widest: Real = mp.zero

    @property
    def tiny(self) -> Real:
        """What counts as zero, relative to the terms of a sum."""
        return mp.mpf(10) ** (10 - self.digits)

    def flow(self, modes: tuple[int, int]) -> Flow:
        moving = (modes[0] != 0, modes[1] != 0)
        if moving not in self.flows:
            self.flows[moving] = Flow(self.robot, moving)
        return self.flows[moving]

    def state(self, z: Point) -> State:
        return State(z.x1, z.v1, z.x1 - z.y + self.lift, z.v2)

    def sum(self, *terms: Real) -> Real:
        """A sum that is exactly zero if its terms cancel to within rounding."""
        total = mp.fsum(terms)
        return mp.zero if abs(total) <= self.tiny * mp.fsum(terms, absolute=True) else total

    def near(self, value: Real) -> None:
        self.margin = min(self.margin, abs(value))

    def load_scale(self, mass: int, y: Real, u: Real) -> Real:
        """The sum of the magnitudes in a_i."""
        r = self.robot
        if mass == 0:
            return (r.k * (abs(y) + abs(r.c)) + abs(r.gamma2 * u)) / r.m_eff + r.at_rest[0]
        return r.k * abs(y) / r.m_s + r.g + r.at_rest[1]


def loads(leg: Leg, y: Real, u: Real) -> tuple[Real, Real]:
    """n1, n2 of masses that are held, from y."""
    r = leg.robot
    n1 = leg.sum(r.k * r.c, -r.k * y, -r.gamma2 * u) / r.m_eff
    return n1, leg.sum(r.k * y, -r.m_s * r.g) / r.m_s


def with_modes(leg: Leg, z: Point, old: tuple[int, int], new: tuple[int, int]) -> Point:
    """The same state with the friction of other modes in n_i."""
    f1, f2 = leg.robot.f1, leg.robot.f2
    n1 = leg.sum(z.n1, f1 * old[0], -f1 * new[0]) if old[0] != new[0] else z.n1
    n2 = leg.sum(z.n2, f2 * old[1], -f2 * new[1]) if old[1] != new[1] else z.n2
    return z._replace(n1=n1, n2=n2)


def balanced(leg: Leg, z: Point, modes: tuple[int, int], u: Real) -> Point:
    """The same state on what holds for good where constant forces cancel, so that decay does not end in rounding.

    m_eff n1 + m_s n2 and k y - m_s n2, k y + m_eff n1 are constant; if such a constant is zero, it stays exactly so.
    """
    r = leg.robot
    first = (r.k * r.c, -r.gamma2 * u, -r.m_eff * r.f1 * modes[0])
    second = (-r.m_s * r.g, -r.m_s * r.f2 * modes[1])
    if all(modes) and leg.sum(*first, *second) == 0:
        z = z._replace(n2=-r.m_eff * z.n1 / r.m_s)
    if leg.sum(*second) == 0:
        return z._replace(y=r.m_s * z.n2 / r.k)
    return z._replace(y=-r.m_eff * z.n1 / r.k) if leg.sum(*first) == 0 else z


def conditions(leg: Leg, z: Point, modes: tuple[int, int], u: Real, s: Series) -> Iterator[Condition]:
    """What must stay >= 0, in the order of the tie rules."""
    r, flow = leg.robot, leg.flow(modes)
    one = 1 << flow.bits
    length, load = s.nu * s.h, flow.rho * s.nu

    def position(offset: Real, sign: int, rates: list[int], sizes: list[int]) -> tuple[list[int], list[int]]:
        moved = [sign * q for q in integral(rates)]
        moved[0] = fixed(offset / length, flow.bits)
        return moved, [abs(moved[0]) + one, *integral(sizes)[1:]]

    stretch = [a - b for a, b in zip(s.v1, s.v2, strict=True)]
    sizes = [a + b for a, b in zip(s.size[0], s.size[2], strict=True)]
    yield Condition("takeoff", *position(z.y, 1, stretch, sizes), length, leg.widest)
    stop = r.x1_max if modes[0] > 0 else r.x1_min
    if modes[0] and mp.isfinite(stop):
        yield Condition("stop", *position((stop - z.x1) * modes[0], -modes[0], s.v1, s.size[0]), length, leg.widest)
    for mass, v, size in ((0, s.v1, s.size[0]), (1, s.v2, s.size[2])):
        if modes[mass]:
            yield Condition(f"v{mass + 1}", [modes[mass] * q for q in v], [one, *size[1:]], s.nu, leg.fastest)
            continue
        free, pull = (s.n1, s.size[1]) if mass == 0 else (s.n2, s.size[3])
        f = fixed(r.at_rest[mass] / load, flow.bits)
        sizes = [pull[0] + f, *pull[1:]]
        for sign in blocked_free(r, z.x1) if mass == 0 else (1, -1):
            c = [-sign * q for q in free]
            c[0] += f
            yield Condition(f"a{mass + 1}", c, sizes, load, leg.load_scale(mass, z.y, u))


def blocked_free(r: Robot, x1: Real) -> tuple[int, ...]:
    """The directions in which no stop holds the actuator."""
    return tuple(sign for sign, stop in ((1, r.x1_max), (-1, r.x1_min)) if x1 != stop)


def leading(leg: Leg, condition: Condition) -> tuple[int, int]:
    """Order and sign of the first non-zero coefficient; sign 0 for a function that is zero."""
    limit = int(1 / leg.tiny)
    for n, (c, size) in enumerate(zip(condition.c, condition.size, strict=False)):
        if abs(c) * limit > size:
            return n, 1 if c > 0 else -1
    return LEADING, 0


def choose_modes(leg: Leg, z: Point, old: tuple[int, int], u: Real) -> tuple[int, int]:
    """The modes the masses take: by their velocities, at rest by the hold rule."""
    up_down = blocked_free(leg.robot, z.x1)
    first = [int(mp.sign(z.v1))] if z.v1 else [0, *up_down]
    second = [int(mp.sign(z.v2))] if z.v2 else [0, 1, -1]
    pairs = sorted(((p, q) for p in first for q in second), key=lambda pair: abs(pair[0]) + abs(pair[1]))
    for pair in pairs:
        if pair == (0, 0):
            if stays(leg, with_modes(leg, z, old, pair), u):
                return pair
            continue
        trial = balanced(leg, with_modes(leg, z, old, pair), pair, u)
        flow = leg.flow(pair)
        series = expand(flow, trial, flow.window, LEADING)
        open_kinds = {"a1", "a2"} | {kind for kind, v in (("v1", z.v1), ("v2", z.v2)) if not v}
        found = [(c, *leading(leg, c)) for c in conditions(leg, trial, pair, u, series) if c.kind in open_kinds]
        if all(starts_well(c, sign) for c, _, sign in found):
            for condition, order, _ in found:
                note_decision(leg, flow, z, u, condition, order)
            return pair
    raise ArithmeticError(f"no mode pair fits the state {z}")


def stays(leg: Leg, z: Point, u: Real) -> bool:
    """Whether both masses are held: nothing changes then, so the loads decide and not their derivatives."""
    for mass, n, f in zip((0, 1), (z.n1, z.n2), leg.robot.at_rest, strict=True):
        slack = [leg.sum(f, -sign * n) for sign in (blocked_free(leg.robot, z.x1) if mass == 0 else (1, -1))]
        if any(q < 0 for q in slack):
            return False
        for q in filter(None, slack):
            leg.near(q / leg.load_scale(mass, z.y, u))
    return True


def starts_well(condition: Condition, sign: int) -> bool:
    """A held mass may sit on its limit for good, a slipping one must move."""
    return sign > 0 or (sign == 0 and condition.kind in ("a1", "a2"))


def note_decision(leg: Leg, flow: Flow, z: Point, u: Real, condition: Condition, order: int) -> None:
    """How close |a_i| was to its limit at rest; an exact tie, settled by a later derivative, is no close call."""
    slips = condition.kind.startswith("v")
    if order != int(slips):
        return
    mass = int(condition.kind[1]) - 1
    scale = leg.load_scale(mass, z.y, u)
    unit = condition.unit / flow.window if slips else condition.unit
    value = mp.ldexp(mp.mpf(condition.c[order]), -flow.bits) * unit
    if slips:  # it accelerates by what is above the friction in motion
        value = leg.sum(value, -(leg.robot.f1_excess, leg.robot.f2_excess)[mass])
    if scale and value:
        leg.near(value / scale)


class Hit(NamedTuple):
    """The end of a phase by events: time, state there, kinds that are due."""

    time: Real
    point: Point
    kinds: frozenset[str]


def search(leg: Leg, t: Real, z: Point, modes: tuple[int, int], u: Real, end: Real) -> tuple[Hit | None, Point]:
    """The first event of a phase, or none and the state at `end`."""
    flow, windows, short_steps = leg.flow(modes), 0, SHORT_STEPS
    while t < end:
        h = min(flow.window, end - t)
        series = expand(flow, z, flow.window)
        leg.fastest = max(leg.fastest, series.nu)
        leg.widest = max(leg.widest, abs(z.x1), abs(z.y), series.nu * series.h)
        leg.marks.append((t, len(leg.phases) - 1, z))
        watched = list(conditions(leg, z, modes, u, series))
        if windows >= short_steps:
            step = long_step(flow, [c.c for c in watched], (end - t) / flow.window)
            if step:
                z = balanced(leg, advance(flow, z, step * flow.window), modes, u)
                t = t + step * flow.window
                continue
            short_steps = 2 * windows
        hit = first_hit(leg, flow, z, series, watched, fixed(h / flow.window, flow.bits))
        if hit is not None:
            tau, kinds = hit
            dt = mp.ldexp(mp.mpf(tau), -flow.bits) * flow.window
            return Hit(t + dt, evaluate(flow, z, series, tau), kinds), z
        z = evaluate(flow, z, series, fixed(h / flow.window, flow.bits))
        t, windows = t + h, windows + 1
    return None, z


def first_hit(
    leg: Leg, flow: Flow, z: Point, s: Series, watched: Sequence[Condition], limit: int
) -> tuple[int, frozenset[str]] | None:
    """Place (unit 2^-bits of a window) of the first violated condition and all kinds that are due there."""
    found = [(place, c) for c in watched if (place := violated(leg, flow, c)) is not None]
    tie = max(fixed(leg.tiny, flow.bits), 1)
    found = [(place, c) for place, c in found if place <= limit + tie]
    if not found:
        return None
    first = min(place for place, _ in found)
    due = [c for place, c in found if place <= first + tie]
    for condition in due:
        note_slope(leg, flow, condition, first)
    return min(first, limit), frozenset(c.kind for c in due)


def violated(leg: Leg, flow: Flow, condition: Condition) -> int | None:
    """Where the condition first fails in the window."""
    order, sign = leading(leg, condition)
    if sign <= 0:
        return 0 if sign else None

    def note(place: int, height: int) -> None:
        value = mp.ldexp(mp.mpf(height), -flow.bits) * condition.unit * mp.ldexp(mp.mpf(place), -flow.bits) ** order
        if condition.scale:
            leg.near(value / condition.scale)

    rest = condition.c[order:]
    touch = max(map(abs, rest)) // int(1 / leg.tiny)
    return first_crossing(rest, flow.bits, touch, note)


def note_slope(leg: Leg, flow: Flow, condition: Condition, place: int) -> None:
    """A flat crossing has an extremum near by, at a distance g'^2/(2 g'') from zero."""
    slope = [n * c for n, c in enumerate(condition.c)][1:]
    bend = [n * c for n, c in enumerate(slope)][1:]
    first, second = (mp.ldexp(mp.mpf(horner(q, place, flow.bits)), -flow.bits) for q in (slope, bend))
    if second and condition.scale:
        leg.near(first**2 / (2 * second) * condition.unit / condition.scale)


def settle(leg: Leg, hit: Hit) -> Point:
    """The state after the events: velocities that are zero are exactly zero, a stop takes what hits it."""
    r, z = leg.robot, hit.point
    if "stop" in hit.kinds:
        stop = r.x1_max if z.v1 > 0 else r.x1_min
        leg.losses.append((hit.time, -r.m_eff * z.v1**2 / 2))
        z = z._replace(x1=stop, v1=mp.zero)
    if "v1" in hit.kinds:
        stops = [stop for stop in (r.x1_min, r.x1_max) if mp.isfinite(stop)]
        touched = [stop for stop in stops if abs(stop - z.x1) <= leg.tiny * max(leg.widest, abs(stop))]
        z = z._replace(v1=mp.zero, x1=touched[0] if touched else z.x1)
    if "v2" in hit.kinds:
        z = z._replace(v2=mp.zero)
    if "a1" in hit.kinds:  # exactly on the limit, so that the derivatives decide and not the last digit
        z = z._replace(n1=mp.sign(z.n1) * r.at_rest[0])
    if "a2" in hit.kinds:
        z = z._replace(n2=mp.sign(z.n2) * r.at_rest[1])
    return z


def name_events(t: Real, kinds: frozenset[str], old: tuple[int, int], new: tuple[int, int]) -> list[Event]:
    """The events of one instant, the actuator's first."""
    names = []
    for mass in (0, 1):
        if mass == 0 and "stop" in kinds:
            names.append("x1_hits_stop")
        elif old[mass] != new[mass]:
            verb = "slips" if not old[mass] else "reverses" if new[mass] else "sticks"
            names.append(f"x{mass + 1}_{verb}")
    return [Event(t, name) for name in names]
