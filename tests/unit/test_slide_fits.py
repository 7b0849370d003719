"""Recordings of carts, axes and actuators, fitted as the slide that ships: decays under weighed masses, drives in volts
and newtons, encoders that count from where they were switched on.

Recordings are made by time stepping that shares nothing with hopform.
"""

import copy
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hopform
from hopform import _front as cli
from hopform.identify import _motion as motion
from hopform.identify import fit
from hopform.identify._recordings import parse_recording
from tests.fits import ALONE
from tests.oracle.recordings import Rig, simulate

RATE, COUNT, NOISE = 400.0, 1000, 5e-5
CART = Rig(mass=0.6, k=700.0, b=1.2, f=0.4, start=0.03)
AXIS = Rig(mass=2.0, k=0.0, b=8.0, f=0.6, gamma=5.0)
DRIVE = np.where(np.arange(COUNT) < 40, 0.0, np.where(np.arange(COUNT) // 120 % 2 == 0, 2.0, -1.6))


@pytest.fixture(scope="module")
def slide() -> Any:
    return hopform.load_solver("slide")


def table(head: str, *columns: np.ndarray, name: str = "log.csv") -> Any:
    rows = np.stack([np.arange(columns[0].size) / RATE, *columns], axis=1).tolist()
    return parse_recording("\n".join([head, *(",".join(map(repr, row)) for row in rows)]), name)


def decay(rig: Rig, zero: float = 0.0, seed: int = 1) -> Any:
    x = zero + simulate(rig, np.zeros(COUNT), RATE) + NOISE * np.random.default_rng(seed).standard_normal(COUNT)
    return table("time_s,x_m", x)


def holds(of: Any, **truth: float) -> list[str]:
    """What of the truth is not within 1.5 times the 95 % interval: three standard errors."""
    off = {name: abs(0.5 * (of[name].low + of[name].high) - value) for name, value in truth.items()}
    return [name for name, each in off.items() if not each <= 0.75 * (of[name].high - of[name].low)]


def weighed() -> list[Any]:
    """The cart, then with 1 kg added, which has more friction, its encoder switched on 7 mm away."""
    heavy = replace(CART, mass=1.6, b=1.9, f=0.5)
    return [decay(CART), replace(decay(heavy, 0.007, 2), added_mass=1.0)]


def test_a_weighed_mass_between_two_decays_gives_the_mass(slide):
    """Friction is that of each load, and the place where the spring is slack that of each encoder."""
    of = fit(slide, weighed(), fitted=["m", "k", "b", "F", "x_0"], **ALONE)
    friction = {"b@0": 1.2, "b@1": 1.9, "F@0": 0.24, "F@1": 0.8}
    assert holds(of, m=0.6, k=700.0, **friction, **{"x_0@0": 0.0, "x_0@1": 0.007}) == []
    assert of["m"].high / of["m"].low < 1.03 and not of.warnings
    robot = of.robot()
    assert robot.m == of["m"].value and robot.b == pytest.approx(0.5 * (of["b@0"].value + of["b@1"].value))
    assert robot.fit.names == ("m", "k", "x_0", "b", "F")


def test_a_fit_of_a_model_can_be_copied_and_pickled(slide):
    of = fit(slide, decay(CART), fitted=["k", "b", "F", "x_0"], known={"m": 0.6}, **ALONE)
    assert repr(pickle.loads(pickle.dumps(of))) == repr(copy.deepcopy(of)) == repr(of)


def test_recordings_of_one_load_share_friction_and_not_the_zero_of_an_encoder(slide):
    both = [decay(CART, 0.0, 1), decay(CART, 0.012, 2)]
    of = fit(slide, both, fitted=["k", "b", "F", "x_0"], known={"m": 0.6}, **ALONE)
    assert holds(of, k=700.0, b=1.2, F=0.24) == []
    assert of["x_0@1"].value - of["x_0@0"].value == pytest.approx(0.012, abs=2e-4)
    assert of["x_0@0"].own and not of.warnings


def test_a_model_of_two_masses_takes_no_added_mass():
    x = np.cos(np.arange(COUNT) / 20.0)
    made = replace(table("time_s,x1_m,x2_m", x, x + 1.0), added_mass=0.1)
    with pytest.raises(
        hopform.HopformError, match="need a parameter that is the inertia of all that moves; hopper has"
    ):
        fit("hopper", made, fitted=["m_eff", "m_s", "L0", "k"])


def test_motion_alone_gives_all_per_kilogram_and_says_how(slide):
    open_scale = fit(slide, decay(CART), fitted=["m", "k", "b", "F", "x_0"], **ALONE)
    assert (
        "m, k, b, F" in open_scale.statements[1]
        and "give m=1 as known; the others are then per kg of m" in open_scale.statements[-1]
    )
    per_kilogram = fit(slide, decay(CART), fitted=["k", "b", "F", "x_0"], known={"m": 1.0}, **ALONE)
    assert holds(per_kilogram, k=700.0 / 0.6, b=2.0, F=0.4) == []
    assert not any("common factor" in each for each in per_kilogram.statements)


@pytest.mark.parametrize(
    ("column", "factor", "unit", "force"), [("i_A", 1.0, "N/A", 5.0), ("drive_voltage_V", 1.0, "N/V", 5.0),
                                            ("force_N", 5.0, "", 1.0)],
)  # fmt: skip
def test_an_axis_may_be_driven_by_a_current_a_voltage_or_its_force(slide, column, factor, unit, force):
    """A recorded force is the force, so nothing else need be known."""
    x = simulate(AXIS, DRIVE, RATE) + NOISE * np.random.default_rng(3).standard_normal(COUNT)
    made = table(f"time_s,x_m,{column}", x, factor * DRIVE)
    known = {} if unit == "" else {"m": 2.0}
    fitted = ["b", "F", "load", *(["m"] if unit == "" else ["k_f"])]
    of = fit(slide, made, fitted=fitted, known=known, **ALONE)
    assert holds(of, b=8.0, F=1.2, load=0.0, **({"m": 2.0} if unit == "" else {"k_f": force})) == []
    assert of.known.get("k_f", force) == force and (unit == "" or of["k_f"].unit == unit)
    assert any("drives, in" in each for each in of.warnings) == (unit != "N/A")


def test_drives_in_two_units_and_a_wrong_unit_of_time_are_refused(slide):
    x = simulate(AXIS, DRIVE, RATE)
    both = [table("time_s,x_m,i_A", x, DRIVE), table("time_s,x_m,u_V", x, DRIVE, name="other.csv")]
    with pytest.raises(hopform.HopformError, match="is in A, another in V: one fit takes one of them"):
        fit(slide, both, known={"m": 2.0})
    fast = decay(CART)
    with pytest.raises(hopform.HopformError, match="0.001 to 50 s are allowed: is the unit of time right"):
        fit(slide, replace(fast, time=fast.time * 5e-3), known={"m": 1.0})


def test_added_masses_are_an_option(tmp_path, capsys):
    light, heavy = weighed()
    files = []
    for n, made in enumerate((light, heavy)):
        files.append(str(tmp_path / f"{n}.csv"))
        rows = zip(made.time.tolist(), made.position("x1").tolist(), strict=True)
        (tmp_path / f"{n}.csv").write_text("\n".join(["time_s,x_m", *(f"{t!r},{x!r}" for t, x in rows)]), "utf-8")
    ask = ["--solver", "slide", "fit", *files, "--fitted", "m,k,b,F,x_0", "--known", "k_f=1"]
    assert cli.main([*ask, "--added-mass", "0,1"]) == 0
    assert "\nF@1 " in capsys.readouterr().out
    assert cli.main([*ask, "--added-mass", "1"]) == 2
    assert "--added-mass names 1 masses for 2 files" in capsys.readouterr().err


# ---- what is not the recording's fault is not said of it ----


def test_a_users_own_model_of_that_name_is_not_taken_for_the_slide(monkeypatch):
    monkeypatch.setattr(motion, "load_solver", lambda _: hopform.load_solver("hopper"))
    motion.slide.cache_clear()
    with pytest.raises(hopform.HopformError, match="a model of yours is named slide.*rename yours"):
        motion.slide()
    motion.slide.cache_clear()


def test_a_missing_library_is_no_start_that_finds_no_motion(slide, monkeypatch):
    def missing(*_: Any) -> Any:
        raise hopform.BackendError("there is no compiled library")

    monkeypatch.setattr("hopform.identify._models.Modelled.moved", missing)
    with pytest.raises(hopform.BackendError, match="^there is no compiled library$"):
        fit(slide, decay(CART), fitted=["k", "b", "F", "x_0"], known={"m": 0.6}, **ALONE)
