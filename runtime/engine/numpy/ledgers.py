# SPDX-License-Identifier: MIT-0
"""The ledger over a part of a phase.

Within a phase z = (x_1 - x_1(0), v_1, v_2, y, 1) obeys z' = M z, so the integral of z z^T obeys

    I(2h) = I(h) + Phi(h) I(h) Phi(h)^T,        Phi(h) = exp(M h) from the closed form

(Van Loan, "Computing integrals involving the matrix exponential", 1978): a sum of squares, in which nothing cancels,
and which knows no pole configuration. It starts from a time in which little moves.
"""

from collections.abc import Sequence

import numpy as np

from hopform_solver import formulas
from hopform_solver.kernels import basis_at
from hopform_solver.lanes import Array, take
from hopform_solver.linear import GAUSS, ONE, V1, V2, X, Y, columns_of, doublings_of, transition
from hopform_solver.phases import Phase, arrive, drive_of, motion_under, poles_of
from hopform_solver.records import Drive, LegState, Moments, Poles, Rates, Real, Work


def moments_of(rates: Rates, poles: Poles, drive: Drive, start: LegState, side: Array, t: Array) -> Moments:
    """Integrals of the products over the first t of phases."""
    doublings = doublings_of(poles, t)
    h = np.ldexp(t, -doublings)
    origin, motion = start._replace(x1=np.zeros_like(t)), motion_under(rates, drive, start, side)
    total = np.zeros((t.size, 5, 5), t.dtype)
    for place, weight in GAUSS:
        z = columns_of(arrive(origin, motion, basis_at(poles, place * h), side))
        total += (weight * h)[:, np.newaxis, np.newaxis] * z[:, :, np.newaxis] * z[:, np.newaxis]
    for n in range(int(doublings.max(initial=0))):
        lanes = np.flatnonzero(doublings > n)
        phi = transition(*take((rates, poles, drive, side, h), lanes))
        total[lanes] += phi @ total[lanes] @ np.swapaxes(phi, 1, 2)
        h[lanes] *= 2.0
    pairs = ((ONE, V1), (ONE, V2), (V1, V1), (V1, V2), (V2, V2), (Y, V1), (Y, V2), (X, V2))
    return Moments(*(total[:, row, column] for row, column in pairs))


def ledger_over(phase: Phase, t: Array) -> Work:
    """The entries of the ledger over the first t of phases."""
    plan, start, u, side = phase
    moments = moments_of(plan.rates, poles_of(plan, side), drive_of(phase), start, side, t)
    return formulas.ledger_of(plan.robot, moments, u, side[0], side[1], start.x1)


def sums_before(entries: Sequence[Array], first: Real) -> Array:
    """Of entries (rows, phases), what has come together before each phase begins; the last row begins with a value."""
    sums = np.zeros_like(entries)
    sums[-1, 0] = first
    sums[:, 1:] = np.array(entries)[:, :-1]
    return np.cumsum(sums, axis=1, dtype=sums.dtype)
