"""Hopping: drop, touchdown, control, stance, take-off, flight, and so on over the heights of a terrain, without a time
step.

Heights in a run count from level 0, that of the terrain's zero. Each stance and each flight is solved exactly; what
remains of the actuator's return in flight is carried into the next stance.
"""

import io
import math
from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from inspect import getattr_static
from pathlib import Path
from typing import Any, Literal, NamedTuple, SupportsFloat, cast, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform import (
    Energy,
    Flight,
    Gains,
    HopformError,
    Robot,
    Stance,
    State,
    load_solver,
    solve_flight,
    solve_hops,
    solve_stance,
)
from hopform.extend import (
    Card,
    Checked,
    OverTime,
    by,
    falling_robot,
    finite,
    items,
    positive,
    shown,
    stream,
    whole,
    write,
)
from hopform.hopping._roles import Role
from hopform.hopping.controllers import Answer, ConstantCurrent, Controller, Preparing, Sampled, Touchdown
from hopform.hopping.terrain import heights_of

MOST_SAMPLES = 2**22
"""Times of a run at most: each takes up to 512 B."""
MOST_STEPS = 2**16 - 1
"""Steps of a current at most."""
MOST_TICKS = 1_000_000
"""Ticks of a sampled law in the longest stance."""
FEW_HOPS = 4
"""So many hops take less time one by one than the call for many runs takes to begin."""
TOUCHING_ULP = 4.0
"""A foot so few last digits of L0 from the ground is on it, as for `solve_flight`."""
Array = NDArray[np.float64]
Times = NDArray[Any] | Sequence[Any]
Real = Any
"""A float, or an array in the shape of the times."""
Progress = Callable[[int, int], object]
RunStatus = Literal["completed", "stopped", "tripped"]

_TYPES = {"index": "i4", "status": "U15", "hits_stop": "?", "bottoms_out": "?"}
_OF_TABLE: Mapping[str, str] = load_solver("hopper").answers["Table of a run"]
COLUMNS = tuple((name, _TYPES.get(name, "f8"), text) for name, text in _OF_TABLE.items())
"""The table of a run: name, type, unit and meaning of each column; heights over level 0."""


def _robot_or_none(name: str, value: object) -> Robot | None:
    return None if value is None else falling_robot(value, "hop", "hopping", name)


@dataclass(frozen=True)
class Errors(Checked):
    """Errors of sensors, motor and model. Standard deviations of what it measures, and what is wrong in the
    machine.

    x1 [m], v1, v2 [m/s]: of the state at touchdown and at the ticks of a sampled law; x2 [m]: of the apex before, and
    at those ticks; ground [m]: of the height of the ground. current_scale: current that flows over current that is
    asked for, in stance and in flight. quantum [s]: touchdown is seen at the next tick of such a clock; delay [s]:
    further delay of it; until then no current flows, and the controller does not know. model: the controller's model of
    the robot.
    """

    x1: float = field(default=0.0, metadata=by(finite, "m", 0.0))
    v1: float = field(default=0.0, metadata=by(finite, "m/s", 0.0))
    x2: float = field(default=0.0, metadata=by(finite, "m", 0.0))
    v2: float = field(default=0.0, metadata=by(finite, "m/s", 0.0))
    ground: float = field(default=0.0, metadata=by(finite, "m", 0.0))
    current_scale: float = field(default=1.0, metadata=by(positive, "of the current"))
    quantum: float = field(default=0.0, metadata=by(finite, "s", 0.0))
    delay: float = field(default=0.0, metadata=by(finite, "s", 0.0))
    model: Robot | None = field(default=None, metadata=by(_robot_or_none))


NONE = Errors()


class _Leg(NamedTuple):
    """A flight or a stance of a run: when it begins, its ground, and the body's energy predicted for its beginning."""

    begin: float
    motion: Flight | Stance
    ground: float
    level: float
    after_takeoff: bool = False


