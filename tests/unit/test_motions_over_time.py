"""Many motions under steps of their input, read at times, with derivatives by choice: those of each motion alone."""

import dataclasses
from typing import Any

import numpy as np
import pytest

import hopform
from hopform import HopformError
from tests.derived import SHIPPED, solver_of

HOPPER = hopform.load_robot("hopper_c")
BEGINS = np.array([0.0, 0.07, 0.2, 0.33, 0.61])
SEEN = np.array([0.05, 0.9, 0.0, 0.2, 0.45, 3.0])
"""In no order, at a step, behind the ending of some."""
BY = ("q", "F_p", "i", "u[3]", "t[2]", "J")


@pytest.fixture(scope="module")
def joint(store) -> Any:
    return solver_of(store, SHIPPED / "joint.py")


@pytest.fixture(scope="module")
def rig(store) -> Any:
    return solver_of(store, "rig")


@pytest.fixture(scope="module")
def xarray() -> Any:
    """With what it imports when it is first used."""
    module = pytest.importorskip("xarray")
    assert module.DataArray([0.0, 1.0], dims="x", coords={"x": [0, 1]}).expand_dims("y").to_dataset(name="z").sel(x=1)
    return module


@pytest.fixture(scope="module")
def drawing() -> None:
    """What matplotlib imports when it is first used."""
    pytest.importorskip("matplotlib")
    hopform.solve_stances(HOPPER, v2=[-1.93, -1.0]).plot()


def drawn(count: int = 6) -> dict[str, np.ndarray]:
    """Fields of joints, starts and steps of the current, of which some motions come to rest."""
    draw = np.random.default_rng(5)
    fields = {"J": draw.uniform(0.02, 0.05, count), "b": draw.uniform(0.0, 0.02, count)}
    fields |= {"k": draw.uniform(0.0, 2.0, count), "F_p": draw.uniform(0.02, 0.3, count)}
    u = draw.uniform(-6.0, 6.0, (count, BEGINS.size))
    u[::3] = 0.0
    return {**fields, "start": draw.uniform(-2.0, 6.0, count), "u": u}


def one_by_one(joint: Any, given: dict[str, np.ndarray], horizon: float, dtype: Any = np.float64) -> list[Any]:
    """The same motions, each under a list of steps."""
    fields = [name for name in given if name not in ("start", "u")]
    return [
        joint.solve_motion(
            joint.Robot(**{name: float(given[name][n]) for name in fields}), start={"q_dot": float(v)},
            u=list(zip(BEGINS.tolist(), given["u"][n].tolist(), strict=True)), horizon=horizon, dtype=dtype,
        )
        for n, v in enumerate(given["start"])
    ]  # fmt: skip


def batch_of(joint: Any, given: dict[str, np.ndarray], **how: Any) -> Any:
    fields = {name: values for name, values in given.items() if name != "start"}
    return joint.solve_motions(joint.Robot(), start={"q_dot": given["start"]}, **{"horizon": 1.0, **fields, **how})


# ---- rests that a small change ends ----


@pytest.mark.parametrize(("friction", "exists"), [(0.0, False), (0.1, True)])
def test_a_joint_that_rests_until_a_step_moves_it_has_derivatives_if_friction_holds_it(joint, friction, exists):
    robot = joint.Robot(F_p=friction)
    steps = {"u": [[0.0, 6.0]], "u_times": [0.0, 0.1], "horizon": 0.3}
    batch = joint.solve_motions(robot, start={"q_dot": np.zeros(1)}, sensitivities=("u[0]", "u[1]", "i"), **steps)
    rows = batch.sensitivities.matrix[0]
    assert np.isfinite(rows).all() if exists else np.isnan(rows).all()


