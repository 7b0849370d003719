"""A cart on a rail between two stops, driven by a motor through a pinion.

The voltage U drives a motor of the constant k_m and the resistance R, whose back-EMF brakes; its rotor J turns with the
pinion of radius r:

    (m + J/r^2) x'' = k_m/(R r) U - (b + k_m^2/(R r^2)) x' - F sign(x')
"""

from hopform.model import *

m = parameter("m", "kg", "mass of the cart", "positive", 0.5)
J = parameter("J", "kg m^2", "inertia of rotor and pinion", "nonnegative", 1e-5)
r = parameter("r", "m", "radius of the pinion", "positive", 0.01)
k_m = parameter("k_m", "N m/A", "motor constant", "positive", 0.05)
R = parameter("R", "ohm", "resistance of the motor", "positive", 2)
b = parameter("b", "N s/m", "viscous friction of the rail", "nonnegative", 0.5)
F = parameter("F", "N", "Coulomb friction of the rail", "nonnegative", 1)
x_min = parameter("x_min", "m", "left stop", "lower", -0.4)
x_max = parameter("x_max", "m", "right stop", "upper", 0.4)
U_max = parameter("U_max", "V", "limit of the voltage", "bound", 24)

x = coordinate("x", "m", m + J / r**2, "cart", directions=("right", "left"))
U = current("U", "V", limit=U_max, meaning="voltage")

viscous(x, b)
viscous(x, k_m**2 / (R * r**2), "back-EMF")
force(x, k_m / (R * r) * U, "motor")
friction(x, F)
stop(x, x_min, x_max)
