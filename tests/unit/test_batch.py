"""Many stances at once are the same stances, whatever the shapes, strides, process or machinery around them."""

import doctest
import os
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import hopform
from hopform import HopformError, Robot
from hopform._solver.package import CHUNK, STATUS
from hopform_solver.records import EVENTS, ROBOT_FIELDS
from tests import needs
from tests.columns import solved
from tests.conformance.random_stances import draw_stances

HOPPER = hopform.load_robot("hopper_c")
VECTOR = np.array(HOPPER.parameters)
NAMES = [field.name for field in ROBOT_FIELDS]


def random_inputs(count: int, seed: int) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """States and currents, and robots of all kinds: a third without viscous friction, a third without stops."""
    rng = np.random.default_rng(seed)
    states = {"v2": rng.uniform(-4, 1, count), "v1": rng.normal(0, 0.5, count) * (rng.random(count) > 0.5)}
    states |= {"u": rng.uniform(-3, 3, count), "x1": rng.uniform(0.0, 0.05, count)}
    robots = {name: 10.0 ** rng.uniform(-1, 2, count) for name in ("m_eff", "m_s")}
    robots["k"] = 10.0 ** rng.uniform(1, 6, count)
    robots |= {name: 10.0 ** rng.uniform(-2, 3, count) * (rng.random(count) > 0.33) for name in ("b1", "b2")}
    robots |= {name: rng.uniform(0, 3, count) * (rng.random(count) > 0.2) for name in ("f1", "f2")}
    robots["gamma2"] = rng.uniform(-50, 50, count)
    robots["x1_min"] = np.where(rng.random(count) > 0.33, 0.0, -np.inf)
    robots["x1_max"] = np.where(rng.random(count) > 0.33, 0.05, np.inf)
    return states, robots


def singly(states, robots, **how) -> list[hopform.Stance]:
    """The same stances one by one."""
    lanes = range(len(next(iter(states.values()))))
    base = {name: getattr(HOPPER, name) for name in NAMES}
    return [
        hopform.solve_stance(
            Robot(**(base | {name: float(value[i]) for name, value in robots.items()})),
            **{name: float(value[i]) for name, value in states.items()},
            **how,
        )
        for i in lanes
    ]


# ---- the same stances ----


def refuse_difference(batch, single) -> None:
    """AssertionError where a batch with its events has other bits than these stances."""
    assert batch.words.tolist() == [stance.status for stance in single]
    for name in ("duration", "aed", "apex"):
        np.testing.assert_array_equal(getattr(batch, name), [getattr(stance, name) for stance in single], err_msg=name)
    for name in hopform.State._fields:
        np.testing.assert_array_equal(getattr(batch.end, name), [getattr(stance.end, name) for stance in single])
    assert batch.event_count.tolist() == [len(stance.events) for stance in single]
    if batch.event_time is not None:
        assert batch.event_time.shape == (len(single), batch.event_count.max())
        for row, stance in enumerate(single):
            count = len(stance.events)
            assert batch.event_time[row, :count].tolist() == [event.time for event in stance.events]
            assert batch.event_words[row, :count].tolist() == [event.kind for event in stance.events]
            assert np.all(np.isnan(batch.event_time[row, count:])) and not batch.event_kind[row, count:].any()


@needs.library
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("how", [{}, {"events": True}, {"max_phases": 3}, {"events": True, "max_phases": 3}])
def test_a_batch_is_its_stances_to_the_last_bit(dtype, how):
    states, robots = random_inputs(200, 1)
    batch = hopform.solve_stances(HOPPER, **states, **robots, dtype=dtype, **how)
    single = singly(states, robots, dtype=dtype, max_phases=how.get("max_phases", 4096))
    assert batch.duration.dtype == dtype
    refuse_difference(batch, single)


@needs.library
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_a_few_stances_are_those_stances_however_they_are_written(count, dtype):
    """Each input is an array, one with gaps or a list; of equal numbers also a number, or an array of one."""
    rng = np.random.default_rng(count)
    for seed in range(30):
        states, robots = random_inputs(count, 100 * count + seed)
        for of in (states, robots):
            of |= {name: np.full(count, values[0]) for name, values in of.items() if rng.random() < 0.5}
        single = singly(states, robots, dtype=dtype)

        def written(values):
            ways = [np.array, lambda values: np.repeat(values, 3)[::3], np.ndarray.tolist]
            ways += [lambda values: values[:1], lambda values: float(values[0])] if len({*values}) == 1 else []
            return ways[rng.integers(len(ways))](values)

        others = {name: written(values) for name, values in (states | robots).items() if name != "v2"}
        kept = hopform.solve_stances(HOPPER, v2=states["v2"], **others, dtype=dtype, events=True)
        refuse_difference(kept, single)


