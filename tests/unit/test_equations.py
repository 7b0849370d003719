"""The register against the algebra: every verdict on (1)-(27) is proven, every figure in a reason is computed.

An exact comparison is a difference whose numerator expands to zero. The LaTeX that people see is evaluated by the small
reader below at a random point and must be the expression of the proof, so text and algebra cannot part.
"""

import cmath
import re
from functools import cache

import mpmath
import numpy as np
import pytest
import sympy as sp

import hopform
from derive.emit.program import program
from derive.maths import control, energy, laplace
from derive.maths.laplace import s
from derive.model import quantities as Q
from derive.model.equations import ModelError
from derive.model_file import read_model
from derive.paper.register import CERTIFICATE, PAPER, REGISTER, VERDICTS, cubic, differences, in_words, quadratic_1
from derive.shipped import FILES, HOPPER
from hopform_solver import LegState, Robot, formulas
from tests import algebra
from tests.algebra import EXPRESSIONS, LETTERS

BY_NUMBER = {entry.number: entry for entry in REGISTER}
HOPPER_C = Robot(25.0, 3.0, 1200.0, 0.4, 0.0, 150.0, 5.0, 0.78, 0.6, -65.0, 9.81, 0.0, 0.08, 3.0, 0.05, 0.0, 0.0)
FREE = HOPPER_C._replace(x1_min=-np.inf, x1_max=np.inf)
WEIGHT = HOPPER_C.m_s * HOPPER_C.g
DROP = 0.2


def is_zero(expression: sp.Expr) -> bool:
    return sp.expand(sp.numer(sp.together(expression))) == 0


def printed(number: int) -> sp.Expr:
    return EXPRESSIONS[number][0]


def derived(number: int) -> sp.Expr:
    return EXPRESSIONS[number][1]


def mended(expression: sp.Expr) -> sp.Expr:
    """An expression of the register with the letters gamma, beta, lambda_2, H_n as they follow from (3), (4)."""
    return expression.subs(LETTERS)


def difference(number: int) -> sp.Expr:
    return mended(printed(number)) - mended(derived(number))


def says(number: int, *figures: str) -> None:
    for figure in figures:
        assert figure in BY_NUMBER[number].reason, f"({number}) does not say {figure}: {BY_NUMBER[number].reason}"


# ---- the register is whole ----


def test_the_register_has_each_equation_once_and_in_order():
    assert [entry.number for entry in REGISTER] == list(range(1, 28))


def test_every_verdict_is_one_of_five_words_and_every_word_is_used():
    assert {entry.verdict for entry in REGISTER} == set(VERDICTS)


def test_every_entry_has_a_title_both_formulas_and_a_reason_in_sentences():
    for entry in REGISTER:
        assert entry.title and entry.printed and entry.derived
        assert entry.reason.endswith(".")


def test_every_step_named_in_the_register_is_a_step_of_the_program():
    made = program()
    for entry in REGISTER:
        assert entry.computed_by
        for text in entry.computed_by:
            function, _, names = text.partition(": ")
            steps = {str(step.symbol) for step in made.function(function).steps}
            assert set(names.split(", ")) <= steps, f"({entry.number}) {text}"


def test_the_generated_package_carries_the_register_word_for_word():
    from hopform_solver.equations import EQUATIONS

    assert [tuple(entry) for entry in EQUATIONS] == [
        (entry.number, entry.title, entry.printed, entry.derived, entry.verdict, entry.reason, entry.computed_by)
        for entry in REGISTER
    ]


def test_every_proof_of_the_certificate_is_a_test_that_exists(request):
    for path, proofs in CERTIFICATE.items():
        text = (request.config.rootpath / path).read_text("utf-8")
        for name in proofs:
            assert f"\ndef {name}(" in text, name


# ---- the hopper that ships is the paper's ----


@pytest.mark.parametrize("name", PAPER)
def test_the_hopper_that_ships_has_the_equation_of_the_paper(name):
    """In the parameters of its file: in the letters of the derivation an edit of that file is no difference."""
    assert differences(HOPPER).get(name, 0) == 0, in_words(differences(HOPPER))


def test_what_the_verdicts_rest_on_is_what_the_register_prints():
    for number in (3, 4):
        assert_read_as(BY_NUMBER[number].printed, PAPER[f"({number})"], a_point(number))
    assert_read_as(BY_NUMBER[22].derived, PAPER["(22)"], a_point(22))
    assert is_zero(PAPER["(25)"].subs(Q.v2, algebra.v_td) - derived(25))
    unloaded = {Q.x2: Q.x1 + Q.L0 + Q.c}
    assert is_zero(PAPER["(3) in flight"] - PAPER["(3)"].subs(unloaded))


