"""A motor whose k_emf is used and never declared."""

import sympy as sp

from hopform.model import *

viscous(include("hopper").x1, sp.Symbol("k_emf", real=True), "back-EMF")
