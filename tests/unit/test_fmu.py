"""The FMU of a solver: what its description says, what the command refuses, and what an instance does, in the very words
that Python says of the same value.
"""

import io
import json
import math
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest

import hopform
from hopform import _fmu
from hopform._front import main
from hopform._solver import build
from tests import needs
from tests.derived import SHIPPED, solver_of
from tests.fmus import Fmu, Refused, unpacked

pytestmark = needs.library
BAD = (math.nan, -math.inf, math.inf, float("1e400"), -1e-300, -1.0, 0.0, 1.0, 1e300)
"""Numbers of which each domain refuses some."""


@pytest.fixture(scope="module")
def joint(store) -> Any:
    return solver_of(store, SHIPPED / "joint.py").Robot()


def described(robot: Any, *inputs: str) -> ElementTree.Element:
    """modelDescription.xml of a robot's FMU, of which nothing is compiled."""
    return ElementTree.fromstring(
        _fmu.description(robot.solver, _fmu.variables_of(robot, frozenset(inputs)), "token").encode()
    )


def variables(root: ElementTree.Element) -> dict[str, dict[str, str]]:
    return {
        each.attrib["name"]: each.attrib
        for each in root.iter()
        if "valueReference" in each.attrib and "name" in each.attrib
    }


def shown(about: dict[str, str]) -> tuple[str, ...]:
    return tuple(about.get(key, "") for key in ("causality", "variability", "unit", "start"))


JOINT = {
    "time": ("independent", "continuous", "s", ""),
    "q": ("output", "continuous", "rad", "0.0"),
    "q_dot": ("output", "continuous", "rad/s", "0.0"),
    "friction_q": ("output", "continuous", "N m", ""),
    "stop_q": ("output", "continuous", "N m", ""),
    "input": ("output", "continuous", "N m", ""),
    "energy_H": ("output", "continuous", "J", ""),
    "next_event": ("local", "discrete", "s", ""),
    "i": ("input", "discrete", "A", "0.0"),
    "J": ("parameter", "tunable", "kg m^2", "0.031"),
    "k": ("parameter", "tunable", "N m/rad", "0.0"),
    "q_0": ("parameter", "tunable", "rad", "0.0"),
    "b": ("parameter", "tunable", "N m s/rad", "0.0085"),
    "F_p": ("parameter", "tunable", "N m", "0.042"),
    "F_m": ("parameter", "tunable", "N m", "0.042"),
    "F_sp": ("parameter", "tunable", "N m", "0.0"),
    "F_sm": ("parameter", "tunable", "N m", "0.0"),
    "k_t": ("parameter", "tunable", "N m/A", "0.1"),
    "load": ("input", "discrete", "N m", "0.25"),
    "q_min": ("parameter", "tunable", "rad", "-INF"),
    "q_max": ("parameter", "tunable", "rad", "1.5"),
    "i_max": ("parameter", "tunable", "A", "INF"),
    "mode_q": ("output", "discrete", "", ""),
    "event": ("output", "discrete", "", ""),
    "events": ("output", "discrete", "", ""),
}
RADIANS = {
    "rad": {"rad": 1}, "rad/s": {"rad": 1, "s": -1}, "N m": {"kg": 1, "m": 2, "s": -2}, "A": {"A": 1}, "s": {"s": 1},
    "J": {"kg": 1, "m": 2, "s": -2}, "kg m^2": {"kg": 1, "m": 2}, "N m/rad": {"kg": 1, "m": 2, "s": -2, "rad": -1},
    "N m s/rad": {"kg": 1, "m": 2, "s": -1, "rad": -1}, "N m/A": {"kg": 1, "m": 2, "s": -2, "A": -1},
}  # fmt: skip
"""Units of the joint as powers of base units."""


def test_the_description_of_a_joint_has_its_variables_units_and_numbers(joint):
    """The robot's numbers are the starts; a parameter that is asked for is an input."""
    robot = joint.with_parameters({"q_max": 1.5, "load": 0.25})
    root = described(robot, "load")
    found = variables(root)
    assert {name: shown(about) for name, about in found.items()} == JOINT
    assert [int(about["valueReference"]) for about in found.values()] == list(range(len(JOINT)))
    assert found["q_dot"]["derivative"] == found["q"]["valueReference"]
    bases = {
        unit.attrib["name"]: {name: int(power) for name, power in unit[0].attrib.items()} for unit in root.iter("Unit")
    }
    assert bases == RADIANS
    assert {each.attrib["valueReference"] for each in root.iter("Output")} == {
        about["valueReference"] for about in found.values() if about["causality"] == "output"
    }


