"""`hopform figures DIR`: the paper's figures from this project's robots, as SVG and PNG, with their captions and an
animation."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from hopform._checks import shown
from hopform._cli.output import figures as renderer
from hopform._cli.output import show
from hopform._cli.render import pick, to_json
from hopform._errors import HopformError
from hopform._figures import DRAWN, draw
from hopform._files import check_files, check_folder, name_of, write_folder

if TYPE_CHECKING:
    from hopform._figures.picture import Picture

ANIMATION = "animation"
CAPTIONS = "captions.md"
FORMATS = (".svg", ".png")

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="where to; made if it is not there")]
Only = Annotated[
    str | None, typer.Option("--only", metavar="N,N,...", help="these figures, or the word animation; all if left out")
]
Json = Annotated[bool, typer.Option("--json", help="print what was written, with the captions")]


def figures(folder: Folder, only: Only = None, json: Json = False) -> None:
    """Draw the paper's figures 2 to 17 from this project's robots, and the hopper on rough ground.

    Each becomes an SVG and a PNG with its caption; captions.md has the captions of what was drawn, animation.gif moves.
    """
    wanted = asked_for(only)
    check(folder, wanted)
    files, pictures = drawn(wanted)
    write_folder(folder, {Path(name): content for name, content in files.items()})
    if json:
        print(
            to_json(
                figures=[pick(each, "number", "title", "paper", "ours", "robot") for each in pictures],
                files=[str(folder / name) for name in files],
            )
        )
    else:
        show(
            [
                *(f"Fig. {each.number:<3} {each.title}" for each in pictures),
                f"wrote {len(files)} files to {name_of(folder)}",
            ]
        )


def asked_for(only: str | None) -> tuple[int | str, ...]:
    """The figures that `--only` names, in the paper's order; HopformError for one that does not exist."""
    if only is None:
        return (*DRAWN, ANIMATION)
    known = {str(number): number for number in DRAWN} | {ANIMATION: ANIMATION}
    words = [word.strip() for word in only.split(",")]
    for word in words:
        if word not in known:
            raise HopformError(f"--only takes {', '.join(known)}, separated by commas, got {shown(word)}")
    return tuple(what for word, what in known.items() if word in words)


def names_of(what: int | str) -> tuple[str, ...]:
    """The files of a figure, or of the animation."""
    return ("animation.gif",) if isinstance(what, str) else tuple(f"fig_{what:02d}{suffix}" for suffix in FORMATS)


def check(folder: Path, wanted: Iterable[int | str]) -> None:
    """HopformError, before anything is drawn, if it cannot be written there."""
    check_folder(folder)
    if folder.is_dir():
        drawings = [(what if isinstance(what, str) else f"Fig. {what}", names_of(what)) for what in wanted]
        files = [(what, folder / name) for what, names in drawings for name in names]
        check_files((), [*files, ("the captions", folder / CAPTIONS)])


def drawn(wanted: Iterable[int | str]) -> "tuple[dict[str, bytes], list[Picture]]":
    """The files, by their names, and the pictures; a bar on the error stream if a person is there to see it."""
    plots = renderer()
    from hopform._figures import animation

    wanted = list(wanted)
    files, pictures = dict[str, bytes](), list["Picture"]()
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("drawing", total=len(wanted))
        for what in wanted:
            bar.update(task, description="animation" if isinstance(what, str) else f"Fig. {what}")
            if isinstance(what, str):
                files |= dict.fromkeys(names_of(what), animation.shipped().gif)
            else:
                pictures.append(draw(what))
                figure = pictures[-1].figure
                files |= {name: plots.render(figure, Path(name).suffix) for name in names_of(what)}
            bar.advance(task)
    if pictures:
        files[CAPTIONS] = captions(pictures).encode()
    return files, pictures


def captions(pictures: "Iterable[Picture]") -> str:
    """The captions as Markdown."""
    parts = [
        "# The figures, from this project's robots\n\nWritten by `hopform figures`; the numbers are computed as they "
        "are drawn.\n"
    ]
    parts += [
        f"## Fig. {each.number}. {each.title}\n\n![Fig. {each.number}](fig_{each.number:02d}.svg)\n\n"
        f"**The paper** shows {each.paper}.\n\n**Here:** {each.ours}.\n\n"
        f"Parameters: {each.robot}, this project's own; the paper gives none.\n"
        for each in pictures
    ]
    return "\n".join(parts)
