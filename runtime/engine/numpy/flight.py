# SPDX-License-Identifier: MIT-0
"""A flight as a chain of phases: the body is ballistic, the actuator returns under the law or at the limit of its
current.

In a phase v_1, the jerk and the rate of the law's pull are motions of the pair of poles alone, whose zeros rule 3 of
docs/explanation/certificate.md has in closed form. Between those of the jerk the foot's acceleration is monotone,
between the roots of that its rate, between the roots of that the foot itself: each root is bracketed. One flight at a
time.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from hopform_solver import formulas
from hopform_solver.events import step_converges, step_to_root, time_to_rest
from hopform_solver.kernels import decay_at, pair_at
from hopform_solver.lanes import Array
from hopform_solver.limits import LEG_HAS_DAMPER
from hopform_solver.phases import stable_rates_of
from hopform_solver.records import (
    FLIGHT_ENDINGS,
    FLIGHT_EVENTS,
    Actuator,
    ActuatorAt,
    Ballistic,
    Energy,
    FlightLedger,
    FlightRates,
    FlightWork,
    FootAt,
    Gains,
    LegState,
    Pair,
    Poles,
    Pull,
    Robot,
    Way,
)

Real: TypeAlias = Any
"""A number in the precision of the flight."""

_ENDING = {text: number for number, text in FLIGHT_ENDINGS.items()}
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
    side: int
    limit: int
    event: int


@dataclass(frozen=True)
class FlightSolution:
    """A flight, solved. In its states y is how far the foot is below the ground ahead.

    duration [s], end: the state before the impact, v2_after [m/s] it, apex [m] up to the ending, apex_time [s],
    impact_loss and start_loss [J] (negative), ending: a key of FLIGHT_ENDINGS, phases.
    """

    robot: Robot
    gains: Gains
    start: LegState
    duration: Real
    end: LegState
    v2_after: Real
    apex: Real
    apex_time: Real
    impact_loss: Real
    start_loss: Real
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


def _poles(rates: FlightRates, limit: int) -> Poles:
    zero = rates.p_law * 0.0
    p, q = (rates.p_law, rates.q_law) if limit == 0 else (rates.p_free, zero)
    return Poles(zero, p, q, p, q, zero)


def _response(poles: Poles, t: Real) -> Pair:
    """R, its derivative and its integral; with q = 0 R is the integral of exp(-p t)."""
    of_array = [np.array([value]) for value in poles]
    if poles.q > 0.0:
        return Pair(*(field[0] for field in pair_at(Poles(*of_array), np.array([t]))))
    decay = decay_at(of_array[1], np.array([t]))
    return Pair(decay.e[0], decay.e1[0], decay.e2[0], decay.e3[0], t * 0.0)


def _move(actuator: Actuator, poles: Poles, side: int, t: Real) -> ActuatorAt:
    if side == 0:
        return ActuatorAt(*[t * 0.0] * 4)
    return formulas.actuator_in_flight(actuator, poles, _response(poles, t))


class _Instant(NamedTuple):
    """Everything at one time of a phase; further: the derivatives of x_1 from the third on."""

    t: Real
    actuator: ActuatorAt
    further: tuple[Real, Real, Real, Real]
    pull: Pull
    foot: FootAt


Curve: TypeAlias = Callable[["_Chain", _Instant], tuple[Real, Real, Real, Real, Real]]
"""A function of time: its value and derivatives up to the fourth at an instant."""


def _foot_curvature(chain: "_Chain", at: _Instant) -> tuple[Real, Real, Real, Real, Real]:
    third, fourth, fifth, sixth = at.further
    return at.foot.foot_curvature, -third, -fourth, -fifth, -sixth


def _foot_rate(chain: "_Chain", at: _Instant) -> tuple[Real, Real, Real, Real, Real]:
    third, fourth, fifth, _ = at.further
    return at.foot.foot_rate, at.foot.foot_curvature, -third, -fourth, -fifth


def _foot(chain: "_Chain", at: _Instant) -> tuple[Real, Real, Real, Real, Real]:
    return *at.foot, -at.further[0], -at.further[1]


def _way(chain: "_Chain", at: _Instant) -> tuple[Real, Real, Real, Real, Real]:
    return at.actuator.moved, at.actuator.v1_t, at.actuator.acc1_t, at.further[0], at.further[1]


def _pull(chain: "_Chain", at: _Instant) -> tuple[Real, Real, Real, Real, Real]:
    (Kp, Kd), (third, fourth, fifth, _) = chain.gains, at.further
    return *at.pull, Kp * third + Kd * fourth, Kp * fourth + Kd * fifth


def zero_of_pair(poles: Poles, value: Real, rate: Real) -> Real:
    """When a motion of the pair, which begins with a value and a rate, first vanishes behind the start of the phase;
    NEVER if it does not.
    """
    sign = np.sign(value if value != 0.0 else rate)
    return time_to_rest(Poles(*np.array(poles)[:, np.newaxis]), np.array([sign * value]), np.array([sign * rate]))[0]


# ---- the chain ----


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

    def __post_init__(self) -> None:
        self.highest: tuple[Real, Real, LegState, int] = (-np.inf, self.t, self.start, 0)
        self.start_loss = self.t * 0.0
        self.eps = np.finfo(self.t.dtype).eps

    @property
    def poles(self) -> Poles:
        return _poles(self.rates, self.limit)

    @property
    def fall(self) -> Real:
        return formulas.fall_of(self.robot)

    @property
    def v2(self) -> Real:
        return self.start.v2 - self.fall * self.t

    def look(self, t: Real) -> _Instant:
        poles = self.poles
        actuator = _move(self.actuator, poles, self.side, t)
        pull = formulas.pull_of_law(self.gains, self.actuator, actuator)
        foot = formulas.foot_in_flight(self.robot, Ballistic(self.foot, self.v2), actuator, t)
        third = actuator.jerk1_t
        fourth = -poles.p * third - poles.q * actuator.acc1_t
        fifth = -poles.p * fourth - poles.q * third
        further = (third, fourth, fifth, -poles.p * fifth - poles.q * fourth)
        return _Instant(t, actuator, further, pull, foot)

    def state_of(self, at: _Instant) -> LegState:
        v2 = self.start.v2 - self.fall * (self.t + at.t)
        return LegState(self.within_stroke(at.actuator.moved), at.actuator.v1_t, v2, -at.foot.foot_t)

    def within_stroke(self, moved: Real) -> Real:
        """x_1, which rounding or underflow may have put a last digit beyond a stop."""
        return _clipped(self.robot, self.actuator.x1 + moved)

    def time_of(self, t: Real) -> Real:
        """Time since take-off, not behind the horizon by rounding."""
        return min(self.t + t, self.horizon)

    def record(self, event: str) -> None:
        self.phases.append(FlightPhase(self.t, *self.actuator, self.side, self.limit, _EVENT[event]))

    def root_between(self, curve: Curve, sign: float, level: Real, low: Real, end: _Instant) -> _Instant:
        """The root of sign (f - level) between a time where it is positive and an instant where it is negative."""
        last, high = end, end.t
        for n in range(100):
            at = np.array(curve(self, last))
            at[0] -= level
            at *= sign
            if abs(at[0]) <= self.eps * last.t * abs(at[1]):
                return last
            low, high = (last.t, high) if at[0] > 0.0 else (low, last.t)
            step = step_to_root(at[:4])
            follows = low < last.t - step < high and not (n > 8 and n % 2 == 1)
            new = last.t - step if follows else low + 0.5 * (high - low)
            if not low < new < high:
                return last
            lands = follows and step_converges(np.array(self.poles), at[:4], at[4], last.t, step)
            last = self.look(new)
            if lands:
                return last
        return last

    def split(self, curve: Curve, points: list[_Instant]) -> list[_Instant]:
        """The points and, among them, the roots of a function that is monotone between them."""
        found = points[:1]
        for before, after in zip(points, points[1:], strict=False):
            from_value, to_value = curve(self, before)[0], curve(self, after)[0]
            if from_value * to_value < 0.0:
                root = self.root_between(curve, float(np.sign(from_value)), from_value * 0.0, before.t, after)
                found += [root] if before.t < root.t < after.t else []
            found.append(after)
        return found

    def turned(self, start: Real, rate: Real, until: Real) -> list[_Instant]:
        """The ends of a time and, between them, the zero of a motion of the pair."""
        zero = zero_of_pair(self.poles, start, rate)
        times = [until * 0.0, zero, until] if zero < until else [until * 0.0, until]
        return [self.look(time) for time in times]


def _clipped(robot: Robot, x1: Real) -> Real:
    return robot.x1_min if x1 < robot.x1_min else robot.x1_max if x1 > robot.x1_max else x1


# ---- the end of a phase ----


class _End(NamedTuple):
    t: Real
    kind: str
    limit: int = 0


def _watch_stop(chain: _Chain, end: _End) -> _End:
    """x_1 is monotone in a phase: it has met the stop ahead if it is beyond it at the end, or comes to rest at it."""
    stop = chain.robot.x1_max if chain.side > 0 else chain.robot.x1_min
    way = stop - chain.actuator.x1
    last = chain.look(end.t)
    beyond = chain.side * (last.actuator.moved - way)
    size = abs(stop) + abs(chain.actuator.x1) + abs(last.actuator.moved)
    if end.kind == "velocity" and np.isfinite(stop) and abs(beyond) <= 16.0 * chain.eps * size:
        return _End(end.t, "stop")
    if np.isfinite(stop) and beyond > 0.0:
        return _End(chain.root_between(_way, -chain.side, way, end.t * 0.0, last).t, "stop")
    return end


def _watch_level(chain: _Chain, points: list[_Instant], sign: float, level: Real, limit: int, end: _End) -> _End:
    """Where sign (level - pull) becomes negative, on pieces on which the pull is monotone; a touch is none."""
    x1, v1 = abs(chain.actuator.x1), abs(chain.actuator.v1)
    for before, after in zip(points, points[1:], strict=False):
        size = chain.gains.Kp * (x1 + abs(after.actuator.moved)) + chain.gains.Kd * (v1 + abs(after.actuator.v1_t))
        if sign * (level - after.pull.pull) < -16.0 * chain.eps * (chain.largest + size):
            inside = sign * (level - before.pull.pull) > 0.0
            t = chain.root_between(_pull, -sign, level, before.t, after).t if inside else before.t
            return _End(t, "pull", limit) if t < end.t else end
    return end


def _watch_pull(chain: _Chain, end: _End) -> _End:
    """Where the current reaches its limit or leaves it."""
    if chain.gains.Kp == 0.0 and chain.gains.Kd == 0.0:
        return end
    start = chain.look(end.t * 0.0)
    points = chain.turned(start.pull.pull_rate, start.pull.pull_curvature, end.t)
    if chain.limit:
        return _watch_level(chain, points, -chain.limit, chain.limit * chain.largest, 0, end)
    end = _watch_level(chain, points, 1.0, chain.largest, 1, end)
    return _watch_level(chain, points, -1.0, -chain.largest, -1, end)


def _watch_foot(chain: _Chain, end: _End) -> _End:
    """The foot's first downward crossing of the ground after it has been above it."""
    start = chain.look(end.t * 0.0)
    points = chain.turned(*start.further[:2], end.t)
    for curve in (_foot_curvature, _foot_rate):
        points = chain.split(curve, points)
    for before, after in zip(points, points[1:], strict=False):
        size = abs(chain.foot) + abs(chain.v2 * after.t) + 0.5 * chain.fall * after.t**2 + abs(after.actuator.moved)
        noise = 16.0 * chain.eps * size
        foot, rate, _ = after.foot
        falls = foot < before.foot.foot_t and foot < 0.0 and (foot < -noise or rate * after.t < -noise)
        if chain.airborne and falls:
            inside = before.foot.foot_t > 0.0
            return _End(
                chain.root_between(_foot, 1.0, foot * 0.0, before.t, after).t if inside else before.t, "touchdown"
            )
        if not chain.airborne:
            _remember_highest(chain, after)
            chain.airborne = bool(foot > noise)
    return end


