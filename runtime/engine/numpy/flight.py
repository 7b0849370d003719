# SPDX-License-Identifier: MIT-0
"""A flight as a chain of phases: one element falls freely, the one with stops returns under the law or at the limit of
the current, slips or is held. It ends at the first downward crossing of the ground ahead by the foot.

An event function is a quadratic in t, and shares of the way of the element that slips, of its velocity, and of what a
damper leaves in the leg. Way and velocity are motions of one pair of poles and a constant. A phase ends at the latest
where that velocity vanishes, within a half turn of the pair, so a motion of the pair alone changes its sign at most
once in it, at a time that rule 3 of docs/explanation/certificate.md has in closed form. The rate of an event function
is such a motion, or its third derivative is. Between the roots of a derivative the one before it is monotone: down to
the function itself each root is bracketed. A leg in which a damper acts relaxes as exp(-l t), and the foot with it:
(D + l) takes that from the third derivative, and is one link more. One flight at a time.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hopform_solver import elements, events, formulas, records
from hopform_solver.elements import COMPRESSION, ELEMENTS, POSITION, STOPPED, STOPS, FlightPhase, FlightSolution
from hopform_solver.lanes import Array, Numbers, choose, take
from hopform_solver.ledgers import moments_of, sums_before
from hopform_solver.limits import AXES_OF_MOMENTS, EPS, FASTEST_LEG, LEG_HAS_DAMPER, NEVER
from hopform_solver.phases import pair_alone, stable_rates_of
from hopform_solver.records import Energy, FlightLedger, FlightRates, Gains, LegState, Poles, Real, Robot

ENDING: dict[str, int] = {text: number for number, text in records.FLIGHT_ENDINGS.items()}
EVENT: dict[str, int] = {text: number for number, text in records.FLIGHT_EVENTS.items()}
"""The numbers of endings and events."""

ELEMENT, FALLS = ELEMENTS[STOPPED], 1 - STOPPED
VELOCITY, FALL = ELEMENT.velocity, ELEMENTS[FALLS].velocity
"""The element with stops, and the other one; the axes of their velocities."""

REST, STOP, HORIZON, TOUCHDOWN = 2, 3, 4, 5
"""What ends a phase; else the pull reaches the limit of the current to the side 1 or -1, or leaves it, to 0."""
ENDS = {HORIZON: "horizon", TOUCHDOWN: "touchdown"}

TIME, PROPAGATOR, WAYS = 0, slice(1, 1 + events.ORDERS), slice(1 + events.ORDERS, None)
"""Rows of instants of a phase: since it began, the propagator there, how far the element has slipped, and the
derivatives of that. Steps towards a root of the second derivative, or the third one, take four further ones.
"""
MOST_WAYS = 8 + LEG_HAS_DAMPER


def largest_force(robot: Robot) -> Real:
    """The largest force of the motor, 0 if it has none."""
    factor = abs(robot.gamma2)
    return np.fmin(factor * robot.u_max, NEVER[factor.dtype]) if factor > 0.0 else factor


# ---- a phase over time ----


def _poles_of(rates: FlightRates, limit: Array) -> Poles:
    """Of the element that slips, under the law or at a limit."""
    return pair_alone(choose(limit == 0, rates.p_law, rates.p_free), choose(limit == 0, rates.q_law, rates.q_law * 0.0))


def _ways(poles: Array, velocity: Array, acceleration: Array, propagator: Array) -> Array:
    """How far the element has slipped since a phase began, and the derivatives of that. What fades with p alone keeps
    its digits: the velocity without a force, the acceleration without a spring.
    """
    (p, q), (W, Wd, Wdd) = poles[1:3], propagator[2:5]
    force = acceleration + p * velocity
    ways = [velocity * Wd + force * W, velocity * Wdd + force * Wd, acceleration * Wdd - q * velocity * Wd]
    while len(ways) < MOST_WAYS:
        ways.append(-(p * ways[-1] + q * ways[-2]))
    return np.array(ways)


def _states(robot: Robot, start: Array, since: Array, position: Array, t: Array, ways: Array) -> Array:
    """States, in rows, at times of phases; rounding or underflow may have put a position a last digit beyond a stop."""
    fall, time, state = formulas.fall_of(robot), since + t, np.empty((len(start), *t.shape), t.dtype)
    rise = (start[FALL] - 0.5 * fall * time) * time
    state[POSITION] = np.clip(position + ways[0], *(robot[stop] for stop in STOPS))
    state[VELOCITY], state[FALL] = ways[1], start[FALL] - fall * time
    state[COMPRESSION] = start[COMPRESSION] - (rise - ((position - start[POSITION]) + ways[0]))
    return state


class _Function(NamedTuple):
    """An event function: start + rate t + curvature t^2/2, and shares of the way, of its velocity, and of what is left
    in the leg. Its start is a sum of terms of that size.
    """

    start: Real
    size: Real
    of_way: Real
    of_velocity: Real = 0.0
    rate: Real = 0.0
    curvature: Real = 0.0
    of_leg: bool = False

    def shares(self, ways: Array) -> Array:
        """Those of the way and its velocity, and their derivatives."""
        return np.asarray(self.of_way * ways[:-1] + self.of_velocity * ways[1:])

    def rounding(self, at: Array) -> Array:
        """What that may have done to its value."""
        t, (way, velocity, *_) = at[TIME], at[WAYS]
        terms = self.rate * t, 0.5 * self.curvature * t * t, self.of_way * way, self.of_velocity * velocity
        return np.asarray(16.0 * EPS[t.dtype] * (self.size + sum(map(np.abs, terms))))


# ---- the chain ----


@dataclass
class _Chain:
    """The chain while it grows. Compression at its start is over the ground ahead; a damper leaves some in the leg,
    which relaxes at a rate.
    """

    robot: Robot
    gains: Gains
    rates: FlightRates
    largest: Real
    horizon: Real
    start: Array
    leg: Real
    relaxes: Real
    t: Real
    position: Real
    velocity: Real
    acceleration: Real
    at_highest: tuple[Real, Real, Array, tuple[FlightPhase, ...]]
    """how high the foot has been, when and in which state, in the last of which phases; until it is above the ground
    """
    airborne: bool = False
    side: int = 0
    limit: int = 0
    phases: list[FlightPhase] = field(default_factory=list[FlightPhase])

    def begin_phase(self, event: int) -> None:
        """Record a phase, and see where its foot is over the ground: from the take-off, so that nothing adds up."""
        moves = self.position, self.velocity, self.acceleration
        self.phases.append(FlightPhase(self.t, *moves, self.side, self.limit, event))
        self.poles = np.array(_poles_of(self.rates, np.array([self.limit])))
        self.first = self.at(np.array([self.t * 0.0]), events.propagator_at_start(self.poles))
        rate, y = self.ended_at(self.first[:, 0])[1][[FALL, COMPRESSION]]
        size = abs(y) + abs(self.leg)
        self.foot = _Function(-y, size, -1.0, 0.0, rate, -formulas.fall_of(self.robot), bool(self.leg))

    def at(self, t: Array, propagator: Array | None = None) -> Array:
        """Instants."""
        poles = self.poles.repeat(t.size, axis=1)
        found = events.propagator_at(poles, t) if propagator is None else propagator
        return np.vstack((t, found, _ways(poles, self.velocity, self.acceleration, found)))

    def leg_at(self, t: Any) -> Any:
        """What is left of the leg's compression."""
        return self.leg * np.exp(-self.relaxes * (self.t + t)) if self.leg else t * 0.0

    def ended_at(self, at: Array) -> tuple[Real, Array]:
        """Time since take-off, not behind the horizon by rounding, and state."""
        t, left = at[TIME], self.horizon - self.t
        state = _states(self.robot, self.start, self.t, self.position, t, at[WAYS])
        return min(self.t + t, self.horizon) if t < left else self.horizon, state

    def jets(self, g: _Function, at: Array) -> Array:
        """An event function and its derivatives."""
        jets, t = g.shares(at[WAYS]), at[TIME]
        jets[0] = g.start + ((g.rate + 0.5 * g.curvature * t) * t + jets[0])
        jets[1] += g.rate + g.curvature * t
        jets[2] += g.curvature
        if g.of_leg:
            jets += self.leg_at(t) * (-self.relaxes) ** np.arange(len(jets), dtype=t.dtype)[:, np.newaxis]
        return jets

    def turn_of(self, g: _Function) -> Real:
        """Rule 3: when the last of the chain of derivatives of g, a motion of the pair, changes its sign in a phase."""
        shares, order = g.shares(self.first[WAYS]), 1 + 2 * (g.curvature != 0.0) + g.of_leg
        motion = shares[order : order + 2] + self.relaxes * g.of_leg * shares[order - 1 : order + 1]
        value, rate = motion * np.sign(motion[0] if motion[0] != 0.0 else motion[1])
        return events.time_to_rest(Poles(*self.poles), value, rate)[0]

    def with_roots(self, g: _Function, order: int, at: Array) -> Array:
        """Instants and, among them, the roots of the derivative of g of an order, which is monotone between them."""
        jets = self.jets(g, at)[order : order + 3]
        sign = np.sign(jets[0])
        places = np.flatnonzero(sign[:-1] * sign[1:] < 0.0) + 1
        if not places.size:
            return at
        sign, low, high, after = sign[places - 1], at[TIME, places - 1], at[TIME, places], at[PROPAGATOR, places]

        def curve(lanes: Numbers, t: Array, propagator: Array) -> Array:
            jet = sign[lanes] * self.jets(g, self.at(t, propagator))[order : order + 5]
            if g.of_leg:
                jet[4] = NEVER[t.dtype]  # the leg's rate is no pole of the element: no step is known to land
            return np.asarray(jet)

        share = events.rough_root(sign * jets[:, places - 1], sign * jets[:, places], high - low)
        poles, guess = self.poles.repeat(places.size, axis=1), low + (high - low) * share
        both = np.hstack((at, self.at(*events.root_between(poles, curve, low, high, after, guess))))
        return both[:, both[TIME].argsort(kind="stable")]

    def up_to_root(self, g: _Function, at: Array) -> Array:
        """Instants, between which g is monotone, up to the first one at which it falls below zero; a touch is none."""
        (value, rate, *_), rounding = self.jets(g, at), g.rounding(at)
        crossed = (value < 0.0) & ((value < -rounding) | (rate * at[TIME] < -rounding))
        if not crossed[1:].any():
            return at
        n = int(crossed[1:].argmax())
        return np.hstack((at[:, : n + 1], self.with_roots(g, 0, at[:, n : n + 2])[:, -2:-1]))


