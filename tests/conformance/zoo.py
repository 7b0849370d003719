"""The mechanisms that ship, as physics: random numbers for each, a start, and the mechanism for the integrator.

The equations are those of the docstrings of derive/models, written once more by hand for tests/oracle/numeric.py.
"""

import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.oracle.numeric import Mass, Mechanism

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """Parameters of the model, the start by names (positions, then velocities), and the same for the integrator.

    u: the input, a number or steps (t, u).
    """

    robot: dict[str, float]
    start: dict[str, float]
    u: float | tuple[tuple[float, float], ...]
    horizon: float
    mechanism: Mechanism
    q: tuple[float, ...]
    v: tuple[float, ...]
    fastest: float
    """The largest rate of a pole, [1/s]."""

    @property
    def steps(self) -> tuple[tuple[float, float], ...]:
        """The input as steps."""
        return self.u if isinstance(self.u, tuple) else ((0.0, self.u),)


class Draw(random.Random):
    """Random numbers over decades, some of them zero."""

    def over(self, low: float, high: float, zero: float = 0.0) -> float:
        return 0.0 if self.random() < zero else math.exp(self.uniform(math.log(low), math.log(high)))

    def either(self, low: float, high: float) -> float:
        return self.choice([-1.0, 1.0]) * self.over(low, high)


def rate(*terms: tuple[float, float, float]) -> float:
    """A bound on the poles' rates of masses m on springs k with dampers b: (m, k, b)."""
    return max(math.sqrt(k / m) + b / m for m, k, b in terms)


# ---- one mass ----


def one(
    draw: Draw, name: str, inertia: float, stiffness: float, slack: float, damping: float, constant: float,
    per_current: float, friction: Mass, robot: dict[str, float], u: float, velocity: str,
) -> Case:  # fmt: skip
    """A mass on a spring to the ground, under a constant force and a current, from a random state within its stops."""

    def force(q: Array, v: Array, u: float) -> Array:
        return -stiffness * (q - slack) - damping * v + constant + per_current * u

    fastest = rate((inertia, stiffness, damping)) + 1.0
    low, high = max(friction.low, slack - 1.0), min(friction.high, slack + 1.0)
    q = draw.uniform(low, high) if draw.random() < 0.8 else draw.choice([low, high])
    v = draw.either(0.01, 3.0) if draw.random() < 0.85 else 0.0
    horizon = min(10.0 / math.sqrt(stiffness / inertia) if stiffness else math.inf, 4.0)
    mechanism = Mechanism((friction,), force)
    return Case(robot, {name: q, velocity: v}, u, horizon, mechanism, (q,), (v,), fastest)


def levels(draw: Draw, force: float, rest: bool) -> tuple[float, float, float, float]:
    """Friction forward and backward, in motion and at rest, below and about a force."""
    forward = draw.over(1e-3 * force, force, zero=0.2)
    backward = forward if draw.random() < 0.5 else draw.over(1e-3 * force, force, zero=0.2)
    factor = draw.choice([1.0, draw.uniform(1.0, 2.0)]) if rest else 1.0
    return forward, backward, forward * factor, backward * factor


def stops(draw: Draw, about: float) -> tuple[float, float]:
    low = about - draw.over(0.02, 1.0) if draw.random() < 0.6 else -math.inf
    high = about + draw.over(0.02, 1.0) if draw.random() < 0.6 else math.inf
    return low, high


# ---- the hopper and its relatives ----


