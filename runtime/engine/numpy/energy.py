# SPDX-License-Identifier: MIT-0
"""Energies and the ledger at any time of a stance."""

import numpy as np
from numpy.typing import ArrayLike

from hopform_solver import formulas
from hopform_solver.elements import ELEMENTS, STOPPED
from hopform_solver.lanes import choose, take
from hopform_solver.ledgers import ledger_over, sums_before
from hopform_solver.phases import state_in_phase
from hopform_solver.records import Energy, Ledger, Work
from hopform_solver.stance import Solution, locate, state_at


def ledger_at(solution: Solution, lane: int, t: ArrayLike) -> Ledger:
    """The ledger of one lane from its start to times t [s], in t's shape."""
    index, within = locate(solution, lane, t)
    own = np.flatnonzero(solution.phases.lane == lane)
    whole, lengths = solution.phase(own), solution.lengths[own]
    hits = np.append(solution.phases.event[own[1:]] == ELEMENTS[STOPPED].hits_stop, False)
    lost = choose(hits, formulas.loss_at_stop(whole.plan.robot, state_in_phase(whole, lengths)), 0.0)
    sums = sums_before([*ledger_over(whole, lengths), lost], solution.start_loss.reshape(-1)[lane])[:, index - own[0]]
    sums[:-1] += ledger_over(solution.phase(index), within)
    *work, stop_loss = (row.reshape(np.shape(t)) for row in sums)
    return Ledger(**Work(*work)._asdict(), stop_loss=stop_loss)


def energy_at(solution: Solution, lane: int, t: ArrayLike) -> Energy:
    """Energies of one lane at times t [s], in t's shape."""
    return formulas.energies(take(solution.plan.robot, np.array(lane)), state_at(solution, lane, t))
