"""How functions, records, structs and constants are spelled in C.

C is written in a type `real` with plain literals and names that end in _real, which `instantiate` turns into one
precision.
"""

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import sympy as sp

from ..ir import SCALARS, Authored, Domain, Function, Member, Program, Quantity, Record, Struct
from ..model.equations import Model
from ..model.kinds import Kind, Word
from ..model.names import in_c
from ..model.precisions import F32, Precision
from ..model.quantities import BODY_HEIGHT, STATE
from ..model.structs import member_name, struct_of, structs
from .expressions import Expressions, aligned, argument_name, snake, unpacked
from .facts import height_of, state_of
from .texts import comment_of_c

ELEMENTARY = ("sqrt", "fabs", "exp", "expm1", "sin", "cos", "atan2", "log", "cbrt")
"""Functions of the C library that the engine or a formula may call."""

PUBLIC = ("Robot", "Rates", "Poles", "State", "Energy", "Ledger", "Gains", "FlightLedger", "Start", "Forces")
"""Records that appear in the public header; the others belong to the formulas. The prefix is that of public names."""

_PREFIXED = {*PUBLIC, *(struct.name for struct in structs())}

SPELLED = Expressions("sqrt_real", "fabs_real", infinity="(real)INFINITY")


def public_structs(model: Model, program: Program) -> list[Struct]:
    """The structs of the public header; members that are a state's have the words of the model."""
    declared = [struct_of(record) for record in program.records if record.name in PUBLIC]
    declared += (
        replace(struct, members=tuple(replace(each, unit=model.unit(each.unit, each.name)) for each in struct.members))
        for struct in structs(
            model.robot,
            model.moving,
            has_law=model.has_law,
            has_contact=model.has_contact,
        )
    )
    quantities = (*STATE.quantities, BODY_HEIGHT)
    in_file = {
        (member.name, member.meaning): (words.meaning, words.unit)
        for member, words in zip(quantities, (*state_of(model), height_of(model)), strict=True)
    }

    def in_words(member: Member) -> Member:
        meaning, unit = in_file.get((member.name, member.meaning), (member.meaning, member.unit))
        return replace(member, meaning=meaning, unit=unit)

    return [replace(struct, members=tuple(map(in_words, struct.members))) for struct in declared]


def internal_structs(program: Program, functions: Iterable[Function], words: Collection[str]) -> list[Struct]:
    """Those that the formulas alone, or the engine by a word of its own, have a use for."""
    used = {each.name for function in functions for each in (*function.takes, function.returns)}
    return [
        struct_of(record)
        for record in program.records
        if record.name not in PUBLIC and (record.name in used or snake(record.name) in words)
    ]


def of_libm(name: str, precision: Precision) -> str:
    """The function of the C library that computes in a precision."""
    return f"{name}f" if precision == F32 else name


def define(kind: Kind, word: Word) -> str:
    """The macro of a word, with values and comments that align."""
    value = f"({word.number})" if word.number < 0 else str(word.number)
    return f"#define HOPFORM_{f'{kind.macro_of(word)} {value}'.ljust(20)} /* {comment_of_c(word.meaning)} */"


def in_domain(domain: Domain) -> str:
    """The condition that `value` lies in a domain. NaN lies in none; where infinity does not, nothing beyond NEVER
    does.
    """
    ends = []
    if -math.inf not in domain:
        low = "-HOPFORM_NEVER_real" if domain.low == -math.inf else repr(domain.low)
        ends.append(f"(value) {'>=' if domain.with_low or domain.low == -math.inf else '>'} {low}")
    if math.inf not in domain:
        high = "HOPFORM_NEVER_real" if domain.high == math.inf else repr(domain.high)
        ends.append(f"(value) {'<=' if domain.with_high or domain.high == math.inf else '<'} {high}")
    return f"({' && '.join(ends)})"


def for_each_member(record: Record) -> str:
    """The macro that has EACH(name, DOMAIN) for each member; no member is spelled EACH."""
    calls = " ".join(f"EACH({member_name(each)}, {each.domain.upper()})" for each in record.quantities)
    return f"#define HOPFORM_{snake(record.name).upper()}_MEMBERS(EACH) {calls}"


def type_of(name: str) -> str:
    """A scalar, a struct or a pointer, by its name in the derivation."""
    bare = name.removeprefix("const ").removesuffix(" *")
    prefix = "hopform_" if bare in _PREFIXED else ""
    spelled = "void" if bare == "void" else SCALARS.get(bare, f"{prefix}{snake(bare)}_real")
    return name.replace(bare, spelled, 1)


def members(struct: Struct) -> Iterator[str]:
    """Declarations with their comments, which align where all are of the type that each precision spells."""
    lines = [
        (_member(member), f"/* {comment_of_c(member.comment)} */" if member.comment else "")
        for member in struct.members
    ]
    if all(member.type == "real" for member in struct.members):
        return aligned(lines)
    return (f"{declared} {comment}".rstrip() for declared, comment in lines)


