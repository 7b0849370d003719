# SPDX-License-Identifier: MIT-0
"""A flight as a chain of phases: the body is ballistic, the actuator returns under the law or at the limit of its
current.

In a phase v_1, the jerk and the rate of the law's pull are motions of the pair of poles alone, whose zeros rule 3 of
docs/explanation/certificate.md has in closed form. Between those of the jerk the foot's acceleration is monotone,
between the roots of that its rate, between the roots of that the foot itself: each root is bracketed. A leg in which a
damper acts relaxes as exp(-l t), and the foot with it: (D + l) takes that from the foot's third derivative and leaves a
motion of the pair. One flight at a time.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from hopform_solver import events, formulas
from hopform_solver.lanes import Array, Numbers, choose, take
from hopform_solver.ledgers import moments_of, sums_before
from hopform_solver.limits import FASTEST_LEG, LEG_HAS_DAMPER, NEVER
from hopform_solver.phases import pair_alone, stable_rates_of
from hopform_solver.records import (
    FLIGHT_ENDINGS,
    FLIGHT_EVENTS,
    Actuator,
    Basis,
    Drive,
    Energy,
    FlightLedger,
    FlightRates,
    FlightWork,
    Gains,
    LegState,
    Poles,
    Rates,
    Robot,
    Way,
)

Real: TypeAlias = Any
"""A number in the precision of the flight."""

_ENDING: dict[str, int] = {text: number for number, text in FLIGHT_ENDINGS.items()}
_EVENT = {text: number for number, text in FLIGHT_EVENTS.items()} | {"": 0}
_LARGEST = {np.dtype(np.float32): 1e38, np.dtype(np.float64): 1e300}
SETTLED_BEFORE, SHORTEST = 0.05, 0.02
"""[s] how long before the touchdown that is expected a designed return has settled, and the least time it takes."""


class FlightPhase(NamedTuple):
    """Where and when a phase starts, the sign of v_1 (0 if held), that of the pull at its limit (0 under the law), and
    why.
    """

    t: Real
    x1: Real
    v1: Real
    acc1: Real
    side: Real
    limit: Real
    event: Real


@dataclass(frozen=True)
class FlightSolution:
    """A flight, solved. In its states y is x_1 - x_2 + L_0 + c over the ground ahead: how far the foot of a leg that
    carries nothing is below it.

    ground [m]: height of the ground ahead over that which was left. duration [s], end: the state before the impact,
    v2_after [m/s] it, apex [m] up to the ending, apex_time [s], impact_loss, start_loss and leg_loss [J] (negative),
    ending: a key of FLIGHT_ENDINGS, phases.
    """

    robot: Robot
    gains: Gains
    start: LegState
    ground: Real
    duration: Real
    end: LegState
    v2_after: Real
    apex: Real
    apex_time: Real
    impact_loss: Real
    start_loss: Real
    leg_loss: Real
    ending: int
    phases: tuple[FlightPhase, ...]

    @property
    def fall(self) -> Real:
        return formulas.fall_of(self.robot)

    def times(self, t: ArrayLike) -> Array:
        """Times in the precision of the flight."""
        return np.asarray(t, dtype=np.asarray(self.duration).dtype)


# ---- a phase over time ----


def largest_force(robot: Robot) -> Real:
    """The largest force of the motor, 0 if it has none."""
    if robot.gamma2 == 0.0:
        return robot.gamma2 * 0.0
    return min(abs(robot.gamma2) * robot.u_max, type(robot.gamma2)(_LARGEST[robot.gamma2.dtype]))


def _poles(rates: FlightRates, limit: Array) -> Poles:
    """Of the actuator, under the law or at a limit."""
    return pair_alone(choose(limit == 0, rates.p_law, rates.p_free), choose(limit == 0, rates.q_law, rates.q_law * 0.0))


def _ways(poles: Array, v1: Array, acc1: Array, propagator: Array) -> Array:
    """How far the actuator has moved since a phase began, and the derivatives of that up to the sixth, or seventh."""
    numerator = np.array([v1, acc1 + poles[1] * v1, np.zeros_like(v1)])
    ways = [*events.jets_of(events.EventSet(poles, poles, numerator, np.zeros_like(v1)), propagator)]
    for _ in range(3 + LEG_HAS_DAMPER):
        ways.append(events.next_derivative(poles, ways))
    return np.array(ways)


def zero_of_pair(poles: Array, motion: Array) -> Real:
    """When a motion of the pair, which begins with a value and a rate, first vanishes behind the start of the phase;
    NEVER if it does not.
    """
    value, rate = motion * np.sign(motion[0] if motion[0] != 0.0 else motion[1])
    return events.time_to_rest(Poles(*poles), value[np.newaxis], rate[np.newaxis])[0]


# ---- the chain ----

WAY, PULL, FOOT = range(3)
"""Functions of time in a phase: how far the actuator has moved, what the law asks of the motor, the foot's height."""


