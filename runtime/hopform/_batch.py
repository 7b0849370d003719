"""Many stances at once: everything broadcasts, states, currents and the fields of the robot alike.

Stances are solved in chunks of `CHUNK`, so that memory stays bounded, progress can be shown, and Ctrl-C
is heard.
"""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._broadcast import (
    EACH,
    MOST_THREADS,
    NO_DIMS,
    Labels,
    Progress,
    check_states,
    column_of,
    columns_of_part,
    in_parts,
    is_labelled,
    joined,
    labelled,
    robot_columns,
    shape_of,
    units_of,
    words_of,
)
from hopform._checks import MEMORY, flag, function, mapping, numbers, refuse_any, shown, whole
from hopform._errors import HopformError
from hopform._motion import (
    TOUCHING_ULP,
    State,
    axes_by_name,
    axis_of,
    body_height,
    compression_of,
    input_unit,
    layout_of,
    precision_of,
    state_of_leg,
)
from hopform._robots import Robot, checked_robot
from hopform._sensitivities import AXES, Columns, ManySensitivities, at_times, chosen_columns, of_motion, of_stance
from hopform._show import UNITS, Arrays, Card, Curve, Figures, Shown, counted, span
from hopform._solver import package
from hopform._solver.choice import Solver
from hopform._solver.package import CHUNK, EVENTS, MAX_PHASES, STATES, STATUS, Column, records
from hopform._stance import LAYOUT

Names = bool | str | Sequence[str]
"""Whether derivatives are wanted, or by what."""

CHUNK_MEMORY = 2**26
"""[B] what the results of the stances take that are solved at a time."""
CURVE = 400
"""Stances whose apexes a batch draws in a notebook at most."""
_UNITS = LAYOUT.unit_of
NAMES = {"x1": "x1", "v1": "v1", "v2": "v2", "x2": "x2", "y": "compression", "u": "u", "horizon": "horizon"}
"""The names of what a stance is solved from by the engine's."""


