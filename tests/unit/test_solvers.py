"""Solvers of models of one's own: `hopform.load_solver` gives all that hopform has, over another derived package."""

import math
import os
import pickle
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hopform
from hopform import _front as cli
from hopform import hopping, identify
from hopform._solver.choice import SOLVERS
from tests import needs
from tests.derived import built, edited, solver_of

HOPPER = hopform.load_robot("hopper_c")


@pytest.fixture(scope="module")
def leg(store) -> hopform.Solver:
    """The hopper with a damper in its leg."""
    return solver_of(store, "leg_damper")


@pytest.fixture(scope="module")
def stranger(store) -> hopform.Solver:
    """The hopper of the paper under another name."""
    return solver_of(store, "stranger")


@pytest.fixture
def damped(leg) -> hopform.Robot:
    return replace(leg.load_robot("hopper_c"), b12=5.0)


# ---- figures of an independent integration ----


@pytest.mark.parametrize(
    ("b12", "u", "takeoff", "apex", "stop"),
    [
        (5.0, 0.0, 0.184781, 7.851, None), (5.0, 3.0, 0.189874, 17.156, None), (20.0, 0.0, 0.190742, 1.368, None),
        (20.0, 3.0, 0.252848, 8.886, 0.252848), (40.0, 3.0, 0.25562, 7.81, 0.25029),
    ],
)  # fmt: skip
def test_a_damped_leg_takes_off_as_an_independent_integration_says(leg, b12, u, takeoff, apex, stop):
    """hopper_c dropped from 20 cm, with a damper b12 in its leg: take-off [s], apex [cm], upper stop [s]."""
    robot = replace(leg.load_robot("hopper_c"), b12=b12)
    stance = leg.solve_stance(robot, v2=leg.touchdown_velocity(robot, 0.2), u=u)
    assert stance.duration == pytest.approx(takeoff, abs=6e-7 if takeoff != 0.25562 else 6e-6)
    assert 100.0 * stance.apex == pytest.approx(apex, abs=6e-4 if apex != 7.81 else 6e-3)
    stops = [event.time for event in stance.events if event.kind == "x1_hits_stop"]
    assert stops == ([] if stop is None else [pytest.approx(stop, abs=6e-6)])


# ---- a solver has what hopform has ----


def test_a_solver_has_every_name_of_hopform(leg):
    own = {*hopform.__all__} - {"load_solver", "__version__"}
    assert own <= {*dir(leg)} and all(getattr(leg, name) is not None for name in own)
    with pytest.raises(AttributeError, match="a solver has no attribute 'solve_stanze'"):
        _ = leg.solve_stanze


def test_the_solver_of_the_hopper_is_hopform_itself():
    solver = hopform.load_solver("hopper")
    assert solver.Robot is hopform.Robot and solver.ROBOTS == hopform.ROBOTS
    assert solver.solve_stance(HOPPER, v2=-1.93, u=2.0) == hopform.solve_stance(HOPPER, v2=-1.93, u=2.0)
    assert solver.equations() == hopform.equations()
    assert hopform.load_solver("hopper") is solver


def test_solvers_stand_side_by_side_and_nothing_is_put_on_the_path(leg, stranger, damped):
    assert leg.Robot is not stranger.Robot is not hopform.Robot
    names = [field.name for field in leg.Robot.fields()]
    assert names == [*(field.name for field in hopform.Robot.fields()), "b12"]
    assert not [path for path in sys.path if "solver_of_" in path]
    ours = {name for name in sys.modules if name.startswith("hopform._solvers.")}
    assert {f"hopform._solvers.{each.solver.source}" for each in (leg.Robot, stranger.Robot)} <= ours
    plain, undamped = hopform.solve_stance(HOPPER, v2=-1.93, u=2.0), replace(damped, b12=0.0)
    for solver, robot in ((leg, undamped), (stranger, stranger.load_robot("hopper_c"))):
        stance = solver.solve_stance(robot, v2=-1.93, u=2.0)
        assert stance.duration == pytest.approx(plain.duration, rel=1e-13)
    assert leg.solve_stance(damped, v2=-1.93, u=2.0).duration != pytest.approx(plain.duration, rel=1e-4)