def hopper(draw: Draw) -> tuple[dict[str, float], float]:
    """Numbers of a hopper with friction at rest in some, and a current."""
    m_eff, m_s = draw.over(1.0, 100.0), draw.over(0.5, 20.0)
    k = m_s * draw.over(5.0, 40.0) ** 2
    robot = {
        "m_eff": m_eff, "m_s": m_s, "k": k, "L0": draw.uniform(0.2, 0.6), "c": draw.choice([0.0, draw.uniform(-0.01, 0.01)]),
        "b1": draw.over(0.01, 2.0, zero=0.15) * math.sqrt(k * m_eff), "b2": draw.over(1e-3, 0.3, zero=0.15) * math.sqrt(k * m_s),
        "f1": draw.over(0.01, 3.0, zero=0.2), "f2": draw.over(0.01, 3.0, zero=0.2),
        "f1_excess": draw.over(0.01, 2.0, zero=0.5), "f2_excess": draw.over(0.01, 2.0, zero=0.5),
        "gamma2": draw.either(1.0, 100.0), "g": 9.81, "x1_min": -math.inf, "x1_max": math.inf,
    }  # fmt: skip
    if draw.random() < 0.5:
        robot |= {"x1_min": -draw.over(1e-3, 0.1), "x1_max": draw.over(1e-3, 0.1)}
    return robot, draw.uniform(-1.0, 1.0) * m_s * 9.81 / abs(robot["gamma2"])


def leg(
    draw: Draw, robot: dict[str, float], u: float, *, in_leg: Callable[[float, float], float] = lambda x, v: 0.0,
    on_actuator: Callable[[float], float] = lambda v: 0.0, on_body: float = 0.0, rates: float = 0.0,
) -> Case:  # fmt: skip
    """(3), (4) with further forces: in the leg by x1 - x2 and v1 - v2, on the actuator by v1, on the body."""
    r = robot
    length = r["L0"] + r["c"]

    def contact(q: Array, v: Array) -> float:
        return float(r["k"] * (q[0] - q[1] + length) + in_leg(q[0] - q[1], v[0] - v[1]))

    def force(q: Array, v: Array, u: float) -> Array:
        n = contact(q, v)
        actuator = -n + r["k"] * r["c"] - r["b1"] * v[0] - r["gamma2"] * u + on_actuator(v[0])
        return np.array([actuator, n - r["m_s"] * r["g"] - r["b2"] * v[1] + on_body])

    def mass(n: int, name: str, low: float, high: float) -> Mass:
        m, slide, rest = r[("m_eff", "m_s")[n - 1]], r[f"f{n}"], r[f"f{n}"] + r[f"f{n}_excess"]
        return Mass(name, m, (m * slide, m * slide), (m * rest, m * rest), low, high)

    masses = (mass(1, "x1", r["x1_min"], r["x1_max"]), mass(2, "x2", -math.inf, math.inf))
    x1 = draw.choice([0.0, draw.uniform(max(r["x1_min"], -0.05), min(r["x1_max"], 0.05))])
    v1, v2 = draw.choice([0.0, draw.either(0.01, 0.5)]), -draw.over(0.3, 3.0)
    pressed = draw.over(1e-3, 0.05)
    # N is affine in x1 - x2 + L0 + c: a little more than where it is zero at this velocity
    zero = -contact(np.array([0.0, length]), np.array([v1, v2])) / (
        contact(np.array([0.0, length - 1.0]), np.zeros(2)) - contact(np.array([0.0, length]), np.zeros(2))
    )
    x2 = x1 + length - max(zero, 0.0) - pressed
    start = {"x1": x1, "x2": x2, "v1": v1, "v2": v2}
    fastest = rate((r["m_eff"], r["k"], r["b1"]), (r["m_s"], r["k"], r["b2"])) + rates
    return Case(r, start, u, 2.0, Mechanism(masses, force, contact), (x1, x2), (v1, v2), fastest)


# ---- one after the other ----


def draw_hopper(draw: Draw) -> Case:
    return leg(draw, *hopper(draw))


def draw_leg_damper(draw: Draw) -> Case:
    robot, u = hopper(draw)
    b12 = draw.over(1e-3, 1.0, zero=0.1) * math.sqrt(robot["k"] * robot["m_s"])
    lightest = min(robot["m_s"], robot["m_eff"])
    case = leg(draw, robot, u, in_leg=lambda x, v: b12 * v, rates=2.0 * b12 / lightest)
    case.robot["b12"] = b12
    return case


