"""The Python back end: the engine that is printed from the C, where there is no compiled library.

It takes and gives what the C back end does, to the same bits. Its structs are objects, which nothing changes once a
motion is solved.
"""

import pickle
from collections.abc import Callable, Iterable
from functools import lru_cache
from types import ModuleType
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from hopform._errors import HopformError
from hopform._solver import package
from hopform._solver.library import Backend
from hopform._solver.package import (
    ROWS,
    Array,
    Columns,
    Events,
    FlightRow,
    LegState,
    Package,
    Precision,
    Steps,
    records,
)

_FIRST_CAPACITY = 16
"""Phases that are held at first; hardly any stance has more."""


class Refused(HopformError):
    """A negative status of a function."""

    def __init__(self, name: str, status: int) -> None:
        super().__init__(records.REFUSALS.get(status, f"{name} failed with status {status}"))
        self.status = status


class Engine(NamedTuple):
    """The printed engine of a package in one precision."""

    package: Package
    dtype: Precision

    @property
    def module(self) -> ModuleType:
        return cast(ModuleType, getattr(self.package, {"f": "engine_f32", "d": "engine_f64"}[self.dtype.char]))

    def reals(self, numbers: Iterable[Any]) -> list[Any]:
        """Numbers of the precision, as the engine computes with them; to infinity what is too large."""
        with np.errstate(all="ignore"):
            array = np.array(list(numbers), self.dtype)
        return array.tolist() if self.dtype.char == "d" else list(array)

    def made(self, name: str, *numbers: Any) -> Any:
        """A struct of a name."""
        return getattr(self.module, name)(*self.reals(numbers))

    def many(self, name: str, count: int) -> list[Any]:
        kind = getattr(self.module, name)
        return [kind() for _ in range(count)]

    def room(self, *shape: int) -> list[Any]:
        """Numbers to be written."""
        return self.reals([0.0]) * int(np.prod(shape))

    def call(self, name: str, *arguments: Any) -> int:
        """The status of a function; HopformError if that is negative."""
        with np.errstate(all="ignore"):
            status: int = getattr(self.module, name)(*arguments)
        if status < 0:
            raise Refused(name, status)
        return status

    def array(self, numbers: Iterable[Any], *shape: int) -> NDArray[Any]:
        return np.array(list(numbers), self.dtype).reshape(shape or (-1,))

    def columns(self, structs: list[Any], names: tuple[str, ...]) -> list[NDArray[Any]]:
        """A member of each struct in an array, for each name."""
        return [self.array(getattr(struct, name) for struct in structs) for name in names]


def _made_plan(engine: Engine, parameters: tuple[Any, ...]) -> tuple[Any, int]:
    """The plan of a robot and its status, 0 or a warning."""
    plan = engine.module.Plan()
    return plan, engine.call("plan_init", plan, engine.made("Robot", *parameters))


@lru_cache(maxsize=256)
def _plan_of(engine: Engine, parameters: tuple[Any, ...]) -> Any:
    """The plan of a robot."""
    return _made_plan(engine, parameters)[0]


def _with_room(engine: Engine, kind: str, most: int, solve: Callable[[list[Any], int], int]) -> list[Any]:
    """The phases of what solves, called again with more of them where they were too few."""
    capacity = min(_FIRST_CAPACITY, most)
    while True:
        phases = engine.many(kind, capacity)
        if solve(phases, capacity) != engine.module.PHASES_NOT_KEPT or capacity == most:
            return phases
        capacity = min(8 * capacity, most)


def _unpickled(kind: Any, parts: bytes) -> Any:
    """What was pickled: objects with slots, which protocols below 2 do not know, are in bytes of their own."""
    return kind(*pickle.loads(parts))


