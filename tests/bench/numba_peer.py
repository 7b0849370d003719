"""A peer in numba: Dormand-Prince 5(4) with its continuous extension,
crossings bracketed on it by bisection and secants.

Coefficients: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., II.4-II.6 (table 5.2, dense
output). Plain functions here; `compiled` loads this module and rules.py a second time and puts numba's functions in
place of theirs.
"""

import importlib.util
from collections.abc import Callable
from functools import cache
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from tests.bench.jobs import Jobs, answers
from tests.oracle import rules
from tests.oracle.rules import NONE, Point, event_functions, first_step, rates


def moved(z, h, c1, d1, c2, d2, c3, d3, c4, d4, c5, d5, c6, d6):
    """z + h (c1 d1 + ... + c6 d6)."""
    return Point(
        z.x1 + h * (c1 * d1.x1 + c2 * d2.x1 + c3 * d3.x1 + c4 * d4.x1 + c5 * d5.x1 + c6 * d6.x1),
        z.v1 + h * (c1 * d1.v1 + c2 * d2.v1 + c3 * d3.v1 + c4 * d4.v1 + c5 * d5.v1 + c6 * d6.v1),
        z.v2 + h * (c1 * d1.v2 + c2 * d2.v2 + c3 * d3.v2 + c4 * d4.v2 + c5 * d5.v2 + c6 * d6.v2),
        z.y + h * (c1 * d1.y + c2 * d2.y + c3 * d3.y + c4 * d4.y + c5 * d5.y + c6 * d6.y),
    )


def dense(z, new, h, k1, k7, k, s):
    """The continuous extension at the share s of the step; k is h times the fifth combination."""
    return Point(
        _dense(z.x1, new.x1, h * k1.x1, h * k7.x1, k.x1, s),
        _dense(z.v1, new.v1, h * k1.v1, h * k7.v1, k.v1, s),
        _dense(z.v2, new.v2, h * k1.v2, h * k7.v2, k.v2, s),
        _dense(z.y, new.y, h * k1.y, h * k7.y, k.y, s),
    )


def _dense(before, after, slope_before, slope_after, fifth, s):
    rise = after - before
    bend = slope_before - rise
    return before + s * (rise + (1.0 - s) * (bend + s * (rise - slope_after - bend + (1.0 - s) * fifth)))


def error_of(z, new, e, h, atol, rtol):
    """Root mean square of the scaled local error."""
    total = 0.0
    for before, after, rate in zip(z, new, e):  # noqa: B905 (numba knows no strict)
        total += (h * rate / (atol + rtol * max(abs(before), abs(after)))) ** 2
    return (total / 4.0) ** 0.5


def crossing(leg, side_1, side_2, z, new, h, k1, k7, k, number, g_low, g_high):
    """The share of the step at which an event function comes to zero, from the right; Illinois' rule."""
    low, high = 0.0, 1.0
    for _ in range(100):
        s = high - g_high * (high - low) / (g_high - g_low)
        if not low < s < high:
            s = 0.5 * (low + high)
        g = event_functions(leg, side_1, side_2, dense(z, new, h, k1, k7, k, s))[number]
        if g > 0.0:
            if high - s < 1e-15:
                break
            low, g_low, g_high = s, g, 0.5 * g_high
        else:
            if s - low < 1e-15 or g == 0.0:
                high = s
                break
            high, g_high, g_low = s, g, 0.5 * g_low
    return high


