"""Hopping: conservation laws, controllers, and what a run says of itself."""

import csv
import dataclasses
import itertools
import math

import numpy as np
import pytest

import hopform
import hopform.hopping
from hopform.hopping import terrain
from hopform.hopping._run import COLUMNS
from hopform.hopping.controllers import (
    AsPrinted,
    ConstantCurrent,
    FeedForward,
    ReturnMap,
    ReturnMaps,
    Sampled,
    Touchdown,
)

HOPPER = hopform.load_robot("hopper_c")
ROUGH = terrain.uniform(30, 0.02, seed=5)
GAINS = (2000.0, 300.0)
OFFSET = dataclasses.replace(HOPPER, c=0.01, x1_min=-0.1, x1_max=0.2, b1=60.0)
"""No stop is in its reach."""


def hops(ground=ROUGH, controller=3.0, robot=HOPPER, **how):
    return hopform.hopping.simulate(robot, ground, controller, **({"height": 0.2} | how))


def scheduled(currents):
    """A controller of one's own: the currents in their order."""
    return lambda touchdown: currents[touchdown.hop]


# ---- energy ----


@pytest.mark.parametrize("ground", [terrain.flat(1000), terrain.uniform(1000, 0.02, seed=3)], ids=["flat", "rough"])
def test_the_ideal_hopper_keeps_its_energy_over_a_thousand_hops(ground):
    run = hops(ground, 0.0, hopform.load_robot("ideal"))
    energy = np.asarray(run.energy(run.times(5000)).body)
    assert len(run.hops) == 1000
    assert np.ptp(energy) <= 1e-12
    assert np.abs(run.table["apex"] - 0.2).max() <= 1e-13


@pytest.mark.parametrize("c", [0.0, 0.02, -0.01])
def test_the_energy_of_a_passive_robot_less_the_offsets_share_never_rises(c):
    robot = dataclasses.replace(HOPPER, c=c, x1_min=-0.1, f2=0.05, b2=0.5)
    run = hops(terrain.steps(6, -0.03, 2), 0.0, robot, gains=(0.0, 0.0))
    assert len(run.hops) > 3
    t = run.times(20_000)
    energy = np.asarray(run.energy(t).total) - robot.k * c * np.asarray(run.at(t).x1)
    assert np.diff(energy).max() <= 1e-12
    assert energy[0] - energy[-1] > 1.0


@pytest.mark.parametrize(("controller", "robot"), [(0.0, HOPPER), (3.0, HOPPER), (FeedForward(0.2), OFFSET)])
def test_the_energy_predicted_at_every_touchdown_is_that_after_the_fact(controller, robot):
    """Figs. 13, 14."""
    run = hops(ROUGH, controller, robot)
    table, t = run.table, run.times(3000)
    assert np.abs(table["aed"] - table["gained"]).max() <= 1e-12
    np.testing.assert_allclose(run.aed(t), run.energy(t).body, rtol=0, atol=1e-11)


# ---- the exact controller ----


@pytest.mark.parametrize("robot", [HOPPER, OFFSET, hopform.load_robot("hopper_b")], ids=["c", "offset", "b"])
@pytest.mark.parametrize("ground", [terrain.flat(40), terrain.uniform(40, 0.03, seed=2)], ids=["flat", "rough"])
def test_the_exact_controller_reaches_every_admissible_apex(robot, ground):
    draw = np.random.default_rng(4)
    h_des = tuple((0.16 + 0.04 * draw.random(40)).tolist())
    run = hops(ground, FeedForward(h_des), robot)
    reached = 0
    for hop, wanted in zip(run.hops, h_des, strict=True):
        start = hop.touchdown
        command = hopform.choose_current(robot, x1=start.x1, v1=start.v1, v2=start.v2, h_des=wanted, datum=-hop.ground)
        assert hop.u == command.u
        if command.status == "reached":
            reached += 1
            assert abs(hop.apex - wanted) <= 1e-9
    assert reached >= 30


def test_with_a_margin_the_actuator_stays_away_from_its_stop():
    run = hops(terrain.flat(10), FeedForward(0.24, stop_margin=0.01))
    t = run.times(4000)
    assert np.asarray(run.at(t).x1).max() < HOPPER.x1_max - 0.01


