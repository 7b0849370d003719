"""A series elastic joint: a rotor behind a gear, a spring with a damper beside it, a link."""

from hopform.model import *

J = parameter("J", "kg m^2", "inertia of the rotor", "positive", 2e-5)
I = parameter("I", "kg m^2", "inertia of the link", "positive", 0.05)
N = parameter("N", "1", "ratio of the gear", "positive", 50)
k = parameter("k", "N m/rad", "stiffness of the spring", "positive", 120)
d = parameter("d", "N m s/rad", "damping beside the spring", "nonnegative", 0.05)
b = parameter("b", "N m s/rad", "viscous friction of the rotor", "nonnegative", 1e-5)
F = parameter("F", "N m", "Coulomb friction of the rotor", "nonnegative", 0.004)
F_s = parameter("F_s", "N m", "by how much it is higher at rest", "nonnegative", 0.001)
F_q = parameter("F_q", "N m", "Coulomb friction of the link", "nonnegative", 0.1)
load = parameter("load", "N m", "constant torque on the link", default=0)
k_t = parameter("k_t", "N m/A", "torque per current", default=0.05)
i_max = parameter("i_max", "A", "limit of the current", "bound", 8)
theta_min = parameter("theta_min", "rad", "lower end of the rotor's range", "lower", -60)
theta_max = parameter("theta_max", "rad", "upper end of the rotor's range", "upper", 60)

theta = coordinate("theta", "rad", J, "rotor")
q = coordinate("q", "rad", I, "link")
i = current("i", "A", limit=i_max)

spring(theta / N - q, k).damper(d)
viscous(theta, b)
friction(theta, F, at_rest=F + F_s)
friction(q, F_q)
torque(q, load, "load")
torque(theta, k_t * i, "motor")
stop(theta, theta_min, theta_max)
