"""A servo: a joint whose motor follows a target, up to the limit of its current.

One inertia J turns by q, behind the gear; all torques are those at the joint:

    J q'' = k_t i - b q' + load - F(q')
    i = (K_p (target - q) - K_d q')/k_t, but not beyond -i_max and i_max

The target is constant, or steps. F is Coulomb friction: F_p at q' > 0, -F_m at q' < 0. At rest it takes up to
F_p + F_sp and F_m + F_sm. As in a joint J and k_t are seen behind the gear: J = J_joint + N^2 J_motor, k_t = N times the
motor's constant. The law is continuous in time: a controller that holds its current from tick to tick is a joint under
steps of that current.
"""

from hopform.model import *

J = parameter("J", "kg m^2", "inertia of the joint, the motor's behind its gear in it", "positive", 0.031)
b = parameter("b", "N m s/rad", "viscous friction", "nonnegative", 0.0085)
F_p = parameter("F_p", "N m", "Coulomb friction forward", "nonnegative", 0.042)
F_m = parameter("F_m", "N m", "Coulomb friction backward", "nonnegative", 0.042)
F_sp = parameter("F_sp", "N m", "friction at rest against a start forward, less F_p", "nonnegative", 0)
F_sm = parameter("F_sm", "N m", "friction at rest against a start backward, less F_m", "nonnegative", 0)
k_t = parameter("k_t", "N m/A", "torque per current", "positive", 0.1)
K_p = parameter("K_p", "N m/rad", "torque per difference of target and joint", "nonnegative", 8)
K_d = parameter("K_d", "N m s/rad", "torque per velocity, against it", "nonnegative", 0.9)
load = parameter("load", "N m", "constant load", default=0)
q_min = parameter("q_min", "rad", "lower stop", "lower", -float("inf"))
q_max = parameter("q_max", "rad", "upper stop", "upper", float("inf"))
i_max = parameter("i_max", "A", "limit of the current", "bound", 10)

q = coordinate("q", "rad", J, "joint")
i = current("i", "A", limit=i_max)

viscous(q, b)
torque(q, k_t * i, "motor")
torque(q, load, "load")
friction(q, forward=F_p, backward=F_m, at_rest=(F_p + F_sp, F_m + F_sm))
stop(q, q_min, q_max)
law(i, q, proportional=K_p, derivative=K_d, target="target")
