"""The command line: `hopform stance --robot hopper_c --height 0.2 --u 3`, and its sisters.

`tables` writes what it prints, `plots` draws. Exit codes: 0, there is an answer, whatever it is; 2, bad input, one
line on the error stream says which, and nothing was written; 1, a fault of hopform, or a pipe that was closed.
"""

import io
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
from numpy.typing import NDArray
from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

import hopform
from hopform import cli_export, figures_command, tables, tables_control
from hopform.checks import LARGEST, shown
from hopform.files import Named, check_files, write
from hopform.hopping import csv_of
from hopform.robots import file_of as robot_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UsageError: type[Exception] = typer.BadParameter.__bases__[0]
"""What typer raises for a command line that it cannot read; it has no public name in every version of typer."""

PATIENCE = 2.0
"""[s] after which a person who waits is shown that something happens."""

UNBROKEN = 240
"""Columns that a line may have where no terminal limits it."""

app = typer.Typer(
    add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)  # fmt: skip


class BackendName(StrEnum):
    c = "c"
    numpy = "numpy"


class ControllerName(StrEnum):
    constant = "constant"
    exact = "exact"
    printed = "printed"
    return_map = "return-map"


class Precision(StrEnum):
    float64 = "float64"
    float32 = "float32"


class Identification(StrEnum):
    drop = "drop"
    step = "step"
    ramp = "ramp"
    all = "all"


