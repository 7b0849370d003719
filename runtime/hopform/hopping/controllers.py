"""Controllers: what `simulate` asks at every touchdown for the current of the stance.

A controller is any callable that takes a `Touchdown` and returns a current [A], steps of it [(t, u), ...] with t in s
since touchdown, or a `Sampled` law, which then sees the stance at every tick of its clock. If it has a method
`prepare(robot, terrain)`, that is called once, before anything is simulated, with the model of the robot that the
controller may use; what it returns is then asked in its place.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple, Protocol, SupportsFloat, cast, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from hopform import (
    Command,
    HopformError,
    PrintedCommand,
    Robot,
    Stance,
    State,
    choose_current,
    choose_current_as_printed,
    solve_flight,
    solve_stance,
    solve_stances,
)
from hopform.extend import Checked, by, falling_robot, finite, items, positive, shown, whole
from hopform.hopping.terrain import MOST_HOPS, heights_of

Array = NDArray[np.float64]
Heights = float | tuple[float, ...]
SetPoints = SupportsFloat | Sequence[SupportsFloat]
"""A height [m], or one per hop."""
MOST_CELLS = 2**23
"""Heights x currents of return maps at most."""
SETTLING = 5
"""Hops after which one is taken to be steady."""


class Touchdown(NamedTuple):
    """The input of a controller, with the errors of its sensors; heights count from level 0, that of the terrain's
    zero.
    """

    hop: int
    """0 for the first touchdown"""
    time: float
    """[s] since the start"""
    x1: float
    """[m]"""
    v1: float
    """[m/s]"""
    v2: float
    """[m/s] after the impact"""
    ground: float
    """[m] height of the ground under the foot: known at touchdown, not before"""
    apex: float
    """[m] hop height, over level 0, of the apex before"""
    robot: Robot
    """the model that the controller has of the robot"""
    compression: float = 0.0
    """[m] of the leg, as the flight has left it: 0 without a damper in it"""


def _law(name: str, value: object) -> Any:
    if not callable(value):
        raise HopformError(f"{name} must be a function of t and state, got {shown(value)}")
    return value


def _flag(name: str, value: Any) -> bool:
    if not isinstance(value, (bool, np.bool_)):
        raise HopformError(f"{name} must be True or False, got {shown(value)}")
    return bool(cast(Any, value))


@dataclass(frozen=True)
class Sampled(Checked):
    """A law that is asked for the current [A] every `period` [s] of the stance, which is held until the next time.

    law(t, state): t [s] since the touchdown was detected; state as measured there, x2 over level 0.
    """

    period: float = field(metadata=by(positive, "s"))
    law: Callable[[float, State], float] = field(metadata=by(_law))


Current = SupportsFloat | Sequence[tuple[SupportsFloat, SupportsFloat]]
Answer = Current | Sampled
Controller = Callable[[Touchdown], Answer]


@runtime_checkable
class Preparing(Protocol):
    """A controller that wants to know the robot first."""

    def prepare(self, robot: Robot, terrain: tuple[float, ...]) -> Controller:
        """The controller that is asked in its place."""
        ...


@dataclass(frozen=True)
class ConstantCurrent(Checked):
    """The same current [A] in every stance."""

    u: float = field(default=0.0, metadata=by(finite, "A"))

    def __call__(self, touchdown: Touchdown) -> float:
        return self.u


def check_touchdown(touchdown: object) -> Touchdown:
    """The value; HopformError for what is no Touchdown of a robot."""
    if not isinstance(touchdown, Touchdown):
        raise HopformError(f"touchdown must be a Touchdown of a Robot, got {shown(touchdown)}")
    falling_robot(touchdown.robot, "hop", "hopping")
    whole("hop", touchdown.hop, 0)
    return touchdown


def set_points(name: str, h_des: SetPoints) -> Heights:
    """Desired apexes [m] as floats: one, or one per hop; HopformError for what is not finite."""
    given = cast(Any, h_des)
    if isinstance(given, str) or (isinstance(given, SupportsFloat) and np.ndim(cast(Any, given)) == 0):
        return finite(name, given, "m")
    heights = items(name, given, "a height in m, or one per hop", MOST_HOPS)
    return tuple(finite(f"{name}[{number}]", value, "m") for number, value in enumerate(heights))


def set_point(h_des: Any, hop: int) -> float:
    """The desired apex [m] after a touchdown, of checked ones; HopformError for a hop that there is none for."""
    if isinstance(h_des, float):
        return h_des
    if not hop < len(h_des):
        raise HopformError(f"h_des must be one height, or one per hop: got {len(h_des)} for hop {hop}")
    return cast(float, h_des[hop])


class _Aiming(Checked):
    """A controller that aims at apexes [m], to which a stance of at most `horizon` [s] leads."""

    h_des: SetPoints
    stop_margin: float = 0.0
    horizon: float

    def prepare(self, robot: Robot, terrain: tuple[float, ...]) -> Any:
        """Itself, if every set point is above its ground; HopformError if not."""
        asked = cast(Heights, self.h_des)
        grounds = heights_of(terrain)
        if isinstance(asked, tuple) and len(asked) < len(grounds):
            raise HopformError(f"h_des must be one height, or one per hop: got {len(asked)} for {len(grounds)} hops")
        for hop, ground in enumerate(grounds):
            if (target := set_point(asked, hop)) < ground:
                where = f"at hop {hop}, where the ground is at {ground!r} m"
                raise HopformError(f"h_des must not lie below the ground: got {target!r} m {where}")
        limit, u = falling_robot(robot, "command", "an apex").letters.u_max, robot.solver.facts.inputs[0]
        if not math.isfinite(limit):
            raise HopformError(f"the controller needs a finite {u['limit']}, got {limit!r} {u['unit']}")
        return self


class _Choosing(_Aiming):
    """One whose fields are the options of what chooses the current."""

    _choose: ClassVar[Callable[..., Command | PrintedCommand]]

    def __call__(self, touchdown: Touchdown) -> float:
        h_des, ground = set_point(self.h_des, check_touchdown(touchdown).hop), finite("ground", touchdown.ground, "m")
        aim = {"h_des": max(h_des, ground), "datum": -ground}  # not below the ground, where a sensor may have put it
        state = {name: getattr(touchdown, name) for name in ("x1", "v1", "v2", "compression")}
        return self._choose(touchdown.robot, **vars(self) | aim | state).u


@dataclass(frozen=True)
class FeedForward(_Choosing):
    """The energy-based controller (25)-(27), exact: the current of least |u| after which the next apex is h_des.

    h_des [m]: hop height over level 0, or one per hop. Where no current reaches it the nearest admissible is taken.
    stop_margin [m] and horizon [s] as for `choose_current`.

    >>> from hopform import load_robot
    >>> from hopform.hopping import simulate
    >>> run = simulate(load_robot("hopper_c"), [0.0, 0.02, -0.01], FeedForward(0.2), height=0.2)
    >>> [round(hop.apex, 9) for hop in run.hops]
    [0.2, 0.2, 0.2]
    """

    h_des: SetPoints = field(metadata=by(set_points))
    stop_margin: float = field(default=0.0, metadata=by(finite, "m", 0.0))
    horizon: float = field(default=2.0, metadata=by(positive, "s"))
    _choose = staticmethod(choose_current)


@dataclass(frozen=True)
class AsPrinted(_Choosing):
    """The controller as the paper prints it: J of (27) minimised on a grid; options as for
    `choose_current_as_printed`.
    """

    h_des: SetPoints = field(metadata=by(set_points))
    grid: float = field(default=0.01, metadata=by(positive, "A"))
    half: bool = field(default=True, metadata=by(_flag))
    signed: bool = field(default=False, metadata=by(_flag))
    spring_coordinate: bool = field(default=False, metadata=by(_flag))
    horizon: float = field(default=2.0, metadata=by(positive, "s"))
    _choose = staticmethod(choose_current_as_printed)


@dataclass(frozen=True)
class ReturnMap(_Aiming):
    """Hopper B's first controller (section II): return maps for the compression, feedback in the expansion.

    The current of the compression is read from return maps, the next apex over the last one for a family of constant
    currents, measured once on even ground: the robot hops at a height until it is steady, then the current is changed
    for one hop. In expansion a law of 1/period tracks a height x2 over time that was recorded in a steady hop from
    h_des to h_des: the current of the compression plus Kp (x2 recorded - x2) + Kd (v2 recorded - v2), within u_max. It
    knows neither the ground nor the actuator's state at touchdown, so rough ground throws it off (Fig. 7).

    h_des [m]: hop height over level 0, or one per hop. Kp [A/m], Kd [A s/m]: for a force that lifts. heights, currents:
    how many of each are measured.
    """

    h_des: SetPoints = field(metadata=by(set_points))
    Kp: float = field(default=60.0, metadata=by(finite, "A/m"))
    Kd: float = field(default=3.0, metadata=by(finite, "A s/m"))
    period: float = field(default=1e-3, metadata=by(positive, "s"))
    heights: int = field(default=20, metadata=by(whole, 2))
    currents: int = field(default=61, metadata=by(whole, 2))
    horizon: float = field(default=2.0, metadata=by(positive, "s"))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.heights * self.currents > MOST_CELLS:
            got = f"{self.heights} x {self.currents}"
            raise HopformError(f"heights x currents must be at most {MOST_CELLS}, got {got}")

    def prepare(self, robot: Robot, terrain: tuple[float, ...]) -> "Tracking":
        """The controller with its return maps."""
        super().prepare(robot, terrain)
        h_des = cast(Heights, self.h_des)
        highest = max(h_des) if isinstance(h_des, tuple) else h_des
        if not highest > 0.0:
            raise HopformError(f"h_des must be > 0 m for maps that are measured up to twice that, got {highest!r}")
        heights = np.linspace(0.0, 2.0 * highest, self.heights + 1)[1:]
        limit = float(robot.letters.u_max)
        family = np.linspace(-limit, limit, self.currents)
        return Tracking(self, h_des, robot, measured(robot, heights, family, self.horizon))

    def __call__(self, touchdown: Touchdown) -> Answer:
        return self.prepare(check_touchdown(touchdown).robot, (0.0,))(touchdown)


@dataclass(frozen=True)
class ReturnMaps:
    """Return maps measured in steady hopping: heights (H,) [m], currents (U,) [A], apex (H, U) [m] that follows.

    x1, v1, compression (H,) [m, m/s, m]: with which actuator and leg arrive when it hops at a height, of no hop if that
    does not take off.
    """

    heights: Array
    currents: Array
    apex: Array
    x1: Array
    v1: Array
    compression: Array

    def current(self, apex: float, h_des: float) -> float:
        """The current [A] that the maps give for an apex [m] and the set point for the next one; the least |u| if
        several do.
        """
        place = min(max(int(np.searchsorted(self.heights, apex)), 1), self.heights.size - 1)
        low, high = float(self.heights[place - 1]), float(self.heights[place])
        share = min(max((apex - low) / (high - low), 0.0), 1.0)
        return crossing(self.currents, self.apex[place - 1] + share * (self.apex[place] - self.apex[place - 1]) - h_des)


def measured(robot: Robot, heights: Array, currents: Array, horizon: float) -> ReturnMaps:
    """The return maps of steady hopping: at first the actuator is at its origin, then as it arrives from the hop
    before.
    """
    x1, v1, leg = np.full(heights.size, robot.home), np.zeros(heights.size), np.zeros(heights.size)
    hops = 0
    while True:
        v2 = _fallen(robot, heights, x1)
        start: dict[str, Any] = {"x1": x1, "v1": v1, "v2": v2, "compression": leg}
        rows: dict[str, Any] = {name: each[:, None] for name, each in start.items()}
        batch = solve_stances(robot, **rows, u=currents, horizon=horizon)
        above = v2 < v1  # the foot is above the ground
        apex = np.where(above[:, None], batch.apex.astype(float), np.nan)
        if hops == SETTLING:
            return ReturnMaps(heights, currents, apex, x1, v1, leg)
        hops += 1
        for row in np.flatnonzero(above):
            u = crossing(currents, apex[row] - heights[row])
            stance = solve_stance(robot, **{name: each[row] for name, each in start.items()}, u=u, horizon=horizon)
            if stance.takeoff is not None:
                flight = solve_flight(robot, **stance.takeoff._asdict(), compression=stance.end_compression)
                x1[row], v1[row], leg[row] = flight.end.x1, flight.end.v1, flight.end_compression


def _fallen(robot: Robot, height: Array, x1: Array) -> Array:
    """Velocity of the body [m/s] after the impact of a hop from a height [m]; 0 where the foot is not above the
    ground.
    """
    fallen = robot.solver.package.formulas.touchdown_velocity
    return np.asarray(fallen(robot.parameters, np.maximum(height - x1, 0.0)))


def crossing(currents: Array, miss: Array) -> float:
    """The current [A] of least |u| at which a miss (U,) vanishes between two currents, or the nearest; 0 if all is
    NaN.
    """
    crossings = np.flatnonzero(np.sign(miss[:-1]) * np.sign(miss[1:]) <= 0.0)
    if not crossings.size:
        return float(currents[int(np.nanargmin(np.abs(miss)))]) if np.isfinite(miss).any() else 0.0
    low, high = miss[crossings], miss[crossings + 1]
    share = np.divide(low, low - high, out=np.zeros_like(low), where=low != high)
    roots = currents[crossings] + share * (currents[crossings + 1] - currents[crossings])
    return float(roots[int(np.argmin(np.abs(roots)))])


@dataclass(frozen=True)
class Tracking:
    """A `ReturnMap` with its maps, and what it has recorded so far."""

    settings: ReturnMap
    h_des: Heights
    robot: Robot
    maps: ReturnMaps
    _recorded: dict[float, Stance] = field(default_factory=dict[float, Stance], repr=False, compare=False)

    def recorded(self, h_des: float) -> Stance:
        """The steady hop from h_des to h_des on even ground whose expansion is tracked."""
        if h_des not in self._recorded:
            maps, horizon = self.maps, self.settings.horizon
            arrives = {"x1": maps.x1, "v1": maps.v1, "compression": maps.compression}
            start: dict[str, Any] = {name: float(np.interp(h_des, maps.heights, x)) for name, x in arrives.items()}
            start["v2"] = float(_fallen(self.robot, np.array(h_des), np.array(start["x1"])))
            u = maps.current(h_des, h_des)
            self._recorded[h_des] = solve_stance(self.robot, **start, u=u, horizon=horizon)
        return self._recorded[h_des]

    def __call__(self, touchdown: Touchdown) -> Sampled:
        h_des = set_point(self.h_des, touchdown.hop)
        return Sampled(self.settings.period, self._law(self.maps.current(touchdown.apex, h_des), self.recorded(h_des)))

    def _law(self, command: float, recorded: Stance) -> Callable[[float, State], float]:
        body = f"{self.robot.solver.facts.coordinates[-1]['name']}_reverses"
        turns = next((event.time for event in recorded.events if event.kind == body), 0.0)
        tick = min(self.settings.period, recorded.duration - turns)
        rate = float(recorded.at(turns + tick).v2) / tick if tick > 0.0 else 0.0
        lift = -math.copysign(1.0, self.robot.letters.gamma2)
        began: list[float] = []

        def law(t: float, state: State) -> float:
            v2 = float(state.v2)
            if not began and v2 <= 0.0:
                return command
            if not began:  # a little before this tick, by what the body has gained since
                began.append(t - min(v2 / rate, self.settings.period) if rate > 0.0 else t)
            there = recorded.at(min(turns + t - began[0], recorded.duration))
            error = self.settings.Kp * float(there.x2 - state.x2) + self.settings.Kd * float(there.v2 - v2)
            most = float(self.robot.letters.u_max)
            return min(max(command + lift * error, -most), most)

        return law
