"""Numbers to start from: those of examples, and of the robot.toml beside a solver."""

import math

from ..ir import Parameter, Quantity
from ..model import quantities, selftest
from ..model.equations import Model
from ..shipped import HOPPER


def example_value(quantity: Quantity) -> float:
    """A parameter's value to start from: of a parameter that the hopper's file declares that of the selftest's first
    robot; of any other its default, without one 0 where it may be 0, else 1.
    """
    if isinstance(quantity, Parameter) and quantity.shipped_with == HOPPER.name:
        return selftest.ROBOTS[0][quantity.name]
    return quantity.default if quantity.default is not None else 0.0 if 0.0 in quantity.interval else 1.0


def _finite(quantity: Quantity) -> float:
    """The same where a program writes it: 1 for infinity."""
    value = example_value(quantity)
    return value if math.isfinite(value) else math.copysign(1.0, value)


def example_robot(model: Model) -> str:
    """The parameters of a robot as a program lists them."""
    return ", ".join(repr(_finite(quantity)) for quantity in model.robot.quantities)


def example_start(model: Model) -> dict[str, float]:
    """A state at the start of an example: a leg that carries nothing falls, and what has no leg rests, its coordinates 0
    and y what that is in the file's.
    """
    start = dict.fromkeys((quantity.name for quantity in quantities.STATE.quantities), 0.0)
    if model.has_contact:
        return start | {str(quantities.v2): -1.93}
    robot = {parameter.symbol: _finite(parameter) for parameter in model.parameters}
    return start | {str(quantities.y): float(model.value(model.length).xreplace(robot))}
