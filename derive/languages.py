"""How a function of the intermediate form is spelled in NumPy and in C: the only module that knows either grammar.

Both languages print the same steps in the same order; only the punctuation differs. The printer is our own so that
the text depends on no version of sympy: terms and factors are ordered by the names in them.

C is written in a type `real` with plain literals and names that end in _real, which `instantiate` turns into one precision.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import NamedTuple

import sympy as sp

from derive.ir import Function, Program, Quantity, Record
from derive.structs import SCALARS, Struct

Line = tuple[str, str]
ELEMENTARY = ("sqrt", "fabs", "exp", "expm1", "sin", "cos", "atan2", "log", "cbrt")
"""Functions of the C library that the engine or a formula may call."""
LARGEST_PART = 10**36
"""Above and below the line of a fraction, so that single precision holds them; with larger ones it is written as one number."""


@dataclass(frozen=True)
class Expressions:
    """Expressions in the punctuation that Python and C share: + - * / and calls of two functions by their names."""

    root: str = "sqrt"
    absolute: str = "fabs"

    def __call__(self, value: sp.Expr) -> str:
        return self._sum(sp.sympify(value))

    def _sum(self, value: sp.Expr) -> str:
        terms = sorted(sp.Add.make_args(value), key=self._term_order)
        text = ""
        for term in terms:
            negative = term.could_extract_minus_sign()
            body = self._product(-term if negative else term)
            if text:
                text += f" - {body}" if negative else f" + {body}"
            else:
                text = f"-{body}" if negative else body
        return text

    def _term_order(self, term: sp.Expr) -> tuple[bool, int, str]:
        """Positive terms first, then numbers, then the shorter names."""
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
            above.append(f"{self.root}({self._sum(root)})")
        above.sort(key=_factor_order)
        below.sort(key=_factor_order)
        if max(number.p, number.q) > LARGEST_PART or (number.p != 1 and number.q in (1, 2, 4, 8)):
            above.insert(0, _number(float(number)))
        elif number.q != 1:
            if number.p != 1:
                above.insert(0, _number(float(number.p)))
            below.insert(0, _number(float(number.q))) if number.q not in (2, 4, 8) else above.insert(
                0, _number(1.0 / number.q)
            )
        top = "*".join(above) or "1.0"
        if not below:
            return top
        return f"{top}/{below[0]}" if len(below) == 1 else f"{top}/({'*'.join(below)})"

    def _factor(self, base: sp.Expr) -> str:
        if base.is_Symbol:
            return str(base.name)
        if base.is_Rational:
            return _number(float(base))
        if isinstance(base, sp.Abs):
            return f"{self.absolute}({self._sum(base.args[0])})"
        return f"({self._sum(base)})"


def _factor_order(text: str) -> tuple[bool, str]:
    return text.startswith("("), text


def _number(value: float) -> str:
    return repr(value)


def _aligned(lines: Iterable[Line]) -> Iterator[str]:
    pairs = list(lines)
    width = max((len(code) for code, _ in pairs), default=0)
    yield from (f"{code.ljust(width)}  {comment}".rstrip() for code, comment in pairs)


def _argument(argument: Record | Quantity) -> str:
    """The name of an argument: a record's name in lower case with underscores."""
    return snake(argument.name) if isinstance(argument, Record) else argument.name


def snake(name: str) -> str:
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


