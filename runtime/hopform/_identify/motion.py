"""Motions at sample times with exact derivatives by everything that they depend on, through sticking and reversals.

A stance is solved in the compression y = x_1 - x_2 + L0 + c, and pulls nothing: at y = 0 it ends in a take-off. A rig
whose spring is fixed at both ends pushes and pulls. Under

    c -> c + P,     g -> g + k P/m_s

y grows by P while both (3) and (4) stay as they are: k (x_2 - x_1 - L0) knows no c, and k (y + P) - m_s g - k P = k y -
m_s g. So a spring that pulls is one that is preloaded by more than it ever moves.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hopform._errors import HopformError
from hopform._sensitivities import COLUMNS, in_height
from hopform._solver.choice import DEFAULT, SolvedStance
from hopform._solver.columns import Steps
from hopform._solver.package import ENDINGS, ROWS, records
from hopform._stance import DOUBLE

Array = NDArray[np.float64]
Values = Mapping[str, float]
"""Letters of a rig, or parameters, by their names."""
STATE = ("x1", "v1", "x2", "v2")
AT = {name: number for number, name in enumerate(COLUMNS)}
"""Where a derivative's column is: initial state x1, v1, x2, v2, the current u (all steps alike), the robot's fields."""
MAX_PHASES = 200_000
FIRM = 1e12
"""[m/s^2] friction under which no body ever moves: how a body is held."""
_LENGTHS = [AT["L0"], AT["c"]]


@dataclass(frozen=True)
class Motion:
    """States (times, 4), rows x1, v1, x2, v2, and their derivatives (times, 4, columns)."""

    states: Array
    by: Array


@dataclass(frozen=True)
class Piece:
    """A stance up to its ending: the motion at the times asked for, and the take-off if there is one."""

    motion: Motion
    duration: float
    end: Array | None
    end_by: Array | None
    duration_by: Array | None


def stance(
    robot: records.Robot, start: Sequence[float], steps: Steps, times: Array, backend: str | None = None
) -> Motion:
    """The motion from a state x1, v1, x2, v2 at t = 0 at times that do not decrease; HopformError if the leg takes off
    before.
    """
    piece = stance_piece(robot, start, steps, times, None, backend)
    if piece.motion.states.shape[0] < times.size:
        raise HopformError(f"the leg takes off after {piece.duration!r} s, before the last sample")
    return piece.motion


def states(
    robot: records.Robot, start: Sequence[float], steps: Steps, times: Array, backend: str | None = None
) -> Array:
    """The states alone of such a motion, (times, 4), without their derivatives."""
    x1, v1, x2, v2 = start
    state = records.LegState(x1, v1, v2, x1 - x2 + robot.L0 + robot.c)
    found = solved(robot, state, steps, float(times[-1]) * (1.0 + 1e-12), backend)
    at = found.state_at(np.minimum(times, found.outcome()[1]))
    return np.stack([at.x1, at.v1, at.x1 - at.y + robot.L0 + robot.c, at.v2], axis=1)


def solved(
    robot: records.Robot, state: records.LegState, steps: Steps, horizon: float, backend: str | None
) -> SolvedStance:
    """A stance as its back end has it; HopformError for more phases than any recording has."""
    found = DEFAULT.back_end(backend).solve_stance(robot, state, steps, horizon, MAX_PHASES, DOUBLE)
    if ENDINGS[found.outcome()[0]] == "too_many_phases":
        raise HopformError(f"the motion has more than {MAX_PHASES} phases: hardly any friction for so long a recording")
    return found


def _of_height(rows: NDArray[Any], given: bool) -> Array:
    """Derivatives of x1, v1, x2, v2 by the columns from those of x1, v1, v2, y, as `in_height` has them, in one new
    array.
    """
    by = np.empty((rows.shape[0], len(STATE), len(COLUMNS)))
    by[:, :2], by[:, 3] = rows[:, :2], rows[:, 2]
    np.subtract(rows[:, 0], rows[:, 3], out=by[:, 2])
    by[:, 2, _LENGTHS] += 1.0
    by_y = by[:, :, AT["x2"]].copy()
    if given:
        for name in (AT["x1"], *_LENGTHS):
            by[:, :, name] += by_y
        by[:, :, AT["x2"]] = -by_y
    else:
        by[:, :, AT["x2"]] = 0.0
    return by


def stance_piece(
    robot: records.Robot, start: Sequence[float], steps: Steps, times: Array, y: float | None, backend: str | None
) -> Piece:
    """A stance of at most the given times; y is the compression at the start, from the state if None."""
    x1, v1, x2, v2 = start
    given = y is None
    compression = max(x1 - x2 + robot.L0 + robot.c, 0.0) if y is None else y
    horizon = max(float(times[-1]), 1e-9) * (1.0 + 1e-12) if times.size else 1e-9
    found = solved(robot, records.LegState(x1, v1, v2, compression), steps, horizon, backend)
    ending, duration, last, *_ = found.outcome()
    within = times if ENDINGS[ending] == "rest" else times[times <= duration]
    at, rows = found.tangents(np.ascontiguousarray(within))
    by = _of_height(rows, given)
    height = at.x1 - at.y + robot.L0 + robot.c
    motion = Motion(np.stack([at.x1, at.v1, height, at.v2], axis=1), by)
    if ENDINGS[ending] != "takeoff":
        return Piece(motion, duration, None, None, None)
    ends = in_height(found.sensitivities(), given)
    place = [ROWS.index(name) for name in STATE]
    end = np.array([last.x1, last.v1, last.x1 + robot.L0 + robot.c, last.v2])
    return Piece(motion, duration, end, ends[place], ends[ROWS.index("T")])
