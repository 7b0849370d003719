"""The pictures: they show the numbers they claim to show, look the same every time, and need no display."""

import dataclasses
import os
import re
import runpy
import struct
import subprocess
import sys
import warnings
import xml.etree.ElementTree
from functools import cache
from pathlib import Path

import matplotlib as mpl
import matplotlib.text
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure

import hopform
import hopform.hopping
import hopform.identify
from docs import gallery
from hopform import _figures as results
from hopform import _front as cli
from hopform._figures import plots
from hopform._words import modes_of
from hopform.hopping import _scene as animation
from tests import needs
from tests.pictures import curves, faults

ROOT = Path(__file__).resolve().parents[2]
HOPPER = hopform.load_robot("hopper_c")
STANCES: dict[str, dict] = {
    "takeoff": {"v2": -1.93, "u": 3.0},
    "rest": {"v2": -0.3, "u": 1.0},
    "horizon": {"v2": -1.0, "horizon": 0.05},
    "takeoff at once": {"v2": 1.0},
    "steps": {"v2": -0.61, "u": [(0.0, 0.0), (0.05, 2.0), (0.1, -3.0)]},
    "single precision": {"v2": -1.93, "u": 2.0, "dtype": np.float32},
}


@pytest.fixture(scope="module")
def stance():
    return hopform.solve_stance(HOPPER, **STANCES["steps"])


@pytest.fixture(scope="module")
def run():
    return hopform.hopping.simulate(HOPPER, [0.0] * 3, 3.0, height=0.2)


@pytest.fixture(scope="module")
def figure(stance):
    return results.figure_of(stance)


@pytest.fixture(scope="module")
def svg(figure):
    return plots.render(figure, ".svg")


@pytest.fixture(scope="module")
def run_figure(run):
    return results.figure_of(run)


def texts(svg):
    """What an SVG says: its letters are paths, with the text beside them as a comment."""
    return re.findall(r"<!-- (.*?) -->", svg.decode())


def test_a_stance_has_labels_with_units_and_legends(svg):
    said = texts(svg)
    for text in (
        "x1 [m]", "x2 [m]", "v1 [m/s]", "v2 [m/s]", "contact [N]", "friction_x1 [N]", "E [J]", "H [J]", "u [A]",
        "time since touchdown [ms]", "take-off", "reverses",
        "extends", "retracts", "slips up", "slips down", "at stop",
    ):  # fmt: skip
        assert text in said


def test_a_run_has_labels_with_units_and_legends(run_figure):
    said = texts(plots.render(run_figure, ".svg"))
    for text in ("hop height [cm]", "energy [J]", "time since the start [s]", "stance", "kinetic + gravitational"):
        assert text in said


def test_no_panel_shows_rounding(figure, run_figure):
    """A curve moves by what can be measured, or not at all."""
    for axes in (*figure.axes, *run_figure.axes):
        for _, values in curves(axes).values():
            assert np.ptp(values) == 0.0 or np.ptp(values) > 1e-6, axes.get_ylabel()


def test_events_are_named_at_their_times_in_the_panel_of_their_mass():
    stance = hopform.solve_stance(HOPPER, v2=hopform.touchdown_velocity(HOPPER, height=0.2), u=0.75)
    named = [[(each.xy[0], each.get_text()) for each in axes.texts] for axes in results.figure_of(stance).axes[:4]]
    expected = [[], [], [], [(1e3 * stance.duration, "take-off")]]
    for event in stance.events:
        mass, _, word = event.kind.partition("_")
        expected[["x1", "x2"].index(mass)].append((1e3 * event.time, word.replace("_", " ")))
    assert named == expected
    assert len(stance.events) == 5