class _Times(NamedTuple):
    """Times of a phase, the propagator there, and WAY, PULL and FOOT with their derivatives up to the fifth."""

    t: Array
    propagator: Array
    functions: Array


@dataclass
class _Chain:
    """The chain while it grows."""

    robot: Robot
    gains: Gains
    rates: FlightRates
    largest: Real
    start: LegState
    horizon: Real
    t: Real
    actuator: Actuator
    foot: Real
    side: int
    limit: int
    airborne: bool
    phases: list[FlightPhase]
    leg: Real
    """compression that a damper leaves in it, and the rate at which it relaxes"""
    relaxes: Real

    def __post_init__(self) -> None:
        self.highest: tuple[Real, Real, LegState, int] = (-np.inf, self.t, self.start, 0)
        self.start_loss = self.t * 0.0
        self.poles_by_limit = [np.array(_poles(self.rates, np.array([limit]))) for limit in (0, 1)]
        self.eps = np.finfo(self.t.dtype).eps

    @property
    def poles(self) -> Array:
        return self.poles_by_limit[abs(self.limit)]

    @property
    def fall(self) -> Real:
        return formulas.fall_of(self.robot)

    def at(self, t: Array, propagator: Array | None = None) -> _Times:
        (Kp, Kd), g, v2 = self.gains, self.fall, self.start.v2 - self.fall * self.t
        poles = self.poles.repeat(t.size, axis=1)
        found = events.propagator_at(poles, t) if propagator is None else propagator
        way = _ways(poles, self.actuator.v1 + 0.0 * t, self.actuator.acc1 + 0.0 * t, found)
        pull, foot = Kp * way[:6] + Kd * way[1:7], -way
        pull[0] += Kp * self.actuator.x1
        foot[0] += self.foot + (v2 - 0.5 * g * t) * t
        foot[1] += v2 - g * t
        foot[2] -= g
        if self.leg:
            foot += self.leg_at(t) * (-self.relaxes) ** np.arange(len(foot), dtype=t.dtype)[:, np.newaxis]
        functions = np.zeros((3, *way.shape), t.dtype)
        functions[WAY], functions[PULL, :6], functions[FOOT] = way, pull, foot
        return _Times(t, found, functions)

    def at_start(self) -> _Times:
        zero = np.zeros(1, self.t.dtype)
        return self.at(zero, events.propagator_of(self.poles, Basis(zero + 1.0, zero, zero, zero, zero)))

    def leg_at(self, t: Any) -> Any:
        """What is left of the leg's compression."""
        return self.leg * np.exp(-self.relaxes * (self.t + t)) if self.leg else t * 0.0

    def state_at(self, points: _Times, n: int) -> LegState:
        (moved, v1, *_), _, (foot, *_) = points.functions[..., n]
        v2, leg = self.start.v2 - self.fall * (self.t + points.t[n]), self.leg_at(points.t[n])
        return LegState(self.within_stroke(moved), v1, v2, leg - foot)

    def within_stroke(self, moved: Real) -> Real:
        """x_1, which rounding or underflow may have put a last digit beyond a stop."""
        return np.clip(self.actuator.x1 + moved, self.robot.x1_min, self.robot.x1_max)

    def time_of(self, t: Real) -> Real:
        """Time since take-off, not behind the horizon by rounding."""
        return min(self.t + t, self.horizon)

    def record(self, event: str) -> None:
        self.phases.append(FlightPhase(self.t, *self.actuator, self.side, self.limit, _EVENT[event]))

    def with_roots(self, which: int, order: int, level: Real, points: _Times) -> _Times:
        """Times and, among them, the roots of a function, or of its derivative of an order, which is monotone between
        them.
        """
        value = points.functions[which, order] - level
        places = np.flatnonzero(value[:-1] * value[1:] < 0.0) + 1
        if not places.size:
            return points
        sign, poles = np.sign(value[places - 1]), self.poles.repeat(places.size, axis=1)

        def curve(lanes: Numbers, t: Array, propagator: Array) -> Array:
            jet = self.at(t, propagator).functions[which, order : order + 5]
            jet[0] -= level
            if self.leg and which == FOOT:
                jet[4] = NEVER[t.dtype]  # its rate is no pole: no step is known to land
            return np.asarray(sign[lanes] * jet)

        every = np.arange(places.size)
        (low, at_low), (high, at_high) = (take(points[:2], n) for n in (places - 1, places))
        guess = events.rough_root(curve(every, low, at_low), curve(every, high, at_high), high - low)
        roots = self.at(*events.root_between(poles, curve, low, high, at_high, low + (high - low) * guess))
        both = [np.concatenate(pair, axis=-1) for pair in zip(points, roots, strict=True)]
        return take(_Times(*both), np.argsort(both[0], kind="stable"))

    def until(self, which: int, level: Real, points: _Times, n: int) -> _Times:
        """The times up to the n-th and, as the last one, where a function is at a level then."""
        found = self.with_roots(which, 0, level, take(points, np.array([n, n + 1])))
        ends = take(found, np.array([1 if found.t.size > 2 else 0]))
        before = take(points, np.arange(n + 1))
        return _Times(*(np.concatenate(pair, axis=-1) for pair in zip(before, ends, strict=True)))


