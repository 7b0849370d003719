"""The fit in force: the parameters of one mass by its equation of motion itself.

    inertia (a - a_model(x, v, u)) = 0

Both sides are filtered alike and decimated, then a linear least squares: that is what a recording in closed loop wants,
where position and current depend on each other through the controller; an error of the current then does not add up
twice into position. Filters commute with what is linear in x, v, u and the side of slip, so the accelerations of the
model are taken of the filtered rows, at a side between the slips as far from either as the filtered sign of v.
"""

import math
import time as clock
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from hopform import HopformError, Solver, __version__, load_solver
from hopform.extend import positive
from hopform.identify import _estimation as estimation
from hopform.identify._causes import SPEEDS, Diagnosis, brought, said, stiffest
from hopform.identify._estimation import LEVEL, Estimate, Parameter
from hopform.identify._fits import NONE, Fit, Options, Trace, checked, coloured
from hopform.identify._kinds import Recordings, files_of
from hopform.identify._models import Given, Model, Setup, parameter_of, setup_of
from hopform.identify._motion import Array, Values
from hopform.identify._recordings import Recording
from hopform.identify._segments import Filtered, filtered, joined, robust_linear


def fit_force(
    solver: Solver | str | Path,
    recordings: Recordings,
    *,
    fitted: Sequence[str] | None = None,
    known: Given = None,
    cutoff: float | None = None,
    **options: Unpack[Options],
) -> Fit:
    """The parameters of a model of one mass by its equation of motion itself, for recordings in closed loop.

    Both sides go through the same filters (`filtered`), then a linear least squares. solver, recordings, fitted and
    known are those of `fit`; one of the known ones must give the scale of all forces, as the force per current, an
    inertia, or a spring. cutoff [Hz]: of the filters. The delay of the drive, one of all recordings, is fitted where they
    show one; elsewhere drive and position are taken as sampled together. It takes none of `NUISANCES`. Residuals of the
    traces are in N, or N m.
    """
    began = clock.perf_counter()
    core = solver if isinstance(solver, Solver) else load_solver(solver)
    model, asked = Model(core.Robot.solver), checked(options)
    if model.input is None or model.law is not None or len(model.masses) > 1:
        raise HopformError(
            f"a fit in force takes a model of one mass with an input and no law; {model.core.name} is none"
        )
    if cutoff is not None:
        positive("cutoff", cutoff, "Hz")
    if asked.nuisances:
        raise HopformError(f"nuisances: a fit in force takes none, got {', '.join(asked.nuisances)}")
    asked.stage("fit in force")
    setup = setup_of(model, recordings, fitted, known)
    equation, values, covariance, unseen = _late(setup, cutoff, asked.loss)
    residual = equation.b - equation.a @ np.array([*values.values()])
    white = all(estimation.tests_of(part).white for part in equation.split(residual))
    looks = not white if asked.diagnose is None else asked.diagnose
    diagnoses = _causes(equation, asked.loss) if looks else ()
    estimates = _estimates(equation, values, covariance, explained=not diagnoses and white)
    kept = equation.a[:, [setup.parameters.get(name) not in model.coulomb for name in equation.names]]
    b = equation.b
    viscous = b - kept @ np.linalg.lstsq(kept, b, rcond=None)[0] if asked.compare else np.full_like(b, np.nan)
    left_out = _left_out(equation) if asked.holdout else [math.nan] * len(equation.parts)
    each_part = zip(setup.files, equation.split(equation.drive(values)), equation.parts, equation.split(residual),
                    equation.split(viscous), left_out, strict=True)  # fmt: skip
    traces = list[Trace]()
    for recording, force_of, part, rest, worse, error in each_part:
        old = None if np.isnan(worse).any() else force_of - worse
        fitted_force = force_of, force_of - rest, old, estimation.tests_of(rest), estimation.rms(worse), error
        traces.append(Trace(recording.source, "force", part.time, *fitted_force))
    notes = (*(f"{each.source}: {note}" for each in setup.recordings for note in each.notes),
             *coloured(traces, [trace.tests.white for trace in traces]), *said(diagnoses, setup.units.shown("force")))  # fmt: skip
    return Fit(
        "force", estimates, setup.known(known), {}, tuple(traces), unseen, notes, 1, clock.perf_counter() - began, None,
        diagnoses, covariance, units=setup.units, base=setup.robot(values), tied=setup.tied,
        origin=(f"hopform {__version__}", *files_of(setup.files)),
    )  # fmt: skip


