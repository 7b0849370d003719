"""`hopform --solver DIR|NAME fit`: the parameters of a joint from files alone, and `hopform record motion`, which makes
such files.

The joint's log is made by time stepping that shares nothing with hopform.
"""

import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import hopform
import hopform.identify
from hopform import _front as cli
from tests.derived import SHIPPED, built
from tests.oracle.recordings import Rig, simulate

RIG = Rig(0.03, 6.0, 0.08, 4.0, gamma=0.9)
"""Inertia, stiffness, viscous friction, Coulomb friction per inertia, and torque per current."""
FITTED = ("--fitted", "k,b,F_p,k_t", "--known", f"J={RIG.mass}", "--known", "F_m=F_p")
RATE = 400.0


@pytest.fixture(scope="module")
def folder(store) -> Path:
    return built(store, SHIPPED / "joint.py")


@pytest.fixture(scope="module")
def log(tmp_path_factory) -> Path:
    """The joint under currents of both signs, its angle with noise of 0.3 mrad."""
    levels = np.array([3.0, -3.0, 1.5, -1.5, 0.0, 2.0, -2.0, 3.0, 0.0, -1.5])
    u = np.concatenate([np.zeros(40), np.repeat(levels, 40)])
    q = simulate(RIG, u, RATE) + 3e-4 * np.random.default_rng(3).standard_normal(u.size)
    path = tmp_path_factory.mktemp("log") / "log.csv"
    rows = np.stack([np.arange(u.size) / RATE, q, u], axis=1).tolist()
    path.write_text("\n".join(["time_s,q_rad,i_A", *(",".join(map(repr, row)) for row in rows)]), "utf-8")
    return path


@pytest.fixture
def call(folder, capsys):
    """Exit code, output and errors of a command over the joint."""

    def run(*arguments: Any) -> tuple[int, str, str]:
        code = cli.main(["--solver", str(folder), *map(str, arguments)])
        return code, *capsys.readouterr()

    return run


def test_a_joint_is_fitted_from_a_file_without_python(call, folder, log, tmp_path):
    """The verdict comes first; the robot that is written has the rig's numbers, and opens again with its fit."""
    page, out = tmp_path / "page.html", tmp_path / "mine.toml"
    code, text, errors = call("fit", log, *FITTED, "--out", out, "--report", page)
    assert (code, errors) == (0, "")
    assert text.startswith("The model explains these recordings to their noise. ")
    robot = hopform.load_solver(folder).load_robot(out)
    friction = RIG.mass * RIG.f
    for name, value in {"k": RIG.k, "b": RIG.b, "F_p": friction, "k_t": RIG.gamma}.items():
        at = robot.fit.names.index(name)
        half = 0.5 * (robot.fit.high[at] - robot.fit.low[at])
        assert getattr(robot, name) == robot.fit.values[at] == pytest.approx(value, abs=1.5 * half), name
        assert f"\n{name} " in text and half < 0.05 * value
    assert (robot.F_m, robot.fit.known, robot.name) == (robot.F_p, ("J",), "mine")
    shown = page.read_text("utf-8")
    assert shown.index("to their noise.") < shown.index("<li>k = ") < shown.index("<svg")
    assert "<h1>Identification: model joint</h1>" in shown and "<td>as F_p</td>" in shown
    assert "mrad by with Coulomb" not in shown and "(3), (4)" not in shown and "q [mrad]" in shown


def test_json_is_the_fit_of_python_and_fits_its_schema(call, folder, log):
    code, text, _ = call("fit", log, *FITTED, "--json")
    found = json.loads(text)
    objects = json.loads((folder / "schema.json").read_text("utf-8"))["$defs"]
    jsonschema.Draft202012Validator({"$defs": objects, **objects["hopform identify"]}).validate(found)
    known = {"J": RIG.mass, "F_m": "F_p"}
    same = hopform.identify.fit(folder, str(log), fitted=["k", "b", "F_p", "k_t"], known=known)
    assert code == 0 and (found["kind"], found["units"]) == ("model", {"position": "rad", "drive": "A"})
    assert [(each["name"], each["value"], each["low"], each["high"]) for each in found["parameters"]] == [
        (each.name, each.value, each.low, each.high) for each in same.estimates
    ]


def test_the_file_for_mujoco_is_that_joint(call, log):
    mujoco = pytest.importorskip("mujoco", reason="mujoco is absent, which reads this file")
    code, text, _ = call("fit", log, *FITTED, "--export", "mjcf")
    model = mujoco.MjModel.from_xml_string(text)
    assert code == 0
    assert model.body_inertia[1] == pytest.approx([RIG.mass] * 3)
    assert model.jnt_stiffness[0] == pytest.approx(RIG.k, rel=0.01)
    assert model.dof_frictionloss[0] == pytest.approx(RIG.mass * RIG.f, rel=0.05)