# ---- the end of a phase ----


class _End(NamedTuple):
    kind: str
    limit: int = 0


def _watch_stop(chain: _Chain, points: _Times, end: _End) -> tuple[_Times, _End]:
    """x_1 is monotone in a phase: it has met the stop ahead if it is beyond it at the end, or comes to rest at it."""
    stop = chain.robot.x1_max if chain.side > 0 else chain.robot.x1_min
    way, moved = stop - chain.actuator.x1, points.functions[WAY, 0]
    beyond = chain.side * (moved - way)
    size = abs(stop) + abs(chain.actuator.x1) + abs(moved[-1])
    if end.kind == "velocity" and np.isfinite(stop) and abs(beyond[-1]) <= 16.0 * chain.eps * size:
        return points, _End("stop")
    if np.isfinite(stop) and beyond[-1] > 0.0:
        return chain.until(WAY, way, points, np.flatnonzero(beyond[1:] > 0.0)[0]), _End("stop")
    return points, end


def _watch_pull(chain: _Chain, points: _Times, end: _End) -> tuple[_Times, _End]:
    """Where the current reaches its limit or leaves it, on pieces on which the pull is monotone; a touch is none."""
    (Kp, Kd), largest = chain.gains, chain.largest
    limits = ((-chain.limit, 0),) if chain.limit else ((1, 1), (-1, -1))
    for sign, limit in limits if Kp > 0.0 or Kd > 0.0 else ():
        moved, v1 = np.abs(points.functions[WAY, :2])
        size = largest + Kp * (abs(chain.actuator.x1) + moved) + Kd * (abs(chain.actuator.v1) + v1)
        level = (limit or chain.limit) * largest
        room = sign * (level - points.functions[PULL, 0])
        beyond = np.flatnonzero(room[1:] < -16.0 * chain.eps * size[1:])
        if beyond.size:
            sooner = chain.until(PULL, level, points, beyond[0])
            points, end = (sooner, _End("pull", limit)) if sooner.t[-1] < points.t[-1] else (points, end)
    return points, end


def _watch_foot(chain: _Chain, points: _Times, end: _End) -> tuple[_Times, _End]:
    """The foot's first downward crossing of the ground after it has been above it."""
    for order in (3, 2, 1) if chain.leg else (2, 1):
        points = chain.with_roots(FOOT, order, 0.0, points)
    t, (foot, rate, *_), v2 = points.t, points.functions[FOOT], chain.start.v2 - chain.fall * chain.t
    size = (
        abs(chain.foot) + np.abs(v2 * t) + 0.5 * chain.fall * t * t + np.abs(points.functions[WAY, 0]) + abs(chain.leg)
    )
    noise = 16.0 * chain.eps * size
    for n in range(1, t.size):
        falls = foot[n] < foot[n - 1] and foot[n] < 0.0 and (foot[n] < -noise[n] or rate[n] * t[n] < -noise[n])
        if chain.airborne and falls:
            return chain.until(FOOT, 0.0, points, n - 1), _End("touchdown")
        if not chain.airborne:
            _remember_highest(chain, points, n)
            chain.airborne = bool(foot[n] > noise[n])
    return points, end


