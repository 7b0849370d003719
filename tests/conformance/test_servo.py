"""The law of a servo, i = sat((K_p (target - q) - K_d q')/k_t): against the matrix exponential where it is linear, against
the joint where it is always saturated, and by what holds of every motion.

Beside these the zoo has random servos against the integrator, whose right side is np.clip of that.
"""

import json
import math
import re
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm

import hopform
import hopform.identify
from hopform import _front as cli
from tests import needs
from tests.conformance.zoo import Case, Draw, cases
from tests.derived import SHIPPED, built, solver_of
from tests.oracle.numeric import integrate

pytestmark = needs.library

STIFF = {"J": 0.02, "b": 0.1, "k_t": 0.2, "K_p": 60.0, "K_d": 1.1, "load": 0.3, "i_max": 20.0}
"""A servo that saturates for steps of the target beyond 0.07 rad."""
FREE = {"F_p": 0.0, "F_m": 0.0}


@pytest.fixture(scope="module")
def servo(store):
    return solver_of(store, SHIPPED / "servo.py")


def solved(servo, case: Case, **more):
    how = {"start": case.start, "u": case.u, "horizon": case.horizon} | more
    return servo.solve_motion(servo.Robot(**case.robot), **how)


def some(seed: int, count: int) -> list[Case]:
    return list(cases("servo", seed, count, 2e3))


def linear(of: dict, q: float, v: float, steps, horizon: float) -> tuple[float, float]:
    """The state without a limit and friction: z' = M z of z = (q, q', 1, target) between the steps of the target."""
    rates = np.zeros((4, 4))
    rates[0, 1] = 1.0
    rates[1] = np.array([-of["K_p"], -(of["b"] + of["K_d"]), of["load"], of["K_p"]]) / of["J"]

    @cache
    def over(time: float):
        return expm(time * rates)

    z = np.array([q, v, 1.0, 0.0])
    for (t, target), (after, _) in pairwise([*steps, (horizon, 0.0)]):
        z[3] = target
        z = over(after - t) @ z
    return float(z[0]), float(z[1])


# ---- closed forms ----


@pytest.mark.parametrize("damped", [0.02, 0.9, 1.0, 1.1, 40.0])
def test_without_a_limit_it_is_the_linear_servo(servo, damped):
    """Ringing, nearly critical, and so stiff that the poles are 6000 times apart."""
    of = STIFF | FREE | {"i_max": math.inf, "b": 0.0, "K_d": 2.0 * damped * math.sqrt(STIFF["K_p"] * STIFF["J"])}
    steps = [(0.0, 0.4), (0.05, -0.3), (0.11, 0.2)]
    motion = servo.solve_motion(servo.Robot(**of), start={"q": 0.1, "q_dot": -2.0}, u=steps, horizon=0.2)
    assert np.all(np.abs(np.subtract(motion.end, linear(of, 0.1, -2.0, steps, 0.2))) <= [1e-13, 1e-11])


def staircase(count: int, horizon: float) -> list[tuple[float, float]]:
    """Steps of a target that follows a sine."""
    return [(n * horizon / count, 0.3 * math.sin(9.0 * n * horizon / count)) for n in range(count)]


@pytest.mark.parametrize("count", [1500, pytest.param(65535, marks=pytest.mark.sliced)])
def test_a_target_may_have_many_steps(servo, count):
    """As many as the engine carries: the state at the end is that of the matrix exponential of each."""
    of, horizon = STIFF | FREE | {"i_max": math.inf}, 1e-3 * count
    steps = staircase(count, horizon)
    motion = servo.solve_motion(servo.Robot(**of), start={"q": 0.1}, u=steps, horizon=horizon, max_phases=4 * count)
    assert motion.status == "horizon" and len(motion.phases) >= count
    assert np.all(np.abs(np.subtract(motion.end, linear(of, 0.1, 0.0, steps, horizon))) <= [1e-12, 1e-10])


