"""A joint: one inertia on a spring to the ground, with friction, stops and a load; nothing takes off.

J phi'' = -k (phi - phi_0) - b phi' + k_t i + load - F_plus or + F_minus, by sign(phi')

k = 0 is allowed.
"""

from hopform.model import *

J = parameter("J", "kg m^2", "inertia", "positive")
k = parameter("k", "N m/rad", "stiffness of the spring to the ground", "nonnegative", 0)
phi_0 = parameter("phi_0", "rad", "where that spring is slack", default=0)
b = parameter("b", "N m s/rad", "viscous friction", "nonnegative", 0)
F_plus = parameter("F_plus", "N m", "Coulomb friction forward", "nonnegative", 0)
F_minus = parameter("F_minus", "N m", "Coulomb friction backward", "nonnegative", 0)
k_t = parameter("k_t", "N m/A", "torque per current", default=0)
load = parameter("load", "N m", "constant load", default=0)
phi_min = parameter("phi_min", "rad", "lower stop", "lower", -float("inf"))
phi_max = parameter("phi_max", "rad", "upper stop", "upper", float("inf"))
i_max = parameter("i_max", "A", "limit of the current", "bound", float("inf"))

phi = coordinate("phi", "rad", J, "joint")
i = current("i", "A", limit=i_max)

spring(phi - phi_0, k)
viscous(phi, b)
torque(phi, k_t * i, "motor")
torque(phi, load, "load")
friction(phi, forward=F_plus, backward=F_minus)
stop(phi, phi_min, phi_max)
