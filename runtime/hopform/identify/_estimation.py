"""Least squares on exact residuals with exact derivatives, and how well the data identify each parameter.

    minimise sum_i ((predicted_i(p) - measured_i)/sigma_i)^2

Masses, stiffness and the like, which are positive, are fitted as their logarithms; friction is bounded by 0. Covariance
from the Jacobian at the solution; intervals by profile likelihood, because a sum of squares has kinks where a mass comes
to stick, and friction ends at 0: all other parameters are fitted again at each trial value, and the interval ends where
the sum of squares has grown by the factor 1 + t^2/(n - p). Where a motion begins has the interval of Student's t.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from hopform.identify._motion import Array, Values, of_scipy
from hopform.identify._recordings import outliers, quantum_of
from hopform.identify._rigs import Experiment, NoMotion

Masks = Sequence[NDArray[np.bool_]]
Fitted = TypeVar("Fitted")

LEVEL = 0.95
_WEAK = 1e-7
"""Below this share of the largest singular value of the scaled Jacobian a direction is one that the data do not see."""


_NOT_IDENTIFIABLE = 0.5
"""Share of its own value: a mass or a stiffness with so large a standard error is not identifiable. A spring that is
absent has one.
"""


class Parameter(NamedTuple):
    """A fitted parameter: its unit, start, the size of a significant change, and kind."""

    name: str
    unit: str
    start: float
    scale: float
    kind: str = "real"
    """real, positive (fitted as a logarithm), nonnegative, fraction (0 .. 1)"""
    profiled: bool = False
    own: bool = False
    """belongs to one recording: where and how fast it starts"""
    low: float = -math.inf
    high: float = math.inf
    """of a real one: where it must be"""

    @property
    def limits(self) -> tuple[float, float]:
        """Between which values it lies, if it is not positive."""
        return _LIMITS.get(self.kind, (self.low, self.high))


_LIMITS = {"nonnegative": (0.0, math.inf), "fraction": (0.0, 0.999)}


Experiments = Sequence[Experiment]
Parameters = Sequence[Parameter]


class Estimate(NamedTuple):
    """A parameter as the data have it."""

    name: str
    unit: str
    value: float
    stderr: float
    low: float
    high: float
    method: str
    """how the interval was found: "t", "profile", "profile, one-sided at 0", "profile, no upper end", "profile, no lower
    end", "t, one-sided at 0"; why there is none: "not identifiable", "not explained", "too few samples" """
    own: bool = False


@dataclass(frozen=True)
class Solution:
    """A minimum: values of all parameters, residuals per experiment [m], the scaled Jacobian's decomposition."""

    parameters: tuple[Parameter, ...]
    values: dict[str, float]
    residuals: tuple[Array, ...]
    sigma: tuple[float, ...]
    jacobian: Array
    cost: float
    evaluations: int
    loss: str = "linear"
    experiments: Experiments = ()

    @property
    def count(self) -> int:
        return sum(each.size for each in self.residuals)

    @property
    def freedom(self) -> int:
        return max(self.count - len(self.parameters), 1)

    @property
    def noise(self) -> Array:
        """Standard deviation of each sample."""
        return np.repeat(self.sigma, [part.size for part in self.residuals])

    @property
    def scaled(self) -> Array:
        """The Jacobian by the coordinates of the optimiser, residuals in standard deviations."""
        return self.jacobian * _Coordinates(self.parameters).slopes(self.values) / self.noise[:, np.newaxis]

    @property
    def inliers(self) -> Masks:
        """Which samples of each recording are no outliers."""
        return [bulk(part, self.loss) for part in self.residuals]

    @property
    def tests(self) -> "list[Tests]":
        """Of each recording's residuals without outliers."""
        return [tests_of(part[some]) for part, some in zip(self.residuals, self.inliers, strict=True)]

    @property
    def explained(self) -> list[bool]:
        """Of which recordings the residuals are noise: white, or the rounding of the encoder. Where they leave too few
        independent samples they are its rounding only if that of the predicted motion has as long a memory.
        """
        several = zip(self.experiments, self.tests, self.residuals, strict=True)
        few = self.effective < FEWEST * len(self.parameters) <= self.count
        return [
            test.white or (test.rms <= _ROUNDING * quantum_of(each.measured)
                           and not (few and test.inflation > _LONGER * _rounded(each.measured, part).inflation))
            for each, test, part in several
        ]  # fmt: skip

    @property
    def effective(self) -> float:
        """As many independent samples say as much."""
        pairs = zip(self.residuals, self.tests, strict=True)
        return sum(part.size / test.inflation for part, test in pairs)


