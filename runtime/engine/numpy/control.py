# SPDX-License-Identifier: MIT-0
"""The current after which the next apex is the desired one, (25)-(27) in their exact form: apex(u) = h_des.

The range of u is a row of cells between currents that were tried. A cell is left when the values and slopes at its ends
say that nothing better lies in it, else it is split: around the root, extremum or limit that they foretell, and evenly.
All cells that are not done are split at once into many, from a grid on, as a wave of currents costs about the same
however many there are: no step of this follows the order in which the C library goes.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hopform_solver.lanes import Array, Flags, Numbers, take
from hopform_solver.lanes import choose as either
from hopform_solver.limits import NEAR_WITHIN, REACHED_WITHIN
from hopform_solver.records import COMMANDS, LegState, Robot
from hopform_solver.trial import Trials, try_currents

REACHED, NEAREST, NO_TAKEOFF = COMMANDS

GRID = 128
"""Cells to begin with."""
LANES = 192
"""Currents of a wave, about."""
WAVES = 60
"""How often all cells are split at most."""
CLUSTER = (-(2.0**-5), -(2.0**-12), 0.0, 2.0**-12, 2.0**-5)
"""Where currents are tried around a predicted one, as shares of the cell."""
WIDE, COARSE, DOWN, STEP, EDGE = 0.5, 0.25, 0.0625, 1.0 / 256.0, 1.0 / 64.0
"""How wide a cell may be, as a share of u_max, to be judged by its ends: where the events are the same at both, where
not, where neither takes off, where one does, and where x_1 reaches its limit.
"""
LEAN, BEND, KINK, DEPTH = 0.25, 0.03125, 0.5, 1.0
"""How far functions may be off what the ends foretell, as in the C library."""


def pick(where: Flags, first: Trials, second: Trials) -> Trials:
    """The trials of `first` where a condition holds, those of `second` elsewhere."""
    return Trials(*(np.where(where, one, other) for one, other in zip(first, second, strict=True)))


@dataclass
class _Search:
    robot: Robot
    start: LegState
    wanted: float
    stop_margin: float
    horizon: float
    max_phases: int
    dtype: np.dtype[Any]
    solved: int = 0
    u: float = 0.0
    gap: float = np.inf  # of the best so far, inf while none is admissible

    def __post_init__(self) -> None:
        self.eps = float(np.finfo(self.dtype).eps)
        self.movable = self.robot.x1_min < self.robot.x1_max
        self.limit = self.robot.x1_max - self.stop_margin - 16.0 * self.eps if self.movable else np.inf
        self.reach, self.near = REACHED_WITHIN[self.dtype], NEAR_WITHIN[self.dtype]

    def admits(self, trials: Trials) -> Flags:
        return np.asarray(trials.takes_off & (trials.largest_x1 < self.limit))

    def attempt(self, u: Array) -> Trials:
        trials = try_currents(self.robot, self.start, u.astype(self.dtype), self.horizon, self.max_phases)
        self.solved += u.size
        lanes = np.flatnonzero(self.admits(trials))
        if lanes.size:
            score = np.maximum(np.abs(trials.apex[lanes] - self.dtype.type(self.wanted)), self.reach)
            best = lanes[np.lexsort((np.abs(trials.u[lanes]), score))[0]]
            new = float(trials.apex[best]) - self.wanted
            key = max(abs(new), self.reach), abs(float(trials.u[best]))
            if key < (max(abs(self.gap), self.reach), abs(self.u)):
                self.u, self.gap = float(trials.u[best]), new
        return trials


@dataclass
class _Curve:
    """Functions of u on cells: values and slopes at both ends, and whether they are smooth in between.

    spread: how much the slopes differ from the chord's. lean: their sum less twice the chord's, 0 for a parabola.
    doubt: how far a slope may be off that of the cubic which the ends determine.
    """

    from_: Array
    from_rate: Array
    to: Array
    to_rate: Array
    width: Array
    smooth: Flags

    def __post_init__(self) -> None:
        self.chord: Array = (self.to - self.from_) / self.width
        self.spread = np.abs(self.from_rate - self.chord) + np.abs(self.to_rate - self.chord)
        self.lean: Array = self.from_rate + self.to_rate - 2.0 * self.chord
        self.doubt: Array = LEAN * np.abs(self.lean) + BEND * self.spread
        self.half: Array = self.from_rate + self.lean - self.chord

    @property
    def mirrored(self) -> "_Curve":
        return _Curve(-self.from_, -self.from_rate, -self.to, -self.to_rate, self.width, self.smooth)

    @property
    def rises(self) -> Flags:
        lean, half, end = self.lean, self.half, np.minimum(self.from_rate, self.to_rate)
        turns = (lean > 0.0) & (half > 0.0) & (half < 3.0 * lean)
        inside = np.where(turns, np.minimum(end, self.from_rate - half * half / (3.0 * lean)), end)
        kinked = (end > 0.0) & (self.chord > 0.0) & (self.spread <= KINK * end)
        return np.where(self.smooth, inside > 4.0 * self.doubt, kinked)

    @property
    def monotone(self) -> Flags:
        return np.asarray(self.rises | self.mirrored.rises)

    @property
    def share_of_minimum(self) -> Array:
        """Where the cubic has its minimum, as a share of the cell; -1 if there is none in it."""
        half, lean = self.half, self.lean
        root = np.sqrt(np.maximum(half * half - 3.0 * lean * self.from_rate, 0.0))
        share = np.where(half < 0.0, self.from_rate / (half - root), (half + root) / (3.0 * lean))
        return np.where((root > 0.0) & (share > 0.0) & (share < 1.0), share, -1.0)

    @property
    def least(self) -> Array:
        """The least that the functions are taken to be on their cells."""
        end, share, chord = np.minimum(self.from_, self.to), self.share_of_minimum, self.chord
        from_bend, to_bend = self.from_rate - chord, self.to_rate - chord
        bend = from_bend * (1.0 - share) - to_bend * share
        cubic = self.from_ + self.width * share * (chord + (1.0 - share) * bend)
        curved = np.where(share > 0.0, np.minimum(end, cubic), end) - self.width * self.doubt
        convex = (-(self.lean + from_bend) > 4.0 * self.doubt) & (self.lean + to_bend > 4.0 * self.doubt)
        tangents = self.from_ + self.width * self.from_rate * to_bend / (self.to_rate - self.from_rate)
        tangents = np.where((self.from_rate < 0.0) & (self.to_rate > 0.0), tangents, end)
        smooth = np.where(convex, tangents, curved)
        return np.where(self.monotone, end, np.where(self.smooth, smooth, end - DEPTH * self.width * self.spread))

    @property
    def share_of_root(self) -> Array:
        """Where they vanish: the inverse as a cubic, the chord's root where a slope is against it."""
        t, chord = self.from_ / (self.from_ - self.to), self.chord
        along = (self.from_rate * chord > 0.0) & (self.to_rate * chord > 0.0)
        begin, end = np.minimum(chord / self.from_rate, 3.0), np.minimum(chord / self.to_rate, 3.0)
        return np.where(along, t * (begin + t * (3.0 - 2.0 * begin - end + t * (begin + end - 2.0))), t)

    @property
    def share_of_turn(self) -> Array:
        """Where they have their extremum if they come nearer to zero inside, else -1."""
        return np.where(self.from_ > 0.0, self.share_of_minimum, self.mirrored.share_of_minimum)