# ---- the end of a phase ----


def _goes(value: Real, level: Real) -> int:
    """The sign of what is beyond a level."""
    return int(np.sign(value)) if abs(value) > level else 0


def _acceleration(chain: _Chain, velocity: Real, side: int) -> Real:
    """The acceleration under what the motor does now, at a velocity, with the friction of a side."""
    if chain.limit == 0:
        return formulas.acceleration_under_law(chain.robot, chain.rates, chain.position, velocity, side)
    return formulas.acceleration_at_limit(chain.robot, chain.rates, velocity, side, chain.limit)


def _stop_ahead(chain: _Chain) -> _Function:
    """How far the stop ahead is."""
    stop = chain.robot[STOPS[chain.side > 0]]
    return _Function(chain.side * (stop - chain.position), abs(stop) + abs(chain.position), -chain.side)


def _rooms(chain: _Chain) -> Iterator[tuple[_Function, int]]:
    """How far the pull is from the limit of the current, or from leaving it; to what it changes then."""
    (Kp, Kd), limit = chain.gains, chain.limit
    pull = Kp * chain.position
    size = chain.largest + abs(pull) + Kd * abs(chain.velocity)
    for side in ((limit,) if limit else (1, -1)) if Kp > 0.0 or Kd > 0.0 else ():
        sign = limit or -side
        yield _Function(sign * (pull - side * chain.largest), size, sign * Kp, sign * Kd), 0 if limit else side