def _remember_highest(chain: _Chain, points: _Times, n: int) -> None:
    if points.functions[FOOT, 0, n] > chain.highest[0]:
        time, state = chain.time_of(points.t[n]), chain.state_at(points, n)
        chain.highest = (points.functions[FOOT, 0, n], time, state, len(chain.phases))


def _find_end(chain: _Chain, until: Real) -> tuple[_Times, _End]:
    """The times of a phase up to its end, and by what it ends."""
    start, poles = chain.at_start(), chain.poles
    way, pull, _ = start.functions[..., 0]
    jerk = way[4:6] + chain.relaxes * way[3:5] if chain.leg else way[3:5]
    rest, *turns = (zero_of_pair(poles, motion) for motion in (way[1:3], pull[1:3], jerk))
    if not poles[2] > 0.0 and chain.side * _acceleration(chain, 0.0 * until, chain.side) >= 0.0:
        rest = NEVER[until.dtype]  # nothing grows with x_1 or would turn it back at rest: its velocity fades
    end, last = (_End("velocity"), rest) if rest <= until else (_End("limit"), until)
    points = chain.at(np.array([start.t[0], *sorted(t for t in turns if t < last), last]))
    if chain.side:
        points, end = _watch_pull(chain, *_watch_stop(chain, points, end))
    return _watch_foot(chain, points, end)


# ---- what the actuator does ----


def _blocked(robot: Robot, x1: Real, side: int) -> bool:
    locked = not robot.x1_min < robot.x1_max
    return bool(locked or (side < 0 and x1 <= robot.x1_min) or (side > 0 and x1 >= robot.x1_max))


def _acceleration(chain: _Chain, v1: Real, side: int) -> Real:
    """The acceleration under what the motor does now, at a velocity, with the friction of a side."""
    if chain.limit == 0:
        return formulas.acceleration_under_law(chain.robot, chain.rates, chain.actuator[0], v1, side)
    return formulas.acceleration_at_limit(chain.robot, chain.rates, v1, side, chain.limit)


def _choose_limit(chain: _Chain) -> None:
    """Whether the motor is at its limit: where its pull is there exactly, the way in which that changes decides."""
    x1, v1, _ = chain.actuator
    pull = chain.gains.Kp * x1 + chain.gains.Kd * v1
    chain.limit = int(np.sign(pull)) if abs(pull) > chain.largest else 0
    if abs(pull) == chain.largest and chain.side:
        rate = chain.gains.Kp * v1 + chain.gains.Kd * _acceleration(chain, chain.actuator[1], chain.side)
        chain.limit = int(np.sign(pull)) if rate * pull > 0.0 else 0


def _settle(chain: _Chain, known: Real | None = None) -> None:
    """An actuator at rest: held while the free acceleration is within the friction; `known` if there is no friction."""
    free = _acceleration(chain, chain.actuator[1], 0) if known is None else known
    side = int(np.sign(free)) if abs(free) > formulas.friction_of(chain.robot).level_1 else 0
    chain.side = 0 if _blocked(chain.robot, chain.actuator.x1, side) else side
    acc1 = _acceleration(chain, chain.actuator[1], chain.side) if known is None else known
    chain.actuator = chain.actuator._replace(acc1=acc1 if chain.side else acc1 * 0.0)


def _rest(chain: _Chain, hits: bool) -> None:
    """The actuator has come to rest. Without dry friction its acceleration goes on as it was."""
    before, (x1, _, acc1), robot = chain.side, chain.actuator, chain.robot
    stop, zero = robot.x1_max if before > 0 else robot.x1_min, abs(acc1) * 0.0
    chain.actuator = Actuator(stop if hits else x1, zero, zero)
    if hits:
        _choose_limit(chain)
    _settle(chain, None if hits or formulas.friction_of(robot).level_1 > 0.0 else acc1)
    turned = "x1_sticks" if chain.side == 0 else "x1_reverses" if chain.side != before else ""
    chain.record("x1_hits_stop" if hits else turned)


def _begin(chain: _Chain) -> None:
    """What the actuator does at the start; no event."""
    v1 = chain.actuator.v1
    chain.side = int(np.sign(v1))
    if chain.side and _blocked(chain.robot, chain.actuator.x1, chain.side):
        chain.start_loss = -0.5 * chain.robot.m_eff * v1 * v1
        chain.actuator, chain.side = chain.actuator._replace(v1=v1 * 0.0), 0
    _choose_limit(chain)
    if chain.side == 0:
        _settle(chain)
    else:
        chain.actuator = chain.actuator._replace(acc1=_acceleration(chain, chain.actuator[1], chain.side))
    chain.record("")


