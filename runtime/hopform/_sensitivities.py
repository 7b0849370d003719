"""Derivatives of the ending of a stance by its inputs: those of the library, in the coordinates that people give."""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from types import MappingProxyType
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from hopform._checks import items, pair, shown
from hopform._errors import HopformError
from hopform._robots import nearest
from hopform._show import Arrays, Card, Shown, span
from hopform._solver.choice import Solver
from hopform._solver.package import ROWS, Package, column_of_step, column_of_step_time, records

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
HEIGHT, COMPRESSION = STARTS.index("x2"), -1
"""The height of the body among the columns, where the engine has the compression, and what stands for the latter."""


@dataclass(frozen=True, repr=False, eq=False)
class _Derivatives(Shown):
    """Derivatives in the last two axes of a matrix."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    matrix: NDArray[np.floating]
    units: Mapping[str, str]
    """of rows and columns, by name"""
    aliases: Mapping[str, str] = field(default_factory=dict[str, str])
    """further names of rows and columns: those in a leg's file of what its stance calls x1, v1, x2, v2"""

    def _card(self) -> Card:
        count = int(np.prod(self.matrix.shape[:-2], dtype=int))
        row = "apex" if "apex" in self.rows else self.rows[0]
        of_apex = [name for name in ("v2", "u", "k", "m_s") if name in self.columns]
        by = of_apex if row == "apex" and of_apex else self.columns[:4]
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

    def arrays(self, over: tuple[str, ...], before: str = "") -> Arrays:
        """The derivatives over dimensions, rows and columns, with the units of both.

        over: the names of the stances' dimensions, none for one stance; before: what the names of the arrays begin with.
        HopformError for more or fewer dimensions than there are.
        """
        count = self.matrix.ndim - 2
        names = items("over", over, f"names of {count} dimension(s)", count)
        if len(names) < count:
            raise HopformError(f"over must name {count} dimension(s), got {shown(over)}")
        row, column = f"{before}row", f"{before}column"
        return {
            row: ((row,), list(self.rows), {}), column: ((column,), list(self.columns), {}),
            f"{before}derivative": ((*names, row, column), self.matrix,
                                    {"units": "that of the row over that of the column"}),
            **{f"{name}_unit": ((name,), [self.units[each] for each in of], {})
               for name, of in ((row, self.rows), (column, self.columns))},
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
        aliases.get(name, name) if isinstance(name, str) and name not in known else name
        for name, known in zip(pair("a sensitivity", names, "(row, column) of names"), (rows, columns), strict=True)
    )
    for name, known in ((row, rows), (column, columns)):
        if not isinstance(name, str) or name not in known:
            both = f"{shown(row)}, {shown(column)}"
            raise HopformError(f"there is no sensitivity {both}: {shown(name)} is not one of {', '.join(known)}")
    return rows.index(row), columns.index(column)


# ---- columns by choice ----


class Columns(NamedTuple):
    """What derivatives are by."""

    names: tuple[str, ...]
    """as they were given"""
    by: tuple[int, ...]
    """where each is in `COLUMNS` of its solver, COMPRESSION, or behind them the engine's column of a step"""
    solved: tuple[int, ...] | None
    """the engine's columns that these are made of; None for all, in their order"""
    units: Mapping[str, str] = NO_NAMES
    aliases: Mapping[str, str] = NO_NAMES
    """the names given by others that the same have"""


@lru_cache(maxsize=64)
def all_columns(solver: Solver, x2_is_given: bool, *, by_axis: bool = False) -> Columns:
    """All but those of single steps; by_axis: under the engine's names of coordinates, velocities and input."""
    named = _columns_by_name(solver, x2_is_given, by_axis)
    name_of = {code: name for name, code in named.items()}
    others = {name: name_of[code] for name, code in _spellings(solver, x2_is_given).items() if code in name_of}
    aliases = {name: own for name, own in others.items() if name not in named}
    return Columns(tuple(named), tuple(named.values()), None, aliases=aliases)


