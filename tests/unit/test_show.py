"""Results show themselves: three lines, a table with a curve, a plot, a dataset with units."""

import copy
import pickle
import sys
import xml.etree.ElementTree
from dataclasses import replace
from typing import get_args

import matplotlib as mpl
import numpy as np
import pytest
import xarray

import hopform
import hopform.hopping
import hopform.identify
from hopform import _figures as results
from hopform import _show
from hopform._solver import package
from tests.unit.test_plots import HOPPER, a_fit

mpl.use("Agg")


def made() -> dict[str, _show.Shown]:
    stance = hopform.solve_stance(HOPPER, v2=-1.93, u=3.0)
    run = hopform.hopping.simulate(HOPPER, [0.0, 0.02, -0.01], hopform.hopping.controllers.FeedForward(0.2), height=0.2)
    two = hopform.solve_stances(HOPPER, v2=[[-2.0], [-1.0]], u=[0.0, 1.0, 3.0], events=True, sensitivities=True)
    assert two.sensitivities is not None
    return {
        "Stance": stance, "Flight": stance.fly(), "Hop": run.hops[1], "Run": run, "Batch": two,
        "Flights": hopform.solve_flights(HOPPER, v2=[[2.0], [1.0]], x1=[0.0, 0.03], times=[0.0, 0.1], events=True),
        "Command": hopform.choose_current(HOPPER, v2=-1.93, h_des=0.2),
        "Reachability": hopform.reachability(HOPPER, np.linspace(0.05, 0.3, 6), np.linspace(-3.0, 3.0, 5)),
        "Sensitivities": stance.sensitivities, "ManySensitivities": two.sensitivities, "Fit": a_fit(),
        "Hops": hopform.solve_hops(HOPPER, height=np.array([[0.2], [0.1]]), u=[[0.0], [3.0]], hops=4),
        "Recording": hopform.identify.record(HOPPER, "free", seed=1),
    }  # fmt: skip


SHOWN = made()
each = pytest.mark.parametrize("name", SHOWN)


def test_every_result_that_shows_itself_is_tried_here():
    def below(kind: type) -> set[str]:
        ours = (inner for inner in kind.__subclasses__() if inner.__module__.startswith("hopform."))
        return {kind.__name__}.union(*map(below, ours))

    within = {"Shown", "OverTime", "_Legs", "_Derivatives", "Motion", "Motions"}  # the last two in test_motion.py
    assert below(_show.Shown) - within == set(SHOWN) == {type(result).__name__ for result in SHOWN.values()}


@each
def test_a_result_has_three_lines(name):
    lines = repr(SHOWN[name]).splitlines()
    assert len(lines) == 3 and all(0 < len(line) <= 120 for line in lines)
    assert lines[1].startswith("  ") and " = " in lines[1] and " = " in lines[2]
    assert "nan" not in lines[0]


@each
def test_a_notebook_gets_a_table_and_a_curve_that_are_well_formed(name):
    text = SHOWN[name]._repr_html_()
    root = xml.etree.ElementTree.fromstring(text)
    rows = root.findall(".//tr")
    assert 4 <= len(rows) <= 12 and len(text) < 9000
    curve = root.find(".//{http://www.w3.org/2000/svg}path")
    if "ensitivities" not in name:
        assert curve is not None and curve.attrib["d"].startswith("M") and "nan" not in curve.attrib["d"]


def test_what_a_robot_is_called_is_escaped():
    odd = replace(HOPPER, name="<b>\x1b[2J&amp;" + 200 * "x")
    stance = hopform.solve_stance(odd, v2=-1.93)
    assert "\x1b" not in repr(stance) and max(map(len, repr(stance).splitlines())) <= 120
    xml.etree.ElementTree.fromstring(stance._repr_html_())
    assert "<b>\\x1b" not in stance._repr_html_()


def test_a_curve_is_interrupted_where_it_is_not_finite():
    svg = _show.sparkline("y", np.arange(5.0), [0.0, 1.0, np.nan, 1.0, np.inf])
    path = xml.etree.ElementTree.fromstring(f"<div>{svg}</div>").find(".//{http://www.w3.org/2000/svg}path")
    assert path is not None and path.attrib["d"] == "M0.0,56.0 L106.7,4.0 M320.0,4.0"
    assert _show.sparkline("y", [0.0], [np.nan]) == ""
    assert "M160.0,30.0" in _show.sparkline("y", [1.0], [2.0])


