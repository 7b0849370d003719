"""Flights by the compiled library."""

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hopform._errors import BackendError
from hopform._solver import c as native
from hopform._solver.columns import FlightRow
from hopform._solver.package import Energy, FlightLedger, Gains, records

_CAPACITY = 32


@dataclass(frozen=True)
class NativeFlight:
    """A flight solved by the library; it can be pickled, as parameters and the bytes of its structs."""

    library: native.Library
    types: native.Types
    parameters: records.Robot
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
    def end(self) -> records.LegState:
        end = self.flight.end
        return records.LegState(end.x1, end.v1, end.v2, end.y)

    def rows(self) -> list[FlightRow]:
        kept = self.phases[: self.flight.phases_kept]
        return [FlightRow(p.t, p.x1, p.v1, p.side, p.limit, p.event) for p in kept]

    def state_at(self, t: NDArray[np.floating]) -> records.LegState:
        """States at times of one dimension."""
        rows = np.empty((t.size, len(records.LegState._fields)), dtype=t.dtype)
        self._call("flight_at", np.ascontiguousarray(t), rows)
        return records.LegState(*rows.T)

    def energy_at(self, t: NDArray[np.floating]) -> tuple[Energy, FlightLedger]:
        """Energies and ledger at times of one dimension, which do not decrease."""
        energy = np.empty((t.size, len(Energy._fields)), dtype=t.dtype)
        work = np.empty((t.size, len(records.FlightWork._fields)), dtype=t.dtype)
        losses = np.empty_like(t)
        self._call("flight_energy", np.ascontiguousarray(t), energy, work, losses)
        return Energy(*energy.T), FlightLedger(**records.FlightWork(*work.T)._asdict(), stop_loss=losses)

    def _call(self, name: str, t: NDArray[np.floating], *out: NDArray[np.floating]) -> None:
        self.library.call(
            name, self.types, self.plan, self.phases, ctypes.byref(self.flight),
            native.pointer(t), ctypes.c_int32(t.size), *map(native.pointer, out),
        )  # fmt: skip


def _flight_again(
    source: str, dtype: np.dtype[Any], parameters: records.Robot, phases: bytes, flight: bytes
) -> NativeFlight:
    """The flight of a pickle; BackendError where another library would read its bytes."""
    library = native.library()
    if source != library.source:
        raise BackendError(f"the flight was solved by a library built from {source}, this one is from {library.source}")
    types = library.types(dtype)
    kept = (types.FlightPhase * (len(phases) // ctypes.sizeof(types.FlightPhase))).from_buffer_copy(phases)
    plan = ctypes.byref(native.plan_of(library, types, parameters))
    return NativeFlight(library, types, parameters, plan, kept, types.Flight.from_buffer_copy(flight))


def solve_flight(
    solver: native.Compiled, parameters: records.Robot, start: records.LegState, gains: Gains | None, horizon: float,
    max_phases: int, dtype: np.dtype[Any],
) -> NativeFlight:  # fmt: skip
    """One flight, by the compiled library."""
    library = solver.library
    types = library.types(dtype)
    plan = ctypes.byref(native.plan_of(library, types, parameters))
    flight, phases, capacity = types.Flight(), (types.FlightPhase * _CAPACITY)(), _CAPACITY
    begin = ctypes.byref(types.State(*start))
    law = None if gains is None else ctypes.byref(types.Gains(*gains))
    while True:
        status = library.call(
            "solve_flight", types, plan, begin, law, types.real(horizon), ctypes.c_int32(max_phases),
            phases, ctypes.c_int32(capacity), ctypes.byref(flight),
        )  # fmt: skip
        if status != native.PHASES_NOT_KEPT:
            return NativeFlight(library, types, parameters, plan, phases, flight)
        capacity = int(flight.phase_count)
        phases = (types.FlightPhase * capacity)()
