"""Whole stances against the 50-digit reference:
the shipped robots, degenerate poles, random robots, both precisions.
"""

import dataclasses
import math

import numpy as np
import pytest

import hopform
from tests import needs
from tests.conformance.errors import assert_same_stance, plain_errors, reference_for, rounded
from tests.conformance.random_stances import random_robot
from tests.oracle import reference

DROPS = (0.02, 0.05, 0.10, 0.20, 0.30, 0.40)
CURRENTS = (-3.0, -1.5, -0.5, 0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0)

# Figures of an independent solver in 60 digits: drop of 20 cm, 5 % lost at touchdown.
FIGURES = {
    0.0: {"duration": 0.18529, "apex": 0.11816},
    2.0: {"duration": 0.18406, "apex": 0.13990, "x1": 0.00892},
    3.0: {"duration": 0.18813, "apex": 0.22329, "x1": 0.03962, "aed": 1.9216},
}


def other(robot: hopform.Robot, **changes: float) -> hopform.Robot:
    return dataclasses.replace(robot, **changes)


@pytest.mark.parametrize("u", FIGURES)
def test_a_drop_of_20_cm_gives_the_published_figures(hopper_c, u):
    v2 = hopform.touchdown_velocity(hopper_c, 0.20)
    stance = hopform.solve_stance(hopper_c, v2=v2, u=u)
    assert stance.takeoff is not None
    ours = {"duration": stance.duration, "apex": stance.apex, "x1": stance.takeoff.x1, "aed": stance.aed}
    for name, figure in FIGURES[u].items():
        assert ours[name] == pytest.approx(figure, abs=0.6 * 10 ** -(5 - (name == "aed"))), name


@pytest.mark.parametrize("height", DROPS)
def test_hopper_c_agrees_with_the_reference_over_drops_and_currents(hopper_c, height):
    for u in CURRENTS:
        assert_same_stance(hopper_c, v2=hopform.touchdown_velocity(hopper_c, height), u=u)


@pytest.mark.parametrize("name", hopform.ROBOTS)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_shipped_robots_agree_with_the_reference_in_both_precisions(name, dtype):
    robot = hopform.load_robot(name)
    for height in (0.05, 0.2):
        for u in (-2.0, 0.0, 2.6):
            assert_same_stance(robot, dtype, v2=hopform.touchdown_velocity(robot, height), u=u)


def coinciding_poles() -> dict[str, hopform.Robot]:
    """Robots whose cubic has a double or triple root, exactly and nearly; parameters without friction and stops."""
    free = hopform.Robot(m_eff=3.0, m_s=24.0, k=800.0, L0=0.4, b1=90.0, gamma2=-65.0, f1=0.1, f2=0.1)
    robots = {"triple": free}
    for exponent in (-15, -12, -9, -6, -4, -2):
        robots[f"triple, b1 off by 1e{exponent}"] = other(free, b1=90.0 * (1.0 + 10.0**exponent))
        robots[f"triple, k off by 1e{exponent}"] = other(free, k=800.0 * (1.0 - 10.0**exponent))
    # One mass heavy and free of friction: the body's own pair is critically damped to within a ratio of masses.
    light = hopform.Robot(m_eff=1.0, m_s=1.0, k=100.0, L0=0.4, b1=20.0, b2=20.0, gamma2=-20.0)
    robots["equal masses, equal friction: one pole is b/m, exactly"] = light
    robots["equal masses, the pair critically damped too"] = other(light, b1=math.sqrt(800.0), b2=math.sqrt(800.0))
    robots["equal masses, the pair at the real pole"] = other(light, k=100.0, b1=20.0, b2=20.0 * (1 + 2**-52))
    return robots


@pytest.mark.parametrize("name", coinciding_poles())
def test_coinciding_poles_lose_no_digit(name):
    robot = coinciding_poles()[name]
    for u in (0.0, 2.5):
        assert_same_stance(robot, v2=-1.3, v1=0.2, u=u)


@pytest.mark.parametrize("friction", [0.0, 1e-12, 1e-6, 1e-2])
@pytest.mark.parametrize("which", [("b1",), ("b2",), ("b1", "b2")])
def test_vanishing_friction_loses_no_digit(hopper_c, friction, which):
    robot = other(hopper_c, **dict.fromkeys(which, friction))
    for u in (-2.0, 0.0, 3.0):
        assert_same_stance(robot, v2=-1.9, u=u)


SEEDS = range(40)


@pytest.mark.parametrize("seed", needs.the_first(SEEDS, 16))
def test_random_robots_agree_with_the_reference(seed):
    robot, start = random_robot(seed)
    assert_same_stance(robot, **start)


def test_a_step_of_the_current_is_exact(hopper_c):
    steps = [(0.0, 0.0), (0.05, 3.0), (0.10, -3.0)]
    exact = reference.solve(rounded(hopper_c, np.float64), v2=-1.9, u=steps)
    stance = hopform.solve_stance(hopper_c, v2=-1.9, u=steps)
    assert [event.kind for event in stance.events] == [event.kind for event in exact.events]
    assert stance.duration == pytest.approx(float(exact.duration), abs=1e-13)
    assert stance.aed == pytest.approx(float(exact.aed), abs=1e-12)


