"""Starts in the coordinates of a model's file, in C: the state of one, and back, in both precisions."""

import ctypes
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import hopform
from tests import needs
from tests.conformance.zoo import EQUATIONS, cases
from tests.derived import SHIPPED, solver_of

pytestmark = needs.library
DTYPES = np.dtype(np.float64), np.dtype(np.float32)
STATE_ERROR, EXTENDED = -3, -4
TOUCHES = 4
"""Units in the last place within which a contact counts as touched, and 0."""


class Library:
    """The C of a robot in a precision."""

    def __init__(self, robot: Any, dtype: np.dtype[Any]) -> None:
        library = robot.solver.compiled().library
        self.types, self.eps = library.types(dtype), float(np.finfo(dtype).eps)
        self.function = lambda name: library.function(name, self.types)
        self.plan = self.types.Plan()
        given = self.types.Robot(*robot.parameters)
        assert self.function("plan_init")(ctypes.byref(self.plan), ctypes.byref(given)) >= 0
        self.names = [name for name, _ in self.types.Start._fields_]

    def state(self, values: Any) -> tuple[int, Any]:
        start, state = self.types.Start(*values), self.types.State()
        status = self.function("state_of_start")(ctypes.byref(self.plan), ctypes.byref(start), ctypes.byref(state))
        return status, state

    def start(self, state: Any) -> list[float]:
        start = self.types.Start()
        assert self.function("start_of_state")(ctypes.byref(self.plan), ctypes.byref(state), ctypes.byref(start)) == 0
        return [getattr(start, name) for name in self.names]


def solver(store: Any, name: str) -> Any:
    return hopform.load_solver(name) if name == "hopper" else solver_of(store, SHIPPED / f"{name}.py")


LENGTH = {"sea": (), "leg_damper": ("L0", "c"), "hopper": ("L0", "c")}
"""What x2 - x1 is the sum of where y = 0, by hand, of models with two coordinates."""


@pytest.mark.parametrize("dtype", DTYPES, ids=str)
@pytest.mark.parametrize("name", needs.the_first([*EQUATIONS]))
def test_a_start_comes_back_within_two_units_of_its_scale(store, name, dtype):
    made = solver(store, name)
    for case in cases(name, 3, 40, 2e3):
        of = Library(made.Robot(**case.robot), dtype)
        assert of.names[::2] == [*case.start][: len(case.start) // 2]  # coordinate, velocity, coordinate, velocity
        given = [float(dtype.type(case.start[each])) for each in of.names]
        status, state = of.state(given)
        assert status == 0, (case, status)
        back = of.start(state)
        scale = max(map(abs, (*given[::2], *back[::2], state.y)))
        touches = TOUCHES if state.y == 0.0 else 0
        assert back[1::2] == given[1::2] and back[0] == given[0]
        assert np.all(np.abs(np.subtract(back, given)) <= (2 + touches) * of.eps * scale), case
        again, motion = of.state(back), hopform.solve_motion(made.Robot(**case.robot), start=case.start, dtype=dtype)
        assert again[0] == 0 and abs(again[1].y - state.y) <= 2 * of.eps * scale
        assert motion.phases[0].state._fields == tuple(of.names)


@pytest.mark.parametrize("dtype", DTYPES, ids=str)
@pytest.mark.parametrize("name", needs.the_first([*LENGTH][::-1]))
def test_the_compression_is_that_of_exact_arithmetic(store, name, dtype):
    made = solver(store, name)
    for case in cases(name, 5, 40, 2e3):
        of = Library(made.Robot(**case.robot), dtype)
        given = [float(dtype.type(case.start[each])) for each in of.names]
        parts = [Fraction(float(dtype.type(case.robot[each]))) for each in LENGTH[name]]
        exact = Fraction(given[0]) - Fraction(given[2]) + sum(parts)
        y = of.state(given)[1].y
        scale = max(map(abs, (given[0], given[2], *map(float, parts), float(exact))))
        allowed = (2 if y != 0.0 else TOUCHES + 2) * of.eps * scale
        assert abs(Fraction(y) - exact) <= Fraction(allowed), case


@pytest.mark.parametrize("dtype", DTYPES, ids=str)
def test_a_leg_that_touches_the_ground_has_no_compression(hopper_c, dtype):
    """From x2 = x1 + L0, rounded, whichever way; one ulp too high is no extended leg, a micron too high is one."""
    of, L0 = Library(hopper_c, dtype), dtype.type(0.4)
    for x1 in map(dtype.type, np.linspace(0.0, 0.08, 33)):
        touching = x1 + L0
        for height in (touching, np.nextafter(touching, dtype.type(0)), np.nextafter(touching, dtype.type(9))):
            status, state = of.state((x1, 0.0, height, -1.0))
            assert (status, state.y) == (0, 0.0), (x1, height)
        assert of.state((x1, 0.0, touching + dtype.type(1e-6), -1.0))[0] == EXTENDED
        assert of.state((x1, 0.0, touching - dtype.type(1e-6), -1.0))[1].y > 0.0
    assert of.state((0.081, 0.0, 0.3, -1.0))[0] == of.state((np.nan, 0.0, 0.3, -1.0))[0] == STATE_ERROR
    flies = of.types.State(0.01, 0.0, 1.5, -0.2)
    assert abs(of.start(flies)[2] - 0.61) < 4 * of.eps  # in flight a leg is extended, and has coordinates all the same


@pytest.mark.sliced
def test_what_is_fixed_does_not_move(store):
    """A joint has one mass: a state in which the other one moves is none of it."""
    of = Library(solver(store, "joint").Robot(), DTYPES[0])
    start, moves = of.types.Start(), of.types.State(0.1, 0.0, 0.5, 0.0)
    function = of.function("start_of_state")
    assert function(ctypes.byref(of.plan), ctypes.byref(moves), ctypes.byref(start)) == STATE_ERROR
    assert of.names == ["q", "q_dot"]
