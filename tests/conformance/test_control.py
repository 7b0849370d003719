"""The controller: it finds the current, the least one, and nothing that a scan of all currents would improve on."""

import ctypes
import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hopform
from hopform._cli.tables import PRINTED
from hopform._solver import c as native
from hopform._solver.choice import DEFAULT
from hopform_solver.records import COMMANDS, STATUSES, LegState
from tests.conformance.currents import (
    NEARER,
    SMALLER,
    CurrentScan,
    Touchdown,
    compare,
    compare_single,
    draw_robot,
    draw_touchdowns,
)

HOPPER = hopform.load_robot("hopper_c")
AXIS = hopform.load_robot("hopper_b")
IDEAL = hopform.load_robot("ideal")
F64 = np.dtype(np.float64)


def drop(robot: hopform.Robot, height: float, h_des: float, **how: Any) -> hopform.Command:
    return hopform.choose_current(robot, v2=hopform.touchdown_velocity(robot, height), h_des=h_des, **how)


def with_fields(robot: hopform.Robot, **fields: float) -> hopform.Robot:
    values = {field.name: getattr(robot, field.name) for field in hopform.Robot.fields()}
    return hopform.Robot(**(values | fields))


# ---- against brute force ----


@pytest.mark.parametrize("robot", [HOPPER, AXIS], ids=lambda robot: robot.name)
def test_no_current_of_a_scan_is_smaller_or_nearer(robot):
    found = compare(robot, draw_touchdowns(robot, 424, 60), step=1e-3 * robot.u_max)
    assert len(found.statuses) == 3, "the draw must reach, miss, and find no take-off"
    assert not found.untrue
    assert not found.smaller
    assert not found.nearer


def test_a_scan_sees_an_answer_that_is_not_the_least_or_not_the_nearest(monkeypatch):
    """The scan must be able to fail: it is shown answers that are admissible and worse."""
    touchdowns = draw_touchdowns(HOPPER, 424, 30)
    lazy = replace(drop(HOPPER, 0.2, 0.2), u=HOPPER.u_max, apex=math.nan, status="nearest")
    monkeypatch.setattr("tests.conformance.currents.choose_current", lambda *_, **__: lazy)
    found = compare(HOPPER, touchdowns, step=0.01)
    assert len(found.nearer) > 15
    assert len(found.untrue) == 30


@pytest.mark.parametrize("robot", [HOPPER, AXIS], ids=lambda robot: robot.name)
def test_single_precision_reaches_the_apex_in_the_double_precision_model(robot):
    found = compare_single(robot, draw_touchdowns(robot, 99, 300))
    assert not found.single
    assert 0.0 < found.worst_single <= 1e-5


# ---- what is known of hopper_c ----


@pytest.mark.parametrize(("u", "apex"), [(0.0, 0.1182), (1.25, 0.1162), (2.0, 0.1399), (3.0, 0.2233)])
def test_a_current_is_found_back_from_its_apex_or_a_smaller_one_is(u, apex):
    assert hopform.next_apex(HOPPER, 0.2, u) == pytest.approx(apex, abs=1e-4)
    command = drop(HOPPER, 0.2, hopform.next_apex(HOPPER, 0.2, u))
    assert command.status == "reached"
    assert abs(command.u) <= u + 1e-6
    assert command.apex == pytest.approx(hopform.next_apex(HOPPER, 0.2, u), abs=1e-9)


def test_of_two_currents_with_one_apex_the_smaller_is_chosen():
    apex = float(hopform.next_apex(HOPPER, 0.2, 1.0))
    wide = np.linspace(1.25, 2.0, 2001)
    second = wide[np.argmin(np.abs(hopform.next_apex(HOPPER, 0.2, wide) - apex))]
    assert second > 1.3
    assert drop(HOPPER, 0.2, apex).u == pytest.approx(1.0, abs=1e-6)


