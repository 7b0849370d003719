"""The controller's search for a current: what it may leave out, what it costs, and that both back ends agree on it."""

import numpy as np
import pytest

import hopform
from hopform import native_control
from hopform_solver.records import State
from hopform_solver.trial import try_currents
from tests.scan import Touchdown, compare, draw_touchdowns
from tests.seeds import SEED

HOPPER = hopform.load_robot("hopper_c")
AXIS = hopform.load_robot("hopper_b")


def changed(**fields: float) -> hopform.Robot:
    values = {field.name: getattr(HOPPER, field.name) for field in hopform.Robot.fields()}
    return hopform.Robot(**(values | fields))


def drop(robot: hopform.Robot, height: float, h_des: float, **how: object) -> hopform.Command:
    return hopform.choose_current(robot, v2=hopform.touchdown_velocity(robot, height), h_des=h_des, **how)


@pytest.mark.parametrize("robot", [HOPPER, AXIS], ids=lambda robot: robot.name)
def test_no_current_of_a_fine_scan_is_smaller_or_nearer(robot):
    """A slice of `make test-control-exhaustive`, at its steps."""
    found = compare(robot, draw_touchdowns(robot, SEED, 6), step=1e-4)
    assert not found.untrue
    assert not found.smaller
    assert not found.nearer


def test_more_of_a_cell_may_be_admissible_than_the_slope_at_its_end_says():
    """x1 comes within 0.2 mm of its limit at 1.64 A, turns, and meets it at 1.75 A: found by a scan over random robots."""
    robot = changed(m_eff=36.28, m_s=7.4553, k=531.886, c=-0.00193, b1=0.0, b2=8.9819, f1=0.0, f2=0.62774,
                    gamma2=-76.32, x1_max=0.0301657, u_max=7.97676)  # fmt: skip
    touchdown = Touchdown(0.0, 0.0, -2.26067, 0.00963362, 0.0939737, 0.0, 0.004449)
    assert len(compare(robot, [touchdown], step=2e-3).nearer) == 0
    assert touchdown.ask(robot).u == pytest.approx(1.7503, abs=1e-3)


def test_a_side_is_left_untried_only_where_the_stop_holds_the_actuator():
    """Friction alone holds it at 0 A in mid-stroke: a negative current, with the spring, moves it, a positive one does not."""
    sticky = changed(f1=9.0)
    v2 = hopform.touchdown_velocity(sticky, 0.2)
    high = hopform.solve_stance(sticky, x1=0.04, v2=v2, u=0.0).apex
    low = hopform.solve_stance(sticky, x1=0.04, v2=v2, u=-3.0).apex
    assert hopform.solve_stance(sticky, x1=0.04, v2=v2, u=3.0).apex == high
    assert low != high
    command = hopform.choose_current(sticky, x1=0.04, v2=v2, h_des=0.5 * (low + high))
    assert (command.status, command.u < 0.0) == ("reached", True)


@pytest.mark.parametrize("backend", hopform.backends())
def test_a_limit_that_reaches_does_not_hide_a_smaller_current(backend):
    """The first current that is tried after 0 is the limit: here just what is wanted, which 1.05 A gives as well."""
    v2, far = hopform.touchdown_velocity(HOPPER, 0.2), 1.47
    wanted = hopform.solve_stance(HOPPER, v2=v2, u=far, backend=backend).apex
    command = hopform.choose_current(changed(u_max=far), v2=v2, h_des=wanted, backend=backend)
    assert command.status == "reached"
    assert 1.0 < command.u < 1.1
    assert hopform.solve_stance(HOPPER, v2=v2, u=command.u).apex == pytest.approx(wanted, abs=2e-10)


def test_the_margin_keeps_the_actuator_off_its_stop():
    v2 = hopform.touchdown_velocity(HOPPER, 0.2)
    for backend in ("c", "numpy"):
        command = hopform.choose_current(HOPPER, v2=v2, h_des=0.3, stop_margin=0.06, backend=backend)
        stance = hopform.solve_stance(HOPPER, v2=v2, u=command.u)
        peak = max(stance.end.x1, *(phase.state.x1 for phase in stance.phases))
        assert command.status == "nearest"
        assert 0.0 < HOPPER.x1_max - 0.06 - peak < 1e-9


def test_both_back_ends_choose_alike_at_random_touchdowns():
    for robot, count in ((HOPPER, 3), (AXIS, 2)):
        for touchdown in draw_touchdowns(robot, 31, count):
            first, second = touchdown.ask(robot, backend="c"), touchdown.ask(robot, backend="numpy")
            assert first.status == second.status, touchdown
            if first.status != "no_takeoff":
                gaps = [abs(command.apex - touchdown.h_des) for command in (first, second)]
                assert gaps[0] == pytest.approx(gaps[1], abs=1e-9), touchdown
            if first.status == "reached":  # at a fold the current is known to half the digits
                assert abs(first.u) == pytest.approx(abs(second.u), abs=1e-6), touchdown


def test_a_drop_of_the_paper_takes_few_stances():
    """A count, not a time: 12 were needed in the mean before the search went by promise."""
    draw = np.random.default_rng(2)
    solved = []
    for _ in range(200):
        height = draw.uniform(0.1, 0.25)
        command = drop(HOPPER, height, height + draw.uniform(-0.01, 0.01))
        solved.append(command.solved)
    assert np.mean(solved) < 9.0
    assert max(solved) <= 14


def test_slopes_follow_the_events_and_the_take_off():
    start, h = State(0.02, 0.1, -1.5, 0.0), 1e-6
    u = np.linspace(-2.5, 2.5, 11)
    around = np.concatenate([u - h, u, u + h])
    c = native_control.try_currents(HOPPER.parameters, [start], around, 2.0, 4096)[0]
    n = try_currents(HOPPER.parameters, start, around, 2.0, 4096)
    below, at, above = np.split(c, 3)
    alike = (below["events"] == at["events"]) & (at["events"] == above["events"]) & at["smooth"] & at["takes_off"]
    assert alike.sum() >= 5
    for name in ("apex", "peak"):
        slope = (above[name] - below[name]) / (2.0 * h)
        assert np.allclose(at[f"{name}_u"][alike], slope[alike], atol=2e-6, rtol=2e-4)
        numpy_slope = np.split(np.asarray(getattr(n, f"{name}_u")), 3)[1]
        assert np.allclose(at[f"{name}_u"][alike], numpy_slope[alike], atol=1e-6)
