"""Forces beside the spring of the leg: take-off is where the contact force vanishes, and not where the spring's does.

Models with a damper and with a second spring in the leg, with a force on the body in stance, with the foot or all but
the actuator bolted to the ground, are derived, compiled and compared with the 60-digit oracle of mechanisms, which
knows their equations of motion alone. One with a force on the body in flight, too, is compared with the hopper under
another gravity.
"""

import dataclasses
import importlib
import math
import random
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import hopform
from derive.__main__ import main
from hopform._solver import c as native
from hopform._solver.c import C
from hopform._solver.package import Package
from hopform._solver.printed import Python
from hopform_solver.records import Robot
from tests.conformance.random_stances import draw_stances
from tests.oracle.mechanism import builders
from tests.oracle.mechanism.compare import WRONG, Answer, compare
from tools.build_library import compile_sources

pytestmark = pytest.mark.sliced  # a solver is generated and compiled

MODELS = Path(__file__).resolve().parents[1] / "models"
PARAMETERS = ("m_eff", "m_s", "k", "L0", "c", "b1", "b2", "f1", "f2", "gamma2", "g", "x1_min", "x1_max")
DROP = -math.sqrt(2.0 * 9.81 * 0.2 * 0.95)
"""Velocity of hopper_c after the impact of a drop from 20 cm, [m/s]."""

HOPPER = hopform.load_robot("hopper_c")
MOST = 200  # phases


@dataclass(frozen=True)
class Leg:
    """A model as a package and as a library."""

    name: str
    package: Any
    library: native.Library

    def solve(
        self, back_end: str, parameters: tuple[float, ...], start: Mapping[str, float], u: float, horizon: float = 2.0
    ) -> Any:
        """What either back end says, in one form."""
        state = self.package.LegState(*(start[name] for name in ("x1", "v1", "v2", "y")))
        return self.by(back_end).solve_stance(parameters, state, ((0.0, u),), horizon, MOST, np.dtype(np.float64))

    def by(self, back_end: str) -> Any:
        return C(self.library) if back_end == "c" else Python(Package(self.package.__name__))

    def events(self, solved: Any) -> list[tuple[float, str]]:
        words = self.package.records.EVENTS
        return [(float(row[0]), words[row[3]]) for row in solved.phase_rows() if row[3]]

    def answer(self, solved: Any) -> Answer:
        """Up to the ending; x2 counts from the length of the leg without load."""
        ending, duration, end, _, aed = solved.outcome()
        final = {"x1": end.x1, "v1": end.v1, "v2": end.v2, "y": end.y}
        status = self.package.records.ENDINGS[ending]
        return Answer(status, float(duration), self.events(solved), final, {"body": aed})


@pytest.fixture(scope="module")
def legs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, Leg]]:
    made: dict[str, Leg] = {}
    paths = list(sys.path)
    for name in ("damper", "second_spring", "held_body", "cable", "joint", "rig"):
        out, prefix = tmp_path_factory.mktemp(name), f"with_{name}"
        assert main(["--model", str(MODELS / f"{name}.py"), "--out", str(out), "--prefix", prefix]) == 0
        path = out / f"lib{prefix}.so"
        compile_sources(out / "c", path, "-O0")
        sys.path.insert(0, str(out / "python"))
        package = importlib.import_module(f"{prefix}_solver")
        made[name] = Leg(name, package, native.Library(path, prefix, Package(f"{prefix}_solver")))
    yield made
    sys.path[:] = paths


BACK_ENDS = pytest.mark.parametrize("back_end", ["c", "python"])


# ---- hopper_c with a damper in its leg, dropped from 20 cm ----


@BACK_ENDS
@pytest.mark.parametrize(
    ("b12", "u", "takeoff", "apex"),
    [
        (5.0, 0.0, 0.184781, 7.851),
        (5.0, 3.0, 0.189874, 17.156),
        (20.0, 0.0, 0.190742, 1.368),
        (40.0, 3.0, 0.255618, 7.811),
    ],
)
def test_take_off_and_apex_over_the_free_length(b12, u, takeoff, apex, back_end, legs):
    """Printed figures [s, cm]: matrix exponential and an independent integration."""
    solved = legs["damper"].solve(back_end, (*HOPPER.parameters, b12), {"x1": 0, "v1": 0, "v2": DROP, "y": 0}, u)
    ending, duration, end, height, _ = solved.outcome()
    assert legs["damper"].package.records.ENDINGS[ending] == "takeoff"
    assert (round(duration, 6), round(100.0 * height, 3)) == (takeoff, apex)
    assert end.y > 0.004, "the spring is still compressed"


