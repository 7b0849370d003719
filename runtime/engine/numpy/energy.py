# SPDX-License-Identifier: MIT-0
"""Energies and the ledger at any time of a stance."""

import numpy as np
from numpy.typing import ArrayLike

from hopform_solver import formulas
from hopform_solver.lanes import take
from hopform_solver.ledgers import ledger_over, sums_before
from hopform_solver.phases import state_in_phase
from hopform_solver.records import Energy, Ledger, Work
from hopform_solver.stance import EVENT, Solution, locate, state_at


def ledger_at(solution: Solution, lane: int, t: ArrayLike) -> Ledger:
    """The ledger of one lane from its start to times t [s], in t's shape."""
    index, within = locate(solution, lane, t)
    own = np.flatnonzero(solution.phases.lane == lane)
    whole, lengths = solution.phase(own), solution.lengths[own]
    v1 = state_in_phase(whole, lengths).v1
    hits = np.append(solution.phases.event[own[1:]] == EVENT["x1_hits_stop"], False)
    lost = np.where(hits, -0.5 * whole.plan.robot.m_eff * v1 * v1, 0.0)
    sums = sums_before([*ledger_over(whole, lengths), lost], solution.start_loss.reshape(-1)[lane])[:, index - own[0]]
    sums[:-1] += ledger_over(solution.phase(index), within)
    *work, stop_loss = (row.reshape(np.shape(t)) for row in sums)
    return Ledger(**Work(*work)._asdict(), stop_loss=stop_loss)


def energy_at(solution: Solution, lane: int, t: ArrayLike) -> Energy:
    """Energies of one lane at times t [s], in t's shape."""
    return formulas.energies(take(solution.plan.robot, np.array(lane)), state_at(solution, lane, t))
