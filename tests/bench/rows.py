"""The rows of the table: every solver, at every tolerance, ready to run on a set of jobs."""

import dataclasses
import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hopform
from hopform_solver.records import ENDINGS, EVENTS
from tests.bench import casadi_peer, diffrax_peer, native, numba_peer, scipy_peers
from tests.bench.jobs import HORIZON, MAX_PHASES, ROBOT, Jobs, answers, write

TOLERANCES = (1e-6, 1e-8, 1e-10)
BATCH = 10_000
_ENDING = {word: number for number, word in ENDINGS.items()}
_EVENT = {word: number for number, word in EVENTS.items()}
Answers = NDArray[np.float64]


@dataclass(frozen=True)
class Ready:
    """A solver with its jobs: run(loops) is what is timed, answers(result) is not; `stances` are solved per loop."""

    run: Callable[[int], Any]
    answers: Callable[[Any], Answers]
    stances: int


@dataclass(frozen=True)
class Row:
    """A solver at a tolerance (None: exact). `ready` raises native.NotBuilt,
    ImportError or ValueError where it cannot run.
    """

    solver: str
    tolerance: float | None
    ready: Callable[[Jobs], Ready]

    @property
    def name(self) -> str:
        return self.solver if self.tolerance is None else f"{self.solver}, rtol {self.tolerance:.0e}"

    @property
    def is_ours(self) -> bool:
        return self.solver.startswith("hopform")


# ---- hopform ----


def _compiled(precision: str, entry: str, jobs: Jobs) -> Ready:
    library = native.hopform(precision)
    call = library.function(entry, jobs)

    def run(loops: int) -> Answers:
        return call(loops)

    library.prepare(jobs)
    return Ready(run, np.copy, len(jobs))


def _from_python(jobs: Jobs) -> Ready:
    cases = [(hopform.Robot(**jobs.robot(n)), jobs.start(n)) for n in range(len(jobs))]

    def run(loops: int) -> list[hopform.Stance]:
        for _ in range(loops):
            found = [
                hopform.solve_stance(robot, **start, horizon=HORIZON, max_phases=MAX_PHASES) for robot, start in cases
            ]
        return found

    def collect(stances: list[hopform.Stance]) -> Answers:
        table = answers(len(stances))
        for row, stance, (robot, _) in zip(table, stances, cases, strict=True):
            end = stance.end
            y = 0.0 if stance.status == "takeoff" else end.x1 - end.x2 + robot.L0 + robot.c
            head = (_ENDING[stance.status], stance.duration, end.x1, end.v1, end.v2, y, stance.aed)
            write(row, head, [(event.time, _EVENT[event.kind]) for event in stance.events])
        return table

    return Ready(run, collect, len(jobs))


def _batch(jobs: Jobs) -> Ready:
    """`hopform.solve_stances` on `BATCH` stances, events listed."""
    table = np.resize(jobs.table, (max(len(jobs), BATCH), jobs.table.shape[1]))
    inputs = dict(zip((*ROBOT, "x1", "v1", "v2", "u"), table.T.copy(), strict=True))
    base = hopform.load_robot("hopper_c")
    if all((jobs.table[:, : len(ROBOT)] == jobs.table[0, : len(ROBOT)]).all(axis=0)):
        base = dataclasses.replace(base, **jobs.robot(0))
        inputs = {name: values for name, values in inputs.items() if name not in ROBOT}
    solve_stances = hopform.solve_stances  # type: ignore[attr-defined]

    def run(loops: int) -> Any:
        for _ in range(loops):
            found = solve_stances(base, **inputs, max_phases=MAX_PHASES, horizon=HORIZON, events=True)
        return found

    def collect(batch: Any) -> Answers:
        found = answers(len(jobs))
        for n, row in enumerate(found):
            robot, (x1, v1, x2, v2) = jobs.robot(n), (float(field[n]) for field in batch.end)
            y = 0.0 if int(batch.status[n]) == 1 else x1 - x2 + robot["L0"] + robot["c"]
            count = int(batch.event_count[n])
            listed = zip(batch.event_time[n, :count].tolist(), batch.event_kind[n, :count].tolist(), strict=True)
            head = (int(batch.status[n]), float(batch.duration[n]), x1, v1, v2, y, float(batch.aed[n]))
            write(row, head, list(listed))
        return found

    return Ready(run, collect, len(table))


BASE = "hopform C, f64"


def ours() -> Iterator[Row]:
    """hopform's rows; the plan of a robot is made once, unless a row says otherwise."""
    yield Row(BASE, None, partial(_compiled, "f64", "planned"))
    yield Row("hopform C, f64, plan included", None, partial(_compiled, "f64", "from_scratch"))
    yield Row("hopform C, f32", None, partial(_compiled, "f32", "planned"))
    yield Row("hopform C, f32, plan included", None, partial(_compiled, "f32", "from_scratch"))
    yield Row("hopform from Python, solve_stance", None, _from_python)
    if hasattr(hopform, "solve_stances"):
        yield Row(f"hopform from Python, solve_stances of {BATCH}", None, _batch)


# ---- peers ----


def _peer(entry: str, build: Callable[[], native.Library], tolerance: float, jobs: Jobs) -> Ready:
    return Ready(build().function(entry, jobs, tolerance), np.copy, len(jobs))


def _numba(tolerance: float, jobs: Jobs) -> Ready:
    return Ready(numba_peer.function(jobs, tolerance), np.copy, len(jobs))


def _scipy(call: Callable[[Jobs, float], Answers], tolerance: float, jobs: Jobs) -> Ready:
    def run(loops: int) -> Answers:
        for _ in range(loops):
            found = call(jobs, tolerance)
        return found

    return Ready(run, lambda found: found, len(jobs))


def _installed(package: str, call: Callable[[Jobs, float], Answers], tolerance: float, jobs: Jobs) -> Ready:
    """A peer of an optional package; ImportError where it is not there."""
    importlib.import_module(package)
    return _scipy(call, tolerance, jobs)


def peers() -> Iterator[Row]:
    """Everybody else, at every tolerance."""
    for tolerance in TOLERANCES:
        yield Row("Boost.odeint dopri5, C++", tolerance, partial(_peer, "run_odeint", native.odeint, tolerance))
        yield Row("numba DOPRI5", tolerance, partial(_numba, tolerance))
        yield Row("CVODE Adams, C", tolerance, partial(_peer, "run_adams", native.cvode, tolerance))
        yield Row("CVODE BDF, C", tolerance, partial(_peer, "run_bdf", native.cvode, tolerance))
        yield Row("expm + brentq, scipy", tolerance, partial(_scipy, scipy_peers.expm, tolerance))
        yield Row("diffrax Tsit5, vmap", tolerance, partial(_installed, "diffrax", diffrax_peer.solve, tolerance))
        yield Row("CVODES by CasADi", tolerance, partial(_installed, "casadi", casadi_peer.solve, tolerance))
        for method in ("DOP853", "LSODA"):
            solver = partial(_ivp, method)
            yield Row(f"solve_ivp {method}, scipy", tolerance, partial(_scipy, solver, tolerance))


def _ivp(method: str, jobs: Jobs, tolerance: float) -> Answers:
    return scipy_peers.solve_ivp(jobs, method, tolerance)


def every_row() -> tuple[Row, ...]:
    return (*ours(), *peers())
