"""A second bearing of the actuator, and a cable that pulls the body up: forces on one mass alone."""

from derive.ir import Quantity
from derive.model import Term
from derive.quantities import v1

friction = Quantity("b1_bearing", r"b_b", "N s/m", "viscous friction of the second bearing", "nonnegative", 0.0)
pull = Quantity("F_cable", r"F_c", "N", "force of the cable on the body", default=0.0)

terms = (Term("bearing", -friction.symbol * v1, 0), Term("cable", 0, pull.symbol))
parameters = (friction, pull)