@dataclass(frozen=True, repr=False, eq=False)
class Motions(Shown):
    """Motions, solved; every array has the shape that the inputs broadcast to. Times in s, states in the model's units.

    status: how each ended, as a number, negative where the numbers left the range of the precision (NaN in
    every other field there); `words` has them as text. duration: time of the ending. end: the state there.
    event_count: how many events. event_time, event_kind: the events, with a further last axis, NaN and 0 behind the
    last one; None unless asked for; `event_words` has the kinds as text. sensitivities: the derivatives as
    `Motion.sensitivities` has them, as arrays; None unless asked for. states: the states at `times`, which are a further
    last axis, NaN behind the ending, but a rest goes on as it is; None unless asked for. state_sensitivities: the
    derivatives of these, as `Motion.derivatives` has them; None unless both are asked for. u: the input by steps, these
    on its last axis, and u_times when each begins; None where it is constant.
    """

    status: NDArray[np.int32]
    duration: NDArray[np.floating]
    end: Any
    event_count: NDArray[np.int32]
    event_time: NDArray[np.floating] | None
    event_kind: NDArray[np.int8] | None
    sensitivities: ManySensitivities | Any = None
    labels: Labels | None = None
    """of the inputs, where they are DataArrays of xarray: `to_xarray` has them again"""
    times: NDArray[np.floating] | None = dataclasses.field(default=None, kw_only=True)
    states: Any = dataclasses.field(default=None, kw_only=True)
    state_sensitivities: ManySensitivities | Any = dataclasses.field(default=None, kw_only=True)
    u_times: NDArray[np.floating] | None = dataclasses.field(default=None, kw_only=True)
    u: NDArray[np.floating] | None = dataclasses.field(default=None, kw_only=True)
    _unit_of_input: str = dataclasses.field(default="1", kw_only=True, repr=False, compare=False)
    _further: tuple[str, str] = dataclasses.field(default=("step", "time"), kw_only=True, repr=False, compare=False)
    """the dimensions of steps and times in `to_xarray`"""
    _units: Mapping[str, str] = dataclasses.field(default_factory=dict[str, str], repr=False, compare=False)
    """of the state, by its names"""
    _kinds: Mapping[int, str] = dataclasses.field(default_factory=dict[int, str], repr=False, compare=False)

    @property
    def words(self) -> NDArray[np.str_]:
        """The endings as `Motion.status` says them, or "out_of_range"."""
        return words_of(self.status, STATUS)

    @property
    def event_words(self) -> NDArray[np.str_] | None:
        """The kinds of events in words, "" behind the last one; None unless asked for."""
        if self.event_kind is None:
            return None
        return words_of(self.event_kind, {**self._kinds, 0: ""})

    def _unit(self, name: str) -> str | None:
        return self._units.get(name) or UNITS.get(name)

    def _curve(self) -> Curve:
        (name, *_), (some, *_) = self._units, self.end
        some = np.asarray(some).reshape(-1)[:CURVE]
        return f"{name} [{self._units[name]}] at the ending, motion by motion", np.arange(some.size), some

    def _card(self) -> Card:
        return self._told("motions", [(name, span(values)) for name, values in self.end._asdict().items()])

    def _told(self, what: str, found: Figures) -> Card:
        shape = " x ".join(map(str, self.status.shape)) or "1"
        dims = f" over {', '.join(self.labels.dims)}" if self.labels else ""
        u: list[tuple[str, object]] = [("precision", str(self.duration.dtype)), ("events", span(self.event_count))]
        u += [(name, each.size) for name, each in (("steps", self.u_times), ("times", self.times)) if each is not None]
        title = f"Batch of {shape} {what}{dims}: {counted(self.words)}"
        return Card(title, u, [*found, ("duration", span(self.duration))])

    _figures: ClassVar[tuple[str, ...]] = ("duration", "event_count")

    def _arrays(self) -> Arrays:
        dims, coords, units = self.labels or Labels(tuple(f"dim_{n}" for n in range(self.status.ndim)), {})
        arrays: dict[str, Any] = {
            name: ((name,), values, {"units": units[name]} if name in units else {}) for name, values in coords.items()
        }
        arrays |= {"status": (dims, self.words)}
        arrays |= {name: (dims, getattr(self, name)) for name in self._figures}
        arrays |= {f"end_{name}": (dims, x, {"units": self._units[name]}) for name, x in self.end._asdict().items()}
        if self.event_kind is not None:
            event = (*dims, "event")
            arrays |= {"event_time": (event, self.event_time), "event_kind": (event, self.event_words)}
        if self.sensitivities is not None:
            arrays |= self.sensitivities.arrays(dims)
        (step, time), seconds = self._further, {"units": "s"}
        if self.u is not None:
            arrays |= {step: ((step,), self.u_times, seconds)}
            u = np.broadcast_to(self.u, (*self.status.shape, self.u.shape[-1]))
            arrays |= {"input": ((*dims, step), u, {"units": self._unit_of_input})}
        if self.states is not None:
            arrays |= {time: ((time,), self.times, seconds)}
            over = (*dims, time)
            arrays |= {
                f"state_{name}": (over, x, {"units": self._units[name]}) for name, x in self.states._asdict().items()
            }
            if self.state_sensitivities is not None:
                of_states = self.state_sensitivities.arrays(over, "state_")
                arrays |= of_states
        return arrays


@dataclass(frozen=True, repr=False, eq=False)
class Batch(Motions):
    """Stances, solved: motions with a contact. Lengths in m, energies in J.

    apex: NaN without take-off. aed: change of the body's energy. compression_max: the largest compression of the leg;
    None unless asked for. sensitivities: as `Stance.sensitivities` has them.
    """

    apex: NDArray[np.floating] = dataclasses.field(kw_only=True)
    aed: NDArray[np.floating] = dataclasses.field(kw_only=True)
    compression_max: NDArray[np.floating] | None = None

    _figures: ClassVar[tuple[str, ...]] = ("duration", "apex", "aed", "event_count")

    def _curve(self) -> Curve:
        some = self.apex.reshape(-1)[:CURVE]
        return "apex [m], stance by stance", np.arange(some.size), some

    def _card(self) -> Card:
        return self._told("stances", [("apex", span(self.apex)), ("aed", span(self.aed))])

    def _arrays(self) -> Arrays:
        arrays = dict(super()._arrays())
        if self.compression_max is not None:
            arrays["compression_max"] = (arrays["apex"][0], self.compression_max, {"units": "m"})
        return arrays

    @property
    def takeoff(self) -> State[NDArray[Any]]:
        """The state at take-off, NaN where there is none."""
        lifts = self.status == package.TAKEOFF
        end: State[NDArray[Any]] = self.end
        found = [np.where(lifts, value, value.dtype.type(math.nan)) for value in map(np.asarray, end)]
        return type(end)(*found)


