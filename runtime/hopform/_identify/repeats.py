"""Repeats: how far the recordings of one rig differ.

Each is fitted alone, from where all together came to. The spread of k values gives an interval of their mean,

    mean +- t_(k-1) s/sqrt(k)

which holds what differs from recording to recording too: temperature, the place on the guide, the hand. The interval
of the fit knows noise alone; where the model does not explain the recordings there is none. Then the spread of three
and more is the interval. Values differ by more than noise where Cochran's Q = sum (value - mean)^2/stderr^2 exceeds
what chance allows.
"""

import math
from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from hopform._identify import estimation
from hopform._identify.estimation import LEVEL, Estimate, Solution
from hopform._identify.motion import of_scipy
from hopform._identify.search import Problem


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


def repeats_of(problem: Problem, solution: Solution, estimates: Sequence[Estimate]) -> tuple[list[Repeat], list[str]]:
    """The parameters that each of several recordings of one rig identifies alone, and statements about them."""
    found, statements = list[Repeat](), list[str]()
    for group in _groups(problem):
        alone = [_alone(problem, solution, each) for each in group]
        shared = [each for each in estimates if not each.own and all(each.name in one for one in alone)]
        some = [_repeat(each, [one[each.name] for one in alone]) for each in shared]
        found += some
        differing = [each for each in some if each.differ]
        statements += [*map(_said, differing), *_traded(differing)]
    return found, statements


def _groups(problem: Problem) -> list[list[list[int]]]:
    """Motions of one rig under one mass, where there are several; of each the numbers of its experiments."""
    rigs = dict[tuple[str, float], dict[str, list[int]]]()
    for n, each in enumerate(problem.experiments):
        motions = rigs.setdefault((each.kind, each.added_mass), {})
        motions.setdefault(each.names["x"], []).append(n)
    return [list(motions.values()) for motions in rigs.values() if len(motions) > 1]


def _alone(problem: Problem, solution: Solution, numbers: Sequence[int]) -> dict[str, tuple[float, float]]:
    """The parameters that one motion identifies alone, each with its standard error."""
    motion = [problem.experiments[n] for n in numbers]
    names = {name for each in motion for name in each.names.values()}
    start = [p for p in estimation.started(solution) if p.name in names]
    sigma = [solution.sigma[n] for n in numbers]
    found = estimation.again(solution, motion, start, sigma=sigma, most=30, precision=1e-7)
    spread = estimation.spread(found)
    pairs = zip(start, np.sqrt(np.diag(spread.covariance)).tolist(), strict=True)
    return {p.name: (found.values[p.name], error) for p, error in pairs if p.name not in spread.weak}


_ENOUGH = 3
"""Recordings whose spread is an interval."""


def spread_first(estimates: Sequence[Estimate], repeats: Sequence[Repeat]) -> tuple[Estimate, ...]:
    """The estimates, with the interval of the mean of three and more recordings where they have none of their own, or
    where the recordings differ by more than noise.
    """
    found = {each.name: each for each in repeats if len(each.values) >= _ENOUGH}

    def quoted(each: Estimate) -> Estimate:
        repeat = found.get(each.name)
        if repeat is None or not (each.method == "not explained" or (repeat.differ and repeat.quote == "spread")):
            return each
        return each._replace(low=repeat.low, high=repeat.high, method=f"spread of {len(repeat.values)}")

    return tuple(map(quoted, estimates))


_CHANCE = 0.999
"""Quantile of Q up to which chance explains it."""


def _repeat(each: Estimate, alone: Sequence[tuple[float, float]]) -> Repeat:
    count, values = len(alone), [value for value, _ in alone]
    half = estimation.student(0.5 + 0.5 * LEVEL, count - 1) * float(np.std(values, ddof=1)) / math.sqrt(count)
    middle = float(np.mean(values))
    width = each.high - each.low
    quote = "spread" if 2.0 * half > width or not math.isfinite(width) else "interval"
    weights = np.array([1.0 / max(error, 1e-300) ** 2 for _, error in alone])
    mean = float(weights @ np.array(values)) / float(weights.sum())
    q = float(weights @ (np.array(values) - mean) ** 2)
    differ = q > float(of_scipy("special").chdtri(count - 1, 1.0 - _CHANCE))
    return Repeat(each.name, each.unit, tuple(values), middle - half, middle + half, each.low, each.high, quote, differ)


def _said(each: Repeat) -> str:
    values = ", ".join(f"{value:.4g}" for value in each.values)
    low, high = (each.low, each.high) if each.quote == "spread" else (each.fitted_low, each.fitted_high)
    which = "their mean" if each.quote == "spread" else "the fit"
    quote = f"quote {low:.4g} .. {high:.4g}, the interval of {which}, which is the wider one"
    alone = f"{each.name} of each recording alone: {values} {each.unit}".rstrip()
    return f"{alone}; they differ by more than noise explains: {quote}"


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
