"""A robot of one's own: `python -m derive --model FILE` for a hopper whose motor has a back-EMF.

Package and library are derived, compiled and compared with the 50-digit reference, which knows the back-EMF as more of
b1, and hop with an integrator; a term that the closed form cannot carry, or that would end at take-off, is refused by
name.
"""

import ast
import contextlib
import csv
import dataclasses
import importlib
import io
import math
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

import hopform
from derive.__main__ import main
from derive.emit.folder import write
from derive.emit.render import render
from derive.model import declare, mechanism
from derive.model_file import read_model
from hopform._cli import tables
from hopform._solver import c as native
from hopform._solver.build import compile_solver
from hopform._solver.c import C
from hopform._solver.choice import DEFAULT
from hopform._solver.package import Package
from hopform.hopping import simulate
from hopform.model import ModelError, derive
from hopform_solver import records
from tests import needs
from tests.conformance.errors import TOLERANCE, plain_errors, rounded
from tests.conformance.flights import condition, outcome, random_flight
from tests.conformance.random_stances import random_robot
from tests.derived import Derived, built, derived, hopper_with, loaded, no_hopper
from tests.oracle import integrator, reference
from tests.oracle.differences import differences, scaled_error, size_of
from tests.oracle.reference.flight import FlightReference
from tests.oracle.reference.flight import solve_flight as reference_flight
from tests.oracle.reference.records import mp

WARNINGS = (
    "-Wall",
    "-Wextra",
    "-Wpedantic",
    "-Wshadow",
    "-Wconversion",
    "-Wdouble-promotion",
    "-Wfloat-equal",
    "-Werror",
)
EVERY_EVENT = set(records.EVENTS.values())
EVERY_MODE = {(one, other) for one in (-1, 0, 1) for other in (-1, 0, 1)}


@pytest.fixture(scope="module")
def driven(store: Path) -> Derived:
    """The hopper with a back-EMF, as the command writes it."""
    return derived(store, "back_emf", "driven")


@pytest.fixture(scope="module")
def package(driven: Derived) -> Any:
    """Its package, imported from there."""
    return driven.package


@pytest.fixture(scope="module")
def library(driven: Derived) -> native.Library:
    """Its library, compiled there."""
    return driven.library


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


def seen(robot: hopform.Robot, solved: Any, dtype: Any, ledger: Any, total: Any) -> Seen:
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
        tuple(hopform.Event(t, records.EVENTS[event]) for t, _, _, event, _ in rows if event in records.EVENTS),
        tuple((mode // 3 - 1, mode % 3 - 1) for _, _, mode, _, _ in rows),
        type(ledger)(*(float(entry[-1]) for entry in ledger)),
        (float(ledger.stop_loss[0]), float(ledger.stop_loss[-1])),
        float(total[-1] - total[0]),
    )


def by_library(robot: hopform.Robot, k_emf: float, start: dict[str, Any], dtype: Any, by: native.Library) -> Seen:
    steps = start["u"] if isinstance(start["u"], tuple) else ((0.0, start["u"]),)
    state = records.LegState(start.get("x1", 0.0), start.get("v1", 0.0), start["v2"], 0.0)
    solved = C(by).solve_stance(
        (*robot.parameters, k_emf), state, steps, start.get("horizon", 2.0), start.get("max_phases", 4096),
        np.dtype(dtype),
    )  # fmt: skip
    times = np.array([0.0, solved.outcome()[1]], dtype)
    return seen(robot, solved, dtype, solved.ledger_at(times), solved.energy_at(times).total)


# ---- the derivatives are those of the reference ----


def in_reference(robot: hopform.Robot, k_emf: float) -> dict[str, Any]:
    """The reference's robot: b1 and k_emf exactly added."""
    parameters = rounded(robot, np.float64)
    return parameters | {"b1": mp.mpf(parameters["b1"]) + mp.mpf(k_emf)}


@pytest.mark.nightly
def test_derivatives_with_a_back_emf_are_those_of_the_reference(package, library):
    """Through a stop, and by the new parameter, which moves whatever it moves as b1 does."""
    robot, k_emf = dataclasses.replace(hopform.load_robot("hopper_c"), x1_max=0.05), 10.0
    start = {"v2": -1.93, "x1": 0.02, "v1": 0.9, "u": 1.5}
    solved = C(library).solve_stance(
        (*robot.parameters, k_emf), records.LegState(0.02, 0.9, -1.93, 0.0), ((0.0, 1.5),), 2.0, 4096,
        np.dtype(np.float64),
    )  # fmt: skip
    assert {records.EVENTS.get(row[3]) for row in solved.phase_rows()[1:]} >= {
        "x1_hits_stop",
        "x1_slips",
        "x1_reverses",
    }
    columns_of_package = importlib.import_module("driven_solver.elements").COLUMNS
    exact, sizes, columns = in_reference(robot, k_emf), [], []
    values = {**rounded(robot, np.float64), **start, "k_emf": k_emf}
    for name in columns_of_package:
        sizes.append(size_of(name, values.get(name, 0.0)))
        known = name not in ("y", "u_max", "impact_loss")
        in_exact = "b1" if name == "k_emf" else name
        columns.append(differences(exact, start, in_exact, sizes[-1]) if known else [0.0] * 7)
    columns[columns_of_package.index("y")] = [math.nan] * 7
    assert columns_of_package[-1] == "k_emf"
    assert scaled_error(solved.sensitivities(), np.array(columns).T, np.array(sizes)) <= 1e-12


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


CASES = pytest.mark.parametrize("name", needs.the_first([*hoppers()], 10))


@pytest.mark.sliced
@CASES
def test_the_library_agrees_with_the_reference(name, package, library):
    """Events and ending are the same; times, states and AED within 1e-12 in the units of the accuracy measure, divided
    by the condition number where that is above 1."""
    robot, k_emf, start = hoppers()[name]
    exact = reference.solve(in_reference(robot, k_emf), **start)
    kept = exact.events[: start.get("max_phases", 4096) - 1]
    stance = by_library(robot, k_emf, start, np.float64, library)
    assert stance.status == exact.status
    assert [event.kind for event in stance.events] == [event.kind for event in kept]
    for of, error in plain_errors(robot, stance, exact, start["v2"]).items():  # type: ignore[arg-type]
        if error > TOLERANCE[np.float64]:
            error /= max(1.0, reference.condition(in_reference(robot, k_emf), of=of, **start))  # noqa: PLW2901
        assert error <= TOLERANCE[np.float64], of


@pytest.mark.sliced
@CASES
def test_the_back_emf_has_an_entry_of_its_own_and_the_ledger_closes(name, package, library):
    """It takes its share of what all viscous friction of the actuator takes,
    and the entries add up to the energy's change.
    """
    robot, k_emf, start = hoppers()[name]
    exact = reference.solve(in_reference(robot, k_emf), **start)
    unit = float(reference.scales(rounded(robot, np.float64), exact, start["v2"])["energy"])
    theirs = {entry: float(value) for entry, value in exact.ledger(exact.duration).items()}
    share = k_emf / (robot.b1 + k_emf) if k_emf else 0.0
    theirs |= {"back_EMF_1": share * theirs["viscous_1"], "viscous_1": (1.0 - share) * theirs["viscous_1"]}
    bound = TOLERANCE[np.float64] * max(unit, *map(abs, theirs.values()))
    stance = by_library(robot, k_emf, start, np.float64, library)
    ours = stance.ledger._asdict()
    at_once, in_all = stance.stop_loss
    entries = package.records.LEDGER_OF_ROBOT
    assert abs(sum(ours[entry] for entry in entries) - at_once - stance.gained) <= bound
    assert abs(sum(ours[entry] for entry in package.records.LEDGER_OF_BODY) - stance.aed) <= bound
    assert abs(in_all - theirs["stop_loss"]) <= bound
    assert ours.keys() == {*records.Ledger._fields, "back_EMF_1"}  # it does nothing to the body
    for entry in ours:
        assert abs(ours[entry] - theirs[entry]) <= bound, entry


@pytest.mark.sliced
def test_the_cases_visit_every_mode_and_every_event(library):
    """A guard of this file: what is not visited is not compared."""
    stances = [by_library(robot, k_emf, start, np.float64, library) for robot, k_emf, start in hoppers().values()]
    assert {event.kind for stance in stances for event in stance.events} == EVERY_EVENT
    assert {mode for stance in stances for mode in stance.modes} == EVERY_MODE


@pytest.mark.sliced
def test_a_take_off_comes_before_what_else_happens_then(package, library, hopper_c):
    """The horizon, say: a stance that is cut at its own duration takes off, and cut 64 eps earlier it does not."""
    for u in (0.0, 2.0, 3.0):
        start = {"v2": -1.93, "u": u}
        whole = by_library(hopper_c, 2.0, start, np.float64, library)
        assert whole.status == "takeoff"
        endings = {
            horizon: by_library(hopper_c, 2.0, start | {"horizon": horizon}, np.float64, library).status
            for horizon in (whole.duration * (1.0 - 64.0 * 2.0**-52), whole.duration)
        }
        assert list(endings.values()) == ["horizon", "takeoff"]


@pytest.mark.sliced
def test_without_back_emf_the_hopper_is_that_of_the_paper(library, hopper_c):
    """To the last bit: what the term adds is an exact zero in every sum."""
    for u in (-3.0, 0.0, 3.0):
        stance = by_library(hopper_c, 0.0, {"v2": -1.93, "u": u}, np.float64, library)
        plain = hopform.solve_stance(hopper_c, v2=-1.93, u=u)
        assert (stance.duration, stance.end, stance.aed) == (plain.duration, plain.end, plain.aed)


@pytest.mark.sliced
def test_the_new_parameter_is_checked_and_documented_like_the_others(package):
    robot = importlib.import_module("driven_solver.robot").Robot
    assert package.Robot._fields[-1] == "k_emf"
    assert package.ROBOT_FIELDS[-1].meaning == "damping by the back-EMF, k_t^2/R"
    with pytest.raises(ValueError, match=r"k_emf must be >= 0 and finite N s/m, got -1\.0"):
        robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, k_emf=-1.0)


