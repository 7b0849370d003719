"""Touchdown from a noisy Hall signal (Fig. 15): hysteresis and debounce, what noise does to them, what a delay costs.

The samples in a row so far are a chain of states. With h the chance that a sample reaches `high` and s that one stays
above `low`, a detector of n samples takes on average

    (1/h + 1 + s + ... + s^(n-2)) / s^(n-1) samples to a detection:

the false alarms for a signal of 0, the delay for one of its level.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, SupportsFloat

import numpy as np
from numpy.typing import NDArray

from hopform import Event, HopformError, Robot, load_solver, solve_stance
from hopform.extend import Checked, by, finite, items, positive, stream, whole
from hopform.hopping._roles import Role

Array = NDArray[np.float64]

_NUMBERS = "numbers in units of the signal"
MOST_SAMPLES = 2**25
"""Samples at most, each of which takes 64 B."""
MOST_DRAWN = 10**9
"""Samples that a simulation draws at most, on average."""


@dataclass(frozen=True, kw_only=True)
class TouchdownDetector(Checked):
    """Thresholds in units of the signal (high >= low), `count` samples in a row, one every `dt` [s]; noise is white and
    normal.

    Raises HopformError for a threshold that is not finite, low > high, count < 1, dt <= 0.

    >>> detector = TouchdownDetector(high=0.6, low=0.4, count=3, dt=0.001)
    >>> detector.detect([0.0, 0.7, 0.1, 0.9, 0.5, 0.8, 1.0])
    (Event(time=0.005, kind='touchdown'),)
    >>> round(detector.false_alarm_rate(0.2), 2), round(detector.mean_delay(0.2, level=1.0), 6)
    (0.0, 0.00253)
    """

    high: float = field(default=0.6, metadata=by(finite, "units of the signal"))
    low: float = field(default=0.4, metadata=by(finite, "units of the signal"))
    count: int = field(default=3, metadata=by(whole, 1, MOST_SAMPLES))
    dt: float = field(default=1e-3, metadata=by(positive, "s"))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.low > self.high:
            raise HopformError(f"low must be <= high = {self.high!r}, got {self.low!r}")

    def detect(self, samples: Iterable[SupportsFloat]) -> tuple[Event, ...]:
        """Touchdowns and take-offs in a signal that begins in flight, each at the time of the sample that confirms it
        [s].
        """
        contacts = load_solver("hopper").contacts(samples, self.high, self.low, self.count)
        return tuple(Event(n * self.dt, kind) for n, kind in contacts)

    def false_alarm_rate(self, noise: SupportsFloat) -> float:
        """Touchdowns per second [1/s] that noise of a standard deviation makes of a signal of 0."""
        return 1.0 / (self.dt * self._samples(positive("noise", noise, "units of the signal"), 0.0))

    def false_takeoff_rate(self, noise: SupportsFloat, level: SupportsFloat = 1.0) -> float:
        """Take-offs per second [1/s] that noise makes of a signal that stays at its level."""
        deviation, height = _noise_and_level(noise, level)
        mirrored = TouchdownDetector(high=-self.low, low=-self.high, count=self.count, dt=self.dt)
        return 1.0 / (self.dt * mirrored._samples(deviation, -height))

    def mean_delay(self, noise: SupportsFloat, level: SupportsFloat = 1.0) -> float:
        """Mean time [s] from a touchdown to its detection, for a signal that steps to a level at any time between two
        samples.
        """
        deviation, height = _noise_and_level(noise, level)
        return self.dt * (self._samples(deviation, height) - 0.5)

    def chances(self, noise: SupportsFloat, signal: Sequence[SupportsFloat]) -> Array:
        """For a signal that is known without its noise: the probability that touchdown is detected at each of its
        samples.
        """
        deviation = positive("noise", noise, "units of the signal")
        means = items("signal", signal, f"a sequence of {_NUMBERS}", MOST_SAMPLES)
        if len(means) * self.count > MOST_DRAWN:
            raise HopformError(f"samples x count must be at most {MOST_DRAWN}, got {len(means)} x {self.count}")
        state = np.zeros(self.count)  # chance of so many samples in a row so far
        state[0] = 1.0
        detected = np.empty(len(means))
        for n, value in enumerate(means):
            mean = finite(f"signal[{n}]", value, "units of the signal")
            advance = np.full(self.count, _above(self.low, mean, deviation))
            advance[0] = _above(self.high, mean, deviation)
            going = state * advance
            detected[n] = going[-1]
            state = np.concatenate([[float(np.sum(state - going))], going[:-1]])
        return detected

    def simulated_delays(
        self, noise: SupportsFloat, level: SupportsFloat = 1.0, *, trials: int = 1000, seed: int = 0
    ) -> Array:
        """Delays [s] of touchdowns drawn with a seed: a step of the signal to a level at any time between two
        samples.
        """
        deviation, height = _noise_and_level(noise, level)
        number, draw = whole("trials", trials, most=MOST_SAMPLES), stream(Role.DETECTOR_DELAYS, seed)
        mean = self._samples(deviation, height)
        if mean < math.inf and number * mean > MOST_DRAWN:
            where = f"where a detection takes {mean:.3g} samples on average"
            raise HopformError(f"trials must be at most {int(MOST_DRAWN / mean)} {where}, got {number}")
        delays, run = draw.uniform(0.0, self.dt, number), np.zeros(number, dtype=np.int64)
        waiting = np.arange(number)
        for _ in range(1000 + 100 * math.ceil(mean) if mean < math.inf else 0):
            sample = height + deviation * draw.standard_normal(waiting.size)
            run = np.where(sample >= np.where(run > 0, self.low, self.high), run + 1, 0)
            still = run < self.count
            waiting, run = waiting[still], run[still]
            if not waiting.size:
                return delays
            delays[waiting] += self.dt
        delays[waiting] = math.inf
        return delays

    def _samples(self, noise: float, level: float) -> float:
        """Mean number of samples up to a detection, infinite where there is none."""
        reaches, stays = _above(self.high, level, noise), _above(self.low, level, noise)
        more, falls = self.count - 1, _above(-self.low, -level, noise)
        whole = stays**more
        if not (reaches > 0.0 and whole > 0.0):
            return math.inf
        row = -math.expm1(more * math.log1p(-falls)) / falls if 0.0 < falls < 1.0 else 1.0 if falls else more
        return (1.0 / reaches + row) / whole


def delayed_apex(
    robot: Robot,
    delay: SupportsFloat,
    *,
    v2: SupportsFloat,
    u: SupportsFloat,
    x1: SupportsFloat = 0.0,
    v1: SupportsFloat = 0.0,
    compression: SupportsFloat | None = None,
    before: SupportsFloat = 0.0,
) -> tuple[float, float]:
    """Apex [m] where the current u [A] comes a delay [s] after touchdown, and its difference from the apex with u at once.

    before [A]: the current until then. x1, v1, v2, compression: the state at touchdown, after the impact. Exact, one
    stance each; NaN without take-off.

    >>> from hopform import load_robot
    >>> apex, error = delayed_apex(load_robot("hopper_c"), 0.01, v2=-1.93, u=3.0)
    >>> round(apex, 4), round(error, 4)
    (0.2044, -0.0188)
    """
    late, now, early = finite("delay", delay, "s", 0.0), finite("u", u, "A"), finite("before", before, "A")
    start: dict[str, Any] = {"v2": v2, "x1": x1, "v1": v1, "compression": compression}
    apex = solve_stance(robot, **start, u=[(0.0, early), (late, now)] if late > 0.0 else now).apex
    return apex, apex - solve_stance(robot, **start, u=now).apex


def _noise_and_level(noise: SupportsFloat, level: SupportsFloat) -> tuple[float, float]:
    return positive("noise", noise, "units of the signal"), finite("level", level, "units of the signal")


def _above(threshold: float, mean: float, noise: float) -> float:
    """The chance that a sample is not below a threshold."""
    return 0.5 * math.erfc((threshold - mean) / (noise * math.sqrt(2.0)))
