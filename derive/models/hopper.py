"""A series-elastic hopper with viscous and Coulomb friction.

The paper's: a motor with a gear moves the actuator, m_eff, along x_1. Through a cable that is a spring it carries the
body, m_s, whose height is x_2:

    m_eff x_1'' = k (x_2 - x_1 - L_0) - b_1 x_1' - gamma_2 u - m_eff f_1 sign(x_1')                   (3)
    m_s   x_2'' = k (x_1 - x_2 + L_0 + c) - b_2 x_2' - m_s g - m_s f_2 sign(x_2')                     (4)

In flight the body falls freely, and the actuator moves on alone.
"""

from hopform.model import *

m_eff = parameter("m_eff", "kg", "effective mass of the actuator", "positive", glyph="m_{eff}")
m_s = parameter("m_s", "kg", "sprung mass of the body", "positive")
k = parameter("k", "N/m", "stiffness of the spring", "positive")
L0 = parameter("L0", "m", "spring offset, the leg's length at rest")
c = parameter("c", "m", "extra offset in (4)", default=0)
b1 = parameter("b1", "N s/m", "viscous friction of the actuator", "nonnegative", 0)
b2 = parameter("b2", "N s/m", "viscous friction of the body", "nonnegative", 0)
f1 = parameter("f1", "m/s^2", "Coulomb friction of the actuator, per unit mass", "nonnegative", 0)
f2 = parameter("f2", "m/s^2", "Coulomb friction of the body, per unit mass", "nonnegative", 0)
gamma2 = parameter("gamma2", "N/A", "force per current; the actuator feels -gamma2 u", default=0)
g = parameter("g", "m/s^2", "gravity", "nonnegative", 9.81)
x1_min = parameter("x1_min", "m", "lower end of the actuator's stroke", "lower", -float("inf"), glyph="x_{1,min}")
x1_max = parameter("x1_max", "m", "upper end of the actuator's stroke", "upper", float("inf"), glyph="x_{1,max}")
u_max = parameter("u_max", "A", "current limit", "bound", float("inf"), glyph="u_{max}")
impact_loss = parameter(
    "impact_loss", "1", "fraction of the body's kinetic energy lost at touchdown", "fraction", 0, glyph=r"\eta"
)
f1_excess = parameter(
    "f1_excess", "m/s^2", "friction of the actuator at rest, less f1", "nonnegative", 0, glyph="f_{1,e}"
)
f2_excess = parameter("f2_excess", "m/s^2", "friction of the body at rest, less f2", "nonnegative", 0, glyph="f_{2,e}")

x1 = coordinate("x1", "m", m_eff, "actuator", directions=("extends", "retracts"))
x2 = coordinate("x2", "m", m_s, "body", directions=("slips up", "slips down"))
u = current("u", "A", limit=u_max)

leg = spring(x1 - x2 + L0 + c, k)
force(x1, k * c, "offset")  # (3) has no c
gravity(x2, g)
viscous(x1, b1)
viscous(x2, b2, where="stance")
force(x1, -gamma2 * u, "motor")
friction(x1, m_eff * f1, at_rest=m_eff * (f1 + f1_excess))
friction(x2, m_s * f2, at_rest=m_s * (f2 + f2_excess), where="stance")
stop(x1, x1_min, x1_max)
contact(leg, impact_loss)
