"""The compiled library, loaded by ctypes. Its structs follow the records of the package.

A library that was built from other sources than the package is refused by name, because it would answer wrongly.
"""

import ctypes
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, cached_property, lru_cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from hopform._errors import BackendError, HopformError
from hopform._solver import package
from hopform._solver.build import with_notes
from hopform._solver.library import REINSTALL, opened, own_library, refuse_damage, text_of
from hopform._solver.package import (
    ASKED,
    OURS,
    ROWS,
    Array,
    Asked,
    Column,
    Columns,
    Events,
    LegState,
    Package,
    Precision,
    Steps,
    records,
)

PHASES_NOT_KEPT = package.NUMBERS["phases_not_kept"]
FIRST_CAPACITY = 64
"""Phases that the buffer holds at first; hardly any stance has more."""
NO_DERIVATIVE = package.NUMBERS["no_derivative"]
_FIRST_EVENTS = 16
tuple_of: Any = cast(Any, tuple).__new__
"""A named tuple of what it holds, in half the time that its class takes."""


_AGAIN = "`make test`, `hopform model build` or a new installation of hopform makes both"


class Library:
    """A compiled library, and what it takes and gives in each precision."""

    def __init__(
        self, path: Path, prefix: str, package: Package, mend: str = REINSTALL, folder: Path | None = None
    ) -> None:
        """folder: whose sources it must be of. mend: what to do where it is stale."""
        layout = str(import_module(package.name).LAYOUT)
        self._handle = opened(path, prefix, package.name, layout, mend, folder)
        self.source = text_of(self._handle, f"{prefix}_source") or layout
        self._path, self._prefix, self.package = path, prefix, package
        self._word = "stance" if package.elements.HAS_CONTACT else "motion"  # what C calls what is solved
        self._types: dict[str, Types] = {}

    @cached_property
    def notes(self) -> "Library":
        """That which explains what this one solves; BackendError if it is not beside it, or of other sources."""
        path = with_notes(self._path)
        if not path.is_file():
            raise BackendError(f"explain() needs {path.name}, which is not beside {self._path.name}: {_AGAIN}")
        refuse_damage(self._path, _AGAIN, notes=True)
        notes = Library(path, self._prefix, self.package)
        if notes.source != self.source:
            stale = f"{path.name} is stale: it is of the sources {notes.source}, {self._path.name} of {self.source}"
            raise BackendError(f"{stale}; {_AGAIN}")
        return notes

    def address(self, name: str) -> int:
        """Address of a function of the library."""
        return cast(int, ctypes.cast(getattr(self._handle, f"{self._prefix}_{name}"), ctypes.c_void_p).value)

    def function(self, name: str, types: "Types") -> Any:
        """A function in one precision, which returns a status."""
        known = types.functions
        if name not in known:
            spelled = name.replace("stance", self._word)
            known[name] = getattr(self._handle, f"{self._prefix}_{spelled}_{types.suffix}")
        return known[name]

    def types(self, dtype: Precision) -> "Types":
        try:
            return self._types[dtype.char]
        except KeyError:
            return self._types.setdefault(dtype.char, Types(self, {"f": "f32", "d": "f64"}[dtype.char]))

    def call(self, name: str, types: "Types", *arguments: Any) -> int:
        status: int = self.function(name, types)(*arguments)
        if status < 0:
            raise refusal(name, status)
        return status


def refusal(name: str, status: int) -> HopformError:
    """The error of a negative status of a function."""
    return HopformError(records.REFUSALS.get(status, f"{name} failed with status {status}"))


