"""One flight: from take-off to the next touchdown, solved exactly, then evaluated at any time.

    x1'' = (k c - b1 v1 - gamma2 u)/m_eff - f1 sign(v1),    u = (Kp x1 + Kd v1)/gamma2 within u_max

The body is ballistic; the foot, without mass, is at its height less that of the leg without load (L0 + c where the
spring alone is in it), less x1, plus the leg's compression. That is 0, but where a damper acts in the leg, which
relaxes without load.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, SupportsFloat, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._checks import finite, nonnegative, pair, positive, shaped, shown, times_within, whole
from hopform._errors import HopformError
from hopform._flight_columns import by_names, chosen, rows_of, units_of, without_row
from hopform._motion import DOUBLE, TOUCHING_ULP, Event, Number, Real, State, Times, in_order, precision_of, with_height
from hopform._robots import Robot, checked_robot, falling_robot, placed
from hopform._sensitivities import Sensitivities, aliases_of
from hopform._show import Arrays, Card, OverTime, events_of
from hopform._solver.c import SolvedFlight
from hopform._solver.package import FLIGHT_ENDINGS, Energy, FlightLedger, Gains, records


class FlightPhase(NamedTuple):
    """A part of a flight in which the mode stays: the actuator extends (+1), retracts (-1) or is held (0)."""

    start: float
    """[s] since take-off"""
    end: float
    """[s]"""
    mode_1: int
    limit: int
    """sign of the motor's pull gamma2 u where the current is at its limit, 0 where it follows the law"""
    x1: float
    """[m] where it starts"""
    v1: float
    """[m/s]"""


