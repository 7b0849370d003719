"""The reference set: its answers are exact, its files say the same, and a score tells right from wrong."""

import json
import math
import pickle
import re
import shutil
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import jsonschema
import numpy as np
import pytest

import hopform
from hopform import _front as cli
from hopform import reference
from hopform._cli.named import NAMED
from hopform.reference import cases, score, smoothed, solve
from tests.conformance.reference_set import page
from tests.conformance.reference_set.cases import CASES
from tests.conformance.reference_set.solved import FOLDER, data, written
from tests.derived import SHIPPED, built
from tests.needs import mujoco

NAMES = [case.name for case in cases()]
BY_NAME = {case.name: case for case in cases()}
LEGS = ("drop", "take-off", "hop")
"""Cases whose solver ships."""
LEAST_MARGIN = 5e-4
"""More than a step of differences moves any number, and far more than rounding."""


@pytest.fixture
def models(store, monkeypatch):
    """Solvers of the models that ship, from those that the tests have built."""
    load = hopform.load_solver
    monkeypatch.setattr(hopform, "load_solver", lambda name: load(built(store, SHIPPED / f"{name}.py")))


# ---- the answers ----


def test_the_set_has_what_is_stated_and_every_case_is_away_from_another_list_of_events():
    assert [case.name for case in CASES] == NAMES
    assert {path.stem for path in FOLDER.glob("*.json")} == {*NAMES} and len(NAMES) == 11
    for case in cases():
        assert case.margin >= LEAST_MARGIN and case.exact.gradients
        assert json.loads((FOLDER / f"{case.name}.json").read_text("utf-8"))["licence"] == "CC0-1.0"
        ticks = [*case.times, *(t for t, _ in case.steps)]
        assert np.allclose(np.array(ticks) / 2e-3, np.rint(np.array(ticks) / 2e-3), atol=1e-9)


def test_a_joint_spins_down_as_the_textbook_has_it():
    """J v' = -b v - F: v = (v0 + F/b) e^(-b t/J) - F/b, to rest at (J/b) ln(1 + b v0/F)."""
    case = BY_NAME["spin-down"]
    J, b, F, v0 = (*(case.parameters[name] for name in "JbF"), case.start["v"])
    rest, answer = J / b * math.log1p(b * v0 / F), case.exact
    t = np.minimum(case.times, rest)
    fade = -np.expm1(-b * t / J)
    assert answer.values["time_to_rest"] == pytest.approx(rest, rel=1e-15)
    assert answer.events == ((pytest.approx(rest, rel=1e-15), "q_sticks"),)
    assert answer.states["v"] == pytest.approx(v0 - (v0 + F / b) * fade, abs=1e-14)
    assert answer.states["q"] == pytest.approx((v0 + F / b) * J / b * fade - F / b * t, abs=1e-12)
    slopes = {(each.of, each.by): each.value for each in answer.gradients}
    assert slopes["time_to_rest", "F"] == pytest.approx(-J * v0 / (F * F + b * v0 * F), rel=1e-14)
    assert slopes["q_end", "v"] == pytest.approx(J * v0 / (F + b * v0), rel=1e-14)  # of q = J v0/b - (J F/b^2) ln(...)


def test_what_friction_holds_does_not_move():
    answer = BY_NAME["hold"].exact
    assert not answer.states["q"].any() and not answer.states["v"].any() and answer.events == ()
    assert {each.by: each.value for each in answer.gradients} == {"F": 0.0, "tau": 0.0, "q": 1.0}


@pytest.mark.sliced
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_case_that_is_solved_again_has_the_same_bytes(case):
    assert written(data(case)) == (FOLDER / f"{case.name}.json").read_text("utf-8")


def test_the_quickest_case_that_is_solved_again_has_the_same_bytes():
    (hold,) = (case for case in CASES if case.name == "hold")
    assert written(data(hold)) == (FOLDER / "hold.json").read_text("utf-8")


def check_the_engine(case):
    """States, events, values and its own derivatives within rounding, relative to the larger of 1 and their size."""
    (found,) = score(solve, case.name)
    assert max(found.rms, found.rms_velocity, found.event_error) <= 1e-14
    assert (found.missed, found.extra) == (0, 0) and not found.creep > 0.0
    assert all(abs(error) <= 1e-14 * max(abs(case.exact.values[name]), 1.0) for name, error in found.values.items())
    for each in found.gradients:
        size = max(abs(each.exact), 1.0)
        assert abs(each.differences - each.exact) <= 1e-5 * size, each
        assert case.family == "hop" or abs(each.own - each.exact) <= 1e-12 * size, each


