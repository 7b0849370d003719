"""One motion of any model: solved exactly from a state, then evaluated at any time. Its coordinates, events and
elements have the names that the model's file gives them, by the facts of its solver.
"""

import math
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from operator import attrgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, SupportsFloat, TypeAlias, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

import hopform._checks as checks
from hopform._checks import finite, items, mapping, positive, shaped, shown, times_within
from hopform._errors import HopformError
from hopform._robots import Robot, nearest, placed
from hopform._sensitivities import (
    Columns,
    ManySensitivities,
    Sensitivities,
    aliases_of,
    at_times,
    chosen_columns,
    of_motion,
)
from hopform._show import UNITS, Arrays, Card, Curve, OverTime, events_of
from hopform._solver.c import Solved, tuple_of
from hopform._solver.choice import Solver
from hopform._solver.folder import Facts
from hopform._solver.package import AnyEvent, Precision, Steps, records
from hopform._warnings import MOTION_WARNINGS, Warning, said

if TYPE_CHECKING:
    from typing_extensions import TypeVar

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
Start: TypeAlias = Mapping[str, SupportsFloat] | None
"""Coordinates and velocities by their names."""

EACH = 128  # [B] a time of a grid
TOUCHING_ULP = 4.0
WORDS_OF_ENDINGS = {
    "takeoff": "takes off after",
    "rest": "comes to rest after",
    "horizon": "still moves after",
    "too_many_phases": "reaches the limit of phases after",
    "uncertified": "is certified only up to",
}
"""What a motion does at its ending."""
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
    """Something that happened during a motion; kinds are those of docs/reference/model.md, with the names of the
    model's coordinates.
    """

    time: float
    """[s] since the start: the touchdown of a stance, the take-off of a flight"""
    kind: AnyEvent


class Phase(NamedTuple):
    """A part of a motion in which the mode stays: of each mass +1 where it moves forwards, -1 backwards, 0 held.

    mode_1 is +1 where the hopper's actuator extends, -1 where it retracts, mode_2 +1 where its body slips up, -1 where
    it slips down. A mass that the model does not have is held; where a law sets the current mode_2 is +1 or -1 at the
    limit of the current to that side, 0 in between, and u the target.
    """

    start: float
    """[s] since the start"""
    end: float
    """[s]"""
    mode_1: int
    mode_2: int
    u: float
    """the input, in its unit: [A] of the hopper"""
    state: State
    """where it starts, with the names of the model's coordinates"""


# ---- coordinates by their names ----


class Layout(NamedTuple):
    """How a state is shown: its named tuple, and of each entry the engine's axis, x1, v1, x2 or v2, and the unit."""

    state: Callable[..., Any]
    names: tuple[str, ...]
    axes: tuple[str, ...]
    units: tuple[str, ...]

    @property
    def unit_of(self) -> dict[str, str]:
        """The units by the names."""
        return dict(zip(self.names, self.units, strict=True))


@lru_cache(maxsize=64)
def _state_class(names: tuple[str, ...]) -> Any:
    """A named tuple, which can be pickled, with these names; that of the hopper's is `State`."""
    if names == State._fields:
        return State
    base: Any = namedtuple("State", names)  # type: ignore[misc]  # noqa: PYI024

    def reduced(self: Any) -> Any:
        return _state_again, (names, tuple(self))

    return type("State", (base,), {"__slots__": (), "__reduce__": reduced, "__doc__": f"A state: {', '.join(names)}."})


def _state_again(names: tuple[str, ...], values: tuple[Any, ...]) -> Any:
    return _state_class(names)(*values)


@lru_cache(maxsize=64)
def layout_of(solver: Solver) -> Layout:
    """How a solver's states are shown, by its facts."""
    axes = {axis: table for axis, table in solver.facts.axes.items() if axis != "y"}
    names, units = (tuple(str(table[key]) for table in axes.values()) for key in ("name", "unit"))
    return Layout(_state_class(names), names, tuple(axes), units)


@lru_cache(maxsize=64)
def state_of_leg(solver: Solver) -> type[State[Any]]:
    """The state of a model's stances, which has the names of its file beside x1, v1, x2, v2."""
    return _leg_state(tuple(aliases_of(solver).items()))


