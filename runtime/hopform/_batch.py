"""Many stances at once: everything broadcasts, states, currents and the fields of the robot alike.

Stances are solved in chunks of `ufuncs.CHUNK`, so that memory stays bounded, progress can be shown, and Ctrl-C
is heard. Without event lists a chunk is one call of the ufunc `hopform.ufuncs.stance`.
"""

import difflib
import math
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass
from numbers import Real
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._checks import real, shown, whole
from hopform._errors import HopformError
from hopform._robots import Robot
from hopform._sensitivities import COLUMNS, ManySensitivities, of_matrices
from hopform._solver.columns import CHUNK, MAX_PHASES, RESULTS, STATES, STATUS, Events, results_like
from hopform._solver.library import Backend
from hopform._solver.package import EVENTS, ROBOT_FIELDS, ROWS, Field, checked
from hopform._solver.protocol import BackEnd
from hopform._stance import State, precision_of

Progress = Callable[[int, int], object]

_TOUCHING_ULP = 4.0
_UNITS = {"x1": "m", "v1": "m/s", "v2": "m/s", "x2": "m", "u": "A", "horizon": "s"}


@dataclass(frozen=True)
class Batch:
    """Stances, solved; every array has the shape that the inputs broadcast to. Times in s, lengths in m, energies in J.

    status: keys of `hopform.ufuncs.STATUS`, negative where the numbers left the range of the precision (NaN in
    every other field there); `words` has them as text. duration: time of the ending. end: the state there. apex: NaN
    without take-off. aed: change of the body's energy. event_count: how many events. event_time, event_kind: the
    events, with a further last axis, NaN and 0 behind the last one; None unless asked for. Kinds are keys of `EVENTS`.
    sensitivities: the derivatives as `Stance.sensitivities` has them, as arrays; None unless asked for.
    """

    status: NDArray[np.int32]
    duration: NDArray[np.floating]
    end: State
    apex: NDArray[np.floating]
    aed: NDArray[np.floating]
    event_count: NDArray[np.int32]
    event_time: NDArray[np.floating] | None
    event_kind: NDArray[np.int8] | None
    backend: Backend
    sensitivities: ManySensitivities | None = None

    @property
    def words(self) -> NDArray[np.str_]:
        """The endings as `Stance.status` says them, or "out_of_range"."""
        return _words_of(self.status, STATUS)

    @property
    def event_words(self) -> NDArray[np.str_]:
        """The kinds of events in words, "" behind the last one; HopformError if they were not asked for."""
        if self.event_kind is None:
            raise HopformError("events must be True for a list of events, got False")
        return _words_of(self.event_kind, EVENTS | {0: ""})

    @property
    def takeoff(self) -> State:
        """The state at take-off, NaN where there is none."""
        lifts = self.status == 1
        return State(*(np.where(lifts, value, value.dtype.type(math.nan)) for value in map(np.asarray, self.end)))


def _words_of(codes: NDArray[Any], words: dict[int, str]) -> NDArray[np.str_]:
    first = min(words)
    table = np.array([words.get(code, "") for code in range(first, max(words) + 1)])
    return np.asarray(table[codes - first])


@dataclass(frozen=True)
class _Job:
    """Checked inputs and where the results go, flat; `columns` are the states, u, horizon, then the robot's fields."""

    columns: tuple[NDArray[Any], ...]
    shape: tuple[int, ...]
    size: int
    max_phases: int
    real: np.dtype[Any]
    results: tuple[NDArray[Any], ...]
    matrices: NDArray[Any] | None

    def chunk(self, part: slice) -> list[NDArray[Any]]:
        """The columns of some stances: numbers stay numbers, a column in one piece is not copied."""
        return [np.asarray(self._part(column, part), dtype=self.real) for column in self.columns]

    def _part(self, column: NDArray[Any], part: slice) -> Any:
        if column.size == 1:
            return column.reshape(())
        if column.shape == self.shape and column.ndim == 1:
            return column[part]
        return np.broadcast_to(column, self.shape).flat[part]


