"""The commands `control` and `reach`: what they print, write, and refuse in one line with exit code 2."""

import json
from pathlib import Path
from typing import Any

import pytest

import hopform
from hopform import _front as cli
from tests.unit.test_cli import fits

HOPPER = hopform.load_robot("hopper_c")
ASK = ("control", "--height", "0.2", "--h-des", "0.2")
MAP = ("reach", "--from", "0.1", "--to", "0.3", "--heights", "5", "--currents", "7")


@pytest.fixture
def run(capsys: Any) -> Any:
    def call(*arguments: object) -> tuple[int, str, str]:
        code = cli.main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return call


@pytest.mark.parametrize(
    ("arguments", "heading"),
    [
        (ASK, "hopform control"),
        ((*ASK, "--printed"), "hopform control"),
        (("control", "--v2", "-0.14", "--h-des", "0.2", "--x1", "0.07"), "hopform control"),
        (MAP, "hopform reach"),
        (("reach", "--from", "0.005", "--to", "0.02", "--heights", "3", "--currents", "9"), "hopform reach"),
    ],
)
def test_the_json_is_as_documented(run, arguments, heading):
    code, output, errors = run(*arguments, "--json")
    assert (code, errors) == (0, "")
    assert fits(json.loads(output), heading)


def test_control_prints_the_current_that_python_gives(run):
    code, output, _ = run(*ASK)
    command = hopform.choose_current(HOPPER, v2=hopform.touchdown_velocity(HOPPER, 0.2), h_des=0.2)
    assert code == 0
    assert f"{command.u:.9g}" in output
    assert "reaches the desired apex" in output
    record = json.loads(run(*ASK, "--json")[1])
    assert (record["u"], record["status"]) == (command.u, "reached")


def test_control_shows_how_far_the_printed_forms_are_off(run):
    record = json.loads(run(*ASK, "--printed", "--json")[1])
    off = {form["form"]: form["apex"] - 0.2 for form in record["printed"]}
    assert off["as printed"] == pytest.approx(-0.014, abs=1e-3)
    assert abs(off["all three"]) < 1e-3
    assert "as printed, with the spring coordinate" in run(*ASK, "--printed")[1]


def test_reach_prints_bounds_holds_and_fixed_points(run):
    code, output, _ = run(*MAP)
    assert code == 0
    assert "Next apex" in output
    assert "25.227" in output
    assert " stable" in output


@pytest.mark.parametrize("arguments", [ASK, (*ASK, "--stop-margin", "0.05"), MAP, (*MAP, "--stop-margin", "0.05")])
def test_both_draw(run, tmp_path: Path, arguments):
    picture = tmp_path / "picture.svg"
    code, output, errors = run(*arguments, "--plot", picture)
    assert (code, errors) == (0, "")
    assert f"wrote {picture}" in output
    assert picture.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("control", "--height", "0.2"), "--h-des"),
        (("control", "--height", "0.2", "--h-des", "-0.1"), "h_des + datum must be >= 0 m"),
        (("control", "--h-des", "0.1"), "give either --height or --v2"),
        (("control", "--height", "0.2", "--h-des", "20cm"), "takes a number in m"),
        ((*ASK, "--plot", "a.doc"), ".svg, .pdf or .png"),
        (("reach", "--from", "0.3", "--to", "0.2"), "--from must be below --to"),
        (("reach", "--from", "0", "--to", "0.2"), "height must be > 0.0 m"),
        (("reach", "--robot", "hopper_d"), "there is no robot"),
        (("reach", "--heights", "1"), "'--heights': takes a whole number >= 2, got '1'"),
        (("hop", "--height", "0.2", "--hops", "0"), "'--hops': takes a whole number >= 1, got '0'"),
        (("hop", "--height", "0.2", "--hops", "2.5"), "takes a whole number >= 1, got '2.5'"),
    ],
)
def test_bad_input_is_refused_in_one_line(run, arguments, said):
    code, output, errors = run(*arguments)
    assert (code, output) == (2, "")
    assert said in errors
    assert errors.count("\n") == 1
