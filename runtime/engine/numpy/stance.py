# SPDX-License-Identifier: MIT-0
"""Stances as chains of phases: each is linear, has its closed form, and ends at the first of the events in which a mass
reverses, sticks, slips or hits a stop, or in which the spring force returns to zero. All lanes advance together, each
through its own events. Rows of two are those of the masses, 0 the actuator, 1 the body.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform_solver import events, formulas
from hopform_solver.lanes import Array, Flags, Numbers, choose, put, take
from hopform_solver.ledgers import ledger_over
from hopform_solver.limits import BODY_IS_FIXED, CONTACT_IS_COMPRESSION, EPS, FOOT_IS_FIXED, NEVER, UNDERFLOW
from hopform_solver.phases import Phase, Plan, arrive, contact_numerator, motion_of, plan_of, poles_of, state_in_phase
from hopform_solver.records import ENDINGS, EVENTS, At, LegState, Motion, Poles, Robot

ENDING: dict[str, int] = {text: number for number, text in ENDINGS.items()}
EVENT: dict[str, int] = {text: number for number, text in EVENTS.items()}
"""The numbers of endings and events."""
_REVERSES, _STICKS, _SLIPS = (
    np.array([[EVENT[f"x1_{word}"]], [EVENT[f"x2_{word}"]]]) for word in ("reverses", "sticks", "slips")
)
LIMIT, TAKEOFF, STOP, UNCERTIFIED = range(4)
VELOCITY, THRESHOLD = np.array([[4], [5]]), np.array([[6], [7]])
"""What ends phases; of each mass, that its velocity vanishes, or that a force reaches its friction."""


class Phases(NamedTuple):
    """Phases of all lanes, lane by lane in the order of time."""

    lane: Numbers
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
        lane, _, x1, v1, v2, y, mode, _, step = take(self.phases, index)
        side = np.array([mode // 3 - 1, mode % 3 - 1], self.duration.dtype)
        return Phase(take(self.plan, lane), LegState(x1, v1, v2, y), self.u_values[lane, step], side)


class _Chain(NamedTuple):
    """The lanes that are still going; `lane` says which of the caller's each one is."""

    lane: Numbers
    plan: Plan
    u_values: Array
    horizon: Array
    state: LegState
    gap: Array  # x1 - x1_min and x1 - x1_max: x1 itself has no digits for what is this close to a stop
    side: Array
    t: Array
    step: NDArray[np.int64]
    just_slips: Flags
    is_known: Flags  # of a mass that has just come to rest: its free acceleration, from the motion
    free: Array  # this acceleration, from before the state lost its digits
    counted: NDArray[np.int64]

    @property
    def phase(self) -> Phase:
        u = self.u_values[self.step, np.arange(self.step.size)]
        return Phase(self.plan, self.state, u, self.side)

    @property
    def friction(self) -> Array:
        return np.array([*formulas.friction_of(self.plan.robot)])

    @property
    def gap_ahead(self) -> Array:
        """x1, counted from the stop to which the actuator moves."""
        return choose(self.side[0] > 0.0, self.gap[1], self.gap[0])


# ---- the hold rule ----


def _blocked(chain: _Chain, side: Array | float) -> Flags:
    locked = ~(chain.plan.robot.x1_min < chain.plan.robot.x1_max)
    return np.asarray(locked | ((side < 0.0) & (chain.gap[0] <= 0.0)) | ((side > 0.0) & (chain.gap[1] >= 0.0)))


def _drift_of_free(phase: Phase, mass: int) -> Array:
    """First non-zero derivative of the free acceleration of masses that are held."""
    phase.side[mass] = 0.0
    free = _FREE_NUMERATOR[mass](phase.plan.rates, motion_of(phase))
    later = choose(free.H2 != 0.0, free.H2, free.H1 - poles_of(phase.plan, phase.side).s_1 * free.H2)
    return choose(free.H3 != 0.0, free.H3, later)