@dataclass(frozen=True, repr=False, eq=False)
class Flight(OverTime):
    """A flight, solved. Times in s from take-off, heights in m over the ground ahead, which the foot meets next.

    status: "touchdown"; "tripped": the foot never got above the ground ahead, the flight ends where it came highest;
    "horizon"; "too_many_phases". duration: time of the ending. end: the state there, before the impact. touchdown: that
    after the impact, with which the stance begins, None without one. gains: of the law. apex, apex_time: highest hop
    height of the body up to the ending, and when. impact_loss, leg_loss [J]: what the impact takes, and a damper in the
    leg, which relaxes without load; negative.
    """

    robot: Robot
    dtype: np.dtype[Any]
    status: records.FlightEnding
    duration: float
    end: State
    touchdown: State | None
    gains: Gains
    apex: float
    apex_time: float
    impact_loss: float
    leg_loss: float
    _compression: float = field(repr=False)
    _given: tuple[bool, bool] = field(repr=False, compare=False)
    """whether x2 was given, and the compression"""
    _solved: SolvedFlight = field(repr=False, compare=False)

    @cached_property
    def phases(self) -> tuple[FlightPhase, ...]:
        """The phases in their order."""
        rows = self._solved.rows()
        ends = [*(row[0] for row in rows[1:]), self.duration]
        return tuple(
            FlightPhase(t, end, side, limit, x1, v1)
            for (t, x1, v1, side, limit, _), end in zip(rows, ends, strict=True)
        )

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """The events in their order: the kinds of a stance for the actuator, and u_saturates, u_desaturates."""
        words = self.robot.solver.package.records.FLIGHT_EVENTS
        return tuple(Event(t, words[event]) for t, *_, event in self._solved.rows() if event)

    @overload
    def at(self, t: Number) -> State: ...
    @overload
    def at(self, t: Times) -> State[NDArray[np.floating]]: ...
    def at(self, t: Number | Times) -> State[Any]:
        """The state at times t [s], in t's shape; 0 <= t <= duration, else ValueError. At the time of an event:
        the state behind it; at the ending: before the impact.

        >>> from hopform import load_robot
        >>> flight = solve_flight(load_robot("hopper_c"), x1=0.05, v1=0.1, v2=1.9)
        >>> print(round(float(flight.at(0.2).x2), 6), round(float(flight.at(0.2).x1), 6))
        0.6338 0.010312
        """
        state = with_height(self.robot, self.dtype, self._solved.state_at(self._times(t)))
        return type(state)(*(shaped(value, t) for value in state))

    @overload
    def foot(self, t: Number) -> float: ...
    @overload
    def foot(self, t: Times) -> NDArray[np.floating]: ...
    def foot(self, t: Number | Times) -> Real:
        """Height of the foot over the ground ahead [m] at times t [s], in t's shape."""
        return self.compression(t) - shaped(self._solved.state_at(self._times(t)).y, t)

    @overload
    def compression(self, t: Number) -> float: ...
    @overload
    def compression(self, t: Times) -> NDArray[np.floating]: ...
    def compression(self, t: Number | Times) -> Real:
        """Compression of the leg [m] at times t [s], in t's shape: a damper in the unloaded leg lets it relax."""
        times, time = self._times(t), self.robot.solver.package.formulas.leg_time(self.robot.parameters)
        return shaped(self._compression * np.exp(-times / time) if time > 0.0 else times * 0.0, t)

    @property
    def end_compression(self) -> float:
        """Compression of the leg [m] at the ending, with which the next stance begins; 0 without a damper in it."""
        touches = self.touchdown is not None
        return float(self._solved.flight.end.y if touches else self.compression(self.duration))

    @overload
    def current(self, t: Number) -> float: ...
    @overload
    def current(self, t: Times) -> NDArray[np.floating]: ...
    def current(self, t: Number | Times) -> Real:
        """The current [A] of the law at times t [s], in t's shape; 0 where the motor has no force."""
        state = self._solved.state_at(self._times(t))
        gamma2, u_max = self.robot.letters.gamma2, self.robot.letters.u_max
        if gamma2 == 0.0:
            return shaped(np.zeros_like(state.x1), t)
        return shaped(np.clip((self.gains.Kp * state.x1 + self.gains.Kd * state.v1) / gamma2, -u_max, u_max), t)

    @overload
    def energy(self, t: Number) -> Energy[float]: ...
    @overload
    def energy(self, t: Times) -> Energy[NDArray[np.floating]]: ...
    def energy(self, t: Number | Times) -> Energy[Any]:
        """Energies [J] of the body and of the robot at times t [s], in t's shape; the leg is unloaded."""
        return Energy(*in_order(t, self._times(t), lambda times: self._solved.energy_at(times)[0]))

    @overload
    def ledger(self, t: Number) -> FlightLedger[float]: ...
    @overload
    def ledger(self, t: Times) -> FlightLedger[NDArray[np.floating]]: ...
    def ledger(self, t: Number | Times) -> FlightLedger[Any]:
        """The ledger [J] from take-off to times t [s], in t's shape; each entry from its own closed form."""
        return FlightLedger(*in_order(t, self._times(t), lambda times: self._solved.energy_at(times)[1]))

    @cached_property
    def sensitivities(self) -> Sensitivities:
        """Derivatives of the duration T, the state at the ending before the impact, v2_after behind it and the apex, by
        state at take-off, height of the ground ahead, gains and robot, through every event.

        They are those of the events as they are: none appears or goes. Gains that were left out change with the start
        and the robot, given ones stay; Kp and Kd are by a change on top of either. With x2 left out it follows x1 and the
        leg's length without load, and its own column is 0; ground is that ahead, over the ground that was left. An
        actuator that is held at the start keeps its velocity 0, and one that starts on a stop stays where it starts;
        x1_min, x1_max count where a stop is met later. NaN where an event grazes, where the cap on phases was reached,
        and v2_after without touchdown.

        >>> from hopform import load_robot
        >>> flight = solve_flight(load_robot("hopper_c"), x1=0.05, v1=0.1, v2=1.9)
        >>> print(round(flight.sensitivities["T", "ground"], 6), round(flight.sensitivities["x1", "Kp"], 9))
        -0.470474 -6.43e-07
        """
        solver, parameters = self.robot.solver, self.robot.parameters
        columns = chosen(solver, True, *self._given, parameters)
        start = self._solved.flight.start
        solved = self._solved.sensitivities(columns.codes)
        matrix = by_names(columns, solved, (start.x1, start.v1, start.v2), solver, parameters)
        rows = tuple(rows_of(solver).values())
        if self.touchdown is None:
            matrix = without_row(matrix, rows.index("v2_after"))
        return Sensitivities(rows, columns.names, matrix, units_of(solver), aliases_of(solver))

    def _card(self) -> Card:
        start = self.at(0.0)
        gains = f"{self.gains.Kp:.5g} N/m, {self.gains.Kd:.5g} N s/m"
        given = [("x1", start.x1), ("v1", start.v1), ("x2", start.x2), ("v2", start.v2), ("gains", gains)]
        after = [] if self.touchdown is None else [("touchdown at v2", self.touchdown.v2), ("x1", self.touchdown.x1)]
        rows = [("apex", self.apex), ("apex_time", self.apex_time), *after, ("events", len(self.events))]
        return Card(f"Flight of {self.robot.label}: {self.status} after {self.duration:.5g} s", given, rows)

    def _over(self, t: NDArray[np.float64]) -> dict[str, Any]:
        energy = self.energy(t)
        motion = {**self.at(t)._asdict(), "foot": self.foot(t), "u": self.current(t)}
        return motion | {"body_energy": energy.body, "total_energy": energy.total}

    def _arrays(self) -> Arrays:
        names = ("status", "duration", "apex", "apex_time", "impact_loss", "leg_loss")
        return events_of(self.events) | {name: ((), getattr(self, name)) for name in names}

    def _times(self, t: ArrayLike) -> NDArray[np.floating]:
        return times_within(t, self.dtype, self.duration)


