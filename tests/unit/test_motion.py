"""Motions of models without a contact: closed forms, derivatives at every ending and at any time, forces that balance,
starts by name, batches, and what shows them.
"""

import dataclasses
import pickle
from typing import Any

import numpy as np
import pytest
import sympy as sp

import hopform
from hopform import _figures as results
from tests.derived import SHIPPED, solver_of
from tests.oracle import mechanism
from tests.oracle.mechanism import builders
from tests.oracle.mechanism.numbers import mp

HOPPER = hopform.load_robot("hopper_c")
INF = float("inf")
Q, V, U = "q", "q_dot", "i"
"""What the joint's coordinate, velocity and input are called."""


@pytest.fixture(scope="module")
def joint(store) -> Any:
    return solver_of(store, SHIPPED / "joint.py")


@pytest.fixture(scope="module")
def rig(store) -> Any:
    return solver_of(store, "rig")


NAMES = {
    "m": "J", "gamma": "k_t", "F_plus": "F_p", "F_minus": "F_m", "v": V, "u": U,
    **{name: name for name in ("q", "k", "q_0", "b", "load", "q_min", "q_max")},
}  # fmt: skip
"""The oracle's joint m q'' = -k (q - q_0) - b q' + gamma u + load - F, F by the sign of q', by the model's names."""


def joint_of(solver: Any, **given: float) -> Any:
    """A joint by the oracle's letters; friction, damping, spring and load are 0 and stops far away if left out."""
    usual = {"b": 0.0, "F_plus": 0.0, "F_minus": 0.0, "gamma": 1.0}
    return solver.Robot(**{NAMES.get(name, name): value for name, value in (usual | given).items()})


def rigged(solver: Any) -> Any:
    """hopper_c with a bolted foot, which has no impact."""
    return solver.Robot(**{field.name: getattr(HOPPER, field.name) for field in solver.Robot.fields()})


def by_physics(by: Any, row: str) -> dict[str, float]:
    """A row of derivatives by the oracle's letters."""
    return {name: by[row, column] for name, column in NAMES.items()}


# ---- a closed form ----


def test_a_spin_down_rests_where_and_when_the_closed_form_says(joint):
    """I w' = -b w - F from w0: T = (I/b) ln(1 + b w0/F), angle = I w0/b - (F I/b^2) ln(1 + b w0/F)."""
    inertia, b, F, w0 = sp.symbols("I b F w0", positive=True)
    numbers = {
        inertia: sp.Rational("0.031"),
        b: sp.Rational("0.0085"),
        F: sp.Rational("0.042"),
        w0: sp.Rational("11.5"),
    }
    time = inertia / b * sp.log(1 + b * w0 / F)
    angle = inertia * w0 / b - F * inertia / b**2 * sp.log(1 + b * w0 / F)
    robot = joint_of(joint, m=0.031, b=0.0085, F_plus=0.042, F_minus=0.042)
    motion = joint.solve_motion(robot, start={V: 11.5}, horizon=20.0)
    assert motion.status == "rest" and [event.kind for event in motion.events] == [f"{Q}_sticks"]
    assert motion.duration == pytest.approx(4.384441212506710, rel=1e-15)
    assert motion.end[0] == pytest.approx(float(angle.evalf(40, numbers)), rel=1e-15)
    for row, value in (("T", time), (Q, angle)):
        found = by_physics(motion.sensitivities, row)
        for name, symbol in {"F_plus": F, "b": b, "m": inertia, "v": w0}.items():
            exact = float(value.diff(symbol).evalf(40, numbers))
            assert found[name] == pytest.approx(exact, rel=1e-12), (row, name)
        assert found["q"] == (row == Q) and found["F_minus"] == 0.0
    assert motion.sensitivities[V, "b"] == 0.0


