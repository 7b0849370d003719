"""Fits of a model with a law, from the target and the position that a controller's log has.

Motions and recordings are those of tests/oracle/controller.py, which shares nothing with hopform.
"""

import dataclasses
import math
from typing import Any

import mpmath
import numpy as np
import pytest

import hopform
import hopform.identify
from hopform import HopformError
from hopform._sensitivities import STARTS
from hopform.identify import _estimation as estimation
from hopform.identify._closed_loop import Loop, Ticks, between, law_of
from hopform.identify._commands import refuse_no_fit
from hopform.identify._models import seen_by
from hopform.identify._recordings import Recording, parse_recording
from tests.derived import SHIPPED, solver_of
from tests.fits import ALONE
from tests.oracle import controller
from tests.oracle.controller import Servo, chirp

KNOWN: dict[str, Any] = {"K_p": 8.0, "K_d": 0.9, "F_m": "F_p"}
RIG = Servo(F_m=0.035, F_sp=0.02, load=0.01, i_max=2.5)
PERIOD, COUNT = 1.0 / 400.0, 240


@pytest.fixture(scope="module")
def servo(store) -> Any:
    return solver_of(store, SHIPPED / "servo.py")


TURNS = ((0.1013, 0.02, 0.0), (0.2513, 0.02, 0.9), (0.4013, 0.155, -1.2), (math.inf, -0.025, 0.0))
"""Until when, from where and how fast a target goes, which changes between ticks."""


def target(t: Any) -> Any:
    """Stands, turns back and stands, so that the joint sticks, starts and meets its limit of current."""
    begin = 0.0
    for end, first, slope in TURNS:
        if t < end:
            return first + slope * (t - begin)
        begin = end
    raise ValueError(t)


def slope_of(t: float) -> float:
    return next(slope for end, _, slope in TURNS if t < end)


def loop_of(servo: Any, rig: Servo) -> tuple[Loop, Any]:
    core = servo.Robot.solver
    law = law_of(core)
    assert law is not None
    robot = core.package.records.Robot(**dataclasses.asdict(rig), q_min=-math.inf, q_max=math.inf)
    return Loop(core, law, robot), robot


def ticks_of(differs: bool) -> Ticks:
    return Ticks(PERIOD, np.array([target(k * PERIOD) for k in range(COUNT)]), differs)


ROUNDING = 1e-12
"""[rad, rad/s] what rounding adds up to over the ticks, in which errors of a current are fed back."""


def exactly(dead_time: float, start: tuple[float, float], count: int, differs: bool = False) -> np.ndarray:
    """States at the ticks, in 30 digits."""
    with mpmath.workdps(30):
        rig = Servo(**{name: mpmath.mpf(value) for name, value in dataclasses.asdict(RIG).items()})
        begin = mpmath.mpf(start[0]), mpmath.mpf(start[1])
        moved = controller.moved(
            rig, target, begin, count, mpmath.mpf(PERIOD), dead_time, maths=mpmath, differs=differs
        )  # fmt: skip
        return np.array(moved, float)


DEAD_TIMES = ((0.0, False), (2.0 * PERIOD, True), (0.4 * PERIOD, False), (1.7 * PERIOD, True))
"""Each with whether the velocity of the law is a difference of places."""


@pytest.mark.parametrize(("dead_time", "differs"), DEAD_TIMES)
def test_states_at_ticks_are_those_of_the_joint_tick_by_tick(servo, dead_time, differs):
    """To rounding, through turns, rests, starts and the limit of the current."""
    loop, _ = loop_of(servo, RIG)
    run = loop.run(ticks_of(differs), (0.02, 0.0), dead_time)
    exact = exactly(dead_time, (0.02, 0.0), COUNT, differs)
    np.testing.assert_allclose(run.states, exact, rtol=0.0, atol=ROUNDING)
    held = [int(np.count_nonzero(each.kinds == 0)) for each in run.sections]
    assert min(held) > 10 and sum(len(each.solved) for each in run.sections) >= 2 and run.beyond.any()


