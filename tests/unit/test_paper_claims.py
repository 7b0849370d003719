"""The register of the paper's claims: hopform computes every number that stands there, and every verdict follows from
them. The register's own module imports no hopform; each claim has a function here.
"""

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, least_squares

import hopform
from derive.paper.claims import CLAIMS, VERDICTS, Claim
from docs.gallery import machine, runs, verification
from docs.gallery.picture import rms, standing
from hopform import choose_current, choose_current_as_printed, load_robot, solve_stance, touchdown_velocity
from hopform.hopping import Errors, TouchdownDetector, delayed_apex, simulate
from hopform.hopping import controllers as control
from hopform.hopping.controllers import AsPrinted, FeedForward, ReturnMap
from hopform.hopping.terrain import flat, uniform
from tests import needs
from tests.oracle import integrator, reference
from tests.unit import test_equations as equations

pytestmark = needs.library

C, B, IDEAL = (load_robot(name) for name in ("hopper_c", "hopper_b", "ideal"))
WEIGHT = C.m_s * C.g
DROP = 0.2
FIG_7 = {"Kp": runs.law(B)[0], "Kd": runs.law(B)[1]}
"""Gains of Hopper B's first controller in figures 6 to 8."""

Numbers = tuple[float, ...]
COMPUTED: dict[str, Callable[[], Numbers]] = {}
"""What computes the numbers of a claim, in their order, by its name; it asserts what the verdict says of them."""


def computed(function: Callable[[], Numbers]) -> Callable[[], Numbers]:
    COMPUTED[function.__name__] = function
    return function


def agrees(stated: str, number: float) -> bool:
    """Whether a number is the one that is stated, to all its digits, or keeps within a bound of its magnitude."""
    relation, _, bound = stated.rpartition(" ")
    if relation:
        return abs(number) < float(bound) if relation == "<" else abs(number) > float(bound)
    digits = len(stated.partition(".")[2])
    return f"{number:.{digits}f}" == stated


# ---- what most of them need ----


def drop(u: float, height: float = DROP, robot: hopform.Robot = C) -> hopform.Stance:
    """The stance after a drop, the actuator at its origin."""
    return solve_stance(robot, v2=touchdown_velocity(robot, height), u=u)


def missed(robot: hopform.Robot, ground: tuple[float, ...], controller, wanted, **how) -> np.ndarray:
    """By how much the apexes of a run miss the set points [m]."""
    targets = np.broadcast_to(np.array(wanted), len(ground))
    run = simulate(robot, ground, controller, height=float(targets[0]), **how)
    assert run.status == "completed"
    return run.table["apex"] - targets


@cache
def of_figure(number: int, kind: type = FeedForward, **how) -> np.ndarray:
    """Errors of hopper_c's apexes [mm] on the ground of Fig. 16 or 17."""
    ground = flat(len(runs.WANTED)) if number == 16 else uniform(len(runs.WANTED), runs.SIZE, seed=17)
    return 1e3 * missed(C, ground, kind(runs.WANTED, **how), runs.WANTED)


def believing(**values: float) -> float:
    """Error [mm, rms] of the exact controller over the ground of Fig. 17 whose model has other values."""
    ground = uniform(len(runs.WANTED), runs.SIZE, seed=17)
    errors = Errors(model=replace(C, **values))
    return 1e3 * rms(missed(C, ground, FeedForward(runs.WANTED), runs.WANTED, errors=errors))


def over_fig_7(controller) -> np.ndarray:
    """Errors of hopper_b's apexes [mm] around 16 cm over the ground of Fig. 7."""
    return 1e3 * missed(B, uniform(18, 0.03, seed=7), controller, 0.16)


@cache
def steady(u: float, robot: hopform.Robot = C):
    """The last hop of many under a constant current."""
    run = simulate(robot, flat(60), u, height=DROP)
    assert run.status == "completed"
    return run, run.hops[-1]


# ---- I ----


@computed
def brief_contact():
    heights = np.linspace(0.02, 0.36, 18)

    def longest(robot):
        stances = ((h, drop(u, h, robot)) for u in np.linspace(0.0, robot.u_max, 31) for h in heights)
        lasting = [(stance.duration, h) for h, stance in stances if stance.status == "takeoff"]
        assert {h for duration, h in lasting if duration > 0.25} == {0.02}
        return max(lasting)[0]

    usual = drop(0.0).duration, drop(3.0).duration
    assert max(usual) < 0.25
    return *usual, longest(C), longest(B)


