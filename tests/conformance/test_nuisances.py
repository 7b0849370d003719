"""What clock, logger and sensor did to a recording is named, and fitted, from recordings of a simulator of its own."""

import json
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import hopform
from hopform._front import main
from hopform.identify import _causes as causes
from hopform.identify._drop import GROUND, fit_drop_test
from hopform.identify._force import fit_force
from hopform.identify._held import HELD
from hopform.identify._joint import fit_robot
from hopform.identify._kinds import problem_of
from hopform.identify._recordings import Column, Recording, parse_recording
from hopform.identify._synthetic import record, to_csv
from tests import needs
from tests.conformance import nuisances
from tests.conformance.nuisances import RANGES, measured
from tests.fits import ALONE
from tests.oracle.recordings import Rig, leg, simulate

HOPPER = hopform.load_robot("hopper_c")
PULSES = np.concatenate([np.zeros(100), np.repeat([3.0, -3.0, 1.5, -1.5], 225)])


@cache
def counted() -> nuisances.Count:
    """The first 20 robots of `make test-exhaustive-identification`."""
    return nuisances.measure(nuisances.SEED, robots=20)


@pytest.mark.nightly
def test_intervals_with_nuisances_hold_the_truth_in_19_of_20_cases():
    """320 intervals of 20 robots, which miss together in a fit: 90 to 99 % hold it in 99 of 100 draws."""
    count = counted()
    assert sum(count.total.values()) > 270
    assert 0.90 <= count.share <= 0.99, count.notes
    assert all(count.inside[name] >= 0.85 * count.total[name] for name in RANGES), count.notes


def step(seed: int = 1, noise: float = 1e-4, **sensor: float) -> Recording:
    rig = Rig(25.0, 1200.0, 150.0, 0.78, gamma=65.0, **sensor)
    made = measured(rig, PULSES, 500.0, "x1", np.random.default_rng(seed))
    x = made.columns["x1"].values + noise * np.random.default_rng(seed + 100).standard_normal(PULSES.size)
    made.columns["x1"] = made.columns["x1"]._replace(values=x)  # type: ignore[index]
    return made


def test_a_delay_is_fitted_wherever_a_current_flows():
    fit = fit_robot(steps=step(delay=0.0081), known={"m_eff": 25.0}, compare=False, holdout=False)
    assert fit["delay@0"].low <= 0.0081 <= fit["delay@0"].high
    assert fit["k"].low - fit["k"].stderr <= 1200.0 <= fit["k"].high + fit["k"].stderr
    assert not fit.diagnoses
    names = [each.name for each in fit.estimates]
    at = names.index("delay@0"), names.index("b1")
    assert abs(fit.covariance[at]) > 0.0
    assert math.sqrt(fit.covariance[at[0], at[0]]) == pytest.approx(fit["delay@0"].stderr)


@pytest.mark.parametrize("seed", needs.the_first(range(3)))
def test_friction_that_is_higher_at_rest_is_named_where_noise_tells_it_from_others(seed):
    """Under five times the noise it is possible, as a ripple is."""
    sharp, noisy = (
        fit_robot(steps=step(seed, noise, stribeck=0.5, speed=0.05), known={"m_eff": 25.0}, compare=False)
        for noise in (0.0, 1e-4)
    )
    assert [(each.name, each.possible) for each in sharp.diagnoses] == [("Stribeck", False)]
    assert 0.1 < sharp.diagnoses[0].values["level"] < 2.0
    assert "no option fits it" in sharp.warnings[-1]
    assert "Stribeck" in {each.name for each in noisy.diagnoses} and all(each.possible for each in noisy.diagnoses)
    assert "none of which stands out" in noisy.warnings[-1]


BODY = Rig(3.0, 1200.0, 5.0, 0.6, start=0.04)
LEG = replace(BODY, rest=0.4, drops=1.0, g=9.81, loss=0.05, start=0.6, held=0.1)
BODIES = pytest.mark.parametrize("rig", [BODY, LEG], ids=["decay", "drop"])


