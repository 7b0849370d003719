"""The FMUs of the models that ship, driven by FMPy: whatever the communication steps, states and events are those of
`solve_motion`, with the importer's own instants as times of its steps.
"""

import math
import random
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from fmpy.validation import validate_fmu
from mpmath import mp

import hopform
from hopform import _fmu
from hopform._motion import energies_of, masses_of
from tests import needs
from tests.conformance.firmware.targets import ROOT
from tests.conformance.test_step_gradients import drawn
from tests.conformance.zoo import EQUATIONS, Case, cases
from tests.derived import SHIPPED, solver_of
from tests.fmus import TAKEOFF, TOUCHDOWN, Course, Fmu, Happened, Refused, coordinates, described, unpacked
from tests.oracle.joint import DIGITS, PARAMETERS, Joint
from tests.seeds import SEED

pytestmark = [needs.library, pytest.mark.sliced]
STANDS = ("hopper", "leg_damper", "second_spring", "cable", "back_emf")
"""Models with a contact."""
EVERY = needs.at_night([*EQUATIONS], "back_emf", "cable", "second_spring", "slide", "cart", "pendulum", "sea_held")
"""All models that ship: their FMUs take seconds to compile, and those of one kind of equations are alike."""
STEPS = (0.1, 0.01, 0.001)
"""[s] communication steps."""
EPS = float(np.finfo(float).eps)
STATE_ULPS, EVENT_ULPS = 32, 4
"""What a state may differ by, of its scale, and an event's time, of the horizon, under few changes."""
MOST_STEPS = 300
"""Communication steps of a run, at most: the first ones of a long one."""
SOLVED_AHEAD = 64
"""Phases; beyond, a motion is solved on from where it is."""


def solver(store: Any, name: str) -> Any:
    return hopform.load_solver(name) if name == "hopper" else solver_of(store, SHIPPED / f"{name}.py")


OF_A_LEG: dict[str, dict[str, float]] = {
    "hopper": {}, "leg_damper": {"b12": 20.0}, "second_spring": {"k_2": 100.0, "L_2": 0.4}, "cable": {"F_cable": 5.0},
    "back_emf": {"k_emf": 15.0},
}  # fmt: skip
"""What models with a contact have beside a hopper."""


def robot_of(store: Any, name: str) -> Any:
    """The robot of a model's FMU; other cases set theirs."""
    made = solver(store, name)
    return (
        made.load_robot("hopper_c").with_parameters(OF_A_LEG[name])
        if name in STANDS
        else made.Robot(**case_of(name).robot)
    )


def case_of(name: str) -> Case:
    """A case whose numbers are the robot of the model's FMU."""
    return next(cases(name, 3, 1, 3e2))


def input_of(robot: Any) -> str | None:
    """The name of a robot's input."""
    return next((each["name"] for each in robot.solver.facts.inputs), None)


def targets_of(horizon: float, size: float) -> list[float]:
    """Multiples of a step up to a horizon, and that where it is among the first."""
    count = math.ceil(horizon / size)
    return [n * size for n in range(1, min(count, MOST_STEPS + 1))] + ([horizon] if count <= MOST_STEPS else [])


def scales(motion: Any) -> np.ndarray:
    """Of each coordinate and velocity of a motion its largest size; the second coordinate is carried as the stretch, from
    the first one.
    """
    samples = np.array([motion.at(t) for t in np.linspace(0.0, motion.duration, 65)], float)
    scale = np.abs(samples).max(axis=0) + 1e-300
    scale[::2] = scale[::2].max()
    return scale


def before_end(course: Course, motion: Any) -> list[tuple[float, tuple[float, ...]]]:
    """Communication points at which the motion says where it is."""
    return [
        (t, state)
        for t, state in zip(course.times, course.states, strict=True)
        if t <= motion.duration or motion.status == "rest"
    ]


def kinds_at(motion: Any, end: float) -> list[tuple[float, str]]:
    """Events of a motion up to a time, with its take-off."""
    found = [(event.time, event.kind) for event in motion.events if event.time > 0.0]
    if motion.status == "takeoff":
        found.append((motion.duration, "takeoff"))
    return [(t, kind) for t, kind in found if t <= end]


def words_of(robot: Any) -> dict[int, str]:
    return {number: word for number, word in _fmu.enumerations(robot.solver)["Event"].items()}


def deviation(course: Course, motion: Any, end: float, horizon: float) -> tuple[float, float]:
    """By how many units in the last place states differ at most, of their scale, and times of events, of a horizon; kinds
    and number of these are the same.
    """
    scale, worst, late, place = scales(motion), 0.0, 0.0, 0
    for t, state in before_end(course, motion):
        worst = max(worst, float(np.max(np.abs(np.subtract(state, motion.at(t))) / scale)))
    expected, words = kinds_at(motion, end), words_of(motion.robot)
    for stop in (each for each in course.stops if each.count):
        here = expected[place : place + stop.count]
        place += stop.count
        assert here and words[stop.event] == here[-1][1], (stop, expected)
        late = max(late, *(abs(stop.time - t) for t, _ in here))
    assert place == len(expected), (course.stops, expected)
    return worst / EPS, late / EPS / horizon


def end_of(motion: Any, last: float) -> float:
    """Up to where a course and a motion are compared: the last communication point, or a take-off."""
    return min(last, motion.duration) if motion.status == "takeoff" else last


