"""Flights: the equations, the reference, what must hold of every flight."""

import doctest
import math
import re
from pathlib import Path

import numpy as np
import pytest
import sympy as sp

import hopform
from derive.ir import unfold
from derive.maths import flight as derivation
from derive.model import quantities as Q
from derive.shipped import HOPPER
from tests import needs
from tests.conformance.flights import assert_same_flight, random_flight, solved
from tests.oracle.reference.flight import solve_flight as reference_flight

F = derivation
CASES = {
    "returns": {"x1": 0.05, "v1": 0.3, "v2": 1.9},
    "hits the upper stop": {"x1": 0.07, "v1": 0.9, "v2": 1.9},
    "hits the lower stop": {"x1": 0.01, "v1": -1.2, "v2": 1.9},
    "starts into a stop": {"x1": 0.08, "v1": 0.5, "v2": 1.5},
    "step up": {"x1": 0.07, "v1": -0.9, "v2": 1.0, "y": 0.03},
    "trips": {"x1": 0.07, "v1": -0.9, "v2": 1.0, "y": 0.13},
    "step down": {"x1": 0.03, "v1": 0.1, "v2": 0.5, "y": -0.1},
    "at rest": {"x1": 0.0, "v1": 0.0, "v2": 2.0},
    "drop": {"x1": 0.0, "v1": 0.0, "v2": 0.0, "y": -0.2},
    "soft law": {"x1": 0.06, "v1": 0.0, "v2": 1.9, "gains": (1500.0, 20.0)},
    "stiff law": {"x1": 0.06, "v1": 0.0, "v2": 1.9, "gains": (1e6, 1e3)},
    "no law": {"x1": 0.06, "v1": -0.4, "v2": 1.9, "gains": (0.0, 0.0)},
    "damping alone": {"x1": 0.06, "v1": -0.4, "v2": 1.9, "gains": (0.0, 300.0)},
}


def inputs_of(robot: hopform.Robot, case: dict) -> dict:
    gains = tuple(hopform.design_return(robot, 0.3))
    return {"y": 0.0, "gains": gains, "horizon": 3.0, "max_phases": 200} | case


# ---- the derivation ----

RULES = {Q.W: Q.Wd, Q.Wd: Q.Wdd, Q.Wdd: -Q.p * Q.Wdd - Q.q * Q.Wd}
"""Derivatives by time of W, by W''' + p W'' + q W' = 0."""


def numerator(function):
    values = {step.symbol: unfold(step.value, function()) for step in function()}
    return values[Q.H3] * Q.Wd + values[Q.H2] * Q.W


def over_time(expression):
    return sum((expression.diff(symbol) * rate for symbol, rate in RULES.items()), sp.S.Zero)


def at_start(expression):
    return expression.subs({Q.W: 0, Q.Wd: 0, Q.Wdd: 1})


def integrated(expression):
    """Without W'', by W'' + p W' + q W = 1, the integral of W's own equation."""
    return sp.expand(expression.subs(Q.Wdd, 1 - Q.p * Q.Wd - Q.q * Q.W))


MOVED = numerator(F.displacement_numerator)


def test_the_motion_begins_at_the_state_with_which_the_phase_begins():
    assert at_start(MOVED) == 0
    assert at_start(over_time(MOVED)) == Q.v1
    assert sp.expand(at_start(over_time(over_time(MOVED)))) == F.acc1


def test_the_pull_is_that_of_the_law():
    law = F.Kp * MOVED + F.Kd * (over_time(MOVED) - Q.v1)
    assert sp.expand(integrated(numerator(F.pull_numerator) - law)) == 0


@pytest.mark.parametrize("limited", [False, True])
def test_the_motion_obeys_the_equation_of_motion(limited):
    rates = {step.symbol: step.value for step in F.flight_rates_of(HOPPER)}
    begins = (F.acceleration_at_limit(HOPPER) if limited else F.acceleration_under_law(HOPPER))[0].value
    p, q = (F.p_free, 0) if limited else (F.p_law, F.q_law)
    right = F.at_limit(HOPPER) if limited else F.under_law(HOPPER)
    there = right.subs({Q.x1: Q.x1 + MOVED, Q.v1: over_time(MOVED)}, simultaneous=True)
    residual = integrated(over_time(over_time(MOVED)) - there).subs({Q.p: p, Q.q: q})
    assert sp.simplify(residual.subs(F.acc1, begins).subs(rates)) == 0


