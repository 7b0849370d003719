"""What a model file calls: a parameter, a coordinate, a current, and the elements between them.

A call puts what it says into the draft of the file that runs; `mechanism.py` makes the model of it. All symbols are
sympy's, so that expressions are written as on paper. Each call refuses what it cannot mean, by the name of the element.
"""

import re
import unicodedata
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from inspect import currentframe, signature
from math import comb, prod
from pathlib import Path
from runpy import run_path
from types import SimpleNamespace
from typing import Any, ParamSpec, TypeVar

import sympy as sp

from ..ir import DOMAINS, Parameter
from .equations import ModelError
from .names import why_no_column, why_not
from .units import dimension, scaled

__all__ = [
    "contact", "coordinate", "current", "force", "friction", "gravity", "include", "law", "parameter", "spring", "stop", "torque",
    "viscous",
]  # fmt: skip

MODELS = Path(__file__).parents[1] / "models"
"""Where the models that ship have their files."""

WHERE = ("both", "stance", "flight")


class Coordinate(sp.Symbol):
    """A coordinate of a mechanism."""


class Current(sp.Symbol):
    """The input of a mechanism."""


Value = Any
"""A number, or an expression of sympy."""


@dataclass(frozen=True)
class DeclaredCoordinate:
    """A coordinate with its inertia and its words; one that is held stays at 0."""

    symbol: Coordinate
    unit: str
    inertia: sp.Expr
    thing: str
    directions: tuple[str, str]
    velocity: str
    held: bool
    meaning: str
    glyph: str
    line: int | None = None


@dataclass(frozen=True)
class DeclaredCurrent:
    """The input, with the largest size that it may have, None for any."""

    symbol: Current
    unit: str
    limit: sp.Expr | None
    thing: str
    meaning: str
    glyph: str
    line: int | None = None


@dataclass(frozen=True)
class DeclaredLaw:
    """What a law calls the target that is the input in place of the current, and which current it sets."""

    current: Current
    target: str
    meaning: str


@dataclass(frozen=True)
class Element:
    """An element: its kind, its name, what it acts on (a coordinate, or a stretch), its values, where it acts, whether it
    is a damper beside a spring, and its line of the file.
    """

    kind: str
    name: str
    on: sp.Expr
    values: dict[str, sp.Expr | None]
    where: str = "both"
    beside: bool = False
    line: int | None = None

    def __str__(self) -> str:
        return f"{self.kind} '{self.name}'"


@dataclass
class Draft:
    """What a file has declared so far; `shipped` names the model that ships whose file runs. path: of the file, as its
    frames name it. lines: of the file, by the names of parameters. terms: of each expression, multiplied out.
    """

    shipped: str = ""
    path: str = ""
    parameters: list[Parameter] = field(default_factory=list)
    coordinates: list[DeclaredCoordinate] = field(default_factory=list)
    currents: list[DeclaredCurrent] = field(default_factory=list)
    laws: list[DeclaredLaw] = field(default_factory=list)
    elements: list[Element] = field(default_factory=list)
    lines: dict[str, int | None] = field(default_factory=dict)
    terms: dict[sp.Expr, int] = field(default_factory=dict)

    def line(self) -> int | None:
        """The line of the file that declares now; of what another file declares, that which includes it."""
        frame = currentframe()
        while frame is not None and frame.f_code.co_filename != self.path:
            frame = frame.f_back
        return None if frame is None else frame.f_lineno

    def names(self) -> Iterator[tuple[str, str]]:
        """All names that are taken, with what each is."""
        yield from ((each.name, "a parameter") for each in self.parameters)
        for declared in self.coordinates:
            yield declared.symbol.name, "a coordinate"
            yield declared.velocity, f"the velocity of {declared.symbol}"
        yield from ((each.symbol.name, "the current") for each in self.currents)
        yield from ((each.target, "the target of the law") for each in self.laws)


_DRAFTS: list[Draft] = []


@contextmanager
def drafted(path: Path | None = None) -> Iterator[Draft]:
    """The draft of a file that runs."""
    ships = path is not None and path.resolve().parent == MODELS.resolve()
    _DRAFTS.append(Draft(path.stem if ships and path is not None else "", str(path or "")))
    try:
        yield _DRAFTS[-1]
    finally:
        _DRAFTS.pop()


def _draft() -> Draft:
    """The draft of the file that runs; outside of one, say in a console, one that nothing reads."""
    if not _DRAFTS:
        _DRAFTS.append(Draft())
    return _DRAFTS[-1]


# ---- what an argument may be ----


