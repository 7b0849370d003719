"""Derivatives of flights by the inputs that people name, from the columns that the library computes.

The library differentiates by the state at take-off x1, v1, v2 and y, the leg's compression, on ground that stays, and by
the height of the ground ahead. People give the height of the body over that, x2, or leave it out. The compression they
give, or it is that of the unloaded leg, which changes with the velocities where a damper acts in the leg.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hopform._checks import items, shown
from hopform._errors import HopformError
from hopform._sensitivities import STARTS, aliases_of, lengths_of, names_of
from hopform._solver.choice import Solver
from hopform._solver.package import Package

BEYOND_STANCES = ("ground", "Kp", "Kd")
"""What flights are differentiated by beside what stances are: the height of the ground ahead, the gains."""
ROWS = ("T", "x1", "v1", "x2", "v2", "v2_after", "apex")
"""What is differentiated, in the order of the library's rows: time and state of the ending, before the impact, the
velocity of the body behind that, hop height of the apex.
"""
UNITS = {"T": "s", "ground": "m", "Kp": "N/m", "Kd": "N s/m"}
_OF_ENGINE = ("x1", "v1", "y", "v2", "u")


@dataclass(frozen=True)
class Columns:
    """Columns by their names, and the numbers of the library's that they are made of."""

    names: tuple[str, ...]
    codes: tuple[int, ...]
    x2_is_given: bool
    releases: bool
    """whether the compression follows from the velocities"""


def rows_of(solver: Solver) -> dict[int, str]:
    """The rows that a solver's flights have, by their number in the library."""
    names = names_of(solver)
    return {n: name for n, name in enumerate(ROWS) if name in names or name not in STARTS}


def all_columns(solver: Solver) -> tuple[str, ...]:
    """All that a solver's flights are differentiated by: starts by the engine's names."""
    starts = (name for name in names_of(solver) if name != "u")
    return (*starts, *BEYOND_STANCES, *solver.package.records.Robot._fields)


def chosen(solver: Solver, asked: Any, x2_is_given: bool, compression_is_given: bool, parameters: Any) -> Columns:
    """The columns of a choice: True for all, or names. HopformError for a name that is none of them, or comes twice."""
    known = all_columns(solver)
    names, aliases = known, aliases_of(solver)
    if asked is not True:
        allowed = f"True, False or names among {', '.join(known)}"
        given = items("sensitivities", asked, allowed, len(known))
        names = tuple(aliases.get(name, name) if isinstance(name, str) else name for name in given)
        for name in names:
            if not isinstance(name, str) or name not in known:
                raise HopformError(f"sensitivities must be {allowed}, got {shown(name)}")
            if names.count(name) > 1:
                raise HopformError(f"sensitivities must have each name once, got {shown(name)} twice")
    releases = not compression_is_given and bool(np.any(solver.package.formulas.leg_time(parameters)))
    beneath = {*names} | ({"ground"} if x2_is_given else set[str]()) | ({"y"} if releases else set[str]())
    codes = (code for code, name in enumerate(_engine_names(solver.package)) if name in beneath)
    return Columns(names, tuple(codes), x2_is_given, releases)


def _engine_names(package: Package) -> tuple[str, ...]:
    """The library's columns, those of the start by the engine's names."""
    return (*_OF_ENGINE, *package.elements.FLIGHT_COLUMNS[len(_OF_ENGINE) :])


def by_names(columns: Columns, solved: NDArray[Any], start: Any, solver: Solver, parameters: Any) -> NDArray[Any]:
    """Derivatives (..., rows, names) from those of the library (..., rows, codes); start: x1, v1, v2 at take-off."""
    names = _engine_names(solver.package)
    by = {names[code]: solved[..., n] for n, code in enumerate(columns.codes)}
    fields = (*STARTS, *parameters._fields)
    lengthens: dict[str, Any] = {}
    if columns.x2_is_given:
        lengthens = {fields[n]: each for n, each in lengths_of(solver.package, parameters, start[0]).items()}
    releases = _releases(solver.package, parameters, start) if columns.releases else {}
    matrix = np.empty((*solved.shape[:-1], len(columns.names)), solved.dtype)
    for n, name in enumerate(columns.names):
        if name == "x2":
            matrix[..., n] = -by["ground"] if columns.x2_is_given else 0.0 * solved.sum(-1)  # NaN where there is none
            continue
        matrix[..., n] = by[name]
        if name in lengthens:
            matrix[..., n] += lengthens[name] * by["ground"]
        if name in releases:
            matrix[..., n] += releases[name] * (by["y"] - by["ground"] if columns.x2_is_given else by["y"])
    matrix = matrix[..., [*rows_of(solver)], :]
    matrix.setflags(write=False)
    return matrix


def _releases(package: Package, parameters: Any, start: Any) -> dict[str, Any]:
    """How the compression of the unloaded leg changes, (..., 1), by name: N is 0 with each change."""
    robots = type(parameters)(*(np.asarray(value, float)[..., np.newaxis] for value in parameters))
    x1, v1, v2 = (np.asarray(value, float)[..., np.newaxis] for value in start)
    records, formulas, count = package.records, package.formulas, len(robots)
    state = records.LegState(x1, v1, v2, formulas.compression_at_takeoff(robots, v1, v2))
    still, fixed = records.StateChange(*np.zeros(4)), records.RobotChange(*np.zeros(count))
    changes = {
        "v1": formulas.contact_change(robots, state, fixed, still._replace(d_v1=1.0)),
        "v2": formulas.contact_change(robots, state, fixed, still._replace(d_v2=1.0)),
    }
    by_field = formulas.contact_change(robots, state, records.RobotChange(*np.eye(count)), still)
    changes |= {name: by_field[..., n, np.newaxis] for n, name in enumerate(robots._fields) if np.any(by_field[..., n])}
    return {name: -np.asarray(change) for name, change in changes.items()}


def units_of(solver: Solver) -> dict[str, str]:
    """Units of rows and columns, by name."""
    units = {axis: str(table["unit"]) for axis, table in solver.facts.axes.items()}
    return {**solver.facts.units, **units, "v2_after": units["v2"], **UNITS}


def without_row(matrix: NDArray[Any], row: int, where: Any = True) -> NDArray[Any]:
    """The derivatives (..., rows, names) with NaN in a row, where that has none."""
    result = matrix.copy()
    result[..., row, :] = np.where(np.asarray(where)[..., np.newaxis], np.nan, matrix[..., row, :])
    result.setflags(write=False)
    return result
