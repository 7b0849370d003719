"""Derivatives of a stance by differences of its 50-digit reference:
two steps to one side, of 1e-18, are good to 30 digits.

An error counts in units of its row and column: the largest derivative in that row, each by the change of the input that
matters, which is its own size, or 0.1 m, 1 m/s, 1 A.
"""

import math
from typing import Any

import numpy as np

from tests.oracle import reference
from tests.oracle.reference.records import mp

STEP = mp.mpf("1e-18")
UNITS = {"x1": 0.1, "x2": 0.1, "v1": 1.0, "v2": 1.0, "u": 1.0, "c": 0.1, "L0": 0.1, "x1_min": 0.1, "x1_max": 0.1}
STOPS = ("x1_min", "x1_max")


def size_of(name: str, value: float) -> float:
    """The change of an input that matters: its own size, or a unit of its kind where that is more."""
    return max(abs(value) if math.isfinite(value) else 0.0, UNITS.get(name, 0.0)) or 1.0


def outcome(exact: Any) -> list[Any]:
    """The rows, from the reference; without take-off the apex is 0."""
    state = exact.final
    return [exact.duration, state.x1, state.v1, state.x2, state.v2, exact.apex or mp.zero, exact.aed]


def moved(robot: dict[str, Any], start: dict[str, Any], name: str, step: Any) -> Any:
    """The rows with one input moved; a stop on which the actuator starts moves with it."""
    start = {"x1": 0.0, "v1": 0.0, **start}
    robot = dict(robot)
    if name == "u":
        steps = start["u"] if isinstance(start.get("u"), list) else [(0.0, start.get("u", 0.0))]
        start["u"] = [(mp.mpf(t), mp.mpf(u) + step) for t, u in steps]
    elif name in robot:
        robot[name] = mp.mpf(robot[name]) + step
    else:
        start[name] = mp.mpf(start[name]) + step
    if name == "x1":
        for stop in STOPS:
            if robot[stop] == mp.mpf(start["x1"]) - step:
                robot[stop] = start["x1"]
    return outcome(reference.solve(robot, **start))


def differences(robot: dict[str, Any], start: dict[str, Any], name: str, step: float) -> Any:
    """The derivative of each row by one input, from two steps to one side, so that no input leaves its domain."""
    with mp.workdps(80):
        h = STEP * step
        at_0, at_1, at_2 = (moved(robot, start, name, n * h) for n in range(3))
        return [float((4 * q - 3 * p - r) / (2 * h)) for p, q, r in zip(at_0, at_1, at_2, strict=True)]


def scaled_error(ours: Any, theirs: Any, sizes: Any) -> float:
    """The largest error of a matrix, each row in units of its largest entry; what is NaN in `theirs` is left out."""
    scale = np.nanmax(np.abs(theirs * sizes), axis=1, keepdims=True)
    error = np.abs(ours - theirs) * sizes / np.where(scale > 0.0, scale, 1.0)
    assert np.isfinite(ours).all()
    return float(np.nanmax(error))
