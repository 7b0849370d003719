"""The fit in force: mass and friction of an actuator without a spring, by its equation of motion itself.

Both sides are filtered alike and decimated, then a linear least squares: that is what a recording in closed loop wants,
where position and current depend on each other through the controller; an error of the current then does not add up
twice into position.
"""

import math
import time as clock
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from hopform import HopformError
from hopform._checks import flag
from hopform.extend import positive
from hopform.identify import _estimation as estimation
from hopform.identify._causes import SPEEDS, Diagnosis, brought, said, stiffest
from hopform.identify._estimation import LEVEL, Estimate
from hopform.identify._fits import Fit, Options, Trace, checked, coloured
from hopform.identify._held import AIR
from hopform.identify._kinds import Cut, Group, Recordings, checked_known, read_some
from hopform.identify._motion import Array, Values
from hopform.identify._recordings import (
    Recording,
    Units,
    units_of,
)
from hopform.identify._rigs import UNITS
from hopform.identify._search import follow
from hopform.identify._segments import Filtered, filtered, joined, robust_linear


def fit_force(
    recordings: Recordings,
    *,
    known: Values,
    cutoff: float | None = None,
    position: bool = True,
    **options: Unpack[Options],
) -> Fit:
    """Mass and friction of an actuator without a spring by its equation of motion itself, for recordings in closed
    loop.

        -gamma2 u = m_eff a + b1 v + m_eff f1 sign(v) + offset force

    Both sides go through the same filters (`filtered`), then a linear least squares. known: gamma2, which gives the
    scale, or m_eff. cutoff [Hz]: of the filters. position: fit the position too and set it beside this in the
    statements. The estimates hold f1 m_eff [N] and the constant force on the load's side [N] beside the parameters. The
    delay of the drive, one of all recordings, is among them where the recordings show one; elsewhere drive and position
    are taken as sampled together. It takes none of `NUISANCES`. Residuals of the traces are in N.
    """
    began = clock.perf_counter()
    several = [each.whole("x1", "u") for each in read_some(recordings)]
    units = units_of(several, "x1", driven=True)
    values = checked_known(known, ("gamma2", "m_eff"), units)
    if units.drive == units.force and not values:
        values["gamma2"] = -1.0
    flag("position", position)
    if cutoff is not None:
        positive("cutoff", cutoff, "Hz")
    asked = checked(options)
    loss, refused = asked.loss, asked.nuisances
    if len(values) != 1:
        raise HopformError("known: a fit in force needs gamma2 or m_eff, one of them: it is the scale of all forces")
    if refused:
        raise HopformError(f"nuisances: a fit in force takes none, got {', '.join(refused)}")
    asked.stage("fit in force")
    equation, unseen = _late(several, values, cutoff, loss)
    a, b, parts = equation.a, equation.b, equation.parts
    if np.linalg.matrix_rank(a / np.abs(a).max(axis=0, initial=1e-300)) < a.shape[1]:
        message = "does not distinguish friction, mass and load: move both ways, at several speeds"
        raise several[0].error_of("x1", message)
    coefficients, covariance, residual = _linear(a, b, loss)
    white = all(estimation.tests_of(part).white for part in equation.split(residual))
    looks = not white if asked.diagnose is None else asked.diagnose
    diagnoses = _causes(equation, loss) if looks else ()
    explained = not diagnoses and white
    estimates, spread = _force_estimates(equation, coefficients, covariance, units, explained=explained)
    scale = -equation.coefficient("gamma2", coefficients)
    kept = a[:, [n for n, name in enumerate(equation.names) if name != "coulomb"]]
    viscous = b - kept @ np.linalg.lstsq(kept, b, rcond=None)[0] if asked.compare else np.full_like(b, np.nan)
    left_out = _left_out(equation) if asked.holdout else [math.nan] * len(parts)
    each_part = zip(several, parts, equation.split(residual), equation.split(viscous), left_out, strict=True)
    traces = list[Trace]()
    for recording, part, rest, worse, error in each_part:
        force_of, tests = scale * part.u, estimation.tests_of(rest)
        old = None if np.isnan(worse).any() else force_of - worse
        fitted = force_of, force_of - rest, old, tests, estimation.rms(worse), error
        traces.append(Trace(recording.source, "force", part.time, *fitted))
    notes = (*coloured(traces, [trace.tests.white for trace in traces]), *said(diagnoses, units.shown("force")))
    force = Fit(
        "force", estimates, values, {}, tuple(traces), unseen, notes, 1, 0.0, None, diagnoses, spread, units=units
    )
    if position:
        asked.stage("fit in position")
        force = replace(force, statements=(*unseen, *_beside(several, force, loss)))
    return replace(force, seconds=clock.perf_counter() - began)


