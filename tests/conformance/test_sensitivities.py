"""Derivatives through the events against differences of the 50-digit reference,
and the formulas behind them by algebra.
"""

import ctypes
import dataclasses
import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import sympy as sp

import hopform
from derive.emit.program import program
from derive.ir import unfold
from derive.maths import control, energy, sensitivity
from derive.model import quantities as Q
from derive.shipped import HOPPER
from hopform._solver.c import NO_DERIVATIVE, pointer
from hopform_solver.elements import ROWS
from tests import needs
from tests.conformance.errors import rounded
from tests.conformance.random_stances import random_robot
from tests.oracle.differences import STOPS, differences, scaled_error, size_of

TOLERANCE = 1e-11
OK = 0
APEX = ROWS.index("apex")


def side_of(name: str, stance: hopform.Stance) -> int:
    """Where an input may go: a velocity the way the mass moves, a stop away from the actuator."""
    first = stance.phases[0]
    moving = {"v1": first.mode_1, "v2": first.mode_2, "x1_min": -1}
    return moving.get(name, 1) or 1


def expected(stance: hopform.Stance, start: dict[str, Any]) -> tuple[Any, Any]:
    """The matrix by differences, and the size of each column's input;
    NaN for a stop that the actuator rests on at first.

    Such a stop and x1 are no inputs of their own: `moved` moves them together. NaN, too, for the velocity of a mass that
    is held by more friction at rest than in motion: however slow, it feels less of it.
    """
    robot, values = rounded(stance.robot, stance.dtype.type), {"x1": 0.0, "v1": 0.0, **start}
    values["u"], first = max((u for _, u in stance.u), key=abs), stance.phases[0]
    columns, sizes = [], []
    for name in stance.sensitivities.columns:
        value = robot.get(name, values.get(name, 0.0))
        size = size_of(name, value)
        sizes.append(size)
        leaves = first.mode_1 and values["v1"] == first.state.v1
        stays_at_stop = name in STOPS and value == values["x1"] and not leaves
        is_held = (name, 0) in {("v1", first.mode_1), ("v2", first.mode_2)}
        feels_less = is_held and robot.get(f"f{name[1]}_excess", 0.0) > 0.0
        if name in ("u_max", "impact_loss") or (name == "x2" and "x2" not in start) or not math.isfinite(value):
            columns.append([0.0] * 7)
        elif stays_at_stop or feels_less:
            columns.append([math.nan] * 7)
        else:
            columns.append(differences(robot, start, name, side_of(name, stance) * size))
    return np.array(columns).T, np.array(sizes)


def with_stops(sensitivities: hopform.Sensitivities, stance: hopform.Stance) -> Any:
    """The matrix with the column x1 for an actuator that takes the stop on which it starts along."""
    matrix = sensitivities.matrix.copy()
    x1 = sensitivities.columns.index("x1")
    for stop in STOPS:
        if getattr(stance.robot, stop) == stance.phases[0].state.x1:
            matrix[:, x1] += matrix[:, sensitivities.columns.index(stop)]
    return matrix


def kinds(stance: hopform.Stance) -> list[str]:
    return [event.kind for event in stance.events]


def own(**changes: float) -> hopform.Robot:
    return dataclasses.replace(hopform.load_robot("hopper_c"), **changes)


FREE = {"x1_min": -math.inf, "x1_max": math.inf}
TRIPLE = hopform.Robot(m_eff=3.0, m_s=24.0, k=800.0, L0=0.4, b1=90.0, gamma2=-65.0, f1=0.1, f2=0.1)