# ---- the flight and whole hops ----


def fly_by_library(
    parameters: tuple[float, ...], start: records.LegState, gains: tuple[float, float], by: native.Library,
    horizon: float = 3.0, max_phases: int = 200,
) -> FlightReference:  # fmt: skip
    law, double = records.Gains(*gains), np.dtype(np.float64)
    solved = C(by).solve_flight(parameters, start, 0.0, law, horizon, max_phases, double)
    flight = solved.flight
    _, ledger = solved.energy_at(np.array([flight.duration]))
    ledger = type(ledger)(*(entry[0] for entry in ledger))
    return flown(solved, flight.ending, flight.duration, ledger)


def flown(solved: Any, ending: int, duration: float, ledger: Any) -> FlightReference:
    """A flight in the form of the reference."""
    return FlightReference(
        records.FLIGHT_ENDINGS[ending],
        duration,
        tuple(getattr(solved.flight.end, name) for name in ("x1", "v1", "v2", "y")),
        [hopform.Event(t, records.FLIGHT_EVENTS[event]) for t, *_, event in solved.rows() if event],
        tuple(ledger),
    )


@pytest.mark.sliced
@pytest.mark.parametrize("seed", range(24))
def test_a_flight_with_a_back_emf_is_that_of_the_reference(seed, package, library):
    """Random robots and laws, degenerate ones among them: the same events and ending, errors as of any flight."""
    robot, inputs = random_flight(seed)
    k_emf = 10.0 ** (seed % 5 - 3) * robot.m_eff / 0.1
    start = records.LegState(*(inputs[name] for name in ("x1", "v1", "v2", "y")))
    gains = inputs["gains"] if robot.gamma2 else (0.0, 0.0)
    exact = reference_flight(in_reference(robot, k_emf), **inputs)
    settings = {name: inputs[name] for name in ("horizon", "max_phases")}
    summed = dataclasses.replace(robot, b1=robot.b1 + k_emf)
    theirs = outcome(exact, summed, inputs, float(exact.duration))
    flight = fly_by_library((*robot.parameters, k_emf), start, gains, library, **settings)
    assert flight.status == exact.status
    assert [event.kind for event in flight.events] == [event.kind for event in exact.events]
    ours = outcome(flight, summed, inputs, float(exact.duration))
    error = max(abs(float(one - other)) for one, other in zip(ours, theirs, strict=True))
    if error > TOLERANCE[np.float64]:
        error /= max(1.0, condition(summed, inputs, np.float64, exact))
    assert error <= TOLERANCE[np.float64]


@pytest.mark.sliced
def test_hops_with_a_back_emf_are_those_of_an_integrator(package, library, hopper_c):
    """A drop and four hops over uneven ground: times and states of every touchdown and take-off, and the apexes."""
    k_emf, gains, ground, currents = 35.0, (2500.0, 300.0), [0.0, 0.01, -0.01, 0.005], [3.0, 2.6, 3.0, 2.8]
    exact = integrator.hop(dataclasses.replace(hopper_c, b1=hopper_c.b1 + k_emf), ground, currents, 0.2, gains)
    parameters, loss = (*hopper_c.parameters, k_emf), math.sqrt(1.0 - hopper_c.impact_loss)
    t, x1, v1, v2, level = 0.0, 0.0, 0.0, 0.0, 0.2
    for height, u, touchdown, takeoff in zip(ground, currents, exact.touchdowns, exact.takeoffs, strict=True):
        flight = fly_by_library(parameters, records.LegState(x1, v1, v2, height - level), gains, library)
        assert flight.status == "touchdown"
        t += flight.duration
        x1, v1, v2 = flight.end[0], flight.end[1], flight.end[2] * loss
        assert t == pytest.approx(touchdown[0], abs=1e-8)
        there = [x1, v1, x1 + hopper_c.L0 + height, v2]
        np.testing.assert_allclose(there, touchdown[1], rtol=0, atol=1e-8)
        stance = by_library(hopper_c, k_emf, {"x1": x1, "v1": v1, "v2": v2, "u": u}, np.float64, library)
        assert stance.status == "takeoff"
        t += stance.duration
        assert t == pytest.approx(takeoff[0], abs=1e-8)
        np.testing.assert_allclose(np.array(stance.end) + [0, 0, height, 0], takeoff[1], rtol=0, atol=1e-8)
        _, _, x2, up = takeoff[1]
        apex = x2 - height - hopper_c.L0 + max(up, 0.0) ** 2 / (2.0 * hopper_c.g)
        assert stance.apex == pytest.approx(apex, abs=1e-8)
        x1, v1, v2, level = stance.end.x1, stance.end.v1, stance.end.v2, height


