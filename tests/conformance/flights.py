"""Random flights, degenerate ones among them, and how far a flight of hopform is from the 50-digit reference.

    time/max(T, sqrt(m_s/k))   position/0.1 m   velocity/(1 m/s)
    energy/(max(m_s, m_eff) max(|v|, 1 m/s)^2/2, Kp x1^2/2)

An error above the tolerance is divided by the condition number: what a relative change of an input by d does, over d.
"""

import dataclasses
import math
import random
from typing import Any

import numpy as np

import hopform
from tests.conformance.errors import TOLERANCE, rounded
from tests.oracle.reference.flight import FlightReference, solve_flight
from tests.oracle.reference.records import mp

DIFFERENCE = mp.mpf("1e-25")


def at_rest(seed: int) -> float:
    """Friction at rest less that in motion, of a third; by a stream of its own."""
    draw = random.Random(f"{seed} at rest")
    return math.exp(draw.uniform(math.log(0.01), math.log(10.0))) if draw.random() < 1.0 / 3.0 else 0.0


def random_flight(seed: int) -> tuple[hopform.Robot, dict[str, Any]]:
    """A robot and a flight; `y` is the height of the ground ahead over the foot."""
    draw = random.Random(seed)

    def over(low: float, high: float) -> float:
        return math.exp(draw.uniform(math.log(low), math.log(high)))

    def some(value: float, zero: float) -> float:
        return 0.0 if draw.random() < zero else value

    m_eff, time = over(0.1, 100.0), over(0.05, 1.0)
    rate = over(0.1, 30.0) / time
    kind = draw.choice(("both", "both", "both", "critical", "Kp", "Kd", "none", "undamped"))
    b1 = some(m_eff * rate * over(1e-3, 3.0), 0.25)
    Kp = 0.0 if kind in ("Kd", "none") else m_eff * rate * rate
    Kd = 0.0 if kind in ("Kp", "none", "undamped") else m_eff * rate * over(0.01, 10.0)
    if kind == "critical":
        Kd = max(2.0 * m_eff * rate - b1, 0.0)
    if kind == "undamped":
        b1 = 0.0
    low, high = -math.inf, math.inf
    if draw.random() < 0.5:
        low, high = -over(1e-3, 0.1), over(1e-3, 0.1)
    x1 = draw.choice((0.0, draw.uniform(-0.1, 0.1), low, high))
    x1 = min(max(x1 if math.isfinite(x1) else 0.05, low), high)
    v1 = some(draw.uniform(-2.0, 2.0), 0.3)
    largest = m_eff * draw.choice((over(0.1, 100.0), math.inf))
    gamma2 = draw.choice((-1.0, 1.0)) * over(0.1, 100.0) if draw.random() < 0.9 else 0.0
    robot = hopform.Robot(
        m_eff=m_eff, m_s=over(0.1, 10.0), k=over(100.0, 1e5), L0=0.4, c=some(draw.uniform(-0.01, 0.01), 0.5), b1=b1,
        f1=some(over(0.01, 10.0), 0.3), gamma2=gamma2, g=9.81, x1_min=low, x1_max=high,
        u_max=largest / abs(gamma2) if gamma2 else 3.0, impact_loss=draw.choice((0.0, 0.05)),
        f1_excess=at_rest(seed),
    )  # fmt: skip
    y = draw.choice((0.0, 0.0, draw.uniform(-0.2, 0.2)))
    v2 = time * 9.81 / 2.0 + some(v1, 0.5)
    return robot, {"x1": x1, "v1": v1, "v2": v2, "y": y, "gains": (Kp, Kd), "horizon": 3.0, "max_phases": 200}


def solved(
    robot: hopform.Robot, inputs: dict[str, Any], dtype: Any = np.float64
) -> tuple[hopform.Flight, dict[str, Any]]:
    """The flight, and its inputs as the solver saw them: rounded to the type, with y formed from x2."""
    robot = hopform.Robot(**rounded(robot, dtype))
    seen = {name: float(dtype(inputs[name])) for name in ("x1", "v1", "v2")}
    length = robot.L0 + robot.c
    x2 = None if inputs["y"] == 0.0 else seen["x1"] - inputs["y"] + length
    gains = tuple(float(dtype(gain)) for gain in inputs["gains"])
    settings = {"horizon": inputs["horizon"], "max_phases": inputs["max_phases"]}
    flight = hopform.solve_flight(robot, **seen, x2=x2, gains=gains, **settings, dtype=dtype)
    y = 0.0 if x2 is None else float(dtype(seen["x1"] - x2 + robot.L0 + robot.c))
    return flight, {**seen, "y": y, "gains": gains, **settings}


