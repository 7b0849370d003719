"""Noise of a recorded drive: what it makes of a fit, by motions under as much more of it.

The recorded current is the true one and noise, so the predicted motion is off by the response to the noise, which is
not white. How much noise there is a recording says itself, by third differences of its current; a ripple of the driver,
which moves the mass, has another memory there than white noise. `_DRAWS` motions under
as much noise again are samples of that response, exact through sticking; the least squares of each says by how much the
parameters are off. What is left of them beside the sensor's noise has the size and the memory that residuals of this
cause have.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hopform.identify import _estimation as estimation
from hopform.identify._estimation import LEVEL, Estimate, Solution, Spread
from hopform.identify._motion import Array, held_at
from hopform.identify._recordings import noise_of, quantum_of
from hopform.identify._rigs import Experiment, NoMotion

_DRAWS = 32
"""Motions under noise; standard deviations of as many are off by 12 %."""
_FIRST = 3
"""Of these, how many show whether the rest is needed."""
_FELT = 0.05
"""Share of the residuals' rms below which the response to the noise is not felt."""
_LAGS = (1, 2, 4, 8, 16)
"""Samples over which the memory of residuals is compared with that of draws."""
_MOST, _LEAST_NOISE = 0.3, 1e-5
"""Shares of the current's reach: what differs more from sample to sample drives the motion; less is rounding."""


class Noise(NamedTuple):
    """What noise of the current makes of a fit: changes of the parameters, (draws, parameters) in the coordinates of
    the optimiser, by it and by it and the sensor's noise; whether the residuals are what both leave; whether the noise
    may be in the recording alone, not in the motion.
    """

    by_current: Array
    by_both: Array
    explains: bool
    recorded: bool


def level(experiment: Experiment) -> float:
    """Standard deviation of the noise of a recorded current [A]; 0 where none is seen."""
    if len(experiment.steps) < 0.5 * experiment.time.size:
        return 0.0
    u = held_at(experiment.steps, experiment.time)
    noise, reach = noise_of(u), float(np.abs(u).max())
    return noise if _LEAST_NOISE * reach < noise < _MOST * reach and _is_white(u) else 0.0


_WHITE = np.array([-0.75, 0.3, -0.05])
"""Autocorrelation of third differences of white noise over one to three samples, -15/20, 6/20 and -1/20."""
_OFF_WHITE, _OUTSIDE = 0.2, 5.0
"""By how much that of a current may be off it, and the standard deviations beyond which differences are steps."""


def _is_white(u: Array) -> bool:
    """Whether what changes from sample to sample of a current is white noise."""
    third = np.diff(u, 3)
    spread = 1.4826 * float(np.median(np.abs(third)))
    inside = np.where(np.abs(third) < _OUTSIDE * spread, third, 0.0)
    power = max(float(inside @ inside), 1e-300)
    memory = np.array([float(inside[lag:] @ inside[:-lag]) / power for lag in (1, 2, 3)])
    return bool((np.abs(memory - _WHITE) < _OFF_WHITE).all())


def noise_in(solution: Solution) -> Noise | None:
    """What noise of the current makes of a minimum; None where there is none, or where it is not felt."""
    levels = [level(each) for each in solution.experiments]
    if not any(levels) or not solution.parameters:
        return None
    rng, sigma = np.random.default_rng(len(levels)), solution.noise
    rows = solution.scaled
    size = np.maximum(np.sqrt((rows**2).sum(axis=0)), 1e-300)
    solve: Array = np.asarray(np.linalg.pinv(rows / size) / size[:, np.newaxis], dtype=np.float64)

    def response() -> Array:
        """That of all samples to one draw of the noise, in standard deviations."""
        return np.concatenate(
            [_response(each, solution, n, sd, rng) for n, (each, sd) in enumerate(zip(solution.experiments, levels, strict=True))]
        ) / sigma  # fmt: skip

    def beside(change: Array) -> Array:
        return np.asarray(change - rows @ (solve @ change))

    residual = np.concatenate(solution.residuals) / sigma
    try:
        draws = [response() for _ in range(_FIRST)]
        felt = math.sqrt(float(np.mean([beside(each) ** 2 for each in draws])))
        if felt < _FELT * estimation.rms(residual):
            return None
        draws += [response() for _ in range(_DRAWS - _FIRST)]
    except NoMotion:
        return None
    of_sensor = np.concatenate([np.full(part.size, _sensor(each, part)) for each, part in
                                zip(solution.experiments, solution.residuals, strict=True)]) / sigma  # fmt: skip
    both = [each + of_sensor * rng.standard_normal(each.size) for each in draws]
    left = [beside(each) for each in both]
    alone = np.array([estimation.rms(beside(each)) for each in draws])
    return Noise(
        -np.stack([solve @ each for each in draws]), -np.stack([solve @ each for each in both]),
        _is_like(solution, residual, left),
        float(np.min(alone)) < _LIKE * estimation.rms(residual),
    )  # fmt: skip