def _settle(chain: _Chain, rests: Flags) -> None:
    """Where masses at rest go: held while |a_i| <= f_i; on the threshold the first non-zero derivative decides.

    This is done twice, because it may depend on what the other mass does.
    """
    friction, phase = chain.friction, chain.phase
    free = choose(chain.is_known, chain.free, np.array(_free_accelerations(phase)))
    chain.side[rests] = choose(np.abs(free) > friction, np.sign(free), 0.0)[rests]
    ties = rests & (np.abs(free) == friction)
    for mass in (0, 1, 0, 1) if ties.any() else ():
        tie = np.flatnonzero(ties[mass])
        drift = _drift_of_free(take(phase, tie), mass)
        chain.side[mass, tie] = choose(free[mass, tie] * drift >= 0.0, np.sign(drift), 0.0)
        _hold(chain, rests)
    _hold(chain, rests)


def _hold(chain: _Chain, rests: Flags) -> None:
    """What a stop, or the ground that it is bolted to, keeps from moving."""
    chain.side[0, rests[0] & _blocked(chain, chain.side[0])] = 0.0
    if BODY_IS_FIXED:
        chain.side[1] = 0.0


_FREE_NUMERATOR = formulas.free_numerator_1, formulas.free_numerator_2


def _free_accelerations(phase: Phase) -> tuple[Array, Array]:
    return formulas.free_accelerations(phase.plan.rates, phase.start, phase.u)


# ---- the end of a phase ----


class _End(NamedTuple):
    """How phases end: when, by what, a threshold to which side, the propagator there, and how near x_1, where it turns,
    is to a stop that it touches.
    """

    t: Array
    kind: Numbers
    side: Array
    propagator: Array
    touch: Array


class _Guards(NamedTuple):
    """The event functions of phases, take-off first, and what ends them in closed form.

    Not in it are the velocity of a mass that slips alone, whose time to rest is known, and what cannot happen while v_1
    and v_2 keep their signs. kind and side: of each slot. rest_time: when the mass that slips alone comes to rest, or
    y, which rings about 0, vanishes; rests: which of them. stop: how far x_1 is from the stop ahead.
    """

    of: events.EventSet
    kind: Numbers
    side: Array
    rest_time: Array
    rests: Numbers
    stop: events.EventSet


def _put_guards(chain: _Chain, poles: Poles, motion: Motion) -> _Guards:
    side, state, phase, rates, friction = chain.side, chain.state, chain.phase, chain.plan.rates, chain.friction
    size, dtype, never = chain.t.size, chain.t.dtype, NEVER[chain.t.dtype]
    numerator, start = np.zeros((3, events.SLOTS, size), dtype), np.ones((events.SLOTS, size), dtype)  # not active
    kind, towards = np.full((events.SLOTS, size), LIMIT), np.zeros((events.SLOTS, size), dtype)
    rest_time, rests = np.full(size, never, dtype), np.full(size, LIMIT)

    def add(slot: int, lanes: Flags, what: int, sign: Array | float, of: tuple[Array, ...], now: Array) -> None:
        places = np.flatnonzero(lanes)
        numerator[:, slot, places] = [(sign * row)[places] for row in of]
        start[slot, places], kind[slot, places] = now[places], what

    slips = side != 0.0
    both, lone = slips.all(axis=0), slips[0] != slips[1]
    may_fall = (side[0] < 0.0) | (side[1] > 0.0) | (state.y < 0.0) | (not CONTACT_IS_COMPRESSION)  # else y rises
    rings = lone & CONTACT_IS_COMPRESSION
    if rings.any():
        # Where the forces on the mass that slips alone cancel at y = 0, y rings about 0 as a velocity does: its first
        # zero is known however far it has faded by then.
        rings &= (choose(slips[0], *formulas.drive_of(chain.plan.robot, rates, phase.u, side[0], side[1])) == 0.0) & (
            state.y >= 0.0
        )
    leg = may_fall & ~rings & (both | lone) & (not FOOT_IS_FIXED)
    add(0, leg, TAKEOFF, 1.0, contact_numerator(chain.plan.robot, motion), formulas.contact_of(chain.plan.robot, state))
    slopes = (rates.a1_y, rates.a1_v2), (rates.a2_y, rates.a2_v1)
    for mass, other in (0, 1), (1, 0):
        H3, H2, H1 = motion[3 * mass : 3 * mass + 3]
        sign, v = side[mass], state[1 + mass]
        first = choose(chain.just_slips[mass], 0.0, H3)
        add(1 + mass, both, VELOCITY[mass, 0], sign, (first, H2, H1), sign * v)
        alone = np.flatnonzero(lone & slips[mass])
        if not alone.size:
            continue
        rest_time[alone] = events.time_to_rest(*take((poles, sign * v, sign * H3), alone))
        rests[alone] = VELOCITY[mass]
        # Where the free acceleration of the other mass changes with y alone, which is monotone then, to the side that
        # it goes towards.
        per_y, per_v = slopes[other]
        goes = choose(per_v == 0.0, np.sign(per_y) * (side[0] - side[1]), 0.0)
        free = _FREE_NUMERATOR[other](rates, motion), _free_accelerations(phase)[other]
        for slot, goal in (1, -1.0), (2, 1.0):
            may = lone & slips[mass] & (goes != -goal)
            if other == 0:  # a stop holds on its side whatever the force
                may &= ~_blocked(chain, goal)
            may &= other == 0 or not BODY_IS_FIXED
            add(slot, may, THRESHOLD[other, 0], -goal, free[0], friction[other] - goal * free[1])
            towards[slot, may] = goal
    if rings.any():
        lift = choose(rings, events.time_to_rest(poles, state.y, state.v1 - state.v2), never)
        rests[rings & (lift <= rest_time)] = TAKEOFF
        rest_time = np.minimum(rest_time, lift)
    rows, node = np.array(poles), events.node_of(poles)
    gap, x_1 = chain.gap_ahead, np.array([state.v1, motion.N2_1, motion.N1_1, motion.N0_1])
    stop = events.EventSet(rows, node, -side[0] * x_1, -side[0] * gap)
    return _Guards(events.EventSet(rows, node, numerator, start), kind, towards, rest_time, rests, stop)


