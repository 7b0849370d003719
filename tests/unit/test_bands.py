"""`--from-fit`: a command's answer for robots drawn from a fit, as 95 % bands around that for the fitted robot."""

import dataclasses
import json
import math
from typing import Any

import numpy as np
import pytest

import hopform
import hopform.hopping
from hopform import _front as cli
from hopform._robots import Provenance
from tests.unit.test_cli import fits

HOPPER = hopform.load_robot("hopper_c")
NAMES, ERRORS = ("k", "b2", "f1", "L0", "impact_loss"), (12.0, 0.2, 0.05, 2e-3, 4e-3)
DRAWS = 40


def identified(errors: Any = ERRORS, white: bool = True) -> hopform.Robot:
    values = tuple(getattr(HOPPER, name) for name in NAMES)
    ends = (tuple(v + s * e for v, e in zip(values, errors, strict=True)) for s in (-2.0, 2.0))
    covariance = tuple(map(tuple, np.diag(np.square(errors)).tolist()))
    fit = Provenance(NAMES, values, *ends, covariance, ("m_s",), "hopper_c", white)
    return dataclasses.replace(HOPPER, name="mine", fit=fit)


@pytest.fixture
def ask(capsys: Any, tmp_path: Any) -> Any:
    """A command about an identified robot: its exit code, JSON or output, errors."""

    def call(robot: hopform.Robot, *arguments: object) -> tuple[int, Any, str]:
        path = tmp_path / "mine.toml"
        path.write_text(robot.to_toml())
        command, *rest = map(str, arguments)
        code = cli.main([command, "--from-fit", str(path), "--draws", str(DRAWS), *rest])
        captured = capsys.readouterr()
        return code, json.loads(captured.out) if "--json" in arguments and code == 0 else captured.out, captured.err

    return call


def band_of(values: list[float]) -> list[float]:
    found = [each for each in values if math.isfinite(each)]
    return [*np.quantile(found, [0.025, 0.975]), len(found) / len(values)]


def listed(band: dict[str, float]) -> list[float]:
    return [band["low"], band["high"], band["share"]]


@pytest.mark.parametrize("start", [{"height": 0.2}, {"v2": -1.9}, {"v2": -1.9, "x2": 0.39, "x1": 0.01}], ids=str)
def test_the_band_of_control_is_that_of_drawn_robots_under_the_current_chosen_for_the_fit(ask, start):
    given = [f"--{name}={value}" for name, value in start.items()]
    code, answer, errors = ask(identified(), "control", "--h-des", 0.25, "--datum", 0.01, "--seed", 3, *given, "--json")
    assert (code, errors) == (0, "")
    assert fits(answer, "hopform control")
    apexes = []
    for each in identified().sample(DRAWS, 3):
        v2 = hopform.touchdown_velocity(each, 0.2) if "height" in start else start["v2"]
        moved = {"x2": start["x2"] + each.L0 - HOPPER.L0} if "x2" in start else {}
        solved = hopform.solve_stance(each, v2=v2, x1=start.get("x1", 0.0), u=answer["u"], **moved)
        apexes.append(solved.apex - 0.01)
    assert listed(answer["band"]) == pytest.approx(band_of(apexes), rel=1e-12)
    assert answer["band"]["low"] < answer["apex"] < answer["band"]["high"]
    assert answer["draws"] == {"count": DRAWS, "seed": 3, "names": list(NAMES), "white": True}


def test_the_bands_of_a_run_are_those_of_robots_that_a_controller_of_the_fit_drives(ask):
    ground = hopform.hopping.terrain.generate("uniform", 4, 0.02, 5)
    asked = ("--height", 0.2, "--terrain", "uniform", "--hops", 4, "--seed", 5, "--controller", "exact", "--h-des", 0.2)
    answer = ask(identified(), "hop", *asked, "--noise-x1", 1e-3, "--json")[1]
    assert fits(answer, "hopform hop")
    errors = hopform.hopping.Errors(1e-3, model=identified())
    law = hopform.hopping.controllers.FeedForward(0.2)
    runs = [hopform.hopping.simulate(each, ground, law, height=0.2, errors=errors, seed=5)
            for each in identified().sample(DRAWS, 5)]  # fmt: skip
    for n, hop in enumerate(answer["hops"]):
        assert listed(hop["band"]) == pytest.approx(band_of([run.hops[n].apex for run in runs]), rel=1e-12)
        assert hop["band"]["high"] - hop["band"]["low"] > 1e-3


