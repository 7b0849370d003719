"""Ties and touches whose truth is known by algebra, over robots of every size:
a touch is no crossing, a take-off wins a tie.

Each test draws a few hundred robots, because what rounding makes of a touch is luck. Truth is exact for the rounded
inputs, whatever they are: the touches come from y = 0, v1 = v2 and no friction, the take-off of a locked actuator is
2 (pi - atan(v w/g))/w, w^2 = k/m_s.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import mpmath
import numpy as np
import pytest

import hopform
from hopform._solver.package import STATUS
from hopform_solver.records import EVENTS, ROBOT_FIELDS
from tests import needs
from tests.columns import solved
from tests.oracle import reference

COUNT = 400
G, REST = 9.81, 0.4
NAMES = [field.name for field in ROBOT_FIELDS]
DEFAULTS = {"L0": 0.4, "g": G, "gamma2": -1.0, "x1_min": -math.inf, "x1_max": math.inf, "u_max": 3.0}

both_precisions = pytest.mark.parametrize("dtype", [np.float64, np.float32])


def over(rng: np.random.Generator, low: float, high: float) -> Any:
    return np.exp(rng.uniform(np.log(low), np.log(high), COUNT))


def solve(dtype: Any, robot: dict[str, Any], horizon: Any, **start: Any) -> tuple[list[str], list[int]]:
    """Endings in words and numbers of events."""
    columns = [robot.get(name, DEFAULTS.get(name, 0.0)) for name in NAMES]
    robots = np.stack([np.broadcast_to(column, COUNT) for column in columns], axis=-1).astype(dtype)
    inputs = [np.asarray(start.get(name, 0.0), dtype=dtype) for name in ("x1", "v1", "v2", "y", "u")]
    found = solved(*inputs, horizon, robots=robots)
    return [STATUS[int(code)] for code in found["status"]], found["event_count"].tolist()


def locked(dtype: Any, seed: int) -> tuple[dict[str, Any], Any, list[Any]]:
    """Robots of one spring and one mass, how fast they fall in, and when they take off, to 50 digits,
    for the rounded inputs.
    """
    rng = np.random.default_rng(seed)
    k, m_s, share = over(rng, 1.0, 2e4), over(rng, 0.1, 10.0), over(rng, 0.4, 7.0)
    v = share * G / np.sqrt(k / m_s)
    k, m_s, v = (values.astype(dtype) for values in (k, m_s, v))
    times = []
    with mpmath.workdps(50):
        g = mpmath.mpf(float(dtype(G)))
        for lane in zip(k, m_s, v, strict=True):
            stiffness, mass, speed = (mpmath.mpf(float(value)) for value in lane)
            w = mpmath.sqrt(stiffness / mass)
            times.append(2 * (mpmath.pi - mpmath.atan(speed * w / g)) / w)
    return {"m_eff": 1.0, "m_s": m_s, "k": k, "x1_min": 0.0, "x1_max": 0.0}, -v, times


@both_precisions
def test_a_take_off_wins_against_a_horizon_that_is_the_next_number_after_it(dtype):
    """And 64 units in the last place earlier the horizon wins."""
    robot, v2, times = locked(dtype, 1)
    nearest = np.array([dtype(float(t)) for t in times])
    early = np.array([mpmath.mpf(float(h)) < t for h, t in zip(nearest, times, strict=True)])
    horizon = np.where(early, np.nextafter(nearest, dtype(np.inf)), nearest)
    assert solve(dtype, robot, horizon, v2=v2)[0] == ["takeoff"] * COUNT
    before = horizon * dtype(1.0 - 64.0 * np.finfo(dtype).eps)
    assert solve(dtype, robot, before, v2=v2)[0] == ["horizon"] * COUNT


def test_a_spring_force_that_touches_zero_once_a_period_is_no_take_off():
    """y = A (1 - cos w t), A > 0, between two masses that fall together; three touches, neither mass ever turns."""
    rng = np.random.default_rng(2)
    k, m_s, ratio = over(rng, 1.0, 2e4), over(rng, 0.1, 10.0), over(rng, 0.05, 20.0)
    m_eff = m_s * ratio
    w = np.sqrt(k * (1.0 / m_s + 1.0 / m_eff))
    v = -10.0 * G * (1.0 + 1.0 / ratio) / w - 1.0
    got = solve(np.float64, {"m_eff": m_eff, "m_s": m_s, "k": k}, 3.3 * 2.0 * np.pi / w, v1=v, v2=v, u=m_s * G)
    assert got == (["horizon"] * COUNT, [0] * COUNT)


@both_precisions
def test_a_velocity_that_fades_away_never_turns_back(dtype):
    """Over 80 time constants: a body held by friction, an actuator without any that creeps to its equilibrium."""
    rng = np.random.default_rng(3)
    k, m_eff, zeta = over(rng, 50.0, 3000.0), over(rng, 0.15, 7.0), rng.uniform(1.05, 4.0, COUNT)
    b1 = 2.0 * zeta * np.sqrt(k * m_eff)
    slow = (b1 - np.sqrt(b1**2 - 4.0 * k * m_eff)) / (2.0 * m_eff)
    fast = b1 / m_eff - slow
    first, second = 0.02 * rng.uniform(0.1, 1.0, COUNT), 0.01 * rng.uniform(0.0, 1.0, COUNT)
    got = solve(
        dtype, {"m_eff": m_eff, "m_s": 1.0, "k": k, "b1": b1, "f2": 1e5}, 80.0 / slow,
        v1=first * slow + second * fast, y=0.1 - first - second, u=0.1 * k,
    )  # fmt: skip
    assert got == (["horizon"] * COUNT, [0] * COUNT)


def test_a_velocity_that_pauses_once_a_period_goes_on():
    """v2 = A (t - sin(w t)/w), whose rate touches zero, far from zero itself:
    the spring just carries the body at the start.
    """
    rng = np.random.default_rng(4)
    k, m_s = (2.0 ** np.round(np.log2(over(rng, low, high))) for low, high in ((10.0, 2e4), (0.1, 10.0)))
    m_eff, y = m_s * over(rng, 1.1, 20.0), m_s * G / k  # exactly
    w = np.sqrt(k * (1.0 / m_s + 1.0 / m_eff))
    robot = {"m_eff": m_eff, "m_s": m_s, "k": k, "c": y * over(rng, 2.0, 1e5)}
    assert solve(np.float64, robot, 8.3 * 2.0 * np.pi / w, y=y) == (["horizon"] * COUNT, [0] * COUNT)


def test_two_masses_that_a_step_of_the_current_lets_go_at_once_are_two_phases():
    """Also where only one is left: the body is exactly at its threshold, and follows an actuator that gives way."""
    robot = hopform.Robot(m_eff=1.0, m_s=1.0, k=100.0, L0=0.4, f1=0.1, f2=8.0, g=8.0, gamma2=1.0)
    start = {"v2": 0.0, "u": [(0.0, 0.0), (0.1, 5.0)]}
    free = hopform.solve_stance(robot, **start)
    assert [event.kind for event in free.events] == ["x1_slips", "x2_slips"]
    assert [event.time for event in free.events] == [0.1, 0.1]
    for most in (1, 2):
        stance = hopform.solve_stance(robot, max_phases=most, **start)
        assert (stance.status, len(stance.phases)) == ("too_many_phases", most)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("stops", [("x1_min",), ("x1_max",)])
def test_a_stop_that_is_touched_where_the_actuator_turns_is_no_event(dtype, stops):
    """Without friction, from rest at a stop and away from it, it comes back to just there:
    a reversal every half period.
    """
    rng = np.random.default_rng(5)
    k, m_eff, x1 = over(rng, 1.0, 2e4), over(rng, 0.1, 10.0), rng.uniform(-0.05, 0.05, COUNT)
    away, depth = (1.0 if stops == ("x1_min",) else -1.0), rng.uniform(0.001, 0.04, COUNT)
    y = 0.1 - away * depth / 2.0  # it oscillates about 0.1 m of compression
    robot = hopform.Robot(m_eff=1.0, m_s=1.0, k=1.0, L0=0.4, f2=1e5, gamma2=-1.0, g=G, u_max=1e4)
    batch = hopform.solve_stances(
        robot, k=k, m_eff=m_eff, x1=x1, x2=x1 - y + 0.4, v2=0.0, u=0.1 * k, horizon=6.5 * np.pi * np.sqrt(m_eff / k),
        events=True, dtype=dtype, **{name: x1 for name in stops},
    )  # fmt: skip
    reverses = next(number for number, word in EVENTS.items() if word == "x1_reverses")
    assert (batch.words == "horizon").all()
    assert (batch.event_count == 6).all()
    assert (batch.event_kind == reverses).all()
    half_periods = np.arange(1, 7) * (np.pi * np.sqrt(m_eff / k))[:, np.newaxis]
    assert np.abs(batch.event_time / half_periods - 1.0).max() < (1e-12 if dtype is np.float64 else 1e-5)


def edges(dtype: Any, seed: int, count: int) -> Iterator[tuple[dict[str, float], dict[str, float], list[str]]]:
    """Robots of which a mass, or both, starts at rest within 4 ulp of its level of friction: the robot, the start, and
    the names of these levels.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        m_eff, m_s, k = (math.exp(rng.uniform(math.log(a), math.log(b))) for a, b in ((1, 50), (1, 10), (500, 5000)))
        b1, b2 = (rng.choice([0.0, rng.uniform(0.0, most)]) for most in (400.0, 20.0))
        gamma2, u, y = -rng.uniform(5.0, 100.0), rng.choice([0.0, rng.uniform(-3.0, 3.0)]), rng.uniform(0.001, 0.08)
        v1, v2 = rng.uniform(-1.0, 1.0), rng.uniform(-2.0, 2.0)
        numbers = [float(dtype(value)) for value in (m_eff, m_s, k, b1, b2, gamma2, u, y, v1, v2, G)]
        m_eff, m_s, k, b1, b2, gamma2, u, y, v1, v2, g = numbers
        x2 = float(dtype(REST) - dtype(y))
        y = float(dtype(REST)) - x2  # exact
        level = {"f1": abs(gamma2 * u + k * y) / m_eff, "f2": abs(k * y / m_s - g)}
        resting = [["f1"], ["f2"], ["f1", "f2"]][int(rng.integers(3))]
        for name, value in level.items():
            level[name] = float(dtype(value if name in resting else rng.uniform(0.05, 2.0)))
            for _ in range(int(rng.integers(0, 5)) if name in resting else 0):
                level[name] = float(np.nextafter(dtype(level[name]), dtype(rng.choice([0.0, np.inf]))))
        robot = dict(zip(("m_eff", "m_s", "k", "b1", "b2", "gamma2"), (m_eff, m_s, k, b1, b2, gamma2), strict=True))
        start = {"v1": 0.0 if "f1" in resting else v1, "v2": 0.0 if "f2" in resting else v2, "u": u, "x2": x2}
        yield robot | level | {"L0": float(dtype(REST)), "g": g}, start, resting


