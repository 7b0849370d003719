"""A driver that feeds the motor's speed forward, so as to hide friction: too much of it and the actuator runs away.

m_eff a_1 = ... + k_fed v_1
"""

from hopform.model import *

x1 = include("hopper").x1
k_fed = parameter("k_fed", "N s/m", "force fed forward per velocity of the actuator", default=0)

viscous(x1, -k_fed, "feedforward")
