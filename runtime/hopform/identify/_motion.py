"""Drops at sample times with exact derivatives by everything that they depend on, through sticking and reversals: flights
and stances that follow each other.

A drop has its actuator locked, or free under a given current. In flight the body is ballistic and the actuator moves
alone,

    x_2'' = -g,      m_eff x_1'' = -b_1 x_1' - gamma_2 u - m_eff f_1 sign(x_1')

which is a slide of the mass m_eff without a spring. The foot is down where x_2 - x_1 - (L0 + c) = 0.

Each piece is solved from its own beginning, at a time that depends on the parameters as its state does. Steps of the
current do not: they come at times of the clock. So a piece that begins with an event is followed up to the next step
under one current, and from there on, where time is the clock's again, under all that are left.
"""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform import HopformError, load_solver
from hopform._motion import DOUBLE
from hopform._sensitivities import COLUMNS, STARTS, in_coordinates, in_height
from hopform._solver.c import Solved
from hopform._solver.choice import DEFAULT, Solver
from hopform._solver.package import ENDINGS, ROWS, LegState, Steps, records
from hopform.extend import needs

Array = NDArray[np.float64]
Robot = records.Robot
Values = Mapping[str, float]
"""Letters of a rig, or parameters, by their names."""
Known = Values | None
"""Known parameters, if any are."""
STATE = ("x1", "v1", "x2", "v2")
AT = {name: number for number, name in enumerate(COLUMNS)}
"""Where a derivative's column is: initial state x1, v1, x2, v2, the current u (all steps alike), the robot's fields."""
Taken = list[int] | None
"""Columns that are computed, None for all."""
MAX_PHASES = 200_000
_LENGTH_BY = np.array([1.0 if name in ("L0", "c") else 0.0 for name in COLUMNS])


def of_scipy(module: str) -> Any:
    """A module of scipy; MissingExtra without it."""
    needs("scipy", "identify", "identification")
    return import_module(f"scipy.{module}")


class Motion(NamedTuple):
    """States (times, 4), rows x1, v1, x2, v2, and their derivatives (times, 4, columns)."""

    states: Array
    by: Array


def solved(robot: Any, state: Any, steps: Steps, horizon: float, core: Solver = DEFAULT) -> Solved:
    """A motion as the library has it; HopformError for more phases than any recording has."""
    motion = core.compiled().solve_stance(robot, state, steps, horizon, MAX_PHASES, DOUBLE)
    if ENDINGS[motion.outcome()[0]] == "too_many_phases":
        raise HopformError(f"the motion has more than {MAX_PHASES} phases: too little friction for so long a recording")
    return motion


def _of_height(rows: NDArray[Any], given: bool, columns: Taken) -> Array:
    """Derivatives of x1, v1, x2, v2 by the columns from those of x1, v1, v2, y."""
    x1, v1, v2, y = np.moveaxis(in_height(_among_all(rows, columns), given), 1, 0)
    return np.stack([x1, v1, x1 - y + _LENGTH_BY, v2], axis=1)


def _among_all(rows: NDArray[Any], columns: Taken) -> NDArray[Any]:
    """Some columns of derivatives among all, of which the others are 0."""
    if columns is None:
        return rows
    whole = np.zeros((*rows.shape[:-1], len(COLUMNS)))
    whole[..., columns] = rows
    return whole


def stance_piece(
    robot: Robot, start: Sequence[float], steps: Steps, times: Array, y: float | None, columns: Taken = None
) -> tuple[Motion, Solved]:
    """The motion in a stance of at most the given times, and the stance; y is the compression at the start, from the
    state if None; columns: by which it is differentiated.
    """
    x1, v1, x2, v2 = start
    given = y is None
    compression = max(x1 - x2 + robot.L0 + robot.c, 0.0) if y is None else y
    horizon = max(float(times[-1]), 1e-9) * (1.0 + 1e-12) if times.size else 1e-9
    motion = solved(robot, LegState(x1, v1, v2, compression), steps, horizon)
    ending, duration, *_ = motion.outcome()
    within = times if ENDINGS[ending] == "rest" else times[times <= duration]
    at, rows = motion.tangents(np.ascontiguousarray(within), columns)
    states = np.stack([at.x1, at.v1, at.x1 - at.y + robot.L0 + robot.c, at.v2], axis=1)
    return Motion(states, _of_height(rows, given, columns)), motion


