"""Questions after every fit: what clock, logger and sensor may have done to a recording; how far repeats differ.

Each candidate is one more parameter (a delay is one per recording). Rao's score test at the minimum says what it would
bring to first order,

    chi^2 = (c . r)^2 / (c . c),      c = dx/d nuisance, less what the fitted parameters make of it

and a candidate with a score is fitted. The friction law has a score alone: c is the response to a force
e^(-(v/v_s)^2) sign(v) at the velocities of the fit, exact through sticking. Outliers are a candidate too: the samples
that are off their neighbours are left out.

Of several recordings of one rig each is fitted alone, from where all together came to. The spread of k values gives an
interval of their mean,

    mean +- t_(k-1) s/sqrt(k)

which holds what differs from recording to recording too: temperature, the place on the guide, the hand. The interval
of the fit knows noise alone. The wider of the two is the one to quote. Values differ by more than noise where Cochran's
Q = sum (value - mean)^2/stderr^2 exceeds what chance allows.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform._identify import estimation
from hopform._identify.estimation import LEVEL, Estimate, Parameter, Solution
from hopform._identify.motion import Array, Values, of_scipy
from hopform._identify.recordings import outliers
from hopform._identify.rigs import SENSOR, UNITS, Experiment
from hopform._identify.search import Problem, follow, is_noise, selected

NUISANCES = tuple(SENSOR)
"""What can be fitted on request."""
_SHAPES: Mapping[str, Parameter] = {
    "delay": Parameter("delay", UNITS["delay"], 0.0, 1e-3, "real", own=True, low=-0.1, high=0.1),
    "gain": Parameter("gain", UNITS["gain"], 1.0, 1.0, "positive"),
    "clock": Parameter("clock", UNITS["clock"], 1.0, 1.0, "positive"),
    "lag": Parameter("lag", UNITS["lag"], 0.0, 1e-3, "nonnegative"),
}


Parts = Sequence[Array]
"""Residuals of each recording."""


class Diagnosis(NamedTuple):
    """What one cause would bring: values of its parameters, rms of all positions [m] before and after, the decrease of
    the sum of squares in variances of what is left, and the option that takes it into account.
    """

    name: str
    values: Values
    before: float
    after: float
    decrease: float
    option: str

    def cause(self) -> str:
        """The cause with its size."""
        sizes = list(self.values.values())
        in_ms = ", ".join(f"{1e3 * each:.3g}" for each in sizes)
        fast = 100.0 * (sizes[0] - 1.0)
        return {
            "delay": f"a delay of {in_ms} ms between current and position",
            "lag": f"a first-order lag of {in_ms} ms",
            "gain": f"a sensor gain of {', '.join(f'{each:.4g}' for each in sizes)}",
            "clock": f"a clock of the recording that is {abs(fast):.3g} % {'slow' if fast > 0.0 else 'fast'}",
            "outliers": f"leaving out {sizes[0]:.0f} samples",
            "Stribeck": f"friction that is higher at rest, by about {100.0 * sizes[0]:.1g} % (Stribeck),",
        }[self.name]


def said(found: Sequence[Diagnosis], shown: tuple[str, float]) -> list[str]:
    """The cause that explains most, and those that explain as much; shown: the unit of residuals and its factor."""
    if not found:
        return []
    first = found[0]
    alike = [each for each in found[1:] if first.decrease - each.decrease < _ALIKE]
    causes = " or ".join(each.cause() for each in (first, *alike))
    options = " or ".join(dict.fromkeys(each.option for each in (first, *alike) if each.option))
    unit, factor = shown
    brings = f"{causes} brings rms {factor * first.before:.3g} to {factor * first.after:.3g} {unit}"
    advice = f"; fit it with {options}" if options else "; no option fits it: intervals are those of constant friction"
    return [brings + advice + ("; these recordings do not separate them" if alike else "")]


def with_nuisances(problem: Problem, wanted: Sequence[str]) -> Problem:
    """A problem with sensor, clock or logger among its parameters: where the recordings have a current for a delay, one
    per recording; a gain and a lag per sensor (gain1 of x1, gain2 of x2); one clock.
    """
    experiments, made = list[Experiment](), dict[str, Parameter]()
    for each in problem.experiments:
        names = dict(each.names)
        for letter in wanted:
            name = _name(each, letter)
            if name and letter not in names:
                names[letter] = name
                made.setdefault(name, _SHAPES[letter]._replace(name=name))
        experiments.append(replace(each, names=names))
    new = tuple(p for name, p in made.items() if all(name != other.name for other in problem.parameters))
    return replace(problem, experiments=tuple(experiments), parameters=(*problem.parameters, *new))


def _name(experiment: Experiment, letter: str) -> str | None:
    """The parameter that a letter of the sensor is in a recording; None where it has none."""
    if letter == "delay":
        driven = experiment.kind in ("held", "air", "free") and len({u for _, u in experiment.steps}) > 1
        return f"delay@{experiment.names['x'].partition('@')[2]}" if driven else None
    x1 = experiment.kind in ("held", "air") or (experiment.kind == "free" and experiment.of == "x1")
    return "clock" if letter == "clock" else f"{letter}{1 if x1 else 2}"


_LEAST = 16.0
"""Variances by which a cause must lower the sum of squares: four standard errors."""
_SCORE = 6.0
"""The same of a score that is worth a fit."""
_ALIKE = 6.0
"""Variances within which two causes explain as much."""
_LAG = 3e-3
"""[s] where the fit of a lag starts in a motion without a current: to first order a lag shifts it in time, as its own
start does, and the score at 0 is none."""
_INDEPENDENT = 1e-3
"""Share of a derivative's size that the fitted parameters must leave of it."""


