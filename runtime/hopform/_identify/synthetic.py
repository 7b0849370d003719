"""Synthetic recordings of any robot, with noise, encoder quantum and rate: to plan experiments with, and to prove the
fits.
"""

import math
from typing import Any, SupportsFloat

import numpy as np

from hopform._checks import MEMORY, flag, nonnegative, positive, whole, word
from hopform._errors import HopformError
from hopform._identify import rigs
from hopform._identify.motion import Array
from hopform._identify.recordings import Column, Recording, current_steps
from hopform._robots import Robot, checked_robot
from hopform._solver.package import records

TESTS = ("drop", "free", "decay", "step", "air", "ramp")

MOST_SAMPLES = MEMORY // 1024
"""Samples of a recording at most: in arrays and as text each takes up to 1 kB."""
NOISE = 2e-4
QUANTUM = 1.0 / 56000.0


def record(
    robot: Robot,
    test: str,
    *,
    duration: SupportsFloat = 2.0,
    rate: SupportsFloat = 500.0,
    noise: SupportsFloat = NOISE,
    quantum: SupportsFloat = QUANTUM,
    height: SupportsFloat = 0.2,
    current: SupportsFloat | None = None,
    hold: SupportsFloat = 0.2,
    added_mass: SupportsFloat = 0.0,
    repeats: int = 1,
    spring: bool = False,
    seed: int | None = None,
) -> Recording:
    """A synthetic recording of a robot in a test.

    test: "drop" (released at hop height `height` [m], actuator held, flights and impacts included), "free" (the same,
    the actuator free within its stops under currents of both signs from the release on; x1 is recorded too), "decay"
    (the body fixed to its spring, pulled down by `height`), "step" (the body held, currents +-`current` [A] in turn),
    "air" (the same without a spring), "ramp" (in the air, or against the spring if `spring`, the current grows to
    `current` [A] and, from rest again, to its negative). current: u_max if not given. hold [s]: of stillness at first,
    but in a decay. duration [s]: of a motion; a drop or a decay is repeated `repeats` times, the body taken back by
    hand in between. rate [Hz], noise [m] (standard deviation), quantum [m] (0 for none). The same seed gives the same
    recording, None another one each time. Raises HopformError for a value that is not allowed.

    >>> import hopform
    >>> recording = record(hopform.load_robot("hopper_c"), "step", seed=1)
    >>> recording.time.size, sorted(recording.columns)
    (1001, ['current', 'x1'])
    """
    checked_robot(robot)
    word("test", test, TESTS)
    whole("repeats", repeats, most=1000)
    if repeats > 1 and test not in ("drop", "decay"):
        raise HopformError(f"repeats are for a drop or a decay, got {test!r}")
    draw = np.random.default_rng() if seed is None else np.random.default_rng(whole("seed", seed, 0, math.inf))
    encoder = nonnegative("noise", noise, "m"), nonnegative("quantum", quantum, "m"), draw
    length, hertz = positive("duration", duration, "s"), positive("rate", rate, "Hz")
    if not 18.5 < length * hertz < records.MOST_STEPS - 0.5:
        message = f"duration times rate must give 20 to {records.MOST_STEPS} samples, got {length * hertz + 1.0:.6g}"
        raise HopformError(message)
    time = np.arange(round(length * hertz) + 1) / hertz
    if repeats * (time.size + hertz) > MOST_SAMPLES:
        most = int(MOST_SAMPLES / (time.size + hertz))
        raise HopformError(f"repeats must be at most {most} for so many samples each, got {repeats}")
    against = flag("spring", spring)
    still, mass = nonnegative("hold", hold, "s"), nonnegative("added_mass", added_mass, "kg")
    if not still <= time[-1]:
        raise HopformError(f"hold must be <= {float(time[-1])!r} s, the duration, got {still!r}")
    largest = robot.u_max if math.isfinite(robot.u_max) else 1.0
    u = _current(test, time, still, largest if current is None else positive("current", current, "A"))
    if test in ("drop", "free", "decay"):
        x, x1 = _body(robot, test, time, positive("height", height, "m"), still, mass, u)
        if repeats > 1:
            x, time = _again(x, repeats, hertz)
        columns = {"x2": _column("x2_m", 2, x, *encoder)}
    else:
        values = robot.parameters._asdict() | {"rest": 0.0, "offset": 0.0, "x": 0.0, "v": 0.0}
        x1 = _of("held" if test == "step" or against else "air", values, time, steps=current_steps(time, u))
        columns = {"x1": _column("x1_m", 2, x1, *encoder)}
    if test not in ("drop", "decay"):
        columns["current"] = Column("current_A", "current", 3, u)
    if test == "free":
        columns["x1"] = _column("x1_m", 4, x1, *encoder)
    return Recording(f"{robot.name or 'robot'}, {test}", time, columns, 2, mass)


