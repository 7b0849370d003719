# SPDX-License-Identifier: MIT-0
"""Stances as chains of phases: each is linear, has its closed form, and ends at the first of the events in which a mass
reverses, sticks, slips or hits a stop, or in which the spring force returns to zero. All lanes advance together, each
through its own events.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform_solver import formulas
from hopform_solver.events import (
    SLOTS,
    UNKNOWN,
    EventSet,
    Interval,
    basis_of,
    begin_interval,
    crosses_at_limit,
    find_first_root,
    first_interval,
    give_up,
    node_of,
    propagator_at,
    root_between,
    steady_state_correction,
    step_to_root,
    time_to_rest,
)
from hopform_solver.lanes import Array, choose, take
from hopform_solver.ledgers import ledger_over
from hopform_solver.limits import BODY_IS_FIXED, CONTACT_IS_COMPRESSION, EPS, FOOT_IS_FIXED, NEVER, UNDERFLOW
from hopform_solver.phases import (
    Plan,
    Side,
    arrive,
    contact_numerator,
    motion_of,
    plan_lanes,
    plan_of,
    poles_of,
    state_in_phase,
)
from hopform_solver.records import ENDINGS, EVENTS, At, Basis, LegState, Motion, Poles, Robot

_ENDING = {text: number for number, text in ENDINGS.items()}
_EVENT = {text: number for number, text in EVENTS.items()} | {"": 0}
LIMIT, VELOCITY_1, THRESHOLD_1, STOP, VELOCITY_2, THRESHOLD_2, TAKEOFF, UNCERTIFIED = range(8)


class Phases(NamedTuple):
    """Phases of all lanes, lane by lane in the order of time."""

    lane: NDArray[np.intp]
    t: Array
    x1: Array
    v1: Array
    v2: Array
    y: Array
    mode: NDArray[np.int8]
    event: NDArray[np.int8]
    step: NDArray[np.int64]


@dataclass(frozen=True)
class Solution:
    """Stances, solved; every array has one entry per lane, in the shape that the inputs broadcast to.

    duration [s], end: the state at the ending, apex [m] (NaN without take-off), aed [J], start_loss [J] the energy lost
    at a stop at t = 0, ending (a key of ENDINGS), phase_count, phases: where each phase starts, in which mode, by which
    event.
    """

    shape: tuple[int, ...]
    plan: Plan
    u_times: Array
    u_values: Array
    start: LegState
    duration: Array
    end: LegState
    apex: Array
    aed: Array
    start_loss: Array
    ending: NDArray[np.int64]
    phase_count: NDArray[np.int64]
    phases: Phases


@dataclass
class _Chain:
    """The lanes that are still going; `lane` says which of the caller's each one is."""

    plan: Plan
    u_times: Array
    u_values: Array
    horizon: Array
    max_phases: int
    lane: NDArray[np.intp]
    state: LegState
    from_min: Array  # x1 - x1_min and x1 - x1_max: x1 itself has no digits for what is this close to a stop
    from_max: Array
    side: Side
    t: Array
    step: NDArray[np.int64]
    fresh_1: NDArray[np.bool_]
    fresh_2: NDArray[np.bool_]
    alone: NDArray[
        np.int64
    ]  # the mass that has just come to rest, its free acceleration known from the motion, 0 if none has
    free: Array  # this acceleration, from before the state lost its digits
    count: NDArray[np.int64]

    @property
    def u(self) -> Array:
        return np.asarray(self.u_values[np.arange(self.step.size), self.step])

    @property
    def last_step(self) -> NDArray[np.bool_]:
        return np.asarray(self.step + 1 >= self.u_times.size)

    def only(self, keep: NDArray[np.bool_]) -> "_Chain":
        if keep.all():
            return self
        return _Chain(
            plan_lanes(self.plan, keep),
            self.u_times,
            self.u_values[keep],
            self.horizon[keep],
            self.max_phases,
            self.lane[keep],
            take(self.state, keep),
            self.from_min[keep],
            self.from_max[keep],
            take(self.side, keep),
            self.t[keep],
            self.step[keep],
            self.fresh_1[keep],
            self.fresh_2[keep],
            self.alone[keep],
            self.free[keep],
            self.count[keep],
        )


# ---- the hold rule ----


def _blocked(chain: _Chain, side: Array) -> NDArray[np.bool_]:
    locked = ~(chain.plan.robot.x1_min < chain.plan.robot.x1_max)
    return np.asarray(locked | ((side < 0.0) & (chain.from_min <= 0.0)) | ((side > 0.0) & (chain.from_max >= 0.0)))


