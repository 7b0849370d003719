"""Drag of the air on the body, quadratic in its velocity: no phase is linear, so there is no transform."""

from hopform.model import Quantity, Term, v2

drag = Quantity("d2", r"d_2", "kg/m", "drag of the body", "nonnegative", 0.0)

terms = (Term("drag", 0, -drag.symbol * v2**2),)
parameters = (drag,)