class _Legs(OverTime):
    """Flights and stances in a row; heights over level 0."""

    @abstractmethod
    def _chain(self) -> list[_Leg]: ...

    @cached_property
    def _all_legs(self) -> list[_Leg]:
        return self._chain()

    @overload
    def at(self, t: float) -> State: ...
    @overload
    def at(self, t: Times) -> State[Array]: ...
    def at(self, t: ArrayLike) -> State[Any]:
        """States at times t [s], 0 <= t <= duration, in t's shape; x2 is the body's height over level 0.

        >>> from hopform import load_robot
        >>> run = simulate(load_robot("hopper_c"), [0.0, 0.01], 3.0, height=0.2)
        >>> print(round(float(run.at(0.0).x2), 9), round(float(run.at(0.3).x1), 4))
        0.6 0.0161
        """
        state_of = type(self._all_legs[0].motion.end)
        state = state_of(*self._from_legs(t, lambda leg, times: leg.motion.at(times), 4))
        return state._replace(x2=state.x2 + self._ground(t))

    @overload
    def energy(self, t: float) -> Energy[float]: ...
    @overload
    def energy(self, t: Times) -> Energy[NDArray[np.floating]]: ...
    def energy(self, t: ArrayLike) -> Energy[Any]:
        """Energies [J] of body and robot at times t [s], in t's shape, weight from level 0 on. That of the body is E of
        (23): in stance it holds k (x2 - L0 - c)^2/2 of the spring, in flight nothing, so it jumps by k x1^2/2 at
        take-off and touchdown.
        """

        def from_level(leg: _Leg, times: Array) -> tuple[Real, Real]:
            energy, weight = leg.motion.energy(times), leg.motion.robot.letters.m_s * leg.motion.robot.letters.g
            return energy.body + weight * leg.ground, energy.total + weight * leg.ground

        return Energy(*self._from_legs(t, from_level, 2))

    def aed(self, t: ArrayLike) -> Real:
        """The body's energy predicted [J]: that of the start, plus the AED (24), the impacts and the spring's
        coordinate.
        """

        def predicted(leg: _Leg, times: Array) -> Real:
            return leg.level + (leg.motion.aed_at(times) if isinstance(leg.motion, Stance) else 0.0)

        return self._from_legs(t, predicted)[0]

    def _ground(self, t: ArrayLike) -> Real:
        """Height [m] of the ground at times t [s], in t's shape; in flight that of the ground ahead."""
        return self._from_legs(t, lambda leg, _: leg.ground)[0]

    def foot(self, t: ArrayLike) -> Real:
        """Height [m] of the foot over level 0 at times t [s], in t's shape; on the ground in stance."""

        def height(leg: _Leg, times: Array) -> Real:
            return leg.ground + (leg.motion.foot(times) if isinstance(leg.motion, Flight) else 0.0)

        return self._from_legs(t, height)[0]

    @overload
    def current(self, t: float) -> float: ...
    @overload
    def current(self, t: Times) -> NDArray[np.floating]: ...
    def current(self, t: ArrayLike) -> Real:
        """Current [A] that is asked for at times t [s], in t's shape; in flight that of the return's law."""
        return self._from_legs(t, lambda leg, times: leg.motion.current(times))[0]

    def _over(self, t: Array) -> dict[str, Any]:
        motion = {**self.at(t)._asdict(), "ground": self._ground(t), "foot": self.foot(t), "u": self.current(t)}
        body, total = self.energy(t)
        return motion | {"body_energy": body, "total_energy": total, "predicted_energy": self.aed(t)}

    def _from_legs(self, t: ArrayLike, values: Callable[[_Leg, Array], Any], count: int = 1) -> list[Real]:
        """Values, `count` each, at times in the flights and stances that they fall into; a touchdown is in its
        stance.
        """
        return self._read(t, lambda times: self._in_legs(times, values, count))

    def _in_legs(self, asked: Array, values: Callable[[_Leg, Array], Any], count: int) -> Array:
        legs, columns = self._all_legs, np.empty((count, asked.size))
        begins = [math.nextafter(leg.begin, math.inf) if leg.after_takeoff else leg.begin for leg in legs]
        places = np.maximum(np.searchsorted(np.maximum.accumulate(begins), asked, side="right") - 1, 0)
        order = np.argsort(places, kind="stable")
        for inside in np.split(order, np.flatnonzero(np.diff(places[order])) + 1) if order.size else ():
            leg = legs[int(places[inside[0]])]
            columns[:, inside] = values(leg, np.clip(asked[inside] - leg.begin, 0.0, leg.motion.duration))
        return columns


class _Known(NamedTuple):
    """A hop of which numbers are known, and no more: its motions are solved when they are asked for, to the same bits."""

    task: "_Task"
    takeoff: tuple[float, float, float]
    """x1, v1, v2 where its flight begins"""
    step: float
    touchdown: tuple[float, float, float]
    u: float

    def flight(self) -> Flight:
        return _flight(self.task, self.takeoff, 0.0, self.step)

    def stance(self) -> Stance:
        x1, v1, v2 = self.touchdown
        how = self.task.how
        return solve_stance(self.task.plant, x1=x1, v1=v1, v2=v2, u=self.u, horizon=self.task.horizon, **how)


