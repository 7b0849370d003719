"""The hopper with a damper in its leg, beside the spring: the cable that is the spring loses something, too.

    m_eff x_1'' = ... - b_12 (x_1' - x_2')        m_s x_2'' = ... + b_12 (x_1' - x_2')

It is part of the contact force, N = k y + b_12 y', so that the leg takes off before its spring is at its length. In
flight the foot has no mass: the leg relaxes by y' = -k y/b_12.
"""

from hopform.model import *

hopper = include("hopper")
b12 = parameter("b12", "N s/m", "viscous friction between the masses", "nonnegative", 5)

hopper.leg.damper(b12)