def test_a_rest_begins_when_the_last_mass_is_held_whatever_steps_move_nothing(joint):
    """A step to a current that friction holds changes nothing; one that it does not hold begins a phase."""
    robot = joint_of(joint, m=0.5, F_plus=1.0, F_minus=1.0)
    steps = [(0.0, 0.0), (2.0, 0.5), (3.0, -0.9)]
    motion = joint.solve_motion(robot, start={V: 1.0}, u=steps, horizon=5.0)
    assert (motion.status, motion.duration, motion.end) == ("rest", 0.5, (0.25, 0.0))
    assert [(phase.start, phase.end) for phase in motion.phases] == [(0.0, 0.5), (0.5, 0.5)]
    assert motion.at(4.0) == motion.end and motion.forces(0.5)[f"friction_{Q}"] == 0.0
    assert motion.sensitivities["T", V] == pytest.approx(0.5)  # v0 m/F
    again = joint.solve_motion(robot, start={V: 1.0}, u=[*steps, (4.0, 1.5)], horizon=4.5)
    assert (again.status, [event.kind for event in again.events]) == ("horizon", [f"{Q}_sticks", f"{Q}_slips"])
    assert [phase.start for phase in again.phases] == [0.0, 0.5, 2.0, 3.0, 4.0]
    still = joint.solve_motion(robot, u=[(0.0, 0.0), (1.0, 0.5)], horizon=5.0)
    assert (still.status, still.duration, len(still.phases)) == ("rest", 0.0, 1)


# ---- derivatives against 60 digits ----

SERVO = {"m": 2.0, "k": 50.0, "q_0": 0.125, "b": 1.0, "F_plus": 3.0, "F_minus": 1.0, "q_min": -0.0625, "q_max": 1.0}
CASES: dict[str, tuple[dict[str, float], dict[str, float], Any, float, str]] = {
    "a servo that rests": (SERVO, {"q": 0.5}, [(0.0, 0.0), (0.7, 4.0)], 5.0, "rest"),
    "a servo under way": (SERVO, {"q": 0.5}, [(0.0, 0.0), (0.7, 4.0)], 0.9, "horizon"),
    "a cart onto its stop": ({"m": 0.5, "b": 2.0, "F_plus": 0.25, "q_max": 0.25}, {"v": 1.0}, 0.5, 5.0, "rest"),
    "a spring that pulls": (
        {"m": 0.5, "k": 8.0, "q_0": 1.0, "load": -0.5},
        {"q": -2.0, "v": 0.5},
        0.25,
        3.0,
        "horizon",
    ),
}


def exact(parameters: dict[str, Any], start: dict[str, Any], u: Any, horizon: float) -> Any:
    """The oracle's answer: duration and state at the ending."""
    solved = mechanism.solve(builders.joint(**parameters, **start, u=u, horizon=repr(horizon)))
    return solved.status, [solved.duration, solved.final["q"], solved.final["v"]]


def moved(case: Any, name: str, step: Any) -> Any:
    parameters, start, u, horizon, _ = case

    def digits(value: Any) -> str:
        return "inf" if value == INF else "-inf" if value == -INF else str(mp.nstr(mp.mpf(value), 55))

    steps = u if isinstance(u, list) else [(0.0, u)]
    by = step if name == "u" else 0
    shifted = [[digits(t), digits(mp.mpf(current) + by)] for t, current in steps]
    of, at = ({key: digits(mp.mpf(value) + (step if key == name else 0)) for key, value in each.items()}
              for each in ({"q_min": -INF, "q_max": INF, "gamma": 1.0, "load": 0.0, "k": 0.0, "q_0": 0.0, "b": 0.0,
                            "F_plus": 0.0, "F_minus": 0.0} | parameters, {"q": 0.0, "v": 0.0} | start))  # fmt: skip
    return exact(of, at, shifted, horizon)


