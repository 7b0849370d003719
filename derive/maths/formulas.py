r"""The derivation in the paper's order, as named formulas of any model: from the Lagrangian to event functions.

Each formula is in terms of parameters, inputs and other formulas. x1, v1, x2, v2 are a state, x1_0, v1_0, x2_0,
v2_0 that at the start of a phase, x1_t, v1_t, x2_t, v2_t that at time t. With Q_i = s^2 + p_i s + q_i and K_i, what the
other mass does,

    s Q_1 X_1 = s^2 x_1(0) + s beta_1 + lambda_2 + s K_1 X_2                                      (6)
    s Q_2 X_2 = s^2 x_2(0) + s beta   - gamma    + s K_2 X_1                                      (7)

Q_1 Q_2 - K_1 K_2 = s P, because no force changes where both masses move together: one s of (6), (7) cancels, and

    X_i = (x_i(0) s^4 + H_4 s^3 + H_3 s^2 + H_2 s + H_1)/(s^2 P)                                  (11), (16)

over P = (s + a)(s^2 + p s + q), which x_1 and x_2 share. R and W are the inverse transforms of 1/(s^2 + p s + q) and
1/P. The states are sums of W and its integrals, which holds for all poles: for double ones, and for those at 0, which
are an integrator or two of them. What is 0 for every robot of the model is taken out of the denominator before it is
split.

A quotient by a rate has its limit beside it as a case, exactly at 0. Rounded numbers need more: digits are lost near 0
and near equal poles, so code calls the kernels, which choose what loses none, and are printed with it.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import sympy as sp
from sympy.codegen.cfunctions import log1p

from ..ir import Authored, Own, Quantity, Shown, Step, unfold
from ..model import words
from ..model.equations import Model, kinetic
from ..model.quantities import *
from . import control, elements, energy, laplace, modes, partial_fractions, work
from .elements import ELEMENTS
from .kernels import call
from .work import int_W1W1, int_WdWd, int_WW

GROUPS = {
    "lagrangian": "Lagrangian and generalised forces",
    "equations_of_motion": "Accelerations and their coefficients",
    "transfer": "Laplace transforms",
    "numerators": "Numerators of the transforms",
    "poles": "Denominators of the transforms and their roots",
    "partial_fractions": "Partial fractions of the transforms",
    "states": "The state over time",
    "energies": "Energies, and the power of each force",
    "works": "The work of each force over a phase",
    "control": "Quantities of the controller",
    "event_functions": "Event functions: the first zero ends a phase",
}
"""The groups of formulas in their order, and what each holds."""


@dataclass(frozen=True)
class Formula:
    """A named formula: its quantity, its value, its group, and the equations of the paper that it is.

    >>> from hopform.model import derive
    >>> formula = derive("joint").formula("q_1")
    >>> formula.equation, formula.quantity.unit, formula.group
    (Eq(q_1, k/J), '1/s^2', 'poles')

    code: the same for numbers that are rounded, by kernels that lose no digits; None where that is the value. key: its
    name in the derivation, whatever the model calls it.
    """

    quantity: Quantity
    value: sp.Expr
    group: str
    numbers: tuple[int, ...] = ()
    code: sp.Expr | None = None
    key: str = ""

    @property
    def name(self) -> str:
        return self.quantity.name

    @property
    def in_code(self) -> sp.Expr:
        """What code computes."""
        return self.value if self.code is None else self.code

    @property
    def equation(self) -> sp.Eq:
        """The formula as an equation of sympy."""
        return sp.Eq(self.quantity.symbol, self.value, evaluate=False)

    def _repr_latex_(self) -> str:
        return f"${sp.latex(self.equation)}$"


# ---- names that the derivation has beside those of the generated code ----

_MARK = "@"
"""Behind a name of this module until all formulas are made: a parameter of the model may have the same name."""


def _named(*rows: tuple[str, str, str, str]) -> dict[str, Quantity]:
    return {name: Quantity(f"{name}{_MARK}", glyph, unit, meaning) for name, glyph, unit, meaning in rows}


_STARTS = _named(
    ("x1_0", "x_1(0)", "m", "displacement of the actuator at the start of the phase"),
    ("v1_0", r"\dot{x}_1(0)", "m/s", "velocity of the actuator at the start of the phase"),
    ("x2_0", "x_2(0)", "m", "height of the body at the start of the phase"),
    ("v2_0", r"\dot{x}_2(0)", "m/s", "velocity of the body at the start of the phase"),
    ("s", "s", "1/s", "variable of the Laplace transform"),
)
_OWN = _STARTS | _named(
    ("kinetic", "T", "J", "kinetic energy"),
    ("potential", "V", "J", "potential energy"),
    ("L", r"\mathcal{L}", "J", "Lagrangian"),
    ("force_1", "Q_1", "N", "generalised force on the actuator, beside the Lagrangian"),
    ("force_2", "Q_2", "N", "generalised force on the body, beside the Lagrangian"),
    ("acc_1", r"\ddot{x}_1", "m/s^2", "acceleration of the actuator"),
    ("acc_2", r"\ddot{x}_2", "m/s^2", "acceleration of the body"),
    ("beta_1", r"\beta_1", "m/s", "initial conditions of the actuator in its transform: velocity, and position times damping"),
    ("beta", r"\beta", "m/s", "initial conditions of the body in its transform: velocity, and position times damping"),
    ("lambda_2", r"\lambda_2", "m/s^2", "constant part of the acceleration of the actuator"),
    ("gamma", r"\gamma", "m/s^2", "constant part of the acceleration of the body, with its sign reversed"),
    ("X1", "X_1(s)", "m s", "transform of the actuator's displacement"),
    ("X2", "X_2(s)", "m s", "transform of the body's height"),
    ("X1_by_X2", r"X_1(s)\vert_{2}", "m s", "transform of the actuator's displacement, by that of the body's height"),
    ("X2_by_X1", r"X_2(s)\vert_{1}", "m s", "transform of the body's height, by that of the actuator's displacement"),
    ("Z", "Z(s)", "m s", "contribution of the body to the transform of the actuator's displacement"),
    ("X1_by_u", "G_1(s)", "m/A", "transfer function from the input to the actuator's displacement"),
    ("X2_by_u", "G_2(s)", "m/A", "transfer function from the input to the body's height"),
    ("apart", "z", "1/s", "distance of the real pole from the mean of the three"),
    ("disc", r"\Delta", "1/s^2", "discriminant of the pair of poles; < 0: underdamped"),
    ("w", r"\omega", "1/s", "square root of the magnitude of the discriminant"),
    ("slow", "r", "1/s", "rate of the slower pole of an overdamped pair"),
    ("slow1", r"\int e^{-rt}", "s", "integral of exp(-r t)"),
    ("slow2", r"\iint e^{-rt}", "s^2", "double integral of exp(-r t)"),
    ("y_0", "y(0)", "m", "spring deflection at t = 0, from its free length"),
    ("x1_split", "x_1(t)", "m", "displacement of the actuator at time t, by its partial fractions"),
    ("x2_split", "x_2(t)", "m", "height of the body at time t, by its partial fractions"),
    ("x1_t", "x_1(t)", "m", "displacement of the actuator at time t"),
    ("v1_t", r"\dot{x}_1(t)", "m/s", "velocity of the actuator at time t"),
    ("x2_t", "x_2(t)", "m", "height of the body at time t"),
    ("v2_t", r"\dot{x}_2(t)", "m/s", "velocity of the body at time t"),
    ("x1_braking", r"a_{1,\text{rest}}", "m/s^2", "braking criterion of the actuator: it comes to rest if this is > 0 or the poles are underdamped"),
    ("x2_braking", r"a_{2,\text{rest}}", "m/s^2", "braking criterion of the body: it comes to rest if this is > 0 or the poles are underdamped"),
    ("x1_time_to_rest", r"t_{1,\text{rest}}", "s", "first time at which the actuator's velocity is 0, if it comes to rest"),
    ("x2_time_to_rest", r"t_{2,\text{rest}}", "s", "first time at which the body's velocity is 0, if it comes to rest"),
    ("aed_power", r"\dot{U}_{delta}", "W", "rate of the body's energy, the integrand of the analytical energy delta"),
    ("aed_work", "U_{delta}", "J", "analytical energy delta: change of the body's energy from the start of the phase to time t"),
    ("E_td", "E_{td}", "J", "energy of the body at touchdown, after the impact"),
    ("E_dist", "E_{dist}", "J", "energy of a step in the ground"),
    ("E_spring", "E_{spring}", "J", "energy of height and spring that (27) leaves out as printed"),
    ("contact_force", "N", "N", "contact force of the leg: the foot takes off where it falls to 0"),
    ("target", "q_{target}", "m", "target of the law"),
    ("asked", "u_{law}", "A", "current that the law demands, before the limit"),
    ("p_law", "p_K", "1/s", "under the law: sum of the rates of the poles"),
    ("q_law", "q_K", "1/s^2", "under the law: product of the rates of the poles"),
    ("room_up", r"g_{u,\text{up}}", "A", "distance of the demanded current to the upper limit; the current saturates where this is 0"),
    ("room_down", r"g_{u,\text{down}}", "A", "distance of the demanded current to the lower limit; the current saturates where this is 0"),
)  # fmt: skip
for _n, _unit in ((4, "m/s"), (3, "m/s^2"), (2, "m/s^3"), (1, "m/s^4")):
    for _hat, _of in (("", "the body"), ("_hat", "the actuator")):
        _glyph = rf"\hat{{H}}_{_n}" if _hat else f"H_{_n}"
        _OWN |= _named((f"H{_n}{_hat}", _glyph, _unit, f"numerator of {_of}, terms in s^{_n - 1}"))
for _letter, _unit, _meaning in (
    ("A", "m", "constant term"), ("B", "m/s", "coefficient of t, the velocity of the drift,"), ("C", "m", "coefficient of exp(-a t)"),
    ("D", "m", "coefficient of R'"), ("E", "m/s", "coefficient of R"),
):  # fmt: skip
    for _hat, _of in (("", "the body"), ("_hat", "the actuator")):
        _index = "_R" if _letter == "E" else ""  # the energy is E
        _glyph = (rf"\hat{{{_letter}}}" if _hat else _letter) + _index
        _OWN |= _named((f"{_letter}{_hat}", _glyph, _unit, f"{_meaning} in the motion of {_of}"))


def _symbol(name: str) -> sp.Symbol:
    return _OWN[name].symbol


x1_0, v1_0, x2_0, v2_0, y_0 = map(_symbol, ("x1_0", "v1_0", "x2_0", "v2_0", "y_0"))
beta_1, beta, lambda_2, gamma = map(_symbol, ("beta_1", "beta", "lambda_2", "gamma"))
X1, X2, disc, w = map(_symbol, ("X1", "X2", "disc", "w"))
slow, slow1, slow2 = map(_symbol, ("slow", "slow1", "slow2"))
sigma, Q_s, T_s = partial_fractions.SHIFTED.symbols
s = sp.Symbol(f"s{_MARK}")
_AT_START = {x1: x1_0, v1: v1_0, x2: x2_0, v2: v2_0, y: y_0}
_STARTS_OF = {1: (x1_0, v1_0), 2: (x2_0, v2_0)}
_HATS = {1: "_hat", 2: ""}
"""The paper has a hat over what belongs to x_1."""


def _quantity(symbol: sp.Symbol) -> Quantity:
    """The quantity of a symbol of the generated code, or of this module."""
    return _KNOWN.get(symbol) or _OWN[symbol.name.removesuffix(_MARK)]


_KNOWN = {
    quantity.symbol: quantity
    for record in (
        RATES, POLES, DRIVE, MOTION, DECAY, PAIR, BASIS, FREE, ENERGY, modes.FRICTION, partial_fractions.SHIFTED,
        work.SPLIT, work.FADES, work.SQUARES, work.BETWEEN, work.OF_PAIR, *(CHI, TURNED, control.V_AFTER, control.THRESHOLD, control.APEX, control.OBJECTIVE, laplace.REST),
    )
    for quantity in record.quantities
}  # fmt: skip


def _made(group: str, symbol: sp.Symbol | str, value: sp.Expr, *numbers: int, code: sp.Expr | None = None) -> Formula:
    quantity = _OWN[symbol] if isinstance(symbol, str) else _quantity(symbol)
    return Formula(quantity, sp.sympify(value), group, numbers, code)


def _of_steps(group: str, steps: Iterable[Step], symbols: Sequence[sp.Symbol] = ()) -> Iterator[Formula]:
    """The steps of the generated code as formulas, or those that are wanted."""
    return (_made(group, step.symbol, step.value) for step in steps if not symbols or step.symbol in symbols)


_ARGUMENTS = (
    *STATE.quantities, BODY_HEIGHT, CURRENT, SIDE_1, SIDE_2, TIME,
)  # fmt: skip
_OF_CONTACT = control.AED, control.H_DES, control.STEP, control.X1_T, HEIGHT
"""What formulas take beside parameters and the start of a phase, and of a hop."""


# ---- the derivation ----


def inputs(model: Model) -> dict[str, Quantity]:
    """What formulas take beside each other, by name: parameters, inputs, a state and that at the start of a phase."""
    parameter_names = {parameter.name for parameter in model.parameters}
    quantities = (*_ARGUMENTS, *(_OF_CONTACT if model.has_contact else ()), *((_OWN["target"],) if model.law else ()))
    others = (_final(quantity, parameter_names, model) for quantity in (*_STARTS.values(), *quantities))
    return {quantity.name: quantity for quantity in (*map(Shown.of, model.parameters), *others)}


def formulas(model: Model, moving: tuple[int, ...] = ()) -> tuple[Formula, ...]:
    """The derivation of a model as formulas, group by group; one may read another of a later group.

    moving: the masses that slip in the phase, by default all that may; the others are held, their
    velocities 0. What is 0 for every robot of the model is put in where it stands, and what would divide by that is
    left out.
    """
    free = free_masses(model)
    moving = moving or free
    integrates = _integrates(model, moving)
    derived = (
        *_lagrangian(model, free),
        *_equations_of_motion(model, free),
        *_transfer(model, free, moving),
        *_poles(moving, integrates),
        *_partial_fractions(moving, integrates),
        *_states(model, moving, integrates),
        *_energies(model, free),
        *_works(model, moving, integrates),
        *_control(model),
        *_event_functions(model, free),
        *_law(model),
    )
    shown = [_each(each, lambda value: _shown(model, value)) for each in derived]
    shown = shown if model.is_of_the_paper else [replace(each, numbers=()) for each in shown]
    parameter_names, order = {parameter.name for parameter in model.parameters}, list(GROUPS)
    return tuple(
        sorted(_finished(list(_without_zeros(shown)), parameter_names, model), key=lambda each: order.index(each.group))
    )


def _shown(model: Model, value: sp.Expr) -> sp.Expr:
    """A formula in letters by the parameters of the model."""
    still = model.still
    still |= {_AT_START[symbol]: zero for symbol, zero in still.items()}
    return model.value(value.subs(y_v1, model.ratio)).xreplace(still)


def names(model: Model) -> dict[str, str]:
    """What quantities of the derivation are called in the formulas of a model, by their names here: "x1" may be "q"."""
    parameter_names = {parameter.name for parameter in model.parameters}
    return {
        quantity.name.removesuffix(_MARK): _final(quantity, parameter_names, model).name
        for quantity in (*_OWN.values(), *_KNOWN.values(), *_ARGUMENTS, *_OF_CONTACT)
    }


def _each(formula: Formula, changed: Callable[[sp.Expr], sp.Expr]) -> Formula:
    """A formula with its value, and what code computes, changed."""
    code = None if formula.code is None else changed(formula.code)
    return replace(formula, value=changed(formula.value), code=code)


def assumed(formulas: Sequence[Formula], taken: Mapping[str, Quantity], variable: str) -> Iterator[Formula]:
    """Formulas in symbols with the assumptions of their domains. The variable of the Laplace transform has none, and
    neither have transforms.
    """
    of_variable = {each.name for each in formulas if variable in map(str, each.value.free_symbols)} | {variable}
    quantities = {
        quantity.symbol: Shown.of(quantity, quantity.name not in of_variable)
        for quantity in (*taken.values(), *(each.quantity for each in formulas))
    }
    symbols = {plain: quantity.symbol for plain, quantity in quantities.items()}
    for formula in formulas:
        changed = _each(formula, lambda value: value.xreplace(symbols))
        yield replace(changed, quantity=quantities[formula.quantity.symbol])


def _integrates(model: Model, moving: tuple[int, ...]) -> bool:
    """Whether the denominator of a phase has a root at 0 for every robot of the model."""
    lowest = elements.POLYNOMIALS[moving][-1]
    return bool(model.value(_value_of(laplace.rates_of(model), lowest)) == 0)


def free_masses(model: Model) -> tuple[int, ...]:
    """The masses that move."""
    return model.moving


_MAY_VANISH = ("equations_of_motion", "numerators", "poles")
_ACCELERATIONS = (_OWN["acc_1"], _OWN["acc_2"])
"""Of each mass that moves, 0 too where no force acts on it."""


def _without_zeros(derived: Iterable[Formula]) -> Iterator[Formula]:
    """The formulas in which coefficients that are 0 are put in, without those, without what divides by one of them, and
    without what reads such a formula.
    """
    zeros, absent = dict[sp.Symbol, sp.Expr](), set[sp.Symbol]()
    for formula in derived:
        simplified = _each(formula, lambda value: value.xreplace(zeros))
        if simplified.value == 0 and simplified.group in _MAY_VANISH and simplified.quantity not in _ACCELERATIONS:
            zeros[simplified.quantity.symbol] = sp.S.Zero
        elif simplified.value.has(sp.zoo, sp.nan) or simplified.value.free_symbols & absent:
            absent.add(simplified.quantity.symbol)
        else:
            yield simplified


def _final(quantity: Quantity, parameter_names: set[str], model: Model) -> Shown:
    """A quantity under its name, a coordinate's in the model, and in its words, glyphs and units; where a parameter of the
    model has that name, with an underscore behind it. Beside a parameter t time is tau.
    """
    name = quantity.name.removesuffix(_MARK)
    letter, _, index = name.partition("_")
    if name == "target" and model.input is not None:
        name = model.input.name
        taken = parameter_names
        quantity = replace(quantity, glyph=model.input.glyph, unit=model.input.unit, meaning=model.input.meaning)
    else:
        if letter in ("x1", "v1", "x2", "v2", "u") and (index in ("", "0", "t") or letter[0] == "x"):
            called = _called(model, sp.Symbol(letter, real=True))
            name = f"{called}_{index}" if index else called
            taken = parameter_names
        else:
            theirs = (_called(model, symbol) for symbol in (x1, v1, x2, v2, u))
            taken = parameter_names | {f"{each}{behind}" for each in theirs for behind in ("", "_0", "_t")}
        quantity = quantity if isinstance(quantity, Authored) else words.of_quantity(model, quantity)
    glyph = quantity.glyph
    if TIME.name in parameter_names:
        name = "tau" if name == TIME.name else name
        glyph = r"\tau" if glyph == TIME.glyph else glyph.replace("(t)", r"(\tau)").replace("{-at}", r"{-a\tau}")
    while name in taken:
        name += "_"
    return Shown.of(replace(quantity, name=name, glyph=glyph))


def _called(model: Model, symbol: sp.Symbol) -> str:
    """What a model calls a member of a state, or the current, which a law may set."""
    return model.driven_by.name if symbol == u and model.driven_by is not None else elements.name_of(model, symbol)


def _finished(shown: Sequence[Formula], parameter_names: set[str], model: Model) -> Iterator[Formula]:
    quantities = (*_OWN.values(), *_KNOWN.values(), *_ARGUMENTS, *_OF_CONTACT, *(each.quantity for each in shown))
    finals = {quantity.symbol: _final(quantity, parameter_names, model).symbol for quantity in quantities}
    finals |= {Own(name, real=True): sp.Symbol(name) for name in parameter_names}
    finals[s] = finals[_symbol("s")]
    for formula in shown:
        yield replace(
            _each(formula, lambda value: value.xreplace(finals)),
            quantity=_final(formula.quantity, parameter_names, model),
            key=formula.key or formula.name.removesuffix(_MARK),
        )


def _lagrangian(model: Model, free: tuple[int, ...]) -> Iterator[Formula]:
    group = "lagrangian"
    yield _made(group, "kinetic", kinetic)
    if has_potential := model.declares(k) or any(weight != 0 for weight in model.weights):
        yield _made(group, "potential", model.potential)
    yield _made(group, "L", _symbol("kinetic") - (_symbol("potential") if has_potential else 0))
    for n in free:
        acts = any(map(model.declares, _FORCES_OF[n])) or any((f.force_1, f.force_2)[n - 1] != 0 for f in model.further)
        if acts:
            yield _made(group, f"force_{n}", model.forces[n - 1])


_FORCES_OF = {1: (c, gamma2, b1, f1), 2: (b2, f2)}
"""The letters of the generalised forces on each mass."""


def _equations_of_motion(model: Model, free: tuple[int, ...]) -> Iterator[Formula]:
    group, numbers = "equations_of_motion", {1: (1, 3), 2: (2, 4)}
    for n in free:
        mass, coordinate = ((m_eff, x1), (m_s, x2))[n - 1]
        gradient = sum(map(sp.factor, sp.Add.make_args(model.lagrangian.diff(coordinate))), sp.S.Zero)
        balance = gradient + model.forces[n - 1]
        yield _made(group, f"acc_{n}", balance / mass, *numbers[n])
    coefficients = [symbol for n in free for symbol in COEFFICIENTS[n]]
    yield from _of_steps(group, (*laplace.rates_of(model), *laplace.drive_of(model)), coefficients)


COEFFICIENTS = {1: (a1_y, a1_v1, a1_v2, a1_u, a1_0, C_1), 2: (a2_y, a2_v1, a2_v2, a2_0, C_2)}
"""Of the acceleration of each mass."""


def _transfer(model: Model, free: tuple[int, ...], moving: tuple[int, ...]) -> Iterator[Formula]:
    """(6)-(17): the transforms, the constants that they name, and their numerators."""
    rest = dict.fromkeys((x1, x2, v1, v2), 0)
    if 1 in free:
        yield _made("transfer", lambda_2, sp.expand(model.accelerations[0].subs(rest)), 10)
    if 2 in free:
        yield _made("transfer", gamma, sp.expand(-model.accelerations[1].subs(rest)), 8)
    polynomials = [each for masses, each in elements.POLYNOMIALS.items() if {*masses} <= {*free}]
    yield from _of_steps("poles", laplace.rates_of(model), [symbol for each in polynomials for symbol in each])
    if len(moving) == 2:
        yield from _transfer_of_both(model)
    else:
        yield from _transfer_of_one(model, moving[0])
    if model.driven_by is not None and 1 in moving:
        yield from _transfer_of_input(model, len(moving))


def _denominator(masses: tuple[int, ...]) -> sp.Expr:
    symbols = elements.POLYNOMIALS[masses]
    return s ** len(symbols) + sum(symbol * s**power for power, symbol in enumerate(reversed(symbols)))


def _transfer_of_both(model: Model) -> Iterator[Formula]:
    q_1s, q_2s, cubic = _denominator((1,)), _denominator((2,)), _denominator((1, 2))
    k_1s, k_2s = q_1 / model.ratio + a1_v2 * s, q_2 * model.ratio + a2_v1 * s
    yield _made("transfer", beta_1, v1_0 - a1_v1 * x1_0 - a1_v2 * x2_0)
    yield _made("transfer", beta, v2_0 - a2_v2 * x2_0 - a2_v1 * x1_0, 9)
    first, second = s**2 * x1_0 + s * beta_1 + lambda_2, s**2 * x2_0 + s * beta - gamma
    yield _made("transfer", "X1_by_X2", (first + s * k_1s * X2) / (s * q_1s), 6)
    yield _made("transfer", "X2_by_X1", (second + s * k_2s * X1) / (s * q_2s), 7)
    numbers = {"H4": (12,), "H3": (13,), "H2": (14,), "H1": (15,)}
    for n, numerator in ((2, q_1s * second + k_2s * first), (1, q_2s * first + k_1s * second)):
        start, *terms = sp.Poly(sp.expand(numerator), s).all_coeffs()
        names = [f"H{power}{_HATS[n]}" for power in (4, 3, 2, 1)]
        codes = dict.fromkeys(names) | {names[-1]: _without_pull(model, n)}
        for name, value in zip(names, terms, strict=True):
            yield _made("numerators", name, value, *numbers.get(name, ()), code=codes[name])
        top = start * s**4 + sum(_symbol(name) * s**power for name, power in zip(names, (3, 2, 1, 0), strict=True))
        yield _made("transfer", f"X{n}", top / (s**2 * cubic), 11 if n == 2 else 16)
    yield _made("transfer", "Z", k_1s * X2 / q_1s, 17)


def _without_pull(model: Model, n: int) -> sp.Expr:
    """H_1 in parameters: what springs pull both masses by where all coordinates are 0 cancels in it, and so is not there."""
    value = q_1 * C_2 + q_2 * model.ratio * C_1 if n == 2 else q_2 * C_1 + q_1 / model.ratio * C_2
    return sp.expand(unfold(value, (*laplace.rates_of(model), *laplace.drive_of(model))))


def _transfer_of_input(model: Model, masses: int) -> Iterator[Formula]:
    """The transfer functions from the input to each coordinate, by (6), (7) from rest at 0 without the constant forces."""
    if masses == 1:
        yield _made("transfer", "X1_by_u", a1_u / _denominator((1,)))
        return
    denominator = s * _denominator((1, 2))
    yield _made("transfer", "X1_by_u", a1_u * _denominator((2,)) / denominator)
    yield _made("transfer", "X2_by_u", a1_u * (q_2 * model.ratio + a2_v1 * s) / denominator)


def _transfer_of_one(model: Model, n: int) -> Iterator[Formula]:
    """(6) or (7) where the other mass is held: its transform is its position over s, and H_2 = H_1 = 0."""
    velocity, held, constant = {1: (p_1, x2_0 / model.ratio, lambda_2), 2: (p_2, x1_0 * model.ratio, -gamma)}[n]
    start, start_velocity = _STARTS_OF[n]
    names = [f"H{power}{_HATS[n]}" for power in (4, 3)]
    denominator = _denominator((n,))
    yield _made("numerators", names[0], start_velocity + velocity * start)
    yield _made("numerators", names[1], constant + elements.POLYNOMIALS[n,][1] * held)
    top = start * s**2 + _symbol(names[0]) * s + _symbol(names[1])
    yield _made("transfer", f"X{n}", top / (s * denominator), 6 if n == 1 else 7)


def _poles(moving: tuple[int, ...], integrates: bool) -> Iterator[Formula]:
    """The real pole, the most isolated of three or the one at 0, and the pair of the denominator of a phase."""
    group = "poles"
    if len(moving) == 1 and integrates:
        yield _made(group, a, elements.POLYNOMIALS[moving][0])
        return
    if len(moving) == 2 and integrates:
        yield from (_made(group, symbol, value) for symbol, value in ((a, sp.S.Zero), (p, s_1), (q, s_2)))
    elif len(moving) == 2:
        yield _made(group, sigma, s_1 / 3)
        yield _made(group, Q_s, s_2 - s_1**2 / 3)
        yield _made(group, T_s, s_3 - s_1 * s_2 / 3 + 2 * s_1**3 / 27)
        yield _made(group, "apart", _farthest_root(Q_s, T_s))
        isolated = sigma + sp.Piecewise((_symbol("apart"), T_s >= 0), (-_symbol("apart"), True))
        value = sp.Piecewise((0, sp.Eq(s_3, 0)), (isolated, True))
        for symbol, of_root in ((a, value), (p, s_1 - a), (q, s_2 - a * p)):
            yield _made(group, symbol, of_root, code=call("factor_cubic", symbol.name, s_1, s_2, s_3))
    else:
        yield from (_made(group, name, own) for name, own in zip((p, q), elements.POLYNOMIALS[moving], strict=True))
    yield _made(group, disc, p**2 / 4 - q)
    yield _made(group, w, sp.sqrt(sp.Abs(disc)))


def _farthest_root(linear: sp.Symbol, constant: sp.Symbol) -> sp.Expr:
    """The size of the real root of z^3 + linear z + constant that is farthest from 0, in which no digits cancel; its
    sign is that of -constant.
    """
    size = 2 * sp.sqrt(sp.Abs(linear) / 3)
    ratio = 3 * sp.Abs(constant) / (sp.Abs(linear) * size)
    # Not by acosh and acos, which sympy takes for 0 where ratio is near 1, as it is for every stiff robot.
    turned_by = sp.asin(ratio) / 3  # cos(acos(ratio)/3) = cos(pi/6 - asin(ratio)/3)
    grown = (ratio + sp.sqrt(sp.Abs(ratio**2 - 1))) ** sp.Rational(1, 3)
    return sp.Piecewise(
        (sp.Abs(constant) ** sp.Rational(1, 3), sp.Eq(linear, 0)),
        (size * sp.sinh(sp.asinh(ratio) / 3), linear > 0),
        (size * (grown + 1 / grown) / 2, 27 * constant**2 >= 4 * sp.Abs(linear) ** 3),
        (size * (sp.sqrt(3) * sp.cos(turned_by) + sp.sin(turned_by)) / 2, True),
    )


def _partial_fractions(moving: tuple[int, ...], integrates: bool) -> Iterator[Formula]:
    """x_i(t) = A + B t + C exp(-a t) + D R' + E R and its coefficients, where no two poles are equal and none is 0.

    One mass has no pair where its denominator has a root at 0, and no real pole else. Code has the sum by W, which holds
    for all poles.
    """
    group = "partial_fractions"
    if len(moving) == 2:
        yield from _of_steps(group, partial_fractions.residue())
    for n in reversed(moving):
        start, hat = _STARTS_OF[n][0], _HATS[n]
        h4, h3, h2, h1 = (_symbol(f"H{power}{hat}") for power in (4, 3, 2, 1))
        A, B, C, D, E = (_symbol(f"{letter}{hat}") for letter in "ABCDE")
        if len(moving) == 1 and integrates:
            yield _made(group, f"B{hat}", h3 / a)
            yield _made(group, f"A{hat}", (h4 - B) / a)
            yield _made(group, f"C{hat}", start - A)
            yield _split(n, A + B * t + C * e)
            continue
        if len(moving) == 1:
            yield _made(group, f"A{hat}", h3 / q)
            yield _made(group, f"D{hat}", start - A)
            yield _made(group, f"E{hat}", h4 - p * A)
            yield _split(n, A + D * Rd + E * R)
            continue
        number = 18 if n == 2 else 20
        yield _made(group, f"B{hat}", h1 / s_3, number)
        yield _made(group, f"A{hat}", (h2 - s_2 * B) / s_3, number)
        yield _made(group, f"C{hat}", (((start * a - h4) * a + h3) * a**2 - h2 * a + h1) / (a**2 * chi), number)
        yield _made(group, f"D{hat}", start - A - C, number)
        yield _made(group, f"E{hat}", h4 - s_1 * A - B - p * C - a * D, number)
        yield _split(n, A + B * t + C * e + D * Rd + E * R, number)


def _split(n: int, value: sp.Expr, *numbers: int) -> Formula:
    """A coordinate over time as the sum of its partial fractions."""
    return _made("partial_fractions", f"x{n}_split", value, *numbers, code=_symbol(f"x{n}_t"))


def _terms(moving: tuple[int, ...], integrates: bool) -> int:
    """How many of H_3, H_2, H_1 a velocity has."""
    return 3 if len(moving) == 2 else 1 if integrates else 2


def _states(model: Model, moving: tuple[int, ...], integrates: bool) -> Iterator[Formula]:
    group = "states"
    held = {velocity: sp.S.Zero for n, velocity in ((1, v1), (2, v2)) if n not in moving}
    terms = _terms(moving, integrates)
    yield _made(group, "y_0", model.ratio * x1_0 - x2_0 + model.length)
    coefficients = [symbol for n in moving for symbol in laplace.NAMES[n][:terms]]
    coefficients += [H3_y] if len(moving) == 2 else []
    coefficients += _of_stretch(model, moving, terms)
    for step in laplace.numerators(moving, model.rate_of_gear):
        if step.symbol in coefficients:
            value = sp.sympify(step.value).subs(held).subs(_AT_START, simultaneous=True)
            yield _made(group, step.symbol, value)
    yield from _responses(len(moving), integrates)
    for n in moving:
        start, start_velocity = _STARTS_OF[n]
        h3, h2, h1 = (*laplace.NAMES[n][:terms], sp.S.Zero, sp.S.Zero)[:3]
        of_position, of_velocity = {1: (20, 21), 2: (18, 19)}[n]
        yield _made(group, f"x{n}_t", start + start_velocity * t + h3 * W + h2 * W1 + h1 * W2, of_position)
        yield _made(group, f"v{n}_t", start_velocity + h3 * Wd + h2 * W + h1 * W1, of_velocity)
    if len(moving) == 1:
        yield from _rest_of(moving[0], integrates)


def _rest_of(n: int, integrates: bool) -> Iterator[Formula]:
    """When what slips alone comes to rest, in closed form, and the condition that it does.

    With the net force F against the velocity v_0 over the inertia v(t) = 0 is exp(a t) = 1 + a v_0/F behind an
    integrator, tan(w t) = w v_0/(F + p v_0/2) of a pair that rings, and exp(2 w t) = 1 + 2 w v_0/(F + r v_0) of two real
    poles, of which r is the slower one.
    """
    group, braking = "states", _symbol(f"x{n}_braking")
    side, constant, per_y = {1: (side_1, C_1, a1_y), 2: (side_2, C_2, a2_y)}[n]
    speed, force = sp.Abs(_STARTS_OF[n][1]), -side * (constant + per_y * y_0)
    if integrates:
        yield _made(group, f"x{n}_braking", force)
        cases = [(speed / braking, sp.Eq(a, 0)), (a, True)]
    else:
        slower = sp.Piecewise((slow, disc > 0), (p / 2, sp.Eq(disc, 0)), (0, True))
        yield _made(group, f"x{n}_braking", force + speed * slower)
        rings = sp.atan2(w * speed, braking + p * speed / 2) / w
        cases = [(rings, disc < 0), (speed / braking, sp.Eq(disc, 0)), (2 * w, True)]
    *others, (rate, _) = cases
    value, code = (
        sp.Piecewise(*others, (logarithm(rate * speed / braking) / rate, True))
        for logarithm in (lambda more: sp.log(1 + more), log1p)
    )
    yield _made(group, f"x{n}_time_to_rest", value, code=code)


def _responses(order: int, integrates: bool) -> Iterator[Formula]:
    """R and W with what the states read of their derivatives and integrals.

    One mass has W = int R; where its denominator has a root at 0 also R = int exp(-a t).
    """
    group = "states"
    if order == 2 or integrates:
        yield _made(group, e, sp.exp(-a * t))
        yield from _integrals_of_decay(a, e, e1, e2)
    if order == 1 and integrates:
        yield from (_made(group, name, value) for name, value in ((Wd, e1), (W, e2)))
        return
    yield from _responses_of_pair()
    if order == 1:
        yield from (_made(group, name, value) for name, value in ((Wd, R), (W, R1), (W1, R2)))
        return
    split = {step.symbol: step.value for step in partial_fractions.split()}
    if integrates:
        for symbol, of_pair in ((W, R1), (W1, R2), (W2, "R3"), (Wd, R)):
            yield _made(group, symbol, split[symbol], code=call("pair_at", str(of_pair), p, q, t))
        return
    triple = _at_triple_pole([t**2 / 2, t, sp.S.One])
    for symbol in (W, W1, W2, Wd):
        value = sp.Piecewise((triple[symbol].subs(sigma, a), sp.Eq(chi, 0)), (split[symbol], True))
        yield _made(group, symbol, value, code=call("response_at", symbol.name, *_CUBIC, t))


_CUBIC = (a, p, q, s_1, s_2, s_3)
"""The denominator of a phase in which both masses move, its factors first."""


def _at_triple_pole(shifted: list[sp.Expr]) -> dict[sp.Symbol, sp.Expr]:
    """W, its derivative and its integrals at a triple pole, which is not 0.

    shifted: the inverse transform V of 1/s^3, V' and V''.
    """
    jet = dict(zip((partial_fractions.V, partial_fractions.Vd, partial_fractions.Vdd), shifted, strict=True))
    jet[partial_fractions.decay] = sp.exp(-sigma * t)
    response = {step.symbol: step.value.xreplace(jet) for step in partial_fractions.unshift()}
    integrals = (
        (step.symbol, step.value.subs(Wdd, response[Wdd])) for step in partial_fractions.integrals_by_recursion()
    )
    return {W: response[W], Wd: response[Wd], **dict(integrals)}


def _integrals_of_decay(rate: sp.Expr, decay: sp.Expr, once: sp.Symbol, twice: sp.Symbol) -> Iterator[Formula]:
    """The integrals of a decay exp(-rate t), with their limits at a rate of 0."""
    integrals = (once, t, (1 - decay) / rate), (twice, t**2 / 2, (t - once) / rate)
    for n, (name, limit, quotient) in enumerate(integrals, 1):
        value = sp.Piecewise((limit, sp.Eq(rate, 0)), (quotient, True))
        yield Formula(_quantity(name), value, "states", code=call("decay_at", f"e{n}", rate, t))


def _responses_of_pair() -> Iterator[Formula]:
    """R, its derivative and integrals.

    Of two real poles, r the slower one and f the faster, 1/(s (s + r)(s + f)) = (1/(s (s + r)) - 1/((s + r)(s + f)))/f,
    which holds for r = 0. Else q is not 0 beside p^2, and R' + p R + q int R = 1; p = q = 0 is a double integrator.
    """
    group, fastest = "states", p / 2 + w
    rings, fast, late = sp.exp(-p * t / 2), sp.exp(-(p / 2 + w) * t), sp.exp(-(p / 2 - w) * t)
    cases = (disc < 0, disc > 0, True)
    values = rings * sp.sin(w * t) / w, (late - fast) / (2 * w), t * rings
    of_pair = rings * (sp.cos(w * t) - p * sp.sin(w * t) / (2 * w))
    rates = of_pair, ((p / 2 + w) * fast - (p / 2 - w) * late) / (2 * w), (1 - p * t / 2) * rings
    for name, of_name in ((R, values), (Rd, rates)):
        value = sp.Piecewise(*zip(of_name, cases, strict=True))
        yield _made(group, name, value, code=call("pair_at", name.name, p, q, t))
    yield _made(group, turned, 1 - Rd - p * R, code=q * R1)
    yield _made(group, "slow", sp.Piecewise((q / fastest, fastest > 0), (0, True)))
    yield from _integrals_of_decay(slow, sp.exp(-slow * t), slow1, slow2)
    quotients = (R1, (slow1 - R) / fastest, turned / q), (R2, (slow2 - R1) / fastest, (t - R - p * R1) / q)
    for n, (name, split, quotient) in enumerate(quotients, 1):
        limit = t ** (n + 1) / sp.factorial(n + 1)
        value = sp.Piecewise((split, disc > 0), (quotient, q > 0), (limit, True))
        yield _made(group, name, value, code=call("pair_at", name.name, p, q, t))


def _energies(model: Model, free: tuple[int, ...]) -> Iterator[Formula]:
    """The energies, the power of each entry of the ledger, and the sum of those that the body's energy gains."""
    group, has_body_energy = "energies", 2 in free and model.has_contact
    if has_body_energy:
        yield _made(group, body, energy.body_energy, 22, 23)
    yield _made(group, total, energy.total_energy(model))
    powers = dict[sp.Symbol, sp.Symbol]()
    for entry, word, quantity, power in _powers_of(model):
        glyph = rf"P_{{\text{{{word.replace('_', ' ')}}}}}"
        of_entry = Authored(f"{word}_power{_MARK}", glyph, "W", f"power: {quantity.meaning}")
        powers[entry] = of_entry.symbol
        yield Formula(of_entry, power, group, key=key_of(entry, "power"))
    if has_body_energy and (entries_of_body := energy.body_entries(model)):
        yield _made(group, "aed_power", sum((powers[entry] for entry in entries_of_body), sp.S.Zero), 24)


