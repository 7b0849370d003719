"""Derivatives of the ending of a stance by its inputs: those of the library, in the coordinates that people give."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from hopform._checks import items, pair, shown
from hopform._errors import HopformError
from hopform._show import Arrays, Card, Shown, span
from hopform._solver.choice import Solver
from hopform._solver.package import COLUMNS as SOLVED_COLUMNS
from hopform._solver.package import ROWS, Package, records

Kind = TypeVar("Kind")
STARTS = ("x1", "v1", "x2", "v2", "u")
"""What people differentiate by beside the parameters of the robot."""
AXES = STARTS[:-1]
"""The engine's axes that are coordinates and velocities, in the order in which states are shown."""
COLUMNS = (*STARTS, *records.Robot._fields)
"""The same with those of the hopper."""
NO_NAMES: Mapping[str, str] = MappingProxyType({})
Lengths = Mapping[int, Any]
LENGTHS: Lengths = MappingProxyType(dict.fromkeys(map(COLUMNS.index, ("x1", "L0", "c")), 1.0))
"""How the compression of the paper's leg, x1 - x2 + L0 + c, changes at the same x2, by columns."""


@dataclass(frozen=True, repr=False, eq=False)
class _Derivatives(Shown):
    """Derivatives in the last two axes of a matrix."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    matrix: NDArray[np.floating]
    units: Mapping[str, str]
    """of rows and columns, by name"""
    aliases: Mapping[str, str] = field(default_factory=dict[str, str])
    """the names in a leg's file of what its stance calls x1, v1, x2, v2"""

    def _card(self) -> Card:
        count = int(np.prod(self.matrix.shape[:-2], dtype=int))
        row = "apex" if "apex" in self.rows else self.rows[0]
        of_apex = [name for name in ("v2", "u", "k", "m_s") if name in self.columns]
        by = of_apex if row == "apex" else self.columns[:4]
        found = [(f"d {row}/d {name}", span(self[row, name])) for name in by]
        title = f"Sensitivities: {len(self.rows)} x {len(self.columns)} derivatives of {count} {self._of(count)}"
        return Card(title, [("of", " ".join(self.rows)), ("by", " ".join(self.columns))], found)

    def _of(self, count: int) -> str:
        """Of what they are."""
        return ("ending" if "T" in self.rows else "state") + ("" if count == 1 else "s")

    def __getitem__(self, names: tuple[str, str]) -> Any:
        return self.matrix[(..., *_place(names, self.rows, self.columns, self.aliases))]

    def _arrays(self) -> Arrays:
        return self.arrays(tuple(f"dim_{n}" for n in range(self.matrix.ndim - 2)))

    def arrays(self, over: tuple[str, ...]) -> Arrays:
        """The derivatives over dimensions, rows and columns, with the units of both.

        over: the names of the stances' dimensions, none for one stance. HopformError for more or fewer than these.
        """
        count = self.matrix.ndim - 2
        names = items("over", over, f"names of {count} dimension(s)", count)
        if len(names) < count:
            raise HopformError(f"over must name {count} dimension(s), got {shown(over)}")
        return {
            "row": (("row",), list(self.rows), {}), "column": (("column",), list(self.columns), {}),
            "derivative": ((*names, "row", "column"), self.matrix,
                           {"units": "that of the row over that of the column"}),
            **{f"{name}_unit": ((name,), [self.units[each] for each in getattr(self, f"{name}s")], {})
               for name in ("row", "column")},
        }  # fmt: skip


class Sensitivities(_Derivatives):
    """Derivatives of the ending through the events of a stance, in the units of row over column; NaN where there are
    none.

    rows: the duration T [s], the state x1, v1, x2, v2 at the ending, apex, aed. columns: the initial state x1, v1, x2,
    v2, the current u (all steps alike), the robot's fields. matrix: rows times columns; `[row, column]` is one entry by
    name.
    """

    def __getitem__(self, names: tuple[str, str]) -> float:
        """The derivative of a row by a column, by their names; HopformError if there is none of that name."""
        return float(super().__getitem__(names))