def chosen_columns(asked: object, field: str, solver: Solver, x2_is_given: bool, steps: int) -> Columns:
    """Those of names: coordinates and velocities of the start, the input, parameters; u[3], t[3] of step 3 alone.

    HopformError, which begins with the field, for a name that is none, one that is given twice, and a step that the input
    does not have.
    """
    spelled = _spellings(solver, x2_is_given)
    most = len(spelled) + 3 * steps
    names = items(field, [asked] if isinstance(asked, str) else asked, "names, such as 'u' and 'u[3]'", most)
    by = dict[int, str]()
    units, aliases = dict[str, str](), dict[str, str]()
    for name in names:
        code, units[name], others = _column_of(name, field, solver, spelled, steps)
        if code in by:
            same = f"{name!r} twice" if by[code] == name else f"{by[code]!r} and {name!r}, which are the same"
            raise HopformError(f"{field} must have each name once, got {same}")
        by[code] = name
        aliases |= {other: name for other in others if other != name}
    if not by:
        raise HopformError(f"{field} must have at least one name, got none")
    solved = solved_by([*by], x2_is_given, lengthening(solver.package))
    return Columns(tuple(by.values()), tuple(by), tuple(solved), units, aliases)


@lru_cache(maxsize=64)
def _spellings(solver: Solver, x2_is_given: bool) -> Mapping[str, int]:
    """The columns by all names that they have: the input is also u; of a leg those of its file and the engine's, and its
    compression where the height of the body is not given.
    """
    spelled = _columns_by_name(solver, x2_is_given, by_axis="stance" in solver.can)
    of_file = _columns_by_name(solver, x2_is_given, by_axis=False)
    more = {**of_file, "u": STARTS.index("u")} if solver.facts.inputs else of_file
    if "stance" in solver.can and not x2_is_given:
        of_leg = [str(axis["name"]) for name, axis in solver.facts.axes.items() if name == "y"]
        more |= dict.fromkeys(("compression", *of_leg), COMPRESSION)
    return {**spelled, **{name: code for name, code in more.items() if name not in spelled}}


_OF_STEP = re.compile(r"(\w+)\[(-?\d{1,9})\]")


def _column_of(
    name: Any, field: str, solver: Solver, spelled: Mapping[str, int], steps: int
) -> tuple[int, str, Sequence[str]]:
    """The column of a name, its unit, and all names that it has; HopformError for one that is none."""
    if isinstance(name, str) and name in spelled:
        code = spelled[name]
        return code, _unit_of_column(code, solver), [other for other, of in spelled.items() if of == code]
    inputs = [other for other, code in spelled.items() if code == STARTS.index("u")]
    step = _OF_STEP.fullmatch(name) if isinstance(name, str) else None
    if step is None or not inputs or step[1] not in ("t", *inputs):
        singles = [f"{each}[0]" for each in inputs] + ["t[1]"] * bool(inputs)
        hint = nearest(name, [*spelled, *singles]) if isinstance(name, str) else ""
        more = f"; {inputs[0]}[n] and t[n] are the input and the time of step n" if inputs else ""
        raise HopformError(
            f"{field}: there is no derivative by {shown(name)}{hint}; names are {', '.join(spelled)}{more}"
        )
    n, first = int(step[2]), int(step[1] == "t")
    if not first <= n < steps:
        count = f"the input has {steps} step{'s' if steps > 1 else ''}, the first at 0 s"
        allowed = f"a number of {first} .. {steps - 1}" if first < steps else "no step"
        raise HopformError(f"{field}: {step[1]}[n] must have {allowed}, got {name}: {count}")
    if first:
        return column_of_step_time(solver.package, n), "s", [f"t[{n}]"]
    unit = _unit_of_column(STARTS.index("u"), solver)
    return column_of_step(solver.package, n), unit, [f"{each}[{n}]" for each in inputs]


def _columns_by_name(solver: Solver, x2_is_given: bool, by_axis: bool) -> dict[str, int]:
    """The columns by their names, in their order; of a motion that starts from y this is in the place of x2."""
    facts, named = solver.facts, dict[str, int]()
    for axis, name in names_of(solver).items():
        code, shown_as = STARTS.index(axis), axis if by_axis else name
        if code == HEIGHT and not x2_is_given and "y" in facts.axes and "stance" not in solver.can:
            code, shown_as = COMPRESSION, str(facts.axes["y"]["name"])
        named[shown_as] = code
    fields = solver.package.records.Robot._fields
    return named | {name: len(STARTS) + n for n, name in enumerate(fields)}


