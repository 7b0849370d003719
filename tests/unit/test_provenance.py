"""An identified robot knows where its numbers come from, in Python and in TOML, and other robots are drawn from it."""

import dataclasses
import math
import tomllib

import numpy as np
import pytest
from scipy.signal import lfilter

import hopform
from hopform._robots import Provenance, robot_from_toml
from hopform.identify import _estimation as estimation
from hopform.identify._drop import fit_drop_test
from hopform.identify._joint import fit_robot
from hopform.identify._simulators import exported
from hopform.identify._synthetic import record
from tests.fits import ALONE

HOPPER = hopform.load_robot("hopper_c")


@pytest.fixture(scope="module")
def fit():
    drops, steps = [record(HOPPER, "drop", seed=1)], [record(HOPPER, "step", seed=2)]
    return fit_robot(drops=drops, steps=steps, known={"m_s": 3.0}, **ALONE)


def test_each_line_of_an_identified_robot_says_where_it_comes_from(fit):
    robot = fit.robot(HOPPER)
    lines = {line.partition(" = ")[0]: line for line in robot.to_toml().splitlines()}
    assert lines["k"].endswith(f"; fitted, 95 % {fit['k'].low:.6g} .. {fit['k'].high:.6g}")
    assert lines["L0"].endswith(f"; fitted, 95 % {fit['length'].low:.6g} .. {fit['length'].high:.6g}")
    assert lines["m_s"].endswith("; known")
    for name in ("c", "x1_min", "x1_max", "u_max"):
        assert lines[name].endswith("; from hopper_c, NOT IDENTIFIED")
    changed = dataclasses.replace(robot, k=1000.0).to_toml()
    assert f"changed after the fit, which gave {robot.k:.6g}" in changed


def test_an_identified_robot_is_read_back_with_its_fit(fit):
    robot = fit.robot(HOPPER)
    again = robot_from_toml(robot.to_toml())
    assert again == robot
    assert again.fit == robot.fit
    table = tomllib.loads(robot.to_toml())["fit"]
    assert table["names"] == list(robot.fit.names)
    assert again.sample(3, 5) == robot.sample(3, 5)
    assert "[fit]" not in HOPPER.to_toml()


def test_the_covariance_is_that_of_the_intervals_and_the_correlations(fit):
    names = [each.name for each in fit.estimates]
    assert np.sqrt(np.diag(fit.covariance)) == pytest.approx([each.stderr for each in fit.estimates])
    i, j = names.index("k"), names.index("b2")
    expected = fit.correlations["k", "b2"] * fit["k"].stderr * fit["b2"].stderr
    assert fit.covariance[i, j] == pytest.approx(expected)


def test_residuals_with_a_memory_widen_the_covariance_and_leave_no_interval():
    """Noise of which each sample keeps 0.8 of the one before: the variance of a mean of it is 9 times that of white
    noise of the same size. No robots are drawn from what is not explained.
    """
    clean, own = record(HOPPER, "decay", noise=0.0, quantum=0.0, seed=1), np.random.default_rng(2)
    noise = 2e-4 * lfilter([0.6], [1.0, -0.8], own.standard_normal(clean.time.size))
    column = clean.columns["x2"]
    made = dataclasses.replace(clean, columns={"x2": column._replace(values=column.values + noise)})
    how = {"known": {"m_s": 3.0}, **ALONE}
    fit = fit_robot(decays=made, **how)
    white = fit_robot(decays=record(HOPPER, "decay", noise=2e-4, quantum=0.0, seed=1), **how)
    assert any("not explained" in each for each in fit.warnings)
    plain = np.sqrt(np.diag(estimation.spread(white.solution).covariance))
    for name, error in zip((each.name for each in white.estimates), plain, strict=True):
        if name in ("k", "b2"):
            assert fit[name].method == "not explained"
            assert 2.0 * error < fit[name].stderr < 3.6 * error  # 3 times, known to a fifth
    with pytest.raises(hopform.HopformError, match="has no intervals to draw from"):
        fit.sample(4, 1)
    robot = robot_from_toml(fit.robot(HOPPER).to_toml(), "mine.toml")
    assert set(robot.fit.low) == {-math.inf} and set(robot.fit.high) == {math.inf}
    assert not robot.fit.white
    assert "no interval" in exported(fit, "mjcf")