def test_a_pendulum_is_fitted_by_gravity_s_sine(call, tmp_path):
    """J q'' = -K sin(q) - b q', stepped by itself, through 70 degrees."""
    J, K, b, q, v, h = 0.007, 0.48, 0.003, 1.2, 0.0, 1.0 / (20.0 * RATE)
    rows = ["time_s,position_deg"]
    for n in range(20 * 700):
        if n % 20 == 0:
            rows.append(f"{n * h!r},{math.degrees(q)!r}")
        v -= h * (K * math.sin(q + 0.5 * h * v) + b * v) / J
        q += h * v
    path = tmp_path / "swing.csv"
    path.write_text("\n".join(rows), "utf-8")
    how = ("--fitted", "J,b", "--known", f"k={K}", "--known", "F_p=0", "--known", "F_m=0", "--json")
    found = {}
    for more in ((), ("--sine",)):
        code, text, errors = call("fit", path, *how, *more)
        assert code == 0, errors
        found[more] = {each["name"]: each["value"] for each in json.loads(text)["parameters"]}
    assert found["--sine",]["J"] == pytest.approx(J, rel=1e-3) and found["--sine",]["b"] == pytest.approx(b, rel=0.02)
    assert found[()]["J"] > 1.01 * J


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--fitted", "J,spring"), "fitted: unknown parameter 'spring'; free ones are J, k"),
        (("--known", "J"), "--known takes NAME=VALUE in SI units, as in J=0.1, or the name of one that is fitted"),
        (("--known", "J=1 kg"), "--known takes NAME=VALUE in SI units"),
        (("--known", "J=inf"), "--known takes NAME=VALUE in SI units"),
        (("--known", "J=1", "--known", "J=2"), "--known: 'J' is given twice"),
        (("--known", "J=-1"), "J must be > 0 kg m^2, got -1.0"),
        (("--known", "mass=1"), "known: joint has no parameter 'mass'; it has J, k"),
        (("--known", "F_m=F_q"), "known: F_m = 'F_q' names no fitted parameter; fitted are J, k"),
        (("--near", "J=F_p"), "--near takes NAME=VALUE in SI units, as in J=0.1, got 'J=F_p'"),
        (("--loss", "square"), "loss must be one of linear, soft_l1, huber, cauchy, got 'square'"),
        (("--json", "--export", "mjcf"), "--json and --export both print; give --export a file by --out"),
        (("--report", "page.txt"), "a report's name must end in .md or .html"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_in_one_line(call, log, arguments, message):
    code, text, errors = call("fit", log, *arguments)
    assert (code, text, errors.count("\n")) == (2, "", 1)
    assert message in errors


def test_a_log_of_another_rig_is_refused_with_its_line(call, log, tmp_path):
    """The columns of the angle and the current of two runs: nothing is written."""
    lines = log.read_text("utf-8").splitlines()
    angles = [line.split(",") for line in lines[1:]]
    moved = [f"{t},{q},{angles[n - 97][2]}" for n, (t, q, _) in enumerate(angles)]
    path, out = tmp_path / "mixed.csv", tmp_path / "mine.toml"
    path.write_text("\n".join([lines[0], *moved]), "utf-8")
    code, text, errors = call("fit", path, *FITTED, "--out", out)
    assert (code, text, errors.count("\n")) == (2, "", 1) and not out.exists()
    assert "mixed.csv, line " in errors and "column 'q_rad'" in errors and "a fit needs 96 %" in errors
    assert "are q_rad and i_A from the same run, each in its column" in errors
    assert "does it reach a stop, which --known q_min=... or q_max=... gives" in errors


def test_help_has_examples_of_the_solver_in_use_that_run(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    _, text, _ = call("fit", "--help")
    assert "Parameters, by --fitted NAME, --known NAME=VALUE:" in text and "F_p [N m]" in text
    lines = [line.split() for line in text.splitlines() if line.startswith("  hopform --solver")]
    assert len(lines) == 2
    for line in lines:
        assert call(*line[3:])[0] == 0
    assert Path("log.csv").is_file()


# ---- record motion ----


def test_a_recorded_motion_is_the_model_s_with_noise(call, folder):
    start = ("--set", "k=1.5", "--start", "q=0.6", "--start", "q_dot=-1", "--u-steps", "0:0,0.4:4,0.8:0")
    line = ("record", "motion", *start, "--duration", "1.2", "--noise", "0.001", "--quantum", "0")
    code, text, _ = call(*line, "--seed", "1")
    head, *rows = text.splitlines()
    t, q, i = np.array([row.split(",") for row in rows], dtype=float).T
    assert (code, head, t.size) == (0, "time_s,q_rad,i_A", 601)
    solver = hopform.load_solver(folder)
    motion = solver.solve_motion(
        solver.Robot(k=1.5), start={"q": 0.6, "q_dot": -1.0}, u=[(0.0, 0.0), (0.4, 4.0), (0.8, 0.0)], horizon=1.2
    )
    off = q - motion.at(np.minimum(t, motion.duration)).q
    assert np.std(off) == pytest.approx(1e-3, rel=0.1) and abs(np.mean(off)) < 2e-4
    np.testing.assert_array_equal(i, np.where((t >= 0.4) & (t < 0.8), 4.0, 0.0))
    assert call(*line, "--seed", "1")[1] == text != call(*line, "--seed", "2")[1]
    assert call("record", "motion", "--start", "q=0.6")[1].startswith("time_s,q_rad\n")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("record motion --height 0.1", "height: a motion is set by start and u alone"),
        ("record motion --current 1 --hold 0.1", "current, hold: a motion is set by start and u alone"),
        ("record motion --u 1 --u-steps 0:1", "give one of --u, --u-steps and --chirp"),
        ("record motion --plan", "record motion has no --plan: `hopform fit` of the recording shows its intervals"),
        ("record motion --start x=1", "start: the model joint has no coordinate 'x'"),
        ("record drop", "hop or identification: the model joint has no contact()"),
    ],
)
def test_what_a_motion_is_not_set_by_is_refused(call, line, message):
    code, text, errors = call(*line.split())
    assert (code, text, errors.count("\n")) == (2, "", 1) and message in errors


def test_a_start_is_for_a_motion_and_a_motion_must_last(capsys):
    assert cli.main(["record", "drop", "--start", "x2=0.4"]) == 2
    assert "start, u, control_rate and dead_time are for the test 'motion', got 'drop'" in capsys.readouterr().err
    assert cli.main(["record", "motion", "--start", "x2=0.3"]) == 2
    assert "the motion ends by takeoff after 0." in capsys.readouterr().err