class ManySensitivities(_Derivatives):
    """The same of many, or of states at times, as arrays of their shape: matrix has two further axes, rows and columns.

    Of states the rows are those of the state alone.
    """

    def __getitem__(self, names: tuple[str, str]) -> NDArray[np.floating]:
        """The derivatives of a row by a column, by their names; HopformError if there is none of that name."""
        return np.asarray(super().__getitem__(names))


def _place(
    names: tuple[str, str], rows: tuple[str, ...], columns: tuple[str, ...], aliases: Mapping[str, str]
) -> tuple[int, int]:
    row, column = (
        aliases.get(name, name) if isinstance(name, str) else name
        for name in pair("a sensitivity", names, "(row, column) of names")
    )
    for name, known in ((row, rows), (column, columns)):
        if not isinstance(name, str) or name not in known:
            both = f"{shown(row)}, {shown(column)}"
            raise HopformError(f"there is no sensitivity {both}: {shown(name)} is not one of {', '.join(known)}")
    return rows.index(row), columns.index(column)


def in_height(solved: NDArray[Any], x2_is_given: bool, lengthens: Lengths = LENGTHS) -> NDArray[Any]:
    """Derivatives (..., rows, columns) with the column x2 in place of the compression's, y = ratio x1 - x2 + length.

    lengthens: change of y at the same x2 with x1 and with the parameters that the ratio and the length depend on. Where
    x2 is left out y stays as it is, and the column x2 is 0.
    """
    at = {name: number for number, name in enumerate(SOLVED_COLUMNS)}
    by_y = solved[..., at["y"]].copy() if x2_is_given else np.zeros_like(solved[..., 0])
    matrix = solved.copy()
    matrix[..., at["y"]] = np.where(np.isnan(solved[..., at["y"]]), np.nan, -by_y)
    for column, change in lengthens.items():
        matrix[..., column] += by_y * change
    return matrix


def aliases_of(solver: Solver) -> dict[str, str]:
    """The axes of a solver by the names of its file, where those are others."""
    axes = {str(table["name"]): axis for axis, table in solver.facts.axes.items() if axis in AXES}
    return {name: axis for name, axis in axes.items() if name != axis}


def of_stance(
    kind: Callable[..., Kind], solved: NDArray[Any], x1: Any, x2_is_given: bool, solver: Solver, parameters: Any
) -> Kind:
    """The sensitivities of one stance, or of many, from what the library of a solver computes for its robots: by the
    engine's names, which a leg's file may have others for.
    """
    names = {name: name for name in names_of(solver)}
    rows = {n: name for n, name in enumerate(ROWS) if name in names or name not in AXES}
    about = aliases_of(solver), _units(solver)
    return _by_names(kind, rows, names, solved, x1, x2_is_given, solver, parameters, *about)


@lru_cache(maxsize=64)
def _units(solver: Solver) -> Mapping[str, str]:
    """Units by the engine's names."""
    units = {axis: str(table["unit"]) for axis, table in solver.facts.axes.items()}
    for each in solver.facts.inputs:
        units["u"] = str(each["unit"])
    return units


def of_motion(
    kind: Callable[..., Kind], solved: NDArray[Any], x1: Any, x2_is_given: bool, solver: Solver, parameters: Any
) -> Kind:
    """Those of the duration and of the coordinates and velocities that the model has, under its names."""
    names = names_of(solver)
    rows = {0: "T"} | {n: names[name] for n, name in enumerate(ROWS) if name in names}
    return _by_names(kind, rows, names, solved, x1, x2_is_given, solver, parameters)


def at_times(
    states: Any,
    tangents: NDArray[Any],
    shape: tuple[int, ...],
    start: float,
    x2_is_given: bool,
    solver: Solver,
    parameters: Any,
) -> ManySensitivities:
    """Those of states at times in a shape, from the derivatives of x1, v1, v2 and y at each; start: x1 there."""
    x1, v1, v2, y = np.moveaxis(tangents, -2, 0)
    x2 = height_by(x1, y, lengths_of(solver.package, parameters, states.x1))
    by, names = np.stack((x1, v1, x2, v2), -2).reshape(*shape, len(AXES), tangents.shape[-1]), names_of(solver)
    rows = {n: names[axis] for n, axis in enumerate(AXES) if axis in names}
    return _by_names(ManySensitivities, rows, names, by, start, x2_is_given, solver, parameters)


