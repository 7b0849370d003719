"""Derivatives of a joint under steps of its current against 50 digits: by every parameter, by the input of each step and
by its time. What is compared is the error over max(1, condition number): how much larger the exact derivatives change
than their inputs where these are off by one part in 1e20.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from mpmath import mp

from hopform import Solver, load_solver
from hopform._solver.package import LegState, column_of_step, column_of_step_time
from tests.derived import SHIPPED, built
from tests.oracle.joint import DIGITS, PARAMETERS, Answer, Grazing, Joint

OFF = 1e-20
LARGEST_ERROR = 1e-12


@pytest.fixture(scope="module")
def joint(store) -> Solver:
    return load_solver(built(store, SHIPPED / "joint.py"))


@dataclass(frozen=True)
class Draw:
    """A joint: place and velocity at the start, parameters, currents and times of the steps, horizon."""

    start: tuple[float, float]
    parameters: tuple[float, ...]
    currents: tuple[float, ...]
    times: tuple[float, ...]
    horizon: float

    def sizes(self) -> np.ndarray:
        """What each input is compared with: of the start 1 rad and 1 rad/s, of a step's time its length."""
        J, k, q_0, b, F_p, F_m, F_sp, F_sm, k_t, load = (abs(each) for each in self.parameters)
        friction = max(F_p, F_m)
        of = (
            J,
            max(k, 0.1),
            max(q_0, 0.1),
            max(b, 1e-3),
            F_p,
            F_m,
            *(2 * [max(friction, F_sp, F_sm)]),
            k_t,
            max(load, 0.01),
        )
        steps = len(self.currents)
        return np.array([1.0, 1.0, *of, *(steps * [1.0]), *((steps - 1) * [self.horizon / steps])])


def drawn(seed: int, steps: int) -> Draw:
    """A joint from nearly free to overdamped, with friction that is higher at rest in half of them."""
    rng = np.random.default_rng((59, seed))
    J = 0.031 * 10 ** rng.uniform(-0.7, 0.7)
    k = 0.0 if rng.random() < 0.3 else J * 10 ** rng.uniform(-1, 3)
    b = J * 10 ** rng.uniform(-2, 2) if rng.random() < 0.8 else 2 * np.sqrt(J * k)  # nearly a double pole
    F_p, F_m = 0.042 * 10 ** rng.uniform(-0.7, 0.5, 2)
    F_sp, F_sm = rng.uniform(0, 0.6, 2) * (F_p, F_m) if rng.random() < 0.5 else (0.0, 0.0)
    k_t, load, q_0 = 0.1 * 10 ** rng.uniform(-0.3, 0.3), rng.uniform(-0.03, 0.03), rng.uniform(-0.2, 0.2)
    lengths = 0.02 * rng.uniform(0.5, 1.5, steps)
    times = np.concatenate(([0.0], np.cumsum(lengths)))
    currents = rng.uniform(-1.2, 1.2, steps) * (F_p + F_m) / k_t
    start = float(rng.uniform(-0.3, 0.3)), float(rng.uniform(-2, 2))
    parameters = tuple(map(float, (J, k, q_0, b, F_p, F_m, F_sp, F_sm, k_t, load)))
    return Draw(start, parameters, tuple(currents.tolist()), tuple(times[:-1].tolist()), float(times[-1]))


def exact(draw: Draw, off: int = 0) -> Answer:
    """The reference; with every input off by one part in 1e20, up or down, where a seed is given."""
    with mp.workdps(DIGITS + 10):
        signs = np.random.default_rng(off).choice((-1, 1), 200) if off else np.zeros(200, int)

        def moved(values, first):
            return [mp.mpf(value) * (1 + mp.mpf(int(signs[first + n])) * mp.mpf(OFF)) for n, value in enumerate(values)]

        parts = moved(draw.start, 0), moved(draw.parameters, 2), moved(draw.currents, 12), moved(draw.times, 100)
        return Joint(*parts, draw.horizon).solve()


def matrix(answer: Answer) -> np.ndarray:
    """Rows T, q, v by the reference's inputs, which keep their digits."""
    return np.array([answer.T.by, answer.q.by, answer.v.by], dtype=object)


