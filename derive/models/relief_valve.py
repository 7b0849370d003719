"""A relief valve: a poppet that a preloaded spring presses on its seat, and a pressure lifts.

The lift x is zero on the seat and ends at x_max; the pressure p acts on the area A of the seat:

    m x'' = A p - k (x + x_0) - b x' - F sign(x')

It opens at A p > k x_0 + F.
"""

from hopform.model import *

m = parameter("m", "kg", "mass of the poppet, a third of its spring's with it", "positive", 0.05)
k = parameter("k", "N/m", "stiffness of the spring", "positive", 8000)
x_0 = parameter("x_0", "m", "preload: compression of the spring on the seat", "nonnegative", 0.01)
b = parameter("b", "N s/m", "viscous friction", "nonnegative", 5)
F = parameter("F", "N", "Coulomb friction of the seal", "nonnegative", 2)
A = parameter("A", "m^2", "area on which the pressure acts", "positive", 1e-4)
x_max = parameter("x_max", "m", "largest lift", "upper", 0.005)
p_max = parameter("p_max", "Pa", "limit of the pressure", "bound", float("inf"))

x = coordinate("x", "m", m, "poppet", directions=("opens", "closes"))
p = current("p", "Pa", limit=p_max, thing="pressure", meaning="pressure over that of the outlet")

spring(x + x_0, k)
viscous(x, b)
force(x, A * p, "pressure")
friction(x, F)
stop(x, 0, x_max)