class Types:
    """One precision of a library at hand: its structs as attributes, made from the table of the package, how they are
    packed, the functions that one stance needs, and memory to solve in.

    Memory is taken from `free` and put back, so that no two stances are ever solved in the same: not those of two
    threads, nor that of a signal handler which comes in between.
    """

    def __init__(self, library: Library, suffix: str) -> None:
        double = suffix == "f64"
        self.library, self.suffix, self.real = library, suffix, ctypes.c_double if double else ctypes.c_float
        self.functions: dict[str, Any] = {}
        self.outputs = len(library.package.elements.ROWS)
        self.dtype = np.dtype(self.real)
        for name, members in library.package.structs.STRUCTS.items():
            fields = [(member, self._type(kind, count)) for member, kind, count in members]
            setattr(self, name, type(name, (ctypes.Structure,), {"_fields_": fields}))
        self.solve_stance = library.function("solve_stance", self)
        self.stance_at = library.function("stance_at", self)
        self.stance, self.phase = layout(self.Stance), layout(self.Phase)
        self.state = layout(self.State)
        self.stances_in, self.stances_out = layout(self.StancesIn), layout(self.StancesOut)
        self.pack_state: Callable[..., bytes] = self.state.pack if double else self.pack
        self.pack_step: Callable[..., bytes] = struct.Struct("2d").pack if double else self.pack
        self.one_state = ctypes.c_char * self.state.size
        members = [name for name, _, _ in library.package.structs.STRUCTS["StancesOut"]]
        self.readings = members[members.index("steps") + 1 :]
        self.no_readings = [0] * (len(self.readings) + len(("phases", "capacity", "times", "kinds", "room", "steps")))
        self.free: list[tuple[Any, Any]] = []
        self.free_inputs: list[_Inputs] = []
        self.latest: tuple[Any, bytes] = None, b""
        """The parameters of which the latest plan was made: the same object needs no hash of its numbers."""

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """The struct of a name."""

    def _type(self, kind: str, count: int) -> Any:
        if kind.endswith("*"):
            return ctypes.c_void_p
        ours = {"real": self.real, "ptrdiff": ctypes.c_ssize_t}
        ctype: Any = ours.get(kind) or getattr(ctypes, f"c_{kind}", None) or getattr(self, kind)
        return ctype * count if count > 1 else ctype

    def pack(self, *numbers: float) -> bytes:
        """Numbers as C rounds them, to infinity what is too large; `struct` would raise for a float."""
        return bytes((self.real * len(numbers))(*numbers))

    def memory(self, capacity: int = FIRST_CAPACITY) -> tuple[Any, Any]:
        """Room for a stance and its phases."""
        return (ctypes.c_char * self.stance.size)(), (ctypes.c_char * (self.phase.size * capacity))()


class _Inputs:
    """Memory for a number of each column, and hopform_stances_in of numbers alone."""

    def __init__(self, types: Types) -> None:
        count = len(types.Robot._fields_) + len(package.STATES)
        self.numbers = (types.real * count)()
        address, size = ctypes.addressof(self.numbers), types.dtype.itemsize
        self.places = [place for n in range(count) for place in (address + n * size, 0)]
        self.packed: tuple[int, bytes] = 0, b""
        """The struct for the latest bound on phases."""
        self.kept: tuple[Any, ...] = ()
        """Arrays that a call reads."""


def layout(structure: Any) -> struct.Struct:
    """The layout of a struct of numbers, as `struct` packs and unpacks it."""

    def letters(kind: Any) -> str:
        if hasattr(kind, "_fields_"):
            return "".join(letters(each) for _, each in kind._fields_)
        return str(letters(kind._type_) * kind._length_ if hasattr(kind, "_length_") else kind._type_)

    return struct.Struct(f"{letters(structure)}0{'d' if ctypes.alignment(structure) == 8 else 'f'}")


@cache
def library() -> Library:
    """The library that belongs to this installation; BackendError if there is none or it is stale."""
    path, mend, folder = own_library()
    return Library(path, "hopform", OURS, mend, folder)


LIBRARIES: dict[str, Callable[[], Library]] = {OURS.name: library}
"""What loads the library of each package, by its name."""


class _Motion:
    """A motion solved by the library, as the bytes of its structs: nothing changes them, and they can be pickled."""

    __slots__ = ("structs", "types")
    word: ClassVar[str]

    def __init__(self, types: Types, *structs: bytes) -> None:
        self.types, self.structs = types, structs

    def __reduce__(self) -> Any:
        library = self.types.library
        return _solved_again, (library.package.name, library.source, type(self), self.types.dtype, *self.structs)

    def call(self, name: str, *arguments: Any) -> int:
        """The status of a function of the motion."""
        return self.types.library.call(name, self.types, *self.structs, *arguments)

    def read(self, name: str, t: Array, *shapes: tuple[int, ...]) -> list[Array]:
        """What a function says of times of one dimension: arrays of these shapes, with the times before them."""
        arrays = [np.empty((t.size, *shape), t.dtype) for shape in shapes]
        self.call(name, pointer(t), ctypes.c_int32(t.size), *map(pointer, arrays))
        return arrays