@both_precisions
def test_a_mass_at_rest_on_its_friction_level_decides_once(dtype):
    """No two phases in a row are alike, and none ends at once without an event: 1 000 starts within 4 ulp."""
    for robot, start, _ in edges(dtype, 6, 1000):
        stance = hopform.solve_stance(hopform.Robot(**robot), dtype=dtype, max_phases=64, **start)
        modes = [(phase.mode_1, phase.mode_2) for phase in stance.phases]
        assert all(one != next_one for one, next_one in itertools.pairwise(modes)), (robot, start)
        assert stance.status != "too_many_phases" or len(stance.events) > 32, (robot, start)


@pytest.mark.parametrize("count", needs.the_first([5, 25]))
@both_precisions
def test_a_mass_at_rest_on_its_friction_level_moves_as_one_beside_it(dtype, count):
    """The list is that of 50 digits for a level that is 32 ulp higher or lower, or just there."""
    for robot, start, resting in edges(dtype, 7, count):
        stance = hopform.solve_stance(hopform.Robot(**robot), dtype=dtype, **start)
        moved = itertools.product((-32.0, 0.0, 32.0), repeat=len(resting))
        lists = set()
        for ulps in moved:
            beside = robot | {
                name: robot[name] * (1.0 + n * float(np.finfo(dtype).eps))
                for name, n in zip(resting, ulps, strict=True)
            }
            exact = reference.solve(beside | {"c": 0.0}, **start)
            lists.add((exact.status, *(event.kind for event in exact.events)))
        assert (stance.status, *(event.kind for event in stance.events)) in lists, (robot, start)