def test_the_picture_of_the_readme_is_that_stance_and_its_names_hide_nothing(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT))
    with plots.house_style():
        figure = runpy.run_path(str(ROOT / "docs" / "explanation" / "figures.py"))["stance"]()
    drawn = plots.render(figure, ".svg")
    strokes, force = figure.axes
    assert [axes.get_ylabel() for axes in figure.axes] == ["actuator $x_1$ [mm]", "contact force [N]"]
    stance = hopform.solve_stance(HOPPER, v2=hopform.touchdown_velocity(HOPPER, height=0.2), u=0.75)
    named = sorted((each.xy[0], each.get_text()) for axes in figure.axes for each in axes.texts)
    assert [1e-3 * time for time, _ in named] == pytest.approx([e.time for e in stance.events] + [stance.duration])
    assert [words for _, words in named] == ["sticks", "slips", "hits stop", "body reverses", "slips", "take-off"]
    assert faults(figure) == []
    for axes in (strokes, force):
        boxes = [each.get_window_extent() for each in axes.texts]
        points = axes.transData.transform(axes.lines[0].get_xydata())
        assert not any(box.contains(*point) for box in boxes for point in points)
    kept = (ROOT / "docs" / "images" / "stance_0.75A.svg").read_bytes()
    for now, before in zip(paths(drawn), paths(kept), strict=True):
        assert now == pytest.approx(before, abs=2e-3)


def paths(svg):
    """The blue curves of a picture, each from 0 to 1 both ways: where they stand depends on the fonts."""
    found = re.findall(rb'<path d="([^"]+)"[^>]*stroke: #0072b2', svg)
    curves = [np.array(re.findall(rb"-?[0-9.]+", each), dtype=float).reshape(-1, 2) for each in found]
    assert len(curves) == 2
    return [(each - each.min(axis=0)) / np.ptp(each, axis=0) for each in curves]


def test_an_energy_jump_at_an_impact_is_drawn_upright(run, run_figure):
    t, energy = curves(run_figure.axes[2])["with the spring as in (23) in stance"]
    first = run.hops[0]
    before, after = np.searchsorted(t, first.touchdown_time) - 1, np.searchsorted(t, first.touchdown_time)
    assert energy[before] - energy[after] == pytest.approx(first.energy_lost_at_impact, abs=1e-12)
    assert t[after] - t[before] < 1e-15


def test_the_energy_of_the_body_has_no_jump_at_take_off(run, run_figure):
    """That with the spring as in (23) has: its share at the actuator's displacement, 1200 N/m x1^2/2."""
    panel = curves(run_figure.axes[2])
    (t, body), (_, with_spring) = panel["kinetic + gravitational"], panel["with the spring as in (23) in stance"]
    for hop in run.hops:
        at, behind = np.searchsorted(t, [hop.takeoff_time, np.nextafter(hop.takeoff_time, np.inf)])
        assert behind == at + 1 and body[behind] == pytest.approx(body[at], abs=1e-12)
        share = HOPPER.k * float(hop.stance.end.x1) ** 2 / 2.0
        assert with_spring[at] - with_spring[behind] == pytest.approx(share, abs=1e-12) and share > 0.5


def test_shades_cover_the_stance_and_change_with_the_mode(stance):
    body = [modes_of(phase, stance.robot)[1] for phase in stance.phases]
    axes = plots.Figure().subplots()
    plots.shade(axes, stance.phases, body, 1.0, plots.SHADES)
    down, up = axes.patches
    colours = [plots.SHADES[word]["facecolor"] for word in ("slips down", "slips up")]
    assert [to_hex(each.get_facecolor()).upper() for each in (down, up)] == colours
    assert down.get_x() == 0.0 and down.get_x() + down.get_width() == up.get_x()
    assert up.get_x() + up.get_width() == pytest.approx(stance.duration, rel=1e-15)


@pytest.mark.parametrize("name", needs.the_first([*STANCES], 2))
@pytest.mark.filterwarnings("error")
def test_every_ending_can_be_drawn_without_a_warning(name):
    solved = hopform.solve_stance(HOPPER, **STANCES[name])
    picture = plots.render(results.figure_of(solved), ".svg")
    assert b"</svg>" in picture and len(picture) > 20_000


@pytest.mark.parametrize("name", needs.the_first([*hopform.ROBOTS]))
@pytest.mark.filterwarnings("error")
def test_every_shipped_robot_can_be_drawn_hopping(name):
    run = hopform.hopping.simulate(hopform.load_robot(name), [0.0, 0.01], height=0.1)
    assert len(plots.render(results.figure_of(run), ".png")) > 20_000


