"""A second spring in the leg, beside the first: the leg's contact force is the sum of both, and zero where y is not."""

from hopform.model import *

hopper = include("hopper")
k_2 = parameter("k_2", "N/m", "stiffness of the second spring", "nonnegative", 0)
L_2 = parameter("L_2", "m", "length at which it is slack", "positive", 0.4)

spring(hopper.x1 - hopper.x2 + L_2, k_2, "second spring")