@BODIES
def test_the_response_to_friction_at_rest_is_that_of_the_motion(rig):
    """Through touchdowns, reversals and the last sticking, against a difference of the independent time stepping."""
    zero = np.zeros(1500)
    at, high, low = (simulate(replace(rig, stribeck=each, speed=0.1), zero, 500.0) for each in (0.0, 0.01, -0.01))
    text = "\n".join(["time_s,x2_m", *(f"{n / 500.0!r},{x!r}" for n, x in enumerate(at.tolist()))])
    problem = problem_of({HELD["decay"] if rig is BODY else GROUND: parse_recording(text, "still.csv")}, {"m_s": 3.0})
    own = problem.experiments[0]
    truth = {"k": 1200.0, "b2": 5.0, "f2": 0.6, "length": 0.4, "impact_loss": 0.05, "rest@0": 0.0}
    recording = parse_recording(text, "still.csv")
    fit = fit_robot(**{"decays" if rig is BODY else "drops": recording}, known={"m_s": 3.0}, **ALONE)
    values = truth | {name: fit.values[name] for name in ("x@0", "v@0")}
    fastest = float(np.abs(np.gradient(at, 1.0 / 500.0)).max())
    found = own.response_to(values, causes.friction_at_rest(0.1 / fastest), 0.01)
    expected = (high - low)[-own.time.size :] / 0.02
    assert np.abs(found - expected).max() < 0.03 * np.abs(expected).max()


def over_an_actuator(level: float) -> Recording:
    """A drop over a free actuator whose friction is higher at rest, x1 and x2 at 400 Hz, by steps of 10 us."""
    u = np.repeat([2.1, -1.0, 3.0, -2.0, 1.0], 160)
    x = leg(HOPPER, u, 400.0, level, 0.02) + 2e-5 * np.random.default_rng(1).standard_normal((u.size, 2))
    columns = {f"x{n}": Column(f"x{n}_m", "length", n + 1, x[:, n - 1]) for n in (1, 2)}
    return Recording("leg.csv", np.arange(u.size) / 400.0, {**columns, "current": Column("current_A", "current", 4, u)})


@pytest.mark.nightly
@pytest.mark.parametrize("level", [0.0, 0.5])
def test_a_free_actuator_whose_friction_is_higher_at_rest_is_not_explained(level):
    """Its x1 shows where the fit starts though it hits its stops; without that, it ends at three times the masses."""
    known = {"m_s": 3.0, "x1_min": 0.0, "x1_max": 0.08}
    fit = fit_drop_test(over_an_actuator(level), free=True, known=known, compare=False, holdout=False)
    assert fit["m_eff"].value == pytest.approx(25.0, rel=0.05 if level else 0.03)
    assert {each.name for each in fit.diagnoses} <= ({"Stribeck"} if level else set())
    assert fit["m_eff"].method == ("not explained" if level else "profile")


AXIS = Rig(95.0, 0.0, 200.0, 0.2, gamma=35.0)


def axis(amplitude: float, noise: float = 2e-6, seed: int = 1, **changes: float) -> Recording:
    """An axis without a spring, at 1 kHz, its voltage a sum of three sines."""
    t = np.arange(4000) / 1000.0
    u = amplitude * (2.0 * np.sin(4.0 * t) + 1.2 * np.sin(11.0 * t + 1.0) + 0.6 * np.sin(23.0 * t))
    x = simulate(replace(AXIS, **changes), u, 1000.0) + noise * np.random.default_rng(seed).standard_normal(t.size)
    rows = np.stack([t, x, u], axis=1).tolist()
    return parse_recording("\n".join(["time_s,x_m,voltage_V", *(",".join(map(repr, row)) for row in rows)]), "axis.csv")


@pytest.mark.parametrize("known", [{"k_f": 35.0}, {"m": 95.0}], ids=str)
@pytest.mark.parametrize("loss", ["linear", "huber"])
def test_a_fit_in_force_has_the_delay(known, loss):
    """The voltage of the recording is held from sample to sample, which the equation knows."""
    fitted = [name for name in ("m", "b", "F", "load", "k_f") if name not in known]
    fit = fit_force("slide", axis(10.0, delay=0.006), fitted=fitted, known=known, loss=loss)
    assert fit["delay"].value == pytest.approx(0.006, abs=3e-5)
    off = {name: abs(fit[name].value - value) for name, value in (("b", 200.0), ("F", 95.0 * 0.2))}
    assert all(each <= 3.0 * fit[name].stderr for name, each in off.items())


def test_a_fit_in_force_has_no_friction_below_0():
    """Noise takes the least squares there, of b or F, in most recordings of a rig that has none."""
    how = {"fitted": ["m", "b", "F", "load"], "known": {"k_f": 35.0}}
    fits = [fit_force("slide", axis(4.0, seed=seed, f=0.0, b=0.0), **how) for seed in range(3)]
    assert [fit.robot().b == 0.0 or fit.robot().F == 0.0 for fit in fits].count(True) >= 2
    assert all(fit["m"].value == pytest.approx(95.0, rel=1e-3) for fit in fits)
    smooth = fit_force("slide", axis(4.0, f=0.0, b=0.0), cutoff=20.0, **how)
    assert (smooth["F"].low, smooth["F"].method) == (0.0, "t, one-sided at 0")
    assert any("F may be 0: its 95 % upper limit is" in each for each in smooth.statements)