def test_the_description_of_a_hopper_has_its_ground_and_gains_and_the_ends_of_stance_and_flight(hopper_c):
    found = variables(described(hopper_c))
    assert shown(found["ground"]) == ("input", "discrete", "m", "0.0")
    assert shown(found["return_Kp"])[:3] == ("parameter", "tunable", "N/m")
    assert shown(found["designs_return"]) == ("parameter", "tunable", "", "true")
    assert float(found["x2"]["start"]) == hopper_c.standing_height and found["in_contact"]["causality"] == "output"
    items = {each.attrib["name"]: int(each.attrib["value"]) for each in described(hopper_c).iter("Item")}
    numbers = hopper_c.solver.package.records.EVENTS
    assert {name: items[name] for name in numbers.values()} == {name: number for number, name in numbers.items()}
    assert items["takeoff"] == 32 and items["touchdown"] == 33


NAMES_OF_OURS = """from hopform.model import *
m = parameter("events", "kg", "mass", "positive", 1)
k = parameter("next_event", "N/m", "stiffness", "nonnegative", 10)
f = parameter("energy_H", "N", "friction", "nonnegative", 1)
load = parameter("event", "N", "load", default=0.5)
x = coordinate("mode_x", "m", m, "cart")
F = current("mode_mode_x", "A")
k_m = parameter("k_m", "N/A", "force per current", default=1.0)
spring(x, k, "spring")
force(x, k_m * F, "drive")
force(x, load, "load")
friction(x, f)
"""


