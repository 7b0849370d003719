"""Derivatives of flights: against differences to 60 digits, by the chain rule through a cut, and in other units.

Where the library has none the flight grazes: the actuator a stop, the foot the ground, or a velocity 0. Draws in which
it does are counted: no more than one in a hundred.
"""

import dataclasses
from typing import Any

import numpy as np
import pytest

import hopform
from tests import needs
from tests.conformance.errors import rounded
from tests.conformance.flight_derivatives import compared, condition, inputs_of, phases_of, scaled_error
from tests.conformance.flights import random_flight
from tests.conformance.test_flight import CASES as FLIGHTS
from tests.oracle import flight_branch as branch
from tests.oracle.reference.flight import solve_flight as reference_flight

HOPPER = hopform.load_robot("hopper_c")
COUNT = 10
DRAWS = [(first, dtype) for first in range(10, 210, 10) for dtype in (np.float64, np.float32)]
TOLERANCE = {np.float64: 1e-12, np.float32: 1e-4}


def own(**changes: float) -> hopform.Robot:
    return dataclasses.replace(HOPPER, **changes)


def critical(ratio: float, m_eff: float = 25.0) -> tuple[float, float]:
    """Gains of a double pole at 30 1/s without b1, its damping times a ratio."""
    return m_eff * 900.0, 2.0 * m_eff * 30.0 * ratio


SMOOTH = {"b1": 0.0, "f1": 0.0}
FREE = {"x1_min": -np.inf, "x1_max": np.inf}
START = {"x1": 0.05, "v1": 0.4, "v2": 1.9}
CASES: dict[str, tuple[hopform.Robot, dict[str, Any]]] = {
    **{name: (HOPPER, case) for name, case in FLIGHTS.items()},
    "double pole": (own(b1=0.0), START | {"gains": critical(1.0)}),
    "nearly double pole": (own(b1=0.0), START | {"gains": critical(1.0 + 1e-9)}),
    "nearly double pole that rings": (own(b1=0.0), START | {"gains": critical(1.0 - 1e-7)}),
    "overdamped by far": (HOPPER, START | {"gains": (30.0, 3e5)}),
    "stiff": (own(u_max=1e4), START | {"gains": (3e8, 1e5)}),
    "rings for long": (own(b1=0.0, f1=0.0, u_max=1e4, **FREE), START | {"gains": (3e6, 1.0)}),
    "saturates from side to side": (own(u_max=2.0, **FREE), START | {"gains": (3e5, 10.0)}),
    "no stiffness": (own(**SMOOTH, **FREE), START | {"v1": 0.1, "gains": (0.0, 100.0)}),
    "no force": (own(**SMOOTH, **FREE), START | {"v1": 0.1, "gains": (0.0, 0.0)}),
    "no motor": (own(gamma2=0.0), START),
    "at rest without friction": (own(**SMOOTH, **FREE), {"v2": 1.9, "gains": (3e3, 40.0)}),
    "an offset of the spring": (own(c=0.01, **FREE), START | {"gains": (1e4, 300.0)}),
    "more friction at rest": (own(f1_excess=0.5, **FREE), START | {"gains": (8e3, 30.0)}),
    "bounces": (own(f1=0.0, u_max=300.0, x1_min=-np.inf), {"x1": 0.03, "v1": 9.0, "v2": 1.9, "gains": (2e5, 5.0)}),
    "trips at a stop": (HOPPER, {"x1": 0.02, "v1": -1.5, "v2": 0.3, "y": 0.2}),
    "ends at the horizon": (HOPPER, START | {"horizon": 0.2}),
    "ends while it rises": (HOPPER, START | {"horizon": 0.05}),
}


def flight_of(robot: hopform.Robot, case: dict[str, Any], dtype: Any = np.float64) -> hopform.Flight:
    """The flight of a case, whose y is how far the foot is below the ground ahead."""
    robot = hopform.Robot(**rounded(robot, dtype))
    inputs = {
        name: float(dtype(value)) if np.isscalar(value) and name != "max_phases" else value
        for name, value in case.items()
    }
    y = inputs.pop("y", 0.0)
    x2 = inputs.get("x1", 0.0) - y + robot.L0 + robot.c if y else None
    return hopform.solve_flight(robot, **inputs, x2=x2, dtype=dtype)


