"""A monoped with names of its own.

M z'' = N - M gr - D z',    m s'' = -N - d s' + kt i - F sign(s')
"""

from hopform.model import *

M = parameter("M", "kg", "mass of the body", "positive", 3.0)
m = parameter("m", "kg", "inertia of the drive", "positive", 25.0)
kl = parameter("kl", "N/m", "stiffness of the leg", "positive", 1200.0)
ell = parameter("ell", "m", "length of the leg", "positive", 0.4)
gr = parameter("gr", "m/s^2", "gravity", "nonnegative", 9.81)
d = parameter("d", "N s/m", "friction of the drive", "nonnegative", 150.0)
D = parameter("D", "N s/m", "friction of the body", "nonnegative", 5.0)
F = parameter("F", "N", "dry friction of the drive", "nonnegative", 20.0)
kt = parameter("kt", "N/A", "force per current", default=65.0)
imax = parameter("imax", "A", "limit of the current", "bound", 10.0)

s = coordinate("s", "m", m, "drive", directions=("extends", "retracts"))
z = coordinate("z", "m", M, "body", directions=("up", "down"))
i = current("i", "A", limit=imax)

gravity(z, gr)
contact(spring(s - z + ell, kl))
viscous(s, d)
viscous(z, D, where="stance")
friction(s, F)
force(s, kt * i, "motor")
