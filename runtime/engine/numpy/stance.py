# SPDX-License-Identifier: MIT-0
"""Stances as chains of phases: each is linear, has its closed form, and ends at the first of the events in which an
element reverses, sticks, slips or hits a stop, or in which the contact force returns to zero. All lanes advance
together, each through its own events. Arrays of two axes have a row for each element, or for each axis of the state.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform_solver import elements, events, formulas
from hopform_solver.elements import COMPRESSION, ELEMENTS, FOLLOWS, MODES, NUMERATORS, POSITION, STOPPED, STOPS, Phases
from hopform_solver.lanes import Array, Flags, Numbers, choose, lanes_in, take
from hopform_solver.ledgers import ledger_over
from hopform_solver.limits import CONTACT_IS_COMPRESSION, EPS, FOOT_IS_FIXED, NEVER, UNDERFLOW
from hopform_solver.phases import Phase, Plan, arrive, drive_of, motion_of, plan_of, poles_of, state_in_phase
from hopform_solver.records import ENDINGS, At, Basis, LegState, Motion, Poles, Robot

ENDING: dict[str, int] = {text: number for number, text in ENDINGS.items()}
"""The numbers of endings."""

ELEMENT = np.arange(len(ELEMENTS))[:, np.newaxis]
VELOCITIES = [each.velocity for each in ELEMENTS]
TERMS = np.array([[NUMERATORS[axis] + n for n in range(3)] for axis in VELOCITIES])
"""Of each element the axis of its velocity, and its terms in Motion."""
COMPRESSION_FOLLOWS = np.array(FOLLOWS[COMPRESSION], np.int8)[:, np.newaxis]
FIXED = np.array([[each.is_fixed] for each in ELEMENTS])
REVERSES, STICKS, SLIPS, HITS_STOP = (
    np.array([[getattr(each, what)] for each in ELEMENTS], np.int8)
    for what in ("reverses", "sticks", "slips", "hits_stop")
)
DIGIT = 3 ** (len(ELEMENTS) - 1 - ELEMENT)
"""A mode as one number: the signs of the velocities, 1 added, are its digits."""

UNCERTIFIED, TAKEOFF, LIMIT = -1, 0, 1
VELOCITY, THRESHOLD, STOP = 2 + 2 * ELEMENT, 3 + 2 * ELEMENT, 2 + 2 * len(ELEMENTS) + ELEMENT
"""What ends phases, in the order in which it wins a tie: take-off, the limit, and of each element that its velocity
vanishes, or that a force reaches its friction. A stop is met where its position is beyond it, whatever else there is.
"""


@dataclass(frozen=True)
class Solution:
    """Stances, solved; every array has one entry per lane, in the shape that the inputs broadcast to.

    duration [s], end: the state at the ending, apex [m] (NaN without take-off), aed [J], start_loss [J] the energy lost
    at a stop at t = 0, ending (a key of ENDINGS), phase_count, phases: where each phase starts, in which mode, by which
    event.
    """

    shape: tuple[int, ...]
    plan: Plan
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

    @property
    def first(self) -> Numbers:
        """The first phase of each lane."""
        return np.asarray(np.cumsum(self.phase_count) - self.phase_count.reshape(-1))

    @property
    def lengths(self) -> Array:
        """How long each phase lasts [s]."""
        ends = np.append(self.phases.t[1:], self.duration.dtype.type(0.0))
        ends[np.cumsum(self.phase_count) - 1] = self.duration.reshape(-1)
        return np.asarray(ends - self.phases.t)

    def phase(self, index: Numbers) -> Phase:
        """Phases by their numbers."""
        lane, _, *state, mode, _, step = take(self.phases, index)
        side = (mode // DIGIT % 3 - 1).astype(self.duration.dtype)
        return Phase(take(self.plan, lane), LegState(*state), self.u_values[lane, step], side)


class _Chain(NamedTuple):
    """The lanes that are still going; `lane` says which of the caller's each one is."""

    lane: Numbers
    plan: Plan
    u_values: Array
    horizon: Array
    state: Array
    gap: Array  # (2, lanes), the position from its stops: it has no digits itself for what is this close to one
    side: Array
    t: Array
    step: NDArray[np.int64]
    just_slips: Flags
    is_known: Flags  # of an element that has just come to rest: its free acceleration, from the motion
    free: Array  # this acceleration, from before the state lost its digits
    counted: NDArray[np.int64]

    @property
    def phase(self) -> Phase:
        u = self.u_values[self.step, np.arange(self.step.size)]
        return Phase(self.plan, LegState(*self.state), u, self.side)

    @property
    def friction(self) -> Array:
        return np.array([*formulas.friction_of(self.plan.robot)])

    @property
    def gap_ahead(self) -> Array:
        """The position, counted from the stop to which its element moves."""
        return choose(self.side[STOPPED] > 0.0, self.gap[1], self.gap[0])


