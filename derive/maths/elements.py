"""The elements of the model, and the modes that they make, as the engine goes through them by number.

An element has a velocity and dry friction, and perhaps a position between two stops: it slips or is held. Elements
stand in the order in which they win a tie. In a mode some slip and the others are held; its event functions are the
velocities of those that slip beside others, and, of each that is held while another slips, how far its free
acceleration is below its friction to either side. The one that slips alone comes to rest in closed form.
"""

from collections.abc import Iterator
from itertools import product

import sympy as sp

from ..model.equations import MASSES, Model
from ..model.kinds import EVENTS
from ..model.quantities import *
from .laplace import MATRIX, MODES, NAMES, START, WHOLE

POSITIONS = {"actuator": (x1, (x1_min, x1_max))}
"""Positions that are coordinates of the state, and their stops."""
POLYNOMIALS = {(1, 2): (s_1, s_2, s_3), (1,): (p_1, q_1), (2,): (p_2, q_2)}
"""The coefficients of the denominator of each mode, by the masses that slip."""
NUMERATORS = {x1: WHOLE, v1: NAMES[1], v2: NAMES[2], y: NAMES[0]}
"""Of each coordinate of the state the terms of its motion."""
WHATS = "reverses", "sticks", "slips", "hits_stop"
"""What an element does, as its events have it."""


def _numbers(symbols: tuple[sp.Symbol, ...], some: tuple[sp.Symbol, ...]) -> tuple[int, ...]:
    return tuple(symbols.index(each) for each in some)


def elements(model: Model) -> Iterator[dict[str, object]]:
    """Name and numbers of each element: axes of the velocity and the position in the state, stops and mass in Robot,
    what its acceleration has per velocity and per compression in Rates, whether it is fixed, and its events.
    """
    events = {word.text: word.number for word in EVENTS.words}
    for number, (name, (mass, *_)) in enumerate(MASSES.items(), 1):
        position, stops = POSITIONS.get(name, (None, None))
        numbers = (
            STATE.symbols.index(START[number]),
            None if position is None else STATE.symbols.index(position),
            None if stops is None else _numbers(model.robot.symbols, stops),
            model.robot.symbols.index(mass),
            *_numbers(RATES.symbols, (MATRIX[number, number], MATRIX[number, 0])),
            name in model.fixed,
            *(events.get(f"x{number}_{what}", 0) for what in WHATS),
        )
        yield {"name": name, "numbers": numbers}


def follows() -> tuple[tuple[int, ...], ...]:
    """Of each coordinate of the state how it changes with the motion of each element: 1, -1, or 0 if it does not."""
    rows = {y: tuple(MATRIX[0, 1:])}
    for number, name in enumerate(MASSES, 1):
        own = tuple(int(other == name) for other in MASSES)
        rows |= dict.fromkeys((START[number], *POSITIONS.get(name, ())[:1]), own)
    return tuple(tuple(int(each) for each in rows[symbol]) for symbol in STATE.symbols)


def numerators() -> tuple[int, ...]:
    """Of each coordinate of the state the first of its terms in Motion."""
    return _numbers(MOTION.symbols, tuple(NUMERATORS[symbol][0] for symbol in STATE.symbols))


def modes() -> Iterator[dict[str, object]]:
    """Of each mode in which something slips: its name, which elements do, the coefficients of its denominator in Rates,
    and its event functions, of each its element, and to which side of its friction the free acceleration goes, 0 for a
    velocity.
    """
    for moving in MODES:
        slips = tuple(number in moving for number, _ in enumerate(MASSES, 1))
        velocities = [(number, 0) for number, each in enumerate(slips) if each and len(moving) > 1]
        held = [number for number, each in enumerate(slips) if not each]
        name = "both" if all(slips) else tuple(MASSES)[moving[0] - 1]
        numbers = slips, _numbers(RATES.symbols, POLYNOMIALS[moving]), (*velocities, *product(held, (-1, 1)))
        yield {"name": name, "numbers": numbers}
