"""All recordings of a robot, fitted together into one robot.

The spring is the same in drop tests and in step responses against it: one weighed mass gives the scale of every force. A ramp
adds its threshold (5) with its uncertainty. Each recording counts by its own noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hopform.errors import HopformError
from hopform.identification.drop import drop_problem
from hopform.identification.estimation import Parameter, Progress
from hopform.identification.fits import Fit, Problem, checked_known, finish
from hopform.identification.ramp import Threshold, friction_threshold
from hopform.identification.recordings import Recording
from hopform.identification.rigs import Experiment
from hopform.identification.step import SCALED, step_problem

LETTERS = ("m_s", "k", "b2", "f2", "length", "impact_loss", "g", "m_eff", "b1", "f1", "gamma2", "offset")


def fit_robot(
    *,
    drops: Sequence[Recording] = (),
    decays: Sequence[Recording] = (),
    steps: Sequence[Recording] = (),
    air: Sequence[Recording] = (),
    ramps: Sequence[Recording] = (),
    known: Mapping[str, float] | None = None,
    loss: str = "linear",
    compare: bool = True,
    holdout: bool = True,
    backend: str | None = None,
    progress: Progress | None = None,
) -> Fit:
    """All parameters that the recordings tell of, from all of them together; `fit.robot(base)` puts them into a robot.

    drops: of the body onto the ground; decays: of a body fixed to its spring; steps: of the actuator against its spring, the body
    held; air: of the actuator with the leg in the air; ramps: as `friction_threshold` takes them. known, loss and the rest as in
    `fit_drop_test`. Raises HopformError where a recording cannot be what it is given as, or none is given.
    """
    values = checked_known(known, LETTERS)
    problems = _problems(drops, decays, steps, air, values, backend)
    if not problems:
        raise HopformError(
            "a fit needs at least one recording of a drop, a decay or a step; a ramp alone gives a threshold"
        )
    together = merged(problems)
    names = {p.name for p in together.parameters}
    extra = list[str]()
    if ramps:
        threshold = friction_threshold(ramps)
        if {"f1"} <= names:
            together = replace(together, experiments=(*together.experiments, _threshold_of(threshold, together)))
        extra += [each for each in threshold.statements if each.startswith("one direction")]
    together = replace(together, statements=(*together.statements, *extra, *_missing(names, values)))
    parts = (0.35, 0.65, 1.0) if drops else (1.0,)
    return finish(together, loss=loss, parts=parts, compare=compare, holdout=holdout, progress=progress)


def _problems(
    drops: Sequence[Recording],
    decays: Sequence[Recording],
    steps: Sequence[Recording],
    air: Sequence[Recording],
    values: Mapping[str, float],
    backend: str | None,
) -> list[Problem]:
    """The problem of each kind, one scale through all of them."""

    def of(*letters: str) -> dict[str, float]:
        return {name: values[name] for name in letters if name in values}

    body = ("m_s", "k", "b2", "f2")
    problems, count = list[Problem](), 0
    for some, attached in ((drops, False), (decays, True)):
        if some:
            own = of(*body) if attached else of(*body, "length", "impact_loss", "g")
            problems.append(drop_problem(some, attached, own, backend, count))
            count += len(some)
    has_k = "k" in values or any(p.name == "k" for problem in problems for p in problem.parameters)
    for some, spring in ((steps, True), (air, False)):
        if some:
            own = of("m_eff", "b1", "f1", "gamma2", *(("k",) if spring else ("offset",)))
            scaled = (spring and has_k) or (not spring and bool(steps) and has_k)
            problems.append(step_problem(some, spring, own, backend, count, scaled))
            count += len(some)
    return problems


def merged(problems: Sequence[Problem]) -> Problem:
    """One problem of several: parameters of one name are one, those fitted first say where they start."""
    parameters, known, starts = dict[str, Parameter](), dict[str, float](), list[dict[str, float]]()
    for problem in problems:
        scale = 1.0
        if "k" in parameters and problem.quantity == "x1":
            own = next((p.start for p in problem.parameters if p.name == "k"), 0.0)
            scale = parameters["k"].start / own if own > 0.0 else 1.0
        elif "m_eff" in parameters and problem.quantity == "x1":
            own = next((p.start for p in problem.parameters if p.name == "m_eff"), 0.0)
            scale = parameters["m_eff"].start / own if own > 0.0 else 1.0
        several = [
            {name: start * scale if name in SCALED else start for name, start in each.items()}
            for each in problem.starts or ({p.name: p.start for p in problem.parameters},)
        ]
        for p in problem.parameters:
            factor = scale if p.name in SCALED else 1.0
            parameters.setdefault(p.name, p._replace(start=p.start * factor, scale=max(p.scale * factor, 1e-12)))
        starts = (
            [a | {k: v for k, v in b.items() if k not in a} for a in starts for b in several] if starts else several
        )
        known |= problem.known
    return Problem(
        "robot", "x1, x2", tuple(each for p in problems for each in p.experiments), tuple(parameters.values()),
        tuple(starts[:24]), {n: v for n, v in known.items() if n not in parameters},
        tuple(dict.fromkeys(each for p in problems for each in p.statements)),
        tuple(each for p in problems for each in p.warnings),
        tuple(name for name in parameters if name[:2] in ("f1", "f2")),
    )  # fmt: skip


def _threshold_of(threshold: Threshold, problem: Problem) -> Experiment:
    """A threshold as one more measurement, in A."""
    names = {p.name for p in problem.parameters}
    letters = ("m_eff", "f1", "gamma2")
    sigma = max((threshold.high - threshold.low) / (2.0 * 1.96), 1e-9)
    one = np.zeros(1)
    return Experiment(
        "threshold of friction", "threshold", one, one + threshold.u, {each: each for each in letters if each in names},
        {each: problem.known[each] for each in letters if each not in names}, noise=sigma,
    )  # fmt: skip


def _missing(names: set[str], known: Mapping[str, float]) -> list[str]:
    """What no recording tells of, and which one would."""
    has = {name.partition("@")[0] for name in names} | set(known)
    said = list[str]()
    if "b2" not in has:
        said.append("nothing was recorded of the body: a drop test gives k/m_s, b2, f2, L0 + c and impact_loss")
    elif "length" not in has:
        said.append(
            "L0 + c and impact_loss are not told by a body that is fixed to its spring: drop it onto the ground"
        )
    if "b1" not in has:
        said.append("nothing was recorded of the actuator: a step response gives m_eff, b1, f1 and gamma2")
    return said