def shown(value: object, most: int = 80) -> str:
    """A value in a line."""
    line = " ".join((value if isinstance(value, str) else repr(value)).split())
    return line if len(line) <= most else f"{line[: most - 3]}..."


def _wrong(what: str, allowed: str, got: object) -> ModelError:
    return ModelError(f"{what} must be {allowed}, got {shown(repr(got))}")


def _text(value: object, what: str) -> str:
    """A text, which each place where it ends up escapes."""
    if not isinstance(value, str) or not value.isprintable():
        raise _wrong(what, "a printable line", value)
    return value


def _label(value: object, kind: str) -> str:
    """The name of an element: its entry in the ledger is made of it."""
    if not isinstance(value, str) or not re.fullmatch("[A-Za-z][A-Za-z0-9 _'-]*", value):
        raise _wrong(f"the name of a {kind}", "letters, digits, blanks, -, _ and ', a letter first", value)
    return value


def _unit(value: object, what: str) -> str:
    unit = _text(value, f"the unit of {what}")
    if multiple := scaled(unit) if dimension(unit) is not None else "":
        raise ModelError(f"the unit of {what} is {unit!r}: units are those of SI, {multiple} is none")
    return unit


def _name(value: object, what: str) -> str:
    if (why := why_not(value)) is not None:
        raise ModelError(f"the name of {what} is {shown(repr(value))}: {why}")
    taken = dict(_draft().names())
    name = str(value)
    if name in taken:
        raise ModelError(f"the name of {what} is {name!r}: it is {taken[name]} already")
    return name


def _column(value: object, what: str) -> str:
    """The name of what results have over time."""
    name = _name(value, what)
    if (why := why_no_column(name)) is not None:
        raise ModelError(f"the name of {what} is {name!r}: {why}")
    return name


def _where(value: object, element: str) -> str:
    if value not in WHERE:
        raise ModelError(f"{element} acts in {value!r}: it must be one of {', '.join(map(repr, WHERE))}")
    return str(value)


P = ParamSpec("P")
R = TypeVar("R")


def _call(function: Callable[P, R]) -> Callable[P, R]:
    """A call of a model file; one with other arguments is refused by those that it takes."""
    takes = signature(function)

    @wraps(function)
    def called(*given: P.args, **named: P.kwargs) -> R:
        try:
            takes.bind(*given, **named)
        except TypeError as error:
            names = ", ".join(name for name in takes.parameters if name != "self")
            raise ModelError(f"{function.__name__}(...): {error}; it takes {names}") from None
        return function(*given, **named)

    return called


# ---- declarations ----


@_call
def parameter(
    name: str, unit: str, meaning: str, domain: str = "real", default: float | None = None, *, glyph: str | None = None
) -> sp.Symbol:
    """A number of the robot's, as a symbol.

    unit: of SI, "1" for none. domain: "real", "positive", "nonnegative", "fraction"; "lower", "upper" for stops and
    "bound" for the limit of the current, which may be infinite. Without a default every robot must give it. glyph: as
    LaTeX writes it.
    """
    label = _name(name, "a parameter")
    what = f"the parameter {label}"
    declared = Parameter(
        label,
        _glyph(label, glyph, what),
        _unit(unit, what),
        _text(meaning, f"the meaning of {what}"),
        domain,
        _default(what, domain, default),
        _draft().shipped,
    )
    _draft().parameters.append(declared)
    _draft().lines[label] = _draft().line()
    return declared.symbol


def _glyph(name: str, given: object, what: str) -> str:
    """How LaTeX writes what has a name, as a file says it or made of the name."""
    return _text(glyph_of(name) if given is None else given, f"the glyph of {what}")


def _default(what: str, domain: object, default: Any) -> float | None:
    if domain not in DOMAINS:
        raise _wrong(f"the domain of {what}", f"one of {', '.join(map(repr, DOMAINS))}", domain)
    if default is None:
        return None
    numeric = isinstance(default, (int, float, sp.Number)) or (
        hasattr(default, "__float__") and not isinstance(default, (str, sp.Basic))
    )
    try:
        number = float(sp.sympify(default)) if numeric and not isinstance(default, bool) else float("nan")
    except (OverflowError, TypeError, ValueError):
        number = float("nan")
    if number not in DOMAINS[str(domain)]:
        raise _wrong(f"the default of {what}", f"{DOMAINS[str(domain)].allowed} or None", default)
    return number


