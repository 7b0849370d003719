# SPDX-License-Identifier: MIT-0
"""Candidate currents: the apex that follows each, the largest x_1, by how little the upper stop is hit, the least
minimum of the contact force, and how they change with the current, through the events.

A phase is linear, so its change d_z with u obeys the equations of motion without friction, weight and offset, under the
acceleration that 1 A gives. An event adds (z' before it - z' after it) d_tau. Extrema of x_1 and of the contact force
move to first order as if their time stood still. All currents at once, phase by phase.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform_solver import formulas
from hopform_solver.extrema import minima, rate_of
from hopform_solver.kernels import basis_at
from hopform_solver.lanes import Array, choose, put, take
from hopform_solver.limits import CONTACT_IS_COMPRESSION
from hopform_solver.phases import Plan, Side, arrive, contact_numerator, motion_of, motion_under, plan_lanes, poles_of
from hopform_solver.records import ENDINGS, EVENTS, Drive, LegState, Motion, Poles, Robot
from hopform_solver.stance import Solution, sides_of, solve

_TAKEOFF = next(number for number, text in ENDINGS.items() if text == "takeoff")
_EVENT = {text: number for number, text in EVENTS.items()}
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
    takes_off: NDArray[np.bool_]
    held: NDArray[np.bool_]
    smooth: NDArray[np.bool_]


@dataclass
class _Phase:
    """A phase of each of some lanes: where it starts, how it moves, how its change moves."""

    robot: Robot
    poles: Poles
    start: LegState
    motion: Motion
    change: LegState
    by_u: Motion
    side: Side
    length: Array

    def at(self, t: Array) -> LegState:
        return arrive(self.start, self.motion, basis_at(self.poles, t), self.side)

    def change_at(self, t: Array) -> LegState:
        return arrive(self.change, self.by_u, basis_at(self.poles, t), self.side)

    def only(self, lanes: NDArray[np.intp]) -> "_Phase":
        return _Phase(
            take(self.robot, lanes), take(self.poles, lanes), take(self.start, lanes), take(self.motion, lanes),
            take(self.change, lanes), take(self.by_u, lanes), take(self.side, lanes), self.length[lanes],
        )  # fmt: skip

    def contact_rate(self, t: Array) -> Array:
        """Rate of the contact force over k."""
        return rate_of(self.poles, contact_numerator(self.robot, self.motion), t)


def try_currents(robot: Robot, start: LegState, u: Array, horizon: float, max_phases: int) -> Trials:
    """The stances from one state under currents u, an array of one dimension, in its precision."""
    solution = solve(robot, start, u, (0.0,), horizon, max_phases, u.dtype.type)
    phases, count = solution.phases, solution.phase_count
    first = np.cumsum(count) - count
    plan, gravity = solution.plan, formulas.fall_of(solution.plan.robot)
    trials = _blank(u)
    trials.takes_off[:] = solution.ending == _TAKEOFF
    trials.largest_x1[:] = phases.x1[first]
    change = LegState(*(np.zeros_like(u) for _ in LegState._fields))
    arrived = LegState(*(np.zeros_like(u) for _ in LegState._fields))
    rate = np.zeros_like(u)
    ends = np.append(phases.t[1:], u.dtype.type(0.0))
    ends[first + count - 1] = solution.duration
    for n in range(int(count.max(initial=0))):
        lanes = np.flatnonzero(count > n)
        index = first[lanes] + n
        side = sides_of(phases.mode[index], u.dtype)
        states = LegState(phases.x1[index], phases.v1[index], phases.v2[index], phases.y[index])
        trials.held[lanes] &= side.first == 0.0
        trials.events[lanes] = trials.events[lanes] * _PRIME + phases.mode[index] + 16 * phases.event[index]
        if n:
            _cross(plan, solution, trials, change, (arrived, rate), lanes, index)
        phase = _phase_of(
            plan_lanes(plan, lanes), states, u[lanes], take(change, lanes), side, ends[index] - phases.t[index]
        )
        _find_minima(trials, lanes, phase)
        put(arrived, lanes, phase.at(phase.length))
        put(change, lanes, phase.change_at(phase.length))
        rate[lanes] = phase.contact_rate(phase.length)
    _lift(solution, trials, change, first + count - 1, gravity)
    return trials


def _blank(u: Array) -> Trials:
    zero, yes = np.zeros_like(u), np.ones(u.shape, dtype=bool)
    return Trials(
        u, zero.copy(), zero.copy(), zero.copy(), zero.copy(), np.full_like(u, np.inf), zero.copy(),
        np.zeros(u.shape, np.int64), ~yes, yes.copy(), yes.copy(),
    )  # fmt: skip


def _phase_of(plan: Plan, start: LegState, u: Array, change: LegState, side: Side, length: Array) -> _Phase:
    zero = np.zeros_like(u)
    per_ampere = Drive(plan.rates.a1_u, zero)
    return _Phase(
        plan.robot, poles_of(plan, side), start, motion_of(plan, start, u, side), change,
        motion_under(plan.rates, per_ampere, change, side), side, length,
    )  # fmt: skip


def _note(value: Array, value_u: Array, lanes: NDArray[np.intp], found: Array, found_u: Array, sign: float) -> None:
    """Keep the larger (sign 1) or the smaller (sign -1) of what is known and what is found."""
    better = sign * (found - value[lanes]) > 0.0
    value[lanes[better]], value_u[lanes[better]] = found[better], found_u[better]


def _find_minima(trials: Trials, lanes: NDArray[np.intp], phase: _Phase) -> None:
    """Minima of the contact force inside phases; y' keeps its sign unless both masses move in the same direction."""
    same_way = (phase.side.first != 0.0) & (phase.side.first == phase.side.second)
    may = np.flatnonzero(same_way | (not CONTACT_IS_COMPRESSION))
    if not may.size:
        return
    some = phase.only(may)
    row, t = minima(some.poles, contact_numerator(some.robot, some.motion), some.length)
    if not row.size:
        return
    found = some.only(row)
    least = formulas.contact_of(found.robot, found.at(t))
    least_u = formulas.contact_slope(found.robot, found.change_at(t))
    for one in np.argsort(-least, kind="stable"):  # the least last; hardly any stance has two
        here = slice(one, one + 1)
        _note_minimum(trials, lanes[may[row[here]]], least[here], least_u[here])