# ---- drops ----

_MOST_PIECES = 400
_PLACES = 256
"""Places at which the foot is looked at for the touchdown, over a flight and over the first of it: one between may be
missed.
"""
_ROUNDS = 8
"""As many more between two of them, so often that the time has all its digits: 256^8 = 2^64."""
_SHARES = np.arange(1, _PLACES + 1) / _PLACES


@cache
def slide() -> Solver:
    """The solver of the slide that ships, which is built at its first use: one mass that moves alone. HopformError where
    a user has built another model under this name.
    """
    core = load_solver("slide").Robot.solver
    if core.package.records.Robot._fields != _SLIDE:
        raise HopformError(
            "a model of yours is named slide, as that which ships, by which a body or an actuator alone is fitted: "
            "rename yours, and remove its solver; `hopform model list` shows its folder"
        )
    return core


_SLIDE = ("m", "k", "x_0", "b", "F", "F_s", "k_f", "load", "x_min", "x_max", "i_max")


class _Rig(NamedTuple):
    """The dropped rig: the robot, whose c is 0 (a constant force on the actuator is a current's), and the current; the
    columns by which a stance is differentiated.
    """

    robot: Robot
    steps: Steps
    columns: Taken


class _Piece(NamedTuple):
    """A flight or a stance: the motion at the times that lie in it, the run after it if it ends before the last, and
    the largest compression of the spring [m].
    """

    motion: Motion
    after: "_Run | None"
    deepest: float = 0.0


class _Run(NamedTuple):
    """A drop under way: time, state, and the derivatives of both by the columns."""

    begin: float
    begin_by: Array
    state: Array
    state_by: Array
    flies: bool
    touches: bool
    """the foot is exactly on the ground: the compression is 0, whatever the parameters are"""


def drop(robot: Robot, start: Sequence[float], steps: Steps, times: Array, by: Collection[str] | None = None) -> Motion:
    """The motion of a body that falls, as `drop_and_compression` has it."""
    return drop_and_compression(robot, start, steps, times, by)[0]


def drop_and_compression(
    robot: Robot, start: Sequence[float], steps: Steps, times: Array, by: Collection[str] | None = None
) -> tuple[Motion, float]:
    """The motion of a body that falls, meets the ground and hops on, at times [s] that do not decrease, and the largest
    compression of its spring [m] up to the last of them; impacts lose energy.

    start: x1, v1, x2, v2 at t = 0, in the air or compressed. The actuator is free within its stops, locked where these
    are equal. by: columns by which the motion is differentiated beside its start, all if left out; no others are right.
    HopformError without gravity, with an offset c, or for more hops than any recording has.
    """
    if not robot.g > 0.0:
        raise HopformError(f"a drop needs g > 0 m/s^2, got {robot.g!r}")
    if robot.c != 0.0:
        raise HopformError(f"a drop takes the whole length as L0, c must be 0 m, got {robot.c!r}")
    taken = None if by is None else sorted({*map(AT.__getitem__, STATE), *map(AT.__getitem__, by)})
    rig, state, columns = _Rig(robot, steps, taken), np.array(start, dtype=float), len(COLUMNS)
    run = _Run(0.0, np.zeros(columns), state, np.eye(4, columns), bool(state[2] - state[0] > robot.L0), touches=False)
    pieces, done, deepest = list[Motion](), 0, 0.0
    for _ in range(_MOST_PIECES):
        piece = _piece(rig, run, times[done:])
        pieces.append(piece.motion)
        deepest, done, run = max(deepest, piece.deepest), done + piece.motion.states.shape[0], piece.after or run
        if done == times.size:
            return Motion(*map(np.concatenate, zip(*pieces, strict=True))), deepest
    message = f"the drop has more than {_MOST_PIECES} flights and stances: give a shorter recording, or more friction"
    raise HopformError(message)


