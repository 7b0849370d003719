"""The 50-digit reference solver stands on its own feet: printed figures, the equations of motion, the energy balance.

E(T) - E(0) = int k x1 v2 - int b2 v2^2 - m_s f2 int |v2|,      H(t) - H(0) = sum of the ledger
"""

from __future__ import annotations

import importlib.util
import math
import random

import pytest

from tests.oracle.reference import condition, scales, solve
from tests.oracle.reference.records import mp

HOPPER = {
    "m_eff": 25,
    "m_s": 3,
    "k": 1200,
    "L0": "0.40",
    "c": 0,
    "b1": 150,
    "b2": 5,
    "f1": "0.78",
    "f2": "0.60",
    "gamma2": -65,
    "g": "9.81",
    "x1_min": 0,
    "x1_max": "0.08",
    "u_max": 3,
    "impact_loss": "0.05",
}
DROP = -mp.sqrt(2 * mp.mpf("9.81") * mp.mpf("0.2") * mp.mpf("0.95"))
BARE = {"m_eff": 2, "m_s": 1, "k": 100, "g": 10, "L0": "0.5"}
LOCKED = {**BARE, "x1_min": 0, "x1_max": 0}
TINY = mp.mpf("1e-40")


def kinds(stance):
    return [event.kind for event in stance.events]


def five_digits(value, printed):
    return abs(value - mp.mpf(printed)) <= abs(mp.mpf(printed)) * mp.mpf("0.5e-4")


def random_robot(source):
    m_s, k = 10 ** source.uniform(-1, 1), 10 ** source.uniform(1, 5)
    m_eff = m_s * 10 ** source.uniform(-2, 2)
    loss = [source.choice([0, 2 * math.sqrt(k * m) * 10 ** source.uniform(-3, 1)]) for m in (m_eff, m_s)]
    return {
        "m_eff": m_eff,
        "m_s": m_s,
        "k": k,
        "L0": 0.4,
        "c": source.choice([0, 0.01]),
        "b1": loss[0],
        "b2": loss[1],
        "f1": source.choice([0, 0.7]),
        "f2": source.choice([0, 0.5]),
        "gamma2": -10.0,
        "g": 9.81,
        "x1_min": 0,
        "x1_max": source.choice([0.001, 0.08, math.inf]),
    }


RANDOM = [
    (random_robot(random.Random(seed)), {"v2": -0.5 - seed % 3, "u": [(0, seed % 4), (0.05, -1)]}) for seed in range(12)
]


@pytest.mark.parametrize(
    ("u", "duration", "apex", "x1", "aed"),
    [
        (0, "0.18529", "0.11816", None, None),
        (2, "0.18406", "0.13990", "0.892e-2", None),
        (3, "0.18813", "0.22329", "3.962e-2", "1.9216"),
    ],
)
def test_the_hopper_does_what_is_printed(u, duration, apex, x1, aed):
    stance = solve(HOPPER, v2=DROP, u=u)
    assert stance.status == "takeoff" and kinds(stance) == ["x2_reverses"]
    assert five_digits(stance.duration, duration) and five_digits(stance.apex, apex)
    assert x1 is None or abs(stance.takeoff.x1 - mp.mpf(x1)) <= mp.mpf("0.5e-5")
    assert aed is None or five_digits(stance.aed, aed)


@pytest.mark.parametrize(("robot", "arguments"), RANDOM)
def test_the_equations_of_motion_hold_inside_phases(robot, arguments):
    """By central differences over a step d that is 1e-20 of any time constant: their error is (rate d)^2/6."""
    stance = solve(robot, max_phases=6, **arguments)
    r, ends = stance.leg.robot, [*(phase.start for phase in stance.phases[1:]), stance.duration]
    for phase, end in zip(stance.phases, ends, strict=True):
        if end - phase.start < 1e-9 or phase.modes == (0, 0):
            continue
        t = (phase.start + end) / 2
        rates = [
            mp.sqrt(r.k / r.m_eff),
            mp.sqrt(r.k / r.m_s),
            *(b / m for b in (r.b1, r.b2) for m in (r.m_eff, r.m_s)),
        ]
        d = min(end - phase.start, 1 / max(rates)) / 10**20
        left, here, right = (stance.at(t + n * d) for n in (-1, 0, 1))
        slope = [(q - p) / (2 * d) for p, q in zip(left, right, strict=True)]
        a1 = (r.k * (here.x2 - here.x1 - r.L0) - r.b1 * here.v1 - r.gamma2 * phase.u) / r.m_eff
        a2 = (r.k * (here.x1 - here.x2 + r.L0 + r.c) - r.b2 * here.v2) / r.m_s - r.g
        wanted = [
            here.v1,
            (a1 - r.f1 * phase.modes[0]) * abs(phase.modes[0]),
            here.v2,
            (a2 - r.f2 * phase.modes[1]) * abs(phase.modes[1]),
        ]
        size = max(rates) * (1 + sum(map(abs, here)) + sum(map(abs, wanted)))
        assert all(abs(p - q) < mp.mpf("1e-38") * size for p, q in zip(slope, wanted, strict=True))


