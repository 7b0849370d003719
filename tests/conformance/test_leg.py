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
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import hopform
import hopform.hopping
from hopform._robots import robot_class
from hopform._solver.c import C
from hopform._solver.package import results_like
from hopform_solver.records import Robot
from tests.conformance.legs import MOST, PARAMETERS, Leg, Legs, drawn, joints, rigs
from tests.oracle.mechanism.compare import WRONG, compare

pytestmark = pytest.mark.sliced  # a solver is generated and compiled

DROP = -math.sqrt(2.0 * 9.81 * 0.2 * 0.95)
"""Velocity of hopper_c after the impact of a drop from 20 cm, [m/s]."""

HOPPER = hopform.load_robot("hopper_c")


@pytest.fixture(scope="module")
def legs(store: Path) -> Legs:
    return Legs(store)


# ---- hopper_c with a damper in its leg, dropped from 20 cm ----


@pytest.mark.parametrize(
    ("b12", "u", "takeoff", "apex"),
    [
        (5.0, 0.0, 0.184781, 7.851),
        (5.0, 3.0, 0.189874, 17.156),
        (20.0, 0.0, 0.190742, 1.368),
        (40.0, 3.0, 0.255618, 7.811),
    ],
)
def test_take_off_and_apex_over_the_free_length(b12, u, takeoff, apex, legs):
    """Printed figures [s, cm]: matrix exponential and an independent integration."""
    solved = legs["leg_damper"].solve((*HOPPER.parameters, b12), {"x1": 0, "v1": 0, "v2": DROP, "y": 0}, u)
    ending, duration, end, height, _ = solved.outcome()
    assert legs["leg_damper"].package.records.ENDINGS[ending] == "takeoff"
    assert (round(duration, 6), round(100.0 * height, 3)) == (takeoff, apex)
    assert end.y > 0.004, "the spring is still compressed"


def test_a_stop_that_takes_the_dampers_force_ends_the_contact(legs):
    """At the upper stop v_1 vanishes, and with it what the damper carried: the leg takes off at the impact."""
    leg, start = legs["leg_damper"], {"x1": 0.0, "v1": 0.0, "v2": DROP, "y": 0.0}
    solved = leg.solve((*HOPPER.parameters, 20.0), start, 3.0)
    ending, duration, end, _, _ = solved.outcome()
    assert leg.package.records.ENDINGS[ending] == "takeoff"
    assert leg.events(solved)[-1] == (pytest.approx(duration, rel=1e-15), "x1_hits_stop")
    assert HOPPER.k * end.y - 20.0 * end.v2 < 0.0
    at_rest = leg.solve((*HOPPER.parameters, 40.0), start, 3.0)
    assert [kind for _, kind in leg.events(at_rest)] == ["x2_reverses", "x1_hits_stop"]
    assert leg.events(at_rest)[-1][0] < at_rest.outcome()[1] - 0.005, "with more of it the leg stays down for a while"


# ---- random robots, against the oracle ----


@pytest.mark.parametrize("name", ["leg_damper", "second_spring", "further_forces"])
@pytest.mark.parametrize("count", [12, pytest.param(100, marks=pytest.mark.nightly)])
def test_random_stances_are_those_of_the_oracle(count, name, legs):
    """Events, ending, times, states and AED: right as mixed stability has it."""
    verdicts = []
    for parameters, start, problem in drawn(name, 5, count):
        solved = legs[name].solve(parameters, start, start["u"])
        verdicts.append(compare(problem, legs[name].answer(solved)))
    assert not [n for n, verdict in enumerate(verdicts) if verdict.outcome == WRONG]
    assert sum(verdict.exact.status == "takeoff" for verdict in verdicts) >= count // 4


def test_random_rigs_are_those_of_the_oracle(legs):
    """Events, ending, times and states; a compression below 0 at the start, too, and no take-off."""
    leg, verdicts = legs["rig"], []
    for parameters, start, horizon, problem in rigs(9, 24):
        verdicts.append(compare(problem, leg.answer(leg.solve(parameters, start, start["u"], horizon))))
    assert not [n for n, verdict in enumerate(verdicts) if verdict.outcome == WRONG]
    assert {verdict.exact.status for verdict in verdicts} <= {"rest", "horizon"}