# ---- the same motions ----


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_steps_states_and_derivatives_are_those_of_each_motion_to_the_bit(joint, dtype):
    given = drawn()
    batch = batch_of(joint, given, u_times=BEGINS, times=SEEN, sensitivities=True, events=True, dtype=dtype)
    single = one_by_one(joint, given, 1.0, dtype)
    assert batch.states.q.shape == (6, 6) and batch.state_sensitivities.matrix.shape == (6, 6, 2, 16)
    assert batch.words.tolist() == [motion.status for motion in single]
    assert {*batch.words.tolist()} == {"rest", "horizon"}
    for n, motion in enumerate(single):
        assert batch.duration[n] == motion.duration and batch.event_count[n] == len(motion.events)
        np.testing.assert_array_equal(batch.sensitivities.matrix[n], motion.sensitivities.matrix)
        seen = SEEN.astype(dtype)
        there = np.ones(SEEN.size, bool) if motion.status == "rest" else seen <= motion.duration
        states, by = motion.at(seen[there]), motion.derivatives(seen[there])
        for batched, alone in zip(batch.states, states, strict=True):
            np.testing.assert_array_equal(batched[n, there], alone)
            assert np.isnan(batched[n, ~there]).all() and batched.dtype == dtype
        np.testing.assert_array_equal(batch.state_sensitivities.matrix[n, there], by.matrix)
        assert np.isnan(batch.state_sensitivities.matrix[n, ~there]).all()
        assert batch.state_sensitivities.matrix.dtype == by.matrix.dtype == dtype


def test_a_stance_ends_and_its_states_with_it():
    u = np.array([[[0.0, 2.0, 1.0]], [[0.5, 3.0, 0.0]]])
    begins, times = [0.0, 0.05, 0.1], np.linspace(0.0, 0.25, 6)
    batch = hopform.solve_stances(
        HOPPER, v2=[-1.93, -1.0, -2.5], x2=[0.38, 0.38, 0.37], x1=[0.0, 0.01, 0.02], u=u, u_times=begins, times=times,
        compression_max=True, sensitivities=("x2", "L0", "k", "u[2]", "x1"), L0=[0.4, 0.41, 0.42],
    )  # fmt: skip
    assert batch.states.x2.shape == (2, 3, 6)
    for n in np.ndindex(2, 3):
        robot = dataclasses.replace(HOPPER, L0=(0.4, 0.41, 0.42)[n[1]])
        steps = list(zip(begins, u[n[0], 0].tolist(), strict=True))
        start = {"v2": (-1.93, -1.0, -2.5)[n[1]], "x2": (0.38, 0.38, 0.37)[n[1]], "x1": (0.0, 0.01, 0.02)[n[1]]}
        stance = hopform.solve_stance(robot, **start, u=steps)
        there = times <= stance.duration
        assert stance.status == "takeoff" and not there.all()
        np.testing.assert_array_equal(batch.states.x2[n][there], stance.at(times[there]).x2)
        assert np.isnan(batch.states.x2[n][~there]).all() and batch.compression_max[n] == stance.compression_max
        whole, at = stance.sensitivities, stance.derivatives(times[there])
        for name in ("x2", "L0", "k", "x1"):
            column = whole.columns.index(name)
            np.testing.assert_array_equal(batch.sensitivities.matrix[n][:, batch.sensitivities.columns.index(name)],
                                          whole.matrix[:, column])  # fmt: skip
            for row in at.rows:
                np.testing.assert_array_equal(batch.state_sensitivities[row, name][n][there], at[row, name])


def test_steps_of_one_are_shared_and_broadcast(joint):
    given = drawn()
    shared = batch_of(joint, {**given, "u": given["u"][1]}, u_times=BEGINS)
    spread = batch_of(joint, {**given, "u": np.tile(given["u"][1], (6, 1))}, u_times=BEGINS)
    crossed = batch_of(joint, {**given, "u": given["u"][:, np.newaxis]}, u_times=BEGINS)
    np.testing.assert_array_equal(shared.end.q, spread.end.q)
    assert crossed.end.q.shape == (6, 6)
    np.testing.assert_array_equal(crossed.end.q[1], shared.end.q)
    np.testing.assert_array_equal(np.diagonal(crossed.end.q), batch_of(joint, given, u_times=BEGINS).end.q)
    one = joint.solve_motions(joint.Robot(), u=given["u"][1], u_times=BEGINS, times=[0.1])
    assert one.status.shape == () and one.states.q.shape == (1,)
    for way in (np.asfortranarray, lambda u: np.repeat(u, 2, axis=1)[:, ::2], np.ndarray.tolist):
        laid = batch_of(joint, {**given, "u": way(given["u"])}, u_times=BEGINS)
        np.testing.assert_array_equal(laid.end.q, batch_of(joint, given, u_times=BEGINS).end.q)
    constant = batch_of(joint, {**given, "u": given["u"][:, :1]}, u_times=[0.0])
    np.testing.assert_array_equal(constant.end.q, batch_of(joint, {**given, "u": given["u"][:, 0]}).end.q)