class Recordable(StrEnum):
    drop = "drop"
    free = "free"
    decay = "decay"
    step = "step"
    air = "air"
    ramp = "ramp"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line on `arguments` (the process's own if None) and return the exit code."""
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None and sys.stdout.errors == "strict":  # names of files may hold what no encoding does
        reconfigure(errors="backslashreplace")
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
            raise typer.BadParameter(f"takes a number in {unit}, written without a unit, got {shown(text)}") from None
        if not math.isfinite(value):
            raise typer.BadParameter(f"takes a finite number in {unit}, got {shown(text)}")
        return value

    return parse


def number_from(least: int, most: float) -> Callable[[str], int]:
    """The parser of a whole number from `least` to `most`."""

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = least - 1
        if value < least:
            raise typer.BadParameter(f"takes a whole number >= {least}, got {shown(text)}")
        if value > most:
            raise typer.BadParameter(f"takes a whole number <= {most}, got {shown(text)}")
        return value

    return parse


def steps_of_current(text: str) -> list[tuple[float, float]]:
    """Steps of the current from "t:u,t:u,..."."""
    second, ampere = number_in("s"), number_in("A")
    steps: list[tuple[float, float]] = []
    for pair in text.split(","):
        t, colon, u = pair.partition(":")
        if not colon:
            raise typer.BadParameter(f"takes steps t:u in s and A, as in 0:0,0.05:2.0, got {shown(pair)}")
        steps.append((second(t), ampere(u)))
    return steps


def gains_of_return(text: str) -> tuple[float, float]:
    """Gains of the return in flight from "Kp,Kd"."""
    parts = text.split(",")
    if len(parts) != 2:
        raise typer.BadParameter(f"takes Kp,Kd in N/m and N s/m, as in 2000,300, got {shown(text)}")
    return number_in("N/m")(parts[0]), number_in("N s/m")(parts[1])


def quantity(name: str, unit: str, meaning: str) -> Any:
    return typer.Option(name, parser=number_in(unit), metavar=unit.upper(), help=f"[{unit}] {meaning}")


def option(name: str, meaning: str, **how: Any) -> Any:
    return typer.Option(name, help=meaning, **how)


def count(name: str, least: int, meaning: str, most: float = LARGEST) -> Any:
    return option(name, meaning, parser=number_from(least, most), metavar="N")


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
MaxPhases = Annotated[int, count("--max-phases", 1, "longest chain of phases")]
Backend = Annotated[BackendName | None, option("--backend", "the fastest there is if left out")]
Dtype = Annotated[Precision, option("--dtype", "precision of the computation")]
Hops = Annotated[int | None, count("--hops", 1, "how often it meets the ground; 8, or the whole file, if left out")]
Terrain = Annotated[
    str, option("--terrain", "flat, steps, uniform, gaussian, or a CSV of heights", metavar="NAME|FILE")
]
Size = Annotated[float, quantity("--size", "m", "of the terrain: step, half width or standard deviation")]
Seed = Annotated[int, count("--seed", 0, "of terrain and errors", math.inf)]
ControllerOption = Annotated[ControllerName, option("--controller", "what chooses the current")]
HopTarget = Annotated[float | None, quantity("--h-des", "m", "hop height wanted, over the terrain's zero")]
NoiseX1 = Annotated[float, quantity("--noise-x1", "m", "standard deviation of the actuator as measured")]
NoiseV1 = Annotated[float, quantity("--noise-v1", "m/s", "of its velocity")]
NoiseX2 = Annotated[
    float, quantity("--noise-x2", "m", "of the body's height: of the apex before, and at the ticks of return-map")
]
NoiseV2 = Annotated[float, quantity("--noise-v2", "m/s", "of the body's velocity")]
NoiseGround = Annotated[float, quantity("--noise-ground", "m", "of the height of the ground")]
CurrentScale = Annotated[float, quantity("--current-scale", "1", "current that flows over current asked for")]
Quantum = Annotated[float, quantity("--quantum", "s", "touchdown is seen at the next tick of this clock")]
Delay = Annotated[float, quantity("--delay", "s", "and so much later")]
ReturnGains = Annotated[
    Any,
    option("--gains", "of the return in flight, for a pull Kp x1 + Kd v1; designed if left out",
           parser=gains_of_return, metavar="KP,KD"),
]  # fmt: skip
Model = Annotated[str | None, option("--model", "the robot the controller believes in", metavar="NAME|FILE.toml")]
HopsCsv = Annotated[Path | None, option("--hops-csv", "write a table of the hops", metavar="FILE")]
Npz = Annotated[Path | None, option("--npz", "write table and states for NumPy", metavar="FILE")]
Samples = Annotated[int, count("--samples", 2, "uniform times in the CSV")]
HDes = Annotated[float, quantity("--h-des", "m", "desired hop height of the next apex")]
Datum = Annotated[float, quantity("--datum", "m", "level that heights count from, less the ground under the foot")]
StopMargin = Annotated[float, quantity("--stop-margin", "m", "x1 stays below x1_max by more than this")]
Lowest = Annotated[float, quantity("--from", "m", "lowest hop height of the map")]
Highest = Annotated[float, quantity("--to", "m", "highest hop height of the map")]
Rows = Annotated[int, count("--heights", 2, "hop heights of the map")]
Columns = Annotated[int, count("--currents", 1, "currents of the map, over all that is allowed")]
Printed = Annotated[bool, option("--printed", "compare with (26), (27) as printed, on a grid of 0.01 A")]
Json = Annotated[bool, option("--json", "print JSON (docs/json.md has its schema)")]
WithSensitivities = Annotated[
    bool, option("--sensitivities", "show what the take-off depends on, which JSON always has")
]
Toml = Annotated[bool, option("--toml", "print a TOML to start from (of hopper_c if no NAME)")]
Csv = Annotated[str | None, option("--csv", "write a table over time; - prints it", metavar="FILE|-")]
Plot = Annotated[Path | None, option("--plot", "draw it: .svg, .pdf or .png", metavar="FILE")]
Identified = Annotated[Identification, typer.Argument(help="what the files are")]
Recordings = Annotated[
    list[str],
    typer.Argument(metavar="FILES", help="CSV; with `all`, each may be ROLE:FILE, drop|free|decay|step|air|ramp"),
]
Known = Annotated[
    list[str] | None, option("--known", "a known parameter, in SI units; repeatable", metavar="NAME=VALUE")
]
Attached = Annotated[bool, option("--attached", "the body is fixed to its spring, which pushes and pulls")]
Free = Annotated[bool, option("--free", "the actuator is free to move while the body drops")]
Air = Annotated[bool, option("--air", "the leg is in the air: no spring")]
Spring = Annotated[bool, option("--spring", "a ramp against the spring, the body held")]
Force = Annotated[bool, option("--force", "fit in force: no spring, recorded in closed loop")]
AddedMasses = Annotated[str, option("--added-mass", "[kg] what the body carried, one per file", metavar="M,M,...")]
Loss = Annotated[str, option("--loss", "linear, or against outliers soft_l1, huber, cauchy")]
TomlOut = Annotated[
    Path | None, option("--out", "write the robot as TOML; --robot gives what is not fitted", metavar="FILE")
]
Report = Annotated[Path | None, option("--report", "write a report with plots: .md or .html", metavar="FILE")]
Recorded = Annotated[Recordable, typer.Argument(help="the test")]
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
    check_outputs(json, csv, plot, reads=[("--robot", robot_file(robot))])
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
    terrain: Terrain = "flat",
    size: Size = 0.02,
    hops: Hops = None,
    seed: Seed = 0,
    controller: ControllerOption = ControllerName.constant,
    u: U = 0.0,
    h_des: HopTarget = None,
    stop_margin: StopMargin = 0.0,
    noise_x1: NoiseX1 = 0.0,
    noise_v1: NoiseV1 = 0.0,
    noise_x2: NoiseX2 = 0.0,
    noise_v2: NoiseV2 = 0.0,
    noise_ground: NoiseGround = 0.0,
    current_scale: CurrentScale = 1.0,
    quantum: Quantum = 0.0,
    delay: Delay = 0.0,
    model: Model = None,
    gains: ReturnGains = None,
    horizon: Horizon = 2.0,
    backend: Backend = None,
    samples: Samples = 2000,
    json: Json = False,
    csv: Csv = None,
    hops_csv: HopsCsv = None,
    npz: Npz = None,
    plot: Plot = None,
) -> None:
    """Drop the robot and let it hop, over rough terrain and under a controller: heights and energy over time.

    The terrain is flat, steps, uniform, gaussian (with --size and --seed) or a CSV file of heights. The controllers: constant
    (--u), exact (the energy-based feedforward), printed (the same as the paper prints it), return-map (Hopper B's first one).
    """
    check_outputs(
        json, csv, plot,
        reads=[
            ("--robot", robot_file(robot)),
            ("--model", None if model is None else robot_file(model)),
            ("--terrain", None if terrain in hopform.terrain.NAMES else terrain),
        ],
        more=[("--hops-csv", hops_csv), ("--npz", npz)],
    )  # fmt: skip
    hopper = hopform.load_robot(robot)
    ground = terrain_of(terrain, size, hops, seed)
    asked = controller_of(controller, u, h_des, stop_margin, horizon, backend)
    errors = hopform.Errors(
        noise_x1, noise_v1, noise_x2, noise_v2, noise_ground, current_scale, quantum, delay,
        None if model is None else hopform.load_robot(model),
    )  # fmt: skip
    with patience(f"{len(ground)} hops") as progress:
        run = hopform.simulate(
            hopper, ground, asked, height=height, gains=gains, errors=errors, seed=seed, horizon=horizon, backend=backend,
            progress=progress,
        )  # fmt: skip
    settings = {"height": height, "controller": controller.value, "u": u if h_des is None else None, "h_des": h_des}
    deliver(
        json=(lambda: tables.run_record(run, settings | {"seed": seed})) if json else None,
        csv=(csv, lambda: tables.run_csv(run, samples)) if csv else None,
        plot=(plot, lambda: figures().plot_run(run)) if plot else None,
        readable=lambda: tables.run(run, designed=gains is None),
        warnings=run.warnings,
        more=[
            *([(hops_csv, lambda: csv_of(run.table).encode())] if hops_csv else []),
            *([(npz, lambda: archive(run, samples))] if npz else []),
        ],
    )