_OFFSET, _MORE = 'force(x1, k * c, "offset")  # (3) has no c', "another entry of the ledger has its name, offset"
_LEG = Q.k * (Q.x1 - Q.x2 + Q.L0 + Q.c)
EDITS = [
    ("viscous(x1, b1)", "viscous(x1, 2 * b1)", {"(3)": -Q.b1 * Q.v1 / Q.m_eff}),
    ("viscous(x1, b1)", "viscous(x1, 2 * b1, where='flight')", {"(3)": Q.b1 * Q.v1 / Q.m_eff}),
    ("viscous(x1, b1)", "viscous(x1, b1, where='stance')", {"(3) in flight": Q.b1 * Q.v1 / Q.m_eff}),
    ("viscous(x2, b2,", "viscous(x2, b2 / 2,", {"(4)": Q.b2 * Q.v2 / Q.m_s / 2}),
    ("-gamma2 * u", "gamma2 * u", {"(3)": 2 * Q.gamma2 * Q.u / Q.m_eff}),
    ("-gamma2 * u", "-2 * gamma2 * u", {"(3)": -Q.gamma2 * Q.u / Q.m_eff}),
    (_OFFSET, "", {"(3)": -Q.k * Q.c / Q.m_eff}),
    ("(x1, m_eff * f1,", "(x1, 2 * m_eff * f1,", {"(3)": -Q.f1 * Q.side_1}),
    ("(x2, m_s * f2,", "(x2, m_s * f2 / 2,", {"(4)": Q.f2 * Q.side_2 / 2}),
    ("(f1 + f1_excess)", "(f1 + 2 * f1_excess)", {"(3) at rest": Q.f1_excess}),
    ("(f2 + f2_excess)", "(f2 + f2_excess / 2)", {"(4) at rest": -Q.f2_excess / 2}),
    ("gravity(x2, g)", "gravity(x2, g / 2)", {"(4)": Q.g / 2, "(22)": -Q.m_s * Q.g * Q.x2 / 2}),
    ("gravity(x2, g)", "gravity(x2, g)\nforce(x2, -3, 'load')", {"(4)": -3 / Q.m_s}),
    ('"m", m_eff, "actuator"', '"m", 2 * m_eff, "actuator"',
     {"(3)": (_LEG - Q.k * Q.c + Q.b1 * Q.v1 + Q.gamma2 * Q.u + Q.m_eff * Q.f1 * Q.side_1) / Q.m_eff / 2}),
    (_OFFSET, _OFFSET.replace("k * c", "-k * c"), _MORE),
    ("x2 + L0 + c, k)", "x2 + L0, k)", _MORE),
    ("x2 + L0 + c, k)", "x2 + L0 + c, 2 * k)", _MORE),
    (f"c, k)\n{_OFFSET}", f"c, 2 * k)\n{_OFFSET.replace('offset', 'push')}",
     {"(3)": -_LEG / Q.m_eff, "(4)": _LEG / Q.m_s, "(22)": Q.k * (Q.x2 - Q.L0 - Q.c) ** 2 / 2}),
    (f"L0 + c, k)\n{_OFFSET}", f"L0, k)\n{_OFFSET.replace('offset', 'push')}",
     {"(3)": Q.k * Q.c / Q.m_eff, "(4)": -Q.k * Q.c / Q.m_s, "(22)": Q.k * (2 * Q.x2 - 2 * Q.L0 - Q.c) * Q.c / 2}),
    ("(leg, impact_loss)", "(leg, impact_loss / 2)", "impact_loss must be a number"),
    ("(leg, impact_loss)", "(leg, 0.05)", "impact_loss is declared, and no element has it"),
]  # fmt: skip
"""Edits of the hopper's file: what differs from the paper's, or why the file is no model."""


@pytest.mark.parametrize(("old", "new", "what"), EDITS)
def test_an_edit_of_the_hopper_is_refused_or_named_with_its_equation_and_its_difference(tmp_path, old, new, what):
    text = FILES["hopper"].read_text("utf-8")
    assert text.count(old) == 1
    (tmp_path / "hopper.py").write_text(text.replace(old, new), "utf-8")
    if isinstance(what, str):
        with pytest.raises(ModelError, match=what):
            read_model(tmp_path / "hopper.py")
        return
    found = differences(read_model(tmp_path / "hopper.py"))
    assert {name.split()[0] for name in found} == {name.split()[0] for name in what}, "the numbers are named"
    for name, value in what.items():
        assert is_zero(found[name] - value), found
    line = in_words(found)
    assert all(name in line for name in what) and line.endswith(": what follows is no register of the paper")


def test_the_line_about_an_edit_reads_as_a_formula():
    assert in_words({"(3)": -Q.b1 * Q.v1 / Q.m_eff, "(3) in flight": Q.g, "(4)": Q.side_2 * Q.v2**2}) == (
        "(3) of derive/models/hopper.py differs from the paper's by -b1 v1/m_eff, (4) by sign(v2) v2^2: "
        "what follows is no register of the paper"
    )
    assert in_words({}) == ""


# ---- verdicts by algebra ----

COMPARED = [number for number, both in EXPRESSIONS.items() if len(both) == 2]


@pytest.mark.parametrize("number", [n for n in COMPARED if BY_NUMBER[n].verdict in ("agrees", "clash of symbols")])
def test_what_agrees_differs_by_nothing_from_what_follows(number):
    assert is_zero(difference(number))


@pytest.mark.parametrize("number", [n for n in COMPARED if BY_NUMBER[n].verdict in ("wrong", "typographical slip")])
def test_what_is_wrong_differs_from_what_follows(number):
    assert not is_zero(difference(number))


@pytest.mark.parametrize("number", [n for n in COMPARED if BY_NUMBER[n].verdict == "incomplete"])
def test_what_is_incomplete_differs_by_what_it_leaves_out(number):
    assert is_zero(difference(number)) == (number == 16), (
        "(16) is true as it stands, but for poles that it does not have"
    )


def test_1_and_3_pull_the_actuator_with_a_constant_force_that_the_lagrangian_does_not_have():
    for number in (1, 3):
        assert is_zero(difference(number) - Q.k * Q.c / Q.m_eff)
    assert is_zero(printed(3) - HOPPER.accelerations[0])
    says(1, f"{1e3 * HOPPER_C.m_eff * HOPPER_C.f1 / HOPPER_C.k:.0f} mm")