@each
def test_a_dataset_has_units_and_named_dimensions(name):
    found = SHOWN[name].to_xarray()
    assert isinstance(found, xarray.Dataset) and found.attrs["title"] == repr(SHOWN[name]).splitlines()[0]
    numbers = [each for each in found.variables if found[each].dtype.kind == "f"]
    assert numbers
    bare = {"multiplier", "fixed_multiplier", "direction", "value", "low", "high", "covariance"}
    assert [str(each) for each in numbers if not found[each].attrs.get("units") and each not in bare] == []
    assert found.to_dataframe is not None


def test_a_motion_is_that_of_the_result_at_any_times():
    for name in ("Stance", "Flight", "Hop", "Run"):
        motion = SHOWN[name]
        assert isinstance(motion, _show.OverTime)
        t = np.array([0.0, 0.3, 1.0]) * motion.duration
        found = motion.to_xarray(t)
        np.testing.assert_array_equal(found.time, t)
        for column in ("x1", "v1", "x2", "v2"):
            np.testing.assert_array_equal(found[column], getattr(motion.at(t), column))
        assert found.x2.attrs == {"units": "m"} and motion.to_xarray(0.0).sizes["time"] == 1
        with pytest.raises(hopform.HopformError, match="one dimension"):
            motion.to_xarray(np.zeros((2, 2)))


def test_the_table_of_a_run_is_in_its_dataset():
    run = SHOWN["Run"]
    found = run.to_xarray()
    np.testing.assert_array_equal(found.hop_apex, run.table["apex"])
    assert found.hop_v2.attrs == {"units": "m/s", "long_name": "at touchdown, after the impact"}
    assert found.hop_status.attrs == {"long_name": "ending of the stance"}


def test_a_hop_goes_through_flight_and_stance():
    run, hop = SHOWN["Run"], SHOWN["Run"].hops[1]
    t = np.linspace(0.0, hop.duration, 41)
    begin = hop.touchdown_time - hop.flight.duration
    np.testing.assert_allclose(np.array(hop.at(t)), np.array(run.at(begin + t)), rtol=0, atol=1e-12)
    later = t[1:]  # where it begins the stance before it ends, whose energy counts from another ground
    np.testing.assert_allclose(hop.energy(later).body, run.energy(begin + later).body, rtol=0, atol=1e-11)
    np.testing.assert_allclose(hop.aed(t), hop.energy(t).body, rtol=0, atol=1e-11)
    np.testing.assert_allclose(hop.foot(t)[t > hop.flight.duration], hop.ground, atol=0)
    touchdown = hop.at(hop.flight.duration)
    assert (touchdown.v2, touchdown.x2) == (hop.touchdown.v2, hop.touchdown.x2 + hop.ground)
    with pytest.raises(hopform.HopformError, match="t must be 0 <= t <="):
        hop.at(1.001 * hop.duration)


def test_a_stance_flies_on_to_the_next_touchdown():
    stance = hopform.solve_stance(HOPPER, v2=-1.93, u=3.0)
    flight, apart = stance.fly(0.03, gains=(9e3, 8e2)), stance.takeoff._asdict()
    same = hopform.solve_flight(HOPPER, **{**apart, "x2": None}, step=0.03, gains=(9e3, 8e2))
    near = hopform.solve_flight(HOPPER, **{**apart, "x2": apart["x2"] - 0.03}, gains=(9e3, 8e2))
    assert flight == same and abs(flight.duration - near.duration) < 1e-15
    assert flight.status == "touchdown"
    assert stance.fly().duration > flight.duration
    assert float(stance.fly().at(stance.fly().duration).x2 - stance.fly().touchdown.x1) == pytest.approx(HOPPER.L0)
    with pytest.raises(hopform.HopformError, match="needs a take-off, but the stance ended by 'rest'"):
        hopform.solve_stance(HOPPER, v2=-0.3, u=1.0).fly()


def test_a_stances_current_follows_its_steps():
    stance = hopform.solve_stance(HOPPER, v2=-1.93, u=[(0.0, 1.0), (0.05, -2.0)])
    assert stance.current([0.0, 0.049, 0.05, 0.1]).tolist() == [1.0, 1.0, -2.0, -2.0]


