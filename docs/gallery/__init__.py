"""The paper's figures 1 to 17, drawn from the robots that ship: one function per figure, each with what it computed and a
caption. `make figures` writes them into out/figures, where the site takes them from.

    >>> from docs import gallery
    >>> sorted(gallery.DRAWN) == [*range(1, 18)]
    True

It is no part of the wheel.
"""

from collections.abc import Callable
from typing import NamedTuple

from docs.gallery import machine, runs, verification
from docs.gallery.picture import Drawn, Picture, finished
from hopform import Robot, load_robot


class Entry(NamedTuple):
    """A figure: what draws it, the shipped robot that it is drawn from, its title, and what the paper shows."""

    make: Callable[[Robot], Drawn]
    robot: str
    title: str
    paper: str


DRAWN = {
    1: Entry(machine.schematic, "hopper_c", "The model",
             "photographs of Hoppers B and C, (a), (b), and the schematic of their model, (c)"),
    2: Entry(machine.step_response, "hopper_c", "Step response of the actuator",
             "Hopper C's actuator, measured, under the largest current step for a brief time: its velocity is limited"),
    3: Entry(machine.compression_cycles, "hopper_c", "Compression in steady hopping",
             "measured compression cycles of Hopper C in steady hopping: x1 still compresses when the stance has ended"),
    4: Entry(verification.initial_model, "hopper_b", "Initial model",
             "measured and simulated drop tests (x2) and step responses (x1) of Hopper B: fair for x2, off for small hops "
             "and for x1"),
    5: Entry(runs.family_of_maps, "hopper_b", "Apex reachability, hopper_b",
             "overlaid return maps of Hopper B for different control actions, measured"),
    6: Entry(runs.on_even_ground, "hopper_b", "First controller, even ground",
             "simulated tracking of references by Hopper B's first controller on even ground"),
    7: Entry(runs.on_uneven_ground, "hopper_b", "First controller, uneven ground",
             "simulations in which Hopper B's first controller cannot hold the height on uneven terrain"),
    8: Entry(runs.with_errors, "hopper_b", "First controller, errors of sensors, motor and clock",
             "the controller's experiments on Hopper B"),
    9: Entry(machine.friction_threshold, "hopper_c", "Dry friction of the actuator",
             "a slowly rising current (bottom) until motion of the actuator is detected (top), from which (5) gives f1"),
    10: Entry(verification.improved_model, "hopper_c", "Improved model",
              "measured step responses (x1, top) and drop tests (x2, bottom) of Hopper C against the improved model: "
              "transient and steady state are better than in Fig. 4"),
    11: Entry(runs.bounds_of_map, "hopper_c", "Apex reachability, hopper_c",
              "the next apex over the apex before it for Hopper C, measured and computed: bottom without actuation, top at "
              "about the largest compression, x1 kept 1 to 2 cm off its end"),
    12: Entry(runs.ideal_drop, "ideal", "Energy without losses",
              "the energy of an ideal hopper in a static drop, constant over all time"),
    13: Entry(runs.real_drop, "hopper_c", "Energy of a passive drop",
              "the energy of a real hopper in a static drop: an instantaneous loss at impact, friction in stance, and the "
              "precomputed AED equal to kinetic plus potential energy"),
    14: Entry(runs.actuated, "hopper_c", "Energy of actuated hopping",
              "the same with 3 A: energy added in U-shaped minima between the flights' plateaus, settling at a steady "
              "hopping height"),
    15: Entry(machine.hall_sensor, "hopper_c", "Touchdown from a Hall sensor",
              "the Hall sensor's signal on Hopper C in real hopping: noisy, ground contact easily detected"),
    16: Entry(runs.exact_on_even_ground, "hopper_c", "Energy-based controller, even ground",
              "simulations of the energy-based controller on even terrain"),
    17: Entry(runs.exact_on_uneven_ground, "hopper_c", "Energy-based controller, uneven ground",
              "the same on uneven terrain, as accurate as on even"),
}  # fmt: skip
"""The figures by their number in the paper."""


def draw(number: int) -> Picture:
    """The figure of a number in `DRAWN`, its caption and its data."""
    make, name, title, paper = DRAWN[number]
    return finished(number, title, paper, load_robot(name), make)
