"""Causes of what a fit does not explain. A cause is named only if fitting it leaves white noise in samples that were
held out: three blocks of nine of each recording.

| cause | what is fitted with it |
|---|---|
| a known value that is off | the value, everything else again |
| lag, gain, clock | the letter of the sensor, everything else again |
| friction that is higher at rest (Stribeck), drag of the air, a load that drifts, gravity's sine | a force along the fitted motion: the response to it, exact through sticking; of a body without a drive to first order |
| play between the mass and its sensor | what a play of that width makes of the fitted motion |
| outliers | the samples that are not off their neighbours |

A known value comes before gain and clock: crystals are good to 50 ppm, springs and masses to a few percent. Several
causes that leave as little are named together.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform.identify import _estimation as estimation
from hopform.identify._alternatives import friction_at_rest
from hopform.identify._estimation import Parameter, Solution
from hopform.identify._motion import Array, Values
from hopform.identify._nuisances import NUISANCES, begun, extended, weights, with_nuisances
from hopform.identify._recordings import outliers
from hopform.identify._rigs import Experiment, Force
from hopform.identify._search import Problem, selected

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

    def cause(self, unit: str) -> str:
        """The cause with its size; unit: a thousandth of that of positions."""
        sizes = list(self.values.values())
        in_ms = ", ".join(f"{1e3 * each:.3g}" for each in sizes)
        fast = 100.0 * (sizes[0] - 1.0)
        changes = ", ".join(f"{name} is not as known: {value:.4g} fits" for name, value in self.values.items())
        return {
            "known value": changes,
            "lag": f"a first-order lag of {in_ms} ms",
            "gain": f"a sensor gain of {', '.join(f'{each:.4g}' for each in sizes)}",
            "clock": f"a clock of the recording that is {abs(fast):.3g} % {'slow' if fast > 0.0 else 'fast'}",
            "outliers": f"leaving out {sizes[0]:.0f} samples",
            "Stribeck": f"friction that is higher at rest, by about {100.0 * sizes[0]:.1g} % (Stribeck),",
            "drag": f"drag of the air, {100.0 * sizes[0]:.2g} % of the largest force,",
            "drift": f"a load that drifts by {100.0 * sizes[0]:.2g} % of the largest force",
            "gravity": "gravity's sine, which a spring is not,",
            "play": f"a play of {1e3 * sizes[0]:.3g} {unit}",
        }[self.name]


def said(diagnoses: Sequence[Diagnosis], shown: tuple[str, float]) -> list[str]:
    """The cause that explains most, and those that explain as much; shown: the unit of residuals and its factor."""
    if not diagnoses:
        return []
    first = diagnoses[0]
    alike = [each for each in diagnoses[1:] if first.decrease - each.decrease < _ALIKE]
    unit, factor = shown
    causes = " or ".join(each.cause(unit) for each in (first, *alike))
    options = " or ".join(dict.fromkeys(each.option for each in (first, *alike) if each.option))
    brings = f"{causes} brings rms {factor * first.before:.3g} to {factor * first.after:.3g} {unit}"
    advice = f"; {options}" if options else "; no option fits it"
    return [brings + advice + ("; these recordings do not separate them" if alike else "")]


_LEAST = 16.0
"""Variances by which a cause must lower the sum of squares: four standard errors."""
_LEAST_LAG = 8.0
"""The same of a lag, most of which a delay or a later start takes, so that little is left to see of it."""
_SCORE = 6.0
"""The same of a score that is worth a fit."""
_ALIKE = 6.0
"""Variances within which two causes explain as much."""
_HELD_OUT = 1e-3
"""Chance of white noise below which the samples that were held out are not explained."""
_BLOCKS = 9
"""Blocks of a recording, of which every third is held out."""


def diagnose(problem: Problem, solution: Solution) -> tuple[Diagnosis, ...]:
    """The causes that explain a fit's residuals, the best first. A test for one cause sees what a test for any memory
    does not, so residuals that pass for noise are asked too.
    """
    of_known = [*_known(problem, solution)]
    diagnoses = of_known + [each for letter in NUISANCES if not (of_known and letter in ("gain", "clock"))
                     for each in _nuisance(problem, solution, letter)]  # fmt: skip
    diagnoses += [*_forces(problem, solution), *_play(problem, solution)]
    if solution.loss == "linear":
        diagnoses += _without_outliers(problem, solution)
    return tuple(sorted(diagnoses, key=lambda each: -each.decrease))


def _held_out(size: int) -> NDArray[np.bool_]:
    """Which samples of a recording are held out."""
    return np.asarray(np.arange(size) * _BLOCKS // size % 3 == 1)


def _whitens(solution: Solution, residuals: Parts) -> bool:
    """Whether residuals of a fit to the other samples are white, or the encoder's rounding, where samples were held out,
    without outliers.
    """
    for experiment, part in zip(solution.experiments, residuals, strict=True):
        held = _held_out(part.size) & estimation.bulk(part, solution.loss)
        white = estimation.tests_of(part[held]).chance >= _HELD_OUT
        if not (white or estimation.is_rounding(experiment.measured[held], part[held])):
            return False
    return True


# ---- what can be fitted as a parameter ----


def _known(problem: Problem, solution: Solution) -> Iterator[Diagnosis]:
    """Known values that are off: where another one explains what is left. The fit of a model takes it as a start."""

    def near(diagnosis: Diagnosis) -> Diagnosis:
        if problem.kind != "model":
            return diagnosis
        given = " ".join(f"--near {name}={value:.6g}" for name, value in diagnosis.values.items())
        return diagnosis._replace(option=f"fit it with {given} in place of --known, or measure it again")

    for letter, value in problem.known.items():
        if (letter in _RELEASED or problem.kind == "model") and letter not in solution.values:
            wider = _released(problem, letter, value)
            if wider is not None:
                yield from map(near, _fitted("known value", letter, wider, solution))
    for letter, name in problem.tied.items():
        yield from map(near, _fitted("known value", letter, _untied(problem, letter, name, solution), solution))


def _untied(problem: Problem, letter: str, name: str, solution: Solution) -> Problem:
    """A problem in which a letter that is known to be as a parameter is one of its own, and begins as that."""
    tied = next(p for p in problem.parameters if p.name == name)
    untied = tied._replace(name=letter, start=solution.values[name])
    experiments = tuple(replace(each, names={**each.names, letter: letter}) for each in problem.experiments)
    return replace(problem, experiments=experiments, parameters=(*problem.parameters, untied))


_RELEASED = ("m_s", "m_eff", "k", "gamma2", "b1", "b2", "length")
"""Letters whose known value a scale, a drawing or a data sheet gives, and may be off."""


def _released(problem: Problem, letter: str, value: float) -> Problem | None:
    """A problem with a known value among its parameters; None where no recording has it."""
    if not any(letter in each.constants for each in problem.experiments):
        return None

    def freed(experiment: Experiment) -> Experiment:
        if letter not in experiment.constants:
            return experiment
        constants = {name: own for name, own in experiment.constants.items() if name != letter}
        return replace(experiment, names={**experiment.names, letter: letter}, constants=constants)

    kind = "positive" if value > 0.0 else "real"
    parameter = Parameter(letter, "", value, max(abs(value), 1e-9), kind)
    return replace(
        problem, experiments=tuple(map(freed, problem.experiments)), parameters=(*problem.parameters, parameter)
    )


def _nuisance(problem: Problem, solution: Solution, letter: str) -> Iterator[Diagnosis]:
    """A lag, a gain or a clock, if it is not fitted already."""
    if all(letter not in each.names for each in problem.experiments):
        yield from _fitted(letter, letter, with_nuisances(problem, [letter]), solution)


def _fitted(name: str, letter: str, wider: Problem, solution: Solution) -> list[Diagnosis]:
    """A cause that is fitted to the samples that are not held out, from where its score points."""
    new = [p.name for p in wider.parameters[len(solution.parameters) :]]
    decrease, independent, start = extended(wider, solution)
    if not (letter == "lag" and not independent) and decrease < _SCORE:
        return []
    some = selected(wider.experiments, [~_held_out(each.time.size) for each in wider.experiments])
    start = begun(wider, solution, some, independent, start)
    fitted = estimation.again(solution, some, start, most=25, precision=1e-6)
    if not _whitens(solution, estimation.again(fitted, wider.experiments, most=1).residuals):
        return []
    whole = estimation.again(fitted, wider.experiments, most=10, precision=1e-6)
    return _worth(name, {each: whole.values[each] for each in new}, solution, whole.residuals)


def _worth(name: str, values: Values, solution: Solution, after: Parts) -> list[Diagnosis]:
    """A diagnosis of a fit, if it explains more than noise would."""
    return brought(name, values, (solution.residuals, after), solution.sigma, len(solution.parameters), solution.loss)


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
    least = _LEAST_LAG if name == "lag" else _LEAST
    return [Diagnosis(name, values, rms, rest, decrease, _OPTIONS.get(name, ""))] if decrease >= least else []


def _power(residual: Array) -> float:
    return float(residual @ residual)


_OPTIONS = {each: f"fit it with --{each}" for each in NUISANCES} | {
    "known value": "leave it out of --known, or measure it again", "outliers": "fit with --loss huber",
    "gravity": "hopform.identify.fit takes it as sine=True",
}  # fmt: skip


# ---- forces ----

_TURNS = 4
"""Rounds in which the size of a force, or the width of a play, and what it makes of the motion settle."""

SPEEDS = (0.02, 0.06, 0.2)
"""Stribeck velocities that are tried, as shares of the largest velocity."""


def _shapes() -> Mapping[str, Sequence[Force]]:
    """Forces against the motion by their cause, as shares of the largest force; Stribeck's of Coulomb friction."""

    return {
        "Stribeck": [friction_at_rest(share) for share in SPEEDS],
        "drag": [lambda at: at.force * np.abs(at.v) * at.v / at.fastest**2],
        "drift": [lambda at: at.force * at.t / max(float(at.t[-1]), 1e-9)],
        "gravity": [lambda at: at.sprung * (np.sin(at.x) - at.x)],
    }


