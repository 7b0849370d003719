"""A motor that acts between the masses: the current drives one coordinate and may drive no other."""

from hopform.model import *

hopper = include("hopper")
force(hopper.x2, hopper.gamma2 * hopper.u, "reaction")
