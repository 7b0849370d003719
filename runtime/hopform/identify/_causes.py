"""Causes of what a fit does not explain. A cause is named only if three things hold; all others are possible ones.

| to be named | by |
|---|---|
| it explains all | the fit with it leaves white noise, of the sensor's size, also in samples that were held out: three blocks of nine of each recording |
| its size is plausible | gravity's sine has the weight that the spring has, a lag is shorter than 50 ms |
| it stands out | no other cause, nor any of `_rivals`, for which a fit has no element, comes near |

| cause | what is fitted with it |
|---|---|
| a known value that is off | the value, everything else again |
| lag, gain, clock | the letter of the sensor, everything else again |
| friction that is higher at rest (Stribeck) or grows with the load, drag of the air, a load that drifts, gravity's sine, a spring that hardens | a force along the fitted motion: the response to it, exact through sticking; of a body without a drive to first order |
| play between the mass and its sensor | what a play of that width makes of the fitted motion |
| ripple, link, drift of the sensor, lens, lost samples | columns of `_rivals` |
| outliers | the samples that are not off their neighbours |

A known value comes before gain and clock: crystals are good to 50 ppm, springs and masses to a few percent.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform.identify import _estimation as estimation
from hopform.identify import _rivals as rivals
from hopform.identify._alternatives import friction_at_rest, friction_by_load, hardening
from hopform.identify._estimation import Parameter, Solution
from hopform.identify._motion import Array, Values
from hopform.identify._nuisances import NUISANCES, begun, extended, weights, with_nuisances
from hopform.identify._recordings import noise_of, outliers, quantum_of
from hopform.identify._rigs import Experiment, Force
from hopform.identify._search import Problem, selected

Parts = Sequence[Array]
"""Residuals of each recording."""


class Diagnosis(NamedTuple):
    """What one cause would bring: values of its parameters, rms of all positions [m] before and after, the decrease of
    the sum of squares in variances of what is left, the option that takes it into account, and whether it is only
    possible: others come as near, or something is left.
    """

    name: str
    values: Values
    before: float
    after: float
    decrease: float
    option: str
    possible: bool = False

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
            "loaded": "friction that grows with the load",
            "hardening": f"a spring that {'hardens' if sizes[0] > 0.0 else 'softens'}",
            "ripple": f"a ripple of the drive with a pitch of {1e3 * sizes[0]:.3g} {unit}",
            "link": f"a link that bends, at {sizes[0]:.2g} Hz",
            "sensor drift": f"a drift of the sensor of {1e3 * abs(sizes[0]):.2g} {unit}",
            "lens": "the distortion of a lens",
            "gap": f"samples that are lost after {sizes[0]:.4g} s",
            "current noise": "noise of the recorded drive",
            "sign": f"the other sign of {' and '.join(self.values)}",
        }[self.name]


def said(diagnoses: Sequence[Diagnosis], shown: tuple[str, float]) -> list[str]:
    """The cause that stands out; else those that come nearest, as possible. shown: the unit of residuals and its
    factor.
    """
    if not diagnoses:
        return []
    unit, factor = shown
    named = [each for each in diagnoses if not each.possible]
    if named:
        first = named[0]
        brings = f"{first.cause(unit)} brings rms {factor * first.before:.3g} to {factor * first.after:.3g} {unit}"
        return [brings + (f"; {first.option}" if first.option else "; no option fits it")]
    causes = ", ".join(f"{each.cause(unit).rstrip(',')} (to {factor * each.after:.3g} {unit})" for each in diagnoses)
    options = list(dict.fromkeys(each.option for each in diagnoses if each.option))
    tries = f"; to try: {' or '.join(options)}" if options else ""
    before = f"rms {factor * diagnoses[0].before:.3g} {unit}"
    return [f"possible causes of {before}, none of which stands out: {causes}{tries}"]


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


_SHOWN = 3
"""Possible causes that are reported."""
_NEAR = 0.3
"""Share of the sum of squares above noise that a possible cause must explain, of what the nearest one does."""
_APART, _APART_SHARE = 25.0, 0.05
"""Variances, and the share of what a cause explains, that every other one must leave beyond it for it to be named."""
_NOISY = 1.12
"""Times the noise of the sensor, by third differences of its samples, that a named cause leaves at most."""


class Tried(NamedTuple):
    """A cause that was fitted: its diagnosis, and whether it explains all with a plausible size."""

    diagnosis: Diagnosis
    explains: bool


def diagnose(problem: Problem, solution: Solution) -> tuple[Diagnosis, ...]:
    """The cause that explains a fit's residuals and stands out from all others, alone; else those that come nearest,
    as possible.
    """
    of_known = [*_known(problem, solution)]
    tried = of_known + [each for letter in NUISANCES if not (_explained(of_known) and letter in ("gain", "clock"))
                        for each in _nuisance(problem, solution, letter)]  # fmt: skip
    tried += [*_forces(problem, solution), *_play(problem, solution), *_rivals(solution)]
    if solution.loss == "linear":
        tried += _without_outliers(problem, solution)
    if not tried:
        return ()
    tried.sort(key=lambda each: -each.diagnosis.decrease)
    explaining = [each for each in tried if each.explains]
    if explaining and _stands_out(explaining[0], tried, solution.count):
        return (explaining[0].diagnosis,)
    most = tried[0].diagnosis.decrease
    enough = [each.diagnosis for each in tried if each.diagnosis.after < _WORTH * each.diagnosis.before]
    near = [each._replace(possible=True) for each in enough if each.decrease >= _NEAR * most]
    by_name = {each.name: each for each in reversed(near)}
    return tuple(sorted(by_name.values(), key=lambda each: -each.decrease)[:_SHOWN])


def _explained(tried: Iterable[Tried]) -> bool:
    return any(each.explains for each in tried)


def _stands_out(first: Tried, tried: Sequence[Tried], count: int) -> bool:
    """Whether every other cause leaves more of so many samples. What a cause is a case of is no other one."""
    cause = first.diagnosis
    unit = max(cause.after, 1e-300) ** 2 / max(count, 1)
    margin = max(_APART, _APART_SHARE * (cause.before**2 - cause.after**2) / unit)
    others = [each.diagnosis for each in tried if each.diagnosis.name not in (cause.name, *_CASES.get(cause.name, ()))]
    return all((each.after**2 - cause.after**2) / unit > margin for each in others)


_CASES = {"gravity": ("hardening",), "known value": ("gain", "clock"), "outliers": ("gap",), "gap": ("outliers",)}
"""Causes that a cause need not stand out from: of a softening spring one with the weight of gravity is gravity."""


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


def _is_noise(solution: Solution, residuals: Parts) -> bool:
    """Whether residuals of a fit with a cause are the sensor's noise: white where samples were held out and in all, and
    no larger than what third differences show of it.
    """
    for experiment, part in zip(solution.experiments, residuals, strict=True):
        inside = part[estimation.bulk(part, solution.loss)]
        measured = experiment.measured
        if estimation.is_rounding(measured, part):
            continue
        noise = max(noise_of(measured), 0.3 * quantum_of(measured))
        if estimation.tests_of(inside).chance < _HELD_OUT or estimation.rms(inside) > _NOISY * noise:
            return False
    return _whitens(solution, residuals)


# ---- what can be fitted as a parameter ----


def _known(problem: Problem, solution: Solution) -> Iterator[Tried]:
    """Known values and defaults that are off: where another one explains what is left. The fit of a model takes a known one
    as a start; a default is fitted by its name.
    """

    def near(tried: Tried) -> Tried:
        if problem.kind != "model":
            return tried
        given = " ".join(f"--near {name}={value:.6g}" for name, value in tried.diagnosis.values.items())
        option = f"fit it with {given} in place of --known, or measure it again"
        return tried._replace(diagnosis=tried.diagnosis._replace(option=option))

    for letter, value in problem.known.items():
        if (letter in _RELEASED or problem.kind == "model") and letter not in solution.values:
            kind = "positive" if value > 0.0 else "real"
            wider = _released(problem, Parameter(letter, "", value, max(abs(value), 1e-9), kind))
            if wider is not None:
                yield from map(near, _fitted("known value", letter, wider, solution))
    for default in problem.defaults:
        wider = _released(problem, default)
        for tried in _fitted("known value", default.name, wider, solution) if wider is not None else ():
            yield tried._replace(diagnosis=tried.diagnosis._replace(option=f"add {default.name} to --fitted"))
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


def _released(problem: Problem, parameter: Parameter) -> Problem | None:
    """A problem with what is known among its parameters; None where no recording has it."""
    letter = parameter.name
    if not any(letter in each.constants for each in problem.experiments):
        return None

    def freed(experiment: Experiment) -> Experiment:
        if letter not in experiment.constants:
            return experiment
        constants = {name: own for name, own in experiment.constants.items() if name != letter}
        return replace(experiment, names={**experiment.names, letter: letter}, constants=constants)

    return replace(
        problem, experiments=tuple(map(freed, problem.experiments)), parameters=(*problem.parameters, parameter)
    )


def _nuisance(problem: Problem, solution: Solution, letter: str) -> Iterator[Tried]:
    """A lag, a gain or a clock, if it is not fitted already."""
    if all(letter not in each.names for each in problem.experiments):
        yield from _fitted(letter, letter, with_nuisances(problem, [letter]), solution)


def _fitted(name: str, letter: str, wider: Problem, solution: Solution) -> list[Tried]:
    """A cause that is fitted to the samples that are not held out, from where its score points."""
    new = [p.name for p in wider.parameters[len(solution.parameters) :]]
    decrease, independent, start = extended(wider, solution)
    if not (letter == "lag" and not independent) and decrease < _SCORE:
        return []
    some = selected(wider.experiments, [~_held_out(each.time.size) for each in wider.experiments])
    start = begun(wider, solution, some, independent, start)
    fitted = estimation.again(solution, some, start, most=25, precision=1e-6)
    explains = _is_noise(solution, estimation.again(fitted, wider.experiments, most=1).residuals)
    whole = estimation.again(fitted, wider.experiments, most=10, precision=1e-6)
    values = {each: whole.values[each] for each in new}
    plausible = name != "lag" or max(values.values()) < _LONGEST_LAG
    return _worth(name, values, solution, whole.residuals, explains=explains and plausible)


_LONGEST_LAG = 0.05
"""[s] of a sensor that one would use."""


def _worth(name: str, values: Values, solution: Solution, after: Parts, *, explains: bool) -> list[Tried]:
    """A diagnosis of a fit, if it explains more than noise would."""
    diagnoses = brought(
        name, values, (solution.residuals, after), solution.sigma, len(solution.parameters), solution.loss
    )
    return [Tried(each, explains) for each in diagnoses]


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
    worth = decrease >= least or rest < _CLEARLY * rms
    return [Diagnosis(name, values, rms, rest, decrease, _OPTIONS.get(name, ""))] if worth else []


_CLEARLY = 0.9
"""Share of the rms at most that a cause leaves to be possible where what is left has a long memory, which makes little
of any decrease.
"""


def _power(residual: Array) -> float:
    return float(residual @ residual)


_OPTIONS = {each: f"fit it with --{each}" for each in NUISANCES} | {
    "known value": "leave it out of --known, or measure it again", "outliers": "fit with --loss huber",
    "gravity": "fit a joint with --sine (in Python sine=True)", "sign": "turn it there, or in what is known of the drive",
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
        "hardening": [hardening],
        "loaded": [friction_by_load],
    }


def _forces(problem: Problem, solution: Solution) -> Iterator[Tried]:
    """Forces that explain what is left; of each cause the shape that explains most."""
    for name, shapes in _shapes().items():
        if name == "gravity" and (problem.units.position != "rad" or problem.experiments[0].swings):
            continue
        if name == "Stribeck" and not _has_friction(problem, solution):
            continue
        tried = [each for shape in shapes for each in _forced(problem, solution, name, shape)]
        yield from sorted(tried, key=lambda each: -each.diagnosis.decrease)[:1]


_SMALL = 0.01
"""Size of a force at first."""


def _forced(problem: Problem, solution: Solution, name: str, shape: Force) -> list[Tried]:
    """A force that explains what is left, with its size and its response at that size."""
    size, tried = _SMALL, list[Tried]()
    for _ in range(_TURNS):
        responses = [each.response_to(solution.values, shape, size) for each in problem.experiments]
        column = np.concatenate(responses)
        if not column.any():
            break
        (size,), after = _with_columns(solution, column[:, np.newaxis])
        if abs(size) < 1e-6 or not _may_be(name, size):
            break
        worth = _worth(name, {"level": size}, solution, after, explains=_is_noise(solution, after))
        if not worth:
            break
        tried += [each._replace(explains=each.explains and _is_plausible(name, each.diagnosis)) for each in worth]
        if tried[-1].explains:
            break
    return [max(tried, key=lambda each: (each.explains, each.diagnosis.decrease))] if tried else []


def _may_be(name: str, size: float) -> bool:
    """Whether a force of a size may be there at all: friction and drag are against the motion."""
    return size > 0.0 or name in ("drift", "hardening")


def _is_plausible(name: str, diagnosis: Diagnosis) -> bool:
    """Whether a force has the size that its name says."""
    level = diagnosis.values["level"]
    if name == "gravity":
        return abs(level - 1.0) < _OF_WEIGHT
    if name == "Stribeck":
        return level < _MOST_STRIBECK and diagnosis.after < _WORTH * diagnosis.before
    return name not in ("hardening", "loaded")


_OF_WEIGHT = 0.15
"""Share of the spring by which gravity's sine may be off it: it is its weight."""
_MOST_STRIBECK = 3.0
"""Times Coulomb friction that friction at rest is above it at most."""


