# SPDX-License-Identifier: MIT-0
"""Stances on arrays, one after the other by the engine that is printed from C."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import engine_f32, engine_f64
from .elements import Phases
from .formulas import fall_of
from .lanes import Array
from .phases import stable_rates_of
from .records import REFUSALS, LegState, Robot
from .structs import STRUCTS

ENGINES: dict[str, Any] = {"f": engine_f32, "d": engine_f64}


class Solution(NamedTuple):
    """Solved stances in the shape of their inputs; in `phases` those of each one in their order.

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
    kinds: list[Any] = [np.intp, *(dtype if kind == "real" else kind for _, kind, _ in STRUCTS["Phase"])]
    columns: Any = zip(*rows, strict=True) if rows else [()] * len(kinds)
    listed: list[Any] = [np.array(values, kind) for values, kind in zip(columns, kinds, strict=True)]
    return Solution(
        column("duration"), LegState(*(np.array(end, dtype).reshape(shape) for end in ends)),
        np.where(_flies(engine, stances, flat, shape), column("apex"), np.nan).astype(dtype), column("aed"),
        column("start_loss"), column("ending", np.int32), column("phase_count", np.int32),
        Phases(*listed),
    )  # fmt: skip


def _flies(engine: Any, stances: list[Any], flat: Array, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Whether there is an apex."""
    falls = np.broadcast_to(fall_of(Robot(*flat[: len(Robot._fields)])), len(stances)).tolist()
    flies = [stance.ending == engine.ENDING_TAKEOFF and g > 0.0 for stance, g in zip(stances, falls, strict=True)]
    return np.array(flies, np.bool_).reshape(shape)


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
    members = [name for name, _, _ in STRUCTS["Phase"]]
    return stance, [tuple(getattr(phase, name) for name in members) for phase in phases[: stance.phases_kept]]


def _reals(numbers: Array) -> list[Any]:
    """Numbers as the engine of their precision takes them."""
    return numbers.tolist() if numbers.dtype == np.float64 else list(numbers)


def _accepted(status: int) -> int:
    if status < 0:
        raise ValueError(REFUSALS.get(status, f"the engine failed with status {status}"))
    return status