def test_derivatives_by_a_parameter_of_ones_own_are_those_of_differences(leg, damped):
    """Central differences in b12: their error is of the order of step^2, and of the rounding over the step."""
    stance, step = leg.solve_stance(damped, v2=-1.93, u=2.0), 1e-4
    apexes = [leg.solve_stance(replace(damped, b12=5.0 + d), v2=-1.93, u=2.0).apex for d in (step, -step)]
    slope = (apexes[0] - apexes[1]) / (2.0 * step)
    assert stance.sensitivities["apex", "b12"] == pytest.approx(slope, rel=1e-6)
    assert stance.sensitivities.units["b12"] == "N s/m"
    found = stance.sensitivities.to_xarray()
    assert found.column_unit.sel(column="b12") == "N s/m"


def test_a_batch_takes_a_parameter_of_ones_own(leg, damped):
    dampings = np.array([0.0, 5.0, 20.0])
    batch = leg.solve_stances(damped, v2=-1.93, u=2.0, b12=dampings)
    each = [leg.solve_stance(replace(damped, b12=b), v2=-1.93, u=2.0).apex for b in dampings]
    np.testing.assert_array_equal(batch.apex, each)
    with pytest.raises(hopform.HopformError, match=r"b12\[1\] must be >= 0 and finite N s/m, got -1.0"):
        leg.solve_stances(damped, v2=-1.93, b12=[0.0, -1.0])
    with pytest.raises(hopform.HopformError, match="neither an input of a stance nor a field of the robot"):
        hopform.solve_stances(HOPPER, v2=-1.93, b12=[0.0])


def test_a_sweep_over_a_parameter_of_ones_own_has_its_unit(leg, damped):
    pytest.importorskip("xarray")
    found = leg.sweep(damped, height=[0.1, 0.2], b12=[5.0, 20.0])
    assert dict(found.sizes) == {"height": 2, "b12": 2} and found.b12.attrs == {"units": "N s/m"}
    assert float(found.apex.sel(height=0.2, b12=20.0)) == pytest.approx(0.01368, abs=6e-6)
    single = leg.sweep(damped, height=[0.1, 0.2], b12=20.0)
    assert single.b12.attrs == {"units": "N s/m"}


def test_a_damped_leg_hops_is_controlled_and_is_mapped(leg, damped):
    """The chosen current leads to the desired apex; the run under it repeats that apex."""
    v2 = leg.touchdown_velocity(damped, 0.1)
    command = leg.choose_current(damped, v2=v2, h_des=0.1)
    assert command.status == "reached"
    assert leg.solve_stance(damped, v2=v2, u=command.u).apex == pytest.approx(0.1, abs=1e-9)
    run = hopping.simulate(damped, [0.0, 0.0, 0.0], hopping.controllers.FeedForward(0.1), height=0.1)
    assert run.status == "completed" and [hop.apex for hop in run.hops] == [pytest.approx(0.1, abs=1e-6)] * 3
    reach = leg.reachability(damped, np.linspace(0.05, 0.2, 4), np.array([0.0, 3.0]))
    assert reach.highest[1] > reach.apex[1, 0] and leg.next_apex(damped, 0.1, 3.0) == pytest.approx(
        leg.solve_stance(damped, v2=v2, u=3.0).apex, rel=1e-12
    )


# ---- robots ----


def test_a_robot_of_another_solver_is_refused_with_both_names(leg, damped):
    source = leg.Robot.solver.source
    both = rf"robot hopper_c is of the solver hopper \(source hopform_solver\), not of leg_damper \(source {source}\)"
    with pytest.raises(hopform.HopformError, match=both):
        leg.solve_stance(HOPPER, v2=-1.93)
    with pytest.raises(hopform.HopformError, match=r"is of the solver leg_damper .* not of hopper"):
        hopform.load_solver("hopper").solve_flight(damped, v2=1.0)
    with pytest.raises(hopform.HopformError, match="robot must be a Robot, as load_robot gives it, got 'hopper_c'"):
        leg.solve_stance("hopper_c", v2=-1.93)


