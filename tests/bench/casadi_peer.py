"""CasADi's interface to CVODES as a peer: one integrator for all modes,
whose equation is linear with its matrix as parameters.

It has no events of its own, so each phase is followed in windows on a grid, and what crossed in a cell of the grid is
bracketed by an integrator over a part of that cell.
"""

from functools import cache
from typing import Any

import numpy as np

from tests.bench.jobs import Jobs, answers
from tests.bench.scipy_peers import SAMPLES, _matrix
from tests.oracle import rules
from tests.oracle.rules import NONE, Point

CELLS = 32
"""Cells of the grid in a window."""


@cache
def _integrators(tolerance: float) -> tuple[Any, Any]:
    """Over a window with its grid, and over one stretch: dz/ds = h M (z, 1), s from 0 to 1."""
    import casadi

    z, matrix, h = casadi.SX.sym("z", 4), casadi.SX.sym("M", 4, 5), casadi.SX.sym("h")
    ode = {"x": z, "p": casadi.vertcat(casadi.vec(matrix), h), "ode": h * casadi.mtimes(matrix, casadi.vertcat(z, 1.0))}
    how = {"reltol": tolerance, "abstol": 0.01 * tolerance, "linear_multistep_method": "adams"}
    grid = [(n + 1) / CELLS for n in range(CELLS)]
    name = f"{-np.log10(tolerance):.0f}"
    return (
        casadi.integrator(f"window_{name}", "cvodes", ode, 0.0, grid, how),
        casadi.integrator(f"stretch_{name}", "cvodes", ode, 0.0, 1.0, how),
    )


def solve(jobs: Jobs, tolerance: float):
    """All stances, restarted at every switch; ImportError without casadi."""
    from scipy.optimize import brentq

    window, stretch = _integrators(tolerance)

    def search(leg, side_1, side_2, z, limit, rtol):
        matrix = _matrix(leg, side_1, side_2)[:4]
        flat = matrix.T.reshape(-1)
        widest = 1.0 / (SAMPLES[rtol] * leg.rate)
        cell = min(widest, rules.first_step(leg, side_1, side_2, z))
        here, t, values = z, 0.0, rules.event_functions(leg, side_1, side_2, z)

        def point(column):
            """A state in which what is held stays, which the integrator knows to rounding only."""
            x1, v1, v2, y = column.tolist()
            return Point(x1 if side_1 else z.x1, v1 if side_1 else 0.0, v2 if side_2 else 0.0, y)

        def moved(s, start):
            end = stretch(x0=start, p=np.append(flat, s))["xf"] if s > 0.0 else start
            return point(np.asarray(end, float).reshape(-1))

        while True:
            cells = CELLS if t > 0.0 else 1
            reached = (
                np.asarray(window(x0=here, p=np.append(flat, cell * CELLS))["xf"])
                if cells > 1
                else np.asarray(moved(cell, here))[:, np.newaxis]
            )
            for n in range(cells):
                after = point(reached[:, n])
                new = rules.event_functions(leg, side_1, side_2, after)
                crossed = [g for g in range(6) if values[g] > 0.0 >= new[g] or (values[g] == 0.0 > new[g])]
                if crossed:

                    def value(s, g, at=here):
                        return rules.event_functions(leg, side_1, side_2, moved(s, at))[g]

                    roots = [
                        (brentq(value, 0.0, cell, (g,), xtol=1e-4 * rtol * cell, rtol=1e-14), g)
                        if values[g] > 0.0 > new[g] and value(cell, g) < 0.0
                        else (cell if values[g] > 0.0 else 0.0, g)
                        for g in crossed
                    ]  # fmt: skip
                    took, which = min(roots)
                    if t + took < limit:
                        return t + took, which, moved(took, here)
                if t + cell >= limit:
                    return limit, NONE, moved(limit - t, here)
                here, t, values = after, t + cell, new
            cell = min(widest, 2.0 * cell) if cells == 1 and cell < widest else widest

    found = answers(len(jobs))
    for job, row in zip(jobs.table.tolist(), found, strict=True):
        rules.chain(tuple(job), search, tolerance, row)
    return found
