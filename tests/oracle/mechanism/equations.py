"""The equations of a mechanism and one problem of it, read from JSON.

M q'' = -K q - B q' + f + g u - sum_e c_e F_e(c_e . q') + constraint forces of what is held
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from .numbers import Matrix, Number, Real, Vector, exact, formula, inverse, magnitude, mp, plus, total

Steps = tuple[tuple[Real, Real], ...]


@dataclass(frozen=True)
class Row:
    """A linear function of the state: q . position + v . velocity + constant."""

    q: Vector
    v: Vector
    constant: Real

    def at(self, q: Vector, v: Vector) -> Real:
        return total(*self.terms(q, v))

    def size(self, q: Vector, v: Vector) -> Real:
        """The sum of the magnitudes of its terms."""
        return mp.fsum(self.terms(q, v), absolute=True)

    def terms(self, q: Vector, v: Vector) -> list[Real]:
        both = [a * b for a, b in zip((*self.q, *self.v), (*q, *v), strict=True) if a and b]
        return [*both, self.constant]


@dataclass(frozen=True)
class Element:
    """Dry friction -plus or +minus along a direction, held between those at rest; inelastic limits of the displacement."""

    name: str
    direction: Vector
    plus: Real
    minus: Real
    rest_plus: Real
    rest_minus: Real
    low: Real
    high: Real

    def level(self, sign: int) -> Real:
        return self.rest_plus if sign > 0 else self.rest_minus

    def friction(self, sign: int) -> Real:
        """The force along the direction while it slips that way, as it enters the equation."""
        return -self.plus if sign > 0 else self.minus if sign < 0 else mp.zero

    def limit(self, sign: int) -> Real:
        return self.high if sign > 0 else self.low


@dataclass(frozen=True)
class Contact:
    """The contact force N, which ends the stance where it falls through zero, and the compression y."""

    force: Row
    compression: Row
    tolerance: Real


@dataclass(frozen=True)
class Law:
    """Input sat(row + target u), within -limit and limit; u are the steps of the problem."""

    row: Row
    limit: Real
    target: Real


@dataclass(frozen=True)
class Energy:
    """v M v/2 + q K q/2 - f q."""

    mass: Matrix
    stiffness: Matrix
    force: Vector

    def at(self, q: Vector, v: Vector) -> Real:
        kinetic = mp.fsum(v[i] * self.mass[i][j] * v[j] for i in range(len(v)) for j in range(len(v)))
        elastic = mp.fsum(q[i] * self.stiffness[i][j] * q[j] for i in range(len(q)) for j in range(len(q)))
        return (kinetic + elastic) / 2 - mp.fdot(self.force, q)


@dataclass(frozen=True)
class System:
    """The equations with numbers in them; matrices and columns by name, and their sums."""

    mass: Matrix
    springs: Mapping[str, Matrix]
    dampers: Mapping[str, Matrix]
    forces: Mapping[str, Vector]
    input: Vector
    elements: tuple[Element, ...]
    contact: Contact | None
    clearance: Row | None
    law: Law | None
    outputs: Mapping[str, Row]
    energies: Mapping[str, Energy]
    units: Mapping[str, Real]
    position: Vector
    velocity: Vector
    horizon: Real

    @cached_property
    def size(self) -> int:
        return len(self.mass)

    @cached_property
    def mobility(self) -> Matrix:
        return inverse(self.mass)

    @cached_property
    def stiffness(self) -> Matrix:
        return plus(zeros(self.size), *self.springs.values())

    @cached_property
    def damping(self) -> Matrix:
        return plus(zeros(self.size), *self.dampers.values())

    @cached_property
    def force(self) -> Vector:
        return tuple(total(mp.zero, *entries) for entries in zip(*self.forces.values(), strict=True))

    @cached_property
    def energy(self) -> Energy:
        """Kinetic and potential energy of everything."""
        return Energy(self.mass, self.stiffness, self.force)

    def force_size(self, q: Vector, v: Vector, u: Real) -> Vector:
        """How large the terms of the force on each coordinate are."""
        return tuple(
            magnitude(self.stiffness[i], q)
            + magnitude(self.damping[i], v)
            + mp.fsum((column[i] for column in self.forces.values()), absolute=True)
            + abs(self.input[i] * u)
            for i in range(self.size)
        )


def zeros(size: int) -> Matrix:
    return ((mp.zero,) * size,) * size


@dataclass(frozen=True)
class Problem:
    """Equations in text, and the numbers that go into them: parameters, start, current."""

    equations: Mapping[str, Any]
    parameters: Mapping[str, Real]
    start: Mapping[str, Real]
    steps: Steps
    horizon: Real
    max_phases: int

    @property
    def name(self) -> str:
        return str(self.equations["name"])

    def inputs(self) -> dict[str, Real]:
        """Everything that is given in float64: parameters, start, currents u[0], u[1], ..."""
        return {**self.parameters, **self.start, **{f"u[{n}]": u for n, (_, u) in enumerate(self.steps)}}

    def moved(self, inputs: Mapping[str, Real]) -> Problem:
        """The problem with other inputs; those not named stay."""
        unknown = set(inputs) - set(self.inputs())
        if unknown:
            raise ValueError(f"unknown inputs {sorted(unknown)}, known are {sorted(self.inputs())}")
        new = {name: exact(value) for name, value in inputs.items()}
        return replace(
            self,
            parameters={name: new.get(name, q) for name, q in self.parameters.items()},
            start={name: new.get(name, q) for name, q in self.start.items()},
            steps=tuple((t, new.get(f"u[{n}]", u)) for n, (t, u) in enumerate(self.steps)),
        )

    def groups(self) -> list[tuple[str, ...]]:
        """Inputs that can be moved, each alone or with those that it equals and is tied to; zeros stay zero."""
        values = {name: q for name, q in self.inputs().items() if q and mp.isfinite(q)}
        ties = [frozenset(names) for names in self.equations.get("tied", ())]

        def equals(name: str) -> tuple[str, ...]:
            return tuple(
                other
                for other in values
                if other == name or (values[other] == values[name] and any({name, other} <= tie for tie in ties))
            )

        return list(dict.fromkeys(equals(name) for name in values))

    @cached_property
    def system(self) -> System:
        return system_of(self)


def read(source: Mapping[str, Any] | str | Path) -> Problem:
    """The problem of a JSON object, or of the file that holds it. Raises ValueError for steps that do not rise from 0.

    >>> from tests.oracle.mechanism import builders
    >>> read(builders.joint(m="1", k="4", v="1")).inputs()["k"]
    mpf('4.0')
    """
    text: Mapping[str, Any] = json.loads(Path(source).read_text("utf-8")) if isinstance(source, str | Path) else source
    found = parsed_steps(text.get("u", 0))
    if found[0][0] != 0 or any(a[0] >= b[0] for a, b in zip(found, found[1:], strict=False)):
        raise ValueError(f"steps of u must start at t = 0 and rise, got {text['u']}")
    return Problem(
        text,
        {name: exact(value) for name, value in text["parameters"].items()},
        {name: exact(value) for name, value in text["start"].items()},
        found,
        exact(text.get("horizon", 2)),
        int(text.get("max_phases", 4096)),
    )


def parsed_steps(u: Any) -> Steps:
    """A number, or steps [[t0, u0], ...]."""
    if isinstance(u, str) or not hasattr(u, "__len__"):
        return ((mp.zero, exact(u)),)
    return tuple((exact(t), exact(value)) for t, value in u)


def system_of(problem: Problem) -> System:
    """The equations with the problem's numbers in them."""
    text, values = problem.equations, {**problem.parameters, **problem.start}
    size = len(text["coordinates"])

    def vector(entries: Sequence[Number]) -> Vector:
        if len(entries) != size:
            raise ValueError(f"{problem.name}: {entries} has not {size} entries")
        return tuple(formula(entry, values) for entry in entries)

    def matrix(rows: Sequence[Sequence[Number]]) -> Matrix:
        return tuple(vector(row) for row in rows)

    def row(entry: Mapping[str, Any]) -> Row:
        none = [0] * size
        return Row(
            vector(entry.get("q", none)), vector(entry.get("v", none)), formula(entry.get("constant", 0), values)
        )

    def named(entry: Any, kind: str) -> dict[str, Any]:
        return {**entry} if isinstance(entry, Mapping) else {kind: entry}

    none = [0] * size
    contact, law, clearance = text.get("contact"), text.get("law"), text.get("clearance")
    return System(
        mass=matrix(text["mass"]),
        springs={name: matrix(rows) for name, rows in named(text.get("stiffness", {}), "springs").items()},
        dampers={name: matrix(rows) for name, rows in named(text.get("damping", {}), "dampers").items()},
        forces={name: vector(column) for name, column in named(text.get("force", none), "forces").items()},
        input=vector(text.get("input", none)),
        elements=tuple(element(entry, vector, values) for entry in text.get("elements", ())),
        contact=contact
        and Contact(row(contact["force"]), row(contact["compression"]), formula(contact.get("tolerance", 0), values)),
        clearance=clearance and row(clearance),
        law=law and Law(row(law), formula(law["limit"], values), formula(law.get("target", 0), values)),
        outputs={name: row(entry) for name, entry in text.get("outputs", {}).items()},
        energies={
            name: Energy(matrix(entry["mass"]), matrix(entry["stiffness"]), vector(entry["force"]))
            for name, entry in text.get("energies", {}).items()
        },
        units={name: formula(entry, values) for name, entry in text.get("units", {}).items()},
        position=vector(text["position"]),
        velocity=vector(text["velocity"]),
        horizon=problem.horizon,
    )


def element(entry: Mapping[str, Any], vector: Any, values: Mapping[str, Real]) -> Element:
    levels = [formula(level, values) for level in entry.get("friction", (0, 0))]
    rests = [formula(level, values) for level in entry.get("at_rest", entry.get("friction", (0, 0)))]
    limits = [formula(limit, values) for limit in entry.get("limits", ("-inf", "inf"))]
    if any(rest < level or level < 0 for rest, level in zip(rests, levels, strict=True)) or limits[0] > limits[1]:
        name = entry["name"]
        raise ValueError(
            f"element {name}: 0 <= {levels} <= {rests} must hold of friction, and limits {limits} must rise"
        )
    return Element(entry["name"], vector(entry["direction"]), *levels, *rests, *limits)
