"""The height of the body is x_2 = (x_1 - y) + (L_0 + c) wherever it is given, to the bit, in both precisions."""

from typing import Any

import numpy as np
import pytest

import hopform
from hopform import Robot
from hopform_solver import formulas
from hopform_solver import records as solver_records

HOPPER = hopform.load_robot("hopper_c")
COUNT = 60


def robots() -> list[Robot]:
    """Legs of many lengths, whose L_0, c and sum take all digits."""
    draw = np.random.default_rng(11)
    lengths, offsets = draw.uniform(0.1, 0.9, COUNT), draw.uniform(-0.05, 0.05, COUNT)
    named = HOPPER.parameters._asdict()
    return [Robot(**named | {"L0": float(L0), "c": float(c)}) for L0, c in zip(lengths, offsets, strict=True)]


ROBOTS = robots()
VELOCITIES = np.random.default_rng(12).uniform(-3.0, -0.5, COUNT)


def expected(robot: Robot, dtype: Any, x1: Any, y: Any) -> Any:
    """The rule, every operation rounded to the precision."""
    real = np.dtype(dtype).type
    rounded = [np.asarray(value, dtype) for value in (x1, y)]
    height = (rounded[0] - rounded[1]) + (real(robot.L0) + real(robot.c))
    assert height.dtype == dtype
    return height


def is_same(one: Any, other: Any, dtype: Any) -> bool:
    """Bit for bit, and nothing but numbers of the precision."""
    exact, given = np.asarray(one, np.float64), np.asarray(other, np.float64)
    return exact.tobytes() == given.tobytes() and np.array_equal(given, given.astype(dtype))


precisions = pytest.mark.parametrize("dtype", [np.float64, np.float32])


@precisions
def test_a_stance_and_a_batch_give_one_height(dtype):
    fields = {name: np.array([getattr(robot, name) for robot in ROBOTS]) for name in ("L0", "c")}
    batch = hopform.solve_stances(HOPPER, v2=VELOCITIES, u=2.0, **fields, dtype=dtype)
    single = [
        hopform.solve_stance(robot, v2=float(v2), u=2.0, dtype=dtype)
        for robot, v2 in zip(ROBOTS, VELOCITIES, strict=True)
    ]
    for stance, robot in zip(single, ROBOTS, strict=True):
        y = stance._solved.outcome()[2].y
        assert is_same(expected(robot, dtype, stance.end.x1, y), stance.end.x2, dtype)
    heights = [stance.end.x2 for stance in single]
    assert is_same(heights, batch.end.x2, dtype)


@precisions
def test_states_along_a_stance_have_it_too(dtype):
    for robot, v2 in zip(ROBOTS, VELOCITIES, strict=True):
        stance = hopform.solve_stance(robot, v2=float(v2), u=2.0, dtype=dtype)
        t, along = stance.grid(40)
        columns = solver_records.LegState(*np.empty((4, t.size), dtype))
        stance._solved.grid(stance.duration / (t.size - 1), columns)
        assert is_same(expected(robot, dtype, columns.x1, columns.y), along.x2, dtype)
        at = stance.at(t)
        assert is_same(expected(robot, dtype, at.x1, stance.compression(t)), at.x2, dtype)
        one = stance.at(float(t[7]))
        assert is_same(at.x2[7], one.x2, dtype)
        for phase, row in zip(stance.phases, stance._solved.phase_rows(), strict=True):
            assert is_same(expected(robot, dtype, row[1].x1, row[1].y), phase.state.x2, dtype)


@precisions
def test_a_flight_has_it_too(dtype):
    for robot in ROBOTS:
        flight = hopform.solve_flight(robot, x1=0.05, v1=0.1, v2=1.9, dtype=dtype)
        end = flight._solved.flight.end
        assert is_same(expected(robot, dtype, end.x1, end.y), flight.end.x2, dtype)
        t = np.linspace(0.0, flight.duration, 20).astype(dtype)
        t[-1] = flight.duration
        states = flight._solved.state_at(t)
        assert is_same(expected(robot, dtype, states.x1, states.y), flight.at(t).x2, dtype)


@precisions
def test_the_formula_of_the_derivation_is_the_rule(dtype):
    for robot in ROBOTS:
        rounded = solver_records.Robot(*(np.dtype(dtype).type(value) for value in robot.parameters))
        x1, y = (np.random.default_rng(13).uniform(0.0, 0.1, (2, 50))).astype(dtype)
        assert is_same(expected(robot, dtype, x1, y), formulas.second_position(rounded, x1, y), dtype)


@precisions
def test_a_height_given_in_single_precision_starts_a_batch_where_it_starts_a_stance(dtype):
    draw = np.random.default_rng(14)
    x1, x2 = draw.uniform(0.0, 0.05, COUNT).astype(np.float32), draw.uniform(0.35, 0.37, COUNT).astype(np.float32)
    batch = hopform.solve_stances(HOPPER, v2=-1.5, x1=x1, x2=x2, dtype=dtype)
    durations = [
        hopform.solve_stance(HOPPER, v2=-1.5, x1=float(a), x2=float(b), dtype=dtype).duration
        for a, b in zip(x1, x2, strict=True)
    ]
    assert is_same(durations, batch.duration, dtype)