def solve_stances(
    robot: Robot,
    *,
    v2: ArrayLike,
    x1: ArrayLike = 0.0,
    v1: ArrayLike = 0.0,
    x2: ArrayLike | None = None,
    u: ArrayLike = 0.0,
    horizon: ArrayLike = 2.0,
    max_phases: int = MAX_PHASES,
    events: bool = False,
    sensitivities: bool = False,
    backend: str | None = None,
    dtype: Any = np.float64,
    threads: int = 1,
    progress: Progress | None = None,
    **fields: ArrayLike,
) -> Batch:
    """The stances of all combinations that the inputs broadcast to, each as `solve_stance` gives it.

    Inputs as for `solve_stance`, as arrays; u is a constant current per stance. Any field of the robot may be given
    as an array too: `solve_stances(robot, v2=-2.0, k=np.linspace(800, 1600, 9))`. events: list them all.
    sensitivities: derivatives through the events, 140 numbers a stance. threads: how many solve at a time. progress:
    called with the number of stances done and their total, now and then; what it raises ends the batch.
    Raises HopformError, which names field, index, value and what is allowed.

    >>> import numpy as np
    >>> from hopform import load_robot
    >>> batch = solve_stances(load_robot("hopper_c"), v2=-1.93, u=np.array([0.0, 2.0, 3.0]), k=[[1200.0], [1e4]])
    >>> batch.apex.shape, batch.words[0].tolist()
    ((2, 3), ['takeoff', 'takeoff', 'takeoff'])
    """
    real = precision_of(dtype)
    whole("max_phases", max_phases)
    whole("threads", threads)
    states = {"x1": x1, "v1": v1, "v2": v2, "u": u, "horizon": horizon}
    given = {name: numbers(name, value, _UNITS[name]) for name, value in states.items()}
    robots = robot_columns(robot, fields)
    given["y"] = _compression(given["x1"], x2, robots)
    _check_states(given, robots)
    columns = (*(given[name] for name in STATES), *robots.values())
    try:
        shape = np.broadcast_shapes(*(column.shape for column in columns))
    except ValueError:
        shapes = {name: column.shape for name, column in (given | robots).items() if column.shape}
        raise HopformError(f"the shapes of the inputs must broadcast, got {shapes}") from None
    size = math.prod(shape)
    results = results_like(size, real)
    matrices = np.empty((size, len(ROWS), len(COLUMNS)), real) if sensitivities else None
    job = _Job(columns, shape, size, max_phases, real, results, matrices)
    back_end = robot.solver.back_end(backend)
    lists = _run(job, back_end, events, threads, progress)
    return _batch(job, back_end.name, lists, x2 is not None)


def _batch(
    job: _Job, backend: Backend, lists: tuple[NDArray[Any], NDArray[np.int8]] | None, x2_is_given: bool
) -> Batch:
    of = {name: result.reshape(job.shape) for name, result in zip(RESULTS, job.results, strict=True)}
    times, kinds = lists if lists else (None, None)
    return Batch(
        status=of["status"],
        duration=of["duration"],
        end=State(of["x1"], of["v1"], of["x2"], of["v2"]),
        apex=of["apex"],
        aed=of["aed"],
        event_count=of["event_count"],
        event_time=None if times is None else times.reshape(*job.shape, times.shape[-1]),
        event_kind=None if kinds is None else kinds.reshape(*job.shape, kinds.shape[-1]),
        backend=backend,
        sensitivities=None
        if job.matrices is None
        else of_matrices(job.matrices.reshape(*job.shape, *job.matrices.shape[1:]), x2_is_given),
    )


# ---- chunk by chunk ----


def _run(
    job: _Job, back_end: BackEnd, events: bool, threads: int, progress: Progress | None
) -> tuple[NDArray[Any], NDArray[np.int8]] | None:
    found: dict[int, Events] = {}

    def solve(part: slice) -> int:
        columns, results = job.chunk(part), [result[part] for result in job.results]
        lists = back_end.solve_columns(columns, results, job.max_phases, events)
        if events:
            found[part.start] = [(lane + part.start, t, kind) for lane, t, kind in lists]
        if job.matrices is not None:
            back_end.differentiate_columns(columns, job.matrices[part], results[0], job.max_phases)
        return int(part.stop - part.start)

    parts = [slice(first, min(first + CHUNK, job.size)) for first in range(0, job.size, CHUNK)]
    done = 0
    for solved in map(solve, parts) if threads == 1 else _in_threads(solve, parts, threads):
        done += solved
        if progress is not None:
            progress(done, job.size)
    return _joined(job, [each for start in sorted(found) for each in found[start]]) if events else None


def _in_threads(solve: Callable[[slice], int], parts: list[slice], threads: int) -> Iterator[int]:
    """The results of `solve` as the parts are done; closing the iterator cancels the rest."""
    with ThreadPoolExecutor(threads) as pool:
        waiting: set[Future[int]] = {pool.submit(solve, part) for part in parts}
        try:
            while waiting:
                ready, waiting = wait(waiting, return_when=FIRST_COMPLETED)
                yield from (each.result() for each in ready)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _joined(job: _Job, lists: Events) -> tuple[NDArray[Any], NDArray[np.int8]]:
    """The events of all stances, a row each, NaN and 0 behind the last one."""
    counts = job.results[-1]
    times = np.full((job.size, int(counts.max(initial=0))), np.nan, job.real)
    kinds = np.zeros(times.shape, np.int8)
    for lane, t, kind in lists:
        place = np.arange(lane.size) - np.searchsorted(lane, lane)
        times[lane, place], kinds[lane, place] = t, kind
    return times, kinds


# ---- what goes in ----


def numbers(name: str, value: object, unit: str) -> NDArray[Any]:
    """The value as an array of finite numbers; HopformError names the first that is none, with its index."""
    array = _array(name, value, unit)
    _refuse(name, array, np.isfinite(array), lambda bad: f"must be finite {unit}, got {bad!r}")
    return array


