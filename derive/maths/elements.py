"""What the engine knows of a state and of the elements that move it, by numbers: the one source of C and Python.

The axes of a state are its members in their order. Axis 0 is the integral of axis 1 and nothing depends on it; the
others are the core of a mode, `linear.py`. An element has a velocity and dry friction, and perhaps a position between
two stops: it slips or is held. Elements stand in the order in which they win a tie. In a mode some slip and the others
are held; its event functions are the velocities of those that slip beside others, and, of each that is held while
another slips, how far its free acceleration is below its friction to either side. The one that slips alone comes to
rest in closed form.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import sympy as sp

from ..ir import Own, Record, Step, Steps, function, scalar
from ..model import kinds, words
from ..model.equations import MASSES, Model
from ..model.kinds import BEGINNINGS, EVENTS, Kind, Word
from ..model.quantities import *
from . import laplace
from .laplace import NAMES, START, WHOLE

AXES = STATE.symbols
AXES_AND_ONE = (*AXES, 1)
"""What a state is multiplied by as a column: its axes, and 1 for what is constant."""
POSITIONS = {"actuator": x1}
"""Positions that are coordinates of the state: they have stops."""
LOWEST = scalar("lowest", "m", "lower end of the stroke")
HIGHEST = scalar("highest", "m", "upper end of the stroke")
LIMIT = scalar("u_most", "A", "largest size of the current")
PULL = scalar("pull", "N/A", "force per current, against x_1")
POLYNOMIALS = {(1, 2): (s_1, s_2, s_3), (1,): (p_1, q_1), (2,): (p_2, q_2)}
"""The coefficients of the denominator of each mode, by the masses that slip."""
NUMERATORS = {x1: WHOLE, v1: NAMES[1], v2: NAMES[2], y: NAMES[0]}
"""Of each axis the terms of its motion."""
INPUTS = (x1, v1, y, v2, u)
"""What stances are differentiated by, in the order of the columns; the parameters of the robot come behind."""
OUTPUTS = ("T", "x1", "v1", "x2", "v2")
"""What is differentiated, in the order of the rows: time and state of the ending."""
OUTPUTS_OF_CONTACT = ("apex", "aed")
"""Further rows of a model with a contact: hop height of the apex behind a take-off, AED."""
OUTPUTS_OF_FLIGHT = (*OUTPUTS, "v2_after", "apex")
"""What is differentiated of a flight, in the order of the rows: the state before the impact, v2 behind it."""
FURTHER_INPUTS_OF_FLIGHT = ("ground", "Kp", "Kd")
"""What flights are differentiated by beside what stances are: the height of the ground ahead, the gains of the law."""
WHATS = "reverses", "sticks", "slips", "hits_stop"
"""What an element does, as its events have it."""


@dataclass(frozen=True)
class Element:
    """What belongs to an element, which is mass `number` of the equations.

    position: none where it has no stops. events: their numbers, by WHATS, 0 for one that it has not.
    """

    number: int
    name: str
    side: sp.Symbol
    velocity: sp.Symbol
    position: sp.Symbol | None
    events: dict[str, int]


def _elements() -> Iterator[Element]:
    events = {word.text: word.number for word in EVENTS.words}
    for number, (name, (*_, side)) in enumerate(MASSES.items(), 1):
        indices = {what: events.get(f"x{number}_{what}", 0) for what in WHATS}
        yield Element(number, name, side, START[number], POSITIONS.get(name), indices)


ELEMENTS = tuple(_elements())
SIDES = tuple(element.side for element in ELEMENTS)
VELOCITIES = tuple(AXES.index(element.velocity) for element in ELEMENTS)
"""The axes of their velocities."""
STOPPED = next(element for element in ELEMENTS if element.position is not None)
"""The one whose position has stops."""

DRIVEN = ELEMENTS[0]
"""The one that the current drives, (3)."""


def events() -> Iterator[dict[str, object]]:
    """What every element does, and the event of each in which it does."""
    for what in WHATS:
        if all(numbers := [element.events[what] for element in ELEMENTS]):
            yield {"what": what, "numbers": numbers}


def never_moves(model: Model) -> list[bool]:
    """Whether each element is none that moves, in any mode."""
    return [own is None for own in model.names]


BY_LETTER = Record("Letters", "The letters of the derivation, by the parameters of a robot.").of(
    *(scalar(letter.name, "SI", f"{letter.name} of the equations of motion") for letter in LETTERS)
)


@function(takes=(ROBOT,), returns=BY_LETTER)
def letters_of(model: Model) -> Steps:
    """The letters of the derivation, by the parameters of a robot."""
    has = {quantity.name for quantity in letters_record(model).quantities}
    for letter, value in model.constants.items():
        if letter.name in has and not (isinstance(value, Own) and value.name == letter.name):
            yield Step(letter, value, model.sources.get(letter, "none"))


def letters_record(model: Model) -> Record:
    """The letters of a model: terms of its equations, 0 where nothing makes one, ends of ranges, infinite where there is
    none, and the inertias of the masses that it has.
    """
    absent = {mass for own, mass in zip(model.names, (m_eff, m_s), strict=True) if own is None}
    absent |= set() if model.is_geared else {*OF_GEAR}
    return replace(
        BY_LETTER, quantities=tuple(each for each in BY_LETTER.quantities if each.name not in map(str, absent))
    )


@function(takes=(ROBOT,), returns=LOWEST)
def lower_stop() -> Steps:
    """Lower end of the stroke."""
    yield Step(LOWEST.symbol, x1_min, "stop")


@function(takes=(ROBOT,), returns=HIGHEST)
def upper_stop() -> Steps:
    """Upper end of the stroke."""
    yield Step(HIGHEST.symbol, x1_max, "stop")


@function(takes=(ROBOT,), returns=LIMIT)
def current_limit() -> Steps:
    """Largest size of the current."""
    yield Step(LIMIT.symbol, u_max, "limit of the current")


@function(takes=(ROBOT,), returns=PULL)
def force_constant() -> Steps:
    """Force per current, against x_1."""
    yield Step(PULL.symbol, gamma2, "(3) per u")


def ends(model: Model) -> tuple[str, ...]:
    """The lower and the upper end of the stroke as a file has them, and their unit."""
    unit = "m" if model.names[0] is None else model.names[0].unit
    return (*(str(model.constants[end]) if model.declares(end) else "none" for end in (x1_min, x1_max)), unit)


def name_of(model: Model, symbol: sp.Symbol) -> str:
    """What a model calls a member of a state, or the input; the compression y has an underscore behind it where what the
    file declares is called y.
    """
    first, second = model.names
    names = dict[sp.Symbol, str]()
    if first is not None:
        names |= {x1: first.coordinate, v1: first.velocity}
    if second is not None:
        names |= {x2: second.coordinate, v2: second.velocity}
    if model.input is not None:
        names[u] = model.input.name
    names[y] = "y_" if "y" in names.values() else "y"
    return names.get(symbol, str(symbol))


def _word_of(model: Model, word: Word) -> Word | None:
    """The word of an event under the name of its coordinate; None of a contact, law, mass or stop that it has not."""
    if (word.of_contact and not model.has_contact) or (word.of_law and not model.has_law):
        return None
    for number, coordinate in enumerate(model.names, 1):
        prefix = f"x{number}_"
        if word.text.startswith(prefix):
            if coordinate is None or (word.text.endswith("_hits_stop") and not model.has_stops):
                return None
            text = f"{coordinate.coordinate}_{word.text.removeprefix(prefix)}"
            return replace(word, text=text, meaning=words.text(model, word.meaning))
    return replace(word, meaning=words.text(model, word.meaning))


def _words_of(model: Model, words: Iterable[Word]) -> tuple[Word, ...]:
    return tuple(named for word in words if (named := _word_of(model, word)) is not None)


def kinds_of(model: Model) -> tuple[Kind, ...]:
    """The words for what happens, in which events have the names of the model's coordinates."""
    return tuple(
        replace(kind, meaning=words.text(model, kind.meaning), words=_words_of(model, kind.words))
        for kind in kinds.KINDS
        if model.has_contact or not kind.of_contact
    )


