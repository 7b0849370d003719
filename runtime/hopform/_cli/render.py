"""One renderer of answers: tables for people, JSON for programs, CSV for spreadsheets; generated/JSON.md explains the
last two.

JSON and CSV are in SI units and A; tables are in the units in which a hopper is talked about, which their heads name.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike
from rich import box
from rich.table import Table

from hopform import __version__

Record = dict[str, Any]
Rows = Iterable[Sequence[str]]

MOST_ROWS = 40
"""A table that would be longer shows its first and its last rows."""

PROSE = ("title", "meaning")
"""Columns of a table that may be broken into lines where a terminal is narrow."""


def table(title: str, columns: Sequence[str], rows: Rows, words: Iterable[str] = ()) -> Table:
    """A table; columns hold numbers, at the right, but for those in `words`. A long one leaves out its middle and says
    so.
    """
    made = Table(title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD)
    made.show_edge, made.padding = False, (0, 1, 0, 0)
    for column in columns:
        made.add_column(column, justify="left" if column in words else "right", no_wrap=column not in PROSE)
    shown = list(rows)
    if (left_out := len(shown) - MOST_ROWS) > 0:
        shown[MOST_ROWS // 2 : -MOST_ROWS // 2] = [["..."] * len(columns)]
        made.caption = f"{left_out} rows left out; --json has them all"
    for row in shown:
        made.add_row(*row)
    return made


def number(value: float, form: str = ".5g", scale: float = 1.0) -> str:
    """A number of a table, "-" where there is none."""
    return "-" if math.isnan(value) else format(scale * value, form)


def to_json(**record: Any) -> str:
    """Strict JSON with the version of hopform: records as objects, and null for what is no number or has no limit."""
    return json.dumps(plain({"hopform": __version__, **record}), indent=2, allow_nan=False)


def plain(value: Any) -> Any:
    """The same in what JSON has: named tuples are objects."""
    if hasattr(value, "_asdict"):
        value = value._asdict()
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in cast(Any, value).items()}
    if isinstance(value, (list, tuple)):
        return [plain(each) for each in cast(Sequence[Any], value)]
    if isinstance(value, (float, np.floating, np.ndarray)):
        number = float(cast(Any, value))
        return number if math.isfinite(number) else None
    return value


def pick(thing: Any, *names: str) -> Record:
    """Some attributes of a thing, by their names."""
    return {name: getattr(thing, name) for name in names}


def to_csv(columns: Mapping[str, ArrayLike]) -> str:
    """Columns as text; every number reads back to the same bits."""
    arrays = [np.asarray(column, dtype=float).tolist() for column in columns.values()]
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in zip(*arrays, strict=True))]
    return "\n".join(lines) + "\n"
