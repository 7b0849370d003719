"""How a function of the intermediate form is spelled in NumPy, for scalars and broadcastable arrays alike."""

import json
import math
from collections.abc import Iterable, Iterator, Mapping

import sympy as sp

from ..ir import Function, Program, Quantity, Record
from ..model.kinds import Word
from ..model.names import in_python
from .expressions import Expressions, aligned, argument_name, unpacked
from .texts import docstring as docstring_of
from .texts import line, string

SPELLED = Expressions()


def signature(function: Function) -> str:
    takes = ", ".join(f"{argument_name(a)}: {a.in_python if isinstance(a, Record) else 'Real'}" for a in function.takes)
    returns = function.returns.in_python if isinstance(function.returns, Record) else "Real"
    return f"def {function.name}({takes}) -> {returns}:"


def body(function: Function) -> Iterator[str]:
    for name, members in unpacked(function, 5):
        targets = ", ".join(str(symbol) for symbol, _ in members)
        yield f"{targets} = {', '.join(f'{name}.{quantity.name}' for _, quantity in members)}"
    yield from aligned((f"{s.symbol} = {SPELLED(s.value)}", f"# {line(s.source)}") for s in function.steps)
    values = ", ".join(map(str, function.returns.symbols))
    result = f"{function.returns.in_python}({values})" if isinstance(function.returns, Record) else values
    yield f"return {result}"


def docstring(function: Function) -> Iterator[str]:
    yield f'"""{docstring_of(function.meaning)}'
    yield ""
    for argument in function.takes:
        if isinstance(argument, Quantity):
            yield docstring_of(f"{argument.name} [{argument.unit}] {argument.meaning}.")
    if isinstance(function.returns, Quantity):
        returns = f"{function.returns.name} [{function.returns.unit}], {function.returns.meaning}"
        yield docstring_of(f"Returns {returns}.")
    yield '"""'


def literal(value: object) -> str:
    """A text, a number, an infinity too, or None."""
    if isinstance(value, str):
        return string(value)
    return f'float("{value}")' if value in (math.inf, -math.inf) else repr(value)


def arguments(*values: object) -> str:
    return ", ".join(map(literal, values))


def field(q: Quantity) -> str:
    """The arguments of a `Field`."""
    return arguments(q.name, q.glyph, q.unit, q.domain, q.meaning, q.default)


def attribute(quantity: Quantity) -> str:
    """A field of a dataclass, with its default if it has one; of another name it knows whose it is."""
    default = "" if quantity.default is None else f" = {literal(quantity.default)}"
    name = in_python(quantity.name)
    if name != quantity.name:
        fixed = "" if quantity.default is None else f"default={literal(quantity.default)}, "
        default = f" = field({fixed}metadata={mapping({'parameter': quantity.name})})"
    return f"{name}: float{default}"


def taken_from_dataclasses(record: Record) -> str:
    """What the fields of a dataclass need of `dataclasses`."""
    return "dataclass, field" if any(in_python(each.name) != each.name for each in record.quantities) else "dataclass"


OVER_TIME = ("Energy", "Ledger", "FlightLedger")
"""Records that people read over time: generic, so that type checkers tell floats from arrays."""


def bases(record: Record) -> str:
    """The bases of a record's class."""
    return "NamedTuple, Generic[Value]" if record.in_python in OVER_TIME else "NamedTuple"


def entry(record: Record) -> str:
    """The type of its entries."""
    return "Value" if record.in_python in OVER_TIME else "Real"


def words(kind: Iterable[Word]) -> str:
    """A dictionary of words by their numbers, a line each with the meaning."""
    return "\n".join(("{", *(f'    {word.number}: "{word.text}",  # {line(word.meaning)}' for word in kind), "}"))


def mapping(table: Mapping[str, str]) -> str:
    """A dictionary of texts, on one line."""
    return json.dumps(table, ensure_ascii=False)


def names(symbols: Iterable[sp.Symbol]) -> str:
    """A tuple of names as text."""
    return "(" + "".join(f'"{symbol}", ' for symbol in symbols).rstrip() + ")"


def in_fields(record: str, value: sp.Expr) -> str:
    """An expression in the fields of a record of that name; C writes it alike."""
    return SPELLED(value.subs({symbol: sp.Symbol(f"{record}.{symbol}") for symbol in value.free_symbols}))


def record_names(program: Program) -> list[str]:
    """The records that the formulas name, sorted, with the type of a number."""
    used = {r.in_python for f in program.functions for r in (*f.takes, f.returns) if isinstance(r, Record)}
    return sorted(used | {"Real"})


def imported(functions: Iterable[Function]) -> list[str]:
    """The line that imports the elementary functions that the formulas call; none where they call none."""
    text = " ".join(SPELLED(step.value) for function in functions for step in function.steps)
    names = [name for name in ("fabs", "sqrt") if f"{name}(" in text]
    return [f"from numpy import {', '.join(names)}"] if names else []
