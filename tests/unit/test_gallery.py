"""The paper's figures, docs/gallery: what each one claims holds in the numbers behind it, and captions say whose
parameters they show. What their lines are is tried in test_drawn, whether they can be read in test_pictures.
"""

import dataclasses
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

import hopform
import hopform.hopping
from docs import gallery
from docs.gallery import runs
from hopform._figures import plots
from tests.repository.test_house import installed_by_make_run, of_a_checkout, packages

ROOT = Path(__file__).resolve().parents[2]
ALL = [*range(1, 18)]


@cache
def drawn(number):
    return gallery.draw(number)


def data(number):
    return drawn(number).data


# ---- what they show ----


def test_the_actuator_reaches_neither_place_nor_speed_at_once():
    """Fig. 2: slower than motor and viscous friction alone would make it, all through the pulse; no jump anywhere."""
    shown = data(2)
    during = (shown["u"] > 0.0) & (shown["t"] > 0.0)
    assert np.all(shown["v1"][during] < shown["free"][during])
    assert np.all(np.diff(shown["x1"]) >= 0.0) and np.abs(np.diff(shown["v1"])).max() < 0.01
    assert shown["v1"][0] == 0.0 and shown["v1"].max() < 0.5 * shown["free"].max()


def test_the_actuator_still_compresses_when_a_steady_stance_ends():
    """Fig. 3, and the hops are all alike."""
    shown = data(3)
    assert np.all(shown["takeoff_v1"] > 0.3)
    assert np.ptp(shown["takeoff_x1"]) < 1e-6
    assert shown["peak"] > shown["takeoff_x1"].max() + 0.005


def test_viscous_friction_alone_cannot_be_fitted_to_a_robot_with_dry_friction():
    """Fig. 4: the fit is the best of its neighbourhood, and yet several times the noise is left."""
    from docs.gallery import verification

    shown = data(4)
    assert shown["fitted"].f1 == shown["fitted"].f2 == 0.0
    assert shown["rms x1"] > 5.0 * verification.NOISE and shown["rms x2"] > 5.0 * verification.NOISE
    for factor in (0.8, 1.25):
        other = {name: factor * getattr(shown["fitted"], name) for name in ("b1", "b2")}
        for name, recorded, made in (
            ("b1", "x1", lambda r: verification.step(r, 4.0)),
            ("b2", "x2", verification.drop),
        ):
            changed = dataclasses.replace(shown["fitted"], **{name: other[name]})
            off = verification.misfit(getattr(shown["measured"], recorded), made(changed))
            assert off > shown[f"rms {recorded}"], name


def test_dry_friction_leaves_the_noise_alone():
    """Fig. 10."""
    left = data(10)["rms"]
    assert all(1.8e-4 < value < 2.2e-4 for value in left["new"])
    assert left["old"][0] > 5.0 * left["new"][0] and left["old"][1] > 5.0 * left["new"][1]


@pytest.mark.parametrize("number", [5, 11])
def test_return_maps_lie_within_their_bounds(number):
    reach = data(number)["reach"]
    allowed = reach.admissible
    assert allowed.any(axis=1).all()
    low = np.broadcast_to(reach.lowest[:, None], allowed.shape)[allowed]
    high = np.broadcast_to(reach.highest[:, None], allowed.shape)[allowed]
    assert np.all(reach.apex[allowed] >= low - 1e-9) and np.all(reach.apex[allowed] <= high + 1e-9)


@pytest.mark.parametrize(("number", "u", "height"), [(11, 3.0, 0.252), (5, 10.0, 0.272)])
def test_a_fixed_point_is_where_steady_hopping_settles(number, u, height):
    """Figs. 5, 11: stable, and near where a run under that current ends;
    what is left of the actuator's return is between.
    """
    reach = data(number)["reach"]
    (point,) = [point for point in reach.fixed_points if point.u == u]
    assert point.height == pytest.approx(height, abs=5e-4) and 0.0 < point.multiplier < 1.0
    run = hopform.hopping.simulate(reach.robot, hopform.hopping.terrain.flat(40), u, height=0.2)
    assert run.hops[-1].apex == pytest.approx(point.height, abs=0.035)
    assert np.all(np.diff(run.table["apex"][1:]) > -1e-5)


