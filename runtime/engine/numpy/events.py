# SPDX-License-Identifier: MIT-0
"""The first event of each phase: the earliest root of its event functions, certified to be the earliest.

An event function of a phase is g(t) = start + H3 W' + H2 W + H1 W1 with the three poles of the phase, positive right
after its start. Each lane has SLOTS of them, in the order in which they win a tie; one that is not active stays at 1.
The search goes from interval to interval, all lanes at once. In each, roots are predicted from the jets at both ends
(an array of value, rate, curvature and third derivative), located by Householder's method, and certified to be the
first by the numbered rules of docs/explanation/certificate.md, under the names that they have in the C library.
"""

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from hopform_solver import formulas
from hopform_solver.elements import MODES
from hopform_solver.kernels import basis_at, pair_at
from hopform_solver.lanes import Array, Flags, Numbers, choose, take
from hopform_solver.limits import EPS, NEVER, SMALLEST_EXPONENT, UNDERFLOW
from hopform_solver.records import Basis, Numerator, Poles

Curve: TypeAlias = Callable[[Numbers, Array, Array], Array]
"""Jets of functions of some lanes at a time, with the propagator there, up to their fourth derivatives."""
ORDERS = 9
"""Rows of a propagator."""

SLOTS = 1 + max(len(mode.guards) for mode in MODES)
SLOT = np.arange(SLOTS)[:, np.newaxis]
NONE, UNKNOWN = -1, -2
"""What is found where no function has a root, and where there is no certificate."""
MOST_TRIES = 4 * SLOTS
"""A function may be located at a later root first, and so more than once."""
MOST_INTERVALS = 10_000
"""Intervals that are certified, or cut, in a phase at most."""


class Node(NamedTuple):
    """Of the poles of each lane: the first interval's length, half a period, NEVER where none rings, when the pair has
    faded beside the real pole, and that, or three real poles from the fastest on.
    """

    t: Array
    half_period: Array
    fades: Array
    pole: Array
    second: Array
    third: Array


class EventSet(NamedTuple):
    """The event functions of each lane: H3, H2, H1 of each slot, its start, the poles in rows, and their node.

    A fourth row of the numerator goes with the second integral of W.
    """

    poles: Array
    node: Node
    numerator: Array
    start: Array

    def at(self, slots: Numbers | int, lanes: Numbers) -> "EventSet":
        """One function each, of those slots."""
        return EventSet(
            *take((self.poles, self.node), lanes), self.numerator[:, slots, lanes], self.start[slots, lanes]
        )


class Interval(NamedTuple):
    """An interval of each lane's search: its ends, the propagator at the second one, the jets of all functions at both,
    and which of them has its first root at the second one, NONE if none has. lane: the caller's number of each.
    """

    lane: Numbers
    of: EventSet
    limit: Array
    low: Array
    high: Array
    propagator: Array
    start: Array
    end: Array
    rounding: Array
    found: Numbers
    tries: Numbers
    is_quiet: Flags  # by rule 5: nothing is searched
    is_late: Flags  # its take-off has been sharpened, once at most


def node_of(poles: Poles) -> Node:
    """It lies at nearly half a period where the pair is not damped, sooner where it is."""
    never = NEVER[poles.q.dtype]
    mean = 0.5 * poles.p
    square = mean * mean - poles.q
    rings, root = square < 0.0, np.sqrt(np.abs(square))
    fast = mean + root
    slow = choose(fast > 0.0, poles.q / fast, 0.0)
    return Node(
        choose(poles.q > UNDERFLOW[poles.q.dtype], 2.984 / np.sqrt(poles.q), never),
        choose(rings, np.pi / root, never),
        choose(rings & (poles.a > 0.0) & (mean > poles.a), 10.0 / (mean - poles.a), never),
        choose(rings, poles.a, np.maximum(poles.a, fast)),
        choose(rings, 0.0, np.minimum(fast, np.maximum(poles.a, slow))),
        choose(rings, 0.0, np.minimum(poles.a, slow)),
    )


# ---- the propagator and jets ----


