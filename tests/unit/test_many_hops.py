"""Runs of hops at once: each as `simulate` makes it hop by hop, to the same bits; where they end; what is refused."""

import dataclasses
import pickle
import re
from typing import Any

import numpy as np
import pytest

import hopform
import hopform.hopping
from hopform import HopformError, State, solve_hops
from hopform.hopping import Errors, simulate, terrain
from tests.conformance.flights import random_flight
from tests.conformance.test_hops import GAINS, HOPPER, OTHERS
from tests.oracle import integrator

DRAW = np.random.default_rng(3)
GROUND, U = DRAW.uniform(-0.02, 0.02, (40, 12)), DRAW.uniform(0.5, 3.0, (40, 12))


def asked(currents: Any) -> Any:
    """A controller that `simulate` has to ask at each touchdown."""
    return lambda touchdown: float(np.resize(currents, 12)[touchdown.hop])


def assert_same(runs: hopform.Hops, n: Any, run: hopform.hopping.Run) -> None:
    """A run among many, and the same that Python has followed hop by hop: all bits."""
    hops, count = run.hops, len(run.hops)
    assert (str(runs.words[n]), int(runs.hops[n])) == (run.status, count)
    assert runs.ending_words[n].tolist()[:count] == [hop.stance.status for hop in hops]
    assert not runs.ending[n][count:].any() and np.isnan(runs.aed[n][count:]).all()
    for ours, theirs in (
        (runs.apex, [hop.apex for hop in hops]),
        (runs.aed, [hop.stance.aed for hop in hops]),
        (runs.touchdown_time, [hop.touchdown_time for hop in hops]),
    ):
        np.testing.assert_array_equal(ours[n][:count], theirs, strict=True)
    for states, theirs in ((runs.touchdown, "touchdown"), (runs.stance_end, "end")):
        assert states is not None
        for axis, values in states._asdict().items():
            of = [getattr(hop.stance.at(0.0) if theirs == "touchdown" else hop.stance.end, axis) for hop in hops]
            np.testing.assert_array_equal(values[n][:count], of)
    if run.status != "completed" and run.last is not None:
        assert (runs.duration[n], *(x[n] for x in runs.end)) == (run.duration, *run.last.end)
    elif hops:
        end = hops[-1].stance.end
        assert (runs.duration[n], *(x[n] for x in runs.end)) == (hops[-1].takeoff_time, *end)


def test_runs_are_those_that_simulate_makes_hop_by_hop():
    runs = solve_hops(HOPPER, height=0.2, u=U, ground=GROUND, states=True)
    for n in range(len(U)):
        assert_same(runs, n, simulate(HOPPER, GROUND[n], asked(U[n]), height=0.2))
    assert {"completed", "stopped", "tripped"} == {*runs.words.tolist()}


def test_degenerate_robots_hop_as_simulate_makes_them():
    """The actuators of random flights, on legs of any stiffness; most do not hop far."""
    hops = 0
    for seed in range(60):
        robot, given = random_flight(seed)
        robot = dataclasses.replace(robot, b2=robot.b1 / 30.0, f2=robot.f1 / 10.0, c=0.0 if seed % 2 else robot.c)
        u = min(robot.u_max, 5.0) * U[0, :4] / 3.0
        how: dict[str, Any] = {"gains": given["gains"] if seed % 3 else None, "max_phases": 40}
        start = State(given["x1"], given["v1"], 0.6, 1.0)
        runs = solve_hops(robot, start=start, u=u, ground=GROUND[seed % 40, :4], states=True, **how)
        assert_same(runs, (), run := simulate(robot, GROUND[seed % 40, :4], asked(u), start=start, **how))
        hops += len(run.hops)
    assert hops > 60