class NumPy:
    """Spelling in Python: scalars and broadcastable arrays alike."""

    spelled = Expressions()

    def signature(self, function: Function) -> str:
        arguments = ", ".join(f"{_argument(a)}: {a.name if isinstance(a, Record) else 'Real'}" for a in function.takes)
        returns = function.returns.name if isinstance(function.returns, Record) else "Real"
        return f"def {function.name}({arguments}) -> {returns}:"

    def body(self, function: Function) -> Iterator[str]:
        for argument, symbols in function.arguments():
            if isinstance(argument, Record):
                name = _argument(argument)
                for chunk in _chunks(symbols, 100, len(name) + 5):
                    targets = ", ".join(map(str, chunk))
                    yield f"{targets} = {', '.join(f'{name}.{symbol}' for symbol in chunk)}"
        yield from _aligned((f"{s.symbol} = {self.spelled(s.value)}", f"# {s.source}") for s in function.steps)
        values = ", ".join(map(str, function.returns.symbols))
        yield (
            f"return {function.returns.name}({values})" if isinstance(function.returns, Record) else f"return {values}"
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

    def field(self, quantity: Quantity) -> str:
        """The arguments of a `Field`: plain literals."""
        infinite = {float("inf"): 'float("inf")', float("-inf"): 'float("-inf")'}
        default = "None" if quantity.default is None else infinite.get(quantity.default, repr(quantity.default))
        texts = (quantity.name, quantity.glyph, quantity.unit, quantity.domain, quantity.meaning)
        return ", ".join(f'"{text}"'.replace("\\", "\\\\") for text in texts) + f", {default}"

    def attribute(self, quantity: Quantity) -> str:
        """A field of a dataclass, with its default if it has one."""
        if quantity.default is None:
            return f"{quantity.name}: float"
        infinite = {float("inf"): "math.inf", float("-inf"): "-math.inf"}
        return f"{quantity.name}: float = {infinite.get(quantity.default, repr(quantity.default))}"

    def names(self, symbols: Iterable[sp.Symbol]) -> str:
        """A tuple of names as text."""
        return "(" + "".join(f'"{symbol}", ' for symbol in symbols).rstrip() + ")"

    def of(self, record: str, value: sp.Expr) -> str:
        """An expression in the fields of a record of that name; C writes it alike."""
        return self.spelled(value.subs({symbol: sp.Symbol(f"{record}.{symbol}") for symbol in value.free_symbols}))

    def record_names(self, program: Program) -> list[str]:
        """The records that the formulas name, sorted, with the type of a number."""
        used = {r.name for f in program.functions for r in (*f.takes, f.returns) if isinstance(r, Record)}
        return sorted(used | {"Real"})

    def calls(self, functions: Iterable[Function]) -> str:
        """The elementary functions that the formulas call, for their import line."""
        text = " ".join(self.spelled(step.value) for function in functions for step in function.steps)
        return ", ".join(name for name in ("fabs", "sqrt") if f"{name}(" in text)


class Constant(NamedTuple):
    """A number with a name of its own in the generated C."""

    name: str
    value: str
    meaning: str


class Series(NamedTuple):
    """Coefficients of a series, the highest first, as a macro that is given what to do with each."""

    name: str
    terms: str
    meaning: str


class Table(NamedTuple):
    """Numbers in a row, as an initialiser."""

    name: str
    values: str
    meaning: str


class Limit(NamedTuple):
    """A number that depends on the precision alone, with the same name in every language."""

    name: str
    f32: float
    f64: float
    meaning: str


LIMITS = (
    Limit("NEVER", 1e38, 1e300, "what is beyond is refused; the time of what does not happen"),
    Limit("UNDERFLOW", 1e-30, 1e-280, "below this, squares and quotients lose digits"),
    Limit("REACHED_WITHIN", 1e-6, 1e-14, "[m] the search for a current ends this near"),
    Limit("NEAR_WITHIN", 4e-6, 2e-10, "[m] an apex this near is reached"),
    Limit("TERMS", 24, 40, "terms of the power series of W"),
)


class C:
    """Spelling in C of one precision: in `real`, which `instantiate` turns into float or double."""

    spelled = Expressions("sqrt_real", "fabs_real")
    elementary = ELEMENTARY

    def __init__(self, prefix: str, precision: str) -> None:
        self.prefix, self.precision = prefix, precision
        self.single = precision == "f32"
        self.terms = next(getattr(limit, precision) for limit in LIMITS if limit.name == "TERMS")
        self.nodes = _gauss_rule(8 if self.single else 12)
        self.bits, self.signed_bits = ("uint32_t", "int32_t") if self.single else ("uint64_t", "int64_t")

    def of_libm(self, name: str) -> str:
        """The function of the C library that computes in this precision."""
        return f"{name}f" if self.single else name

    @property
    def limits(self) -> tuple[Constant, ...]:
        """What the precision is to the engine, by name."""
        single = self.single
        epsilon = 2.0**-23 if single else 2.0**-52
        bits = 12 if single else 32
        log_2 = _leading(_LOG_2, bits)
        quarter = _leading(_QUARTER_TURN, bits)
        return tuple(
            Constant(name, value if isinstance(value, str) else repr(value), meaning)
            for name, value, meaning in (
                ("EPS", epsilon, "distance from 1 to the next number"),
                ("ROOT_EPS", epsilon**0.5, "its square root"),
                *((limit.name, getattr(limit, self.precision), limit.meaning) for limit in LIMITS),
                ("LOG_2_HIGH", log_2, "leading bits of ln 2"),
                ("LOG_2_LOW", float(_LOG_2 - Fraction(log_2)), "ln 2 less those"),
                ("QUARTER_TURN_HIGH", quarter, "leading bits of pi/2"),
                ("QUARTER_TURN_MIDDLE", _leading(_QUARTER_TURN - Fraction(quarter), bits), "the bits behind those"),
                ("QUARTER_TURN_LOW", float(_QUARTER_TURN - Fraction(_leading(_QUARTER_TURN, 2 * bits))), "the rest"),
                ("SMALLEST_EXPONENT", -87.0 if single else -708.0, "exp of less counts as 0"),
                ("LARGEST_ANGLE", 1e6 if single else 1e15, "a larger angle has no digit left"),
                ("FRACTION_BITS", "23" if single else "52", "bits of the fraction"),
                ("LOWER_HALF", "12" if single else "27", "bits that are cut off so that a square is exact"),
                ("SMALLEST_NORMAL", 2.0**-126 if single else 2.0**-1022, "smallest normal number"),
                ("TINY_UP", 2.0**24 if single else 2.0**54, "scales a subnormal number up to a normal one"),
                ("TINY_DOWN", 2.0**-8 if single else 2.0**-18, "scales its cube root back"),
                ("EXPONENT_BIAS", "127" if single else "1023", "of the exponent's bits"),
                ("LANE_COUNT", "32", "stances that are solved at a time"),
            )
        )

    @property
    def series(self) -> tuple[Series, ...]:
        """The power series of the kernels."""
        single = self.single
        return tuple(
            Series(name, " ".join(f"X({coefficient})" for coefficient in coefficients), meaning)
            for name, coefficients, meaning in (
                ("EXPONENTIAL", _inverse_factorials(range(1, 9 if single else 15)), "(exp(r) - 1)/r"),
                ("DECAY_TAIL", _alternating(_inverse_factorials(range(3, 14 if single else 21))), "phi_3(-z)"),
                ("SINE", _alternating(_inverse_factorials(range(1, 10 if single else 18, 2))), "sin(r)/r in r^2"),
                ("COSINE", _alternating(_inverse_factorials(range(0, 10 if single else 18, 2))), "cos(r) in r^2"),
                ("AREA_TANGENT", [1.0 / n for n in reversed(range(1, 11 if single else 23, 2))], "artanh(s)/s in s^2"),
            )
        )

    @property
    def tables(self) -> tuple[Table, ...]:
        """Numbers that the engine looks up."""
        inverses = [1.0 / n for n in range(1, int(self.terms) + 8)]
        return tuple(
            Table(name, ", ".join(map(repr, values)), meaning)
            for name, values, meaning in (
                ("INVERSES", inverses, "1/n for n from 1 on"),
                ("GAUSS_PLACES", [node.place for node in self.nodes], "nodes of Gauss's rule over 0 .. 1"),
                ("GAUSS_WEIGHTS", [node.weight for node in self.nodes], "their weights"),
            )
        )

    def macro(self, record: Record) -> str:
        return snake(record.name).upper()

    def for_each_member(self, record: Record) -> str:
        """X(name, DOMAIN) for each member."""
        return " ".join(f"X({quantity.name}, {quantity.domain.upper()})" for quantity in record.quantities)

    def type(self, record: Record | Struct) -> str:
        return self._type(record.name)

    def _type(self, name: str) -> str:
        """A scalar, a struct or a pointer, by its name in the derivation."""
        bare = name.removeprefix("const ").removesuffix(" *")
        spelled = "void" if bare == "void" else SCALARS.get(bare, f"hopform_{snake(bare)}_real")
        return name.replace(bare, spelled, 1)

    def struct_members(self, struct: Struct) -> Iterator[str]:
        """Declarations with their comments."""
        for member in struct.members:
            many = f"[{member.count}]" if member.count > 1 else ""
            declared = f"{self._type(member.type)} {member.name}{many};".replace("* ", "*")
            yield f"{declared} /* {member.comment} */" if member.comment else declared

    def signature(self, function: Function) -> str:
        arguments = ", ".join(
            f"const {self.type(a)} *{_argument(a)}" if isinstance(a, Record) else f"real {a.name}"
            for a in function.takes
        )
        returns = self.type(function.returns) if isinstance(function.returns, Record) else "real"
        return f"{returns} hopform_{function.name}_real({arguments})"

    def body(self, function: Function) -> Iterator[str]:
        for argument, symbols in function.arguments():
            if isinstance(argument, Record):
                name = _argument(argument)
                yield from (
                    f"const real {', '.join(f'{symbol} = {name}->{symbol}' for symbol in chunk)};"
                    for chunk in _chunks(symbols, 100, len(name) + 7)
                )
        yield from _aligned(
            (f"const real {s.symbol} = {self.spelled(s.value)};", f"/* {s.source} */") for s in function.steps
        )
        if isinstance(function.returns, Record):
            values = ", ".join(map(str, function.returns.symbols))
            yield f"const {self.type(function.returns)} result = {{{values}}};"
            yield "return result;"
        else:
            yield f"return {function.returns.symbol};"

    def members(self, record: Record) -> Iterator[str]:
        yield from _aligned((f"real {q.name};", f"/* [{q.unit}] {q.meaning} */") for q in record.quantities)

    def values(self, record: Record, known: Mapping[str, float]) -> str:
        """An initialiser of a record with some numbers known and the others 0."""
        return "{" + ", ".join(repr(float(known.get(q.name, 0.0))) for q in record.quantities) + "}"


# Digits of ln 2 and of pi/2, for reductions in two and three parts.
_LOG_2 = Fraction("0.693147180559945309417232121458176568075500134360255254120680009")
_QUARTER_TURN = Fraction("1.57079632679489661923132169163975144209858469968755291048747230")


def _leading(value: Fraction, bits: int) -> float:
    """The number cut off behind its first bits, which a float holds with room for a factor."""
    scale = Fraction(2) ** (bits - math.frexp(float(value))[1])
    return float(Fraction(math.floor(value * scale)) / scale)


def _inverse_factorials(degrees: Iterable[int]) -> list[float]:
    """Coefficients 1/n! of a power series, the highest first, as Horner's rule takes them."""
    return [1.0 / math.factorial(n) for n in reversed(list(degrees))]


class Node(NamedTuple):
    """A place between 0 and 1 at which a function is taken, and its weight."""

    place: float
    weight: float


@cache
def _gauss_rule(count: int) -> tuple[Node, ...]:
    """The nodes of Gauss's rule over 0 .. 1: the roots of the Legendre polynomial, to 40 digits before they are rounded."""
    x = sp.Symbol("x")
    polynomial = sp.legendre_poly(count, x)
    slope = sp.diff(polynomial, x)
    roots = sorted(sp.Poly(polynomial, x).nroots(n=40, maxsteps=200))
    weights = [2 / ((1 - root**2) * slope.subs(x, root) ** 2) for root in roots]
    return tuple(Node(float((1 + root) / 2), float(weight / 2)) for root, weight in zip(roots, weights, strict=True))


def _alternating(coefficients: list[float]) -> list[float]:
    """The same with signs that alternate from the lowest, which is positive."""
    return [coefficient * (-1) ** (len(coefficients) - 1 - n) for n, coefficient in enumerate(coefficients)]


def documented(text: str) -> str:
    """The text of a public header with its comments marked for Doxygen, but for the first, which is about the file."""
    first, _, rest = text.partition("\n")
    above = re.sub(r"^/\* ", "/** ", rest, flags=re.MULTILINE)
    return first + "\n" + re.sub(r"^((?:#define|    \w|enum).*?)/\* ", r"\1/**< ", above, flags=re.MULTILINE)


def _chunks(symbols: tuple[sp.Symbol, ...], width: int, extra: int) -> Iterator[tuple[sp.Symbol, ...]]:
    """The symbols in groups whose line, with each name twice and `extra` characters around it, fits in a width."""
    group: list[sp.Symbol] = []
    length = 0
    for symbol in symbols:
        size = 2 * len(str(symbol)) + extra
        if group and length + size > width:
            yield tuple(group)
            group, length = [], 0
        group.append(symbol)
        length += size
    if group:
        yield tuple(group)