# ---- the hold rule ----


def _blocked(chain: _Chain, side: Array | float) -> Flags:
    """What a stop, or the ground that it is bolted to, keeps from moving to a side."""
    below, above = (ELEMENT == STOPPED) & (chain.gap[0] <= 0.0), (ELEMENT == STOPPED) & (chain.gap[1] >= 0.0)
    return np.asarray(FIXED | ((side < 0.0) & below) | ((side > 0.0) & above))


def _drift_of_free(phase: Phase, element: int) -> Array:
    """First non-zero derivative of the free acceleration of an element that is held."""
    phase.side[element] = 0.0
    free = ELEMENTS[element].free_numerator(phase.plan.rates, motion_of(phase))
    later = choose(free.H2 != 0.0, free.H2, free.H1 - poles_of(phase.plan, phase.side).s_1 * free.H2)
    return choose(free.H3 != 0.0, free.H3, later)


def _settle(chain: _Chain, rests: Flags) -> None:
    """Where elements at rest go: held while |a_i| <= f_i; on the threshold the first non-zero derivative decides.

    This is done twice, because it may depend on what the others do.
    """
    friction, phase = chain.friction, chain.phase
    free = choose(chain.is_known, chain.free, _free_accelerations(phase))
    chain.side[rests] = choose(np.abs(free) > friction, np.sign(free), 0.0)[rests]
    ties = rests & (np.abs(free) == friction)
    for element in 2 * [*range(len(ELEMENTS))] if ties.any() else ():
        tie = np.flatnonzero(ties[element])
        drift = _drift_of_free(take(phase, tie), element)
        chain.side[element, tie] = choose(free[element, tie] * drift >= 0.0, np.sign(drift), 0.0)
        chain.side[rests & _blocked(chain, chain.side)] = 0.0
    chain.side[rests & _blocked(chain, chain.side)] = 0.0


def _free_accelerations(phase: Phase) -> Array:
    return np.array([*formulas.free_accelerations(phase.plan.rates, phase.start, phase.u)])


# ---- the end of a phase ----


class _End(NamedTuple):
    """How phases end: when, by what, a threshold to which side, and the propagator there."""

    t: Array
    kind: Numbers
    side: Array
    propagator: Array


class _Guards(NamedTuple):
    """The event functions of phases, take-off first, and what ends them in closed form.

    Not in it are the velocity of an element that slips alone, whose time to rest is known, and what cannot happen while
    velocities keep their signs. kind and side: of each slot. rest_time: when the element that slips alone comes to
    rest, or compression, which rings about 0, vanishes; rests: which of them. stop: how far the position is from
    the stop ahead.
    """

    of: events.EventSet
    kind: Numbers
    side: Array
    rest_time: Array
    rests: Numbers
    stop: events.EventSet


