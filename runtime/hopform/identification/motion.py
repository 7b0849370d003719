"""Motions at sample times with exact derivatives by everything that they depend on, through sticking and reversals.

A stance is solved in the compression y = x_1 - x_2 + L0 + c, and pulls nothing: at y = 0 it ends in a take-off. A rig whose
spring is fixed at both ends pushes and pulls. Under

    c -> c + P,     g -> g + k P/m_s

y grows by P while both (3) and (4) stay as they are: k (x_2 - x_1 - L0) knows no c, and k (y + P) - m_s g - k P = k y - m_s g.
So a spring that pulls is one that is preloaded by more than it ever moves.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hopform.backends import MODULES, choose
from hopform.errors import HopformError
from hopform.sensitivities import COLUMNS, in_height
from hopform_solver import records
from hopform_solver.records import ENDINGS
from hopform_solver.sensitivity import ROWS

Array = NDArray[np.float64]
STATE = ("x1", "v1", "x2", "v2")
AT = {name: number for number, name in enumerate(COLUMNS)}
"""Where a derivative's column is: initial state x1, v1, x2, v2, the current u (all steps alike), the robot's fields."""
MAX_PHASES = 200_000
FIRM = 1e12
"""[m/s^2] friction under which no body ever moves: how a body is held."""
_MOST_HOPS = 400
_DOUBLE = np.dtype(np.float64)
_LENGTH_BY = np.array([1.0 if name in ("L0", "c") else 0.0 for name in COLUMNS])


@dataclass(frozen=True)
class Motion:
    """States (times, 4), rows x1, v1, x2, v2, and their derivatives (times, 4, columns)."""

    states: Array
    by: Array


@dataclass(frozen=True)
class _Piece:
    """A stance up to its ending: the motion at the times asked for, and the take-off if there is one."""

    motion: Motion
    duration: float
    end: Array | None
    end_by: Array | None
    duration_by: Array | None


def stance(
    robot: records.Robot,
    start: Sequence[float],
    steps: tuple[tuple[float, float], ...],
    times: Array,
    backend: str | None = None,
) -> Motion:
    """The motion from a state x1, v1, x2, v2 at t = 0 at times that do not decrease; HopformError if the leg takes off before."""
    piece = _stance(robot, start, steps, times, None, backend)
    if piece.motion.states.shape[0] < times.size:
        raise HopformError(f"the leg takes off after {piece.duration!r} s, before the last sample")
    return piece.motion


def _stance(
    robot: records.Robot,
    start: Sequence[float],
    steps: tuple[tuple[float, float], ...],
    times: Array,
    y: float | None,
    backend: str | None,
) -> _Piece:
    """A stance of at most the given times; y is the compression at the start, from the state if None."""
    x1, v1, x2, v2 = start
    given = y is None
    compression = x1 - x2 + robot.L0 + robot.c if y is None else y
    horizon = max(float(times[-1]), 1e-9) * (1.0 + 1e-12) if times.size else 1e-9
    module = MODULES[choose(backend)]
    state = records.State(x1, v1, v2, compression)
    solved = module.solve(robot, state, steps, horizon, MAX_PHASES, _DOUBLE)
    ending, duration, *_ = solved.outcome()
    if ENDINGS[ending] == "too_many_phases":
        raise HopformError(f"the motion has more than {MAX_PHASES} phases: hardly any friction for so long a recording")
    within = times if ENDINGS[ending] == "rest" else times[times <= duration]
    at, rows = solved.tangents(np.ascontiguousarray(within))
    matrix = in_height(rows, given)
    by = np.stack([matrix[:, 0], matrix[:, 1], matrix[:, 0] - matrix[:, 3], matrix[:, 2]], axis=1)
    by[:, 2, AT["L0"]] += 1.0
    by[:, 2, AT["c"]] += 1.0
    height = at.x1 - at.y + robot.L0 + robot.c
    motion = Motion(np.stack([at.x1, at.v1, height, at.v2], axis=1), by)
    if ENDINGS[ending] != "takeoff":
        return _Piece(motion, duration, None, None, None)
    ends = in_height(solved.sensitivities(), given)
    place = [ROWS.index(name) for name in STATE]
    last = solved.outcome()[2]
    end = np.array([last.x1, last.v1, last.x1 + robot.L0 + robot.c, last.v2])
    return _Piece(motion, duration, end, ends[place], ends[ROWS.index("T")])


def _chain(by: Array, state_by: Array, begin_by: Array, rates: Array) -> Array:
    """Derivatives (..., rows, columns) of a piece from those of the state that it starts with and of its beginning's time."""
    total = np.asarray(by[..., : len(STATE)] @ state_by)
    total[..., len(STATE) :] += by[..., len(STATE) :]
    return np.asarray(total - rates[..., np.newaxis] * begin_by)