def key_of(entry: sp.Symbol, what: str) -> str:
    """The name in the derivation of the power or the work of an entry of the ledger."""
    return f"{entry.name.removesuffix('_work')}_{what}"


def _powers_of(model: Model) -> Iterator[tuple[sp.Symbol, str, Quantity, sp.Expr]]:
    """Each entry of the ledger with its word, which a power and a work begin with, its quantity and its power."""
    entries = {quantity.symbol: quantity for quantity in energy.ledger_record(model).quantities}
    for entry, power in energy.powers(model).items():
        yield entry, entries[entry].name.removesuffix("_work"), entries[entry], sp.sympify(power)


def _of_stretch(model: Model, moving: tuple[int, ...], terms: int) -> tuple[sp.Symbol, ...]:
    """The numerators of y that works read."""
    read = {int_yv1: 1, int_yv2: 2} | ({int_xv2: 2} if len(moving) == 2 else {})
    works = {symbol for *_, power in _powers_of(model) for symbol in energy.work_of(model, power).free_symbols}
    return laplace.NAMES[0][:terms] if any(symbol in works and n in moving for symbol, n in read.items()) else ()


def _works(model: Model, moving: tuple[int, ...], integrates: bool) -> Iterator[Formula]:
    """The work of each entry of the ledger over a phase, the integrals that they read, and the body's sum."""
    group, of_body = "works", energy.body_entries(model)
    held = {symbol: sp.S.Zero for symbol, masses in _MASSES_OF.items() if not masses <= {*moving}}
    named = {symbol: _integral_of(model, symbol) for symbol in _MASSES_OF}
    done = [
        (entry, word, quantity, energy.work_of(model, power).xreplace({energy.x1_0: x1_0} | held))
        for entry, word, quantity, power in _powers_of(model)
    ]
    read = {symbol for *_, value in done for symbol in value.free_symbols if symbol in named}
    terms = _terms(moving, integrates)
    held |= {symbol: sp.S.Zero for numerators in laplace.NAMES.values() for symbol in numerators[terms:]}
    poles = _factors(len(moving), integrates)
    integrals = {
        symbol: [
            each.subs(held).subs(_AT_START, simultaneous=True)
            for each in (value, _overlap(*work.PRODUCTS[symbol], poles) + work.BESIDE.get(symbol, 0))
        ]
        for symbol, value in work.INTEGRALS.items()
        if symbol in read or (symbol == int_v2 and int_xv2 in read)
    }
    squares = {symbol for value, _ in integrals.values() for symbol in value.free_symbols} & {*work.SQUARES.symbols}
    if squares:
        yield from _squares(len(moving), integrates, squares)
    symbols = {symbol: quantity.symbol for symbol, quantity in named.items()}
    numbered = {symbol for entry, *_, value in done if entry in of_body for symbol in value.free_symbols}
    for symbol, (value, code) in integrals.items():
        numbers = (24,) if symbol in numbered else ()
        yield Formula(named[symbol], value.xreplace(symbols), group, numbers, code.xreplace(symbols), str(symbol))
    gained = sp.S.Zero
    for entry, word, quantity, value in done:
        if value != 0:
            glyph = rf"U_{{\text{{{word.replace('_', ' ')}}}}}"
            of_entry = Authored(f"{word}_work{_MARK}", glyph, "J", f"over a phase, to time t in it: {quantity.meaning}")
            numbers = (24,) if entry in of_body else ()
            yield Formula(of_entry, value.xreplace(symbols), group, numbers, key=key_of(entry, "work"))
            gained += of_entry.symbol if entry in of_body else 0
    if gained != 0:
        yield _made(group, "aed_work", gained, 24)


