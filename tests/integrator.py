"""A hopper integrated numerically, by code that shares nothing with hopform:
DOP853, restarted at every switch of a mode.

The equations of motion (3), (4) with Coulomb friction, stops, take-off, flight under the return's law, touchdown,
impact.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

RTOL, ATOL, STEP = 1e-12, 1e-13, 2e-3


@dataclass
class Mode:
    """Signs of the velocities, 0 if held; in flight the sign of the pull at its limit."""

    one: int
    two: int = 0
    limit: int = 0


@dataclass
class Path:
    """What was integrated: pieces (begin, end, interpolant of x1, v1, x2, v2), and the touchdowns and take-offs."""

    pieces: list[tuple[float, float, Any]] = field(default_factory=list)
    touchdowns: list[tuple[float, np.ndarray]] = field(default_factory=list)
    takeoffs: list[tuple[float, np.ndarray]] = field(default_factory=list)
    switches: int = 0

    def at(self, t: float) -> np.ndarray:
        return next(states(t) for begin, end, states in self.pieces if begin <= t <= end)


def integrate(
    f: Callable[[float, np.ndarray], Any], events: list[tuple[str, Callable[[np.ndarray], float], int]], t: float,
    state: np.ndarray, longest: float, path: Path,
) -> tuple[str, float, np.ndarray]:  # fmt: skip
    """Up to the first event: its name, time and state."""

    def watch(function, direction):
        def event(_, y):
            return function(y)

        event.terminal, event.direction = True, direction
        return event

    found = solve_ivp(
        f, (t, t + longest), state, "DOP853", rtol=RTOL, atol=ATOL, max_step=STEP, first_step=1e-7, dense_output=True,
        events=[watch(function, direction) for _, function, direction in events],
    )  # fmt: skip
    assert found.status == 1, found.message
    path.pieces.append((t, float(found.t[-1]), found.sol))
    path.switches += 1
    which = next(n for n, times in enumerate(found.t_events) if times.size)
    return events[which][0], float(found.t[-1]), found.y[:, -1].copy()


def sign_after(velocity: float, acceleration: float, friction: float) -> int:
    """The mode of a mass: slips with its velocity; from rest with its acceleration, if that is above the friction."""
    if velocity != 0.0:
        return int(math.copysign(1, velocity))
    return int(math.copysign(1, acceleration)) if abs(acceleration) > friction else 0


def at_stop(robot: Any, x1: float, acceleration: float) -> bool:
    """Whether a stop keeps the actuator that rests at it."""
    return (x1 <= robot.x1_min and acceleration <= robot.f1) or (x1 >= robot.x1_max and acceleration >= -robot.f1)


def stance(robot: Any, u: float, t: float, state: np.ndarray, path: Path) -> tuple[float, np.ndarray]:
    """From touchdown to take-off under a constant current."""
    length = robot.L0 + robot.c

    def force(y):
        return robot.k * (y[0] - y[2] + length)

    def free(y):
        one = (robot.k * (y[2] - y[0] - robot.L0) - robot.b1 * y[1] - robot.gamma2 * u) / robot.m_eff
        return one, (force(y) - robot.b2 * y[3]) / robot.m_s - robot.g

    while True:
        a1, a2 = free(state)
        mode = Mode(sign_after(state[1], a1, robot.f1), sign_after(state[3], a2, robot.f2))
        held_by_stop = state[1] == 0.0 and at_stop(robot, state[0], a1)
        mode.one = 0 if held_by_stop else mode.one

        def motion(_, y, mode=mode):
            a1, a2 = free(y)
            return [
                y[1] if mode.one else 0.0, a1 - robot.f1 * mode.one if mode.one else 0.0,
                y[3] if mode.two else 0.0, a2 - robot.f2 * mode.two if mode.two else 0.0,
            ]  # fmt: skip

        events = [("takeoff", force, -1)]  # that the force starts at zero is no crossing downwards
        if mode.one:
            events.append(("v1", lambda y: y[1], -mode.one))
            events.append(("low", lambda y: y[0] - robot.x1_min, -1))
            events.append(("high", lambda y: y[0] - robot.x1_max, 1))
        elif held_by_stop:
            low = state[0] <= robot.x1_min
            events.append(
                ("leaves", lambda y, low=low: free(y)[0] + (-robot.f1 if low else robot.f1), 1 if low else -1)
            )
        else:
            events.append(("slips", lambda y: abs(free(y)[0]) - robot.f1, 1))
        if mode.two:
            events.append(("v2", lambda y: y[3], -mode.two))
        else:
            events.append(("slips2", lambda y: abs(free(y)[1]) - robot.f2, 1))
        kind, t, state = integrate(motion, events, t, state, 2.0, path)
        if kind == "takeoff":
            return t, state
        if kind in ("v1", "low", "high"):
            state[1] = 0.0
            state[0] = {"low": robot.x1_min, "high": robot.x1_max}.get(kind, state[0])
        if kind == "v2":
            state[3] = 0.0
        if kind in ("slips", "leaves"):
            state[1] = 1e-14 * math.copysign(1, free(state)[0])
        if kind == "slips2":
            state[3] = 1e-14 * math.copysign(1, free(state)[1])


def flight(
    robot: Any, gains: tuple[float, float], ground: float, t: float, state: np.ndarray, path: Path
) -> tuple[float, np.ndarray]:
    """From take-off to the touchdown on a height, the state before the impact."""
    length, largest = robot.L0 + robot.c, abs(robot.gamma2) * robot.u_max

    def foot(y):
        return y[2] - length - y[0] - ground

    def pull(y):
        return gains[0] * y[0] + gains[1] * y[1]

    while True:
        limit = 1 if pull(state) > largest else -1 if pull(state) < -largest else 0

        def free(y, limit=limit):
            return (robot.k * robot.c - robot.b1 * y[1] - (limit * largest if limit else pull(y))) / robot.m_eff

        one = sign_after(state[1], free(state), robot.f1)
        stopped = state[1] == 0.0 and at_stop(robot, state[0], free(state))
        one = 0 if stopped else one

        def motion(_, y, one=one, free=free):
            return [y[1] if one else 0.0, free(y) - robot.f1 * one if one else 0.0, y[3], -robot.g]

        events = [("touchdown", foot, -1)]
        if one:
            events.append(("v1", lambda y: y[1], -one))
            events.append(("low", lambda y: y[0] - robot.x1_min, -1))
            events.append(("high", lambda y: y[0] - robot.x1_max, 1))
            events.append(("limit", lambda y: abs(pull(y)) - largest, 0))
        # Held in flight under its own law nothing changes for the actuator.
        kind, t, state = integrate(motion, events, t, state, 5.0, path)
        if kind == "touchdown":
            return t, state
        if kind in ("v1", "low", "high"):
            state[1] = 0.0
            state[0] = {"low": robot.x1_min, "high": robot.x1_max}.get(kind, state[0])
        if kind == "limit":  # a step beyond it, so that the next piece knows its side
            state = state + 1e-13 * np.array(motion(t, state))


def hop(robot: Any, terrain: list[float], currents: list[float], height: float, gains: tuple[float, float]) -> Path:
    """A drop, then hop after hop; x2 in all states over the terrain's zero."""
    path, t = Path(), 0.0
    state = np.array([0.0, 0.0, height + robot.L0 + robot.c, 0.0])
    for ground, u in zip(terrain, currents, strict=True):
        t, state = flight(robot, gains, ground, t, state, path)
        state[3] *= math.sqrt(1.0 - robot.impact_loss)
        state[2] = state[0] + robot.L0 + robot.c
        path.touchdowns.append((t, state + [0.0, 0.0, ground, 0.0]))
        begin = len(path.pieces)
        t, state = stance(robot, u, t, state, path)
        shifted = [(a, b, lambda s, f=f, g=ground: f(s) + [0.0, 0.0, g, 0.0]) for a, b, f in path.pieces[begin:]]
        path.pieces[begin:] = shifted
        state[2] += ground
        path.takeoffs.append((t, state.copy()))
    return path
