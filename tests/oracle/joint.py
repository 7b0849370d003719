"""Exact motions of a joint under steps of its current, and how they depend on every input, at 50 digits, from

    J q'' = k_t i - k (q - q_0) - b q' + load - F(q'),    F = F_p forward, -F_m backward, at rest up to F_sp or F_sm more

by the chain rule alone: over a time h in which the side s of the friction stays,

    y(h) = y(0) (1 - w S) + v(0) R + c S,    v(h) = c R - w R y(0) + v(0) (1 - p R - w S),    y = q - q_0

with p = b/J, w = k/J, c = (k_t i + load - F_s)/J, R'' + p R' + w R = 0, R(0) = 0, R'(0) = 1 and S its integral, as power
series. Each number carries its derivatives by all inputs; so does the time of an event, where v = 0 says it. Nothing here
knows how a change passes an event.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from mpmath import mp

PARAMETERS = ("J", "k", "q_0", "b", "F_p", "F_m", "F_sp", "F_sm", "k_t", "load")
DIGITS = 50
GRID = 64
"""Places in a step where the sign of the velocity is looked at."""
GRAZES = 1e-4
"""A draw grazes where a decision is closer than this part of what it weighs: the acceleration at which a velocity vanishes
beside the largest forces, the force that holds beside the friction at rest, a velocity that turns without an event beside
the largest."""


@dataclass(frozen=True)
class Dual:
    """A number and its derivatives by all inputs, an array of them."""

    value: Any
    by: Any

    def __add__(self, other: Any) -> "Dual":
        return Dual(self.value + other.value, self.by + other.by)

    def __sub__(self, other: Any) -> "Dual":
        return Dual(self.value - other.value, self.by - other.by)

    def __mul__(self, other: Any) -> "Dual":
        return Dual(self.value * other.value, self.by * other.value + other.by * self.value)

    def __truediv__(self, other: Any) -> "Dual":
        quotient = self.value / other.value
        return Dual(quotient, (self.by - other.by * quotient) / other.value)


class Grazing(Exception):
    """A decision of the draw is too close."""


@dataclass(frozen=True)
class Answer:
    """Of the end: its time, place and velocity, with the derivatives by place and velocity at the start, PARAMETERS,
    each step's input, and each step's time but the first.
    """

    rests: bool
    events: int
    T: Dual
    q: Dual
    v: Dual


def response(p: Any, w: Any, h: Any) -> tuple[Any, ...]:
    """R, S and their derivatives by p and by w."""
    one, none = mp.mpf(1), mp.mpf(0)
    before, last = (none, none, none), (one, none, none)  # r_n and its derivatives by p and w
    sums = [none] * 6
    power = h  # h^(n+1)/(n+1)!
    for n in range(400):
        later = power * h / (n + 2)
        for i in range(3):
            sums[i] += last[i] * power
            sums[3 + i] += last[i] * later
        if n > 3 and max(abs(each) for each in (*last, *before)) * power < mp.mpf(10) ** -(DIGITS + 8) * h:
            break
        before, last = (
            last,
            (
                -(p * last[0] + w * before[0]),
                -(p * last[1] + w * before[1] + last[0]),
                -(p * last[2] + w * before[2] + before[0]),
            ),
        )
        power = later
    else:
        raise ArithmeticError("the series of a step is too long")
    return tuple(sums)


class Joint:
    """A joint with its inputs: place and velocity at the start, parameters, currents and times of the steps, horizon."""

    def __init__(self, start: Any, parameters: Any, currents: Any, times: Any, horizon: float) -> None:
        values = [*start, *parameters, *currents, *times[1:]]
        self.size = len(values)
        each = [self._input(n, value) for n, value in enumerate(values)]
        self.q, self.v = each[:2]
        self.of = dict(zip(PARAMETERS, each[2 : 2 + len(PARAMETERS)], strict=True))
        steps = each[2 + len(PARAMETERS) :]
        self.currents, later = steps[: len(currents)], steps[len(currents) :]
        self.none = Dual(mp.mpf(0), self._zeros())
        self.times = [self.none, *later, Dual(mp.mpf(horizon), self._zeros())]
        self.p, self.w = self.of["b"] / self.of["J"], self.of["k"] / self.of["J"]
        self.events = 0

    def _zeros(self) -> Any:
        return np.array([mp.mpf(0)] * self.size, dtype=object)

    def _input(self, n: int, value: Any) -> Dual:
        by = self._zeros()
        by[n] = mp.mpf(1)
        return Dual(mp.mpf(value), by)

    def flow(self, q: Dual, v: Dual, c: Dual, h: Dual) -> tuple[Dual, Dual]:
        """Place and velocity a time h later, at the constant c."""
        p, w, y = self.p, self.w, q - self.of["q_0"]
        R, R_p, R_w, S, S_p, S_w = response(p.value, w.value, h.value)
        rate = 1 - p.value * R - w.value * S
        of_R = Dual(R, R_p * p.by + R_w * w.by + rate * h.by)
        of_S = Dual(S, S_p * p.by + S_w * w.by + R * h.by)
        one = Dual(mp.mpf(1), self._zeros())
        place = y * (one - w * of_S) + v * of_R + c * of_S
        velocity = c * of_R - w * of_R * y + v * (one - p * of_R - w * of_S)
        return place + self.of["q_0"], velocity

    def velocity(self, q: Any, v: Any, c: Any, h: Any) -> tuple[Any, Any]:
        """Velocity and acceleration, without derivatives."""
        p, w, y = self.p.value, self.w.value, q - self.of["q_0"].value
        R, _, _, S, _, _ = response(p, w, h)
        rate = 1 - p * R - w * S
        place = y * (1 - w * S) + v * R + c * S
        velocity = c * R - w * R * y + v * rate
        return velocity, c - w * place - p * velocity

    def at_places(self, q: Any, v: Any, c: Any, length: Any) -> tuple[Any, Any]:
        """Velocities and accelerations at the places of a step in double precision, where their signs are looked at."""
        p, w, t = float(self.p.value), float(self.w.value), np.linspace(0, float(length), GRID + 1)
        root = np.sqrt(complex(p * p / 4 - w))
        root = root if abs(root) > 1e-9 else 1e-9
        R = np.real(np.exp(-p / 2 * t) * np.sinh(root * t) / root)
        R_dot = np.real(np.exp(-p / 2 * t) * np.cosh(root * t)) - p / 2 * R
        velocity, rate = float(v), float(c - self.w.value * (q - self.of["q_0"].value) - self.p.value * v)
        return velocity * (R_dot + p * R) + rate * R, rate * R_dot - w * velocity * R

    def force(self, q: Dual, n: int) -> Dual:
        """Without friction, on the joint at rest."""
        of = self.of
        return of["k_t"] * self.currents[n] + of["load"] - of["k"] * (q - of["q_0"])

    def side_from_rest(self, q: Dual, n: int) -> int:
        """Where it goes; 0 if friction holds it."""
        of, force = self.of, self.force(q, n).value
        up, down = (of["F_p"] + of["F_sp"]).value, (of["F_m"] + of["F_sm"]).value
        if min(abs(force - up), abs(force + down)) < GRAZES * max(up, down, abs(force)):
            raise Grazing
        return 1 if force > up else -1 if force < -down else 0

    def constant(self, side: int, n: int) -> Dual:
        """c under a step, slipping to a side."""
        of = self.of
        friction = of["F_p"] if side > 0 else self.none - of["F_m"]
        return (of["k_t"] * self.currents[n] + of["load"] - friction) / of["J"]

    def first_zero(self, q: Any, v: Any, c: Any, length: Any, side: int) -> Any:
        """When the velocity, to a side, vanishes first within a length; None if it does not."""
        velocities, rates = (side * each for each in self.at_places(q, v, c, length))
        largest = np.abs(velocities).max()
        for j in range(1, GRID + 1):
            if velocities[j] <= 0:
                low, high = length * (j - 1) / GRID, length * j / GRID
                t = (low + high) / 2
                for _ in range(200):  # Newton, within the bracket
                    velocity, acceleration = self.velocity(q, v, c, t)
                    low, high = (t, high) if side * velocity > 0 else (low, t)
                    last, t = t, t - velocity / acceleration
                    t = t if low <= t <= high else (low + high) / 2
                    if abs(t - last) <= mp.mpf(10) ** -(DIGITS - 3) * length:
                        return t
                raise ArithmeticError("no zero in its bracket")
            turns = rates[j - 1] < 0 < rates[j]
            if turns and min(velocities[j], velocities[j - 1]) < 0.05 * largest:
                raise Grazing
        return None

    def solve(self) -> Answer:
        """The end of its motion; Grazing where a decision is too close."""
        q, v, t = self.q, self.v, self.none
        side = 1 if v.value > 0 else -1
        rests_from = None
        for n in range(len(self.currents)):
            end = self.times[n + 1]
            if side == 0:
                t, side = self.times[n], self.side_from_rest(q, n)
                rests_from = rests_from if side == 0 else None
            while side != 0:
                c = self.constant(side, n)
                zero = self.first_zero(q.value, v.value, c.value, (end - t).value, side)
                if zero is None:
                    q, v = self.flow(q, v, c, end - t)
                    t = end
                    break
                # v(zero, inputs) = 0 moves the time: d_zero = -d_v/v'
                at = Dual(zero, self._zeros())
                _, velocity = self.flow(q, v, c, at)
                _, rate = self.velocity(q.value, v.value, c.value, zero)
                if abs(rate) < GRAZES * max(abs(c.value), abs((self.force(q, n) / self.of["J"]).value)):
                    raise Grazing
                if min(zero, end.value - t.value - zero) < GRAZES * (end - t).value:
                    raise Grazing
                at = Dual(zero, -velocity.by / rate)
                q, _ = self.flow(q, v, c, at)
                v, t = self.none, t + at
                self.events += 1
                side = self.side_from_rest(q, n)
                if side == 0:
                    rests_from = t
        rests = rests_from is not None
        return Answer(rests, self.events, rests_from if rests_from is not None else self.times[-1], q, v)