# What each case is about: robot, start, and events that must be among those that happen.
CASES: dict[str, tuple[hopform.Robot, dict[str, Any], set[str]]] = {
    **{f"{u} A": (own(), {"v2": -1.93, "u": u}, {"x2_reverses"}) for u in (-3.0, 0.0, 0.5, 1.25, 2.0, 3.0)},
    "the upper stop, hit from within": (own(), {"v2": -1.93, "u": 3.0, "x1": 0.07, "v1": 0.5}, {"x1_hits_stop"}),
    "the lower stop": (own(), {"v2": -1.93, "u": -3.0, "x1": 0.02, "v1": 0.3}, {"x1_reverses", "x1_hits_stop"}),
    "a stop hit and left again": (own(x1_max=0.05), {"v2": -1.93, "x1": 0.04, "v1": 1.5}, {"x1_hits_stop"}),
    "a velocity lost at a stop at once": (own(), {"v2": -1.93, "v1": -0.2, "u": 2.0}, {"x2_reverses"}),
    "a velocity lost at the upper stop": (own(), {"v2": -1.93, "v1": 0.2, "x1": 0.08}, {"x1_slips"}),
    "locked": (own(x1_min=0.01, x1_max=0.01), {"v2": -1.93, "x1": 0.01}, {"x2_reverses"}),
    "free of stops": (own(**FREE), {"v2": -1.93, "u": 1.0}, {"x1_reverses"}),
    "pulled down from rest": (own(), {"v2": -1.93, "u": -1.0, "x1": 0.04}, {"x2_reverses"}),
    "sticks and slips": (own(f1=5.0, b1=30.0), {"v2": -1.93, "v1": 0.4, "x1": 0.03}, {"x1_sticks", "x1_slips"}),
    "the body sticks": (
        own(f2=14.0, b1=10.0, **FREE),
        {"v2": -0.4, "u": [(0.0, 3.0), (0.25, -30.0)], "x1": 0.03},
        {"x2_sticks", "x2_slips"},
    ),
    "more friction at rest": (own(f1_excess=0.5, **FREE), {"v2": -1.93, "u": -0.3}, {"x1_slips"}),
    "sticks and slips with more friction at rest": (
        own(f1=2.0, f1_excess=0.4, b1=10.0, **FREE),
        {"v2": -1.93, "v1": 0.1, "u": 1.0},
        {"x1_sticks", "x1_slips"},
    ),
    "a step lets the actuator go": (own(f1_excess=5.0), {"v2": -0.7, "u": [(0.0, 0.0), (0.05, 3.0)]}, {"x1_slips"}),
    "the body sticks by more friction at rest": (
        own(f2=9.0, f2_excess=6.0, b1=10.0, **FREE),
        {"v2": -0.4, "u": [(0.0, 3.0), (0.25, -30.0)], "x1": 0.03},
        {"x2_sticks", "x2_slips"},
    ),
    "no friction": (own(b1=0.0, b2=0.0, f1=0.0, f2=0.0, **FREE), {"v2": -1.93, "u": 1.0}, {"x1_reverses"}),
    "dry friction alone": (own(b1=0.0, b2=0.0, **FREE), {"v2": -1.93, "u": 1.0}, {"x1_reverses"}),
    "compressed": (own(), {"v2": -1.2, "x1": 0.03, "x2": 0.41, "u": 2.0}, {"x2_reverses"}),
    "compressed, from rest": (own(), {"v2": 0.0, "x1": 0.03, "x2": 0.33, "u": 2.0}, {"x1_slips"}),
    "an offset": (own(c=0.01), {"v2": -1.93, "u": 2.0}, {"x2_reverses"}),
    "steps of the current": (own(), {"v2": -1.9, "u": [(0.0, 0.0), (0.05, 3.0), (0.10, -3.0)]}, {"x1_slips"}),
    "a take-off at once": (own(), {"v2": -0.3, "x1": 0.05, "v1": -1.5, "u": -3.0}, set()),
    "a body that falls at take-off": (
        own(b2=30.0),
        {"v2": -0.3, "x1": 0.05, "v1": -0.25, "u": [(0.0, -3.0), (0.06, -60.0)]},
        set(),
    ),
    "triple pole": (TRIPLE, {"v2": -1.3, "v1": 0.2, "u": [(0.0, 6.0), (0.3, -6.0)]}, {"x1_reverses", "x2_reverses"}),
    "nearly triple pole": (
        dataclasses.replace(TRIPLE, b1=90.0 * (1 + 1e-9)),
        {"v2": -1.3, "v1": 0.2, "u": [(0.0, 6.0), (0.3, -6.0)]},
        {"x1_reverses", "x2_reverses"},
    ),
    "double pole": (
        hopform.Robot(m_eff=1.0, m_s=1.0, k=100.0, L0=0.4, b1=20.0, b2=20.0, gamma2=-20.0),
        {"v2": -1.3, "v1": 0.2, "u": [(0.0, 3.0), (0.15, -6.0)]},
        {"x1_reverses", "x2_reverses"},
    ),
    "stiff": (own(k=1e6, b1=2e4), {"v2": -1.93, "u": 3.0}, {"x1_hits_stop", "x1_slips"}),
}


