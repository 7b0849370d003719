"""Recordings of random carts and legs by time stepping in C (recordings.c), with what sensor, clock and logger do to
them. Nothing here is hopform's but the container that a fit takes.
"""

import ctypes
import math
import os
import shlex
import subprocess
import tempfile
from dataclasses import astuple, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

SOURCE = Path(__file__).with_name("recordings.c")


@dataclass(frozen=True)
class Rig:
    """The fields of the C struct, in SI units and A; held: stillness at first [s]."""

    mass: float
    k: float
    b: float
    f: float
    stribeck: float = 0.0
    speed: float = 1.0
    gamma: float = 0.0
    rest: float = 0.0
    drops: float = 0.0
    g: float = 0.0
    loss: float = 0.0
    start: float = 0.0
    held: float = 0.0
    delay: float = 0.0
    gain: float = 1.0
    clock: float = 1.0
    lag: float = 0.0
    drag: float = 0.0
    drift: float = 0.0
    play: float = 0.0
    stop: float = math.inf
    ripple: float = 0.0
    pitch: float = 1.0
    hard: float = 0.0
    loaded: float = 0.0
    link: float = 0.0
    link_k: float = 0.0
    link_b: float = 0.0
    at_link: float = 0.0


@cache
def _library() -> Any:
    folder = Path(tempfile.mkdtemp(prefix="recordings"))
    compiler = shlex.split(os.environ.get("CC", "cc"))
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared"]
    subprocess.run([*compiler, *flags, str(SOURCE), "-o", str(folder / "recordings.so"), "-lm"], check=True)
    return ctypes.CDLL(str(folder / "recordings.so"))


def simulate(rig: Rig, u: np.ndarray, rate: float) -> np.ndarray:
    """What is measured of a rig at a rate [Hz], a sample for each of the current [A]."""
    given, found = np.ascontiguousarray(u, dtype=float), np.empty(len(u))
    fields = (ctypes.c_double * len(astuple(rig)))(*astuple(rig))
    address = ctypes.POINTER(ctypes.c_double)
    _library().record(
        fields, given.ctypes.data_as(address), len(given), ctypes.c_double(1.0 / rate), found.ctypes.data_as(address)
    )
    return found


def leg(robot: Any, u: np.ndarray, rate: float, level: float, speed: float, step: float = 1e-5) -> np.ndarray:
    """x1 and x2 of a leg that is let go 0.2 m over the ground under a current [A], by semi-implicit steps of time.

    The actuator's friction is 1 + level e^(-(v/speed)^2) times as high; its stops take its velocity.
    """
    x1 = v1 = v2 = 0.0
    x2, down, found = robot.L0 + 0.2, False, []
    for current in u.tolist():
        found.append((x1, x2))
        for _ in range(round(1.0 / (rate * step))):
            compression = x1 - x2 + robot.L0
            if compression > 0.0 and not down:
                v2 *= math.sqrt(1.0 - robot.impact_loss)
            down = compression > 0.0
            force = robot.k * max(compression, 0.0)
            friction = robot.f1 * (1.0 + level * math.exp(-((v1 / speed) ** 2)))
            v1 = _slowed(v1 - step * (force + robot.b1 * v1 + robot.gamma2 * current) / robot.m_eff, step * friction)
            stopped = min(max(x1 + step * v1, robot.x1_min), robot.x1_max)
            v1 = v1 if stopped == x1 + step * v1 else 0.0
            x1 = stopped
            v2 -= step * robot.g
            if down:
                v2 = _slowed(v2 + step * (force - robot.b2 * v2) / robot.m_s, step * robot.f2)
            x2 += step * v2
    return np.array(found)


def _slowed(velocity: float, by: float) -> float:
    """A velocity after Coulomb friction, which brings it to rest at most."""
    return 0.0 if abs(velocity) <= by else velocity - math.copysign(by, velocity)
