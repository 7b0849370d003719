"""The transition matrix of both masses slipping: what derive has it to be, by algebra and in 40 digits.

E' = M E, Phi' = E, Phi_2' = Phi are proven for all rates, with a coupling and a gear, and every constant of a node is
held to 40 digits over random robots, over near-equal poles and over stiff ones.
"""

import ctypes
import math
from collections.abc import Iterator
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy as sp

from derive.maths import laplace, transition
from derive.model.quantities import (
    W1,
    W2,
    W,
    Wd,
    Wdd,
    a,
    a1_v1,
    a1_v2,
    a2_v1,
    a2_v2,
    chi,
    damping,
    drift_1,
    drift_2,
    p_1,
    p_2,
    q_1,
    q_2,
    s_1,
    s_2,
    s_3,
    y_v1,
)
from derive.model_file import read_model
from tests.derived import model_file
from tests.objects import shared_library
from tests.oracle.checker import ROBOT

EPS = 2.0**-52
DIGITS = 40
MODELS = ("hopper", "leg_damper", "geared_sea")
"""One in which no velocity stands in the other's equation, one in which both do, and one with a gear."""


def values(steps) -> dict[sp.Symbol, sp.Expr]:
    found: dict[sp.Symbol, sp.Expr] = {}
    for step in steps:
        found[step.symbol] = step.value.subs(found)
    return found


def rates_of(matrix: sp.Matrix) -> dict[sp.Symbol, sp.Expr]:
    """The characteristic polynomials by the entries."""
    known = dict(zip((s_1, s_2, s_3), laplace.characteristic(matrix), strict=True))
    known |= dict(zip((p_1, q_1), laplace.characteristic(matrix.extract((0, 1), (0, 1))), strict=True))
    known |= dict(zip((p_2, q_2), laplace.characteristic(matrix.extract((0, 2), (0, 2))), strict=True))
    known[damping] = laplace.characteristic(matrix.extract((1, 2), (1, 2)))[1]
    return known | {drift_1: a1_v1 + a1_v2 * y_v1, drift_2: a2_v1 + a2_v2 * y_v1}


def entries(name: str, found: dict[sp.Symbol, sp.Expr], rows: int = 3) -> sp.Matrix:
    quantities = {"stays": transition.STAYS, "gains": transition.GAINS, "moves": transition.MOVES}[name]
    return sp.Matrix(rows, 3, [found[each.symbol] for each in quantities])


@pytest.mark.parametrize("name", MODELS)
def test_the_entries_are_the_transition_matrix_and_its_integrals(name):
    model = read_model(model_file(name))
    matrix = laplace.matrix_of(model)
    known = rates_of(matrix)
    later = {Wdd: -(s_1 * Wdd + s_2 * Wd + s_3 * W), Wd: Wdd, W: Wd, W1: W, W2: W1}
    change = lambda each: sp.expand(sum(each.diff(part) * rate for part, rate in later.items()))  # noqa: E731
    found = values(transition.transition_of_both(model))
    stays, gains, moves = entries("stays", found), entries("gains", found), entries("moves", found, 1)
    at_start = {Wdd: 1, Wd: 0, W: 0, W1: 0, W2: 0}
    assert stays.subs(at_start) == sp.eye(3) and gains.subs(at_start).is_zero_matrix
    zero = (
        stays.applyfunc(change) - matrix * stays, gains.applyfunc(change) - stays, moves.applyfunc(change) - gains[1, :]
    )  # fmt: skip
    assert all(each.subs(known).applyfunc(sp.expand).is_zero_matrix for each in zero)


@pytest.mark.parametrize("name", MODELS)
def test_rates_give_the_state_where_it_ends(name):
    model = read_model(model_file(name))
    matrix = laplace.matrix_of(model)
    known = rates_of(matrix)
    settled = sp.Matrix([step.value for step in transition.settled_of_both(model)])
    left = sp.Matrix([step.value for step in transition.unsettled_of_both(model)])
    assert (matrix * settled + laplace.CONSTANT).subs(known).applyfunc(sp.cancel).is_zero_matrix
    assert (matrix * left - transition.w).subs(known).applyfunc(sp.cancel).is_zero_matrix
    bends = sp.Matrix([step.value for step in transition.bends_of_both(model)])
    rates = sp.Matrix([step.value for step in transition.rates_of_both(model)])
    assert (bends - matrix * transition.w).is_zero_matrix
    assert (rates - matrix * laplace.START - laplace.CONSTANT).applyfunc(sp.expand).is_zero_matrix
    above = dict(zip(transition.ABOVE.symbols, (a + a1_v1, a + a2_v2), strict=True))
    deflated = sp.Matrix([step.value for step in transition.deflated_of_both(model)]).subs(above)
    assert (deflated - (matrix + a * sp.eye(3)) * transition.w).applyfunc(sp.expand).is_zero_matrix


@pytest.mark.parametrize("name", MODELS)
def test_the_real_pole_is_polished_by_a_step_of_newtons_on_the_cubic(name):
    model = read_model(model_file(name))
    matrix = laplace.matrix_of(model)
    own = {p_1: -a1_v1, p_2: -a2_v2}
    polynomial = sp.expand((laplace.s * sp.eye(3) - matrix).det().subs(laplace.s, -a))
    for step, diagonal in zip(list(transition.above_of_both(model))[-2:], (a1_v1, a2_v2), strict=True):
        value = values(transition.above_of_both(model))[step.symbol].subs(own)
        assert sp.expand((value - a - diagonal) * chi - polynomial) == 0


