"""A weight on a rope that a drum winds up."""

from hopform.model import *

J = parameter("J", "kg m^2", "inertia of the drum", "positive", 0.02)
m = parameter("m", "kg", "mass of the weight", "positive", 5)
r = parameter("r", "m/rad", "radius of the drum", "positive", 0.05)
k = parameter("k", "N/m", "stiffness of the rope", "positive", 8000)
d = parameter("d", "N s/m", "damping of the rope", "nonnegative", 20)
x_0 = parameter("x_0", "m", "height of the weight at a slack rope", default=0)
b = parameter("b", "N m s/rad", "viscous friction of the drum", "nonnegative", 0.02)
F = parameter("F", "N m", "Coulomb friction of the drum", "nonnegative", 0.3)
g = parameter("g", "m/s^2", "gravity", "nonnegative", 9.81)
k_t = parameter("k_t", "N m/A", "torque per current", default=0.4)
end = parameter("end", "rad", "upper end of the drum's turn", "upper", 20)

phi = coordinate("phi", "rad", J, "drum", directions=("winds", "unwinds"))
x = coordinate("x", "m", m, "weight", directions=("up", "down"))
i = current("i", "A")

spring(r * phi - x + x_0, k, "rope")
spring(x - r * phi, 0.25 * k, "second rope")
viscous(r * phi - x, d, "rope's damping")
gravity(x, g)
viscous(phi, b)
friction(phi, F)
torque(phi, k_t * i, "motor")
stop(phi, -2, end)
