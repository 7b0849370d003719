"""Equations of motion of a mechanism in stance, (1)-(4): the only place that has any.

From the Lagrangian of two masses and one spring, with the current, the offset force and friction
as generalised forces:

    m_eff a_1 = -k (x_1 - x_2 + L_0 + c) + k c - b_1 v_1 - gamma_2 u - m_eff f_1 sign(v_1)      (3)
    m_s   a_2 =  k (x_1 - x_2 + L_0 + c) - m_s g - b_2 v_2 - m_s f_2 sign(v_2)                  (4)

Over a gear the spring is compressed by ratio x_1 - x_2 + L_0 + c, and pulls at x_1 with ratio times its force.
(1), (2) are their case f_1 = f_2 = 0. The letters are those of the derivation; what each is in the parameters of a
model, and which forces it has beside these, mechanism.py finds out from the elements of the model's file.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import sympy as sp

from ..ir import Own, Quantity, Record, Step, divisors
from .quantities import *


class ModelError(ValueError):
    """A mechanism that the closed form cannot carry, or a file that is no model; `line` of the file, where one is at
    fault.
    """

    def __init__(self, message: str = "", line: int | None = None) -> None:
        super().__init__(message)
        self.line = line


@dataclass(frozen=True)
class Force:
    """A further force on each mass, linear in v1, v2, x1, x2 or constant.

    Equal and opposite forces act in the leg, beside the spring: they are part of its contact force, and the massless
    foot ends them at take-off. Any other force acts in stance and in flight, or where `acts` says: "stance", "flight".
    """

    name: str
    force_1: sp.Expr
    force_2: sp.Expr
    meaning: str = "a further force"
    acts: str = "both"

    @property
    def is_in_leg(self) -> bool:
        return bool(self.force_2 != 0 and sp.expand(self.force_1 + self.force_2) == 0)

    def force_in(self, where: str) -> tuple[sp.Expr, sp.Expr]:
        """The forces in "stance" or "flight"."""
        here = where == "stance" if self.is_in_leg else self.acts in ("both", where)
        return (sp.sympify(self.force_1), sp.sympify(self.force_2)) if here else (sp.S.Zero, sp.S.Zero)


EXCESSES = ((f1_excess, f1_excess_minus), (f2_excess, f2_excess_minus))
"""Of each mass friction at rest less that in motion, to v_i > 0 and to v_i < 0."""
MASSES = {"actuator": (m_eff, f1, f1_minus, side_1), "body": (m_s, f2, f2_minus, side_2)}
"""Of each mass the inertia, Coulomb friction over it where the velocity is above 0 and below 0, the velocity's sign."""

LETTER_OF_ENTRY = {motor_work: gamma2, offset_work: c, viscous_1: b1, viscous_2: b2, coulomb_1: f1, coulomb_2: f2}
"""The letter of what does the work of an entry of the ledger."""


@dataclass(frozen=True)
class Named:
    """What a model calls a mass: the coordinate, its unit, its velocity, the thing that moves, its two directions, and the
    coordinate in LaTeX.
    """

    coordinate: str
    velocity: str
    unit: str
    thing: str
    directions: tuple[str, str]
    meaning: str
    glyph: str


@dataclass(frozen=True)
class Input:
    """What a model calls its input, in words and in LaTeX, and in which unit it is."""

    name: str = "u"
    unit: str = "A"
    thing: str = "motor"
    meaning: str = "current"
    glyph: str = "u"


@dataclass(frozen=True)
class Law:
    """What a law sets: the current under its name, and whether a positive one pulls along x_1, 1, or against it, -1.

    The input of the model is the law's target, in the place of this current.
    """

    current: Input
    along: int


@dataclass(frozen=True)
class Listed:
    """An element as a file declares it: kind, name, the parameters that it reads, entries of the ledger by label."""

    kind: str
    name: str
    parameters: frozenset[str] = frozenset()
    meaning: str = ""


