"""The C back end: the compiled library, loaded by ctypes. Its structs follow the records of hopform_solver.

A library that was built from other sources than the package is refused by name, because it would answer wrongly.
"""

import ctypes
import sys
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hopform_solver
from hopform.errors import BackendError, HopformError
from hopform_solver import records as hopper_records
from hopform_solver.records import Energy, Ledger, State
from hopform_solver.sensitivity import ROWS

LIBRARY = Path(__file__).with_name("_libhopform.dylib" if sys.platform == "darwin" else "_libhopform.so")
PHASES_NOT_KEPT = 1
NO_DERIVATIVE = 2
_FIRST_CAPACITY = 64
_REASONS = {
    -2: "a parameter of the robot is out of its domain",
    -3: "an initial value is not finite, or x1 is outside its stroke",
    -4: "the spring force at the start is negative",
    -5: "the steps of the current do not start at 0 or do not increase",
    -6: "horizon or max_phases is not positive",
    -7: "a time is outside the stance",
    -8: "the numbers left the range of the precision: scale the robot or use float64",
    -9: "a gain is negative or not finite",
    -10: "a sample or threshold is not finite, low > high, or count < 1",
}


class Types:
    """The structs of one precision, for the records of one package."""

    def __init__(self, suffix: str, records: ModuleType = hopper_records) -> None:
        real = {"f32": ctypes.c_float, "f64": ctypes.c_double}[suffix]

        def struct(name: str, *fields: tuple[str, Any]) -> Any:
            return type(name, (ctypes.Structure,), {"_fields_": list(fields)})

        def record(name: str) -> Any:
            return struct(name, *((field, real) for field in getattr(records, name)._fields))

        self.suffix, self.real = suffix, real
        self.robot, self.state = record("Robot"), record("State")
        self.energy, self.ledger = record("Energy"), record("Ledger")
        poles = record("Poles")
        self.plan = struct(
            "Plan",
            ("robot", self.robot),
            ("rates", record("Rates")),
            ("both", poles),
            ("actuator", poles),
            ("body", poles),
        )
        self.step = struct("Step", ("t", real), ("u", real))
        self.phase = struct(
            "Phase",
            *((name, real) for name in ("t", "x1", "v1", "v2", "y")),
            ("mode", ctypes.c_int8),
            ("event", ctypes.c_int8),
            ("step", ctypes.c_uint16),
        )
        self.stance = struct(
            "Stance",
            ("duration", real),
            ("end", self.state),
            ("apex", real),
            ("aed", real),
            ("start_loss", real),
            ("ending", ctypes.c_int32),
            ("phase_count", ctypes.c_int32),
            ("phases_kept", ctypes.c_int32),
            ("event_count", ctypes.c_int32),
        )


class Library:
    """A compiled library and the types that go with it."""

    def __init__(self, path: Path, prefix: str = "hopform", package: ModuleType = hopform_solver) -> None:
        try:
            self._handle = ctypes.CDLL(str(path))
        except OSError as error:
            raise BackendError(f"the compiled library {path.name} cannot be loaded: {error}") from None
        self._prefix = prefix
        self.records: ModuleType = sys.modules[f"{package.__name__}.records"]
        try:
            source = self._function("source", ctypes.c_char_p)().decode()
        except AttributeError:
            raise BackendError(f"{path.name} is no library of {package.__name__}: it does not say its source") from None
        if source != package.SOURCE:
            raise BackendError(
                f"the compiled library {path.name} is stale: it was built from {source}, {package.__name__} from "
                f"{package.SOURCE}; rebuild it with `make test` or reinstall hopform"
            )
        self._types: dict[str, Types] = {}
        self._functions: dict[tuple[str, str], Any] = {}

    def _function(self, name: str, result: Any = ctypes.c_int32) -> Any:
        function = getattr(self._handle, f"{self._prefix}_{name}")
        function.restype = result
        return function

    def address(self, name: str) -> int:
        """Where a function of the library lies in memory."""
        address = ctypes.cast(self._function(name), ctypes.c_void_p).value
        assert address is not None
        return address

    def types(self, dtype: np.dtype[Any]) -> Types:
        suffix = {np.dtype(np.float32): "f32", np.dtype(np.float64): "f64"}[dtype]
        if suffix not in self._types:
            self._types[suffix] = Types(suffix, self.records)
        return self._types[suffix]

    def call(self, name: str, types: Types, *arguments: Any) -> int:
        key = name, types.suffix
        if key not in self._functions:
            self._functions[key] = self._function(f"{name}_{types.suffix}")
        status: int = self._functions[key](*arguments)
        if status < 0:
            raise HopformError(_REASONS.get(status, f"{name} failed with status {status}"))
        return status


@cache
def library() -> Library:
    """The library that belongs to this installation; BackendError if there is none or it is stale."""
    if not LIBRARY.is_file():
        raise BackendError(f"there is no compiled library {LIBRARY.name}: hopform was installed without a C compiler")
    return Library(LIBRARY)