def test_take_off_does_not_jump_where_a_slip_before_it_begins_to_count():
    """In float32 a slip up to 200 ulp before the take-off is within the rounding of its time, and merges with it."""
    robot = hopform.load_robot("hopper_c")
    currents = 0.3 * (1.0 + np.linspace(-0.5e-4, 2.5e-4, 61))
    exact = hopform.solve_stances(robot, v2=-1.93, u=currents)
    single = hopform.solve_stances(robot, v2=-1.93, u=currents, dtype=np.float32)
    assert np.abs(single.duration / exact.duration - 1.0).max() < 8.0 * np.finfo(np.float32).eps
    assert set(exact.event_count.tolist()) == {1, 5}  # the slip is there


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_an_actuator_that_comes_to_rest_just_at_its_stop_hits_it(dtype):
    """Undamped, the body held: it turns 2 (a - f1)/w^2 from where it starts at rest, and stays for a = 2 f1."""
    rng = np.random.default_rng(8)
    k, m_eff, f1 = over(rng, 1.0, 2e4), over(rng, 0.1, 10.0), over(rng, 0.1, 5.0)
    robot = hopform.Robot(m_eff=1.0, m_s=1.0, k=1.0, L0=0.4, f2=1e5, gamma2=-1.0, g=G, u_max=1e6)
    batch = hopform.solve_stances(
        robot, k=k, m_eff=m_eff, f1=f1, x1=0.0, x2=0.4, v2=0.0, u=2.0 * f1 * m_eff, x1_min=-np.inf,
        x1_max=2.0 * f1 * m_eff / k, events=True, dtype=dtype, horizon=3.5 * np.pi * np.sqrt(m_eff / k),
    )  # fmt: skip
    hits = next(number for number, word in EVENTS.items() if word == "x1_hits_stop")
    assert (batch.event_kind[:, 0] == hits).all()
    assert (batch.words == "rest").all()