def _has_friction(problem: Problem, solution: Solution) -> bool:
    """Whether the data show Coulomb friction at all: there is no share of what may be 0."""
    covariance = estimation.spread(solution).covariance
    names = [p.name for p in solution.parameters]
    errors = {name: math.sqrt(covariance[n, n]) for n, name in enumerate(names) if name in problem.coulomb}
    return all(solution.values[name] > 2.0 * error for name, error in errors.items())


def _with_columns(solution: Solution, columns: Array) -> tuple[list[float], list[Array]]:
    """The sizes of further terms of the prediction by a linear least squares of the samples that are not held out, and
    the residuals of all.
    """
    rows = np.column_stack([solution.jacobian, columns])
    residual, weight = np.concatenate(solution.residuals), weights(solution)
    sizes = [part.size for part in solution.residuals]
    trained = weight * np.concatenate([~_held_out(size) for size in sizes])
    scale = np.maximum(np.sqrt(((rows * weight[:, np.newaxis]) ** 2).sum(axis=0)), 1e-300)
    scaled = np.asarray(rows * trained[:, np.newaxis] / scale, dtype=np.float64)
    moved = np.asarray(np.linalg.lstsq(scaled, -residual * trained, rcond=1e-9)[0] / scale, dtype=np.float64)
    after = np.asarray(residual + rows @ moved, dtype=np.float64)
    parts = [np.asarray(each) for each in np.split(after, np.cumsum(sizes)[:-1])]
    return moved[solution.jacobian.shape[1] :].tolist(), parts