def robots(kind: str) -> Iterator[dict[str, float]]:
    draw = np.random.default_rng(7)
    for _ in range(20):
        ratio, spring = 10.0 ** draw.uniform(-3, 3), 10.0 ** draw.uniform(0, 6)
        damping = draw.choice([0.0, 1.0], 2, p=[0.1, 0.9]) * 10.0 ** draw.uniform(-6, 1.0, 2)
        p1, p2 = 2.0 * damping * (math.sqrt(spring / ratio), math.sqrt(spring))
        if kind == "stiff":
            p1 = math.sqrt(spring) * 10.0 ** draw.uniform(2, 7)
        elif kind == "near equal":  # (s + l)^3 but for 1e-12 .. 1e-2, by the coefficients
            rate = math.sqrt(spring)
            p1, ratio = 2.0 * rate, 1.0
            p2 = rate * (1.0 + 10.0 ** draw.uniform(-12, -2))
            spring, p1 = near_triple(rate, 10.0 ** draw.uniform(-12, -2))
            p2 = 3.0 * rate - p1
        yield {"m_eff": ratio, "m_s": 1.0, "k": spring, "b1": p1 * ratio, "b2": p2}


def near_triple(rate: float, apart: float) -> tuple[float, float]:
    """k and b1 of two unit masses of which the poles are three near `rate`: p_1 p_2 + 2 k = 3 l^2, k (p_1 + p_2) = l^3."""
    spring = rate**2 / 3.0 * (1.0 + apart)
    product = 3.0 * rate**2 - 2.0 * spring
    half = 1.5 * rate
    return spring, half + math.sqrt(max(half**2 - product, 0.0))


@pytest.mark.sliced
@pytest.mark.parametrize("kind", ["random", "near equal", "stiff"])
def test_constants_of_a_node_keep_their_digits(store, kind):
    source = (Path(__file__).with_name("node_rules.c"),)
    library = ctypes.CDLL(str(shared_library(store, "node_rules", source, "-DDOUBLE")))
    worst, asked = 0.0, 0
    for robot in robots(kind):
        given = dict.fromkeys(ROBOT, 0.0) | {"u_max": 1.0, "gamma2": 1.0, "g": 9.81} | robot
        given |= {"x1_min": -math.inf, "x1_max": math.inf}
        made = (ctypes.c_double * 28)()
        library.constants((ctypes.c_double * len(ROBOT))(*(given[name] for name in ROBOT)), made)
        if not made[0] > 0.0:
            continue
        asked += 1
        worst = max(worst, worst_of(list(made)))
    assert asked >= 16 and worst <= 64.0, f"{kind}: {worst:.3g} eps of {asked} robots"


def worst_of(made: list[float]) -> float:
    """The largest error of a constant, in eps of the sum of the magnitudes that it is a sum of."""
    h, above, numbers = made[0], made[1:3], made[3:24]
    with mpmath.workdps(2 * DIGITS):
        a1y, a1v1, a2y, a2v2 = map(mpmath.mpf, made[24:])
        matrix = mpmath.matrix([[0, 1, -1], [a1y, a1v1, 0], [a2y, 0, a2v2]])
        trace, identity = -(a1v1 + a2v2), mpmath.eye(3)
        second = a1v1 * a2v2 - a1y + a2y
        first = matrix + trace * identity
        lowest = matrix * matrix + trace * matrix + second * identity
        size = lambda row, column, parts: sum(  # noqa: E731
            abs(part * each[row, column]) for part, each in zip(parts, (identity, first, lowest), strict=True)
        )
        basis = responses(matrix, h)
        exact = [
            sum(
                (part * each for part, each in zip(basis[n : n + 3], (identity, first, lowest), strict=True)),
                mpmath.zeros(3),
            )
            for n in range(3)
        ]
        worst = mpmath.mpf(0)
        places = [(0, i, j) for i in range(3) for j in range(3)]
        places += [(1, i, j) for i in range(3) for j in range(3)]
        places += [(2, 1, j) for j in range(3)]
        for (n, i, j), number in zip(places, numbers, strict=True):
            unit = size(i, j, basis[n : n + 3])
            error = abs(number - exact[n][i, j])
            worst = max(worst, error / (EPS * unit) if unit > 0 else error / EPS)
        poles = mpmath.polyroots([1, trace, second, -mpmath.det(matrix)], maxsteps=500, extraprec=200)
        real = [-mpmath.re(pole) for pole in poles if abs(mpmath.im(pole)) < mpmath.mpf(10) ** -DIGITS * abs(pole)]
        rate = min(real, key=lambda each: abs(each - (above[0] - a1v1)))
        for number, own in zip(above, (a1v1, a2v2), strict=True):
            apart = rate + own
            stiff = rate > 4 * mpmath.sqrt(-mpmath.det(matrix) / rate) and rate * h > 1
            worst = max(
                worst, abs(number - apart) / (EPS * (abs(apart) if stiff else rate + abs(own) + abs(second / trace)))
            )
        return float(worst)


def responses(matrix, h) -> list:
    """W'', W', W, W1, W2 at h, by the companion of P."""
    trace, det = -(matrix[1, 1] + matrix[2, 2]), mpmath.det(matrix)
    second = matrix[1, 1] * matrix[2, 2] - matrix[1, 0] + matrix[2, 0]
    chain = mpmath.zeros(5)  # of (W2, W1, W, W', W'')
    for n in range(4):
        chain[n, n + 1] = 1
    chain[4, 2], chain[4, 3], chain[4, 4] = det, -second, -trace
    response = mpmath.expm(chain * h)
    return [response[n, 4] for n in (4, 3, 2, 1, 0)]