def solve_stances(
    robot: Robot,
    *,
    v2: ArrayLike,
    x1: ArrayLike = 0.0,
    v1: ArrayLike = 0.0,
    x2: ArrayLike | None = None,
    compression: ArrayLike | None = None,
    u: ArrayLike = 0.0,
    u_times: ArrayLike | None = None,
    horizon: ArrayLike = 2.0,
    times: ArrayLike | None = None,
    max_phases: int = MAX_PHASES,
    events: bool = False,
    sensitivities: Names = False,
    compression_max: bool = False,
    dtype: Any = np.float64,
    threads: int = 1,
    progress: Progress | None = None,
    **fields: ArrayLike,
) -> Batch:
    """The stances of all combinations that the inputs broadcast to, each as `solve_stance` gives it.

    Inputs as for `solve_stance`, as arrays; u is a constant current per stance. Any field of the robot may be given
    as an array too: `solve_stances(robot, v2=-2.0, k=np.linspace(800, 1600, 9))`. DataArrays of xarray broadcast by the
    names of their dimensions, and `to_xarray` of the answer has their coordinates. threads: how many solve at a time.
    progress: called with the number of stances done and their total, now and then; what it raises ends the batch.

    u_times [s]: when the steps of u begin, in all stances alike: 0, then increasing. The last axis of u is that of its
    steps, and its other axes broadcast with the other inputs; of a DataArray it is the dimension that u_times has, if
    that is a DataArray too, else the last one.
    events: list them all. times [s]: at which `states` has the states, those of all stances alike. sensitivities:
    derivatives through the events, True for all, 140 numbers a stance, or names as for `Motion.sensitivities_by`; with
    times also those of the states. compression_max: the largest compression of each.

    Raises HopformError, which names field, index, value and what is allowed.

    >>> import numpy as np
    >>> from hopform import load_robot
    >>> batch = solve_stances(load_robot("hopper_c"), v2=-1.93, u=np.array([0.0, 2.0, 3.0]), k=[[1200.0], [1e4]])
    >>> batch.apex.shape, batch.words[0].tolist()
    ((2, 3), ['takeoff', 'takeoff', 'takeoff'])
    >>> u = np.array([[0.0, 2.0, 1.0], [0.0, 3.0, 1.0]])
    >>> batch = solve_stances(
    ...     load_robot("hopper_c"), v2=-1.93, u=u, u_times=[0.0, 0.05, 0.1], times=[0.05, 0.1], sensitivities="u[1]"
    ... )
    >>> batch.states.x2.shape, batch.sensitivities["apex", "u[1]"].shape, batch.state_sensitivities.matrix.shape
    ((2, 2), (2,), (2, 2, 4, 1))
    """
    checked_robot(robot, "stance")
    how = _how(
        "stance", robot.solver, u, u_times, times, max_phases, events, sensitivities, compression_max, dtype, threads,
        progress,
    )  # fmt: skip
    inputs = {"x1": x1, "v1": v1, "v2": v2, "u": u, "horizon": horizon}
    inputs |= {} if x2 is None else {"x2": x2}
    inputs |= {} if compression is None else {"y": compression}
    found = _solved(robot, how, inputs, NAMES, fields)
    of, end = found.of, state_of_leg(robot.solver)(*(found.of[name] for name in State._fields))
    return Batch(
        of["status"], of["duration"], end, of["event_count"], found.times, found.kinds, found.derivatives,
        found.labels, _UNITS, EVENTS, found.compressions, apex=of["apex"], aed=of["aed"], **found.over_time,
    )  # fmt: skip


