"""The modes of a model as rows of a table, which the engine walks.

A mode is the sign of each velocity, 0 where an element is held, and of a model with a law the limit that its input is
at, 0 under the law. What follows from these stands in its row: its form (poles, node and numerators of the motion), its
rates, who moves, and the rows to which one change leads. A column in which all rows agree is a constant, so what a model
lacks costs it nothing.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from itertools import product

import sympy as sp

from ..model.equations import Model
from ..model.quantities import *
from .elements import ELEMENTS, POLYNOMIALS, STRETCH_OF_LEG
from .law import limits, rates_at

SIGNS = (-1, 0, 1)


@dataclass(frozen=True)
class Form:
    """Poles, node and numerators that modes share: those that let the same elements slip, under the same rates.

    rates: index of the rates in a plan. coefficients: of the denominator, by their names in Rates.
    """

    name: str
    meaning: str
    moving: tuple[int, ...]
    rates: int
    coefficients: tuple[sp.Symbol, ...]

    @property
    def is_cubic(self) -> bool:
        """Whether the denominator has three poles, else two."""
        return len(self.coefficients) == 3


@dataclass(frozen=True)
class Row:
    """A mode. number: that of a phase in it; form, rates: indices in a plan, of what is held those of any.

    alone: the element that slips alone, -1 where none does. falls, rises: whether the stretch may, while each velocity
    keeps its sign. turned: of each element the rows in which it slips to either side or is held, by SIGNS; the same
    row of one that never moves. limited: the rows at the limits of the input, and under the law between them.
    """

    side: tuple[int, ...]
    limit: int
    number: int
    form: int
    rates: int
    several: int
    rests: int
    alone: int
    falls: int
    rises: int
    turned: tuple[tuple[int, ...], ...]
    limited: tuple[int, ...]


def forms(model: Model) -> tuple[Form, ...]:
    """The forms of a model; the first one is that in which most elements slip."""
    one = {n: Form(f"mass_{n}", f"mass {n} slips alone", (n,), 0, POLYNOMIALS[n,]) for n in model.moving}
    if model.has_law:
        return (*one.values(), Form("law", "the same under the law", model.moving, 1, POLYNOMIALS[model.moving]))
    if len(model.moving) == 1:
        return tuple(one.values())
    return (Form("both", "both masses slip", (1, 2), 0, POLYNOMIALS[1, 2]), *one.values())


def rates(model: Model) -> tuple[str, ...]:
    """The formulas of the rates in a plan."""
    return ("rates_of", "rates_under_law") if model.has_law else ("rates_of",)


def rates_by_limit(model: Model) -> tuple[tuple[int, str], ...]:
    """The formula of the rates at each limit that a mode may be at."""
    return tuple((limit, rates(model)[rates_at(model, limit)]) for limit in limits(model))


def further_rates(model: Model) -> tuple[tuple[int, str], ...]:
    """Those behind the first, by their indices."""
    return tuple(enumerate(rates(model)))[1:]


def calls(model: Model) -> str:
    """In C: CUBIC(form) of each form of three poles, PAIR(form, rates, p, q) of each of two."""
    return " ".join(
        f"CUBIC({n})" if form.is_cubic else f"PAIR({n}, {form.rates}, {', '.join(map(str, form.coefficients))})"
        for n, form in enumerate(forms(model))
    )


def by_form(model: Model) -> str:
    """In C: X(name) of the form of an index."""
    *others, last = forms(model)
    chosen = (f"(form) == {n} ? X({form.name}) : " for n, form in enumerate(others))
    return f"({''.join(chosen)}X({last.name}))"


def rows(model: Model) -> tuple[Row, ...]:
    """The modes of a model, by their numbers."""
    keys = tuple(_keys(model))
    return tuple(_row(model, keys, *key) for key in keys)


def _keys(model: Model) -> Iterator[tuple[tuple[int, ...], int]]:
    """The sides and the limit of each mode, in the order of their numbers."""
    sides = [SIGNS if element.number in model.moving else (0,) for element in ELEMENTS]
    for *side, limit in product(*sides, limits(model)):
        yield tuple(side), limit


def by_slips(model: Model) -> tuple[tuple[str, tuple[bool, ...], tuple[int, ...]], ...]:
    """Of each form but a law's: its name, which elements slip, the coefficients of its denominator by their numbers in
    Rates.
    """
    return tuple(
        (
            form.name,
            tuple(element.number in form.moving for element in ELEMENTS),
            tuple(map(RATES.symbols.index, form.coefficients)),
        )
        for form in forms(model)
        if form.rates == 0
    )


def number_of(side: tuple[int, ...], limit: int) -> int:
    """The number of a mode in a phase: a digit for each sign, of which the second is a law's limit where one acts."""
    return 3 * (side[0] + 1) + side[1] + limit + 1


