"""The elements of the model, and the modes that they make, as the engine goes through them by number.

An element has a velocity and dry friction, and perhaps a position between two stops: it slips or is held. Elements
stand in the order in which they win a tie. In a mode some slip and the others are held; its event functions are the
velocities of those that slip beside others, and, of each that is held while another slips, how far its free
acceleration is below its friction to either side. The one that slips alone comes to rest in closed form.
"""

from dataclasses import dataclass
from itertools import product

from ..model.equations import MASSES, Model
from ..model.kinds import EVENTS
from ..model.quantities import *
from .laplace import MATRIX, MODES, NAMES, START, WHOLE

POSITIONS = {"actuator": (x1, x1_min, x1_max)}
"""Positions that are coordinates of the state, and their stops."""
POLYNOMIALS = {(1, 2): (s_1, s_2, s_3), (1,): (p_1, q_1), (2,): (p_2, q_2)}
"""The coefficients of the denominator of each mode, by the masses that slip."""
NUMERATORS = {x1: WHOLE, v1: NAMES[1], v2: NAMES[2], y: NAMES[0]}
"""Of each coordinate of the state the terms of its motion."""


@dataclass(frozen=True)
class Element:
    """An element by the numbers of what belongs to it: axes of the state, members of Robot and Rates, events."""

    name: str
    velocity: int
    position: int | None
    stops: tuple[int, int] | None
    mass: int
    per_velocity: int
    per_compression: int
    is_fixed: bool
    reverses: int
    sticks: int
    slips: int
    hits_stop: int


@dataclass(frozen=True)
class Mode:
    """A mode by its numbers: which elements slip, its poles' coefficients in Rates, and its event functions.

    guards: of each its element, and to which side of its friction the free acceleration goes, 0 for a velocity.
    """

    name: str
    slips: tuple[bool, ...]
    polynomial: tuple[int, ...]
    guards: tuple[tuple[int, int], ...]


def elements(model: Model) -> tuple[Element, ...]:
    """The elements of a model, in the order in which they win a tie."""
    return tuple(_element(model, number, name) for number, name in enumerate(MASSES, 1))


def _element(model: Model, number: int, name: str) -> Element:
    events = {word.text: word.number for word in EVENTS.words}
    position = stops = None
    if name in POSITIONS:
        x, low, high = POSITIONS[name]
        position = STATE.symbols.index(x)
        stops = model.robot.symbols.index(low), model.robot.symbols.index(high)
    return Element(
        name,
        STATE.symbols.index(START[number]),
        position,
        stops,
        model.robot.symbols.index(MASSES[name][0]),
        RATES.symbols.index(MATRIX[number, number]),
        RATES.symbols.index(MATRIX[number, 0]),
        name in model.fixed,
        *(events.get(f"x{number}_{what}", 0) for what in ("reverses", "sticks", "slips", "hits_stop")),
    )


def follows(model: Model) -> tuple[tuple[int, ...], ...]:
    """Of each coordinate of the state how it changes with the motion of each element: 1, -1, or 0 if it does not."""
    rows = {y: tuple(MATRIX[0, 1:])}
    for element in elements(model):
        own = tuple(int(other == element) for other in elements(model))
        rows[STATE.symbols[element.velocity]] = own
        if element.position is not None:
            rows[STATE.symbols[element.position]] = own
    return tuple(tuple(int(each) for each in rows[symbol]) for symbol in STATE.symbols)


def numerators() -> tuple[int, ...]:
    """Of each coordinate of the state the first of its terms in Motion."""
    return tuple(MOTION.symbols.index(NUMERATORS[symbol][0]) for symbol in STATE.symbols)


def modes() -> tuple[Mode, ...]:
    """The modes in which something slips."""
    return tuple(_mode(moving) for moving in MODES)


def _mode(moving: tuple[int, ...]) -> Mode:
    numbers = range(len(MASSES))
    slips = tuple(number + 1 in moving for number in numbers)
    velocities = [(number, 0) for number in numbers if slips[number] and len(moving) > 1]
    held = [number for number in numbers if not slips[number]]
    name = "both" if len(moving) > 1 else tuple(MASSES)[moving[0] - 1]
    polynomial = tuple(RATES.symbols.index(each) for each in POLYNOMIALS[moving])
    return Mode(name, slips, polynomial, (*velocities, *product(held, (-1, 1))))


def contact_axis() -> int:
    """The coordinate of the state that the contact force over k is, where it is compression alone."""
    return STATE.symbols.index(y)
