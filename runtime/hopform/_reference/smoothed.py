"""A simulator with smoothed friction, F tanh(100 v), by semi-implicit Euler steps: what many simulators do.

It is the example of one to score, and a row to compare with.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from hopform._reference.cases import Case

Numbers = Mapping[str, float]
Accelerations = Callable[[list[float], list[float], float], list[float]]
STEP = 1e-4
"""[s]"""
STEEPNESS = 100.0
"""[s/rad] or [s/m]"""
LONGEST = 2.0
"""[s] after which a leg that takes off late is no longer followed."""


def friction(level: float, v: float) -> float:
    """Coulomb friction without its jump."""
    return level * math.tanh(STEEPNESS * v)


def smoothed(case: Case) -> dict[str, Any]:
    """States of a case, by semi-implicit Euler steps of 0.1 ms with the friction F tanh(100 v); values of a leg.

    Friction at rest above sliding friction is left out. A stop takes the velocity of what has passed it.

    >>> from hopform.reference import cases
    >>> (hold,) = cases("hold")
    >>> states = smoothed(hold)["states"]
    >>> f"{states['q'][-1]:.4f} rad, where friction holds"
    '0.0062 rad, where friction holds'
    """
    if case.family in ("stance", "hop"):
        return _of_leg(case)
    accelerations = {"sea": _sea, "servo": _servo}.get(case.family, _joint)(case)
    q, v = (list(map(case.start.__getitem__, names)) for names in (case.positions, case.velocities))
    low, high = (case.parameters.get(name, at) for name, at in (("q_min", -math.inf), ("q_max", math.inf)))
    rows = [[*q, *v]]
    for u in inputs(case, round(float(case.times[-1]) / STEP)):
        advance(q, v, accelerations(q, v, u))
        if not low <= q[0] <= high:
            q[0], v[0] = min(max(q[0], low), high), 0.0
        rows.append([*q, *v])
    return {"states": sampled(case, rows)}


def inputs(case: Case, count: int) -> list[float]:
    """The input in each step."""
    times, values = zip(*case.steps, strict=True)
    return list(np.array(values)[np.searchsorted(times, (np.arange(count) + 0.5) * STEP, side="right") - 1])


def advance(q: list[float], v: list[float], a: list[float]) -> None:
    """One step: velocities by the forces, then positions by the new velocities."""
    for n, acceleration in enumerate(a):
        v[n] += STEP * acceleration
        q[n] += STEP * v[n]


def sampled(case: Case, rows: list[list[float]]) -> dict[str, Any]:
    """The states at the times of the answer."""
    table = np.array(rows)[np.rint(case.times / STEP).astype(int)]
    return dict(zip((*case.positions, *case.velocities), table.T, strict=True))


def _joint(case: Case) -> Accelerations:
    p = case.parameters
    k, drive = p.get("k", 0.0), p["k"] if case.family == "driven joint" else 1.0

    def accelerations(q: list[float], v: list[float], u: float) -> list[float]:
        return [(drive * u - k * q[0] - p["b"] * v[0] - friction(p["F"], v[0])) / p["J"]]

    return accelerations


def _servo(case: Case) -> Accelerations:
    p = case.parameters

    def accelerations(q: list[float], v: list[float], u: float) -> list[float]:
        torque = min(max(p["K_p"] * (u - q[0]) - p["K_d"] * v[0], -p["tau_max"]), p["tau_max"])
        return [(torque - p["b"] * v[0] - friction(p["F"], v[0])) / p["J"]]

    return accelerations


def _sea(case: Case) -> Accelerations:
    p = case.parameters

    def accelerations(q: list[float], v: list[float], u: float) -> list[float]:
        spring = p["k"] * (q[0] - q[1]) + p["d"] * (v[0] - v[1])
        motor = (u - spring - p["b_m"] * v[0] - friction(p["F_m"], v[0])) / p["J_m"]
        return [motor, (spring - p["b_l"] * v[1] - friction(p["F_l"], v[1])) / p["J_l"]]

    return accelerations


@dataclass
class _Leg:
    """A leg in the making: positions and velocities of actuator and body, whether it flies."""

    p: Numbers
    q: list[float]
    v: list[float]
    flies: bool

    @property
    def compression(self) -> float:
        return self.q[0] - self.q[1] + self.p["L"]

    def accelerations(self, u: float) -> list[float]:
        p, (x1, _), (v1, v2) = self.p, self.q, self.v
        if self.flies:
            pull = -p["K_p"] * x1 - p["K_d"] * v1
            force = min(max(pull, -p["u_max"]), p["u_max"])
            return [(force - p["b_1"] * v1 - friction(p["F_1"], v1)) / p["m_1"], -p["g"]]
        leg = max(p["k"] * self.compression, 0.0)
        actuator = (u - leg - p["b_1"] * v1 - friction(p["F_1"], v1)) / p["m_1"]
        return [actuator, (leg - p["b_2"] * v2 - friction(p["F_2"], v2)) / p["m_2"] - p["g"]]

    def step(self, u: float) -> None:
        p = self.p
        advance(self.q, self.v, self.accelerations(u))
        if not p["x1_min"] <= self.q[0] <= p["x1_max"]:
            self.q[0], self.v[0] = min(max(self.q[0], p["x1_min"]), p["x1_max"]), 0.0


def _of_leg(case: Case) -> dict[str, Any]:
    """States and values of a stance, or of a hop up to its second touchdown."""
    q, v = (list(map(case.start.__getitem__, names)) for names in (case.positions, case.velocities))
    leg, found, last = (
        _Leg(case.parameters, q, v, case.family == "hop"),
        dict[str, float](),
        round(case.times[-1] / STEP),
    )
    rows, hops = [[*q, *v]], case.family == "hop"
    for n, u in enumerate(inputs(case, round(LONGEST / STEP))):
        before = leg.compression
        leg.step(u)
        after = leg.compression
        if leg.flies and after >= 0.0 > before:
            found["touchdown"] = STEP * (n + before / (before - after))
            leg.flies, leg.v[1] = False, leg.v[1] * math.sqrt(1.0 - case.parameters["loss"])
        elif not leg.flies and before > 0.0 >= after and "takeoff" not in found:
            share = before / (before - after)
            _, x2, _, v2 = (a + share * (b - a) for a, b in zip(rows[-1], (*leg.q, *leg.v), strict=True))
            apex = x2 + v2**2 / (2.0 * case.parameters["g"]) - case.parameters["L"]
            found |= {"takeoff": STEP * (n + share), "apex": apex}
            leg.flies = hops
        rows.append([*leg.q, *leg.v])
        if n >= last and "takeoff" in found and (not hops or found["touchdown"] > found["takeoff"]):
            break
    return {"states": sampled(case, rows), "values": {name: found[name] for name in case.values if name in found}}