def test_an_apex_that_lies_in_the_gap_is_not_reached():
    """From 2 cm no current takes off between about 0.82 and 1.37 A: 0.28 cm below that, 2.3 cm above it."""
    for h_des, u, apex in ((0.01, 0.8125, 0.0028), (0.02, 1.378, 0.023)):
        command = drop(HOPPER, 0.02, h_des)
        assert command.status == "nearest"
        assert command.u == pytest.approx(u, abs=0.01)
        assert command.apex == pytest.approx(apex, abs=3e-4)


def test_beyond_the_largest_apex_the_limit_is_the_nearest():
    command = drop(HOPPER, 0.2, 1.0)
    assert (command.status, command.u) == ("nearest", HOPPER.u_max)


def test_the_least_apex_is_that_of_the_fold():
    command = drop(HOPPER, 0.2, 0.0)
    u = np.linspace(-3.0, 3.0, 6001)
    assert command.status == "nearest"
    assert command.apex <= np.nanmin(hopform.next_apex(HOPPER, 0.2, u)) + 1e-12
    assert abs(scanned_slope(HOPPER, 0.2, command.u)) < 1e-4


def scanned_slope(robot: hopform.Robot, height: float, u: float) -> float:
    stance = hopform.solve_stance(robot, v2=hopform.touchdown_velocity(robot, height), u=u)
    return float(stance.sensitivities["apex", "u"])


def test_heights_count_from_the_datum():
    flat = drop(HOPPER, 0.2, 0.18)
    step = drop(HOPPER, 0.2, 0.15, datum=0.03)
    assert (step.u, step.status) == (flat.u, "reached")
    assert step.apex == pytest.approx(0.15, abs=1e-12)


def test_the_stroke_limits_and_the_margin_more_so():
    free = drop(HOPPER, 0.2, 0.3)
    for margin in (0.05, 0.06):
        command = drop(HOPPER, 0.2, 0.3, stop_margin=margin)
        stance = hopform.solve_stance(HOPPER, v2=hopform.touchdown_velocity(HOPPER, 0.2), u=command.u)
        peak = max(stance.end.x1, *(phase.state.x1 for phase in stance.phases))
        assert command.status == "nearest"
        assert 0.0 < HOPPER.x1_max - margin - peak < 1e-9
        assert command.apex < free.apex


# ---- robots that cannot choose ----


def test_a_locked_actuator_makes_currents_alike():
    assert drop(IDEAL, 0.2, 0.2).status == "reached"
    command = drop(IDEAL, 0.2, 0.25)
    assert (command.status, command.u, command.solved) == ("nearest", 0.0, 1)
    assert command.apex == pytest.approx(0.2, abs=1e-12)


def test_without_current_there_is_one_apex():
    command = drop(with_fields(HOPPER, u_max=0.0), 0.2, 0.2)
    assert (command.status, command.u, command.solved) == ("nearest", 0.0, 1)


def test_a_leg_that_never_takes_off_gets_no_current():
    command = drop(with_fields(HOPPER, u_max=0.1), 0.001, 0.1)
    assert (command.status, command.u) == ("no_takeoff", 0.0)
    assert math.isnan(command.apex)


def test_a_stroke_that_is_used_up_admits_no_current():
    command = hopform.choose_current(HOPPER, x1=0.07, v2=-2.0, h_des=0.2, stop_margin=0.02)
    assert (command.status, command.u) == ("no_takeoff", 0.0)


def test_a_held_actuator_is_proven_to_be_held_between_two_currents():
    """At its lower stop every negative current leaves it there: one trial settles all of them."""
    apex = float(hopform.next_apex(HOPPER, 0.2, 0.0))
    assert hopform.next_apex(HOPPER, 0.2, -3.0) == apex
    assert drop(HOPPER, 0.2, 0.22).solved < 20


