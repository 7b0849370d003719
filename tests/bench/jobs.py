"""The stances that everybody solves: seeded, and every number exact in float32, so both precisions have one truth.

hopper_c   touchdown velocities of drops from 2 to 40 cm, currents from -3 to 3 A
random     mass ratio 1e-2..1e2, k 1e2..1e5 N/m, viscous friction up to critical, Coulomb friction, a third with stops
"""

import math
import random
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hopform

SEED = 20240607
COUNT = 200
HORIZON = 2.0
MAX_PHASES = 64
ROBOT = tuple(field.name for field in hopform.Robot.fields() if not field.name.endswith("_excess"))
"""The robot's parameters but friction that is higher at rest, which the jobs have none of: the peers know one level."""
START = ("x1", "v1", "v2", "u")


@dataclass(frozen=True)
class Jobs:
    """A named set of stances; `table` has a row per stance: the robot's 15 parameters, then x1, v1, v2, u."""

    name: str
    table: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.table)

    def robot(self, n: int) -> dict[str, float]:
        return dict(zip(ROBOT, self.table[n, : len(ROBOT)].tolist(), strict=True))

    def start(self, n: int) -> dict[str, float]:
        return dict(zip(START, self.table[n, len(ROBOT) :].tolist(), strict=True))

    def first(self, count: int) -> "Jobs":
        return Jobs(self.name, self.table[:count].copy())


def _table(rows: list[dict[str, float]]) -> NDArray[np.float64]:
    table = np.array([[row[name] for name in (*ROBOT, *START)] for row in rows])
    return table.astype(np.float32).astype(np.float64)


@cache
def hopper_c(count: int = COUNT) -> Jobs:
    """`hopper_c` over drops and currents."""
    draw = random.Random(SEED)
    robot = hopform.load_robot("hopper_c")
    fixed = {name: float(getattr(robot, name)) for name in ROBOT}
    rows: list[dict[str, float]] = []
    for _ in range(count):
        v2 = hopform.touchdown_velocity(robot, draw.uniform(0.02, 0.40))
        rows.append(fixed | {"x1": 0.0, "v1": 0.0, "v2": v2, "u": draw.uniform(-3.0, 3.0)})
    return Jobs("hopper_c", _table(rows))


@cache
def random_robots(count: int = COUNT) -> Jobs:
    """A robot of its own for each stance; half of them land with a moving actuator."""
    draw = random.Random(SEED + 1)
    return Jobs("random", _table([_random_stance(draw) for _ in range(count)]))


def _random_stance(draw: random.Random) -> dict[str, float]:
    def over(low: float, high: float) -> float:
        return math.exp(draw.uniform(math.log(low), math.log(high)))

    m_s, k = over(0.3, 10.0), over(1e2, 1e5)
    m_eff = m_s * over(1e-2, 1e2)
    stops = draw.random() < 1.0 / 3.0
    v2 = -over(0.2, 3.0)
    moving = draw.random() < 0.5
    return {
        "m_eff": m_eff, "m_s": m_s, "k": k, "L0": 0.4, "c": 0.0,
        "b1": 2.0 * math.sqrt(k * m_eff) * over(1e-3, 1.0), "b2": 2.0 * math.sqrt(k * m_s) * over(1e-3, 1.0),
        "f1": over(0.05, 10.0), "f2": over(0.05, 5.0),
        "gamma2": draw.choice((-1.0, 1.0)) * m_eff * over(0.3, 10.0), "g": 9.81,
        "x1_min": -over(1e-3, 0.1) if stops else -math.inf, "x1_max": over(1e-3, 0.1) if stops else math.inf,
        "u_max": 3.0, "impact_loss": 0.0,
        "x1": 0.0, "v1": draw.uniform(0.5 * v2, -v2) if moving else 0.0, "v2": v2, "u": draw.uniform(-3.0, 3.0),
    }  # fmt: skip


def sets() -> tuple[Jobs, ...]:
    return hopper_c(), random_robots()


# ---- what comes out ----

HEAD = ("ending", "duration", "x1", "v1", "v2", "y", "aed", "count")
WIDTH = len(HEAD) + 2 * MAX_PHASES


def answers(count: int) -> NDArray[np.float64]:
    """A row per stance: ending, duration, x1, v1, v2, y, AED, number of events, then time and kind of each event."""
    return np.zeros((count, WIDTH))


def write(row: NDArray[np.float64], head: tuple[Any, ...], events: list[tuple[float, int]]) -> None:
    """Put one answer into its row; the number of events follows from the list."""
    row[: len(HEAD)] = (*head, len(events))
    for n, event in enumerate(events):
        row[len(HEAD) + 2 * n : len(HEAD) + 2 * n + 2] = event