@BACK_ENDS
def test_a_stop_that_takes_the_dampers_force_ends_the_contact(back_end, legs):
    """At the upper stop v_1 vanishes, and with it what the damper carried: the leg takes off at the impact."""
    leg, start = legs["damper"], {"x1": 0.0, "v1": 0.0, "v2": DROP, "y": 0.0}
    solved = leg.solve(back_end, (*HOPPER.parameters, 20.0), start, 3.0)
    ending, duration, end, _, _ = solved.outcome()
    assert leg.package.records.ENDINGS[ending] == "takeoff"
    assert leg.events(solved)[-1] == (pytest.approx(duration, rel=1e-15), "x1_hits_stop")
    assert HOPPER.k * end.y - 20.0 * end.v2 < 0.0
    at_rest = leg.solve(back_end, (*HOPPER.parameters, 40.0), start, 3.0)
    assert [kind for _, kind in leg.events(at_rest)] == ["x2_reverses", "x1_hits_stop"]
    assert leg.events(at_rest)[-1][0] < at_rest.outcome()[1] - 0.005, "with more of it the leg stays down for a while"


# ---- random robots, against the oracle ----


def drawn(name: str, seed: int, count: int) -> Iterator[tuple[tuple[float, ...], dict[str, Any], dict[str, Any]]]:
    """Parameters, start and problem of random robots, degenerate ones among them."""
    choose = random.Random(seed)
    for row in draw_stances(seed, count):
        robot = {key: float(row[key]) for key in PARAMETERS}
        start = {key: float(row[key]) for key in ("x1", "v1", "v2", "y")}
        u = float(row["u"])
        further: tuple[float, ...]
        if name == "damper":
            scale = 2.0 * math.sqrt(robot["k"] * robot["m_s"])
            further = (choose.choice([0.0, scale * 10.0 ** choose.uniform(-3.0, 0.5)]),)
            problem = builders.damped_leg(robot, further[0], **start, u=u, max_phases=MOST)
        elif name == "second_spring":
            longer = choose.choice([0.0, choose.uniform(-0.01, 0.01)])
            further = (robot["k"] * 10.0 ** choose.uniform(-3.0, 0.0), robot["L0"] + robot["c"] + longer)
            problem = builders.second_spring(robot, *further, **start, u=u, max_phases=MOST)
        else:
            further = (robot["m_s"] * robot["g"] * choose.uniform(-0.5, 0.9),)
            problem = builders.pushed_body(robot, further[0], **start, u=u, max_phases=MOST)
        known = set(row.dtype.names)
        yield (
            (*(float(row[key]) if key in known else 0.0 for key in Robot._fields), *further),
            start | {"u": u},
            problem,
        )


@BACK_ENDS
@pytest.mark.parametrize("name", ["damper", "second_spring", "held_body"])
@pytest.mark.parametrize("count", [12, pytest.param(100, marks=pytest.mark.sliced)])
def test_random_stances_are_those_of_the_oracle(count, name, back_end, legs):
    """Events, ending, times, states and AED: right as mixed stability has it."""
    verdicts = []
    for parameters, start, problem in drawn(name, 5, count):
        solved = legs[name].solve(back_end, parameters, start, start["u"])
        verdicts.append(compare(problem, legs[name].answer(solved)))
    assert not [n for n, verdict in enumerate(verdicts) if verdict.outcome == WRONG]
    assert sum(verdict.exact.status == "takeoff" for verdict in verdicts) >= count // 4


def rigs(seed: int, count: int) -> Iterator[tuple[tuple[float, ...], dict[str, float], float, dict[str, Any]]]:
    """Parameters, start, horizon and problem of random hoppers whose leg may pull, for some of their periods."""
    choose = random.Random(seed)
    for row in draw_stances(seed, count):
        robot, u = {key: float(row[key]) for key in PARAMETERS}, float(row["u"])
        start = {key: float(row[key]) for key in ("x1", "v1", "v2")}
        start["y"] = float(row["y"]) * choose.choice([-1.0, 1.0])
        horizon = 12.0 / math.sqrt(robot["k"] / robot["m_eff"] + robot["k"] / robot["m_s"])
        problem = builders.stance(robot, **start, u=u, horizon=horizon, max_phases=MOST)
        del problem["contact"]
        yield tuple(robot.get(key, 0.0) for key in Robot._fields), start | {"u": u}, horizon, problem


