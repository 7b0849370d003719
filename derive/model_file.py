"""A model from a file that declares further terms: `python -m derive --model FILE.py`.

The file is run as Python. What it defines ends up in the names, comments and numbers of generated code, so whatever
could not stand there is refused in one line: the file, the place, the value and what is allowed.
"""

import builtins
import difflib
import keyword
import math
import re
import runpy
import traceback
from dataclasses import replace
from fractions import Fraction
from functools import cache
from numbers import Real
from pathlib import Path
from typing import Any

import sympy as sp
from sympy.printing import c as in_c
from sympy.printing import cxx as in_cpp

from .emit.c import ELEMENTARY
from .emit.expressions import snake
from .emit.program import program
from .ir import DOMAINS, Quantity
from .maths import energy, flight
from .model.equations import FIXED, MASSES, Model, ModelError, Term
from .model.quantities import ROBOT, side_1, side_2, t, u, v1, v2, x1, x2

FINITE = {name: domain for name, domain in DOMAINS.items() if -math.inf not in domain and math.inf not in domain}
"""Domains of a parameter of a term, which may not be infinite."""

SMALLEST, LARGEST = sp.Rational(1, 10**30), sp.Integer(10**30)
"""Numbers in a force, so that single precision holds what becomes of them."""

FURTHER_WORDS = {
    "catch", "co_await", "co_return", "co_yield", "complex", "concept", "consteval", "constinit", "errno", "far",
    "final", "i386", "imaginary", "interface", "linux", "module", "near", "offsetof", "override", "requires", "typeof",
    "typeof_unqual", "unix",
}  # fmt: skip
"""Keywords of later standards, and macros in small letters that compilers and common headers define."""

KEYWORDS_OF_C = FURTHER_WORDS.union(in_c.reserved_words, in_c.reserved_words_c99, *in_cpp.reserved.values()) - {"entry"}
"""Of C and C++, those that sympy knows among them; no standard has `entry`."""

NAMES_OF_THE_PACKAGE = (
    "Field Number Parameters Real cached_property description fields formulas math name parameters real result solver "
    "to_toml I U V1 V2 X1 copy div put"
)
"""Names of the class of the robot, of the modules of formulas and of the printed engine; the imaginary unit of C,
enumerators of columns.
"""


def read_model(path: Path) -> Model:
    """The model of a file that defines `terms`, `parameters`, `fixed` and `friction_by_sign`; errors name the file."""
    if not path.is_file():
        raise ModelError(f"--model: there is no file {path}")
    try:
        defined = _run(path)
        _refuse_misspelt(defined)
        parameters = _parameters(defined.get("parameters", ()))
        terms = _terms(defined, parameters)
        fixed, by_sign = (_sequence(defined.get(name, ()), name, str) for name in ("fixed", "friction_by_sign"))
        model = Model(terms, parameters, fixed, by_sign, **_named(path, defined.get("__doc__")))
        for term in () if "foot" in model.fixed else terms:
            flight.refuse_what_flight_cannot_carry(term)
    except ModelError as error:
        raise ModelError(f"{path}: {error}") from None
    return model


# ---- the file ----


def _run(path: Path) -> dict[str, Any]:
    """The names that the file defines; an exception becomes one line with the place in the file."""
    try:
        return runpy.run_path(str(path))
    except (Exception, SystemExit) as error:
        line = _line_in(path, error)
        text = error.msg if isinstance(error, SyntaxError) else str(error)
        message = ": ".join(part for part in (type(error).__name__, _one_line(text)) if part)
        raise ModelError(f"{f'line {line}: ' if line else ''}{message}") from None


