"""The NumPy back end: one stance of the vectorised solver, seen as the C back end shows it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hopform_solver
from hopform._errors import HopformError
from hopform_solver.energy import energy_at, ledger_at
from hopform_solver.records import Energy, Ledger, Robot, State
from hopform_solver.sensitivity import sensitivities_of, tangents_of
from hopform_solver.stance import Solution, state_at


@dataclass(frozen=True)
class Solved:
    """A stance solved on arrays of length one."""

    solution: Solution

    def outcome(self) -> tuple[int, float, State, float, float]:
        """Ending, duration, state at the ending, apex, AED."""
        of = self.solution
        end = State(*(float(field) for field in of.end))
        return int(of.ending), float(of.duration), end, float(of.apex), float(of.aed)

    def event_rows(self) -> list[tuple[float, int]]:
        """Time and number of each event."""
        return [(t, event) for t, _, _, event, _ in self.phase_rows() if event]

    def phase_rows(self) -> list[tuple[float, State, int, int, int]]:
        """Each phase: when and where it starts, its mode, the event that starts it, the step of the current."""
        p = self.solution.phases
        columns = (p.t, p.x1, p.v1, p.v2, p.y, p.mode, p.event, p.step)
        rows = zip(*(column.tolist() for column in columns), strict=True)
        return [(t, State(x1, v1, v2, y), mode, event, step) for t, x1, v1, v2, y, mode, event, step in rows]

    def state(self, t: float) -> State:
        """The state at one time."""
        return State(*(float(column[0]) for column in self.state_at(np.array([t], self.solution.duration.dtype))))

    def state_at(self, t: NDArray[np.floating]) -> State:
        """States at times of one dimension."""
        return state_at(self.solution, 0, t)

    def grid(self, dt: float, out: State) -> None:
        """Put the states at i dt, i = 0, 1, ..., into arrays of one dimension."""
        real = self.solution.duration.dtype.type
        t = np.arange(out.x1.size, dtype=real) * real(dt)
        for column, values in zip(out, self.state_at(t), strict=True):
            column[...] = values

    def energy(self, t: float) -> Energy:
        """Energies at one time."""
        return Energy(*(float(column[0]) for column in self.energy_at(np.array([t], self.solution.duration.dtype))))

    def energy_at(self, t: NDArray[np.floating]) -> Energy:
        """Energies at times of one dimension."""
        return energy_at(self.solution, 0, t)

    def ledger_at(self, t: NDArray[np.floating]) -> tuple[Ledger, NDArray[np.floating]]:
        """Ledger and loss at stops at times of one dimension."""
        return ledger_at(self.solution, 0, t)

    def sensitivities(self) -> NDArray[np.floating]:
        """Derivatives, rows times columns as in hopform_solver.sensitivity; NaN where there are none."""
        return sensitivities_of(self.solution)

    def tangents(self, t: NDArray[np.floating]) -> tuple[State, NDArray[np.floating]]:
        """States at times of one dimension, which do not decrease, and the derivatives of x1, v1, v2, y there."""
        return self.state_at(t), tangents_of(self.solution, t)


def solve(
    parameters: Robot,
    start: State,
    steps: tuple[tuple[float, float], ...],
    horizon: float,
    max_phases: int,
    dtype: np.dtype[Any],
) -> Solved:
    """Solve one stance on arrays; HopformError if the numbers leave the range of the precision."""
    times, values = zip(*steps, strict=True)
    u = values[0] if len(values) == 1 else values
    with np.errstate(all="ignore"):
        solution = hopform_solver.solve(parameters, start, u, times, horizon, max_phases, dtype.type)
    if not all(np.isfinite(value) for value in (solution.duration, solution.aed, *solution.end)):
        raise HopformError("the numbers left the range of the precision: scale the robot or use float64")
    return Solved(solution)
