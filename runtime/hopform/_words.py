"""Answers in words, for tables and pictures."""

import math
from collections.abc import Sequence

from hopform import Phase, Robot, Stance

ENDINGS = {
    "takeoff": "takes off after",
    "rest": "comes to rest after",
    "horizon": "is still on the ground after",
    "too_many_phases": "has had the allowed number of phases after",
    "uncertified": "is certified up to",
}


def name_of(robot: Robot) -> str:
    """A robot's name; one made in Python may have none."""
    return robot.name or "robot"


def mode_of_actuator(phase: Phase, robot: Robot) -> str:
    """The mode of the actuator in a phase, in words."""
    if phase.mode_1 == 0 and robot.letters.x1_min == robot.letters.x1_max:
        return "locked"
    if phase.mode_1 == 0 and phase.state.x1 in (robot.letters.x1_min, robot.letters.x1_max):
        return "at stop"
    return _mode(phase.mode_1, robot, 0)


def mode_of_body(phase: Phase, robot: Robot) -> str:
    """The mode of the body in a phase, in words."""
    return _mode(phase.mode_2, robot, 1)


def _mode(mode: int, robot: Robot, mass: int) -> str:
    forward, backward = robot.solver.facts.directions[min(mass, len(robot.solver.facts.directions) - 1)]
    return {1: forward, 0: "held", -1: backward}[mode]


def current(steps: Sequence[tuple[float, float]]) -> str:
    """The current of a stance in words."""
    if len(steps) == 1:
        return f"u = {steps[0][1]:g} A"
    return f"u in {len(steps)} steps, {min(u for _, u in steps):g} to {max(u for _, u in steps):g} A"


def ending(stance: Stance) -> str:
    """The ending of a stance, in one sentence."""
    scale, unit = unit_of_time(stance.duration)
    words = f"{ENDINGS[stance.status]} {stance.duration * scale:.5g} {unit}"
    return words if math.isnan(stance.apex) else f"{words}, apex {100.0 * stance.apex:.4g} cm"


def unit_of_time(longest: float) -> tuple[float, str]:
    """Milliseconds for what is over within a second."""
    return (1000.0, "ms") if longest < 1.0 else (1.0, "s")