_GREEK = [
    "alpha",
    "beta",
    "gamma",
    "delta",
    "epsilon",
    "zeta",
    "eta",
    "theta",
    "iota",
    "kappa",
    "lambda",
    "mu",
    "nu",
    "xi",
    "rho",
    "sigma",
    "tau",
    "phi",
    "chi",
    "psi",
    "omega",
    "Gamma",
    "Delta",
    "Theta",
    "Lambda",
    "Xi",
    "Pi",
    "Sigma",
    "Phi",
    "Psi",
    "Omega",
]


def _in_latin(word: str) -> str:
    """A Greek letter by its name, which LaTeX has a command for; any other word as it is."""
    called = unicodedata.name(word, "") if len(word) == 1 else ""
    name = called.removeprefix("GREEK SMALL LETTER ").removeprefix("GREEK CAPITAL LETTER ").replace("LAMDA", "LAMBDA")
    name = name.capitalize() if "CAPITAL" in called else name.lower()
    return name if name in _GREEK else word


def glyph_of(name: str) -> str:
    r"""A name as LaTeX writes it: what is behind the first _ or a first letter is its index.

    >>> glyph_of("theta_1"), glyph_of("θ1"), glyph_of("k_φ"), glyph_of("J_load")
    ('\\theta_1', '\\theta_1', 'k_{\\phi}', 'J_{load}')
    """
    head, _, index = (_in_latin(part) for part in name.partition("_"))
    if not index and (match := re.fullmatch(r"([^\W\d_]+?)(\d+)", head)):
        head, index = _in_latin(match[1]), match[2]
    letter = f"\\{head}" if head in _GREEK else head if len(head) == 1 else rf"\mathrm{{{head}}}"
    index = f"\\{index}" if index in _GREEK else index.replace("_", ",")
    return f"{letter}_{index if len(index) == 1 else f'{{{index}}}'}" if index else letter


@_call
def coordinate(
    name: str,
    unit: str,
    inertia: Value,
    thing: str | None = None,
    *,
    directions: tuple[str, str] = ("forward", "backward"),
    velocity: str | None = None,
    held: bool = False,
    meaning: str = "",
    glyph: str | None = None,
) -> sp.Symbol:
    """A coordinate: how far something has moved, as a symbol.

    unit: "m" with an inertia in kg, or "rad" with one in kg m^2. thing: what moves, in words. directions: words for a
    positive and a negative velocity. velocity: its name, by default v1 of x1, q_dot of q. held: whether it is bolted,
    at 0. glyph: as LaTeX writes it, by default made from the name.
    """
    label = _column(name, "a coordinate")
    what = f"the coordinate {label}"
    if unit not in ("m", "rad"):
        raise _wrong(f"the unit of {what}", "'m' or 'rad'", unit)
    if not (
        isinstance(directions, tuple | list)
        and len(directions) == 2
        and all(isinstance(each, str) and each.isprintable() for each in directions)
    ):
        raise _wrong(f"directions of {what}", "two words", directions)
    if not isinstance(held, bool):
        raise _wrong(f"held of {what}", "True or False", held)
    rate = velocity_of(label) if velocity is None else velocity
    if label == rate:
        raise ModelError(f"the name of the velocity of {label} is {rate!r}: it must be another")
    symbol = Coordinate(label, real=True)
    words = tuple(_text(each, f"directions of {what}") for each in directions)
    declared = DeclaredCoordinate(
        symbol, unit, _expression(inertia, f"the inertia of {what}"), _text(thing or label, f"the thing of {what}"), (words[0], words[1]),
        _column(rate, f"the velocity of {label}"), held, _text(meaning, f"the meaning of {what}"),
        _glyph(label, glyph, what), _draft().line(),
    )  # fmt: skip
    _draft().coordinates.append(declared)
    return symbol


def velocity_of(name: str) -> str:
    """The usual name of a velocity."""
    return f"v{name[1:]}" if re.fullmatch(r"x\d*", name) else f"{name}_dot"


@_call
def current(
    name: str, unit: str = "A", limit: Value = None, thing: str = "motor", *, meaning: str = "current",
    glyph: str | None = None,
) -> sp.Symbol:  # fmt: skip
    """The input: a current, a voltage, a pressure, constant or in steps, as a symbol that forces are linear in.

    limit: the largest size that a controller may choose. glyph: as LaTeX writes it, by default made from the name.
    """
    label = _column(name, "a current")
    if _draft().currents:
        raise ModelError(f"the current {label}: a model has one input, which is {_draft().currents[0].symbol}")
    symbol = Current(label, real=True)
    _draft().currents.append(
        DeclaredCurrent(
            symbol, _unit(unit, f"the current {label}"), None if limit is None else _expression(limit, f"the limit of the current {label}"),
            _text(thing, f"the thing of the current {label}"), _text(meaning, f"the meaning of the current {label}"),
            _glyph(label, glyph, f"the current {label}"), _draft().line(),
        )
    )  # fmt: skip
    return symbol


