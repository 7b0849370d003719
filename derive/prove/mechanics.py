"""The mechanics of a file's elements, each by the law of its kind: what formulas are proved against.

    spring      the energy k d^2/2 of its stretch d             friction    a force against the velocity
    viscous     a force -c d' along d                           gravity     a weight

Neither the letters of the derivation nor its coefficients, transforms and poles are read; of its model only names, and
which element the Lagrangian, a letter or an entry of the ledger is about.
"""

from collections.abc import Iterable
from functools import cached_property
from typing import Any

import sympy as sp

from ..maths import energy
from ..maths.formulas import inputs, names
from ..model import quantities as Q
from ..model.declare import Coordinate, Current, Draft, Element
from ..model.equations import LETTER_OF_ENTRY, Model


def by_name(value: sp.Expr) -> sp.Expr:
    """An expression in real symbols of the same names, whatever it assumes of its own."""
    return value.xreplace({symbol: sp.Symbol(symbol.name, real=True) for symbol in value.free_symbols})


class Mechanics:
    """Energies, forces and accelerations of a file's elements in a phase on the ground, in the names that formulas have.

    forces: of each element that acts, on each mass [N]. main: the spring that the Lagrangian has, weights those elements
    of gravity whose work is energy.
    """

    def __init__(self, model: Model, draft: Draft) -> None:
        self.model, self.draft = model, draft
        taken = inputs(model)
        self.inputs = {key: sp.Symbol(name, real=True) for key, name in names(model).items() if name in taken}
        self.masses = model.moving
        numbers = {own.coordinate: n for n, own in enumerate(model.names, 1) if own is not None}
        self.number = {c.symbol: numbers.get(c.symbol.name) for c in draft.coordinates}
        self.x = {n: self.inputs[f"x{n}"] for n in self.masses}
        self.v = {n: self.inputs[f"v{n}"] for n in self.masses}
        self.side = {n: self.inputs[f"side_{n}"] for n in self.masses}
        self.u = self.inputs["u"]
        self.inertia = {
            numbers[c.symbol.name]: self.own(c.inertia) for c in draft.coordinates if c.symbol.name in numbers
        }
        self.acting = [each for each in draft.elements if each.where != "flight"]
        self.forces = {id(each): self._forces(each) for each in draft.elements}
        springs = model.called(Q.k)
        self.main = next((e for e in draft.elements if e.kind == "spring" and e.name in springs), None)
        self.weights = [e for e in draft.elements if e.kind == "gravity"]
        if model.has_contact:  # elsewhere the height of a coordinate is not that of its mass
            self.weights = [e for e in self.weights if self.number_of(e) == 2][:1]

    def own(self, value: Any) -> sp.Expr:
        """An expression of the file in the symbols of formulas, numbers as decimals; what is held is at 0."""
        expression = sp.sympify(value)
        symbols = {number: sp.Rational(repr(float(number))) for number in expression.atoms(sp.Float)}
        for symbol in expression.free_symbols:
            if isinstance(symbol, Coordinate):
                n = self.number[symbol]
                symbols[symbol] = sp.S.Zero if n is None else self.x[n]
            else:
                symbols[symbol] = self.u if isinstance(symbol, Current) else sp.Symbol(symbol.name, real=True)
        return expression.xreplace(symbols)

    def number_of(self, element: Element) -> int | None:
        return self.number.get(element.on)

    def rate(self, value: sp.Expr) -> sp.Expr:
        """The rate of a function of the coordinates."""
        return sum((value.diff(self.x[n]) * self.v[n] for n in self.masses), sp.S.Zero)

    def _forces(self, element: Element) -> dict[int, sp.Expr]:
        """What an element pushes each mass with, by the law of its kind."""
        values = {key: self.own(value) for key, value in element.values.items() if value is not None}
        n, on = self.number_of(element), self.own(element.on)
        if element.kind == "spring":
            return {m: -values["stiffness"] * on * on.diff(self.x[m]) for m in self.masses}
        if element.kind == "viscous":
            return {m: -values["damping"] * self.rate(on) * on.diff(self.x[m]) for m in self.masses}
        if n is None or element.kind in ("stop", "contact", "law"):
            return {}
        if element.kind == "friction":
            forward, backward = values["forward"], values["backward"]
            return {n: -sp.Rational(1, 2) * (forward * (1 + self.side[n]) - backward * (1 - self.side[n]))}
        return {n: -self.inertia[n] * values["acceleration"] if element.kind == "gravity" else values["value"]}

    def force(self, n: int, elements: Iterable[Element]) -> sp.Expr:
        """The sum of what elements push a mass with."""
        return sum((self.forces[id(each)].get(n, sp.S.Zero) for each in elements), sp.S.Zero)

    @cached_property
    def kinetic(self) -> dict[int, sp.Expr]:
        return {n: self.inertia[n] * self.v[n] ** 2 / 2 for n in self.masses}

    @cached_property
    def potential(self) -> sp.Expr:
        """The energy [J] of the main spring and of weights."""
        of_spring = sp.S.Zero
        if self.main is not None:
            of_spring = self.own(self.main.values["stiffness"]) * self.own(self.main.on) ** 2 / 2
        return of_spring + sum((-self.force(n, self.weights) * self.x[n] for n in self.masses), sp.S.Zero)

    @cached_property
    def acceleration(self) -> dict[int, sp.Expr]:
        """m q'' = F of each mass that slips [m/s^2]."""
        return {n: self.force(n, self.acting) / self.inertia[n] for n in self.masses}

    @cached_property
    def asked(self) -> sp.Expr:
        """The current that the law asks for."""
        values = self.the("law").values
        pull = self.own(values["proportional"]) * (self.inputs["target"] - self.x[1])
        pull -= self.own(values["derivative"]) * self.v[1]
        return pull / self.force(1, self.acting).diff(self.u)

    @property
    def limit(self) -> sp.Expr | None:
        """The largest size of the current, None for any."""
        limits = [each.limit for each in self.draft.currents if each.limit is not None]
        return self.own(limits[0]) if limits else None

    @cached_property
    def under_law(self) -> dict[int, sp.Expr]:
        """The accelerations under the current that the law asks for."""
        return {n: sp.expand(acceleration.subs(self.u, self.asked)) for n, acceleration in self.acceleration.items()}

    def integrates(self, moving: tuple[int, ...]) -> bool:
        """Whether no spring draws back what slips alone, whatever the robot."""
        return len(moving) == 1 and sp.expand(self.acceleration[moving[0]].diff(self.x[moving[0]])) == 0

    @cached_property
    def body(self) -> sp.Expr:
        """The energy [J] of mass 2 of a model with a contact: of motion, of height, and of the spring with mass 1 at 0."""
        return self.kinetic[2] + (self.potential.subs(self.x[1], 0) if 1 in self.masses else self.potential)

    @cached_property
    def contact(self) -> sp.Expr:
        """What the elements of the leg push mass 2 with."""
        contact = self.the("contact")
        ends = contact.on.free_symbols & {*self.number}
        in_leg = [
            each for each in self.draft.elements
            if each.kind in ("spring", "viscous") and each.on.free_symbols & {*self.number} == ends
            and (len(ends) == 2 or each.kind == "spring" or each.beside)
        ]  # fmt: skip
        return self.force(2, in_leg)

    @cached_property
    def length(self) -> sp.Expr:
        """The free length of the leg: x_2 - x_1 [m] without load, at rest."""
        at_rest = self.contact.subs({symbol: 0 for symbol in (*self.v.values(), *self.x.values())})
        return -at_rest / self.contact.diff(self.x[2])

    @property
    def ratio(self) -> sp.Expr:
        """By how much the stretch of the main spring changes per x_1, against that per x_2: 1 without a gear."""
        if self.main is None or len(self.masses) < 2:
            return sp.S.One
        stretch = self.own(self.main.on)
        return -stretch.diff(self.x[1]) / stretch.diff(self.x[2])

    @cached_property
    def fall(self) -> sp.Expr:
        """How fast the body falls in flight [m/s^2]."""
        ends = self.the("contact").on.free_symbols & {*self.number}
        flying = [
            each for each in self.draft.elements
            if each.where != "stance" and not (each.kind in ("spring", "viscous") and (each.on.free_symbols & {*self.number} == ends or each.beside))
        ]  # fmt: skip
        return -self.force(2, flying) / self.inertia[2]

    def the(self, kind: str) -> Element:
        """The one element of a kind."""
        return next(each for each in self.draft.elements if each.kind == kind)

    @cached_property
    def powers(self) -> dict[sp.Symbol, sp.Expr]:
        """The power [W] of each entry of the ledger; of the derivation's own powers only the entries are read."""
        return {entry: self._power(entry) for entry in energy.powers(self.model)}

    @cached_property
    def forms(self) -> dict[sp.Symbol, dict[tuple[int, int], sp.Expr]]:
        """The powers as sums of products of two of x_1, v_1, x_2, v_2, 1: coefficients by the places of the two."""
        z = [self.inputs[key] for key in ("x1", "v1", "x2", "v2")]
        found = dict[sp.Symbol, dict[tuple[int, int], sp.Expr]]()
        for entry, power in self.powers.items():
            form = found[entry] = {}
            for powers, coefficient in sp.Poly(power, *z).terms():
                one, other, *_ = *(place for place, count in enumerate(powers) for _ in range(count)), 4, 4
                form[one, other] = coefficient
        return found

    def _power(self, entry: sp.Symbol) -> sp.Expr:
        """By the elements that do its work."""
        rate = {n: self.v[n] for n in self.masses}
        if entry == Q.spring_work:  # on the body, less that with mass 1 at 0, which is energy of the body
            assert self.main is not None
            whole = self.forces[id(self.main)][2]
            return (whole - whole.subs(self.x[1], 0)) * rate[2]
        works = {
            each.entry.symbol: (force.name, each.mass)
            for force in self.model.further
            for each in energy.works_of(self.model, force)
        }
        letter = LETTER_OF_ENTRY.get(entry)
        if entry in works:
            name, n = works[entry]
            chosen = [e for e in self.acting if e.name == name and e not in (self.main, *self.weights)]
            return self._undriven(n, [e for e in chosen if e.kind != "friction"]) * rate[n]
        if entry == Q.motor_work:
            return sum((self._driven(n, self.acting) * rate[n] for n in self.masses), sp.S.Zero)
        if entry == Q.offset_work:  # the constant force that undoes the offset of the spring in (3)
            further = {force.name for force in self.model.further}
            left = [e for e in self.acting if e.kind in ("force", "torque") and e.name not in further]
            return self._undriven(1, left) * rate[1]
        kind, n = ("friction" if entry in (Q.coulomb_1, Q.coulomb_2) else "viscous"), 1 if letter in (Q.b1, Q.f1) else 2
        named = self.model.called(letter) if kind == "viscous" else {e.name for e in self.acting}
        return self.force(n, [e for e in self.acting if e.kind == kind and e.name in named]) * rate[n]

    def _driven(self, n: int, elements: Iterable[Element]) -> sp.Expr:
        """The part of a force that the input drives."""
        return self.force(n, elements).diff(self.u) * self.u

    def _undriven(self, n: int, elements: Iterable[Element]) -> sp.Expr:
        return self.force(n, elements).subs(self.u, 0)

    def stick_margin(self, n: int, way: str) -> sp.Expr:
        """Friction at rest less what pulls a mass at rest forward or backward, over its inertia [m/s^2]."""
        level = sum(
            (
                self.own(e.values[f"{way}_at_rest"])
                for e in self.draft.elements
                if e.kind == "friction" and self.number_of(e) == n
            ),
            sp.S.Zero,
        )
        sign = 1 if way == "forward" else -1
        return (level - sign * self.pull(n)) / self.inertia[n]

    def pull(self, n: int) -> sp.Expr:
        """The force on a mass at rest, without dry friction [N]."""
        return self.force(n, [e for e in self.acting if e.kind != "friction"]).subs(self.v[n], 0)

    def level(self, n: int) -> sp.Expr:
        """The mean of dry friction forward and backward [N]."""
        frictions = [e for e in self.draft.elements if e.kind == "friction" and self.number_of(e) == n]
        return sum((self.own(e.values["forward"]) + self.own(e.values["backward"]) for e in frictions), sp.S.Zero) / 2
