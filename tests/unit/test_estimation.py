"""What is said about parameters is what least squares say in closed form:
covariance, intervals, directions not seen, tests.
"""

import math
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import optimize, signal, stats

import hopform
from hopform.identify import _estimation as estimation
from hopform.identify import _fits as fits
from hopform.identify._drop import fit_drop_test
from hopform.identify._estimation import Parameter
from hopform.identify._fits import fit as fit_of
from hopform.identify._held import HELD
from hopform.identify._joint import fit_robot
from hopform.identify._search import Problem
from hopform.identify._segments import low_passed
from hopform.identify._synthetic import record
from tests import needs
from tests.fits import ALONE

HOPPER = hopform.load_robot("hopper_c")


@dataclass(frozen=True)
class Line:
    """An experiment whose prediction is linear in its parameters."""

    design: dict[str, np.ndarray]
    measured: np.ndarray
    kind: str = "held"
    steps: tuple[tuple[float, float], ...] = ((0.0, 0.0),)
    label: str = "line"
    begin: float = 0.0
    added_mass: float = 0.0
    driven: bool = True
    quantity: str = "x1"
    names: dict[str, str] = field(default_factory=lambda: {"x": "x@0"})

    @property
    def time(self):
        return np.arange(float(self.measured.size))

    def predict(self, values, time=None):
        return sum(values[name] * row for name, row in self.design.items()), dict(self.design)

    def only(self, chosen):
        rows = {name: row[chosen] for name, row in self.design.items()}
        return Line(rows, self.measured[chosen])


def line(truth, count=200, noise=1e-3, seed=1):
    rng = np.random.default_rng(seed)
    design = {name: rng.standard_normal(count) + 0.5 * n for n, name in enumerate(truth)}
    return Line(design, sum(truth[name] * row for name, row in design.items()) + noise * rng.standard_normal(count))


def closed_form(experiment):
    """Estimates, their covariance and degrees of freedom as every textbook has them."""
    a = np.stack(list(experiment.design.values()), axis=1)
    found, *_ = np.linalg.lstsq(a, experiment.measured, rcond=None)
    rest = experiment.measured - a @ found
    freedom = a.shape[0] - a.shape[1]
    return found, np.linalg.inv(a.T @ a) * float(rest @ rest) / freedom, freedom


def solved(experiment, parameters):
    solution = estimation.solve([experiment], parameters, sigma=[1e-3], precision=1e-15)
    return solution, *estimation.estimates(solution)


@pytest.mark.parametrize("kind", ["real", "positive", "nonnegative", "fraction"])
def test_a_place_measures_in_the_coordinate_of_the_optimiser(kind):
    """out() is the inverse of into(), and by() its slope, whatever the value beside the scale."""
    parameter = Parameter("p", "m", 0.5, 0.02, kind)
    place = estimation.Place(SimpleNamespace(parameters=[parameter], values={"p": 0.4}), 0)
    for value in (0.1, 0.4, 0.9):
        assert place.out(place.into(value)) == pytest.approx(value, rel=1e-14)
    assert place.by(1e-6) == pytest.approx((place.into(0.4 + 1e-6) - place.into(0.4 - 1e-6)) / 2.0, rel=1e-8)


def test_covariance_and_intervals_are_those_of_linear_least_squares():
    experiment = line({"a": 0.3, "b": -0.2, "c": 0.1})
    parameters = [Parameter(name, "m", 0.0, 0.1) for name in experiment.design]
    _, found, spread = solved(experiment, parameters)
    values, covariance, freedom = closed_form(experiment)
    assert spread.covariance == pytest.approx(covariance, rel=1e-8)
    t = stats.t.ppf(0.975, freedom)
    for each, value, variance in zip(found, values, np.diag(covariance), strict=True):
        assert each.value == pytest.approx(value, rel=1e-9)
        assert (each.low, each.high) == pytest.approx(
            (value - t * math.sqrt(variance), value + t * math.sqrt(variance))
        )


