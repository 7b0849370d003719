"""A second spring in the leg, beside the first: the leg's contact force is the sum of both, and zero where y is not."""

from hopform.model import Quantity, Term, x1, x2

stiffness = Quantity("k_2", r"k_2", "N/m", "stiffness of the second spring", "nonnegative", 0.0)
length = Quantity("L_2", r"L_2", "m", "length at which it is slack", "positive", 0.4)
force = stiffness.symbol * (x1 - x2 + length.symbol)

terms = (Term("second spring", -force, force),)
parameters = (stiffness, length)
