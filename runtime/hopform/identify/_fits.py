"""The result of a fit: parameters with their intervals, how well each recording is met, and what the data do not
identify.
"""

import math
import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from hopform import HopformError, __version__, load_robot
from hopform._checks import flag, function, word
from hopform._robots import Provenance
from hopform._show import Array as Variable
from hopform._show import Arrays, Curve, Shown
from hopform.extend import Card
from hopform.identify import _alternatives as alternatives
from hopform.identify import _causes as causes
from hopform.identify import _current_noise as current_noise
from hopform.identify import _estimation as estimation
from hopform.identify import _nuisances as nuisances
from hopform.identify import _repeats as repeats
from hopform.identify import _rivals as rivals
from hopform.identify._causes import Diagnosis, said
from hopform.identify._estimation import Estimate, Progress, Solution, Tests
from hopform.identify._kinds import Kind, Recordings, problem_of
from hopform.identify._motion import Array, Values
from hopform.identify._recordings import HOPPER, Units, noise_of, quantum_of
from hopform.identify._repeats import Repeat
from hopform.identify._rigs import NoMotion
from hopform.identify._search import Problem, is_noise, least_squares, minimise, part_of, selected, settled

TITLES = {"drop": "drop test", "robot": "all recordings together"}
"""Headings by kind of answer; that of a model is its name."""
_RIVALS = "viscous friction alone", "with Coulomb friction"
_EQUATIONS = "(1), (2)", "(3), (4)"


class Options(TypedDict, total=False):
    """Options of every fit.

    loss: linear (the default), or soft_l1, huber, cauchy against outliers. compare: fit the old model (1), (2) too.
    holdout: fit without the last third of each recording too. Both are done if not given. diagnose: look for causes of
    what the fit leaves; if not given where that is not noise. nuisances: what of `NUISANCES` is fitted too.
    progress: called with the name of each stage.
    """

    loss: str
    compare: bool
    holdout: bool
    diagnose: bool
    nuisances: Sequence[str]
    progress: Progress | None


@dataclass(frozen=True)
class Trace:
    """A recording beside what the fit makes of it: times [s], positions [m]; the old model (1), (2) where it was
    fitted.

    quantity: x1, x2; "force", then all are in N.
    """

    label: str
    quantity: str
    time: Array
    measured: Array
    predicted: Array
    old: Array | None
    tests: Tests
    old_rms: float
    holdout: float
    """[m] rms over its last third of a fit to the rest alone; NaN where that was not asked for"""

    @property
    def quantum(self) -> float:
        """The encoder's step [m], of which all measured values are multiples; 0 if none is seen."""
        return quantum_of(self.measured) if self.quantity in ("x1", "x2") else 0.0


