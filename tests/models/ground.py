"""A spring from the actuator to the ground: moved as a whole the hopper feels it, so (11) loses its factor s^2."""

from hopform.model import *

x1 = include("hopper").x1
k1 = parameter("k1", "N/m", "stiffness of a spring to the ground", "nonnegative", 0)

spring(x1, k1, "ground spring")
