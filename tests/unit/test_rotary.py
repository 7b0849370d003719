"""Recordings in rad, deg, turns and counts, driven by A, V, N or N m.

Recordings of a servo are made by the independent time stepping of tests/oracle/recordings.c.
"""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

import hopform
from hopform.identify._drop import fit_drop_test
from hopform.identify._fits import Fit
from hopform.identify._force import fit_force
from hopform.identify._joint import fit_robot
from hopform.identify._recordings import Units, parse_recording
from tests.fits import ALONE
from tests.oracle.recordings import Rig, simulate

RATE, COUNT = 400.0, 1000
SERVO = Rig(mass=1.5e-4, k=0.0, b=1e-3, f=0.004 / 1.5e-4, gamma=0.05)
PENDULUM = Rig(mass=5.5e-3, k=0.4807, b=4e-3, f=0.02 / 5.5e-3, start=0.3)
SPRUNG = replace(SERVO, k=0.02, rest=0.1, start=0.1)
TIME = np.arange(COUNT) / RATE
DRIVE = np.where(TIME < 0.1, 0.0, np.where(np.arange(COUNT) // 120 % 2 == 0, 0.6, -0.5))


@cache
def angles(rig: Rig, noise: float = 3e-4) -> np.ndarray:
    driven = simulate(rig, DRIVE if rig.gamma else np.zeros(COUNT), RATE)
    return driven + np.random.default_rng(3).normal(0.0, noise, COUNT)


def recorded(head: str, *columns: np.ndarray) -> Any:
    lines = [head, *(",".join(map(repr, row)) for row in np.stack([TIME, *columns], axis=1).tolist())]
    return parse_recording("\n".join(lines), "servo.csv")


def holds(fit: Fit, **truth: float) -> list[str]:
    """What of the truth is not within 1.5 times the 95 % interval: three standard errors."""
    apart = {name: abs(fit[name].value - value) for name, value in truth.items()}
    return [name for name, each in apart.items() if each > 1.5 * (fit[name].high - fit[name].low) / 2.0]


@cache
def air() -> Fit:
    return fit_robot(
        air=recorded("time_s,position_deg,voltage_V", np.degrees(angles(SERVO)), DRIVE), 
        known={"gamma2": -0.05}, **ALONE,
    )  # fmt: skip


@cache
def decay() -> Fit:
    counts = np.round(angles(PENDULUM, noise=1e-3) * 4096.0 / (2.0 * math.pi))
    return fit_robot(
        decays=recorded("time_s,position_counts_4096perrev", counts), known={"k": 0.4807}, **ALONE,
    )  # fmt: skip


def test_a_servo_in_degrees_and_volts_has_its_inertia_friction_and_torque():
    fit = air()
    assert not holds(fit, m_eff=SERVO.mass, b1=SERVO.b, f1=SERVO.f, offset=0.0)
    units = {each.name: each.unit for each in fit.estimates}
    assert units == {"m_eff": "kg m^2", "b1": "N m s/rad", "f1": "rad/s^2", "offset": "V", "x@0": "rad", "delay@0": "s"}
    assert (fit["m_eff"].high - fit["m_eff"].low) < 0.01 * SERVO.mass
    assert fit.rms == pytest.approx(3e-4, rel=0.1)


def test_a_pendulum_in_counts_has_its_inertia_by_its_known_stiffness():
    fit = decay()
    assert not holds(fit, m_s=PENDULUM.mass, b2=PENDULUM.b, f2=PENDULUM.f)
    assert [fit["m_s"].unit, fit["b2"].unit, fit["f2"].unit, fit["rest@0"].unit] == [
        "kg m^2", "N m s/rad", "rad/s^2", "rad",
    ]  # fmt: skip


def test_a_servo_that_rests_within_one_count_is_measured_there_once():
    """Its encoder is off by the same in every sample of the rest: 10 servos with noise of a tenth of a count."""
    count, held, total = 2.0 * math.pi / 4096.0, 0, 0
    for seed in range(10):
        rng = np.random.default_rng([9, seed])
        truth = {"m_s": rng.uniform(0.004, 0.01), "b2": rng.uniform(5e-4, 4e-3), "f2": rng.uniform(0.2, 2.5)}
        rig = Rig(truth["m_s"], 0.4807, truth["b2"], truth["f2"], rest=rng.uniform(-0.01, 0.01), start=0.3)
        x = simulate(rig, np.zeros(COUNT), RATE) + 0.1 * count * rng.standard_normal(COUNT)
        made = recorded("time_s,position_rad", count * np.round(x / count))
        fit = fit_robot(decays=made, known={"k": 0.4807}, **ALONE)
        assert not holds(fit, **truth), seed
        held += sum(fit[name].low <= value <= fit[name].high for name, value in truth.items())
        total += len(truth)
        assert any("rest within one count" in each for each in fit.statements)
    assert held >= 0.9 * total


def test_a_torque_is_a_known_drive():
    fit = fit_robot(
        steps=recorded("time_s,position_rad,torque_mNm", angles(SPRUNG), 50.0 * DRIVE), **ALONE,
    )  # fmt: skip
    assert fit.known["gamma2"] == -1.0
    assert not holds(fit, m_eff=SPRUNG.mass, k=SPRUNG.k, b1=SPRUNG.b, f1=SPRUNG.f)
    assert fit["k"].unit == "N m/rad"
    assert fit.units == Units("rad", "N m")


def test_a_fit_in_force_is_one_in_torque():
    drive = 0.3 * np.sin(9.0 * TIME) + 0.2 * np.sin(31.0 * TIME)  # of one frequency a delay is viscous friction
    x = simulate(SERVO, drive, RATE)
    log, fitted = recorded("time_s,position_rad,torque_Nm", x, 0.05 * drive), ["J", "b", "F_p", "load"]
    fit = fit_force("joint", log, fitted=fitted, known={"F_m": "F_p"})
    assert {each.name: each.unit for each in fit.estimates} == {
        "J": "kg m^2", "b": "N m s/rad", "F_p": "N m", "load": "N m", "delay": "s",
    }  # fmt: skip
    assert fit["b"].value == pytest.approx(SERVO.b, rel=0.1)
    assert fit["F_p"].value == pytest.approx(0.004, rel=0.1)


@pytest.mark.parametrize(
    ("unit", "factor"),
    [("deg", 180.0 / math.pi), ("rev", 0.5 / math.pi), ("mrad", 1e3), ("2048perrev", 1024.0 / math.pi)],
)
def test_an_angle_is_the_same_in_every_unit(unit, factor):
    x = recorded("time_s,x_rad", angles(PENDULUM)).position("x1")
    assert recorded(f"time_s,x_{unit}", factor * angles(PENDULUM)).position("x1") == pytest.approx(x, rel=1e-14)


def test_counts_of_a_linear_encoder_are_a_length():
    made = recorded("time_s,x_counts_56000perm", np.round(5600.0 * angles(PENDULUM)))
    assert made.units("x2") == Units("m", "A")
    assert made.position("x2") == pytest.approx(0.1 * angles(PENDULUM), abs=0.5 / 56000.0)


def test_units_that_no_fit_takes_are_refused_by_file_and_column(tmp_path, capsys):
    counts = "has no known unit.*counts of an encoder as position_4096perrev"
    with pytest.raises(hopform.HopformError, match=f"servo.csv, line 1, column 2: 'x_counts' {counts}"):
        fit_robot(decays=recorded("time_s,x_counts", angles(PENDULUM)))
    with pytest.raises(hopform.HopformError, match="has no known unit"):
        fit_robot(decays=recorded("time_s,x_0perrev", angles(PENDULUM)))
    angle, length = recorded("time_s,x_rad", angles(PENDULUM)), recorded("time_s,x_m", angles(PENDULUM))
    with pytest.raises(hopform.HopformError, match="'x_rad': is an angle; a drop is of a height in m"):
        fit_drop_test(angle)
    with pytest.raises(hopform.HopformError, match="is in m, servo.csv in rad: one fit takes one"):
        fit_robot(decays=[angle, length])
    with pytest.raises(hopform.HopformError, match="m_s must be > 0 kg m.2, got -1.0"):
        fit_robot(decays=angle, known={"m_s": -1.0})
    with pytest.raises(hopform.HopformError, match="a fit in rad is not a hopper"):
        decay().robot(hopform.load_robot("hopper_c"))
