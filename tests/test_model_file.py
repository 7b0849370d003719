"""A robot of one's own: `python -m derive --model FILE` for a hopper with a damper between its masses.

Package and library are derived, compiled and compared with the 50-digit reference, which knows such a damper as b12; a
term that the closed form cannot carry is refused by name.
"""

import dataclasses
import importlib
import math
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hopform
import hopform_solver
from derive.__main__ import main
from hopform import native
from hopform_solver import records
from tests import reference
from tests.differences import differences, scaled_error, size_of
from tests.measure import TOLERANCE, plain_errors, random_robot, rounded
from tools.build_library import compile_sources

MODELS = Path(__file__).with_name("models")
EVERY_EVENT = set(records.EVENTS.values())
EVERY_MODE = {(one, other) for one in (-1, 0, 1) for other in (-1, 0, 1)}


@pytest.fixture(scope="module")
def damped(tmp_path_factory) -> Path:
    """The folder that the command writes."""
    out = tmp_path_factory.mktemp("damped")
    assert main(["--model", str(MODELS / "damper.py"), "--out", str(out), "--prefix", "damped"]) == 0
    return out


@pytest.fixture(scope="module")
def package(damped):
    """Its package, imported from there."""
    sys.path.insert(0, str(damped / "python"))
    try:
        yield importlib.import_module("damped_solver")
    finally:
        sys.path.remove(str(damped / "python"))


@pytest.fixture(scope="module")
def library(damped, package) -> native.Library:
    """Its library, compiled there."""
    path = damped / "libdamped.so"
    compile_sources(damped / "c", path, "-O0")
    return native.Library(path, "damped", package)


@dataclass(frozen=True)
class Seen:
    """What the comparison reads of a stance, whoever solved it."""

    dtype: Any
    status: str
    duration: float
    end: hopform.State
    aed: float
    events: tuple[hopform.Event, ...]
    modes: tuple[tuple[int, int], ...]
    ledger: Any
    stop_loss: tuple[float, float]
    gained: float