def _put_guards(chain: _Chain, poles: Poles, motion: Motion) -> _Guards:
    side, state, phase, robot = chain.side, chain.state, chain.phase, chain.plan.robot
    shape, dtype, terms = (events.SLOTS, chain.t.size), chain.t.dtype, np.array(motion)
    numerator, start, kind = np.zeros((3, *shape), dtype), np.ones(shape, dtype), np.full(shape, LIMIT)  # not active
    towards, free = np.zeros(shape, dtype), _free_accelerations(phase)
    rest_time, rests, rings = _closed_forms(chain, poles, terms)
    contact, falls = state[COMPRESSION], (COMPRESSION_FOLLOWS * side < 0.0).any(axis=0)
    leg = (falls | (contact < 0.0) | (not CONTACT_IS_COMPRESSION)) & ~rings & (side != 0.0).any(axis=0)  # else it rises
    lanes = np.flatnonzero(leg & (not FOOT_IS_FIXED))
    numerator[:, 0, lanes] = take(np.array(formulas.contact_numerator(robot, motion)), lanes)
    start[0, lanes], kind[0, lanes] = formulas.contact_of(robot, phase.start)[lanes], TAKEOFF
    for mode in MODES:
        here = lanes_in(mode.slips, side)
        for slot, (element, goal) in enumerate(mode.guards, 1):
            lanes = np.flatnonzero(here & ~_blocked(chain, goal)[element])
            if goal:
                of = -goal * np.array(ELEMENTS[element].free_numerator(chain.plan.rates, motion))
                now = chain.friction[element] - goal * free[element]
            else:
                of, now = side[element] * terms[TERMS[element]], side[element] * state[VELOCITIES[element]]
                of[0, chain.just_slips[element]] = 0.0
            numerator[:, slot, lanes], start[slot, lanes] = of[:, lanes], now[lanes]
            kind[slot, lanes], towards[slot, lanes] = (THRESHOLD if goal else VELOCITY)[element], goal
    rows, node = np.array(poles), events.node_of(poles)
    away = -side[STOPPED]
    stop = events.EventSet(rows, node, away * _position_terms(chain, terms), away * chain.gap_ahead)
    return _Guards(events.EventSet(rows, node, numerator, start), kind, towards, rest_time, rests, stop)


def _position_terms(chain: _Chain, terms: Array) -> Array:
    """What moves the position: the factors of W', W and the integrals of W."""
    return np.array([chain.state[VELOCITIES[STOPPED]], *terms[NUMERATORS[POSITION] :][:3]])


def _closed_forms(chain: _Chain, poles: Poles, terms: Array) -> tuple[Array, Numbers, Flags]:
    """When the element that slips alone comes to rest, or compression vanishes; which of them; where compression rings.

    Where the forces on the element that slips alone cancel without compression, that rings about 0 as a velocity does:
    its first zero is known however far it has faded by then.
    """
    side, state = chain.side, chain.state
    rest_time, rests = np.full_like(chain.t, NEVER[chain.t.dtype]), np.full(chain.t.shape, LIMIT)
    alone = (side != 0.0) & ((side != 0.0).sum(axis=0) == 1)
    if (lanes := np.flatnonzero(alone.any(axis=0))).size:
        rows = side * state[VELOCITIES], side * terms[TERMS[:, 0]], VELOCITY
        speed, rate, rests[lanes] = ((alone * each).sum(axis=0)[lanes] for each in rows)
        rest_time[lanes] = events.time_to_rest(take(poles, lanes), speed, rate)
    drive, contact = np.array(drive_of(chain.phase)), state[COMPRESSION]
    rings = (alone & (drive == 0.0)).any(axis=0) & (contact >= 0.0) & CONTACT_IS_COMPRESSION
    if rings.any():
        lift = events.time_to_rest(poles, contact, (COMPRESSION_FOLLOWS * state[VELOCITIES]).sum(axis=0))
        lifts = rings & (lift <= rest_time)
        rests[lifts], rest_time[lifts] = TAKEOFF, lift[lifts]
    return rest_time, rests, rings


