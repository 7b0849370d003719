"""The command line: `hopform stance --robot hopper_c --height 0.2 --u 3`, and its sisters.

`tables` writes what it prints, `plots` draws. Exit codes: 0, there is an answer, whatever it is; 2, bad input, one
line on the error stream says which, and nothing was written; 1, a fault of hopform, or a pipe that was closed.
"""

import math
import os
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

import hopform
from hopform import cli_export, tables

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UsageError: type[Exception] = typer.BadParameter.__bases__[0]
"""What typer raises for a command line that it cannot read; it has no public name in every version of typer."""

PATIENCE = 2.0
"""[s] after which a person who waits is shown that something happens."""

UNBROKEN = 240
"""Columns that a line may have where no terminal limits it."""

app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)


class BackendName(StrEnum):
    c = "c"
    numpy = "numpy"


class Precision(StrEnum):
    float64 = "float64"
    float32 = "float32"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line on `arguments` (the process's own if None) and return the exit code."""
    try:
        code = app(args=arguments, prog_name="hopform", standalone_mode=False)
        sys.stdout.flush()
    except hopform.HopformError as error:
        return refuse(str(error))
    except UsageError as error:
        return refuse(getattr(error, "format_message", error.__str__)())
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (typer.Abort, KeyboardInterrupt):
        return 130
    return code if isinstance(code, int) else 0


def refuse(message: str) -> int:
    """Say in one line what is wrong with the input."""
    print("hopform:", " ".join(message.split()), file=sys.stderr)
    return 2


# ---- what the options take ----


def number_in(unit: str) -> Callable[[str], float]:
    """The parser of a number in `unit`, which is not written: a unit, NaN and infinities are refused."""

    def parse(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise typer.BadParameter(f"takes a number in {unit}, written without a unit, got {text!r}") from None
        if not math.isfinite(value):
            raise typer.BadParameter(f"takes a finite number in {unit}, got {text!r}")
        return value

    return parse


def steps_of_current(text: str) -> list[tuple[float, float]]:
    """Steps of the current from "t:u,t:u,..."."""
    second, ampere = number_in("s"), number_in("A")
    steps: list[tuple[float, float]] = []
    for pair in text.split(","):
        t, colon, u = pair.partition(":")
        if not colon:
            raise typer.BadParameter(f"takes steps t:u in s and A, as in 0:0,0.05:2.0, got {pair!r}")
        steps.append((second(t), ampere(u)))
    return steps


def quantity(name: str, unit: str, meaning: str) -> Any:
    return typer.Option(name, parser=number_in(unit), metavar=unit.upper(), help=f"[{unit}] {meaning}")


def option(name: str, meaning: str, **how: Any) -> Any:
    return typer.Option(name, help=meaning, **how)


RobotName = Annotated[str, option("--robot", "a shipped robot, or a TOML file", metavar="NAME|FILE.toml")]
OneRobot = Annotated[str | None, typer.Argument(metavar="[NAME|FILE.toml]", help="one robot; all if left out")]
OneEquation = Annotated[str | None, typer.Argument(metavar="[N]", help="an equation's number; all if left out")]
Height = Annotated[float, quantity("--height", "m", "hop height of the drop")]
HeightOrNone = Annotated[float | None, quantity("--height", "m", "hop height of the drop; or give --v2")]
V2 = Annotated[float | None, quantity("--v2", "m/s", "velocity of the body after the impact, < 0 downwards")]
X1 = Annotated[float, quantity("--x1", "m", "displacement of the actuator at touchdown")]
V1 = Annotated[float, quantity("--v1", "m/s", "its velocity")]
X2 = Annotated[float | None, quantity("--x2", "m", "height of the body; from zero spring force if left out")]
U = Annotated[float, quantity("--u", "A", "current, constant over each stance")]
Steps = Annotated[
    Any, option("--u-steps", "[s:A] steps of the current", parser=steps_of_current, metavar="0:U,T:U,...")
]
Horizon = Annotated[float, quantity("--horizon", "s", "longest time of a stance")]
MaxPhases = Annotated[int, option("--max-phases", "longest chain of phases", metavar="N", min=1)]
Backend = Annotated[BackendName | None, option("--backend", "the fastest there is if left out")]
Dtype = Annotated[Precision, option("--dtype", "precision of the computation")]
Hops = Annotated[int, option("--hops", "how often it meets the ground", metavar="N", min=1)]
Samples = Annotated[int, option("--samples", "uniform times in the CSV", metavar="N", min=2)]
Json = Annotated[bool, option("--json", "print JSON (docs/json.md has its schema)")]
WithSensitivities = Annotated[
    bool, option("--sensitivities", "show what the take-off depends on, which JSON always has")
]
Toml = Annotated[bool, option("--toml", "print a TOML to start from (of hopper_c if no NAME)")]
Csv = Annotated[str | None, option("--csv", "write a table over time; - prints it", metavar="FILE|-")]
Plot = Annotated[Path | None, option("--plot", "draw it: .svg, .pdf or .png", metavar="FILE")]
Version = Annotated[bool, option("--version", "print the version and exit")]


# ---- the commands ----


@app.callback(invoke_without_command=True)
def front(context: typer.Context, version: Version = False) -> None:
    """The exact stance of a series-elastic hopper with dry friction.

    Numbers are in SI units and A, written without units. Exit code 2 means bad input.
    """
    if version:
        print(f"hopform {hopform.__version__} (back ends: {', '.join(hopform.backends())})")
        if reason := hopform.library_message():
            print(reason)
    elif context.invoked_subcommand is None:
        print(context.get_help())


@app.command()
def robots(name: OneRobot = None, json: Json = False, toml: Toml = False) -> None:
    """Show the shipped robots, or one robot with all its parameters."""
    if json and toml:
        raise hopform.HopformError("--json and --toml exclude each other")
    if toml:
        print(hopform.load_robot(name or "hopper_c").to_toml(), end="")
        return
    shown = [hopform.load_robot(each) for each in ([name] if name else hopform.ROBOTS)]
    if json:
        print(tables.to_json(tables.robots_record(shown)))
    else:
        show(tables.robots(shown, with_meaning=name is not None))


@app.command()
def equations(number: OneEquation = None, json: Json = False) -> None:
    """Show the register of the paper's equations: what is right, what is not, and where it is computed."""
    register = hopform.equations()
    shown = [equation for equation in register if number is None or str(equation.number) == number.strip("()")]
    if not shown:
        known = f"({register[0].number}) to ({register[-1].number})" if register else "none"
        raise hopform.HopformError(f"there is no equation {number}; known: {known}")
    if json:
        print(tables.to_json(tables.equations_record(shown)))
    else:
        show(tables.equations(shown) if number is None else tables.equation(shown[0]))


@app.command()
def stance(
    robot: RobotName = "hopper_c",
    height: HeightOrNone = None,
    v2: V2 = None,
    x1: X1 = 0.0,
    v1: V1 = 0.0,
    x2: X2 = None,
    u: U = 0.0,
    u_steps: Steps = None,
    horizon: Horizon = 2.0,
    max_phases: MaxPhases = 4096,
    backend: Backend = None,
    dtype: Dtype = Precision.float64,
    samples: Samples = 500,
    sensitivities: WithSensitivities = False,
    json: Json = False,
    csv: Csv = None,
    plot: Plot = None,
) -> None:
    """Solve one stance: its phases, events, ending, apex and energy ledger."""
    check_outputs(json, csv, plot)
    if u and u_steps:
        raise hopform.HopformError("give either --u or --u-steps")
    hopper = hopform.load_robot(robot)
    solved = hopform.solve_stance(
        hopper,
        v2=velocity_after_impact(hopper, height, v2),
        x1=x1,
        v1=v1,
        x2=x2,
        u=u_steps or u,
        horizon=horizon,
        max_phases=max_phases,
        backend=backend,
        dtype=np.dtype(dtype.value),
    )
    deliver(
        json=(lambda: tables.stance_record(solved, height)) if json else None,
        csv=(csv, lambda: tables.stance_csv(solved, samples)) if csv else None,
        plot=(plot, lambda: figures().plot_stance(solved)) if plot else None,
        readable=lambda: tables.stance(solved, sensitivities),
        warnings=solved.warnings,
    )


@app.command()
def hop(
    height: Height,
    robot: RobotName = "hopper_c",
    u: U = 0.0,
    hops: Hops = 8,
    horizon: Horizon = 2.0,
    backend: Backend = None,
    samples: Samples = 2000,
    json: Json = False,
    csv: Csv = None,
    plot: Plot = None,
) -> None:
    """Drop the robot and let it hop: its heights and its energy over time (the paper's Figs. 12 to 14)."""
    check_outputs(json, csv, plot)
    hopper = hopform.load_robot(robot)
    with patience(f"{hops} hops"):
        run = hopform.hop(hopper, height=height, u=u, hops=hops, horizon=horizon, backend=backend)
    warnings = dict.fromkeys(warning for each in run.hops for warning in each.stance.warnings)
    deliver(
        json=(lambda: tables.run_record(run)) if json else None,
        csv=(csv, lambda: tables.run_csv(run, samples)) if csv else None,
        plot=(plot, lambda: figures().plot_run(run)) if plot else None,
        readable=lambda: tables.run(run),
        warnings=warnings,
    )


def velocity_after_impact(robot: hopform.Robot, height: float | None, v2: float | None) -> float:
    """The one of the two that is given, as a velocity [m/s]."""
    if v2 is not None and height is None:
        return v2
    if height is not None and v2 is None:
        return hopform.touchdown_velocity(robot, height)
    raise hopform.HopformError("give either --height or --v2")


# ---- what becomes of an answer ----


def figures() -> ModuleType:
    """`hopform.plots`, which needs the extra `plot`."""
    from hopform import plots

    return plots


def check_outputs(json: bool, csv: str | None, plot: Path | None) -> None:
    """Refuse, before anything is computed, what could not be printed or written afterwards."""
    if json and csv == "-":
        raise hopform.HopformError("--json and --csv - both print; give --csv a file")
    files = [Path(csv)] if csv and csv != "-" else []
    if plot is not None:
        figures().check_suffix(plot)
        files.append(plot)
    for path in files:
        if path.is_dir():
            raise hopform.HopformError(f"{path} cannot be written: it is a folder")
        if not path.parent.is_dir():
            raise hopform.HopformError(f"{path} cannot be written: there is no folder {path.parent}")
    if len({path.resolve() for path in files}) < len(files):
        raise hopform.HopformError("--csv and --plot name the same file")


def deliver(
    *,
    json: Callable[[], tables.Record] | None,
    csv: tuple[str, Callable[[], str]] | None,
    plot: tuple[Path, Callable[[], "Figure"]] | None,
    readable: Callable[[], Iterable[RenderableType]],
    warnings: Iterable[str],
) -> None:
    """Make everything that was asked for; only then write the files, then print."""
    printed, shown, files = "", list[RenderableType](), list[tuple[Path, bytes]]()
    with patience("writing"):
        if csv is not None and csv[0] != "-":
            files.append((Path(csv[0]), csv[1]().encode()))
        elif csv is not None:
            printed = csv[1]()
        if plot is not None:
            files.append((plot[0], figures().render(plot[1](), plot[0].suffix)))
        if json is not None:
            printed = tables.to_json(json()) + "\n"
        if not printed:
            shown = [*readable(), *(f"wrote {path}" for path, _ in files)]
    for path, content in files:
        write(path, content)
    for warning in warnings:
        print(f"hopform: warning: {warning}", file=sys.stderr)
    print(printed, end="")
    show(shown)


def write(path: Path, content: bytes) -> None:
    """Write aside and rename, so that a file is there in whole or not at all; a device is written as it is."""
    target = path.resolve()
    aside = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        if target.exists() and not target.is_file():
            target.write_bytes(content)
        else:
            aside.write_bytes(content)
            os.replace(aside, target)
    except OSError as error:
        raise hopform.HopformError(f"{path} cannot be written: {error.strerror}") from None
    finally:
        aside.unlink(missing_ok=True)


def show(parts: Iterable[RenderableType]) -> None:
    """Print tables: as wide as the terminal, or unbroken and without colour into a pipe."""
    console = Console(markup=False, emoji=False, highlight=False)
    if not console.is_terminal:
        console.width = UNBROKEN
    for part in parts:
        console.print(part)


@contextmanager
def patience(what: str) -> Generator[None, None, None]:
    """A moving bar on the error stream if this takes longer than `PATIENCE` and a person is there to see it."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    bar.add_task(what, total=None)
    timer = threading.Timer(PATIENCE, bar.start)
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        bar.stop()


cli_export.add_to(app)

if __name__ == "__main__":
    sys.exit(main())
