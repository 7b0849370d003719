# SPDX-License-Identifier: MIT-0
"""Candidate currents: the apex that follows each, the largest x_1, by how little the upper stop is hit, the least
minimum of the contact force, and how they change with the current, through the events.

A phase is linear, so its change d_z with u obeys the equations of motion without friction, weight and offset, under the
acceleration that 1 A gives. An event adds (z' before it - z' after it) d_tau. Extrema of x_1 and of the contact force
move to first order as if their time stood still. All currents at once, phase by phase.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform_solver import formulas
from hopform_solver.extrema import minima, rate_of
from hopform_solver.kernels import basis_at
from hopform_solver.lanes import Array, Flags, Numbers, choose, put, take
from hopform_solver.limits import CONTACT_IS_COMPRESSION
from hopform_solver.phases import Phase, arrive, motion_of, motion_under, poles_of
from hopform_solver.records import Basis, Drive, LegState, Motion, Poles, Robot
from hopform_solver.sensitivity import cross, speeds_of
from hopform_solver.stance import ENDING, Solution, solve

_PRIME = 1_000_003


class Trials(NamedTuple):
    """What the stances under some currents do; derivatives are by u.

    largest_x1: above x1_max where that is hit, by how far the stance is from not hitting it. least_contact: the least
    minimum of the contact force over k before the ending, inf if there is none. events: a number that stands for the
    order of modes and events. held: the actuator never moves. smooth: the derivatives exist.
    """

    u: Array
    apex: Array
    apex_u: Array
    largest_x1: Array
    largest_x1_u: Array
    least_contact: Array
    least_contact_u: Array
    events: NDArray[np.int64]
    takes_off: Flags
    held: Flags
    smooth: Flags


class _Moving(NamedTuple):
    """A phase of each of some lanes, how it moves, and how its change by u moves."""

    phase: Phase
    poles: Poles
    motion: Motion
    change: LegState
    by_u: Motion

    def at(self, basis: Basis) -> tuple[LegState, LegState]:
        """State and change."""
        phase = self.phase
        return arrive(phase.start, self.motion, basis, phase.side), arrive(self.change, self.by_u, basis, phase.side)


def try_currents(robot: Robot, start: LegState, u: Array, horizon: float, max_phases: int) -> Trials:
    """The stances from one state under currents u, an array of one dimension, in its precision."""
    solution = solve(robot, start, u, (0.0,), horizon, max_phases, u.dtype.type)
    phases, count, first, lengths = solution.phases, solution.phase_count, solution.first, solution.lengths
    zeros, yes = np.zeros((4, u.size), u.dtype), np.ones(u.shape, np.bool_)
    trials = Trials(
        u, zeros[0], zeros[1], phases.x1[first], zeros[2], np.full_like(u, np.inf), zeros[3],
        np.zeros(u.shape, np.int64), solution.ending == ENDING["takeoff"], yes, yes.copy(),
    )  # fmt: skip
    change, arrived = (LegState(*np.zeros((4, u.size), u.dtype)) for _ in range(2))
    rate = np.zeros_like(u)
    for n in range(int(count.max(initial=0))):
        lanes = np.flatnonzero(count > n)
        index = first[lanes] + n
        phase, length = solution.phase(index), lengths[index]
        trials.held[lanes] &= phase.side[0] == 0.0
        trials.events[lanes] = trials.events[lanes] * _PRIME + phases.mode[index] + 16 * phases.event[index]
        if n:
            _cross(solution, trials, change, arrived.v1[lanes], rate[lanes], lanes, index)
        moving = _moving(phase, take(change, lanes))
        _find_minima(trials, lanes, moving, length)
        basis = basis_at(moving.poles, length)
        at_end = moving.at(basis)
        put(arrived, lanes, at_end[0])
        put(change, lanes, at_end[1])
        rate[lanes] = rate_of(formulas.contact_numerator(phase.plan.robot, moving.motion), basis)
    _lift(solution, trials, change, first + count - 1)
    return trials


def _moving(phase: Phase, change: LegState) -> _Moving:
    per_ampere = Drive(phase.plan.rates.a1_u, np.zeros_like(phase.u))
    by_u = motion_under(phase.plan.rates, per_ampere, change, phase.side)
    return _Moving(phase, poles_of(phase.plan, phase.side), motion_of(phase), change, by_u)


def _note(value: Array, value_u: Array, lanes: Numbers, found: Array, found_u: Array, sign: float) -> None:
    """Keep the larger (sign 1) or the smaller (sign -1) of what is known and what is found."""
    better = sign * (found - value[lanes]) > 0.0
    value[lanes[better]], value_u[lanes[better]] = found[better], found_u[better]


def _find_minima(trials: Trials, lanes: Numbers, moving: _Moving, length: Array) -> None:
    """Minima of the contact force inside phases; y' keeps its sign unless both masses move in the same direction."""
    side = moving.phase.side
    may = np.flatnonzero(((side[0] != 0.0) & (side[0] == side[1])) | (not CONTACT_IS_COMPRESSION))
    some = take(moving, may)
    row, t = minima(some.poles, formulas.contact_numerator(some.phase.plan.robot, some.motion), length[may])
    found = take(some, row)
    state, change = found.at(basis_at(found.poles, t))
    least = formulas.contact_of(found.phase.plan.robot, state)
    least_u = formulas.contact_slope(found.phase.plan.robot, change)
    for one in np.argsort(-least, kind="stable"):  # the least last; hardly any stance has two
        here, where = slice(one, one + 1), lanes[may[row[one : one + 1]]]
        _note(trials.least_contact, trials.least_contact_u, where, least[here], least_u[here], -1.0)


