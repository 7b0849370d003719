"""What a recording is compared with: exact motions of each rig,
and their exact derivatives by everything that they depend on.
"""

import dataclasses
import math

import numpy as np
import pytest
from scipy import signal

import hopform
from hopform.identify import _held as held
from hopform.identify import _motion as motion
from hopform.identify._kinds import Cut
from hopform.identify._rigs import LETTERS, Experiment
from hopform.identify._synthetic import record
from tests import needs

HOPPER = hopform.load_robot("hopper_c")
PULSES = tuple((0.05 * n, 0.6 * math.sin(0.5 * n) + 0.1) for n in range(40))

HOLDS = ((0.0, 2.0), (0.37, -1.0), (0.55, 2.5), (0.9, 0.5), (1.4, 3.0))

# What each rig depends on, at values at which masses reverse, stick, slip, take off and land.
RIGS = {
    "decay": {"m_s": 0.57, "k": 712.0, "b2": 0.5, "f2": 0.2, "g": 2.0, "rest": 0.001, "x": 0.02, "v": 0.03},
    "ground": {
        "m_s": 3.0, "k": 1200.0, "b2": 5.0, "f2": 0.6, "g": 9.81, "length": 0.4, "impact_loss": 0.05, "x": 0.6,
        "v": -0.1,
    },
    "free": {
        "m_s": 3.0, "k": 1200.0, "b2": 5.0, "f2": 0.6, "g": 9.81, "length": 0.4, "impact_loss": 0.05, "m_eff": 25.0,
        "b1": 150.0, "f1": 0.78, "gamma2": -65.0, "offset": 0.05, "x1_min": 0.0, "x1_max": 0.08, "x": 0.6, "v": -0.1,
        "x1": 0.01, "v1": 0.05,
    },
    "step": {"m_eff": 0.9, "k": 315.0, "b1": 4.0, "f1": 0.8, "gamma2": -20.0, "rest": 0.001, "x": 0.002, "v": 0.01},
    "air": {"m_eff": 25.0, "b1": 150.0, "f1": 0.3, "gamma2": -65.0, "offset": 0.01, "x": 0.0, "v": 0.01},
}  # fmt: skip


ROLES = held.HELD


def experiment(kind: str, times: int = 301) -> Experiment:
    steps = PULSES if kind in ("step", "air") else HOLDS if kind == "free" else ((0.0, 0.0),)
    names = {each: each for each in {**LETTERS, **held.LETTERS}[kind]}
    if kind in held.LETTERS:
        return ROLES[kind].experiment(
            Cut(
                record(HOPPER, "decay", seed=1),
                0,
                "",
                np.linspace(0.0, 2.0, times),
                np.linspace(0.0, 0.1, times),
                0.0,
                steps,
            ),
            names,
            {},
        )
    return Experiment("", kind, np.linspace(0.0, 2.0, times), np.array([0.0, 0.1]), names, {}, steps)  # type: ignore[arg-type]


@pytest.mark.parametrize("kind", RIGS)
def test_a_rig_s_derivatives_are_the_limits_of_differences(kind):
    """Central differences of 1e-6: their rounding and their own error stay below 1e-6 of the largest derivative."""
    rig, values = experiment(kind), RIGS[kind]
    _, by = rig.predict(values)
    for letter, value in values.items():
        step = 1e-6 * max(abs(value), 0.1)
        up, down = (rig.predict(values | {letter: value + sign * step})[0] for sign in (1.0, -1.0))
        error = np.abs((up - down) / (2.0 * step) - by[letter])
        assert error.max() <= 1e-6 * np.abs(by[letter]).max() + 1e-9, letter


SENSOR = {"delay": 0.0043, "gain": 1.02, "clock": 0.98, "lag": 0.004}


@pytest.mark.parametrize("of", needs.the_first(["x1", "x2"]))
@pytest.mark.parametrize("kind", RIGS)
@pytest.mark.parametrize(
    "letters", needs.the_first([("delay", "gain", "clock", "lag"), ("delay",), ("gain", "clock"), ("lag",)], 2)
)
def test_derivatives_by_sensor_clock_and_logger_are_the_limits_of_differences(kind, letters, of):
    """Also those by all other letters. A lag filters derivatives by cubics between samples 2 ms apart: to 1e-3; without
    one they are exact, but for jumps of the velocity, across which a delay moves it: these samples are left out.
    """
    plain = experiment(kind, times=1001)
    letters = letters if plain.steps != ((0.0, 0.0),) else tuple(each for each in letters if each != "delay")
    rig = dataclasses.replace(plain, names=dict(plain.names) | {each: each for each in letters}, of=of)
    values = RIGS[kind] | {each: SENSOR[each] for each in letters}
    _, by = rig.predict(values)
    within = 2e-3 if "lag" in letters else 1e-6
    for letter, value in values.items():
        step = 1e-6 * max(abs(value), 0.1)
        up, down = (rig.predict(values | {letter: value + sign * step})[0] for sign in (1.0, -1.0))
        error = np.abs((up - down) / (2.0 * step) - by[letter])[50:]
        assert np.quantile(error, 0.98) <= within * np.abs(by[letter]).max() + 1e-9, letter


