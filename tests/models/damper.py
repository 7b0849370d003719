"""A damper between the masses: the cable that is the spring loses something, too.

m_eff a_1 = ... - b_12 (v_1 - v_2),        m_s a_2 = ... + b_12 (v_1 - v_2)

The leg's contact force is then k y + b_12 (v_1 - v_2), which is zero before y is.
"""

from hopform.model import *

hopper = include("hopper")
b12 = parameter("b12", "N s/m", "viscous friction between the masses", "nonnegative", 0)

hopper.leg.damper(b12)