@pytest.mark.parametrize(("robot", "arguments"), RANDOM)
def test_the_ledger_balances(robot, arguments):
    stance = solve(robot, max_phases=40, **arguments)
    for t in (stance.duration / 3, stance.duration):
        ledger, (body, whole), (body_0, whole_0) = stance.ledger(t), stance.energy(t), stance.energy(0)
        total = sum(q for name, q in ledger.items() if name != "spring_work")
        assert abs(whole - whole_0 - total) < TINY * (1 + whole_0)
        assert abs(body - body_0 - ledger["spring_work"] - ledger["viscous_2"] - ledger["coulomb_2"]) < TINY


def test_analytical_energy_delta_is_the_work_on_the_body():
    stance = solve(HOPPER, v2=DROP, u=3)
    ledger = stance.ledger(stance.duration)
    assert abs(stance.aed - ledger["spring_work"] - ledger["viscous_2"] - ledger["coulomb_2"]) < TINY


def test_a_locked_leg_without_friction_keeps_its_energy_and_its_closed_form():
    stance = solve(LOCKED, v2=-1)
    omega, sag = mp.mpf(10), mp.mpf("0.1")
    assert abs(stance.duration - (mp.pi - mp.atan(1 / (omega * sag))) * 2 / omega) < TINY
    assert abs(stance.takeoff.v2 - 1) < TINY and kinds(stance) == ["x2_reverses"]
    assert all(abs(stance.energy(stance.duration * n / 7)[0] - stance.energy(0)[0]) < TINY for n in range(8))


@pytest.mark.parametrize("excess", ["1e-3", "1e-12", "1e-30"])
def test_two_crossings_within_one_window_are_both_seen(excess):
    """A locked leg without friction oscillates by 0.1 (1 + excess) m about its sag of 0.1 m: F is briefly below 0."""
    amplitude = (1 + mp.mpf(excess)) / 10
    stance = solve(LOCKED, v2=0, x2=mp.mpf("0.4") - amplitude)
    assert stance.status == "takeoff" and kinds(stance) == []
    assert abs(stance.duration - mp.acos(-1 / (1 + mp.mpf(excess))) / 10) < TINY
    assert 0 < stance.margin < 2 * mp.mpf(excess)
    assert kinds(solve(LOCKED, v2=0, x2=mp.mpf("0.4") - (1 - mp.mpf(excess)) / 10))[:2] == ["x2_reverses"] * 2


def test_a_force_that_touches_zero_is_no_takeoff():
    stance = solve(LOCKED, v2=0, x2="0.3")
    assert stance.status == "horizon" and kinds(stance) == ["x2_reverses"] * 6
    assert all(abs(event.time - n * mp.pi / 10) < TINY for n, event in enumerate(stance.events, 1))


def test_a_velocity_that_starts_tiny_returns_at_once():
    """v1 = 1e-25 against an acceleration of 1: back at zero after 1e-25 s."""
    stance = solve({**BARE, "gamma2": -2}, v2=-1, v1="1e-25", u=-1)
    assert kinds(stance)[0] == "x1_reverses"
    assert abs(stance.events[0].time / mp.mpf("1e-25") - 1) < mp.mpf("1e-20")