@app.command()
def identify(
    kind: Identified,
    files: Recordings,
    known: Known = None,
    attached: Attached = False,
    free: Free = False,
    air: Air = False,
    spring: Spring = False,
    force: Force = False,
    added_mass: AddedMasses = "",
    loss: Loss = "linear",
    robot: RobotName = "hopper_c",
    out: TomlOut = None,
    report: Report = None,
    json: Json = False,
    plot: Plot = None,
) -> None:
    """Identify a robot from CSV recordings: drop tests, step responses, slow ramps of the current, or all together."""
    from hopform.identification import command
    from hopform.identification.report import check_suffix, paths_of

    pages: list[Named] = []
    if report is not None:
        check_suffix(report)
        figures()
        pages += zip(("--report", "the picture of --report"), paths_of(report), strict=False)
    check_outputs(
        json, plot=plot,
        reads=[("--robot", robot_file(robot)), *(("the recording", command.role_and_path(each)[1]) for each in files)],
        more=[("--out", out), *pages],
    )  # fmt: skip
    base = hopform.load_robot(robot)
    masses, values = command.added_masses(added_mass), command.known_values(known or [])
    with patience("identification") as advance:
        wanted = command.Wanted(kind.value, tuple(files), values, masses, attached, air, force, loss, free, spring)
        stages = iter(range(command.STAGES))
        answer = command.identify(wanted, lambda _: advance(next(stages, command.STAGES), command.STAGES))
        written = command.files_of(answer, base, out, report, plot)
    printed = tables.to_json({"hopform": hopform.__version__, **command.record_of(answer)}) if json else ""
    shown = [] if json else [*command.tables_of(answer), *(f"wrote {path}" for path, _ in written)]
    for path, content in written:
        write(path, content)
    for warning in answer.warnings:
        print(f"hopform: warning: {warning}", file=sys.stderr)
    if json:
        print(printed)
    show(shown)


