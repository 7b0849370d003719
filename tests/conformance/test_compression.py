"""The largest compression of a stance and what it says of the spring's travel."""

import mpmath
import numpy as np
import pytest

import hopform
from tests.conformance.random_stances import draw_stances
from tests.oracle import reference

PARAMETERS = ("m_eff", "m_s", "k", "L0", "c", "b1", "b2", "f1", "f2", "gamma2", "g", "x1_min", "x1_max")


def rows(seed, count):
    """Robots and starts, degenerate ones among them."""
    for row in draw_stances(seed, count):
        robot = hopform.Robot(**{name: float(row[name]) for name in PARAMETERS})
        x1, y = float(row["x1"]), float(row["y"])
        start = {"x1": x1, "v1": float(row["v1"]), "v2": float(row["v2"])}
        yield robot, start | ({"x2": x1 - y + robot.L0 + robot.c} if y else {}), float(row["u"])


def times(duration, count):
    """From the shortest to the longest, and evenly."""
    return np.unique(np.concatenate([np.linspace(0.0, duration, count), duration * np.logspace(-9.0, 0.0, count // 2)]))


def largest(robot, exact):
    """By the 50-digit reference: where y' = v1 - v2 changes its sign from above, or at an end; by halving."""
    with mpmath.workdps(50):
        at = [mpmath.mpf(float(t)) for t in times(float(exact.duration), 200)]
        at = [t for t in at if t < exact.duration] + [exact.duration]
        states = [exact.at(t) for t in at]

        def compression(state):
            return state.x1 - state.x2 + mpmath.mpf(robot.L0) + mpmath.mpf(robot.c)

        most = max(map(compression, states))
        for start, end, before, after in zip(at, at[1:], states, states[1:], strict=False):
            if before.v1 > before.v2 and after.v1 < after.v2:
                low, high = start, end
                for _ in range(60):
                    middle = (low + high) / 2
                    state = exact.at(middle)
                    low, high = (middle, high) if state.v1 > state.v2 else (low, middle)
                most = max(most, compression(exact.at(low)))
        return float(most)


@pytest.mark.parametrize("count", [4, pytest.param(60, marks=pytest.mark.nightly)])
def test_it_is_that_of_the_reference(count):
    inside = 0
    for robot, start, u in rows(31, count):
        solved = hopform.solve_stance(robot, **start, u=u)
        fields = {name: getattr(robot, name) for name in PARAMETERS}
        exact = largest(robot, reference.solve(fields, **start, u=u))
        assert solved.compression_max == pytest.approx(exact, rel=1e-11, abs=1e-15), (robot, start, u)
        ends = [*(phase.start for phase in solved.phases), solved.duration]
        inside += solved.compression_max > 1.001 * np.max(solved.compression(ends))
    assert inside > count // 10, "in some it is inside a phase"


def test_no_time_of_a_stance_has_a_larger_one():
    for robot, start, u in rows(32, 150):
        solved = hopform.solve_stance(robot, **start, u=u)
        seen = float(np.max(solved.compression(times(solved.duration, 400))))
        assert seen <= solved.compression_max * (1.0 + 1e-12) + 1e-16, (robot, start, u)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_a_batch_has_that_of_each_stance(hopper_c, dtype):
    v2, u = np.linspace(-2.8, -0.3, 5)[:, np.newaxis], np.linspace(-3.0, 3.0, 7)
    batch = hopform.solve_stances(hopper_c, v2=v2, u=u, compression_max=True, dtype=dtype)
    assert batch.compression_max is not None
    assert batch.compression_max.shape == (5, 7)
    assert batch.compression_max.dtype == dtype
    for (i, j), most in np.ndenumerate(batch.compression_max):
        alone = hopform.solve_stance(hopper_c, v2=float(v2[i, 0]), u=float(u[j]), dtype=dtype)
        assert most == pytest.approx(alone.compression_max, rel=4.0 * float(np.finfo(dtype).eps))
    assert hopform.solve_stances(hopper_c, v2=v2).compression_max is None


def test_a_long_list_of_phases_is_read_to_its_end():
    """More phases than there is room for at first: ringing without friction, a start with the largest at its end."""
    robot = hopform.Robot(m_eff=3.0, m_s=1.0, k=3e4, L0=0.4, gamma2=-10.0)
    asked = {"v2": -0.5, "x2": 0.38, "u": 0.0, "horizon": 2.0}
    batch = hopform.solve_stances(robot, **asked, compression_max=True)
    assert batch.compression_max is not None
    alone = hopform.solve_stance(robot, **asked)
    assert batch.compression_max == pytest.approx(alone.compression_max, rel=1e-15)
    assert alone.compression_max == pytest.approx(np.max(alone.compression(times(alone.duration, 20000))), rel=1e-5)


def test_beyond_the_travel_of_the_spring_is_a_warning(hopper_c):
    fine = hopform.solve_stance(hopper_c, v2=-2.9, u=1.0)
    assert fine.compression_max < hopper_c.travel
    assert fine.warnings == ()
    beyond = hopform.solve_stance(hopper_c, v2=-3.0, u=1.0)
    most = beyond.compression_max
    assert most > hopper_c.travel
    assert beyond.warnings == (f"coil_bound: the spring is compressed by {most:.6g} m, its travel is 0.16 m",)


def test_what_a_robot_cannot_do_is_a_warning(hopper_c):
    up = hopform.solve_stance(hopper_c, v2=0.1, v1=0.2)
    assert up.warnings == ("the body moves up at touchdown, v2 = 0.1 m/s",)
    pushed = hopform.solve_stance(hopper_c, v2=-1.0, u=-1.0)
    assert pushed.warnings == ("u = -1.0 A pushes the actuator against the stop x1_min on which it rests",)
    assert hopform.solve_stance(hopper_c, v2=-1.0, u=-1.0, x1=0.01).warnings == ()
    assert hopform.solve_stance(hopform.load_robot("ideal"), v2=-1.0, u=-1.0).warnings == (), "locked is exempt"
    deep = hopform.solve_stance(hopform.Robot(m_eff=25.0, m_s=3.0, k=100.0, L0=0.4), v2=-4.0)
    assert deep.warnings[0].startswith("the body passes below the ground, down to x2 = -0.")


@pytest.mark.parametrize("travel", [0.0, -1.0, float("nan"), "long"])
def test_a_travel_out_of_its_domain_is_refused_by_name(travel):
    with pytest.raises(hopform.HopformError, match="^travel must be"):
        hopform.Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, travel=travel)


def test_travel_goes_through_toml(tmp_path):
    robot = hopform.Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, travel=0.125)
    path = tmp_path / "mine.toml"
    path.write_text(robot.to_toml(), "utf-8")
    assert hopform.load_robot(path).travel == 0.125