class Solved(_Motion):
    """A stance solved by the library: its plan, steps, phases (bytes, or memory that begins with them) and results."""

    __slots__ = ("answer",)
    word = "stance"

    def __init__(self, types: Types, plan: bytes, steps: bytes, phases: Any, stance: bytes) -> None:
        self.types = types
        self.answer = answer = types.stance.unpack(stance)
        self.structs = plan, steps, phases[: answer[-2] * types.phase.size], stance

    def outcome(self) -> tuple[Any, ...]:
        """Ending, duration, state at the ending; of a model with a contact also apex and AED."""
        duration, x1, v1, v2, y, *rises = self.answer[:-5]
        return self.answer[-4], duration, tuple_of(LegState, (x1, v1, v2, y)), *rises

    def plan_status(self, parameters: tuple[Any, ...]) -> int:
        """The status of the plan of a robot in this precision, 0 or a warning."""
        return made_plan(self.types, parameters)[1]

    def phase_rows(self) -> list[tuple[float, LegState, int, int, int]]:
        """Each phase: when and where it starts, its mode, the event that starts it, the step of the current."""
        rows = self.types.phase.iter_unpack(self.structs[2])
        return [
            (t, tuple_of(LegState, (x1, v1, v2, y)), mode, event, step) for t, x1, v1, v2, y, mode, event, step in rows
        ]

    def events(self) -> Iterator[tuple[float, int]]:
        """When and which; a step of the input and a limit of a law begin a phase and are none."""
        rows, events = self.types.phase.iter_unpack(self.structs[2]), self.types.library.package.records.EVENTS
        return ((t, event) for t, _, _, _, _, _, event, _ in rows if event in events)

    def state(self, t: float) -> LegState:
        """The state at one time."""
        types, state = self.types, self.types.one_state()
        if (status := types.stance_at(*self.structs, types.real(t), state)) < 0:
            raise refusal("stance_at", status)
        return LegState._make(types.state.unpack(state))

    def state_at(self, t: Array) -> LegState:
        """States at times of one dimension."""
        rows = np.empty((len(LegState._fields), t.size), dtype=t.dtype)
        self.call("stance_states", pointer(t), ctypes.c_int32(t.size), columns_of(rows))
        return LegState(*rows)

    def grid(self, dt: float, out: LegState) -> None:
        """Put the states at i dt, i = 0, 1, ..., into arrays of one dimension, each in one piece."""
        real = self.types.real
        self.call("stance_grid", real(0.0), real(dt), ctypes.c_int32(out.x1.size), columns_of(out))

    def energy_at(self, t: Array) -> records.Energy:
        """Energies at times of one dimension: those that the model has."""
        layout = self.types.library.package.records.Energy
        energies = np.empty((t.size, len(layout._fields)), dtype=t.dtype)
        self.call("stance_energy", pointer(t), ctypes.c_int32(t.size), pointer(energies), None, None)
        return cast("records.Energy", layout(*energies.T))

    def forces_at(self, t: Array) -> dict[str, Array]:
        """Forces at times of one dimension, by their names; C fills a struct without entries with a column of zeros."""
        forces = self.read("stance_forces", t, (len(self.types.Forces._fields_),))[0]
        return dict(zip(self.types.library.package.records.Forces._fields, forces.T, strict=False))

    def ledger_at(self, t: Array) -> records.Ledger:
        """The ledger at times of one dimension, which must not decrease."""
        layouts = self.types.library.package.records
        _, work, losses = self.read(
            "stance_energy", t, (len(layouts.Energy._fields),), (len(self.types.Ledger._fields_),), ()
        )
        return cast("records.Ledger", _ledger(layouts.Ledger, layouts.Work, work, losses))

    def compression_max(self) -> float:
        """The largest compression."""
        most = self.types.real()
        self.call("stance_compression", ctypes.byref(most))
        return float(most.value)

    def sensitivities(self, columns: Sequence[int] | None = None) -> Array:
        """Derivatives, rows times columns as in the package's `elements`, or the columns of these numbers, which may be
        `package.column_of_step` or `column_of_step_time`; NaN where there are none.
        """
        solver = self.types.library.package
        codes = chosen(solver, columns)
        matrix = np.empty((self.types.outputs, codes.size), dtype=self.types.dtype)
        if self.call("stance_sensitivities", pointer(codes), codes.size, pointer(matrix)) == NO_DERIVATIVE:
            matrix[:] = np.nan
        if solver.elements.HAS_CONTACT:
            fall = solver.formulas.fall_of(self.types.Plan.from_buffer_copy(self.structs[0]).robot)
            if self.outcome()[0] != package.TAKEOFF or not fall > 0.0:
                matrix[ROWS.index("apex")] = np.nan
        return matrix

    def tangents(self, t: Array, columns: Sequence[int] | None = None) -> tuple[LegState, Array]:
        """States at times of one dimension, which do not decrease, and the derivatives of x1, v1, v2, y there, by the
        same columns as `sensitivities`.
        """
        codes, row = chosen(self.types.library.package, columns), len(LegState._fields)
        states, tangents = np.empty((t.size, row), t.dtype), np.empty((t.size, row, codes.size), t.dtype)
        into = pointer(t), ctypes.c_int32(t.size), pointer(states), pointer(tangents)
        self.call("stance_tangents", pointer(codes), codes.size, *into)
        return LegState(*states.T), tangents