def _time_of_rest(chain: _Chain) -> Real:
    """When the element comes to rest. Where nothing grows with its position, and nothing would turn it back at rest,
    its velocity fades and never vanishes.
    """
    if not chain.poles[2] > 0.0 and chain.side * _acceleration(chain, chain.t * 0.0, chain.side) >= 0.0:
        return NEVER[chain.t.dtype]
    return events.time_to_rest(Poles(*chain.poles), *(chain.side * chain.first[WAYS][1:3]))[0]


def _look_at_foot(chain: _Chain, at: Array) -> None:
    """Before the foot has been above the ground: whether it is, and whether it is higher than before."""
    height = chain.jets(chain.foot, at[:, np.newaxis])[0, 0]
    if height > chain.at_highest[0]:
        chain.at_highest = (height, *chain.ended_at(at), tuple(chain.phases))
    chain.airborne = bool(height > chain.foot.rounding(at))


def _find_end(chain: _Chain) -> tuple[Array, int]:
    """The instant at which a phase ends, and by what."""
    until, foot, gap = chain.horizon - chain.t, chain.foot, _stop_ahead(chain)
    rooms, rest = ([*_rooms(chain)], _time_of_rest(chain)) if chain.side else ([], NEVER[until.dtype])
    last, end = (rest, REST) if rest <= until else (until, HORIZON)
    turns = sorted(chain.turn_of(g) for g in (foot, *(room for room, _ in rooms[:1])))
    at = chain.at(np.array([until * 0.0, *(t for t in turns if t < last), last]))
    for g, by in [(gap, STOP), *rooms] if chain.side else ():
        met = chain.up_to_root(g, at)
        at, end = (met, by) if met[TIME, -1] < at[TIME, -1] else (at, end)
    if end == REST and chain.jets(gap, at)[0, -1] < gap.rounding(at)[-1]:
        end = STOP
    for order in range(2 + foot.of_leg, 0, -1):
        at = chain.with_roots(foot, order, at)
    while not chain.airborne and at.shape[1] > 1:
        at = at[:, 1:]
        _look_at_foot(chain, at[:, 0])
    met = chain.up_to_root(foot, at) if chain.airborne else at
    return met[:, -1], end if met is at else TOUCHDOWN


