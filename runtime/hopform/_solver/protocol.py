"""The interface of a back end. A state here is x1, v1, v2 and the compression y."""

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hopform._solver.columns import Columns, Events
from hopform._solver.library import Backend
from hopform._solver.package import Energy, FlightLedger, Gains, Ledger, records

Array = NDArray[np.floating]
Steps = tuple[tuple[float, float], ...]
"""Steps of the current [s, A]."""
Target = tuple[float, float, float, float]
"""h_des, datum, stop_margin [m], horizon [s]."""


class FlightRow(NamedTuple):
    """A phase: when and where it starts, the sign of v_1, that of the pull at its limit, and the event that starts
    it.
    """

    t: float
    x1: float
    v1: float
    side: int
    limit: int
    event: int


class SolvedStance(Protocol):
    """A stance as its solver keeps it; arrays of times have one dimension."""

    def outcome(self) -> tuple[int, float, records.LegState, float, float]:
        """Ending, duration, state at the ending, apex, AED."""
        ...

    def event_rows(self) -> list[tuple[float, int]]:
        """Time and number of each event."""
        ...

    def phase_rows(self) -> list[tuple[float, records.LegState, int, int, int]]:
        """Each phase: when and where it starts, its mode, the event that starts it, the step of the current."""
        ...

    def state(self, t: float) -> records.LegState:
        """The state at one time."""
        ...

    def state_at(self, t: Array) -> records.LegState:
        """States at times."""
        ...

    def grid(self, dt: float, out: records.LegState) -> None:
        """Put the states at i dt, i = 0, 1, ..., into arrays, each in one piece."""
        ...

    def energy(self, t: float) -> Energy:
        """Energies at one time."""
        ...

    def energy_at(self, t: Array) -> Energy:
        """Energies at times."""
        ...

    def ledger_at(self, t: Array) -> Ledger:
        """The ledger at times, which do not decrease."""
        ...

    def compression_max(self) -> float:
        """The largest compression."""
        ...

    def sensitivities(self) -> Array:
        """Derivatives, rows times columns as in the package's `sensitivity`; NaN where there are none."""
        ...

    def tangents(self, t: Array) -> tuple[records.LegState, Array]:
        """States at times, which do not decrease, and the derivatives of x1, v1, v2, y there."""
        ...


class SolvedFlight(Protocol):
    """A flight as its solver keeps it; arrays of times have one dimension."""

    @property
    def flight(self) -> Any:
        """ending, duration, apex, apex_time, v2_after, impact_loss."""
        ...

    @property
    def gains(self) -> Gains:
        """Gains of the actuator's law."""
        ...

    @property
    def end(self) -> records.LegState:
        """The state at the ending."""
        ...

    def rows(self) -> list[FlightRow]:
        """The phases."""
        ...

    def state_at(self, t: Array) -> records.LegState:
        """States at times."""
        ...

    def energy_at(self, t: Array) -> tuple[Energy, FlightLedger]:
        """Energies and ledger at times, which do not decrease."""
        ...


class BackEnd(Protocol):
    """A generated package at work: `C` by its compiled library, `OnArrays` by NumPy."""

    name: Backend

    def solve_stance(
        self,
        parameters: Any,
        start: records.LegState,
        steps: Steps,
        horizon: float,
        max_phases: int,
        dtype: np.dtype[Any],
    ) -> SolvedStance:
        """One stance; HopformError if the numbers leave the range of the precision."""
        ...

    def solve_flight(
        self, parameters: Any, start: records.LegState, gains: Gains | None, horizon: float, max_phases: int,
        dtype: np.dtype[Any],
    ) -> SolvedFlight:  # fmt: skip
        """One flight; HopformError if the numbers leave the range of the precision."""
        ...

    def choose_current(
        self, parameters: Any, start: records.LegState, target: Target, max_phases: int, dtype: np.dtype[Any]
    ) -> tuple[float, float, int, int]:
        """Current [A], hop height [m] (0 without take-off), status as in COMMANDS, and how many stances were solved."""
        ...

    def apexes(
        self, parameters: Any, starts: list[records.LegState], currents: NDArray[np.float64], horizon: float,
        max_phases: int,
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # fmt: skip
        """The next apex, NaN without take-off, and the largest x1, (starts, currents)."""
        ...

    def solve_columns(self, columns: Columns, results: Sequence[NDArray[Any]], max_phases: int, events: bool) -> Events:
        """Put the results of stances into arrays; the events, if they are asked for."""
        ...

    def differentiate_columns(
        self, columns: Columns, matrices: NDArray[Any], status: NDArray[Any], max_phases: int
    ) -> None:
        """Put the derivatives of stances, rows times columns, into an array; `status` is that of `solve_columns`."""
        ...

    def compress_columns(self, columns: Columns, most: NDArray[Any], status: NDArray[Any], max_phases: int) -> None:
        """Put the largest compressions of stances into an array, NaN where there is none."""
        ...