class SolvedFlight(_Motion):
    """A flight solved by the library: its plan, phases and results."""

    __slots__ = ()
    word = "flight"

    @property
    def flight(self) -> Any:
        """The struct of its results."""
        return self.types.Flight.from_buffer_copy(self.structs[-1])

    def rows(self) -> list[package.FlightRow]:
        """The phases."""
        rows = layout(self.types.FlightPhase).iter_unpack(self.structs[1])
        return [(t, x1, v1, side, limit, event) for t, x1, v1, _, side, limit, event, _ in rows]

    def state_at(self, t: Array) -> LegState:
        """States at times of one dimension."""
        return LegState(*self.read("flight_at", t, (len(LegState._fields),))[0].T)

    def sensitivities(self, codes: tuple[int, ...]) -> Array:
        """Derivatives by the columns of these numbers, rows as in the package's `elements`; NaN where there are none."""
        solver = self.types.library.package
        matrix = np.empty((len(solver.elements.FLIGHT_ROWS), len(codes)), self.types.dtype)
        columns = (ctypes.c_int32 * len(codes))(*codes)
        if self.call("flight_sensitivities", columns, ctypes.c_int32(len(codes)), pointer(matrix)) == NO_DERIVATIVE:
            matrix[:] = np.nan
        return matrix

    def energy_at(self, t: Array) -> tuple[records.Energy, records.FlightLedger]:
        """Energies and ledger at times of one dimension, which do not decrease."""
        layouts = self.types.library.package.records
        of_energy, of_work = len(layouts.Energy._fields), len(self.types.FlightLedger._fields_)
        energy, work, losses = self.read("flight_energy", t, (of_energy,), (of_work,), ())
        return records.Energy(*energy.T), _ledger(layouts.FlightLedger, layouts.FlightWork, work, losses)


def chosen(solver: Package, columns: Sequence[int] | None) -> NDArray[np.int32]:
    """The numbers of columns of derivatives as the library takes them, None for all."""
    return np.array(range(len(solver.elements.COLUMNS)) if columns is None else columns, np.int32)


def _ledger(ledger: Any, of_work: Any, work: Array, losses: Array) -> Any:
    """A ledger of the work of each force, a column each, and the losses at stops, which a model without stops has not; C
    fills a struct without entries with a column of zeros.
    """
    entries = {**dict(zip(of_work._fields, work.T, strict=False)), "stop_loss": losses}
    return ledger(**{name: entries[name] for name in ledger._fields})


def _solved_again(name: str, source: str, kind: type[_Motion], dtype: Precision, *structs: bytes) -> _Motion:
    """The motion of a pickle; BackendError where another library wrote it, or its solver is not loaded."""
    if name not in LIBRARIES:
        raise BackendError(package.not_loaded(f"the {kind.word}", name.removeprefix(package.LOADED)))
    ours = LIBRARIES[name]()
    if source != ours.source:
        solved = f"the {kind.word} was solved by a library built from {source}"
        raise BackendError(f"{solved}, this one is from {ours.source}")
    return kind(ours.types(dtype), *structs)