def test_the_margin_to_the_stop_limits_low_hops_only():
    """Fig. 11: where the largest current comes too near to the stop, the bound bends away from it."""
    reach = data(11)["reach"]
    limited = reach.limited[:, -1]
    assert limited.any() and not limited.all()
    assert np.all(np.diff(limited.astype(int)) <= 0)
    assert np.all(reach.highest[limited] < reach.apex[limited, -1])
    np.testing.assert_allclose(reach.highest[~limited], reach.apex[~limited, -1], rtol=0, atol=1e-9)
    assert 0.01 <= reach.stop_margin <= 0.02
    for height, u in zip(reach.heights[limited], reach.u_highest[limited], strict=True):
        v2 = hopform.touchdown_velocity(reach.robot, height)
        stance = hopform.solve_stance(reach.robot, v2=v2, u=u)
        peak = np.asarray(stance.at(np.linspace(0.0, stance.duration, 4001)).x1).max()
        assert peak == pytest.approx(reach.robot.x1_max - reach.stop_margin, abs=1e-6)


def test_the_caption_says_what_is_lowest():
    """Fig. 11: not the curve without actuation; a current between 0 and the largest leads lower at every height."""
    shown = drawn(11)
    reach = shown.data["reach"]
    passive = reach.apex[:, 0]
    assert reach.currents[0] == 0.0 and np.all(reach.lowest < passive - 1e-4)
    assert 1e-3 < (passive - reach.lowest).max() < 1e-2
    row = int(np.abs(reach.heights - 0.2).argmin())
    for height, u in ((reach.lowest[row], reach.u_lowest[row]), (passive[row], 0.0)):
        assert hopform.next_apex(reach.robot, 0.2, u) == pytest.approx(height, abs=1e-9)
    texts = (
        f"the dashed curve is a drop at 0 A (20 cm become {100.0 * passive[row]:.1f} cm)",
        f"the lowest apex of all currents lies below it, by up to {1000.0 * (passive - reach.lowest).max():.1f} mm: ",
        f"20 cm become {100.0 * reach.lowest[row]:.1f} cm at {reach.u_lowest[row]:.2f} A",
    )
    assert all(text in shown.ours for text in texts), shown.ours
    (dashed,) = [line for line in shown.figure.axes[0].get_lines() if line.get_label() == "no actuation"]
    assert dashed.get_linestyle() == "--"
    np.testing.assert_array_equal(dashed.get_ydata(), 100.0 * passive)


def test_hops_with_noise_lie_around_the_bounds():
    """Fig. 11: as far as the noise of both heights lets them."""
    shown = data(11)
    spread = float(np.sqrt(np.mean(shown["misses"] ** 2)))
    assert 0.7 * shown["noise"] < spread < 2.0 * shown["noise"]


def test_the_first_controller_follows_steps_on_even_ground():
    """Fig. 6: every hop taken, the apexes of the middle third above those of the others."""
    shown = data(6)
    assert shown["run"].status == "completed"
    low, high, lowest = (shown["run"].table["apex"][part].mean() for part in (slice(3, 6), slice(9, 12), slice(15, 18)))
    assert high > low + 0.02 and low > lowest + 0.01
    assert np.abs(shown["miss"][[5, 11, 17]]).max() < 0.003, "the last hop of each third"
    assert shown["miss"][6] < -0.015, "the rise time that the paper speaks of"