def is_rounding(measured: Array, residual: Array) -> bool:
    """Whether residuals are no more than an encoder's rounding of the predicted motion, and as short in memory."""
    quantum, test = quantum_of(measured), tests_of(residual)
    if quantum == 0.0 or test.rms > _ROUNDING * quantum:
        return False
    alone = _rounded(measured, residual)
    return test.rms <= _ALONE * alone.rms and test.inflation <= _LONGER * alone.inflation


_ALONE = 1.1
"""Times the rms of rounding alone up to which residuals are nothing else."""


def _rounded(measured: Array, residual: Array) -> "Tests":
    """Tests of what an encoder's rounding alone would leave of a predicted motion."""
    quantum, predicted = quantum_of(measured), measured + residual
    return tests_of(predicted - quantum * np.round(predicted / quantum))


_LONGER = 2.0
"""Times the memory of rounding from which residuals are more than that."""
_ROUNDING = 0.5
"""Quanta that the rms of residuals is at most if they are an encoder's rounding: alone it has 0.29."""


def student(level: float, freedom: float) -> float:
    """The quantile of Student's t."""
    return float(of_scipy("special").stdtrit(freedom, level))


_FAR = 14.0
"""Largest change of a logarithm: a factor of a million, beyond which no leg is."""


def _ends(p: Parameter) -> tuple[float, float]:
    """Between which numbers the coordinate of a parameter lies."""
    if p.kind == "positive":
        middle = math.log(p.scale)
        return middle - _FAR, middle + _FAR
    low, high = p.limits
    return low / p.scale, high / p.scale


class _Coordinates:
    """Between parameters and the numbers that the optimiser moves."""

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self.low, self.high = np.array([_ends(p) for p in parameters]).reshape(-1, 2).T

    def into(self, values: Values) -> Array:
        at = [(values[p.name], p) for p in self.parameters]
        z = np.array([math.log(max(x, 1e-9 * p.scale)) if p.kind == "positive" else x / p.scale for x, p in at])
        inside = 1e-10
        return np.asarray(np.minimum(np.maximum(z, self.low + inside), self.high - inside))

    def out(self, z: Array) -> dict[str, float]:
        pairs = zip(self.parameters, z.tolist(), strict=True)
        return {p.name: math.exp(min(x, 300.0)) if p.kind == "positive" else x * p.scale for p, x in pairs}

    def slopes(self, values: Values) -> Array:
        """d parameter / d coordinate."""
        return np.array([values[p.name] if p.kind == "positive" else p.scale for p in self.parameters])


class Place:
    """A parameter at a minimum: between its values and distances from there in the coordinate of the optimiser."""

    def __init__(self, solution: "Solution", number: int) -> None:
        self.of = solution.parameters[number]
        self.value = solution.values[self.of.name]

    def into(self, value: float) -> float:
        """How far a value is off."""
        if self.of.kind == "positive":
            return math.log(max(value / self.value, 1e-300))
        return (value - self.value) / self.of.scale

    def by(self, change: float) -> float:
        """A small change."""
        return change / (self.value if self.of.kind == "positive" else self.of.scale)

    def out(self, distance: float) -> float:
        """The value so far off."""
        if self.of.kind == "positive":
            return self.value * math.exp(min(distance, 300.0))
        low, high = _LIMITS.get(self.of.kind, (-math.inf, math.inf))
        return min(max(self.value + distance * self.of.scale, low), high)


def slopes(solution: "Solution") -> Array:
    """Of each parameter d parameter / d coordinate at a minimum."""
    return _Coordinates(solution.parameters).slopes(solution.values)


Progress = Callable[[str], None]