@pytest.mark.parametrize(("dead_time", "differs"), DEAD_TIMES[2:])
def test_derivatives_are_those_of_50_digits(servo, dead_time, differs):
    """By the start, every parameter, the delay of the target and the dead time, against differences of the joint
    solved tick by tick in 50 digits.
    """
    loop, robot = loop_of(servo, RIG)
    ticks, start = ticks_of(differs), (0.02, 0.3)
    run = loop.run(ticks, start, dead_time)
    slope = np.array([slope_of(k * PERIOD) for k in range(COUNT)])
    letters = ("J", "b", "F_p", "F_m", "F_sp", "load", "k_t", "K_p", "K_d", "i_max")
    by = loop.by(run, ticks, slope, {name: len(STARTS) + robot._fields.index(name) for name in letters})
    with mpmath.workdps(50):
        step = mpmath.mpf(10) ** -20
        exact = {name: mpmath.mpf(value) for name, value in dataclasses.asdict(RIG).items()}
        whole = {"x": start[0], "v": start[1], "dead_time": dead_time, "delay": 0.0}
        at = exact | {name: mpmath.mpf(value) for name, value in whole.items()}

        def states(change: dict[str, Any]) -> Any:
            place = at | change
            rig = Servo(**{name: place[name] for name in exact})
            now = place["x"], place["v"]
            late = place["dead_time"], place["delay"]
            period = mpmath.mpf(PERIOD)
            return np.array(controller.moved(rig, target, now, COUNT, period, *late, maths=mpmath, differs=differs))

        for name in (*letters, *whole):
            difference = (states({name: at[name] + step}) - states({name: at[name] - step})) / (2 * step)
            expected = np.array(difference, dtype=float)
            size = np.abs(expected).max(axis=0) + 1e-9
            assert float((np.abs(by[name] - expected) / size).max()) < 1e-8, name


def test_between_ticks_a_sample_is_on_the_motion():
    """The cubic through places and velocities at ticks, against ticks that are four times as close."""
    rig = dataclasses.replace(RIG, K_p=0.0, K_d=0.0, F_p=0.0, F_m=0.0, F_sp=0.0)
    fine = np.array(controller.moved(rig, target, (0.1, 0.8), 40, 0.25 * PERIOD), dtype=float)
    times = 0.25 * PERIOD * np.arange(41)
    np.testing.assert_allclose(between(fine[::4], PERIOD, times), fine, rtol=0.0, atol=1e-9)


def logged(seed: int, rate: float = 400.0, duration: float = 4.0, **how: Any) -> Recording:
    rng = np.random.default_rng([60, seed])
    return parse_recording(
        controller.log(Servo(), chirp(0.3, 0.3, 4.0, duration), duration, rate, rng, **how), "log.csv"
    )  # fmt: skip


def holds(fit: Any, **truth: float) -> list[str]:
    """What of the truth is not within 1.5 times the 95 % interval: three standard errors."""
    off = {name: abs(0.5 * (fit[name].low + fit[name].high) - value) for name, value in truth.items()}
    return [name for name, each in off.items() if not each <= 0.75 * (fit[name].high - fit[name].low)]


TRUTH = {"J": 0.031, "b": 0.0085, "F_p": 0.042}


