"""What clock, logger and sensor do to a recording, as further parameters: a delay of the current, one of each recording
and fitted wherever a current changes; on request a gain and a lag of each sensor, and one clock.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hopform.identify import _estimation as estimation
from hopform.identify._estimation import Parameter, Solution
from hopform.identify._motion import Array
from hopform.identify._rigs import SENSOR, UNITS, Experiment
from hopform.identify._search import Problem

DELAY = ("delay",)
"""What is fitted wherever it can be."""
NUISANCES = tuple(letter for letter in SENSOR if letter not in DELAY)
"""What can be fitted on request."""
_SHAPES: Mapping[str, Parameter] = {
    "delay": Parameter("delay", UNITS["delay"], 0.0, 1e-3, "real", own=True, low=-0.1, high=0.1),
    "gain": Parameter("gain", UNITS["gain"], 1.0, 1.0, "positive"),
    "clock": Parameter("clock", UNITS["clock"], 1.0, 1.0, "positive"),
    "lag": Parameter("lag", UNITS["lag"], 0.0, 1e-3, "nonnegative"),
}


def with_nuisances(problem: Problem, freed: Sequence[str]) -> Problem:
    """A problem with sensor, clock or logger among its parameters: where the recordings have a current for a delay, one
    per recording; a gain and a lag per sensor (gain1 of x1, gain2 of x2); one clock.
    """
    experiments, parameters = list[Experiment](), dict[str, Parameter]()
    for experiment in problem.experiments:
        names = dict(experiment.names)
        for letter in freed:
            name = _name(experiment, letter)
            if name and letter not in names:
                names[letter] = name
                parameters.setdefault(name, _SHAPES[letter]._replace(name=name))
        experiments.append(replace(experiment, names=names))
    new = tuple(p for name, p in parameters.items() if all(name != other.name for other in problem.parameters))
    return replace(problem, experiments=tuple(experiments), parameters=(*problem.parameters, *new))


def _name(experiment: Experiment, letter: str) -> str | None:
    """The parameter that a letter of the sensor is in a recording; None where it has none."""
    if letter == "delay":
        driven = experiment.driven and len({u for _, u in experiment.steps}) > 1
        return f"delay@{experiment.names['x'].partition('@')[2]}" if driven else None
    return "clock" if letter == "clock" else f"{letter}{experiment.quantity[1]}"


_INDEPENDENT = 1e-3
"""Share of a derivative's size that the fitted parameters must leave of it."""


def extended(problem: Problem, solution: Solution) -> tuple[float, bool, list[Parameter]]:
    """The score of a problem's further parameters at a solution without them: the decrease of the sum of squares that
    they predict, whether the fitted ones leave anything of their derivatives, and all parameters one step of Gauss and
    Newton on.
    """
    count = len(solution.parameters)
    further = problem.parameters[count:]
    at = {p.name: p.start for p in further} | solution.values
    parts, rows = estimation.residuals(problem.experiments, problem.parameters, at)
    weight = weights(solution)
    jacobian = rows * weight[:, np.newaxis]
    size = np.sqrt((jacobian**2).sum(axis=0))
    alive, whole = np.flatnonzero(size[:count] > 0.0), size[count:]
    columns = [jacobian[:, alive] / size[alive], jacobian[:, count:], np.concatenate(parts) * weight]
    r = estimation.triangle(np.column_stack(columns))[alive.size : alive.size + whole.size, alive.size :]
    left, rest = r[:, :-1], r[:, -1]
    independent = bool((np.sqrt((left**2).sum(axis=0)) > _INDEPENDENT * whole).all() and whole.all())
    step = -np.linalg.lstsq(left, rest, rcond=1e-9)[0] if independent else np.zeros(whole.size)
    moved = [p._replace(start=estimation.clip(p, p.start + float(each))) for p, each in zip(further, step, strict=True)]
    return float((rest**2).sum()) if independent else 0.0, independent, [*estimation.started(solution), *moved]


_LAGS = (1e-3, 4e-3)
"""[s] where the fit of a lag starts, the better of them: to first order a lag is a delay, or a later start, and the
score at 0 is none."""


def begun(
    problem: Problem, solution: Solution, several: Sequence[Experiment], independent: bool, start: Sequence[Parameter]
) -> list[Parameter]:
    """Where the fit of further parameters to some experiments begins: from one step on; of lags that have no score from
    the better of two, to which all else is fitted.
    """
    names = {p.name for p in problem.parameters[len(solution.parameters) :]}
    lags = {name for each in problem.experiments if (name := each.names.get("lag")) in names}
    if independent or not lags:
        return list(start)
    rest = [p for p in start if p.name not in lags]
    held = [estimation.again(solution, several, rest, fixed=dict.fromkeys(lags, lag), most=8) for lag in _LAGS]
    least = estimation.best(held).values
    return [p._replace(start=least[p.name]) for p in start]


def weights(solution: Solution) -> Array:
    """Of each sample, 1/sigma; 0 for an outlier."""
    return np.concatenate([some / sigma for some, sigma in zip(solution.inliers, solution.sigma, strict=True)])
