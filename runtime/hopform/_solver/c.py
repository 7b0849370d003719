"""The C back end: the compiled library, loaded by ctypes. Its structs follow the records of the package.

A library that was built from other sources than the package is refused by name, because it would answer wrongly.
"""

import ctypes
import struct
from collections.abc import Callable, Mapping
from functools import cache, lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from hopform._errors import BackendError, HopformError
from hopform._solver import library as of_library
from hopform._solver.library import Backend, handle, opened
from hopform._solver.package import OURS, ROWS, Array, FlightRow, LegState, Package, Precision, Steps, records

PHASES_NOT_KEPT = 1
FIRST_CAPACITY = 64
"""Phases that the buffer holds at first; hardly any stance has more."""
NO_DERIVATIVE = 2
tuple_of: Any = cast(Any, tuple).__new__
"""A named tuple of what it holds, in half the time that its class takes."""


_SCALARS = {
    "int8": ctypes.c_int8, "uint16": ctypes.c_uint16, "int32": ctypes.c_int32, "uint32": ctypes.c_uint32,
    "bool": ctypes.c_bool, "ptrdiff": ctypes.c_ssize_t,
}  # fmt: skip


class Types:
    """The structs of one precision, made from the table of a package: `Types("f64", STRUCTS).Stance`."""

    def __init__(self, suffix: str, table: Mapping[str, tuple[Any, ...]]) -> None:
        self.suffix, self.real = suffix, {"f32": ctypes.c_float, "f64": ctypes.c_double}[suffix]
        self._table = table
        self._made: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self._table:
            raise AttributeError(f"the library has no struct {name}")
        if name not in self._made:
            fields = [(member, self._type(kind) * count if count > 1 else self._type(kind))
                      for member, kind, count in self._table[name]]  # fmt: skip
            self._made[name] = type(name, (ctypes.Structure,), {"_fields_": fields})
        return self._made[name]

    def _type(self, kind: str) -> Any:
        if kind.endswith("*"):
            return ctypes.c_void_p
        return self.real if kind == "real" else _SCALARS.get(kind) or getattr(self, kind)


class Library:
    """A compiled library and the types that go with it."""

    def __init__(self, path: Path, prefix: str, package: Package) -> None:
        self.source = str(import_module(package.name).SOURCE)
        self._handle = opened(path, prefix, package.name, self.source)
        self._prefix, self.package = prefix, package
        self._types: dict[str, Types] = {}
        self._buffers: dict[str, Buffers] = {}

    def address(self, name: str) -> int:
        """Address of a function of the library."""
        return cast(int, ctypes.cast(getattr(self._handle, f"{self._prefix}_{name}"), ctypes.c_void_p).value)

    def function(self, name: str, types: Types) -> Any:
        """A function in one precision, which returns a status."""
        return getattr(self._handle, f"{self._prefix}_{name}_{types.suffix}")

    def types(self, dtype: Precision) -> Types:
        suffix = {np.dtype(np.float32): "f32", np.dtype(np.float64): "f64"}[dtype]
        if suffix not in self._types:
            self._types[suffix] = Types(suffix, self.package.structs.STRUCTS)
        return self._types[suffix]

    def call(self, name: str, types: Types, *arguments: Any) -> int:
        status: int = self.function(name, types)(*arguments)
        if status < 0:
            raise refusal(name, status)
        return status

    def buffers(self, dtype: Precision) -> "Buffers":
        """The buffers of one precision."""
        try:
            return self._buffers[dtype.char]
        except KeyError:
            return self._buffers.setdefault(dtype.char, Buffers(self, self.types(dtype)))


def refusal(name: str, status: int) -> HopformError:
    """The error of a negative status of a function."""
    return HopformError(records.REFUSALS.get(status, f"{name} failed with status {status}"))


class Buffers:
    """One precision of a library at hand: its functions, how its structs are packed, and memory to solve in.

    Memory is taken from `free` and put back, so that no two stances are ever solved in the same: not those of two
    threads, nor that of a signal handler which comes in between.
    """

    def __init__(self, library: Library, types: Types) -> None:
        double = types.suffix == "f64"
        self.library, self.types = library, types
        self.solve_stance = library.function("solve_stance", types)
        self.stance_at = library.function("stance_at", types)
        self.stance_energy = library.function("stance_energy", types)
        self.pack: Callable[..., bytes] = _packed_doubles if double else _packed_floats
        letter, event = "d" if double else "f", types.Phase.event.offset
        self.stance, self.phase = layout(types.Stance), layout(types.Phase)
        self.state, self.energy = layout(types.State), layout(types.Energy)
        time = struct.calcsize(letter)
        self.event = struct.Struct(f"{letter}{event - time}xb{self.phase.size - event - 1}x")
        """Of a phase only when it starts, and the event that starts it."""
        self.pack_state: Callable[..., bytes] = self.state.pack if double else _packed_floats
        self.pack_step: Callable[..., bytes] = struct.Struct("2d").pack if double else _packed_floats
        self.one_state, self.one_energy = (ctypes.c_char * each.size for each in (self.state, self.energy))
        self.free: list[tuple[Any, Any]] = []
        self.searches: list[Any] = []

    def memory(self, capacity: int = FIRST_CAPACITY) -> tuple[Any, Any]:
        """Room for a stance and its phases."""
        return (ctypes.c_char * self.stance.size)(), (ctypes.c_char * (self.phase.size * capacity))()


