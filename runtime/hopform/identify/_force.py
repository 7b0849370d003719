"""The fit in force: the parameters of one mass by its equation of motion itself.

    inertia (a - a_model(x, v, u)) = 0

Both sides are filtered alike and decimated, then a linear least squares: that is what a recording in closed loop wants,
where position and current depend on each other through the controller; an error of the current then does not add up
twice into position. Filters commute with what is linear in x, v, u and the side of slip, so the accelerations of the
model are taken of the filtered rows, at a side between the slips as far from either as the filtered sign of v.
"""

import math
import time as clock
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, Unpack

import numpy as np
from numpy.typing import NDArray

from hopform import HopformError, Solver, __version__, load_solver
from hopform.extend import positive
from hopform.identify import _estimation as estimation
from hopform.identify._causes import SPEEDS, Diagnosis, brought, said, stiffest
from hopform.identify._estimation import LEVEL, Estimate, Parameter
from hopform.identify._fits import NONE, Fit, Options, Trace, bare, boundary, checked, coloured, is_no_force
from hopform.identify._kinds import Recordings, files_of
from hopform.identify._models import Given, Model, Setup, parameter_of, setup_of
from hopform.identify._motion import Array, Values, of_scipy
from hopform.identify._recordings import Recording
from hopform.identify._repeats import Repeat, compared
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
            f"a fit in force takes a model of one mass with an input and no law; {model.core.name} is not such a model"
        )
    if cutoff is not None:
        positive("cutoff", cutoff, "Hz")
    if asked.nuisances:
        raise HopformError(f"nuisances: a fit in force takes none, got {', '.join(asked.nuisances)}")
    asked.stage("fit in force")
    setup = setup_of(model, recordings, fitted, known)
    joint, unseen = _late(setup, cutoff, asked.loss)
    equation, values, covariance = joint
    residual = joint.residual
    white = all(estimation.tests_of(part).white for part in equation.split(residual))
    looks = not white if asked.diagnose is None else asked.diagnose
    alone = [_alone(joint, n, cutoff, asked.loss) for n in range(len(setup.files))] if setup.files[1:] else [joint]
    diagnoses = (_turned(joint, alone, cutoff, asked.loss) or _causes(equation, asked.loss)) if looks else ()
    estimates = _estimates(joint, explained=not diagnoses and white)
    repeats, differing = list[Repeat](), list[str]()
    if setup.files[1:] and all(alone):
        reaches = [float(np.ptp(each.position("x1"))) for each in setup.recordings]
        repeats, differing = compared(estimates, [each.errors for each in alone if each], reaches)
    if any(each.differ for each in repeats):
        estimates = bare(estimates)
    kept = np.array([setup.parameters.get(name) not in model.coulomb for name in equation.names])
    viscous = equation.missed(kept) if asked.compare else np.full_like(equation.b, np.nan)
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
        "force", estimates, setup.known(known), {}, tuple(traces), (*unseen, *boundary(estimates), *differing), notes, 1,
        clock.perf_counter() - began, None, diagnoses, covariance, tuple(repeats), setup.units,
        base=setup.robot(values), tied=setup.tied,
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

    @property
    def limits(self) -> tuple[Array, Array]:
        """Between which values each parameter lies. A positive one drives at least a share of the largest force, since an
        inertia of 0 is none.
        """
        parameters = [_parameter(self.setup, name, 1.0) for name in self.names]
        low, high = np.array([p.limits for p in parameters]).T
        least = _LEAST * float(np.abs(self.b).max()) / _sizes(self.a)
        return np.where([p.kind == "positive" for p in parameters], least, low), high

    def missed(self, columns: NDArray[np.bool_], rows: NDArray[np.bool_] | slice = slice(None)) -> Array:
        """What columns alone leave [N, N m], by the least squares of rows."""
        low, high = self.limits
        a = self.a[:, columns]
        return np.asarray(self.b - a @ _least_squares(a[rows], self.b[rows], (low[columns], high[columns])))

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


class _Settled(NamedTuple):
    """The equation about where its least squares is, with the values, the delay among them, and the covariance there."""

    equation: _Equation
    values: dict[str, float]
    covariance: Array

    @property
    def residual(self) -> Array:
        """What the force that drives is more than the motion takes [N, N m]."""
        return np.asarray(self.equation.b - self.equation.a @ np.array([*self.values.values()]))

    @property
    def errors(self) -> dict[str, tuple[float, float]]:
        """Values, each with its standard error."""
        pairs = zip(self.values.items(), np.sqrt(np.diag(self.covariance)).tolist(), strict=True)
        return {name: (value, error) for (name, value), error in pairs}

    @property
    def is_no_fit(self) -> bool:
        """Whether a recording's force is not explained at all."""
        forces, rests = (self.equation.split(each) for each in (self.equation.drive(self.values), self.residual))
        return any(is_no_force(force, estimation.rms(rest)) for force, rest in zip(forces, rests, strict=True))


