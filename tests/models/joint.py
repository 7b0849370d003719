"""A joint: one mass, or inertia, on a spring to the ground, with friction, stops and a load; nothing takes off.

m q'' = -k (q - q_0) - b q' + gamma u + load - F_plus or + F_minus, by sign(q')

is (3) with the foot and the body bolted to the ground: m_eff = m, b1 = b, gamma2 = -gamma, f1 = F_plus/m,
f1_minus = F_minus/m, L0 = -q_0, c = 0, x_1 = q, y = q - q_0. What the body has does not matter. k = 0 is allowed.
"""

from hopform.model import Quantity, Term

load = Quantity("load", "F_l", "N", "constant load", default=0.0)

fixed = ("foot", "body")
friction_by_sign = ("actuator",)
terms = (Term("load", load.symbol, 0),)
parameters = (load,)