def layout(structure: Any) -> struct.Struct:
    """The layout of a struct of numbers, as `struct` packs and unpacks it."""

    def letters(structure: Any) -> str:
        kinds = (kind for _, kind in structure._fields_)
        return "".join(letters(kind) if issubclass(kind, ctypes.Structure) else kind._type_ for kind in kinds)

    return struct.Struct(f"{letters(structure)}0{'d' if ctypes.alignment(structure) == 8 else 'f'}")


def _packed_doubles(*numbers: float) -> bytes:
    return struct.pack(f"{len(numbers)}d", *numbers)


def _packed_floats(*numbers: float) -> bytes:
    """As C rounds them, to infinity what is too large; `struct` would raise."""
    return bytes((ctypes.c_float * len(numbers))(*numbers))


@cache
def library() -> Library:
    """The library that belongs to this installation; BackendError if there is none or it is stale."""
    handle()
    return Library(of_library.LIBRARY, "hopform", OURS)


class Solved:
    """A stance solved by the library, as the bytes of its structs: nothing changes them, and they can be pickled."""

    __slots__ = ("answer", "buffers", "phases", "plan", "stance", "steps")

    def __init__(self, buffers: Buffers, plan: bytes, steps: bytes, phases: Any, stance: bytes) -> None:
        """phases: bytes of theirs, or memory that begins with them."""
        self.buffers, self.plan, self.steps, self.stance = buffers, plan, steps, stance
        self.answer = answer = buffers.stance.unpack(stance)
        self.phases: bytes = phases[: answer[-2] * buffers.phase.size]

    def __reduce__(self) -> Any:
        source, dtype = self.buffers.library.source, np.dtype(self.buffers.types.real)
        return _solved_again, (source, dtype, self.plan, self.steps, self.phases, self.stance)

    def outcome(self) -> tuple[int, float, LegState, float, float]:
        """Ending, duration, state at the ending, apex, AED."""
        duration, x1, v1, v2, y, apex, aed, _, ending, _, _, _ = self.answer
        return ending, duration, tuple_of(LegState, (x1, v1, v2, y)), apex, aed

    def event_rows(self) -> list[tuple[float, int]]:
        """Time and number of each event."""
        return [row for row in self.buffers.event.iter_unpack(self.phases) if row[1]]

    def phase_rows(self) -> list[tuple[float, LegState, int, int, int]]:
        """Each phase: when and where it starts, its mode, the event that starts it, the step of the current."""
        rows = self.buffers.phase.iter_unpack(self.phases)
        return [(t, LegState(x1, v1, v2, y), mode, event, step) for t, x1, v1, v2, y, mode, event, step in rows]

    def state(self, t: float) -> LegState:
        """The state at one time."""
        buffers, state = self.buffers, self.buffers.one_state()
        status = buffers.stance_at(self.plan, self.steps, self.phases, self.stance, buffers.types.real(t), state)
        if status < 0:
            raise refusal("stance_at", status)
        return LegState._make(buffers.state.unpack(state))

    def state_at(self, t: Array) -> LegState:
        """States at times of one dimension."""
        rows = np.empty((len(LegState._fields), t.size), dtype=t.dtype)
        self._call("stance_states", pointer(t), ctypes.c_int32(t.size), *map(pointer, rows))
        return LegState(*rows)

    def grid(self, dt: float, out: LegState) -> None:
        """Put the states at i dt, i = 0, 1, ..., into arrays of one dimension, each in one piece."""
        real = self.buffers.types.real
        self._call("stance_grid", real(0.0), real(dt), ctypes.c_int32(out.x1.size), *map(pointer, out))

    def energy(self, t: float) -> records.Energy:
        """Energies at one time."""
        buffers, energy, at = self.buffers, self.buffers.one_energy(), self.buffers.pack(t)
        status = buffers.stance_energy(self.plan, self.steps, self.phases, self.stance, at, 1, energy, None, None)
        if status < 0:
            raise refusal("stance_energy", status)
        return records.Energy._make(buffers.energy.unpack(energy))

    def energy_at(self, t: Array) -> records.Energy:
        """Energies at times of one dimension."""
        energies = np.empty((t.size, len(records.Energy._fields)), dtype=t.dtype)
        self._call("stance_energy", pointer(t), ctypes.c_int32(t.size), pointer(energies), None, None)
        return records.Energy(*energies.T)

    def ledger_at(self, t: Array) -> records.Ledger:
        """The ledger at times of one dimension, which must not decrease."""
        of = self.buffers.library.package.records
        energy = np.empty((t.size, len(records.Energy._fields)), dtype=t.dtype)
        work, losses = np.empty((t.size, len(of.Work._fields)), dtype=t.dtype), np.empty_like(t)
        self._call("stance_energy", pointer(t), ctypes.c_int32(t.size), pointer(energy), pointer(work), pointer(losses))
        return cast("records.Ledger", of.Ledger(**of.Work(*work.T)._asdict(), stop_loss=losses))

    def compression_max(self) -> float:
        """The largest compression."""
        most = self.buffers.types.real()
        self._call("stance_compression", ctypes.byref(most))
        return float(most.value)

    def sensitivities(self) -> Array:
        """Derivatives, rows times columns as in the package's `sensitivity`; NaN where there are none."""
        types = self.buffers.types
        shape = (len(ROWS), 5 + len(self.buffers.library.package.records.Robot._fields))
        matrix = np.empty(shape, dtype=np.dtype(types.real))
        if self._call("stance_sensitivities", pointer(matrix)) == NO_DERIVATIVE:
            matrix[:] = np.nan
        if not types.Plan.from_buffer_copy(self.plan).robot.g > 0.0:
            matrix[ROWS.index("apex")] = np.nan
        return matrix

    def tangents(self, t: Array) -> tuple[LegState, Array]:
        """States at times of one dimension, which do not decrease, and the derivatives of x1, v1, v2, y there."""
        states = np.empty((t.size, len(LegState._fields)), dtype=t.dtype)
        columns = 5 + len(self.buffers.library.package.records.Robot._fields)
        tangents = np.empty((t.size, len(LegState._fields), columns), dtype=t.dtype)
        self._call("stance_tangents", pointer(t), ctypes.c_int32(t.size), pointer(states), pointer(tangents))
        return LegState(*states.T), tangents

    def _call(self, name: str, *arguments: Any) -> int:
        of = self.buffers
        return of.library.call(name, of.types, self.plan, self.steps, self.phases, self.stance, *arguments)