def test_the_first_controller_fails_on_rough_ground_where_the_exact_one_holds():
    """Fig. 7: its apexes scatter many times more than on even ground; on every other ground too."""
    shown = data(7)
    assert shown["spread"]["even"] < 5e-4
    assert shown["spread"]["rough"] > 10.0 * shown["spread"]["even"]
    assert np.nanmax(np.abs(shown["miss"]["rough"][3:])) > 0.015
    assert all(np.nanstd(run.table["apex"][3:]) > 10.0 * shown["spread"]["even"] for run in shown["others"])
    assert np.abs(shown["miss"]["exact"]).max() < 1e-9
    assert rms(shown["miss"]["soft"]) < rms(shown["miss"]["rough"]) < rms(shown["miss"]["printed"])
    assert shown["runs"]["exact"].terrain == shown["runs"]["rough"].terrain


def test_errors_make_the_first_controller_worse_those_of_sensors_least():
    """Fig. 8."""
    shown = data(8)
    assert gallery.DRAWN[8].title == "First controller, errors of sensors, motor and clock"
    noise, force, tick = (
        np.sqrt(np.mean(runs.after_steps(shown["alone"][each]) ** 2)) for each in ("noise", "force", "tick")
    )
    assert noise < tick < force
    off, before = (np.nanmean(shown[name][3:] ** 2) ** 0.5 for name in ("miss", "miss without errors"))
    assert off > 1.5 * before


def test_dry_friction_is_read_from_a_ramp_if_the_spring_carries_nothing():
    """Fig. 9: u* = 0.30 A; standing it would be 0.75 A."""
    shown, robot = data(9), hopform.load_robot("hopper_c")
    assert shown["f1"] == pytest.approx(robot.f1, abs=0.005)
    assert shown["onset"]["spring unloaded"] == pytest.approx(0.30, abs=0.002)
    standing = (robot.f1 * robot.m_eff + robot.m_s * robot.g) / abs(robot.gamma2)
    assert shown["onset"]["standing"] == pytest.approx(standing, abs=0.002)


def test_the_ideal_hopper_keeps_its_energy():
    """Fig. 12: the sum stays, its parts do not."""
    shown = data(12)
    assert np.ptp(shown["energy"]) < 1e-12 * shown["energy"][0]
    assert min(np.ptp(shown[name]) for name in ("kinetic", "weight", "spring")) > 5.0


@pytest.mark.parametrize("number", [12, 13, 14])
def test_the_energy_predicted_is_that_after_the_fact(number):
    """Figs. 13, 14: AED before = after, at every instant and for every hop."""
    shown = data(number)
    np.testing.assert_allclose(shown["predicted"], shown["energy"], rtol=0, atol=1e-12)
    table = shown["run"].table
    np.testing.assert_allclose(table["aed"], table["gained"], rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        shown["kinetic"] + shown["weight"] + shown["spring"], shown["energy"], rtol=0, atol=1e-12
    )


def test_a_passive_drop_loses_energy_at_impact_and_in_stance():
    """Fig. 13."""
    shown = data(13)
    assert np.all(np.diff(shown["energy"]) <= 1e-12)
    first = shown["run"].hops[0]
    assert first.energy_lost_at_impact == pytest.approx(0.05 * 3.0 * 9.81 * 0.2, rel=1e-12)
    assert first.stance.aed < -first.energy_lost_at_impact


def test_three_amperes_add_energy_until_the_height_is_steady():
    """Fig. 14: U-shaped minima within the stances, plateaus that rise."""
    shown = data(14)
    apexes = shown["run"].table["apex"]
    assert np.all(np.diff(apexes) > 0.0) and abs(apexes[-1] - shown["steady"]) < 1e-3
    hop = shown["run"].hops[-1]
    energy = np.asarray(hop.stance.energy(np.linspace(0.0, hop.stance.duration, 101)).body)
    assert energy.min() < min(energy[0], energy[-1]) - 1.0


