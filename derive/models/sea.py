"""A series-elastic actuator with its load: a motor behind a gear turns a spring, which turns the load.

All is counted at the output. theta is the motor's angle behind its gear, q that of the load:

    N^2 J_m theta'' = N k_m i - k (theta - q) - d (theta' - q') - N^2 b_m theta' - F_m sign(theta')
        J_l q''     = k (theta - q) + d (theta' - q') - b_l q' - F_l sign(q') + load
"""

from hopform.model import *

J_m = parameter("J_m", "kg m^2", "inertia of the rotor", "positive", 3e-5)
N = parameter("N", "1", "ratio of the gear, turns of the motor per turn of the output", "positive", 50)
k_m = parameter("k_m", "N m/A", "motor constant", default=0.05)
b_m = parameter("b_m", "N m s/rad", "viscous friction of the motor", "nonnegative", 1e-5)
F_m = parameter("F_m", "N m", "Coulomb friction of motor and gear at the output", "nonnegative", 0.5)
k = parameter("k", "N m/rad", "stiffness of the spring", "positive", 200)
d = parameter("d", "N m s/rad", "damping of the spring", "nonnegative", 0.05)
J_l = parameter("J_l", "kg m^2", "inertia of the load", "positive", 0.1)
b_l = parameter("b_l", "N m s/rad", "viscous friction of the load", "nonnegative", 0.02)
F_l = parameter("F_l", "N m", "Coulomb friction of the load", "nonnegative", 0.1)
load = parameter("load", "N m", "constant torque on the load", default=0)
theta_min = parameter("theta_min", "rad", "lower stop of the motor", "lower", -float("inf"))
theta_max = parameter("theta_max", "rad", "upper stop of the motor", "upper", float("inf"))
i_max = parameter("i_max", "A", "limit of the current", "bound", float("inf"))

theta = coordinate("theta", "rad", N**2 * J_m, "motor")
q = coordinate("q", "rad", J_l, "load")
i = current("i", "A", limit=i_max)

spring(theta - q, k).damper(d)
viscous(theta, N**2 * b_m)
viscous(q, b_l)
torque(theta, N * k_m * i, "motor")
torque(q, load, "load")
friction(theta, F_m)
friction(q, F_l)
stop(theta, theta_min, theta_max)
