"""What a derivation hands to a renderer: quantities, records of them, and functions of named steps.

The intermediate form knows sympy expressions and nothing about any target language.
"""

import inspect
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, TypeAlias

import sympy as sp


@dataclass(frozen=True)
class Domain:
    """The numbers that a quantity may take: an interval, with or without its ends, infinite ones among them."""

    name: str
    allowed: str
    low: float = -math.inf
    high: float = math.inf
    with_low: bool = False
    with_high: bool = False

    def __contains__(self, value: float) -> bool:
        above = self.low <= value if self.with_low else self.low < value
        return above and (value <= self.high if self.with_high else value < self.high)

    @property
    def assumptions(self) -> dict[str, bool]:
        """What sympy may assume of such a number."""
        extended = (self.with_low and self.low == -math.inf) or (self.with_high and self.high == math.inf)
        sign = "real" if self.low < 0 else "nonnegative" if self.with_low else "positive"
        return {f"extended_{sign}" if extended else sign: True}


DOMAINS = {
    domain.name: domain
    for domain in (
        Domain("real", "finite"),
        Domain("positive", "> 0", low=0.0),
        Domain("nonnegative", ">= 0 and finite", low=0.0, with_low=True),
        Domain("bound", ">= 0", low=0.0, with_low=True, with_high=True),
        Domain("length", "> 0", low=0.0, with_high=True),
        Domain("fraction", ">= 0 and < 1", low=0.0, high=1.0, with_low=True),
        Domain("lower", "a number or -inf", with_low=True),
        Domain("upper", "a number or inf", with_high=True),
    )
}