@app.command()
def record(
    test: Recorded,
    robot: RobotName = "hopper_c",
    duration: Annotated[float, quantity("--duration", "s", "how long")] = 2.0,
    rate: Annotated[float, quantity("--rate", "Hz", "samples per second")] = 500.0,
    noise: Annotated[float, quantity("--noise", "m", "standard deviation of the position's noise")] = 2e-4,
    quantum: Annotated[float, quantity("--quantum", "m", "step of the encoder, 0 for none")] = 1.0 / 56000.0,
    height: Annotated[float, quantity("--height", "m", "hop height of a drop, pull of a decay")] = 0.2,
    current: Annotated[float | None, quantity("--current", "A", "largest current; u_max if left out")] = None,
    hold: Annotated[float, quantity("--hold", "s", "stillness at first")] = 0.2,
    added_mass: Annotated[float, quantity("--added-mass", "kg", "mass that the body carries beside its own")] = 0.0,
    repeats: Annotated[int, count("--repeats", 1, "drops or decays in the recording")] = 1,
    spring: Spring = False,
    seed: Annotated[int | None, count("--seed", 0, "of the noise", math.inf)] = None,
    csv: Csv = "-",
) -> None:
    """Make a synthetic recording of a robot, as a lab would record it, to plan experiments with."""
    from hopform.identification import record as make
    from hopform.identification import to_csv

    check_outputs(False, csv, reads=[("--robot", robot_file(robot))])
    made = make(
        hopform.load_robot(robot), test.value, duration=duration, rate=rate, noise=noise, quantum=quantum, height=height,
        current=current, hold=hold, added_mass=added_mass, repeats=repeats, spring=spring, seed=seed,
    )  # fmt: skip
    if csv is None or csv == "-":
        print(to_csv(made), end="")
    else:
        write(Path(csv), to_csv(made).encode())
        show([f"wrote {csv}"])