def test_the_share_of_robots_that_hop_on_stands_beside_a_band(ask):
    """Near a gap of 2 cm drops some of the robots that friction allows do not take off."""
    wide = identified((12.0, 0.2, 0.2, 2e-3, 4e-3))
    asked = ("--height", 0.02, "--u", 1.36, "--hops", 2)
    answer = ask(wide, "hop", *asked, "--json")[1]
    first = [hopform.next_apex(each, 0.02, 1.36) for each in wide.sample(DRAWS, 0)]
    assert listed(answer["hops"][0]["band"]) == pytest.approx(band_of(first), rel=1e-12)
    assert 0.0 < answer["hops"][0]["band"]["share"] < 1.0
    assert "% of robots)" in ask(wide, "hop", *asked)[1]


def test_the_bands_of_reach_are_those_of_each_robot_s_own_map(ask):
    asked = ("--from", 0.1, "--to", 0.3, "--heights", 3, "--currents", 5)
    answer = ask(identified(), "reach", *asked, "--json")[1]
    assert fits(answer, "hopform reach")
    heights, currents = np.linspace(0.1, 0.3, 3), np.linspace(-3.0, 3.0, 5)
    maps = [hopform.reachability(each, heights, currents) for each in identified().sample(DRAWS, 0)]
    for n, row in enumerate(answer["rows"]):
        for name in ("lowest", "highest", "hold"):
            values = [float(getattr(each, name)[n]) for each in maps]
            if np.isfinite(values).any():
                assert listed(row[f"{name}_band"]) == pytest.approx(band_of(values), rel=1e-12)
            else:
                assert row[f"{name}_band"] == {"low": None, "high": None, "share": 0.0}
        cells = [cell["band"]["high"] for cell in row["cells"]]
        assert cells == pytest.approx(np.quantile([each.apex[n] for each in maps], 0.975, axis=0).tolist())
    assert answer["rows"][0]["hold_band"]["share"] == 1.0
    assert answer["rows"][2]["hold_band"]["share"] == 0.0


@pytest.mark.parametrize(
    "command",
    [
        ("hop", "--height", "0.2", "--hops", "2"), ("control", "--height", "0.2", "--h-des", "0.2"),
        ("reach", "--heights", "3", "--currents", "3"),
    ],
    ids=lambda each: each[0],
)  # fmt: skip
def test_a_table_and_a_picture_show_the_bands_and_what_was_not_identified(ask, tmp_path, command):
    path = tmp_path / "picture.svg"
    code, output, errors = ask(identified(white=False), *command, "--plot", path)
    assert code == 0
    assert "not white: the bands do not cover the error of its model" in errors
    assert "95 %" in output
    assert "drawn from the fit of k, b2, f1, L0, impact_loss" in output
    assert "Not identified, so equal in all: m_eff, c, b1, f2," in output
    bare = tmp_path / "bare.svg"
    assert cli.main([*command, "--plot", str(bare)]) == 0
    magenta = "#a6257a"
    assert path.read_text().count(magenta) > bare.read_text().count(magenta)


@pytest.mark.parametrize(
    "command", [("hop", "--height", "0.2"), ("control", "--v2", "-2", "--h-des", "0.2"), ("reach",)]
)
def test_what_gives_no_draws_is_refused_by_name(ask, command):
    code, _, error = ask(HOPPER, *command)
    assert code == 2
    assert "mine.toml has no fit" in error
    code, _, error = ask(identified(), *command, "--robot", "ideal")
    assert code == 2
    assert "--robot and --from-fit exclude each other" in error
    code, _, error = ask(identified(), *command, "--draws", 100_001)
    assert code == 2


def test_a_parameter_that_was_changed_after_the_fit_is_not_drawn():
    changed = dataclasses.replace(identified(), k=900.0)
    drawn = changed.sample(5, 1)
    assert {each.k for each in drawn} == {900.0}
    assert [each.b2 for each in drawn] == [each.b2 for each in identified().sample(5, 1)]