def test_a_fit_in_force_names_friction_at_rest_and_nothing_else():
    """Nor has it intervals then, whether or not its causes were looked for."""
    how = {"fitted": ["m", "b", "F", "load"], "known": {"k_f": 35.0}}
    assert not fit_force("slide", axis(4.0), **how).diagnoses
    stiff = fit_force("slide", axis(4.0, stribeck=1.0, speed=0.1), **how)
    assert [each.name for each in stiff.diagnoses] == ["Stribeck"]
    assert 0.5 < stiff.diagnoses[0].values["level"] < 1.5
    unasked = fit_force("slide", axis(4.0, stribeck=1.0, speed=0.1), diagnose=False, **how)
    assert all(each.method == "not explained" for fit in (stiff, unasked) for each in fit.estimates)
    with pytest.raises(hopform.HopformError, match="a fit in force takes none, got gain"):
        fit_force("slide", axis(4.0), nuisances=["gain"], **how)


@pytest.mark.sliced
def test_nothing_is_named_where_nothing_was_done():
    for seed in range(5):
        assert not fit_robot(steps=step(seed), known={"m_eff": 25.0, "gamma2": -65.0}, compare=False).diagnoses
        made = record(HOPPER, "drop", seed=seed)
        assert not fit_drop_test(made, known={"m_s": 3.0, "k": 1200.0}, compare=False).diagnoses


@pytest.mark.sliced
def test_a_gain_and_a_clock_that_a_fall_alone_does_not_separate_are_named_together():
    """Of a body of unknown spring a fall shows gain clock^2 alone."""
    rig = Rig(3.0, 1200.0, 5.0, 0.6, rest=0.4, drops=1.0, g=9.81, loss=0.05, start=0.6, held=0.1, gain=1.03)
    fall = measured(rig, np.zeros(800), 500.0, "x2", np.random.default_rng(1))
    fit = fit_drop_test(fall, known={"m_s": 3.0}, compare=False)
    assert {each.name for each in fit.diagnoses[:2]} == {"gain", "clock"}
    assert "none of which stands out" in fit.warnings[-1]


@pytest.mark.sliced
@pytest.mark.parametrize("loss", needs.the_first(["soft_l1", "huber", "cauchy"]))
def test_a_robust_fit_has_the_delay_too(loss):
    late = step(delay=0.006)
    values = late.columns["x1"].values
    values[np.random.default_rng(3).choice(values.size, 20, replace=False)] += 0.04
    fit = fit_robot(steps=late, known={"m_eff": 25.0}, loss=loss, compare=False, holdout=False)
    assert not fit.diagnoses
    assert fit["delay@0"].value == pytest.approx(0.006, abs=2e-4)


def test_outliers_that_explain_a_misfit_are_named_with_the_loss_that_withstands_them():
    rng = np.random.default_rng(1)
    rig = Rig(2.2, 900.0, 7.0, 0.9, rest=0.4, drops=1.0, g=9.81, loss=0.05, start=0.6, held=0.1)
    fall = measured(rig, np.zeros(500), 200.0, "x2", rng)
    fall.columns["x2"].values[rng.choice(500, 12, replace=False)] += 0.04
    fit = fit_drop_test(fall, known={"m_s": 2.2}, compare=False, holdout=False)
    assert fit.diagnoses[0].name == "outliers"
    assert fit.diagnoses[0].values["samples"] == 12
    assert "leaving out 12 samples" in fit.warnings[-1]
    assert "--loss huber" in fit.warnings[-1]


def test_a_nuisance_that_there_is_not_is_refused():
    with pytest.raises(hopform.HopformError, match="nuisances must be one of gain, clock, lag, got 'drift'"):
        fit_drop_test(record(HOPPER, "drop", seed=1), nuisances=["drift"])


@pytest.mark.sliced
def test_the_command_names_a_lag_and_fits_it_on_request(tmp_path, capsys):
    file = tmp_path / "slow.csv"
    file.write_text(to_csv(step(lag=0.004, noise=2e-5)), "utf-8")
    assert main(["identify", "all", str(file), "--known", "m_eff=25"]) == 0
    shown = capsys.readouterr()
    assert "a first-order lag of " in shown.err and "fit it with --lag" in shown.err
    assert "not explained" in shown.out
    assert main(["identify", "all", str(file), "--known", "m_eff=25", "--lag", "--json"]) == 0
    parameters = {each["name"]: each for each in json.loads(capsys.readouterr().out)["parameters"]}
    assert parameters["lag1"]["low"] <= 0.004 <= parameters["lag1"]["high"]
