"""A batch in vector registers gives the bits of its stances one by one: every variant, any company, any number."""

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import hopform
from hopform import ufuncs
from hopform._solver import c as native
from hopform_solver.records import ENDINGS, ROBOT_FIELDS
from tests import needs
from tests.conformance.random_stances import draw_stances
from tools.build_library import ROOT, compile_sources

pytestmark = needs.library

ONE_BY_ONE, BASELINE, AVX2, AVX512 = 1, 2, 3, 4
VARIANTS = {"baseline": BASELINE, "AVX2": AVX2, "AVX-512": AVX512}
ERROR_VARIANT = -11
UNCERTIFIED = next(number for number, word in ENDINGS.items() if word == "uncertified")
STATES = ("x1", "v1", "v2", "y", "u", "horizon")
NAMES = [field.name for field in ROBOT_FIELDS]
HOPPER = hopform.load_robot("hopper_c")


@dataclass(frozen=True)
class Answers:
    """What a variant writes, a row per stance: nine results, then the events."""

    status: int
    results: dict[str, np.ndarray]
    event_time: np.ndarray
    event_kind: np.ndarray

    def bits(self) -> list[bytes]:
        """Each stance's answer as bytes, so that -0 is not 0 and one NaN is another."""
        columns = [
            np.ascontiguousarray(column) for column in (*self.results.values(), self.event_time, self.event_kind)
        ]
        return [b"".join(column[i].tobytes() for column in columns) for i in range(len(self.event_time))]


def has(variant: int, suffix: str = "f64") -> bool:
    library = native.library()
    types = library.types(np.dtype(np.float32 if suffix == "f32" else np.float64))
    return library.call("has_variant", types, ctypes.c_int32(variant)) == 1


def solve(
    variant: int, problems: Any, dtype: Any, room: int = 8, max_phases: int = 100, step: int = 1, handle: Any = None
) -> Answers:
    """The problems by a variant; with `step` every column lies so many numbers apart from one stance to the next."""
    library, count = native.library(), len(problems)
    types = library.types(np.dtype(dtype))
    arguments, out = types.StancesIn(), types.StancesOut()
    kept = []

    def column(values: np.ndarray) -> tuple[int, int]:
        apart = np.full(max(1, count * step), np.nan, dtype)
        apart[: count * step : step] = values
        kept.append(apart)
        return apart.ctypes.data, step * apart.itemsize

    for name in STATES:
        setattr(arguments, name, column(problems[name]))
    for n, name in enumerate(NAMES):
        arguments.robot[n] = column(problems[name])
    arguments.max_phases = max_phases
    results = {
        name: np.full(count * step, 77, np.int32 if name in ufuncs.CODES else dtype)[::step] for name in ufuncs.RESULTS
    }
    for name, result in results.items():
        setattr(out, name, (result.ctypes.data, step * result.itemsize))
    times, kinds = np.zeros((count, room), dtype), np.full((count, room), 77, np.int8)
    phases = (types.Phase * (2 * room + 2))()
    if room:
        out.phases, out.phase_capacity = ctypes.addressof(phases), len(phases)
        out.event_time, out.event_kind, out.event_capacity = times.ctypes.data, kinds.ctypes.data, room
    function = getattr(handle or library._handle, f"hopform_solve_stances_by_{types.suffix}")
    status = function(ctypes.c_int32(variant), ctypes.c_int64(count), ctypes.byref(arguments), ctypes.byref(out))
    return Answers(int(status), results, times, kinds)


def same(one: Answers, other: Answers) -> bool:
    return one.status == other.status and one.bits() == other.bits()


def sweep(count: int) -> Any:
    """hopper_c, or a robot near it, over currents and touchdown velocities: most of it is solved in lanes."""
    p = draw_stances(0, count)
    for name in NAMES:
        p[name] = getattr(HOPPER, name)
    p["x1"], p["v1"], p["y"], p["horizon"] = 0.0, 0.0, 0.0, 2.0
    p["u"], p["v2"] = np.linspace(-3.0, 3.0, count), -1.0 - np.arange(count) % 7 / 3.0
    return p


HERE = [name for name, number in VARIANTS.items() if "c" in hopform.backends() and has(number)]


@pytest.fixture(params=HERE)  # those of this processor
def variant(request) -> int:
    return VARIANTS[request.param]


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_random_and_degenerate_stances_have_the_same_bits(variant, dtype, seed=20261):
    problems = draw_stances(seed, 3000)
    expected = solve(ONE_BY_ONE, problems, dtype)
    assert len(set(expected.results["status"].tolist())) >= 4
    assert same(solve(variant, problems, dtype), expected)


@pytest.fixture(scope="module")
def bounded(tmp_path_factory) -> Any:
    """A library that certifies one interval of a phase at most."""
    target = tmp_path_factory.mktemp("bounded") / "bounded.so"
    compile_sources(ROOT / "generated" / "c", target, "-O1", "-DHOPFORM_MOST_INTERVALS=1")
    return ctypes.CDLL(str(target))


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_where_the_bound_on_intervals_is_met_the_bits_are_the_same(variant, dtype, bounded):
    problems = draw_stances(20262, 2000)
    expected = solve(ONE_BY_ONE, problems, dtype, handle=bounded)
    assert (expected.results["status"] == UNCERTIFIED).sum() > 100
    assert same(solve(variant, problems, dtype, handle=bounded), expected)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("how", [{"room": 0}, {"room": 2}, {"max_phases": 3}, {"step": 3}])
