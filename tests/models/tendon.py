"""A tendon that moves a foot."""

from hopform.model import *

J_m = parameter("J_m", "kg m^2", "inertia of the drum", "positive", 0.002)
J_l = parameter("J_l", "kg m^2", "inertia of the leg", "positive", 0.05)
k_t = parameter("k_t", "N m/A", "torque per current", "positive", 0.3)
K = parameter("K", "N m/rad", "stiffness of the tendon", "positive", 40.0)
c_t = parameter("c_t", "N m s/rad", "damping of the tendon", "nonnegative", 0.05)
F_d = parameter("F_d", "N m", "friction of the drum", "nonnegative", 0.2)
i_max = parameter("i_max", "A", "limit of the current", "bound", 12.0)
d_min = parameter("d_min", "rad", "lower stop of the drum", "lower", -2.0)
d_max = parameter("d_max", "rad", "upper stop of the drum", "upper", 2.0)

drum = coordinate("drum", "rad", J_m, "drum", directions=("winds", "unwinds"))
leg = coordinate("leg", "rad", J_l, "leg")
i = current("i", "A", limit=i_max)

spring(drum - leg, K, "tendon").damper(c_t, "tendon damping")
viscous(leg, 0.02, "knee")
friction(drum, F_d, name="drum friction")
torque(drum, k_t * i, "motor")
stop(drum, d_min, d_max, "drum stops")
