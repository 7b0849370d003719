"""The threshold of friction, (5), from a slow ramp: at which current the actuator begins to move, in noise.

    |gamma2| |u*| = m_eff f1      (magnitudes; the spring carries no load)

Until it slips the actuator rests. From then on the ramp's surplus grows with time against viscous friction,

    x1'' = a s - r x1' - w^2 (x1 - x0),    x1 = x0 + a (g(p) - g(q))/(p - q),    g(p) = (e^(p s) - 1 - p s)/p^2,
       s = t - t* > 0

p and q being the roots of z^2 + r z + w^2; w = 0 in the air. t* is where the least sum of squares over x0, a, r (and w)
is least, between samples too, and its interval where that has grown by what chance allows. A constant load (gravity)
shifts the thresholds of both directions alike: their half difference is friction, their mean the load. A spring adds
what it carries where the actuator rests, k x0, which is taken off if k and gamma2 are known.
"""

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform._checks import finite, flag
from hopform._errors import HopformError
from hopform._identify.estimation import LEVEL, student
from hopform._identify.fits import checked
from hopform._identify.kinds import Group, Kind, Recordings, read_some
from hopform._identify.motion import Array, of_scipy
from hopform._identify.recordings import HOPPER, Recording, Units, noise_of, outliers, quantum_of, runs, units_of
from hopform._identify.rigs import UNITS, Experiment
from hopform._identify.search import Problem
from hopform._show import Arrays, Card, Curve, Shown, span


class Onset(NamedTuple):
    """The beginning of a motion: time [s] and current [A], each with its interval; direction of x1, its noise and rest
    [m].
    """

    source: str
    direction: int
    time: float
    time_low: float
    time_high: float
    u: float
    u_low: float
    u_high: float
    noise: float
    x1: float


class Rise(NamedTuple):
    """Samples around an onset, and the motion that fits them best: times [s], x1 [m], current [A]."""

    onset: Onset
    time: Array
    x1: Array
    fitted: Array
    u: Array


@dataclass(frozen=True, repr=False, eq=False)
class Threshold(Shown):
    """The current that friction takes, f1 m_eff/|gamma2| [A], with its 95 % interval, and the load that shifts it.

    load [A]: the mean of the thresholds of both directions, NaN with one direction alone. onsets: each one found. f1
    [m/s^2]: if m_eff and gamma2 are given, else NaN. statements: what this identifies and what it does not.
    """

    u: float
    low: float
    high: float
    load: float
    f1: float
    f1_low: float
    f1_high: float
    onsets: tuple[Onset, ...]
    statements: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    rises: tuple[Rise, ...] = field(default=(), repr=False, compare=False)
    units: Units = HOPPER

    def _card(self) -> Card:
        given = [("onsets of motion", len(self.onsets)), ("notes", len(self.statements))]
        found = [("u", self.u), ("95 % interval", f"{span((self.low, self.high))} A"), ("f1", self.f1)]
        return Card(f"Friction threshold: {self.u:.5g} A", given, found)

    def _curve(self) -> Curve | None:
        return ("x1 [m] over time [s]", self.rises[0].time, self.rises[0].x1) if self.rises else None

    def _arrays(self) -> Arrays:
        names = ("source", "direction", "time", "u", "u_low", "u_high")
        found = {f"onset_{name}": (("onset",), [getattr(each, name) for each in self.onsets]) for name in names}
        return found | {name: ((), getattr(self, name), {"units": self.units.of(unit)}) for name, unit in
                        (("u", "A"), ("low", "A"), ("high", "A"), ("load", "A"), ("f1", "m/s^2"))}  # fmt: skip


