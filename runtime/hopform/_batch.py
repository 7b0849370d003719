"""Many stances at once: everything broadcasts, states, currents and the fields of the robot alike.

Stances are solved in chunks of `CHUNK`, so that memory stays bounded, progress can be shown, and Ctrl-C
is heard.
"""

import dataclasses
import math
import sys
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._checks import MEMORY, array_of, flag, function, in_stroke, mapping, numbers, refuse_any, shown, whole
from hopform._errors import HopformError
from hopform._motion import (
    TOUCHING_ULP,
    State,
    axes_by_name,
    axis_of,
    compression_of,
    input_unit,
    layout_of,
    precision_of,
    state_of_leg,
)
from hopform._robots import Robot, checked_robot, nearest
from hopform._sensitivities import COLUMNS, ManySensitivities, of_motion, of_stance
from hopform._show import UNITS, Arrays, Card, Curve, Figures, Shown, counted, span
from hopform._solver import package
from hopform._solver.c import C
from hopform._solver.choice import Solver
from hopform._solver.package import CHUNK, EVENTS, MAX_PHASES, ROWS, STATES, STATUS, Column, checked, records
from hopform._stance import LAYOUT

Progress = Callable[[int, int], object]

EACH, EACH_DIFFERENTIATED = 128, 128 + 16 * len(ROWS) * len(COLUMNS)
"""[B] the results of a stance; with its derivatives, twice while they are put into the coordinates of the inputs."""
MOST_THREADS = 1024
CURVE = 400
"""Stances whose apexes a batch draws in a notebook at most."""
_UNITS = LAYOUT.unit_of
NAMES = {"x1": "x1", "v1": "v1", "v2": "v2", "x2": "x2", "y": "compression", "u": "u", "horizon": "horizon"}
"""The names of what a stance is solved from by the engine's."""
INPUTS = {
    "stance": tuple(NAMES.values()),
    "motion": ("start", "u", "horizon"),
    "flight": ("x1", "v1", "v2", "x2", "compression", "gains", "horizon"),
    "hop": ("height", "start", "v2", "x1", "v1", "compression", "u", "ground", "hops", "gains", "horizon"),
}
"""What is solved from, beside fields of the robot."""


class Labels(NamedTuple):
    """Dimensions of inputs that are labelled, in their order, with the coordinates that some have, and their units."""

    dims: tuple[str, ...]
    coords: dict[str, NDArray[Any]]
    units: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, repr=False, eq=False)
class Motions(Shown):
    """Motions, solved; every array has the shape that the inputs broadcast to. Times in s, states in the model's units.

    status: how each ended, as a number, negative where the numbers left the range of the precision (NaN in
    every other field there); `words` has them as text. duration: time of the ending. end: the state there.
    event_count: how many events. event_time, event_kind: the events, with a further last axis, NaN and 0 behind the
    last one; None unless asked for; `event_words` has the kinds as text. sensitivities: the derivatives as
    `Motion.sensitivities` has them, as arrays; None unless asked for.
    """

    status: NDArray[np.int32]
    duration: NDArray[np.floating]
    end: Any
    event_count: NDArray[np.int32]
    event_time: NDArray[np.floating] | None
    event_kind: NDArray[np.int8] | None
    sensitivities: ManySensitivities | None = None
    labels: Labels | None = None
    """of the inputs, where they are DataArrays of xarray: `to_xarray` has them again"""
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
        u = [("precision", str(self.duration.dtype)), ("events", span(self.event_count))]
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


def labelled(inputs: Mapping[str, Any], units: Mapping[str, str]) -> tuple[dict[str, Any], Labels | None]:
    """Inputs as arrays that broadcast by the names of their dimensions, where some are DataArrays; else as they are.

    units: those of the model. HopformError for coordinates of one name that differ, and for a plain array beside a
    DataArray.
    """
    xarray: Any = sys.modules.get("xarray")  # a DataArray is there only where xarray is
    known = {} if xarray is None else {k: each for k, each in inputs.items() if isinstance(each, xarray.DataArray)}
    if not known:
        return dict(inputs), None
    dims = tuple(dict.fromkeys(dim for each in known.values() for dim in each.dims))
    coords, arrays = dict[str, NDArray[Any]](), dict[str, Any]()
    for name, each in inputs.items():
        if name not in known:
            if np.ndim(each):
                raise HopformError(f"{name} must be a number or a DataArray beside other DataArrays, got an array")
            arrays[name] = each
            continue
        for dim in each.dims:
            if dim in each.coords:
                own = coords.setdefault(str(dim), each.coords[dim].values)
                if not np.array_equal(own, each.coords[dim].values):
                    raise HopformError(f"{name} must have the coordinates {dim} of the other inputs, got others")
        arrays[name] = each.expand_dims([dim for dim in dims if dim not in each.dims]).transpose(*dims).values
    return arrays, Labels(tuple(map(str, dims)), coords, {**UNITS, **units})


