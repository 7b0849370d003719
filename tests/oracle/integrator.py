"""A hopper integrated numerically, by code that shares nothing with hopform:
DOP853, restarted at every switch of a mode.

The equations of motion (3), (4) with Coulomb friction, stops, take-off, flight under the return's law, touchdown,
impact.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tests.oracle import rules
from tests.oracle.rules import Leg, Point

ACCURATE = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13, "max_step": 2e-3, "dense_output": True}
PARAMETERS = (
    "m_eff", "m_s", "k", "L0", "c", "b1", "b2", "f1", "f2", "gamma2", "g", "x1_min", "x1_max", "u_max", "impact_loss",
)  # fmt: skip


@dataclass
class Path:
    """What was integrated: pieces (begin, end, interpolant of x1, v1, x2, v2), and the touchdowns and take-offs."""

    pieces: list[tuple[float, float, Any]] = field(default_factory=list)
    touchdowns: list[tuple[float, np.ndarray]] = field(default_factory=list)
    takeoffs: list[tuple[float, np.ndarray]] = field(default_factory=list)

    def add(self, begin: float, took: float, states: Any) -> None:
        self.pieces.append((begin, begin + took, states))

    def at(self, t: float) -> np.ndarray:
        return next(states(t) for begin, end, states in self.pieces if begin <= t <= end)


def first_zero(
    slope: Callable[..., Any], functions: Sequence[Callable[[np.ndarray], float]], state: Sequence[float], limit: float,
    **how: Any,
) -> tuple[float, int | None, np.ndarray, Any]:  # fmt: skip
    """When the first of some functions falls to zero, or `limit`; which one, or None; the state then; the solution."""

    def event(function):
        def at(_, y):
            return function(y)

        at.terminal, at.direction = True, -1.0
        return at

    done = solve_ivp(slope, (0.0, limit), state, events=[event(function) for function in functions], **how)
    assert done.status >= 0, done.message
    hits = [(times[0], n) for n, times in enumerate(done.t_events) if times.size]
    if not hits:
        return limit, None, done.y[:, -1], done.sol
    took, n = min(hits)
    return float(took), n, done.y_events[n][0], done.sol


def end_of_mode(
    leg: Leg, side_1: float, side_2: float, z: Point, limit: float, **how: Any
) -> tuple[float, int, Point, Any]:
    """The end of a mode of a stance: its time, the event function that comes to zero or NONE, the state, the solution.

    Only the event functions that the mode needs are evaluated.
    """
    numbers = [rules.LIFTS, rules.FIRST_UP, rules.SECOND_UP]
    if side_1 != 0.0 and min(-leg.x1_min, leg.x1_max) < rules.FAR:
        numbers.append(rules.STOPS)
    numbers += [rules.FIRST_DOWN] * (side_1 == 0.0) + [rules.SECOND_DOWN] * (side_2 == 0.0)
    numbers.sort()
    took, which, after, solution = first_zero(
        lambda _, y: rules.rates(leg, side_1, side_2, Point(*y)),
        [lambda y, n=n: rules.event_functions(leg, side_1, side_2, Point(*y))[n] for n in numbers],
        z, limit, first_step=min(rules.first_step(leg, side_1, side_2, z), limit), **how,
    )  # fmt: skip
    return took, rules.NONE if which is None else numbers[which], Point(*after.tolist()), solution


def sign_after(velocity: float, acceleration: float, friction: float) -> int:
    """The mode of a mass: slips with its velocity; from rest with its acceleration, if that is above the friction."""
    if velocity != 0.0:
        return int(math.copysign(1, velocity))
    return int(math.copysign(1, acceleration)) if abs(acceleration) > friction else 0


def at_stop(robot: Any, x1: float, acceleration: float) -> bool:
    """Whether a stop keeps the actuator that rests at it."""
    return (x1 <= robot.x1_min and acceleration <= robot.f1) or (x1 >= robot.x1_max and acceleration >= -robot.f1)


def stance(robot: Any, u: float, t: float, state: np.ndarray, path: Path) -> tuple[float, np.ndarray]:
    """From touchdown to take-off under a constant current. These rules know no friction at rest."""
    assert robot.f1_excess == robot.f2_excess == 0.0
    x1, v1, _, v2 = state.tolist()
    parameters = [getattr(robot, name) for name in PARAMETERS]
    job = (*parameters, x1, v1, v2, u)
    leg = rules.leg_of(job)
    z, side_1, side_2 = rules.begin(job, leg)

    def with_heights(z):
        x1, v1, v2, y = z
        return np.array([x1, v1, x1 - y + robot.L0 + robot.c, v2])

    while True:
        took, which, z, solution = end_of_mode(leg, side_1, side_2, z, 2.0, **ACCURATE)
        path.add(t, took, lambda s, begin=t, states=solution: with_heights(states(s - begin)))
        t += took
        assert which != rules.NONE, "no take-off"
        if which == rules.LIFTS:
            return t, with_heights(z)
        z, side_1, side_2, _ = rules.pass_event(leg, side_1, side_2, z, which)


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

        ends = {"touchdown": foot}
        if one:
            beyond = 1.0 if limit else -1.0
            ends["v1"] = lambda y, one=one: one * y[1]
            ends["low"], ends["high"] = lambda y: y[0] - robot.x1_min, lambda y: robot.x1_max - y[0]
            ends["limit"] = lambda y, beyond=beyond: beyond * (abs(pull(y)) - largest)
        # Held in flight under its own law nothing changes for the actuator.
        took, which, state, solution = first_zero(motion, list(ends.values()), state, 5.0, first_step=1e-7, **ACCURATE)
        path.add(t, took, lambda s, begin=t, states=solution: states(s - begin))
        t += took
        assert which is not None, "no touchdown"
        kind = [*ends][which]
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