def test_drawn_robots_have_the_fit_s_mean_spread_and_correlation(fit):
    """4000 draws: a standard deviation is known to 1.1 %, a correlation of 0.9 to 0.003."""
    drawn = fit.sample(4000, 1)
    for name, other in (("k", "k"), ("m_eff", "m_eff"), ("b1", "b1"), ("f2", "f2"), ("L0", "length")):
        values = np.array([getattr(each, name) for each in drawn])
        assert values.std() == pytest.approx(fit[other].stderr, rel=0.05)
        assert values.mean() == pytest.approx(fit[other].value, abs=4.0 * fit[other].stderr / 60.0)
    pairs = np.array([(each.k, each.m_eff) for each in drawn])
    r = fit.correlations["k", "m_eff"]
    assert np.corrcoef(pairs.T)[0, 1] == pytest.approx(r, abs=3.0 * (1.0 - r * r) / math.sqrt(4000.0))
    assert {each.m_s for each in drawn} == {3.0}
    assert fit.sample(2, 7) == fit.sample(2, 7) != fit.sample(2, 8)


def test_friction_is_drawn_above_0_and_a_spring_that_is_not_known_is_not_drawn_negative():
    smooth = dataclasses.replace(HOPPER, f2=0.0)
    drawn = fit_drop_test(record(smooth, "drop", seed=4), known={"m_s": 3.0}, compare=False).sample(300, 1)
    assert min(each.f2 for each in drawn) == 0.0
    assert max(each.f2 for each in drawn) > 0.0


def test_what_is_not_identifiable_is_that_of_the_base_and_marked():
    made = record(HOPPER, "step", seed=2)
    fit = fit_robot(steps=made, known={"m_eff": 25.0}, nuisances=["gain"], **ALONE)
    assert fit["gain1"].method == fit["gamma2"].method == "not identifiable"
    robot = fit.robot(HOPPER)
    assert robot.gamma2 == HOPPER.gamma2
    assert "gamma2" not in robot.fit.names
    assert np.isfinite(np.array(robot.fit.covariance)).all()


def test_friction_of_several_recordings_is_their_mean_with_the_covariance_of_a_mean():
    made = [record(HOPPER, "decay", height=0.04, added_mass=mass, seed=7) for mass in (0.0, 2.0)]
    fit = fit_robot(decays=made, **ALONE)
    robot, names = fit.robot(HOPPER), [each.name for each in fit.estimates]
    i, j = names.index("f2@0"), names.index("f2@1")
    expected = 0.25 * (fit.covariance[i, i] + 2.0 * fit.covariance[i, j] + fit.covariance[j, j])
    at = robot.fit.names.index("f2")
    assert robot.f2 == pytest.approx(0.5 * (fit["f2@0"].value + fit["f2@1"].value))
    assert robot.fit.covariance[at][at] == pytest.approx(expected)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ('names = ["k"]\n', r"must have names, values, low"),
        ("fit = 3\n", "fit must be a table"),
    ],
)
def test_a_fit_that_is_none_is_refused(change, words):
    text = HOPPER.to_toml()
    text = change + text if change.startswith("fit") else f"{text}\n[fit]\n{change}"
    with pytest.raises(hopform.HopformError, match=words):
        robot_from_toml(text, "mine.toml")


def test_a_table_of_the_wrong_shape_or_of_unknown_fields_is_refused(fit):
    text = fit.robot(HOPPER).to_toml()
    with pytest.raises(hopform.HopformError, match="names must be parameters"):
        robot_from_toml(text.replace('names = ["m_eff"', 'names = ["mass"'))
    with pytest.raises(hopform.HopformError, match="must be numbers of the shape"):
        robot_from_toml(text.replace('names = ["m_eff", ', "names = ["))
    with pytest.raises(hopform.HopformError, match="has no fit to draw from"):
        HOPPER.sample(3)