def test_the_robots_of_a_solver_are_checked_by_its_own_parameters(leg, damped):
    assert damped.b12 == 5.0 and "b12 = 5.0" in damped.to_toml()
    with pytest.raises(hopform.HopformError, match="b12 must be >= 0 and finite N s/m, got -1.0"):
        replace(damped, b12=-1.0)
    with pytest.raises(hopform.HopformError, match="b12"):
        hopform.Robot(**HOPPER.parameters._asdict(), b12=1.0)


@pytest.mark.parametrize("what", ["robot", "stance", "flight", "batch", "solver"])
def test_what_a_solver_made_is_pickled_by_its_source(leg, damped, what, monkeypatch):
    """Where the solver is not loaded it is refused: a pickle names no folder from which programs would be run."""
    stance = leg.solve_stance(damped, v2=-1.93, u=3.0)
    things = {"robot": damped, "stance": stance, "flight": stance.fly(), "solver": leg}
    thing = things.get(what) or leg.solve_stances(damped, v2=-1.93)
    text = pickle.dumps(thing)
    assert pickle.loads(text) == thing and pickle.loads(pickle.dumps(HOPPER)) == HOPPER
    if what != "batch":  # which has no robot
        source = leg.Robot.solver.source
        monkeypatch.delitem(SOLVERS, source)
        with pytest.raises(hopform.HopformError, match=f"source '?{source}'?, which is not loaded here"):
            pickle.loads(text)