@computed
def limited_actuator():
    pulse = 0.12
    stance = solve_stance(C, v2=0.0, x2=standing(C), u=[(0.0, C.u_max), (pulse, 0.0)], horizon=0.6)
    fastest = float(np.asarray(stance.at(np.linspace(0.0, stance.duration, 20001)).v1).max())
    push = abs(C.gamma2) * C.u_max
    at_first = (push - WEIGHT) / C.m_eff - C.f1
    assert fastest < push / C.b1
    return fastest, push / C.b1, 1e3 * float(stance.at(pulse).x1), 1e3 * 0.5 * at_first * pulse**2


@computed
def compressing_at_takeoff():
    run, hop = steady(3.0)
    before = run.hops[-2]
    t = np.linspace(before.takeoff_time, hop.touchdown_time, 4001)
    most = float(np.asarray(run.at(t).x1).max())
    slower = float(steady(1.5)[1].stance.end.v1)
    assert most > hop.stance.end.x1 and slower > 0.0
    assert simulate(C, flat(60), 1.3, height=DROP).status == "stopped"
    assert all(float(steady(u)[1].stance.end.v1) > 0.1 for u in (1.4, 1.8, 2.2, 2.6))
    return hop.stance.end.v1, 1e3 * hop.stance.end.x1, 1e3 * most, slower


# ---- II ----


@computed
def one_model():
    """In both files; name and description are no parameters."""
    assert B.solver is C.solver
    return (float(sum(a != b for a, b in zip(B.parameters, C.parameters, strict=True))),)


@cache
def verified(name: str):
    """A recording, the fitted first model, and what these and the robot itself leave of it [mm]."""
    share, seed = {"hopper_b": (0.4, 4), "hopper_c": (0.5, 10)}[name]
    robot = load_robot(name)
    u, recorded, fitted, _ = verification.tested(robot, share, seed)
    old, new = (verification.recordings(each, u) for each in (fitted, robot))
    left = {
        (which, axis): 1e3 * (getattr(recorded, axis) - getattr(model, axis))
        for which, model in (("old", old), ("new", new))
        for axis in ("x1", "x2")
    }
    return u, recorded, fitted, new, left


@computed
def initial_passive():
    times, off = verification.DROP_TIMES, verified("hopper_b")[4]["old", "x2"]
    first, late = (rms(off[(times >= begin) & (times < begin + 0.5)]) for begin in (0.0, 2.0))
    noise = 1e3 * verification.NOISE
    assert late > 5.0 * first > 5.0 * noise
    return first, late, noise


@computed
def initial_actuated():
    u, recorded, fitted, _, left = verified("hopper_b")
    names = ("m_eff", "b1", "gamma2", "k")

    def off(shares):
        values = {name: share * getattr(B, name) for name, share in zip(names, shares, strict=True)}
        x1 = verification.step(replace(fitted, **values), u)
        return np.where(np.isfinite(x1), 1e3 * (x1 - recorded.x1), 1e3)

    starts = ((1.0, 1.0, 1.0, 1.0), (1.0, 3.0, 1.0, 1.0), (2.0, 5.0, 2.0, 1.0))
    bounds = ((0.05, 0.0, 0.05, 0.3), (20.0, 40.0, 20.0, 3.0))
    best = min(rms(least_squares(off, start, bounds=bounds, diff_step=1e-4).fun) for start in starts)
    own = rms(left["new", "x1"])
    assert best > 4.0 * own
    return rms(left["old", "x1"]), best, own


@computed
def rise_time():
    """Signed: under the set point is negative."""
    wanted = runs.REFERENCE
    first, exact = (
        1e3 * missed(B, flat(18), each, wanted) for each in (ReturnMap(wanted, **FIG_7), FeedForward(wanted))
    )
    return first[11], exact[8], exact[9], first[13], exact[12]


@computed
def first_on_uneven():
    scatter = [
        1e3 * float(np.std(missed(B, ground, ReturnMap(0.16, **gains), 0.16)[3:]))
        for gains in (FIG_7, {})
        for ground in (flat(18), uniform(18, 0.03, seed=7))
    ]
    assert scatter[1] > 10.0 * scatter[0] and scatter[3] > 4.0 * scatter[2] and scatter[3] < scatter[1]
    assert (FIG_7["Kp"], FIG_7["Kd"], ReturnMap(0.16).Kp, ReturnMap(0.16).Kd) == (200.0, 10.0, 60.0, 3.0)
    return tuple(scatter)


