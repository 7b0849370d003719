"""What goes into the reference solver and what comes out: exact numbers, records, and the precision they are kept at.

float -> the same number,   "0.05" -> 5/100,   all arithmetic with 30 digits more than are promised
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from mpmath.ctx_mp import MPContext

GUARD = 30  # digits carried beyond the promised ones
mp = MPContext()  # a context of its own: nobody else's precision is touched
mp.dps = 50 + GUARD

Real = Any  # an mpf of `mp`; mpmath has no types of its own
Matrix = list[list[Any]]
Number = Any  # what a caller may give: int, float, decimal string, mpf
Current = Number | Sequence[tuple[Number, Number]]

DEFAULTS: dict[str, Number] = {
    "L0": 0,
    "c": 0,
    "b1": 0,
    "b2": 0,
    "f1": 0,
    "f2": 0,
    "gamma2": 0,
    "g": "9.81",
    "x1_min": "-inf",
    "x1_max": "+inf",
    "u_max": "+inf",
    "impact_loss": 0,
    "f1_excess": 0,
    "f2_excess": 0,
}


class Robot(NamedTuple):
    """The parameters of model (3), (4)."""

    m_eff: Real
    m_s: Real
    k: Real
    L0: Real
    c: Real
    b1: Real
    b2: Real
    f1: Real
    f2: Real
    gamma2: Real
    g: Real
    x1_min: Real
    x1_max: Real
    u_max: Real
    impact_loss: Real
    f1_excess: Real
    f2_excess: Real

    @property
    def at_rest(self) -> tuple[Real, Real]:
        """Friction of each mass at rest, per unit mass: what its free acceleration must exceed before it slips."""
        return self.f1 + self.f1_excess, self.f2 + self.f2_excess


class State(NamedTuple):
    """Displacement and velocity of the actuator, height and velocity of the body."""

    x1: Real
    v1: Real
    x2: Real
    v2: Real


class Event(NamedTuple):
    """One change of a mass's mode of motion."""

    time: Real
    kind: str


class Phase(NamedTuple):
    """A stretch of one mode pair (-1 down, 0 held, +1 up) and one current."""

    start: Real
    state: State
    modes: tuple[int, int]
    u: Real


class Point(NamedTuple):
    """The state as it is carried: n_i is the acceleration of mass i by all forces but the viscous ones.

    With y = x1 - x2 + L0 + c and these n_i the motion inside a phase is homogeneous, so velocities and accelerations
    that die away keep their relative accuracy; formed from y they would sink into rounding.
    """

    x1: Real
    v1: Real
    n1: Real
    v2: Real
    n2: Real
    y: Real


def exact(value: Number) -> Real:
    """The number itself, not a decimal reading of it."""
    return mp.mpf(value)


def parse_robot(robot: Mapping[str, Number]) -> Robot:
    """The robot in exact numbers; raises ValueError on unknown names and on values outside the model."""
    unknown = set(robot) - set(Robot._fields) - {"name"}
    if unknown:
        raise ValueError(f"unknown parameters {sorted(unknown)}, known are {list(Robot._fields)}")
    values = {name: exact(value) for name, value in {**DEFAULTS, **robot}.items() if name != "name"}
    for name in ("m_eff", "m_s", "k"):
        if not values[name] > 0:
            raise ValueError(f"{name} must be > 0, got {values[name]}")
    for name in ("b1", "b2", "f1", "f2", "f1_excess", "f2_excess", "g"):
        if not values[name] >= 0:
            raise ValueError(f"{name} must be >= 0, got {values[name]}")
    if values["x1_min"] > values["x1_max"]:
        raise ValueError(f"x1_min must be <= x1_max, got {values['x1_min']} > {values['x1_max']}")
    return Robot(**values)


def parse_current(u: Current) -> tuple[tuple[Real, Real], ...]:
    """The current as steps (start, value), the first at t = 0."""
    if not isinstance(u, Sequence) or isinstance(u, str):
        return ((mp.zero, exact(u)),)
    steps = tuple((exact(t), exact(value)) for t, value in u)
    if not steps or steps[0][0] != 0 or any(a[0] >= b[0] for a, b in zip(steps, steps[1:], strict=False)):
        raise ValueError(f"steps of u must start at t = 0 and rise, got {u}")
    return steps


def nearly_zero_stretch(y: Real, L0: Real) -> bool:
    """Whether F(0) = 0 is meant: y within 4 ulp (float64) of L0."""
    return bool(abs(y) <= 4 * math.ulp(float(L0)))
