"""The plant of the C library: ticks of any length are the motion of the whole, and its time does not drift."""

import ctypes
import math
import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import hopform
from hopform._solver.c import Types
from hopform._solver.package import records
from tests import needs
from tests.conformance.zoo import EQUATIONS, Case, cases
from tests.derived import SHIPPED, solver_of
from tests.seeds import SEED

pytestmark = needs.library
ENDINGS = records.ENDINGS
STANDS = ("hopper", "leg_damper", "second_spring", "cable", "back_emf")
"""Models with a contact."""
FREE = [name for name in EQUATIONS if name not in STANDS]
DTYPES = np.dtype(np.float64), np.dtype(np.float32)
TICKS = (1, 2, 7, 40, 200)
ROOM = 64
ULPS = 8
"""Units in the last place that a tick, or an event, may add: beside the rounding of both motions that of the times, which
the motion of the whole counts from its start and a tick from its own."""


class Plant:
    """A plant of a robot from a start, with the reports of its ticks."""

    def __init__(self, robot: Any, start: dict[str, float], dtype: np.dtype[Any]) -> None:
        self.library = robot.solver.compiled().library
        self.types: Types = self.library.types(dtype)
        self.words = robot.solver.package.records.EVENTS
        self.memory, self.report = self.types.Plant(), self.types.Report()
        self.phases = (self.types.Phase * ROOM)()
        self.report.phases, self.report.capacity = ctypes.addressof(self.phases), ROOM
        parameters = self.types.Robot(*robot.parameters)
        self.call("plant_begin", ctypes.byref(parameters), ctypes.byref(self.start_of(start)))

    def start_of(self, start: dict[str, float]) -> Any:
        return self.types.Start(*(start[name] for name, _ in self.types.Start._fields_))

    def call(self, name: str, *arguments: Any) -> int:
        return self.library.call(name, self.types, ctypes.byref(self.memory), *arguments)

    def step(self, u: float, dt: float) -> str:
        """The ending of a tick."""
        assert self.call("plant_step", self.types.real(u), self.types.real(dt), ctypes.byref(self.report)) == 0
        return ENDINGS[self.report.ending]

    @property
    def events(self) -> list[tuple[float, str]]:
        """Those of the latest tick, with times since it began."""
        return [
            (each.t, self.words[each.event]) for each in self.phases[: self.report.count] if each.event in self.words
        ]

    @property
    def at(self) -> np.ndarray:
        return np.array([getattr(self.report.start, name) for name, _ in self.types.Start._fields_], float)

    @property
    def time(self) -> Fraction:
        parts = self.memory.seconds, self.memory.fraction, self.memory.carry
        return sum(map(Fraction, parts), Fraction())


def solver(store: Any, name: str) -> Any:
    return hopform.load_solver(name) if name == "hopper" else solver_of(store, SHIPPED / f"{name}.py")


def ticked(case: Case, draw: random.Random, dtype: np.dtype[Any]) -> tuple[list[float], list[float]]:
    """Times at which ticks begin, with the horizon behind, and the input of each: one, or others that hold and push."""
    count, horizon = draw.choice(TICKS), float(dtype.type(case.horizon))
    cuts = {float(dtype.type(draw.uniform(0.0, 1.0) * horizon)) for _ in range(count - 1)}
    times, size = sorted({0.0, *cuts} - {horizon}), max(abs(u) for _, u in case.steps)
    varies = draw.random() < 0.7
    return [*times, horizon], [
        size * (draw.choice((0.0, 0.2, 1.0, 4.0)) * draw.choice((-1, 1)) if varies else 1.0) for _ in times
    ]


