"""A rail along which the body slides with viscous friction: in flight it would be no longer ballistic."""

from hopform.model import Quantity, Term, v2

friction = Quantity("b_rail", r"b_r", "N s/m", "viscous friction of the rail", "nonnegative", 0.0)

terms = (Term("rail", 0, -friction.symbol * v2),)
parameters = (friction,)
