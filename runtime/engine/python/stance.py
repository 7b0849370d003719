# SPDX-License-Identifier: MIT-0
"""Stances on arrays, one after the other by the engine that is printed from C."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform_solver import engine_f32, engine_f64
from hopform_solver.lanes import Array
from hopform_solver.phases import stable_rates_of
from hopform_solver.records import REFUSALS, LegState, Robot

ENGINES: dict[str, Any] = {"f": engine_f32, "d": engine_f64}


class Phases(NamedTuple):
    """The phases of all stances, those of each in their order: whose they are, when they begin, from which state, in
    which mode, with which event, at which step of the current.
    """

    lane: NDArray[np.intp]
    t: Array
    x1: Array
    v1: Array
    v2: Array
    y: Array
    mode: NDArray[np.int8]
    event: NDArray[np.int8]
    step: NDArray[np.intp]


class Solution(NamedTuple):
    """Solved stances in the shape of their inputs; in `phases` by their number in that.

    duration [s], end: the state there, apex [m]: NaN without a take-off, aed [J]: the analytical energy delta,
    start_loss [J], ending: one of ENDINGS, phase_count: how many phases.
    """

    duration: Array
    end: LegState
    apex: Array
    aed: Array
    start_loss: Array
    ending: NDArray[np.int32]
    phase_count: NDArray[np.int32]
    phases: Phases


def solve(
    robot: Robot,
    start: LegState,
    u: ArrayLike = 0.0,
    u_times: ArrayLike = (0.0,),
    horizon: ArrayLike = 2.0,
    max_phases: int = 4096,
    dtype: type[np.floating] = np.float64,
) -> Solution:
    """Solve stances; every field of `robot` and `start`, u and horizon broadcast against each other.

    start: states after the impact, without compression at touchdown [m, m/s]. u [A]: the current, with a further last
    axis over `u_times` [s] if those are several; they start at 0 and increase. horizon [s]: the longest time.
    max_phases: the cap after which a stance ends as too_many_phases.
    ValueError says why a robot, a state, a current or a horizon is refused.
    """
    times, values = np.asarray(u_times, dtype).reshape(-1), np.asarray(u, dtype)
    if times.size == 1:
        values = values[..., np.newaxis]
    inputs = np.array(np.broadcast_arrays(*robot, *start, horizon, values[..., 0])[:-1], dtype)
    shape = inputs.shape[1:]
    flat = inputs.reshape(len(inputs), -1)
    stable_rates_of(Robot(*flat[: len(robot)]))
    currents = np.broadcast_to(values, (*shape, times.size)).reshape(-1, times.size)
    engine = ENGINES[times.dtype.char]
    with np.errstate(all="ignore"):
        solved = [_solved(engine, row, times, steps, max_phases) for row, steps in zip(flat.T, currents, strict=True)]
    stances = [stance for stance, _ in solved]

    def column(name: str, kind: Any = dtype) -> Any:
        return np.array([getattr(stance, name) for stance in stances], kind).reshape(shape)

    ends = [[getattr(stance.end, name) for stance in stances] for name in LegState._fields]
    rows = [(lane, *phase) for lane, (_, phases) in enumerate(solved) for phase in phases]
    kinds = (np.intp, *[dtype] * 5, np.int8, np.int8, np.intp)
    columns = zip(*rows, strict=True) if rows else [()] * len(kinds)
    return Solution(
        column("duration"), LegState(*(np.array(end, dtype).reshape(shape) for end in ends)),
        np.where(_flies(engine, stances, flat, shape), column("apex"), np.nan).astype(dtype), column("aed"),
        column("start_loss"), column("ending", np.int32), column("phase_count", np.int32),
        Phases(*(np.array(values, kind) for values, kind in zip(columns, kinds, strict=True))),
    )  # fmt: skip


def _flies(engine: Any, stances: list[Any], flat: Array, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Whether there is an apex."""
    gravity = flat[Robot._fields.index("g")]
    takes_off = [stance.ending == engine.ENDING_TAKEOFF for stance in stances]
    return (np.array(takes_off, bool) & (gravity > 0.0)).reshape(shape)


def _solved(engine: Any, row: Array, times: Array, currents: Array, max_phases: int) -> tuple[Any, list[Any]]:
    """A stance, and its phases as tuples."""
    fields = len(Robot._fields)
    parameters, start, horizon = _reals(row[:fields]), _reals(row[fields:-1]), _reals(row[-1:])[0]
    plan, stance, capacity = engine.Plan(), engine.Stance(), 16
    steps = [engine.Step(*step) for step in zip(_reals(times), _reals(currents), strict=True)]
    _accepted(engine.plan_init(plan, engine.Robot(*parameters)))
    while True:
        phases = [engine.Phase() for _ in range(capacity)]
        asked = plan, engine.State(*start), steps, len(steps), horizon, max_phases
        status = _accepted(engine.solve_stance(*asked, phases, capacity, stance))
        if status != engine.PHASES_NOT_KEPT:
            break
        capacity = stance.phase_count
    return stance, [(p.t, p.x1, p.v1, p.v2, p.y, p.mode, p.event, p.step) for p in phases[: stance.phases_kept]]


def _reals(numbers: Array) -> list[Any]:
    """Numbers as the engine of their precision takes them."""
    return numbers.tolist() if numbers.dtype == np.float64 else list(numbers)


def _accepted(status: int) -> int:
    if status < 0:
        raise ValueError(REFUSALS.get(status, f"the engine failed with status {status}"))
    return status