def _remember_highest(chain: _Chain, at: _Instant) -> None:
    if at.foot.foot_t > chain.highest[0]:
        chain.highest = (at.foot.foot_t, chain.time_of(at.t), chain.state_of(at), len(chain.phases))


def _find_end(chain: _Chain, until: Real) -> _End:
    end = _End(until, "limit")
    if chain.side:
        zero = zero_of_pair(chain.poles, chain.actuator.v1, chain.actuator.acc1)
        end = _End(zero, "velocity") if zero <= until else end
        end = _watch_pull(chain, _watch_stop(chain, end))
    return _watch_foot(chain, end)


# ---- what the actuator does ----


def _blocked(robot: Robot, x1: Real, side: int) -> bool:
    locked = not robot.x1_min < robot.x1_max
    return bool(locked or (side < 0 and x1 <= robot.x1_min) or (side > 0 and x1 >= robot.x1_max))


def _acceleration(chain: _Chain, side: int) -> Real:
    """The acceleration under what the motor does now, with the friction of a side."""
    x1, v1, _ = chain.actuator
    if chain.limit == 0:
        return formulas.acceleration_under_law(chain.robot, chain.rates, x1, v1, side)
    return formulas.acceleration_at_limit(chain.robot, chain.rates, v1, side, chain.limit)