@pytest.mark.sliced
@pytest.mark.parametrize(("dead_time", "delay"), [(0.005, 0.0), (0.0017, 0.003)])
def test_a_joint_is_found_under_its_controller(servo, dead_time, delay):
    """And is not without the delays: then its inertia is off by 80 standard errors of the noise."""
    recording = logged(4, dead_time=dead_time, delay=delay)
    fit = hopform.identify.fit(servo, recording, fitted=[*TRUTH], known=KNOWN, rate=400.0, **ALONE)
    assert not fit.warnings
    assert holds(fit, **TRUTH, dead_time=dead_time, **{"delay@0": delay}) == []
    assert fit["J"].value == fit.robot().J and fit.robot().K_p == 8.0
    solution = fit.solution
    assert solution is not None
    rest = [p for p in estimation.started(solution) if p.name not in ("delay@0", "dead_time")]
    bare = estimation.again(solution, solution.experiments, rest, fixed={"delay@0": 0.0, "dead_time": 0.0})
    number = [p.name for p in solution.parameters].index("J")
    assert abs(bare.values["J"] - 0.031) > 80.0 * math.sqrt(estimation.spread(solution).covariance[number, number])
    assert bare.cost > 3.0 * solution.cost


@pytest.mark.sliced
def test_a_target_of_another_run_is_asked_about_by_its_column(servo):
    made, known = logged(4, duration=1.0), KNOWN | {"b": 0.0085, "F_p": 0.042, "F_m": 0.042}
    target = made.columns["goal"]
    columns = made.columns | {"goal": target._replace(values=target.values[::-1])}
    other = dataclasses.replace(made, columns=columns)
    fit = hopform.identify.fit(servo, other, fitted=["J"], known=known, rate=400.0, **ALONE)
    with pytest.raises(HopformError, match=r"log.csv, line \d+, column 'position_rad': the fit explains") as error:
        refuse_no_fit(fit, [seen_by(servo.Robot.solver, other)], ())
    assert "are position_rad and goal_rad from the same run, each in its column with its sign" in str(error.value)


@pytest.mark.sliced
def test_a_log_of_every_second_tick_is_said_to_be_one_and_fitted(servo):
    recording = logged(2, rate=800.0, dead_time=0.005, every=2)
    fit = hopform.identify.fit(servo, recording, fitted=[*TRUTH], known=KNOWN, rate=800.0, **ALONE)
    assert any("every second tick of the controller, 400 of 800 Hz" in each for each in fit.statements)
    assert holds(fit, **TRUTH) == []


@pytest.mark.sliced
def test_times_in_whole_milliseconds_are_those_of_the_ticks(servo):
    """A logger's digits move no sample from its tick."""
    text = controller.log(
        Servo(), chirp(0.3, 0.3, 4.0, 4.0), 4.0, 400.0, np.random.default_rng(5), dead_time=0.005
    )  # fmt: skip
    head, *rows = text.splitlines()
    cells = [row.partition(",") for row in rows]
    rounded = "\n".join([head, *(f"{round(float(t), 3):.3f},{rest}" for t, _, rest in cells)])
    fits = [
        hopform.identify.fit(servo, parse_recording(each, "log.csv"), fitted=[*TRUTH], known=KNOWN, rate=400.0, **ALONE)
        for each in (text, rounded)
    ]
    assert fits[1]["J"].value == pytest.approx(fits[0]["J"].value, rel=1e-6)


@pytest.mark.sliced
def test_a_controller_that_takes_its_velocity_from_two_positions_is_fitted_as_one(servo):
    """Under the velocity at the tick residuals are not noise; a note says which law it was."""
    recording = logged(6, duration=3.0, dead_time=0.005, differs=True)
    fit = hopform.identify.fit(servo, recording, fitted=[*TRUTH], known=KNOWN, rate=400.0, **ALONE)
    assert not fit.warnings and any("from the difference of two positions" in each for each in fit.statements)
    assert holds(fit, **TRUTH, dead_time=0.005) == []


@pytest.mark.sliced
def test_causes_are_looked_for_where_samples_at_rest_are_left_out(servo):
    """A joint that has arrived: what moves is known at more ticks than were fitted."""
    sweep = chirp(0.3, 0.3, 4.0, 2.0)
    text = controller.log(
        Servo(), lambda t: sweep(min(t, 1.0)), 1.6, 400.0, np.random.default_rng(5), noise=1e-5, quantum=1e-3
    )  # fmt: skip
    how = {**ALONE, "diagnose": True}
    fit = hopform.identify.fit(servo, parse_recording(text, "log.csv"), fitted=[*TRUTH], known=KNOWN, rate=400.0, **how)
    assert any("samples repeat others, at rest" in each for each in fit.statements)
    assert fit.traces[0].tests.rms < 1e-3


