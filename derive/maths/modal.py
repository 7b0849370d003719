r"""Both masses slipping in modal coordinates: (18)-(21) as rows times (f, c, s), where the pair of poles rings.

With z = (y, v_1, v_2), z' = M z + d within a phase, so z' obeys z'' = M z'. Of z', not of z - z_eq, are the coordinates
taken,

    z'(t) = P m(t),   m = (f, c, s),   f' = -a f,   c' = -p/2 c - omega s,   s' = omega c - p/2 s,

because then nothing has to be known of the equilibrium, which is at infinity where both masses drift (a = 0), and an
acceleration that is known is a coordinate that is known. Between two times

    z gains P int m dt
    d = z'' + a z' = D (c, s),   D = P_cs (G + a),   G the matrix of (c, s)' = G (c, s)

d being the deflated derivative of the certificate: a motion of the pair alone. All are closed forms of the poles, residues of
(s - M)^-1 z'(0) as partial_fractions.py has them of a function. Where neither velocity stands in the other mass's
equation, with alpha_i = p_i - a, (11) at s = -a is

    a alpha_1 alpha_2 = q_1 alpha_2 + q_2 alpha_1

so alpha_1 and alpha_2 have opposite signs, and of each of the two there is a form that subtracts nothing: by
n_i = max(-alpha_i, 0), of which one is 0 at least. y is 1 in the pair's column, c being what rings in y'.
"""

from dataclasses import replace

import sympy as sp

from ..ir import Record, Step, Steps, function, scalar
from ..model.equations import Model
from ..model.quantities import *
from ..model.structs import MODAL_ROW_MEMBERS, MODAL_SHARE_MEMBERS
from .contact import is_compression
from .modes import is_coupled

COORDINATES = ("fade", "cosine", "sine")
"""What fades with the real pole, and what turns with the pair."""
ROWS = ("y", "1", "2")
"""Of the compression and of the velocities, in order of tie-break priority."""

PER_SECOND = {"s": "1", "1": "1/s", "1/s": "1/s^2"}
"""A unit over s: c and s are velocities as y' is, f is an acceleration."""
MODAL_ROWS = Record("ModalRows", "Rows of y, v_1, v_2, then shares in f, c, s.").of(
    *(
        replace(each, name=f"{each.name}_{row}", unit=each.unit if row == "y" else PER_SECOND[each.unit])
        for row in ROWS
        for each in MODAL_ROW_MEMBERS
    ),
    *(
        replace(each, name=f"{name}_{each.name}", unit=PER_SECOND[each.unit] if name == "fade" else each.unit)
        for name in COORDINATES
        for each in MODAL_SHARE_MEMBERS
    ),
)
SYMBOLS = dict(zip((each.name for each in MODAL_ROWS.quantities), MODAL_ROWS.symbols, strict=True))

mu, n_1, n_2, less_1, less_2, alpha_1, alpha_2, from_1, from_2, square_1, square_2, above = sp.symbols(
    "mean n_1 n_2 less_1 less_2 alpha_1 alpha_2 from_1 from_2 square_1 square_2 above", real=True
)


def may_be_modal(model: Model) -> bool:
    """Whether both masses move, neither velocity in the other's equation, without a gear between them, and the contact
    force is that of the spring.
    """
    alone = len(model.moving) == 2 and not is_coupled(model) and not model.is_geared
    return alone and (is_compression(model) or not model.has_contact)


def _pair_rows(row: str) -> Steps:
    """What follows from the pair's part of a rate: its deflated derivative, its amplitude."""
    c, s_ = SYMBOLS[f"rate_cosine_{row}"], SYMBOLS[f"rate_sine_{row}"]
    yield Step(SYMBOLS[f"deflated_cosine_{row}"], above * c + omega_p * s_, "(19) pole a removed")
    yield Step(SYMBOLS[f"deflated_sine_{row}"], above * s_ - omega_p * c, "(19) pole a removed")
    yield Step(SYMBOLS[f"amplitude_{row}"], sp.sqrt(c**2 + s_**2), "(19) pair, at most")


def _polished(
    name: sp.Symbol, rounded: sp.Expr, rate: sp.Symbol, other: sp.Symbol, k: sp.Symbol, k_other: sp.Symbol
) -> Steps:
    """How far the real pole is above p_i, with digits of its own: by one step of Newton's on the cubic."""
    near, beside = sp.symbols(f"near_{name} beside_{name}", real=True)
    yield Step(near, rounded, "(11) at s = -a")
    yield Step(beside, other - rate - near, "(11) at s = -a")
    residual = k_other * near - k * beside - (rate + near) * beside * near
    yield Step(name, near - residual / chi, "(11) at s = -a, polished")