_Bytes = ctypes.c_char * 0


def pointer(array: NDArray[Any]) -> Any:
    """An array's memory as a function of the library takes it; the array must outlive the call."""
    memory: Any = array
    try:
        return _Bytes.from_buffer(memory)
    except (BufferError, TypeError, ValueError):  # what may not be written to, or lies in pieces, takes longer
        return ctypes.c_void_p(array.ctypes.data)


def columns_of(arrays: Iterable[NDArray[Any]]) -> Any:
    """The addresses of arrays in one piece, which must outlive the call."""
    addresses = [array.ctypes.data for array in arrays]
    return (ctypes.c_void_p * len(addresses))(*addresses)


def made_plan(types: Types, parameters: tuple[Any, ...]) -> tuple[Any, int]:
    """The plan of a robot and its status, 0 or a warning."""
    plan = types.Plan()
    return plan, types.library.call("plan_init", types, ctypes.byref(plan), ctypes.byref(types.Robot(*parameters)))


@lru_cache(maxsize=256)
def plan_of(types: Types, parameters: tuple[Any, ...]) -> bytes:
    """The plan of a robot."""
    return bytes(made_plan(types, parameters)[0])


def with_room(types: Types, name: str, phase: Any, most: int, given: tuple[Any, ...], *answer: Any) -> Any:
    """The phases of a function that solves, called again with more memory for them where it was too little."""
    capacity = min(FIRST_CAPACITY, most)
    while True:
        phases = (phase * capacity)()
        status = types.library.call(name, types, *given, phases, ctypes.c_int32(capacity), *answer)
        if status != PHASES_NOT_KEPT or capacity == most:
            return phases
        capacity = min(8 * capacity, most)


