# SPDX-License-Identifier: MIT-0
"""How stances depend on their inputs, through their events.

Within a phase z' = M z, so a change d_p of an input changes z by

    d_z(h) = Phi(h) d_z(0) + sum d_M_rc (Phi_r * z_c)(h),      (f * g)(h) = integral of f(h - s) g(s), 0 <= s <= h

over the entries of M that an input changes: the rows r of (3), (4). Phi_r is N(s)/P(s) and z_c is K(s)/(s P(s)), so
that their convolution is N(s) K(s)/s over P(s)^2, the powers of s being derivatives of W * W.

An event at tau, which moves by d_tau, adds (z' before it - z' after it) d_tau, on top of what it does to the state.
"""

from typing import Any

import numpy as np

from hopform_solver import elements, formulas
from hopform_solver.elements import AXIS_OF_EVENT, COMPRESSION, ELEMENTS, INPUTS, POSITION, ROWS, STOPPED, STOPS
from hopform_solver.kernels import basis_at
from hopform_solver.lanes import Array, Flags, Numbers, choose, take
from hopform_solver.limits import CONTACT_IS_COMPRESSION
from hopform_solver.linear import GAUSS, ONE, Mode, columns_of, doublings_of, mode_of, response_in, transition
from hopform_solver.phases import Phase, drive_of, poles_of, state_in_phase
from hopform_solver.records import LegState, Robot, RobotChange, StateChange
from hopform_solver.stance import ENDING, Solution, locate

COLUMNS = (*INPUTS, *Robot._fields)
"""Initial state with the compression as a coordinate of its own, a change of all currents alike, the robot."""

CHUNK = 4096
"""Phases that are computed at a time: one takes 4 kB."""
VELOCITY = ELEMENTS[STOPPED].velocity
"""The axis of the velocity that is lost at a stop."""
_ECHOES = 7


