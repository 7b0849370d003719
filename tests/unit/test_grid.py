"""A stance on a uniform grid is the stance at each of its times."""

import ctypes
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

import hopform
from derive.emit.facts import FLAGS
from hopform import Robot, State
from hopform._solver import c as native
from hopform._solver.build import compile_solver
from tests import needs

SAMPLES = 10_000
GENERATED = Path(__file__).resolve().parents[2] / "generated" / "c"


def triple_root(m_eff: float = 3.0, r: float = 10.0) -> Robot:
    """A robot whose three poles coincide exactly."""
    m_s = 8.0 * m_eff
    return Robot(m_eff=m_eff, m_s=m_s, k=m_s * r * r / 3.0, L0=0.4, b1=3.0 * m_eff * r, f1=0.1, f2=0.2)


def random_robot(rng: np.random.Generator) -> Robot:
    """Anything from a soft leg to a stiff one; a third without viscous friction."""
    m_eff, m_s = 10.0 ** rng.uniform(-1, 2, 2)
    b1, b2 = 10.0 ** rng.uniform(-3, 3, 2) * (rng.random(2) > 0.33)
    f1, f2 = rng.uniform(0.0, 2.0, 2)
    k = 10.0 ** rng.uniform(2, 6)
    return Robot(m_eff=m_eff, m_s=m_s, k=k, L0=0.4, b1=b1, b2=b2, f1=f1, f2=f2, gamma2=-m_eff, x1_max=0.05)


HOPPER = hopform.load_robot("hopper_c")
ROBOTS = {
    "hopper_c": HOPPER,
    "ideal": hopform.load_robot("ideal"),
    "without viscous friction": Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, f1=0.78, f2=0.6),
    "a triple root": triple_root(),
}
RINGING = Robot(m_eff=2.0, m_s=3.0, k=2e4, L0=0.4, b1=40.0, b2=0.5, f1=2.0, f2=0.05, x1_min=-0.002, x1_max=0.01)


def worst(stance: hopform.Stance, t: np.ndarray, state: State) -> float:
    """The largest difference to `at`, positions over 0.1 m, velocities over 1 m/s."""
    exact = stance.at(t)
    scales = (0.1, 1.0, 0.1, 1.0)
    return max(float(np.max(np.abs(a - b) / s)) for a, b, s in zip(state, exact, scales, strict=True))


@pytest.mark.parametrize("name", ROBOTS)
def test_ten_thousand_samples_lie_within_rounding_of_the_closed_form(name):
    stance = hopform.solve_stance(ROBOTS[name], v2=-1.93, u=0.0)
    t, state = stance.grid(SAMPLES)
    assert t.shape == state.x2.shape == (SAMPLES,)
    assert t[0] == 0.0 and t[-1] == stance.duration
    assert worst(stance, t, state) <= 1e-13


@pytest.mark.parametrize("count", [1, 2, 7, 63, 64, 65, 129, 1000, SAMPLES])
def test_any_count_fills_its_arrays_through_many_phases(count):
    stance = hopform.solve_stance(RINGING, v2=0.0, x1=-0.002, x2=0.3972)
    assert len(stance.phases) > 10
    t, state = stance.grid(count)
    assert t.size == count
    assert worst(stance, t, state) <= 1e-13


@pytest.mark.parametrize("seed", range(40))
def test_random_robots_on_a_grid(seed):
    rng = np.random.default_rng(seed)
    stance = hopform.solve_stance(random_robot(rng), v2=-2.0, v1=rng.normal(), u=rng.uniform(-3, 3), x1=0.01)
    t, state = stance.grid(SAMPLES)
    assert worst(stance, t, state) <= 1e-13


def test_single_precision_on_a_grid():
    stance = hopform.solve_stance(HOPPER, v2=-1.93, u=2.0, dtype=np.float32)
    t, state = stance.grid(SAMPLES)
    assert t.dtype == state.x1.dtype == np.float32
    assert worst(stance, t, state) <= 1e-5


def test_steps_of_the_current_are_phases_like_others():
    stance = hopform.solve_stance(HOPPER, v2=-1.93, u=[(0.0, 3.0), (0.05, -1.0), (0.0500001, 2.0)])
    t, state = stance.grid(SAMPLES)
    assert worst(stance, t, state) <= 1e-13