# ---- what is refused ----


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"h_des": -0.01}, "h_des + datum must be >= 0 m, the apex must not lie below the ground, got -0.01"),
        ({"h_des": 0.1, "datum": -0.2}, "h_des + datum must be >= 0 m"),
        ({"h_des": math.nan}, "h_des must be finite m, got nan"),
        ({"h_des": 0.1, "datum": math.inf}, "datum must be finite m"),
        ({"h_des": 0.1, "stop_margin": -1e-3}, "stop_margin must be >= 0 m, got -0.001"),
        ({"h_des": 0.1, "x1": 0.2}, "x1 must be within its stroke"),
        ({"h_des": 0.1, "v1": math.nan}, "v1 must be finite"),
        ({"h_des": 0.1, "x2": 1.0}, "x2 must be <="),
        ({"h_des": 0.1, "horizon": 0.0}, "horizon must be > 0 s"),
        ({"h_des": "high"}, "h_des must be a number in m"),
        ({"h_des": 0.1, "dtype": "int32"}, "dtype must be"),
    ],
)
def test_what_is_not_allowed_is_named(options, expected):
    with pytest.raises(hopform.HopformError) as caught:
        hopform.choose_current(HOPPER, v2=-2.0, **options)
    assert expected in str(caught.value)


@pytest.mark.parametrize(("field", "value"), [("g", 0.0), ("u_max", math.inf)])
def test_a_robot_without_gravity_or_limit_is_refused(field, value):
    with pytest.raises(hopform.HopformError, match=field):
        hopform.choose_current(with_fields(HOPPER, **{field: value}), v2=-2.0, h_des=0.2)


@pytest.mark.parametrize(
    "call",
    [
        lambda: hopform.choose_current("hopper_c", v2=-2.0, h_des=0.2),
        lambda: hopform.choose_current_as_printed("hopper_c", v2=-2.0, h_des=0.2),
        lambda: hopform.solve_flight("hopper_c", v2=1.0),
        lambda: hopform.solve_stance("hopper_c", v2=-1.0),
        lambda: hopform.reachability("hopper_c", [0.1], [1.0]),
    ],
)
def test_the_name_of_a_robot_is_no_robot(call):
    with pytest.raises(hopform.HopformError, match="robot must be a Robot, as load_robot gives it, got 'hopper_c'"):
        call()


@pytest.mark.parametrize(("grid", "expected"), [(0.0, "grid must be > 0 A"), (1e-12, "grid must be >= 3e-06 A")])
def test_a_grid_that_no_memory_would_hold_is_refused(grid, expected):
    with pytest.raises(hopform.HopformError, match=expected):
        hopform.choose_current_as_printed(HOPPER, v2=-2.0, h_des=0.2, grid=grid)


# ---- one piece of work per tick ----


class Resumable:
    """The C library's search, tick by tick."""

    def __init__(
        self, robot: hopform.Robot, start: LegState, target: tuple[float, ...], dtype: Any = np.float64
    ) -> None:
        self.library = native.library()
        self.types = self.library.types(np.dtype(dtype))
        self.plan = native.plan_of(self.types, robot.parameters)
        target_type, command_type, search_type = self.types.Target, self.types.Command, self.types.Search
        self.search, self.command = search_type(), command_type()
        self.phases = (self.types.Phase * 256)()
        self.status = self.library.call(
            "choose_current_begin", self.types, ctypes.byref(self.search), self.plan,
            ctypes.byref(self.types.State(*start)), ctypes.byref(target_type(*target)), ctypes.byref(self.command),
        )  # fmt: skip

    def near(self, u: float) -> int:
        return self.library.call("choose_current_near", self.types, ctypes.byref(self.search), self.types.real(u))

    def step(self, capacity: int = 256) -> int:
        self.status = self.library.call(
            "choose_current_step", self.types, ctypes.byref(self.search), self.phases, ctypes.c_int32(capacity),
            ctypes.byref(self.command),
        )  # fmt: skip
        return self.status


