"""Motions in a recording: where a body is released, and where what follows is no longer its own motion. Samples, end
exclusive.

A decay starts just after a largest deviation from rest, before which there is a hand, and ends where amplitudes grow
again: at the next hand. A drop starts where a height falls that was held, and ends where the body is lifted again. A
recording may hold several.

The equation of motion itself is filtered: both sides through the same filters, decimated, then a linear least squares.
That gives a fit in position its starts, and is the fit in force of a recording in closed loop.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from hopform import HopformError
from hopform.identify._motion import Array, of_scipy
from hopform.identify._recordings import FEWEST, Recording, calm, noise_of, outliers, quantum_of, runs

Span = tuple[int, int]
_ALIKE = 0.03
"""One body on one spring has the same period each time: that of another decay differs by at most this share, what a
hand does by more.
"""
_LEAST_REACH = 0.25
"""Of the largest decay or drop: what is smaller is left out."""
_HELD = 0.08
"""[s] over which a body that is held does not move; at an apex one moves by 8 mm in as long."""


_TOO_SHORT = f"too short: {{}} samples follow the release, at least {FEWEST} are needed"


def decays(recording: Recording, values: Array) -> list[Span]:
    """The free decays of a recording about its rest, in their order: the largest, and others of the same period."""
    main = _decay(recording, values, 0, values.size)
    size = _reach(values, main)
    pace = _pace(recording, values, main)
    spans, open_spans = [main], [(0, _hand(values, main)), (main[1], values.size)]
    while open_spans and math.isfinite(pace):
        begin, end = open_spans.pop()
        try:
            other = _decay(recording, values, begin, end)
        except HopformError:
            continue
        if _reach(values, other) < _LEAST_REACH * size:
            continue
        open_spans += [(begin, _hand(values, other, begin)), (other[1], end)]
        if abs(_pace(recording, values, other) / pace - 1.0) <= _ALIKE:
            spans.append(other)
    return sorted(spans)


def _decay(recording: Recording, whole: Array, begin: int, end: int) -> Span:
    """The decay from the largest deviation of some samples on; HopformError if none follows it."""
    if end - begin <= FEWEST:
        raise recording.error_of("x2", f"too short: {end - begin} samples", begin)
    noise, values = max(noise_of(whole), quantum_of(whole)), calm(whole[begin:end])
    rest, tail = rest_of(values), values[-max(values.size // 20, 5) :]
    reach = float(np.abs(values - rest).max())
    start = int((np.abs(values - rest) >= reach - 8.0 * noise).argmax())  # without friction all amplitudes are equal
    left = values[start:] - rest
    halves = runs(np.signbit(left))
    sizes = [float(np.abs(left[a:b]).max()) for a, b in halves]
    half_periods = sum(size > max(8.0 * noise, 0.1 * reach) for size in sizes)
    at = begin + start
    moves = float(np.ptp(tail)) / reach if reach > 0.0 else math.inf  # at the end, still
    few = (half_periods < 2 and moves > 0.05) or (half_periods < 3 and moves > 0.3)
    if few or reach <= 10.0 * noise or left.size <= FEWEST:
        raise recording.error_of("x2", "the release is not found: no decay follows the largest deviation", at)
    way = np.abs(left - left[0])
    turn = int((way >= float(way.max()) - 8.0 * noise).argmax())
    if moves > 0.05 and turn >= 0.95 * (left.size - 1):
        raise recording.error_of("x2", "too short: it ends before the body turns back", end - 1)
    grows = [n for n in range(2, len(sizes)) if sizes[n] > 1.3 * max(sizes[n - 2 : n]) + max(8.0 * noise, 0.05 * reach)]
    last = start + (halves[grows[0] - 1][0] if grows else left.size)
    near = np.abs(left) >= reach - 8.0 * noise  # held, or about its turn: the last sample of it
    start = min(start + int(near[: halves[0][1]].nonzero()[0][-1]) + 1, last - 1)
    if last - start < FEWEST:
        raise recording.error_of("x2", _TOO_SHORT.format(last - start), at)
    return begin + start, begin + last


def rest_of(values: Array, share: int = 20) -> float:
    """Where a body comes to rest, by the last of so many parts; where it oscillates to the end, the middle of its last
    half periods.
    """
    tail, last = values[-max(values.size // share, 5) :], calm(values)[values.size // 2 :]
    middle, whole = 0.5 * float(last.max() + last.min()), float(np.ptp(values))
    crossings = np.count_nonzero(np.diff(np.signbit(last - middle)))
    if crossings >= 3 and float(np.ptp(last)) > 0.5 * whole and float(np.ptp(tail)) > 0.1 * whole:
        return middle
    return float(np.median(tail))


def _reach(values: Array, span: Span) -> float:
    """First amplitude of a decay."""
    part = calm(values[slice(*span)])
    return abs(float(part[0]) - rest_of(part))


def _hand(values: Array, span: Span, begin: int = 0) -> int:
    """Where the hand has taken the body from rest, before a decay: the last crossing of its rest."""
    side = np.signbit(values[begin : span[0]] - rest_of(values[slice(*span)]))
    crossings = np.flatnonzero(side[1:] != side[:-1])
    return begin + int(crossings[-1]) if crossings.size else begin


def _pace(recording: Recording, values: Array, span: Span) -> float:
    """Time [s] from crossing to crossing of the rest, the median of the larger ones; NaN for too few of them."""
    time, part = recording.time[slice(*span)], calm(values[slice(*span)])
    left = part - rest_of(part)
    crossings = np.flatnonzero(np.signbit(left[1:]) != np.signbit(left[:-1]))
    pairs = enumerate(zip(crossings[:-1], crossings[1:], strict=True))
    large = [n for n, (a, b) in pairs if float(np.abs(left[a : b + 1]).max()) > 0.1 * abs(float(left[0]))]
    if len(large) < 3:
        return math.nan
    share = left[crossings] / (left[crossings] - left[crossings + 1])
    return float(np.median(np.diff(time[crossings] + share * (time[crossings + 1] - time[crossings]))[large]))


def drops(recording: Recording, values: Array, driven: bool = False) -> list[Span]:
    """The drops of a recording: each from where the height is lower than it was held, up to where the body is lifted
    again.

    driven: by an actuator that may lift the body too: then one drop fills the recording.
    """
    noise = max(noise_of(values), quantum_of(values), 1e-9)
    if driven:
        return [(_fall(recording, values, 0, values.size, noise, driven)[0], values.size)]
    first = _fall(recording, values, 0, values.size, noise)
    size = float(np.ptp(calm(values[slice(*first)])))
    lifts = _lifts(recording.time, values, noise, size)
    falls, ends = [first], [*(taken for taken, _ in lifts), values.size]
    if lifts:
        falls = [_fall(recording, values, 0, ends[0], noise)]
    for (_, held), end in zip(lifts, ends[1:], strict=True):
        try:
            other = _fall(recording, values, held, end, noise)
        except HopformError:  # lifted, and held to the end
            continue
        if float(np.ptp(calm(values[slice(*other)]))) >= _LEAST_REACH * size:
            falls.append(other)
    return falls


def _fall(recording: Recording, whole: Array, begin: int, end: int, noise: float, driven: bool = False) -> Span:
    """A fall from the height at which some samples begin; HopformError if there is none."""
    values = calm(whole[begin:end])
    level = float(np.median(values[:5]))
    beyond = max(8.0 * noise, 0.002 * float(np.ptp(values)))
    fallen = np.flatnonzero(values < level - beyond)
    if not fallen.size:
        instead = ", it rises: is it a height, upwards?" if float(values.max()) > level + beyond else ""
        raise recording.error_of("x2", f"the release is not found: the height does not fall{instead}", begin)
    start, last, least = int(fallen[0]), values.size, 8.0 * noise + 0.02 * float(np.ptp(values))
    higher = np.flatnonzero(values[start:] > level + least)  # than it was let go at: there a hand is at work
    if higher.size and not driven:
        last = _taken(values, start, start + int(higher[0]), least)
    if last - start < FEWEST:
        raise recording.error_of("x2", _TOO_SHORT.format(last - start), begin + start)
    return begin + start, begin + last


def _lifts(time: Array, values: Array, noise: float, size: float) -> list[Span]:
    """Where a body is taken by the hand, and the first sample at which it is held higher, for each time that it is."""
    width = max(round(_HELD / float(np.median(np.diff(time)))), 5)
    if values.size < 4 * width:
        return []
    smooth = calm(values)
    windows = np.lib.stride_tricks.sliding_window_view(smooth, width)
    still = windows.max(axis=1) - windows.min(axis=1) < max(8.0 * noise, 2e-3 * size)
    spans = [(a, b - 1 + width) for a, b in runs(still) if still[a]]
    high = float(smooth.min()) + 0.5 * size
    lifts, last = list[Span](), 0
    for begin, end in spans:
        if float(np.median(smooth[begin:end])) <= high:
            continue
        rests = [b for a, b in spans if last < a and b <= begin and float(np.median(smooth[a:b])) <= high]
        if last and (begin > last and float(smooth[last:begin].min()) <= high - 0.25 * size):
            lifts.append((rests[-1] if rests else _taken(smooth, last, begin, 0.02 * size + 8.0 * noise), begin))
        last = end
    return lifts


def _taken(values: Array, begin: int, held: int, least: float) -> int:
    """The last high of a motion before the low from which it is lifted: there it was surely its own."""
    part = values[begin:held] - 1e-12 * np.arange(held - begin)  # of highs that are equal the first counts
    highs, _ = of_scipy("signal").find_peaks(part, prominence=least)
    return begin + int(highs[-1]) if highs.size else begin


# ---- the filtered equation ----

CUTOFFS = (8.0, 16.0, 4.0, 32.0)
"""[Hz] of filters whose linear least squares are starts of the fit in position, the most trusted first."""


def low_passed(rows: Array, cutoff: float, rate: float, derivative: int = 0) -> Array:
    """Rows (..., samples) through a Butterworth filter of fourth order, forwards and backwards; cutoff and rate in Hz.

    derivative: 1 or 2 for that of what passes, by time. The line from the first to the last sample passes as it is.
    What is left begins and ends at 0, so its odd continuation is periodic and the filter is its gain 1/(1 +
    (tan(w/2)/tan(w_c/2))^8) on the spectrum, a derivative i w: nothing has to settle at the ends, and no difference
    quotient takes its share.
    """
    count = rows.shape[-1]
    way = rows[..., -1:] - rows[..., :1]
    rest = rows - (rows[..., :1] + way * np.linspace(0.0, 1.0, count))
    odd = np.concatenate([rest, -rest[..., -2:0:-1]], axis=-1)
    turn = np.linspace(0.0, math.pi, count)
    gain = (1j * turn * rate) ** derivative / (1.0 + (np.tan(0.5 * turn) / math.tan(math.pi * cutoff / rate)) ** 8)
    passed = np.fft.irfft(np.fft.rfft(odd) * gain, odd.shape[-1])[..., :count]
    if derivative == 0:
        return np.asarray(rows - rest + passed)
    return np.asarray(passed + way * rate / (count - 1) if derivative == 1 else passed)


class Filtered(NamedTuple):
    """Both sides of the equation of motion, filtered alike and decimated: rows of acceleration, v, x, sign v, u, 1, and
    the rate of u.
    """

    time: Array
    acceleration: Array
    v: Array
    x: Array
    side: Array
    u: Array
    one: Array
    rate: Array


def filtered(recording: Recording, cutoff: float | None = None, *, mend: bool = False) -> Filtered:
    """A recording on even times, its derivatives by a zero-phase Butterworth filter, all through a second one,
    decimated. The current holds from sample to sample, so it is the smooth one of half a sample later.

    cutoff [Hz]: of the filters; a tenth of the sampling rate, 50 Hz at most, if not given. Each part between gaps is
    filtered by itself, and its ends are left out; where few parts are long enough for the filter, its cutoff is
    lowered. mend: samples of the position far off their neighbours are taken as missing.
    """
    x, u, time = recording.position("x1"), recording.driving_current(), recording.time
    step = float(np.median(np.diff(time)))
    cut = min(cutoff or min(0.1 / step, 50.0), 0.45 / step)
    kept = ~outliers(x) if mend else np.full(x.size, True)
    time, x, u = time[kept], x[kept], np.interp(time - 0.5 * step, time, u)[kept]
    long, spans = _spans(time, step, cut)
    while _covered(time, long) < 0.5 * _covered(time, spans) and cut > _SLOWEST:
        cut = 0.5 * cut
        long, spans = _spans(time, step, cut)
    return joined([filtered_part(time[a:b], x[a:b], u[a:b], step, cut) for a, b in sorted(long or spans[:1])])


def joined(parts: Sequence[Filtered]) -> Filtered:
    """Parts in a row as one."""
    return Filtered(*map(np.concatenate, zip(*parts, strict=True)))


_SLOWEST = 2.0
"""[Hz] of a filter's cutoff: slower ones see nothing of a hopper."""