@dataclass(frozen=True)
class Solved:
    """A stance solved by the library: the caller's view of its structs."""

    library: Library
    types: Types
    plan: Any
    steps: Any
    phases: Any
    stance: Any

    @property
    def ending(self) -> int:
        return int(self.stance.ending)

    @property
    def duration(self) -> float:
        return float(self.stance.duration)

    @property
    def end(self) -> State:
        return _state(self.stance.end)

    @property
    def apex(self) -> float:
        return float(self.stance.apex)

    @property
    def aed(self) -> float:
        return float(self.stance.aed)

    def phase_rows(self) -> list[tuple[float, State, int, int, int]]:
        """Each phase: when and where it starts, its mode, the event that starts it, the step of the current."""
        kept = self.phases[: self.stance.phases_kept]
        return [(p.t, State(p.x1, p.v1, p.v2, p.y), p.mode, p.event, p.step) for p in kept]

    def state_at(self, t: NDArray[np.floating]) -> State:
        """States at times of one dimension."""
        state = self.types.state()
        rows = np.empty((t.size, len(State._fields)), dtype=t.dtype)
        for row, time in zip(rows, t.tolist(), strict=True):
            self.library.call(
                "stance_at", self.types, ctypes.byref(self.plan), self.steps, self.phases,
                ctypes.byref(self.stance), self.types.real(time), ctypes.byref(state),
            )  # fmt: skip
            row[:] = (state.x1, state.v1, state.v2, state.y)
        return State(*rows.T)

    def grid(self, dt: float, out: State) -> None:
        """Put the states at i dt, i = 0, 1, ..., into arrays of one dimension, each in one piece."""
        self.library.call(
            "stance_grid", self.types, ctypes.byref(self.plan), self.steps, self.phases, ctypes.byref(self.stance),
            self.types.real(0.0), self.types.real(dt), ctypes.c_int32(out.x1.size),
            *(ctypes.c_void_p(column.ctypes.data) for column in out),
        )  # fmt: skip

    def energy_at(self, t: NDArray[np.floating]) -> tuple[Energy, Ledger, NDArray[np.floating]]:
        """Energies, ledger and loss at stops at times of one dimension, which must not decrease."""
        energies, ledgers = (self.types.energy * t.size)(), (self.types.ledger * t.size)()
        losses = (self.types.real * t.size)()
        self.library.call(
            "stance_energy", self.types, ctypes.byref(self.plan), self.steps, self.phases, ctypes.byref(self.stance),
            (self.types.real * t.size)(*t.tolist()), ctypes.c_int32(t.size), energies, ledgers, losses,
        )  # fmt: skip
        names = self.library.records.Ledger._fields
        energy = np.array([(e.body, e.total) for e in energies], dtype=t.dtype).reshape(-1, 2)
        ledger = np.array([[getattr(row, name) for name in names] for row in ledgers], dtype=t.dtype)
        columns = ledger.reshape(-1, len(names)).T
        return Energy(*energy.T), self.library.records.Ledger(*columns), np.array(losses[:], dtype=t.dtype)

    def sensitivities(self) -> NDArray[np.floating]:
        """Derivatives, rows times columns as in hopform_solver.sensitivity; NaN where there are none."""
        shape = (len(ROWS), 5 + len(self.library.records.Robot._fields))
        matrix = np.empty(shape, dtype=np.dtype(self.types.real))
        status = self.library.call(
            "stance_sensitivities", self.types, ctypes.byref(self.plan), self.steps, self.phases,
            ctypes.byref(self.stance), matrix.ctypes.data_as(ctypes.c_void_p),
        )  # fmt: skip
        if status == NO_DERIVATIVE:
            matrix[:] = np.nan
        if not self.plan.robot.g > 0.0:
            matrix[ROWS.index("apex")] = np.nan
        return matrix


@lru_cache(maxsize=256)
def plan_of(lib: Library, types: Types, parameters: tuple[Any, ...]) -> Any:
    """The plan of a robot, which nobody writes to once it is made."""
    plan = types.plan()
    lib.call("plan_init", types, ctypes.byref(plan), ctypes.byref(types.robot(*parameters)))
    return plan


def solve(
    parameters: tuple[Any, ...],
    start: State,
    steps: tuple[tuple[float, float], ...],
    horizon: float,
    max_phases: int,
    dtype: np.dtype[Any],
    with_library: Library | None = None,
) -> Solved:
    """Solve one stance with the compiled library; inputs as `hopform_solver.solve` takes them."""
    lib = with_library or library()
    types = lib.types(dtype)
    plan, stance = plan_of(lib, types, parameters), types.stance()
    c_steps = (types.step * len(steps))(*(types.step(*step) for step in steps))
    begin = types.state(*start)
    capacity = min(_FIRST_CAPACITY, max_phases + 1)
    while True:
        phases = (types.phase * capacity)()
        status = lib.call(
            "solve_stance", types, ctypes.byref(plan), ctypes.byref(begin), c_steps, ctypes.c_int32(len(steps)),
            types.real(horizon), ctypes.c_int32(max_phases), phases, ctypes.c_int32(capacity), ctypes.byref(stance),
        )  # fmt: skip
        if status != PHASES_NOT_KEPT:
            return Solved(lib, types, plan, c_steps, phases, stance)
        capacity = int(stance.phase_count)


def _state(struct: Any) -> State:
    return State(struct.x1, struct.v1, struct.v2, struct.y)
