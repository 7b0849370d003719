"""The register's equations as algebra, where algebra can decide: as printed, and as they follow from (3), (4).

What follows is derived from (3), (4), never from what is printed. In the expressions

    x_i(0), v_i(0)     x1_0, v1_0, x2_0, v2_0, the initial values of the Laplace transform
    sign(v_i)          side_i, of both signs; the letters gamma, beta, lambda_2, H_n stand for (8)-(10), (12)-(15)
    (s+a)(s+b)(s+c)    the polynomial below (11), and (s+d)(s+e) the quadratic factor in (6)
    U of (22)-(24)     its time derivative, a power
"""

from functools import cache

import sympy as sp

from derive.maths import control, energy, laplace
from derive.maths.laplace import X1, X2, s, v1_0, v2_0, x1_0, x2_0
from derive.model.quantities import (
    L0,
    b1,
    b2,
    c,
    f1,
    f2,
    g,
    gamma2,
    height,
    k,
    m_eff,
    m_s,
    side_1,
    t,
    u,
    v1,
    v2,
    x1,
    x2,
)
from derive.paper.register import PAPER, cubic, quadratic_1, quadratic_2
from derive.shipped import HOPPER

# ---- symbols of what the paper names ----

beta, gamma, lambda_2, H_4, H_3, H_2, H_1 = sp.symbols("beta gamma lambda_2 H_4 H_3 H_2 H_1", real=True)
m_1, m_2, b_eff, u_star, v_td, x2_ground = sp.symbols("m_1 m_2 b_eff u_star v_td x2_ground", real=True)
E_delta, E_td, E_dist, h_des, x1_T, acc2 = sp.symbols("E_delta E_td E_dist h_des x1_T acc2", real=True)
pole_a, pole_b, pole_c, pole_d, pole_e = POLES = sp.symbols("a b c_pole d e_pole")
A, B, C, D, E = sp.symbols("A B C D E")
HATS = sp.symbols("A_hat B_hat C_hat D_hat E_hat F_hat G_hat")


@cache
def _transformed(number: int) -> sp.Expr:
    """The transform of (3) or (4), solved for X_1 or X_2 with the other one left in it."""
    return sp.solve(laplace.transforms(HOPPER)[number - 1], (X1, X2)[number - 1])[0]


def _numerator(number: int, monomial: sp.Expr) -> sp.Expr:
    """The coefficient of s or 1 in the numerator of the transformed (3) or (4), over s (s^2 + ...) as in (6), (7)."""
    other, quadratic = ((X2, quadratic_1), (X1, quadratic_2))[number - 1]
    return sp.Poly(sp.cancel(_transformed(number) * s * quadratic), s, other).coeff_monomial(monomial)


_numerators = laplace.paper_frame(HOPPER)

# What the letters stand for, as it follows from (3), (4).
LETTERS: dict[sp.Symbol, sp.Expr] = {
    gamma: sp.expand(-_numerator(2, sp.S.One)),
    beta: sp.expand(_numerator(2, s)),
    lambda_2: sp.expand(_numerator(1, sp.S.One)),
    **dict(zip((H_4, H_3, H_2, H_1), map(sp.expand, _numerators[1].all_coeffs()[1:]), strict=True)),
}
_transform_1, _transform_2 = (numerator.as_expr() / (s**2 * cubic) for numerator in _numerators)

_spring = sp.diff(HOPPER.lagrangian, x1)
start_1 = s**2 * x1_0 + s * (v1_0 + x1_0 * b1 / m_eff) + lambda_2
_numerator_11 = x2_0 * s**4 + H_4 * s**3 + H_3 * s**2 + H_2 * s + H_1
_decays = [sp.exp(-rate * t) for rate in POLES]
_printed_18 = A + B * t + sum(share * decay for share, decay in zip((C, D, E), _decays, strict=False))
_printed_20 = HATS[0] + HATS[1] * t + sum(share * decay for share, decay in zip(HATS[2:], _decays, strict=True))
_printed_17 = k / m_eff * _numerator_11 / (s**2 * cubic * quadratic_1)
_conservative = k * (-x2 + L0 + c) - m_s * g
_powers = energy.powers(HOPPER)
_delta_power = sum(_powers[entry] for entry in energy.body_entries(HOPPER))

