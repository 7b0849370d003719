"""A lever: a pedal on one arm and, over a spring on the other, a second lever that turns against it."""

from hopform.model import *

J = parameter("J", "kg m^2", "inertia of the lever", "positive", 0.02)
m = parameter("m", "kg", "mass of the pedal", "positive", 0.5)
I = parameter("I", "kg m^2", "inertia of the second lever", "positive", 0.01)
a = parameter("a", "m/rad", "arm of the spring", "positive", 0.1)
p = parameter("p", "m/rad", "arm of the pedal", "positive", 0.25)
s = parameter("s", "m/rad", "arm of the second lever", "positive", 0.05)
k = parameter("k", "N/m", "stiffness of the spring", "positive", 4000)
d = parameter("d", "N s/m", "damping of the pedal", "nonnegative", 4)
b = parameter("b", "N m s/rad", "viscous friction of the second lever", "nonnegative", 0.01)
F = parameter("F", "N", "dry friction at the pedal", "nonnegative", 2)
F_2 = parameter("F_2", "N m", "Coulomb friction of the second lever", "nonnegative", 0.05)

alpha = coordinate("alpha", "rad", J + m * p**2, "lever")
beta = coordinate("beta", "rad", I, "second lever")
P = current("P", "N", thing="foot", meaning="push")

spring(a * alpha + s * beta, k)
viscous(alpha, d * p**2)
viscous(beta, b)
friction(alpha, F * p)
friction(beta, forward=F_2, backward=2 * F_2)
torque(alpha, p * P, "push")
stop(alpha, -1, 1)
