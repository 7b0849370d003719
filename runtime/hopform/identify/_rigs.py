"""Rigs: what a recording was made on, as a motion of the model in the letters that are fitted.

| rig | what moves | model |
|---|---|---|
| ground | a body that falls, meets the ground and may hop | (4), actuator locked, flight and impact between stances |
| free | the same over an actuator that moves under a given current | (3), (4), the actuator alone in flight |

Any other rig is a model, also the body and the actuator apart from each other (`_held`).

Sensor, clock and logger make of a motion x(t) under a current u(t)

    measured(t) = gain * y(t),    lag y' + y = x(clock t; u(clock (t - delay)))

Each changes the prediction with exact derivatives. A clock that runs at another speed rescales the letters of the rig
by dimension (k by clock^2, b by clock, accelerations by clock^2), so that time is that of the recording. A delay moves
the steps of the current: the motion from the state s_0 is then the one that begins earlier by the delay, so that

    dx/d delay = -x'(t) + (dx/ds_0) s_0'

A lag is the exact response of the first-order filter to the cubic through positions and velocities of neighbouring
samples.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from hopform import BackendError, HopformError
from hopform._solver.choice import Solver
from hopform._solver.package import Steps, records
from hopform.identify import _motion as motion
from hopform.identify._motion import AT, STATE, Array, Motion, Robot, Values, delayed, held_at, of_scipy

Moved = tuple[Array, dict[str, Array]]
"""Position and velocity at the samples, (samples, 2), and their derivatives by each letter."""


def power_of(unit: str) -> int:
    """The power of 1/s in which a quantity of a unit counts, where N is kg m/s^2: 1 of N s/m, 2 of N/A."""
    above, _, below = unit.partition("/")

    def of(words: str) -> int:
        factors = [re.fullmatch(r"(\w+?)(?:\^(\d+))?", each) for each in words.replace("*", " ").split()]
        return sum({"N": 2, "J": 2, "s": -1}.get(each[1], 0) * int(each[2] or 1) for each in factors if each)

    return of(above) - of(below.replace("/", " "))


def named_by_masses(core: Solver, key: str) -> set[str]:
    """The parameters in what the facts of a model's masses have under a key."""
    texts = list[str]()
    for element in core.facts.elements:
        entry: Any = element.get(key, ())
        texts += map(str, entry.values() if key == "stops" and entry else entry)
    return {word for text in texts for word in re.findall(r"\w+", text)} & {
        each["name"] for each in core.facts.parameters
    }


def friction_of(core: Solver) -> dict[str, str]:
    """The parameters of friction, by kind: Coulomb's as the facts of the masses name them, viscous ones by their unit."""
    named, letters = named_by_masses(core, "friction"), dict[str, str]()
    for parameter in core.facts.parameters:
        if parameter["name"] in named and parameter["domain"] != "positive":
            letters[parameter["name"]] = "coulomb"
        elif re.match(r"N( m)? s(/|$)", parameter["unit"]):
            letters[parameter["name"]] = "viscous"
    return letters


POWERS = {each.name: power for each in records.ROBOT_FIELDS if (power := power_of(each.unit))}
"""The powers of 1/s in which a letter of the hopper counts."""


SENSOR = {"delay": 0.0, "gain": 1.0, "clock": 1.0, "lag": 0.0}
"""The letters of a recording's sensor, clock and logger, delay and lag in s, with values that change nothing."""


def in_recorded_time(at: Values, clock: float, powers: Mapping[str, int] = POWERS) -> dict[str, float]:
    """Letters of a rig in the time of the recording, of which true time is `clock` times as much."""
    return {name: value * clock ** powers.get(name, 0) for name, value in at.items()}


