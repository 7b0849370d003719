"""The controller's search by the compiled library."""

import ctypes
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hopform._solver.c import FIRST_CAPACITY, PHASES_NOT_KEPT, Compiled, Types, plan_of, pointer
from hopform._solver.package import Array, LegState, Precision, Target, records


def choose_current(
    solver: Compiled, parameters: records.Robot, start: LegState, target: Target, max_phases: int, dtype: Precision
) -> tuple[float, float, int, int]:
    """Current [A], hop height [m] (0 without take-off), status as in COMMANDS, and how many stances were solved.

    target: h_des, datum, stop_margin [m], horizon [s].
    """
    library = solver.library
    types, free = library.types(dtype), library.buffers(dtype).searches
    plan = plan_of(library, types, parameters)
    capacity = min(FIRST_CAPACITY, max_phases)
    try:
        memory = free.pop()
    except IndexError:
        memory = _Memory(types, FIRST_CAPACITY)
    begin, wanted = types.State(*start), types.Target(*target)
    while True:
        asked = (ctypes.byref(each) for each in (memory.search, plan, begin, wanted))
        room = memory.phases, ctypes.c_int32(capacity), ctypes.byref(memory.command)
        status = library.call("choose_current", types, *asked, *room)
        if status != PHASES_NOT_KEPT or capacity == max_phases:
            break
        capacity = min(8 * capacity, max_phases)
        memory = _Memory(types, capacity)
    found = memory.command.u, memory.command.apex, memory.command.status, memory.search.trials
    if capacity <= FIRST_CAPACITY:
        free.append(memory)
    return found


class _Memory:
    """Room for one search; taken from the library's and put back, so that no two searches are ever in the same."""

    def __init__(self, types: Types, capacity: int) -> None:
        self.command, self.search, self.phases = types.Command(), types.Search(), (types.Phase * capacity)()


def try_currents(
    solver: Compiled, parameters: Any, starts: list[LegState], currents: Array, horizon: float, max_phases: int
) -> NDArray[Any]:
    """The stance of each current from each state, (states, currents), a structured array with the fields of
    hopform_trial.
    """
    library = solver.library
    types = library.types(np.dtype(np.float64))
    plan = plan_of(library, types, parameters)
    trials = np.zeros((len(starts), currents.size), np.dtype(types.Trial))
    states = (types.State * len(starts))(*(types.State(*start) for start in starts))
    values = np.ascontiguousarray(currents, dtype=np.float64)
    given = (ctypes.byref(plan), states, ctypes.c_int32(len(starts)), pointer(values), ctypes.c_int32(values.size))
    capacity = min(FIRST_CAPACITY, max_phases)
    while True:
        room = (types.Phase * capacity)(), ctypes.c_int32(capacity), pointer(trials)
        status = library.call("try_currents", types, *given, types.real(horizon), *room)
        if status != PHASES_NOT_KEPT or capacity == max_phases:
            return trials
        capacity = min(8 * capacity, max_phases)


def apexes(
    solver: Compiled, parameters: Any, starts: list[LegState], currents: Array, horizon: float, max_phases: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The next apex, NaN without take-off, and the largest x1, (starts, currents)."""
    made = try_currents(solver, parameters, starts, currents, horizon, max_phases)
    return np.where(made["takes_off"], made["apex"], np.nan), made["largest_x1"]
