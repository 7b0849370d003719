"""Output of an answer: files are made first, then written, then a text is printed."""

import sys
from collections.abc import Callable, Iterable
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from rich.console import Console, RenderableType

from hopform._cli.render import Record, to_json
from hopform._errors import HopformError, printable
from hopform._files import Named, check_files, name_of, write
from hopform._progress import progress_bar
from hopform._show import Shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes

UNBROKEN = 240
"""Columns that a line may have where no terminal limits it."""


def figures() -> ModuleType:
    """`hopform._figures.plots`, which needs the extra `plot`."""
    from hopform._figures import plots

    return plots


def picture(path: Path, answer: Shown, over: Callable[["Axes"], None] | None = None) -> bytes:
    """The picture of an answer, in the format that the file's name asks for; `over` draws more on its first axes."""
    plots = figures()
    from hopform._figures import results

    figure = results.figure_of(answer)
    if over is not None:
        over(figure.axes[0])
    drawn: bytes = plots.render(figure, path.suffix)
    return drawn


def check_outputs(
    json: bool,
    csv: str | None = None,
    plot: Path | None = None,
    *,
    reads: Iterable[Named] = (),
    more: Iterable[Named] = (),
) -> None:
    """Refuse, before anything is computed, what could not be printed or written afterwards."""
    if json and csv == "-":
        raise HopformError("--json and --csv - both print; give --csv a file")
    if plot is not None:
        figures().check_suffix(plot)
    check_files(reads, [("--csv", csv if csv and csv != "-" else None), *more, ("--plot", plot)])


def emit(
    answer: Shown, record: Callable[[], Record], readable: Callable[[], Iterable[RenderableType]],
    warnings: Iterable[str], *, json: bool, plot: Path | None, over: Callable[["Axes"], None] | None = None,
    csv: str | None = None, columns: Callable[[], str] = str,
    more: Iterable[tuple[Path | None, Callable[[], bytes]]] = (),
) -> None:  # fmt: skip
    """Make everything that was asked for; only then write the files, then print."""
    printed, shown, files = "", list[RenderableType](), list[tuple[Path, bytes]]()
    with progress_bar("writing"):
        if csv == "-":
            printed = columns()
        elif csv:
            files.append((Path(csv), columns().encode()))
        if plot is not None:
            files.append((plot, picture(plot, answer, over)))
        files += [(path, content()) for path, content in more if path is not None]
        if json:
            printed = to_json(**record()) + "\n"
        if not printed:
            shown = [*readable(), *(f"wrote {name_of(path)}" for path, _ in files)]
    write(files)
    warn(warnings)
    print(printed, end="")
    show(shown)


def warn(warnings: Iterable[str]) -> None:
    """Print warnings on the error stream, a line each."""
    for warning in warnings:
        print(f"hopform: warning: {printable(warning)}", file=sys.stderr)


def show(parts: Iterable[RenderableType]) -> None:
    """Print tables: as wide as the terminal, or unbroken and without colour into a pipe."""
    console = Console(markup=False, emoji=False, highlight=False)
    if not console.is_terminal:
        console.width = UNBROKEN
    for part in parts:
        console.print(part)
