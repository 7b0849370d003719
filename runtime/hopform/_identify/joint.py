"""All recordings of a robot, fitted together into one robot.

The spring is the same in drop tests and in step responses against it: one weighed mass gives the scale of every force.
A ramp adds its threshold (5) with its uncertainty. Each recording counts by its own noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Unpack

import numpy as np

from hopform._errors import HopformError
from hopform._identify.drop import Rig, drop_problem
from hopform._identify.estimation import Parameter
from hopform._identify.fits import Fit, Options, as_many, checked_known, finish
from hopform._identify.ramp import Threshold, friction_threshold
from hopform._identify.recordings import Recording
from hopform._identify.rigs import Experiment
from hopform._identify.search import Problem
from hopform._identify.step import SCALED, step_problem

LETTERS = (
    "m_s", "k", "b2", "f2", "length", "impact_loss", "g", "m_eff", "b1", "f1", "gamma2", "offset", "x1_min", "x1_max",
)  # fmt: skip


def fit_robot(
    *,
    drops: Sequence[Recording] = (),
    free_drops: Sequence[Recording] = (),
    decays: Sequence[Recording] = (),
    steps: Sequence[Recording] = (),
    air: Sequence[Recording] = (),
    ramps: Sequence[Recording] = (),
    known: Mapping[str, float] | None = None,
    **options: Unpack[Options],
) -> Fit:
    """All parameters that the recordings identify, from all of them together; `fit.robot(base)` puts them into a robot.

    drops: of the body onto the ground, actuator held; free_drops: the same, actuator free; decays: of a body fixed to
    its spring; steps: of the actuator against its spring, the body held; air: of the actuator with the leg in the air;
    ramps: as `friction_threshold` takes them. known as in `fit_drop_test` and `fit_step_response`; options: `Options`.
    Raises HopformError where a recording cannot be what it is given as, or none is given.
    """
    handed = {
        "drop": ("drops", drops),
        "free": ("free_drops", free_drops),
        "decay": ("decays", decays),
        "step": ("steps", steps),
        "air": ("air", air),
        "ramp": ("ramps", ramps),
    }
    of = {role: as_many(recordings, name) for role, (name, recordings) in handed.items()}
    return finish(robot_problem(of, known, options.get("loss", "linear"), options.get("backend")), **options)


def robot_problem(
    of: Mapping[str, Sequence[Recording]],
    known: Mapping[str, float] | None = None,
    loss: str = "linear",
    backend: str | None = None,
) -> Problem:
    """The least-squares problem of all recordings of a robot, by their role: drop, free, decay, step, air, ramp."""
    values, ramps = checked_known(known, LETTERS), of.get("ramp", ())
    problems = _problems(of, values, backend)
    if not problems:
        raise HopformError(
            "a fit needs at least one recording of a drop, a decay or a step; a ramp alone gives a threshold"
        )
    together = merged(problems)
    names = {p.name for p in together.parameters}
    extra = list[str]()
    if ramps:
        threshold = friction_threshold(ramps, loss=loss)
        if {"f1"} <= names:
            together = replace(together, experiments=(*together.experiments, _threshold_of(threshold, together)))
        extra += [each for each in threshold.statements if each.startswith("one direction")]
    return replace(together, statements=(*together.statements, *extra, *_missing(names, values)))


_DROPS: dict[str, tuple[Rig, tuple[str, ...]]] = {
    "drop": ("ground", ("m_s", "k", "b2", "f2", "length", "impact_loss", "g")),
    "decay": ("attached", ("m_s", "k", "b2", "f2")),
    "free": ("free", LETTERS),
}
_STEPS: dict[str, tuple[bool, tuple[str, ...]]] = {
    "step": (True, ("m_eff", "b1", "f1", "gamma2", "k")),
    "air": (False, ("m_eff", "b1", "f1", "gamma2", "offset")),
}


def _problems(
    given: Mapping[str, Sequence[Recording]], values: Mapping[str, float], backend: str | None
) -> list[Problem]:
    """The problem of each kind of recording, one scale through all of them; a free drop's last, since it shows least
    about its starts.
    """
    problems, count = list[Problem](), 0
    for kind, (rig, letters) in _DROPS.items():
        if given.get(kind):
            own = {name: values[name] for name in letters if name in values}
            problems.append(drop_problem(given[kind], rig, own, backend, count))
            count += problems[-1].motions
    has_k = "k" in values or any(p.name == "k" for problem in problems for p in problem.parameters)
    for kind, (spring, letters) in _STEPS.items():
        if given.get(kind):
            own = {name: values[name] for name in letters if name in values}
            scaled = has_k and (spring or bool(given.get("step")))
            problems.append(step_problem(given[kind], spring, own, backend, count, scaled))
            count += problems[-1].motions
    return sorted(problems, key=lambda each: any(e.kind == "free" for e in each.experiments))


def merged(problems: Sequence[Problem]) -> Problem:
    """One problem of several: parameters of one name are one, those fitted first give the starts.

    Each problem's other starts are tried beside the first of all the rest.
    """
    if len({each.units.position for each in problems}) > 1:
        raise HopformError("recordings in m and in rad are of two mechanisms: fit them apart")
    units = next((each.units for each in problems if each.quantity == "x1"), problems[0].units)
    parameters, known = dict[str, Parameter](), dict[str, float]()
    first, others = dict[str, float](), list[dict[str, float]]()
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
        new = [{name: start for name, start in each.items() if name not in first} for each in several]
        others += [each for each in new[1:] if each != new[0]]
        first |= new[0]
        known |= problem.known
    starts = [first, *(first | each for each in others)]
    return Problem(
        "robot", "x1, x2", tuple(each for p in problems for each in p.experiments), tuple(parameters.values()),
        tuple(starts), {n: v for n, v in known.items() if n not in parameters},
        tuple(dict.fromkeys(each for p in problems for each in p.statements)),
        tuple(each for p in problems for each in p.warnings),
        tuple(name for name in parameters if name[:2] in ("f1", "f2")),
        parts=max((p.parts for p in problems), key=len), motions=sum(p.motions for p in problems), units=units,
        scale=all(p.scale for p in problems),
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
    """Parameters that no recording identifies, with one that would."""
    has = {name.partition("@")[0] for name in names} | set(known)
    statements = list[str]()
    if "b2" not in has:
        statements.append("nothing was recorded of the body: a drop test gives k/m_s, b2, f2, L0 + c and impact_loss")
    elif "length" not in has:
        statements.append(
            "L0 + c and impact_loss cannot be identified from a body that is fixed to its spring: "
            "drop it onto the ground"
        )
    if "b1" not in has:
        statements.append("nothing was recorded of the actuator: a step response gives m_eff, b1, f1 and gamma2")
    return statements
