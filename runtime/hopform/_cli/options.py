"""Types and texts of the commands' options."""

import math
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from hopform._checks import LARGEST, MEMORY, MOST_DIGITS, number_of, shown, whole_of
from hopform._control.reach import MOST_CELLS
from hopform.terrain import MOST_HOPS

MOST_ROWS = MEMORY // 1024
"""Rows of a table over time at most: in arrays and as text each takes up to 1 kB."""


MOST_DRAWS = 100_000
"""Robots that are drawn from a fit."""


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


class Recordable(StrEnum):
    drop = "drop"
    free = "free"
    decay = "decay"
    step = "step"
    air = "air"
    ramp = "ramp"


class SimulatorFormat(StrEnum):
    mjcf = "mjcf"
    urdf = "urdf"
    isaac = "isaac"


class Identification(StrEnum):
    drop = "drop"
    free = "free"
    decay = "decay"
    step = "step"
    air = "air"
    ramp = "ramp"
    all = "all"
    check = "check"


def number_in(unit: str) -> Callable[[str], float]:
    """The parser of a number in `unit`, which is not written: a unit, NaN and infinities are refused."""

    def parse(text: str) -> float:
        value = number_of(str(text))  # defaults are parsed too
        if value is None:
            raise typer.BadParameter(f"takes a number in {unit}, written without a unit, got {shown(text)}")
        if not math.isfinite(value):
            raise typer.BadParameter(f"takes a finite number in {unit}, got {shown(text)}")
        return value

    return parse


def number_from(least: int, most: float) -> Callable[[str], int]:
    """The parser of a whole number from `least` to `most`."""

    def parse(text: str) -> int:
        value = whole_of(str(text))
        if value is None and len(str(text)) > MOST_DIGITS:
            raise typer.BadParameter(f"takes a whole number of up to {MOST_DIGITS} digits, got {shown(text)}")
        if value is None or value < least:
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
FromFit = Annotated[
    Path | None,
    option("--from-fit", "in place of --robot: an identified robot, and 95 % bands from its fit", metavar="FILE.toml"),
]
DrawCount = Annotated[int, count("--draws", 2, "robots that are drawn for --from-fit", MOST_DRAWS)]
DrawSeed = Annotated[int, count("--seed", 0, "of these draws", math.inf)]
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
Hops = Annotated[
    int | None, count("--hops", 1, "how often it meets the ground; 8, or the whole file, if left out", MOST_HOPS)
]
Terrain = Annotated[
    str, option("--terrain", "flat, steps, uniform, gaussian, or a CSV of heights", metavar="NAME|FILE")
]
Size = Annotated[float, quantity("--size", "m", "of the terrain: step, half width or standard deviation")]
Seed = Annotated[int, count("--seed", 0, "of terrain, errors and draws", math.inf)]
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
Samples = Annotated[int, count("--samples", 2, "uniform times in the CSV", MOST_ROWS)]
HDes = Annotated[float, quantity("--h-des", "m", "desired hop height of the next apex")]
Datum = Annotated[float, quantity("--datum", "m", "level that heights count from, less the ground under the foot")]
StopMargin = Annotated[float, quantity("--stop-margin", "m", "x1 stays below x1_max by more than this")]
Lowest = Annotated[float, quantity("--from", "m", "lowest hop height of the map")]
Highest = Annotated[float, quantity("--to", "m", "highest hop height of the map")]
Rows = Annotated[int, count("--heights", 2, "hop heights of the map", MOST_CELLS // 2)]
Columns = Annotated[int, count("--currents", 1, "currents of the map, over all that is allowed", MOST_CELLS // 2)]
Printed = Annotated[bool, option("--printed", "compare with (26), (27) as printed, on a grid of 0.01 A")]
Json = Annotated[bool, option("--json", "print JSON (its schema: schema.json of the package)")]
WithSensitivities = Annotated[
    bool, option("--sensitivities", "show what the take-off depends on, which JSON always has")
]
Toml = Annotated[bool, option("--toml", "print a TOML to start from (of hopper_c if no NAME)")]
RobotInC = Annotated[
    Precision | None,
    option("--c", "print a struct for the C library (of hopper_c if no NAME)", metavar="float32|float64"),
]
Csv = Annotated[str | None, option("--csv", "write a table over time; - prints it", metavar="FILE|-")]
Plot = Annotated[Path | None, option("--plot", "draw it: .svg, .pdf or .png", metavar="FILE")]
Identified = Annotated[Identification, typer.Argument(help="what the files are; check says what they could tell")]
Recordings = Annotated[
    list[str],
    typer.Argument(
        metavar="FILES", help="CSV; with `all` or `check`, each may be ROLE:FILE, drop|free|decay|step|air|ramp"
    ),
]
Known = Annotated[
    list[str] | None, option("--known", "a known parameter, in SI units; repeatable", metavar="NAME=VALUE")
]
Plan = Annotated[bool, option("--plan", "show the intervals that a fit of it would give, instead of the recording")]
Spring = Annotated[bool, option("--spring", "a ramp against the spring, the body held")]
Force = Annotated[bool, option("--force", "fit in force: no spring, recorded in closed loop")]
AddedMasses = Annotated[str, option("--added-mass", "[kg] what the body carried, one per file", metavar="M,M,...")]
FitDelay = Annotated[bool, option("--delay", "fit the delay between current and position, one per recording")]
FitGain = Annotated[bool, option("--gain", "fit the gain of each position's sensor")]
FitClock = Annotated[bool, option("--clock", "fit the speed of the recording's clock")]
FitLag = Annotated[bool, option("--lag", "fit a first-order lag of each position's sensor")]
Loss = Annotated[str, option("--loss", "linear, or against outliers soft_l1, huber, cauchy")]
TomlOut = Annotated[
    Path | None, option("--out", "write the robot as TOML; --robot gives what is not fitted", metavar="FILE")
]
Export = Annotated[
    SimulatorFormat | None,
    option("--export", "for a simulator, to --out or the standard output: armature, damping, frictionloss, gear"),
]
Report = Annotated[Path | None, option("--report", "write a report with plots: .md or .html", metavar="FILE")]
Recorded = Annotated[Recordable, typer.Argument(help="the test")]