def _too_low(chain: _Chain) -> bool:
    """The foot cannot come as high again as it was: the body falls, and is too low for the shortest leg."""
    shortest = chain.actuator.x1 - chain.robot.x1_min
    falls = chain.start.v2 < chain.fall * chain.t and np.isfinite(shortest)
    leg = np.maximum(chain.leg_at(chain.t * 0.0), 0.0)
    return bool(not chain.airborne and falls and chain.foot + shortest + leg < chain.highest[0])


def _trip(chain: _Chain) -> tuple[str, LegState]:
    _, chain.t, state, count = chain.highest
    del chain.phases[count:]
    return "tripped", state


def _run(chain: _Chain, max_phases: int) -> tuple[str, LegState]:
    _begin(chain)
    _remember_highest(chain, chain.at_start(), 0)
    while True:
        if _too_low(chain):
            return _trip(chain)
        points, end = _find_end(chain, chain.horizon - chain.t)
        state, acc1 = chain.state_at(points, -1), points.functions[WAY, 2, -1]
        chain.t = chain.horizon if end.kind == "limit" else chain.time_of(points.t[-1])
        if end.kind == "touchdown":
            return "touchdown", state._replace(y=chain.leg_at(chain.t * 0.0))
        if end.kind == "limit":
            return ("horizon", state) if chain.airborne else _trip(chain)
        chain.actuator = Actuator(state.x1, state.v1, acc1)
        if end.kind == "pull":
            chain.limit = end.limit
            chain.record("u_saturates" if end.limit else "u_desaturates")
        else:
            _rest(chain, end.kind == "stop")
        if len(chain.phases) > max_phases:
            chain.phases.pop()
            return "too_many_phases", state
        rise = (chain.start.v2 - 0.5 * chain.fall * chain.t) * chain.t
        chain.foot = chain.start.x1 - chain.start.y - chain.actuator.x1 + rise


# ---- what users call ----


def expected_time(robot: Robot, start: LegState) -> Real:
    """The time in which a designed return settles: 50 ms before the touchdown on the ground that was left, 20 ms at
    least.
    """
    square = start.v2 * start.v2 + 2.0 * formulas.fall_of(robot) * start.x1
    fall = formulas.time_of_fall(robot, start.v2, start.x1) if square > 0.0 else 0.0
    return type(start.v2)(max(fall - SETTLED_BEFORE, SHORTEST))


@np.errstate(all="ignore")
def solve_flight(
    robot: Robot,
    start: LegState,
    ground: float = 0.0,
    gains: Gains | None = None,
    horizon: float = 10.0,
    max_phases: int = 4096,
    dtype: type[np.floating] = np.float64,
) -> FlightSolution:
    """Solve one flight.

    start: the state at take-off. ground [m]: height of the ground ahead over that which is left. gains: of the law
    gamma2 u = Kp x1 + Kd v1, designed if left out. horizon [s]: the longest time.
    An unstable robot is a ValueError; no other input is checked here: hopform does that.
    """
    one = Robot(*(dtype(field) for field in robot))
    stable_rates_of(one)
    given = LegState(*(dtype(field) for field in start))
    zero = dtype(0.0)
    rest = formulas.compression_at_takeoff(one, zero, zero)
    first = given._replace(y=dtype((given.y - rest) + dtype(ground)))
    time = formulas.leg_time(one) if LEG_HAS_DAMPER else zero
    relaxes = time > FASTEST_LEG[np.dtype(dtype)]
    leg, rate = (dtype(given.y - rest), dtype(1.0 / time)) if relaxes else (zero, zero)
    largest = largest_force(one)
    law = Gains(dtype(0.0), dtype(0.0))
    if largest > 0.0:
        wanted = formulas.critical_gains(one, expected_time(one, first)) if gains is None else gains
        law = Gains(*(dtype(gain) for gain in wanted))
    chain = _Chain(
        one, law, formulas.flight_rates_of(one, law, largest), largest, first, dtype(horizon), zero,
        Actuator(first.x1, first.v1, zero), -first.y, 0, 0, bool(first.y < leg), [], leg, rate,
    )  # fmt: skip
    ending, end = _run(chain, max_phases)
    top, lands = np.clip(first.v2 / chain.fall, zero, chain.t), ending == "touchdown"
    left = chain.leg_at(zero)
    return FlightSolution(
        one, law, given, dtype(ground), chain.t, end._replace(y=dtype(end.y + rest)),
        formulas.velocity_after_impact(one, end.v2) if lands else end.v2,
        first.x1 - first.y + (first.v2 - 0.5 * chain.fall * top) * top, top,
        -0.5 * one.m_s * end.v2**2 * one.impact_loss if lands else zero,
        chain.start_loss, formulas.leg_energy(one, left) - formulas.leg_energy(one, leg), _ENDING[ending],
        tuple(chain.phases),
    )  # fmt: skip