# ---- what the element does ----


def _choose_limit(chain: _Chain) -> None:
    """Whether the motor is at its limit: where its pull is there exactly, the way in which that changes decides."""
    Kp, Kd = chain.gains
    pull = Kp * chain.position + Kd * chain.velocity
    chain.limit = _goes(pull, chain.largest)
    if abs(pull) == chain.largest and chain.side:
        rate = Kp * chain.velocity + Kd * _acceleration(chain, chain.velocity, chain.side)
        chain.limit = _goes(pull, 0.0) if rate * pull > 0.0 else 0


def _settle(chain: _Chain, free: Real) -> None:
    """At rest: held while the free acceleration is within the friction, or behind a stop."""
    friction = formulas.friction_of(chain.robot)[STOPPED]
    chain.side = _goes(free, friction)
    chain.side *= bool(_stop_ahead(chain).start > 0.0)
    chain.acceleration = free - friction * chain.side if chain.side else friction * 0.0


def _begin(chain: _Chain) -> Real:
    """What the element does at the start; the energy that it loses at a stop."""
    velocity, chain.side = chain.velocity, _goes(chain.velocity, 0.0)
    if strikes := chain.side != 0 and not _stop_ahead(chain).start > 0.0:
        chain.velocity, chain.side = velocity * 0.0, 0
    _choose_limit(chain)
    chain.acceleration = _acceleration(chain, chain.velocity, chain.side)
    if chain.side == 0:
        _settle(chain, chain.acceleration)
    return formulas.loss_at_stop(chain.robot, LegState(*chain.start)) if strikes else velocity * 0.0


def _rest(chain: _Chain, hits: bool) -> int:
    """The element has come to rest, or hits a stop; the event. Without dry friction its acceleration goes on."""
    before, free, sticks = chain.side, chain.acceleration, formulas.friction_of(chain.robot)[STOPPED] > 0.0
    chain.velocity *= 0.0
    if hits:
        chain.position = chain.robot[STOPS[before > 0]]
        _choose_limit(chain)
    _settle(chain, _acceleration(chain, chain.velocity, 0) if hits or sticks else free)
    turned = ELEMENT.sticks if chain.side == 0 else ELEMENT.reverses if chain.side != before else 0
    return ELEMENT.hits_stop if hits else turned