def refusals(model: Model) -> tuple[Word, ...]:
    """Statuses that are errors."""
    return _words_of(model, kinds.refusals())


def events_by_element(model: Model) -> list[dict[str, str]]:
    """The events of each element by WHATS, in the words of the model; none of one that it has not."""
    words = {word.number: word.text for word in _words_of(model, EVENTS.words)}
    return [{what: words[n] for what, n in each.events.items() if n in words} for each in ELEMENTS]


def moving(model: Model) -> tuple[int, ...]:
    """The elements that may move, by their indices."""
    return tuple(n for n, none in enumerate(never_moves(model)) if not none)


def flight_events_of(model: Model) -> tuple[Word, ...]:
    """Those that start a phase of a flight."""
    return _words_of(model, kinds.FLIGHT_EVENTS)


def columns_of_start(model: Model) -> tuple[str, ...]:
    """What stances are differentiated by beside parameters: the state at the start and the input."""
    return tuple(name_of(model, symbol) for symbol in INPUTS)


def columns(model: Model) -> tuple[str, ...]:
    """What stances are differentiated by."""
    return (*columns_of_start(model), *(each.name for each in model.parameters))


def outputs(model: Model) -> tuple[str, ...]:
    """What is differentiated, in the order of the rows."""
    return (*OUTPUTS, *(OUTPUTS_OF_CONTACT if model.has_contact else ()))


def rows(model: Model) -> tuple[str, ...]:
    """What is differentiated, by the names of the model."""
    return tuple(name_of(model, sp.Symbol(each, real=True)) for each in outputs(model))


def columns_of_flight(model: Model) -> tuple[str, ...]:
    """What flights are differentiated by."""
    return (*columns(model), *FURTHER_INPUTS_OF_FLIGHT)


def rows_of_flight(model: Model) -> tuple[str, ...]:
    """What is differentiated of a flight, by the names of the model."""
    return tuple(name_of(model, sp.Symbol(each, real=True)) for each in OUTPUTS_OF_FLIGHT)


def stretch_follows(model: Model) -> tuple[sp.Expr, ...]:
    """How the stretch changes with the motion of each element, in the rates of a robot."""
    first, second = laplace.matrix_of(model)[0, 1:]
    return first, second


STRETCH_OF_LEG = (1, -1)
"""To which side each element of a leg changes its compression."""


def axis_of_event() -> tuple[int, ...]:
    """By the number of an event, the axis that is at a value then: a velocity at 0, a position at a stop; -1 where
    nothing jumps.
    """
    axes: dict[int, sp.Symbol] = {}
    for element in ELEMENTS:
        at = {"reverses": element.velocity, "sticks": element.velocity, "hits_stop": element.position}
        axes |= {element.events[what]: axis for what, axis in at.items()}
    last = max(word.number for word in (*EVENTS.words, *BEGINNINGS.words))
    return (-1, *(AXES.index(axes[number]) if number in axes else -1 for number in range(1, last + 1)))


def column_of_axis() -> tuple[int, ...]:
    """The column of derivatives that belongs to each axis."""
    return tuple(map(INPUTS.index, AXES))