def test_random_joints_are_those_of_the_oracle(legs):
    """Events, ending, times and states of one mass on a spring to the ground; it may pull, and never takes off."""
    leg, verdicts = legs["joint"], []
    for parameters, start, horizon, problem in joints(7, 60):
        answer = leg.answer(leg.solve(parameters, start, start["u"], horizon))
        events = [(t, kind.replace("phi_", "q_")) for t, kind in answer.events]
        final = {"q": answer.final["x1"], "v": answer.final["v1"]}
        verdicts.append(compare(problem, dataclasses.replace(answer, events=events, final=final, gains={})))
    assert not [n for n, verdict in enumerate(verdicts) if verdict.outcome == WRONG]
    assert {verdict.exact.status for verdict in verdicts} == {"rest", "horizon"}
    assert sum(len(verdict.exact.events) for verdict in verdicts) > 120


# ---- the controller and the derivatives ----

START = {"x1": 0.02, "v1": 0.1, "v2": -1.6, "y": 0.0}


def tried(leg: Leg, parameters: tuple[float, ...], u: np.ndarray) -> dict[str, np.ndarray]:
    """What candidate currents do, by name."""
    state = leg.package.LegState(*START.values())
    found = C(leg.library).try_currents(parameters, [state], u, 2.0, MOST)[0]
    return {name: found[name] for name in found.dtype.names}


@pytest.mark.parametrize("b12", [2.0, 10.0, 30.0])
def test_the_slopes_of_a_candidate_follow_the_contact_force(b12, legs):
    """Of the apex, the largest x_1 and the least contact force, against differences, where the events stay the same."""
    u, h = np.linspace(-2.9, 2.9, 41), 1e-6
    below, at, above = (
        tried(legs["leg_damper"], (*HOPPER.parameters, b12), currents) for currents in (u - h, u, u + h)
    )
    alike = (below["events"] == at["events"]) & (at["events"] == above["events"]) & at["smooth"]
    for name, where in (("apex", at["takes_off"]), ("largest_x1", True), ("least_contact", at["least_contact"] < 1.0)):
        lanes = np.flatnonzero(alike & where)
        assert lanes.size >= 3 or (name, b12) == ("least_contact", 2.0)
        slope = (above[name][lanes] - below[name][lanes]) / (2.0 * h)
        np.testing.assert_allclose(at[f"{name}_u"][lanes], slope, rtol=2e-3, atol=2e-5)


@pytest.mark.parametrize("b12", [2.0, 10.0])
def test_a_command_is_no_worse_than_the_best_of_a_scan(b12, legs):
    """Every 1 mA: no apex nearer to the wanted one, and no smaller current that reaches it."""
    leg, parameters, margin = legs["leg_damper"], (*HOPPER.parameters, b12), 1e-3
    u = np.linspace(-HOPPER.u_max, HOPPER.u_max, 6001)
    scan = tried(leg, parameters, u)
    admissible = scan["takes_off"] & (scan["largest_x1"] < HOPPER.x1_max - margin)
    state = leg.package.LegState(*START.values())
    for wanted in (0.02, 0.05, 0.1, 0.3):
        target = (wanted, 0.0, margin, 2.0)
        found = C(leg.library).choose_current(parameters, state, target, MOST, np.dtype(np.float64))
        current, apex, _, _ = found
        gaps = np.abs(scan["apex"][admissible] - wanted)
        assert abs(apex - wanted) <= gaps.min() + 1e-9
        crosses = admissible[1:] & admissible[:-1] & ((scan["apex"][1:] > wanted) != (scan["apex"][:-1] > wanted))
        crosses &= scan["events"][1:] == scan["events"][:-1]
        if abs(apex - wanted) < 1e-6 and crosses.any():
            assert abs(current) <= np.abs(u[1:][crosses]).min() + 1e-3


