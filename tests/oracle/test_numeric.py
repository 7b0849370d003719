"""The numerical integrator against closed forms, so that what it judges is judged rightly."""

import math

import numpy as np
import pytest

from tests.oracle.numeric import Mass, Mechanism, integrate


def test_a_spin_down_comes_to_rest_when_and_where_the_formula_says():
    inertia, damping, friction, speed = 0.031, 0.0085, 0.042, 11.5
    rotor = Mechanism((Mass("q", inertia, (friction, friction)),), lambda q, v, u: -damping * v)
    motion = integrate(rotor, [0.0], [speed], [(0.0, 0.0)], 10.0, 0.05)
    time = inertia / damping * math.log1p(damping * speed / friction)
    assert motion.status == "rest" and motion.kinds == ["q_sticks"]
    assert motion.duration == pytest.approx(time, rel=1e-12)
    angle = inertia * speed / damping - friction * inertia / damping**2 * math.log1p(damping * speed / friction)
    assert motion.final[0][0] == pytest.approx(angle, rel=1e-12)


def test_friction_that_is_higher_at_rest_makes_a_driven_block_jump():
    """A driver of constant speed; periods, slips and lengths by the closed form of a slip on a stretched spring."""
    mass, stiffness, speed, rest, slide = 8.0, 3200.0, 0.012, 27.468, 19.62
    block = Mass("block", mass, (slide, slide), (rest, rest))
    driver = Mass("driver", 1e18)

    def force(q, v, u):
        spring = stiffness * (q[1] - q[0])
        return np.array([spring, -spring])

    motion = integrate(Mechanism((block, driver), force), [0.0, 0.0], [0.0, speed], [(0.0, 0.0)], 2.2, 2e-3)
    first = rest / stiffness / speed
    w, excess = math.sqrt(stiffness / mass), (rest - slide) / stiffness
    phase = 2.0 * math.pi - 2.0 * math.atan(w * excess / speed)
    slip = phase / w
    stick = 2.0 * excess / speed
    times = [event.t for event in motion.events]
    assert motion.kinds[:4] == ["block_slips", "block_sticks"] * 2
    assert times[0] == pytest.approx(first, abs=1e-9)
    assert times[1] - times[0] == pytest.approx(slip, abs=1e-9) and slip == pytest.approx(0.181073180501213, abs=1e-14)
    assert times[2] - times[1] == pytest.approx(stick, abs=1e-9) and stick == pytest.approx(0.40875)
    assert motion.at(times[1])[0] == pytest.approx(7.07787816601456676e-3, abs=1e-10)


def test_a_mass_at_its_level_is_decided_by_the_next_derivative():
    """A mass without friction on a spring that begins to be stretched by the other: it slips at once."""
    leg = Mechanism(
        (Mass("foot", 2.0), Mass("body", 3.0)),
        lambda q, v, u: np.array([100.0 * (q[1] - q[0]), -100.0 * (q[1] - q[0])]),
    )
    motion = integrate(leg, [0.0, 0.0], [0.0, -1.0], [(0.0, 0.0)], 0.1, 1e-3)
    w = math.sqrt(100.0 * (1 / 2 + 1 / 3))
    gap = -math.sin(w * 0.1) / w
    assert motion.kinds == [] and motion.final[0][1] - motion.final[0][0] == pytest.approx(gap, abs=1e-12)


def test_a_stop_takes_the_velocity_and_friction_at_rest_keeps_the_mass_there():
    cart = Mass("cart", 1.0, (1.0, 0.5), (3.0, 2.0), -0.1, 0.1)
    motion = integrate(
        Mechanism((cart,), lambda q, v, u: np.array([u + 0.0 * q[0]])),
        [0.0],
        [0.0],
        [(0.0, 4.0), (1.0, -1.9), (1.5, -2.1)],
        3.0,
        1e-2,
    )
    begin, there = math.sqrt(2 * 0.1 / 3.0), math.sqrt(2 * 0.2 / 1.6)
    assert motion.kinds == ["cart_hits_stop", "cart_slips", "cart_hits_stop"]
    assert [event.t for event in motion.events] == pytest.approx([begin, 1.5, 1.5 + there], abs=1e-12)
    assert motion.final[0][0] == -0.1 and motion.status == "rest"


def test_the_contact_force_ends_a_motion_where_it_falls_through_zero():
    leg = Mechanism(
        (Mass("body", 2.0),), lambda q, v, u: -50.0 * q - 4.0 * v, lambda q, v: float(-50.0 * q[0] - 4.0 * v[0])
    )
    motion = integrate(leg, [0.0], [-1.0], [(0.0, 0.0)], 2.0, 1e-3)
    assert motion.status == "takeoff"
    q, v = motion.final
    assert -50.0 * q[0] - 4.0 * v[0] == pytest.approx(0.0, abs=1e-11) and q[0] < 0.0
