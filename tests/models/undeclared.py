"""A motor whose k_emf is used and never declared."""

import sympy as sp

from derive.model import Term
from derive.quantities import v1

k_emf = sp.Symbol("k_emf", real=True)

terms = (Term("back-EMF", -k_emf * v1, 0),)
