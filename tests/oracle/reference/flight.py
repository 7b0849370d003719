"""The yardstick of flights: to 50 digits, by Taylor series,
its events certified by Bernstein coefficients in exact integers.

    x'' = C - p x' - q x     c_(n+2) = (- p (n+1) c_(n+1) - q c_n)/((n+1)(n+2))  behind the acceleration

A window is so short that the series converges at once; it ends early where something happens. No closed form of the
motion.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from ..polynomials import first_crossing
from .records import Event, Number, Real, Robot, exact, mp, parse_robot

TERMS = 64
BITS = 330
TOUCH = 200  # a minimum not deeper than 2^-(BITS - TOUCH) of the function's scale is a touch
REACH = 2  # (p + sqrt q) times a window


class Ledger(NamedTuple):
    """Work of the motor and of the constant force, losses, signed as they enter."""

    motor_work: Real
    offset_work: Real
    viscous_1: Real
    coulomb_1: Real
    stop_loss: Real


@dataclass
class FlightReference:
    """What a flight is; end holds x1, v1, v2 and how far the foot is below the ground ahead."""

    status: str
    duration: Real
    end: tuple[Real, Real, Real, Real]
    events: list[Event]
    ledger: Ledger


@dataclass
class _Now:
    """The actuator and what it does, with what has been summed up."""

    robot: Robot
    Kp: Real
    Kd: Real
    force: Real
    t: Real
    x: Real
    v: Real
    acc: Real
    side: int
    limit: int
    squares: Real
    way: Real
    path: Real
    motor: Real
    lost: Real

    def poles(self) -> tuple[Real, Real]:
        r = self.robot
        return (r.b1 / r.m_eff, mp.zero) if self.limit else ((r.b1 + self.Kd) / r.m_eff, self.Kp / r.m_eff)

    def free(self) -> Real:
        """The acceleration without dry friction."""
        r = self.robot
        pull = self.limit * self.force if self.limit else self.Kp * self.x + self.Kd * self.v
        return (r.k * r.c - r.b1 * self.v - pull) / r.m_eff

    def blocked(self, side: int) -> bool:
        r = self.robot
        if r.x1_min == r.x1_max:
            return True
        return bool((side < 0 and self.x <= r.x1_min) or (side > 0 and self.x >= r.x1_max))

    def choose_limit(self) -> None:
        pull = self.Kp * self.x + self.Kd * self.v
        self.limit = 0 if abs(pull) <= self.force else int(mp.sign(pull))
        if abs(pull) == self.force and self.side:
            rate = self.Kp * self.v + self.Kd * (self.free() - self.side * self.robot.f1)
            self.limit = int(mp.sign(pull)) if rate * pull > 0 else 0

    def settle(self) -> None:
        free = self.free()
        side = int(mp.sign(free)) if abs(free) > self.robot.at_rest[0] else 0
        self.side = 0 if self.blocked(side) else side
        self.acc = free - self.side * self.robot.f1 if self.side else mp.zero


def _series(now: _Now, h: Real) -> tuple[list[Real], list[Real]]:
    """Taylor coefficients of x_1 - x_1(0) and v_1 in tau = t/h."""
    if now.side == 0:
        return [mp.zero] * 3, [mp.zero] * 3
    p, q = now.poles()
    v = [now.v, now.acc * h]
    for n in range(TERMS):
        v.append((-p * h * (n + 1) * v[n + 1] - q * h * h * v[n]) / ((n + 1) * (n + 2)))
    return [mp.zero, *(c * h / (n + 1) for n, c in enumerate(v))], v


def _value(coefficients: Sequence[Real], tau: Real) -> Real:
    total = mp.zero
    for c in reversed(coefficients):
        total = total * tau + c
    return total


def _first(coefficients: Sequence[Real], starts_at_zero: bool) -> Real | None:
    """First tau in [0, 1] where a function that begins positive falls below zero."""
    series = list(coefficients[1:]) if starts_at_zero else list(coefficients)
    scale = max(map(abs, series))
    if not scale:
        return None
    whole = [int(mp.nint(mp.ldexp(c / scale, BITS))) for c in series]
    if whole[0] <= 0:
        return mp.zero
    place = first_crossing(whole, BITS, 1 << TOUCH, lambda *_: None)
    return None if place is None else mp.ldexp(mp.mpf(place), -BITS)


def _product(a: Sequence[Real], b: Sequence[Real], tau: Real) -> Real:
    """Integral of the product of two series from 0 to tau."""
    scales = [max(map(abs, series)) or mp.one for series in (a, b)]
    first, second = (
        [int(mp.nint(mp.ldexp(c / scale, BITS))) for c in series] for series, scale in zip((a, b), scales, strict=True)
    )
    product = [0] * (len(first) + len(second) - 1)
    for i, left in enumerate(first):
        for j, right in enumerate(second):
            product[i + j] += left * right
    integral = [mp.zero, *(mp.ldexp(mp.mpf(c), -2 * BITS) / (n + 1) for n, c in enumerate(product))]
    return scales[0] * scales[1] * _value(integral, tau)


def _pull_watches(now: _Now, pull: list[Real], fresh: bool) -> list[tuple[list[Real], bool, str]]:
    if not (now.Kp or now.Kd):
        return []
    if now.limit:
        inside = [now.limit * c for c in pull]
        inside[0] -= now.force
        return [(inside, fresh, "pull 0")]
    watches = []
    for sign in (1, -1):
        if mp.isinf(now.force):
            continue
        room = [-sign * c for c in pull]
        room[0] += now.force
        watches.append((room, fresh and abs(room[0]) < now.force / 2, f"pull {sign}"))
    return watches


def solve_flight(
    robot: Mapping[str, Number],
    *,
    v2: Number,
    x1: Number = 0,
    v1: Number = 0,
    y: Number = 0,
    gains: tuple[Number, Number],
    horizon: Number = 10,
    max_phases: int = 4096,
) -> FlightReference:
    """The flight from a state at take-off; y is how far the foot is below the ground ahead there."""
    return _solved(tuple(sorted(robot.items())), v2, x1, v1, y, *gains, horizon, max_phases, mp.prec)


@lru_cache(maxsize=256)
def _solved(
    robot: tuple[tuple[str, Number], ...],
    v2: Number,
    x1: Number,
    v1: Number,
    y: Number,
    Kp: Number,
    Kd: Number,
    horizon: Number,
    max_phases: int,
    _precision: int,
) -> FlightReference:
    """The same problem is solved once, for both precisions."""
    r = parse_robot(dict(robot))
    force = abs(r.gamma2) * r.u_max if r.gamma2 else mp.zero
    gains = (exact(Kp), exact(Kd)) if force else (mp.zero, mp.zero)
    zero = mp.zero
    now = _Now(r, *gains, force, zero, exact(x1), exact(v1), zero, 0, 0, zero, zero, zero, zero, zero)
    body, rise, start_foot = exact(x1) - exact(y), exact(v2), -exact(y)
    _begin(now)
    return _Flight(now, body, rise, start_foot, exact(horizon), max_phases).run()


def _begin(now: _Now) -> None:
    now.side = int(mp.sign(now.v))
    if now.side and now.blocked(now.side):
        now.lost -= now.robot.m_eff * now.v**2 / 2
        now.v, now.side = mp.zero, 0
    now.choose_limit()
    if now.side:
        now.acc = now.free() - now.side * now.robot.f1
    else:
        now.settle()


class _Flight:
    def __init__(self, now: _Now, body: Real, rise: Real, foot: Real, horizon: Real, max_phases: int) -> None:
        self.now, self.body, self.rise, self.horizon, self.max_phases = now, body, rise, horizon, max_phases
        self.foot = foot
        self.airborne = foot > 0
        self.foot_at_zero = foot == 0
        self.rate_at_zero = False
        self.fresh_pull = False
        self.events: list[Event] = []
        self.best = self._result("tripped", self.foot)
        self.best_foot = self.foot

    def _result(self, status: str, foot: Real) -> FlightReference:
        now, r = self.now, self.now.robot
        ledger = Ledger(now.motor, r.k * r.c * now.way, -r.b1 * now.squares, -r.m_eff * r.f1 * now.path, now.lost)
        end = (now.x, now.v, self.rise - r.g * now.t, mp.zero if status == "touchdown" else -foot)
        return FlightReference(status, now.t, end, list(self.events), ledger)

    def run(self) -> FlightReference:
        while True:
            kind = self._window()
            if kind == "touchdown":
                return self._result("touchdown", mp.zero)
            if not self.airborne and self.foot > self.best_foot:
                self.best, self.best_foot = self._result("tripped", self.foot), self.foot
            if self.now.t >= self.horizon or self._is_too_low():
                return self._result("horizon", self.foot) if self.airborne else self.best
            if kind in ("velocity", "stop") or kind.startswith("pull"):
                self._happens(kind)
                if len(self.events) >= self.max_phases:
                    return self._result("too_many_phases", self.foot)

    def _is_too_low(self) -> bool:
        """Whether the body falls and is so low that not even with the shortest leg the foot comes as high again."""
        now, r = self.now, self.now.robot
        shortest = now.x - r.x1_min
        return bool(not self.airborne and self.rise < r.g * now.t and self.foot + shortest < self.best_foot)

    def _window(self) -> str:
        """Go on to the next thing that happens, or to the end of a window; says which."""
        now, r = self.now, self.now.robot
        left = self.horizon - now.t
        p, q = now.poles()
        speed = (p + mp.sqrt(q)) if now.side else mp.zero
        h = min(left, REACH / speed) if speed else left
        x, v = _series(now, h)
        foot = [-c for c in x]
        foot[0] = self.foot
        foot[1] += (self.rise - r.g * now.t) * h
        foot[2] -= r.g * h * h / 2
        rate = [n * c for n, c in enumerate(foot)][1:]
        place = [now.Kp * c for c in x]
        place[0] += now.Kp * now.x
        pull = [a + now.Kd * b for a, b in zip(place, v, strict=False)]
        found: list[tuple[Real, int, str]] = []
        for order, (series, at_zero, kind) in enumerate(self._watches(x, v, foot, rate, pull)):
            tau = _first(series, at_zero)
            if tau is not None:
                found.append((tau, order, kind))
        tau, _, kind = min(found) if found else (mp.one, 0, "window")
        self._go(h, tau, kind, x, v, foot, pull)
        return kind

    def _watches(
        self, x: list[Real], v: list[Real], foot: list[Real], rate: list[Real], pull: list[Real]
    ) -> list[tuple[list[Real], bool, str]]:
        now = self.now
        watches: list[tuple[list[Real], bool, str]] = []
        if self.airborne:
            watches.append((foot, self.foot_at_zero, "touchdown"))
        else:
            begins = next(c for c in foot[1:] if c) if self.foot_at_zero else mp.mpf(-1)
            if begins > 0:
                self.airborne = True
                watches.append((foot, True, "touchdown"))
            else:
                watches.append(([-c for c in foot], self.foot_at_zero, "rises"))
                leading = rate[1] if self.rate_at_zero else rate[0]
                turn = 1 if leading > 0 else -1
                watches.append(([turn * c for c in rate], self.rate_at_zero, "turns"))
        if now.side:
            stop = now.robot.x1_max if now.side > 0 else now.robot.x1_min
            if mp.isfinite(stop):
                room = [-now.side * c for c in x]
                room[0] = now.side * (stop - now.x)
                watches.append((room, False, "stop"))
            watches.append(([now.side * c for c in v], now.v == 0, "velocity"))
            watches += _pull_watches(now, pull, self.fresh_pull)
        return watches

    def _go(
        self, h: Real, tau: Real, kind: str, x: list[Real], v: list[Real], foot: list[Real], pull: list[Real]
    ) -> None:
        now, g = self.now, self.now.robot.g
        way = _value(x, tau)
        if now.side:
            now.squares += h * _product(v, v, tau)
            now.motor -= now.limit * now.force * way if now.limit else h * _product(pull, v, tau)
            now.path += abs(way)
        now.way += way
        acc = _value([n * c for n, c in enumerate(v)][1:], tau) / h if now.side else mp.zero
        self.foot = _value(foot, tau)
        now.t, now.x, now.v, now.acc = now.t + h * tau, now.x + way, _value(v, tau), acc
        self.fresh_pull = kind.startswith("pull") or (self.fresh_pull and tau == 0)
        self.foot_at_zero, self.rate_at_zero = kind == "rises", kind == "turns"
        if kind == "rises":
            self.airborne, self.foot = True, mp.zero
        if kind == "window" and tau == 1:
            self.foot = self.body - now.x + self.rise * now.t - g * now.t**2 / 2

    def _happens(self, kind: str) -> None:
        now = self.now
        if kind.startswith("pull"):
            now.limit = int(kind.split()[1])
            self.events.append(Event(now.t, "u_saturates" if now.limit else "u_desaturates"))
            return
        before, acc = now.side, now.acc
        stop = now.robot.x1_max if before > 0 else now.robot.x1_min
        if kind == "stop" or abs(now.x - stop) <= mp.mpf(10) ** -40:  # an actuator that comes to rest at the stop
            now.lost -= now.robot.m_eff * now.v**2 / 2
            now.x, now.v = stop, mp.zero
            now.choose_limit()
            now.settle()
            self.events.append(Event(now.t, "x1_hits_stop"))
            return
        now.v = mp.zero
        now.settle()
        if not now.robot.at_rest[0]:
            side = int(mp.sign(acc))
            now.side = 0 if now.blocked(side) else side
            now.acc = acc if now.side else mp.zero
        if now.side != before:
            self.events.append(Event(now.t, "x1_reverses" if now.side else "x1_sticks"))