@needs.library
@pytest.mark.parametrize("count", [None, 1, 4])
def test_a_few_stances_cost_what_stances_cost(count):
    """By the calls of functions that they make, which are the same on every machine, of Python and of C alike."""

    def calls(solve):
        made = [0]
        solve()  # what is imported, and kept, the first time
        sys.setprofile(lambda _frame, event, _function: made.__setitem__(0, made[0] + event.endswith("call")))
        try:
            solve()
        finally:
            sys.setprofile(None)
        return made[0]

    v2 = -1.9 if count is None else np.full(count, -1.9)
    one = calls(lambda: hopform.solve_stance(HOPPER, v2=-1.9, u=2.0))
    batch = calls(lambda: hopform.solve_stances(HOPPER, v2=v2, u=2.0))
    assert 20 < one < batch < 10 * one, (one, batch)


def test_the_robots_above_do_all_that_robots_do():
    """Or the tests above and below would compare little."""
    states, robots = random_inputs(2000, 1)
    batch = hopform.solve_stances(HOPPER, **states, **robots, events=True)
    assert {"takeoff", "rest", "horizon"} <= set(batch.words.tolist())
    assert set(batch.event_words.ravel().tolist()) == {"", *EVENTS.values()}
    assert batch.event_count.max() > 16


def test_lists_of_events_may_be_long():
    """A stiff leg that rings down, much longer than the first room for its events, beside one without."""
    robot = Robot(m_eff=2.0, m_s=3.0, k=2e4, L0=0.4, b1=40.0, b2=0.5, f1=2.0, f2=0.01, x1_min=-0.002)
    batch = hopform.solve_stances(robot, v2=[0.0, -2.0, 0.0], x1=-0.002, x2=[0.3972, 0.398, 0.3972], events=True)
    single = hopform.solve_stance(robot, v2=0.0, x1=-0.002, x2=0.3972)
    assert len(single.events) > 40
    assert batch.event_count[0] == batch.event_count[2] == len(single.events)
    for row in (0, 2):
        assert batch.event_time[row].tolist() == [event.time for event in single.events]
    assert np.isnan(batch.event_time[1, batch.event_count[1] :]).all()


def test_without_a_takeoff_there_is_none():
    batch = hopform.solve_stances(HOPPER, v2=[-1.9, -1.9], b2=[5.0, 5000.0])
    assert batch.words.tolist()[0] == "takeoff" != batch.words.tolist()[1]
    for value, end in zip(batch.takeoff, batch.end, strict=True):
        assert np.isnan(value).tolist() == [False, True]
        assert value[0] == end[0] and np.isfinite(end[1])
    assert np.isnan(batch.apex).tolist() == [False, True]


# ---- shapes and strides ----


def test_everything_broadcasts():
    batch = hopform.solve_stances(
        HOPPER,
        v2=np.linspace(-3, -1, 4),
        u=[[0.0], [2.0], [3.0]],
        k=np.full((2, 1, 1), 1200.0),
        events=True,
    )
    assert batch.status.shape == batch.duration.shape == batch.end.x2.shape == batch.apex.shape == (2, 3, 4)
    assert batch.event_time.shape[:-1] == (2, 3, 4)
    one = hopform.solve_stance(HOPPER, v2=float(np.linspace(-3, -1, 4)[2]), u=2.0)
    assert batch.duration[1, 1, 2] == pytest.approx(one.duration, rel=1e-12)
    assert hopform.solve_stances(HOPPER, v2=-1.0).apex.shape == ()


@pytest.mark.parametrize("shape", [(0,), (3, 0), (0, 2, 2)])
@pytest.mark.parametrize("events", [False, True])
def test_a_batch_may_be_empty(shape, events):
    batch = hopform.solve_stances(HOPPER, v2=np.empty(shape), events=events)
    assert batch.status.shape == batch.takeoff.x2.shape == batch.words.shape == shape
    assert not events or batch.event_time.shape == (*shape, 0)


