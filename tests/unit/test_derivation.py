"""The derivation obeys what it starts from: (3), (4), their initial conditions, their energies, their transforms.

Everything here is exact. Time derivatives are taken by the rules that define W, R and exp(-a t); Laplace transforms
replace them by the rational functions that they stand for. A difference is zero if its numerator expands to zero.
"""

import dataclasses
from functools import cache

import pytest
import sympy as sp

from derive.ir import Step, unfold
from derive.maths import control, energy, flight, laplace, modes, partial_fractions, time_domain
from derive.maths.laplace import matrix_of, s
from derive.model import quantities as Q
from derive.model.equations import Model
from derive.paper.register import cubic
from derive.shipped import HOPPER
from tests.derived import hopper_with

LINKED = hopper_with("h.leg.damper(3)")
MODELS = pytest.mark.parametrize("model", [HOPPER, LINKED], ids=["hopper", "with_a_further_term"])
MODES = pytest.mark.parametrize("moving", [(1, 2), (1,), (2,)], ids=["both", "actuator", "body"])
FREE_NUMERATORS = {1: modes.free_numerator_1, 2: modes.free_numerator_2}


def is_zero(expression: sp.Expr) -> bool:
    return sp.expand(sp.numer(sp.together(expression))) == 0


def values(*groups: tuple[Step, ...]) -> dict[sp.Symbol, sp.Expr]:
    """The names that steps define, each in terms of what none of them defines."""
    known: dict[sp.Symbol, sp.Expr] = {}
    for group in groups:
        for step in group:
            known[step.symbol] = sp.sympify(step.value).subs(known)
    return known


@cache
def parameters(model: Model) -> dict[sp.Symbol, sp.Expr]:
    """Every rate and constant acceleration of a model in its own parameters."""
    return values(laplace.rates_of(model), laplace.drive_of(model))


def held(moving: tuple[int, ...]) -> dict[sp.Symbol, sp.Expr]:
    """With one mass held the third pole is a = 0, so P = s (s^2 + p s + q), and its side and speed are 0."""
    if len(moving) == 2:
        return {}
    p, q = ((Q.p_1, Q.q_1), (Q.p_2, Q.q_2))[moving[0] - 1]
    rests = {1: (Q.v2, Q.side_2), 2: (Q.v1, Q.side_1)}[moving[0]]
    return {Q.s_1: p, Q.s_2: q, Q.s_3: sp.S.Zero, rests[0]: sp.S.Zero, rests[1]: sp.S.Zero}


# ---- the closed form solves the equations of motion ----

CHAIN = ((Q.W2, Q.W1), (Q.W1, Q.W), (Q.W, Q.Wd), (Q.Wd, Q.Wdd), (Q.Wdd, -Q.s_1 * Q.Wdd - Q.s_2 * Q.Wd - Q.s_3 * Q.W))
AT_START = {Q.W2: 0, Q.W1: 0, Q.W: 0, Q.Wd: 0, Q.Wdd: 1, Q.t: 0}
# P(d/dt) W = 0 integrated once from W = W' = 0, W'' = 1.
FIRST_INTEGRAL = Q.Wdd + Q.s_1 * Q.Wd + Q.s_2 * Q.W + Q.s_3 * Q.W1 - 1


def rate(expression: sp.Expr) -> sp.Expr:
    """The time derivative of an expression in t and W."""
    return expression.diff(Q.t) + sum(expression.diff(name) * derivative for name, derivative in CHAIN)


@cache
def trajectory(model: Model, moving: tuple[int, ...]) -> dict[sp.Symbol, sp.Expr]:
    """x1_t, v1_t, v2_t, y_t in the robot's parameters, the initial state, t and W."""
    known = values(laplace.numerators(moving), time_domain.state_at())
    return {name: known[name].subs(held(moving)).subs(parameters(model)).subs(held(moving)) for name in STATE}


STATE = (time_domain.x1_t, time_domain.v1_t, time_domain.v2_t, time_domain.y_t)