def test_a_noisier_signal_detects_touchdown_later_and_more_often_falsely():
    """Fig. 15: delay and false alarms over noise; a late current costs height."""
    shown = data(15)
    assert shown["detected"].size == shown["true"].size
    assert np.all((shown["detected"] - shown["true"] > 0.0) & (shown["detected"] - shown["true"] < 0.006))
    assert np.all(np.diff(shown["mean delay"]) > 0.0) and np.all(np.diff(shown["false alarms"]) > 0.0)
    np.testing.assert_allclose(shown["drawn"], shown["mean delay"][::4], rtol=0.03)
    assert shown["cost"][0] == 0.0 and np.all(np.diff(shown["cost"]) < 0.0)


@pytest.mark.parametrize("number", [16, 17])
def test_the_exact_controller_reaches_every_height_and_those_that_err_do_not(number):
    """Figs. 16, 17: to 1e-9 m, on rough ground as on even; noise and delay cost millimetres, a wrong gamma2 1 cm."""
    shown = data(number)
    assert shown["run"].status == "completed" and len(shown["run"].hops) == 18
    worst = {name: np.nanmax(np.abs(miss)) for name, miss in shown["miss"].items()}
    assert worst["exact"] < 1e-9 and 5e-4 < worst["late"] < 1e-2 < min(worst["printed"], worst["gamma2 off"])
    assert 1e-3 < worst["noise"] < 5e-2
    assert np.all(shown["miss"]["printed"] < 0.0) and "18 of 18 apexes are too low" in drawn(number).ours
    (line,) = [each for each in drawn(number).figure.axes[2].get_lines() if each.get_label() == "printed"]
    np.testing.assert_allclose(line.get_ydata(), 1e3 * shown["miss"]["printed"][: len(line.get_ydata())])
    assert np.ptp(shown["run"].terrain) == 0.0 if number == 16 else np.ptp(shown["run"].terrain) > 0.02
    errors = drawn(number).figure.axes[2]
    assert errors.get_ylabel() == "apex error [mm]" and errors.get_yscale() == "symlog"
    words = [each.get_text() for each in errors.get_legend().get_texts()]
    assert words == ["all parameters off", *shown["miss"]]


PARAMETERS = ("m_eff", "k", "b1", "b2", "f1", "f2", "gamma2")


@cache
def missed_by_hand(number, name, share):
    """Errors of the apexes [m] where the controller believes in a robot with one parameter off by a share, hop by hop:
    the current of a bracketed root of the believed apex, under which the true robot hops.
    """
    shown = data(number)
    robot, ground, wanted = shown["run"].robot, shown["run"].terrain, shown["wanted"]
    believed = dataclasses.replace(robot, **{name: (1.0 + share) * getattr(robot, name)})
    start = {"v2": -((2.0 * robot.g * (wanted[0] - ground[0]) * (1.0 - robot.impact_loss)) ** 0.5)}
    missed = []
    for n, (level, height) in enumerate(zip(ground, wanted, strict=True)):

        def off(u, hopper, start=start, height=height, level=level):
            return hopform.solve_stance(hopper, **start, u=u).apex + level - height

        currents = np.linspace(1.0, 3.0, 21)  # over which the apex rises
        (last, *_) = np.flatnonzero([off(u, believed) < 0.0 for u in currents])[::-1]
        u = brentq(off, currents[last], currents[last + 1], args=(believed,), xtol=1e-12)
        missed.append(off(u, robot))
        if n + 1 < len(ground):
            # The return in flight is designed for the true robot, which moves these errors by 0.03 mm at most.
            touchdown = hopform.solve_stance(robot, **start, u=u).fly(ground[n + 1] - level).touchdown
            start = {"x1": touchdown.x1, "v1": touchdown.v1, "v2": touchdown.v2}
    return np.array(missed)


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.parametrize("number", [16, 17])
def test_the_costliest_parameter_is_that_of_errors_one_at_a_time(number):
    """Figs. 16, 17: gamma2, of 7 parameters off by 5 % either way."""
    shown = data(number)
    by_hand = {(name, share): missed_by_hand(number, name, share) for name in PARAMETERS for share in (-0.05, 0.05)}
    assert shown["alone"].keys() == {f"{name} {share}" for name, share in by_hand}
    for (name, share), missed in by_hand.items():
        np.testing.assert_allclose(shown["alone"][f"{name} {share}"], missed, rtol=0, atol=5e-5)
    name, share = max(by_hand, key=lambda each: rms(by_hand[each]))
    np.testing.assert_allclose(shown["miss"][f"{name} off"], by_hand[name, share], rtol=0, atol=5e-5)
    said = re.search(
        r"Of one parameter alone (\w+), 5 % too (\w+), costs most: ([\d.]+) mm rms, ([\d.]+) mm at", drawn(number).ours
    )
    assert said is not None and said.groups()[:2] == (name, "small" if share < 0.0 else "large") == ("gamma2", "small")
    most = 1e3 * np.abs(by_hand[name, share]).max()
    assert [float(each) for each in said.groups()[2:]] == pytest.approx(
        [1e3 * rms(by_hand[name, share]), most], abs=0.1
    )


