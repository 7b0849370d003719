"""Repeats: how far recordings of one rig differ, beside what noise explains.

Each recording is fitted alone, from where all together came to. The spread of k values gives an interval of their mean,

    mean +- t_(k-1) s/sqrt(k)

which holds what differs from recording to recording too: temperature, the place on the guide, the hand. The interval
of the fit knows noise alone. The wider of the two is the one to quote. Values differ by more than noise where Cochran's
Q = sum (value - mean)^2/stderr^2 exceeds what chance allows.
"""

import math
from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from hopform._identify import estimation
from hopform._identify.estimation import LEVEL, Estimate, Solution
from hopform._identify.search import Problem, bulk


class Repeat(NamedTuple):
    """A parameter over repeated recordings: its value of each alone, the 95 % interval of their mean, that of the fit
    to all, which of the two to quote: `spread` or `interval`, and whether the values differ by more than noise.
    """

    name: str
    unit: str
    values: tuple[float, ...]
    low: float
    high: float
    fitted_low: float
    fitted_high: float
    quote: str
    differ: bool


def repeats_of(
    problem: Problem, solution: Solution, estimates: Sequence[Estimate], loss: str
) -> tuple[tuple[Repeat, ...], tuple[str, ...]]:
    """The parameters that each of several recordings of one rig identifies alone, and statements about them."""
    found, statements = list[Repeat](), list[str]()
    for group in _groups(problem):
        alone = [_alone(problem, solution, each, loss) for each in group]
        shared = [each for each in estimates if not each.own and all(each.name in one for one in alone)]
        some = [_repeat(each, [one[each.name] for one in alone]) for each in shared]
        found += some
        differing = [each for each in some if each.differ]
        statements += [*map(_said, differing), *_traded(differing)]
    return tuple(found), tuple(statements)


def _groups(problem: Problem) -> list[list[list[int]]]:
    """Motions of one rig under one mass, where there are several; of each the numbers of its experiments."""
    rigs = dict[tuple[str, float], dict[str, list[int]]]()
    for n, each in enumerate(problem.experiments):
        if each.kind != "threshold":
            motions = rigs.setdefault((each.kind, each.added_mass), {})
            motions.setdefault(each.names["x"], []).append(n)
    return [list(motions.values()) for motions in rigs.values() if len(motions) > 1]


def _alone(problem: Problem, solution: Solution, numbers: Sequence[int], loss: str) -> dict[str, tuple[float, float]]:
    """The parameters that one motion identifies alone, each with its standard error."""
    motion = [problem.experiments[n] for n in numbers]
    names = {name for each in motion for name in each.names.values()}
    start = [p for p in estimation.started(solution) if p.name in names]
    sigma = [solution.sigma[n] for n in numbers]
    found = estimation.solve(motion, start, sigma=sigma, loss=loss, most=30, precision=1e-7)
    spread = estimation.spread(found)
    inflation = max(estimation.tests_of(part[bulk(part, loss)]).inflation for part in found.residuals)
    errors = np.sqrt(np.diag(spread.covariance) * inflation).tolist()
    return {
        p.name: (found.values[p.name], error) for p, error in zip(start, errors, strict=True)
        if p.name not in spread.weak
    }  # fmt: skip


_CHANCE = 0.999
"""Quantile of Q up to which chance explains it."""


def _repeat(each: Estimate, alone: Sequence[tuple[float, float]]) -> Repeat:
    count, values = len(alone), [value for value, _ in alone]
    half = estimation.student(0.5 + 0.5 * LEVEL, count - 1) * float(np.std(values, ddof=1)) / math.sqrt(count)
    middle = float(np.mean(values))
    quote = "spread" if 2.0 * half > each.high - each.low else "interval"
    weights = np.array([1.0 / max(error, 1e-300) ** 2 for _, error in alone])
    mean = float(weights @ np.array(values)) / float(weights.sum())
    q = float(weights @ (np.array(values) - mean) ** 2)
    differ = q > estimation.chi_square(_CHANCE, count - 1)
    return Repeat(
        each.name, each.unit, tuple(values), middle - half, middle + half, each.low, each.high, quote, differ
    )  # fmt: skip


def _said(each: Repeat) -> str:
    values = ", ".join(f"{value:.4g}" for value in each.values)
    low, high = (each.low, each.high) if each.quote == "spread" else (each.fitted_low, each.fitted_high)
    which = "their mean" if each.quote == "spread" else "the fit"
    return (
        f"{each.name} of each recording alone: {values} {each.unit}".rstrip() + "; they differ by more than noise "
        f"explains: quote {low:.4g} .. {high:.4g}, the interval of {which}, which is the wider one"
    )


_TRADED = 0.9
"""Correlation over the recordings from which two parameters are traded for each other."""


def _traded(some: Sequence[Repeat]) -> list[str]:
    """Pairs of parameters of which one is large where the other is small, in three recordings at least."""
    return [
        f"{one.name} and {other.name} are traded against each other from recording to recording "
        f"(correlation {r:+.2f}): their values belong together"
        for one, other in combinations(some, 2) if len(one.values) > 2
        and abs(r := float(np.corrcoef(one.values, other.values)[0, 1])) > _TRADED
    ]  # fmt: skip
