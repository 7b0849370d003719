"""Derivatives by chosen columns, by single steps and their times; batches with steps, times and all that is read."""

import ctypes

import numpy as np
import pytest

import hopform
from hopform._solver import package
from hopform._solver.c import C, plan_of
from hopform._solver.package import Asked, LegState, column_of_step, column_of_step_time

COUNT = 40
STEPS = ((0.0, 2.0), (0.03, -1.0), (0.06, 1.5), (0.11, 0.5))


@pytest.fixture
def compiled(hopper_c) -> C:
    return hopper_c.solver.compiled()


def solved(compiled, parameters, steps, horizon=2.0, v2=-1.9):
    return compiled.solve_stance(parameters, LegState(0.0, 0.0, v2, 0.0), steps, horizon, 64, np.dtype(float))


def test_chosen_columns_are_those_of_all_to_the_bit(hopper_c, compiled):
    found = solved(compiled, hopper_c.parameters, STEPS)
    times, chosen = np.array([0.0, 0.02, 0.1]), [7, 4, 0, 7, 21]
    np.testing.assert_array_equal(found.sensitivities(chosen), found.sensitivities()[:, chosen])
    np.testing.assert_array_equal(found.tangents(times, chosen)[1], found.tangents(times)[1][..., chosen])
    assert found.sensitivities([]).shape == (7, 0)


def test_a_column_that_is_none_is_refused_by_name(hopper_c, compiled):
    found = solved(compiled, hopper_c.parameters, STEPS)
    for none in (-1, column_of_step_time(package.OURS, 0), column_of_step(package.OURS, 65535)):
        with pytest.raises(hopform.HopformError, match="a column of derivatives is none, or their count is negative"):
            found.sensitivities([4, none])


def test_the_inputs_of_all_steps_together_are_the_input(hopper_c, compiled):
    found = solved(compiled, hopper_c.parameters, STEPS)
    columns = [column_of_step(package.OURS, n) for n in range(len(STEPS))]
    each, whole = found.sensitivities(columns), found.sensitivities([4])
    assert (np.abs(each).max(axis=0) > 0).all()
    np.testing.assert_allclose(each.sum(axis=1), whole[:, 0], rtol=1e-13, atol=1e-15)
    assert not found.sensitivities([column_of_step(package.OURS, 9), column_of_step_time(package.OURS, 9)]).any()


def moved(n, by_u, by_t):
    return tuple((t + (by_t if i == n else 0), u + (by_u if i == n else 0)) for i, (t, u) in enumerate(STEPS))


@pytest.mark.parametrize("kind", ["input", "time"])
@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_step_moves_the_ending_as_differences_say(hopper_c, compiled, kind, n):
    column = {"input": column_of_step, "time": column_of_step_time}[kind](package.OURS, n)
    analytical = solved(compiled, hopper_c.parameters, STEPS).sensitivities([column])[:, 0]
    by = {"input": (1e-5, 0.0), "time": (0.0, 1e-6)}[kind]
    ends = []
    for sign in (1, -1):
        found = solved(compiled, hopper_c.parameters, moved(n, sign * by[0], sign * by[1]))
        _, duration, end, apex, aed = found.outcome()
        ends.append(np.array([duration, end.x1, end.v1, end.v2, apex, aed]))
    differences = (ends[0] - ends[1]) / (2 * sum(by))
    np.testing.assert_allclose(analytical[[0, 1, 2, 4, 5, 6]], differences, rtol=2e-6, atol=1e-8)


def batch(compiled, parameters, u, asked, readings, horizon, v2, events=False):
    results = package.results_like(v2.size, np.dtype(float))
    flat = (0.0, 0.0, v2, 0.0, u, horizon, *map(float, parameters))
    found = compiled.solve_columns(flat, results, readings, 64, events, asked)
    return results, found