@pytest.mark.parametrize("number", [16, 17])
def test_models_whose_errors_do_not_cancel_are_in_the_band(number):
    """Figs. 16, 17: 32 models, every parameter 5 % off with a sign of its own. Their errors are, to first order, the
    sums of those of one parameter at a time, whose rms is the root of the sum of squares.
    """
    shown = data(number)
    shares, missed = shown["shares"], shown["all off"]
    assert shares.shape == (7, 32) and missed.shape == (18, 32) and np.all(np.abs(shares) == 0.05)
    assert len({*map(tuple, shares.T)}) > 20 and np.all(np.abs(shares.mean(axis=1)) < 0.03)
    sums = np.zeros(missed.shape)
    for name, row in zip(PARAMETERS, shares, strict=True):
        sums += np.array([missed_by_hand(number, name, share) for share in row]).T
    assert rms(missed - sums) < 0.1 * rms(sums)
    expected = np.sqrt(sum(rms(missed_by_hand(number, name, 0.05)) ** 2 for name in PARAMETERS))
    assert 0.8 * expected < rms(missed) < 1.25 * expected
    said = re.search(
        r"for 32 models: ([\d.]+) mm rms, ([\d.]+) to ([\d.]+) mm rms by the model, ([\d.]+) mm", drawn(number).ours
    )
    by_model = [rms(each) for each in missed.T]
    numbers = [1e3 * each for each in (rms(missed), min(by_model), max(by_model), np.abs(missed).max())]
    assert said is not None and [float(each) for each in said.groups()] == pytest.approx(numbers, abs=0.051)


@pytest.mark.parametrize("number", [6, 7, 8, 16, 17])
def test_terrain_hops_show_ground_desired_height_current_and_shaded_stances(number):
    top, middle, bottom, *_ = drawn(number).figure.axes
    run = next(each for name, each in {"": None, **data(number), **data(number).get("runs", {})}.items()
               if isinstance(each, hopform.hopping.Run) and name != "printed")  # fmt: skip
    words = [each.get_text() for each in top.get_legend().get_texts()]
    assert {"body", "apex", "take-off", "desired", "stance"} <= set(words) and ("ground" in words) == any(run.terrain)
    assert re.search(r"\$u\$ \[[AV]\]", middle.get_ylabel())
    assert all(len(axes.patches) >= len(run.hops) for axes in (top, middle, bottom))


@pytest.mark.parametrize("number", [12, 13, 14])
def test_take_offs_are_marked_where_energy_is_drawn(number):
    marks = [line for line in drawn(number).figure.axes[0].get_lines() if line.get_label() == "take-off"]
    lifts = [hop.takeoff_time for hop in data(number)["run"].hops if hop.stance.takeoff is not None]
    assert [line.get_xdata().tolist() for line in marks] == [lifts]