def test_the_printed_controller_misses_what_the_exact_one_reaches():
    exact, printed, mended = (
        np.abs(hops(ROUGH, each).table["apex"][1:] - 0.2)
        for each in (FeedForward(0.2), AsPrinted(0.2), AsPrinted(0.2, half=False, signed=True, spring_coordinate=True))
    )
    assert exact.max() < 1e-9 and printed.mean() > 0.01
    assert 1e-6 < mended.max() < 1e-3  # the grid's


def test_hopper_bs_first_controller_holds_a_height_on_even_ground_and_not_on_rough():
    """Figs. 6, 7."""
    even, rough = (hops(ground, ReturnMap(0.2)).table["apex"] for ground in (terrain.flat(12), ROUGH[:12]))
    assert np.abs(even[4:] - 0.2).max() < 1e-4
    assert np.abs(rough - 0.2).max() > 0.01


def test_return_maps_are_read_between_their_heights_and_end_with_them():
    """apex = h + u/10 over the last apex h: the current is 10 times what is missing."""
    heights, currents = np.array([0.1, 0.2]), np.linspace(-1.0, 1.0, 5)
    maps = ReturnMaps(heights, currents, heights[:, None] + currents / 10.0, *np.zeros((3, 2)))
    for apex, met in ((0.1, 0.1), (0.175, 0.175), (0.2, 0.2), (0.05, 0.1), (0.5, 0.2)):
        assert maps.current(apex, 0.15) == pytest.approx(10.0 * (0.15 - met), abs=1e-13)


# ---- any controller ----


AIMING = [FeedForward, AsPrinted]


@pytest.mark.parametrize("ground", [-0.03, 0.0, 0.02])
def test_a_set_point_counts_from_level_0_and_not_from_the_ground(ground):
    """The stance, whose apex counts from the ground, ends where the controller aims at over level 0."""
    touchdown = Touchdown(0, 0.2, 0.01, 0.1, -1.8, ground, 0.2, HOPPER)
    u = FeedForward(0.18)(touchdown)
    stance = hopform.solve_stance(HOPPER, x1=0.01, v1=0.1, v2=-1.8, u=u)
    assert stance.apex + ground == pytest.approx(0.18, abs=1e-9)
    printed = [
        AsPrinted(0.18 + level, half=False, signed=True)(touchdown._replace(ground=level)) for level in (0.0, ground)
    ]
    assert printed[0] == pytest.approx(printed[1], abs=1e-12)


@pytest.mark.parametrize("controller", AIMING)
def test_a_set_point_below_the_ground_as_measured_is_a_set_point_on_it(controller):
    """A sensor may put the ground above the set point; then the least apex over the ground is wanted."""
    touchdown = Touchdown(0, 0.2, 0.0, 0.0, -0.9, 0.05, 0.2, HOPPER)
    found = {h_des: controller(h_des)(touchdown) for h_des in (-0.2, 0.0, 0.0499, 0.05, 0.08)}
    assert found[-0.2] == found[0.0] == found[0.0499] == found[0.05] != found[0.08]
    if controller is FeedForward:
        currents = np.linspace(-HOPPER.u_max, HOPPER.u_max, 201)
        apexes = hopform.solve_stances(HOPPER, v2=-0.9, u=currents).takeoff
        lowest = np.nanmin(np.where(apexes.x1 < HOPPER.x1_max, apexes.x2 + apexes.v2**2 / (2 * HOPPER.g), np.nan))
        reached = hopform.solve_stance(HOPPER, v2=-0.9, u=found[0.0]).apex + HOPPER.L0 + HOPPER.c
        assert reached <= lowest + 1e-9


def test_a_run_whose_ground_is_measured_above_its_set_points_goes_on():
    run = hops([0.0] * 12, FeedForward(0.01), height=0.05, errors=hopform.hopping.Errors(ground=0.03), seed=4)
    assert len(run.hops) > 2


# ---- the limit of the current ----


STRONG = {
    "feed-forward": FeedForward(0.5),
    "as printed": AsPrinted(0.5, grid=0.05),
    "return maps": ReturnMap(0.3, Kp=2000.0, Kd=60.0, heights=4, currents=9),
}
"""Controllers that want more than the motor has."""


