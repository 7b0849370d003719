"""Random robots and starts over all orders of magnitude, degenerate ones among them:
as arrays, with the library on them, and one by one.
"""

import ctypes
import math
import random
from typing import Any

import numpy as np

import hopform
from hopform._solver import c as native
from tests.oracle.checker import ANSWER, PHASE, PROBLEM

MAX_PHASES = 100
MOST_PUSH, MOST_PULL, MOST_SPEED = 30.0, 20.0, 100.0  # m/s^2 by the offset, by the motor; m/s
NEAR_THRESHOLD = 0.002
"""Share of stances in which a mass starts at rest within ulps of its friction: the 50-digit reference judges them."""
AT_REST = 0.2
"""Share of stances with more friction at rest than in motion."""

DEGENERATE = (
    "frictionless",
    "triple",
    "near triple",
    "double",
    "near double",
    "double held",
    "at the threshold",
    "twins",
)


def draw_stances(seed: int, count: int) -> Any:
    """`count` problems, a structured array of PROBLEM."""
    draw = np.random.default_rng(seed)

    def over(low: float, high: float) -> Any:
        return np.exp(draw.uniform(np.log(low), np.log(high), count))

    def mostly(value: Any, zero: float) -> Any:
        return np.where(draw.random(count) < zero, 0.0, value)

    p = np.zeros(count, PROBLEM)
    p["m_s"], p["k"] = over(0.1, 10.0), over(1.0, 1e7)
    p["m_eff"] = p["m_s"] * over(1e-3, 1e3)
    p["L0"], p["g"], p["horizon"], p["u_max"] = 0.4, 9.81, 2.0, 3.0
    p["c"] = mostly(draw.uniform(-0.02, 0.02, count), 0.67)
    p["b1"] = mostly(2.0 * np.sqrt(p["k"] * p["m_eff"]) * over(1e-6, 10.0), 0.15)
    p["b2"] = mostly(2.0 * np.sqrt(p["k"] * p["m_s"]) * over(1e-6, 10.0), 0.15)
    p["f1"], p["f2"] = mostly(over(0.01, 10.0), 0.15), mostly(over(0.01, 10.0), 0.15)
    p["gamma2"] = draw.choice((-1.0, 1.0), count) * p["m_eff"] * over(0.1, 30.0)
    p["u"] = mostly(draw.uniform(-3.0, 3.0, count), 0.5)
    p["v2"] = -over(0.05, 5.0)
    p["v1"] = mostly(draw.choice((-1.0, 1.0), count) * over(0.01, 3.0), 0.5)
    _compress(draw, p, over(1e-5, 0.1))
    _confine(draw, p, over(1e-4, 0.1), over(1e-4, 0.1))
    for kind in DEGENERATE:
        _degenerate(draw, p, kind, draw.random(count) < 0.025)
    _restrain(p)
    _rest_near_threshold(draw, p, draw.random(count) < NEAR_THRESHOLD)
    _hold(draw, p, draw.random(count) < AT_REST)
    p["v1"] = np.where(p["y"] > 0.0, p["v1"], np.maximum(p["v1"], 0.5 * p["v2"]))  # or the leg would not compress
    return p


def stiff_stances(seed: int, count: int, stiffness: float) -> Any:
    """Free actuators whose real pole is `stiffness` to 3 times that many times the frequency of the body on its spring,
    half of them driven hardly harder than they creep."""
    draw = np.random.default_rng(seed)

    def over(low: Any, high: Any) -> Any:
        return np.exp(draw.uniform(np.log(low), np.log(high), count))

    def mostly(value: Any) -> Any:
        return np.where(draw.random(count) < 0.5, 0.0, value)

    p = np.zeros(count, PROBLEM)
    p["m_s"], p["k"], p["L0"], p["g"], p["horizon"], p["u_max"] = over(0.1, 10.0), over(10.0, 1e6), 0.4, 9.81, 1.0, 3.0
    p["x1_min"], p["x1_max"] = -np.inf, np.inf
    p["m_eff"] = p["m_s"] * over(1e-3, 10.0)
    p["b1"] = p["m_eff"] * np.sqrt(p["k"] / p["m_s"]) * stiffness * over(1.0, 3.0)
    p["b2"] = 2.0 * np.sqrt(p["k"] * p["m_s"]) * over(1e-4, 0.1)
    p["f1"], p["f2"], p["y"] = mostly(over(0.01, 3.0)), mostly(over(0.01, 1.0)), mostly(over(1e-4, 0.05))
    p["gamma2"] = -p["m_eff"] * over(0.1, 30.0) * np.where(mostly(1.0) > 0.0, over(1.0, 1.0 + 0.002 * p["k"]), 1.0)
    p["v2"], p["u"] = -over(0.05, 3.0), 3.0 * draw.uniform(-1.0, 1.0, count)
    p["v1"] = draw.choice((-1.0, 1.0), count) * over(0.01, 3.0)
    p["v1"] = np.where(p["v1"] < p["v2"], 0.5 * p["v2"], p["v1"])
    return p