def test_the_schematic_has_every_coordinate_and_force():
    words = " ".join(each.get_text() for axes in drawn(1).figure.axes for each in axes.texts)
    for word in (
        "$x_1$",
        "$x_2$",
        "$L_0 + c$",
        "$k$",
        "F",
        r"$-\gamma_2 u$",
        "$m_s$",
        "$m_{eff}$",
        "$m_s g$",
        "$R_1$",
        "$R_2$",
    ):
        assert word in words
    assert "a positive input lifts the body" in drawn(1).ours
    other = dataclasses.replace(hopform.load_robot("hopper_c"), gamma2=65.0)
    assert "a positive input lowers the body" in gallery.machine.schematic(other)[1]


# ---- what they look like ----


@pytest.mark.parametrize("number", ALL)
def test_a_caption_says_what_the_paper_shows_what_ours_shows_and_whose_parameters_these_are(number):
    shown = drawn(number)
    text = shown.in_markdown("a.svg")
    assert text.startswith(f"## Fig. {number}. ") and f"**The paper** shows {gallery.DRAWN[number].paper}." in text
    assert f"**Here:** {shown.ours}." in text and "![Fig." in text and "](a.svg)" in text
    assert text.endswith(f"Parameters: {shown.robot}, this project's own; the paper gives none.\n")
    assert re.search(r"hopper_b|hopper_c|ideal", shown.robot)
    assert len(re.findall(r"\d", shown.ours)) >= 6, "no numbers"
    assert "nan" not in text


@pytest.mark.parametrize("number", ALL)
def test_axes_have_names_with_units_and_the_curves_fit(number):
    for axes in drawn(number).figure.axes:
        if number != 1:
            assert re.search(r"\[.+\]", axes.get_ylabel()), axes
        assert axes.get_xlabel() == "" or re.search(r"\[.+\]", axes.get_xlabel())
    assert number == 1 or any(axes.get_legend() is not None for axes in drawn(number).figure.axes)


# ---- how they are made ----


@pytest.mark.sliced
def test_the_figures_are_written_with_what_make_run_installs(tmp_path):
    """Fig. 11 has a map; no other package of any extra can be imported."""
    absent = of_a_checkout() - installed_by_make_run()
    assert "xarray" in absent
    program = (
        f"import runpy, sys; sys.modules |= dict.fromkeys({absent!r}); sys.argv[1:] = [{str(tmp_path)!r}, '11', '12']; "
        "runpy.run_module('docs.gallery', run_name='__main__')"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    names = {"fig_11.svg", "fig_12.svg", "captions.md", "animation.gif"}
    assert {path.name for path in tmp_path.iterdir()} == names
    captions = (tmp_path / "captions.md").read_text("utf-8")
    assert captions.count("\n## Fig. ") == 2 and "](fig_11.svg)" in captions
    assert b"</svg>" in (tmp_path / "fig_12.svg").read_bytes()
    assert (tmp_path / "animation.gif").read_bytes()[:6] == b"GIF89a"


@pytest.mark.parametrize(
    ("arguments", "why"),
    [
        (["{}", "18"], "the figures are 1 to 17, got '18'"),
        (["{}", "7", "seven"], "the figures are 1 to 17, got 'seven'"),
        ([], "required: DIR"),
    ],
)
def test_a_figure_that_is_none_is_refused_and_nothing_is_written(tmp_path, arguments, why):
    folder = tmp_path / "figures"
    command = [sys.executable, "-m", "docs.gallery", *(each.format(folder) for each in arguments)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stderr.endswith(f"{why}\n") and not folder.exists()


def test_pictures_need_numpy_and_matplotlib_alone():
    """The rule of the house for the runtime, where it draws, and for the gallery."""
    for folder, known in ((Path(plots.__file__).parent, set()), (Path(gallery.__file__).parent, {"docs"})):
        found = {name for path in folder.glob("*.py") for name in packages(path)}
        assert found == {"hopform", "numpy", "matplotlib"} | known