def _drift_of_free(chain: _Chain, mass: int, lanes: NDArray[np.bool_]) -> Array:
    """First non-zero derivative of the free acceleration of masses that are held."""
    plan, state, u = plan_lanes(chain.plan, lanes), take(chain.state, lanes), chain.u[lanes]
    first, second = take(chain.side, lanes)
    side = Side(np.zeros_like(first), second) if mass == 1 else Side(first, np.zeros_like(second))
    formula = (formulas.free_numerator_1, formulas.free_numerator_2)[mass - 1]
    free = formula(plan.rates, motion_of(plan, state, u, side))
    later = choose(free.H2 != 0.0, free.H2, free.H1 - poles_of(plan, side).s_1 * free.H2)
    return np.asarray(np.where(free.H3 != 0.0, free.H3, later))


def _direction(chain: _Chain, mass: int) -> Array:
    """Where masses at rest go: held while |a_i| <= f_i; on the threshold the first non-zero derivative decides."""
    robot = chain.plan.robot
    acceleration = formulas.free_accelerations(chain.plan.rates, chain.state, chain.u)[mass - 1]
    acceleration = np.where(chain.alone == mass, chain.free, acceleration)
    friction = (robot.f1, robot.f2)[mass - 1]
    side = np.where(acceleration > friction, 1.0, np.where(acceleration < -friction, -1.0, 0.0)).astype(friction.dtype)
    if (tie := np.abs(acceleration) == friction).any():
        drift = _drift_of_free(chain, mass, tie)
        side[tie] = np.where(acceleration[tie] * drift >= 0.0, np.sign(drift), 0.0)
    if mass == 1:
        side[_blocked(chain, side)] = 0.0
    elif BODY_IS_FIXED:
        side[:] = 0.0
    return np.asarray(side)


def _settle(chain: _Chain, rests_1: NDArray[np.bool_], rests_2: NDArray[np.bool_]) -> None:
    """Sides of the masses that are at rest; twice, because each may depend on what the other one does."""
    for _ in range(2):
        if rests_1.any():
            first = np.where(rests_1, _direction(chain, 1), chain.side.first)
            chain.side = Side(first, chain.side.second)
        if rests_2.any():
            second = np.where(rests_2, _direction(chain, 2), chain.side.second)
            chain.side = Side(chain.side.first, second)


# ---- the end of a phase ----


class _End:
    """How phases end: when, by what, a threshold to which side, and the propagator there."""

    def __init__(self, limit: Array) -> None:
        self.t = limit.copy()
        self.kind = np.full(limit.shape, LIMIT)
        self.side = np.zeros_like(limit)
        self.touch = np.zeros_like(limit)  # how near x_1, where it turns, is to a stop that it touches
        self.propagator = np.zeros((7, limit.size), limit.dtype)


class _Events(NamedTuple):
    """The event functions of phases, take-off first, and what ends them in closed form.

    Not in it are the velocity of a mass that slips alone, whose time to rest is known, and what cannot happen while v_1
    and v_2 keep their signs. kind and side: of each slot. rest_time: when the mass that slips alone comes to rest, or
    y, which rings about 0, vanishes; rests: which of them.
    """

    of: EventSet
    kind: NDArray[np.intp]
    side: Array
    rest_time: Array
    rests: NDArray[np.intp]


def _rings_about_zero(chain: _Chain) -> NDArray[np.bool_]:
    """Where one mass is held and the forces on the other one cancel at y = 0, y rings about 0 as a velocity does: its
    first zero is known however far it has faded by then.
    """
    robot, (first, second) = chain.plan.robot, chain.side
    none = np.zeros_like(chain.t)
    free = formulas.free_accelerations(chain.plan.rates, LegState(none, none, none, none), chain.u)
    left = choose(second == 0.0, free.free_1 - first * robot.f1, free.free_2 - second * robot.f2)
    return np.asarray(((first == 0.0) != (second == 0.0)) & (left == 0.0) & (chain.state.y >= 0.0))