@pytest.mark.parametrize("depth", ["1e-6", "1e-12", "1e-25"])
def test_a_grazed_stop_is_hit_or_missed_by_any_depth(depth):
    """The actuator's turning point, then a stop that much below and above it."""
    free = {**BARE, "gamma2": -1, "b1": 1}
    top = solve(free, v2=-1, v1="0.2", u=2)
    turn = top.at(top.events[0].time).x1
    assert kinds(top)[0] == "x1_reverses"
    low = solve({**free, "x1_max": turn - mp.mpf(depth)}, v2=-1, v1="0.2", u=2)
    high = solve({**free, "x1_max": turn + mp.mpf(depth)}, v2=-1, v1="0.2", u=2)
    assert kinds(low)[0] == "x1_hits_stop" and kinds(high)[0] == "x1_reverses"
    assert low.margin < 10 * mp.mpf(depth)


def test_a_stop_takes_the_energy_and_lets_go_without_a_jump():
    stance = solve({**BARE, "x1_min": 0, "x1_max": "0.05", "gamma2": -1}, v2=-3, x1="0.01", u=[(0, 200), ("0.1", -200)])
    hit = kinds(stance).index("x1_hits_stop")
    before = stance.at(stance.events[hit].time - mp.mpf("1e-45"))
    after = stance.at(stance.events[hit].time)
    assert after.x1 == mp.mpf("0.05") and after.v1 == 0 and before.v1 > 1
    ledger = stance.ledger(stance.duration)
    assert ledger["stop_loss"] < 0 and "x1_slips" in kinds(stance)[hit:]
    whole = stance.energy(stance.duration)[1] - stance.energy(0)[1]
    assert abs(whole - sum(q for name, q in ledger.items() if name != "spring_work")) < TINY


def test_moving_into_a_stop_at_the_start_costs_energy_and_is_no_event():
    stance = solve({**BARE, "x1_min": 0}, v2=-3, v1=-1)
    assert stance.phases[0].state.v1 == 0 and abs(stance.ledger(0)["stop_loss"] + 1) < TINY
    assert stance.phases[0].modes == (0, -1) and not kinds(stance)[0].startswith("x1")
    ledger = stance.ledger(stance.duration)
    whole = stance.energy(stance.duration)[1] - stance.initial[1][1]
    assert abs(whole - sum(q for name, q in ledger.items() if name != "spring_work")) < TINY


@pytest.mark.parametrize("u", ["0.5", "0.7", "1.1", "1.3", "1.7", "1.9"])
def test_an_actuator_without_friction_leaves_its_stop_in_one_step(u):
    """Held until k y = u: whatever the last digit of k y says there, it slips and is not held anew."""
    stance = solve({**BARE, "x1_min": 0, "gamma2": -1}, v2=-1, x2="0.4", u=u)
    slip = stance.events[kinds(stance).index("x1_slips")]
    at = stance.at(slip.time)
    assert abs(100 * (at.x1 - at.x2 + mp.mpf("0.5")) - mp.mpf(u)) < TINY
    assert len(stance.phases) == len(stance.events) + 1


def test_an_exact_tie_is_settled_by_the_first_derivative_that_is_not_zero():
    """f1 = 0, u = 0: no force at touchdown, but the spring will push down; held if the stop is below."""
    assert solve(BARE, v2=-1).phases[0].modes == (-1, -1)
    assert solve({**BARE, "x1_min": 0}, v2=-1).phases[0].modes == (0, -1)
    exactly = {**BARE, "gamma2": -1, "f1": 1, "b1": 1}
    assert solve(exactly, v2=-1, u=2).phases[0].modes == (0, -1)  # |a1| = f1, and falling
    assert solve(exactly, v2=-1, u=-2).phases[0].modes == (-1, -1)  # |a1| = f1, and growing


def test_equal_velocities_at_touchdown_are_settled_by_the_accelerations():
    falls_slower = solve({**BARE, "gamma2": -1}, v2=-1, v1=-1, u=-40)
    assert falls_slower.status == "takeoff" and falls_slower.duration == 0
    assert solve({**BARE, "gamma2": -1}, v2=-1, v1=-1, u=20).duration > 0


def test_a_stretching_leg_takes_off_at_once_and_a_stretched_one_is_refused():
    stance = solve(BARE, v2=1)
    assert stance.status == "takeoff" and stance.duration == 0 and not stance.events and len(stance.phases) == 1
    with pytest.raises(ValueError, match="stretched"):
        solve(BARE, v2=-1, x2="0.6")
    assert solve({**BARE, "L0": 0.1, "c": 0.2}, v2=-1, x2=0.1 + 0.2).duration > 0