@each
def test_a_result_is_drawn_alone_and_into_axes(name):
    from matplotlib import pyplot

    pyplot.close("all")
    if name == "ManySensitivities":
        with pytest.raises(hopform.HopformError, match="there is no plot of ManySensitivities"):
            SHOWN[name].plot()
        return
    axes = SHOWN[name].plot()
    assert pyplot.get_fignums() == [axes.figure.number] and axes.get_ylabel() + axes.get_xlabel() != ""
    own = pyplot.figure().subplots()
    assert SHOWN[name].plot(own) is own and (own.lines or own.images or own.collections)
    pyplot.close("all")


def test_the_picture_of_the_command_line_is_that_of_plot():
    """The same curves, whoever makes the figure."""
    stance = SHOWN["Stance"]
    ours, theirs = results.figure_of(stance).axes, stance.plot().figure.axes
    assert len(ours) == len(theirs) == 5
    for one, other in zip(ours, theirs, strict=True):
        for a, b in zip(one.lines, other.lines, strict=True):
            np.testing.assert_array_equal(a.get_xydata(), b.get_xydata())


@each
def test_a_result_can_be_copied_and_pickled(name):
    result = SHOWN[name]
    assert repr(pickle.loads(pickle.dumps(result))) == repr(copy.deepcopy(result)) == repr(result)


def test_a_command_has_its_curve():
    command = SHOWN["Command"]
    u, apex = command.curve()
    assert np.interp(command.u, u, apex) == pytest.approx(0.2, abs=1e-4)
    level = hopform.choose_current(HOPPER, v2=-1.93, h_des=0.18, datum=0.02)
    np.testing.assert_allclose(level.curve()[1], apex - 0.02, rtol=0, atol=1e-15)
    margin = hopform.choose_current(HOPPER, v2=-1.93, h_des=0.2, stop_margin=0.06)
    assert np.isnan(margin.curve()[1]).any() and not np.isnan(apex).any()


@pytest.mark.parametrize(
    ("alias", "table"),
    [("Ending", "ENDINGS"), ("CommandStatus", "COMMANDS"), ("EventKind", "EVENTS"), ("FlightEnding", "FLIGHT_ENDINGS")],
)
def test_the_type_of_a_word_has_the_words_of_its_table(alias, table):
    assert get_args(getattr(package.records, alias)) == tuple(getattr(package, table).values())


def test_an_animation_shows_foot_time_and_current_and_is_saved(tmp_path):
    run = SHOWN["Run"]
    shown = hopform.hopping.animate(run, h_des=0.2, seconds=0.5, rate=4, speed=1.0)
    assert repr(shown) == "Animation of hopper_c: 2 pictures, 4 a second"
    assert shown._repr_html_().startswith("<img alt='Animation of hopper_c")
    shown.save(tmp_path / "a.gif")
    assert (tmp_path / "a.gif").read_bytes() == shown.gif and shown.gif[:6] == b"GIF89a"
    with pytest.raises(hopform.HopformError, match=r"path must end in \.gif, which an animation is, got '.*run\.mp4'"):
        shown.save(tmp_path / "run.mp4")
    for wrong in ({"rate": 0}, {"speed": -1.0}, {"seconds": 0.0}, {"h_des": "x"}, {"rate": 100, "speed": 1e-5}):
        with pytest.raises(hopform.HopformError, match=next(iter(wrong))):
            hopform.hopping.animate(run, **wrong)
    with pytest.raises(hopform.HopformError, match="run must be a Run"):
        hopform.hopping.animate(SHOWN["Hop"])


@pytest.mark.parametrize("module", ["xarray", "matplotlib"])
def test_without_an_extra_the_message_names_it(monkeypatch, module):
    for name in [name for name in sys.modules if name.partition(".")[0] == module or "hopform._figures" in name]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, module, None)
    extra = {"xarray": "xarray", "matplotlib": "plot"}[module]
    with pytest.raises(hopform.MissingExtra, match=rf"pip install .*\[{extra}\]"):
        _ = SHOWN["Stance"].to_xarray() if module == "xarray" else SHOWN["Stance"].plot()