# The same of stances that do not take off.
OTHER_ENDINGS: dict[str, tuple[hopform.Robot, dict[str, Any], set[str]]] = {
    "horizon: on the ground": (own(), {"v2": -1.93, "u": 2.0, "horizon": 0.1}, {"x2_reverses"}),
    "horizon: through a stop": (own(), {"v2": -1.93, "u": 3.0, "x1": 0.07, "v1": 0.5, "horizon": 0.1}, {"x1_hits_stop"}),
    "horizon: a leg that sinks": (own(b1=900.0), {"v2": -0.3, "x1": 0.06, "horizon": 0.7}, {"x1_sticks", "x1_slips"}),
    "horizon: between steps": (own(), {"v2": -1.9, "u": [(0.0, 0.0), (0.05, 3.0)], "horizon": 0.07}, {"x1_slips"}),
    "rest: the body last": (own(b2=60.0, f2=6.0), {"v2": -0.9, "v1": 0.3, "x1": 0.03}, {"x1_sticks", "x2_sticks"}),
    "rest: the actuator last": (
        own(b2=60.0, f2=30.0, f1=4.0, **FREE), {"v2": -0.3, "v1": 0.8, "x1": 0.03, "x2": 0.4}, {"x1_sticks", "x2_sticks"},
    ),
    "rest: at the lower stop": (own(f2=30.0), {"v2": -0.1, "v1": -0.9, "x1": 0.02, "x2": 0.38, "u": -1.0}, {"x1_hits_stop"}),
    "rest: on the stop of the start": (own(b2=60.0, f2=6.0), {"v2": -0.9}, {"x2_sticks"}),
    "rest: before the last step of the current": (
        own(b2=60.0, f2=6.0), {"v2": -0.9, "x1": 0.03, "u": [(0.0, 0.0), (0.9, 0.01)], "horizon": 3.0}, {"x2_sticks"},
    ),
    "rest: locked": (own(x1_min=0.01, x1_max=0.01, b2=60.0, f2=6.0), {"v2": -0.9, "x1": 0.01}, {"x2_sticks"}),
}  # fmt: skip


def assert_derivatives(robot: hopform.Robot, start: dict[str, Any], events: set[str], ending: str = "takeoff") -> None:
    stance = hopform.solve_stance(robot, **start)
    assert stance.status == ending
    assert events <= set(kinds(stance)), kinds(stance)
    theirs, sizes = expected(stance, start)
    matrix = with_stops(stance.sensitivities, stance)
    if ending != "takeoff":
        assert np.isnan(matrix[APEX]).all()
        matrix[APEX] = 0.0
    error = scaled_error(matrix, theirs, sizes)
    assert error <= TOLERANCE, (kinds(stance), error)


@pytest.mark.parametrize("name", needs.the_first([*CASES], 6))
def test_derivatives_are_those_of_the_reference(name):
    assert_derivatives(*CASES[name])


@pytest.mark.parametrize("name", needs.the_first([*OTHER_ENDINGS], 4))
def test_derivatives_at_other_endings_are_those_of_the_reference(name):
    """At a horizon the duration stays; at rest it moves as the last event does."""
    assert_derivatives(*OTHER_ENDINGS[name], ending=name.partition(":")[0])


