"""Bad input costs one clear message that names the field, the value and what is allowed."""

import dataclasses
import inspect
import math
import re
import tempfile
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import hopform
import hopform.hopping
import hopform.identify
from hopform._robots import robot_from_toml
from hopform.identify._recordings import parse_recording
from hopform.identify._synthetic import to_csv
from tests.calls import CALLS, DECAY, GOOD, HOPPER, METHODS, OBJECTS, OF_RECORDINGS, START, every
from tests.outside import hostile

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
        ({"v2": -1.0, "x2": 0.5}, "x2 must be <= x1 + L0 + c = 0.4 m (a contact cannot pull), got 0.5"),
        ({"v2": -1.0, "compression": -0.1}, "compression must be >= 0 m (a contact cannot pull), got -0.1"),
        ({"v2": -1.0, "compression": NAN}, "compression must be finite m, got nan"),
        (
            {"v2": -1.0, "x2": 0.3, "compression": 0.1},
            "give either x2 or compression, got x2 = 0.3 and compression = 0.1",
        ),
        ({"v2": -1.0, "u": INF}, "u must be finite A, got inf"),
        ({"v2": -1.0, "u": []}, "u must be a number in A or steps (t, u), at least one, got no step"),
        ({"v2": -1.0, "u": [(0.1, 1.0)]}, "u must start at t = 0 s, got 0.1"),
        ({"v2": -1.0, "u": [(0.0, 1.0), (0.0, 2.0)]}, "the times of u must increase, got 0.0 s after 0.0 s"),
        ({"v2": -1.0, "u": [(0.0, NAN)]}, "u[0] input must be finite A, got nan"),
        ({"v2": -1.0, "u": [1.0]}, "u[0] must be a pair (t, u), got 1.0"),
        ({"v2": -1.0, "horizon": 0.0}, "horizon must be > 0 s, got 0.0"),
        ({"v2": -1.0, "max_phases": 0}, "max_phases must be a whole number >= 1, got 0"),
        ({"v2": -1.0, "dtype": "int32"}, "dtype must be float64 or float32, got 'int32'"),
    ],
)
def test_a_stance_refuses_what_it_cannot_solve(hopper_c, arguments, message):
    with pytest.raises(hopform.HopformError) as caught:
        hopform.solve_stance(hopper_c, **arguments)
    assert message in str(caught.value)


@pytest.mark.parametrize("t", [-1e-9, NAN, 1.0, np.array([0.0, 0.2])])
def test_a_time_outside_the_stance_is_refused(hopper_c, t):
    stance = hopform.solve_stance(hopper_c, v2=-1.9)
    for method in (stance.at, stance.energy, stance.ledger, stance.compression):
        with pytest.raises(hopform.HopformError, match="t must be 0 <= t <= "):
            method(t)


def test_a_time_that_is_no_number_is_refused(hopper_c):
    stance = hopform.solve_stance(hopper_c, v2=-1.93)
    for t in (object(), "late", [0.1, "late"], [0.1, object()]):
        with pytest.raises(hopform.HopformError, match="t must be numbers in s, got"):
            stance.at(t)


def test_any_time_after_rest_is_allowed(hopper_c):
    stance = hopform.solve_stance(hopper_c, v2=-0.01)
    assert stance.status == "rest"
    assert stance.at(1e6) == stance.at(stance.duration)


def test_a_current_above_the_limit_is_a_warning_and_no_error(hopper_c):
    stance = hopform.solve_stance(hopper_c, v2=-1.9, u=4.0)
    assert stance.warnings == ("u = 4.0 A is above u_max = 3.0 A",)


def test_without_take_off_there_is_no_apex(hopper_c):
    stance = hopform.solve_stance(hopper_c, v2=-0.01)
    assert stance.takeoff is None
    assert math.isnan(stance.apex)


