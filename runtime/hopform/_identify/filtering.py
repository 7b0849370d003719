"""The equation of motion itself, filtered: both sides through the same filters, decimated, then a linear least squares.

That gives a fit in position its starts, and is the fit in force of a recording in closed loop.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hopform._identify import recordings as of_recordings
from hopform._identify.motion import Array
from hopform._identify.recordings import Recording

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


@dataclass(frozen=True)
class Filtered:
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
    decimated.

    cutoff [Hz]: of the filters; a tenth of the sampling rate, 50 Hz at most, if not given. Each part between gaps is
    filtered by itself, and its ends are left out; where few parts are long enough for the filter, its cutoff is
    lowered. mend: samples of the position far off their neighbours are taken as missing.
    """
    x, u, time = recording.position("x1"), recording.driving_current(), recording.time
    step = float(np.median(np.diff(time)))
    cut = min(cutoff or min(0.1 / step, 50.0), 0.45 / step)
    kept = ~of_recordings.outliers(x) if mend else np.full(x.size, True)
    time, x, u = time[kept], x[kept], u[kept]
    long, spans = _spans(time, step, cut)
    while _covered(time, long) < 0.5 * _covered(time, spans) and cut > _SLOWEST:
        cut = 0.5 * cut
        long, spans = _spans(time, step, cut)
    parts = [filtered_part(time[a:b], x[a:b], u[a:b], step, cut) for a, b in sorted(long or spans[:1])]
    return joined(parts)


def joined(parts: Sequence[Filtered]) -> Filtered:
    """Parts in a row as one."""
    return Filtered(*(np.concatenate([getattr(part, name) for part in parts]) for name in Filtered.__annotations__))


_SLOWEST = 2.0
"""[Hz] of a filter's cutoff: slower ones see nothing of a hopper."""


def _spans(time: Array, step: float, cut: float) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Parts between gaps that a filter may not bridge: those that are long enough for it, and all, the longest
    first.
    """
    wide = np.flatnonzero(np.diff(time) > max(2.5 * step, 0.25 / cut)) + 1
    edges = [0, *wide.tolist(), time.size]
    spans = sorted(zip(edges[:-1], edges[1:], strict=True), key=lambda span: float(time[span[0]] - time[span[1] - 1]))
    return [(a, b) for a, b in spans if time[b - 1] - time[a] >= 8.0 * _EDGE / cut], spans


def _covered(time: Array, spans: Sequence[tuple[int, int]]) -> float:
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
    even = np.abs(np.diff(time) - step).max() <= 1e-3 * step
    raw = np.interp(t, time, x) if even else _interpolated(t, time, x)
    still = 3.0 * max(of_recordings.noise_of(raw), of_recordings.quantum_of(x)) * cut
    position, v, acceleration = (low_passed(raw, cut, rate, n) for n in range(3))
    side = np.where(np.abs(v) > still, np.sign(v), 0.0)
    drive = np.interp(t, time, u)
    columns = np.stack([acceleration, v, position, side, drive, np.ones_like(v), low_passed(drive, cut, rate, 1)])
    columns = low_passed(columns, 0.8 * cut, rate)
    edge, every = min(int(_EDGE * rate / cut), t.size // 8), max(int(0.5 * rate / cut), 1)
    return Filtered(t[edge : t.size - edge : every], *columns[:, edge : t.size - edge : every])


def _interpolated(t: Array, time: Array, x: Array) -> Array:
    from scipy.interpolate import Akima1DInterpolator

    return np.asarray(Akima1DInterpolator(time, x)(np.minimum(t, time[-1])))


def moving_rows(rows: Filtered, columns: Sequence[Array], *, robust: bool = False) -> list[float]:
    """The coefficients of columns that make up the acceleration, by the rows in which something moves; robust: by
    Cauchy's loss, to which hits of a stop are outliers.
    """
    moving = np.abs(rows.v) > 0.02 * float(np.abs(rows.v).max())
    a, b = np.stack(columns, axis=1)[moving], rows.acceleration[moving]
    found = np.linalg.lstsq(a, b, rcond=None)[0]
    if robust and moving.any():
        from scipy.optimize import least_squares

        spread = max(float(np.median(np.abs(a @ found - b))), 1e-12)

        def missed(p: Array) -> Array:
            return np.asarray((a @ p - b) / spread)

        found = least_squares(missed, found, loss="cauchy", x_scale="jac").x
    return [float(each) for each in found]
