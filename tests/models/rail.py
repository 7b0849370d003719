"""A rail along which the body slides with viscous friction: in flight it would be no longer ballistic."""

from hopform.model import *

x2 = include("hopper").x2
b_rail = parameter("b_rail", "N s/m", "viscous friction of the rail", "nonnegative", 0)

viscous(x2, b_rail, "rail")
