"""solve: one stance of the series-elastic leg, every event and every state, to 50 digits.

x1'' = (k (x2 - x1 - L0) - b1 x1' - gamma2 u)/m_eff - f1 sign(x1')          (3)
x2'' = (k (x1 - x2 + L0 + c) - b2 x2' - m_s g)/m_s - f2 sign(x2')           (4)
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache

from .chain import Leg, balanced, choose_modes, loads, name_events, search, settle, with_modes
from .energy import FIELDS, energies, work
from .motion import advance
from .records import (
    GUARD,
    Current,
    Event,
    Number,
    Phase,
    Point,
    Real,
    Robot,
    State,
    exact,
    mp,
    nearly_zero_stretch,
    parse_current,
    parse_robot,
)

Steps = tuple[tuple[Real, Real], ...]


@dataclass(frozen=True)
class Reference:
    """A solved stance; times, states and energies are mpf good to `digits` digits.

    `margin` says how close the stance came to another list of events: the smallest of the extrema that nearly
    crossed zero or only just did, of the times between neighbouring events and of | |a_i| - f_i | where a mass
    stuck or slipped, each divided by the magnitude of what it is made of.
    """

    status: str
    duration: Real
    takeoff: State | None
    final: State
    events: tuple[Event, ...]
    phases: tuple[Phase, ...]
    margin: Real
    digits: int
    leg: Leg
    end: Point

    def point(self, t: Number) -> tuple[int, Point]:
        """Phase and carried state at t."""
        t = exact(t)
        if not (0 <= t <= self.duration or (t > 0 and self.status == "rest")):
            raise ValueError(f"t must be in [0, {mp.nstr(self.duration, 17)}] s, got {mp.nstr(t, 17)}")
        last = len(self.phases) - 1
        if t >= self.duration:
            return last, self.end
        start, phase, z = self.leg.marks[self.mark(t)]
        return phase, advance(self.leg.flow(self.phases[phase].modes), z, t - start)

    def at(self, t: Number) -> State:
        """x1, v1, x2, v2 at t (at an event: after it)."""
        with mp.workdps(self.digits + GUARD):
            return self.leg.state(self.point(t)[1])

    @property
    def initial(self) -> tuple[State, tuple[Real, Real]]:
        """The state as it was given, and its E and H: at(0) is after what a stop took at once, ledger(0) has that."""
        with mp.workdps(self.digits + GUARD):
            z = self.leg.points[0]._replace(v1=self.leg.given_v1)
            return self.leg.state(z), energies(self.leg.robot, self.leg.state(z), z.y)

    def energy(self, t: Number) -> tuple[Real, Real]:
        """E of the body and H of the robot at t."""
        with mp.workdps(self.digits + GUARD):
            z = self.point(t)[1]
            return energies(self.leg.robot, self.leg.state(z), z.y)

    def ledger(self, t: Number) -> dict[str, Real]:
        """The work of each force up to t, signed as it enters H (spring_work: as it enters E)."""
        with mp.workdps(self.digits + GUARD):
            self.point(t)  # raises where there is no answer
            t = min(exact(t), self.duration)
            place = self.mark(t)
            here = {name: q + self.totals[place][name] for name, q in self.work(place, t).items()}
            here["stop_loss"] = mp.fsum(loss for time, loss in self.leg.losses if time <= t)
            return here

    @cached_property
    def totals(self) -> list[dict[str, Real]]:
        """The ledger at each mark, without the stops."""
        sums = [dict.fromkeys(FIELDS, mp.zero)]
        for place, mark in enumerate(self.leg.marks[1:]):
            sums.append({name: q + sums[-1][name] for name, q in self.work(place, mark[0]).items()})
        return sums

    def mark(self, t: Real) -> int:
        """The last stored state up to t."""
        return bisect_right(self.leg.marks, t, key=lambda mark: mark[0]) - 1

    def work(self, place: int, t: Real) -> dict[str, Real]:
        """The ledger from a mark to t, in the same phase."""
        start, number, z = self.leg.marks[place]
        phase = self.phases[number]
        return work(self.leg.flow(phase.modes), phase.modes, phase.u, z, t - start)

    @property
    def aed(self) -> Real:
        """E(T) - E(0), the paper's analytical energy delta."""
        return self.energy(self.duration)[0] - self.energy(0)[0]

    @property
    def apex(self) -> Real | None:
        """Hop height of the flight that follows: x2 + max(v2, 0)^2/(2 g) - (L0 + c) at take-off."""
        if self.takeoff is None:
            return None
        with mp.workdps(self.digits + GUARD):
            r, s = self.leg.robot, self.takeoff
            return s.x2 + (max(s.v2, 0) ** 2 / (2 * r.g) if s.v2 > 0 else 0) - (r.L0 + r.c)


def solve(
    robot: Mapping[str, Number],
    *,
    v2: Number,
    x1: Number = 0,
    v1: Number = 0,
    x2: Number | None = None,
    y: Number | None = None,
    u: Current = 0,
    horizon: Number = 2,
    max_phases: int = 4096,
    digits: int = 50,
) -> Reference:
    """The stance from touchdown (v2 after the impact) to its ending; inputs are exact numbers in SI units.

    Where the body is says x2, or the compression y = x1 - x2 + L0 + c, or, if both are left out, F(0) = 0.

    Raises ValueError for values outside the model and for F(0) < 0.
    """
    with mp.workdps(digits + GUARD):
        return _solved(tuple(sorted(robot.items())), v2, x1, v1, x2, y, parse_current(u), horizon, max_phases, digits)