def test_chunks_and_threads_change_no_bit(joint, monkeypatch):
    given = drawn(40)
    how = {"u_times": BEGINS, "times": SEEN, "sensitivities": BY, "events": True}
    whole, seen = batch_of(joint, given, **how), list[int]()
    monkeypatch.setattr("hopform._batch.CHUNK_MEMORY", 20_000)
    parts = batch_of(joint, given, **how, threads=2, progress=lambda done, _: seen.append(done))
    assert len(seen) > 5 and seen[-1] == 40
    assert whole == parts
    crossed = batch_of(joint, {**given, "u": given["u"][:5, np.newaxis]}, u_times=BEGINS)
    monkeypatch.undo()
    assert crossed == batch_of(joint, {**given, "u": given["u"][:5, np.newaxis]}, u_times=BEGINS)


def test_nothing_may_be_asked_of_no_motion(joint):
    none = joint.solve_motions(
        joint.Robot(), start={"q_dot": np.zeros(0)}, u=np.zeros((0, 5)), u_times=BEGINS, times=SEEN, sensitivities=True
    )
    assert none.states.q.shape == (0, 6) and none.state_sensitivities.matrix.shape == (0, 6, 2, 16)
    without = joint.solve_motions(joint.Robot(), start={"q_dot": [1.0, 2.0]}, times=[])
    assert without.states.q.shape == (2, 0)


# ---- derivatives by choice ----


def test_columns_by_choice_are_those_of_all(joint):
    motion = one_by_one(joint, drawn(2), 1.0)[1]
    by, whole = motion.sensitivities_by(("F_p", "q_dot", "i", "q")), motion.sensitivities
    assert by.columns == ("F_p", "q_dot", "i", "q") and by.rows == whole.rows
    for name in by.columns:
        assert [by[row, name] for row in by.rows] == [whole[row, name] for row in by.rows], name
    assert motion.sensitivities_by("u")["q", "u"] == whole["q", "i"] == whole["q", "u"]
    at = motion.derivatives(SEEN[SEEN <= 1.0], by=["J", "i"])
    np.testing.assert_array_equal(at["q", "J"], motion.derivatives(SEEN[SEEN <= 1.0])["q", "J"])


def test_single_steps_add_up_and_are_slopes_of_the_motion(joint):
    given = drawn(2)
    motion, count = one_by_one(joint, given, 1.0)[1], BEGINS.size
    by = motion.sensitivities_by([*(f"u[{n}]" for n in range(count)), *(f"t[{n}]" for n in range(1, count))])
    for row in by.rows:
        whole = motion.sensitivities[row, "u"]
        assert sum(by[row, f"i[{n}]"] for n in range(count)) == pytest.approx(whole, rel=1e-12, abs=1e-15)

    def moved(u: np.ndarray, begins: np.ndarray) -> Any:
        robot = motion.robot
        steps = list(zip(begins.tolist(), u.tolist(), strict=True))
        return joint.solve_motion(robot, start={"q_dot": float(given["start"][1])}, u=steps, horizon=1.0).end

    u, step = given["u"][1], 1e-5
    for n in range(count):
        more = step * (np.arange(count) == n)
        slope = (moved(u + more, BEGINS).q - moved(u - more, BEGINS).q) / (2.0 * step)
        assert by["q", f"u[{n}]"] == pytest.approx(slope, rel=1e-7, abs=1e-9)  # rounding over the step
        if n:
            slope = (moved(u, BEGINS + more).q - moved(u, BEGINS - more).q) / (2.0 * step)
            assert by["q", f"t[{n}]"] == pytest.approx(slope, rel=1e-7, abs=1e-8)
    assert by.units["u[3]"] == "A" and by.units["t[1]"] == "s"


