"""The integrals of (24) in closed form: the work of each force over a phase.

A coordinate of a phase is a sum of modes exp(s_m t), so the integral of a product of two is a sum over pairs of modes,
each (exp((s_m + s_n) t) - 1)/(s_m + s_n), t where s_m + s_n = 0. Written out so, it divides by the distances of the
poles. Here the pairs are summed before: with f = f(0) + F_3 W' + F_2 W + F_1 W1 of time_domain.py, and g alike,
integration by parts leaves of int f g states at the end and the integrals of three squares, W'^2, W^2, W1^2. With
P = (s + r)(s^2 + p s + q), r any real one of the rates of the poles, W obeys

    W'' + p W' + q W = e,   e = exp(-r t),        (W' + r W)'^2 + p (W' + r W)' (W' + r W) + q (W' + r W)^2 = exp(-p t)

(the latter is Abel's identity for the pair). The first times W, W', e and their integrals, integrated, gives the squares.
Below a line stand only q and the product r^2 + r p + q of the sums of r with the rates of the pair. The other two sums
of rates, r + r and p, are those that vanish where nothing damps; they have their limits in integrals of decays. Equal
poles are no exception.
"""

import sympy as sp

from ..ir import Quantity, Record, Step, Steps, function
from ..model.equations import Model
from ..model.quantities import *
from . import energy

SPLIT = Record(
    "SplitPoles", "P as (s + r)(s^2 + p s + q) with the rate r of a real pole: the slowest, unless a pair rings."
).of(
    Quantity("a_least", r"a_{\min}", "1/s", "rate of the slowest pole, if all are real, or else of the real one"),
    Quantity("p_others", r"p_{\min}", "1/s", "sum of the rates of the other two poles"),
    Quantity("q_others", r"q_{\min}", "1/s^2", "product of the rates of the other two poles"),
)
a_least, p_others, q_others = SPLIT.symbols
FADES = Record(
    "Fades", "exp(-r t) of a real pole, and integrals of decays: all that has a limit where a rate is 0."
).of(
    Quantity("least", r"e^{-a_{\min}t}", "1", "exp(-a_least t)"),
    Quantity("least1", r"\int e^{-a_{\min}t}", "s", "integral of exp(-a_least t)"),
    Quantity("least_squared", r"\int (\int e^{-a_{\min}t})^2", "s^3", "integral of the square of least1"),
    Quantity("others1", r"\int e^{-p_{\min}t}", "s", "integral of exp(-p_others t)"),
)
least, least1, least_squared, others1 = FADES.symbols
SQUARES = Record("Squares", "Integrals of the squares of W', W and W1.").of(
    Quantity("int_WdWd", r"\int \dot{W}^2", "s^3", "integral of the square of Wd"),
    Quantity("int_WW", r"\int W^2", "s^5", "integral of the square of W"),
    Quantity("int_W1W1", r"\int \left(\int W\right)^2", "s^7", "integral of the square of W1"),
)
int_WdWd, int_WW, int_W1W1 = SQUARES.symbols
BETWEEN = Record("Between", "Integrals of products with exp(-r t) and its integral, which the squares read.").of(
    Quantity("int_eW", r"\int e^{-a_{\min}t} W", "s^3", "integral of least W"),
    Quantity("int_eW1", r"\int e^{-a_{\min}t} \int W", "s^4", "integral of least W1"),
    Quantity("int_e1W1", r"\int \int e^{-a_{\min}t} \int W", "s^5", "integral of least1 W1"),
)  # fmt: skip
int_eW, int_eW1, int_e1W1 = BETWEEN.symbols
OF_PAIR = Record("OfPair", "What the squares of one mass on its spring read.").of(
    Quantity("pair1", r"\int e^{-pt}", "s", "integral of exp(-p t)"),
    Quantity("slow_squared", r"\int (\int e^{-rt})^2", "s^3", "integral of the square of slow1"),
    Quantity("int_eR", r"\int e^{-rt} R", "s^2", "integral of exp(-r t) R, r the slower one of two real poles"),
)
pair1, slow_squared, int_eR = OF_PAIR.symbols


