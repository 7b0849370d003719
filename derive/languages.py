"""How a function of the intermediate form is spelled in NumPy and in C: the only module that knows either grammar.

Both languages print the same steps in the same order; only the punctuation differs. The printer is our own so that
the text depends on no version of sympy: terms and factors are ordered by the names in them.

C templates are written in a type `real` with plain literals and names that end in _real; `C.spell` turns them
into one precision: float literals get their f, `sqrt` becomes `sqrtf`, `hopform_state_real` becomes `hopform_state_f32`.
"""

import math
import re
import struct
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from functools import cache
from typing import NamedTuple

import sympy as sp

from derive.ir import Function, Program, Quantity, Record

Line = tuple[str, str]
LARGEST_PART = 10**36
"""Above and below the line of a fraction, so that single precision holds them; with larger ones it is written as one number."""


def expression(value: sp.Expr) -> str:
    """An expression in the punctuation that Python and C share: + - * / and calls of sqrt and fabs."""
    return _sum(sp.sympify(value))


def _sum(value: sp.Expr) -> str:
    terms = sorted(sp.Add.make_args(value), key=_term_order)
    text = ""
    for term in terms:
        negative = term.could_extract_minus_sign()
        body = _product(-term if negative else term)
        if text:
            text += f" - {body}" if negative else f" + {body}"
        else:
            text = f"-{body}" if negative else body
    return text


def _term_order(term: sp.Expr) -> tuple[bool, int, str]:
    """Positive terms first, then numbers, then the shorter names."""
    negative = bool(term.could_extract_minus_sign())
    body = -term if negative else term
    return negative, len(body.free_symbols), _product(body)


def _product(value: sp.Expr) -> str:
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
            (above if exponent > 0 else below).extend([_factor(base)] * abs(int(exponent)))
        else:
            raise TypeError(f"no spelling for {factor}")
    if root != 1:
        above.append(f"sqrt({_sum(root)})")
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


def _factor_order(text: str) -> tuple[bool, str]:
    return text.startswith("("), text


def _factor(base: sp.Expr) -> str:
    if base.is_Symbol:
        return str(base.name)
    if base.is_Rational:
        return _number(float(base))
    if isinstance(base, sp.Abs):
        return f"fabs({_sum(base.args[0])})"
    return f"({_sum(base)})"


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
        yield from _aligned((f"{s.symbol} = {expression(s.value)}", f"# {s.source}") for s in function.steps)
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
        return expression(value.subs({symbol: sp.Symbol(f"{record}.{symbol}") for symbol in value.free_symbols}))

    def record_names(self, program: Program) -> list[str]:
        """The records that the formulas name, sorted, with the type of a number."""
        used = {r.name for f in program.functions for r in (*f.takes, f.returns) if isinstance(r, Record)}
        return sorted(used | {"Real"})

    def calls(self, functions: Iterable[Function]) -> str:
        """The elementary functions that the formulas call, for their import line."""
        text = " ".join(expression(step.value) for function in functions for step in function.steps)
        return ", ".join(name for name in ("fabs", "sqrt") if f"{name}(" in text)


# [m] How near an apex must come: what the controller goes on to, and what it calls reached, or an edge of what is admissible.
REACHED_WITHIN = {"f32": 1e-6, "f64": 1e-14}
NEAR_WITHIN = {"f32": 4e-6, "f64": 2e-10}


