"""The modal coordinates of both masses slipping: what derive has them to be, by algebra and in 40 digits.

P diag(-a, pair) P^-1 = M is proven for all poles, and every entry is held to 40 digits over random robots, over pairs
that hardly ring, where the rows are refused, and over stiff ones.
"""

import math
from collections.abc import Iterator
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

from derive.maths import laplace, modal
from derive.model.quantities import (
    a,
    a1_v1,
    a1_v2,
    a1_y,
    a2_v1,
    a2_v2,
    a2_y,
    chi,
    omega_p,
    p,
    p_1,
    p_2,
    q,
    q_1,
    q_2,
    y_v1,
)
from hopform_solver import formulas
from hopform_solver.records import Poles, Rates
from tests import needs

EPS = 2.0**-52
REFUSED = 0.0625
"""omega^2/q at which the C takes the form of W."""
DIGITS = 40

w = sp.Symbol("omega_p", positive=True)
TURN = sp.Matrix([[-a, 0, 0], [0, -p / 2, -w], [0, w, -p / 2]])


def rows_by_poles(fades_faster: int) -> dict[sp.Symbol, sp.Expr]:
    """Every entry in terms of a, p, omega and p_1, where the pole a is above p_1, or above p_2."""
    whole = w**2 + p**2 / 4
    second = a + p - p_1
    stiff = sp.solve([q_1 + q_2 + p_1 * second - whole - a * p, p_1 * q_2 + second * q_1 - a * whole], [q_1, q_2])
    known = {p_2: second, omega_p: w, chi: whole - a * (p - a), q: whole}
    sizes = {1: {modal.less_1: 1, modal.less_2: -1}, 2: {modal.less_1: -1, modal.less_2: 1}}[fades_faster]
    for step in modal.modal_rows_of():
        value = step.value.xreplace({sp.Abs(less): sign * less for less, sign in sizes.items()})
        known[step.symbol] = sp.cancel(sp.together(value.subs(known).subs(stiff).subs(known)))
    return known | stiff


@pytest.mark.parametrize("fades_faster", needs.sliced((1,), (2,)))
def test_rows_and_shares_diagonalise_the_equations_of_motion(fades_faster):
    known = rows_by_poles(fades_faster)
    rows, shares = matrices({step: known[step] for step in modal.MODAL_ROWS.symbols if step in known})
    matrix = laplace.MATRIX.subs({y_v1: 1, a1_v2: 0, a2_v1: 0, a1_v1: -p_1, a2_v2: -p_2, a1_y: -q_1, a2_y: q_2}).subs(
        known
    )
    assert (rows * shares - sp.eye(3)).applyfunc(sp.cancel).applyfunc(sp.simplify).is_zero_matrix
    assert (rows * TURN * shares - matrix).applyfunc(sp.cancel).applyfunc(sp.simplify).is_zero_matrix
    for n, row in enumerate(modal.ROWS):
        deflated = sp.Matrix([[known[modal.SYMBOLS[f"deflated_{of}_{row}"]] for of in ("cosine", "sine")]])
        pair = rows[n, 1:] * (TURN[1:, 1:] + a * sp.eye(2))
        assert (deflated - pair).applyfunc(sp.simplify).is_zero_matrix, "z'' + a z' has no share of the real pole"


def matrices(values: dict[sp.Symbol, Any]) -> tuple[Any, Any]:
    """P and its inverse."""
    rows = [[values[modal.SYMBOLS[f"rate_{of}_{row}"]] for of in modal.COORDINATES] for row in modal.ROWS]
    shares = [[values[modal.SYMBOLS[f"{of}_of_{row}"]] for row in modal.ROWS] for of in modal.COORDINATES]
    return sp.Matrix(rows), sp.Matrix(shares)