def test_derivatives_through_take_off_are_those_of_differences(legs):
    """By the state, the current and every parameter, the damper's among them."""
    leg, parameters, u = legs["leg_damper"], (*HOPPER.parameters, 12.0), 2.0
    matrix = leg.solve(parameters, START, u).sensitivities()
    columns = importlib.import_module(f"{leg.package.__name__}.elements").COLUMNS

    def rows(inputs: dict[str, float]) -> np.ndarray:
        moved = tuple(inputs[name] for name in leg.package.Robot._fields)
        solved = leg.solve(moved, {name: inputs[name] for name in START}, inputs["u"])
        _, duration, end, apex, aed = solved.outcome()
        x2 = end.x1 - end.y + inputs["L0"] + inputs["c"]
        return np.array([duration, end.x1, end.v1, x2, end.v2, apex, aed])

    inputs = {**dict(zip(leg.package.Robot._fields, parameters, strict=True)), **START, "u": u}
    inputs |= {"f1_excess": 0.05, "f2_excess": 0.05}  # both sides of which are legal
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
) -> Any:  # fmt: skip
    """The flight, with its results as members of `flight`."""
    law = None if gains is None else leg.package.records.Gains(*gains)
    state = leg.package.LegState(*start)
    return C(leg.library).solve_flight(parameters, state, ground, law, 3.0, MOST, np.dtype(np.float64))


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
    ending, duration, end, apex, _ = leg.solve(parameters, START, 2.5).outcome()
    assert leg.package.records.ENDINGS[ending] == other.status == "takeoff"
    expected = (other.duration, other.end.x1, other.end.v1, other.end.v2, other.apex)
    assert (duration, end.x1, end.v1, end.v2, apex) == pytest.approx(expected, rel=1e-12)
    trial = tried(leg, parameters, np.array([2.5]))
    slope = float(other.sensitivities["apex", "u"])
    assert float(trial["apex_u"][0]) == pytest.approx(slope, rel=1e-10)
    solution = fly(leg, parameters, end)
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


def test_a_second_spring_lengthens_the_leg_and_leaves_its_flight_as_it_was(legs):
    """y is 0 where the leg carries nothing, at both ends of the flight."""
    leg, parameters = legs["second_spring"], (*HOPPER.parameters, 300.0, HOPPER.L0 - 0.01)
    end = leg.solve(parameters, {"x1": 0.0, "v1": 0.0, "v2": DROP, "y": 0.0}, 2.0).outcome()[2]
    flown = fly(leg, parameters, end).flight
    assert end.y == flown.end.y == 0.0
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
        ending, _, end, *_ = leg.solve(parameters, start, draw.uniform(0.0, 4.0)).outcome()
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
    leg, gains = legs["leg_damper"], (900.0, 60.0)
    left = []
    for parameters, end, ground in takeoffs(leg, 5, 12, f1=0.0, x1_min=-math.inf, x1_max=math.inf, u_max=1e6):
        expected = integrated(parameters, end, ground, gains)
        flown = fly(leg, parameters, end, ground, gains).flight
        found = (flown.duration, flown.end.x1, flown.end.v1, flown.end.v2, flown.end.y)
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-10), parameters
        k = parameters[PARAMETERS.index("k")]
        assert flown.leg_loss == pytest.approx(k * (flown.end.y**2 - end.y**2) / 2.0, rel=1e-12)
        left.append(expected[-1] / end.y)
    assert max(left) > 1e-3 > min(left)


def test_no_foot_of_a_leg_that_relaxes_meets_the_ground_before_its_touchdown(legs):
    """With dry friction, stops and a motor at its limit."""
    leg = legs["leg_damper"]
    kinds = set()
    for parameters, end, ground in takeoffs(leg, 6, 40):
        robot = leg.package.Robot(*parameters)
        relaxed = fly(leg, parameters, end, ground)
        solution = relaxed.flight
        times = np.linspace(0.0, float(solution.duration), 4000)
        y = relaxed.state_at(times).y
        foot = end.y * np.exp(-times * robot.k / parameters[-1]) - y
        assert foot[0] == pytest.approx(-ground, abs=1e-15)
        kinds.add(leg.package.records.FLIGHT_ENDINGS[solution.ending])
        if leg.package.records.FLIGHT_ENDINGS[solution.ending] == "touchdown":
            above = np.flatnonzero(foot > 1e-12)
            assert (foot[above[0] : -1] > -1e-14).all()
            assert abs(foot[-1]) < 1e-14
    assert "touchdown" in kinds


# ---- where the leg carries nothing ----

SPRINGS = {"k_2": 400.0, "L_2": 0.41}


def robot_of(leg: Leg, **fields: float) -> hopform.Robot:
    """hopper_c with what the model adds."""
    return robot_class(leg.solver)(**(HOPPER.parameters._asdict() | fields))


def sprung(seed: int, count: int) -> np.ndarray:
    """Columns of parameters: random hoppers with a second spring, of another length and stiffness."""
    draw, base = np.random.default_rng(seed), HOPPER.parameters._asdict()
    k, k_2 = 10.0 ** draw.uniform(1.0, 5.0, (2, count))
    L0, c, longer = draw.uniform(0.05, 1.0, count), draw.choice([0.0, 0.013], count), draw.uniform(-0.05, 0.05, count)
    base |= {"k": k, "L0": L0, "c": c, "m_s": 10.0 ** draw.uniform(-1.0, 1.0, count)}
    return np.array(np.broadcast_arrays(*base.values(), k_2, L0 + c + longer))