def in_motion(expression: sp.Expr, path: dict[sp.Symbol, sp.Expr]) -> sp.Expr:
    return expression.subs(
        dict(zip((Q.x1, Q.v1, Q.v2, Q.y), (path[name] for name in STATE), strict=True)), simultaneous=True
    )


def test_the_first_integral_follows_from_the_equation_of_w_and_its_start():
    assert is_zero(rate(FIRST_INTEGRAL))
    assert is_zero(FIRST_INTEGRAL.subs(AT_START))


@MODELS
@MODES
def test_velocities_obey_3_and_4(model, moving):
    path = trajectory(model, moving)
    for number in moving:
        acceleration = model.in_compression[number - 1].subs(
            {k: v for k, v in held(moving).items() if k in (Q.side_1, Q.side_2)}
        )
        residual = rate(path[STATE[number]]) - in_motion(acceleration, path)
        poles = {n: n.subs(held(moving)).subs(parameters(model)) for n in (Q.s_1, Q.s_2, Q.s_3)}
        wdd = sp.solve(FIRST_INTEGRAL, Q.Wdd)[0].subs(poles)
        assert is_zero(residual.subs(poles).subs(Q.Wdd, wdd))


@MODELS
@MODES
def test_displacement_and_compression_change_as_the_velocities_say(model, moving):
    path = trajectory(model, moving)
    x1_t, v1_t, v2_t, y_t = (path[name] for name in STATE)
    poles = {n: n.subs(held(moving)).subs(parameters(model)) for n in (Q.s_1, Q.s_2, Q.s_3)}
    wdd = sp.solve(FIRST_INTEGRAL, Q.Wdd)[0].subs(poles)
    assert is_zero((rate(x1_t) - v1_t).subs(Q.Wdd, wdd))
    assert is_zero((rate(y_t) - (v1_t - v2_t)).subs(Q.Wdd, wdd))


@MODELS
@MODES
def test_a_phase_starts_where_the_last_one_ended(model, moving):
    path = trajectory(model, moving)
    still = {k: v for k, v in held(moving).items() if k in (Q.v1, Q.v2)}
    for name, start in zip(STATE, (Q.x1, Q.v1, Q.v2, Q.y), strict=True):
        assert is_zero(path[name].subs(AT_START) - start.subs(still))


@MODES
def test_a_held_mass_stays(moving):
    path = trajectory(HOPPER, moving)
    for number in {1, 2} - set(moving):
        assert path[STATE[number]] == 0
    if 1 not in moving:
        assert path[time_domain.x1_t] == Q.x1


def test_both_masses_end_with_the_terminal_velocity_that_balances_all_forces():
    """Final value theorem: v_i - v_i(0) -> H_1/s_3."""
    known = values(laplace.numerators((1, 2)))
    forces = sum(
        mass * acc.subs({Q.v1: 0, Q.v2: 0, Q.y: 0})
        for mass, acc in zip((Q.m_eff, Q.m_s), HOPPER.in_compression, strict=True)
    )
    for v, h_1 in ((Q.v1, Q.H1_1), (Q.v2, Q.H1_2)):
        assert is_zero((v + known[h_1] / Q.s_3).subs(parameters(HOPPER)) - forces / (Q.b1 + Q.b2))


def test_the_spring_ends_with_the_compression_at_which_nothing_accelerates():
    known = values(laplace.numerators((1, 2)))
    end = {
        name: (name + known[h_1] / Q.s_3).subs(parameters(HOPPER))
        for name, h_1 in ((Q.v1, Q.H1_1), (Q.v2, Q.H1_2), (Q.y, Q.H1_y))
    }
    for acceleration in HOPPER.in_compression:
        assert is_zero(acceleration.subs(end, simultaneous=True))