@pytest.mark.parametrize("events", [False, True])
def test_a_batch_reads_of_each_stance_what_it_says_alone(hopper_c, compiled, events, monkeypatch):
    monkeypatch.setattr("hopform._solver.c.FIRST_CAPACITY", 6)  # too few phases for most of them at first
    rng = np.random.default_rng(59)
    u, v2 = rng.uniform(-3, 3, (COUNT, len(STEPS))), rng.uniform(-2.8, -0.2, COUNT)
    horizon = np.where(rng.random(COUNT) < 0.2, 0.1, 2.0)
    times, starts = np.array([0.0, 0.06, 0.12, 0.17, 1.9]), np.array([t for t, _ in STEPS])
    columns = [3, column_of_step(package.OURS, 2), 4, column_of_step_time(package.OURS, 1)]
    readings = {
        "states": np.empty((COUNT, times.size, 4)), "sensitivities": np.empty((COUNT, 7, 4)),
        "tangents": np.empty((COUNT, times.size, 4, 4)), "compressions": np.empty(COUNT),
        "reading_status": np.empty(COUNT, np.int32), "tangent_status": np.empty(COUNT, np.int32),
    }  # fmt: skip
    asked = Asked(starts, times, columns)
    results, found = batch(compiled, hopper_c.parameters, u, asked, readings, horizon, v2, events)
    assert (results[0][1] >= 6).any()
    for i in range(COUNT):
        steps = tuple(zip(starts.tolist(), u[i].tolist(), strict=True))
        alone = solved(compiled, hopper_c.parameters, steps, horizon[i], v2[i])
        ending, duration = alone.outcome()[:2]
        assert results[0][0, i] == ending
        within = times if ending == 2 else times[times <= duration]
        np.testing.assert_array_equal(readings["states"][i, : within.size].T, alone.state_at(within))
        np.testing.assert_array_equal(readings["tangents"][i, : within.size], alone.tangents(within, columns)[1])
        assert np.isnan(readings["states"][i, within.size :]).all()
        assert np.isnan(readings["tangents"][i, within.size :]).all()
        np.testing.assert_array_equal(readings["sensitivities"][i], alone.sensitivities(columns))
        assert readings["compressions"][i] == alone.compression_max()
        if events:
            listed = [(t, k) for lanes, ts, ks in found for j, t, k in zip(lanes, ts, ks, strict=True) if j == i]
            assert listed == [(t, k) for t, k in alone.events() if k != 0]
    assert not readings["reading_status"].any()


def test_steps_that_all_stances_share_have_no_stride(hopper_c, compiled):
    v2, u = np.linspace(-2.5, -0.5, 5), np.broadcast_to([u for _, u in STEPS], (5, len(STEPS)))
    readings = {"sensitivities": np.empty((5, 7, 22))}
    asked = Asked(np.array([t for t, _ in STEPS]))
    batch(compiled, hopper_c.parameters, u, asked, readings, 2.0, v2)
    for i in range(5):
        alone = solved(compiled, hopper_c.parameters, STEPS, 2.0, v2[i])
        np.testing.assert_array_equal(readings["sensitivities"][i], alone.sensitivities())


def test_inputs_that_do_not_fit_the_steps_are_refused(hopper_c, compiled):
    for u, asked in (
        (np.ones((5, 3)), Asked(np.array([0.0, 0.1]))),
        (np.ones((5, 2)), Asked()),
    ):
        with pytest.raises(hopform.HopformError, match=r"u has \d inputs? of steps"):
            batch(compiled, hopper_c.parameters, u, asked, {"compressions": np.empty(5)}, 2.0, np.full(5, -1.0))


PRECISIONS = pytest.mark.parametrize("dtype", [np.dtype(np.float32), np.dtype(np.float64)], ids=str)


@PRECISIONS
def test_no_column_and_no_time_are_read_as_nothing(hopper_c, compiled, dtype):
    start = LegState(0.0, 0.0, -1.9, 0.0)
    found = compiled.solve_stance(hopper_c.parameters, start, STEPS, 2.0, 64, dtype)
    times = np.array([0.0, 0.02, 0.1], dtype)
    np.testing.assert_array_equal(found.tangents(times, [7, 0])[1], found.tangents(times)[1][..., [7, 0]])
    assert found.tangents(times, [])[1].shape == (3, 4, 0)
    assert found.tangents(times[:0], [7])[0].x1.size == 0