def _meets_stop(guards: _Guards, on: events.Interval, lanes: Numbers) -> Flags:
    """Where x_1, monotone within a phase, is beyond the stop ahead at the end of an interval, and does not just touch:
    the interval ends where it meets it.
    """
    met = np.zeros(on.lane.shape, np.bool_)
    lanes = lanes[np.isfinite(guards.stop.start[on.lane[lanes]])]
    if not lanes.size:
        return met
    of, (high, at_high) = take(guards.stop, on.lane[lanes]), take((on.high, on.propagator), lanes)
    short = events.jets_of(of, at_high)
    beyond = np.flatnonzero(short[0] < -_grazing_tolerance(of, at_high))
    if beyond.size:
        lanes, of, short, high, at_high = take((lanes, of, short, high, at_high), beyond)
        guess = high - events.step_to_root(short)
        on.high[lanes], on.propagator[:, lanes] = events.root_between(
            of.poles, events.curve_of(of), np.zeros_like(high), high, at_high, guess
        )
        met[lanes] = (on.found[lanes] != 0) | (high > on.high[lanes] * (1.0 + 8.0 * EPS[high.dtype]))
    return met


def _grazing_tolerance(stop: events.EventSet, propagator: Array) -> Array:
    """An extremum of x_1, counted from a stop, that is this near to it is a grazing contact: 16 ulp of the terms."""
    zero = np.zeros_like(stop.start)
    return events.rounding_of(stop, propagator, zero, zero)


def _cross_at_the_limit(guards: _Guards, on: events.Interval, certified: Flags) -> None:
    """At the time of the limit a take-off comes before it, and before mass 2 comes to rest what mass 1 does."""
    lanes = np.flatnonzero(certified & ~on.is_quiet & (on.found < 0) & ~(on.high < on.limit))
    own = on.lane[lanes]
    rests_2 = (guards.rests[own] == VELOCITY[1]) & ~(guards.rest_time[own] > on.limit[lanes])
    is_first = (guards.kind[:, own] == TAKEOFF) | ((guards.kind[:, own] == THRESHOLD[0]) & rests_2)
    (value, rate, *_), limit = on.end[..., lanes], on.limit[lanes]
    crosses = (
        is_first & (value < -8.0 * EPS[limit.dtype] * limit * rate) & (rate * limit < -16.0 * on.rounding[:, lanes])
    )
    on.found[lanes] = np.where(crosses.any(axis=0), crosses.argmax(axis=0), -1)