def _meet_stops(guards: _Guards, on: events.Interval, certified: Flags) -> Numbers:
    """The stop that each lane meets, LIMIT where none. The position is monotone within a phase: one that is beyond its
    stop at the end of an interval, and does not just touch it, ends the interval where it meets it.
    """
    met = np.full(on.lane.shape, LIMIT)
    lanes = np.flatnonzero(certified & np.isfinite(guards.stop.start[on.lane]))
    of, (high, at_high) = take(guards.stop, on.lane[lanes]), take((on.high, on.propagator), lanes)
    short = events.jets_of(of, at_high)
    beyond = np.flatnonzero(short[0] < -events.rounding_of(of, at_high, high, 0.0 * high))
    if beyond.size:
        lanes, of, short, high, at_high = take((lanes, of, short, high, at_high), beyond)
        soon = np.sqrt(of.start / (of.start - short[0]))  # of the interval, under a huge force: each step takes 3/4
        guess = choose(soon < EPS[high.dtype], soon * high, high - events.step_to_root(short))
        found = events.root_between(of.poles, events.curve_of(of), np.zeros_like(high), high, at_high, guess)
        on.high[lanes], on.propagator[:, lanes] = found
        is_met = (on.found[lanes] != 0) | (high > on.high[lanes] * (1.0 + 8.0 * EPS[high.dtype]))
        met[lanes[is_met]] = STOP[STOPPED]
    return met


def _cross_at_the_limit(guards: _Guards, on: events.Interval, certified: Flags) -> None:
    """What comes first in a tie with the end of the limit is found at its time."""
    lanes = np.flatnonzero(certified & ~on.is_quiet & (on.found < 0) & ~(on.high < on.limit))
    own, limit = on.lane[lanes], on.limit[lanes]
    is_first = guards.kind[:, own] < np.where(guards.rest_time[own] > limit, LIMIT, guards.rests[own])
    value, rate = on.end[:2, :, lanes]
    crosses = is_first & (value < -8.0 * EPS[limit.dtype] * limit * rate)
    crosses &= rate * limit < -16.0 * on.rounding[:, lanes]
    on.found[lanes] = np.where(crosses.any(axis=0), crosses.argmax(axis=0), -1)


def _sharpen_takeoff(chain: _Chain, on: events.Interval, certified: Flags) -> Flags:
    """Take-offs late in a phase: their times with all their digits. True where they come later, so that something else
    may come first.
    """
    later = np.zeros(certified.shape, np.bool_)
    lanes = np.flatnonzero(certified & (on.found == 0) & ~on.is_late & (np.abs(on.propagator[4]) < 0.25))
    if not lanes.size:
        return later
    of, slack = on.of.at(0, lanes), np.zeros((len(chain.state), lanes.size), on.high.dtype)
    phase, poles = take(chain.phase, on.lane[lanes])._replace(start=LegState(*slack)), Poles(*of.poles)
    motion, slow = np.array(motion_of(phase))[NUMERATORS[COMPRESSION] :], poles.s_3 > 0.0
    draws = choose(slow, poles.s_3, poles.s_2)  # 0: nothing that is left of k draws it
    slack[COMPRESSION] = choose(draws > 0.0, choose(slow, motion[2], motion[1]) / draws, NEVER[draws.dtype])
    settled = formulas.contact_of(phase.plan.robot, LegState(*slack))
    before = on.high[lanes]
    for _ in range(4):
        t = on.high[lanes]
        correction = events.steady_state_correction(of, settled, Basis(*on.propagator[4::-1, lanes]), t)
        moved = (correction != 0.0) & (t + correction <= on.limit[lanes])
        if not moved.any():
            break
        where, t = lanes[moved], (t + correction)[moved]
        on.high[where], on.propagator[:, where] = t, events.propagator_at(of.poles[:, moved], t)
    later[lanes] = on.is_late[lanes] = on.high[lanes] > before
    return later