_Bytes = ctypes.c_char * 0


def pointer(array: NDArray[Any]) -> Any:
    """An array's memory as a function of the library takes it; the array must outlive the call."""
    memory: Any = array
    try:
        return _Bytes.from_buffer(memory)
    except (BufferError, TypeError, ValueError):  # what may not be written to, or lies in pieces, takes longer
        return ctypes.c_void_p(array.ctypes.data)


def _library_of(motion: str, source: str) -> Library:
    """The library that reads the bytes of a pickle; BackendError where another one wrote them."""
    ours = library()
    if source != ours.source:
        raise BackendError(f"the {motion} was solved by a library built from {source}, this one is from {ours.source}")
    return ours


def _solved_again(source: str, dtype: Precision, *structs: bytes) -> Solved:
    """The stance of a pickle."""
    return Solved(_library_of("stance", source).buffers(dtype), *structs)


@lru_cache(maxsize=256)
def plan_of(lib: Library, types: Types, parameters: tuple[Any, ...]) -> Any:
    """The plan of a robot, which nobody writes to once it is made."""
    plan = types.Plan()
    lib.call("plan_init", types, ctypes.byref(plan), ctypes.byref(types.Robot(*parameters)))
    return plan


@lru_cache(maxsize=256)
def _plan_of(buffers: Buffers, parameters: tuple[Any, ...]) -> bytes:
    """The same as bytes."""
    return bytes(plan_of(buffers.library, buffers.types, parameters))


class Compiled:
    """A library as a back end."""

    name: Backend = "c"

    def __init__(self, library: Library) -> None:
        self.library = library


