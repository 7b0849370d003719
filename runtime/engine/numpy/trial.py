# SPDX-License-Identifier: MIT-0
"""Candidate currents: the apex that follows each, the largest position, by how little the upper stop is hit, the least
minimum of the contact force, and how they change with the current, through the events.

A phase is linear, so its change d_z with u obeys the equations of motion without friction, weight and offset, under the
acceleration that 1 A gives. Extrema of the position and of the contact force move to first order as if their time stood
still. All currents at once, phase by phase.
"""

from typing import NamedTuple

import numpy as np

from hopform_solver import formulas
from hopform_solver.elements import COMPRESSION, DRIVEN, LARGEST_POSITION, PER_AMPERE, POSITION, STOPPED, Trials
from hopform_solver.events import EventSet, jets_of, node_of, propagator_at
from hopform_solver.extrema import minima, turns
from hopform_solver.kernels import basis_at
from hopform_solver.lanes import Array, Numbers, choose, put, take
from hopform_solver.limits import CONTACT_IS_COMPRESSION
from hopform_solver.phases import Phase, arrive, motion_of, motion_under, poles_of
from hopform_solver.records import Basis, Drive, LegState, Motion, Poles, Robot, StateChange
from hopform_solver.sensitivity import cross, speeds_of
from hopform_solver.stance import COMPRESSION_FOLLOWS, ENDING, VELOCITIES, Solution, solve

_PRIME = 1_000_003
VELOCITY = VELOCITIES[STOPPED]


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
    takes_off, yes = solution.ending == ENDING["takeoff"], np.ones(u.shape, np.bool_)
    values, numbers = np.zeros((6, u.size), u.dtype), np.zeros((2, u.size), np.int64)
    trials = Trials._make([u, *values, *numbers, takes_off, yes, yes.copy()])
    getattr(trials, LARGEST_POSITION)[...] = solution.phase(first).start[POSITION]
    trials.least_contact[...] = np.inf
    change, arrived = (LegState(*np.zeros((4, u.size), u.dtype)) for _ in range(2))
    rate = np.zeros_like(u)
    for n in range(int(count.max(initial=0))):
        lanes = np.flatnonzero(count > n)
        index = first[lanes] + n
        phase, length = solution.phase(index), lengths[index]
        trials.held[lanes] &= phase.side[DRIVEN] == 0.0
        trials.events[lanes] = trials.events[lanes] * _PRIME + phases.mode[index] + 16 * phases.event[index]
        if n:
            _cross(solution, trials, change, arrived[VELOCITY][lanes], rate[lanes], lanes, index)
        per_ampere, now = np.zeros_like(phase.side), take(change, lanes)
        per_ampere[DRIVEN] = phase.plan.rates[PER_AMPERE]
        by_u = motion_under(phase.plan.rates, Drive(*per_ampere), now, phase.side)
        moving = _Moving(phase, poles_of(phase.plan, phase.side), motion_of(phase), now, by_u)
        _find_minima(trials, lanes, moving, length)
        off = np.flatnonzero(takes_off[lanes] & (count[lanes] == n + 1) & (length > 0.0) & (trials.minima[lanes] == 0))
        _note_dips(trials, lanes[off], take(moving, off), length[off])
        basis = basis_at(moving.poles, length)
        at_end = moving.at(basis)
        put(arrived, lanes, at_end[0])
        put(change, lanes, at_end[1])
        rate[lanes] = sum(map(np.multiply, formulas.contact_numerator(phase.plan.robot, moving.motion), basis))
    _lift(solution, trials, change, first + count - 1)
    return trials


def _note(trials: Trials, name: str, lanes: Numbers, found: Array, found_u: Array, sign: float) -> None:
    """Keep the larger (sign 1) or the smaller (sign -1) of what is known and what is found."""
    value, value_u = getattr(trials, name), getattr(trials, f"{name}_u")
    better = sign * (found - value[lanes]) > 0.0
    value[lanes[better]], value_u[lanes[better]] = found[better], found_u[better]


def _find_minima(trials: Trials, lanes: Numbers, moving: _Moving, length: Array) -> None:
    """Minima of the contact force inside phases."""
    may = np.flatnonzero(turns(moving.phase.side) | (not CONTACT_IS_COMPRESSION))
    some = take(moving, may)
    row, t = minima(some.poles, formulas.contact_numerator(some.phase.plan.robot, some.motion), length[may])
    found = take(some, row)
    state, change = found.at(basis_at(found.poles, t))
    least = formulas.contact_of(found.phase.plan.robot, state)
    least_u = formulas.contact_slope(found.phase.plan.robot, change)
    np.add.at(trials.minima, lanes[may[row]], 1)
    for one in np.argsort(-least, kind="stable")[:, np.newaxis]:  # the least last; hardly any stance has two
        _note(trials, "least_contact", lanes[may[row[one]]], least[one], least_u[one], -1.0)


