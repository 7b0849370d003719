"""Model files of random elements, each derived anew: their motions are those of an integrator that reads the elements
as physics.
"""

import hashlib
import math
import pickle
from pathlib import Path

import pytest

import hopform
import hopform.hopping
from derive.model.equations import ModelError
from tests import needs
from tests.conformance.drawn_models import drawn
from tests.conformance.test_zoo import that_of_the_integrator
from tests.conformance.zoo import Draw, Scales, case
from tests.derived import model_of, solver_of

STARTS = 6
LEGS = 5, 30, 35
"""Seeds whose files have a contact."""
LAWS = 4, 20, 36
"""Seeds whose files have a law."""
AT_NIGHT = [pytest.param(seed, marks=pytest.mark.nightly) for seed in (*range(1, 10), *LEGS[1:], *LAWS[1:])]
BODY = """
m, k, L = (parameter(name, unit, name, "positive") for name, unit in (("m", "kg"), ("k", "N/m"), ("L", "m")))
h = coordinate("h", "m", m, "body")
gravity(h, 9.81)
contact(spring(L - h, k))
"""


def file_of_text(store: Path, text: str) -> Path:
    file = store / f"drawn_{hashlib.sha256(text.encode()).hexdigest()[:12]}.py"
    file.write_text(text, "utf-8")
    return file


@pytest.mark.parametrize("seed", [*needs.the_first([LAWS[0], LEGS[0]], 0), *AT_NIGHT])
def test_a_file_of_random_elements_moves_as_newton_s_law_says(store, seed):
    file, draw = file_of_text(store, drawn(seed)), Draw(f"start {seed}")
    solver = solver_of(store, file)
    for _ in range(STARTS):
        that_of_the_integrator(solver, case(file, draw, Scales()))


@pytest.mark.nightly
def test_a_leg_of_other_names_answers_to_them_and_to_those_of_a_stance(store):
    """A body on a leg alone, which is a mass on a spring until it takes off."""
    text = BODY.replace('"h", "m", m, "body"', '"h", "m", m, "body", velocity="rise"')
    solver = solver_of(store, file_of_text(store, f'"""A body on a leg."""\n\nfrom hopform.model import *\n{text}'))
    robot = solver.Robot(m=2.0, k=1500.0, L=0.3)
    stance = solver.solve_motion(robot, start={"h": 0.3, "rise": -1.5})
    assert stance.end.h == stance.end.x2 == stance.takeoff.h and stance.at(0.01).rise == stance.at(0.01).v2
    assert pickle.loads(pickle.dumps(stance.end)).h == stance.end.h  # noqa: S301
    rate, sinks = math.sqrt(1500.0 / 2.0), 2.0 * 9.81 / 1500.0
    lasts = (math.pi + 2.0 * math.atan2(rate * sinks, 1.5)) / rate
    assert stance.duration == pytest.approx(lasts, rel=1e-13)
    assert stance.sensitivities["rise", "k"] == stance.sensitivities["v2", "k"]
    assert stance.sensitivities["rise", "rise"] == pytest.approx(-1.0, rel=1e-12)
    assert stance.fly().at(0.01).h == stance.fly().at(0.01).x2
    many = solver.solve_motions(robot, start={"h": 0.3, "rise": [-1.5, -1.0]})
    assert many.end.h[0] == many.takeoff.h[0] == stance.end.h
    run = hopform.hopping.simulate(robot, [0.0], height=0.1)
    assert run.at(0.05).h == run.at(0.05).x2


def test_the_body_of_a_leg_must_not_be_called_as_its_actuator():
    with pytest.raises(ModelError, match=r"x1 with the velocity v1 is mass 2 of the leg, and x1, v1 are the other one"):
        model_of(BODY.replace('h = coordinate("h"', 'h = coordinate("x1"'))
