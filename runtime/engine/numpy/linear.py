# SPDX-License-Identifier: MIT-0
"""A mode as a linear system: z = (1, x_1 - x_1(0), y, v_1, v_2) obeys z' = M z in a phase, and Phi(h) = exp(M h)."""

import numpy as np
from numpy.typing import NDArray

from hopform_solver.kernels import basis_at
from hopform_solver.lanes import Array
from hopform_solver.phases import Plan, Side, arrive, motion_under, poles_of
from hopform_solver.records import Drive, LegState

ONE, X, Y, V1, V2 = range(5)


def system(plan: Plan, drive: Drive, side: Side) -> Array:
    """M of the mode."""
    moves_1, moves_2 = np.abs(side.first), np.abs(side.second)
    rates = plan.rates
    m = np.zeros((*side.first.shape, 5, 5), dtype=side.first.dtype)
    m[:, X, V1] = m[:, Y, V1] = moves_1
    m[:, Y, V2] = -moves_2
    for row, moves, entries in (
        (V1, moves_1, {ONE: drive.C_1, Y: rates.a1_y, V1: rates.a1_v1, V2: rates.a1_v2}),
        (V2, moves_2, {ONE: drive.C_2, Y: rates.a2_y, V1: rates.a2_v1, V2: rates.a2_v2}),
    ):
        for column, value in entries.items():
            m[:, row, column] = np.where(moves > 0.0, value, 0.0)
    return m


def transition(plan: Plan, drive: Drive, side: Side, h: Array) -> Array:
    """Phi(h) of a mode: its columns are the motions from rest under the drive and from unit initial values."""
    basis = basis_at(poles_of(plan, side), h)
    zero = np.zeros_like(h)
    none = Drive(zero, zero)
    phi = np.zeros((*h.shape, 5, 5), dtype=h.dtype)
    phi[:, ONE, ONE] = phi[:, X, X] = 1.0
    unit = {
        ONE: LegState(zero, zero, zero, zero),
        Y: LegState(zero, zero, zero, zero + 1.0),
        V1: LegState(zero, np.abs(side.first), zero, zero),
        V2: LegState(zero, zero, np.abs(side.second), zero),
    }
    for column, start in unit.items():
        motion = motion_under(plan.rates, drive if column == ONE else none, start, side)
        end = arrive(start, motion, basis, side)
        phi[:, X, column], phi[:, Y, column], phi[:, V1, column], phi[:, V2, column] = end.x1, end.y, end.v1, end.v2
    return phi


def doublings_of(plan: Plan, side: Side, t: Array) -> NDArray[np.int64]:
    """How often a time in which little moves must be doubled to give t."""
    poles = poles_of(plan, side)
    fastest = (poles.s_1 + np.sqrt(poles.s_2)) * t
    return np.asarray(np.ceil(np.log2(np.maximum(2.0 * fastest, 1.0))), dtype=np.int64)
