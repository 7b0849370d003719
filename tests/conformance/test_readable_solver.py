"""The solver that one can read against the C library: event lists, times, phases and states of random robots of every
model that ships, and what it refuses.

`python -m tests.conformance.test_readable_solver [COUNT [MODEL ...]]` counts the table of its docstring.
"""

import importlib
import sys
import tempfile
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
import pytest

import hopform
from hopform_solver import formulas
from hopform_solver import solver as readable
from tests import needs
from tests.conformance.random_stances import draw_stances
from tests.conformance.zoo import EQUATIONS, Case, Draw, cases
from tests.derived import SHIPPED, solver_of

pytestmark = needs.library
STIFFEST = 2e3
"""Of the robots that are drawn, the fastest pole times the horizon."""
SEED = 53
QUICK = {"hopper": 40, "servo": 40}
"""Robots in every run, by model; with slices 100 of each."""
SAME_TIME = 1e-9
"""[s]"""
HOPPER = hopform.load_robot("hopper_c").parameters


class Verdict(NamedTuple):
    """One motion in both: the first event that differs, by its kind or by more than SAME_TIME; else the largest
    difference of times [s], and of states in units of each coordinate's size.
    """

    first: str
    time: float
    state: float


class Pair(NamedTuple):
    """A model in both: its solver of the C library, and `solve` of its package."""

    solver: Any
    solve: Any


def pair_of(store: Path, name: str) -> Pair:
    """A model that ships."""
    solver = hopform.load_solver(name) if name == "hopper" else solver_of(store, SHIPPED / f"{name}.py")
    package = solver.Robot(**next(cases(name, 1, 1, STIFFEST)).robot).solver.package
    return Pair(solver, importlib.import_module(f"{package.name}.solver").solve)


def draw(name: str, count: int, seed: int = SEED) -> Any:
    """Random robots, every third under two to five steps of its input."""
    choose = Draw(f"steps of {name} {seed}")
    for n, case in enumerate(cases(name, seed, count, STIFFEST)):
        if n % 3 or not isinstance(case.u, float):
            yield case
            continue
        times = sorted(choose.uniform(0.0, 0.5) * case.horizon for _ in range(choose.randint(1, 4)))
        values = [case.u * choose.uniform(-1.0, 2.0) for _ in times]
        yield replace(case, u=((0.0, case.u), *zip(times, values, strict=True)))


def kinds(motion: Any) -> list[str]:
    return [*(event.kind for event in motion.events), motion.status]


def compared(pair: Pair, case: Case) -> Verdict:
    """One case in both."""
    robot = pair.solver.Robot(**case.robot)
    truth = pair.solver.solve_motion(robot, start=case.start, u=case.u, horizon=case.horizon)
    ours = pair.solve(robot.parameters, case.start, case.u, case.horizon)
    listed, exact = kinds(ours), kinds(truth)
    if listed != exact:
        n = next(
            (n for n, (a, b) in enumerate(zip(listed, exact, strict=False)) if a != b), min(len(listed), len(exact))
        )
        word = [" ".join([*own[n : n + 1]]) or "nothing" for own in (exact, listed)]
        return Verdict(f"{word[0]} is {word[1]}", np.nan, np.nan)
    times = [(a.time, b.time) for a, b in zip(ours.events, truth.events, strict=True)]
    worst = max(abs(a - b) for a, b in [*times, (ours.duration, truth.duration)])
    if worst > SAME_TIME:
        return Verdict("an event at another time", np.nan, np.nan)
    inner = [p.start + share * (p.end - p.start) for p in truth.phases for share in (0.25, 0.75) if p.end > p.start]
    inner = [*(t for t in inner if t <= min(ours.duration, truth.duration)), 0.0]
    states, exactly = np.array(ours.at(inner)), np.array(truth.at(inner))
    ends, exact_ends = (np.array([*motion.end])[:, np.newaxis] for motion in (ours, truth))
    sizes = np.maximum(np.abs(np.hstack([exactly, exact_ends])).max(axis=1, keepdims=True), 1e-3)
    error = (np.abs(np.hstack([states - exactly, ends - exact_ends])) / sizes).max()
    assert ours.end._fields == truth.end._fields
    return Verdict("", float(worst), float(error))


def tally(pair: Pair, name: str, count: int) -> list[Verdict]:
    return [compared(pair, case) for case in draw(name, count)]


@pytest.mark.parametrize(
    ("name", "count"),
    [*QUICK.items(), *(pytest.param(name, 100, marks=pytest.mark.sliced) for name in EQUATIONS)],
)
def test_event_lists_times_and_states_are_those_of_c(store, name, count):
    """Of 99 % of the robots: the lists are equal, and every time to 1e-9 s."""
    verdicts = tally(pair_of(store, name), name, count)
    misses = [each.first for each in verdicts if each.first]
    assert len(misses) <= count // 100, misses
    assert np.nanmax([each.state for each in verdicts]) <= 1e-8