def solve_stance(
    solver: Compiled, parameters: Any, start: LegState, steps: Steps, horizon: float, max_phases: int, dtype: Precision
) -> Solved:
    """One stance, by the compiled library."""
    buffers = solver.library.buffers(dtype)
    plan = _plan_of(buffers, parameters)
    one = len(steps) == 1
    packed = buffers.pack_step(*steps[0]) if one else buffers.pack(*(number for step in steps for number in step))
    begin, longest = buffers.pack_state(*start), buffers.types.real(horizon)
    capacity = FIRST_CAPACITY if max_phases >= FIRST_CAPACITY else max_phases + 1
    try:
        stance, phases = buffers.free.pop()
    except IndexError:
        stance, phases = buffers.memory()
    while True:
        status = buffers.solve_stance(plan, begin, packed, len(steps), longest, max_phases, phases, capacity, stance)
        if status != PHASES_NOT_KEPT:
            break
        capacity = buffers.stance.unpack(stance)[-3]
        stance, phases = buffers.memory(capacity)
    if status < 0:
        raise refusal("solve_stance", status)
    solved = Solved(buffers, plan, packed, phases, stance[:])
    if capacity <= FIRST_CAPACITY:
        buffers.free.append((stance, phases))
    return solved


# ---- flights ----

_CAPACITY = 32


class NativeFlight(NamedTuple):
    """A flight solved by the library; it can be pickled, as parameters and the bytes of its structs."""

    library: Library
    types: Types
    parameters: records.Robot
    plan: Any
    phases: Any
    flight: Any

    def __reduce__(self) -> Any:
        kept = bytes(self.phases)[: ctypes.sizeof(self.types.FlightPhase) * self.flight.phases_kept]
        dtype = np.dtype(self.types.real)
        return _flight_again, (self.library.source, dtype, self.parameters, kept, bytes(self.flight))

    @property
    def gains(self) -> records.Gains:
        return records.Gains(self.flight.gains.Kp, self.flight.gains.Kd)

    @property
    def end(self) -> LegState:
        end = self.flight.end
        return LegState(end.x1, end.v1, end.v2, end.y)

    def rows(self) -> list[FlightRow]:
        return [FlightRow(p.t, p.x1, p.v1, p.side, p.limit, p.event) for p in self.phases[: self.flight.phases_kept]]

    def state_at(self, t: Array) -> LegState:
        """States at times of one dimension."""
        rows = np.empty((t.size, len(LegState._fields)), dtype=t.dtype)
        self._call("flight_at", np.ascontiguousarray(t), rows)
        return LegState(*rows.T)

    def energy_at(self, t: Array) -> tuple[records.Energy, records.FlightLedger]:
        """Energies and ledger at times of one dimension, which do not decrease."""
        energy = np.empty((t.size, len(records.Energy._fields)), dtype=t.dtype)
        work = np.empty((t.size, len(records.FlightWork._fields)), dtype=t.dtype)
        losses = np.empty_like(t)
        self._call("flight_energy", np.ascontiguousarray(t), energy, work, losses)
        entries = records.FlightWork(*work.T)._asdict()
        return records.Energy(*energy.T), records.FlightLedger(**entries, stop_loss=losses)

    def _call(self, name: str, t: Array, *out: Array) -> None:
        of = self.plan, self.phases, ctypes.byref(self.flight)
        self.library.call(name, self.types, *of, pointer(t), ctypes.c_int32(t.size), *map(pointer, out))


def _flight_again(source: str, dtype: Precision, parameters: Any, phases: bytes, flight: bytes) -> NativeFlight:
    """The flight of a pickle."""
    library = _library_of("flight", source)
    types = library.types(dtype)
    kept = (types.FlightPhase * (len(phases) // ctypes.sizeof(types.FlightPhase))).from_buffer_copy(phases)
    plan = ctypes.byref(plan_of(library, types, parameters))
    return NativeFlight(library, types, parameters, plan, kept, types.Flight.from_buffer_copy(flight))


def solve_flight(
    solver: Compiled, parameters: records.Robot, start: LegState, ground: float, gains: records.Gains | None,
    horizon: float, max_phases: int, dtype: Precision,
) -> NativeFlight:  # fmt: skip
    """One flight, by the compiled library."""
    library = solver.library
    types = library.types(dtype)
    plan = ctypes.byref(plan_of(library, types, parameters))
    flight, phases, capacity = types.Flight(), (types.FlightPhase * _CAPACITY)(), _CAPACITY
    law = None if gains is None else ctypes.byref(types.Gains(*gains))
    begin = ctypes.byref(types.State(*start)), types.real(ground)
    asked = plan, *begin, law, types.real(horizon), ctypes.c_int32(max_phases)
    while True:
        room = phases, ctypes.c_int32(capacity), ctypes.byref(flight)
        status = library.call("solve_flight", types, *asked, *room)
        if status != PHASES_NOT_KEPT:
            return NativeFlight(library, types, parameters, plan, phases, flight)
        capacity = int(flight.phase_count)
        phases = (types.FlightPhase * capacity)()
