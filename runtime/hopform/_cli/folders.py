"""The commands that fill a folder: `hopform figures DIR`, the paper's figures from one's own robot or this project's,
with captions, data and an animation; `hopform export DIR --for cmake`, the C library as a package for a firmware's
build system, and `hopform selftest`.
"""

import json as json_module
import re
import warnings
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from hopform import ROBOTS, HopformError, Reachability, Robot, Run, _export
from hopform._checks import shown
from hopform._cli.output import deliver, renderer, to_json
from hopform._cli.use import core, file_of, robot_in_use, usual
from hopform._figures import DRAWN, draw
from hopform._files import Named, check_files, check_folder, csv_of, name_of, read_text, write_folder
from hopform._progress import progress_bar
from hopform._robots import BaseRobot
from hopform._show import arrays_of

if TYPE_CHECKING:
    from hopform._figures.picture import Picture

ANIMATION = "animation"
CAPTIONS, IN_TEX = "captions.md", "captions.tex"
CAPTIONED = ("image", "tex", "none")
FORMATS = ("svg", "png", "pdf")
ROLES = ("drop", "step")
What = int | str
"""A figure by its number, or the animation."""
WIDTHS = {"in": 1.0, "cm": 1.0 / 2.54, "mm": 1.0 / 25.4, "pt": 1.0 / 72.27}
"""Units of a width in inches; a point is that of TeX."""


def figures(
    folder: Path, only: str | None = None, robot: str | None = None, values: list[str] | None = None,
    recordings: str | None = None, format: str = "svg,png", width: str = "6.4in", caption: str = "image", style: Path | None = None,
    json: bool = False,
) -> None:  # fmt: skip
    """Draw the paper's figures 1 to 17 from your robot or this project's, and the hopper on rough ground.

    Each becomes a file of each format, its text as text, with its data as CSV beside it; captions.md has the captions
    of what was drawn, animation.gif moves. What a robot cannot do is named and left out.
    """
    wanted, formats = asked_for(only), listed("--format", format, FORMATS)
    if caption not in CAPTIONED:
        raise HopformError(f"--caption takes {', '.join(CAPTIONED)}, got {shown(caption)}")
    sources = recordings_of(recordings) if recordings else {}
    reads: list[Named] = [("--robot", file_of(robot)), ("--style", style)]
    reads += [(f"--recordings {role}", path) for role, path in sources.items()]
    check_folder(folder)
    texts = [CAPTIONS, IN_TEX] if caption == "tex" else [CAPTIONS]
    writes = [(called(what), folder / name) for what in wanted for name in names_of(what, formats)]
    check_files(reads, [*writes, *(("the captions", folder / name) for name in texts)] if folder.is_dir() else [])
    plots = renderer()
    plots.LOOK.set(plots.Look(width_of(width), style_of(style), caption == "image"))
    shipped = robot is None and not values and usual() in ROBOTS  # then each figure has its own
    own = None if shipped else robot_in_use(robot, values, "stance")
    if own is not None and not {each.name for each in Robot.fields()} <= {each.name for each in own.fields()}:
        raise HopformError(
            f"the figures change parameters of the paper's hopper by name, and the model {own.solver.name} has others: "
            "--plot of stance, hop and reach draws it"
        )
    try:
        with one_line(f"--style {name_of(style)}") if style else nullcontext():
            files, pictures, left_out = drawn(wanted, own, sources, formats)
    finally:
        plots.LOOK.set(plots.Look())
    if pictures:
        both = {CAPTIONS: captions(pictures, formats), IN_TEX: in_tex(pictures)}
        files |= {name: both[name].encode() for name in texts}
    if not files:
        raise HopformError(left_out[0])
    write_folder(folder, {Path(name): content for name, content in files.items()})
    text = to_json("figures", figures=pictures, files=[folder / name for name in files]) if json else ""
    titles = (f"Fig. {each.number:<3} {each.title}" for each in pictures)
    deliver((), left_out, text, lambda: [*titles, f"wrote {len(files)} files to {name_of(folder)}"])


def asked_for(only: str | None) -> tuple[What, ...]:
    """The figures that `--only` names, in the paper's order; HopformError for one that does not exist."""
    known = {str(number): number for number in DRAWN} | {ANIMATION: ANIMATION}
    words = list(known) if only is None else listed("--only", only, known)
    return tuple(what for word, what in known.items() if word in words)


def recordings_of(text: str) -> dict[str, str]:
    """The files of recordings by their roles; HopformError for a role that no figure has."""
    pairs = [each.partition("=") for each in text.split(",")]
    listed("--recordings", ",".join(role for role, _, _ in pairs), ROLES)
    return {role.strip(): path for role, _, path in pairs}