def test_without_gravity_there_is_no_apex_and_a_warning_says_so():
    robot = hopform.Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, g=0.0)
    stance = hopform.solve_stance(robot, v2=-1.0)
    assert stance.status == "takeoff"
    assert math.isnan(stance.apex)
    assert stance.warnings == ("g = 0: there is no apex",)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("m_s = -1.2", "m_s must be > 0 kg, got -1.2 (mine.toml, line 2)"),
        ('k = "12 N/cm"', "k must be a number in N/m, got '12 N/cm' (mine.toml, line 3)"),
        ("m_eef = 25.0", "unknown parameter 'm_eef', did you mean 'm_eff'? Known: m_eff, m_s, k, L0, c,"),
        ("m_eef = 25.0", "travel (mine.toml, line 1)"),
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


@pytest.mark.sliced
@given(
    name=st.text(st.characters(exclude_categories=["Cs"])),
    description=st.text(st.characters(exclude_categories=["Cs"])),
    fields=st.fixed_dictionaries(dict.fromkeys(GOOD, st.floats(0.0, exclude_min=True, allow_infinity=False))),
)
@settings(derandomize=True, deadline=None)
@example(name='the "big" one', description="C:\\robots\nline two\r\n\x00\x1b\x7f\x85\u2028", fields=GOOD)
def test_a_robot_of_any_name_survives_its_toml_and_its_file(name, description, fields):
    robot = hopform.Robot(name=name, description=description, **fields)
    assert robot_from_toml(robot.to_toml()) == robot
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "robot.toml"
        path.write_bytes(robot.to_toml().encode())
        assert hopform.load_robot(path) == robot


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": 3}, "name must be a text, got 3"),
        ({"description": None}, "description must be a text, got None"),
        ({"name": "R\udcfcck"}, r"name must be text that UTF-8 can encode, got 'R\udcfcck'"),
    ],
)
def test_a_name_that_no_file_holds_is_refused(change, message):
    with pytest.raises(hopform.HopformError, match=f"^{re.escape(message)}$"):
        hopform.Robot(**{**GOOD, **change})


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("foo", "there is no robot 'foo'; known: hopper_c, hopper_b, ideal, or a TOML file"),
        (
            "hoper_c",
            "there is no robot 'hoper_c', did you mean 'hopper_c'? Known: hopper_c, hopper_b, ideal, or a TOML file",
        ),
        ("foo.toml", "there is no file 'foo.toml'"),
    ],
)
def test_a_robot_that_is_not_there_is_refused_in_a_sentence(name, message):
    with pytest.raises(hopform.HopformError, match=f"^{re.escape(message)}$"):
        hopform.load_robot(name)


def test_numbers_that_leave_the_range_of_float32_are_refused():
    robot = hopform.Robot(m_eff=1e-30, m_s=1e-30, k=1e30, L0=0.4)
    with pytest.raises(hopform.HopformError, match="range of the precision"):
        hopform.solve_stance(robot, v2=-1.0, dtype=np.float32)


# ---- numbers that no float holds ----

HUGE = {"positive": 10**400, "negative": -(10**400), "unprintable": 10**5000, "fraction": Fraction(10**400, 3)}
NONE = {
    "flag": np.bool_(True),
    "complex": np.complex128(1j),
    "masked": np.ma.masked,
    "hostile": hostile("__float__", "__repr__"),
}
"""What is no real number, beside these."""


def takes_numbers(parameter):
    """Whether an annotation allows a number; a seed may be a whole number of any size."""
    annotation = str(parameter.annotation)
    if parameter.name == "seed" or parameter.kind is parameter.VAR_KEYWORD:
        return False
    if annotation.startswith("collections.abc.Callable"):
        return "SupportsFloat" in annotation
    return any(word in annotation for word in ("Float", "float", "complex")) or parameter.annotation in (
        int,
        int | None,
    )


def numbers_of(call):
    return [each.name for each in inspect.signature(call).parameters.values() if takes_numbers(each)]


def every_number():
    """A call with all but one argument, and the name of that: of functions, of classes, of methods of their objects."""
    for name, (call, arguments) in every().items():
        if name in OF_RECORDINGS:
            continue
        for number in numbers_of(call):
            rest = {
                each: value for each, value in arguments.items() if each != number and not alternatives(each, number)
            }
            yield f"{name} {number}", partial(call, **rest), number