def joints(seed: int, count: int) -> Iterator[tuple[tuple[float, ...], dict[str, float], float, dict[str, Any]]]:
    """Parameters, start, horizon and problem of random joints: without spring or friction, with one stop or two."""
    choose = random.Random(seed)

    def over(low: float, high: float, zero: float = 0.0) -> float:
        return 0.0 if choose.random() < zero else math.exp(choose.uniform(math.log(low), math.log(high)))

    for _ in range(count):
        m, k, q = over(1e-3, 50.0), over(1.0, 1e5, 0.2), choose.uniform(-0.05, 0.05)
        b = 2.0 * math.sqrt(max(k, 10.0) * m) * over(1e-3, 3.0, 0.2)
        stops = choose.choice([(-math.inf, math.inf), (-0.06, 0.06), (q, 0.06), (-math.inf, q + 0.01)])
        force = max(k, 10.0) * 0.05
        problem = {
            "m": m, "k": k, "b": b, "q_0": choose.uniform(-0.02, 0.02), "gamma": choose.choice([-1.0, 1.0]) * force,
            "load": force * over(0.01, 1.0, 0.5), "q_min": stops[0], "q_max": stops[1],
        }  # fmt: skip
        f1, f1_minus = (force / m * over(0.01, 1.0, 0.2) for _ in range(2))
        at = {"q": q, "v": choose.uniform(-1.0, 1.0) * math.sqrt(max(k, 10.0) / m) * 0.05}
        u = choose.uniform(-1.0, 1.0)
        parameters = (m, 1.0, k, -problem["q_0"], 0.0, b, 0.0, f1, 0.0, -problem["gamma"], 0.0, *stops, 3.0, 0.0,
                      f1_minus, problem["load"])  # fmt: skip
        start = {"x1": at["q"], "v1": at["v"], "v2": 0.0, "y": at["q"] - problem["q_0"], "u": u}
        friction, horizon = {"F_plus": m * f1, "F_minus": m * f1_minus}, 20.0 * math.sqrt(m / max(k, 10.0))
        asked = builders.joint(**problem, **friction, **at, u=u, horizon=horizon, max_phases=MOST)
        yield parameters, start, horizon, asked


@BACK_ENDS
def test_random_rigs_are_those_of_the_oracle(back_end, legs):
    """Events, ending, times, states and AED; a compression below 0 at the start, too, and no take-off."""
    leg, verdicts = legs["rig"], []
    for parameters, start, horizon, problem in rigs(9, 24):
        verdicts.append(compare(problem, leg.answer(leg.solve(back_end, parameters, start, start["u"], horizon))))
    assert not [n for n, verdict in enumerate(verdicts) if verdict.outcome == WRONG]
    assert {verdict.exact.status for verdict in verdicts} <= {"rest", "horizon"}


@BACK_ENDS
def test_random_joints_are_those_of_the_oracle(back_end, legs):
    """Events, ending, times and states of one mass on a spring to the ground; it may pull, and never takes off."""
    leg, verdicts = legs["joint"], []
    for parameters, start, horizon, problem in joints(7, 60):
        answer = leg.answer(leg.solve(back_end, parameters, start, start["u"], horizon))
        events = [(t, kind.replace("x1_", "q_")) for t, kind in answer.events]
        final = {"q": answer.final["x1"], "v": answer.final["v1"]}
        verdicts.append(compare(problem, dataclasses.replace(answer, events=events, final=final, gains={})))
    assert not [n for n, verdict in enumerate(verdicts) if verdict.outcome == WRONG]
    assert {verdict.exact.status for verdict in verdicts} == {"rest", "horizon"}
    assert sum(len(verdict.exact.events) for verdict in verdicts) > 120


# ---- the controller and the derivatives ----

START = {"x1": 0.02, "v1": 0.1, "v2": -1.6, "y": 0.0}


def tried(leg: Leg, back_end: str, parameters: tuple[float, ...], u: np.ndarray) -> dict[str, np.ndarray]:
    """What candidate currents do, by name."""
    state = leg.package.LegState(*START.values())
    found = leg.by(back_end).try_currents(parameters, [state], u, 2.0, MOST)[0]
    return {name: found[name] for name in found.dtype.names}