def _put_events(chain: _Chain, poles: Poles, motion: Motion) -> _Events:
    side, state, robot, rates = chain.side, chain.state, chain.plan.robot, chain.plan.rates
    held_1, held_2 = side.first == 0.0, side.second == 0.0
    never = NEVER[chain.t.dtype]
    numerator = np.zeros((3, SLOTS, chain.t.size), chain.t.dtype)
    start = np.ones((SLOTS, chain.t.size), chain.t.dtype)  # not active
    kind, towards = np.full(start.shape, LIMIT), np.zeros_like(start)
    rest_time, rests = np.full_like(chain.t, never), np.full(chain.t.shape, LIMIT)

    def put(slot: int, lanes: NDArray[np.intp], what: tuple[Array, ...], sign: Array | float, now: Array) -> None:
        for row, field in zip(numerator, what, strict=True):
            row[slot, lanes] = (sign * field)[lanes]
        start[slot, lanes] = now[lanes]

    rings = _rings_about_zero(chain) if CONTACT_IS_COMPRESSION else np.zeros(chain.t.shape, dtype=bool)
    may_fall = (side.first < 0.0) | (side.second > 0.0) | (state.y < 0.0)  # else y rises
    leg = np.flatnonzero(
        np.array(not FOOT_IS_FIXED) & ~rings & (may_fall | (not CONTACT_IS_COMPRESSION)) & ~(held_1 & held_2)
    )
    put(0, leg, contact_numerator(robot, motion), 1.0, formulas.contact_of(robot, state))
    kind[0, leg] = TAKEOFF
    both = np.flatnonzero(~held_1 & ~held_2)
    slips = (
        (1, VELOCITY_1, side.first, state.v1, chain.fresh_1),
        (2, VELOCITY_2, side.second, state.v2, chain.fresh_2),
    )
    for slot, velocity, sign, v, fresh in slips:
        H3, H2, H1 = motion[3 * slot - 3 : 3 * slot]
        put(slot, both, (np.where(fresh, 0.0, H3), H2, H1), sign, sign * v)
        kind[slot, both] = velocity
        alone = np.flatnonzero((sign != 0.0) & (side[2 - slot] == 0.0))
        sign_1 = sign[alone]
        rest_time[alone] = time_to_rest(take(poles, alone), sign_1 * v[alone], sign_1 * H3[alone])
        rests[alone] = velocity
    if (held_1 != held_2).any():
        free = formulas.free_accelerations(rates, state, chain.u)
        holds = (
            (held_1 & ~held_2, THRESHOLD_1, formulas.free_numerator_1, free.free_1, robot.f1, rates.a1_y, rates.a1_v2),
            (held_2 & ~held_1, THRESHOLD_2, formulas.free_numerator_2, free.free_2, robot.f2, rates.a2_y, rates.a2_v1),
        )
        for held, threshold, formula, acceleration, friction, per_y, per_v in holds:
            # Where it changes with y alone, which is monotone then, to the side that it goes towards.
            goes = choose(per_v == 0.0, np.sign(per_y) * (side.first - side.second), 0.0)
            slips_by = formula(rates, motion)
            for slot, goal in ((1, -1.0), (2, 1.0)):
                open_ = held & (goes != -goal)
                if threshold == THRESHOLD_1:  # a stop holds on its side whatever the force
                    open_ &= ~_blocked(chain, np.full_like(goes, goal))
                elif BODY_IS_FIXED:
                    open_ &= False
                lanes = np.flatnonzero(open_)
                put(slot, lanes, slips_by, -goal, friction - goal * acceleration)
                kind[slot, lanes], towards[slot, lanes] = threshold, goal
    if rings.any():
        lift = np.full_like(rest_time, never)
        lift[rings] = time_to_rest(take(poles, rings), state.y[rings], (state.v1 - state.v2)[rings])
        rests[rings & (lift <= rest_time)] = TAKEOFF
        rest_time = np.minimum(rest_time, lift)
    return _Events(EventSet(np.array(poles), node_of(poles), numerator, start), kind, towards, rest_time, rests)


def _grazing_tolerance(from_stop: LegState, motion: Motion, basis: Basis) -> Array:
    """An extremum of x_1, counted from a stop, that is this near to it is a grazing contact: 16 ulp of the terms."""
    terms = (
        from_stop.x1, from_stop.v1 * basis.Wd, motion.N2_1 * basis.W, motion.N1_1 * basis.W1, motion.N0_1 * basis.W2,
    )  # fmt: skip
    return np.asarray(16.0 * EPS[from_stop.x1.dtype] * sum(np.abs(term) for term in terms))


def _from_stop(chain: _Chain, lanes: NDArray[np.intp]) -> LegState:
    """The states that phases start from, x_1 counted from the stop ahead."""
    gap = choose(chain.side.first > 0.0, chain.from_max, chain.from_min)
    return take(chain.state._replace(x1=gap), lanes)