# ---- elements ----


def _element(
    kind: str, name: object, on: Value, where: object = "both", *, beside: bool = False, **values: Value
) -> Element:
    label, line = _label(name, kind), _draft().line()
    element = Element(
        kind, label, _expression(on, f"{kind} '{label}'"), {}, _where(where, f"{kind} '{label}'"), beside, line
    )
    for key, value in values.items():
        element.values[key] = None if value is None else _expression(value, f"{key} of {element}")
    if any(other.name == label and other.kind == kind and other.on == element.on for other in _draft().elements):
        raise ModelError(f"{element} is declared twice: give the second one a name of its own")
    _draft().elements.append(element)
    return element


def _expression(value: object, what: str) -> sp.Expr:
    if isinstance(value, bool) or not (isinstance(value, sp.Expr) or hasattr(value, "__float__")):
        raise _wrong(what, "a number or an expression of sympy", value)
    expression = sp.sympify(value)
    counted = _terms(expression, {})
    if counted is not None:
        _draft().terms[expression] = counted[0]
    if counted is None or sum(_draft().terms.values()) > MOST_TERMS:
        raise ModelError(
            f"{what} is too large: multiplied out, the expressions of a file may have {MOST_TERMS} terms in all, of at "
            f"most {MOST_FACTORS} factors; declare a part of it as a parameter, whose value the robot gives"
        )
    return expression


MOST_TERMS, MOST_FACTORS = 64, 32
"""[B] of the expressions of a file when they are multiplied out, as in the derivation, which takes 30 s for 60 terms."""


def _terms(value: sp.Expr, counts: dict[sp.Expr, tuple[int, int]]) -> tuple[int, int] | None:
    """How many terms an expression has when it is multiplied out, and how many factors one of them at most, counted
    without doing it; None beyond the limits. A power n of t terms has binomial(n + t - 1, n).

    known: of what occurs many times, once counted.
    """
    if value in counts:
        return counts[value]
    parts = []
    for part in value.args[:1] if value.is_Pow else value.args:
        if (counted := _terms(part, counts)) is None:
            return None
        parts.append(counted)
    terms = factors = 1
    if value.is_Add:
        terms, factors = sum(each[0] for each in parts), max(each[1] for each in parts)
    elif value.is_Mul:
        terms, factors = prod(each[0] for each in parts), sum(each[1] for each in parts)
    elif value.is_Pow and value.exp.is_Integer:
        power = min(abs(int(value.exp)), MOST_TERMS + 1)
        terms, factors = comb(power + parts[0][0] - 1, power), power * parts[0][1]
    if terms > MOST_TERMS or factors > MOST_FACTORS:
        return None
    counts[value] = terms, factors
    return terms, factors


@dataclass(frozen=True)
class Spring:
    """A spring that `contact` may take for the leg; `.damper` puts a damper beside it."""

    element: Element

    @_call
    def damper(self, damping: Value, name: str = "damper") -> "Spring":
        """A damper beside the spring: it acts against how fast the spring is compressed or stretched."""
        on = self.element.on
        rates = sum((on.diff(each) * each for each in on.free_symbols if isinstance(each, Coordinate)), sp.S.Zero)
        _element("viscous", name, rates, beside=True, damping=damping)
        return self


@_call
def spring(stretch: Value, stiffness: Value, name: str = "spring") -> Spring:
    """A linear spring of potential energy stiffness*stretch^2/2; stretch is linear in the coordinates.

    Of one coordinate it acts against the ground, of a difference of two between them.
    """
    return Spring(_element("spring", name, stretch, stiffness=stiffness))


@_call
def viscous(on: Value, damping: Value, name: str = "viscous friction", *, where: str = "both") -> None:
    """Viscous friction: -damping times the velocity of a coordinate, or between two of that of their difference."""
    _element("viscous", name, on, where, damping=damping)