class _Solved(NamedTuple):
    """A hop that is solved."""

    of_flight: Flight
    of_stance: Stance

    def flight(self) -> Flight:
        return self.of_flight

    def stance(self) -> Stance:
        return self.of_stance


@dataclass(frozen=True, repr=False, eq=False)
class Hop(_Legs):
    """A hop: the flight that leads to it, the stance, and the apex that follows; heights over level 0, hop heights in
    m.

    `at(t)` and its like take times t [s] since the flight began, 0 <= t <= duration, through both.

    height: of the apex from which it falls. apex: NaN without take-off.
    """

    index: int
    ground: float
    """[m]"""
    height: float
    touchdown_time: float
    """[s] since the start"""
    apex: float
    _motions: _Solved | _Known = field(repr=False)

    @cached_property
    def flight(self) -> Flight:
        """The flight that leads to it."""
        return self._motions.flight()

    @cached_property
    def stance(self) -> Stance:
        """The stance."""
        return self._motions.stance()

    @property
    def energy_lost_at_impact(self) -> float:
        """[J]"""
        return -self.flight.impact_loss

    @property
    def robot(self) -> Robot:
        """The plant, its gamma2 that of the current that really flows."""
        return self.stance.robot

    @property
    def duration(self) -> float:
        """[s] of flight and stance together"""
        return self.flight.duration + self.stance.duration

    def _chain(self) -> list[_Leg]:
        robot = self.robot
        level = float(self.flight.energy(0.0).body) + robot.letters.m_s * robot.letters.g * self.ground
        after = level + _spring_energy(robot, self.touchdown, self.flight.end_compression) - self.energy_lost_at_impact
        return [_Leg(0.0, self.flight, self.ground, level), _Leg(self.flight.duration, self.stance, self.ground, after)]

    def _card(self) -> Card:
        given = [("height", self.height), ("ground", self.ground), ("u", self.u)]
        rows = [("apex", self.apex), ("v2", self.touchdown.v2), ("aed", self.stance.aed), ("stop hit", self.hits_stop)]
        ends = f"{self.stance.status} {self.takeoff_time:.5g} s after the start"
        return Card(f"Hop {self.index} of {self.robot.label}: {ends}", given, rows)

    def _arrays(self) -> Mapping[str, Any]:
        return {name: ((), getattr(self, name)) for name in ("height", "apex")} | {"status": ((), self.stance.status)}

    @property
    def touchdown(self) -> State:
        """The state after the impact, with which the stance begins; x2 over the ground under the foot."""
        return cast(State, self.flight.touchdown)

    @property
    def u(self) -> float:
        """The current [A]; its mean over the stance where it has steps."""
        stance = self.stance
        if len(stance.u) == 1 or stance.duration == 0.0:
            return stance.u[0][1]
        t, u = (np.array(column) for column in zip(*stance.u, strict=True))
        return float(np.diff(np.minimum([*t, stance.duration], stance.duration)) @ u / stance.duration)

    @property
    def takeoff_time(self) -> float:
        """[s] since the start; the time of the ending where there is no take-off."""
        return self.touchdown_time + self.stance.duration

    @property
    def hits_stop(self) -> bool:
        """Whether the actuator met a stop in the stance or in the flight before."""
        return any(event.kind.endswith("_hits_stop") for event in (*self.stance.events, *self.flight.events))

    @property
    def bottoms_out(self) -> bool:
        """Whether the actuator met its upper stop in the stance."""
        hits = {each.time for each in self.stance.events if each.kind.endswith("_hits_stop")}
        top = self.robot.letters.x1_max
        return bool(hits) and any(phase.start in hits and phase.state.x1 == top for phase in self.stance.phases)