def diagnose(problem: Problem, solution: Solution) -> tuple[Diagnosis, ...]:
    """The causes that would explain the residuals of a fit better than noise does, the best first."""
    found = list[Diagnosis]()
    fitted = {letter for each in problem.experiments for letter in each.names}
    for letter in NUISANCES:
        if letter not in fitted:
            found += _fitted(with_nuisances(problem, [letter]), solution, letter)
    found += _stribeck(problem, solution)
    if solution.loss == "linear":
        found += _without_outliers(problem, solution)
    return tuple(sorted(found, key=lambda each: -each.decrease))


def extended(problem: Problem, solution: Solution) -> tuple[float, bool, list[Parameter]]:
    """The score of a problem's further parameters at a solution without them: the decrease of the sum of squares that
    they predict, whether the fitted ones leave anything of their derivatives, and all parameters one step of Gauss and
    Newton on.
    """
    own = len(solution.parameters)
    further = problem.parameters[own:]
    at = {p.name: p.start for p in further} | solution.values
    parts, rows = estimation.residuals(problem.experiments, problem.parameters, at)
    weight = _weights(solution)
    jacobian = rows * weight[:, np.newaxis]
    size = np.sqrt((jacobian**2).sum(axis=0))
    alive, whole = np.flatnonzero(size[:own] > 0.0), size[own:]
    columns = [jacobian[:, alive] / size[alive], jacobian[:, own:], np.concatenate(parts) * weight]
    r = estimation.triangle(np.column_stack(columns))[alive.size : alive.size + whole.size, alive.size :]
    left, rest = r[:, :-1], r[:, -1]
    independent = bool((np.sqrt((left**2).sum(axis=0)) > _INDEPENDENT * whole).all() and whole.all())
    step = -np.linalg.lstsq(left, rest, rcond=1e-9)[0] if independent else np.zeros(whole.size)
    moved = [p._replace(start=estimation.clip(p, p.start + float(each))) for p, each in zip(further, step, strict=True)]
    return float((rest**2).sum()) if independent else 0.0, independent, [*estimation.started(solution), *moved]


def _weights(solution: Solution) -> Array:
    """Of each sample, 1/sigma; 0 for an outlier."""
    return np.concatenate([some / sigma for some, sigma in zip(solution.inliers, solution.sigma, strict=True)])


def _fitted(problem: Problem, solution: Solution, letter: str) -> list[Diagnosis]:
    """What a nuisance brings, fitted from where its score points."""
    new = [p.name for p in problem.parameters[len(solution.parameters) :]]
    if not new:
        return []
    decrease, independent, start = extended(problem, solution)
    if letter == "lag" and not independent:
        start = [p._replace(start=_LAG) if p.name in new else p for p in start]
    elif decrease < _SCORE:
        return []
    again = estimation.again(solution, problem.experiments, start, most=25, precision=1e-6)
    if not is_noise(problem, again):  # the minimum without it may be far from that with it
        again = estimation.better(again, follow(problem), problem.experiments)
    return _worth(letter, {name: again.values[name] for name in new}, solution, again.residuals)


def _worth(name: str, values: Values, of: Solution, after: Parts) -> list[Diagnosis]:
    """A diagnosis of a fit, if it explains more than noise would."""
    return brought(name, values, (of.residuals, after), of.sigma, len(of.parameters), of.loss)