def engine(joint: Solver, draw: Draw) -> tuple[int, np.ndarray]:
    """The phases' events and the same rows as the library gives them."""
    robot = joint.Robot(**dict(zip(PARAMETERS, draw.parameters, strict=True)))
    of = robot.solver
    q_0 = draw.parameters[2]
    state = LegState(draw.start[0], draw.start[1], 0.0, draw.start[0] - q_0)
    steps = tuple(zip(draw.times, draw.currents, strict=True))
    found = of.compiled().solve_stance(robot.parameters, state, steps, draw.horizon, 4096, np.dtype(float))
    count = len(steps)
    codes = [0, 1, 2, *(5 + robot.parameters._fields.index(name) for name in PARAMETERS)]  # x1, v1, y, and behind u
    codes += [column_of_step(of.package, n) for n in range(count)]
    codes += [column_of_step_time(of.package, n) for n in range(1, count)]
    T, x1, v1 = found.sensitivities(codes)[:3]
    rows = np.stack((T, x1, v1))
    by_y = rows[:, 2]
    rows[:, 0] += by_y  # place at the start, and with it the stretch
    rows[:, 3 + PARAMETERS.index("q_0")] -= by_y
    return len(list(found.events())), np.delete(rows, 2, axis=1)


def error_of(joint: Solver, draw: Draw) -> tuple[float, float]:
    """The largest error over max(1, condition number), and that number; Grazing for a draw that is excluded."""
    found = exact(draw)
    sizes = draw.sizes()
    with mp.workdps(DIGITS):
        true = matrix(found) * sizes
        other = matrix(exact(draw, off=1)) * sizes
        largest = np.array([max(*(abs(each) for each in row), mp.mpf(10) ** -300) for row in true])
        condition = max(float(max(abs(row)) / size / OFF) for row, size in zip(other - true, largest, strict=True))
        events, ours = engine(joint, draw)
        assert events >= found.events
        errors = [
            float(max(abs(mp.mpf(float(each)) - it) for each, it in zip(row, exactly, strict=True)) / size)
            for row, exactly, size in zip(ours * sizes, true, largest, strict=True)
        ]
    return max(errors) / max(1.0, condition), condition


def errors(joint: Solver, seeds: range, steps: int) -> tuple[list[float], int]:
    """Those of the draws that do not graze, and how many do."""
    found, grazing = [], 0
    for seed in seeds:
        try:
            found.append(error_of(joint, drawn(seed, steps))[0])
        except Grazing:
            grazing += 1
    return found, grazing


def test_few_steps_have_the_gradients_of_the_reference(joint):
    found, grazing = errors(joint, range(6), 6)
    assert grazing <= 2
    assert max(found) <= LARGEST_ERROR


@pytest.mark.sliced
@pytest.mark.parametrize("part", range(8))
def test_fifty_steps_have_the_gradients_of_the_reference(joint, part):
    """25 of 200 joints a part."""
    found, grazing = errors(joint, range(1000 + 25 * part, 1025 + 25 * part), 50)
    assert grazing <= 8
    assert max(found) <= LARGEST_ERROR


def test_the_reference_is_that_of_differences():
    """Its own chain rule, against central differences of its motions, which know no derivative."""
    draw = drawn(3, 6)
    with mp.workdps(DIGITS + 10):
        by = matrix(exact(draw))
        inputs = [*draw.start, *draw.parameters, *draw.currents, *draw.times[1:]]
        for n in range(0, len(inputs), 3):
            step, ends = mp.mpf(10) ** -18, []
            for sign in (1, -1):
                moved = [mp.mpf(value) for value in inputs]
                moved[n] += sign * step
                count = len(draw.currents)
                parts = moved[:2], moved[2:12], moved[12 : 12 + count], [mp.mpf(0), *moved[12 + count :]]
                answer = Joint(*parts, draw.horizon).solve()
                ends.append((answer.T.value, answer.q.value, answer.v.value))
            for row in range(3):
                difference = (ends[0][row] - ends[1][row]) / (2 * step)
                assert abs(difference - by[row, n]) <= mp.mpf(10) ** -25 * (1 + abs(by[row, n]))
