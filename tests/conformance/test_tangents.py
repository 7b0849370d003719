"""States at many times with their derivatives: C against NumPy,
and both against differences of the 50-digit reference.
"""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import hopform
from hopform._solver.choice import DEFAULT
from hopform_solver import records
from hopform_solver.elements import COLUMNS
from hopform_solver.records import LegState

FREE = {"x1_min": -math.inf, "x1_max": math.inf}
STEPS = ((0.0, 0.0), (0.03, 2.5), (0.08, -1.0), (0.15, 1.5))


def own(**changes: float) -> hopform.Robot:
    return dataclasses.replace(hopform.load_robot("hopper_c"), **changes)


# Robot, start (x1, v1, v2, y), steps of the current, horizon, events that must be among those that happen.
CASES: dict[str, tuple[hopform.Robot, LegState, tuple[tuple[float, float], ...], float, set[str]]] = {
    "a stance with a stepped current": (own(), LegState(0.02, 0.3, -1.93, 0.0), STEPS, 2.0,
                                        {"x1_reverses", "x2_reverses"}),
    "stops": (own(), LegState(0.07, 0.5, -1.93, 0.0), ((0.0, 3.0),), 2.0, {"x1_hits_stop"}),
    "a cart on a spring that comes to rest": (
        own(k=700.0, m_s=0.6, b2=1.0, f2=0.2, c=0.1, g=70.0 / 0.6, x1_max=0.0),
        LegState(0.0, 0.0, 0.05, 0.13), ((0.0, 0.0),), 4.0, {"x2_reverses", "x2_sticks"},
    ),
    "an actuator that sticks and slips": (
        own(f2=1e9, c=0.3, k=400.0, b1=20.0, f1=2.5, gamma2=-30.0, m_eff=2.0, **FREE),
        LegState(0.03, 0.0, 0.0, 0.3), tuple((0.02 * n, 0.5 * math.sin(0.1 * n)) for n in range(60)), 1.2,
        {"x1_slips", "x1_sticks"},
    ),
}  # fmt: skip


def solved(name: str, **moved: float) -> tuple[Any, float]:
    """A case with inputs moved, and its duration."""
    robot, start, steps, horizon, _ = CASES[name]
    start = start._replace(**{key: getattr(start, key) + by for key, by in moved.items() if key in LegState._fields})
    fields = {key: getattr(robot, key) + by for key, by in moved.items() if hasattr(robot, key)}
    current = tuple((t, u + moved.get("u", 0.0)) for t, u in steps)
    parameters = dataclasses.replace(robot, **fields).parameters
    found = DEFAULT.compiled().solve_stance(parameters, start, current, horizon, 4096, np.dtype(np.float64))
    return found, found.outcome()[1]


def times_of(name: str) -> np.ndarray:
    """Times up to the end, none of them within a step of the differences of an event."""
    found, duration = solved(name)
    events = np.array([t for t, _, _, event, _ in found.phase_rows() if event])
    times = np.linspace(0.0, duration, 83)[:-1]
    return times[np.abs(times[:, None] - events).min(axis=1, initial=1.0) > 1e-3]


@pytest.mark.parametrize("name", CASES)
def test_the_events_that_a_case_is_about_happen(name):
    kinds = {records.EVENTS[row[3]] for row in solved(name)[0].phase_rows() if row[3] in records.EVENTS}
    assert CASES[name][4] <= kinds


@pytest.mark.parametrize("name", CASES)
def test_tangents_are_the_limits_of_differences(name):
    """Central differences, extrapolated: what is left of them is their rounding,
    about 1e-16/1e-6 and two digits for scale.
    """
    times = times_of(name)
    rows = solved(name)[0].tangents(times)[1]
    robot = CASES[name][0]
    moving = solved(name)[0].phase_rows()[0][2]
    for column, key in enumerate(COLUMNS):
        size = 1e-5 * max(abs(getattr(robot, key, 0.0)), 0.1)
        if key in ("x1_min", "x1_max", "u_max", "impact_loss", "f1_excess", "f2_excess") or (
            key == "f2" and robot.f2 > 1e6
        ):
            continue
        if (key == "v1" and moving // 3 == 1) or (key == "v2" and moving % 3 == 1):
            continue  # a velocity that is held is no input
        if (key == "x1" and robot.x1_max == 0.0) or (key == "y" and CASES[name][1].y == 0.0):
            continue  # a locked actuator, and a spring that cannot pull
        central = []
        for step in (size, 0.5 * size):
            up, down = (solved(name, **{key: sign * step})[0] for sign in (1.0, -1.0))
            ends = [min(found.outcome()[1], times[-1]) for found in (up, down)]
            used = times <= min(ends)
            pair = [np.array(found.tangents(times[used])[0]).T for found in (up, down)]
            central.append((pair[0] - pair[1]) / (2.0 * step))
        expected = (4.0 * central[1] - central[0]) / 3.0
        found = rows[used, :, column]
        scale = np.abs(rows[:, :, column]).max() + 1e-3
        assert np.abs(found - expected).max() <= 1e-7 * scale, key


def test_the_last_tangents_of_a_stance_lead_to_its_sensitivities():
    """At take-off: the state's change at a fixed time, plus its rate times the change of the time."""
    found, duration = solved("a stance with a stepped current")
    rows = found.tangents(np.array([duration]))[1][0]
    matrix = found.sensitivities()
    by_time = matrix[0]
    rate = (np.array(found.state(duration)) - np.array(found.state(duration - 1e-7))) / 1e-7
    for row, place in ((0, 1), (1, 2), (2, 4)):
        assert np.abs(rows[row] + rate[row] * by_time - matrix[place]).max() <= 1e-5 * np.abs(matrix[place]).max()
