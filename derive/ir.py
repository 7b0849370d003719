"""What a derivation hands to a renderer: quantities, records of them, and functions of named steps.

The intermediate form knows sympy expressions and nothing about any target language.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import sympy as sp


@dataclass(frozen=True)
class Quantity:
    """A real number with a name, the paper's glyph, a unit, a domain and a meaning.

    `domain` is one of "real", "positive", "nonnegative", "fraction" (0 <= x < 1),
    "lower" and "upper" (a bound, which may be infinite).
    """

    name: str
    glyph: str
    unit: str
    meaning: str
    domain: str = "real"
    default: float | None = None

    @property
    def symbol(self) -> sp.Symbol:
        return sp.Symbol(self.name, real=True)

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        return (self.symbol,)

    @property
    def quantities(self) -> "tuple[Quantity, ...]":
        return (self,)


@dataclass(frozen=True)
class Record:
    """An ordered group of quantities: a named tuple in Python, a struct in C."""

    name: str
    meaning: str
    quantities: tuple[Quantity, ...]

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        return tuple(quantity.symbol for quantity in self.quantities)


@dataclass(frozen=True)
class Step:
    """One line of generated code, `symbol = value`, and the equation that it comes from."""

    symbol: sp.Symbol
    value: sp.Expr
    source: str


def unfold(expression: sp.Expr, steps: tuple[Step, ...]) -> sp.Expr:
    """Replace every named step by its definition, last name first."""
    for step in reversed(steps):
        expression = expression.subs(step.symbol, step.value)
    return expression


@dataclass(frozen=True)
class Function:
    """Steps that turn the quantities of `takes` into those of `returns`."""

    name: str
    meaning: str
    takes: tuple[Record | Quantity, ...]
    steps: tuple[Step, ...]
    returns: Record | Quantity

    def __post_init__(self) -> None:
        known = {symbol for argument in self.takes for symbol in argument.symbols}
        for step in self.steps:
            if unknown := step.value.free_symbols - known:
                raise ValueError(f"{self.name}: {step.symbol} uses {unknown} before they are defined")
            known.add(step.symbol)
        if missing := set(self.returns.symbols) - known:
            raise ValueError(f"{self.name}: returns {missing}, which no step defines")

    @cached_property
    def used(self) -> frozenset[sp.Symbol]:
        """The symbols that some step or the result reads."""
        read: set[sp.Symbol] = set(self.returns.symbols)
        for step in self.steps:
            read |= step.value.free_symbols
        return frozenset(read)

    def arguments(self) -> Iterator[tuple[Record | Quantity, tuple[sp.Symbol, ...]]]:
        """Each argument with those of its symbols that the function reads."""
        for argument in self.takes:
            yield argument, tuple(symbol for symbol in argument.symbols if symbol in self.used)


@dataclass(frozen=True)
class Program:
    """Everything that gets rendered."""

    meaning: str
    records: tuple[Record, ...]
    functions: tuple[Function, ...]

    def function(self, name: str) -> Function:
        return next(function for function in self.functions if function.name == name)

    def record(self, name: str) -> Record:
        return next(record for record in self.records if record.name == name)