def _sharpen_takeoff(chain: _Chain, on: events.Interval, certified: Flags) -> Flags:
    """Take-offs late in a phase: their times with all their digits. True where they come later, so that something else
    may come first.
    """
    later = np.zeros(certified.shape, np.bool_)
    lanes = np.flatnonzero(certified & (on.found == 0) & ~on.is_late & (np.abs(on.propagator[4]) < 0.25))
    if not lanes.size:
        return later
    own = on.lane[lanes]
    of, slack = on.of.at(0, lanes), LegState(*np.zeros((4, lanes.size), on.high.dtype))
    phase, poles = take(chain.phase, own)._replace(start=slack), Poles(*of.poles)
    motion, slow = motion_of(phase), poles.s_3 > 0.0
    draws = choose(slow, poles.s_3, poles.s_2)  # 0: nothing that is left of k draws y
    settled = choose(draws > 0.0, choose(slow, motion.H1_y, motion.H2_y) / draws, NEVER[draws.dtype])
    settled = formulas.contact_of(phase.plan.robot, slack._replace(y=settled))
    before = on.high[lanes]
    for _ in range(4):
        t = on.high[lanes]
        correction = events.steady_state_correction(of, settled, events.basis_of(on.propagator[:, lanes]), t)
        moved = (correction != 0.0) & (t + correction <= on.limit[lanes])
        if not moved.any():
            break
        where, t = lanes[moved], (t + correction)[moved]
        on.high[where], on.propagator[:, where] = t, events.propagator_at(of.poles[:, moved], t)
    later[lanes] = on.is_late[lanes] = on.high[lanes] > before
    return later


def _close(guards: _Guards, on: events.Interval, lanes: Numbers, stops: Flags, end: _End) -> None:
    """What ends phases at the ends of their last intervals."""
    own, t, found, limit = on.lane[lanes], on.high[lanes], on.found[lanes], on.limit[lanes]
    rests = ~(guards.rest_time[own] > limit) & ~(t < limit * (1.0 - 8.0 * EPS[t.dtype]))
    kind = np.where(rests, guards.rests[own], LIMIT)
    wins = rests & (guards.rests[own] != VELOCITY[1]) & (found != 0)  # over mass 2 at the same time, not over take-off
    root = (found >= 0) & ~wins
    kind[root], end.side[own[root]] = guards.kind[found[root], own[root]], guards.side[found[root], own[root]]
    kind[found == events.UNKNOWN] = UNCERTIFIED
    kind[stops[lanes]] = STOP
    end.t[own], end.kind[own], end.propagator[:, own] = t, kind, on.propagator[:, lanes]


def _find_end(chain: _Chain, poles: Poles, motion: Motion, until: Array) -> _End:
    """The first event of the phases that start at the chain's states."""
    guards = _put_guards(chain, poles, motion)
    limit = np.minimum(guards.rest_time, until)
    zero = np.zeros_like(limit)
    end = _End(limit.copy(), np.full(limit.shape, LIMIT), zero, np.zeros((7, limit.size), limit.dtype), zero.copy())
    on = events.first_interval(guards.of, limit)
    stops, ended = np.zeros(limit.shape, np.bool_), (on.found >= 0) | ~(limit > 0.0)
    on.high[ended] = 0.0
    while True:
        if ended.any():
            _close(guards, on, np.flatnonzero(ended), stops, end)
            on = take(on, ~ended)
        if not on.lane.size:
            break
        certified = events.find_first_root(on)
        _cross_at_the_limit(guards, on, certified)
        certified &= ~_sharpen_takeoff(chain, on, certified)
        stops = _meets_stop(guards, on, np.flatnonzero(certified))
        ended = certified & (stops | (on.found >= 0) | ~(on.high < on.limit))
        events.begin_interval(on, np.flatnonzero(certified & ~ended))
        ended |= events.give_up(on, ended)
    lanes = np.flatnonzero((end.kind == VELOCITY[0]) & np.isfinite(guards.stop.start))
    end.touch[lanes] = _grazing_tolerance(take(guards.stop, lanes), end.propagator[:, lanes])
    return end


