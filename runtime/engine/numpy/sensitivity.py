# SPDX-License-Identifier: MIT-0
"""How stances depend on their inputs, through their events.

Within a phase z = (1, x_1, y, v_1, v_2) obeys z' = M z, so a change d_p of an input changes z by

    d_z(h) = Phi(h) d_z(0) + sum_j d_M_j G_j(h) z(0),     G_j(h) = integral of Phi(h - s) E_j Phi(s), 0 <= s <= h

E_j being 1 in one place of the rows of (3), (4) in M. Doubling, G_j(2h) = Phi(h) G_j(h) + G_j(h) Phi(h), adds up what
does not cancel and knows no pole configuration (Van Loan, "Computing integrals involving the matrix exponential",
1978).

An event at tau, which moves by d_tau, adds (z' before it - z' after it) d_tau, on top of what it does to the state.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hopform_solver import formulas
from hopform_solver.lanes import Array, Record, choose, take
from hopform_solver.limits import CONTACT_IS_COMPRESSION
from hopform_solver.linear import ONE, V1, V2, X, Y, doublings_of, system, transition
from hopform_solver.phases import Plan, Side, motion_of, plan_lanes, state_in_phase
from hopform_solver.records import ENDINGS, EVENTS, LegState, Robot, RobotChange, StateChange
from hopform_solver.stance import Phases, Solution, sides_of

ROWS = ("T", "x1", "v1", "x2", "v2", "apex", "aed")
"""Time and state of the take-off, hop height of the apex, AED."""

COLUMNS = ("x1", "v1", "y", "v2", "u", *Robot._fields)
"""Initial state with the compression y as a coordinate of its own, a change of all currents alike, the robot."""

TERMS = 24
CHUNK = 4096
"""Lanes that are computed at a time: the responses of a phase take 2 kB each."""
_TAKEOFF = next(number for number, text in ENDINGS.items() if text == "takeoff")
_EVENT = {text: number for number, text in EVENTS.items()}
_BY = {name: number for number, name in enumerate(COLUMNS)}
_SHARES = tuple((row, column) for row in (V1, V2) for column in (ONE, Y, V1, V2))


@dataclass(frozen=True)
class _Chains:
    """The phases of the lanes that take off, end to end, with what each needs; `lane` counts those lanes alone."""

    plan: Plan
    phases: Phases
    length: Array
    u: Array
    side: Side
    first: NDArray[np.intp]
    count: NDArray[np.int64]

    @property
    def states(self) -> LegState:
        return LegState(self.phases.x1, self.phases.v1, self.phases.v2, self.phases.y)

    def only(self, index: NDArray[Any]) -> tuple[Plan, LegState, Array, Side]:
        """Plan, state at the start, current and mode of some phases."""
        return plan_lanes(self.plan, index), take(self.states, index), self.u[index], take(self.side, index)


def _chains_of(solution: Solution, lanes: NDArray[np.intp]) -> _Chains:
    phases = take(solution.phases, np.isin(solution.phases.lane, lanes))
    count = solution.phase_count.reshape(-1)[lanes]
    first = np.cumsum(count) - count
    ends = np.append(phases.t[1:], phases.t.dtype.type(0.0))
    ends[first + count - 1] = solution.duration.reshape(-1)[lanes]
    return _Chains(
        plan_lanes(solution.plan, phases.lane),
        phases,
        ends - phases.t,
        solution.u_values[phases.lane, phases.step],
        sides_of(phases.mode, phases.t.dtype),
        first,
        count,
    )


def _short_response(m: Array, h: Array) -> Array:
    """G of each share over short times, (n, 8, 5, 5): the power series of the derivative of exp(M h)."""
    h = h[:, np.newaxis, np.newaxis]
    power = np.broadcast_to(np.eye(5, dtype=m.dtype), m.shape)
    term = np.zeros((m.shape[0], len(_SHARES), 5, 5), dtype=m.dtype)
    total = term.copy()
    for n in range(1, TERMS):
        term = m[:, np.newaxis] @ term
        for share, (row, column) in enumerate(_SHARES):
            term[:, share, row] += power[:, column]
        term *= (h / n)[:, np.newaxis]
        power = m @ power * (h / n)
        total += term
    return total


def _responses(plan: Plan, start: LegState, u: Array, side: Side, t: Array) -> tuple[Array, Array]:
    """Phi (n, 5, 5), and how z at the end answers to each share (n, 5, 8); that of a held mass has no answer."""
    drive = formulas.drive_of(plan.robot, plan.rates, u, *side)
    doublings = doublings_of(plan, side, t)
    h = np.ldexp(t, -doublings)
    shares = _short_response(system(plan, drive, side), h)
    for n in range(int(doublings.max(initial=0))):
        lanes = np.flatnonzero(doublings > n)
        phi = transition(plan_lanes(plan, lanes), take(drive, lanes), take(side, lanes), h[lanes])[:, np.newaxis]
        shares[lanes] = phi @ shares[lanes] + shares[lanes] @ phi
        h[lanes] *= 2.0
    z = np.stack([np.ones_like(t), np.zeros_like(t), start.y, start.v1, start.v2], axis=1)
    moves = np.stack([side.first != 0.0] * 4 + [side.second != 0.0] * 4, axis=1)
    by_share = np.where(moves[:, :, np.newaxis], (shares @ z[:, np.newaxis, :, np.newaxis])[..., 0], 0.0)
    return transition(plan, drive, side, t), np.swapaxes(by_share, 1, 2)


def _robot_change(dtype: Any) -> RobotChange:
    """The change of each parameter that the columns stand for, (1, columns) each."""
    unit = np.eye(len(COLUMNS), dtype=dtype)
    return RobotChange(*(unit[np.newaxis, _BY[name]] for name in Robot._fields))


def _column(record: Record) -> Record:
    """A record of lanes, to broadcast against columns."""
    return type(record)(*(field[:, np.newaxis] for field in record))


def _advance(chains: _Chains, index: NDArray[np.intp], change: Array) -> Array:
    """Changes (n, 5, columns) at the end of phases from those at their start."""
    plan, start, u, side = chains.only(index)
    phi, by_share = _responses(plan, start, u, side, chains.length[index])
    dtype = change.dtype
    by_u = np.eye(len(COLUMNS), dtype=dtype)[np.newaxis, _BY["u"]]
    robot, at = _column(plan.robot), _column(side)
    slopes = formulas.slopes_of(robot, u[:, np.newaxis], at.first, at.second, _robot_change(dtype), by_u)
    shape = (index.size, len(COLUMNS))
    of_share = np.stack([np.broadcast_to(np.asarray(slope, dtype=dtype), shape) for slope in slopes], axis=1)
    return np.asarray(phi @ change + by_share @ of_share)


def _speeds(chains: _Chains, index: NDArray[np.intp], state: LegState) -> Array:
    """z' (n, 5) in the modes and under the currents of phases, at states."""
    plan, _, u, side = chains.only(index)
    motion = motion_of(plan, state, u, side)
    return np.stack([np.zeros_like(u), state.v1, motion.H3_y, motion.H3_1, motion.H3_2], axis=1)