def _too_low(chain: _Chain) -> bool:
    """The foot cannot come as high again as it was: it falls, and is too low for the shortest leg."""
    shortest = chain.position - chain.robot[STOPS[0]] + np.maximum(chain.leg_at(chain.t * 0.0), 0.0)
    falls = not chain.airborne and chain.foot.rate < 0.0
    return bool(falls and np.isfinite(shortest) and chain.foot.start + shortest < chain.at_highest[0])


def _run(chain: _Chain, max_phases: int) -> tuple[str, Real, Array, tuple[FlightPhase, ...]]:
    """Ending, when, in which state, and the phases."""
    chain.begin_phase(0)
    _look_at_foot(chain, chain.first[:, 0])
    chain.airborne = chain.at_highest[0] > 0.0
    while not _too_low(chain):
        at, end = _find_end(chain)
        if end == HORIZON and not chain.airborne:
            break
        t, state = chain.ended_at(at)
        chain.t, chain.position, chain.velocity, chain.acceleration = t, state[POSITION], state[VELOCITY], at[WAYS][2]
        if end == TOUCHDOWN:
            state[COMPRESSION] = chain.leg_at(t * 0.0)
        if end in ENDS or len(chain.phases) == max_phases:
            return ENDS.get(end, "too_many_phases"), t, state, tuple(chain.phases)
        if end in (REST, STOP):
            chain.begin_phase(_rest(chain, end == STOP))
        else:  # the pull is at its limit exactly, the position but for its rounding
            chain.limit = chain.limit or end
            chain.acceleration, chain.limit = _acceleration(chain, chain.velocity, chain.side), end
            chain.begin_phase(EVENT["u_saturates" if end else "u_desaturates"])
    chain.t = chain.at_highest[1]
    return "tripped", *chain.at_highest[1:]


# ---- what users call ----


@np.errstate(all="ignore")
def solve_flight(
    robot: Robot,
    start: LegState,
    ground: float = 0.0,
    gains: Gains | None = None,
    horizon: float = 10.0,
    max_phases: int = 4096,
    dtype: type[np.floating] = np.float64,
) -> FlightSolution:
    """Solve one flight.

    start: the state at take-off. ground [m]: height of the ground ahead over that which is left. gains: of the law; if
    left out, of a return that is settled 50 ms before the touchdown on the ground that was left, in 20 ms at least.
    horizon [s]: the longest time.
    An unstable robot is a ValueError; no other input is checked here: hopform does that.
    """
    one, given, zero = Robot(*(dtype(each) for each in robot)), LegState(*(dtype(each) for each in start)), dtype(0.0)
    stable_rates_of(one)
    time = formulas.leg_time(one) if LEG_HAS_DAMPER else zero
    left, first, law = given[COMPRESSION], np.array(given), Gains(zero, zero)
    first[COMPRESSION] += dtype(ground)
    leg, relaxes = (left, dtype(1.0 / time)) if time > FASTEST_LEG[first.dtype] else (zero, zero)
    if (largest := largest_force(one)) > 0.0:
        falls = formulas.time_of_fall(one, first[FALL], first[POSITION])  # NaN where it does not rise that high
        wanted = formulas.critical_gains(one, np.fmax(falls - 0.05, 0.02)) if gains is None else gains
        law = Gains(*(dtype(gain) for gain in wanted))
    chain = _Chain(
        one, law, formulas.flight_rates_of(one, law, largest), largest, dtype(horizon), first, leg, relaxes,
        zero, first[POSITION], first[VELOCITY], zero, (-np.inf, zero, first, ()),
    )  # fmt: skip
    start_loss = _begin(chain)
    ending, duration, end, phases = _run(chain, max_phases)
    fall, lands = formulas.fall_of(one), ending == "touchdown"
    top = np.clip(first[FALL] / fall, zero, duration)
    return FlightSolution(
        one, law, given, dtype(ground), duration, LegState(*end),
        formulas.velocity_after_impact(one, end[FALL]) if lands else end[FALL],
        first[POSITION] - first[COMPRESSION] + (first[FALL] - 0.5 * fall * top) * top, top,
        formulas.loss_at_impact(one, end[FALL]) if lands else zero, start_loss,
        formulas.leg_energy(one, chain.leg_at(zero)) - formulas.leg_energy(one, leg), ENDING[ending], phases,
    )  # fmt: skip


# ---- a solved flight over time ----


