"""The modes of each mass and their ends: slipping up, slipping down, or held (stuck).

Mass i is held at v_i = 0 while |a_i| <= f_s,i, where the free acceleration a_i is the right side of (3) or (4) at
v_i = 0 without the friction of mass i, and the friction at rest f_s,i = f_i + f_i,e; where friction differs by sign f_i
is its mean, a_i has the rest of it, and f_i,e differs by sign. In each of the four combinations of slipping and held
masses the motion is linear, so it has the closed form of time_domain.py; it ends at the first of

    v_i = 0                 slipping: reverse if |a_i| > f_s,i, else stick
    |a_i| = f_s,i           held: slip in the direction of a_i, at first with the acceleration f_i,e
    x_1 = x1_min or x1_max  slipping: the actuator loses v_1
    y = 0                   with the leg extending: take-off, because the contact force is k y
"""

import sympy as sp

from ..ir import Quantity, Record, Spelled, Step, Steps, function, scalar
from ..model import words
from ..model.equations import Model
from ..model.quantities import *

FRICTION = Record("Friction", "Coulomb friction of a mass that slips.").of(
    Quantity("level_1", "f_1", "m/s^2", "of the actuator", "nonnegative"),
    Quantity("level_2", "f_2", "m/s^2", "of the body", "nonnegative"),
)
EXCESS = Record("Excess", "Friction of a mass at rest less that of one that slips, by where it would slip.").of(
    Quantity("up_1", "f_{1,e}", "m/s^2", "of the actuator, to v_1 > 0", "nonnegative"),
    Quantity("down_1", "f_{1,e}", "m/s^2", "of the actuator, to v_1 < 0", "nonnegative"),
    Quantity("up_2", "f_{2,e}", "m/s^2", "of the body, to v_2 > 0", "nonnegative"),
    Quantity("down_2", "f_{2,e}", "m/s^2", "of the body, to v_2 < 0", "nonnegative"),
)
RESISTED = Record("Resisted", "What friction takes of the acceleration of a mass: its level with the sign of v_i.").of(
    Quantity("resisted_1", r"a_{1,r}", "m/s^2", "of the actuator; held, as much of the free acceleration as it can"),
    Quantity("resisted_2", r"a_{2,r}", "m/s^2", "of the body; held, as much of the free acceleration as it can"),
)
FORCES = Record("Forces", "Forces at an instant, along the coordinate that each acts on.").of(
    Quantity("friction_1", r"F_{f,1}", "N", "of friction on the actuator; held, as much as it takes to hold it"),
    Quantity(
        "stop_1", r"F_{s,1}", "N", "of the stop that holds the actuator, what friction does not carry; 0 elsewhere"
    ),
    Quantity("friction_2", r"F_{f,2}", "N", "of friction on the body; held, as much as it takes to hold it"),
    Quantity("driven_1", r"F_u", "N", "of the input"),
    Quantity("contact_force", "N", "N", "of the ground"),
)
"""All that a model may have; `forces_record` has those of a model, under their names in it."""


def is_coupled(model: Model) -> bool:
    """Whether the velocity of an element acts on another one."""
    first, second = model.in_compression
    return bool(first.diff(v2) != 0 or second.diff(v1) != 0)


@function(takes=(ROBOT,), returns=FRICTION)
def friction_of(model: Model) -> Steps:
    """Levels of Coulomb friction: where it differs by sign their mean, the rest being a constant force."""
    return tuple(Step(name, f, "(3), (4)") for name, f in zip(FRICTION.symbols, model.levels, strict=True))


@function(takes=(ROBOT,), returns=EXCESS)
def excess_of(model: Model) -> Steps:
    """Friction at rest less that in motion: a free acceleration may go further by it before the mass slips."""
    values = (excess for pair in model.excesses for excess in pair)
    return tuple(Step(name, excess, "(5) at rest") for name, excess in zip(EXCESS.symbols, values, strict=True))