def test_steps_that_saturate_are_those_of_the_integrator(servo):
    """Sixty steps, most of them beyond the limit of the current, with friction at rest and stops."""
    case = next(each for each in some(3, 200) if each.robot["F_sp"] > 0.0 and 0.0 < each.robot["i_max"] < math.inf
                and each.robot["q_max"] < math.inf)  # fmt: skip
    ring = math.sqrt(case.robot["K_p"] / case.robot["J"])
    draw, targets = Draw("sixty"), 60
    steps = tuple((n * 2.0 / ring, draw.uniform(-1.0, 1.0)) for n in range(targets))
    case = replace(case, u=steps, horizon=2.0 * targets / ring)
    truth = integrate(case.mechanism, case.q, case.v, case.steps, case.horizon, 0.5 / case.fastest)
    motion = solved(servo, case)
    assert sum(phase.mode_2 != 0 for phase in motion.phases) > 20
    assert [event.kind for event in motion.events] == truth.kinds
    np.testing.assert_allclose([event.time for event in motion.events], [event.t for event in truth.events], atol=1e-9)


def test_what_is_always_saturated_is_the_joint_under_its_limit(servo, store):
    """The target is out of reach: a joint with the current i_max has the same events, states and derivatives."""
    joint = solver_of(store, SHIPPED / "joint.py")
    of = STIFF | {"F_p": 0.3, "F_m": 0.2, "F_sp": 0.1, "F_sm": 0.1, "q_min": -0.5, "q_max": 2.0}
    how = {"start": {"q": 0.3, "q_dot": -4.0}, "horizon": 1.2}
    for side in (1.0, -1.0):
        motion = servo.solve_motion(servo.Robot(**of), u=side * 90.0, **how)
        shared = {key: of[key] for key in of if key not in ("K_p", "K_d")}
        other = joint.solve_motion(joint.Robot(**shared), u=side * of["i_max"], **how)
        assert motion.events == other.events and motion.events
        assert motion.end == other.end and motion.duration == other.duration
        t = np.linspace(0.0, motion.duration, 21)
        assert np.array_equal(motion.at(t), other.at(t)) and np.array_equal(
            motion.forces(t)["input"], 4.0 * side + 0.0 * t
        )
        mine, theirs = motion.derivatives(t), other.derivatives(t)
        for column in ("q", "q_dot", "J", "b", "F_p", "F_m", "k_t", "load", "q_min", "q_max"):
            np.testing.assert_array_equal(mine["q", column], theirs["q", column])
        np.testing.assert_allclose(mine["q", "i_max"], side * theirs["q", "i"], rtol=1e-13, atol=1e-300)
        assert not mine["q", "target"].any() and not mine["q", "K_p"].any() and not mine["q", "K_d"].any()


# ---- what holds of every motion ----


@pytest.mark.parametrize("seed", range(4))
def test_a_motion_may_be_split_at_any_time(servo, seed):
    """From the state at a time on, with what is left of the target's steps, it ends as it did."""
    for case in some(10 + seed, 8):
        whole, at = solved(servo, case), 0.37 * case.horizon
        if whole.duration <= at:
            continue
        before = [target for t, target in case.steps if t <= at]
        rest = [(0.0, before[-1]), *((t - at, target) for t, target in case.steps if t > at)]
        then = servo.solve_motion(whole.robot, start=whole.at(at)._asdict(), u=rest, horizon=case.horizon - at)
        first = len([event for event in whole.events if event.time <= at])
        assert [e.kind for e in then.events] == [e.kind for e in whole.events[first:]]
        assert then.status == whole.status
        np.testing.assert_allclose(then.end, whole.end, rtol=1e-7, atol=1e-9)


def test_the_mirrored_servo_moves_as_in_a_mirror(servo):
    """Each sign of the numbers that go in is turned."""
    swapped = {"F_p": "F_m", "F_sp": "F_sm", "q_min": "q_max"}
    swapped |= {there: here for here, there in swapped.items()}
    for case in some(20, 30):
        motion = solved(servo, case)
        signs = dict.fromkeys(("load", "q_min", "q_max"), -1.0)
        robot = {key: signs.get(key, 1.0) * case.robot[swapped.get(key, key)] for key in case.robot}
        start = {key: -value for key, value in case.start.items()}
        mirrored = solved(servo, replace(case, robot=robot, start=start, u=tuple((t, -u) for t, u in case.steps)))
        assert [e.kind for e in mirrored.events] == [e.kind for e in motion.events]
        times = [[e.time for e in each.events] for each in (mirrored, motion)]
        np.testing.assert_allclose(*times, rtol=1e-10)
        np.testing.assert_allclose(np.negative(mirrored.end), motion.end, rtol=1e-10, atol=1e-13)
        assert [(-p.mode_1, -p.mode_2) for p in mirrored.phases] == [(p.mode_1, p.mode_2) for p in motion.phases]