def assert_right(flight: hopform.Flight, x2_is_given: bool, designed: bool) -> None:
    dtype = flight.dtype.type
    ours, theirs, sizes = compared(flight, x2_is_given=x2_is_given, design=designed)
    error = scaled_error(ours, theirs, sizes)
    if error > TOLERANCE[dtype]:
        error /= max(1.0, condition(flight, x2_is_given=x2_is_given, design=designed))
    assert error <= TOLERANCE[dtype], f"scaled error {error:.2e} of {flight!r}, {flight.robot}"


FIRST = ("returns", "trips at a stop", "bounces", "nearly double pole", "saturates from side to side")


@pytest.mark.parametrize("name", [*FIRST, *needs.sliced(*((name,) for name in CASES if name not in FIRST))])
def test_derivatives_are_those_of_differences_to_60_digits(name):
    robot, case = CASES[name]
    assert_right(flight_of(robot, case), bool(case.get("y")), "gains" not in case and robot.gamma2 != 0.0)


@pytest.mark.parametrize("name", needs.the_first(["soft law", *CASES]))
def test_derivatives_of_single_precision_are_those_of_differences(name):
    robot, case = CASES[name]
    assert_right(flight_of(robot, case, np.float32), bool(case.get("y")), "gains" not in case and robot.gamma2 != 0.0)