def propagator_of(poles: Array, basis: Basis) -> Array:
    """W2, W1, W and the derivatives of W up to the sixth, in rows."""
    rows = [*basis[::-1]]
    while len(rows) < ORDERS:
        rows.append(-(poles[3] * rows[-1] + poles[4] * rows[-2] + poles[5] * rows[-3]))
    return np.array(rows)


def propagator_at(poles: Array, t: Array) -> Array:
    return propagator_of(poles, basis_at(Poles(*poles), t))


def propagator_at_start(poles: Array) -> Array:
    zero = np.zeros_like(poles[0])
    return propagator_of(poles, Basis(zero + 1.0, zero, zero, zero, zero))


def carried(poles: Array, propagator: Array, d: Array) -> Array:
    """The propagator a short time later, by its Taylor series."""
    return propagator_of(poles, Basis(*formulas.taylor_step(Poles(*poles), Basis(*propagator[4::-1]), d)))


def jets_of(of: EventSet, propagator: Array, rows: int = 4) -> Array:
    """Value, rate, curvature and further derivatives of event functions; the propagator's last axes are theirs."""
    jets = np.asarray(sum(H * propagator[3 - n :][:rows] for n, H in enumerate(of.numerator)))
    jets[0] += of.start
    return jets


def rounding_of(of: EventSet, propagator: Array, t: Array, rate: Array) -> Array:
    """Bound of what rounding may have done to the value of event functions."""
    terms = np.abs(of.numerator * propagator[3::-1][: len(of.numerator)]).sum(axis=0)
    return np.asarray(16.0 * EPS[t.dtype] * (np.abs(of.start) + terms + t * np.abs(rate)))


# ---- prediction ----


def rough_root(start: Array, end: Array, h: Array) -> Array:
    """Where in (0, 1) of intervals of length h functions have a root after a value (or slope) above 0 and before a
    value below: roughly, as parabolas with their slopes at the start. Where they start at 0 they are divided by the
    time first.
    """
    above = start[0] > 0.0
    rise = h * start[1]
    value = choose(above, start[0], rise)
    slope = choose(above, rise, 0.5 * h * h * start[2])
    square = slope * slope + 4.0 * value * (value + slope - end[0])
    share = 2.0 * value / (np.sqrt(np.maximum(square, 0.0)) - slope)
    return choose((value > 0.0) & (share < 1.0), share, 0.75)


# ---- steps towards roots ----


def step_to_root(jet: Array) -> Array:
    """Householder's step of third order towards a root."""
    value, rate, curvature, third = np.ldexp(jet[:4], -np.frexp(jet[1])[1])  # its cube may overflow
    square = rate * rate
    below = 6.0 * square * rate - 6.0 * value * rate * curvature + value * value * third
    step = value * (6.0 * square - 3.0 * value * curvature) / below
    return choose(np.abs(below) > 0.0, step, NEVER[step.dtype])


def step_converges(poles: Array, jet: Array, t: Array, step: Array) -> Flags:
    """True where Householder's step lands on the root to rounding, and the propagator can be carried there.

    Its error is of the fourth order in the step: products of the derivatives up to the fourth. What a Taylor series of
    the fourth order leaves out over the step is of the fifth order in d/t and in r d, r above all poles.
    """
    value, rate, curvature, third, fourth = jet
    per_rate = np.abs(step) / choose(np.abs(rate) > 0.0, np.abs(rate), 1.0)
    bend = per_rate * np.abs(curvature)
    twist = per_rate * np.abs(step * third)
    error = bend * (0.7 * bend * bend + 0.5 * twist) + 0.05 * per_rate * np.abs(step * step * fourth)
    share, eps = choose(t > 0.0, step / t, 1.0), EPS[t.dtype]
    near = step * step * (poles[3] * poles[3] + poles[4]) + share * share
    converges = (np.abs(value) <= 2.0 * np.abs(step * rate)) & (np.abs(step) * error <= eps * t)
    return np.asarray(converges & (near * near * near <= 0.0078125 * eps))


