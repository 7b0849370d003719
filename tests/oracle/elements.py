"""What the elements of a model file say, as physics, for the integrator of numeric.py.

The file runs with the words of this module in place of those of hopform.model; nothing of the derivation is used. A spring
and a damper act against what stretches them, on each coordinate by how much it stretches them, and so on: Newton's law
follows, M q'' = -K q - B q' + f + g u.
"""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.oracle.numeric import Mass, Mechanism

Array = NDArray[np.float64]
SHIPPED = Path(__file__).resolve().parents[2] / "derive" / "models"


class Row:
    """An expression that is affine in coordinates and the input: its factor by each name, "" that of 1."""

    __array_ufunc__ = None  # an array times a row is a row of arrays

    def __init__(self, by: Mapping[str, Any]) -> None:
        self.by = dict(by)

    def __neg__(self) -> "Row":
        return Row({name: -each for name, each in self.by.items()})

    def __add__(self, other: Any) -> "Row":
        more = row(other).by
        both = {name: self.by[name] + more[name] for name in self.by.keys() & more.keys()}
        return Row({**self.by, **more, **both})

    def __sub__(self, other: Any) -> "Row":
        return self + -row(other)

    def __rsub__(self, other: Any) -> "Row":
        return -self + other

    def __mul__(self, other: Any) -> "Row":
        return Row({name: other * each for name, each in self.by.items()})

    def __truediv__(self, other: Any) -> "Row":
        return Row({name: each / other for name, each in self.by.items()})

    __radd__, __rmul__ = __add__, __mul__


def row(value: Any) -> Row:
    return value if isinstance(value, Row) else Row({"": value})