@pytest.mark.parametrize("count", [150, pytest.param(2000, marks=pytest.mark.sliced)])
def test_degenerate_stances_are_those_of_c(store, count):
    """Over all orders of magnitude, some of them degenerate: triple poles, thresholds met exactly, twins."""
    pair, verdicts = pair_of(store, "hopper"), []
    for problem in draw_stances(SEED, count):
        robot = {name: float(problem[name]) for name in HOPPER._fields if name in problem.dtype.names}
        start = {name: float(problem[name]) for name in ("v1", "v2", "y")}
        case = Case(SHIPPED / "hopper.py", robot, start, float(problem["u"]), float(problem["horizon"]))
        verdicts.append(compared(pair, case))
    misses = [each.first for each in verdicts if each.first]
    assert len(misses) <= count // 100, misses


@pytest.mark.parametrize(
    ("start", "u"),
    [
        ({"v2": 0.5}, 0.0),  # the leg extends: a take-off at 0
        ({"v1": 0.2, "v2": 0.2}, 0.0),  # it neither extends nor compresses
        ({"x1": 0.0, "v1": -0.3, "v2": -1.0}, 0.0),  # into a stop
        ({"x1": 0.08, "v1": 0.0, "v2": -1.0}, 3.0),  # pushed onto one
        ({"x1": 0.03, "x2": 0.43 + 1e-16, "v2": -1.0}, 0.0),  # no compression, but for rounding
        ({"v2": 0.0, "y": 0.02}, 0.0),  # both at rest
        ({}, 0.0),  # the same, while the leg carries nothing
    ],
)
@pytest.mark.parametrize("f1", [0.0, 0.78])
def test_what_a_start_decides_is_what_c_decides(start, u, f1):
    """Without friction the actuator is on its threshold: where it goes depends on what the body does."""
    robot = replace(hopform.load_robot("hopper_c"), f1=f1)
    truth = hopform.solve_motion(robot, start=start, u=u)
    ours = readable.solve(robot.parameters, start, u)
    assert kinds(ours) == kinds(truth)
    assert [phase[2:4] for phase in ours.phases] == [phase[2:4] for phase in truth.phases]
    np.testing.assert_allclose([ours.duration, *ours.end], [truth.duration, *truth.end], rtol=0.0, atol=SAME_TIME)


def test_phases_are_those_of_c(store):
    """Modes, inputs and states at the start of each, under steps of the input and at the limits of a law."""
    solver, solve = pair_of(store, "servo")
    at_limit = 0
    for case in draw("servo", 20):
        robot = solver.Robot(**case.robot)
        truth = solver.solve_motion(robot, start=case.start, u=case.u, horizon=case.horizon)
        ours = solve(robot.parameters, case.start, case.u, case.horizon)
        assert [phase[2:5] for phase in ours.phases] == [phase[2:5] for phase in truth.phases], case
        for own, exact in zip(ours.phases, truth.phases, strict=True):
            np.testing.assert_allclose(own[:2], exact[:2], rtol=0.0, atol=SAME_TIME)
            np.testing.assert_allclose(own.state, exact.state, rtol=1e-9, atol=1e-9)
            at_limit += own.mode_2 != 0
    assert at_limit > 5


# ---- a planted fault is seen ----

USED = (
    "drive_of", "rates_of", "motion_of_both", "motion_of_mass_1", "motion_of_mass_2", "state_at", "free_accelerations",
    "friction_of", "excess_of", "contact_of", "residue", "split",
)  # fmt: skip
"""Formulas that a stance of the hopper reads."""
UNREAD = {"damping", "Wdd"}
"""Of their results what no motion reads: the ledger and derivatives do."""


def body_at_rest() -> Any:
    """Cases in which the body hangs in balance, held by its friction, while the actuator slips and pulls it loose."""
    for case in draw("hopper", 8, 1):
        robot = case.robot | {"f2": 2.0, "f2_excess": 1.0, "f1": 0.3, "x1_min": -0.2, "x1_max": 0.2}
        y = robot["m_s"] * robot["g"] / robot["k"]
        for v1 in (-0.4, 0.4):
            yield replace(case, robot=robot, start={"x1": 0.0, "v1": v1, "y": y}, u=0.0, horizon=0.5)


def negated(function: Any, member: str, seen: set[str]) -> Any:
    """A formula with the wrong sign in one of its results; `seen` takes the names of those that were ever not 0."""

    def wrong(*inputs: Any) -> Any:
        result = function(*inputs)
        members = result._asdict() if hasattr(result, "_fields") else {"": result}
        seen.update(name for name, value in members.items() if np.any(value != 0.0))
        if member not in members:
            return result
        return result._replace(**{member: -members[member]}) if member else -result

    return wrong


def differs(pair: Pair, case: Case) -> bool:
    try:
        verdict = compared(pair, case)
    except (ValueError, ArithmeticError):
        return True
    return bool(verdict.first) or verdict.state > 1e-8