EXPRESSIONS: dict[int, tuple[sp.Expr, ...]] = {
    1: (
        (k * (x2 - x1 - L0) - b1 * v1 - gamma2 * u) / m_eff,
        (_spring - b1 * v1 - gamma2 * u) / m_eff,
    ),
    2: (
        (k * (x1 - x2 + L0 + c) - b2 * v2 - m_s * g) / m_s,
        HOPPER.accelerations[1].subs(f2, 0),
    ),
    3: (
        PAPER["(3)"],
        (_spring - b1 * v1 - gamma2 * u) / m_eff - f1 * side_1,
    ),
    4: (
        PAPER["(4)"],
        HOPPER.accelerations[1],
    ),
    5: (
        u_star * gamma2 / m_eff,
        sp.Abs(k * (x2 - x1 - L0) - gamma2 * u_star) / m_eff,
    ),
    6: (
        (start_1 + s * X2 * k / m_eff) / (s * quadratic_1),
        _transformed(1),
    ),
    7: (
        (s**2 * x2_0 + s * beta - gamma + s * k / m_2 * X1) / (s * quadratic_2),
        _transformed(2),
    ),
    8: (
        -f2 / m_s + g - k * (L0 + c) / m_s,
        LETTERS[gamma],
    ),
    9: (
        v2_0 + x2_0 * b2 / m_s,
        LETTERS[beta],
    ),
    10: (
        -gamma2 * u / m_eff - k * L0 / m_eff - f1,
        LETTERS[lambda_2],
    ),
    11: (
        _numerator_11 / (s**2 * cubic),
        _transform_2,
    ),
    12: (
        x2_0 * b1 / m_eff + beta,
        LETTERS[H_4],
    ),
    13: (
        x2_0 * k / m_eff + b1 * beta / m_eff - gamma + k * x1_0 / m_s,
        LETTERS[H_3],
    ),
    14: (
        (v1_0 + x1_0 * b1 / b_eff) * k / m_s + k * beta / m_eff + b1 * gamma / m_1,
        LETTERS[H_2],
    ),
    15: (
        -gamma * k / m_eff - u * k * gamma2 / (m_s * m_eff) - (L0 * k / m_eff + f1) * k / m_s,
        LETTERS[H_1],
    ),
    16: (
        start_1 / (s * quadratic_1) + _printed_17,
        _transform_1,
    ),
    17: (_printed_17,),
    18: (_printed_18,),
    19: (
        B - pole_a * C * _decays[0] - pole_b * D * _decays[1] - pole_c * E * _decays[2],
        _printed_18.diff(t),
    ),
    20: (
        _printed_20,
        _printed_20.subs({HATS[5]: 0, HATS[6]: 0}),
    ),
    21: (
        HATS[1] - sum(rate * share * decay for rate, share, decay in zip(POLES, HATS[2:], _decays, strict=True)),
        _printed_20.diff(t).subs({HATS[5]: 0, HATS[6]: 0}),
    ),
    22: (
        m_s * acc2 * v2,
        energy.body_energy.diff(v2) * acc2 + energy.body_energy.diff(x2) * v2,
    ),
    23: (
        _conservative * acc2 + _delta_power,
        m_s * v2 * HOPPER.accelerations[1],
    ),
    24: (
        -f2 * v2 + b2 * v2**2 + k * x1 * v2,
        _delta_power,
    ),
    25: (
        m_s * v_td**2 / 2,
        m_s * control.touchdown_velocity(HOPPER)[0].value.subs(height, v_td**2 / (2 * g)) ** 2 / 2,
    ),
    26: (
        m_s * g * sp.Abs(x2_ground - x2) / 2,
        m_s * g * (x2_ground - x2),
    ),
    27: (
        sp.Abs(E_delta - (m_s * g * h_des - E_td - E_dist)),
        sp.Abs(E_delta + k * x1_0**2 / 2 - k * x1_T**2 / 2 + m_s * g * x1_0 - (m_s * g * h_des - E_td - E_dist)),
    ),
}
"""As printed, and as derived, by the number of the equation; of (18) alone there is no other form."""
