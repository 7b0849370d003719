"""Partial fractions of (11), in real arithmetic and safe where poles coincide.

The paper splits 1/(s^2 (s+a)(s+b)(s+c)) into single poles, which divides by every difference of
poles and twice by the slow one. Here the inverse transform of the three poles alone,

    W(t) = L^-1 1/((s + a)(s^2 + p s + q)),        W1 = int W,  W2 = int W1,

carries the motion (time_domain.py), and only the real pole is split from the pair,

    1/((s + a)(s^2 + p s + q)) = [1/(s + a) - (s + p - a)/(s^2 + p s + q)] / chi,   chi = a^2 - p a + q,

so that the only divisor is chi, which is large when a is the most isolated root. The integrals W1, W2
take the integrals of exp(-a t) and of R = L^-1 1/(s^2 + p s + q), not quotients by a or q. Where chi t^2 is
small, W comes from its power series, around s = 0 or around the mean of the three poles.
"""

import sympy as sp

from ..ir import Record, Step, Steps, function, scalar
from ..model.quantities import *
from .laplace import s

pair_denominator = s**2 + p * s + q
denominator = (s + a) * pair_denominator

PAIR_CORE = Record("PairCore", "R, its derivative and what is left of the initial 1.", (*PAIR.quantities[:2], TURNED))
PAIR_INTEGRALS = Record("PairIntegrals", "The integrals of R.", PAIR.quantities[2:])
KNOWN_PAIR = Record("KnownPair", "R, its derivative and its first integral.", PAIR.quantities[:3])
KNOWN_BASIS = Record("KnownBasis", "W, its derivatives and its first integral.", BASIS.quantities[:4])
SHIFTED = Record("Shifted", "Three nearly equal roots: their mean rate and s^3 + Q_s s + T_s around it.").of(
    SHIFT, scalar("Q_s", "1/s^2", "coefficient of s"), scalar("T_s", "1/s^3", "constant coefficient")
)
Q_s, T_s = SHIFTED.symbols[1:]
SHIFTED_SERIES = Record("ShiftedSeries", "V, the inverse transform of 1/(s^3 + Q_s s + T_s), and its derivatives.").of(
    scalar("Vdd", "1", "second derivative"),
    scalar("Vd", "s", "first derivative"),
    scalar("V", "s^2", "the function"),
    scalar("decay", "1", "exp(-sigma t)"),
)
Vdd, Vd, V, decay = SHIFTED_SERIES.symbols
RESPONSE = Record("Response", "W and its first two derivatives.", BASIS.quantities[:3])
INTEGRALS = Record("Integrals", "The two integrals of W.", BASIS.quantities[3:])


@function(takes=(POLES,), returns=CHI)
def residue() -> Steps:
    """Denominator of (18)."""
    yield Step(chi, q - a * (p - a), "(18) residue at s = -a")


@function(takes=(POLES, CHI, DECAY, PAIR), returns=BASIS)
def split() -> Steps:
    """W from exp(-a t) and R."""
    rest = p - a
    # d/dt e = -a e, d/dt Rd = -p Rd - q R; the derivative of R at 0 is 1, so W starts at 0, 0, 1.
    yield Step(W, (e - Rd - rest * R) / chi, "(18) all poles")
    yield Step(W1, (e1 - R - rest * R1) / chi, "(18) integral")
    yield Step(W2, (e2 - R1 - rest * R2) / chi, "(18) integral of the integral")
    yield Step(Wd, (a * (Rd - e) + q * R) / chi, "(19) all poles")
    yield Step(Wdd, (a**2 * e - (a * p - q) * Rd - a * q * R) / chi, "(19) derivative")


@function(takes=(POLES, CHI, DECAY, PAIR), returns=scalar("W", "s^2", "response of the three poles to an impulse"))
def split_soon() -> Steps:
    """W while exp(-a t) is near 1.

    After a full turn of the pair it is small, and this is no difference of ones.
    """
    yield Step(W, (q * R1 - a * (e1 - R)) / chi, "(18) all poles, a t not large")