def changed(recording: Recording, **columns: Any) -> Recording:
    kept = {name: each for name, each in {**recording.columns, **columns}.items() if each is not None}
    return dataclasses.replace(recording, columns=kept)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"known": {"F_m": "F_p"}}, "known: the law has the gains K_p and K_d, of which K_p and K_d must be given"),
        ({"known": {**KNOWN, "K_d": "F_p"}}, "known: the law has the gains K_p and K_d, of which K_d must be given"),
        ({"rate": None}, "rate: give the sampling rate of the controller, .* log.csv was logged at 400 Hz"),
        ({"rate": 200.0}, "rate must be at least that of the log, 400 Hz in log.csv, got 200 Hz"),
        ({"rate": -1.0}, "rate must be > 0 Hz"),
        ({"sine": True}, "sine: gravity's sine is no term of a fit under a law; the model servo has one"),
        ({"known": {**KNOWN, "K_p": 0.0}}, "the proportional gain of the law must be > 0"),
    ],
)
def test_what_a_closed_loop_lacks_is_refused_by_name(servo, how, said):
    given = {"known": KNOWN, "rate": 400.0} | how
    with pytest.raises(HopformError, match=said):
        hopform.identify.fit(servo, logged(3, duration=0.5), fitted=[*TRUTH], **given, **ALONE)


def test_a_log_without_a_usable_target_is_refused_with_its_columns(servo):
    recording = logged(3, duration=0.5)
    goal = recording.columns["goal"]
    still = goal._replace(values=np.full_like(goal.values, 0.2))
    cases = {
        "no column is the target of the law: name it target, goal, command or setpoint": changed(recording, goal=None),
        "is constant at 0.2 rad": changed(recording, goal=still),
        "must be in rad, as target of the model": changed(recording, goal=goal._replace(quantity="length")),
    }
    for said, each in cases.items():
        with pytest.raises(HopformError, match=said):
            hopform.identify.fit(servo, each, fitted=[*TRUTH], known=KNOWN, rate=400.0, **ALONE)


def test_a_rate_is_for_a_model_with_a_law(store):
    joint = solver_of(store, SHIPPED / "joint.py")
    with pytest.raises(HopformError, match="rate: the model joint has no law"):
        hopform.identify.fit(joint, logged(3, duration=0.5), rate=400.0)
    with pytest.raises(HopformError, match="control_rate: the model joint has no law"):
        hopform.identify.record(joint.Robot(name="joint"), "motion", control_rate=400.0)


@pytest.mark.parametrize("dead_time", [0.0, 0.004, 0.0031])
def test_a_synthetic_log_is_the_joint_tick_by_tick(servo, dead_time):
    """Sampled between ticks too; it has the target, and the current that acts."""
    steps = [(k * PERIOD, float(target(k * PERIOD))) for k in range(COUNT)]
    robot = servo.Robot(name="servo", F_m=0.035, F_sp=0.02, load=0.01, i_max=2.5)
    recording = hopform.identify.record(
        robot, "motion", u=steps, control_rate=1.0 / PERIOD, dead_time=dead_time, rate=1.0 / PERIOD, noise=0.0,
        quantum=0.0, duration=(COUNT - 1) * PERIOD,
    )  # fmt: skip
    exact = exactly(dead_time, (0.0, 0.0), COUNT - 1)
    assert sorted(recording.columns) == ["i", "q", "target"]
    np.testing.assert_allclose(recording.columns["q"].values, exact[:, 0], rtol=0.0, atol=ROUNDING)
    np.testing.assert_array_equal(recording.columns["target"].values, [level for _, level in steps])
    assert np.abs(recording.columns["i"].values).max() == 2.5