def _close(guards: _Guards, on: events.Interval, lanes: Numbers, stops: Numbers, end: _End) -> None:
    """What ends phases at the ends of their last intervals."""
    own, t, found, limit = on.lane[lanes], on.high[lanes], on.found[lanes], on.limit[lanes]
    rests = ~(guards.rest_time[own] > limit) & ~(t < limit * (1.0 - 8.0 * EPS[t.dtype]))
    kind, of_root = np.where(rests, guards.rests[own], LIMIT), guards.kind[found, own]
    root = (found >= 0) & ~(rests & (kind < of_root))
    kind[root], end.side[own[root]] = of_root[root], guards.side[found[root], own[root]]
    kind[found == events.UNKNOWN] = UNCERTIFIED
    end.kind[own] = np.where(stops[lanes] == LIMIT, kind, stops[lanes])
    end.t[own], end.propagator[:, own] = t, on.propagator[:, lanes]


def _find_end(chain: _Chain, poles: Poles, motion: Motion, until: Array) -> _End:
    """The first event of the phases that start at the chain's states."""
    guards = _put_guards(chain, poles, motion)
    limit, stops = np.minimum(guards.rest_time, until), np.full(until.shape, LIMIT)
    end = _End(limit.copy(), stops.copy(), np.zeros_like(limit), np.zeros((events.ORDERS, limit.size), limit.dtype))
    on = events.first_interval(guards.of, limit)
    ended = (on.found >= 0) | ~(limit > 0.0)
    on.high[ended] = 0.0
    while True:
        _close(guards, on, np.flatnonzero(ended), stops, end)
        on = take(on, ~ended)
        if not on.lane.size:
            break
        certified = events.find_first_root(on)
        _cross_at_the_limit(guards, on, certified)
        certified &= ~_sharpen_takeoff(chain, on, certified)
        stops = _meet_stops(guards, on, certified)
        ended = certified & ((stops != LIMIT) | (on.found >= 0) | ~(on.high < on.limit))
        events.begin_interval(on, np.flatnonzero(certified & ~ended))
        ended |= events.give_up(on, ended)
    return end


# ---- the chain ----

Log = list[tuple[Any, ...]]
"""Columns of Phases, or of what is known of lanes that have ended, in the order in which they are found."""


def _record(log: Log, chain: _Chain, lanes: Flags, event: NDArray[np.int8]) -> None:
    """The phases that begin now."""
    lane, t, state, step, side = take((chain.lane, chain.t, chain.state, chain.step, chain.side), lanes)
    mode = ((side + 1.0) * DIGIT).sum(axis=0).astype(np.int8)
    log.append((lane, t, *state, mode, event[lanes], step))
    chain.counted[lanes] += 1


def _keep_free_accelerations(chain: _Chain, motion: Motion, end: _End) -> None:
    """An element that rings alone fades far below the digits of the state; its acceleration at rest is known from the
    motion. Without friction nothing but the sign is left of it in the end, and that is kept.

    So is what is left of the forces on one without any friction that stops while they cancel to all digits of the
    state: its acceleration before, where that has faded.
    """
    side, friction, rates, eps = chain.side, chain.friction, chain.plan.rates, EPS[chain.t.dtype]
    terms = np.array(motion)[TERMS] * end.propagator[4:1:-1]
    rate, slip = terms.sum(axis=1), (side != 0.0).sum(axis=0)
    chain.is_known[...] = (end.kind == VELOCITY) & (slip == 1)
    chain.free[...] = side * (friction - np.maximum(np.abs(rate), UNDERFLOW[chain.t.dtype]))
    stops = ((end.kind == VELOCITY) | (end.kind == STOP))[STOPPED]
    stops &= (slip == len(ELEMENTS)) & (friction[STOPPED] <= 0.0)
    if stops.any():
        free = _free_accelerations(chain.phase)[STOPPED]
        moved = np.array(motion)[NUMERATORS[COMPRESSION] :][:3] * end.propagator[3:0:-1]
        compression = np.abs(chain.state[COMPRESSION]) + np.abs(moved).sum(axis=0)
        cancel = np.abs(free) < 64.0 * eps * np.abs(rates[elements.PER_COMPRESSION] * compression)
        faded = np.abs(rate[STOPPED]) > 16.0 * eps * np.abs(terms[STOPPED]).sum(axis=0)
        kept = stops & (rates[elements.PER_VELOCITY] == 0.0) & cancel & faded
        chain.is_known[STOPPED, kept], chain.free[STOPPED, kept] = True, rate[STOPPED, kept]


