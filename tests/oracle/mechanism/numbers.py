"""Exact numbers, the precision they are kept at, and formulas in text.

"0.05" -> 5/100,  "0x1.8p3" -> 12,  "1/3",  0.1 -> the float itself,  "m_s*v2**2/2" -> its value
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from mpmath.ctx_mp import MPContext  # pyright: ignore[reportMissingTypeStubs]

DIGITS = 60  # promised
GUARD = 30  # carried beyond them
mp: Any = MPContext()  # a context of its own: nobody else's precision is touched; mpmath has no types
mp.dps = DIGITS + GUARD
TINY = mp.mpf(10) ** (10 - DIGITS - GUARD + 10)  # what counts as zero, relative to the terms of a sum

Real = Any  # an mpf of `mp`; mpmath has no types of its own
Number = Any  # int, float, mpf or text
Vector = tuple[Any, ...]
Matrix = tuple[Vector, ...]

ARITHMETIC: Any = operator
OPERATIONS: dict[type[ast.operator], Any] = {
    ast.Add: ARITHMETIC.add,
    ast.Sub: ARITHMETIC.sub,
    ast.Mult: ARITHMETIC.mul,
    ast.Div: ARITHMETIC.truediv,
    ast.Pow: ARITHMETIC.pow,
}


def exact(value: Number) -> Real:
    """The number itself: a float is its binary value, text is a decimal, a fraction, a hex float or an infinity."""
    if not isinstance(value, str):
        return mp.mpf(value)
    if "/" in value:
        above, below = value.split("/")
        return exact(above) / exact(below)
    if "0x" in value.lower():
        return mp.mpf(float.fromhex(value))
    return mp.mpf(value)


def ulp(value: Real, digits: int = 53) -> Real:
    """The unit in the last place of a number with so many binary digits; 0 for 0 and infinities."""
    if not value or not mp.isfinite(value):
        return mp.zero
    return mp.ldexp(1, int(mp.frexp(abs(value))[1]) - digits)


FUNCTIONS: dict[str, Any] = {"sqrt": mp.sqrt, "max": max, "min": min, "abs": abs, "ulp": ulp}


def formula(text: Number, values: Mapping[str, Real]) -> Real:
    """The value of a formula in text, or of a number. Raises ValueError for an unknown name or operation."""
    if not isinstance(text, str):
        return exact(text)
    return evaluate(parsed(text), values, text)


@lru_cache(maxsize=4096)
def parsed(text: str) -> ast.expr:
    return ast.parse(text, mode="eval").body


def evaluate(node: ast.expr, values: Mapping[str, Real], text: str) -> Real:
    """The value of a parsed formula; decimals are read from the text, not through float."""
    if isinstance(node, ast.Constant):
        return mp.mpf(ast.get_source_segment(text, node))
    if isinstance(node, ast.Name):
        if node.id in values:
            return values[node.id]
        if node.id == "inf":
            return mp.inf
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
        value = evaluate(node.operand, values, text)
        return -value if isinstance(node.op, ast.USub) else value
    if isinstance(node, ast.BinOp) and type(node.op) in OPERATIONS:
        right = evaluate(node.right, values, text)
        if isinstance(node.op, ast.Pow):
            right = int(right)
        return OPERATIONS[type(node.op)](evaluate(node.left, values, text), right)
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS:
        return FUNCTIONS[node.func.id](*(evaluate(argument, values, text) for argument in node.args))
    raise ValueError(f"cannot read {text!r}; known names are {sorted(values)}")


def total(*terms: Real) -> Real:
    """A sum that is exactly zero if its terms cancel to within rounding."""
    if len(terms) == 1:
        return terms[0]
    result = mp.fsum(terms)
    return mp.zero if abs(result) <= TINY * mp.fsum(terms, absolute=True) else result


def dot(a: Vector, b: Vector) -> Real:
    """a . b, exactly zero if its terms cancel to within rounding."""
    terms = [p * q for p, q in zip(a, b, strict=True) if p and q]
    return total(*terms) if terms else mp.zero


def magnitude(a: Vector, b: Vector) -> Real:
    """|a| . |b|: how large the terms of the dot product are."""
    return mp.fsum([p * q for p, q in zip(a, b, strict=True) if p and q], absolute=True)


def times(a: Matrix, b: Matrix) -> Matrix:
    """The product of two matrices."""
    columns = tuple(zip(*b, strict=True))
    return tuple(tuple(dot(row, column) for column in columns) for row in a)


def apply(a: Matrix, x: Vector) -> Vector:
    return tuple(dot(row, x) for row in a)


def transpose(a: Matrix) -> Matrix:
    return tuple(zip(*a, strict=True))


def plus(*matrices: Matrix) -> Matrix:
    return tuple(tuple(total(*entries) for entries in zip(*rows, strict=True)) for rows in zip(*matrices, strict=True))


def outer(a: Vector, b: Vector, factor: int = 1) -> Matrix:
    return tuple(tuple(factor * p * q for q in b) for p in a)


def inverse(a: Matrix) -> Matrix:
    """The inverse by elimination with pivots. Raises ZeroDivisionError for a singular matrix."""
    size = len(a)
    rows = [[*row, *(mp.mpf(int(i == j)) for j in range(size))] for i, row in enumerate(a)]
    largest = max((abs(q) for row in a for q in row), default=mp.one)
    for i in range(size):
        pivot = max(range(i, size), key=lambda r: abs(rows[r][i]))
        if abs(rows[pivot][i]) <= TINY * largest:
            raise ZeroDivisionError("singular matrix")
        rows[i], rows[pivot] = rows[pivot], rows[i]
        rows[i] = [q / rows[i][i] for q in rows[i]]
        for r in range(size):
            if r != i and rows[r][i]:
                rows[r] = [total(p, -rows[r][i] * q) for p, q in zip(rows[r], rows[i], strict=True)]
    return tuple(tuple(row[size:]) for row in rows)


def null_space(directions: Matrix, size: int) -> Matrix:
    """Z with C Z = 0, a column per free coordinate. Raises ZeroDivisionError for dependent directions."""
    rows, pivots = [list(c) for c in directions], list[int]()
    for i in range(len(rows)):
        column = max((j for j in range(size) if j not in pivots), key=lambda j: abs(rows[i][j]), default=-1)
        if column < 0 or not rows[i][column]:
            raise ZeroDivisionError("directions that are held together depend on each other")
        pivots.append(column)
        rows[i] = [q / rows[i][column] for q in rows[i]]
        for r in range(len(rows)):
            if r != i:
                rows[r] = [total(p, -rows[r][column] * q) for p, q in zip(rows[r], rows[i], strict=True)]
    free = [j for j in range(size) if j not in pivots]
    columns: list[list[Real]] = [[mp.mpf(int(i == j)) for i in range(size)] for j in free]
    for entries, j in zip(columns, free, strict=True):
        for i, pivot in enumerate(pivots):
            entries[pivot] = -rows[i][j]
    return tuple(tuple(column[i] for column in columns) for i in range(size))


def free_rows(Z: Matrix) -> tuple[int, ...]:
    """The coordinate that is each entry of w in v = Z w."""
    count = len(Z[0])
    return tuple(Z.index(tuple(mp.mpf(int(i == j)) for j in range(count))) for i in range(count))


def independent(directions: Matrix, size: int) -> bool:
    """Whether directions can be held together."""
    try:
        null_space(directions, size)
    except ZeroDivisionError:
        return False
    return True
