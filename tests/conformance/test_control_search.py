"""The controller's search for a current: what it may leave out, and what it costs."""

import numpy as np
import pytest

import hopform
from hopform._solver.choice import DEFAULT
from hopform_solver.records import LegState
from tests import needs
from tests.conformance.currents import Touchdown, compare, draw_robot, draw_touchdowns
from tests.seeds import SEED

HOPPER = hopform.load_robot("hopper_c")
AXIS = hopform.load_robot("hopper_b")


def changed(**fields: float) -> hopform.Robot:
    values = {field.name: getattr(HOPPER, field.name) for field in hopform.Robot.fields()}
    return hopform.Robot(**(values | fields))


def drop(robot: hopform.Robot, height: float, h_des: float, **how: object) -> hopform.Command:
    return hopform.choose_current(robot, v2=hopform.touchdown_velocity(robot, height), h_des=h_des, **how)


@pytest.mark.parametrize("robot", needs.the_first([HOPPER, AXIS]), ids=lambda robot: robot.name)
def test_no_current_of_a_fine_scan_is_smaller_or_nearer(robot):
    """A slice of `make test-control-exhaustive`, at its steps."""
    found = compare(robot, draw_touchdowns(robot, SEED, 6), step=1e-4)
    assert not found.untrue
    assert not found.smaller
    assert not found.nearer


def test_more_of_a_cell_may_be_admissible_than_the_slope_at_its_end_says():
    """x1 comes within 0.2 mm of its limit at 1.64 A, turns, and meets it at 1.75 A:
    found by a scan over random robots.
    """
    robot = changed(m_eff=36.28, m_s=7.4553, k=531.886, c=-0.00193, b1=0.0, b2=8.9819, f1=0.0, f2=0.62774,
                    gamma2=-76.32, x1_max=0.0301657, u_max=7.97676)  # fmt: skip
    touchdown = Touchdown(0.0, 0.0, -2.26067, 0.00963362, 0.0939737, 0.0, 0.004449)
    assert len(compare(robot, [touchdown], step=2e-3).nearer) == 0
    assert touchdown.ask(robot).u == pytest.approx(1.7503, abs=1e-3)


FOUND_BY_SCANS = {
    "hit, not hit, and hit": (
        {"m_eff": 3.275, "k": 700.9, "b1": 23.47, "f1": 0.2125, "f2": 0.9374, "x1_max": 0.04305},
        Touchdown(0.004536, 0.1037, -2.118, 0.0, 0.3836, 0.0, 0.0),
    ),
    "the same without friction": (
        {"m_eff": 3.176, "k": 2052.0, "b1": 0.0, "b2": 6.425, "f1": 0.301, "f2": 0.5162, "x1_max": 0.0238},
        Touchdown(0.005168, 0.0, -1.253, 0.0, 0.1036, 0.0, 0.0),
    ),
    "off before it is hit": (
        {"m_eff": 8.307, "k": 886.5, "b1": 343.1, "b2": 2.3, "f1": 0.0, "f2": 0.9941, "gamma2": 65.0,
         "x1_min": -0.01025, "x1_max": 0.08615},
        Touchdown(0.004038, 0.2923, -0.621, 0.0, 0.01382, 0.0, 0.0),
    ),
    "off before, and beside it a rebound": (
        {"m_eff": 1.791, "k": 2308.0, "b1": 0.0, "b2": 2.751, "f1": 0.9144, "f2": 0.442, "gamma2": 65.0,
         "x1_min": -0.04175, "x1_max": 0.07338},
        Touchdown(0.007486, 0.07823, -0.4328, 0.0, 0.09794, 0.0, 0.0),
    ),
    "between hits of the first and the second rebound": (
        {"m_eff": 7.432, "k": 786.6, "b1": 0.0, "b2": 4.8, "f1": 0.1841, "f2": 0.0, "gamma2": 65.0, "x1_max": 0.03233},
        Touchdown(0.0192, 0.0, -1.585, 0.0, 0.2375, 0.0, 0.0),
    ),
    "with a margin": (
        {"m_eff": 1.756, "k": 1041.0, "b1": 0.0, "b2": 3.588, "f1": 0.158, "f2": 0.0, "x1_min": -0.01122,
         "x1_max": 0.05416},
        Touchdown(0.002444, 0.05041, -1.004, 0.0, 0.1541, 0.0, 0.01188),
    ),
    "a heavy actuator, at its lower stop": (
        {"m_eff": 58.77, "m_s": 3.907, "k": 736.1, "c": 0.002542, "b1": 0.0, "b2": 1.789, "f1": 0.1247, "f2": 0.2913,
         "gamma2": -873.5, "x1_min": -0.03382, "x1_max": 0.2558, "u_max": 12.5},
        Touchdown(-0.03382, 0.0, -0.5239, 0.0, 0.8477, 0.0, 0.002843),
    ),
    "where the apex is as good elsewhere, almost": (
        {"m_eff": 79.61, "m_s": 8.712, "k": 957.6, "c": 0.00213, "b1": 575.1, "b2": 6.872, "f1": 0.0, "f2": 0.2117,
         "gamma2": 102.7, "x1_min": -0.008047, "x1_max": 0.0007043, "u_max": 4.127},
        Touchdown(-0.008047, -0.1085, -2.193, 0.0, 0.1232, 0.01902, 0.0),
    ),
    "another rebound between two take-offs that look alike": (
        {"m_eff": 2.987, "m_s": 4.781, "k": 1455.0, "c": -0.002517, "b1": 25.69, "b2": 3.272, "f1": 1.805, "f2": 0.8614,
         "gamma2": 14.6, "x1_max": 0.1973, "u_max": 8.926},
        Touchdown(0.1693, -0.007389, -1.541, 0.005209, 0.1893, 0.0, 0.0),
    ),
}  # fmt: skip
"""Currents between two after which the stop is hit, or the leg stays down, or takes off before a rebound, and which do
none of these; none of them was found once.
"""