def _is(event: NDArray[np.int8], *words: str) -> NDArray[np.bool_]:
    return np.isin(event, [_EVENT[word] for word in words])


def _pass(chains: _Chains, old: NDArray[np.intp], change: Array) -> Array:
    """Changes right after the events between phases and the next ones; nothing jumps at a slip or a step of the
    current.
    """
    now = old + 1
    event = chains.phases.event[now]
    hits = _is(event, "x1_hits_stop")
    rests_1, rests_2 = _is(event, "x1_reverses", "x1_sticks"), _is(event, "x2_reverses", "x2_sticks")
    lanes = np.flatnonzero(hits | rests_1 | rests_2)
    if not lanes.size:
        return change
    old, now, hits = old[lanes], now[lanes], hits[lanes]
    state = take(chains.states, now)
    after = _speeds(chains, now, state)
    plan, start, u, side = chains.only(old)
    arriving = state_in_phase(plan, start, u, side, chains.length[old])
    before = _speeds(chains, old, state._replace(v1=choose(hits, arriving.v1, state.v1)))
    coordinate = np.where(hits, X, np.where(rests_1[lanes], V1, V2))
    bound = np.zeros((lanes.size, len(COLUMNS)), dtype=change.dtype)
    stop = np.where(side.first > 0.0, _BY["x1_max"], _BY["x1_min"])
    bound[hits, stop[hits]] = 1.0
    each = np.arange(lanes.size)
    smooth = ~hits & (before == after).all(
        axis=1
    )  # without friction nothing jumps, however little of a velocity is left
    before[smooth, coordinate[smooth]] = after[smooth, coordinate[smooth]] = 1.0
    late = (bound - change[lanes, coordinate]) / before[each, coordinate, np.newaxis]
    passed = change[lanes] + (before - after)[:, :, np.newaxis] * late[:, np.newaxis]
    passed[each, coordinate] = bound - after[each, coordinate, np.newaxis] * late
    passed[hits, V1] = -after[hits, V1, np.newaxis] * late[hits]
    made = change.copy()
    made[lanes] = passed
    return made