@BACK_ENDS
@pytest.mark.parametrize("b12", [2.0, 10.0, 30.0])
def test_the_slopes_of_a_candidate_follow_the_contact_force(b12, back_end, legs):
    """Of the apex, the largest x_1 and the least contact force, against differences, where the events stay the same."""
    u, h = np.linspace(-2.9, 2.9, 41), 1e-6
    below, at, above = (
        tried(legs["damper"], back_end, (*HOPPER.parameters, b12), currents) for currents in (u - h, u, u + h)
    )
    alike = (below["events"] == at["events"]) & (at["events"] == above["events"]) & at["smooth"]
    for name, where in (("apex", at["takes_off"]), ("largest_x1", True), ("least_contact", at["least_contact"] < 1.0)):
        lanes = np.flatnonzero(alike & where)
        assert lanes.size >= 3 or (name, b12) == ("least_contact", 2.0)
        slope = (above[name][lanes] - below[name][lanes]) / (2.0 * h)
        np.testing.assert_allclose(at[f"{name}_u"][lanes], slope, rtol=2e-3, atol=2e-5)


@BACK_ENDS
@pytest.mark.parametrize("b12", [2.0, 10.0])
def test_a_command_is_no_worse_than_the_best_of_a_scan(b12, back_end, legs):
    """Every 1 mA: no apex nearer to the wanted one, and no smaller current that reaches it."""
    leg, parameters, margin = legs["damper"], (*HOPPER.parameters, b12), 1e-3
    u = np.linspace(-HOPPER.u_max, HOPPER.u_max, 6001)
    scan = tried(leg, "c", parameters, u)
    admissible = scan["takes_off"] & (scan["largest_x1"] < HOPPER.x1_max - margin)
    state = leg.package.LegState(*START.values())
    for wanted in (0.02, 0.05, 0.1, 0.3):
        target = (wanted, 0.0, margin, 2.0)
        found = leg.by(back_end).choose_current(parameters, state, target, MOST, np.dtype(np.float64))
        current, apex, _, _ = found
        gaps = np.abs(scan["apex"][admissible] - wanted)
        assert abs(apex - wanted) <= gaps.min() + 1e-9
        crosses = admissible[1:] & admissible[:-1] & ((scan["apex"][1:] > wanted) != (scan["apex"][:-1] > wanted))
        crosses &= scan["events"][1:] == scan["events"][:-1]
        if abs(apex - wanted) < 1e-6 and crosses.any():
            assert abs(current) <= np.abs(u[1:][crosses]).min() + 1e-3


def test_derivatives_through_take_off_are_those_of_differences(legs):
    """By the state, the current and every parameter, the damper's among them; both back ends alike."""
    leg, parameters, u = legs["damper"], (*HOPPER.parameters, 12.0), 2.0
    matrix = leg.solve("c", parameters, START, u).sensitivities()
    np.testing.assert_array_equal(leg.solve("python", parameters, START, u).sensitivities(), matrix)
    columns = importlib.import_module(f"{leg.package.__name__}.elements").COLUMNS

    def rows(inputs: dict[str, float]) -> np.ndarray:
        moved = tuple(inputs[name] for name in leg.package.Robot._fields)
        solved = leg.solve("c", moved, {name: inputs[name] for name in START}, inputs["u"])
        _, duration, end, apex, aed = solved.outcome()
        x2 = end.x1 - end.y + inputs["L0"] + inputs["c"]
        return np.array([duration, end.x1, end.v1, x2, end.v2, apex, aed])

    inputs = {**dict(zip(leg.package.Robot._fields, parameters, strict=True)), **START, "u": u}
    for column, name in enumerate(columns):
        if name in ("x1_min", "x1_max", "u_max", "impact_loss"):
            continue
        h = 1e-5 * max(abs(inputs[name]), 0.01)
        if name == "y":
            h = 1e-6
            ahead = [rows(inputs | {"y": n * h}) for n in range(3)]
            difference = (-3.0 * ahead[0] + 4.0 * ahead[1] - ahead[2]) / (2.0 * h)
        else:
            difference = (rows(inputs | {name: inputs[name] + h}) - rows(inputs | {name: inputs[name] - h})) / (2.0 * h)
        np.testing.assert_allclose(matrix[:, column], difference, rtol=2e-5, atol=1e-7, err_msg=name)


# ---- the flight ----


def fly(
    leg: Leg, parameters: tuple[float, ...], start: Any, ground: float = 0.0, gains: tuple[float, float] | None = None,
    back_end: str = "c",
) -> Any:  # fmt: skip
    """The flight by either back end, with its results as members of `flight`."""
    law = None if gains is None else leg.package.records.Gains(*gains)
    state = leg.package.LegState(*start)
    return leg.by(back_end).solve_flight(parameters, state, ground, law, 3.0, MOST, np.dtype(np.float64))