def test_a_profile_of_a_linear_parameter_is_its_t_interval():
    experiment = line({"a": 0.3, "f1": 0.2})
    parameters = [Parameter("a", "m", 0.0, 0.1), Parameter("f1", "m/s^2", 0.1, 0.1, "nonnegative", profiled=True)]
    _, found, _ = solved(experiment, parameters)
    values, covariance, freedom = closed_form(experiment)
    half = stats.t.ppf(0.975, freedom) * math.sqrt(covariance[1, 1])
    assert found[1].method == "profile"
    assert (found[1].low, found[1].high) == pytest.approx((values[1] - half, values[1] + half), abs=0.03 * half)


def test_an_interval_at_0_has_one_side_and_its_quantile():
    """The estimate is 0.4 standard errors above 0: the upper end is that of 95 % on one side, the lower one is 0."""
    truth = {"a": 0.3, "f1": 0.0}
    experiment = line(truth)
    values, covariance, freedom = closed_form(experiment)
    error = math.sqrt(covariance[1, 1])
    moved = Line(experiment.design, experiment.measured + (0.4 * error - values[1]) * experiment.design["f1"])
    parameters = [Parameter("a", "m", 0.0, 0.1), Parameter("f1", "m/s^2", 0.1, 0.1, "nonnegative", profiled=True)]
    _, found, _ = solved(moved, parameters)
    one, two = (stats.t.ppf(level, freedom) for level in (0.95, 0.975))
    assert found[1].method == "profile, one-sided at 0"
    assert found[1].low == 0.0
    assert found[1].high == pytest.approx((0.4 + one) * error, abs=0.05 * error)
    assert found[1].high < (0.4 + two - 0.2) * error


LOSSES = ("soft_l1", "huber", "cauchy")


def with_outliers(experiment, share, seed):
    rng = np.random.default_rng(seed)
    off = rng.random(experiment.measured.size) < share
    return Line(experiment.design, experiment.measured + np.where(off, 0.05 * rng.choice([-1.0, 1.0], off.size), 0.0))


@pytest.mark.parametrize("loss", LOSSES)
def test_a_robust_minimum_is_that_of_scipy(loss):
    """scipy weighs each sample, where `solve` condenses them: the same cost is lowest at the same place."""
    experiment = with_outliers(line({"a": 0.3, "b": -0.2, "c": 0.1}), 0.05, seed=1)
    parameters = [Parameter(name, "m", 0.0, 0.1) for name in experiment.design]
    found = estimation.solve([experiment], parameters, sigma=[1e-3], loss=loss, precision=1e-14)
    columns = np.stack(list(experiment.design.values()), axis=1) / 1e-3
    usual = optimize.least_squares(
        lambda p: columns @ p - experiment.measured / 1e-3, np.zeros(3), loss=loss, f_scale=2.0, xtol=1e-14, ftol=1e-14
    )
    assert list(found.values.values()) == pytest.approx(usual.x.tolist(), abs=1e-8)
    assert found.cost == pytest.approx(2.0 * usual.cost, rel=1e-10)
    everything = estimation.solve([experiment], [], sigma=[1e-3], fixed=found.values, loss=loss)
    assert everything.cost == pytest.approx(found.cost, rel=1e-12)


@pytest.mark.sliced
@pytest.mark.parametrize("share", needs.the_first([0.05, 0.0]))
@pytest.mark.parametrize("loss", needs.the_first(LOSSES))
def test_standard_errors_of_a_robust_fit_are_the_scatter_of_its_estimates(loss, share):
    """The standard deviation of the 600 errors of 300 fits, each over its standard error, is known to 3 %."""
    parameters = [Parameter(name, "m", 0.0, 0.1) for name in ("a", "b")]
    shares = []
    for seed in range(300):
        experiment = with_outliers(line({"a": 0.3, "b": -0.2}, seed=seed), share, seed)
        found = estimation.solve([experiment], parameters, sigma=[1e-3], loss=loss, precision=1e-8)
        errors = np.array([found.values["a"] - 0.3, found.values["b"] + 0.2])
        shares.append(errors / np.sqrt(np.diag(estimation.spread(found).covariance)))
    assert np.std(shares) == pytest.approx(1.0, abs=0.09)


