"""A series-elastic actuator with its load held: a motor behind a gear winds up a spring.

The load stays at 0. All angles are those behind the gear of the ratio N:

    N^2 J_m motor'' = N k_t i - k motor - b_k motor' - b_m motor' - F_m sign(motor')

It is the file of the actuator with its load free, and one word more: held.
"""

from hopform.model import *

J_m = parameter("J_m", "kg m^2", "inertia of the motor", "positive", 1e-4)
N = parameter("N", "1", "ratio of the gear", "positive", 50)
J_l = parameter("J_l", "kg m^2", "inertia of the load", "positive", 0.1)
k = parameter("k", "N m/rad", "stiffness of the spring", "positive", 200)
b_k = parameter("b_k", "N m s/rad", "viscous friction in the spring", "nonnegative", 0.1)
b_m = parameter("b_m", "N m s/rad", "viscous friction of the motor, behind the gear", "nonnegative", 2)
b_l = parameter("b_l", "N m s/rad", "viscous friction of the load", "nonnegative", 0.1)
F_m = parameter("F_m", "N m", "Coulomb friction of the motor, behind the gear", "nonnegative", 1)
F_l = parameter("F_l", "N m", "Coulomb friction of the load", "nonnegative", 0.05)
k_t = parameter("k_t", "N m/A", "torque per current, before the gear", "positive", 0.05)
i_max = parameter("i_max", "A", "limit of the current", "bound", 10)

motor = coordinate("motor", "rad", N**2 * J_m, "motor", meaning="angle of the motor, behind the gear")
load = coordinate("load", "rad", J_l, "load", meaning="angle of the load", held=True)
i = current("i", "A", limit=i_max, thing="drive")

spring(motor - load, k).damper(b_k)
viscous(motor, b_m)
viscous(load, b_l)
friction(motor, F_m)
friction(load, F_l)
torque(motor, N * k_t * i, "drive")
