"""The door of the derivation: `derive(FILE | NAME)` gives a model's formulas as objects of sympy."""

import difflib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import sympy as sp

from .emit import forms
from .emit.forms import FORMS, Library
from .ir import Own, Quantity, Step, unfold
from .maths import elements, laplace, stability
from .maths.formulas import GROUPS, Formula, formulas, free_masses, inputs
from .model.equations import Model, ModelError
from .model.quantities import x1, x2
from .model_file import read_model
from .shipped import FILES, shipped

SHIPPED = tuple(FILES)
"""Names of the models that ship."""

s = sp.Symbol("s")
MOST_DOUBLINGS = 5
"""Of the digits that a value is computed with; a value that is 0 by rounding has none that settle."""


@dataclass(frozen=True)
class Mode:
    """A mode of a model: which masses are held by friction or a stop, and the linear motion of the others.

    held, slipping: what the file calls the masses, of the hopper "actuator" and "body". denominator: the characteristic
    polynomial of the motion in s [1/s], whose roots are the poles, without the integrator of each position. conditions:
    expressions in parameters that must be >= 0 for a motion that does not grow (Routh), by name; those that hold for
    every robot of the model are left out. held_while: the stick margins, expressions in a state that are >= 0 while a
    mass is held by friction, by name.
    """

    held: tuple[str, ...]
    slipping: tuple[str, ...]
    denominator: sp.Poly
    conditions: Mapping[str, sp.Expr]
    held_while: Mapping[str, sp.Expr]
    _of: tuple[Model, tuple[int, ...]]

    @property
    def order(self) -> int:
        """The degree of the denominator: 3 with a real pole and a pair, 2 with a pair, 0 at rest."""
        return int(self.denominator.degree())

    @cached_property
    def formulas(self) -> tuple[Formula, ...]:
        """The formulas of this mode, as `Derivation.formulas` has those of the one in which nothing is held."""
        return formulas(*self._of) if self.slipping else ()