def to_csv(recording: Recording) -> str:
    """A recording as the CSV text that `read_recording` reads."""
    columns = sorted(recording.columns.values(), key=lambda column: column.place)
    head = ",".join(["time_s", *(column.title for column in columns)])
    rows = zip(recording.time.tolist(), *(column.values.tolist() for column in columns), strict=True)
    return "\n".join([head, *(",".join(f"{value:.9g}" for value in row) for row in rows)]) + "\n"


def _column(title: str, place: int, x: Array, noise: float, quantum: float, rng: "np.random.Generator") -> Column:
    """A position [m] as a sensor of a noise and a quantum [m] has it."""
    with np.errstate(over="ignore"):
        values = x + noise * rng.standard_normal(x.size)
    if not bool(np.isfinite(values).all()):
        raise HopformError(f"{title} must stay within all numbers: a smaller height, current or noise is needed")
    if quantum > np.spacing(np.abs(values)).max():  # a step that is finer than the last digit rounds nothing
        values = quantum * np.round(values / quantum)
    return Column(title, "length", place, values)


def _current(test: str, time: Array, still: float, most: float) -> Array:
    """The current over a test, 0 where there is none: after stillness pulses of both signs, or ramps."""
    if test not in _PATTERNS:
        return _ramps(time, still, most) if test == "ramp" else np.zeros(time.size)
    pattern = np.array(_PATTERNS[test])
    part = np.floor(pattern.size * (time - still) / max(float(time[-1]) - still, 1e-9)).astype(int)
    return np.where(time < still, 0.0, pattern[np.clip(part, 0, pattern.size - 1)] * most)


def _body(robot: Robot, test: str, time: Array, fall: float, hold: float, mass: float, u: Array) -> tuple[Array, Array]:
    """x2 and x1 of a body that is let go after a while; a decay without stillness begins with the oscillation."""
    values = robot.parameters._asdict() | {"v": 0.0, "length": robot.L0 + robot.c}
    if test == "decay":
        values |= {"g": 0.0, "rest": 0.0, "x": -fall}
        return _of("attached", values, time, mass), np.zeros(time.size)
    values["x"] = values["length"] + fall
    falls = time >= hold
    x, x1 = np.full(time.size, values["x"]), np.zeros(time.size)
    since = time[falls] - hold
    if test == "drop":
        x[falls] = _of("ground", values, since, mass)
        return x, x1
    values |= {"offset": -robot.k * robot.c / robot.gamma2, "x1": 0.0, "v1": 0.0}
    values |= {"x1_min": min(robot.x1_min, 0.0), "x1_max": max(robot.x1_max, 0.0)}
    # A sample holds until the next.
    steps = ((0.0, 0.0), *((since[0] + t, each) for t, each in current_steps(since, u[falls])))
    x[falls], x1[falls] = (_of("free", values, since, mass, steps=steps, of=which) for which in ("x2", "x1"))
    return x, x1


def _again(x: Array, repeats: int, rate: float) -> tuple[Array, Array]:
    """A motion several times, between which a hand takes the body back within 0.6 s and holds it for 0.3 s; and its
    times.
    """
    t = np.linspace(0.0, 1.0, max(round(0.6 * rate), 2))
    back = x[-1] + (x[0] - x[-1]) * (3.0 * t**2 - 2.0 * t**3)
    whole = np.concatenate([x, *([back, np.full(max(round(0.3 * rate), 1), x[0]), x] * (repeats - 1))])
    return whole, np.arange(whole.size) / rate


def _of(kind: rigs.Kind, values: dict[str, float], time: Array, added: float = 0.0, **how: Any) -> Array:
    """What is measured on a rig; how: the steps of the current, and of which mass."""
    reach = np.array([0.0, abs(values["x"]) + 1.0])
    return rigs.Experiment("", kind, time, reach, {}, values, added_mass=added, **how).predict({})[0]


_PATTERNS = dict.fromkeys(("step", "air"), (1.0, -1.0, 0.5, -0.5)) | {"free": (0.7, -0.35, 1.0, -0.7, 0.35)}
"""Shares of the largest current, held as long each."""


def _ramps(time: Array, still: float, most: float) -> Array:
    """Up to the largest current in the first half, back to 0, down to its negative in the second."""
    half = 0.5 * float(time[-1])
    part = np.where(time < half, time, time - half)
    return np.where(time < half, 1.0, -1.0) * most * np.clip((part - still) / max(half - still, 1e-9), 0.0, 1.0)
