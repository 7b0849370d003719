"""What must hold for every robot that hops, and that no number is too strange for a flight."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hopform
import hopform.hopping
from hopform.hopping.controllers import FeedForward
from tests.unit.test_properties import over, robots

SOME = settings(max_examples=40, deadline=None, derandomize=True)
HOPPER = hopform.load_robot("hopper_c")
heights = st.lists(st.floats(-0.05, 0.05), min_size=1, max_size=8)
losses = st.floats(0.0, 0.3)


def scale_of(robot):
    """Of the energies of a run [J]: what is compared is a difference of numbers of this size."""
    return robot.m_s * robot.g + robot.k * 0.1**2


@SOME
@given(robots(), losses, heights, st.floats(-3.0, 3.0))
def test_every_run_says_how_it_ends_and_its_energies_add_up(robot, loss, ground, u):
    robot = dataclasses.replace(robot, impact_loss=loss)
    run = hopform.hopping.simulate(robot, ground, u, height=0.2, horizon=5.0)
    assert run.status in {"completed", "stopped", "tripped"}
    assert (len(run.hops) == len(ground)) or run.status != "completed"
    rounding = 1e-12 * scale_of(robot)
    assert np.abs(run.table["aed"] - run.table["gained"]).max(initial=0.0) <= rounding
    t = run.times(200)
    np.testing.assert_allclose(run.aed(t), run.energy(t).body, rtol=0, atol=20.0 * rounding)
    assert np.isfinite(run.at(t)).all()
    for hop in run.hops:
        lost = 0.5 * robot.m_s * hop.flight.end.v2**2 * loss
        assert hop.energy_lost_at_impact == pytest.approx(lost, rel=1e-12, abs=1e-300)
        assert hop.touchdown.x2 == pytest.approx(hop.touchdown.x1 + robot.L0, abs=1e-14)


@SOME
@given(robots(), heights, st.floats(0.1, 0.3))
def test_the_exact_controller_reaches_what_it_says_over_any_ground(robot, ground, h_des):
    run = hopform.hopping.simulate(robot, ground, FeedForward(h_des, horizon=5.0), height=0.2, horizon=5.0)
    for hop in run.hops:
        start = hop.touchdown
        command = hopform.choose_current(
            robot, x1=start.x1, v1=start.v1, v2=start.v2, h_des=h_des, datum=-hop.ground, horizon=5.0
        )
        assert hop.u == command.u
        if command.status == "reached":
            assert abs(hop.apex - h_des) <= 1e-9
        elif command.status == "nearest":
            assert abs(hop.apex - command.apex) <= 1e-9


anything = st.one_of(st.floats(), st.sampled_from([0.0, -0.0, 5e-324, 1e-310, 1e308, -1e308]))


@settings(max_examples=300, deadline=None, derandomize=True)
@given(anything, anything, anything, anything, st.one_of(st.none(), st.tuples(anything, anything)), over(1e-3, 1e3))
def test_any_number_gives_a_flight_that_is_finite_or_one_refusal(x1, v1, x2, v2, gains, horizon):
    try:
        flight = hopform.solve_flight(HOPPER, x1=x1, v1=v1, x2=x2, v2=v2, gains=gains, horizon=horizon)
    except hopform.HopformError as error:
        assert str(error)
        return
    assert np.isfinite([*flight.end, flight.duration, flight.apex, flight.impact_loss]).all()
    assert 0.0 <= flight.duration <= horizon
    assert HOPPER.x1_min <= flight.end.x1 <= HOPPER.x1_max


def test_a_velocity_that_underflows_leaves_the_actuator_within_its_stroke():
    flight = hopform.solve_flight(HOPPER, v1=5e-324, x2=0.0, v2=1.0)
    assert flight.end.x1 == HOPPER.x1_min and not flight.at(flight.duration).x1 < HOPPER.x1_min