def seen(robot: hopform.Robot, solved: Any, dtype: Any, ledger: Any, loss: Any, total: Any) -> Seen:
    rows = solved.phase_rows()
    ending, duration, state, _, aed = solved.outcome()
    end = hopform.State(state.x1, state.v1, state.x1 - state.y + (robot.L0 + robot.c), state.v2)
    return Seen(
        np.dtype(dtype),
        records.ENDINGS[ending],
        duration,
        end,
        aed,
        tuple(hopform.Event(t, records.EVENTS[event]) for t, _, _, event, _ in rows if event),
        tuple((mode // 3 - 1, mode % 3 - 1) for _, _, mode, _, _ in rows),
        type(ledger)(*(float(entry[-1]) for entry in ledger)),
        (float(loss[0]), float(loss[-1])),
        float(total[-1] - total[0]),
    )


def by_library(robot: hopform.Robot, b12: float, start: dict[str, Any], dtype: Any, library: native.Library) -> Seen:
    steps = start["u"] if isinstance(start["u"], tuple) else ((0.0, start["u"]),)
    state = records.State(start.get("x1", 0.0), start.get("v1", 0.0), start["v2"], 0.0)
    solved = native.solve(
        (*robot.parameters, b12), state, steps, start.get("horizon", 2.0), start.get("max_phases", 4096),
        np.dtype(dtype), library,
    )  # fmt: skip
    times = np.array([0.0, solved.outcome()[1]], dtype)
    return seen(robot, solved, dtype, *solved.ledger_at(times), solved.energy_at(times).total)


def by_package(robot: hopform.Robot, b12: float, start: dict[str, Any], dtype: Any, package: Any) -> Seen:
    steps = start["u"] if isinstance(start["u"], tuple) else ((0.0, start["u"]),)
    times, currents = zip(*steps, strict=True)
    state = package.State(start.get("x1", 0.0), start.get("v1", 0.0), start["v2"], 0.0)
    with np.errstate(all="ignore"):
        solution = package.solve(
            package.Robot(*robot.parameters, b12), state, currents if len(steps) > 1 else currents[0], times,
            start.get("horizon", 2.0), start.get("max_phases", 4096), dtype,
        )  # fmt: skip
        energy = importlib.import_module("damped_solver.energy")
        at = np.array([0.0, float(solution.duration)], dtype)
        ledger, loss = energy.ledger_at(solution, 0, at)
        total = energy.energy_at(solution, 0, at).total
    return seen(robot, hopform.arrays.Solved(solution), dtype, ledger, loss, total)


# ---- the derivatives are those of the reference ----


def test_derivatives_with_a_damper_are_those_of_the_reference(package, library):
    """The damper fills both rows of the equations, and a stop that takes v1 changes the acceleration of the body at once."""
    robot, b12 = dataclasses.replace(hopform.load_robot("hopper_c"), x1_max=0.05), 10.0
    start = {"v2": -1.93, "x1": 0.02, "v1": 0.9, "u": 1.0}
    solved = native.solve(
        (*robot.parameters, b12), records.State(0.02, 0.9, -1.93, 0.0), ((0.0, 1.0),), 2.0, 4096,
        np.dtype(np.float64), library,
    )  # fmt: skip
    assert {records.EVENTS[row[3]] for row in solved.phase_rows()[1:]} >= {"x1_hits_stop", "x1_reverses", "x2_reverses"}
    solution = package.solve(package.Robot(*robot.parameters, b12), package.State(0.02, 0.9, -1.93, 0.0), 1.0)
    by_package = importlib.import_module("damped_solver.sensitivity")
    exact, sizes, columns = {**rounded(robot, np.float64), "b12": b12}, [], []
    for name in by_package.COLUMNS:
        value = exact.get(name, start.get(name, 0.0))
        sizes.append(size_of(name, value))
        known = name not in ("y", "u_max", "impact_loss")
        columns.append(differences(exact, start, name, sizes[-1]) if known else [0.0] * 7)
    columns[by_package.COLUMNS.index("y")] = [math.nan] * 7
    for ours in (solved.sensitivities(), by_package.sensitivities_of(solution)):
        assert scaled_error(ours, np.array(columns).T, np.array(sizes)) <= 1e-12


# ---- the answers are those of the reference ----


def hoppers() -> dict[str, tuple[hopform.Robot, float, dict[str, Any]]]:
    """A robot, its damper and a start: drops, strokes that end, friction that holds, and robots of every size."""
    c = hopform.load_robot("hopper_c")
    cases: dict[str, tuple[hopform.Robot, float, dict[str, Any]]] = {
        f"hopper_c, {b12} N s/m, {u} A": (c, b12, {"v2": -1.93, "u": u})
        for b12 in (0.0, 1e-9, 2.0, 20.0, 400.0)
        for u in (-3.0, 0.0, 2.0, 3.0)
    }
    cases["onto the lower stop"] = c, 20.0, {"v2": -1.93, "v1": -0.3, "x1": 0.02, "u": -2.0}
    cases["onto the upper stop"] = c, 20.0, {"v2": -1.93, "v1": 0.6, "x1": 0.06, "u": -3.0}
    cases["against a stop at once"] = c, 20.0, {"v2": -1.93, "v1": 0.2, "x1": 0.08, "u": 0.0}
    cases["the current reverses"] = c, 20.0, {"v2": -1.93, "u": ((0.0, 3.0), (0.06, -3.0), (0.12, 3.0))}
    cases["a locked actuator"] = (
        hopform.Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, b2=5.0, f2=0.6, x1_min=0.0, x1_max=0.0),
        20.0,
        {"v2": -1.5, "u": 0.0},
    )
    heavy_friction = hopform.Robot(m_eff=3.0, m_s=3.0, k=800.0, L0=0.4, b2=60.0, f1=0.3, f2=6.0, gamma2=-60.0)
    cases["a body that sticks, pushed up"] = heavy_friction, 10.0, {"v2": -0.9, "v1": 0.3, "u": 1.0}
    cases["a body let go: the force touches zero once a period"] = (
        hopform.load_robot("ideal"),
        0.0,
        {"v2": 0.0, "u": 0.0},
    )
    stiff = hopform.Robot(m_eff=25.0, m_s=1.0, k=4e6, L0=0.4, b1=600.0, b2=1000.0, f1=0.5, f2=0.01, gamma2=100.0)
    cases["a leg that rings for long before the actuator reverses"] = stiff, 0.0, {"v2": -0.1, "v1": 1.0, "u": 2.0}
    some_friction = hopform.Robot(m_eff=3.0, m_s=3.0, k=800.0, L0=0.4, b2=5.0, f1=0.3, f2=3.0, gamma2=-60.0)
    cases["a body that sticks, let down"] = some_friction, 1.0, {"v2": -0.4, "v1": 0.6, "u": 0.0}
    for seed in range(16):
        robot, start = random_robot(1000 + seed)
        cases[f"random {seed}"] = robot, 10.0 ** (seed % 5 - 3) * math.sqrt(robot.k * robot.m_s), start
    return cases


CASES = pytest.mark.parametrize("name", hoppers())


def in_reference(robot: hopform.Robot, b12: float) -> dict[str, float]:
    return rounded(robot, np.float64) | {"b12": b12}


@CASES
def test_package_and_library_agree_with_the_reference(name, package, library):
    """Events and ending are the same; times, states and AED within 1e-12 in the units of the accuracy measure, divided
    by the condition number where that is above 1."""
    robot, b12, start = hoppers()[name]
    exact = reference.solve(in_reference(robot, b12), **start)
    kept = exact.events[: start.get("max_phases", 4096) - 1]
    for stance in (
        by_package(robot, b12, start, np.float64, package),
        by_library(robot, b12, start, np.float64, library),
    ):
        assert stance.status == exact.status
        assert [event.kind for event in stance.events] == [event.kind for event in kept]
        for of, error in plain_errors(robot, stance, exact, start["v2"]).items():  # type: ignore[arg-type]
            if error > TOLERANCE[np.float64]:
                error /= max(1.0, reference.condition(in_reference(robot, b12), of=of, **start))  # noqa: PLW2901
            assert error <= TOLERANCE[np.float64], of


@CASES
def test_the_damper_has_entries_of_its_own_and_the_ledger_closes(name, package, library):
    """What it takes from both masses is what the reference says, and the entries add up to the change of the energy."""
    robot, b12, start = hoppers()[name]
    exact = reference.solve(in_reference(robot, b12), **start)
    unit = float(reference.scales(rounded(robot, np.float64), exact, start["v2"])["energy"])
    theirs = exact.ledger(exact.duration)
    bound = TOLERANCE[np.float64] * max(unit, *(abs(float(entry)) for entry in theirs.values()))
    for stance in (
        by_package(robot, b12, start, np.float64, package),
        by_library(robot, b12, start, np.float64, library),
    ):
        ours = stance.ledger._asdict()
        at_once, in_all = stance.stop_loss
        entries = package.records.LEDGER_OF_ROBOT
        assert abs(sum(ours[entry] for entry in entries) + (in_all - at_once) - stance.gained) <= bound
        assert abs(sum(ours[entry] for entry in package.records.LEDGER_OF_BODY) - stance.aed) <= bound
        assert abs(ours["damper_1"] + ours["damper_2"] - float(theirs.get("viscous_12", 0.0))) <= bound
        assert abs(in_all - float(theirs["stop_loss"])) <= bound
        for entry in records.Ledger._fields:
            assert abs(ours[entry] - float(theirs[entry])) <= bound, entry


def test_the_cases_visit_every_mode_and_every_event(library):
    """A guard of this file: what is not visited is not compared."""
    stances = [by_library(robot, b12, start, np.float64, library) for robot, b12, start in hoppers().values()]
    assert {event.kind for stance in stances for event in stance.events} == EVERY_EVENT
    assert {mode for stance in stances for mode in stance.modes} == EVERY_MODE


def test_a_take_off_comes_before_what_else_happens_then(package, library, hopper_c):
    """The horizon, say: a stance that is cut at its own duration takes off, and cut 64 eps earlier it does not."""
    for u in (0.0, 2.0, 3.0):
        start = {"v2": -1.93, "u": u}
        for solve, with_what in ((by_library, library), (by_package, package)):
            whole = solve(hopper_c, 2.0, start, np.float64, with_what)
            assert whole.status == "takeoff"
            endings = {
                horizon: solve(hopper_c, 2.0, start | {"horizon": horizon}, np.float64, with_what).status
                for horizon in (whole.duration * (1.0 - 64.0 * 2.0**-52), whole.duration)
            }
            assert list(endings.values()) == ["horizon", "takeoff"]


def test_without_its_damper_the_damped_hopper_is_the_hopper(library, hopper_c):
    """To the last bit: what the damper adds is an exact zero in every sum."""
    for u in (-3.0, 0.0, 3.0):
        stance = by_library(hopper_c, 0.0, {"v2": -1.93, "u": u}, np.float64, library)
        plain = hopform.solve_stance(hopper_c, v2=-1.93, u=u)
        assert (stance.duration, stance.end, stance.aed) == (plain.duration, plain.end, plain.aed)


def test_the_new_parameter_is_checked_and_documented_like_the_others(package):
    robot = importlib.import_module("damped_solver.checked").Robot
    assert package.Robot._fields[-1] == "b12"
    assert package.ROBOT_FIELDS[-1].meaning == "viscous friction between the masses"
    with pytest.raises(ValueError, match=r"b12 must be >= 0 and finite N s/m, got -1\.0"):
        robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, b12=-1.0)