def _choose_limit(chain: _Chain) -> None:
    """Whether the motor is at its limit: where its pull is there exactly, the way in which that changes decides."""
    x1, v1, _ = chain.actuator
    pull = chain.gains.Kp * x1 + chain.gains.Kd * v1
    chain.limit = int(np.sign(pull)) if abs(pull) > chain.largest else 0
    if abs(pull) == chain.largest and chain.side:
        rate = chain.gains.Kp * v1 + chain.gains.Kd * _acceleration(chain, chain.side)
        chain.limit = int(np.sign(pull)) if rate * pull > 0.0 else 0


def _settle(chain: _Chain) -> None:
    """An actuator at rest: held while the free acceleration is within the friction."""
    free = _acceleration(chain, 0)
    side = int(np.sign(free)) if abs(free) > chain.robot.f1 else 0
    _go(chain, side, None)


def _go(chain: _Chain, side: int, acceleration: Real | None) -> None:
    chain.side = 0 if _blocked(chain.robot, chain.actuator.x1, side) else side
    known = _acceleration(chain, chain.side) if acceleration is None else acceleration
    chain.actuator = chain.actuator._replace(acc1=known if chain.side else known * 0.0)


def _rest(chain: _Chain, kind: str) -> None:
    """The actuator has come to rest. Without dry friction its acceleration goes on as it was."""
    before, acceleration, robot = chain.side, chain.actuator.acc1, chain.robot
    stop = robot.x1_max if before > 0 else robot.x1_min
    hits = kind == "stop"
    zero = abs(acceleration) * 0.0
    chain.actuator = Actuator(stop if hits else chain.actuator.x1, zero, zero)
    if hits:
        _choose_limit(chain)
        _settle(chain)
        chain.record("x1_hits_stop")
        return
    if robot.f1 > 0.0:
        _settle(chain)
    else:
        _go(chain, int(np.sign(acceleration)), acceleration)
    chain.record("x1_sticks" if chain.side == 0 else "x1_reverses" if chain.side != before else "")


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
        chain.actuator = chain.actuator._replace(acc1=_acceleration(chain, chain.side))
    chain.record("")


