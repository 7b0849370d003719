"""Mechanisms with dry friction, stops and a contact, integrated numerically by DOP853, restarted at every event.

It is written from the physics and shares nothing with hopform or with the oracle of 60 digits: a mechanism is its
masses, what is at rest or slips, and one function of the force on each mass. Friction may be higher at rest than in
motion, and differ by direction; the contact force may jump at an event.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Array = NDArray[np.float64]
Force = Callable[[Array, Array, float], Array]

TOLERANCES = {"method": "DOP853", "rtol": 3e-14, "atol": 1e-300, "dense_output": True}
ORDERS = 4
"""Derivatives of a force that are asked, one after the other, where it is exactly at the level of friction."""


@dataclass(frozen=True)
class Mass:
    """One coordinate. Levels of friction are those of forward and of backward motion, [N] or [N m]."""

    name: str
    inertia: float
    sliding: tuple[float, float] = (0.0, 0.0)
    at_rest: tuple[float, float] | None = None
    low: float = -math.inf
    high: float = math.inf

    @property
    def level(self) -> tuple[float, float]:
        """What holds it: [forward, backward]."""
        return self.sliding if self.at_rest is None else self.at_rest


@dataclass(frozen=True)
class Mechanism:
    """force(q, v, u): on each mass, without dry friction and stops, affine in q and v; contact(q, v): N, or None.

    kinks(q, v, u): where one of these is 0 a force may bend, as one that is limited does; the integrator starts anew
    there, and nothing happens. It is affine on either side.
    """

    masses: tuple[Mass, ...]
    force: Force
    contact: Callable[[Array, Array], float] | None = None
    kinks: tuple[Callable[[Array, Array, float], float], ...] = ()


class Event(NamedTuple):
    t: float
    kind: str


@dataclass
class Motion:
    """Events without the ending, its status and time, and (begin, end, interpolant of q, v) of each piece."""

    events: list[Event] = field(default_factory=list)
    status: str = "horizon"
    duration: float = 0.0
    final: tuple[Array, Array] = (np.empty(0), np.empty(0))
    pieces: list[tuple[float, float, Callable[[float], Array]]] = field(default_factory=list)

    @property
    def kinds(self) -> list[str]:
        return [event.kind for event in self.events]

    def at(self, t: float) -> Array:
        """q, then v."""
        if not self.pieces:
            return np.concatenate(self.final)
        return next(states(t - begin) for begin, end, states in reversed(self.pieces) if begin <= t)


class Mode:
    """Which way each mass slips, 0 where it is held, under one current."""

    def __init__(self, mechanism: Mechanism, u: float, q: Array, v: Array) -> None:
        self.mechanism, self.u = mechanism, u
        self.sides = [0] * len(mechanism.masses)
        self.number = len(mechanism.masses)
        self.faded: set[int] = set()
        """Masses without friction whose velocity has become 0 by underflow: it decays, and turns no more."""
        for n in range(self.number):
            self.sides[n] = int(np.sign(v[n]))
        for n in range(self.number):
            if v[n] == 0.0:
                self.sides[n] = self.direction_from_rest(n, q, v)
        self.branches = [1.0] * len(mechanism.kinks)
        self.choose_branches(q, v)

    def choose_branches(self, q: Array, v: Array) -> None:
        """On which side of each kink the state is, on one that to which the motion goes."""
        for n, kink in enumerate(self.mechanism.kinks):
            z = np.concatenate([q, v])
            ahead = z + 1e-9 * self.slope(0.0, z)
            value = kink(q, v, self.u) or kink(ahead[: self.number], ahead[self.number :], self.u)
            self.branches[n] = 1.0 if value >= 0.0 else -1.0

    def free(self, q: Array, v: Array) -> Array:
        return self.mechanism.force(q, v, self.u)

    def acceleration(self, q: Array, v: Array) -> Array:
        free = self.free(q, v)
        rates = np.zeros(self.number)
        for n, (mass, side) in enumerate(zip(self.mechanism.masses, self.sides, strict=True)):
            if side:
                friction = mass.sliding[0] if side > 0 else -mass.sliding[1]
                rates[n] = (free[n] - friction) / mass.inertia
        return rates

    def slope(self, _: float, z: Array) -> Array:
        q, v = z[: self.number], z[self.number :]
        moving = np.where(np.array(self.sides) == 0, 0.0, v)
        return np.concatenate([moving, self.acceleration(q, moving)])

    def derivatives_of_free(self, n: int, q: Array, v: Array) -> list[float]:
        """The force on a mass that is held, and its derivatives along the motion; it is affine in q and v."""
        zero = self.free(np.zeros(self.number), np.zeros(self.number))
        by_q = np.array([self.free(e, 0 * e)[n] - zero[n] for e in np.eye(self.number)])
        by_v = np.array([self.free(0 * e, e)[n] - zero[n] for e in np.eye(self.number)])
        values, position, velocity = [float(self.free(q, v)[n])], v, self.acceleration(q, v)
        for _ in range(ORDERS):
            values.append(float(by_q @ position + by_v @ velocity))
            of = np.array([self._linear(k, position, velocity) for k in range(self.number)])
            masses = np.array([mass.inertia for mass in self.mechanism.masses])
            position, velocity = velocity, np.where(np.array(self.sides) == 0, 0.0, of / masses)
        return values

    def _linear(self, k: int, position: Array, velocity: Array) -> float:
        zero = np.zeros(self.number)
        return float(self.free(position, velocity)[k] - self.free(zero, zero)[k])

    def direction_from_rest(self, n: int, q: Array, v: Array) -> int:
        """The hold rule; where the force is exactly at a level, the first derivative that is not zero decides."""
        mass, before = self.mechanism.masses[n], self.sides[n]
        self.sides[n] = 0
        values = self.derivatives_of_free(n, q, v)
        self.sides[n] = before
        forward, backward = mass.level
        for side, beyond, walled in (
            (1, values[0] - forward, q[n] >= mass.high),
            (-1, -values[0] - backward, q[n] <= mass.low),
        ):
            decides = next((each for each in (beyond, *(side * value for value in values[1:])) if each != 0.0), 0.0)
            if decides > 0.0 and beyond >= 0.0 and not walled:
                return side
        return 0

    def functions(self, q: Array, contact: bool) -> list[tuple[str, int, Callable[[Array], float]]]:
        """Functions that fall through zero where the mode ends: what ends, whose, the function of z."""
        number, found = self.number, []
        if contact:
            of_contact = self.mechanism.contact
            assert of_contact is not None
            found.append(("takeoff", -1, lambda z: of_contact(z[:number], z[number:])))
        for n, (mass, side) in enumerate(zip(self.mechanism.masses, self.sides, strict=True)):
            if side:
                if n not in self.faded:
                    found.append(("turns", n, lambda z, n=n, side=side: side * z[number + n]))
                end = mass.high if side > 0 else mass.low
                if math.isfinite(end):
                    found.append(("stop", n, lambda z, n=n, side=side, end=end: side * (end - z[n])))
                continue
            forward, backward = mass.level
            free = lambda z, n=n: float(self.free(z[:number], z[number:])[n])  # noqa: E731
            if q[n] < mass.high:
                found.append(("slips", n, lambda z, free=free, level=forward: level - free(z)))
            if q[n] > mass.low:
                found.append(("slips", n, lambda z, free=free, level=backward: level + free(z)))
        for n, (kink, branch) in enumerate(zip(self.mechanism.kinks, self.branches, strict=True)):
            moves = any(self.sides)
            if moves:
                found.append(("kink", n, lambda z, kink=kink, side=branch: side * kink(z[:number], z[number:], self.u)))
        return found


def integrate(
    mechanism: Mechanism, q: Sequence[float], v: Sequence[float], steps: Sequence[tuple[float, float]], horizon: float,
    longest: float,
) -> Motion:  # fmt: skip
    """The motion from q, v under the steps (t, u) of the current; `longest` is the longest step of the integrator."""
    motion, t = Motion(), 0.0
    at, going = np.array(q, float), np.array(v, float)
    for n, mass in enumerate(mechanism.masses):  # a stop takes the velocity into it at once
        if (at[n] >= mass.high and going[n] > 0.0) or (at[n] <= mass.low and going[n] < 0.0):
            going[n] = 0.0
    sides: list[int] = []
    held: float | None = None  # since when nothing moves
    for n, (_, u) in enumerate(steps):
        end = min(steps[n + 1][0] if n + 1 < len(steps) else math.inf, horizon)
        mode = Mode(mechanism, u, at, going)
        for mass, before, side in zip(mechanism.masses, sides, mode.sides, strict=False):
            if before == 0 and side != 0:
                motion.events.append(Event(t, f"{mass.name}_slips"))
        held = None if any(mode.sides) else t if held is None else held
        t, done = _until(motion, mode, at, going, t, end, longest, last=n + 1 == len(steps))
        sides = mode.sides
        if held is None and not any(sides):
            held = motion.events[-1].t
        if done:
            break
    motion.duration, motion.final = held if motion.status == "rest" and held is not None else t, (at, going)
    return motion


def _until(
    motion: Motion, mode: Mode, at: Array, going: Array, t: float, end: float, longest: float, last: bool
) -> tuple[float, bool]:
    """Follow the motion to `end`; `at` and `going` become the state there. Whether the motion has ended before."""
    number = mode.number
    while t < end:
        contact = mode.mechanism.contact
        if contact is not None and (t > 0.0 or motion.events) and contact(at, going) <= 0.0:
            motion.status = "takeoff"
            return t, True
        if not any(mode.sides) and last:
            motion.status = "rest"
            return t, True
        functions = mode.functions(at, contact is not None)
        z = np.concatenate([at, going])
        took, which, after, states = _first(mode, functions, z, end - t, longest)
        motion.pieces.append((t, t + took, states))
        t = end if which is None else t + took
        at[:], going[:] = after[:number], after[number:]
        for n, side in enumerate(mode.sides):
            if side == 0:
                at[n], going[n] = z[n], 0.0
        if which is None:
            return t, False
        what, n, _ = functions[which]
        if what == "takeoff":
            motion.status = "takeoff"
            return t, True
        if what == "kink":
            mode.branches[n] *= -1.0
            continue
        for event in _passed(mode, what, n, at, going):
            motion.events.append(Event(t, event))
    return t, False


def _passed(mode: Mode, what: str, n: int, at: Array, going: Array) -> Iterator[str]:
    """Put mass n, whose function has come to zero, where the event leaves it; kinds of what happens at that time."""
    mass, side = mode.mechanism.masses[n], mode.sides[n]
    if what == "stop":
        at[n] = mass.high if side > 0 else mass.low
    going[n] = 0.0
    if what == "slips":
        forward, backward = mass.level
        force = mode.free(at, going)[n]
        forwards = abs(force - forward) < abs(force + backward)
        mode.sides[n] = 1 if at[n] <= mass.low or (forwards and at[n] < mass.high) else -1
    else:
        mode.sides[n] = mode.direction_from_rest(n, at, going)
    if what == "turns" and not mode.sides[n] and mass.level == (0.0, 0.0) and mass.low < at[n] < mass.high:
        mode.sides[n] = side  # nothing holds it
        mode.faded.add(n)
        return
    yield f"{mass.name}_" + (
        {"slips": "slips", "stop": "hits_stop"}.get(what) or ("reverses" if mode.sides[n] else "sticks")
    )
    for other, neighbour in enumerate(mode.mechanism.masses):  # a force that jumps with a velocity
        if what == "stop":
            mode.choose_branches(at, going)
        if what == "stop" and other != n and mode.sides[other] == 0:
            mode.sides[other] = mode.direction_from_rest(other, at, going)
            if mode.sides[other]:
                yield f"{neighbour.name}_slips"


def _first(mode: Mode, functions, z: Array, length: float, longest: float):
    """The first function that falls through zero, by its number, or None; the time, state and interpolant."""

    def terminal(function):
        def event(_, z):
            return function(z)

        event.terminal, event.direction = True, -1.0
        return event

    size = np.abs(z).reshape(2, -1).max(axis=1)  # of positions, and of velocities
    scale = np.repeat(np.maximum(size, [1e-3, 1e-2]), mode.number)
    done = solve_ivp(
        mode.slope, (0.0, length), z, events=[terminal(function) for _, _, function in functions],
        max_step=longest, first_step=min(1e-3 * longest, length), **{**TOLERANCES, "atol": 1e-15 * scale},
    )  # fmt: skip
    assert done.status >= 0, done.message
    hits = [(times[0], n) for n, times in enumerate(done.t_events) if times.size]
    if not hits:
        return length, None, done.y[:, -1].copy(), done.sol
    took, which = min(hits)
    return float(took), which, done.y_events[which][0].copy(), done.sol
