"""Routh's conditions: no motion of a mode grows, if and only if

    s^2 + p s + q                    p >= 0, q >= 0
    s^3 + s_1 s^2 + s_2 s + s_3      s_1, s_2, s_3 >= 0, s_1 s_2 >= s_3

once integrators are removed; without friction the coefficients are 0, which is legal. A condition that is a sum of
products of numbers that cannot be negative holds for every robot, in exact arithmetic and in rounded arithmetic alike,
and is not asked for. So the paper's hopper is never asked. Where neither velocity stands in the other mass's equation

    s_1 = p_1 + p_2      s_2 = q_1 + q_2 + p_1 p_2      s_3 = p_1 q_2 + p_2 q_1
    s_1 s_2 - s_3 = p_1 q_1 + p_2 q_2 + p_1 p_2 (p_1 + p_2)

and the conditions of one mass moving alone imply those of both.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import sympy as sp

from ..ir import unfold
from ..model.equations import Model
from ..model.quantities import *
from . import laplace

ALONE = {a1_v1: -p_1, a1_y: -q_1, a2_v2: -p_2, a2_y: q_2}
"""The rates of (3), (4) by the polynomials of one mass moving alone."""


@dataclass(frozen=True)
class Condition:
    """A coefficient, or a difference of products of them, that must not be negative."""

    name: str
    value: sp.Expr
    who: str


_BOTH = "both masses moving"
CONDITIONS = (
    *(Condition(str(each), each, "the actuator moving alone") for each in (p_1, q_1)),
    *(Condition(str(each), each, "the body moving alone") for each in (p_2, q_2)),
    *(Condition(str(each), each, _BOTH) for each in (s_1, s_2, s_3)),
    Condition("s_1 s_2 - s_3", s_1 * s_2 - s_3, _BOTH),
)


def denominator_under_law(model: Model) -> sp.Poly:
    """That of the one mass that moves under a law, within its limit."""
    rates = laplace.rates_under_law(model)
    return sp.Poly([1, *(model.value(unfold(symbol, rates)) for symbol in (p_1, q_1))], laplace.s)


def poles_of(denominator: sp.Poly, values: Mapping[str, float]) -> tuple[complex, ...]:
    """The roots [1/s] of the denominator of a mode with the numbers of a robot by name, each as often as it is one: real
    ones from the slowest on, then pairs. Factors without multiple roots are solved, which exact numbers have.
    """
    known = {symbol: sp.Rational(repr(values[symbol.name])) for symbol in denominator.free_symbols_in_domain}
    exact = sp.Poly([coefficient.xreplace(known) for coefficient in denominator.all_coeffs()], *denominator.gens)
    _, factors = exact.sqf_list()
    roots = [
        complex(root) for factor, times in factors for root in factor.nroots(n=15, maxsteps=200) for _ in range(times)
    ]
    return tuple(sorted(roots, key=lambda root: (root.imag != 0.0, -root.real, -root.imag)))


@lru_cache(maxsize=32)  # a solver asks for each of its modes
def open_conditions(model: Model) -> tuple[Condition, ...]:
    """The conditions that some robot of the model may violate though it obeys the others."""
    masses = (m_eff, m_s)
    in_own = {letter: value for letter, value in model.constants.items() if letter not in masses}
    nonnegative = {quantity.symbol for quantity in model.robot.quantities if quantity.interval.low >= 0.0} | {*masses}
    # letters that are never negative stand for their values first: multiplied out, these may be long
    letters = {each for each, value in in_own.items() if value != 0 and _cannot_be_negative(value, nonnegative)}
    in_letters = {letter: value for letter, value in in_own.items() if letter not in letters}
    left = _left_open(model, CONDITIONS, in_letters, nonnegative | letters)
    return _left_open(model, left, in_own, nonnegative)


def _left_open(
    model: Model, conditions: tuple[Condition, ...], values: Mapping[sp.Symbol, sp.Expr], nonnegative: set[sp.Symbol]
) -> tuple[Condition, ...]:
    """Those that are not sums of products of what is known to be positive or 0, with some letters by their values."""
    rates = tuple(replace(step, value=step.value.xreplace(values)) for step in laplace.rates_of(model))
    of_both = dict(zip((s_1, s_2, s_3), laplace.characteristic(laplace.matrix_of(model)), strict=True))
    of_one = ALONE | {a1_y: -q_1 / model.rate_of_gear} | {rate: unfold(rate, rates) for rate in (a1_v2, a2_v1)}
    return tuple(
        condition
        for condition in conditions
        if not _cannot_be_negative(unfold(condition.value, rates), nonnegative)
        and not _cannot_be_negative(
            condition.value.subs(of_both).subs(of_one),
            nonnegative | {p_1, q_1, p_2, q_2} - condition.value.free_symbols,
        )
    )


def _cannot_be_negative(value: sp.Expr, nonnegative: set[sp.Symbol]) -> bool:
    """Whether an expression is, term by term, a product of a positive number and of factors that are not negative."""
    factors = (factor for term in sp.Add.make_args(sp.expand(value)) for factor in sp.Mul.make_args(term))
    powers = ((factor, *factor.as_base_exp()) for factor in factors)
    return all(factor.is_nonnegative or base in nonnegative or exponent.is_even for factor, base, exponent in powers)