@function(takes=(POLES, PAIR_CORE, TIME), returns=PAIR_INTEGRALS)
def pair_by_quotient() -> Steps:
    """Integrals of R where q t^2 is not small.

    R'' + p R' + q R = 0, integrated up to three times; turned = 1 - R' - p R.
    """
    yield Step(R1, turned / q, "(18) pair, integral")
    yield Step(R2, (t - R - p * R1) / q, "(18) pair, integral of the integral")
    yield Step(R3, (t**2 / 2 - R1 - p * R2) / q, "(18) pair, third integral")


@function(takes=(POLES, PAIR_SERIES, TIME), returns=KNOWN_PAIR)
def pair_from_series() -> Steps:
    """R, its derivative and first integral from its two highest integrals.

    The same equation, read the other way.
    """
    yield Step(R1, t**2 / 2 - p * R2 - q * R3, "(18) pair, short time")
    yield Step(R, t - p * R1 - q * R2, "(18) pair, short time")
    yield Step(Rd, 1 - p * R - q * R1, "(19) pair, short time")


@function(takes=(POLES, SERIES, TIME), returns=KNOWN_BASIS)
def all_from_series() -> Steps:
    """W, its derivatives and first integral from its three highest integrals.

    P(d/dt) W = 0, integrated.
    """
    yield Step(W1, t**3 / 6 - s_1 * W2 - s_2 * W3 - s_3 * W4, "(18) short time")
    yield Step(W, t**2 / 2 - s_1 * W1 - s_2 * W2 - s_3 * W3, "(18) short time")
    yield Step(Wd, t - s_1 * W - s_2 * W1 - s_3 * W2, "(19) short time")
    yield Step(Wdd, 1 - s_1 * Wd - s_2 * W - s_3 * W1, "(19) short time")


# The shifted polynomial P(s - sigma) = s^3 + Q s + T of three nearly equal roots, from the factors.
apart, disc = sp.symbols("apart disc", real=True)


@function(takes=(POLES,), returns=SHIFTED)
def shift() -> Steps:
    """Three nearly equal roots, seen from their mean.

    P(s - sigma) = s^3 + Q_s s + T_s has no square term.
    """
    yield Step(sigma, (a + p) / 3, "(11) mean of the poles")
    yield Step(apart, (2 * a - p) / 6, "(11) the pair's mean is sigma - apart, a is sigma + 2 apart")
    yield Step(disc, (p / 2) ** 2 - q, "(11) discriminant of the pair")
    yield Step(Q_s, -3 * apart**2 - disc, "(11) shifted by sigma")
    yield Step(T_s, 2 * apart * (apart**2 - disc), "(11) shifted by sigma")


@function(takes=(SHIFT, SHIFTED_SERIES), returns=RESPONSE)
def unshift() -> Steps:
    """W from the series around the mean root.

    W = exp(-sigma t) V.
    """
    yield Step(W, decay * V, "(18) nearly triple pole")
    yield Step(Wd, decay * (Vd - sigma * V), "(19) nearly triple pole")
    yield Step(Wdd, decay * (Vdd - 2 * sigma * Vd + sigma**2 * V), "(19) nearly triple pole")


@function(takes=(POLES, RESPONSE, TIME), returns=INTEGRALS)
def integrals_by_recursion() -> Steps:
    """The integrals of W where the poles are close together and none is slow.

    P(d/dt) W1 = 1, P(d/dt) W2 = t.
    """
    yield Step(W1, (1 - Wdd - s_1 * Wd - s_2 * W) / s_3, "(18) integral, poles close together")
    yield Step(W2, (t - Wd - s_1 * W - s_2 * W1) / s_3, "(18) integral of the integral, poles close together")


@function(takes=(POLES, NUMERATOR), returns=PAIR_NUMERATOR)
def deflated_numerator() -> Steps:
    """Deflated numerator: the factor s + a divided out.

    (d/dt + a) h' is a motion of the pair alone: (A s + B)/(s^2 + p s + q), whatever the poles.
    """
    yield Step(A, H2 - p * H3, "(18) terms in s, pole a removed")
    yield Step(B, H1 - q * H3, "(18) constant terms, pole a removed")