def test_the_search_may_be_left_after_any_tick_and_holds_a_safe_current():
    scan = CurrentScan(HOPPER)
    for touchdown in draw_touchdowns(HOPPER, 5, 20):
        start = LegState(touchdown.x1, touchdown.v1, touchdown.v2, touchdown.y)
        search = Resumable(HOPPER, start, (touchdown.h_des, touchdown.datum, touchdown.stop_margin, 2.0))
        assert (search.status, search.command.u) == (3, 0.0)
        gaps, ticks = [math.inf], 0
        while search.status == 3:
            search.step()
            ticks += 1
            assert search.search.trials == ticks, "one stance a tick"
            if COMMANDS[search.command.status] == "no_takeoff":
                assert search.command.u == 0.0
            else:
                gaps.append(abs(scan.gap(touchdown, search.command.u)))
        assert gaps == sorted(gaps, reverse=True) or gaps[-1] <= 2e-10
        whole = touchdown.ask(HOPPER)
        assert (search.command.u, ticks) == (whole.u, whole.solved)
        assert search.step() == 0, "a search that is done stays done"


def test_the_answer_is_held_at_the_fourth_candidate():
    """To 1e-5 A, in the median of drops of 10 to 25 cm that are to come back within 1 cm; the rest is proof."""
    draw, held = np.random.default_rng(2), []
    for _ in range(100):
        height = draw.uniform(0.1, 0.25)
        start = LegState(0.0, 0.0, hopform.touchdown_velocity(HOPPER, height), 0.0)
        search = Resumable(HOPPER, start, (height + draw.uniform(-0.01, 0.01), 0.0, 0.0, 2.0))
        currents = list[float]()
        while search.status == 3:
            search.step()
            currents.append(search.command.u)
        far = [n for n, u in enumerate(currents, start=1) if abs(u - currents[-1]) > 1e-5]
        held.append(max(far, default=0) + 1)
    assert np.median(held) == 4.0


def ended(robot: hopform.Robot, touchdown: Touchdown, near: float = 0.0, dtype: Any = np.float64) -> Resumable:
    """A search that has come to its end, begun near a current."""
    start = LegState(touchdown.x1, touchdown.v1, touchdown.v2, touchdown.y)
    search = Resumable(robot, start, (touchdown.h_des, touchdown.datum, touchdown.stop_margin, 2.0), dtype)
    assert search.near(near) == 3
    while search.step() == 3:
        pass
    return search


@pytest.mark.parametrize("robot", [HOPPER, AXIS, *map(draw_robot, range(12))], ids=lambda robot: robot.name)
def test_a_command_does_not_depend_on_the_current_that_its_search_begins_near(robot):
    """By more than its tolerance: one current is as good as another where the apex does not change between them."""
    draw, scan = np.random.default_rng(11), CurrentScan(robot)
    for touchdown in draw_touchdowns(robot, 7, 12):
        cold = ended(robot, touchdown)
        u, status = cold.command.u, COMMANDS[cold.command.status]
        for near in (draw.uniform(-1.0, 1.0) * robot.u_max, 1.02 * u, -u, 1e-3 * robot.u_max):
            warm = ended(robot, touchdown, near)
            assert (warm.status, COMMANDS[warm.command.status]) == (cold.status, status)
            if status == "no_takeoff":
                assert warm.command.u == 0.0
                continue
            off, other = scan.gap(touchdown, u), scan.gap(touchdown, warm.command.u)
            assert abs(other) == pytest.approx(abs(off), abs=NEARER)
            sizes = sorted((abs(u), abs(warm.command.u)))
            if status == "reached" and sizes[1] - sizes[0] > SMALLER:
                between = np.linspace(*sizes, 9) * math.copysign(1.0, u)
                assert max(abs(scan.gap(touchdown, each)) for each in between) < NEARER