def test_1_and_2_are_3_and_4_without_friction():
    for first, second, friction in ((1, 3, Q.f1), (2, 4, Q.f2)):
        assert is_zero(printed(first) - printed(second).subs(friction, 0))


def test_5_holds_for_magnitudes_and_an_unloaded_spring():
    unloaded = derived(5).subs(Q.x2, Q.x1 + Q.L0)
    positive = {symbol: sp.Symbol(symbol.name, positive=True) for symbol in printed(5).free_symbols}
    assert is_zero(sp.expand(unloaded - printed(5)).subs(positive))
    assert not is_zero(sp.expand(unloaded - printed(5)).subs(Q.gamma2, -1).subs(positive))
    level = {symbol: sp.Symbol(symbol.name, positive=True) for symbol in (Q.f1, Q.f1_excess)}
    moves = unloaded.subs(algebra.u_star, control.threshold_current()[0].value).subs(positive | level)
    assert is_zero(moves - sum(level.values()))


def test_7_is_right_with_m_s_for_m_2():
    assert is_zero(difference(7).subs(algebra.m_2, Q.m_s))


def test_8_is_right_with_an_acceleration_f_2_and_in_compression_only():
    in_compression = difference(8).subs(Q.side_2, -1)
    assert is_zero(in_compression - (Q.f2 - Q.f2 / Q.m_s))
    assert not is_zero(difference(8).subs(Q.side_2, 1).subs(Q.m_s, 1))


@pytest.mark.parametrize("number", [10, 15])
def test_10_and_15_hold_while_the_actuator_moves_up(number):
    assert is_zero(difference(number).subs(Q.side_1, 1))
    assert not is_zero(difference(number).subs(Q.side_1, -1))


def test_11_has_the_characteristic_polynomial_of_the_equations_of_motion():
    right = sp.Matrix([Q.v1 - Q.v2, *HOPPER.in_compression])
    matrix = right.jacobian([Q.y, Q.v1, Q.v2])
    assert is_zero(cubic - (s * sp.eye(3) - matrix).det())


def test_11_has_poles_that_are_the_negatives_of_the_roots():
    """Routh: no root of s^3 + s_1 s^2 + s_2 s + s_3 has a positive real part if s_1, s_2, s_3, s_1 s_2 - s_3 >= 0."""
    s_1, s_2, s_3 = sp.Poly(cubic, s).all_coeffs()[1:]
    parameters = sp.symbols("m_eff m_s k b1 b2", positive=True)
    hurwitz = sp.expand(
        sp.numer(sp.together((s_1 * s_2 - s_3).subs({sp.Symbol(p.name, real=True): p for p in parameters})))
    )
    assert all(coefficient > 0 for coefficient in sp.Poly(hurwitz, *parameters).coeffs())


def test_14_is_right_with_m_eff_twice_and_a_minus_sign():
    by_letters = difference(14).subs({algebra.b_eff: Q.m_eff, algebra.m_1: Q.m_eff})
    assert is_zero(by_letters - 2 * Q.b1 * LETTERS[algebra.gamma] / Q.m_eff)


def test_15_is_free_of_l_0_and_keeps_k_c():
    h_1 = sp.expand(LETTERS[algebra.H_1])
    assert Q.L0 not in h_1.free_symbols
    assert is_zero(h_1.coeff(Q.c) - Q.k**2 / (Q.m_eff * Q.m_s))


def test_16_and_17_have_residues_at_d_and_e_that_cancel():
    """Behind the quadratic both parts have numerators over s^2 P(s); their sum is a multiple of the quadratic."""
    first = mended(algebra.start_1) * s * cubic
    second = mended(printed(17)) * s**2 * cubic * quadratic_1
    numerator = sp.Poly(sp.expand(first + sp.cancel(second)), s)
    assert not sp.Poly(sp.expand(first), s).rem(sp.Poly(quadratic_1, s)).is_zero
    assert all(is_zero(rest) for rest in numerator.rem(sp.Poly(quadratic_1, s)).all_coeffs())


def test_17_divides_by_zero_where_d_and_e_coincide_and_the_cubic_does_not_notice():
    discriminant = sp.discriminant(quadratic_1, s)
    assert is_zero(discriminant - (Q.b1**2 - 4 * Q.k * Q.m_eff) / Q.m_eff**2)
    robot = {Q.m_eff: 25, Q.m_s: 3, Q.k: 1200, Q.b1: sp.sqrt(4 * 1200 * 25), Q.b2: 5}
    assert sp.discriminant(quadratic_1.subs(robot), s) == 0
    assert sp.discriminant(cubic.subs(robot), s) != 0


def test_18_loses_a_term_in_t_squared_and_its_coefficients_where_friction_vanishes():
    """B = H_1/s_3 and A = (H_2 s_3 - H_1 s_2)/s_3^2, and s_3 is proportional to b_1 + b_2."""
    s_2, s_3 = (sp.Poly(cubic, s).all_coeffs()[i] for i in (2, 3))
    assert is_zero(s_3.subs(Q.b2, -Q.b1))
    assert is_zero(s_3 / (Q.b1 + Q.b2) - Q.k / (Q.m_eff * Q.m_s))
    h_1, h_2 = LETTERS[algebra.H_1], LETTERS[algebra.H_2]
    assert not is_zero((h_2 * s_3 - h_1 * s_2).subs({Q.b1: 0, Q.b2: 0}))
    terminal = HOPPER.in_compression
    force = sum(
        mass * acc.subs({Q.y: 0, Q.v1: 0, Q.v2: 0}) for mass, acc in zip((Q.m_eff, Q.m_s), terminal, strict=True)
    )
    assert is_zero(h_1 / s_3 - force / (Q.b1 + Q.b2))