def begun(fmu: Fmu, case: Case, robot: Any, u: float, **how: Any) -> Fmu:
    name = input_of(robot)
    return fmu.begin({**case.robot, **case.start, **({name: u} if name else {})}, **how)


# ---- what a description says ----


@pytest.mark.parametrize("name", EVERY)
def test_fmpys_validator_finds_nothing(store, name):
    robot = robot_of(store, name)
    assert validate_fmu(str(unpacked(store, robot))) == []
    platform = _fmu.this_platform()
    assert platform is None or (unpacked(store, robot) / "binaries" / platform).is_dir()


# ---- steps ----


@pytest.mark.parametrize("name", EVERY)
def test_any_communication_step_gives_the_bits_of_the_motion(store, name):
    """Under a constant input: states and times of events, the values on both sides of each, and which event comes next."""
    robot, made, seen = robot_of(store, name), solver(store, name), 0
    names, folder = coordinates(robot), unpacked(store, robot)
    for number, case in enumerate(cases(name, 11, 6, 2e3)):
        u, own, size = case.steps[0][1], made.Robot(**case.robot), STEPS[number % 3]
        motion = hopform.solve_motion(own, start=case.start, u=u, horizon=case.horizon)
        targets = targets_of(case.horizon, size)
        announced = list[float]()

        def seen_at(happened: Happened, told: Any, announced: list[float] = announced) -> None:
            announced.append(told.next_event)

        with Fmu(folder) as fmu:
            begun(fmu, case, robot, u, stop=case.horizon)
            announced.append(fmu["next_event"])
            course = fmu.run(targets, names, seen=seen_at, last=TAKEOFF)
        expected = kinds_at(motion, targets[-1])
        if len(motion.phases) > SOLVED_AHEAD:
            continue
        assert [(t, state) for t, state in before_end(course, motion)] == [
            (t, tuple(motion.at(t))) for t, _ in before_end(course, motion)
        ], case
        assert course.event_times == [t for t, _ in expected], case
        scale = scales(motion)
        for stop, told in zip(course.stops, announced, strict=False):
            assert stop.time == told
            before, earlier = (np.array(motion.at(stop.time * (1.0 - n * EPS))) for n in (0.5, 4))
            allowed = 16 * EPS * scale + 2.0 * np.abs(
                before - earlier
            )  # and what happens within the rounding of the time
            assert np.all(np.abs(np.subtract(stop.left, before)) <= allowed), (stop, before)
            if stop.event == TAKEOFF:  # behind it is the flight, by its own formulas
                assert np.all(np.abs(np.subtract(stop.right, motion.at(stop.time))) <= 4 * EPS * scale)
                continue
            assert stop.right == tuple(motion.at(stop.time))
            if "hits_stop" in words_of(robot)[stop.event]:
                assert abs(stop.left[1]) > 0.0 == stop.right[1]
        seen += len(course.stops)
    assert seen > 3


@pytest.mark.parametrize("name", EVERY)
def test_an_input_that_changes_at_any_time_is_a_step_of_the_motion(store, name):
    """Few changes: what both round stays within units in the last place, and the events are the same."""
    robot, made, draw = robot_of(store, name), solver(store, name), random.Random(f"{name} changes")
    names, folder, driven = coordinates(robot), unpacked(store, robot), input_of(robot)
    assert driven is not None  # each model that ships has one
    for number, case in enumerate(cases(name, 12, 6, 3e2)):
        own, size = made.Robot(**case.robot), STEPS[number % 3]
        targets = targets_of(case.horizon, size)
        times = sorted(draw.uniform(0.0, targets[-1]) for _ in range(4))
        largest = max(abs(u) for _, u in case.steps)
        values = [draw.choice((0.0, 0.3, 1.0, 3.0)) * draw.choice((-1, 1)) * largest for _ in times]
        changes = [(t, {driven: u}) for t, u in zip(times, values, strict=True)]
        with Fmu(folder) as fmu:
            begun(fmu, case, robot, case.steps[0][1], stop=case.horizon)
            course = fmu.run(targets, names, changes, last=TAKEOFF)
        steps = [(0.0, case.steps[0][1]), *zip(course.changes, values, strict=False)]
        motion = hopform.solve_motion(own, start=case.start, u=steps, horizon=case.horizon)
        end = end_of(motion, targets[-1])
        states, events = deviation(course, motion, end, case.horizon)
        assert states <= STATE_ULPS and events <= EVENT_ULPS, (states, events, case)


# What a change adds: as a tick of a plant does (test_plant.py), the rounding of both motions and that of the times, which
# the motion counts from its start and the FMU from the latest change.
ULPS_OF_A_CHANGE = 8
OFTEN, MILLISECOND = 1000, 1e-3


def busy(store: Any, name: str) -> tuple[Any, dict[str, float], list[float]]:
    """A robot, a start, inputs of a millisecond each under which it has 20 events or more."""
    made, draw = solver(store, name), random.Random(f"{name} often")
    drawn_inputs = [draw.uniform(-1.0, 1.0) for _ in range(OFTEN)]
    own = robot_of(store, name)
    stands = (
        dict(zip(coordinates(own), (0.0, 0.0, 0.98 * own.standing_height, -1.93), strict=True))
        if name in STANDS
        else {}
    )
    for case in cases(name, 17, 20, 3e2):
        robot = own if stands else made.Robot(**case.robot)
        for size in (6.0,) if stands else (abs(case.steps[0][1]) * factor for factor in (2.0, 20.0)):
            steps = [(n * MILLISECOND, size * each) for n, each in enumerate(drawn_inputs)]
            start = stands or case.start
            motion = hopform.solve_motion(robot, start=start, u=steps, horizon=OFTEN * MILLISECOND)
            if len(motion.events) >= 20:
                return robot, start, [u for _, u in steps]
    raise AssertionError(f"no case of {name} has events")