@pytest.mark.parametrize("loss", LOSSES)
def test_a_robust_profile_of_a_linear_parameter_is_its_t_interval(loss):
    experiment = with_outliers(line({"a": 0.3, "f1": 0.2}), 0.05, seed=2)
    parameters = [Parameter("a", "m", 0.0, 0.1), Parameter("f1", "m/s^2", 0.1, 0.1, "nonnegative", profiled=True)]
    solution = estimation.solve([experiment], parameters, sigma=[1e-3], loss=loss, precision=1e-12)
    found, _ = estimation.estimates(solution)
    half = stats.t.ppf(0.975, solution.freedom) * found[1].stderr
    assert found[1].method == "profile"
    assert (found[1].low, found[1].high) == pytest.approx(
        (found[1].value - half, found[1].value + half), abs=0.15 * half
    )


def test_directions_that_the_data_do_not_see_are_named():
    experiment = line({"a": 0.3, "b": 0.2, "c": 0.1, "d": 0.0})
    design = {**experiment.design, "b": 2.0 * experiment.design["c"], "d": np.zeros(experiment.measured.size)}
    parameters = [Parameter(name, "m", 0.1, 0.1) for name in design]
    _, found, spread = solved(Line(design, experiment.measured), parameters)
    assert spread.weak == ("b", "c", "d")
    assert spread.combinations == (("b", "c"),)
    methods = {each.name: each.method for each in found}
    assert methods == {"a": "t", "b": "not identifiable", "c": "not identifiable", "d": "not identifiable"}


def test_correlations_and_hold_out_are_those_of_the_data(monkeypatch):
    """The last third of the measurements is off by 5 mm: the hold-out says so, the fit to all of it does not."""
    experiment = line({"a": 0.3, "b": -0.2}, count=300)
    shifted = experiment.measured + np.where(np.arange(300) >= 200, 0.005, 0.0)
    problem = Problem(
        "step", "x1", (Line(experiment.design, shifted),),
        tuple(Parameter(name, "m", 0.0, 0.1) for name in experiment.design), ({},), {}, (), (),
    )  # fmt: skip
    monkeypatch.setattr(fits, "problem_of", lambda *_: problem)
    fit = fit_of({HELD["decay"]: record(hopform.load_robot("hopper_c"), "decay", seed=1)}, diagnose=False)
    _, covariance, _ = closed_form(Line(experiment.design, shifted))
    expected = covariance[0, 1] / math.sqrt(covariance[0, 0] * covariance[1, 1])
    assert fit.correlations["a", "b"] == pytest.approx(expected, rel=1e-6)
    assert fit.traces[0].holdout == pytest.approx(0.005, rel=0.1)
    assert not fit.traces[0].tests.white
    assert any("not explained" in each for each in fit.warnings)


def test_residuals_with_a_memory_are_distinguished_from_white_ones():
    """The variance of a mean of a process of first order is (1 + rho)/(1 - rho) times that of as many
    independent ones.
    """
    rng = np.random.default_rng(3)
    noise = rng.standard_normal(4000)
    assert estimation.tests_of(noise).white
    assert estimation.tests_of(noise).inflation == 1.0
    coloured = signal.lfilter([1.0], [1.0, -0.6], noise)
    tests = estimation.tests_of(coloured)
    assert not tests.white
    assert tests.autocorrelation == pytest.approx(0.6, abs=0.04)
    assert tests.inflation == pytest.approx(4.0, rel=0.15)
    assert tests.rms == pytest.approx(1.25, rel=0.05)


