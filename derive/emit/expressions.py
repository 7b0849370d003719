"""Expressions and steps in the punctuation that Python and C share, and how their lines are laid out.

The printer is our own so that the text depends on no version of sympy: terms and factors are ordered by the names in
them.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from fractions import Fraction

import sympy as sp

from ..ir import Function, Quantity, Record

Line = tuple[str, str]
LARGEST_PART = 2**24
"""Above and below the line of a fraction, so that single precision holds both to the last digit, and the quotient is
rounded once; with larger ones it is written as one number.
"""


@dataclass(frozen=True)
class Expressions:
    """Expressions in the punctuation that Python and C share: + - * / and calls of functions by their names; `divide`
    takes a number and what it is divided by, where / would raise an error for 0. infinity: the end of a range that has
    none.
    """

    root: str = "sqrt"
    absolute: str = "fabs"
    divide: str = ""
    infinity: str = 'float("inf")'

    def __call__(self, value: sp.Expr) -> str:
        """A sum: positive terms first, then numbers, then the shorter names."""
        terms = sorted(map(self._term, sp.Add.make_args(sp.sympify(value))))
        text = "".join(f" {'-' if negative else '+'} {product}" for negative, _, product in terms)
        return f"-{text.removeprefix(' - ')}" if text.startswith(" - ") else text.removeprefix(" + ")

    def _term(self, term: sp.Expr) -> tuple[bool, int, str]:
        """Whether a term is subtracted, how many names it has, and what is added or subtracted."""
        negative = bool(term.could_extract_minus_sign())
        body = -term if negative else term
        return negative, len(body.free_symbols), self._product(body)

    def _product(self, value: sp.Expr) -> str:
        above: list[str] = []
        below: list[str] = []
        number = root = sp.S.One
        for factor in sp.Mul.make_args(value):
            base, exponent = factor.as_base_exp()
            if factor.is_Rational:
                number *= factor
            elif exponent == sp.S.Half:
                root *= base
            elif exponent.is_Integer:
                (above if exponent > 0 else below).extend([self._factor(base)] * abs(int(exponent)))
            else:
                raise TypeError(f"no spelling for {factor}")
        if root != 1:
            above.append(f"{self.root}({self(root)})")
        above.sort(key=_factor_order)
        below.sort(key=_factor_order)
        if max(number.p, number.q) > LARGEST_PART or (number != 1 and number.q in (1, 2, 4, 8)):
            above.insert(0, repr(float(Fraction(int(number.p), int(number.q)))))
        elif number.q != 1:
            if number.p != 1:
                above.insert(0, repr(float(number.p)))
            below.insert(0, repr(float(number.q)))
        if len(below) > 1 and not below[0][0].isdigit() and len(above) >= len(below):
            return "*".join(self._quotients(above, below))
        top = "*".join(above) or "1.0"
        if not below:
            return top
        return self._quotient(top, below[0] if len(below) == 1 else f"({'*'.join(below)})")

    def _quotients(self, above: list[str], below: list[str]) -> Iterator[str]:
        """A product of quotients: it stays in the range of numbers where a product of small masses does not."""
        numbers = above[:1] if above[0][0].isdigit() else []
        names = above[len(numbers) :]
        yield from numbers
        for n, bottom in enumerate(below):
            top = "*".join(names[n : n + 1] if n + 1 < len(below) else names[n:]) or "1.0"
            yield f"({self._quotient(top, bottom)})"

    def _quotient(self, top: str, bottom: str) -> str:
        return f"{self.divide}({top}, {bottom})" if self.divide and not bottom[0].isdigit() else f"{top}/{bottom}"

    def _factor(self, base: sp.Expr) -> str:
        if base.is_Symbol:
            return str(base.name)
        if base is sp.oo:
            return self.infinity
        if base.is_Rational:
            return repr(float(base))
        if isinstance(base, sp.Abs):
            return f"{self.absolute}({self(base.args[0])})"
        return f"({self(base)})"


def _factor_order(text: str) -> tuple[bool, str]:
    return text.startswith("("), text


def aligned(lines: Iterable[Line]) -> Iterator[str]:
    pairs = list(lines)
    width = max((len(code) for code, _ in pairs), default=0)
    yield from (f"{code.ljust(width)}  {comment}".rstrip() for code, comment in pairs)


def argument_name(argument: Record | Quantity) -> str:
    """The name of an argument: a record's name in lower case with underscores."""
    return snake(argument.name) if isinstance(argument, Record) else argument.name


def snake(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


def unpacked(function: Function, extra: int) -> Iterator[tuple[str, tuple[tuple[sp.Symbol, Quantity], ...]]]:
    """What a function reads of its records, by the record's name: each symbol with the quantity that it is, in groups that
    a line of 100 characters holds: each twice, with the name and `extra` characters.
    """
    for argument, symbols in function.arguments():
        name, longest = argument_name(argument), max((len(symbol.name) for symbol in symbols), default=0)
        count = max(1, 100 // (len(name) + extra + 2 * longest))
        if isinstance(argument, Record):
            members = {quantity.symbol: quantity for quantity in argument.quantities}
            pairs = tuple((symbol, members[symbol]) for symbol in symbols)
            yield from ((name, pairs[n : n + count]) for n in range(0, len(pairs), count))
