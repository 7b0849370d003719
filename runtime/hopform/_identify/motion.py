"""Motions at sample times with exact derivatives by everything that they depend on, through sticking and reversals:
stances, and drops, in which flights and stances follow each other.

A stance is solved in the compression y = x_1 - x_2 + L0 + c, and pulls nothing: at y = 0 it ends in a take-off. A rig
whose spring is fixed at both ends pushes and pulls. Under

    c -> c + P,     g -> g + k P/m_s

y grows by P while both (3) and (4) stay as they are: k (x_2 - x_1 - L0) knows no c, and k (y + P) - m_s g - k P = k y -
m_s g. So a spring that pulls is one that is preloaded by more than it ever moves.

A drop has its actuator locked, or free under a given current. In flight the body is ballistic and the actuator moves
alone,

    x_2'' = -g,      m_eff x_1'' = -b_1 x_1' - gamma_2 u - m_eff f_1 sign(x_1')

which is the actuator's motion over a spring that is none. The foot is down where x_2 - x_1 - (L0 + c) = 0.

Each piece is solved from its own beginning, at a time that depends on the parameters as its state does. Steps of the
current do not: they come at times of the clock. So a piece that begins with an event is followed up to the next step
under one current, and from there on, where time is the clock's again, under all that are left.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform._errors import HopformError
from hopform._sensitivities import COLUMNS, in_height
from hopform._solver.choice import DEFAULT, SolvedStance
from hopform._solver.package import ENDINGS, ROWS, LegState, Steps, records
from hopform._stance import DOUBLE

Array = NDArray[np.float64]
Robot = records.Robot
Values = Mapping[str, float]
"""Letters of a rig, or parameters, by their names."""
Known = Values | None
"""Known parameters, if any are."""
STATE = ("x1", "v1", "x2", "v2")
AT = {name: number for number, name in enumerate(COLUMNS)}
"""Where a derivative's column is: initial state x1, v1, x2, v2, the current u (all steps alike), the robot's fields."""
MAX_PHASES = 200_000
FIRM = 1e12
"""[m/s^2] friction under which no body ever moves: how a body is held."""
_LENGTHS = [AT["L0"], AT["c"]]


class Motion(NamedTuple):
    """States (times, 4), rows x1, v1, x2, v2, and their derivatives (times, 4, columns)."""

    states: Array
    by: Array


class Piece(NamedTuple):
    """A stance up to its ending: the motion at the times asked for, and the take-off if there is one."""

    motion: Motion
    duration: float
    end: Array | None
    end_by: Array | None
    duration_by: Array | None


def stance(robot: Robot, start: Sequence[float], steps: Steps, times: Array, backend: str | None = None) -> Motion:
    """The motion from a state x1, v1, x2, v2 at t = 0 at times that do not decrease; HopformError if the leg takes off
    before.
    """
    piece = stance_piece(robot, start, steps, times, None, backend)
    if piece.motion.states.shape[0] < times.size:
        raise HopformError(f"the leg takes off after {piece.duration!r} s, before the last sample")
    return piece.motion


def solved(robot: Robot, state: LegState, steps: Steps, horizon: float, backend: str | None) -> SolvedStance:
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
    robot: Robot, start: Sequence[float], steps: Steps, times: Array, y: float | None, backend: str | None
) -> Piece:
    """A stance of at most the given times; y is the compression at the start, from the state if None."""
    x1, v1, x2, v2 = start
    given = y is None
    compression = max(x1 - x2 + robot.L0 + robot.c, 0.0) if y is None else y
    horizon = max(float(times[-1]), 1e-9) * (1.0 + 1e-12) if times.size else 1e-9
    found = solved(robot, LegState(x1, v1, v2, compression), steps, horizon, backend)
    ending, duration, last, *_ = found.outcome()
    at, rows = found.tangents(np.ascontiguousarray(times if ENDINGS[ending] == "rest" else times[times <= duration]))
    motion = Motion(np.stack([at.x1, at.v1, at.x1 - at.y + robot.L0 + robot.c, at.v2], axis=1), _of_height(rows, given))
    if ENDINGS[ending] != "takeoff":
        return Piece(motion, duration, None, None, None)
    ends = in_height(found.sensitivities(), given)
    place = [ROWS.index(name) for name in STATE]
    end = np.array([last.x1, last.v1, last.x1 + robot.L0 + robot.c, last.v2])
    return Piece(motion, duration, end, ends[place], ends[ROWS.index("T")])


# ---- drops ----

_MOST_PIECES = 400
_PLACES = 256
"""Places at which the foot is looked at for the touchdown, over a flight and over the first of it: one between may be
missed.
"""
_SHARES = np.arange(1, _PLACES + 1) / _PLACES
_NO_SPRING, _FAR = 1e-15, 100.0
"""[N/m], [m]: a spring that is none, and the compression at which it still pushes, with 1e-13 N."""
_LENGTH_BY = np.array([1.0 if name in ("L0", "c") else 0.0 for name in COLUMNS])
_AIRBORNE = [AT[name] for name in ("x1", "v1", "u", "m_eff", "b1", "f1", "gamma2", "x1_min", "x1_max")]
"""Inputs of the actuator's motion in the air."""


