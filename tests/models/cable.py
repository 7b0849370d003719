"""A cable over a counterweight that pulls the body up, in stance and in flight."""

from hopform.model import Quantity, Term

pull = Quantity("F_cable", r"F_c", "N", "force of the cable on the body", default=0.0)

terms = (Term("cable", 0, pull.symbol),)
parameters = (pull,)