def _missing(setup: Setup, parts: Sequence[Filtered], values: Values) -> Array:
    """The force that drives the filtered masses, less what their accelerations take [N, N m]."""
    missing = list[Array]()
    for n, rows in enumerate(parts):
        robot, mass = setup.model.robot(setup.at(values, n)), setup.model.masses[0].number
        forward, backward = (
            setup.model.accelerations(robot, mass, [rows.x], [rows.v], rows.u, [np.full_like(rows.v, side)])
            for side in (1.0, -1.0)
        )
        slips = 0.5 * (forward + backward) + 0.5 * (forward - backward) * rows.side
        missing.append(setup.model.moving(robot) * (slips - rows.acceleration))
    return np.concatenate(missing)


class _Equation(NamedTuple):
    """The equation of filtered recordings about values of the parameters, in N: a p = b; names of p, `delay` the last
    where one is fitted; the delay [s] by which the currents come later, None where none is.
    """

    setup: Setup
    names: list[str]
    a: Array
    b: Array
    parts: list[Filtered]
    delay: float | None

    def split(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """Values by recording."""
        return np.split(values, np.cumsum([part.time.size for part in self.parts])[:-1])

    def drive(self, values: Values) -> Array:
        """The force of the drive."""
        still = [part._replace(u=0.0 * part.u) for part in self.parts]
        return _missing(self.setup, self.parts, values) - _missing(self.setup, still, values)


_DIFFERENCE = 1e-3
"""Share of a parameter over which the equation's derivative is taken: it is right to rounding, since it is linear, or
bilinear, in stiffness and place."""


def _equation(setup: Setup, values: Values, cutoff: float | None, delay: float | None, *, mend: bool) -> _Equation:
    """The equation about values of the parameters, the current later by a delay [s]. None: no delay is fitted, drive and
    position were sampled together.
    """
    later = [each.with_late_current(_together(each) if delay is None else delay) for each in setup.recordings]
    parts, columns = [filtered(each, cutoff, mend=mend) for each in later], dict[str, Array]()
    for name in setup.parameters:
        step = _DIFFERENCE * (abs(values[name]) or 1.0)
        above, below = (_missing(setup, parts, {**values, name: values[name] + side * step}) for side in (1.0, -1.0))
        columns[name] = (below - above) / (2.0 * step)
    at = [values[name] for name in columns]
    if delay is not None:  # u(t - delay) is u - delay u'
        above, below = (_missing(setup, [part._replace(u=part.u + side * part.rate) for part in parts], values)
                        for side in (1.0, -1.0))  # fmt: skip
        columns["delay"] = 0.5 * (above - below)
        at.append(delay)
    a = np.stack(list(columns.values()), axis=1)
    return _Equation(setup, list(columns), a, _missing(setup, parts, values) + a @ np.array(at), parts, delay)


def _together(recording: Recording) -> float:
    """The delay [s] of a drive that was sampled with the position: delays count from a drive that holds from sample to
    sample, which comes half a sample later.
    """
    return -0.5 * float(np.median(np.diff(recording.time)))


def _refuse(equation: _Equation) -> None:
    """HopformError for a motion that does not fix the parameters, or their scale."""
    if not float(np.abs(equation.b).max()) > _OPEN * float(np.abs(equation.a).max()):
        per = equation.setup.model.per_drive
        raise HopformError(
            f"known: a fit in force needs the scale of all forces: {per or 'a force'}, an inertia or a spring"
        )
    size = np.abs(equation.a).max(axis=0, initial=1e-300)
    _, singular, directions = np.linalg.svd(equation.a / size, full_matrices=False)
    unseen = singular <= _OPEN * singular[0]
    if unseen.any():
        alike = [
            n for n, share in zip(equation.names, np.abs(directions[unseen]).max(axis=0), strict=True) if share > 1e-3
        ]
        raise equation.setup.recordings[0].error_of(
            "x1", f"does not distinguish {', '.join(alike)}: move both ways, at several speeds, or give one as known"
        )


def _settled(
    setup: Setup, values: Values, cutoff: float | None, delay: float | None, loss: str
) -> tuple[_Equation, dict[str, float], Array]:
    """The equation about where its least squares is, which the steps of Gauss and Newton lead to, with the values and
    the covariance there.
    """
    steps = 0
    while True:
        equation = _equation(setup, values, cutoff, delay, mend=loss != "linear")
        if steps == 0:
            _refuse(equation)
        coefficients, covariance, _ = _linear(equation.a, equation.b, loss)
        new, steps = dict(zip(equation.names, coefficients, strict=True)), steps + 1
        moved = [abs(new[name] - values[name]) > _SAME * abs(new[name]) for name in setup.parameters]
        late = delay is not None and abs(new["delay"] - delay) > _SAME
        if steps == _MOST_STEPS or not (any(moved) or late):
            return equation, new, covariance
        values, delay = new, None if delay is None else min(max(new["delay"], -_LONGEST), _LONGEST)


def _late(setup: Setup, cutoff: float | None, loss: str) -> tuple[_Equation, dict[str, float], Array, tuple[str, ...]]:
    """The equation at the delay that Gauss and Newton lead to; without a delay where the recordings do not show that
    drive and position were not sampled together, and a statement.
    """
    equation, values, covariance = _settled(setup, setup.begin(None), cutoff, 0.0, loss)
    error, after = math.sqrt(covariance[-1, -1]), values["delay"] - max(map(_together, setup.recordings))
    if abs(after) > _SHOWN * error:
        return equation, values, covariance, ()
    seen = f"{1e3 * after:.2g} ms with a standard error of {1e3 * error:.2g} ms"
    said = f"no delay of the drive is seen (after the sample of the position {seen}), so none is fitted"
    return *_settled(setup, values, cutoff, None, loss), (said,)


_MOST_STEPS, _SAME, _LONGEST = 12, 1e-9, 0.1
"""Steps of Gauss and Newton; by what share of a parameter, and of a second, the last one moves; the longest delay [s]."""
_OPEN = 1e-9
"""Share of the largest that the known side of the equation has at least, and a direction of the parameters."""
_SHOWN = 3.0
"""Standard errors from a drive that was sampled with the position from which a delay is fitted. A drive that holds is
half a sample from there, which noise hides in a slow motion; a delay that is fitted to it would follow the errors of
the friction model.
"""


def _causes(equation: _Equation, loss: str) -> tuple[Diagnosis, ...]:
    """Friction that is higher at rest, as a further column, where it explains more than noise does and leaves noise."""
    a, b, setup = equation.a, equation.b, equation.setup

    def friction(coefficients: Sequence[float]) -> float:
        robot = setup.model.robot(setup.at(dict(zip(equation.names, coefficients, strict=False)), 0))
        return setup.model.linear(robot, setup.model.masses[0].number).friction * setup.model.moving(robot)

    def rest_of(columns: Array) -> tuple[list[float], list[Array]]:
        coefficients, _, residual = _linear(columns, b, loss)
        return coefficients, equation.split(residual)

    before = rest_of(a)[1]
    sigma = [max(estimation.scale(part), 1e-300) for part in before]

    def with_it(column: Array) -> list[Diagnosis]:
        coefficients, after = rest_of(np.column_stack([a, column]))
        level = {"level": coefficients[-1] / max(friction(coefficients), 1e-300)}
        white = all(estimation.tests_of(part).white for part in after)
        return brought("Stribeck", level, (before, after), sigma, len(equation.names), loss) if white else []

    rows = joined(equation.parts)
    shapes = (rows.side * np.exp(-((rows.v / (share * float(np.abs(rows.v).max()))) ** 2)) for share in SPEEDS)
    return tuple(stiffest(each for shape in shapes for each in with_it(shape)))


def _linear(a: Array, b: Array, loss: str) -> tuple[list[float], Array, Array]:
    """Coefficients, covariance with what neighbours have in common, and residuals b - a p."""
    size = np.maximum(np.abs(a).max(axis=0), 1e-300)
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


def _estimates(
    equation: _Equation, values: Mapping[str, float], covariance: Array, *, explained: bool
) -> tuple[Estimate, ...]:
    """The parameters and the delay, with Student's t; no interval where the residuals are not noise."""
    setup, t = equation.setup, estimation.student(0.5 + 0.5 * LEVEL, max(equation.b.size - len(values), 1))
    rows = list[Estimate]()
    for (name, value), error in zip(values.items(), np.sqrt(np.diag(covariance)).tolist(), strict=True):
        p = parameter_of(setup, name, value) if name in setup.parameters else Parameter(name, "s", value, 1e-3)
        low, high = (value - t * error, value + t * error) if explained else (-math.inf, math.inf)
        low = low if p.kind == "real" or not explained else max(low, 0.0)
        rows.append(Estimate(name, p.unit, value, error, low, high, "t" if explained else NONE, p.own))
    return tuple(rows)
