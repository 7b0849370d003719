"""A second bearing of the actuator, and a spring balancer that pulls it:
what the hopper's own b1 and k c do already.
"""

from hopform.model import *

x1 = include("hopper").x1
b1_bearing = parameter("b1_bearing", "N s/m", "viscous friction of the second bearing", "nonnegative", 0)
F_balancer = parameter("F_balancer", "N", "constant force of the balancer on the actuator", default=0)

viscous(x1, b1_bearing, "bearing")
force(x1, F_balancer, "balancer")