def _phases_of(flight: FlightSolution) -> FlightPhase:
    """The phases, each field an array of numbers."""
    return FlightPhase(*np.array(flight.phases, np.asarray(flight.duration).dtype).T)


def _phase_at(phases: FlightPhase, t: Array) -> Numbers:
    """The phase that each time falls into."""
    return np.asarray(np.searchsorted(phases.t, t, side="right") - 1)


def _in_phases(flight: FlightSolution, phase: FlightPhase, t: Array) -> tuple[Poles, Array]:
    """The poles of phases; how far the actuator has moved at times since they began, and the derivatives of that."""
    rates = formulas.flight_rates_of(flight.robot, flight.gains, largest_force(flight.robot))
    poles = _poles(rates, phase.limit)
    return poles, _ways(np.array(poles), phase.v1, phase.acc1, events.propagator_at(np.array(poles), t))


def flight_at(flight: FlightSolution, t: ArrayLike) -> LegState:
    """States at times t [s], 0 <= t <= duration, in t's shape."""
    times, phases, robot = flight.times(t), _phases_of(flight), flight.robot
    since = times.reshape(-1)
    phase = take(phases, _phase_at(phases, since))
    moved, v1, *_ = _in_phases(flight, phase, since - phase.t)[1]
    start, v2 = flight.start, flight.start.v2 - flight.fall * since
    rise = (start.v2 - 0.5 * flight.fall * since) * since
    x1 = np.clip(phase.x1 + moved, robot.x1_min, robot.x1_max)
    columns = x1, v1, v2, (start.y + flight.ground) - (rise - ((phase.x1 - start.x1) + moved))
    return LegState(*(column.reshape(times.shape) for column in columns))


# ---- energy ----


def _work_in(flight: FlightSolution, phase: FlightPhase, t: Array) -> tuple[Array, Array]:
    """The entries of the ledger over the first t of phases, and v_1 then.

    In a phase the actuator moves as beside a body that is held, on a spring of the law.
    """
    poles, way = _in_phases(flight, phase, t)
    zero = np.zeros_like(t)
    rates = Rates(*np.zeros((len(Rates._fields), t.size), t.dtype))
    rates = rates._replace(a1_y=-poles.q, a1_v1=-poles.p, p_1=poles.p, q_1=poles.q)
    drive, start = Drive(phase.acc1 + poles.p * phase.v1, zero), LegState(zero, phase.v1, zero, zero)
    squares = moments_of(rates, poles, drive, start, np.array([phase.side, zero]), t).int_v1v1
    over = Way(way[0], squares, (flight.start.v2 - flight.fall * (phase.t + 0.5 * t)) * t)
    largest = largest_force(flight.robot)
    work = formulas.flight_ledger_of(flight.robot, flight.gains, largest, phase.x1, phase.side, phase.limit, over)
    return np.array([zero + entry for entry in work]), way[1]


def flight_ledger_at(flight: FlightSolution, t: ArrayLike) -> FlightLedger:
    """The ledger from take-off to times t [s], in t's shape."""
    times, phases = flight.times(t), _phases_of(flight)
    since, index = times.reshape(-1), _phase_at(phases, times.reshape(-1))
    whole, v1 = _work_in(flight, phases, np.append(np.diff(phases.t), phases.t[:1]))
    hits = np.append(phases.event[1:] == _EVENT["x1_hits_stop"], False)
    lost = choose(hits, -0.5 * flight.robot.m_eff * v1 * v1, 0.0)
    sums = sums_before([*whole, lost], flight.start_loss)[:, index]
    sums[:-1] += _work_in(flight, take(phases, index), since - phases.t[index])[0]
    *work, stop_loss = (row.reshape(times.shape) for row in sums)
    return FlightLedger(**FlightWork(*work)._asdict(), stop_loss=stop_loss)


def flight_energy_at(flight: FlightSolution, t: ArrayLike) -> Energy:
    """Energies at times t [s], in t's shape."""
    state = flight_at(flight, t)
    return formulas.flight_energies(flight.robot, state.v1, state.v2, state.x1 - state.y)
