"""A motor that acts between the masses: the current stands in the hopper's own term and may stand in no other."""

from derive.model import Term
from derive.quantities import gamma2, u

terms = (Term("reaction", 0, gamma2 * u),)
