"""Flights in batches: each is that of `solve_flight`, to the bit, with events, states at times and derivatives."""

import ctypes
import dataclasses
import math
from typing import Any

import numpy as np
import pytest

import hopform
from hopform._solver.c import layout, plan_of, pointer
from hopform._solver.package import NUMBERS
from tests.derived import solver_of

HOPPER = hopform.load_robot("hopper_c")
V2 = np.array([[0.4], [1.2], [1.9]])
X1 = np.array([0.0, 0.03, 0.075])
TIMES = np.array([0.0, 0.0, 0.05, 0.3, 0.9])
KINDS: dict[str, dict[str, Any]] = {
    "flat": {},
    "a step": {"x2": np.array([[0.41], [0.45], [0.6]])},
    "given gains": {"gains": (np.array([4e3, 9e3, 3e5]), 300.0)},
    "robots": {"m_eff": np.array([[5.0], [25.0], [60.0]]), "f1": [0.0, 0.5, 3.0]},
    "horizon": {"horizon": np.array([[0.05], [0.2], [3.0]])},
}


def of(value: Any, i: int, j: int) -> Any:
    return float(np.broadcast_to(value, (3, 3))[i, j])


def alone(kind: dict[str, Any], i: int, j: int, dtype: Any) -> hopform.Flight:
    fields = {name: of(value, i, j) for name, value in kind.items() if hasattr(HOPPER, name)}
    others = {name: of(value, i, j) for name, value in kind.items() if name in ("x2", "horizon")}
    gains = {"gains": tuple(of(gain, i, j) for gain in kind["gains"])} if "gains" in kind else {}
    start = {"v2": float(V2[i, 0]), "x1": float(X1[j]), "v1": 0.3}
    return hopform.solve_flight(dataclasses.replace(HOPPER, **fields), **start, **others, **gains, dtype=dtype)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS.keys())
def test_each_flight_is_that_of_solve_flight_to_the_bit(kind, dtype):
    flights = hopform.solve_flights(
        HOPPER, v2=V2, x1=X1, v1=0.3, times=TIMES, events=True, sensitivities=True, dtype=dtype, **kind
    )
    assert flights.status.shape == (3, 3) and flights.duration.dtype == dtype
    for i, j in np.ndindex(3, 3):
        flight = alone(kind, i, j, dtype)
        assert flights.words[i, j] == flight.status
        for name in ("duration", "apex", "apex_time", "impact_loss", "leg_loss"):
            assert getattr(flights, name)[i, j] == getattr(flight, name), name
        assert [value[i, j] for value in flights.end] == [*flight.end]
        assert [value[i, j] for value in flights.gains] == [*flight.gains]
        after = flight.touchdown or flight.end._replace(**dict.fromkeys(flight.end._fields, math.nan))
        np.testing.assert_array_equal([value[i, j] for value in flights.touchdown], after)
        listed = [event for event in zip(flights.event_time[i, j], flights.event_words[i, j], strict=True) if event[1]]
        assert listed == [(event.time, event.kind) for event in flight.events]
        known = flight.duration >= TIMES.astype(dtype)
        states = np.array([value[i, j] for value in flights.states])
        np.testing.assert_array_equal(states[:, known], [*flight.at(TIMES[known])])
        assert np.isnan(states[:, ~known]).all()
        np.testing.assert_array_equal(flights.sensitivities.matrix[i, j], flight.sensitivities.matrix)


def test_columns_are_those_that_were_asked_for():
    every = hopform.solve_flights(HOPPER, v2=V2, x1=X1, x2=0.42, sensitivities=True).sensitivities
    some = hopform.solve_flights(HOPPER, v2=V2, x1=X1, x2=0.42, sensitivities=("L0", "Kp", "x2", "f1")).sensitivities
    assert some.columns == ("L0", "Kp", "x2", "f1")
    for name in some.columns:
        np.testing.assert_array_equal(some["T", name], every["T", name])
    np.testing.assert_array_equal(every["T", "x2"], -every["T", "ground"])
    assert hopform.solve_flights(HOPPER, v2=V2).sensitivities is None


@pytest.mark.parametrize("x2", [None, 0.43])
@pytest.mark.parametrize("compression", [None, 0.004])
def test_derivatives_of_a_leg_that_relaxes_are_those_of_differences(store, compression, x2):
    leg = solver_of(store, "leg_damper")
    robot = dataclasses.replace(leg.load_robot("hopper_c"), b12=12.0)
    given = {"x1": 0.05, "v1": 0.3, "v2": 1.9}
    given |= {name: value for name, value in (("x2", x2), ("compression", compression)) if value is not None}
    flight = leg.solve_flight(robot, **given)
    for column in ("x1", "v1", "v2", "b12", "k", "L0", "c", "g", *(() if x2 is None else ("x2",))):
        ends = []
        for step in (-1e-6, 1e-6):
            start = {**given, column: given[column] + step} if column in given else given
            moved = robot if column in given else dataclasses.replace(robot, **{column: getattr(robot, column) + step})
            other = leg.solve_flight(moved, **start)
            ends.append([other.duration, other.end.x1, other.end.x2, other.apex])
        ours = [flight.sensitivities[row, column] for row in ("T", "x1", "x2", "apex")]
        assert np.subtract(ends[1], ends[0]) / 2e-6 == pytest.approx(ours, rel=1e-5, abs=2e-8), column