@pytest.mark.parametrize("name", EVERY)
def test_an_input_that_changes_every_millisecond_is_a_motion_of_as_many_steps(store, name):
    """1000 changes, or up to a take-off: what a change adds is bounded for each of them, and for each event."""
    robot, start, values = busy(store, name)
    names, folder, driven = coordinates(robot), unpacked(store, robot_of(store, name)), input_of(robot)
    changes = [(n * MILLISECOND, {driven: u}) for n, u in enumerate(values)][1:]
    of_robot = {field.name: robot[field.name] for field in robot.fields()}
    horizon = OFTEN * MILLISECOND
    with Fmu(folder) as fmu:
        fmu.begin({**of_robot, **start, driven: values[0]}, stop=horizon)
        course = fmu.run([n * MILLISECOND for n in range(10, OFTEN + 1, 10)], names, changes, last=TAKEOFF)
    steps = [(0.0, values[0]), *zip(course.changes, values[1:], strict=False)]
    motion = hopform.solve_motion(robot, start=start, u=steps, horizon=horizon)
    states, events = deviation(course, motion, end_of(motion, horizon), horizon)
    assert max(states, events) <= ULPS_OF_A_CHANGE * (len(steps) + len(motion.events))
    assert len(steps) > 100 and len(motion.events) >= 20


@pytest.mark.parametrize("seed", [3, 8])
def test_an_fmu_is_no_further_from_the_truth_than_the_motion(store, seed):
    """20 steps of the current of a joint, against 50 digits."""
    draw, made = drawn(seed, 20), solver(store, "joint")
    robot = made.Robot(**dict(zip(PARAMETERS, draw.parameters, strict=True)))
    start = dict(zip(coordinates(robot), draw.start, strict=True))
    of_case = {field.name: robot[field.name] for field in robot.fields()}
    changes = [(t, {"i": i}) for t, i in zip(draw.times, draw.currents, strict=True)][1:]
    with Fmu(unpacked(store, robot_of(store, "joint"))) as fmu:
        fmu.begin({**of_case, **start, "i": draw.currents[0]}, stop=draw.horizon)
        course = fmu.run([draw.horizon], coordinates(robot), changes)
        end, times = course.times[-1], (0.0, *course.changes)
        found = fmu.get("q", "q_dot")
    motion = hopform.solve_motion(robot, start=start, u=[*zip(times, draw.currents, strict=True)], horizon=end)
    with mp.workdps(DIGITS):
        given = [[mp.mpf(each) for each in part] for part in (draw.start, draw.parameters, draw.currents, times)]
        exact = Joint(*given, end).solve()
        truth = np.array([exact.q.value, exact.v.value])
        off = [float(np.max(np.abs(truth - np.array(state, dtype=object)))) for state in (found, tuple(motion.at(end)))]
    assert exact.events == len(motion.events) or exact.events > 0
    scale = float(np.max(scales(motion)))
    assert off[0] <= max(2.0 * off[1], 16 * EPS * scale), (off, scale)


# ---- what is shown ----


@pytest.mark.parametrize("name", EVERY)
def test_forces_energies_and_modes_are_those_of_the_motion(store, name):
    """At communication points, to the bit; what an output shows at an event belongs to the side that it shows."""
    robot, made, compared = robot_of(store, name), solver(store, name), 0
    folder = unpacked(store, robot)
    for case in cases(name, 13, 3, 3e2):
        own, u = made.Robot(**case.robot), case.steps[0][1]
        motion = hopform.solve_motion(own, start=case.start, u=u, horizon=case.horizon)
        if len(motion.phases) > SOLVED_AHEAD:
            continue
        forces, energies = [*motion.forces(0.0)], [*energies_of(motion, 0.0)]
        modes = [f"mode_{mass.position}" for mass in masses_of(own.solver)]
        asked = [*forces, *(f"energy_{letter}" for letter in energies), *modes]
        end = motion.duration if motion.status == "takeoff" else case.horizon
        times = [end * part for part in (0.05, 0.11, 0.37, 0.52, 0.73, 0.94)]
        with Fmu(folder) as fmu:
            begun(fmu, case, robot, u, stop=case.horizon)
            course = fmu.run(times, asked, last=TAKEOFF)
        starts = [phase.start for phase in motion.phases]
        for t, values in zip(course.times, course.states, strict=True):
            if motion.status != "rest" and t > motion.duration:
                continue
            phase = motion.phases[int(np.searchsorted(starts, t, side="right")) - 1]
            of_mass = {1: phase.mode_1, 2: phase.mode_2}
            expected = [
                *motion.forces(t).values(), *energies_of(motion, t).values(),
                *(of_mass[mass.number] for mass in masses_of(own.solver)),
            ]  # fmt: skip
            assert values == tuple(expected), (t, asked, case)
            compared += 1
    assert compared > 6


# ---- states that are kept ----

KEPT = ("joint", "servo", "hopper")