def words_of(codes: NDArray[Any], words: Mapping[int, str]) -> NDArray[np.str_]:
    """The words of numbers that are near to each other, "" where there is none."""
    first = min(words)
    return np.asarray(np.array([words.get(code, "") for code in range(first, max(words) + 1)])[codes - first])


def some_of(x: Column, shape: tuple[int, ...], part: slice, real: np.dtype[Any]) -> Column:
    """Some of the numbers that a column has in a shape, a number where it has but one, a view where they lie in one
    piece.
    """
    if not isinstance(x, np.ndarray):
        return float(x)
    if x.size == 1:
        return float(x.item())
    whole = x.shape == shape and x.flags.c_contiguous and x.flags.aligned
    return np.asarray(x.reshape(-1)[part] if whole else np.broadcast_to(x, shape).flat[part], dtype=real)


def columns_of_part(
    columns: Iterable[Column], shape: tuple[int, ...], part: slice, real: np.dtype[Any]
) -> list[Column]:
    """Columns of some of what is solved, flat and in a precision: numbers stay numbers."""
    return [x if type(x) is float else some_of(x, shape, part, real) for x in columns]


class _Job(NamedTuple):
    """Checked inputs and where the results go, flat; `columns` are the states, u, horizon, then the robot's fields."""

    columns: tuple[Column, ...]
    shape: tuple[int, ...]
    size: int
    max_phases: int
    real: np.dtype[Any]
    results: package.Results
    readings: dict[str, NDArray[Any]]

    def chunk(self, part: slice) -> list[Column]:
        """The columns of some stances: numbers stay numbers."""
        return columns_of_part(self.columns, self.shape, part, self.real)


def solve_stances(
    robot: Robot,
    *,
    v2: ArrayLike,
    x1: ArrayLike = 0.0,
    v1: ArrayLike = 0.0,
    x2: ArrayLike | None = None,
    compression: ArrayLike | None = None,
    u: ArrayLike = 0.0,
    horizon: ArrayLike = 2.0,
    max_phases: int = MAX_PHASES,
    events: bool = False,
    sensitivities: bool = False,
    compression_max: bool = False,
    dtype: Any = np.float64,
    threads: int = 1,
    progress: Progress | None = None,
    **fields: ArrayLike,
) -> Batch:
    """The stances of all combinations that the inputs broadcast to, each as `solve_stance` gives it.

    Inputs as for `solve_stance`, as arrays; u is a constant current per stance. Any field of the robot may be given
    as an array too: `solve_stances(robot, v2=-2.0, k=np.linspace(800, 1600, 9))`. events: list them all.
    DataArrays of xarray broadcast by the names of their dimensions, and `to_xarray` of the answer has their
    coordinates. sensitivities: derivatives through the events, 140 numbers a stance. compression_max: the largest
    compression of each. threads: how many solve at a time. progress: called with the number of stances done and their
    total, now and then; what it raises ends the batch.
    Raises HopformError, which names field, index, value and what is allowed.

    >>> import numpy as np
    >>> from hopform import load_robot
    >>> batch = solve_stances(load_robot("hopper_c"), v2=-1.93, u=np.array([0.0, 2.0, 3.0]), k=[[1200.0], [1e4]])
    >>> batch.apex.shape, batch.words[0].tolist()
    ((2, 3), ['takeoff', 'takeoff', 'takeoff'])
    """
    checked_robot(robot, "stance")
    how = _how(
        "stance",
        u,
        input_unit(robot.solver),
        max_phases,
        events,
        sensitivities,
        compression_max,
        dtype,
        threads,
        progress,
    )
    inputs = {"x1": x1, "v1": v1, "v2": v2, "u": u, "horizon": horizon}
    inputs |= {} if x2 is None else {"x2": x2}
    inputs |= {} if compression is None else {"y": compression}
    found = _solved(robot, how, inputs, NAMES, fields)
    of, end = found.of, state_of_leg(robot.solver)(*(found.of[name] for name in State._fields))
    return Batch(
        of["status"], of["duration"], end, of["event_count"], found.times, found.kinds, found.derivatives,
        found.labels, _UNITS, EVENTS, found.compressions, apex=of["apex"], aed=of["aed"],
    )  # fmt: skip