@pytest.mark.parametrize(("dtype", "share"), [(np.float64, 0.9), (np.float32, 1.0)])
def test_a_command_near_the_last_one_takes_fewer_stances(dtype, share):
    """Drops of 5 to 25 cm that are to come back within 1 cm, each command asked again 1 % faster: 6.5 for 7.6; in single
    precision, which ends earlier, 6.4 for 6.6.
    """
    draw, stances = np.random.default_rng(3), list[tuple[int, ...]]()
    for _ in range(100):
        height = draw.uniform(0.05, 0.25)
        wish = height + draw.uniform(-0.01, 0.01)
        last = Touchdown(0.0, 0.0, hopform.touchdown_velocity(HOPPER, height), 0.0, wish, 0.0, 0.0)
        before = ended(HOPPER, last, dtype=dtype)
        if COMMANDS[before.command.status] == "reached":
            now, u = replace(last, v2=1.01 * last.v2), before.command.u
            stances.append(tuple(ended(HOPPER, now, near, dtype).search.trials for near in (0.0, u)))
    cold, warm = np.mean(stances, axis=0)
    assert warm < share * cold


def test_a_current_that_no_search_may_begin_near_changes_nothing():
    touchdown = Touchdown(0.0, 0.0, -1.93, 0.0, 0.15, 0.0, 0.0)
    whole = ended(HOPPER, touchdown)
    for near in (math.nan, math.inf, -math.inf, 0.0, HOPPER.u_max, -2.0 * HOPPER.u_max):
        search = ended(HOPPER, touchdown, near)
        assert (search.search.trials, bytes(search.command)) == (whole.search.trials, bytes(whole.command))
    assert whole.near(1.0) == 0, "a search that is done stays done"


def test_a_search_that_outgrows_its_memory_tries_again_what_it_has_forgotten():
    """The stop is met or not, and the leg takes off or not, in many places: more intervals wait than candidates fit."""
    touchdown = Touchdown(0.0716771, 0.0340046, -0.570327, 0.00435013, 0.0460747, 0.0346686, 0.0)
    start = LegState(touchdown.x1, touchdown.v1, touchdown.v2, touchdown.y)
    search = Resumable(HOPPER, start, (touchdown.h_des, touchdown.datum, touchdown.stop_margin, 2.0))
    room, counts = len(search.search.candidates), list[int]()
    while search.status == 3:
        search.step()
        counts.append(search.search.count)
    assert (search.status, max(counts)) == (0, room)
    found = compare(HOPPER, [touchdown], step=1e-3)
    assert found.statuses == {"nearest": 1}
    assert not found.nearer


def test_a_stance_that_outgrows_the_memory_is_said_to_be_left_out():
    search = Resumable(HOPPER, LegState(0.0, 0.0, -0.6, 0.0), (0.05, 0.0, 0.0, 2.0))
    while search.step(capacity=3) == 3:
        pass
    assert search.status == native.PHASES_NOT_KEPT


CAPPED = next(code for code, word in STATUSES.items() if word == "capped")


def searched(target: tuple[float, ...], v2: float = -1.93) -> Resumable:
    search = Resumable(HOPPER, LegState(0.0, 0.0, v2, 0.0), target)
    while search.status == 3:
        search.step()
    return search


def test_a_search_ends_with_the_best_current_of_the_candidates_that_it_may_try():
    whole = searched((0.15, 0.0, 0.0, 2.0))
    for most in range(1, whole.search.trials):
        part = Resumable(HOPPER, LegState(0.0, 0.0, -1.93, 0.0), (0.15, 0.0, 0.0, 2.0))
        for _ in range(most):
            part.step()
        capped = searched((0.15, 0.0, 0.0, 2.0, 0, most))
        assert (capped.status, capped.search.trials) == (CAPPED, most)
        assert bytes(capped.command) == bytes(part.command)
    assert (whole.status, searched((0.15, 0.0, 0.0, 2.0, 0, whole.search.trials)).status) == (0, 0)


