"""Hopping in its first form: a drop, then hop after hop on flat ground under a constant current.

The stances are exact; the flight is ballistic. The actuator is taken to be back at the origin at the next touchdown,
at rest: its return in flight is not simulated here.
"""

import math
from dataclasses import dataclass
from typing import SupportsFloat

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform.checks import finite
from hopform.errors import HopformError
from hopform.robots import Robot
from hopform.stance import Stance, State, solve_stance

Array = NDArray[np.floating]


@dataclass(frozen=True)
class Hop:
    """A hop: the fall from a height, the stance, and the apex that follows (hop heights in m, NaN without take-off)."""

    index: int
    height: float
    touchdown_time: float
    """[s] since the drop"""
    stance: Stance
    apex: float
    energy_lost_at_impact: float
    """[J]"""

    @property
    def takeoff_time(self) -> float:
        """[s] since the drop; the time of the ending where there is no take-off."""
        return self.touchdown_time + self.stance.duration


@dataclass(frozen=True)
class Run:
    """Hops in a row. status: "completed", or "stopped" where a stance ended without take-off; duration [s]."""

    robot: Robot
    hops: tuple[Hop, ...]
    status: str
    duration: float

    def at(self, t: ArrayLike) -> State:
        """States at times t [s] since the drop, 0 <= t <= duration, in t's shape; in flight the actuator is at its origin."""
        times = self._times(t)
        columns = np.empty((4, times.size))
        columns[0], columns[1] = _home(self.robot), 0.0
        columns[2], columns[3] = self._ballistic(times)
        for hop in self.hops:
            inside = (times >= hop.touchdown_time) & (times <= hop.takeoff_time)
            columns[:, inside] = hop.stance.at(_within(times[inside], hop))
        return State(*(column.reshape(np.shape(t)) for column in columns))

    def energy(self, t: ArrayLike) -> Array:
        """Energy of the body [J] at times t [s], in t's shape: in flight without a spring, in stance E of (22), (23)."""
        times = self._times(t)
        height, velocity = self._ballistic(times)
        energy = self.robot.m_s * (velocity**2 / 2.0 + self.robot.g * height)
        for hop in self.hops:
            inside = (times >= hop.touchdown_time) & (times <= hop.takeoff_time)
            energy[inside] = hop.stance.energy(_within(times[inside], hop)).body
        return np.asarray(energy.reshape(np.shape(t)))

    def aed(self, t: ArrayLike) -> Array:
        """The same energy foretold [J]: that of the drop, plus the AED (24), the impacts and the spring's coordinate."""
        times, robot = self._times(t), self.robot
        level = robot.m_s * robot.g * (self.hops[0].height + robot.L0 + robot.c)
        spring_at_home = robot.k * _home(robot) ** 2 / 2.0
        energy = np.full(times.shape, level)
        for hop in self.hops:
            level += spring_at_home - hop.energy_lost_at_impact
            inside = (times >= hop.touchdown_time) & (times <= hop.takeoff_time)
            ledger = hop.stance.ledger(_within(times[inside], hop))
            energy[inside] = level + ledger.spring_work + ledger.viscous_2 + ledger.coulomb_2
            done = hop.stance.ledger(hop.stance.duration)
            level += float(done.spring_work + done.viscous_2 + done.coulomb_2)
            level -= robot.k * float(hop.stance.end.x1) ** 2 / 2.0
            energy[times > hop.takeoff_time] = level
        return energy.reshape(np.shape(t))

    def _ballistic(self, times: Array) -> tuple[Array, Array]:
        """Height and velocity of the body as if every time were in flight: the parabola of the last apex before it."""
        g, rest = self.robot.g, self.robot.L0 + self.robot.c
        height, velocity = np.empty(times.shape), np.empty(times.shape)
        for drop, peak_time, begin in self._peaks():
            later = times >= begin
            since = times[later] - peak_time
            height[later], velocity[later] = rest + drop - g * since**2 / 2.0, -g * since
        return height, velocity

    def _peaks(self) -> list[tuple[float, float, float]]:
        """Each flight: the hop height of its apex, the time of the apex, the time at which the flight begins."""
        peaks = [(self.hops[0].height, 0.0, 0.0)]
        for hop in self.hops:
            if hop.stance.takeoff is not None:
                rise = max(float(hop.stance.takeoff.v2), 0.0) / self.robot.g
                peaks.append((hop.apex, hop.takeoff_time + rise, hop.takeoff_time))
        return peaks

    def _times(self, t: ArrayLike) -> Array:
        times = np.asarray(t, dtype=float).reshape(-1)
        if times.size and not bool(np.all((times >= 0.0) & (times <= self.duration))):
            bad = times[~((times >= 0.0) & (times <= self.duration))][0]
            raise HopformError(f"t must be 0 <= t <= {self.duration!r} s, got {float(bad)!r}")
        return times