def test_a_toml_names_its_model_or_has_the_keys_of_the_solver(leg, stranger, damped, tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(damped.to_toml(), "utf-8")
    assert leg.load_robot(file) == damped
    with pytest.raises(hopform.HopformError, match=r"unknown parameter 'b12'.*mine.toml, line"):
        hopform.load_robot(file)
    file.write_text('model = "leg_damper"\n' + HOPPER.to_toml(), "utf-8")
    assert leg.load_robot(file).b12 == 0.0
    for other in (stranger, hopform):
        name = "stranger" if other is stranger else "hopper"
        with pytest.raises(
            hopform.HopformError, match=f"of the model 'leg_damper', the solver is that of '{name}' .*line 1"
        ):
            other.load_robot(file)
    file.write_text("model = 1\n" + HOPPER.to_toml(), "utf-8")
    with pytest.raises(hopform.HopformError, match="model must be the name of a model, got 1"):
        leg.load_robot(file)


def test_the_shipped_robots_are_those_of_a_solver_with_their_parameters(leg, stranger):
    assert stranger.ROBOTS == hopform.ROBOTS
    assert ("leg_damper", *hopform.ROBOTS) == leg.ROBOTS
    assert leg.load_robot("hopper_b").b12 == 0.0
    with pytest.raises(hopform.HopformError, match="there is no robot 'hopper_x', did you mean 'hopper_"):
        leg.load_robot("hopper_x")


# ---- what a model cannot do ----


def test_what_a_model_cannot_do_is_refused_in_one_line_that_says_what_it_lacks(store, tmp_path, damped, leg):
    """A folder whose facts say what derive says of a rig: what it can is read, not found out."""
    lacking = 'can = ["motion"]\n\n[lacks]\nstance = "a contact"\nhop = "a body that flies"\n'
    lacking += 'flight = "a body that flies"\ncommand = "a body that flies"\nreach = "a body that flies"\n'
    facts = (built(store, "stranger") / "solver.toml").read_text("utf-8")
    begin, end = facts.index("can = "), facts.index("[build]")
    folder = edited(built(store, "stranger"), tmp_path / "rig", "solver.toml", facts[begin:end], lacking + "\n")
    rig = hopform.load_solver(folder)
    robot = rig.Robot(**HOPPER.parameters._asdict())
    for call in (
        lambda: rig.solve_stance(robot, v2=-1.0), lambda: hopform.solve_stance(robot, v2=-1.0),
        lambda: rig.solve_stances(robot, v2=[-1.0]), lambda: rig.sweep(robot, height=[0.1]),
    ):  # fmt: skip
        with pytest.raises(hopform.HopformError, match="^no stance: the model stranger has no contact$"):
            call()
    flies = "^no (flight or hop|flight, hop or controller|flight, hop or map of apexes): the model stranger has no body"
    for call in (
        lambda: rig.solve_flight(robot, v2=1.0), lambda: hopping.simulate(robot, [0.0], 1.0, height=0.1),
        lambda: rig.choose_current(robot, v2=-1.0, h_des=0.1), lambda: rig.next_apex(robot, 0.1, 1.0),
    ):  # fmt: skip
        with pytest.raises(hopform.HopformError, match=flies):
            call()
    with pytest.raises(hopform.HopformError, match="^no identification: the model leg_damper .* viscous 'damper'"):
        identify.record(damped, "drop")


def test_a_joint_moves_as_a_mass_on_a_spring_and_has_no_stance(store):
    """J phi'' = -k (phi - phi_0) + i without friction: its motion in closed form; the spring pulls, too."""
    joint = solver_of(store, "joint")
    assert joint.can == ("motion", "fit", "batches", "derivatives", "plots", "export") and joint.ROBOTS == ("joint",)
    robot = joint.Robot(J=0.5, k=50.0, phi_0=-0.1, k_t=1.0)
    motion = joint.solve_motion(robot, start={"phi": -0.2, "phi_dot": 0.5}, u=0.3, horizon=2.0)
    t, middle = np.linspace(0.0, 2.0, 41), -0.1 + 0.3 / 50.0
    expected = middle + (-0.2 - middle) * np.cos(10.0 * t) + 0.05 * np.sin(10.0 * t)
    np.testing.assert_allclose(motion.at(t).phi, expected, atol=1e-14)
    assert motion.status == "horizon" and motion.warnings == ()
    with pytest.raises(hopform.HopformError, match=r"^no stance, flight or hop: the model joint has no contact\(\)$"):
        joint.solve_stance(robot, v2=0.0)
    with pytest.raises(hopform.HopformError, match="compression must be >= 0 m .a contact cannot pull."):
        hopform.solve_motion(HOPPER, start={"y": -0.1})


# ---- folders and names ----


def test_what_is_no_solver_is_refused_by_its_name(tmp_path):
    model, file, empty = tmp_path / "leg.py", tmp_path / "leg.toml", tmp_path / "empty"
    model.write_text("terms = ()\n")
    file.write_text("")
    empty.mkdir()
    for path, message in (
        (model, "is a model file; build it first: hopform model build"),
        (file, "is not a solver, which is a folder with solver.toml"),
        (empty, "is not a solver: it has no solver.toml"),
        (tmp_path / "absent", "there is no folder .*absent: `hopform model build FILE --out"),
        (7, "solver must be a path, got 7"),
    ):
        with pytest.raises(hopform.HopformError, match=message):
            hopform.load_solver(path)


@pytest.mark.parametrize(
    ("name", "old", "new", "message"),
    [
        (
            "solver.toml",
            "format = 3",
            "format = 2",
            "must be of format 3, which this hopform reads, got 2; .* makes it again",
        ),
        ("solver.toml", 'title = "', 'titles = "', "holds no facts of a solver: KeyError: 'title'"),
        ("solver.toml", "format = 3", "format 3", "cannot be read"),
        ("python/hopform_solver/__init__.py", 'LAYOUT = "', 'LAYOUT = "0', "has the layout .*, its package 0"),
    ],
)
def test_a_folder_that_disagrees_with_itself_is_refused(store, tmp_path, name, old, new, message):
    folder = edited(built(store, "stranger"), tmp_path / "copy", name, old, new)
    with pytest.raises(hopform.HopformError, match=message):
        hopform.load_solver(folder)


@needs.library
def test_a_library_of_other_sources_than_the_folder_has_is_not_used(store, tmp_path):
    """As after deriving again without a compiler: the layout is the same, the formulas need not be."""
    folder = edited(built(store, "stranger"), tmp_path / "copy", "solver.toml", "built as a stranger", "edited")
    source = folder / "c" / "src" / "version.c"
    source.write_text(source.read_text("utf-8") + "\n", "utf-8")
    solver = hopform.load_solver(folder)
    with pytest.raises(hopform.BackendError, match="is stale: it is of the sources") as refused:
        solver.solve_stance(solver.load_robot("hopper_c"), v2=-1.93)
    assert solver.library_message() == str(refused.value)


def test_a_solver_is_found_by_its_name_where_models_are_built_the_newest_first(store, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    place = tmp_path / "hopform" / "solvers"
    edited(built(store, "stranger"), place / "a", "solver.toml", "built as a stranger", "of today")
    old = edited(built(store, "stranger"), place / "b", "solver.toml", "built as a stranger", "of yesterday")
    os.utime(old / "solver.toml", (1.0, 1.0))
    edited(built(store, "stranger"), place / ".being_built", "solver.toml", "built as a stranger", "of tomorrow")
    (place / "c").mkdir()
    (place / "c" / "solver.toml").write_text("half of a fi")
    assert hopform.load_solver("stranger").title == "The hopper of the paper, of today."
    with pytest.raises(
        hopform.HopformError,
        match="there is no solver 'strange'; known: hopper, stranger; a folder is written with a separator",
    ):
        hopform.load_solver("strange")


@pytest.mark.parametrize("name", ["stranger", "hopper", "absent", "joint_2", ".", ".."])
@pytest.mark.parametrize("there", needs.the_first(["a program", "recordings", "a file", "nothing"]))
def test_a_word_without_a_separator_is_a_name_whatever_the_current_folder_has(
    store, tmp_path, monkeypatch, capsys, name, there
):
    """Its meaning is that of another folder, in Python and on the command line; nothing of the current one is run."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    shutil.copytree(built(store, "stranger"), tmp_path / "cache" / "hopform" / "solvers" / "a")
    here, elsewhere = tmp_path / "here" / "there", tmp_path / "elsewhere"
    here.mkdir(parents=True)
    elsewhere.mkdir()
    if there == "a file":
        (here / name).write_text("t,q\n") if name not in (".", "..") else None
    elif there != "nothing":
        (here / name).mkdir(exist_ok=True)
        (here / name / "log.csv").write_text("t,q\n")
    if there == "a program":
        shutil.copytree(built(store, "stranger"), here / name, dirs_exist_ok=True)
        (here / name / "python" / "hopform_solver" / "__init__.py").write_text("raise SystemExit('it was run')")

    def meaning() -> tuple[object, ...]:
        code = cli.main(["--solver", name, "robots", "--json"])
        printed = capsys.readouterr()
        try:
            return code, printed.out, hopform.load_solver(name)
        except hopform.HopformError as error:
            return code, str(error).partition(";")[0], printed.err.partition(";")[0]

    capsys.readouterr()  # what the build has said, if this is the first test that needs it
    monkeypatch.chdir(elsewhere)
    wanted = meaning()
    monkeypatch.chdir(here)
    assert meaning() == wanted and (wanted[0] == 0) == (name in ("stranger", "hopper"))
    if there in ("a program", "recordings"):
        why = "was changed after its build" if there == "a program" else "is not a solver: it has no solver.toml"
        for folder in (Path(name), f".{os.sep}{name}", f"{name}{os.sep}"):
            with pytest.raises(hopform.HopformError, match=why):
                hopform.load_solver(folder)


def test_the_same_folder_is_loaded_once(store, stranger):
    assert hopform.load_solver(built(store, "stranger")) is stranger
    assert hopform.load_solver(str(built(store, "stranger"))) is stranger
    assert not math.isnan(stranger.solve_stance(stranger.load_robot("hopper_c"), v2=-1.93).apex)
