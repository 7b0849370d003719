"""One stance: from touchdown to take-off, solved exactly, then evaluated at any time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from importlib import import_module
from inspect import getattr_static
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, SupportsFloat, TypeAlias, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

import hopform._checks as checks
from hopform._checks import finite, items, pair, positive, shaped, shown, times_within, whole
from hopform._errors import HopformError
from hopform._robots import Robot, checked_robot
from hopform._sensitivities import Sensitivities, of_matrix
from hopform._show import Arrays, Card, Motion, events_of, name_of
from hopform._solver.c import tuple_of
from hopform._solver.choice import SolvedStance
from hopform._solver.library import Backend
from hopform._solver.package import ENDINGS, EVENTS, TAKEOFF, AnyEvent, Precision, Steps, records
from hopform._warnings import WARNINGS, said

if TYPE_CHECKING:
    from typing_extensions import TypeVar

    from hopform._flight import Flight

    Value = TypeVar("Value", default=float)
else:
    from typing import TypeVar

    Value = TypeVar("Value")

Real: TypeAlias = Any
"""A float, or an array that broadcasts: what is read at one time needs no check of its type."""
Number: TypeAlias = float | np.number[Any]
"""One time."""
Times: TypeAlias = NDArray[Any] | Sequence[Any]
"""Times of an array, or of what becomes one."""
Current = SupportsFloat | Sequence[tuple[SupportsFloat, SupportsFloat]]

TOUCHING_ULP = 4.0
EACH = 128  # [B] a time of a grid
DOUBLE = np.dtype(np.float64)
_SPELT: dict[Any, Precision] = {
    **dict.fromkeys(("float64", "double", "f8", "d", "float", float, np.float64, DOUBLE), DOUBLE),
    **dict.fromkeys(("float32", "single", "f4", "f", np.float32, np.dtype(np.float32)), np.dtype(np.float32)),
}
"""The precisions, as people may write them."""


class State(NamedTuple, Generic[Value]):
    """The hopper at one instant, with a float in each entry; at the times of an array, with an array in each, it is a
    State[NDArray[np.floating]].
    """

    x1: Value
    """[m] displacement of the actuator"""
    v1: Value
    """[m/s] its velocity"""
    x2: Value
    """[m] height of the body over the ground under the foot"""
    v2: Value
    """[m/s] its velocity"""


class Event(NamedTuple):
    """Something that happened during a stance; kinds are those of docs/reference/model.md."""

    time: float
    """[s] since touchdown, in a flight since take-off"""
    kind: AnyEvent


class Phase(NamedTuple):
    """A part of a stance in which the mode stays: mode_1 is +1 where the actuator extends, -1 where it retracts, mode_2
    +1 where the body slips up, -1 where it slips down; 0 is held."""

    start: float
    """[s] since touchdown"""
    end: float
    """[s]"""
    mode_1: int
    mode_2: int
    u: float
    """[A]"""
    state: State
    """where it starts"""


@dataclass(frozen=True, repr=False, eq=False)
class Stance(Motion):
    """A stance, solved. Times in s from touchdown, heights in m over the ground under the foot.

    status: "takeoff", "rest", "horizon", "too_many_phases", or "uncertified", where the search met its bound.
    duration: time of the ending. takeoff: the state there, None without take-off. end: the state at the ending. apex:
    hop height of the apex, NaN without take-off. aed: change of the body's energy over the stance (24).
    """

    robot: Robot
    u: Steps
    backend: Backend
    dtype: np.dtype[Any]
    status: records.Ending
    duration: float
    end: State
    takeoff: State | None
    apex: float
    aed: float
    _solved: SolvedStance = field(repr=False, compare=False)
    _x2_is_given: bool = field(repr=False, compare=False)
    _asked: tuple[records.LegState, float, int] = field(repr=False, compare=False)
    """start, horizon and bound on phases"""

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """The events in their order."""
        return tuple(Event(t, EVENTS[event]) for t, _, _, event, _ in self._solved.phase_rows() if event)

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """The phases in their order."""
        rows = self._solved.phase_rows()
        ends = [*(row[0] for row in rows[1:]), self.duration]
        states = [State(*map(float, with_height(self.robot, self.dtype, row[1]))) for row in rows]
        return tuple(
            Phase(t, end, mode // 3 - 1, mode % 3 - 1, self.u[step][1], state)
            for (t, _, mode, _, step), end, state in zip(rows, ends, states, strict=True)
        )

    @cached_property
    def compression_max(self) -> float:
        """The largest compression of the leg [m], from the closed form.

        >>> from hopform import load_robot
        >>> print(round(solve_stance(load_robot("hopper_c"), v2=-1.93).compression_max, 6))
        0.114321
        """
        return self._solved.compression_max()

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What the model does not say of a real robot: a current above u_max, a spring beyond its travel, and so on."""
        start, robot = self._solved.phase_rows()[0][1], self.robot
        flows = [u for t, u in self.u if t < self.duration or t == 0.0]  # a step behind the ending does not
        readings: dict[str, Callable[[], Any]] = {
            **{name: partial(getattr, start, name) for name in start._fields},
            "u": lambda: flows[0],
            "force": lambda: -robot.gamma2 * flows[0],
            "u_largest": lambda: max(flows, key=abs),
            "u_size": lambda: max(map(abs, flows)),
            "spring": lambda: self.compression_max + rest_of(robot),
            "lowest": self._lowest,
            "takes_off": lambda: float(self.status == "takeoff"),
            "stiff": lambda: float(
                records.STATUSES.get(self._solved.plan_status(robot.parameters)) == "ill_conditioned"
            ),
        }
        return tuple(said(WARNINGS, lambda name: readings[name]() if name in readings else getattr(robot, name)))

    def _lowest(self) -> float:
        """The lowest height of the body; inf where no ground is below it."""
        stands = "stance" in self.robot.solver.can
        return (
            min(float(state.x2) for state in (*(phase.state for phase in self.phases), self.end))
            if stands
            else math.inf
        )

    @overload
    def at(self, t: Number) -> State: ...
    @overload
    def at(self, t: Times) -> State[NDArray[np.floating]]: ...
    def at(self, t: Number | Times) -> State[Any]:
        """The state at times t [s], in t's shape; 0 <= t <= duration, any t >= 0 after rest, else ValueError. At the
        time of an event: the state behind it, which a stop has left without velocity. So is all that is read at a time.

        >>> from hopform import load_robot
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0)
        >>> print(round(float(stance.at(0.05).x2), 6))
        0.312109
        """
        if type(t) is float and self.dtype is DOUBLE and 0.0 <= t <= self.duration:
            return with_height(self.robot, self.dtype, self._solved.state(t))
        return State(*(shaped(value, t) for value in with_height(self.robot, self.dtype, self._solver_state(t))))

    def grid(
        self, count: int | None = None, *, dt: SupportsFloat | None = None, out: Sequence[Any] | None = None
    ) -> tuple[NDArray[np.floating], State[NDArray[np.floating]]]:
        """Times from 0 to the ending and the states there: `count` of them, or one every dt [s]; faster than `at`.

        out: four arrays of one dimension, of the stance's dtype, that take the states. Raises HopformError if not
        exactly one of count >= 1 and dt > 0 is given, or if out does not fit.

        >>> from hopform import load_robot
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0)
        >>> t, state = stance.grid(1001)
        >>> float(t[-1]) == stance.duration, round(float(state.x2[500]), 6) == round(float(stance.at(t[500]).x2), 6)
        (True, True)
        """
        t, step = uniform_times(self.duration, count, dt, self.dtype)
        into = list(np.empty((4, t.size), self.dtype)) if out is None else fitting(out, t)
        x1, v1, x2, v2 = whole = [np.ascontiguousarray(column) for column in into]
        if self.duration > 0.0:
            self._solved.grid(step, records.LegState(x1, v1, v2, x2))
        else:
            for column, values in zip((x1, v1, v2, x2), self._solver_state(t), strict=True):
                column[...] = values
        x2[...] = body_height(self.robot, self.dtype, x1, x2)
        for column, values in zip(into, whole, strict=True):
            column[...] = values  # itself where it is in one piece
        return t, State(*into)

    def current(self, t: ArrayLike) -> Real:
        """The current [A] at times t [s], in t's shape; from the time of a step on that of the step."""
        starts, currents = np.array(self.u).T
        return shaped(currents[np.searchsorted(starts, self._times(t), side="right") - 1], t)

    def fly(
        self, step: SupportsFloat = 0.0, *, gains: Sequence[SupportsFloat] | None = None, horizon: SupportsFloat = 10.0
    ) -> "Flight":
        """The flight that follows, to the next touchdown, on ground that is `step` [m] higher; as `solve_flight`.

        Raises HopformError for a stance without take-off.

        >>> from hopform import load_robot
        >>> flight = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0).fly()
        >>> flight.status, round(flight.duration, 4)
        ('touchdown', 0.3313)
        """
        if self.takeoff is None:
            raise HopformError(f"a flight needs a take-off, but the stance has the ending {self.status!r}")
        rise = finite("step", step, "m")
        x1, v1, x2, v2 = map(float, self.takeoff)
        solve: Callable[..., Flight] = import_module("hopform._flight").solve_flight
        how = {"gains": gains, "horizon": horizon, "backend": self.backend, "dtype": self.dtype}
        leg = self.end_compression
        return solve(self.robot, x1=x1, v1=v1, v2=v2, x2=x2 - rise if rise else None, compression=leg, **how)

    def explain(self) -> str:
        """How it was solved, phase by phase: poles, event functions at the start and the end, and which rule of the
        certificate says in which interval that none has an earlier zero. docs/explanation/stance.md reads one.

        The printed engine solves the stance again, to the same bits, and says which rules it used.

        >>> from hopform import load_robot
        >>> print(solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0).explain().splitlines()[0])
        hopper_c, u = 2 A; takes off after 184.08 ms, apex 13.98 cm
        """
        text: Callable[..., str] = import_module("hopform._explain").text_of
        return text(self, self._asked)

    def compression(self, t: ArrayLike) -> Real:
        """Compression of the leg [m] at times t [s], from where it carries nothing, to its own last digit:
        x1 - x2 + L0 + c where the spring alone is in it.
        """
        return shaped(self._solver_state(t).y, t)

    def contact_force(self, t: ArrayLike) -> Real:
        """Contact force N [N] at times t [s], in t's shape: what the leg carries, k times the compression of a spring.

        >>> from hopform import load_robot
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0)
        >>> print(round(float(stance.contact_force(0.05)), 3))
        109.312
        """
        force = self.robot.solver.package.formulas.contact_force(self.robot.parameters, self._solver_state(t))
        return shaped(force, t)

    def energy(self, t: ArrayLike) -> records.Energy:
        """Energies [J] of the body, with the spring as in (23), and of the robot at times t [s], in t's shape; t as for
        `at`.
        """
        return records.Energy(*(shaped(value, t) for value in self._solved.energy_at(self._times(t))))

    def ledger(self, t: ArrayLike) -> records.Ledger:
        """The ledger [J] from touchdown to times t [s], in t's shape; each entry from its own closed form, t as for
        `at`.
        """
        entries = in_order(t, self._times(t), self._solved.ledger_at)
        return cast("records.Ledger", self.robot.solver.package.records.Ledger(*entries))

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
        solver, solved = self.robot.solver, self._solved.sensitivities()
        return of_matrix(Sensitivities, solved, self._x2_is_given, solver, self.robot.parameters)

    def _card(self) -> Card:
        first, u = self.phases[0].state, [each for _, each in self.u]
        steps = u[0] if len(u) == 1 else f"{len(u)} steps"
        given = [("v2", first.v2), ("x1", first.x1), ("v1", first.v1), ("u", steps)]
        events = ", ".join(f"{event.kind} {event.time:.4g} s" for event in self.events[:3])
        more = f", {len(self.events) - 3} more" if len(self.events) > 3 else ""
        found = [("apex", self.apex), ("aed", self.aed), ("events", f"{events or 'none'}{more}")]
        title = f"Stance of {name_of(self.robot)}: {self.status} after {self.duration:.5g} s"
        return Card(title, given, [*found, *(("warning", each) for each in self.warnings)])

    def _over(self, t: NDArray[np.float64]) -> dict[str, Any]:
        energy = self.energy(t)
        motion = {**self.at(t)._asdict(), "compression": self.compression(t), "contact_force": self.contact_force(t)}
        return motion | {"u": self.current(t), "body_energy": energy.body, "total_energy": energy.total}

    def _arrays(self) -> Arrays:
        names = ("status", "duration", "apex", "aed", "compression_max")
        return events_of(self.events) | {name: ((), getattr(self, name)) for name in names}

    @property
    def end_compression(self) -> float:
        """Compression of the leg [m] at the ending; 0 exactly at a take-off of a leg without a damper."""
        return float(self._solved.outcome()[2].y)

    def _solver_state(self, t: ArrayLike) -> records.LegState:
        return self._solved.state_at(self._times(t))

    def _times(self, t: ArrayLike) -> NDArray[np.floating]:
        if type(t) is float and 0.0 <= t <= self.duration:  # the common case
            return np.array([t], self.dtype)
        return times_within(t, self.dtype, self.duration, endless=self.status == "rest")


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
    backend: str | None = None,
    dtype: Any = np.float64,
) -> Stance:
    """The stance that follows from a state at touchdown, by (3), (4), exactly: every mode, every event, every ending.

    v1, v2 [m/s]: velocities after the impact; x1 [m]; x2 [m]: height of the body, or in its place compression [m] of
    the leg, as a flight has left it; that is 0 if both are left out. u [A]: a current, or steps [(t, u), ...] from
    t = 0 on. horizon [s]: longest time. backend: "c", "python", or None for the best there is. dtype: float64 or
    float32. Raises HopformError (a ValueError) for a value that is not allowed.

    >>> from hopform import load_robot
    >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0)
    >>> stance.status, round(stance.duration, 4), [event.kind for event in stance.events]
    ('takeoff', 0.1841, ['x2_reverses'])
    """
    start = start_of(robot, x1, v1, x2, v2, compression)
    return _solve(robot, start, x2 is not None, u, horizon, max_phases, backend, dtype)


