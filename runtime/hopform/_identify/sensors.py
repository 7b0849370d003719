"""What sensor, clock and logger make of a motion x(t) under a current u(t).

    measured(t) = gain * y(t),    lag y' + y = x(clock t; u(clock (t - delay)))

Each changes the prediction with exact derivatives. A clock that runs at another speed rescales the letters of the rig
by dimension (k by clock^2, b by clock, accelerations by clock^2), so that time is that of the recording. A delay moves
the steps of the current: the motion from the state s_0 is then the one that begins earlier by the delay, so that

    dx/d delay = -x'(t) + (dx/ds_0) s_0'

A lag is the exact response of the first-order filter to the cubic through positions and velocities of neighbouring
samples.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from hopform._identify.motion import Array, Values
from hopform._solver.columns import Steps

Moved = tuple[Array, dict[str, Array]]
"""Position and velocity at the samples, (samples, 2), and their derivatives by each letter."""

NEUTRAL = {"delay": 0.0, "gain": 1.0, "clock": 1.0, "lag": 0.0}
"""Each letter at the value that changes nothing."""
_POWERS = {"k": 2, "b1": 1, "b2": 1, "f1": 2, "f2": 2, "g": 2, "gamma2": 2}
"""The powers of 1/s in which a letter counts, masses and lengths apart."""


class Sensor(NamedTuple):
    """The letters of a recording's sensor, clock and logger: delay [s], gain, clock, lag [s]."""

    delay: float = 0.0
    gain: float = 1.0
    clock: float = 1.0
    lag: float = 0.0


def in_recorded_time(at: Values, clock: float) -> dict[str, float]:
    """Letters of a rig in the time of the recording, of which true time is `clock` times as much."""
    return {name: value * clock ** _POWERS.get(name, 0) for name, value in at.items()}


def by_clock(at: Values, by: Mapping[str, Array], clock: float) -> dict[str, Array]:
    """Derivatives by the letters in true time, and by the clock, from those by letters in recorded time."""
    powers = {name: power for name, power in _POWERS.items() if name in by and name in at}
    found = {name: rows * clock ** powers.get(name, 0) for name, rows in by.items()}
    found["clock"] = sum(
        (power * at[name] * clock ** (power - 1) * by[name] for name, power in powers.items()),
        np.zeros_like(next(iter(by.values()))),
    )
    return found


def delayed(steps: Steps, delay: float) -> Steps:
    """Steps of a current that arrive later; the first holds from the beginning, also where all come earlier."""
    if delay == 0.0:
        return steps
    moved = [(max(t + delay, 0.0), u) for t, u in steps]
    begun = max((n for n, (t, _) in enumerate(moved) if t <= 0.0), default=0)
    return ((0.0, moved[begun][1]), *moved[begun + 1 :])


def lagged(time: Array, moved: Moved, lag: float, before: float) -> Moved:
    """A motion through lag y' + y = x, which at first is in its steady state; before: acceleration at the beginning.

    dy/d lag = -(y' through the same filter).
    """
    states, by = moved
    x, v = states.T
    response = _Filter(time, lag)
    if lag == 0.0:
        y, rate = x, v
    else:
        y = response(x, v, float(x[0] - lag * v[0] + lag * lag * before))
        rate = (x - y) / lag
    found = {name: np.stack([response(rows[:, 0], rows[:, 1]), rows[:, 1]], axis=1) for name, rows in by.items()}
    slope = (v - rate) / lag if lag > 0.0 else np.gradient(v, time) if time.size > 1 else np.zeros_like(v)
    found["lag"] = np.stack([-response(rate, slope), -slope], axis=1)
    return np.stack([y, rate], axis=1), found


class _Filter:
    """The response of lag y' + y = x to cubics between samples."""

    def __init__(self, time: Array, lag: float) -> None:
        self.lag, self.step = lag, np.diff(time)
        h = self.step / max(lag, 1e-300)
        decay = np.exp(-h)
        # Moments m_n = int_0^1 s^n e^(-h (1 - s)) h ds of the cubic's powers: m_0 = 1 - e^-h, m_n = 1 - n m_(n-1)/h;
        # by their series where h is small and the recursion would lose digits.
        moments = [1.0 - decay]
        small = h < 0.1
        for n in (1, 2, 3):
            series, term = np.zeros_like(h), np.where(small, h, 0.0) / (n + 1)
            for k in range(1, 12):
                series = series + term
                term = -term * np.where(small, h, 0.0) / (n + 1 + k)
            moments.append(np.where(small, series, 1.0 - n * moments[-1] / np.where(small, 1.0, h)))
        self.decay, self.moments = decay, moments

    def __call__(self, x: Array, v: Array, first: float | None = None) -> Array:
        """y at the samples; from `first`, or from the steady state of a motion without acceleration."""
        if self.lag == 0.0 or x.size < 2:
            return x
        h, (m0, m1, m2, m3) = self.step, self.moments
        rise, left, right = np.diff(x), h * v[:-1], h * v[1:]
        gain = x[:-1] * m0 + left * m1 + (3.0 * rise - 2.0 * left - right) * m2 + (left + right - 2.0 * rise) * m3
        start = x[0] - self.lag * v[0] if first is None else first
        return _recursion(self.decay, np.concatenate([[start], gain]))


def _recursion(decay: Array, gain: Array) -> Array:
    """y_(n+1) = decay_n y_n + gain_(n+1) from y_0 = gain_0: a system of equations with two diagonals."""
    from scipy.linalg import solve_banded

    bands = np.stack([np.ones_like(gain), np.append(-decay, 0.0)])
    return np.asarray(solve_banded((1, 0), bands, gain, check_finite=False))
