"""The paper's figures, drawn from one's own robot or this project's: one function per figure, each with what it
computed and a caption.

    >>> from hopform._figures import DRAWN
    >>> sorted(DRAWN) == [*range(1, 18)]
    True

`hopform figures DIR` writes them all. Importing this package loads no matplotlib; drawing needs the extra `plot`.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, cast

from hopform import HopformError, Robot, load_robot
from hopform._checks import shown
from hopform._show import drawing

if TYPE_CHECKING:
    from hopform._figures.picture import Picture

DRAWN: dict[int, tuple[str, str, str, str, str]] = {
    1: ("machine", "schematic", "hopper_c", "The model",
        "photographs of Hoppers B and C, (a), (b), and the schematic of their model, (c)"),
    2: ("machine", "step_response", "hopper_c", "Step response of the actuator",
        "Hopper C's actuator, measured, under the largest current step for a brief time: its velocity is limited"),
    3: ("machine", "compression_cycles", "hopper_c", "Compression in steady hopping",
        "measured compression cycles of Hopper C in steady hopping: x1 still compresses when the stance has ended"),
    4: ("verification", "initial_model", "hopper_b", "Initial model",
        "measured and simulated drop tests (x2) and step responses (x1) of Hopper B: fair for x2, off for small hops "
        "and for x1"),
    5: ("runs", "family_of_maps", "hopper_b", "Apex reachability, {name}",
        "overlaid return maps of Hopper B for different control actions, measured"),
    6: ("runs", "on_even_ground", "hopper_b", "First controller, even ground",
        "simulated tracking of references by Hopper B's first controller on even ground"),
    7: ("runs", "on_uneven_ground", "hopper_b", "First controller, uneven ground",
        "simulations in which Hopper B's first controller cannot hold the height on uneven terrain"),
    8: ("runs", "with_errors_of_measurement", "hopper_b", "First controller, errors of measurement",
        "the controller's experiments on Hopper B"),
    9: ("machine", "friction_threshold", "hopper_c", "Dry friction of the actuator",
        "a slowly rising current (bottom) until motion of the actuator is detected (top), from which (5) gives f1"),
    10: ("verification", "improved_model", "hopper_c", "Improved model",
         "measured step responses (x1, top) and drop tests (x2, bottom) of Hopper C against the improved model: "
         "transient and steady state are better than in Fig. 4"),
    11: ("runs", "bounds_of_map", "hopper_c", "Apex reachability, {name}",
         "the next apex over the current one for Hopper C, measured and computed: bottom without actuation, top at "
         "about the largest compression, x1 kept 1 to 2 cm off its end"),
    12: ("runs", "ideal_drop", "ideal", "Energy without losses",
         "the energy of an ideal hopper in a static drop, constant over all time"),
    13: ("runs", "real_drop", "hopper_c", "Energy of a passive drop",
         "the energy of a real hopper in a static drop: an instantaneous loss at impact, friction in stance, and the "
         "precomputed AED equal to kinetic plus potential energy"),
    14: ("runs", "actuated", "hopper_c", "Energy of actuated hopping",
         "the same with 3 A: energy added in U-shaped minima between the flights' plateaus, settling at a steady "
         "hopping height"),
    15: ("machine", "hall_sensor", "hopper_c", "Touchdown from a Hall sensor",
         "the Hall sensor's signal on Hopper C in real hopping: noisy, ground contact easily detected"),
    16: ("runs", "exact_on_even_ground", "hopper_c", "Energy-based controller, even ground",
         "simulations of the energy-based controller on even terrain"),
    17: ("runs", "exact_on_uneven_ground", "hopper_c", "Energy-based controller, uneven ground",
         "the same on uneven terrain, as accurate as on even"),
}  # fmt: skip
"""The figures by their number in the paper: module and function that draw, the shipped robot that it is drawn from, its
title, and what the paper shows."""


RECORDED = {4: ("drop", "step"), 10: ("drop", "step")}
"""The figures that recordings of these roles give."""
MEASURED = "measured step responses (x1) and drop tests (x2) against a model"
"""What the paper shows in Figs. 4 and 10, beside recordings of another robot."""


def draw(number: int, robot: Robot | None = None, sources: Mapping[str, str] = MappingProxyType({})) -> "Picture":
    """The figure of a number in `DRAWN`, its caption and its data, from a robot or from a shipped one.

    sources: CSV files of recordings by their role, from which Figs. 4 and 10 are drawn where all of theirs are
    there. Else, where gamma2 > 0, the current is counted the other way, so that it lifts. Raises HopformError for
    another number, where the robot cannot do what the figure shows, or for a recording that cannot be fitted;
    MissingExtra without matplotlib, or without scipy for a recording.
    """
    if number not in DRAWN:
        raise HopformError(f"figure must be one of {', '.join(map(str, DRAWN))}, got {shown(number)}")
    picture = drawing("picture")
    module, function, name, title, paper = DRAWN[number]
    own = load_robot(name) if robot is None else robot
    if number in RECORDED and sources.keys() >= set(RECORDED[number]):
        recorded = drawing("verification")
        make = partial(recorded.models, sources)
        paper = MEASURED
    else:
        if own.gamma2 > 0.0 and number != 1:  # the same robot, its current counted so that it lifts
            own = replace(own, gamma2=-own.gamma2)
        make = getattr(drawing(module), function)
    return cast("Picture", picture.finished(number, title, paper, own, make))