# ---- the chain ----


def _record(log: list[Phases], chain: _Chain, lanes: Numbers, event: NDArray[np.int8]) -> None:
    """Phases in the order in which they are found."""
    lane, t, step, state = take((chain.lane, chain.t, chain.step, chain.state), lanes)
    mode = 3.0 * (chain.side[0, lanes] + 1.0) + chain.side[1, lanes] + 1.0
    log.append(Phases(lane, t, *state, mode.astype(np.int8), event[lanes], step))
    chain.counted[lanes] += 1


def _keep_free_accelerations(chain: _Chain, motion: Motion, end: _End) -> None:
    """A mass that rings alone fades far below the digits of the state; its acceleration at rest is known from the
    motion. Without friction nothing but the sign is left of it in the end, and that is kept.

    So is what is left of the forces on an actuator without any friction that stops while they cancel to all digits of
    the state: its acceleration before, where that has faded.
    """
    side, friction, rates = chain.side, chain.friction, chain.plan.rates
    terms = np.array(motion[:6]).reshape(2, 3, -1) * end.propagator[4:1:-1]
    rate, eps = terms.sum(axis=1), EPS[chain.t.dtype]
    chain.is_known[...] = (end.kind == VELOCITY) & (side[::-1] == 0.0)
    chain.free[...] = side * (friction - np.maximum(np.abs(rate), UNDERFLOW[chain.t.dtype]))
    slides = ((end.kind == VELOCITY[0]) | (end.kind == STOP)) & (side != 0.0).all(axis=0)
    slides &= (friction[0] <= 0.0) & (rates.a1_v1 == 0.0)
    if slides.any():
        free, _ = _free_accelerations(chain.phase)
        slides &= np.abs(free) < 64.0 * eps * np.abs(rates.a1_y * chain.state.y)
        slides &= np.abs(rate[0]) > 16.0 * eps * np.abs(terms[0]).sum(axis=0)
        chain.is_known[0, slides], chain.free[0, slides] = True, rate[0, slides]


def _motion_from(chain: _Chain) -> Motion:
    """The numerators of the next phases."""
    motion = motion_of(chain.phase)
    starts = chain.free - chain.side * chain.friction
    for mass, other, of_y in (0, 1, 1.0), (1, 0, -1.0):
        lanes = np.flatnonzero(chain.is_known[mass] & (chain.side[mass] != 0.0))
        motion[3 * mass][lanes] = start = starts[mass, lanes]
        alone = chain.side[other, lanes] == 0.0
        motion.H2_y[lanes[alone]] = of_y * start[alone]
        if mass == 0:
            motion.N2_1[lanes] = start  # v_1 is 0
    return motion


def _pass(chain: _Chain, log: list[Phases], end: _End) -> None:
    """The states and modes right after the end of a phase, recorded as the next phase: masses at rest stick, reverse,
    or go on after a touch; those that are held may begin to slip where the current takes its next value.
    """
    robot, going, hits = chain.plan.robot, end.kind == LIMIT, end.kind == STOP
    goes_on = (end.kind != TAKEOFF) & (end.kind != UNCERTIFIED)
    rests = end.kind == VELOCITY
    # One that it touches where it turns is no event, but that is where it is.
    there = hits | (rests[0] & (np.abs(chain.gap_ahead) <= end.touch))
    if there.any():
        stop = choose(chain.side[0] > 0.0, robot.x1_max, robot.x1_min)[there]
        chain.state.x1[there], chain.gap[:, there] = stop, [stop - robot.x1_min[there], stop - robot.x1_max[there]]
    rests[0] |= hits
    chain.state.v1[rests[0]], chain.state.v2[rests[1]] = 0.0, 0.0
    chain.step[going] += 1
    chain.just_slips[...] = end.kind == THRESHOLD
    before = chain.side.copy()
    np.copyto(chain.side, end.side, where=chain.just_slips)
    _settle(chain, rests | (going & (before == 0.0)))
    changed = chain.side != before
    moves = np.where(changed, np.where(rests, _REVERSES, _SLIPS), 0)
    event: NDArray[np.int8] = np.where(rests & (chain.side == 0.0), _STICKS, moves).astype(np.int8)
    event[0, hits] = EVENT["x1_hits_stop"]
    both = (event != 0).all(axis=0)
    _record(log, chain, np.flatnonzero(goes_on), np.asarray(np.where(both, event[0], event[0] + event[1]), np.int8))
    _record(log, chain, np.flatnonzero(goes_on & both), event[1])