@dataclass(frozen=True, repr=False, eq=False)
class Run(_Legs):
    """Hops in a row. Times in s since the start, heights over level 0.

    status: "completed", all of the terrain was hopped, and the run ends at the apex behind it; "stopped", a stance
    ended without take-off, or a flight met its horizon; "tripped", the foot never got above the ground ahead. table: a
    row per hop, columns as in `COLUMNS`. robot: the plant, its gamma2 that of the current that really flows.
    """

    robot: Robot
    terrain: tuple[float, ...]
    status: RunStatus
    duration: float
    hops: tuple[Hop, ...]
    last: Flight | None = field(repr=False)
    """the flight behind the last hop; None if that has no take-off"""
    h_des: tuple[float, ...] = ()
    """[m] the controller's set point at each height of the terrain, where it has some"""

    @cached_property
    def table(self) -> NDArray[Any]:
        """A row per hop, a structured array with the columns of `COLUMNS`, to read.

        >>> from hopform import load_robot
        >>> run = simulate(load_robot("hopper_c"), [0.0, 0.01], 3.0, height=0.2)
        >>> run.table["apex"].round(4).tolist()
        [0.2233, 0.24]
        """
        rows = np.array([_row(hop) for hop in self.hops], dtype=[(name, kind) for name, kind, _ in COLUMNS])
        rows.flags.writeable = False
        return rows

    @property
    def warnings(self) -> tuple[str, ...]:
        """The warnings of its stances, each once."""
        return tuple(dict.fromkeys(warning for hop in self.hops for warning in hop.stance.warnings))

    ground = _Legs._ground

    def to_csv(self, path: str | Path) -> None:
        """Write the table, a line per hop; every number reads back to the same bits."""
        write({path: self.columns()})

    def columns(self) -> dict[str, Any]:
        """The columns of the table, by name."""
        return {name: self.table[name] for name, _, _ in COLUMNS}

    def to_npz(self, path: str | Path, samples: int = 2000) -> None:
        """Write a NumPy archive: `arrays(samples)`."""
        write({path: self.archive(samples)})

    def archive(self, samples: int = 2000) -> bytes:
        """The bytes of that archive."""
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **self.arrays(samples))
        return buffer.getvalue()

    def arrays(self, samples: int = 2000) -> dict[str, Any]:
        """table, terrain, and, at `times(samples)`, the columns of `motion`."""
        return {"table": self.table, "terrain": np.array(self.terrain), **self.motion(self.times(samples))}

    def motion(self, t: Array) -> dict[str, Any]:
        """t, x1, v1, x2, v2, ground, foot, u, E, H (`energy`), AED (`aed`) at times t [s] of one dimension."""
        short = {"body_energy": "E", "total_energy": "H", "predicted_energy": "AED"}
        return {"t": t} | {short.get(name, name): values for name, values in self._over(t).items()}

    def times(self, samples: int) -> Array:
        """Uniform times over the run, and those of touchdowns and take-offs."""
        corners = [time for hop in self.hops for time in (hop.touchdown_time, hop.takeoff_time)]
        uniform = np.linspace(0.0, self.duration, whole("samples", samples, most=MOST_SAMPLES))
        return np.union1d(uniform, np.minimum(corners, self.duration))

    def _first_flight(self) -> Flight:
        return cast(Flight, self.hops[0].flight if self.hops else self.last)

    def _chain(self) -> list[_Leg]:
        """Flight, stance, flight, ...; the energies are those of Figs. 13, 14: start, impact, AED, spring coordinate,
        and again.
        """
        robot, first, ground = self.robot, self._first_flight(), self.terrain[0]
        level = float(first.energy(0.0).body) + robot.letters.m_s * robot.letters.g * ground
        legs = [_Leg(0.0, first, ground, level)]
        flights = [*(hop.flight for hop in self.hops), self.last]
        for hop, after in zip(self.hops, flights[1:], strict=True):
            level += _spring_energy(robot, hop.touchdown, hop.flight.end_compression) - hop.energy_lost_at_impact
            legs.append(_Leg(hop.touchdown_time, hop.stance, hop.ground, level))
            level += hop.stance.aed - _spring_energy(robot, hop.stance.end, hop.stance.end_compression)
            if after is not None:
                ahead = self.terrain[min(hop.index + 1, len(self.terrain) - 1)]
                legs.append(_Leg(hop.takeoff_time, after, ahead, level, after_takeoff=True))
        return legs

    def _card(self) -> Card:
        height, u = [hop.height for hop in self.hops[:1]], [hop.u for hop in self.hops]
        given = [("height", height), ("terrain", list(self.terrain)), ("u", u)]
        stops = sum(hop.hits_stop for hop in self.hops)
        rows = [("apex", [hop.apex for hop in self.hops]), ("hops that meet a stop", stops)]
        title = f"Run of {self.robot.label}: {self.status} after {len(self.hops)} hops, {self.duration:.5g} s"
        return Card(title, given, [*rows, *(("warning", each) for each in self.warnings)])

    def _arrays(self) -> Mapping[str, Any]:
        table = {f"hop_{name}": (("hop",), self.table[name], _attrs(text)) for name, _, text in COLUMNS[1:]}
        return {"hop": (("hop",), self.table["index"]), "status": ((), self.status), **table}


