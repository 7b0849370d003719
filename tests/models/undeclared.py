"""A motor whose k_emf is used and never declared."""

import sympy as sp

from hopform.model import Term, v1

k_emf = sp.Symbol("k_emf", real=True)

terms = (Term("back-EMF", -k_emf * v1, 0),)
