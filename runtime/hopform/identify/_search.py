"""The least sum of squares of a problem: from several starts, over more and more of the recordings, at last of all
samples.

Starts are compared on some samples of the beginnings, one after the other until one leaves nothing but noise: then
there is no better one. What leaves more is compared with the rest of them, and with starts from further away.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product

import numpy as np
from numpy.typing import NDArray

from hopform import HopformError
from hopform.identify import _estimation as estimation
from hopform.identify._estimation import Parameter, Solution
from hopform.identify._motion import Array, Values
from hopform.identify._recordings import HOPPER, Units, noise_of, outliers, quantum_of
from hopform.identify._rigs import Experiment, NoMotion


@dataclass(frozen=True)
class Problem:
    """A fit to be made: experiments, parameters with their starts, further starts, and what is known."""

    kind: str
    quantity: str
    experiments: tuple[Experiment, ...]
    parameters: tuple[Parameter, ...]
    starts: tuple[Values, ...]
    known: Values
    statements: tuple[str, ...]
    warnings: tuple[str, ...]
    parts: tuple[float, ...] = (1.0,)
    """of each recording, over which a fit is followed from its start to its end"""
    units: Units = HOPPER
    scale: bool = True
    """whether something known fixes the scale of all forces"""
    loss: str = "linear"
    files: tuple[str, ...] = ()
    """the recordings, each with the SHA-256 of its text"""
    given: Values = field(default_factory=dict[str, float])
    """parameters near which the search is asked to begin: a fit ends no worse than from there"""
    tied: Mapping[str, str] = field(default_factory=dict[str, str])
    """letters that are known to be as a parameter"""
    defaults: tuple[Parameter, ...] = ()
    """letters that are neither fitted nor given, as they would be fitted"""
    friction: Mapping[str, str] = field(default_factory=dict[str, str])
    """which kind of friction parameters are, viscous or coulomb"""

    @property
    def coulomb(self) -> list[str]:
        """Names of the parameters of Coulomb friction, which the old model lacks."""
        return self._of("coulomb")

    @property
    def viscous(self) -> list[str]:
        """Names of the parameters of viscous friction."""
        return self._of("viscous")

    def _of(self, kind: str) -> list[str]:
        return [p.name for p in self.parameters if self.friction.get(p.name.partition("@")[0]) == kind]


def minimise(problem: Problem) -> Solution:
    """The best minimum from all starts.

    A robust cost has false minima, in which part of the motion counts as outliers. A robust fit therefore starts from
    the least squares without outliers. If its residuals are more than noise, it also starts from everywhere else, and
    the lowest cost wins. Both costs are taken under the smaller standard deviation of the noise, since a false minimum
    has a larger one.
    """
    if problem.loss == "linear":
        return _moving(_from_given(problem, least_squares(problem)))
    first = _weighed(problem, _without_outliers(problem, least_squares), {})
    if is_noise(problem, first):
        return _from_given(problem, first)
    other = _searched(problem, {}, first.sigma)
    solution = _unstuck(problem, _traded(problem, estimation.better(first, other, problem.experiments)))
    return _moving(_from_given(problem, solution))


def _from_given(problem: Problem, solution: Solution) -> Solution:
    """The better of a minimum and of the one that the given start leads to by all samples: at first what was given is
    held.
    """
    held = {name: value for name, value in problem.given.items() if name in solution.values}
    if not held:
        return solution
    first = _from_start(solution.parameters, {**problem.starts[0], **held})
    rest = [p for p in first if p.name not in held]
    begun = estimation.again(solution, problem.experiments, rest, fixed=held, most=20, precision=1e-6).values
    other = settled(problem, solution, _from_start(solution.parameters, begun))
    return estimation.better(solution, other, problem.experiments)


def _moving(solution: Solution) -> Solution:
    """A solution that is a motion of each recording; HopformError if no start led to one."""
    for experiment in solution.experiments:
        try:
            experiment.predict(solution.values)
        except NoMotion as error:
            asked = "are units, signs and known values right"
            raise HopformError(f"{error}; the search finds no motion of this rig from any start: {asked}?") from None
    return solution


def least_squares(problem: Problem, fixed: Values | None = None) -> Solution:
    """The least sum of squares from all starts, where some parameters may be fixed."""
    linear, held = replace(problem, loss="linear"), dict(fixed or {})
    solution = _searched(linear, held)
    return solution if held else _unstuck(linear, _traded(linear, solution))


def _searched(problem: Problem, held: Values, sigma: Sequence[float] | None = None) -> Solution:
    """The best minimum from a problem's starts: first over the beginning of each recording, the best of these over more
    and more.

    Where it stays far from the data, by more than noise and a two thousandth of the motion, it looks again from further
    away.
    """
    solution = _from(problem, held, problem.starts, sigma)
    if not held and _level(problem, solution) > 1.0:
        solution = estimation.best(
            [solution, _from(problem, held, _further(problem.parameters, solution.values), sigma)]
        )
    solution = _weighed(problem, solution, held)
    impacts = any(each.kind in ("ground", "free") for each in problem.experiments)
    return _basin_hopping(problem, solution) if impacts and not held else solution


_ROUNDS, _THROWN, _APART = 4, 10, 0.2
"""Rounds of a search around a minimum; starts of a round, and how far apart they are, as a share."""
_FOLLOWED = 3
"""Starts about a minimum that are followed: those of least cost after some steps."""


def _lowest(problem: Problem, solution: Solution, starts: Sequence[Values]) -> Solution:
    """The lowest of a minimum and of those that starts about it lead to: over some of the samples first."""
    some, parameters = [_beginning(each, 1.0) for each in problem.experiments], estimation.started(solution)
    solve = partial(estimation.again, solution, some)
    here = solve(most=6, precision=1e-4)
    begun = sorted(
        (solve(_from_start(parameters, each), most=3, precision=1e-3) for each in starts), key=lambda one: one.cost
    )
    ends = [solve(estimation.started(each), most=10, precision=1e-3) for each in begun[:_FOLLOWED]]
    least = estimation.best([here, *ends])
    return solution if least.cost >= here.cost * (1.0 - 1e-4) else _better(problem, solution, estimation.started(least))


def _basin_hopping(problem: Problem, solution: Solution) -> Solution:
    """The lowest of the minima around one that leaves more than noise: from beside it over all of the recordings, again
    and again. The sum of squares of a motion with impacts and stops has many minima, close to each other.
    """
    for turn in range(_ROUNDS):
        if _level(problem, solution) <= 1.0:
            break
        solution = _lowest(problem, solution, _around(solution, turn))
    return solution


def _around(solution: Solution, turn: int) -> list[dict[str, float]]:
    """Starts around a minimum, drawn alike every time; where a motion begins is kept."""
    rng = np.random.default_rng([len(solution.parameters), turn])

    def drawn(p: Parameter) -> float:
        value, more = solution.values[p.name], 0.1 * _APART * p.scale * float(rng.random())
        bounded = p.kind in ("nonnegative", "fraction")  # which may be 0
        return value if p.own else value * math.exp(float(rng.uniform(-_APART, _APART))) + (more if bounded else 0.0)

    return [{p.name: drawn(p) for p in solution.parameters} for _ in range(_THROWN)]


def _without_outliers(problem: Problem, least: Callable[[Problem], Solution]) -> Solution:
    """The least squares of the samples that are no outliers, at first of their neighbours, then of the fit."""
    several, starts = problem.experiments, problem.starts

    def fit(masks: estimation.Masks) -> tuple[Solution, Sequence[Array]]:
        nonlocal starts
        solution = least(replace(problem, experiments=selected(several, masks), starts=starts, loss="linear"))
        starts = (solution.values, *problem.starts)
        return solution, estimation.again(solution, several, most=1).residuals

    return estimation.trimmed(fit, [~outliers(each.measured) for each in several])


def selected(several: Sequence[Experiment], masks: estimation.Masks) -> tuple[Experiment, ...]:
    """The samples that the masks select: x1 and x2 of one motion are solved together, so where both masks do."""

    def common(experiment: Experiment) -> NDArray[np.bool_]:
        masks_of_motion = [mask for other, mask in zip(several, masks, strict=True) if other.time is experiment.time]
        return np.asarray(np.logical_and.reduce(masks_of_motion))

    return tuple(each.only(common(each)) for each in several)


def _from_start(parameters: Sequence[Parameter], start: Values) -> list[Parameter]:
    return [p._replace(start=start.get(p.name, p.start)) for p in parameters]


_FINALISTS = 4
"""Starts that are followed over the first part of the recordings: those of least cost after one step."""
_CONTENDERS = 2
"""Of these, how many are followed over more and more of them: the sum of squares has kinks, and minima beside the
least.
"""


def _from(problem: Problem, held: Values, starts: Sequence[Values], sigma: Sequence[float] | None = None) -> Solution:
    first, *longer = ([_beginning(each, part) for each in problem.experiments] for part in problem.parts)
    solve = partial(estimation.solve, fixed=held, loss=problem.loss, sigma=sigma)
    tried = [_from_start([p for p in problem.parameters if p.name not in held], start) for start in starts]
    if len(tried) > _FINALISTS:
        order: list[int] = np.argsort([solve(first, each, most=1).cost for each in tried], kind="stable").tolist()
        tried = [tried[n] for n in order[:_FINALISTS]]

    def settled(part: Sequence[Experiment], start: Sequence[Parameter]) -> Solution:
        """Where a start comes to over a part; what comes near the noise is followed further."""
        one = solve(part, start, most=8, precision=1e-3)
        if held or not 1.0 < _level(problem, one) <= _NEAR:
            return one
        return solve(part, estimation.started(one), most=8, precision=1e-3)

    def followed(one: Solution) -> Solution:
        """Where it leads over more and more of the recordings."""
        for part in longer:
            one = settled(part, estimation.started(one))
        return one

    begun, ends = list[Solution](), list[Solution]()
    for start in tried:
        begun.append(settled(first, start))
        if not held and is_noise(problem, begun[-1]):
            ends.append(followed(begun.pop()))
            if not held and is_noise(problem, ends[-1]):
                break
    else:
        begun.sort(key=lambda each: each.cost)
        rest = [each for each in begun if each is begun[0] or each.cost > begun[0].cost * (1.0 + _SAME)]
        ends += [followed(each) for each in rest[: max(_CONTENDERS - len(ends), 1)]]
    return solve(longer[-1] if longer else first, estimation.started(estimation.best(ends)), most=25, precision=1e-5)


_NEAR = 3.0
"""A fit within so many times the noise has nearly converged."""


def is_noise(problem: Problem, solution: Solution) -> bool:
    """Whether a fit leaves nothing but noise of each recording."""
    return _level(problem, solution) <= 1.0 and all(each.white for each in solution.tests)


def _level(problem: Problem, solution: Solution) -> float:
    """Residual of the worst recording, over the share that noise and the smallest errors of a model explain."""
    return max(test.rms / _limit(each) for each, test in zip(problem.experiments, solution.tests, strict=True))


def _limit(experiment: Experiment) -> float:
    """Largest residual of a recording that counts as noise [m]: 1.15 times its noise, or a two thousandth of its
    motion."""
    noise = max(noise_of(experiment.measured), quantum_of(experiment.measured))
    return max(1.15 * noise, 5e-4 * float(np.ptp(experiment.measured)), 1e-15)


_SAME = 1e-3
"""Solutions whose costs differ by less, as a share, are one: that is how precisely a part is fitted."""


def _further(parameters: Sequence[Parameter], values: Values) -> list[dict[str, float]]:
    """Starts all around: what is shared by factors of up to 2, friction from none to much, drawn alike every time."""
    rng = np.random.default_rng(len(parameters))

    def drawn(p: Parameter) -> float:
        if p.own:
            return p.start
        if p.kind in ("nonnegative", "fraction"):
            return float(rng.uniform(0.0, 2.0)) * max(values[p.name], p.start, 0.1 * p.scale)
        return p.start * math.exp(float(rng.uniform(-0.7, 0.7)))

    return [{p.name: drawn(p) for p in parameters} for _ in range(12)]


def _weighed(problem: Problem, solution: Solution, fixed: Values) -> Solution:
    """Of all samples, each recording counted by its own noise, until that no longer changes what counts how much.

    A common factor of all noises moves no least squares; a robust loss takes the noise itself.
    """
    rounds, precision = (1, 1e-6) if fixed else (3, 1e-8)
    noise, loss = solution.sigma, problem.loss
    solve = partial(estimation.again, experiments=problem.experiments, fixed=fixed, loss=loss)
    if len(problem.experiments) > 1 or loss != "linear":
        noise = estimation.deviations(solve(solution, most=1))
    for _ in range(rounds):
        solution = solve(solution, sigma=noise, most=20, precision=precision)
        last, noise = noise, estimation.deviations(solution)
        changes = np.array(noise) / np.array(last)
        change = changes.max() / changes.min() if loss == "linear" else np.exp(np.abs(np.log(changes)).max())
        if float(change) < _STEADY:
            break
    return solution


_STEADY = 1.02
"""Noises that change by less, one against the other, are those that the residuals show: half of 2 % of a standard
error.
"""


_TRADES = ((0.6, 1.3), (1.3, 0.6), (0.0, 1.6))
_SMALL_TRADES = ((0.9, 0.9), (1.1, 1.1))
"""Viscous and Coulomb friction times so much; the small ones where residuals are no noise."""


def _traded(problem: Problem, solution: Solution) -> Solution:
    """The least of the minima between kinks: where a mass comes to stick the sum of squares has some.

    Friction of one kind is traded for the other, and the best is kept. Some of the samples show where that leads.
    A free motion sticks once, at its end, and its residuals are enough; a driven one sticks at every turn of its drive.
    """
    white = all(each.white for each in solution.tests)
    viscous, coulomb = problem.viscous, problem.coulomb
    if not coulomb or (white and not any(each.driven for each in problem.experiments)):
        return solution
    at, shares = solution.values, _TRADES if white else _TRADES + _SMALL_TRADES
    trades = [{n: b * at[n] for n in viscous} | {n: f * at[n] for n in coulomb} for b, f in shares]
    return _lowest(problem, solution, trades)


def _unstuck(problem: Problem, solution: Solution) -> Solution:
    """Out of a kink: where least squares ends though its own slopes predict a decrease, it goes on from beside it,
    either way.

    An actuator that may be at rest at first has a kink there: under friction it takes off one way, or the other, or
    stays.
    """
    for side in (1.0, -1.0):
        for p in [p for p in solution.parameters if p.name[:3] == "v1@" and p.low < p.high]:
            if estimation.expected_decrease(solution) >= _KINK:
                beside = {p.name: min(max(solution.values[p.name] + side * _ASIDE * p.scale, p.low), p.high)}
                solution = _better(problem, solution, _from_start(estimation.started(solution), beside))
    for name, side in product(problem.coulomb[:1], (1.0, -1.0)):
        if estimation.expected_decrease(solution) >= _KINK:
            solution = _better(problem, solution, estimation.moved(solution, name, side))
    return solution


_ASIDE = 0.01
"""Of its scale, by how much an actuator's first velocity is moved out of its kink at rest."""
_KINK = 0.05
"""Variances by which the slopes at a minimum may still predict a decrease."""