@_call
def friction(
    on: sp.Symbol,
    level: Value = None,
    *,
    forward: Value = None,
    backward: Value = None,
    at_rest: Value | tuple[Value, Value] = None,
    name: str = "Coulomb friction",
    where: str = "both",
) -> None:
    """Coulomb friction [N or N m]: one level, or one for each direction of the motion.

    at_rest: the level up to which it holds what is at rest, >= that of the motion, or a pair of such levels, against a
    motion forward and backward; by default that of the motion.
    """
    label = f"friction '{name}'"
    if (level is None) == (forward is None and backward is None):
        raise ModelError(f"{label} has either one level, or forward= and backward=")
    if level is None and (forward is None or backward is None):
        raise ModelError(f"{label} has {'backward' if forward is None else 'forward'}= alone: give both, 0 for none")
    forward, backward = (level, level) if level is not None else (forward, backward)
    pair = at_rest if isinstance(at_rest, tuple | list) else (at_rest, at_rest)
    if len(pair) != 2:
        raise _wrong(f"at_rest of {label}", "a level, or a pair of levels", at_rest)
    _element(
        "friction", name, on, where, forward=forward, backward=backward,
        forward_at_rest=forward if pair[0] is None else pair[0],
        backward_at_rest=backward if pair[1] is None else pair[1],
    )  # fmt: skip


@_call
def force(on: sp.Symbol, value: Value, name: str = "force", *, where: str = "both") -> None:
    """A force [N] along a coordinate in m: constant, or linear in the current."""
    _element("force", name, on, where, value=value)


@_call
def torque(on: sp.Symbol, value: Value, name: str = "torque", *, where: str = "both") -> None:
    """A torque [N m] along a coordinate in rad: constant, or linear in the current."""
    _element("torque", name, on, where, value=value)


@_call
def gravity(on: sp.Symbol, acceleration: Value, name: str = "gravity") -> None:
    """The weight of what moves along a coordinate in m that counts upwards: -inertia*acceleration."""
    _element("gravity", name, on, acceleration=acceleration)


@_call
def stop(on: sp.Symbol, low: Value = None, high: Value = None, name: str = "stop") -> None:
    """Inelastic stops at the ends of a coordinate's range; None for an end without one."""
    if low is None and high is None:
        raise ModelError(f"stop '{name}' has neither a low end nor a high one")
    if isinstance(low, int | float) and isinstance(high, int | float) and low > high:
        raise ModelError(f"stop '{name}': the low end must be <= the high one, got {low!r} and {high!r}")
    _element("stop", name, on, low=low, high=high)


@_call
def contact(leg: Spring, impact_loss: Value = 0, name: str = "contact") -> None:
    """A leg on the ground, which pushes and cannot pull: it takes off where the contact force falls to 0.

    impact_loss: the fraction of the kinetic energy that the body loses at touchdown.
    """
    if not isinstance(leg, Spring):
        raise _wrong(f"the leg of contact '{name}'", "what `spring` returns", leg)
    if any(each.kind == "contact" for each in _draft().elements):
        raise ModelError(f"contact '{name}': a model has one contact")
    _element("contact", name, leg.element.on, impact_loss=impact_loss)


@_call
def include(name: str) -> SimpleNamespace:
    """All that the file of a model that ships declares, beside which more is declared: its symbols, by their names."""
    path = MODELS / f"{name}.py"
    shipped = sorted(each.stem for each in MODELS.glob("[!_]*.py"))
    if name not in shipped:
        raise ModelError(f"include({name!r}): models that ship are {', '.join(shipped)}")
    draft = _draft()
    around, draft.shipped = draft.shipped, name
    try:
        defined = run_path(str(path))
    finally:
        draft.shipped = around
    return SimpleNamespace(**{key: value for key, value in defined.items() if isinstance(value, sp.Symbol | Spring)})


@_call
def law(
    of: sp.Symbol,
    on: sp.Symbol,
    *,
    proportional: Value,
    derivative: Value = 0,
    target: str = "target",
    name: str = "law",
    meaning: str = "",
) -> None:
    """A law that sets the current: i = sat((proportional (target - q) - derivative q')/k_t), within the current's limit.

    of: what `current` returns. on: the coordinate q that it drives, the only one that moves. proportional [N/m, N m/rad],
    derivative [N s/m, N m s/rad]: >= 0, what the motor pulls with; k_t is its force per current. target: the name of
    the input, which is in place of the current, constant or in steps. meaning: of the target.
    """
    label = _label(name, "law")
    if not isinstance(of, Current):
        raise _wrong(f"what law '{label}' sets", "what `current` returns", of)
    if not isinstance(on, Coordinate):
        raise _wrong(f"what law '{label}' acts on", "what `coordinate` returns", on)
    if _draft().laws:
        raise ModelError(f"law '{label}': a model has one law, which sets {_draft().laws[0].current}")
    called = _column(target, f"the target of law '{label}'")
    _draft().laws.append(DeclaredLaw(of, called, _text(meaning, f"the meaning of law '{label}'")))
    _element("law", label, on, proportional=proportional, derivative=derivative)