def solve_motions(
    robot: Robot,
    *,
    start: Mapping[str, ArrayLike] | None = None,
    u: ArrayLike = 0.0,
    u_times: ArrayLike | None = None,
    horizon: ArrayLike = 2.0,
    times: ArrayLike | None = None,
    max_phases: int = MAX_PHASES,
    events: bool = False,
    sensitivities: Names = False,
    dtype: Any = np.float64,
    threads: int = 1,
    progress: Progress | None = None,
    **fields: ArrayLike,
) -> Motions:
    """The motions of all combinations that the inputs broadcast to, each as `solve_motion` gives it.

    start: arrays by coordinates and velocities. The others as for `solve_stances`; of a model with a contact the answer
    is a `Batch`. Raises HopformError, which names field, index, value and what is allowed.

    >>> import numpy as np
    >>> from hopform import load_robot
    >>> batch = solve_motions(load_robot("hopper_c"), start={"y": np.array([0.01, 0.02])}, u=[[0.0], [3.0]])
    >>> batch.words.tolist()
    [['rest', 'rest'], ['takeoff', 'takeoff']]
    >>> batch = solve_motions(load_robot("hopper_c"), start={"y": [0.01, 0.02]}, times=np.linspace(0.0, 1.0, 11))
    >>> batch.states.x2.shape
    (2, 11)
    """
    axes = named_columns(checked_robot(robot), start)
    how: dict[str, Any] = {
        "u": u, "u_times": u_times, "horizon": horizon, "times": times, "max_phases": max_phases, "events": events,
        "sensitivities": sensitivities, "dtype": dtype, "threads": threads, "progress": progress,
    }  # fmt: skip
    if "stance" in robot.solver.can:
        states: dict[str, Any] = {"compression" if axis == "y" else axis: each for axis, each in axes.items()}
        others: dict[str, Any] = {"v2": 0.0, **states, **how, **fields}
        return solve_stances(robot, **others)
    asked = _how(
        "motion", robot.solver, u, u_times, times, max_phases, events, sensitivities, False, dtype, threads, progress
    )
    layout, names = layout_of(robot.solver), {axis: name for name, axis in axes_by_name(robot.solver.facts).items()}
    names |= {name: name for name in ("u", "horizon")}
    found = _solved(robot, asked, {**axes, "u": u, "horizon": horizon}, names, fields)
    of, kinds = found.of, robot.solver.package.records.EVENTS
    return Motions(
        of["status"], of["duration"], layout.state(*(of[axis] for axis in layout.axes)), of["event_count"],
        found.times, found.kinds, found.derivatives, found.labels, layout.unit_of, kinds, **found.over_time,
    )  # fmt: skip


def named_columns(robot: Robot, start: Mapping[str, ArrayLike] | None) -> dict[str, ArrayLike]:
    """What a start has, by the engine's axes; HopformError for a name that the model does not have."""
    axes = axes_by_name(robot.solver.facts)
    return {axis_of(robot.solver.facts, axes, name): value for name, value in mapping("start", start, 64).items()}


# ---- what the batches share ----


class _How(NamedTuple):
    """What is solved, a "stance" or a "motion", and how, checked."""

    what: str
    most: int
    events: bool
    sensitivities: Names
    compressions: bool
    real: np.dtype[Any]
    threads: int
    progress: Progress | None
    u_times: NDArray[Any] | None
    times: NDArray[Any] | None
    further: tuple[str, str]
    """the dimensions of steps and of times"""
    is_plain: bool
    """whether no more is asked than how each ends, and its events"""


