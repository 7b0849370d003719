"""Flights on both back ends: the compiled library by ctypes, and the solver of hopform_solver, seen alike."""

import ctypes
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform import _robots as robots
from hopform._errors import BackendError, HopformError
from hopform._solver import c as native
from hopform_solver import flight as solver
from hopform_solver.records import Energy, FlightLedger, Gains, Robot, State

_CAPACITY = 32


class Row(NamedTuple):
    """A phase: when and where it starts, the sign of v_1, that of the pull at its limit, and the event that starts it."""

    t: float
    x1: float
    v1: float
    side: int
    limit: int
    event: int


@lru_cache(maxsize=8)
def _opened(dtype: np.dtype[Any]) -> tuple[native.Library, native.Types]:
    library = native.library()
    return library, library.types(dtype)


@lru_cache(maxsize=256)
def _plan_of(parameters: Robot, dtype: np.dtype[Any]) -> Any:
    library, types = _opened(dtype)
    return ctypes.byref(native.plan_of(library, types, parameters))


class _Recent:
    """The plans of the robots that flew last; a robot is known by being the same object, which costs no hash."""

    def __init__(self) -> None:
        self._plans: dict[tuple[int, np.dtype[Any]], tuple[robots.Robot, Any]] = {}

    def plan(self, robot: robots.Robot, dtype: np.dtype[Any]) -> Any:
        known = self._plans.get((id(robot), dtype))
        if known is not None and known[0] is robot:
            return known[1]
        plan = _plan_of(robot.parameters, dtype)
        if len(self._plans) >= 64:
            self._plans.clear()
        self._plans[id(robot), dtype] = robot, plan
        return plan


_RECENT = _Recent()


@dataclass(frozen=True)
class NativeFlight:
    """A flight solved by the library; it can be pickled, as parameters and the bytes of its structs."""

    library: native.Library
    types: native.Types
    parameters: Robot
    plan: Any
    phases: Any
    flight: Any

    def __reduce__(self) -> Any:
        kept = bytes(self.phases)[: ctypes.sizeof(self.types.FlightPhase) * self.flight.phases_kept]
        dtype = np.dtype(self.types.real)
        return _flight_again, (self.library.source, dtype, self.parameters, kept, bytes(self.flight))

    @property
    def gains(self) -> Gains:
        return Gains(self.flight.gains.Kp, self.flight.gains.Kd)

    @property
    def end(self) -> State:
        end = self.flight.end
        return State(end.x1, end.v1, end.v2, end.y)

    def rows(self) -> list[Row]:
        kept = self.phases[: self.flight.phases_kept]
        return [Row(p.t, p.x1, p.v1, p.side, p.limit, p.event) for p in kept]

    def state_at(self, t: NDArray[np.floating]) -> State:
        """States at times of one dimension."""
        rows = np.empty((t.size, len(State._fields)), dtype=t.dtype)
        self._call("flight_at", np.ascontiguousarray(t), rows)
        return State(*rows.T)

    def energy_at(self, t: NDArray[np.floating]) -> tuple[Energy, FlightLedger, NDArray[np.floating]]:
        """Energies, ledger and loss at stops at times of one dimension, which do not decrease."""
        energy = np.empty((t.size, len(Energy._fields)), dtype=t.dtype)
        ledger = np.empty((t.size, len(FlightLedger._fields)), dtype=t.dtype)
        losses = np.empty_like(t)
        self._call("flight_energy", np.ascontiguousarray(t), energy, ledger, losses)
        return Energy(*energy.T), FlightLedger(*ledger.T), losses

    def _call(self, name: str, t: NDArray[np.floating], *out: NDArray[np.floating]) -> None:
        self.library.call(
            name, self.types, self.plan, self.phases, ctypes.byref(self.flight),
            native.pointer(t), ctypes.c_int32(t.size), *map(native.pointer, out),
        )  # fmt: skip


@dataclass(frozen=True)
class ArrayFlight:
    """A flight solved with NumPy."""

    flight: solver.FlightSolution

    @property
    def gains(self) -> Gains:
        return Gains(*map(float, self.flight.gains))

    @property
    def end(self) -> State:
        return State(*map(float, self.flight.end))

    def rows(self) -> list[Row]:
        phases = self.flight.phases
        return [Row(float(p.t), float(p.x1), float(p.v1), p.side, p.limit, p.event) for p in phases]

    def state_at(self, t: NDArray[np.floating]) -> State:
        """States at times of one dimension."""
        return solver.flight_at(self.flight, t)

    def energy_at(self, t: NDArray[np.floating]) -> tuple[Energy, FlightLedger, NDArray[np.floating]]:
        """Energies, ledger and loss at stops at times of one dimension."""
        ledger, losses = solver.flight_ledger_at(self.flight, t)
        return solver.flight_energy_at(self.flight, t), ledger, losses


def _flight_again(source: str, dtype: np.dtype[Any], parameters: Robot, phases: bytes, flight: bytes) -> NativeFlight:
    """The flight of a pickle; BackendError where another library would read its bytes."""
    library, types = _opened(dtype)
    if source != library.source:
        raise BackendError(f"the flight was solved by a library built from {source}, this one is from {library.source}")
    kept = types.FlightPhase * (len(phases) // ctypes.sizeof(types.FlightPhase))
    return NativeFlight(
        library,
        types,
        parameters,
        _plan_of(parameters, dtype),
        kept.from_buffer_copy(phases),
        types.Flight.from_buffer_copy(flight),
    )


def solve_native(
    robot: robots.Robot, start: State, gains: Gains | None, horizon: float, max_phases: int, dtype: np.dtype[Any]
) -> NativeFlight:
    """Solve one flight with the compiled library."""
    library, types = _opened(dtype)
    plan = _RECENT.plan(robot, dtype)
    flight, phases, capacity = types.Flight(), (types.FlightPhase * _CAPACITY)(), _CAPACITY
    begin = ctypes.byref(types.State(*start))
    law = None if gains is None else ctypes.byref(types.Gains(*gains))
    while True:
        status = library.call(
            "solve_flight", types, plan, begin, law, types.real(horizon), ctypes.c_int32(max_phases),
            phases, ctypes.c_int32(capacity), ctypes.byref(flight),
        )  # fmt: skip
        if status != native.PHASES_NOT_KEPT:
            return NativeFlight(library, types, robot.parameters, plan, phases, flight)
        capacity = int(flight.phase_count)
        phases = (types.FlightPhase * capacity)()


def solve_array(
    robot: robots.Robot, start: State, gains: Gains | None, horizon: float, max_phases: int, dtype: np.dtype[Any]
) -> ArrayFlight:
    """Solve one flight with NumPy; HopformError if the numbers leave the range of the precision."""
    with np.errstate(all="ignore"):
        flight = solver.solve_flight(robot.parameters, start, gains, horizon, max_phases, dtype.type)
    numbers = (flight.duration, flight.apex, flight.v2_after, *flight.end)
    if not flight.phases or not all(np.isfinite(value) for value in numbers):
        raise HopformError("the numbers left the range of the precision: scale the robot or use float64")
    return ArrayFlight(flight)