@dataclass(frozen=True, repr=False, eq=False)
class Fit(Shown):
    """A fit. `values` has every parameter, `estimates` their intervals, `traces` a recording each.

    kind: drop, robot, model, force. correlations: of the fitted parameters that belong to no single recording.
    statements: what the data identify and what they do not, and which recording would help. warnings: what was odd
    about the data.
    """

    kind: str
    estimates: tuple[Estimate, ...]
    known: Values
    correlations: Mapping[tuple[str, str], float]
    traces: tuple[Trace, ...]
    statements: tuple[str, ...]
    warnings: tuple[str, ...]
    evaluations: int
    seconds: float
    solution: Solution | None = field(default=None, repr=False, compare=False)
    diagnoses: tuple[Diagnosis, ...] = ()
    """the cause that explains the residuals and stands out from all others; else those that come nearest, as possible"""
    covariance: Array = field(default_factory=lambda: np.empty((0, 0)), repr=False, compare=False)
    """of the estimates in their order, in the products of their units; infinite for what is not identifiable"""
    repeats: tuple[Repeat, ...] = ()
    """parameters over several recordings of one rig: how well it repeats"""
    units: Units = HOPPER
    """of the recordings; where positions are in rad, what is said to be in m is in rad, forces are torques"""
    scale: bool = True
    """whether something known fixes the scale of all forces"""
    origin: tuple[str, ...] = ()
    """the version of hopform, the command if there was one, and the recordings with their SHA-256"""
    base: Any = None
    """of a model's fit: its robot with what was fitted, and what was given"""
    tied: Mapping[str, str] = field(default_factory=dict[str, str])
    """parameters of a model that are as a fitted one"""
    combinations: tuple[tuple[str, ...], ...] = ()
    """parameters of which the recordings fix a combination alone"""

    def _card(self) -> Card:
        ends = [(each.name, f"{each.value:.4g} {_half_width(each)}") for each in self.estimates if not each.own][:5]
        title = f"Fit ({self.kind}): {len(self.estimates)} parameters from {len(self.traces)} recording(s)"
        return Card(title, ends, [("rms", self.rms), ("notes", len(self.statements)), ("warnings", len(self.warnings))])

    def _unit(self, name: str) -> str | None:
        if name == "rms":
            return self.units.force if self.kind == "force" else self.units.position
        return None if name in self.values else super()._unit(name)  # an estimate has its figures as a word

    def _curve(self) -> Curve:
        trace = self.traces[0]
        return f"residual of {self.called(trace)} over time [s]", trace.time, trace.predicted - trace.measured

    def _arrays(self) -> Arrays:
        names = [each.name for each in self.estimates]
        arrays: dict[str, Variable] = {"parameter": (("parameter",), names)}
        for part in ("value", "low", "high", "unit"):
            arrays[part] = (("parameter",), [getattr(each, part) for each in self.estimates])
        if self.covariance.size:
            arrays["covariance"] = (("parameter", "other_parameter"), self.covariance)
            arrays["other_parameter"] = (("other_parameter",), names)
        for n, trace in enumerate(self.traces):
            of_trace = self.units_of(trace)
            shown, factor = of_trace.shown(trace.quantity)
            units = {"units": shown if factor == 1.0 else of_trace.position}
            arrays[f"time_{n}"] = ((f"time_{n}",), trace.time, {"units": "s", "long_name": trace.label})
            for part in ("measured", "predicted"):
                arrays[f"{part}_{n}"] = ((f"time_{n}",), getattr(trace, part), units)
        return arrays

    @property
    def title(self) -> str:
        """What the fit is of."""
        of_model = "" if self.base is None else f"model {self.base.solver.name}"
        return TITLES.get(self.kind, of_model + ", in force" * (self.kind == "force"))

    @property
    def rivals(self) -> tuple[str, str]:
        """What the old model and the new one are called: the paper's by their equations."""
        old, new = (f"{number}: {words}" for number, words in zip(_EQUATIONS, _RIVALS, strict=True))
        return (old, new) if self.base is None else _RIVALS

    @property
    def _axes(self) -> Mapping[str, Mapping[str, Any]]:
        """The coordinates of a model by the engine's axes; none of a fit of no model."""
        return {} if self.base is None else self.base.solver.facts.axes

    def called(self, trace: Trace) -> str:
        """The name of what a trace is of: a coordinate of a model by that of its file."""
        axes = self._axes
        return str(axes[trace.quantity]["name"]) if trace.quantity in axes else trace.quantity

    def units_of(self, trace: Trace) -> Units:
        """The units of a trace: of several coordinates of a model each has its own."""
        axes = self._axes
        if trace.quantity not in axes:
            return self.units
        return self.units._replace(position=str(axes[trace.quantity]["unit"]))

    @property
    def values(self) -> dict[str, float]:
        """Every parameter, fitted or known."""
        return {**self.known, **{each.name: each.value for each in self.estimates}}

    def __getitem__(self, name: str) -> Estimate:
        """The estimate of a parameter; HopformError if there is none of that name."""
        for estimate in self.estimates:
            if estimate.name == name:
                return estimate
        raise HopformError(f"there is no estimate {name!r}; there are {', '.join(e.name for e in self.estimates)}")

    @property
    def shown(self) -> tuple[str, float]:
        """The unit in which people are shown residuals, and its factor."""
        return self.units.shown("force" if self.kind == "force" else "x1")

    @property
    def rms(self) -> float:
        """Of all residuals, in the unit of the recordings' positions, m or rad; of a fit in force in N or N m."""
        return _together([trace.tests.rms for trace in self.traces], self.traces)

    @property
    def old_rms(self) -> float:
        """The same with viscous friction alone."""
        return _together([trace.old_rms for trace in self.traces], self.traces)

    def robot(self, base: Any = None) -> Any:
        """A robot with what was fitted, and the rest, as what is not identifiable, from `base`; friction of several
        recordings as their mean. base: if none, that of a model's fit. Its `fit` says where each number comes from.
        HopformError for a rotary fit of no model, which is not a hopper's, and without a base.
        """
        if self.base is None and self.units.position != "m":
            raise HopformError(
                "a fit in rad is not a hopper's: export it to a simulator by --export mjcf, urdf or isaac"
            )
        base = self.base if base is None else base
        if base is None:
            raise HopformError("base must be a robot with the values that were not fitted, as load_robot('hopper_c')")
        length = () if self.base is not None else ("L0",)
        fields = {"length" if each.name in length else each.name: each.name for each in base.fields()}
        shifts = {"length": base.c} if length else {}  # the fit has L0 + c
        means = {letter: mean_of(self.estimates, self.tied.get(letter, letter)) for letter in fields}
        means = {letter: mean for letter, mean in means.items() if mean[0].any()}
        ends = np.array([ends - shifts.get(letter, 0.0) for letter, (_, ends) in means.items()]).reshape(-1, 3)
        values, low, high = (tuple(each) for each in ends.T.tolist())
        weights = np.array([each for each, _ in means.values()]).reshape(len(means), len(self.estimates))
        covariance = weights @ np.where(np.isfinite(self.covariance), self.covariance, 0.0) @ weights.T
        given = {fields[name]: each - shifts.get(name, 0.0) for name, each in self.known.items() if name in fields}
        fit = Provenance(
            tuple(fields[letter] for letter in means), values, low, high,
            tuple(tuple(row) for row in covariance.tolist()), tuple(given), base.name or "another robot",
            all(trace.tests.white for trace in self.traces),
            (*self.origin, *(f"{each.name} {each.value!r} s" for each in self.estimates if each.name[:6] == "delay@")),
        )  # fmt: skip
        changed = given | dict(zip(fit.names, fit.values, strict=True))
        return base.with_parameters(changed, fit=fit)

    def sample(self, count: int, seed: int | None = None, base: Any = None) -> tuple[Any, ...]:
        """Robots drawn from the joint distribution of what was fitted; the rest is that of `base`; if none, of a model's
        fit what was given, else hopper_c. HopformError names parameters of which only a combination is fixed: no
        distribution of them follows from the recordings, and values from elsewhere are not of this combination.
        """
        robot = self.robot(base or self.base or load_robot("hopper_c"))
        fields = {"length" if each.name == "L0" else each.name for each in robot.fields()}
        for some in self.combinations:
            if len(alike := [name for name in some if name.partition("@")[0] in fields]) > 1:
                names = " and ".join(alike)
                raise HopformError(
                    f"no robots can be drawn: the recordings identify only a combination of {names}; give one as known"
                )
        return tuple(robot.sample(count, seed))


