"""The signs of docs/reference/signs.md are those of the equations of motion: each row of its table is derived again."""

import re
from pathlib import Path

import pytest
import sympy as sp

import hopform
from derive.model import quantities as Q
from derive.shipped import HOPPER

ROOT = next(folder for folder in Path(__file__).resolve().parents if (folder / "pyproject.toml").is_file())
PAGE = (ROOT / "docs" / "reference" / "signs.md").read_text("utf-8")
ROWS = re.findall(r"^\| `(\w+)` by `(\w+)` \| `([^`]+)` \|", PAGE, re.MULTILINE)

VALUES = dict(zip(("a1", "a2"), HOPPER.accelerations, strict=True)) | {
    "y": Q.x1 - Q.x2 + HOPPER.length,
    "N": HOPPER.stiffness * HOPPER.contact,
    "foot": Q.x2 - Q.x1 - HOPPER.length,
}
LETTERS = {name: symbol for name, symbol in vars(Q).items() if isinstance(symbol, sp.Symbol)}


@pytest.mark.parametrize(("value", "by", "printed"), ROWS, ids=[f"{value} by {by}" for value, by, _ in ROWS])
def test_a_derivative_of_the_page_on_signs_is_that_of_the_equations(value, by, printed):
    assert sp.expand(VALUES[value].diff(LETTERS[by]) - sp.sympify(printed, locals=LETTERS)) == 0


def test_the_page_on_signs_has_every_derivative_of_the_accelerations_by_state_current_and_friction():
    asked = {
        (value, name)
        for value in ("a1", "a2")
        for name in ("x1", "x2", "v1", "v2", "u", "g", "f1", "f2")
        if VALUES[value].diff(LETTERS[name]) != 0
    }
    assert asked <= {(value, by) for value, by, _ in ROWS}


@pytest.mark.parametrize("name", ["hopper_b", "hopper_c"])
def test_a_positive_current_extends_the_actuators_that_ship(name):
    stance = hopform.solve_stance(hopform.load_robot(name), v2=-2.0, u=3.0)
    assert stance.at(0.02).v1 > 0 and stance.at(0.02).x1 > 0


def test_an_actuator_that_extends_in_flight_lowers_the_foot():
    robot = hopform.load_robot("hopper_c")
    flight = hopform.solve_stance(robot, v2=-2.0, u=3.0).fly()
    t = flight.duration / 10.0
    assert flight.at(t).x1 > flight.at(0.0).x1
    assert flight.foot(t) == pytest.approx(flight.at(t).x2 - robot.L0 - flight.at(t).x1, abs=1e-12)
