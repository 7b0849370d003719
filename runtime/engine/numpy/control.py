# SPDX-License-Identifier: MIT-0
"""The current after which the next apex is the desired one, (25)-(27) in their exact form: apex(u) = h_des.

The range of u is a row of cells between currents that were tried. A cell is left when the values and slopes at its ends
say that nothing better lies in it, else it is split: around the root or limit that they foretell, and evenly.
All cells that are not done are split at once into many, from a grid on, as a wave of currents costs about the same
however many there are: no step of this follows the order in which the C library goes.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hopform_solver.elements import LARGEST_POSITION, POSITION, STOPS, Trials
from hopform_solver.lanes import Array, Flags, take
from hopform_solver.limits import NEAR_WITHIN, REACHED_WITHIN
from hopform_solver.records import COMMANDS, LegState, Robot
from hopform_solver.trial import try_currents

REACHED, NEAREST, NO_TAKEOFF = COMMANDS

GRID = 128
"""Cells to begin with."""
LANES = 192
"""Currents of a wave, about."""
WAVES = 60
"""How often all cells are split at most."""
CLUSTER = (-(2.0**-5), -(2.0**-12), 0.0, 2.0**-12, 2.0**-5)
"""Where currents are tried around a predicted one, as shares of the cell."""
WIDE, COARSE, DOWN, STEP = 0.5, 0.42, 0.0625, 1.0 / 256.0
"""How wide a cell may be, as a share of u_max, to be judged by its ends: where the events are the same at both, where
not, where neither takes off, and where one does.
"""
LEAN, BEND, KINK = 0.75, 0.03125, 1.5
"""How far functions may be off what the ends foretell, as in the C library."""


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
        lower, upper = (self.robot[stop] for stop in STOPS)
        self.movable = lower < upper
        self.limit = upper - self.stop_margin - 16.0 * self.eps if self.movable else np.inf
        self.reach, self.near = REACHED_WITHIN[self.dtype], NEAR_WITHIN[self.dtype]

    def admits(self, trials: Trials) -> Flags:
        return np.asarray(trials.takes_off & (getattr(trials, LARGEST_POSITION) < self.limit))

    def attempt(self, u: Array) -> Trials:
        trials = try_currents(self.robot, self.start, u.astype(self.dtype), self.horizon, self.max_phases)
        self.solved += u.size
        lanes = np.flatnonzero(self.admits(trials))
        if lanes.size:
            score = np.maximum(np.abs(trials.apex[lanes] - self.dtype.type(self.wanted)), self.reach)
            best = lanes[np.lexsort((np.abs(trials.u[lanes]), score))[0]]
            u_best, gap = float(trials.u[best]), float(trials.apex[best]) - self.wanted
            if (max(abs(gap), self.reach), abs(u_best)) < (max(abs(self.gap), self.reach), abs(self.u)):
                self.u, self.gap = u_best, gap
        return trials


class _Curve(NamedTuple):
    """Functions of u on cells: values at both ends, slopes times the width, and whether they are smooth in between."""

    from_: Array
    from_rise: Array
    to: Array
    to_rise: Array
    smooth: Flags

    @property
    def coefficients(self) -> Array:
        """Bernstein coefficients of quartics that the functions are taken to lie above, below the least of which no
        value of the quartics lies: of the cubics that the ends determine, the middle one lowered by what the functions
        may be off.
        """
        from_, from_rise, to, to_rise, smooth = self
        first, last = from_rise - (to - from_), to_rise - (to - from_)
        spread = np.abs(first) + np.abs(last)
        off = np.where(smooth, LEAN * np.abs(first + last) + BEND * spread, KINK * spread)
        middle = 0.5 * (from_ + to) + (from_rise - to_rise) / 6.0 - off
        return np.array([from_, from_ + 0.25 * from_rise, middle, to - 0.25 * to_rise, to])

    @property
    def least_of_halves(self) -> Array:
        """The least coefficients of both halves of the quartics: nearer to their least values."""
        row = self.coefficients
        least = np.minimum(row[0], row[-1])
        while len(row) > 1:  # de Casteljau
            row = 0.5 * (row[:-1] + row[1:])
            least = np.minimum(least, np.minimum(row[0], row[-1]))
        return np.asarray(least)

    @property
    def share_of_root(self) -> Array:
        """Where they vanish: the inverse as a cubic, the chord's root where a slope is against it."""
        chord = self.to - self.from_
        t, along = -self.from_ / chord, (self.from_rise * chord > 0.0) & (self.to_rise * chord > 0.0)
        begin, end = np.minimum(chord / self.from_rise, 3.0), np.minimum(chord / self.to_rise, 3.0)
        return np.where(along, t * (begin + t * (3.0 - 2.0 * begin - end + t * (begin + end - 2.0))), t)