def test_the_ledger_adds_up_to_the_power_of_the_equation_of_motion():
    """d/dt (m_eff v_1^2/2) = m_eff v_1 a: each entry's rate, with that of the integral of v_1^2 and of the way."""
    entries = [step.value for step in F.flight_ledger_of(HOPPER)]
    total = sum(entries)
    power = total.diff(F.moved) * Q.v1 + total.diff(Q.int_v1v1) * Q.v1**2
    for limit, right in ((0, F.under_law(HOPPER)), (1, F.at_limit(HOPPER)), (-1, F.at_limit(HOPPER))):
        here = right.subs(Q.x1, Q.x1 + F.moved)
        assert sp.simplify((power - Q.m_eff * Q.v1 * here).subs(F.limit, limit)) == 0


def test_the_designed_law_has_a_double_pole_at_the_settling_rate():
    robot = hopform.load_robot("hopper_c")
    gains = hopform.design_return(robot, 0.25)
    rate = 20.0 / (3.0 * 0.25)
    assert gains.Kp / robot.m_eff == pytest.approx(rate**2, rel=1e-14)
    assert (gains.Kd + robot.b1) / robot.m_eff == pytest.approx(2.0 * rate, rel=1e-14)


@pytest.mark.parametrize("b1", [0.0, 150.0, 5000.0])
def test_a_designed_return_from_rest_is_within_a_hundredth_in_time(b1):
    robot = hopform.Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, b1=b1, gamma2=-65.0)
    flight = hopform.solve_flight(robot, x1=0.05, v2=3.0, gains=hopform.design_return(robot, 0.25))
    times = np.linspace(0.25, flight.duration, 50)
    assert np.all(np.abs(flight.at(times).x1) <= 0.05 / 100)
    assert abs(flight.at(0.15).x1) > 0.05 / 100, "it is gentle"


def test_a_robot_with_more_friction_than_critical_gets_no_damping():
    robot = hopform.Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, b1=5000.0, gamma2=-65.0)
    gains = hopform.design_return(robot, 0.25)
    rate = 20.0 / (3.0 * 0.25)
    assert gains.Kd == 0.0
    assert gains.Kp == pytest.approx(rate * (robot.b1 - robot.m_eff * rate), rel=1e-14)


# ---- the reference ----


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())
def test_a_flight_is_that_of_the_reference(hopper_c, case, dtype):
    assert_same_flight(hopper_c, inputs_of(hopper_c, case), dtype)


@pytest.mark.parametrize("seed", needs.the_first(range(60), 24))
def test_a_random_flight_is_that_of_the_reference(seed):
    robot, inputs = random_flight(seed)
    assert_same_flight(robot, inputs)


@pytest.mark.parametrize("seed", range(15))
def test_a_random_flight_in_single_precision_is_that_of_the_reference(seed):
    robot, inputs = random_flight(seed)
    assert_same_flight(robot, inputs, np.float32)


@pytest.mark.parametrize("seed", [5023507, 5095323, 5069149, 5074759])
def test_an_actuator_that_damping_slows_never_turns_back(seed):
    """Whatever rounding leaves of its velocity when it has faded."""
    robot, inputs = random_flight(seed)
    assert_same_flight(robot, inputs)


@pytest.mark.parametrize("seed", [5007716, 5054868, 5028441, 5006021, 5020042])
def test_an_undamped_actuator_that_swings_back_to_its_stop_meets_it_at_rest(seed):
    """Events without a loss lie between; what rounding left of them would be a reversal, or a stop met 1e-8 s early."""
    robot, inputs = random_flight(seed)
    assert_same_flight(robot, inputs)


def test_the_random_flights_visit_every_ending_and_event():
    flights = [solved(*random_flight(seed))[0] for seed in range(400)]
    seen = {event.kind for flight in flights for event in flight.events} | {flight.status for flight in flights}
    events = {"x1_reverses", "x1_sticks", "x1_hits_stop", "u_saturates", "u_desaturates"}
    assert seen >= events | {"touchdown", "tripped", "horizon", "too_many_phases"}


# ---- what must hold of every flight ----


def flights(count=40):
    for seed in range(2000, 2000 + count):
        robot, inputs = random_flight(seed)
        yield robot, inputs, solved(robot, inputs)[0]


