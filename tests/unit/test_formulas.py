"""The generated code against what it was generated from: units, formulas at 40 digits, and W for poles of every kind.

Errors are counted in eps = 2^-52. A formula may lose what its own sums cancel, so its bound is in eps times the sum of
the magnitudes of its terms, carried from step to step. W'', W', W and its integrals are compared with the power series
of their differential equation at 110 digits; the scale of each is the largest magnitude that the function has up to t.
"""

import inspect
import math
from collections.abc import Callable
from typing import NamedTuple

import mpmath
import numpy as np
import pytest
import sympy as sp

from derive.emit.expressions import Expressions
from derive.emit.program import program
from derive.ir import Function, Quantity, Record
from derive.maths import elements, time_domain
from derive.model import quantities as Q
from derive.shipped import HOPPER
from hopform_solver import formulas, records
from hopform_solver.kernels import basis_at, decay_at, factor_cubic
from hopform_solver.records import Poles
from tests import needs

EPS = 2.0**-52
PROGRAM = program()
FUNCTIONS = pytest.mark.parametrize("function", PROGRAM.functions, ids=lambda function: function.name)

# ---- numbers ----


@pytest.mark.parametrize(
    "text", ["0.18579428677743934", "0.10561184149994403", "1e-7", "3.2829212858959322", "0.1", "33554433"]
)
def test_a_number_of_a_model_file_is_the_nearest_one_of_either_precision(text):
    """A stop that is written as a number is met by a start that has the same number."""
    spelled = Expressions()(sp.Rational(text))
    assert eval(spelled) == float(text)  # noqa: S307
    above, *below = spelled.split("/")
    single = np.float32(above) / np.float32(below[0]) if below else np.float32(above)
    assert single == np.float32(text)


# ---- units balance ----

BASE = {
    "kg": (1, 0, 0, 0), "m": (0, 1, 0, 0), "s": (0, 0, 1, 0), "A": (0, 0, 0, 1), "N": (1, 1, -2, 0), "J": (1, 2, -2, 0),
    "1": (0, 0, 0, 0),
}  # fmt: skip
Unit = tuple[sp.Expr, ...]
NONE: Unit = (sp.S.Zero,) * 4

# A numerator is that of a function of any unit; H_3 is its rate. Here that unit is A, which nothing else brings.
GENERIC = {
    Q.H3: "A/s", Q.H2: "A/s^2", Q.H1: "A/s^3", Q.A: "A/s^2", Q.B: "A/s^3",
    Q.residual_0: "A", time_domain.residual: "A",
} | {
    symbol: each
    for record, units in (
    )
    for symbol, each in zip(record.symbols, units, strict=True)
}  # fmt: skip

# What a letter is, a model says; the hopper says it in parameters of the same names, and friction has a unit either way.
PARAMETERS = next(record.quantities for record in PROGRAM.records if record.name == Q.ROBOT.name)
LETTERS = {
    letter: next(q.unit for q in PARAMETERS if q.name == letter.name.removesuffix("_minus"))
    for letter in elements.letters_record(HOPPER).symbols
    if letter not in Q.OF_LAW
} | dict(zip(Q.OF_LAW, ("N/m", "N s/m"), strict=True))


def unit_of(text: str) -> Unit:
    """kg, m, s, A exponents of a unit such as "m/s^2/A" or "N s/m"."""
    total = NONE
    for number, group in enumerate(text.split("/")):
        for word in group.split():
            name, _, power = word.partition("^")
            exponent = int(power or 1) * (1 if number == 0 else -1)
            total = tuple(a + exponent * b for a, b in zip(total, BASE[name], strict=True))
    return total


def unit(expression: sp.Expr, known: dict[sp.Symbol, Unit]) -> Unit | None:
    """The unit of an expression, None for zero and for a limit that is infinite; a sum of unlike units is an error."""
    if expression.is_Number:
        return None if expression == 0 or expression.is_infinite else NONE
    if expression.is_Symbol:
        return known[expression]
    parts = [unit(part, known) or NONE for part in expression.args]
    if expression.is_Add:
        found = set(parts)
        assert len(found) == 1, f"{expression} adds {found}"
        return found.pop()
    if expression.is_Mul:
        return tuple(sum(column) for column in zip(*parts, strict=True))
    if expression.is_Pow:
        parts[0] = tuple(expression.exp * n for n in parts[0])
    return parts[0]  # of a power or a magnitude


