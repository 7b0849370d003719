# SPDX-License-Identifier: MIT-0
"""Minima inside phases: of the contact force, for the controller; of the extension, for the largest compression."""

import numpy as np

from hopform_solver.elements import COMPRESSION, NUMERATORS
from hopform_solver.events import EventSet, jets_of, minimum_between, node_of, propagator_at, propagator_at_start
from hopform_solver.kernels import basis_at
from hopform_solver.lanes import Array, Flags, Numbers, choose, take
from hopform_solver.limits import EPS
from hopform_solver.phases import arrive, motion_of, poles_of
from hopform_solver.records import Numerator, Poles
from hopform_solver.stance import COMPRESSION_FOLLOWS, Solution

LOOKS = 32
"""How often at least a rate is evaluated within a phase in which it might vanish, evenly."""
MOST_LOOKS = 65536
HALVINGS = 24
"""How often the first of these parts is halved towards the start, where fast poles turn."""


def minima(poles: Poles, numerator: Numerator, length: Array) -> tuple[Numbers, Array]:
    """Which phases have a minimum inside, and when; a phase may have several.

    Between two times at which its rate has other signs lies one, by rule 2 of docs/explanation/certificate.md for the
    rate between the ends of the phase; where that leaves more than one the rate is evaluated in between.
    """
    of = EventSet(np.array(poles), node_of(poles), np.array(numerator), np.zeros_like(length))
    at_end = propagator_at(of.poles, length)
    start, end = jets_of(of, propagator_at_start(of.poles)), jets_of(of, at_end)
    turns = (start[1] < 0.0) & (end[1] > 0.0)
    most = 1 + (turns | ((start[1] > 0.0) & (end[1] < 0.0)))
    sizes = (np.abs(of.numerator * at_end[n : n - 3 : -1]).sum(axis=0) for n in (4, 5))
    decided = [np.abs(jet) > 64.0 * EPS[length.dtype] * size for jet, size in zip(end[1:3], sizes, strict=True)]
    once = (length < 0.95 * of.node.half_period) & decided[0] & decided[1] & (_most_turns(of, start, end) <= most)
    one, rest = np.flatnonzero(once & turns), np.flatnonzero(~once)
    phase, low, high = _looks(poles, numerator, length, rest)
    found = np.append(one, phase)
    low, high = np.append(np.zeros_like(length[one]), low), np.append(length[one], high)
    own = take(of, found)
    at_low, at_high = propagator_at(own.poles, low), propagator_at(own.poles, high)
    return found, minimum_between(own, low, jets_of(own, at_low), high, jets_of(own, at_high), at_high)[0]


def _most_turns(of: EventSet, start: Array, end: Array) -> Array:
    """How often the rates of functions may vanish between times that lie less than half a period of the pair apart."""
    pole = of.node.pole
    (rate, bend, d), (rate_then, bend_then, d_then) = ((*jet[1:3], jet[3] + pole * jet[2]) for jet in (start, end))
    before, after = ((x * y < 0.0) * 1 + (y * z < 0.0) for x, y, z in ((rate, bend, d), (rate_then, bend_then, d_then)))
    decided = (rate != 0.0) & (bend != 0.0) & (d * d_then != 0.0)
    return np.where(decided, before - after + (d * d_then < 0.0), 3)


def _looks(poles: Poles, numerator: Numerator, length: Array, phases: Numbers) -> tuple[Numbers, Array, Array]:
    """Between which of many times rates turn from falling to rising, phase by phase."""
    looks = np.clip(2.0 + 1.3 * np.sqrt(poles.q[phases]) * length[phases], LOOKS, MOST_LOOKS).astype(np.intp)
    count = looks + HALVINGS + 1
    index = np.repeat(np.arange(phases.size), count)
    place = (np.arange(index.size) - (np.cumsum(count) - count)[index]) - HALVINGS
    parts = choose(place > 0, place.astype(np.float64), np.exp2(np.minimum(place - 1, 0).astype(np.float64)))
    share = choose(place > -HALVINGS, parts / looks[index], np.zeros(index.size))
    phase = phases[index]
    t = length[phase] * share.astype(length.dtype)
    rate = np.asarray(sum(map(np.multiply, take(numerator, phase), basis_at(take(poles, phase), t))))
    turns = np.flatnonzero((rate[:-1] < 0.0) & (rate[1:] >= 0.0) & (phase[:-1] == phase[1:]))
    return phase[turns], t[turns], t[turns + 1]


def turns(side: Array) -> Flags:
    """Whether the rate of the compression may change its sign in phases in which elements go to these sides."""
    return np.asarray(side.any(axis=0) & ((COMPRESSION_FOLLOWS * side).sum(axis=0) == 0.0))


def compressions(solution: Solution) -> Array:
    """The largest compression [m] of the spring in each stance, flat: where a phase starts, where the stance ends, or
    inside a phase in which its rate may change its sign.
    """
    phases = solution.phases
    most: Array = np.maximum(solution.end[COMPRESSION].reshape(-1), 0.0)
    every, lengths = solution.phase(np.arange(phases.t.size)), solution.lengths
    np.maximum.at(most, phases.lane, every.start[COMPRESSION])
    index = np.flatnonzero(turns(every.side) & (lengths > 0.0))
    phase = take(every, index)
    motion, poles = motion_of(phase), poles_of(phase.plan, phase.side)
    extension = -np.array(motion)[NUMERATORS[COMPRESSION] :][:3]
    found, t = minima(poles, Numerator(*extension), lengths[index])
    motion, poles, phase = take((motion, poles, phase), found)
    there = arrive(phase.start, motion, basis_at(poles, t), phase.side)
    np.maximum.at(most, phases.lane[index[found]], there[COMPRESSION])
    return most