def test_rest_is_final_only_in_the_last_piece_of_the_current():
    robot = {**BARE, "f1": 20, "f2": 20, "gamma2": -1}
    asleep = solve(robot, v2=0, x2="0.4", u=0)
    assert asleep.status == "rest" and asleep.duration == 0 and asleep.at(7) == asleep.at(0)
    woken = solve(robot, v2=0, x2="0.4", u=[(0, 0), ("0.1", 100), ("0.2", 0)])
    assert kinds(woken)[0] == "x1_slips" and woken.events[0].time == mp.mpf("0.1")
    dozing = solve(robot, v2=0, x2="0.4", u=[(0, 0), ("0.1", 1)])
    assert dozing.status == "rest" and dozing.duration == 0


def test_endings_that_are_no_takeoff():
    heavy = solve({**LOCKED, "b2": 1000}, v2=-1)
    assert heavy.status == "horizon" and heavy.duration == 2 and heavy.takeoff is None and heavy.apex is None
    ringing = {**LOCKED, "k": 10**6}
    assert solve(ringing, v2=0, x2="0.499985", max_phases=50).status == "too_many_phases"


def test_damped_ringing_goes_on_below_all_digits():
    """Half-periods of a locked, damped leg stay pi/w apart however small they are: here to 1e-100 of the first."""
    stance = solve({**LOCKED, "k": 10000, "b2": 100}, v2="-0.02")
    w = mp.sqrt(10000 - 50**2)
    gaps = [q.time - p.time for p, q in zip(stance.events, stance.events[1:], strict=False)]
    assert stance.status == "horizon" and len(gaps) > 40
    assert all(abs(gap - mp.pi / w) < TINY for gap in gaps)
    assert abs(stance.final.v2) < mp.mpf("1e-40")


def test_a_stiff_overdamped_robot_needs_few_windows():
    stance = solve({**BARE, "m_s": "0.001", "k": 10**4, "b2": 10**4, "b1": 10**4, "f1": "0.01"}, v2=-2)
    assert stance.status == "horizon" and len(stance.leg.marks) < 200
    flow = stance.leg.flow(stance.phases[-1].modes)
    assert stance.duration / flow.window > 10**5


def test_one_answer_at_any_precision():
    robot, arguments = RANDOM[1]
    rough, fine = solve(robot, digits=40, **arguments), solve(robot, digits=80, **arguments)
    assert kinds(rough) == kinds(fine) and abs(rough.duration - fine.duration) < TINY
    assert all(abs(p - q) < TINY for p, q in zip(rough.final, fine.final, strict=True))


def test_condition_and_scales():
    stance = solve(HOPPER, v2=DROP, u=2)
    units = scales(HOPPER, stance, DROP)
    assert units["time"] == stance.duration and units["position"] == mp.mpf("0.1") and units["velocity"] == 1
    assert 1 < condition(HOPPER, v2=DROP, u=2) < 100
    assert condition({**BARE, "x1_max": solve_turn()}, v2=-1, v1="0.2") > 1e10


def solve_turn():
    """A stop 1e-24 below the highest point of the actuator: hitting it is a matter of the 24th digit."""
    top = solve(BARE, v2=-1, v1="0.2")
    return top.at(top.events[0].time).x1 - mp.mpf("1e-24")


@pytest.mark.skipif(importlib.util.find_spec("scipy") is None, reason="scipy is not installed")
def test_against_a_general_integrator():
    from scipy.integrate import solve_ivp

    def slope(_, s):
        force = 1200 * (s[0] - s[2] + 0.4)
        return [s[1], (-force - 150 * s[1] + 65 * 3) / 25 - 0.78, s[3], (force - 5 * s[3]) / 3 - 9.81 + 0.6]

    stance = solve(HOPPER, v2=DROP, u=3)
    end = float(stance.events[0].time)
    found = solve_ivp(slope, (0, end), [0, 0, 0.4, float(DROP)], rtol=1e-11, atol=1e-13, method="DOP853").y[:, -1]
    assert all(abs(p - float(q)) < 1e-9 for p, q in zip(found, stance.at(end), strict=True))