@pytest.mark.parametrize("limit", [2.9, 0.7, 0.3])
@pytest.mark.parametrize("name", STRONG)
def test_no_current_that_a_controller_asks_for_is_above_the_limit(name, limit):
    robot = dataclasses.replace(HOPPER, u_max=limit)
    run = hops(ROUGH[:4], STRONG[name], robot, errors=hopform.hopping.Errors(x1=0.004, v2=0.2), seed=3)
    asked = [abs(u) for hop in run.hops for _, u in hop.stance.u]
    assert max(asked) == limit  # they all want more
    assert not any("u_max" in warning for warning in run.warnings)


def test_no_current_of_the_return_in_flight_is_above_the_limit():
    """Until the law leaves its limit the current is that limit, behind it below."""
    for robot, v1 in itertools.product((HOPPER, dataclasses.replace(HOPPER, gamma2=-HOPPER.gamma2)), (-0.3, 0.2)):
        flight = hopform.solve_flight(robot, x1=0.05, v1=v1, v2=1.9, gains=(2e4, 900.0))
        leaves = [event.time for event in flight.events if event.kind == "u_desaturates"]
        t = np.linspace(0.0, flight.duration, 2001)
        u = np.abs(flight.current(t))
        assert leaves and u.max() == HOPPER.u_max
        first = t < leaves[0]
        assert (u[first] == HOPPER.u_max).all() and u[~first].min() < HOPPER.u_max


@pytest.mark.parametrize("limit", [2.9, 2.8])
def test_a_current_chosen_in_single_precision_is_within_the_limit(limit):
    """The number of single precision that is nearest to 2.9 is above it, that of 2.8 below."""
    for gamma2 in (HOPPER.gamma2, -HOPPER.gamma2):
        robot = dataclasses.replace(HOPPER, u_max=limit, gamma2=gamma2, x1_max=math.inf)
        how = {"h_des": 0.9, "dtype": np.float32}
        found = [abs(hopform.choose_current(robot, v2=v2, **how).u) for v2 in (-1.2, -1.9, -2.4)]
        assert limit * (1.0 - 1e-6) < max(found) <= limit


# ---- what a hop says of its current ----


@pytest.mark.parametrize("seed", range(8))
def test_the_mean_current_of_a_hop_is_the_mean_of_its_phases(seed):
    """Steps behind the take-off never flow."""
    draw = np.random.default_rng(seed)
    times = np.sort(draw.uniform(0.0, 0.5, 6))
    steps = [(0.0, 1.0), *zip(times.tolist(), draw.uniform(-3.0, 3.0, 6).tolist(), strict=True), (0.5, 1e3)]
    (hop,) = hops([0.0], lambda _: steps).hops
    flowed = sum(phase.u * (phase.end - phase.start) for phase in hop.stance.phases)
    assert sum(t < hop.stance.duration for t, _ in steps) < len(steps)
    assert hop.u == pytest.approx(flowed / hop.stance.duration, abs=1e-12)
    assert not any("u_max" in warning for warning in hop.stance.warnings)


def test_a_controller_of_ones_own_is_given_the_touchdown():
    given = []

    def controller(touchdown):
        given.append(touchdown)
        return [(0.0, 3.0), (0.05, 2.0)]

    run = hops(ROUGH[:3], controller)
    assert run.hops[1].stance.u == ((0.0, 3.0), (0.05, 2.0))
    for hop, touchdown in zip(run.hops, given, strict=True):
        start = hop.touchdown
        assert touchdown[2:] == (start.x1, start.v1, start.v2, hop.ground, hop.height, HOPPER, 0.0)
        assert (touchdown.hop, touchdown.time) == (hop.index, hop.touchdown_time)
    lengths = [hop.stance.duration for hop in run.hops]
    assert run.table["u"] == pytest.approx([(0.05 * 3.0 + (each - 0.05) * 2.0) / each for each in lengths], rel=1e-14)


def test_a_sampled_law_is_asked_at_every_tick_for_the_state_there():
    seen = []

    def law(t, state):
        seen.append((t, state))
        return 3.0 - 5.0 * t

    run = hops([0.01], lambda _: Sampled(0.004, law))
    stance = run.hops[0].stance
    assert [t for t, _ in seen] == pytest.approx(np.arange(0.0, stance.duration, 0.004), abs=1e-15)
    assert stance.u == tuple((t, 3.0 - 5.0 * t) for t, _ in seen)
    for t, state in seen:
        there = stance.at(t)
        assert np.array(state) == pytest.approx(np.array(there) + [0.0, 0.0, 0.01, 0.0], abs=1e-12)