_MASSES_OF = {
    int_v1: {1}, int_v2: {2}, int_v1v1: {1}, int_v1v2: {1, 2}, int_v2v2: {2}, int_yv1: {1}, int_yv2: {2},
    int_xv2: {1, 2},
}  # fmt: skip
"""The masses that have to slip where an integral is not 0."""


def _integral_of(model: Model, symbol: sp.Symbol) -> Quantity:
    """An integral of velocities under their names in the file."""
    (moment,) = (quantity for quantity in MOMENTS.quantities if quantity.symbol == symbol)
    first, second = (_called(model, velocity) for velocity in (v1, v2))
    factors, glyph = {
        int_v1: ((first,), r"\dot{x}_1"), int_v2: ((second,), r"\dot{x}_2"),
        int_v1v1: ((first, "squared"), r"\dot{x}_1^2"), int_v1v2: ((first, second), r"\dot{x}_1 \dot{x}_2"),
        int_v2v2: ((second, "squared"), r"\dot{x}_2^2"), int_yv1: (("y", first), r"y \dot{x}_1"),
        int_yv2: (("y", second), r"y \dot{x}_2"),
        int_xv2: ((_called(model, x1), second), r"\left(x_1 - x_1(0)\right) \dot{x}_2"),
    }[symbol]  # fmt: skip
    meaning = f"{moment.meaning} over a phase, to time t in it"
    worded = words.of_quantity(model, replace(moment, glyph=rf"\int {glyph}", meaning=meaning))
    return Authored(f"int_{'_'.join(factors)}{_MARK}", worded.glyph, worded.unit, worded.meaning)