def everything(fmu: Fmu) -> list[Any]:
    """All values, as texts, in which NaN is NaN."""
    return [str(value) for value in fmu.get(*fmu.variables)]


class Started(NamedTuple):
    """An FMU, a start that has events ahead, and how long it has."""

    folder: Path
    start: dict[str, float]
    driven: str
    horizon: float

    def drive(self, fmu: Fmu, draw: random.Random, count: int = 40) -> list[list[Any]]:
        """Some steps, and changes of the input between them: all that is shown behind each."""
        shown, largest = [], abs(self.start[self.driven])
        for _ in range(count):
            needs, _ = fmu.step(self.horizon * draw.choice((0.001, 0.01, 0.05)))
            if needs or draw.random() < 0.3:
                fmu.handle((), {self.driven: draw.uniform(-1.0, 1.0) * largest} if draw.random() < 0.5 else {})
            shown.append(everything(fmu))
        return shown


def started(store: Any, name: str) -> Started:
    """A hopper in the air; of another model the case with the most events under a constant input."""
    robot, made = robot_of(store, name), solver(store, name)
    driven, folder = input_of(robot) or "", unpacked(store, robot)
    if name == "hopper":
        return Started(folder, {"x1": 0.0, "v1": 0.0, "x2": 0.5, "v2": -1.0, "u": 2.0}, driven, 1.2)
    found = []
    for case in cases(name, 16, 30, 3e2):
        start, u = {**case.robot, **case.start}, case.steps[0][1]
        motion = hopform.solve_motion(made.Robot(**case.robot), start=case.start, u=u, horizon=case.horizon)
        if motion.duration > 0.0 and len(motion.events) < SOLVED_AHEAD:
            found.append((len(motion.events), Started(folder, {**start, driven: u}, driven, 1.1 * motion.duration)))
    return max(found, key=lambda each: each[0])[1]


@pytest.mark.parametrize("name", KEPT)
def test_a_state_that_is_kept_and_set_again_goes_on_to_the_same_bits(store, name):
    of = started(store, name)
    with Fmu(of.folder) as fmu, Fmu(of.folder) as other:
        fmu.begin(of.start)
        other.begin(of.start)
        of.drive(fmu, random.Random(1), 15)
        state, t = fmu.call("getFMUState"), fmu.t
        packed, first = fmu.call("serializeFMUState", state), of.drive(fmu, random.Random(2))
        fmu.call("setFMUState", state)
        fmu.t = t
        assert of.drive(fmu, random.Random(2)) == first
        fmu.call("setFMUState", state)
        fmu.call("freeFMUState", state)
        assert fmu.call("serializeFMUState", again := fmu.call("getFMUState")) == packed
        fmu.call("freeFMUState", again)
        unpacked_there = other.call("deserializeFMUState", packed)
        other.call("setFMUState", unpacked_there)
        other.call("freeFMUState", unpacked_there)
        other.t = t
        assert of.drive(other, random.Random(2)) == first
        assert len({str(each) for each in first}) > 30


IN_ANOTHER_PROCESS = """
import random, sys
from pathlib import Path
from tests.conformance.test_fmus import Started
from tests.fmus import Fmu
folder, packed, t, driven, u, horizon = sys.argv[1:]
with Fmu(Path(folder)) as fmu:
    fmu.begin({})
    fmu.call("setFMUState", fmu.call("deserializeFMUState", Path(packed).read_bytes()))
    fmu.t = float.fromhex(t)
    started = Started(Path(folder), {driven: float(u)}, driven, float(horizon))
    print(started.drive(fmu, random.Random(2)))
"""


def test_bytes_of_a_state_go_on_in_another_process(store, tmp_path):
    of = started(store, "hopper")
    with Fmu(of.folder) as fmu:
        fmu.begin(of.start)
        of.drive(fmu, random.Random(1), 15)
        t = fmu.t
        (tmp_path / "state").write_bytes(fmu.call("serializeFMUState", fmu.call("getFMUState")))
        here = of.drive(fmu, random.Random(2))
    about = of.folder, tmp_path / "state", t.hex(), of.driven, of.start[of.driven], of.horizon
    command = [sys.executable, "-c", IN_ANOTHER_PROCESS, *about]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{here}\n"


def test_bytes_that_are_no_state_of_this_fmu_are_refused(store):
    """Those of another model, of the same one with other starts, too few, too many, none."""
    (joint, start, *_), (hopper, *_) = started(store, "joint"), started(store, "hopper")
    like = unpacked(store, robot_of(store, "joint").with_parameters({"load": 0.01}))
    with Fmu(joint) as fmu, Fmu(hopper) as leg, Fmu(like) as alike:
        fmu.begin(start)
        packed = fmu.call("serializeFMUState", fmu.call("getFMUState"))
        others = [other.call("serializeFMUState", other.call("getFMUState")) for other in (leg, alike)]
        before = everything(fmu)
        for bad in (*others, packed[:-1], packed + b"\0", b"", packed[1:] + b"\0"):
            with pytest.raises(Refused, match=r"^these bytes are no state of this FMU$"):
                fmu.call("deserializeFMUState", bad)
        assert everything(fmu) == before


# ---- instances ----


