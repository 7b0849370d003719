"""Numbers to start from: those of examples, and of the robot.toml beside a solver."""

import math

from ..ir import Parameter, Quantity
from ..model import quantities, selftest
from ..model.equations import Model
from ..shipped import HOPPER
from .facts import shown


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


def example_input(model: Model) -> float:
    """The input of an example: half its limit, 3 at most, and of what has stops away from that where it starts."""
    if model.input is None:
        return 0.0
    if model.has_contact or model.law is not None:
        return 3.0
    robot = {parameter.symbol: _finite(parameter) for parameter in model.parameters}
    low, high, limit, pull = (
        float(model.value(each).xreplace(robot))
        for each in (quantities.x1_min, quantities.x1_max, quantities.u_max, -quantities.gamma2)
    )
    size = min(3.0, 0.5 * limit) if model.declares(quantities.u_max) else 3.0
    away = model.has_stops and low + high < 2.0 * example_start(model)["x1"]
    return -size if away != (pull < 0.0) else size


def example_start(model: Model) -> dict[str, float]:
    """The start of an example, by axes: an unloaded leg falls, and what has no leg rests, its coordinates as
    near to 0 as its stops allow.
    """
    robot = {parameter.symbol: _finite(parameter) for parameter in model.parameters}
    low, high, length = (
        float(model.value(each).xreplace(robot)) for each in (quantities.x1_min, quantities.x1_max, model.length)
    )
    begin = min(max(0.0, low), high) if model.has_stops else 0.0
    start = {"x1": begin, "v1": 0.0, "x2": 0.0, "v2": 0.0}
    if model.has_contact:
        start |= {"x2": begin + length, "v2": -1.93}
    return {axis: start[axis] for axis in (each["axis"] for each in shown(model))}