def root_between(
    poles: Array, curve: Curve, low: Array, high: Array, at_high: Array, guess: Array
) -> tuple[Array, Array]:
    """The roots of functions between times at which they are above zero and times at which they are below, from
    guesses: the times, and the propagator there. Where no number lies in between it is the later time.
    """
    eps = EPS[low.dtype]
    root, propagator = high.copy(), at_high.copy()
    lanes, t = np.arange(low.size), guess
    for n in range(100):
        t = choose((t > low) & (t < high), t, low + 0.5 * (high - low))
        lanes, low, high, t = take((lanes, low, high, t), (t > low) & (t < high))
        if not lanes.size:
            break
        own = poles.take(lanes, -1)
        there = propagator_at(own, t)
        jet = curve(lanes, t, there)
        value, rate = jet[:2]
        arrives = np.abs(value) <= eps * t * np.abs(rate)
        step = step_to_root(jet)
        new: Array = t - step
        low, high = choose(value > 0.0, t, low), choose(value < 0.0, t, high)
        lands = ~arrives & (new > low) & (new < high) & step_converges(own, jet, t, step)
        known = arrives | (value < 0.0)
        root[lanes[known]], propagator[:, lanes[known]] = t[known], there[:, known]
        if lands.any():
            where = lanes[lands]
            root[where] = new[lands]
            propagator[:, where] = carried(own[:, lands], there[:, lands], new[lands] - t[lands])
        going = ~arrives & ~lands
        lanes, low, high, new = take((lanes, low, high, new), going)
        t = low if n > 8 and n % 2 == 1 else new
    return root, propagator


def curve_of(of: EventSet, order: int = 0) -> Curve:
    """Jets of event functions, or less their rates for the order 1."""
    return lambda lanes, _, propagator: (1 - 2 * order) * jets_of(take(of, lanes), propagator, 5 + order)[order:]


def minimum_between(
    of: EventSet, low: Array, start: Array, high: Array, end: Array, at_high: Array
) -> tuple[Array, Array]:
    """Rule 4: where functions have their minimum between times, with their jets there, before which they fall and after
    which they rise: the times, and the propagator there.
    """
    guess = low + (high - low) * rough_root(-start[1:], -end[1:], high - low)
    return root_between(of.poles, curve_of(of, order=1), low, high, at_high, guess)


# ---- certificate ----


def has_no_root(start: Array, d: Array, end: Array, d_then: Array) -> Flags:
    """Rule 2: true if g, above zero at both ends of an interval, has no root in it; d is g'' + l g'.

    With V = 0, 1, 1, 2 for the signs (+, +), (+, -), (-, -), (-, +) of (g', d), V at the start, less V at the end, and
    1 if d changes its sign, is 0 or less.
    """
    faded = (d_then == 0.0) & (d > 0.0)  # no sign is left of it: the worse one
    negative_then, falls_then = (d_then < 0.0) | faded, end[1] < 0.0
    after_positive = ~(start[1] < 0.0) | (falls_then & ~negative_then)
    return np.asarray(((d < 0.0) & (falls_then | negative_then)) | (~(d < 0.0) & after_positive))


def is_held_up_by_slope(of: EventSet, start: Array, end: Array, h: Array, rounding: Array) -> Flags:
    """Rule 2 where d is not negative at the start: e^(lt) g' is at no time below the lesser of its ends, so g has lost
    no more than that times h. 1 - lh stands for e^(-lh).
    """
    left = start[0] + rounding
    kept = np.maximum(1.0 - of.node.pole * h, 0.0)
    return np.asarray((left > -h * start[1]) & (left * kept > -h * end[1]))