def _row(model: Model, keys: tuple[tuple[tuple[int, ...], int], ...], side: tuple[int, ...], limit: int) -> Row:
    moving = tuple(element.number for element, sign in zip(ELEMENTS, side, strict=True) if sign)
    its_rates = rates_at(model, limit)
    of_form = [n for n, form in enumerate(forms(model)) if form.moving == moving and form.rates == its_rates]
    of_any = [n for n, form in enumerate(forms(model)) if form.rates == its_rates]
    along = [sign * follows for sign, follows in zip(side, STRETCH_OF_LEG, strict=True)]
    turned = tuple(
        tuple(keys.index((side[:n] + (sign if element.number in model.moving else 0,) + side[n + 1 :], limit))
              for sign in SIGNS)
        for n, element in enumerate(ELEMENTS)
    )  # fmt: skip
    limited = tuple(keys.index((side, sign if sign in limits(model) else limit)) for sign in SIGNS)
    return Row(
        side, limit, number_of(side, limit), [*of_form, of_any[-1]][0], its_rates, int(len(moving) > 1), int(not moving),
        moving[0] - 1 if len(moving) == 1 else -1, int(min(along) < 0), int(max(along) > 0), turned, limited,
    )  # fmt: skip


OF_MOTION = ("form", "alone", "falls", "rises")
"""Columns that nothing asks for where all is held."""
COLUMNS = {
    "limit": "the limit that the input of a law is at, by its sign; 0 under it, or where there is none",
    "number": "of a phase in it",
    "form": "index of its poles and node in a plan",
    "rates": "index of its rates there",
    "several": "whether several elements slip",
    "rests": "whether none does",
    "alone": "the element that slips alone, -1 if none",
    "falls": "whether the stretch may fall while each velocity keeps its sign",
    "rises": "whether it may rise",
}
"""The columns that are one number, and what they say."""
BOOLEAN = ("several", "rests", "falls", "rises")
"""Those of them that are 0 or 1."""


def _agreed(model: Model, column: str) -> int | None:
    """What all rows have in a column that ask for it; None where they differ."""
    entries = {getattr(row, column) for row in rows(model) if not (row.rests and column in OF_MOTION)}
    return next(iter(entries)) if len(entries) == 1 else None


ARRAYS = {
    "turned": ("row_real turned[HOPFORM_ELEMENTS][3]", "where an element slips down, is held, slips up"),
    "limited": ("row_real limited[3]", "at the lower limit of a law's input, between the limits, at the upper one"),
    "side": ("signed char side[HOPFORM_ELEMENTS]", "the sign of each velocity, 0 if held"),
}
"""The columns that are several modes or numbers: how C declares them, and what they say."""


def members(model: Model) -> tuple[tuple[str, str, str], ...]:
    """What a row stores: name, how C declares it, meaning."""
    arrays = ((name, *each) for name, each in ARRAYS.items() if name != "limited" or model.has_law)
    numbers = (
        (name, f"signed char {name}", meaning) for name, meaning in COLUMNS.items() if _agreed(model, name) is None
    )
    return (*arrays, *numbers)


def entries(model: Model, spelled: str) -> Iterator[tuple[object, ...]]:
    """The rows, each as what it stores; a mode is spelled by its index."""
    for row in rows(model):
        stored: dict[str, object] = asdict(row)
        stored["turned"] = tuple(tuple(spelled.format(n) for n in of) for of in row.turned)
        stored["limited"] = tuple(spelled.format(n) for n in row.limited)
        yield tuple(stored[name] for name, *_ in members(model))


def limited(model: Model) -> str:
    """The row of a mode at a limit, in C; without a law the mode itself."""
    return "mode->limited[limit + 1]" if model.has_law else "mode"


def readings(model: Model) -> Iterator[dict[str, object]]:
    """How C reads a column of one number: its name, type and meaning, and its value by a row `mode`."""
    for name, meaning in COLUMNS.items():
        agreed = _agreed(model, name)
        value: object = f"mode->{name}" if agreed is None else agreed
        if name in BOOLEAN:
            value = f"{value} != 0" if agreed is None else str(bool(agreed)).lower()
        yield {
            "name": name, "type": "bool" if name in BOOLEAN else "int", "meaning": meaning[0].upper() + meaning[1:],
            "unread": [] if agreed is None else ["mode"],
            "value": value,
        }  # fmt: skip


def by_number(model: Model) -> tuple[int, ...]:
    """The row of each number that a phase's mode may have; the first one of a number that no mode of the model has."""
    by = {row.number: index for index, row in enumerate(rows(model))}
    return tuple(by.get(number, 0) for number in range(9))


def guards(model: Model) -> tuple[str, ...]:
    """The kinds of guards that a model has, in the order in which their event functions are listed."""
    has = {
        "contact": model.has_contact, "stop": model.has_stops, "limit": has_limits(model), "velocity": True,
        "threshold": len(model.moving) > 1,
    }  # fmt: skip
    return tuple(kind for kind, present in has.items() if present)


def guards_in_rows(model: Model) -> tuple[tuple[str], ...]:
    """The same, each a row of one column."""
    return tuple((kind,) for kind in guards(model))


def has_limits(model: Model) -> bool:
    """Whether a mode may be at a limit."""
    return len(limits(model)) > 1


def most_functions(model: Model) -> int:
    """How many event functions a phase has at most: with each velocity two of thresholds, or one of another velocity."""
    beside = {"contact": 1, "stop": 1, "limit": 2, "threshold": 2}
    return max(sum(beside.get(kind, 0) for kind in guards(model)), 1)
