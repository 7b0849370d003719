"""A cable over a counterweight that pulls the body up, in stance and in flight."""

from hopform.model import *

x2 = include("hopper").x2
F_cable = parameter("F_cable", "N", "force of the cable on the body", default=0)

force(x2, F_cable, "cable")
