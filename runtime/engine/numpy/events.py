# SPDX-License-Identifier: MIT-0
"""The first root of a function of time within a phase, with nothing stepped over.

For g = y, v_1, v_2 or a free acceleration, (d/dt + a) g' = exp(-a t) d/dt(exp(a t) g') is a motion of the pair of poles
alone, whose zeros are known in closed form. Between two of them exp(a t) g' is monotone, so g' has at most one
root there, and between roots of g' the function g is monotone: each root is bracketed. All lanes at once.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform_solver import formulas
from hopform_solver.kernels import basis_at, decay_at
from hopform_solver.lanes import Array, Lanes, put, take
from hopform_solver.limits import NEVER
from hopform_solver.records import Numerator, Poles


class Watch(NamedTuple):
    """Functions g(t) = start + rise(t) that begin with a sign, and are watched until they lose it."""

    poles: Poles
    numerator: Numerator
    start: Array
    sign: Array


class Sample(NamedTuple):
    """g and its derivatives at t, each times the sign; `noise` is what rounding may have done to g."""

    t: Array
    value: Array
    rate: Array
    curvature: Array
    noise: Array


def lanes_of(watch: Watch, lanes: Lanes) -> Watch:
    return Watch(take(watch.poles, lanes), take(watch.numerator, lanes), watch.start[lanes], watch.sign[lanes])


def sample_at(watch: Watch, t: Array) -> Sample:
    basis = basis_at(watch.poles, t)
    rise = formulas.step_response(watch.poles, watch.numerator, basis)
    H3, H2, H1 = (np.abs(field) for field in watch.numerator)
    Wd, W, W1 = (np.abs(field) for field in basis[1:4])
    ulps = 16.0 * np.finfo(t.dtype).eps
    rate = watch.sign * rise.rise_rate
    return Sample(
        t,
        watch.sign * (watch.start + rise.rise),
        rate,
        watch.sign * rise.rise_curvature,
        ulps * (np.abs(watch.start) + H3 * Wd + H2 * W + H1 * W1 + t * np.abs(rate)),
    )


def root_is_later(watch: Watch, settled: Array, t: Array) -> Array:
    """How much later than t the root next to it is.

    Where the poles have faded, the start and the rise cancel, and with them most digits of the time; the final value
    and what is left of the way to it do not. 0 where they tell no more.
    """
    poles, (H3, H2, H1), start, basis = watch.poles, watch.numerator, watch.start, basis_at(watch.poles, t)
    way = settled - start
    slow, by_2 = poles.s_3 > 0.0, way * poles.s_2  # else W does not fade, but is not in it
    fading = Numerator(H3, np.where(slow, H2, by_2), H1)
    value = settled - formulas.residual_to_steady_state(poles, fading, basis, way)
    rate = H3 * basis.Wdd + H2 * basis.Wd + H1 * basis.W
    of_time = t * np.abs(rate)
    of_rise = np.abs(start) + np.abs(H3 * basis.Wd) + np.abs(H2 * basis.W) + np.abs(H1 * basis.W1) + of_time
    of_way = np.abs(settled) + np.abs(way * basis.Wdd) + of_time
    of_way += (np.abs(H3) + np.abs(way * poles.s_1)) * np.abs(basis.Wd)
    of_way += np.where(slow, np.abs(H2) + np.abs(by_2), 0.0) * np.abs(basis.W)
    tells = (rate < 0.0) & (of_way < 0.25 * of_rise) & (np.abs(value) <= 16.0 * np.finfo(t.dtype).eps * of_rise)
    later = np.zeros_like(t)
    later[tells] = -value[tells] / rate[tells]
    return np.where((np.abs(later) < 0.01 * t) & (np.abs(later) > 16.0 * np.finfo(t.dtype).eps * t), later, 0.0)


def zeros_of_pair(watch: Watch) -> tuple[Array, Array]:
    """First zero and spacing of the motion of the pair that is left of g' behind the real pole; infinite if none."""
    left = formulas.deflated_numerator(watch.poles, watch.numerator)
    never = NEVER[watch.start.dtype]
    first, spacing = np.full_like(watch.start, never), np.full_like(watch.start, never)
    mean = 0.5 * watch.poles.p
    discriminant = mean * mean - watch.poles.q
    root = np.sqrt(np.abs(discriminant))
    slope = left.B - mean * left.A  # A cos(omega t) + slope sin(omega t)/omega
    some = (left.A != 0.0) | (slope != 0.0)
    if (swings := some & (discriminant < 0.0)).any():
        omega = root[swings]
        angle = np.arctan2(-left.A[swings], slope[swings] / omega)
        spacing[swings] = np.pi / omega
        first[swings] = np.where(angle > 0.0, angle, angle + np.pi) / omega
    # A cosh(w t) + slope sinh(w t)/w: at most one zero, where tanh(w t)/w = -A/slope.
    if (creeps := some & (discriminant >= 0.0) & (slope != 0.0)).any():
        ratio = -left.A[creeps] / slope[creeps]
        tangent = root[creeps] * ratio
        found = (ratio > 0.0) & (tangent < 1.0)
        far = found & (tangent > 0.001)
        zero = np.full_like(ratio, never)
        zero[far] = 0.5 * np.log((1.0 + tangent[far]) / (1.0 - tangent[far])) / root[creeps][far]
        near = found & ~far
        zero[near] = ratio[near] * (1.0 + tangent[near] * tangent[near] / 3.0)
        first[creeps] = zero
    return first, spacing


