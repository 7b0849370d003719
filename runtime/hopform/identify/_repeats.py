"""Repeats: how well a rig repeats. Each of several recordings is fitted alone, from where all together came to.

Their values and the spread of these say nothing of the model: what it lacks moves every recording alike. Over an error
of the model, an interval from their spread misses the truth as surely as the recordings agree. Values differ by more
than noise where Cochran's Q = sum (value - mean)^2/stderr^2 exceeds what chance allows; then one set of parameters does
not explain the recordings.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from hopform.identify import _estimation as estimation
from hopform.identify._estimation import Estimate, Solution
from hopform.identify._motion import of_scipy
from hopform.identify._search import Problem


class Repeat(NamedTuple):
    """A parameter over repeated recordings: its value of each alone, their standard deviation, and whether they differ by
    more than noise.
    """

    name: str
    unit: str
    values: tuple[float, ...]
    spread: float
    differ: bool


def repeats_of(problem: Problem, solution: Solution, estimates: Sequence[Estimate]) -> tuple[list[Repeat], list[str]]:
    """The parameters that each of several recordings of one rig identifies alone, and statements about them."""
    repeats, statements = list[Repeat](), list[str]()
    for group in _groups(problem):
        reaches = [max(float(np.ptp(problem.experiments[n].measured)) for n in numbers) for numbers in group]
        some, said = compared(estimates, [_alone(problem, solution, each) for each in group], reaches)
        repeats, statements = repeats + some, statements + said
    return repeats, list(dict.fromkeys(statements))


def compared(
    estimates: Sequence[Estimate], alone: Sequence[Mapping[str, tuple[float, float]]], reaches: Sequence[float]
) -> tuple[list[Repeat], list[str]]:
    """The parameters that each recording identifies alone, and statements about them. alone: of each recording values by
    their names, each with its standard error; reaches: how far each moves.
    """
    shared = [each for each in estimates if not each.own and all(each.name in one for one in alone)]
    some = [_repeat(each, [one[each.name] for one in alone]) for each in shared]
    differing = [each for each in some if each.differ]
    return some, [*([_scope(reaches)] if some else []), *map(_said, differing), *_traded(differing)]


def _groups(problem: Problem) -> list[list[list[int]]]:
    """Motions of one rig under one mass, where there are several; of each the numbers of its experiments."""
    rigs = dict[tuple[str, float], dict[str, list[int]]]()
    for n, experiment in enumerate(problem.experiments):
        motions = rigs.setdefault((experiment.kind, experiment.added_mass), {})
        motions.setdefault(experiment.names["x"], []).append(n)
    return [list(motions.values()) for motions in rigs.values() if len(motions) > 1]


def _alone(problem: Problem, solution: Solution, numbers: Sequence[int]) -> dict[str, tuple[float, float]]:
    """The parameters that one motion identifies alone, each with its standard error."""
    motion = [problem.experiments[n] for n in numbers]
    names = {name for each in motion for name in each.names.values()}
    start = [p for p in estimation.started(solution) if p.name in names]
    sigma = [solution.sigma[n] for n in numbers]
    solution_alone = estimation.again(solution, motion, start, sigma=sigma, most=30, precision=1e-7)
    spread = estimation.spread(solution_alone)
    pairs = zip(start, np.sqrt(np.diag(spread.covariance)).tolist(), strict=True)
    return {p.name: (solution_alone.values[p.name], error) for p, error in pairs if p.name not in spread.weak}


REPEATABILITY = "repeats show whether the rig repeats; change amplitude or load to see whether the model holds"

_FACTOR = 2.0
"""Ratio of amplitudes from which recordings show whether the model holds."""


def _scope(reaches: Sequence[float]) -> str:
    """What recordings of these amplitudes show. Their range is no interval: what a linear model lacks, as a link that
    bends, moves the values of small and large motions alike.
    """
    ratio = max(reaches) / max(min(reaches), 1e-300)
    if ratio < _FACTOR:
        return REPEATABILITY
    return (
        f"the recordings differ by a factor of {ratio:.2g} in amplitude: values that agree support the model; their range "
        "is no interval"
    )


_CHANCE = 0.999
"""Quantile of Q up to which chance explains it."""


def _repeat(estimate: Estimate, alone: Sequence[tuple[float, float]]) -> Repeat:
    values, errors = np.array(alone).T
    weights = 1.0 / np.maximum(errors, 1e-300) ** 2
    mean = float(weights @ values) / float(weights.sum())
    q = float(weights @ (values - mean) ** 2)
    differ = q > float(of_scipy("special").chdtri(len(alone) - 1, 1.0 - _CHANCE))
    return Repeat(estimate.name, estimate.unit, tuple(values.tolist()), float(np.std(values, ddof=1)), differ)


def _said(repeat: Repeat) -> str:
    values = ", ".join(f"{value:.4g}" for value in repeat.values)
    alone = f"{repeat.name} of each recording alone: {values} {repeat.unit}".rstrip()
    return f"{alone}; they differ by more than noise explains, so there is no interval"


_TRADED = 0.9
"""Correlation over the recordings from which two parameters are traded for each other."""


def _traded(some: Sequence[Repeat]) -> list[str]:
    """Pairs of parameters of which one is large where the other is small, in three recordings at least."""
    return [
        f"{one.name} and {other.name} are correlated from recording to recording ({r:+.2f}): use values of one fit together"
        for one, other in combinations(some, 2) if len(one.values) > 2
        and abs(r := float(np.corrcoef(one.values, other.values)[0, 1])) > _TRADED
    ]  # fmt: skip
