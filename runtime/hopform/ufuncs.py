"""Stances as a generalized ufunc of NumPy: broadcasting, `out=`, any strides, and whatever else takes a ufunc.

    stance(x1, v1, v2, y, u, horizon, robot) -> status, duration, x1, v1, x2, v2, apex, aed, event_count

Inputs: the state at touchdown [m, m/s, m/s, m] with the compression y = 0 where the spring carries no load, the current [A],
the longest time [s], and the robot's fields as a last axis, in the order of `Robot.fields()`. Results: status, a key of
`STATUS`; time of the ending [s]; the state there, x2 the height of the body over the ground; apex [m], NaN without take-off;
aed [J]; how many events there were. A stance that is refused, for instance because its robot has another number of fields, has a
negative status and NaN elsewhere: nothing raises. Up to 4096 phases, as in `solve_stance`.
"""

import ctypes
import importlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import hopform_solver
from hopform._errors import BackendError
from hopform._solver import c as native
from hopform_solver import formulas
from hopform_solver.records import ENDINGS, ROBOT_FIELDS, Robot, State

INPUTS = ("x1", "v1", "v2", "y", "u", "horizon", "robot")
RESULTS = ("status", "duration", "x1", "v1", "x2", "v2", "apex", "aed", "event_count")
CODES = ("status", "event_count")
SIGNATURE = f"{'(),' * (len(INPUTS) - 1)}(p)->{','.join(['()'] * len(RESULTS))}"
MAX_PHASES = 4096
CHUNK = 16384
"""Stances that are solved at a time."""

REFUSED = {
    -2: "robot_refused",
    -3: "state_refused",
    -4: "spring_pulls",
    -5: "current_refused",
    -6: "horizon_refused",
    -8: "out_of_range",
}
STATUS = ENDINGS | REFUSED
"""What a status says: how the stance ended, or why there is none ("out_of_range": the numbers left the precision's range)."""

_INDEX_IN_API = 31
_LIMITS = {np.dtype(np.float32): 1e38, np.dtype(np.float64): 1e300}
_Results = tuple[NDArray[Any], ...]

# What NumPy's ufunc points to for as long as it lives.
_kept: list[Any] = []


def _from_library(library: native.Library) -> Any:
    """The ufunc over the loops of the compiled library, made as an extension module makes one, without Python.h."""
    api: Any = ctypes.pythonapi
    pointer_of = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(("PyCapsule_GetPointer", api))
    capsule = importlib.import_module("numpy._core._multiarray_umath")._UFUNC_API
    table = ctypes.cast(pointer_of(capsule, None), ctypes.POINTER(ctypes.c_void_p))
    integers = (ctypes.c_int,) * 4
    prototype = ctypes.PYFUNCTYPE(
        ctypes.py_object, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, *integers,
        ctypes.c_char_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p,
    )  # fmt: skip
    loops = (ctypes.c_void_p * 2)(*(library.address(f"stance_loop_{suffix}") for suffix in ("f32", "f64")))
    types = bytes(np.dtype(code).num for row in _types() for code in row)
    type_numbers = (ctypes.c_char * len(types)).from_buffer_copy(types)
    data = (ctypes.c_void_p * 2)()
    texts = (b"stance", (__doc__ or "").encode(), SIGNATURE.encode())
    _kept.append((loops, type_numbers, data, texts))
    return prototype(table[_INDEX_IN_API])(
        loops, data, type_numbers, 2, len(INPUTS), len(RESULTS), -1, texts[0], texts[1], 0, texts[2]
    )


def _types() -> list[list[Any]]:
    """The types of inputs and results, once per precision."""
    return [
        [real] * len(INPUTS) + [np.intc if name in CODES else real for name in RESULTS]
        for real in (np.float32, np.float64)
    ]


def stance_on_arrays(*inputs: ArrayLike, out: Sequence[NDArray[Any]] | None = None) -> _Results:
    """The same function of the same inputs, by the NumPy back end."""
    if len(inputs) != len(INPUTS):
        raise TypeError(f"stance takes {len(INPUTS)} inputs ({', '.join(INPUTS)}), got {len(inputs)}")
    arrays = [np.asarray(value) for value in inputs]
    single = all(np.can_cast(array.dtype, np.float32) for array in arrays)
    real = np.dtype(np.float32 if single else np.float64)
    *lanes, robot = arrays
    if not robot.shape:
        raise ValueError(f"robot must have {len(ROBOT_FIELDS)} fields on its last axis, got {robot!r}")
    if robot.shape[-1] != len(ROBOT_FIELDS):
        robot = np.full((*robot.shape[:-1], len(ROBOT_FIELDS)), np.nan, real)
    shape = np.broadcast_shapes(*(lane.shape for lane in lanes), robot.shape[:-1])
    results = _results_like(shape, real) if out is None else tuple(out)
    columns = [*lanes, *(robot[..., n] for n in range(len(ROBOT_FIELDS)))]
    for first in range(0, int(np.prod(shape)), CHUNK):
        part = slice(first, first + CHUNK)
        chunk = [np.asarray(np.broadcast_to(column, shape).flat[part], dtype=real) for column in columns]
        for result, values in zip(results, solve_columns(chunk, MAX_PHASES, real)[0], strict=True):
            result.flat[part] = values
    return results


