"""The hopper on a cable over a counterweight, which pulls the body up in stance and in flight.

    m_s x_2'' = ... + F_cable

In flight the body falls with g - F_cable/m_s.
"""

from hopform.model import *

hopper = include("hopper")
F_cable = parameter("F_cable", "N", "force of the cable on the body", default=10)

force(hopper.x2, F_cable, "cable")