def _spans(time: Array, step: float, cut: float) -> tuple[list[Span], list[Span]]:
    """Parts between gaps that a filter may not bridge: those that are long enough for it, and all, the longest
    first.
    """
    part = np.cumsum(np.diff(time, prepend=time[0]) > max(2.5 * step, 0.25 / cut))
    spans = sorted(runs(part), key=lambda span: float(time[span[0]] - time[span[1] - 1]))
    return [(a, b) for a, b in spans if time[b - 1] - time[a] >= 8.0 * _EDGE / cut], spans


def _covered(time: Array, spans: Sequence[Span]) -> float:
    """How long [s] parts last together."""
    return float(sum(time[b - 1] - time[a] for a, b in spans))


_EDGE = 2.0
"""Ends of a filtered part that are left out, in periods of the filter's cutoff."""


def filtered_part(time: Array, x: Array, u: Array, step: float, cut: float) -> Filtered:
    """A part without gaps; where its times are uneven it is interpolated, the position by cubics that do not
    overshoot.
    """
    rate = 1.0 / step
    t = np.arange(time[0], time[-1] + 0.5 * step, step)
    raw = np.interp(t, time, x)
    if np.abs(np.diff(time) - step).max() > 1e-3 * step:
        raw = np.asarray(of_scipy("interpolate").Akima1DInterpolator(time, x)(np.minimum(t, time[-1])))
    still = 3.0 * max(noise_of(raw), quantum_of(x)) * cut
    position, v, acceleration = (low_passed(raw, cut, rate, n) for n in range(3))
    side = np.where(np.abs(v) > still, np.sign(v), 0.0)
    drive = np.interp(t, time, u)
    columns = np.stack([acceleration, v, position, side, drive, np.ones_like(v), low_passed(drive, cut, rate, 1)])
    columns = low_passed(columns, 0.8 * cut, rate)
    edge, every = min(int(_EDGE * rate / cut), t.size // 8), max(int(0.5 * rate / cut), 1)
    return Filtered(t[edge : t.size - edge : every], *columns[:, edge : t.size - edge : every])


def robust_linear(a: Array, b: Array, start: Array, spread: float, **how: Any) -> Any:
    """What least_squares of scipy finds for a p = b from a start; spread: of the residuals; how: its loss."""

    def missed(p: Array) -> Array:
        return np.asarray((a @ p - b) / spread)

    return of_scipy("optimize").least_squares(missed, start, **how)


def moving_rows(rows: Filtered, columns: Sequence[Array], *, robust: bool = False) -> list[float]:
    """The coefficients of columns that make up the acceleration, by the rows in which something moves; robust: by
    Cauchy's loss, to which hits of a stop are outliers.
    """
    moving = np.abs(rows.v) > 0.02 * float(np.abs(rows.v).max())
    a, b = np.stack(columns, axis=1)[moving], rows.acceleration[moving]
    coefficients = np.asarray(np.linalg.lstsq(a, b, rcond=None)[0], dtype=np.float64)
    if robust and moving.any():
        spread = max(float(np.median(np.abs(a @ coefficients - b))), 1e-12)
        coefficients = robust_linear(a, b, coefficients, spread, loss="cauchy", x_scale="jac").x
    return [float(each) for each in coefficients]