def friction_threshold(
    recordings: Recordings,
    *,
    spring: bool = False,
    m_eff: float | None = None,
    gamma2: float | None = None,
    k: float | None = None,
    loss: str = "linear",
) -> Threshold:
    """The friction threshold (5) from recordings of x1 while the current slowly grows in magnitude, best in both
    directions.

    spring: the actuator works against its spring; else the leg is in the air. m_eff [kg], gamma2 [N/A]: with both,
    f1 = |gamma2| u*/m_eff is given too. k [N/m]: of the spring; with gamma2 what it carries where the actuator rests is
    taken off. loss: as in `Options`; a robust one leaves single samples out that are far off their neighbours. One
    recording may hold several ramps from 0. Raises HopformError where no motion begins, or before the ramp does.
    """
    several = read_some(recordings)
    given = {"m_eff": m_eff, "gamma2": gamma2, "k": k}
    numbers = {name: finite(name, value, UNITS[name]) for name, value in given.items() if value is not None}
    units = units_of(several, "x1", driven=True)
    for name, number in numbers.items():
        if number == 0.0 or (name != "gamma2" and number < 0.0):
            allowed = "a number but 0 in" if name == "gamma2" else "> 0"
            raise HopformError(f"{name} must be {allowed} {units.of(UNITS[name])}, got {number!r}")
    attached = flag("spring", spring) or k is not None
    robust = checked({"loss": loss}).loss != "linear"
    rises = tuple(rise for each in several for rise in _onsets(each, attached, robust))
    onsets = tuple(rise.onset for rise in rises)
    carried = k / gamma2 if k is not None and gamma2 is not None else 0.0
    u, spread, load, statements = _both(onsets, carried)
    per = abs(gamma2) / m_eff if m_eff is not None and gamma2 is not None else math.nan
    if math.isnan(per):
        statements += ("a ramp fixes f1 m_eff/|gamma2| alone: m_eff and gamma2, as from step responses, make it f1",)
    if attached and carried == 0.0:
        carries = "what the spring carries where the actuator rests counts as friction or load"
        statements += (f"{carries}: k and gamma2 take it off",)
    notes = tuple(f"{each.source}: {note}" for each in several for note in each.notes)
    low, high = max(u - spread, 0.0), u + spread
    return Threshold(u, low, high, load, u * per, low * per, high * per, onsets, statements, notes, rises, units)


class _Ramp(Kind):
    """A ramp beside other recordings: its threshold is one more measurement [A] of their parameters."""

    def posed(self, group: Group, first: int, backend: str | None) -> Problem:
        """A problem of one measurement, in the air."""
        found = friction_threshold(group.recordings, loss=group.loss)
        sigma, one = max((found.high - found.low) / (2.0 * 1.96), 1e-9), np.zeros(1)
        names = {letter: letter for letter in self.letters}
        measured = Experiment("threshold of friction", self.rig, one, one + found.u, names, {}, noise=sigma)
        said = tuple(each for each in found.statements if each.startswith("one direction"))
        return Problem("ramp", "x1", (measured,), (), ({},), group.known, said, found.warnings, units=group.units)


RAMP = _Ramp("ramp", "threshold", "x1")


def _both(onsets: Sequence[Onset], carried: float) -> tuple[float, float, float, tuple[str, ...]]:
    """Threshold, half its interval, load: from the means of either direction of the motion, which friction opposes.

    carried [A/m]: what the spring adds, as a current per way of the actuator.
    """
    means, halves = list[float](), list[float]()
    for direction in (1, -1):
        some = [each for each in onsets if each.direction == direction]
        if some:
            weight = 1.0 / np.maximum(np.array([0.5 * (each.u_high - each.u_low) for each in some]), 1e-12) ** 2
            values = np.array([each.u + carried * each.x1 for each in some])
            means.append(float((values * weight).sum() / weight.sum()))
            own = 1.0 / math.sqrt(float(weight.sum()))
            scatter = float(np.std(values, ddof=1)) / math.sqrt(len(some)) if len(some) > 1 else 0.0
            halves.append(max(own, scatter * student(0.5 + 0.5 * LEVEL, max(len(some) - 1, 1))))
    if len(means) == 2:
        half = 0.5 * math.hypot(*halves)
        return 0.5 * abs(means[0] - means[1]), half, 0.5 * (means[0] + means[1]), ()
    alone = "one direction alone: a constant load (gravity, a preloaded spring) counts as friction"
    return abs(means[0]), halves[0], math.nan, (f"{alone}; record a ramp the other way",)


def _onsets(recording: Recording, spring: bool, robust: bool) -> list[Rise]:
    """The onset in each ramp of a recording: ramps begin where the current leaves 0, and go on while its sign stays."""
    x, u = recording.position("x1"), recording.driving_current()
    kept = ~outliers(x) if robust else np.full(x.size, True)
    ramps = [begin + np.flatnonzero(kept[begin:end]) for begin, end in _ramps(u)]
    found = [_onset(recording, ramp, x, u, spring) for ramp in ramps if ramp.size >= 20]
    if not found:
        raise recording.error_of("x1", "no ramp is found: the current must grow slowly from 0, in 20 samples at least")
    return found