def _half_width(estimate: Estimate) -> str:
    """The interval of an estimate, in words."""
    half = 0.5 * (estimate.high - estimate.low)
    return f"+- {half:.2g}" if math.isfinite(half) else "(no interval)"


def mean_of(estimates: Sequence[Estimate], letter: str) -> tuple[Array, Array]:
    """The mean of a letter over the recordings, where each has its own: weights of the estimates; its value and the
    ends of its interval, infinite without one. All are 0 for a letter that is known or not identifiable.
    """
    is_meant = [each.name.partition("@")[0] == letter and each.method != "not identifiable" for each in estimates]
    ends = np.array([(each.value, each.low, each.high) for each in estimates]).reshape(-1, 3)
    weights = np.array(is_meant, dtype=float) / max(sum(is_meant), 1)
    mean = weights @ np.where(np.isfinite(ends), ends, 0.0)
    if any(mine and not math.isfinite(each.high - each.low) for mine, each in zip(is_meant, estimates, strict=True)):
        mean[1:] = -math.inf, math.inf
    return weights, mean


def _together(per_trace: Sequence[float], traces: Sequence[Trace]) -> float:
    sizes = [trace.time.size for trace in traces]
    return math.sqrt(sum(rms**2 * size for rms, size in zip(per_trace, sizes, strict=True)) / max(sum(sizes), 1))


def _outlying(traces: Sequence[Trace], inliers: Sequence[NDArray[np.bool_]]) -> list[str]:
    """Outliers, which are left out of rms and tests."""
    words = "samples are outliers; rms and tests leave them out"
    left = [(trace.label, some.size - int(some.sum()), some.size) for trace, some in zip(traces, inliers, strict=True)]
    return [f"{label}: {off} of {size} {words}" for label, off, size in left if off]