def test_units_in_which_the_product_of_the_masses_underflows_cost_no_digit():
    """Forces and masses by 2^-75 of their numbers: the same phases to the last bit, in float32."""
    robot = hopform.load_robot("hopper_c")
    small = replace(
        robot, **{name: getattr(robot, name) * 2.0**-75 for name in ("m_eff", "m_s", "k", "b1", "b2", "gamma2")}
    )
    one, other = (hopform.solve_stance(each, v2=-1.93, u=0.75, dtype=np.float32) for each in (robot, small))
    assert one.events == other.events
    assert one.end == other.end


def test_a_robot_too_stiff_for_the_precision_says_so():
    """a/w above 1e3 in float32, 1e7 in float64; a is about b1/m_eff, w = sqrt(k/m_s)."""
    robot = replace(hopform.load_robot("hopper_c"), b1=0.0)
    w = math.sqrt(robot.k / robot.m_s)
    for dtype, most in ((np.float32, 1e3), (np.float64, 1e7)):
        for share, warned in ((0.9, False), (1.1, True)):
            stiff = replace(robot, b1=share * most * w * robot.m_eff)
            stance = hopform.solve_stance(stiff, v2=-1.93, dtype=dtype)
            assert any(text.startswith("ill_conditioned") for text in stance.warnings) == warned
