"""Twenty hops over rough ground against DOP853, restarted at every switch."""

import dataclasses

import numpy as np
import pytest

import hopform
import hopform.hopping
from hopform.hopping import terrain
from hopform.hopping.controllers import FeedForward
from tests import needs
from tests.oracle import integrator

HOPPER = hopform.load_robot("hopper_c")
ROUGH = terrain.uniform(30, 0.02, seed=5)
GAINS = (2000.0, 300.0)


def hops(ground, controller, robot=HOPPER, gains=GAINS):
    return hopform.hopping.simulate(robot, ground, controller, height=0.2, gains=gains)


def scheduled(currents):
    """A controller of one's own: the currents in their order."""
    return lambda touchdown: currents[touchdown.hop]


OTHERS = {
    "hopper_c": HOPPER,
    "an offset, no stop in reach": dataclasses.replace(HOPPER, c=0.01, x1_min=-0.1, x1_max=0.2, b1=60.0),
    "little friction": dataclasses.replace(HOPPER, b1=20.0, b2=0.5, f1=0.1, f2=0.0, impact_loss=0.0),
    "hopper_b": hopform.load_robot("hopper_b"),
}


@pytest.mark.parametrize("name", needs.the_first([*OTHERS]))
def test_twenty_hops_agree_with_an_integrator_that_restarts_at_every_switch(name):
    robot, draw = OTHERS[name], np.random.default_rng(1)
    gains = GAINS
    currents = (draw.uniform(0.5, 1.0, 20) * robot.u_max).tolist()
    ground = ROUGH[:20]
    if name == "hopper_b":  # slow as it is, it would not keep hopping under any currents and gains
        gains = tuple(hopform.design_return(robot, 0.2))
        currents = hops(ground, FeedForward(0.2), robot, gains=gains).table["u"].tolist()
    exact = integrator.hop(robot, list(ground), currents, 0.2, gains)
    run = hops(ground, scheduled(currents), robot, gains=gains)
    assert run.status == "completed" and len(run.hops) == len(exact.takeoffs) == 20
    for hop, touchdown, takeoff in zip(run.hops, exact.touchdowns, exact.takeoffs, strict=True):
        assert hop.touchdown_time == pytest.approx(touchdown[0], abs=1e-8)
        assert hop.takeoff_time == pytest.approx(takeoff[0], abs=1e-8)
        for ours, (_, theirs) in ((hop.touchdown, touchdown), (hop.stance.takeoff, takeoff)):
            np.testing.assert_allclose(np.array(ours) + [0, 0, hop.ground, 0], theirs, rtol=0, atol=1e-8)
    for t in np.linspace(0.0, exact.takeoffs[-1][0], 400)[:-1]:
        if all(abs(t - touchdown) > 1e-6 for touchdown, _ in exact.touchdowns):
            np.testing.assert_allclose(np.array(run.at(t)), exact.at(t), rtol=0, atol=1e-8)


def test_the_twenty_hops_meet_sticking_slipping_stops_and_the_limit_of_the_current():
    """What the comparison would be worth little without."""
    draw = np.random.default_rng(1)
    run = hops(ROUGH[:20], scheduled((draw.uniform(0.5, 1.0, 20) * 3.0).tolist()), gains=GAINS)
    kinds = {event.kind for hop in run.hops for event in (*hop.flight.events, *hop.stance.events)}
    assert {"x1_sticks", "x1_slips", "x1_hits_stop", "u_desaturates", "x1_reverses", "x2_reverses"} <= kinds