@computed
def blind_to_actuator():
    apex, v2 = drop(2.0).apex, touchdown_velocity(C, DROP)
    return tuple(1e3 * (solve_stance(C, v2=v2, u=2.0, **state).apex - apex) for state in ({"x1": 0.01}, {"v1": 0.1}))


@computed
def first_experiment():
    """The errors of Fig. 8, by kinds."""
    wanted = runs.REFERENCE
    sensors = {"x1": 5e-4, "v1": 0.02, "x2": 3e-3, "v2": 0.05, "ground": 3e-3}
    kinds = ({}, sensors, {"current_scale": 0.97}, {"quantum": 1e-3, "delay": 2e-3})
    together = {name: value for kind in kinds for name, value in kind.items()}
    settled = [
        1e3 * rms(runs.after_steps(
            missed(B, flat(18), ReturnMap(wanted, **FIG_7), wanted, errors=Errors(**each), seed=8)
        ))
        for each in (*kinds, together)
    ]  # fmt: skip
    assert settled[0] < settled[1] < settled[3] < settled[2] < settled[4]
    return tuple(settled)


# ---- III-B ----


@computed
def improved_fit():
    left = verified("hopper_c")[4]
    return tuple(rms(left[which, axis]) for axis in ("x1", "x2") for which in ("old", "new"))


@computed
def rest_by_dry_friction():
    at_rest = verified("hopper_c")[3].x2[-1]
    over, most = 1e3 * abs(at_rest - standing(C)), 1e3 * C.m_s * C.f2 / C.k
    assert over < most
    return over, most


@computed
def friction_from_threshold():
    """A ramp of the current, spring unloaded and standing, as in Fig. 9."""
    data = machine.friction_threshold(C)[2]
    unloaded, stands = (data["onset"][name] for name in ("spring unloaded", "standing"))
    share = abs(C.gamma2) / C.m_eff
    assert abs(unloaded * share - C.f1) < 5e-3 < stands * share - C.f1
    return unloaded, unloaded * share, stands, stands * share


@computed
def impact_for_foot():
    """A foot of 5 % of the body's mass stops at touchdown; at take-off the body gives it momentum."""
    foot = 0.05
    taken = foot / (1.0 + foot)
    once = drop(0.0, DROP, replace(IDEAL, impact_loss=0.05)).apex
    twice = drop(0.0, DROP, replace(IDEAL, impact_loss=taken)).apex * (1.0 / (1.0 + foot))
    return 1e2 * taken, 1e2 * once, 1e2 * twice


@computed
def lower_bound():
    reach = hopform.reachability(C, np.array([DROP]), np.array([0.0, 3.0]))
    passive, lowest, u = float(reach.apex[0, 0]), float(reach.lowest[0]), float(reach.u_lowest[0])
    assert lowest < passive
    assert drop(0.0).apex == pytest.approx(passive, abs=1e-12) and drop(u).apex == pytest.approx(lowest, abs=1e-9)
    return 1e2 * passive, 1e2 * lowest, u


@computed
def upper_bound():
    margin = 0.015
    reach = hopform.reachability(C, np.linspace(0.02, 0.40, 77), np.array([0.0, C.u_max]), stop_margin=margin)
    limited = reach.limited.any(axis=1)
    assert limited.any() and not limited.all() and 0.01 <= margin <= 0.02
    return 1e2 * float(reach.heights[limited].max()), float(reach.u_highest[0])


def exactly(u: float, height: float = DROP) -> reference.Reference:
    """The stance after a drop to 50 digits."""
    return reference.solve(C.parameters._asdict(), v2=touchdown_velocity(C, height), u=u)


@computed
def bound_of_hardware():
    apex, end = drop(3.0).apex, exactly(3.0).final
    known = end.x2 + end.v2**2 / (2 * C.g) - C.L0
    return 1e2 * apex, 1e2 * float(known - apex)


# ---- III-C ----


@computed
def exact_solution():
    pairs = [(drop(u).end, exactly(u).final) for u in (0.0, 0.75, 1.5, 3.0)]
    off = max(abs(float(getattr(b, x) - getattr(a, x))) for a, b in pairs for x in ("x1", "x2"))
    whole = drop(0.75)
    there = whole.at(0.06)
    again = solve_stance(C, **{name: float(getattr(there, name)) for name in ("x1", "v1", "x2", "v2")}, u=0.75)
    assert 0 < len(again.phases) < len(whole.phases)
    return off, again.end.x2 - whole.end.x2