def alternatives(one, other):
    """A grid has a count or a distance of its times."""
    return {one, other} == {"count", "dt"}


EVERY = {name: (call, number) for name, call, number in every_number()}


def test_every_public_function_that_takes_numbers_is_tried():
    """Those of the catalogue, in which test_outside_functions.py misses none."""
    assert len(EVERY) > 120


def refused(number, call):
    """The message of what is refused by name and value, in a line that is no book."""
    with pytest.raises(hopform.HopformError) as caught:
        call()
    message = str(caught.value)
    assert re.search(rf"\b({number})\b", message) and len(message) < 250 and "\n" not in message
    return message


@pytest.mark.parametrize("name", EVERY)
def test_what_is_no_number_that_a_float_holds_is_refused_by_name(name):
    call, number = EVERY[name]
    said = "u|controller" if number == "controller" else number
    for what, value in (HUGE if name == "record start" else HUGE | NONE).items():
        message = refused(said, partial(call, **{number: value}))
        assert what != "hostile" or message.endswith("__repr__, which cannot be shown"), what


SEEDED = {
    name: partial(call, **arguments)
    for name, (call, arguments) in CALLS.items()
    if "seed" in inspect.signature(call).parameters
} | {"simulated_delays": partial(OBJECTS["detector"].simulated_delays, **METHODS["simulated_delays"])}


@pytest.mark.parametrize(
    ("name", "seed"),
    [
        (name, seed)
        for name in SEEDED
        for seed in (-1, 1.5, "1", True, None, [1, 2], np.random.default_rng(1))
        if (name, seed) != ("record", None)
    ],
)
def test_a_seed_that_is_no_whole_number_is_refused_by_name(name, seed):
    """None too, but of a recording: the same call would not give the same numbers."""
    arguments = {"name": "uniform"} if name == "generate" else {}
    assert refused("seed", partial(SEEDED[name], seed=seed, **arguments)).startswith("seed must be a whole number >= 0")


def test_every_function_with_a_seed_is_tried():
    assert set(SEEDED) == {"simulate", "record", "uniform", "gaussian", "generate", "simulated_delays"}


def by(law):
    """A controller that answers with a sampled law."""
    return lambda touchdown: hopform.hopping.controllers.Sampled(0.01, law)


def touchdown(**changes):
    first = hopform.hopping.controllers.Touchdown(0, 0.2, 0.0, 0.0, -1.9, 0.0, 0.2, HOPPER)
    return first._replace(**changes)


HOP = {"robot": HOPPER, "terrain": [0.0], "height": 0.2}
WITHIN: dict[str, tuple[str, Any]] = {
    "a step's current": ("u", lambda huge: hopform.solve_stance(**START, u=[(0.0, huge)])),
    "a step's time": ("u", lambda huge: hopform.solve_stance(**START, u=[(0.0, 1.0), (huge, 2.0)])),
    "one of many": ("v1", lambda huge: hopform.solve_stances(**START, v1=[[0.0, huge]])),
    "a field of many robots": ("m_s", lambda huge: hopform.solve_stances(**START, m_s=[3.0, huge])),
    "a stroke of many robots": ("x1_max", lambda huge: hopform.solve_stances(**START, x1_max=[math.inf, huge])),
    "one of many times": ("t", lambda huge: OBJECTS["stance"].at([0.0, huge])),
    "a gain": ("Kp", lambda huge: hopform.solve_flight(HOPPER, v2=1.9, gains=(huge, 1.0))),
    "a start in the air": (
        "v1",
        lambda huge: hopform.hopping.simulate(HOPPER, [0.0], start=hopform.State(0.0, huge, 0.6, 0.0)),
    ),
    "a height of the ground": ("terrain", lambda huge: hopform.hopping.simulate(HOPPER, [0.0, huge], height=0.2)),
    "a controller's answer": ("u", lambda huge: hopform.hopping.simulate(**HOP, controller=lambda touchdown: huge)),
    "a law's answer": ("u", lambda huge: hopform.hopping.simulate(**HOP, controller=by(lambda t, state: huge))),
    "a desired height of many": ("h_des", lambda huge: hopform.hopping.controllers.FeedForward([0.2, huge])),
    "ground below a desired height": (
        "terrain",
        lambda huge: hopform.hopping.controllers.AsPrinted(0.2).prepare(HOPPER, (huge,)),
    ),
    "a known value": ("k", lambda huge: hopform.identify.fit_robot(decays=DECAY, known={"k": huge})),
    "a mass beside a file": ("added_mass", lambda huge: parse_recording(to_csv(DECAY), "a.csv", huge)),
    "a sample": ("samples", lambda huge: OBJECTS["detector"].detect([0.0, huge])),
    "a known signal": ("signal", lambda huge: OBJECTS["detector"].chances(0.1, [0.0, huge])),
    **{
        f"{name} at touchdown": (
            name,
            lambda huge, name=name: hopform.hopping.controllers.FeedForward(0.2)(touchdown(**{name: huge})),
        )
        for name in ("x1", "v1", "v2", "ground")
    },
}
"""Numbers inside of what is handed in, and of what is handed back."""