class C:
    """What a compiled library solves: a state is x1, v1, v2 and the compression y. HopformError where numbers leave the
    range of the precision.
    """

    def __init__(self, library: Library) -> None:
        self.library = library

    def solve_stance(
        self, parameters: Any, start: LegState, steps: Steps, horizon: float, max_phases: int, dtype: Precision
    ) -> Solved:
        """One stance, by the compiled library."""
        types = self.library.types(dtype)
        latest, plan = types.latest
        if latest is not parameters:
            plan = plan_of(types, parameters)
            types.latest = parameters, plan
        one = len(steps) == 1
        packed = types.pack_step(*steps[0]) if one else types.pack(*(number for step in steps for number in step))
        begin, longest = types.pack_state(*start), types.real(horizon)
        capacity = FIRST_CAPACITY if max_phases >= FIRST_CAPACITY else max_phases + 1
        try:
            stance, phases = types.free.pop()
        except IndexError:
            stance, phases = types.memory()
        while True:
            status = types.solve_stance(plan, begin, packed, len(steps), longest, max_phases, phases, capacity, stance)
            if status != PHASES_NOT_KEPT:
                break
            capacity = types.stance.unpack(stance)[-3]
            stance, phases = types.memory(capacity)
        if status < 0:
            raise refusal("solve_stance", status)
        solved = Solved(types, plan, packed, phases, stance[:])
        if capacity <= FIRST_CAPACITY:
            types.free.append((stance, phases))
        return solved

    def solve_flight(
        self, parameters: records.Robot, start: LegState, ground: float, gains: records.Gains | None,
        horizon: float, max_phases: int, dtype: Precision,
    ) -> SolvedFlight:  # fmt: skip
        """One flight, by the compiled library."""
        types = self.library.types(dtype)
        plan, flight = plan_of(types, parameters), types.Flight()
        law = None if gains is None else ctypes.byref(types.Gains(*gains))
        begin = ctypes.byref(types.State(*start)), types.real(ground), law
        asked = plan, *begin, types.real(horizon), ctypes.c_int32(max_phases)
        phases = with_room(types, "solve_flight", types.FlightPhase, max_phases + 1, asked, ctypes.byref(flight))
        kept = ctypes.sizeof(types.FlightPhase) * flight.phases_kept
        return SolvedFlight(types, plan, bytes(phases)[:kept], bytes(flight))

    def solve_flights(
        self, columns: Columns, gains: Columns | None, results: package.Results, lists: package.FlightLists,
        max_phases: int, events: bool,
    ) -> Events:  # fmt: skip
        """Put the results of flights and what is asked of them besides into arrays; the events, if they are asked for.

        columns: FLIGHT_STATES, then the robot's fields. gains: Kp and Kd; None for those of `design_return`.
        """
        return _fly(self.library, columns, gains, results, lists, max_phases, events)

    def choose_current(
        self, parameters: records.Robot, start: LegState, target: package.Target, max_phases: int, dtype: Precision
    ) -> tuple[float, float, int, int]:
        """Current [A], hop height [m] (0 without take-off), status as in COMMANDS, and how many stances were solved.

        target: h_des, datum, stop_margin [m], horizon [s].
        """
        types = self.library.types(dtype)
        search, command = types.Search(), types.Command()
        begin, to_reach = ctypes.byref(types.State(*start)), ctypes.byref(types.Target(*target, *package.WITHOUT_CAPS))
        asked = ctypes.byref(search), plan_of(types, parameters), begin, to_reach
        with_room(types, "choose_current", types.Phase, max_phases, asked, ctypes.byref(command))
        return command.u, command.apex, command.status, search.trials

    def try_currents(
        self, parameters: Any, starts: list[LegState], currents: Array, horizon: float, max_phases: int
    ) -> NDArray[Any]:
        """The stance of each current from each state, (states, currents), a structured array with the fields of
        hopform_trial.
        """
        types = self.library.types(np.dtype(np.float64))
        trials = np.zeros((len(starts), currents.size), np.dtype(types.Trial))
        states = (types.State * len(starts))(*(types.State(*start) for start in starts))
        values = np.ascontiguousarray(currents, dtype=np.float64)
        sizes = ctypes.c_int32(len(starts)), ctypes.c_int32(values.size)
        asked = plan_of(types, parameters), states, sizes[0], pointer(values), sizes[1], types.real(horizon)
        with_room(types, "try_currents", types.Phase, max_phases, asked, pointer(trials))
        return trials

    def apexes(self, parameters: Any, starts: list[LegState], currents: Array, horizon: float) -> tuple[Array, Array]:
        """The next apex, NaN without take-off, and the largest x1, (starts, currents)."""
        trials = self.try_currents(parameters, starts, currents, horizon, package.MAX_PHASES)
        return np.where(trials["takes_off"], trials["apex"], np.nan), trials["largest_x1"]

    def solve_columns(
        self,
        columns: Columns,
        results: package.Results,
        readings: package.Readings,
        max_phases: int,
        events: bool,
        asked: Asked = ASKED,
    ) -> Events:
        """Put the results and readings of stances into arrays; the events, if they are asked for."""
        room = _FIRST_EVENTS if events else 0
        # A touch is a phase without an event: with room for twice as many phases, hardly any list stays short.
        read = readings or asked.step_times is not None
        capacity = FIRST_CAPACITY if read else 2 * room + 2 if room else 0
        return _solve(self.library, columns, results, readings, asked, max_phases, room, capacity)

    def solve_hops(
        self,
        columns: Columns,
        by_hop: Mapping[str, NDArray[Any]],
        gains: tuple[Column, Column] | None,
        results: Mapping[str, NDArray[Any]],
        max_phases: int,
        *,
        from_touchdown: bool,
    ) -> None:
        """Put what runs of hops do into arrays, by the names of hopform_hops_out: of runs, or of runs and hops."""
        real, (count, hops) = results["duration"].dtype, results["ending"].shape
        types = self.library.types(real)
        _, arguments, inputs = _arguments(types, columns, max_phases, ASKED)
        given, out = types.HopsIn(), types.HopsOut()
        ctypes.memmove(ctypes.byref(given), arguments, ctypes.sizeof(types.StancesIn))
        for name, table in by_hop.items():
            setattr(given, name, types.HopInput(_address(table), *table.strides))
        law = [] if gains is None else [np.asarray(gain, real) for gain in gains]
        for name, gain in zip(("Kp", "Kd"), law, strict=False):
            setattr(given, name, types.Input(_address(gain), *(gain.strides or (0,))))
        given.hops, given.from_touchdown = hops, from_touchdown
        for name, into in results.items():
            layout_of = types.Output if into.ndim == 1 else types.HopOutput
            setattr(out, name, layout_of(_address(into), *into.strides))
        self.library.call("solve_hops", types, ctypes.c_int64(count), ctypes.byref(given), ctypes.byref(out))
        types.free_inputs.append(inputs)


