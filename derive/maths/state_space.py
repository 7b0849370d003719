"""The algebra of a mode as z' = A z + B w: transfer functions in lowest terms.

(s - A)^-1 = (N_0 s^(n-1) + ... + N_(n-1))/(s^n + p_1 s^(n-1) + ... + p_n), by Faddeev and LeVerrier:

    N_0 = 1,    p_k = -tr(A N_(k-1))/k,    N_k = A N_(k-1) + p_k
"""

import sympy as sp


def transfer(
    matrix: sp.Matrix, column: sp.Matrix, row: sp.Matrix, direct: sp.Expr, variable: sp.Symbol
) -> tuple[sp.Poly, sp.Poly]:
    """Numerator and denominator of row (s - matrix)^-1 column + direct, without what they have in common.

    Entries that are numbers are rational: a pole that the output does not show cancels exactly.
    """
    size, adjugate = matrix.rows, sp.eye(matrix.rows)
    numerator, denominator = direct * variable**size, variable**size
    for n in range(1, size + 1):
        product = matrix * adjugate
        coefficient = -product.trace() / n
        numerator += variable ** (size - n) * ((row * adjugate * column)[0] + direct * coefficient)
        denominator += variable ** (size - n) * coefficient
        adjugate = product + coefficient * sp.eye(size)
    above, below = sp.fraction(sp.cancel(numerator / denominator))
    return sp.Poly(above, variable), sp.Poly(below, variable)


def in_powers(polynomial: sp.Poly) -> sp.Expr:
    """A polynomial with a factored coefficient of each power."""
    variable = polynomial.gen
    return sp.Add(*(sp.factor(coefficient) * variable**power for (power,), coefficient in polynomial.terms()))