@lru_cache(maxsize=64)
def _leg_state(aliases: tuple[tuple[str, str], ...]) -> type[State[Any]]:
    if not aliases:
        return State

    def reduced(self: Any) -> Any:
        return _leg_again, (aliases, tuple(self))

    own = {name: property(attrgetter(axis), doc=axis) for name, axis in aliases}
    return type("State", (State,), {"__slots__": (), "__reduce__": reduced, "__doc__": State.__doc__, **own})


def _leg_again(aliases: tuple[tuple[str, str], ...], values: tuple[Any, ...]) -> State[Any]:
    return _leg_state(aliases)(*values)


class Mass(NamedTuple):
    """A mass that may move: its number in the engine, 1 or 2, its name, its coordinate and velocity with the unit of the
    former, the words for its directions and for its events, its stops, "lower" and "upper" where it has them, as the
    file gives them, and whether friction acts on it.
    """

    number: int
    name: str
    position: str
    velocity: str
    unit: str
    directions: tuple[str, str]
    events: Mapping[str, str]
    stops: Mapping[str, str]
    has_friction: bool


@lru_cache(maxsize=64)
def masses_of(solver: Solver) -> tuple[Mass, ...]:
    """The masses of a solver that may move."""
    facts, made = solver.facts, list[Mass]()
    for axis, each in zip([axis for axis in ("x1", "x2") if axis in facts.axes], facts.moving, strict=True):
        place, (forwards, backwards) = facts.axes[axis], each["directions"]
        about = (forwards, backwards), each["events"], each["stops"], bool(each["friction"])
        made.append(Mass(int(axis[1]), each["name"], place["name"], each["velocity"], place["unit"], *about))
    return tuple(made)


def force_unit(unit: str) -> str:
    """Unit of the force on a coordinate: a torque where it turns."""
    return "N m" if unit == "rad" else "N"


@lru_cache(maxsize=64)
def input_unit(solver: Solver) -> str:
    """The unit of the input; of a model without one it is 0, without a unit."""
    return next((str(each["unit"]) for each in solver.facts.inputs), "1")


def stroke_of(robot: Robot) -> tuple[float, float]:
    """The lower and the upper stop of the first mass."""
    return robot.letters.x1_min, robot.letters.x1_max


def limit_of(robot: Robot) -> float:
    """The largest size of the input; without one there is no limit, and none of a target."""
    facts = robot.solver.facts
    return float(robot.letters.u_max) if facts.inputs and not facts.currents else math.inf


# ---- a motion ----


