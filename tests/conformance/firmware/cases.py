"""Robots and starts that programs on emulated processors solve in single precision.

What is counted (costs.c) are the selftest's stances (set `modes`) and drops of both hoppers (set `drops`), of which the
paper's sequence of signs is the common case; the robots of each regime, whose drops are counted apart; and the heights
of a run of hops, whose flights are.
"""

from typing import Any

import numpy as np

from derive.model.selftest import CASES, HOPPER_B, HOPPER_C, ROBOTS
from hopform_solver.records import Robot

Start = dict[str, Any]

DROPS = tuple((robot, v2, u) for robot in (HOPPER_C, HOPPER_B) for v2 in (-0.7, -1.93, -2.6) for u in (-1.0, 0.5, 2.75))

REGIMES = (
    ("a/w=0.26", HOPPER_C),
    ("a/w=3", HOPPER_C | {"b1": 1529.0}),
    ("a/w=6", HOPPER_C | {"b1": 3020.0}),
    ("a/w=30", HOPPER_C | {"b1": 15000.0}),
    ("a/w=33", HOPPER_C | {"b1": 16500.0}),
    ("a/w=60", HOPPER_C | {"b1": 30000.0}),
    ("three_real_poles", HOPPER_C | {"b1": 900.0, "b2": 400.0}),
    ("near-equal_poles", HOPPER_C | {"m_eff": 3.0, "m_s": 24.0, "k": 801.0, "b1": 90.5, "b2": 1.0, "gamma2": -8.0}),
    ("friction_at_rest", HOPPER_C | {"f1_excess": 0.4, "f2_excess": 0.3}),
)
"""Robots between the same stops, a their real pole and w = sqrt(q) the frequency of their pair: `hopper_c` with ever more
viscous friction of the actuator, and those of other poles and friction."""

HOPS = (0.15, 0.15, 0.12, 0.1, 0.12, 0.15, 0.18, 0.2, 0.17, 0.14, 0.11, 0.12)
"""[m] Heights that `hopper_c` is asked for one after the other, thrown up by the first."""


def single(value: float) -> float:
    return float(np.float32(value))


def fields(robot: dict[str, float]) -> dict[str, float]:
    """All parameters, rounded."""
    return {name: single(robot.get(name, 0.0)) for name in Robot._fields}


def inputs() -> list[tuple[dict[str, float], Start]]:
    """Robots and starts: the selftest's, and drops of both hoppers under constant currents."""
    found = []
    for case in CASES:
        start = {name: single(getattr(case, name)) for name in ("x1", "v1", "v2", "y", "horizon")}
        steps = [(0.0, single(case.u)), (single(case.later), single(case.then))]
        found.append((fields(ROBOTS[case.robot]), {**start, "u": steps, "max_phases": 32}))
    for robot, v2, u in DROPS:
        start = {"x1": 0.0, "v1": 0.0, "v2": single(v2), "y": 0.0, "horizon": 2.0, "max_phases": 32}
        found.append((fields(robot), {**start, "u": [(0.0, single(u)), (100.0, 0.0)]}))
    return found