def _jumping(problem: Problem) -> list[str]:
    """Jumps of the data, which no motion of the rig makes."""
    statements, (unit, factor) = list[str](), problem.units.shown("x1")
    for experiment in problem.experiments:
        for jump in rivals.jumps_of(experiment.time, experiment.measured)[:1]:
            span = f"{jump.before + experiment.begin:.4g} and {jump.after + experiment.begin:.4g} s"
            when = f"between {span} after the first sample"
            moves = f"moves {when} by {factor * abs(jump.size):.3g} {unit} more than before and after"
            turns = f"its velocity changes by {factor * abs(jump.speed):.3g} {unit}/s {when}"
            asked = "are samples lost there, is its time wrong" + (", or is it hit?" if jump.speed else "?")
            statements.append(f"{experiment.label}: {turns if jump.speed else moves}: {asked}")
    return statements


def _one_way(problem: Problem) -> list[str]:
    """What a drive that pushes one way cannot tell."""
    driven = [[u for _, u in each.steps] for each in problem.experiments if len(each.steps) > 1]
    if not driven or any(min(u) < 0.0 < max(u) for u in driven) or len({max(u) > 0.0 for u in driven}) > 1:
        return []
    letters = {letter for each in problem.experiments for letter in (*each.names, *each.constants)}
    name = "gamma2" if "gamma2" in letters else "force constant"
    return [
        f"the drive pushes only one way: friction that grows with the load cannot be distinguished from a smaller {name}"
    ]


def blind(spread: estimation.Spread) -> list[str]:
    """What recordings do not identify."""
    weak = [f"not identifiable from these recordings: {', '.join(spread.weak)}"] if spread.weak else []
    return weak + [f"only a combination of {', '.join(some)} is identifiable" for some in spread.combinations]


def boundary(estimates: Sequence[Estimate]) -> list[str]:
    """What intervals that end on one side say."""
    some = [each for each in estimates if each.method.endswith("at 0")]
    statements = [
        f"{each.name} may be 0: its 95 % upper limit is {each.high:.4g} {each.unit}".rstrip() for each in some
    ]
    for estimate in estimates:
        if estimate.method.endswith(" end"):
            end, way = (estimate.low, "above") if math.isfinite(estimate.low) else (estimate.high, "below")
            statements.append(
                f"{estimate.name} has a bound on one side alone: every value {way} {end:.4g} {estimate.unit} fits as well"
            )
    return statements


_MISSED, _NO_FIT = 0.1, 0.2
"""Residuals that are more than noise and than this share of a motion's standard deviation: nothing to make a robot of
(99 % of the variance explained), and no fit at all (96 %). A force, which is measured with more noise, may be off by
half."""
_NO_FORCE = 0.5


def _is_off(measured: Array, rms: float, share: float) -> bool:
    """Whether residuals are more than noise and than a share of a motion."""
    return rms > max(share * float(np.std(measured)), 1.5 * max(noise_of(measured), quantum_of(measured)))


def missed(trace: Trace) -> bool:
    """Whether a fit is too far off to make a robot of."""
    return trace.quantity in ("x1", "x2") and _is_off(trace.measured, trace.tests.rms, _MISSED)


def is_no_fit(trace: Trace) -> bool:
    """Whether a fit is none: it explains less than 96 % of a motion's variance, or less than 75 % of a force's."""
    if trace.quantity == "force":
        return is_no_force(trace.measured, trace.tests.rms)
    return trace.quantity in ("x1", "x2") and _is_off(trace.measured, trace.tests.rms, _NO_FIT)


def is_no_force(measured: Array, rms: float) -> bool:
    """Whether residuals are so much of a force that a fit is none."""
    return rms > _NO_FORCE * float(np.std(measured))


def coloured(traces: Sequence[Trace], explained: Sequence[bool]) -> list[str]:
    """Warnings about residuals: of a fit that fails, and of residuals that are not explained."""
    statements = [
        f"{trace.label}: the fit misses the recording by {100.0 * trace.tests.rms / np.std(trace.measured):.2g} % of "
        "its motion: it is of another rig, or the search did not converge; give more known parameters"
        for trace in traces
        if missed(trace)
    ]
    statements += [
        f"{trace.label}: not explained: the residuals are not white (autocorrelation "
        f"{trace.tests.autocorrelation:.2f}), so there is no interval"
        for trace, known in zip(traces, explained, strict=True)
        if not known
    ]
    return statements


def _correlations(estimates: Sequence[Estimate], spread: estimation.Spread) -> dict[tuple[str, str], float]:
    correlations = dict[tuple[str, str], float]()
    size = np.sqrt(np.diag(spread.covariance))
    for i, first in enumerate(estimates):
        for j in range(i):
            second = estimates[j]
            if not (first.own or second.own) and math.isfinite(size[i] * size[j]) and size[i] * size[j] > 0.0:
                correlations[second.name, first.name] = float(spread.covariance[i, j] / (size[i] * size[j]))
    return correlations