def _cross(
    solution: Solution, trials: Trials, change: LegState, v1: Array, rate: Array, lanes: Numbers, now: Numbers
) -> None:
    """Changes right after the events that start phases `now`, in place; extrema there.

    v1, rate: the velocity of the actuator and the rate of the contact force when they were met.
    """
    stack = np.array(take(change, lanes)).T[:, :, np.newaxis]
    passed = cross(solution, now, v1, stack, np.zeros((now.size, 1), v1.dtype), 0.0)
    new = LegState(*passed.change[..., 0].T)
    put(change, lanes, new)
    trials.smooth[lanes] &= passed.speed != 0.0
    phase, old_side = solution.phase(now), solution.phase(now - 1).side
    robot, state = phase.plan.robot, phase.start
    met, left = (
        LegState(*(each[..., 0] + speeds * passed.late).T)
        for each, speeds in ((stack, passed.before), (passed.change, passed.after))
    )
    hit = np.flatnonzero(passed.hits & (passed.speed > 0.0))
    _note_hit(trials, lanes[hit], *take((state._replace(v1=v1), met, robot), hit))
    _note(trials.largest_x1, trials.largest_x1_u, lanes, state.x1, new.x1, 1.0)
    # Where both masses stand still, what they do before and after tells, and not what rounding leaves of their
    # velocities.
    stands = CONTACT_IS_COMPRESSION & (state.v1 == 0.0) & (state.v2 == 0.0)
    jumps = (not CONTACT_IS_COMPRESSION) & passed.hits
    after = formulas.contact_slope(robot, LegState(*passed.after.T))
    fell = (stands & (old_side[0] < old_side[1])) | (~stands & ((rate < 0.0) | jumps))
    falls = (stands & (phase.side[0] < phase.side[1])) | (~stands & (after < 0.0))
    turns = np.flatnonzero(fell & ~falls)
    least, least_u = formulas.contact_of(robot, state)[turns], formulas.contact_slope(robot, left)[turns]
    _note(trials.least_contact, trials.least_contact_u, lanes[turns], least, least_u, -1.0)


def _note_hit(trials: Trials, lanes: Numbers, at: LegState, met: LegState, robot: Robot) -> None:
    """Where the upper stop is hit: how far x_1 is from staying off it, as its velocity vanishes or the leg takes off
    before.

    The lesser of the contact force over k and of the height from which a mass falls as fast; met: the change of the
    state, whose time moves.
    """
    height, contact = 0.5 * at.v1 * at.v1 / formulas.fall_of(robot), formulas.contact_of(robot, at)
    slow = height < contact
    past_u = choose(slow, at.v1 * met.v1 / formulas.fall_of(robot), formulas.contact_slope(robot, met))
    _note(trials.largest_x1, trials.largest_x1_u, lanes, at.x1 + choose(slow, height, contact), past_u, 1.0)


def _lift(solution: Solution, trials: Trials, change: LegState, last: Numbers) -> None:
    """The apex and its change where a stance takes off; the last extremum of x_1."""
    end, off, robot = solution.end, trials.takes_off, solution.plan.robot
    speed = LegState(*speeds_of(solution.phase(last)._replace(start=end)).T[:4])
    rate = formulas.contact_slope(robot, speed)
    late = -formulas.contact_slope(robot, change) / choose(rate != 0.0, rate, 1.0)
    late = choose(off & (rate != 0.0), late, 0.0)
    x1_u, _, v2_u, y_u = (c + s * late for c, s in zip(change, speed, strict=True))
    if CONTACT_IS_COMPRESSION:
        y_u = np.zeros_like(x1_u)
    v_up = np.maximum(end.v2, 0.0)
    trials.apex[off] = formulas.apex_of_takeoff(robot, end.x1, end.y, v_up)[off]
    trials.apex_u[off] = (x1_u - y_u + v_up * v2_u / formulas.fall_of(robot))[off]
    trials.smooth[off & ~(rate != 0.0)] = False
    every = np.arange(trials.u.size)
    _note(trials.largest_x1, trials.largest_x1_u, every, end.x1, choose(off, x1_u, change.x1), 1.0)