@pytest.mark.sliced
def test_forces_on_the_actuator_alone_are_what_the_hopper_has_already(store, hopper_c):
    """More viscous friction is a larger b1, a constant pull a larger c at the same L0 + c: within 1e-13 relative."""
    made = derived(store, "further_forces", "further")
    further, own = made.package, C(made.library)
    u, pull, hopper = (0.0, 2.0, 3.0), 6.0, DEFAULT.compiled()
    start = records.LegState(0.0, 0.0, -1.93, 0.0)
    more = pull / hopper_c.k
    robot = further.Robot(*hopper_c.parameters, 50.0, pull, 0.0)
    same = hopper_c.parameters._replace(b1=hopper_c.b1 + 50.0, c=hopper_c.c + more, L0=hopper_c.L0 - more)
    for current in u:
        asked = start, ((0.0, float(current)),), 2.0, 64, np.dtype(np.float64)
        ours, theirs = (by.solve_stance(tuple(each), *asked).outcome() for by, each in ((own, robot), (hopper, same)))
        assert ours[0] == theirs[0]
        assert ours[1] == pytest.approx(theirs[1], rel=1e-13)
        assert ours[3] == pytest.approx(theirs[3], rel=1e-12)
        np.testing.assert_allclose(ours[2], theirs[2], rtol=1e-12, atol=1e-15)
    air = records.LegState(0.05, 0.3, 1.9, 0.01)
    flight, as_flown = (
        by.solve_flight(each, air, 0.0, None, 2.0, 64, np.dtype(np.float64))
        for by, each in ((own, tuple(robot)), (hopper, tuple(same)))
    )
    assert [row[3:] for row in flight.rows()] == [row[3:] for row in as_flown.rows()]
    for ours, theirs in ((flight.flight, as_flown.flight),):
        assert (ours.gains.Kp, ours.gains.Kd) == pytest.approx((theirs.gains.Kp, theirs.gains.Kd), rel=1e-13)
        assert ours.duration == pytest.approx(theirs.duration, rel=1e-13)
        ends = [[each.end.x1, each.end.v1, each.end.v2, each.end.y] for each in (ours, theirs)]
        np.testing.assert_allclose(*ends, rtol=1e-12, atol=1e-15)


@pytest.mark.sliced
def test_a_solver_shows_an_element_wherever_the_hopper_shows_its_forces(tmp_path):
    """Fields, ledger and AED have it, in tables and over time."""
    drag = 'viscous(h.x2, parameter("d2", "N s/m", "drag of the body", "nonnegative", 0), "drag", where="stance")'
    write(render(hopper_with(drag, "drag")), tmp_path)
    solver = hopform.load_solver(tmp_path)
    robot = dataclasses.replace(solver.load_robot("hopper_c"), d2=20.0)
    stance = solver.solve_stance(robot, v2=-1.93, u=2.0)
    run = simulate(robot, [0.0, 0.01], 3.0, height=0.2)
    (header, *rows) = csv.reader(io.StringIO(tables.stance_csv(stance, 50)))
    column = {name: np.array(values, float) for name, *values in zip(header, *rows, strict=True)}
    t = run.times(50)
    ledger = tables.ledger(stance)
    assert abs(stance.ledger(stance.duration).drag_2) > 0.01
    for error in (
        column["E"] - column["E"][0] - column["AED"],
        np.asarray(run.energy(t).body) - run.aed(t),
        *([float(list(each.cells)[-1])] for each in ledger.columns[1:]),
    ):
        assert np.abs(error).max() < 1e-12
    assert [each for each in ledger.columns[0].cells if "drag" in each] == ["body, drag"]


# ---- what is refused ----


