"""`hopform --solver DIR|NAME COMMAND`: every command over a solver of a model of one's own, and --set."""

import csv
import json
import os
from dataclasses import replace
from pathlib import Path

import jsonschema
import pytest

import hopform
import hopform.hopping
from hopform import _front as cli
from hopform._robots import Provenance
from tests.derived import SHIPPED, built, edited

DROP = ("--height", "0.2", "--u", "3", "--set", "b12=5")


@pytest.fixture(scope="module")
def folder(store) -> Path:
    """The hopper with a damper in its leg."""
    return built(store, "leg_damper")


@pytest.fixture
def leg(folder, capsys):
    """Output of a command over that solver, which must succeed without a word on the error stream."""

    def call(*arguments):
        code = cli.main(["--solver", str(folder), *map(str, arguments)])
        out, errors = capsys.readouterr()
        assert (code, errors) == (0, "")
        return out

    capsys.readouterr()
    return call


@pytest.fixture
def refused(capsys):
    """The line by which a command is refused."""

    def call(*arguments):
        capsys.readouterr()
        code = cli.main([*map(str, arguments)])
        out, errors = capsys.readouterr()
        assert (code, out) == (2, "") and errors.count("\n") == 1
        return errors

    return call


def test_a_stance_is_that_of_the_model_and_shows_its_words(leg):
    found = leg("stance", *DROP)
    assert "takes off after 189.87 ms, apex 0.1716 m" in found
    assert "actuator, damper" in found and "body, damper" in found and "b12 [N s/m]" not in found
    assert "b12 [N s/m]" in leg("stance", *DROP, "--sensitivities")


def test_json_has_the_fields_of_the_model(leg, folder):
    found = json.loads(leg("stance", *DROP, "--json"))
    schema = json.loads((folder / "schema.json").read_text("utf-8"))
    jsonschema.validate(found, {"$ref": "#/$defs/hopform stance", "$defs": schema["$defs"]})
    assert found["robot"]["b12"] == 5.0 and found["ledger"]["damper_2"] < 0.0
    assert found["duration"] == pytest.approx(0.189874, abs=6e-7)


