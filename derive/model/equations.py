"""Equations of motion of the hopper in stance, (1)-(4): the only place that has any.

From the Lagrangian of two masses and one spring, with the current, the offset force and friction
as generalised forces:

    m_eff a_1 = -k (x_1 - x_2 + L_0 + c) + k c - b_1 v_1 - gamma_2 u - m_eff f_1 sign(v_1)      (3)
    m_s   a_2 =  k (x_1 - x_2 + L_0 + c) - m_s g - b_2 v_2 - m_s f_2 sign(v_2)                  (4)

(1), (2) are their case f_1 = f_2 = 0. A robot with further terms is a `Model` with `terms`; the
generator reads them from a file (model_file.py).
"""

from dataclasses import dataclass, replace
from functools import cached_property

import sympy as sp

from ..ir import Quantity, Record
from .quantities import *


@dataclass(frozen=True)
class Term:
    """A further force on each mass, linear in v1, v2, x1 - x2 or constant, [N].

    Equal and opposite forces act in the leg, beside the spring: they are part of its contact force, and the massless
    foot ends them at take-off. Any other force acts in stance and in flight, or where `acts` says: "stance", "flight".
    """

    name: str
    force_1: sp.Expr
    force_2: sp.Expr
    meaning: str = "a further term"
    acts: str = "both"

    @property
    def is_in_leg(self) -> bool:
        return bool(self.force_2 != 0 and sp.expand(self.force_1 + self.force_2) == 0)

    def force_in(self, where: str) -> tuple[sp.Expr, sp.Expr]:
        """The forces in "stance" or "flight"."""
        here = where == "stance" if self.is_in_leg else self.acts in ("both", where)
        return (sp.sympify(self.force_1), sp.sympify(self.force_2)) if here else (sp.S.Zero, sp.S.Zero)


class ModelError(ValueError):
    """A term that the closed form cannot carry, or a file that is no model."""


FIXED = ("foot", "body")
MASSES = {"actuator": (m_eff, f1, side_1), "body": (m_s, f2, side_2)}
"""The mass, its Coulomb friction and the sign of its velocity."""
FALLING = {
    name: Quantity(f"f{n}_minus", f"f_{{{n}-}}", "m/s^2", f"f{n} where v{n} < 0", "nonnegative", 0.0)
    for n, name in enumerate(MASSES, 1)
}
"""Where friction differs by sign, that of a velocity below 0; f1 and f2 are those of a velocity above 0."""
EXCESS = {
    name: (
        excess,
        Quantity(
            f"{excess}_minus",
            f"f_{{{n}e-}}",
            "m/s^2",
            f"{excess} towards a v{n} < 0, over f{n}_minus",
            "nonnegative",
            0.0,
        ),
    )
    for n, (name, excess) in enumerate(zip(MASSES, (f1_excess, f2_excess), strict=True), 1)
}
"""Friction at rest less that in motion, and where friction differs by sign that of a mass that would slip downwards."""