def same_as_the_whole(case: Case, robot: Any, draw: random.Random, dtype: np.dtype[Any]) -> set[str]:
    """Tick by tick against one motion with a step at each; endings and kinds of events that were seen."""
    times, inputs = ticked(case, draw, dtype)
    plant, start = Plant(robot, case.start, dtype), dict(case.start)
    if len(start) > 2:  # the compression that the plant has rounded, not one that Python rounds of the same coordinates
        start = {**start, "y": plant.memory.state.y}
        del start[[*start][1]]
    motion = hopform.solve_motion(
        robot, start=start, u=list(zip(times, inputs, strict=False)), horizon=times[-1], dtype=dtype
    )
    samples = np.array([motion.at(t) for t in np.linspace(0.0, motion.duration, 65)], float)
    scale = np.abs(samples).max(axis=0) + 1e-300
    scale[::2] = scale[::2].max()  # the second place is carried as the stretch, from the first one
    ulp = ULPS * float(np.finfo(dtype).eps)
    events, seen = list[tuple[float, str]](), set[str]()
    for n, (t, end, u) in enumerate(zip(times, times[1:], inputs, strict=False), 1):
        ending = plant.step(u, float(dtype.type(end) - dtype.type(t)))
        seen |= {ending, *("slips at once" for since, _ in plant.events if since == 0.0)}
        events += [(t + since, kind) for since, kind in plant.events]
        assert plant.report.event_count == len(plant.events) and plant.report.count <= ROOM
        allowed = ulp * (n + len(events))
        there = np.array(motion.at(min(end, motion.duration)), float)
        assert np.all(np.abs(plant.at - there) <= allowed * scale), (case, n, dtype)
        if ending == "takeoff":
            assert motion.status == ending
            assert abs(t + plant.report.duration - motion.duration) <= allowed * motion.duration
            break
    assert motion.status != "takeoff" or "takeoff" in seen
    assert [kind for _, kind in events] == [event.kind for event in motion.events], (case, dtype)
    for (t, kind), event in zip(events, motion.events, strict=True):
        assert abs(t - event.time) <= ulp * (len(times) + len(events)) * motion.duration, (kind, case)
    return seen.union(kind for _, kind in events)


@pytest.mark.parametrize("dtype", DTYPES, ids=str)
@pytest.mark.parametrize("name", needs.the_first([*STANDS, *FREE]))
def test_ticks_of_any_length_are_the_motion_of_the_whole(store, name, dtype):
    """States within a few units in the last place of their scale, and the same events; up to a take-off, if there is one."""
    draw, made = random.Random(f"{name} ticks"), solver(store, name)
    seen = set[str]()
    for case in cases(name, 7, 30, 2e3):
        seen |= same_as_the_whole(case, made.Robot(**case.robot), draw, dtype)
    assert {"takeoff"} <= seen if name in STANDS else {"horizon", "rest", "slips at once"} <= seen
    assert len(seen) > 4


def test_a_plant_goes_on_from_a_touchdown_at_its_time(hopper_c):
    """Stance in ticks to the take-off, a flight, and the next stance from its touchdown: the hops of one robot."""
    start = {"x1": 0.0, "v1": 0.0, "x2": 0.4, "v2": -1.93}
    plant = Plant(hopper_c, start, DTYPES[0])
    for _ in range(3):
        begun, ending = plant.time, ""
        stance = hopform.solve_stance(hopper_c, **start, u=2.0)
        while ending in ("", "horizon"):
            ending = plant.step(2.0, 1e-3)
        assert ending == "takeoff" and abs(float(plant.time - begun) - stance.duration) < 1e-13
        np.testing.assert_allclose(plant.at, np.array(stance.takeoff), atol=1e-12)
        assert plant.step(2.0, 1e-3) == "takeoff" and plant.report.duration == 0.0  # there is nothing to stand on
        start, now = stance.fly().touchdown._asdict(), plant.time
        assert plant.call("plant_place", ctypes.byref(plant.start_of(start))) == 0 and plant.time == now


NO_STATE = ("x1", "v1", "v2", "y")
NO_PLANTS = [
    *((f"state.{member}", bad) for member in NO_STATE for bad in (math.nan, math.inf, -math.inf)),
    *((member, bad) for member in ("from_upper", "largest_y", "rounding", "carry") for bad in (math.nan, math.inf)),
    *(("from_lower", bad) for bad in (math.nan, -math.inf)), *(("fraction", bad) for bad in (math.nan, 1.5, -1.5)),
    ("mode", -1), ("mode", 9),
]  # fmt: skip


@pytest.mark.parametrize("dtype", DTYPES, ids=str)
@pytest.mark.parametrize("begins", [False, True], ids=["goes on", "begins"])
def test_memory_that_is_no_plant_is_refused_and_stays_as_it_is(hopper_c, begins, dtype):
    """Each member that a tick continues from: no number, none that is finite, no mode."""
    for member, bad in NO_PLANTS:
        plant = Plant(hopper_c, {"x1": 0.01, "v1": 0.0, "x2": 0.4, "v2": -1.93}, dtype)
        if not begins:
            plant.step(1.0, 1e-3)
        holder, name = (plant.memory.state, member[6:]) if member.startswith("state.") else (plant.memory, member)
        setattr(holder, name, bad)
        before = bytes(plant.memory)
        with pytest.raises(hopform.HopformError):
            plant.step(1.0, 1e-3)
        assert bytes(plant.memory) == before and plant.report.count == 0, member