def test_one_mass_alone_comes_to_rest_at_its_equilibrium():
    for moving, q in (((1,), Q.q_1), ((2,), Q.q_2)):
        known = values(laplace.numerators(moving))
        compression_at_rest = Q.y + known[Q.H2_y] / q
        rest = {Q.y: compression_at_rest.subs(held(moving)).subs(parameters(HOPPER)), Q.v1: 0, Q.v2: 0}
        assert is_zero(HOPPER.in_compression[moving[0] - 1].subs(rest))


# ---- the equations of motion are those of the Lagrangian; the transform is that of the paper ----


def test_the_lagrangian_conserves_momentum_but_for_weight_and_offset():
    momentum = sum(HOPPER.lagrangian.diff(x) for x in (Q.x1, Q.x2))
    assert is_zero(momentum + Q.m_s * Q.g)
    at_rest = sum(m * a for m, a in zip((Q.m_eff, Q.m_s), HOPPER.accelerations, strict=True)).subs(
        {Q.v1: 0, Q.v2: 0, Q.u: 0, Q.side_1: 0, Q.side_2: 0}
    )
    assert is_zero(at_rest + Q.m_s * Q.g - Q.k * Q.c)


@MODELS
def test_the_numerators_are_those_of_11_to_17_counted_from_the_start(model):
    """s^2 P X_i = (x_i(0) s + v_i(0)) P + H_3 s^2 + H_2 s + H_1, X_i solved from the transforms of (3), (4)."""
    x1_0, v1_0, x2_0, v2_0 = sp.symbols("x1_0 v1_0 x2_0 v2_0", real=True)
    start = {Q.y: x1_0 - x2_0 + Q.L0 + Q.c, Q.v1: v1_0, Q.v2: v2_0}
    known = values(laplace.numerators((1, 2)))
    frame = laplace.paper_frame(model)
    polynomial = sum((n.subs(parameters(model)) * s**i for i, n in enumerate((Q.s_3, Q.s_2, Q.s_1))), s**3)
    for i, names, x_0, v_0 in ((1, laplace.NAMES[1], x1_0, v1_0), (2, laplace.NAMES[2], x2_0, v2_0)):
        h = [known[name].subs(parameters(model)).subs(start) for name in names]
        ours = (x_0 * s + v_0) * polynomial + h[0] * s**2 + h[1] * s + h[2]
        assert is_zero(ours - frame[i - 1].as_expr())


def test_the_denominators_are_the_characteristic_polynomials():
    known = parameters(HOPPER)
    assert is_zero(sum((known[n] * s**i for i, n in enumerate((Q.s_3, Q.s_2, Q.s_1))), s**3) - cubic)
    matrix = matrix_of(HOPPER).subs(known)
    for p, q, kept in ((Q.p_1, Q.q_1, [0, 1]), (Q.p_2, Q.q_2, [0, 2])):
        own = (s * sp.eye(2) - matrix.extract(kept, kept)).det()
        assert is_zero(s**2 + known[p] * s + known[q] - own)


def test_rates_and_drive_give_back_the_accelerations():
    known = parameters(HOPPER)
    z = sp.Matrix([Q.y, Q.v1, Q.v2])
    for row, constant, acceleration in ((1, Q.C_1, 0), (2, Q.C_2, 1)):
        linear = (matrix_of(HOPPER)[row, :] * z)[0] + constant
        assert is_zero(linear.subs(known) - HOPPER.in_compression[acceleration])


def test_free_accelerations_are_the_right_sides_at_rest_without_friction():
    known = values(laplace.rates_of(HOPPER), modes.free_accelerations())
    first, second = HOPPER.in_compression
    assert is_zero(known[Q.free_1] - first.subs({Q.v1: 0, Q.side_1: 0}))
    assert is_zero(known[Q.free_2] - second.subs({Q.v2: 0, Q.side_2: 0}))