@pytest.mark.parametrize(
    "value",
    [ConstantCurrent(2.0), FeedForward(0.2), AsPrinted(0.2), ReturnMap(0.2), ReturnMap(0.2).prepare(HOPPER, (0.0,)),
     ReturnMap(0.2).prepare(HOPPER, (0.0,)).maps, hopform.hopping.Errors()],
    ids=lambda value: type(value).__name__,
)  # fmt: skip
def test_controllers_and_errors_are_values(value):
    """A run that has been pickled says what was asked of it."""
    for each in dataclasses.fields(value):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(value, each.name, None)


def test_a_controller_that_prepares_is_asked_by_what_it_returns():
    class Prepared:
        def prepare(self, robot, ground):
            assert (robot, ground) == (HOPPER, (0.0, 0.01))
            return ConstantCurrent(2.5)

    assert hops([0.0, 0.01], Prepared()).table["u"].tolist() == [2.5, 2.5]


# ---- what is not as the controller believes ----


def test_the_same_seed_gives_the_same_run_and_another_another():
    errors = hopform.hopping.Errors(x1=1e-3, v1=1e-2, v2=1e-2, ground=1e-3)
    one, same, other = (hops(ROUGH, FeedForward(0.2), errors=errors, seed=seed) for seed in (1, 1, 2))
    assert (one.table == same.table).all() and one.table["u"][0] != other.table["u"][0]


def test_what_is_measured_scatters_as_asked_and_within_the_stroke():
    given = []
    errors = hopform.hopping.Errors(x1=1e-3, v1=2e-2, v2=1e-2, ground=5e-3, x2=3e-3)
    run = hops(terrain.flat(2000), lambda seen: given.append(seen) or 2.7, errors=errors)
    truth = np.array([[*hop.touchdown[:2], hop.touchdown[3], hop.ground, hop.height] for hop in run.hops])
    seen = np.array([[each.x1, each.v1, each.v2, each.ground, each.apex] for each in given])
    spread = (seen - truth).std(axis=0)  # of 2000: within 5 % but once in a thousand
    assert spread[1:] == pytest.approx([2e-2, 1e-2, 5e-3, 3e-3], rel=0.06)
    assert seen[:, 0].min() >= HOPPER.x1_min
    related = np.corrcoef((seen - truth)[:, 1:].T) - np.eye(4)
    assert np.abs(related).max() < 0.1  # of 2000: four and a half standard deviations


def test_what_a_sampled_law_sees_scatters_as_asked():
    seen = []
    errors = hopform.hopping.Errors(x1=1e-3, v1=2e-2, x2=3e-3, v2=1e-2)
    run = hops(
        terrain.flat(12), lambda _: Sampled(1e-3, lambda t, state: seen.append((t, state)) or 3.0), errors=errors
    )
    begins = [n for n, (t, _) in enumerate(seen) if t == 0.0]
    misses = [
        np.array(state) - np.array(hop.stance.at(t))
        for hop, begin, end in zip(run.hops, begins, [*begins[1:], len(seen)], strict=True)
        for t, state in seen[begin:end]
    ]
    assert len(misses) > 2000  # so a spread is within 6 % but once in a thousand
    assert np.std(misses, axis=0) == pytest.approx([1e-3, 2e-2, 3e-3, 1e-2], rel=0.06)
    assert np.abs(np.corrcoef(np.transpose(misses)) - np.eye(4)).max() < 0.1


def test_the_return_is_designed_for_the_fall_that_the_model_predicts():
    """From x1 above the ground at take-off; the motor's force is the plant's."""
    believed = dataclasses.replace(HOPPER, gamma2=0.8 * HOPPER.gamma2, b1=HOPPER.b1 / 2.0, g=9.5)
    run = hops(terrain.flat(3), 3.0, errors=hopform.hopping.Errors(model=believed))
    for before, hop in itertools.pairwise(run.hops):
        x1, v2 = float(before.stance.takeoff.x1), float(before.stance.takeoff.v2)
        assert x1 > 0.01
        fall = (v2 + math.sqrt(v2**2 + 2.0 * believed.g * x1)) / believed.g
        designed = np.array(hopform.design_return(believed, fall - 0.05))
        assert np.array(hop.flight.gains) == pytest.approx(designed / 0.8, rel=1e-12)


