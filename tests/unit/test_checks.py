"""What recordings can tell is said before a fit, by their Fisher information; so it is of recordings to be made."""

import dataclasses
import re

import numpy as np
import pytest

import hopform
import hopform.identify
from hopform._front import main
from hopform.identify import _alternatives as alternatives
from hopform.identify._drop import fit_drop_test
from hopform.identify._joint import check, fit_robot
from hopform.identify._recordings import Column, Recording
from hopform.identify._synthetic import TESTS, record, to_csv
from tests import needs
from tests.oracle.recordings import Rig, simulate

HOPPER = hopform.load_robot("hopper_c")
TRUTH = {field.name: getattr(HOPPER, field.name) for field in hopform.Robot.fields()} | {"length": HOPPER.L0}


def half(estimate):
    return 0.5 * (estimate.high - estimate.low)


def expected_and_fitted(seed, planned):
    """Half widths of a check's intervals beside those of the fit of the same recordings, a row each.

    The noise is estimated from the samples, by its median to 4 %, or found by the fit; a profile of friction is
    wider or narrower by its kinks. What allows for a cause depends on the size of it that the noise happens to show.
    """
    drop, step = record(HOPPER, "drop", seed=seed), record(HOPPER, "step", seed=seed)
    found = check({"drop": [drop], "step": [step]}, {"m_s": 3.0}, TRUTH if planned else None)
    fit = fit_robot(drops=[drop], steps=[step], known={"m_s": 3.0}, compare=False, holdout=False, diagnose=False)
    assert not found.warnings
    rows = [(half(each), half(fit[each.name])) for each in found.expected if not each.own]
    for each in found.expected:
        if not each.own:
            ratio, allows = half(each) / half(fit[each.name]), "allowing" in each.method + fit[each.name].method
            most = 2.0 if allows else 1.35 if each.name[0] == "f" else 1.15
            assert 1.0 / most <= ratio <= most, each
    return rows


@pytest.mark.parametrize(("seed", "planned"), [(0, True), *needs.sliced((0, False), (1, False), (2, False))])
def test_expected_intervals_are_those_of_the_fit(seed, planned):
    assert len(expected_and_fitted(seed, planned)) == 9


@pytest.mark.sliced
def test_planned_intervals_are_the_mean_of_those_of_fits():
    """Noise shows each cause in some size, so that a fit allows for more than if it showed all as 0."""
    expected, fitted = np.mean([expected_and_fitted(seed, True) for seed in range(8)], axis=0).T
    assert np.all((expected > fitted / 1.15) & (expected < 1.15 * fitted)), expected / fitted


def test_twice_the_noise_doubles_the_intervals_and_four_recordings_halve_them(monkeypatch):
    """Those by noise alone: what causes may hide does not grow in proportion."""
    monkeypatch.setattr(alternatives, "missed", lambda *_: [])

    def widths(noise, seeds):
        made = [record(HOPPER, "decay", height=0.04, noise=noise, quantum=0.0, seed=n) for n in seeds]
        found = check({"decay": made}, {"m_s": 3.0}, TRUTH).expected
        return np.array([half(each) for each in found if not each.own])

    alone = np.mean([widths(2e-4, [n]) for n in range(4)], axis=0)  # each estimates the noise for itself
    assert np.mean([widths(4e-4, [n]) for n in range(4)], axis=0) == pytest.approx(2.0 * alone, rel=0.1)
    assert widths(2e-4, range(4)) == pytest.approx(0.5 * alone, rel=0.1)


def test_what_recordings_do_not_tell_is_named_with_the_recording_that_would():
    still = dataclasses.replace(HOPPER, gamma2=1e-9, x1_min=-np.inf, x1_max=np.inf)
    made = record(still, "free", current=1e-9, seed=2)
    columns = {name: column for name, column in made.columns.items() if name != "current"}
    found = check({"free": [dataclasses.replace(made, columns=columns)]}, {"m_s": 3.0})
    assert any("gamma2 cannot be identified" in each for each in found.statements)
    decay = check({"decay": [record(HOPPER, "decay", height=0.04, seed=1)]}, {"m_s": 3.0})
    assert any("drop it onto the ground" in each for each in decay.statements)
    assert any("a step response gives m_eff" in each for each in decay.statements)


def test_poor_recordings_are_named():
    one_sided = record(HOPPER, "step", seed=1)
    columns = dict(one_sided.columns)
    u = np.where(one_sided.time > 1.0, 3.0, 0.0)
    moved = record(HOPPER, "step", seed=1).columns["x1"].values
    columns["current"] = columns["current"]._replace(values=u)
    columns["x1"] = columns["x1"]._replace(values=moved)
    said = check({"step": [dataclasses.replace(one_sided, columns=columns)]}, {"m_eff": 25.0}).warnings
    assert any("one direction" in each for each in said)
    drop = record(HOPPER, "drop", seed=1)
    drop.columns["x2"].values[[400, 500, 600]] += 0.05
    assert any("3 samples are outliers" in each for each in check({"drop": [drop]}, {"m_s": 3.0}).warnings)
    small = record(HOPPER, "decay", height=0.04, noise=5e-4, quantum=0.0, seed=1)
    assert any("times its noise" in each for each in check({"decay": [small]}, {"m_s": 3.0}).warnings)


