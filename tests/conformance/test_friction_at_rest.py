"""More friction at rest than in motion: closed forms of stick-slip, an integrator, scans of the controller."""

import dataclasses
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import hopform
from hopform._solver.choice import DEFAULT
from hopform_solver.records import LegState
from tests.conformance.currents import Touchdown, compare, draw_robot
from tests.derived import SHIPPED, solver_of
from tests.oracle.numeric import Mass, Mechanism, integrate

MASS, STIFFNESS, SPEED, AT_REST, SLIDING = 8.0, 3200.0, 0.012, 27.468, 19.62
"""A block [kg] that a driver pushes [m/s] through a spring [N/m], and its friction [N]: 0.35 and 0.25 of its weight."""


def block(sign: int = 1) -> tuple[hopform.Robot, dict[str, Any]]:
    """The block is the body, the driver an actuator so heavy that nothing slows it; without gravity."""
    level, excess = SLIDING / MASS, (AT_REST - SLIDING) / MASS
    if sign > 0:
        robot = hopform.Robot(m_eff=1e18, m_s=MASS, k=STIFFNESS, L0=0.0, f2=level, f2_excess=excess, g=0.0)
        return robot, {"v1": SPEED, "v2": 0.0}
    robot = hopform.Robot(m_eff=MASS, m_s=1e18, k=STIFFNESS, L0=0.0, f1=level, f1_excess=excess, g=0.0)
    return robot, {"v1": 0.0, "v2": -SPEED}


def stick_slip() -> dict[str, Any]:
    """First slip, time and length of a slip, time at rest. In a slip the force on the block less its friction is that
    of an oscillator: it starts at AT_REST - SLIDING, and ends as much below 0.
    """
    with mp.workdps(40):
        mass, k, speed, at_rest, sliding = map(mp.mpf, (MASS, STIFFNESS, SPEED, AT_REST, SLIDING))
        rate, offset = mp.sqrt(k / mass), (at_rest - sliding) / k
        slip = 2 * (mp.pi - mp.atan(offset * rate / speed)) / rate
        found = {"first": at_rest / k / speed, "slip": slip, "length": speed * slip + 2 * offset}
        return found | {"rest": 2 * offset / speed}


def test_the_closed_form_has_the_published_numbers():
    numbers = {"first": 0.7153125, "slip": 0.181073180501213, "length": 7.07787816601456676e-3, "rest": 0.40875}
    assert {name: float(value) for name, value in stick_slip().items()} == pytest.approx(numbers, rel=1e-14)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_block_that_is_pushed_slips_and_sticks_as_the_closed_form_says(sign):
    """Up through the body, down through the actuator: three slips, each the same."""
    robot, start = block(sign)
    stance = hopform.solve_stance(robot, **start, horizon=2.2)
    mass, height = (2, "x2") if sign > 0 else (1, "x1")
    assert [event.kind for event in stance.events] == [f"x{mass}_{what}" for what in ("slips", "sticks") * 3]
    wanted, t = stick_slip(), [event.time for event in stance.events]
    assert t[0] == pytest.approx(float(wanted["first"]), abs=1e-13)
    for slips, sticks, again in zip(t[::2], t[1::2], [*t[2::2], None], strict=True):
        assert sticks - slips == pytest.approx(float(wanted["slip"]), abs=1e-13)
        moved = getattr(stance.at(sticks), height) - getattr(stance.at(slips), height)
        assert moved == pytest.approx(sign * float(wanted["length"]), abs=1e-14)
        if again is not None:
            assert again - sticks == pytest.approx(float(wanted["rest"]), abs=1e-13)
            assert again - slips == pytest.approx(0.589823180501213, abs=1e-13)


# ---- derivatives ----


def position_in_second_slip(t: Any, speed: Any, level: Any, excess: Any, k: Any, mass: Any) -> Any:
    """Of the block at a time in its second slip, by the closed form: u in a slip from 0 is speed s - (d(s) - d(0)),
    d'' = -(k/mass) d, d(0) = mass excess/k, d'(0) = speed.
    """
    rate, offset = mp.sqrt(k / mass), mass * excess / k
    slip = 2 * (mp.pi - mp.atan(offset * rate / speed)) / rate
    begins = mass * (level + excess) / k / speed + slip + 2 * offset / speed
    s = t - begins
    moved = speed * s - (offset * (mp.cos(rate * s) - 1) + speed / rate * mp.sin(rate * s))
    return speed * slip + 2 * offset + moved


def test_derivatives_pass_a_slip_as_the_closed_form_does():
    """At a horizon in the second slip; without the saltation at a slip that by f2_excess has the other sign."""
    robot, start = block()
    horizon = 1.4
    stance = hopform.solve_stance(robot, **start, horizon=horizon)
    assert [event.kind for event in stance.events] == ["x2_slips", "x2_sticks", "x2_slips"]
    names = ("v1", "f2", "f2_excess", "k", "m_s")
    with mp.workdps(40):
        at = [mp.mpf(SPEED), *(mp.mpf(getattr(robot, name)) for name in names[1:])]
        value = position_in_second_slip(mp.mpf(horizon), *at)
        assert stance.end.x2 == pytest.approx(float(value), abs=1e-15)
        for n, name in enumerate(names):
            slope = mp.diff(lambda q, n=n: position_in_second_slip(mp.mpf(horizon), *at[:n], q, *at[n + 1 :]), at[n])
            assert stance.sensitivities["x2", name] == pytest.approx(float(slope), rel=1e-10), name