def _settled(setup: Setup, values: Values, cutoff: float | None, delay: float | None, loss: str) -> _Settled:
    """The equation about where its least squares is, which the steps of Gauss and Newton lead to."""
    steps = 0
    while True:
        equation = _equation(setup, values, cutoff, delay, mend=loss != "linear")
        if steps == 0:
            _refuse(equation)
        coefficients, covariance, _ = _linear(equation.a, equation.b, equation.limits, loss)
        new, steps = dict(zip(equation.names, coefficients, strict=True)), steps + 1
        moved = [abs(new[name] - values[name]) > _SAME * abs(new[name]) for name in setup.parameters]
        late = delay is not None and abs(new["delay"] - delay) > _SAME
        if steps == _MOST_STEPS or not (any(moved) or late):
            return _Settled(equation, new, covariance)
        values, delay = new, None if delay is None else new["delay"]


def _late(setup: Setup, cutoff: float | None, loss: str) -> tuple[_Settled, tuple[str, ...]]:
    """The equation at the delay that Gauss and Newton lead to; without a delay where the recordings do not show that
    drive and position were not sampled together, and a statement.
    """
    late = _settled(setup, setup.begin(None), cutoff, 0.0, loss)
    delay, error = late.errors["delay"]
    after = delay - max(map(_together, setup.recordings))
    if abs(after) > _SHOWN * error:
        return late, ()
    seen = f"{1e3 * after:.2g} ms with a standard error of {1e3 * error:.2g} ms"
    said = f"no delay of the drive is seen (after the sample of the position {seen}), so none is fitted"
    return _settled(setup, late.values, cutoff, None, loss), (said,)


_MOST_STEPS, _SAME, _LONGEST = 12, 1e-9, 0.1
"""Steps of Gauss and Newton; by what share of a parameter, and of a second, the last one moves; the longest delay [s]."""
_OPEN = 1e-9
"""Share of the largest that the known side of the equation has at least, and a direction of the parameters."""
_LEAST = 1e-6
"""Share of the largest force that a positive parameter drives at least."""
_SHOWN = 3.0
"""Standard errors from a drive that was sampled with the position from which a delay is fitted. A drive that holds is
half a sample from there, which noise hides in a slow motion; a delay that is fitted to it would follow the errors of
the friction model.
"""


def _alone(joint: _Settled, n: int, cutoff: float | None, loss: str, side: float = 1.0) -> _Settled | None:
    """The equation of one recording, with its delay if all have one; None where it does not fix the parameters. side: -1
    with its drive turned.
    """
    setup, delay = joint.equation.setup, joint.values.get("delay")
    recording, drive = setup.recordings[n], setup.recordings[n].column_of("u")
    columns = {name: each._replace(values=side * each.values) if each is drive else each
               for name, each in recording.columns.items()}  # fmt: skip
    one = setup._replace(
        files=[setup.files[n]], recordings=[replace(recording, columns=columns)], letters={0: setup.letters[n]}
    )
    try:
        return _settled(one, one.begin(None), cutoff, delay, loss)
    except HopformError:
        return None


def _turned(
    joint: _Settled, alone: Sequence[_Settled | None], cutoff: float | None, loss: str
) -> tuple[Diagnosis, ...]:
    """The recordings that no fit explains but with the other sign of their drive."""
    names, before, after = dict[str, float](), list[Array](), list[Array]()
    for n, unturned in enumerate(alone):
        off = unturned is not None and unturned.is_no_fit
        turned = _alone(joint, n, cutoff, loss, -1.0) if off else None
        if unturned is not None and turned is not None and not turned.is_no_fit:
            recording = joint.equation.setup.recordings[n]
            names[f"{recording.column_of('u').title} of {recording.source}"] = -1.0
            before, after = [*before, unturned.residual], [*after, turned.residual]
    if not names:
        return ()
    sigma = [max(estimation.scale(part), 1e-300) for part in after]
    return tuple(brought("sign", names, (before, after), sigma, len(joint.equation.names), loss))


