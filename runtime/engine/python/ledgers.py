# SPDX-License-Identifier: MIT-0
"""The ledger over a part of a phase.

Within a phase z' = M z, so the integral of z z^T obeys

    I(2h) = I(h) + Phi(h) I(h) Phi(h)^T,        Phi(h) = exp(M h) from the closed form

(Van Loan, "Computing integrals involving the matrix exponential", 1978): a sum of squares, in which nothing cancels,
and which knows no pole configuration. It starts from a time in which little moves.
"""

import numpy as np

from . import formulas
from .elements import AXES_OF_MOMENTS
from .kernels import basis_at
from .lanes import Array, take
from .linear import GAUSS, columns_of, doublings_of, mode_of, response_in, transition
from .phases import Phase, arrive, drive_of, motion_under, poles_of
from .records import Drive, LegState, Moments, Poles, Rates, Work


def moments_of(rates: Rates, poles: Poles, drive: Drive, start: LegState, side: Array, t: Array) -> Moments:
    """Integrals of the products over the first t of phases, axis 0 counted from where they start."""
    doublings = doublings_of(poles, t)
    h, mode = np.ldexp(t, -doublings), mode_of(rates, poles, drive, side)
    origin, motion = LegState(np.zeros_like(t), *start[1:]), motion_under(rates, drive, start, side)
    total = np.zeros((5, 5, t.size), t.dtype)
    for place, weight in GAUSS:
        z = columns_of(arrive(origin, motion, basis_at(poles, place * h), side))
        total += (weight * h) * z[:, np.newaxis] * z
    for n in range(int(doublings.max(initial=0))):
        lanes = np.flatnonzero(doublings > n)
        within = take(mode, lanes)
        phi = transition(within, response_in(within, h[lanes]))
        total[..., lanes] += np.einsum("ikn,kln,jln->ijn", phi, total[..., lanes], phi)
        h[lanes] *= 2.0
    return Moments(*(total[row, column] for row, column in AXES_OF_MOMENTS))


def ledger_over(phase: Phase, t: Array) -> Work:
    """The entries of the ledger over the first t of phases."""
    plan, start, u, side = phase
    moments = moments_of(plan.rates, poles_of(plan, side), drive_of(phase), start, side, t)
    return formulas.ledger_of(plan.robot, moments, u, side[0], side[1], start[0])