class _Equation(NamedTuple):
    """The equation of filtered recordings, in N: names of the coefficients, their columns, and the known side; the
    parameter that is known, and the delay [s] by which the currents come later, None where none is fitted.
    """

    names: list[str]
    a: Array
    b: Array
    parts: list[Filtered]
    known: Values
    delay: float | None

    def split(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """Values by recording."""
        return np.split(values, np.cumsum([part.time.size for part in self.parts])[:-1])

    def coefficient(self, name: str, coefficients: Sequence[float]) -> float:
        """A coefficient, known or fitted; NaN if it is neither."""
        return self.known.get(name, coefficients[self.names.index(name)] if name in self.names else math.nan)

    def late(self, coefficients: Sequence[float]) -> float:
        """The delay [s] that is left, by its coefficient, -gamma2 delay."""
        return -self.coefficient("late", coefficients) / self.coefficient("gamma2", coefficients)


def _equation(
    recordings: Sequence[Recording], known: Values, cutoff: float | None, delay: float | None, *, mend: bool
) -> _Equation:
    """Both sides of the equation, filtered, the current later by a delay [s]; what is left of it is a coefficient. None:
    no delay is fitted, drive and position were sampled together.
    """
    later = [each.with_late_current(_together(each) if delay is None else delay) for each in recordings]
    parts = [filtered(each, cutoff, mend=mend) for each in later]
    rows = joined(parts)
    # gamma2 u(t - delay) is gamma2 u - (gamma2 delay) u'
    columns = {"b1": rows.v, "coulomb": rows.side, "constant": rows.one}
    columns |= {} if delay is None else {"late": rows.rate}
    if "gamma2" in known:
        columns, b = {"m_eff": rows.acceleration, **columns}, -known["gamma2"] * rows.u
    else:
        columns, b = {"gamma2": rows.u, **columns}, -known["m_eff"] * rows.acceleration
    return _Equation(list(columns), np.stack(list(columns.values()), axis=1), b, parts, known, delay)


def _together(recording: Recording) -> float:
    """The delay [s] of a drive that was sampled with the position: delays count from a drive that holds from sample to
    sample, which comes half a sample later.
    """
    return -0.5 * float(np.median(np.diff(recording.time)))


def _late(
    recordings: Sequence[Recording], known: Values, cutoff: float | None, loss: str
) -> tuple[_Equation, tuple[str, ...]]:
    """The equation at the delay that Gauss and Newton lead to; without a delay where the recordings do not show that
    drive and position were not sampled together, and a statement.
    """
    delay, mend = 0.0, loss != "linear"
    for _ in range(_MOST_STEPS):
        equation = _equation(recordings, known, cutoff, delay, mend=mend)
        more = equation.late(_linear(equation.a, equation.b, loss)[0])
        if abs(more) <= _ALIKE:
            break
        delay = min(max(delay + more, -_LONGEST), _LONGEST)
    equation = _equation(recordings, known, cutoff, delay, mend=mend)
    coefficients, covariance, _ = _linear(equation.a, equation.b, loss)
    late = equation.names.index("late")
    error = math.sqrt(covariance[late, late]) / abs(equation.coefficient("gamma2", coefficients))
    after = delay + equation.late(coefficients) - max(map(_together, recordings))
    if abs(after) > _SHOWN * error:
        return equation, ()
    seen = f"{1e3 * after:.2g} ms with a standard error of {1e3 * error:.2g} ms"
    said = f"no delay of the drive is seen (after the sample of the position {seen}), so none is fitted"
    return _equation(recordings, known, cutoff, None, mend=mend), (said,)


_MOST_STEPS, _ALIKE, _LONGEST = 12, 1e-6, 0.1
"""Steps to a delay, and the last one's size [s]; the longest delay [s]."""
_SHOWN = 3.0
"""Standard errors from a drive that was sampled with the position from which a delay is fitted. A drive that holds is
half a sample from there, which noise hides in a slow motion; a delay that is fitted to it would follow the errors of
the friction model.
"""


def _causes(equation: _Equation, loss: str) -> tuple[Diagnosis, ...]:
    """Friction that is higher at rest, as a further column, where it explains more than noise does and leaves noise."""
    names, a, b = equation.names, equation.a, equation.b

    def rest_of(columns: Array) -> tuple[list[float], list[Array]]:
        coefficients, _, residual = _linear(columns, b, loss)
        return coefficients, equation.split(residual)

    before = rest_of(a)[1]
    sigma = [max(estimation.scale(part), 1e-300) for part in before]

    def with_it(column: Array) -> list[Diagnosis]:
        coefficients, after = rest_of(np.column_stack([a, column]))
        values = {"level": coefficients[-1] / equation.coefficient("coulomb", coefficients)}
        white = all(estimation.tests_of(part).white for part in after)
        return brought("Stribeck", values, (before, after), sigma, len(names), loss) if white else []

    rows = joined(equation.parts)
    side, v = rows.side, rows.v
    shapes = (side * np.exp(-((v / (share * float(np.abs(v).max()))) ** 2)) for share in SPEEDS)
    return tuple(stiffest(each for shape in shapes for each in with_it(shape)))


def _linear(a: Array, b: Array, loss: str) -> tuple[list[float], Array, Array]:
    """Coefficients, covariance with what neighbours have in common, and residuals b - a p."""
    size = np.abs(a).max(axis=0)
    scaled = a / size

    def least_squares(masks: estimation.Masks) -> tuple[Array, list[Array]]:
        coefficients = np.asarray(np.linalg.lstsq(scaled[masks[0]], b[masks[0]], rcond=None)[0], dtype=np.float64)
        return coefficients, [np.asarray(b - scaled @ coefficients)]

    solution, _ = least_squares([np.full(b.size, True)])
    if loss != "linear":
        trimmed = estimation.trimmed(least_squares, [np.full(b.size, True)])
        spread = max(estimation.scale(b - scaled @ trimmed), 1e-300)
        how = {"loss": loss, "f_scale": estimation.BEND}
        tried = [robust_linear(scaled, b, start, spread, **how) for start in (solution, trimmed)]
        solution = np.asarray(min(tried, key=lambda each: float(each.cost)).x, dtype=np.float64)
    residual = np.asarray(b - scaled @ solution, dtype=np.float64)
    variance = float((residual**2).sum()) / max(b.size - solution.size, 1) * estimation.tests_of(residual).inflation
    inverse = np.asarray(np.linalg.pinv(scaled.T @ scaled, hermitian=True), dtype=np.float64)
    covariance = inverse * variance / np.outer(size, size)
    return (solution / size).tolist(), covariance, residual


def _left_out(equation: _Equation) -> list[float]:
    """rms [N] over the last third of each recording, of a fit to the first two."""
    a, b, parts = equation.a, equation.b, equation.parts
    last = np.concatenate([np.arange(part.time.size) >= 2 * part.time.size // 3 for part in parts])
    missed = b - a @ np.linalg.lstsq(a[~last], b[~last], rcond=None)[0]
    pairs = zip(equation.split(missed), equation.split(last), strict=True)
    return [math.sqrt(float((rest[chosen] ** 2).mean())) for rest, chosen in pairs]


def _force_estimates(
    equation: _Equation, coefficients: Sequence[float], covariance: Array, units: Units, *, explained: bool
) -> tuple[tuple[Estimate, ...], Array]:
    """The parameters and the forces behind them, with their covariance; f1 and the offset are quotients, whose errors
    follow to first order. No interval where the residuals are not noise.
    """
    names = equation.names
    t = estimation.student(0.5 + 0.5 * LEVEL, max(equation.b.size - len(names), 1))
    mass, gamma, coulomb, constant = (
        equation.coefficient(each, coefficients) for each in ("m_eff", "gamma2", "coulomb", "constant")
    )
    direct = [name for name in names if name in ("m_eff", "gamma2", "b1")]
    quotients: list[tuple[str, str, float, dict[str, float]]] = [
        *((name, UNITS[name], equation.coefficient(name, coefficients), {name: 1.0}) for name in direct),
        ("f1", "m/s^2", coulomb / mass, {"coulomb": 1.0 / mass, "m_eff": -coulomb / mass**2}),
        ("offset", "A", constant / gamma, {"constant": 1.0 / gamma, "gamma2": -constant / gamma**2}),
        ("f1 m_eff", "N", coulomb, {"coulomb": 1.0}),
        ("offset force", "N", constant, {"constant": 1.0}),
    ]
    if equation.delay is not None:
        left = equation.late(coefficients)
        quotients.append(("delay", "s", equation.delay + left, {"late": -1.0 / gamma, "gamma2": -left / gamma}))
    slopes = np.array([[slope.get(each, 0.0) for each in names] for *_, slope in quotients])
    whole = np.asarray(slopes @ covariance @ slopes.T)

    def estimate(name: str, unit: str, value: float, stderr: float) -> Estimate:
        if not explained:
            return Estimate(name, units.of(unit), value, stderr, -math.inf, math.inf, "not explained")
        low = max(value - t * stderr, 0.0) if name[:2] in ("b1", "f1") else value - t * stderr
        return Estimate(name, units.of(unit), value, stderr, low, value + t * stderr, "t")

    errors = np.sqrt(np.diag(whole)).tolist()
    return tuple(estimate(*each[:3], error) for each, error in zip(quotients, errors, strict=True)), whole


def _coarse(recording: Recording, number: int) -> Cut:
    """A recording at every so manieth sample; its current as steps of as many, whose mean it takes: what a mass that
    integrates twice sees of it.
    """
    time, x, u = recording.time, recording.position("x1"), recording.current()
    every = max(time.size // 2500, 1)
    begins = np.arange(0, time.size, every)
    means = np.add.reduceat(u, begins) / np.diff(np.append(begins, u.size))
    under = tuple(zip(time[begins].tolist(), means.tolist(), strict=True))
    return Cut(recording, number, recording.source, time[::every], x[::every], 0.0, under)


def _beside(recordings: Sequence[Recording], force: Fit, loss: str) -> tuple[str, ...]:
    """The fit in position from that in force, and what their difference comes from."""
    values = {"gamma2": force.values["gamma2"], **force.known}
    cuts = [_coarse(each, n) for n, each in enumerate(recordings)]
    problem = AIR.posed(Group(AIR, recordings, force.units, values, cuts=cuts, loss=loss), 0)
    first = {p.name: force.values.get(p.name, p.start) for p in problem.parameters}
    solution = follow(replace(problem, starts=(first,), parts=(1.0,)))
    rest = np.concatenate([part[some] for part, some in zip(solution.residuals, solution.inliers, strict=True)])
    rms = estimation.rms(rest)
    parameters = ", ".join(f"{p.name} {solution.values[p.name]:.6g} {p.unit}" for p in problem.parameters if not p.own)
    unit, factor = force.units.shown("x1")
    return (
        f"the fit in position, by the same current without feedback, gives {parameters}, rms {factor * rms:.3g} {unit}",
        "a closed loop keeps the position near its reference whatever the model misses, so an error of the force of "
        "1 % adds up twice into position, unopposed: the fit in position bends the parameters after that drift, the "
        "one in force does not",
    )
