"""Quantities of the energy-based controller, (25)-(27), the apex, and the threshold of the current, (5).

Hop heights count from L_0 + c above the ground under the foot. At take-off y = 0, so with x_1(T) = x_1

    apex = x_1 + max(v_2, 0)^2/(2 g)
    m_s g (h_des + L_0 + c + datum) = m_s v_2^2/2 + m_s g (L_0 + c + x_1(0)) + k x_1(0)^2/2 + AED - k x_1(T)^2/2
    (27)
"""

import sympy as sp

from ..ir import Quantity, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *

AED = Quantity("aed", "E_{delta}", "J", "analytical energy delta of the stance")
APEX = Quantity("apex", "h_{apex}", "m", "hop height of the apex")
H_DES = Quantity("h_des", "h_{des}", "m", "desired apex")
LIFT = scalar("lift", "m", "what (26) counts of the step, printed half its size")
OBJECTIVE = scalar("J", "J", "what the controller minimises")
PRINTED = scalar("J", "J", "what the printed controller minimises")
SPRING = scalar("spring", "1", "0: without the spring coordinate as printed, 1: with it")
STEP = Quantity("step", "h_{datum}", "m", "reference level less the ground under the foot")
THRESHOLD = Quantity("u_threshold", "u^{*}", "A", "threshold of the current")
V_AFTER = Quantity("v_after", "v_{td}", "m/s", "velocity after the impact")
V_UP = scalar("v_up", "m/s", "max(v_2, 0) at take-off")
X1_T = Quantity("x1_T", "x_1(T)", "m", "displacement of the actuator at take-off")
aed, apex, h_des, lift, J, spring, step, u_threshold, v_after, v_up, x1_T = (
    quantity.symbol for quantity in (AED, APEX, H_DES, LIFT, OBJECTIVE, SPRING, STEP, THRESHOLD, V_AFTER, V_UP, X1_T)
)
E_td, E_dist, E_spring = sp.symbols("E_td E_dist E_spring", real=True)


@function(takes=(ROBOT, HEIGHT), returns=V_AFTER)
def touchdown_velocity(model: Model) -> Steps:
    """Velocity of the body after the impact of a drop from a hop height."""
    yield Step(v_after, -sp.sqrt(2 * model.fall * height * (1 - impact_loss)), "drop from rest, after the impact")


@function(takes=(ROBOT, STATE.quantities[0], STATE.quantities[3], V_UP), returns=APEX)
def apex_of_takeoff(model: Model) -> Steps:
    """Hop height of the apex after a take-off."""
    yield Step(apex, x1 - y + v_up**2 / (2 * model.fall), "apex of the ballistic flight")


@function(takes=(ROBOT, STATE), returns=APEX)
def apex_after(model: Model) -> Steps:
    """Hop height of the apex after a take-off in a state; that of a body that falls is behind it."""
    upwards = (v2 + sp.Abs(v2)) * v2 / (4 * model.fall)  # max(v_2, 0)^2/(2 g), by powers of two
    yield Step(apex, x1 - y + upwards, "apex of the ballistic flight")


@function(takes=(ROBOT, STATE, AED, X1_T, STEP), returns=APEX)
def apex_from_energy() -> Steps:
    """Hop height of the apex over the ground at take-off, from the energies at touchdown and the AED.

    (25)-(27) with what they leave out.
    """
    yield Step(E_td, m_s * v2**2 / 2, "(25), after the impact")
    yield Step(E_dist, -m_s * g * step, "(26) without the 1/2, signed")
    yield Step(
        apex,
        (E_td + E_dist + k * x1**2 / 2 + aed - k * x1_T**2 / 2) / (m_s * g) + x1,
        "(27) with the spring coordinate",
    )


@function(takes=(ROBOT, STATE, AED, H_DES, STEP), returns=PRINTED)
def printed_objective() -> Steps:
    """The objective of the controller as the paper prints it."""
    yield Step(E_td, m_s * v2**2 / 2, "(25)")
    yield Step(E_dist, m_s * g * sp.Abs(step) / 2, "(26) as printed")
    yield Step(J, sp.Abs(aed - (m_s * g * h_des - E_td - E_dist)), "(27) as printed")


@function(takes=(ROBOT, STATE, AED, X1_T, H_DES, LIFT, SPRING), returns=OBJECTIVE)
def objective() -> Steps:
    """The same objective with another share of the step, and with the spring coordinate.

    J of (27), where the ground lies `lift` higher than it counts from, and with a weight of what (27) leaves out:
    lift = |step|/2, spring 0 is printed_objective; lift = -step, spring 1 vanishes where the apex is h_des.
    """
    yield Step(E_td, m_s * v2**2 / 2, "(25), after the impact")
    yield Step(E_dist, m_s * g * lift, "(26)")
    yield Step(E_spring, k * x1**2 / 2 - k * x1_T**2 / 2 + m_s * g * x1, "what (27) leaves out")
    yield Step(J, sp.Abs(aed - (m_s * g * h_des - E_td - E_dist - spring * E_spring)), "(27)")


@function(takes=(ROBOT,), returns=THRESHOLD)
def threshold_current() -> Steps:
    """Current at which the unloaded actuator starts to move: its friction at rest."""
    yield Step(u_threshold, m_eff * (f1 + f1_excess) / sp.Abs(gamma2), "(5) as a magnitude")