def solve(
    experiments: Experiments,
    parameters: Parameters,
    *,
    sigma: Sequence[float] | None = None,
    fixed: Values | None = None,
    loss: str = "linear",
    most: int = 60,
    precision: float = 1e-9,
) -> Solution:
    """The least squares from where the parameters start; experiments count by their sigma [m], all alike if not
    given.
    """
    optimize = of_scipy("optimize")
    held = dict(fixed or {})
    weights = tuple(sigma or [1e-4] * len(experiments))
    coordinates = _Coordinates(parameters)
    per_sample = np.repeat(weights, [each.time.size for each in experiments])

    @lru_cache(maxsize=3)
    def at(place: bytes) -> tuple[Array, Array, list[Array], Array]:
        """Residuals and Jacobian as the optimiser sees them, which asks for one after the other and goes back after a
        step too far; residuals [m] per experiment, and their derivatives by the parameters.
        """
        values = coordinates.out(np.frombuffer(place))
        parts, rows = residuals(experiments, parameters, values | held)
        scaled = rows * coordinates.slopes(values) / per_sample[:, np.newaxis]
        return *_condensed(np.concatenate(parts) / per_sample, scaled, loss), parts, rows

    def part(number: int) -> Callable[[Array], object]:
        return lambda z: at(z.tobytes())[number]

    start = coordinates.into({p.name: p.start for p in parameters})
    if parameters:
        ends = {"ftol": precision, "xtol": precision, "gtol": 1e-12, "max_nfev": most}
        how = {"bounds": (coordinates.low, coordinates.high), **ends}
        start = optimize.least_squares(part(0), start, part(1), **how).x
    seen, _, parts, rows = at(start.tobytes())
    least = tuple(parts), weights, rows, float(seen @ seen)
    return Solution(tuple(parameters), coordinates.out(start) | held, *least, at.cache_info().misses, loss, experiments)


BEND = 2.0
"""Standard deviations at which a robust loss bends."""
_ROBUST: Mapping[str, Callable[[Array], tuple[Array, Array, Array]]] = {
    "soft_l1": lambda z: (2.0 * z / (np.sqrt(1.0 + z) + 1.0), (1.0 + z) ** -0.5, -0.5 * (1.0 + z) ** -1.5),
    "huber": lambda z: (
        np.where(z <= 1.0, z, 2.0 * np.sqrt(z) - 1.0), np.maximum(z, 1.0) ** -0.5,
        np.where(z <= 1.0, 0.0, -0.5 * np.maximum(z, 1.0) ** -1.5),
    ),
    "cauchy": lambda z: (np.log1p(z), 1.0 / (1.0 + z), -1.0 / (1.0 + z) ** 2),
}  # fmt: skip
"""rho(z), rho'(z) and rho''(z) of each robust loss BEND^2 rho(z), z = (residual/BEND)^2."""


def _condensed(residual: Array, jacobian: Array, loss: str) -> tuple[Array, Array]:
    """(f, J) as (Q^T f and what is left of |f|, R), J = Q R: the same gradient, steps and cost in p + 1 rows, not
    thousands.

    The cost of a robust loss is a sum of squares too, that of sign(f) sqrt(rho(f^2)).
    """
    if loss != "linear":
        cost, slope, _ = _ROBUST[loss]((residual / BEND) ** 2)
        root = BEND * np.sqrt(cost)
        share = np.divide(slope * np.abs(residual), root, out=np.ones_like(root), where=root > 0.0)
        residual, jacobian = np.copysign(root, residual), jacobian * share[:, np.newaxis]
    if jacobian.shape[1] == 0:
        return residual, jacobian
    r = triangle(np.column_stack([jacobian, residual]))
    return r[:, -1], r[:, :-1]


def triangle(matrix: Array) -> Array:
    """R of a tall matrix' QR, block by block: blocks so small that no library of linear algebra starts threads for
    them.
    """
    factor = np.empty((0, matrix.shape[1]))
    for begin in range(0, matrix.shape[0], 256):
        factor = np.asarray(np.linalg.qr(np.vstack([factor, matrix[begin : begin + 256]]), mode="r"))
    return factor


def residuals(experiments: Experiments, parameters: Parameters, values: Values) -> tuple[list[Array], Array]:
    """Predicted less measured [m] per experiment, and the derivatives of all of them by the parameters."""
    parts, rows = list[Array](), list[Array]()
    for experiment in experiments:
        try:
            predicted, by = experiment.predict(values)
        except NoMotion:  # no motion of these parameters: far from every measurement, so the step is refused
            predicted, by = np.full_like(experiment.measured, 1e3), {}
        parts.append(predicted - experiment.measured)
        zero = np.zeros(experiment.time.size)
        columns = [by.get(p.name, zero) for p in parameters]
        rows.append(np.stack(columns, axis=1) if columns else np.empty((zero.size, 0)))
    return parts, np.concatenate(rows)