@PRECISIONS
def test_a_stance_that_rests_is_followed_beyond_its_ending(hopper_c, compiled, dtype):
    start = LegState(0.0, 0.0, -0.02, 0.03)
    found = compiled.solve_stance(hopper_c.parameters, start, ((0.0, 0.0),), 5.0, 64, dtype)
    ending, duration = found.outcome()[:2]
    assert package.STATUS[ending] == "rest"
    at = np.array([duration, duration + 1.0, duration + 2.0], dtype)
    states, tangents = found.tangents(at, [7, 4])
    assert (np.array(states)[:, 1:] == np.array(states)[:, :1]).all() and np.isfinite(tangents).all()


@PRECISIONS
def test_a_fall_whose_square_is_no_number_has_no_derivative(hopper_c, compiled, dtype):
    """The apex's derivative by g divides by it."""
    robot = hopper_c.with_parameters({"g": 0.1 * float(np.finfo(dtype).smallest_subnormal) ** 0.5})
    found = compiled.solve_stance(robot.parameters, LegState(0.0, 0.0, -1.9, 0.0), STEPS, 2.0, 64, dtype)
    assert package.STATUS[found.outcome()[0]] == "takeoff"
    assert np.isnan(found.sensitivities([0])).all()


FLIGHTS = {
    "returns by gains": ((0.01, 0.2, 1.5), 0.0, (2000.0, 200.0), 10.0, "touchdown"),
    "hits the upper stop": ((0.999, 2.0, 1.5), 0.0, (0.0, 0.0), 10.0, "touchdown"),
    "hits the lower stop": ((-0.999, -2.0, 1.5), 0.0, (0.0, 0.0), 10.0, "touchdown"),
    "does not get above the ground": ((0.01, 0.0, 1.5), 0.5, None, 10.0, "tripped"),
    "is short": ((0.01, 0.0, 0.2), 0.0, None, 10.0, "touchdown"),
    "is still in the air": ((0.01, 0.0, 1.5), 0.0, None, 0.05, "horizon"),
}
"""x1 over the stroke, v1, v2; ground, gains, horizon, ending."""


@PRECISIONS
@pytest.mark.parametrize("kind", FLIGHTS)
def test_columns_of_a_flight_are_those_of_all_in_either_precision(hopper_c, compiled, dtype, kind):
    (x1, v1, v2), ground, gains, horizon, ending = FLIGHTS[kind]
    robot = hopper_c.with_parameters({"x1_min": -0.02, "x1_max": 0.02, "f1": 0.0})
    start = LegState(0.02 * x1, v1, v2, 0.0)
    law = None if gains is None else package.Gains(*gains)
    flight = compiled.solve_flight(robot.parameters, start, ground, law, horizon, 64, dtype)
    assert package.FLIGHT_STATUS[flight.flight.ending] == ending
    every = flight.sensitivities(tuple(range(len(package.OURS.elements.FLIGHT_COLUMNS))))
    np.testing.assert_array_equal(flight.sensitivities((3, 1)), every[:, [3, 1]])
    assert flight.call("flight_sensitivities", (ctypes.c_int32 * 1)(), ctypes.c_int32(0), None) == 0
    same = (ctypes.c_int32 * 64)(1)
    with pytest.raises(hopform.HopformError, match="overlaps"):
        flight.call("flight_sensitivities", same, ctypes.c_int32(1), same)


@PRECISIONS
def test_a_return_within_no_time_has_no_gains(hopper_c, compiled, dtype):
    types = compiled.library.types(dtype)
    least, gains = types.real(float(np.finfo(dtype).tiny)), types.Gains(1.0, 1.0)
    with pytest.raises(hopform.HopformError, match="out of the range"):
        compiled.library.call("design_return", types, plan_of(types, hopper_c.parameters), least, ctypes.byref(gains))
    assert (gains.Kp, gains.Kd) == (0.0, 0.0)