def halt_time(poles: Poles, v: Array, acc: Array) -> Array:
    """When masses that slip alone come to rest, NEVER if they do not: v and v' = acc at t = 0, times their signs.

    v'' + p v' + q v = 0 without a constant force, so v keeps its relative accuracy however far it has faded: its first
    zero is where v cos(w t) + (acc + p v/2) sin(w t)/w is 0, or where two decays have become equal.
    """
    never = NEVER[v.dtype]
    time = np.full_like(v, never)
    mean = 0.5 * poles.p
    discriminant = mean * mean - poles.q
    root = np.sqrt(np.abs(discriminant))
    swings, rests = discriminant < 0.0, ~(v > 0.0)
    half_turn = np.full_like(v, never)
    half_turn[swings] = np.pi / root[swings]
    time[rests] = np.where(acc > 0.0, half_turn, np.where(acc < 0.0, 0.0, never))[rests]
    if (some := swings & ~rests).any():
        w = root[some]
        time[some] = np.arctan2(v[some], -(acc + mean * v)[some] / w) / w
    back = -(acc + poles.q / np.where(swings, 1.0, mean + root) * v)  # what the slow decay alone would leave over
    if (some := ~swings & ~rests & (back > 0.0)).any():
        v_s, back_s, root_s = v[some], back[some], root[some]
        x = 2.0 * root_s * (v_s / back_s)
        near, found = x < 0.25, (x < 1.0) & (acc[some] + (mean + root)[some] * v_s < 0.0)
        times = v_s / back_s
        small, large = near & (x > 0.0), ~near & found
        times[small] *= -np.log1p(-x[small]) / x[small]
        left = -(acc + (mean + root) * v)[some][large]
        times[large] = -np.log(left / back_s[large]) / (2.0 * root_s[large])
        time[some] = np.where(found, times, never)
    return time


def is_quiet(watch: Watch, start: Array, end: Array) -> np.ndarray:
    """True where g has no root in [start, end]: its slow part, monotone, stays larger than its oscillation."""
    mean = 0.5 * watch.poles.p
    omega = np.sqrt(watch.poles.q - mean * mean)
    chi = formulas.residue(watch.poles)
    first = formulas.ringing_at(watch.poles, chi, watch.numerator, decay_at(watch.poles.a, start))
    last = formulas.ringing_at(watch.poles, chi, watch.numerator, decay_at(watch.poles.a, end))
    least = np.minimum(watch.sign * (watch.start + first.slow), watch.sign * (watch.start + last.slow))
    amplitude = np.abs(first.X) + np.abs((first.Y - mean * first.X) / omega)
    return np.asarray(least > 1.001 * amplitude * np.exp(-mean * start))


def root_between(watch: Watch, low: Array, last: Sample) -> Array:
    """The roots of g between times where g > 0 and samples where g < 0: Halley's step, kept in the bracket."""
    eps = np.finfo(low.dtype).eps
    low, high = low.copy(), last.t.copy()
    root = high.copy()
    lanes = np.arange(low.size)
    for n in range(100):
        slope = last.rate * last.rate - 0.5 * last.value * last.curvature
        usable = slope != 0.0
        step = np.zeros_like(slope)
        step[usable] = (last.value * last.rate)[usable] / slope[usable]
        done = np.abs(last.value) <= eps * last.t * np.abs(last.rate)  # Newton's step: Halley's is 0 at an extremum
        root[lanes[done]] = last.t[done]
        new = last.t - step
        outside = ~usable | ~((new > low) & (new < high))
        if n > 8 and n % 2 == 1:
            outside |= True
        new = np.where(outside, low + 0.5 * (high - low), new)
        stuck = ~done & ~((new > low) & (new < high))
        root[lanes[stuck]] = high[stuck]
        going = ~done & ~stuck
        if not going.any():
            return root
        lanes, low, high, new, watch = lanes[going], low[going], high[going], new[going], lanes_of(watch, going)
        last = sample_at(watch, new)
        low = np.where(last.value > 0.0, new, low)
        high = np.where(last.value < 0.0, new, high)
        exact = last.value == 0.0
        low, high = np.where(exact, new, low), np.where(exact, new, high)
        root[lanes] = high
    return root