def _factors(order: int, integrates: bool) -> tuple[sp.Expr, ...]:
    """The denominator of a phase as that of W, its factors first: with a root at 0 it is that of int R."""
    if order == 2 and not integrates:
        return _CUBIC
    rate, square = (a, sp.S.Zero) if order == 1 and integrates else (p, q)
    return (sp.S.Zero, rate, square, rate, square, sp.S.Zero)


def _overlap(
    first: Sequence[sp.Expr], second: Sequence[sp.Expr], poles: tuple[sp.Expr, ...], rate: sp.Expr = sp.S.Zero
) -> sp.Expr:
    """The integral of exp(-rate t) times a product as code has it; a factor is f + F_3 W' + F_2 W + F_1 W1."""
    return call("overlap", "", rate, *first, *second, *poles, t)


_OF_W = {Wd: (0, 1, 0, 0), W: (0, 0, 1, 0), W1: (0, 0, 0, 1)}


def _squares(order: int, integrates: bool, read: set[sp.Symbol]) -> Iterator[Formula]:
    """The integrals of the squares of W', W and W1, and what they read."""
    group, poles = "works", _factors(order, integrates)
    if order == 1 and integrates:
        yield _squared_integral(int_WdWd, a, e1, e2)
        return
    if order == 1:
        yield from _squares_of_pair()
        return
    r, pair_sum, pair_product = work.SPLIT.symbols
    if integrates:
        known = {r: sp.S.Zero, pair_sum: p, pair_product: q, work.least: sp.S.One, work.least1: t}
        known |= {work.least_squared: t**3 / 3, work.others1: work.pair1}
        yield _integral_of_decay(work.pair1, p)
    else:
        known = {}
        yield _made(group, r, sp.Piecewise((a, disc <= 0), (a, slow >= a), (slow, True)))
        others = (pair_sum, s_1 - r, p, a + p / 2 + w), (pair_product, s_2 - r * pair_sum, q, a * (p / 2 + w))
        for symbol, value, beside_a, beside_slow in others:
            code = sp.Piecewise((beside_a, disc <= 0), (beside_a, slow >= a), (beside_slow, True))
            yield _made(group, symbol, value, code=code)
        yield _made(group, work.least, sp.exp(-r * t))
        yield _integral_of_decay(work.least1, r, work.least)
        yield _squared_integral(work.least_squared, r, work.least1)
        yield _integral_of_decay(work.others1, pair_sum)
    steps = tuple(work.squares_of())
    needed = set(read)
    for step in reversed(steps):
        needed |= step.value.free_symbols if step.symbol in needed else set()
    rate, *fading = (known.get(each, each) for each in (r, pair_sum, pair_product))  # int e = W' + p W + q W1
    products = {
        int_WdWd: (_OF_W[Wd], _OF_W[Wd]), int_WW: (_OF_W[W], _OF_W[W]), int_W1W1: (_OF_W[W1], _OF_W[W1]),
        work.int_eW: (work.ONE, _OF_W[W]), work.int_eW1: (work.ONE, _OF_W[W1]),
        work.int_e1W1: ((0, 1, *fading), _OF_W[W1]),
    }  # fmt: skip
    fades = (work.int_eW, work.int_eW1)
    for step in steps:
        if step.symbol in needed:
            code = _overlap(*products[step.symbol], poles, rate if step.symbol in fades else sp.S.Zero)
            yield _made(group, step.symbol, step.value.xreplace(known), code=code)