# ---- the recipe ----


def fit(given: Mapping[Kind, Recordings], known: Values | None = None, **options: Unpack[Options]) -> Fit:
    """The recipe. given: recordings, or their files, by their kind. Raises HopformError where one cannot be of its
    kind, MissingExtra without scipy.
    """
    asked = checked(options)
    return solved(problem_of(given, known, asked.loss), asked)


def solved(problem: Problem, asked: "Asked") -> Fit:
    """The fit of a problem."""
    began = clock.perf_counter()
    asked.stage("fit")
    problem, solution = _minimum(problem, asked.nuisances)
    tested = zip(problem.experiments, solution.tests, strict=True)
    usable = not any(_is_off(each.measured, test.rms, _NO_FIT) for each, test in tested)
    noise = current_noise.noise_in(solution)
    white = all(solution.explained) or (noise is not None and noise.explains)
    asked.stage("diagnoses")
    looks = (not white or causes.has_outliers(solution)) if asked.diagnose is None else asked.diagnose
    diagnoses = causes.diagnose(problem, solution) if looks else ()
    named = any(not each.possible for each in diagnoses)
    solution, estimates, spread = _intervals(problem, solution, explained=not named, stage=asked.stage)
    estimates, spread, allowed, refuted = _allowing(solution, estimates, spread)
    if noise is not None and white and not named and not refuted and (noise.explains or noise.recorded):
        estimates, spread = current_noise.intervals(solution, noise, estimates, spread)
        allowed.append(current_noise.SAID)
    if refuted and asked.diagnose is None and not diagnoses:
        diagnoses = causes.diagnose(problem, solution)
    asked.stage("the old model")
    old = _old(problem, solution) if asked.compare and usable and problem.coulomb else ()
    asked.stage("hold-out")
    left_out = _holdout(problem, solution) if asked.holdout and usable else [math.nan] * len(solution.sigma)
    alone, differing = repeats.repeats_of(problem, solution, estimates)
    if any(each.differ for each in alone):
        estimates = bare(estimates)
    traces = _traces(problem, solution, old, left_out)
    explained = [True] * len(traces) if noise is not None and noise.explains else solution.explained
    odd = [*_outlying(traces, solution.inliers), *_jumping(problem), *coloured(traces, explained)]
    return Fit(
        problem.kind, estimates, problem.known, _correlations(estimates, spread), traces,
        statements=(*problem.statements, *blind(spread), *boundary(estimates), *allowed, *_one_way(problem), *differing),
        warnings=(*problem.warnings, *odd, *refuted, *said(diagnoses, problem.units.shown("x1"))),
        evaluations=solution.evaluations, seconds=clock.perf_counter() - began, solution=solution, diagnoses=diagnoses,
        covariance=spread.covariance, repeats=tuple(alone), units=problem.units, scale=problem.scale,
        combinations=spread.combinations,
        origin=(f"hopform {__version__}", *problem.files),
    )  # fmt: skip


class Asked(NamedTuple):
    """The options of a fit, each with its value."""

    loss: str
    compare: bool
    holdout: bool
    diagnose: bool | None
    nuisances: tuple[str, ...]
    stage: Progress


def checked(options: Options) -> Asked:
    """The options; HopformError for one that is none, or for a value that it cannot have."""
    for name in options:
        word("an option of a fit", name, tuple(Options.__annotations__))
    compare, holdout = (flag(name, options.get(name, True)) for name in ("compare", "holdout"))
    further = flag("diagnose", options["diagnose"]) if "diagnose" in options else None
    function("progress", options.get("progress"))
    loss = word("loss", options.get("loss", "linear"), ("linear", "soft_l1", "huber", "cauchy"))
    chosen = tuple(dict.fromkeys(word("nuisances", each, nuisances.NUISANCES) for each in options.get("nuisances", ())))
    stage: Progress = options.get("progress") or (lambda _: None)
    return Asked(loss, compare, holdout, further, chosen, stage)


def _traces(problem: Problem, solution: Solution, old: Sequence[Array], holdout: Sequence[float]) -> tuple[Trace, ...]:
    tests, inliers = solution.tests, solution.inliers
    traces = list[Trace]()
    for n, (motion, residual) in enumerate(zip(problem.experiments, solution.residuals, strict=True)):
        x, quantity = motion.measured, motion.quantity
        worse = x + old[n] if old else None
        rms = estimation.tests_of(old[n][inliers[n]]).rms if old else math.nan
        traces.append(
            Trace(motion.label, quantity, motion.time + motion.begin, x, x + residual, worse, tests[n], rms, holdout[n])
        )
    return tuple(traces)


