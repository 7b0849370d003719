"""The hopper with a voltage source in place of its current driver: the motor's back-EMF brakes the actuator.

Behind a resistance R, at the voltage U, a motor of the constant k_t carries the current (U - k_t v_1)/R and pulls with
k_t times that. With the current at standstill, u = U/R, as the input:

    m_eff a_1 = ... - gamma_2 u - k_emf v_1,        k_emf = k_t^2/R,        |k_t| = |gamma_2|

The force acts on the actuator alone, in stance and in flight, where the law of the return sets the same u.
"""

from hopform.model import *

hopper = include("hopper")
k_emf = parameter("k_emf", "N s/m", "damping by the back-EMF, k_t^2/R", "nonnegative", 0)

viscous(hopper.x1, k_emf, "back-EMF")