@pytest.mark.parametrize("share", [0.3, -0.5])
def test_a_constant_force_on_the_body_is_another_gravity(share, legs):
    """In stance, flight, apex, drop and controller; (4) has g and F/m_s in one place."""
    leg, force = legs["cable"], share * HOPPER.m_s * HOPPER.g
    parameters, lighter = (*HOPPER.parameters, force), dataclasses.replace(HOPPER, g=HOPPER.g * (1.0 - share))
    robot, state = leg.package.Robot(*parameters), leg.package.LegState(*START.values())
    other = hopform.solve_stance(lighter, x1=START["x1"], v1=START["v1"], v2=START["v2"], u=2.5)
    flown = other.fly()
    formulas = importlib.import_module(f"{leg.package.__name__}.formulas")
    drop = formulas.touchdown_velocity(robot, 0.2)
    assert drop == pytest.approx(hopform.touchdown_velocity(lighter, 0.2), rel=1e-14)
    for back_end in ("c", "python"):
        ending, duration, end, apex, _ = leg.solve(back_end, parameters, START, 2.5).outcome()
        assert leg.package.records.ENDINGS[ending] == other.status == "takeoff"
        expected = (other.duration, other.end.x1, other.end.v1, other.end.v2, other.apex)
        assert (duration, end.x1, end.v1, end.v2, apex) == pytest.approx(expected, rel=1e-12)
        trial = tried(leg, back_end, parameters, np.array([2.5]))
        slope = float(other.sensitivities["apex", "u"])
        assert float(trial["apex_u"][0]) == pytest.approx(slope, rel=1e-10)
    for solution in (fly(leg, parameters, end), fly(leg, parameters, end, back_end="python")):
        times = np.linspace(0.0, float(solution.flight.duration), 7)
        states = solution.state_at(times)
        assert solution.flight.duration == pytest.approx(flown.duration, rel=1e-12)
        assert solution.flight.apex == pytest.approx(flown.apex, rel=1e-12)
        np.testing.assert_allclose(states.v2, flown.at(np.minimum(times, flown.duration)).v2, rtol=1e-12)
        energy, ledger = solution.energy_at(times)
        np.testing.assert_allclose(energy.total - energy.total[0], sum(ledger), rtol=1e-12, atol=1e-12)
    target = (0.1, 0.0, 1e-3, 2.0)
    command = hopform.choose_current(
        lighter, x1=START["x1"], v1=START["v1"], v2=START["v2"], h_des=0.1, stop_margin=1e-3
    )
    current, height, _, _ = C(leg.library).choose_current(parameters, state, target, MOST, np.dtype(np.float64))
    assert (current, height) == pytest.approx((command.u, command.apex), rel=1e-9)


def test_a_body_that_does_not_fall_has_no_flight(legs):
    leg = legs["cable"]
    parameters = (*HOPPER.parameters, HOPPER.m_s * HOPPER.g)
    with pytest.raises(hopform.HopformError, match="robot"):
        fly(leg, parameters, (0.0, 0.0, 1.0, 0.0))


def test_a_flight_begins_with_a_leg_that_carries_nothing(legs):
    """A second spring shifts where that is."""
    leg, parameters = legs["second_spring"], (*HOPPER.parameters, 300.0, HOPPER.L0 - 0.01)
    end = leg.solve("c", parameters, {"x1": 0.0, "v1": 0.0, "v2": DROP, "y": 0.005}, 2.0).outcome()[2]
    rest = 300.0 * 0.01 / (HOPPER.k + 300.0)
    assert end.y == pytest.approx(rest, abs=1e-15)
    flown = fly(leg, parameters, end, back_end="python").flight
    assert fly(leg, parameters, end).flight.duration == flown.duration
    assert flown.end.y == pytest.approx(rest, abs=1e-15)
    gains = flown.gains.Kp, flown.gains.Kd
    other = hopform.solve_flight(HOPPER, v2=end.v2, x1=end.x1, v1=end.v1, gains=gains)
    assert (flown.duration, flown.apex) == (pytest.approx(other.duration), pytest.approx(other.apex))


