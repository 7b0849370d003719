"""The fixed stances that hopform_selftest solves: together they visit every mode, kind of event, ending and kernel
branch.

Data alone; tests/conformance/test_selftest.py counts what they visit.
"""

from typing import NamedTuple

HOPPER_C = {
    "m_eff": 25.0, "m_s": 3.0, "k": 1200.0, "L0": 0.4, "c": 0.0, "b1": 150.0, "b2": 5.0, "f1": 0.78, "f2": 0.6,
    "f1_excess": 0.0, "f2_excess": 0.0, "gamma2": -65.0, "g": 9.81, "x1_min": 0.0, "x1_max": 0.08, "u_max": 3.0,
    "impact_loss": 0.05,
}  # fmt: skip
HOPPER_B = HOPPER_C | {"m_eff": 95.0, "b1": 204.0, "f1": 0.214, "gamma2": -35.15, "u_max": 10.0}
FREE = {"x1_min": -1e30, "x1_max": 1e30}

ROBOTS: tuple[dict[str, float], ...] = (
    HOPPER_C,
    HOPPER_B,
    HOPPER_C | {"b1": 0.0, "b2": 0.0, "f1": 0.0, "f2": 0.0, "x1_max": 0.0, "impact_loss": 0.0},  # ideal, locked
    HOPPER_C | {"b1": 0.0, "b2": 0.0, "f1": 0.0, "f2": 0.0} | FREE,  # no friction: the slow pole is at 0
    HOPPER_C | {"m_eff": 3.0, "m_s": 24.0, "k": 800.0, "b1": 90.0, "b2": 0.0, "f1": 0.0, "f2": 0.0} | FREE,  # triple
    HOPPER_C | {"m_eff": 3.0, "m_s": 24.0, "k": 801.0, "b1": 90.5, "b2": 1.0, "f1": 0.5, "f2": 0.1} | FREE,  # nearly
    HOPPER_C | {"b1": 900.0, "b2": 400.0},  # heavily damped: real poles
    HOPPER_C | {"m_eff": 0.05, "b1": 0.2, "b2": 0.1, "f1": 2.0, "f2": 0.2, "x1_min": -0.01, "x1_max": 0.02},  # light
    HOPPER_C | {"f1": 30.0, "f2": 25.0},  # stiff friction: sticks
    HOPPER_C | {"b2": 400.0, "f2": 0.0, "x1_max": 0.0},  # locked, two real poles
    HOPPER_C | {"f1": 0.0, "f2": 0.0} | FREE,  # drifts for many half periods
    HOPPER_C | {"f1": 2.0, "b1": 10.0, "f1_excess": 0.4, "x1_min": -0.05},  # more friction at rest: of the actuator,
    HOPPER_C | {"f1": 2.0, "b1": 10.0, "f2": 9.0, "f1_excess": 0.5, "f2_excess": 6.0} | FREE,  # of both
    HOPPER_C | {"b1": 1529.0},  # overdamped actuators, as geared ones are: a = 3 sqrt(q),
    HOPPER_C | {"b1": 15000.0},  # 30 and 33, on both sides of FAR in single precision,
    HOPPER_C | {"b1": 16500.0},
    HOPPER_C | {"b1": 48000.0},  # 96 and 104, on both sides of it in double precision
    HOPPER_C | {"b1": 52000.0},
)


class Case(NamedTuple):
    """A stance: robot by its place, state after the impact, the current in two steps, the horizon."""

    robot: int
    x1: float
    v1: float
    v2: float
    y: float
    u: float
    later: float
    then: float
    horizon: float


CASES: tuple[Case, ...] = (
    Case(0, 0.0, 0.0, -1.93, 0.0, 3.0, 0.05, 2.0, 2.0),
    Case(0, 0.0, 0.0, -0.6, 0.0, 1.0, 1.0, 0.0, 2.0),
    Case(0, 0.05, 0.2, -1.93, 0.0, -2.0, 0.1, 3.0, 2.0),
    Case(1, 0.01, -0.1, -1.5, 0.0, 8.0, 0.07, -4.0, 2.0),
    Case(2, 0.0, 0.0, -2.0, 0.0, 0.0, 1.0, 0.0, 2.0),
    Case(3, 0.0, 0.1, -1.0, 0.0, 1.5, 0.04, 0.0, 0.4),
    Case(4, 0.0, 0.05, -1.0, 0.0, 0.5, 0.1, 1.0, 1.0),
    Case(5, 0.0, 0.05, -1.0, 0.0, 0.5, 0.1, 1.0, 1.0),
    Case(6, 0.02, 0.1, -1.0, 0.0, 2.0, 0.3, -2.0, 2.0),
    Case(7, 0.0, -0.3, -0.8, 0.0, -0.5, 0.02, 0.3, 0.5),
    Case(7, 0.0, 0.0, -0.3, 0.001, 0.2, 0.06, 0.0, 0.5),
    Case(8, 0.04, 0.3, -0.5, 0.02, 0.0, 0.2, 3.0, 2.0),
    Case(8, 0.04, 0.0, 0.0, 0.02, 0.0, 0.2, -3.0, 2.0),
    Case(0, 0.0, -0.1, -1.0, 0.0, 1.0, 0.05, 2.0, 2.0),
    Case(0, 0.02, 0.0, 0.5, 0.0, 1.0, 0.05, 2.0, 2.0),
    Case(2, 0.0, 0.0, -0.01, 0.0245, 0.0, 1.0, 0.0, 10.0),
    Case(9, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 2.0),
    Case(10, 0.0, 1.0, 1.0, 0.0245, 3.0, 4.0, -1.0, 8.0),
)

AT_REST: tuple[Case, ...] = (
    Case(11, 0.0, 0.1, -1.93, 0.0, 1.0, 1.0, 0.0, 2.0),
    Case(11, 0.0, 0.0, -0.7, 0.0, 0.0, 0.05, 3.0, 2.0),
    Case(12, 0.03, 0.0, -0.4, 0.0, 3.0, 0.25, -30.0, 2.0),
    Case(12, 0.03, 0.0, 0.0, 0.07, 0.0, 0.3, 0.2, 2.0),
)
"""Stances with more friction at rest than in motion, which the digest has behind the others; costs are not counted of
these.
"""

OVERDAMPED: tuple[Case, ...] = (
    Case(13, 0.0, 0.0, -1.93, 0.0, 3.0, 0.05, 2.0, 2.0),
    Case(14, 0.01, 0.2, -1.5, 0.0, 2.75, 0.1, -1.0, 2.0),
    Case(15, 0.01, 0.2, -1.5, 0.0, 2.75, 0.1, -1.0, 2.0),
    Case(16, 0.0, -0.3, -1.93, 0.0, -2.0, 0.04, 3.0, 2.0),
    Case(17, 0.0, 0.3, -1.93, 0.0, -2.0, 0.04, 3.0, 2.0),
)
"""Stances beside an overdamped actuator, whose states late in a phase are counted from its start and from its end; costs
are counted of a set of their own."""

EVERY_CASE = CASES + AT_REST + OVERDAMPED
LAST = len(EVERY_CASE) - 1