def draw_second_spring(draw: Draw) -> Case:
    robot, u = hopper(draw)
    k_2, length = (
        robot["k"] * draw.over(1e-3, 1.0),
        robot["L0"] + robot["c"] + draw.choice([0.0, draw.uniform(-0.01, 0.01)]),
    )
    case = leg(
        draw,
        robot,
        u,
        in_leg=lambda x, v: k_2 * (x + length),
        rates=rate((min(robot["m_s"], robot["m_eff"]), k_2, 0.0)),
    )
    case.robot.update(k_2=k_2, L_2=length)
    return case


def draw_cable(draw: Draw) -> Case:
    robot, u = hopper(draw)
    pull = robot["m_s"] * robot["g"] * draw.uniform(-0.5, 0.9)
    case = leg(draw, robot, u, on_body=pull)
    case.robot["F_cable"] = pull
    return case


def draw_back_emf(draw: Draw) -> Case:
    robot, u = hopper(draw)
    k_emf = draw.over(1e-3, 1.0) * math.sqrt(robot["k"] * robot["m_eff"])
    case = leg(draw, robot, u, on_actuator=lambda v: -k_emf * v, rates=k_emf / robot["m_eff"])
    case.robot["k_emf"] = k_emf
    return case


def draw_joint(draw: Draw) -> Case:
    J, k = draw.over(1e-3, 1.0), draw.over(0.1, 100.0, zero=0.25)
    b = draw.over(1e-3, 2.0, zero=0.2) * (math.sqrt(k * J) if k else J)
    q_0, k_t, i = draw.uniform(-0.3, 0.3), draw.either(0.01, 1.0), draw.choice([0.0, draw.either(0.1, 5.0)])
    size = abs(k_t * i) + k * 0.3 + 0.1 * J
    load = draw.choice([0.0, draw.uniform(-0.5, 0.5) * size])
    F_p, F_m, rest_p, rest_m = levels(draw, size, rest=True)
    low, high = stops(draw, q_0)
    robot = {
        "J": J, "k": k, "q_0": q_0, "b": b, "F_p": F_p, "F_m": F_m, "F_sp": rest_p - F_p, "F_sm": rest_m - F_m,
        "k_t": k_t, "load": load, "q_min": low, "q_max": high,
    }  # fmt: skip
    mass = Mass("q", J, (F_p, F_m), (rest_p, rest_m), low, high)
    return one(draw, "q", J, k, q_0, b, load, k_t, mass, robot, i, "q_dot")


def draw_servo(draw: Draw) -> Case:
    J, ring = draw.over(1e-3, 1.0), draw.over(5.0, 200.0)
    K_p, damped = J * ring**2, draw.over(0.02, 4.0)
    K_d = draw.choice([0.0, 2.0 * damped * J * ring]) if draw.random() < 0.1 else 2.0 * damped * J * ring
    b, k_t = draw.over(1e-3, 0.5, zero=0.3) * J * ring, draw.over(0.01, 1.0)
    most = K_p * draw.over(1e-2, 1.0) if draw.random() < 0.85 else math.inf
    size = min(most, 0.3 * K_p)
    load = draw.choice([0.0, draw.uniform(-0.5, 0.5) * size])
    F_p, F_m, rest_p, rest_m = levels(draw, 0.5 * size, rest=True)
    low, high = stops(draw, 0.0)
    robot = {
        "J": J, "b": b, "F_p": F_p, "F_m": F_m, "F_sp": rest_p - F_p, "F_sm": rest_m - F_m, "k_t": k_t, "K_p": K_p,
        "K_d": K_d, "load": load, "q_min": low, "q_max": high, "i_max": most / k_t,
    }  # fmt: skip
    horizon = min((6.0 + 12.0 * draw.random()) / ring + 3.0 * math.sqrt(J / size), 4.0)
    count = draw.choice([1, 1, draw.randint(2, 12)])
    targets = [draw.choice([draw.uniform(-1.0, 1.0), draw.uniform(-0.05, 0.05), 0.25]) for _ in range(count)]
    times = [0.0, *sorted(draw.uniform(0.02, 0.95) * horizon for _ in range(count - 1))]

    def asked(q: Array, v: Array, target: float) -> float:
        return float(K_p * (target - q[0]) - K_d * v[0])

    def force(q: Array, v: Array, target: float) -> Array:
        return np.array([np.clip(asked(q, v, target), -most, most) - b * v[0] + load])

    kinks = [lambda q, v, u, side=side: asked(q, v, u) - side * most for side in (-1.0, 1.0)] if most < math.inf else []
    mass = Mass("q", J, (F_p, F_m), (rest_p, rest_m), low, high)
    ends = max(low, -1.0), min(high, 1.0)
    q = draw.uniform(*ends) if draw.random() < 0.8 else draw.choice(ends)
    v = draw.either(0.01, 3.0) if draw.random() < 0.5 else 0.0
    u = targets[0] if count == 1 else tuple(zip(times, targets, strict=True))
    mechanism, fastest = Mechanism((mass,), force, None, tuple(kinks)), rate((J, K_p, b + K_d)) + 1.0
    return Case(robot, {"q": q, "q_dot": v}, u, horizon, mechanism, (q,), (v,), fastest)