def test_a_current_that_flows_less_than_asked_for_is_a_weaker_motor():
    weak = dataclasses.replace(HOPPER, gamma2=0.9 * HOPPER.gamma2)
    one = hops(ROUGH, 2.5, errors=hopform.hopping.Errors(current_scale=0.9), gains=GAINS)
    factor = 0.9
    other = hops(ROUGH, 2.5, weak, gains=(GAINS[0] * factor, GAINS[1] * factor))
    assert (one.table == other.table).all()
    assert (one.table["u"] == 2.5).all()


def test_a_controller_with_a_wrong_model_misses_and_the_plant_stays_as_it_is():
    wrong = dataclasses.replace(HOPPER, m_s=2.9, b2=6.0)
    run = hops(ROUGH, FeedForward(0.2), errors=hopform.hopping.Errors(model=wrong))
    assert run.robot == HOPPER
    assert 1e-3 < np.abs(run.table["apex"] - 0.2).max() < 0.05
    start = run.hops[0].touchdown
    believed = hopform.choose_current(wrong, x1=start.x1, v1=start.v1, v2=start.v2, h_des=0.2, datum=-ROUGH[0])
    assert run.hops[0].u == believed.u


def test_without_errors_a_model_that_is_right_changes_nothing():
    same = dataclasses.replace(HOPPER, name="the same")
    one, other = hops(ROUGH, FeedForward(0.2)), hops(ROUGH, FeedForward(0.2), errors=hopform.hopping.Errors(model=same))
    assert (one.table["u"] == other.table["u"]).all()


@pytest.mark.parametrize("controller", [FeedForward(0.2), lambda _: [(0.0, 2.0), (0.03, 3.0)], ReturnMap(0.2)])
def test_a_touchdown_that_is_seen_late_delays_the_current(controller):
    prompt = hops([0.0], controller)
    late = hops([0.0], controller, errors=hopform.hopping.Errors(delay=0.008))
    asked = prompt.hops[0].stance.u
    assert late.hops[0].stance.u[:2] == ((0.0, 0.0), (0.008, asked[0][1]))
    if len(asked) == 2:
        assert late.hops[0].stance.u[2] == (0.038, 3.0)
    assert late.hops[0].apex != prompt.hops[0].apex


def test_a_delay_costs_what_the_detectors_page_says():
    (hop,) = hops([0.0], 3.0, errors=hopform.hopping.Errors(delay=0.008)).hops
    start = hop.touchdown
    assert hop.apex == hopform.hopping.delayed_apex(HOPPER, 0.008, x1=start.x1, v1=start.v1, v2=start.v2, u=3.0)[0]


def test_a_clock_sees_a_touchdown_at_its_next_tick():
    run = hops(ROUGH, 3.0, errors=hopform.hopping.Errors(quantum=0.004, delay=0.001))
    for hop in run.hops:
        seen = hop.touchdown_time + hop.stance.u[1][0] - 0.001
        assert 0.0 <= seen - hop.touchdown_time < 0.004
        assert seen / 0.004 == pytest.approx(round(seen / 0.004), abs=1e-9)


# ---- how a run ends ----


def test_a_step_above_the_apex_trips_the_robot_in_flight():
    run = hops([0.0, 0.0, 0.3, 0.0])
    assert (run.status, len(run.hops)) == ("tripped", 2)
    t = run.times(2000)
    assert np.asarray(run.foot(t)).max() < 0.3
    assert run.duration > run.hops[-1].takeoff_time


def test_ground_above_the_drop_trips_it_before_the_first_hop():
    run = hops([0.3, 0.0])
    assert (run.status, run.hops, run.duration) == ("tripped", (), 0.0)
    assert run.table.size == 0 and run.at(0.0).x2 == pytest.approx(0.6)