def test_a_leg_carries_nothing_where_its_compression_is_0(legs):
    """Exactly by the formulas, and to rounding by the sum of what both springs carry at that height of the body."""
    formulas = legs["second_spring"].solver.package.formulas
    robot = legs["second_spring"].package.Robot(*sprung(3, 1000))
    at_rest = legs["second_spring"].package.LegState(0.02, -0.3, -0.3, 0.0)
    assert not np.any(formulas.contact_of(robot, at_rest)) and not np.any(formulas.contact_force(robot, at_rest))
    x2 = formulas.second_position(robot, 0.02, 0.0)
    carried = robot.k * (0.02 - x2 + robot.L0 + robot.c) + robot.k_2 * (0.02 - x2 + robot.L_2)
    np.testing.assert_allclose(carried / ((robot.k + robot.k_2) * robot.L0), 0.0, atol=2e-15)
    assert np.ptp(x2 - robot.L0 - robot.c) > 0.05


def test_a_leg_that_carries_nothing_starts_and_one_that_pulls_is_refused(legs):
    """A leg that carries nothing is a touchdown: no start at y = 0 is refused, and none takes off at once."""
    leg, count = legs["second_spring"], 300
    parameters, draw = sprung(4, count), np.random.default_rng(4)
    y = draw.choice([0.0, 0.0, 0.0, 5e-324, 1e-3, -5e-324, -1e-17, -1e-3, math.nan], count)
    states = np.array([np.full(count, 0.01), np.zeros(count), draw.uniform(-3.0, -0.5, count), y])
    columns = [*states, np.full(count, 1.0), np.full(count, 2.0), *parameters]
    results = results_like(count, np.dtype(np.float64))
    (status, _), (duration, *_) = results
    C(leg.library).solve_columns(columns, results, {}, MOST, events=False)
    assert (status[y >= 0.0] > 0).all() and (status[~(y >= 0.0)] < 0).all()
    assert (duration[y >= 0.0] > 0.0).all()


def test_a_leg_takes_off_with_a_compression_that_the_next_stance_takes(legs):
    """A damper that hardly acts: y is 0 but for rounding, which does not put it below 0."""
    leg, draw, left = legs["leg_damper"], np.random.default_rng(2), []
    for _ in range(80):
        start = {"x1": 0.0, "v1": 0.0, "v2": draw.uniform(-3.0, -0.5), "y": draw.uniform(0.0, 0.02)}
        solved = leg.solve((*HOPPER.parameters, draw.choice([0.0, 1e-14])), start, draw.uniform(0.0, 3.0))
        ending, _, end, *_ = solved.outcome()
        left += [end.y] if leg.package.records.ENDINGS[ending] == "takeoff" else []
    assert len(left) > 60 and min(left) == 0.0 and max(left) < 1e-15


# ---- whole hops, against an integrator ----

GAINS = (900.0, 60.0)
HOPPING = {
    "leg_damper": {"b12": 6.0, "k": 300.0, "b2": 1.0},
    "second_spring": SPRINGS,
    "cable": {"F_cable": 8.0},
}
FREE = {"f1": 0.0, "f2": 0.0, "x1_min": -math.inf, "x1_max": math.inf, "u_max": 1e6, "impact_loss": 0.05}


