"""A door with a closer."""

from hopform.model import *

I_d = parameter("I_d", "kg m^2", "inertia of the door about its hinges", "positive", 2.5)
k_c = parameter("k_c", "N m/rad", "stiffness of the closer's spring", "positive", 8.0)
phi_0 = parameter("phi_0", "rad", "angle where the spring is slack", default=-0.6)
c_oil = parameter("c_oil", "N m s/rad", "damping of the oil", "nonnegative", 6.0)
F_h = parameter("F_h", "N m", "friction of the hinges", "nonnegative", 0.9)
F_h0 = parameter("F_h0", "N m", "friction of the hinges at rest", "nonnegative", 1.4)
push_max = parameter("push_max", "N", "largest push", "bound", 60.0)
r = parameter("r", "m", "distance of the handle from the hinges", "positive", 0.85)

phi = coordinate("phi", "rad", I_d, "door", directions=("opening", "closing"))
P = current("P", "N", limit=push_max, thing="hand", meaning="push at the handle")

spring(phi - phi_0, k_c, "closer spring")
viscous(phi, c_oil, "oil")
friction(phi, F_h, at_rest=F_h0 + F_h, name="hinges")
torque(phi, r * P, "push")
stop(phi, 0, 1.9, "frame")
