"""What the runtime says of a model is in the words of its file: help, refusals, tables, explanations, fits.

Three mechanisms that have nothing of the hopper's: a door under a push [N], a relay under a voltage [V], and a tendon that
ties two coordinates.
"""

import re
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

import hopform
import hopform.identify
from hopform import _building as building
from hopform import _front as cli
from hopform._solver import build, choice
from hopform._solver import c as native
from hopform._solver.folder import built_solvers
from hopform.identify._synthetic import to_csv
from tests.derived import built
from tests.needs import the_first


class Stranger(NamedTuple):
    """A mechanism: its solver, the folder of it, and what its file calls its input, with the unit and the meaning."""

    name: str
    folder: Path
    solver: Any
    input: str
    unit: str
    meaning: str

    def motion(self, **how: Any) -> Any:
        """Its motion from 0 under two steps of the input."""
        first = {"door": 20.0, "relay": 12.0, "tendon": 3.0}[self.name]
        asked = {"u": [(0.0, first), (0.1, 0.1 * first)], "horizon": 0.3} | how
        return self.solver.solve_motion(self.solver.load_robot(self.name), **asked)

    def call(self, *line: str) -> int:
        return cli.main(["--solver", str(self.folder), *line])


INPUTS = {
    "door": ("P", "N", "push at the handle (hand)"),
    "relay": ("U", "V", "voltage (coil)"),
    "tendon": ("i", "A", "current (motor)"),
}


@pytest.fixture(params=the_first(["tendon", "door", "relay"], 1))
def stranger(request, store) -> Stranger:
    folder = built(store, request.param)
    return Stranger(request.param, folder, hopform.load_solver(folder), *INPUTS[request.param])


HOPS = ("stance", "hop", "identify", "control", "reach", "equations")
"""Commands about a body that hops, or about the paper."""


def test_help_has_the_model_and_the_commands_that_it_has(stranger, capsys):
    assert stranger.call("--help") == 0
    text = capsys.readouterr().out
    assert f"{stranger.name}: {stranger.solver.title}" in text and "hopper with" not in text
    listed = re.findall(r"^  ([a-z]+) ", text.partition("Commands:\n")[2], re.MULTILINE)
    assert listed == ["robots", "motion", "fit", "record", "export", "selftest", "model", "reference"]
    assert cli.main(["--help", "--solver", str(stranger.folder)]) == 0
    assert capsys.readouterr().out == text


def test_help_of_a_solver_loads_no_numpy(stranger):
    line = ["--solver", str(stranger.folder), "--help"]
    program = f"import sys; from hopform._front import main; main({line!r}); print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert stranger.solver.title in done.stdout and done.stdout.splitlines()[-1] == "False"


@pytest.mark.parametrize("options", [[], ["--help"]])
def test_a_command_that_the_model_does_not_have_is_refused_in_a_sentence(stranger, capsys, options):
    said = set[str]()
    for command in HOPS:
        for line in ([command, *options], ["help", command]):
            assert stranger.call(*line) == 2
            printed = capsys.readouterr()
            assert printed.out == "" and printed.err.count("\n") == 1
            said.add(printed.err.removeprefix("hopform: "))
    contact = f": the model {stranger.name} has no contact()\n"
    assert said == {
        f"no stance, flight{acts}{contact}"
        for acts in (" or hop", ", hop or identification", ", hop or controller", ", hop or map of apexes")
    } | {f"the paper's equations are of another model: `hopform model show` prints those of {stranger.name}\n"}


def test_help_of_a_command_has_the_input_the_coordinates_and_robots_of_the_model(stranger, capsys):
    names = [table["name"] for table in stranger.solver.Robot.solver.facts.offered]
    for command in ("motion", "record", "fit", "robots", "export", "selftest"):
        assert stranger.call(command, "--help") == 0
        text = " ".join(capsys.readouterr().out.split())
        assert not re.search(r"hopper_c|\by \[|--x1\b|--height|Current:|[Bb]ody|[Hh]op ", text), command
        if command in ("motion", "record"):
            assert f"{stranger.input} [{stranger.unit}] {stranger.meaning}: a constant" in text
        if command == "fit":
            columns = {"door": "phi_rad,P_N", "relay": "z_m,U_V", "tendon": "drum_rad,leg_rad,i_A"}[stranger.name]
            assert f"time_s,{columns}." in text and "q_rad" not in text
        if command in ("motion", "record", "fit"):
            place = text.index("Coordinates of ")
            assert [text.index(f" {name} [", place) for name in names] == sorted(
                text.index(f" {name} [", place) for name in names
            )
            assert f"--solver {stranger.folder} record motion --start {names[0]}=" in text or command == "motion"


