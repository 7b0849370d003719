"""A spring that hardens: no phase is linear, so there is no transform."""

from hopform.model import *

hopper = include("hopper")
k3 = parameter("k3", "N/m^3", "how the spring hardens", "nonnegative", 0)

spring(hopper.x1 - hopper.x2 + hopper.L0, k3 * (hopper.x1 - hopper.x2) ** 2, "hardening spring")