@pytest.mark.parametrize("growth", [lambda x: 90.0, lambda x: 0.0, lambda x: 50.0 - x], ids=["high", "flat", "falling"])
def test_an_end_of_an_interval_is_on_its_side_whatever_the_profile_does(growth):
    assert estimation._cross(growth, 0.6, 0.01, 3.84, math.inf) > 0.6
    assert 0.0 <= estimation._cross(growth, 0.6, -0.01, 3.84, 0.0) < 0.6


# ---- filters ----


@pytest.mark.parametrize("cutoff", [5.0, 50.0, 200.0])
def test_a_filter_is_the_butterworth_one_both_ways(cutoff):
    rng = np.random.default_rng(2)
    time = np.arange(4000) / 1000.0
    x = np.sin(7.0 * time) + time + 0.01 * rng.standard_normal(time.size)
    usual = signal.sosfiltfilt(signal.butter(4, cutoff, fs=1000.0, output="sos"), x, padlen=3990)
    inside = slice(int(4000.0 / cutoff), -int(4000.0 / cutoff))
    assert np.abs(low_passed(x, cutoff, 1000.0) - usual)[inside].max() < 1e-6


def test_derivatives_of_what_passes_are_exact():
    """A difference quotient at 100 Hz would lose 10 % of the acceleration of a swing at 50 rad/s."""
    time = np.arange(800) / 100.0
    x = 0.01 * np.sin(50.0 * time) + 0.3 * time
    inside = slice(100, -100)
    v, a = (low_passed(x, 40.0, 100.0, n)[inside] for n in (1, 2))
    gain = 1.0 / (1.0 + (math.tan(0.25) / math.tan(0.4 * math.pi)) ** 8)
    assert np.abs(v - 0.3 - 0.5 * gain * np.cos(50.0 * time)[inside]).max() < 1e-3
    assert np.abs(a + 25.0 * gain * np.sin(50.0 * time)[inside]).max() < 0.05


# ---- where fits went astray ----


@pytest.mark.parametrize("seed", needs.the_first(range(4)))
def test_an_undamped_decay_is_released_at_its_first_swing(seed):
    """All amplitudes are equal: noise must not decide which one it is."""
    body = hopform.Robot(**{**{f.name: getattr(HOPPER, f.name) for f in hopform.Robot.fields()}, "b2": 0.0, "f2": 0.0})
    decay = record(body, "decay", height=0.04, duration=1.6, seed=seed)
    fit = fit_robot(decays=decay, known={"m_s": 3.0}, **ALONE)
    assert fit.traces[0].time[0] < 0.05
    assert fit["f2"].method == "profile, one-sided at 0"
    assert fit["k"].value == pytest.approx(1200.0, rel=1e-3)


def test_a_small_motion_in_noise_is_no_missed_one():
    """The motor moves its mass by a few mm, noise is a tenth of that."""
    weak = hopform.Robot(
        **{**{f.name: getattr(HOPPER, f.name) for f in hopform.Robot.fields()}, "gamma2": -0.9, "f1": 0.005}
    )
    fit = fit_robot(steps=record(weak, "step", seed=1), known={"m_eff": 25.0}, **ALONE)
    assert np.std(fit.traces[0].measured) < 10.0 * fit.rms
    assert not any("misses" in each for each in fit.warnings)


@pytest.mark.sliced
def test_friction_of_an_actuator_that_starts_at_its_stop_has_an_interval_around_it():
    """Into its stop a velocity is lost at once: nothing depends on it, and an interval must not end for that."""
    made = record(HOPPER, "free", rate=1000.0, seed=15)
    fit = fit_drop_test(made, free=True, known={"m_s": 3.0, "x1_min": 0.0, "x1_max": 0.08}, **ALONE)
    for name, truth in (("f1", 0.78), ("f2", 0.6)):
        each = fit[name]
        assert min(each.high - each.value, each.value - each.low) > 0.5 * each.stderr  # causes may widen one side
        assert abs(each.value - truth) < 4.0 * each.stderr
