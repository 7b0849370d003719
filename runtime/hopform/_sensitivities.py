"""Derivatives of the take-off of a stance by its inputs: those of the back ends, in the coordinates that people
give.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from hopform._checks import items, pair, shown
from hopform._errors import HopformError
from hopform._show import UNITS, Arrays, Card, Shown, span
from hopform._solver.package import COLUMNS as SOLVED_COLUMNS
from hopform._solver.package import ROWS, records

Kind = TypeVar("Kind")
COLUMNS = ("x1", "v1", "x2", "v2", "u", *records.Robot._fields)


@dataclass(frozen=True, repr=False, eq=False)
class _Derivatives(Shown):
    """Derivatives in the last two axes of a matrix."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    matrix: NDArray[np.floating]

    def _card(self) -> Card:
        count = int(np.prod(self.matrix.shape[:-2], dtype=int))
        apex = self.matrix[..., self.rows.index("apex"), :]
        found = [(f"d apex/d {name}", span(apex[..., self.columns.index(name)])) for name in ("v2", "u", "k", "m_s")]
        title = f"Sensitivities: {len(self.rows)} x {len(self.columns)} derivatives of {count} take-off(s)"
        return Card(title, [("of", " ".join(self.rows)), ("by", " ".join(self.columns))], found)

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
            **{f"{name}_unit": ((name,), [UNITS[each] for each in getattr(self, f"{name}s")], {})
               for name in ("row", "column")},
        }  # fmt: skip


class Sensitivities(_Derivatives):
    """Derivatives of the take-off through the events of a stance, in the units of row over column; NaN without
    take-off.

    rows: T [s], the state x1, v1, x2, v2 at take-off, apex, aed. columns: the initial state x1, v1, x2, v2, the current
    u (all steps alike), the robot's fields. matrix: rows times columns; `[row, column]` is one entry by name.
    """

    def __getitem__(self, names: tuple[str, str]) -> float:
        """The derivative of a row by a column, by their names; HopformError if there is none of that name."""
        return float(self.matrix[_place(names)])


class ManySensitivities(_Derivatives):
    """The same of many stances, as arrays of their shape: matrix has two further axes, rows and columns."""

    def __getitem__(self, names: tuple[str, str]) -> NDArray[np.floating]:
        """The derivatives of a row by a column, by their names; HopformError if there is none of that name."""
        return np.asarray(self.matrix[(..., *_place(names))])


def _place(names: tuple[str, str]) -> tuple[int, int]:
    row, column = pair("a sensitivity", names, "(row, column) of names")
    for name, known in ((row, ROWS), (column, COLUMNS)):
        if not isinstance(name, str) or name not in known:
            both = f"{shown(row)}, {shown(column)}"
            raise HopformError(f"there is no sensitivity {both}: {shown(name)} is not one of {', '.join(known)}")
    return ROWS.index(row), COLUMNS.index(column)


def in_height(solved: NDArray[Any], x2_is_given: bool) -> NDArray[Any]:
    """Derivatives (..., rows, columns) with the column x2 in place of the compression's, y = x1 - x2 + L0 + c.

    Where x2 is left out it is x1 + L0 + c: y stays 0, and the column x2 is 0.
    """
    at = {name: number for number, name in enumerate(SOLVED_COLUMNS)}
    by_y = solved[..., at["y"]].copy() if x2_is_given else np.zeros_like(solved[..., 0])
    matrix = solved.copy()
    matrix[..., at["y"]] = np.where(np.isnan(solved[..., at["y"]]), np.nan, -by_y)
    for name in ("x1", "L0", "c"):
        matrix[..., at[name]] += by_y
    return matrix


def of_matrix(kind: Callable[..., Kind], solved: NDArray[Any], x2_is_given: bool) -> Kind:
    """The sensitivities of one stance, or of many, from what a back end computes."""
    matrix = in_height(solved, x2_is_given)
    matrix.setflags(write=False)
    return kind(ROWS, COLUMNS, matrix)