def _speeds(plan: Plan, state: LegState, u: Array, side: Side) -> LegState:
    """x_1, v_1, v_2, y per time in modes, at states."""
    motion = motion_of(plan, state, u, side)
    return LegState(state.v1, motion.H3_1, motion.H3_2, motion.H3_y)


def _cross(
    plan: Plan,
    solution: Solution,
    trials: Trials,
    change: LegState,
    before_event: tuple[LegState, Array],
    lanes: NDArray[np.intp],
    now: NDArray[np.intp],
) -> None:
    """Changes right after the events that start phases `now`, in place; extrema there.

    before_event: the states in which they were met, and the rates of the contact force.
    """
    arrived, rate = before_event
    phases, event = solution.phases, solution.phases.event[now]
    stops, rests_1 = event == _EVENT["x1_hits_stop"], np.isin(event, [_EVENT["x1_reverses"], _EVENT["x1_sticks"]])
    rests_2 = np.isin(event, [_EVENT["x2_reverses"], _EVENT["x2_sticks"]])
    u, plans, dtype = trials.u[lanes], plan_lanes(plan, lanes), rate.dtype
    state = LegState(phases.x1[now], phases.v1[now], phases.v2[now], phases.y[now])
    after = _speeds(plans, state, u, sides_of(phases.mode[now], dtype))
    arriving = state._replace(v1=np.where(stops, arrived.v1[lanes], state.v1))
    before = _speeds(plans, arriving, u, sides_of(phases.mode[now - 1], dtype))
    moving = stops | rests_1 | rests_2
    old = take(change, lanes)
    speed = choose(stops, before.x1, choose(rests_1, before.v1, before.v2))
    off = choose(stops, old.x1, choose(rests_1, old.v1, old.v2))
    grazes = moving & (speed == 0.0)
    late = np.zeros_like(off)
    sound = moving & ~grazes
    late[sound] = -off[sound] / speed[sound]
    passed = LegState(*(c + (b - a) * late for c, b, a in zip(old, before, after, strict=True)))
    new = LegState(
        np.where(stops, -after.x1 * late, passed.x1),
        np.where(stops | rests_1, -after.v1 * late, passed.v1),
        np.where(rests_2, -after.v2 * late, passed.v2),
        passed.y,
    )
    put(change, lanes, new)
    trials.smooth[lanes] &= ~grazes
    met = LegState(*(np.asarray(c + b * late) for c, b in zip(old, before, strict=True)))
    hit = np.flatnonzero(sound & stops & (speed > 0.0))
    _note_hit(trials, lanes[hit], take(arriving, hit), take(met, hit), take(plans.robot, hit))
    _note(trials.largest_x1, trials.largest_x1_u, lanes, state.x1, new.x1, 1.0)
    # Where both masses stand still, what they do before and after tells, and not what rounding leaves of their
    # velocities.
    old_side, new_side = sides_of(phases.mode[now - 1], dtype), sides_of(phases.mode[now], dtype)
    stands = CONTACT_IS_COMPRESSION & (state.v1 == 0.0) & (state.v2 == 0.0)
    jumps = (not CONTACT_IS_COMPRESSION) & stops
    fell = np.where(stands, old_side.first < old_side.second, (rate[lanes] < 0.0) | jumps)
    falls = np.where(stands, new_side.first < new_side.second, formulas.contact_slope(plans.robot, after) < 0.0)
    turns = np.flatnonzero(fell & ~falls)
    left = LegState(*(np.asarray(c + a * late) for c, a in zip(new, after, strict=True)))
    least = formulas.contact_of(plans.robot, state)
    _note_minimum(trials, lanes[turns], least[turns], formulas.contact_slope(plans.robot, left)[turns])