@dataclass(frozen=True)
class Quantity:
    """A real number with a name, the paper's glyph, a unit, a meaning and a domain, one of DOMAINS by its name.

    >>> from hopform.model import derive
    >>> friction = derive("joint").inputs["b"]
    >>> friction.name, friction.unit, friction.meaning, friction.interval.allowed, friction.default
    ('b', 'N m s/rad', 'viscous friction', '>= 0 and finite', 0.0085)
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
    def interval(self) -> Domain:
        return DOMAINS[self.domain]

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        return (self.symbol,)

    @property
    def quantities(self) -> "tuple[Quantity, ...]":
        return (self,)


class Own(sp.Symbol):
    """A parameter as the file of a model writes it: never the letter of the derivation that has the same name."""


class OwnChange(Own):
    """The change of a parameter: never the parameter that has the same name."""


@dataclass(frozen=True)
class Shown(Quantity):
    """A quantity at the door of the derivation: its symbol has its name alone, as a user's `symbols` and `sympify` make
    it, or where it `assumes` so what its domain says.
    """

    assumes: bool = False

    @classmethod
    def of(cls, quantity: Quantity, assumes: bool = False) -> "Shown":
        """A quantity as it is shown."""
        return cls(**{each.name: getattr(quantity, each.name) for each in fields(Quantity)}, assumes=assumes)

    @property
    def symbol(self) -> sp.Symbol:
        return sp.Symbol(self.name, **(self.interval.assumptions if self.assumes else {}))


@dataclass(frozen=True)
class Authored(Quantity):
    """A quantity that is named by the file of a model, not by the derivation."""


@dataclass(frozen=True)
class Parameter(Authored):
    """A quantity that the file of a model declares; `shipped_with` names that model where it is one that ships."""

    shipped_with: str = ""

    @property
    def symbol(self) -> sp.Symbol:
        return Own(self.name, real=True)


@dataclass(frozen=True)
class ParameterChange(Parameter):
    """The change of a parameter."""

    @property
    def symbol(self) -> sp.Symbol:
        return OwnChange(self.name, real=True)


@dataclass(frozen=True)
class Spelled(Authored):
    """A member of a record under another name in the lines of a function."""

    letter: str = ""

    @property
    def symbol(self) -> sp.Symbol:
        return sp.Symbol(self.letter, real=True)


def scalar(name: str, unit: str, meaning: str) -> Quantity:
    """A quantity that the paper has no glyph for."""
    return Quantity(name, name, unit, meaning)


@dataclass(frozen=True)
class Record:
    """An ordered group of quantities: a named tuple in Python, a struct in C, of one name unless Python has its own."""

    name: str
    meaning: str
    quantities: tuple[Quantity, ...] = ()
    python_name: str = ""

    def of(self, *quantities: Quantity) -> "Record":
        """The record with these quantities."""
        return replace(self, quantities=quantities)

    @property
    def symbols(self) -> tuple[sp.Symbol, ...]:
        return tuple(quantity.symbol for quantity in self.quantities)

    @property
    def in_python(self) -> str:
        return self.python_name or self.name


SCALARS = {"real": "real", "bool": "bool"} | {
    name: f"{name}_t" for name in ("int8", "uint8", "uint16", "int32", "uint32", "ptrdiff")
}
"""Types of a member that is no struct, as C has them."""


@dataclass(frozen=True)
class Member:
    """A member: its type is one of SCALARS, a struct's or record's name, or either behind a pointer, "const Plan *"."""

    name: str
    type: str
    meaning: str = ""
    unit: str = ""
    count: int = 1
    is_array: bool = False
    """Whether C declares an array also of one."""

    @property
    def comment(self) -> str:
        unit = f"[{self.unit}] " if self.unit else ""
        return f"{unit}{self.meaning}".strip()


@dataclass(frozen=True)
class Struct:
    """Members in the order in which they lie in memory."""

    name: str
    meaning: str
    members: tuple[Member, ...] = ()

    def of(self, *members: Member) -> "Struct":
        """The struct with these members."""
        return replace(self, members=members)

    def before(self, name: str) -> tuple[Member, ...]:
        """The members before the one of that name."""
        return self.members[: [member.name for member in self.members].index(name)]


@dataclass(frozen=True)
class Step:
    """One line of generated code, `symbol = value`, and the equation that it comes from."""

    symbol: sp.Symbol
    value: sp.Expr
    source: str


Steps: TypeAlias = Iterable[Step]
"""What a function of the program yields, in the order of computation."""


def unfold(expression: sp.Expr, steps: tuple[Step, ...]) -> sp.Expr:
    """Replace every named step by its definition, last name first."""
    for step in reversed(steps):
        expression = expression.subs(step.symbol, step.value)
    return expression


def divisors(value: sp.Expr) -> set[sp.Symbol]:
    """The symbols that stand below a line."""
    return {
        symbol
        for power in value.atoms(sp.Pow)
        if power.exp.could_extract_minus_sign()
        for symbol in power.base.free_symbols
    }


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
        return frozenset(self.returns.symbols).union(*(step.value.free_symbols for step in self.steps))

    def arguments(self) -> Iterator[tuple[Record | Quantity, tuple[sp.Symbol, ...]]]:
        """Each argument with those of its symbols that the function reads."""
        for argument in self.takes:
            yield argument, tuple(symbol for symbol in argument.symbols if symbol in self.used)

    def without(self, zeros: Iterable[sp.Symbol]) -> "Function":
        """The function where these quantities are 0: what that leaves out is not computed."""
        below = {symbol for step in self.steps for symbol in divisors(step.value)}
        none, steps = dict.fromkeys(set(zeros) - below, sp.S.Zero), []
        for step in self.steps:
            value = step.value.xreplace(none)
            none |= {step.symbol: value} if value == 0 and step.symbol not in below else {}
            kept = value != 0 or step.symbol in self.returns.symbols or step.symbol in below
            steps += [replace(step, value=value)] if kept else []
        return replace(self, steps=tuple(_read(steps, self.returns.symbols)))


def _read(steps: Sequence[Step], wanted: Iterable[sp.Symbol]) -> list[Step]:
    """The steps that the wanted symbols depend on."""
    needed, kept = set(wanted), list[Step]()
    for step in reversed(steps):
        if step.symbol in needed:
            kept.append(step)
            needed |= step.value.free_symbols
    return kept[::-1]


@dataclass(frozen=True)
class Definition:
    """A function of the program where its steps are: what it takes and returns of every model, and how its steps are
    made. One `of_contact` has nothing to compute of a model without one.
    """

    name: str
    meaning: str
    takes: tuple[Record | Quantity, ...]
    returns: Record | Quantity
    make: Callable[..., Steps]
    of_contact: bool = False

    def __call__(self, *model: Any) -> tuple[Step, ...]:
        """The steps; those that depend on a model take it."""
        return tuple(self.make(*model))

    def of(self, model: Any, records: Mapping[str, Record]) -> Function:
        """The function of a model; `records` are those that the model makes longer, by name."""

        def longer(argument: Record | Quantity) -> Record | Quantity:
            return records.get(argument.name, argument) if isinstance(argument, Record) else argument

        steps = model.in_parameters(self(model) if inspect.signature(self.make).parameters else self())
        returns = longer(self.returns)
        takes, steps = _spelled(tuple(map(longer, self.takes)), steps, returns)
        return Function(self.name, self.meaning, takes, steps, returns)


def _spelled(
    takes: tuple[Record | Quantity, ...], steps: tuple[Step, ...], returns: Record | Quantity
) -> tuple[tuple[Record | Quantity, ...], tuple[Step, ...]]:
    """A function in which the parameters of a model are symbols like all others, under names that it has no other use
    for.
    """
    own = {symbol for each in takes for symbol in each.symbols if isinstance(symbol, Own)}
    taken = {symbol.name for each in takes for symbol in each.symbols if symbol not in own}
    taken |= (
        {step.symbol.name for step in steps} | {each.name for each in takes} | {each.name.lower() for each in takes}
    )
    taken |= {returns.in_python} if isinstance(returns, Record) else set()
    letters = dict[sp.Symbol, sp.Symbol]()
    for symbol in sorted(own, key=lambda each: (each.name, isinstance(each, OwnChange))):
        letter = symbol.name
        while letter in taken or letter in RESERVED:
            letter += "_"
        taken.add(letter)
        letters[symbol] = sp.Symbol(letter, real=True)

    def spelled(quantity: Quantity) -> Quantity:
        if not isinstance(quantity, Parameter):
            return quantity
        values = {each.name: getattr(quantity, each.name) for each in fields(Quantity)}
        return Spelled(**values, letter=letters[quantity.symbol].name)

    renamed = (
        replace(each, quantities=tuple(map(spelled, each.quantities))) if isinstance(each, Record) else each
        for each in takes
    )
    return tuple(renamed), tuple(replace(step, value=step.value.xreplace(letters)) for step in steps)


RESERVED = frozenset(
    [
        "result",
        "real",
        "sqrt",
        "fabs",
        "exp",
        "robot",
        "rates",
        "poles",
        "state",
        "drive",
        "numerators",
        "numerator",
        "decay",
        "pair",
        "basis",
        "series",
        "free",
        "energy",
        "moments",
        "ledger",
        "gains",
        "actuator",
        "pair_series",
        "pair_numerator",
        "flight_rates",
        "flight_integrals",
        "robot_change",
        "state_change",
        "int",
        "float",
        "double",
        "const",
        "static",
        "inline",
        "return",
    ]
)
"""Names that the lines of functions have in any language: of arguments, results and elementary functions."""


def function(
    *, takes: tuple[Record | Quantity, ...], returns: Record | Quantity, of_contact: bool = False
) -> Callable[[Callable[..., Steps]], Definition]:
    """Make what yields steps a function of the program, under its name; the docstring's first line is the meaning."""

    def define(make: Callable[..., Steps]) -> Definition:
        meaning = inspect.getdoc(make)
        if not meaning:
            raise ValueError(f"{make.__name__} has no docstring to say what it means")
        return Definition(make.__name__, meaning.split("\n")[0], takes, returns, make, of_contact)

    return define


@dataclass(frozen=True)
class Program:
    """Everything that gets rendered; `summary` is what a list of packages says of it."""

    meaning: str
    summary: str
    records: tuple[Record, ...]
    functions: tuple[Function, ...]

    def function(self, name: str) -> Function:
        return next(function for function in self.functions if function.name == name)

    def record(self, name: str) -> Record:
        return next(record for record in self.records if record.name == name)