@pytest.mark.parametrize("name", ["joint", "servo", "hopper", "sea"])
def test_without_event_mode_the_states_at_communication_points_are_the_same(store, name):
    """Nor does it matter whether steps return early, nor whether the importer handles events."""
    of = started(store, name)
    names = coordinates(robot_of(store, name))
    targets = [of.horizon * n / 120 for n in range(1, 120)]
    with (
        Fmu(of.folder) as fmu,
        Fmu(of.folder, event_mode=False) as without,
        Fmu(of.folder, early=False) as late,
        Fmu(of.folder) as lazy,
    ):
        course = fmu.begin(of.start, stop=of.horizon).run(targets, names)
        assert course.stops
        for each in (without, late, lazy):
            each.begin(of.start, stop=of.horizon)
            states = []
            for target in targets:
                while each.t < target:
                    each.step(target - each.t)
                    assert each is lazy or each.t == target
                states.append(each.get(*names))
            assert states == course.states
            assert each.get("event", "events") == fmu.get("event", "events")


@pytest.mark.parametrize("name", ["joint", "hopper"])
def test_instances_of_one_process_do_not_change_each_other(store, name):
    """In turns, and one begins anew."""
    of = started(store, name)
    with Fmu(of.folder) as one, Fmu(of.folder) as other, Fmu(of.folder) as alone:
        one.begin(of.start)
        other.begin({**of.start, of.driven: 0.5 * of.start[of.driven]})
        alone.begin(of.start)
        draws = random.Random(1), random.Random(2)
        first = [[of.drive(fmu, draw, 1) for fmu, draw in zip((one, other), draws, strict=True)] for _ in range(40)]
        assert [each[0][0] for each in first] == of.drive(alone, random.Random(1))
        for fmu in (one, alone):
            fmu.call("reset")
        fmu = one.begin(of.start)
        assert of.drive(fmu, random.Random(1)) == [each[0][0] for each in first]
        alone.begin({})
        assert everything(alone) != everything(one)


def test_a_reset_has_the_starts_of_the_description_again(store):
    of = started(store, "hopper")
    with Fmu(of.folder) as fmu, Fmu(of.folder) as fresh:
        fmu.begin({**of.start, "k": 900.0, "ground": 0.1, "return_Kp": 10.0, "designs_return": False})
        fmu.run([0.7], ())
        fmu.call("reset")
        assert everything(fmu.begin({})) == everything(fresh.begin({}))


# ---- parameters between steps ----


@pytest.mark.parametrize("name", EVERY)
def test_a_parameter_that_is_set_between_steps_begins_a_motion_of_the_other_robot(store, name):
    """Piece by piece: from the state there a motion of the robot with the new value, to the bit."""
    robot, made, draw, pieces = robot_of(store, name), solver(store, name), random.Random(f"{name} tuned"), 0
    names, folder = coordinates(robot), unpacked(store, robot)
    for case in cases(name, 14, 3, 3e2):
        own, u, horizon = made.Robot(**case.robot), case.steps[0][1], case.horizon
        first = hopform.solve_motion(own, start=case.start, u=u, horizon=horizon)
        end, whole = first.duration if name in STANDS else horizon, scales(first)
        whole[1::2] = np.maximum(whole[1::2], case.fastest * whole[0])  # what rounding of a stretch does to velocities
        with Fmu(folder) as fmu:
            begun(fmu, case, robot, u, stop=horizon)
            for part in (0.2, 0.4, 0.7):
                fmu.run([part * end], names, last=TAKEOFF)
                if name in STANDS and not fmu["in_contact"]:
                    break
                values = {each.name: own[each.name] for each in own.fields()}
                which = draw.choice([each for each, value in values.items() if 0.0 < abs(value) < math.inf])
                t, left = fmu.t, horizon - fmu.t
                try:
                    tuned = own.with_parameters({which: values[which] * draw.uniform(0.8, 1.25)})
                    before = dict(zip(names, fmu.get(*names), strict=True))
                    hopform.solve_motion(tuned, start=before, u=u, horizon=left)
                except hopform.HopformError:  # friction at rest below that in motion, a stop or the ground moved away
                    continue
                happened, _ = fmu.handle(names, {which: tuned[which]})
                behind = dict(zip(names, happened.right, strict=True))
                own, motion = tuned, hopform.solve_motion(tuned, start=behind, u=u, horizon=left)
                rounded = (
                    EPS * (ULPS_OF_A_CHANGE + case.fastest * t) * whole
                )  # of the state, and of the time to which it moved
                assert np.all(np.abs(np.subtract(happened.right, happened.left)) <= rounded)
                course = fmu.run([t + 0.1 * end], names, last=TAKEOFF)
                since = Course([time - t for time in course.times], course.states, course.stops, [])
                expected = [t + time for time, _ in kinds_at(motion, fmu.t - t)]
                if name in STANDS:  # whose compression is rounded once more
                    scale = scales(motion)
                    for time, state in before_end(since, motion):
                        assert np.all(np.abs(np.subtract(state, motion.at(time))) <= STATE_ULPS * EPS * scale)
                    np.testing.assert_allclose(course.event_times, expected, rtol=0.0, atol=EVENT_ULPS * EPS * horizon)
                else:
                    assert all(state == tuple(motion.at(time)) for time, state in before_end(since, motion)), (
                        which,
                        case,
                    )
                    assert course.event_times == expected
                pieces += 1
    assert pieces > 3


IN_AIR = {"x1": 0.03, "v1": 0.0, "x2": 0.6, "v2": 0.5}