def _ramps(u: Array) -> list[tuple[int, int]]:
    """Spans of one sign of the smoothed current, each up to where its magnitude is largest."""
    width = max(u.size // 200, 1)
    smooth = np.convolve(np.pad(u, width, mode="edge"), np.ones(2 * width + 1) / (2 * width + 1), mode="valid")
    sign = np.where(np.abs(smooth) > 0.02 * float(np.abs(smooth).max()), np.sign(smooth), 0.0)
    spans = [(a, b) for a, b in runs(sign) if sign[a] != 0.0]
    most = max((float(np.abs(smooth[a:b]).max()) for a, b in spans), default=0.0)
    large = [(a, b) for a, b in spans if float(np.abs(smooth[a:b]).max()) > 0.3 * most]
    return [(max(a - 2 * width, 0), a + int(np.abs(smooth[a:b]).argmax()) + 1) for a, b in large]


def _onset(recording: Recording, ramp: NDArray[np.int_], x: Array, u: Array, spring: bool) -> Rise:
    """The onset in the samples of one ramp."""
    t, x, u, begin = recording.time[ramp], x[ramp], u[ramp], int(ramp[0])
    noise = max(noise_of(x), 0.3 * quantum_of(x), 1e-12)
    rest = float(np.median(x[: max(x.size // 20, 5)]))
    # Far from rest for good: a fifth of a second's samples beyond eight times the noise.
    beyond = np.abs(x - rest) > 8.0 * noise
    later = np.flatnonzero(beyond & (np.cumsum(~beyond[::-1])[::-1] <= 0.02 * x.size))
    if not later.size:
        raise recording.error_of("x1", "the actuator does not move under the ramp: let the current grow further", begin)
    seen = int(later[0])
    if seen < 10:
        raise recording.error_of("x1", "the actuator moves before the ramp begins: let it come to rest first", begin)
    # The motion is followed to 60 times the noise.
    far = np.flatnonzero(np.abs(x - rest) > 60.0 * noise)
    last = min(max(int(far[0]) if far.size else x.size, seen + 8), x.size)
    best, count = _costs(t[:last], x[:last], spring)

    def cost(begins: float) -> float:
        return best(begins)[0]

    at = _least(cost, float(t[2]), float(t[seen]))
    freedom = max(count - (5 if spring else 4), 1)
    limit = cost(at) * (1.0 + student(0.5 + 0.5 * LEVEL, freedom) ** 2 / freedom)
    low, high = (_reach(cost, at, limit, end, np.median(np.diff(t))) for end in (float(t[0]), float(t[last - 4])))
    direction = 1 if float(x[last - 1]) > rest else -1
    cubic = np.polyfit(t[:last], u[:last], 3 if last > 50 else 1)
    wobble = float(np.std(u[:last] - np.polyval(cubic, t[:last]))) / math.sqrt(max(last, 1))
    currents = [float(np.polyval(cubic, each)) for each in (low, at, high)]
    around = student(0.5 + 0.5 * LEVEL, freedom) * 2.0 * wobble
    half, current = math.hypot(float(np.abs(np.diff(currents)).max()), around), currents[1]
    onset = Onset(recording.source, direction, at, low, high, current, current - half, current + half, noise, rest)
    return Rise(onset, t[:last], x[:last], best(at)[1](t[:last]), u[:last])


def _rise(s: Array, rate: float, square: float = 0.0) -> Array:
    """Response of a mass with friction r and a spring w^2 to a ramp of force from s = 0 on; roots that are equal are
    parted.
    """
    half = 0.5 * rate
    apart, least = cmath.sqrt(half * half - square), 1e-4 * (half + 1e-3)
    apart = apart if abs(apart) > least else complex(least)
    return np.real((_twice(apart - half, s) - _twice(-apart - half, s)) / (2.0 * apart))


def _twice(p: complex, s: Array) -> NDArray[Any]:
    """(e^(p s) - 1 - p s)/p^2, by its series where that is exact."""
    z = p * s
    small = np.abs(z) < 0.02
    safe = np.where(small, 1.0, z)
    shares = (np.expm1(safe) - safe) / (safe * safe)
    near = z[small]
    shares[small] = 0.5 + near * (1.0 / 6.0 + near * (1.0 / 24.0 + near * (1.0 / 120.0 + near / 720.0)))
    return np.asarray(s * s * shares)


_ENOUGH = 250
"""Samples of a window: more are averaged, which loses nothing of so smooth a motion."""


def _thinned(values: Array) -> Array:
    """Means of neighbours, so that not many more than enough are left."""
    many = max(values.size // _ENOUGH, 1)
    return np.asarray(values[: values.size // many * many].reshape(-1, many).mean(axis=1))


_Best = tuple[float, Callable[[Array], Array]]
"""The motion that fits a window best of those that begin at one time: its sum of squares, and x1 at times."""


def _costs(t: Array, x: Array, spring: bool) -> tuple[Callable[[float], _Best], int]:
    """The best motion for each beginning t*, over rest, slope of the ramp's force, friction's rate, and the spring."""
    t, x = _thinned(t), _thinned(x)
    span, mean = float(t[-1] - t[0]), x - x.mean()

    def rise_of(times: Array, begin: float, logs: Array) -> Array:
        return _rise(np.maximum(times - begin, 0.0) / span, *map(math.exp, logs))

    def slope_of(rise: Array) -> float:
        rise = rise - rise.mean()
        power = float(rise @ rise)
        return float(rise @ mean) / power if power > 0.0 else 0.0

    def missed(logs: Array, begin: float) -> Array:
        """Residual of the motion after the best rest and slope, as a share of the motion."""
        rise = rise_of(t, begin, logs)
        return np.asarray(mean - slope_of(rise) * (rise - rise.mean())) / size

    size, smallest = float(np.sqrt(mean @ mean)), math.inf
    near = first = np.log([5.0, 100.0] if spring else [5.0])
    bounds = ([-5.0, -5.0], [9.0, 14.0]) if spring else (math.log(0.01), math.log(1e3))
    how = {"bounds": bounds, "ftol": 1e-9, "xtol": 1e-5, "max_nfev": 40}
    least_squares = of_scipy("optimize").least_squares

    def best(begin: float) -> _Best:
        """Over rates and springs, from where the last beginning had them, and from a guess where that is not enough."""
        nonlocal near, smallest
        tried = [least_squares(missed, near, args=(begin,), **how)]
        if tried[0].cost > smallest * (1.0 + 4.0 / t.size) or not math.isfinite(smallest):
            tried.append(least_squares(missed, first, args=(begin,), **how))
        smallest = min(smallest, *(float(each.cost) for each in tried))
        logs = near = np.asarray(min(tried, key=lambda each: float(each.cost)).x, dtype=float)
        rest = size * missed(logs, begin)

        def at(times: Array) -> Array:
            rise = rise_of(t, begin, logs)
            return np.asarray(x.mean() + slope_of(rise) * (rise_of(times, begin, logs) - rise.mean()))

        return float(rest @ rest), at

    return best, t.size


def _least(cost: Callable[[float], float], low: float, high: float) -> float:
    """Minimiser of a cost, to a ten thousandth of the range: on a grid, then around its best place."""
    grid = np.linspace(low, high, 31)
    n = int(np.argmin([cost(float(each)) for each in grid]))
    ends, how = (float(grid[max(n - 1, 0)]), float(grid[min(n + 1, 30)])), {"xatol": 1e-4 * (high - low)}
    return float(of_scipy("optimize").minimize_scalar(cost, bounds=ends, method="bounded", options=how).x)


def _reach(cost: Callable[[float], float], at: float, limit: float, end: float, step: float) -> float:
    """How far the cost stays under a limit towards an end, from where it is least: between steps that double."""

    @cache
    def surplus(place: float) -> float:
        return cost(place) - limit if place != at else -limit

    sign, inside, reach = math.copysign(1.0, end - at), at, step
    while surplus(outside := at + sign * min(reach, abs(end - at))) <= 0.0:
        if reach >= abs(end - at):
            return end
        inside, reach = outside, 2.0 * reach
    return float(of_scipy("optimize").brentq(surplus, inside, outside, xtol=1e-3 * step))