def _leaves_at_once(chain: _Chain) -> Flags:
    """The leg leaves the ground at once: it pulls, or its contact force is 0 and the first non-zero derivative of that
    is negative.
    """
    contact = formulas.contact_of(chain.plan.robot, chain.state)
    leg = contact_numerator(chain.plan.robot, motion_of(chain.phase))
    first = choose(leg.H3 != 0.0, leg.H3, choose(leg.H2 != 0.0, leg.H2, leg.H1))
    return np.asarray((not FOOT_IS_FIXED) & ((contact < 0.0) | ((contact == 0.0) & (first < 0.0))))


def _begin(chain: _Chain, log: list[Phases]) -> Array:
    """What each mass does at the start, no event; returns the energy lost at stops."""
    v1 = chain.state.v1.copy()
    chain.side[...] = np.sign(chain.state[1:3])
    struck = (v1 != 0.0) & _blocked(chain, v1)
    chain.state.v1[struck] = chain.side[0, struck] = 0.0
    _settle(chain, chain.side == 0.0)
    _record(log, chain, np.arange(chain.t.size), np.zeros(chain.t.size, np.int8))
    return choose(struck, -0.5 * chain.plan.robot.m_eff * v1 * v1, 0.0)


class _Result(NamedTuple):
    """What is known of the lanes that have ended."""

    duration: Array
    end: LegState
    ending: NDArray[np.int64]
    counted: NDArray[np.int64]

    def close(self, chain: _Chain, lanes: Flags, ending: str) -> None:
        where = chain.lane[lanes]
        self.ending[where] = ENDING[ending]
        put((self.duration, self.counted, *self.end), where, take((chain.t, chain.counted, *chain.state), lanes))


def _run(chain: _Chain, u_times: Array, max_phases: int, log: list[Phases], result: _Result) -> Array:
    """Phase by phase until every lane has ended; returns the energy lost at stops at the start."""
    loss = _begin(chain, log)
    next_times = np.append(u_times[1:], [NEVER[chain.t.dtype]] * 2).astype(chain.t.dtype)
    ended = _leaves_at_once(chain)
    result.close(chain, ended, "takeoff")
    while True:
        rests = ~ended & (chain.side == 0.0).all(axis=0) & (chain.step + 1 >= u_times.size)
        result.close(chain, rests, "rest")
        ended |= rests
        if ended.any():
            chain = take(chain, ~ended)
        if not chain.t.size:
            return loss
        until = np.minimum(next_times[chain.step], chain.horizon)
        motion = _motion_from(chain)
        end = _find_end(chain, poles_of(chain.plan, chain.side), motion, until - chain.t)
        basis = events.basis_of(end.propagator)
        moved = formulas.state_at(chain.state._replace(x1=np.zeros_like(chain.t)), motion, basis).x1_t
        chain.gap[...] += choose(chain.side[0] == 0.0, 0.0, moved)
        put(chain.state, np.arange(chain.t.size), arrive(chain.state, motion, basis, chain.side))
        chain.t[...] = np.where(end.kind == LIMIT, until, chain.t + end.t)
        lifts, failed = end.kind == TAKEOFF, end.kind == UNCERTIFIED
        over = (end.kind == LIMIT) & ~(until < chain.horizon)
        if CONTACT_IS_COMPRESSION:
            chain.state.y[lifts] = 0.0
        for lanes, ending in (lifts, "takeoff"), (failed, "uncertified"), (over, "horizon"):
            result.close(chain, lanes, ending)
        end.kind[over] = TAKEOFF
        _keep_free_accelerations(chain, motion, end)
        _pass(chain, log, end)
        ended = lifts | failed | over
        if not CONTACT_IS_COMPRESSION and not FOOT_IS_FIXED:  # what v_1 has lost at a stop was in the contact force
            lost = (end.kind == STOP) & (formulas.contact_of(chain.plan.robot, chain.state) < 0.0)
            result.close(chain, lost, "takeoff")
            ended |= lost
        full = (chain.counted > max_phases) & ~ended
        result.close(chain, full, "too_many_phases")
        result.counted[chain.lane[full]] = max_phases  # a step of the current may have begun two
        ended |= full


