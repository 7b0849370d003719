"""A relief valve: a poppet on a preloaded spring, lifted by a pressure, between its seat and a stop.

The pressure p acts on the area A; the spring of the stiffness k is shortened by x_0 while the valve is closed, x = 0:

    m x'' = A p - k (x + x_0) - b x' - F sign(x')

It opens where A p exceeds k x_0, and meets the seat, x = 0, and the stop, x = lift, inelastically.
"""

from hopform.model import *

m = parameter("m", "kg", "mass of the poppet", "positive", 0.1)
A = parameter("A", "m^2", "area on which the pressure acts", "positive", 5e-4)
k = parameter("k", "N/m", "stiffness of the spring", "positive", 2e4)
x_0 = parameter("x_0", "m", "how far the spring is shortened while the valve is closed", "nonnegative", 0.02)
b = parameter("b", "N s/m", "viscous friction", "nonnegative", 10)
F = parameter("F", "N", "Coulomb friction of the guide", "nonnegative", 2)
lift = parameter("lift", "m", "how far it opens", "positive", 0.005)
p_max = parameter("p_max", "Pa", "largest pressure", "bound", 2e6)

x = coordinate("x", "m", m, "poppet", directions=("opens", "closes"))
p = current("p", "Pa", limit=p_max, thing="pressure", meaning="pressure over that behind the valve")

spring(x + x_0, k)
force(x, A * p, "pressure")
viscous(x, b)
friction(x, F)
stop(x, 0, lift)