@pytest.mark.parametrize("value", HUGE)
@pytest.mark.parametrize("name", WITHIN)
def test_a_number_within_something_else_is_refused_by_name_too(name, value):
    number, call = WITHIN[name]
    refused(number, partial(call, HUGE[value]))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_whole_number_that_a_float_holds_is_taken(dtype):
    robot = hopform.Robot(**{**GOOD, "k": 10**30})
    assert robot.k == 1e30
    many = hopform.solve_stances(HOPPER, v2=[-1, -2], k=[10**20, Fraction(1200)], dtype=dtype)
    one = hopform.solve_stance(dataclasses.replace(HOPPER, k=1200.0), v2=-2, dtype=dtype)
    assert many.duration[1] == one.duration


def test_a_clock_finer_than_the_last_digit_of_time_delays_nothing():
    fine, none = (
        hopform.hopping.simulate(**HOP, controller=1.0, errors=hopform.hopping.Errors(quantum=quantum))
        for quantum in (5e-324, 0.0)
    )
    assert fine.table.tolist() == none.table.tolist()


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"rate": 1e308}, "duration times rate must give 20 to 65535 samples, got inf"),
        ({"hold": 3.0}, "hold must be <= 2.0 s, the duration, got 3.0"),
        ({"repeats": 1001}, "repeats must be a whole number <= 1000, got 1001"),
    ],
)
def test_a_recording_that_cannot_be_is_refused(settings, message):
    with pytest.raises(hopform.HopformError, match=f"^{re.escape(message)}$"):
        hopform.identify.record(HOPPER, "drop", **settings)


@pytest.mark.parametrize(
    ("terrain", "message"),
    [("uniform", "2 size must be finite m, got inf"), ("gaussian", "10 size must be finite m, got inf")],
)
def test_a_range_that_no_float_holds_is_refused(terrain, message):
    with pytest.raises(hopform.HopformError, match=f"^{message}$"):
        hopform.hopping.terrain.generate(terrain, 3, 1e308, seed=1)


def test_an_archive_that_is_not_written_leaves_the_old_one(tmp_path):
    path = tmp_path / "run.npz"
    path.write_text("old")
    with pytest.raises(hopform.HopformError, match="samples must be a whole number"):
        OBJECTS["run"].to_npz(path, 0)
    assert path.read_text() == "old"


def test_counts_end_where_those_of_the_library_do():
    assert hopform.solve_stance(HOPPER, v2=-1.9, max_phases=2**31 - 1).status == "takeoff"
    for call in (hopform.solve_stance, hopform.solve_stances, hopform.solve_flight):
        with pytest.raises(
            hopform.HopformError, match="^max_phases must be a whole number <= 2147483647, got 2147483648$"
        ):
            call(HOPPER, v2=-1.9, max_phases=2**31)


def test_a_step_of_a_grid_that_is_too_small_is_refused():
    with pytest.raises(hopform.HopformError, match=r"^dt must be > .* s for a stance of .* s, got 5e-324$"):
        OBJECTS["stance"].grid(dt=5e-324)