def test_the_current_is_that_of_the_law_within_its_limit(servo):
    """At any time, and exactly the limit where it saturates; it has no jump but where the target steps, or a stop takes
    the velocity.
    """
    saturated = 0
    for case in some(30, 40):
        motion, of = solved(servo, case), case.robot
        t = np.unique(np.r_[np.linspace(0.0, motion.duration, 301), [phase.start for phase in motion.phases]])
        t = t[t <= motion.duration]
        (q, v), target, i = motion.at(t), motion.target(t), motion.current(t)
        asked = (of["K_p"] * (target - q) - of["K_d"] * v) / of["k_t"]
        scale = (of["K_p"] * (np.abs(q) + np.abs(target)) + of["K_d"] * np.abs(v)) / of["k_t"]
        assert np.all(np.abs(i - np.clip(asked, -of["i_max"], of["i_max"])) <= 1e-13 * scale + 1e-300)
        assert np.allclose(motion.forces(t)["input"], of["k_t"] * i, rtol=1e-15)
        for before, phase in pairwise(motion.phases):
            if before.mode_2 and phase.start > before.start:
                middle = 0.5 * (before.start + phase.start)
                assert motion.current(middle) == before.mode_2 * of["i_max"]
                saturated += 1
    assert saturated > 30


def test_the_ledger_is_the_balance_of_energy_and_the_motor_s_entry_its_power_over_time(servo):
    nodes, weights = np.polynomial.legendre.leggauss(24)
    for case in some(40, 30):
        motion = solved(servo, case)
        if motion.duration == 0.0:
            continue
        t = np.linspace(0.0, motion.duration, 7)
        entries = motion.ledger_by_element(t)
        gained = np.sum([each for own in entries.values() for each in own.values()], axis=0)
        largest = max(float(np.abs(each).max()) for own in entries.values() for each in own.values())
        given = 0.5 * case.robot["J"] * case.start["q_dot"] ** 2  # a stop may take it at once
        kept = motion.total_energy(t) - given
        np.testing.assert_allclose(gained, kept, rtol=0.0, atol=1e-12 * (largest + given))
        work = 0.0
        for phase in motion.phases:
            for begin, end in pairwise(np.linspace(phase.start, phase.end, 9)):
                times = np.nextafter(0.5 * (begin + end) + 0.5 * (end - begin) * nodes, phase.start)
                power = case.robot["k_t"] * motion.current(times) * motion.at(times).q_dot
                work += 0.5 * (end - begin) * float(weights @ power)
        assert abs(work - float(entries["motor"]["motor_work"][-1])) <= 1e-9 * (largest + given)


def moved_integrator(case: Case, name: str, by: float):
    """The integrator's motion of a case in which one number is another."""
    robot, start, steps = dict(case.robot), dict(case.start), case.steps
    if name in robot:
        robot[name] += by
    elif name in start:
        start[name] += by
    else:
        steps = tuple((t, target + by) for t, target in steps)
    other = replace(case, robot=robot, start=start)
    return integrate(other.mechanism, other.q, other.v, steps, case.horizon, 0.5 / case.fastest)