def _meets_stop(chain: _Chain, motion: Motion, on: Interval, lanes: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Where x_1, monotone within a phase, is beyond the stop ahead at the end of an interval, and does not just touch:
    the interval ends where it meets it.
    """
    met = np.zeros(on.lane.shape, dtype=bool)
    own = on.lane[lanes]
    near = np.flatnonzero((chain.side.first[own] != 0.0) & np.isfinite(_from_stop(chain, own).x1))
    if not near.size:
        return met
    lanes, own = lanes[near], own[near]
    start, by, basis, sign = (
        _from_stop(chain, own),
        take(motion, own),
        basis_of(on.propagator[:, lanes]),
        chain.side.first[own],
    )
    beyond = sign * formulas.state_at(start, by, basis).x1_t
    some = np.flatnonzero((beyond > 0.0) & (beyond > _grazing_tolerance(start, by, basis)))
    if not some.size:
        return met
    lanes, start, by, sign = lanes[some], take(start, some), take(by, some), sign[some]

    def curve(places: NDArray[np.intp], propagator: Array) -> tuple[Array, Array]:
        """How far x_1 is short of the stop."""
        own = take(by, places)
        x_1, v_1 = formulas.state_at(take(start, places), own, basis_of(propagator))[:2]
        rates = (
            own.H3_1 * propagator[n] + own.H2_1 * propagator[n - 1] + own.H1_1 * propagator[n - 2] for n in (4, 5, 6)
        )
        rate, curvature, third = rates
        return -sign[places] * np.array([x_1, v_1, rate, curvature]), third

    high, at_high = on.high[lanes], on.propagator[:, lanes]
    guess = high - step_to_root(curve(np.arange(lanes.size), at_high)[0])
    on.high[lanes], on.propagator[:, lanes] = root_between(
        on.of.poles[:, lanes], curve, np.zeros_like(high), high, at_high, guess
    )
    lifts = (on.found[lanes] == 0) & (high <= on.high[lanes] * (1.0 + 8.0 * EPS[high.dtype]))
    met[lanes] = ~lifts
    return met


def _cross_at_the_limit(events: _Events, on: Interval, certified: NDArray[np.bool_]) -> None:
    """At the time of the limit a take-off comes before it, and before mass 2 comes to rest what mass 1 does."""
    lanes = np.flatnonzero(certified & ~on.is_quiet & (on.found < 0) & ~(on.high < on.limit))
    if not lanes.size:
        return
    own = on.lane[lanes]
    rests_2 = (events.rests[own] == VELOCITY_2) & ~(events.rest_time[own] > on.limit[lanes])
    is_first = (events.kind[:, own] == TAKEOFF) | ((events.kind[:, own] == THRESHOLD_1) & rests_2)
    crosses = is_first & crosses_at_limit(on.end[..., lanes], on.rounding[:, lanes], on.limit[lanes])
    on.found[lanes] = np.where(crosses.any(axis=0), crosses.argmax(axis=0), -1)


def _sharpen_takeoff(chain: _Chain, on: Interval, certified: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Take-offs late in a phase: their times with all their digits. True where they come later, so that something else
    may come first.
    """
    later = np.zeros(certified.shape, dtype=bool)
    lanes = np.flatnonzero(certified & (on.found == 0) & ~on.is_late & (np.abs(on.propagator[4]) < 0.25))
    if not lanes.size:
        return later
    own = on.lane[lanes]
    plan, of = plan_lanes(chain.plan, own), on.of.at(0, lanes)
    slack = LegState(*(np.zeros(lanes.size, on.high.dtype) for _ in LegState._fields))
    motion, poles = motion_of(plan, slack, chain.u[own], take(chain.side, own)), Poles(*of.poles)
    slow = poles.s_3 > 0.0
    draws = choose(slow, poles.s_3, poles.s_2)  # 0: nothing that is left of k draws y
    settled: Array = choose(slow, motion.H1_y, motion.H2_y) / choose(draws > 0.0, draws, np.ones_like(draws))
    settled = choose(draws > 0.0, settled, np.full_like(draws, NEVER[draws.dtype]))
    settled = formulas.contact_of(plan.robot, slack._replace(y=settled))
    before = on.high[lanes]
    for _ in range(4):
        t = on.high[lanes]
        correction = steady_state_correction(of, settled, basis_of(on.propagator[:, lanes]), t)
        moved = (correction != 0.0) & (t + correction <= on.limit[lanes])
        if not moved.any():
            break
        where, t = lanes[moved], (t + correction)[moved]
        on.high[where], on.propagator[:, where] = t, propagator_at(of.poles[:, moved], t)
    later[lanes] = on.is_late[lanes] = on.high[lanes] > before
    return later


def _close(events: _Events, on: Interval, lanes: NDArray[np.intp], stops: NDArray[np.bool_], end: _End) -> None:
    """What ends phases at the ends of their last intervals."""
    own, t, found, limit = on.lane[lanes], on.high[lanes], on.found[lanes], on.limit[lanes]
    rests = ~(events.rest_time[own] > limit) & ~(t < limit * (1.0 - 8.0 * EPS[t.dtype]))
    kind = np.where(rests, events.rests[own], LIMIT)
    wins = rests & (events.rests[own] != VELOCITY_2) & (found != 0)  # over mass 2 at the same time, not over take-off
    root = (found >= 0) & ~wins
    kind[root], end.side[own[root]] = events.kind[found[root], own[root]], events.side[found[root], own[root]]
    kind[found == UNKNOWN] = UNCERTIFIED
    kind[stops[lanes]] = STOP
    end.t[own], end.kind[own], end.propagator[:, own] = t, kind, on.propagator[:, lanes]


def _find_end(chain: _Chain, poles: Poles, motion: Motion, until: Array) -> _End:
    """The first event of the phases that start at the chain's states."""
    events = _put_events(chain, poles, motion)
    limit = np.minimum(events.rest_time, until)
    end, on = _End(limit), first_interval(events.of, limit)
    stops, ended = np.zeros(limit.shape, dtype=bool), (on.found >= 0) | ~(limit > 0.0)
    on.high[ended] = 0.0
    while True:
        _close(events, on, np.flatnonzero(ended), stops, end)
        on = on.only(np.flatnonzero(~ended))
        if not on.lane.size:
            break
        certified = find_first_root(on)
        _cross_at_the_limit(events, on, certified)
        certified &= ~_sharpen_takeoff(chain, on, certified)
        stops = _meets_stop(chain, motion, on, np.flatnonzero(certified))
        ended = certified & (stops | (on.found >= 0) | ~(on.high < on.limit))
        begin_interval(on, np.flatnonzero(certified & ~ended))
        ended |= give_up(on, ended)
    lanes = np.flatnonzero(end.kind == VELOCITY_1)
    ahead = _from_stop(chain, lanes)
    near = _grazing_tolerance(ahead, take(motion, lanes), basis_of(end.propagator[:, lanes]))
    end.touch[lanes] = np.where(np.isfinite(ahead.x1), near, 0.0)
    return end


# ---- the chain ----


class _Log:
    """Phases in the order in which they were found."""

    def __init__(self) -> None:
        self.parts: list[Phases] = []

    def add(self, chain: _Chain, lanes: NDArray[np.intp], event: NDArray[Any]) -> None:
        if not lanes.size:
            return
        mode = 3 * (chain.side.first[lanes] + 1) + chain.side.second[lanes] + 1
        state = take(chain.state, lanes)
        self.parts.append(
            Phases(
                chain.lane[lanes],
                chain.t[lanes],
                *state[:4],
                mode.astype(np.int8),
                event.astype(np.int8),
                chain.step[lanes],
            )
        )
        chain.count[lanes] += 1

    def phases(self) -> Phases:
        columns = [np.concatenate(column) for column in zip(*self.parts, strict=True)]
        order = np.argsort(columns[0], kind="stable")
        return Phases(*(column[order] for column in columns))


def _after_rest(chain: _Chain, log: _Log, mass: int, lanes: NDArray[np.intp], sticks: Array, reverses: Array) -> None:
    """Modes of masses that have just come to rest; they stick, reverse, or go on after a touch."""
    before = chain.side[mass - 1][lanes]
    rests = np.zeros(chain.t.shape, dtype=bool)
    rests[lanes] = True
    none = np.zeros_like(rests)
    _settle(chain, *((rests, none) if mass == 1 else (none, rests)))
    after = chain.side[mass - 1][lanes]
    log.add(chain, lanes, np.where(after == 0.0, sticks, np.where(after != before, reverses, 0)))


def _rest_of_actuator(chain: _Chain, log: _Log, end: _End) -> None:
    lanes = np.flatnonzero((end.kind == VELOCITY_1) | (end.kind == STOP))
    if not lanes.size:
        return
    robot = chain.plan.robot
    stop = choose(chain.side.first > 0.0, robot.x1_max, robot.x1_min)[lanes]
    gap = choose(chain.side.first > 0.0, chain.from_max, chain.from_min)[lanes]
    hits = end.kind[lanes] == STOP
    there = hits | (
        np.abs(gap) <= end.touch[lanes]
    )  # one that it touches where it turns is no event, but that is where it is
    chain.state.v1[lanes] = 0.0
    chain.state.x1[lanes[there]] = stop[there]
    chain.from_min[lanes[there]] = stop[there] - robot.x1_min[lanes[there]]
    chain.from_max[lanes[there]] = stop[there] - robot.x1_max[lanes[there]]
    sticks = np.where(hits, _EVENT["x1_hits_stop"], _EVENT["x1_sticks"])
    reverses = np.where(hits, _EVENT["x1_hits_stop"], _EVENT["x1_reverses"])
    _after_rest(chain, log, 1, lanes, sticks, reverses)


def _rest_of_body(chain: _Chain, log: _Log, end: _End) -> None:
    lanes = np.flatnonzero(end.kind == VELOCITY_2)
    if lanes.size:
        chain.state.v2[lanes] = 0.0
        sticks, reverses = np.full(lanes.shape, _EVENT["x2_sticks"]), np.full(lanes.shape, _EVENT["x2_reverses"])
        _after_rest(chain, log, 2, lanes, sticks, reverses)


def _slip(chain: _Chain, log: _Log, end: _End) -> None:
    for kind, mass, word in ((THRESHOLD_1, 0, "x1_slips"), (THRESHOLD_2, 1, "x2_slips")):
        lanes = np.flatnonzero(end.kind == kind)
        chain.side[mass][lanes] = end.side[lanes]
        log.add(chain, lanes, np.full(lanes.shape, _EVENT[word]))


def _next_step(chain: _Chain, log: _Log, end: _End) -> None:
    """The current takes its next value: what is held may begin to slip."""
    going = end.kind == LIMIT
    if not going.any():
        return
    chain.step = chain.step + going
    held_1, held_2 = going & (chain.side.first == 0.0), going & (chain.side.second == 0.0)
    _settle(chain, held_1, held_2)
    slips_1, slips_2 = held_1 & (chain.side.first != 0.0), held_2 & (chain.side.second != 0.0)
    lanes = np.flatnonzero(going)
    event = np.where(slips_1, _EVENT["x1_slips"], np.where(slips_2, _EVENT["x2_slips"], 0))
    log.add(chain, lanes, event[lanes])
    both = np.flatnonzero(slips_1 & slips_2)
    log.add(chain, both, np.full(both.shape, _EVENT["x2_slips"]))


def _keep_free_accelerations(chain: _Chain, motion: Motion, basis: Basis, end: _End) -> None:
    """A mass that rings alone fades far below the digits of the state; its acceleration at rest is known from the
    motion.

    Without friction nothing but the sign is left of it in the end, and that is kept.
    """
    chain.alone, chain.free = np.zeros_like(chain.alone), np.zeros_like(chain.free)
    for mass, kind, friction in ((1, VELOCITY_1, chain.plan.robot.f1), (2, VELOCITY_2, chain.plan.robot.f2)):
        lanes = np.flatnonzero((end.kind == kind) & (chain.side[2 - mass] == 0.0))
        H3, H2 = (field[lanes] for field in motion[3 * (mass - 1) : 3 * mass - 1])
        back = np.maximum(np.abs(H3 * basis.Wdd[lanes] + H2 * basis.Wd[lanes]), UNDERFLOW[chain.free.dtype])
        chain.alone[lanes], chain.free[lanes] = mass, chain.side[mass - 1][lanes] * (friction[lanes] - back)
    _keep_faint_accelerations(chain, motion, basis, end)


def _keep_faint_accelerations(chain: _Chain, motion: Motion, basis: Basis, end: _End) -> None:
    """An actuator without any friction that stops while the forces on it cancel to all digits of the state.

    What is left of them is its acceleration before, known from the motion where that has faded.
    """
    rates = chain.plan.rates
    slides = ((end.kind == VELOCITY_1) | (end.kind == STOP)) & (chain.side.first != 0.0) & (chain.side.second != 0.0)
    slides &= (chain.plan.robot.f1 <= 0.0) & (rates.a1_v1 == 0.0)
    if not slides.any():
        return
    eps = np.finfo(chain.free.dtype).eps
    free = formulas.free_accelerations(rates, chain.state, chain.u).free_1
    terms = np.array([motion.H3_1 * basis.Wdd, motion.H2_1 * basis.Wd, motion.H1_1 * basis.W])
    rate: Array = terms[0] + terms[1] + terms[2]
    slides &= np.abs(free) < 64.0 * eps * np.abs(rates.a1_y * chain.state.y)
    slides &= np.abs(rate) > 16.0 * eps * np.abs(terms).sum(axis=0)
    chain.alone[slides], chain.free[slides] = 1, rate[slides]


def _motion_from(chain: _Chain) -> Motion:
    """The numerators of the next phases."""
    motion = motion_of(chain.plan, chain.state, chain.u, chain.side)
    robot = chain.plan.robot
    for mass, start, friction in ((1, motion.H3_1, robot.f1), (2, motion.H3_2, robot.f2)):
        lanes = np.flatnonzero((chain.alone == mass) & (chain.side[mass - 1] != 0.0))
        start[lanes] = (chain.free - chain.side[mass - 1] * friction)[lanes]
        only = lanes[chain.side[2 - mass][lanes] == 0.0]
        motion.H2_y[only] = start[only] if mass == 1 else -start[only]
        if mass == 1:
            motion.N2_1[lanes] = start[lanes]  # v_1 is 0
    return motion


def _pass(chain: _Chain, log: _Log, end: _End) -> None:
    """The states and modes right after the end of a phase, recorded as the next phase."""
    chain.fresh_1, chain.fresh_2 = end.kind == THRESHOLD_1, end.kind == THRESHOLD_2
    chain.side = Side(chain.side.first.copy(), chain.side.second.copy())
    _rest_of_actuator(chain, log, end)
    _rest_of_body(chain, log, end)
    _slip(chain, log, end)
    _next_step(chain, log, end)


def _leaves_at_once(chain: _Chain) -> NDArray[np.bool_]:
    """The leg leaves the ground at once: it pulls, or its contact force is 0 and the first non-zero derivative of that
    is negative.
    """
    contact = formulas.contact_of(chain.plan.robot, chain.state)
    leg = contact_numerator(chain.plan.robot, motion_of(chain.plan, chain.state, chain.u, chain.side))
    first = choose(leg.H3 != 0.0, leg.H3, choose(leg.H2 != 0.0, leg.H2, leg.H1))
    return np.asarray((not FOOT_IS_FIXED) & ((contact < 0.0) | ((contact == 0.0) & (first < 0.0))))


def _begin(chain: _Chain, log: _Log) -> Array:
    """What each mass does at the start, no event; returns the energy lost at stops."""
    robot, v1 = chain.plan.robot, chain.state.v1
    chain.side = Side(np.sign(v1), np.sign(chain.state.v2))
    struck = (chain.side.first != 0.0) & _blocked(chain, chain.side.first)
    loss = np.where(struck, -0.5 * robot.m_eff * v1 * v1, 0.0).astype(v1.dtype)
    chain.state = chain.state._replace(v1=np.where(struck, 0.0, v1).astype(v1.dtype))
    chain.side = Side(np.where(struck, 0.0, chain.side.first).astype(v1.dtype), chain.side.second)
    _settle(chain, chain.side.first == 0.0, chain.side.second == 0.0)
    log.add(chain, np.arange(chain.t.size), np.zeros(chain.t.size))
    return loss


class _Result:
    """What is known of the lanes that have ended."""

    def __init__(self, like: Array) -> None:
        self.duration, self.ending = np.zeros_like(like), np.zeros(like.shape, dtype=np.int64)
        self.state = LegState(*(np.zeros_like(like) for _ in LegState._fields))
        self.count = np.zeros(like.shape, dtype=np.int64)

    def close(self, chain: _Chain, lanes: NDArray[np.bool_], ending: str) -> None:
        where = chain.lane[lanes]
        self.duration[where], self.ending[where], self.count[where] = (
            chain.t[lanes],
            _ENDING[ending],
            chain.count[lanes],
        )
        for field, value in zip(self.state, chain.state, strict=True):
            field[where] = value[lanes]


def _run(chain: _Chain, log: _Log, result: _Result) -> Array:
    loss = _begin(chain, log)
    ended = _leaves_at_once(chain)
    result.close(chain, ended, "takeoff")
    chain = chain.only(~ended)
    while chain.t.size:
        rests = (chain.side.first == 0.0) & (chain.side.second == 0.0) & chain.last_step
        result.close(chain, rests, "rest")
        chain = chain.only(~rests)
        if not chain.t.size:
            break
        next_times = np.append(chain.u_times, chain.u_times.dtype.type(NEVER[chain.t.dtype]))
        until = np.minimum(next_times[chain.step + 1], chain.horizon)
        poles = poles_of(chain.plan, chain.side)
        motion = _motion_from(chain)
        end = _find_end(chain, poles, motion, until - chain.t)
        basis = basis_of(end.propagator)
        moved = formulas.state_at(chain.state._replace(x1=np.zeros_like(chain.t)), motion, basis).x1_t
        moved[chain.side.first == 0.0] = 0.0
        chain.from_min, chain.from_max = chain.from_min + moved, chain.from_max + moved
        chain.state = arrive(chain.state, motion, basis, chain.side)
        chain.t = np.where(end.kind == LIMIT, until, chain.t + end.t)
        lifts = end.kind == TAKEOFF
        if CONTACT_IS_COMPRESSION:
            chain.state.y[lifts] = 0.0
        over, failed = (end.kind == LIMIT) & ~(until < chain.horizon), end.kind == UNCERTIFIED
        result.close(chain, lifts, "takeoff")
        result.close(chain, failed, "uncertified")
        result.close(chain, over, "horizon")
        end.kind[over] = TAKEOFF
        _keep_free_accelerations(chain, motion, basis, end)
        _pass(chain, log, end)
        if not CONTACT_IS_COMPRESSION and not FOOT_IS_FIXED:  # what v_1 has lost at a stop was in the contact force
            lost = (end.kind == STOP) & (formulas.contact_of(chain.plan.robot, chain.state) < 0.0)
            result.close(chain, lost, "takeoff")
            lifts |= lost
        over |= failed
        full = (chain.count > chain.max_phases) & ~lifts & ~over
        result.close(chain, full, "too_many_phases")
        result.count[chain.lane[full]] = chain.max_phases  # a step of the current may have begun two
        chain = chain.only(~(lifts | over | full))
    return loss


def _add_up(plan: Plan, start: LegState, u_values: Array, phases: Phases, duration: Array, aed: Array) -> None:
    """The AED as the sum of its entries where it is the difference of energies that are much larger."""
    large = formulas.stored_energy(plan.robot, start) > 32.0 * plan.robot.m_s * (1.0 + start.v2 * start.v2)
    if not (index := np.flatnonzero(large[phases.lane])).size:
        return
    lane = phases.lane[index]
    last = np.append(phases.lane[1:] != phases.lane[:-1], True)[index]
    following = np.minimum(index + 1, phases.lane.size - 1)
    t = np.where(last, duration[lane], phases.t[following]) - phases.t[index]
    own = take(phases, index)
    state = LegState(own.x1, own.v1, own.v2, own.y)
    ledger = ledger_over(plan_lanes(plan, lane), state, u_values[lane, own.step], sides_of(own.mode, t.dtype), t)
    aed[large] = np.bincount(lane, formulas.aed_of_ledger(ledger), aed.size)[large]


def solve(
    robot: Robot,
    start: LegState,
    u: ArrayLike = 0.0,
    u_times: ArrayLike = (0.0,),
    horizon: ArrayLike = 2.0,
    max_phases: int = 4096,
    dtype: type[np.floating] = np.float64,
) -> Solution:
    """Solve stances; every field of `robot` and `start`, u and horizon broadcast against each other.

    start: states after the impact, y = 0 at touchdown [m, m/s]. u [A]: the current, with a further last axis over
    `u_times` [s] if those are several; they start at 0 and increase. horizon [s]: the longest time. max_phases: the
    cap after which a stance ends as too_many_phases.
    An unstable robot is a ValueError; no other input is checked here: hopform does that.
    """
    times = np.asarray(u_times, dtype=dtype)
    values = np.asarray(u, dtype=dtype)
    if times.size == 1:
        values = values[..., np.newaxis]
    inputs = [np.asarray(field, dtype=dtype) for field in (*robot, *start, horizon)]
    shape = np.broadcast_shapes(*(field.shape for field in inputs), values.shape[:-1])
    flat = [np.broadcast_to(field, shape).reshape(-1).copy() for field in inputs]
    values = np.broadcast_to(values, (*shape, times.size)).reshape(-1, times.size)
    robots, first = Robot(*flat[: len(robot)]), LegState(*flat[len(robot) : -1])
    plan, like = plan_of(robots), flat[0]
    nothing = np.zeros(like.shape, dtype=bool)
    counts = np.zeros(like.shape, dtype=np.int64)
    side = Side(np.zeros_like(like), np.zeros_like(like))
    chain = _Chain(
        plan, times, values, flat[-1], max_phases, np.arange(like.size), LegState(*(field.copy() for field in first)),
        first.x1 - robots.x1_min, first.x1 - robots.x1_max, side,
        np.zeros_like(like), counts.copy(), nothing, nothing, counts.copy(), np.zeros_like(like), counts.copy(),
    )  # fmt: skip
    log, result = _Log(), _Result(like)
    loss = _run(chain, log, result)
    end = result.state
    aed = formulas.body_energy_gain(robots, first, At(*end))
    lifts = (result.ending == _ENDING["takeoff"]) & (formulas.fall_of(robots) > 0.0)
    apex = np.full_like(like, np.nan)
    apex[lifts] = formulas.apex_of_takeoff(
        take(robots, lifts), end.x1[lifts], end.y[lifts], np.maximum(end.v2[lifts], 0.0)
    )
    phases = log.phases()
    kept = np.arange(phases.lane.size) - np.searchsorted(phases.lane, phases.lane) < result.count[phases.lane]
    phases = take(phases, kept)
    _add_up(plan, first, values, phases, result.duration, aed)
    return Solution(
        shape, plan, times, values, first, result.duration.reshape(shape),
        LegState(*(np.reshape(field, shape) for field in end)), apex.reshape(shape), np.reshape(aed, shape),
        loss.reshape(shape), result.ending.reshape(shape), result.count.reshape(shape), phases,
    )  # fmt: skip


def state_at(solution: Solution, lane: int, t: ArrayLike) -> LegState:
    """States of one lane at times t [s], 0 <= t <= duration, in t's shape; after rest the state stays."""
    times, first, within = locate(solution, lane, t)
    phases = take(solution.phases, first)
    one = np.full(times.size, lane)
    side = sides_of(phases.mode, times.dtype)
    state = state_in_phase(
        plan_lanes(solution.plan, one),
        LegState(phases.x1, phases.v1, phases.v2, phases.y),
        solution.u_values[lane][phases.step],
        side,
        within,
    )
    return LegState(*(np.reshape(field, np.shape(t)) for field in state))


def locate(solution: Solution, lane: int, t: ArrayLike) -> tuple[Array, NDArray[np.intp], Array]:
    """Times up to the end, the index of the phase that each falls into, and the time since that phase began."""
    duration = solution.duration.reshape(-1)[lane]
    times = np.minimum(np.asarray(t, dtype=solution.duration.dtype).reshape(-1), duration)
    first = int(np.searchsorted(solution.phases.lane, lane))
    count = int(solution.phase_count.reshape(-1)[lane])
    starts = solution.phases.t[first : first + count]
    index = first + np.searchsorted(starts, times, side="right") - 1
    return times, index, times - solution.phases.t[index]


def sides_of(mode: NDArray[np.int8], dtype: Any) -> Side:
    return Side((mode // 3 - 1).astype(dtype), (mode % 3 - 1).astype(dtype))
