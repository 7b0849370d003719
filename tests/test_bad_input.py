"""Bad input costs one clear message that names the field, the value and what is allowed."""

import math
import re

import numpy as np
import pytest

import hopform
from hopform.robots import robot_from_toml

GOOD = {"m_eff": 25.0, "m_s": 3.0, "k": 1200.0, "L0": 0.4}
NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"m_s": -1.2}, "m_s must be > 0 kg, got -1.2"),
        ({"m_eff": 0.0}, "m_eff must be > 0 kg, got 0.0"),
        ({"k": NAN}, "k must be > 0 N/m, got nan"),
        ({"L0": INF}, "L0 must be finite m, got inf"),
        ({"b1": -1e-9}, "b1 must be >= 0 and finite N s/m, got -1e-09"),
        ({"impact_loss": 1.0}, "impact_loss must be >= 0 and < 1, got 1.0"),
        ({"u_max": NAN}, "u_max must be >= 0 A, got nan"),
        ({"k": "12 N/cm"}, "k must be a number in N/m, got '12 N/cm'"),
        ({"g": True}, "g must be a number in m/s^2, got True"),
        ({"x1_min": 0.1, "x1_max": 0.0}, "x1_min must be <= x1_max m, got 0.1 > 0.0"),
        ({"x1_max": NAN}, "x1_max must be a number or inf m, got nan"),
    ],
)
def test_a_robot_refuses_what_is_out_of_its_domain(changes, message):
    with pytest.raises(hopform.HopformError, match=f"^{re.escape(message)}$"):
        hopform.Robot(**{**GOOD, **changes})


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"v2": NAN}, "v2 must be finite m/s, got nan"),
        ({"v2": "fast"}, "v2 must be a number in m/s, got 'fast'"),
        ({"v2": -1.0, "x1": 0.09}, "x1 must be within its stroke 0.0 .. 0.08 m, got 0.09"),
        ({"v2": -1.0, "x2": 0.5}, "x2 must be <= x1 + L0 + c = 0.4 m, or the spring pulls, got 0.5"),
        ({"v2": -1.0, "u": INF}, "u must be finite A, got inf"),
        ({"v2": -1.0, "u": []}, "u must be a current in A or at least one step"),
        ({"v2": -1.0, "u": [(0.1, 1.0)]}, "u must start at t = 0 s, got 0.1"),
        ({"v2": -1.0, "u": [(0.0, 1.0), (0.0, 2.0)]}, "the times of u must increase, got 0.0 s after 0.0 s"),
        ({"v2": -1.0, "u": [(0.0, NAN)]}, "u[0] current must be finite A, got nan"),
        ({"v2": -1.0, "u": [1.0]}, "u[0] must be a pair (t, u), got 1.0"),
        ({"v2": -1.0, "horizon": 0.0}, "horizon must be > 0 s, got 0.0"),
        ({"v2": -1.0, "max_phases": 0}, "max_phases must be a whole number >= 1, got 0"),
        ({"v2": -1.0, "backend": "fortran"}, "backend must be 'c' or 'numpy', got 'fortran'"),
        ({"v2": -1.0, "dtype": "int32"}, "dtype must be float64 or float32, got 'int32'"),
    ],
)
def test_a_stance_refuses_what_it_cannot_solve(hopper_c, arguments, message):
    with pytest.raises(hopform.HopformError) as caught:
        hopform.solve_stance(hopper_c, **arguments)
    assert message in str(caught.value)


@pytest.mark.parametrize("t", [-1e-9, NAN, 1.0, np.array([0.0, 0.2])])
def test_a_time_outside_the_stance_is_refused(hopper_c, backend, t):
    stance = hopform.solve_stance(hopper_c, v2=-1.9, backend=backend)
    for method in (stance.at, stance.energy, stance.ledger, stance.compression):
        with pytest.raises(hopform.HopformError, match="t must be 0 <= t <= "):
            method(t)


def test_any_time_after_rest_is_allowed(hopper_c, backend):
    stance = hopform.solve_stance(hopper_c, v2=-0.01, backend=backend)
    assert stance.status == "rest"
    assert stance.at(1e6) == stance.at(stance.duration)


def test_a_current_above_the_limit_is_a_warning_and_no_error(hopper_c, backend):
    stance = hopform.solve_stance(hopper_c, v2=-1.9, u=4.0, backend=backend)
    assert stance.warnings == ("u = 4.0 A is above u_max = 3.0 A",)


def test_without_take_off_there_is_no_apex(hopper_c, backend):
    stance = hopform.solve_stance(hopper_c, v2=-0.01, backend=backend)
    assert stance.takeoff is None
    assert math.isnan(stance.apex)


def test_without_gravity_there_is_no_apex_and_a_warning_says_so(backend):
    robot = hopform.Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, g=0.0)
    stance = hopform.solve_stance(robot, v2=-1.0, backend=backend)
    assert stance.status == "takeoff"
    assert math.isnan(stance.apex)
    assert stance.warnings == ("g = 0: there is no apex",)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("m_s = -1.2", "m_s must be > 0 kg, got -1.2 (mine.toml, line 2)"),
        ('k = "12 N/cm"', "k must be a number in N/m, got '12 N/cm' (mine.toml, line 3)"),
        ("m_eef = 25.0", "unknown parameter 'm_eef', did you mean 'm_eff'? (mine.toml, line 1)"),
        ("L0 = nan", "L0 must be finite m, got nan (mine.toml, line 4)"),
        ("L0 = ", "mine.toml is not valid TOML"),
        ("name = 3", "name must be a text, got 3"),
    ],
)
def test_a_robot_file_is_refused_with_its_line(change, message):
    lines = {"m_eff": "m_eff = 25.0", "m_s": "m_s = 3.0", "k": "k = 1200.0", "L0": "L0 = 0.4"}
    lines[{"m_eef": "m_eff"}.get(change.split()[0], change.split()[0])] = change
    with pytest.raises(hopform.HopformError) as caught:
        robot_from_toml("\n".join(lines.values()), "mine.toml")
    assert message in str(caught.value)


def test_a_robot_file_that_lacks_a_parameter_is_refused():
    with pytest.raises(hopform.HopformError, match="mine.toml lacks k, L0"):
        robot_from_toml("m_eff = 1.0\nm_s = 2.0", "mine.toml")


def test_a_robot_survives_its_toml():
    for name in hopform.ROBOTS:
        robot = hopform.load_robot(name)
        assert robot_from_toml(robot.to_toml()) == robot
    free = hopform.Robot(**GOOD)
    assert robot_from_toml(free.to_toml()) == free


def test_numbers_that_leave_the_range_of_float32_are_refused(backend):
    robot = hopform.Robot(m_eff=1e-30, m_s=1e-30, k=1e30, L0=0.4)
    with pytest.raises(hopform.HopformError, match="range of the precision"):
        hopform.solve_stance(robot, v2=-1.0, dtype=np.float32, backend=backend)