def _motion_from(chain: _Chain) -> Motion:
    """The numerators of the next phases."""
    motion = np.array(motion_of(chain.phase))
    for element, (first, *_) in enumerate(TERMS):
        lanes = np.flatnonzero(chain.is_known[element] & (chain.side[element] != 0.0))
        motion[first, lanes] = start = (chain.free - chain.side * chain.friction)[element, lanes]
        alone = (chain.side[:, lanes] != 0.0).sum(axis=0) == 1
        motion[NUMERATORS[COMPRESSION] + 1, lanes[alone]] = COMPRESSION_FOLLOWS[element] * start[alone]
        if element == STOPPED:
            motion[NUMERATORS[POSITION], lanes] = start  # its velocity is 0
    return Motion(*motion)


def _advance(chain: _Chain, motion: Motion, end: _End) -> Flags:
    """Move to the ends of phases; returns where the element with stops turns and touches the one ahead."""
    terms = _position_terms(chain, np.array(motion)) * end.propagator[3::-1]
    bound = 16.0 * EPS[chain.t.dtype] * (np.abs(chain.gap_ahead) + np.abs(terms).sum(axis=0))  # of a grazing contact
    chain.gap[...] += choose(chain.side[STOPPED] == 0.0, 0.0, terms[::-1].sum(axis=0))
    near = np.isfinite(bound) & (np.abs(chain.gap_ahead) <= bound)
    touches: Flags = near & (end.kind == VELOCITY[STOPPED])
    chain.state[...] = arrive(LegState(*chain.state), motion, Basis(*end.propagator[4::-1]), chain.side)
    return touches


def _pass(chain: _Chain, log: Log, end: _End, touches: Flags) -> None:
    """The states and modes right after the end of a phase, recorded as the next phase: elements at rest stick, reverse,
    or go on after a touch; those that are held may begin to slip where the current takes its next value.
    """
    going, hits, rests = end.kind == LIMIT, end.kind == STOP, end.kind == VELOCITY
    # One that it touches where it turns is no event, but that is where it is.
    there = np.flatnonzero(hits[STOPPED] | touches)
    ends = np.array([chain.plan.robot[stop][there] for stop in STOPS])
    chain.state[POSITION, there] = at = choose(chain.side[STOPPED, there] > 0.0, ends[1], ends[0])
    chain.gap[:, there] = at - ends
    rests |= hits
    chain.state[VELOCITIES] = choose(rests, 0.0, chain.state[VELOCITIES])
    chain.step[going] += 1
    chain.just_slips[...] = end.kind == THRESHOLD
    before = chain.side.copy()
    np.copyto(chain.side, end.side, where=chain.just_slips)
    _settle(chain, rests | (going & (before == 0.0)))
    event = np.where(chain.side != before, np.where(rests, REVERSES, SLIPS), np.int8(0))
    event = np.where(hits, HITS_STOP, np.where(rests & (chain.side == 0.0), STICKS, event))
    goes_on, first = (end.kind != TAKEOFF) & (end.kind != UNCERTIFIED), (event != 0).argmax(axis=0)
    _record(log, chain, goes_on, event[first, np.arange(first.size)])
    for element in range(1, len(ELEMENTS)):
        _record(log, chain, goes_on & (first < element) & (event[element] != 0), event[element])