@pytest.mark.parametrize("name", CASES)
def test_derivatives_at_an_ending_are_those_of_sixty_digits(joint, name):
    """Central differences of a step of 1e-20 are good to 30 digits; a velocity that is held is no input."""
    case = CASES[name]
    parameters, start, u, horizon, ending = case
    robot = joint_of(joint, **parameters)
    named = {{"q": Q, "v": V}[key]: value for key, value in start.items()}
    motion = joint.solve_motion(robot, start=named, u=u, horizon=horizon)
    assert motion.status == ending
    columns = ["q", "u", "k", "b", "load", "m", "q_0", "gamma", "F_plus", "F_minus", "q_max", *(["v"] * ("v" in start))]
    with mp.workdps(70):
        h = mp.mpf("1e-20")
        for column in columns:
            value = {**parameters, **start}.get(column, 0.0)
            if (
                column in ("F_plus", "F_minus", "k", "b")
                and not value
                or abs(value) == INF
                or column == "q_max"
                and column not in parameters
            ):
                continue
            (status, up), (_, down) = (moved(case, column, sign * h) for sign in (1, -1))
            assert status == ending
            for n, row in enumerate(("T", Q, V)):
                theirs = float((up[n] - down[n]) / (2 * h))
                ours = by_physics(motion.sensitivities, row)[column]
                assert ours == pytest.approx(theirs, rel=1e-12, abs=1e-13), (row, column)


def test_derivatives_at_a_time_lead_to_those_at_the_ending(joint):
    """At the horizon they are the same; at rest the state stays; in between by central differences."""
    for name in ("a servo under way", "a servo that rests"):
        parameters, start, u, horizon, _ = CASES[name]
        robot, named = joint_of(joint, **parameters), {Q: start["q"]}
        motion = joint.solve_motion(robot, start=named, u=u, horizon=horizon)
        rows, columns = motion.sensitivities.rows[1:], motion.sensitivities.columns
        last = motion.derivatives(motion.duration)
        assert (last.rows, last.columns, last.matrix.shape) == (rows, columns, (2, len(columns)))
        np.testing.assert_allclose(last.matrix, motion.sensitivities.matrix[1:], rtol=1e-12, atol=1e-14)
        t = np.array([[0.8, 0.1], [0.5, 0.3]])
        up, down = (
            joint.solve_motion(robot, start={Q: start["q"] + h}, u=u, horizon=horizon).at(t)[0] for h in (1e-6, -1e-6)
        )
        np.testing.assert_allclose(motion.derivatives(t)[Q, Q], (up - down) / 2e-6, rtol=1e-7, atol=1e-9)
        assert motion.derivatives(t)[V, "k"].shape == (2, 2)
    assert float(motion.derivatives(99.0)[V, Q]) == 0.0  # at rest a motion goes on for ever


# ---- forces ----


def test_forces_balance_the_motion_of_a_joint(joint):
    """m q'' is their sum with spring, viscous friction and load; held, the sum is 0 and friction within its levels."""
    robot = joint_of(
        joint, m=0.5, k=50.0, q_0=0.1, b=0.3, load=0.25, gamma=2.0, F_plus=0.5, F_minus=1.0, q_min=-0.1, q_max=0.2
    )
    steps = [(0.0, 2.5), (0.6, 20.0), (1.0, -20.0), (1.4, 1.25)]
    motion = joint.solve_motion(robot, start={V: 2.0}, u=steps)
    edges = {0.0, *(phase.start for phase in motion.phases), motion.duration}
    t = np.array([0.5 * (a + b) for a, b in zip(sorted(edges), sorted(edges)[1:], strict=False) if b - a > 1e-3])
    state, forces = motion.at(t), motion.forces(t)
    held = np.array([next(p for p in reversed(motion.phases) if p.start <= each).mode_1 == 0 for each in t])
    rates = (np.asarray(motion.at(t + 1e-6)[1]) - np.asarray(motion.at(t - 1e-6)[1])) / 2e-6
    assert forces.keys() == {f"friction_{Q}", f"stop_{Q}", "input"}
    others = 0.25 - 50.0 * (state[0] - 0.1) - 0.3 * state[1] + forces["input"]
    np.testing.assert_allclose(0.5 * rates, others + forces[f"friction_{Q}"] + forces[f"stop_{Q}"], atol=1e-7)
    np.testing.assert_allclose(forces["input"], 2.0 * np.asarray(motion.current(t)), rtol=1e-15)
    assert held.sum() >= 3 and not held.all()
    assert set(forces[f"friction_{Q}"][~held]) == {-0.5, 1.0} and not forces[f"stop_{Q}"][~held].any()
    assert np.all((forces[f"friction_{Q}"][held] >= -0.5) & (forces[f"friction_{Q}"][held] <= 1.0))
    carried = forces[f"stop_{Q}"]
    assert carried.min() < 0.0 < carried.max()  # it pushes off the upper stop, and off the lower one
    assert set(forces[f"friction_{Q}"][carried < 0.0]) == {-0.5}  # friction takes what it can first