def test_a_run_from_a_touchdown_goes_on_as_the_run_that_has_led_there():
    whole = solve_hops(HOPPER, height=0.2, u=U[:3], ground=GROUND[:3], states=True)
    assert whole.touchdown is not None
    x1, v1, _, v2 = (x[:, 1] for x in whole.touchdown)
    rest = solve_hops(HOPPER, x1=x1, v1=v1, v2=v2, u=U[:3, 1:], ground=GROUND[:3, 1:])
    np.testing.assert_array_equal(rest.apex, whole.apex[:, 1:])
    np.testing.assert_array_equal(rest.aed, whole.aed[:, 1:])
    assert rest.touchdown is None


@pytest.mark.parametrize("name", ["hopper_c", pytest.param("little friction", marks=pytest.mark.sliced)])
def test_hops_agree_with_an_integrator_that_shares_nothing(name):
    robot, count = OTHERS[name], 6
    ground = terrain.uniform(count, 0.02, seed=5)
    u = np.random.default_rng(1).uniform(0.5, 1.0, count) * robot.u_max
    exact = integrator.hop(robot, list(ground), u.tolist(), 0.2, GAINS)
    runs = solve_hops(robot, height=0.2, u=u, ground=ground, gains=GAINS, states=True)
    assert runs.words.item() == "completed" and runs.touchdown is not None
    np.testing.assert_allclose(runs.touchdown_time, [t for t, _ in exact.touchdowns], rtol=0, atol=1e-8)
    expected = np.array([state for _, state in exact.touchdowns]).T
    np.testing.assert_allclose(np.array(runs.touchdown) + [[0], [0], [1], [0]] * np.array(ground), expected, atol=1e-8)
    for n, (t, (_, _, x2, v2)) in enumerate(exact.takeoffs):
        assert runs.apex[n] == pytest.approx(x2 + max(v2, 0.0) ** 2 / (2.0 * robot.g) - 0.4 - robot.c, abs=1e-8)
        assert t > exact.touchdowns[n][0]


# ---- simulate, which goes over them ----


def test_simulate_of_a_current_gives_the_bits_of_a_controller_that_answers_it():
    for n, current in enumerate((0.5, 1.1, 2.0, 3.0)):
        how: dict[str, Any] = {"height": 0.2, "gains": GAINS if n % 2 else None}
        known = simulate(HOPPER, GROUND[n], current, **how)
        loop = simulate(HOPPER, GROUND[n], asked(current), **how)
        assert known.table.tobytes() == loop.table.tobytes()
        assert (known.status, known.duration) == (loop.status, loop.duration)
        assert (known.last is None) == (loop.last is None) and known.last == loop.last
        t = np.linspace(0.0, known.duration, 50)
        np.testing.assert_array_equal(np.array(known.at(t)), np.array(loop.at(t)))
        np.testing.assert_array_equal(known.aed(t), loop.aed(t))
        again = pickle.loads(pickle.dumps(known))
        assert again.table.tobytes() == loop.table.tobytes()


def test_a_run_of_one_current_solves_no_motion_until_one_is_read(monkeypatch):
    solved = []
    of_run = hopform.hopping._run  # pyright: ignore[reportPrivateUsage]
    monkeypatch.setattr(
        of_run, "solve_stance", lambda *robot, **how: solved.append(how) or hopform.solve_stance(*robot, **how)
    )
    run = simulate(HOPPER, [0.0] * 6, 3.0, height=0.2)
    assert [hop.apex for hop in run.hops] == solve_hops(HOPPER, height=0.2, u=3.0, hops=6).apex.tolist() and not solved
    assert run.hops[2].stance.status == "takeoff" and len(solved) == 1
    told = simulate(HOPPER, [0.0] * 6, 3.0, height=0.2, progress=lambda *_: None)
    assert len(solved) == 7 and told.table.tobytes() == run.table.tobytes()
    late = simulate(HOPPER, [0.0] * 2, 3.0, height=0.2, errors=Errors(delay=0.01))
    assert late.hops[0].apex != run.hops[0].apex


# ---- endings ----