def _begin(chains: _Chains, struck: NDArray[np.bool_]) -> Array:
    """Changes at the start: no velocity is left of a mass that is held, or that a stop took at once."""
    dtype = chains.length.dtype
    change = np.zeros((chains.first.size, 5, len(COLUMNS)), dtype=dtype)
    change[:, X, _BY["x1"]] = change[:, Y, _BY["y"]] = 1.0
    change[:, V1, _BY["v1"]] = (chains.side.first[chains.first] != 0.0) & ~struck
    change[:, V2, _BY["v2"]] = chains.side.second[chains.first] != 0.0
    return change


def _finish(chains: _Chains, end: LegState, change: Array) -> Array:
    """The rows (n, 7, columns) from the changes at take-off, F = 0."""
    dtype = change.dtype
    last = chains.first + chains.count - 1
    speed = _speeds(chains, last, end)[:, :, np.newaxis]
    by = _robot_change(dtype)
    robot = _column(take(chains.plan.robot, chains.first))
    rows = (X, V1, V2, Y)
    rate = formulas.contact_slope(robot, LegState(*(speed[:, row] for row in rows)))
    at_rest = StateChange(*(change[:, row] for row in rows))
    late = -formulas.contact_change(robot, _column(end), by, at_rest) / rate
    d_x1, d_v1, d_v2, d_y = (change[:, row] + speed[:, row] * late for row in rows)
    if CONTACT_IS_COMPRESSION:
        d_y = np.zeros_like(d_x1)
    unit = np.eye(len(COLUMNS), dtype=dtype)
    at_start = StateChange(*(unit[np.newaxis, _BY[name]] for name in LegState._fields))
    start, end = _column(take(chains.states, chains.first)), _column(end)
    at_end = StateChange(d_x1, d_v1, d_v2, d_y)
    before = formulas.body_energy_change(robot, start, by, at_start)
    aed = formulas.body_energy_change(robot, end, by, at_end) - before
    apex = formulas.apex_change(robot, np.maximum(end.v2, 0.0), by, d_x1, d_y, d_v2)
    return np.stack([late, d_x1, d_v1, d_x1 - d_y + by.d_L0 + by.d_c, d_v2, apex, aed], axis=1)


