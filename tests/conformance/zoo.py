"""Random cases of any model file: numbers by the units of its parameters, a start, and the mechanism for the integrator.

EQUATIONS are those of the mechanisms that ship, written once more by hand: the files must say the same.
"""

import math
import random
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derive.model.units import dimension
from tests.oracle.elements import SHIPPED, Elements, elements, mechanism
from tests.oracle.numeric import Mechanism

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """Parameters of the model, the start by names (positions, then velocities), and the mechanism for the integrator.

    u: the input, a number or steps (t, u).
    """

    file: Path
    robot: dict[str, float]
    start: dict[str, float]
    u: float | tuple[tuple[float, float], ...]
    horizon: float

    @property
    def steps(self) -> tuple[tuple[float, float], ...]:
        """The input as steps."""
        return self.u if isinstance(self.u, tuple) else ((0.0, self.u),)

    @property
    def mechanism(self) -> Mechanism:
        return mechanism(self.file, self.robot)

    @property
    def q(self) -> tuple[float, ...]:
        return tuple(self.start.values())[: len(self.start) // 2]

    @property
    def v(self) -> tuple[float, ...]:
        return tuple(self.start.values())[len(self.start) // 2 :]

    @property
    def fastest(self) -> float:
        """A bound on the rates of poles, [1/s]."""
        made = self.mechanism
        unit, none = np.eye(len(self.q)), np.zeros(len(self.q))
        masses = np.array([mass.inertia for mass in made.masses])
        free = made.force(none, none, 0.0)
        stiff = sum(np.abs(made.force(1e-9 * e, none, 0.0) - free) / (1e-9 * masses) for e in unit)
        damped = sum(np.abs(made.force(none, 1e-9 * e, 0.0) - free) / (1e-9 * masses) for e in unit)
        return float(np.max(np.sqrt(stiff) + damped)) + 1.0


class Draw(random.Random):
    """Random numbers over decades, some of them zero."""

    def over(self, low: float, high: float, zero: float = 0.0) -> float:
        return 0.0 if self.random() < zero else math.exp(self.uniform(math.log(low), math.log(high)))

    def either(self, low: float, high: float) -> float:
        return self.choice([-1.0, 1.0]) * self.over(low, high)


class Scales:
    """What a unit measures of a mechanism whose length, mass, time and current are of a size of their own, or 1."""

    def __init__(self, draw: Draw | None = None) -> None:
        ends = ((0.02, 1.0), (0.05, 50.0), (0.01, 0.3), (0.1, 10.0), (1.0, 1.0))
        self.base = [draw.over(*each) if draw else 1.0 for each in ends]

    @property
    def time(self) -> float:
        return self["s"]

    def __getitem__(self, unit: str) -> float:
        powers = dimension(unit)
        assert powers is not None, unit
        return math.prod(size ** float(power) for size, power in zip(self.base, powers, strict=True))


def number(draw: Draw, domain: str, size: float) -> float:
    """Of a parameter, by its domain."""
    return {
        "real": lambda: draw.choice([0.0, draw.either(0.03, 1.0) * size]),
        "positive": lambda: draw.over(0.2, 5.0) * size,
        "nonnegative": lambda: draw.over(1e-3, 0.5, zero=0.2) * size,
        "fraction": lambda: draw.uniform(0.0, 0.5),
        "lower": lambda: draw.choice([-math.inf, -draw.over(0.02, 1.0) * size]),
        "upper": lambda: draw.choice([math.inf, draw.over(0.02, 1.0) * size]),
        "bound": lambda: draw.choice([math.inf, *3 * [draw.over(0.01, 3.0) * size]]),
    }[domain]()


DRIVES = ("g", "K_p")
"""A weight, which keeps a leg down, and what follows a target: they are no small change of a motion, nor absent."""


def case(file: Path, draw: Draw, sizes: Scales) -> Case:
    """A robot and a start within its stops; a leg is pressed, and its body comes down."""
    declared = elements(file, defaultdict(lambda: 1.0)).parameters
    robot, of = dict[str, float](), None
    while of is None or any(rest < slides for pair in of.friction.values() for slides, rest in zip(*pair, strict=True)):
        robot = {name: number(draw, domain, sizes[unit]) for name, (unit, domain) in declared.items()}
        robot |= {name: draw.over(0.3, 5.0) * sizes[unit] for name, (unit, _) in declared.items() if name in DRIVES}
        of = elements(file, robot)
    start, horizon = start_of(draw, of, sizes, mechanism(file, robot)), sizes.time * draw.uniform(5.0, 40.0)
    unit = sizes[of.coordinates[of.moving[0]][0] if of.law else of.input_unit] if of.input else 0.0
    values = [draw.uniform(-1.0, 1.0) * unit for _ in range(draw.choice([1, 1, draw.randint(2, 6)]) if unit else 1)]
    times = [0.0, *sorted(draw.uniform(0.02, 0.95) * horizon for _ in values[1:])]
    return Case(file, robot, start, values[0] if not times[1:] else tuple(zip(times, values, strict=True)), horizon)


def start_of(draw: Draw, of: Elements, sizes: Scales, made: Mechanism) -> dict[str, float]:
    q, v = np.zeros(len(made.masses)), np.zeros(len(made.masses))
    for n, mass in enumerate(made.masses):
        size = sizes[of.coordinates[mass.name][0]]
        ends = max(mass.low, -size), min(mass.high, size)
        q[n] = draw.uniform(*ends) if draw.random() < 0.8 else draw.choice(ends)
        v[n] = draw.either(0.03, 3.0) * size / sizes.time if draw.random() < 0.8 else 0.0
    if made.contact is not None:
        v[-1] = -draw.over(0.03, 1.0) * size / sizes.time
        softens = made.contact(q, 0.0 * v) - made.contact(q + np.eye(len(q))[-1], 0.0 * v)
        q[-1] += min(made.contact(q, v), made.contact(q, 0.0 * v)) / softens - draw.over(1e-3, 0.3) * size
    return dict(zip(of.start, [*q.tolist(), *v.tolist()], strict=True))


def cases(name: str, seed: int, count: int, stiffest: float) -> Iterator[Case]:
    """Random cases of a model that ships; those whose fastest pole times the horizon is beyond `stiffest` are drawn anew."""
    draw = Draw(f"{name} {seed}")
    while count:
        found = case(SHIPPED / f"{name}.py", draw, Scales(draw))
        if found.fastest * found.horizon < stiffest:
            count -= 1
            yield found


# ---- the mechanisms that ship: M, the force without dry friction, friction in motion, at rest, stops; N ----

ACTUATOR = "k*(x2 - x1 - L0) - b1*v1 - gamma2*u"
BODY = "k*(x1 - x2 + L0 + c) - b2*v2 - m_s*g"
LEG = "k*(x1 - x2 + L0 + c)"


def hopper(actuator: str = "", body: str = "", leg: str = "") -> dict[str, tuple[str, ...]]:
    """(3), (4) with further forces."""
    return {
        "x1": ("m_eff", ACTUATOR + actuator, *2 * ["m_eff*f1"], *2 * ["m_eff*(f1 + f1_excess)"], "x1_min", "x1_max"),
        "x2": ("m_s", BODY + body, *2 * ["m_s*f2"], *2 * ["m_s*(f2 + f2_excess)"], "-inf", "inf"),
        "N": (LEG + leg,),
    }


JOINT = ("F_p", "F_m", "F_p + F_sp", "F_m + F_sm", "q_min", "q_max")
SEA = ("F_m", "F_m", "F_m", "F_m", "theta_min", "theta_max")
EQUATIONS = {
    "hopper": hopper(),
    "leg_damper": hopper("- b12*(v1 - v2)", "+ b12*(v1 - v2)", "+ b12*(v1 - v2)"),
    "second_spring": hopper(*(f"{sign} k_2*(x1 - x2 + L_2)" for sign in "-++")),
    "cable": hopper(body="+ F_cable"),
    "back_emf": hopper("- k_emf*v1"),
    "joint": {"q": ("J", "k_t*u - k*(q - q_0) - b*q_dot + load", *JOINT)},
    "servo": {"q": ("J", "clip(K_p*(u - q) - K_d*q_dot, -k_t*i_max, k_t*i_max) - b*q_dot + load", *JOINT)},
    "pendulum": {"q": ("J", "-m*g*l*q - b*q_dot + k_t*u", "F_p", "F_m", "F_s", "F_s", "q_min", "q_max")},
    "cart": {"x": ("m + J/r**2", "k_m/R/r*u - (b + k_m**2/(R*r**2))*v", *4 * ["F"], "x_min", "x_max")},
    "slide": {"x": ("m", "k_f*u - k*(x - x_0) - b*v + load", "F", "F", "F + F_s", "F + F_s", "x_min", "x_max")},
    "relief_valve": {"x": ("m", "A*u - k*(x + x_0) - b*v", *4 * ["F"], "0", "x_max")},
    "sea_held": {"theta": ("N**2*J_m", "N*k_m*u - k*theta - (d + N**2*b_m)*theta_dot", *SEA)},
    "sea": {
        "theta": ("N**2*J_m", "N*k_m*u - k*(theta - q) - d*(theta_dot - q_dot) - N**2*b_m*theta_dot", *SEA),
        "q": ("J_l", "k*(theta - q) + d*(theta_dot - q_dot) - b_l*q_dot + load", *4 * ["F_l"], "-inf", "inf"),
    },
}  # fmt: skip