@computed
def signs_of_v2():
    stance = drop(3.0)
    (turns,) = (event.time for event in stance.events if event.kind == "x2_reverses")
    shortest = brentq(lambda t: float(stance.at(t).v1 - stance.at(t).v2), 0.08, 0.1)
    assert shortest > turns
    t = np.linspace(0.0, stance.duration, 2001)
    at = stance.at(t)
    assert abs(t[np.argmax(np.asarray(at.x1) - np.asarray(at.x2))] - shortest) < 1e-4
    *_, last = simulate(C, flat(20), 0.0, height=DROP).hops
    kinds = [event.kind for event in last.stance.events]
    assert kinds[-1] == "x2_sticks"
    return 1e3 * turns, 1e3 * shortest, float(stance.at(shortest).v2), float(kinds.count("x2_reverses"))


@computed
def pieces():
    stance = drop(0.75)
    crossings = sum(event.kind == "x1_reverses" for event in stance.events)
    assert len(stance.phases) > crossings + 2, "two pieces by assumption B"
    return float(crossings), float(len(stance.phases))


@computed
def agrees_with_numbers():
    stance, path = drop(3.0), integrator.Path()
    start = np.array([0.0, 0.0, C.L0 + C.c, touchdown_velocity(C, DROP)])
    _, end = integrator.stance(C, 3.0, 0.0, start, path)
    t = equations.turning(equations.drop(3.0))
    printed = equations.printed(14).subs(
        {equations.algebra.b_eff: equations.Q.m_eff, equations.algebra.m_1: equations.Q.m_eff}
    )
    off = equations.height_by_18(3.0, t, h_2=printed)[0] - equations.height_by_18(3.0, t)[0]
    return max(abs(stance.end.x1 - end[0]), abs(stance.end.x2 - end[2])), 1e2 * abs(off)


@computed
def easy_coefficients():
    smooth = equations.HOPPER_C._replace(b1=1e-6, b2=1e-6)
    return tuple(b - a for a, b in (equations.height_by_18(3.0, 0.1), equations.height_by_18(3.0, 0.1, smooth)))


@computed
def fast():
    """Compression, then expansion, each integrated by itself, x1 moving up throughout."""
    stance = drop(3.0)
    at = np.array([0.0, 0.0, C.L0, touchdown_velocity(C, DROP)])
    count = 0
    for phase, side_2 in zip(stance.phases, (-1.0, 1.0), strict=True):

        def rates(_, z, side_2=side_2):
            x1, v1, x2, v2 = z
            pull = C.k * (x1 - x2 + C.L0)
            return [v1, (-pull - C.b1 * v1 - C.gamma2 * 3.0) / C.m_eff - C.f1, v2,
                    (pull - C.b2 * v2 - WEIGHT) / C.m_s - C.f2 * side_2]  # fmt: skip

        solved = solve_ivp(rates, (phase.start, phase.end), at, method="DOP853", rtol=1e-9, atol=1e-12)
        count, at = count + solved.nfev, solved.y[:, -1]
    assert abs(at[2] - stance.end.x2) < 1e-8
    return float(len(stance.phases)), float(count)


# ---- III-D ----


@computed
def takeoff_velocity():
    def of(u):
        height = brentq(lambda h: drop(u, h).end.v2 - 1.5, 0.05, 0.4, xtol=1e-14)
        return drop(u, height)

    passive, pushed = of(0.0), of(3.0)
    assert pushed.apex - passive.apex == pytest.approx(pushed.end.x1 - passive.end.x1, abs=1e-9)
    return 1e2 * passive.apex, 1e2 * pushed.apex, 0.5 * C.k * pushed.end.x1**2


@computed
def compression_alone():
    heights = [brentq(lambda h, u=u: drop(u, h).compression_max - 0.10, 0.05, 0.4) for u in (0.0, 3.0)]
    assert [f"{1e2 * height:.1f}" for height in heights] == ["14.0", "9.6"]
    return tuple(1e2 * drop(u, height).apex for u, height in zip((0.0, 3.0), heights, strict=True))


@computed
def exact_apex():
    stance = drop(3.0)
    touchdown = 0.5 * C.m_s * touchdown_velocity(C, DROP) ** 2
    left = 0.5 * C.k * stance.end.x1**2
    printed, right = ((touchdown + stance.aed - less) / WEIGHT for less in (0.0, left))
    return 1e2 * (printed - stance.apex), 1e2 * (right - stance.apex)


@computed
def ideal_energy():
    run = simulate(IDEAL, flat(5), 0.0, height=DROP)
    energy = np.asarray(run.energy(np.linspace(0.0, run.duration, 2001)).body)
    assert run.status == "completed"
    return (float(np.ptp(energy)) / energy[0],)