@dataclass(frozen=True)
class Model:
    """The hopper with further terms and the parameters that they bring.

    fixed: what is bolted to the ground, of FIXED. With a fixed foot the leg pulls as well as it pushes, and there is no
    take-off; with a fixed body the actuator moves alone, a mass on a spring to the ground.

    friction_by_sign: the masses, of MASSES, whose Coulomb friction differs by the sign of their velocity. It is the
    mean of its two levels with that sign, and half their difference as a constant force. Friction at rest differs by
    sign, too.

    name, title: what its solver is called, and is in a line.
    """

    terms: tuple[Term, ...] = ()
    parameters: tuple[Quantity, ...] = ()
    fixed: tuple[str, ...] = ()
    friction_by_sign: tuple[str, ...] = ()
    name: str = "hopper"
    title: str = "A series-elastic hopper with viscous and Coulomb friction."

    def __post_init__(self) -> None:
        for name, allowed in (("fixed", FIXED), ("friction_by_sign", tuple(MASSES))):
            if not set(given := getattr(self, name)) <= set(allowed):
                raise ModelError(f"`{name}` must be a tuple of {' and '.join(map(repr, allowed))}, got {given!r}")
        for term in self.terms:
            _refuse_what_the_closed_form_cannot_carry(term)

    @property
    def robot(self) -> Record:
        own = ROBOT.quantities
        if "foot" in self.fixed:  # no contact force is taken over k
            own = tuple(replace(each, domain="nonnegative") if each.symbol == k else each for each in own)
        by_sign = (name for name in MASSES if name in self.friction_by_sign)
        falling = tuple(quantity for name in by_sign for quantity in (FALLING[name], EXCESS[name][1]))
        return replace(ROBOT, quantities=own + falling + self.parameters)

    @cached_property
    def levels(self) -> tuple[sp.Expr, sp.Expr]:
        """The friction of each mass that slips, where it differs by sign its mean, [m/s^2]."""
        return tuple((f + self._falling(name)) / 2 for name, (_, f, _) in MASSES.items())

    @cached_property
    def excesses(self) -> tuple[tuple[sp.Expr, sp.Expr], ...]:
        """Friction at rest less that in motion of each mass, where it would slip upwards and downwards, [m/s^2].

        A mass at rest is held while its free acceleration lies between -(level + excess downwards) and
        level + excess upwards; that has the constant part of `friction`.
        """
        return tuple(
            (excess, falling.symbol if name in self.friction_by_sign else excess)
            for name, (excess, falling) in EXCESS.items()
        )

    @cached_property
    def friction(self) -> tuple[sp.Expr, sp.Expr]:
        """The force of Coulomb friction on each mass that slips, [N]; with a side of 0 its constant part."""
        return tuple(
            -mass * (level * side + (f - self._falling(name)) / 2)
            for (name, (mass, f, side)), level in zip(MASSES.items(), self.levels, strict=True)
        )

    def _falling(self, name: str) -> sp.Expr:
        return FALLING[name].symbol if name in self.friction_by_sign else MASSES[name][1]

    @cached_property
    def forces(self) -> tuple[sp.Expr, sp.Expr]:
        """Generalised forces in stance beside the Lagrangian: current, offset, friction, further terms, [N]."""
        actuator, body = self._forces_in("stance")
        return actuator, body - b2 * v2 + self.friction[1]

    def _forces_in(self, where: str) -> tuple[sp.Expr, sp.Expr]:
        """The forces that "stance" and "flight" share: all on the actuator, further terms on the body, [N]."""
        actuator = k * c - gamma2 * u - b1 * v1 + self.friction[0]
        further = (term.force_in(where) for term in self.terms)
        actuator, body = map(sum, zip((actuator, sp.S.Zero), *further, strict=True))
        return actuator, body

    @cached_property
    def _in_leg(self) -> sp.Expr:
        """What the terms in the leg carry beside its spring, in the compression y of that, v1 and v2, [N]."""
        leg = sum((sp.sympify(term.force_2) for term in self.terms if term.is_in_leg), sp.S.Zero)
        return sp.expand(leg.subs(x1, y + x2 - L0 - c))

    @cached_property
    def stiffness(self) -> sp.Expr:
        """What the leg carries per compression, [N/m]: k, and that of further springs in it.

        A foot that is bolted to the ground carries whatever there is: nothing asks for it.
        """
        return k if "foot" in self.fixed else k + self._in_leg.diff(y)

    @cached_property
    def rest(self) -> sp.Expr:
        """The compression of the spring at which the leg at rest carries nothing, [m]: y counts from there."""
        if "foot" in self.fixed:
            return sp.S.Zero
        return sp.factor(-self._in_leg.subs({y: 0, v1: 0, v2: 0}) / self.stiffness)  # lengths cancel before products

    @cached_property
    def length(self) -> sp.Expr:
        """The length of the leg that carries nothing, [m]: x_2 = x_1 - y + length, and hop heights count from it."""
        return L0 + c - self.rest

    @cached_property
    def contact(self) -> sp.Expr:
        """The contact force over the leg's stiffness, in y, v1, v2, [m]: y itself where no damper acts in the leg."""
        if "foot" in self.fixed:
            return y
        return y + sp.factor(sum(self._in_leg.diff(v) * v for v in (v1, v2))) / self.stiffness

    @cached_property
    def in_flight(self) -> tuple[sp.Expr, sp.Expr]:
        """The accelerations in flight, where the leg carries nothing, in v1 and u; that of the body is constant."""
        actuator, body = self._forces_in("flight")
        return sp.expand(actuator / m_eff), sp.expand(body / m_s - g)

    @property
    def fall(self) -> sp.Expr:
        """How fast the body falls in flight: by its weight, and by what further terms pull at it, [m/s^2]."""
        return -self.in_flight[1]

    @cached_property
    def accelerations(self) -> tuple[sp.Expr, sp.Expr]:
        """(3), (4) with sign(v_i) written as side_i, in x1, x2, v1, v2."""
        return tuple(
            sp.expand((LAGRANGIAN.diff(coordinate) + force) / mass)
            for mass, coordinate, force in zip((m_eff, m_s), (x1, x2), self.forces, strict=True)
        )

    @cached_property
    def in_compression(self) -> tuple[sp.Expr, sp.Expr]:
        """The accelerations in y, v1, v2: translation invariance leaves no other coordinate."""
        return tuple(self._by_compression(acc) for acc in self.accelerations)

    def _by_compression(self, value: sp.Expr) -> sp.Expr:
        """What is linear in x1 - x2, v1, v2 by y in its place: lengths cancel where y counts from rest."""
        by_y = sp.expand(value.subs(x1, y + x2 - self.length))
        if self.rest == 0:
            return by_y
        slopes = (sp.expand(by_y.diff(v)) * v for v in (y, v1, v2))
        return sp.expand(sum(slopes, sp.expand(sp.cancel(by_y.subs({y: 0, v1: 0, v2: 0})))))


compression = x1 - x2 + L0 + c
kinetic = (m_eff * v1**2 + m_s * v2**2) / 2
potential = m_s * g * x2 + k * compression**2 / 2
LAGRANGIAN = kinetic - potential


def _refuse_what_the_closed_form_cannot_carry(term: Term) -> None:
    for number, force in ((1, sp.sympify(term.force_1)), (2, sp.sympify(term.force_2))):
        for variable in (x1, x2, v1, v2):
            if force.diff(variable).free_symbols & {x1, x2, v1, v2}:
                raise ModelError(
                    f"the term '{term.name}' is not linear in {variable}: force_{number} = {force}; "
                    "the Laplace transform (6), (7) needs a linear equation in each phase"
                )
        if (ground := sp.expand(force.diff(x1) + force.diff(x2))) != 0:
            raise ModelError(
                f"the term '{term.name}' ties mass {number} to the ground: force_{number} = {force} changes by "
                f"{ground} per metre when both masses move together; the factor s^2 in the denominator of (11) would "
                "be lost"
            )
        if force.free_symbols & {u, side_1, side_2}:
            raise ModelError(f"the term '{term.name}' may not contain u, side_1 or side_2: force_{number} = {force}")