def extremum_between(watch: Watch, low: Array, high: Array, sign_after: float) -> Sample:
    """The extrema of g between times at which its rates differ in sign; stops early where g < 0 is found."""
    tolerance = 0.001 * np.sqrt(np.finfo(low.dtype).eps)
    low, high = low.copy(), high.copy()
    last = sample_at(watch, low + 0.5 * (high - low))
    found = Sample(*(field.copy() for field in last))
    lanes = np.arange(low.size)
    for n in range(100):
        going = ~((sign_after > 0.0) & (last.value < -last.noise))
        # Where nothing is left that could move g its rate has no sign: the extremum lies before.
        faded = (np.abs(last.rate) * last.t <= last.noise) & (np.abs(last.curvature) * last.t * last.t <= last.noise)
        ahead = (sign_after * last.rate < 0.0) & ~faded
        high, low = np.where(ahead, high, last.t), np.where(ahead, last.t, low)
        usable = last.curvature != 0.0
        step = np.zeros_like(last.rate)
        step[usable] = last.rate[usable] / last.curvature[usable]
        usable &= ~faded
        going &= ~(usable & (np.abs(step) <= tolerance * last.t))
        new = last.t - step
        outside = ~usable | ~((new > low) & (new < high))
        if n > 8 and n % 2 == 1:
            outside |= True
        new = np.where(outside, low + 0.5 * (high - low), new)
        going &= (new > low) & (new < high)
        if not going.any():
            break
        lanes, low, high, watch = lanes[going], low[going], high[going], lanes_of(watch, going)
        last = sample_at(watch, new[going])
        for field, value in zip(found, last, strict=True):
            field[lanes] = value
    return found


def quiet_until(watch: Watch, start: Array, limit: Array, half_turn: Array) -> Array:
    """Up to where g has no root, from `start` on: the far end, or nearer ends while they are many half turns away."""
    until = start.copy()
    reach = limit - start
    open_ = reach > 8.0 * half_turn
    while open_.any():
        lanes = np.flatnonzero(open_)
        end = start[lanes] + reach[lanes]
        quiet = is_quiet(lanes_of(watch, lanes), start[lanes], end)
        until[lanes[quiet]] = end[quiet]
        open_[lanes[quiet]] = False
        reach = 0.125 * reach
        open_ &= reach > 8.0 * half_turn
    return until


def brief_rise(watch: Watch, t: Array) -> Array:
    """Root of a g that rises from zero at t and falls again within too short a time for rounding to show its top."""
    start = sample_at(watch, t)
    falls = start.curvature < 0.0
    first = t + np.where(falls, 2.0 * start.rate / np.where(falls, -start.curvature, 1.0), 0.0)
    root = first.copy()
    for _ in range(4):
        there = sample_at(watch, root)
        steep = there.rate < 0.0
        step = np.zeros_like(root)
        step[steep] = there.value[steep] / there.rate[steep]
        root = np.where(np.abs(step) < 0.5 * (first - t), root - step, root)
    return np.where(np.abs(root - first) < 0.5 * (first - t), root, first)