def in_coordinates(
    states: Any, tangents: NDArray[Any], start: float, package: Package, parameters: Any
) -> NDArray[Any]:
    """Derivatives (times, rows, columns) of x1, v1, x2, v2, by these at the start, from those of x1, v1, v2 and y; start:
    x1 there.
    """
    x1, v1, v2, y = np.moveaxis(in_height(tangents, True, lengths_of(package, parameters, start)), -2, 0)
    return np.stack((x1, v1, height_by(x1, y, lengths_of(package, parameters, states.x1)), v2), -2)


def height_by(x1: NDArray[Any], y: NDArray[Any], lengthens: Lengths) -> NDArray[Any]:
    """Derivatives (..., columns) of x2 from those of x1 and y."""
    (_, ratio), *others = lengthens.items()
    x2: NDArray[Any] = np.asarray(ratio) * x1 - y
    for column, change in others:
        x2[..., column] += change[..., 0]
    return x2


@lru_cache(maxsize=64)
def names_of(solver: Solver) -> dict[str, str]:
    """What a motion starts from by the engine's names: coordinates, velocities and the input that the model has."""
    facts = solver.facts
    names = {axis: str(facts.axes[axis]["name"]) for axis in AXES if axis in facts.axes}
    for each in facts.inputs:
        names["u"] = str(each["name"])
    return names


def _by_names(
    kind: Callable[..., Kind], rows: Mapping[int, str], names: Mapping[str, str], solved: NDArray[Any], x1: Any,
    x2_is_given: bool, solver: Solver, parameters: Any, aliases: Mapping[str, str] = NO_NAMES,
    units: Mapping[str, str] = NO_NAMES,
) -> Kind:  # fmt: skip
    """Some rows of a matrix by the columns that a model has, under names, whose units are given where they are none of
    the file's.
    """
    facts, lengthens = solver.facts, lengths_of(solver.package, parameters, x1) if x2_is_given else {}
    by = in_height(solved, x2_is_given, lengthens)
    columns = [*names.values(), *parameters._fields]
    taken = [*map(STARTS.index, names), *range(len(STARTS), by.shape[-1])]
    if not x2_is_given and "y" in facts.axes and "stance" not in solver.can:
        by[..., STARTS.index("x2")] = solved[..., STARTS.index("x2")]
        columns[columns.index(names["x2"])] = str(facts.axes["y"]["name"])
    matrix = by[..., [*rows], :][..., taken]
    matrix.setflags(write=False)
    return kind(tuple(rows.values()), tuple(columns), matrix, {**facts.units, "T": "s", **units}, aliases)


def lengths_of(of: Package, parameters: Any, x1: Any) -> dict[int, NDArray[Any]]:
    """How y changes at the same x2 with x1, at an x1, and behind that with the parameters that it depends on, by their
    columns: the ratio of a gear, and the change of ratio x1 + length.
    """
    robots = type(parameters)(*(np.asarray(value, float)[..., np.newaxis] for value in parameters))
    records, at = of.records, np.asarray(x1, float)[..., np.newaxis]
    state, still, moved = records.LegState(at, 0.0, 0.0, 0.0), records.StateChange(*np.zeros(4)), np.zeros(len(robots))
    each, none = records.RobotChange(*np.eye(len(robots))), records.RobotChange(*moved)
    ratio = of.formulas.height_change(robots, state, none, still._replace(d_x1=1.0))
    found = {STARTS.index("x1"): np.asarray(ratio, float) if np.ndim(ratio) else np.full(1, ratio)}
    changes = np.asarray(of.formulas.height_change(robots, state, each, still))
    if changes.ndim == 0:  # a length that no parameter changes
        return found
    return found | {
        len(STARTS) + n: change[..., np.newaxis]
        for n, change in enumerate(np.moveaxis(changes, -1, 0))
        if np.any(change)
    }