def test_22_is_the_kinetic_energy_alone():
    kinetic = Q.m_s * Q.v2**2 / 2
    assert is_zero(printed(22) - kinetic.diff(Q.v2) * algebra.acc2)
    potential = energy.body_energy - kinetic
    assert is_zero(difference(22) + potential.diff(Q.x2) * Q.v2)


def test_23_is_right_with_a_velocity_for_the_acceleration():
    assert is_zero(difference(23).subs(algebra.acc2, Q.v2))


def test_24_is_right_with_minus_signs_and_m_s_and_the_length_of_the_path():
    down = {Q.side_2: -1}
    assert is_zero(difference(24).subs(down) - (2 * Q.b2 * Q.v2**2 - Q.f2 * Q.v2 - Q.m_s * Q.f2 * Q.v2))
    spring = Q.k * Q.x1 * Q.v2
    assert is_zero(derived(24) - (spring - Q.b2 * Q.v2**2 - Q.m_s * Q.f2 * Q.side_2 * Q.v2))


def test_the_foot_of_25_costs_as_much_at_lift_off_as_at_touchdown():
    """Momentum alone: the foot stops at once, the body goes on; later the body pulls it up, both at one velocity."""
    foot, body, v = sp.symbols("m_f m_b v", positive=True)
    common = body * v / (body + foot)  # after lift-off of the foot at rest, the body at v
    touchdown = foot * v**2 / ((body + foot) * v**2)
    lift_off = 1 - (body + foot) * common**2 / (body * v**2)
    assert is_zero(touchdown - lift_off)
    share = sp.Rational(1, 20)
    lost, left = (part.subs(foot, share * body) for part in (touchdown, (common / v) ** 2))
    assert (round(100 * float(lost), 1), round(float(left), 3)) == (4.8, 0.907)


def test_25_is_right_behind_the_impact():
    before = printed(25)
    assert is_zero(derived(25) - before * (1 - Q.impact_loss))


def test_26_is_half_of_a_step_up_and_has_the_wrong_sign_for_a_step_down():
    up, down = ({algebra.x2_ground: Q.x2 + sign} for sign in (1, -1))
    assert is_zero((2 * printed(26) - derived(26)).subs(up))
    assert is_zero((2 * printed(26) + derived(26)).subs(down))


def test_27_is_zero_where_the_apex_is_the_desired_one():
    """The inner difference over m_s g is apex - h_des, the apex both from energies and from the take-off."""
    values: dict[sp.Symbol, sp.Expr] = {}
    for step in control.apex_from_energy():
        values[step.symbol] = step.value.subs(values)
    names = {
        Q.x1: algebra.x1_0,
        control.x1_T: algebra.x1_T,
        control.aed: algebra.E_delta,
        control.step: Q.x2 - algebra.x2_ground,
        Q.v2: algebra.v2_0,
    }
    apex = values[control.apex].subs(names)
    energies = {algebra.E_td: Q.m_s * algebra.v2_0**2 / 2, algebra.E_dist: derived(26)}
    inner = derived(27).args[0].subs(energies)
    assert is_zero(inner / (Q.m_s * Q.g) - (apex - algebra.h_des))
    left_out = derived(27).args[0] - printed(27).args[0]
    spring = Q.k * (algebra.x1_0**2 - algebra.x1_T**2) / 2
    assert is_zero(left_out - spring - Q.m_s * Q.g * algebra.x1_0)


# ---- the dimension of every printed term ----

BASE = {"kg": "M", "m": "L", "s": "T", "A": "I", "N": "M*L/T^2", "J": "M*L^2/T^2"}


def dimension_of(unit: str) -> sp.Expr:
    """A unit of the quantities as a product of powers of M, L, T, I."""
    text = unit.replace(" ", "*")
    text = re.sub(r"[A-Za-z]+", lambda word: f"({BASE[word.group()]})", text)
    return sp.sympify(text.replace("^", "**"), locals={n: sp.Symbol(n, positive=True) for n in "MLTI"})


def dimensions() -> dict[sp.Symbol, sp.Expr]:
    """The dimension of every symbol of the register."""
    known = {
        symbol: dimension_of(quantity.unit)
        for quantity, symbol in (
            *((each, sp.Symbol(each.name, real=True)) for each in HOPPER.parameters),
            *zip(Q.STATE.quantities, Q.STATE.symbols, strict=True),
        )
    }
    units = {
        Q.x2: "m", Q.u: "A", Q.t: "s", Q.side_1: "1", Q.side_2: "1", s: "1/s",
        algebra.x1_0: "m", algebra.v1_0: "m/s", algebra.x2_0: "m", algebra.v2_0: "m/s",
        algebra.X1: "m s", algebra.X2: "m s",
        algebra.beta: "m/s", algebra.gamma: "m/s^2", algebra.lambda_2: "m/s^2",
        algebra.H_4: "m/s", algebra.H_3: "m/s^2", algebra.H_2: "m/s^3", algebra.H_1: "m/s^4",
        algebra.m_1: "kg", algebra.m_2: "kg", algebra.b_eff: "N s/m", algebra.u_star: "A", algebra.v_td: "m/s",
        algebra.x2_ground: "m", algebra.E_delta: "J", algebra.E_td: "J", algebra.E_dist: "J", algebra.h_des: "m",
        algebra.x1_T: "m", algebra.acc2: "m/s^2",
    }  # fmt: skip
    return known | {symbol: dimension_of(unit) for symbol, unit in units.items()}