@pytest.mark.parametrize("name", LEGS)
def test_the_engine_has_the_answer_of_a_leg(name):
    check_the_engine(BY_NAME[name])


@pytest.mark.sliced
@pytest.mark.parametrize("name", [name for name in NAMES if name not in LEGS])
def test_the_engine_has_the_answer(models, name):
    check_the_engine(BY_NAME[name])


def test_a_case_can_be_handed_to_another_process():
    for case in (BY_NAME["stops"], BY_NAME["stops"].changed(F=0.05)):
        again = pickle.loads(pickle.dumps(case))
        assert again.numbers == case.numbers and again.steps == case.steps and again.mjcf() == case.mjcf()
        assert (again.answer is None) == (case.answer is None)


# ---- what a score tells ----


def exactly(case):
    """The answer itself."""
    answer = BY_NAME[case.name].exact
    slopes = {(each.of, each.by): each.value for each in answer.gradients}
    moved = {name: value - BY_NAME[case.name].numbers[name] for name, value in case.numbers.items()}
    moved[case.input] = case.steps[0][1] - BY_NAME[case.name].steps[0][1]
    values = {
        name: value + sum(slopes.get((name, by), 0.0) * change for by, change in moved.items())
        for name, value in answer.values.items()
    }
    return {"states": answer.states, "events": answer.events, "values": values, "gradients": [*slopes.values()]}


def test_the_answer_itself_scores_nothing_but_rounding():
    for case, found in zip(cases(), score(exactly), strict=True):
        assert (found.rms, found.rms_velocity, found.event_error, found.missed, found.extra) == (0.0, 0.0, 0.0, 0, 0)
        assert not found.creep > 0.0 and math.isnan(found.creep) == (not case.exact.held)
        assert not any(found.values.values())
        for each in found.gradients:
            assert each.differences == pytest.approx(each.exact, rel=1e-6, abs=1e-9) and each.own == each.exact


def test_friction_of_the_wrong_sign_is_seen():
    def pushed(case):
        return smoothed(replace(case, parameters={**case.parameters, "F_2": -case.parameters["F_2"]}))

    (right,), (wrong,) = score(smoothed, "drop"), score(pushed, "drop")
    assert right.rms < 1e-5 and wrong.rms > 1e-3


def test_events_are_compared_by_kind_and_counted():
    answer = BY_NAME["stops"].exact
    (first, *others), more = answer.events, [(0.1, "q_sticks"), (0.2, "q_sticks")]
    shifted = [(first[0] + 1e-3, first[1]), *others[:-1], *more]
    (found,) = score(lambda case: {"states": answer.states, "events": shifted}, "stops")
    assert (found.missed, found.extra) == (1, 2)
    assert found.event_error == pytest.approx(1e-3)


def test_creep_is_the_mean_velocity_of_what_stands_still():
    (found,) = score(lambda case: np.stack([3e-3 * case.times, 0.0 * case.times], axis=1), "hold")
    assert found.creep == pytest.approx(3e-3) and math.isnan(found.event_error) and found.missed is None


def test_a_case_that_a_simulator_cannot_say_has_no_score():
    (found,) = score(lambda case: None, "servo")
    assert all(map(math.isnan, (found.rms, found.rms_velocity, found.creep, found.event_error)))
    assert found.missed is found.extra is None and found.values == {}
    assert all(math.isnan(each.differences) and math.isnan(each.own) for each in found.gradients)


def test_a_simulator_is_asked_for_differences_by_the_stated_steps():
    asked = []
    score(lambda case: asked.append(case) or np.zeros((len(case.times), 2)), "hold")
    assert [each.parameters["F"] for each in asked[1:3]] == pytest.approx([1.0 - 1e-4, 1.0 + 1e-4])
    assert [each.steps[0][1] for each in asked[3:5]] == pytest.approx([0.3 - 1e-4, 0.3 + 1e-4])
    assert [each.answer is None for each in asked] == [False, *[True] * 6]


NAN = np.full((101, 2), np.nan)
ZEROS = np.zeros((101, 2))