def _too_low(chain: _Chain) -> bool:
    """The foot cannot come as high again as it was: the body falls, and is too low for the shortest leg."""
    shortest = chain.actuator.x1 - chain.robot.x1_min
    falls = chain.v2 < 0.0 and np.isfinite(shortest)
    return bool(not chain.airborne and falls and chain.foot + shortest < chain.highest[0])


def _trip(chain: _Chain) -> tuple[str, LegState]:
    _, chain.t, state, count = chain.highest
    del chain.phases[count:]
    return "tripped", state


def _run(chain: _Chain, max_phases: int) -> tuple[str, LegState]:
    _begin(chain)
    _remember_highest(chain, chain.look(chain.t))
    while True:
        if _too_low(chain):
            return _trip(chain)
        end = _find_end(chain, chain.horizon - chain.t)
        last = chain.look(end.t)
        state = chain.state_of(last)
        chain.t = chain.horizon if end.kind == "limit" else chain.time_of(end.t)
        if end.kind == "touchdown":
            return "touchdown", state._replace(y=abs(state.y) * 0.0)
        if end.kind == "limit":
            return ("horizon", state) if chain.airborne else _trip(chain)
        chain.actuator = Actuator(chain.within_stroke(last.actuator.moved), last.actuator.v1_t, last.actuator.acc1_t)
        if end.kind == "pull":
            chain.limit = end.limit
            chain.record("u_saturates" if end.limit else "u_desaturates")
        else:
            _rest(chain, end.kind)
        if len(chain.phases) > max_phases:
            chain.phases.pop()
            return "too_many_phases", state
        since = chain.t
        chain.foot = (
            chain.start.x1 - chain.start.y - chain.actuator.x1 + (chain.start.v2 - 0.5 * chain.fall * since) * since
        )