def test_a_sweep_has_the_same_bits(variant, dtype, how):
    problems = sweep(1000)
    expected = solve(ONE_BY_ONE, problems, dtype, **how)
    assert expected.results["event_count"].max() >= 2
    assert same(solve(variant, problems, dtype, **how), expected)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_list_longer_than_a_lane_holds_is_whole(variant, dtype):
    problems = sweep(100)  # a light actuator rings under a body whose weight the motor carries
    for name, value in {"m_eff": 0.05, "k": 1.2e5, "b1": 0.0, "f1": 0.0, "x1_min": -1.0, "x1_max": 1.0}.items():
        problems[name] = value
    problems["v1"], problems["v2"], problems["y"], problems["horizon"] = 0.2, -0.001, 2.4e-4, 0.05
    problems["u"] = np.linspace(0.44, 0.46, 100)
    expected = solve(ONE_BY_ONE, problems, dtype, room=60)
    assert 20 < expected.results["event_count"].max() <= 60
    assert same(solve(variant, problems, dtype, room=60), expected)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_runs_of_one_robot_have_the_same_bits(variant, dtype):
    problems = np.repeat(draw_stances(7, 90), 40)  # one run of each robot, and a run of one where it is refused
    problems["u"] += np.tile(np.linspace(-1.0, 1.0, 40), 90)
    problems["k"][400:440], problems["m_s"][447] = problems["k"][360], -1.0
    expected = solve(ONE_BY_ONE, problems, dtype)
    assert (expected.results["status"] < 0).sum() == 1
    assert same(solve(variant, problems, dtype), expected)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_what_else_is_in_a_batch_changes_nothing(variant, dtype):
    problems = np.concatenate([sweep(700), draw_stances(3, 700)])
    order = np.random.default_rng(5).permutation(len(problems))
    together, mixed = solve(variant, problems, dtype), solve(variant, problems[order], dtype)
    bits = together.bits()
    assert [bits[i] for i in order] == mixed.bits()


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_batch_of_any_length(variant, dtype):
    problems = sweep(131)
    bits = solve(variant, problems, dtype).bits()
    for count in [*range(36), 47, 48, 63, 64, 65, 127, 128, 129]:
        assert solve(variant, problems[:count], dtype).bits() == bits[:count], count


def test_what_is_refused_is_refused_alike(variant):
    problems = sweep(64)
    problems["m_s"][3], problems["x1"][9], problems["y"][17] = -1.0, 0.5, -0.01
    problems["u"][20], problems["horizon"][33], problems["v2"][40] = np.nan, 0.0, np.inf
    expected = solve(ONE_BY_ONE, problems, np.float64)
    assert set(expected.results["status"].tolist()) >= {-2, -3, -4, -5, -6, 1}
    assert same(solve(variant, problems, np.float64), expected)


def test_events_that_do_not_fit_are_told(variant):
    problems = sweep(64)
    for room, status in ((1, 1), (16, 0)):
        assert solve(ONE_BY_ONE, problems, np.float64, room=room).status == status
        assert solve(variant, problems, np.float64, room=room).status == status


def test_a_variant_that_is_not_there_refuses_every_stance():
    for number in (-1, 5, 99):
        assert not has(number)
        answers = solve(number, sweep(8), np.float64)
        assert answers.status == ERROR_VARIANT
        codes = {"status": ERROR_VARIANT, "event_count": 0}
        for name, column in answers.results.items():
            np.testing.assert_array_equal(column, codes.get(name, np.nan))
        assert np.isnan(answers.event_time).all() and (answers.event_kind == 0).all()


def test_every_processor_has_the_baseline_in_both_precisions():
    for suffix in ("f32", "f64"):
        assert has(ONE_BY_ONE, suffix) and has(BASELINE, suffix)
        assert has(AVX2, suffix) or not has(AVX512, suffix)


def test_threads_and_shapes_change_no_bit():
    v2 = np.linspace(-3.0, -1.0, 3 * ufuncs.CHUNK + 5)
    one = hopform.solve_stances(HOPPER, v2=v2, u=2.0, backend="c")
    two = hopform.solve_stances(HOPPER, v2=v2, u=2.0, backend="c", threads=2)
    reverse = hopform.solve_stances(HOPPER, v2=v2[::-1], u=2.0, backend="c")
    for field in ("status", "duration", "apex", "aed", "event_count"):
        assert getattr(one, field).tobytes() == getattr(two, field).tobytes()
        assert getattr(one, field).tobytes() == getattr(reverse, field)[::-1].tobytes()


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_batch_raises_no_flag_of_the_processor(dtype):
    problems = draw_stances(11, 500)
    inputs = [problems[name].astype(dtype) for name in STATES]
    robots = np.stack([problems[name].astype(dtype) for name in NAMES], axis=-1)
    with np.errstate(all="raise"):
        results = ufuncs.stance(*inputs, robots)
    assert np.isfinite(results[1]).all()
