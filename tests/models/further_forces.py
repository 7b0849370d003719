"""Forces on the hopper: a second bearing of the actuator and a spring balancer that pulls it, which are what the
hopper's own b1 and k c do already, and a cable that holds the body up, or down, while the hopper stands; it is let go at
take-off.
"""

from hopform.model import *

h = include("hopper")
b1_bearing = parameter("b1_bearing", "N s/m", "viscous friction of the second bearing", "nonnegative", 0)
F_balancer = parameter("F_balancer", "N", "constant force of the balancer on the actuator", default=0)
F_cable = parameter("F_cable", "N", "force of the cable on the body", default=0)

viscous(h.x1, b1_bearing, "bearing")
force(h.x1, F_balancer, "balancer")
force(h.x2, F_cable, "cable", where="stance")
