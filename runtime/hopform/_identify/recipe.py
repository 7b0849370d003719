"""How every fit goes: read, check, segment, start, minimise, intervals, diagnose, report. `fit` is that list."""

import math
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple, Unpack

import numpy as np

from hopform._checks import flag, function, word
from hopform._errors import HopformError
from hopform._identify import estimation, kinds
from hopform._identify.estimation import Progress, Solution
from hopform._identify.fits import Fit, Minimum, Options, Trace, reported
from hopform._identify.kinds import Kind, Recordings
from hopform._identify.motion import Array, Values
from hopform._identify.nuisances import NUISANCES, diagnose, extended, with_nuisances
from hopform._identify.repeats import repeats_of
from hopform._identify.search import Problem, bulk, least_squares, minimise, part_of, selected


def fit(given: Mapping[Kind, Recordings], known: Values | None = None, **options: Unpack[Options]) -> Fit:
    """The recipe. given: recordings, or their files, by their kind. Raises HopformError where one cannot be of its
    kind, MissingExtra without scipy.
    """
    began, asked = clock.perf_counter(), checked(options)
    recordings = kinds.read(given)
    groups = kinds.check(recordings, known, asked.loss)
    motions = kinds.segment(groups)
    problem = kinds.start(motions, asked.backend, whole=len(given) > 1)

    asked.stage("fit")
    best = _minimum(problem, asked.loss, asked.nuisances)
    intervals = estimation.estimates(
        best.solution, best.problem.experiments, loss=asked.loss, inflation=best.inflation, profiles=not best.hopeless,
        progress=asked.stage,
    )  # fmt: skip
    asked.stage("diagnoses")
    diagnoses = diagnose(best.problem, best.solution, asked.loss) if asked.diagnose else ()
    asked.stage("the old model")
    old = _old(best) if asked.compare and not best.hopeless and best.problem.coulomb else {}
    asked.stage("hold-out")
    left_out = _holdout(best, asked.loss) if asked.holdout and not best.hopeless else [math.nan] * len(best.tests)
    repeats = repeats_of(best.problem, best.solution, intervals[0], asked.loss) if not best.hopeless else ((), ())
    found = reported(best, intervals, diagnoses, _traces(best, old, left_out), repeats)
    return replace(found, seconds=clock.perf_counter() - began)


class Asked(NamedTuple):
    """The options of a fit, each with its value."""

    loss: str
    compare: bool
    holdout: bool
    diagnose: bool
    nuisances: tuple[str, ...]
    backend: str | None
    stage: Progress


def checked(options: Options) -> Asked:
    """The options; HopformError for one that is none, or for a value that it cannot have."""
    for name in options:
        word("an option of a fit", name, tuple(Options.__annotations__))
    compare, holdout, further = (flag(name, options.get(name, True)) for name in ("compare", "holdout", "diagnose"))
    function("progress", options.get("progress"))
    loss = word("loss", options.get("loss", "linear"), ("linear", "soft_l1", "huber", "cauchy"))
    wanted = tuple(dict.fromkeys(word("nuisances", each, NUISANCES) for each in options.get("nuisances", ())))
    stage: Progress = options.get("progress") or (lambda _: None)
    return Asked(loss, compare, holdout, further, wanted, options.get("backend"), stage)


def _traces(best: Minimum, old: Mapping[int, Array], left_out: Sequence[float]) -> tuple[Trace, ...]:
    return tuple(
        Trace(
            each.label, each.of if each.kind == "free" else _QUANTITY[each.kind], each.time + each.begin, each.measured,
            each.measured + residual,
            each.measured + old[n] if n in old else None, best.tests[n],
            estimation.tests_of(old[n][best.inliers[n]]).rms if n in old else math.nan, left_out[n],
        )
        for n, (each, residual) in enumerate(zip(best.problem.experiments, best.solution.residuals, strict=True))
    )  # fmt: skip


def _minimum(problem: Problem, loss: str, wanted: Sequence[str]) -> Minimum:
    problem, solution = _minimised(problem, loss, wanted)
    inliers = [bulk(residual, loss) for residual in solution.residuals]
    tests = [estimation.tests_of(residual[some]) for residual, some in zip(solution.residuals, inliers, strict=True)]
    return Minimum(problem, solution, inliers, tests)


def _minimised(problem: Problem, loss: str, wanted: Sequence[str]) -> tuple[Problem, Solution]:
    """The minimum of a problem; with nuisances, those are fitted from where it is without them."""
    solution = minimise(problem, loss)
    if not wanted:
        return problem, solution
    wider = with_nuisances(problem, wanted)
    idle = [each for each in wanted if all(each not in one.names for one in wider.experiments)]
    if idle:
        raise HopformError(f"nuisances: {idle[0]} is none of these recordings: no current changes in any of them")
    _, parameters = extended(wider, solution, loss)
    wider = replace(wider, parameters=tuple(parameters), starts=({p.name: p.start for p in parameters}, *wider.starts))
    return wider, minimise(wider, loss)


def _old(best: Minimum) -> dict[int, Array]:
    """Residuals of the model without Coulomb friction, by the experiment's number; it has no threshold to compare.

    It starts from the new one's parameters, with more viscous friction in place of the other, and is followed over more
    and more of the recordings as that is. It is the least squares of the samples that are no outliers of the new one.
    """
    problem, solution, inliers, _ = best
    numbers = [n for n, each in enumerate(problem.experiments) if each.kind != "threshold"]
    viscous = {p.name: p for p in problem.parameters if p.name[:1] == "b"}
    starts = tuple(
        solution.values
        | {name: more * solution.values[name] + 0.02 * (more - 1.0) * p.scale for name, p in viscous.items()}
        for more in (1.0, 1.6, 3.0)
    )
    whole, fixed = [problem.experiments[n] for n in numbers], dict.fromkeys(problem.coulomb, 0.0)
    some = selected(whole, [inliers[n] for n in numbers])
    found = least_squares(replace(problem, experiments=some, starts=starts, parts=problem.parts[-2:]), fixed)
    every = estimation.solve(whole, estimation.started(found), sigma=found.sigma, fixed=fixed, most=1)
    return dict(zip(numbers, every.residuals, strict=True))


_QUANTITY = {"attached": "x2", "ground": "x2", "free": "x2", "held": "x1", "air": "x1", "threshold": "threshold"}


def _holdout(best: Minimum, loss: str) -> list[float]:
    """rms over the last third of each recording, without outliers, of a fit to the first two."""
    problem, solution, inliers, _ = best
    short = [each.upto(part_of(each, 2.0 / 3.0)) for each in problem.experiments]
    fitted = estimation.solve(
        short, estimation.started(solution), sigma=solution.sigma, loss=loss, most=20, precision=1e-6
    )
    errors = list[float]()
    for whole, part, some in zip(problem.experiments, short, inliers, strict=True):
        last = np.flatnonzero(some[part.time.size :]) + part.time.size
        try:
            predicted, _ = whole.predict(fitted.values)
            rest = (predicted - whole.measured)[last]
            errors.append(estimation.rms(rest) if rest.size else math.nan)
        except HopformError:
            errors.append(math.nan)
    return errors