def _piece(rig: _Rig, run: _Run, times: Array) -> _Piece:
    """The motion up to the next event, or to the step of the current that makes time the clock's again."""
    move: Callable[[_Rig, _Run, Array], _Piece] = _flight if run.flies else _stance
    later = [t for t, _ in rig.steps if t > run.begin] if run.begin_by.any() else []
    if not later or later[0] >= times[-1]:
        return move(rig, run, times)
    piece = move(rig, run, np.append(times[times <= later[0]], later[0]))
    if piece.after is not None:
        return piece
    (states, by), still = piece.motion, np.zeros(len(COLUMNS))
    after = _Run(later[0], still, states[-1], by[-1], run.flies, touches=False)
    return _Piece(Motion(states[:-1], by[:-1]), after, piece.deepest)


def delayed(steps: Steps, delay: float) -> Steps:
    """Steps of a current that arrive later by a delay [s]; the first holds from the beginning, also where all come
    earlier.
    """
    moved = [(max(t + delay, 0.0), u) for t, u in steps]
    begun = max((n for n, (t, _) in enumerate(moved) if t <= 0.0), default=0)
    return ((0.0, moved[begun][1]), *moved[begun + 1 :])


def held_at(steps: Steps, times: Array | float) -> Array:
    """What a drive that holds from step to step is at times, before the first one that one."""
    begins, levels = np.array(steps, dtype=float).T
    return np.asarray(levels[np.maximum(np.searchsorted(begins, times, side="right") - 1, 0)])


def _chain(by: Array, state_by: Array, begin_by: Array, rates: Array) -> Array:
    """Derivatives (..., rows, columns) of a piece from those of the state that it starts with and of its beginning's
    time.
    """
    total = np.asarray(by[..., : len(STATE)] @ state_by)
    total[..., len(STATE) :] += by[..., len(STATE) :]
    return np.asarray(total - rates[..., np.newaxis] * begin_by)


def _rates(rig: _Rig, times: Array, states: Array, *, flies: bool) -> Array:
    """Rates of x1, v1, x2, v2 at times of the clock, at a step under the current of before; 0 of a velocity that is
    held.
    """
    robot, (x1, v1, x2, v2) = rig.robot, states.T
    begins, currents = np.array(rig.steps, dtype=float).T
    pull = robot.gamma2 * currents[np.maximum(np.searchsorted(begins, times, side="left") - 1, 0)]
    spring = np.zeros_like(x1) if flies else robot.k * (x1 - x2 + robot.L0)
    a1 = -(spring + robot.b1 * v1 + pull) / robot.m_eff - robot.f1 * np.sign(v1)
    a2 = (spring - robot.b2 * v2) / robot.m_s - robot.g - robot.f2 * np.sign(v2)
    body = np.full_like(v2, -robot.g) if flies else np.where(v2 != 0.0, a2, 0.0)
    return np.stack([v1, np.where(v1 != 0.0, a1, 0.0), v2, body], axis=-1)


def _stance(rig: _Rig, run: _Run, times: Array) -> _Piece:
    """The stance that a run is in: the motion at the times that lie in it, and the take-off if it comes before the
    last.
    """
    steps, y = delayed(rig.steps, -run.begin), 0.0 if run.touches else None
    (states, by), stance = stance_piece(rig.robot, run.state.tolist(), steps, times - run.begin, y, rig.columns)
    rows = _chain(by, run.state_by, run.begin_by, _rates(rig, times[: states.shape[0]], states, flies=False))
    ending, duration, last, *_ = stance.outcome()
    if ENDINGS[ending] != "takeoff":
        return _Piece(Motion(states, rows), None, stance.compression_max())
    rows_at_end = _among_all(stance.sensitivities(rig.columns), rig.columns)
    ends = in_height(rows_at_end, y is None)[[ROWS.index(name) for name in (*STATE, "T")]]
    ends = _chain(ends, run.state_by, np.zeros(len(COLUMNS)), np.zeros(5))
    end = np.array([last.x1, last.v1, last.x1 + rig.robot.L0, last.v2])
    lifted = _Run(run.begin + duration, run.begin_by + ends[4], end, ends[:4], flies=True, touches=False)
    return _Piece(Motion(states, rows), lifted, stance.compression_max())