def settled(problem: Problem, solution: Solution, start: Sequence[Parameter]) -> Solution:
    """The fit from a start near its end by all samples, under the noise of another fit."""
    return _weighed(problem, estimation.again(solution, problem.experiments, start, most=20, precision=1e-6), {})


def _better(problem: Problem, solution: Solution, start: Sequence[Parameter]) -> Solution:
    """The fit from a start by all samples, if its cost is lower."""
    again = estimation.again(solution, problem.experiments, start, most=8, precision=1e-4)
    return _weighed(problem, again, {}) if again.cost < solution.cost * (1.0 - 1e-5) else solution


_ENOUGH = 400
"""Samples of a recording on which starts are compared; the last fit takes all of them."""


def _beginning(experiment: Experiment, part: float) -> Experiment:
    """A part of a recording, from its beginning on, at a rate that is enough to find the way."""
    return experiment.only(slice(0, part_of(experiment, part), max(experiment.time.size // _ENOUGH, 1)))


def part_of(experiment: Experiment, part: float) -> int:
    """Number of samples of a part of a recording: a share of its samples, and of the way that it covers, stillness at
    first left out.
    """
    size = experiment.time.size
    places = np.unique(np.linspace(0, size - 1, 200).astype(int))
    way = np.cumsum(np.abs(np.diff(experiment.measured[places], prepend=experiment.measured[0])))
    covered = int(places[np.count_nonzero(way < part * way[-1])]) if part < 1.0 else size
    return max(int(part * size), covered, min(20, size))