@computed
def aed_is_the_change():
    run = simulate(C, flat(7), 0.0, height=DROP)
    t = np.linspace(0.0, run.duration, 3001)
    off = float(np.abs(np.asarray(run.energy(t).body) - np.asarray(run.aed(t))).max())
    stance = run.hops[0].stance
    ledger = stance.ledger(stance.duration)._asdict()
    printed = C.f2 * (C.L0 - stance.end.x2) - ledger["viscous_2"] + ledger["spring_work"]
    assert printed > 0.0 > stance.aed
    return off, printed - stance.aed


@computed
def losses():
    run = simulate(C, flat(7), 0.0, height=DROP)
    first = run.hops[0]
    assert len(run.hops) == 5 and run.status == "stopped"
    assert all(-hop.stance.aed > hop.energy_lost_at_impact for hop in run.hops[:-1])
    return first.energy_lost_at_impact, -float(first.stance.aed)


@computed
def steady_hopping():
    stops = simulate(C, flat(60), 0.75, height=DROP)
    run, hop = steady(3.0)
    apexes = run.table["apex"]
    assert stops.status == "stopped" and abs(apexes[-1] - apexes[-2]) < 1e-9
    return 1e2 * hop.apex, 1e2 * steady(1.5)[1].apex, float(len(stops.hops))


@computed
def minima_of_energy():
    stance = steady(3.0)[1].stance
    energy = np.asarray(stance.energy(np.linspace(0.0, stance.duration, 4001)).body)
    assert 0 < energy.argmin() < energy.size - 1
    return energy[0], energy.min(), energy[-1]


@computed
def current_that_holds():
    v2 = touchdown_velocity(C, DROP)
    exact = choose_current(C, v2=v2, h_des=DROP)
    printed = choose_current_as_printed(C, v2=v2, h_des=DROP)
    return exact.u, 1e2 * (drop(exact.u).apex - DROP), printed.u, 1e2 * (drop(printed.u).apex - DROP)


# ---- IV, V ----


@computed
def ground_is_known():
    """The ground is what the body has fallen to from the apex: the fall goes on for the delay."""
    detector, v2 = TouchdownDetector(high=0.6, low=0.4, count=3, dt=1e-3), touchdown_velocity(C, DROP)
    delay = detector.mean_delay(machine.NOISE)
    falling = (2.0 * C.g * DROP) ** 0.5
    fallen = falling * delay + 0.5 * C.g * delay**2
    cost = delayed_apex(C, 0.005, v2=v2, u=choose_current(C, v2=v2, h_des=DROP).u)[1]
    return 1e3 * delay, detector.false_alarm_rate(machine.NOISE), 1e3 * fallen, 1e3 * cost


@computed
def simple():
    """What `measured` solves for the maps, counted."""
    first, count = ReturnMap(0.16), 0
    solve = control.solve_stances

    def counting(*given, **named):
        nonlocal count
        batch = solve(*given, **named)
        count += batch.apex.size
        return batch

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(control, "solve_stances", counting)
        first.prepare(B, (0.0,))
    gains = sum(name in ("Kp", "Kd") for name in vars(first))
    return float(count), float(gains), float(choose_current(C, v2=touchdown_velocity(C, DROP), h_des=DROP).solved)


@computed
def gentle_return():
    run = simulate(C, flat(len(runs.WANTED)), FeedForward(runs.WANTED), height=runs.WANTED[0])
    before, at, limited = [], [], []
    for last, hop in zip(run.hops, run.hops[1:], strict=False):
        before.append(float(run.at(hop.touchdown_time - 0.05).x1))
        at.append(float(hop.touchdown.x1))
        flight = np.linspace(last.takeoff_time, hop.touchdown_time, 2001)[1:-1]
        limited.append(float((np.abs(np.asarray(run.current(flight))) > 0.999999 * C.u_max).mean()))
    return 1e3 * min(before), 1e3 * max(before), 1e3 * max(at), 1e2 * max(limited)


@computed
def precise_on_rough():
    printed = of_figure(17, AsPrinted)
    step = of_figure(17, AsPrinted, half=False, signed=True)
    spring = of_figure(17, AsPrinted, spring_coordinate=True)
    both = of_figure(17, AsPrinted, half=False, signed=True, spring_coordinate=True)
    assert np.all(printed < 0.0)
    return rms(printed), float(printed.mean()), *map(rms, (step, spring, both)), rms(of_figure(17))