@dataclass
class Elements:
    """What a file declares, in its order; a stretch, velocity or force is a row."""

    robot: Mapping[str, float]
    parameters: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Unit and domain by name."""
    coordinates: dict[str, tuple[str, Any, str, bool]] = field(default_factory=dict)
    """Unit, inertia, name of the velocity, whether it is held."""
    input: str = ""
    input_unit: str = ""
    limit: Any = math.inf
    springs: list[tuple[Row, Any]] = field(default_factory=list)
    dampers: list[tuple[Row, Any]] = field(default_factory=list)
    forces: list[tuple[str, Row]] = field(default_factory=list)
    """On which coordinate, and the force."""
    friction: dict[str, tuple[tuple[Any, Any], tuple[Any, Any]]] = field(default_factory=dict)
    """In motion and at rest, each forward and backward."""
    stops: dict[str, tuple[Any, Any]] = field(default_factory=dict)
    stands: bool = False
    law: tuple[Any, Any] | None = None

    @property
    def moving(self) -> list[str]:
        return [name for name, (_, _, _, held) in self.coordinates.items() if not held]

    @property
    def start(self) -> list[str]:
        """The names of positions, then of velocities."""
        return [*self.moving, *(self.coordinates[name][2] for name in self.moving)]

    # ---- the words of a file ----

    def words(self) -> dict[str, Any]:
        names = ("parameter", "coordinate", "current", "spring", "viscous", "force", "gravity", "stop", "contact")
        found = {name: getattr(self, f"_{name}") for name in (*names, "include")}
        return found | {"torque": self._force, "friction": self._friction, "law": self._law}

    def _parameter(self, name: str, unit: str, _: str, domain: str = "real", default: Any = None, **__: Any) -> Any:
        self.parameters[name] = unit, domain
        return default if default is not None and name not in self.robot else self.robot[name]

    def _coordinate(
        self, name: str, unit: str, inertia: Any, thing: str = "", *, velocity: str = "", held: bool = False, **_: Any
    ) -> Row:
        usual = f"v{name[1:]}" if re.fullmatch(r"x\d*", name) else f"{name}_dot"
        self.coordinates[name] = unit, inertia, velocity or usual, held
        return Row({name: 1})

    def _current(self, name: str, unit: str = "A", limit: Any = None, **_: Any) -> Row:
        self.input, self.input_unit, self.limit = name, unit, math.inf if limit is None else limit
        return Row({name: 1})

    def _spring(self, stretch: Row, stiffness: Any, *_: Any) -> SimpleNamespace:
        self.springs.append((stretch, stiffness))
        return SimpleNamespace(damper=lambda damping, *_: self._viscous(stretch, damping))

    def _viscous(self, on: Row, damping: Any, *_: Any, where: str = "both") -> None:
        if where != "flight":
            self.dampers.append((on, damping))

    def _force(self, on: Row, value: Any, *_: Any, where: str = "both") -> None:
        if where != "flight":
            self.forces.append((*on.by, row(value)))

    def _gravity(self, on: Row, acceleration: Any, *_: Any) -> None:
        (of,) = on.by
        self._force(on, -(self.coordinates[of][1] * acceleration))

    def _friction(
        self, on: Row, level: Any = None, *, forward: Any = None, backward: Any = None, at_rest: Any = None,
        where: str = "both", **_: Any,
    ) -> None:  # fmt: skip
        (of,), slides = on.by, (level, level) if level is not None else (forward, backward)
        rests = slides if at_rest is None else at_rest if isinstance(at_rest, tuple) else (at_rest, at_rest)
        if where != "flight":
            self.friction[of] = slides, rests

    def _stop(self, on: Row, low: Any = None, high: Any = None, *_: Any) -> None:
        (of,) = on.by
        self.stops[of] = -math.inf if low is None else low, math.inf if high is None else high

    def _contact(self, leg: Any, impact_loss: Any = 0, *_: Any) -> None:
        self.stands = True

    def _law(self, of: Row, on: Row, *, proportional: Any, derivative: Any = 0, **_: Any) -> None:
        self.law = proportional, derivative

    def _include(self, name: str) -> SimpleNamespace:
        return SimpleNamespace(**run(SHIPPED / f"{name}.py", self.words()))

    # ---- Newton's law ----

    def along(self, on: Row) -> list[Any]:
        """By how much a row goes with each coordinate that moves."""
        return [on.by.get(name, 0) for name in self.moving]

    def in_leg(self, on: Row) -> bool:
        """Whether it acts on both masses, and so is what the leg carries."""
        return all(each in on.by for each in self.moving)


def run(file: Path, words: dict[str, Any]) -> dict[str, Any]:
    text = file.read_text("utf-8").replace("from hopform.model import *", "")
    exec(compile(text, str(file), "exec"), words)  # noqa: S102
    return words


def elements(file: Path, robot: Mapping[str, float]) -> Elements:
    """With the numbers of a robot."""
    made = Elements(robot)
    run(file, made.words())
    return made


def mechanism(file: Path, robot: Mapping[str, float]) -> Mechanism:
    """With numbers, for the integrator; under a law u is its target."""
    of = elements(file, robot)
    count = len(of.moving)
    K, B, f, g = np.zeros((count, count)), np.zeros((count, count)), np.zeros(count), np.zeros(count)
    n_q, n_v, n_0 = np.zeros(count), np.zeros(count), 0.0  # of the contact force, which lifts the last mass
    for on, stiffness in of.springs:
        by = np.array(of.along(on), float)
        K += stiffness * np.outer(by, by)
        f -= stiffness * on.by.get("", 0.0) * by
        if of.in_leg(on):
            n_q, n_0 = n_q - stiffness * by[-1] * by, n_0 - stiffness * by[-1] * on.by.get("", 0.0)
    for on, damping in of.dampers:
        by = np.array(of.along(on), float)
        B += damping * np.outer(by, by)
        n_v = n_v - damping * by[-1] * by * of.in_leg(on)
    for name, force in of.forces:
        f[of.moving.index(name)] += force.by.get("", 0.0)
        g[of.moving.index(name)] += force.by.get(of.input, 0.0)
    p, d = of.law or (0.0, 0.0)
    most = float(of.limit) if of.law else math.inf

    def asked(q: Array, v: Array, target: float) -> float:
        return float((p * (target - q[0]) - d * v[0]) / g[0])

    def free(q: Array, v: Array, u: float) -> Array:
        current = np.clip(asked(q, v, u), -most, most) if of.law else u
        return f + g * current - K @ q - B @ v

    never, none = (-math.inf, math.inf), ((0.0, 0.0), None)
    masses = tuple(
        Mass(name, float(of.coordinates[name][1]), *of.friction.get(name, none), *of.stops.get(name, never))
        for name in of.moving
    )
    ends = (-most, most) if most < math.inf else ()
    kinks = tuple(lambda q, v, u, end=end: asked(q, v, u) - end for end in ends)
    return Mechanism(masses, free, (lambda q, v: float(n_q @ q + n_v @ v + n_0)) if of.stands else None, kinks)