def _add_up(solution: Solution) -> None:
    """The AED as the sum of its entries where it is the difference of energies that are much larger."""
    robot, start = solution.plan.robot, solution.start
    large = formulas.stored_energy(robot, start) > 32.0 * robot.m_s * (1.0 + start.v2 * start.v2)
    if (index := np.flatnonzero(large[solution.phases.lane])).size:
        entries = formulas.aed_of_ledger(ledger_over(solution.phase(index), solution.lengths[index]))
        solution.aed.reshape(-1)[large] = np.bincount(solution.phases.lane[index], entries, large.size)[large]


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

    start: states after the impact, y = 0 at touchdown [m, m/s]. u [A]: the current, with a further last axis over
    `u_times` [s] if those are several; they start at 0 and increase. horizon [s]: the longest time. max_phases: the
    cap after which a stance ends as too_many_phases.
    An unstable robot is a ValueError; no other input is checked here: hopform does that.
    """
    times, values = np.asarray(u_times, dtype).reshape(-1), np.asarray(u, dtype)
    if times.size == 1:
        values = values[..., np.newaxis]
    inputs = [np.asarray(field, dtype) for field in (*robot, *start, horizon)]
    shape = np.broadcast_shapes(*(field.shape for field in inputs), values.shape[:-1])
    flat = [np.broadcast_to(field, shape).reshape(-1).copy() for field in inputs]
    values = np.broadcast_to(values, (*shape, times.size)).reshape(-1, times.size)
    robots, first = Robot(*flat[: len(robot)]), LegState(*flat[len(robot) : -1])
    plan, size, lane = plan_of(robots), flat[-1].size, np.arange(flat[-1].size)
    real, count = np.zeros((5, 2, size), dtype), np.zeros((4, size), np.int64)
    side, free, (duration, t), *ends = real
    state = take(first, lane)
    gap = np.array([first.x1 - robots.x1_min, first.x1 - robots.x1_max])
    nothing = np.zeros((2, size), np.bool_)
    chain = _Chain(
        lane, plan, values.T, flat[-1], state, gap, side, t, count[0], nothing, nothing.copy(),
        free, count[1],
    )  # fmt: skip
    log: list[Phases] = []
    result = _Result(duration, LegState(*np.concatenate(ends)), count[2], count[3])
    loss = _run(chain, times, max_phases, log, result)
    phases = Phases(*(np.concatenate(column) for column in zip(*log, strict=True)))
    phases, end = take(phases, np.argsort(phases.lane, kind="stable")), result.end
    aed = formulas.body_energy_gain(robots, first, At(*end))
    lifts = (result.ending == ENDING["takeoff"]) & (formulas.fall_of(robots) > 0.0)
    apex = choose(lifts, formulas.apex_of_takeoff(robots, end.x1, end.y, np.maximum(end.v2, 0.0)), np.nan)
    kept = np.arange(phases.lane.size) - np.searchsorted(phases.lane, phases.lane) < result.counted[phases.lane]
    solution = Solution(
        shape, plan, times, values, first, duration.reshape(shape), LegState(*(field.reshape(shape) for field in end)),
        apex.reshape(shape), aed.reshape(shape), loss.reshape(shape), result.ending.reshape(shape),
        result.counted.reshape(shape), take(phases, kept),
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