class _Rig(NamedTuple):
    """The dropped rig: the robot, whose c is 0 (a constant force on the actuator is a current's), and the current."""

    robot: Robot
    steps: Steps
    backend: str | None


class _Run(NamedTuple):
    """A drop under way: time, state, and the derivatives of both by the columns."""

    begin: float
    begin_by: Array
    state: Array
    state_by: Array
    flies: bool
    touches: bool
    """the foot is exactly on the ground: the compression is 0, whatever the parameters are"""


def drop(robot: Robot, start: Sequence[float], steps: Steps, times: Array, backend: str | None = None) -> Motion:
    """The motion of a body that falls, meets the ground and hops on, at times [s] that do not decrease; impacts lose
    energy.

    start: x1, v1, x2, v2 at t = 0, in the air or compressed. The actuator is free within its stops, locked where these
    are equal. HopformError without gravity, with an offset c, or for more hops than any recording has.
    """
    if not robot.g > 0.0:
        raise HopformError(f"a drop needs g > 0 m/s^2, got {robot.g!r}")
    if robot.c != 0.0:
        raise HopformError(f"a drop takes the whole length as L0, c must be 0 m, got {robot.c!r}")
    rig, state, columns = _Rig(robot, steps, backend), np.array(start, dtype=float), len(COLUMNS)
    run = _Run(0.0, np.zeros(columns), state, np.eye(4, columns), bool(state[2] - state[0] > robot.L0), touches=False)
    pieces, done = list[Motion](), 0
    for _ in range(_MOST_PIECES):
        moved, run = _piece(rig, run, times[done:])
        pieces.append(moved)
        done += moved.states.shape[0]
        if done == times.size:
            return Motion(*map(np.concatenate, zip(*pieces, strict=True)))
    message = f"the drop has more than {_MOST_PIECES} flights and stances: give a shorter recording, or more friction"
    raise HopformError(message)


def _piece(rig: _Rig, run: _Run, times: Array) -> tuple[Motion, _Run]:
    """The motion up to the next event, or to the step of the current that makes time the clock's again."""
    move: Callable[[_Rig, _Run, Array], tuple[Motion, _Run | None]] = _flight if run.flies else _stance
    later = [t for t, _ in rig.steps if t > run.begin] if run.begin_by.any() else []
    if not later or later[0] >= times[-1]:
        moved, after = move(rig, run, times)
        return moved, after or run
    moved, after = move(rig, run, np.append(times[times <= later[0]], later[0]))
    if after is not None:
        return moved, after
    still = _Run(later[0], np.zeros(len(COLUMNS)), moved.states[-1], moved.by[-1], run.flies, touches=False)
    return Motion(moved.states[:-1], moved.by[:-1]), still


def _steps_from(steps: Steps, begin: float) -> Steps:
    """The current from a time on, counted from there."""
    past = [u for t, u in steps if t <= begin]
    return ((0.0, past[-1] if past else steps[0][1]), *((t - begin, u) for t, u in steps if t > begin))


