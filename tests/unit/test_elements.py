"""Elements of model files: what each becomes is what follows from the Lagrangian, written here from the physics."""

import re

import numpy as np
import pytest
import sympy as sp

from derive.derivation import Derivation
from derive.emit.program import program
from derive.ir import Own
from derive.model import quantities as Q
from derive.shipped import HOPPER, shipped
from tests.derived import model_of

TIME = sp.Symbol("time")
POSITIVE, OTHERS = ["J", "J_2", "m", "d", "k", "k_2", "n", "F", "F_b"], ["b", "b_2", "q_0", "load", "g"]
J, J_2, m, d, k, k_2, n, F, F_b, b, b_2, q_0, load, g = sp.symbols([*POSITIVE, *OTHERS])
i = sp.Symbol("i")
q, p = (sp.Function(name)(TIME) for name in "qp")
SIDES = sp.symbols("side_1 side_2")

# Elements; inertias by coordinate; potential energy; Rayleigh's function of damping; other forces by coordinate.
ONE = {
    "a pendulum": ("spring(q, m*g*d)", m * g * d * q**2 / 2, 0, 0),
    "a spring that is slack elsewhere": ("spring(q - q_0, k)", k * (q - q_0) ** 2 / 2, 0, 0),
    "a spring behind a gear": ("spring(n*q - q_0, k)", k * (n * q - q_0) ** 2 / 2, 0, 0),
    "two springs": ("spring(q, k)\nspring(q_0 - 2*q, k_2, 'other')", k * q**2 / 2 + k_2 * (q_0 - 2 * q) ** 2 / 2, 0, 0),
    "damping in two places": ("viscous(q, b)\nviscous(q, k/n, 'other')", 0, (b + k / n) / 2, 0),
    "a spring with a damper": ("spring(n*q, k).damper(b)", k * (n * q) ** 2 / 2, n**2 * b / 2, 0),
    "a motor and a load": ("current_ = current('i')\ntorque(q, n*k*current_)\ntorque(q, -load, 'load')", 0, 0,
                           n * k * i - load),
    "friction": ("friction(q, F)", 0, 0, -F * SIDES[0]),
    "nothing but a gear's inertia": ("viscous(q, b)", 0, b / 2, 0),
}  # fmt: skip


def accelerations(text: str) -> dict[str, sp.Expr]:
    """Of a text whose parameters have a unit that fits everywhere."""
    domains = dict.fromkeys(POSITIVE, "positive") | dict.fromkeys(OTHERS, "nonnegative")
    code = re.sub(r"\"[^\"]*\"|'[^']*'", "", text)
    used = {name: domain for name, domain in domains.items() if re.search(rf"\b{name}\b", code)}
    lines = [f"{name} = parameter('{name}', '?', '{name}', '{domain}')" for name, domain in used.items()]
    found = Derivation(model_of("\n".join((*lines, text)))).equations_of_motion
    return {name: value for name, value in found.items() if name.startswith("acc_")}


def balance(inertia: sp.Expr, coordinate: sp.Expr, potential: sp.Expr, dissipation: sp.Expr, others: sp.Expr):
    """The acceleration by Lagrange's equation; of dissipation what stands before the square of the velocity."""
    lagrangian = inertia * coordinate.diff(TIME) ** 2 / 2 - potential
    force = lagrangian.diff(coordinate) - 2 * dissipation * coordinate.diff(TIME) + others
    return force / inertia


def in_names(value: sp.Expr) -> sp.Expr:
    """Functions of time as the symbols of a file."""
    for each in (q, p):
        name = each.func.__name__
        value = value.subs(each.diff(TIME), sp.Symbol(f"{name}_dot")).subs(each, sp.Symbol(name))
    return value


@pytest.mark.parametrize("name", ONE)
def test_one_coordinate_moves_as_its_lagrangian_says(name):
    text, potential, dissipation, others = ONE[name]
    inertia = J + m * n**2
    found = accelerations(f'q = coordinate("q", "rad", J + m*n**2, "wheel")\n{text}')
    wanted = in_names(balance(inertia, q, sp.sympify(potential), sp.sympify(dissipation), sp.sympify(others)))
    assert found.keys() == {"acc_1"}
    assert sp.simplify(found["acc_1"] - wanted) == 0


def test_friction_by_direction_is_less_forward_and_more_backward():
    found = accelerations('q = coordinate("q", "rad", J)\nfriction(q, forward=F, backward=F_b)')["acc_1"]
    for side, wanted in ((1, -F / J), (-1, F_b / J)):
        assert sp.simplify(found.subs(SIDES[0], side) - wanted) == 0


TWO = """
p = coordinate("p", "m", J_2, "load")
q = coordinate("q", "m", J, "motor"{held})
c = current("i", limit=load)
force(q, n*c)
gravity(p, g)
gravity(q, g, "weight of the motor")
spring(p - q - q_0, k).damper(b)
spring(q - p, k_2, "other")
viscous(p, b_2)
friction(p, F)
"""
"""The order of lines, the names and the sign of a stretch do not matter: the motor is the first mass."""