@pytest.mark.parametrize(
    ("seed", "count"), [pytest.param(50, 2, marks=pytest.mark.sliced), pytest.param(51, 12, marks=pytest.mark.nightly)]
)
def test_derivatives_are_differences_of_the_integrator(servo, seed, count):
    """By the start, the target and every parameter, through limits, reversals and stops, at the ending."""
    found = 0
    for case in some(seed, 20 * count):
        motion = solved(servo, case)
        through = sum(phase.mode_2 != 0 for phase in motion.phases)
        if motion.status != "horizon" or not motion.events or not through or len(motion.phases) > 40:
            continue
        kinds, end = [event.kind for event in motion.events], motion.sensitivities
        of, ring = case.robot, math.sqrt(case.robot["K_p"] / case.robot["J"])
        most = min(of["k_t"] * of["i_max"], of["K_p"])
        sizes = {"q": 0.1, "q_dot": 0.1 * ring, "target": 0.1, "J": of["J"], "b": of["J"] * ring, "k_t": of["k_t"],
                 "K_p": of["K_p"], "K_d": of["J"] * ring, "load": most, "q_min": 0.1, "q_max": 0.1, "i_max": of["i_max"]}  # fmt: skip
        sizes |= {name: most for name in ("F_p", "F_m", "F_sp", "F_sm") if of[name] > 1e-3 * most}
        at_a_stop = case.start["q"] in (of["q_min"], of["q_max"])
        for name, size in sizes.items():
            value = {**of, **case.start}.get(name, 1.0)
            if not math.isfinite(value) or size == 0.0 or (at_a_stop and name in ("q", "q_dot", "q_min", "q_max")):
                continue
            h = 1e-5 * size
            above, below = (moved_integrator(case, name, way * h) for way in (1.0, -1.0))
            if not above.kinds == below.kinds == kinds:
                continue
            difference = (np.concatenate(above.final) - np.concatenate(below.final)) / (2.0 * h)
            mine = np.array([end[row, name] for row in ("q", "q_dot")])
            scale = np.abs(difference) + np.array([0.1, 0.1 * ring]) / size
            assert np.all(np.abs(mine - difference) <= 1e-5 * scale), (name, mine, difference, case)
            found += 1
        count -= 1
        if not count:
            break
    assert found > 10 and not count


# ---- cases by hand ----


def test_only_a_step_of_the_target_releases_what_friction_holds(servo):
    """While it is held the pull is constant: a small step moves nothing, a larger one slips, and the limits hold, too."""
    robot = servo.Robot(**STIFF | {"load": 0.0, "F_p": 0.5, "F_m": 0.5, "F_sp": 0.5, "F_sm": 0.5})
    steps = [(0.0, 0.01), (0.5, -0.016), (1.0, 0.02)]  # 0.6, 0.96 and 1.2 N m against 1 N m
    motion = servo.solve_motion(robot, u=steps, horizon=3.0)
    assert [phase.mode_1 for phase in motion.phases[:3]] == [0, 0, 1]
    assert (motion.events[0].kind, motion.events[0].time) == ("q_slips", 1.0)
    assert motion.current(0.2) == pytest.approx(3.0) and motion.current(0.7) == pytest.approx(-4.8)
    assert motion.forces(0.2)["friction_q"] == pytest.approx(-0.6)
    held = servo.Robot(**STIFF | {"load": 0.0, "F_p": 6.0, "F_m": 6.0})
    still = servo.solve_motion(held, u=[(0.0, 5.0), (0.1, -5.0)], horizon=1.0)
    assert still.status == "rest" and still.duration == 0.0 and still.current(0.05) == 20.0


def test_a_pull_that_is_exactly_at_its_limit_follows_its_rate(servo):
    """K_p target = k_t i_max at rest: what speeds up leaves the limit at once, what a load drives back does not."""
    of = STIFF | FREE | {"K_p": 64.0, "k_t": 0.25, "i_max": 64.0, "b": 0.0, "load": 0.0}
    motion = servo.solve_motion(servo.Robot(**of), u=0.25, horizon=0.1)
    assert motion.phases[0].mode_2 == 0 and motion.current(0.0) == 64.0
    back = servo.solve_motion(servo.Robot(**of | {"load": -40.0}), u=0.25, horizon=0.01)
    assert back.phases[0].mode_2 == 1 and back.current(0.005) == 64.0
    reversed_ = servo.solve_motion(servo.Robot(**of | {"load": 40.0}), u=-0.25, horizon=0.01)
    assert reversed_.phases[0].mode_2 == -1


def test_a_limit_of_zero_leaves_the_joint_without_a_motor(servo):
    """Whatever the target asks for; as of a joint whose current is 0."""
    of = STIFF | {"i_max": 0.0, "F_p": 0.1, "F_m": 0.1}
    motion = servo.solve_motion(servo.Robot(**of), start={"q_dot": 2.0}, u=0.05, horizon=1.0)
    free = servo.solve_motion(servo.Robot(**of | {"K_p": 0.0, "K_d": 0.0}), start={"q_dot": 2.0}, horizon=1.0)
    t = np.linspace(0.0, 1.0, 9)
    assert not np.any(motion.current(t)) and [e.kind for e in motion.events] == [e.kind for e in free.events]
    np.testing.assert_allclose(motion.at(t), free.at(t), rtol=1e-12, atol=1e-13)