def test_the_ledger_balances_at_every_time():
    for robot, inputs, flight in flights():
        t = np.linspace(0.0, flight.duration, 9)
        energy, ledger = flight.energy(t), flight.ledger(t)
        weight = robot.m_s * (9.81 * np.abs(flight.at(t).x2) + flight.at(t).v2 ** 2)
        size = sum(np.abs(entry) for entry in ledger) + abs(energy.total[0]) + weight
        start = robot.m_eff * inputs["v1"] ** 2 / 2.0 + energy.body[0]
        assert np.all(np.abs(sum(ledger) - (energy.total - start)) <= 4e-14 * size)
        assert np.max(np.abs(energy.body - energy.body[0])) <= 1e-14 * np.max(size), "the body is ballistic"


def test_a_passive_actuator_only_loses():
    for robot, inputs, _ in flights():
        flight = solved(robot, inputs | {"gains": (0.0, 0.0)})[0]
        t = np.linspace(0.0, flight.duration, 50)
        kept = flight.energy(t).total - robot.k * robot.c * flight.at(t).x1
        assert np.all(np.diff(kept) <= 1e-13 * (np.abs(kept[0]) + robot.m_eff))


def test_a_flight_cut_in_two_is_the_same_flight():
    cut = 0
    for robot, inputs, flight in flights():
        t = 0.37 * flight.duration
        foot = flight.foot(t)
        if flight.status != "touchdown" or not foot > 1e-9:
            continue
        here = flight.at(t)
        rest = solved(robot, inputs | {"x1": here.x1, "v1": here.v1, "v2": here.v2, "y": -foot})[0]
        later = [(event.time - t, event.kind) for event in flight.events if event.time > t]
        if len(later) != len(rest.events):
            continue  # a velocity that is 0 to rounding where it is cut
        cut += 1
        assert rest.status == flight.status
        assert [kind for _, kind in later] == [event.kind for event in rest.events]
        assert rest.duration == pytest.approx(flight.duration - t, abs=1e-10)
        assert rest.end == pytest.approx(flight.end, abs=1e-9)
    assert cut >= 20


def test_a_flight_does_not_depend_on_the_units():
    kilograms, metres, seconds = 3.0, 7.0, 0.2
    newtons = kilograms * metres / seconds**2
    for robot, inputs, flight in flights():
        other = hopform.Robot(
            m_eff=robot.m_eff * kilograms, m_s=robot.m_s * kilograms, k=robot.k * newtons / metres,
            L0=robot.L0 * metres, c=robot.c * metres, b1=robot.b1 * newtons / metres * seconds,
            f1=robot.f1 * metres / seconds**2, f1_excess=robot.f1_excess * metres / seconds**2,
            gamma2=robot.gamma2 * newtons, g=robot.g * metres / seconds**2,
            x1_min=robot.x1_min * metres, x1_max=robot.x1_max * metres, u_max=robot.u_max,
            impact_loss=robot.impact_loss,
        )  # fmt: skip
        Kp, Kd = inputs["gains"]
        scaled = inputs | {
            "x1": inputs["x1"] * metres,
            "v1": inputs["v1"] * metres / seconds,
            "v2": inputs["v2"] * metres / seconds,
            "y": inputs["y"] * metres,
            "gains": (Kp * newtons / metres, Kd * newtons / metres * seconds),
            "horizon": inputs["horizon"] * seconds,
        }
        there = solved(other, scaled)[0]
        assert there.status == flight.status
        assert [event.kind for event in there.events] == [event.kind for event in flight.events]
        assert there.duration / seconds == pytest.approx(flight.duration, rel=1e-9)
        assert there.end.x1 / metres == pytest.approx(flight.end.x1, abs=1e-9)


def test_the_current_stays_within_its_limit_and_follows_the_law(hopper_c):
    flight = hopform.solve_flight(hopper_c, x1=0.06, v1=0.4, v2=1.9)
    t = np.linspace(0.0, flight.duration, 500)
    u, state = flight.current(t), flight.at(t)
    assert np.max(np.abs(u)) == hopper_c.u_max
    inside = np.abs(u) < hopper_c.u_max
    law = (flight.gains.Kp * state.x1 + flight.gains.Kd * state.v1) / hopper_c.gamma2
    np.testing.assert_allclose(u[inside], law[inside], rtol=1e-14)
    limited = [phase for phase in flight.phases if phase.limit]
    assert limited and all(np.all(~inside[(t > phase.start) & (t < phase.end)]) for phase in limited)