@pytest.mark.parametrize(
    ("returned", "said"),
    [
        (3.0, r"states must be of shape \(101, 2\), got \(\)"),
        (ZEROS[1:], r"states must be of shape \(101, 2\), got \(100, 2\)"),
        ("text", r"states must be numbers of shape \(101, 2\), got 'text'"),
        (NAN, "q must be finite, got nan at t = 0 s"),
        ({"q": ZEROS[:, 0]}, "states lack v; outputs are q, v"),
        ({"states": ZEROS, "event": []}, "returns states, events, values, gradients, got 'event'"),
        ({"states": ZEROS, "events": [1.0]}, "events must be pairs"),
        ({"states": ZEROS, "events": [(1.0, 2)]}, "the kind of an event must be a text, got 2"),
        ({"states": ZEROS, "events": [(math.nan, "q_sticks")]}, "must be a finite number, got nan"),
        ({"states": ZEROS, "values": {"apex": 1.0}}, "has no value 'apex'; known: q_end"),
        ({"states": ZEROS, "values": {"q_end": "x"}}, "q_end must be a finite number, got 'x'"),
        ({"states": ZEROS, "values": 3}, "values must be numbers by name, got 3"),
        ({"states": ZEROS, "gradients": [1.0]}, "gradients must be d q_end/d F, d q_end/d tau, d q_end/d q, got 1 num"),
        ({"states": ZEROS, "gradients": 3}, "gradients must be 3 numbers, got 3"),
    ],
)  # fmt: skip
def test_what_a_simulator_may_not_return_is_refused(returned, said):
    with pytest.raises(hopform.HopformError, match=f"^case hold.*{said}"):
        score(lambda case: returned, "hold")


def test_what_a_simulator_raises_is_named_with_its_case():
    def raises(case):
        raise KeyError("mass")

    with pytest.raises(hopform.HopformError, match="raises KeyError in the case drop: 'mass'"):
        score(raises, ["drop"])
    with pytest.raises(hopform.HopformError, match="no case 'stop', did you mean 'stops'"):
        score(smoothed, "stop")
    with pytest.raises(hopform.HopformError, match="the case hold has no 'f', did you mean 'F'"):
        BY_NAME["hold"].changed(f=1.0)
    with pytest.raises(hopform.HopformError, match="F must be finite N m, got nan"):
        BY_NAME["hold"].changed(F=math.nan)
    with pytest.raises(hopform.HopformError, match="the case hold was changed, and has no answer"):
        _ = BY_NAME["hold"].changed(F=2.0).exact


# ---- files ----


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("reference") / "set"
    reference.write(place)
    return place


def test_what_is_written_is_read_again(folder):
    for case in cases():
        of = json.loads((folder / f"{case.name}.json").read_text("utf-8"))
        assert {name: each["value"] for name, each in {**of["parameters"], **of["start"]}.items()} == case.numbers
        assert all(of["answer"]["states"][name] == case.exact.states[name].tolist() for name in case.outputs)
        assert {each["of"] + each["by"]: each["value"] for each in of["answer"]["gradients"]} == {
            each.of + each.by: each.value for each in case.exact.gradients
        }
        for format, ending in (("mjcf", "xml"), ("urdf", "urdf")):
            assert (folder / f"{case.name}.{ending}").is_file() == (not of[format]) == (of[format] is None)
    readme = (folder / "README.md").read_text("utf-8")
    assert all(f"`{name}`" in readme for name in (*of, *of["answer"]))


def test_a_folder_that_holds_files_is_left_alone(folder):
    with pytest.raises(hopform.HopformError, match="DIR must be new or empty"):
        reference.write(folder)


def test_urdf_is_well_formed_and_has_the_numbers(folder):
    files = sorted(folder.glob("*.urdf"))
    assert [path.stem for path in files] == ["hold", "slow-sine", "spin-down"]
    for path in files:
        robot, p = ElementTree.parse(path).getroot(), BY_NAME[path.stem].parameters
        dynamics, inertia = robot.find("joint/dynamics"), robot.find("link/inertial/inertia")
        assert (float(dynamics.get("damping")), float(dynamics.get("friction"))) == (p["b"], p["F"])
        assert float(inertia.get("izz")) == p["J"] and float(inertia.get("ixy")) == 0.0


