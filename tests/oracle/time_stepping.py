"""Motions of a hopper by time stepping: the midpoint rule in steps of 10 us,
with Coulomb friction that holds a mass exactly.

It shares nothing with hopform. Its positions are within 1e-8 m of the exact ones.
"""

import math
from collections.abc import Callable

import numpy as np

STEP = 1e-5
G = 9.81


def slide(free: Callable[[float, float], float], friction: float, x: float, v: float, h: float) -> tuple[float, float]:
    """A step of x'' = free(x, v) - friction sign(v); where v comes to zero the mass is held, or slips on from there."""
    pull = free(x, v)
    if v == 0.0 and abs(pull) <= friction:
        return x, 0.0
    drag = math.copysign(friction, v if v != 0.0 else pull)
    middle = v + 0.5 * h * (pull - drag)
    after = v + h * (free(x + 0.5 * h * v, middle) - drag)
    if after * drag < 0.0 <= v * drag:
        turn = h * v / (v - after)
        return slide(free, friction, x + 0.5 * turn * v, 0.0, h - turn)
    return x + h * middle, after


def on_a_spring(
    mass: float, k: float, b: float, friction: float, force: np.ndarray, rate: float, start: float = 0.0
) -> np.ndarray:
    """x of a mass on a spring at each sample, from rest at `start`, each force [N] from its sample to the next."""
    x, v, found = start, 0.0, []
    for push in force.tolist():
        found.append(x)
        for _ in range(round(1.0 / (rate * STEP))):
            x, v = slide(lambda x, v, push=push: (push - k * x - b * v) / mass, friction, x, v, STEP)
    return np.array(found)


def dropped(
    mass: float, k: float, b: float, friction: float, length: float, loss: float, *, height: float, held: float,
    rate: float, count: int,
) -> np.ndarray:  # fmt: skip
    """x2 of a body over a locked actuator: held for a while, dropped from a hop height, hopping until it stands."""

    def stance(x: float, v: float) -> float:
        return (k * (length - x) - b * v) / mass - G

    x, v, flies, found = length + height, 0.0, True, []
    for n in range(count):
        found.append(x)
        for _ in range(round(1.0 / (rate * STEP)) if n >= held * rate else 0):
            below = x + STEP * (v - 0.5 * STEP * G) < length
            if flies and below:
                impact = math.sqrt(v * v + 2.0 * G * (x - length))
                fall = (v + impact) / G
                x, v = slide(stance, friction, length, -impact * math.sqrt(1.0 - loss), STEP - fall)
                flies = False
            elif flies:
                x, v = x + STEP * (v - 0.5 * STEP * G), v - STEP * G
            else:
                x, v = slide(stance, friction, x, v, STEP)
                flies = x > length and v > 0.0
                if flies:  # since the time at which the foot came off it has flown
                    v -= (x - length) / v * (stance(x, v) - friction + G)
    return np.array(found)