def _compress(draw: Any, p: Any, y: Any) -> None:
    """A tenth begins with a leg that is compressed, the body at rest or on its way up or down."""
    some = draw.random(p.size) < 0.1
    p["y"][some] = y[some]
    p["v2"][some] *= draw.choice((-1.0, 0.0, 1.0), p.size)[some]


def _confine(draw: Any, p: Any, below: Any, above: Any) -> None:
    """A quarter has stops: locked, or with a start at one of them, or in between."""
    p["x1_min"], p["x1_max"] = -np.inf, np.inf
    stops, kind = draw.random(p.size) < 0.25, draw.random(p.size)
    locked = kind < 0.1
    p["x1_min"][stops] = np.where(locked | ((kind > 0.1) & (kind < 0.3)), 0.0, -below)[stops]
    p["x1_max"][stops] = np.where(locked | ((kind > 0.3) & (kind < 0.4)), 0.0, above)[stops]


def _restrain(p: Any) -> None:
    """Offset and motor push a free actuator no harder than that, and the spring makes nobody faster than MOST_SPEED.

    Else an actuator is up to 1e9 m away at the horizon, and whatever is wrong in the last bit of k or c is metres
    there. What is between two stops may be pushed by anything.
    """
    free = np.isinf(p["x1_max"])
    most = MOST_PUSH * p["m_eff"]
    p["c"] = np.where(free, np.clip(p["c"], -most / p["k"], most / p["k"]), p["c"])
    pull, limit = np.abs(p["gamma2"] * p["u"]), MOST_PULL * p["m_eff"]
    p["gamma2"] *= np.where(free & (pull > limit), limit / np.maximum(pull, limit), 1.0)
    p["y"] = np.minimum(p["y"], MOST_SPEED / np.sqrt(p["k"] * (1.0 / p["m_s"] + 1.0 / p["m_eff"])))


def _degenerate(draw: Any, p: Any, kind: str, here: Any) -> None:
    q = p[here]
    rate, other = (np.exp(draw.uniform(np.log(1.0), np.log(1e3), q.size)) for _ in range(2))
    if kind == "frictionless":
        q["b1"] = q["b2"] = 0.0
    elif kind in ("triple", "near triple"):
        q["m_s"], q["b2"], q["b1"] = 8.0 * q["m_eff"], 0.0, 3.0 * q["m_eff"] * rate
        q["k"] = q["m_s"] * rate**2 / 3.0
    elif kind in ("double", "near double"):  # rates (other, rate, rate), b2 = 0
        s1, s2, s3 = other + 2.0 * rate, 2.0 * other * rate + rate**2, other * rate**2
        q["b2"], q["b1"], q["k"] = 0.0, q["m_eff"] * s1, q["m_eff"] * (s2 - s3 / s1)
        q["m_s"] = q["k"] * s1 / s3
    elif kind == "double held":
        q["b1"], q["b2"] = 2.0 * np.sqrt(q["k"] * q["m_eff"]), 2.0 * np.sqrt(q["k"] * q["m_s"])
    elif kind == "at the threshold":  # exactly, by powers of two
        q["m_eff"], q["gamma2"] = 2.0 ** np.round(np.log2(q["m_eff"])), -(2.0 ** np.round(np.log2(q["m_eff"])))
        q["u"], q["c"], q["v1"], q["y"] = draw.choice((-1.0, 1.0), q.size) * q["f1"], 0.0, 0.0, 0.0
        q["v2"] = -np.abs(q["v2"]) - 0.01
    elif kind == "twins":
        q["m_eff"], q["b1"], q["f1"] = q["m_s"], q["b2"], q["f2"]
    if kind.startswith("near"):
        for name in ("k", "b1"):
            q[name] *= 1.0 + draw.integers(-3, 4, q.size) * np.finfo(float).eps
    p[here] = q


def _rest_near_threshold(draw: Any, p: Any, here: Any) -> None:
    """A mass at rest whose level of friction lies within 4 ulp of its free acceleration, the leg being compressed."""
    q = p[here]
    q["y"] = np.where(q["y"] > 0.0, q["y"], 0.01 * q["m_s"] * q["g"] / q["k"])
    spring, first = q["k"] * (q["c"] - q["y"]), draw.random(q.size) < 0.5
    free = np.abs(spring - q["gamma2"] * q["u"]) / q["m_eff"], np.abs(q["k"] * q["y"] / q["m_s"] - q["g"])
    for level, speed, rests, exact in zip(("f1", "f2"), ("v1", "v2"), (first, ~first), free, strict=True):
        near = exact * (1.0 + draw.integers(-4, 5, q.size) * np.finfo(float).eps)
        q[level], q[speed] = np.where(rests, near, q[level]), np.where(rests, 0.0, q[speed])
    p[here] = q