def test_a_delayed_current_moves_its_steps_and_keeps_the_first():
    steps = ((0.0, 1.0), (0.1, 2.0), (0.2, 3.0))
    assert motion.delayed(steps, 0.05) == ((0.0, 1.0), (pytest.approx(0.15), 2.0), (0.25, 3.0))
    assert motion.delayed(steps, -0.15) == ((0.0, 2.0), (pytest.approx(0.05), 3.0))
    assert motion.delayed(steps, 0.0) == steps


def test_a_clock_of_another_speed_is_the_motion_at_other_times():
    rig = experiment("step", times=101)
    fast = dataclasses.replace(rig, names=dict(rig.names) | {"clock": "clock"})
    found, _ = fast.predict(RIGS["step"] | {"clock": 1.02, "v": 0.01 * 1.02})
    true = dataclasses.replace(rig, steps=tuple((1.02 * t, u) for t, u in rig.steps))
    assert np.abs(found - true.predict(RIGS["step"], 1.02 * rig.time)[0]).max() <= 1e-12


def test_a_lag_is_the_filter_of_first_order():
    """Against scipy on a grid a hundred times as fine; a body oscillates through its reversals."""
    rig = experiment("decay", times=1001)
    slow = dataclasses.replace(rig, names=dict(rig.names) | {"lag": "lag"})
    fine = np.linspace(0.0, 2.0, 100001)
    x = rig.predict(RIGS["decay"], fine)[0]
    response = signal.lti([1.0], [0.004, 1.0])
    expected = signal.lsim(response, x - x[0], fine)[1][::100] + x[0]
    found = slow.predict(RIGS["decay"] | {"lag": 0.004})[0]
    assert np.abs(found - expected)[20:].max() <= 2e-7


def test_an_attached_body_oscillates_about_its_rest_as_an_oscillator_does():
    """Without friction x = rest + A cos(w t), w^2 = k/m_s: the closed form of a cart, which knows no take-off."""
    values = RIGS["decay"] | {"b2": 0.0, "f2": 0.0, "g": 0.0, "v": 0.0}
    rig = experiment("decay")
    expected = 0.001 + 0.019 * np.cos(math.sqrt(712.0 / 0.57) * rig.time)
    assert np.abs(rig.predict(values)[0] - expected).max() <= 1e-13


def test_a_drop_is_what_solve_flight_and_solve_stance_make_of_it():
    robot = dataclasses.replace(HOPPER, x1_min=0.0, x1_max=0.0)
    flight = hopform.solve_flight(robot, v2=0.0, x2=0.6)
    landed = flight.touchdown
    stance = hopform.solve_stance(robot, v2=landed.v2)
    second = hopform.solve_flight(robot, v2=stance.takeoff.v2)
    begins = np.cumsum([0.0, flight.duration, stance.duration])
    times = np.concatenate(
        [b + np.linspace(0.01, 0.9, 7) * s.duration for b, s in zip(begins, (flight, stance, second), strict=True)]
    )
    expected = np.concatenate([s.at(np.linspace(0.01, 0.9, 7) * s.duration).x2 for s in (flight, stance, second)])
    assert (
        np.abs(motion.drop(robot.parameters, (0.0, 0.0, 0.6, 0.0), ((0.0, 0.0),), times).states[:, 2] - expected).max()
        <= 1e-12
    )


def test_a_drop_over_a_free_actuator_is_what_solve_flight_and_solve_stance_make_of_it():
    """Without a current both are the same motion: flights under gains of 0, stances at u = 0, one after the other."""
    robot = dataclasses.replace(HOPPER, x1_min=-0.2, x1_max=0.2)
    times, expected, begin = [], [], 0.0
    state = {"x1": 0.02, "v1": 0.1, "x2": 0.6, "v2": 0.0}
    for _ in range(2):
        flight = hopform.solve_flight(robot, **state, gains=(0.0, 0.0))
        stance = hopform.solve_stance(robot, **flight.touchdown._asdict() | {"x2": None})
        for part in (flight, stance):
            t = np.linspace(0.01, 0.9, 9) * part.duration
            times.append(begin + t)
            expected.append(np.stack(part.at(t)[:4], axis=1))
            begin += part.duration
        state = stance.takeoff._asdict()
    moved = motion.drop(robot.parameters, (0.02, 0.1, 0.6, 0.0), ((0.0, 0.0),), np.concatenate(times))
    assert np.abs(moved.states - np.concatenate(expected)).max() <= 1e-11


def test_steps_of_the_current_come_when_the_clock_says():
    """A drop in two halves, the second from where the first came to, is the drop in one:
    also in flight and in stance.
    """
    for change in (0.1, 0.3):
        steps = ((0.0, 2.0), (change, -1.5), (0.9, 1.0))
        times = np.linspace(0.0, 1.5, 151)
        whole = motion.drop(HOPPER.parameters, (0.0, 0.0, 0.6, 0.0), steps, times).states
        cut = 70
        rest = tuple((max(t - times[cut], 0.0), u) for t, u in steps[1:])
        second = motion.drop(HOPPER.parameters, whole[cut].tolist(), rest, times[cut:] - times[cut]).states
        assert np.abs(second - whole[cut:]).max() <= 1e-10