def _squares_of_pair() -> Iterator[Formula]:
    """The integrals of the squares of W' = R and W = R1.

    Of two real poles, r the slower one and f the faster, R' + f R = exp(-r t), R1' + f R1 = int exp(-r t): times R, R1
    and the right sides, integrated. Else by s^2 + p s + q, which is not 0 beside p^2.
    """
    group, fastest, poles = "works", p / 2 + w, _factors(1, integrates=False)
    fades = sp.exp(-slow * t)
    yield _integral_of_decay(work.pair1, p)
    yield _squared_integral(work.slow_squared, slow, slow1)
    of_slow = (slow1 * (1 + fades) / 2 - fades * R) / (slow + fastest)
    of_code = _overlap(work.ONE, _OF_W[Wd], poles, slow)
    value, code = (sp.Piecewise((each, disc > 0), (0, True)) for each in (of_slow, of_code))
    yield _made(group, work.int_eR, value, code=code)
    of_second = (slow1**2 / 2 - work.int_eR) / fastest
    of_both = (work.slow_squared - slow1 * R1 + of_second) / fastest
    split = (work.int_eR - R**2 / 2) / fastest, (of_both - R1**2 / 2) / fastest
    quotients = work.squares_of_pair(p, q, work.pair1)
    for n, (symbol, of_w) in enumerate(((int_WdWd, Wd), (int_WW, W))):
        limit = t ** (2 * n + 3) / (2 * n + 3) / sp.factorial(n + 1) ** 2
        value = sp.Piecewise((split[n], disc > 0), (quotients[n], q > 0), (limit, True))
        yield _made(group, symbol, value, code=_overlap(_OF_W[of_w], _OF_W[of_w], poles))