def _how(
    what: str, solver: Solver, u: object, u_times: Any, times: Any, max_phases: int, events: bool, sensitivities: Any,
    compressions: bool, dtype: Any, threads: int, progress: Progress | None,
) -> _How:  # fmt: skip
    """What is asked of a batch; HopformError for what is not allowed, pairs (t, u) as steps of the input among that."""
    real = precision_of(dtype)
    most, workers = whole("max_phases", max_phases), whole("threads", threads, most=MOST_THREADS)
    with_events = flag("events", events)
    largest = flag("compression_max", compressions)
    derived: Any = sensitivities
    if isinstance(sensitivities, (bool, np.bool_)):
        derived = flag("sensitivities", derived)
    function("progress", progress)
    several = type(u) in (list, tuple) and any(isinstance(each, tuple) for each in cast(Sequence[Any], u))
    if callable(u) or (several and u_times is None):
        unit = input_unit(solver)
        laws = ", laws (controllers.Sampled) for simulate" if what == "stance" else ""
        allowed = f"u must be a number per {what} in {unit}; steps are its last axis beside u_times"
        raise HopformError(f"{allowed}, steps (t, u) are for solve_{what}{laws}, got {shown(u)}")
    how = what, most, with_events, derived, largest, real, workers, progress
    if u_times is None and times is None:
        return _How(*how, None, None, ("step", "time"), derived is False and not largest)
    begins, seen = _instants("u_times", u_times, real), _instants("times", times, real)
    if begins is not None:
        _check_begins(begins)
    if seen is not None:
        refuse_any("times", seen, seen >= 0.0, lambda bad: f"must be >= 0 s, got {bad!r}")
    further = _dimension_of_steps(u, u_times), _dimension_of(times, "time")
    if begins is not None and seen is not None and further[0] == further[1]:
        raise HopformError(f"u_times and times must have two dimensions, got {further[0]} for both")
    return _How(*how, begins, seen, further, False)


def _instants(name: str, value: Any, real: np.dtype[Any]) -> NDArray[Any] | None:
    """Times of one dimension in a precision; HopformError for what is none."""
    if value is None:
        return None
    array = numbers(name, value, "s")
    if array.ndim != 1:
        raise HopformError(f"{name} must have one dimension, got shape {array.shape}")
    with np.errstate(over="ignore"):
        own = array.astype(real)
    refuse_any(name, array, np.isfinite(own), lambda bad: f"must be finite in {real}, got {bad!r} s")
    own.setflags(write=False)
    return own


def _check_begins(begins: NDArray[Any]) -> None:
    """HopformError unless steps begin at 0 and then one after the other."""
    if not 0 < begins.size <= records.MOST_STEPS:
        raise HopformError(f"u_times must be 1 to {records.MOST_STEPS} times, got {begins.size}")
    first = np.arange(begins.size) > 0
    refuse_any("u_times", begins, first | (begins == 0.0), lambda bad: f"must be 0 s, where u begins, got {bad!r}")
    rises = np.append(True, np.diff(begins) > 0.0)
    refuse_any("u_times", begins, rises, lambda bad: f"must be > the one before, got {bad!r} s")


def _dimension_of(value: Any, word: str, place: int = 0) -> str:
    """The dimension of a DataArray at a place, else a word."""
    return str(value.dims[place]) if is_labelled(value) and value.ndim else word


def _dimension_of_steps(u: Any, u_times: Any) -> str:
    """The dimension of u that is its steps: that of u_times, or the last one; HopformError for a DataArray without."""
    dim = _dimension_of(u_times, _dimension_of(u, "step", -1))
    if is_labelled(u) and dim not in u.dims:
        raise HopformError(f"u must have the dimension {dim} of u_times, got {', '.join(map(str, u.dims)) or 'none'}")
    return dim


class _Found(NamedTuple):
    """What a batch has found, in the shape of its inputs, with the labels of these; None for what was not asked for."""

    labels: Labels | None
    of: dict[str, NDArray[Any]]
    times: NDArray[Any] | None
    kinds: NDArray[np.int8] | None
    derivatives: ManySensitivities | None
    compressions: NDArray[Any] | None
    over_time: dict[str, Any]
    """fields of a result"""