# ---- many stances, from columns into columns ----


def _solve(
    library: Library, columns: Columns, results: package.Results, readings: package.Readings, asked: Asked,
    max_phases: int, room: int, capacity: int, first: int = 0,
) -> Events:  # fmt: skip
    """The events of the stances, numbered from `first` on; one that has more of them than `room`, or more phases than
    `capacity`, is solved once more.
    """
    codes, reals = results
    real, count = reals.dtype, reals.shape[1]
    types = library.types(real)
    given, arguments, inputs = _arguments(types, columns, max_phases, asked)
    (status, count_of_events), rows = _rows(codes), _rows(reals)
    into = [status, codes.itemsize]
    for row in rows[: types.outputs]:
        into += row, reals.itemsize
    if types.outputs < len(rows):  # without a contact there is no apex and no AED
        reals[types.outputs :] = np.nan
    into += count_of_events, codes.itemsize
    if not capacity:
        into += types.no_readings
        library.call("solve_stances", types, ctypes.c_int64(count), arguments, types.stances_out.pack(*into))
        types.free_inputs.append(inputs)
        return []
    phases, steps = (types.Phase * capacity)(), (types.Step * max(given[0], 1))()
    times, kinds = np.empty((count, room), real), np.empty((count, room), np.int8)
    lists = (_address(times), _address(kinds), room) if room else (0, 0, 0)
    read = {"reading_status": np.empty(count, np.int32), **readings}
    places = [_address(read[name]) if name in read else 0 for name in types.readings]
    packed = types.stances_out.pack(*into, ctypes.addressof(phases), capacity, *lists, ctypes.addressof(steps), *places)
    library.call("solve_stances", types, ctypes.c_int64(count), arguments, packed)
    types.free_inputs.append(inputs)
    few = (read["reading_status"] == PHASES_NOT_KEPT) & (capacity <= max_phases)
    short = few | (codes[-1] > room) if room else few
    events_found: Events = []
    if room:
        lanes, place = np.nonzero((kinds != 0) & ~short[:, np.newaxis])
        events_found.append((first + lanes, times[lanes, place], kinds[lanes, place]))
    for lane in np.flatnonzero(short).tolist():
        one = [column[lane : lane + 1] if isinstance(column, np.ndarray) else column for column in columns]
        part = codes[:, lane : lane + 1], reals[:, lane : lane + 1]
        of_part = {name: reading[lane : lane + 1] for name, reading in readings.items()}
        more = max(room, int(codes[-1, lane])) if room else 0
        phases_of_one = min(max(8 * capacity, 2 * more + 2), max_phases + 1)
        events_found += _solve(library, one, part, of_part, asked, max_phases, more, phases_of_one, first + lane)
    return events_found