class Unbalanced(ValueError):
    pass


def dimension(expression: sp.Expr, known: dict[sp.Symbol, sp.Expr]) -> sp.Expr:
    """The dimension of an expression; a sum of unlike terms raises."""
    if expression.is_Symbol:
        return known[expression]
    if expression.is_Add:
        found = {sp.powsimp(dimension(term, known)) for term in expression.args}
        if len(found) != 1:
            raise Unbalanced(f"{expression}: {found}")
        return found.pop()
    if expression.is_Mul:
        return sp.Mul(*(dimension(factor, known) for factor in expression.args))
    if expression.is_Pow:
        return dimension(expression.base, known) ** expression.exp
    if isinstance(expression, sp.Abs):
        return dimension(expression.args[0], known)
    return sp.S.One


BALANCED = [number for number in EXPRESSIONS if not 18 <= number <= 21]


@pytest.mark.parametrize("number", BALANCED)
def test_printed_terms_balance_except_where_the_verdict_says_why_not(number):
    """(8) f_2/m_s, (14) b_eff if it is a friction, (23) a force times an acceleration, (24) f_2 times a length."""
    if number in {8, 14, 23, 24}:
        with pytest.raises(Unbalanced):
            dimension(printed(number), dimensions())
    else:
        dimension(printed(number), dimensions())


@pytest.mark.parametrize("number", [n for n in BALANCED if n in COMPARED])
def test_derived_terms_balance(number):
    dimension(derived(number), dimensions())


# ---- the LaTeX that readers see is the expression that is proven ----

GLYPHS = {
    r"\dot{x}_1(0)": "v1_0", r"\dot{x}_2(0)": "v2_0", "x_1(0)": "x1_0", "x_2(0)": "x2_0", "x_1(T)": "x1_T",
    r"\iint W": "W_2", r"\int W": "W_1", r"\dot{W}": "W_rate", "W": "W",
    r"\ddot{x}_2(0)": "acc2_0", r"\tilde{H}_2": "tilde_2", r"\tilde{H}_1": "tilde_1",
    r"\text{sign}(\dot{x}_1)": "side_1", r"\text{sign}(\dot{x}_2)": "side_2", r"\ddot{x}_2": "acc2",
    r"\dot{x}_1": "v1", r"\dot{x}_2": "v2", "x_{2ground}": "x2_ground", "X_1(s)": "X1", "X_2(s)": "X2", "Z(s)": "Z",
    "x_1": "x1", "x_2": "x2", "m_{eff}": "m_eff", "b_{eff}": "b_eff", "m_s": "m_s", "m_1": "m_1", "m_2": "m_2",
    "L_0": "L0", "b_1": "b1", "b_2": "b2", "f_1": "f1", "f_2": "f2", r"\gamma_2": "gamma2", r"\gamma": "gamma", 
    r"\beta": "beta", r"\lambda_2": "lambda_2", r"\eta": "impact_loss", "H_4": "H_4", "H_3": "H_3", "H_2": "H_2", 
    "H_1": "H_1", "u_*": "u_star",
    "U_{delta}": "U_delta", "E_{delta}(u)": "E_delta", "E_{td}": "E_td", "E_{dist}": "E_dist", "h_{des}": "h_des",
    "v_{td}": "v_td", r"\hat{A}": "A_hat", r"\hat{B}": "B_hat", r"\hat{C}": "C_hat", r"\hat{D}": "D_hat",
    r"\hat{E}": "E_hat", r"\hat{F}": "F_hat", r"\hat{G}": "G_hat",
} | {letter: letter for letter in "kgucsabdetABCDE"}  # fmt: skip
TOKEN = re.compile(
    "|".join([r"\\frac", "e\\^\\{", *map(re.escape, sorted(GLYPHS, key=len, reverse=True)), r"\d+", r"[-+^(){}|]"])
)


class Reader:
    """The value of a right side in LaTeX: sums, products, fractions, powers, magnitudes; `e^{}` is an exponential."""

    def __init__(self, text: str, values: dict[str, complex]) -> None:
        text = text.partition(" = ")[2].replace(r"\left", "").replace(r"\right", "")
        text = re.sub(r"\\int (?!W)| dt", "", text).replace("dx_2", r"\dot{x}_2")
        self.tokens = TOKEN.findall(text)
        assert "".join(self.tokens).replace(" ", "") == text.replace(" ", ""), text
        self.values, self.at, self.inside = values, 0, 0

    @property
    def next(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self) -> str:
        self.at += 1
        return self.tokens[self.at - 1]

    def sum(self) -> complex:
        sign = 1.0
        if self.next == "-":
            sign = -1.0
            self.take()
        total = sign * self.product()
        while self.next in ("+", "-"):
            sign = 1.0 if self.take() == "+" else -1.0
            total += sign * self.product()
        return total

    def product(self) -> complex:
        total = self.power()
        while self.next not in ("", "+", "-", ")", "}") and not (self.next == "|" and self.inside):
            total *= self.power()
        return total

    def power(self) -> complex:
        base = self.atom()
        if self.next == "^":
            self.take()
            base **= int(self.take())
        return base

    def atom(self) -> complex:
        token = self.take()
        if token == r"\frac":
            return self.group() / self.group()
        if token == "e^{":
            return self.closed(cmath.exp(self.sum()))
        if token == "(":
            return self.closed(self.sum())
        if token == "|":
            self.inside += 1
            value = self.closed(abs(self.sum()))
            self.inside -= 1
            return value
        return float(token) if token.isdigit() else self.values[GLYPHS[token]]

    def group(self) -> complex:
        assert self.take() == "{"
        return self.closed(self.sum())

    def closed(self, value: complex) -> complex:
        assert self.take() in (")", "}", "|")
        return value