class C:
    """Spelling in C of one precision, float or double."""

    def __init__(self, prefix: str, precision: str) -> None:
        self.prefix = prefix
        self.suffix = precision
        self.single = precision == "f32"
        epsilon = 2.0**-23 if self.single else 2.0**-52
        literal = _single if self.single else repr
        self.constants = {
            "EPSILON": literal(epsilon),
            "ROOT_EPSILON": literal(epsilon**0.5),
            "NEVER": literal(1e38 if self.single else 1e300),
            "FAINT": literal(1e-30 if self.single else 1e-280),
            "REACHED_WITHIN": literal(REACHED_WITHIN[precision]),
            "NEAR_WITHIN": literal(NEAR_WITHIN[precision]),
        }
        self.terms = 24 if self.single else 40
        self.nodes = _gauss_rule(8 if self.single else 12)
        self.words = {"BITS": f"uint{32 if self.single else 64}_t", "SIGNED_BITS": f"int{32 if self.single else 64}_t"}
        self.inverses = [_number(1.0 / n) for n in range(1, self.terms + 8)]
        self.exponential = _inverse_factorials(range(1, 9 if self.single else 15))
        self.decay_tail = _alternating(_inverse_factorials(range(3, 14 if self.single else 21)))
        self.sine = _alternating(_inverse_factorials(range(1, 10 if self.single else 18, 2)))
        self.cosine = _alternating(_inverse_factorials(range(0, 10 if self.single else 18, 2)))
        self.area_tangent = [1.0 / n for n in reversed(range(1, 11 if self.single else 23, 2))]
        bits = 12 if self.single else 32
        self.constants |= {
            "LOG_2_HIGH": literal(_leading(_LOG_2, bits)),
            "LOG_2_LOW": literal(float(_LOG_2 - Fraction(_leading(_LOG_2, bits)))),
            "QUARTER_HIGH": literal(_leading(_QUARTER_TURN, bits)),
            "QUARTER_MIDDLE": literal(_leading(_QUARTER_TURN - Fraction(_leading(_QUARTER_TURN, bits)), bits)),
            "QUARTER_LOW": literal(float(_QUARTER_TURN - Fraction(_leading(_QUARTER_TURN, 2 * bits)))),
            "SMALLEST_EXPONENT": literal(-87.0 if self.single else -708.0),
            "LARGEST_ANGLE": literal(1e6 if self.single else 1e15),
            "FRACTION_BITS": "23" if self.single else "52",
            "LOWER_HALF": "12" if self.single else "27",
            "SMALLEST_NORMAL": literal(2.0**-126 if self.single else 2.0**-1022),
            "TINY_UP": literal(2.0**24 if self.single else 2.0**54),
            "TINY_DOWN": literal(2.0**-8 if self.single else 2.0**-18),
            "EXPONENT_BIAS": "127" if self.single else "1023",
            "SIGNED_BITS": "int32_t" if self.single else "int64_t",
            "REAL_BITS": "uint32_t" if self.single else "uint64_t",
            "LANE_COUNT": "32",
        }

    def type(self, record: Record) -> str:
        return f"hopform_{snake(record.name)}_real"

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
            (f"const real {s.symbol} = {expression(s.value)};", f"/* {s.source} */") for s in function.steps
        )
        if isinstance(function.returns, Record):
            values = ", ".join(map(str, function.returns.symbols))
            yield f"const {self.type(function.returns)} result = {{{values}}};"
            yield "return result;"
        else:
            yield f"return {function.returns.symbol};"

    def members(self, record: Record) -> Iterator[str]:
        yield from _aligned((f"real {q.name};", f"/* [{q.unit}] {q.meaning} */") for q in record.quantities)

    def zeros(self, record: Record) -> str:
        """An initialiser that names no field and leaves none out."""
        return "{" + ", ".join("0.0" for _ in record.quantities) + "}"

    def values(self, record: Record, known: Mapping[str, float]) -> str:
        """An initialiser of a record with some numbers known and the others 0."""
        return "{" + ", ".join(repr(float(known.get(q.name, 0.0))) for q in record.quantities) + "}"

    def in_lanes(self, program: Program) -> list[Record]:
        """The records that the batch keeps a column for each member of."""
        return [program.record(name) for name in ("Robot", "Rates", "Poles", "State", "Motion", "Basis")]

    def with_record(self, record: Record) -> str:
        return f"with_{snake(record.name)}"

    def columns_of(self, record: Record) -> str:
        return f"{snake(record.name)}_columns"

    def in_lane(self, record: Record) -> str:
        """An initialiser from the columns at lane l."""
        return "{" + ", ".join(f"columns->{q.name}[l]" for q in record.quantities) + "}"

    def conditions(self, record: Record) -> Iterator[str]:
        """One condition a quantity, true where the value is out of its domain or not a number."""
        for quantity in record.quantities:
            value = f"robot->{quantity.name}"
            yield {
                "real": f"!({value} >= -NEVER && {value} <= NEVER)",
                "positive": f"!({value} > 0.0 && {value} <= NEVER)",
                "nonnegative": f"!({value} >= 0.0 && {value} <= NEVER)",
                "bound": f"!({value} >= 0.0)",
                "fraction": f"!({value} >= 0.0 && {value} < 1.0)",
                "lower": f"!({value} <= NEVER)",
                "upper": f"!({value} >= -NEVER)",
            }[quantity.domain]

    def spell(self, text: str) -> str:
        """Template text in `real` as C text in this precision, with the library's prefix."""
        text = re.sub(r"_real\b", f"_{self.suffix}", text)
        text = _TOKEN.sub(self._token, text)
        return rename(text, self.prefix)

    def _token(self, match: re.Match[str]) -> str:
        token = match.group()
        if match.lastgroup in {"comment", "string"}:
            return token
        if match.lastgroup == "number":
            return _single(float(token)) if self.single else repr(float(token))
        if token == "real":
            return "float" if self.single else "double"
        if token in self.constants:
            return self.constants[token]
        if token in ELEMENTARY and self.single:
            return token + "f"
        return token


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


ELEMENTARY = {"sqrt", "fabs", "exp", "expm1", "sin", "cos", "atan2", "log", "cbrt", "floor", "fmax", "fmin"}
_TOKEN = re.compile(
    r"(?P<comment>/\*.*?\*/)"
    r'|(?P<string>"[^"\n]*"|#include[^\n]*)'
    r"|(?P<number>(?<![\w.])(?:\d+\.\d*(?:[eE][+-]?\d+)?|\d+[eE][+-]?\d+)(?![\w.]))"
    r"|(?P<word>[A-Za-z_]\w*)",
    re.DOTALL,
)


def documented(text: str) -> str:
    """The text of a public header with its comments marked for Doxygen, but for the first, which is about the file."""
    first, _, rest = text.partition("\n")
    above = re.sub(r"^/\* ", "/** ", rest, flags=re.MULTILINE)
    return first + "\n" + re.sub(r"^((?:#define|    \w|enum).*?)/\* ", r"\1/**< ", above, flags=re.MULTILINE)


def rename(text: str, prefix: str) -> str:
    """Every public name with another prefix: hopform_solve -> NAME_solve, HOPFORM_H -> NAME_H."""
    if prefix == "hopform":
        return text
    return re.sub(r"hopform", prefix, re.sub(r"HOPFORM", prefix.upper(), text))


def _single(value: float) -> str:
    """The shortest literal that reads back as this number in single precision."""
    nearest: float = struct.unpack("f", struct.pack("f", value))[0]
    text = next(
        t for n in range(1, 10) if struct.unpack("f", struct.pack("f", float(t := f"{nearest:.{n}g}")))[0] == nearest
    )
    if "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa}e{int(exponent)}"
    return (text if "." in text or "e" in text else text + ".0") + "f"


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