def _read(flight: FlightSolution, t: ArrayLike) -> tuple[Array, FlightPhase, Numbers]:
    """Times in one dimension, in the precision of the flight; its phases, each field an array; that of each time."""
    dtype = np.asarray(flight.duration).dtype
    times, phases = np.asarray(t, dtype).reshape(-1), FlightPhase(*np.array(flight.phases, dtype).T)
    return times, phases, np.asarray(np.searchsorted(phases[0], times, side="right") - 1)


def _motion_in(flight: FlightSolution, phase: FlightPhase, t: Array) -> tuple[Poles, Array]:
    """The poles of phases; how far the element has slipped at times since they began, and the derivatives of that."""
    _, _, velocity, acceleration, _, limit, _ = phase
    poles = _poles_of(formulas.flight_rates_of(flight.robot, flight.gains, largest_force(flight.robot)), limit)
    rows = np.array(poles)
    return poles, _ways(rows, velocity, acceleration, events.propagator_at(rows, t))


def flight_at(flight: FlightSolution, t: ArrayLike) -> LegState:
    """States at times t [s], 0 <= t <= duration, in t's shape."""
    times, phases, index = _read(flight, t)
    phase, start = take(phases, index), np.array(flight.start)
    start[COMPRESSION] += flight.ground
    since, position, *_ = phase
    ways = _motion_in(flight, phase, times - since)[1]
    states = _states(flight.robot, start, since, position, times - since, ways)
    return LegState(*(row.reshape(np.shape(t)) for row in states))


def _work_in(flight: FlightSolution, phase: FlightPhase, t: Array) -> tuple[Array, LegState]:
    """The entries of the ledger over the first t of phases, and the element's velocity then.

    In a phase it moves as in a stance in which the other one is held, on a spring of the law.
    """
    since, position, velocity, acceleration, side, limit, _ = phase
    (poles, ways), zero, robot = _motion_in(flight, phase, t), np.zeros_like(t), flight.robot
    (alone,) = (mode for mode in elements.MODES if mode.slips[STOPPED] and not mode.slips[FALLS])
    rates, drive, start, sides = (np.zeros((n, t.size), t.dtype) for n in (len(records.Rates._fields), 2, 4, 2))
    rates[[elements.PER_COMPRESSION, elements.PER_VELOCITY, *alone.polynomial]] = -poles.q, -poles.p, poles.p, poles.q
    start[VELOCITY], drive[STOPPED], sides[STOPPED] = velocity, acceleration + poles.p * velocity, side
    moments = moments_of(records.Rates(*rates), poles, records.Drive(*drive), LegState(*start), sides, t)
    rise = (flight.start[FALL] - formulas.fall_of(robot) * (since + 0.5 * t)) * t
    over = records.Way(ways[0], moments[AXES_OF_MOMENTS.index([VELOCITY, VELOCITY])], rise)
    work = formulas.flight_ledger_of(robot, flight.gains, largest_force(robot), position, side, limit, over)
    start[VELOCITY] = ways[1]
    return np.array([zero + entry for entry in work]), LegState(*start)


def flight_ledger_at(flight: FlightSolution, t: ArrayLike) -> FlightLedger:
    """The ledger from take-off to times t [s], in t's shape."""
    times, phases, index = _read(flight, t)
    since, *_, event = phases
    whole, at_end = _work_in(flight, phases, np.append(np.diff(since), since[:1]))
    hits = np.append(event[1:] == ELEMENT.hits_stop, False)
    lost = choose(hits, formulas.loss_at_stop(flight.robot, at_end), 0.0)
    sums = sums_before([*whole, lost], flight.start_loss)[:, index]
    sums[:-1] += _work_in(flight, take(phases, index), times - since[index])[0]
    *work, stop_loss = (row.reshape(np.shape(t)) for row in sums)
    return FlightLedger(**records.FlightWork(*work)._asdict(), stop_loss=stop_loss)


def flight_energy_at(flight: FlightSolution, t: ArrayLike) -> Energy:
    """Energies at times t [s], in t's shape."""
    state = flight_at(flight, t)
    height = state[POSITION] - state[COMPRESSION]
    return formulas.flight_energies(flight.robot, state[VELOCITY], state[FALL], height)