@pytest.mark.parametrize("values", [{"k": 900.0}, {"m_eff": 20.0, "f1": 2.0}, {"g": 5.0}, {"L0": 0.39}], ids=str)
@pytest.mark.parametrize("gains", [None, (2000.0, 200.0)], ids=["designed", "given"])
@pytest.mark.parametrize(("ground", "t"), [(0.0, 0.05), (0.02, 0.2), (-0.3, 0.2), (-0.3, 0.32)])
def test_a_parameter_that_is_set_in_flight_begins_a_flight_of_the_other_robot(
    store, hopper_c, values, ground, t, gains
):
    """Also where the foot is already below the ground that it has left."""
    names, law = coordinates(hopper_c), dict[str, float | bool]()
    if gains:
        law = {"designs_return": False, "return_Kp": gains[0], "return_Kd": gains[1]}
    with Fmu(unpacked(store, hopper_c)) as fmu:
        fmu.begin({**IN_AIR, **law, "ground": ground})
        fmu.run([t], names)
        before = fmu.get(*names)
        fmu.handle(names, values)
        x1, v1, x2, v2 = fmu.get(*names)
        assert np.max(np.abs(np.subtract((x1, v1, x2, v2), before))) <= 4 * EPS and not fmu["in_contact"]
        own = hopper_c.with_parameters(values)
        flight = hopform.solve_flight(own, x1=x1, v1=v1, x2=x2 - ground, v2=v2, gains=gains)
        coming = [*(event.time for event in flight.events), flight.duration]
        assert abs(fmu["next_event"] - t - next(each for each in coming if each > 0.0)) <= EVENT_ULPS * EPS
        stop = fmu.run([t + flight.duration + 0.001], names, last=TOUCHDOWN).stops[-1]
        assert fmu["in_contact"] and abs(stop.time - t - flight.duration) <= EVENT_ULPS * EPS
        assert np.max(np.abs(np.subtract(stop.right, flight.touchdown))) <= STATE_ULPS * EPS


@pytest.mark.parametrize("name", needs.at_night(STANDS, *STANDS[2:]))
def test_a_start_in_the_air_is_a_flight_to_the_ground(store, name):
    """The actuator away from its origin, the ground ahead higher or lower: events, and the touchdown."""
    robot = robot_of(store, name)
    names, height = coordinates(robot), robot.standing_height
    for x1, v1, ground in ((0.0, 0.0, 0.0), (0.03, 0.0, 0.05), (0.05, -0.2, -0.1)):
        start = dict(zip(names, (x1, v1, height + x1 + 0.15, 0.3), strict=True))
        flight = hopform.solve_flight(robot, x1=x1, v1=v1, x2=start[names[2]] - ground, v2=0.3, compression=0.0)
        with Fmu(unpacked(store, robot)) as fmu:
            fmu.begin({**start, "ground": ground})
            course = fmu.run([0.1, 0.2, 3.0], names, last=TOUCHDOWN)
        expected = [*(event.time for event in flight.events if event.time > 0.0), flight.duration]
        np.testing.assert_allclose(course.event_times, expected, rtol=0.0, atol=EVENT_ULPS * EPS)
        assert course.stops[-1].event == TOUCHDOWN
        assert np.max(np.abs(np.subtract(course.stops[-1].right, flight.touchdown))) <= STATE_ULPS * EPS
        for t, state in zip(course.times, course.states, strict=True):
            there = flight.at(t)
            assert np.max(np.abs(np.subtract(state, there._replace(x2=there.x2 + ground)))) <= STATE_ULPS * EPS


def test_a_robot_that_cannot_fly_is_refused_in_flight_and_the_old_one_flies_on(store, hopper_c):
    """Without gravity nothing comes down; all that was set with it is as before."""
    with Fmu(unpacked(store, hopper_c)) as fmu, Fmu(unpacked(store, hopper_c)) as other:
        for each in (fmu, other):
            each.begin(IN_AIR)
            each.step(0.1)
        with pytest.raises(Refused):
            fmu.handle((), {"g": 0.0, "return_Kp": 1.0, "designs_return": False, "ground": 0.01})
        names = ("g", "return_Kp", "designs_return", "ground", "next_event", *coordinates(hopper_c))
        assert fmu["g"] == hopper_c.g and fmu["next_event"] < math.inf
        assert fmu.run([0.2, 0.5], names) == other.run([0.2, 0.5], names)


def test_no_parameter_can_be_set_while_the_damper_of_a_leg_relaxes_in_flight(store):
    """It keeps its value, and the flight goes on as if it had not been asked; on the ground it can be set."""
    robot = robot_of(store, "leg_damper")
    folder, names = unpacked(store, robot), coordinates(robot)
    height = robot.standing_height
    start = {names[0]: robot.home, names[1]: 0.0, names[2]: robot.home + 1.5 * height + 0.1, names[3]: 0.0}
    with Fmu(folder) as fmu, Fmu(folder) as other:
        for each in (fmu, other):
            each.begin(start)
            each.step(0.25 * (each["next_event"] - each.t))
            assert not each["in_contact"]
        b12, said = robot["b12"], "no parameter can be changed in flight while the damper of the leg relaxes"
        with pytest.raises(Refused, match=f"^{said}$"):
            fmu.handle(names, {"b12": 2.0 * b12 + 1.0})
        assert fmu["b12"] == b12
        fmu.set(b12=2.0 * b12 + 1.0)
        with pytest.raises(Refused, match=f"^{said}$"):
            fmu.step(0.001)
        assert fmu["b12"] == b12
        courses = [each.run([fmu.t + 0.4], names, last=TOUCHDOWN) for each in (fmu, other)]
        assert courses[0].stops == courses[1].stops and courses[0].stops[-1].event == TOUCHDOWN
        fmu.handle(names, {"b12": 2.0 * b12 + 1.0})
        assert fmu["b12"] == 2.0 * b12 + 1.0