class Solved(NamedTuple):
    """A stance solved by the printed engine: its plan, steps, phases and results."""

    engine: Engine
    plan: Any
    steps: list[Any]
    phases: list[Any]
    stance: Any

    def __reduce__(self) -> Any:
        return _unpickled, (Solved, pickle.dumps(tuple(self), pickle.HIGHEST_PROTOCOL))

    def _call(self, name: str, *arguments: Any) -> int:
        return self.engine.call(name, self.plan, self.steps, self.phases, self.stance, *arguments)

    def plan_status(self, parameters: tuple[Any, ...]) -> int:
        """The status of the plan of a robot in this precision, 0 or a warning."""
        return _made_plan(self.engine, parameters)[1]

    def outcome(self) -> tuple[int, float, LegState, float, float]:
        """Ending, duration, state at the ending, apex, AED."""
        of = self.stance
        return of.ending, float(of.duration), _state(of.end), float(of.apex), float(of.aed)

    def phase_rows(self) -> list[tuple[float, LegState, int, int, int]]:
        """Each phase: when and where it starts, its mode, the event that starts it, the step of the current."""
        return [(float(p.t), _state(p), p.mode, p.event, p.step) for p in self.phases]

    def state(self, t: float) -> LegState:
        """The state at one time."""
        state = self.engine.module.State()
        self._call("stance_at", *self.engine.reals([t]), state)
        return _state(state)

    def state_at(self, t: Array) -> LegState:
        """States at times of one dimension."""
        columns = [self.engine.room(t.size) for _ in LegState._fields]
        self._call("stance_states", self.engine.reals(t), t.size, columns)
        return LegState(*map(self.engine.array, columns))

    def grid(self, dt: float, out: LegState) -> None:
        """Put the states at i dt, i = 0, 1, ..., into arrays of one dimension."""
        columns = [self.engine.room(out.x1.size) for _ in LegState._fields]
        self._call("stance_grid", *self.engine.reals([0.0, dt]), out.x1.size, columns)
        for into, values in zip(out, columns, strict=True):
            into[...] = values

    def energy_at(self, t: Array) -> records.Energy:
        """Energies at times of one dimension."""
        energies = self.engine.many("Energy", t.size)
        self._call("stance_energy", self.engine.reals(t), t.size, energies, None, None)
        return records.Energy(*self.engine.columns(energies, records.Energy._fields))

    def ledger_at(self, t: Array) -> records.Ledger:
        """The ledger at times of one dimension, which must not decrease."""
        of, count = self.engine.package.records, t.size
        energies, ledgers = self.engine.many("Energy", count), self.engine.many("Ledger", count)
        losses = self.engine.room(count)
        self._call("stance_energy", self.engine.reals(t), count, energies, ledgers, losses)
        work = dict(zip(of.Work._fields, self.engine.columns(ledgers, of.Work._fields), strict=True))
        return cast("records.Ledger", of.Ledger(**work, stop_loss=self.engine.array(losses)))

    def compression_max(self) -> float:
        """The largest compression."""
        most = self.engine.room(1)
        self._call("stance_compression", most)
        return float(most[0])

    def sensitivities(self) -> Array:
        """Derivatives, rows times columns as in the package's `elements`; NaN where there are none."""
        numbers = self.engine.room(len(ROWS), self._columns)
        status = self._call("stance_sensitivities", numbers)
        matrix = self.engine.array(numbers, len(ROWS), self._columns)
        if status == self.engine.module.NO_DERIVATIVE:
            matrix[:] = np.nan
        fall = self.engine.package.formulas.fall_of(self.plan.robot)
        if self.stance.ending != package.TAKEOFF or not fall > 0.0:
            matrix[ROWS.index("apex")] = np.nan
        return matrix

    def tangents(self, t: Array) -> tuple[LegState, Array]:
        """States at times of one dimension, which do not decrease, and the derivatives of x1, v1, v2, y there."""
        shape = t.size, len(LegState._fields), self._columns
        states, numbers = self.engine.many("State", t.size), self.engine.room(*shape)
        self._call("stance_tangents", self.engine.reals(t), t.size, states, numbers)
        return LegState(*self.engine.columns(states, LegState._fields)), self.engine.array(numbers, *shape)

    @property
    def _columns(self) -> int:
        return len(self.engine.package.elements.COLUMNS)