@cache
def a_robot() -> dict[str, complex]:
    """Random values of every glyph; letters and poles are those of the robot, signs those of the velocities."""
    rng = np.random.default_rng(27)
    names = sorted(
        {*GLYPHS.values()} | {str(x) for as_printed, *_ in EXPRESSIONS.values() for x in as_printed.free_symbols}
    )
    values: dict[str, complex] = {name: float(rng.uniform(0.3, 2.0)) for name in names}
    values |= {name: -values[name] for name in rng.choice(["v1", "v2", "u", "gamma2", "x1_0"], 2)}
    values |= {
        "side_1": np.sign(values["v1"]),
        "side_2": np.sign(values["v2"]),
        "s": complex(rng.uniform(), rng.uniform()),
    }
    values |= {str(letter): evaluate(value, values) for letter, value in LETTERS.items()}
    poles = [-root for root in np.roots([evaluate(c_n, values) for c_n in sp.Poly(cubic, s).all_coeffs()])]
    factors = [-root for root in np.roots([evaluate(c_n, values) for c_n in sp.Poly(quadratic_1, s).all_coeffs()])]
    values |= {"a": poles[0], "b": poles[1], "c_pole": poles[2], "d": factors[0], "e": factors[1], "e_pole": factors[1]}
    return values | {"U_delta": 0.0, "offset": values["c"]}


def a_point(number: int) -> dict[str, complex]:
    """The same robot in the letters of one equation: from (11) to (21) the glyph c is a pole."""
    values = dict(a_robot())
    if number in (11, 16, 17, 18, 19, 20, 21):
        values["c"] = values["c_pole"]
    return values


def evaluate(expression: sp.Expr, values: dict[str, complex]) -> complex:
    offset = values.get("offset", values["c"])  # c in an expression is always the offset
    point = {symbol: offset if symbol == Q.c else values[symbol.name] for symbol in expression.free_symbols}
    return complex(sp.N(expression.subs(point)))


def assert_read_as(text: str, expression: sp.Expr, values: dict[str, complex]) -> None:
    """Both are of order one to a hundred and sums of a few dozen terms: 1e-10 is far above rounding."""
    expected = evaluate(expression, values)
    assert abs(Reader(text, values).sum() - expected) <= 1e-10 * (1.0 + abs(expected)), text


@pytest.mark.parametrize("number", EXPRESSIONS)
def test_what_is_printed_reads_as_the_expression_that_is_proven(number):
    entry, values = BY_NUMBER[number], a_point(number)
    values["Z"] = evaluate(printed(17), values)
    if number == 23:
        values["U_delta"] = evaluate(derived(24), values)
    if number == 24:
        values |= {"L0": 0.0, "x2": values["v2"]}  # the time derivative of L_0 - x_2
    assert_read_as(entry.printed, printed(number), values)


@pytest.mark.parametrize("number", [n for n in COMPARED if n not in (19, 22)])
def test_what_is_derived_reads_as_the_expression_that_is_proven(number):
    entry, values = BY_NUMBER[number], a_point(number)
    if number == 23:
        values["U_delta"] = evaluate(derived(24), values)
        values["acc2"] = evaluate(HOPPER.accelerations[1], values)
    assert_read_as(entry.derived, derived(number), values)


@pytest.mark.parametrize("number", [18, 19])
def test_18_and_19_in_terms_of_w_are_18_and_19_as_printed_where_poles_are_distinct(number):
    values = dict(a_robot())
    start = {
        "y": values["x1_0"] - values["x2_0"] + values["L0"] + values["c"],
        "v1": values["v1_0"],
        "v2": values["v2_0"],
    }
    in_robot = dict(a_robot()) | start
    for step in (*laplace.rates_of(HOPPER), *laplace.drive_of(HOPPER), *laplace.numerators((1, 2))):
        in_robot[step.symbol.name] = evaluate(step.value, in_robot)
    a, b, c, t = (values[name] for name in ("a", "b", "c_pole", "t"))
    h_4, h_3, h_2, h_1 = (values[name] for name in ("H_4", "H_3", "H_2", "H_1"))
    s_2, s_3 = a * b + a * c + b * c, a * b * c
    poles = ((a, b, c), (b, a, c), (c, a, b))
    shares = [
        np.polyval([values["x2_0"], h_4, h_3, h_2, h_1], -r) / (r**2 * (r2 - r) * (r3 - r)) for r, r2, r3 in poles
    ]
    coefficients: dict[str, complex] = dict(
        zip("ABCDE", [(h_2 - h_1 * s_2 / s_3) / s_3, h_1 / s_3, *shares], strict=True)
    )
    expected = Reader(BY_NUMBER[number].printed, values | coefficients | {"c": c}).sum()

    weights = [(r, cmath.exp(-r * t) / ((r2 - r) * (r3 - r)), 1 / ((r2 - r) * (r3 - r))) for r, r2, r3 in poles]
    w = sum(now for _, now, _ in weights)
    w_1 = sum((at_0 - now) / r for r, now, at_0 in weights)
    w_2 = sum((t * at_0 - (at_0 - now) / r) / r for r, now, at_0 in weights)
    rate = sum(-r * now for r, now, _ in weights)
    in_w = {"W": w, "W_1": w_1, "W_2": w_2, "W_rate": rate, "acc2_0": in_robot["H3_2"]}
    in_w |= {"tilde_2": in_robot["H2_2"], "tilde_1": in_robot["H1_2"]}
    text = BY_NUMBER[number].derived.partition(r", \quad")[0]
    assert abs(Reader(text, values | in_w).sum() - expected) <= 1e-9 * (1.0 + abs(expected))


