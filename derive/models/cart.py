"""A cart on rails between stops, driven by a voltage through a motor with back-EMF and a gear.

A motor of the constant k_m and the resistance R, with the inertia J_m, drives a wheel of the radius r through a gear
of the ratio N. With K = k_m N/r, and the inductance left out, the current is (U - K x')/R:

    (m + J_m N^2/r^2) x'' = K/R U - (b + K^2/R) x' - F sign(x')

It meets a stop inelastically at x = 0 and at x = stroke.
"""

from hopform.model import *

m = parameter("m", "kg", "mass of the cart", "positive", 0.5)
J_m = parameter("J_m", "kg m^2", "inertia of the motor", "nonnegative", 4e-7)
N = parameter("N", "1", "ratio of the gear", "positive", 3.7)
r = parameter("r", "m", "radius of the wheel", "positive", 0.0064)
k_m = parameter("k_m", "N m/A", "constant of the motor", "positive", 0.0077)
R = parameter("R", "ohm", "resistance of the motor", "positive", 2.6)
b = parameter("b", "N s/m", "viscous friction", "nonnegative", 1)
F = parameter("F", "N", "Coulomb friction", "nonnegative", 0.4)
stroke = parameter("stroke", "m", "length of the rails", "positive", 0.8)
U_max = parameter("U_max", "V", "limit of the voltage", "bound", 10)

x = coordinate("x", "m", m + J_m * N**2 / r**2, "cart", directions=("right", "left"))
U = current("U", "V", limit=U_max, meaning="voltage")

K = k_m * N / r
force(x, K / R * U, "motor")
viscous(x, b)
viscous(x, K**2 / R, "back-EMF")
friction(x, F)
stop(x, 0, stroke)