def _solved(
    robot: Robot, how: _How, inputs: Mapping[str, ArrayLike], names: Mapping[str, str], fields: dict[str, ArrayLike]
) -> _Found:
    """The motions from inputs by the engine's axes, u and horizon, which people know by `names`, and from fields of the
    robot.
    """
    if "x2" in inputs and "y" in inputs:
        both = " and ".join(f"{names[axis]} = {shown(inputs[axis])}" for axis in ("x2", "y"))
        raise HopformError(f"give either {names['x2']} or {names['y']}, got {both}")
    units, of_axes = units_of(robot.solver)
    further = NO_DIMS if how.u_times is None else {"u": how.further[0]}
    plain, labels = labelled({names[axis]: inputs[axis] for axis in inputs} | fields, units, further)
    if labels is not None:
        _check_dimensions(how, labels)
    columns = {axis: column_of(names[axis], plain[names[axis]], of_axes[axis]) for axis in inputs}
    if not robot.solver.facts.inputs:
        without = f"must be 0: the model {robot.solver.name} has no input"
        refuse_any("u", columns["u"], np.equal(columns["u"], 0.0), lambda bad: f"{without}, got {bad!r}")
    steps = None if how.u_times is None else _steps_of(columns["u"], how.u_times)
    if steps is not None:
        columns["u"] = steps[..., 0]  # its shape is that of the others
    robots = robot_columns(robot, fields, plain, how.what)
    by_field = {name: getattr(robots, name) for name in fields}
    x2_is_given = "x2" in inputs or (how.what == "motion" and "y" not in inputs)
    by = None if how.is_plain or isinstance(how.sensitivities, bool) else _chosen(how, robot, x2_is_given)
    each = EACH if how.is_plain else _memory_of(robot, how, by)
    shape = shape_of({names[axis]: columns[axis] for axis in columns} | by_field, each, how.what)
    given: dict[str, Column] = {"x1": 0.0, "v1": 0.0, "v2": 0.0, **columns}
    check_states(robot, given, robots)
    given["y"] = _compression(robot, how.what, given, robots)
    job = _Job((*(given[axis] for axis in STATES), *robots), shape, math.prod(shape), how, steps, by, each)
    found = job.run(robot.solver)
    return _put(robot, job, found, labels, given["x1"], x2_is_given, robots)


def _put(
    robot: Robot, job: "_Job", found: "_Solved", labels: Labels | None, x1: Any, x2_is_given: bool, robots: Any
) -> _Found:
    """What has been found, as people know it; x1: at the start."""
    how, solver, over_time = job.how, robot.solver, dict[str, Any]()
    about = x1, x2_is_given, solver, robots, job.by
    of = package.by_name(found.results, job.shape)
    shaped = {} if how.is_plain else {name: _in_shape(each, job.shape) for name, each in found.readings.items()}
    derivatives = None
    if "sensitivities" in shaped:
        derived = {"stance": of_stance, "motion": of_motion}[how.what]
        derivatives = derived(ManySensitivities, shaped["sensitivities"], *about)
    if job.steps is not None:
        of_input = {"u": job.steps, "u_times": how.u_times, "_unit_of_input": input_unit(solver)}
        over_time |= {**of_input, "_further": how.further}
    if how.times is not None:
        at = records.LegState(*np.moveaxis(shaped["states"], -1, 0))
        over_time |= {"times": how.times, "states": _states_of(robot, how, at, robots), "_further": how.further}
        if "tangents" in shaped:
            over_time["state_sensitivities"] = at_times(at, shaped["tangents"], *about)
    times, kinds = (None, None) if found.events is None else (_in_shape(each, job.shape) for each in found.events)
    return _Found(labels, of, times, kinds, derivatives, shaped.get("compressions"), over_time)