def solve_flight(
    robot: Robot,
    *,
    v2: SupportsFloat,
    x1: SupportsFloat = 0.0,
    v1: SupportsFloat = 0.0,
    x2: SupportsFloat | None = None,
    step: SupportsFloat | None = None,
    compression: SupportsFloat | None = None,
    gains: Sequence[SupportsFloat] | None = None,
    horizon: SupportsFloat = 10.0,
    max_phases: int = 4096,
    dtype: Any = np.float64,
) -> Flight:
    """The flight that follows from a state at take-off, exactly: the return of the actuator, every event, the
    touchdown.

    x1, v1, v2 [m, m/s]: actuator and body at take-off; x2 [m]: height of the body over the ground *ahead*, over which
    the foot lands: x1 + L0 + c - compression if left out (flat ground), less by a step up; step [m],
    in place of x2: how much higher the ground ahead is than that which the foot leaves. compression [m]: of the leg
    at take-off, from which it relaxes where a damper acts in it; if left out that of the unloaded leg, 0
    without a damper. gains
    (Kp, Kd) [N/m, N s/m], both >= 0: of the law gamma2 u = Kp x1 + Kd v1 within u_max; if left out those of
    `design_return`, settled 50 ms before the touchdown on the ground that was left, in 20 ms at least. horizon [s]:
    longest time. Raises HopformError for a value that is not allowed, g = 0 among them.

    >>> from hopform import load_robot
    >>> flight = solve_flight(load_robot("hopper_c"), x1=0.05, v1=0.1, v2=1.9)
    >>> flight.status, round(flight.duration, 4), [event.kind for event in flight.events]
    ('touchdown', 0.4109, ['x1_reverses', 'u_desaturates'])
    """
    precision = DOUBLE if dtype is np.float64 else precision_of(dtype)
    falling_robot(robot, "flight", "a flight")
    start, ground = _start(robot, x1, v1, x2, v2, step, compression)
    law = None if gains is None else _gains(gains)
    longest = positive("horizon", horizon, "s")
    most = whole("max_phases", max_phases)
    solved = robot.solver.compiled().solve_flight(robot.parameters, start, ground, law, longest, most, precision)
    flight = solved.flight
    status = FLIGHT_ENDINGS[flight.ending]
    reached_at = with_height(robot, precision, flight.end)
    end = type(reached_at)(*map(float, reached_at))
    after = end._replace(v2=float(flight.v2_after)) if status == "touchdown" else None
    duration, followed = float(flight.duration), Gains(float(flight.gains.Kp), float(flight.gains.Kd))
    apex, losses = (float(flight.apex), float(flight.apex_time)), (float(flight.impact_loss), float(flight.leg_loss))
    reached = status, duration, end, after, followed, *apex, *losses, start.y, (x2 is not None, compression is not None)
    return Flight(robot, precision, *reached, solved)


def design_return(robot: Robot, time: SupportsFloat) -> Gains:
    """Gains (Kp, Kd) with which the actuator returns gently in a time [s]: critically damped, within 1/100 of its way
    from rest.

    The friction b1 is part of the damping; where it is more than critical Kd is 0 and Kp puts the slower pole where
    both were. Dry friction may leave it as far from 0 as f1 m_eff/Kp, and a motor at its limit takes longer. Raises
    HopformError unless time > 0.

    >>> from hopform import load_robot
    >>> print(*(round(gain, 3) for gain in design_return(load_robot("hopper_c"), 0.3)))
    12345.679 961.111
    """
    parameters, span = checked_robot(robot, "flight").parameters, positive("time", time, "s")
    with np.errstate(all="ignore"):
        gains = robot.solver.package.formulas.critical_gains(parameters, span)
    if not all(math.isfinite(gain) for gain in gains):
        raise HopformError(f"time must be long enough for finite gains, got {span!r} s")
    return Gains(*map(float, gains))


def _start(
    robot: Robot, x1: object, v1: object, x2: object, v2: object, step: object, compression: object
) -> tuple[records.LegState, float]:
    """The state at take-off, and how far the ground ahead is above that which is left, 0 where neither says it."""
    x_1, v_1, v_2 = placed(robot, "flight", x1, v1, v2)
    released = robot.solver.package.formulas.compression_at_takeoff
    y = float(released(robot.parameters, v_1, v_2)) if compression is None else finite("compression", compression, "m")
    L0, c = robot.letters.L0, robot.letters.c
    if step is not None:
        if x2 is not None:
            raise HopformError(f"give either x2 or step, got x2 = {shown(x2)} and step = {shown(step)}")
        return records.LegState(x_1, v_1, v_2, y), finite("step", step, "m")
    ground = 0.0 if x2 is None else x_1 - finite("x2", x2, "m") + L0 + c - robot.compression_at_rest - y
    return records.LegState(x_1, v_1, v_2, y), 0.0 if abs(ground) <= TOUCHING_ULP * math.ulp(L0) else ground


def _gains(gains: Sequence[SupportsFloat]) -> Gains:
    return Gains(*map(nonnegative, Gains._fields, pair("gains", gains, "(Kp, Kd) in N/m and N s/m"), ("N/m", "N s/m")))