def _note_dips(trials: Trials, lanes: Numbers, moving: _Moving, length: Array) -> None:
    """Take-offs before which the contact force has no minimum: how far below zero it would fall if the contact could
    pull, by the parabola there. Where that is nothing, the stance goes on for another rebound.
    """
    poles, robot, end = moving.poles, moving.phase.plan.robot, propagator_at(np.array(moving.poles), length)

    def jets(motion: Motion, start: Array) -> Array:
        numerator = np.array(formulas.contact_numerator(robot, motion))
        return jets_of(EventSet(np.array(poles), node_of(poles), numerator, start), end)

    rate, curvature, third = jets(moving.motion, np.zeros_like(length))[1:]
    value_u, rate_u, curvature_u = jets(moving.by_u, formulas.contact_slope(robot, moving.change))[:3]
    later, moved_u = -rate / curvature, curvature_u - third * value_u / rate  # where the take-off moves to
    dip, dip_u = 0.5 * rate * later, value_u + later * (rate_u + 0.5 * later * moved_u)
    some = (rate < 0.0) & (curvature > 0.0) & np.isfinite(dip) & np.isfinite(dip_u)
    trials.least_contact[lanes[some]], trials.least_contact_u[lanes[some]] = dip[some], dip_u[some]


def _cross(
    solution: Solution, trials: Trials, change: LegState, velocity: Array, rate: Array, lanes: Numbers, now: Numbers
) -> None:
    """Changes right after the events that start phases `now`, in place; extrema there.

    velocity, rate: of the element that has stops, and of the contact force, when they were met.
    """
    stack = np.array(take(change, lanes)).T[:, :, np.newaxis]
    bound = np.zeros((now.size, 1), velocity.dtype)
    hits, before, after, speed, late, passed = cross(solution, now, velocity, stack, bound, 0.0)
    new = LegState(*passed[..., 0].T)
    put(change, lanes, new)
    trials.smooth[lanes] &= speed != 0.0
    phase, old_side = solution.phase(now), solution.phase(now - 1).side
    robot, state = phase.plan.robot, np.array(phase.start)
    met, left = (LegState(*(each[..., 0] + speeds * late).T) for each, speeds in ((stack, before), (passed, after)))
    at_stop = state.copy()
    at_stop[VELOCITY] = velocity
    hit = np.flatnonzero(hits & (speed > 0.0))
    _note_hit(trials, lanes[hit], *take((LegState(*at_stop), met, robot), hit))
    _note(trials, LARGEST_POSITION, lanes, state[POSITION], new[POSITION], 1.0)
    # Where nothing moves, the sides before and after tell, and not what rounding leaves of the velocities.
    stands = np.asarray(CONTACT_IS_COMPRESSION & ~state[VELOCITIES].any(axis=0))
    jumps = (not CONTACT_IS_COMPRESSION) & hits
    old, goes = ((COMPRESSION_FOLLOWS * side).sum(axis=0) for side in (old_side, phase.side))
    rises = ~(formulas.contact_slope(robot, LegState(*after.T)) < 0.0)
    up = choose(stands, (old < 0.0) & ~(goes < 0.0), ((rate < 0.0) | jumps) & rises).nonzero()[0]
    least, least_u = formulas.contact_of(robot, phase.start)[up], formulas.contact_slope(robot, left)[up]
    trials.minima[lanes[up]] += 1
    _note(trials, "least_contact", lanes[up], least, least_u, -1.0)


def _note_hit(trials: Trials, lanes: Numbers, at: LegState, met: LegState, robot: Robot) -> None:
    """Where the upper stop is hit: how far the position is from staying off it, as its velocity vanishes or the contact
    force does before.

    The lesser of the contact force over k and of the height from which a mass falls as fast; met: the change of the
    state, whose time moves.
    """
    fall, contact, velocity = formulas.fall_of(robot), formulas.contact_of(robot, at), at[VELOCITY]
    height = 0.5 * velocity * velocity / fall
    slow = height < contact
    past_u = choose(slow, velocity * met[VELOCITY] / fall, formulas.contact_slope(robot, met))
    _note(trials, LARGEST_POSITION, lanes, at[POSITION] + choose(slow, height, contact), past_u, 1.0)


def _lift(solution: Solution, trials: Trials, change: LegState, last: Numbers) -> None:
    """The apex and its change where a stance takes off; the last extremum of the position."""
    end, off, robot = solution.end, trials.takes_off, solution.plan.robot
    speed = speeds_of(solution.phase(last)._replace(start=end)).T[:4]
    rate = formulas.contact_slope(robot, LegState(*speed))
    late = -formulas.contact_slope(robot, change) / choose(rate != 0.0, rate, 1.0)
    met = np.array(change) + speed * choose(off & (rate != 0.0), late, 0.0)
    every = np.arange(trials.u.size)
    _note(trials, LARGEST_POSITION, every, end[POSITION], choose(off, met[POSITION], change[POSITION]), 1.0)
    if CONTACT_IS_COMPRESSION:
        met[COMPRESSION] = 0.0
    trials.apex[off] = solution.apex[off]
    trials.apex_u[off] = formulas.apex_slope(robot, end, StateChange(*met))[off]
    trials.smooth[off & ~(rate != 0.0)] = False
