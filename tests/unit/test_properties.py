"""What must hold for every robot: splitting time, rescaling units, passivity, and that friction never helps."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import hopform

SOME = settings(max_examples=60, deadline=None, derandomize=True)


def over(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(math.log(low), math.log(high)).map(math.exp)


def or_zero(numbers: st.SearchStrategy[float]) -> st.SearchStrategy[float]:
    return st.one_of(st.just(0.0), numbers)


@st.composite
def robots(draw: st.DrawFn) -> hopform.Robot:
    m_s, k = draw(over(0.5, 20.0)), draw(over(50.0, 2e4))
    m_eff = m_s * draw(over(0.05, 50.0))
    return hopform.Robot(
        m_eff=m_eff,
        m_s=m_s,
        k=k,
        L0=0.4,
        b1=draw(or_zero(over(1e-3, 3.0))) * math.sqrt(k * m_eff),
        b2=draw(or_zero(over(1e-3, 3.0))) * math.sqrt(k * m_s),
        f1=draw(or_zero(over(0.01, 5.0))),
        f2=draw(or_zero(over(0.01, 5.0))),
        gamma2=-m_eff * draw(over(0.1, 10.0)),
        x1_min=-draw(over(0.005, 0.5)),
        x1_max=draw(over(0.005, 0.5)),
        u_max=3.0,
    )


velocities = over(0.1, 3.0).map(lambda speed: -speed)
currents = st.one_of(st.just(0.0), st.floats(-3.0, 3.0))


@SOME
@given(robots(), velocities, currents, st.floats(0.05, 0.95))
def test_a_stance_cut_in_two_is_the_same_stance(robot, v2, u, share):
    whole = hopform.solve_stance(robot, v2=v2, u=u, max_phases=30)
    assume(whole.status == "takeoff")
    cut = share * whole.duration
    assume(min(abs(cut - event.time) for event in (*whole.events, hopform.Event(0.0, ""))) > 1e-6 * whole.duration)
    middle = whole.at(cut)
    rest = hopform.solve_stance(robot, v2=middle.v2, x1=middle.x1, v1=middle.v1, x2=middle.x2, u=u)
    assert rest.status == "takeoff"
    assert [event.kind for event in rest.events] == [event.kind for event in whole.events if event.time > cut]
    assert cut + rest.duration == pytest.approx(whole.duration, rel=1e-9)
    assert rest.end == pytest.approx(whole.end, rel=1e-8, abs=1e-8)


@SOME
@given(robots(), velocities, currents)
def test_other_units_of_length_mass_and_time_give_the_same_stance(robot, v2, u):
    metre, kilogram, second, ampere = 8.0, 0.25, 2.0, 8.0  # powers of two: exact, and no unit of the model stays 1
    base = {"m": metre, "kg": kilogram, "s": second, "A": ampere, "N": kilogram * metre / second**2, "1": 1.0}

    def factor(unit: str) -> float:
        result = 1.0
        for sign, side in zip((1, -1, -1), unit.split("/"), strict=False):
            for symbol in side.split():
                name, _, power = symbol.partition("^")
                result *= base[name] ** (sign * int(power or 1))
        return result

    scaled = {field.name: getattr(robot, field.name) * factor(field.unit) for field in robot.fields()}
    here = hopform.solve_stance(robot, v2=v2, u=u, max_phases=30)
    there = hopform.solve_stance(
        hopform.Robot(**scaled), v2=v2 * factor("m/s"), u=u * ampere, horizon=2.0 * second, max_phases=30
    )
    assert [event.kind for event in there.events] == [event.kind for event in here.events]
    assert there.status == here.status
    assert there.duration == pytest.approx(here.duration * second, rel=1e-9)
    assert there.end.x1 == pytest.approx(here.end.x1 * metre, rel=1e-7, abs=1e-10)
    assert there.aed == pytest.approx(here.aed * factor("N m"), rel=1e-7, abs=1e-9)


@SOME
@given(robots(), velocities, st.floats(-0.02, 0.02))
def test_without_current_the_energy_less_the_offset_work_never_rises(robot, v2, c):
    robot = dataclasses.replace(robot, c=c)
    stance = hopform.solve_stance(robot, v2=v2, max_phases=100)
    times = np.linspace(0.0, stance.duration, 200)
    passive = np.asarray(stance.energy(times).total) - robot.k * c * np.asarray(stance.at(times).x1)
    assert np.all(np.diff(passive) <= 1e-12 * np.max(np.abs(passive)))


@SOME
@given(robots(), velocities, st.sampled_from(["b2", "f2"]), over(1.01, 3.0))
def test_with_the_actuator_locked_more_friction_never_raises_the_apex(robot, v2, which, more):
    locked = dataclasses.replace(robot, x1_min=0.0, x1_max=0.0)
    rougher = dataclasses.replace(locked, **{which: getattr(locked, which) * more + 0.01})
    smooth, rough = (hopform.solve_stance(one, v2=v2) for one in (locked, rougher))
    if rough.status == "takeoff":
        assert smooth.status == "takeoff"
        assert rough.apex <= smooth.apex + 1e-12


def test_the_ideal_hopper_keeps_its_energy():
    robot = hopform.load_robot("ideal")
    stance = hopform.solve_stance(robot, v2=-2.0)
    times = np.linspace(0.0, stance.duration, 50)
    np.testing.assert_allclose(stance.energy(times).total, stance.energy(0.0).total, rtol=1e-14)