def _chain(by: Array, state_by: Array, begin_by: Array, rates: Array) -> Array:
    """Derivatives (..., rows, columns) of a piece from those of the state that it starts with and of its beginning's
    time.
    """
    total = np.asarray(by[..., : len(STATE)] @ state_by)
    total[..., len(STATE) :] += by[..., len(STATE) :]
    return np.asarray(total - rates[..., np.newaxis] * begin_by)


def _pull(rig: _Rig, times: Array) -> Array:
    """gamma2 u [N] up to times of the clock: at a step that of before."""
    begins, currents = np.array(rig.steps, dtype=float).T
    return np.asarray(rig.robot.gamma2 * currents[np.maximum(np.searchsorted(begins, times, side="left") - 1, 0)])


def _acceleration(robot: Robot, v1: Array, spring: Array, pull: Array) -> Array:
    """x1'' of an actuator that moves, 0 of one that is held."""
    a1 = -(spring + robot.b1 * v1 + pull) / robot.m_eff - robot.f1 * np.sign(v1)
    return np.asarray(np.where(v1 != 0.0, a1, 0.0))


def _stance_rates(rig: _Rig, times: Array, states: Array) -> Array:
    """Rates of x1, v1, x2, v2 in stance."""
    robot, v1, v2 = rig.robot, states[:, 1], states[:, 3]
    spring = robot.k * (states[:, 0] - states[:, 2] + robot.L0)
    a2 = (spring - robot.b2 * v2) / robot.m_s - robot.g - robot.f2 * np.sign(v2)
    a1 = _acceleration(robot, v1, spring, _pull(rig, times))
    return np.stack([v1, a1, v2, np.where(v2 != 0.0, a2, 0.0)], axis=-1)


def _stance(rig: _Rig, run: _Run, times: Array) -> tuple[Motion, _Run | None]:
    """The stance that a run is in: the motion at the times that lie in it, and the take-off if it comes before the
    last.
    """
    steps, y = _steps_from(rig.steps, run.begin), 0.0 if run.touches else None
    piece = stance_piece(rig.robot, run.state.tolist(), steps, times - run.begin, y, rig.backend)
    states = piece.motion.states
    rows = _chain(piece.motion.by, run.state_by, run.begin_by, _stance_rates(rig, times[: states.shape[0]], states))
    if piece.end is None or piece.end_by is None or piece.duration_by is None:
        return Motion(states, rows), None
    ends = _chain(np.vstack([piece.end_by, piece.duration_by]), run.state_by, np.zeros(len(COLUMNS)), np.zeros(5))
    lifted = _Run(run.begin + piece.duration, run.begin_by + ends[4], piece.end, ends[:4], flies=True, touches=False)
    return Motion(states, rows), lifted


def _actuator(rig: _Rig, run: _Run, longest: float) -> SolvedStance | None:
    """The actuator in the air over a longest time [s]; None where it is locked."""
    if rig.robot.x1_min == rig.robot.x1_max:
        return None
    x1, v1 = run.state[:2].tolist()
    alone = rig.robot._replace(k=_NO_SPRING, L0=0.0, c=_FAR, b2=0.0, f2=FIRM, g=0.0)
    return solved(alone, LegState(x1, v1, 0.0, x1 + _FAR), _steps_from(rig.steps, run.begin), longest, rig.backend)


