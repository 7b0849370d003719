"""Many flights at once: everything broadcasts, states, heights, gains and the fields of the robot alike."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._batch import Motions
from hopform._broadcast import (
    EACH,
    MOST_THREADS,
    Progress,
    check_states,
    columns_of_part,
    in_parts,
    joined,
    labelled,
    robot_columns,
    shape_of,
    words_of,
)
from hopform._checks import flag, function, numbers, pair, refuse_any, whole
from hopform._errors import HopformError
from hopform._flight_columns import ROWS, Columns, by_names, chosen, rows_of, units_of, without_row
from hopform._motion import TOUCHING_ULP, State, precision_of, state_of_leg
from hopform._robots import Robot, checked_robot
from hopform._sensitivities import ManySensitivities, aliases_of
from hopform._show import Arrays, Card, Curve, span
from hopform._solver import package
from hopform._solver.package import CHUNK, FLIGHT_REALS, FLIGHT_STATES, FLIGHT_STATUS, MAX_PHASES, Column, Gains
from hopform._stance import LAYOUT

_UNITS = {
    "x1": "m", "v1": "m/s", "v2": "m/s", "x2": "m", "compression": "m", "Kp": "N/m", "Kd": "N s/m", "horizon": "s",
}  # fmt: skip


@dataclass(frozen=True, repr=False, eq=False)
class Flights(Motions):
    """Flights, solved; every array has the shape that the inputs broadcast to. Lengths in m, heights over the ground
    ahead, energies in J.

    status, words: how each ended, as `Flight.status`. duration [s]; end: the state there, before the impact. v2_after
    [m/s]: behind it. apex, apex_time, impact_loss, leg_loss, gains: as of a `Flight`. end_compression [m]: of the leg at
    touchdown, with which the next stance begins; NaN without one. times [s], states: the times that were given, and the
    states there, with a further last axis, NaN behind the ending; None unless asked for. sensitivities: as
    `Flight.sensitivities`, by the columns that were asked for. NaN everywhere where a flight was refused, as one whose
    numbers left the range of the precision.
    """

    v2_after: NDArray[np.floating] = dataclasses.field(kw_only=True)
    end_compression: NDArray[np.floating] = dataclasses.field(kw_only=True)
    apex: NDArray[np.floating] = dataclasses.field(kw_only=True)
    apex_time: NDArray[np.floating] = dataclasses.field(kw_only=True)
    impact_loss: NDArray[np.floating] = dataclasses.field(kw_only=True)
    leg_loss: NDArray[np.floating] = dataclasses.field(kw_only=True)
    gains: Gains = dataclasses.field(kw_only=True)
    times: NDArray[np.floating] | None = dataclasses.field(kw_only=True, default=None)
    states: State[NDArray[np.floating]] | None = dataclasses.field(kw_only=True, default=None)

    _figures: ClassVar[tuple[str, ...]] = (
        "duration", "apex", "apex_time", "v2_after", "end_compression", "impact_loss", "leg_loss", "event_count",
    )  # fmt: skip

    @property
    def words(self) -> NDArray[np.str_]:
        """The endings as `Flight.status` says them, or "out_of_range"."""
        return words_of(self.status, FLIGHT_STATUS)

    @property
    def touchdown(self) -> State[NDArray[Any]]:
        """The state behind the impact, with which the next stance begins; NaN without touchdown."""
        end: State[NDArray[Any]] = self.end._replace(v2=self.v2_after)
        lands = self.status == package.TOUCHDOWN
        after = [np.where(lands, value, value.dtype.type(math.nan)) for value in map(np.asarray, end)]
        return type(end)(*after)

    def _curve(self) -> Curve:
        some = self.duration.reshape(-1)
        return "duration [s], flight by flight", np.arange(some.size), some

    def _card(self) -> Card:
        return self._told("flights", [("apex", span(self.apex)), ("v2_after", span(self.v2_after))])

    def _arrays(self) -> Arrays:
        arrays: dict[str, Any] = dict(super()._arrays())
        dims = arrays["status"][0]
        arrays |= {name: (dims, values, {"units": _UNITS[name]}) for name, values in self.gains._asdict().items()}
        if self.states is not None:
            over = (*dims, "time")
            arrays["time"] = ("time",), cast(Any, self.times), {"units": "s"}
            arrays |= {
                name: (over, values, {"units": self._units[name]}) for name, values in self.states._asdict().items()
            }
        return arrays


def solve_flights(
    robot: Robot,
    *,
    v2: ArrayLike,
    x1: ArrayLike = 0.0,
    v1: ArrayLike = 0.0,
    x2: ArrayLike | None = None,
    compression: ArrayLike | None = None,
    gains: Sequence[ArrayLike] | None = None,
    horizon: ArrayLike = 10.0,
    max_phases: int = MAX_PHASES,
    times: ArrayLike | None = None,
    events: bool = False,
    sensitivities: bool | Sequence[str] = False,
    dtype: Any = np.float64,
    threads: int = 1,
    progress: Progress | None = None,
    **fields: ArrayLike,
) -> Flights:
    """The flights of all combinations that the inputs broadcast to, each as `solve_flight` gives it.

    Inputs as for `solve_flight`, as arrays; gains: (Kp, Kd), each may be one; any field of the robot may be one, too.
    times [s]: of one dimension, which do not decrease, shared by all: the states there. events: list them all.
    sensitivities: derivatives through the events, True for all columns of `Flight.sensitivities`, or names of some. The
    others as for `solve_stances`. Raises HopformError, which names field, index, value and what is allowed.

    >>> import numpy as np
    >>> from hopform import load_robot
    >>> flights = solve_flights(load_robot("hopper_c"), v2=np.array([1.0, 1.9]), x1=0.05, sensitivities=("x1", "Kp"))
    >>> flights.words.tolist(), flights.sensitivities["T", "x1"].shape
    (['touchdown', 'touchdown'], (2,))
    """
    solver = checked_robot(robot, "flight").solver
    real, most = precision_of(dtype), whole("max_phases", max_phases)
    workers, listed = whole("threads", threads, most=MOST_THREADS), flag("events", events)
    function("progress", progress)
    inputs: dict[str, ArrayLike] = {"x1": x1, "v1": v1, "v2": v2, "horizon": horizon}
    inputs |= {name: each for name, each in (("x2", x2), ("compression", compression)) if each is not None}
    if gains is not None:
        inputs |= zip(Gains._fields, pair("gains", gains, "(Kp, Kd) in N/m and N s/m"), strict=True)
    plain, labels = labelled(inputs | fields, solver.facts.units | _UNITS)
    columns = {name: cast(Column, numbers(name, plain[name], _UNITS[name])) for name in inputs}
    robots = robot_columns(robot, fields, plain, "flight")
    at, asked = _times(times, real), None
    if sensitivities is not False:
        asked = chosen(solver, sensitivities, "x2" in inputs, "compression" in inputs, robots)
    each = EACH + _size_of(at, asked, real)
    shape = shape_of(columns | {name: getattr(robots, name) for name in fields}, each, "flight")
    _check(robot, columns, robots)
    y, ground = _leg_and_ground(robot, columns, robots)
    given: dict[str, Column] = columns | {"y": y, "ground": ground}
    size = math.prod(shape)
    results = np.empty((2, size), np.intc), np.empty((len(FLIGHT_REALS), size), real)
    lists = _room(size, at, asked, real)
    law = None if gains is None else [columns[name] for name in Gains._fields]
    job = _Job((*(given[name] for name in FLIGHT_STATES), *robots), law, shape, results, lists, most, listed)
    occurred, kinds = _run(job, solver.compiled(), workers, progress)
    of: dict[str, NDArray[Any]] = dict(zip(FLIGHT_REALS, (row.reshape(shape) for row in results[1]), strict=True))
    status, count = (row.reshape(shape) for row in results[0])
    if occurred is not None and kinds is not None:
        occurred, kinds = occurred.reshape((*shape, occurred.shape[-1])), kinds.reshape((*shape, kinds.shape[-1]))
    state, lands = state_of_leg(solver), status == package.TOUCHDOWN
    states = None if lists.states is None else _states(robot, lists.states, shape, robots, real)
    matrices = (
        None if asked is None or lists.matrices is None else lists.matrices.reshape(shape + lists.matrices.shape[1:])
    )
    derived = None
    if asked is not None and matrices is not None:
        derived = _derivatives(asked, matrices, [columns[name] for name in ("x1", "v1", "v2")], robot, robots, ~lands)
    return Flights(
        status, of["duration"], state(*(of[name] for name in State._fields)), count, occurred, kinds, derived, labels,
        LAYOUT.unit_of, solver.package.records.FLIGHT_EVENTS, v2_after=of["v2_after"],
        end_compression=np.where(lands, of["y"], real.type(math.nan)), apex=of["apex"], apex_time=of["apex_time"],
        impact_loss=of["impact_loss"], leg_loss=of["leg_loss"], gains=Gains(of["Kp"], of["Kd"]), times=at, states=states,
    )  # fmt: skip


# ---- what goes in ----


def _times(times: ArrayLike | None, real: np.dtype[Any]) -> NDArray[Any] | None:
    """The times in a precision; HopformError for one below 0 or less than that before it."""
    if times is None:
        return None
    at = numbers("times", times, "s")
    if at.ndim != 1:
        raise HopformError(f"times must be of one dimension, got {at.ndim}")
    refuse_any("times", at, at >= 0.0, lambda bad: f"must be >= 0 s, got {bad!r}")
    later = np.concatenate((np.ones(min(at.size, 1), bool), at[1:] >= at[:-1]))
    refuse_any("times", at, later, lambda bad: f"must not decrease, got {bad!r} s")
    return np.ascontiguousarray(at, real)


def _check(robot: Robot, columns: Mapping[str, Column], robots: Any) -> None:
    check_states(robot, columns, robots)
    fall = robot.solver.package.formulas.fall_of(robots)
    refuse_any("a flight", fall, np.asarray(fall) > 0.0, lambda bad: f"needs g > 0 m/s^2, got {bad!r}")
    for name in Gains._fields:
        if name in columns:
            allowed = f"must be >= 0 {_UNITS[name]}"
            refuse_any(name, columns[name], np.asarray(columns[name]) >= 0.0, partial("{}, got {!r}".format, allowed))


def _leg_and_ground(robot: Robot, columns: Mapping[str, Column], robots: Any) -> tuple[Column, Column]:
    """The compression at take-off, and how far the ground ahead is above that which is left, 0 where x2 is left out."""
    formulas = robot.solver.package.formulas
    y = columns.get("compression", formulas.compression_at_takeoff(robots, columns["v1"], columns["v2"]))
    if "x2" not in columns:
        return _column(y), 0.0
    letters, rest = formulas.letters_of(robots), formulas.compression_at_rest(robots)
    ground = np.asarray(columns["x1"] - columns["x2"] + letters.L0 + letters.c - rest - y)
    return _column(y), _column(np.where(np.abs(ground) <= TOUCHING_ULP * np.spacing(np.abs(letters.L0)), 0.0, ground))


def _column(values: Any) -> Column:
    return float(values) if np.ndim(values) == 0 else np.asarray(values, float)


# ---- what comes out ----


@dataclass(frozen=True)
class _Job:
    """Checked inputs and where the results go, flat."""

    columns: tuple[Column, ...]
    gains: list[Column] | None
    shape: tuple[int, ...]
    results: package.Results
    lists: package.FlightLists
    max_phases: int
    events: bool


def _run(
    job: _Job, library: Any, threads: int, progress: Progress | None
) -> tuple[NDArray[Any], NDArray[np.int8]] | tuple[None, None]:
    lists: package.Events = []
    real = job.results[1].dtype

    def solve(part: slice) -> int:
        columns = columns_of_part(job.columns, job.shape, part, real)
        gains = None if job.gains is None else columns_of_part(job.gains, job.shape, part, real)
        results = job.results[0][:, part], job.results[1][:, part]
        listed = library.solve_flights(columns, gains, results, job.lists.part(part), job.max_phases, job.events)
        lists.extend([(lane + part.start, t, kind) for lane, t, kind in listed])
        return int(part.stop - part.start)

    in_parts(solve, job.results[0].shape[1], CHUNK, threads, progress)
    return joined(job.results[0][-1], lists, real) if job.events else (None, None)


def _size_of(at: NDArray[Any] | None, asked: Columns | None, real: np.dtype[Any]) -> int:
    """[B] that the states and derivatives of a flight take: twice, while they are put into the coordinates of people."""
    states = 0 if at is None else len(State._fields) * at.size
    return 2 * real.itemsize * (states + (0 if asked is None else len(ROWS) * len((*asked.codes, *asked.names))))


def _room(size: int, at: NDArray[Any] | None, asked: Columns | None, real: np.dtype[Any]) -> package.FlightLists:
    states = None if at is None else np.empty((size, at.size, len(State._fields)), real)
    matrices = None if asked is None else np.empty((size, len(ROWS), len(asked.codes)), real)
    return package.FlightLists(at, states, () if asked is None else asked.codes, matrices)


def _states(
    robot: Robot, states: NDArray[Any], shape: tuple[int, ...], robots: Any, real: np.dtype[Any]
) -> State[NDArray[Any]]:
    """States at times, with the height of the body in place of the compression, rounded as in the library."""
    x1, v1, v2, y = np.moveaxis(states.reshape(*shape, *states.shape[1:]), -1, 0)
    with np.errstate(over="ignore"):
        rounded = type(robots)(*(np.asarray(value, real)[..., np.newaxis] for value in robots))
    x2 = robot.solver.package.formulas.second_position(rounded, x1, y)
    return state_of_leg(robot.solver)(*map(np.ascontiguousarray, (x1, v1, x2, v2)))


def _derivatives(
    asked: Columns, matrices: NDArray[Any], start: Sequence[Column], robot: Robot, robots: Any, flies: NDArray[np.bool_]
) -> ManySensitivities:
    solver, rows = robot.solver, tuple(rows_of(robot.solver).values())
    matrix = by_names(asked, matrices, start, solver, robots)
    matrix = without_row(matrix, rows.index("v2_after"), flies)
    return ManySensitivities(rows, asked.names, matrix, units_of(solver), aliases_of(solver))
