"""The curves of the page to play with are those of Python, by the names that the page gives them: play.c, compiled for
this computer. test_page.py opens the page itself in a browser.
"""

import ctypes
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import hopform
import hopform.hopping
from hopform._export import Wanted, amalgamated, sources
from hopform.hopping.controllers import FeedForward
from tests.conformance.test_selftest import CC

PAGE = Path(__file__).resolve().parents[2] / "docs" / "play"
HOPPER = hopform.load_robot("hopper_c")
TERRAIN = [0.0, 0.02, -0.01]
COUNT = 1001

CURVES = {
    "heights": {
        "body x2": lambda run, t: run.at(t).x2,
        "foot": lambda run, t: run.foot(t),
        "ground": lambda run, t: run.ground(t),
    },
    "actuator": {
        "x1 [mm]": lambda run, t: 1000.0 * run.at(t).x1,
        "current [A]": lambda run, t: run.current(t),
    },
    "forces": {
        "spring": lambda run, t: HOPPER.k * (run.foot(t) + HOPPER.L0 + HOPPER.c + run.at(t).x1 - run.at(t).x2),
        "motor, on the actuator": lambda run, t: 65.0 * run.current(t),
    },
    "energy": {
        "kinetic + gravitational": lambda run, t: HOPPER.m_s * (run.at(t).v2 ** 2 / 2.0 + HOPPER.g * run.at(t).x2),
        "body and spring (23)": lambda run, t: run.energy(t).body,
        "predicted by the AED": lambda run, t: run.aed(t),
    },
}
"""What the curves of each plot must be, by their names."""


@pytest.fixture(scope="module")
def samples(tmp_path_factory):
    """The samples of a run over rough ground: a row per time, as play.c orders them."""
    folder = tmp_path_factory.mktemp("play")
    for name, text in amalgamated(sources(Wanted()), "hopform").items():
        (folder / Path(name).name).write_text(text, "utf-8")
    shared = folder / "play.so"
    files = [str(PAGE / "play.c"), str(folder / "hopform.c"), "-I", str(folder), "-o", str(shared), "-lm"]
    done = subprocess.run(
        [*CC, "-std=c99", "-O0", "-ffp-contract=off", "-fPIC", "-shared", *files], capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    page = ctypes.CDLL(str(shared))

    def array(name, length):
        return np.ctypeslib.as_array((ctypes.c_double * length).in_dll(page, f"play_{name}"))

    array("robot", 17)[:] = [getattr(HOPPER, field.name) for field in hopform.Robot.fields()]
    array("terrain", 3)[:] = TERRAIN
    page.play_run.argtypes = [ctypes.c_double, ctypes.c_int32, ctypes.c_double, ctypes.c_int32, ctypes.c_double]
    assert page.play_run(0.2, 1, 0.2, len(TERRAIN), 0.0) == 0
    page.play_sample.argtypes = [ctypes.c_double, ctypes.c_double, ctypes.c_int32]
    page.play_sample(0.0, array("duration", 1)[0], COUNT)
    columns = names_of_columns()
    return dict(zip(columns, array("samples", COUNT * len(columns)).reshape(COUNT, -1).T, strict=True))


def program():
    return (PAGE / "play.js").read_text("utf-8")


def names_of_columns():
    """The columns of a sample, as the page reads them."""
    found = re.search(r"const SAMPLE = \[(.*?)\];", program(), re.DOTALL)
    assert found is not None
    columns = re.findall(r'"(\w+)"', found[1])
    assert f"COLUMNS = {len(columns)} " in (PAGE / "play.c").read_text("utf-8")
    return columns


def drawn():
    """The curves of each plot of the page: by name, the column and its factor."""
    for plot, text in re.findall(r'plot\(id\("(\w+)"\), \{ \.\.\.shared, curves: \[(.*?)\] \}\)', program(), re.DOTALL):
        curves = re.findall(r'curve\("([^"]*)", "(\w+)", "\w+"(?:, \{(.*?)\})?\)', text)
        assert len(curves) == text.count("curve(")
        scales = [re.search(r"scale: (\d+)", more) for _, _, more in curves]
        yield plot, {name: (key, float(s[1]) if s else 1.0) for (name, key, _), s in zip(curves, scales, strict=True)}


@pytest.mark.sliced
def test_a_curve_of_the_page_is_what_its_name_says(samples):
    run = hopform.hopping.simulate(HOPPER, TERRAIN, FeedForward(0.2), height=0.2)
    t = samples["t"]
    assert t[0] == 0.0 and t[-1] == pytest.approx(run.duration, rel=1e-15)
    plots = dict(drawn())
    assert plots.keys() == CURVES.keys()
    for plot, curves in plots.items():
        assert curves.keys() == CURVES[plot].keys()
        for name, (key, scale) in curves.items():
            expected = CURVES[plot][name](run, np.minimum(t, run.duration))
            np.testing.assert_allclose(scale * samples[key], expected, rtol=1e-12, atol=1e-11, err_msg=name)


@pytest.mark.sliced
def test_the_energy_of_the_body_on_the_page_has_no_jump_at_take_off(samples):
    """Between two samples, 1.7 ms apart, it moves by less than 0.1 J; that with the spring as in (23) falls."""
    run = hopform.hopping.simulate(HOPPER, TERRAIN, FeedForward(0.2), height=0.2)
    t = samples["t"]
    for hop in run.hops:
        behind = int(np.searchsorted(t, hop.takeoff_time, side="right"))
        falls = {name: samples[name][behind - 1] - samples[name][behind] for name in ("body", "energy")}
        assert abs(falls["body"]) < 0.1 and falls["energy"] > 0.4