def declared(things: tuple[Record | Quantity, ...], function: Function) -> dict[sp.Symbol, Unit]:
    of_free, of_way, of_pull = (
        {H: f"{unit}/s^{n + i}" for i, H in enumerate((Q.H3, Q.H2, Q.H1))} for unit, n in (("m", 3), ("m", 1), ("N", 1))
    )
    known = {"free_numerator_1": of_free, "free_numerator_2": of_free, "contact_numerator": of_way}
    known |= {"displacement_numerator": of_way, "pull_numerator": of_pull, "letters_of": LETTERS}
    units = {quantity.symbol: quantity.unit for thing in things for quantity in thing.quantities}
    return {symbol: unit_of(known.get(function.name, GENERIC).get(symbol, text)) for symbol, text in units.items()}


@FUNCTIONS
def test_units_balance_in_every_step(function):
    known, returned = declared(function.takes, function), declared((function.returns,), function)
    for step in function.steps:
        found = unit(sp.sympify(step.value), known)
        expected = returned.get(step.symbol)
        assert found is None or expected is None or found == expected, step
        known[step.symbol] = expected or found or NONE


def test_a_unit_is_read_as_it_is_written():
    assert unit_of("m/s^2/A") == (0, 1, -2, -1)
    assert unit_of("N s/m") == (1, 0, -1, 0)
    assert unit_of("1/s^3") == (0, 0, -3, 0)


def test_a_sum_of_unlike_units_is_seen():
    with pytest.raises(AssertionError):
        unit(Q.f2 - Q.f2 / Q.m_s, {Q.f2: unit_of("m/s^2"), Q.m_s: unit_of("kg")})


# ---- the generated formulas are the derived ones ----


class Sized(NamedTuple):
    """A value and the sum of the magnitudes of the terms that went into it."""

    value: mpmath.mpf
    size: mpmath.mpf


def sized(expression: sp.Expr, known: dict[sp.Symbol, Sized]) -> Sized:
    """Value and size at the working precision: sums add sizes, products multiply, powers keep the relative one."""
    if expression.is_Symbol:
        return known[expression]
    if expression.is_Number:
        number = mpmath.mpf(float(expression)) if expression.is_infinite else mpmath.mpf(expression.p) / expression.q
        return Sized(number, abs(number))
    parts = [sized(part, known) for part in expression.args]
    if expression.is_Add:
        return Sized(mpmath.fsum(p.value for p in parts), mpmath.fsum(p.size for p in parts))
    if expression.is_Mul:
        return Sized(mpmath.fprod(p.value for p in parts), mpmath.fprod(p.size for p in parts))
    if expression.is_Pow:
        exponent = mpmath.mpf(expression.exp.p) / expression.exp.q
        value = parts[0].value ** exponent
        relative = parts[0].size if exponent > 0 else parts[0].size / parts[0].value ** 2
        return Sized(value, relative ** abs(exponent))
    assert isinstance(expression, sp.Abs)
    return Sized(abs(parts[0].value), parts[0].size)


def random_argument(thing: Record | Quantity, rng: np.random.Generator) -> tuple[float, ...]:
    """Magnitudes over four decades, of both signs where the domain has both."""
    return tuple(
        float(
            10 ** rng.uniform(-2, 2)
            * (rng.choice([-1.0, 1.0]) if q.domain == "real" else 0.009 if q.domain == "fraction" else 1.0)
        )
        for q in thing.quantities
    )


@FUNCTIONS
def test_the_generated_formula_has_the_value_of_its_derivation_at_forty_digits(function):
    rng = np.random.default_rng(len(function.name))
    generated = getattr(formulas, function.name)
    for _ in range(20):
        numbers = [random_argument(thing, rng) for thing in function.takes]
        numbers = [tuple(map(abs, n)) if function.name == "touchdown_velocity" else n for n in numbers]
        arguments = [
            getattr(records, thing.in_python)(*n) if isinstance(thing, Record) else n[0]
            for thing, n in zip(function.takes, numbers, strict=True)
        ]
        got = generated(*arguments)
        got = got if isinstance(function.returns, Record) else (got,)
        with mpmath.workdps(40):
            known = {
                symbol: Sized(mpmath.mpf(number), abs(mpmath.mpf(number)))
                for thing, n in zip(function.takes, numbers, strict=True)
                for symbol, number in zip(thing.symbols, n, strict=True)
            }
            for step in function.steps:
                known[step.symbol] = sized(sp.sympify(step.value), known)
            for symbol, number in zip(function.returns.symbols, got, strict=True):
                exact = known[symbol]
                off = abs(exact.value - mpmath.mpf(float(number))) if exact.value != float(number) else 0
                assert off <= 16 * EPS * exact.size, symbol