def robot_columns(robot: Robot, fields: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """The robot's fields as arrays, those of `fields` in place of its own; HopformError for one out of its domain."""
    known = {field.name: field for field in ROBOT_FIELDS}
    for name in fields:
        if name not in known:
            close = difflib.get_close_matches(name, [*known, *_UNITS], 1, 0.5)
            hint = f", did you mean {close[0]!r}?" if close else ""
            raise HopformError(f"{name!r} is neither an input of a stance nor a field of the robot{hint}")
    columns: dict[str, NDArray[Any]] = {}
    for name, field in known.items():
        array = np.asarray(getattr(robot, name))
        if name in fields:
            array = _array(name, fields[name], field.unit)
            fits = np.asarray(checked.inside(field.domain, array))

            def reason(bad: float, name: str = name, field: Field = field) -> str:
                return (checked.refusal(field, bad) or f"{name} is not allowed: {bad!r}").removeprefix(f"{name} ")

            _refuse(name, array, fits, reason)
        columns[name] = array
    try:
        ordered = np.asarray(columns["x1_min"] <= columns["x1_max"])
    except ValueError:
        return columns
    _refuse(
        "x1_min",
        np.broadcast_to(columns["x1_min"], ordered.shape),
        ordered,
        lambda bad: f"must be <= x1_max m, got {bad!r}",
    )
    return columns


def _array(name: str, value: object, unit: str) -> NDArray[Any]:
    given: object = value
    if isinstance(value, Sequence) and any(isinstance(each, tuple) for each in cast(Sequence[object], value)):
        raise HopformError(
            f"{name} must be a number per stance in {unit}; steps (t, u) are for solve_stance, got {shown(given)}"
        )
    try:
        array = np.asarray(value)
    except ValueError:
        array = np.asarray(None)
    if array.dtype.kind in "iuf":
        return array
    if array.dtype.kind == "O" and all(isinstance(each, Real) and not isinstance(each, bool) for each in array.flat):
        found = [real(f"{name}{_place(index)}", each, unit) for index, each in np.ndenumerate(array)]
        return np.array(found).reshape(array.shape)
    raise HopformError(f"{name} must be numbers in {unit}, got {shown(given)}")


def _refuse(name: str, array: NDArray[Any], allowed: NDArray[np.bool_], reason: Callable[[float], str]) -> None:
    """HopformError about the first value that is not allowed, if there is one."""
    if np.all(allowed):
        return
    index = tuple(int(n) for n in np.argwhere(~np.asarray(allowed))[0])
    raise HopformError(f"{name}{_place(index)} {reason(float(array[index]))}")


def _place(index: tuple[int, ...]) -> str:
    return f"[{', '.join(map(str, index))}]" if index else ""


def _check_states(given: dict[str, NDArray[Any]], robots: dict[str, NDArray[Any]]) -> None:
    horizon, x1 = given["horizon"], given["x1"]
    _refuse("horizon", horizon, horizon > 0.0, lambda bad: f"must be > 0 s, got {bad!r}")
    low, high = robots["x1_min"], robots["x1_max"]
    within = _together(np.logical_and, _together(np.less_equal, low, x1), _together(np.less_equal, x1, high))
    _refuse(
        "x1", np.broadcast_to(x1, within.shape), within,
        lambda bad: f"must be within its stroke {float(low.min()):g} .. {float(high.max()):g} m, got {bad!r}",
    )  # fmt: skip


def _compression(x1: NDArray[Any], x2: ArrayLike | None, robots: dict[str, NDArray[Any]]) -> NDArray[Any]:
    """The compression at touchdown, exactly 0 where x2 is left out or says so within rounding."""
    if x2 is None:
        return np.zeros(())
    place, height, L0, c = (np.asarray(a, float) for a in (x1, numbers("x2", x2, "m"), robots["L0"], robots["c"]))
    y = _together(np.add, _together(np.subtract, place, height) + L0, c)  # in double precision, as for one stance
    y = np.where(np.abs(y) <= _TOUCHING_ULP * np.spacing(np.abs(L0)), 0.0, y)
    highest = float(np.max(_together(np.add, place, _together(np.add, L0, c)), initial=-math.inf))
    _refuse(
        "x2", np.broadcast_to(height, y.shape), y >= 0.0,
        lambda bad: f"must be <= x1 + L0 + c (at most {highest!r} m), or the spring pulls, got {bad!r}",
    )  # fmt: skip
    return y


def _together(function: Any, *arrays: NDArray[Any]) -> NDArray[Any]:
    """A function of arrays; HopformError if their shapes do not broadcast."""
    try:
        return np.asarray(function(*arrays))
    except ValueError:
        shapes = " and ".join(str(array.shape) for array in arrays)
        raise HopformError(f"the shapes of the inputs must broadcast, got {shapes}") from None
