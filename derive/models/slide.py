"""A slide with a motor, a spring to the ground, friction that is higher at rest, stops and a load.

One mass m moves by x along a line:

    m x'' = k_f i - k (x - x_0) - b x' + load - F sign(x')

At rest friction takes up to F + F_s. k = 0 leaves the slide free, as an axis or an actuator in the air. A body on its
spring, whose other end is held, is a slide without a current.
"""

from hopform.model import *

m = parameter("m", "kg", "mass of what moves", "positive", 0.5)
k = parameter("k", "N/m", "stiffness of the spring", "nonnegative", 0)
x_0 = parameter("x_0", "m", "place at which that spring is slack", default=0)
b = parameter("b", "N s/m", "viscous friction", "nonnegative", 2)
F = parameter("F", "N", "Coulomb friction", "nonnegative", 0.5)
F_s = parameter("F_s", "N", "friction at rest, less F", "nonnegative", 0)
k_f = parameter("k_f", "N/A", "force per current", default=2)
load = parameter("load", "N", "constant load", default=0)
x_min = parameter("x_min", "m", "lower stop", "lower", -float("inf"))
x_max = parameter("x_max", "m", "upper stop", "upper", float("inf"))
i_max = parameter("i_max", "A", "limit of the current", "bound", float("inf"))

x = coordinate("x", "m", m, "slide")
i = current("i", "A", limit=i_max)

spring(x - x_0, k, "spring")
viscous(x, b)
force(x, k_f * i, "motor")
force(x, load, "load")
friction(x, F, at_rest=F + F_s)
stop(x, x_min, x_max)