def test_a_locked_actuator_flies_as_a_stone():
    ideal = hopform.load_robot("ideal")
    flight = hopform.solve_flight(ideal, v2=2.0)
    assert flight.status == "touchdown"
    assert flight.duration == pytest.approx(4.0 / 9.81, rel=1e-15)
    assert flight.touchdown == flight.end
    assert flight.end.v2 == pytest.approx(-2.0, rel=1e-15)
    assert flight.apex == pytest.approx(4.0 / (2.0 * 9.81), rel=1e-15)


def test_the_impact_takes_its_part_of_the_bodys_energy(hopper_c):
    flight = hopform.solve_flight(hopper_c, x1=0.02, v2=1.9)
    assert flight.touchdown is not None
    assert flight.touchdown.v2 == pytest.approx(flight.end.v2 * math.sqrt(0.95), rel=1e-15)
    assert flight.touchdown[:3] == flight.end[:3]
    assert flight.impact_loss == pytest.approx(-0.05 * 3.0 * flight.end.v2**2 / 2.0, rel=1e-14)
    assert flight.touchdown.x2 == pytest.approx(flight.touchdown.x1 + 0.4, abs=1e-16)


def test_a_stance_follows_on_a_flight(hopper_c):
    stance = hopform.solve_stance(hopper_c, v2=-1.93, u=3.0)
    assert stance.takeoff is not None
    flight = hopform.solve_flight(hopper_c, **stance.takeoff._asdict())
    assert flight.status == "touchdown"
    assert flight.foot(0.0) == 0.0, "x2 = x1 + L0 + c is a foot on the ground, rounding or not"
    assert flight.apex == pytest.approx(stance.apex, abs=1e-15)
    after = flight.touchdown
    assert after is not None
    again = hopform.solve_stance(hopper_c, x1=after.x1, v1=after.v1, v2=after.v2, u=3.0)
    assert again.status == "takeoff"


# ---- the ground ahead ----


def test_the_foot_clears_a_step_up_to_where_it_comes_highest(hopper_c):
    """A step a hair below the highest point of the foot is cleared, one a hair above it trips:
    no crossing is stepped over.
    """
    gains = hopform.design_return(hopper_c, 0.3)
    start = {"x1": 0.05, "v1": 0.3, "v2": 1.2}
    wall = hopform.solve_flight(hopper_c, **start, x2=0.45 - 1.0, gains=gains)
    assert wall.status == "tripped"
    highest = 1.0 + wall.foot(wall.duration)
    for step, status in ((highest - 1e-11, "touchdown"), (highest + 1e-11, "tripped")):
        flight = hopform.solve_flight(hopper_c, **start, x2=0.45 - step, gains=gains)
        assert flight.status == status
        assert flight.duration == pytest.approx(wall.duration, abs=3e-6)


def test_a_foot_that_dips_touches_down_where_the_ground_is_met_first():
    """An actuator that oscillates lowers the foot between two rises:
    the ground is met at the minimum as soon as that is low enough.
    """
    robot = hopform.Robot(m_eff=1.0, m_s=3.0, k=1200.0, L0=0.4, gamma2=-1.0)
    gains = (400.0, 0.0)
    start = {"x1": 0.0, "v1": -2.0, "v2": 2.0}

    def foot(t):
        return 2.0 * t - 9.81 * t**2 / 2.0 + 2.0 * np.sin(20.0 * t) / 20.0

    t = np.linspace(0.0, 0.4, 400_001)
    rate = np.diff(foot(t))
    minima = t[1:-1][(rate[:-1] < 0.0) & (rate[1:] >= 0.0)]
    lowest = foot(minima[0])
    assert lowest < foot(t[t > minima[0]]).max()
    for hair, early in ((1e-9, False), (-1e-9, True)):
        ground = lowest - hair
        flight = hopform.solve_flight(robot, **start, x2=0.4 - ground, gains=gains)
        assert flight.status == "touchdown"
        assert (flight.duration < minima[0] + 1e-3) == early
        assert foot(flight.duration) == pytest.approx(ground, abs=1e-14)


def test_a_foot_that_only_touches_flies_on():
    """At rest on the ground the first time, thrown up by nothing: a flight that begins with v2 = 0 trips at once."""
    flight = hopform.solve_flight(hopform.load_robot("ideal"), v2=0.0)
    assert (flight.status, flight.duration) == ("tripped", 0.0)