def is_held_up_by_bernstein(
    of: EventSet, start: Array, end: Array, h: Array, ends_at_root: Flags, bound: Array
) -> Flags:
    """Rule 1: Bernstein's coefficients of the quintic through value, slope and curvature at both ends, from which g
    differs by at most M6 t^3 (h - t)^3/720; those that a root of order 0 or 1 at an end makes 0 do not count.
    """
    (a, p, q, s_1), (H3, H2, H1) = of.poles[:4], of.numerator
    mu = 0.5 * p
    ww = q - mu * mu
    e = (H1 - a * (H2 - a * H3)) / formulas.residue(Poles(*of.poles))
    c = H3 - e
    sw = H2 - H3 * s_1 + a * e + mu * c
    M6 = q * q * np.sqrt(q * (c * c + sw * sw / ww)) + a * a * a * a * a * np.abs(e)  # the envelopes of the modes
    f, tw, hhh = 0.2 * h, 0.05 * h * h, h * h * h
    b1, b4 = start[0] + f * start[1], end[0] - f * end[1]
    b2, b3 = b1 + f * start[1] + tw * start[2], b4 - f * end[1] + tw * end[2]
    least = np.minimum(np.minimum(b1, b2), np.minimum(b3, b4))
    least = choose(start[0] > 0.0, np.minimum(least, start[0]), least)
    least = choose(ends_at_root, least, np.minimum(least, end[0]))
    return np.asarray(least > M6 * hhh * hhh / 43200.0 + bound)


def quiet_time(of: EventSet, jet: Array, bound: Array) -> Array:
    """Rule 5: how long from jets on functions, for certain, have no root; NEVER if they have none at all."""
    rings, known = of.node.half_period < NEVER[bound.dtype], _fall_of_ringing(Poles(*of.poles), jet, bound)
    left, fall, pole = known if rings.all() else choose(rings, known, _fall_of_decay(of.node, jet, bound))
    always = ~(fall < 0.0) | (left * pole > -fall)
    return choose(left > 0.0, choose(always, NEVER[bound.dtype], -left / fall), 0.0)


def _fall_of_ringing(poles: Poles, jet: Array, bound: Array) -> Array:
    """How much of g is left over, how fast that falls at most, and the pole with which this fades.

    g' = x + r, where x fades with the real pole and r rings. What rings in g is X = -(r' + p r)/q, of an amplitude that
    does not grow; what does not, g - X, falls by no more than x times the time, or x/a.
    """
    value, rate, curvature, third = jet
    mu = 0.5 * poles.p
    x = (third + poles.p * curvature + poles.q * rate) / formulas.residue(poles)
    r = rate - x
    X = -(curvature + poles.a * x + poles.p * r) / poles.q
    wY = r + mu * X
    left = value - X - 1.001 * np.sqrt(X * X + wY * wY / (poles.q - mu * mu)) - bound
    return np.array(np.broadcast_arrays(left, x, poles.a))


def _fall_of_decay(node: Node, jet: Array, bound: Array) -> Array:
    """The same of three real poles, l_1 the fastest: g' is a sum of g', (D + l_1) g' and (D + l_2)(D + l_1) g' at the
    start over kernels that are positive, of integrals 1/l_1, 1/(l_1 l_2) and 1/(l_1 l_2 l_3).
    """
    value, rate, curvature, third = jet
    l_1, l_2 = node.pole, node.second
    product = l_1 * l_2
    second = np.minimum(curvature + l_1 * rate, 0.0)
    falls = np.minimum(third + (l_1 + l_2) * curvature + product * rate, 0.0) / product
    left = value + np.minimum(rate, 0.0) / l_1 + second / product - bound
    return np.array(np.broadcast_arrays(choose(product > 0.0, left, 0.0), falls, node.third))


# ---- the search ----


def deflated(on: Interval, jets: Array, t: Array) -> Array:
    """d of rule 2. Where the pair has faded beside the real pole, d is taken from the pair itself."""
    d: Array = jets[2] + on.of.node.pole * jets[1]
    if (late := np.flatnonzero(t > on.of.node.fades)).size:
        poles = Poles(*on.of.poles[:, late])
        left = formulas.deflated_numerator(poles, Numerator(*on.of.numerator[..., late]))
        pair = pair_at(poles, t[late])
        d[:, late] = left.A * pair.Rd + left.B * pair.R
    return d