def hop(
    robot: Robot,
    *,
    height: SupportsFloat,
    u: SupportsFloat = 0.0,
    hops: int = 1,
    horizon: SupportsFloat = 2.0,
    backend: str | None = None,
) -> Run:
    """Drop the robot from a hop height [m] and let it hop under a constant current u [A] in every stance.

    Raises HopformError: height not above the actuator's origin, hops < 1, g = 0, and what `solve_stance` refuses.

    >>> from hopform import load_robot
    >>> run = hop(load_robot("hopper_c"), height=0.2, u=3.0, hops=2)
    >>> run.status, [round(h.apex, 4) for h in run.hops]
    ('completed', [0.2233, 0.2362])
    """
    if isinstance(hops, bool) or not isinstance(hops, int) or hops < 1:
        raise HopformError(f"hops must be a whole number >= 1, got {hops!r}")
    if not robot.g > 0.0:
        raise HopformError(f"hopping needs g > 0 m/s^2, got {robot.g!r}")
    drop, home = finite("height", height, "m"), _home(robot)
    if not drop > home:
        raise HopformError(f"height must be > {home!r} m, the foot must be above the ground, got {drop!r}")
    found: list[Hop] = []
    time = math.sqrt(2.0 * (drop - home) / robot.g)
    for index in range(hops):
        one = _one_hop(robot, index, drop, time, u, horizon, backend)
        found.append(one)
        if one.stance.takeoff is None or not one.apex > home:
            return Run(robot, tuple(found), "stopped", one.takeoff_time)
        rise = max(float(one.stance.takeoff.v2), 0.0) / robot.g
        drop, time = one.apex, one.takeoff_time + rise + math.sqrt(2.0 * (one.apex - home) / robot.g)
    last = found[-1]
    assert last.stance.takeoff is not None
    return Run(robot, tuple(found), "completed", last.takeoff_time + max(float(last.stance.takeoff.v2), 0.0) / robot.g)


def _one_hop(
    robot: Robot, index: int, drop: float, time: float, u: SupportsFloat, horizon: SupportsFloat, backend: str | None
) -> Hop:
    home = _home(robot)
    before = math.sqrt(2.0 * robot.g * (drop - home))
    after = before * math.sqrt(1.0 - robot.impact_loss)
    stance = solve_stance(robot, x1=home, v2=-after, u=u, horizon=horizon, backend=backend)
    return Hop(index, drop, time, stance, stance.apex, robot.m_s * before**2 / 2.0 * robot.impact_loss)


def _home(robot: Robot) -> float:
    """Where the actuator is at touchdown: 0, or the end of its stroke next to it."""
    return min(max(0.0, robot.x1_min), robot.x1_max)


def _within(times: Array, hop: Hop) -> Array:
    """Times since touchdown, kept inside the stance against rounding."""
    return np.asarray(np.clip(times - hop.touchdown_time, 0.0, hop.stance.duration))
