"""A joint with a motor, a return spring, friction that is higher at rest, stops and a load.

One inertia J turns by q; all torques are those at the joint:

    J q'' = k_t i - k (q - q_0) - b q' + load - F(q')

F is Coulomb friction: F_p at q' > 0, -F_m at q' < 0. At rest it takes up to F_p + F_sp and F_m + F_sm. The motor's
inertia and torque count behind its gear: J = J_joint + N^2 J_motor, k_t = N times the motor's constant. k = 0 leaves
the joint free.
"""

from hopform.model import *

J = parameter("J", "kg m^2", "inertia of the joint, the motor's behind its gear in it", "positive", 0.031)
k = parameter("k", "N m/rad", "stiffness of the return spring", "nonnegative", 0)
q_0 = parameter("q_0", "rad", "angle at which that spring is slack", default=0)
b = parameter("b", "N m s/rad", "viscous friction", "nonnegative", 0.0085)
F_p = parameter("F_p", "N m", "Coulomb friction forward", "nonnegative", 0.042)
F_m = parameter("F_m", "N m", "Coulomb friction backward", "nonnegative", 0.042)
F_sp = parameter("F_sp", "N m", "friction at rest against a start forward, less F_p", "nonnegative", 0)
F_sm = parameter("F_sm", "N m", "friction at rest against a start backward, less F_m", "nonnegative", 0)
k_t = parameter("k_t", "N m/A", "torque per current", default=0.1)
load = parameter("load", "N m", "constant load", default=0)
q_min = parameter("q_min", "rad", "lower stop", "lower", -float("inf"))
q_max = parameter("q_max", "rad", "upper stop", "upper", float("inf"))
i_max = parameter("i_max", "A", "limit of the current", "bound", float("inf"))

q = coordinate("q", "rad", J, "joint")
i = current("i", "A", limit=i_max)

spring(q - q_0, k, "return spring")
viscous(q, b)
torque(q, k_t * i, "motor")
torque(q, load, "load")
friction(q, forward=F_p, backward=F_m, at_rest=(F_p + F_sp, F_m + F_sm))
stop(q, q_min, q_max)