@dataclass(frozen=True)
class Derivation:
    """The derivation of a model: formulas by name, in SI units and A, as expressions of sympy.

    Groups are dictionaries in which a formula may be in terms of others; `value` computes one, `formula` has its unit,
    meaning and equations of the paper, `show` spells it. In all formulas x1, v1, x2, v2 are the state [m, m/s], x1_0,
    v1_0, x2_0, v2_0 that at the start of a phase, x1_t, v1_t, x2_t, v2_t that at time t [s] in it, u is the current [A]
    and side_1, side_2 are the signs of the velocities.

    >>> from hopform.model import derive
    >>> hopper = derive("hopper")
    >>> hopper.equations_of_motion["acc_2"]
    (-b2*v2 - f2*m_s*side_2 - g*m_s + k*(L0 + c + x1 - x2))/m_s
    >>> hopper.formula("H2").numbers, hopper.numerators["H2"]
    ((14,), beta*q_1 + beta_1*q_2 - gamma*p_1)
    """

    model: Model

    @cached_property
    def formulas(self) -> tuple[Formula, ...]:
        """All formulas, group by group: each has `name`, `value`, `quantity`, `group` and `numbers`."""
        return formulas(self.model)

    @cached_property
    def inputs(self) -> dict[str, Quantity]:
        """What formulas take: parameters, inputs, a state and that at the start, by name, with unit and meaning."""
        return inputs(self.model)

    @cached_property
    def _by_name(self) -> dict[str, Formula]:
        return {each.name: each for each in self.formulas}

    def formula(self, name: str) -> Formula:
        """A formula by its name, with its unit and meaning, and the equations of the paper that it is."""
        if name not in self._by_name:
            self.found(name)
            raise ModelError(f"{name!r} is no name of a formula of {self.model.name}")
        return self._by_name[name]

    def found(self, name: str | None = None) -> tuple[Formula, ...]:
        """The formulas of a name, of a number of the paper, "14" or "(14)", of a group, or of the whole paper, "paper",
        in its order; all of them without one.

        Raises ModelError for what is none of these, with the nearest.
        """
        if name is None:
            return self.formulas
        if name == "paper":
            return tuple(sorted((each for each in self.formulas if each.numbers), key=lambda each: each.numbers))
        number = name.strip("()")
        for matches in (
            lambda each: each.name == name,
            lambda each: each.group == name,
            lambda each: number.isdecimal() and int(number) in each.numbers,
        ):
            if found := tuple(filter(matches, self.formulas)):
                return found
        known = [*self._by_name, *GROUPS]
        near = difflib.get_close_matches(name, known, 1)
        numbers = ", (1) to (27)" if self.model.is_of_the_paper else ""
        hint = f"did you mean {near[0]}?" if near else f"known: {', '.join(GROUPS)}, their formulas{numbers}"
        raise ModelError(f"{self.model.name} has no formula {name!r}: {hint}")

    def _group(self, group: str) -> dict[str, sp.Expr]:
        return {each.name: each.value for each in self.formulas if each.group == group}

    @property
    def lagrangian(self) -> sp.Expr:
        """Kinetic less potential energy [J] at a state x1, v1, x2, v2.

        >>> from hopform.model import derive
        >>> derive("hopper").lagrangian
        -g*m_s*x2 - k*(L0 + c + x1 - x2)**2/2 + m_eff*v1**2/2 + m_s*v2**2/2
        """
        return _unfolded(self._by_name["L"].value, self.found("lagrangian"))

    @property
    def equations_of_motion(self) -> dict[str, sp.Expr]:
        """The accelerations acc_1, acc_2 [m/s^2], (3) and (4), at a state; and their coefficients: a1_y, a1_v1, ... by
        y, v1, v2, u, and the constant accelerations of a phase, C_1, C_2.

        >>> from hopform.model import derive
        >>> derive("hopper").equations_of_motion["C_2"]
        a2_0 - f2*side_2
        """
        return self._group("equations_of_motion")

    @property
    def transfer(self) -> dict[str, sp.Expr]:
        """The Laplace transforms [m s] in s [1/s]: X1_by_X2 (6), X2_by_X1 (7), X2 (11), X1 (16), Z (17), and the
        constants that they name, gamma (8), beta (9), lambda_2 (10).

        >>> from hopform.model import derive
        >>> derive("hopper").transfer["X2"]
        (H1 + H2*s + H3*s**2 + H4*s**3 + s**4*x2_0)/(s**2*(s**3 + s**2*s_1 + s*s_2 + s_3))
        """
        return self._group("transfer")

    @property
    def numerators(self) -> dict[str, sp.Expr]:
        """H4, H3, H2, H1, (12)-(15) of X2, and H4_hat, ... of X1: the coefficient of s^(n - 1) [m/s^(5 - n)].

        >>> from hopform.model import derive
        >>> derive("hopper").numerators["H1"]
        -gamma*q_1 + lambda_2*q_2
        """
        return self._group("numerators")

    @property
    def poles(self) -> dict[str, sp.Expr]:
        """Coefficients of the denominators, p_1, q_1 of (6), p_2, q_2 of (7), s_1, s_2, s_3 of (11), and their roots:
        -a [1/s], and those of s^2 + p s + q.

        >>> from hopform.model import derive
        >>> derive("hopper").poles["s_2"]
        b1*b2/(m_eff*m_s) + k/m_s + k/m_eff
        """
        return self._group("poles")

    @property
    def partial_fractions(self) -> dict[str, sp.Expr]:
        """A, B, C, D, E of (18), x_2(t) = A + B t + C exp(-a t) + D R' + E R, in real numbers, and A_hat, ... of (20);
        R is the inverse transform of 1/(s^2 + p s + q). They need poles apart from each other and from 0; what has none
        for any robot of the model is left out.

        >>> from hopform.model import derive
        >>> derive("hopper").partial_fractions["B"]
        H1/s_3
        """
        return self._group("partial_fractions")

    @property
    def states(self) -> dict[str, sp.Expr]:
        """The state at time t [s] of a phase, x2_t (18), v2_t (19), x1_t (20), v1_t (21), and what it reads: W, the
        inverse transform of 1/((s + a)(s^2 + p s + q)), its derivative Wd and its integrals W1, W2.

        This holds for all poles, for equal ones and for those at 0, too. Masses that are not bolted slip; `modes` has
        the other modes.

        >>> from hopform.model import derive
        >>> derive("hopper").states["v2_t"]
        H1_2*W1 + H2_2*W + H3_2*Wd + v2_0
        """
        return self._group("states")

    @property
    def energies(self) -> dict[str, sp.Expr]:
        """Energy of the body, `body` (22), (23), and of the robot, `total` [J], at a state; the power [W] of each entry
        of the ledger, and `aed_power`, the rate of the analytical energy delta (24).

        >>> from hopform.model import derive
        >>> derive("hopper").energies["aed_power"]
        coulomb_2_power + spring_power + viscous_2_power
        """
        return self._group("energies")

    @property
    def works(self) -> dict[str, sp.Expr]:
        """The work [J] of each force over a phase, to time t [s] in it, by the state at its start; `aed_work`, the
        analytical energy delta (24), and the integrals that they read, in closed form.

        This holds for all poles, as `states` does. The current is constant, and what stops take is no work of a phase.

        >>> from hopform.model import derive
        >>> derive("hopper").works["aed_work"]
        coulomb_2_work + spring_work + viscous_2_work
        """
        return self._group("works")

    @property
    def event_functions(self) -> dict[str, sp.Expr]:
        """Functions of a state whose first zero ends a phase: contact force [N], velocities [m/s], stick
        margins of a mass to either side [m/s^2], distances from stops [m].

        >>> from hopform.model import derive
        >>> derive("hopper").event_functions["contact_force"]
        k*(L0 + c + x1 - x2)
        """
        return self._group("event_functions")

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """The modes of the model, by what is held.

        >>> from hopform.model import derive
        >>> [(each.held, each.order) for each in derive("hopper").modes]
        [((), 3), (('actuator',), 2), (('body',), 2), (('actuator', 'body'), 0)]
        """
        free = free_masses(self.model)
        held_by_size = ((), *((n,) for n in free), *((free,) if len(free) > 1 else ()))
        return tuple(self._mode(held, tuple(n for n in free if n not in held)) for held in held_by_size)

    def _mode(self, held: tuple[int, ...], moving: tuple[int, ...]) -> Mode:
        rates = tuple(
            Step(each.symbol, _plain(self.model.value(each.value)), each.source)
            for each in laplace.rates_of(self.model)
        )
        symbols = elements.POLYNOMIALS.get(moving, ())
        known = {symbol: unfold(symbol, rates) for symbol in symbols}
        polynomial = sp.Poly([1, *known.values()], s)
        conditions = {
            each.name: unfold(each.value, rates)
            for each in stability.open_conditions(self.model)
            if each.value.free_symbols and each.value.free_symbols <= set(symbols)
        }
        functions = self.event_functions
        called = {n: elements.name_of(self.model, symbol) for n, symbol in ((1, x1), (2, x2))}
        margins = [f"{called[n]}_stick_margin_{way}" for n in held for way in ("forward", "backward")]
        things = {n: own.thing for n, own in enumerate(self.model.names, 1) if own is not None}
        return Mode(
            tuple(things[n] for n in held),
            tuple(things[n] for n in moving),
            polynomial,
            conditions,
            {name: functions[name] for name in margins},
            (self.model, moving),
        )

    def value(self, name: str, values: Mapping[str, Any], digits: int = 15) -> sp.Expr:
        """A formula as a number of so many digits, from the values of parameters and inputs that it takes: numbers, or
        texts where a decimal is meant exactly, as "0.1".

        Raises ModelError for one that is missing.

        >>> from hopform.model import derive
        >>> derive("hopper").value("s_1", {"b1": 4, "b2": 3, "m_eff": 20, "m_s": 3}, 5)
        1.2000
        """
        return sp.N(self._settled(name, {key: sp.Rational(value) for key, value in values.items()}, digits), digits)

    def _settled(self, name: str, values: Mapping[str, sp.Expr], digits: int) -> sp.Expr:
        """A number with twice as many digits until two agree: near a limit a formula subtracts what is nearly equal."""
        working, found = digits + 10, self._value(name, values, digits + 10)
        for _ in range(MOST_DOUBLINGS):
            working *= 2
            before, found = found, self._value(name, values, working)
            if sp.Abs(found - before) <= sp.Abs(found) / 10**digits:
                break
        return found

    def _value(self, name: str, values: Mapping[str, sp.Expr], digits: int) -> sp.Expr:
        """A number, each step with so many digits."""
        known = dict(values)
        for each in self._library.needed([self.formula(name)]):
            symbols = {symbol: known.get(symbol.name) for symbol in each.value.free_symbols}
            if missing := sorted(symbol.name for symbol, number in symbols.items() if number is None):
                raise ModelError(f"{each.name} of {self.model.name} takes {', '.join(missing)}, got {sorted(values)}")
            known[each.name] = sp.N(each.value.xreplace(symbols), digits)
        return known[name]

    @cached_property
    def _library(self) -> Library:
        prefix = re.sub(r"\W|^(?=\d)", "_", self.model.name)
        return Library(self.model.title, prefix, self._by_name, self.inputs)

    def full(self, name: str) -> dict[str, sp.Expr]:
        """A formula in parameters, inputs, start and time alone, the last of a dictionary: what is too long to be put in, or
        reads such a one, is a definition before it.

        >>> from hopform.model import derive
        >>> derive("hopper").full("q_2")
        {'q_2': k/m_s}
        >>> [*derive("hopper").full("x2_t")][-3:]
        ['e2', 'W2', 'x2_t']
        """
        return {each.name: each.value for each in self._library.whole([self.formula(name)])}

    @property
    def glyphs(self) -> dict[sp.Symbol, str]:
        """The glyphs of all symbols, for `sympy.latex(..., symbol_names=...)`."""
        return self._library.glyphs

    def latex(self, name: str) -> str:
        """A formula as LaTeX, without a comment.

        >>> from hopform.model import derive
        >>> print(derive("hopper").latex("p_1"))
        p_1 = \\frac{b_1}{m_{eff}}
        """
        return forms.in_latex(self._library, self.formula(name))

    def show(self, name: str | None = None, form: str = "text", *, single: bool = False, whole: bool = False) -> str:
        """A formula, those of a number of the paper or of a group, or all, in a form: text, latex, sympy, json, numpy,
        c or notebook. Code has all that the formula reads, and the kernels that it calls. `single`: C in single
        precision. `whole`: the others too in parameters, inputs, start and time alone, as `full` has them.

        Raises ModelError for a name or a form that is not known.

        >>> from hopform.model import derive
        >>> print(derive("hopper").show("(15)", "latex"), end="")
        % H1: (15) [m/s^4] numerator of the body, terms in s^0
        H_1 = - \\gamma q_1 + \\lambda_2 q_2
        """
        if form not in FORMS:
            raise ModelError(f"a form is one of {', '.join(FORMS)}, got {form!r}")
        wanted = self.found(name)
        return forms.spelled(self._library, wanted, form, single=single, whole=whole)


def _plain(value: sp.Expr) -> sp.Expr:
    """An expression in which parameters are symbols like all others."""
    return value.xreplace({symbol: sp.Symbol(symbol.name, real=True) for symbol in value.atoms(Own)})


def _unfolded(value: sp.Expr, by: Iterable[Formula]) -> sp.Expr:
    return value.subs({each.quantity.symbol: each.value for each in by})


@cache
def _shipped(name: str) -> Derivation:
    return Derivation(shipped(name))


def derive(model: str | Path) -> Derivation:
    """The derivation of a model that ships, by its name, or of a model file, which is run as Python.

    Raises ModelError, which names the file, for a model that the closed form cannot carry.

    >>> from hopform.model import derive
    >>> derive("hopper").model.title
    'A series-elastic hopper with viscous and Coulomb friction.'
    """
    if str(model) in SHIPPED:
        return _shipped(str(model))
    path = Path(model)
    if not path.is_file():
        raise ModelError(f"there is no model file {path}; models that ship: {', '.join(SHIPPED)}")
    return Derivation(read_model(path))