def _minimum(problem: Problem, freed: Sequence[str]) -> tuple[Problem, Solution]:
    """The minimum of a problem; delays and nuisances are fitted from where it is without them."""
    solution = minimise(problem)
    wider = nuisances.with_nuisances(problem, [*nuisances.DELAY, *freed])
    if len(wider.parameters) == len(problem.parameters):
        return problem, solution
    parameters = nuisances.begun(wider, solution, wider.experiments, *nuisances.extended(wider, solution)[1:])
    first = {p.name: p.start for p in parameters}
    wider = replace(wider, parameters=tuple(parameters), starts=(first, *wider.starts))
    near = settled(wider, solution, parameters)
    if is_noise(wider, near):
        return wider, near
    return wider, estimation.better(near, minimise(wider), wider.experiments)


_LOWERED = 3
"""Lower minima that profiles may meet before intervals are those of Student's t."""


def _intervals(
    problem: Problem, solution: Solution, *, explained: bool, stage: Progress
) -> tuple[Solution, tuple[Estimate, ...], estimation.Spread]:
    """The minimum with its intervals; a lower one where a profile meets it."""
    for _ in range(_LOWERED):
        try:
            return solution, *estimation.estimates(solution, explained=explained, progress=stage)
        except estimation.Lower as lower:
            start = [p._replace(start=lower.values[p.name]) for p in solution.parameters]
            solution = estimation.best([solution, settled(problem, solution, start)])
    return solution, *estimation.estimates(solution, explained=explained, profiles=False)


NONE = "not explained"
"""Of an estimate without an interval."""


def _allowing(
    solution: Solution, estimates: tuple[Estimate, ...], spread: estimation.Spread
) -> tuple[tuple[Estimate, ...], estimation.Spread, list[str], list[str]]:
    """The intervals of a minimum, if it has any, and what they allow for; none where the residuals show a cause, and
    a warning.
    """
    if all(each.own or not math.isfinite(each.high - each.low) for each in estimates):
        return estimates, spread, [], []
    missed = alternatives.missed(solution)
    if not any(each.refuted for each in missed):
        return *alternatives.allowing(solution, estimates, spread, missed), []
    why = "not explained: the residuals are white, but they contain more of the motion than noise would, so there is no interval"
    return bare(estimates), spread, [], [why]


def bare(estimates: Sequence[Estimate]) -> tuple[Estimate, ...]:
    """The estimates of recordings that the model does not explain: none has an interval."""
    return tuple(
        each if each.method == "not identifiable" else each._replace(low=-math.inf, high=math.inf, method=NONE)
        for each in estimates
    )


def _old(problem: Problem, solution: Solution) -> tuple[Array, ...]:
    """Residuals of the model without Coulomb friction, of each experiment.

    It starts from the new one's parameters, with more viscous friction in place of the other, and is followed over more
    and more of the recordings as that is. It is the least squares of the samples that are no outliers of the new one.
    """
    inliers, shares = solution.inliers, (1.0, 1.6, 3.0)
    viscous, at = [p for p in problem.parameters if p.name in problem.viscous], solution.values
    starts = tuple(at | {p.name: more * at[p.name] + 0.02 * (more - 1.0) * p.scale for p in viscous} for more in shares)
    whole, fixed = problem.experiments, dict.fromkeys(problem.coulomb, 0.0)
    some = selected(whole, inliers)
    viscous_solution = least_squares(replace(problem, experiments=some, starts=starts, parts=problem.parts[-2:]), fixed)
    return estimation.again(viscous_solution, whole, fixed=fixed, most=1).residuals


def _holdout(problem: Problem, solution: Solution) -> list[float]:
    """rms over the last third of each recording, without outliers, of a fit to the first two."""
    short = [each.only(slice(part_of(each, 2.0 / 3.0))) for each in problem.experiments]
    fitted = estimation.again(solution, short, most=20, precision=1e-6)
    errors = list[float]()
    for whole, part, some in zip(problem.experiments, short, solution.inliers, strict=True):
        last = np.flatnonzero(some[part.time.size :]) + part.time.size
        try:
            predicted, _ = whole.predict(fitted.values)
            rest = (predicted - whole.measured)[last]
            errors.append(estimation.rms(rest) if rest.size else math.nan)
        except NoMotion:
            errors.append(math.nan)
    return errors