def best(solutions: Sequence[Solution]) -> Solution:
    return min(solutions, key=lambda each: each.cost)


def again(solution: Solution, experiments: Experiments, start: Parameters | None = None, **how: Any) -> Solution:
    """The least squares of experiments from a start, or from where a solution came to, under its noise and loss."""
    how = {"sigma": solution.sigma, "loss": solution.loss} | how
    return solve(experiments, started(solution) if start is None else start, **how)


def better(first: Solution, other: Solution, experiments: Experiments) -> Solution:
    """The one whose parameters cost less under the smaller standard deviations of the noise."""
    noise = [min(pair) for pair in zip(first.sigma, other.sigma, strict=True)]
    return min(first, other, key=lambda each: again(each, experiments, sigma=noise, most=1).cost)


def deviations(solution: Solution) -> tuple[float, ...]:
    """Standard deviation of each recording's residuals, each counted for its share of the parameters.

    Under a robust loss that of the bulk, by the median, which outliers do not move.
    """
    share = solution.freedom / solution.count

    def size(part: Array) -> float:
        return math.sqrt(max(float((part**2).mean()) if solution.loss == "linear" else scale(part) ** 2, 1e-24) / share)

    return tuple(size(part) for part in solution.residuals)


def influence(solution: Solution) -> tuple[Array, float, float]:
    """The influence of each sample on a minimum, residuals in standard deviations: psi, the derivative of half its cost
    by its residual; the mean of psi'; the variance unit of the cost.

    The covariance of an M-estimate is (J^T J)^-1 mean(psi^2)/mean(psi')^2 (Huber 1981, 7.6). One standard error off the
    minimum, its cost is mean(psi^2)/mean(psi') higher: the unit. Least squares have psi' = 1 and the variance of the
    residuals for both.
    """
    psi = np.concatenate(solution.residuals) / solution.noise
    slope = 1.0
    if solution.loss != "linear":
        z = (psi / BEND) ** 2
        _, first, second = _ROBUST[solution.loss](z)
        psi, slope = psi * first, max(float((first + 2.0 * z * second).mean()), 0.1)
    return psi, slope, float(psi @ psi) / solution.freedom / slope


def bulk(residual: Array, loss: str) -> NDArray[np.bool_]:
    """Which residuals are none of single samples far off their neighbours; all, unless a robust loss was asked for."""
    return np.full(residual.size, True) if loss == "linear" else ~outliers(residual)


def scale(residual: Array) -> float:
    """Standard deviation of the bulk of residuals around 0, by their median absolute deviation, which outliers do not
    move.
    """
    return 1.4826 * float(np.median(np.abs(residual)))


def rms(residual: Array) -> float:
    """Root of the mean square, 0 of none."""
    return math.sqrt(float((residual**2).mean())) if residual.size else 0.0


_HAMPEL = 3.0
"""Standard deviations beyond which the Hampel identifier takes a residual for an outlier."""
_REFITS, _FEW = 3, 0.01
"""Most refits without outliers, and the share of samples whose classification may change without another one: 0.3 % of
Gaussian noise is beyond 3 standard deviations."""


def regular(residual: Array) -> NDArray[np.bool_]:
    """Which residuals are no outliers by the Hampel identifier: median and median absolute deviation."""
    centred = residual - np.median(residual)
    return np.asarray(np.abs(centred) <= _HAMPEL * scale(centred))


def trimmed(fit: Callable[[Masks], tuple[Fitted, Sequence[Array]]], masks: Masks) -> Fitted:
    """A fit without outliers: fit the samples that the masks select, identify the outliers of all, fit again.

    fit: returns its answer and the residuals of all samples, an array per mask.
    """
    solution, residuals = fit(masks)
    for _ in range(_REFITS):
        last, masks = masks, [regular(each) for each in residuals]
        if all(float((one != other).mean()) <= _FEW for one, other in zip(last, masks, strict=True)):
            break
        solution, residuals = fit(masks)
    return solution