def test_a_leg_at_rest_stays_down_until_the_next_current(hopper_c):
    """Both masses are held, and the actuator would ring about y = 0 if it slipped."""
    robot = dataclasses.replace(hopper_c, f1=5.0, f2=8.0, b2=60.0)
    steps = [(0.0, 0.0), (1.0, 0.0), (1.2, 3.0)]
    stance = hopform.solve_stance(robot, v2=-1.5, u=steps)
    assert [event.kind for event in stance.events] == ["x2_sticks", "x1_slips", "x2_slips"]
    assert stance.events[1].time == 1.2
    assert stance.status == "horizon"


def test_a_leg_that_rings_about_zero_takes_off_after_a_quarter_of_a_period(hopper_c):
    """With the body held and no force on the actuator but the spring y is a cosine."""
    robot = dataclasses.replace(hopper_c, f1=0.0, b1=0.0, f2=30.0, c=0.0, x1_min=-1.0, x1_max=1.0)
    stance = hopform.solve_stance(robot, v2=0.0, x2=robot.L0 - 0.005, u=0.0)
    assert stance.status == "takeoff"
    assert not stance.events
    assert stance.duration == pytest.approx(0.5 * math.pi * math.sqrt(robot.m_eff / robot.k), rel=1e-15)


def test_states_in_between_agree_with_the_reference(hopper_c):
    v2 = hopform.touchdown_velocity(hopper_c, 0.2)
    exact, _ = reference_for(hopper_c, v2=v2, u=3.0)
    stance = hopform.solve_stance(hopper_c, v2=v2, u=3.0)
    times = np.linspace(0.0, min(stance.duration, float(exact.duration)), 40)
    states = np.array(stance.at(times))
    expected = np.array([[float(value) for value in exact.at(t)] for t in times.tolist()]).T
    np.testing.assert_allclose(
        states / [[0.1], [1], [0.1], [1]], expected / [[0.1], [1], [0.1], [1]], rtol=0, atol=1e-12
    )


LEDGERS = [{}, {"u": 2.0}, {"u": -3.0, "v1": 0.3, "x1": 0.02}, {"u": [(0.0, 3.0), (0.06, -3.0)], "x1": 0.07, "v1": 0.5}]


@pytest.mark.parametrize("start", LEDGERS)
@pytest.mark.parametrize("change", needs.the_first([{}, {"b1": 0.0, "b2": 0.0}, {"c": 0.01}, {"b1": 2e5}], 3))
def test_each_entry_of_the_ledger_equals_its_own_quadrature(hopper_c, start, change):
    robot = other(hopper_c, **change)
    exact = reference.solve(rounded(robot, np.float64), v2=-1.93, **start)
    stance = hopform.solve_stance(robot, v2=-1.93, **start)
    unit = robot.m_s * 1.93**2 / 2.0
    for share in (0.3, 0.7, 1.0):
        t = share * math.nextafter(min(stance.duration, float(exact.duration)), 0.0)
        ours, theirs = stance.ledger(t)._asdict(), exact.ledger(t)
        for name, value in ours.items():
            assert abs(value - float(theirs[name])) / unit <= 1e-12, (name, t)


DAMPED = hopform.Robot(
    m_eff=1.034e-3, m_s=0.3402, k=474369.2, L0=0.4, c=0.0, b1=45.936, b2=4020.585, f1=0.04516, f2=2.04127, gamma2=1.0
)  # fmt: skip
OFF_A_STOP = hopform.Robot(
    m_eff=1e-4, m_s=2.0535250660032034e-3, k=7.4989418e-4, L0=7.4989418e-4, c=-7.4989418e-4, b1=7.4989418e-4,
    b2=7.4989418e-4, f1=4.869675e-4, f2=7498.94189, gamma2=0.0, g=1154.782, x1_min=-1154.782, x1_max=115.4782
)  # fmt: skip
FADED = {
    "both move": (DAMPED, {"x2": 0.4 - 0.00032806396484375, "v2": -1.185, "u": 0.046}),
    "the actuator moves": (
        other(DAMPED, b1=200.0, b2=1.0, f2=400.0),
        {"x2": 0.4 - 0.00030517578125, "v2": 0.0, "u": 0.046},
    ),
    "the actuator comes off its stop": (
        OFF_A_STOP,
        {"x2": -0.1, "v1": 1154.782, "v2": 1154.782, "u": 0.0, "horizon": 336.0},
    ),
}


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("case", FADED)
def test_a_take_off_when_nearly_all_has_faded_comes_at_its_time_to_the_last_digits(case, dtype):
    """y creeps to its zero from a value many times what it still moves by: the start and the rise would cancel."""
    robot, start = FADED[case]
    stance = hopform.solve_stance(robot, dtype=dtype, **start)
    exact, _ = reference_for(robot, dtype, **start)
    assert stance.status == exact.status == "takeoff" and len(stance.events) == len(exact.events)
    assert stance.duration == pytest.approx(float(exact.duration), rel=20.0 * float(np.finfo(dtype).eps), abs=0.0)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_leg_that_hardly_any_spring_draws_takes_off_where_drag_and_start_say(dtype):
    """k over the mass is 0 in the type: y = y_0 - v_2 (1 - exp(-p t))/p has faded when it meets 0,
    but settles nowhere.
    """
    k = 2048.0 * float(np.finfo(dtype).smallest_subnormal)
    robot = hopform.Robot(
        m_eff=1.0, m_s=2.0**20, k=k, L0=0.5, c=0.0, b1=1.0, b2=10.0 * 2.0**20, f1=1.0, f2=0.0, gamma2=1.0, g=1e-30
    )  # fmt: skip
    stance = hopform.solve_stance(robot, x2=0.3125, v2=2.0, dtype=dtype)
    assert stance.status == "takeoff" and not stance.events
    exact = -np.log1p(-10.0 * 0.1875 / 2.0) / 10.0
    assert stance.duration == pytest.approx(exact, rel=20.0 * float(np.finfo(dtype).eps), abs=0.0)