@function(takes=(RATES, POLES, CHI, OMEGA), returns=MODAL_ROWS)
def modal_rows_of() -> Steps:
    """Both masses slipping, neither velocity in the other's equation, a pair that rings: their modal coordinates."""
    symbols = SYMBOLS
    yield Step(mu, p / 2, "(11) decay of the pair")
    yield Step(above, a - mu, "(11) the real pole beyond that")
    yield from _polished(less_1, a - p_1, p_1, p_2, q_1, q_2)
    yield from _polished(less_2, a - p_2, p_2, p_1, q_2, q_1)
    yield Step(n_1, (sp.Abs(less_1) + less_1) / 2, "where mass 1 alone fades slower")
    yield Step(n_2, (sp.Abs(less_2) + less_2) / 2, "where mass 2 alone fades slower")
    yield Step(symbols["rate_fade_1"], 1 + a * n_2 / q_2, "(21) residue at s = -a")
    yield Step(symbols["rate_fade_2"], 1 + a * n_1 / q_1, "(19) residue at s = -a")
    yield Step(symbols["rate_fade_y"], n_1 / q_1 - n_2 / q_2, "(18) of y, residue at s = -a")
    yield Step(alpha_1, n_2 * q_1 / (q_2 * symbols["rate_fade_1"]) - n_1, "p_1 - a")
    yield Step(alpha_2, n_1 * q_2 / (q_1 * symbols["rate_fade_2"]) - n_2, "p_2 - a")
    yield Step(from_1, p_1 - mu, "(11) of mass 1, at the pair")
    yield Step(from_2, p_2 - mu, "(11) of mass 2, at the pair")
    yield Step(square_1, from_1**2 + omega_p**2, "(11) of mass 1, at the pair")
    yield Step(square_2, from_2**2 + omega_p**2, "(11) of mass 2, at the pair")
    yield Step(symbols["rate_cosine_y"], sp.S.One, "(18) of y, pair")
    yield Step(symbols["rate_sine_y"], sp.S.Zero, "(18) of y, pair")
    yield Step(symbols["rate_cosine_1"], -q_1 * from_1 / square_1, "(21) pair")
    yield Step(symbols["rate_sine_1"], -q_1 * omega_p / square_1, "(21) pair")
    yield Step(symbols["rate_cosine_2"], q_2 * from_2 / square_2, "(19) pair")
    yield Step(symbols["rate_sine_2"], q_2 * omega_p / square_2, "(19) pair")
    for row in ROWS:
        yield from _pair_rows(row)
    slow_1, slow_2, slow_y = (symbols[f"rate_fade_{row}"] for row in ("1", "2", "y"))
    yield Step(symbols["fade_of_y"], -q_1 * q_2 * slow_y / (chi * slow_1 * slow_2), "(18) residue at s = -a")
    yield Step(symbols["fade_of_1"], q_2 / (chi * slow_2), "(18) residue at s = -a")
    yield Step(symbols["fade_of_2"], q_1 / (chi * slow_1), "(18) residue at s = -a")
    sum_, product = from_1 + from_2, from_1 * from_2 - omega_p**2
    yield Step(symbols["cosine_of_y"], (above * sum_ - product) / chi, "(18) pair")
    yield Step(symbols["cosine_of_1"], -alpha_2 / chi, "(18) pair")
    yield Step(symbols["cosine_of_2"], alpha_1 / chi, "(18) pair")
    yield Step(symbols["sine_of_y"], -(above * product / omega_p + omega_p * sum_) / chi, "(18) pair")
    yield Step(symbols["sine_of_1"], -(above * from_2 / omega_p + omega_p) / chi, "(18) pair")
    yield Step(symbols["sine_of_2"], (above * from_1 / omega_p + omega_p) / chi, "(18) pair")


SETTLED = Record("Equilibrium", "Where both masses end while they slip: at one velocity.").of(
    scalar("y_end", "m", "compression"), scalar("v_end", "m/s", "velocity of both")
)


@function(takes=(RATES, DRIVE), returns=SETTLED)
def settled_of_both() -> Steps:
    """The equilibrium of both masses slipping, neither velocity in the other's equation; s_3 > 0."""
    y_end, v_end = SETTLED.symbols
    yield Step(y_end, (C_1 * p_2 - C_2 * p_1) / s_3, "(18) of y, terms in 1/s")
    yield Step(v_end, (C_1 * q_2 + C_2 * q_1) / s_3, "(19), (21) terms in 1/s")
