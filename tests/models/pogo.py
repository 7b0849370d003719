"""A pogo stick: a body on a leg without a mass, of two springs and a damper beside the first."""

from hopform.model import *

m = parameter("m", "kg", "mass of the body", "positive", 30)
k = parameter("k", "N/m", "stiffness of the spring", "positive", 6000)
d = parameter("d", "N s/m", "damper beside it", "nonnegative", 60)
L = parameter("L", "m", "its length without load", "positive", 0.8)
k_2 = parameter("k_2", "N/m", "stiffness of the second spring", "nonnegative", 2000)
L_2 = parameter("L_2", "m", "its length without load", "positive", 0.75)
F = parameter("F", "N", "dry friction of the body in stance", "nonnegative", 10)
g = parameter("g", "m/s^2", "gravity", "nonnegative", 9.81)
loss = parameter("loss", "1", "share of the kinetic energy that a touchdown takes", "fraction", 0.05)

h = coordinate("h", "m", m, "body", directions=("up", "down"))

leg = spring(L - h, k).damper(d)
spring(L_2 - h, k_2, "second spring")
gravity(h, g)
friction(h, F, where="stance")
contact(leg, loss)