def test_the_energy_under_22_reads_as_the_energy_of_the_body():
    values = a_point(22)
    assert_read_as(BY_NUMBER[22].derived, energy.body_energy, values)


# ---- figures ----


def drop(u: float, robot: Robot = HOPPER_C, height: float = DROP):
    """The stance after a drop from a height with the actuator at 0."""
    v2 = formulas.touchdown_velocity(robot, height)
    return solve(robot, LegState(0.0, 0.0, v2, 0.0), u)


def solve(robot: Robot, start: LegState, u: float) -> hopform.Stance:
    named = hopform.Robot(**robot._asdict())
    return hopform.solve_stance(named, x1=start.x1, v1=start.v1, v2=float(start.v2), compression=start.y, u=float(u))


def events_of(stance: hopform.Stance) -> list[str]:
    return [event.kind for event in stance.events]


def turning(stance: hopform.Stance) -> float:
    """When the body turns: the end of compression."""
    return next(event.time for event in stance.events if event.kind == "x2_reverses")


MENDED_14 = printed(14).subs({algebra.b_eff: Q.m_eff, algebra.m_1: Q.m_eff}) - 2 * Q.b1 * algebra.gamma / Q.m_eff


def height_by_18(u: float, t: float, robot: Robot = HOPPER_C, gamma=None, h_2: sp.Expr = MENDED_14):
    """x_2(t) by partial fractions of (11) with the printed letters, gamma and H_2 mended unless given; 60 digits."""
    with mpmath.workdps(60):
        point = {Q.LETTERS[i]: sp.Rational(float(v)) for i, v in enumerate(robot[:11])}
        v2 = sp.Rational(float(formulas.touchdown_velocity(robot, DROP)))
        point |= {Q.u: sp.Rational(u), Q.side_1: 1, Q.side_2: -1, algebra.x1_0: 0, algebra.v1_0: 0}
        point |= {algebra.x2_0: point[Q.L0] + point[Q.c], algebra.v2_0: v2}
        letters = {
            algebra.beta: LETTERS[algebra.beta].subs(point),
            algebra.gamma: (gamma or LETTERS[algebra.gamma]).subs(point),
        }
        entries = (printed(12), printed(13), h_2, printed(15))
        numerator = [
            mpmath.mpf(sp.Rational(n.subs(letters).subs(point)).p) / sp.Rational(n.subs(letters).subs(point)).q
            for n in (algebra.x2_0, *entries)
        ]
        p = [mpmath.mpf(n.p) / n.q for n in map(sp.Rational, sp.Poly(cubic.subs(point), s).all_coeffs())]
        roots = mpmath.polyroots(p, maxsteps=200, extraprec=300)
        b = numerator[4] / p[3]
        shares = [mpmath.polyval(numerator, z) / (z * z * mpmath.polyval([3, 2 * p[1], p[2]], z)) for z in roots]
        coefficients = [(numerator[3] - p[2] * b) / p[3], b, *shares]
        decays = [1, t, *(mpmath.exp(z * t) for z in roots)]
        exact = mpmath.re(mpmath.fdot(coefficients, decays))
    rounded = [complex(value) for value in coefficients]
    in_double = sum(share * complex(decay) for share, decay in zip(rounded, decays, strict=True)).real
    return float(exact), in_double


def test_3_sticks_and_stops_within_one_stance():
    assert {"x1_sticks", "x1_slips", "x1_hits_stop"} <= set(events_of(drop(0.75)))
    says(3, "0.75 A")
    passive = drop(0.0)
    assert events_of(passive) == ["x2_reverses"]
    states = [phase.state for phase in passive.phases]
    assert not any(state.x1 or state.v1 for state in (*states, passive.end))


def test_5_a_standing_robot_moves_at_other_currents():
    load, friction, force = WEIGHT, HOPPER_C.m_eff * HOPPER_C.f1, -HOPPER_C.gamma2
    up, down = (load + friction) / force, (load - friction) / force
    says(5, f"{up:.2f} A", f"{formulas.threshold_current(HOPPER_C):.2f} A", f"{down:.2f} A", f"{(up - down) / 2:.2f} A")
    assert load > friction
    standing = LegState(0.04, 0.0, 0.0, load / HOPPER_C.k)
    for u, direction in ((1.01 * up, 1), (0.99 * up, 0), (1.01 * down, 0), (0.99 * down, -1), (0.0, -1)):
        assert np.sign(solve(HOPPER_C, standing, u).end.x1 - 0.04) == direction, u