def test_a_robot_that_comes_to_rest_stops():
    run = hops(terrain.flat(20), 0.0, height=0.05)
    assert run.status == "stopped" and len(run.hops) < 20
    assert run.hops[-1].stance.status == "rest" and math.isnan(run.hops[-1].apex)
    assert run.table["status"][-1] == "rest" and math.isnan(run.table["takeoff_v2"][-1])
    assert run.duration == run.hops[-1].takeoff_time


def test_a_stance_that_lasts_too_long_stops():
    run = hops(terrain.flat(3), horizon=0.05)
    assert run.status == "stopped" and run.hops[0].stance.status == "horizon"


def test_a_completed_run_ends_at_the_apex_behind_its_last_hop():
    run = hops()
    end = run.at(run.duration)
    assert run.status == "completed" and len(run.hops) == len(ROUGH)
    assert end.v2 == pytest.approx(0.0, abs=1e-13)
    assert end.x2 - HOPPER.L0 == pytest.approx(run.hops[-1].apex, abs=1e-14)


def test_stops_are_flags_of_a_hop():
    quick = dataclasses.replace(HOPPER, b1=20.0, x1_max=0.05)
    run = hops(terrain.flat(3), 3.0, quick)
    assert run.table["bottoms_out"].any() and run.table["hits_stop"].any()
    assert not hops(terrain.flat(3), 0.0).table["bottoms_out"].any()
    assert not hops(terrain.flat(3), 2.0, OFFSET).table["hits_stop"].any()


def test_times_of_a_run_are_the_sums_of_its_flights_and_stances():
    clock = 0.0
    for hop in hops(ROUGH[:4]).hops:
        clock += hop.flight.duration
        assert hop.touchdown_time == pytest.approx(clock, rel=1e-14)
        clock += hop.stance.duration
        assert hop.takeoff_time == pytest.approx(clock, rel=1e-14)


def test_a_run_starts_from_any_state_in_the_air():
    start = hopform.State(0.02, -0.1, 0.55, 0.4)
    run = hops(ROUGH, height=None, start=start)
    assert tuple(run.at(0.0)) == pytest.approx(tuple(start), abs=1e-15)
    assert run.hops[0].height == pytest.approx(0.55 - HOPPER.L0 + 0.4**2 / (2 * HOPPER.g), abs=1e-14)


# ---- over time ----


def test_states_are_continuous_but_for_the_impacts():
    run = hops()
    for hop in run.hops:
        before, after = (run.at(np.nextafter(hop.touchdown_time, side)) for side in (-1.0, np.inf))
        jump = np.array(after) - np.array(before)
        assert np.abs(jump[:3]).max() < 1e-13
        lost = HOPPER.m_s * (before.v2**2 - after.v2**2) / 2.0
        assert lost == pytest.approx(hop.energy_lost_at_impact, abs=1e-12)
        takeoff = [np.array(run.at(np.nextafter(hop.takeoff_time, side))) for side in (-1.0, np.inf)]
        last_digit = 4.0 * math.ulp(hop.takeoff_time)  # of the time since the start, from which a stance's is taken
        assert np.abs(takeoff[1] - takeoff[0]).max() < 1e-14 + 20.0 * last_digit  # no rate is above 20 m/s^2


def test_the_foot_is_on_the_ground_in_stance_and_above_what_is_under_it_in_flight():
    run = hops()
    t = run.times(5000)
    foot, ground, state = np.asarray(run.foot(t)), np.asarray(run.ground(t)), run.at(t)
    inside = np.any([(t >= hop.touchdown_time) & (t <= hop.takeoff_time) for hop in run.hops], axis=0)
    assert (foot[inside] == ground[inside]).all()
    expected = np.asarray(state.x2) - HOPPER.L0 - np.asarray(state.x1)
    assert foot[~inside] == pytest.approx(expected[~inside], abs=1e-13)
    last = np.array([run.terrain[0], *run.terrain])[np.searchsorted([hop.touchdown_time for hop in run.hops], t)]
    assert (foot >= np.minimum(ground, last) - 1e-12).all()


def test_times_may_have_any_shape_and_order_and_stay_within_the_run():
    run = hops(ROUGH[:3])
    t = np.array([[0.9, 0.1], [0.5, 0.3]])
    assert run.at(t).x2.shape == (2, 2) and run.at(t).x2[1, 0] == run.at(0.5).x2
    assert isinstance(run.energy(0.3).total, float) and run.aed(t).shape == (2, 2)
    for bad in (-1e-9, run.duration * 1.001, math.nan):
        with pytest.raises(hopform.HopformError, match="t must be 0 <= t"):
            run.at(bad)


