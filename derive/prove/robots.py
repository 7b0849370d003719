"""Robots that formulas are tried with: drawn in the domains of the parameters, and at the edges of these."""

import math
import random
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import sympy as sp

from ..derivation import Derivation
from ..emit.examples import example_value
from ..mode import Mode
from ..model.equations import ModelError
from .own import WORKING, number

ROBOTS = 10
"""How many are drawn."""
NEAR = 1e-13
"""A value near the edge 0 of a domain."""


@dataclass(frozen=True)
class Robot:
    """Parameters by name [SI], and in which words the robot is named."""

    name: str
    values: Mapping[str, float]


def robots(derivation: Derivation, count: int = ROBOTS, seed: int = 1) -> list[Robot]:
    """Robots that are drawn in the domains of the parameters, and the first one with each parameter that may be 0 at 0,
    with all that are at least 0 at 0, and with all of these near 0; without those that a solver refuses.
    """
    model, generator, found = derivation.model, random.Random(seed), list[Robot]()
    admitted = _admitted(derivation)
    for _ in range(100 * count):
        values = {each.name: _drawn(each, generator) for each in model.parameters}
        if len(found) < count and admitted(values):
            found.append(Robot(f"robot {len(found) + 1}", values))
    if not found:
        raise ModelError(f"{model.name}: none of {100 * count} robots that were drawn obeys the conditions of a robot")
    first = found[0]
    at_zero = [each.name for each in model.parameters if each.domain in ("real", "nonnegative", "fraction")]
    damped = [each.name for each in model.parameters if each.domain == "nonnegative"]
    edges = [Robot(f"robot 1 with {name} = 0", {**first.values, name: 0.0}) for name in at_zero]
    if len(damped) > 1:
        for value in (0.0, NEAR):
            edges.append(
                Robot(f"robot 1 with {', '.join(damped)} = {value:g}", {**first.values, **dict.fromkeys(damped, value)})
            )
    edges += filter(None, (_at_double_pole(mode, model.parameters, first) for mode in derivation.modes))
    return [*found, *(each for each in edges if admitted(each.values))]


def _at_double_pole(mode: Mode, parameters: Sequence[Any], robot: Robot) -> Robot | None:
    """A robot with two poles that nearly meet, as floats go, by another value of the first parameter that does that; None
    without one.
    """
    values = {name: sp.Rational(value) for name, value in robot.values.items() if math.isfinite(value)}
    for parameter in sorted(parameters, key=lambda each: each.domain != "nonnegative"):
        known = {s: values[s.name] for s in mode.denominator.free_symbols if s.name in values.keys() - {parameter.name}}
        meet = sp.numer(sp.together(sp.discriminant(mode.denominator.xreplace(known)))) if mode.order > 1 else sp.S.One
        for s in meet.free_symbols:
            places = [float(sp.re(each)) for each in sp.Poly(meet, s).sqf_part().nroots() if sp.im(each) == 0]
            if better := [place for place in places if place > 0 and place in parameter.interval]:
                name = f"robot 1 with {parameter.name} = {better[0]:g}, where two poles nearly meet"
                return Robot(name, {**robot.values, parameter.name: better[0]})
    return None


def _drawn(parameter: Any, generator: random.Random) -> float:
    """Within a factor of 10 of the value that an example has, a number of either sign where it may be any."""
    size = abs(example_value(parameter))
    size = (size if 0.0 < size < float("inf") else 1.0) * 10 ** generator.uniform(-1.0, 1.0)
    if parameter.domain == "fraction":
        return generator.uniform(0.0, 0.9)
    sign = -1.0 if parameter.domain == "lower" or (parameter.domain == "real" and generator.random() < 0.5) else 1.0
    return sign * size


def _admitted(derivation: Derivation) -> Callable[[Mapping[str, float]], bool]:
    """Whether a solver takes a robot: no motion grows, and friction at rest is not below that in motion."""
    model = derivation.model
    bounds = [value for mode in derivation.modes for value in mode.conditions.values()]
    bounds += [model.value(each) for pair in model.excesses for each in pair]

    def admitted(values: Mapping[str, float]) -> bool:
        with mpmath.workdps(WORKING):
            known = {name: mpmath.mpf(value) for name, value in values.items()}
            return all(number(bound, known) >= 0 for bound in bounds)

    return admitted