def _unit_of_column(code: int, solver: Solver) -> str:
    """The unit of what a column is by, other than a single step."""
    facts, fields = solver.facts, solver.package.records.Robot._fields
    if code >= len(STARTS):
        return str(facts.units[fields[code - len(STARTS)]])
    axis = "y" if code == COMPRESSION else STARTS[code]
    return str(facts.inputs[0]["unit"] if axis == "u" else facts.axes[axis]["unit"])


def solved_by(by: Sequence[int], x2_is_given: bool, lengthens: Collection[int]) -> list[int]:
    """The engine's columns that derivatives by some columns are made of: these, and where the height x2 is given that of
    the compression beneath each that changes it at the same x2.
    """
    beneath = [HEIGHT] if x2_is_given and any(code in lengthens for code in by) else []
    return list(dict.fromkeys([*(HEIGHT if code == COMPRESSION else code for code in by), *beneath]))


def columns_beneath(by: Sequence[int], of: Package) -> list[int]:
    """The engine's columns beneath some of those in coordinates."""
    return solved_by(by, True, lengthening(of))


@lru_cache(maxsize=64)
def lengthening(of: Package) -> frozenset[int]:
    """The columns that may change the compression at the same x2: x1, and the parameters of its ratio and length."""
    fields = of.records.Robot._fields
    return frozenset(lengths_of(of, of.records.Robot(*(1.0 + 0.1 * n for n in range(len(fields)))), 1.0))


# ---- in coordinates ----


def in_height(
    solved: NDArray[Any],
    x2_is_given: bool,
    lengthens: Lengths = LENGTHS,
    by: Sequence[int] | None = None,
    held: Sequence[int] | None = None,
) -> NDArray[Any]:
    """Derivatives (..., rows, columns) with the column x2 in place of the compression's, y = ratio x1 - x2 + length.

    lengthens: change of y at the same x2 with x1 and with the parameters that the ratio and the length depend on. Where
    x2 is left out y stays as it is, and the column x2 is 0. by: the columns that are wanted, all if left out; held:
    the engine's columns that `solved` has, all if left out.
    """
    have = {code: n for n, code in enumerate(range(solved.shape[-1]) if held is None else held)}
    wanted = [*have] if by is None else by
    matrix: NDArray[Any] = solved[..., [have[HEIGHT if code == COMPRESSION else code] for code in wanted]]
    for n, code in enumerate(wanted):
        if code == HEIGHT:
            by_y = matrix[..., n]
            matrix[..., n] = np.where(np.isnan(by_y), np.nan, -by_y if x2_is_given else -np.zeros_like(by_y))
        elif x2_is_given and code in lengthens:
            matrix[..., n] += solved[..., have[HEIGHT]] * lengthens[code]
    return matrix


def aliases_of(solver: Solver) -> dict[str, str]:
    """The axes of a solver by the names of its file, where those are others."""
    axes = {str(table["name"]): axis for axis, table in solver.facts.axes.items() if axis in AXES}
    return {name: axis for name, axis in axes.items() if name != axis}


def of_stance(
    kind: Callable[..., Kind],
    solved: NDArray[Any],
    x1: Any,
    x2_is_given: bool,
    solver: Solver,
    parameters: Any,
    by: Columns | None = None,
) -> Kind:
    """The sensitivities of one stance, or of many, from what the library of a solver computes for its robots: by the
    engine's names, which a leg's file may have others for; by: some columns, all if left out.
    """
    names = names_of(solver)
    rows = {n: name for n, name in enumerate(ROWS) if name in names or name not in AXES}
    columns = by or all_columns(solver, x2_is_given, by_axis=True)
    about = aliases_of(solver), _units(solver)
    return _by_names(kind, rows, columns, solved, x1, x2_is_given, solver, parameters, *about)


@lru_cache(maxsize=64)
def _units(solver: Solver) -> Mapping[str, str]:
    """Units by the engine's names."""
    units = {axis: str(table["unit"]) for axis, table in solver.facts.axes.items()}
    for each in solver.facts.inputs:
        units["u"] = str(each["unit"])
    return units


