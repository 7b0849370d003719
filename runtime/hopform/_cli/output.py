"""Output of an answer: tables for people, JSON for programs, CSV for spreadsheets, pictures; files are made first, then
written, then a text is printed. generated/JSON.md explains JSON and CSV.

JSON and CSV are in SI units and A; tables are in the units in which a hopper is talked about, which their heads name.
"""

import json as json_module
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich import box
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType, RenderResult
from rich.table import Column, Table

from hopform import __version__
from hopform._cli.use import core
from hopform._errors import HopformError, printable
from hopform._figures import figure_of
from hopform._files import Content, Named, check_files, name_of, text_of, write
from hopform._progress import progress_bar
from hopform._robots import KEYS, BaseRobot, attribute_of
from hopform._show import Shown, needs

Record = dict[str, Any]
Several = Iterable[Named]
Over = Callable[[Any], None]
"""What draws more on axes of matplotlib."""
Readable = Callable[[], Iterable[RenderableType]]

UNBROKEN = 240
"""Columns that a line may have where no terminal limits it."""
MOST_ROWS = 40
"""A table that would be longer shows its first and its last rows."""

PROSE = ("title", "meaning", "can", "where", "formula", "denominator", "must be >= 0", "by", "cause", "option")
"""Columns of a table that may be broken into lines where a terminal is narrow."""
LEAST_PROSE = 24
"""Characters that a line of them has, if the text is as long and no word is longer."""
GAP = 2
"""Characters between two columns."""


class WholeTable(Table):
    """A table of which nothing is cut: where a terminal is too narrow for all columns they stand in several tables, one
    below the other, which all begin with the first column. A pipe has whole lines.
    """

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """The tables that fit."""
        widths = [width_of(column, breakable=console.is_terminal) for column in self.columns]
        limit = options.max_width if console.is_terminal else math.inf
        parts = [[0]]
        for n, width in enumerate(widths[1:], 1):
            if len(parts[-1]) > 1 and sum(widths[k] + GAP for k in parts[-1]) + width + 1 > limit:
                parts.append([0])
            parts[-1].append(n)
        for part in parts:
            if part is not parts[0]:
                yield ""
            made = Table(title=self.title if part is parts[0] else None, caption=self.caption if part is parts[-1] else None,
                         title_justify="left", title_style="bold", box=self.box)  # fmt: skip
            made.show_edge, made.padding = False, (0, 1, 0, 0)
            for column, width in ((self.columns[n], widths[n]) for n in part):
                whole = column.no_wrap or not console.is_terminal
                made.add_column(column.header, justify=column.justify, no_wrap=whole, min_width=width)
            of_part = zip(*(self.columns[n].cells for n in part), strict=True)
            for row, cells in zip(self.rows, of_part, strict=True):
                made.add_row(*cells, end_section=row.end_section)
            needed = sum(widths[n] + GAP for n in part)
            yield from console.render(made, options.update(max_width=max(options.max_width, needed)))


def width_of(column: Column, *, breakable: bool) -> int:
    """Characters that a column takes at least: its longest cell; of prose that may be broken its longest word."""
    texts = [str(column.header), *map(str, column.cells)]
    longest = max(map(cell_len, texts))
    if column.no_wrap or not breakable:
        return longest
    return max(min(longest, LEAST_PROSE), *(cell_len(word) for text in texts for word in text.split() or [""]))


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], words: Iterable[str] = ()) -> Table:
    """A table; columns hold numbers, at the right, but for those in `words`. A long one leaves out its middle and says
    so.
    """
    made = WholeTable(title=title, box=box.SIMPLE_HEAD)
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
    return format(scale * value, form) if math.isfinite(value) else "-"


def ends(low: float, high: float, form: str = ".5g", scale: float = 1.0) -> str:
    """An interval of a table, which may have one end; "-" where there is none."""
    found = [number(each, form, scale) for each in (low, high)]
    return " .. ".join(found) if found != ["-", "-"] else "-"


def to_json(command: str, thing: Any = None, /, **own: Any) -> str:
    """Strict JSON of what a command answers, with the version of hopform; `record` says from what."""
    answer = record(f"hopform {command}", thing, hopform=__version__, **own)
    return json_module.dumps(answer, indent=2, allow_nan=False) + "\n"


def answers() -> Mapping[str, Mapping[str, str]]:
    """The fields of each object of the solver in use, with their types."""
    known: Mapping[str, Mapping[str, str]] = core().package.answers.ANSWERS
    return known


def record(kind: str, thing: Any, /, **own: Any) -> Record:
    """An object of generated/JSON.md: its fields are those given, the others attributes of the thing."""
    of = answers()[kind]
    return {name: plain(own[name] if name in own else _read(thing, name), of[name]) for name in of}


def _read(thing: Any, name: str) -> Any:
    """What an object has under a name: of a robot the parameter, but for what every robot has."""
    if isinstance(thing, BaseRobot) and name not in KEYS:
        robot: BaseRobot = thing
        return getattr(robot, attribute_of(type(robot), name))
    return getattr(thing, name)