@function(takes=(SPLIT, FADES, BASIS), returns=SQUARES)
def squares_of() -> Steps:
    """Integrals of W'^2, W^2 and W1^2 over a part of a phase."""
    r, pair_sum, pair_product = SPLIT.symbols
    mixed = r**2 + r * pair_sum + pair_product
    squared = least1 * (1 + least) / 2
    yield Step(
        int_WdWd,
        (
            others1
            - least * (Wd - r * W)
            - 2 * r * (Wd**2 + pair_product * W**2)
            + (r**2 - r * pair_sum + pair_product) * W * Wd
        )
        / (2 * mixed),
        "(24) squares of W'",
    )
    yield Step(int_eW, (squared - least * (Wd + (r + pair_sum) * W)) / mixed, "(24) the real pole with all")
    yield Step(int_WW, (int_eW + int_WdWd - W * Wd - pair_sum * W**2 / 2) / pair_product, "(24) squares of W")
    yield Step(int_eW1, (least1**2 / 2 - least * W - (r + pair_sum) * int_eW) / pair_product, "(24) by parts")
    yield Step(
        int_e1W1,
        (least_squared - least1 * W + int_eW - pair_sum * (least1 * W1 - int_eW1)) / pair_product,
        "(24) by parts",
    )
    yield Step(int_W1W1, (int_e1W1 - W * W1 + int_WW - pair_sum * W1**2 / 2) / pair_product, "(24) squares of W1")


def squares_of_pair(rate: sp.Expr, product: sp.Expr, summed: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """The integrals of R^2 and of R1^2 of s^2 + rate s + product, by that of exp(-rate t), and of R^2; for product > 0."""
    of_response = (summed - R * Rd - rate * R**2) / (2 * product)
    return of_response, (R2 - R * R1 + int_WdWd - rate * R1**2 / 2) / product


Numbers = tuple[sp.Expr, sp.Expr, sp.Expr, sp.Expr]
"""f(0), F_3, F_2, F_1 of f(t) = f(0) + F_3 W' + F_2 W + F_1 W1."""


def integral(first: Numbers, second: Numbers) -> sp.Expr:
    """The integral of the product of two functions of time."""
    (f, f3, f2, f1), (g, g3, g2, g1) = first, second
    terms = (
        (f * g, t), (f * g3 + g * f3, W), (f * g2 + g * f2, W1), (f * g1 + g * f1, W2),
        (f3 * g3, int_WdWd), (f3 * g2 + g3 * f2, W**2 / 2), (f3 * g1 + g3 * f1, W * W1 - int_WW),
        (f2 * g2, int_WW), (f2 * g1 + g2 * f1, W1**2 / 2), (f1 * g1, int_W1W1),
    )  # fmt: skip
    return sp.Add(*(coefficient * value for coefficient, value in terms))


ONE: Numbers = (sp.S.One, sp.S.Zero, sp.S.Zero, sp.S.Zero)
OF_1: Numbers = (v1, H3_1, H2_1, H1_1)
OF_2: Numbers = (v2, H3_2, H2_2, H1_2)
OF_Y: Numbers = (y, H3_y, H2_y, H1_y)
GAINED: Numbers = (sp.S.Zero, *OF_Y[1:])
"""y less its start."""
PRODUCTS = {
    int_v1: (ONE, OF_1), int_v2: (ONE, OF_2), int_v1v1: (OF_1, OF_1), int_v1v2: (OF_1, OF_2), int_v2v2: (OF_2, OF_2),
    int_yv1: (OF_Y, OF_1), int_yv2: (OF_Y, OF_2), int_xv2: (GAINED, OF_2),
}  # fmt: skip
"""What is multiplied in each integral that the ledger reads."""
BESIDE = {int_xv2: int_v2**2 / 2}
"""What an integral has beside that: x_1 - x_1(0) is y - y(0) + x_2 - x_2(0)."""
INTEGRALS = {symbol: integral(*product) + BESIDE.get(symbol, 0) for symbol, product in PRODUCTS.items()}
"""The integrals that the ledger reads, by the state at the start."""


@function(takes=(STATE, MOTION, BASIS, SQUARES, TIME), returns=MOMENTS)
def moments_of(model: Model) -> Steps:
    """The integrals that the ledger reads, over the first t of a phase."""
    read = [quantity.symbol for quantity in energy.moments_record(model).quantities]
    before = [int_v2] if int_xv2 in read and int_v2 not in read else []
    for symbol in (*before, *read):
        yield Step(symbol, INTEGRALS[symbol], "(24) in closed form")
