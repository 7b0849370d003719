"""All recordings of a robot: what they can tell, before anything is fitted, and their fit into one robot.

The spring is the same in drop tests and in step responses against it: one weighed mass gives the scale of every force.
Each recording counts by its own noise.

Before a fit, the intervals to expect are the bound of Cramer and Rao by the Fisher information,

    covariance >= (J^T J)^-1 sigma^2

at the values of a quick fit, with the noise that the samples show. A plan is the same of synthetic
recordings.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Unpack, cast

import numpy as np

from hopform import HopformError, Robot
from hopform._checks import Role
from hopform.extend import stream
from hopform.identify import _alternatives as alternatives
from hopform.identify import _estimation as estimation
from hopform.identify._drop import FREE, GROUND
from hopform.identify._estimation import Estimate, Solution
from hopform.identify._fits import Fit, Options, blind, fit
from hopform.identify._held import HELD
from hopform.identify._kinds import Recordings, problem_of, read_several
from hopform.identify._motion import Array, Values
from hopform.identify._nuisances import DELAY, with_nuisances
from hopform.identify._recordings import HOPPER, Recording, Units, flat_top, gaps_of, noise_of, outliers, quantum_of
from hopform.identify._rigs import UNITS
from hopform.identify._search import Problem, minimise
from hopform.identify._synthetic import hardest, record

KINDS = {"drop": GROUND, **HELD, "free": FREE}
"""Of each role its kind; a free drop comes late, since it shows least about its starts."""


def fit_robot(
    *,
    drops: Recordings = (),
    free_drops: Recordings = (),
    decays: Recordings = (),
    steps: Recordings = (),
    air: Recordings = (),
    known: Mapping[str, float] | None = None,
    **options: Unpack[Options],
) -> Fit:
    """All parameters that the recordings identify, from all of them together; `fit.robot(base)` puts them into a robot.

    drops: of the body onto the ground, actuator held; free_drops: the same, actuator free; decays: of a body fixed to
    its spring; steps: of the actuator against its spring, the body held; air: of the actuator with the leg in the air;
    in these three what moves is a slide, as `fit` has it, in the letters of the hopper. known: values of m_s, k, b2, f2,
    length (L0 + c), impact_loss, g, m_eff, b1, f1, gamma2, offset; without one that fixes forces the mass that moves is
    taken as 1 kg. options: `Options`.
    Raises HopformError where a recording cannot be what it is given as, or none is given.
    """
    handed = {"drops": drops, "decays": decays, "steps": steps, "air": air, "free_drops": free_drops}
    several = [read_several(some, name) for name, some in handed.items()]
    return fit(dict(zip(KINDS.values(), several, strict=True)), known, **options)


# ---- before a fit: telemetry, excitation, and the intervals to expect ----


class Telemetry(NamedTuple):
    """A recording as it was sampled: rate [Hz], duration [s], longest gap [s], noise, quantum and travel of its
    position [m], outliers, lowest and highest current [A].
    """

    source: str
    role: str
    samples: int
    duration: float
    rate: float
    gap: float
    noise: float
    quantum: float
    travel: float
    outliers: int
    lowest: float
    highest: float


class Check(NamedTuple):
    """Telemetry of each recording; the intervals to expect, in the order of the parameters; what is missing."""

    recordings: tuple[Telemetry, ...]
    expected: tuple[Estimate, ...]
    statements: tuple[str, ...]
    warnings: tuple[str, ...]
    units: Units = HOPPER


def check(of: Mapping[str, Sequence[Recording]], known: Values | None = None, at: Values | None = None) -> Check:
    """What recordings, by their role (drop, free, decay, step, air), can tell of a robot; at: values of parameters at
    which that is asked; if none, those of a quick fit, which must explain the recordings, else no interval is to be
    expected. Raises HopformError as `fit_robot` does.
    """
    problem = with_nuisances(problem_of({kind: of.get(role, ()) for role, kind in KINDS.items()}, known), DELAY)
    telemetry = tuple(_telemetry(each, role) for role, some in of.items() for each in some)
    quick = None if at is not None else minimise(problem)
    estimates, spread = expected(problem, quick or at or {}, explained=not quick or all(quick.explained))
    letters = (name.partition("@")[0] for name in spread.weak)
    helps = dict.fromkeys(_HELPS[letter] for letter in letters if letter in _HELPS)
    driven = [each for role in ("step", "air") for each in of.get(role, ())]
    odd = [each for one in telemetry for each in _odd(one)]
    warnings = (*problem.warnings, *odd, *map(_stopped, filter(flat_top, driven)), *_unexplained(quick, problem.units))
    promised = [CONDITION] if at is None else conditions(known or {})
    return Check(
        telemetry, estimates, (*promised, *problem.statements, *blind(spread), *helps), warnings, problem.units
    )


CONDITION = "these intervals hold if the model explains your rig; if it does not, a fit gives none"


def conditions(given: Values) -> list[str]:
    """What the intervals of a plan rest on."""
    known = [f"{name} = {value:.4g} {UNITS[name]}".rstrip() for name, value in given.items()]
    weighed = f"taken as known without an error: {', '.join(known)}"
    return [CONDITION, *([f"{weighed}; give your own by --known"] if known else [])]


# ---- a plan, before anything is recorded ----


class Step(NamedTuple):
    """A recording to be made: its test, its setting with value and unit, how long [s], and the parameters that are to be
    known within a tenth from it, each with the half width of its interval as a share, for the worst of the robots.
    """

    test: str
    setting: str
    value: float
    unit: str
    duration: float
    gives: Mapping[str, float]


class Plan(NamedTuple):
    """Recordings in the order in which they are made, and notes."""

    steps: tuple[Step, ...]
    statements: tuple[str, ...]


PLANNED = ("decay", "drop", "air", "step")
"""Tests in the order of a plan: first those that no drive can spoil."""
_DURATIONS = (1.0, 2.0, 4.0, 8.0)
_DRAWN, _FINE, _WORTH = 3, 0.01, 0.7
"""Robots that are drawn in the ranges beside both ends; shares: half width that is fine enough; of that of the shorter
recording below which a longer one is worth its time."""


def plan(robot: Robot, ranges: Mapping[str, tuple[float, float]], known: Values | None = None, seed: int = 0) -> Plan:
    """What to record of a robot of which some parameters are known as ranges only: in which order, how hard within
    stroke, travel and u_max for all robots in the ranges, and for how long.

    known: names and values of what is weighed; m_s and m_eff of the robot if none. HopformError for a range that is none.
    """
    rng, names = stream(Role.PLANS, seed), {each.name for each in robot.fields()}
    for name, pair in ranges.items():
        if name not in names or not pair[0] < pair[1]:
            raise HopformError(
                f"ranges must name parameters, each with LOW < HIGH, got {name} = {pair[0]!r} .. {pair[1]!r}"
            )
    ends = [{name: pair[end] for name, pair in ranges.items()} for end in (0, 1)] if ranges else [dict[str, float]()]
    drawn = [{name: float(rng.uniform(*pair)) for name, pair in ranges.items()} for _ in range(_DRAWN if ranges else 0)]
    robots = [replace(robot, **cast(Any, each)) for each in ends + drawn]
    given = dict(known or {"m_s": robot.m_s, "m_eff": robot.m_eff})
    steps, notes = list[Step](), conditions(given)
    for test in PLANNED:
        try:
            steps.append(_step_of(robots, test, given, seed))
        except HopformError as error:
            notes.append(f"{test}: cannot be planned: {error}")
    notes.append("record each at another amplitude or load, too: a model that holds has the same parameters there")
    return Plan(tuple(steps), tuple(notes))


def _step_of(robots: Sequence[Robot], test: str, given: Values, seed: int) -> Step:
    """The shortest recording of a test after which a longer one brings little."""
    best: Step | None = None
    for duration in _DURATIONS:
        name, value, unit = hardest(robots, test, duration)
        shares = [_shares(each, test, given, {name: value}, duration, seed) for each in robots]
        worst = {letter: max(one.get(letter, math.inf) for one in shares) for letter in shares[0]}
        step = Step(test, name, value, unit, duration, {n: each for n, each in worst.items() if each < 0.1})
        if best is not None and not any(step.gives[n] < _WORTH * best.gives.get(n, math.inf) and
                                        best.gives.get(n, math.inf) > _FINE for n in step.gives):  # fmt: skip
            break
        best = step
    assert best is not None
    return best


def _shares(
    robot: Robot, test: str, given: Values, setting: Mapping[str, float], duration: float, seed: int
) -> dict[str, float]:
    """Of each parameter the half width of the interval to expect, as a share of it."""
    recording = record(robot, test, duration=duration, seed=seed, **cast(Any, setting))
    letters = {field.name: getattr(robot, field.name) for field in robot.fields()} | {"length": robot.L0 + robot.c}
    mine = {name: letters[name] for name in given if name in KINDS[test].letters}
    estimates = check({test: [recording]}, mine, letters).expected
    return {each.name: 0.5 * (each.high - each.low) / abs(each.value) if each.value else math.inf
            for each in estimates if not each.own and each.name != "offset"}  # fmt: skip


def _stopped(recording: Recording) -> str:
    """What is said of a recording whose actuator stays at an extreme."""
    begin, end = flat_top(recording) or (0, 0)
    ends = f"{recording.time[begin]:.4g} to {recording.time[end]:.4g} s"
    return f"{recording.source}: x1 stays at an extreme from {ends}, which it meets at speed: a stop? stay within it"


def _unexplained(quick: Solution | None, units: Units) -> list[str]:
    """What is said of recordings that a quick fit does not explain."""
    if quick is None:
        return []
    unit, factor = units.shown("x1")
    several = zip(quick.experiments, quick.residuals, quick.explained, strict=True)
    return [
        f"{each.label}: a quick fit leaves rms {factor * estimation.rms(rest):.3g} {unit}, which is more than noise: no "
        "interval is to be expected"
        for each, rest, known in several if not known
    ]  # fmt: skip


_HELPS = {
    "m_s": "a weighed body (--known m_s), or decays with a weighed mass added, give m_s",
    "k": "a drop or a decay of a weighed body gives k",
    **dict.fromkeys(("b2", "f2"), "a decay over many half periods gives b2 and f2"),
    **dict.fromkeys(("length", "impact_loss"), "a drop onto the ground gives L0 + c and impact_loss"),
    "m_eff": "a step response against a known spring, or a known force constant, gives m_eff",
    "b1": "a step response of both signs and several sizes gives b1 and f1",
    "f1": "a current that creeps both ways, in the air, gives f1",
    "gamma2": "a step response of a weighed actuator, or against a known spring, gives gamma2",
}
"""The recording that tells a parameter."""


def expected(
    problem: Problem, at: Solution | Values, *, explained: bool
) -> tuple[tuple[Estimate, ...], estimation.Spread]:
    """The intervals that a problem's recordings would give, with the noise that their samples show; at: a fit, or values.

    They allow for causes of the sizes that the fit shows. Without one they are the mean over draws of the noise: each
    cause seems to have some size, not the same sign for all, so that together they take more than each of size 0 would.
    """
    quick = at if isinstance(at, Solution) else None
    some = quick.values if quick else cast(Values, at)
    values = {p.name: some.get(p.name, p.start) for p in problem.parameters}
    sigma = [noise_level(each.measured) for each in problem.experiments]
    _, rows = estimation.residuals(problem.experiments, problem.parameters, values)
    # Residuals of one standard deviation, so that the covariance is that of the noise.
    share = math.sqrt(1.0 - len(problem.parameters) / max(rows.shape[0], 1))
    rest = tuple(np.full(each.time.size, size * share) for each, size in zip(problem.experiments, sigma, strict=True))
    cost = float(rows.shape[0])
    solution = Solution(problem.parameters, values, rest, tuple(sigma), rows, cost, 1, experiments=problem.experiments)
    estimates, spread = estimation.estimates(solution, explained=explained, profiles=False)
    unseen = list[alternatives.Missed]()
    if explained:
        half = stream(Role.PLANS, 0).standard_normal((_NOISES // 2, rows.shape[0]))
        unseen = alternatives.missed(quick) if quick else alternatives.missed(solution, np.concatenate([half, -half]))
    estimates, spread, _ = alternatives.allowing(solution, estimates, spread, unseen)
    return estimates, spread


_NOISES = 64
"""Draws of the noise in pairs of either sign, so that a mean interval is as wide on both sides: 3 % of its width."""


def noise_level(values: Array) -> float:
    """Standard deviation of a position's noise [m], at least that of its quantum's rounding."""
    return max(noise_of(values), quantum_of(values) / math.sqrt(12.0), 1e-12)


def _telemetry(recording: Recording, role: str) -> Telemetry:
    x, time = recording.position("x1" if role in ("step", "air") else "x2"), recording.time
    u = recording.current() if recording.has_current() else np.zeros(1)
    return Telemetry(
        recording.source, role, time.size, float(time[-1] - time[0]), 1.0 / float(np.median(np.diff(time))),
        max((length for _, length in gaps_of(time)), default=0.0), noise_of(x), quantum_of(x), float(np.ptp(x)),
        int(np.count_nonzero(outliers(x))), float(u.min()), float(u.max()),
    )  # fmt: skip


_FEW_STEPS, _ONE_SIDED = 200.0, 0.1
"""Travel in quanta or standard deviations of noise that a fit wants; share of the largest current that the other
direction should have.
"""


def _odd(one: Telemetry) -> list[str]:
    """What is poor about a recording."""
    statements = list[str]()
    level = max(one.noise, one.quantum)
    if one.travel < _FEW_STEPS * level:
        statements.append(f"it moves by {one.travel / level:.0f} times its noise or quantum: let it move further")
    if one.outliers:
        statements.append(f"{one.outliers} samples are outliers: fit with --loss huber")
    if one.gap > 0.0:
        statements.append(f"a gap of {one.gap:.3g} s")
    down, up = -one.lowest, one.highest
    if one.role in ("step", "air", "free") and min(down, up) < _ONE_SIDED * max(down, up):
        statements.append(
            "the current has only one direction: friction and a constant load cannot be distinguished; record both directions"
        )
    return [f"{one.source}: {each}" for each in statements]
