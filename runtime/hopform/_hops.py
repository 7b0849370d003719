"""Many runs of hops at once: flight to the touchdown, stance, take-off, flight under the return's law to the next ground,
and so on, each solved exactly.

Runs broadcast like the stances of a batch. What differs by hop, current and ground, has the hops on a last axis. Runs are
solved in parts, as stances are: memory stays bounded, progress is shown, and Ctrl-C is heard.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._broadcast import (
    EACH,
    MOST_THREADS,
    Labels,
    Progress,
    check_states,
    column_of,
    in_parts,
    labelled,
    robot_columns,
    some_of,
    units_of,
    words_of,
)
from hopform._checks import MEMORY, finite, flag, function, items, pair, refuse_any, shown, whole
from hopform._errors import HopformError
from hopform._motion import TOUCHING_ULP, State, body_height, input_unit, precision_of, state_of_leg
from hopform._robots import Robot, falling_robot
from hopform._show import UNITS, Arrays, Card, Curve, Shown, counted, span
from hopform._solver.package import CHUNK, MAX_PHASES, REFUSED, STATUS, Column, records

MOST_HOPS = 65536
"""Hops of a run at most."""
EACH_HOP, EACH_HOP_WITH_STATES = 64, 64 + 2 * 5 * 8
"""[B] that a hop takes, and with the states at touchdown and take-off."""
WORDS = records.RUN_ENDINGS | REFUSED
BY_HOP = ("u", "ground")
"""What may differ by hop."""
_BEGIN, _END = ("start_x1", "start_v1", "start_v2", "start_y"), ("end_x1", "end_v1", "end_v2", "end_y")


@dataclass(frozen=True, repr=False, eq=False)
class Hops(Shown):
    """Runs of hops, solved. Arrays of runs have the shape that the inputs broadcast to; arrays of hops have one more
    axis. Times in s from the start, heights in m over level 0, energies in J.

    status: how each run ended, as a number, negative where its numbers left the range of the precision; `words` has it
    as text: "completed", "stopped" where a stance had no take-off, "tripped" where the foot never got above the ground
    ahead. hops: stances solved. duration: time of the ending. end: the state there, x2 over the ground under the foot, or
    ahead in the flight that trips; of a completed run its last take-off.

    By hop, NaN behind the last: touchdown_time; apex, NaN without take-off; aed, the change of the body's energy in the
    stance. ending: how the stance ended, as a number, 0 behind the last; `ending_words` has it as text. touchdown,
    stance_end: the states where each stance begins and ends, x2 over the ground under the foot; None unless asked for.
    """

    status: NDArray[np.int32]
    hops: NDArray[np.int32]
    duration: NDArray[np.floating]
    end: State[NDArray[np.floating]]
    ending: NDArray[np.int32]
    touchdown_time: NDArray[np.floating]
    apex: NDArray[np.floating]
    aed: NDArray[np.floating]
    touchdown: State[NDArray[np.floating]] | None = None
    stance_end: State[NDArray[np.floating]] | None = None
    labels: Labels | None = None
    """of the inputs, where they are DataArrays of xarray: `to_xarray` has them again"""

    @property
    def words(self) -> NDArray[np.str_]:
        """The endings of the runs in words; "out_of_range" and its like where one is refused."""
        return words_of(self.status, WORDS)

    @property
    def ending_words(self) -> NDArray[np.str_]:
        """The endings of the stances as `Stance.status` says them, "" behind the last."""
        return words_of(self.ending, STATUS | {0: ""})

    @property
    def survival(self) -> NDArray[np.float64]:
        """The share of the runs that take off from hop n or a later one, for each n.

        >>> import numpy as np
        >>> from hopform import load_robot
        >>> solve_hops(load_robot("hopper_c"), height=0.1, u=np.array([[0.0], [3.0]]), hops=5).survival.tolist()
        [1.0, 1.0, 1.0, 0.5, 0.5]
        """
        lifts = np.isfinite(self.apex).reshape(-1, self.apex.shape[-1])
        return cast("NDArray[np.float64]", lifts.mean(axis=0) if len(lifts) else np.full(lifts.shape[1], math.nan))

    def _curve(self) -> Curve:
        return "share of the runs that take off, hop by hop", np.arange(float(self.survival.size)), self.survival

    def _card(self) -> Card:
        shape = " x ".join(map(str, self.status.shape)) or "1"
        dims = f" over {', '.join(self.labels.dims)}" if self.labels and self.labels.dims else ""
        title = f"{shape} runs of {self.apex.shape[-1]} hops{dims}: {counted(self.words)}"
        given = [("precision", str(self.duration.dtype)), ("hops", span(self.hops))]
        return Card(
            title, given, [("apex", span(self.apex)), ("aed", span(self.aed)), ("duration", span(self.duration))]
        )

    def _arrays(self) -> Arrays:
        dims, coords, units = self.labels or Labels(tuple(f"dim_{n}" for n in range(self.status.ndim)), {})
        arrays: dict[str, Any] = {
            name: ((name,), values, {"units": units[name]} if name in units else {}) for name, values in coords.items()
        }
        hop = (*dims, "hop")
        arrays |= {"status": (dims, self.words), "hops": (dims, self.hops), "duration": (dims, self.duration)}
        arrays |= {f"end_{name}": (dims, x, {"units": UNITS[name]}) for name, x in self.end._asdict().items()}
        arrays |= {"ending": (hop, self.ending_words), "touchdown_time": (hop, self.touchdown_time, {"units": "s"})}
        arrays |= {"apex": (hop, self.apex), "aed": (hop, self.aed)}
        for where, state in (("touchdown", self.touchdown), ("stance_end", self.stance_end)):
            if state is not None:
                arrays |= {f"{where}_{name}": (hop, x, {"units": UNITS[name]}) for name, x in state._asdict().items()}
        return arrays


def solve_hops(
    robot: Robot,
    *,
    height: ArrayLike | None = None,
    start: State[Any] | None = None,
    v2: ArrayLike | None = None,
    x1: ArrayLike = 0.0,
    v1: ArrayLike = 0.0,
    compression: ArrayLike = 0.0,
    u: ArrayLike = 0.0,
    ground: ArrayLike = 0.0,
    hops: int | None = None,
    gains: Sequence[Any] | None = None,
    horizon: ArrayLike = 2.0,
    max_phases: int = MAX_PHASES,
    states: bool = False,
    dtype: Any = np.float64,
    threads: int = 1,
    progress: Progress | None = None,
    **fields: ArrayLike,
) -> Hops:
    """Runs of hops, for all combinations that the inputs broadcast to, each as `hopping.simulate` does it with a current
    that is known before: flight, touchdown, stance, take-off, and so on.

    A run begins with height [m], a hop height over level 0 from which it drops with the actuator at rest at its origin;
    or with start, a `State` of numbers or arrays in the air, x2 over level 0; or with v2 [m/s] and x1, v1, compression of
    the first touchdown, as for `solve_stance`. u: current [A] of the stances; ground [m]: heights of the ground over level
    0, where the touchdowns are. The last axis of an array u or ground is the hop, so a current for each of n runs has the
    shape (n, 1). hops: stances of a run, if neither u nor ground says how many. gains (Kp, Kd) [N/m, N s/m]: of the
    return in flight, numbers or arrays of runs; if left out those of `design_return`, for each flight. horizon [s]:
    longest time of a stance. Any field of the robot may be an array of runs. states: keep those at each touchdown and at
    the end of each stance. DataArrays broadcast by the names of their dimensions; the hops are "hop".
    threads: how many solve at a time. progress: called with the number of runs done and their total, now and then; what it
    raises ends the batch.
    Raises HopformError, which names field, index, value and what is allowed. Endings never raise.

    The motor's work in a stance is that of a constant force, -gamma2 u (x1 at its end less x1 at its touchdown); the
    body's energy changes by `aed`, (24).

    >>> import numpy as np
    >>> from hopform import load_robot
    >>> runs = solve_hops(load_robot("hopper_c"), height=0.2, u=np.array([[0.0], [3.0]]), ground=[0.0, 0.02, -0.01])
    >>> runs.words.tolist(), runs.apex.round(4).tolist()
    (['completed', 'completed'], [[0.1182, 0.0704, 0.0289], [0.2233, 0.2443, 0.243]])
    """
    falling_robot(robot, "hop", "hopping")
    real, most = precision_of(dtype), whole("max_phases", max_phases)
    workers, with_states = whole("threads", threads, most=MOST_THREADS), flag("states", states)
    function("progress", progress)
    begins = _beginning(height, start, v2, x1, v1, compression)
    law = (
        {} if gains is None else dict(zip(("Kp", "Kd"), pair("gains", gains, "(Kp, Kd) in N/m and N s/m"), strict=True))
    )
    inputs: dict[str, Any] = {**begins, "horizon": horizon, **law, "u": u, "ground": ground}
    problem = _problem(robot, inputs, fields, hops, with_states)
    return _solved(problem, most, real, workers, with_states, progress)


# ---- what goes in ----

_UNITS = {"height": "m", "compression": "m", "Kp": "N/m", "Kd": "N s/m", "ground": "m", "horizon": "s"}


def _beginning(
    height: object, start: object, v2: object, x1: object, v1: object, compression: object
) -> dict[str, object]:
    """What runs begin with, by name; HopformError unless it is one of the three."""
    begins = [name for name, value in (("height", height), ("start", start), ("v2", v2)) if value is not None]
    if len(begins) != 1:
        got = f"height = {shown(height)}, start = {shown(start)}, v2 = {shown(v2)}"
        raise HopformError(f"give one of height, start and v2, got {got}")
    of_touchdown = {"x1": x1, "v1": v1, "compression": compression}
    if begins[0] == "v2":
        return {"v2": v2, **of_touchdown}
    for name, value in of_touchdown.items():
        if finite(name, value, "") != 0.0:
            raise HopformError(
                f"{name} is that of the first touchdown, beside v2: 0 with {begins[0]}, got {shown(value)}"
            )
    if begins[0] == "height":
        return {"height": height}
    entries = items("start", start, "a State of x1, v1, x2, v2", 4)
    if len(entries) != 4:
        raise HopformError(f"start must be a State of x1, v1, x2, v2, got {shown(start)}")
    return {f"start.{name}": value for name, value in zip(State._fields, entries, strict=True)}


class _Problem(NamedTuple):
    """Checked inputs: columns of runs, tables of runs and hops."""

    robot: Robot
    robots: Any
    shape: tuple[int, ...]
    hops: int
    state: tuple[Column, Column, Column, Column]
    """x1, v1, v2 and the compression where the run begins"""
    first: Column
    """height of the first ground over that which a leg in the air would stand on"""
    from_touchdown: bool
    u: NDArray[Any]
    ground: NDArray[Any]
    gains: tuple[Column, Column] | None
    horizon: Column
    labels: Labels | None


def _problem(
    robot: Robot, inputs: dict[str, Any], fields: dict[str, ArrayLike], hops: int | None, with_states: bool
) -> _Problem:
    units, _ = units_of(robot.solver)
    plain, labels = labelled(inputs | fields, units)
    if labels is not None:
        plain, labels = _hops_last(plain, labels)
    state_units = dict(zip(State._fields, ("m", "m/s", "m", "m/s"), strict=True))
    known = _UNITS | state_units | {f"start.{name}": unit for name, unit in state_units.items()}
    known["u"] = input_unit(robot.solver)
    columns: dict[str, Column] = {name: column_of(name, plain[name], known[name]) for name in inputs}
    count = _count(columns, hops)
    tables = {name: np.atleast_1d(np.asarray(columns.pop(name))) for name in BY_HOP}
    robots = robot_columns(robot, fields, plain, "hop")
    shapes = {name: column.shape for name, column in columns.items() if isinstance(column, np.ndarray)}
    shapes |= {name: np.shape(getattr(robots, name)) for name in fields}
    shape = _shape(shapes | {name: table.shape[:-1] for name, table in tables.items()})
    each = EACH + count * (EACH_HOP_WITH_STATES if with_states else EACH_HOP)
    if math.prod(shape) > (most := MEMORY // each):
        raise HopformError(f"the inputs must broadcast to at most {most} runs of {count} hops, got shape {shape}")
    for name in [each for each in ("Kp", "Kd") if each in columns]:
        refuse_any(name, columns[name], columns[name] >= 0.0, partial(_negative, _UNITS[name]))
    state, first = _states(robot, robots, columns, tables["ground"][..., :1])
    check_states(robot, {"horizon": columns["horizon"], "x1": state[0]}, robots)
    return _Problem(
        robot, robots, shape, count, state, first, "v2" in columns, tables["u"], tables["ground"],
        (columns["Kp"], columns["Kd"]) if "Kp" in columns else None, columns["horizon"], labels,
    )  # fmt: skip


def _negative(unit: str, bad: float) -> str:
    return f"must be >= 0 {unit}, got {bad!r}"


def _hops_last(plain: dict[str, Any], labels: Labels) -> tuple[dict[str, Any], Labels]:
    """Arrays over labelled dimensions with those of runs, and the hops behind them where an input may differ by hop."""
    dims = tuple(dim for dim in labels.dims if dim != "hop")
    arrays = dict[str, Any]()
    place = labels.dims.index("hop") if "hop" in labels.dims else None
    for name, value in plain.items():
        if not isinstance(value, np.ndarray):
            arrays[name] = value
            continue
        array = cast(NDArray[Any], value)
        if place is not None and name not in BY_HOP and array.shape[place] != 1:
            raise HopformError(f"{name} must not have the dimension hop; {' and '.join(BY_HOP)} may")
        last = array[..., None] if place is None else np.moveaxis(array, place, -1)
        arrays[name] = last if name in BY_HOP else last[..., 0]
    coords = {name: values for name, values in labels.coords.items() if name != "hop"}
    return arrays, labels._replace(dims=dims, coords=coords)


def _count(given: Mapping[str, Column], hops: int | None) -> int:
    """The hops of a run: as asked for, or by the last axis of the ground or the current."""
    axes: dict[str, int] = {name: np.shape(given[name])[-1] for name in BY_HOP if np.ndim(given[name])}
    counts = {name: count for name, count in axes.items() if count != 1 or name == "ground"}
    if hops is not None:
        counts = {name: count for name, count in axes.items() if count != 1} | {"hops": whole("hops", hops)}
    if not counts:
        raise HopformError("hops must be given where the ground has no axis of hops, and u none of several, got None")
    count: int = counts.get("hops", max(counts.values()))
    if any(each not in (1, count) for each in counts.values()):
        raise HopformError(f"u, ground and hops must have one number of hops, got {counts}")
    if not 1 <= count <= MOST_HOPS:
        raise HopformError(f"hops must be from 1 to {MOST_HOPS}, got {count}")
    return count


def _shape(shapes: dict[str, tuple[int, ...]]) -> tuple[int, ...]:
    """The shape of runs that inputs broadcast to."""
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        of_runs = {name: shape for name, shape in shapes.items() if shape}
        raise HopformError(f"the shapes of runs must broadcast, got {of_runs}") from None


def _states(
    robot: Robot, robots: Any, columns: Mapping[str, Column], ground: NDArray[Any]
) -> tuple[tuple[Column, Column, Column, Column], Column]:
    """Where runs begin: x1, v1, v2 and the compression; and the height of the first ground over the foot."""
    formulas = robot.solver.package.formulas
    letters, rest = formulas.letters_of(robots), formulas.compression_at_rest(robots)
    touching = TOUCHING_ULP * np.spacing(np.abs(letters.L0))
    if "v2" in columns:
        y = np.where(np.abs(columns["compression"]) <= touching, 0.0, columns["compression"])
        refuse_any("compression", y, y >= 0.0, lambda bad: f"must be >= 0 m (a contact cannot pull), got {bad!r}")
        return (columns["x1"], columns["v1"], columns["v2"], y), 0.0
    if "height" in columns:
        x1: Column = np.minimum(np.maximum(0.0, letters.x1_min), letters.x1_max)
        v1: Column = 0.0
        x2, v2 = columns["height"] + (letters.L0 + letters.c - rest), cast(Column, 0.0)
    else:
        x1, v1, x2, v2 = (columns[f"start.{name}"] for name in State._fields)
    first = x1 - (x2 - ground[..., 0]) + letters.L0 + letters.c - rest
    return (x1, v1, v2, 0.0), np.where(np.abs(first) <= touching, 0.0, first)


# ---- run by run ----


def _solved(
    problem: _Problem, max_phases: int, real: np.dtype[Any], threads: int, with_states: bool, progress: Progress | None
) -> Hops:
    shape, hops = problem.shape or (1,), problem.hops
    size = math.prod(shape)
    results: dict[str, NDArray[Any]] = {name: np.empty(size, np.int32) for name in ("status", "hops")}
    results |= {name: np.empty(size, real) for name in ("duration", "x1", "v1", "x2", "v2")}
    results["ending"] = np.empty((size, hops), np.int32)
    by_hop = ("touchdown", "apex", "aed", *((*_BEGIN, *_END) if with_states else ()))
    results |= {name: np.empty((size, hops), real) for name in by_hop}
    columns = (*problem.state, 0.0, problem.horizon, *problem.robots)
    library = problem.robot.solver.compiled()

    def solve(part: slice) -> int:
        rows: tuple[NDArray[np.intp], ...] = np.unravel_index(np.arange(int(part.start), int(part.stop)), shape)

        def table(values: NDArray[Any]) -> NDArray[Any]:
            return np.broadcast_to(values, (*shape, hops))[rows]

        def some(column: Column) -> Column:
            return some_of(column, shape, part, real)

        with np.errstate(over="ignore"):  # of a number that single precision does not hold: the run is refused
            ground = table(problem.ground)
            steps = np.diff(ground, axis=1, prepend=0.0)
            steps[:, 0] = some_of(problem.first, shape, part, np.dtype(np.float64))
            into = {name: each[part] for name, each in results.items()}
            library.solve_hops(
                [some(column) for column in columns],
                {"u": np.asarray(table(problem.u), real), "ground": np.asarray(steps, real)},
                None if problem.gains is None else cast(Any, tuple(map(some, problem.gains))),
                into, max_phases, from_touchdown=problem.from_touchdown,
            )  # fmt: skip
            into["apex"] += np.asarray(ground, real)
        return int(part.stop - part.start)

    in_parts(solve, size, max(CHUNK // hops, 1), threads, progress)
    return _of_results(problem, {name: _in_shape(each, problem.shape) for name, each in results.items()}, with_states)


def _in_shape(values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    return values.reshape((*shape, *values.shape[1:]))


def _of_results(problem: _Problem, of: dict[str, NDArray[Any]], with_states: bool) -> Hops:
    state = state_of_leg(problem.robot.solver)

    def of_stance(names: tuple[str, ...]) -> State[Any] | None:
        if not with_states:
            return None
        x1, v1, v2, y = (of[name] for name in names)
        return state(x1, v1, _heights(problem, x1, y), v2)

    return Hops(
        of["status"], of["hops"], of["duration"], state(*(of[name] for name in State._fields)), of["ending"],
        of["touchdown"], of["apex"], of["aed"], of_stance(_BEGIN), of_stance(_END), problem.labels,
    )  # fmt: skip


def _heights(problem: _Problem, x1: NDArray[Any], y: NDArray[Any]) -> NDArray[Any]:
    """Heights of the body over the ground under the foot, in the precision of the states."""
    robot, real = problem.robot, x1.dtype
    if problem.robots is robot.parameters:
        return cast("NDArray[Any]", body_height(robot, precision_of(real), x1, y))
    with np.errstate(over="ignore", invalid="ignore"):
        columns = [np.asarray(each, real)[..., None] if np.ndim(each) else real.type(each) for each in problem.robots]
        return np.asarray(robot.solver.package.formulas.second_position(type(problem.robots)(*columns), x1, y), real)
