"""The door of the derivation: `derive(FILE | NAME)` gives a model's formulas as objects of sympy."""

import difflib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import sympy as sp

from .emit import forms
from .emit.forms import FORMS, Library
from .ir import Own, Quantity, Shown, Step, unfold
from .maths import elements, laplace, stability, state_space
from .maths.formulas import GROUPS, Formula, assumed, formulas, free_masses, inputs, names
from .model.equations import Model, ModelError
from .model.quantities import DRIVE, W1, W2, W, Wd, t, v1, v2, y
from .model_file import read_model
from .shipped import FILES, shipped

SHIPPED = tuple(FILES)
"""Names of the models that ship."""

s = sp.Symbol("s")
MOST_DOUBLINGS = 5
"""Of the digits that a value is computed with; a value that is 0 by rounding has none that settle."""


@dataclass(frozen=True, repr=False)
class Mode:
    """A mode of a model: which masses are held by friction or a stop, and the formulas of the linear motion of the others,
    by name, in SI units and A, as expressions of sympy.

    Groups are dictionaries in which a formula may be in terms of others; `value` computes one, `formula` has its unit,
    meaning and equations of the paper, `show` spells it. In all formulas x1, v1, x2, v2 are the state [m, m/s], x1_0,
    v1_0, x2_0, v2_0 that at the start of a phase, x1_t, v1_t, x2_t, v2_t that at time t [s] in it, u is the current [A]
    and side_1, side_2 are the signs of the velocities; a model has its own names for them. Symbols have a name and no
    assumption, as `sympy.symbols` makes them.

    As a linear system z is `state`, the coordinate and the velocity of each mass that slips. Within a phase it obeys

        z' = M z + drive = M z + B w

    in which w is `channels`: the input, and a force on each coordinate that slips. The force has what does not change
    within a phase: Coulomb friction, whose sign is that of the velocity, loads, weights, and the spring's pull at a mass
    that is held.

    >>> from hopform.model import derive
    >>> derive("hopper").mode("actuator").state
    ('x2', 'v2')
    """

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
        return sp.Poly([1, *(unfold(symbol, self._rates) for symbol in symbols)], s)

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
        known = [*self._by_name, *GROUPS]
        near = difflib.get_close_matches(name, known, 1)
        numbers = ", (1) to (27)" if self.model.is_of_the_paper else ""
        hint = f"did you mean {near[0]}?" if near else f"known: {', '.join(GROUPS)}, their formulas{numbers}"
        raise ModelError(f"{self._called} has no formula {name!r}: {hint}")

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
        numbers = {name: sp.Rational(value) for name, value in values.items()}
        working, found = digits + 10, self._numbers(wanted, numbers, digits + 10)
        for _ in range(MOST_DOUBLINGS):
            working *= 2
            before, found = found, self._numbers(wanted, numbers, working)
            if all(sp.Abs(found[each] - before[each]) <= sp.Abs(found[each]) / 10**digits for each in wanted):
                break
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
            raise ModelError(f"{name} of {self.model.name} takes {', '.join(missing)}, got {sorted(values)}")
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

    # ---- as a linear system ----

    @property
    def state(self) -> tuple[str, ...]:
        """The names of z: coordinate and velocity of each mass that slips."""
        return tuple(self._names[f"{letter}{n}"] for n in self._moving for letter in "xv")

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of w: the input, where the model has one, then `force_` and the coordinate of each mass that slips [N,
        of a coordinate in rad N m].

        >>> from hopform.model import derive
        >>> derive("sea").channels
        ('i', 'force_theta', 'force_q')
        """
        driven = () if self.model.driven_by is None else (self._names["u"],)
        return (*driven, *(f"force_{coordinate}" for coordinate in self.state[::2]))

    @cached_property
    def _rhs(self) -> sp.Matrix:
        """z' in z, the input, the signs of velocities and the positions of what is held."""
        still = {sp.Symbol(self._names[f"v{n}"]): sp.S.Zero for n in self._held}
        rates = list[sp.Expr]()
        for n in self._moving:
            acceleration = self._by_name[self._names[f"acc_{n}"]].value
            rates += [self.symbols[self._names[f"v{n}"]], sp.expand(self._unfolded(acceleration).subs(still))]
        return sp.Matrix(len(rates), 1, rates)

    @cached_property
    def _z(self) -> list[sp.Symbol]:
        return [self.symbols[name] for name in self.state]

    @cached_property
    def M(self) -> sp.Matrix:
        """The matrix of z' = M z + drive, in parameters.

        >>> from hopform.model import derive
        >>> derive("hopper").mode("actuator").M
        Matrix([
        [     0,       1],
        [-k/m_s, -b2/m_s]])
        """
        size = len(self._z)
        return sp.Matrix(size, size, lambda row, column: sp.factor(self._rhs[row].diff(self._z[column])))

    @cached_property
    def drive(self) -> sp.Matrix:
        """The constant part of z' = M z + drive: by the input, gravity, loads, Coulomb friction with the signs of the
        velocities, and the positions of masses that are held.

        >>> from hopform.model import derive
        >>> derive("joint").drive[1].coeff(derive("joint").symbols["i"])
        k_t/J
        """
        return self._rhs.subs(dict.fromkeys(self._z, 0))

    @cached_property
    def B(self) -> sp.Matrix:
        """The input matrix of z' = M z + B w, w being `channels`.

        >>> from hopform.model import derive
        >>> derive("sea").B
        Matrix([
        [        0,            0,     0],
        [k_m/(J_m*N), 1/(J_m*N**2),     0],
        [        0,            0,     0],
        [        0,            0, 1/J_l]])
        """
        columns = list[sp.Matrix]()
        if self.model.driven_by is not None:
            columns.append(self._rhs.diff(self.symbols[self._names["u"]]))
        for velocity in self._z[1::2]:
            inertia = self._by_name[self._names["kinetic"]].value.diff(velocity, 2)
            columns.append(sp.Matrix([int(z == velocity) / inertia for z in self._z]))
        return sp.Matrix.hstack(*columns).applyfunc(sp.factor)

    def _output(self, output: str | sp.Expr) -> tuple[sp.Matrix, sp.Matrix]:
        """A row of C and of D: of a member of z, of a formula of a state, or of an expression in both."""
        if isinstance(output, str) and output in self._by_name:
            value = self._by_name[output].value
        else:
            value = sp.sympify(output, locals=dict(self.symbols))
        value = self._unfolded(value)
        u = [self.symbols[self._names["u"]]] if self.model.driven_by is not None else []
        still = {self.symbols[self._names[f"v{n}"]]: sp.S.Zero for n in self._held}
        known = {*self._z, *u, *still, *(self.symbols[name] for name in self._known)}
        if unknown := sorted(str(symbol) for symbol in value.free_symbols - known):
            raise ModelError(
                f"output {output!s} of {self.model.name} has {', '.join(unknown)}; allowed: {', '.join(self.state)}, "
                "formulas of a state, and expressions in these and parameters"
            )
        value = value.subs(still)
        slopes = [sp.factor(value.diff(symbol)) for symbol in (*self._z, *u)]
        if {*self._z, *u} & set().union(*(slope.free_symbols for slope in slopes)):
            raise ModelError(f"output {output!s} of {self.model.name} is not linear in {', '.join(map(str, known))}")
        size = len(self._z)
        direct = sp.Matrix([[*slopes[size:], *[sp.S.Zero] * (size // 2)]])
        return sp.Matrix([slopes[:size]]), direct

    @property
    def _known(self) -> list[str]:
        """What is constant within a phase: parameters, signs of velocities, positions of what is held."""
        signs_and_positions = [self._names[f"side_{n}"] for n in (1, 2)]
        signs_and_positions += [self._names[f"x{n}"] for n in self._held]
        return [*(each.name for each in self.model.parameters), *signs_and_positions]

    def _rational(self, matrix: sp.Matrix, values: Mapping[str, Any]) -> sp.Matrix:
        """A matrix of numbers, exactly."""
        numbers = {name: sp.Rational(value) for name, value in values.items()}
        return matrix.applyfunc(lambda entry: sp.nsimplify(self._put("the system", entry, numbers), rational=True))

    def state_space(
        self,
        values: Mapping[str, Any] | None = None,
        *,
        outputs: Sequence[str | sp.Expr] | None = None,
        inputs: Sequence[str] | None = None,
    ) -> Any:
        """A, B, C, D of z' = A z + B w, output = C z + D w: matrices of sympy, or with `values` of parameters arrays of
        NumPy, as `control.StateSpace(*...)` and `scipy.signal.StateSpace(*...)` take them.

        outputs: members of z (by default all), formulas of a state, or expressions in both and parameters, whose constant
        terms are left out. inputs: names of `channels`, by default all.

        >>> from hopform.model import derive
        >>> sea = derive("sea")
        >>> A, B, C, D = sea.state_space(outputs=["k*(theta - q)"], inputs=["i"])
        >>> A.shape, C, D
        ((4, 4), Matrix([[k, 0, -k, 0]]), Matrix([[0]]))
        >>> sea.state_space(sea.defaults, outputs=["q"], inputs=["i"])[1]
        array([[ 0.        ],
               [33.33333333],
               [ 0.        ],
               [ 0.        ]])
        """
        columns = [self._channel(name) for name in (self.channels if inputs is None else inputs)]
        rows = [self._output(output) for output in (self.state if outputs is None else outputs)]
        C = sp.Matrix.vstack(sp.zeros(0, len(self.state)), *(row for row, _ in rows))
        D = sp.Matrix.vstack(sp.zeros(0, len(self.channels)), *(direct for _, direct in rows))
        matrices = (self.M, self.B[:, columns], C, D[:, columns])
        if values is None:
            return matrices
        return tuple(sp.matrix2numpy(self._rational(each, values), dtype=float) for each in matrices)

    def _channel(self, name: str) -> int:
        if name not in self.channels:
            raise ModelError(f"an input of {self.model.name} is one of {', '.join(self.channels)}, got {name!r}")
        return self.channels.index(name)

    def transfer_function(
        self, values: Mapping[str, Any] | None = None, *, output: str | sp.Expr, input: str | None = None
    ) -> Any:
        """The transfer function from an input to an output, in lowest terms: an expression in s, or with `values` of
        parameters num and den, the coefficients from the highest power of s down, as `control.TransferFunction(*...)`
        and `scipy.signal.TransferFunction(*...)` take them; den begins with 1.

        output: a member of z, a formula of a state, or an expression in both and parameters. input: one of `channels`, by
        default the first. Values are taken as the numbers that they are, so poles that the output does not show
        cancel exactly.

        >>> from hopform.model import derive
        >>> joint = derive("joint")
        >>> joint.transfer_function(output="q")
        k_t/(J*s**2 + b*s + k)
        >>> joint.transfer_function({"J": 2, "b": 1, "k": 8, "k_t": 4}, output="q_dot")
        (array([2., 0.]), array([1. , 0.5, 4. ]))
        """
        channel = self._channel(self.channels[0] if input is None else input)
        row, direct = self._output(output)
        matrices = (self.M, self.B[:, channel], row, direct[:, channel])
        if values is not None:
            matrices = tuple(self._rational(each, values) for each in matrices)
        variable = self.symbols[self._names["s"]]
        above, below = state_space.transfer(*matrices[:3], matrices[3][0], variable)
        if values is None:
            return state_space.in_powers(above) / state_space.in_powers(below)
        leading = below.LC()
        return tuple(_row([each / leading for each in part.all_coeffs()], float) for part in (above, below))

    def eigenvalues(self, values: Mapping[str, Any] | None = None) -> Any:
        """The eigenvalues of M [1/s]: 0 of what moves freely, -a of the real pole, and those of the pair, by formulas of
        `poles`; or with `values` of parameters an array of complex numbers.

        >>> from hopform.model import derive
        >>> joint = derive("joint")
        >>> joint.eigenvalues()
        (-sqrt(disc) - p/2, sqrt(disc) - p/2)
        >>> joint.eigenvalues({"J": 1, "b": 2, "k": 5})
        array([-1.-2.j, -1.+2.j])
        """
        found = dict[str, sp.Expr]()
        a, p, disc = (self._by_name.get(self._names[each]) for each in ("a", "p", "disc"))
        free = len(self._z) - (2 if disc else 0) - (1 if a else 0)
        parts = [sp.S.Zero] * free + ([-a.quantity.symbol] if a else [])
        if disc:
            half = p.quantity.symbol / 2 if p else sp.S.Zero
            parts += [-half - sp.sqrt(disc.quantity.symbol), -half + sp.sqrt(disc.quantity.symbol)]
        if values is None:
            return tuple(parts)
        found = self._settled({str(n): value for n, value in enumerate(parts)}, values, 17)
        return _row(list(found.values()), complex)

    def propagator(self, values: Mapping[str, Any] | None = None) -> Any:
        """Phi = exp(M t) and Gamma of z(t) = Phi z(0) + Gamma w, exact over a time t [s] in which w is constant: in the
        responses of `states`, which hold for all poles, for equal ones and for those at 0, too; or with `values` of
        parameters and t arrays of NumPy.

        The columns of Phi are the derivatives of the state at time t by the start of the phase. With t the time of a tick,
        Phi and Gamma are A and B of the sampled system under a zero-order hold.

        >>> from hopform.model import derive
        >>> cart = derive("cart")
        >>> Phi, Gamma = cart.propagator()
        >>> Phi
        Matrix([
        [1,  W*a1_v1 + t],
        [0, Wd*a1_v1 + 1]])
        >>> cart.propagator(cart.defaults | {"t": 0.001})[0]
        array([[1.00000000e+00, 9.89244485e-04],
               [0.00000000e+00, 9.78566369e-01]])
        """
        # Of the velocity of mass n, over P and counted from the start, the numerators are linear in start and drive.
        numerators = dict[sp.Symbol, sp.Expr]()
        for step in laplace.numerators(self._moving) if self._moving else ():
            numerators[step.symbol] = sp.expand(step.value.xreplace(numerators))
        starts = [column for n in self._moving for column in _BY_START[n]]
        drives = [DRIVE.symbols[n - 1] for n in self._moving]
        rows = list[list[sp.Expr]]()
        for n in self._moving:
            h3, h2, h1 = (numerators[symbol] for symbol in laplace.NAMES[n])
            columns = [[sign * h.diff(by) for h in (h3, h2, h1)] for by, sign in (*starts, *((by, 1) for by in drives))]
            rows.append([c3 * W + c2 * W1 + c1 * W2 for c3, c2, c1 in columns])
            rows.append([c3 * Wd + c2 * W + c1 * W1 for c3, c2, c1 in columns])
            own = 2 * self._moving.index(n)
            rows[-2][own] += 1
            rows[-2][own + 1] += t
            rows[-1][own + 1] += 1
        size, masses = len(rows), len(self._moving)
        found = sp.Matrix(size, size + masses, [each for row in rows for each in row]).applyfunc(self._here)
        accelerations = self.B[1::2, :]
        matrices = found[:, :size], found[:, size:] * accelerations
        if values is None:
            return matrices
        entries = {f"{n} {k}": each for n, matrix in enumerate(matrices) for k, each in enumerate(matrix)}
        numbers = iter(self._settled(entries, values, 17).values())
        of_numbers = (sp.Matrix(*matrix.shape, [next(numbers) for _ in matrix]) for matrix in matrices)
        return tuple(sp.matrix2numpy(each, dtype=float) for each in of_numbers)

    def _here(self, value: sp.Expr) -> sp.Expr:
        """An expression in letters of the derivation in symbols of the door; what has none is 0 for every robot."""
        letters = {symbol: self.symbols.get(self._names[symbol.name], sp.S.Zero) for symbol in value.free_symbols}
        value = sp.expand(value.xreplace(letters))
        responses = (self.symbols.get(self._names[each.name]) for each in (Wd, W, W1, W2))
        return sp.collect(value, [each for each in responses if each is not None])


def _row(values: Sequence[sp.Expr], kind: type) -> Any:
    """An array of NumPy."""
    return sp.matrix2numpy(sp.Matrix([values]), dtype=kind)[0]


_BY_START = {1: ((y, 1), (v1, 1)), 2: ((y, -1), (v2, 1))}
"""Of each mass what its position and velocity are in numerators: y is x1 - x2 and a length."""


@dataclass(frozen=True, repr=False)
class Derivation(Mode):
    """The derivation of a model: the formulas of the mode in which nothing is held, and the other modes.

    >>> from hopform.model import derive
    >>> hopper = derive("hopper")
    >>> hopper.equations_of_motion["acc_2"]
    (-b2*v2 - f2*m_s*side_2 - g*m_s + k*(L0 + c + x1 - x2))/m_s
    >>> hopper.formula("H2").numbers, hopper.numerators["H2"]
    ((14,), beta*q_1 + beta_1*q_2 - gamma*p_1)
    """

    def __repr__(self) -> str:
        owns = (own for own in self.model.names if own is not None)
        driven = self.model.driven_by
        rows = {
            self.model.name: self.model.title,
            "coordinates": ", ".join(
                f"{own.coordinate} [{own.unit}] of the {own.thing}, velocity {own.velocity}" for own in owns
            ),
            "input": "none" if driven is None else f"{driven.name} [{driven.unit}]",
            "parameters": ", ".join(each.name for each in self.model.parameters),
            "formulas": ", ".join(f"{group} {len(found)}" for group in GROUPS if (found := self._group(group))),
            "modes, by what is held": "; ".join(f"{each.name} (order {each.order})" for each in self.modes),
        }
        return "\n".join(f"{name}: {text}" for name, text in rows.items())

    @cached_property
    def modes(self) -> tuple[Mode, ...]:
        """The modes of the model, by what is held.

        >>> from hopform.model import derive
        >>> [(each.held, each.order) for each in derive("hopper").modes]
        [((), 3), (('actuator',), 2), (('body',), 2), (('actuator', 'body'), 0)]
        """
        free = free_masses(self.model)
        held_by_size = ((), *((n,) for n in free), *((free,) if len(free) > 1 else ()))
        margins = {
            n: [f"{own.coordinate}_stick_margin_{way}" for way in ("forward", "backward")]
            for n, own in enumerate(self.model.names, 1)
            if own is not None
        }
        return tuple(
            Mode(
                self.model,
                held,
                self.assumptions,
                {name: self.event_functions[name] for n in held for name in margins[n]},
            )
            for held in held_by_size
        )

    def mode(self, name: str) -> Mode:
        """The mode of a name: of what is held, or "nothing".

        Raises ModelError, which says which there are, for another.

        >>> from hopform.model import derive
        >>> derive("hopper").mode("actuator").states["v2_t"]
        H2_2*W + H3_2*Wd + v2_0
        """
        wanted = {each.strip() for each in name.split(",")}
        for each in self.modes:
            if wanted == set(each.name.split(", ")):
                return each
        allowed = ", ".join(repr(each.name) for each in self.modes)
        raise ModelError(f"a mode of {self.model.name} is one of {allowed}, what is held in it, got {name!r}")


@cache
def _shipped(name: str, assumptions: bool) -> Derivation:
    return Derivation(shipped(name), assumptions=assumptions)


def derive(model: str | Path, *, assumptions: bool = False) -> Derivation:
    """The derivation of a model that ships, by its name, or of a model file, which is run as Python.

    assumptions: whether symbols have those of their domains, positive, nonnegative, real, so that sympy simplifies more;
    else they are plain, as a user's `symbols` and `sympify` make them. `symbols` has either kind by name.

    Raises ModelError, which names the file, for a model that the closed form cannot carry.

    >>> from hopform.model import derive
    >>> derive("hopper").model.title
    'A series-elastic hopper with viscous and Coulomb friction.'
    >>> derive("joint").symbols["J"].is_positive, derive("joint", assumptions=True).symbols["J"].is_positive
    (None, True)
    """
    if str(model) in SHIPPED:
        return _shipped(str(model), assumptions)
    path = Path(model)
    if not path.is_file():
        raise ModelError(f"there is no model file {path}; models that ship: {', '.join(SHIPPED)}")
    return Derivation(read_model(path), assumptions=assumptions)
