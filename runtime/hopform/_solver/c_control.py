"""The controller's search by the compiled library."""

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hopform._solver.c import Compiled, plan_of, pointer, with_room
from hopform._solver.package import MAX_PHASES, Array, LegState, Precision, Target, records


def choose_current(
    solver: Compiled, parameters: records.Robot, start: LegState, target: Target, max_phases: int, dtype: Precision
) -> tuple[float, float, int, int]:
    """Current [A], hop height [m] (0 without take-off), status as in COMMANDS, and how many stances were solved.

    target: h_des, datum, stop_margin [m], horizon [s].
    """
    types = solver.library.types(dtype)
    search, command = types.Search(), types.Command()
    begin, wanted = ctypes.byref(types.State(*start)), ctypes.byref(types.Target(*target))
    asked = ctypes.byref(search), plan_of(types, parameters), begin, wanted

    def solve(*room: Any) -> int:
        return types.library.call("choose_current", types, *asked, *room, ctypes.byref(command))

    with_room(types.Phase, max_phases, solve)
    return command.u, command.apex, command.status, search.trials


def try_currents(
    solver: Compiled, parameters: Any, starts: list[LegState], currents: Array, horizon: float, max_phases: int
) -> NDArray[Any]:
    """The stance of each current from each state, (states, currents), a structured array with the fields of
    hopform_trial.
    """
    types = solver.library.types(np.dtype(np.float64))
    trials = np.zeros((len(starts), currents.size), np.dtype(types.Trial))
    states = (types.State * len(starts))(*(types.State(*start) for start in starts))
    values = np.ascontiguousarray(currents, dtype=np.float64)
    given = states, ctypes.c_int32(len(starts)), pointer(values), ctypes.c_int32(values.size), types.real(horizon)

    def solve(*room: Any) -> int:
        return types.library.call("try_currents", types, plan_of(types, parameters), *given, *room, pointer(trials))

    with_room(types.Phase, max_phases, solve)
    return trials


def apexes(
    solver: Compiled, parameters: Any, starts: list[LegState], currents: Array, horizon: float
) -> tuple[Array, Array]:
    """The next apex, NaN without take-off, and the largest x1, (starts, currents)."""
    made = try_currents(solver, parameters, starts, currents, horizon, MAX_PHASES)
    return np.where(made["takes_off"], made["apex"], np.nan), made["largest_x1"]