def test_columns_of_a_leg_have_what_lies_beneath_them(rig):
    """A coordinate, the height and a length change the compression; where that is given, it stands in for the height."""
    robot = rig.Robot(**{field.name: getattr(HOPPER, field.name) for field in rig.Robot.fields()})
    for start in ({"x1": 0.01, "x2": 0.39, "v2": -0.5}, {"x1": 0.01, "y": 0.02, "v2": -0.5}):
        motion = rig.solve_motion(robot, start=start, u=2.0, horizon=0.1)
        whole, at = motion.sensitivities, motion.derivatives([0.03, 0.1])
        for name in whole.columns:
            own = motion.sensitivities_by(name)
            np.testing.assert_array_equal(own.matrix[:, 0], whole.matrix[:, whole.columns.index(name)], name)
            own_at = motion.derivatives([0.03, 0.1], by=name)
            np.testing.assert_array_equal(own_at.matrix[..., 0], at.matrix[..., at.columns.index(name)], name)
    with pytest.raises(HopformError, match="no derivative by 'x2'"):
        motion.sensitivities_by("x2")
    stance = hopform.solve_stance(HOPPER, v2=-1.0, compression=0.01)
    more, less = (hopform.solve_stance(HOPPER, v2=-1.0, compression=0.01 + way * 1e-6) for way in (1.0, -1.0))
    assert stance.sensitivities_by("compression")["apex", "compression"] == pytest.approx(
        (more.apex - less.apex) / 2e-6
    )


def test_derivatives_at_times_by_a_length_are_slopes_of_the_states():
    """At a height that stays, also of the height; by central differences, whose error is that of rounding over the step."""
    start, times, step = {"v2": -1.5, "x2": 0.38, "x1": 0.01}, np.array([0.03, 0.08, 0.12]), 1e-6
    by = hopform.solve_stance(HOPPER, **start, u=1.0).derivatives(times, by=("L0", "x2"))

    def moved(length: float, height: float) -> Any:
        robot = dataclasses.replace(HOPPER, L0=HOPPER.L0 + length)
        return hopform.solve_stance(robot, **{**start, "x2": start["x2"] + height}, u=1.0).at(times)

    for name, more in {"L0": (step, 0.0), "x2": (0.0, step)}.items():
        ends = moved(*more), moved(*(-each for each in more))
        for row, above, below in zip(by.rows, *ends, strict=True):
            np.testing.assert_allclose(by[row, name], (above - below) / (2.0 * step), rtol=1e-7, atol=1e-7)


@pytest.mark.sliced
def test_columns_of_a_gear_are_those_of_each_motion_and_slopes(store):
    """The ratio changes the compression by the place of the rotor: at the start of each motion, and at each time."""
    solver = solver_of(store, "geared_sea")
    places, ratios, times = np.array([5.0, -3.0]), np.array([50.0, 40.0]), np.array([0.01, 0.05])
    how = {"times": times, "horizon": 0.05, "u": 1.0}

    def moved(place: float = 0.0, ratio: float = 0.0, **more: Any) -> Any:
        start = {"theta": places + place, "q": [0.1, -0.1]}
        return solver.solve_motions(solver.Robot(), start=start, N=ratios + ratio, **how, **more)

    batch = moved(sensitivities=("N", "theta"))
    for n in range(2):
        motion = solver.solve_motion(
            solver.Robot(N=float(ratios[n])),
            start={"theta": float(places[n]), "q": (0.1, -0.1)[n]},
            u=1.0,
            horizon=0.05,
        )
        np.testing.assert_array_equal(batch.sensitivities.matrix[n], motion.sensitivities_by(("N", "theta")).matrix)
        at = motion.derivatives(times, by=("N", "theta"))
        np.testing.assert_array_equal(batch.state_sensitivities.matrix[n], at.matrix)
        np.testing.assert_array_equal(at["q", "N"], motion.derivatives(times)["q", "N"])
    for name, step in {"ratio": 1e-4, "place": 1e-4}.items():
        above, below = moved(**{name: step}).states, moved(**{name: -step}).states
        for row in batch.state_sensitivities.rows:
            slope = (getattr(above, row) - getattr(below, row)) / (2.0 * step)
            by = batch.state_sensitivities[row, {"ratio": "N", "place": "theta"}[name]]
            np.testing.assert_allclose(by, slope, rtol=1e-5, atol=1e-6)


