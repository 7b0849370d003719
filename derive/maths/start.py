"""A start in the coordinates and velocities of the model's file, and the state of the engine: affine in each other.

    y = (x_1 - x_2) + length,        x_2 = (x_1 - y) + length

Each step rounds once, in this order: there and back a coordinate keeps within 2 units in the last place of the largest
of x_1, x_2 and the length. What never moves has no member in a start, and is 0 in a state.
"""

import sympy as sp

from ..ir import Record, Step, Steps, function
from ..model.equations import Model
from ..model.quantities import *
from . import energy
from .energy import length, unloaded
from .laplace import rest_of_spring

START = Record("Start", "A start as the file of the model has it: coordinates and velocities that move.")
"""Its quantities are those of the model's file, in the order of x1, v1, x2, v2."""


@function(takes=(ROBOT, START), returns=STATE)
def state_of_start(model: Model) -> Steps:
    """The state of a start."""
    yield from (Step(symbol, sp.S.Zero, "never moves") for symbol in (x1, v1, v2) if symbol in model.still)
    steps, rest = rest_of_spring(model)
    yield from steps
    yield Step(length, model.ratio * x1 - x2, "hop height of the body, downwards")
    yield Step(unloaded, L0 + c - rest, "length without load")
    yield Step(y, length + unloaded, "y = x_1 - x_2 + unloaded")


@function(takes=(ROBOT, STATE), returns=START)
def start_of_state(model: Model) -> Steps:
    """The coordinates and velocities of a state."""
    return energy.second_position(model) if x2 not in model.still else ()