@pytest.mark.sliced
def test_forces_balance_the_motion_of_two_masses(rig):
    """Of the rig the sum of all forces on both masses is the change of their momentum, but for its bolted foot."""
    robot = dataclasses.replace(rigged(rig), x1_max=0.07)
    motion = rig.solve_motion(robot, start={"x1": 0.02, "v1": 0.6, "x2": 0.5, "v2": 0.4}, u=1.0)
    t = np.linspace(0.05, 0.95, 7) * motion.duration
    state, forces, h = motion.at(t), motion.forces(t), 1e-7
    after, before = motion.at(t + h), motion.at(t - h)
    spring = robot.k * (state.x1 - state.x2 + robot.L0)
    for v, mass, others in (
        (
            "v1",
            robot.m_eff,
            -spring - robot.b1 * state.v1 + forces["input"] + forces["friction_x1"] + forces["stop_x1"],
        ),
        ("v2", robot.m_s, spring - robot.b2 * state.v2 - robot.m_s * robot.g + forces["friction_x2"]),
    ):
        rate = (getattr(after, v) - getattr(before, v)) / (2.0 * h)
        np.testing.assert_allclose(mass * rate, others, atol=2e-5)
    assert forces.keys() == {"friction_x1", "stop_x1", "friction_x2", "input"}


def test_a_stance_has_the_contact_among_its_forces(hopper_c):
    stance = hopform.solve_stance(hopper_c, v2=-1.93, u=2.0)
    t = np.array([0.0, 0.05, 0.1])
    np.testing.assert_array_equal(stance.forces(t)["contact"], stance.contact_force(t))
    assert isinstance(stance.forces(0.05)["friction_x2"], float)


# ---- starts ----


def test_a_motion_of_a_hopper_is_its_stance(hopper_c):
    start = {"x1": 0.01, "v1": 0.1, "v2": -1.93}
    motion = hopform.solve_motion(hopper_c, start=start, u=2.0)
    assert type(motion) is hopform.Stance and isinstance(motion, hopform.Motion)
    assert motion == hopform.solve_stance(hopper_c, **start, u=2.0)
    by_leg = hopform.solve_motion(hopper_c, start=start | {"y": 0.01}, u=2.0)
    assert by_leg == hopform.solve_stance(hopper_c, **start, compression=0.01, u=2.0)


@pytest.mark.sliced
def test_a_spring_without_a_contact_pulls(joint, rig):
    """Below the rest of the spring, where a hopper's leg would fly: from q_0 - 0.3 without friction to q_0 + 0.3."""
    robot = joint_of(joint, m=0.5, k=50.0, q_0=0.1)
    motion = joint.solve_motion(robot, start={Q: -0.2}, horizon=0.1 * np.pi)
    assert motion.end[0] == pytest.approx(0.4, abs=1e-15) and motion.warnings == ()
    hopper = rigged(rig)
    low, high = (
        rig.solve_motion(hopper, start={"x1": 0.02, **leg}, u=1.0, horizon=0.3) for leg in ({"y": -0.1}, {"x2": 0.52})
    )
    assert low.end == pytest.approx(high.end, abs=1e-14)
    assert "y" in low.sensitivities.columns and "x2" in high.sensitivities.columns
    np.testing.assert_allclose(low.sensitivities["x2", "y"], -high.sensitivities["x2", "x2"], rtol=1e-12)
    alike = low.sensitivities["x2", "x1"], high.sensitivities["x2", "x1"] + high.sensitivities["x2", "x2"]
    assert alike[0] == pytest.approx(alike[1], abs=1e-12)