def test_what_a_quick_fit_does_not_explain_has_no_interval_to_expect():
    """A play of 0.3 mm, and a stop half way, which is asked about."""
    u = np.concatenate([np.zeros(100), np.repeat([3.0, -3.0, 1.5, -1.5], 225)])

    def checked(**changes):
        x = simulate(Rig(25.0, 1200.0, 150.0, 0.78, gamma=65.0, **changes), u, 500.0)
        x = x + 2e-5 * np.random.default_rng(1).standard_normal(u.size)
        columns = {"x1": Column("x1_m", "length", 2, x), "current": Column("current_A", "current", 3, u)}
        return check({"step": [Recording("log.csv", np.arange(u.size) / 500.0, columns)]}, {"m_eff": 25.0})

    sound, play, stop = checked(), checked(play=3e-4), checked(stop=0.1)
    assert not sound.warnings and sound.expected[0].method.startswith("t")
    for each in (play, stop):
        assert {one.method for one in each.expected} == {"not explained"}
        assert any("log.csv: a quick fit leaves rms" in one for one in each.warnings)
    assert any("log.csv: x1 stays at an extreme" in one and "a stop?" in one for one in stop.warnings)
    assert not any("a stop?" in one for one in play.warnings)


@pytest.mark.parametrize("test", needs.the_first(tuple(TESTS)))
def test_record_and_identify_have_one_vocabulary(test, tmp_path, capsys):
    """Each test that is recorded is identified, and planned, under its own name."""
    file = tmp_path / "it.csv"
    assert main(["record", test, "--seed", "3", "--csv", str(file)]) == 0
    given = {"free": ["m_s=3", "x1_min=0", "x1_max=0.08"], "drop": ["m_s=3"], "decay": ["m_s=3"]}.get(
        test, ["m_eff=25"]
    )
    known = [word for each in given for word in ("--known", each)]
    kind = ["drop", *(["--free"] if test == "free" else [])] if test in ("drop", "free") else ["all"]
    assert main(["identify", *kind, str(file) if kind[0] == "drop" else f"{test}:{file}", *known]) == 0
    capsys.readouterr()
    assert main(["record", test, "--seed", "3", "--plan"]) == 0
    assert re.search(r"Intervals to expect|95 % interval", capsys.readouterr().out)


def test_a_decay_that_is_called_a_drop_is_asked_about(tmp_path, capsys):
    file = tmp_path / "decay.csv"
    file.write_text(to_csv(record(HOPPER, "decay", height=0.04, seed=1)), "utf-8")
    assert main(["identify", "drop", str(file)]) == 2
    assert "or is it a decay: hopform --solver slide fit?" in capsys.readouterr().err


@pytest.mark.nightly
def test_what_was_asked_wrongly_is_answered_with_how_to_ask(tmp_path, capsys):
    """A kind that the columns do not show; stops that nobody gave."""
    names = ("drop", "decay", "step", "free")
    files = {name: str(tmp_path / f"{name}.csv") for name in names}
    for name in names:
        (tmp_path / f"{name}.csv").write_text(to_csv(record(HOPPER, name, height=0.04, seed=1)))

    def answer(*ask):
        assert main(["identify", *ask]) == 2
        return capsys.readouterr().err

    assert f"it was taken for a drop: name its kind, as in decay:{files['decay']}" in answer(
        "check", files["step"], files["decay"]
    )
    stops = ["--known", "x1_min=0.1", "--known", "x1_max=0.08"]
    assert "known: x1_min must be <= x1_max, got 0.1 and 0.08 m" in answer("drop", "--free", files["free"], *stops)
    made = record(HOPPER, "free", seed=4)
    (tmp_path / "free.csv").write_text(to_csv(made))
    assert "does it reach a stop, which --known x1_min=" in answer("drop", "--free", files["free"], "--known", "m_s=3")


def test_a_check_has_no_robot_to_write(tmp_path, capsys):
    file = tmp_path / "drop.csv"
    file.write_text(to_csv(record(HOPPER, "drop", seed=1)), "utf-8")
    assert main(["identify", "check", str(file), "--out", str(tmp_path / "mine.toml")]) == 2
    assert "need a fit" in capsys.readouterr().err
    assert main(["identify", "check", f"drop:{file}", "--known", "m_s=3"]) == 0
    assert "Intervals to expect" in capsys.readouterr().out


def test_fits_are_not_changed_by_a_check():
    drop, step = record(HOPPER, "drop", seed=1), record(HOPPER, "step", seed=2)
    before = fit_drop_test(drop, known={"m_s": 3.0}, compare=False, holdout=False).values
    check({"drop": [drop], "step": [step]}, {"m_s": 3.0})
    assert fit_drop_test(drop, known={"m_s": 3.0}, compare=False, holdout=False).values == before
    assert fit_robot(steps=step, known={"m_eff": 25.0}, compare=False)["k"].low < 1200.0


def test_a_fit_reads_files_as_it_takes_recordings(tmp_path):
    files = [tmp_path / f"{n}.csv" for n in range(2)]
    for n, file in enumerate(files):
        file.write_text(to_csv(record(HOPPER, "decay", height=0.04, seed=n)))
    how = {"known": {"m_s": 3.0}, "compare": False, "holdout": False, "diagnose": False}
    read = fit_robot(decays=[hopform.identify.read_recording(file) for file in files], **how)
    assert fit_robot(decays=[str(files[0]), files[1]], **how).values == read.values
    with pytest.raises(hopform.HopformError, match=r"decays\[1\] must be a Recording.*, or a file of one, got 3"):
        fit_robot(decays=[files[0], 3], **how)


def test_a_wrong_form_is_answered_with_those_that_there_are(capsys):
    assert main(["identify", "all", "x.csv", "--export", "foo"]) == 2
    words = "'foo' is not one of 'mjcf', 'urdf', 'isaac'"
    assert capsys.readouterr().err.startswith(f"hopform: Invalid value for '--export': {words}")