def test_the_input_is_refused_in_its_unit(stranger):
    robot, unit = stranger.solver.load_robot(stranger.name), stranger.unit
    for solve in (stranger.solver.solve_motion, stranger.solver.solve_motions):
        with pytest.raises(hopform.HopformError, match=f"^u must be finite {unit}, got nan"):
            solve(robot, u=np.nan)
    with pytest.raises(hopform.HopformError, match=rf"^u\[0\] input must be finite {unit}, got inf"):
        stranger.motion(u=[(0.0, np.inf)])
    for wrong in ([], lambda t: t):
        with pytest.raises(hopform.HopformError, match=rf"^u must be a number in {unit} or steps \(t, u\)") as error:
            stranger.motion(u=wrong)
        assert "simulate" not in str(error.value)
    with pytest.raises(hopform.HopformError, match=f"^u must be a number per motion in {unit}; steps"):
        stranger.solver.solve_motions(robot, u=[(0.0, 1.0)])


@pytest.mark.parametrize(("options", "said"), [
    (["--u", "3 A"], "takes a number in {}, written without a unit, got '3 A'"), (["--u", "inf"], "takes a finite number in {},"),
    (["--u-steps", "3"], "takes steps t:u in s and {}, as in"), (["--u-steps", "0:x"], "takes a number in {}, written"),
])  # fmt: skip
def test_an_option_of_the_input_is_refused_in_its_unit(stranger, capsys, options, said):
    assert stranger.call("motion", *options) == 2
    assert said.format(stranger.unit) in capsys.readouterr().err


def test_a_step_of_the_input_has_its_name(stranger, capsys):
    """A step while it moves: a mass that is set free by one slips, which is an event of its own."""
    steps, at = {"door": ("0:20,0.1:0.3", 100), "relay": ("0:12,0.001:6", 1), "tendon": ("0:3,0.1:0.3", 100)}[
        stranger.name
    ]
    assert stranger.call("motion", "--horizon", "0.3", "--u-steps", steps, "--explain") == 0
    text = capsys.readouterr().out
    assert re.search(rf"^ +{at} .*  step of {stranger.input} ", text, re.MULTILINE)
    assert "current" not in text and f"then a step of {stranger.input}\n" in text


def test_event_functions_have_the_words_of_the_file(stranger):
    text = stranger.motion().explain()
    assert not re.search(r"\b[avfx][12]\b", text) and "19/10" not in text and "- 0 " not in text
    wanted = {
        "door": ["1.9 - phi [rad]", "-phi_dot [rad/s]", "phi [rad]"],
        "relay": ["gap - z [m]", "z_dot [m/s]"],
        "tendon": ["d_max - drum [rad]", "stick margin, drum winds [rad/s^2]", "stick margin, drum unwinds [rad/s^2]"],
    }
    for words in wanted[stranger.name]:
        assert re.search(rf"^  {re.escape(words)} ", text, re.MULTILINE), words


def test_a_start_is_offered_by_the_file_s_coordinates(stranger):
    with pytest.raises(hopform.HopformError, match=r"has no coordinate 'q'") as error:
        stranger.motion(start={"q": 1.0})
    offered = str(error.value).partition("it has ")[2].split(", ")
    assert offered == [f"{name} [{unit}]" for name, unit in stranger.motion().units.items()]


def test_a_robot_has_the_parameters_of_the_file_alone(stranger):
    robot = stranger.solver.load_robot(stranger.name)
    assert "travel" not in repr(robot)
    with pytest.raises(hopform.HopformError, match="unknown parameter 'travel'"):
        stranger.solver.Robot(travel=1.0)


# ---- pictures ----