# ---- hops ----

HOPS = 5


def hops_of(
    robot: Any, start: dict[str, float], currents: list[float], ground: list[float]
) -> list[tuple[float, str, Any]]:
    """Touchdowns and take-offs of flights and stances in turn, from a start in the air: times and states."""
    flight = hopform.solve_flight(robot, **{**start, "x2": start["x2"] - ground[0]})
    t, found = flight.duration, list[tuple[float, str, Any]]()
    for n, u in enumerate(currents):
        assert flight.touchdown is not None
        found.append((t, "touchdown", tuple(flight.touchdown)))
        at = flight.touchdown
        stance = hopform.solve_stance(robot, x1=at.x1, v1=at.v1, v2=at.v2, compression=flight.end_compression, u=u)
        t += stance.duration
        assert stance.takeoff is not None
        found.append((t, "takeoff", tuple(stance.takeoff)))
        if n + 1 < len(currents):
            flight = stance.fly(ground[n + 1] - ground[n])
            t += flight.duration
    return found


@pytest.mark.parametrize("size", STEPS)
@pytest.mark.parametrize("later", [0.0, 0.03], ids=["at take-off", "in flight"])
@pytest.mark.parametrize("ground", [[0.0] * HOPS, [0.02, -0.03, 0.0, 0.01, -0.02]], ids=["even", "rough"])
def test_five_hops_are_those_of_flights_and_stances_in_turn(store, hopper_c, size, later, ground):
    """The current of a stance is chosen at its touchdown, the ground ahead at the take-off before it or in flight."""
    currents, start = [2.0, 3.0, 2.5, 2.0, 3.0], {"x1": 0.0, "v1": 0.0, "x2": 0.6, "v2": 0.0}
    expected = hops_of(hopper_c, start, currents, ground)
    names, found, horizon = coordinates(hopper_c), list[Happened](), expected[-1][0]
    with Fmu(unpacked(store, hopper_c)) as fmu:
        fmu.begin({**start, "ground": ground[0]}, stop=4.0)
        changes_at = math.inf
        while len(found) < 2 * HOPS:
            needs, over = fmu.step(min(size, max(changes_at - fmu.t, 1e-3)))
            assert not over and fmu.t < 4.0
            if needs:
                assert fmu["next_event"] == fmu.t
                happened, _ = fmu.handle(names)
                if happened.event in (TAKEOFF, TOUCHDOWN):
                    found.append(happened)
                    assert fmu["in_contact"] == (happened.event == TOUCHDOWN) == (len(found) % 2 == 1)
                if happened.event == TOUCHDOWN:
                    fmu.handle(names, {"u": currents[len(found) // 2]})
                if happened.event == TAKEOFF:
                    changes_at = fmu.t + later
            if fmu.t >= changes_at:
                changes_at = math.inf
                fmu.handle(names, {"ground": ground[min(len(found) // 2, HOPS - 1)]})
    scale = np.max(np.abs([state for *_, state in expected]), axis=0)
    scale[::2] = scale[::2].max()
    for happened, (time, kind, state) in zip(found, expected, strict=True):
        assert words_of(hopper_c)[happened.event] == kind
        assert abs(happened.time - time) <= EVENT_ULPS * EPS * horizon, (kind, happened.time - time)
        assert np.all(np.abs(np.subtract(happened.right, state)) <= STATE_ULPS * EPS * scale), (kind, happened, state)
    hops = hopform.solve_hops(
        hopper_c, start=hopform.State(**start), u=np.array(currents), ground=np.array(ground), states=True
    )
    touchdowns = [happened.time for happened in found[::2]]
    np.testing.assert_allclose(touchdowns, hops.touchdown_time, rtol=0.0, atol=EVENT_ULPS * EPS * horizon)


def test_a_flight_that_gets_nowhere_ends_the_simulation(store, hopper_c):
    """At the time and the state of the trip; nothing more happens."""
    start, names = {"x1": 0.0, "v1": 0.0, "x2": 0.6, "v2": 0.5}, coordinates(hopper_c)
    flight = hopform.solve_flight(hopper_c, **{**start, "x2": start["x2"] - 0.5})
    assert flight.status == "tripped"
    with Fmu(unpacked(store, hopper_c)) as fmu:
        fmu.begin({**start, "ground": 0.5})
        assert fmu.step(1.0) == (True, False) and abs(fmu.t - flight.duration) <= EVENT_ULPS * EPS
        happened, told = fmu.handle(names)
        assert told.is_over and happened.count == 0
        end = flight.end._replace(x2=flight.end.x2 + 0.5)
        assert np.max(np.abs(np.subtract(fmu.get(*names), end))) <= STATE_ULPS * EPS
        assert fmu["next_event"] == math.inf
        t = fmu.t
        assert fmu.step(1.0) == (False, True) and fmu.t == t
    with Fmu(unpacked(store, hopper_c), event_mode=False) as fmu:
        fmu.begin({**start, "ground": 0.5})
        assert fmu.step(1.0) == (False, True) and fmu.t == t


def test_ground_that_is_set_above_the_foot_in_flight_is_refused(store, hopper_c):
    """The flight goes on to the ground that it had."""
    names = coordinates(hopper_c)
    with Fmu(unpacked(store, hopper_c)) as fmu, Fmu(unpacked(store, hopper_c)) as other:
        for each in (fmu, other):
            each.begin({"x1": 0.0, "v1": 0.0, "x2": 0.6, "v2": 0.0})
            each.step(0.1)
        with pytest.raises(Refused, match=r"^ground must be below the foot in flight$"):
            fmu.handle(names, {"ground": 0.3})
        assert fmu["ground"] == 0.0
        assert fmu.run([0.5], names) == other.run([0.5], names)


def test_a_robot_that_stands_begins_as_its_stance(store, hopper_c):
    """The first take-off, under a current, of one that is pressed onto the ground."""
    start = {"x1": 0.01, "v1": 0.1, "x2": 0.38, "v2": -1.5}
    stance = hopform.solve_motion(hopper_c, start=start, u=2.5, horizon=1.0)
    assert stance.status == "takeoff"
    with Fmu(unpacked(store, hopper_c)) as fmu:
        course = fmu.begin({**start, "u": 2.5}, stop=1.0).run([1.0], coordinates(hopper_c), last=TAKEOFF)
    assert course.event_times == [t for t, _ in kinds_at(stance, 1.0)] and len(course.stops) >= 2


# ---- anything ----

ANYTHING = (math.nan, math.inf, -math.inf, 0.0, -1.0, 1e-300, 1e300, -1e-9, 0.5, 3.0)
CALLS = 400


def any_call(fmu: Fmu, draw: random.Random, kept: list[Any]) -> None:
    """One call of any kind, with good or bad numbers."""
    names = [*fmu.variables]

    def number() -> float:
        return draw.choice(ANYTHING) if draw.random() < 0.4 else draw.uniform(-2.0, 2.0) * 10.0 ** draw.uniform(-3, 2)

    def set_any() -> None:
        name = draw.choice(names)
        kind = fmu.variables[name].type
        near = fmu.variables[name].start if draw.random() < 0.6 else None
        if kind == "Boolean":
            fmu.set({name: draw.random() < 0.5})
        elif kind == "Float64":
            fmu.set({name: float(near) * draw.uniform(0.5, 2.0) if near is not None else number()})
        else:
            fmu.call("setFloat64", [fmu.variables[name].valueReference], [number()])

    def get_any() -> None:
        some = draw.sample(names, draw.randint(1, len(names)))
        fmu.get(*some)

    def step() -> None:
        size = draw.choice((1e-3, 1e-2, 0.3, 1e-12)) if draw.random() < 0.8 else number()
        point = fmu.t if draw.random() < 0.9 else number()
        _, _, _, last = fmu.call("doStep", point, size)
        assert fmu.t <= last
        fmu.t = last

    def keep() -> None:
        kept.append((fmu.call("getFMUState"), fmu.t))

    def restore() -> None:
        if kept:
            state, t = draw.choice(kept)
            fmu.call("setFMUState", state)
            fmu.t = t

    def initialize() -> None:
        fmu.call(
            "enterInitializationMode", None, draw.choice((0.0, 0.0, 1.0, number())), draw.choice((None, 5.0, number()))
        )
        fmu.t = fmu["time"]

    acts = (
        (set_any, 8), (get_any, 4), (step, 10), (keep, 1), (restore, 1), (initialize, 2), (fmu.update, 3),
        (lambda: fmu.call("exitInitializationMode"), 2), (lambda: fmu.call("enterEventMode"), 3),
        (lambda: fmu.call("enterStepMode"), 4), (lambda: fmu.call("terminate"), 0.05), (lambda: fmu.call("reset"), 0.2),
        (lambda: fmu.call("getFloat64", [draw.randrange(10_000)]), 0.3),
        (lambda: fmu.call("setBoolean", [draw.randrange(60)], [True]), 0.3),
    )  # fmt: skip
    draw.choices([act for act, _ in acts], [weight for _, weight in acts])[0]()


@pytest.mark.parametrize("name", ["joint", "servo", "hopper", "leg_damper", "sea"])
def test_any_order_of_calls_is_answered_or_refused_in_words(store, name):
    """With numbers of any kind: nothing crashes, what is shown is finite but for what has no value."""
    folder, draw, refused, answered = unpacked(store, robot_of(store, name)), random.Random(f"{name} {SEED}"), 0, 0
    may_lack = {
        "next_event",
        *(each.name for each in described(folder).modelVariables if each.name.startswith(("friction_", "stop_"))),
        "input",
    }
    for _ in range(4):
        kept = list[Any]()
        with Fmu(folder) as fmu:
            numbers = [each for each, about in fmu.variables.items() if about.causality in ("output", "independent")]
            for _ in range(CALLS):
                try:
                    any_call(fmu, draw, kept)
                    answered += 1
                except Refused as error:
                    refused += 1
                    assert str(error)
                    continue
            try:
                shown = dict(zip(numbers, fmu.get(*numbers), strict=True))
            except Refused:
                continue
            assert all(math.isfinite(value) for each, value in shown.items() if each not in may_lack), shown
            for state, _ in kept:
                fmu.call("freeFMUState", state)
    assert refused > 100 and answered > 300
