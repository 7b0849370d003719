"""A relay whose armature strikes a seat."""

from hopform.model import *

m_a = parameter("m_a", "kg", "mass of the armature", "positive", 0.012)
k_s = parameter("k_s", "N/m", "stiffness of the seat spring", "positive", 900.0)
z_0 = parameter("z_0", "m", "where the seat spring is slack", default=-0.001)
c_a = parameter("c_a", "N s/m", "damping by air", "nonnegative", 0.4)
F_g = parameter("F_g", "N", "friction of the guide", "nonnegative", 0.15)
G = parameter("G", "N/V", "pull per voltage", "positive", 0.5)
U_max = parameter("U_max", "V", "largest voltage", "bound", 24.0)
gap = parameter("gap", "m", "gap", "positive", 0.003)

z = coordinate("z", "m", m_a, "armature", directions=("pulls in", "drops out"))
U = current("U", "V", limit=U_max, thing="coil", meaning="voltage")

spring(z - z_0, k_s, "seat spring")
viscous(z, c_a, "air")
friction(z, F_g, name="guide")
force(z, G * U, "pull")
stop(z, 0, gap, "seat")