def _forces(problem: Problem, solution: Solution) -> Iterator[Diagnosis]:
    """Forces that explain what is left; of each cause the shape that explains most."""
    for name, shapes in _shapes().items():
        if name == "gravity" and problem.units.position != "rad":
            continue
        if name == "Stribeck" and not _has_friction(problem, solution):
            continue
        tried = [each for shape in shapes for each in _forced(problem, solution, name, shape)]
        if name == "Stribeck":
            tried = stiffest(tried)
        yield from sorted(tried, key=lambda each: -each.decrease)[:1]


_SMALL = 0.01
"""Size of a force at first."""


def _forced(problem: Problem, solution: Solution, name: str, shape: Force) -> list[Diagnosis]:
    """A force that explains what is left, with its size and its response at that size."""
    size, after = _SMALL, list[Array]()
    for _ in range(_TURNS):
        responses = [each.response_to(solution.values, shape, size) for each in problem.experiments]
        column = np.concatenate(responses)
        if not column.any():
            return []
        size, after = _with_column(solution, column)
        diagnoses = _worth(name, {"level": size}, solution, after)
        if not diagnoses or abs(size) < 1e-6:
            return []
        if _whitens(solution, after):
            return diagnoses
    return []


def _has_friction(problem: Problem, solution: Solution) -> bool:
    """Whether the data show Coulomb friction at all: there is no share of what may be 0."""
    covariance = estimation.spread(solution).covariance
    names = [p.name for p in solution.parameters]
    errors = {name: math.sqrt(covariance[n, n]) for n, name in enumerate(names) if name in problem.coulomb}
    return all(solution.values[name] > 2.0 * error for name, error in errors.items())


