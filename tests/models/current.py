"""A motor that acts between the masses: the current stands in the hopper's own term and may stand in no other."""

from hopform.model import Term, gamma2, u

terms = (Term("reaction", 0, gamma2 * u),)
