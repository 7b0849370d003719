"""A rod that brakes the actuator against the body's motion, without a reaction on the body:
what would it do in flight?
"""

from hopform.model import Quantity, Term, v2

damping = Quantity("b_rod", r"b_r", "N s/m", "force on the actuator per velocity of the body", "nonnegative", 0.0)

terms = (Term("rod", damping.symbol * v2, 0),)
parameters = (damping,)