def test_two_coordinates_move_as_their_lagrangian_says():
    found = accelerations(TWO.format(held=""))
    rate = q.diff(TIME) - p.diff(TIME)
    springs = k * (p - q - q_0) ** 2 / 2 + k_2 * (q - p) ** 2 / 2
    on_q = -springs.diff(q) - J * g + n * i - b * rate
    on_p = -springs.diff(p) - J_2 * g + b * rate - b_2 * p.diff(TIME) - F * SIDES[1]
    for name, force, inertia in (("acc_1", on_q, J), ("acc_2", on_p, J_2)):
        assert sp.simplify(found[name] - in_names(force / inertia)) == 0


def test_what_is_held_stays_at_0_and_its_parameters_are_left_out():
    text = TWO.format(held=", held=True")
    found = accelerations(text)
    springs = k * (p - q_0) ** 2 / 2 + k_2 * p**2 / 2
    on_p = -springs.diff(p) - J_2 * g - (b + b_2) * p.diff(TIME) - F * SIDES[0]
    assert found.keys() == {"acc_1"} and sp.simplify(found["acc_1"] - in_names(on_p / J_2)) == 0


def test_the_robot_has_the_parameters_that_move_what_moves():
    text = "J, J_2, k, b = (parameter(name, '?', name, 'positive') for name in ('J', 'J_2', 'k', 'b'))\n"
    text += "p = coordinate('p', 'rad', J_2)\nq = coordinate('q', 'rad', J, held={held})\n"
    text += "spring(p - q, k)\nviscous(q, b)\n"
    assert [each.name for each in model_of(text.format(held=False)).parameters] == ["J", "J_2", "k", "b"]
    assert [each.name for each in model_of(text.format(held=True)).parameters] == ["J_2", "k"]


def test_the_hopper_is_that_of_the_paper():
    """(3), (4) as they are printed, with the offset force; every letter is the parameter of its name."""
    a_1 = (Q.k * (Q.x2 - Q.x1 - Q.L0) - Q.b1 * Q.v1 - Q.gamma2 * Q.u) / Q.m_eff - Q.f1 * Q.side_1
    a_2 = (Q.k * (Q.x1 - Q.x2 + Q.L0 + Q.c) - Q.b2 * Q.v2 - Q.m_s * Q.g) / Q.m_s - Q.f2 * Q.side_2
    for found, wanted in zip(HOPPER.accelerations, (a_1, a_2), strict=True):
        assert sp.expand(found - wanted) == 0
    own = {
        letter.name: value
        for letter, value in HOPPER.constants.items()
        if letter not in (*Q.BY_SIGN, *Q.OF_LAW, *Q.OF_GEAR)
    }
    assert all(value == Own(name, real=True) for name, value in own.items())
    assert (HOPPER.further, HOPPER.by_sign, HOPPER.has_contact) == ((), (False, False), True)


def test_a_parameter_may_have_the_name_of_a_letter_that_is_another_thing():
    """k a damping, b1 a stiffness, q a torque, m_eff a friction: each keeps its place in the generated formulas."""
    text = """
k = parameter("k", "N m s/rad", "damping", "nonnegative")
b1 = parameter("b1", "N m/rad", "stiffness", "positive")
q = parameter("q", "N m", "torque")
m_eff = parameter("m_eff", "N m", "friction", "nonnegative")
f1 = parameter("f1", "kg m^2", "inertia", "positive")
phi = coordinate("phi", "rad", f1 + f1)
spring(phi, b1)
viscous(phi, k)
torque(phi, q)
friction(phi, m_eff)
"""
    function = program(model_of(text)).function("rates_of")
    values = dict(k=3.0, b1=50.0, q=0.7, m_eff=0.2, f1=0.25)
    known = {each.symbol: values[each.name] for each in function.takes[0].quantities}
    for step in function.steps:
        known[step.symbol] = step.value.subs(known)
    found = {str(symbol): float(known[symbol]) for symbol in (Q.a1_y, Q.a1_v1, Q.a1_0)}
    np.testing.assert_allclose([found["a1_y"], found["a1_v1"], found["a1_0"]], [-100.0, -6.0, 1.4], rtol=1e-15)


@pytest.mark.parametrize(
    "name", ["pendulum", "joint", "servo", "slide", "cart", "relief_valve", "sea", "sea_held", "hopper"]
)
def test_a_model_that_ships_is_in_units_that_fit(name):
    """The file is read, which checks them; and its parameters have defaults but for the hopper's."""
    model = shipped(name)
    assert model.title.endswith(".") and "'" in model.text.split('"""')[1], "no equation of motion in the docstring"
    assert name == "hopper" or all(each.default is not None for each in model.parameters)
