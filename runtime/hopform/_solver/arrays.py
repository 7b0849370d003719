"""The NumPy back end: the vectorised solver of a package, seen as the C back end shows it."""

from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np

from hopform._errors import HopformError
from hopform._solver import package
from hopform._solver.library import Backend
from hopform._solver.package import Array, Columns, FlightRow, LegState, Package, Precision, Steps, Target, records


class Solved(NamedTuple):
    """A stance solved on arrays of length one."""

    package: Package
    solution: Any

    def outcome(self) -> tuple[int, float, LegState, float, float]:
        """Ending, duration, state at the ending, apex, AED."""
        of = self.solution
        end = LegState(*(float(field) for field in of.end))
        return int(of.ending), float(of.duration), end, float(of.apex), float(of.aed)

    def phase_rows(self) -> list[tuple[float, LegState, int, int, int]]:
        """Each phase: when and where it starts, its mode, the event that starts it, the step of the current."""
        p = self.solution.phases
        rows = zip(*(column.tolist() for column in (p.t, p.x1, p.v1, p.v2, p.y, p.mode, p.event, p.step)), strict=True)
        return [(t, LegState(x1, v1, v2, y), mode, event, step) for t, x1, v1, v2, y, mode, event, step in rows]

    def state(self, t: float) -> LegState:
        """The state at one time."""
        return LegState(*(each.item() for each in self.state_at(np.array([t], self.solution.duration.dtype))))

    def state_at(self, t: Array) -> LegState:
        """States at times of one dimension."""
        return cast("LegState", self.package.stance.state_at(self.solution, 0, t))

    def grid(self, dt: float, out: LegState) -> None:
        """Put the states at i dt, i = 0, 1, ..., into arrays of one dimension."""
        real = self.solution.duration.dtype.type
        for column, values in zip(out, self.state_at(np.arange(out.x1.size, dtype=real) * real(dt)), strict=True):
            column[...] = values

    def energy_at(self, t: Array) -> records.Energy:
        """Energies at times of one dimension."""
        return cast("records.Energy", self.package.energy.energy_at(self.solution, 0, t))

    def ledger_at(self, t: Array) -> records.Ledger:
        """The ledger at times of one dimension."""
        return cast("records.Ledger", self.package.energy.ledger_at(self.solution, 0, t))

    def compression_max(self) -> float:
        """The largest compression."""
        with np.errstate(all="ignore"):
            return float(self.package.extrema.compressions(self.solution)[0])

    def sensitivities(self) -> Array:
        """Derivatives, rows times columns as in the package's `sensitivity`; NaN where there are none."""
        return cast("Array", self.package.sensitivity.sensitivities_of(self.solution))

    def tangents(self, t: Array) -> tuple[LegState, Array]:
        """States at times of one dimension, which do not decrease, and the derivatives of x1, v1, v2, y there."""
        return self.state_at(t), self.package.sensitivity.tangents_of(self.solution, t)


class ArrayFlight(NamedTuple):
    """A flight solved with NumPy."""

    package: Package
    flight: Any

    def rows(self) -> list[FlightRow]:
        """The phases."""
        return [(float(p.t), float(p.x1), float(p.v1), p.side, p.limit, p.event) for p in self.flight.phases]

    def state_at(self, t: Array) -> LegState:
        """States at times of one dimension."""
        return cast("LegState", self.package.flight.flight_at(self.flight, t))

    def energy_at(self, t: Array) -> tuple[records.Energy, records.FlightLedger]:
        """Energies and ledger at times of one dimension."""
        of = self.package.flight
        return of.flight_energy_at(self.flight, t), of.flight_ledger_at(self.flight, t)