def test_a_batch_and_a_grid_have_the_states_of_each_motion(servo):
    robot, targets = servo.Robot(), np.linspace(-2.0, 2.0, 9)
    many = servo.solve_motions(robot, u=targets, horizon=0.4, sensitivities=True)
    for n, target in enumerate(targets.tolist()):
        one = servo.solve_motion(robot, u=target, horizon=0.4)
        assert (many.end.q[n], many.end.q_dot[n], many.duration[n]) == (one.end.q, one.end.q_dot, one.duration)
        np.testing.assert_array_equal(many.sensitivities.matrix[n], one.sensitivities.matrix)
        t, state = one.grid(57)
        np.testing.assert_allclose(state, one.at(t), rtol=1e-12, atol=1e-13)


def test_tables_of_a_motion_have_the_target_and_the_current(servo, store, capsys):
    """JSON, CSV and a table name both; the target is given by --u."""
    folder = built(store, SHIPPED / "servo.py")
    asked = ["--solver", str(folder), "motion", "--u", "1", "--horizon", "0.3"]
    assert cli.main([*asked, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["phases"][0]["driven"] == {"target": 1.0, "i": 10.0} and found["units"]["i"] == "A"
    assert "target" in found["sensitivities"]["q"] and "i_max" in found["sensitivities"]["q"]
    assert cli.main([*asked, "--csv", "-", "--samples", "5"]) == 0
    header, first, *_ = capsys.readouterr().out.splitlines()
    row = dict(zip(header.split(","), first.split(","), strict=True))
    assert float(row["target"]) == 1.0 and float(row["i"]) == 10.0 and float(row["input"]) == 1.0
    assert cli.main(asked) == 0
    assert "at its upper limit" in (shown := capsys.readouterr().out) and "by the law" in shown
    assert " i leaves its limit  forward  by the law " in shown


def test_an_explanation_says_what_the_law_has_left(servo):
    """The event functions of the law are certified, each named by its limit, and the end of a phase has a name."""
    text = servo.solve_motion(servo.Robot(), u=[(0.0, 1.0), (0.3, 0.9)], horizon=0.5).explain()
    assert "i at its upper limit; then i leaves its limit" in text and "i by the law; then a step of target" in text
    certified = re.findall(r"^  i (below|above|beyond) its (upper|lower) limit \[N m\] (.*)", text, re.MULTILINE)
    assert len(certified) >= 4 and all("rule" in why for *_, why in certified)
    by_the_law = [named for *named, _ in certified if named[0] != "beyond"]
    assert by_the_law[::2] == [["above", "lower"]] * (len(by_the_law) // 2)
    assert by_the_law[1::2] == [["below", "upper"]] * (len(by_the_law) // 2)


@pytest.mark.parametrize(("target", "limit"), [(1.0, "upper"), (-1.0, "lower")])
def test_an_explanation_of_a_phase_at_a_limit_names_that_limit(servo, target, limit):
    motion = servo.solve_motion(servo.Robot(), u=target, horizon=0.5)
    assert motion.phases[0].mode_2 == target
    first = motion.explain().split("Phase 2,")[0]
    assert f"i at its {limit} limit; then" in first and f"  i beyond its {limit} limit [N m] " in first
    assert first.count(" limit [N m] ") == 1


def test_a_recording_of_a_servo_has_the_current_under_its_name(servo):
    """As the motor's driver measures it, in A: the target [rad] is what the law is told."""
    robot, steps = servo.Robot(name="servo"), [(0.0, 1.0), (0.3, 0.9)]
    recording = hopform.identify.record(robot, "motion", u=steps, duration=0.5, seed=1)
    motion = servo.solve_motion(robot, u=steps, horizon=0.5 * (1.0 + 1e-9))
    drive = recording.named("i")
    assert (drive.title, drive.quantity) == ("i_A", "current") and recording.named("target") is None
    np.testing.assert_array_equal(drive.values, motion.current(recording.time))


def test_a_model_without_a_law_has_no_target():
    with pytest.raises(hopform.HopformError, match="the model hopper has no law, and so no target"):
        hopform.solve_motion(hopform.load_robot("hopper_c"), start={"y": 0.02}).target(0.0)