@pytest.mark.parametrize(
    ("start", "message"),
    [
        ({"p": 1.0}, r"start: the model joint has no coordinate 'p'; it has q \[rad\], q_dot \[rad/s\]"),
        ({"Q": 1.0}, "no coordinate 'Q', did you mean 'q'"),
        ({7: 1.0}, "no coordinate 7; it has"),
        ({"y": 0.1}, "no coordinate 'y'"),
        ({"v2": 0.1}, "no coordinate 'v2'"),
        ({"q": "up"}, "start q must be a number in rad, got 'up'"),
        ({"q_dot": float("nan")}, "start q_dot must be finite rad/s, got nan"),
        ({"q": 0.3}, r"^q must be within its stroke -0.1 .. 0.2 rad, got 0.3"),
        ([0.1], r"start must be a mapping of names to values, got \[0.1\]"),
    ],
)
def test_a_start_that_is_none_is_refused_by_name(joint, start, message):
    robot = joint_of(joint, m=0.5, q_min=-0.1, q_max=0.2)
    with pytest.raises(hopform.HopformError, match=message):
        joint.solve_motion(robot, start=start)
    if not isinstance(start, list) and start != {"q": 0.3}:
        with pytest.raises(hopform.HopformError, match=message.partition(" must")[0].removeprefix("start ")):
            joint.solve_motions(robot, start={name: [value] for name, value in start.items()})


@pytest.mark.sliced
def test_of_two_coordinates_of_a_leg_one_is_given(rig, hopper_c):
    robot = rigged(rig)
    with pytest.raises(hopform.HopformError, match="give either x2 or y, got x2 = 0.4 and y = 0.1"):
        rig.solve_motion(robot, start={"x2": 0.4, "y": 0.1})
    with pytest.raises(hopform.HopformError, match="give either x2 or y, got x2 = "):
        rig.solve_motions(robot, start={"x2": [0.4], "y": 0.1})
    with pytest.raises(hopform.HopformError, match="compression must be >= 0 m .a contact cannot pull."):
        hopform.solve_motion(hopper_c, start={"y": -0.1})


def test_warnings_are_those_that_mean_something(joint):
    robot = joint_of(joint, m=0.5, k=50.0, gamma=2.0, q_min=-0.1, q_max=0.2, i_max=4.0)
    onto = joint.solve_motion(robot, start={Q: 0.2}, u=6.0)
    assert onto.warnings == (
        "i = 6.0 A is above its limit, 4.0 A",
        "i = 6.0 A pushes the joint against the stop at 0.2 on which it rests",
    )
    assert joint.solve_motion(robot, start={Q: -0.1}, u=3.0).warnings == ()


# ---- what it shows ----


@pytest.fixture
def motion(joint) -> Any:
    robot = dataclasses.replace(joint_of(joint, **SERVO), name="servo")
    return joint.solve_motion(robot, start={Q: 0.5}, u=[(0.0, 0.0), (0.7, 4.0)], horizon=5.0)


def test_a_motion_shows_itself(motion):
    lines = repr(motion).splitlines()
    assert lines[0] == "Motion of servo: rest after 1.8159 s"
    assert lines[1] == f"  {Q} = 0.5 rad, {V} = 0 rad/s, {U} = 2 steps, from 0 A"
    assert lines[2].startswith(f"  {Q} = 0.16546 rad, {V} = 0 rad/s, events = {Q}_hits_stop 0.")
    found = motion.to_xarray([0.0, 1.0])
    assert found[Q].attrs == {"units": "rad"} and found[f"friction_{Q}"].attrs == {"units": "N m"}
    assert list(found.event_kind.values) == [event.kind for event in motion.events]
    axes = motion.plot()
    assert "servo: from" in axes.figure.get_suptitle() and f"{Q} [rad]" in axes.get_ylabel()
    assert motion.units == {Q: "rad", V: "rad/s"}
    again = pickle.loads(pickle.dumps(motion))
    assert again == motion and again.end == motion.end and again.at(0.3) == motion.at(0.3)