class _Alone(NamedTuple):
    """The actuator in the air, as a slide without a spring: the slide, and its motion."""

    slide: Any
    motion: Solved

    def at(self, robot: Robot, start: float, times: Array) -> tuple[Array, Array]:
        """States x1, v1 (times, 2) and their derivatives (times, 2, columns) by the columns of the hopper; start: x1."""
        state, rows = self.motion.tangents(np.ascontiguousarray(times))
        slid = in_coordinates(state, rows, start, slide().package, self.slide)[:, :2]
        column = {name: slid[:, :, n] for n, name in enumerate((*STARTS, *self.slide._fields))}
        by = np.zeros((times.size, 2, len(COLUMNS)))
        for name, row in {
            "x1": column["x1"], "v1": column["v1"], "u": column["u"], "b1": column["b"], "gamma2": -column["k_f"],
            "m_eff": column["m"] + robot.f1 * column["F"], "f1": robot.m_eff * column["F"], "x1_min": column["x_min"],
            "x1_max": column["x_max"],
        }.items():  # fmt: skip
            by[:, :, AT[name]] = row
        return np.stack([state.x1, state.v1], axis=1), by


def _actuator(rig: _Rig, run: _Run, longest: float) -> _Alone | None:
    """The actuator in the air over a longest time [s]; None where it is locked."""
    robot = rig.robot
    if robot.x1_min == robot.x1_max:
        return None
    records_of_slide = slide().package.records
    x1, v1 = run.state[:2].tolist()
    fields = dict.fromkeys(records_of_slide.Robot._fields, 0.0) | {
        "m": robot.m_eff, "b": robot.b1, "F": robot.m_eff * robot.f1, "F_s": robot.m_eff * robot.f1_excess,
        "k_f": -robot.gamma2, "x_min": robot.x1_min, "x_max": robot.x1_max, "i_max": math.inf,
    }  # fmt: skip
    alone = records_of_slide.Robot(**fields)
    state = records_of_slide.LegState(x1, v1, 0.0, x1)
    return _Alone(alone, solved(alone, state, delayed(rig.steps, -run.begin), longest, slide()))


def _flight(rig: _Rig, run: _Run, times: Array) -> _Piece:
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
        alone, by[:, :2] = actuator.at(robot, float(run.state[0]), moments)
        x1, v1 = alone.T
    x2, v2 = run.state[2:]
    fall = v2 - robot.g * moments
    states = np.stack([x1, v1, x2 + v2 * moments - 0.5 * robot.g * moments**2, fall], axis=1)
    by[:, 2, AT["x2"]], by[:, 2, AT["v2"]], by[:, 2, AT["g"]] = 1.0, moments, -0.5 * moments**2
    by[:, 3, AT["v2"]], by[:, 3, AT["g"]] = 1.0, -moments
    rates = _rates(rig, run.begin + moments, states, flies=True)
    local = _chain(by, run.state_by, np.zeros(len(COLUMNS)), rates)
    rows = local[: t.size] - rates[: t.size, :, np.newaxis] * run.begin_by
    moved = Motion(states[: t.size], rows)
    return _Piece(moved, None if airtime is None else _landed(robot, run, airtime, states[-1], local[-1], rates[-1]))


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


def _touchdown(rig: _Rig, run: _Run, actuator: _Alone | None, longest: float) -> float | None:
    """When the foot comes down after it has been above the ground [s since the flight's beginning], None if not that
    soon.
    """
    robot, (_, v1, x2, v2) = rig.robot, run.state.tolist()
    if actuator is None:
        height = max(x2 - run.state[0] - robot.L0, 0.0)
        airtime = (v2 + math.sqrt(v2 * v2 + 2.0 * robot.g * height)) / robot.g
        return airtime if airtime <= longest else None
    soon = min(4.0 * abs(v2 - v1) / robot.g, longest)
    places: Array = np.sort(np.concatenate([soon * _SHARES, longest * _SHARES]))
    low, landed = 0.5 * float(places[0]), None
    for _ in range(_ROUNDS):
        heights: Array = x2 + v2 * places - 0.5 * robot.g * places**2 - actuator.motion.state_at(places).x1 - robot.L0
        below = np.flatnonzero(heights < 0.0)
        if not below.size:
            break
        first = int(below[0])
        landed = low = float(places[first - 1]) if first else low
        places = np.linspace(low, float(places[first]), _PLACES + 1)[1:]
    return landed
