# SPDX-License-Identifier: MIT-0
"""The ledger over a part of a phase.

Within a phase z = (1, x_1 - x_1(0), y, v_1, v_2) obeys z' = M z, so the integral of z z^T obeys

    I(2h) = I(h) + Phi(h) I(h) Phi(h)^T,        Phi(h) = exp(M h) from the closed form

(Van Loan, "Computing integrals involving the matrix exponential", 1978): a sum of squares, in which nothing cancels,
and which knows no pole configuration. It starts from the power series over a time in which little moves.
"""

import numpy as np

from hopform_solver import formulas
from hopform_solver.lanes import Array, take
from hopform_solver.linear import ONE, V1, V2, X, Y, doublings_of, system, transition
from hopform_solver.phases import Plan, Side, plan_lanes
from hopform_solver.records import LegState, Moments, Work

TERMS = 24


def _short_moments(m: Array, start: Array, h: Array) -> Array:
    """Integral of z z^T over a short time: its power series, (z z^T)' = M z z^T + z z^T M^T."""
    h = h[:, np.newaxis, np.newaxis]
    product = start[:, :, np.newaxis] * start[:, np.newaxis, :] * h
    total = product.copy()
    for n in range(1, TERMS):
        half = m @ product
        product = (half + np.swapaxes(half, 1, 2)) * h / (n + 1)
        total = total + product
    return total


def moments_of(plan: Plan, start: LegState, u: Array, side: Side, t: Array) -> Moments:
    """Integrals of the products over the first t of phases."""
    drive = formulas.drive_of(plan.robot, plan.rates, u, *side)
    doublings = doublings_of(plan, side, t)
    h = np.ldexp(t, -doublings)
    z = np.stack([np.ones_like(t), np.zeros_like(t), start.y, start.v1, start.v2], axis=1)
    total = _short_moments(system(plan, drive, side), z, h)
    for n in range(int(doublings.max(initial=0))):
        lanes = np.flatnonzero(doublings > n)
        phi = transition(plan_lanes(plan, lanes), take(drive, lanes), take(side, lanes), h[lanes])
        total[lanes] += phi @ total[lanes] @ np.swapaxes(phi, 1, 2)
        h[lanes] *= 2.0
    pairs = ((ONE, V1), (ONE, V2), (V1, V1), (V1, V2), (V2, V2), (Y, V1), (Y, V2), (X, V2))
    return Moments(*(total[:, row, column] for row, column in pairs))


def ledger_over(plan: Plan, start: LegState, u: Array, side: Side, t: Array) -> Work:
    """The entries of the ledger over the first t of phases that start in a state."""
    return formulas.ledger_of(plan.robot, moments_of(plan, start, u, side, t), u, *side, start.x1)
