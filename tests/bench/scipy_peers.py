"""Peers on scipy: `solve_ivp` with events, and the matrix exponential with bracketing."""

import numpy as np

from tests.bench.jobs import Jobs, answers
from tests.oracle import integrator, rules
from tests.oracle.rules import NONE, Leg, Point


def _solve_all(jobs: Jobs, search, tolerance: float):
    found = answers(len(jobs))
    for job, row in zip(jobs.table.tolist(), found, strict=True):
        rules.chain(tuple(job), search, tolerance, row)
    return found


# ---- solve_ivp ----


def solve_ivp(jobs: Jobs, method: str, tolerance: float):
    """All stances by one method of scipy's solve_ivp, restarted at every switch; events on its dense output."""

    def search(leg, side_1, side_2, z, limit, rtol):
        took, which, after, _ = integrator.end_of_mode(
            leg, side_1, side_2, z, limit, method=method, rtol=rtol, atol=0.01 * rtol
        )
        return took, which, after

    return _solve_all(jobs, search, tolerance)


# ---- expm and brentq ----


def _matrix(leg: Leg, side_1: float, side_2: float):
    """The 5x5 matrix whose exponential moves (x1, v1, v2, y, 1)."""
    columns = [rules.next_rates(leg, side_1, side_2, Point(*unit)) for unit in np.eye(4).tolist()]
    columns.append(rules.rates(leg, side_1, side_2, Point(0.0, 0.0, 0.0, 0.0)))
    matrix = np.zeros((5, 5))
    matrix[:4] = np.transpose(columns)
    return matrix


SAMPLES = {1e-6: 8, 1e-8: 16, 1e-10: 32}
"""Samples per radian of the fastest motion: a denser scan is what a tighter tolerance means here."""


def expm(jobs: Jobs, tolerance: float):
    """All stances by scan and bracket: exact states on a grid from one matrix exponential, then brentq on exact states.

    The first steps double from the first safe one to the grid's, by powers of one exponential.
    """
    from scipy.linalg import expm as exponential
    from scipy.optimize import brentq

    def search(leg, side_1, side_2, z, limit, rtol):
        matrix = _matrix(leg, side_1, side_2)
        widest = min(1.0 / (SAMPLES[rtol] * leg.rate), limit)
        doublings = max(0, int(np.ceil(np.log2(widest / rules.first_step(leg, side_1, side_2, z)))))
        h = widest / 2.0**doublings
        step = exponential(matrix * h)
        here, t = np.array([*z, 1.0]), 0.0
        values = rules.event_functions(leg, side_1, side_2, z)
        while t < limit:
            after = step @ here
            new = rules.event_functions(leg, side_1, side_2, Point(*after[:4].tolist()))
            crossed = [n for n in range(6) if values[n] > 0.0 >= new[n] or (values[n] == 0.0 > new[n])]
            if crossed:
                # Never beyond the end of the step: a zero at its start has been passed upwards already.
                def value(s, number, base=here):
                    moved = exponential(matrix * s) @ base
                    return rules.event_functions(leg, side_1, side_2, Point(*moved[:4].tolist()))[number]

                roots = [
                    (brentq(value, 0.0, h, (n,), xtol=max(1e-16, 1e-4 * rtol * h), rtol=1e-15), n)
                    if values[n] > 0.0 > new[n]
                    else (h if values[n] > 0.0 else 0.0, n)
                    for n in crossed
                ]
                took, number = min(roots)
                if t + took < limit:
                    state = exponential(matrix * took) @ here
                    return t + took, number, Point(*state[:4].tolist())
            here, t, values = after, t + h, new
            if h < widest:
                step, h = step @ step, 2.0 * h
        state = exponential(matrix * limit) @ np.array([*z, 1.0])
        return limit, NONE, Point(*state[:4].tolist())

    return _solve_all(jobs, search, tolerance)
