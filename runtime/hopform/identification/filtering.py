"""The equation of motion itself, filtered: both sides through the same filters, decimated, then a linear least squares.

That gives a fit in position its starts, and is the fit in force of a recording in closed loop.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hopform.identification import recordings as of_recordings
from hopform.identification.motion import Array
from hopform.identification.recordings import Recording

CUTOFFS = (4.0, 8.0, 16.0, 32.0)
"""[Hz] of filters whose linear least squares are starts of the fit in position."""


def low_passed(rows: Array, cutoff: float, rate: float) -> Array:
    """Rows (..., samples) through a Butterworth filter of fourth order, forwards and backwards; cutoff and rate in Hz.

    The line from the first to the last sample passes as it is. What is left begins and ends at 0, so its odd continuation is
    periodic and the filter is its gain 1/(1 + (tan(w/2)/tan(w_c/2))^8) on the spectrum: nothing has to settle at the ends.
    """
    count = rows.shape[-1]
    line = rows[..., :1] + (rows[..., -1:] - rows[..., :1]) * np.linspace(0.0, 1.0, count)
    rest = rows - line
    odd = np.concatenate([rest, -rest[..., -2:0:-1]], axis=-1)
    share = np.tan(0.5 * np.linspace(0.0, math.pi, count)) / math.tan(math.pi * cutoff / rate)
    passed = np.fft.irfft(np.fft.rfft(odd) / (1.0 + share**8), odd.shape[-1])
    return np.asarray(line + passed[..., :count])


@dataclass(frozen=True)
class Filtered:
    """Both sides of the equation of motion, filtered alike and decimated: rows of acceleration, v, x, sign v, u, 1."""

    time: Array
    acceleration: Array
    v: Array
    x: Array
    side: Array
    u: Array
    one: Array


def filtered(recording: Recording, cutoff: float | None = None, *, mend: bool = False) -> Filtered:
    """A recording on even times, its derivatives by a zero-phase Butterworth filter, all through a second one, decimated.

    cutoff [Hz]: of the filters; a tenth of the sampling rate, 50 Hz at most, if not given. Each part between gaps is filtered by
    itself, and its ends are left out. mend: samples of the position far off their neighbours are taken as missing.
    """
    x, u, time = recording.position("x1"), recording.driving_current(), recording.time
    step = float(np.median(np.diff(time)))
    cut = min(cutoff or min(0.1 / step, 50.0), 0.45 / step)
    kept = ~of_recordings.outliers(x) if mend else np.full(x.size, True)
    time, x, u = time[kept], x[kept], u[kept]
    wide = np.flatnonzero(np.diff(time) > max(2.5 * step, 0.25 / cut)) + 1
    edges = [0, *wide.tolist(), time.size]
    spans = sorted(zip(edges[:-1], edges[1:], strict=True), key=lambda span: time[span[0]] - time[span[1] - 1])
    long = [(a, b) for a, b in spans if time[b - 1] - time[a] >= 8.0 * _EDGE / cut]
    parts = [filtered_part(time[a:b], x[a:b], u[a:b], step, cut) for a, b in sorted(long or spans[:1])]
    return Filtered(*(np.concatenate([getattr(part, name) for part in parts]) for name in Filtered.__annotations__))


_EDGE = 2.0
"""Ends of a filtered part that are left out, in periods of the filter's cutoff."""


def filtered_part(time: Array, x: Array, u: Array, step: float, cut: float) -> Filtered:
    """A part without gaps; where its times are uneven it is interpolated, the position by cubics that do not overshoot."""
    rate = 1.0 / step
    t = np.arange(time[0], time[-1] + 0.5 * step, step)
    even = np.abs(np.diff(time) - step).max() <= 1e-3 * step
    raw = np.interp(t, time, x) if even else _interpolated(t, time, x)
    still = 3.0 * max(of_recordings.noise_of(raw), of_recordings.quantum_of(x)) * cut
    position = low_passed(raw, cut, rate)
    v = np.gradient(position, step)
    side = np.where(np.abs(v) > still, np.sign(v), 0.0)
    columns = np.stack([np.gradient(v, step), v, position, side, np.interp(t, time, u), np.ones_like(v)])
    columns = low_passed(columns, 0.8 * cut, rate)
    edge, every = min(int(_EDGE * rate / cut), t.size // 8), max(int(0.5 * rate / cut), 1)
    return Filtered(t[edge : t.size - edge : every], *columns[:, edge : t.size - edge : every])


def _interpolated(t: Array, time: Array, x: Array) -> Array:
    from scipy.interpolate import Akima1DInterpolator

    return np.asarray(Akima1DInterpolator(time, x)(np.minimum(t, time[-1])))


def moving_rows(rows: Filtered, columns: Sequence[Array]) -> list[float]:
    """The coefficients of columns that make up the acceleration, by the rows in which something moves."""
    moving = np.abs(rows.v) > 0.02 * float(np.abs(rows.v).max())
    found = np.linalg.lstsq(np.stack(columns, axis=1)[moving], rows.acceleration[moving], rcond=None)[0]
    return [float(each) for each in found]