_WORTH = 0.97
"""Share of the rms that a cause must leave at most: friction at rest that leaves more may be an encoder's quantum."""


def stiffest(tried: Iterable[Diagnosis]) -> list[Diagnosis]:
    """Of friction that is higher at rest what explains most, if it explains enough."""
    helpful = [each for each in tried if each.values["level"] > 0.0 and each.after < _WORTH * each.before]
    return [max(helpful, key=lambda each: each.decrease)] if helpful else []


# ---- play ----


def _play(problem: Problem, solution: Solution) -> Iterator[Tried]:
    """A play between the mass and its sensor: the width that explains most."""
    predicted = [e.measured + part for e, part in zip(problem.experiments, solution.residuals, strict=True)]
    width, after = 1e-6, list[Array]()
    for _ in range(_TURNS):
        column = np.concatenate([(rivals.behind_play(each, width) - each) / width for each in predicted])
        (width,), after = _with_columns(solution, column[:, np.newaxis])
        if not width > 0.0:
            return
    yield from _worth("play", {"width": width}, solution, after, explains=_is_noise(solution, after))


# ---- what no element says ----


def _rivals(solution: Solution) -> Iterator[Tried]:
    """The rivals, each by what its number is where it explains most. Lost samples are named, since the data show where
    they jump; so is a drift of the sensor.
    """
    weight = weights(solution) * np.concatenate([~_held_out(part.size) for part in solution.residuals])
    basis, left = _reduced(solution, weight)

    def gained(rival: rivals.Rival) -> float:
        """By how much columns lower the sum of squares of the samples that are not held out."""
        rest = rival.columns * weight[:, np.newaxis]
        rest = rest - basis @ (basis.T @ rest)
        size = np.sqrt((rest**2).sum(axis=0))
        if not np.isfinite(size).all() or not (size > 0.0).all():
            return 0.0
        return float(((np.linalg.qr(rest / size)[0].T @ left) ** 2).sum())

    for some in rivals.rivals_of(solution):
        best = max(some, key=gained, default=None)
        if best is None or not np.isfinite(best.columns).all() or not best.columns.any():
            continue
        sizes, after = _with_columns(solution, best.columns)
        values = _values_of(best, sizes)
        explains = best.name in ("sensor drift", "lens") and _is_noise(solution, after)
        for tried in _worth(best.name, values, solution, after, explains=explains):
            seen = best.name == "gap" and tried.diagnosis.after < _SEEN * tried.diagnosis.before
            yield tried._replace(explains=explains or seen)


