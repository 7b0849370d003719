"""A joint under a position controller, tick by tick, in closed form and in numbers of any kind: float, or mpmath's.

    J v' = k i + load - b v - F(v),    i_k = sat((K_p (target_k - x_k) - K_d v_k)/k)

Each current acts from a dead time after its tick on. Where the controller differentiates, (x_k - x_(k-1))/T stands in
place of v_k. Nothing here is hopform's.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Servo:
    """A joint [SI, about its axis], the gains of its controller, and its limit of current [A]."""

    J: Any = 0.031
    b: Any = 0.0085
    F_p: Any = 0.042
    F_m: Any = 0.042
    F_sp: Any = 0.0
    F_sm: Any = 0.0
    k_t: Any = 0.1
    K_p: Any = 8.0
    K_d: Any = 0.9
    load: Any = 0.0
    i_max: Any = 10.0


def section(rig: Servo, x: Any, v: Any, i: Any, length: Any, maths: ModuleType | Any = math) -> tuple[Any, Any]:
    """Place and velocity after a constant current has acted for a while."""
    pull, left, decay = rig.k_t * i + rig.load, length, rig.b / rig.J
    while left > 0:
        if v == 0:
            if -rig.F_m - rig.F_sm <= pull <= rig.F_p + rig.F_sp:
                return x, v
            side = 1 if pull > 0 else -1
        else:
            side = 1 if v > 0 else -1
        final = (pull - (rig.F_p if side > 0 else -rig.F_m)) / rig.b
        turns = -maths.log(final / (final - v)) / decay if v != 0 and final * side < 0 else maths.inf
        t = min(left, turns)
        rest = 1 - maths.exp(-decay * t)
        x, v = x + final * t + (v - final) * rest / decay, v * 0 if turns <= left else v + (final - v) * rest
        left -= t
    return x, v


def moved(
    rig: Servo, target: Callable[[Any], Any], start: tuple[Any, Any], count: int, period: Any, dead_time: Any = 0.0,
    delay: Any = 0.0, maths: ModuleType | Any = math, differs: bool = False,
) -> list[tuple[Any, Any]]:  # fmt: skip
    """States at the ticks 0 to count; the first current acts also before it would."""
    states, currents, (x, v) = [start], list[Any](), start
    late = int(dead_time / period + 1e-9)
    rest = dead_time - late * period
    for k in range(count):
        seen = (x - states[-2][0]) / period if differs and k else v
        asked = (rig.K_p * (target(k * period - delay) - x) - rig.K_d * seen) / rig.k_t
        currents.append(min(max(asked, -rig.i_max), rig.i_max))
        if rest > 1e-9 * period:
            x, v = section(rig, x, v, currents[max(k - late - 1, 0)], rest, maths)
            x, v = section(rig, x, v, currents[max(k - late, 0)], period - rest, maths)
        else:
            x, v = section(rig, x, v, currents[max(k - late, 0)], period, maths)
        states.append((x, v))
    return states


def log(
    rig: Servo, target: Callable[[Any], Any], duration: float, rate: float, rng: np.random.Generator, *,
    dead_time: float = 0.0, delay: float = 0.0, noise: float = 2e-4, quantum: float = 2.0 * math.pi / 16384.0, every: int = 1,
    differs: bool = False,
) -> str:  # fmt: skip
    """What a logger writes of it: time, goal and position of every so manyth tick."""
    count = round(duration * rate)
    states = moved(rig, lambda t: target(max(t, 0.0)), (0.0, 0.0), count, 1.0 / rate, dead_time, delay, differs=differs)
    x = np.array([float(x) for x, _ in states]) + noise * rng.standard_normal(count + 1)
    x = quantum * np.round(x / quantum)
    rows: Sequence[str] = [
        f"{k / rate:.7g},{target(k / rate):.9g},{x[k]:.9g}" for k in range(0, count + 1, every)
    ]  # fmt: skip
    return "\n".join(["time_s,goal_rad,position_rad", *rows]) + "\n"


def chirp(size: float, first: float, last: float, duration: float) -> Callable[[float], float]:
    """A sine whose frequency [Hz] rises evenly."""
    return lambda t: size * math.sin(2.0 * math.pi * t * (first + 0.5 * (last - first) * t / duration))