class SolvedFlight(NamedTuple):
    """A flight solved by the printed engine: its plan, phases and results."""

    engine: Engine
    plan: Any
    phases: list[Any]
    flight: Any

    def __reduce__(self) -> Any:
        return _unpickled, (SolvedFlight, pickle.dumps(tuple(self), pickle.HIGHEST_PROTOCOL))

    def rows(self) -> list[FlightRow]:
        """The phases."""
        return [(float(p.t), float(p.x1), float(p.v1), p.side, p.limit, p.event) for p in self.phases]

    def state_at(self, t: Array) -> LegState:
        """States at times of one dimension."""
        states = self.engine.many("State", t.size)
        self.engine.call("flight_at", self.plan, self.phases, self.flight, self.engine.reals(t), t.size, states)
        return LegState(*self.engine.columns(states, LegState._fields))

    def energy_at(self, t: Array) -> tuple[records.Energy, records.FlightLedger]:
        """Energies and ledger at times of one dimension, which do not decrease."""
        engine, of = self.engine, self.engine.package.records
        work = of.FlightWork._fields
        energies, ledgers = engine.many("Energy", t.size), engine.many("FlightLedger", t.size)
        losses = engine.room(t.size)
        asked = engine.reals(t), t.size
        engine.call("flight_energy", self.plan, self.phases, self.flight, *asked, energies, ledgers, losses)
        entries = dict(zip(work, engine.columns(ledgers, work), strict=True))
        ledger = of.FlightLedger(**entries, stop_loss=engine.array(losses))
        return records.Energy(*engine.columns(energies, records.Energy._fields)), ledger


def _state(struct: Any) -> LegState:
    return LegState(*(float(getattr(struct, name)) for name in LegState._fields))