@pytest.mark.parametrize("name", needs.the_first(USED))
def test_a_wrong_sign_in_a_formula_is_seen(store, name):
    """In each result of each formula: some motion differs from that of C, and without it none does."""
    pair, function, seen = pair_of(store, "hopper"), getattr(formulas, name), set[str]()
    tried = [*draw("hopper", 24), *body_at_rest()]

    def found(member: str) -> bool:
        wrong = negated(function, member, seen)
        modes = [mode._replace(motion=wrong) if mode.motion is function else mode for mode in readable.MODES]
        rates = {limit: wrong if each is function else each for limit, each in readable.RATES.items()}
        with (
            patch.object(formulas, name, wrong), patch.object(readable, "MODES", modes),
            patch.object(readable, "RATES", rates),
            patch.object(readable, "MOST_PHASES", 60), np.errstate(all="ignore"),
        ):  # fmt: skip
            return any(differs(pair, case) for case in tried)

    assert not found("none of them")
    assert seen
    assert {member for member in sorted(seen) if not found(member)} <= UNREAD


# ---- what is asked, and what is refused ----


def test_steps_that_move_nothing_are_no_part_of_a_rest():
    """Held under steps of the current: the rest began before them; one that moves the actuator ends it."""
    robot = hopform.load_robot("hopper_c")
    for last in (0.1, 3.0):
        steps, start = ((0.0, 0.0), (0.9, 0.05), (1.0, last)), {"y": 0.02}
        truth = hopform.solve_motion(robot, start=start, u=steps)
        ours = readable.solve(HOPPER, start, steps)
        assert kinds(ours) == kinds(truth) and len(ours.phases) == len(truth.phases)
        assert ours.duration == pytest.approx(truth.duration, abs=SAME_TIME)
        assert (ours.status == "rest") == (last < 1.0)


def test_a_cap_on_phases_leaves_what_was_found(monkeypatch):
    monkeypatch.setattr(readable, "MOST_PHASES", 5)
    start, u = {"v2": -0.5}, 1.0
    truth = hopform.solve_motion(hopform.load_robot("hopper_c"), start=start, u=u, max_phases=5)
    ours = readable.solve(HOPPER, start, u)
    assert kinds(ours) == kinds(truth) and ours.status == "too_many_phases"
    assert ours.duration == pytest.approx(truth.duration, abs=SAME_TIME)


def test_the_state_at_a_time_has_the_shape_of_the_times():
    motion = readable.solve(HOPPER, {"v2": -1.93}, u=2.0)
    assert isinstance(motion.at(0.05).x2, float) and motion.at(motion.duration) == motion.end
    times = np.linspace(0.0, motion.duration, 12).reshape(3, 4)
    assert motion.at(times).v1.shape == (3, 4) and motion.at(times).x2[1, 2] == motion.at(times[1, 2]).x2
    for t in (-1e-9, motion.duration + 1e-9, np.nan):
        with pytest.raises(ValueError, match="t must be within 0"):
            motion.at(t)
    rest = readable.solve(HOPPER, {"y": 0.02})
    assert rest.status == "rest" and rest.at(rest.duration + 1.0) == rest.end


@pytest.mark.parametrize(
    ("start", "more", "message"),
    [
        ({"v3": 1.0}, {}, "start may have x1, v1, x2, v2, y"),
        ({"x2": 0.4, "y": 0.0}, {}, "one of x2 and y"),
        ({"x1": -0.1}, {}, "start x1 must be within the stops 0.0 .. 0.08, got -0.1"),
        ({"x2": 0.5}, {}, "the contact must not pull at the start"),
        ({}, {"u": [(0.1, 1.0)]}, "the times of u must begin at 0"),
        ({}, {"u": [(0.0, 1.0), (0.0, 2.0)]}, "the times of u must begin at 0 and increase"),
        ({}, {"u": []}, "the times of u"),
        ({}, {"horizon": 0.0}, "horizon must be > 0 s"),
        ({}, {"samples": 0}, "samples >= 1"),
    ],
)
def test_what_no_motion_can_start_from_is_refused(start, more, message):
    with pytest.raises(ValueError, match=message):
        readable.solve(HOPPER, start, **more)


def test_a_parameter_out_of_its_domain_is_refused():
    with pytest.raises(ValueError, match="k must be > 0"):
        readable.solve(HOPPER._replace(k=-1.0), {"v2": -1.0})


# ---- the table of the docstring ----


def table(store: Path, count: int, names: list[str]) -> str:
    """Of each model how many lists are equal, the largest difference of times there, and what the others miss."""
    lines = [f"    {'model':<14} {'equal':>6} of {count:>5}  {'times [s]':>9}  misses"]
    for name in names:
        verdicts = tally(pair_of(store, name), name, count)
        misses = Counter(each.first for each in verdicts if each.first)
        said = "; ".join(f"{number}: {miss}" for miss, number in misses.most_common())
        worst = np.nanmax([each.time for each in verdicts])
        lines.append(f"    {name:<14} {count - misses.total():>6}    {'':>5}  {worst:9.1e}  {said}".rstrip())
    return "\n".join(lines)


if __name__ == "__main__":
    asked = sys.argv[1:] or ["1000"]
    with tempfile.TemporaryDirectory() as folder:
        print(table(Path(folder), int(asked[0]), asked[1:] or list(EQUATIONS)))