def random_stances(ending: str) -> Iterator[tuple[hopform.Robot, dict[str, Any]]]:
    """Random robots with an ending, those with dozens of reversals left to the other tests."""
    for seed in itertools.count():
        robot, start = random_robot(seed)
        stance = hopform.solve_stance(robot, **start)
        if stance.status == ending and len(stance.events) <= 30:
            yield robot, {name: value for name, value in start.items() if name != "max_phases"}


@pytest.mark.parametrize(
    ("ending", "first", "count"),
    [("takeoff", 0, 2), ("rest", 0, 1), *needs.sliced(("takeoff", 2, 38), ("rest", 1, 3), ("horizon", 0, 1))],
)
def test_derivatives_of_random_robots_are_those_of_the_reference(ending, first, count):
    for robot, start in itertools.islice(random_stances(ending), first, first + count):
        assert_derivatives(robot, start, set(), ending)


def test_a_given_height_at_touchdown_passes_the_compression_on(hopper_c):
    """x2 = x1 + L0 + c given: from y = 0 on the leg may only be shortened, so x2 goes down by what is above 4 ulp."""
    height = 0.01 + hopper_c.L0 + hopper_c.c
    start = {"v2": -1.93, "x1": 0.01, "u": 2.0}
    given = hopform.solve_stance(hopper_c, x2=height, **start).sensitivities
    left_out = hopform.solve_stance(hopper_c, **start).sensitivities
    step = 1e-6
    states = [hopform.solve_stance(hopper_c, x2=height - n * step, **start) for n in range(3)]
    apexes = [stance.apex for stance in states]
    assert given["apex", "x2"] == pytest.approx(-(4 * apexes[1] - 3 * apexes[0] - apexes[2]) / (2 * step), rel=1e-6)
    for row in given.rows:
        assert left_out[row, "x2"] == 0.0
        for name in ("x1", "L0", "c"):
            assert given[row, name] == pytest.approx(left_out[row, name] - given[row, "x2"], rel=1e-9, abs=1e-9)


def test_a_common_shift_of_all_currents_is_what_u_means(hopper_c):
    one = hopform.solve_stance(hopper_c, v2=-1.93, u=2.0).sensitivities
    in_steps = hopform.solve_stance(hopper_c, v2=-1.93, u=[(0.0, 2.0), (0.07, 2.0)]).sensitivities
    np.testing.assert_allclose(in_steps.matrix, one.matrix, rtol=1e-12, atol=1e-13)


def test_where_a_search_ends_there_are_no_derivatives(hopper_c):
    stance = hopform.solve_stance(hopper_c, v2=-1.93, u=2.0, max_phases=1)
    assert stance.status == "too_many_phases"
    assert np.isnan(stance.sensitivities.matrix).all()


def test_a_stance_that_rests_at_once_stays_where_it_starts():
    """A velocity that is held at the start stays 0, so that it is no input."""
    stance = hopform.solve_stance(own(f2=30.0), v2=0.0, x1=0.03, compression=0.01)
    assert (stance.status, stance.duration) == ("rest", 0.0)
    by = stance.sensitivities
    assert not np.any(by.matrix[[0, *map(ROWS.index, ("v1", "v2", "aed"))]])
    assert by["x1", "x1"] == by["x2", "x1"] == by["x2", "L0"] == by["x2", "c"] == 1.0
    assert np.isnan(by.matrix[APEX]).all() and np.nansum(np.abs(by.matrix)) == 4.0


@pytest.mark.parametrize("balanced", ["at once", "on the threshold"])
def test_a_rest_that_a_small_change_ends_has_no_derivatives(balanced):
    """Held without friction, the forces cancel; held at the level of friction, they may just not grow."""
    free = own(f1=0.0, f2=0.0, b1=0.0, g=0.0, gamma2=-64.0, **FREE)
    if balanced == "at once":
        stance = hopform.solve_stance(free, v2=0.0)
    else:
        robot = dataclasses.replace(free, m_eff=32.0, m_s=4.0, f1=2.0, f2=3.0)
        stance = hopform.solve_stance(robot, v2=0.0, u=1.0)
        firm = hopform.solve_stance(robot, v2=0.0, u=0.5)
        assert firm.status == "rest" and not np.isnan(firm.sensitivities["T", "u"])
    assert (stance.status, stance.duration) == ("rest", 0.0)
    assert np.isnan(stance.sensitivities.matrix).all()