def _echoes(mode: Mode, t: Array) -> Array:
    """The derivatives of W * W from the fourth down, itself, and two integrals (7, lanes): W with n primes times W with
    as many or one less.
    """
    doublings = doublings_of(mode.poles, t)
    h = np.ldexp(t, -doublings)
    at = [np.array(basis_at(mode.poles, place * h)) for place, _ in GAUSS]
    orders = [(n // 2, (n + 1) // 2) for n in range(_ECHOES)]
    echoes = np.array([
        h * sum(weight * W[i] * rest[j] for (_, weight), W, rest in zip(GAUSS, at, reversed(at), strict=True))
        for i, j in orders
    ])  # fmt: skip
    for n in range(int(doublings.max(initial=0))):
        lanes = np.flatnonzero(doublings > n)
        within, old = take(mode, lanes), echoes[:, lanes]
        W, (_, _, _, s_1, s_2, s_3) = response_in(within, h[lanes]), within.poles
        # The derivatives of W at h + s, and W, by W'', W', W at s: in none of them does anything cancel.
        later = np.array([
            [W[0], -s_2 * W[1] - s_3 * W[2], -s_3 * W[1]],
            [W[1], W[0] + s_1 * W[1], -s_3 * W[2]],
            [W[2], W[1] + s_1 * W[2], W[0] + s_1 * W[1] + s_2 * W[2]],
        ])  # fmt: skip

        def half(i: int, j: int, W: Array = W, later: Array = later, old: Array = old) -> Array:
            if i < len(later):
                return np.asarray((later[i] * old[j : j + 3]).sum(axis=0))
            return np.asarray((later[2] * old[j + 1 : j + 4]).sum(axis=0) + W[3] * W[j + 1])

        echoes[:, lanes] = [half(i, j) + half(j, i) for i, j in orders]
        h[lanes] *= 2.0
    return echoes


def _responses(mode: Mode, phase: Phase, t: Array, response: Array) -> Array:
    """How z at t answers to a change of each entry in the rows of (3), (4): (4, 2, 4, lanes); that of a held mass has
    no answer.
    """
    echoes, z = _echoes(mode, t), columns_of(phase.start)[1:ONE]
    K = np.zeros((3, 4, t.size), t.dtype)
    K[:, :3] = (mode.transfer[:, :3] * z[:, np.newaxis]).sum(axis=1)
    K[:, 1:] += mode.transfer[:, 3]
    applied = np.array([(K * echoes[n : n + 4]).sum(axis=1) for n in range(4)])
    applied = np.concatenate([applied, response[1:, np.newaxis]], axis=1)
    powers = mode.transfer[:, :2, :, np.newaxis]
    core = (powers * applied[:3]).sum(axis=2)
    first = (powers[0] * applied[1:]).sum(axis=1)
    found = np.concatenate([first[np.newaxis], core])
    return np.where(phase.side[:, np.newaxis] != 0.0, found, 0.0)


def _robot_change(dtype: Any) -> RobotChange:
    """The change of each parameter that the columns stand for, (1, columns) each."""
    return RobotChange(*np.eye(len(COLUMNS), dtype=dtype)[len(INPUTS) :, np.newaxis])


def _advance(phase: Phase, t: Array, change: Array) -> Array:
    """Changes (n, 5, columns) at times t since phases began from those at their starts."""
    if t.size > CHUNK:
        parts = np.array_split(np.arange(t.size), t.size // CHUNK + 1)
        return np.concatenate([_advance(take(phase, part), t[part], change[part]) for part in parts])
    mode = mode_of(phase.plan.rates, poles_of(phase.plan, phase.side), drive_of(phase), phase.side)
    response = response_in(mode, t)
    by_share = _responses(mode, phase, t, response).reshape(4, 8, -1)
    by_u = np.eye(len(COLUMNS), dtype=t.dtype)[np.newaxis, INPUTS.index("u")]
    robot, u, side = _column(phase.plan.robot), phase.u[:, np.newaxis], phase.side[..., np.newaxis]
    slopes = formulas.slopes_of(robot, u, side[0], side[1], _robot_change(t.dtype), by_u)
    of_share = np.stack([np.broadcast_to(slope, (t.size, len(COLUMNS))) for slope in slopes], axis=1, dtype=t.dtype)
    moved = np.moveaxis(transition(mode, response), -1, 0) @ change
    moved[:, :ONE] += np.moveaxis(by_share, -1, 0) @ of_share
    return np.asarray(moved)


def _column(record: Any) -> Any:
    """A record of lanes, to broadcast against columns."""
    return type(record)(*(field[:, np.newaxis] for field in record))


def speeds_of(phase: Phase) -> Array:
    """z' (n, 5) where phases start."""
    speeds = formulas.speeds_of(phase.plan.rates, drive_of(phase), phase.side[0], phase.side[1], phase.start)
    return np.stack([*speeds, np.zeros_like(phase.u)], axis=1)


def cross(
    solution: Solution, now: Numbers, met: Array, change: Array, bound: Array, graze: float
) -> tuple[Flags, Array, Array, Array, Array, Array]:
    """Changes through the events that start phases `now`; nothing jumps at a slip or a step of the current.

    met: the velocity with which a stop is met. change: before the event (n, rows, columns). bound: that of the stop (n,
    columns). graze: how late what has no speed is.
    Returns whether a stop is met, z' before and after (n, rows), the speed at which what becomes 0 does so, how much
    later the event comes (n, columns), and the change right after it (n, rows, columns).
    """
    old, new = solution.phase(now - 1), solution.phase(now)
    each, row, start = np.arange(now.size), np.take(AXIS_OF_EVENT, solution.phases.event[now]), np.array(new.start)
    hits = row == POSITION
    start[VELOCITY] = choose(hits, met, start[VELOCITY])
    arriving = old._replace(start=LegState(*start))
    before, after = (speeds_of(phase)[:, : change.shape[1]] for phase in (arriving, new))
    # Without friction nothing jumps, however little of a velocity is left.
    smooth = ~hits & (before == after).all(axis=1)
    speed, speed_after = (choose(smooth, 1.0, speeds[each, row])[:, np.newaxis] for speeds in (before, after))
    late = choose(speed != 0.0, (bound - change[each, row]) / speed, graze)
    late = choose((row >= 0)[:, np.newaxis], late, 0.0)
    passed = change + (before - after)[:, :, np.newaxis] * late[:, np.newaxis]
    jumps = np.flatnonzero(row >= 0)
    passed[jumps, row[jumps]] = (bound - speed_after * late)[jumps]
    passed[hits, VELOCITY] = -after[hits, VELOCITY, np.newaxis] * late[hits]
    return hits, before, after, speed[:, 0], late, passed


def _begin(solution: Solution, lanes: Numbers) -> Array:
    """Changes at the start: no velocity is left of a mass that is held, or that a stop took at once."""
    side = solution.phase(solution.first[lanes]).side
    change = np.zeros((lanes.size, 5, len(COLUMNS)), side.dtype)
    change[:, np.arange(ONE), elements.COLUMN_OF_AXIS] = 1.0
    for element, slips in zip(ELEMENTS, side != 0.0, strict=True):
        change[~slips, element.velocity] = 0.0
    change[solution.start_loss.reshape(-1)[lanes] < 0.0, VELOCITY] = 0.0
    return change


def _pass(solution: Solution, now: Numbers, lengths: Array, change: Array) -> Array:
    """Changes right after the events between phases and the ones before, NaN where one grazes."""
    old = solution.phase(now - 1)
    stop = len(INPUTS) + np.where(old.side[STOPPED] > 0.0, STOPS[1], STOPS[0])
    bound = np.zeros((now.size, len(COLUMNS)), change.dtype)
    hits = np.flatnonzero(solution.phases.event[now] == ELEMENTS[STOPPED].hits_stop)
    bound[hits, stop[hits]] = 1.0
    return cross(solution, now, state_in_phase(old, lengths)[VELOCITY], change, bound, np.nan)[-1]


def _finish(solution: Solution, lanes: Numbers, change: Array) -> Array:
    """The rows (n, 7, columns) from the changes at take-off, F = 0."""
    start = solution.phase(solution.first[lanes])
    last = solution.phase(solution.first[lanes] + solution.phase_count.reshape(-1)[lanes] - 1)
    end = LegState(*(field.reshape(-1)[lanes] for field in solution.end))
    speed = speeds_of(last._replace(start=end))[:, :ONE, np.newaxis]
    by, unit = _robot_change(change.dtype), np.eye(len(COLUMNS), dtype=change.dtype)
    robot, begin, end = (_column(record) for record in (start.plan.robot, start.start, end))
    rate = formulas.contact_slope(robot, LegState(*np.moveaxis(speed, 1, 0)))
    at_rest = StateChange(*np.moveaxis(change[:, :ONE], 1, 0))
    late = -formulas.contact_change(robot, end, by, at_rest) / rate
    moved = np.moveaxis(change[:, :ONE] + speed * late[:, np.newaxis], 1, 0)
    if CONTACT_IS_COMPRESSION:
        moved[COMPRESSION] = 0.0
    at_end, at_start = StateChange(*moved), StateChange(*unit[elements.COLUMN_OF_AXIS, np.newaxis])
    before = formulas.body_energy_change(robot, begin, by, at_start)
    aed = formulas.body_energy_change(robot, end, by, at_end) - before
    apex, height = formulas.apex_change(robot, end, by, at_end), formulas.height_change(robot, by, at_end)
    return np.stack([late, *moved[:2], height, moved[2], apex, aed], axis=1)


@np.errstate(all="ignore")
def sensitivities_of(solution: Solution) -> Array:
    """Derivatives of solved stances through their events, in the solution's shape with two more axes, ROWS and COLUMNS.

    NaN without take-off, where an event grazes, and for the apex without gravity. The column of the compression is at
    a fixed position and length of the leg: where a height is given, the compression passes it on to them. An element
    that starts on a stop stays where it starts until it leaves; the stops count where one is met later.
    """
    ending, counts = solution.ending.reshape(-1), solution.phase_count.reshape(-1)
    matrix = np.full((ending.size, len(ROWS), len(COLUMNS)), np.nan, solution.duration.dtype)
    lanes, lengths = np.flatnonzero(ending == ENDING["takeoff"]), solution.lengths
    change, first, count = _begin(solution, lanes), solution.first[lanes], counts[lanes]
    for n in range(int(count.max(initial=0))):
        going = np.flatnonzero(count > n)
        index = first[going] + n
        if n:
            change[going] = _pass(solution, index, lengths[index - 1], change[going])
        change[going] = _advance(solution.phase(index), lengths[index], change[going])
    matrix[lanes] = _finish(solution, lanes, change)
    apex = ROWS.index("apex")
    matrix[~np.isfinite(matrix[:, :apex]).all(axis=(1, 2))] = np.nan
    matrix[~np.isfinite(matrix[:, apex]).all(axis=1), apex] = np.nan
    return matrix.reshape(*solution.shape, len(ROWS), len(COLUMNS))


@np.errstate(all="ignore")
def tangents_of(solution: Solution, times: Array) -> Array:
    """Derivatives (times, 4, columns) of the state of one solved stance at times, its axes in their order.

    Through the events before each time; where an event grazes, those of a motion that does not notice it.
    """
    lengths = solution.lengths
    changes = [_begin(solution, np.zeros(1, np.intp))]
    for n in range(1, lengths.size):
        now = np.array([n])
        change = _advance(solution.phase(now - 1), lengths[now - 1], changes[-1])
        passed = _pass(solution, now, lengths[now - 1], change)
        changes.append(np.where(np.isfinite(passed).all(), passed, change))
    index, within = locate(solution, 0, times)
    return _advance(solution.phase(index), within, np.concatenate(changes)[index])[:, :ONE]
