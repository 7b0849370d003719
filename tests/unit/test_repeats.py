"""Recordings of one rig that differ by more than noise are found out, with the interval that holds what differs."""

import dataclasses

import numpy as np
import pytest
from scipy import stats

import hopform
from hopform._figures import results
from hopform._identify.drop import fit_drop_test
from hopform._identify.step import fit_step_response
from hopform._identify.synthetic import record
from tests.fits import ALONE

HOPPER = hopform.load_robot("hopper_c")


def fitted(made):
    return fit_step_response(made, known={"m_eff": 25.0}, **ALONE)


def test_repeats_of_one_robot_agree_and_the_interval_of_the_fit_is_as_wide_as_their_spread():
    """Over 6 recordings and 4 parameters, pooled: standard deviations over sqrt(6) times the standard errors of the
    fit to all, whose mean of 20 degrees of freedom is 1 within 35 %.
    """
    fit = fitted([record(HOPPER, "step", seed=n) for n in range(6)])
    assert {each.name for each in fit.repeats} == {"k", "b1", "f1", "gamma2"}
    shares = [np.std(each.values, ddof=1) / (np.sqrt(6.0) * fit[each.name].stderr) for each in fit.repeats]
    assert np.sqrt(np.mean(np.square(shares))) == pytest.approx(1.0, abs=0.35)
    assert not any(each.differ for each in fit.repeats)
    for each in fit.repeats:
        half = stats.t.ppf(0.975, 5) * np.std(each.values, ddof=1) / np.sqrt(6.0)
        assert (each.low, each.high) == pytest.approx((np.mean(each.values) - half, np.mean(each.values) + half))
        assert each.quote == ("spread" if 2.0 * half > fit[each.name].high - fit[each.name].low else "interval")


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
    assert any("b1 and f1 are traded against each other" in each for each in fit.statements)


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