def _of_lanes(solution: Solution, lanes: NDArray[np.intp]) -> Array:
    """The matrices (n, 7, columns) of lanes that take off."""
    chains = _chains_of(solution, lanes)
    change = _begin(chains, solution.start_loss.reshape(-1)[lanes] < 0.0)
    for n in range(int(chains.count.max(initial=0))):
        going = np.flatnonzero(chains.count > n)
        change[going] = _advance(chains, chains.first[going] + n, change[going])
        on = np.flatnonzero(chains.count > n + 1)
        change[on] = _pass(chains, chains.first[on] + n, change[on])
    end = LegState(*(np.asarray(field).reshape(-1)[lanes] for field in solution.end))
    return _finish(chains, end, change)


def sensitivities_of(solution: Solution) -> Array:
    """Derivatives of solved stances through their events, in the solution's shape with two more axes, ROWS and COLUMNS.

    NaN without take-off, where an event grazes, and for the apex without gravity. Column y is at fixed x_1, L0, c:
    where x_2 is given, y = x_1 - x_2 + L0 + c passes it on to them. An actuator that starts on a stop stays where it
    starts (x1) until it leaves; x1_min, x1_max count where a stop is met later.
    """
    ending = solution.ending.reshape(-1)
    matrix = np.full((ending.size, len(ROWS), len(COLUMNS)), np.nan, dtype=solution.duration.dtype)
    lifts = np.flatnonzero(ending == _TAKEOFF)
    with np.errstate(all="ignore"):
        for begin in range(0, lifts.size, CHUNK):
            lanes = lifts[begin : begin + CHUNK]
            matrix[lanes] = _of_lanes(solution, lanes)
    exists = np.isfinite(matrix[:, : ROWS.index("apex")]).all(axis=(1, 2))
    matrix[~exists] = np.nan
    matrix[~np.isfinite(matrix[:, ROWS.index("apex")]).all(axis=1), ROWS.index("apex")] = np.nan
    return matrix.reshape(*solution.shape, len(ROWS), len(COLUMNS))


def _between(chains: _Chains, n: int, t: Array) -> _Chains:
    """Pieces of one phase from its start or a time to the next time, each a phase of its own."""
    index = np.full(t.size, n)
    begin = np.concatenate([chains.phases.t[n : n + 1], t[:-1]])
    plan, start, u, side = chains.only(index)
    at = state_in_phase(plan, start, u, side, begin - chains.phases.t[n])
    at = LegState(*(np.where(begin > chains.phases.t[n], later, now) for later, now in zip(at, start, strict=True)))
    phases = take(chains.phases, index)._replace(t=begin, x1=at.x1, v1=at.v1, v2=at.v2, y=at.y)
    one = np.zeros(1, dtype=np.intp)
    return _Chains(plan, phases, t - begin, u, side, one, np.full(1, t.size, dtype=np.int64))


def tangents_of(solution: Solution, times: Array) -> Array:
    """Derivatives (times, 4, columns) of the states x_1, v_1, v_2, y of one solved stance at times that do not
    decrease.

    Through the events before each time; where an event grazes, those of a motion that does not notice it.
    """
    chains = _chains_of(solution, np.zeros(1, dtype=np.intp))
    change = _begin(chains, solution.start_loss.reshape(-1)[:1] < 0.0)
    within = np.minimum(times, solution.duration.reshape(-1)[0])
    found = np.zeros((times.size, 4, len(COLUMNS)), dtype=within.dtype)
    rows = [X, V1, V2, Y]
    with np.errstate(all="ignore"):
        for n in range(int(chains.count[0])):
            last = n + 1 == chains.count[0]
            end = np.inf if last else chains.phases.t[n + 1]
            here = np.flatnonzero((within >= chains.phases.t[n]) & (within < end))
            stops = within[here] if last else np.append(within[here], end)
            if not stops.size:
                break
            pieces = _between(chains, n, np.asarray(stops, dtype=within.dtype))
            for piece in range(stops.size):
                change = _advance(pieces, np.array([piece]), change)
                if piece < here.size:
                    found[here[piece]] = change[0, rows]
            if not last:
                passed = _pass(chains, np.array([n]), change)
                change = np.where(np.isfinite(passed).all(), passed, change)
    return found
