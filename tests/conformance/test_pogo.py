"""A pogo stick, one body on a leg without a mass: its stances against the integrator, its flights against the physics.

The foot has no mass, so the leg carries nothing in flight: K y + d y' = 0 of its two springs and the damper, and y fades as
exp(-K t/d) from what a take-off leaves; the body falls freely.
"""

import math
from collections.abc import Iterator

import numpy as np
import pytest
from scipy.optimize import brentq

from tests import needs
from tests.conformance.test_zoo import that_of_the_integrator
from tests.conformance.zoo import Case, Draw
from tests.derived import model_file, solver_of

pytestmark = needs.library


def cases(seed: int, count: int) -> Iterator[Case]:
    """Pogo sticks that come down on a leg which the last flight may have left compressed, slowly or fast."""
    draw = Draw(f"pogo {seed}")
    for _ in range(count):
        m, k, k_2, g = draw.over(0.1, 50.0), draw.over(1e2, 1e5), draw.over(1e1, 1e5, zero=0.2), draw.over(0.5, 20.0)
        L, K = draw.over(0.05, 1.0), k + k_2
        L_2, d = L * draw.over(0.8, 1.2), draw.over(1e-2, 1.0, zero=0.2) * math.sqrt(K * m)
        F, loss = draw.over(1e-2, 0.3, zero=0.3) * m * g, draw.choice([0.0, 0.05])
        robot = {"m": m, "k": k, "d": d, "L": L, "k_2": k_2, "L_2": L_2, "F": F, "g": g, "loss": loss}
        sags, rate = m * g / K, math.sqrt(K / m)
        start = {
            "h": (k * L + k_2 * L_2) / K - sags * draw.over(1e-3, 1.0, zero=0.5),
            "h_dot": -sags * rate * draw.over(0.3, 30.0),
        }
        yield Case(model_file("pogo"), robot, start, 0.0, draw.uniform(2.0, 12.0) / rate)


@pytest.mark.sliced
def test_a_stance_is_that_of_the_integrator_and_takes_off_where_springs_and_damper_carry_nothing(store):
    solver = solver_of(store, "pogo")
    seen = [that_of_the_integrator(solver, each)[0].status for each in cases(1, 50)]
    assert seen.count("takeoff") >= 20 and {*seen} == {"takeoff", "rest", "horizon"}


@pytest.mark.sliced
def test_the_leg_relaxes_in_flight_and_is_handed_on_at_touchdown(store):
    """Against the body's parabola and the leg's decay, to rounding; the next stance begins there."""
    solver, flights = solver_of(store, "pogo"), 0
    for each in cases(2, 150):
        robot = solver.Robot(**each.robot)
        stance = solver.solve_motion(robot, start=each.start, horizon=each.horizon)
        of = each.robot
        if stance.status != "takeoff" or not stance.end.v2 > 0.0:
            continue
        flights += 1
        K = of["k"] + of["k_2"]
        length = (of["k"] * of["L"] + of["k_2"] * of["L_2"]) / K  # of the leg that carries nothing
        left = length - stance.end.h
        scale = length + abs(left)
        assert K * left == pytest.approx(of["d"] * stance.end.h_dot, rel=1e-9, abs=1e-9 * K * scale)
        flight = stance.fly()
        v, h, g, rate = stance.end.h_dot, stance.end.h, of["g"], K / of["d"] if of["d"] else math.inf

        def foot(t: float, v: float = v, h: float = h, g: float = g, left: float = left, rate: float = rate) -> float:
            relaxed = left * math.exp(-rate * t) if t > 0.0 else left
            return h + v * t - g * t * t / 2.0 - length_of(relaxed)

        def length_of(relaxed: float, length: float = length) -> float:
            return length - relaxed

        top = v / g
        touches = brentq(foot, top, 2.0 * top + 10.0 * math.sqrt(scale / g), xtol=1e-15, rtol=1e-14)
        assert flight.status == "touchdown" and flight.duration == pytest.approx(touches, rel=1e-9)
        for t in np.linspace(0.0, 1.0, 7) * flight.duration:
            assert float(flight.at(t).h) == pytest.approx(h + v * t - g * t * t / 2.0, abs=1e-9 * scale)
            assert float(flight.foot(t)) == pytest.approx(foot(t), abs=1e-9 * scale)
        assert flight.end_compression == pytest.approx(left * math.exp(-rate * touches), abs=1e-9 * scale)
        falls = v - g * touches
        assert flight.touchdown.h_dot == pytest.approx(falls * math.sqrt(1.0 - of["loss"]), rel=1e-9)
    assert flights >= 30