@pytest.mark.parametrize(
    ("name", "why"),
    [
        (
            "ground",
            ("line 3: spring 'ground spring'", "x1", "order 4, because of 'ground spring', without which it is of"),
        ),
        (
            "hardening",
            (
                "spring 'hardening spring'",
                "k3*(x1 - x2)**2",
                "changes with x1, x2; the Laplace transform needs",
            ),
        ),
        ("undeclared", ("k_emf", "not declared", "`parameter`")),
        ("current", ("the current", "x1 and x2", "one coordinate")),
        ("rail", ("viscous 'rail'", "in flight, too", 'where="stance"')),
    ],
)
def test_an_element_that_no_hop_can_carry_is_refused_by_name(tmp_path, capsys, name, why):
    assert main(["--model", str(no_hopper(tmp_path, name)), "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("derive: ")
    for words in (f"{name}.py", *why):
        assert words in line
    assert not (tmp_path / "out").exists()


HEAD = """
import sympy as sp
from hopform.model import *
J = parameter("J", "kg m^2", "inertia", "positive")
r = parameter("r", "N m s/rad", "a rate", "nonnegative", 0)
q = coordinate("q", "rad", J, "wheel")
"""
"""Six lines that the bad files below begin with."""


LEG = """from hopform.model import *
m = parameter("m", "kg", "mass of the foot", "positive")
M = parameter("M", "kg", "mass of the body", "positive")
b = parameter("b", "N s/m", "damping", "nonnegative", 0)
x = coordinate("x", "m", m)
z = coordinate("z", "m", M)
i = current("i", limit=3)
force(x, 2*i, "motor")
gravity(z, 9.81)
leg = spring(x - z, 100)
"""
"""Ten lines of a leg that stands on nothing yet."""
ONE = """from hopform.model import *
M = parameter("M", "kg", "mass of the body", "positive")
b = parameter("b", "N s/m", "damping", "nonnegative", 0)
z = coordinate("z", "m", M)
gravity(z, 9.81)
leg = spring(0.4 - z, 100)
"""
"""The same of one mass."""


def declared(**fields: str) -> str:
    """A parameter that damps, any of it replaced."""
    given = {"name": '"rate"', "unit": '"N m s/rad"', "meaning": '"a rate"', "domain": '"nonnegative"'}
    given |= {"default": "0.0"} | fields
    arguments = ", ".join(f"{key}={value}" for key, value in given.items())
    return f"viscous(q, r)\nviscous(q, parameter({arguments}), 'further')"


def damping(value: str) -> str:
    return f"viscous(q, {value})"


def with_law(
    motor: str = "torque(q, 0.5*i)", of: str = "i, q", gains: str = "proportional=2", more: str = "name='law'"
) -> str:
    """A motor, and a law that sets its current."""
    return f'i = current("i", limit=3)\n{motor}\nviscous(q, r)\nlaw({of}, {gains}, {more})'


BAD_FILES = {
    "no element": ("", "the file declares no element"),
    "a name that is not there": (
        "springs(q, r)", "line 7: NameError: name 'springs' is not defined, did you mean 'spring'?",
    ),
    "an element that is none": (
        "drag(q, r)", "NameError: name 'drag' is not defined; hopform.model has contact, coordinate, current, force",
    ),
    "a velocity of an included file": (
        "include('hopper').v2", "has no attribute 'v2'; what is included has m_eff, m_s, k, L0, c, b1, ",
    ),
    "a function": ("torque(q, r*cos(q))", "line 7: NameError: name 'cos' is not defined: a force is linear in coordinates"),
    "an old form": ("terms = ()", "the file declares no element"),
    "a parameter declared twice": ('parameter("r", "N", "again")', "the name of a parameter is 'r': it is a parameter"),
    "a coordinate called as a parameter": (
        'coordinate("r", "m", J)', "the name of a coordinate is 'r': it is a parameter already",
    ),
    "a parameter called as the velocity": (
        'parameter("q_dot", "1", "a")', "the name of a parameter is 'q_dot': it is the velocity of q already",
    ),
    "a parameter that no element has": (
        'parameter("s", "N", "a", "nonnegative")\nviscous(q, r)', "the parameter s is declared, and no element has it",
    ),
    "a current that no force has": (
        'current("i")\nviscous(q, r)', "the current i is declared, and no force has it",
    ),
    "two currents": ('current("i")\ncurrent("j")', "the current j: a model has one input, which is i"),
    "an element declared twice": ("viscous(q, r)\nviscous(q, r)", "viscous 'viscous friction' is declared twice"),
    "an element called as another": (
        'viscous(q, r)\nviscous(q, r, "a drag")\nviscous(q, r, "a-drag")',
        "another entry of the ledger has its name, a_drag",
    ),
    "an element called as an entry": ('torque(q, 1, "coulomb")', "another entry of the ledger has its name, coulomb"),
    "an element without a name": (damping("r, ''"), "the name of a viscous must be letters"),
    "an element whose name ends a comment": (damping("r, '*/'"), "got '*/'"),
    "an element whose name is no text": (damping("r, 3"), "the name of a viscous must be letters"),
    "an element whose name is not ASCII": (damping("r, 'gröss'"), "'gröss'"),
    "an element that acts nowhere": (damping("r, where='air'"), "acts in 'air': it must be one of 'both', 'stance'"),
    "an element in a stance without a contact": (
        damping("r, where='stance'"), "acts in 'stance', and the model has no contact",
    ),
    "an element of no coordinate": ("viscous(J, r)", "viscous 'viscous friction' acts on J, which has no coordinate"),
    "friction of two coordinates": (
        'p = coordinate("p", "rad", J)\nspring(p - q, 1)\nfriction(p - q, 1)', "it must be a coordinate",
    ),
    "a damping that is a text": (damping("'-r'"), "damping of viscous 'viscous friction' must be a number"),
    "a damping that is nothing": (damping("[]"), "got []"),
    "a damping that is a truth": (damping("True"), "got True"),
    "a damping that is a matrix": (damping("sp.eye(2)"), "got Matrix("),
    "a function of a parameter": (damping("r*sp.cos(J)"), "cos(J) has no spelling in generated code"),
    "a function of a parameter, the way out": (
        damping("r*sp.cos(J)"), ": declare cos(J) as a parameter of its own, whose value the robot gives",
    ),
    "pi, the way out": (damping("sp.pi*r"), "of parameters and numbers: write the number"),
    "a function of a coordinate": ("spring(sp.sin(q), r)", "sin(q) has no spelling"),
    "a root of a parameter": (damping("sp.sqrt(r)"), "sqrt(r) has no spelling"),
    "a power by a float": (damping("r**0.5"), "r**0.5 has no spelling"),
    "a complex damping": (damping("sp.I*r"), "I has no spelling"),
    "no number": (damping('float("nan")'), "nan has no spelling"),
    "an infinite damping": (damping('float("inf")'), "oo has no spelling"),
    "a number too small": (damping("1e-31"), "a number must be 0 or between 1e-30 and 1e30 in size"),
    "a number beyond floats": (damping('sp.Float("1e-400")'), "between 1e-30 and 1e30"),
    "a number too large": (damping("2**200"), "between 1e-30 and 1e30"),
    "a symbol of no quantity": (damping('sp.Symbol("r")'), "r is not declared: symbols are what `parameter`"),
    "a symbol of another file": ("viscous(sp.Symbol('q', real=True), r)", "q is not declared"),
    "a spring that is not linear, with a parameter": (
        'k = parameter("k", "N m/rad^3", "hardening", "positive")\nspring(q**3, k)',
        "spring 'spring' is not linear: q**3 changes with q by 3*q**2",
    ),
    "a spring that is not linear": ("spring(q**2, 1)", "spring 'spring' is not linear: q**2 changes with q by 2*q"),
    "a stiffness that changes with a coordinate": ("spring(q, r*q)", "stiffness is q*r, which changes with q; the"),
    "a torque that changes with a coordinate": (
        "torque(q, 3 - 5*q)", "which changes with q: declare spring(q, 5) and torque(q, 3); the Laplace transform",
    ),
    "a torque that changes with a square": ("torque(q, -r*q**2)", "which changes with q; the Laplace transform"),
    "a torque that grows with a coordinate": ("torque(q, r*q)", "which changes with q; the Laplace transform"),
    "a torque that changes with another coordinate": (
        'p = coordinate("p", "rad", J)\nspring(q - p, 1)\ntorque(q, -r*p)', "which changes with p; the Laplace transform",
    ),
    "a torque squared in the current": (
        'i = current("i")\ntorque(q, 2*i**2)', "torque 'torque' is 2*i**2: it must be linear in the current i",
    ),
    "a damping by the current": ('i = current("i")\nviscous(q, r*i)', "the current may stand in a force or torque"),
    "a spring that pushes": ("spring(q, -2)", "stiffness is -2: it must be >= 0"),
    "friction that may be negative": (
        'F = parameter("F", "N m", "friction")\nfriction(q, F)',
        "which may be negative for some robot: declare F as 'nonnegative'",
    ),
    "friction with one level": ("friction(q, forward=r)", "has forward= alone"),
    "friction without a level": ("friction(q)", "has either one level, or forward= and backward="),
    "friction at rest": ("viscous(q, r)\nfriction(q, 2, at_rest=1)", "at rest is 1, less than 2 in motion"),
    "a law of a coordinate": (with_law("", "q, q"), "what law 'law' sets must be what `current` returns, got q"),
    "a law on a current": (with_law("", "i, i"), "what law 'law' acts on must be what `coordinate` returns, got i"),
    "a law without a motor": (
        'i = current("i")\nviscous(q, r)\nlaw(i, q, proportional=2)',
        "law 'law' sets i, by which no force acts along q: declare it, torque(q, k_t*i), because the law divides by k_t",
    ),
    "a law behind a motor of either sign": (
        'k_t = parameter("k_t", "N m/A", "constant")\n' + with_law("torque(q, k_t*i)"),
        "the force per i is k_t, which may be 0 or of either sign",
    ),
    "a law with a gain of either sign": (
        'K = parameter("K", "N m/rad", "gain")\n' + with_law(gains="proportional=K"),
        "law 'law': proportional is K, which may be negative for some robot: declare K as 'nonnegative'",
    ),
    "a law that drives": (with_law(gains="proportional=1, derivative=-2"), "derivative is -2: it must be >= 0"),
    "a law in other units": (
        'K = parameter("K", "N/m", "gain", "positive")\n' + with_law(gains="proportional=K"),
        "law 'law': proportional is K in kg/s^2: it must be in N m/rad",
    ),
    "a law of a rate in other units": (with_law(gains="proportional=1, derivative=J"), "it must be in N m s/rad"),
    "a law by the current": (with_law(gains="proportional=2*i"), "the current may stand in a force or torque alone"),
    "a law by a coordinate": (with_law(gains="proportional=2*q"), "proportional is 2*q, which changes with q"),
    "two laws": (with_law() + "\nlaw(i, q, proportional=1, name='other')", "law 'other': a model has one law, which sets i"),
    "a law whose target has a name that is taken": (
        with_law(more="target='r'"), "the name of the target of law 'law' is 'r': it is a parameter already",
    ),
    "a law with a name for no target": (with_law(more="target=3"), "the name of the target of law 'law' is 3"),
    "a law on one of two": (
        'p = coordinate("p", "rad", J)\nspring(q - p, 1)\n' + with_law(), "a law is carried on one mass, and q and p move",
    ),
    "a law on what is held": (
        'p = coordinate("p", "rad", J, held=True)\n' + with_law(of="i, p"), "law 'law' acts on p, which is held",
    ),
    "a law on a leg": (
        "a = spring(coordinate('p', 'rad', J) - q, 1)\ncontact(a)\n" + with_law(),
        "law 'law': a law is carried without a contact: a flight has the gains of its own law",
    ),
    "an inertia that may be 0": (
        'I = parameter("I", "kg m^2", "a", "nonnegative")\nviscous(coordinate("p", "rad", I), r)\nspring(q, 1)',
        "the inertia of p is I, which may be 0 or negative for some robot: declare I as 'positive'",
    ),
    "a stop of no end": ("stop(q)", "stop 'stop' has neither a low end nor a high one"),
    "a stop whose ends are exchanged": ("stop(q, 1, -0.5)", "the low end must be <= the high one, got 1 and -0.5"),
    "two stops": ("stop(q, 0)\nstop(q, None, 1, 'other')", "stop 'other' of q: a coordinate has one `stop`"),
    "a force along an angle": ("force(q, 1)", "force 'force' acts along q, which is in rad: declare it as torque(...)"),
    "gravity along an angle": ("gravity(q, 9.81)", "which is in rad: declare its torque, or spring(...)"),
    "a torque in newtons": (
        'F = parameter("F", "N", "force")\ntorque(q, F)', "torque 'torque': value is F in N: it must be in N m",
    ),
    "a stiffness in newtons per metre": (
        'k = parameter("k", "N/m", "stiffness", "positive")\nspring(q, k)',
        "stiffness k is in N/m, and of a stretch in rad it must be in N m/rad",
    ),
    "a sum of unlike units": (
        'k = parameter("k", "N/m", "stiffness", "positive")\nspring(q, k + r)', "whose units do not fit",
    ),
    "a unit that is none of SI": (declared(unit='"g m"'), "the unit of the parameter rate is 'g m': units are those of SI"),
    "a parameter that may be infinite": (
        declared(domain='"bound"'), "reads rate, which may be infinite: its domain 'bound' is for an end of a stop",
    ),
    "three coordinates that move": (
        'p, s = (coordinate(name, "rad", J) for name in "ps")\nspring(q - p, 1)\nspring(p - s, 1)',
        "3 coordinates move, q, p, s: with nothing held the motion is of order 4 and 2 integrators",
    ),
    "three coordinates that move, one of them held": (
        'p, s = (coordinate(name, "rad", J) for name in "ps")\nspring(q - p, 1)\nspring(p - s, 1)\nviscous(q, r)',
        "of order 5 and an integrator; what is carried are two that move, of order 3 and an integrator at most; it is "
        "carried with q and p held",
    ),
    "more coordinates than are tried": (
        'more = [coordinate(f"p{n}", "rad", J) for n in range(7)]\nfor each in more: viscous(each, r)',
        "8 coordinates move, q, p0, p1, p2, p3, p4, p5, p6; what is carried are two",
    ),
    "two coordinates that nothing ties": (
        'p = coordinate("p", "rad", J)\nviscous(q - p, r)', "nothing ties q to p but for dampers",
    ),
    "two coordinates, of which one has a spring": (
        'p = coordinate("p", "rad", J)\nviscous(q, r)\nspring(p, 1)', "nothing ties q to p: two coordinates that move need",
    ),
    "a gear that may be none": (
        'N = parameter("N", "1", "ratio", "real", 50)\np = coordinate("p", "rad", J)\nspring(q/N - p, 1)\nviscous(q, r)',
        "the ratio of its coordinates is 1/N, which may be 0 or negative for some robot: declare N as 'positive'",
    ),
    "a gear between turn and stroke without its radius": (
        'p = coordinate("p", "m", 2.0)\nN = parameter("N", "1", "ratio", "positive", 50)\nspring(q/N - p, 1)',
        "units do not fit: -p is in m and q/N in 1",
    ),
    "a gear in a leg": (
        'n = parameter("n", "m/rad", "radius", "positive", 0.02)\nz = coordinate("z", "m", 3.0, "body")\ngravity(z, 9.81)\n'
        "viscous(q, r)\ncontact(spring(n*q - z + 0.4, 1000))",
        "in a leg with a contact the actuator has the factor 1 against the body; take q*n [m] as the coordinate in place of "
        "q, with the inertia J/n**2: forces along it are those along q times 1/n, dampings times n**(-2), lengths times n",
    ),
    "two gears": (
        'p = coordinate("p", "rad", J)\nspring(2*q - p, 1)\nspring(q - 2*p, 1, "other")',
        "which changes where q and p move as the other springs and dampers between them let them, and what is carried moves "
        "freely as a whole: with nothing held the motion is of order 4\n",
    ),
    "a spring to the ground of one of two": (
        'p = coordinate("p", "rad", J)\nspring(q - p, 1)\nviscous(q, r)\nspring(p, 1, "return spring")',
        "spring 'return spring' ties p to the ground while q moves, too: with nothing held the motion is of order 4, because "
        "of 'return spring', without which it is of order 3 and an integrator; what is carried has at most order 3 and an "
        "integrator; it is carried with q held",
    ),
    "a stretch with the current in it": (
        'i = current("i", "rad")\nspring(q + i, 1)', "q + i has the current in it, which may stand in a force alone",
    ),
    "a stretch of unlike units": (
        'i = current("i")\nspring(q + i, 1)', "spring 'spring': q + i: units do not fit: q is in 1 and i in A",
    ),
    "a damper with an offset": ("viscous(q - 1, r)", "viscous 'viscous friction' acts on q - 1: a velocity knows no -1"),
    "a spring of nothing": ("spring((q + 1)**2 - q**2 - 2*q, 3)", "which does not change with any coordinate"),
    "stops on both": (
        'p = coordinate("p", "rad", J)\nspring(q - p, 1)\nstop(q, 0)\nstop(p, 0)', "there are stops on p and q",
    ),
    "a current and stops elsewhere": (
        'p = coordinate("p", "rad", J)\ni = current("i")\nspring(q - p, 1)\nstop(q, 0)\ntorque(p, 2.5*i)',
        "the current acts on p, and q has stops",
    ),
    "all held": (
        'from hopform.model import *\nq = coordinate("q", "rad", 1, held=True)\nviscous(q, 1)',
        "line 2: every coordinate is held: nothing moves",
    ),
    "two contacts": ("a = spring(q, 1)\ncontact(a)\ncontact(a)", "contact 'contact': a model has one contact"),
    "a contact of no spring": ("contact(q)", "the leg of contact 'contact' must be what `spring` returns"),
    "a model to include that does not ship": ("include('leg')", "include('leg'): models that ship are "),
    "a syntax error": ("spring(", "line 7: SyntaxError: '(' was never closed"),
    "an indented line": ("  spring(q, 1)", "line 7: IndentationError: unexpected indent"),
    "an entry that is not there": ("{}['terms']", "line 7: KeyError: 'terms'"),
    "a field too few": (
        "\nspring(q)", "line 8: spring(...): missing a required argument: 'stiffness'; it takes stretch, stiffness, name",
    ),
    "an argument of another element": (
        "viscous(q, forward=r)",
        "line 7: viscous(...): missing a required argument: 'damping'; it takes on, damping, name, where",
    ),
    "an argument of another element, beside its own": (
        "viscous(q, r, forward=1)",
        "line 7: viscous(...): got an unexpected keyword argument 'forward'; it takes on, damping, name, where",
    ),
    "an argument that a damper does not take": (
        "spring(q, 1).damper(r, where='stance')",
        "line 7: damper(...): got an unexpected keyword argument 'where'; it takes damping, name",
    ),
    "a maximum": ("torque(q, sp.Max(r, 1))", "Max(1, r) has no spelling in generated code: the closed form takes what is linear"),
    "a size": ("torque(q, sp.Abs(q))", "Abs(q) has no spelling in generated code: the closed form takes what is linear in"),
    "a case": (
        "spring(sp.Piecewise((q, q > 0), (0, True)), r)", "has no spelling in generated code: the closed form takes what is",
    ),
    "a power of a sum": (
        'p = [parameter(f"p{n}", "1", "part") for n in range(12)]\nviscous(q, sum(p)**12)',
        "line 8: damping of viscous 'viscous friction' is too large: multiplied out, the expressions of a file may have 64 "
        "terms in all, of at most 32 factors; declare a part of it as a parameter",
    ),
    "a power of a power": ("viscous(q, ((r + J)**9 + r)**9)", "is too large: multiplied out"),
    "a high power": ("viscous(q, r**10**9)", "is too large: multiplied out"),
    "a high power of a sum": ("viscous(q, (r + J)**10**9)", "is too large: multiplied out"),
    "sums in sums": ("e = r + J\nfor n in range(99): e = (e + r)*e\nviscous(q, e)", "is too large: multiplied out"),
    "brackets in brackets": (
        "e = r\nfor n in range(450): e = 1/(e + J)\nviscous(q, e)", "line 8: RecursionError: maximum recursion depth",
    ),
    "a file of many terms": (
        'p = [parameter(f"p{n}", "1", "part") for n in range(101)]\nfor n in range(0, 99, 2):\n'
        '    viscous(q, p[n] + p[n + 1], f"part {n}")',
        "line 9: damping of viscous 'part 62' is too large",
    ),
    "an import that fails": ("import derive.nothing", "line 7: ModuleNotFoundError: No module named 'derive.nothing'"),
    "an exception of two lines": ("raise OSError('one\\ntwo')", "line 7: OSError: one two"),
    "an exception without a text": ("assert False", "line 7: AssertionError"),
    "an exception from deeper": ("\ndef f():\n    raise ValueError('no')\nf()", "line 9: ValueError: no"),
    "an exit": ("raise SystemExit(0)", "line 7: SystemExit: 0"),
    "an exit by name": ("import sys\nsys.exit('enough')", "line 8: SystemExit: enough"),
    "no end": ("def f(): f()\nf()", "line 7: RecursionError: maximum recursion depth exceeded"),
    "a zero below the line": ("1/0", "line 7: ZeroDivisionError: division by zero"),
    "a unit that is a number": (declared(unit="3"), "the unit of the parameter rate must be a printable line"),
    "a meaning of two lines": (declared(meaning='"a\\nrate"'),
                               "the meaning of the parameter rate must be a printable line"),
    "a unit with a tab": (declared(unit=r'"N\ts"'), "the unit of the parameter rate must be a printable line"),
    "a glyph that is a number": (declared(glyph="3"), "the glyph of the parameter rate"),
    "a domain of one's own": (
        declared(domain='"negative"'), "the domain of the parameter rate must be one of 'real', 'positive'",
    ),
    "a default that is a text": (declared(default='"1"'), "the default of the parameter rate must be >= 0"),
    "a default that is a truth": (declared(default="True"), "got True"),
    "a default that is no number": (declared(default='float("nan")'), "got nan"),
    "a default that is infinite": (declared(default='float("inf")'), "got inf"),
    "a default beyond floats": (declared(default="10**400"), "got 1000"),
    "a default out of the domain": (
        declared(default="-1"), "the default of the parameter rate must be >= 0 and finite or None, got -1",
    ),
    "a unit of a coordinate": ('coordinate("p", "deg", J)', "the unit of the coordinate p must be 'm' or 'rad'"),
    "held by a number": ('coordinate("p", "rad", J, held=1)', "held of the coordinate p must be True or False, got 1"),
    "a velocity called as its coordinate": (
        'coordinate("p", "rad", J, velocity="p")', "the name of the velocity of p is 'p': it must be another",
    ),
    "a coordinate called as a column": (
        'coordinate("status", "rad", J)', "the name of a coordinate is 'status': a column of results has this name",
    ),
    "three levels at rest": ("friction(q, 2, at_rest=(2, 3, 4))", "at_rest of friction 'Coulomb friction' must be a level, or"),
    "no coordinate": ("from hopform.model import *", "robot.py: the file declares no coordinate: `q = coordinate("),
    "a drag of a body that flies": (
        LEG + "contact(leg)\nviscous(z, b)", "line 12: viscous 'viscous friction' on the body would act in flight, too",
    ),
    "a guide of a leg of one mass": (
        ONE + "contact(leg)\nviscous(z, b)", 'one that ends at take-off is declared with where="stance"',
    ),
    "friction of a body that flies": (
        LEG + "contact(leg)\nfriction(z, 1)", "is carried in 'stance' alone, so declare it with where='stance'",
    ),
    "a damper of the leg in stance": (
        LEG + "contact(leg)\nviscous(x - z, b, where='stance')", "acts in 'stance': in the leg it must act in 'both'",
    ),
    "a motor in stance": (
        LEG + "contact(leg)\nforce(x, 3*i, 'more', where='stance')", "acts in stance and in flight, where='both'",
    ),
    "a motor without a limit": (
        LEG.replace(", limit=3", "") + "contact(leg)",
        "line 7: the current i has no limit, which a controller of hops needs: current(..., limit=)",
    ),
    "a loss of more than all": (
        LEG + "contact(leg, 2)", "impact_loss must be a number >= 0 and < 1, or a parameter in 'fraction'",
    ),
    "a leg on what is held": (
        LEG + "p = coordinate('p', 'm', 1, held=True)\ncontact(spring(p, 1))",
        "the spring of its leg stretches nothing that moves",
    ),
    "a mass called as the other one": (
        LEG.replace('"x"', '"x2"') + "contact(leg)", "x2, v2 are the other one in a stance: give it another name",
    ),
    "a parameter called as the compression": (
        LEG + "viscous(x, b + parameter('y', 'N s/m', 'a', 'nonnegative'))\ncontact(leg)",
        "line 11: the name of the parameter y is that of the compression or of the current in a state",
    ),
    "a leg of one mass with stops": (
        ONE + "contact(leg)\nstop(z, 0)", "that is the body, which may have neither stops nor a current",
    ),
    "one direction": (
        'coordinate("p", "rad", J, directions=("up",))', "directions of the coordinate p must be two words",
    ),
}  # fmt: skip

BAD_NAMES = {
    "it must be a str": ("3", "None", '""', '"2r"', '"a b"', '"_r"', '"a-b"', '"r\\n"'),
    "a keyword": ('"lambda"', '"for"', '"def"', '"None"', '"class"', '"yield"', '"import"'),
    "Python reads it as 'fit'": ('"ﬁt"',),
    "travel of the spring": ('"travel"',),
    "a robot with a parameter 'letters'": ('"letters_"',),
}  # fmt: skip
BAD_FILES |= {f"the name {name}": (declared(name=name), why) for why, names in BAD_NAMES.items() for name in names}


def refused_in_one_line(folder: Path, capsys: Any, *options: str) -> str:
    """What the command prints of robot.py in a folder; it writes nothing."""
    out = folder / "out"
    assert main(["--model", str(folder / "robot.py"), "--out", str(out), *options]) == 2
    printed = capsys.readouterr()
    (line,) = printed.err.splitlines()
    assert printed.out == "" and not out.exists()
    assert line.startswith(f"derive: {folder / 'robot.py'}")
    return line


def whole(text: str) -> str:
    """A file of the table: its own lines, or those that follow on HEAD."""
    return text if text.startswith("from hopform") else HEAD + text


WITHOUT_A_LINE = {"no element", "an old form", "no coordinate"}
"""Files that lack something, so that no line of theirs is at fault."""


LONG = "brackets in brackets"


@pytest.mark.parametrize("name", [*(each for each in BAD_FILES if each != LONG), *needs.sliced((LONG,))])
def test_a_file_that_is_no_model_is_refused_by_what_is_wrong_with_it(tmp_path, capsys, name):
    text, why = BAD_FILES[name]
    (tmp_path / "robot.py").write_text(whole(text), "utf-8")
    said = f"{refused_in_one_line(tmp_path, capsys)}\n"
    assert why in said
    assert (re.search(r"robot\.py: line \d+: ", said) is None) == (name in WITHOUT_A_LINE)


GEAR = 'HEAD N = parameter("N", "1", "ratio", "positive", 50)\nq = coordinate("q", "rad", J)\np = coordinate("p", "rad", J)\n'
"""A wheel, a load, and the ratio of the gear between them."""

FOLLOWED = {
    "a parameter that no element has": 's = parameter("s", "N m", "a", "nonnegative")\nviscous(q, r)\nfriction(q, s)',
    "a function of a parameter, the way out": damping('r*parameter("cos_J", "1", "cos(J)", "nonnegative")'),
    "a root of a parameter": damping('parameter("root", "N m s/rad", "root of r", "nonnegative")') + "\nviscous(q, r, 'r')",
    "pi, the way out": damping("3.14159*r"),
    "an element declared twice": "viscous(q, r)\nviscous(q, r, 'second')",
    "a torque that changes with a coordinate": "viscous(q, r)\nspring(q, 5)\ntorque(q, 3)",
    "friction that may be negative": (
        'viscous(q, r)\nF = parameter("F", "N m", "friction", "nonnegative")\nfriction(q, F)'
    ),
    "friction with one level": "viscous(q, r)\nfriction(q, forward=2, backward=0)",
    "a law without a motor": with_law('torque(q, parameter("k_t", "N m/A", "constant", "positive")*i)'),
    "a law behind a motor of either sign": (
        'k_t = parameter("k_t", "N m/A", "constant", "positive")\n' + with_law("torque(q, k_t*i)")
    ),
    "a law with a gain of either sign": (
        'K = parameter("K", "N m/rad", "gain", "nonnegative")\n' + with_law(gains="proportional=K")
    ),
    "an inertia that may be 0": (
        'viscous(q, r)\nI = parameter("I", "kg m^2", "a", "positive")\np = coordinate("p", "rad", I)\nspring(q - p, 1)'
    ),
    "a force along an angle": "viscous(q, r)\ntorque(q, 1)",
    "gravity along an angle": "viscous(q, r)\nspring(q, 9.81)\ntorque(q, 9.81)",
    "three coordinates that move, one of them held": (
        'HEAD q, p = (coordinate(name, "rad", J, held=True) for name in "qp")\ns = coordinate("s", "rad", J)\n'
        "spring(q - p, 1)\nspring(p - s, 1)\nviscous(q, r)\nviscous(s, r)"
    ),
    "two coordinates that nothing ties": 'p = coordinate("p", "rad", J, held=True)\nviscous(q - p, r)',
    "two coordinates, of which one has a spring": "viscous(q, r)",
    "a gear that may be none": GEAR + "spring(q/N - p, 1)\nviscous(q, r)",
    "a gear in a leg": (
        'HEAD n = parameter("n", "m/rad", "radius", "positive", 0.02)\nz = coordinate("z", "m", 3.0, "body")\n'
        'gravity(z, 9.81)\nq = coordinate("q", "m", J/n**2)\nviscous(q, r/n**2)\ncontact(spring(q - z + 0.4, 1000))'
    ),
    "a spring to the ground of one of two": (
        'HEAD q = coordinate("q", "rad", J, held=True)\np = coordinate("p", "rad", J)\nspring(q - p, 1)\n'
        'viscous(q, r)\nviscous(p, r)\nspring(p, 1, "return spring")'
    ),
    "a drag of a body that flies": LEG + "contact(leg)\nviscous(z, b, where='stance')",
    "a guide of a leg of one mass": ONE + "contact(leg)\nviscous(z, b, where='stance')",
    "friction of a body that flies": LEG + "contact(leg)\nviscous(x, b)\nfriction(z, 1, where='stance')",
    "a damper of the leg in stance": LEG + "contact(leg)\nviscous(x - z, b)",
    "a motor in stance": LEG + "contact(leg)\nviscous(x, b)\nforce(x, 3*i, 'more')",
    "a motor without a limit": LEG + "contact(leg)\nviscous(x, b)",
    "a loss of more than all": LEG + "contact(leg, parameter('loss', '1', 'lost', 'fraction', 0))\nviscous(x, b)",
    "a mass called as the other one": LEG.replace('"x"', '"s"') + "contact(leg)\nviscous(x, b)",
    "an argument that a damper does not take": "spring(q, 1).damper(r)",
    "a power of a sum": 'p = parameter("p", "N m s/rad", "power of the sum of twelve parts", "nonnegative")\nviscous(q, p)\n'
                        'viscous(q, r, "r")',
}  # fmt: skip
"""What a refusal advises, done; HEAD in front stands for HEAD without its coordinate."""


@pytest.mark.parametrize("name", needs.the_first([*FOLLOWED], 4))
def test_who_does_what_a_refusal_advises_has_a_model(tmp_path, name):
    text = FOLLOWED[name]
    head = HEAD.replace('q = coordinate("q", "rad", J, "wheel")\n', "") if text.startswith("HEAD ") else HEAD
    file = tmp_path / "robot.py"
    file.write_text(text if text.startswith("from") else head + text.removeprefix("HEAD "), "utf-8")
    assert derive(file).equations_of_motion


@pytest.mark.parametrize(
    "text",
    [
        GEAR + "spring(q/N - p, 1)\nviscous(q, r)",
        GEAR + "spring(p - q/N + 0.1, 1)\nviscous(q, r)\nspring(2*q/N - 2*p, 0, 'another')",
        GEAR.replace('"q", "rad", J', '"q", "rad", J*N**2') + "spring(q - p, 1)\nviscous(q, r*N**2)",
    ],
    ids=["a factor", "of either sign, in all springs", "as one's own coordinate"],
)
def test_a_gear_has_the_motion_of_its_coordinates(tmp_path, text):
    """The characteristic polynomial is det(M s^2 + D s + K) in them, less an integrator."""
    head = HEAD.replace('q = coordinate("q", "rad", J, "wheel")\n', "")
    (tmp_path / "robot.py").write_text(head + text.removeprefix("HEAD "), "utf-8")
    (whole_set,) = (each for each in derive(tmp_path / "robot.py").modes if not each.held)
    found = whole_set.denominator.as_expr()
    found = found.xreplace({each: sp.Symbol(each.name) for each in found.free_symbols})
    s, J, N, r = sp.symbols("s J N r")
    along = sp.Matrix([1 / N, -1])
    refused = (sp.diag(J, J) * s**2 + sp.diag(r, 0) * s + along * along.T).det() / (J**2 * s)
    assert sp.cancel(found - refused) == 0 and whole_set.order == 3


DAMPED = """
from hopform.model import *
m = parameter("m", "kg", "mass of the body", "positive", 3.0)
k = parameter("k", "N/m", "stiffness", "positive", 1200.0)
b = parameter("b", "N s/m", "damper", "nonnegative", 5.0)
h = coordinate("h", "m", m, "body", directions=("up", "down"))
gravity(h, 9.81)
contact(spring(0.4 - h, k).damper(b))
"""


@pytest.mark.sliced
@pytest.mark.parametrize("b", [0.0, 5.0, 90.0])
def test_a_damper_beside_the_spring_of_a_leg_of_one_mass_is_in_the_leg(store, tmp_path, b):
    """It takes off where k y + b y' = 0, which it never is under the largest damping, by matrix exponentials of 30
    digits.
    """
    (tmp_path / "one_leg.py").write_text(DAMPED, "utf-8")
    solver = hopform.load_solver(built(store, tmp_path / "one_leg.py"))
    stance = solver.solve_stance(dataclasses.replace(solver.load_robot("one_leg"), b=b), v2=-1.9)
    with mp.workdps(30):
        m, k, length, g = map(mp.mpf, (3.0, 1200.0, 0.4, 9.81))
        rates = mp.matrix([[0, 1, 0], [-k / m, -b / m, k * length / m - g], [0, 0, 0]])

        def state(t: Any) -> Any:
            return mp.expm(rates * t) * mp.matrix([length, mp.mpf(-1.9), 1])

        def force(t: Any) -> Any:
            return k * (length - state(t)[0]) - b * state(t)[1]

        if b > 50.0:
            assert min(force(mp.mpf(n) / 200) for n in range(400)) > 20.0 and stance.status == "horizon"
            end = mp.mpf(stance.duration)
        else:
            end = mp.findroot(force, stance.duration)
            assert stance.status == "takeoff" and abs(stance.duration - end) <= 1e-14
        assert max(abs(stance.end.x2 - state(end)[0]), abs(stance.end.v2 - state(end)[1])) <= 1e-13


def raised(folder: Path, name: str) -> set[str]:
    """Where the derivation raises what refuses a file: module and line."""
    file = folder / "robot.py"
    file.write_text(whole(BAD_FILES[name][0]), "utf-8")
    found = set[str]()

    def trace(frame: Any, event: str, argument: Any) -> Any:
        if event == "exception" and argument[0] is ModelError:
            found.add(f"{Path(frame.f_code.co_filename).stem}:{frame.f_lineno}")
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        with contextlib.suppress(ModelError):
            read_model(file)
    finally:
        sys.settrace(before)
    return found


def test_every_refusal_of_the_derivation_has_a_row_in_the_table(tmp_path):
    reached = set[str]().union(
        *(raised(tmp_path, name) for name in BAD_FILES if name != LONG and not name.startswith("the name "))
    )
    sites = {}
    for module in (declare, mechanism):
        for node in ast.walk(ast.parse(Path(module.__file__).read_text("utf-8"))):
            if isinstance(node, ast.Raise):
                lines = range(node.lineno, (node.end_lineno or node.lineno) + 1)
                sites[f"{module.__name__}:{node.lineno}"] = {f"{Path(module.__file__).stem}:{line}" for line in lines}
    assert {site for site, lines in sites.items() if not lines & reached} == set()


@pytest.mark.parametrize("data", [b"x = ()\0", b"\xff\xfe", b"PK\x03\x04", b"spring"])
def test_a_file_that_is_no_python_is_refused(tmp_path, capsys, data):
    (tmp_path / "robot.py").write_bytes(data)
    assert "Error" in refused_in_one_line(tmp_path, capsys)


def test_the_help_says_that_a_model_is_run(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    assert "run as Python" in " ".join(capsys.readouterr().out.split())


# ---- what goes ----


ODD = """
\"\"\"Numbers of every kind, quotients of parameters, and names that look like trouble.\"\"\"
import fractions
import numpy
import sympy as sp
from hopform.model import *

h = include("hopper")
names = ("tau", "size_t", "R_a", "L_2", "in_series", "n", "w", "plan", "columns", "stance", "self", "np",
         "isnan", "rates", "a1_y", "p_1", "s_3", "I", "q", "e", "R", "J", "result", "sqrt", "body")
more = [parameter(name, "N s/m", f"meaning of {name}: 5 % of 'it' \u2264 1 | a", "nonnegative", 0) for name in names]
R, S = (parameter(name, "1", "ratio", "positive", sp.Rational(1, 2), glyph=r"\\Omega_{a}") for name in ("r_a", "r_s"))
tau, size = more[:2]
viscous(h.x1, 12.5, "float")
viscous(h.x1, sp.Rational(1, 3) * 1.0, "third")
viscous(h.x1, 1.2345678901234567e-25, "long fraction")
force(h.x1, -0.7, "decimal")
force(h.x1, 2, "whole")
force(h.x1, fractions.Fraction(1, 7), "fraction")
force(h.x1, numpy.float64(0.0), "nothing")
force(h.x1, -h.m_eff * h.g * 1e-3, "weight")
viscous(h.x1, 0.1 + tau**2.0 / R + size / (2 * S + R - R) ** 2, "quotient")
viscous(h.x1, sum(more[2:]), "sum of all")
"""


@pytest.fixture(scope="module")
def odd(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("odd")
    (folder / "robot.py").write_text(ODD, "utf-8")
    assert main(["--model", str(folder / "robot.py"), "--out", str(folder / "out")]) == 0
    return folder / "out"


@pytest.fixture(scope="module")
def odd_package(odd) -> Any:
    return loaded(odd, "odd_solver")


@pytest.mark.nightly
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_numbers_and_quotients_of_parameters_are_what_they_say(odd, odd_package, hopper_c, dtype):
    """The hopper with the same b1 and c, to rounding;
    the library compiles without a warning.
    """
    further = {name: 0.01 * n for n, name in enumerate(odd_package.Robot._fields[len(hopper_c.parameters) :], 1)}
    further |= {"r_a": 0.5, "r_s": 0.25}
    tau, h, *others = list(further.values())[:-2]
    robot = odd_package.Robot(*hopper_c.parameters, *further.values())
    more = 12.5 + 0.1 + 1 / 3 + tau**2 / 0.5 + h / 0.25 + sum(others)
    pull = -0.7 + 2.0 + 1 / 7 - hopper_c.m_eff * hopper_c.g * 1e-3
    shift = pull / hopper_c.k
    same = hopper_c.parameters._replace(b1=hopper_c.b1 + more, c=hopper_c.c + shift, L0=hopper_c.L0 - shift)
    start, eps = odd_package.LegState(0.0, 0.0, -1.93, 0.0), float(np.finfo(dtype).eps)
    library = odd / "libodd.so"
    if not library.exists():
        compile_solver(odd, library, "-O0", *WARNINGS)
    solver = C(native.Library(library, "hopform", Package("odd_solver")))
    asked = ((0.0, 2.0),), 2.0, 64, np.dtype(dtype)
    _, duration, state, _, _ = solver.solve_stance(tuple(robot), start, *asked).outcome()
    _, lasts, end, _, _ = DEFAULT.compiled().solve_stance(tuple(same), records.LegState(*start), *asked).outcome()
    np.testing.assert_allclose(state, end, rtol=200 * eps, atol=20 * eps)
    np.testing.assert_allclose(duration, lasts, rtol=200 * eps)


@pytest.mark.nightly
def test_a_parameter_of_any_accepted_name_stands_in_every_class(odd_package):
    checked = importlib.import_module("odd_solver.robot").Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4)
    assert checked.parameters._fields == odd_package.Robot._fields
    assert checked.parameters[15:] == (0.0,) * (len(checked.parameters) - 17) + (0.5, 0.5)
    assert not [entry for entry in odd_package.Ledger._fields if entry.startswith("nothing") or entry.endswith("_2_2")]


# ---- names and texts of the package ----