@mujoco
def test_mujoco_loads_each_file_with_the_numbers_of_the_case(folder):
    import mujoco

    for path in (*sorted(folder.glob("*.xml")), *sorted(folder.glob("*.urdf"))):
        model, case = mujoco.MjModel.from_xml_path(str(path)), BY_NAME[path.stem]
        friction = [value for name, value in case.parameters.items() if name.split("_")[0] == "F"]
        assert model.nv == len(case.positions) and sorted(model.dof_frictionloss) == sorted(friction)
        assert [model.joint(name).id for name in case.positions] == [*range(model.nv)]
        if path.suffix == ".xml":
            data = mujoco.MjData(model)
            mujoco.mj_resetDataKeyframe(model, data, 0)
            assert [*data.qpos, *data.qvel] == [case.start[name] for name in (*case.positions, *case.velocities)]
            assert model.actuator(0).name == case.input


@mujoco
def test_a_leg_pushes_in_mjcf_and_does_not_pull():
    import mujoco

    case = BY_NAME["drop"]
    model, k, L = mujoco.MjModel.from_xml_string(case.mjcf()), case.parameters["k"], case.parameters["L"]
    data = mujoco.MjData(model)
    for longer, force in ((-0.01, 0.01 * k), (0.1, 0.0)):
        data.qpos[:] = 0.0, L + longer
        mujoco.mj_forward(model, data)
        assert data.qfrc_spring.tolist() == pytest.approx([-force, force], abs=1e-9)


# ---- another simulator, and the page ----


@mujoco
@pytest.mark.sliced
def test_mujoco_creeps_where_friction_holds_and_its_derivative_behind_a_stop_is_a_sawtooth():
    """What the page says of it, at its default constraints."""
    simulate = page.SIMULATORS["MuJoCo, Euler, 2 ms"]
    (hold,), (stops,) = score(simulate, "hold"), score(simulate, "stops")
    assert hold.creep == pytest.approx(0.0102, rel=0.02)
    by_F = stops.gradients[0]
    assert by_F.exact == pytest.approx(2.51, abs=5e-3) and by_F.differences == pytest.approx(7.46, abs=0.05)

    def slope(step):
        ends = [simulate(BY_NAME["stops"].changed(F=0.042 + s * step))["states"]["q"][-1] for s in (-1, 1)]
        return (ends[1] - ends[0]) / (2.0 * step)

    assert slope(1e-6) == pytest.approx(7.4, abs=0.1) and slope(1e-3) == pytest.approx(2.50, abs=0.05)


@mujoco
@pytest.mark.sliced
@pytest.mark.parametrize("column", ["MuJoCo, Euler, 2 ms", "MuJoCo, implicitfast, 2 ms", "smoothed, 0.1 ms"])
def test_the_errors_on_the_page_are_those_of_each_simulator(column):
    """Within a fifth, since another version of MuJoCo may take its steps another way."""
    text = page.PAGE.read_text("utf-8").partition("<!-- positions -->\n")[2].partition("\n<!-- end")[0]
    head, _, *rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in text.splitlines()]
    printed = {row[0].strip("`"): row[head.index(column)] for row in rows}
    assert [*printed] == NAMES
    for found in score(page.SIMULATORS[column]):
        if printed[found.case] == "-":
            assert math.isnan(found.rms)
        else:
            assert found.rms == pytest.approx(float(printed[found.case]), rel=0.2), found.case


def test_the_page_has_the_cases_of_the_set():
    text = page.PAGE.read_text("utf-8")
    assert page.of_cases() in text
    for case in cases():
        for each in case.exact.gradients:
            assert f"| `{case.name}` | {each.of} by {each.by} | {each.value:.6g} |" in text


# ---- commands ----

OBJECTS = json.loads((page.PAGE.parents[2] / "generated" / "schema.json").read_text("utf-8"))["$defs"]


def of_schema(text, kind):
    """The JSON that a command prints, which is what its schema says."""
    found = json.loads(text)
    jsonschema.Draft202012Validator({"$defs": OBJECTS, **OBJECTS[kind]}).validate(found)
    return found


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def answered(*line):
        capsys.readouterr()
        code = cli.main(["reference", *line])
        return code, *capsys.readouterr()

    return answered


SIMULATOR = """
import numpy as np

def simulate(case):
    print("a line of the simulator")
    return np.outer(case.times, [1e-3, 0.0])

class Of:
    static = staticmethod(simulate)

number = 3

def wrong(case):
    raise ValueError("two\\nlines")
"""