class Spread(NamedTuple):
    """The Jacobian's covariance, by how much what residuals have in common inflates each variance, the parameters that
    the data do not identify, and their combinations.
    """

    covariance: Array
    inflation: Array
    weak: tuple[str, ...]
    combinations: tuple[tuple[str, ...], ...]


def spread(solution: Solution) -> Spread:
    """The covariance of the parameters under the noise that the residuals show; infinite where the data do not identify
    one.

    Each recording counts by its own inflation: (J^T J)^-1 J^T D J (J^T J)^-1, D its inflation for each sample.
    """
    scales = _Coordinates(solution.parameters).slopes(solution.values)
    scaled = solution.scaled
    norms = np.sqrt((scaled**2).sum(axis=0))
    alive = norms > 1e-9 * norms.max(initial=0.0)
    _, singular, directions = np.linalg.svd(triangle(scaled[:, alive] / norms[alive]))
    unseen = singular <= _WEAK * singular[0] if singular.size else np.zeros(0, bool)
    names = np.array([p.name for p in solution.parameters])
    part = directions[~unseen].T / singular[~unseen]
    covariance, inflation = np.full((names.size, names.size), 0.0), np.ones(names.size)
    inverse = plain = part @ part.T
    inflations = [each.inflation for each in solution.tests]
    if max(inflations) > 1.0:
        factors = np.sqrt(np.repeat(inflations, [each.size for each in solution.residuals]))[:, np.newaxis]
        middle = triangle(scaled[:, alive] / norms[alive] * factors)
        inverse = inverse @ (middle.T @ middle) @ inverse
        inflation[alive] = np.diag(inverse) / np.maximum(np.diag(plain), 1e-300)
    inside = inverse / np.outer(norms[alive], norms[alive]) * np.outer(scales[alive], scales[alive])
    _, slope, unit = influence(solution)
    covariance[np.ix_(alive, alive)] = inside * unit / slope
    blind = np.abs(directions[unseen]) > 1e-3
    weak = set(names[~alive]) | {name for row in blind for name in names[alive][row]}
    errors = zip(solution.parameters, np.sqrt(np.diag(covariance)).tolist(), strict=True)
    weak |= {p.name for p, e in errors if p.kind == "positive" and e > _NOT_IDENTIFIABLE * solution.values[p.name]}
    together = tuple(dict.fromkeys(tuple(names[alive][row].tolist()) for row in blind))
    covariance[np.diag_indices(names.size)] = np.where([name in weak for name in names], np.inf, np.diag(covariance))
    return Spread(covariance, inflation, tuple(name for name in names if name in weak), together)


def estimates(
    solution: Solution, *, explained: bool = True, profiles: bool = True, progress: Progress | None = None
) -> tuple[tuple[Estimate, ...], Spread]:
    """Each parameter with its 95 % interval: by profile likelihood, that of where a recording begins, and without
    `profiles` all, by Student's t. No interval where the residuals are not noise, or say less than ten samples a
    parameter. explained: whether no cause is known that the fit lacks.

    Raises `Lower` if a profile meets a lower minimum.
    """
    seen = spread(solution)
    none = _without(solution, explained)
    t = student(0.5 + 0.5 * LEVEL, solution.freedom)
    rows, met = list[Estimate](), list[Solution]()
    for index, parameter in enumerate(solution.parameters):
        value = solution.values[parameter.name]
        stderr = math.sqrt(seen.covariance[index, index])
        low, high, method = value - t * stderr, value + t * stderr, "t"
        if parameter.name in seen.weak:
            stderr, low, high, method = math.inf, -math.inf, math.inf, "not identifiable"
        elif none:
            low, high, method = -math.inf, math.inf, none
        elif profiles and parameter.profiled and stderr > 0.0:
            if progress:
                progress(f"interval of {parameter.name}")
            profile = _Profile(solution, parameter, stderr, float(seen.inflation[index]), met)
            low, high, method = profile.interval()
        elif parameter.kind == "positive":
            factor = math.exp(min(t * stderr / value, 300.0))
            low, high = value / factor, value * factor
        elif parameter.kind in ("nonnegative", "fraction"):
            low = max(low, 0.0)
        rows.append(Estimate(parameter.name, parameter.unit, value, stderr, low, high, method, parameter.own))
    return tuple(_containing(row, met) if row.method.startswith("profile") else row for row in rows), seen


