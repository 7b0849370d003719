"""A driver that feeds the motor's speed forward, so as to hide friction: too much of it and the actuator runs away.

m_eff a_1 = ... + k_fed v_1
"""

from hopform.model import Quantity, Term, v1

push = Quantity("k_fed", "k_{fed}", "N s/m", "force fed forward per velocity of the actuator", "real", 0.0)

terms = (Term("feedforward", push.symbol * v1, 0),)
parameters = (push,)