def _leaves_at_once(chain: _Chain) -> Flags:
    """The leg leaves the ground at once: it pulls, or its contact force is 0 and the first non-zero derivative of that
    is negative.
    """
    contact = formulas.contact_of(chain.plan.robot, LegState(*chain.state))
    leg = formulas.contact_numerator(chain.plan.robot, motion_of(chain.phase))
    first = choose(leg.H3 != 0.0, leg.H3, choose(leg.H2 != 0.0, leg.H2, leg.H1))
    return np.asarray((not FOOT_IS_FIXED) & ((contact < 0.0) | ((contact == 0.0) & (first < 0.0))))


def _begin(chain: _Chain, log: Log) -> Array:
    """What each element does at the start, no event; returns the energy lost at stops."""
    velocity = chain.state[VELOCITIES]
    struck = (velocity != 0.0) & _blocked(chain, velocity)
    loss = choose(struck[STOPPED], formulas.loss_at_stop(chain.plan.robot, LegState(*chain.state)), 0.0)
    chain.state[VELOCITIES] = choose(struck, 0.0, velocity)
    chain.side[...] = np.sign(chain.state[VELOCITIES])
    _settle(chain, chain.side == 0.0)
    _record(log, chain, np.ones(chain.t.shape, np.bool_), np.zeros(chain.t.shape, np.int8))
    return loss


def _run(chain: _Chain, u_times: Array, max_phases: int, log: Log, over: Log) -> None:
    """Phase by phase until every lane has ended."""

    def close(lanes: Flags, ending: str) -> None:
        own = take((chain.lane, chain.t, chain.state, chain.counted), lanes)
        over.append((*own, np.full(own[0].shape, ENDING[ending])))

    next_times = np.append(u_times[1:], [NEVER[chain.t.dtype]] * 2).astype(chain.t.dtype)
    ended = _leaves_at_once(chain)
    close(ended, "takeoff")
    while True:
        rests = ~ended & (chain.side == 0.0).all(axis=0) & (chain.step + 1 >= u_times.size)
        close(rests, "rest")
        chain = take(chain, ~(ended | rests))
        if not chain.t.size:
            return
        until, motion = np.minimum(next_times[chain.step], chain.horizon), _motion_from(chain)
        end = _find_end(chain, poles_of(chain.plan, chain.side), motion, until - chain.t)
        touches = _advance(chain, motion, end)
        chain.t[...] = np.where(end.kind == LIMIT, until, chain.t + end.t)
        lifts, failed = end.kind == TAKEOFF, end.kind == UNCERTIFIED
        expired = (end.kind == LIMIT) & ~(until < chain.horizon)
        left = chain.state[COMPRESSION, lifts]  # of an extending leg that carries nothing
        chain.state[COMPRESSION, lifts] = 0.0 if CONTACT_IS_COMPRESSION else np.maximum(left, 0.0)
        for lanes, ending in (lifts, "takeoff"), (failed, "uncertified"), (expired, "horizon"):
            close(lanes, ending)
        end.kind[expired] = TAKEOFF
        _keep_free_accelerations(chain, motion, end)
        _pass(chain, log, end, touches)
        ended = lifts | failed | expired
        if not CONTACT_IS_COMPRESSION and not FOOT_IS_FIXED:  # what is lost at a stop was in the contact force
            contact = formulas.contact_of(chain.plan.robot, LegState(*chain.state))
            lost = (end.kind == STOP).any(axis=0) & (contact < 0.0)
            close(lost, "takeoff")
            ended |= lost
        full = (chain.counted > max_phases) & ~ended
        chain.counted[full] = max_phases  # a step of the current may have begun two
        close(full, "too_many_phases")
        ended |= full