def test_the_energy_of_the_ideal_hopper_is_a_line():
    ideal = hopform.hopping.simulate(hopform.load_robot("ideal"), [0.0] * 3, height=0.2)
    axes = results.figure_of(ideal).axes[2]
    energy = curves(axes)["with the spring as in (23) in stance"][1]
    assert np.ptp(energy) < 1e-12
    assert np.ptp(axes.get_ylim()) >= 0.5


def test_a_picture_is_the_same_in_every_process_which_needs_no_pyplot(stance, svg):
    code = f"""
import sys, hopform
from hopform import _figures as results
from hopform._figures import plots
stance = hopform.solve_stance(hopform.load_robot("hopper_c"), **{STANCES["steps"]})
sys.stdout.buffer.write(plots.render(results.figure_of(stance), ".svg"))
assert "matplotlib.pyplot" not in sys.modules
"""
    environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "MPLBACKEND")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, env=environment)
    assert done.stdout == svg


@pytest.mark.parametrize("suffix", needs.the_first([".svg", ".pdf", ".png"]))
def test_a_picture_bears_no_date_and_no_version(figure, suffix):
    picture = plots.render(figure, suffix)
    assert len(picture) > 10_000
    assert not re.search(rb"dc:date|CreationDate|tIME|matplotlib\.org|Matplotlib v", picture)


def test_a_users_own_settings_change_nothing(stance, svg):
    with mpl.rc_context({"lines.linewidth": 9.0, "font.size": 30.0, "svg.fonttype": "none", "axes.grid": True}):
        assert plots.render(results.figure_of(stance), ".svg") == svg
        assert mpl.rcParams["lines.linewidth"] == 9.0


def test_a_png_is_wide_enough_for_a_column(figure):
    picture = plots.render(figure, ".png")
    assert picture.startswith(b"\x89PNG")
    assert struct.unpack(">I", picture[16:20])[0] >= 1000


NAMES = [
    "a$b_$",
    r"$\frac$",
    "$",
    r"\$",
    r"\\$x_1$",
    "run-2^2",
    "5 %",
    "<b> & ]]>",
    "a\tb\x01c\x7f",
    "a -- b",
    "\udcff$",
]
"""Names with mathematics of matplotlib, with marks of XML, and with what neither font nor file has."""


def as_drawn(name):
    """A name as a picture shows it, with a replacement for what is no character."""
    return re.sub("[\t\x01\x7f\udcff]", "\N{REPLACEMENT CHARACTER}", name)


def drawn_titles(figure):
    """The titles of a picture as they are drawn, which is valid XML."""
    root = xml.etree.ElementTree.fromstring(plots.render(figure, ".svg"))
    assert root.tag.endswith("svg")
    titles = [figure.get_suptitle(), *(axes.get_title("left") for axes in figure.axes)]
    shown = [matplotlib.text.Text(text=title)._preprocess_math(title) for title in titles]
    assert not any(is_math for _, is_math in shown)
    return "\n".join(text for text, _ in shown)


@pytest.mark.sliced
@pytest.mark.parametrize("name", [name for name in NAMES if "\udcff" not in name])
@pytest.mark.parametrize("kind", ["stance", "run", "reach", "command"])
def test_a_robots_name_is_drawn_as_it_is(name, kind):
    odd = dataclasses.replace(HOPPER, name=name)
    if kind == "stance":
        figure = results.figure_of(hopform.solve_stance(odd, v2=-1.0))
    elif kind == "run":
        figure = results.figure_of(hopform.hopping.simulate(odd, [0.0], height=0.2))
    elif kind == "reach":
        figure = results.figure_of(hopform.reachability(odd, [0.1, 0.2], [0.0]))
    else:
        figure = results.figure_of(hopform.choose_current(odd, v2=-1.9, h_des=0.2))
    assert drawn_titles(figure).startswith(as_drawn(name))


@pytest.mark.sliced
@pytest.mark.parametrize("name", NAMES)
def test_a_recordings_name_is_drawn_as_it_is(name):
    fit = a_fit()
    answer = dataclasses.replace(fit, traces=tuple(dataclasses.replace(each, label=name) for each in fit.traces))
    assert as_drawn(name) in drawn_titles(results.figure_of(answer))