def test_axes_of_a_picture_have_the_names_of_the_file(stranger):
    pytest.importorskip("matplotlib")
    labels = [each.get_ylabel() for each in stranger.motion().plot().figure.axes]
    places = {
        "door": ["door\nphi [rad]"], "relay": ["armature\nz [m]"], "tendon": ["drum [rad]", "leg [rad]"],
    }[stranger.name]  # fmt: skip
    of_input = {"door": "push at the handle", "relay": "voltage", "tendon": "current"}[stranger.name]
    assert labels == [*places, "velocity", "force", "energy", f"{of_input}\n{stranger.input} [{stranger.unit}]"]


# ---- fits ----


def test_a_recording_without_the_coordinate_is_refused_by_its_name(stranger, tmp_path):
    t = np.arange(100) / 100.0
    rows = "".join(f"{time},{np.sin(time)}\n" for time in t)
    (tmp_path / "log.csv").write_text(f"time_s,angle_rad\n{rows}")
    with pytest.raises(hopform.HopformError, match=r"no column is a coordinate of the model \w+: name it") as error:
        hopform.identify.fit(stranger.solver, tmp_path / "log.csv")
    names = [mass for mass in stranger.motion().units if not mass.endswith("_dot")]
    for name in names:
        assert f"{name} (as in {name}_" in str(error.value)
    assert str(error.value).endswith("there are angle_rad") and "x1" not in str(error.value)


@pytest.mark.sliced
def test_a_fit_names_its_coordinates_and_takes_friction_at_rest_where_it_is_asked_for(store, tmp_path):
    pytest.importorskip("scipy")
    tendon, door = (hopform.load_solver(built(store, name)) for name in ("tendon", "door"))
    robot = tendon.load_robot("tendon")
    recording = hopform.identify.record(robot, "motion", u=[(0.0, 3.0), (0.2, -3.0)], duration=0.5, seed=1)
    fit = hopform.identify.fit(tendon, recording, fitted=["K"], compare=False, holdout=False, diagnose=False)
    assert [trace.label for trace in fit.traces] == [f"{recording.source}, drum", f"{recording.source}, leg"]
    robot = door.load_robot("door")
    recording = hopform.identify.record(robot, "motion", u=[(0.0, 30.0), (0.5, -30.0)], duration=1.0, seed=1)
    fit = hopform.identify.fit(door, recording, known={"r": 0.85, "I_d": 2.5, "phi_0": -0.6},
                               compare=False, holdout=False, diagnose=False)  # fmt: skip
    assert [each.name for each in fit.estimates if "@" not in each.name] == ["k_c", "c_oil", "F_h"]


@pytest.mark.sliced
def test_a_stop_that_a_parameter_of_any_domain_gives_is_not_fitted(store):
    pytest.importorskip("scipy")
    relay = hopform.load_solver(built(store, "relay"))
    recording = hopform.identify.record(
        relay.load_robot("relay"), "motion", start={"z": 0.001}, u=[(0.0, 5.0), (0.01, 0.0), (0.02, 3.0)],
        duration=0.05, rate=4000.0, noise=1e-6, quantum=0.0, seed=1,
    )  # fmt: skip
    fit = hopform.identify.fit(relay, recording, known={"m_a": 0.012, "z_0": -0.001, "c_a": 0.4},
                               compare=False, holdout=False, diagnose=False)  # fmt: skip
    assert [each.name for each in fit.estimates if "@" not in each.name] == ["k_s", "F_g", "G"]


@pytest.fixture(scope="module")
def valve(store) -> Any:
    """A solver whose input is a pressure, a unit that recordings do not know."""
    return hopform.load_solver(built(store, "relief_valve"))