def _spring_energy(robot: Robot, at: State, compression: float) -> float:
    """What the energy (23) of the body in stance has beside that in flight [J]: k (x2 - L0 - c)^2/2."""
    return float(robot.letters.k * (float(at.x1) - compression - robot.compression_at_rest) ** 2 / 2.0)


def _attrs(text: str) -> dict[str, str]:
    """Unit and meaning from the text of a column."""
    unit, _, meaning = text.partition(": ")
    return {name: words for name, words in (("units", unit.strip("-")), ("long_name", meaning)) if words}


def simulate(
    robot: Robot,
    terrain: Iterable[SupportsFloat],
    controller: Controller | Preparing | SupportsFloat = 0.0,
    *,
    height: SupportsFloat | None = None,
    start: State | None = None,
    gains: tuple[SupportsFloat, SupportsFloat] | None = None,
    errors: Errors = NONE,
    seed: int = 0,
    cell: tuple[int, int] = (0, 0),
    horizon: SupportsFloat = 2.0,
    max_phases: int = 4096,
    progress: Progress | None = None,
) -> Run:
    """The run that follows from a drop: each touchdown on the next height of a terrain, each stance as a controller
    wants it.

    terrain [m]: heights of the ground, one per hop (`hopform.hopping.terrain` makes some). controller: a current [A], or as
    `hopform.hopping.controllers` says. height [m]: hop height of the drop, the actuator at rest at its origin; or start, a
    state in the air; both over level 0. gains (Kp, Kd) of the return in flight as for `solve_flight`. errors: what the
    controller does not know, drawn with the seed and the cell: the numbers, from 0, of ground and errors in a
    `compare`, which draws other errors in each. Controllers of a cell share theirs. horizon [s]: longest time of a
    stance. progress: called after every hop with the number done and that of the terrain's heights; an exception from
    it, as from Ctrl-C, ends the run.
    Raises HopformError for a value that is not allowed: an empty terrain, g = 0, a set point below the ground; and for
    what a controller answers that is no current.

    >>> from hopform import load_robot
    >>> run = simulate(load_robot("hopper_c"), [0.0, 0.0], 3.0, height=0.2)
    >>> run.status, [round(hop.apex, 4) for hop in run.hops]
    ('completed', [0.2233, 0.2356])
    """
    falling_robot(robot, "hop", "hopping")
    key = (whole("seed", seed, 0, math.inf), *_cell(cell))
    if not (progress is None or callable(progress)):
        raise HopformError(f"progress must be a function, got {shown(progress)}")
    if not isinstance(errors, Errors):
        raise HopformError(f"errors must be Errors, got {shown(errors)}")
    grounds = heights_of(terrain)
    longest = positive("horizon", horizon, "s")
    plant = robot if errors.current_scale == 1.0 else _scaled(robot, errors.current_scale)
    model = robot if errors.model is None else errors.model
    first = _start(robot, height, start)
    number = isinstance(controller, SupportsFloat) and np.ndim(cast(Any, controller)) == 0
    asked: Any = ConstantCurrent(finite("u", controller, "A")) if number else controller
    prepared: Any = asked.prepare(model, grounds) if getattr_static(asked, "prepare", None) else asked
    if not callable(prepared):
        raise HopformError(f"controller must be a current in A or a callable, got {shown(controller)}")
    how = {"max_phases": max_phases}
    task = _Task(plant, model, grounds, cast(Controller, prepared), gains, errors, key, longest, how, progress)
    run = _known_run(task, first, asked.u) if _is_known(task, asked) else None
    return replace(run or _run(task, first), h_des=_set_points(controller, len(grounds)))


def _set_points(controller: object, count: int) -> tuple[float, ...]:
    """The set points of a controller that has some, the last one for all that follow."""
    h_des: Any = getattr(controller, "h_des", ())
    points = cast("tuple[float, ...]", h_des if isinstance(h_des, tuple) else (h_des,))
    return tuple(points[min(n, len(points) - 1)] for n in range(count)) if points else ()