_SEEN = 0.5
"""Share of the rms that is left where lost samples are named: the data show the jump, and after a long one the motion is
not the one that is fitted.
"""


def _values_of(rival: "rivals.Rival", sizes: Sequence[float]) -> dict[str, float]:
    """The numbers of a rival: which it is, then its sizes."""
    if rival.name == "sensor drift":
        ends = [sizes[n] - 2.0 * sizes[n + 1] for n in range(0, len(sizes), 3)]
        return {f"drift@{n}": each for n, each in enumerate(ends)}
    if rival.name == "lens":
        return {"share": sizes[0]}
    return {"number": rival.number} | {f"size_{n}": each for n, each in enumerate(sizes)}


def _reduced(solution: Solution, weight: Array) -> tuple[Array, Array]:
    """An orthonormal basis of the parameters' derivatives at weighted samples, and what residuals are beside it."""
    rows = solution.jacobian * weight[:, np.newaxis]
    size = np.sqrt((rows**2).sum(axis=0))
    basis = np.linalg.qr(rows[:, size > 0.0] / size[size > 0.0])[0]
    left = np.concatenate(solution.residuals) * weight
    return basis, np.asarray(left - basis @ (basis.T @ left))


# ---- outliers ----


def has_outliers(solution: Solution) -> bool:
    """Whether samples of a fit that is not robust are far off it: they leave the rest white."""
    return solution.loss == "linear" and any(
        0.0 < _OFF * estimation.scale(part) < float(np.abs(part).max(initial=0.0)) for part in solution.residuals
    )


def _without_outliers(problem: Problem, solution: Solution) -> list[Tried]:
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
    white = all(each.white for each in again.tests)
    return [Tried(diagnosis, white)] if after < _SPOILT * before else []


_SPOILT = 0.8
"""Share of the rms that outliers must leave, to be named."""
_OFF = 6.0
"""Times the rms of a fit without them that outliers are off it."""