@pytest.mark.parametrize("number", [1, 2])
def test_the_free_acceleration_of_a_held_mass_follows_the_other_one(number):
    moving = (3 - number,)
    path = values(laplace.numerators(moving), time_domain.state_at())
    end = {old: path[new] for old, new in zip((Q.y, Q.v1, Q.v2), (time_domain.y_t, *STATE[1:3]), strict=True)}
    known = values(modes.free_accelerations())[Q.free_1 if number == 1 else Q.free_2]
    numerator = values(laplace.numerators(moving), FREE_NUMERATORS[number]())
    rise = numerator[Q.H3] * Q.Wd + numerator[Q.H2] * Q.W + numerator[Q.H1] * Q.W1  # (19), (21) of it
    change = known.subs(end, simultaneous=True) - known
    assert is_zero((change - rise).subs(held(moving)))


# ---- energy ----


def power_of(function: sp.Expr) -> sp.Expr:
    """The rate of a function of the state along (3), (4)."""
    first, second = HOPPER.accelerations
    return sum(function.diff(x) * d for x, d in ((Q.x1, Q.v1), (Q.x2, Q.v2), (Q.v1, first), (Q.v2, second)))


def test_the_whole_robot_gains_what_the_ledger_says():
    powers = energy.powers(HOPPER) | {Q.STOP_LOSS.symbol: 0}  # between stops
    assert is_zero(
        power_of(energy.total_energy(HOPPER)) - sum(powers[entry] for entry in energy.whole_robot_entries(HOPPER))
    )


def test_the_body_gains_the_aed():
    powers = energy.powers(HOPPER)
    assert is_zero(power_of(energy.body_energy) - sum(powers[entry] for entry in energy.body_entries(HOPPER)))


def test_friction_only_takes():
    powers = energy.powers(HOPPER)
    positive = {symbol: sp.Symbol(symbol.name, positive=True) for symbol in (Q.b1, Q.b2, Q.f1, Q.f2, Q.m_eff, Q.m_s)}
    for sign in (1, -1):
        speed = sign * sp.Symbol("speed", positive=True)
        moving = {Q.v1: speed, Q.v2: speed, Q.side_1: sign, Q.side_2: sign}
        for loss in (Q.viscous_1, Q.viscous_2, Q.coulomb_1, Q.coulomb_2):
            assert powers[loss].subs(positive).subs(moving).is_negative


@MODELS
def test_the_ledger_integrates_the_powers_and_nothing_else(model):
    """Every integral replaced by what it integrates gives back the power; x_1 counts from the start of the phase."""
    powers = energy.powers(model)
    start = {energy.displacement: Q.x1 - energy.x1_0}
    in_phase = {Q.x2: Q.x1 + Q.L0 + Q.c - Q.y}
    for step in energy.ledger_of(model):
        integrand = sp.sympify(step.value).subs(energy.PRODUCTS).subs(start)
        assert is_zero((integrand - powers[step.symbol]).subs(in_phase))


def test_the_energies_of_a_state_are_those_of_the_lagrangian():
    known = values(energy.energies(HOPPER))
    where = {Q.y: HOPPER.compression}
    assert is_zero(known[Q.body].subs(where) - energy.body_energy)
    assert is_zero(known[Q.total].subs(where) - energy.total_energy(HOPPER))


def test_the_gain_of_the_body_is_a_difference_of_energies():
    known = values(energy.body_energy_gain(HOPPER))
    before = values(energy.energies(HOPPER))[Q.body]
    after = before.subs(dict(zip((Q.x1, Q.v2, Q.y), sp.symbols("x1_t v2_t y_t", real=True), strict=True)))
    assert is_zero(known[sp.Symbol("gain", real=True)] - (after - before))


# ---- the controller ----


def test_the_apex_from_energies_is_the_apex_of_the_takeoff():
    """Touchdown and take-off have y = 0; datum 0."""
    before = energy.body_energy.subs(Q.x2, Q.x1 + Q.L0 + Q.c)
    x1_T, v_up = control.x1_T, control.v_up
    gained = before.subs({Q.x1: x1_T, Q.v2: v_up}) - before
    from_energy = values(control.apex_from_energy())[control.apex].subs({control.aed: gained, control.step: 0})
    from_takeoff = control.apex_of_takeoff(HOPPER)[0].value.subs({Q.x1: x1_T, Q.y: 0})
    assert is_zero(from_energy - from_takeoff)


