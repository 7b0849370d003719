"""Repeats show how well a rig repeats. They never make an interval, and take it away where recordings differ."""

import dataclasses

import numpy as np
import pytest

import hopform
from hopform import _figures as results
from hopform.identify._drop import fit_drop_test
from hopform.identify._joint import fit_robot
from hopform.identify._repeats import REPEATABILITY
from hopform.identify._report import verdict
from hopform.identify._synthetic import record
from tests.fits import ALONE

HOPPER = hopform.load_robot("hopper_c")


def fitted(made):
    return fit_robot(steps=made, known={"m_eff": 25.0}, **ALONE)


def has_intervals(fit):
    return any(np.isfinite(each.high - each.low) for each in fit.estimates)


def test_repeats_of_one_robot_agree_and_their_spread_is_that_of_the_noise():
    """Over 6 recordings and 4 parameters, pooled: standard deviations over sqrt(6) times the standard errors of the
    fit to all, whose mean of 20 degrees of freedom is 1 within 35 %.
    """
    fit = fitted([record(HOPPER, "step", seed=n) for n in range(6)])
    assert {each.name for each in fit.repeats} == {"k", "b1", "f1", "gamma2"}
    shares = [np.std(each.values, ddof=1) / (np.sqrt(6.0) * fit[each.name].stderr) for each in fit.repeats]
    assert np.sqrt(np.mean(np.square(shares))) == pytest.approx(1.0, abs=0.35)
    assert not any(each.differ for each in fit.repeats)
    assert [each.spread for each in fit.repeats] == [np.std(each.values, ddof=1) for each in fit.repeats]
    assert has_intervals(fit) and REPEATABILITY in fit.statements


def hardened(recording):
    """A position that shows 3 % more at 4 cm: as of a spring that hardens, in every recording alike."""
    x = recording.position("x2")
    columns = {"x2": recording.columns["x2"]._replace(values=x * (1.0 + 20.0 * (x - x[-1]) ** 2))}
    return dataclasses.replace(recording, columns=columns)


@pytest.mark.parametrize("count", [1, 3])
def test_recordings_that_agree_on_a_wrong_model_have_no_interval(count):
    made = [hardened(record(HOPPER, "decay", seed=n)) for n in range(count)]
    fit = fit_robot(decays=made, known={"m_s": 3.0}, **ALONE)
    assert not has_intervals(fit)
    assert {each.name: each.spread / each.values[0] < 0.01 for each in fit.repeats}.get("k", count == 1)
    sentence = verdict(fit)
    assert sentence.startswith("The model does not explain the recordings: values are off by an unknown amount")
    assert (count == 1) == sentence.endswith("unknown amount.")
    if count > 1:
        k = next(each.values for each in fit.repeats if each.name == "k")
        agree = f"k within {100.0 * (max(k) - min(k)) / np.mean(k):.2g} %"
        assert f"from recording to recording they agree: {agree}" in sentence
    with pytest.raises(
        hopform.HopformError, match="has no intervals to draw from: its fit does not explain the recordings"
    ):
        fit.sample(3)


@pytest.mark.parametrize("least, said", [(0.03, False), (0.015, True)])
def test_recordings_of_other_amplitudes_are_said_to_show_whether_the_model_holds(least, said):
    made = [record(HOPPER, "decay", seed=n, height=height) for n, height in enumerate((0.04, least))]
    fit = fit_robot(decays=made, known={"m_s": 3.0}, **ALONE)
    of_amplitude = [each for each in fit.statements if "in amplitude: values that agree support the model" in each]
    assert bool(of_amplitude) == said and (REPEATABILITY in fit.statements) != said


@pytest.mark.sliced
def test_friction_that_is_traded_from_recording_to_recording_is_said():
    """Four recordings of a guide whose viscous friction is high where its Coulomb friction is low."""
    friction = [(120.0, 1.1), (180.0, 0.5), (150.0, 0.8), (135.0, 0.95)]
    robots = [dataclasses.replace(HOPPER, b1=b1, f1=f1) for b1, f1 in friction]
    fit = fitted([record(robot, "step", seed=n) for n, robot in enumerate(robots)])
    repeats = {each.name: each for each in fit.repeats}
    for name in ("b1", "f1"):
        assert repeats[name].differ
        assert repeats[name].values == pytest.approx([getattr(robot, name) for robot in robots], rel=0.03)
        assert any(each.startswith(f"{name} of each recording alone") for each in fit.statements)
    assert not has_intervals(fit)
    assert any("b1 and f1 are correlated from recording to recording" in each for each in fit.statements)


@pytest.mark.sliced
def test_the_picture_has_residuals_over_position_and_velocity_and_the_correlations():
    fit = fitted([record(HOPPER, "step", seed=n) for n in range(2)])
    axes = {each.get_xlabel(): each for each in results.figure_of(fit).axes}
    assert len(results.figure_of(fit).axes) == 4 * 2 + 2
    (points,) = axes["d x1/dt [mm/s]"].lines
    trace = fit.traces[-1]
    assert points.get_ydata() == pytest.approx(1e3 * (trace.predicted - trace.measured))
    assert np.abs(points.get_xdata()).max() == pytest.approx(
        1e3 * np.abs(np.gradient(trace.predicted, trace.time)).max()
    )
    (image,) = axes["correlations"].get_images()
    names = [label.get_text() for label in axes["correlations"].get_xticklabels()]
    at = names.index("k"), names.index("gamma2")
    assert image.get_array()[at] == pytest.approx(fit.correlations["k", "gamma2"])


def test_one_recording_has_no_repeats_and_several_drops_in_one_have():
    assert not fit_drop_test(record(HOPPER, "drop", seed=1), known={"m_s": 3.0}, **ALONE).repeats
    three = record(HOPPER, "drop", repeats=3, seed=1)
    fit = fit_drop_test(three, known={"m_s": 3.0}, **ALONE)
    assert {len(each.values) for each in fit.repeats} == {3}