def _sensor(experiment: Experiment, residual: Array) -> float:
    """Standard deviation of the sensor's noise, no more than what the fit leaves."""
    measured = experiment.measured
    return min(max(noise_of(measured), 0.29 * quantum_of(measured)), estimation.rms(residual))


def _response(experiment: Experiment, solution: Solution, n: int, sd: float, rng: np.random.Generator) -> Array:
    """By how much a recording's prediction is off under one draw of noise [m]."""
    if sd == 0.0:
        return np.zeros(experiment.time.size)
    begins, levels = np.array(experiment.steps, dtype=float).T
    shaken = np.asarray(levels + sd * rng.standard_normal(levels.size), dtype=np.float64)
    noisy = tuple(zip(begins.tolist(), shaken.tolist(), strict=True))
    moved = replace(experiment, steps=noisy).predict(solution.values)[0]
    return np.asarray(moved - experiment.measured - solution.residuals[n])


_LIKE, _SLACK = 1.35, 0.06
"""Ratio of rms up to which residuals are like those of the draws, and what their autocorrelation may be beyond these."""


def _is_like(solution: Solution, residual: Array, left: Sequence[Array]) -> bool:
    """Whether the residuals of every recording have the size and the memory that noise of current and sensor leaves."""
    ends = np.cumsum([part.size for part in solution.residuals])[:-1]
    draws = [np.split(each, ends) for each in left]
    for n, part in enumerate(np.split(residual, ends)):
        sizes = np.array([estimation.rms(each[n]) for each in draws])
        memories = np.array([_memory(each[n]) for each in draws])
        low, high = memories.min(axis=0) - _SLACK, memories.max(axis=0) + _SLACK
        rms, memory = estimation.rms(part), _memory(part)
        if not sizes.min() / _LIKE < rms < sizes.max() * _LIKE or not ((low <= memory) & (memory <= high)).all():
            return False
    return True


def _memory(residual: Array) -> Array:
    """Autocorrelation over some lags."""
    centred = residual - residual.mean()
    power = max(float(centred @ centred), 1e-300)
    return np.array([float(centred[lag:] @ centred[:-lag]) / power for lag in _LAGS])


METHOD = "noise of the current"
SAID = "the recorded current has noise; intervals are those under as much of it"


def intervals(
    solution: Solution, noise: Noise, estimates: Sequence[Estimate], spread: Spread
) -> tuple[tuple[Estimate, ...], Spread]:
    """Estimates whose intervals are those under the noise of the current, and their covariance: of residuals that are
    nothing else from the draws alone, else wider by these.
    """
    colours = not all(solution.explained)
    draws = noise.by_both if colours else noise.by_current
    t = estimation.student(0.5 + 0.5 * LEVEL, draws.shape[0] - 1)
    of_draws = np.sqrt((draws**2).mean(axis=0))
    rows = list[Estimate]()
    for n, estimate in enumerate(estimates):
        if estimate.method == "not identifiable":
            rows.append(estimate)
            continue
        place, half = estimation.Place(solution, n), t * float(of_draws[n])
        ends = (0.0, 0.0) if colours else (abs(place.into(estimate.low)), abs(place.into(estimate.high)))
        if not all(map(math.isfinite, ends)) or (not colours and half < 0.3 * max(ends)):
            rows.append(estimate)
            continue
        low, high = place.out(-math.hypot(ends[0], half)), place.out(math.hypot(ends[1], half))
        rows.append(estimate._replace(low=min(low, estimate.value), high=max(high, estimate.value), method=METHOD))
    slopes = estimation.slopes(solution)
    more = (draws * slopes).T @ (draws * slopes) / draws.shape[0]
    base = np.where(np.isfinite(spread.covariance), 0.0, np.inf) if colours else spread.covariance
    covariance = np.asarray(base + more)
    errors = np.sqrt(np.diag(covariance)).tolist()
    rows = [each._replace(stderr=error) for each, error in zip(rows, errors, strict=True)]
    return tuple(rows), spread._replace(covariance=covariance)
