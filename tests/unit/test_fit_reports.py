"""A report of a fit: the verdict first, digits by the interval, and what it was made of."""

import dataclasses
import hashlib
import math
import sys

import pytest

import hopform
import hopform.identify
from hopform import _front as cli
from hopform._robots import robot_from_toml
from hopform.identify import _joint as joint
from hopform.identify import _synthetic as synthetic
from hopform.identify._estimation import Estimate
from hopform.identify._joint import fit_robot
from hopform.identify._report import results, rounded, verdict
from hopform.identify._synthetic import record, to_csv
from tests.fits import ALONE

HOPPER = hopform.load_robot("hopper_c")


@pytest.mark.parametrize(
    ("value", "low", "high", "shown"),
    [
        (1200.3543, 1199.44, 1200.98, ("1200.35", "1199.44", "1200.98")),
        (0.0070193, 0.0070010, 0.0070400, ("0.007019", "0.007001", "0.007040")),
        (12345.6, 12000.0, 12600.0, ("12350", "12000", "12600")),
        (0.0, 0.0, 0.01234, ("0.0000", "0.0000", "0.0123")),
        (3.14159, -math.inf, math.inf, ("3.142", "-inf", "inf")),
    ],
)
def test_digits_are_those_that_the_interval_allows(value, low, high, shown):
    assert rounded(Estimate("k", "N/m", value, 0.1, low, high, "profile")) == shown


def test_a_report_begins_with_the_verdict_and_the_parameters(tmp_path):
    path = tmp_path / "decay.csv"
    path.write_text(to_csv(record(HOPPER, "decay", seed=5)), encoding="utf-8")
    page = tmp_path / "page.html"
    assert cli.main(["identify", "all", f"decay:{path}", "--known", "m_s=3", "--report", str(page)]) == 0
    text = page.read_text("utf-8")
    order = [
        "The model explains these recordings to their noise.",
        "<li>k = 1200.",
        "<svg",
        "<h2>Parameters",
        "<h2>Recordings",
        "What the data identify",
    ]
    places = [text.index(each) for each in order]
    assert places == sorted(places)
    assert "width=device-width" in text and text.count('class="wide"') == text.count("<table>")


def test_what_is_not_explained_has_values_without_intervals():
    clean = record(HOPPER, "decay", seed=5)
    x = clean.position("x2") + 1e-3 * (clean.time / clean.time[-1]) ** 2
    made = dataclasses.replace(clean, columns={"x2": clean.columns["x2"]._replace(values=x)})
    fit = fit_robot(decays=made, known={"m_s": 3.0}, **ALONE)
    assert verdict(fit) == "The model does not explain the recordings: values are off by an unknown amount."
    assert results(fit)[0].startswith("k = ") and "(" not in results(fit)[0]


def test_a_robot_s_file_says_what_it_was_made_of(tmp_path, monkeypatch):
    path, out = tmp_path / "step.csv", tmp_path / "mine.toml"
    path.write_text(to_csv(record(HOPPER, "step", seed=2)), encoding="utf-8")
    ask = ["identify", "all", str(path), "--known", "m_eff=25", "--out", str(out)]
    monkeypatch.setattr(sys, "argv", ["/usr/bin/hopform", *ask])
    assert cli.main(ask) == 0
    robot = robot_from_toml(out.read_text("utf-8"), "mine.toml")
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    version, file, *rest = robot.fit.origin
    assert (version, file) == (f"hopform {hopform.__version__}", f"{path} sha256 {digest}")
    assert f"hopform identify all {path}" in rest[0] and rest[1].startswith("delay@0 ")
    assert robot_from_toml(robot.to_toml(), "again.toml").fit == robot.fit


# ---- a plan from ranges ----


@pytest.mark.nightly
def test_a_plan_is_as_hard_as_every_robot_in_its_ranges_bears():
    """A weaker return spring lets the actuator go further under the same current: the softest robot sets it. What the
    plan promises of the hardest to tell holds for a robot in the middle.
    """
    plan = joint.plan(HOPPER, {"k": (600.0, 1800.0)}, seed=3)
    assert [each.test for each in plan.steps] == ["decay", "drop", "air", "step"]
    step = plan.steps[-1]
    soft, hard = (dataclasses.replace(HOPPER, k=k) for k in (600.0, 1800.0))
    assert step.setting == "current"
    alone = [synthetic.hardest([each], "step", step.duration)[1] for each in (soft, hard)]
    assert step.value <= min(alone) < max(alone)
    record(soft, "step", current=step.value, duration=step.duration, seed=1)
    with pytest.raises(hopform.HopformError, match="current must be <="):
        record(soft, "step", current=1.1 * min(alone), duration=step.duration, seed=1)
    made = record(HOPPER, "step", current=step.value, duration=step.duration, seed=4)
    fit = hopform.identify.fit_robot(steps=made, known={"m_eff": 25.0}, **ALONE)
    for name, share in step.gives.items():
        assert fit[name].high - fit[name].low <= 2.0 * 2.0 * share * abs(fit[name].value), name
    assert any("another amplitude or load" in each for each in plan.statements)


def test_a_plan_is_printed_and_a_range_that_is_none_is_refused(capsys, monkeypatch):
    monkeypatch.setattr(joint, "PLANNED", ("air",))
    assert cli.main(["record", "all", "--plan", "--ranges", "b1=100:200"]) == 0
    text = capsys.readouterr().out
    assert "What to record" in text and "current" in text and "air" in text
    said = " ".join(text.split())
    assert "these intervals hold if the model explains your rig; if it does not, a fit gives none" in said
    assert "taken as known without an error: m_s = 3 kg, m_eff = 25 kg; give your own by --known" in said
    for words, said in {
        "record all": "go with --plan", "record step --plan --ranges k=1:2": "go with --plan",
        "record all --plan --ranges k=2:1": "takes NAME=LOW:HIGH", "record all --plan --ranges x=1:2": "must name parameters",
    }.items():  # fmt: skip
        assert cli.main(words.split()) == 2
        assert said in capsys.readouterr().err