def test_every_command_answers_for_a_damped_leg(leg, tmp_path, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    assert "b12" in leg("robots", "hopper_c", "--set", "b12=5", "--toml")
    assert ".b12 = 5.0f," in leg("robots", "--set", "b12=5", "--c", "float32")
    run = json.loads(leg("hop", "--height", "0.1", "--hops", "3", "--controller", "exact", "--h-des", "0.1", "--set",
                         "b12=5", "--json", "--plot", "hop.svg"))  # fmt: skip
    assert [hop["apex"] for hop in run["hops"]] == [pytest.approx(0.1, abs=1e-6)] * 3
    assert "reaches the desired apex" in leg("control", "--height", "0.1", "--h-des", "0.1", "--set", "b12=5")
    reached = json.loads(leg("reach", "--heights", "3", "--currents", "3", "--set", "b12=5", "--json"))
    assert len(reached["rows"]) == 3
    assert "(14)" in leg("equations", "14")
    digests = json.loads(leg("selftest", "--json"))
    leg("stance", *DROP, "--csv", "a.csv", "--plot", "a.svg")
    with Path("a.csv").open(encoding="utf-8") as file:
        assert len(list(csv.DictReader(file))) > 400
    leg("export", "firmware", "--robot", "hopper_c", "--set", "b12=5", "--f32")
    robot = Path("firmware/examples/hopper/robot.h").read_text("utf-8")
    assert ".b12 = 5.0f," in robot and digests["hopform_selftest_f32"] in robot
    assert "real b12" in Path("firmware/include/hopform/hopform_f32.h").read_text("utf-8").replace("float", "real")


@pytest.mark.sliced
def test_every_command_answers_for_a_leg_of_which_nothing_is_called_as_in_the_paper(
    store, tmp_path, capsys, monkeypatch
):
    """Coordinates, parameters, current and directions have names of their own; numbers are those of the hopper's."""
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    solver = ["--solver", str(built(store, "monoped"))]

    def call(*line):
        capsys.readouterr()
        assert (cli.main([*solver, *line]), capsys.readouterr().err) == (0, "")

    call(
        "motion", "--start", "z=0.38", "--start", "z_dot=-1", "--u", "2", "--csv", "motion.csv", "--plot", "motion.svg"
    )
    call("stance", "--height", "0.2", "--u", "2", "--explain", "--csv", "stance.csv", "--plot", "stance.svg")
    call("hop", "--height", "0.2", "--controller", "exact", "--h-des", "0.2", "--hops", "3", "--plot", "hop.svg")
    call("reach", "--heights", "3", "--currents", "3", "--plot", "reach.svg")
    call("control", "--height", "0.2", "--h-des", "0.2")
    call("export", "firmware", "--f32")
    assert len([*tmp_path.glob("*.svg")]) == 4
    names = {"m_eff": 25.0, "m_s": 3.0, "k": 1200.0, "L0": 0.4, "b1": 150.0, "b2": 5.0, "f1": 0.8, "gamma2": -65.0}
    theirs, ours = hopform.load_solver(solver[1]).Robot(), hopform.Robot(**names, u_max=10.0)
    how = {"v2": -1.9, "u": 2.0}
    assert hopform.solve_stance(theirs, **how).apex == pytest.approx(hopform.solve_stance(ours, **how).apex, rel=1e-12)
    run, other = (hopform.hopping.simulate(each, [0.0, 0.01], 2.0, height=0.2) for each in (theirs, ours))
    assert run.at(0.3).z == pytest.approx(other.at(0.3).x2, rel=1e-12)


def test_bands_of_a_fit_name_what_of_the_model_was_not_identified(leg, folder, tmp_path):
    """A fit of the same parameters: the leg's own one is alike in all robots that are drawn."""
    robot = hopform.load_solver(folder).load_robot("hopper_c")
    fit = Provenance(("k",), (1200.0,), (1180.0,), (1220.0,), ((100.0,),), ("m_s",), "hopper_c", white=True)
    file = tmp_path / "fitted.toml"
    file.write_text(replace(robot, fit=fit).to_toml(), "utf-8")
    found = leg("control", "--from-fit", file, "--draws", "5", "--set", "b12=5", "--height", "0.1", "--h-des", "0.1")
    assert "95 % bands of 5 robots drawn from the fit of k." in found and "f2_excess, b12." in found


def test_what_a_model_cannot_do_is_said_by_the_command(folder, refused):
    for line in (["record", "drop"], ["identify", "drop", "drop.csv"]):
        assert "no identification: the model leg_damper does not have the equations of motion of the hopper" in refused(
            "--solver", folder, *line
        )


def test_a_solver_without_a_robot_asks_for_one(store, tmp_path, refused):
    """A rig or a joint has none of the hopper's; a folder of `python -m derive` has no robot.toml."""
    folder = edited(built(store, "joint"), tmp_path / "bare", "solver.toml", 'title = "', 'title = "Bare. ')
    (folder / "robot.toml").unlink()
    for line in (["robots"], ["robots", "--toml"], ["robots", "--set", "k=1"]):
        said = refused("--solver", folder, *line)
        assert "the solver joint comes without a robot: --robot FILE.toml gives one" in said
    assert "no stance, flight or hop: the model joint has no contact()" in refused(
        "--solver", folder, "stance", "--v2", "-1"
    )


def test_help_lists_what_a_solver_takes(leg, capsys):
    shown = leg("stance", "--help")
    for line in ("Coordinates of leg_damper:", "x1 [m]", "u [A]", "current (motor); |u| <= u_max",
                 "Parameters, by --set NAME=VALUE:", "viscous friction between the masses; >= 0 and finite"):  # fmt: skip
        assert line in shown
    assert cli.main(["stance", "--help"]) == 0
    assert "Coordinates of" not in capsys.readouterr().out
    assert cli.main(["--solver", "hopper", "stance", "--help"]) == 0
    assert "Coordinates of hopper:" in capsys.readouterr().out


def test_a_model_file_and_what_is_no_solver_are_refused(refused):
    assert "leg_damper.py is a model file; build it first: hopform model build" in refused(
        "--solver", SHIPPED / "leg_damper.py", "robots"
    )
    assert "there is no solver 'absent'" in refused("--solver", "absent", "stance", "--height", "0.2")


@pytest.mark.parametrize("words", [["robots"], ["export", "firmware"], ["model", "list"]])
def test_a_solver_behind_the_command_is_told_its_place(refused, words):
    assert "--solver stands before the command" in refused(*words, "--solver", "absent")


def test_a_name_that_is_a_folder_is_told_how_a_folder_is_written(refused, tmp_path, monkeypatch):
    (tmp_path / "mine").mkdir()
    monkeypatch.chdir(tmp_path)
    assert f"the folder is .{os.sep}mine; models that ship" in refused("--solver", "mine", "robots")


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (["k"], "--set takes NAME=VALUE in SI units, as in m_eff=20, got 'k'"),
        (["k=1 N/m"], "--set takes NAME=VALUE in SI units"),
        (["k=nan"], "--set takes NAME=VALUE in SI units"),
        (["b12=5"], "--set: the model hopper has no parameter 'b12', did you mean 'b2'?"),
        (["k=-1"], "k must be > 0 N/m, got -1.0"),
        (["x1_min=0.2"], "x1_min must be <= x1_max m, got 0.2 > 0.08"),
    ],
)
def test_a_value_that_is_not_allowed_is_refused(refused, values, message):
    given = [each for value in values for each in ("--set", value)]
    assert message in refused("stance", "--height", "0.2", *given)


def test_values_are_set_in_every_command_that_takes_a_robot(capsys):
    """As a robot file with these values has them; infinite ones too, where a parameter may be."""
    for line in ("stance --height 0.2 --json", "control --height 0.1 --h-des 0.1 --json",
                 "hop --height 0.1 --hops 2 --json", "reach --heights 2 --currents 2 --json"):  # fmt: skip
        assert cli.main([*line.split(), "--set", "k=1100", "--set", "x1_max=inf", "--set", "travel=inf"]) == 0
        robot = json.loads(capsys.readouterr().out)["robot"]
        assert (robot["k"], robot["x1_max"], robot["travel"]) == (1100.0, None, None)
    assert cli.main(["record", "drop", "--set", "k=1100", "--seed", "1"]) == 0
    softer = capsys.readouterr().out
    assert cli.main(["record", "drop", "--seed", "1"]) == 0
    assert capsys.readouterr().out != softer


def test_the_solver_of_a_command_line_is_not_that_of_the_next(folder, capsys):
    assert cli.main(["--solver", str(folder), "robots", "--json"]) == 0
    assert "b12" in capsys.readouterr().out
    assert cli.main(["robots", "--json"]) == 0
    assert "b12" not in capsys.readouterr().out