def _rates(robot: records.Robot, states: Array) -> Array:
    """How fast x1, v1, x2, v2 change; the actuator is locked."""
    y = states[..., 0] - states[..., 2] + robot.L0 + robot.c
    v2 = states[..., 3]
    a2 = (robot.k * y - robot.b2 * v2) / robot.m_s - robot.g - robot.f2 * np.sign(v2)
    zero = np.zeros_like(v2)
    moves = (v2 != 0.0).astype(float)
    return np.stack([zero, zero, v2, a2 * moves], axis=-1)


def _flight(robot: records.Robot, run: "_Run", times: Array) -> tuple[Motion, "_Run"]:
    """The flight of a body over a locked actuator: the motion at the times that lie in it, and the touchdown after the impact."""
    if not robot.g > 0.0:
        raise HopformError(f"a drop needs g > 0 m/s^2, got {robot.g!r}")
    length, x, v, by = robot.L0 + robot.c, run.state[2], run.state[3], run.state_by
    down = -math.sqrt(max(v * v + 2.0 * robot.g * (x - length), 0.0))
    airtime = (v - down) / robot.g
    t = times[: int(np.count_nonzero(times <= run.begin + airtime))] - run.begin
    zero, velocity = np.zeros(t.size), v - robot.g * t
    states = np.stack([zero, zero, x + v * t - 0.5 * robot.g * t * t, velocity], axis=1)
    rows = np.zeros((t.size, 4, len(COLUMNS)))
    rows[:, 2] = by[2] + t[:, np.newaxis] * by[3] - velocity[:, np.newaxis] * run.begin_by
    rows[:, 3] = by[3] + robot.g * run.begin_by
    rows[:, 2, AT["g"]] -= 0.5 * t * t
    rows[:, 3, AT["g"]] -= t
    # The foot is down where x + v T - g T^2/2 = L0 + c.
    late = (by[2] + airtime * by[3] - _LENGTH_BY) / -down
    late[AT["g"]] += 0.5 * airtime * airtime / down
    down_by = by[3] - robot.g * late
    down_by[AT["g"]] -= airtime
    kept = math.sqrt(1.0 - robot.impact_loss)
    after_by = np.zeros_like(by)
    after_by[2], after_by[3] = _LENGTH_BY, kept * down_by
    after_by[3, AT["impact_loss"]] -= down / (2.0 * kept)
    after = np.array([0.0, 0.0, length, kept * down])
    return Motion(states, rows), _Run(
        run.begin + airtime, run.begin_by + late, after, after_by, flies=False, touches=True
    )


def _hop(robot: records.Robot, run: "_Run", times: Array, backend: str | None) -> tuple[Motion, "_Run"]:
    """The stance that a run is in: the motion at the times that lie in it, and the take-off."""
    piece = _stance(robot, run.state.tolist(), ((0.0, 0.0),), times - run.begin, 0.0 if run.touches else None, backend)
    states = piece.motion.states
    rows = _chain(piece.motion.by, run.state_by, run.begin_by, _rates(robot, states))
    if piece.end is None or piece.end_by is None or piece.duration_by is None:
        return Motion(states, rows), run
    ends = _chain(np.vstack([piece.end_by, piece.duration_by]), run.state_by, np.zeros(len(COLUMNS)), np.zeros(5))
    lifted = _Run(run.begin + piece.duration, run.begin_by + ends[4], piece.end, ends[:4], flies=True, touches=False)
    return Motion(states, rows), lifted


@dataclass(frozen=True)
class _Run:
    """Where a drop has come to: when, in which state, and how both depend on the columns."""

    begin: float
    begin_by: Array
    state: Array
    state_by: Array
    flies: bool
    touches: bool


def drop(robot: records.Robot, start: Sequence[float], times: Array, backend: str | None = None) -> Motion:
    """The motion of a body that falls, meets the ground, and hops on, with its actuator locked at 0; impacts lose energy.

    start: x1 = 0, v1 = 0, x2, v2 at t = 0, in the air or compressed. HopformError without gravity.
    """
    state, columns = np.array(start, dtype=float), len(COLUMNS)
    run = _Run(0.0, np.zeros(columns), state, np.eye(4, columns), bool(state[2] > robot.L0 + robot.c), touches=False)
    pieces, done = list[Motion](), 0
    for _ in range(_MOST_HOPS):
        left = times[done:]
        motion, run = _flight(robot, run, left) if run.flies else _hop(robot, run, left, backend)
        pieces.append(motion)
        done += motion.states.shape[0]
        if done == times.size:
            break
    else:
        raise HopformError(
            f"the drop hops more than {_MOST_HOPS // 2} times: give a shorter recording, or more friction"
        )
    return Motion(np.concatenate([each.states for each in pieces]), np.concatenate([each.by for each in pieces]))
