"""A mode of a model: its formulas, and the linear system that it is."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import sympy as sp

from .maths import laplace, state_space
from .mode_formulas import ModeFormulas
from .model.equations import ModelError
from .model.quantities import DRIVE, W1, W2, W, Wd, t, v1, v2, y, y_v1


class Mode(ModeFormulas):
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
        [          0,            0,     0],
        [k_m/(J_m*N), 1/(J_m*N**2),     0],
        [          0,            0,     0],
        [          0,            0, 1/J_l]])
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
            try:
                value = sp.sympify(output, locals=dict(self.symbols))
            except (sp.SympifyError, TypeError) as error:
                raise ModelError(f"output {output!r} of {self.model.name} is no expression of sympy") from error
            value = value.xreplace({each: self.symbols.get(each.name, each) for each in value.free_symbols})
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
            raise ModelError(
                f"output {output!s} of {self.model.name} is not linear in {', '.join(map(str, (*self._z, *u)))}"
            )
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
        numbers = self._given(values)
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
        columns = [self._channel(name) for name in (self.channels if inputs is None else _listed(inputs))]
        rows = [self._output(output) for output in (self.state if outputs is None else _listed(outputs))]
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
        if input is None and not self.channels:
            raise ModelError(f"nothing moves in {self._called}: it has no inputs")
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
        for step in laplace.numerators(self._moving, self.model.rate_of_gear) if self._moving else ():
            numerators[step.symbol] = sp.expand(step.value.xreplace(numerators))
        stretch = {1: self.model.rate_of_gear, 2: -sp.S.One}  # of the spring, per x_1 and per x_2
        starts = [column for n in self._moving for column in ((y, stretch[n]), ((v1, v2)[n - 1], sp.S.One))]
        drives = [DRIVE.symbols[n - 1] for n in self._moving]
        rows = list[list[sp.Expr]]()
        for n in self._moving:
            h3, h2, h1 = (numerators[symbol] for symbol in laplace.NAMES[n])
            columns = [[per * h.diff(by) for h in (h3, h2, h1)] for by, per in (*starts, *((by, 1) for by in drives))]
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
        letters = {each: self.symbols.get(self._names[each.name], sp.S.Zero) for each in value.free_symbols - {y_v1}}
        letters[y_v1] = self._plain(self.model.value(self.model.ratio))
        value = sp.expand(value.xreplace(letters))
        responses = (self.symbols.get(self._names[each.name]) for each in (Wd, W, W1, W2))
        return sp.collect(value, [each for each in responses if each is not None])


def _listed(names: str | Sequence[Any]) -> Sequence[Any]:
    """Names, of which one may stand by itself."""
    return (names,) if isinstance(names, str) else names


def _row(values: Sequence[sp.Expr], kind: type) -> Any:
    """An array of NumPy."""
    return sp.matrix2numpy(sp.Matrix([values]), dtype=kind)[0]
