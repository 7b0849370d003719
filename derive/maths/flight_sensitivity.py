"""How a flight depends on its inputs, to first order.

Within a phase x_1'' = a - p v_1 - q x_1, so that its change obeys d_x_1'' = d_a - p d_v_1 - q d_x_1 - d_p v_1 - d_q x_1;
the changes of p, q and a are `FlightSlopes`. Gains that were designed change with the start and the robot.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import sympy as sp

from ..ir import Quantity, Record, Step, Steps, function
from ..model.equations import Model
from ..model.quantities import *
from . import flight
from .flight import Kd, Kp, drop, shortfall, time
from .sensitivity import CURRENT_CHANGE, ROBOT_CHANGE, change_of_quantity, changed_steps, changes

ADDS = Quantity("adds", r"K_d > 0", "1", "1 where the law adds to the damping, else 0")
FOLLOWS = Quantity("follows", r"|\mathrm{sat}| = 0", "1", "1 under the law, 0 at its limit")
adds, follows = ADDS.symbol, FOLLOWS.symbol
square, root = sp.symbols("square root", real=True)

FLIGHT_MODE = Record("FlightMode", "A mode of the flight: x_1'' = a - p v_1 - q x_1.").of(
    Quantity("p", r"p", "1/s", "sum of the rates"),
    Quantity("q", r"q", "1/s^2", "product of the rates"),
    Quantity("a", r"a", "m/s^2", "constant acceleration, with that of the friction"),
)
GAINS_CHANGE = changes(flight.GAINS)
FLIGHT_SLOPES = replace(changes(FLIGHT_MODE), name="FlightSlopes")
FALL_CHANGE, TOUCHDOWN_TIME_CHANGE, SETTLING_CHANGE, DROP_CHANGE, V2_CHANGE, V2_AFTER_CHANGE = map(
    change_of_quantity,
    (flight.FALL, flight.TOUCHDOWN_TIME, flight.SETTLING, flight.DROP, STATE.quantities[2], flight.V2_AFTER),
)


def _changed(model: Model, steps: Iterable[Step], inputs: Sequence[sp.Symbol], asked: Sequence[sp.Symbol]) -> Steps:
    """The changes `asked` with the robot and further inputs."""
    return changed_steps(model.in_parameters(tuple(steps)), (*model.robot.symbols, *inputs), asked)


def _by_root(steps: Iterable[Step]) -> Steps:
    """Steps in which the change of a root is divided by that root."""
    by_root = {sp.sqrt(square): root}
    return tuple(step if step.symbol == root else replace(step, value=step.value.subs(by_root)) for step in steps)


@function(
    takes=(ROBOT, flight.GAINS, CURRENT, SIDE_1, FOLLOWS, ROBOT_CHANGE, GAINS_CHANGE, CURRENT_CHANGE),
    returns=FLIGHT_SLOPES,
)
def flight_slopes_of(model: Model) -> Steps:
    """Change of a mode of the flight with the robot, the gains and the current at its limit, 0 under the law."""
    of_p, of_q, of_a = FLIGHT_MODE.symbols
    here = sp.expand(flight.acceleration(model).subs(u, follows * (Kp * x1 + Kd * v1) / gamma2 + u))
    steps = (
        Step(of_p, -here.diff(v1), "(3) in flight, per v_1"),
        Step(of_q, -here.diff(x1), "(3) in flight, per x_1"),
        Step(of_a, here.subs({x1: 0, v1: 0}), "(3) in flight, constant"),
    )
    yield from _changed(model, steps, (Kp, Kd, u), FLIGHT_SLOPES.symbols)


@function(takes=(ROBOT, flight.SETTLING, ADDS, ROBOT_CHANGE, SETTLING_CHANGE), returns=GAINS_CHANGE)
def critical_gains_change(model: Model) -> Steps:
    """Change of the gains of a critically damped return with the robot and the time."""
    steps = (replace(s, value=adds * shortfall) if s.symbol == Kd else s for s in flight.critical_gains(model))
    yield from _changed(model, steps, (time,), GAINS_CHANGE.symbols)


@function(takes=(ROBOT, ROBOT_CHANGE), returns=FALL_CHANGE)
def fall_change(model: Model) -> Steps:
    """Change of the acceleration with which the body falls."""
    yield from _changed(model, flight.fall_of(model), (), FALL_CHANGE.symbols)


@function(
    takes=(ROBOT, STATE.quantities[2], flight.DROP, ROBOT_CHANGE, V2_CHANGE, DROP_CHANGE),
    returns=TOUCHDOWN_TIME_CHANGE,
)
def time_of_fall_change(model: Model) -> Steps:
    """Change of the time after which the body has come down from a height."""
    steps = (
        Step(square, v2**2 + 2 * model.fall * drop, "square of the velocity there"),
        Step(root, sp.sqrt(square), "the velocity there"),
        Step(flight.touchdown_time, (v2 + root) / model.fall, "ballistic"),
    )
    yield from _by_root(_changed(model, steps, (v2, drop), (root, *TOUCHDOWN_TIME_CHANGE.symbols)))


@function(takes=(ROBOT, STATE.quantities[2], ROBOT_CHANGE, V2_CHANGE), returns=V2_AFTER_CHANGE)
def velocity_after_impact_change(model: Model) -> Steps:
    """Change of the velocity of the body after the impact."""
    steps = (
        Step(square, 1 - impact_loss, "share of the energy that is left"),
        Step(root, sp.sqrt(square), "share of the velocity that is left"),
        Step(flight.v2_after, v2 * root, "impact loss"),
    )
    yield from _by_root(_changed(model, steps, (v2,), (root, *V2_AFTER_CHANGE.symbols)))