@lru_cache(maxsize=256)
def _solved(
    robot: tuple[tuple[str, Number], ...],
    v2: Number,
    x1: Number,
    v1: Number,
    x2: Number | None,
    y: Number | None,
    steps: Steps,
    horizon: Number,
    max_phases: int,
    digits: int,
) -> Reference:
    """Differences and conditions start from the same stance, for each output; it is solved once.

    Numbers that are equal are the same problem, whatever their type, and no Reference is changed by who reads it.
    """
    r, begin = parse_robot(dict(robot)), exact(x1)
    height = None if x2 is None else exact(x2)
    if y is not None and exact(y):
        height = mp.fsum((begin, -exact(y), r.L0, r.c))
    leg, z = touchdown(r, begin, exact(v1), height, exact(v2), digits)
    return run(leg, z, steps, exact(horizon), max_phases)


def touchdown(r: Robot, x1: Real, v1: Real, x2: Real | None, v2: Real, digits: int) -> tuple[Leg, Point]:
    """The leg at t = 0 and its state, before anything has moved."""
    if not r.x1_min <= x1 <= r.x1_max:
        raise ValueError(f"x1 must be in [x1_min, x1_max] = [{r.x1_min}, {r.x1_max}], got {x1}")
    y = mp.zero if x2 is None else mp.fsum((x1, -x2, r.L0, r.c))
    if nearly_zero_stretch(y, r.L0):
        y = mp.zero
    if y < 0:
        raise ValueError(f"the leg must not be stretched at the start, got x1 - x2 + L0 + c = {mp.nstr(y, 17)} m")
    leg = Leg(r, r.L0 + r.c if x2 is None else x2 - x1 + y, digits, v1)
    if v1 and ((x1 == r.x1_max and v1 > 0) or (x1 == r.x1_min and v1 < 0)):
        leg.losses.append((mp.zero, -r.m_eff * v1**2 / 2))
        v1 = mp.zero
    return leg, Point(x1, v1, mp.zero, v2, mp.zero, y)


def with_current(leg: Leg, z: Point, old: Real, new: Real) -> Point:
    """The same state, held-mode loads, under another current."""
    r = leg.robot
    return z._replace(n1=leg.sum(z.n1, r.gamma2 * old / r.m_eff, -r.gamma2 * new / r.m_eff)) if new != old else z


def run(leg: Leg, z: Point, steps: Steps, horizon: Real, max_phases: int) -> Reference:
    """The chain of phases from t = 0."""
    steps = tuple(step for step in steps if step[0] == 0 or step[0] < horizon)
    t, piece, rest = mp.zero, 0, None
    n1, n2 = loads(leg, z.y, steps[0][1])
    z = z._replace(n1=n1, n2=n2)
    modes = choose_modes(leg, z, (0, 0), steps[0][1])
    z = with_modes(leg, z, (0, 0), modes)
    while True:
        u = steps[piece][1]
        if len(leg.phases) >= max_phases:
            return finish(leg, "too_many_phases", t, z)
        z = balanced(leg, z, modes, u)
        leg.phases.append(Phase(t, leg.state(z), modes, u))
        leg.points.append(z)
        end = steps[piece + 1][0] if piece + 1 < len(steps) else horizon
        hit = None
        if modes == (0, 0):
            leg.marks.append((t, len(leg.phases) - 1, z))
            rest = t if rest is None else rest
            if piece + 1 == len(steps):
                return finish(leg, "rest", rest, z)
        else:
            rest = None
            hit, z = search(leg, t, z, modes, u, end)
        if hit is None:
            t, piece = end, piece + 1
            if piece == len(steps):
                return finish(leg, "horizon", t, z)
            new_u = steps[piece][1]
        else:
            t, new_u = hit.time, u
            if "takeoff" in hit.kinds:
                return finish(leg, "takeoff", t, hit.point._replace(y=mp.zero))
            z = settle(leg, hit)
        z = with_current(leg, z, u, new_u)
        old, modes = modes, choose_modes(leg, z, modes, new_u)
        z = with_modes(leg, z, old, modes)
        leg.events += name_events(t, frozenset() if hit is None else hit.kinds, old, modes)


def finish(leg: Leg, status: str, t: Real, z: Point) -> Reference:
    """The record of a stance that ended at t in z."""
    times = [mp.zero, *(event.time for event in leg.events), *([t] if status in ("takeoff", "horizon") else [])]
    unit = mp.sqrt(leg.robot.m_s / leg.robot.k)
    for before, after in zip(times, times[1:], strict=False):
        leg.near((after - before) / max(after, unit))
    state = leg.state(z)
    return Reference(
        status,
        t,
        state if status == "takeoff" else None,
        state,
        tuple(leg.events),
        tuple(leg.phases),
        leg.margin,
        leg.digits,
        leg,
        z,
    )
