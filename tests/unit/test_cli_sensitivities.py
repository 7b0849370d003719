"""What the command line says of the derivatives of a stance:
numbers in JSON, null where there is none, a table on demand.
"""

import json

import pytest

import hopform
from hopform import _front as cli
from hopform._sensitivities import COLUMNS

DROP = ("stance", "--height", "0.2", "--u", "3")


@pytest.fixture
def answer(capsys):
    """What a command prints, its exit code being 0."""

    def call(*arguments: str) -> str:
        assert cli.main(arguments) == 0
        return capsys.readouterr().out

    return call


@pytest.fixture
def strict_json(answer):
    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no JSON")

    return lambda *arguments: json.loads(answer(*arguments, "--json"), parse_constant=refuse)


@pytest.mark.parametrize("dtype", ["float64", "float32"])
def test_json_has_every_derivative_to_the_bit(strict_json, hopper_c, dtype):
    v2 = hopform.touchdown_velocity(hopper_c, 0.2)
    expected = hopform.solve_stance(hopper_c, v2=v2, u=3.0, dtype=dtype).sensitivities
    record = strict_json(*DROP, "--dtype", dtype)["sensitivities"]
    assert list(record) == list(expected.rows)
    for row in expected.rows:
        assert list(record[row]) == list(expected.columns)
        assert record[row] == {column: expected[row, column] for column in expected.columns}
    assert record["apex"]["u"] == pytest.approx(0.0898, abs=1e-4)


def test_json_says_null_where_there_is_no_derivative(strict_json):
    record = strict_json("stance", "--height", "0.02", "--u", "1.1")
    assert record["status"] == "rest"
    assert {name for name, row in record["sensitivities"].items() if None in row.values()} == {"apex"}
    record = strict_json("stance", "--height", "0.02", "--u", "1.1", "--max-phases", "1")
    assert record["status"] == "too_many_phases"
    assert {value for row in record["sensitivities"].values() for value in row.values()} == {None}


def test_json_says_null_for_the_apex_alone_without_gravity(strict_json, answer, tmp_path):
    robot = answer("robots", "hopper_c", "--toml").replace("g = 9.81", "g = 0.0 ")
    (tmp_path / "flat.toml").write_text(robot)
    record = strict_json("stance", "--robot", str(tmp_path / "flat.toml"), "--v2", "-1.9", "--u", "3")["sensitivities"]
    assert {name for name, row in record.items() if None in row.values()} == {"apex"}


def test_the_table_comes_on_demand(answer):
    assert "Sensitivities" not in answer(*DROP)
    printed = answer(*DROP, "--sensitivities")
    lines = printed[printed.index("Sensitivities") :].splitlines()
    assert [word for word in lines[1].split() if "[" not in word] == ["T", "x1", "v1", "x2", "v2", "apex", "aed"]
    rows = {line.split()[0]: line.split() for line in lines if line.split() and line.split()[0] in COLUMNS}
    assert list(rows) == list(COLUMNS)
    assert rows["k"][1] == "[N/m]"
    assert float(rows["k"][2]) == pytest.approx(-9.4407e-05, rel=1e-4)
    assert float(rows["u"][-2]) == pytest.approx(0.089764, rel=1e-4)


def test_the_table_has_a_dash_where_there_is_no_derivative(answer):
    printed = answer("stance", "--height", "0.02", "--u", "1.1", "--max-phases", "1", "--sensitivities")
    (line,) = [line for line in printed[printed.index("Sensitivities") :].splitlines() if line.startswith("k ")]
    assert line.split() == ["k", "[N/m]", *["-"] * 7]
