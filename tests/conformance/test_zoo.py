"""The mechanisms that ship against DOP853, restarted at every event, which shares nothing with the solver."""

import random
from typing import Any

import numpy as np
import pytest

import hopform
from tests import needs
from tests.conformance.zoo import ZOO, Case, cases
from tests.derived import SHIPPED, solver_of
from tests.oracle.numeric import Motion, integrate

pytestmark = needs.library
QUICK = ("hopper", "joint")
CASES = [
    pytest.param(name, count, stiffest, marks=() if name in QUICK and count == 20 else mark)
    for name in ZOO
    for count, stiffest, mark in (
        (20, 3e2, pytest.mark.sliced), (10, 1e4, pytest.mark.sliced), (200, 2e3, pytest.mark.nightly),
    )
]  # fmt: skip
ULPS, TRIES, FADED = 32, 60, 1e-6


def test_every_model_that_ships_is_in_the_zoo():
    assert {path.stem for path in SHIPPED.glob("*.py")} - {"__init__"} == set(ZOO)


def units(case: Case, truth: Motion) -> dict[str, float]:
    """Units of errors: the duration, and of each coordinate its largest size over the motion."""
    states = np.array([truth.at(t) for t in np.linspace(0.0, truth.duration, 33)] + [np.concatenate(truth.final)]).T
    sizes = np.maximum(np.abs(states).max(axis=1), 1e-3)
    return dict(zip(case.start, sizes.tolist(), strict=True)) | {"T": max(truth.duration, 1e-3)}


def condition(motion: Any, case: Case, unit: dict[str, float]) -> float:
    """By how much a relative change of all inputs moves an output, in its unit; 1 where there are no derivatives."""
    sensitivities = motion.sensitivities
    largest = max(abs(u) for _, u in case.steps)
    given = case.robot | case.start | {"u": largest, "target": largest}
    worst = 1.0
    for row in ("T", *case.start):
        moved = 0.0
        for column in sensitivities.columns:
            value = given.get(column, 0.0)
            moved += abs(sensitivities[row, column]) * abs(value if np.isfinite(value) else 0.0)
        worst = max(worst, moved / unit[row]) if np.isfinite(moved) else worst
    return worst


def resolved(truth: Motion) -> int:
    """How many events the integrator knows: it loses what has faded to a millionth of the largest velocity."""
    ends = [event.t for event in truth.events] + [truth.duration]
    n = len(truth.final[1])
    sizes = [
        max(float(np.abs(truth.at(t)[n:]).max()) for t in np.linspace(begin, end, 9))
        for begin, end in zip([0.0, *ends], ends, strict=False)
    ]
    faded = [index for index, size in enumerate(sizes[:-1]) if size < FADED * max(sizes)]
    return faded[0] if faded else len(ends)


def kinds(motion: Any) -> list[str]:
    return [*(event.kind for event in motion.events), motion.status]


@pytest.mark.parametrize(("name", "count", "stiffest"), CASES)
def test_a_motion_is_that_of_the_integrator(store, name, count, stiffest):
    """Events, ending, times and states in double precision, and in single precision."""
    solver = hopform.load_solver(name) if name == "hopper" else solver_of(store, SHIPPED / f"{name}.py")
    seen = set()
    for n, case in enumerate(cases(name, 1, count, stiffest)):
        truth = integrate(case.mechanism, case.q, case.v, case.steps, case.horizon, 0.5 / case.fastest)
        robot = solver.Robot(**case.robot)
        how = {"start": case.start, "u": case.u, "horizon": case.horizon}
        motion = solver.solve_motion(robot, **how)
        unit, known = units(case, truth), resolved(truth)
        allowed = 1e-10 * condition(motion, case, unit)
        assert kinds(motion)[:known] == [*truth.kinds, truth.status][:known], (n, case)
        for event, exact in zip(motion.events[:known], truth.events[:known], strict=True):
            assert abs(event.time - exact.t) <= allowed * unit["T"], (n, case)
        assert abs(motion.duration - truth.duration) <= allowed * unit["T"], (n, case)
        final = dict(zip(case.start, np.concatenate(truth.final), strict=True))
        for key, value in final.items():
            assert abs(getattr(motion.end, key) - value) <= allowed * unit[key], (n, key, case)
        seen.update(truth.kinds, [truth.status])
        assert_single_precision(solver, robot, case, unit, allowed * 1e5)
    assert len(seen) > 2 or count < 20


def assert_single_precision(solver: Any, robot: Any, case: Case, unit: dict[str, float], allowed: float) -> None:
    """Its list is that of a neighbour whose inputs differ by 32 units in their last place, and so are its states."""
    how = {"u": case.u, "horizon": case.horizon}
    single = solver.solve_motion(robot, start=case.start, **how, dtype="float32")
    choose, eps = random.Random(1), float(np.finfo(np.float32).eps)

    for _ in range(TRIES):
        factors: dict[float, float] = {}

        def moved(value: float, factors: dict[float, float] = factors) -> float:
            """Numbers that are equal stay so: a start at a stop, levels of friction."""
            return value * factors.setdefault(abs(value), 1.0 + choose.uniform(-1.0, 1.0) * ULPS * eps)

        start = {key: moved(value) for key, value in case.start.items()}
        steps = [(float(np.float32(t)), moved(u)) for t, u in case.steps]  # a condition counts no times
        try:
            other = solver.Robot(**{key: moved(value) for key, value in case.robot.items()})
            near = solver.solve_motion(other, start=start, **how | {"u": steps})
        except hopform.HopformError:  # a start that has moved out of its stops
            continue
        if kinds(near) == kinds(single) and abs(near.duration - single.duration) <= allowed * unit["T"]:
            assert all(
                abs(getattr(near.end, key) - getattr(single.end, key)) <= allowed * unit[key] for key in case.start
            )
            return
    raise AssertionError((kinds(single), case))