def of_motion(
    kind: Callable[..., Kind],
    solved: NDArray[Any],
    x1: Any,
    x2_is_given: bool,
    solver: Solver,
    parameters: Any,
    by: Columns | None = None,
) -> Kind:
    """Those of the duration and of the coordinates and velocities that the model has, under its names."""
    names = names_of(solver)
    rows = {0: "T"} | {n: names[name] for n, name in enumerate(ROWS) if name in names}
    columns = by or all_columns(solver, x2_is_given)
    return _by_names(kind, rows, columns, solved, x1, x2_is_given, solver, parameters)


def at_times(
    states: Any,
    tangents: NDArray[Any],
    start: Any,
    x2_is_given: bool,
    solver: Solver,
    parameters: Any,
    by: Columns | None = None,
) -> ManySensitivities:
    """Those of states (..., times) at times, from the derivatives of x1, v1, v2 and y at each; start: x1 there."""
    names, columns = names_of(solver), by or all_columns(solver, x2_is_given)
    rows = {n: names[axis] for n, axis in enumerate(AXES) if axis in names}
    robots = type(parameters)(*(each[..., np.newaxis] if np.ndim(each) else each for each in parameters))
    found = _height_of(tangents, lengths_of(solver.package, robots, states.x1), columns.solved)
    begin = np.asarray(start)[..., np.newaxis] if np.ndim(start) else start
    aliases = {axis: name for name, axis in aliases_of(solver).items()} if "stance" in solver.can else NO_NAMES
    return _by_names(ManySensitivities, rows, columns, found, begin, x2_is_given, solver, robots, aliases)


def in_coordinates(
    states: Any,
    tangents: NDArray[Any],
    start: float,
    package: Package,
    parameters: Any,
    by: Sequence[int] | None = None,
) -> NDArray[Any]:
    """Derivatives (times, rows, columns) of x1, v1, x2, v2, by these at the start, from those of x1, v1, v2 and y; start:
    x1 there; by: some of the columns, of which the tangents have `columns_beneath`.
    """
    held = None if by is None else columns_beneath(by, package)
    found = _height_of(tangents, lengths_of(package, parameters, states.x1), held)
    return in_height(found, True, lengths_of(package, parameters, start), by, held)


def _height_of(tangents: NDArray[Any], lengthens: Lengths, held: Sequence[int] | None) -> NDArray[Any]:
    """Derivatives (..., rows, columns) of x1, v1, x2, v2 from those of x1, v1, v2 and y."""
    have = {code: n for n, code in enumerate(range(tangents.shape[-1]) if held is None else held)}
    found = np.empty_like(tangents)
    x1, v1, v2, y = np.moveaxis(tangents, -2, 0)
    found[..., 0, :], found[..., 1, :], found[..., 3, :] = x1, v1, v2
    (_, ratio), *others = lengthens.items()
    found[..., 2, :] = np.asarray(ratio) * x1 - y
    for code, change in others:
        if code in have:
            found[..., 2, have[code]] += change[..., 0]
    return found


@lru_cache(maxsize=64)
def names_of(solver: Solver) -> dict[str, str]:
    """What a motion starts from by the engine's names: coordinates, velocities and the input that the model has."""
    facts = solver.facts
    names = {axis: str(facts.axes[axis]["name"]) for axis in AXES if axis in facts.axes}
    for each in facts.inputs:
        names["u"] = str(each["name"])
    return names


def _by_names(
    kind: Callable[..., Kind], rows: Mapping[int, str], columns: Columns, solved: NDArray[Any], x1: Any,
    x2_is_given: bool, solver: Solver, parameters: Any, aliases: Mapping[str, str] = NO_NAMES,
    units: Mapping[str, str] = NO_NAMES,
) -> Kind:  # fmt: skip
    """Some rows of a matrix by some columns under their names, whose units are given where they are none of the file's."""
    facts, lengthens = solver.facts, lengths_of(solver.package, parameters, x1) if x2_is_given else {}
    matrix = in_height(solved[..., [*rows], :], x2_is_given, lengthens, columns.by, columns.solved)
    matrix.setflags(write=False)
    named = {**facts.units, "T": "s", **units, **columns.units}
    return kind(tuple(rows.values()), columns.names, matrix, named, {**aliases, **columns.aliases})


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
