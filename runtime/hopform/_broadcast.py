"""What batches of stances, motions, flights and hops share: inputs that broadcast, parts, threads, lists of events."""

import math
import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from types import MappingProxyType
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from hopform._checks import MEMORY, array_of, in_stroke, numbers, refuse_any
from hopform._errors import HopformError
from hopform._motion import input_unit
from hopform._robots import Robot, nearest
from hopform._show import UNITS
from hopform._solver import package
from hopform._solver.choice import Solver
from hopform._solver.package import Column, checked, records

Progress = Callable[[int, int], object]

EACH = 128
"""[B] the results of a stance, without steps, states at times and derivatives."""
MOST_THREADS = 1024
INPUTS = {
    "stance": ("x1", "v1", "v2", "x2", "compression", "u", "horizon"),
    "motion": ("start", "u", "horizon"),
    "flight": ("x1", "v1", "v2", "x2", "compression", "gains", "horizon"),
    "hop": ("height", "start", "v2", "x1", "v1", "compression", "u", "ground", "hops", "gains", "horizon"),
}
"""What is solved from, beside fields of the robot."""
NO_DIMS: Mapping[str, str] = MappingProxyType({})


class Labels(NamedTuple):
    """Dimensions of inputs that are labelled, in their order, with the coordinates that some have, and their units."""

    dims: tuple[str, ...]
    coords: dict[str, NDArray[Any]]
    units: Mapping[str, str] = MappingProxyType({})


def labelled(
    inputs: Mapping[str, Any], units: Mapping[str, str], further: Mapping[str, str] = NO_DIMS
) -> tuple[dict[str, Any], Labels | None]:
    """Inputs as arrays that broadcast by the names of their dimensions, where some are DataArrays; else as they are.

    units: those of the model. further: a dimension of an input that is none of the others', and stays its last one.
    HopformError for coordinates of one name that differ, and for a plain array beside a DataArray.
    """
    xarray: Any = sys.modules.get("xarray")  # a DataArray is there only where xarray is
    known = {} if xarray is None else {k: each for k, each in inputs.items() if isinstance(each, xarray.DataArray)}
    if not known:
        return dict(inputs), None
    dims = tuple(dict.fromkeys(dim for name, each in known.items() for dim in each.dims if dim != further.get(name)))
    coords, arrays = dict[str, NDArray[Any]](), dict[str, Any]()
    for name, each in inputs.items():
        last = further.get(name)
        if name not in known:
            if np.ndim(each) > (last is not None):
                raise HopformError(f"{name} must be a number or a DataArray beside other DataArrays, got an array")
            arrays[name] = each
            continue
        for dim in each.dims:
            if dim in each.coords and dim != last:
                own = coords.setdefault(str(dim), each.coords[dim].values)
                if not np.array_equal(own, each.coords[dim].values):
                    raise HopformError(f"{name} must have the coordinates {dim} of the other inputs, got others")
        order = dims if last is None else (*dims, last)
        arrays[name] = each.expand_dims([dim for dim in order if dim not in each.dims]).transpose(*order).values
    return arrays, Labels(tuple(map(str, dims)), coords, {**UNITS, **units})


def is_labelled(value: object) -> bool:
    """Whether a value is a DataArray of xarray."""
    xarray: Any = sys.modules.get("xarray")
    return xarray is not None and isinstance(value, xarray.DataArray)


def words_of(codes: NDArray[Any], words: Mapping[int, str]) -> NDArray[np.str_]:
    """The words of numbers that are near to each other, "" where there is none."""
    first = min(words)
    return np.asarray(np.array([words.get(code, "") for code in range(first, max(words) + 1)])[codes - first])


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


# ---- part by part ----


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