def test_every_function_of_the_program_is_generated_and_no_other():
    public = {
        name
        for name, thing in inspect.getmembers(formulas, inspect.isfunction)
        if thing.__module__ == formulas.__name__
    }
    assert public == {function.name for function in PROGRAM.functions}


# ---- W, its derivatives and integrals, in every configuration of poles ----


class Reference(NamedTuple):
    """W'', W', W and its two integrals at 110 digits."""

    Wdd: mpmath.mpf
    Wd: mpmath.mpf
    W: mpmath.mpf
    W1: mpmath.mpf
    W2: mpmath.mpf


def power_series(a: float, p: float, q: float, t: float) -> Reference:
    """W'''  = -s_1 W'' - s_2 W' - s_3 W from W'' = 1: the coefficients obey the same recursion, times t^n/n!.

    Terms reach e^(s t), s t <= 50 here, so of 110 digits at least 80 are right.
    """
    with mpmath.workdps(110):
        a, p, q, t = map(mpmath.mpf, (a, p, q, t))
        h, hh, hhh = (a + p) * t, (q + a * p) * t**2, a * q * t**3
        term, once, twice, n = mpmath.mpf(1), mpmath.mpf(0), mpmath.mpf(0), 0
        sums = [mpmath.mpf(0)] * 5
        while n < 8 or max(abs(term), abs(once), abs(twice)) > mpmath.mpf(10) ** -90:
            part = term
            for order in range(5):
                sums[order] += part
                part /= n + order + 1
            # term_n = w_n t^n/n!, so that its predecessors carry 1/n, 1/(n (n-1)), 1/(n (n-1) (n-2))
            n += 1
            new = -(h * term + (hh * once + hhh * twice / max(n - 2, 1)) / max(n - 1, 1)) / n
            term, once, twice = new, term, once
        return Reference(*(value * t**order for order, value in enumerate(sums)))


def by_matrix_exponential(a: float, p: float, q: float, t: float) -> Reference:
    """The same from exp(M t) of the companion system of (W2, W1, W, W', W'')."""
    with mpmath.workdps(80):
        a, p, q = map(mpmath.mpf, (a, p, q))
        m = mpmath.zeros(5, 5)
        for row in range(4):
            m[row, row + 1] = 1
        m[4, 2], m[4, 3], m[4, 4] = -a * q, -(q + a * p), -(a + p)
        column = mpmath.expm(m * mpmath.mpf(t))[:, 4]
        return Reference(*(column[row] for row in (4, 3, 2, 1, 0)))


def spread(rng: np.random.Generator, low: float | np.ndarray, high: float, size: int | tuple[int, ...]) -> np.ndarray:
    """Numbers from 10^low to 10^high, spread evenly over their decades."""
    return 10.0 ** rng.uniform(low, high, size)


class Draw(NamedTuple):
    """Random rates, ratios, and relative distances of both signs down to one part in 10^16."""

    a: np.ndarray
    rate: np.ndarray
    slow: np.ndarray
    ratio: np.ndarray
    near: np.ndarray


def draw(rng: np.random.Generator, size: int) -> Draw:
    near = spread(rng, rng.choice([-16, -2], (2, size)), -0.3, (2, size)) * rng.choice([-1, 1], (2, size))
    a, rate = spread(rng, -2, 2, (2, size))
    return Draw(a, rate, spread(rng, -14, -3, size), rng.uniform(0.0, 2.0, size), near)