def _in_shape(values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """Values with the motions on the first axis, in the shape of the inputs."""
    return values.reshape((*shape, *values.shape[1:]))


def _states_of(robot: Robot, how: _How, at: Any, robots: Any) -> Any:
    """States at times, as the ending shows its own."""
    over = type(robots)(*(each[..., np.newaxis] if np.ndim(each) else each for each in robots))
    layout = LAYOUT._replace(state=state_of_leg(robot.solver)) if how.what == "stance" else layout_of(robot.solver)
    height = body_height(robot, how.real, at.x1, at.y, over) if "x2" in layout.axes else None
    return layout.state(*(height if axis == "x2" else getattr(at, axis) for axis in layout.axes))


def _check_dimensions(how: _How, labels: Labels) -> None:
    """HopformError where a dimension of the inputs is also that of steps or times."""
    for name, dim, of in zip(("u_times", "times"), how.further, (how.u_times, how.times), strict=True):
        if of is not None and dim in labels.dims:
            raise HopformError(f"{name}: the dimension {dim} must be none of the inputs, got {', '.join(labels.dims)}")


def _steps_of(u: Column, begins: NDArray[Any]) -> NDArray[Any]:
    """The input by steps, whose axis is the last one, as an array of its own; HopformError for another number of them."""
    steps = np.array(u, order="C")
    if steps.ndim == 0 or steps.shape[-1] != begins.size:
        words = f"u must have {begins.size} on its last axis, a step for each of u_times"
        raise HopformError(f"{words}, got {f'shape {steps.shape}' if steps.ndim else f'{float(steps)!r}'}")
    steps.setflags(write=False)
    return steps


def _chosen(how: _How, robot: Robot, x2_is_given: bool) -> Columns:
    """The columns of names."""
    count = 1 if how.u_times is None else how.u_times.size
    return chosen_columns(how.sensitivities, "sensitivities", robot.solver, x2_is_given, count)


def _memory_of(robot: Robot, how: _How, by: Columns | None) -> int:
    """[B] that a motion takes; HopformError for more than there is for all."""
    steps, times = (0 if of is None else of.size for of in (how.u_times, how.times))
    columns = _columns_of(robot.solver, how, by)
    each = memory_of_each(len(robot.solver.package.elements.ROWS), columns, steps, times)
    if each > MEMORY:
        asked = f"{times} times by {columns} columns of derivatives"
        raise HopformError(f"a {how.what} must take at most {MEMORY} bytes, got {each}: {asked}")
    return each


def memory_of_each(rows: int, columns: int, steps: int, times: int) -> int:
    """[B] that a motion takes with rows and columns of derivatives, steps of its input and times: derivatives twice while
    they are put into the coordinates of the inputs, those of states three times.
    """
    return EACH + 8 * steps + 64 * times + (16 * rows + 24 * len(AXES) * times) * columns


def _columns_of(solver: Solver, how: _How, by: Columns | None) -> int:
    """How many columns of derivatives the library computes."""
    if how.sensitivities is False:
        return 0
    return len(solver.package.elements.COLUMNS) if by is None or by.solved is None else len(by.solved)


# ---- chunk by chunk ----


class _Solved(NamedTuple):
    """What the library has found, the motions on the first axis; events: times and kinds, None if not asked for."""

    results: package.Results
    readings: dict[str, NDArray[Any]]
    events: tuple[NDArray[Any], NDArray[np.int8]] | None


class _Job(NamedTuple):
    """Checked inputs; `columns` are the states, u, horizon, then the robot's fields."""

    columns: tuple[Column, ...]
    shape: tuple[int, ...]
    size: int
    how: _How
    steps: NDArray[Any] | None
    """in place of the column u, with a further axis"""
    by: Columns | None
    each: int
    """[B] that a motion takes"""

    def run(self, solver: Solver) -> _Solved:
        """Solve them all."""
        how, library = self.how, solver.compiled()
        found = package.results_like(self.size, how.real), self._room(solver)
        back, asked = self._asked()
        lists: package.Events = []

        def solve(part: slice) -> int:
            results = found[0][0][:, part], found[0][1][:, part]
            readings = {name: reading[part] for name, reading in found[1].items()}
            events = library.solve_columns(self._chunk(part), results, readings, how.most, how.events, asked)
            if how.events:
                lists.extend([(lane + part.start, t, kind) for lane, t, kind in events])
            for name in ("states", "tangents") if back is not None else ():
                if name in readings:
                    readings[name][...] = readings[name][:, back]
            return int(part.stop - part.start)

        length = min(CHUNK, CHUNK_MEMORY // self.each) or 1
        in_parts(solve, self.size, length, how.threads, how.progress)
        return _Solved(*found, joined(found[0][0][-1], lists, how.real) if how.events else None)

    def _room(self, solver: Solver) -> dict[str, NDArray[Any]]:
        """Where what is asked of the motions besides is put."""
        how, shapes = self.how, dict[str, tuple[int, ...]]()
        if how.is_plain:
            return {}
        columns = _columns_of(solver, how, self.by)
        if how.compressions:
            shapes["compressions"] = ()
        if how.sensitivities is not False:
            shapes["sensitivities"] = len(solver.package.elements.ROWS), columns
        if how.times is not None:
            shapes["states"] = how.times.size, len(AXES)
            if how.sensitivities is not False:
                shapes["tangents"] = how.times.size, len(AXES), columns
        return {name: np.empty((self.size, *shape), how.real) for name, shape in shapes.items()}

    def _asked(self) -> tuple[NDArray[np.intp] | None, package.Asked]:
        """What the library is asked, and where each time is among those in their order, None where they are in it."""
        how, back = self.how, None
        columns = None if self.by is None else self.by.solved
        if how.times is None and how.u_times is None and columns is None:
            return None, package.ASKED
        times = how.times
        if times is not None and bool(np.any(np.diff(times) < 0.0)):
            order = np.argsort(times, kind="stable")
            back, times = np.argsort(order, kind="stable"), times[order]
        return back, package.Asked(how.u_times, times, columns)

    def _chunk(self, part: slice) -> list[Column]:
        """The columns of some motions: numbers stay numbers."""
        columns = columns_of_part(self.columns, self.shape, part, self.how.real)
        if self.steps is not None:
            columns[STATES.index("u")] = self._steps(self.steps, part)
        return columns

    def _steps(self, u: NDArray[Any], part: slice) -> NDArray[Any]:
        """The steps of some motions, (motions, steps), which lie side by side."""
        count, size = u.shape[-1], part.stop - part.start
        if u.size == count:
            return np.broadcast_to(np.asarray(u.reshape(count), self.how.real), (size, count))
        if u.shape[:-1] == self.shape:
            return np.asarray(u.reshape(-1, count)[part], self.how.real)
        index = np.unravel_index(np.arange(int(part.start), int(part.stop)), self.shape)
        return np.asarray(np.broadcast_to(u, (*self.shape, count))[index], self.how.real)


# ---- what goes in ----


def _compression(robot: Robot, what: str, given: dict[str, Column], robots: Any) -> Column:
    """The compression at the start from x1 and from x2 or itself. Of a leg that touches down it is 0 where neither is
    given, and exactly 0 where these say so within rounding; else x2 is 0 where neither is given.
    """
    x1, formulas = given["x1"], robot.solver.package.formulas
    if what == "motion":
        return given["y"] if "y" in given else compression_of(robot, x1, given.get("x2", 0.0), robots)
    if "x2" not in given and "y" not in given:
        return 0.0
    letters, rest = formulas.letters_of(robots), formulas.compression_at_rest(robots)  # as for one stance, in double
    place, L0, c = np.asarray(x1, float), letters.L0, letters.c
    height = np.asarray(given["x2"], float) if "x2" in given else None
    y = np.asarray(given["y"], float) if height is None else compression_of(robot, place, height, robots)
    y = np.where(np.abs(y) <= TOUCHING_ULP * np.spacing(np.abs(L0)), 0.0, y)
    if height is None:
        refuse_any("compression", y, y >= 0.0, lambda bad: f"must be >= 0 m (a contact cannot pull), got {bad!r}")
    else:
        highest = float(np.max(place + (L0 + c - rest), initial=-math.inf))
        allowed = f"must be <= x1 + L0 + c, at most {highest!r} m (a contact cannot pull)"
        refuse_any("x2", height, y >= 0.0, lambda bad: f"{allowed}, got {bad!r}")
    return y