@pytest.mark.parametrize(("first", "dtype"), [(0, np.float64), *needs.sliced(*DRAWS)])
def test_derivatives_of_random_flights_are_those_of_differences(first, dtype):
    grazes = 0
    for seed in range(first, first + (COUNT if first else 6)):
        robot, inputs = random_flight(seed)
        if seed % 3 == 0:
            inputs = inputs | {"gains": None}
        flight = flight_of(robot, inputs, dtype)
        if np.isnan(flight.sensitivities["T", "g"]):
            assert flight.status == "too_many_phases" or grazing(flight), flight
            grazes += flight.status != "too_many_phases"
        else:
            assert_right(flight, bool(inputs["y"]), flight._solved.flight.designed != 0)
    assert grazes <= max(1, COUNT // 50)


def grazing(flight: hopform.Flight) -> bool:
    """Whether a velocity at a stop, or of the foot at the ground, is rounding beside what it is a difference of."""
    eps = float(np.finfo(flight.dtype).eps)
    slow = 1e3 * eps * max(1.0, abs(flight.end.v1), abs(flight.end.v2))
    hits = [event.time for event in flight.events if event.kind == "x1_hits_stop"]
    just_before = [
        abs(float(flight.at(np.nextafter(np.dtype(flight.dtype).type(t), flight.dtype.type(0))).v1)) for t in hits
    ]
    return min([*just_before, abs(flight.end.v2 - flight.end.v1)]) <= 1e3 * slow


@pytest.mark.parametrize("name", ["returns", "hits the lower stop", "trips"])
def test_the_branch_is_the_flight_of_the_50_digit_reference(name):
    """Of hopper_c, whose gravity and length are not exact: what both begin with is the same to the last digit."""
    robot, case = CASES[name]
    flight = flight_of(robot, case)
    numbers, start = inputs_of(flight)
    below = branch.mp.mpf(start["x1"]) - start["x2"] + numbers["L0"] + branch.mp.mpf(numbers["c"])
    exact = reference_flight(
        numbers, x1=start["x1"], v1=start["v1"], v2=start["v2"], y=str(below), gains=(start["Kp"], start["Kd"])
    )
    ours = branch.solve(numbers, start, phases_of(flight), flight.status)
    theirs = [exact.duration, *exact.end[:2], exact.end[2]]
    for n, each in zip((0, 1, 2, 4), theirs, strict=True):
        assert abs(ours[n] - branch.mp.mpf(str(each))) < 1e-28


# ---- what must hold of every flight ----


def test_a_flight_that_is_cut_has_the_derivatives_of_the_whole():
    """The state at a time that stays, then the flight from there: the chain rule."""
    given = {"gains": (9e3, 60.0), "x2": 0.47}
    whole = hopform.solve_flight(HOPPER, **START, **given)
    cut = 0.5 * (whole.events[0].time + whole.events[1].time)
    first = hopform.solve_flight(HOPPER, **START, **given, horizon=cut)
    second = hopform.solve_flight(HOPPER, **first.end._asdict(), gains=given["gains"])
    assert [event.kind for event in (*first.events, *second.events)] == [event.kind for event in whole.events]
    state = ("x1", "v1", "x2", "v2")
    for row in ("T", *state, "v2_after"):
        for column in whole.sensitivities.columns:
            by_state = sum(second.sensitivities[row, each] * first.sensitivities[each, column] for each in state)
            direct = 0.0 if column in (*state, "ground") else second.sensitivities[row, column]
            assert by_state + direct == pytest.approx(whole.sensitivities[row, column], rel=1e-11, abs=1e-13), (
                row,
                column,
            )


UNITS_OF = {"m": (1, 0, 0), "s": (0, 1, 0), "kg": (0, 0, 1), "m/s": (1, -1, 0), "m/s^2": (1, -2, 0), "N/m": (0, -2, 1),
            "N s/m": (0, -1, 1), "N/A": (1, -2, 1), "A": (0, 0, 0), "1": (0, 0, 0)}  # fmt: skip


def in_units(unit: str, metre: float, second: float, kilogram: float) -> float:
    m, s, kg = UNITS_OF[unit]
    return metre**m * second**s * kilogram**kg


@pytest.mark.parametrize("name", ["soft law", "stiff", "hits the lower stop", "trips"])
def test_derivatives_have_their_units(name):
    """In half a metre, a quarter of a second, eight kilograms the same numbers follow, to the last bit but of eps."""
    robot, case = CASES[name]
    case = {"gains": tuple(hopform.design_return(robot, 0.3)), **case}
    flight, units = flight_of(robot, case), (2.0, 4.0, 0.125)
    by = {field.name: in_units(field.unit, *units) for field in robot.fields() if field.unit in UNITS_OF}
    other = dataclasses.replace(robot, **{name: getattr(robot, name) * by[name] for name in by if name != "travel"})
    kinds = {"x1": "m", "v1": "m/s", "v2": "m/s", "y": "m", "horizon": "s"}
    scaled = {key: value * in_units(kinds[key], *units) for key, value in case.items() if key in kinds}
    scaled["gains"] = tuple(g * in_units(u, *units) for g, u in zip(case["gains"], ("N/m", "N s/m"), strict=True))
    ours, theirs = flight.sensitivities, flight_of(other, {"horizon": 40.0, **scaled}).sensitivities
    rows, columns = ([in_units(ours.units[each], *units) for each in names] for names in (ours.rows, ours.columns))
    np.testing.assert_allclose(
        theirs.matrix, ours.matrix * np.outer(rows, 1.0 / np.array(columns)), rtol=1e-12, atol=1e-18
    )


def test_a_flight_that_grazes_has_no_derivatives():
    bounces = hopform.Robot(
        m_eff=0.25, m_s=4.0, k=200.0, L0=0.4, gamma2=-10.0, x1_min=-0.0625, x1_max=0.5,
    )  # fmt: skip
    grazes = hopform.solve_flight(bounces, x1=0.0625, v2=2.0, gains=(6000.0, 0.0))
    assert grazes.events[0].kind == "x1_hits_stop"
    assert np.isnan(grazes.sensitivities.matrix).all()
    capped = hopform.solve_flight(HOPPER, **START, max_phases=1)
    assert capped.status == "too_many_phases"
    assert np.isnan(capped.sensitivities.matrix).all()


def test_designed_gains_follow_the_start_and_given_ones_stay():
    free = hopform.solve_flight(HOPPER, **START)
    fixed = hopform.solve_flight(HOPPER, **START, gains=free.gains)
    assert free.duration == fixed.duration
    both = free.sensitivities, fixed.sensitivities
    assert both[0]["x1", "v2"] != both[1]["x1", "v2"]
    np.testing.assert_array_equal(
        *(each.matrix[:, [each.columns.index(n) for n in ("Kp", "Kd", "x1_max")]] for each in both)
    )
    step = 1e-5
    ends = [hopform.solve_flight(HOPPER, **(START | {"v2": 1.9 + by})).end.x1 for by in (-step, step)]
    assert both[0]["x1", "v2"] == pytest.approx((ends[1] - ends[0]) / (2 * step), rel=1e-6)