# Poles as (a, p, q).
CONFIGURATIONS: dict[str, Callable[[Draw], tuple[np.ndarray, np.ndarray, np.ndarray]]] = {
    "real": lambda d: (d.a, d.rate * (1 + d.ratio), d.rate**2 * d.ratio),
    "complex": lambda d: (d.a, 0.99 * d.ratio * d.rate, d.rate**2),
    "undamped": lambda d: (d.a, 0 * d.rate, d.rate**2),
    "double": lambda d: (d.a, 2 * d.rate, d.rate**2),
    "nearly double": lambda d: (d.a, 2 * d.rate, d.rate**2 * (1 + d.near[0])),
    "double with a": lambda d: (d.a, d.a + d.rate, d.a * d.rate),
    "triple": lambda d: (d.a, 2 * d.a, d.a**2),
    "nearly triple": lambda d: (d.a, 2 * d.a * (1 + d.near[0]), (d.a * (1 + d.near[0])) ** 2 * (1 + d.near[1])),
    "one slow": lambda d: (d.slow, 2 * d.ratio * d.rate, d.rate**2),
    "two slow": lambda d: (d.a, 2 * d.ratio * d.slow, d.slow**2),
    "one mass held": lambda d: (0 * d.a, 2 * d.ratio * d.rate, d.rate**2),
}
KINDS = list(CONFIGURATIONS)
CASES = needs.the_first([20, 150])
"""How many are drawn of a kind."""


