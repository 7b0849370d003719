"""What a fit could have missed without leaving a trace: drag of the air, friction that is higher at rest, a lag, a link.

Each is a direction c of the prediction. The fitted parameters follow most of it, J b = -c, and the rest r is all that
the samples show of it: a size s with the standard error sigma/|r|. Of an undetected s the parameters are off by b s.

Where s differs from 0 by more than noise, the fit is not explained. Elsewhere no s is known to be 0: a size within the
noise moves the parameters by up to as much as noise does, or by far more where r is small. So the intervals of the
parameters allow for each cause: the interval is the one of a fit with its size as a further parameter, as far as sizes
up to the largest plausible one can move the parameter at all. Causes come one at a time: the interval holds those of
all.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hopform.identify import _estimation as estimation
from hopform.identify._estimation import LEVEL, Estimate, Solution, Spread
from hopform.identify._motion import Array, Values
from hopform.identify._rigs import Along, Experiment, Force
from hopform.identify._rivals import along_of, behind_play, bending, seen_at, slow


class Alternative(NamedTuple):
    """A cause: what it is called, the force that it is if it is one, and its largest plausible size."""

    name: str
    words: str
    force: Force | None
    most: float


class Missed(NamedTuple):
    """A cause at a minimum: how a unit of its size moves the parameters, in the coordinates of the optimiser, its size
    under each draw of the noise, of which a recording is one, and the standard error of that, infinite where the samples
    show nothing of it.
    """

    of: Alternative
    moves: Array
    size: Array
    error: float

    @property
    def refuted(self) -> bool:
        """Whether the samples show more of the cause than noise would."""
        return bool(np.abs(self.size).max() > _NOISE * self.error)


_NOISE = 3.3
"""Standard errors up to which a size is noise: 1 of 1000 is beyond."""
_TRACE = 1e-4
"""Share of a direction that the parameters leave at least, else the samples show nothing of it."""
_WIDER = 1.4
"""A 99 % interval over one of 95 %, rounded up: of where a parameter can be without further causes."""
_SMALL = 1e-4
"""Share of the largest plausible size at which the direction of a cause is taken: its difference quotient is off by as
little as leaves no trace.
"""
_LAG = 1e-3
"""[s] at which that of a lag is taken: a smaller one is a delay, which is fitted."""
_LINKS = (10.0, 20.0, 40.0)
"""[Hz] of links. Off resonance what one does falls with the square of its frequency, and so does what is seen of it."""


def drag(at: Along) -> Array:
    """Drag as a share of all friction at the largest velocity."""
    return (at.damping * at.fastest + float(at.friction.max(initial=0.0))) * np.abs(at.v) * at.v / at.fastest**2


def friction_at_rest(share: float) -> Force:
    """Coulomb friction that fades as e^(-(v/v_s)^2), v_s a share of the largest velocity."""
    return lambda at: at.friction * np.sign(at.way) * np.exp(-((at.v / (share * at.fastest)) ** 2))


def friction_by_load(at: Along) -> Array:
    """Friction that grows with the load: a share of the force of drive and spring."""
    return np.asarray(at.load * np.sign(at.way))


def hardening(at: Along) -> Array:
    """The cube of a spring that hardens, as a share of its force at the largest deflection."""
    return np.asarray(at.sprung * at.x**3 / max(float(np.abs(at.x).max()), 1e-300) ** 2)


def link(frequency: float) -> Force:
    """What a link of all the inertia takes off the motion beyond what it does as a rigid part."""
    return lambda at: np.asarray(-np.gradient(at.v, at.t) - bending(at, frequency)[1])


def _behind(frequency: float) -> Force:
    """How far the end of a link is off the motion."""
    return lambda at: bending(at, frequency)[0]


ALTERNATIVES = (
    Alternative("drag", "a drag of the air", drag, 0.5),
    Alternative("Stribeck", "friction that is higher at rest", friction_at_rest(0.06), 1.0),
    Alternative("Stribeck", "friction that is higher at rest", friction_at_rest(0.2), 1.0),
    Alternative("lag", "a lag of the sensor", None, 1e-2),
    Alternative("loaded", "friction that grows with the load", friction_by_load, 0.3),
    Alternative("hardening", "a spring that hardens", hardening, 0.1),
    Alternative("line", "a drift of the sensor", None, 0.03),
    Alternative("bow", "a drift of the sensor", None, 0.03),
    Alternative("play", "a play", None, 0.02),
    *(Alternative("link", "a link that bends", link(each), 0.5) for each in _LINKS),
    *(Alternative("bent", "a link that bends", _behind(each), 1.0) for each in _LINKS),
)
"""Sizes are shares of the friction at the largest velocity, of Coulomb friction, s, shares of the force of drive and
spring (gears lose up to 30 %), of the spring's alone, of the motion, and of the inertia; of a sensor behind a link it is
1 or 0.
"""
_SLOW = {"line": 0, "bow": 2}
"""Which of the slow changes of the position a drift is."""


def missed(solution: Solution, draws: Array | None = None) -> list[Missed]:
    """The causes at a minimum, without those that the motions do not have. draws: of the noise of all samples, in
    standard deviations, a row each, in place of what the minimum leaves.
    """
    scaled, noise = solution.scaled, solution.noise
    psi, slope, unit = estimation.influence(solution)
    rows = psi[np.newaxis] if draws is None else draws
    inflation = max(each.inflation for each in solution.tests)
    norms = np.sqrt((scaled**2).sum(axis=0))
    alive = norms > 1e-9 * norms.max(initial=0.0)
    causes = list[Missed]()
    for cause in ALTERNATIVES:
        directions = [_direction(one, solution.values, cause) for one in solution.experiments]
        column = np.asarray(np.concatenate(directions) / noise, dtype=np.float64)
        whole = math.sqrt(float(column @ column))
        if whole == 0.0:
            continue
        moves = np.zeros(norms.size)
        moves[alive] = np.linalg.lstsq(scaled[:, alive] / norms[alive], -column, rcond=1e-7)[0] / norms[alive]
        rest = np.asarray(column + scaled @ moves)
        left = float(rest @ rest)
        seen = left > (_TRACE * whole) ** 2
        error = math.sqrt(unit / slope * inflation / left) if seen else math.inf
        size = -(rows @ rest) / (slope * left) if seen else np.zeros(len(rows))
        causes.append(Missed(cause, moves, np.asarray(size, dtype=np.float64), error))
    return causes


def _direction(experiment: Experiment, values: Values, cause: Alternative) -> Array:
    """The change of a prediction by a cause, per its size."""
    if cause.name == "bent" and cause.force is not None:
        at = along_of(experiment, values)
        return seen_at(experiment, at, cause.force(at)) if at is not None else np.zeros(experiment.time.size)
    if cause.force is not None:
        return experiment.response_to(values, cause.force, _SMALL * cause.most)
    if cause.name in _SLOW:
        return np.asarray(float(np.ptp(experiment.measured)) * slow(experiment.time)[:, _SLOW[cause.name]])
    if cause.name == "lag" and "lag" in experiment.names:
        return np.zeros(experiment.time.size)
    predicted = experiment.predict(values)[0]
    if cause.name == "play":
        size = _SMALL * cause.most
        return np.asarray((behind_play(predicted, size * float(np.ptp(experiment.measured))) - predicted) / size)
    late = replace(experiment, constants={**experiment.constants, "lag": _LAG})
    return np.asarray((late.predict(values)[0] - predicted) / _LAG)


_METHODS = {each: f"{each}, allowing for causes" for each in ("profile", "t")}
_NOTED = 1.5
"""Times its width by which an interval grows, from where it is said."""


def allowing(
    solution: Solution, estimates: Sequence[Estimate], spread: Spread, some: Sequence[Missed]
) -> tuple[tuple[Estimate, ...], Spread, list[str]]:
    """Estimates whose intervals allow for causes, the mean ones of several draws of the noise, their covariance, and what
    is said of it.
    """
    if not some:
        return tuple(estimates), spread, []
    widened, wider = list[Estimate](), dict[str, list[str]]()
    covariance = _widened(solution, spread.covariance, some)
    errors = np.sqrt(np.diag(covariance)).tolist()
    for n, estimate in enumerate(estimates):
        widened.append(estimate._replace(stderr=errors[n]) if math.isfinite(estimate.stderr) else estimate)
        if estimate.own or not math.isfinite(estimate.high - estimate.low) or not estimate.stderr > 0.0:
            continue
        of_each = [_reach(solution, n, estimate, one) for one in some]
        place = estimation.Place(solution, n)
        low = place.out(float(np.minimum(np.min([a for a, _ in of_each], axis=0), 0.0).mean()))
        high = place.out(float(np.maximum(np.max([b for _, b in of_each], axis=0), 0.0).mean()))
        widened[-1] = widened[-1]._replace(low=low, high=high)
        if high - low < _NOTED * (estimate.high - estimate.low):
            continue
        widened[-1] = widened[-1]._replace(method=_METHODS.get(estimate.method, estimate.method))
        for one in some:
            a, b = ends(solution, n, estimate, one)
            if b - a > 0.5 * (high - low) and estimate.name not in wider.setdefault(one.of.words, []):
                wider[one.of.words].append(estimate.name)
    return tuple(widened), spread._replace(covariance=covariance), _said(wider)


def ends(solution: Solution, n: int, estimate: Estimate, cause: Missed) -> tuple[float, float]:
    """The ends of a parameter's interval that allows for a cause: what the samples say of both, within what plausible
    sizes of the cause can do.
    """
    place, (low, high) = estimation.Place(solution, n), _reach(solution, n, estimate, cause)
    return place.out(float(low.mean())), place.out(float(high.mean()))


def _reach(solution: Solution, n: int, estimate: Estimate, cause: Missed) -> tuple[Array, Array]:
    """How far these ends are off the estimate under each draw of the noise, in the coordinate of the optimiser."""
    place, shift = estimation.Place(solution, n), float(cause.moves[n])
    t = estimation.student(0.5 + 0.5 * LEVEL, solution.freedom)
    least = t * estimate.stderr
    below, above = (max(abs(place.into(end)), place.by(least)) for end in (estimate.low, estimate.high))
    bounds = -_WIDER * below + min(0.0, shift * cause.of.most), _WIDER * above + max(0.0, shift * cause.of.most)
    if not math.isfinite(cause.error):
        return np.full(cause.size.shape, bounds[0]), np.full(cause.size.shape, bounds[1])
    middle, more = shift * cause.size, t * shift * cause.error
    low, high = middle - math.hypot(below, more), middle + math.hypot(above, more)
    return np.clip(low, *bounds), np.clip(high, *bounds)


def _widened(solution: Solution, covariance: Array, some: Sequence[Missed]) -> Array:
    """The covariance with what the cause may do that moves the parameters most, but for those of where a motion begins."""
    size = np.maximum(np.diag(covariance), 1e-300)
    shared = np.array([not p.own for p in solution.parameters]) & np.isfinite(size)
    slopes = estimation.slopes(solution) * shared
    shifts = [np.outer(one.moves * slopes, one.moves * slopes) * min(one.error, one.of.most) ** 2 for one in some]
    return covariance + max(shifts, key=lambda more: float((np.diag(more) / size).sum()))


def _said(wider: Mapping[str, Sequence[str]]) -> list[str]:
    """What is said of causes that intervals allow for."""
    causes = dict[str, list[str]]()
    for words, names in wider.items():
        causes.setdefault(", ".join(names), []).append(words)
    return [
        f"the intervals of {names} allow for {' or '.join(words)} too small to show in these recordings"
        for names, words in causes.items()
    ]
