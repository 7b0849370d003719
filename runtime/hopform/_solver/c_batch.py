"""Many stances by the compiled library, from columns into columns."""

import ctypes
import importlib
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hopform._solver import package
from hopform._solver.c import FIRST_CAPACITY, PHASES_NOT_KEPT, Compiled, Library, pointer
from hopform._solver.package import RESULTS, STATES, Columns, Events, Readings

_FIRST_EVENTS = 16
_INDEX_IN_API = 31

# What NumPy's ufunc points to for as long as it lives.
_kept: list[Any] = []


@cache
def ufunc_of(library: Library, meaning: str = "") -> Any:
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


def solve_columns(
    solver: Compiled, columns: Columns, results: Columns, readings: Readings, max_phases: int, events: bool
) -> Events:
    """Put the results and readings of stances into arrays; the events, if they are asked for."""
    found = _solved(solver.library, columns, results, max_phases, _FIRST_EVENTS if events else 0)
    for name, into in readings.items():
        _read(solver.library, name, columns, into, max_phases)
    return found


def _solved(library: Library, columns: Columns, results: Columns, max_phases: int, room: int, first: int = 0) -> Events:
    """The events of the stances, numbered from `first` on; one that has more than `room` is solved once more."""
    real, count = results[1].dtype, results[0].size
    types = library.types(real)
    arguments, out = _arguments(types, columns, max_phases), types.StancesOut()
    for name, result in zip(RESULTS, results, strict=True):
        setattr(out, name, _column(result))
    times, kinds = np.empty((count, room), real), np.empty((count, room), np.int8)
    # A touch is a phase without an event: with room for twice as many phases, hardly any list stays short.
    phases = (types.Phase * (2 * room + 2))()
    if room:
        out.phases, out.phase_capacity = ctypes.addressof(phases), len(phases)
        out.event_time, out.event_kind, out.event_capacity = times.ctypes.data, kinds.ctypes.data, room
    library.call("solve_stances", types, ctypes.c_int64(count), ctypes.byref(arguments), ctypes.byref(out))
    short = results[-1] > room
    lanes, place = np.nonzero((kinds != 0) & ~short[:, np.newaxis])
    found = [(first + lanes, times[lanes, place], kinds[lanes, place])]
    for lane in np.flatnonzero(short).tolist() if room else ():
        one = [column if column.shape == () else column[lane : lane + 1] for column in columns]
        part = [result[lane : lane + 1] for result in results]
        found += _solved(library, one, part, max_phases, int(part[-1][0]), lane)
    return found


def _read(library: Library, name: str, columns: Columns, results: NDArray[Any], max_phases: int) -> None:
    """A reading of stances, with more room for phases where they were not kept."""
    lanes, room = np.arange(len(results)), FIRST_CAPACITY
    while lanes.size:
        chosen = [column if column.shape == () else column[lanes] for column in columns]
        found = np.empty((lanes.size, *results.shape[1:]), results.dtype)
        state = np.empty(lanes.size, np.int32)
        types = library.types(results.dtype)
        phases = (types.Phase * room)()
        asked, count = ctypes.byref(_arguments(types, chosen, max_phases)), ctypes.c_int64(lanes.size)
        library.call(f"stances_{name}", types, count, asked, phases, room, pointer(found), pointer(state))
        results[lanes] = found
        lanes, room = lanes[state == PHASES_NOT_KEPT], 16 * room


def _arguments(types: Any, columns: Columns, max_phases: int) -> Any:
    """hopform_stances_in for these columns, which must outlive it."""
    arguments = types.StancesIn()
    for name, column in zip(STATES, columns, strict=False):
        setattr(arguments, name, _column(column))
    for n, column in enumerate(columns[len(STATES) :]):
        arguments.robot[n] = _column(column)
    arguments.max_phases = max_phases
    return arguments


def _column(array: NDArray[Any]) -> tuple[int, int]:
    return array.ctypes.data, array.strides[0] if array.ndim else 0
