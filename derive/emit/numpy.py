"""How a function of the intermediate form is spelled in NumPy."""

import math
from collections.abc import Iterable, Iterator

import sympy as sp

from ..model.kinds import Word
from .expressions import Expressions, aligned, argument_name, chunks
from .ir import Domain, Function, Program, Quantity, Record


class NumPy:
    """Spelling in Python: scalars and broadcastable arrays alike."""

    spelled = Expressions()

    def signature(self, function: Function) -> str:
        arguments = ", ".join(
            f"{argument_name(a)}: {a.in_python if isinstance(a, Record) else 'Real'}" for a in function.takes
        )
        returns = function.returns.in_python if isinstance(function.returns, Record) else "Real"
        return f"def {function.name}({arguments}) -> {returns}:"

    def body(self, function: Function) -> Iterator[str]:
        for argument, symbols in function.arguments():
            if isinstance(argument, Record):
                name = argument_name(argument)
                for chunk in chunks(symbols, 100, len(name) + 5):
                    targets = ", ".join(map(str, chunk))
                    yield f"{targets} = {', '.join(f'{name}.{symbol}' for symbol in chunk)}"
        yield from aligned((f"{s.symbol} = {self.spelled(s.value)}", f"# {s.source}") for s in function.steps)
        values = ", ".join(map(str, function.returns.symbols))
        yield (
            f"return {function.returns.in_python}({values})"
            if isinstance(function.returns, Record)
            else f"return {values}"
        )

    def docstring(self, function: Function) -> Iterator[str]:
        yield f'"""{function.meaning}'
        yield ""
        for argument in function.takes:
            if isinstance(argument, Quantity):
                yield f"{argument.name} [{argument.unit}] {argument.meaning}."
        if isinstance(function.returns, Quantity):
            yield f"Returns {function.returns.name} [{function.returns.unit}], {function.returns.meaning}."
        yield '"""'

    def number(self, value: float) -> str:
        """A literal, of an infinity too."""
        return f'float("{value}")' if math.isinf(value) else repr(value)

    def interval(self, domain: Domain) -> str:
        """The arguments of a `Domain`."""
        ends = self.number(domain.low), self.number(domain.high)
        return f'"{domain.allowed}", {", ".join(ends)}, {domain.with_low}, {domain.with_high}'

    def field(self, quantity: Quantity) -> str:
        """The arguments of a `Field`."""
        default = "None" if quantity.default is None else self.number(quantity.default)
        texts = (quantity.name, quantity.glyph, quantity.unit, quantity.domain, quantity.meaning)
        return ", ".join(f'"{text}"'.replace("\\", "\\\\") for text in texts) + f", {default}"

    def attribute(self, quantity: Quantity) -> str:
        """A field of a dataclass, with its default if it has one."""
        default = "" if quantity.default is None else f" = {self.number(quantity.default)}"
        return f"{quantity.name}: float{default}"

    def words(self, words: Iterable[Word]) -> str:
        """A dictionary of words by their numbers, a line each with the meaning."""
        return "\n".join(("{", *(f'    {word.number}: "{word.text}",  # {word.meaning}' for word in words), "}"))

    def names(self, symbols: Iterable[sp.Symbol]) -> str:
        """A tuple of names as text."""
        return "(" + "".join(f'"{symbol}", ' for symbol in symbols).rstrip() + ")"

    def of(self, record: str, value: sp.Expr) -> str:
        """An expression in the fields of a record of that name; C writes it alike."""
        return self.spelled(value.subs({symbol: sp.Symbol(f"{record}.{symbol}") for symbol in value.free_symbols}))

    def record_names(self, program: Program) -> list[str]:
        """The records that the formulas name, sorted, with the type of a number."""
        used = {r.in_python for f in program.functions for r in (*f.takes, f.returns) if isinstance(r, Record)}
        return sorted(used | {"Real"})

    def calls(self, functions: Iterable[Function]) -> str:
        """The elementary functions that the formulas call, for their import line."""
        text = " ".join(self.spelled(step.value) for function in functions for step in function.steps)
        return ", ".join(name for name in ("fabs", "sqrt") if f"{name}(" in text)