def exact_rows(robot: tuple[float, ...]) -> dict[str, Any] | None:
    """Every entry in 40 digits by the eigenvectors of M, for p_1, q_1, p_2, q_2; None where the pair does not ring, or
    hardly.
    """
    with mpmath.workdps(3 * DIGITS):
        first, stiff_1, second, stiff_2 = map(mpmath.mpf, robot)
        matrix = mpmath.matrix([[0, 1, -1], [-stiff_1, -first, 0], [stiff_2, 0, -second]])
        values, right = mpmath.eig(matrix)
        pairs = [n for n in range(3) if mpmath.im(values[n]) > mpmath.mpf(10) ** -DIGITS * abs(values[n])]
        if len(pairs) != 1:
            return None
        pair, real = pairs[0], min(range(3), key=lambda n: abs(mpmath.im(values[n])))
        rate, decay, omega = -mpmath.re(values[real]), -mpmath.re(values[pair]), mpmath.im(values[pair])
        if omega**2 < REFUSED * (omega**2 + decay**2):
            return None
        fast, ringing = right[:, real], right[:, pair] / right[0, pair]
        scale = mpmath.re(fast[1]) if rate <= second else mpmath.re(fast[2])  # the one of which nothing cancels is 1
        columns = [fast / scale, ringing.apply(mpmath.re), -ringing.apply(mpmath.im)]
        rows = mpmath.matrix([[mpmath.re(column[n]) for column in columns] for n in range(3)])
        shares = rows**-1
        found = {"a": rate, "p": 2 * decay, "q": omega**2 + decay**2, "omega": omega}
        for n, row in enumerate(modal.ROWS):
            found |= {f"rate_{of}_{row}": rows[n, m] for m, of in enumerate(modal.COORDINATES)}
            found |= {f"{of}_of_{row}": shares[m, n] for m, of in enumerate(modal.COORDINATES)}
        return found


def robots(kind: str) -> Iterator[tuple[float, ...]]:
    draw = np.random.default_rng(7)
    for _ in range(60):
        ratio, spring = 10.0 ** draw.uniform(-3, 3), 10.0 ** draw.uniform(0, 6)
        damping = draw.choice([0.0, 1.0], 2, p=[0.1, 0.9]) * 10.0 ** draw.uniform(-6, 0.3, 2)
        p1, p2 = 2.0 * damping * (math.sqrt(spring / ratio), math.sqrt(spring))
        if kind == "stiff":
            p1 = math.sqrt(spring) * 10.0 ** draw.uniform(2, 7)
        elif kind == "stiff body":
            p2 = math.sqrt(spring / ratio) * 10.0 ** draw.uniform(2, 7)
        elif kind == "equal dampings":
            p2 = p1 * (1.0 + draw.integers(-3, 4) * EPS)
        yield float(p1), float(spring / ratio), float(p2), float(spring)


@pytest.mark.parametrize("kind", ["random", "stiff", "stiff body", "equal dampings"])
def test_entries_keep_their_digits(kind):
    worst, asked = 0.0, 0
    for robot in robots(kind):
        exact = exact_rows(robot)
        if exact is None:
            continue
        asked += 1
        p1, q1, p2, q2 = robot
        rates = Rates(*(0.0,) * 17)._replace(p_1=p1, q_1=q1, p_2=p2, q_2=q2)
        poles = Poles(float(exact["a"]), float(exact["p"]), float(exact["q"]), 0.0, 0.0, 0.0)
        residue = float(exact["q"] - exact["a"] * (exact["p"] - exact["a"]))
        found = formulas.modal_rows_of(rates, poles, residue, float(exact["omega"]))._asdict()
        # A row times a share is a part of the motion of one coordinate by the rate of another; of the pair by its size.
        units = float(exact["q"]) / float(exact["omega"]) ** 2
        for row in modal.ROWS:
            for of in modal.ROWS:
                fade = exact[f"rate_fade_{row}"] * exact[f"fade_of_{of}"]
                worst = max(worst, off(found[f"rate_fade_{row}"] * found[f"fade_of_{of}"], fade, abs(fade) * units))
            ringing = mpmath.hypot(exact[f"rate_cosine_{row}"], exact[f"rate_sine_{row}"])
            for of in ("cosine", "sine"):
                worst = max(worst, off(found[f"rate_{of}_{row}"], exact[f"rate_{of}_{row}"], ringing * units))
            share = mpmath.hypot(exact[f"cosine_of_{row}"], exact[f"sine_of_{row}"])
            for of in ("cosine", "sine"):
                worst = max(worst, off(found[f"{of}_of_{row}"], exact[f"{of}_of_{row}"], share * units))
    assert asked >= 20 and worst <= 16.0, f"{kind}: {worst:.3g} eps of {asked} robots"


def off(value: float, exact: Any, unit: Any) -> float:
    """The error in eps of a unit; what 40 digits cannot tell from 0 has to be 0."""
    error = abs(mpmath.mpf(value) - exact)
    return 0.0 if error < mpmath.mpf(10) ** -DIGITS else float(error / (EPS * unit))