def test_a_candidate_that_takes_more_evaluations_than_it_may_is_left_out():
    """What is commanded is what its stance does; with enough evaluations every bit is that without a cap."""
    target = (0.15, 0.0, 0.0, 2.0)
    whole, statuses = searched(target), set[int]()
    for most in range(1, 60):
        capped = searched((*target, most, 0))
        statuses.add(capped.status)
        if COMMANDS[capped.command.status] == "no_takeoff":
            assert (capped.status, capped.command.u) == (CAPPED, 0.0)
        else:
            stance = hopform.solve_stance(HOPPER, v2=-1.93, u=capped.command.u)
            assert stance.apex == pytest.approx(capped.command.apex, abs=1e-12)
        assert capped.status == CAPPED or bytes(capped.command) == bytes(whole.command)
    assert statuses == {0, CAPPED}


def test_a_phase_counts_as_what_it_takes_beside_an_evaluation():
    """A body that swings from rest to rest beside an actuator that is held asks for hardly an evaluation; a phase is 4."""
    held = with_fields(HOPPER, u_max=0.0, b2=1.0, f1=50.0, f2=0.0)
    y = 1.5 * held.m_s * held.g / held.k
    phases = len(hopform.solve_stance(held, v2=-0.05, x2=held.L0 + held.c - y).phases)
    statuses = []
    for most in (4 * phases, 5 * phases):
        search = Resumable(held, LegState(0.0, 0.0, -0.05, y), (0.15, 0.0, 0.0, 2.0, most, 0))
        statuses.append(search.step())
    assert phases > 10
    assert statuses == [CAPPED, 0]


@pytest.mark.parametrize("cap", [(-1, 0), (0, -1)])
def test_a_negative_cap_is_refused(cap):
    with pytest.raises(hopform.HopformError):
        Resumable(HOPPER, LegState(0.0, 0.0, -2.0, 0.0), (0.1, 0.0, 0.0, 2.0, *cap))


@pytest.mark.parametrize("target", [(math.nan, 0.0, 0.0, 2.0), (-0.1, 0.0, 0.0, 2.0), (0.1, 0.0, -1.0, 2.0),
                                    (0.1, 0.0, 0.0, 0.0), (0.1, math.inf, 0.0, 2.0)])  # fmt: skip
def test_the_library_refuses_what_it_is_asked_and_leaves_a_safe_current(target):
    with pytest.raises(hopform.HopformError):
        Resumable(HOPPER, LegState(0.0, 0.0, -2.0, 0.0), target)


def test_a_bad_state_ends_the_search_with_a_safe_current():
    search = Resumable(HOPPER, LegState(0.0, math.nan, -2.0, 0.0), (0.1, 0.0, 0.0, 2.0))
    with pytest.raises(hopform.HopformError):
        search.step()
    assert search.command.u == 0.0
    assert COMMANDS[search.command.status] == "no_takeoff"


# ---- the stance of a tried current ----


@pytest.mark.parametrize(
    ("robot", "start"),
    [
        (HOPPER, LegState(0.0, 0.0, -1.93, 0.0)),
        (HOPPER, LegState(0.05, -0.2, -0.6, 0.004)),
        (HOPPER, LegState(0.02, 0.1, -0.63, 0.0)),
        (AXIS, LegState(0.01, 0.2, -1.2, 0.0)),
    ],
    ids=["a drop", "compressed", "a low drop", "an axis"],
)
def test_slopes_are_those_of_the_values(robot, start):
    u = np.linspace(-0.97, 0.93, 20) * robot.u_max
    h = 1e-6 * robot.u_max
    around = np.concatenate([u - h, u, u + h])
    c = DEFAULT.compiled().try_currents(robot.parameters, [start], around, 2.0, 4096)[0]
    below, at, above = np.split(c, 3)
    alike = (below["events"] == at["events"]) & (at["events"] == above["events"]) & at["smooth"]
    assert alike.sum() > 10
    for name in ("apex", "largest_x1", "least_contact"):
        known = alike & np.isfinite(at[name]) & (np.abs(at[name]) < 1e3)
        slope = (above[name] - below[name]) / (2.0 * h)
        assert np.allclose(at[f"{name}_u"][known], slope[known], atol=2e-6, rtol=2e-4)
    lifts = np.flatnonzero(at["takes_off"] & at["smooth"])
    for lane in lifts[:5]:
        x2 = start.x1 - start.y + robot.L0 + robot.c
        stance = hopform.solve_stance(robot, x1=start.x1, v1=start.v1, v2=start.v2, x2=x2, u=at["u"][lane])
        assert at["apex_u"][lane] == pytest.approx(stance.sensitivities["apex", "u"], abs=1e-9)