def search(leg, side_1, side_2, z, limit, rtol):
    """What rules.chain asks for."""
    atol = 0.01 * rtol
    h, t = min(first_step(leg, side_1, side_2, z), limit), 0.0
    k1 = rates(leg, side_1, side_2, z)
    before = event_functions(leg, side_1, side_2, z)
    while True:
        h = min(h, limit - t)
        o = k1
        z2 = moved(z, h, 1 / 5, k1, 0.0, o, 0.0, o, 0.0, o, 0.0, o, 0.0, o)
        k2 = rates(leg, side_1, side_2, z2)
        z3 = moved(z, h, 3 / 40, k1, 9 / 40, k2, 0.0, o, 0.0, o, 0.0, o, 0.0, o)
        k3 = rates(leg, side_1, side_2, z3)
        z4 = moved(z, h, 44 / 45, k1, -56 / 15, k2, 32 / 9, k3, 0.0, o, 0.0, o, 0.0, o)
        k4 = rates(leg, side_1, side_2, z4)
        z5 = moved(z, h, 19372 / 6561, k1, -25360 / 2187, k2, 64448 / 6561, k3, -212 / 729, k4, 0.0, o, 0.0, o)
        k5 = rates(leg, side_1, side_2, z5)
        z6 = moved(z, h, 9017 / 3168, k1, -355 / 33, k2, 46732 / 5247, k3, 49 / 176, k4, -5103 / 18656, k5, 0.0, o)
        k6 = rates(leg, side_1, side_2, z6)
        new = moved(z, h, 35 / 384, k1, 500 / 1113, k3, 125 / 192, k4, -2187 / 6784, k5, 11 / 84, k6, 0.0, o)
        k7 = rates(leg, side_1, side_2, new)
        nothing = Point(0.0, 0.0, 0.0, 0.0)
        e = moved(
            nothing, 1.0, 71 / 57600, k1, -71 / 16695, k3, 71 / 1920, k4, -17253 / 339200, k5, 22 / 525, k6, -1 / 40, k7
        )
        error = error_of(z, new, e, h, atol, rtol)
        if error > 1.0:
            h *= max(0.2, 0.9 * error**-0.2)
            continue
        after = event_functions(leg, side_1, side_2, new)
        which, first = NONE, 2.0
        fifth = moved(
            nothing, h, -12715105075 / 11282082432, k1, 87487479700 / 32700410799, k3, -10690763975 / 1880347072, k4,
            701980252875 / 199316789632, k5, -1453857185 / 822651844, k6, 69997945 / 29380423, k7,
        )  # fmt: skip
        for n in range(6):
            if before[n] > 0.0 and after[n] <= 0.0:
                s = crossing(leg, side_1, side_2, z, new, h, k1, k7, fifth, n, before[n], after[n])
                if s < first:
                    which, first = n, s
        if which != NONE:
            return t + first * h, which, dense(z, new, h, k1, k7, fifth, first)
        if t + h >= limit:
            return limit, NONE, new
        t, z, k1, before = t + h, new, k7, after
        h *= min(5.0, 0.9 * max(error, 1e-10) ** -0.2)


def run(table, tolerance, loops, found):
    """All jobs, so many times over."""
    for _ in range(loops):
        for n in range(table.shape[0]):
            rules_chain(tuple_of(table[n]), search, tolerance, found[n])


def tuple_of(row):
    """A row of the job table as a tuple."""
    return (
        row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9],
        row[10], row[11], row[12], row[13], row[14], row[15], row[16], row[17], row[18],
    )  # fmt: skip


rules_chain = rules.chain


def _second(module: ModuleType, njit: Callable[..., Any], **others: Any) -> ModuleType:
    """A module once more, its functions numba's; `others` take the place of what it imports."""
    assert module.__spec__ and module.__spec__.origin and module.__spec__.loader
    spec = importlib.util.spec_from_file_location(f"{module.__name__}_compiled", module.__spec__.origin)
    assert spec and spec.loader
    copy = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(copy)
    for name, value in list(vars(copy).items()):
        if isinstance(value, FunctionType) and value.__module__ == spec.name:
            setattr(copy, name, njit(value))
    for name, value in others.items():
        setattr(copy, name, value)
    return copy


@cache
def compiled() -> Callable[..., Any]:
    """`run`, compiled; ImportError without numba."""
    import sys

    from numba import njit

    fast = _second(rules, njit)
    names = ("Point", "first_step", "rates", "event_functions")
    here = _second(sys.modules[__name__], njit, rules_chain=fast.chain, **{name: getattr(fast, name) for name in names})
    return here.run


def function(jobs: Jobs, tolerance: float) -> Callable[[int], Any]:
    """A call that solves all jobs so many times over and returns the answers."""
    call, found = compiled(), answers(len(jobs))
    call(np.ascontiguousarray(jobs.table[:1]), tolerance, 1, found[:1])

    def once_more(loops: int) -> Any:
        call(jobs.table, tolerance, loops, found)
        return found

    return once_more