def test_a_lower_ground_adds_its_depth_to_the_apex_that_must_be_reached():
    apex = values(control.apex_from_energy())[control.apex]
    assert is_zero(apex.diff(control.step) + 1)


def test_a_drop_arrives_with_the_energy_of_its_height_less_the_impact():
    v_after = control.touchdown_velocity(HOPPER)[0].value
    fall = Q.m_s * Q.g * Q.height * (1 - Q.impact_loss)
    assert is_zero(Q.m_s * v_after**2 / 2 - fall)
    assert v_after.subs({Q.g: 1, Q.height: 1, Q.impact_loss: 0}).is_negative


def test_a_touchdown_keeps_the_share_of_the_kinetic_energy_that_the_impact_leaves():
    v_after = flight.velocity_after_impact()[-1].value
    assert is_zero(v_after**2 - Q.v2**2 * (1 - Q.impact_loss))
    assert (v_after / Q.v2).subs(Q.impact_loss, 0) == 1


def test_the_printed_objective_is_that_of_the_register():
    known = values(control.printed_objective())
    expected = sp.Abs(
        control.aed + Q.m_s * Q.v2**2 / 2 + Q.m_s * Q.g * sp.Abs(control.step) / 2 - Q.m_s * Q.g * control.h_des
    )
    assert is_zero(known[control.J].args[0] ** 2 - expected.args[0] ** 2)


def test_the_threshold_moves_an_unloaded_actuator():
    current = control.threshold_current()[0].value
    push = HOPPER.in_compression[0].subs({Q.y: 0, Q.v1: 0, Q.side_1: 0, Q.c: 0, Q.u: current})
    assert is_zero(push**2 - (Q.f1 + Q.f1_excess) ** 2)


@pytest.fixture(scope="module")
def motion_in_s() -> sp.Matrix:
    """(y, v_1, v_2) in s, by Cramer's rule on the equations of motion."""
    unknown = sp.symbols("y_s v1_s v2_s")
    first, second = HOPPER.in_compression
    moved = dict(zip((Q.y, Q.v1, Q.v2), unknown, strict=True))
    zero = dict.fromkeys((Q.y, Q.v1, Q.v2), 0)
    rows = [s * unknown[0] - Q.y - (unknown[1] - unknown[2])]
    for start, own, acc in ((Q.v1, unknown[1], first), (Q.v2, unknown[2], second)):
        constant = acc.subs(zero)
        rows.append(s * own - start - (acc - constant).subs(moved) - constant / s)
    system, right = sp.linear_eq_to_matrix(rows, unknown)
    return sp.Matrix([_cramer(system, right, i) for i in range(3)])


def _cramer(system: sp.Matrix, right: sp.Matrix, column: int) -> sp.Expr:
    replaced = system.copy()
    replaced[:, column] = right
    return replaced.det() / system.det()


def system(model: Model) -> tuple[sp.Matrix, sp.Matrix]:
    """M and d of z' = M z + d with both masses moving, in the robot's parameters."""
    right = sp.Matrix([Q.v1 - Q.v2, *model.in_compression])
    return right.jacobian([Q.y, Q.v1, Q.v2]), right.subs({Q.y: 0, Q.v1: 0, Q.v2: 0})


def variations(model: Model) -> dict[sp.Symbol, tuple[sp.Expr, sp.Expr]]:
    """For u and each parameter: the derivatives of the two right sides (3), (4) at a fixed state.

    With z = (y, v_1, v_2) the derivative of the state with respect to theta obeys
    (dz/dtheta)' = M dz/dtheta + (0, first, second), an equation of the same poles, each twice.
    """
    first, second = model.in_compression
    return {symbol: (first.diff(symbol), second.diff(symbol)) for symbol in (Q.u, *Q.LETTERS)}