def test_a_grid_by_its_distance_ends_before_the_stance():
    stance = hopform.solve_stance(HOPPER, v2=-1.93)
    t, state = stance.grid(dt=1e-4)
    assert t.size == math.floor(stance.duration / 1e-4) + 1
    assert np.allclose(np.diff(t), 1e-4, rtol=0.0, atol=1e-15)
    assert worst(stance, t, state) <= 1e-13


def test_a_stance_at_rest_stays_on_the_grid():
    heavy = Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, b2=500.0, f1=5.0, f2=30.0)
    stance = hopform.solve_stance(heavy, v2=-0.5)
    assert stance.status == "rest"
    t, state = stance.grid(300)
    assert worst(stance, t, state) <= 1e-13


def test_a_stance_of_no_duration_has_one_state():
    stance = hopform.solve_stance(HOPPER, v2=1.0)
    assert stance.duration == 0.0
    _, state = stance.grid(3)
    assert state.v2.tolist() == [1.0] * 3


def test_the_states_go_into_arrays_of_the_caller():
    stance = hopform.solve_stance(HOPPER, v2=-1.93, u=2.0)
    _, fresh = stance.grid(500)
    rows, columns = State(*np.empty((4, 500))), State(*np.empty((500, 4)).T)
    for out in (rows, columns):
        _, state = stance.grid(500, out=out)
        for mine, given, expected in zip(state, out, fresh, strict=True):
            assert mine is given
            assert np.array_equal(given, expected)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "give either count or dt"),
        ({"count": 3, "dt": 0.1}, "give either count or dt"),
        ({"count": 0}, "count must be a whole number >= 1, got 0"),
        ({"count": 2.5}, "count must be a whole number >= 1, got 2.5"),
        ({"dt": -1.0}, "dt must be > 0 s, got -1.0"),
        ({"dt": math.nan}, "dt must be finite s, got nan"),
        ({"dt": 1e-300}, "dt must be > "),
        ({"count": 3, "out": State(*np.empty((4, 2)))}, r"out.x1 must be an array of float64 of shape \(3,\)"),
        ({"count": 3, "out": State(*np.empty((4, 3), np.float32))}, "out.x1 must be an array of float64"),
        ({"count": 3, "out": tuple(np.empty((3, 3)))}, "out must be 4 arrays, got 3"),
    ],
)
def test_a_grid_that_cannot_be_is_refused(arguments, words):
    stance = hopform.solve_stance(HOPPER, v2=-1.93)
    with pytest.raises(hopform.HopformError, match=words):
        stance.grid(**arguments)


def is_another(name: str) -> bool:
    """Whether a file is the source of something else than what firmware compiles, which needs none of them."""
    return name.endswith(".c") and not name.startswith("hopform_")


@pytest.mark.sliced
@needs.library
@pytest.mark.parametrize("dtype", needs.the_first(["float32", "float64"]))
def test_wider_registers_give_the_bits_of_the_plain_ones(tmp_path, dtype):
    shutil.copytree(GENERATED, tmp_path / "c", ignore=lambda _, names: {name for name in names if is_another(name)})
    sources = ", ".join(f'"c/src/hopform_{precision}.c"' for precision in ("f32", "f64"))
    (tmp_path / "solver.toml").write_text(f"[build]\nflags = {list(FLAGS)}\nsources = [{sources}]\n", "utf-8")
    compile_solver(tmp_path, tmp_path / "plain.so", "-DHOPFORM_PORTABLE")
    types = native.library().types(np.dtype(dtype))
    plain = getattr(ctypes.CDLL(str(tmp_path / "plain.so")), f"hopform_stance_grid_{types.suffix}")
    for robot, count in ((RINGING, SAMPLES), (HOPPER, 257), *((robot, 1000) for robot in ROBOTS.values())):
        stance = hopform.solve_stance(robot, v2=-1.93, v1=0.3, dtype=dtype)
        step = stance.duration / count
        ours, theirs = (np.full((4, count), 77.0, dtype) for _ in range(2))
        solved = stance._solved
        solved.grid(step, State(*ours))
        time = types.real(0.0), types.real(step)
        assert plain(*solved.structs, *time, ctypes.c_int32(count), native.columns_of(theirs)) == 0
        assert ours.tobytes() == theirs.tobytes() and np.isfinite(ours).all()