def configurations(kind: str, seed: int, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return CONFIGURATIONS[kind](draw(np.random.default_rng(seed), size))


def factored(kind: str, a: np.ndarray, p: np.ndarray, q: np.ndarray) -> Poles:
    """As the solver gets them: from the coefficients of the cubic, a the most isolated root; a held mass has a = 0."""
    if kind == "one mass held":
        return Poles(a, p, q, p, q, a)
    return factor_cubic(a + p, q + a * p, a * q)


def arrays(record: tuple) -> np.ndarray:
    """The fields of a record of arrays as rows."""
    return np.array([np.asarray(field) for field in record])


def assert_accurate(
    poles: Poles,
    t: np.ndarray,
    reference: Callable[[float, float, float, float], Reference],
    bounds: tuple[float, ...],
    conditioned: np.ndarray | float = 0.0,
    got: np.ndarray | None = None,
) -> None:
    """Each of W'', W', W and the two integrals within its bound, in eps of its largest magnitude up to t."""
    got = arrays(basis_at(poles, t)) if got is None else got
    largest = np.max([np.abs(arrays(basis_at(poles, t * part))) for part in np.linspace(0.025, 1.0, 40)], axis=0)
    largest[0] = np.maximum(largest[0], 1.0)
    allowed = np.array(bounds)[:, np.newaxis] + np.broadcast_to(conditioned, t.shape)
    for lane, where in enumerate(zip(*arrays(poles)[:3].tolist(), t.tolist(), strict=True)):
        exact = reference(*where)
        for order, name in enumerate(exact._fields):
            error = abs(float(mpmath.mpf(float(got[order, lane])) - exact[order])) / (EPS * largest[order, lane])
            assert error <= allowed[order, lane], f"{name} at a, p, q, t = {where}: {error} eps"


@pytest.mark.parametrize("cases", CASES)
@pytest.mark.parametrize("kind", KINDS)
def test_w_is_exact_in_double_precision_for_any_poles_and_times(kind, cases):
    """Times reach from 1e-6 to 50 over the fastest rate. Worst of 11000 cases a kind: 81 eps, second integral 121 eps.

    There it is a difference of terms of size t^2/2: exp(-a t) and the pair have just been split, chi t^2 = 1.
    """
    poles = factored(kind, *configurations(kind, KINDS.index(kind), cases))
    fastest = poles.s_1 + np.sqrt(poles.s_2)
    rng = np.random.default_rng(1)
    t = spread(rng, rng.choice([-6, -1], cases), np.log10(50), cases) / fastest
    t[:2] = np.array([1e-6, 50]) / fastest[:2]
    assert_accurate(poles, t, power_series, (128.0, 128.0, 128.0, 128.0, 192.0))


@pytest.mark.parametrize("kind", KINDS)
def test_w_is_exact_over_fifty_time_constants_of_a_slow_pole(kind):
    """Up to 1e5 over the fastest rate: an angle or an exponent x is good for x eps, whatever computes it."""
    poles = factored(kind, *configurations(kind, 20 + KINDS.index(kind), 6))
    a, p, q, s_1, s_2, _ = arrays(poles)
    fastest = s_1 + np.sqrt(s_2)
    slow = np.where(a > 0.0, a, q / (p + np.sqrt(q)))
    t = 50.0 / np.maximum(slow, 5e-4 * fastest)
    assert_accurate(poles, t, by_matrix_exponential, (128.0, 128.0, 128.0, 128.0, 192.0), fastest * t)


@pytest.mark.parametrize("kind", KINDS)
def test_the_power_series_is_the_matrix_exponential(kind):
    a, p, q = (float(x[0]) for x in configurations(kind, 1, 1))
    t = 7.0 / (a + p + np.sqrt(q))
    for one, other in zip(power_series(a, p, q, t), by_matrix_exponential(a, p, q, t), strict=True):
        assert abs(one - other) <= mpmath.mpf(10) ** -40 * (abs(other) + mpmath.mpf(10) ** -30)


def test_w_is_smooth_where_the_regimes_meet():
    """No jump larger than the bound across chi t^2 = 1 and s_1 t = 4, from one float to the next."""
    for a, p, q in ((2.0, 5.0, 1.5), (1.0, 0.2, 40.0), (30.0, 61.0, 931.0), (1e-8, 3.0, 9.0)):
        poles = factor_cubic(*(np.array([x]) for x in (a + p, q + a * p, a * q)))
        chi = float(arrays((formulas.residue(poles),))[0, 0])
        for t in (chi**-0.5 if chi > 0 else 1.0, 4.0 / (a + p)):
            lanes = Poles(*np.repeat(arrays(poles), 3, axis=1))
            around = arrays(basis_at(lanes, np.array([t * (1 - EPS), t, t * (1 + 2 * EPS)])))
            for order, values in enumerate(around):
                assert np.ptp(values) <= 256 * EPS * t**order / math.factorial(order)


def test_decay_integrals_keep_their_digits_as_the_pole_goes_to_zero():
    """Relative errors of exp(-a t) and its integrals; a t itself is good for a t eps. Worst seen: 3 eps."""
    rng = np.random.default_rng(5)
    a, t = spread(rng, -18, 2, 300), spread(rng, -4, 0, 300)
    for lane, values in enumerate(arrays(decay_at(a, t)).T):
        with mpmath.workdps(120):
            a_l, t_l = mpmath.mpf(a[lane]), mpmath.mpf(t[lane])
            e = mpmath.exp(-a_l * t_l)
            e1 = (1 - e) / a_l
            e2 = (t_l - e1) / a_l
            e3 = (t_l**2 / 2 - e2) / a_l
            for value, truth in zip(values, (e, e1, e2, e3), strict=True):
                assert abs(mpmath.mpf(float(value)) / truth - 1) <= 8 * EPS * (1.0 + a[lane] * t[lane])


@pytest.mark.parametrize("kind", KINDS[:-1])
def test_the_factors_of_the_cubic_multiply_to_its_coefficients(kind):
    """Backward error, relative to each coefficient. Worst of 3000: 3.3 eps; 9.2 eps where three roots nearly meet."""
    a, p, q = configurations(kind, 3, 300)
    bound = 12 if kind == "nearly triple" else 4
    poles = factor_cubic(a + p, q + a * p, a * q)
    for lane, numbers in enumerate(arrays(poles).T):
        with mpmath.workdps(50):
            a_l, p_l, q_l, *coefficients = (mpmath.mpf(float(number)) for number in numbers)
            products = (a_l + p_l, q_l + a_l * p_l, a_l * q_l)
            for product, coefficient in zip(products, coefficients, strict=True):
                assert abs(product - coefficient) <= bound * EPS * coefficient, (a[lane], p[lane], q[lane])


def test_the_real_factor_is_the_most_isolated_root():
    """Then chi, the only divisor, is the product of its two distances, and both are as large as they can be."""
    rng = np.random.default_rng(4)
    rates = np.sort(np.stack([spread(rng, -1, 1, 200) for _ in range(3)]), axis=0)
    s_1, s_2, s_3 = rates.sum(axis=0), rates[0] * rates[1] + rates[2] * (rates[0] + rates[1]), rates.prod(axis=0)
    poles = factor_cubic(s_1, s_2, s_3)
    lonely = np.where(rates[2] - rates[1] > rates[1] - rates[0], rates[2], rates[0])
    clear = np.abs((rates[2] - rates[1]) / (rates[1] - rates[0]) - 1) > 1e-3
    assert np.allclose(arrays(poles)[0, clear], lonely[clear], rtol=1e-9, atol=0.0)