def resolvent(matrix: sp.Matrix) -> sp.Matrix:
    """(s - M)^-1: the transform of d(y, v_1, v_2)/d(y(0), v_1(0), v_2(0))."""
    characteristic = s * sp.eye(3) - matrix
    return characteristic.adjugate() / characteristic.det()


@pytest.mark.parametrize("symbol", [Q.u, *Q.LETTERS[:11]], ids=str)
def test_a_variation_is_the_derivative_of_the_motion(symbol, motion_in_s):
    """Its transform is that of (s - M)^-1 (z(0) + d/s), differentiated."""
    matrix, constant = system(HOPPER)
    z = resolvent(matrix) * (laplace.START + constant / s)
    variation = resolvent(matrix) * (matrix.diff(symbol) * z + constant.diff(symbol) / s)
    assert all(is_zero(entry) for entry in variation - motion_in_s.diff(symbol))


def test_the_transition_is_the_derivative_of_the_motion_by_its_start(motion_in_s):
    difference = resolvent(system(HOPPER)[0]) - motion_in_s.jacobian([Q.y, Q.v1, Q.v2])
    assert all(is_zero(entry) for entry in difference)


def test_a_variation_is_driven_by_the_derivatives_of_the_right_sides():
    matrix, constant = system(HOPPER)
    for symbol, (first, second) in variations(HOPPER).items():
        drive = matrix.diff(symbol) * sp.Matrix([Q.y, Q.v1, Q.v2]) + constant.diff(symbol)
        assert all(is_zero(entry) for entry in drive - sp.Matrix([0, first, second]))


# ---- partial fractions: every name replaced by its Laplace transform ----

D = partial_fractions.pair_denominator
P = partial_fractions.denominator
COEFFICIENTS = {Q.s_1: Q.a + Q.p, Q.s_2: Q.q + Q.a * Q.p, Q.s_3: Q.a * Q.q}
TRANSFORMS = {
    Q.e: 1 / (s + Q.a), Q.e1: 1 / (s * (s + Q.a)), Q.e2: 1 / (s**2 * (s + Q.a)), Q.e3: 1 / (s**3 * (s + Q.a)),
    Q.Rd: s / D, Q.R: 1 / D, Q.R1: 1 / (s * D), Q.R2: 1 / (s**2 * D), Q.R3: 1 / (s**3 * D),
    Q.Wdd: s**2 / P, Q.Wd: s / P, Q.W: 1 / P, Q.W1: 1 / (s * P), Q.W2: 1 / (s**2 * P),
    Q.W3: 1 / (s**3 * P), Q.W4: 1 / (s**4 * P),
}  # fmt: skip


def transformed(expression: sp.Expr, transforms: dict[sp.Symbol, sp.Expr] = TRANSFORMS) -> sp.Expr:
    """The transform of an expression linear in the names of `transforms` and polynomial in t."""
    names = [name for name in transforms if name in expression.free_symbols]
    rest = expression.subs(dict.fromkeys(names, 0))
    total = sum(expression.diff(name) * transforms[name] for name in names)
    powers = sp.Poly(sp.expand(rest), Q.t).terms()
    return total + sum(coefficient * sp.factorial(n) / s ** (n + 1) for (n,), coefficient in powers)


def test_the_transforms_are_those_of_an_exponential_and_of_a_pair():
    t, a, p = sp.symbols("t a p", positive=True)
    w = sp.Symbol("w", positive=True)
    integral = sp.laplace_transform(sp.exp(-a * t), t, s, noconds=True)
    assert is_zero(integral - TRANSFORMS[Q.e].subs(Q.a, a))
    pair = sp.laplace_transform(sp.exp(-p / 2 * t) * sp.sin(w * t) / w, t, s, noconds=True)
    assert is_zero(pair - TRANSFORMS[Q.R].subs({Q.q: w**2 + p**2 / 4}).subs(Q.p, p))