def solve_motions(
    robot: Robot,
    *,
    start: Mapping[str, ArrayLike] | None = None,
    u: ArrayLike = 0.0,
    horizon: ArrayLike = 2.0,
    max_phases: int = MAX_PHASES,
    events: bool = False,
    sensitivities: bool = False,
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
    """
    axes = named_columns(checked_robot(robot), start)
    how: dict[str, Any] = {
        "u": u, "horizon": horizon, "max_phases": max_phases, "events": events, "sensitivities": sensitivities,
        "dtype": dtype, "threads": threads, "progress": progress,
    }  # fmt: skip
    if "stance" in robot.solver.can:
        states: dict[str, Any] = {"compression" if axis == "y" else axis: each for axis, each in axes.items()}
        others: dict[str, Any] = {"v2": 0.0, **states, **how, **fields}
        return solve_stances(robot, **others)
    unit = input_unit(robot.solver)
    asked = _how("motion", u, unit, max_phases, events, sensitivities, False, dtype, threads, progress)
    layout, names = layout_of(robot.solver), {axis: name for name, axis in axes_by_name(robot.solver.facts).items()}
    names |= {name: name for name in ("u", "horizon")}
    found = _solved(robot, asked, {**axes, "u": u, "horizon": horizon}, names, fields)
    of, kinds = found.of, robot.solver.package.records.EVENTS
    return Motions(
        of["status"], of["duration"], layout.state(*(of[axis] for axis in layout.axes)), of["event_count"],
        found.times, found.kinds, found.derivatives, found.labels, layout.unit_of, kinds,
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
    sensitivities: bool
    compressions: bool
    real: np.dtype[Any]
    threads: int
    progress: Progress | None

    @property
    def each(self) -> int:
        """[B] that a motion takes."""
        return EACH_DIFFERENTIATED if self.sensitivities else EACH


def _how(
    what: str, u: object, unit: str, max_phases: int, events: bool, sensitivities: bool, compressions: bool,
    dtype: Any, threads: int, progress: Progress | None,
) -> _How:  # fmt: skip
    """What is asked of a batch, whose input has a unit; HopformError for what is not allowed, steps of it among that."""
    real = precision_of(dtype)
    most, workers = whole("max_phases", max_phases), whole("threads", threads, most=MOST_THREADS)
    with_events = flag("events", events)
    largest = flag("compression_max", compressions)
    derived = flag("sensitivities", sensitivities)
    function("progress", progress)
    several = type(u) in (list, tuple) and any(isinstance(each, tuple) for each in cast(Sequence[Any], u))
    if several or callable(u):
        laws = ", laws (controllers.Sampled) for simulate" if what == "stance" else ""
        raise HopformError(
            f"u must be a number per {what} in {unit}; steps (t, u) are for solve_{what}{laws}, got {shown(u)}"
        )
    return _How(what, most, with_events, derived, largest, real, workers, progress)


class _Found(NamedTuple):
    """What a batch has found, in the shape of its inputs, with the labels of these; None for what was not asked for."""

    labels: Labels | None
    of: dict[str, NDArray[Any]]
    times: NDArray[Any] | None
    kinds: NDArray[np.int8] | None
    derivatives: ManySensitivities | None
    compressions: NDArray[Any] | None


def _solved(
    robot: Robot, how: _How, inputs: Mapping[str, ArrayLike], names: Mapping[str, str], fields: dict[str, ArrayLike]
) -> _Found:
    """The motions from inputs by the engine's axes, u and horizon, which people know by `names`, and from fields of the
    robot.
    """
    if "x2" in inputs and "y" in inputs:
        both = " and ".join(shown(inputs[axis]) for axis in ("x2", "y"))
        raise HopformError(f"either {names['x2']} or {names['y']} may be given, got {names['x2']} = {both}")
    units, of_axes = units_of(robot.solver)
    plain, labels = labelled({names[axis]: inputs[axis] for axis in inputs} | fields, units)
    columns = {axis: column_of(names[axis], plain[names[axis]], of_axes[axis]) for axis in inputs}
    robots = robot_columns(robot, fields, plain, how.what)
    by_field = {name: getattr(robots, name) for name in fields}
    shape = shape_of({names[axis]: columns[axis] for axis in columns} | by_field, how.each, how.what)
    given: dict[str, Column] = {"x1": 0.0, "v1": 0.0, "v2": 0.0, **columns}
    check_states(robot, given, robots)
    given["y"] = _compression(robot, how.what, given, robots)
    size = math.prod(shape)
    library = robot.solver.compiled()
    results = package.results_like(size, how.real)
    readings: dict[str, NDArray[Any]] = {}  # a parametrised dict takes longer than a motion
    if how.sensitivities:
        readings["sensitivities"] = np.empty((size, *_matrix_of(robot)), how.real)
    if how.compressions:
        readings["compressions"] = np.empty(size, how.real)
    job = _Job((*(given[axis] for axis in STATES), *robots), shape, size, how.most, how.real, results, readings)
    times, kinds = _run(job, library, how.events, how.threads, how.progress)
    of = package.by_name(results, shape)
    listed = (times, kinds, readings.get("sensitivities"), readings.get("compressions"))
    times, kinds, matrices, compressions = (None if each is None else _in_shape(each, shape) for each in listed)
    derivatives = None
    if matrices is not None:
        x2_is_given = "x2" in inputs or (how.what == "motion" and "y" not in inputs)
        derived = {"stance": of_stance, "motion": of_motion}[how.what]
        derivatives = derived(ManySensitivities, matrices, given["x1"], x2_is_given, robot.solver, robots)
    return _Found(labels, of, times, kinds, derivatives, compressions)


def _matrix_of(robot: Robot) -> tuple[int, int]:
    """The rows and columns of derivatives."""
    elements = robot.solver.package.elements
    return len(elements.ROWS), len(elements.COLUMNS)


def _in_shape(values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """Values with the stances on the first axis, in the shape of the inputs."""
    return values.reshape((*shape, *values.shape[1:]))


# ---- chunk by chunk ----


def _run(
    job: _Job, library: C, events: bool, threads: int, progress: Progress | None
) -> tuple[NDArray[Any], NDArray[np.int8]] | tuple[None, None]:
    lists: package.Events = []

    def solve(part: slice) -> int:
        results = job.results[0][:, part], job.results[1][:, part]
        readings = {name: reading[part] for name, reading in job.readings.items()}
        found = library.solve_columns(job.chunk(part), results, readings, job.max_phases, events)
        if events:
            lists.extend([(lane + part.start, t, kind) for lane, t, kind in found])
        return int(part.stop - part.start)

    in_parts(solve, job.size, CHUNK, threads, progress)
    return joined(job.results[0][-1], lists, job.real) if events else (None, None)


def in_parts(solve: Callable[[slice], int], size: int, length: int, threads: int, progress: Progress | None) -> None:
    """Solve all of a batch part by part, on so many threads: `solve` says how many a part had."""

    def count(solved: Iterable[int]) -> None:
        done = 0
        for each in solved:
            done += each
            if progress is not None:
                progress(done, size)

    parts = [slice(first, min(first + length, size)) for first in range(0, size, length)]
    if min(threads, len(parts)) <= 1:
        count(map(solve, parts))
    else:
        with ThreadPoolExecutor(threads) as pool:
            try:
                count(pool.map(solve, parts))
            finally:
                pool.shutdown(wait=False, cancel_futures=True)


def joined(
    counts: NDArray[np.intc], lists: package.Events, real: np.dtype[Any]
) -> tuple[NDArray[Any], NDArray[np.int8]]:
    """The events of all that were solved, a row each, NaN and 0 behind the last one; how many each has."""
    longest = int(counts.max(initial=0))
    if counts.size * longest > MEMORY // 16:
        raise HopformError(f"events can be listed of at most {MEMORY // 16 // longest} of these, got {counts.size}")
    times = np.full((counts.size, longest), np.nan, real)
    kinds = np.zeros(times.shape, np.int8)
    for lane, t, kind in lists:
        place = np.arange(lane.size) - np.searchsorted(lane, lane)
        times[lane, place], kinds[lane, place] = t, kind
    return times, kinds


# ---- what goes in ----


@lru_cache(maxsize=64)
def units_of(solver: Solver) -> tuple[dict[str, str], dict[str, str]]:
    """The units of what a solver takes by the names of its model, and by the engine's axes, the input, u, among both."""
    drive = {"u": input_unit(solver)}
    axes = {axis: str(table["unit"]) for axis, table in solver.facts.axes.items()}
    return solver.facts.units | drive, UNITS | axes | drive


def column_of(name: str, value: object, unit: str) -> Column:
    """The value as a float or an array of finite numbers; HopformError names the first that is none."""
    if type(value) is float and math.isfinite(value):
        return value
    return numbers(name, value, unit)


def check_names(names: Iterable[str], known: Iterable[str], what: str, inputs: Iterable[str]) -> None:
    """HopformError for the first name that is not known, or an input of what is solved."""
    known = [*known]
    for name in names:
        if name not in known:
            hint = nearest(name, [*known, *inputs])
            raise HopformError(f"{name!r} is neither an input of a {what} nor a field of the robot{hint}")


def robot_columns(robot: Robot, fields: Collection[str], plain: Mapping[str, Any], what: str) -> Any:
    """The robot's parameters, as arrays those of `fields` in place of its own; HopformError for one out of its domain."""
    if not fields:
        return robot.parameters
    columns: dict[str, Column] = {}
    check_names(fields, robot.parameters._fields, what, INPUTS[what])
    for field in robot.solver.package.records.ROBOT_FIELDS:
        name = field.name
        if name in fields:
            columns[name] = array = array_of(name, plain[name], field.unit)

            def reason(bad: float, name: str = name, field: records.Field = field) -> str:
                return (checked.refusal(field, bad) or f"{name} is not allowed: {bad!r}").removeprefix(f"{name} ")

            refuse_any(name, array, checked.inside(field.domain, array), reason)
    return cast(Any, robot.parameters)._replace(**columns)


def shape_of(inputs: Mapping[str, Column], each: int, what: str) -> tuple[int, ...]:
    """The shape that the inputs broadcast to; HopformError if they do not, or to more than fits into memory, where each
    of what is solved takes so many bytes.
    """
    shapes = {name: column.shape for name, column in inputs.items() if isinstance(column, np.ndarray) and column.shape}
    if not shapes:
        return ()
    try:
        shape = np.broadcast_shapes(*shapes.values())
    except ValueError:
        raise HopformError(f"the shapes of the inputs must broadcast, got {shapes}") from None
    if math.prod(shape) > (most := MEMORY // each):
        raise HopformError(f"the inputs must broadcast to at most {most} {what}s, got shape {shape}")
    return shape


def check_states(robot: Robot, given: Mapping[str, Column], robots: Any) -> None:
    """HopformError for a horizon that is not positive, for stops in the wrong order, and for x1 beyond one of them."""
    horizon, x1 = given["horizon"], given["x1"]
    refuse_any("horizon", horizon, horizon > 0.0, lambda bad: f"must be > 0 s, got {bad!r}")
    package = robot.solver.package
    low, high = package.formulas.lower_stop(robots), package.formulas.upper_stop(robots)
    lower, upper, unit = package.records.ENDS
    refuse_any(lower, low, low <= high, lambda bad: f"must be <= {upper} {unit}, got {bad!r}")
    place = robot.solver.facts.axes.get("x1", {"name": "x1", "unit": "m"})  # of a leg alone it never moves

    def reason(bad: float) -> str:
        stroke = in_stroke(float(np.min(low)), float(np.max(high)), place["unit"])
        return f"must be {stroke}, got {bad!r}"

    refuse_any(str(place["name"]), x1, (low <= x1) & (x1 <= high), reason)


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
        refuse_any("compression", y, y >= 0.0, lambda bad: f"must be >= 0 m, or the spring pulls, got {bad!r}")
    else:
        highest = float(np.max(place + (L0 + c - rest), initial=-math.inf))
        allowed = f"must be <= x1 + L0 + c (at most {highest!r} m), or the spring pulls"
        refuse_any("x2", height, y >= 0.0, lambda bad: f"{allowed}, got {bad!r}")
    return y