@dataclass(frozen=True, repr=False, eq=False)
class Motion(OverTime):
    """A motion, solved. Times in s from the start; coordinates by the names of the model's file, in its units.

    status: "rest", "horizon", "too_many_phases", or "uncertified", where the search met its bound; of a model with a
    contact, whose motion is a `Stance`, also "takeoff". duration: time of the ending. end: the state there.
    """

    robot: Robot
    u: Steps
    dtype: np.dtype[Any]
    status: records.Ending
    duration: float
    end: Any
    _solved: Solved = field(repr=False, compare=False)
    _x2_is_given: bool = field(repr=False, compare=False)
    _asked: tuple[records.LegState, float, int] = field(repr=False, compare=False)
    """start, horizon and bound on phases"""
    _said_of: ClassVar[tuple[Warning, ...]] = MOTION_WARNINGS

    @property
    def _layout(self) -> Layout:
        return layout_of(self.robot.solver)

    @property
    def inputs(self) -> tuple[Any, ...]:
        """The inputs of the model, one or none: tables with name, unit and meaning."""
        return self.robot.solver.facts.inputs

    @property
    def units(self) -> dict[str, str]:
        """The units of the entries of a state, by their names."""
        return self._layout.unit_of

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """The events in their order."""
        kinds = self.robot.solver.package.records.EVENTS
        return tuple(tuple_of(Event, (t, kinds[event])) for t, event in self._solved.events())

    @cached_property
    def phases(self) -> tuple[Phase, ...]:
        """The phases in their order."""
        rows, layout = self._solved.phase_rows(), self._layout
        ends = [*(row[0] for row in rows[1:]), self.duration]
        states = [layout.state(*map(float, shown_of(self.robot, self.dtype, layout, row[1]))) for row in rows]
        return tuple(
            Phase(t, end, mode // 3 - 1, mode % 3 - 1, self.u[step][1], state)
            for (t, _, mode, _, step), end, state in zip(rows, ends, states, strict=True)
        )

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """What the model does not say of a real machine: a current above its limit, a stop that it is pushed onto."""
        return tuple(said(self._said_of, self._reading))

    def _reading(self, name: str) -> Any:
        """A reading that warnings compare."""
        robot, flows = self.robot, [u for t, u in self.u if t < self.duration or t == 0.0]
        low, high = stroke_of(robot)
        first = self._solved.phase_rows()[0]
        readings: dict[str, Callable[[], Any]] = {
            "stiff": lambda: self._is_stiff,
            "u": lambda: flows[0],
            "u_largest": lambda: max(flows, key=abs),  # a step behind the ending does not flow
            "u_size": lambda: max(map(abs, flows)),
            "limit": lambda: limit_of(robot),
            "input": lambda: robot.solver.facts.inputs[0]["name"],
            "unit": lambda: robot.solver.facts.inputs[0]["unit"],
            "held": lambda: float(first[2] // 3 == 1),
            "position": lambda: first[1].x1,
            "lower": lambda: low,
            "upper": lambda: high,
            "mass": lambda: masses_of(robot.solver)[0].name,
            "push": lambda: float(self.forces(0.0)["input"]),
        }
        return readings[name]()

    @property
    def _is_stiff(self) -> float:
        status = self._solved.plan_status(self.robot.parameters)
        return float(records.STATUSES.get(status) == "ill_conditioned")

    def at(self, t: Any) -> Any:
        """The state at times t [s], a named tuple of the model's coordinates and velocities, each in t's shape.

        0 <= t <= duration, any t >= 0 after rest, else ValueError. At the time of an event: the state behind it, which a
        stop has left without velocity. So is all that is read at a time.
        """
        return self._layout.state(*(shaped(value, t) for value in self._shown(self._solver_state(t))))

    def grid(
        self, count: int | None = None, *, dt: SupportsFloat | None = None, out: Sequence[Any] | None = None
    ) -> tuple[NDArray[np.floating], Any]:
        """Times from 0 to the ending and the states there: `count` of them, or one every dt [s]; faster than `at`.

        out: an array of one dimension for each entry of a state, of the motion's dtype, that takes it. Raises
        HopformError if not exactly one of count >= 1 and dt > 0 is given, or if out does not fit.

        >>> from hopform import load_robot, solve_stance
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0)
        >>> t, state = stance.grid(1001)
        >>> float(t[-1]) == stance.duration, round(float(state.x2[500]), 6) == round(float(stance.at(t[500]).x2), 6)
        (True, True)
        """
        layout = self._layout
        t, step = uniform_times(self.duration, count, dt, self.dtype, type(self).__name__.lower())
        into = list(np.empty((len(layout.names), t.size), self.dtype)) if out is None else fitting(out, t, layout.names)
        whole = {axis: np.ascontiguousarray(column) for axis, column in zip(layout.axes, into, strict=True)}
        x1, v1, x2, v2 = (whole[axis] if axis in whole else np.empty_like(t) for axis in State._fields)
        if self.duration > 0.0:
            self._solved.grid(step, records.LegState(x1, v1, v2, x2))
        else:
            for column, values in zip((x1, v1, v2, x2), self._solver_state(t), strict=True):
                column[...] = values
        if "x2" in whole:
            x2[...] = body_height(self.robot, self.dtype, x1, x2)
        for axis, column in zip(layout.axes, into, strict=True):
            column[...] = whole[axis]  # itself where it is in one piece
        return t, layout.state(*into)

    @overload
    def current(self, t: Number) -> float: ...
    @overload
    def current(self, t: Times) -> NDArray[np.floating]: ...
    def current(self, t: Number | Times) -> Real:
        """The input at times t [s], in t's shape and the unit that the model's file gives it, a current [A] of the hopper;
        from the time of a step on that of the step.

        Where a law sets a current, that which it sets: at its limit exactly the limit.
        """
        times = self._times(t)
        return shaped(self._by_law(times) if self.robot.solver.facts.currents else self._steps(times), t)

    @overload
    def target(self, t: Number) -> float: ...
    @overload
    def target(self, t: Times) -> NDArray[np.floating]: ...
    def target(self, t: Number | Times) -> Real:
        """The target of the law at times t [s], in t's shape, in its unit; HopformError for a model without a law."""
        times = self._times(t)
        if not self.robot.solver.facts.currents:
            raise HopformError(f"the model {self.robot.solver.name} has no law, and so no target")
        return shaped(self._steps(times), t)

    def driven(self, t: Number | Times) -> dict[str, Real]:
        """The input, and the current that a law sets, at times t [s], in t's shape, by their names in the model."""
        facts = self.robot.solver.facts
        found = {str(each["name"]): shaped(self._steps(self._times(t)), t) for each in facts.inputs}
        return found | {str(each["name"]): self.current(t) for each in facts.currents}

    def _steps(self, times: NDArray[Any]) -> NDArray[Any]:
        """The input at times."""
        starts, inputs = np.array(self.u).T
        return np.asarray(inputs[np.searchsorted(starts, times, side="right") - 1])

    def _by_law(self, times: NDArray[Any]) -> NDArray[Any]:
        """The current that a law sets at times: what it asks for, or its limit."""
        rows, formulas, parameters = (
            self._solved.phase_rows(),
            self.robot.solver.package.formulas,
            self.robot.parameters,
        )
        number = np.searchsorted(np.array([row[0] for row in rows], self.dtype), times, side="right") - 1
        modes, steps = (np.array([row[n] for row in rows])[number] for n in (2, 4))
        limit, target = modes % 3 - 1, np.array([u for _, u in self.u])[steps]
        with np.errstate(invalid="ignore"):
            at_limit = limit * np.asarray(formulas.current_limit(parameters))
        asked = formulas.current_of_law(parameters, self._solved.state_at(times), target)
        return np.asarray(np.where(limit == 0, asked, at_limit))

    @overload
    def total_energy(self, t: Number) -> float: ...
    @overload
    def total_energy(self, t: Times) -> NDArray[np.floating]: ...
    def total_energy(self, t: Number | Times) -> Real:
        """Kinetic and potential energy H [J] of the whole machine at times t [s], in t's shape."""
        return shaped(self._solved.energy_at(self._times(t)).total, t)

    @overload
    def ledger(self, t: Number) -> records.Ledger[float]: ...
    @overload
    def ledger(self, t: Times) -> records.Ledger[NDArray[np.floating]]: ...
    def ledger(self, t: Number | Times) -> records.Ledger[Any]:
        """The ledger [J] from the start, as it is given, to times t [s], in t's shape; each entry from its own closed
        form, t as for `at`. At t = 0 its `stop_loss` is what a start that runs into a stop loses there.
        """
        entries = in_order(t, self._times(t), self._solved.ledger_at)
        return cast("records.Ledger", self.robot.solver.package.records.Ledger(*entries))

    def ledger_by_element(self, t: Number | Times) -> dict[str, dict[str, Real]]:
        """The same by elements of the model, then by entries: what each has brought into the energy H.

        Elements without work are left out, and so is what one mass does to another through a spring.
        """
        entries = self.ledger(t)._asdict()
        whole = {*self.robot.solver.package.records.LEDGER_OF_ROBOT}
        found = dict[str, dict[str, Real]]()
        for each in self.robot.solver.facts.elements:  # a mass and what drives it may have one name
            own = {} if each.get("fixed") else {key: entries[key] for key in each["ledger"] if key in whole}
            if own:
                found.setdefault(each["name"], {}).update(own)
        return found

    def forces(self, t: Number | Times) -> dict[str, Real]:
        """Forces [N, N m on what turns] at times t [s], in t's shape, along the coordinate that each acts on.

        friction_NAME: of friction on the mass with the coordinate NAME; held, as much as it takes to hold it, up to its
        level at rest. stop_NAME: of the stop on a mass that it holds, what friction does not carry; 0 elsewhere (a hit is an
        impulse). input: of the input. contact: of the ground. A model has those of what its file declares.
        """
        return {name: shaped(values, t) for name, values in self._solved.forces_at(self._times(t)).items()}

    def _unit(self, name: str) -> str | None:
        layout, facts = self._layout, self.robot.solver.facts
        own = {str(table["name"]): str(table["unit"]) for table in facts.axes.values()}  # forces of a leg have these
        coordinates = own | layout.unit_of
        if name in coordinates:
            return coordinates[name]
        of, _, coordinate = name.partition("_")
        if of in ("friction", "stop"):
            return force_unit(coordinates[coordinate])
        if name == "input":
            return force_unit(layout.units[0])
        drives = {each["name"]: each["unit"] for each in (*facts.inputs, *facts.currents)}
        return drives.get(name) or UNITS.get(name)

    @property
    def sensitivities(self) -> Sensitivities:
        """Derivatives of the duration T and the state at the ending by initial state, input and parameters, through
        every event.

        They are those of the events as they are: none appears or goes. At rest T moves with the event that stops the
        last mass; at the horizon it stays. A mass that is held at the start keeps its velocity 0; one that starts on a
        stop and is held there stays where it starts, and stops count where they are met later. With a list of steps the
        input's column moves all of them alike. NaN where an event grazes, where a rest ends at a small change, and where
        the search has ended.
        """
        return self._derived(of_motion)

    def sensitivities_by(self, names: str | Sequence[str]) -> Sensitivities:
        """Some columns of the same, which alone are computed: by coordinates and velocities of the start, the input, which
        is also `u`, parameters; `u[3]` is the input of step 3 alone, `t[3]` the time of that step.

        The first step, at 0 s, is 0. The columns of all steps' inputs add up to that of `u`. Raises HopformError for a name
        that is none, one that is given twice, and a step that the input does not have.

        >>> from hopform import load_robot, solve_stance
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=[(0.0, 1.0), (0.1, 2.0)])
        >>> by = stance.sensitivities_by(["k", "u[0]", "u[1]", "t[1]"])
        >>> round(by["apex", "u[0]"] + by["apex", "u[1]"], 9) == round(stance.sensitivities["apex", "u"], 9)
        True
        """
        return self._derived(of_motion, self._columns(names, "names"))

    def _columns(self, names: object, field: str) -> Columns:
        """The columns of names."""
        return chosen_columns(names, field, self.robot.solver, self._x2_is_given, len(self.u))

    def _derived(self, of: Callable[..., Sensitivities], by: Columns | None = None) -> Sensitivities:
        solved = self._solved.sensitivities(None if by is None else by.solved)
        about = self._x1_at_start, self._x2_is_given, self.robot.solver, self.robot.parameters
        return of(Sensitivities, solved, *about, by)

    @property
    def _x1_at_start(self) -> float:
        return float(self._solved.phase_rows()[0][1].x1)

    def derivatives(self, t: ArrayLike, by: str | Sequence[str] | None = None) -> ManySensitivities:
        """Derivatives of the state at times t [s], in t's shape, with two further axes, by the same; by: some names, as for
        `sensitivities_by`.

        t is fixed, so at a time behind an event they are those of a motion through it; where one grazes, those of a
        motion that does not notice it.

        >>> from hopform import load_robot, solve_stance
        >>> stance = solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0)
        >>> round(float(stance.derivatives(0.05)["x2", "v2"]), 5)
        0.04041
        >>> stance.derivatives([0.05, 0.1], by=("k", "u")).matrix.shape
        (2, 4, 2)
        """
        chosen = None if by is None else self._columns(by, "by")

        def of(times: NDArray[Any]) -> Sequence[NDArray[Any]]:
            states, tangents = self._solved.tangents(times, None if chosen is None else chosen.solved)
            return [*states, tangents]

        *states, rows = in_order(t, self._times(t), of, shape=False)
        shape = np.shape(t)
        at = records.LegState(*(each.reshape(shape) for each in states))
        about = self._x1_at_start, self._x2_is_given, self.robot.solver, self.robot.parameters
        return at_times(at, rows.reshape(*shape, *rows.shape[1:]), *about, chosen)

    def explain(self) -> str:
        """How it was solved, phase by phase: poles, event functions at the start and the end, and which rule of the
        certificate says in which interval that none has an earlier zero. docs/explanation/stance.md reads one.

        A library beside the one that solved it solves it again, to the same bits, and notes what decides.

        >>> from hopform import load_robot, solve_stance
        >>> print(solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0).explain().splitlines()[0])
        hopper_c, u = 2 A; takes off after 184.08 ms, apex 0.1398 m
        """
        return self._explained(self, self._asked)

    _explained: ClassVar[Callable[..., str]]
    """What explains a motion; `_explain`, which stands above, binds it."""

    _endings: ClassVar[Mapping[str, str]] = WORDS_OF_ENDINGS
    _figures: ClassVar[Mapping[str, str]] = MappingProxyType({})
    """What it has beside its ending, with the words for it."""
    beginning: ClassVar[str] = "start"
    """What a motion begins with, in a word."""

    @property
    def outcome(self) -> str:
        """How it ended, in words.

        >>> from hopform import load_robot, solve_motion
        >>> solve_motion(load_robot("hopper_c"), start={"y": 0.02}, horizon=0.05).outcome
        'is still on the ground after 50 ms'
        """
        scale, unit = unit_of_time(self.duration)
        return f"{self._endings[self.status]} {self.duration * scale:.5g} {unit}"

    @property
    def input_in_words(self) -> str:
        """The input, in words; nothing of a model without one."""
        return ", ".join(steps_in_words(self.u, each["name"], each["unit"]) for each in self.inputs)

    @property
    def figures_in_words(self) -> list[str]:
        """What it has beside its ending, in words, with units: of a stance the apex of a take-off, the AED and the
        largest compression.

        >>> from hopform import load_robot, solve_stance
        >>> solve_stance(load_robot("hopper_c"), v2=-1.93, u=2.0).figures_in_words
        ['apex 0.139828 m', 'AED -1.42434 J', 'largest compression 0.117927 m']
        """
        found = ((words, float(getattr(self, name)), self._unit(name)) for name, words in self._figures.items())
        return [f"{words} {value:.6g} {unit}" for words, value, unit in found if math.isfinite(value)]

    def _card(self) -> Card:
        inputs, u = self.robot.solver.facts.inputs, [each for _, each in self.u]
        first, last = (zip(self._layout.names, state, strict=True) for state in (self.phases[0].state, self.end))
        steps = [(each["name"], u[0] if len(u) == 1 else f"{len(u)} steps, from {u[0]:.5g}") for each in inputs]
        found = [*last, ("events", events_in_short(self.events)), *(("warning", each) for each in self.warnings)]
        title = f"Motion of {self.robot.label}: {self.status} after {self.duration:.5g} s"
        return Card(title, [*first, *steps], found)

    def _over(self, t: NDArray[np.float64]) -> dict[str, Any]:
        driven, forces = self.driven(t), self.forces(t)
        return {**self.at(t)._asdict(), **driven, **forces, "total_energy": self.total_energy(t)}

    def _curve(self) -> Curve:
        """The first coordinate over time."""
        t = np.linspace(0.0, self.duration, 121)
        name, unit = self._layout.names[0], self._layout.units[0]
        return f"{name} [{unit}] over time [s]", t, self.at(t)[0]

    def _arrays(self) -> Arrays:
        figures = ("status", "duration", *self._figures)
        return events_of(self.events) | {name: ((), getattr(self, name)) for name in figures}

    def _shown(self, state: records.LegState) -> list[Any]:
        return shown_of(self.robot, self.dtype, self._layout, state)

    def _solver_state(self, t: ArrayLike) -> records.LegState:
        return self._solved.state_at(self._times(t))

    def _times(self, t: ArrayLike) -> NDArray[np.floating]:
        if type(t) is float and 0.0 <= t <= self.duration:  # the common case
            return np.array([t], self.dtype)
        return times_within(t, self.dtype, self.duration, endless=self.status == "rest")


def unit_of_time(longest: float) -> tuple[float, str]:
    """Milliseconds for what is over within a second."""
    return (1000.0, "ms") if longest < 1.0 else (1.0, "s")


def steps_in_words(steps: Sequence[tuple[float, float]], name: str, unit: str) -> str:
    """An input, or steps of it, in words."""
    if len(steps) == 1:
        return f"{name} = {steps[0][1]:g} {unit}"
    return f"{name} in {len(steps)} steps, {min(u for _, u in steps):g} to {max(u for _, u in steps):g} {unit}"


def shown_of(robot: Robot, dtype: np.dtype[Any], layout: Layout, state: records.LegState) -> list[Any]:
    """The entries of a state, or of states, that are shown."""
    return [
        body_height(robot, dtype, state.x1, state.y) if axis == "x2" else getattr(state, axis) for axis in layout.axes
    ]


def force_units(motion: Motion) -> dict[str, str]:
    """The forces of a motion with their units."""
    return {name: str(motion._unit(name) or "N") for name in motion.forces(0.0)}  # pyright: ignore[reportPrivateUsage]


def energies_of(motion: Motion, t: Number | Times) -> dict[str, Real]:
    """The energies that a model has, by their letters, at times t [s]: H, and of a body over a contact E."""
    found = motion._solved.energy_at(motion._times(t))  # pyright: ignore[reportPrivateUsage]
    return {each["glyph"]: shaped(getattr(found, each["name"]), t) for each in motion.robot.solver.facts.energies}


def units_of_energies(motion: Motion) -> dict[str, str]:
    """The units of the energies that a model has, by their letters: H, and of a body over a contact E."""
    return {each["glyph"]: each["unit"] for each in motion.robot.solver.facts.energies}


def events_in_short(events: Sequence[Event]) -> str:
    """The first events and how many more there are."""
    first = ", ".join(f"{event.kind} {event.time:.4g} s" for event in events[:3])
    more = f", {len(events) - 3} more" if len(events) > 3 else ""
    return f"{first or 'none'}{more}"


def body_height(robot: Robot, dtype: np.dtype[Any], x1: Real, y: Real, columns: Any = None) -> Any:
    """Height of the body [m] at states of a precision, in which every operation is rounded, as in the C library; columns:
    of parameters, in place of the robot's.
    """
    parameters, height = columns or robot.parameters, robot.solver.package.formulas.second_position
    if dtype is DOUBLE:
        return height(parameters, x1, y)
    with np.errstate(over="ignore"):
        rounded = type(parameters)(*map(dtype.type, parameters))
    return height(rounded, np.asarray(x1, dtype), np.asarray(y, dtype))


# ---- what goes in ----


def named_start(robot: Robot, start: Start) -> dict[str, float]:
    """What a start has, by the engine's axes; HopformError for a name that the model does not have, and for what is no
    finite number.
    """
    facts = robot.solver.facts
    axes, found = axes_by_name(facts), dict[str, float]()
    for name, value in mapping("start", start, 64).items():
        axis = axis_of(facts, axes, name)
        found[axis] = finite(f"start {name}", value, facts.units[name])
    return found


def axes_by_name(facts: Facts) -> dict[str, str]:
    """The engine's axes by the names of what a start may have."""
    return {str(table["name"]): axis for axis, table in facts.axes.items()}


def axis_of(facts: Facts, axes: Mapping[str, str], name: object) -> str:
    """The axis of a name of a start; HopformError for one that the model does not have."""
    if not isinstance(name, str) or name not in axes:
        offered = {str(table["name"]): str(table["unit"]) for table in facts.offered}
        hint = nearest(name, [*offered]) if isinstance(name, str) else ""
        known = ", ".join(f"{each} [{unit}]" for each, unit in offered.items())
        raise HopformError(f"start: the model {facts.name} has no coordinate {shown(name)}{hint}; it has {known}")
    return axes[name]


def free_start(
    robot: Robot, x1: float, v1: float, x2: float | None, v2: float, y: float | None, act: str
) -> records.LegState:
    """The state that a motion without a contact starts from: x2 is 0 where it and y are left out. HopformError for a
    position beyond its stops, and for both x2 and y.
    """
    x_1, v_1, v_2 = placed(robot, act, x1, v1, v2)
    if x2 is not None and y is not None:
        first, second = (robot.solver.facts.axes[axis]["name"] for axis in ("x2", "y"))
        raise HopformError(f"give either {first} or {second}, got {first} = {x2!r} and {second} = {y!r}")
    return records.LegState(x_1, v_1, v_2, float(compression_of(robot, x_1, x2 or 0.0)) if y is None else y)


def compression_of(robot: Robot, x1: Real, x2: Real, parameters: Any = None) -> Any:
    """The compression y of a start; parameters: those of the robot, or columns of them."""
    package, at = robot.solver.package, {"x1": x1, "v1": 0.0, "x2": x2, "v2": 0.0}
    start: Any = package.records.Start(*(at[axis] for axis in layout_of(robot.solver).axes))
    return package.formulas.state_of_start(robot.parameters if parameters is None else parameters, start).y


def precision_of(dtype: Any) -> Precision:
    """The precision that people have written; HopformError for another one."""
    known = _SPELT.get(dtype) if isinstance(dtype, (str, type, np.dtype)) else None
    if known is None:
        raise HopformError(f"dtype must be float64 or float32, got {shown(cast(object, dtype))}")
    return known


# ---- times ----


def in_order(
    t: ArrayLike,
    times: NDArray[Any],
    values: Callable[[NDArray[Any]], Sequence[NDArray[Any]]],
    shape: bool = True,
) -> list[Real]:
    """Values of what takes times in their order, in t's shape, or as they are."""
    order = np.argsort(times, kind="stable")
    back = np.argsort(order, kind="stable")
    return [shaped(each[back], t) if shape else each[back] for each in values(times[order])]


def uniform_times(
    duration: float, count: int | None, dt: SupportsFloat | None, dtype: np.dtype[Any], what: str = "stance"
) -> tuple[NDArray[np.floating], float]:
    """Times of a uniform grid over [0, duration] and their distance [s], any where there is but one time."""
    if (count is None) == (dt is None):
        raise HopformError(f"give either count or dt, got count = {shown(count)}, dt = {shown(dt)}")
    if dt is None:
        number = checks.count("count", count, EACH)
        step = duration / (number - 1) if number > 1 else 0.0
    else:
        step = positive("dt", dt, "s")
        last = duration / step * (1.0 + 4.0 * float(np.finfo(dtype).eps))
        if last >= (most := checks.MEMORY // EACH):
            raise HopformError(f"dt must be > {duration / most!r} s for a {what} of {duration!r} s, got {step!r}")
        number = math.floor(last) + 1
    t = np.arange(number, dtype=dtype)
    t *= dtype.type(step)
    if dt is None and number > 1:
        t[-1] = duration
    t[np.searchsorted(t, dtype.type(duration), "right") :] = duration  # what rounding took past the ending
    return t, step or 1.0


def fitting(out: Sequence[Any], t: NDArray[np.floating], names: Sequence[str]) -> list[NDArray[Any]]:
    """The arrays if they can take states with these entries at times t; HopformError if not."""
    columns = items("out", out, f"{len(names)} arrays", len(names))
    if len(columns) != len(names):
        raise HopformError(f"out must be {len(names)} arrays, got {len(columns)}")
    for name, column in zip(names, columns, strict=True):
        array: Any = column
        holds = isinstance(column, np.ndarray)
        if not (holds and array.shape == t.shape and array.dtype == t.dtype):
            got = f"{array.dtype} of shape {array.shape}" if holds else shown(array)
            raise HopformError(f"out.{name} must be an array of {t.dtype} of shape {t.shape}, got {got}")
    return columns


def with_height(robot: Robot, dtype: np.dtype[Any], state: Any) -> State[Any]:
    """A state x1, v1, v2, y, or states, with the height of the body in place of the compression."""
    return state_of_leg(robot.solver)(state.x1, state.v1, body_height(robot, dtype, state.x1, state.y), state.v2)