def test_a_rebound_that_nearly_takes_off_is_seen_as_a_dip():
    """Where take-offs end (2 cm drop, 0.82 A) the least spring of the rebound passes zero."""
    start = LegState(0.0, 0.0, hopform.touchdown_velocity(HOPPER, 0.02), 0.0)
    found = DEFAULT.compiled().try_currents(HOPPER.parameters, [start], np.linspace(0.70, 0.95, 2501), 2.0, 4096)[0]
    edge = int(np.flatnonzero(found["takes_off"][:-1] & ~found["takes_off"][1:])[0])
    assert found["least_contact"][edge + 1] < 1e-5
    assert np.all(found["least_contact"][edge + 1 : edge + 200] > 0.0)


@pytest.mark.parametrize(("low", "high"), [(0.0, 0.1), (0.3, 0.4)], ids=["ends", "begins"])
def test_the_least_contact_force_goes_on_below_zero_where_a_rebound_takes_off(low, high):
    """Without a minimum before it a take-off has one behind it, if the contact could pull: one function of u."""
    start, u = LegState(0.02, 0.1, -0.63, 0.0), np.linspace(low, high, 20001)
    found = DEFAULT.compiled().try_currents(HOPPER.parameters, [start], u, 2.0, 4096)[0]
    (edge,) = np.flatnonzero(found["takes_off"][:-1] != found["takes_off"][1:])
    least, slope = found["least_contact"], found["least_contact_u"]
    assert np.array_equal(least < 0.0, found["takes_off"])
    assert abs(least[edge + 1] - least[edge]) == pytest.approx(abs(slope[edge]) * (u[1] - u[0]), rel=1e-3)
    assert slope[edge + 1] == pytest.approx(slope[edge], rel=1e-3)


# ---- as printed ----


def printed(height: float, h_des: float, **how: Any) -> hopform.PrintedCommand:
    v2 = hopform.touchdown_velocity(HOPPER, height)
    return hopform.choose_current_as_printed(HOPPER, v2=v2, h_des=h_des, **how)


@pytest.mark.parametrize("datum", [-0.03, 0.0, 0.03])
def test_with_everything_put_right_the_printed_controller_is_the_exact_one_up_to_its_grid(datum):
    for h_des in (0.15, 0.16, 0.165):
        found = printed(0.2, h_des, datum=datum, half=False, signed=True, spring_coordinate=True, grid=1e-3)
        exact = drop(HOPPER, 0.2, h_des, datum=datum)
        assert exact.status == "reached"
        assert found.apex == pytest.approx(h_des, abs=1e-4)
        assert found.objective == pytest.approx(HOPPER.m_s * HOPPER.g * abs(found.apex - h_des), abs=1e-12)
        assert found.u / 1e-3 == pytest.approx(round(found.u / 1e-3), abs=1e-6) and found.u != 0.0


def test_the_spring_coordinate_that_is_left_out_costs_centimetres():
    errors = {h_des: printed(0.2, h_des).apex - h_des for h_des in (0.15, 0.18, 0.2, 0.22)}
    assert errors[0.2] == pytest.approx(-0.0141, abs=5e-4)
    assert all(a > b for a, b in zip(errors.values(), list(errors.values())[1:], strict=False))


@pytest.mark.parametrize(("datum", "error"), [(-0.03, 0.015), (0.03, -0.045)])
def test_the_half_of_26_misses_half_a_step_down_and_all_of_a_step_up(datum, error):
    found = printed(0.2, 0.15, datum=datum, spring_coordinate=True, grid=1e-3)
    assert found.apex - 0.15 == pytest.approx(error, abs=2e-4)