# ---- files ----


def test_a_table_reads_back_from_csv_to_the_same_bits(tmp_path):
    run = hops(terrain.flat(20), 0.0, height=0.05)
    run.to_csv(tmp_path / "hops.csv")
    rows = list(csv.DictReader((tmp_path / "hops.csv").open()))
    assert list(rows[0]) == [name for name, _, _ in COLUMNS]
    for name, kind, _ in COLUMNS:
        read = [row[name] for row in rows]
        if kind == "f8":
            np.testing.assert_array_equal(np.array(read, dtype=float), run.table[name])
        else:
            assert read == [str(each) for each in run.table[name].tolist()]


def test_an_archive_holds_table_terrain_and_states(tmp_path):
    run = hops()
    run.to_npz(tmp_path / "run.npz", samples=300)
    with np.load(tmp_path / "run.npz") as found:
        assert (found["table"] == run.table).all() and found["terrain"].tolist() == list(run.terrain)
        assert (found["x2"] == run.at(found["t"]).x2).all() and (found["E"] == run.energy(found["t"]).body).all()
        assert found["t"].size == 300 + 2 * len(run.hops)


# ---- terrain ----


def test_terrain_is_what_its_name_says():
    draws = np.array(terrain.uniform(20_000, 0.03, seed=1))
    assert np.abs(draws).max() <= 0.03 and draws.std() == pytest.approx(0.03 / math.sqrt(3.0), rel=0.02)
    normal = np.array(terrain.gaussian(20_000, 0.02, seed=1))
    assert normal.std() == pytest.approx(0.02, rel=0.03) and abs(normal.mean()) < 1e-3
    assert terrain.steps(7, 0.01, 2) == (0.0, 0.0, 0.01, 0.01, 0.0, 0.0, 0.01)
    assert terrain.gaussian(5, 0.01, 1) == terrain.gaussian(5, 0.01, 1) != terrain.gaussian(5, 0.01, 2)


@pytest.mark.parametrize(
    "text", ["0\n0.01\n-0.02\n", "height\n0\n 0.01\n\n-0.02", "x,height\r\n1,0\r\n2,1e-2\r\n3,-0.02\r\n"]
)
def test_terrain_is_read_from_a_file(tmp_path, text):
    path = tmp_path / "ground.csv"
    path.write_text(text)
    assert terrain.read(path) == (0.0, 0.01, -0.02)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("0\n0.01\nnan\n", r"ground.csv, line 3, column 1: .*finite number in m, got 'nan'"),
        ("x,height\n1,0\n2,inf\n", r"ground.csv, line 3, column 'height': .*got 'inf'"),
        ("height\n0\nhigh\n", r"line 3, column 'height': .*got 'high'"),
        ("x,height\n1\n", r"line 2, column 'height': .*got ''"),
        ("x,y\n1,2\n", r"line 1: there is no column 'height', only x, y"),
        ("1,2\n", r"line 1: several columns need a head"),
        ("", "holds no height"),
        ("height\n", "holds no height"),
    ],
)
def test_a_bad_file_is_refused_with_line_and_column(tmp_path, text, said):
    path = tmp_path / "ground.csv"
    path.write_text(text)
    with pytest.raises(hopform.HopformError, match=said):
        terrain.read(path)