def test_5_measures_the_friction_at_rest():
    """By the solver: an unloaded actuator with more friction at rest moves from the current of (5) with both on."""
    robot = HOPPER_C._replace(f1_excess=0.5, g=0.0, x1_min=-1.0)
    measured = robot.m_eff * (robot.f1 + robot.f1_excess) / abs(robot.gamma2)
    assert float(formulas.threshold_current(robot)) == pytest.approx(measured, rel=1e-15)
    for u, moves in ((0.99 * measured, False), (1.01 * measured, True), (-0.99 * measured, False)):
        x1 = solve(robot, LegState(0.04, 0.0, 0.0, 1e-9), u).end.x1
        assert (abs(x1 - 0.04) > 1e-4) == moves, u


def test_8_as_printed_misplaces_the_body():
    stance = drop(3.0)
    t = turning(stance)
    right, _ = height_by_18(3.0, t)
    says(8, f"{1e3 * (right - height_by_18(3.0, t, gamma=printed(8))[0]):.1f} mm lower")
    at_takeoff = HOPPER_C.L0 + stance.end.x1
    held_sign, _ = height_by_18(3.0, stance.duration)
    says(8, f"{1e3 * (held_sign - at_takeoff):.1f} mm")


def test_10_as_printed_pushes_an_actuator_that_sinks():
    stance = drop(0.0, FREE)
    t = turning(stance)
    true = float(stance.at(t).x1)
    m, k = HOPPER_C.m_eff, HOPPER_C.k
    system = np.zeros((5, 5))
    system[1, 2] = system[3, 4] = 1.0
    system[2] = [-k * HOPPER_C.L0 / m - HOPPER_C.f1, -k / m, -HOPPER_C.b1 / m, k / m, 0.0]
    body = k / HOPPER_C.m_s
    system[4] = [body * HOPPER_C.L0 - HOPPER_C.g + HOPPER_C.f2, body, 0.0, -body, -HOPPER_C.b2 / HOPPER_C.m_s]
    start = [1.0, 0.0, 0.0, HOPPER_C.L0, formulas.touchdown_velocity(HOPPER_C, DROP)]
    printed = mpmath.expm(mpmath.matrix(system.tolist()) * t) * mpmath.matrix(start)
    assert true < 0.0
    says(10, f"{1e3 * (true - float(printed[1])):.1f} mm too low")


def test_14_as_printed_is_centimetres_off_at_the_end_of_one_compression():
    t = turning(drop(3.0))
    as_printed = printed(14).subs({algebra.b_eff: Q.m_eff, algebra.m_1: Q.m_eff})
    right, wrong = height_by_18(3.0, t)[0], height_by_18(3.0, t, h_2=as_printed)[0]
    says(14, f"{1e2 * abs(wrong - right):.0f} cm")
    assert abs(right - drop(3.0).at(t).x2) < 1e-12


def test_18_loses_its_digits_where_friction_is_small():
    smooth = HOPPER_C._replace(b1=1e-6, b2=1e-6)
    exact, in_double = height_by_18(3.0, 0.1, smooth)
    assert 0.01 < abs(in_double - exact) < 1.0
    says(18, "b_1 = b_2 = 1e-6 N s/m", "more than 1 cm")
    exact, in_double = height_by_18(3.0, 0.1)
    assert abs(in_double - exact) < 1e-13


def body_ledger(u: float):
    stance = drop(u)
    return stance, dict(stance.ledger(stance.duration)._asdict())


def test_24_with_plus_signs_overpredicts_the_apex_and_counts_less_than_the_motor_does():
    stance, entries = body_ledger(3.0)
    losses = entries["viscous_2"] + entries["coulomb_2"]
    assert abs(entries["spring_work"] + losses - stance.aed) < 1e-12
    says(
        24,
        f"{1e2 * -2.0 * losses / WEIGHT:.0f} cm",
        f"{entries['spring_work']:.1f} J",
        f"{entries['motor_work']:.1f} J",
    )


def test_25_before_the_impact_promises_too_much():
    says(25, f"{1e2 * HOPPER_C.impact_loss * DROP:.1f} cm")
    after = formulas.touchdown_velocity(HOPPER_C, DROP)
    lost = WEIGHT * DROP - 0.5 * HOPPER_C.m_s * after**2
    assert abs(lost / WEIGHT - HOPPER_C.impact_loss * DROP) < 1e-15


def test_26_misplaces_the_apex_by_half_of_a_step_up_and_by_one_and_a_half_steps_down():
    for step, figure in ((-0.05, 7.5), (0.05, 2.5)):
        assert abs(1e2 * abs(abs(step) / 2 - step) - figure) < 1e-12
        says(26, f"{figure:.1f} cm")


def test_27_promises_the_height_that_the_spring_keeps():
    stance = drop(3.0)
    touchdown = 0.5 * HOPPER_C.m_s * formulas.touchdown_velocity(HOPPER_C, DROP) ** 2
    predicted = (touchdown + stance.aed) / WEIGHT  # where (27) is zero on level ground
    says(27, f"{1e2 * (predicted - stance.apex):.1f} cm of apex")


def test_27_has_jumps_and_several_minima():
    u = np.linspace(0.0, 2.0, 41)
    low, high = (np.array([drop(current, height=height).apex for current in u]) for height in (0.02, DROP))
    gap = np.flatnonzero(np.isnan(low))
    assert gap[0] > 0 and gap[-1] < u.size - 1
    assert low[gap[-1] + 1] - low[gap[0] - 1] > 0.01
    assert (np.diff(high) < 0.0).any() and (np.diff(high) > 0.0).any()