def test_the_printed_objective_is_the_general_one_with_its_defaults():
    from hopform_solver import formulas

    state = LegState(0.01, 0.0, -1.5, 0.0)
    one = formulas.printed_objective(HOPPER.parameters, state, 1.2, 0.2, -0.04)
    two = formulas.objective(HOPPER.parameters, state, 1.2, 0.03, 0.2, 0.5 * 0.04, 0.0)
    assert one == pytest.approx(two, abs=1e-14)


def test_of_equal_currents_the_printed_controller_takes_the_least():
    """A locked actuator feels no current: J is the same for all of the grid, and the least |u| is 0."""
    locked = with_fields(HOPPER, x1_min=0.0, x1_max=0.0)
    found = hopform.choose_current_as_printed(locked, v2=-2.0, h_des=0.2)
    assert (found.status, found.u) == ("found", 0.0)


def test_without_take_off_the_printed_controller_has_no_current():
    found = hopform.choose_current_as_printed(with_fields(HOPPER, u_max=0.1), v2=-0.13, h_des=0.1)
    assert (found.status, found.u) == ("no_takeoff", 0.0)
    with pytest.raises(hopform.HopformError, match="grid must be > 0 A"):
        printed(0.2, 0.2, grid=0.0)


# ---- docs/evidence/controller.md ----

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "evidence" / "controller.md"


def printed_errors(datum: float, count: int) -> dict[str, np.ndarray]:
    """|apex - h_des| [cm] of each printed form, at drops from which h_des is reachable."""
    draw = np.random.default_rng(17)
    errors: dict[str, list[float]] = {form: [] for form in PRINTED}
    while len(errors["all three"]) < count:
        height, h_des = draw.uniform(0.05, 0.3), draw.uniform(0.05, 0.25)
        if drop(HOPPER, height, h_des, datum=datum).status == "reached":
            for form, options in PRINTED.items():
                apex = printed(height, h_des, datum=datum, **options).apex
                errors[form].append(100.0 * abs(apex - h_des))
    return {form: np.array(found) for form, found in errors.items()}


@pytest.mark.sliced
def test_the_errors_of_the_printed_forms_are_those_of_the_page():
    rows = re.findall(r"^\| ([^|]+) \|" + r" ([\d.]+) \|" * 6 + "$", DOCUMENT.read_text("utf-8"), re.MULTILINE)
    page = {form: [float(cell) for cell in cells] for form, *cells in rows}
    assert set(page) == set(PRINTED)
    for column, datum in enumerate((0.0, 0.03, -0.03)):
        for form, found in printed_errors(datum, 200).items():
            assert found.mean() == pytest.approx(page[form][2 * column], abs=0.006)
            assert found.max() == pytest.approx(page[form][2 * column + 1], abs=0.006)


def test_arbitrary_bits_give_an_error_or_a_finite_safe_command():
    draw = np.random.default_rng(20)
    refused = 0
    for dtype, words in ((np.float32, np.uint32), (np.float64, np.uint64)):
        for _ in range(200):
            with np.errstate(invalid="ignore"):
                bits = draw.integers(0, np.iinfo(words).max, size=8, dtype=words).view(dtype).astype(float)
            keep = draw.random(8) < 0.7
            values = np.where(keep, [0.0, 0.0, -1.5, 0.0, 0.2, 0.0, 0.0, 2.0], bits).tolist()
            try:
                search = Resumable(HOPPER, LegState(*values[:4]), tuple(values[4:]), dtype)
                for _ in range(400):
                    if search.step() != 3:
                        break
                command = search.command
            except hopform.HopformError:
                refused += 1
                continue
            assert abs(command.u) <= HOPPER.u_max
            assert math.isfinite(command.apex)
    assert 50 < refused < 350