# ---- bad input ----


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"ground": []}, "terrain must have at least one height"),
        ({"ground": "flat"}, "terrain must be a sequence of heights"),
        ({"ground": [0.0, math.nan]}, r"terrain\[1\] must be finite m, got nan"),
        ({"ground": np.zeros((2, 2))}, "of one dimension"),
        ({"robot": dataclasses.replace(HOPPER, g=0.0)}, r"hopping needs g > 0 m/s\^2, got 0.0"),
        ({"height": math.inf}, "height must be finite m"),
        ({"height": None}, "give either height or start"),
        ({"start": hopform.State(0, 0, 1, 0)}, "give either height or start"),
        ({"height": None, "start": hopform.State(0, 0, math.nan, 0)}, "start.x2 must be finite m"),
        ({"height": None, "start": hopform.State(0.2, 0, 1, 0)}, "x1 must be within its stroke"),
        ({"controller": math.nan}, "u must be finite A"),
        ({"controller": "exact"}, "controller must be a current in A or a callable"),
        ({"controller": lambda _: math.nan}, "hop 0: .*u must be finite A, got nan"),
        ({"controller": lambda _: []}, r"hop 0: .*steps \(t, u\), at least one, got no step"),
        ({"controller": lambda _: None}, r"hop 0: .*a number in A or steps \(t, u\), got None"),
        (
            {"controller": lambda _: None, "errors": hopform.hopping.Errors(delay=1e-3)},
            r"hop 0: .*steps \(t, u\), got None",
        ),
        (
            {"controller": lambda _: [(0.0,)], "errors": hopform.hopping.Errors(delay=1e-3)},
            r"hop 0: u\[0\] must be a pair",
        ),
        ({"robot": "hopper_c"}, "robot must be a Robot, as load_robot gives it, got 'hopper_c'"),
        ({"errors": 0.1}, "errors must be Errors, got 0.1"),
        ({"controller": FeedForward(-0.01)}, "h_des must not lie below the ground"),
        ({"controller": FeedForward(0.01), "ground": [0.0, 0.02]}, "at hop 1, where the ground is at 0.02 m"),
        ({"controller": AsPrinted(0.01), "ground": [0.02]}, "below the ground"),
        ({"controller": ReturnMap(0.01), "ground": [0.02]}, "below the ground"),
        ({"controller": FeedForward([0.2]), "ground": [0.0, 0.0]}, "got 1 for 2 hops"),
        ({"controller": ReturnMap(0.0), "ground": [0.0]}, "h_des must be > 0 m for maps"),
        ({"controller": ReturnMap(-0.01), "ground": [-0.02]}, "h_des must be > 0 m for maps"),
        ({"seed": -1}, "seed must be a whole number >= 0"),
        ({"horizon": 0.0}, "horizon must be > 0 s"),
        ({"gains": (-1.0, 0.0)}, "Kp must be >= 0"),
        ({"max_phases": 0}, "max_phases must be a whole number >= 1"),
    ],
)
def test_what_is_not_allowed_is_refused_by_name(change, said):
    how = {"ground": ROUGH[:2]} | change
    with pytest.raises(hopform.HopformError, match=said):
        hops(how.pop("ground"), how.pop("controller", 3.0), how.pop("robot", HOPPER), **how)


@pytest.mark.parametrize(
    ("controller", "change", "said"),
    [
        (FeedForward, {"stop_margin": -1.0}, "stop_margin must be >= 0 m"),
        (FeedForward, {"horizon": 0.0}, "horizon must be > 0 s"),
        (AsPrinted, {"grid": 0.0}, "grid must be > 0 A"),
        (AsPrinted, {"half": 2}, "half must be True or False, got 2"),
        (ReturnMap, {"heights": 1}, "heights must be a whole number >= 2"),
        (ReturnMap, {"heights": 10**6, "currents": 10**6}, "heights x currents must be at most"),
        (ReturnMap, {"h_des": "high"}, "h_des must be a number in m, got 'high'"),
    ],
)
def test_a_controller_is_checked_where_it_is_made(controller, change, said):
    with pytest.raises(hopform.HopformError, match=said):
        controller(**({"h_des": 0.2} | change))


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("x1", -1.0, "x1 must be >= 0 m"),
        ("v2", math.nan, "v2 must be finite m/s"),
        ("delay", -1.0, "delay must be >= 0 s"),
        ("current_scale", 0.0, "current_scale must be > 0"),
        ("model", "hopper_c", "model must be a Robot"),
    ],
)
def test_errors_are_checked(field, value, said):
    with pytest.raises(hopform.HopformError, match=said):
        hopform.hopping.Errors(**{field: value})


@pytest.mark.parametrize(
    "call",
    [
        lambda: terrain.flat(0),
        lambda: terrain.uniform(3, -0.1),
        lambda: terrain.generate("hilly", 3),
        lambda: terrain.uniform(3, 0.1, seed=-1),
    ],
)
def test_bad_terrain_is_refused(call):
    with pytest.raises(hopform.HopformError, match="must be"):
        call()
