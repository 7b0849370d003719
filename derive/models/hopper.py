"""The hopper of the paper: two masses, one spring, viscous and Coulomb friction; no further term."""

from ..model.equations import Model

HOPPER = Model()