# ---- what is refused ----


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"u": [1.0, 2.0], "u_times": [0.0, 0.2, 0.1]}, r"u_times\[2\] must be > the one before, got 0.1 s"),
        ({"u": [1.0, 2.0], "u_times": [0.0, 0.0]}, r"u_times\[1\] must be > the one before, got 0.0 s"),
        ({"u": [1.0, 2.0], "u_times": [0.1, 0.2]}, r"u_times\[0\] must be 0 s, where u begins, got 0.1"),
        ({"u": [1.0, 2.0], "u_times": [0.0, np.nan]}, r"u_times\[1\] must be finite s, got nan"),
        ({"u": [1.0, 2.0], "u_times": [[0.0, 0.2]]}, r"u_times must have one dimension, got shape \(1, 2\)"),
        ({"u": [1.0, 2.0], "u_times": []}, "u_times must be 1 to 65535 times, got 0"),
        ({"u": [1.0, 2.0], "u_times": [0.0, 0.1, 0.2]}, r"u must have 3 on its last axis, .* u_times, got shape \(2,\)"),
        ({"u": 1.0, "u_times": [0.0, 0.1]}, "u must have 2 on its last axis, a step for each of u_times, got 1.0"),
        ({"u": [[1.0, 2.0], [1.0, np.inf]], "u_times": [0.0, 0.1]}, r"i\[1, 1\] must be finite A|u\[1, 1\] must be finite A"),
        ({"u": [(0.0, 1.0), (0.1, 2.0)]}, "per motion in A; steps are its last axis beside u_times, steps .* are for solve_motion"),
        ({"times": [0.1, -0.2]}, r"times\[1\] must be >= 0 s, got -0.2"),
        ({"times": 0.1}, r"times must have one dimension, got shape \(\)"),
        ({"times": [0.1, "soon"]}, "times must be numbers in s"),
        ({"start": {"q": [1.0, 2.0, 3.0]}, "u": np.ones((2, 2)), "u_times": [0.0, 0.1]}, "must broadcast, got .*'u': "),
        ({"sensitivities": "F_q"}, "sensitivities: there is no derivative by 'F_q', did you mean 'F_"),
        ({"sensitivities": ["q", 3]}, "there is no derivative by 3; names are q, q_dot, i, J, "),
        ({"sensitivities": ["u[1]"]}, r"sensitivities: u\[n\] must have a number of 0 .. 0, got u\[1\]: the input has 1 step"),
        ({"sensitivities": ["t[1]"]}, r"t\[n\] must have no step, got t\[1\]: the input has 1 step, the first at 0 s"),
        ({"sensitivities": ["u[-1]"]}, r"must have a number of 0 .. 0, got u\[-1\]"),
        ({"sensitivities": ["q[0]"]}, r"no derivative by 'q\[0\]'"),
        ({"sensitivities": ("q", "q")}, "sensitivities must have each name once, got 'q' twice"),
        ({"sensitivities": ("u", "i")}, "must have each name once, got 'u' and 'i', which are the same"),
        ({"sensitivities": ()}, "sensitivities must have at least one name, got none"),
        ({"sensitivities": 3}, "sensitivities must be names, such as 'u' and 'u\\[3\\]', got 3"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_by_name_index_and_value(joint, given, words):
    with pytest.raises(HopformError, match=words):
        joint.solve_motions(joint.Robot(), **given)


def test_a_motion_refuses_the_same_names(joint):
    motion = one_by_one(joint, drawn(1), 1.0)[0]
    with pytest.raises(HopformError, match=r"^names: t\[n\] must have a number of 1 .. 4, got t\[5\]: .* 5 steps"):
        motion.sensitivities_by(["t[5]"])
    with pytest.raises(HopformError, match=r"^by: there is no derivative by 'w\[2\]'"):
        motion.derivatives(0.1, by="w[2]")


def test_no_more_is_begun_than_fits_into_memory(joint):
    with pytest.raises(HopformError, match=r"must broadcast to at most \d+ motions, got shape \(1000, 100\)"):
        joint.solve_motions(
            joint.Robot(), start={"q_dot": np.ones((1000, 100))}, times=np.linspace(0.0, 1.0, 100), sensitivities=True
        )
    with pytest.raises(HopformError, match="must take at most 2147483648 bytes, got .*: 2000000 times by 18 columns"):
        joint.solve_motions(joint.Robot(), times=np.broadcast_to(0.1, 2_000_000), sensitivities=True)


# ---- labelled ----


def test_labels_name_the_steps_and_the_times(joint, xarray):
    given = drawn()
    plain = batch_of(joint, given, u_times=BEGINS, times=SEEN, sensitivities=BY)
    u = xarray.DataArray(given["u"].T, dims=("tick", "case"), coords={"case": np.arange(6)})
    other = {name: xarray.DataArray(given[name], dims="case") for name in ("J", "b", "k", "F_p", "start")}
    begins, seen = xarray.DataArray(BEGINS, dims="tick"), xarray.DataArray(SEEN, dims="seconds")
    batch = batch_of(joint, {**other, "u": u}, u_times=begins, times=seen, sensitivities=BY)
    np.testing.assert_array_equal(batch.state_sensitivities.matrix, plain.state_sensitivities.matrix)
    found = batch.to_xarray()
    assert found["state_q"].dims == ("case", "seconds") and found["state_q"].attrs == {"units": "rad"}
    assert found["input"].dims == ("case", "tick") and found["input"].attrs == {"units": "A"}
    assert found["tick"].attrs == found["seconds"].attrs == {"units": "s"}
    assert found["state_derivative"].dims == ("case", "seconds", "state_row", "state_column")
    assert found["column"].values.tolist() == [*BY]
    assert float(found["input"].sel(case=2, tick=0.2)) == given["u"][2, 2]
    last = batch_of(joint, {**other, "u": u.transpose("case", "tick")}, u_times=BEGINS)
    np.testing.assert_array_equal(last.end.q, plain.end.q)
    assert plain.to_xarray()["state_q"].dims == ("dim_0", "time") and "step" in plain.to_xarray().dims
    shared = batch_of(joint, {**other, "u": given["u"][1]}, u_times=BEGINS)
    assert shared.to_xarray()["input"].dims == ("case", "step")
    with pytest.raises(HopformError, match="u must have the dimension step of u_times, got tick, case"):
        batch_of(joint, {**other, "u": u}, u_times=xarray.DataArray(BEGINS, dims="step"))
    with pytest.raises(HopformError, match="times: the dimension case must be none of the inputs, got case"):
        batch_of(joint, {**other, "u": u}, u_times=begins, times=xarray.DataArray(SEEN, dims="case"))


@pytest.mark.usefixtures("drawing")
def test_a_batch_over_time_shows_itself(joint):
    batch = batch_of(joint, drawn(), u_times=BEGINS, times=SEEN, sensitivities=BY)
    assert "steps = 5, times = 6" in repr(batch) and "<svg" in batch._repr_html_()
    assert "d T/d q" in repr(batch.sensitivities)
    with pytest.raises(ValueError, match="read-only"):
        batch.u[...] = 0.0
    stances = hopform.solve_stances(HOPPER, v2=[-1.93, -1.0], u=[1.0, 2.0], u_times=[0.0, 0.05], times=[0.05])
    assert stances.plot().get_ylabel() == "apex [cm]"


# ---- what they are for ----


@pytest.mark.sliced
@pytest.mark.parametrize("hertz", [0.25, 1.0])
def test_a_joint_under_recorded_torque_is_fitted_by_these_gradients(joint, hertz):
    """300 samples at 60 Hz, torque as steps, noise of 0.1 mrad: viscous friction within 1 %, from starts 50 % off, where
    friction that is smoothed by tanh(100 q') and integrated in steps of 1.9 ms is off by 14 to 180 %.
    """
    optimize = pytest.importorskip("scipy.optimize")
    by, truth = ("J", "b", "F_p", "F_m"), np.array([0.031, 0.0085, 0.35, 0.35])
    begins = np.arange(300) / 60.0
    u = 6.0 * np.sin(2.0 * np.pi * hertz * begins)

    def solved(x: np.ndarray, wanted: Any = False) -> Any:
        fields = dict(zip(by, x.tolist(), strict=True))
        times = begins + 1.0 / 60.0
        return joint.solve_motions(
            joint.Robot(), u=u, u_times=begins, times=times, horizon=6.0, sensitivities=wanted, **fields
        )

    measured = solved(truth).states.q + 1e-4 * np.random.default_rng(2).standard_normal(300)
    fit = optimize.least_squares(
        lambda x: solved(x).states.q - measured, truth * [1.5, 0.5, 0.6, 0.6], x_scale=truth,
        jac=lambda x: solved(x, by).state_sensitivities.matrix[:, 0],
    )  # fmt: skip
    assert np.abs(fit.x / truth - 1.0)[1] < 0.01
    assert np.sqrt(2.0 * fit.cost / 300) < 1.1e-4