def strided(values: np.ndarray, kind: str) -> np.ndarray:
    """The same values in another place."""
    if kind == "fortran":
        return np.asfortranarray(values)
    if kind == "backwards":
        return np.ascontiguousarray(values[::-1, ::-1])[::-1, ::-1]
    if kind == "every third":
        return np.repeat(values, 3, axis=-1)[..., ::3]
    if kind == "a field of records":
        records = np.zeros(values.shape, [("other", np.int8), ("value", values.dtype)])
        records["value"] = values
        return records["value"]
    raise ValueError(kind)


@pytest.mark.parametrize("kind", ["fortran", "backwards", "every third", "a field of records"])
@pytest.mark.parametrize("how", [{}, {"events": True}, {"dtype": np.float32}])
def test_strides_do_not_matter(kind, how):
    states, robots = random_inputs(60, 3)
    plain = {name: value.reshape(6, 10) for name, value in (states | robots).items()}
    expected = hopform.solve_stances(HOPPER, **plain, **how)
    batch = hopform.solve_stances(HOPPER, **{name: strided(value, kind) for name, value in plain.items()}, **how)
    for field in ("status", "duration", "apex", "aed", "event_count"):
        assert np.array_equal(getattr(batch, field), getattr(expected, field), equal_nan=True)
    assert not how.get("events") or np.array_equal(batch.event_time, expected.event_time, equal_nan=True)


def test_a_stance_that_is_refused_is_not_a_number_and_spoils_no_other():
    bad = {
        "robot_refused": (0.0, 0.0, -2.0, 0.0, 0.0, 2.0, VECTOR * np.where(np.arange(VECTOR.size) == 1, -1.0, 1.0)),
        "state_refused": (0.0, np.nan, -2.0, 0.0, 0.0, 2.0, VECTOR),
        "spring_pulls": (0.0, 0.0, -2.0, -0.01, 0.0, 2.0, VECTOR),
        "current_refused": (0.0, 0.0, -2.0, 0.0, np.inf, 2.0, VECTOR),
        "horizon_refused": (0.0, 0.0, -2.0, 0.0, 0.0, 0.0, VECTOR),
        "takeoff": (0.0, 0.0, -2.0, 0.0, 0.0, 2.0, VECTOR),
    }
    *states, robots = (np.array(column) for column in zip(*bad.values(), strict=True))
    got = solved(*states, robots=robots)
    assert [STATUS[int(code)] for code in got["status"]] == list(bad)
    numbers = [values for name, values in got.items() if name not in ("status", "event_count")]
    assert all(np.isnan(values[:-1]).all() and np.isfinite(values[-1]) for values in numbers)
    alone = solved(*(state[-1:] for state in states), robots=robots[-1:])
    assert got["event_count"].tolist() == [0, 0, 0, 0, 0, int(alone["event_count"][0])]


def test_numbers_that_leave_the_range_of_the_precision_are_said():
    batch = hopform.solve_stances(HOPPER, v2=[-2.0, -1e30], dtype=np.float32, events=True)
    assert batch.words.tolist() == ["takeoff", "out_of_range"]
    assert np.isfinite(batch.duration[0]) and np.isnan(batch.duration[1]) and np.isnan(batch.end.x2[1])
    assert batch.event_count[1] == 0 and not batch.event_kind[1].any()


