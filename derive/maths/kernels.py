"""Kernels: what loops or branches so that no digits are lost near equal poles and near those at 0.

Coefficients of the power series of the engine's kernels, and the tables that it looks up, in each precision; and calls of
the kernels that a formula is printed with, which compute the same.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import sympy as sp
from sympy.integrals.quadrature import gauss_legendre

from ..model.precisions import F32, TERMS, Precision


@dataclass(frozen=True)
class Table:
    """Numbers in a row; of a series its coefficients, the highest first as Horner's rule takes them."""

    name: str
    values: tuple[float, ...]
    meaning: str


def series(precision: Precision) -> tuple[Table, ...]:
    """The power series of the kernels."""
    single = precision == F32
    half, whole = (_inverse_factorials(range(2, most)) for most in ((8, 11) if single else (14, 18)))
    area_tangent = tuple(1.0 / n for n in reversed(range(1, 11 if single else 23, 2)))
    return (
        Table("EXPONENTIAL", _inverse_factorials(range(1, 9 if single else 15)), "(exp(r) - 1)/r"),
        Table("DECAY_TAIL", _alternating(_inverse_factorials(range(3, 14 if single else 21))), "phi_3(-z)"),
        Table("SINE", _alternating(_inverse_factorials(range(1, 10 if single else 18, 2))), "sin(r)/r in r^2"),
        Table("COSINE", _alternating(_inverse_factorials(range(0, 10 if single else 18, 2))), "cos(r) in r^2"),
        Table("AREA_TANGENT", area_tangent, "artanh(s)/s in s^2"),
        Table("HALF_NODE_FIRST", half[:3], "phi_2 over half a node: its highest three"),
        Table("HALF_NODE", half[3:], "those below"),
        Table("NODE_FIRST", whole[:3], "phi_2 over a node: its highest three"),
        Table("NODE", whole[3:], "those below"),
        Table("STEP", _inverse_factorials(range(2, 4 if single else 6)), "phi_1 over a short step, but for the 1"),
    )


@cache
def tables(precision: Precision) -> tuple[Table, ...]:
    """Numbers that the engine looks up; those of Gauss's rule, the roots of the Legendre polynomial, have 40 digits
    before they are rounded.
    """
    roots, weights = gauss_legendre(nodes(precision), 40)
    terms = squares(precision) + 2
    inverses = tuple(1.0 / n for n in range(1, int(TERMS.of(precision)) + 8))
    return (
        Table("INVERSES", inverses, "1/n for n from 1 on"),
        Table("FACTORIALS", tuple(reversed(_inverse_factorials(range(5, 5 + terms)))), "1/n! for n from 5 on"),
        Table("GAUSS_PLACES", tuple(float((1 + root) / 2) for root in roots), "nodes of Gauss's rule over 0 .. 1"),
        Table("GAUSS_WEIGHTS", tuple(float(weight / 2) for weight in weights), "their weights"),
    )


def squares(precision: Precision) -> int:
    """Terms of the series of W * W, one more than a multiple of three: what is left out over four time constants of the
    fastest pole is beyond the digits.
    """
    return 25 if precision == F32 else 40


def nodes(precision: Precision) -> int:
    """Of Gauss's rule."""
    return 8 if precision == F32 else 12


def _inverse_factorials(degrees: Iterable[int]) -> tuple[float, ...]:
    """Coefficients 1/n! of a power series."""
    return tuple(1.0 / math.factorial(n) for n in reversed(list(degrees)))


def _alternating(coefficients: tuple[float, ...]) -> tuple[float, ...]:
    """The same with signs that alternate from the lowest, which is positive."""
    return tuple(coefficient * (-1) ** (len(coefficients) - 1 - n) for n, coefficient in enumerate(coefficients))


RESULTS = {
    "factor_cubic": ("a", "p", "q"), "decay_at": ("e", "e1", "e2", "e3"), "pair_at": ("Rd", "R", "R1", "R2", "R3"),
    "response_at": ("Wdd", "Wd", "W", "W1", "W2"), "overlap": (),
}  # fmt: skip
"""The kernels that printed formulas call, and the names of their results; one without has a number."""


def call(kernel: str, result: str, *arguments: sp.Expr) -> sp.Expr:
    """A result of a kernel that is printed with the formula that reads it."""
    return sp.Function(f"{kernel}.{result}")(*arguments)


def called(expression: sp.Expr) -> tuple[str, str]:
    """The kernel and the result of a call."""
    kernel, _, result = expression.func.__name__.partition(".")
    return kernel, result
