"""A cable that holds the body up, or down, while the hopper stands; it is let go at take-off."""

from hopform.model import Quantity, Term

pull = Quantity("F_cable", r"F_c", "N", "force of the cable on the body", default=0.0)

terms = (Term("cable", 0, pull.symbol, acts="stance"),)
parameters = (pull,)