# ---- bad input ----


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"v2": [-1.0, np.nan]}, r"v2\[1\] must be finite m/s, got nan"),
        ({"v2": -1.0, "u": [[0.0, 1.0], [np.inf, 1.0]]}, r"u\[1, 0\] must be finite A, got inf"),
        ({"v2": "fast"}, "v2 must be numbers in m/s, got 'fast'"),
        ({"v2": [-1.0, None]}, "v2 must be numbers in m/s"),
        ({"v2": [[1.0], [1.0, 2.0]]}, "v2 must be numbers in m/s"),
        ({"v2": -1.0, "u": [(0.0, 1.0), (0.1, 2.0)]}, "steps .* are for solve_stance"),
        ({"v2": -1.0, "m_s": [3.0, -3.0]}, r"m_s\[1\] must be > 0 kg, got -3.0"),
        ({"v2": -1.0, "impact_loss": 1.0}, "impact_loss must be >= 0 and < 1, got 1.0"),
        ({"v2": -1.0, "k": [1.0, np.inf]}, r"k\[1\] must be > 0 N/m, got inf"),
        ({"v2": -1.0, "x1_max": [0.1, -0.1]}, r"x1_min\[1\] must be <= x1_max m"),
        ({"v2": -1.0, "mass": 3.0}, "'mass' is neither"),
        ({"v2": -1.0, "x1": [0.0, 0.5]}, r"x1\[1\] must be within its stroke 0.0 .. 0.08 m, got 0.5"),
        ({"v2": -1.0, "x2": [0.39, 0.41]}, r"x2\[1\] must be <= x1 \+ L0 \+ c"),
        ({"v2": -1.0, "horizon": [1.0, 0.0]}, r"horizon\[1\] must be > 0 s, got 0.0"),
        ({"v2": [1.0, 2.0], "u": [1.0, 2.0, 3.0]}, "must broadcast"),
        ({"v2": [1.0, 2.0], "k": [1.0, 2.0, 3.0]}, "must broadcast"),
        ({"v2": -1.0, "max_phases": 0}, "max_phases must be a whole number >= 1, got 0"),
        ({"v2": -1.0, "threads": 0}, "threads must be a whole number >= 1, got 0"),
        ({"v2": -1.0, "dtype": int}, "dtype must be float64 or float32"),
    ],
)
def test_what_cannot_be_is_refused_by_name_index_and_value(arguments, words):
    with pytest.raises(HopformError, match=words):
        hopform.solve_stances(HOPPER, **arguments)


# ---- long batches ----


LONG = 3 * CHUNK // 2


@pytest.mark.parametrize("threads", [1, 2])
def test_progress_is_reported_and_threads_change_nothing(threads):
    v2, seen = np.linspace(-3.0, -0.5, LONG), []
    batch = hopform.solve_stances(
        HOPPER, v2=v2, threads=threads, events=True, progress=lambda done, total: seen.append((done, total))
    )
    assert seen[-1] == (LONG, LONG) and len(seen) == 2
    alone = hopform.solve_stances(HOPPER, v2=v2[-5:], events=True)
    assert np.array_equal(batch.duration[-5:], alone.duration)
    assert np.array_equal(batch.event_time[-5:, : alone.event_time.shape[1]], alone.event_time, equal_nan=True)


@pytest.mark.parametrize("threads", [1, 2])
def test_an_interrupt_ends_a_batch_at_once(threads):
    seen = []

    def interrupt(done: int, total: int) -> None:
        seen.append(done)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        hopform.solve_stances(HOPPER, v2=np.full(20 * CHUNK, -0.5), threads=threads, progress=interrupt)
    assert seen == [CHUNK]
    assert hopform.solve_stances(HOPPER, v2=-2.0).words == "takeoff"


@needs.library
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the memory of a process is read from /proc")
def test_a_million_stances_need_little_memory():
    code = (
        "import numpy as np, hopform\n"
        "v2, robot = np.linspace(-3, -1, 10**6), hopform.load_robot('hopper_c')\n"
        "batch = hopform.solve_stances(robot, v2=v2, horizon=1e-6)\n"
        "assert batch.apex.shape == (10**6,)\n"
        "print(next(line.split()[1] for line in open('/proc/self/status') if line.startswith('VmHWM')))\n"
    )  # the most that this process had: ru_maxrss has that of the one which began it
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 1024 * int(done.stdout) <= 0.15e9


# ---- other processes, other engines ----


def test_xarray_takes_it():
    xarray = pytest.importorskip("xarray")
    dask_array = pytest.importorskip("dask.array")
    v2, u = np.linspace(-3.0, -1.0, 20), np.array([0.0, 1.0, 3.0])
    apex = xarray.apply_ufunc(
        lambda v2, u: hopform.solve_stances(HOPPER, v2=v2, u=u).apex,
        xarray.DataArray(dask_array.from_array(v2, chunks=7), dims="v2", coords={"v2": v2}),
        xarray.DataArray(u, dims="u", coords={"u": u}), dask="parallelized", output_dtypes=[float],
    )  # fmt: skip
    assert apex.dims == ("v2", "u") and apex.chunks is not None
    expected = hopform.solve_stances(HOPPER, v2=v2[:, np.newaxis], u=u)
    assert np.array_equal(apex.compute(), expected.apex, equal_nan=True)