class _Search:
    """Where each lane's search stands: the last time looked at, with g and g' there, and how many zeros lie behind."""

    def __init__(self, watch: Watch, limit: Array) -> None:
        self.watch, self.limit = watch, limit
        self.never = NEVER[watch.start.dtype]
        self.first, self.spacing = zeros_of_pair(watch)
        self.t, self.rate = np.zeros_like(watch.start), watch.sign * watch.numerator.H3
        value = watch.sign * watch.start
        self.root = np.where((value < 0.0) & (self.rate <= 0.0), np.zeros_like(value), np.full_like(value, self.never))
        self.value = np.maximum(value, 0.0)
        self.turn, self.patience = np.zeros_like(value), np.full_like(value, 8.0)

    def next_time(self, lanes: Lanes) -> Array:
        """The next zero of the pair, or the limit."""
        turn = self.turn[lanes]
        ahead = np.where(turn > 0.0, turn * np.where(turn > 0.0, self.spacing[lanes], 0.0), 0.0)
        self.turn[lanes] += 1.0
        return np.asarray(np.minimum(self.first[lanes] + ahead, self.limit[lanes]))

    def move(self, lanes: Lanes, here: Sample) -> None:
        self.t[lanes], self.value[lanes], self.rate[lanes] = here.t, np.maximum(here.value, 0.0), here.rate

    def look(self, lanes: Lanes) -> np.ndarray:
        """Look at the next monotone piece of some lanes; True where it ends the search with a root."""
        part = lanes_of(self.watch, lanes)
        here = sample_at(part, self.next_time(lanes))
        before_t, before_rate = self.t[lanes], self.rate[lanes]
        from_zero = ~(self.value[lanes] > 0.0)
        # Below zero by more than rounding, or so steep that the root is near; else it touches, or has faded away.
        steep = here.rate * (here.t - before_t) < -here.noise
        crosses = (here.value < 0.0) & ((here.value < -here.noise) | steep)
        low, last = before_t.copy(), Sample(*(field.copy() for field in here))
        lost = crosses & from_zero & ~(before_rate > 0.0)
        if (rises := crosses & from_zero & (before_rate > 0.0)).any():
            top = extremum_between(lanes_of(part, rises), before_t[rises], here.t[rises], -1.0)
            low[rises] = np.where(top.value > 0.0, top.t, before_t[rises])
            lost[rises] = ~(top.value > 0.0)
        if (dips := ~crosses & (before_rate < 0.0) & ~steep).any():  # a rate that has faded may hide one
            bottom = extremum_between(lanes_of(part, dips), before_t[dips], here.t[dips], 1.0)
            put(last, dips, bottom)
            crosses[dips] = bottom.value < -bottom.noise
            lost[dips] = crosses[dips] & from_zero[dips]
        self.root[lanes[lost]] = before_t[lost]
        if (brief := lost & from_zero & (before_rate > 0.0)).any():
            self.root[lanes[brief]] = brief_rise(lanes_of(part, brief), before_t[brief])
        if (bracketed := crosses & ~lost).any():
            self.root[lanes[bracketed]] = root_between(lanes_of(part, bracketed), low[bracketed], take(last, bracketed))
        self.move(lanes, here)
        return np.asarray(crosses)

    def skip(self, lanes: Lanes) -> None:
        """Lanes that have waited for long jump over the time in which g certainly has no root."""
        self.patience[lanes] -= 1.0
        many = self.limit[lanes] - self.t[lanes] > 8.0 * np.minimum(self.spacing[lanes], 0.1 * self.never)
        waits = lanes[(self.patience[lanes] <= 0.0) & (self.spacing[lanes] < self.never) & many]
        if not waits.size:
            return
        until = quiet_until(lanes_of(self.watch, waits), self.t[waits], self.limit[waits], self.spacing[waits])
        skips = until > self.t[waits]
        self.patience[waits[~skips]] = 8.0
        if skips.any():
            ahead = waits[skips]
            self.move(ahead, sample_at(lanes_of(self.watch, ahead), until[skips]))
            self.turn[ahead] = np.floor((self.t[ahead] - self.first[ahead]) / self.spacing[ahead]) + 1.0


def first_roots(watch: Watch, limit: Array, phase: NDArray[np.intp], tie: float) -> Array:
    """First times in (0, limit] at which each g loses its sign, NEVER where it keeps it.

    Those with the same number of a phase are watched together: once one has lost its sign, the others are followed no
    longer than to the same time, and a share `tie` of it more. An extremum within rounding of zero is a touch, not a
    crossing, and so is a g that fades away below its rounding. A g that starts at zero is taken to begin with its sign;
    the zero at the start is no root.
    """
    search = _Search(watch, limit)
    first = np.full(phase.max(initial=-1) + 1, search.never, dtype=limit.dtype)
    np.minimum.at(first, phase, search.root)
    search.limit = np.minimum(limit, first[phase] * (1.0 + tie))
    lanes = np.flatnonzero((search.root == search.never) & (search.t < search.limit))
    while lanes.size:
        found = search.look(lanes)
        if found.any():
            np.minimum.at(first, phase[lanes[found]], search.root[lanes[found]])
            search.limit[lanes] = np.minimum(search.limit[lanes], first[phase[lanes]] * (1.0 + tie))
        lanes = lanes[~found & (search.t[lanes] < search.limit[lanes])]
        search.skip(lanes)
        lanes = lanes[search.t[lanes] < search.limit[lanes]]
    return search.root
