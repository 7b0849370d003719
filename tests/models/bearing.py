"""A second bearing of the actuator, and a spring balancer that pulls it:
what the hopper's own b1 and k c do already.
"""

from hopform.model import Quantity, Term, v1

friction = Quantity("b1_bearing", r"b_b", "N s/m", "viscous friction of the second bearing", "nonnegative", 0.0)
pull = Quantity("F_balancer", r"F_b", "N", "constant force of the balancer on the actuator", default=0.0)

terms = (Term("bearing", -friction.symbol * v1, 0), Term("balancer", pull.symbol, 0))
parameters = (friction, pull)