def outcome(exact: FlightReference, robot: hopform.Robot, inputs: dict[str, Any], duration: float) -> list[Any]:
    """Times, state and ledger in the units of the measure, for a flight of that duration."""
    time = max(duration, math.sqrt(robot.m_s / robot.k))
    fastest = max(abs(inputs["v1"]), abs(inputs["v2"]), 1.0)
    energy = max(max(robot.m_s, robot.m_eff) * fastest**2, inputs["gains"][0] * inputs["x1"] ** 2) / 2.0
    x1, v1, v2, y = exact.end
    state = [exact.duration / time, x1 * 10, v1, v2, y * 10]
    return [*state, *(event.time / time for event in exact.events), *(entry / energy for entry in exact.ledger)]


def of_flight(flight: hopform.Flight) -> FlightReference:
    """A flight of hopform in the form of the reference."""
    end, duration = flight.end, flight.duration
    y = 0.0 if flight.status == "touchdown" else -float(flight.foot(duration))
    return FlightReference(
        flight.status, duration, (end.x1, end.v1, end.v2, y), list(flight.events), flight.ledger(duration)
    )


def condition(robot: hopform.Robot, inputs: dict[str, Any], dtype: Any, exact: FlightReference) -> float:
    """How much an outcome moves for a relative change of one input, the largest of all."""
    parameters = {name: value for name, value in rounded(robot, dtype).items() if math.isfinite(value) and value}
    numbers = {name: inputs[name] for name in ("x1", "v1", "v2", "y") if inputs[name]}
    duration = float(exact.duration)
    here = outcome(exact, robot, inputs, duration)
    largest = 0.0
    for name in [*parameters, *numbers, "Kp", "Kd"]:
        changed, robot_changed = dict(inputs), rounded(robot, dtype)
        factor = 1 + DIFFERENCE
        if name in parameters:
            robot_changed |= {name: mp.mpf(parameters[name]) * factor}
        elif name in numbers:
            changed |= {name: mp.mpf(numbers[name]) * factor}
        else:
            n = ("Kp", "Kd").index(name)
            changed["gains"] = tuple(mp.mpf(gain) * (factor if n == i else 1) for i, gain in enumerate(inputs["gains"]))
        for pair in (("x1", "x1_min"), ("x1", "x1_max")):  # what lies on a stop moves with it
            if name in pair and inputs["x1"] == getattr(robot, pair[1]):
                changed["x1"] = mp.mpf(inputs["x1"]) * factor
                robot_changed[pair[1]] = mp.mpf(inputs["x1"]) * factor
        moved = outcome(solve_flight(robot_changed, **changed), robot, inputs, duration)
        if len(moved) == len(here):
            largest = max(largest, *(float(abs(a - b) / DIFFERENCE) for a, b in zip(moved, here, strict=True)))
    return largest


def assert_same_flight(robot: hopform.Robot, inputs: dict[str, Any], dtype: Any = np.float64) -> float:
    """Solve and compare with the reference: same status, same events, error within the tolerance."""
    flight, seen = solved(robot, inputs, dtype)
    exact = solve_flight(rounded(robot, dtype), **seen)
    what = f"{robot} {seen} {dtype.__name__}"
    assert flight.status == exact.status, (exact.status, flight.status, what)
    kept = dataclasses.replace(exact, events=exact.events[: inputs["max_phases"] - 1])
    assert [event.kind for event in flight.events] == [event.kind for event in kept.events], what
    both = (outcome(one, robot, seen, float(exact.duration)) for one in (of_flight(flight), kept))
    pairs = zip(*both, strict=True)
    error = max(abs(float(ours - theirs)) for ours, theirs in pairs)
    if error > TOLERANCE[dtype]:
        error /= max(1.0, condition(robot, seen, dtype, exact))
    assert error <= TOLERANCE[dtype], f"scaled error {error:.2e}: {what}"
    return error