def test_a_simulator_of_this_directory_is_scored(run):
    Path("own_simulator.py").write_text(SIMULATOR, "utf-8")
    for name in ("simulate", "Of.static"):
        code, out, err = run("score", f"own_simulator:{name}", "--case", "hold", "--json")
        (found,) = of_schema(out, "hopform reference score")["scores"]
        assert code == 0 and found["case"] == "hold" and found["creep"] == pytest.approx(1e-3)
        assert found["event_error"] is None and set(err.splitlines()) == {"a line of the simulator"}
    code, out, err = run("score", "own_simulator:simulate", "--case", "hold", "--case", "hold")
    assert code == 0 and len(re.findall(r"^hold +rad +0\.00116 ", out, re.MULTILINE)) == 1
    assert re.search(r"^hold +q_end +q +1 +0 +-", out, re.MULTILINE)


@pytest.mark.parametrize(
    ("function", "said"),
    [
        ("own_simulator", "takes MODULE:FUNCTION, as in my_simulator:simulate, got 'own_simulator'"),
        ("own simulator:x", "takes MODULE:FUNCTION"),
        ("nowhere_at_all:simulate", "there is no module 'nowhere_at_all', neither in this directory nor installed"),
        ("nowhere_at_all.deep:simulate", "there is no module 'nowhere_at_all.deep'"),
        ("faulty_simulator:simulate", "faulty_simulator cannot be imported: ZeroDivisionError: division by zero"),
        ("lacking_simulator:simulate", "lacking_simulator cannot be imported: No module named 'not_there'"),
        ("leaving_simulator:simulate", "leaving_simulator cannot be imported: SystemExit: 3"),
        ("own_simulator:other", "own_simulator has no 'other'"),
        ("own_simulator:number", "own_simulator:number must be a function, got 3"),
        ("own_simulator:wrong", "the simulator raises ValueError in the case spin-down: two lines"),
    ],
)
def test_a_simulator_that_cannot_be_had_is_refused_in_a_line(run, function, said):
    Path("own_simulator.py").write_text(SIMULATOR, "utf-8")
    Path("faulty_simulator.py").write_text("1 / 0\n", "utf-8")
    Path("lacking_simulator.py").write_text("import not_there\n", "utf-8")
    Path("leaving_simulator.py").write_text("raise SystemExit(3)\n", "utf-8")
    code, out, err = run("score", function)
    assert (code, out, err.count("\n")) == (2, "", 1) and said in err, err


def test_a_case_that_is_none_is_refused_before_anything_is_simulated(run):
    Path("own_simulator.py").write_text(SIMULATOR, "utf-8")
    code, out, err = run("score", "own_simulator:simulate", "--case", "hold", "--case", "holt")
    assert (code, out) == (2, "") and "there is no case 'holt', did you mean 'hold'" in err and err.count("\n") == 1


def test_the_list_has_every_case_and_why_a_format_cannot_say_it(run):
    code, out, _ = run("list")
    assert code == 0 and [line.split()[0] for line in out.splitlines()[2:]] == NAMES
    found = of_schema(run("list", "--json")[1], "hopform reference list")["cases"]
    assert [each["name"] for each in found] == NAMES
    assert [each["name"] for each in found if each["mjcf"]] == ["breakaway", "hop"]
    assert found[0]["parameters"] == {"J": 0.031, "b": 0.0085, "F": 0.042}


@pytest.mark.parametrize("line", [("list",), ("score", "own_simulator:simulate", "--case", "hold")])
def test_a_solver_that_is_named_has_no_part_in_the_reference_set(run, monkeypatch, capsys, line):
    """Its package may be older than these commands, and not know their JSON."""
    Path("own_simulator.py").write_text(SIMULATOR, "utf-8")
    monkeypatch.setattr("hopform._cli.reference.to_json", lambda *_, **__: f"named: {NAMED.get()}")
    assert cli.main(["--solver", "joint", "reference", *line, "--json"]) == 0
    assert capsys.readouterr().out == "named: None"


def test_the_set_is_written_by_a_command_and_not_over_files(run):
    code, out, _ = run("write", "friction", "--json")
    files = json.loads(out)["files"]
    assert code == 0 and sorted(path.name for path in Path("friction").iterdir()) == files and len(files) == 25
    code, _, err = run("write", "friction")
    assert code == 2 and err == "hopform: DIR must be new or empty, got friction, which holds files\n"
    shutil.rmtree("friction")
    assert run("write", "friction")[1] == f"25 files in friction; begin with {Path('friction', 'README.md')}\n"
