"""A robot of one's own: `python -m derive --model FILE` for a hopper whose motor has a back-EMF.

Package and library are derived, compiled and compared with the 50-digit reference, which knows the back-EMF as more of b1,
and hop with an integrator; a term that the closed form cannot carry, or that would end at take-off, is refused by name.
"""

import ctypes
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
from derive.__main__ import main, write
from derive.ir import Quantity
from derive.model import Model, Term
from derive.quantities import v2
from derive.render import Options, render
from hopform import flight_backends, native
from hopform_solver import records
from tests import integrator, reference
from tests.differences import differences, scaled_error, size_of
from tests.flights import condition, outcome, random_flight
from tests.measure import TOLERANCE, plain_errors, random_robot, rounded
from tests.reference.flight import FlightReference
from tests.reference.flight import solve_flight as reference_flight
from tests.reference.records import mp
from tools.build_library import compile_sources

MODELS = Path(__file__).with_name("models")
EVERY_EVENT = set(records.EVENTS.values())
EVERY_MODE = {(one, other) for one in (-1, 0, 1) for other in (-1, 0, 1)}


@pytest.fixture(scope="module")
def driven(tmp_path_factory) -> Path:
    """The folder that the command writes."""
    out = tmp_path_factory.mktemp("driven")
    assert main(["--model", str(MODELS / "back_emf.py"), "--out", str(out), "--prefix", "driven"]) == 0
    return out


@pytest.fixture(scope="module")
def package(driven):
    """Its package, imported from there."""
    sys.path.insert(0, str(driven / "python"))
    try:
        yield importlib.import_module("driven_solver")
    finally:
        sys.path.remove(str(driven / "python"))


@pytest.fixture(scope="module")
def library(driven, package) -> native.Library:
    """Its library, compiled there."""
    path = driven / "libdriven.so"
    compile_sources(driven / "c", path, "-O0")
    return native.Library(path, "driven", package)


@dataclass(frozen=True)
class Seen:
    """What the comparison reads of a stance, whoever solved it."""

    dtype: Any
    status: str
    duration: float
    end: hopform.State
    apex: float
    aed: float
    events: tuple[hopform.Event, ...]
    modes: tuple[tuple[int, int], ...]
    ledger: Any
    stop_loss: tuple[float, float]
    gained: float


