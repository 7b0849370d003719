# SPDX-License-Identifier: MIT-0
"""A mode as a linear system: the members z of a state obey z' = M (z_1 .. z_3, 1) in a phase.

The core of M, without the first row, has (s - M)^-1 = adj(s - M)/P(s), and Phi(h) = exp(M h) follows from the powers
of s in adj as derivatives of W at h.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import formulas
from .kernels import basis_at
from .lanes import Array, choose
from .records import Drive, LegState, Poles, Rates

_ROOTS, _AREAS = np.polynomial.legendre.leggauss(12)
GAUSS = tuple(zip((0.5 + 0.5 * _ROOTS).tolist(), (0.5 * _AREAS).tolist(), strict=True))
"""Places and weights of Gauss's rule over 0 .. 1, their own mirror: exact to rounding for a product of two motions over
a time in which neither turns or fades by more than a factor of e^4.
"""

ONE = len(LegState._fields)
"""The row of z behind those of a state, which is 1."""


class Mode(NamedTuple):
    """Modes as linear systems, lanes being the last axis of every array; the core is counted from 0.

    transfer (3, 4, 3): of s^2, s and 1 in adj(s - M), and in that times the constant accelerations.
    """

    transfer: Array
    poles: Poles
    rests: NDArray[np.bool_]


def mode_of(rates: Rates, poles: Poles, drive: Drive, side: Array) -> Mode:
    """The modes of phases under constant accelerations."""
    transfer = np.array([entry + np.zeros_like(side[0]) for entry in formulas.transfer_of(rates, drive, *side)])
    return Mode(transfer.reshape(3, 4, 3, -1), poles, (side == 0.0).all(axis=0))


def columns_of(state: LegState) -> Array:
    """z of states, (5, lanes)."""
    return np.stack([*state, np.ones_like(state[0])])


def response_in(mode: Mode, h: Array) -> Array:
    """W'', W', W and its integrals (5, lanes) at h; those of h = 0 where both masses are held."""
    return np.array(basis_at(mode.poles, choose(mode.rests, 0.0, h)))


def transition(mode: Mode, response: Array) -> Array:
    """Phi(h) (5, 5, lanes) from W at h: the first row and the constant part are one integral further each."""
    phi = np.zeros((5, 5, response.shape[1]), response.dtype)
    phi[0, 0] = phi[ONE, ONE] = 1.0
    for column in range(1, ONE + 1):
        by, at = mode.transfer[:, column - 1], response[column == ONE :]
        phi[1:ONE, column], phi[0, column] = (by * at[:3]).sum(axis=1), (by[0] * at[1:4]).sum(axis=0)
    return phi


def doublings_of(poles: Poles, t: Array) -> NDArray[np.int64]:
    """How often a time over which Gauss's rule is exact must be doubled to give t: no pole is further from 0 than
    s_1 + sqrt(s_2).
    """
    fastest = (poles.s_1 + np.sqrt(poles.s_2)) * t
    return np.asarray(np.ceil(np.log2(np.maximum(0.25 * fastest, 1.0))), dtype=np.int64)