class Python:
    """The printed engine of a package as a back end."""

    name: Backend = "python"

    def __init__(self, package: Package) -> None:
        self.package = package

    def solve_stance(
        self, parameters: Any, start: LegState, steps: Steps, horizon: float, max_phases: int, dtype: Precision
    ) -> Solved:
        """One stance; HopformError if the numbers leave the range of the precision."""
        engine = Engine(self.package, dtype)
        plan, stance = _plan_of(engine, tuple(parameters)), engine.module.Stance()
        begin, taken = engine.made("State", *start), [engine.made("Step", *step) for step in steps]
        (longest,) = engine.reals([horizon])

        def solve(phases: list[Any], capacity: int) -> int:
            given = plan, begin, taken, len(taken), longest, max_phases
            return engine.call("solve_stance", *given, phases, capacity, stance)

        phases = _with_room(engine, "Phase", max_phases + 1, solve)
        return Solved(engine, plan, taken, phases[: stance.phases_kept], stance)

    def solve_flight(
        self, parameters: Any, start: LegState, ground: float, gains: records.Gains | None, horizon: float,
        max_phases: int, dtype: Precision,
    ) -> SolvedFlight:  # fmt: skip
        """One flight; HopformError if the numbers leave the range of the precision."""
        engine = Engine(self.package, dtype)
        plan, flight = _plan_of(engine, tuple(parameters)), engine.module.Flight()
        law, begin = None if gains is None else engine.made("Gains", *gains), engine.made("State", *start)
        level, longest = engine.reals([ground, horizon])

        def solve(phases: list[Any], capacity: int) -> int:
            given = plan, begin, level, law, longest, max_phases
            return engine.call("solve_flight", *given, phases, capacity, flight)

        phases = _with_room(engine, "FlightPhase", max_phases + 1, solve)
        return SolvedFlight(engine, plan, phases[: flight.phases_kept], flight)

    def choose_current(
        self, parameters: Any, start: LegState, target: package.Target, max_phases: int, dtype: Precision
    ) -> tuple[float, float, int, int]:
        """Current [A], hop height [m] (0 without take-off), status as in COMMANDS, and how many stances were solved.

        target: h_des, datum, stop_margin [m], horizon [s].
        """
        engine = Engine(self.package, dtype)
        plan, search, command = _plan_of(engine, tuple(parameters)), engine.module.Search(), engine.module.Command()
        asked = search, plan, engine.made("State", *start), engine.made("Target", *target, *package.WITHOUT_CAPS)

        def solve(phases: list[Any], capacity: int) -> int:
            return engine.call("choose_current", *asked, phases, capacity, command)

        _with_room(engine, "Phase", max_phases, solve)
        return float(command.u), float(command.apex), command.status, search.trials

    def try_currents(
        self, parameters: Any, starts: list[LegState], currents: Array, horizon: float, max_phases: int
    ) -> NDArray[Any]:
        """The stance of each current from each state, (states, currents), a structured array with the fields of
        hopform_trial.
        """
        engine = Engine(self.package, np.dtype(np.float64))
        shape = len(starts), currents.size
        trials = engine.many("Trial", shape[0] * shape[1])
        states = [engine.made("State", *start) for start in starts]
        asked = _plan_of(engine, tuple(parameters)), states, shape[0], engine.reals(currents), shape[1]

        def solve(phases: list[Any], capacity: int) -> int:
            return engine.call("try_currents", *asked, float(horizon), phases, capacity, trials)

        _with_room(engine, "Phase", max_phases, solve)
        fields = {name: [getattr(trial, name) for trial in trials] for name in engine.module.Trial.__slots__}
        columns = {name: np.array(values) for name, values in fields.items()}
        made = np.zeros(len(trials), [(name, column.dtype) for name, column in columns.items()])
        for name, column in columns.items():
            made[name] = column
        return made.reshape(shape)

    def apexes(self, parameters: Any, starts: list[LegState], currents: Array, horizon: float) -> tuple[Array, Array]:
        """The next apex, NaN without take-off, and the largest x1, (starts, currents)."""
        made = self.try_currents(parameters, starts, currents, horizon, package.MAX_PHASES)
        return np.where(made["takes_off"], made["apex"], np.nan), made["largest_x1"]

    def solve_columns(
        self, columns: Columns, results: package.Results, readings: package.Readings, max_phases: int, events: bool
    ) -> Events:
        """Put the results and readings of stances into arrays; the events, if they are asked for."""
        real, size = results[1].dtype, results[0].size
        states = len(package.STATES)
        rows = zip(*(np.broadcast_to(column, size).tolist() for column in columns), strict=True)
        for into in (*results[1:-1], *readings.values()):
            into[...] = np.nan
        found: list[tuple[int, float, int]] = []
        for n, row in enumerate(rows):
            start, u, horizon, parameters = LegState(*row[:4]), row[4], row[5], row[states:]
            try:
                solved = self.solve_stance(parameters, start, ((0.0, u),), horizon, max_phases, real)
            except Refused as error:
                results[0][n], results[-1][n] = error.status, 0
                continue
            self._put(solved, [result[n : n + 1] for result in results])
            with np.errstate(all="ignore"):
                for name, into in readings.items():
                    into[n] = solved.sensitivities() if name == "sensitivities" else solved.compression_max()
            found += ((n, t, event) for t, _, _, event, _ in solved.phase_rows() if event) if events else ()
        lanes, times, kinds = zip(*found, strict=True) if found else ((), (), ())
        return [(np.array(lanes, np.intp), np.array(times, real), np.array(kinds, np.int8))]

    @staticmethod
    def _put(solved: Solved, results: list[NDArray[Any]]) -> None:
        """The results of a stance, with the height of the body in place of the compression."""
        of, engine = solved.stance, solved.engine.module
        robot, flies = solved.plan.robot, of.ending == engine.ENDING_TAKEOFF
        with np.errstate(all="ignore"):
            x2 = engine.body_height(robot, of.end.x1, of.end.y)
            apex = of.apex if flies and engine.fall_of(robot) > 0.0 else np.nan
        row = of.ending, of.duration, of.end.x1, of.end.v1, x2, of.end.v2, apex, of.aed, of.event_count
        for result, value in zip(results, row, strict=True):
            result[0] = value