# ---- what users call ----


def expected_time(robot: Robot, start: LegState) -> Real:
    """The time in which a designed return settles: 50 ms before the touchdown on the ground that was left, 20 ms at
    least.
    """
    square = start.v2 * start.v2 + 2.0 * formulas.fall_of(robot) * start.x1
    fall = formulas.time_of_fall(robot, start.v2, start.x1) if square > 0.0 else 0.0
    return type(start.v2)(max(fall - SETTLED_BEFORE, SHORTEST))


def solve_flight(
    robot: Robot,
    start: LegState,
    gains: Gains | None = None,
    horizon: float = 10.0,
    max_phases: int = 4096,
    dtype: type[np.floating] = np.float64,
) -> FlightSolution:
    """Solve one flight.

    start: the state at take-off; y [m] is the height of the ground ahead over the foot. gains: of the law
    gamma2 u = Kp x1 + Kd v1, designed if left out. horizon [s]: the longest time.
    An unstable robot, or a take-off after which a damper lets the leg relax slowly, is a ValueError; no other input is
    checked here: hopform does that.
    """
    one = Robot(*(dtype(field) for field in robot))
    stable_rates_of(one)
    given = LegState(*(dtype(field) for field in start))
    rest = formulas.rest_compression(one)
    if LEG_HAS_DAMPER and formulas.contact_of(one, given._replace(y=rest)) != 0.0:
        raise ValueError(f"v1 must be v2, or the leg, in which a damper acts, relaxes: got {start.v1!r}, {start.v2!r}")
    first = given._replace(y=dtype(given.y - rest))
    largest = largest_force(one)
    law = Gains(dtype(0.0), dtype(0.0))
    if largest > 0.0:
        wanted = formulas.critical_gains(one, expected_time(one, first)) if gains is None else gains
        law = Gains(*(dtype(gain) for gain in wanted))
    zero = dtype(0.0)
    chain = _Chain(
        one, law, formulas.flight_rates_of(one, law, largest), largest, first, dtype(horizon), zero,
        Actuator(first.x1, first.v1, zero), -first.y, 0, 0, bool(first.y < 0.0), [],
    )  # fmt: skip
    ending, end = _run(chain, max_phases)
    return replace(_report(chain, ending, end), start=given, end=end._replace(y=dtype(end.y + rest)))


def _report(chain: _Chain, ending: str, end: LegState) -> FlightSolution:
    robot, start = chain.robot, chain.start
    g = chain.fall
    top = min(max(start.v2 / g, chain.t * 0.0), chain.t)
    lands = ending == "touchdown"
    return FlightSolution(
        robot, chain.gains, start, chain.t, end,
        formulas.velocity_after_impact(robot, end.v2) if lands else end.v2,
        start.x1 - start.y + (start.v2 - 0.5 * g * top) * top, top,
        -0.5 * robot.m_s * end.v2**2 * robot.impact_loss if lands else end.v2 * 0.0,
        chain.start_loss, _ENDING[ending], tuple(chain.phases),
    )  # fmt: skip


def flight_at(flight: FlightSolution, t: ArrayLike) -> LegState:
    """States at times t [s], 0 <= t <= duration, in t's shape."""
    times = flight.times(t)
    columns = np.empty((len(LegState._fields), times.size), dtype=times.dtype)
    for n, time in enumerate(times.reshape(-1)):
        columns[:, n] = _state_at(flight, time)
    return LegState(*(column.reshape(times.shape) for column in columns))


def _phase_at(flight: FlightSolution, t: Real) -> FlightPhase:
    return next(phase for phase in reversed(flight.phases) if phase.t <= t)