def draw_pendulum(draw: Draw) -> Case:
    m, length, g = draw.over(0.01, 5.0), draw.over(0.02, 1.0), 9.81
    J, k = m * length**2 * draw.uniform(1.0, 2.0), m * g * length
    b, k_t, i = (
        draw.over(1e-3, 2.0, zero=0.2) * math.sqrt(k * J),
        draw.either(0.01, 1.0),
        draw.choice([0.0, draw.either(0.1, 5.0)]),
    )
    F_p, F_m, rest_p, rest_m = levels(draw, abs(k_t * i) + 0.3 * k, rest=True)
    rest = max(rest_p, rest_m)
    low, high = stops(draw, 0.0)
    robot = {
        "J": J, "m": m, "l": length, "g": g, "b": b, "k_t": k_t, "F_p": F_p, "F_m": F_m, "F_s": rest, "q_min": low, "q_max": high,
    }  # fmt: skip
    mass = Mass("q", J, (F_p, F_m), (rest, rest), low, high)
    return one(draw, "q", J, k, 0.0, b, 0.0, k_t, mass, robot, i, "q_dot")


def draw_cart(draw: Draw) -> Case:
    m, J, r = draw.over(0.1, 10.0), draw.over(1e-6, 1e-3, zero=0.2), draw.over(5e-3, 0.05)
    k_m, R, b = draw.over(0.01, 0.5), draw.over(0.2, 10.0), draw.over(0.01, 5.0, zero=0.3)
    moved, pull = m + J / r**2, k_m / (R * r)
    U = draw.choice([0.0, draw.uniform(-24.0, 24.0)])
    F = draw.over(1e-2, 1.0, zero=0.2) * (pull * abs(U) + m)
    low, high = stops(draw, 0.0)
    robot = {"m": m, "J": J, "r": r, "k_m": k_m, "R": R, "b": b, "F": F, "x_min": low, "x_max": high}
    mass = Mass("x", moved, (F, F), None, low, high)
    return one(draw, "x", moved, 0.0, 0.0, b + k_m**2 / (R * r**2), 0.0, pull, mass, robot, U, "v")


def draw_relief_valve(draw: Draw) -> Case:
    m, k, x_0, A = draw.over(5e-3, 0.5), draw.over(1e3, 1e5), draw.over(1e-3, 0.02), draw.over(1e-5, 1e-3)
    b, F, high = (
        draw.over(0.01, 2.0) * math.sqrt(k * m),
        draw.over(1e-3, 0.5, zero=0.2) * k * x_0,
        draw.over(1e-3, 0.02),
    )
    p = k * (x_0 + draw.uniform(-0.5, 1.5) * high) / A
    robot = {"m": m, "k": k, "x_0": x_0, "b": b, "F": F, "A": A, "x_max": high}
    mass = Mass("x", m, (F, F), None, 0.0, high)
    return one(draw, "x", m, k, -x_0, b, 0.0, A, mass, robot, p, "v")