def brought(
    name: str, values: Values, residuals: tuple[Parts, Parts], sigma: Sequence[float], free: int, loss: str
) -> list[Diagnosis]:
    """A diagnosis by the residuals of each recording without a cause and with it, of the samples that are no outliers
    after it, if it explains more than noise would; sigma: the noise of each; free: how many parameters the fit without
    it has.
    """
    chosen = [estimation.bulk(part, loss) for part in residuals[1]]
    old, new = ([part[some] for part, some in zip(parts, chosen, strict=True)] for parts in residuals)
    before, left = (sum(_power(one) / size**2 for one, size in zip(parts, sigma, strict=True)) for parts in (old, new))
    count = sum(part.size for part in new)
    inflation = max(estimation.tests_of(part).inflation for part in new if part.size > 3)
    unit = max(left, 1e-300) / max(count - free - len(values), 1) * inflation
    decrease = (before - left) / unit - 2.0 * (len(values) - 1)
    rms, rest = (math.sqrt(sum(map(_power, parts)) / max(count, 1)) for parts in (old, new))
    return [Diagnosis(name, values, rms, rest, decrease, _OPTIONS.get(name, ""))] if decrease >= _LEAST else []


def _power(residual: Array) -> float:
    return float(residual @ residual)


_OPTIONS = {each: f"--{each}" for each in NUISANCES}
_WORTH = 0.97
"""Share of the rms that friction higher at rest must leave: below it, an encoder's quantum looks like it."""
SPEEDS = (0.02, 0.06, 0.2)
"""Stribeck velocities that are tried, as shares of the largest velocity."""


def _stribeck(problem: Problem, solution: Solution) -> list[Diagnosis]:
    """The score of friction that is higher at rest; over a free actuator of its own friction, not of the body's."""
    response = np.concatenate([each.response_to_stribeck(solution.values, SPEEDS) for each in problem.experiments])
    return stiffest(each for column in response.T if column.any() for each in _stribeck_at(solution, column))


def stiffest(tried: Iterable[Diagnosis]) -> list[Diagnosis]:
    """Of friction that is higher at rest what explains most, if it explains enough."""
    found = [each for each in tried if each.values["level"] > 0.0 and each.after < _WORTH * each.before]
    return [max(found, key=lambda each: each.decrease)] if found else []


def _stribeck_at(solution: Solution, response: Array) -> list[Diagnosis]:
    weight = _weights(solution)[:, np.newaxis]
    rows = np.column_stack([solution.jacobian, response])
    residual = np.concatenate(solution.residuals)
    size = np.maximum(np.sqrt(((rows * weight) ** 2).sum(axis=0)), 1e-300)
    scaled = np.asarray(rows * weight / size, dtype=np.float64)
    found = np.linalg.lstsq(scaled, residual * weight[:, 0], rcond=1e-9)[0] / size
    ends = np.cumsum([part.size for part in solution.residuals])[:-1]
    after: list[Array] = np.split(np.asarray(residual - rows @ found, dtype=np.float64), ends)
    return _worth("Stribeck", {"level": -float(found[-1])}, solution, after)


def _without_outliers(problem: Problem, solution: Solution) -> list[Diagnosis]:
    """What leaving out the samples that are off their neighbours brings, if they are off the fit to the others too."""
    masks: list[NDArray[np.bool_]] = [~outliers(each.measured) for each in problem.experiments]
    if all(mask.all() for mask in masks):
        return []
    again = estimation.again(solution, selected(problem.experiments, masks), most=25, precision=1e-6)
    pairs = zip(estimation.again(again, problem.experiments, most=1).residuals, again.residuals, strict=True)
    off = sum(int((np.abs(part) > _OFF * estimation.rms(kept)).sum()) for part, kept in pairs)
    if not off:
        return []
    before, after = (estimation.rms(np.concatenate(each.residuals)) for each in (solution, again))
    decrease = solution.count * ((before / max(after, 1e-300)) ** 2 - 1.0)
    found = Diagnosis("outliers", {"samples": off}, before, after, decrease, "--loss huber")
    return [found] if after < _SPOILT * before else []


_SPOILT = 0.8
"""Share of the rms that outliers must leave, to be named."""
_OFF = 6.0
"""Times the rms of a fit without them that outliers are off it."""


# ---- repeats ----


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
    pairs = zip(start, np.sqrt(np.diag(spread.covariance) * found.inflation).tolist(), strict=True)
    return {p.name: (found.values[p.name], error) for p, error in pairs if p.name not in spread.weak}


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