def _integral_of_decay(symbol: sp.Symbol, rate: sp.Expr, decay: sp.Expr | None = None) -> Formula:
    """The integral of exp(-rate t), and its limit t."""
    quotient = (1 - (sp.exp(-rate * t) if decay is None else decay)) / rate
    value = sp.Piecewise((t, sp.Eq(rate, 0)), (quotient, True))
    return Formula(_quantity(symbol), value, "works", code=call("decay_at", "e1", rate, t))


def _squared_integral(symbol: sp.Symbol, rate: sp.Expr, once: sp.Expr, twice: sp.Expr | None = None) -> Formula:
    """The integral of the square of the integral of exp(-rate t), and its limit t^3/3."""
    quotient = ((t - once) / rate if twice is None else twice) - once**2 / 2
    value = sp.Piecewise((t**3 / 3, sp.Eq(rate, 0)), (quotient / rate, True))
    poles = (sp.S.Zero, rate, sp.S.Zero, rate, sp.S.Zero, sp.S.Zero)
    return Formula(_quantity(symbol), value, "works", code=_overlap(_OF_W[Wd], _OF_W[Wd], poles))


def _control(model: Model) -> Iterator[Formula]:
    """Touchdown and apex of what takes off; the rest of (5), (25)-(27) is about the paper's hopper."""
    group = "control"
    if not model.has_contact:
        return
    if model.is_of_the_paper and model.input is not None:
        yield _made(group, control.u_threshold, _value_of(control.threshold_current(), control.u_threshold), 5)
    touchdown = control.touchdown_velocity(model)
    yield _made(group, control.v_after, _value_of(touchdown, control.v_after), 25)
    apex = _value_of(control.apex_after(model), control.apex).subs(y, x1 - x2 + model.length)
    yield _made(group, control.apex, apex)
    if model.is_of_the_paper and model.input is not None:
        printed = {control.lift: -control.step, control.spring: sp.S.One}
        printed |= {energy: _symbol(str(energy)) for energy in (control.E_td, control.E_dist, control.E_spring)}
        for step, number in zip(control.objective(), (25, 26, 27, 27), strict=True):
            name = step.symbol if step.symbol == control.J else str(step.symbol)
            yield _made(group, name, step.value.subs(printed), number)


