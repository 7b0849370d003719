"""Recordings that `record` makes are motions of the robot that is given, and fits of them contain it."""

import dataclasses
import math
import re
from functools import partial

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.stats import binom

import hopform
from hopform._front import main
from hopform.identify import record
from hopform.identify._joint import fit_robot
from hopform.identify._recordings import parse_recording
from hopform.identify._synthetic import FREE_STROKE, TESTS, to_csv
from tests.fits import ALONE

HOPPER, OTHER = hopform.load_robot("hopper_c"), hopform.load_robot("hopper_b")
EXACT = {"noise": 0.0, "quantum": 0.0, "rate": 200.0, "seed": 1}
SOME = settings(max_examples=40, deadline=None, derandomize=True)


# ---- stops and travel ----


def compression(robot, made):
    """Of the spring at the samples, from what was recorded [m]: x1 - x2 + L0 + c, from the rest of a decay also its
    load.
    """
    x1 = made.columns["x1"].values if "x1" in made.columns else 0.0
    if made.source.endswith("decay"):
        return (robot.m_s + made.added_mass) * robot.g / robot.k - made.columns["x2"].values
    return x1 - made.columns["x2"].values + robot.L0 + robot.c


def stays_within(robot, made):
    """Whether x1 lies within the stroke, and the compression within the travel, but for rounding."""
    x1 = made.columns["x1"].values if "x1" in made.columns else np.zeros(1)
    inside = robot.x1_min - 1e-12 <= x1.min() and x1.max() <= robot.x1_max + 1e-12
    return inside and ("x2" not in made.columns or compression(robot, made).max() <= robot.travel + 1e-12)


@st.composite
def robots(draw):
    """Near hopper_c, with strokes and travels from far too short to none, offset and either sign of gamma2."""

    def of(low, high):
        return draw(st.floats(low, high))

    low = draw(st.sampled_from([-math.inf, -0.05, -0.01, 0.0]))
    high = draw(st.sampled_from([math.inf, 0.005, 0.03, 0.08, 0.3]))
    return dataclasses.replace(
        HOPPER, m_eff=of(5.0, 50.0), m_s=of(1.0, 6.0), k=of(600.0, 3000.0), c=draw(st.sampled_from([0.0, 0.01])),
        b1=of(0.0, 300.0), f1=draw(st.sampled_from([0.0, 0.5, 1.5])), gamma2=draw(st.sampled_from([-65.0, 20.0])),
        x1_min=low, x1_max=high, travel=draw(st.sampled_from([math.inf, 0.03, 0.1, 0.16])),
    )  # fmt: skip


LIMIT = re.compile(r"(current|height) must be <= (\S+) [Am], got")


@SOME
@given(robots(), st.sampled_from(TESTS), st.floats(0.05, 3.0), st.floats(0.02, 0.4))
@example(HOPPER, "step", 3.0, 0.2)
@example(dataclasses.replace(HOPPER, travel=0.1), "free", 3.0, 0.3)
def test_a_recording_stays_within_stroke_and_travel_or_is_refused_with_what_does(robot, test, current, height):
    """Of settings that are refused those that the message has are accepted; where it has none, a thousandth is not."""
    asked = {"current": current, "height": height}
    make = partial(record, robot, test, duration=1.5, hold=0.1, **EXACT)
    try:
        assert stays_within(robot, make(**asked))
        return
    except hopform.HopformError as error:
        said = str(error)
    named = {name: float(value) for name, value in LIMIT.findall(said)}
    assert all(0.0 < value < asked[name] for name, value in named.items())
    if named:
        assert stays_within(robot, make(**{**asked, **named}))
    else:
        with pytest.raises(hopform.HopformError, match=r"no (current|height|current and height) fits"):
            make(**{name: 1e-3 * value for name, value in asked.items()})


@SOME
@given(robots(), st.sampled_from(TESTS))
def test_settings_that_are_left_out_fit(robot, test):
    """Unless none does: then a current that is hardly one is refused too."""
    make = partial(record, robot, test, duration=1.5, hold=0.1, **EXACT)
    try:
        assert stays_within(robot, make())
    except hopform.HopformError as error:
        assert re.match(r"no (current|height|current and height) fits", str(error))
        with pytest.raises(hopform.HopformError):
            make(current=1e-3, height=1e-3)


@pytest.mark.parametrize(("test", "setting"), [("step", "current"), ("air", "current"), ("drop", "height")])
def test_what_a_refusal_has_is_the_largest_that_fits(test, setting):
    with pytest.raises(hopform.HopformError) as refused:
        record(HOPPER, test, **{setting: 2.5})
    largest = float(LIMIT.findall(str(refused.value))[0][1])
    record(HOPPER, test, **{setting: largest})
    with pytest.raises(hopform.HopformError, match=f"{setting} must be <= "):
        record(HOPPER, test, **{setting: 1.02 * largest})