def _containing(estimate: Estimate, met: Sequence[Solution]) -> Estimate:
    """An estimate whose interval contains what profiles of other parameters met that fits as well."""
    values = [each.values[estimate.name] for each in met]
    return estimate._replace(low=min(estimate.low, *values), high=max(estimate.high, *values)) if values else estimate


FEWEST = 10.0
"""Effective samples of a parameter without which there is no interval."""


def _without(solution: Solution, explained: bool) -> str:
    """Why a solution has no intervals; empty if it has."""
    if not explained or not all(solution.explained):
        return "not explained"
    return "too few samples" if solution.effective < FEWEST * len(solution.parameters) else ""


class Lower(Exception):
    """A minimum that is lower than that around which a profile was taken."""

    def __init__(self, values: Values) -> None:
        super().__init__()
        self.values = values


class _Profile:
    """Where the sum of squares, all else fitted again, has grown by the quantile, on both sides of an estimate.

    Where a motion hardly turns, other minima may fit as well beyond a kink: a mass that moves one way alone shows its
    friction, its load and its force constant as one. There each end is asked again from far off (`_BEYOND`); where a
    minimum there fits as well, the end is looked for beyond it, from both sides. It fits as well up to the quantile of
    chi^2 for all parameters: a mass that is held at first has fewer that matter than one that slides within the noise.
    `met` takes what fits as well.
    """

    def __init__(
        self, solution: Solution, parameter: Parameter, stderr: float, inflation: float, met: list[Solution]
    ) -> None:
        self.solution, self.parameter, self.stderr, self.met = solution, parameter, stderr, met
        self.value = solution.values[parameter.name]
        self.two, self.one = (student(level, solution.freedom) ** 2 for level in (0.5 + 0.5 * LEVEL, LEVEL))
        self.ways = [(math.sqrt(inflation), 6), (0.0, 20)]
        self.unit = influence(solution)[2] * inflation
        self.several = turns(solution) <= _FEW_TURNS
        self.wide = float(of_scipy("special").chdtri(len(solution.parameters), 1.0 - LEVEL))

    def interval(self) -> tuple[float, float, str]:
        """Both ends, and what they are."""
        value, stderr, kind = self.value, self.stderr, self.parameter.kind
        if kind not in ("nonnegative", "fraction"):
            least = 1e-9 * value if kind == "positive" else -math.inf
            low, high = (self.end(side, self.two, least) for side in (-1.0, 1.0))
            return low, high, _closed(low, high)
        upper = self.end(1.0, self.two, -math.inf)
        if value <= _DISTANT * stderr and (value <= 1e-6 * stderr or self.growth(0.0) <= self.two):
            upper = self.end(1.0, self.one, -math.inf) if math.isfinite(upper) else upper
            return 0.0, upper, "profile, one-sided at 0" if math.isfinite(upper) else "not identifiable"
        low = self.end(-1.0, self.two, 0.0)
        return low, upper, _closed(low, upper)

    def held(self, trial: float, start: Parameters, most: int) -> Solution:
        """All else fitted from a start, the parameter held at a value."""
        fixed, rest = {self.parameter.name: trial}, [p for p in start if p.name != self.parameter.name]
        fitted = again(self.solution, self.solution.experiments, rest, fixed=fixed, most=most, precision=1e-4)
        grown = self.grown(fitted)
        if grown < -_LOWER:
            raise Lower(fitted.values)
        if self.several and grown <= self.one:
            self.met.append(fitted)
        return fitted

    def from_both(self, trial: float, first: Solution, other: Solution) -> Solution:
        """The lower of the fits from where two others came to."""
        starts = (first,) if other is first else (first, other)
        return best([self.held(trial, started(each), 20) for each in starts])

    def grown(self, fitted: Solution) -> float:
        """How much the sum of squares is larger, in variances."""
        return (fitted.cost - self.solution.cost) / self.unit

    def growth(self, trial: float) -> float:
        """How much the sum of squares grows if the parameter is held at a value.

        The others start from where the covariance takes them; if that leads nowhere, from where they are, the next time
        at once.
        """
        errors, tried = (trial - self.value) / self.stderr, list[float]()
        for tilt, most in tuple(self.ways):
            start = moved(self.solution, self.parameter.name, tilt * errors)
            tried.append(self.grown(self.held(trial, start, most)))
            if tried[-1] <= (4.0 * errors**2 + 1.0 if abs(errors) <= _FAR_OFF else self.two):
                break
        if len(tried) == 2 and tried[1] < tried[0]:
            self.ways.reverse()
        return min(tried)

    def end(self, side: float, level: float, least: float) -> float:
        """The end of the interval on a side; least: no value is less."""
        end = _cross(self.growth, self.value, side * self.stderr, level, least)
        if not self.several or not math.isfinite(end) or end in (least, self.value):
            return end
        last, far = self.solution, list[tuple[Solution, float]]()
        for times in _BEYOND:
            trial = max(self.value + times * (end - self.value), least)
            last = self.from_both(trial, self.solution, last)
            # about one minimum the sum grows by this much
            alone = level * ((trial - self.value) / (end - self.value)) ** 2
            limit = self.wide if self.grown(last) > level and alone > 2.0 * self.wide else level
            far += [(last, limit)] if self.grown(last) <= limit else []
        return self.outer(*far[-1], least) if far else end

    def outer(self, inner: Solution, level: float, least: float) -> float:
        """The end beyond a minimum that fits as well: twice as far until one does not, then halfway from both."""
        name = self.parameter.name
        for _ in range(_DOUBLED):
            trial = max(2.0 * inner.values[name] - self.value, least)
            beyond = self.from_both(trial, inner, self.solution)
            if self.grown(beyond) > level:
                break
            if trial == least:
                return least
            inner = beyond
        else:
            return least if inner.values[name] < self.value else math.inf
        for _ in range(_HALVED):
            lower = self.from_both(0.5 * (inner.values[name] + beyond.values[name]), inner, beyond)
            inner, beyond = (inner, lower) if self.grown(lower) > level else (lower, beyond)
        return beyond.values[name]


