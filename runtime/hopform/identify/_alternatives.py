"""What a fit could have missed without leaving a trace: drag of the air, friction that is higher at rest, a lag.

Each is a direction c of the prediction. The fitted parameters follow most of it, J b = -c, and the rest r is all that
the samples show of it: a size s with the standard error sigma/|r|. Of an undetected s the parameters are off by b s.

| of a cause | then |
|---|---|
| whose size differs from 0 by more than noise | the fit is not explained |
| which would be seen at a plausible size | it is not there |
| which would not be seen | the intervals of the parameters allow for it |

An interval that allows for a cause is the one of a fit with its size as a further parameter, as far as sizes up to the
largest plausible one can move the parameter at all. Causes come one at a time: the interval holds those of all.
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
from hopform.identify._rivals import slow


class Alternative(NamedTuple):
    """A cause: what it is called, the force that it is if it is one, the least size that is plausible where it is there
    at all, and the largest.
    """

    name: str
    words: str
    force: Force | None
    least: float
    most: float


class Missed(NamedTuple):
    """A cause at a minimum: how a unit of its size moves the parameters, in the coordinates of the optimiser, its size
    and the standard error of that, infinite where the samples show nothing of it.
    """

    of: Alternative
    moves: Array
    size: float
    error: float

    @property
    def refuted(self) -> bool:
        """Whether the samples show more of the cause than noise would."""
        return abs(self.size) > _NOISE * self.error

    @property
    def hidden(self) -> bool:
        """Whether a plausible size of the cause could stay unseen."""
        return self.of.least < _SEEN * self.error


_NOISE = 3.3
"""Standard errors up to which a size is noise: 1 of 1000 is beyond."""
_SEEN = _NOISE + 1.7
"""Standard errors of a size that is seen in 19 of 20 cases."""
_TRACE = 1e-6
"""Share of a direction that the parameters leave at least, else the samples show nothing of it."""
_WIDER = 1.4
"""A 99 % interval over one of 95 %, rounded up: of where a parameter can be without further causes."""
_LAG = 1e-3
"""[s] at which the direction of a lag is taken."""


def drag(at: Along) -> Array:
    """Drag as a share of all friction at the largest velocity."""
    return (at.damping * at.fastest + float(at.friction.max(initial=0.0))) * np.abs(at.v) * at.v / at.fastest**2


def friction_at_rest(share: float) -> Force:
    """Coulomb friction that fades as e^(-(v/v_s)^2), v_s a share of the largest velocity."""
    return lambda at: at.friction * np.sign(at.way) * np.exp(-((at.v / (share * at.fastest)) ** 2))


def friction_by_load(at: Along) -> Array:
    """Friction that grows with the load: a share of the force of drive and spring."""
    rate = np.gradient(at.v, at.t)
    moving = at.friction * np.sign(at.v)
    drive = np.where(at.v != 0.0, rate + moving, 0.0) + at.damping * at.v + at.sprung * at.x
    return np.asarray((np.abs(drive) + np.abs(at.sprung * at.x)) * np.sign(at.way))


def hardening(at: Along) -> Array:
    """The cube of a spring that hardens, as a share of its force at the largest deflection."""
    return np.asarray(at.sprung * at.x**3 / max(float(np.abs(at.x).max()), 1e-300) ** 2)


ALTERNATIVES = (
    Alternative("drag", "a drag of the air", drag, 0.1, 0.5),
    Alternative("Stribeck", "friction that is higher at rest", friction_at_rest(0.06), 0.2, 1.0),
    Alternative("Stribeck", "friction that is higher at rest", friction_at_rest(0.2), 0.2, 1.0),
    Alternative("lag", "a lag of the sensor", None, 1e-3, 1e-2),
    Alternative("loaded", "friction that grows with the load", friction_by_load, 2e-3, 0.05),
    Alternative("hardening", "a spring that hardens", hardening, 2e-3, 0.1),
    Alternative("line", "a drift of the sensor", None, 5e-4, 0.03),
    Alternative("bow", "a drift of the sensor", None, 5e-4, 0.03),
)
"""Sizes are shares of the friction at the largest velocity, of Coulomb friction, s, shares of the force of drive and
spring, of the spring's alone, and of the motion.
"""
_SLOW = {"line": 0, "bow": 2}
"""Which of the slow changes of the position a drift is."""


def missed(solution: Solution) -> list[Missed]:
    """The causes at a minimum, without those that the motions do not have."""
    scaled, noise = solution.scaled, solution.noise
    psi, slope, unit = estimation.influence(solution)
    inflation = max(each.inflation for each in solution.tests)
    size = np.sqrt((scaled**2).sum(axis=0))
    alive = size > 1e-9 * size.max(initial=0.0)
    causes = list[Missed]()
    for cause in ALTERNATIVES:
        directions = [_direction(one, solution.values, cause) for one in solution.experiments]
        column = np.asarray(np.concatenate(directions) / noise, dtype=np.float64)
        whole = math.sqrt(float(column @ column))
        if whole == 0.0:
            continue
        moves = np.zeros(size.size)
        moves[alive] = np.linalg.lstsq(scaled[:, alive] / size[alive], -column, rcond=1e-7)[0] / size[alive]
        rest = np.asarray(column + scaled @ moves)
        left = float(rest @ rest)
        seen = left > (_TRACE * whole) ** 2
        error = math.sqrt(unit / slope * inflation / left) if seen else math.inf
        causes.append(Missed(cause, moves, -float(rest @ psi) / (slope * left) if seen else 0.0, error))
    return causes


def _direction(experiment: Experiment, values: Values, cause: Alternative) -> Array:
    """The change of a prediction by a cause, per its size."""
    if cause.force is not None:
        return experiment.response_to(values, cause.force, cause.least)
    if cause.name in _SLOW:
        return np.asarray(float(np.ptp(experiment.measured)) * slow(experiment.time)[:, _SLOW[cause.name]])
    if "lag" in experiment.names:
        return np.zeros(experiment.time.size)
    late = replace(experiment, constants={**experiment.constants, "lag": _LAG})
    return np.asarray((late.predict(values)[0] - experiment.predict(values)[0]) / _LAG)


_METHODS = {each: f"{each}, allowing for causes" for each in ("profile", "t")}
_NOTED = 1.05
"""Times its width by which an interval grows, from where it is said."""


def allowing(
    solution: Solution, estimates: Sequence[Estimate], spread: Spread, some: Sequence[Missed]
) -> tuple[tuple[Estimate, ...], Spread, list[str]]:
    """Estimates whose intervals allow for what could be hidden, their covariance, and what is said of it."""
    hidden = [each for each in some if each.hidden]
    if not hidden:
        return tuple(estimates), spread, []
    widened, wider = list[Estimate](), dict[str, list[str]]()
    covariance = _widened(solution, spread.covariance, hidden)
    errors = np.sqrt(np.diag(covariance)).tolist()
    for n, estimate in enumerate(estimates):
        widened.append(estimate._replace(stderr=errors[n]) if math.isfinite(estimate.stderr) else estimate)
        if estimate.own or not math.isfinite(estimate.high - estimate.low) or not estimate.stderr > 0.0:
            continue
        of_each = [ends(solution, n, estimate, one) for one in hidden]
        low, high = min(estimate.value, *(a for a, _ in of_each)), max(estimate.value, *(b for _, b in of_each))
        if high - low < _NOTED * (estimate.high - estimate.low):
            continue
        widened[-1] = widened[-1]._replace(low=low, high=high, method=_METHODS.get(estimate.method, estimate.method))
        for one, (a, b) in zip(hidden, of_each, strict=True):
            if b - a > 0.5 * (high - low) and estimate.name not in wider.setdefault(one.of.words, []):
                wider[one.of.words].append(estimate.name)
    return tuple(widened), spread._replace(covariance=covariance), _said(wider)


def ends(solution: Solution, n: int, estimate: Estimate, cause: Missed) -> tuple[float, float]:
    """The ends of a parameter's interval that allows for a cause: what the samples say of both, within what plausible
    sizes of the cause can do.
    """
    place, shift = estimation.Place(solution, n), float(cause.moves[n])
    t = estimation.student(0.5 + 0.5 * LEVEL, solution.freedom)
    least = t * estimate.stderr
    below, above = (max(abs(place.into(end)), place.by(least)) for end in (estimate.low, estimate.high))
    bounds = -_WIDER * below + min(0.0, shift * cause.of.most), _WIDER * above + max(0.0, shift * cause.of.most)
    if not math.isfinite(cause.error):
        return place.out(bounds[0]), place.out(bounds[1])
    middle, more = shift * cause.size, t * shift * cause.error
    low, high = middle - math.hypot(below, more), middle + math.hypot(above, more)
    low, high = min(max(low, bounds[0]), bounds[1]), max(min(high, bounds[1]), bounds[0])
    return place.out(low), place.out(high)


def _widened(solution: Solution, covariance: Array, hidden: Sequence[Missed]) -> Array:
    """The covariance with what the cause may do that moves the parameters most, but for those of where a motion begins."""
    size = np.maximum(np.diag(covariance), 1e-300)
    shared = np.array([not p.own for p in solution.parameters]) & np.isfinite(size)
    slopes = estimation.slopes(solution) * shared
    shifts = [np.outer(one.moves * slopes, one.moves * slopes) * min(one.error, one.of.most) ** 2 for one in hidden]
    return covariance + max(shifts, key=lambda more: float((np.diag(more) / size).sum()))


def _said(wider: Mapping[str, Sequence[str]]) -> list[str]:
    """What is said of causes that intervals allow for."""
    causes = dict[str, list[str]]()
    for words, names in wider.items():
        causes.setdefault(", ".join(names), []).append(words)
    return [
        f"the intervals of {names} allow for {' or '.join(words)} of a size that these recordings would not show"
        for names, words in causes.items()
    ]
