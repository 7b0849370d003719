"""A cable that holds the body up, or down, while the hopper stands; it is let go at take-off."""

from hopform.model import *

x2 = include("hopper").x2
F_cable = parameter("F_cable", "N", "force of the cable on the body", default=0)

force(x2, F_cable, "cable", where="stance")