def test_a_force_on_one_mass_alone_is_what_the_hopper_has_already(tmp_path, monkeypatch, hopper_c):
    """More viscous friction of the actuator is a larger b1, a pull on the body less weight: within 1e-13 relative."""
    assert main(["--model", str(MODELS / "bearing.py"), "--out", str(tmp_path), "--prefix", "bearing"]) == 0
    monkeypatch.syspath_prepend(tmp_path / "python")
    bearing = importlib.import_module("bearing_solver")
    u = np.array([0.0, 2.0, 3.0])
    start = records.State(0.0, 0.0, -1.93, 0.0)
    ours = bearing.solve(bearing.Robot(*hopper_c.parameters, 50.0, 6.0), bearing.State(*start), u)
    same = hopper_c.parameters._replace(b1=hopper_c.b1 + 50.0, g=hopper_c.g - 6.0 / hopper_c.m_s)
    theirs = hopform_solver.solve(same, start, u)
    np.testing.assert_array_equal(ours.ending, theirs.ending)
    np.testing.assert_allclose(ours.duration, theirs.duration, rtol=1e-13)
    np.testing.assert_allclose(ours.end, theirs.end, rtol=1e-12, atol=1e-15)


def test_a_package_of_the_same_name_gives_hopform_the_term(tmp_path):
    """With --prefix hopform it stands in for hopform_solver: ledger and AED have the term wherever they are shown."""
    assert main(["--model", str(MODELS / "damper.py"), "--out", str(tmp_path), "--prefix", "hopform"]) == 0
    code = """
import csv, dataclasses, io
import numpy as np
import hopform
from hopform import plots, tables
robot = dataclasses.replace(hopform.load_robot("hopper_c"), b12=20.0)
stance = hopform.solve_stance(robot, v2=-1.93, u=2.0, backend="numpy")
run = hopform.simulate(robot, [0.0, 0.01], 3.0, height=0.2, backend="numpy")
(header, *rows) = csv.reader(io.StringIO(tables.stance_csv(stance, 50)))
column = {name: np.array(values, float) for name, *values in zip(header, *rows)}
t = run.times(50)
drawn = [line.get_ydata() for line in plots.plot_stance(stance).axes[3].get_lines()[:2]]
ledger = tables.ledger(stance)
entries = stance.ledger(stance.duration)
print(abs(entries.damper_1 * entries.damper_2) > 0.01)
for error in (
    column["E"] - column["E"][0] - column["AED"],
    np.asarray(run.energy(t).body) - run.aed(t),
    drawn[0] - drawn[1],
    *([float(list(each.cells)[-1])] for each in ledger.columns[1:]),
):
    print(np.abs(error).max() < 1e-12)
print([each for each in ledger.columns[0].cells if "damper" in each])
"""
    paths = os.pathsep.join([str(tmp_path / "python"), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stderr, done.stdout.split("\n")) == ("", [*["True"] * 6, "['damper 1', 'damper 2']", ""])


# ---- what is refused ----


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("ground", ("'ground spring'", "mass 1", "s^2", "(11)", "-k1")),
        ("drag", ("'drag'", "not linear in v2", "-d2*v2**2")),
        ("undeclared", ("b12", "`parameters`")),
        ("current", ("'reaction'", "may not contain u", "gamma2*u")),
    ],
)
def test_a_term_that_the_closed_form_cannot_carry_is_refused_by_name(tmp_path, capsys, name, why):
    assert main(["--model", str(MODELS / f"{name}.py"), "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("derive: ")
    for words in (f"{name}.py", *why):
        assert words in line
    assert not (tmp_path / "out").exists()


BAD_FILES = {
    "no terms": ("parameters = ()", "must define 'terms'"),
    "a parameter of the robot": (
        'from derive.quantities import ROBOT\nterms = ()\nparameters = (ROBOT.quantities[2],)',
        "parameter k is one of the robot's already",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_file_that_is_no_model_is_refused_by_what_it_lacks(tmp_path, capsys, name):
    text, why = BAD_FILES[name]
    (tmp_path / "robot.py").write_text(text)
    assert main(["--model", str(tmp_path / "robot.py"), "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "robot.py" in line
    assert why in line
    assert not (tmp_path / "out").exists()