def draw_sea_held(draw: Draw) -> Case:
    J_m, N, k_m, k = draw.over(1e-6, 1e-3), draw.over(1.0, 100.0), draw.over(0.01, 0.5), draw.over(10.0, 1000.0)
    inertia = N**2 * J_m
    b_m, d = (
        draw.over(1e-3, 1.0, zero=0.2) * math.sqrt(k * inertia) / N**2,
        draw.over(1e-3, 0.5, zero=0.2) * math.sqrt(k * inertia),
    )
    i = draw.uniform(-1.0, 1.0) * k * 0.3 / (N * k_m)
    F_m, (low, high) = draw.over(1e-3, 0.3, zero=0.2) * k * 0.3, stops(draw, 0.0)
    robot = {
        "J_m": J_m, "N": N, "k_m": k_m, "b_m": b_m, "F_m": F_m, "k": k, "d": d, "theta_min": low, "theta_max": high,
    }  # fmt: skip
    mass = Mass("theta", inertia, (F_m, F_m), None, low, high)
    return one(draw, "theta", inertia, k, 0.0, d + N**2 * b_m, 0.0, N * k_m, mass, robot, i, "theta_dot")


def draw_sea(draw: Draw) -> Case:
    J_m, N, k_m, k, J_l = (
        draw.over(1e-5, 1e-3),
        draw.over(1.0, 100.0),
        draw.over(0.01, 0.5),
        draw.over(10.0, 1000.0),
        draw.over(0.01, 1.0),
    )
    rotor = N**2 * J_m
    light = min(rotor, J_l)
    b_m, d = (
        draw.over(1e-3, 1.0, zero=0.2) * math.sqrt(k * rotor) / N**2,
        draw.over(1e-3, 0.3, zero=0.2) * math.sqrt(k * light),
    )
    b_l = draw.over(1e-3, 0.3, zero=0.2) * math.sqrt(k * J_l)
    i, load = draw.uniform(-1.0, 1.0) * k * 0.3 / (N * k_m), draw.choice([0.0, draw.uniform(-0.1, 0.1) * k])
    F_m, F_l, (low, high) = (
        draw.over(1e-3, 0.3, zero=0.2) * k * 0.3,
        draw.over(1e-3, 0.3, zero=0.2) * k * 0.3,
        stops(draw, 0.0),
    )
    robot = {
        "J_m": J_m, "N": N, "k_m": k_m, "b_m": b_m, "F_m": F_m, "k": k, "d": d, "J_l": J_l, "b_l": b_l, "F_l": F_l, "load": load,
        "theta_min": low, "theta_max": high,
    }  # fmt: skip

    def force(q: Array, v: Array, i: float) -> Array:
        spring = k * (q[0] - q[1]) + d * (v[0] - v[1])
        return np.array([N * k_m * i - spring - N**2 * b_m * v[0], spring - b_l * v[1] + load])

    theta = draw.uniform(max(low, -0.5), min(high, 0.5))
    start = {
        "theta": theta,
        "q": theta + draw.uniform(-0.3, 0.3),
        "theta_dot": draw.choice([0.0, draw.either(0.01, 3.0)]),
        "q_dot": draw.choice([0.0, draw.either(0.01, 3.0)]),
    }
    masses = (Mass("theta", rotor, (F_m, F_m), None, low, high), Mass("q", J_l, (F_l, F_l)))
    fastest = rate((rotor, k, N**2 * b_m), (J_l, k, b_l)) + 2.0 * d / light
    horizon = 8.0 / math.sqrt(k / rotor + k / J_l)
    q, v = (start["theta"], start["q"]), (start["theta_dot"], start["q_dot"])
    return Case(robot, start, i, horizon, Mechanism(masses, force), q, v, fastest)


ZOO: dict[str, Callable[[Draw], Case]] = {
    name.removeprefix("draw_"): draw for name, draw in list(globals().items()) if name.startswith("draw_")
}


def cases(name: str, seed: int, count: int, stiffest: float) -> Iterator[Case]:
    """Random cases of a model; those whose fastest pole times the horizon is beyond `stiffest` are drawn anew."""
    draw = Draw(f"{name} {seed}")
    while count:
        case = ZOO[name](draw)
        if case.fastest * case.horizon < stiffest:
            count -= 1
            yield case