def _note_minimum(trials: Trials, lanes: NDArray[np.intp], least: Array, least_u: Array) -> None:
    _note(trials.least_contact, trials.least_contact_u, lanes, least, least_u, -1.0)


def _note_hit(trials: Trials, lanes: NDArray[np.intp], at: LegState, met: LegState, robot: Robot) -> None:
    """Where the upper stop is hit: how far x_1 is from staying off it, as its velocity vanishes or the leg takes off
    before.

    The lesser of the contact force over k and of the height from which a mass falls as fast; met: the change of the
    state, whose time moves.
    """
    height, contact = np.asarray(0.5 * at.v1 * at.v1 / formulas.fall_of(robot)), formulas.contact_of(robot, at)
    slow = np.asarray(height < contact)
    past_u = choose(slow, np.asarray(at.v1 * met.v1 / formulas.fall_of(robot)), formulas.contact_slope(robot, met))
    past = choose(slow, height, contact)
    _note(trials.largest_x1, trials.largest_x1_u, lanes, np.asarray(at.x1 + past), past_u, 1.0)


def _lift(solution: Solution, trials: Trials, change: LegState, last: NDArray[np.intp], gravity: Array) -> None:
    """The apex and its change where a stance takes off; the last extremum of x_1."""
    end = LegState(*(np.asarray(field) for field in solution.end))
    side = sides_of(solution.phases.mode[last], trials.u.dtype)
    speed = _speeds(solution.plan, end, trials.u, side)
    off = trials.takes_off
    robot = solution.plan.robot
    rate = formulas.contact_slope(robot, speed)
    good = off & (rate != 0.0)
    late = np.zeros_like(trials.u)
    late[good] = -formulas.contact_slope(robot, change)[good] / rate[good]
    x1_u, v2_u = change.x1 + speed.x1 * late, change.v2 + speed.v2 * late
    y_u = np.zeros_like(x1_u) if CONTACT_IS_COMPRESSION else change.y + speed.y * late
    trials.apex[off] = formulas.apex_of_takeoff(take(robot, off), end.x1[off], end.y[off], np.maximum(end.v2[off], 0.0))
    trials.apex_u[off] = (x1_u - y_u + np.maximum(end.v2, 0.0) * v2_u / gravity)[off]
    trials.smooth[off & ~good] = False
    lanes = np.arange(trials.u.size)
    _note(trials.largest_x1, trials.largest_x1_u, lanes, end.x1, choose(off, x1_u, np.asarray(change.x1)), 1.0)