@pytest.mark.parametrize("name", FOUND_BY_SCANS)
def test_a_stop_that_is_hit_on_both_sides_hides_no_current(name):
    fields, touchdown = FOUND_BY_SCANS[name]
    robot = changed(**fields)
    found = compare(robot, [touchdown], step=5e-4 * robot.u_max)
    assert found.statuses == {"nearest": 1}
    assert not found.nearer


def test_half_the_range_is_split_where_the_order_of_events_changes():
    """The apex passes what is wanted at 4.007, 4.79 and 5.018 V, by 0.13 mm in between; an interval that ends at the
    last of these has no sign of it at its ends: found by a scan when such an interval was not split.
    """
    touchdown = Touchdown(
        0.008634836090812446, -0.15118389595459836, -2.357623770555398, 0.0037448422719250085, 0.1678028743422245, 0.0,
        0.005638548474895026,
    )  # fmt: skip
    found = compare(AXIS, [touchdown], step=1e-3)
    assert found.statuses == {"reached": 1}
    assert not found.smaller


def test_a_search_whose_memory_is_full_does_not_go_round_in_circles():
    """The leg takes off or not, and the stop is hit or not, in more places than candidates fit: once the search forgot
    what it tried next, until the 4096 stances that it may take had gone.
    """
    robot = changed(m_eff=2.134, m_s=1.499, k=6370.0, c=-0.003967, b1=0.0, b2=0.6448, f1=0.1314, f2=0.0, gamma2=-12.31,
                    x1_min=-0.04371, x1_max=0.001277, u_max=6.06)  # fmt: skip
    touchdown = Touchdown(-0.038, -0.1064, -0.1246, 0.0, -0.01062, 0.02874, 0.0)
    command = touchdown.ask(robot)
    assert command.solved < 600
    assert command.u == pytest.approx(0.18138, abs=1e-4)


def test_no_current_of_a_scan_is_smaller_or_nearer_with_random_robots():
    """A slice of `python -m tests.conformance.currents --robots random`, which finds a few in 100 000;
    this draw has none.
    """
    for seed in range(60):
        robot = draw_robot(seed)
        found = compare(robot, draw_touchdowns(robot, seed, 3), step=2e-3 * robot.u_max)
        assert not (found.untrue or found.smaller or found.nearer), seed


def test_an_actuator_that_starts_at_its_limit_is_tried_once():
    v2 = hopform.touchdown_velocity(HOPPER, 0.2)
    command = hopform.choose_current(HOPPER, x1=0.07, v2=v2, h_des=0.2, stop_margin=0.01)
    assert (command.status, command.u, command.solved) == ("no_takeoff", 0.0, 1)


def past_the_stop(robot: hopform.Robot, touchdown: Touchdown, u: float) -> tuple[float, bool]:
    """What the hits of the upper stop add to it, from the states just before them;
    whether the velocity decides, or y.
    """
    stance = hopform.solve_stance(robot, x1=touchdown.x1, v1=touchdown.v1, x2=touchdown.x2(robot), v2=touchdown.v2, u=u)
    found = (-1.0, True)
    for event in stance.events:
        before = stance.at(event.time * (1.0 - 1e-9))
        if event.kind == "x1_hits_stop" and before.v1 > 0.0:
            y = before.x1 - before.x2 + robot.L0 + robot.c
            fall = before.v1**2 / (2.0 * robot.g)
            found = max(found, (min(fall, y), fall < y))
    return found


def test_a_hit_returns_how_far_it_is_from_not_being_one():
    """Past x1_max by v1^2/(2 g) at the stop, or by y there if the leg would be off sooner, with the slopes of these."""
    slow = fast = 0
    for fields, touchdown in FOUND_BY_SCANS.values():
        robot, start = changed(**fields), LegState(touchdown.x1, touchdown.v1, touchdown.v2, touchdown.y)
        u, h = np.linspace(-0.97, 0.97, 24) * robot.u_max, 1e-6 * robot.u_max
        around = np.concatenate([u - h, u, u + h])
        trials = DEFAULT.compiled().try_currents(robot.parameters, [start], around, 2.0, 4096)[0]
        peak, peak_u, events = (np.split(trials[name], 3) for name in ("largest_x1", "largest_x1_u", "events"))
        for lane, current in enumerate(u):
            past, falls = past_the_stop(robot, touchdown, float(current))
            if past < 0.0:
                continue
            assert peak[1][lane] - robot.x1_max == pytest.approx(past, rel=1e-5, abs=1e-8)
            slow, fast = slow + falls, fast + (not falls)
            slopes = (peak[1] - peak[0])[lane] / h, (peak[2] - peak[1])[lane] / h
            if events[0][lane] == events[2][lane] and slopes[0] == pytest.approx(slopes[1], rel=1e-3):
                assert peak_u[1][lane] == pytest.approx(sum(slopes) / 2.0, rel=1e-3, abs=1e-6)
    assert min(slow, fast) > 5


