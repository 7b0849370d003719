"""Hoppers with something else in the leg, and joints: the derived solvers, and random problems for them.

The problem of a draw is that of tests/oracle/mechanism, which knows the equations of motion alone.
"""

import math
import random
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hopform._solver import c as native
from hopform._solver.c import C
from hopform._solver.choice import Solver
from hopform_solver.records import Robot
from tests.conformance.random_stances import draw_stances
from tests.derived import solver_of
from tests.oracle.mechanism import builders
from tests.oracle.mechanism.compare import Answer

PARAMETERS = ("m_eff", "m_s", "k", "L0", "c", "b1", "b2", "f1", "f2", "gamma2", "g", "x1_min", "x1_max")
MOST = 200  # phases


@dataclass(frozen=True)
class Leg:
    """A model as a package and as a library."""

    name: str
    package: Any
    library: native.Library
    solver: Solver

    def solve(self, parameters: tuple[float, ...], start: Mapping[str, float], u: float, horizon: float = 2.0) -> Any:
        state = self.package.LegState(*(start[name] for name in ("x1", "v1", "v2", "y")))
        return C(self.library).solve_stance(parameters, state, ((0.0, u),), horizon, MOST, np.dtype(np.float64))

    def events(self, solved: Any) -> list[tuple[float, str]]:
        words = self.package.records.EVENTS
        return [(float(row[0]), words[row[3]]) for row in solved.phase_rows() if row[3] in words]

    def answer(self, solved: Any) -> Answer:
        """Up to the ending; x2 counts from the length of the leg without load. Without a contact there is no AED."""
        ending, duration, end, *rises = solved.outcome()
        final = {"x1": end.x1, "v1": end.v1, "v2": end.v2, "y": end.y}
        status = self.package.records.ENDINGS[ending]
        gains = {"body": rises[1]} if hasattr(self.package.records, "LEDGER_OF_BODY") else {}
        return Answer(status, float(duration), self.events(solved), final, gains)


class Legs:
    """The models by name, each derived when it is asked for."""

    def __init__(self, store: Path) -> None:
        self._store, self._made = store, dict[str, Leg]()

    def __getitem__(self, name: str) -> Leg:
        if name not in self._made:
            solver = solver_of(self._store, name).Robot.solver
            self._made[name] = Leg(name, sys.modules[solver.package.name], solver.compiled().library, solver)
        return self._made[name]


def drawn(name: str, seed: int, count: int) -> Iterator[tuple[tuple[float, ...], dict[str, Any], dict[str, Any]]]:
    """Parameters, start and problem of random robots, degenerate ones among them; the oracle has one level of friction."""
    choose = random.Random(seed)
    for row in draw_stances(seed, count):
        robot = {key: float(row[key]) for key in PARAMETERS}
        start = {key: float(row[key]) for key in ("x1", "v1", "v2", "y")}
        u = float(row["u"])
        further: tuple[float, ...]
        if name == "leg_damper":
            scale = 2.0 * math.sqrt(robot["k"] * robot["m_s"])
            further = (choose.choice([0.0, scale * 10.0 ** choose.uniform(-3.0, 0.5)]),)
            problem = builders.damped_leg(robot, further[0], **start, u=u, max_phases=MOST)
        elif name == "second_spring":
            longer = choose.choice([0.0, choose.uniform(-0.01, 0.01)])
            further = (robot["k"] * 10.0 ** choose.uniform(-3.0, 0.0), robot["L0"] + robot["c"] + longer)
            problem = builders.second_spring(robot, *further, **start, u=u, max_phases=MOST)
        else:
            force = robot["m_s"] * robot["g"] * choose.uniform(-0.5, 0.9)
            further = (force,) if name == "cable" else (0.0, 0.0, force)  # further_forces has two before it
            problem = builders.pushed_body(robot, further[-1], **start, u=u, max_phases=MOST)
        yield (
            (*(robot.get(key, 0.0) for key in Robot._fields), *further),
            start | {"u": u},
            problem,
        )


def rigs(seed: int, count: int) -> Iterator[tuple[tuple[float, ...], dict[str, float], float, dict[str, Any]]]:
    """Parameters, start, horizon and problem of random hoppers whose leg may pull, for some of their periods."""
    choose = random.Random(seed)
    for row in draw_stances(seed, count):
        robot, u = {key: float(row[key]) for key in PARAMETERS}, float(row["u"])
        start = {key: float(row[key]) for key in ("x1", "v1", "v2")}
        start["y"] = float(row["y"]) * choose.choice([-1.0, 1.0])
        horizon = 12.0 / math.sqrt(robot["k"] / robot["m_eff"] + robot["k"] / robot["m_s"])
        problem = builders.stance(robot, **start, u=u, horizon=horizon, max_phases=MOST)
        del problem["contact"]
        yield (
            tuple(robot.get(key, 0.0) for key in Robot._fields if key != "impact_loss"),
            start | {"u": u},
            horizon,
            problem,
        )


def joints(seed: int, count: int) -> Iterator[tuple[tuple[float, ...], dict[str, float], float, dict[str, Any]]]:
    """Parameters, start, horizon and problem of random joints: without spring or friction, with one stop or two."""
    choose = random.Random(seed)

    def over(low: float, high: float, zero: float = 0.0) -> float:
        return 0.0 if choose.random() < zero else math.exp(choose.uniform(math.log(low), math.log(high)))

    for _ in range(count):
        m, k, q = over(1e-3, 50.0), over(1.0, 1e5, 0.2), choose.uniform(-0.05, 0.05)
        b = 2.0 * math.sqrt(max(k, 10.0) * m) * over(1e-3, 3.0, 0.2)
        stops = choose.choice([(-math.inf, math.inf), (-0.06, 0.06), (q, 0.06), (-math.inf, q + 0.01)])
        force = max(k, 10.0) * 0.05
        problem = {
            "m": m, "k": k, "b": b, "q_0": choose.uniform(-0.02, 0.02), "gamma": choose.choice([-1.0, 1.0]) * force,
            "load": force * over(0.01, 1.0, 0.5), "q_min": stops[0], "q_max": stops[1],
        }  # fmt: skip
        f1, f1_minus = (force / m * over(0.01, 1.0, 0.2) for _ in range(2))
        at = {"q": q, "v": choose.uniform(-1.0, 1.0) * math.sqrt(max(k, 10.0) / m) * 0.05}
        u = choose.uniform(-1.0, 1.0)
        friction, horizon = {"F_plus": m * f1, "F_minus": m * f1_minus}, 20.0 * math.sqrt(m / max(k, 10.0))
        parameters = (m, k, problem["q_0"], b, *friction.values(), problem["gamma"], problem["load"], *stops, 3.0)
        start = {"x1": at["q"], "v1": at["v"], "v2": 0.0, "y": at["q"] - problem["q_0"], "u": u}
        asked = builders.joint(**problem, **friction, **at, u=u, horizon=horizon, max_phases=MOST)
        yield parameters, start, horizon, asked
