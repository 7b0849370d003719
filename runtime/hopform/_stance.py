"""One stance: from touchdown to take-off, solved exactly, then evaluated at any time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from inspect import getattr_static
from types import MappingProxyType
from typing import Any, ClassVar, SupportsFloat, overload

import numpy as np
from numpy.typing import NDArray

import hopform._checks as checks
from hopform._checks import finite, items, pair, positive, shaped, shown, whole
from hopform._errors import HopformError
from hopform._flight import Flight, solve_flight
from hopform._motion import (
    DOUBLE,
    TOUCHING_ULP,
    WORDS_OF_ENDINGS,
    Layout,
    Motion,
    Number,
    Real,
    Start,
    State,
    Times,
    body_height,
    compression_of,
    events_in_short,
    free_start,
    input_unit,
    layout_of,
    named_start,
    precision_of,
    shown_of,
    state_of_leg,
    with_height,
)
from hopform._robots import Robot, checked_robot, placed
from hopform._sensitivities import Sensitivities, of_stance
from hopform._show import Card, Curve, OverTime
from hopform._solver.c import Solved, tuple_of
from hopform._solver.package import ENDINGS, TAKEOFF, Precision, Steps, records
from hopform._warnings import WARNINGS, Warning

Current = SupportsFloat | Sequence[tuple[SupportsFloat, SupportsFloat]]

LAYOUT = Layout(State, State._fields, State._fields, ("m", "m/s", "m", "m/s"))
"""How the states of a stance are shown."""


@dataclass(frozen=True, repr=False, eq=False)
class Stance(Motion):
    """A stance, solved: a motion with a contact. Times in s from touchdown, heights in m over the ground under the foot.

    status: "takeoff", "rest", "horizon", "too_many_phases", or "uncertified", where the search met its bound.
    duration: time of the ending. takeoff: the state there, None without take-off. end: the state at the ending. apex:
    hop height of the apex, NaN without take-off. aed: change of the body's energy over the stance (24).
    """

    end: State
    takeoff: State | None
    apex: float
    aed: float
    _said_of: ClassVar[tuple[Warning, ...]] = WARNINGS

    @property
    def _layout(self) -> Layout:
        return LAYOUT._replace(state=state_of_leg(self.robot.solver))

    @cached_property
    def compression_max(self) -> float:
        """The largest compression of the leg [m], from the closed form.

        >>> from hopform import load_robot
        >>> print(round(solve_stance(load_robot("hopper_c"), v2=-1.93).compression_max, 6))
        0.114321
        """
        return self._solved.compression_max()

    def _reading(self, name: str) -> Any:
        start, robot = self._solved.phase_rows()[0][1], self.robot
        readings: dict[str, Callable[[], Any]] = {
            **{name: partial(getattr, start, name) for name in start._fields},
            "force": lambda: -robot.letters.gamma2 * super(Stance, self)._reading("u"),
            "spring": lambda: self.compression_max + robot.compression_at_rest,
            "lowest": self._lowest,
            "takes_off": lambda: float(self.status == "takeoff"),
        }
        if name in readings:
            return readings[name]()
        letters = {**robot.letters._asdict(), "travel": robot.travel}
        return super()._reading(name) if name in ("stiff", "u", "u_largest", "u_size") else letters[name]

    def _lowest(self) -> float:
        """The lowest height of the body."""
        return min(float(state.x2) for state in (*(phase.state for phase in self.phases), self.end))

    @overload
    def at(self, t: Number) -> State: ...
    @overload
    def at(self, t: Times) -> State[NDArray[np.floating]]: ...
    def at(self, t: Number | Times) -> State[Any]:
        """The state at times t [s], in t's shape, t as for `Motion.at`.

        >>> from hopform import load_robot
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0)
        >>> print(round(float(stance.at(0.05).x2), 6))
        0.312109
        """
        if type(t) is float and self.dtype is DOUBLE and 0.0 <= t <= self.duration:
            return with_height(self.robot, self.dtype, self._solved.state(t))
        state = state_of_leg(self.robot.solver)
        return state(*(shaped(value, t) for value in with_height(self.robot, self.dtype, self._solver_state(t))))

    def grid(
        self, count: int | None = None, *, dt: SupportsFloat | None = None, out: Sequence[Any] | None = None
    ) -> tuple[NDArray[np.floating], State[NDArray[np.floating]]]:
        """Times from 0 to the ending and the states there: `count` of them, or one every dt [s]; as `Motion.grid`."""
        return super().grid(count, dt=dt, out=out)

    def fly(
        self, step: SupportsFloat = 0.0, *, gains: Sequence[SupportsFloat] | None = None, horizon: SupportsFloat = 10.0
    ) -> Flight:
        """The flight that follows, to the next touchdown, on ground that is `step` [m] higher; as `solve_flight`.

        Raises HopformError for a stance without take-off.

        >>> from hopform import load_robot
        >>> flight = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0).fly()
        >>> flight.status, round(flight.duration, 4)
        ('touchdown', 0.3313)
        """
        if self.takeoff is None:
            raise HopformError(f"a flight needs a take-off, but the stance ended by {self.status!r}")
        x1, v1, _, v2 = map(float, self.takeoff)
        how: dict[str, Any] = {"gains": gains, "horizon": horizon, "dtype": self.dtype}
        return solve_flight(self.robot, x1=x1, v1=v1, v2=v2, step=step, compression=self.end_compression, **how)

    @property
    def outcome(self) -> str:
        """How it ended, in words, and the apex that follows a take-off.

        >>> from hopform import load_robot
        >>> solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0).outcome
        'takes off after 184.08 ms, apex 0.1398 m'
        """
        words = super().outcome
        return words if math.isnan(self.apex) else f"{words}, apex {self.apex:.4g} {self._unit('apex')}"

    _endings = WORDS_OF_ENDINGS | {"horizon": "is still on the ground after"}
    _figures = MappingProxyType({"apex": "apex", "aed": "AED", "compression_max": "largest compression"})
    beginning = "touchdown"

    def aed_at(self, t: Number | Times) -> Real:
        """The AED (24) [J], the change of the body's energy since touchdown, at times t [s], in t's shape: the sum of
        the body's entries of its ledger.

        >>> from hopform import load_robot
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0)
        >>> round(stance.aed_at(stance.duration), 6) == round(stance.aed, 6)
        True
        """
        entries = self.ledger(t)
        names = self.robot.solver.package.records.LEDGER_OF_BODY
        return shaped(sum((getattr(entries, name) for name in names), np.zeros(np.shape(t), self.dtype)), t)

    @overload
    def compression(self, t: Number) -> float: ...
    @overload
    def compression(self, t: Times) -> NDArray[np.floating]: ...
    def compression(self, t: Number | Times) -> Real:
        """Compression of the leg [m] at times t [s], from its free length, to its own last digit:
        x1 - x2 + L0 + c where the spring alone is in it.
        """
        return shaped(self._solver_state(t).y, t)

    @overload
    def contact_force(self, t: Number) -> float: ...
    @overload
    def contact_force(self, t: Times) -> NDArray[np.floating]: ...
    def contact_force(self, t: Number | Times) -> Real:
        """Contact force N [N] at times t [s], in t's shape: the force in the leg, k times the compression of a spring.

        >>> from hopform import load_robot
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0)
        >>> print(round(float(stance.contact_force(0.05)), 3))
        109.312
        """
        force = self.robot.solver.package.formulas.contact_force(self.robot.parameters, self._solver_state(t))
        return shaped(force, t)

    @overload
    def energy(self, t: Number) -> records.Energy[float]: ...
    @overload
    def energy(self, t: Times) -> records.Energy[NDArray[np.floating]]: ...
    def energy(self, t: Number | Times) -> records.Energy[Any]:
        """Energies [J] of the body, with the spring as in (23), and of the robot at times t [s], in t's shape; t as for
        `at`.
        """
        return records.Energy(*(shaped(value, t) for value in self._solved.energy_at(self._times(t))))

    @property
    def sensitivities(self) -> Sensitivities:
        """Derivatives of the duration T, the state at the ending, apex and AED by initial state, current and robot,
        through every event.

        They are those of the events as they are: none appears or goes. At take-off T moves with the contact force, at
        rest with the event that stops the last mass; at the horizon it stays. With x2 left out it follows x1 and the leg's
        length without load, L0 + c, and its own column is 0. A mass that is held at the start keeps its velocity 0. An
        actuator that starts on a stop and is held there stays where it starts (column x1); x1_min, x1_max count where a
        stop is met later. With a list of steps u moves all currents alike. NaN where an event grazes, where a rest
        ends at a small change, and where the search has ended; the apex' row without take-off or gravity.

        >>> from hopform import load_robot
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=3.0)
        >>> print(round(stance.sensitivities["apex", "u"], 6))
        0.089756
        """
        return self._derived(of_stance)

    def sensitivities_by(self, names: str | Sequence[str]) -> Sensitivities:
        """Some columns of the same, which alone are computed; names as for `Motion.sensitivities_by`.

        >>> from hopform import load_robot
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=3.0)
        >>> by = stance.sensitivities_by("u")
        >>> by.matrix.shape, round(by["apex", "u"], 6)
        ((7, 1), 0.089756)
        """
        return self._derived(of_stance, self._columns(names, "names"))

    def _card(self) -> Card:
        first, u = self.phases[0].state, [each for _, each in self.u]
        steps = u[0] if len(u) == 1 else f"{len(u)} steps"
        given = [("v2", first.v2), ("x1", first.x1), ("v1", first.v1), ("u", steps)]
        found = [("apex", self.apex), ("aed", self.aed), ("events", events_in_short(self.events))]
        title = f"Stance of {self.robot.label}: {self.status} after {self.duration:.5g} s"
        return Card(title, given, [*found, *(("warning", each) for each in self.warnings)])

    def _over(self, t: NDArray[np.float64]) -> dict[str, Any]:
        energy = self.energy(t)
        motion = {**self.at(t)._asdict(), "compression": self.compression(t), "contact_force": self.contact_force(t)}
        return motion | {"u": self.current(t), "body_energy": energy.body, "total_energy": energy.total}

    def _curve(self) -> Curve:
        return OverTime._curve(self)

    @property
    def end_compression(self) -> float:
        """Compression of the leg [m] at the ending; 0 exactly at a take-off of a leg without a damper."""
        return float(self._solved.outcome()[2].y)


def solve_stance(
    robot: Robot,
    *,
    v2: SupportsFloat,
    x1: SupportsFloat = 0.0,
    v1: SupportsFloat = 0.0,
    x2: SupportsFloat | None = None,
    compression: SupportsFloat | None = None,
    u: Current = 0.0,
    horizon: SupportsFloat = 2.0,
    max_phases: int = 4096,
    dtype: Any = np.float64,
) -> Stance:
    """The stance that follows from a state at touchdown, by (3), (4), exactly: every mode, every event, every ending.

    v1, v2 [m/s]: velocities after the impact; x1 [m]; x2 [m]: height of the body, or in its place compression [m] of
    the leg, as a flight has left it; that is 0 if both are left out. u [A]: a current, or steps [(t, u), ...] from
    t = 0 on. horizon [s]: longest time. dtype: float64 or
    float32. Raises HopformError (a ValueError) for a value that is not allowed.

    >>> from hopform import load_robot
    >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0)
    >>> stance.status, round(stance.duration, 4), [event.kind for event in stance.events]
    ('takeoff', 0.1841, ['x2_reverses'])
    """
    start = start_of(robot, x1, v1, x2, v2, compression)
    solved: Stance = _solve(Stance, robot, start, x2 is not None, u, horizon, max_phases, dtype)
    return solved


def solve_motion(
    robot: Robot,
    *,
    start: Start = None,
    u: Current = 0.0,
    horizon: SupportsFloat = 2.0,
    max_phases: int = 4096,
    dtype: Any = np.float64,
) -> Motion:
    """The motion of any model from a state, exactly: a joint, a cart, a valve, and a hopper, of which it is a `Stance`.

    start: coordinates and velocities by the names of the model's file, in its units; what is left out is 0. Of a leg
    that stands, either the height of the body or its compression y, which is 0 if both are left out; where nothing
    stands a spring pulls as well as it pushes, and the motion ends by rest or horizon. u: the input, a number or steps
    [(t, u), ...] from t = 0 on. horizon [s]: longest time. The others as for `solve_stance`. Raises HopformError (a
    ValueError), which names coordinate, value and what is allowed.

    >>> from hopform import load_robot
    >>> motion = solve_motion(load_robot("hopper_c"), start={"y": 0.02})
    >>> motion.status, round(motion.duration, 4)
    ('rest', 0.1572)
    """
    facts = checked_robot(robot).solver.facts
    stands, given = "stance" in facts.can, named_start(robot, start)
    x1, v1, v2 = (given.get(axis, 0.0) for axis in ("x1", "v1", "v2"))
    begin = (start_of if stands else free_start)(robot, x1, v1, given.get("x2"), v2, given.get("y"), "motion")
    x2_is_given = "x2" in given or not (stands or "y" in given)
    if not facts.inputs and any(each for _, each in steps_of(robot, u)):
        raise HopformError(f"u must be 0: the model {facts.name} has no input, got {shown(u)}")
    solved: Motion = _solve(Stance if stands else Motion, robot, begin, x2_is_given, u, horizon, max_phases, dtype)
    return solved


def _solve(
    kind: type[Motion], robot: Robot, start: records.LegState, x2_is_given: bool, u: Current, horizon: SupportsFloat,
    max_phases: int, dtype: Any,
) -> Any:  # fmt: skip
    """What follows from a state, a `Stance` of a model with a contact, else a `Motion`."""
    precision = DOUBLE if dtype is np.float64 else precision_of(dtype)
    steps = steps_of(robot, u)
    longest = horizon if type(horizon) is float and 0.0 < horizon < math.inf else positive("horizon", horizon, "s")
    quick = type(max_phases) is int and 0 < max_phases <= checks.LARGEST
    most = max_phases if quick else whole("max_phases", max_phases)
    solved = robot.solver.compiled().solve_stance(robot.parameters, start, steps, longest, most, precision)
    return _made(kind, robot, steps, precision, solved, x2_is_given, (start, longest, most))


def touchdown_velocity(robot: Robot, height: SupportsFloat) -> float:
    """Velocity of the body [m/s] after the impact of a drop from rest at a hop height [m], x1 = 0; negative.

    >>> from hopform import load_robot
    >>> round(touchdown_velocity(load_robot("hopper_c"), 0.2), 4)
    -1.9308
    """
    drop = checks.nonnegative("height", height, "m")
    return float(checked_robot(robot, "flight").solver.package.formulas.touchdown_velocity(robot.parameters, drop))


def _made(
    kind: type[Motion], robot: Robot, u: Steps, dtype: Precision, solved: Solved, given: bool, asked: Any
) -> Motion:
    """A stance or another motion with its ending, made without the slow __init__ of a frozen dataclass."""
    ending, duration, (x1, v1, v2, y), *rises = solved.outcome()
    status, lifts = ENDINGS[ending], ending == TAKEOFF
    solver = robot.solver
    made: Motion = object.__new__(kind)
    held: dict[str, Any] = {
        "robot": robot, "u": u, "dtype": dtype, "status": status, "duration": duration,
        "_solved": solved, "_x2_is_given": given, "_asked": asked,
    }  # fmt: skip
    if kind is Stance:
        height: Any = solver.package.formulas.second_position if dtype is DOUBLE else partial(_height, robot, dtype)
        end = tuple_of(state_of_leg(solver), (x1, v1, float(height(robot.parameters, x1, y)), v2))
        apex, aed = rises
        apex = apex if lifts and robot.fall > 0.0 else math.nan
        held |= {"end": end, "takeoff": end if lifts else None, "apex": apex, "aed": aed}
    else:
        layout = layout_of(solver)
        held["end"] = layout.state(*map(float, shown_of(robot, dtype, layout, records.LegState(x1, v1, v2, y))))
    object.__setattr__(made, "__dict__", held)
    return made


def _height(robot: Robot, dtype: Precision, parameters: Any, x1: float, y: float) -> Any:
    return body_height(robot, dtype, x1, y)


def start_of(
    robot: Robot, x1: Any, v1: Any, x2: object, v2: Any, compression: object = None, act: str = "stance"
) -> records.LegState:
    """The state at touchdown with the compression as a coordinate of its own; 0 where it and x2 are left out."""
    x_1, v_1, v_2 = placed(robot, act, x1, v1, v2)
    if x2 is None and compression is None:
        start: records.LegState = tuple_of(records.LegState, (x_1, v_1, v_2, 0.0))
        return start
    if x2 is not None and compression is not None:
        raise HopformError(
            f"give either x2 or compression, got x2 = {shown(x2)} and compression = {shown(compression)}"
        )
    height = None if x2 is None else finite("x2", x2, "m")
    rest = robot.compression_at_rest
    L0, c = robot.letters.L0, robot.letters.c
    y = finite("compression", compression, "m") if height is None else float(compression_of(robot, x_1, height))
    if abs(y) <= TOUCHING_ULP * math.ulp(L0):
        y = 0.0
    if y < 0.0:
        highest = f"x1 + L0 + c{' - rest' if rest else ''} = {x_1 + L0 + c - rest!r} m"
        what = "compression must be >= 0 m" if height is None else f"x2 must be <= {highest}"
        raise HopformError(f"{what} (a contact cannot pull), got {y if height is None else height!r}")
    return records.LegState(x_1, v_1, v_2, y)


def steps_of(robot: Robot, u: Current) -> Steps:
    """The input of a robot's model, or steps of it, as steps (t, u) [s, its unit] that begin at 0; HopformError for what
    is neither.
    """
    if type(u) is float and math.isfinite(u):  # the common case, before a protocol is asked
        return ((0.0, u),)
    unit = input_unit(robot.solver)
    if checks.is_one(u):
        return ((0.0, finite("u", u, unit)),)
    allowed = f"a number in {unit} or steps (t, u)"
    if callable(u) or getattr_static(u, "law", None):
        law = "; simulate takes a law from a controller, as controllers.Sampled(period, law)"
        raise HopformError(f"u must be {allowed}{law if 'hop' in robot.solver.can else ''}, got {shown(u)}")
    steps: list[tuple[float, float]] = []
    for number, step in enumerate(items("u", u, allowed, records.MOST_STEPS)):
        t, value = pair(f"u[{number}]", step, "(t, u)")
        steps.append((finite(f"u[{number}] time", t, "s"), finite(f"u[{number}] input", value, unit)))
    if not steps:
        raise HopformError(f"u must be {allowed}, at least one, got no step")
    if steps[0][0] != 0.0:
        raise HopformError(f"u must start at t = 0 s, got {steps[0][0]!r}")
    for (before, _), (after, _) in zip(steps, steps[1:], strict=False):
        if not after > before:
            raise HopformError(f"the times of u must increase, got {after!r} s after {before!r} s")
    return tuple(steps)