FREELY = own(f1=0.0, f2=0.0, b1=0.0, b2=0.0, g=0.0, gamma2=-64.0, m_eff=32.0, m_s=4.0, **FREE)
"""2 m/s^2 of the actuator per A, -16 m/s^2 of the body where it is held."""
THEN = [(0.0, 0.0), (0.05, 9.0)]
RESTS: dict[str, tuple[hopform.Robot, dict[str, Any], bool]] = {
    "balanced, then a step moves it": (FREELY, {"u": THEN, "horizon": 0.2}, False),
    "balanced up to the horizon": (FREELY, {"u": THEN, "horizon": 0.03}, False),
    "one mass without friction": (dataclasses.replace(FREELY, f2=3.0), {"u": THEN, "horizon": 0.2}, False),
    "at its friction, then a step moves it": (
        dataclasses.replace(FREELY, f1=2.0, f2=3.0), {"u": [(0.0, 1.0), (0.05, 9.0)], "horizon": 0.2}, False,
    ),
    "below its friction": (
        dataclasses.replace(FREELY, f1=2.0, f2=3.0), {"u": [(0.0, 0.5), (0.05, 9.0)], "horizon": 0.2}, True,
    ),
    "no friction at the stop that it is pressed to": (
        dataclasses.replace(FREELY, f2=3.0, x1_min=0.0), {"u": [(0.0, -0.5), (0.05, 9.0)], "horizon": 0.2}, True,
    ),
    "no friction, locked": (
        dataclasses.replace(FREELY, f2=3.0, x1_max=0.0, x1_min=0.0), {"u": THEN, "horizon": 0.03}, True,
    ),
    "taken off its friction by the other mass": (
        dataclasses.replace(FREELY, f1=2.0), {"v2": -0.3, "u": 1.0, "horizon": 0.05}, True,
    ),
    "taken off a friction that falls as it slips": (
        dataclasses.replace(FREELY, f1=1.5, f1_excess=0.5), {"v2": -0.3, "u": 1.0, "horizon": 0.05}, False,
    ),
    "taken from below such a friction": (
        dataclasses.replace(FREELY, f1=1.5, f1_excess=0.5), {"v2": -0.3, "u": 0.99, "horizon": 0.05}, True,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", RESTS)
def test_a_rest_that_a_step_ends_has_derivatives_if_it_stays_one_at_a_small_change(name):
    robot, start, exists = RESTS[name]
    stance = hopform.solve_stance(robot, **{"v2": 0.0, **start})
    assert stance.status == "horizon"
    rows = np.delete(stance.sensitivities.matrix, APEX, axis=0)
    assert np.isfinite(rows).all() if exists else np.isnan(rows).all()
    for t, found in ((0.0, True), (0.5 * start["horizon"], exists), (start["horizon"], exists)):
        assert tangent_status(stance, t) == (OK if found else NO_DERIVATIVE)


def tangent_status(stance: hopform.Stance, t: float) -> int:
    """What C says of the derivatives of a state."""
    into = np.array([t]), np.empty((1, 4)), np.empty((1, 4, 1))
    column, count = np.array([4], np.int32), ctypes.c_int32(1)
    times, *rest = map(pointer, into)
    return stance._solved.call("stance_tangents", pointer(column), count, times, count, *rest)


def test_behind_a_rest_that_a_small_change_ends_states_have_no_derivatives():
    for robot, status in ((FREELY, NO_DERIVATIVE), (dataclasses.replace(FREELY, f1=1.0, f2=1.0), OK)):
        stance = hopform.solve_stance(robot, v2=0.0)
        assert (stance.status, stance.duration) == ("rest", 0.0)
        assert (tangent_status(stance, 0.0), tangent_status(stance, 1.0)) == (OK, status)


def test_a_leg_that_extends_from_equal_velocities_has_no_derivatives(hopper_c):
    stance = hopform.solve_stance(hopper_c, v2=-1.0, v1=-1.0, x1=0.04, u=-100.0)
    assert stance.status == "takeoff"
    assert stance.duration == 0.0
    assert np.isnan(stance.sensitivities.matrix).all()


def test_without_gravity_the_row_of_the_apex_alone_is_missing(hopper_c):
    robot = dataclasses.replace(hopper_c, g=0.0)
    stance = hopform.solve_stance(robot, v2=-1.93, u=2.0)
    missing = np.isnan(stance.sensitivities.matrix).all(axis=1)
    assert stance.sensitivities.rows[int(np.flatnonzero(missing)[0])] == "apex"
    assert missing.sum() == 1 == np.isnan(stance.sensitivities.matrix).any(axis=1).sum()


def test_a_name_that_there_is_not_is_refused(hopper_c):
    with pytest.raises(hopform.HopformError, match="'mass' is not one of x1, v1, x2, v2, u, m_eff"):
        hopform.solve_stance(hopper_c, v2=-1.93).sensitivities["T", "mass"]


def test_single_precision_has_the_same_derivatives_to_its_own_digits(hopper_c):
    for u in (-3.0, 0.5, 3.0):
        double, single = (
            hopform.solve_stance(hopper_c, v2=-1.93, u=u, dtype=dtype).sensitivities.matrix
            for dtype in (np.float64, np.float32)
        )
        assert single.dtype == np.float32
        scale = np.max(np.abs(double), axis=1, keepdims=True)
        np.testing.assert_allclose(single / (scale + (scale == 0)), double / (scale + (scale == 0)), rtol=0, atol=2e-4)


# ---- the formulas, by algebra ----


def is_zero(expression: Any) -> bool:
    return bool(expression.expand().cancel() == 0)


def test_the_slopes_are_the_variations_of_the_equations_of_motion():
    """Times v_1, v_2, y and 1 they sum to the change of (3), (4) at a fixed state, whatever input changes."""
    steps = program().function("slopes_of").steps
    per_1, per_2, per_y, constant = (sensitivity.SLOPES.symbols[n::4] for n in range(4))
    for mass in (0, 1):
        total = constant[mass] + per_y[mass] * Q.y + per_1[mass] * Q.v1 + per_2[mass] * Q.v2
        right = HOPPER.in_compression[mass]
        change = sum(right.diff(symbol) * sensitivity.change_of(symbol) for symbol in (Q.u, *Q.LETTERS))
        assert is_zero(unfold(total, steps) - change)


def test_the_change_of_the_body_s_energy_is_its_derivative():
    """With x_2 = L_0 + c + length: what m_s g (L_0 + c) adds at both ends of a stance is no part of the AED."""
    (_, body, *_) = energy.energies(HOPPER)
    value = unfold(body.value, energy.energies(HOPPER)[:1]).subs({Q.L0: 0, Q.c: 0})
    change = sum(value.diff(symbol) * sensitivity.change_of(symbol) for symbol in (Q.m_s, Q.k, Q.g, Q.x1, Q.v2, Q.y))
    steps = program().function("body_energy_change").steps
    assert is_zero(unfold(steps[-1].symbol, steps) - change)


def test_the_change_of_the_apex_is_the_derivative_of_the_apex():
    """Of a body that rises: there max(v_2, 0) is v_2."""
    (apex,) = control.apex_of_takeoff(HOPPER)
    value = apex.value.subs(control.v_up, Q.v2)
    change = sum(value.diff(symbol) * sensitivity.change_of(symbol) for symbol in (Q.g, Q.x1, Q.y, Q.v2))
    steps = program().function("apex_change").steps
    assert is_zero(unfold(steps[-1].symbol, steps).subs(sp.Abs(Q.v2), Q.v2) - change)