def _cell(cell: object) -> tuple[int, int]:
    what = "a pair of whole numbers, those of ground and errors"
    ground, errors, *more = (*items("cell", cell, what, 2), None, None)
    if len(more) != 2:
        raise HopformError(f"cell must be {what}, got {shown(cell)}")
    return whole("cell[0]", ground, 0), whole("cell[1]", errors, 0)


class _Task(NamedTuple):
    """The constants of a run."""

    plant: Robot
    model: Robot
    grounds: tuple[float, ...]
    controller: Controller
    gains: tuple[SupportsFloat, SupportsFloat] | None
    errors: Errors
    key: tuple[int, int, int]
    horizon: float
    how: dict[str, Any]
    progress: Progress | None

    def sensors(self, role: Role, index: int) -> "np.random.Generator | None":
        """The random stream of a hop's errors in a role, None where there are no errors. Each hop has its own, so
        controllers meet the same errors, however often they measured before.
        """
        return None if self.errors is NONE else stream(role, *self.key, index)


def _scaled(robot: Robot, scale: float) -> Robot:
    """The robot whose force per current is that of another, times a scale; HopformError if no parameter is that."""
    name = str(robot.solver.facts.inputs[0]["per_unit"]).removeprefix("-") if robot.solver.facts.inputs else ""
    if name not in robot.parameters._fields:
        raise HopformError(
            f"errors.current_scale must be 1: no parameter of {robot.solver.name} is its force per current"
        )
    return robot.with_parameters({name: robot[name] * scale})


def _start(robot: Robot, height: SupportsFloat | None, start: State | None) -> State:
    """The state in the air, x2 over level 0."""
    if (height is None) == (start is None):
        got = f"got height = {shown(height)}, start = {shown(start)}"
        raise HopformError(f"give either height or start, {got}")
    if start is None:
        return State(robot.home, 0.0, finite("height", height, "m") + robot.standing_height, 0.0)
    entries = items("start", start, "a State of x1, v1, x2, v2", 4)
    if len(entries) != 4:
        raise HopformError(f"start must be a State of x1, v1, x2, v2, got {shown(start)}")
    return State(*map(finite, (f"start.{name}" for name in State._fields), entries, ("m", "m/s", "m", "m/s")))


def _run(task: _Task, start: State) -> Run:
    hops: list[Hop] = []
    time, (x1, v1, _, v2), leg, apex = 0.0, start, 0.0, math.nan
    for index, ground in enumerate(task.grounds):
        step = ground - task.grounds[index - 1] if index else _first_step(task, start)
        flight = _flight(task, (x1, v1, v2), leg, step)
        if flight.status != "touchdown":
            status: RunStatus = "tripped" if flight.status == "tripped" else "stopped"
            return Run(task.plant, task.grounds, status, time + flight.duration, tuple(hops), flight)
        time += flight.duration
        apex = apex if index else flight.apex + ground
        hop = _hop(task, index, time, apex, flight)
        hops.append(hop)
        if task.progress is not None:
            task.progress(len(hops), len(task.grounds))
        time = hop.takeoff_time
        if hop.stance.takeoff is None:
            return Run(task.plant, task.grounds, "stopped", time, tuple(hops), None)
        (x1, v1, _, v2), leg, apex = hop.stance.takeoff, hop.stance.end_compression, hop.apex
    last = _flight(task, (x1, v1, v2), leg, 0.0)
    return Run(task.plant, task.grounds, "completed", time + last.apex_time, tuple(hops), last)


def _is_known(task: _Task, asked: object) -> bool:
    """Whether nothing of a run needs Python: one current, no errors, nobody who asks for progress, a leg without a damper,
    which would hand on what is left of its compression; and more than a few hops.
    """
    relaxes = float(task.plant.solver.package.formulas.leg_time(task.plant.parameters)) > 0.0
    several = len(task.grounds) > FEW_HOPS
    return several and type(asked) is ConstantCurrent and task.errors == NONE and task.progress is None and not relaxes