def first_interval(of: EventSet, limit: Array) -> Interval:
    """From the start of each phase to its node, or to its limit; a function that is below zero already when the phase
    begins is found there.
    """
    at_start, size = propagator_at_start(of.poles), limit.size
    start = jets_of(of, at_start[:, np.newaxis])
    lost = (start[0] < 0.0) & (start[1] <= 0.0)
    first = np.minimum(of.node.t, 0.95 * of.node.half_period)
    np.maximum(start[0], 0.0, out=start[0])
    return Interval(
        np.arange(size), of, limit, np.zeros_like(limit), np.minimum(first, limit), at_start,
        start, start.copy(), start[0].copy(), np.where(lost.any(axis=0), lost.argmax(axis=0), NONE),
        np.zeros(size, np.intp), np.zeros(size, np.bool_), np.zeros(size, np.bool_),
    )  # fmt: skip


def begin_interval(on: Interval, lanes: Numbers) -> None:
    """The next interval of some lanes begins where this one has ended, and ends less than half a period of the pair
    later, and not so late that all has faded. By rule 5 it may end later.
    """
    if not lanes.size:
        return
    start, low, limit, of = take((on.end, on.high, on.limit, on.of), lanes)
    np.maximum(start[0], 0.0, out=start[0])
    quiet, node = quiet_time(of, start, 16.0 * EPS[low.dtype] * np.abs(of.start)).min(axis=0), of.node
    is_quiet = quiet > 2.0 * node.t
    faded = -0.5 * of.poles[1] * low < SMALLEST_EXPONENT[low.dtype]  # the pair: what is left is monotone
    far: Array = low + choose(is_quiet, quiet, np.minimum(np.maximum(node.t, 3.0 * low), 0.95 * node.half_period))
    far = choose((faded & ~is_quiet) | ~(far > low), limit, np.minimum(far, limit))
    on.low[lanes], on.high[lanes], on.start[..., lanes] = low, far, start
    on.found[lanes], on.is_quiet[lanes], on.is_late[lanes] = NONE, is_quiet, False


def look_there(on: Interval, lanes: Numbers | slice) -> None:
    """The jets of all functions at the ends of intervals; those of all lanes without a copy."""
    there = on.of, on.propagator, on.high
    of, propagator, high = there if isinstance(lanes, slice) else take(there, lanes)
    on.end[..., lanes] = end = jets_of(of, propagator[:, None])
    on.rounding[:, lanes] = rounding_of(of, propagator[:, None], high, end[1])


def crossings(on: Interval, lanes: Numbers) -> tuple[Numbers, Numbers]:
    """Functions, by slot and lane, that are below zero at the ends of intervals by more than rounding, or, where no
    other root has been found before it, so steeply that the root is near.
    """
    slot, place = np.nonzero((on.end[0][:, lanes] < 0.0) & (on.found[lanes] != SLOT))
    lane = lanes[place]
    rounding, fall = -on.rounding[slot, lane], on.end[1, slot, lane] * (on.high - on.low)[lane]
    crossed = (on.end[0, slot, lane] < rounding) | ((on.found[lane] < 0) & (fall < rounding))
    return slot[crossed], lane[crossed]


def end_at_first_crossing(on: Interval, lanes: Numbers) -> Flags:
    """End intervals at the earliest root of the functions that have crossed zero by their ends; which of them have
    crossed zero there still, after MOST_TRIES.
    """
    slot, lane = crossings(on, lanes)
    for _ in range(MOST_TRIES):
        if not lane.size:
            break
        start, end, h = on.start[:, slot, lane], on.end[:, slot, lane], (on.high - on.low)[lane]
        share = np.full(on.rounding.shape, 2.0, h.dtype)
        soon, rough = -step_to_root(start) / h, rough_root(start, end, h)
        share[slot, lane] = choose((soon > 0.0) & (soon < 0.5 * rough), soon, rough)  # a fast pole's, at the start
        lanes = np.flatnonzero(share.min(axis=0) < 2.0)
        first = share[:, lanes].argmin(axis=0)
        of, (low, high, at_high) = on.of.at(first, lanes), take((on.low, on.high, on.propagator), lanes)
        guess = low + (high - low) * share[first, lanes]
        on.high[lanes], on.propagator[:, lanes] = root_between(of.poles, curve_of(of), low, high, at_high, guess)
        on.found[lanes] = first
        look_there(on, lanes)
        slot, lane = crossings(on, lanes)
    open_ = np.zeros(on.rounding.shape, dtype=bool)
    open_[slot, lane] = True
    return open_