def _hold(draw: Any, p: Any, here: Any) -> None:
    """More friction at rest, of one mass or both: on top of that in motion, or half of it or any share up to all, so
    that the mass is held by the same level as before."""
    q = p[here]
    which = draw.integers(1, 4, q.size)
    for number, level in enumerate(("f1", "f2"), 1):
        kind, more = draw.random(q.size), np.exp(draw.uniform(np.log(1e-3), np.log(10.0), q.size))
        share = np.where(kind < 0.6, 0.5, np.where(kind < 0.7, 1.0, draw.random(q.size)))
        excess = np.where(kind < 0.4, more, q[level] * share)
        excess = np.where(which & number, excess, 0.0)
        q[level] = np.where(kind < 0.4, q[level], q[level] - excess)
        q[f"{level}_excess"] = excess
    p[here] = q


def solve_with_c(p: Any) -> tuple[Any, Any]:
    """ANSWERs and PHASEs of the library, with at most MAX_PHASES phases each."""
    library = native.library()
    types = library.types(np.dtype(float))
    plan, stance, step = types.Plan(), types.Stance(), types.Step(0.0, 0.0)
    buffer = np.zeros(MAX_PHASES + 1, PHASE)
    assert ctypes.sizeof(types.Phase) == PHASE.itemsize
    answers, phases, first = np.zeros(p.size, ANSWER), [], 0
    for i in range(p.size):
        address = p.ctypes.data + i * p.itemsize
        library.call("plan_init", types, ctypes.byref(plan), ctypes.c_void_p(address))
        step.u = ctypes.c_double.from_address(address + PROBLEM.fields["u"][1]).value
        horizon = ctypes.c_double.from_address(address + PROBLEM.fields["horizon"][1]).value
        library.call(
            "solve_stance", types, ctypes.byref(plan), ctypes.c_void_p(address + PROBLEM.fields["x1"][1]),
            ctypes.byref(step), 1, types.real(horizon), MAX_PHASES, ctypes.c_void_p(buffer.ctypes.data), len(buffer),
            ctypes.byref(stance),
        )  # fmt: skip
        end, count = stance.end, stance.phases_kept
        answers[i] = (stance.duration, end.x1, end.v1, end.v2, end.y, stance.aed, stance.ending, count, first)
        phases.append(buffer[:count].copy())
        first += count
    return answers, np.concatenate(phases)


def excess_of(seed: int) -> dict[str, float]:
    """More friction at rest than in motion, of a fifth of the random robots; by a stream of its own."""
    draw = random.Random(f"{seed} at rest")
    which = draw.randrange(1, 4) if draw.random() < AT_REST else 0
    return {f"f{n}_excess": math.exp(draw.uniform(math.log(1e-2), math.log(10.0))) * bool(which & n) for n in (1, 2)}


def random_robot(seed: int) -> tuple[hopform.Robot, dict[str, Any]]:
    """A robot and a start drawn over all orders of magnitude, degenerate ones among them."""
    draw = random.Random(seed)

    def over(low: float, high: float) -> float:
        return math.exp(draw.uniform(math.log(low), math.log(high)))

    def some(value: float, zero: float) -> float:
        return 0.0 if draw.random() < zero else value

    m_s, k = over(0.1, 10.0), over(1.0, 1e7)
    m_eff = m_s * over(1e-3, 1e3)
    low, high = -math.inf, math.inf
    if draw.random() < 0.25:
        low, high = -over(1e-4, 0.1), over(1e-4, 0.1)
    robot = hopform.Robot(
        m_eff=m_eff,
        m_s=m_s,
        k=k,
        L0=0.4,
        c=draw.choice((0.0, 0.0, draw.uniform(-0.02, 0.02))),
        b1=some(2.0 * math.sqrt(k * m_eff) * over(1e-6, 10.0), 0.15),
        b2=some(2.0 * math.sqrt(k * m_s) * over(1e-6, 10.0), 0.15),
        f1=some(over(0.01, 10.0), 0.15),
        f2=some(over(0.01, 10.0), 0.15),
        gamma2=draw.choice((-1.0, 1.0)) * m_eff * over(0.1, 30.0),
        g=9.81,
        x1_min=low,
        x1_max=high,
        u_max=3.0,
        **excess_of(seed),
    )
    v2 = -over(0.05, 5.0)
    v1 = some(draw.choice((-1.0, 1.0)) * over(0.01, 3.0), 0.5)
    return robot, {"v2": v2, "v1": v1 if v1 > v2 else 0.0, "u": some(draw.uniform(-3.0, 3.0), 0.5), "max_phases": 100}