def _with_column(solution: Solution, column: Array) -> tuple[float, list[Array]]:
    """The size of a further term of the prediction by a linear least squares of the samples that are not held out, and
    the residuals of all.
    """
    rows = np.column_stack([solution.jacobian, column])
    residual, weight = np.concatenate(solution.residuals), weights(solution)
    sizes = [part.size for part in solution.residuals]
    trained = weight * np.concatenate([~_held_out(size) for size in sizes])
    scale = np.maximum(np.sqrt(((rows * weight[:, np.newaxis]) ** 2).sum(axis=0)), 1e-300)
    scaled = np.asarray(rows * trained[:, np.newaxis] / scale, dtype=np.float64)
    moved = np.asarray(np.linalg.lstsq(scaled, -residual * trained, rcond=1e-9)[0] / scale, dtype=np.float64)
    after = np.asarray(residual + rows @ moved, dtype=np.float64)
    return float(moved[-1]), [np.asarray(each) for each in np.split(after, np.cumsum(sizes)[:-1])]


_WORTH = 0.97
"""Share of the rms that friction higher at rest must leave: below it, an encoder's quantum looks like it."""


def stiffest(tried: Iterable[Diagnosis]) -> list[Diagnosis]:
    """Of friction that is higher at rest what explains most, if it explains enough."""
    helpful = [each for each in tried if each.values["level"] > 0.0 and each.after < _WORTH * each.before]
    return [max(helpful, key=lambda each: each.decrease)] if helpful else []


# ---- play ----


def _play(problem: Problem, solution: Solution) -> Iterator[Diagnosis]:
    """A play between the mass and its sensor: the width that explains most."""
    predicted = [e.measured + part for e, part in zip(problem.experiments, solution.residuals, strict=True)]
    width, after = 1e-6, list[Array]()
    for _ in range(_TURNS):
        column = np.concatenate([(behind_play(each, width) - each) / width for each in predicted])
        width, after = _with_column(solution, column)
        if not width > 0.0:
            return
    if _whitens(solution, after):
        yield from _worth("play", {"width": width}, solution, after)


def behind_play(x: Array, width: float) -> Array:
    """What a sensor shows that follows a motion through a play of a width [m]."""
    positions, shown = np.empty(x.size), float(x[0])
    for n, place in enumerate(x.tolist()):
        shown = min(max(shown, place - 0.5 * width), place + 0.5 * width)
        positions[n] = shown
    return positions


# ---- outliers ----


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
    diagnosis = Diagnosis("outliers", {"samples": off}, before, after, decrease, _OPTIONS["outliers"])
    return [diagnosis] if after < _SPOILT * before else []


_SPOILT = 0.8
"""Share of the rms that outliers must leave, to be named."""
_OFF = 6.0
"""Times the rms of a fit without them that outliers are off it."""