@pytest.mark.parametrize("step", partial_fractions.split() + partial_fractions.split_soon(), ids=str)
def test_the_split_off_pole_and_the_pair_are_w(step):
    assert is_zero(transformed(step.value).subs(Q.chi, partial_fractions.residue()[0].value) - TRANSFORMS[step.symbol])


def test_chi_is_what_the_pair_is_at_the_pole():
    assert is_zero(partial_fractions.residue()[0].value - D.subs(s, -Q.a))


RECURSIONS = {
    name: getattr(partial_fractions, name)()
    for name in ("pair_by_quotient", "pair_from_series", "all_from_series", "integrals_by_recursion")
}


@pytest.mark.parametrize("name", RECURSIONS)
def test_integrals_and_derivatives_by_recursion_are_what_they_are_called(name):
    for step in RECURSIONS[name]:
        value = step.value.subs(Q.turned, 1 - Q.Rd - Q.p * Q.R)
        assert is_zero((transformed(value) - TRANSFORMS[step.symbol]).subs(COEFFICIENTS)), step


def test_the_shifted_polynomial_has_no_square_term_and_the_same_roots():
    known = values(partial_fractions.shift())
    sigma, Q_s, T_s = known[Q.sigma], known[partial_fractions.Q_s], known[partial_fractions.T_s]
    assert is_zero(P.subs(s, s - sigma) - (s**3 + Q_s * s + T_s))


def test_the_series_around_the_mean_root_is_w():
    """The transform of exp(-sigma t) V is that of V at s + sigma."""
    at = s + Q.sigma
    of_v = 1 / (at**3 + partial_fractions.Q_s * at + partial_fractions.T_s)
    series = {partial_fractions.V: of_v, partial_fractions.Vd: at * of_v, partial_fractions.Vdd: at**2 * of_v}
    shifted = values(partial_fractions.shift())
    for step in partial_fractions.unshift():
        value = transformed(step.value.subs(partial_fractions.decay, 1), series)
        assert is_zero((value - TRANSFORMS[step.symbol]).subs(shifted))


MOTION_OF_H = (Q.H3 * s**2 + Q.H2 * s + Q.H1) / P


def test_the_residual_to_steady_state_is_the_final_value_less_the_function():
    left = transformed(values(time_domain.residual_to_steady_state())[time_domain.residual])
    both = left.subs(Q.residual_0, Q.H1 / Q.s_3).subs(COEFFICIENTS)
    assert is_zero(both - (Q.H1 / Q.s_3 / s - MOTION_OF_H / s).subs(COEFFICIENTS))
    one = left.subs(Q.residual_0, Q.H2 / Q.s_2).subs(Q.H1, 0).subs(COEFFICIENTS).subs(Q.a, 0)
    assert is_zero(one - (Q.H2 / Q.s_2 / s - MOTION_OF_H / s).subs(Q.H1, 0).subs(COEFFICIENTS).subs(Q.a, 0))


@pytest.mark.parametrize(
    ("moving", "name", "last"), [((1, 2), Q.H1_y, Q.s_3), ((1,), Q.H2_y, Q.q_1), ((2,), Q.H2_y, Q.q_2)]
)
def test_what_y_tends_to_does_not_depend_on_where_it_starts(moving, name, last):
    lowest = values(laplace.numerators(moving))[name]
    assert is_zero(lowest - lowest.subs({Q.y: 0, Q.v1: 0, Q.v2: 0}) + last * Q.y)


def test_deflation_leaves_a_numerator_over_the_pair_alone():
    known = values(partial_fractions.deflated_numerator())
    assert is_zero((s + Q.a) * MOTION_OF_H - Q.H3 - (known[Q.A] * s + known[Q.B]) / D)


# ---- (18): the paper's coefficients where they exist ----


