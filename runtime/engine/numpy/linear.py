# SPDX-License-Identifier: MIT-0
"""A mode as a linear system: z = (x_1 - x_1(0), v_1, v_2, y, 1) obeys z' = M z in a phase, and Phi(h) = exp(M h)."""

import numpy as np
from numpy.typing import NDArray

from hopform_solver.kernels import basis_at
from hopform_solver.lanes import Array
from hopform_solver.phases import arrive, motion_under
from hopform_solver.records import Drive, LegState, Poles, Rates

X, V1, V2, Y, ONE = range(5)
"""The rows of z: those of a state, and 1."""


def columns_of(state: LegState) -> Array:
    """z of states, (lanes, 5), from where x_1 is."""
    return np.stack([np.zeros_like(state.y), *state[1:], np.ones_like(state.y)], axis=1)


def system(rates: Rates, drive: Drive, side: Array) -> Array:
    """M of the mode."""
    moves_1, moves_2 = moves = np.abs(side)
    m = np.zeros((side.shape[1], 5, 5), side.dtype)
    m[:, X, V1] = m[:, Y, V1] = moves_1
    m[:, Y, V2] = -moves_2
    rows = (rates.a1_v1, rates.a1_v2, rates.a1_y, drive.C_1), (rates.a2_v1, rates.a2_v2, rates.a2_y, drive.C_2)
    m[:, V1 : V2 + 1, V1:] = np.moveaxis(np.where(moves[:, np.newaxis] > 0.0, rows, 0.0), -1, 0)
    return m


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
    """How often a time in which little moves must be doubled to give t."""
    fastest = (poles.s_1 + np.sqrt(poles.s_2)) * t
    return np.asarray(np.ceil(np.log2(np.maximum(2.0 * fastest, 1.0))), dtype=np.int64)