_FEW_TURNS = 2
"""Turns of all motions together up to which further minima are looked for: random recordings with more had none."""
_BEYOND = (4.0, 8.0, 16.0)
"""Times as far from the estimate as an end of its interval, where a further minimum is looked for. Around one minimum the
sum of squares has grown by 60 variances at the first.
"""
_DOUBLED, _HALVED = 5, 4
"""Times that a distance is doubled until it is no end, and times that the last step is halved."""
_MOVES = 1e-9
"""Share of a motion between two samples that is none: a mass is held."""


def turns(solution: Solution) -> int:
    """How often the predicted motions of all recordings turn back."""
    count = 0
    for experiment, rest in zip(solution.experiments, solution.residuals, strict=True):
        steps = np.diff(experiment.measured + rest)
        way = np.signbit(steps[np.abs(steps) > _MOVES * float(np.ptp(experiment.measured))])
        count += int(np.count_nonzero(way[1:] != way[:-1]))
    return count


def _closed(low: float, high: float) -> str:
    """What a profile with these ends is called."""
    if math.isfinite(low) and math.isfinite(high):
        return "profile"
    if not (math.isfinite(low) or math.isfinite(high)):
        return "not identifiable"
    return f"profile, no {'upper' if math.isfinite(low) else 'lower'} end"


_FAR_OFF = 4.0
"""Standard errors from where a profile that the covariance misjudges is asked from both starts before it closes."""
_OPEN = 30.0
"""Standard errors off which a growth that is still below what is wanted does not close; trials go up to a thousand."""
_LOWER = 0.1
"""Variances by which a minimum that a profile meets must be lower: less is how precisely minima are found."""
_DISTANT = 20.0
"""Standard errors from 0, from where nobody has to ask whether it may be 0."""


def clip(parameter: Parameter, value: float) -> float:
    low, high = (0.1 * parameter.start, math.inf) if parameter.kind == "positive" else parameter.limits
    return min(max(value, low), high)