def test_a_plot_shows_the_motion_that_it_names(motion):
    place, velocity, forces, energy, current = results.figure_of(motion).axes
    lines = {"friction": forces.lines[0], "stop": forces.lines[1]}
    for line, value in (
        (place.lines[0], lambda t: motion.at(t)[0]), (velocity.lines[0], lambda t: motion.at(t)[1]),
        (lines["friction"], lambda t: motion.forces(t)[f"friction_{Q}"]),
        (lines["stop"], lambda t: motion.forces(t)[f"stop_{Q}"]),
        (energy.lines[0], motion.total_energy), (current.lines[0], motion.current),
    ):  # fmt: skip
        t = np.minimum(line.get_xdata(), motion.duration)
        np.testing.assert_allclose(line.get_ydata(), value(t), rtol=0, atol=1e-12)
        assert t.size > 400
    assert [text.get_text() for text in place.texts] == ["hits stop", "reverses", "sticks"]
    assert [each.get_text() for each in forces.get_legend().get_texts()] == [f"friction_{Q} [N m]", f"stop_{Q} [N m]"]
    assert current.get_ylabel() == "current\ni [A]" and current.get_xlabel() == "time since start [s]"


def test_a_grid_is_what_is_read_at_its_times(motion):
    t, state = motion.grid(7)
    np.testing.assert_allclose(np.array(state), np.array(motion.at(t)), rtol=0, atol=1e-15)
    out = np.empty(7), np.empty(7)
    _, into = motion.grid(7, out=out)
    assert into[0] is out[0] and np.array_equal(np.array(out), np.array(state))
    with pytest.raises(hopform.HopformError, match="out must be 2 arrays, got 1"):
        motion.grid(7, out=[out[0]])


def test_the_ledger_by_element_adds_up_to_the_change_of_the_energy(motion):
    t = np.linspace(0.0, motion.duration, 5)
    by_element = motion.ledger_by_element(t)
    total = sum(work for own in by_element.values() for work in own.values())
    np.testing.assert_allclose(total, motion.total_energy(t) - motion.total_energy(0.0), atol=1e-12)
    assert "body" not in by_element and by_element["joint"]["stop_loss"][-1] < 0.0


def test_explain_has_the_names_of_the_model(motion):
    text = motion.explain()
    assert text.startswith("servo, i in 2 steps, 0 to 4 A; comes to rest after 1.8159 s")
    assert "q - q_min [rad]" in text and "-q_dot [rad/s]" in text and "joint backward" in text and "body" not in text


# ---- many ----


def test_many_motions_are_each_motion(joint):
    robot = joint_of(joint, **SERVO)
    batch = joint.solve_motions(
        robot, start={Q: [0.5, 0.2, 0.125]}, u=[[0.0], [9.0]], k=40.0, horizon=4.0, sensitivities=True, events=True,
    )  # fmt: skip
    for n in np.ndindex(2, 3):
        own = joint.solve_motion(
            dataclasses.replace(robot, k=40.0), start={Q: (0.5, 0.2, 0.125)[n[1]]}, u=(0.0, 9.0)[n[0]], horizon=4.0,
        )  # fmt: skip
        assert (batch.words[n], batch.duration[n], batch.end[0][n]) == (own.status, own.duration, own.end[0])
        assert [word for word in batch.event_words[n] if word] == [event.kind for event in own.events]
        np.testing.assert_array_equal(batch.sensitivities.matrix[n], own.sensitivities.matrix)
    assert batch.sensitivities["T", "b"].shape == (2, 3)
    assert repr(batch).startswith("Batch of 2 x 3 motions: ") and not hasattr(batch, "apex")


def test_a_sweep_goes_over_coordinates_inputs_and_parameters(joint):
    found = joint.sweep(joint_of(joint, **SERVO), **{Q: [0.5, 0.2], "u": [0.0, 9.0, 12.0], "k": 40.0})
    assert dict(found.sizes) == {Q: 2, "u": 3} and found[f"end_{Q}"].attrs == {"units": "rad"}
    one = joint.solve_motion(joint_of(joint, **{**SERVO, "k": 40.0}), start={Q: 0.2}, u=9.0)
    assert float(found.duration.sel({Q: 0.2, "u": 9.0})) == one.duration
    with pytest.raises(hopform.HopformError, match="'x' is neither an input of a motion nor a field of the robot"):
        joint.sweep(joint_of(joint, **SERVO), x=[1.0])
    with pytest.raises(hopform.HopformError, match="^no stance, .*: the model joint has no contact"):
        joint.sweep(joint_of(joint, **SERVO), height=[1.0])