@app.command()
def control(
    h_des: HDes,
    robot: RobotName = "hopper_c",
    height: HeightOrNone = None,
    v2: V2 = None,
    x1: X1 = 0.0,
    v1: V1 = 0.0,
    x2: X2 = None,
    datum: Datum = 0.0,
    stop_margin: StopMargin = 0.0,
    horizon: Horizon = 2.0,
    backend: Backend = None,
    dtype: Dtype = Precision.float64,
    printed: Printed = False,
    json: Json = False,
    plot: Plot = None,
) -> None:
    """Choose the current after which the next apex is the desired one, (25)-(27)."""
    check_outputs(json, plot=plot, reads=[("--robot", robot_file(robot))])
    hopper = hopform.load_robot(robot)
    start: dict[str, Any] = {"x1": x1, "v1": v1, "v2": velocity_after_impact(hopper, height, v2), "x2": x2}
    asked: dict[str, Any] = {"h_des": h_des, "datum": datum}
    how: dict[str, Any] = {"horizon": horizon, "backend": backend}
    with patience("solving"):
        found = hopform.choose_current(
            hopper, **start, **asked, stop_margin=stop_margin, **how, dtype=np.dtype(dtype.value)
        )
        others = [
            (words, hopform.choose_current_as_printed(hopper, **start, **asked, **form, **how))
            for words, form in (tables_control.PRINTED.items() if printed else ())
        ]
    deliver(
        json=(
            lambda: tables_control.command_record(hopper, start | asked | {"stop_margin": stop_margin}, found, others)
        )
        if json
        else None,
        csv=None,
        plot=(plot, lambda: figures().plot_command(hopper, *curve(hopper, start, datum, stop_margin), h_des, found))
        if plot
        else None,
        readable=lambda: tables_control.command(hopper, h_des, found, others),
        warnings=(),
    )


@app.command()
def reach(
    robot: RobotName = "hopper_c",
    lowest: Lowest = 0.02,
    highest: Highest = 0.4,
    heights: Rows = 39,
    currents: Columns = 61,
    stop_margin: StopMargin = 0.0,
    horizon: Horizon = 2.0,
    backend: Backend = None,
    json: Json = False,
    plot: Plot = None,
) -> None:
    """Map the next apex over the current one for all currents (Figs. 5, 11): bounds, gaps, fixed points, what can be held."""
    check_outputs(json, plot=plot, reads=[("--robot", robot_file(robot))])
    hopper = hopform.load_robot(robot)
    if not lowest < highest:
        raise hopform.HopformError(f"--from must be below --to, got {lowest!r} and {highest!r} m")
    if not math.isfinite(hopper.u_max):
        raise hopform.HopformError(f"the controller needs a finite u_max, got {hopper.u_max!r} A")
    range_of_u = np.linspace(-hopper.u_max, hopper.u_max, currents if hopper.u_max > 0.0 else 1)
    with patience(f"{heights} heights") as advance:
        found = hopform.reachability(
            hopper,
            np.linspace(lowest, highest, heights),
            np.unique(range_of_u),
            stop_margin=stop_margin,
            horizon=horizon,
            backend=backend,
            progress=advance,
        )
    deliver(
        json=(lambda: tables_control.reach_record(found)) if json else None,
        csv=None,
        plot=(plot, lambda: figures().plot_reach(found)) if plot else None,
        readable=lambda: tables_control.reach(found),
        warnings=(),
    )