def test_runs_end_where_and_as_they_say():
    no_takeoff = solve_hops(HOPPER, height=[0.2, 0.005], u=[[3.0], [0.0]], hops=3)
    assert no_takeoff.words.tolist() == ["completed", "stopped"] and no_takeoff.hops.tolist() == [3, 1]
    assert no_takeoff.ending_words[1].tolist() == ["rest", "", ""] and np.isnan(no_takeoff.apex[1]).all()
    tripped = solve_hops(HOPPER, height=0.1, u=3.0, ground=[0.0, 0.5, 0.0])
    assert (
        tripped.words == "tripped" and tripped.hops == 1 and np.isfinite(tripped.apex).tolist() == [True, False, False]
    )
    at_once = solve_hops(HOPPER, height=0.1, ground=[0.2])
    assert at_once.words == "tripped" and at_once.hops == 0 and np.isfinite(at_once.duration)
    short = solve_hops(HOPPER, height=0.2, u=3.0, hops=2, horizon=0.01)
    assert short.ending_words.tolist() == ["horizon", ""] and short.words == "stopped"
    many = solve_hops(HOPPER, height=0.2, u=3.0, hops=2, max_phases=2)
    assert many.words == "stopped" and many.hops + (many.ending == 4).sum() <= 2
    far = solve_hops(HOPPER, height=[0.2, 1e38], u=3.0, hops=2, dtype=np.float32)
    assert far.words.tolist()[0] == "completed" and far.words[1] == "out_of_range"
    assert far.duration.dtype == np.float32 and np.isnan(far.duration[1]) and np.isnan(far.apex[1]).all()
    still = solve_hops(HOPPER, height=0.2, u=3.0, hops=2, g=[9.81, 0.0])
    assert still.words.tolist() == ["completed", "robot_refused"]


# ---- arrays ----


def test_everything_broadcasts_and_the_last_axis_of_current_and_ground_is_the_hop():
    heights, stiff = np.array([0.15, 0.2]), np.array([[1000.0], [1200.0], [1400.0]])
    runs = solve_hops(HOPPER, height=heights, k=stiff, u=np.array([[2.0], [3.0]]), ground=GROUND[0, :4])
    assert runs.status.shape == (3, 2) and runs.apex.shape == (3, 2, 4)
    one = solve_hops(dataclasses.replace(HOPPER, k=1400.0), height=0.2, u=3.0, ground=GROUND[0, :4])
    np.testing.assert_array_equal(runs.apex[2, 1], one.apex)
    single = solve_hops(HOPPER, height=0.2, u=3.0, hops=4, dtype="float32", states=True)
    assert single.apex.dtype == np.float32 and single.touchdown is not None
    assert {x.dtype for x in (*single.end, *single.touchdown)} == {np.dtype(np.float32)}
    np.testing.assert_allclose(single.apex, solve_hops(HOPPER, height=0.2, u=3.0, hops=4).apex, atol=1e-5)
    assert solve_hops(HOPPER, height=np.zeros((0, 2)) + 0.2, hops=3).apex.shape == (0, 2, 3)


def test_labelled_runs_keep_their_names_and_the_hops_are_hop():
    xarray = pytest.importorskip("xarray")
    height = xarray.DataArray([0.1, 0.2], dims="height", coords={"height": [0.1, 0.2]})
    ground = xarray.DataArray(GROUND[:3, :5], dims=("ground", "hop"))
    found = solve_hops(HOPPER, height=height, u=3.0, ground=ground).to_xarray()
    assert found.apex.dims == ("height", "ground", "hop") and found.apex.attrs["units"] == "m"
    plain = solve_hops(HOPPER, height=np.array([[0.1], [0.2]]), u=3.0, ground=GROUND[:3, :5])
    np.testing.assert_array_equal(found.apex, plain.apex)
    assert found.status.sel(height=0.2)[0] == plain.words[1, 0]
    with pytest.raises(HopformError, match="height must not have the dimension hop; u and ground may"):
        solve_hops(HOPPER, height=height.rename(height="hop"), ground=ground)