def test_many_events_and_phases_are_listed():
    rings = dataclasses.replace(HOPPER, b1=0.0, f1=0.0, u_max=1e4, x1_min=-1.0, x1_max=1.0)
    flights = hopform.solve_flights(rings, v2=[1.9, 0.1], x1=0.05, gains=(3e6, 0.0), events=True, sensitivities=("g",))
    one = hopform.solve_flight(rings, v2=1.9, x1=0.05, gains=(3e6, 0.0))
    assert len(one.events) > 40 and flights.event_count.tolist()[0] == len(one.events)
    assert flights.event_time[0].tolist() == [event.time for event in one.events]
    assert flights.sensitivities["T", "g"][0] == one.sensitivities["T", "g"]


def test_threads_give_the_same_and_progress_hears_of_all():
    heard: list[tuple[int, int]] = []
    v2 = np.linspace(0.3, 2.0, 40000)
    both = [
        hopform.solve_flights(
            HOPPER, v2=v2, x1=0.02, sensitivities=("v2",), threads=n, progress=lambda *at: heard.append(at)
        )
        for n in (1, 2)
    ]
    assert both[0] == both[1]
    assert heard[-1] == (40000, 40000)


def test_shapes():
    none = hopform.solve_flights(HOPPER, v2=np.zeros(0), events=True, times=[0.1], sensitivities=True)
    assert none.states.x1.shape == (0, 1) and none.sensitivities.matrix.shape[0] == 0
    one = hopform.solve_flights(HOPPER, v2=1.9, times=[])
    assert one.duration.shape == () and one.states.x1.shape == (0,)


def test_a_flight_that_was_refused_leaves_its_neighbours_alone():
    flights = hopform.solve_flights(HOPPER, v2=[1.9, 1e308, 1.9], x1=0.05, sensitivities=True, times=[0.1], events=True)
    assert flights.words.tolist() == ["touchdown", "state_refused", "touchdown"]
    assert np.isnan(flights.sensitivities.matrix).all(axis=(1, 2)).tolist() == [False, True, False]
    assert np.isnan(flights.duration).tolist() == np.isnan(flights.states.x1[:, 0]).tolist() == [False, True, False]


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"times": [0.1, 0.05]}, r"times\[1\] must not decrease, got 0.05 s"),
    ({"times": [-0.1]}, r"times\[0\] must be >= 0 s, got -0.1"),
    ({"times": [[0.1]]}, "times must be of one dimension, got 2"),
    ({"times": [math.nan]}, r"times\[0\] must be finite s"),
    ({"gains": (1.0, [2.0, -1.0])}, r"Kd\[1\] must be >= 0 N s/m, got -1.0"),
    ({"gains": 3.0}, "gains"),
    ({"sensitivities": ("K_p",)}, "sensitivities must be True, False or names among x1, .*, got 'K_p'"),
    ({"sensitivities": ("k", "k")}, "sensitivities must have each name once, got 'k' twice"),
    ({"sensitivities": "k"}, "sensitivities must be"),
    ({"x1": [0.0, 0.9]}, r"x1\[1\] must be"),
    ({"horizon": [1.0, 0.0]}, r"horizon\[1\] must be > 0 s, got 0.0"),
    ({"g": [9.81, 0.0]}, r"a flight\[1\] needs g > 0 m/s\^2, got 0.0"),
    ({"u": 3.0}, "'u' is neither an input of a flight nor a field of the robot"),
    ({"v1": np.zeros(2), "x2": np.zeros(3)}, "the shapes of the inputs must broadcast"),
    ({"max_phases": 0}, "max_phases must be a whole number >= 1"),
]


@pytest.mark.parametrize(("wrong", "message"), REFUSED, ids=[str(each[0]) for each in REFUSED])
def test_what_is_wrong_is_named(wrong, message):
    with pytest.raises(hopform.HopformError, match=message):
        hopform.solve_flights(HOPPER, **({"v2": 1.9} | wrong))


def test_a_batch_has_the_coordinates_of_its_inputs():
    xarray = pytest.importorskip("xarray")
    heights = xarray.DataArray([0.41, 0.45], dims="step", coords={"step": [0.0, 0.05]})
    speeds = xarray.DataArray([1.0, 1.9, 2.2], dims="speed")
    flights = hopform.solve_flights(HOPPER, v2=speeds, x2=heights, times=[0.0, 0.1], events=True, sensitivities=("Kp",))
    found = flights.to_xarray()
    assert found.duration.dims == ("speed", "step") and found.x1.dims == ("speed", "step", "time")
    assert found.x2.attrs["units"] == "m" and found.Kp.attrs["units"] == "N/m" and found.time.attrs["units"] == "s"
    assert found.derivative.dims == ("speed", "step", "row", "column")