def test_a_flight_that_is_cut_short_is_as_far_as_it_goes(hopper_c):
    start = {"x1": 0.05, "v1": 0.3, "v2": 1.9}
    whole = hopform.solve_flight(hopper_c, **start)
    short = hopform.solve_flight(hopper_c, **start, horizon=0.05, gains=whole.gains)
    assert (short.status, short.duration) == ("horizon", 0.05)
    assert short.end == pytest.approx(whole.at(0.05), abs=1e-15)
    capped = hopform.solve_flight(hopper_c, **start, max_phases=1, gains=whole.gains)
    assert (capped.status, len(capped.phases), capped.touchdown) == ("too_many_phases", 1, None)


def test_many_reversals_are_all_found():
    """An undamped law of 10 000 rad/s: half period after half period, each a reversal,
    and more phases than the first buffer has.
    """
    robot = hopform.Robot(m_eff=1.0, m_s=3.0, k=1200.0, L0=0.4, gamma2=-1.0)
    rate = 1e4
    flight = hopform.solve_flight(robot, x1=1e-3, v2=0.3, gains=(rate**2, 0.0))
    assert flight.status == "touchdown"
    found = [event.time * rate / math.pi for event in flight.events]
    assert len(found) == math.floor(flight.duration * rate / math.pi) > 15
    np.testing.assert_allclose(found, np.arange(1, len(found) + 1), rtol=1e-12)


# ---- bad input ----


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"v2": math.nan}, "v2 must be finite m/s, got nan"),
        ({"v2": 1.0, "x1": 0.09}, "x1 must be within its stroke 0.0 .. 0.08 m, got 0.09"),
        ({"v2": 1.0, "x2": math.inf}, "x2 must be finite m, got inf"),
        ({"v2": 1.0, "gains": 3.0}, "gains must be a pair (Kp, Kd) in N/m and N s/m, got 3.0"),
        ({"v2": 1.0, "gains": (1.0,)}, "gains must be a pair (Kp, Kd) in N/m and N s/m, got (1.0,)"),
        ({"v2": 1.0, "gains": (-1.0, 0.0)}, "Kp must be >= 0 N/m, got -1.0"),
        ({"v2": 1.0, "gains": (1.0, math.nan)}, "Kd must be finite N s/m, got nan"),
        ({"v2": 1.0, "horizon": 0.0}, "horizon must be > 0 s, got 0.0"),
        ({"v2": 1.0, "max_phases": True}, "max_phases must be a whole number >= 1, got True"),
    ],
)
def test_a_flight_refuses_what_it_cannot_solve(hopper_c, arguments, message):
    with pytest.raises(hopform.HopformError, match=f"^{re.escape(message)}$"):
        hopform.solve_flight(hopper_c, **arguments)


def test_a_flight_needs_gravity():
    robot = hopform.Robot(m_eff=25.0, m_s=3.0, k=1200.0, L0=0.4, g=0.0)
    with pytest.raises(hopform.HopformError, match=r"^a flight needs g > 0 m/s\^2, got 0\.0$"):
        hopform.solve_flight(robot, v2=1.0)


def test_a_time_outside_the_flight_is_refused(hopper_c):
    flight = hopform.solve_flight(hopper_c, v2=1.0)
    for read in (flight.at, flight.foot, flight.current, flight.energy, flight.ledger):
        with pytest.raises(hopform.HopformError, match="t must be 0 <= t <= "):
            read(flight.duration * 1.01)


@pytest.mark.parametrize("time", [0.0, -1.0, math.nan])
def test_a_return_takes_time(hopper_c, time):
    with pytest.raises(hopform.HopformError, match="time must be"):
        hopform.design_return(hopper_c, time)


def test_the_reference_agrees_with_a_parabola_and_an_oscillation():
    """What judges is judged: an undamped law without friction, by its cosine."""
    robot = {"m_eff": 1, "m_s": 3, "k": 1200, "gamma2": -1, "g": "9.81"}
    exact = reference_flight(robot, v2=1, x1="0.01", gains=(400, 0))
    t = float(exact.duration)
    assert [event.kind for event in exact.events] == ["x1_reverses"]
    assert float(exact.events[0].time) == pytest.approx(math.pi / 20.0, rel=1e-15)
    assert float(exact.end[0]) == pytest.approx(0.01 * math.cos(20.0 * t), rel=1e-12)
    assert t - 9.81 * t**2 / 2.0 - 0.01 * (math.cos(20.0 * t) - 1.0) == pytest.approx(0.0, abs=1e-15)


def test_the_page_on_flights_is_true():
    outcome = doctest.testfile(
        str(Path(__file__).parents[2] / "docs" / "how-to" / "solve-a-flight.md"), module_relative=False
    )
    assert outcome.attempted >= 8
    assert outcome.failed == 0
