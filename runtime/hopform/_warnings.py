"""What the model does not say of a real robot: the warnings of a stance, as data. Python goes through them, and so does
the page to play with.
"""

import operator
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

OPERATORS: dict[str, Callable[[Any, Any], bool]] = {"<": operator.lt, "==": operator.eq, ">": operator.gt}
"""What a condition may compare by; the page has the same (docs/play/read.js)."""


class Warning(NamedTuple):
    """A warning: the comparisons of readings and numbers that all have to hold, and the text with readings in it."""

    conditions: tuple[tuple[str, str, str | float], ...]
    text: str


RESTS = "u = {u!r} A pushes the actuator against the stop {stop} on which it rests"
RISES = Warning((("y", "==", 0.0), ("v2", ">", 0.0)), "the body moves up at touchdown, v2 = {v2!r} m/s")
"""A start from N = 0 at which the body rises: no fall leads there, so the sign of v2 may be wrong."""

STIFF = "ill_conditioned: the {mass} is too stiff for the precision, events of its creep may be wrong"

WARNINGS = (
    Warning((("stiff", "==", 1.0),), STIFF.replace("{mass}", "actuator")),
    Warning((("u_size", ">", "u_max"),), "u = {u_largest!r} A is above u_max = {u_max!r} A"),
    RISES,
    *(
        Warning(
            (("x1", "==", stop), ("v1", "==", 0.0), ("force", sign, 0.0), ("x1_min", "<", "x1_max")),
            RESTS.replace("{stop}", stop),
        )
        for stop, sign in (("x1_max", ">"), ("x1_min", "<"))
    ),
    Warning(
        (("travel", "<", float("inf")), ("spring", ">", "travel")),
        "coil_bound: the spring is compressed by {spring:.6g} m, its travel is {travel!r} m",
    ),
    Warning((("lowest", "<", 0.0),), "the body passes below the ground, down to x2 = {lowest:.6g} m"),
    Warning((("takes_off", "==", 1.0), ("g", "==", 0.0)), "g = 0: there is no apex"),
)
"""Those of a stance. Readings are the robot's parameters, the state at the start, x1, v1, v2, y, its current u and force
-gamma2 u, over the stance u_largest, the current of the largest size u_size, the largest compression of the `spring` and
the `lowest` x2, takes_off, and stiff, whether its plan is ill-conditioned; the last two are 1 or 0."""


MOTION_WARNINGS = (
    Warning((("stiff", "==", 1.0),), STIFF),
    Warning((("u_size", ">", "limit"),), "{input} = {u_largest!r} {unit} is above its limit, {limit!r} {unit}"),
    *(
        Warning(
            (("held", "==", 1.0), ("position", "==", stop), ("push", sign, 0.0), ("lower", "<", "upper")),
            "{input} = {u!r} {unit} pushes the {mass} against the stop at {position!r} on which it rests",
        )
        for stop, sign in (("upper", ">"), ("lower", "<"))
    ),
)
"""Those of a motion without a contact, in the words of its model. Readings are the input and its unit, u, its value at
the start, u_largest and u_size as above and its limit; the first mass, its position at the start with its stops, lower
and upper, the push of the input on it, and whether it is held then, 1 or 0."""


def said(warnings: tuple[Warning, ...], reading: Callable[[str], float]) -> Iterator[str]:
    """The texts of the warnings that hold; a reading is asked for only where the conditions before it hold."""
    for each in warnings:
        if all(
            OPERATORS[compared](reading(name), reading(bound) if isinstance(bound, str) else bound)
            for name, compared, bound in each.conditions
        ):
            yield each.text.format_map(_Readings(reading))


class _Readings(dict[str, float]):
    """What a text asks for."""

    def __init__(self, reading: Callable[[str], float]) -> None:
        super().__init__()
        self.reading = reading

    def __missing__(self, name: str) -> float:
        return self.reading(name)
