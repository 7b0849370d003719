# SPDX-License-Identifier: MIT-0
"""Energies and the ledger at any time of a stance."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform_solver import formulas
from hopform_solver.lanes import Array, take
from hopform_solver.ledgers import ledger_over
from hopform_solver.phases import Plan, Side, plan_lanes, state_in_phase
from hopform_solver.records import EVENTS, Energy, Ledger, LegState, Work
from hopform_solver.stance import Solution, locate, sides_of, state_at

_HITS = next(number for number, text in EVENTS.items() if text == "x1_hits_stop")


def ledger_at(solution: Solution, lane: int, t: ArrayLike) -> Ledger:
    """The ledger of one lane from its start to times t [s], in t's shape."""
    _, index, within = locate(solution, lane, t)
    first, count = int(np.searchsorted(solution.phases.lane, lane)), int(solution.phase_count.reshape(-1)[lane])
    own = np.arange(first, first + count)
    lengths = np.diff(solution.phases.t[own])
    whole = np.array(_work_in_phases(solution, lane, own[:-1], lengths))
    before = np.concatenate([np.zeros((len(Work._fields), 1), whole.dtype), np.cumsum(whole, axis=1)], axis=1)
    part = np.array(_work_in_phases(solution, lane, index, within))
    loss = np.append(solution.start_loss.reshape(-1)[lane], _losses(solution, lane, own, lengths))
    shape = np.shape(t)
    entries = before[:, index - first] + part
    work = Work(*(entry.reshape(shape) for entry in entries))
    return Ledger(**work._asdict(), stop_loss=np.cumsum(loss)[index - first].reshape(shape))


def _phase_inputs(solution: Solution, lane: int, index: NDArray[np.intp]) -> tuple[Plan, LegState, Array, Side]:
    phases = take(solution.phases, index)
    return (
        plan_lanes(solution.plan, np.full(index.size, lane)),
        LegState(phases.x1, phases.v1, phases.v2, phases.y),
        solution.u_values[lane][phases.step],
        sides_of(phases.mode, solution.duration.dtype),
    )


def _work_in_phases(solution: Solution, lane: int, index: NDArray[np.intp], t: Array) -> Work:
    plan, start, u, side = _phase_inputs(solution, lane, index)
    return ledger_over(plan, start, u, side, t)


def _losses(solution: Solution, lane: int, own: NDArray[np.intp], lengths: Array) -> Array:
    """Energy lost at the start of each phase but the first: that of the actuator where it has met a stop."""
    plan, start, u, side = _phase_inputs(solution, lane, own[:-1])
    hits = solution.phases.event[own[1:]] == _HITS
    v1 = state_in_phase(plan, start, u, side, lengths).v1
    return np.where(hits, -0.5 * plan.robot.m_eff * v1 * v1, 0.0)


def energy_at(solution: Solution, lane: int, t: ArrayLike) -> Energy:
    """Energies of one lane at times t [s], in t's shape."""
    state = state_at(solution, lane, t)
    robot = type(solution.plan.robot)(*(field[lane] for field in solution.plan.robot))
    return formulas.energies(robot, state)