@computed
def even_equals_uneven():
    each = [rms(of_figure(number, kind)) for kind in (AsPrinted, FeedForward) for number in (16, 17)]
    assert each[1] > 1.5 * each[0]
    mended = (rms(of_figure(number, AsPrinted, half=False, signed=True)) for number in (16, 17))
    assert abs(next(mended) - next(mended)) < 0.5, "with (26) alone they are alike"
    return tuple(each)


@computed
def significant_improvement():
    each = [
        rms(over_fig_7(of)) for of in (AsPrinted(0.16), ReturnMap(0.16, **FIG_7), ReturnMap(0.16), FeedForward(0.16))
    ]
    assert each[0] > 3.0 * each[1] > 3.0 * each[2] > 3.0 * each[3]
    return tuple(each)


@computed
def limits_in_the_model():
    return believing(b1=0.0, f1=0.0), rms(of_figure(17))


@computed
def both_frictions():
    return believing(f1=0.0, f2=0.0), believing(b1=0.0, b2=0.0), rms(of_figure(17))


# ---- the register against these ----


SLOW = ("first_on_uneven", "first_experiment")


@pytest.mark.parametrize(
    "claim",
    [pytest.param(each, id=each.name, marks=[pytest.mark.sliced] if each.name in SLOW else []) for each in CLAIMS],
)
def test_a_claim_has_the_numbers_that_hopform_computes(claim: Claim):
    numbers = COMPUTED[claim.name]()
    for stated, number in zip(claim.numbers, numbers, strict=True):
        assert agrees(stated.value, float(number)), f"{stated.what}: {stated.value} is stated, {number} computed"


def test_every_claim_has_a_name_of_its_own_and_every_verdict_is_used():
    assert [claim.name for claim in CLAIMS] == [*COMPUTED]
    assert {claim.verdict for claim in CLAIMS} == set(VERDICTS)


def test_every_claim_says_where_and_what_in_a_sentence_and_has_numbers_with_units():
    for claim in CLAIMS:
        assert claim.where and claim.says.endswith(".") and claim.reason.endswith("."), claim.name
        assert claim.numbers and all(each.what and each.unit for each in claim.numbers), claim.name
        assert all(re.fullmatch(r"([<>] 1e-?\d+|[<>] \d+|-?\d+(\.\d+)?)", each.value) for each in claim.numbers)


@pytest.mark.parametrize(
    ("stated", "number", "right"),
    [
        ("0.185", 0.18529, True), ("0.185", 0.1856, False), ("-2.2", -2.235, True), ("-2.2", 2.235, False),
        ("5", 5.0, True), ("5", 6.0, False), ("< 1e-6", -1e-9, True), ("< 1e-6", -1e-3, False),
        ("> 200", 300.0, True), ("> 200", 100.0, False), ("0.185", float("nan"), False), ("< 1", float("nan"), False),
    ],
)  # fmt: skip
def test_all_digits_that_are_stated_are_compared(stated, number, right):
    assert agrees(stated, number) == right


PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "model.md"


def test_the_claims_on_the_page_about_the_model_have_the_verdicts_and_numbers_of_the_register():
    text = PAGE.read_text("utf-8").partition("## What the paper claims")[2]
    rows = [row.strip("| ").split(" | ") for row in text.splitlines() if "EQUATIONS.md#" in row and row.startswith("|")]
    assert len(rows) >= 5
    by_name = {claim.name: claim for claim in CLAIMS}
    for says, verdict, numbers in rows:
        claim = by_name[re.search(r"EQUATIONS\.md#(\w+)", says)[1]]
        known = {value for each in claim.numbers for value in (each.value, each.with_unit)}
        assert verdict == claim.verdict and set(re.findall(r"\d+\.\d+", numbers)) <= known, claim.name
    reproduced = sum(claim.verdict == "reproduced" for claim in CLAIMS) / len(CLAIMS)
    assert "Half are reproduced." in text and abs(reproduced - 0.5) < 0.05


def test_the_generated_package_carries_the_claims_word_for_word():
    from hopform_solver.equations import CLAIMS as GENERATED

    assert [
        (each.name, each.where, each.says, each.printed, each.verdict,
         [tuple(one) for one in each.numbers], each.reason)
        for each in GENERATED
    ] == [
        (each.name, each.where, each.says, each.printed, each.verdict,
         [(one.what, one.value, one.unit) for one in each.numbers], each.reason)
        for each in CLAIMS
    ]  # fmt: skip
