"""The contact of the leg with the ground, which can push but not pull: take-off is where its force vanishes.

The contact force N is the force in the leg: k y for the paper's leg, k y + b_12 (v_1 - v_2) with a damper beside the
spring, (k + k_2) y with a second spring, where y counts from the free length of the leg. It is taken
over the leg's stiffness dN/dy, so that it is y itself without a damper.
"""

import sympy as sp

from ..ir import Quantity, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *
from . import sensitivity
from .laplace import NAMES, START

CONTACT = scalar("contact", "m", "contact force of the leg over its stiffness")
RELEASED = scalar("released", "m", "compression of the leg at which the contact force is 0")
FORCE = scalar("contact_force", "N", "contact force of the leg")
LEG_TIME = scalar("leg_time", "s", "time in which the leg without load relaxes to 1/e of its compression")
LEG_TIME_CHANGE = sensitivity.change_of_quantity(LEG_TIME)
LEFT = Quantity("left", r"y", "m", "compression of the leg without load")
LEG_ENERGY = scalar("leg_energy", "J", "energy that the leg holds beyond that at y = 0")
contact, left = CONTACT.symbol, LEFT.symbol


def is_compression(model: Model) -> bool:
    """Whether the contact force is the leg's stiffness times y, and cannot pull."""
    return bool(model.contact == y) and model.has_contact


def has_damper(model: Model) -> bool:
    """Whether a damper acts in the leg: without load it relaxes in flight, y' = -y/leg_time."""
    return bool({v1, v2} & model.contact.free_symbols)


@function(takes=(ROBOT, STATE), returns=CONTACT)
def contact_of(model: Model) -> Steps:
    """Contact force of the leg over its stiffness, at a state."""
    yield Step(contact, model.contact, "what the leg carries")


@function(takes=(ROBOT, STATE), returns=CONTACT)
def contact_terms(model: Model) -> Steps:
    """Sum of the magnitudes of its terms: what it is rounded by is in proportion to them."""
    yield Step(contact, sp.Add(*map(sp.Abs, sp.Add.make_args(sp.expand(model.contact)))), "what the leg carries")


@function(takes=(ROBOT, STATE), returns=FORCE)
def contact_force(model: Model) -> Steps:
    """Contact force of the leg, at a state."""
    yield Step(contact, model.contact, "what the leg carries")
    yield Step(FORCE.symbol, model.stiffness * contact, "what the leg carries")


@function(takes=(ROBOT, STATE), returns=CONTACT)
def contact_slope(model: Model) -> Steps:
    """Change of the contact force over the leg's stiffness with a change of the state, or with its rate."""
    slope = sum((model.contact.diff(symbol) * symbol for symbol in (y, v1, v2)), sp.S.Zero)
    yield Step(contact, sp.expand(slope), "what the leg carries")


@function(takes=(ROBOT, MOTION), returns=NUMERATOR)
def contact_numerator(model: Model) -> Steps:
    """Numerator of the contact force over the leg's stiffness."""
    slopes = [model.contact.diff(symbol) for symbol in START]
    for name, terms in zip(NUMERATOR.symbols, zip(*NAMES.values(), strict=True), strict=True):
        yield Step(name, sp.expand(sum(map(sp.Mul, slopes, terms), sp.S.Zero)), "what the leg carries")


@function(
    takes=(ROBOT, STATE, sensitivity.ROBOT_CHANGE, sensitivity.STATE_CHANGE),
    returns=scalar("d_contact", "m", "change of the contact force over the leg's stiffness"),
)
def contact_change(model: Model) -> Steps:
    """Change of the contact force over the leg's stiffness with the robot and the state."""
    steps = model.in_parameters((Step(contact, model.contact, "what the leg carries"),))
    return sensitivity.changed_steps(steps, (*model.robot.symbols, v1, v2, y), (sensitivity.change_of(contact),))


@function(takes=(ROBOT, *STATE.quantities[1:3]), returns=RELEASED)
def compression_at_takeoff(model: Model) -> Steps:
    """Compression of the leg on the ground at which the contact force is 0: 0 where no damper acts in it."""
    yield Step(RELEASED.symbol, sp.cancel(-model.contact.subs(y, 0)), "N = 0")


@function(takes=(ROBOT,), returns=LEG_TIME)
def leg_time(model: Model) -> Steps:
    """Time in which the leg without load relaxes to 1/e of its compression; 0 where no damper acts in it."""
    yield Step(LEG_TIME.symbol, sp.cancel(model.contact.diff(v1)), "N = 0 in flight")


@function(takes=(ROBOT, sensitivity.ROBOT_CHANGE), returns=LEG_TIME_CHANGE)
def leg_time_change(model: Model) -> Steps:
    """Change of the time in which the leg without load relaxes with the robot."""
    steps = model.in_parameters(leg_time(model))
    return sensitivity.changed_steps(steps, model.robot.symbols, LEG_TIME_CHANGE.symbols)


@function(takes=(ROBOT, LEFT), returns=LEG_ENERGY)
def leg_energy(model: Model) -> Steps:
    """Energy that the leg holds beyond that at y = 0."""
    yield Step(LEG_ENERGY.symbol, model.stiffness * left**2 / 2, "what carries the contact force at rest")
