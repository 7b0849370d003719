"""A pendulum joint that hangs, at small angle, between stops, with friction and a motor.

A link of the mass m, its centre of mass l from the axis, whose inertia about it is J; q = 0 hangs:

    J q'' = -m g l q - b q' + k_t i - F,        F = F_p where q' > 0, -F_m where q' < 0

At rest it is held while the other torques are within F_s, which is at least F_p and F_m. It meets a stop inelastically
at q_min and q_max.
"""

from hopform.model import *

J = parameter("J", "kg m^2", "inertia about the axis", "positive", 0.05)
m = parameter("m", "kg", "mass of the link", "positive", 1)
l = parameter("l", "m", "distance of the centre of mass from the axis", "positive", 0.2)
g = parameter("g", "m/s^2", "gravity", "nonnegative", 9.81)
b = parameter("b", "N m s/rad", "viscous friction", "nonnegative", 0.05)
k_t = parameter("k_t", "N m/A", "torque per current", default=0.5)
F_p = parameter("F_p", "N m", "Coulomb friction forward", "nonnegative", 0.1)
F_m = parameter("F_m", "N m", "Coulomb friction backward", "nonnegative", 0.1)
F_s = parameter("F_s", "N m", "friction at rest", "nonnegative", 0.12)
q_min = parameter("q_min", "rad", "lower stop", "lower", -0.5)
q_max = parameter("q_max", "rad", "upper stop", "upper", 0.5)
i_max = parameter("i_max", "A", "limit of the current", "bound", 5)

q = coordinate("q", "rad", J, "joint")
i = current("i", "A", limit=i_max)

spring(q, m * g * l, "weight")
viscous(q, b)
torque(q, k_t * i, "motor")
friction(q, forward=F_p, backward=F_m, at_rest=F_s)
stop(q, q_min, q_max)