def test_a_step_that_touches_no_stop_is_a_motion_of_the_robot():
    """(3) integrated sample by sample, in a hundredth of their distance: x1'' with Coulomb friction, no stop."""
    made = record(HOPPER, "step", **(EXACT | {"rate": 500.0}))
    x1, u, v, dt = made.columns["x1"].values, made.current(), 0.0, 1.0 / 500.0 / 100.0
    rest = x = float(x1[0])
    worst = 0.0
    for n in range(1, 500):
        for _ in range(100):
            pull = (-HOPPER.k * (x - rest) - HOPPER.b1 * v - HOPPER.gamma2 * u[n - 1]) / HOPPER.m_eff
            faster = v + dt * (pull - HOPPER.f1 * math.copysign(1.0, v if v != 0.0 else pull))
            held = abs(pull) <= HOPPER.f1 and v * faster <= 0.0
            v = 0.0 if held or (v == 0.0 and abs(pull) <= HOPPER.f1) else faster
            x += dt * v
        worst = max(worst, abs(x - float(x1[n])))
    assert worst < 1e-5  # of a method of first order with steps of 20 us
    assert np.ptp(x1) > 0.05


def test_the_offset_pushes_a_leg_in_the_air():
    """Of (3) k c is left where the spring carries nothing: a constant load of -k c/gamma2 as a current."""
    robot = dataclasses.replace(HOPPER, c=0.01)
    offset = fit_robot(air=record(robot, "air", seed=1), known={"m_eff": 25.0}, **ALONE)["offset"]
    assert offset.value == pytest.approx(1200.0 * 0.01 / 65.0, abs=4.0 * offset.stderr)
    assert offset.stderr < 0.01 * offset.value


def test_an_actuator_whose_stroke_leaves_out_0_is_held_at_its_nearest_stop():
    """The leg is longer by where it is held: the body comes to rest 24.5 mm below that length."""
    robot = dataclasses.replace(HOPPER, x1_min=0.03, x1_max=0.08)
    made = record(robot, "drop", duration=4.0, **EXACT)
    assert made.columns["x2"].values[0] == pytest.approx(0.6)
    assert made.columns["x2"].values[-1] == pytest.approx(0.43 - 3.0 * 9.81 / 1200.0, abs=3.0 * 0.6 / 1200.0)
    assert record(robot, "free", **EXACT).columns["x1"].values.min() >= 0.03
    with pytest.raises(hopform.HopformError, match=r"height must be > 0\.03 m, where the actuator is held or rests"):
        record(robot, "drop", height=0.02)


@pytest.mark.parametrize("test", ["step", "air"])
def test_a_locked_actuator_is_not_moved(test):
    with pytest.raises(hopform.HopformError, match=r"x1_min = x1_max = 0\.0 m locks the actuator of ideal"):
        record(hopform.load_robot("ideal"), test)


def test_no_current_is_above_that_of_the_robot():
    with pytest.raises(hopform.HopformError, match=r"^current must be <= u_max = 3\.0 A, got 3\.1$"):
        record(HOPPER, "step", current=3.1, free_stroke=True)


def test_a_free_stroke_is_asked_for_and_said(capsys):
    """In the first line of the file, which is read as a remark, and by the fit."""
    made = record(HOPPER, "step", current=3.0, free_stroke=True, **EXACT)
    assert np.ptp(made.columns["x1"].values) > 0.38
    read = parse_recording(to_csv(made), "step.csv")
    assert read.remarks == made.remarks == (FREE_STROKE,)
    assert read.line == made.line == 3
    fit = fit_robot(steps=read, known={"m_eff": 25.0}, **ALONE)
    assert f"step.csv: {made.remarks[0]}" in fit.warnings
    assert main(["record", "step", "--current", "3", "--free-stroke", "--duration", "0.5"]) == 0
    assert capsys.readouterr().out.startswith(f"# {made.remarks[0]}\ntime_s,x1_m,current_A\n")
    assert main(["record", "step", "--current", "3"]) == 2
    assert "its stroke is 80 mm; free_stroke (--free-stroke)" in capsys.readouterr().err


# ---- coverage ----


def estimates_of(robot, test, seed):
    """Whether the interval of each parameter contains it, in a fit of a default recording."""
    made = record(robot, test, seed=seed)
    role = {"drop": "drops", "free": "free_drops", "decay": "decays", "step": "steps", "air": "air"}[test]
    known = {"m_eff": robot.m_eff} if test in ("step", "air") else {"m_s": robot.m_s}
    known |= {"x1_min": robot.x1_min, "x1_max": robot.x1_max} if test == "free" else {}
    fit = fit_robot(**{role: made}, known=known, **ALONE)
    truth = {field.name: getattr(robot, field.name) for field in robot.fields()}
    truth |= {"length": robot.L0 + robot.c, "offset": 0.0}
    return [each.low <= truth[each.name] <= each.high for each in fit.estimates if not each.own]


@pytest.mark.nightly
@pytest.mark.parametrize("robot", [HOPPER, OTHER], ids=lambda robot: robot.name)
@pytest.mark.parametrize("test", TESTS)
def test_default_recordings_give_intervals_that_hold(robot, test):
    """95 % intervals, of seven seeds: fewer may contain the truth by chance once in 10 000 times."""
    inside = [each for seed in range(7) for each in estimates_of(robot, test, seed)]
    assert sum(inside) >= binom.ppf(1e-4, len(inside), 0.95)
