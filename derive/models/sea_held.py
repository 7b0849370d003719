"""A series-elastic actuator on a test bench: its output is clamped, and the spring measures the torque.

N^2 J_m theta'' = N k_m i - k theta - (d + N^2 b_m) theta' - F_m sign(theta')
"""

from hopform.model import *

J_m = parameter("J_m", "kg m^2", "inertia of the rotor", "positive", 3e-5)
N = parameter("N", "1", "ratio of the gear, turns of the motor per turn of the output", "positive", 50)
k_m = parameter("k_m", "N m/A", "motor constant", default=0.05)
b_m = parameter("b_m", "N m s/rad", "viscous friction of the motor", "nonnegative", 1e-5)
F_m = parameter("F_m", "N m", "Coulomb friction of motor and gear at the output", "nonnegative", 0.5)
k = parameter("k", "N m/rad", "stiffness of the spring", "positive", 200)
d = parameter("d", "N m s/rad", "damping of the spring", "nonnegative", 0.05)
theta_min = parameter("theta_min", "rad", "lower stop of the motor", "lower", -float("inf"))
theta_max = parameter("theta_max", "rad", "upper stop of the motor", "upper", float("inf"))
i_max = parameter("i_max", "A", "limit of the current", "bound", float("inf"))

theta = coordinate("theta", "rad", N**2 * J_m, "motor")
q = coordinate("q", "rad", 1, "load", held=True)  # whatever its inertia
i = current("i", "A", limit=i_max)

spring(theta - q, k).damper(d)
viscous(theta, N**2 * b_m)
torque(theta, N * k_m * i, "motor")
friction(theta, F_m)
stop(theta, theta_min, theta_max)
