"""`hopform motion`: the numbers of solve_motion as tables, JSON and CSV, under the names of the model."""

import csv
import io
import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import hopform
from hopform import _front as cli
from tests.derived import SHIPPED, built

SERVO = ("--set", "k=1.5", "--set", "q_min=-0.1", "--set", "q_max=0.3", "--start", "q=0.2", "--start", "q_dot=-1")
STEPS = ("--u-steps", "0:0,0.4:4,0.8:0")


@pytest.fixture(scope="module")
def folder(store) -> Path:
    return built(store, SHIPPED / "joint.py")


@pytest.fixture
def answer(capsys, folder):
    """What the command prints over the joint, its exit code being 0."""

    def call(*arguments: str) -> str:
        assert cli.main(("--solver", str(folder), "motion", *arguments)) == 0
        return capsys.readouterr().out

    return call


@pytest.fixture
def solved(folder) -> Any:
    solver = hopform.load_solver(folder)
    robot = solver.Robot(k=1.5, q_min=-0.1, q_max=0.3, name="joint")
    return solver.solve_motion(robot, start={"q": 0.2, "q_dot": -1.0}, u=[(0.0, 0.0), (0.4, 4.0), (0.8, 0.0)])


def test_json_has_the_motion_to_the_bit_and_fits_its_schema(answer, solved, folder):
    found = json.loads(answer(*SERVO, *STEPS, "--json"))
    objects = json.loads((folder / "schema.json").read_text("utf-8"))["$defs"]
    jsonschema.Draft202012Validator({"$defs": objects, **objects["hopform motion"]}).validate(found)
    assert (found["status"], found["duration"], found["end"]) == (solved.status, solved.duration, solved.end._asdict())
    assert found["start"] == {"q": 0.2, "q_dot": -1.0}
    assert [event["kind"] for event in found["events"]] == [event.kind for event in solved.events]
    assert found["units"] == {"q": "rad", "q_dot": "rad/s", "friction_q": "N m", "stop_q": "N m", "input": "N m"}
    for part, phase in zip(found["phases"], solved.phases, strict=True):
        assert (part["start"], part["modes"], part["u"]) == (phase.start, {"joint": phase.mode_1}, phase.u)
        assert part["state"] == phase.state._asdict() and part["forces"] == solved.forces(phase.start)
    assert found["ledger"] == solved.ledger_by_element(solved.duration)
    assert found["total_energy"] == [solved.total_energy(0.0), solved.total_energy(solved.duration)]
    by = solved.sensitivities
    assert found["sensitivities"] == {row: {name: by[row, name] for name in by.columns} for row in by.rows}
    assert json.loads(answer(*SERVO, "--max-phases", "1", "--json"))["sensitivities"] is None


def test_csv_is_the_motion_at_its_times(answer, solved):
    rows = list(csv.DictReader(io.StringIO(answer(*SERVO, *STEPS, "--csv", "-", "--samples", "9"))))
    assert list(rows[0]) == ["t", "q", "q_dot", "i", "friction_q", "stop_q", "input", "H"]
    t = np.array([float(row["t"]) for row in rows])
    assert t.size == 9 + len(solved.phases) - 1  # the first phase begins at a uniform time
    for name, values in {**solved.at(t)._asdict(), **solved.forces(t), "i": solved.current(t)}.items():
        np.testing.assert_array_equal([float(row[name]) for row in rows], values)


def test_tables_have_the_words_and_units_of_the_model(answer):
    text = answer(*SERVO, *STEPS, "--sensitivities", "--explain")
    title, *_ = text.splitlines()
    assert title.startswith("joint: from q = 0.2 rad, q_dot = -1 rad/s, i in 3 steps, 0 to 4 A; still moves after 2 s")
    for words in (
        "joint hits stop", "backward", "q [rad]", "friction_q [N m]", "H [J]", "joint, lost at stops",
        "Sensitivities: derivatives of the ending by", "F_p [N m]", "q_max - q [rad]",
    ):  # fmt: skip
        assert words in text, words
    assert "body" not in text and "x1" not in text and "touchdown" not in text
    sums = {
        line.rsplit(None, 1)[0].strip(): float(line.split()[-1]) for line in text.splitlines() if "difference" in line
    }
    assert abs(sums["difference"]) < 1e-14


def test_a_picture_is_written(answer, tmp_path):
    assert "wrote" in answer(*SERVO, "--plot", str(tmp_path / "joint.svg"))
    assert (tmp_path / "joint.svg").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--start", "p=1"), "start: the model joint has no coordinate 'p'; it has q [rad], q_dot [rad/s]"),
        (("--start", "q"), "--start takes NAME=VALUE in SI units, as in q=0.1, got 'q'"),
        (("--start", "q=much"), "--start takes NAME=VALUE in SI units, as in q=0.1, got 'q=much'"),
        (("--start", "q=1", "--start", "q=2"), "--start: 'q' is given twice"),
        (("--u", "1", "--u-steps", "0:1"), "give either --u or --u-steps"),
        (("--u-steps", "1"), "takes steps t:u in s and A, as in 0:0,0.05:2.0, got '1'"),
        (("--set", "q_max=-0.5"), "q must be <= -0.5 rad, its upper stop, got 0.0"),
        (("--set", "q_min=0.5"), "q must be >= 0.5 rad, its lower stop, got 0.0"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(folder, capsys, arguments, message):
    assert cli.main(("--solver", str(folder), "motion", *arguments)) == 2
    assert message in capsys.readouterr().err


def test_help_has_examples_of_the_solver_in_use(answer):
    text = answer("--help")
    assert "q_dot [rad/s]" in text and "motion --start q=0.1 --start q_dot=0.5 --u 1 --json" in text