def _causes(equation: _Equation, loss: str) -> tuple[Diagnosis, ...]:
    """Friction that is higher at rest, as a further column, where it explains more than noise does and leaves noise."""
    a, b, setup = equation.a, equation.b, equation.setup
    limits = equation.limits
    wider = np.append(limits[0], -np.inf), np.append(limits[1], np.inf)

    def friction(coefficients: Sequence[float]) -> float:
        robot = setup.model.robot(setup.at(dict(zip(equation.names, coefficients, strict=False)), 0))
        return setup.model.linear(robot, setup.model.masses[0].number).friction * setup.model.moving(robot)

    def rest_of(columns: Array, within: tuple[Array, Array]) -> tuple[list[float], list[Array]]:
        coefficients, _, residual = _linear(columns, b, within, loss)
        return coefficients, equation.split(residual)

    before = rest_of(a, limits)[1]
    sigma = [max(estimation.scale(part), 1e-300) for part in before]

    def with_it(column: Array) -> list[Diagnosis]:
        coefficients, after = rest_of(np.column_stack([a, column]), wider)
        level = {"level": coefficients[-1] / max(friction(coefficients), 1e-300)}
        white = all(estimation.tests_of(part).white for part in after)
        return brought("Stribeck", level, (before, after), sigma, len(equation.names), loss) if white else []

    rows = joined(equation.parts)
    shapes = (rows.side * np.exp(-((rows.v / (share * float(np.abs(rows.v).max()))) ** 2)) for share in SPEEDS)
    return tuple(stiffest(each for shape in shapes for each in with_it(shape)))


def _sizes(a: Array) -> Array:
    """The largest of each column; 1 of one without any, as of a delay while the drive has no force."""
    largest = np.abs(a).max(axis=0)
    return np.where(largest > 0.0, largest, 1.0)


def _least_squares(a: Array, b: Array, limits: tuple[Array, Array]) -> Array:
    """The least squares of a p = b with p within limits."""
    return np.asarray(of_scipy("optimize").lsq_linear(a, b, limits, method="bvls").x, dtype=np.float64)


def _linear(a: Array, b: Array, limits: tuple[Array, Array], loss: str) -> tuple[list[float], Array, Array]:
    """Coefficients within limits, covariance with what neighbours have in common, and residuals b - a p."""
    size = _sizes(a)
    scaled, within = a / size, (limits[0] * size, limits[1] * size)

    def least_squares(masks: estimation.Masks) -> tuple[Array, list[Array]]:
        coefficients = _least_squares(scaled[masks[0]], b[masks[0]], within)
        return coefficients, [np.asarray(b - scaled @ coefficients)]

    solution, _ = least_squares([np.full(b.size, True)])
    if loss != "linear":
        trimmed = estimation.trimmed(least_squares, [np.full(b.size, True)])
        spread = max(estimation.scale(b - scaled @ trimmed), 1e-300)
        how = {"loss": loss, "f_scale": estimation.BEND, "bounds": within}
        tried = [robust_linear(scaled, b, start, spread, **how) for start in (solution, trimmed)]
        solution = np.asarray(min(tried, key=lambda each: float(each.cost)).x, dtype=np.float64)
    residual = np.asarray(b - scaled @ solution, dtype=np.float64)
    variance = float((residual**2).sum()) / max(b.size - solution.size, 1) * estimation.tests_of(residual).inflation
    inverse = np.asarray(np.linalg.pinv(scaled.T @ scaled, hermitian=True), dtype=np.float64)
    covariance = inverse * variance / np.outer(size, size)
    return (solution / size).tolist(), covariance, residual


def _left_out(equation: _Equation) -> list[float]:
    """rms [N] over the last third of each recording, of a fit to the first two."""
    parts, every = equation.parts, np.full(len(equation.names), True)
    last = np.concatenate([np.arange(part.time.size) >= 2 * part.time.size // 3 for part in parts])
    missed = equation.missed(every, ~last)
    pairs = zip(equation.split(missed), equation.split(last), strict=True)
    return [math.sqrt(float((rest[chosen] ** 2).mean())) for rest, chosen in pairs]


def _estimates(joint: _Settled, *, explained: bool) -> tuple[Estimate, ...]:
    """The parameters and the delay, with Student's t; no interval where the residuals are not noise. What may be 0 and
    cannot be less has an upper limit alone.
    """
    setup, freedom = joint.equation.setup, max(joint.equation.b.size - len(joint.values), 1)
    two, one = (estimation.student(level, freedom) for level in (0.5 + 0.5 * LEVEL, LEVEL))
    rows = list[Estimate]()
    for name, (value, error) in joint.errors.items():
        p = _parameter(setup, name, value)
        low, high, method = value - two * error, value + two * error, "t"
        if not explained:
            low, high, method = -math.inf, math.inf, NONE
        elif p.kind != "real" and low <= 0.0:
            low, high, method = 0.0, value + one * error, "t, one-sided at 0"
        rows.append(Estimate(name, p.unit, value, error, low, high, method, p.own))
    return tuple(rows)


def _parameter(setup: Setup, name: str, value: float) -> Parameter:
    """A parameter of the model, or the delay [s]."""
    if name in setup.parameters:
        return parameter_of(setup, name, value)
    return Parameter(name, "s", value, 1e-3, low=-_LONGEST, high=_LONGEST)