@cache
def a_fit():
    recording = hopform.identify.record(HOPPER, "decay", height=0.04, duration=1.0, seed=3)
    return hopform.identify.fit_robot(decays=recording, known={"m_s": 3.0}, compare=False, holdout=False)


@given(st.text(st.characters()))
@settings(derandomize=True, deadline=None, max_examples=60)
@pytest.mark.filterwarnings("ignore:Glyph")
def test_any_text_can_be_drawn_as_it_is(text):
    figure = Figure(figsize=(1.0, 1.0))
    figure.suptitle(plots.literal(text))
    drawn = drawn_titles(figure)
    assert len(drawn) == len(text)
    assert all(was == now or not was.isprintable() for was, now in zip(text, drawn, strict=True))


def test_a_suffix_that_cannot_be_drawn_is_refused():
    with pytest.raises(hopform.HopformError, match=r"\.svg, \.pdf or \.png"):
        plots.check_suffix(Path("stance.bmp"))


def test_a_current_has_one_colour():
    """Orange over time, and one scale where several currents have a curve each."""
    steps = hopform.solve_stance(HOPPER, **STANCES["steps"])
    run, flight = (
        hopform.hopping.simulate(HOPPER, [0.0], 3.0, height=0.2),
        hopform.solve_stance(HOPPER, v2=-1.9, u=2.0).fly(),
    )
    figures = [results.figure_of(each) for each in (steps, run, flight)]
    drawn = [
        axes for each in figures for axes in each.axes if axes.get_ylabel() in ("current\nu [A]", "current $u$ [A]")
    ]
    drawn += [gallery.draw(number).figure.axes[1] for number in (6, 9, 16)]
    assert len(drawn) == 6
    assert [axes.get_lines()[-1].get_color() for axes in drawn] == [plots.CURRENT] * 6


def test_the_colours_stay_apart_for_colour_blind_eyes():
    """As seen without red or green cones, by the matrices of Vienot, Brettel and Mollon (1999) for linear RGB."""
    blind = {
        "red": [[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]],
        "green": [[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]],
    }
    colours = [plots.BLUE, plots.ORANGE, plots.GREEN, plots.MAGENTA, plots.SKY, plots.BLACK]
    linear = np.array([to_rgb(colour) for colour in colours]) ** 2.2
    for matrix in blind.values():
        seen = np.clip(linear @ np.array(matrix).T, 0.0, 1.0) ** (1.0 / 2.2)
        apart = np.linalg.norm(seen[:, None] - seen[None], axis=2)[np.triu_indices(len(colours), 1)]
        assert apart.min() > 0.12


def test_the_animation_moves():
    run = hopform.hopping.simulate(
        hopform.load_robot("hopper_c"), hopform.hopping.terrain.uniform(2, 0.04, seed=4),
        hopform.hopping.controllers.FeedForward(0.18), height=0.18,
    )  # fmt: skip
    shown = hopform.hopping.animate(run, h_des=0.18, seconds=0.3, rate=12)
    assert shown.gif[:6] == b"GIF89a" and shown.gif.count(b"\x21\xf9\x04") == 8


def test_the_animations_foot_stands_still_in_stance():
    run = hopform.hopping.simulate(hopform.load_robot("hopper_c"), [0.0, 0.02], 3.0, height=0.2)
    for hop in run.hops:
        inside = np.linspace(hop.touchdown_time, hop.takeoff_time, 5)
        np.testing.assert_allclose(animation.position(run, inside), animation.STRIDE * hop.index, atol=1e-12)


def test_a_name_that_no_font_has_is_drawn_without_a_word(tmp_path, capfd):
    """Nor of a font that the user's own settings name and that is not there."""
    robot = dataclasses.replace(HOPPER, name="\N{FROG FACE}")
    path = tmp_path / "frog.toml"
    path.write_text(robot.to_toml(), "utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert cli.main(["hop", "--robot", str(path), "--height", "0.1", "--plot", str(tmp_path / "hop.png")]) == 0
        hopform.hopping.animate(hopform.hopping.simulate(robot, [0.0], 1.0, height=0.1), seconds=0.2, rate=2)
    assert capfd.readouterr().err == ""