def _flight(rig: _Rig, run: _Run, times: Array) -> tuple[Motion, _Run | None]:
    """A flight: the motion at the times that lie in it, and the state after the impact if it comes before the last."""
    robot, longest = rig.robot, max(float(times[-1]) - run.begin, 1e-9) * (1.0 + 1e-12)
    actuator = _actuator(rig, run, longest)
    airtime = _touchdown(rig, run, actuator, longest)
    t = times - run.begin
    t = t if airtime is None else t[t <= airtime]
    moments = t if airtime is None else np.append(t, airtime)
    by = np.zeros((moments.size, 4, len(COLUMNS)))
    x1, v1 = np.full(moments.size, run.state[0]), np.zeros(moments.size)
    if actuator is not None:
        state, rows = actuator.tangents(np.ascontiguousarray(moments))
        x1, v1 = np.asarray(state.x1), np.asarray(state.v1)
        by[:, :2, _AIRBORNE] = rows[:, :2][:, :, _AIRBORNE]
    x2, v2 = run.state[2:]
    fall = v2 - robot.g * moments
    states = np.stack([x1, v1, x2 + v2 * moments - 0.5 * robot.g * moments**2, fall], axis=1)
    by[:, 2, AT["x2"]], by[:, 2, AT["v2"]], by[:, 2, AT["g"]] = 1.0, moments, -0.5 * moments**2
    by[:, 3, AT["v2"]], by[:, 3, AT["g"]] = 1.0, -moments
    zero = np.zeros(moments.size)
    rates = np.stack([v1, _acceleration(robot, v1, zero, _pull(rig, run.begin + moments)), fall, zero - robot.g], -1)
    local = _chain(by, run.state_by, np.zeros(len(COLUMNS)), rates)
    rows = local[: t.size] - rates[: t.size, :, np.newaxis] * run.begin_by
    moved = Motion(states[: t.size], rows)
    return moved, None if airtime is None else _landed(robot, run, airtime, states[-1], local[-1], rates[-1])


def _landed(robot: Robot, run: _Run, airtime: float, state: Array, by: Array, rates: Array) -> _Run:
    """The run after a touchdown: its time moves so that the foot stays at 0; the impact takes its share of v2."""
    late = (by[2] - by[0] - _LENGTH_BY) / -(rates[2] - rates[0])
    at_event = by + rates[:, np.newaxis] * late
    kept = math.sqrt(1.0 - robot.impact_loss)
    after_by = at_event.copy()
    after_by[2] = at_event[0] + _LENGTH_BY
    after_by[3] = kept * at_event[3]
    after_by[3, AT["impact_loss"]] -= state[3] / (2.0 * kept)
    after = np.array([state[0], state[1], state[0] + robot.L0, kept * state[3]])
    return _Run(run.begin + airtime, run.begin_by + late, after, after_by, flies=False, touches=True)


def _touchdown(rig: _Rig, run: _Run, actuator: SolvedStance | None, longest: float) -> float | None:
    """When the foot comes down after it has been above the ground [s since the flight's beginning], None if not that
    soon.
    """
    robot, (_, v1, x2, v2) = rig.robot, run.state.tolist()
    if actuator is None:
        height = max(x2 - run.state[0] - robot.L0, 0.0)
        airtime = (v2 + math.sqrt(v2 * v2 + 2.0 * robot.g * height)) / robot.g
        return airtime if airtime <= longest else None

    def foot(t: Array) -> tuple[Array, Array]:
        state = actuator.state_at(t)
        height = x2 + v2 * t - 0.5 * robot.g * t * t - state.x1 - robot.L0
        return np.asarray(height), np.asarray(v2 - robot.g * t - state.v1)

    soon = min(4.0 * abs(v2 - v1) / robot.g, longest)
    places = np.sort(np.concatenate([soon * _SHARES, longest * _SHARES]))
    heights, rates = foot(places)
    below = np.flatnonzero(heights < 0.0)
    if not below.size:
        return None
    last = int(below[0])
    low, high = float(places[last - 1]) if last else 0.5 * float(places[0]), float(places[last])
    return _zero(foot, low, high, high - float(heights[last] / rates[last]) if rates[last] < 0.0 else low)


_INSTANT = 1e-15
"""[s] of Newton's last step to a touchdown: heights are rounded to some 1e-16 m."""


def _zero(falling: Callable[[Array], tuple[Array, Array]], low: float, high: float, guess: float) -> float:
    """Where a function that is > 0 at low and < 0 at high is 0: Newton's steps in a bracket that shrinks."""
    for n in range(100):
        middle = guess if low < guess < high and n % 8 != 7 else 0.5 * (low + high)
        if not low < middle < high:
            break
        value, rate = (float(each[0]) for each in falling(np.array([middle])))
        if value > 0.0:
            low = middle
        elif value < 0.0:
            high = middle
        else:
            return middle
        guess = middle - value / rate if rate < 0.0 else math.nan
        if abs(guess - middle) <= _INSTANT:
            return middle
    return low