def _line_in(path: Path, error: BaseException) -> int | None:
    """The line of the file where an exception came from: the innermost one."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return error.lineno
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return lines[-1] if lines else None


def _one_line(text: str, most: int = 240) -> str:
    """A text in a line, which is cut where it is long."""
    line = " ".join(text.split())
    return line if len(line) <= most else f"{line[: most - 3]}..."


def _shown(value: object) -> str:
    return _one_line(repr(value), 80)


def _wrong(what: str, wanted: str, got: object) -> ModelError:
    return ModelError(f"{what} must be {wanted}, got {_shown(got)}")


def _sequence(value: Any, name: str, kind: type) -> tuple[Any, ...]:
    """A tuple or list whose entries are all of a kind."""
    wanted = f"a tuple of {'' if kind is str else 'hopform.model.'}{kind.__name__}"
    if not isinstance(value, tuple | list):
        raise _wrong(f"`{name}`", wanted, value)
    for number, entry in enumerate(value):
        if not isinstance(entry, kind):
            raise ModelError(f"`{name}` must be {wanted}, got {_shown(entry)} as {name}[{number}]")
    return tuple(value)


# ---- names ----


def _named(path: Path, docstring: str | None) -> dict[str, Any]:
    """The name of a model is that of its file; its title, the first line of the docstring."""
    name = re.sub(r"[^A-Za-z0-9_-]+", "_", path.stem)
    title = next(iter((docstring or "").strip().splitlines()), "")
    return {"name": name, "title": title if title and title.isprintable() else f"The model {name}."}


DECLARATIONS = ("terms", "parameters", "fixed", "friction_by_sign")
"""What a model file defines; all other names are its own."""


def _refuse_misspelt(defined: dict[str, Any]) -> None:
    """A name that was meant for a declaration: it is near one that is missing, or holds words of one. A leading _ marks
    a name as the file's own.
    """
    missing = [name for name in DECLARATIONS if name not in defined]
    held, words = [defined[name] for name in DECLARATIONS if name in defined], {*FIXED, *MASSES}
    for name, value in defined.items():
        if name in DECLARATIONS or name.startswith("_") or not isinstance(value, tuple | list | str | Term | Quantity):
            continue
        near = difflib.get_close_matches(name.lower(), missing, 1, 0.75)
        named = (
            isinstance(value, tuple | list) and value and all(isinstance(each, str) and each in words for each in value)
        )
        if near or (named and not any(value is each for each in held)):
            meant = f"did you mean `{near[0]}`?" if near else f"it reads {', '.join(DECLARATIONS)}"
            raise ModelError(f"`{name}` is nothing that a model reads: {meant}")


@cache
def _names_of_the_derivation() -> frozenset[str]:
    """Every name that a generated formula, or the class of the robot, may use beside those of the parameters."""
    derived = program()
    names = set(NAMES_OF_THE_PACKAGE.split())
    for record in derived.records:
        names |= {record.name, record.in_python, snake(record.name), *map(str, record.symbols)}
    for function in derived.functions:
        names |= {str(symbol) for part in (*function.takes, function.returns) for symbol in part.symbols}
        names |= {function.name, *(str(step.symbol) for step in function.steps)}
    return frozenset(names | set(ELEMENTARY))


def _why_not(name: Any) -> str | None:
    """Why a name cannot be that of a parameter in generated code."""
    if not isinstance(name, str) or not re.fullmatch("[A-Za-z][A-Za-z0-9_]*", name):
        return "it must be a str of letters, digits and _, a letter first"
    reasons = (
        (name in {quantity.name for quantity in ROBOT.quantities}, "it must not be one of the robot's already"),
        (name in _names_of_the_derivation(), "it must not be one that the generated code has already"),
        (
            name.isupper() and not re.fullmatch("[A-Z]_?[0-9]*", name),
            "it must have a small letter, or be one letter with an index, because names in capitals are macros in C",
        ),
        (name in KEYWORDS_OF_C or keyword.iskeyword(name), "it must not be a keyword of Python, C or C++"),
        (hasattr(builtins, name) or hasattr(tuple, name), "it must not be built into Python"),
        (
            name.endswith(("_t", "_real", "_f32", "_f64")) or name.startswith("d_") or _has_prefix(name),
            "it must not end in _t, _real, _f32 or _f64, begin with d_, or contain hopform, as names of the generated "
            "code do",
        ),
    )
    return next((reason for holds, reason in reasons if holds), None)


def _has_prefix(name: str) -> bool:
    """Whether a name looks like one that gets the prefix of every public name."""
    return "hopform" in name.lower()


# ---- parameters ----


def _parameters(value: Any) -> tuple[Quantity, ...]:
    made: list[Quantity] = []
    for parameter in _sequence(value, "parameters", Quantity):
        name = parameter.name
        if (why := _why_not(name)) is not None:
            raise ModelError(f"the name of a parameter is {_shown(name)}: {why}")
        if name in {other.name for other in made}:
            raise ModelError(f"the parameter {name} is declared twice")
        for field in ("glyph", "unit", "meaning"):
            _check_text(getattr(parameter, field), f"{field} of the parameter {name}", backslash=field == "glyph")
        made.append(replace(parameter, default=_default(parameter)))
    return tuple(made)


def _default(parameter: Quantity) -> float | None:
    if parameter.domain not in FINITE:
        known = ", ".join(map(repr, FINITE))
        raise _wrong(f"domain of the parameter {parameter.name}", f"one of {known}", parameter.domain)
    value, domain = parameter.default, FINITE[parameter.domain]
    if value is None:
        return None
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    number = float(sp.sympify(value)) if is_number else math.nan  # infinite where Python's float would overflow
    if number not in domain:
        raise _wrong(f"default of the parameter {parameter.name}", f"{domain.allowed} or None", value)
    return number


def _check_text(text: object, what: str, *, backslash: bool) -> None:
    """Texts stand in strings, docstrings, comments and tables."""
    barred = ('"', "*/", "/*", "@header@", *(() if backslash else ("\\",)))
    if not isinstance(text, str) or not text.isprintable() or any(part in text for part in barred):
        raise _wrong(what, f"a printable line without {' '.join(barred)}", text)


# ---- terms ----


def _terms(defined: dict[str, Any], parameters: tuple[Quantity, ...]) -> tuple[Term, ...]:
    if "terms" not in defined:
        raise ModelError("the file must define `terms`, a tuple of hopform.model.Term")
    symbols = {*ROBOT.symbols, *(parameter.symbol for parameter in parameters), x1, x2, v1, v2, u, side_1, side_2}
    taken = _names_of_the_derivation() | {symbol.name for symbol in symbols}
    made: list[Term] = []
    for term in _sequence(defined["terms"], "terms", Term):
        if not isinstance(term.name, str) or not re.fullmatch("[A-Za-z][A-Za-z0-9 _-]*", term.name):
            allowed = "letters, digits, blanks, - and _, a letter first"
            raise ModelError(f"the name of a term is {_shown(term.name)}: it must be {allowed}")
        fields = {f"{energy.field_name(term.name)}_{mass}" for mass in (1, 2)}
        if fields & taken or _has_prefix(energy.field_name(term.name)):
            raise ModelError(
                f"the name of a term is {term.name!r}: the generated code or another term has {min(fields)} already, "
                "which would be its entry of the ledger"
            )
        taken |= fields
        forces = {
            field: _force(getattr(term, field), f"{field} of the term '{term.name}'", symbols)
            for field in ("force_1", "force_2")
        }
        made.append(replace(term, **forces))
    return tuple(made)


def _force(value: Any, what: str, symbols: set[sp.Symbol]) -> sp.Expr:
    if isinstance(value, Real) and not isinstance(value, bool):
        value = sp.sympify(value)
    if not isinstance(value, sp.Expr):
        raise _wrong(what, "a number or an expression of sympy", value)
    what = f"{what} is {_one_line(str(value))}"
    force = _exact(value, what)
    if unknown := sorted(symbol.name for symbol in force.free_symbols - symbols):
        name = next((each for each in unknown if each in _NO_PARAMETERS), "")
        reason = _NO_PARAMETERS.get(name) or (
            f"{', '.join(unknown)} is not declared in `parameters`: its symbols must be those of the robot, x1, x2, "
            "v1, v2, and the `symbol` of each parameter"
        )
        raise ModelError(f"{what}, and {reason}")
    for number in sp.expand(force).atoms(sp.Rational):
        _check_size(number, what)
    return force


_NO_PARAMETERS = {
    "t": "t is the time: in each phase the closed form takes forces that do not change with it; what changes is the "
    "current, given as steps",
    "y": "y is the compression: write x1 - x2 + L0 + c",
}
"""Symbols of hopform.model that a force may not have, and why."""


def _check_size(number: sp.Expr, what: str) -> None:
    if number and not SMALLEST <= abs(number) <= LARGEST:
        raise ModelError(f"{what}: a number must be 0 or between 1e-30 and 1e30 in size")


def _exact(value: sp.Expr, what: str) -> sp.Expr:
    """The expression with each float as the decimal fraction that it is written as: 12.5 is 25/2, 0.1 is 1/10."""
    if value.is_Float:
        _check_size(value, what)
        fraction = Fraction(repr(float(value)))
        return sp.Rational(fraction.numerator, fraction.denominator)
    if value.is_Rational or value.is_Symbol:
        return value
    if value.is_Add or value.is_Mul:
        return value.func(*(_exact(part, what) for part in value.args))
    if value.is_Pow:
        base, exponent = (_exact(part, what) for part in value.args)
        if exponent.is_Integer and not (exponent.is_negative and base.is_Add):
            return sp.Pow(base, exponent)
    raise ModelError(
        f"{what}: {_one_line(str(value))} has no spelling in generated code; allowed are sums, products and whole "
        f"powers of symbols and numbers, and quotients by all of these but sums{_way_out(value)}"
    )


def _way_out(value: sp.Expr) -> str:
    """What to write in place of an expression without a spelling."""
    if value.free_symbols & {x1, x2, v1, v2, t}:
        return ""
    if value.free_symbols:
        return f": declare {_one_line(str(value))} as a parameter of its own, whose value the robot gives"
    return ": write the number" if value.is_finite and value.is_real else ""