def _member(member: Member) -> str:
    many = f"[{member.count}]" if member.is_array or member.count > 1 else ""
    return f"{type_of(member.type)} {member.name}{many};".replace("* ", "*")


SHORT = 4
"""Steps of a formula that is inlined wherever it is called: a call and the record that it hands over take as much."""


def storage(function: Function) -> str:
    return "ALWAYS_real" if len(function.steps) <= SHORT else "static inline"


def signature(function: Function) -> str:
    arguments = [
        f"const {type_of(a.name)} *{argument_name(a)}" if isinstance(a, Record) else f"real {a.name}"
        for a in function.takes
    ]
    returns = type_of(function.returns.name) if isinstance(function.returns, Record) else "real"
    begins = f"{returns} {function.name}_real("
    between = ", " if len(begins + ", ".join(arguments)) < 100 else ",\n    "
    return f"{begins}{between.join(arguments)})"


def body(function: Function) -> Iterator[str]:
    yield from (f"(void){argument_name(argument)};" for argument, symbols in function.arguments() if not symbols)
    spelled = _locals(function)
    for name, members in unpacked(function, 7):
        read = (f"{spelled.get(symbol, symbol)} = {name}->{member_name(quantity)}" for symbol, quantity in members)
        yield f"const real {', '.join(read)};"
    yield from aligned(
        (
            f"const real {spelled.get(s.symbol, s.symbol)} = {SPELLED(s.value.xreplace(spelled))};",
            f"/* {comment_of_c(s.source)} */",
        )
        for s in function.steps
    )
    if isinstance(function.returns, Record):
        values = ", ".join(str(spelled.get(symbol, symbol)) for symbol in function.returns.symbols) or "0.0"
        yield f"const {type_of(function.returns.name)} result = {{{values}}};"
        yield "return result;"
    else:
        yield f"return {function.returns.symbol};"


def _locals(function: Function) -> dict[sp.Symbol, sp.Symbol]:
    """The variables of a function that a file has named, as C spells them, where it spells them otherwise."""
    quantities = (each for argument in (*function.takes, function.returns) for each in argument.quantities)
    named = (each.symbol for each in quantities if isinstance(each, Authored))
    spelled = {symbol: sp.Symbol(in_c(symbol.name), real=True) for symbol in named}
    return {symbol: other for symbol, other in spelled.items() if symbol != other}


def calls(rows: Iterable[Iterable[Any]]) -> str:
    """X(...) for each row of numbers or names."""
    return " ".join(f"X({', '.join(map(str, row))})" for row in rows)


def braced(numbers: int | str | Iterable[Any]) -> str:
    """The initialiser of an array of whole numbers or names, or of arrays of such."""
    return str(numbers) if isinstance(numbers, int | str) else f"{{{', '.join(map(braced, numbers))}}}"


def by_element(numbers: Iterable[int]) -> str:
    """The numbers of elements, which are evenly apart, by their index `element`."""
    first, second, *others = map(int, numbers)
    step = second - first
    if others != [second + n * step for n, _ in enumerate(others, 1)]:
        raise ValueError(f"{first}, {second}, {others} are not evenly apart")
    return f"((element) + {first})" if step == 1 else f"({first} + {step} * (element))"


def by_element_in(values: Iterable[sp.Expr], name: str) -> str:
    """The values of elements by their index `element`: whole numbers, or those that a record of that name has."""
    first, second = values
    if first.is_Integer and second.is_Integer:
        return by_element((int(first), int(second)))
    each = (str(value) if value.is_Integer else f"({name})->{value}" for value in (first, second))
    return "((element) == 0 ? {} : {})".format(*each)


def values(record: Record, numbers: Mapping[str, float]) -> str:
    """An initialiser of a record with some numbers, the others such that they act."""
    return "{" + ", ".join(repr(float(numbers.get(q.name, _telling(q)))) for q in record.quantities) + "}"


def _telling(quantity: Quantity) -> float:
    """A number that a parameter may be and that shows: its default but for 0, else 1, or 1/2 where 1 is too much; -1 for
    a lower end.
    """
    numbers = (quantity.default, -1.0 if quantity.domain == "lower" else 1.0, 0.5)
    return next(each for each in numbers if each and math.isfinite(each) and each in quantity.interval)


def documented(text: str) -> str:
    """The text of a public header with its comments marked for Doxygen, but for the first, which is about the file."""
    first, _, rest = text.partition("\n")
    above = re.sub(r"^/\* ", "/** ", rest, flags=re.MULTILINE)
    return first + "\n" + re.sub(r"^((?:#define|    \w|enum).*?)/\* ", r"\1/**< ", above, flags=re.MULTILINE)
