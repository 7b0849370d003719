"""The formulas of a mode, by name: what each is, in which groups, as a number, as text in every form."""

import difflib
import math
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import sympy as sp

from .emit import forms
from .emit.forms import FORMS, Library
from .ir import Own, Quantity, Shown, Step, unfold
from .maths import elements, laplace, stability
from .maths.formulas import GROUPS, Formula, assumed, formulas, free_masses, inputs, names
from .model.equations import Model, ModelError
from .model.quantities import TRAVEL

MOST_DOUBLINGS = 5
"""Of the digits that a value is computed with; a value that is 0 by rounding has none that settle."""


@dataclass(frozen=True, repr=False)
class ModeFormulas:
    """The formulas of a mode, by name; what they mean says `Mode`."""

    model: Model
    _held: tuple[int, ...] = ()
    assumptions: bool = False
    """Whether symbols are real, positive, nonnegative, as their domains say, but for s and the transforms."""
    held_while: Mapping[str, sp.Expr] = field(default_factory=dict, compare=False)
    """The stick margins, expressions in a state that are >= 0 while a mass is held by friction, by name."""

    def __repr__(self) -> str:
        return f"<mode of {self.model.name}: held {self.name}, order {self.order}>"

    @cached_property
    def _moving(self) -> tuple[int, ...]:
        return tuple(n for n in free_masses(self.model) if n not in self._held)

    def _things(self, masses: Iterable[int]) -> tuple[str, ...]:
        return tuple(own.thing for n in masses if (own := self.model.names[n - 1]) is not None)

    @property
    def held(self) -> tuple[str, ...]:
        """What the file calls the masses that are held, of the hopper "actuator" and "body"."""
        return self._things(self._held)

    @property
    def slipping(self) -> tuple[str, ...]:
        """What the file calls the masses that slip."""
        return self._things(self._moving)

    @property
    def name(self) -> str:
        """What is held, "nothing" where all slips: the name of `Derivation.mode` and of `--mode`."""
        return ", ".join(self.held) or "nothing"

    @cached_property
    def _rates(self) -> tuple[Step, ...]:
        steps = laplace.rates_of(self.model)
        return tuple(Step(each.symbol, self._plain(self.model.value(each.value)), each.source) for each in steps)

    @property
    def _called(self) -> str:
        """The model and what is held, in messages."""
        return self.model.name + (f" with {self.name} held" if self._held else "")

    @cached_property
    def denominator(self) -> sp.Poly:
        """The characteristic polynomial of the motion in s [1/s], whose roots are the poles, without the integrator of each
        position.
        """
        symbols = elements.POLYNOMIALS.get(self._moving, ())
        variable = self.inputs[self._names["s"]].symbol
        return sp.Poly([1, *(unfold(symbol, self._rates) for symbol in symbols)], variable)

    @property
    def order(self) -> int:
        """The degree of the denominator: 3 with a real pole and a pair, 2 with a pair, 0 at rest."""
        return int(self.denominator.degree())

    @cached_property
    def conditions(self) -> dict[str, sp.Expr]:
        """Expressions in parameters that must be >= 0 for a motion that does not grow (Routh), by name; those that hold for
        every robot of the model are left out.
        """
        symbols = set(elements.POLYNOMIALS.get(self._moving, ()))
        return {
            each.name: unfold(each.value, self._rates)
            for each in stability.open_conditions(self.model)
            if each.value.free_symbols and each.value.free_symbols <= symbols
        }

    @cached_property
    def symbols(self) -> dict[str, sp.Symbol]:
        """The symbols of all formulas and of what they take, by name.

        >>> from hopform.model import derive
        >>> joint = derive("joint")
        >>> joint.poles["q_1"].subs({"k": 2, "J": 4}), joint.symbols["k"]
        (1/2, k)
        """
        quantities = (*self.inputs.values(), *(each.quantity for each in self.formulas))
        return {each.name: each.symbol for each in quantities}

    @property
    def defaults(self) -> dict[str, float]:
        """The values of parameters that the file declares, by name: numbers to start from."""
        return {each.name: each.default for each in self.model.parameters if each.default is not None}

    def _plain(self, value: sp.Expr) -> sp.Expr:
        """An expression in which parameters are symbols of the door."""
        return value.xreplace({symbol: self.inputs[symbol.name].symbol for symbol in value.atoms(Own)})

    @cached_property
    def _names(self) -> dict[str, str]:
        return names(self.model)

    @cached_property
    def formulas(self) -> tuple[Formula, ...]:
        """All formulas, group by group: each has `name`, `value`, `quantity`, `group` and `numbers`; none where nothing
        moves.
        """
        if not self._moving:
            return ()
        found = formulas(self.model, self._moving)
        return tuple(assumed(found, inputs(self.model), self._names["s"])) if self.assumptions else found

    @cached_property
    def inputs(self) -> dict[str, Quantity]:
        """What formulas take: parameters, inputs, a state and that at the start, by name, with unit and meaning."""
        variable = self._names["s"]
        return {
            name: Shown.of(each, self.assumptions and name != variable) for name, each in inputs(self.model).items()
        }

    @cached_property
    def _by_name(self) -> dict[str, Formula]:
        return {each.name: each for each in self.formulas}

    def formula(self, name: str) -> Formula:
        """A formula by its name, with its unit and meaning, and the equations of the paper that it is."""
        if name not in self._by_name:
            self.found(name)
            raise ModelError(f"{name!r} is no name of a formula of {self._called}")
        return self._by_name[name]

    def found(self, name: str | None = None) -> tuple[Formula, ...]:
        """The formulas of a name, of a number of the paper, "14" or "(14)", of a group, or of the whole paper, "paper",
        in its order; all of them without one.

        Raises ModelError for what is none of these, with the nearest.
        """
        if not self._moving:
            raise ModelError(f"nothing moves in {self._called}: it has no formulas")
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
        groups = [group for group in GROUPS if self._group(group)]
        known = [*self._by_name, *groups]
        near = difflib.get_close_matches(name, known, 1)
        numbers = ", (1) to (27)" if self.model.is_of_the_paper else ""
        hint = (
            f"did you mean {near[0]}?"
            if near
            else f"known: the groups {', '.join(groups)}, and the names of their formulas{numbers}"
        )
        raise ModelError(f"{self._called} has no formula {name!r}; {hint}")

    def _group(self, group: str) -> dict[str, sp.Expr]:
        return {each.name: each.value for each in self.formulas if each.group == group}

    @property
    def lagrangian(self) -> sp.Expr:
        """Kinetic less potential energy [J] at a state x1, v1, x2, v2.

        >>> from hopform.model import derive
        >>> derive("hopper").lagrangian
        -g*m_s*x2 - k*(L0 + c + x1 - x2)**2/2 + m_eff*v1**2/2 + m_s*v2**2/2
        """
        return self._unfolded(self._by_name[self._names["L"]].value, "lagrangian")

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
        """The Laplace transforms [m s] in s [1/s]: X1_by_X2 (6), X2_by_X1 (7), X2 (11), X1 (16), Z (17), the
        constants that they name, gamma (8), beta (9), lambda_2 (10), and the transfer functions X1_by_u, X2_by_u from
        the input.

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

        This holds for all poles, for equal ones and for those at 0, too. Each of `Derivation.modes` has its own.

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

    def value(self, name: str, values: Mapping[str, Any], digits: int = 15) -> sp.Expr:
        """A formula as a number of so many digits, from the values of parameters and inputs that it takes: numbers, or
        texts where a decimal is meant exactly, as "0.1".

        Raises ModelError for one that is missing.

        >>> from hopform.model import derive
        >>> derive("hopper").value("s_1", {"b1": 4, "b2": 3, "m_eff": 20, "m_s": 3}, 5)
        1.2000
        """
        return sp.N(self._settled({name: self.formula(name).value}, values, digits)[name], digits)

    def _settled(self, wanted: Mapping[str, sp.Expr], values: Mapping[str, Any], digits: int) -> dict[str, sp.Expr]:
        """Expressions as numbers, with twice as many digits until two agree: near a limit a formula subtracts what is
        nearly equal.
        """
        numbers = self._given(values)
        working, found = digits + 10, self._numbers(wanted, numbers, digits + 10)
        for _ in range(MOST_DOUBLINGS):
            working *= 2
            before, found = found, self._numbers(wanted, numbers, working)
            if all(
                now == before[each] or sp.Abs(now - before[each]) <= sp.Abs(now) / 10**digits
                for each, now in found.items()
            ):
                break
        return found

    def _given(self, values: Mapping[str, Any]) -> dict[str, sp.Expr]:
        """Values of parameters and inputs as rational numbers, in their domains. What no formula takes is refused: else a
        name that is misspelt would leave a default as it is. `travel` is a robot's alone.
        """
        found = dict[str, sp.Expr]()
        for key, value in values.items():
            if (name := str(key)) == TRAVEL.name:
                continue
            if name not in self.inputs:
                near = difflib.get_close_matches(name, self.inputs, 1)
                hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(self.inputs)}"
                raise ModelError(f"{self.model.name} has no parameter or input {name!r}: {hint}")
            quantity = self.inputs[name]
            try:
                number = value.item() if hasattr(value, "item") else value
                is_finite = isinstance(number, str) or math.isfinite(number)
                found[name] = sp.Rational(number) if is_finite else sp.sympify(number)  # Rational takes inf, nan for 0
                allowed = float(found[name]) in quantity.interval
            except (TypeError, ValueError):
                allowed = False
            if not allowed:
                raise ModelError(f"{name} of {self.model.name} must be {quantity.interval.allowed}, got {value!r}")
        return found

    def _numbers(self, wanted: Mapping[str, sp.Expr], values: Mapping[str, sp.Expr], digits: int) -> dict[str, sp.Expr]:
        """Expressions as numbers, each step with so many digits."""
        known = dict(values)
        for each in self._needed(wanted.values()):
            known[each.name] = sp.N(self._put(each.name, each.value, known), digits)
        return {name: sp.N(self._put(name, value, known), digits) for name, value in wanted.items()}

    def _put(self, name: str, value: sp.Expr, values: Mapping[str, sp.Expr]) -> sp.Expr:
        """An expression with values by name in it."""
        symbols = {symbol: values.get(symbol.name) for symbol in value.free_symbols}
        if missing := sorted(symbol.name for symbol, number in symbols.items() if number is None):
            given = [each for each in sorted(values) if each in self.inputs]
            raise ModelError(f"{name} of {self.model.name} takes {', '.join(missing)}, got {given}")
        return value.xreplace(symbols)

    def _needed(self, values: Iterable[sp.Expr]) -> list[Formula]:
        """The formulas that expressions read, each behind those that it reads."""
        names = sorted({symbol.name for value in values for symbol in value.free_symbols})
        return self._library.needed(self._by_name[name] for name in names if name in self._by_name)

    def _unfolded(self, value: sp.Expr, group: str = "") -> sp.Expr:
        """An expression without the formulas that it reads, or without those of a group."""
        for each in reversed(self._needed([value])):
            if group in ("", each.group):
                value = value.xreplace({each.quantity.symbol: each.value})
        return value

    @cached_property
    def _library(self) -> Library:
        name = "_".join((self.model.name, *(f"{thing}_held" for thing in self.held)))
        return Library(self.model.title, re.sub(r"\W|^(?=\d)", "_", name), self._by_name, self.inputs)

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

    def lambdify(self, name: str) -> Callable[..., Any]:
        """A formula as a function of NumPy: of numbers or arrays that are broadcast, by position or by name.

        It computes all that the formula reads, in cases that lose no digits: `show(name, "numpy")` is its text. Its
        docstring has the arguments with their units.

        >>> from hopform.model import derive
        >>> stiffness = derive("joint").lambdify("q_1")
        >>> stiffness(J=4.0, k=[2.0, 8.0])
        array([0.5, 2. ])
        >>> print(stiffness.__doc__)
        [1/s^2] joint moving alone.
        <BLANKLINE>
            J [kg m^2] inertia of the joint, the motor's behind its gear in it
            k [N m/rad] stiffness of the return spring
        <BLANKLINE>
        """
        formula, spaces = self.formula(name), dict[str, Any]()
        exec(forms.in_numpy(self._library, [formula]), spaces)
        function: Callable[..., Any] = spaces[formula.name]
        return function