@pytest.mark.parametrize(
    "start", [LegState(0.0, 0.0, -1.93, 0.0), LegState(0.02, 0.1, -0.63, 0.0)], ids=["drop", "low"]
)
def test_slopes_of_a_tried_current_pass_a_slip(start):
    """Against differences, where the order of events stays; the actuator sticks and slips, of a few the body."""
    fields = {"f1": 1.0, "f1_excess": 0.4, "f2_excess": 0.3, "b1": 10.0, "x1_min": -0.05}
    robot = dataclasses.replace(hopform.load_robot("hopper_c"), **fields)
    u, h = np.linspace(-0.97, 0.93, 40) * robot.u_max, 1e-6 * robot.u_max
    around = np.concatenate([u - h, u, u + h])
    below, at, above = np.split(DEFAULT.compiled().try_currents(robot.parameters, [start], around, 2.0, 4096)[0], 3)
    alike = (below["events"] == at["events"]) & (at["events"] == above["events"]) & at["smooth"]
    x2 = start.x1 - start.y + robot.L0 + robot.c
    stances = [hopform.solve_stance(robot, x1=start.x1, v1=start.v1, v2=start.v2, x2=x2, u=each) for each in u]
    slips = np.array(["x1_slips" in [event.kind for event in stance.events] for stance in stances])
    assert (alike & slips).sum() >= 3
    for name in ("apex", "largest_x1", "least_contact"):
        known = alike & np.isfinite(at[name]) & (np.abs(at[name]) < 1e3)
        slope = (above[name] - below[name]) / (2.0 * h)
        np.testing.assert_allclose(at[f"{name}_u"][known], slope[known], rtol=1e-4, atol=1e-6)


# ---- friction by sign ----

BY_SIGN = {"F_p": 0.2, "F_sp": 0.25, "F_m": 0.45, "F_sm": 0.1}
"""[N m] forward, more of it at rest; backward, more of it at rest."""


@pytest.mark.parametrize(("q", "v"), [(0.3, 0.0), (0.0, -1.5), (0.012, 0.0), (-0.012, 0.0)])
def test_friction_at_rest_differs_by_direction(store, q, v):
    """A joint that is pushed to and fro, against DOP853: it slips at 0.45 N m forward, at 0.55 N m backward."""
    joint = solver_of(store, SHIPPED / "joint.py")
    inertia, k, b = 0.5, 20.0, 0.3
    robot = joint.Robot(J=inertia, k=k, b=b, k_t=1.0, q_min=-0.4, q_max=0.4, **BY_SIGN)
    u = [(0.1 * n, 0.9 * np.sin(0.35 * n)) for n in range(30)]
    motion = joint.solve_motion(robot, start={"q": q, "q_dot": v}, u=u, horizon=3.0)
    at_rest = BY_SIGN["F_p"] + BY_SIGN["F_sp"], BY_SIGN["F_m"] + BY_SIGN["F_sm"]
    mass = Mass("q", inertia, (BY_SIGN["F_p"], BY_SIGN["F_m"]), at_rest, -0.4, 0.4)
    other = integrate(Mechanism((mass,), lambda q, v, u: u - k * q - b * v), [q], [v], u, 3.0, 0.02)
    kinds = [event.kind for event in motion.events]
    assert kinds == other.kinds and {"q_slips", "q_sticks"} <= set(kinds)
    np.testing.assert_allclose([event.time for event in motion.events], [event.t for event in other.events], atol=1e-9)
    assert motion.end.q == pytest.approx(float(other.final[0][0]), abs=1e-10)


# ---- the controller, where the apex jumps ----

JUMPS = {
    "a smaller root beside a jump": (202, Touchdown(-0.0030177082399421764, 0.11417109100018455, -0.7435486890625654,
                                                    0.0, 0.007043806244164972, 0.0, 0.0)),
    "a nearer apex at a jump": (295, Touchdown(-0.0, 0.0, -0.9803481027950335, 0.0, 0.041281840734438274, 0.0, 0.0)),
    "two jumps": (1137, Touchdown(-0.01749830349694752, 0.06312754666208685, -1.5097235695520779, 0.0,
                                  0.0830732192747102, 0.0, 0.0)),
}  # fmt: skip
"""Robots of a scan, and what was missed when an interval between two orders of events was bounded as if the apex only
bent in it.
"""


@pytest.mark.parametrize("name", JUMPS)
def test_no_current_of_a_scan_is_better_where_a_mass_just_slips_or_sticks(name):
    seed, touchdown = JUMPS[name]
    robot = draw_robot(seed, at_rest=True)
    found = compare(robot, [touchdown], robot.u_max / 2000.0)
    assert not (found.untrue or found.smaller or found.nearer)