def solve_motion(
    robot: Robot,
    *,
    x1: SupportsFloat = 0.0,
    v1: SupportsFloat = 0.0,
    x2: SupportsFloat | None = None,
    v2: SupportsFloat = 0.0,
    compression: SupportsFloat | None = None,
    u: Current = 0.0,
    horizon: SupportsFloat = 2.0,
    max_phases: int = 4096,
    backend: str | None = None,
    dtype: Any = np.float64,
) -> Stance:
    """The motion of any model from a state, exactly: what every model can, a rig and a joint too, which have no stance.

    Arguments as for `solve_stance`. Where the foot is bolted the leg pulls as well as it pushes, so the compression may
    be below 0, and the motion ends by rest or horizon.

    >>> from hopform import load_robot
    >>> motion = solve_motion(load_robot("hopper_c"), compression=0.02)
    >>> motion.status, round(motion.duration, 4)
    ('rest', 0.1572)
    """
    start = start_of(robot, x1, v1, x2, v2, compression, "motion")
    return _solve(robot, start, x2 is not None, u, horizon, max_phases, backend, dtype)


def _solve(
    robot: Robot, start: records.LegState, x2_is_given: bool, u: Current, horizon: SupportsFloat, max_phases: int,
    backend: str | None, dtype: Any,
) -> Stance:  # fmt: skip
    """What follows from a state."""
    precision = DOUBLE if dtype is np.float64 else precision_of(dtype)
    steps = steps_of(u)
    longest = horizon if type(horizon) is float and 0.0 < horizon < math.inf else positive("horizon", horizon, "s")
    quick = type(max_phases) is int and 0 < max_phases <= checks.LARGEST
    most = max_phases if quick else whole("max_phases", max_phases)
    back_end = robot.solver.back_end(backend)
    solved = back_end.solve_stance(robot.parameters, start, steps, longest, most, precision)
    return _stance(robot, steps, back_end.name, precision, solved, x2_is_given, (start, longest, most))


