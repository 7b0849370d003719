"""The generated package that `hopform` is over, any other is a `Package` of its name; what a library takes and gives.

Stances in columns: an array or a number for each input, an array for each result.
"""

import sys
from collections.abc import Mapping, Sequence
from importlib import import_module
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from hopform._errors import HopformError
from hopform_solver import checked, formulas, records
from hopform_solver.elements import COLUMNS, ROWS
from hopform_solver.equations import CLAIMS, EQUATIONS, Claim, Equation
from hopform_solver.records import Energy, FlightLedger, Gains, Ledger
from hopform_solver.robot import Robot as CheckedRobot

AnyEvent: TypeAlias = records.EventKind | records.CurrentEventKind | records.Contact
COMMANDS, ENDINGS, EVENTS = records.COMMANDS, records.ENDINGS, records.EVENTS
FLIGHT_ENDINGS, FLIGHT_EVENTS = records.FLIGHT_ENDINGS, records.FLIGHT_EVENTS

__all__ = [
    "CLAIMS", "COLUMNS", "COMMANDS", "ENDINGS", "EQUATIONS", "EVENTS", "FLIGHT_ENDINGS", "FLIGHT_EVENTS", "OURS", "ROWS",
    "AnyEvent", "CheckedRobot", "Claim", "Energy", "Equation", "FlightLedger", "Gains", "Ledger", "Package", "checked",
    "formulas", "records",
]  # fmt: skip


