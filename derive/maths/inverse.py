"""Inverse dynamics of the coordinate that the input drives: (3), solved for the input.

    u = (m_eff a + s + F)/per_unit

a is the desired acceleration, s what the equation of motion has beside inertia, friction and input, F friction
against the motion, per_unit the force per input. On what is at rest friction takes F and the excess at rest before it
slips.
"""

from typing import NamedTuple

import sympy as sp

from ..model.equations import Model
from ..model.quantities import *

ACCELERATION = sp.Symbol("acceleration", real=True)


class Inverse(NamedTuple):
    """The terms of the input that drives a coordinate, in the parameters of the model, its coordinates and velocities:
    all but `per_unit` are forces along it [N].
    """

    inertia: sp.Expr
    """of the coordinate, times ACCELERATION"""
    smooth: sp.Expr
    forward: sp.Expr
    """friction at a velocity above 0"""
    backward: sp.Expr
    forward_at_rest: sp.Expr
    """what friction takes before a start forward"""
    backward_at_rest: sp.Expr
    per_unit: sp.Expr


def is_driven(model: Model) -> bool:
    """Whether the input is a force on a coordinate."""
    return model.input is not None and model.law is None and model.value(gamma2) != 0


def inverse_of(model: Model) -> Inverse:
    """The input of a model that is driven by a force."""
    friction, (up, down) = model.friction[0], model.excesses[0]
    forward, backward = -friction.subs(side_1, 1), -friction.subs(side_1, -1)

    def in_file(term: sp.Expr) -> sp.Expr:
        return sp.expand(model.value(sp.expand(term.subs(model.still))))

    def level(term: sp.Expr) -> sp.Expr:
        return sp.expand(sp.cancel(model.value(term)))

    return Inverse(
        inertia=in_file(m_eff * ACCELERATION),
        smooth=in_file(friction - m_eff * model.accelerations[0].subs(u, 0)),
        forward=level(forward),
        backward=level(backward),
        forward_at_rest=level(forward + m_eff * up),
        backward_at_rest=level(backward - m_eff * down),
        per_unit=in_file(-gamma2),
    )