def listed(option: str, text: str, known: Iterable[str]) -> list[str]:
    """The words of an option, separated by commas; HopformError for one that is not known."""
    words = [word.strip() for word in text.split(",")]
    for word in words:
        if word not in known:
            raise HopformError(f"{option} takes {', '.join(known)}, separated by commas, got {shown(word)}")
    return words


def width_of(text: str) -> float:
    """A width in inches; HopformError for what is none, or too narrow or wide for a page."""
    match = re.fullmatch(r"([0-9]+(?:\.[0-9]*)?)\s*(in|cm|mm|pt)", text.strip())
    inches = float(match[1]) * WIDTHS[match[2]] if match else 0.0
    if not 2.0 <= inches <= 40.0:
        raise HopformError(f"--width must be 2in to 40in, with a unit of {', '.join(WIDTHS)}, got {shown(text)}")
    return inches


def style_of(path: Path | None) -> dict[str, Any]:
    """The settings of a style sheet of matplotlib, and text as text; HopformError for one that is not about looks, a
    value that matplotlib does not take, or fonts of which none is there.
    """
    import matplotlib as mpl

    found: dict[str, Any] = {"svg.fonttype": "none"}
    if path is not None:
        for number, line in enumerate(read_text(path, 2**20).splitlines(), 1):
            key, colon, _ = line.partition(":")
            at = f"{name_of(path)}, line {number}:"
            if not line.strip() or line.strip().startswith("#"):
                continue
            if not (colon and key.strip() in mpl.rcParams):
                raise HopformError(f"{at} no setting of matplotlib, got {shown(line)}")
            if not LOOKS.fullmatch(key.strip()):
                allowed = (
                    "a style has settings of looks: axes, figure, font, grid, legend, lines, text, ticks and so on"
                )
                raise HopformError(f"{at} {key.strip()} is not allowed; {allowed}")
        with one_line(name_of(path)):
            settings = mpl.rc_params_from_file(path, True, False)  # pyright: ignore[reportUnknownMemberType]
            found.update(settings.items())
        refuse_absent_fonts(found, name_of(path))
    return found


LOOKS = re.compile(
    r"(axes|boxplot|contour|date|errorbar|grid|hatch|hist|image|legend|lines|markers|mathtext|patch|polaraxes|scatter"
    r"|[xy]axis|[xy]tick|font)\..+"
    r"|figure\.(dpi|edgecolor|facecolor|figsize|frameon|label(size|weight)|subplot\..+|title(size|weight))"
    r"|savefig\.(dpi|edgecolor|facecolor|pad_inches|transparent)"
    r"|text\.(antialiased|color|hinting|hinting_factor|kerning_factor|parse_math)|(svg|pdf)\.fonttype"
)
"""Settings of matplotlib that change looks: others start programs, call functions, or change what is written where."""
FAILURES = (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)
"""What matplotlib raises of a setting that it takes and cannot draw with."""


@contextmanager
def one_line(name: str) -> Generator[None, None, None]:
    """What matplotlib raises in this block is said in one line, with the name of the style."""
    try:
        yield
    except HopformError:
        raise
    except FAILURES as error:
        raise HopformError(f"{name}: {' '.join(str(error).split())[:200]}") from None


def refuse_absent_fonts(style: Mapping[str, Any], name: str) -> None:
    """HopformError for a list of fonts of a style of which this machine has none."""
    from matplotlib import font_manager

    generic = ("serif", "sans-serif", "cursive", "fantasy", "monospace")
    there = {*generic, "sans", "sans serif", *font_manager.get_font_names()}
    for setting in ("family", *generic):
        fonts = style.get(f"font.{setting}", [])
        if fonts and not there & {*fonts}:
            raise HopformError(f"{name}: font.{setting}: none of its fonts is installed, got {', '.join(fonts)}")


def names_of(what: What, formats: Iterable[str]) -> tuple[str, ...]:
    """The files of a figure, or of the animation."""
    return (f"{what}.gif",) if isinstance(what, str) else tuple(f"fig_{what:02d}.{end}" for end in (*formats, "csv"))


def called(what: What) -> str:
    """How a figure is called, or the animation."""
    return what if isinstance(what, str) else f"Fig. {what}"


