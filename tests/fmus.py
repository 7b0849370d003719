"""An importer of FMUs over FMPy: instances whose variables have names, stepped in Event Mode, with the values on both sides
of each event.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, Self

from fmpy import extract, read_model_description
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave

from hopform import _fmu
from hopform._motion import layout_of
from hopform._robots import Robot
from tests.objects import key, once

TAKEOFF, TOUCHDOWN = _fmu.EVENT_TAKEOFF, _fmu.EVENT_TOUCHDOWN
GETTERS = {"Float64": "getFloat64", "Int32": "getInt32", "Enumeration": "getInt64", "Boolean": "getBoolean"}


class Refused(Exception):
    """fmi3Error, with what the FMU has said."""


class Update(NamedTuple):
    """What an update of the discrete states tells: the time of the next event, infinite where there is none, and whether the
    simulation is over.
    """

    next_event: float
    is_over: bool


class Happened(NamedTuple):
    """A stop of the stepping at an event, or at a change of the importer's: its time, the latest event's number there, how
    many there were, the state before and behind it.
    """

    time: float
    event: int
    count: int
    left: tuple[float, ...]
    right: tuple[float, ...]


class Course(NamedTuple):
    """Times of communication points and states there, stops between them, and the times of changes as the FMU has met them."""

    times: list[float]
    states: list[tuple[float, ...]]
    stops: list[Happened]
    changes: list[float]

    @property
    def event_times(self) -> list[float]:
        """The time of each event."""
        return [stop.time for stop in self.stops for _ in range(stop.count)]


@cache
def described(folder: Path) -> Any:
    return read_model_description(str(folder))


def unpacked(store: Path, robot: Robot, *inputs: str) -> Path:
    """The folder of the FMU of a robot, which is compiled once for all processes of the run."""
    about = [(field.name, robot[field.name]) for field in robot.fields()]
    name = f"fmu_{robot.solver.name}_{key(about, *inputs)}"

    def make(aside: Path) -> None:
        packed = aside.with_suffix(".fmu")
        packed.write_bytes(_fmu.archive(robot, inputs))
        extract(str(packed), str(aside))
        packed.unlink()

    return once(store / name, make)


class Fmu:
    """An instance of the FMU in a folder. Used as a context it is freed at the end."""

    def __init__(self, folder: Path, *, event_mode: bool = True, early: bool = True, **how: Any) -> None:
        self.about = described(folder)
        self.variables = {each.name: each for each in self.about.modelVariables}
        self.event_mode, self.said, self.t = event_mode, list[str](), 0.0
        self.slave = FMU3Slave(
            guid=self.about.guid, unzipDirectory=str(folder), instanceName="one",
            modelIdentifier=self.about.coSimulation.modelIdentifier,
        )  # fmt: skip
        self.slave.instantiate(eventModeUsed=event_mode, earlyReturnAllowed=early, logMessage=self._hear, **how)

    def _hear(self, _environment: Any, _status: int, _category: bytes, message: bytes) -> None:
        self.said.append(message.decode("utf-8"))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.slave.freeInstance()

    def call(self, name: str, *arguments: Any) -> Any:
        """A method of FMPy's; Refused with what the FMU says where it answers fmi3Error."""
        self.said.clear()
        try:
            return getattr(self.slave, name)(*arguments)
        except FMICallException as error:
            assert error.status == 3 and len(self.said) == 1, (error, self.said)
            raise Refused(self.said[0]) from None

    def set(self, values: Mapping[str, float | bool] | None = None, **named: float | bool) -> None:
        """Set variables by their names, all numbers at once."""
        given = {**(values or {}), **named}
        flags = {name: value for name, value in given.items() if self.variables[name].type == "Boolean"}
        numbers = {name: value for name, value in given.items() if name not in flags}
        if numbers:
            self.call("setFloat64", [self.variables[name].valueReference for name in numbers], list(numbers.values()))
        if flags:
            self.call("setBoolean", [self.variables[name].valueReference for name in flags], list(flags.values()))

    def get(self, *names: str) -> tuple[Any, ...]:
        """Values of variables by their names."""
        found = dict[str, Any]()
        for kind in dict.fromkeys(self.variables[name].type for name in names):
            of_kind = [name for name in names if self.variables[name].type == kind]
            values = self.call(GETTERS[kind], [self.variables[name].valueReference for name in of_kind])
            found |= dict(zip(of_kind, values, strict=True))
        return tuple(found[name] for name in names)

    def __getitem__(self, name: str) -> Any:
        return self.get(name)[0]

    def begin(
        self, values: Mapping[str, float | bool] | None = None, *, at: float = 0.0, stop: float | None = None
    ) -> Self:
        """Initialise with starts, and get ready to step."""
        self.set(values or {})
        self.call("enterInitializationMode", None, at, stop)
        self.call("exitInitializationMode")
        self.t = at
        if self.event_mode:
            self.update()
            self.call("enterStepMode")
        return self

    def update(self) -> Update:
        """In Event Mode: pass what happens now."""
        again, over, _, _, is_known, time = self.call("updateDiscreteStates")
        assert not again and is_known == math.isfinite(time)
        return Update(time, over)

    def step(self, size: float) -> tuple[bool, bool]:
        """A step of this size, or to an event before; whether one is there, and whether the simulation is over."""
        needs, over, early, last = self.call("doStep", self.t, size)
        assert early == (last < self.t + size) and self.t <= last <= self.t + size
        self.t = last
        return needs, over

    def handle(self, names: Sequence[str], values: Mapping[str, float | bool] | None = None) -> tuple[Happened, Update]:
        """Enter Event Mode, set inputs, pass what happens now, and go on; Happened and what the update tells."""
        left, before = self.get(*names), self["events"]
        self.call("enterEventMode")
        try:
            self.set(values or {})
            told = self.update()
        finally:
            self.slave.enterStepMode()
        return Happened(self.t, self["event"], self["events"] - before, left, self.get(*names)), told

    def run(
        self,
        targets: Iterable[float],
        names: Sequence[str],
        changes: Iterable[tuple[float, Mapping[str, float]]] = (),
        seen: Callable[[Happened, Update], object] = lambda *_: None,
        last: int | None = None,
    ) -> Course:
        """Step to each target, a communication point, and to each change, which is set there; the course up to an event of the
        kind `last`, or a terminateSimulation.
        """  # fmt: skip
        course, on_the_way = Course([], [], [], []), [(t, None) for t in targets]
        for target, values in sorted([*on_the_way, *changes], key=lambda each: each[0]):
            while self.t < target:
                needs, over = self.step(target - self.t)
                if over:
                    return course
                if not needs:
                    break
                course.stops.append(self.pass_event(names, {}, seen))
                if course.stops[-1].event == last:
                    return course
            if values is None:
                course.times.append(self.t)
                course.states.append(self.get(*names))
            else:
                course.changes.append(self.t)
                course.stops.append(self.pass_event(names, values, seen))
        return course

    def pass_event(
        self, names: Sequence[str], values: Mapping[str, float], seen: Callable[[Happened, Update], object]
    ) -> Happened:
        happened, told = self.handle(names, values)
        seen(happened, told)
        return happened


def coordinates(robot: Robot) -> tuple[str, ...]:
    """Names of a robot's coordinates and velocities."""
    return layout_of(robot.solver).names