@pytest.mark.sliced
@pytest.mark.parametrize("title", [None, "p_Pa", "p (Pa)", "P [Pa]"])
def test_a_drive_is_recorded_and_fitted_in_the_unit_of_the_file(valve, tmp_path, title):
    pytest.importorskip("scipy")
    robot, steps = valve.load_robot("relief_valve"), [(0.0, 9e5), (0.004, 2e5), (0.02, 9e5)]
    how = {"duration": 0.05, "rate": 1e4, "noise": 1e-6, "quantum": 0.0, "seed": 1}
    recording = hopform.identify.record(robot, "motion", u=steps, **how)
    if title is not None:
        rows = to_csv(recording).splitlines()[1:]
        log = "\n".join([f"time_s,x_m,{title},torque_on", *(f"{row},no" for row in rows)])
        (tmp_path / "log.csv").write_text(log)
        recording = hopform.identify.read_recording(tmp_path / "log.csv")
    fit = hopform.identify.fit(valve, recording, known={"m": 0.05, "x_0": 0.01, "b": 5.0, "k": 8e3},
                               compare=False, holdout=False, diagnose=False)  # fmt: skip
    assert fit["A"].value == pytest.approx(1e-4, rel=1e-3) and fit.units.drive == "Pa"
    left_out = [warning for warning in fit.warnings if "left out" in warning]
    assert left_out == [f"{recording.source}: without a known unit, so left out: 'torque_on'"][: title is not None]


@pytest.mark.sliced
def test_a_drive_in_another_unit_is_refused(valve, tmp_path):
    rows = "".join(f"{n / 1000.0},{n * 1e-5},1.0\n" for n in range(50))
    (tmp_path / "log.csv").write_text(f"time_s,x_m,p_bar\n{rows}")
    with pytest.raises(hopform.HopformError, match="column 'p_bar': must be in Pa, as p of the model"):
        hopform.identify.fit(valve, tmp_path / "log.csv")


# ---- a model that ships is built when it is named ----


@pytest.fixture
def emptied(tmp_path, monkeypatch) -> Path:
    """The cache of a user who has built nothing."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def quick(monkeypatch):
    """A compiler that takes no time; what is loaded of it is forgotten, as other tests use the same models."""

    def compiled(folder, output, progress):
        output.write_bytes(b"a library")
        build.sealed(output)

    monkeypatch.setattr(build, "compile_solver", compiled)
    tables: tuple[dict[str, object], ...] = (choice.SOLVERS, native.LIBRARIES)
    before = [dict(each) for each in tables]
    yield
    for table, known in zip(tables, before, strict=True):
        table.clear()
        table.update(known)


def test_a_model_that_ships_is_built_once_when_it_is_named(emptied, quick, capsys):
    assert cli.main(["--solver", "cart", "robots", "--json"]) == 0
    first = capsys.readouterr()
    assert first.err == f"hopform: compiling the solver of cart, which takes {building.USUAL}\n"
    assert [name for _, name in built_solvers()] == ["cart"]
    assert cli.main(["--solver", "cart", "robots", "--json"]) == 0
    assert capsys.readouterr() == (first.out, "")
    assert hopform.load_solver("cart").name == "cart" and capsys.readouterr().err == ""
    assert cli.main(["--solver", "cart", "--help"]) == 0
    assert "A cart on a rail between two stops" in capsys.readouterr().out


def test_a_build_says_how_long_it_took(emptied, quick, capsys):
    assert cli.main(["model", "build", "cart"]) == 0
    assert re.search(
        r"^The solver is built in .*, after [0-9]+\.[0-9] s\. It can: ", capsys.readouterr().out, re.MULTILINE
    )
    assert cli.main(["model", "build", "cart"]) == 0
    printed = capsys.readouterr()
    assert "The solver was built before, in " in printed.out and " after " not in printed.out and printed.err == ""


@pytest.mark.parametrize(
    "fault", the_first([KeyboardInterrupt, build.LibraryNotBuilt("cc does not compile c: error: no")])
)
def test_nothing_is_left_of_a_named_model_whose_build_ends_early(emptied, monkeypatch, capsys, fault):
    def ends(*_, **__):
        raise fault

    monkeypatch.setattr(build, "compile_solver", ends)
    code = cli.main(["--solver", "cart", "robots"])
    assert code == (130 if fault is KeyboardInterrupt else 2) and capsys.readouterr().out == ""
    assert not emptied.exists()


@pytest.mark.parametrize("name", ["standing_height", "compression_at_rest", "fall"])
def test_a_robot_without_a_contact_says_that_it_has_no_height_to_fall_from(stranger, name):
    """In a sentence, not by a formula that its solver has not."""
    with pytest.raises(hopform.HopformError, match=f"the model {stranger.name} has no contact"):
        getattr(stranger.solver.load_robot(stranger.name), name)