def _value_of(steps: Iterable[Step], symbol: sp.Symbol) -> sp.Expr:
    return next(step.value for step in steps if step.symbol == symbol)


def _event_functions(model: Model, free: tuple[int, ...]) -> Iterator[Formula]:
    """Contact force, velocities, what holds a mass at rest to either side, and distances from stops, by a state."""
    group = "event_functions"
    if model.has_contact:
        parts = (model.stiffness * part for part in sp.Add.make_args(model.contact))
        yield _made(group, "contact_force", sum(parts, sp.S.Zero).subs(y, x1 - x2 + model.length))
    for n in free:
        element, velocity = ELEMENTS[n - 1], (v1, v2)[n - 1]
        alone = model.accelerations[n - 1].subs({velocity: 0, (side_1, side_2)[n - 1]: 0})
        level, acceleration = (
            replace(quantity, name=f"x{n}_{name}{_MARK}")
            for name, quantity in (
                ("coulomb_level", modes.FRICTION.quantities[n - 1]), ("free_acceleration", FREE.quantities[n - 1]),
            )
        )  # fmt: skip
        named, has_friction = model.names[n - 1], model.has_friction[n - 1]
        assert named is not None
        yield _event(
            model,
            n,
            "velocity",
            velocity,
            f"velocity of the {named.thing}, which reverses or sticks at a zero",
            "m/s",
        )
        if has_friction:
            meaning = f"Coulomb level: friction of the {element.name} in motion over its inertia"
            yield Formula(replace(level, glyph=rf"f_{{{n},0}}", meaning=meaning), model.levels[n - 1], group)
        yield Formula(acceleration, sp.expand(alone), group)
        at_rest = f"{'friction at rest' if has_friction else '0'} minus the free acceleration that way"
        for way, sign, excess, direction in zip(
            ("forward", "backward"), (-1, 1), model.excesses[n - 1], named.directions, strict=True
        ):
            side = way if way == direction else f"{way} ({direction})"
            meaning = (
                f"stick margin of the held {named.thing}, {side}: {at_rest}; it slips that way where this falls to 0"
            )
            level_left = level.symbol + excess if has_friction else sp.S.Zero
            margin = level_left + sign * acceleration.symbol
            yield _event(model, n, f"stick_margin_{way}", margin, meaning, "m/s^2")
        if element.position is not None:
            ends = ("lower", x1_min, x1 - x1_min), ("upper", x1_max, x1_max - x1)
            for which, distance in ((which, away) for which, end, away in ends if model.declares(end)):
                meaning = f"distance of the {named.thing} from its {which} stop, which it hits where this is 0"
                yield _event(model, n, f"{which}_stop", distance, meaning, "m")


def _law(model: Model) -> Iterator[Formula]:
    """The current that a law asks for, the poles under it, and its room to the limits of the current."""
    if model.law is None:
        return
    asked = _symbol("asked")
    yield _made("equations_of_motion", "asked", -model.pull.subs(u, _symbol("target")) / gamma2)
    poles = {step.symbol: step.value for step in laplace.rates_under_law(model)}
    for name, symbol in (("p_law", p_1), ("q_law", q_1)):
        yield _made("poles", name, poles[symbol].subs({a1_y: poles[a1_y], a1_v1: poles[a1_v1]}))
    if model.declares(u_max):
        yield _made("event_functions", "room_up", u_max - asked)
        yield _made("event_functions", "room_down", u_max + asked)


def _event(model: Model, n: int, name: str, value: sp.Expr, meaning: str, unit: str) -> Formula:
    glyph = rf"g_{{{n},\text{{{name.replace('_', ' ')}}}}}"
    return Formula(Authored(f"x{n}_{name}{_MARK}", glyph, model.unit(unit, f"x{n}"), meaning), value, "event_functions")