@function(takes=(ROBOT, STATE), returns=scalar("rate_y", "m/s", "rate of the compression"))
def stretch_rate(model: Model) -> Steps:
    """Rate of the compression."""
    yield Step(sp.Symbol("rate_y", real=True), model.ratio * v1 - v2, "(3), (4)")


_FREE = (
    (free_1, (a1_0, a1_u * u, a1_y * y, a1_v2 * v2), "(3)"),
    (free_2, (a2_0, a2_y * y, a2_v1 * v1), "(4)"),
)
"""Free accelerations of both masses, term by term."""


@function(takes=(RATES, STATE, CURRENT), returns=FREE)
def free_accelerations() -> Steps:
    """Free accelerations of both masses.

    They are (3), (4) at v_i = 0 without the friction of mass i.
    """
    for name, terms, equation in _FREE:
        yield Step(name, sp.Add(*terms), f"{equation} at v_i = 0")


@function(takes=(RATES, STATE, CURRENT), returns=FREE)
def free_terms() -> Steps:
    """Sums of the magnitudes of the terms of free_accelerations: what these are rounded by is in proportion to them."""
    for name, terms, equation in _FREE:
        yield Step(name, sp.Add(*map(sp.Abs, terms)), f"{equation} at v_i = 0, by magnitude")


def forces_record(model: Model) -> Record:
    """The forces of what a model's file declares, named after the coordinates that they act on."""
    first, second = (own.coordinate if own else "" for own in model.names)
    names = {
        "friction_1": f"friction_{first}" if first and model.has_friction[0] else "",
        "stop_1": f"stop_{first}" if first and model.has_stops else "",
        "friction_2": f"friction_{second}" if second and model.has_friction[1] else "",
        "driven_1": "input" if model.input is not None else "",
        "contact_force": "contact" if model.has_contact else "",
    }
    return FORCES.of(
        *(
            Spelled(names[each.name], each.glyph, each.unit, each.meaning, letter=each.name)
            for each in (words.of_quantity(model, quantity) for quantity in FORCES.quantities)
            if names[each.name]
        )
    )


@function(takes=(ROBOT, STATE, FREE, RESISTED, CURRENT), returns=FORCES)
def forces_of(model: Model) -> Steps:
    """Forces of friction, of the stop that holds the actuator, of the current and of the ground.

    The stop carries what friction leaves of the free acceleration of the actuator.
    """
    friction_1, stop_1, friction_2, driven_1, contact_force = FORCES.symbols
    for name, friction, mass, side, resisted in zip(
        (friction_1, friction_2), model.friction, (m_eff, m_s), (side_1, side_2), RESISTED.symbols, strict=True
    ):
        yield Step(name, sp.expand(friction.subs(side, 0) - mass * resisted), "(3), (4)")
    yield Step(stop_1, m_eff * (RESISTED.symbols[0] - free_1), "(3) at v_1' = 0")
    yield Step(driven_1, -gamma2 * u, "(3)")
    yield Step(contact_force, sp.expand(model.stiffness * model.contact), "what the leg carries")


@function(takes=(RATES, MOTION), returns=NUMERATOR)
def free_numerator_1() -> Steps:
    """Numerator of the free acceleration of mass 1 while it is held."""
    return _free_numerator(1)


@function(takes=(RATES, MOTION), returns=NUMERATOR)
def free_numerator_2() -> Steps:
    """Numerator of the free acceleration of mass 2 while it is held."""
    return _free_numerator(2)


def _free_numerator(number: int) -> Steps:
    per_y, per_v, other = ((a1_y, a1_v2, (H3_2, H2_2, H1_2)), (a2_y, a2_v1, (H3_1, H2_1, H1_1)))[number - 1]
    of_y = (H3_y, H2_y, H1_y)
    values = [per_y * h_y + per_v * h_v for h_y, h_v in zip(of_y, other, strict=True)]
    return tuple(Step(name, sp.expand(v), f"({number + 2}) held") for name, v in zip((H3, H2, H1), values, strict=True))
