"""More friction at rest than in motion: closed forms of stick-slip, and the 50-digit reference."""

from typing import Any

import mpmath as mp
import pytest

import hopform

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
def test_a_block_that_is_pushed_slips_and_sticks_as_the_closed_form_says(backend, sign):
    """Up through the body, down through the actuator: three slips, each the same."""
    robot, start = block(sign)
    stance = hopform.solve_stance(robot, **start, horizon=2.2, backend=backend)
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