@pytest.mark.parametrize("dtype", DTYPES, ids=str)
def test_a_tick_that_cannot_be_made_is_refused_and_the_next_one_is_as_ever(hopper_c, dtype):
    """No input, no length, a length that has no end of it; memory for phases that is none."""
    start = {"x1": 0.01, "v1": 0.0, "x2": 0.4, "v2": -1.93}
    plant, other = Plant(hopper_c, start, dtype), Plant(hopper_c, start, dtype)
    for u, dt in ((math.nan, 1e-3), (math.inf, 1e-3), (1.0, 0.0), (1.0, -1.0), (1.0, math.nan), (1.0, 1e10)):
        with pytest.raises(hopform.HopformError):
            plant.step(u, dt)
    plant.report.capacity = -1
    with pytest.raises(hopform.HopformError):
        plant.step(1.0, 1e-3)
    plant.report.capacity, plant.report.phases = ROOM, None
    with pytest.raises(hopform.HopformError):
        plant.step(1.0, 1e-3)
    plant.report.phases = ctypes.addressof(plant.phases)
    assert plant.step(1.0, 1e-3) == other.step(1.0, 1e-3) and list(plant.at) == list(other.at)


@pytest.mark.sliced
def test_time_does_not_drift(store):
    """Ticks of a second's thousandth, in single precision, are those that were asked for, also after a year."""
    robot = solver(store, "joint").Robot(F_p=0.1, F_m=0.1)
    plant, dt, n = Plant(robot, {"q": 0.3, "q_dot": 0.0}, DTYPES[1]), np.float32(1e-3), 20_000
    for year in (0, 31_536_000):
        plant.memory.seconds += year
        begun = plant.time
        for _ in range(n):
            plant.step(0.0, dt)
        assert abs(plant.time - begun - n * Fraction(float(dt))) < Fraction(1, 10**9)
    naive = np.float32(0.0)
    for _ in range(n):
        naive += dt
    assert abs(float(naive) - n * float(dt)) > 1e-4  # what a single sum makes of it
    for long in (2.5, 86_400.25, 1e6):
        begun = plant.time
        plant.step(0.0, long)
        assert plant.time - begun == Fraction(float(np.float32(long))) and 0.0 <= plant.memory.fraction < 1.0


@pytest.mark.sliced
def test_a_tick_tells_what_begins_a_phase_apart(store):
    """A step of the input, a limit of a law and a stop have numbers of their own; the first phase of all has none."""
    robot = solver(store, "servo").Robot(K_p=5.0, K_d=0.1, i_max=0.5, q_max=0.35, F_p=0.01, F_m=0.01)
    plant, seen = Plant(robot, {"q": 0.0, "q_dot": 0.0}, DTYPES[0]), list[int]()
    for n in range(400):
        plant.step(0.6 if n < 200 else 0.1, 5e-3)
        begins = [each.event for each in plant.phases[: plant.report.count]]
        assert begins[0] in ((0,) if n == 0 else (10, 3)), n
        seen += begins[1:]
    words = robot.solver.package.records
    assert {words.BEGINNINGS.get(each, words.EVENTS.get(each)) for each in seen} >= {
        "u_saturates", "u_desaturates", "q_hits_stop"
    }  # fmt: skip


@pytest.mark.sliced
def test_one_plant_more_does_not_change_another(store):
    """Draws of plants that run in turns: nothing is kept outside of them."""
    made, draw = solver(store, "joint"), random.Random(SEED)
    robots = [made.Robot(**case.robot) for case in cases("joint", SEED % 1000, 2, 2e3)]
    start = {"q": 0.0, "q_dot": 0.3}
    alone = [Plant(robot, start, DTYPES[0]) for robot in robots]
    inputs = [draw.uniform(-0.3, 0.3) for _ in range(50)]
    for plant in alone:
        for u in inputs:
            plant.step(u, 1e-3)
    together = [Plant(robot, start, DTYPES[0]) for robot in robots]
    for u in inputs:
        for plant in together:
            plant.step(u, 1e-3)
    for one, other in zip(alone, together, strict=True):
        assert list(one.at) == list(other.at) and one.time == other.time
