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
    rises = rate > 1e-6 * (abs(flight.end.v2) + abs(flight.end.v1))
    if flight.status != "tripped" or flight.duration == 0.0:
        return "fixed"
    if not rises:
        return "top"
    return "stop" if flight.end.x1 in (robot.x1_min, robot.x1_max) else "fixed"


def size_of(name: str, value: float) -> float:
    """The change of an input that matters: its own size, or a unit of its kind where that is more."""
    return max(abs(value) if math.isfinite(value) else 0.0, UNITS.get(name, 0.0)) or 1.0


def compared(flight: hopform.Flight, *, x2_is_given: bool, design: bool) -> tuple[Any, Any, Any]:
    """Our matrix, that by differences (0 for what has no column there), and the sizes of the columns."""
    robot, solved = rounded(flight.robot, flight.dtype.type), flight._solved.flight
    at = flight._solved.flight.start
    x2 = mp.mpf(at.x1) + mp.mpf(robot["L0"]) + mp.mpf(robot["c"]) - mp.mpf(at.y) - mp.mpf(solved.ground)
    start = {"x1": at.x1, "v1": at.v1, "x2": x2, "v2": at.v2, "Kp": flight.gains.Kp, "Kd": flight.gains.Kd}
    columns = flight.sensitivities.columns
    values = {**robot, "ground": 0.0, **{k: float(v) for k, v in start.items()}}
    sizes = {name: size_of(name, values[name]) for name in columns}
    asked = {name: size for name, size in sizes.items() if math.isfinite(values[name])}
    found = branch.derivatives(robot, start, phases_of(flight), flight.status, asked, design=design)
    theirs = dict(zip(asked, found, strict=True))
    zero = [mp.zero] * len(branch.ROWS)
    if not x2_is_given:
        down = [-each for each in theirs["ground"]]
        for name in ("x1", "L0", "c"):
            theirs[name] = [a + b for a, b in zip(theirs[name], down, strict=True)]
        theirs["x2"] = zero
    matrix = np.array([[float(each) for each in theirs.get(name, zero)] for name in columns]).T
    return flight.sensitivities.matrix, matrix, np.array([sizes[name] for name in columns])


def scaled_error(ours: Any, theirs: Any, sizes: Any) -> float:
    """The largest error, each column of its size, each row in units of its largest entry, or of FLOOR s, m, m/s where
    that is more.
    """
    scale = np.maximum(np.max(np.abs(theirs * sizes), axis=1, keepdims=True), FLOOR)
    known = ~np.isnan(ours).all(axis=1)
    return float(np.max((np.abs(ours - theirs) * sizes / scale)[known]))