def curve(
    robot: hopform.Robot, start: dict[str, Any], datum: float, stop_margin: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Currents over all that is allowed, and the next apex [m], NaN where one is not admissible."""
    u = np.linspace(-robot.u_max, robot.u_max, 601)
    trials = [hopform.solve_stance(robot, **start, u=each) for each in u.tolist()]
    limit = robot.x1_max - stop_margin if robot.x1_min < robot.x1_max else math.inf
    peaks = [max(each.end.x1, *(phase.state.x1 for phase in each.phases)) for each in trials]
    apex = [each.apex if peak < limit else math.nan for each, peak in zip(trials, peaks, strict=True)]
    return u, np.array(apex) - datum


def terrain_of(name: str, size: float, hops: int | None, seed: int) -> tuple[float, ...]:
    """The heights that `hop` is asked for: as many as the file has, 8 or as said otherwise."""
    if name in hopform.terrain.NAMES:
        return hopform.terrain.generate(name, 8 if hops is None else hops, size, seed)
    if not Path(name).is_file():
        raise hopform.HopformError(
            f"there is no terrain {name!r}; known: {', '.join(hopform.terrain.NAMES)}, or a CSV file"
        )
    heights = hopform.terrain.read(name)
    if hops is not None and hops > len(heights):
        raise hopform.HopformError(f"{name} has {len(heights)} heights, too few for --hops {hops}")
    return heights[:hops]


def controller_of(
    name: ControllerName, u: float, h_des: float | None, stop_margin: float, horizon: float, backend: str | None
) -> Any:
    """The controller that `hop` is asked for; HopformError for an option that it does not have."""
    if (name is ControllerName.constant) != (h_des is None):
        raise hopform.HopformError(f"--h-des goes with every controller but constant, and each needs it: {name.value}")
    if u and name is not ControllerName.constant:
        raise hopform.HopformError(f"--u goes with the constant controller, not with {name.value}")
    if stop_margin and name is not ControllerName.exact:
        raise hopform.HopformError(f"--stop-margin goes with the exact controller, not with {name.value}")
    if h_des is None:
        return hopform.controllers.ConstantCurrent(u)
    if name is ControllerName.exact:
        return hopform.controllers.FeedForward(h_des, stop_margin, horizon, backend)
    if name is ControllerName.printed:
        return hopform.controllers.AsPrinted(h_des, horizon=horizon, backend=backend)
    return hopform.controllers.ReturnMap(h_des, horizon=horizon)


def archive(run: hopform.Run, samples: int) -> bytes:
    """The bytes of the NumPy archive of a run."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **run.arrays(samples))
    return buffer.getvalue()


def velocity_after_impact(robot: hopform.Robot, height: float | None, v2: float | None) -> float:
    """The one of the two that is given, as a velocity [m/s]."""
    if v2 is not None and height is None:
        return v2
    if height is not None and v2 is None:
        return hopform.touchdown_velocity(robot, height)
    raise hopform.HopformError("give either --height or --v2")


app.command("figures")(figures_command.figures)


# ---- what becomes of an answer ----


def figures() -> ModuleType:
    """`hopform.plots`, which needs the extra `plot`."""
    from hopform import plots

    return plots


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
        raise hopform.HopformError("--json and --csv - both print; give --csv a file")
    if plot is not None:
        figures().check_suffix(plot)
    check_files(reads, [("--csv", csv if csv and csv != "-" else None), *more, ("--plot", plot)])


def deliver(
    *,
    json: Callable[[], tables.Record] | None,
    csv: tuple[str, Callable[[], str]] | None,
    plot: tuple[Path, Callable[[], "Figure"]] | None,
    readable: Callable[[], Iterable[RenderableType]],
    warnings: Iterable[str],
    more: Iterable[tuple[Path, Callable[[], bytes]]] = (),
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
        files += [(path, content()) for path, content in more]
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


def show(parts: Iterable[RenderableType]) -> None:
    """Print tables: as wide as the terminal, or unbroken and without colour into a pipe."""
    console = Console(markup=False, emoji=False, highlight=False)
    if not console.is_terminal:
        console.width = UNBROKEN
    for part in parts:
        console.print(part)


@contextmanager
def patience(what: str) -> Generator[Callable[[int, int], None], None, None]:
    """A moving bar on the error stream if this takes longer than `PATIENCE` and a person is there to see it.

    What it gives tells the bar how much is done, of how much.
    """
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    task = bar.add_task(what, total=None)
    timer = threading.Timer(PATIENCE, bar.start)
    timer.start()
    try:
        yield lambda done, total: bar.update(task, completed=done, total=total)
    finally:
        timer.cancel()
        timer.join()
        bar.stop()


cli_export.add_to(app)