@dataclass
class _Cells:
    """Neighbouring currents; what their trials say of the range between them.

    gap: how far the apex is off what is wanted, positive where a cell begins; an end that reaches it is no root. peak:
    the largest position less its limit.
    """

    search: _Search
    from_: Trials
    to: Trials

    def __post_init__(self) -> None:
        from_, to, search = self.from_, self.to, self.search
        self.width = to.u - from_.u
        self.smooth = (from_.events == to.events) & from_.smooth & to.smooth
        wanted, limit, reach = map(self.width.dtype.type, (search.wanted, search.limit, search.reach))
        low, high = (np.abs(end.apex - wanted) <= reach for end in (from_, to))
        side = np.where(np.where(low, to.apex, from_.apex) > wanted, 1.0, -1.0).astype(wanted.dtype)
        gap = self.curve("apex", wanted, side)
        self.gap = gap._replace(from_=np.where(low, reach, gap.from_), to=np.where(high, reach, gap.to))
        self.peak = self.curve(LARGEST_POSITION, limit)

    def curve(self, name: str, level: Any = 0.0, sign: Any = 1.0) -> _Curve:
        """What the trials say of a quantity, counted from a level."""
        values, rates = ([getattr(end, of) for end in (self.from_, self.to)] for of in (name, f"{name}_u"))
        rises = [sign * rate * self.width for rate in rates]
        return _Curve(sign * (values[0] - level), rises[0], sign * (values[1] - level), rises[1], self.smooth)

    @property
    def quiet(self) -> Flags:
        """No rebound takes off that does not do so at the ends, and none stays that takes off there: the least contact
        force of each keeps its sign.
        """
        both, least = (self.from_.minima > 0) & (self.to.minima > 0), self.curve("least_contact")
        inward = (least.from_, least.from_rise), (least.to, -least.to_rise)
        from_, to = (np.where(value > 0.0, value > np.abs(rise), value + rise < 0.0) for value, rise in inward)
        return np.where(both, least.coefficients.min(axis=0) > 0.0, from_ & to)

    @property
    def _at_jump(self) -> Array:
        """What no gap falls below in a narrow cell in which the apex ends, or jumps: on either side of a take-off like
        a square root.
        """
        least = np.full_like(self.width, np.inf)
        for n, trials in enumerate((self.from_, self.to)):
            (gap, gap_rise), (peak, peak_rise) = (curve[2 * n : 2 * n + 2] for curve in (self.gap, self.peak))
            near = trials.takes_off & (peak - 2.0 * np.abs(peak_rise) < 0.0)
            least = np.where(near, np.minimum(least, np.abs(gap) - 3.0 * np.abs(gap_rise)), least)
        return np.asarray(least)

    @property
    def promise(self) -> Array:
        """What no admissible current in the cell comes nearer than, as far as its ends tell; inf if there is none in
        it.
        """
        search, from_, to, gap, peak = self.search, self.from_, self.to, self.gap, self.peak
        range_, starts, whole = search.robot.u_max, search.admits(from_), gap.least_of_halves
        rise = np.abs(np.where(starts, peak.from_rise, peak.to_rise))
        weight = 2.0 * (np.abs(gap.from_rise) + np.abs(gap.to_rise)) / rise  # the multiplier of the limit
        sums = (one + weight * other for one, other in zip(gap[:4], peak[:4], strict=True))
        both = _Curve._make([*sums, self.smooth])
        lowest = peak.coefficients.min(axis=0)
        turns = lowest < np.minimum(peak.from_, peak.to)
        alike = (starts == search.admits(to)) | turns
        judged = np.where(alike, whole, np.fmax(whole, both.least_of_halves))
        none, unlike = ~from_.takes_off & ~to.takes_off, from_.takes_off != to.takes_off
        judged = np.where(none | (lowest >= 0.0), np.inf, judged)
        narrow = self.width <= np.where(none, np.sqrt(search.eps), STEP) * range_
        judged = np.where(unlike | ~self.quiet, np.where(narrow, self._at_jump, 0.0), judged)
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

    def split(self) -> "_Cells":
        """The cells between the ends and the currents that are tried inside, in order."""
        number = min(max(LANES // self.width.size, 1), 31)
        even = np.arange(1, number + 1) / (number + 1.0)
        root = self.gap.to < 0.0
        near = np.where(root, self.gap.share_of_root, self.peak.share_of_root)
        evenly, around = np.tile(even, (self.width.size, 1)), near[:, None] + np.array(CLUSTER)
        shares = np.concatenate([evenly, around], axis=1)
        shares[self.smooth & root, :number] = 0.5
        u = np.sort(self.from_.u[:, None] + (shares * self.width[:, None]).astype(self.width.dtype), axis=1)
        inside = (u > self.from_.u[:, None]) & (u < self.to.u[:, None])
        inside[:, 1:] &= u[:, 1:] > u[:, :-1]
        cell, place = np.nonzero(inside)
        every = np.arange(self.width.size)
        tried = self.from_, self.search.attempt(u[cell, place]), self.to
        nodes, of = Trials(*map(np.concatenate, zip(*tried, strict=True))), np.concatenate([every, cell, every])
        order = np.lexsort((nodes.u, of))
        first, second = order[:-1], order[1:]
        pairs = of[first] == of[second]
        return _Cells(self.search, take(nodes, first[pairs]), take(nodes, second[pairs]))


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
    if robot.u_max > 0.0 and search.movable and start[POSITION] < search.limit:
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
        cells = _Cells(search, take(cells.from_, left), take(cells.to, left)).split()