ODD = (
    "1", '"x"', "[]", "{}", "nan", "[[1]]", "true", "[1, 2, 3]", '[["a"]]', "1e400", "1" + "0" * 400, "2020-01-01",
    "[{}]", '"\\u0000"', "[1, [2]]", '["k", "k"]', "[1, nan]", "[true, 1]",
)  # fmt: skip
"""Values of TOML."""

ROWS = {
    "names": '["k", "b1"]', "values": "[1200.0, 150.0]", "low": "[1.0, 1.0]", "high": "[2e3, inf]",
    "covariance": "[[1.0, 0.0], [0.0, 2.0]]", "known": '["m_eff"]', "base": '"hopper_c"', "white": "true",
    "origin": "[]",
}  # fmt: skip


@pytest.mark.parametrize("row", ROWS)
def test_any_value_in_the_table_is_taken_or_refused_by_name(row):
    """In one line of bounded length; `base` takes every text, and no list is a list of names."""
    plain, refused = HOPPER.to_toml(), 0
    for value in ODD:
        table = "\n".join(f"{name} = {value if name == row else known}" for name, known in ROWS.items())
        try:
            robot_from_toml(f"{plain}\n[fit]\n{table}\n")
        except hopform.HopformError as error:
            refused += 1
            assert len(str(error)) < 400 and "\n" not in str(error)
    assert refused >= len(ODD) - 3


def test_a_table_without_a_fitted_field_is_read_back():
    empty = Provenance((), (), (), (), (), (), "hopper_c", False)
    robot = dataclasses.replace(HOPPER, fit=empty)
    assert robot_from_toml(robot.to_toml()) == robot
    with pytest.raises(hopform.HopformError, match="has no fit to draw from"):
        robot.sample(3)


@pytest.mark.parametrize("rows", ["[[1.0, 2.0], [2.0, 1.0]]", "[[1.0, 0.5], [0.0, 1.0]]", "[[-1.0, 0.0], [0.0, 1.0]]"])
def test_a_covariance_that_is_none_is_refused(rows):
    table = "\n".join(f"{name} = {rows if name == 'covariance' else known}" for name, known in ROWS.items())
    with pytest.raises(hopform.HopformError, match="covariance must be symmetric and positive semidefinite"):
        robot_from_toml(f"{HOPPER.to_toml()}\n[fit]\n{table}\n")


@pytest.mark.parametrize(("name", "value"), [("count", 2**40), ("count", 0), ("seed", -1), ("seed", 1.5)])
def test_a_sample_is_bounded_and_its_seed_checked(name, value):
    robot = dataclasses.replace(
        HOPPER, fit=Provenance(("k",), (1200.0,), (1.0,), (2e3,), ((4.0,),), (), "hopper_c", True)
    )
    with pytest.raises(hopform.HopformError, match=f"^{name} must be"):
        robot.sample(**{"count": 3, "seed": 1, name: value})


def test_a_fit_that_is_not_explained_gives_no_robots_to_draw(fit):
    """Numbers stay, in TOML too; what is not explained has no interval, and whoever draws from it is told so."""
    robot = fit.robot(HOPPER)
    wide = dataclasses.replace(robot, fit=robot.fit._replace(**{
        end: tuple(sign * math.inf for _ in robot.fit.names) for end, sign in (("low", -1.0), ("high", 1.0))
    }))  # fmt: skip
    again = robot_from_toml(wide.to_toml())
    assert again == wide and "; fitted, no interval" in wide.to_toml()
    with pytest.raises(
        hopform.HopformError, match="has no intervals to draw from: its fit does not explain the recordings"
    ):
        again.sample(2, 1)
    first = robot.fit.names[0]
    one = robot.fit._replace(low=(-math.inf, *robot.fit.low[1:]))
    drawn = dataclasses.replace(robot, fit=one).sample(3, 1)
    assert {getattr(each, first) for each in drawn} == {getattr(robot, first)}