def _add_up(solution: Solution) -> None:
    """The AED as the sum of its entries where it is the difference of energies that are much larger."""
    robot, start = solution.plan.robot, solution.start
    large = formulas.stored_energy(robot, start) > 64.0 * formulas.moving_energy(robot, start, 1.0)
    if (index := np.flatnonzero(large[solution.phases.lane])).size:
        entries = formulas.aed_of_ledger(ledger_over(solution.phase(index), solution.lengths[index]))
        solution.aed.reshape(-1)[large] = np.bincount(solution.phases.lane[index], entries, large.size)[large]


def _sorted(log: Log) -> Any:
    """Columns, lane by lane; the first column has the lanes."""
    columns = tuple(np.concatenate(column, axis=-1) for column in zip(*log, strict=True))
    return take(columns, np.argsort(columns[0], kind="stable"))


@np.errstate(all="ignore")
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

    start: states after the impact, without compression at touchdown [m, m/s]. u [A]: the current, with a further last
    axis over `u_times` [s] if those are several; they start at 0 and increase. horizon [s]: the longest time.
    max_phases: the cap after which a stance ends as too_many_phases.
    An unstable robot is a ValueError; no other input is checked here: hopform does that.
    """
    times, values = np.asarray(u_times, dtype).reshape(-1), np.asarray(u, dtype)
    if times.size == 1:
        values = values[..., np.newaxis]
    inputs = np.array(np.broadcast_arrays(*robot, *start, horizon, values[..., 0])[:-1], dtype)
    flat, shape = inputs.reshape(len(inputs), -1), inputs.shape[1:]
    values = np.broadcast_to(values, (*shape, times.size)).reshape(-1, times.size)
    robots, first = Robot(*flat[: len(robot)]), LegState(*flat[len(robot) : -1])
    plan, size = plan_of(robots), int(np.prod(shape))
    rows = len(ELEMENTS), size
    gap = first[POSITION] - np.array([robots[stop] for stop in STOPS])
    flags, counts = np.zeros((2, *rows), np.bool_), np.zeros((2, size), np.int64)
    chain = _Chain(
        np.arange(size), plan, values.T, flat[-1], np.array(first), gap, np.zeros(rows, dtype), np.zeros(size, dtype),
        counts[0], flags[0], flags[1], np.zeros(rows, dtype), counts[1],
    )  # fmt: skip
    log: Log = []
    over: Log = []
    loss = _begin(chain, log)
    _run(chain, times, max_phases, log, over)
    _, duration, states, counted, ending = _sorted(over)
    phases, end = Phases(*_sorted(log)), LegState(*states)
    aed = formulas.body_energy_gain(robots, first, At(*end))
    lifts = (ending == ENDING["takeoff"]) & (formulas.fall_of(robots) > 0.0)
    apex = choose(lifts, formulas.apex_after(robots, end), np.nan)
    kept = np.arange(phases.lane.size) - np.searchsorted(phases.lane, phases.lane) < counted[phases.lane]
    solution = Solution(
        shape, plan, values, first, duration.reshape(shape), LegState(*(field.reshape(shape) for field in end)),
        apex.reshape(shape), aed.reshape(shape), loss.reshape(shape), ending.reshape(shape), counted.reshape(shape),
        take(phases, kept),
    )  # fmt: skip
    _add_up(solution)
    return solution


def state_at(solution: Solution, lane: int, t: ArrayLike) -> LegState:
    """States of one lane at times t [s], 0 <= t <= duration, in t's shape; after rest the state stays."""
    index, within = locate(solution, lane, t)
    state = state_in_phase(solution.phase(index), within)
    return LegState(*(np.reshape(field, np.shape(t)) for field in state))


def locate(solution: Solution, lane: int, t: ArrayLike) -> tuple[Numbers, Array]:
    """The phase that each time, up to the end, falls into, and the time since that phase began."""
    times = np.minimum(np.asarray(t, solution.duration.dtype).reshape(-1), solution.duration.reshape(-1)[lane])
    first, after = np.searchsorted(solution.phases.lane, [lane, lane + 1])
    index = first + np.searchsorted(solution.phases.t[first:after], times, side="right") - 1
    return index, times - solution.phases.t[index]