def creeping_robot(seed: int, ratio: float) -> tuple[hopform.Robot, dict[str, float]]:
    """Heavily damped, and drawn to y = 0 by forces that are small beside that of the spring at the start."""
    draw = np.random.default_rng(seed)
    m_eff, m_s, k, y = 10.0 ** draw.uniform((-3.0, -3.0, 0.0, -3.0), (1.0, 1.0, 6.0, 0.0))
    b1, b2 = 2.0 * np.sqrt(k * np.array((m_eff, m_s))) * 10.0 ** draw.uniform(-0.5, 2.0, 2)
    force = ratio * k * y
    body_slips = draw.random() < 0.5
    of_body = 0.5 * force if body_slips else force * 10.0 ** draw.uniform(0.0, 4.0)
    robot = hopform.Robot(
        m_eff=m_eff, m_s=m_s, k=k, L0=0.0, c=0.0, b1=b1, b2=b2, f1=0.5 * force / m_eff, f2=of_body / m_s, gamma2=1.0,
        g=1e-30
    )  # fmt: skip
    v = draw.choice((0.0, 10.0 ** draw.uniform(-3.0, 1.0)))
    moving = {"v1": 0.0, "v2": v} if body_slips else {"v1": -v, "v2": 0.0}
    return robot, {"x2": -y, "u": 2.0 * force, "horizon": 1e6} | moving


@pytest.mark.parametrize("seeds", needs.the_first([range(2), range(2, 16)]), ids=str)
@pytest.mark.parametrize("ratio", [1e-1, 1e-3, 1e-5, 1e-7, 1e-9])
def test_what_creeps_on_by_small_forces_keeps_its_events_and_the_digits_that_the_start_leaves(ratio, seeds):
    """The zero of a velocity is where a start and a rise cancel:
    what is small beside them has fewer digits by as much.
    """
    for seed in seeds:
        robot, start = creeping_robot(seed, ratio)
        exact, inputs = reference_for(robot, **start)
        stance = hopform.solve_stance(robot, **inputs)
        assert stance.status == exact.status
        assert [event.kind for event in stance.events] == [event.kind for event in exact.events]
        error = plain_errors(robot, stance, exact, inputs["v2"])["state"]
        if error > 1e-13 / ratio:
            error /= max(1.0, reference.condition(rounded(robot, np.float64), of="state", **inputs))
        assert error <= 1e-13 / ratio


def test_the_aed_equals_the_difference_of_the_energy(hopper_c):
    for u in CURRENTS:
        stance = hopform.solve_stance(hopper_c, v2=-1.93, u=u)
        ledger = stance.ledger(stance.duration)
        gained = stance.energy(stance.duration).body - stance.energy(0.0).body
        predicted = ledger.spring_work + ledger.viscous_2 + ledger.coulomb_2
        assert stance.aed == pytest.approx(gained, abs=1e-12)
        assert stance.aed == pytest.approx(predicted, abs=1e-12)


def test_the_ledger_closes_at_every_time(hopper_c):
    stance = hopform.solve_stance(hopper_c, v2=-1.93, v1=0.4, x1=0.05, u=-3.0)
    times = np.linspace(0.0, stance.duration, 101)
    ledger = stance.ledger(times)
    change = stance.energy(times).total - stance.energy(0.0).total
    np.testing.assert_allclose(sum(ledger[:7]), change, rtol=0, atol=1e-12)


def test_velocity_lost_at_a_stop_at_the_start_is_in_the_ledger_and_no_event(hopper_c):
    stance = hopform.solve_stance(hopper_c, v2=-1.9, v1=-0.2, x1=0.0)
    assert stance.ledger(0.0).stop_loss == pytest.approx(-25.0 * 0.2**2 / 2.0, rel=1e-15)
    assert stance.events[0].time > 0.0
    assert stance.at(0.0).v1 == 0.0
