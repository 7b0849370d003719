"""The mechanisms that ship against DOP853, restarted at every event, which shares nothing with the solver."""

import random
from typing import Any

import numpy as np
import pytest

import hopform
from tests import needs
from tests.conformance.zoo import EQUATIONS, Case, cases
from tests.derived import SHIPPED, solver_of
from tests.oracle.numeric import Motion, integrate

pytestmark = needs.library
QUICK = ("joint",)
CASES = [
    pytest.param(name, count, stiffest, marks=() if name in QUICK and count == 20 else mark)
    for name in EQUATIONS
    for count, stiffest, mark in (
        (20, 3e2, pytest.mark.sliced), (10, 1e4, pytest.mark.sliced), (200, 2e3, pytest.mark.nightly),
    )
]  # fmt: skip
ULPS, TRIES, FADED = 32, 60, 1e-6


def test_every_model_that_ships_is_in_the_zoo():
    assert {path.stem for path in SHIPPED.glob("*.py")} - {"__init__"} == set(EQUATIONS)


@pytest.mark.parametrize("name", EQUATIONS)
def test_the_elements_of_a_file_are_its_equations(name):
    """Masses, forces, levels of friction and stops, with other numbers each time, and what the leg carries."""
    draw = np.random.default_rng(1)
    for case in cases(name, 2, 20, 1e6):
        made, given = case.mechanism, {**case.robot, "clip": np.clip, "inf": np.inf}
        q, v = draw.normal(size=(2, len(case.q)))
        here = given | dict(zip(case.start, [*q, *v], strict=True)) | {"u": draw.normal()}
        said = {of: [eval(each, here) for each in texts] for of, texts in EQUATIONS[name].items()}  # noqa: S307
        forces = made.force(q, v, here["u"])
        found = {
            mass.name: [mass.inertia, force, *mass.sliding, *mass.level, mass.low, mass.high]
            for mass, force in zip(made.masses, forces, strict=True)
        }
        found |= {"N": [made.contact(q, v)]} if made.contact else {}
        assert found.keys() == said.keys()
        for of, numbers in said.items():
            scale = sum(abs(value) for value in forces) + 1e-300
            np.testing.assert_allclose(found[of], numbers, rtol=1e-9, atol=1e-9 * scale, err_msg=of)


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


def that_of_the_integrator(solver: Any, case: Case) -> tuple[Motion, dict[str, float], float]:
    """The integrator's motion, which the solver's is; the units of its numbers, and by how much of them it may differ."""
    longest = 0.1 / case.fastest  # a contact force may dip below zero for a short time
    truth = integrate(case.mechanism, case.q, case.v, case.steps, case.horizon, longest)
    motion = solver.solve_motion(solver.Robot(**case.robot), start=case.start, u=case.u, horizon=case.horizon)
    unit, known = units(case, truth), resolved(truth)
    allowed = 1e-10 * condition(motion, case, unit)
    assert kinds(motion)[:known] == [*truth.kinds, truth.status][:known], case
    for event, exact in zip(motion.events[:known], truth.events[:known], strict=True):
        assert abs(event.time - exact.t) <= allowed * unit["T"], case
    assert abs(motion.duration - truth.duration) <= allowed * unit["T"], case
    for key, value in zip(case.start, np.concatenate(truth.final), strict=True):
        assert abs(getattr(motion.end, key) - value) <= allowed * unit[key], (key, case)
    return truth, unit, allowed


@pytest.mark.parametrize(("name", "count", "stiffest"), CASES)
def test_a_motion_is_that_of_the_integrator(store, name, count, stiffest):
    """Events, ending, times and states in double precision, and in single precision."""
    solver = hopform.load_solver(name) if name == "hopper" else solver_of(store, SHIPPED / f"{name}.py")
    seen = set()
    for case in cases(name, 1, count, stiffest):
        truth, unit, allowed = that_of_the_integrator(solver, case)
        seen.update(truth.kinds, [truth.status])
        assert_single_precision(solver, solver.Robot(**case.robot), case, unit, allowed * 1e5)
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