def _state_at(flight: FlightSolution, t: Real) -> LegState:
    phase, start, g = _phase_at(flight, t), flight.start, flight.fall
    at = _at_in_phase(flight, phase, t - phase.t)
    moved = (phase.x1 - start.x1) + at.moved
    return LegState(
        _clipped(flight.robot, phase.x1 + at.moved),
        at.v1_t,
        start.v2 - g * t,
        start.y - ((start.v2 - 0.5 * g * t) * t - moved),
    )


def _at_in_phase(flight: FlightSolution, phase: FlightPhase, t: Real) -> ActuatorAt:
    rates = formulas.flight_rates_of(flight.robot, flight.gains, largest_force(flight.robot))
    return _move(Actuator(phase.x1, phase.v1, phase.acc1), _poles(rates, phase.limit), phase.side, t)


# ---- energy ----


def _square_of_velocity(poles: Poles, phase: FlightPhase, t: Real) -> Real:
    """Integral of v_1^2 over the first t of a phase, I(2h) = I(h) + Phi(h) I(h) Phi(h)^T for z = (v, a) as in the
    stance.
    """
    if phase.side == 0:
        return t * 0.0
    fastest = float(poles.p + np.sqrt(poles.q)) * float(t)
    doublings = max(0, int(np.ceil(np.log2(fastest / 0.5)))) if fastest > 0.5 else 0
    h = t * type(t)(0.5**doublings)
    m = np.array([[t * 0.0, t * 0.0 + 1.0], [-poles.q, -poles.p]])
    z = np.array([phase.v1, phase.acc1])
    product = np.outer(z, z) * h
    total = product.copy()
    for n in range(2, 26):
        half = m @ product
        product = (half + half.T) * (h / n)
        total = total + product
    for _ in range(doublings):
        pair = _response(poles, h)
        phi = np.array([[pair.Rd + poles.p * pair.R, pair.R], [-poles.q * pair.R, pair.Rd]])
        total = total + phi @ total @ phi.T
        h = h * 2.0
    return total[0, 0]


def _ledger_in_phase(flight: FlightSolution, phase: FlightPhase, t: Real) -> Array:
    largest = largest_force(flight.robot)
    rates = formulas.flight_rates_of(flight.robot, flight.gains, largest)
    moved = _at_in_phase(flight, phase, t).moved
    squares = _square_of_velocity(_poles(rates, phase.limit), phase, t)
    rise = (flight.start.v2 - flight.fall * (phase.t + 0.5 * t)) * t
    entries = formulas.flight_ledger_of(
        flight.robot, flight.gains, largest, phase.x1, phase.side, phase.limit, Way(moved, squares, rise)
    )
    return flight.times(entries)


def flight_ledger_at(flight: FlightSolution, t: ArrayLike) -> FlightLedger:
    """The ledger from take-off to times t [s], in t's shape."""
    times = flight.times(t)
    phases, hits = flight.phases, _EVENT["x1_hits_stop"]
    lengths = [after.t - before.t for before, after in zip(phases, phases[1:], strict=False)]
    whole = [_ledger_in_phase(flight, phase, length) for phase, length in zip(phases, lengths, strict=False)]
    sums = np.cumsum([np.zeros(len(FlightWork._fields), times.dtype), *whole], axis=0)
    losses = [flight.start_loss]
    for before, after, length in zip(phases, phases[1:], lengths, strict=False):
        v1 = _at_in_phase(flight, before, length).v1_t if after.event == hits else length * 0.0
        losses.append(-0.5 * flight.robot.m_eff * v1 * v1)
    lost = np.cumsum(losses)
    starts = np.array([phase.t for phase in phases])
    index = np.searchsorted(starts, times.reshape(-1), side="right") - 1
    columns = np.empty((len(FlightWork._fields), times.size), dtype=times.dtype)
    for column, time in enumerate(times.reshape(-1)):
        n = int(index[column])
        phase = phases[n]
        columns[:, column] = sums[n] + _ledger_in_phase(flight, phase, time - phase.t)
    work = FlightWork(*(column.reshape(times.shape) for column in columns))
    return FlightLedger(**work._asdict(), stop_loss=lost[index].reshape(times.shape))


def flight_energy_at(flight: FlightSolution, t: ArrayLike) -> Energy:
    """Energies at times t [s], in t's shape."""
    state = flight_at(flight, t)
    return formulas.flight_energies(flight.robot, state.v1, state.v2, state.x1 - state.y)