def test_18_comes_back_for_distinct_poles():
    """A + B t + C exp(-a t) + D exp(-b t) + E exp(-c t), its coefficients those of (11) by partial fractions."""
    a, b, c, t = sp.symbols("a b c t", positive=True)
    x_0, v_0 = sp.symbols("x_0 v_0", real=True)
    s_2, s_3 = a * b + a * c + b * c, a * b * c
    numerator = sp.expand((x_0 * s + v_0) * (s + a) * (s + b) * (s + c)) + Q.H3 * s**2 + Q.H2 * s + Q.H1
    h_1, h_2 = (sp.expand(numerator).coeff(s, n) for n in (0, 1))
    B = h_1 / s_3
    A = (h_2 - s_2 * B) / s_3
    shares = [numerator.subs(s, -r) / (r**2 * (r2 - r) * (r3 - r)) for r, r2, r3 in ((a, b, c), (b, a, c), (c, a, b))]
    decays = sp.symbols("e_a e_b e_c")
    printed = A + B * t + sum(share * decay for share, decay in zip(shares, decays, strict=True))

    weights = [1 / ((r2 - r) * (r3 - r)) for r, r2, r3 in ((a, b, c), (b, a, c), (c, a, b))]
    w = sum(weight * decay for weight, decay in zip(weights, decays, strict=True))
    w1 = sum(weight * (1 - decay) / r for weight, decay, r in zip(weights, decays, (a, b, c), strict=True))
    w2 = sum(weight * (t - (1 - decay) / r) / r for weight, decay, r in zip(weights, decays, (a, b, c), strict=True))
    body = unfold(time_domain.x1_t, time_domain.state_at()).subs(
        {Q.N2_1: Q.H3 + (a + b + c) * v_0, Q.N1_1: Q.H2 + s_2 * v_0, Q.N0_1: Q.H1 + s_3 * v_0}
    )
    wd = t - (a + b + c) * Q.W - s_2 * Q.W1 - s_3 * Q.W2
    body = body.subs({Q.Wd: wd}).subs({Q.x1: x_0, Q.v1: v_0, Q.t: t, Q.W: w, Q.W1: w1, Q.W2: w2})
    assert is_zero(printed - body)


def test_the_height_of_the_body_has_the_form_of_the_actuators_displacement():
    """x_2 = x_1 - y + L_0 + c: with y_t and x1_t it is x_2(0) + v_2 t + H_3 W + H_2 W1 + H_1 W2 of the body."""
    path = trajectory(HOPPER, (1, 2))
    known = values(laplace.numerators((1, 2)))
    h = [known[name].subs(parameters(HOPPER)) for name in laplace.NAMES[2]]
    expected = Q.v2 * Q.t + h[0] * Q.W + h[1] * Q.W1 + h[2] * Q.W2
    height = (path[time_domain.x1_t] - Q.x1) - (path[time_domain.y_t] - Q.y)
    poles = {n: n.subs(parameters(HOPPER)) for n in (Q.s_1, Q.s_2, Q.s_3)}
    # the same first integral, once more integrated: W' + s_1 W + s_2 W1 + s_3 W2 = t
    wd = (Q.t - Q.s_1 * Q.W - Q.s_2 * Q.W1 - Q.s_3 * Q.W2).subs(poles)
    assert is_zero((height - expected).subs(Q.Wd, wd))


@pytest.mark.parametrize("mass", [0, 1])
def test_friction_that_differs_by_sign_is_a_mean_and_a_constant_force(mass):
    """-f for a velocity above 0, f_minus below; at rest the other forces are held from -f_minus to f."""
    model = dataclasses.replace(HOPPER, by_sign=(True, True))
    side, f = ((Q.side_1, Q.f1), (Q.side_2, Q.f2))[mass]
    falling = (Q.f1_minus, Q.f2_minus)[mass]
    for equations in ("accelerations", "in_flight")[: 2 - mass]:
        smooth = getattr(HOPPER, equations)[mass].subs(side, 0)
        up, down, rest = (sp.expand(getattr(model, equations)[mass].subs(side, sign) - smooth) for sign in (1, -1, 0))
        assert (up, down) == (-f, falling)
        level = model.levels[mass]
        assert sp.expand(f + rest - level) == 0
        assert sp.expand(-falling + rest + level) == 0