@dataclass
class _Cells:
    """Neighbouring currents; what their trials say of the range between them."""

    search: _Search
    from_: Trials
    to: Trials

    def __post_init__(self) -> None:
        self.width = self.to.u - self.from_.u
        self.smooth = (self.from_.events == self.to.events) & self.from_.smooth & self.to.smooth

    def curve(self, name: str, level: Any = 0.0) -> _Curve:
        """What the trials say of a quantity, counted from a level."""
        values, rates = ([getattr(end, of) for end in (self.from_, self.to)] for of in (name, f"{name}_u"))
        return _Curve(values[0] - level, rates[0], values[1] - level, rates[1], self.width, self.smooth)

    @property
    def gap(self) -> _Curve:
        """The apex less what is wanted; an end that reaches it counts as being on the side of the other one."""
        wanted, reach = self.width.dtype.type(self.search.wanted), self.width.dtype.type(self.search.reach)
        gap = self.curve("apex", wanted)
        ends_at, starts_at = np.abs(gap.to) <= reach, np.abs(gap.from_) <= reach
        shown_to = np.where(ends_at, np.where(gap.from_ > 0.0, reach, -reach), gap.to)
        shown_from = np.where(starts_at & ~ends_at, np.where(gap.to > 0.0, reach, -reach), gap.from_)
        return replace(gap, from_=shown_from, to=shown_to)

    @property
    def largest_x1(self) -> _Curve:
        return self.curve("largest_x1", self.width.dtype.type(self.search.limit))

    @property
    def quiet(self) -> Flags:
        """No rebound takes off that does not do so at the ends: the least y of each stays above zero."""
        in_from, in_to = np.isfinite(self.from_.least_contact), np.isfinite(self.to.least_contact)
        known = pick(in_from, self.from_, self.to)
        one = known.least_contact > self.width * np.abs(known.least_contact_u)
        fine = self.width <= np.sqrt(self.search.eps) * self.search.robot.u_max
        both = self.curve("least_contact").least > 0.0
        return np.asarray(fine | ~(in_from | in_to) | np.where(in_from & in_to, both, one))

    @property
    def share_of_limit(self) -> Array:
        """Where x_1 reaches its limit, as a share of the cell: by both ends where it rises or falls throughout, else by
        the slope at the admissible one; far outside if that does not lead there.
        """
        starts, largest = self.search.admits(self.from_), self.largest_x1
        room = either(starts, largest.from_, largest.to)
        toward = np.where(starts, largest.from_rate, -largest.to_rate) * self.width
        share = np.where((toward > 0.0) & (room + toward >= 0.0), -room / toward, np.inf)
        return np.where(largest.monotone, largest.share_of_root, np.where(starts, share, 1.0 - share))

    @property
    def promise_of_edge(self) -> Array:
        """The nearest that an admissible current can come where only a part, next to one end, is admissible."""
        gap, starts, there = self.gap, self.search.admits(self.from_), self.share_of_limit
        share = 2.0 * np.where(starts, there, 1.0 - there)
        rate = np.abs(gap.from_rate) + np.abs(gap.to_rate) + np.abs(gap.chord)
        known = self.largest_x1.monotone | (self.width <= EDGE * self.search.robot.u_max)
        inside = np.abs(either(starts, gap.from_, gap.to))
        return np.where(known & (share <= 1.0), inside - rate * share * self.width, 0.0)

    @property
    def promise_of_step(self) -> Array:
        """The same where one end takes off and the other does not: the apex ends like a square root."""
        lifts = self.from_.takes_off
        end = pick(lifts, self.from_, self.to)
        hopeless = ~(end.largest_x1 - 2.0 * self.width * np.abs(end.largest_x1_u) < self.search.limit)
        away = np.abs(end.apex - self.search.wanted) - 3.0 * self.width * np.abs(end.apex_u)
        fine = self.width <= STEP * self.search.robot.u_max
        return np.where(fine, np.where(hopeless, np.inf, away), 0.0)

    @property
    def promise(self) -> Array:
        """What no admissible current in the cell comes nearer than, as far as its ends tell; inf if there is none in
        it.
        """
        search, from_, to, gap, range_ = self.search, self.from_, self.to, self.gap, self.search.robot.u_max
        in_from, in_to = search.admits(from_), search.admits(to)
        whole = np.where(gap.from_ > 0.0, gap.least, gap.mirrored.least)
        both = np.where(in_from == in_to, whole, np.maximum(whole, self.promise_of_edge))
        both = np.where(~in_from & ~in_to & (self.largest_x1.least >= 0.0), np.inf, both)
        none = ~from_.takes_off & ~to.takes_off
        judged = np.where(self.quiet, np.where(none, np.inf, both), 0.0)
        judged = np.where(from_.takes_off != to.takes_off, self.promise_of_step, judged)
        wide = self.width > np.where(none, DOWN, np.where(self.smooth, WIDE, COARSE)) * range_
        tiny = self.width <= 2.0 * search.eps * np.maximum(np.abs(from_.u), np.abs(to.u))
        return np.where((from_.held & to.held) | tiny, np.inf, np.where(wide, 0.0, judged))

    def done(self) -> Flags:
        """Whether all in the cells that might be better is known."""
        promise, search = self.promise, self.search
        least_u = np.minimum(np.abs(self.from_.u), np.abs(self.to.u))
        if abs(search.gap) <= search.reach:
            return np.asarray((promise >= search.reach) | (least_u >= abs(search.u)))
        return np.asarray((promise > max(abs(search.gap) - 2.0 * search.near, 0.0)) | np.isinf(promise))

    @property
    def predicted(self) -> Array:
        """Where to split each cell, as a share of it; not between 0 and 1 where the ends do not foretell it."""
        search, from_, to, gap = self.search, self.from_, self.to, self.gap
        in_from, in_to = search.admits(from_), search.admits(to)
        steep = (np.abs(gap.from_rate) + np.abs(gap.to_rate) + np.abs(gap.chord)) * self.width
        aside = 0.25 * search.near / (steep + search.near)
        limit = self.share_of_limit + np.where(in_from, -aside, aside)
        turn = np.where(in_from, gap.share_of_turn, self.largest_x1.share_of_turn)
        lifted = np.where(gap.from_ * gap.to < 0.0, gap.share_of_root, np.where(in_from != in_to, limit, turn))
        minima = np.isfinite(from_.least_contact) & np.isfinite(to.least_contact)
        grounded = np.where(minima, self.curve("least_contact").share_of_turn, -1.0)
        unlike = from_.takes_off != to.takes_off
        share = np.where(unlike, -1.0, np.where(from_.takes_off, lifted, grounded))
        return np.where(np.isfinite(share), share, -1.0)

    def split(self) -> tuple[Array, Numbers]:
        """Currents to try, and the cell that each is in; in order."""
        number = min(max(LANES // self.width.size, 1), 31)
        even = np.arange(1, number + 1) / (number + 1.0)
        evenly, around = np.tile(even, (self.width.size, 1)), self.predicted[:, None] + np.array(CLUSTER)
        shares = np.concatenate([evenly, around], axis=1)
        root = self.smooth & (self.gap.from_ * self.gap.to < 0.0)
        shares[root, :number] = 0.5
        u = np.sort(self.from_.u[:, None] + (shares * self.width[:, None]).astype(self.width.dtype), axis=1)
        inside = (u > self.from_.u[:, None]) & (u < self.to.u[:, None])
        inside[:, 1:] &= u[:, 1:] > u[:, :-1]
        cell, place = np.nonzero(inside)
        return u[cell, place], cell


@np.errstate(all="ignore")
def choose(
    robot: Robot, start: LegState, target: tuple[float, float, float, float], max_phases: int, dtype: type[np.floating]
) -> tuple[float, float, int, int]:
    """Current [A], hop height [m] (0 without take-off), REACHED, NEAREST or NO_TAKEOFF, and how many stances were
    solved.

    robot and start hold floats; target: h_des, datum, stop_margin [m], horizon [s]. No input is checked here.
    """
    h_des, datum, stop_margin, horizon = target
    search = _Search(robot, start, h_des + datum, stop_margin, horizon, max_phases, np.dtype(dtype))
    if robot.u_max > 0.0 and search.movable and start.x1 < search.limit:
        _search(search)
    else:
        search.attempt(np.zeros(1))
    if not np.isfinite(search.gap):
        return 0.0, 0.0, NO_TAKEOFF, search.solved
    status = REACHED if abs(search.gap) <= search.near else NEAREST
    return search.u, search.gap + h_des, status, search.solved


def _search(search: _Search) -> None:
    grid = search.attempt(search.robot.u_max * np.linspace(-1.0, 1.0, GRID + 1))
    cells = _Cells(search, take(grid, np.arange(GRID)), take(grid, np.arange(1, GRID + 1)))
    for _ in range(WAVES):
        left = np.flatnonzero(~cells.done())
        if not left.size:
            return
        cells = _split(_Cells(search, take(cells.from_, left), take(cells.to, left)))


def _split(cells: _Cells) -> _Cells:
    """The cells between the ends and the currents that are tried inside."""
    u, cell = cells.split()
    every = np.arange(cells.width.size)
    tried = [cells.from_, cells.search.attempt(u), cells.to]
    columns: list[Any] = [np.concatenate(parts) for parts in zip(*tried, strict=True)]
    of = np.concatenate([every, cell, every])
    order = np.lexsort((columns[0], of))
    first, second = order[:-1], order[1:]
    pairs = of[first] == of[second]
    nodes = Trials(*columns)
    return _Cells(cells.search, take(nodes, first[pairs]), take(nodes, second[pairs]))
