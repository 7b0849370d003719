"""The hopper with a second spring in its leg, of another stiffness and length.

    m_eff x_1'' = ... - k_2 (x_1 - x_2 + L_2)        m_s x_2'' = ... + k_2 (x_1 - x_2 + L_2)

The contact force is the sum of both: N = (k + k_2) y, where y counts from the length at which they balance.
"""

from hopform.model import *

hopper = include("hopper")
k_2 = parameter("k_2", "N/m", "stiffness of the second spring", "nonnegative", 300)
L_2 = parameter("L_2", "m", "length at which it is slack", "positive", 0.4)

spring(hopper.x1 - hopper.x2 + L_2, k_2, "second spring")