class Package:
    """A generated package: its modules are its attributes, imported when they are first used."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __reduce__(self) -> Any:
        return loaded_package, (self.name,)

    def __getattr__(self, module: str) -> Any:
        if module.startswith("__"):
            raise AttributeError(module)
        self.__dict__[module] = loaded = import_module(f"{self.name}.{module}")
        return loaded


OURS = Package("hopform_solver")
LOADED = "hopform._solvers."
"""What the names of packages begin with that `load_solver` has loaded, with their source behind."""


def loaded_package(name: str) -> Package:
    """The package of a pickle; HopformError for one that this process has not loaded."""
    if name.startswith(LOADED) and name not in sys.modules:
        raise HopformError(not_loaded("this", name.removeprefix(LOADED)))
    return Package(name)


def not_loaded(what: str, source: str) -> str:
    """What is said of something pickled whose solver is not there."""
    return f"{what} is of the solver of source {source}, which is not loaded here: hopform.load_solver loads it"


# ---- what a library takes and gives ----

STATES = ("x1", "v1", "v2", "y", "u", "horizon")
CODES = ("status", "event_count")
REALS = ("duration", "x1", "v1", "x2", "v2", "apex", "aed")
MAX_PHASES = 4096
CHUNK = 16384
"""Stances that are solved at a time."""

NUMBERS = {word: number for number, word in records.STATUSES.items()}
"""The number of each status in the C library by its word: negative an error, positive an answer with a warning."""
_REFUSED: dict[records.Status, str] = {
    "error_robot": "robot_refused",
    "error_state": "state_refused",
    "error_extended": "spring_pulls",
    "error_steps": "current_refused",
    "error_horizon": "horizon_refused",
    "error_numbers": "out_of_range",
}
REFUSED = {NUMBERS[name]: word for name, word in _REFUSED.items()}
STATUS = ENDINGS | REFUSED
"""Statuses: how the stance ended, or why there is none ("out_of_range": the numbers left the precision's
range).
"""

TAKEOFF = next(number for number, word in ENDINGS.items() if word == "takeoff")
"""The ending that has an apex behind it."""

FLIGHT_STATES = ("x1", "v1", "v2", "y", "ground", "horizon")
FLIGHT_REALS = (
    "duration", "x1", "v1", "x2", "v2", "v2_after", "y", "apex", "apex_time", "impact_loss", "leg_loss", "Kp", "Kd",
)  # fmt: skip
FLIGHT_STATUS = FLIGHT_ENDINGS | REFUSED
"""The same of flights."""
TOUCHDOWN = next(number for number, word in FLIGHT_ENDINGS.items() if word == "touchdown")
"""The ending that has an impact behind it."""

LegState: TypeAlias = records.LegState
"""x1, v1, v2 and the compression y."""
Precision: TypeAlias = np.dtype[Any]
Array: TypeAlias = NDArray[np.floating]
Column: TypeAlias = float | NDArray[Any]
Columns = Sequence[Column]
"""The states, u, horizon, then the robot's fields: numbers, or arrays of one dimension, one length and the precision
in which they are solved."""
Results = tuple[NDArray[np.intc], NDArray[Any]]
"""CODES and REALS of stances, a row each, as `results_like` makes them."""
Readings = Mapping[str, NDArray[Any]]
"""Arrays in one piece for what is asked of stances besides, these on the first axis: `states`, times by x1, v1, v2, y;
`sensitivities`, rows by columns; `tangents`, times by x1, v1, v2, y by columns; the largest `compressions`; NaN where
there are none. As integers of C the status of what is read, `reading_status`, where it is "no_derivative" the ending has
none, and `tangent_status`, where an event grazes or a small change ends a rest.
"""


class Asked(NamedTuple):
    """What stances are asked for: when their input steps, 0 first, if u has a second axis, over the steps; times of states
    and tangents, which must not decrease for the latter; columns of derivatives, None for all.

    Times are arrays of the precision. A column is its number among the package's `elements.COLUMNS`, `column_of_step` or
    `column_of_step_time`.
    """

    step_times: NDArray[Any] | None = None
    times: NDArray[Any] | None = None
    columns: Sequence[int] | None = None


ASKED = Asked()
"""One input from 0 on, all columns."""


def column_of_step(package: Package, step: int) -> int:
    """The column of the input of a step alone, as HOPFORM_COLUMN_OF_STEP."""
    return len(package.elements.COLUMNS) + 2 * step


def column_of_step_time(package: Package, step: int) -> int:
    """The column of the time of a step alone, 1 or later, as HOPFORM_COLUMN_OF_STEP_TIME."""
    return len(package.elements.COLUMNS) + 2 * step + 1


Events = list[tuple[NDArray[np.intp], NDArray[Any], NDArray[np.int8]]]
"""Stances, times and kinds of events: in each list in the order of its stances, all of one stance in one list."""
Steps = tuple[tuple[float, float], ...]
"""Steps of the current [s, A]."""
Target = tuple[float, float, float, float]
"""h_des, datum, stop_margin [m], horizon [s]."""
WITHOUT_CAPS = (2**31 - 1, 0)
"""Caps of a search that has no deadline: evaluations of a candidate, candidates."""


FlightRow = tuple[float, float, float, int, int, int]
"""A phase: t, x1 and v1 where it starts, the sign of v_1, that of the pull at its limit, the event that starts it."""


class FlightLists(NamedTuple):
    """What is asked of flights besides: states at shared times, (flights, times, 4), members as of `LegState`, and
    derivatives by columns of the library, (flights, rows, codes), NaN where there are none; None for what is not.
    """

    times: NDArray[Any] | None
    states: NDArray[Any] | None
    codes: tuple[int, ...]
    matrices: NDArray[Any] | None

    def part(self, part: slice) -> "FlightLists":
        """Those of some flights."""
        states, matrices = (None if each is None else each[part] for each in (self.states, self.matrices))
        return FlightLists(self.times, states, self.codes, matrices)


def results_like(count: int, real: np.dtype[Any]) -> Results:
    """Room for the results of stances."""
    return np.empty((len(CODES), count), np.intc), np.empty((len(REALS), count), real)


def by_name(results: Results, shape: tuple[int, ...]) -> dict[str, NDArray[Any]]:
    """The results by their names, in a shape."""
    codes, reals = results[0].reshape(len(CODES), *shape), results[1].reshape(len(REALS), *shape)
    return {name: codes[n, ...] for n, name in enumerate(CODES)} | {name: reals[n, ...] for n, name in enumerate(REALS)}