def uncertified(on: Interval, open_: Flags, d: Array, d_then: Array) -> tuple[Numbers, Numbers]:
    """Functions, by slot and lane, of which the rules that take no further evaluation do not say that they have no root
    before the end of the interval; `open_` are below zero there.
    """
    slot, lane = np.nonzero(open_ | (~has_no_root(on.start, d, on.end, d_then) & ~on.is_quiet))
    if not lane.size:
        return slot, lane
    of, start, end, rounding = on.of.at(slot, lane), *(x[..., slot, lane] for x in (on.start, on.end, on.rounding))
    h, is_open = (on.high - on.low)[lane], open_[slot, lane]
    falls = d[slot, lane] < 0.0
    is_open |= (falls | ~is_held_up_by_slope(of, start, end, h, rounding)) & ~(quiet_time(of, start, rounding) > h)
    some = np.flatnonzero(is_open & ~open_[slot, lane] & (of.node.half_period < NEVER[h.dtype]))
    if some.size:
        of, start, end, h, rounding = take((of, start, end, h, rounding), some)
        ends_there = slot[some] == on.found[lane[some]]
        is_open[some] = ~is_held_up_by_bernstein(of, start, end, h, ends_there, rounding)
    return slot[is_open], lane[is_open]


def cut_inside(on: Interval, slot: Numbers, lane: Numbers, d: Array, d_then: Array) -> Flags:
    """Rule 4, a look inside intervals of functions without certificate: true where there is a root, or still none, and
    the interval ends there.
    """
    is_cut = np.zeros(on.low.shape, np.bool_)
    if not lane.size:
        return is_cut
    of, start, end = on.of.at(slot, lane), on.start[:, slot, lane], on.end[:, slot, lane]
    low, high, before, after = on.low[lane], on.high[lane], d[slot, lane], d_then[slot, lane]
    h = high - low
    # Where d has its root: the chord's, but not behind the middle; a quarter of it where it has no two signs.
    changes = ((before < 0.0) != (after < 0.0)) & (np.abs(after) > 0.0)
    cut = low + np.clip(choose(changes, before / (before - after), 0.25), 0.015625, 0.5) * h
    dips = ~(before < 0.0) & ~(after < 0.0) & (start[1] < 0.0) & ~(end[1] < 0.0)
    cuts = (cut > low) & (cut < high) & ~dips  # else it is too short to be cut
    if dips.any():
        within = take((of, low, start, high, end, on.propagator.take(lane, -1)), dips)
        t, lowest = minimum_between(*within)
        least = jets_of(within[0], lowest)
        cut[dips], cuts[dips] = t, least[0] < -rounding_of(within[0], lowest, t, least[1])
    on.found[lane[cuts]], is_cut[lane[cuts]] = NONE, True
    np.minimum.at(on.high, lane[cuts], cut[cuts])
    return is_cut


def settle_ties(on: Interval, lanes: Numbers) -> None:
    """Two roots within rounding are at the same time, and the function that is listed first wins."""
    found, h = on.found[lanes], (on.high - on.low)[lanes]
    value, rate, rounding = on.end[0][:, lanes], on.end[1][:, lanes], on.rounding[:, lanes]
    near = (value - 4.0 * rounding) * np.abs(on.end[1, found, lanes]) < np.abs(rate) * on.rounding[found, lanes]
    ties = (rate * h < -16.0 * rounding) & near & (found > SLOT)
    on.found[lanes] = np.where(ties.any(axis=0), ties.argmax(axis=0), found)