def _results_like(shape: tuple[int, ...], real: np.dtype[Any]) -> _Results:
    return tuple(np.empty(shape, np.intc if name in CODES else real) for name in RESULTS)


def solve_columns(
    columns: Sequence[NDArray[Any]], max_phases: int, real: np.dtype[Any]
) -> tuple[_Results, tuple[NDArray[np.intp], NDArray[Any], NDArray[np.int8]]]:
    """The results of columns of one length (states, u, horizon, then the robot's fields), and lane, time, kind of each event."""
    x1, v1, v2, y, u, horizon, *fields = columns
    status = _refusals(State(x1, v1, v2, y), u, horizon, Robot(*fields), max_phases)
    sound = np.flatnonzero(status == 0)
    results = _results_like(x1.shape, real)
    for name, result in zip(RESULTS, results, strict=True):
        result[...] = 0 if name in CODES else np.nan
    results[0][...] = status
    nothing = np.zeros(0, np.intp), np.zeros(0, real), np.zeros(0, np.int8)
    if not sound.size:
        return results, nothing
    robot = Robot(*(field[sound] for field in fields))
    start = State(*(column[sound] for column in columns[:4]))
    with np.errstate(all="ignore"):
        solution = hopform_solver.solve(robot, start, u[sound], 0.0, horizon[sound], max_phases, real.type)
        x2 = formulas.body_height(robot, solution.end.x1, solution.end.y)
    end, phases = solution.end, solution.phases
    found = (solution.ending, solution.duration, end.x1, end.v1, x2, end.v2, solution.apex, solution.aed)
    finite = np.all([np.isfinite(value) for value in (*found[1:6], solution.aed)], axis=0)
    for result, values in zip(results, found, strict=False):
        result[sound[finite]] = values[finite]
    results[0][sound[~finite]] = -8
    happens = (phases.event != 0) & finite[phases.lane]
    lane, t, kind = sound[phases.lane[happens]], phases.t[happens], phases.event[happens]
    results[-1][...] = np.bincount(lane, minlength=x1.size)
    return results, (lane, t, kind)


def _refusals(start: State, u: NDArray[Any], horizon: NDArray[Any], robot: Robot, max_phases: int) -> NDArray[np.intc]:
    """The negative status of what the C library refuses, 0 for what it solves."""
    limit = _LIMITS[u.dtype]

    def beyond(*values: NDArray[Any]) -> NDArray[np.bool_]:
        return np.asarray(~np.all([np.abs(value) <= limit for value in values], axis=0))

    outside = ~(robot.x1_min <= robot.x1_max)
    for field in ROBOT_FIELDS:
        outside |= ~ALLOWED[field.domain](getattr(robot, field.name), limit)
    misplaced = beyond(*start) | ~((start.x1 >= robot.x1_min) & (start.x1 <= robot.x1_max))
    endless = ~((horizon > 0.0) & (horizon <= limit)) | (max_phases < 1)
    cases = [outside, misplaced, start.y < 0.0, beyond(u), endless]
    return np.select(cases, [-2, -3, -4, -5, -6], 0).astype(np.intc)


ALLOWED: dict[str, Callable[[Any, float], Any]] = {
    "real": lambda value, limit: np.abs(value) <= limit,
    "positive": lambda value, limit: (value > 0.0) & (value <= limit),
    "nonnegative": lambda value, limit: (value >= 0.0) & (value <= limit),
    "bound": lambda value, limit: value >= 0.0,
    "fraction": lambda value, limit: (value >= 0.0) & (value < 1.0),
    "lower": lambda value, limit: value <= limit,
    "upper": lambda value, limit: value >= -limit,
}


def _stance() -> Any:
    try:
        return _from_library(native.library())
    except BackendError:
        return stance_on_arrays


stance: Any = _stance()
"""The ufunc itself where the compiled library is there, else `stance_on_arrays`, which takes and gives the same."""
