"""Model files of random elements, each derived anew: their motions are those of an integrator that reads the elements
as physics.
"""

import hashlib
from pathlib import Path

import pytest

import hopform
from derive.__main__ import main
from tests.conformance.drawn_models import case, drawn
from tests.conformance.test_zoo import condition, kinds, resolved, units
from tests.objects import once
from tests.oracle.numeric import integrate

STARTS = 6


def built(store: Path, text: str) -> Path:
    """The folder of a file's solver, without a library: printed Python solves."""
    name = f"drawn_{hashlib.sha256(text.encode()).hexdigest()[:12]}"

    def make(aside: Path) -> None:
        file = aside.with_suffix(".py")
        file.write_text(text, "utf-8")
        assert main(["--model", str(file), "--out", str(aside)]) == 0

    return once(store / name, make)


@pytest.mark.filterwarnings("ignore:hopform uses its Python back end")
@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=() if seed in (0, 1) else pytest.mark.sliced) for seed in range(12)]
)
def test_a_file_of_random_elements_moves_as_newton_s_law_says(store, seed):
    made, stiffness = drawn(seed)
    solver = hopform.load_solver(built(store, made.text))
    for n in range(STARTS):
        each = case(made, stiffness, STARTS * seed + n)
        truth = integrate(each.mechanism, each.q, each.v, [(0.0, each.u)], each.horizon, 0.5 / each.fastest)
        robot = solver.Robot(**{field.name: each.robot[field.name] for field in solver.Robot.fields()})
        motion = solver.solve_motion(robot, start=each.start, u=each.u, horizon=each.horizon)
        unit, known = units(each, truth), resolved(truth)
        allowed = 1e-10 * condition(motion, each, unit)
        assert kinds(motion)[:known] == [*truth.kinds, truth.status][:known], (n, made.text, each)
        for event, exact in zip(motion.events[:known], truth.events[:known], strict=True):
            assert abs(event.time - exact.t) <= allowed * unit["T"], (n, made.text, each)
        for key, value in zip(each.start, [*truth.final[0], *truth.final[1]], strict=True):
            assert abs(getattr(motion.end, key) - value) <= allowed * unit[key], (n, key, made.text, each)