def plain(value: Any, kind: str) -> Any:
    """The same in what JSON has: null for what is no number or has no limit; the fields of an object may be given in
    their order.
    """
    several, _, each = kind.partition(" of ")
    if value is None:
        return None
    if several == "list":
        return [plain(one, each) for one in value]
    if several == "map":
        return {key: plain(one, each) for key, one in value.items()}
    one = kind.removesuffix(" or null")
    if one in SCALARS:
        return SCALARS[one](value)
    in_order = dict(zip(answers()[one], value, strict=True)) if type(value) in (tuple, np.ndarray) else {}
    return record(one, value, **(value if isinstance(value, dict) else in_order))


def number_or_null(value: float) -> float | None:
    """A number of JSON."""
    return float(value) if math.isfinite(value) else None


SCALARS: dict[str, Callable[[Any], Any]] = {"string": str, "integer": int, "boolean": bool, "number": number_or_null}


# ---- files, then print ----


class Outputs:
    """What a command writes and prints.

    It is checked when it is made, before anything is computed, what could not be printed or written afterwards: json, a
    CSV (`-` prints it), a plot and `more` files by what they are to the command; `reads` are files that it must not
    overwrite.
    """

    def __init__(
        self,
        json: bool = False,
        csv: str | None = None,
        plot: Path | None = None,
        reads: Several = (),
        more: Several = (),
    ) -> None:
        self.json, self.csv, self.plot, self.more = json, csv, plot, list(more)
        if json and csv == "-":
            raise HopformError("--json and --csv - both print; give --csv a file")
        if plot is not None:
            needs("matplotlib", "plot", "a plot")
            from hopform._figures.plots import check_suffix

            check_suffix(plot)
        check_files(reads, [("--csv", csv if csv and csv != "-" else None), *self.more, ("--plot", plot)])

    def emit(
        self,
        readable: Readable,
        warnings: Iterable[str] = (),
        *,
        json: Callable[[], str] = str,
        csv: Callable[[], Content] | None = None,
        more: Sequence[Callable[[], Content]] = (),
        picture_of: Shown | None = None,
        over: Over | None = None,
    ) -> None:
        """Make every file that is named; only then write them, then print: JSON or the CSV if it is asked for, else what
        is readable. picture_of: what --plot draws; over: what draws more on its first axes. more: in the order of the
        files.
        """
        made = list[tuple[str | Path, Content]]()
        with progress_bar("writing"):
            if csv is not None and self.csv:
                made.append((self.csv, csv()))
            if picture_of is not None and self.plot is not None:
                made.append((self.plot, picture(self.plot, picture_of, over)))
            for (_, path), content in zip(self.more, more, strict=True):
                if path is not None:
                    made.append((path, content()))
            if self.json:
                made.append(("-", json()))
        printed = "".join(text_of(text) for path, text in made if path == "-" and not isinstance(text, bytes))
        files = [(Path(path), content) for path, content in made if path != "-"]
        deliver(files, warnings, printed, readable)

    @staticmethod
    def record(kind: str, thing: Any, /, **own: Any) -> Record:
        """An object of generated/JSON.md: its fields are those given, the others attributes of the thing."""
        return record(kind, thing, **own)

    @staticmethod
    def to_json(command: str, thing: Any = None, /, **own: Any) -> str:
        """Strict JSON of what a command answers: an object of generated/JSON.md, with the version of hopform."""
        return to_json(command, thing, **own)


def picture(path: Path, answer: Shown, over: Over | None = None) -> bytes:
    """The picture of an answer, in the format that the file's name asks for; `over` draws more on its first axes."""
    from hopform._figures.plots import render

    figure = figure_of(answer)
    if over is not None:
        over(figure.axes[0])
    return render(figure, path.suffix)


def deliver(files: Sequence[tuple[Path, Content]], warnings: Iterable[str], printed: str, readable: Readable) -> None:
    """Write the files, then print: warnings on the error stream; the text if there is one, else the tables and which
    files were written.
    """
    shown = [] if printed else [*readable(), *(f"wrote {name_of(path)}" for path, _ in files)]
    write(dict(files))
    for warning in warnings:
        print(f"hopform: warning: {printable(warning)}", file=sys.stderr)
    print(printed, end="")
    show(shown)


def spaced(*parts: RenderableType) -> Iterator[RenderableType]:
    """Parts with blank lines between them."""
    for n, part in enumerate(parts):
        yield from ("", part) if n else (part,)


def show(parts: Iterable[RenderableType]) -> None:
    """Print tables: as wide as the terminal, or unbroken and without colour into a pipe."""
    console = Console(markup=False, emoji=False, highlight=False)
    if not console.is_terminal:
        console.width = UNBROKEN
    for part in parts:
        console.print(part, crop=False)  # what no terminal is wide enough for goes on in its next line
