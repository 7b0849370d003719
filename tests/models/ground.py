"""A spring from the actuator to the ground: moved as a whole the hopper feels it, so (11) loses its factor s^2."""

from hopform.model import Quantity, Term, x1

stiffness = Quantity("k1", r"k_1", "N/m", "stiffness of a spring to the ground", "nonnegative", 0.0)

terms = (Term("ground spring", -stiffness.symbol * x1, 0),)
parameters = (stiffness,)
