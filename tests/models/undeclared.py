"""A damper whose b12 is used and never declared."""

import sympy as sp

from derive.model import Term
from derive.quantities import v1, v2

b12 = sp.Symbol("b12", real=True)

terms = (Term("damper", -b12 * (v1 - v2), b12 * (v1 - v2)),)