def find_first_root(on: Interval) -> Flags:
    """End intervals at the first root in them, if they have one. True where that is certified; the others have been cut
    and are looked at again.
    """
    on.propagator[...] = propagator_at(on.of.poles, on.high)
    look_there(on, slice(None))
    searched = np.flatnonzero(~on.is_quiet)
    on.tries[searched] += 1
    open_ = end_at_first_crossing(on, searched)
    d, d_then = deflated(on, on.start, on.low), deflated(on, on.end, on.high)
    slot, lane = uncertified(on, open_, d, d_then)
    certified = ~cut_inside(on, slot, lane, d, d_then)
    settle_ties(on, np.flatnonzero(certified & (on.found > 0)))
    return certified


def give_up(on: Interval, ended: Flags) -> Flags:
    """Phases that have no certificate within the bound: they are found UNKNOWN from the start of their interval on."""
    over = ~ended & ~on.is_quiet & (on.tries >= MOST_INTERVALS)
    if over.any():
        on.high[over], on.found[over] = on.low[over], UNKNOWN
        on.propagator[:, over] = propagator_at(on.of.poles[:, over], on.low[over])
    return over


# ---- closed forms, contacts ----


def time_to_rest(poles: Poles, v: Array, acc: Array) -> Array:
    """Rule 3: when masses that slip alone come to rest, NEVER if they do not: v and v' = acc at t = 0, times their
    signs.

    v'' + p v' + q v = 0 without a constant force, so v keeps its relative accuracy however far it has faded: its first
    zero is where v cos(w t) + (acc + p v/2) sin(w t)/w is 0, or where two decays have become equal.
    """
    never = NEVER[v.dtype]
    mean = 0.5 * poles.p
    discriminant = mean * mean - poles.q
    rings, root = discriminant < 0.0, np.sqrt(np.abs(discriminant))
    fast = mean + root
    back = -(acc + choose(fast > 0.0, poles.q / fast, 0.0) * v)  # what the slow decay alone would leave over
    ahead = v / back
    x = 2.0 * root * ahead
    soon = choose(x > 0.0, -np.log1p(-x) / x, 1.0) * ahead
    later = -np.log(-(acc + fast * v) / back) / (2.0 * root)
    vanishes = (back > 0.0) & (x < 1.0) & ((x < 0.25) | (acc + fast * v < 0.0))
    of_decay = choose(vanishes, choose(x < 0.25, soon, later), never)
    of_ringing = np.arctan2(v, -(acc + mean * v) / root) / root
    at_rest = choose(acc > 0.0, choose(rings, np.pi / root, never), choose(acc < 0.0, np.zeros_like(v), never))
    return choose(v > 0.0, choose(rings, of_ringing, of_decay), at_rest)


def steady_state_correction(of: EventSet, settled: Array, basis: Basis, t: Array) -> Array:
    """Correction to a root estimate from the steady-state form of g, which keeps its digits after the transients have
    decayed; 0 where it is no more accurate.
    """
    poles, (H3, H2, H1), start, eps = Poles(*of.poles), of.numerator, of.start, EPS[t.dtype]
    residual = settled - start
    slow, by_2 = poles.s_3 > 0.0, residual * poles.s_2  # else W does not fade, but is not in it
    fading = Numerator(H3, choose(slow, H2, by_2), H1)
    value = settled - formulas.residual_to_steady_state(poles, fading, basis, residual)
    rate = H3 * basis.Wdd + H2 * basis.Wd + H1 * basis.W
    of_time = t * np.abs(rate)
    of_rise = np.abs(start) + np.abs(H3 * basis.Wd) + np.abs(H2 * basis.W) + np.abs(H1 * basis.W1) + of_time
    of_residual = np.abs(settled) + np.abs(residual * basis.Wdd) + of_time
    of_residual += (np.abs(H3) + np.abs(residual * poles.s_1)) * np.abs(basis.Wd)
    of_residual += choose(slow, np.abs(H2) + np.abs(by_2), 0.0) * np.abs(basis.W)
    better = (rate < 0.0) & (of_residual < 0.25 * of_rise) & (np.abs(value) <= 16.0 * eps * of_rise)
    later = choose(better, -value / rate, 0.0)
    return choose((np.abs(later) < 0.01 * t) & (np.abs(later) > 16.0 * eps * t), later, 0.0)