def _known_run(task: _Task, start: State, u: float) -> Run | None:
    """The same under one current, which nobody has to be asked for: its hops are solved by one call. None where a stance
    or a flight is refused, to say of which hop and why.
    """
    first = _flight(task, (start.x1, start.v1, start.v2), 0.0, _first_step(task, start))
    if first.status != "touchdown":
        return None
    plant, grounds = task.plant, task.grounds
    runs = solve_hops(
        plant, start=start, u=u, ground=grounds, hops=len(grounds), gains=task.gains, horizon=task.horizon, states=True,
        **task.how,
    )  # fmt: skip
    if runs.status < 0:
        return None
    count, duration = int(runs.hops), float(runs.duration)
    columns: Any = (runs.touchdown_time, runs.apex, *cast(State, runs.touchdown), *cast(State, runs.stance_end))
    rows = list(zip(*(column[:count].tolist() for column in columns), strict=True))
    hops, before, height, ahead = list[Hop](), (start.x1, start.v1, start.v2), first.apex + grounds[0], grounds[0]
    for index, (time, apex, x1, v1, _, v2, x1_end, v1_end, _, v2_end) in enumerate(rows):
        step = grounds[index] - ahead if index else _first_step(task, start)
        known = _Known(task, before, step, (x1, v1, v2), u)
        hops.append(Hop(index, grounds[index], height, time, apex, known))
        before, height, ahead = (x1_end, v1_end, v2_end), apex, grounds[index]
    status: RunStatus = cast(Any, runs.words.item())
    if status == "completed":
        last = _flight(task, before, 0.0, 0.0)
        return Run(plant, grounds, status, duration + last.apex_time, tuple(hops), last)
    stood = math.isnan(height)
    return Run(
        plant,
        grounds,
        status,
        duration,
        tuple(hops),
        None if stood else _flight(task, before, 0.0, grounds[count] - ahead),
    )


def _first_step(task: _Task, start: State) -> float:
    """How far the first ground is above the foot of the unloaded leg [m]; 0 within rounding."""
    letters, rest = task.plant.letters, task.plant.compression_at_rest
    step = start.x1 - (start.x2 - task.grounds[0]) + letters.L0 + letters.c - rest
    return 0.0 if abs(step) <= TOUCHING_ULP * math.ulp(letters.L0) else step


def _flight(task: _Task, start: tuple[float, float, float], leg: float, step: float) -> Flight:
    """From x1, v1, v2 and the leg's compression over the old ground to the next touchdown, `step` [m] higher, within the
    time that `solve_hops` gives a flight.
    """
    x1, v1, v2 = map(float, start)
    g = task.plant.fall
    longest = 10.0 + 2.0 * (abs(v2) + math.sqrt(v2 * v2 + 2.0 * g * (1.0 + abs(step)))) / g
    how: dict[str, Any] = task.how | {"compression": leg, "gains": _gains(task, x1, v2), "horizon": longest}
    return solve_flight(task.plant, x1=x1, v1=v1, v2=v2, step=step, **how)


def _gains(task: _Task, x1: float, v2: float) -> tuple[SupportsFloat, SupportsFloat] | None:
    """Gains of the force as the plant feels it, where the controller's own idea of gamma2 or of the robot is
    another.
    """
    plant, model, gains = task.plant, task.model, task.gains
    if plant is model or (plant.letters.gamma2 == 0.0 or model.letters.gamma2 == 0.0):
        return gains
    if gains is None:
        formulas = model.solver.package.formulas
        fall = (
            float(formulas.time_of_fall(model.parameters, v2, x1))
            if v2 * v2 + 2.0 * model.letters.g * x1 > 0.0
            else 0.0
        )
        gains = Gains(*map(float, formulas.critical_gains(model.parameters, max(fall - 0.05, 0.02))))
    ratio = plant.letters.gamma2 / model.letters.gamma2
    if ratio < 0.0:
        raise HopformError(f"model.gamma2 must have the sign of the robot's, got {model.letters.gamma2!r} N/A")
    return finite("Kp", gains[0], "N/m") * ratio, finite("Kd", gains[1], "N s/m") * ratio


def _hop(task: _Task, index: int, time: float, height: float, flight: Flight) -> Hop:
    """The controller's answer at a touchdown, and the stance that follows."""
    ground = task.grounds[index]
    try:
        stance = _stance(task, task.controller(_seen(task, index, time, height, flight)), index, time, flight)
    except HopformError as error:
        raise HopformError(f"hop {index}: {error}") from None
    return Hop(index, ground, height, time, stance.apex + ground, _Solved(flight, stance))


def _seen(task: _Task, index: int, time: float, height: float, flight: Flight) -> Touchdown:
    x1, v1, _, v2 = map(float, cast(State, flight.touchdown))
    sensors = task.sensors(Role.TOUCHDOWN_SENSORS, index)
    seen = _measured(task, sensors, x1=x1, v1=v1, v2=v2, ground=task.grounds[index], x2=height)
    place, apex = min(max(seen.pop("x1"), task.model.letters.x1_min), task.model.letters.x1_max), seen.pop("x2")
    return Touchdown(index, time, place, apex=apex, robot=task.model, compression=flight.end_compression, **seen)


