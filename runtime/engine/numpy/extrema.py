# SPDX-License-Identifier: MIT-0
"""Minima inside phases: of the contact force, for the controller; of -y, for the largest compression."""

import numpy as np
from numpy.typing import NDArray

from hopform_solver.kernels import basis_at
from hopform_solver.lanes import Array, choose, take
from hopform_solver.phases import arrive, motion_of, plan_lanes, poles_of
from hopform_solver.records import LegState, Numerator, Poles
from hopform_solver.stance import Solution, sides_of

LOOKS = 32
"""How often at least a rate is evaluated within a phase in which it might vanish, evenly."""
MOST_LOOKS = 65536
HALVINGS = 24
"""How often the first of these parts is halved towards the start, where fast poles turn."""


def rate_of(poles: Poles, numerator: Numerator, t: Array) -> Array:
    """The rate at t of what leaves its initial value by a numerator."""
    basis = basis_at(poles, t)
    return np.asarray(numerator.H3 * basis.Wdd + numerator.H2 * basis.Wd + numerator.H1 * basis.W)


def minima(poles: Poles, numerator: Numerator, length: Array) -> tuple[NDArray[np.intp], Array]:
    """Which phases have a minimum inside, and when; a phase may have several."""
    looks = np.clip(2.0 + 1.3 * np.sqrt(poles.q) * length, LOOKS, MOST_LOOKS).astype(np.intp)
    count = looks + HALVINGS + 1
    phase = np.repeat(np.arange(length.size), count)
    place = (np.arange(phase.size) - (np.cumsum(count) - count)[phase]) - HALVINGS
    parts = choose(place > 0, place.astype(np.float64), np.exp2(np.minimum(place - 1, 0).astype(np.float64)))
    share = choose(place > -HALVINGS, parts / looks[phase], np.zeros(phase.size))
    t = length[phase] * share.astype(length.dtype)
    rate = rate_of(take(poles, phase), take(numerator, phase), t)
    turns = np.flatnonzero((rate[:-1] < 0.0) & (rate[1:] >= 0.0) & (phase[:-1] == phase[1:]))
    found = phase[turns]
    if not found.size:
        return found, t[turns]
    at, by = take(poles, found), take(numerator, found)
    return found, _turn(at, by, length[found], (t[turns], t[turns + 1]), (rate[turns], rate[turns + 1]))


def _turn(
    poles: Poles, numerator: Numerator, length: Array, between: tuple[Array, Array], rates: tuple[Array, Array]
) -> Array:
    """Where a rate vanishes between two times of each phase, with its values there, the first < 0: by false position,
    the value at an end that stays being halved (Illinois).
    """
    (low, high), (falling, rising) = between, rates
    last = new = high
    for _ in range(60):
        new = high - rising * (high - low) / (rising - falling)
        new = np.where((new > low) & (new < high), new, np.where(rising == 0.0, high, 0.5 * (low + high)))
        rate = rate_of(poles, numerator, new)
        down, was_down = rate < 0.0, last == low
        halved = np.where(was_down, falling, 0.5 * falling), np.where(was_down, 0.5 * rising, rising)
        falling, rising = np.where(down, rate, halved[0]), np.where(down, halved[1], rate)
        low, high = np.where(down, new, low), np.where(down, high, new)
        if bool((np.abs(new - last) <= 4.0 * np.finfo(new.dtype).eps * length).all()):
            break
        last = new
    return new


def compressions(solution: Solution) -> Array:
    """The largest compression [m] of the spring in each stance, flat.

    Where a phase starts, where the stance ends, or inside a phase in which both masses move in the same direction: y'
    keeps its sign in the others.
    """
    phases = solution.phases
    most: Array = np.maximum(solution.end.y.reshape(-1), 0.0)
    np.maximum.at(most, phases.lane, phases.y)
    ends = np.append(phases.t[1:], most.dtype.type(0.0))
    last = np.append(phases.lane[1:] != phases.lane[:-1], True)
    ends[last] = solution.duration.reshape(-1)[phases.lane[last]]
    side = sides_of(phases.mode, most.dtype)
    index = np.flatnonzero((side.first != 0.0) & (side.first == side.second) & (ends > phases.t))
    if not index.size:
        return most
    lanes, some, side = phases.lane[index], take(phases, index), take(side, index)
    plan, start = plan_lanes(solution.plan, lanes), LegState(some.x1, some.v1, some.v2, some.y)
    motion = motion_of(plan, start, solution.u_values[lanes, some.step], side)
    poles, extension = poles_of(plan, side), Numerator(-motion.H3_y, -motion.H2_y, -motion.H1_y)
    found, t = minima(poles, extension, ends[index] - some.t)
    basis = basis_at(take(poles, found), t)
    there = arrive(take(start, found), take(motion, found), basis, take(side, found))
    np.maximum.at(most, lanes[found], there.y)
    return most