def by_clock(
    at: Values, by: Mapping[str, Array], clock: float, all_powers: Mapping[str, int] = POWERS
) -> dict[str, Array]:
    """Derivatives by the letters in true time, and by the clock, from those by letters in recorded time."""
    powers = {name: power for name, power in all_powers.items() if name in by and name in at}
    rows_by_name = {name: rows * clock ** powers.get(name, 0) for name, rows in by.items()}
    slopes = (power * at[name] * clock ** (power - 1) * by[name] for name, power in powers.items())
    rows_by_name["clock"] = sum(slopes, np.zeros_like(next(iter(by.values()))))
    return rows_by_name


def lagged(time: Array, moved: Moved, lag: float, before: float) -> Moved:
    """A motion through lag y' + y = x, which at first is in its steady state; before: acceleration at the beginning.

    dy/d lag = -(y' through the same filter).
    """
    states, by = moved
    x, v = states.T
    response = _Filter(time, lag)
    if lag == 0.0:
        y, rate = x, v
    else:
        y = response(x, v, float(x[0] - lag * v[0] + lag * lag * before))
        rate = (x - y) / lag
    rows_by_name = {name: np.stack([response(rows[:, 0], rows[:, 1]), rows[:, 1]], axis=1) for name, rows in by.items()}
    slope = (v - rate) / lag if lag > 0.0 else np.gradient(v, time) if time.size > 1 else np.zeros_like(v)
    rows_by_name["lag"] = np.stack([-response(rate, slope), -slope], axis=1)
    return np.stack([y, rate], axis=1), rows_by_name


class _Filter:
    """The response of lag y' + y = x to cubics between samples."""

    def __init__(self, time: Array, lag: float) -> None:
        self.lag, self.step = lag, np.diff(time)
        h = self.step / max(lag, 1e-300)
        self.decay = np.exp(-h)
        # Those of a cubic's powers, int_0^1 s^n e^(-h (1 - s)) h ds = h/(n + 1) 1F1(1; n + 2; -h) (DLMF 13.4.1).
        self.moments = [h / (n + 1) * of_scipy("special").hyp1f1(1, n + 2, -h) for n in range(4)]

    def __call__(self, x: Array, v: Array, first: float | None = None) -> Array:
        """y at the samples; from `first`, or from the steady state of a motion without acceleration."""
        if self.lag == 0.0 or x.size < 2:
            return x
        h, (m0, m1, m2, m3) = self.step, self.moments
        rise, left, right = np.diff(x), h * v[:-1], h * v[1:]
        gain = x[:-1] * m0 + left * m1 + (3.0 * rise - 2.0 * left - right) * m2 + (left + right - 2.0 * rise) * m3
        gain = np.concatenate([[x[0] - self.lag * v[0] if first is None else first], gain])
        # y_(n+1) = decay_n y_n + gain_(n+1) from y_0 = gain_0: a system of equations with two diagonals.
        bands = np.stack([np.ones_like(gain), np.append(-self.decay, 0.0)])
        return np.asarray(of_scipy("linalg").solve_banded((1, 0), bands, gain, check_finite=False))


Kind = Literal["ground", "free", "decay", "step", "air", "model"]

LETTERS: dict[str, tuple[str, ...]] = {
    "ground": ("m_s", "k", "b2", "f2", "g", "length", "impact_loss", "x", "v"),
    "free": ("m_s", "k", "b2", "f2", "g", "length", "impact_loss", "m_eff", "b1", "f1", "gamma2", "offset", "x1_min",
             "x1_max", "x", "v", "x1", "v1"),
}  # fmt: skip
"""What a rig's motion depends on; x, v are position and velocity of what is measured at its start (of the body, if it
is free, with x1, v1 of the actuator)."""

UNITS = {each.name: each.unit for each in records.ROBOT_FIELDS} | {
    "impact_loss": "", "rest": "m", "length": "m", "x": "m", "v": "m/s", "x1": "m", "v1": "m/s", "offset": "A",
    "delay": "s", "dead_time": "s", "gain": "", "clock": "", "lag": "s",
}  # fmt: skip