@pytest.mark.sliced
def test_a_name_that_the_model_has_stays_and_ours_gives_way(store, tmp_path):
    """Each once; a value that is set by its name is that of the model."""
    file = tmp_path / "crowded.py"
    file.write_text(NAMES_OF_OURS, "utf-8")
    made = solver_of(store, file)
    robot = made.Robot()
    names = [each.name for each in _fmu.variables_of(robot, frozenset()).all]
    assert len(set(names)) == len(names)
    own = {field.name for field in robot.fields()} | {"mode_x", "mode_mode_x"}
    assert own <= {*names} and {f"{name}_" for name in own - {"mode_x", "m", "k_m"}} <= {*names}
    with Fmu(unpacked(store, robot)) as fmu:
        fmu.begin({"events": 2.0, "mode_x": 0.1, "mode_mode_x": 3.0}, stop=1.0)
        fmu.step(0.1)
        motion = hopform.solve_motion(robot.with_parameters({"events": 2.0}), start={"mode_x": 0.1}, u=3.0, horizon=1.0)
        assert fmu["mode_x"] == motion.at(0.1)[0] != 0.1 and fmu["events"] == 2.0
        assert fmu["input"] == motion.forces(0.1)["input"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--for", "fmu", "--input", "stiffness"), "--input must be a parameter, one of m_eff, m_s, k, "),
        (("--for", "fmu", "--binary", "vax-vms"), "--binary must be one of x86_64-linux, aarch64-linux, "),
        (("--for", "fmu", "--prefix", "leg"), "--prefix is of packages"),
        (("--for", "fmu", "--f32"), "--f32 is of packages"),
        (("--for", "cmake", "--input", "k"), "--input is of --for fmu, got --for 'cmake'"),
        (("--binary", "x86_64-linux"), "--binary is of --for fmu, got --for 'plain'"),
    ],
    ids=" ".join,
)
def test_the_command_names_what_it_refuses_and_writes_nothing(tmp_path, capsys, words, said):
    assert main(["export", str(tmp_path / "out"), *words]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_a_folder_with_files_stays_as_it_is(tmp_path, capsys):
    (tmp_path / "mine.txt").write_text("mine")
    assert main(["export", str(tmp_path), "--for", "fmu"]) == 2
    assert str(tmp_path) in capsys.readouterr().err and [file.name for file in tmp_path.iterdir()] == ["mine.txt"]


@pytest.fixture
def no_compiler(monkeypatch) -> None:
    """Nothing is compiled: an FMU has its sources alone."""

    def none() -> list[str]:
        raise build.NoCompiler("there is none")

    monkeypatch.setattr(build, "compiler", none)


@pytest.mark.usefixtures("no_compiler")
def test_equal_arguments_give_equal_bytes_and_others_another_token(hopper_c):
    archive = _fmu.archive(hopper_c)
    assert archive == _fmu.archive(hopform.load_robot("hopper_c"))
    others = [_fmu.archive(hopper_c, ["g"]), _fmu.archive(hopper_c.with_parameters({"k": 1201.0}))]
    tokens = {token_of(each) for each in (archive, *others)}
    assert len(tokens) == 3


@pytest.mark.usefixtures("no_compiler")
def test_the_command_writes_the_file_and_says_so(tmp_path, capsys):
    assert main(["export", str(tmp_path / "one"), "--for", "fmu", "--robot", "hopper_c", "--input", "g", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["files"] == ["hopper.fmu"]
    assert (tmp_path / "one" / "hopper.fmu").read_bytes() == _fmu.archive(hopform.load_robot("hopper_c"), ["g"])


@pytest.mark.usefixtures("no_compiler")
def test_a_binary_that_is_asked_for_needs_a_compiler(hopper_c, monkeypatch):
    monkeypatch.setattr(_fmu, "this_platform", lambda: "x86_64-linux")
    with pytest.raises(hopform.HopformError, match="^there is none$"):
        _fmu.archive(hopper_c, binaries=["x86_64-linux"])


def token_of(archive: bytes) -> str:
    with zipfile.ZipFile(io.BytesIO(archive)) as file:
        return ElementTree.fromstring(file.read("modelDescription.xml")).attrib["instantiationToken"]


def said_by_python(robot: Any, values: dict[str, float]) -> str | None:
    try:
        robot.with_parameters(values)
    except hopform.HopformError as error:
        return str(error)
    return None


def said_by_the_fmu(fmu: Fmu, values: dict[str, float]) -> str | None:
    """What is said of values that are set, and of the step behind, which is as far as it takes them."""
    try:
        fmu.set(values)
        fmu.step(0.01)
    except Refused as refused:
        return str(refused)
    return None


def refusals_are_those_of_python(
    folder: Path, robot: Any, start: dict[str, float], pairs: list[dict[str, float]]
) -> int:
    """Each parameter with each bad number, and some together: how many were refused, each as Python says it; an instance
    that has refused goes on as one that was not asked.
    """
    refused = 0
    with Fmu(folder) as fmu, Fmu(folder) as other:
        other.begin(start)
        fmu.begin(start)
        singles = [{field.name: bad} for field in robot.fields() for bad in BAD]
        for values in [*singles, *pairs]:
            expected = said_by_python(robot, values)
            if expected is None:
                continue
            refused += 1
            assert said_by_the_fmu(fmu, values) == expected, values
            assert fmu.get(*values) == tuple(robot[name] for name in values)
        fmu.step(0.2 - fmu.t)
        other.step(0.2)
        assert fmu.get(*start) == other.get(*start)
    return refused


def test_a_refused_parameter_is_an_error_in_the_words_of_python(store, joint):
    robot = joint.with_parameters({"q_min": -1.0, "q_max": 1.5})
    crossed = [{"q_min": 2.0, "q_max": 1.0}, {"q_min": 1.6}, {"q_max": -math.inf}]
    count = refusals_are_those_of_python(unpacked(store, robot), robot, {"q": 0.3, "q_dot": 0.0}, crossed)
    assert count > 50


@pytest.mark.parametrize("ends", [(-1.0, 1.5), (-math.inf, 1.5), (-1.0, math.inf)])
def test_a_start_beyond_a_stop_is_refused_in_the_words_of_python(store, joint, ends):
    robot = joint.with_parameters({"q_min": -1.0, "q_max": 1.5})
    limits = {"q_min": ends[0], "q_max": ends[1]}
    for q in (-2.0, 2.0):
        try:
            hopform.solve_motion(robot.with_parameters(limits), start={"q": q}, horizon=0.1)
        except hopform.HopformError as error:
            with Fmu(unpacked(store, robot)) as fmu, pytest.raises(Refused) as refused:
                fmu.begin({**limits, "q": q})
            assert str(refused.value) == str(error)
        else:
            with Fmu(unpacked(store, robot)) as fmu:
                assert fmu.begin({**limits, "q": q})["q"] == q


def test_what_is_no_input_is_refused_by_its_name(store, joint):
    robot = joint.with_parameters({"q_min": -1.0, "q_max": 1.5})
    with Fmu(unpacked(store, robot)) as fmu:
        fmu.begin({"q": 0.3})
        for name, said in (
            ("q", "q cannot be set once a motion has begun"), ("input", "input cannot be set"), ("time", "time cannot be set"),
            ("next_event", "next_event cannot be set"),
        ):  # fmt: skip
            with pytest.raises(Refused, match=f"^{said}$"):
                fmu.set({name: 0.1})
        with pytest.raises(Refused, match=r"^i must be finite A, got nan$"):
            fmu.set(i=math.nan)
        with pytest.raises(Refused, match=r"^fmi3ExitInitializationMode is not allowed here$"):
            fmu.call("exitInitializationMode")
        for point, size in ((0.0, 0.0), (0.0, -1.0), (0.5, 0.1), (math.nan, 0.1), (0.0, math.inf), (0.0, math.nan)):
            with pytest.raises(
                Refused, match=r"^a step must begin at 0\.0 s, the time of the FMU, and be > 0 s long, got "
            ):
                fmu.call("doStep", point, size)
        fmu.step(0.1)
        assert fmu["time"] == 0.1
