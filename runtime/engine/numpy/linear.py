# SPDX-License-Identifier: MIT-0
"""A mode as a linear system: z = (x_1 - x_1(0), v_1, v_2, y, 1) obeys z' = M z in a phase, and Phi(h) = exp(M h)."""

import numpy as np
from numpy.typing import NDArray

from hopform_solver.kernels import basis_at
from hopform_solver.lanes import Array
from hopform_solver.phases import arrive, motion_under
from hopform_solver.records import Drive, LegState, Poles, Rates

_ROOTS, _AREAS = np.polynomial.legendre.leggauss(12)
GAUSS = tuple(zip((0.5 + 0.5 * _ROOTS).tolist(), (0.5 * _AREAS).tolist(), strict=True))
"""Places and weights of Gauss's rule over 0 .. 1, their own mirror: exact to rounding for a product of two motions over
a time in which neither turns or fades by more than a factor of e^4.
"""

X, V1, V2, Y, ONE = range(5)
"""The rows of z: those of a state, and 1."""


def columns_of(state: LegState) -> Array:
    """z of states, (lanes, 5)."""
    return np.stack([*state, np.ones_like(state.y)], axis=1)


def transition(rates: Rates, poles: Poles, drive: Drive, side: Array, h: Array) -> Array:
    """Phi(h) of a mode: its columns are the motions from rest under the drive and from unit initial values."""
    basis = basis_at(poles, h)
    phi = np.zeros((h.size, 5, 5), h.dtype)
    phi[:, ONE, ONE] = phi[:, X, X] = 1.0
    for column in V1, V2, Y, ONE:
        start = np.zeros((5, h.size), h.dtype)
        start[column] = np.abs(side[column - V1]) if column < Y else 1.0
        acceleration = Drive(*(constant * start[ONE] for constant in drive))
        motion = motion_under(rates, acceleration, LegState(*start[:ONE]), side)
        phi[:, :ONE, column] = np.transpose(arrive(LegState(*start[:ONE]), motion, basis, side))
    return phi


def doublings_of(poles: Poles, t: Array) -> NDArray[np.int64]:
    """How often a time over which Gauss's rule is exact must be doubled to give t: no pole is further from 0 than
    s_1 + sqrt(s_2).
    """
    fastest = (poles.s_1 + np.sqrt(poles.s_2)) * t
    return np.asarray(np.ceil(np.log2(np.maximum(0.25 * fastest, 1.0))), dtype=np.int64)
