"""Stances as a generalized ufunc of NumPy: broadcasting, `out=`, any strides, and whatever else takes a ufunc.

    stance(x1, v1, v2, y, u, horizon, robot) -> status, duration, x1, v1, x2, v2, apex, aed, event_count

Inputs: the state at touchdown [m, m/s, m/s, m] with the compression y = 0 where the leg carries nothing, the current
[A], the longest time [s], and the robot's fields as a last axis, in the order of `Robot.fields()`. Results: status, a
key of `STATUS`; time of the ending [s]; the state there, x2 the height of the body over the ground; apex [m], NaN
without take-off; aed [J]; how many events there were. A stance that is refused, for instance because its robot has
another number of fields, has a negative status and NaN elsewhere: nothing raises. Up to 4096 phases, as in
`solve_stance`.
"""

import ctypes
import importlib
import sys
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._errors import BackendError
from hopform._solver import package
from hopform._solver.c import Library, library
from hopform._solver.choice import DEFAULT, Solver
from hopform._solver.package import CHUNK, CODES, INPUTS, MAX_PHASES, REFUSED, RESULTS, SIGNATURE, STATUS

# What NumPy's ufunc points to for as long as it lives.
_kept: list[Any] = []
_INDEX_IN_API = 31

__all__ = [
    "CHUNK", "CODES", "INPUTS", "MAX_PHASES", "REFUSED", "RESULTS", "SIGNATURE", "STATUS", "stance", "stance_on_arrays",
]  # fmt: skip


def stance_on_arrays(*inputs: ArrayLike, out: Sequence[NDArray[Any]] | None = None) -> tuple[NDArray[Any], ...]:
    """The same function of the same inputs, by the Python back end."""
    return _on_arrays(DEFAULT, *inputs, out=out)


def _on_arrays(
    solver: Solver, *inputs: ArrayLike, out: Sequence[NDArray[Any]] | None = None
) -> tuple[NDArray[Any], ...]:
    if len(inputs) != len(INPUTS):
        raise TypeError(f"stance takes {len(INPUTS)} inputs ({', '.join(INPUTS)}), got {len(inputs)}")
    arrays = [np.asarray(value) for value in inputs]
    single = all(np.can_cast(array.dtype, np.float32) for array in arrays)
    real = np.dtype(np.float32 if single else np.float64)
    *lanes, robot = arrays
    fields = len(solver.package.records.ROBOT_FIELDS)
    if not robot.shape:
        raise ValueError(f"robot must have {fields} fields on its last axis, got {robot!r}")
    own = np.moveaxis(robot, -1, 0)
    columns = [*lanes, *(own if len(own) == fields else np.full((fields, *own.shape[1:]), np.nan, real))]
    shape = np.broadcast_shapes(*(column.shape for column in columns))
    results = package.results_like(shape, real) if out is None else tuple(out)
    for first in range(0, int(np.prod(shape)), CHUNK):
        part = slice(first, first + CHUNK)
        chunk = [np.asarray(np.broadcast_to(column, shape).flat[part], dtype=real) for column in columns]
        found = package.results_like(chunk[0].size, real)
        solver.python.solve_columns(chunk, found, {}, MAX_PHASES, events=False)
        for result, values in zip(results, found, strict=True):
            result.flat[part] = values
    return results


def _ufunc_of(library: Library, meaning: str) -> Any:
    """The ufunc over the loops of a library, made as an extension module makes one, without Python.h."""
    api: Any = ctypes.pythonapi
    pointer_of = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(("PyCapsule_GetPointer", api))
    capsule = importlib.import_module("numpy._core._multiarray_umath")._UFUNC_API
    table = ctypes.cast(pointer_of(capsule, None), ctypes.POINTER(ctypes.c_void_p))
    pointers, integers, text = (ctypes.c_void_p,) * 3, (ctypes.c_int,) * 4, ctypes.c_char_p
    prototype = ctypes.PYFUNCTYPE(ctypes.py_object, *pointers, *integers, text, text, ctypes.c_int, text)
    loops = (ctypes.c_void_p * 2)(*(library.address(f"stance_loop_{suffix}") for suffix in ("f32", "f64")))
    of_results = [np.intc if name in package.CODES else None for name in RESULTS]
    codes = [*[None] * len(package.INPUTS), *of_results]
    types = bytes(np.dtype(code or real).num for real in (np.float32, np.float64) for code in codes)
    type_numbers = (ctypes.c_char * len(types)).from_buffer_copy(types)
    data = (ctypes.c_void_p * 2)()
    texts = (b"stance", meaning.encode(), package.SIGNATURE.encode())
    _kept.append((loops, type_numbers, data, texts))
    return prototype(table[_INDEX_IN_API])(
        loops, data, type_numbers, 2, len(package.INPUTS), len(RESULTS), -1, texts[0], texts[1], 0, texts[2]
    )


def of(solver: Solver) -> ModuleType | SimpleNamespace:
    """What this module has, for the robots of a solver."""
    if solver is DEFAULT:
        return sys.modules[__name__]
    own: dict[str, Any] = {name: globals()[name] for name in __all__}
    own["stance"] = own["stance_on_arrays"] = partial(_on_arrays, solver)
    with suppress(BackendError):
        own["stance"] = _ufunc_of(solver.compiled().library, __doc__ or "")
    return SimpleNamespace(**own)


stance: Any = stance_on_arrays
with suppress(BackendError):
    stance = _ufunc_of(library(), __doc__ or "")
"""The ufunc itself where the compiled library is there, else `stance_on_arrays`, which takes and gives the same."""