def seen(robot: hopform.Robot, solved: Any, dtype: Any, ledger: Any, loss: Any, total: Any) -> Seen:
    rows = solved.phase_rows()
    ending, duration, state, apex, aed = solved.outcome()
    end = hopform.State(state.x1, state.v1, state.x1 - state.y + (robot.L0 + robot.c), state.v2)
    return Seen(
        np.dtype(dtype),
        records.ENDINGS[ending],
        duration,
        end,
        apex,
        aed,
        tuple(hopform.Event(t, records.EVENTS[event]) for t, _, _, event, _ in rows if event),
        tuple((mode // 3 - 1, mode % 3 - 1) for _, _, mode, _, _ in rows),
        type(ledger)(*(float(entry[-1]) for entry in ledger)),
        (float(loss[0]), float(loss[-1])),
        float(total[-1] - total[0]),
    )


def by_library(robot: hopform.Robot, k_emf: float, start: dict[str, Any], dtype: Any, library: native.Library) -> Seen:
    steps = start["u"] if isinstance(start["u"], tuple) else ((0.0, start["u"]),)
    state = records.State(start.get("x1", 0.0), start.get("v1", 0.0), start["v2"], 0.0)
    solved = native.solve(
        (*robot.parameters, k_emf), state, steps, start.get("horizon", 2.0), start.get("max_phases", 4096),
        np.dtype(dtype), library,
    )  # fmt: skip
    times = np.array([0.0, solved.outcome()[1]], dtype)
    return seen(robot, solved, dtype, *solved.ledger_at(times), solved.energy_at(times).total)


def by_package(robot: hopform.Robot, k_emf: float, start: dict[str, Any], dtype: Any, package: Any) -> Seen:
    steps = start["u"] if isinstance(start["u"], tuple) else ((0.0, start["u"]),)
    times, currents = zip(*steps, strict=True)
    state = package.State(start.get("x1", 0.0), start.get("v1", 0.0), start["v2"], 0.0)
    with np.errstate(all="ignore"):
        solution = package.solve(
            package.Robot(*robot.parameters, k_emf), state, currents if len(steps) > 1 else currents[0], times,
            start.get("horizon", 2.0), start.get("max_phases", 4096), dtype,
        )  # fmt: skip
        energy = importlib.import_module("driven_solver.energy")
        at = np.array([0.0, float(solution.duration)], dtype)
        ledger, loss = energy.ledger_at(solution, 0, at)
        total = energy.energy_at(solution, 0, at).total
    return seen(robot, hopform.arrays.Solved(solution), dtype, ledger, loss, total)


# ---- the derivatives are those of the reference ----


def in_reference(robot: hopform.Robot, k_emf: float) -> dict[str, Any]:
    """The reference's robot: b1 and k_emf exactly added."""
    parameters = rounded(robot, np.float64)
    return parameters | {"b1": mp.mpf(parameters["b1"]) + mp.mpf(k_emf)}


def test_derivatives_with_a_back_emf_are_those_of_the_reference(package, library):
    """Through a stop, and by the new parameter, which moves whatever it moves as b1 does."""
    robot, k_emf = dataclasses.replace(hopform.load_robot("hopper_c"), x1_max=0.05), 10.0
    start = {"v2": -1.93, "x1": 0.02, "v1": 0.9, "u": 1.5}
    solved = native.solve(
        (*robot.parameters, k_emf), records.State(0.02, 0.9, -1.93, 0.0), ((0.0, 1.5),), 2.0, 4096,
        np.dtype(np.float64), library,
    )  # fmt: skip
    assert {records.EVENTS[row[3]] for row in solved.phase_rows()[1:]} >= {"x1_hits_stop", "x1_slips", "x1_reverses"}
    solution = package.solve(package.Robot(*robot.parameters, k_emf), package.State(0.02, 0.9, -1.93, 0.0), 1.5)
    by_package = importlib.import_module("driven_solver.sensitivity")
    exact, sizes, columns = in_reference(robot, k_emf), [], []
    values = {**rounded(robot, np.float64), **start, "k_emf": k_emf}
    for name in by_package.COLUMNS:
        sizes.append(size_of(name, values.get(name, 0.0)))
        known = name not in ("y", "u_max", "impact_loss")
        in_exact = "b1" if name == "k_emf" else name
        columns.append(differences(exact, start, in_exact, sizes[-1]) if known else [0.0] * 7)
    columns[by_package.COLUMNS.index("y")] = [math.nan] * 7
    assert by_package.COLUMNS[-1] == "k_emf"
    for ours in (solved.sensitivities(), by_package.sensitivities_of(solution)):
        assert scaled_error(ours, np.array(columns).T, np.array(sizes)) <= 1e-12


# ---- the answers are those of the reference ----


def hoppers() -> dict[str, tuple[hopform.Robot, float, dict[str, Any]]]:
    """A robot, its back-EMF and a start: drops, strokes that end, friction that holds, and robots of every size."""
    c = hopform.load_robot("hopper_c")
    cases: dict[str, tuple[hopform.Robot, float, dict[str, Any]]] = {
        f"hopper_c, {k_emf} N s/m, {u} A": (c, k_emf, {"v2": -1.93, "u": u})
        for k_emf in (0.0, 1e-9, 2.0, 20.0, 400.0)
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
    both_rest = dataclasses.replace(heavy_friction, f1=8.0)
    cases["a body that sticks and slips before both rest"] = both_rest, 10.0, {"v2": -0.4, "v1": 0.3, "u": 1.0}
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


@CASES
def test_package_and_library_agree_with_the_reference(name, package, library):
    """Events and ending are the same; times, states and AED within 1e-12 in the units of the accuracy measure, divided
    by the condition number where that is above 1."""
    robot, k_emf, start = hoppers()[name]
    exact = reference.solve(in_reference(robot, k_emf), **start)
    kept = exact.events[: start.get("max_phases", 4096) - 1]
    for stance in (
        by_package(robot, k_emf, start, np.float64, package),
        by_library(robot, k_emf, start, np.float64, library),
    ):
        assert stance.status == exact.status
        assert [event.kind for event in stance.events] == [event.kind for event in kept]
        for of, error in plain_errors(robot, stance, exact, start["v2"]).items():  # type: ignore[arg-type]
            if error > TOLERANCE[np.float64]:
                error /= max(1.0, reference.condition(in_reference(robot, k_emf), of=of, **start))  # noqa: PLW2901
            assert error <= TOLERANCE[np.float64], of


@CASES
def test_the_back_emf_has_an_entry_of_its_own_and_the_ledger_closes(name, package, library):
    """It takes its share of what all viscous friction of the actuator takes, and the entries add up to the energy's change."""
    robot, k_emf, start = hoppers()[name]
    exact = reference.solve(in_reference(robot, k_emf), **start)
    unit = float(reference.scales(rounded(robot, np.float64), exact, start["v2"])["energy"])
    theirs = {entry: float(value) for entry, value in exact.ledger(exact.duration).items()}
    share = k_emf / (robot.b1 + k_emf) if k_emf else 0.0
    theirs |= {"back_EMF_1": share * theirs["viscous_1"], "viscous_1": (1.0 - share) * theirs["viscous_1"]}
    bound = TOLERANCE[np.float64] * max(unit, *map(abs, theirs.values()))
    for stance in (
        by_package(robot, k_emf, start, np.float64, package),
        by_library(robot, k_emf, start, np.float64, library),
    ):
        ours = stance.ledger._asdict()
        at_once, in_all = stance.stop_loss
        entries = package.records.LEDGER_OF_ROBOT
        assert abs(sum(ours[entry] for entry in entries) + (in_all - at_once) - stance.gained) <= bound
        assert abs(sum(ours[entry] for entry in package.records.LEDGER_OF_BODY) - stance.aed) <= bound
        assert abs(in_all - theirs["stop_loss"]) <= bound
        assert ours.keys() == {*records.Ledger._fields, "back_EMF_1"}  # it does nothing to the body
        for entry in ours:
            assert abs(ours[entry] - theirs[entry]) <= bound, entry


def test_the_cases_visit_every_mode_and_every_event(library):
    """A guard of this file: what is not visited is not compared."""
    stances = [by_library(robot, k_emf, start, np.float64, library) for robot, k_emf, start in hoppers().values()]
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


def test_without_back_emf_the_hopper_is_that_of_the_paper(library, hopper_c):
    """To the last bit: what the term adds is an exact zero in every sum."""
    for u in (-3.0, 0.0, 3.0):
        stance = by_library(hopper_c, 0.0, {"v2": -1.93, "u": u}, np.float64, library)
        plain = hopform.solve_stance(hopper_c, v2=-1.93, u=u)
        assert (stance.duration, stance.end, stance.aed) == (plain.duration, plain.end, plain.aed)


def test_the_new_parameter_is_checked_and_documented_like_the_others(package):
    robot = importlib.import_module("driven_solver.checked").Robot
    assert package.Robot._fields[-1] == "k_emf"
    assert package.ROBOT_FIELDS[-1].meaning == "damping by the back-EMF, k_t^2/R"
    with pytest.raises(ValueError, match=r"k_emf must be >= 0 and finite N s/m, got -1\.0"):
        robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, k_emf=-1.0)


# ---- the flight and whole hops ----


def fly_by_package(
    parameters: tuple[float, ...], start: records.State, gains: tuple[float, float], package: Any, **settings: Any
) -> FlightReference:
    flight = importlib.import_module("driven_solver.flight")
    law = importlib.import_module("driven_solver.records").Gains(*gains)
    with np.errstate(all="ignore"):
        solved = flight.solve_flight(package.Robot(*parameters), package.State(*start), law, **settings)
        ledger, lost = flight.flight_ledger_at(solved, solved.duration)
    return flown(flight_backends.ArrayFlight(solved), solved.ending, solved.duration, ledger, lost)


def fly_by_library(
    parameters: tuple[float, ...], start: records.State, gains: tuple[float, float], library: native.Library,
    horizon: float = 3.0, max_phases: int = 200,
) -> FlightReference:  # fmt: skip
    types = library.types(np.dtype(np.float64))
    flight, phases = types.Flight(), (types.FlightPhase * max_phases)()
    plan = ctypes.byref(native.plan_of(library, types, parameters))
    library.call(
        "solve_flight", types, plan, ctypes.byref(types.State(*start)), ctypes.byref(types.Gains(*gains)),
        ctypes.c_double(horizon), ctypes.c_int32(max_phases), phases, ctypes.c_int32(max_phases), ctypes.byref(flight),
    )  # fmt: skip
    solved = flight_backends.NativeFlight(library, types, parameters, plan, phases, flight)  # type: ignore[arg-type]
    _, ledger, lost = solved.energy_at(np.array([flight.duration]))
    ledger = type(ledger)(*(entry[0] for entry in ledger))
    return flown(solved, flight.ending, flight.duration, ledger, lost[0])


def flown(solved: Any, ending: int, duration: float, ledger: Any, lost: float) -> FlightReference:
    """A flight in the form of the reference."""
    return FlightReference(
        records.FLIGHT_ENDINGS[ending],
        duration,
        (solved.end.x1, solved.end.v1, solved.end.v2, solved.end.y),
        [hopform.Event(row.t, records.FLIGHT_EVENTS[row.event]) for row in solved.rows() if row.event],
        (*ledger, lost),
    )


@pytest.mark.parametrize("seed", range(24))
def test_a_flight_with_a_back_emf_is_that_of_the_reference(seed, package, library):
    """Random robots and laws, degenerate ones among them: the same events and ending, errors as of any flight."""
    robot, inputs = random_flight(seed)
    k_emf = 10.0 ** (seed % 5 - 3) * robot.m_eff / 0.1
    start = records.State(*(inputs[name] for name in ("x1", "v1", "v2", "y")))
    gains = inputs["gains"] if robot.gamma2 else (0.0, 0.0)
    exact = reference_flight(in_reference(robot, k_emf), **inputs)
    settings = {name: inputs[name] for name in ("horizon", "max_phases")}
    summed = dataclasses.replace(robot, b1=robot.b1 + k_emf)
    theirs = outcome(exact, summed, inputs, float(exact.duration))
    for flight in (
        fly_by_package((*robot.parameters, k_emf), start, gains, package, **settings),
        fly_by_library((*robot.parameters, k_emf), start, gains, library, **settings),
    ):
        assert flight.status == exact.status
        assert [event.kind for event in flight.events] == [event.kind for event in exact.events]
        ours = outcome(flight, summed, inputs, float(exact.duration))
        error = max(abs(float(one - other)) for one, other in zip(ours, theirs, strict=True))
        if error > TOLERANCE[np.float64]:
            error /= max(1.0, condition(summed, inputs, np.float64, exact))
        assert error <= TOLERANCE[np.float64]


def test_hops_with_a_back_emf_are_those_of_an_integrator(package, library, hopper_c):
    """A drop and four hops over uneven ground: times and states of every touchdown and take-off, and the apexes."""
    k_emf, gains, ground, currents = 35.0, (2500.0, 300.0), [0.0, 0.01, -0.01, 0.005], [3.0, 2.6, 3.0, 2.8]
    exact = integrator.hop(dataclasses.replace(hopper_c, b1=hopper_c.b1 + k_emf), ground, currents, 0.2, gains)
    parameters, loss = (*hopper_c.parameters, k_emf), math.sqrt(1.0 - hopper_c.impact_loss)
    for stand, fly, backend in ((by_package, fly_by_package, package), (by_library, fly_by_library, library)):
        t, x1, v1, v2, level = 0.0, 0.0, 0.0, 0.0, 0.2
        for height, u, touchdown, takeoff in zip(ground, currents, exact.touchdowns, exact.takeoffs, strict=True):
            flight = fly(parameters, records.State(x1, v1, v2, height - level), gains, backend)
            assert flight.status == "touchdown"
            t += flight.duration
            x1, v1, v2 = flight.end[0], flight.end[1], flight.end[2] * loss
            assert t == pytest.approx(touchdown[0], abs=1e-8)
            there = [x1, v1, x1 + hopper_c.L0 + height, v2]
            np.testing.assert_allclose(there, touchdown[1], rtol=0, atol=1e-8)
            stance = stand(hopper_c, k_emf, {"x1": x1, "v1": v1, "v2": v2, "u": u}, np.float64, backend)
            assert stance.status == "takeoff"
            t += stance.duration
            assert t == pytest.approx(takeoff[0], abs=1e-8)
            np.testing.assert_allclose(np.array(stance.end) + [0, 0, height, 0], takeoff[1], rtol=0, atol=1e-8)
            _, _, x2, up = takeoff[1]
            apex = x2 - height - hopper_c.L0 + max(up, 0.0) ** 2 / (2.0 * hopper_c.g)
            assert stance.apex == pytest.approx(apex, abs=1e-8)
            x1, v1, v2, level = stance.end.x1, stance.end.v1, stance.end.v2, height


def test_forces_on_the_actuator_alone_are_what_the_hopper_has_already(tmp_path, monkeypatch, hopper_c):
    """More viscous friction is a larger b1, a constant pull a larger c at the same L0 + c: within 1e-13 relative."""
    assert main(["--model", str(MODELS / "bearing.py"), "--out", str(tmp_path), "--prefix", "bearing"]) == 0
    monkeypatch.syspath_prepend(tmp_path / "python")
    bearing = importlib.import_module("bearing_solver")
    u, pull = np.array([0.0, 2.0, 3.0]), 6.0
    start = records.State(0.0, 0.0, -1.93, 0.0)
    more = pull / hopper_c.k
    robot = bearing.Robot(*hopper_c.parameters, 50.0, pull)
    same = hopper_c.parameters._replace(b1=hopper_c.b1 + 50.0, c=hopper_c.c + more, L0=hopper_c.L0 - more)
    ours, theirs = bearing.solve(robot, bearing.State(*start), u), hopform_solver.solve(same, start, u)
    np.testing.assert_array_equal(ours.ending, theirs.ending)
    np.testing.assert_allclose(ours.duration, theirs.duration, rtol=1e-13)
    np.testing.assert_allclose(ours.apex, theirs.apex, rtol=1e-12)
    np.testing.assert_allclose(ours.end, theirs.end, rtol=1e-12, atol=1e-15)
    air = records.State(0.05, 0.3, 1.9, 0.01)
    flight = importlib.import_module("bearing_solver.flight").solve_flight(robot, bearing.State(*air))
    as_flown = importlib.import_module("hopform_solver.flight").solve_flight(same, air)
    assert [(p.side, p.limit, p.event) for p in flight.phases] == [(p.side, p.limit, p.event) for p in as_flown.phases]
    np.testing.assert_allclose(flight.gains, as_flown.gains, rtol=1e-13)
    np.testing.assert_allclose(flight.duration, as_flown.duration, rtol=1e-13)
    np.testing.assert_allclose(flight.end, as_flown.end, rtol=1e-12, atol=1e-15)


def test_a_package_of_the_same_name_gives_hopform_the_term(tmp_path):
    """Under the prefix hopform it stands in for hopform_solver: fields, ledger and AED have the term wherever they are shown.

    A term with a share in the energy of the body is refused in a model file, so it is handed to the renderer.
    """
    drag = Quantity("d2", "d_2", "N s/m", "drag of the body", "nonnegative", 0.0)
    write(render(Options(Model((Term("drag", 0, -drag.symbol * v2),), (drag,)))), tmp_path)
    code = """
import csv, dataclasses, io
import numpy as np
import hopform
from hopform import plots, tables
robot = dataclasses.replace(hopform.load_robot("hopper_c"), d2=20.0)
stance = hopform.solve_stance(robot, v2=-1.93, u=2.0, backend="numpy")
run = hopform.simulate(robot, [0.0, 0.01], 3.0, height=0.2, backend="numpy")
(header, *rows) = csv.reader(io.StringIO(tables.stance_csv(stance, 50)))
column = {name: np.array(values, float) for name, *values in zip(header, *rows)}
t = run.times(50)
drawn = [line.get_ydata() for line in plots.plot_stance(stance).axes[3].get_lines()[:2]]
ledger = tables.ledger(stance)
entries = stance.ledger(stance.duration)
print(abs(entries.drag_2) > 0.01)
for error in (
    column["E"] - column["E"][0] - column["AED"],
    np.asarray(run.energy(t).body) - run.aed(t),
    drawn[0] - drawn[1],
    *([float(list(each.cells)[-1])] for each in ledger.columns[1:]),
):
    print(np.abs(error).max() < 1e-12)
print([each for each in ledger.columns[0].cells if "drag" in each])
"""
    paths = os.pathsep.join([str(tmp_path / "python"), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=os.environ | {"PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.stderr, done.stdout.split("\n")) == ("", [*["True"] * 6, "['drag 2']", ""])


# ---- what is refused ----


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("ground", ("'ground spring'", "mass 1", "s^2", "(11)", "-k1")),
        ("drag", ("'drag'", "not linear in v2", "-d2*v2**2")),
        ("undeclared", ("k_emf", "`parameters`")),
        ("current", ("'reaction'", "may not contain u", "gamma2*u")),
        ("damper", ("'damper'", "between the masses", "b12*(v1 - v2)", "contact force", "k y")),
        ("second_spring", ("'second spring'", "between the masses", "contact force", "k y")),
        ("cable", ("'cable'", "mass 2", "F_cable", "end at take-off")),
        ("pushrod", ("'rod'", "mass 1", "b_rod*v2", "depends on v2", "v1 alone")),
    ],
)
def test_a_term_that_no_hop_can_carry_is_refused_by_name(tmp_path, capsys, name, why):
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