def drawn(
    wanted: Sequence[What], robot: Robot | None, sources: Mapping[str, str], formats: list[str]
) -> "tuple[dict[str, bytes], list[Picture], list[str]]":
    """The files, by their names, the pictures, and what was left out and why."""
    plots = renderer()
    from hopform._figures import animation

    files, pictures, left_out = dict[str, bytes](), list["Picture"](), list[str]()
    with progress_bar("drawing") as bar, warnings.catch_warnings(record=True) as said:
        for n, what in enumerate(wanted):
            bar(n, len(wanted), called(what))
            *images, last = names_of(what, formats)
            try:
                if isinstance(what, str):
                    files[last] = animation.hopping(robot or robot_in_use(None, None)).gif
                    continue
                picture = draw(what, robot or robot_in_use(usual(DRAWN[what][2]), None), sources)
            except HopformError as error:
                if robot is None and not sources:
                    raise
                left_out.append(f"{'the ' if isinstance(what, str) else ''}{called(what)} is left out: {error}")
                continue
            pictures.append(picture)
            files |= {name: plots.render(picture.figure, Path(name).suffix) for name in images}
            files[last] = table_of(picture.data).encode()
    return files, pictures, [*left_out, *dict.fromkeys(" ".join(str(each.message).split()) for each in said)]


def table_of(data: Mapping[str, Any]) -> str:
    """What is drawn as CSV, a column each, SI units and A; shorter ones end in empty cells."""
    return csv_of(dict(columns_of("", data)))


def columns_of(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """The columns of a value: of a run its motion and its hops, of a map its currents, of a record its fields."""
    if isinstance(value, (Run, Reachability)):
        arrays = arrays_of(value, renderer().run_times(value) if isinstance(value, Run) else None)
        value = {key: values for key, (_, values, *_) in arrays.items()}
    elif isinstance(value, BaseRobot):
        value = cast(Robot, value).parameters
    value = value._asdict() if hasattr(value, "_asdict") else getattr(value, "__dict__", value)
    if isinstance(value, Mapping):
        for key, each in value.items():  # pyright: ignore[reportUnknownVariableType]
            yield from columns_of(f"{name} {key}".strip(), each)
        return
    array = np.asarray(value)
    if array.dtype.kind in "fiub" and array.ndim == 2:
        yield from ((f"{name} {n}", column) for n, column in enumerate(array.T))
    elif array.dtype.kind in "fiubU" and array.ndim < 2:
        yield name, np.atleast_1d(array)


def captions(pictures: "Iterable[Picture]", formats: list[str]) -> str:
    """The captions as Markdown."""
    parts = ["# The figures\n\nWritten by `hopform figures`; the numbers are computed as they are drawn.\n"]
    parts += [
        f"## Fig. {each.number}. {each.title}\n\n![Fig. {each.number}](fig_{each.number:02d}.{formats[0]})\n\n"
        f"**The paper** shows {each.paper}.\n\n**Here:** {each.ours}.\n\nParameters: {each.whose}.\n"
        for each in pictures
    ]
    return "\n".join(parts)


def in_tex(pictures: "Iterable[Picture]") -> str:
    """The figures with their captions for LaTeX."""
    lines = ("begin{figure}", "centering", "includegraphics{fig_%02d}", "caption{%s}", "label{fig:hopform-%d}")
    form = "".join(f"\\{line}\n" for line in (*lines, "end{figure}"))
    words = ((each.number, each.caption.removeprefix(f"Fig. {each.number}. ")) for each in pictures)
    return "\n".join(form % (number, tex(text), number) for number, text in words)


def tex(text: str) -> str:
    """A text as LaTeX prints it."""
    special = {"\\": r"\textbackslash{}", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}"}
    return re.sub(r"[\\^~#$%&_{}]", lambda match: special.get(match[0], f"\\{match[0]}"), text)


# ---- hopform export, hopform selftest ----


def export(
    folder: Path, system: str = "plain", robot: str | None = None, values: list[str] | None = None,
    prefix: str = "hopform", f32: bool = False, f64: bool = False, json: bool = False,
) -> None:  # fmt: skip
    """Write the C library for firmware: sources, amalgamated pair, README, costs, and a build system's manifest; with
    --robot also a program that makes this robot hop, on a board or simulated.
    """
    chosen = tuple(name for name, alone in {"f32": f32, "f64": f64}.items() if alone) or _export.PRECISIONS
    own = robot_in_use(robot, values, "hop") if robot or values else None
    files = _export.export(folder, _export.Wanted(cast(Any, system), prefix, chosen, own, core()))
    if json:
        print(json_module.dumps({"folder": str(folder), "files": [file.as_posix() for file in files]}, indent=2))
    else:
        print(f"{len(files)} files in {name_of(folder)}; begin with {name_of(folder / 'README.md')}")


def selftest(json: bool = False) -> None:
    """Print the digests of the C library's selftest, which a board must repeat."""
    dtypes = {"f32": "float32", "f64": "float64"}
    digests = {f"hopform_selftest_{name}": f"{_export.selftest(dtype, core()):08x}" for name, dtype in dtypes.items()}
    print(json_module.dumps(digests, indent=2) if json else "\n".join(map(" ".join, digests.items())))