@pytest.mark.parametrize(
    ("name", "way"), [("hit, not hit, and hit", 1.0), ("off before it is hit", -1.0), ("off before it is hit", 1.0)]
)
def test_the_peak_of_a_hit_has_no_jump_where_hits_begin(name, way):
    """Else an interval between two hits, of which one is near to be none, would seem to have no other current in it."""
    fields, touchdown = FOUND_BY_SCANS[name]
    robot, start = changed(**fields), LegState(touchdown.x1, touchdown.v1, touchdown.v2, touchdown.y)

    def peaks(u: np.ndarray) -> np.ndarray:
        trials = DEFAULT.compiled().try_currents(robot.parameters, [start], u, 2.0, 4096)[0]
        return np.asarray(trials["largest_x1"]) - robot.x1_max

    inside = touchdown.ask(robot).u
    outside = inside + way * 0.1 * robot.u_max
    assert peaks(np.array([outside])) > 1e-3, "beyond it the stop is hit"
    for _ in range(40):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if peaks(np.array([middle])) < 0.0 else (inside, middle)
    assert np.abs(peaks(np.array([inside, outside]))).max() < 1e-6


def test_a_side_is_left_untried_only_where_the_stop_holds_the_actuator():
    """Friction alone holds it at 0 A in mid-stroke:
    a negative current, with the spring, moves it, a positive one does not.
    """
    sticky = changed(f1=9.0)
    v2 = hopform.touchdown_velocity(sticky, 0.2)
    high = hopform.solve_stance(sticky, x1=0.04, v2=v2, u=0.0).apex
    low = hopform.solve_stance(sticky, x1=0.04, v2=v2, u=-3.0).apex
    assert hopform.solve_stance(sticky, x1=0.04, v2=v2, u=3.0).apex == high
    assert low != high
    command = hopform.choose_current(sticky, x1=0.04, v2=v2, h_des=0.5 * (low + high))
    assert (command.status, command.u < 0.0) == ("reached", True)


def test_a_limit_that_reaches_does_not_hide_a_smaller_current():
    """The first current that is tried after 0 is the limit: here just what is wanted, which 1.05 A gives as well."""
    v2, far = hopform.touchdown_velocity(HOPPER, 0.2), 1.47
    wanted = hopform.solve_stance(HOPPER, v2=v2, u=far).apex
    command = hopform.choose_current(changed(u_max=far), v2=v2, h_des=wanted)
    assert command.status == "reached"
    assert 1.0 < command.u < 1.1
    assert hopform.solve_stance(HOPPER, v2=v2, u=command.u).apex == pytest.approx(wanted, abs=2e-10)


def test_the_margin_keeps_the_actuator_off_its_stop():
    v2 = hopform.touchdown_velocity(HOPPER, 0.2)
    command = hopform.choose_current(HOPPER, v2=v2, h_des=0.3, stop_margin=0.06)
    stance = hopform.solve_stance(HOPPER, v2=v2, u=command.u)
    peak = max(stance.end.x1, *(phase.state.x1 for phase in stance.phases))
    assert command.status == "nearest"
    assert 0.0 < HOPPER.x1_max - 0.06 - peak < 1e-9


def test_a_drop_of_the_paper_takes_few_stances():
    """A count, not a time: 12 were needed in the mean before the search went by lower bounds, 9 before it went for the
    root first.
    """
    draw = np.random.default_rng(2)
    solved = []
    for _ in range(200):
        height = draw.uniform(0.1, 0.25)
        command = drop(HOPPER, height, height + draw.uniform(-0.01, 0.01))
        solved.append(command.solved)
    assert np.mean(solved) < 7.8
    assert max(solved) <= 10


def test_slopes_follow_the_events_and_the_take_off():
    start, h = LegState(0.02, 0.1, -1.5, 0.0), 1e-6
    u = np.linspace(-2.5, 2.5, 11)
    around = np.concatenate([u - h, u, u + h])
    c = DEFAULT.compiled().try_currents(HOPPER.parameters, [start], around, 2.0, 4096)[0]
    below, at, above = np.split(c, 3)
    alike = (below["events"] == at["events"]) & (at["events"] == above["events"]) & at["smooth"] & at["takes_off"]
    assert alike.sum() >= 5
    for name in ("apex", "largest_x1"):
        slope = (above[name] - below[name]) / (2.0 * h)
        assert np.allclose(at[f"{name}_u"][alike], slope[alike], atol=2e-6, rtol=2e-4)