def hopped(robot: Any, height: float, u: float, hops: int) -> list[dict[str, Any]]:
    """Touchdowns and take-offs of a drop, (time, x1, v1, x2, v2, compression) each, and apexes, without dry friction.

    Both springs, the damper and the cable act on the two masses; in flight the foot, without mass, is where they carry
    nothing. w = x1 - x2 + foot is how far the leg is compressed, but for a constant.
    """
    part = {name: getattr(robot, name, 0.0) for name in ("b12", "k_2", "L_2", "F_cable")}

    def carried(w: float, rate: float) -> float:
        springs = robot.k * (w + robot.L0 + robot.c) + part["k_2"] * (w + part["L_2"])
        return float(springs + part["b12"] * rate)

    slack = brentq(lambda w: carried(w, 0.0), -2.0, 2.0, xtol=1e-15)

    def accelerations(x1: float, v1: float, v2: float, force: float, pull: float) -> tuple[float, float]:
        actuator = -force + robot.k * robot.c - robot.b1 * v1 - pull
        body = force - robot.m_s * robot.g + part["F_cable"]
        return actuator / robot.m_eff, body / robot.m_s

    def flies(_: float, z: Any) -> list[float]:
        x1, v1, _, v2, w = z
        a1, a2 = accelerations(x1, v1, v2, 0.0, GAINS[0] * x1 + GAINS[1] * v1)
        return [v1, a1, v2, a2, -carried(w, 0.0) / part["b12"] if part["b12"] else 0.0]

    def stands(_: float, z: Any) -> list[float]:
        x1, v1, x2, v2 = z
        force = carried(x1 - x2, v1 - v2)
        a1, a2 = accelerations(x1, v1, v2, force, robot.gamma2 * u)
        return [v1, a1, v2, a2 - robot.b2 * v2 / robot.m_s]

    def first(slope: Any, start: list[float], event: Any, horizon: float) -> tuple[float, Any]:
        event.direction = -1.0
        run = solve_ivp(slope, (0.0, horizon), start, "DOP853", events=event, rtol=1e-12, atol=1e-13, max_step=2e-3)
        n = next(n for n, t in enumerate(run.t_events[0]) if t > 1e-3)
        return float(run.t_events[0][n]), run.y_events[0][n]

    t, z, made = 0.0, [0.0, 0.0, height - slack, 0.0, slack], list[dict[str, Any]]()
    for _ in range(hops):
        took, z = first(flies, list(z), lambda _, z: z[4] - z[0] + z[2], 2.0)
        t += took
        z[3] *= math.sqrt(1.0 - robot.impact_loss)
        hop = {"touchdown": (t, *z[:4], z[0] - z[2] - slack)}
        took, z = first(stands, list(z[:4]), lambda _, z: carried(z[0] - z[2], z[1] - z[3]), 1.0)
        t += took
        fall = robot.g - part["F_cable"] / robot.m_s
        hop |= {"takeoff": (t, *z, z[0] - z[2] - slack), "apex": z[2] + slack + z[3] ** 2 / (2.0 * fall)}
        z = [*z, z[0] - z[2]]
        made.append(hop)
    return made


@pytest.mark.parametrize("name", HOPPING)
def test_hops_are_those_of_an_integrator(name, legs):
    """Touchdowns, take-offs and apexes; what the flight leaves in the leg is what the next stance starts from."""
    robot = robot_of(legs[name], **FREE, **HOPPING[name])
    run = hopform.hopping.simulate(robot, [0.0] * 3, 3.0, height=0.2, gains=GAINS)
    expected = hopped(robot, 0.2, 3.0, 3)
    assert run.status == "completed"
    for hop, other in zip(run.hops, expected, strict=True):
        stance = hop.stance
        start = (hop.touchdown_time, *hop.touchdown, float(stance.compression(0.0)))
        end = (hop.takeoff_time, *stance.end, stance.end_compression)
        assert start == pytest.approx(other["touchdown"], rel=1e-8, abs=1e-9)
        assert end == pytest.approx(other["takeoff"], rel=1e-8, abs=1e-9)
        assert hop.apex == pytest.approx(other["apex"], rel=1e-8)
        assert hop.flight.end_compression == start[-1]
    assert (run.hops[1].flight.end_compression > 1e-12) == (name == "leg_damper")


@pytest.mark.parametrize("name", HOPPING)
def test_energy_is_continuous_over_take_off_and_touchdown(name, legs):
    """That of the robot, but for what the impact takes; a damper holds k y^2/2 in the leg, which the flight loses."""
    robot = robot_of(legs[name], **HOPPING[name])
    run = hopform.hopping.simulate(robot, [0.0, 0.01, -0.01], 3.0, height=0.2)
    assert run.status == "completed" and run.last is not None
    flights = [*(hop.flight for hop in run.hops[1:]), run.last]
    for hop, after, ahead in zip(run.hops, flights, [0.01, -0.02, 0.0], strict=True):
        flight, stance = hop.flight, hop.stance
        held = [robot.k * y**2 / 2.0 * (name == "leg_damper") for y in (flight.end_compression, stance.end_compression)]
        before, begins = flight.energy(flight.duration).total, stance.energy(0.0).total
        assert before + flight.impact_loss + held[0] == pytest.approx(begins, rel=1e-12)
        over_new_ground = after.energy(0.0).total + robot.m_s * robot.g * ahead
        assert stance.energy(stance.duration).total - held[1] == pytest.approx(over_new_ground, rel=1e-12)
    if name != "cable":  # whose work in flight is not the body's energy
        times = np.linspace(0.0, run.duration, 500)
        np.testing.assert_allclose(run.aed(times), run.energy(times).body, rtol=1e-10)