_NOTHING = Robot(**dict.fromkeys(Robot._fields, 0.0))._replace(
    m_eff=1.0, m_s=1.0, k=1.0, x1_min=-math.inf, x1_max=math.inf, u_max=math.inf
)
"""Unit masses on a unit spring, without anything else."""


class Along(NamedTuple):
    """A motion along which a further force acts: times [s], place from the spring's rest [m], velocity [m/s], what has
    the sign of the slip or, at rest, of the pull; the largest velocity, Coulomb friction [m/s^2], the largest force of
    drive or spring per mass [m/s^2], stiffness per mass [1/s^2], viscous friction per mass [1/s]; sizes of the forces of
    drive and spring together per mass [m/s^2].
    """

    t: Array
    x: Array
    v: Array
    way: Array
    fastest: float
    friction: Array
    force: float
    sprung: float
    damping: float
    load: Array


Force = Callable[[Along], Array]
"""A force per mass against the motion [m/s^2]."""


class NoMotion(HopformError):
    """Parameters under which a rig has no motion up to the last sample: a search goes elsewhere."""


@dataclass(frozen=True)
class Experiment:
    """A recording on its rig: what was measured when, under which current, and which parameter each letter stands for.

    time [s] from 0, not decreasing; measured [m]: x2 of a body, x1 of an actuator, of a free drop the one that `of`
    says; steps: the current. names: a letter's parameter, also of `SENSOR`. constants: letters that are known.
    added_mass [kg] on the body.
    """

    label: str
    kind: Kind
    time: Array
    measured: Array
    names: Mapping[str, str]
    constants: Values
    steps: Steps = ((0.0, 0.0),)
    added_mass: float = 0.0
    begin: float = 0.0
    of: Literal["x1", "x2"] = "x2"

    @property
    def quantity(self) -> Literal["x1", "x2"]:
        """Which position is measured."""
        return self.of

    @property
    def driven(self) -> bool:
        """Whether a current moves it."""
        return self.kind == "free"

    @property
    def swings(self) -> bool:
        """Whether gravity's sine is its spring."""
        return False

    @property
    def powers(self) -> Mapping[str, int]:
        """The powers of 1/s in which letters count."""
        return POWERS

    @property
    def own_letters(self) -> tuple[str, ...]:
        """What the motion depends on."""
        return LETTERS[self.kind]

    def letters(self, values: Values) -> dict[str, float]:
        """The letters of the rig, of its sensor, clock and logger under values of the parameters."""
        names, fixed = self.names, SENSOR | dict(self.constants)
        letters = (*self.own_letters, *SENSOR)
        return {letter: values[names[letter]] if letter in names else fixed[letter] for letter in letters}

    def predict(self, values: Values, time: Array | None = None) -> tuple[Array, dict[str, Array]]:
        """The predicted measurement, and its derivatives by the parameters; NoMotion for none up to the last sample."""
        try:
            return self._predicted(values, time)
        except BackendError:
            raise
        except HopformError as error:
            raise NoMotion(f"{self.label}: {error}") from None

    def _predicted(self, values: Values, time: Array | None) -> tuple[Array, dict[str, Array]]:
        time, at = self.time if time is None else time, self.letters(values)
        clock, gain, lag = at["clock"], at["gain"], at["lag"]
        moved, rate = self.moved(in_recorded_time(at, clock, self.powers), delayed(self.steps, at["delay"]), time)
        states, by = moved
        if "delay" in self.names and "delay" not in by:
            by["delay"] = _by_delay(states, by, rate, time)
        if "clock" in self.names or clock != 1.0:
            by = by_clock(at, by, clock, self.powers)
        if "lag" in self.names or lag != 0.0:
            before = rate.get("v1" if self.kind == "free" and self.of == "x1" else "v", 0.0)
            states, by = lagged(time, (states, by), lag, before)
        by["gain"] = states
        columns: dict[str, Array] = {}
        for letter, name in self.names.items():
            columns[name] = columns.get(name, 0.0) + (1.0 if letter == "gain" else gain) * by[letter][:, 0]
        return gain * states[:, 0], columns

    def moved(self, at: Values, steps: Steps, time: Array) -> tuple[Moved, "Rates"]:
        """The motion at times by letters in recorded time, under a current, with the rates of the letters of its start."""
        if self.kind == "ground":
            at, steps = {**_LOCKED, **at}, ((0.0, 0.0),)
        steps = tuple((t, u + at["offset"]) for t, u in steps)
        of_clock = "clock" in self.names or at["clock"] != 1.0
        needed = LETTERS["free"] if of_clock else (*self.names, "x", "v", "x1", "v1")
        columns = {letter: _OF_BODY.get(letter, letter) for letter in LETTERS["free"] if letter in needed}
        start = at["x1"], at["v1"], at["x"], at["v"]
        solved = _dropped(_leg_robot(self, at), start, steps, time.tobytes(), tuple(columns.values()))
        pull = -(at["b1"] * at["v1"] + at["gamma2"] * steps[0][1]) / at["m_eff"]
        onto_a_stop = (at["x1"] <= at["x1_min"] and pull <= 0.0) or (at["x1"] >= at["x1_max"] and pull >= 0.0)
        first = 0.0 if at["v1"] == 0.0 and onto_a_stop else _first_acceleration(pull, at["v1"], at["f1"])
        place = STATE.index(self.of)
        both = slice(place, place + 2)
        by = {letter: solved.by[:, both, AT[column]] for letter, column in columns.items()}
        return (solved.states[:, both], by), {"x": at["v"], "v": -at["g"], "x1": at["v1"], "v1": first}

    def response_to(self, values: Values, force: "Force", size: float) -> Array:
        """The change of the prediction by a force against the motion, times a size, per this: on the actuator where both
        masses move. 0 where nothing moves. Of a body that is dropped it is that of a vanishing size.
        """
        letters = self.letters(values)
        at = in_recorded_time(letters, letters["clock"], self.powers)
        steps = delayed(self.steps, letters["delay"])
        finer = max(min(4, records.MOST_STEPS // self.time.size), 1)
        places = np.arange(finer * (self.time.size - 1) + 1) / finer
        fine = np.interp(places, np.arange(self.time.size), self.time)
        return np.asarray(letters["gain"] * self.respond(at, steps, fine, force, size)[::finer])

    def respond(self, at: Values, steps: Steps, fine: Array, force: "Force", size: float) -> Array:
        """The same at times between the samples, too, by letters in recorded time."""
        return (self._response if self.kind == "ground" else self._driven_response)(at, steps, fine, force, size)

    def _response(self, at: Values, steps: Steps, fine: Array, force: "Force", _: float) -> Array:
        """Of a body that is dropped, which sticks once, at its end. With P(t) the derivatives of its state by that at
        the start it is P(t) int P(s)^-1 (0, e(s)) ds, through touchdowns and reversals, up to where it sticks.
        """
        states, by = self.moved(at, steps, fine)[0]
        (x, v), transition = states.T, np.stack([by["x"], by["v"]], axis=2)
        determinant = transition[:, 0, 0] * transition[:, 1, 1] - transition[:, 0, 1] * transition[:, 1, 0]
        moves = int(np.argmax(np.append(np.abs(determinant) < SINGULAR, True)))
        stance = x < at["length"]
        rows = np.stack([-transition[:moves, 0, 1], transition[:moves, 0, 0]], axis=1) / determinant[:moves, np.newaxis]
        mass = at["m_s"] + self.added_mass
        left, square, damping = x - at["length"], at["k"] / mass, at["b2"] / mass
        load = square * np.abs(left * stance)
        along = Along(
            fine, left, v, v, float(np.abs(v).max()), at["f2"] * stance, float(load.max()), square, damping, load
        )
        if along.fastest == 0.0 or moves == 0:
            return np.zeros(fine.size)
        inside = -rows * force(along)[:moves, np.newaxis]
        parts = 0.5 * (inside[1:] + inside[:-1]) * np.diff(fine[:moves])[:, np.newaxis]
        whole = np.concatenate([np.zeros((1, 2)), np.cumsum(parts, axis=0)])
        response = (transition[:moves, 0] * whole).sum(axis=1)
        return np.append(response, np.full(fine.size - moves, response[-1]))

    def _driven_response(self, at: Values, steps: Steps, fine: Array, force: "Force", size: float) -> Array:
        """Of a free actuator, which sticks at every turn of its drive: the difference that the force makes, in what is
        measured."""
        drive = at["gamma2"] * (held_at(steps, fine) + at["offset"])
        unit, place = {**at, "gamma2": 1.0, "offset": 0.0}, STATE.index(self.of)

        def moved(pull: Array) -> Array:
            under = tuple(zip(fine.tolist(), pull.tolist(), strict=True))
            start = (at["x1"], at["v1"], at["x"], at["v"])
            return motion.drop(_leg_robot(self, unit), start, under, fine).states

        states = moved(drive)
        x, v, height = states.T[:3]
        spring = np.maximum(x - height + at["length"], 0.0)
        pull = np.asarray(-at["k"] * spring - drive, dtype=np.float64)
        mass, fastest = at["m_eff"], float(np.abs(v).max())
        way, friction, k = np.where(v != 0.0, v, pull), np.full(x.size, at["f1"]), at["k"]
        by_drive, by_spring = np.abs(drive) / mass, k / mass * np.abs(spring)
        largest, load = max(float(by_drive.max()), float(by_spring.max())), by_drive + by_spring
        along = Along(fine, spring, v, way, fastest, friction, largest, k / mass, at["b1"] / mass, load)
        if fastest == 0.0:
            return np.zeros(fine.size)
        return np.asarray((moved(drive + size * mass * force(along)) - states)[:, place] / size)

    def only(self, chosen: NDArray[np.bool_] | slice) -> Self:
        """The samples that a mask or a slice selects."""
        return replace(self, time=self.time[chosen], measured=self.measured[chosen])


SINGULAR = 1e-12
"""Determinant of the derivatives of a state by that at the start below which the body has come to rest."""

Rates = dict[str, float]
"""Derivatives by time of the letters of a start."""


def _by_delay(states: Array, by: Mapping[str, Array], rate: Rates, time: Array) -> Array:
    """Derivatives by a delay of the current: -x'(t) and what a start so much earlier changes."""
    slope = np.gradient(states[:, 1], time) if time.size > 1 else np.zeros(time.size)
    start = sum((by[letter] * each for letter, each in rate.items() if letter in by), np.zeros_like(states))
    return np.asarray(start - np.stack([states[:, 1], slope], axis=1))


def _first_acceleration(pull: float, velocity: float, friction: float) -> float:
    """Of a mass under a pull [m/s^2] and Coulomb friction, by the hold rule."""
    side = velocity if velocity != 0.0 else pull
    return 0.0 if velocity == 0.0 and abs(pull) <= friction else pull - math.copysign(friction, side)


_OF_BODY = {"length": "L0", "x": "x2", "v": "v2", "offset": "u"}
"""Columns of derivatives by letters that are not named as they are."""


_LOCKED = dict.fromkeys(("b1", "f1", "gamma2", "offset", "x1", "v1", "x1_min", "x1_max"), 0.0) | {"m_eff": 1.0}
"""The letters of an actuator that is held."""


@lru_cache(maxsize=2)
def _dropped(robot: Robot, start: tuple[float, ...], steps: Steps, times: bytes, by: tuple[str, ...]) -> Motion:
    """A drop of which both x1 and x2 were measured is solved once for both."""
    return motion.drop(robot, start, steps, np.frombuffer(times), by)


def _leg_robot(experiment: Experiment, at: Values) -> Robot:
    values = {letter: value for letter, value in at.items() if letter in Robot._fields}
    return _NOTHING._replace(**values | {"m_s": at["m_s"] + experiment.added_mass, "L0": at["length"]})
