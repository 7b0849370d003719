"""The contact of the leg with the ground, which can push but not pull: take-off is where its force vanishes.

The contact force N is what the leg carries: k y for the paper's leg, k y + b_12 (v_1 - v_2) with a damper beside the
spring. It is taken over k, so that it is the compression y itself for the paper's leg.
"""

import sympy as sp

from ..ir import Quantity, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *
from . import sensitivity
from .laplace import NAMES, START

CONTACT = scalar("contact", "m", "contact force of the leg over k")
REST = scalar("rest", "m", "compression at which the leg carries nothing")
LEG_TIME = scalar("leg_time", "s", "time in which the leg without load relaxes to 1/e of its compression")
LEFT = Quantity("left", r"y - y_0", "m", "compression of the leg beyond that at rest")
LEG_ENERGY = scalar("leg_energy", "J", "energy that the leg holds beyond that at rest")
contact, rest, left = CONTACT.symbol, REST.symbol, LEFT.symbol


def is_compression(model: Model) -> bool:
    """Whether the contact force is k y, and cannot pull."""
    return bool(model.contact == y) and "foot" not in model.fixed


def has_damper(model: Model) -> bool:
    """Whether a damper acts in the leg: without load it relaxes in flight, y' = -(y - y_0)/leg_time."""
    return bool({v1, v2} & model.contact.free_symbols)


@function(takes=(ROBOT, STATE), returns=CONTACT)
def contact_of(model: Model) -> Steps:
    """Contact force of the leg over k, at a state."""
    yield Step(contact, model.contact, "what the leg carries")


@function(takes=(ROBOT, STATE), returns=CONTACT)
def contact_slope(model: Model) -> Steps:
    """Change of the contact force over k with a change of the state, or with its rate."""
    slope = sum((model.contact.diff(symbol) * symbol for symbol in (y, v1, v2)), sp.S.Zero)
    yield Step(contact, sp.expand(slope), "what the leg carries")


@function(takes=(ROBOT, MOTION), returns=NUMERATOR)
def contact_numerator(model: Model) -> Steps:
    """Numerator of the contact force over k."""
    slopes = [model.contact.diff(symbol) for symbol in START]
    for name, terms in zip(NUMERATOR.symbols, zip(*NAMES.values(), strict=True), strict=True):
        yield Step(name, sp.expand(sum(map(sp.Mul, slopes, terms), sp.S.Zero)), "what the leg carries")


@function(
    takes=(ROBOT, STATE, sensitivity.ROBOT_CHANGE, sensitivity.STATE_CHANGE),
    returns=scalar("d_contact", "m", "change of the contact force over k"),
)
def contact_change(model: Model) -> Steps:
    """Change of the contact force over k with the robot and the state."""
    steps = (Step(contact, model.contact, "what the leg carries"),)
    return sensitivity.changed_steps(steps, (*model.robot.symbols, v1, v2, y), (sensitivity.change_of(contact),))


@function(takes=(ROBOT, *STATE.quantities[1:3]), returns=REST)
def compression_at_takeoff(model: Model) -> Steps:
    """Compression at which the leg carries nothing, on the ground: 0 where the spring is all that acts in it."""
    yield Step(rest, sp.cancel(-model.contact.subs(y, 0) / model.contact.diff(y)), "N = 0")


@function(takes=(ROBOT,), returns=LEG_TIME)
def leg_time(model: Model) -> Steps:
    """Time in which the leg without load relaxes to 1/e of its compression; 0 where no damper acts in it."""
    yield Step(LEG_TIME.symbol, sp.cancel(model.contact.diff(v1) / model.contact.diff(y)), "N = 0 in flight")


@function(takes=(ROBOT, LEFT), returns=LEG_ENERGY)
def leg_energy(model: Model) -> Steps:
    """Energy that the leg holds beyond that at rest."""
    yield Step(LEG_ENERGY.symbol, k * model.contact.diff(y) * left**2 / 2, "what carries the contact force at rest")
