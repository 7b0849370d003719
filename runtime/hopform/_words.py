"""Answers in words, for tables and pictures."""

import math
from collections.abc import Sequence

from hopform import Motion, Phase, Robot, Stance
from hopform._motion import Mass, masses_of, stroke_of

ENDINGS = {
    "takeoff": "takes off after",
    "rest": "comes to rest after",
    "horizon": "still moves after",
    "too_many_phases": "has had the allowed number of phases after",
    "uncertified": "is certified up to",
}


def name_of(robot: Robot) -> str:
    """A robot's name; one made in Python may have none."""
    return robot.name or "robot"


def modes_of(phase: Phase, robot: Robot) -> list[str]:
    """The mode in a phase of each mass that may move, in words."""
    return [mode_of(phase, robot, mass) for mass in masses_of(robot.solver)]


def mode_of(phase: Phase, robot: Robot, mass: Mass) -> str:
    """The mode of a mass in a phase, in words."""
    mode = (phase.mode_1, phase.mode_2)[mass.number - 1]
    low, high = stroke_of(robot)
    if mode == 0 and mass.number == 1 and low == high:
        return "locked"
    if mode == 0 and mass.number == 1 and phase.state[0] in (low, high):
        return "at stop"
    forward, backward = mass.directions
    return {1: forward, 0: "held", -1: backward}[mode]


def limit_in(phase: Phase) -> str:
    """Where the current that a law sets is in a phase, in words."""
    return {1: "at its limit", 0: "by the law", -1: "at its lower limit"}[phase.mode_2]


def current(steps: Sequence[tuple[float, float]], name: str = "u", unit: str = "A") -> str:
    """The current of a motion in words."""
    if len(steps) == 1:
        return f"{name} = {steps[0][1]:g} {unit}"
    return f"{name} in {len(steps)} steps, {min(u for _, u in steps):g} to {max(u for _, u in steps):g} {unit}"


def start_of(motion: Motion) -> str:
    """Where a motion starts, in words: what is not 0 there."""
    first = zip(motion.units.items(), motion.phases[0].state, strict=True)
    return ", ".join(f"{name} = {value:.4g} {unit}" for (name, unit), value in first if value) or "0"


def input_of(motion: Motion) -> str:
    """The input of a motion in words, nothing of a model without one."""
    return ", ".join(current(motion.u, each["name"], each["unit"]) for each in motion.inputs)


def ending(motion: Motion) -> str:
    """The ending of a motion, in one sentence."""
    scale, unit = unit_of_time(motion.duration)
    apex = motion.apex if isinstance(motion, Stance) else math.nan
    waits = isinstance(motion, Stance) and motion.status == "horizon"
    words = (
        f"{'is still on the ground after' if waits else ENDINGS[motion.status]} {motion.duration * scale:.5g} {unit}"
    )
    return words if math.isnan(apex) else f"{words}, apex {100.0 * apex:.4g} cm"


def unit_of_time(longest: float) -> tuple[float, str]:
    """Milliseconds for what is over within a second."""
    return (1000.0, "ms") if longest < 1.0 else (1.0, "s")
