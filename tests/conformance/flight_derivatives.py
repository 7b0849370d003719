"""Derivatives of flights against differences of a flight through the same phases, to 60 digits."""

import math
from typing import Any

import numpy as np

import hopform
from tests.conformance.errors import rounded
from tests.oracle import flight_branch as branch
from tests.oracle.flight_branch import Phase, mp

UNITS = {"x1": 0.1, "x2": 0.1, "ground": 0.1, "v1": 1.0, "v2": 1.0, "c": 0.01, "L0": 0.1, "x1_min": 0.1, "x1_max": 0.1}
FLOOR = 1e-3
DIFFERENCE = mp.mpf("1e-10")
ENDS = {
    "x1_reverses": "rest",
    "x1_sticks": "rest",
    "x1_hits_stop": "stop",
    "u_saturates": "pull",
    "u_desaturates": "pull",
}


def phases_of(flight: hopform.Flight) -> list[Phase]:
    """The phases of a flight, each with what ends it."""
    robot, events = flight.robot, {event.time: event.kind for event in flight.events}
    ends = [ENDS[events[phase.end]] for phase in flight.phases[:-1]] + [ending_of(flight)]
    lost = flight._solved.flight.start_loss < 0.0
    return [
        Phase(phase.mode_1, phase.limit, phase.end, end, is_held(robot, phase), lost and n == 0)
        for n, (phase, end) in enumerate(zip(flight.phases, ends, strict=True))
    ]


def is_held(robot: hopform.Robot, phase: hopform.FlightPhase) -> bool:
    """Whether the actuator is held: at rest between its stops without friction it follows any change."""
    rubs = robot.f1 + robot.f1_excess > 0.0
    return phase.mode_1 == 0 and (rubs or not robot.x1_min < phase.x1 < robot.x1_max)


def ending_of(flight: hopform.Flight) -> str:
    """What ends the last phase: of a foot that never got above the ground that is where it was highest."""
    if flight.status == "touchdown":
        return "ground"
    rate, robot = flight.end.v2 - flight.end.v1, flight.robot
    speeds = abs(flight._solved.flight.start.v2) + abs(flight.end.v2) + abs(flight.end.v1)
    rises = rate > 100.0 * float(np.finfo(flight.dtype).eps) * speeds
    if flight.status != "tripped" or flight.duration == 0.0:
        return "fixed"
    if not rises:
        return "top"
    return "stop" if flight.end.x1 in (robot.x1_min, robot.x1_max) else "fixed"


def size_of(name: str, value: float) -> float:
    """The change of an input that matters: its own size, or a unit of its kind where that is more."""
    return max(abs(value) if math.isfinite(value) else 0.0, UNITS.get(name, 0.0)) or 1.0


def inputs_of(flight: hopform.Flight) -> tuple[dict[str, float], dict[str, Any]]:
    """The robot and the start with gains, as the library saw them: x2 over the ground ahead."""
    robot, solved = rounded(flight.robot, flight.dtype.type), flight._solved.flight
    at = solved.start
    x2 = mp.mpf(at.x1) + mp.mpf(robot["L0"]) + mp.mpf(robot["c"]) - mp.mpf(at.y) - mp.mpf(solved.ground)
    return robot, {"x1": at.x1, "v1": at.v1, "x2": x2, "v2": at.v2, "Kp": flight.gains.Kp, "Kd": flight.gains.Kd}


def compared(flight: hopform.Flight, *, x2_is_given: bool, design: bool) -> tuple[Any, Any, Any]:
    """Our matrix, that by differences, 0 where an input is infinite, and the sizes of the columns."""
    robot, start = inputs_of(flight)
    sizes = sizes_of(flight)
    theirs = by_differences(flight, robot, start, x2_is_given=x2_is_given, design=design)
    return flight.sensitivities.matrix, theirs, np.array([*sizes.values()])


def sizes_of(flight: hopform.Flight) -> dict[str, float]:
    robot, start = inputs_of(flight)
    values = {**robot, "ground": 0.0, **{name: float(value) for name, value in start.items()}}
    return {name: size_of(name, values[name]) for name in flight.sensitivities.columns}


def by_differences(
    flight: hopform.Flight, robot: dict[str, Any], start: dict[str, Any], *, x2_is_given: bool, design: bool
) -> Any:
    """The matrix of the branch of a flight, from a robot and a start near to its own."""
    sizes = sizes_of(flight)
    asked = {name: size for name, size in sizes.items() if mp.isfinite(robot.get(name, 0.0))}
    found = branch.derivatives(robot, start, phases_of(flight), flight.status, asked, design=design)
    columns, zero = dict(zip(asked, found, strict=True)), [mp.zero] * len(branch.ROWS)
    if not x2_is_given:
        for name in ("x1", "L0", "c"):  # which the height follows
            columns[name] = [a - b for a, b in zip(columns[name], columns["ground"], strict=True)]
        columns["x2"] = zero
    return np.array([[float(each) for each in columns.get(name, zero)] for name in sizes]).T


def condition(flight: hopform.Flight, *, x2_is_given: bool, design: bool) -> float:
    """How much the derivatives move for a relative change of an input, in the units of the error: the largest of all."""
    robot, start = inputs_of(flight)
    how, sizes = {"x2_is_given": x2_is_given, "design": design}, np.array([*sizes_of(flight).values()])
    here, largest = by_differences(flight, robot, start, **how), 0.0
    for name in (name for name in (*robot, *start) if (robot | start)[name] and mp.isfinite((robot | start)[name])):
        changed = [
            {**each, name: mp.mpf(each[name]) * (1 + DIFFERENCE)} if name in each else each for each in (robot, start)
        ]
        moved = by_differences(flight, *changed, **how)
        largest = max(largest, scaled_error(moved, here, sizes) / float(DIFFERENCE))
    return largest


def scaled_error(ours: Any, theirs: Any, sizes: Any) -> float:
    """The largest error, each column of its size, each row in units of its largest entry, or of FLOOR s, m, m/s where
    that is more.
    """
    scale = np.maximum(np.max(np.abs(theirs * sizes), axis=1, keepdims=True), FLOOR)
    known = ~np.isnan(ours).all(axis=1)
    return float(np.max((np.abs(ours - theirs) * sizes / scale)[known]))