def _cross(growth: Callable[[float], float], value: float, step: float, level: float, end: float) -> float:
    """Where the growth, about (x - value)^2/step^2, reaches what is wanted; its root is nearly straight, so secants do
    it. end: x is no less, 0 or -inf; where a step says nothing, the interval goes on to there, or to infinity, and so
    does one whose growth stays below what is wanted: any value beyond fits as well.
    """
    if not math.isfinite(step) or step == 0.0:
        return abs(end)
    root, target, closed = 0.0, math.sqrt(level), False
    near, x = value, max(value + target * step, end)
    for _ in range(6):
        height = math.sqrt(max(growth(x), 0.0))
        if abs(height - target) <= 0.02 * target:
            break
        slope = (height - root) / (x - near) if x != near else 0.0
        moved = math.copysign(math.inf, step) if slope * step <= 0.0 else x + (target - height) / slope
        moved = value + min(max((moved - value) / step, 0.25 * (x - value) / step), 4.0 * (x - value) / step) * step
        near, root, closed = x, height, closed or height > target
        x = max(moved, end)
    else:
        if not closed and abs(near - value) >= _OPEN * abs(step):
            return math.inf if step > 0.0 else end
    return x


def started(solution: Solution) -> list[Parameter]:
    """The parameters, to start again from where they came to."""
    return [p._replace(start=solution.values[p.name]) for p in solution.parameters]


def moved(solution: Solution, name: str, errors: float) -> list[Parameter]:
    """The parameters with one off by so many standard errors, and the others where the covariance takes them."""
    seen = spread(solution).covariance
    column = [p.name for p in solution.parameters].index(name)
    rows, size = seen[:, column], math.sqrt(seen[column, column])
    if not 0.0 < size < math.inf:
        return started(solution)
    pairs = zip(started(solution), rows, strict=True)
    return [p._replace(start=clip(p, p.start + errors * float(row) / size)) for p, row in pairs]


def expected_decrease(solution: Solution) -> float:
    """By how many variances a step along the slopes would lower the sum of squares: about 0 at a minimum, not in a
    kink.
    """
    if not solution.parameters:
        return 0.0
    coordinates = _Coordinates(solution.parameters)
    scaled = solution.scaled
    left, slope, unit = influence(solution)
    at, downhill, end = coordinates.into(solution.values), -(left @ scaled), 1e-4
    shut = ((at <= coordinates.low + end) & (downhill < 0.0)) | ((at >= coordinates.high - end) & (downhill > 0.0))
    size = np.sqrt((scaled**2).sum(axis=0))
    free = ~shut & (size > 1e-9 * size.max())
    r = triangle(np.column_stack([scaled[:, free] / size[free], left]))
    return float((r[:-1, -1] ** 2).sum()) / max(slope * unit, 1e-300)


class Tests(NamedTuple):
    """Residuals of a recording: rms and largest [m]; what neighbours have in common; the chance that white noise has as
    much in common over `_LAGS` samples; whether they pass for white.
    """

    rms: float
    largest: float
    autocorrelation: float
    chance: float
    white: bool
    inflation: float
    """of the variance of a mean of such residuals, over that of as many independent ones"""


_LAGS = 20
"""Samples over which residuals are tested for a memory; a fifth of them where they are few."""
_CHANCE = 0.005
"""Chance of white noise below which residuals are none."""


def tests_of(residual: Array) -> Tests:
    """Tests of one recording's residuals: Ljung and Box, Q = n (n + 2) sum r_k^2/(n - k), chi^2 over the lags k (1978).

    The inflation is 1 + 2 sum r_k up to where two neighbouring r are no longer positive (Geyer 1992); 1 of white noise.
    """
    n, centred = residual.size, residual - residual.mean()
    spectrum = np.fft.rfft(centred, 2 * n)
    power = max(float(centred @ centred), 1e-12 * float(residual @ residual), 1e-300)
    memory = np.fft.irfft(np.abs(spectrum) ** 2)[:n] / power
    lags = np.arange(1, max(min(_LAGS, n // 5), 1) + 1)
    q = n * (n + 2.0) * float((memory[lags] ** 2 / (n - lags)).sum())
    chance = float(of_scipy("special").chdtrc(lags.size, q))
    pairs = memory[1:-1] + memory[2:]
    last = int(np.argmax(np.append(pairs, 0.0) <= 0.0))
    white = chance >= _CHANCE
    inflation = 1.0 if white else max(1.0 + 2.0 * float(memory[1 : last + 1].sum()), 1.0)
    return Tests(rms(residual), float(np.abs(residual).max()), float(memory[1]), chance, white, inflation)