class OnArrays:
    """A generated package as a solver, by NumPy."""

    name: Backend = "numpy"

    def __init__(self, package: Package) -> None:
        self.package = package

    def solve_stance(
        self, parameters: Any, start: LegState, steps: Steps, horizon: float, max_phases: int, dtype: Precision
    ) -> Solved:
        """One stance; HopformError if the numbers leave the range of the precision."""
        times, values = zip(*steps, strict=True)
        u = values[0] if len(values) == 1 else values
        with np.errstate(all="ignore"):
            solution = self.package.stance.solve(parameters, start, u, times, horizon, max_phases, dtype.type)
        _check_range(solution.duration, solution.aed, *solution.end)
        return Solved(self.package, solution)

    def solve_flight(
        self, parameters: Any, start: LegState, ground: float, gains: records.Gains | None, horizon: float,
        max_phases: int, dtype: Precision,
    ) -> ArrayFlight:  # fmt: skip
        """One flight; HopformError if the numbers leave the range of the precision."""
        with np.errstate(all="ignore"):
            flight = self.package.flight.solve_flight(parameters, start, ground, gains, horizon, max_phases, dtype.type)
        _check_range(flight.duration, flight.apex, flight.v2_after, *flight.end, *(() if flight.phases else (np.nan,)))
        return ArrayFlight(self.package, flight)

    def choose_current(
        self, parameters: Any, start: LegState, target: Target, max_phases: int, dtype: Precision
    ) -> tuple[float, float, int, int]:
        """Current [A], hop height [m] (0 without take-off), status as in COMMANDS, and how many stances were solved."""
        found = self.package.control.choose(parameters, start, target, max_phases, dtype.type)
        return cast("tuple[float, float, int, int]", found)

    def apexes(self, parameters: Any, starts: list[LegState], currents: Array, horizon: float) -> tuple[Array, Array]:
        """The next apex, NaN without take-off, and the largest x1, (starts, currents)."""
        columns = LegState(*(np.repeat([start[n] for start in starts], currents.size) for n in range(4)))
        u = np.tile(currents, len(starts))
        with np.errstate(all="ignore"):
            found = self.package.trial.try_currents(parameters, columns, u, horizon, package.MAX_PHASES)
        shape = len(starts), currents.size
        apex = np.where(found.takes_off, found.apex, np.nan).astype(float)
        return apex.reshape(shape), found.largest_x1.astype(float).reshape(shape)

    def solve_columns(
        self, columns: Columns, results: package.Results, readings: package.Readings, max_phases: int, events: bool
    ) -> package.Events:
        """Put the results and readings of stances into arrays; their events."""
        of, real, size = self.package, results[1].dtype, results[0].size
        inputs = np.array([np.broadcast_to(column, size) for column in columns], real)
        results[0][...] = status = self._refusals(*inputs)
        for into in (*results[1:-1], *readings.values()):
            into[...] = np.nan
        sound = np.flatnonzero(status == 0)
        x1, v1, v2, y, u, horizon, *fields = inputs[:, sound]
        robot, start = of.records.Robot(*fields), LegState(x1, v1, v2, y)
        read = {"sensitivities": of.sensitivity.sensitivities_of, "compressions": of.extrema.compressions}
        with np.errstate(all="ignore"):
            solution = of.stance.solve(robot, start, u, 0.0, horizon, max_phases, real.type)
            x2 = of.formulas.body_height(solution.plan.robot, solution.end.x1, solution.end.y)
            found_readings = {name: read[name](solution) for name in readings}
        end, phases = solution.end, solution.phases
        found = (solution.ending, solution.duration, end.x1, end.v1, x2, end.v2, solution.apex, solution.aed)
        finite = np.all([np.isfinite(value) for value in (*found[1:6], solution.aed)], axis=0)
        results[0][sound[~finite]] = -8
        for into, values in zip((*results[:-1], *readings.values()), (*found, *found_readings.values()), strict=True):
            into[sound[finite]] = values[finite]
        happens = (phases.event != 0) & finite[phases.lane]
        lane, t, kind = sound[phases.lane[happens]], phases.t[happens], phases.event[happens]
        results[-1][...] = np.bincount(lane, minlength=size)
        return [(lane, t, kind)]

    def _refusals(self, x1: Array, v1: Array, v2: Array, y: Array, u: Array, horizon: Array, *fields: Array) -> Any:
        """The negative status of what the C library refuses, 0 for what it solves."""
        of = self.package
        inside = partial(of.checked.inside, largest=of.limits.NEVER[u.dtype])
        robot, domains = of.records.Robot(*fields), [field.domain for field in of.records.ROBOT_FIELDS]
        state = [*map(inside, ["real"] * 4, (x1, v1, v2, y)), robot.x1_min <= x1, x1 <= robot.x1_max]
        allowed = {
            -2: np.all([*map(inside, domains, robot), robot.x1_min <= robot.x1_max], axis=0),
            -3: np.all([*state, (v2 == 0.0) | (not of.limits.BODY_IS_FIXED)], axis=0),
            -4: (y >= 0.0) | of.limits.FOOT_IS_FIXED,
            -5: inside("real", u),
            -6: inside("positive", horizon),
        }
        return np.select([~each for each in allowed.values()], list(allowed), 0)


def _check_range(*numbers: Any) -> None:
    if not all(np.isfinite(number) for number in numbers):
        raise HopformError(records.REFUSALS[-8])