def test_the_controller_knows_what_a_flight_has_left_in_the_leg(legs):
    """The apex is the one that is asked for, though the leg has not relaxed at touchdown."""
    robot, start = robot_of(legs["leg_damper"], b12=5.0), {"x1": 0.0, "v1": 0.0, "v2": DROP, "compression": 0.01}
    touchdown = hopform.hopping.controllers.Touchdown(1, 0.5, ground=0.0, apex=0.2, robot=robot, **start)
    u = hopform.hopping.controllers.FeedForward(0.12)(touchdown)
    assert hopform.solve_stance(robot, **start, u=u).apex == pytest.approx(0.12, abs=1e-9)
    assert abs(hopform.solve_stance(robot, **start | {"compression": 0.0}, u=u).apex - 0.12) > 1e-4


def test_height_and_compression_say_the_same_start_of_a_stance_and_of_batches(legs):
    """x2 counts from the ground, y from where both springs together carry nothing."""
    robot = robot_of(legs["second_spring"], **SPRINGS)
    length = (robot.k * robot.L0 + 400.0 * 0.41) / (robot.k + 400.0)
    y = np.array([0.0, 0.004, 0.03])
    by_height = hopform.solve_stances(robot, v2=-1.9, x1=0.01, x2=0.01 - y + length, u=2.0)
    by_leg = hopform.solve_stances(robot, v2=-1.9, x1=0.01, compression=y, u=2.0, L_2=[[0.41]])
    np.testing.assert_allclose(by_leg.apex[0], by_height.apex, rtol=1e-12)
    for n, each in enumerate(y):
        alone = hopform.solve_stance(robot, v2=-1.9, x1=0.01, compression=each, u=2.0)
        same = hopform.solve_stance(robot, v2=-1.9, x1=0.01, x2=0.01 - each + length, u=2.0)
        assert (alone.apex, alone.duration) == pytest.approx((by_leg.apex[0, n], by_leg.duration[0, n]), rel=1e-12)
        assert (alone.apex, alone.duration) == pytest.approx((same.apex, same.duration), rel=1e-12)
        assert float(alone.at(0.0).x2) == pytest.approx(0.01 - each + length, abs=1e-16)
        assert float(alone.contact_force(0.0)) == pytest.approx(1600.0 * each, rel=1e-15)
    for given in ({"compression": -1e-3}, {"x2": 0.012 + length}):
        with pytest.raises(hopform.HopformError, match="a contact cannot pull"):
            hopform.solve_stance(robot, v2=-1.9, x1=0.01, **given)
        with pytest.raises(hopform.HopformError, match="a contact cannot pull"):
            hopform.solve_stances(robot, v2=[-1.9], x1=0.01, **given)


def test_derivatives_at_a_height_are_those_of_differences(legs):
    """By every parameter: the second spring's stiffness and length move where the leg carries nothing."""
    robot, start = robot_of(legs["second_spring"], **SPRINGS), {"v2": -1.9, "x1": 0.02, "v1": 0.1, "x2": 0.41, "u": 2.0}
    found = hopform.solve_stance(robot, **start).sensitivities
    batch = hopform.solve_stances(robot, **start, k_2=[400.0], sensitivities=True).sensitivities
    np.testing.assert_allclose(batch.matrix[0], found.matrix, rtol=1e-12, atol=1e-15)

    def apex(changed: str, h: float) -> float:
        moved = start | {changed: start[changed] + h} if changed in start else start
        of = robot if changed in start else dataclasses.replace(robot, **{changed: getattr(robot, changed) + h})
        return hopform.solve_stance(of, **moved).apex

    for name in ("x1", "v1", "x2", "v2", "u", "m_s", "k", "L0", "c", "b1", "k_2", "L_2"):
        h = 1e-6 * max(abs(start.get(name, getattr(robot, name, 0.0))), 0.1)
        difference = (apex(name, h) - apex(name, -h)) / (2.0 * h)
        assert found["apex", name] == pytest.approx(difference, rel=1e-5, abs=1e-8), name
