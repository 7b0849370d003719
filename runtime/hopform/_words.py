"""Answers in words, for tables and pictures."""

from hopform._motion import Mass, Motion, Phase, layout_of, masses_of, stroke_of
from hopform._robots import Robot


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
    return {1: "at its upper limit", 0: "by the law", -1: "at its lower limit"}[phase.mode_2]


def change_of_limit(name: str, at_limit: bool) -> str:
    """What happens to a current of that name at the begin of a phase in which it is at its limit, or no longer, in words."""
    return f"{name} reaches its limit" if at_limit else f"{name} leaves its limit"


def start_of(motion: Motion) -> str:
    """Where a motion starts, in words: what is not 0 there."""
    first, units = motion.phases[0].state, layout_of(motion.robot.solver).unit_of
    found = {name: getattr(first, name) for name in units}
    return ", ".join(f"{name} = {value:.4g} {units[name]}" for name, value in found.items() if value) or "0"