def takeoffs(leg: Leg, seed: int, count: int, **fields: float) -> Iterator[tuple[tuple[float, ...], Any, float]]:
    """Robots with a damper in the leg, the ends of their stances, and steps of the ground."""
    draw = random.Random(seed)
    while count:
        robot = dataclasses.replace(HOPPER, b1=draw.uniform(0.0, 80.0), k=10.0 ** draw.uniform(2.5, 4.0), **fields)
        parameters = (*robot.parameters, 10.0 ** draw.uniform(-1.0, 2.0))
        start = {"x1": draw.uniform(0.0, 0.05), "v1": draw.uniform(-0.3, 0.3), "v2": draw.uniform(-3.0, -1.0), "y": 0.0}
        ending, _, end, *_ = leg.solve("c", parameters, start, draw.uniform(0.0, 4.0)).outcome()
        if leg.package.records.ENDINGS[ending] == "takeoff":
            count -= 1
            yield parameters, end, draw.choice((0.0, draw.uniform(-0.05, 0.002)))


def integrated(parameters: tuple[float, ...], start: Any, ground: float, gains: tuple[float, float]) -> Any:
    """(duration, x1, v1, v2, y) at touchdown by an integrator, from N = k y + b12 y' = 0 of a foot without mass.

    The actuator slips without dry friction, under the law, and has no stops.
    """
    robot, damping = Robot(*parameters[:-1]), parameters[-1]

    def rates(_: float, z: Any) -> list[float]:
        x1, v1, _, v2, y = z
        pull = robot.k * robot.c - robot.b1 * v1 - gains[0] * x1 - gains[1] * v1
        return [v1, pull / robot.m_eff, v2, -robot.g, -robot.k * y / damping]

    def foot(_: float, z: Any) -> float:
        return float(z[2] - robot.L0 - robot.c - z[0] + z[4] - ground)

    foot.direction = -1.0  # type: ignore[attr-defined]
    begins = [start.x1, start.v1, start.x1 + robot.L0 + robot.c - start.y, start.v2, start.y]
    run = solve_ivp(rates, (0.0, 3.0), begins, method="DOP853", events=foot, rtol=1e-12, atol=1e-14, max_step=1e-3)
    met = [n for n, t in enumerate(run.t_events[0]) if t > 1e-3]
    x1, v1, _, v2, y = run.y_events[0][met[0]]
    return run.t_events[0][met[0]], x1, v1, v2, y


def test_a_leg_with_a_damper_relaxes_in_flight_as_an_integrator_has_it(legs):
    """Touchdown finds the foot where N = 0 has brought it, and what is left of the compression is passed on."""
    leg, gains = legs["damper"], (900.0, 60.0)
    left = []
    for parameters, end, ground in takeoffs(leg, 5, 12, f1=0.0, x1_min=-math.inf, x1_max=math.inf, u_max=1e6):
        expected = integrated(parameters, end, ground, gains)
        for back_end in ("c", "python"):
            flown = fly(leg, parameters, end, ground, gains, back_end).flight
            found = (flown.duration, flown.end.x1, flown.end.v1, flown.end.v2, flown.end.y)
            assert found == pytest.approx(expected, rel=1e-9, abs=1e-10), parameters
            k = parameters[PARAMETERS.index("k")]
            assert flown.leg_loss == pytest.approx(k * (flown.end.y**2 - end.y**2) / 2.0, rel=1e-12)
        left.append(expected[-1] / end.y)
    assert max(left) > 1e-3 > min(left)


def test_no_foot_of_a_leg_that_relaxes_meets_the_ground_before_its_touchdown(legs):
    """With dry friction, stops and a motor at its limit; both back ends alike."""
    leg = legs["damper"]
    kinds = set()
    for parameters, end, ground in takeoffs(leg, 6, 40):
        robot = leg.package.Robot(*parameters)
        printed = fly(leg, parameters, end, ground, back_end="python")
        flown, solution = fly(leg, parameters, end, ground).flight, printed.flight
        found, expected = (
            [getattr(each, name) for name in ("ending", "event_count", "duration", "apex", "leg_loss")]
            for each in (flown, solution)
        )
        assert found == expected
        times = np.linspace(0.0, float(solution.duration), 4000)
        y = printed.state_at(times).y
        foot = end.y * np.exp(-times * robot.k / parameters[-1]) - y
        assert foot[0] == pytest.approx(-ground, abs=1e-15)
        kinds.add(leg.package.records.FLIGHT_ENDINGS[solution.ending])
        if leg.package.records.FLIGHT_ENDINGS[solution.ending] == "touchdown":
            above = np.flatnonzero(foot > 1e-12)
            assert (foot[above[0] : -1] > -1e-14).all()
            assert abs(foot[-1]) < 1e-14
    assert "touchdown" in kinds