def aed_at(stance: Stance, t: ArrayLike) -> NDArray[np.floating]:
    """The AED (24) [J], the change of the body's energy since touchdown, at times t [s], by its ledger's entries."""
    entries = stance.ledger(t)
    return np.asarray(sum(getattr(entries, name) for name in stance.robot.solver.package.records.LEDGER_OF_BODY))


def in_order(t: ArrayLike, times: NDArray[Any], values: Callable[[NDArray[Any]], Sequence[NDArray[Any]]]) -> list[Real]:
    """Values of what takes times in their order, in t's shape."""
    order = np.argsort(times, kind="stable")
    back = np.argsort(order, kind="stable")
    return [shaped(each[back], t) for each in values(times[order])]


def uniform_times(
    duration: float, count: int | None, dt: SupportsFloat | None, dtype: np.dtype[Any]
) -> tuple[NDArray[np.floating], float]:
    """Times of a uniform grid over [0, duration] and their distance [s], any where there is but one time."""
    if (count is None) == (dt is None):
        raise HopformError(f"either count or dt must be given, got count = {shown(count)}, dt = {shown(dt)}")
    if dt is None:
        number = checks.count("count", count, EACH)
        step = duration / (number - 1) if number > 1 else 0.0
    else:
        step = positive("dt", dt, "s")
        last = duration / step * (1.0 + 4.0 * float(np.finfo(dtype).eps))
        if last >= (most := checks.MEMORY // EACH):
            raise HopformError(f"dt must be > {duration / most!r} s for a stance of {duration!r} s, got {step!r}")
        number = math.floor(last) + 1
    t = np.arange(number, dtype=dtype)
    t *= dtype.type(step)
    if dt is None and number > 1:
        t[-1] = duration
    t[np.searchsorted(t, dtype.type(duration), "right") :] = duration  # what rounding took past the ending
    return t, step or 1.0


def fitting(out: Sequence[Any], t: NDArray[np.floating]) -> list[NDArray[Any]]:
    """The arrays if they can take the states at times t; HopformError if not."""
    columns = items("out", out, f"{len(State._fields)} arrays", len(State._fields))
    if len(columns) != len(State._fields):
        raise HopformError(f"out must be {len(State._fields)} arrays, got {len(columns)}")
    for name, column in zip(State._fields, columns, strict=True):
        array: Any = column
        holds = isinstance(column, np.ndarray)
        if not (holds and array.shape == t.shape and array.dtype == t.dtype):
            got = f"{array.dtype} of shape {array.shape}" if holds else shown(array)
            raise HopformError(f"out.{name} must be an array of {t.dtype} of shape {t.shape}, got {got}")
    return columns


def touchdown_velocity(robot: Robot, height: SupportsFloat) -> float:
    """Velocity of the body [m/s] after the impact of a drop from rest at a hop height [m], x1 = 0; negative.

    >>> from hopform import load_robot
    >>> round(touchdown_velocity(load_robot("hopper_c"), 0.2), 4)
    -1.9308
    """
    drop = checks.nonnegative("height", height, "m")
    return float(checked_robot(robot, "flight").solver.package.formulas.touchdown_velocity(robot.parameters, drop))


def _stance(
    robot: Robot, u: Steps, backend: Backend, dtype: Precision, solved: SolvedStance, given: bool, asked: Any
) -> Stance:
    """A stance with its ending, made without the slow __init__ of a frozen dataclass."""
    ending, duration, (x1, v1, v2, y), apex, aed = solved.outcome()
    status, lifts = ENDINGS[ending], ending == TAKEOFF
    end = tuple_of(State, (x1, v1, float(body_height(robot, dtype, x1, y)), v2))
    stance: Stance = object.__new__(Stance)
    apex = apex if lifts and robot.g > 0.0 else math.nan
    held: dict[str, Any] = {
        "robot": robot, "u": u, "backend": backend, "dtype": dtype, "status": status, "duration": duration, "end": end,
        "takeoff": end if lifts else None, "apex": apex, "aed": aed, "_solved": solved, "_x2_is_given": given,
        "_asked": asked,
    }  # fmt: skip
    object.__setattr__(stance, "__dict__", held)
    return stance


def with_height(robot: Robot, dtype: np.dtype[Any], state: Any) -> State[Any]:
    """A state x1, v1, v2, y, or states, with the height of the body in place of the compression."""
    return State(state.x1, state.v1, body_height(robot, dtype, state.x1, state.y), state.v2)


def body_height(robot: Robot, dtype: np.dtype[Any], x1: Real, y: Real) -> Any:
    """Height of the body [m] at states of a precision, in which every operation is rounded, as in the C library."""
    parameters, height = robot.parameters, robot.solver.package.formulas.body_height
    if dtype is DOUBLE:
        return height(parameters, x1, y)
    with np.errstate(over="ignore"):
        rounded = type(parameters)(*map(dtype.type, parameters))
    return height(rounded, np.asarray(x1, dtype), np.asarray(y, dtype))


def rest_of(robot: Robot) -> float:
    """Compression of the spring [m] where that of the leg is 0: L0 + c less it is the leg's length without load."""
    return float(robot.solver.package.formulas.compression_at_rest(robot.parameters))


def placed(robot: Robot, act: str, x1: Any, v1: Any, v2: Any) -> tuple[float, float, float]:
    """x1, v1, v2 as floats; HopformError for what is not finite, for an actuator beyond its stroke, and for a robot
    whose model cannot do what it starts.
    """
    checked_robot(robot, act)
    if type(x1) is type(v1) is type(v2) is float and math.isfinite(x1 + v1 + v2):  # the common case, all at once
        x_1, v_1, v_2 = x1, v1, v2
    else:
        x_1, v_1, v_2 = finite("x1", x1, "m"), finite("v1", v1, "m/s"), finite("v2", v2, "m/s")
    if not robot.x1_min <= x_1 <= robot.x1_max:
        raise HopformError(f"x1 must be within its stroke {robot.x1_min!r} .. {robot.x1_max!r} m, got {x_1!r}")
    return x_1, v_1, v_2


def start_of(
    robot: Robot, x1: Any, v1: Any, x2: object, v2: Any, compression: object = None, act: str = "stance"
) -> records.LegState:
    """The state at touchdown with the compression as a coordinate of its own; 0 where it and x2 are left out."""
    x_1, v_1, v_2 = placed(robot, act, x1, v1, v2)
    if x2 is None and compression is None:
        start: records.LegState = tuple_of(records.LegState, (x_1, v_1, v_2, 0.0))
        return start
    if x2 is not None and compression is not None:
        raise HopformError(f"either x2 or compression may be given, got x2 = {shown(x2)} and {shown(compression)}")
    height = None if x2 is None else finite("x2", x2, "m")
    rest = rest_of(robot)
    y = finite("compression", compression, "m") if height is None else x_1 - height + robot.L0 + robot.c - rest
    if abs(y) <= TOUCHING_ULP * math.ulp(robot.L0):
        y = 0.0
    if y < 0.0 and "stance" in robot.solver.can:  # without a contact the leg pulls
        highest = f"x1 + L0 + c{' - rest' if rest else ''} = {x_1 + robot.L0 + robot.c - rest!r} m"
        what = "compression must be >= 0 m" if height is None else f"x2 must be <= {highest}"
        raise HopformError(f"{what}, or the spring pulls, got {y if height is None else height!r}")
    return records.LegState(x_1, v_1, v_2, y)


def steps_of(u: Current) -> Steps:
    """A current, or steps of it, as steps (t, u) [s, A] that begin at 0; HopformError for what is neither."""
    if type(u) is float and math.isfinite(u):  # the common case, before a protocol is asked
        return ((0.0, u),)
    if checks.is_one(u):
        return ((0.0, finite("u", u, "A")),)
    if callable(u) or getattr_static(u, "law", None):
        law = "a law is what a controller of simulate answers, as controllers.Sampled(period, law)"
        raise HopformError(f"u must be a current in A or steps (t, u); {law}, got {shown(u)}")
    steps: list[tuple[float, float]] = []
    for number, step in enumerate(items("u", u, "a current in A or steps (t, u)", records.MOST_STEPS)):
        t, current = pair(f"u[{number}]", step, "(t, u)")
        steps.append((finite(f"u[{number}] time", t, "s"), finite(f"u[{number}] current", current, "A")))
    if not steps:
        raise HopformError("u must be a current in A or at least one step (t, u), got no step")
    if steps[0][0] != 0.0:
        raise HopformError(f"u must start at t = 0 s, got {steps[0][0]!r}")
    for (before, _), (after, _) in zip(steps, steps[1:], strict=False):
        if not after > before:
            raise HopformError(f"the times of u must increase, got {after!r} s after {before!r} s")
    return tuple(steps)


def precision_of(dtype: Any) -> Precision:
    known = _SPELT.get(dtype) if isinstance(dtype, (str, type, np.dtype)) else None
    if known is None:
        raise HopformError(f"dtype must be float64 or float32, got {shown(cast(object, dtype))}")
    return known