# ---- the library ----


def refusals_of(**changes: Any) -> tuple[int, dict[str, Any]]:
    """The status of a batch of two flights with something wrong about it, and what it left behind."""
    library = HOPPER.solver.compiled().library
    types = library.types(np.dtype(float))
    columns = {name: np.full(2, value) for name, value in {"v2": 1.9, "horizon": 3.0}.items()}
    values = (*HOPPER.parameters, 0.05, 0.0, 1.9, 0.0, 0.0, math.nan, math.nan, 3.0)
    numbers = np.array(values)
    places = [(numbers.ctypes.data + 8 * n, 0) for n in range(numbers.size)]
    places[-3:-1] = changes.get("gains", [(0, 0), (0, 0)])
    if "input" in changes:
        places[changes["input"]] = (0, 0)
    status, reals, count = np.zeros(2, np.int32), np.zeros((13, 2)), np.zeros(2, np.int32)
    if "overlap" in changes:
        places[0] = (reals[2].ctypes.data, 0)
    rows = [(status.ctypes.data, 4), *((row.ctypes.data, 8) for row in reals), (count.ctypes.data, 4)]
    phases, times = (types.FlightPhase * 9)(), np.array(changes.get("times", [0.1]))
    states, matrix = np.zeros((2, times.size, 4)), np.zeros((2, 7, 1))
    codes = np.array([changes.get("code", 0)], np.int32)
    inputs = layout(types.FlightsIn).pack(
        *(each for place in places for each in place), 100,
        times.ctypes.data, codes.ctypes.data, times.size, changes.get("count", 1),
    )  # fmt: skip
    outputs = layout(types.FlightsOut).pack(
        *(each for row in rows for each in row), ctypes.addressof(phases), changes.get("capacity", 9), 0, 0, 0,
        states.ctypes.data, matrix.ctypes.data,
    )  # fmt: skip
    found = library.function("solve_flights", types)(ctypes.c_int64(2), changes.get("in_", inputs), outputs)
    del columns
    return found, {"status": status, "reals": reals, "states": states, "matrix": matrix}


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"code": -1}, "error_columns"), ({"code": 25}, "error_columns"), ({"count": -1}, "error_columns"),
        ({"times": [0.2, 0.1]}, "error_time"), ({"times": [-0.1]}, "error_time"), ({"times": [math.nan]}, "error_time"),
        ({"input": 0}, "error_null"), ({"in_": None}, "error_null"), ({"gains": [(1, 0), (0, 0)]}, "error_null"),
        ({"overlap": True}, "error_overlap"),
    ],
)  # fmt: skip
def test_a_refused_batch_is_nan_and_the_status(changes, word):
    status, left = refusals_of(**changes)
    assert status == NUMBERS[word]
    assert (left["status"] == status).all()
    written = left["reals"][[0, 1, *range(3, 13)]] if "overlap" in changes else left["reals"]
    assert np.isnan(written).all()
    assert "in_" in changes or np.isnan(left["states"]).all()  # without inputs nobody knows how many are meant
    assert "in_" in changes or "count" in changes or np.isnan(left["matrix"]).all()


def test_a_batch_without_room_for_phases_says_so():
    status, left = refusals_of(capacity=1)
    assert status == NUMBERS["phases_not_kept"]
    assert np.isfinite(left["reals"]).all() and np.isnan(left["states"]).all() and np.isnan(left["matrix"]).all()


def test_one_flight_refuses_columns_that_are_none():
    library = HOPPER.solver.compiled().library
    types = library.types(np.dtype(float))
    solved = hopform.solve_flight(HOPPER, v2=1.9)._solved
    matrix, call = np.ones((7, 1)), library.function("flight_sensitivities", types)
    for codes, count, word in (([-1], 1, "error_columns"), ([25], 1, "error_columns"), ([0], -1, "error_columns")):
        chosen = (ctypes.c_int32 * 1)(*codes)
        assert call(*solved.structs, chosen, ctypes.c_int32(count), pointer(matrix)) == NUMBERS[word]
    assert call(*solved.structs, None, ctypes.c_int32(0), None) == NUMBERS["error_null"]
    assert call(*solved.structs, chosen, ctypes.c_int32(0), None) == 0
    whole = np.zeros((7, 25))
    assert call(*solved.structs, None, ctypes.c_int32(0), pointer(whole)) == 0
    assert whole[0, 3] != 0.0 and not whole[:, 4].any()
    assert plan_of(types, HOPPER.parameters) == solved.structs[0]