def _measured(task: _Task, sensors: "np.random.Generator | None", **values: float) -> dict[str, float]:
    """Values as sensors have them: with errors that are drawn in this order, 0 where there are none."""
    drawn = np.zeros(len(values)) if sensors is None else sensors.standard_normal(len(values))
    errors = [getattr(task.errors, name) * each for name, each in zip(values, drawn.tolist(), strict=True)]
    return {name: value + error for (name, value), error in zip(values.items(), errors, strict=True)}


def _stance(task: _Task, answer: Answer, index: int, time: float, flight: Flight) -> Stance:
    state, leg, wait = cast(State, flight.touchdown), flight.end_compression, _wait(task.errors, time)
    if isinstance(answer, Sampled):
        u: Any = _sampled(task, answer, index, wait, state, leg)
    else:  # none flows before the touchdown is seen
        u = _later(answer, wait) if wait else answer
    start: dict[str, Any] = {"x1": state.x1, "v1": state.v1, "v2": state.v2, "compression": leg}
    return solve_stance(task.plant, **start, u=u, horizon=task.horizon, **task.how)


def _later(answer: Any, wait: float) -> Any:
    """The current of an answer that is detected so much later; what is no answer as it is, for the stance to refuse."""
    if isinstance(answer, SupportsFloat) and np.ndim(cast(Any, answer)) == 0:
        return [(0.0, 0.0), (wait, answer)]
    steps = items("u", answer, "a current in A or steps (t, u)", MOST_STEPS)
    try:
        return [(0.0, 0.0), *((wait + t, u) for t, u in steps)]
    except (TypeError, ValueError):
        return steps


def _wait(errors: Errors, time: float) -> float:
    """Delay [s] with which a touchdown is detected."""
    ticks = errors.quantum > math.ulp(time)  # a clock that is finer than the time's last digit makes no tick
    tick = math.ceil(time / errors.quantum) * errors.quantum - time if ticks else 0.0
    return max(tick, 0.0) + errors.delay


def _sampled(
    task: _Task, answer: Sampled, index: int, wait: float, state: State, leg: float
) -> list[tuple[float, float]]:
    """The steps of the current that a law makes, each from the state that the steps before lead to."""
    at: Any = state
    ground, sensors = task.grounds[index], task.sensors(Role.TICK_SENSORS, index)
    steps = [(0.0, 0.0)] if wait else list[tuple[float, float]]()
    period, t, begin = answer.period, 0.0, True
    if task.horizon / period > MOST_TICKS:
        raise HopformError(f"period must be >= {task.horizon / MOST_TICKS!r} s, horizon/{MOST_TICKS}, got {period!r}")
    while t < task.horizon:
        if t >= wait:
            x1, v1, x2, v2 = map(float, at)
            seen = State(**_measured(task, sensors, x1=x1, v1=v1, x2=x2 + ground, v2=v2))
            u = finite("u", answer.law(t - wait, seen), "A")
            if not steps or steps[-1][1] != u:
                steps.append((t, u))
        length = period if t >= wait else wait
        of_leg = {"compression": leg} if begin else {"x2": at.x2}
        start: dict[str, Any] = {"x1": at.x1, "v1": at.v1, "v2": at.v2} | of_leg
        piece = solve_stance(task.plant, **start, u=steps[-1][1], horizon=length, **task.how)
        if piece.status != "horizon" and not (piece.status == "rest" and t + length < task.horizon):
            break
        at, begin = piece.end, False
        t = wait + period * round((t + length - wait) / period)
    return steps


def _row(hop: Hop) -> tuple[Any, ...]:
    stance, start = hop.stance, hop.touchdown
    end = stance.takeoff
    takeoff = (math.nan,) * 4 if end is None else (end.x1, end.v1, float(end.x2) + hop.ground, end.v2)
    before, after_it = stance.energy([0.0, stance.duration]).body.tolist()
    begin = (hop.index, hop.ground, hop.height, hop.touchdown_time, start.x1, start.v1, start.v2, hop.u)
    after = (stance.status, stance.duration, *takeoff, hop.apex, stance.aed, after_it - before)
    return (*begin, *after, hop.energy_lost_at_impact, hop.hits_stop, hop.bottoms_out)