def test_parts_threads_and_progress_change_no_bit(monkeypatch):
    monkeypatch.setattr("hopform._hops.CHUNK", 36)
    how: dict[str, Any] = {
        "height": np.linspace(0.1, 0.3, 40),
        "u": U,
        "ground": GROUND,
        "k": np.linspace(900, 1500, 40),
    }
    told: list[tuple[int, int]] = []
    alone = solve_hops(HOPPER, **how, progress=lambda *done: told.append(done))
    assert told[0] == (3, 40) and told[-1] == (40, 40) and len(told) == 14
    assert solve_hops(HOPPER, **how, threads=3) == alone

    def stop(*_: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve_hops(HOPPER, **how, progress=stop)


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "nothing": ({"height": None}, "give one of height, start and v2, got height = None, start = None"),
    "two": ({"v2": -1.0}, "give one of height, start and v2"),
    "a speed with a height": ({"v1": 0.1}, "v1 is that of the first touchdown, beside v2: 0 with height, got 0.1"),
    "no state": ({"height": None, "start": (1.0, 2.0)}, "start must be a State of x1, v1, x2, v2, got"),
    "a place": ({"height": None, "start": (0.2, 0.0, 1.0, 0.0), "hops": 1}, "x1 must be .*0.08 m.*, got 0.2"),
    "pulls": ({"height": None, "v2": -1.0, "compression": -0.1, "hops": 1}, r"compression must be >= 0 m \(a contact cannot pull\), got -0.1"),
    "no number": ({"height": [0.1, np.nan]}, r"height\[1\] must be finite m, got nan"),
    "a current": ({"u": [1.0, np.inf]}, r"u\[1\] must be finite A, got inf"),
    "steps": ({"u": [(0.0, 1.0), (0.1, 2.0)], "ground": [0.0] * 3}, "u, ground and hops must have one number of hops, got"),
    "a ground": ({"ground": [0.0, "high"]}, "ground must be numbers in m, got"),
    "hops": ({"hops": 3, "ground": [0.0, 0.0]}, "u, ground and hops must have one number of hops, got {'ground': 2, 'hops': 3}"),
    "no hops": ({}, "hops must be given where the ground has no axis of hops"),
    "none": ({"ground": []}, "hops must be from 1 to 65536, got 0"),
    "too many": ({"hops": 65537}, "hops must be from 1 to 65536, got 65537"),
    "shapes": ({"hops": 2, "k": [1.0, 2.0], "height": [0.1] * 3}, "the shapes of runs must broadcast, got {'height': .3,., 'k': .2,.}"),
    "gains": ({"hops": 2, "gains": 3.0}, "gains must be a pair .Kp, Kd. in N/m and N s/m, got 3.0"),
    "a gain": ({"hops": 2, "gains": (1.0, [2.0, -3.0])}, r"Kd\[1\] must be >= 0 N s/m, got -3.0"),
    "horizon": ({"hops": 2, "horizon": 0.0}, "horizon must be > 0 s, got 0.0"),
    "a name": ({"hops": 2, "kk": 3.0}, "'kk' is neither an input of a hop nor a field of the robot"),
    "a field": ({"hops": 2, "m_s": [3.0, -1.0]}, r"m_s\[1\] must be > 0 kg, got -1.0"),
    "memory": ({"hops": 65536, "u": np.zeros((4000, 1))}, "the inputs must broadcast to at most .* runs of 65536 hops"),
    "threads": ({"hops": 2, "threads": 0}, "threads must be a whole number >= 1, got 0"),
    "states": ({"hops": 2, "states": 1}, "states must be True or False, got 1"),
    "a type": ({"hops": 2, "dtype": "float16"}, "dtype must be float64 or float32, got 'float16'"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_bad_input_is_named(name):
    wrong, message = WRONG[name]
    with pytest.raises(HopformError, match=message if "\\" in message or "." in message else re.escape(message)):
        solve_hops(HOPPER, **({"height": 0.2} | wrong))


def test_a_robot_that_does_not_fall_and_a_model_without_a_contact_are_refused():
    with pytest.raises(HopformError, match=r"hopping needs g > 0 m/s\^2, got 0.0"):
        solve_hops(dataclasses.replace(HOPPER, g=0.0), height=0.2, hops=2)
