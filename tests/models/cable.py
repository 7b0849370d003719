"""A cable that pulls the body up: the flight knows no force on the body but its weight,
so the pull would end at take-off.
"""

from hopform.model import Quantity, Term

pull = Quantity("F_cable", r"F_c", "N", "force of the cable on the body", default=0.0)

terms = (Term("cable", 0, pull.symbol),)
parameters = (pull,)