@dataclass(frozen=True)
class Model:
    """A mechanism in the letters of the derivation.

    parameters: those that its file declares. constants: what each letter is in them. sources: the element that a
    constant comes from, of the letters that the file declares; the others stand for nothing. elements: the names of the
    elements that a letter stands for. further: forces that no letter stands for. has_contact: whether a leg stands on the ground, which it pushes and cannot pull. moves_alone:
    whether mass 1 alone moves, so that x_2 = 0 for ever. by_sign: whether the Coulomb friction of each mass differs by
    the sign of its velocity. It is the mean of its two levels with that sign, and half their difference as a constant
    force. Friction at rest differs by sign, too. rest_may_lack: whether a robot may give friction at rest a level below
    that in motion. law: what sets the current, if `input` is a target. The letter u is the input of a mode: under the
    law the target, at a limit of the current this limit. weights: the weight of each mass [N] whose coordinate is its
    height at all times, which is potential energy: of both without a contact, else of the body, m_s g.

    names: of both masses, None for one that is none of the file's. name, title: what its solver is called, and is in a
    line. text: the file.
    """

    parameters: tuple[Quantity, ...]
    constants: Mapping[sp.Symbol, sp.Expr] = field(hash=False)
    names: tuple[Named | None, Named | None]
    input: Input | None = None
    further: tuple[Force, ...] = ()
    has_contact: bool = True
    moves_alone: bool = False
    by_sign: tuple[bool, bool] = (False, False)
    rest_may_lack: bool = False
    law: Law | None = None
    weights: tuple[sp.Expr, sp.Expr] = (sp.S.Zero, sp.S.Zero)
    sources: Mapping[sp.Symbol, str] = field(default_factory=dict, hash=False)
    elements: Mapping[sp.Symbol, tuple[str, ...]] = field(default_factory=dict, hash=False)
    listed: tuple[Listed, ...] = ()
    name: str = "hopper"
    title: str = ""
    text: str = field(default="", repr=False, compare=False)

    def declares(self, letter: sp.Symbol) -> bool:
        """Whether an element of the file has given a letter its value, be that a number or 0 itself."""
        return letter in self.sources

    def called(self, letter: sp.Symbol) -> tuple[str, ...]:
        """The names of the elements that a letter stands for, as the file declares them."""
        return self.elements.get(letter, ())

    @cached_property
    def is_of_the_paper(self) -> bool:
        """Whether its equations of motion are (3), (4) in the paper's parameters: each letter is a parameter of its own name,
        and no force is further.
        """
        return (
            not self.further
            and not self.is_geared
            and not any(self.by_sign)
            and self.has_contact
            and all(
                isinstance(value := self.constants[letter], Own) and value.name == letter.name
                for letter in LETTERS
                if letter not in (*BY_SIGN, *OF_LAW, *OF_GEAR)
            )
        )

    @property
    def driven_by(self) -> Input | None:
        """What the letter u is in the equations of motion: the input, or the current that a law sets; None without any."""
        return self.input if self.law is None else self.law.current

    def has_entry(self, entry: sp.Symbol) -> bool:
        """Whether something that the file declares does the work of an entry of the ledger."""
        if entry == motor_work:
            return self.input is not None
        if entry == spring_work:
            return len(self.moving) == 2
        return entry not in LETTER_OF_ENTRY or self.declares(LETTER_OF_ENTRY[entry])

    @property
    def moving(self) -> tuple[int, ...]:
        """The masses that the file has: 1, 2, or both."""
        return tuple(n for n, own in enumerate(self.names, 1) if own is not None)

    @property
    def both_move(self) -> bool:
        """Whether both masses move."""
        return len(self.moving) == 2

    @property
    def has_stops(self) -> bool:
        """Whether the first mass has a stop at either end."""
        return self.declares(x1_min) or self.declares(x1_max)

    @property
    def has_friction(self) -> tuple[bool, bool]:
        """Of each mass whether Coulomb friction is declared."""
        return self.declares(f1), self.declares(f2)

    @property
    def still(self) -> dict[sp.Symbol, sp.Expr]:
        """Positions and velocities of the mass that the file does not have: 0 for ever."""
        state = ((x1, v1), (x2, v2))
        return {
            symbol: sp.S.Zero
            for own, symbols in zip(self.names, state, strict=True)
            if own is None
            for symbol in symbols
        }

    @property
    def is_geared(self) -> bool:
        """Whether the spring stretches by another length than that by which the first mass moves."""
        return self.declares(ratio)

    @property
    def ratio(self) -> sp.Expr:
        """By how much the compression changes per x_1: 1, or the ratio of a gear or a rope."""
        return ratio if self.is_geared else sp.S.One

    @property
    def rate_of_gear(self) -> sp.Expr:
        """The same among the rates of a robot."""
        return y_v1 if self.is_geared else sp.S.One

    @property
    def compression(self) -> sp.Expr:
        """That of the spring, by the positions."""
        return self.ratio * x1 - x2 + L0 + c

    @property
    def has_law(self) -> bool:
        """Whether a law sets the input."""
        return self.law is not None

    @property
    def robot(self) -> Record:
        """The parameters as a record."""
        return replace(ROBOT, quantities=self.parameters)

    def unit(self, unit: str, name: str = "") -> str:
        """A unit of what moves along a line under a current in A as that of what the coordinates and the input of the model
        are. name: of the quantity, by which it belongs to one of two masses, if one turns and the other does not.
        """
        units = {"A": "1" if self.driven_by is None else self.driven_by.unit}
        lengths = [own.unit for own in self.names if own is not None]
        length = lengths[_mass_of(name) - 1] if len({*lengths}) == 2 else lengths[0]
        if len({*lengths}) == 2 and name in _PER:
            above, below = (lengths[n - 1] for n in _PER[name])
            return f"{above}/{below}{unit.removeprefix('1')}"
        if len({*lengths}) == 2 and name in _OF_BOTH:
            unit = unit.replace("m^2", f"{lengths[0]} {lengths[1]}")
            return unit
        if length == "rad":
            units |= {"kg": "kg m^2", "m": "rad", "N": "N m"}

        def own(match: re.Match[str]) -> str:
            below, factor = match[1], units[match[2]]
            return f"{below}({factor})" if below and re.search(r"[ /]", factor) else f"{below}{factor}"

        return re.sub(rf"(/?)\b({'|'.join(units)})\b", own, unit).replace("/1", "")

    def value(self, expression: sp.Expr) -> sp.Expr:
        """An expression in letters by the parameters."""
        return sp.sympify(expression).xreplace(dict(self.constants))

    def in_parameters(self, steps: Iterable[Step]) -> tuple[Step, ...]:
        """Steps in letters as steps in the parameters: a letter that is an expression is computed first, once. What never
        moves has the position and velocity 0.
        """
        still = self.still
        steps = tuple(replace(step, value=sp.sympify(step.value).xreplace(still)) for step in steps)
        read = {symbol for step in steps for symbol in step.value.free_symbols} - {step.symbol for step in steps}
        plain = {letter: value for letter, value in self.constants.items() if value.is_Symbol or value.is_number}
        below = {letter for step in steps for letter in divisors(step.value) if plain.get(letter) == 0}
        plain = {letter: value for letter, value in plain.items() if letter not in below}
        first = (
            Step(letter, value, self.sources.get(letter, "model"))
            for letter, value in self.constants.items()
            if letter in read and letter not in plain
        )
        return (*first, *(replace(step, value=step.value.xreplace(plain)) for step in steps))

    @cached_property
    def levels(self) -> tuple[sp.Expr, sp.Expr]:
        """The friction of each mass that slips, where it differs by sign its mean, [m/s^2]."""
        first, second = ((f + self._backward(n)) / 2 for n, (_, f, _, _) in enumerate(MASSES.values()))
        return first, second

    @cached_property
    def excesses(self) -> tuple[tuple[sp.Expr, sp.Expr], ...]:
        """Friction at rest less that in motion of each mass, where it would slip upwards and downwards, [m/s^2].

        A mass at rest is held while its free acceleration lies between -(level + excess downwards) and
        level + excess upwards; that has the constant part of `friction`.
        """
        return tuple((up, down if by_sign else up) for (up, down), by_sign in zip(EXCESSES, self.by_sign, strict=True))

    @cached_property
    def friction(self) -> tuple[sp.Expr, sp.Expr]:
        """The force of Coulomb friction on each mass that slips, [N]; with a side of 0 its constant part."""
        first, second = (
            -mass * (level * side + (f - self._backward(n)) / 2)
            for n, ((mass, f, _, side), level) in enumerate(zip(MASSES.values(), self.levels, strict=True))
        )
        return first, second

    def _backward(self, n: int) -> sp.Expr:
        _, f, f_minus, _ = tuple(MASSES.values())[n]
        return f_minus if self.by_sign[n] else f

    @cached_property
    def forces(self) -> tuple[sp.Expr, sp.Expr]:
        """Generalised forces in stance beside the Lagrangian: current, offset, friction, further forces, [N]."""
        actuator, body = self._forces_in("stance")
        return actuator, body - b2 * v2 + self.friction[1]

    def _forces_in(self, where: str) -> tuple[sp.Expr, sp.Expr]:
        """The forces that "stance" and "flight" share: all on the actuator, further forces on the body, [N]."""
        actuator = k * c - gamma2 * u - b1 * v1 + self.friction[0]
        further = (force.force_in(where) for force in self.further)
        actuator, body = map(sum, zip((actuator, sp.S.Zero), *further, strict=True))
        return actuator, body

    @cached_property
    def _in_leg(self) -> sp.Expr:
        """What the terms in the leg carry beside its spring, in the compression y of that, v1 and v2, [N]."""
        leg = sum((sp.sympify(force.force_2) for force in self.further if force.is_in_leg), sp.S.Zero)
        return sp.expand(leg.subs(x1, y + x2 - L0 - c))

    @cached_property
    def stiffness(self) -> sp.Expr:
        """What the leg carries per compression, [N/m]: k, and that of further springs in it.

        Without a contact nothing asks for it.
        """
        return k if not self.has_contact else k + self._in_leg.diff(y)

    @cached_property
    def rest(self) -> sp.Expr:
        """The compression of the spring at the free length of the leg, [m]: y counts from there."""
        if not self.has_contact:
            return sp.S.Zero
        return sp.factor(-self._in_leg.subs({y: 0, v1: 0, v2: 0}) / self.stiffness)  # lengths cancel before products

    @cached_property
    def length(self) -> sp.Expr:
        """The free length of the leg, [m]: x_2 = x_1 - y + length, and hop heights count from it."""
        return L0 + c - self.rest

    @cached_property
    def contact(self) -> sp.Expr:
        """The contact force over the leg's stiffness, in y, v1, v2, [m]: y itself where no damper acts in the leg."""
        if not self.has_contact:
            return y
        return y + sp.factor(sum(self._in_leg.diff(v) * v for v in (v1, v2))) / self.stiffness

    @cached_property
    def in_flight(self) -> tuple[sp.Expr, sp.Expr]:
        """The accelerations in flight, where the contact force is 0, in v1 and u; that of the body is constant. Without
        a contact nothing flies.
        """
        actuator, body = self._forces_in("flight")
        return sp.expand(actuator / m_eff), sp.expand((body if self.has_contact else 0) / m_s - g)

    @property
    def fall(self) -> sp.Expr:
        """How fast the body falls in flight: by its weight, and by what further forces pull at it, [m/s^2]."""
        return -self.in_flight[1]

    @cached_property
    def potential(self) -> sp.Expr:
        """The potential energy of weights and of the spring, [J]."""
        return self.weights[0] * x1 + self.weights[1] * x2 + k * self.compression**2 / 2

    @cached_property
    def lagrangian(self) -> sp.Expr:
        """Kinetic less potential energy, [J]."""
        return kinetic - self.potential

    @cached_property
    def accelerations(self) -> tuple[sp.Expr, sp.Expr]:
        """(3), (4) with sign(v_i) written as side_i, in x1, x2, v1, v2."""
        return tuple(
            sp.expand((self.lagrangian.diff(coordinate) + force) / mass)
            for mass, coordinate, force in zip((m_eff, m_s), (x1, x2), self.forces, strict=True)
        )

    @cached_property
    def in_compression(self) -> tuple[sp.Expr, sp.Expr]:
        """The accelerations in y, v1, v2: translation invariance leaves no other coordinate. What does not move has none."""
        return self.following(sp.S.Zero)

    @property
    def pull(self) -> sp.Expr:
        """The force of the motor under the law, whose target is u, [N]."""
        return K_p * (u - x1) - K_d * v1

    def following(self, share: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
        """`in_compression` with a share of the force that the law asks for, and the rest under a current u."""
        accelerations = self.accelerations
        if share != 0:
            asked = (1 - share) * u - share * self.pull / gamma2
            accelerations = tuple(sp.expand(acc.subs(u, asked)) for acc in accelerations)
        first, second = (
            sp.S.Zero if own is None else self._by_compression(acc)
            for own, acc in zip(self.names, accelerations, strict=True)
        )
        return first, second

    def _by_y(self) -> sp.Expr:
        """The position of the first mass that the file has, by the compression and that of the other one."""
        return self.length - y if x1 in self.still else (y + self.still.get(x2, x2) - self.length) / self.ratio

    def _by_compression(self, value: sp.Expr) -> sp.Expr:
        """What is linear in x1 - x2, v1, v2 by y in its place: lengths cancel where y counts from rest."""
        still = self.still
        by_y = sp.expand(value.subs(still).subs(x2 if x1 in still else x1, self._by_y()))
        if self.rest == 0:
            return by_y
        slopes = (sp.expand(by_y.diff(v)) * v for v in (y, v1, v2))
        return sp.expand(sum(slopes, sp.expand(sp.cancel(by_y.subs({y: 0, v1: 0, v2: 0})))))


_PER = {"a1_y": (1, 2), "a1_v2": (1, 2), "a2_v1": (2, 1), "y_v1": (2, 1), "drift_2": (2, 1)}
"""Of rates the mass that accelerates, and that by whose motion."""
_OF_BOTH = ("int_v1v2", "int_yv1")
"""What has a factor of either mass."""


def _mass_of(name: str) -> int:
    """The mass that a quantity belongs to, by its name; the compression counts as the second one."""
    name = name.rstrip("@").removeprefix("d_").removeprefix("int_")
    first = name.startswith(("x1", "v1", "X1", "a1_")) or name.endswith(("_1", "_hat")) or name in ("lambda_2", "Z")
    return 1 if first else 2


kinetic = (m_eff * v1**2 + m_s * v2**2) / 2