def _fly(
    library: Library, columns: Columns, gains: Columns | None, results: package.Results, lists: package.FlightLists,
    max_phases: int, events: bool,
) -> Events:  # fmt: skip
    """The events of the flights; all are solved again with more room where one has more phases than there is."""
    codes, reals = results
    real, count = reals.dtype, reals.shape[1]
    types, states = library.types(real), len(package.FLIGHT_STATES)
    ordered = [*columns[states:], *columns[: states - 1], *(gains or (0.0, 0.0)), columns[states - 1]]
    numbers = (types.real * len(ordered))(*(x if type(x) is float else 0.0 for x in ordered))
    places = [
        (ctypes.addressof(numbers) + n * real.itemsize, 0) if type(x) is float else (_address(x), x.strides[0])
        for n, x in enumerate(cast(Sequence[Any], ordered))
    ]
    if gains is None:
        places[-3:-1] = [(0, 0), (0, 0)]
    (status, count_of_events), rows = _rows(codes), _rows(reals)
    into = [*(each for row in (status, *rows) for each in (row, real.itemsize)), count_of_events, codes.itemsize]
    into[1] = codes.itemsize
    chosen = (ctypes.c_int32 * len(lists.codes))(*lists.codes)
    asked = [0 if each is None else _address(each) for each in (lists.times, lists.states, lists.matrices)]
    n_times = 0 if lists.times is None else lists.times.size
    inputs = layout(types.FlightsIn).pack(
        *(each for place in places for each in place), max_phases,
        asked[0], ctypes.addressof(chosen), n_times, len(lists.codes),
    )  # fmt: skip
    most = max_phases + 1
    capacity, room = min(FIRST_CAPACITY, most), _FIRST_EVENTS if events else 0
    while True:
        phases = (types.FlightPhase * capacity)()
        times, kinds = np.empty((count, room), real), np.empty((count, room), np.int8)
        listed = (_address(times), _address(kinds), room) if room else (0, 0, 0)
        outputs = layout(types.FlightsOut).pack(
            *into, ctypes.addressof(phases), capacity, *listed, *asked[1:],
        )  # fmt: skip
        if library.call("solve_flights", types, ctypes.c_int64(count), inputs, outputs) != PHASES_NOT_KEPT:
            break
        capacity, room = min(8 * capacity, most), max(room, int(codes[-1].max(initial=0))) if events else 0
    if not room:
        return []
    lanes, place = np.nonzero(kinds)
    return [(lanes, times[lanes, place], kinds[lanes, place])]


def _arguments(types: Types, columns: Columns, max_phases: int, asked: Asked) -> tuple[tuple[int, ...], bytes, _Inputs]:
    """What is asked, hopform_stances_in for these columns, and the memory of those that are numbers, which goes back to
    `types.free_inputs` behind the call; it and the arrays must outlive it.
    """
    try:
        inputs = types.free_inputs.pop()
    except IndexError:
        inputs = _Inputs(types)
    states = len(package.STATES)
    ordered = [*columns[states:], *columns[:states]]
    arrays: list[tuple[int, Any]] = [(n, column) for n, column in enumerate(ordered) if type(column) is not float]
    if not arrays and asked is ASKED:
        inputs.numbers[:] = ordered
        if inputs.packed[0] != max_phases:
            inputs.packed = max_phases, types.stances_in.pack(*inputs.places, max_phases, *NOTHING)
        return NOTHING, inputs.packed[1], inputs
    places = inputs.places.copy()
    stride = 0
    for n, column in arrays:
        ordered[n] = 0.0
        places[2 * n : 2 * n + 2] = _address(column), column.strides[0]
        if column.ndim > 1:
            stride = column.strides[1]
            _refuse_other_steps(column.shape[1], 0 if asked.step_times is None else asked.step_times.size)
    inputs.numbers[:] = ordered
    given = NOTHING if asked is ASKED else _what_is_asked(types, asked, stride, inputs)
    return given, types.stances_in.pack(*places, max_phases, *given), inputs


def _refuse_other_steps(inputs: int, steps: int) -> None:
    if inputs != steps:
        raise HopformError(f"u has {inputs} inputs of steps, of which there are {steps}")


NOTHING = (0, 0, 0, 0, 0, 0, 0)
"""Members of hopform_stances_in where one input lasts and all columns are asked for, at no times."""


def _what_is_asked(types: Types, asked: Asked, stride: int, inputs: _Inputs) -> tuple[int, ...]:
    """These members: steps, bytes between their inputs, their times; times, columns, how many there are."""
    steps, times = asked.step_times, asked.times
    codes = None if asked.columns is None else chosen(types.library.package, asked.columns)
    inputs.kept = steps, times, codes
    counts = [0 if each is None else each.size for each in inputs.kept]
    at_steps, at_times, at_codes = (0 if each is None else _address(each) for each in inputs.kept)
    return counts[0], stride, at_steps, at_times, at_codes, counts[1], counts[2]


def _rows(block: NDArray[Any]) -> range:
    """Where the memory of each row of a block begins."""
    first, length = _address(block), block.strides[0]
    return range(first, first + len(block) * length, length)


def _address(array: NDArray[Any]) -> int:
    """Where an array's memory begins; `ctypes.data` says it of any array, and takes three times as long."""
    memory: Any = array
    try:
        return ctypes.addressof(_Bytes.from_buffer(memory))
    except (BufferError, TypeError, ValueError):
        return array.ctypes.data
