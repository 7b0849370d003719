"""The paper's figures, drawn from one's own robot or this project's: one function per figure, each with what it
computed and a caption.

    >>> from hopform._figures import DRAWN
    >>> sorted(DRAWN) == [*range(1, 18)]
    True

`hopform figures DIR` writes them all. Importing this package loads no matplotlib; drawing needs the extra `plot`.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, cast

from hopform._checks import shown
from hopform._errors import HopformError
from hopform._robots import Robot, load_robot

if TYPE_CHECKING:
    from hopform._figures.picture import Picture

DRAWN: dict[int, tuple[str, str, str]] = {
    1: ("schematic", "schematic", "hopper_c"),
    2: ("actuator", "step_response", "hopper_c"),
    3: ("actuator", "compression_cycles", "hopper_c"),
    4: ("verification", "initial_model", "hopper_b"),
    5: ("return_maps", "family_of_maps", "hopper_b"),
    6: ("first_controller", "on_even_ground", "hopper_b"),
    7: ("first_controller", "on_uneven_ground", "hopper_b"),
    8: ("first_controller", "with_errors_of_measurement", "hopper_b"),
    9: ("actuator", "friction_threshold", "hopper_c"),
    10: ("verification", "improved_model", "hopper_c"),
    11: ("return_maps", "bounds_of_map", "hopper_c"),
    12: ("energies", "ideal_drop", "ideal"),
    13: ("energies", "real_drop", "hopper_c"),
    14: ("energies", "actuated", "hopper_c"),
    15: ("contact", "hall_sensor", "hopper_c"),
    16: ("feedforward", "on_even_ground", "hopper_c"),
    17: ("feedforward", "on_uneven_ground", "hopper_c"),
}
"""The figures by their number in the paper: module, function, and the shipped robot that it is drawn from."""


def draw(number: int, robot: Robot | None = None) -> "Picture":
    """The figure of a number in `DRAWN`, its caption and its data, from a robot or from a shipped one.

    Where gamma2 > 0 the current is counted the other way, so that it lifts. Raises HopformError for another number, or
    where the robot cannot do what the figure shows; MissingExtra without matplotlib.
    """
    if number not in DRAWN:
        raise HopformError(f"figure must be one of {', '.join(map(str, DRAWN))}, got {shown(number)}")
    import_module("hopform._figures.picture")  # raises MissingExtra
    module, function, name = DRAWN[number]
    make = cast("Callable[[Robot], Picture]", getattr(import_module(f"hopform._figures.{module}"), function))
    drawn = load_robot(name) if robot is None else robot
    if drawn.gamma2 > 0.0 and number != 1:  # the same robot, its current counted so that it lifts
        drawn = replace(drawn, gamma2=-drawn.gamma2)
    return make(drawn)


def draw_recordings(number: int, robot: Robot | None, sources: Mapping[str, str]) -> "Picture | None":
    """Fig. 4, 9 or 10 from recordings, whose CSV files are given by their role; None for another, or without its own.

    Raises HopformError for a recording that cannot be fitted, MissingExtra without matplotlib or scipy.
    """
    roles = {4: ("drop", "step"), 9: ("ramp",), 10: ("drop", "step")}.get(number, ())
    if not roles or not set(roles) <= sources.keys():
        return None
    import_module("hopform._figures.picture")  # raises MissingExtra
    recorded = import_module("hopform._figures.recorded")
    found: Picture = recorded.drawn(number, load_robot(DRAWN[number][2]) if robot is None else robot, sources)
    return found