def slow_apex(v2: np.ndarray, folder: str) -> np.ndarray:
    """The apex, and a mark of the process that found it, so that the test knows whom to kill."""
    (Path(folder) / str(os.getpid())).touch()
    time.sleep(0.3)
    return np.asarray(hopform.solve_stances(HOPPER, v2=v2, u=2.0).apex)


@pytest.mark.sliced
def test_a_sweep_survives_the_death_of_a_worker(tmp_path):
    distributed = pytest.importorskip("distributed")
    v2 = np.linspace(-3.0, -1.0, 4000)
    parts = np.array_split(v2, 12)
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None,
            local_directory=str(tmp_path / "dask"),
        ) as cluster,
        distributed.Client(cluster) as client,
    ):  # fmt: skip
        folder = tmp_path / "marks"
        folder.mkdir()
        futures = client.map(slow_apex, parts, folder=str(folder))
        distributed.wait(futures[:3], return_when="ALL_COMPLETED", timeout=30)
        assert not all(future.done() for future in futures), "the sweep was over before the worker died"
        victim = int(next(folder.iterdir()).name)
        assert victim != os.getpid()
        os.kill(victim, 9)
        found = np.concatenate(client.gather(futures))
        survivors = {int(mark.name) for mark in folder.iterdir()}
    assert len(survivors) >= 2
    assert np.array_equal(found, hopform.solve_stances(HOPPER, v2=v2, u=2.0).apex)


def test_the_page_on_batches_says_what_is_computed():
    page = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "many-stances.md"
    assert doctest.testfile(str(page), module_relative=False) == doctest.TestResults(failed=0, attempted=13)


# ---- the C of a batch ----


@needs.library
def test_threads_and_order_change_no_bit(hopper_c):
    v2 = np.linspace(-3.0, -1.0, 3 * CHUNK + 5)
    one = hopform.solve_stances(hopper_c, v2=v2, u=2.0)
    two = hopform.solve_stances(hopper_c, v2=v2, u=2.0, threads=2)
    reverse = hopform.solve_stances(hopper_c, v2=v2[::-1], u=2.0)
    for field in ("status", "duration", "apex", "aed", "event_count"):
        assert getattr(one, field).tobytes() == getattr(two, field).tobytes()
        assert getattr(one, field).tobytes() == getattr(reverse, field)[::-1].tobytes()


@needs.library
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_batch_raises_no_flag_of_the_processor(dtype):
    problems = draw_stances(11, 500)
    inputs = [problems[name].astype(dtype) for name in ("x1", "v1", "v2", "y", "u", "horizon")]
    robots = np.stack([problems[field.name].astype(dtype) for field in ROBOT_FIELDS], axis=-1)
    with np.errstate(all="raise"):
        results = solved(*inputs, robots=robots)
    assert np.isfinite(results["duration"]).all()


def calls_of(function: Callable[[], object]) -> int:
    """How many functions a call of one makes: what it costs without a clock."""
    count, found = 0, function()

    def note(frame: object, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(note)
    try:
        found = function()
    finally:
        sys.setprofile(None)
    assert found is not None
    return count


def test_a_batch_of_one_calls_at_most_five_times_as_much_as_the_one():
    one = calls_of(lambda: hopform.solve_stance(HOPPER, v2=-1.93, u=2.0))
    batch = calls_of(lambda: hopform.solve_stances(HOPPER, v2=-1.93, u=2.0))
    assert batch <= 5 * one < 200


@pytest.mark.parametrize(("name", "most"), [("events", 3), ("phases", 15)])
def test_what_happened_is_read_from_the_memory_of_the_library(name, most):
    """By few calls for each further event, or phase: no object in between."""
    short, long = (hopform.solve_stance(HOPPER, v2=v2) for v2 in (-1.93, -0.2))
    few, many = (len(getattr(stance, name)) for stance in (short, long))

    def read(stance: hopform.Stance) -> object:
        vars(stance).pop(name)
        return getattr(stance, name)

    more = calls_of(partial(read, long)) - calls_of(partial(read, short))
    assert many >= few + 5 and more <= most * (many - few)
