"""Types and texts of the commands' options."""

import math
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from typing import Annotated, Any, get_type_hints

import typer
from typer.core import TyperCommand

from hopform._checks import LARGEST, MEMORY, MOST_DIGITS, number_of, shown, whole_of
from hopform._cli import use
from hopform._control import MOST_CELLS
from hopform._export import SYSTEMS
from hopform._fmu import BINARIES

MOST_ROWS = MEMORY // 1024
"""Rows of a table over time at most: in arrays and as text each takes up to 1 kB."""


MOST_DRAWS = 100_000
"""Robots that are drawn from a fit."""


Precision = StrEnum("Precision", ["float64", "float32"])
Form = StrEnum("Form", ["text", "latex", "sympy", "json", "numpy", "c", "notebook"])

OF_MODEL = "the input's unit"
"""The unit of an option that is the input of any model."""
OF_POSITION = "the position's unit"
"""That of one that is a place of what moves, m or rad."""
METAVARS = {OF_MODEL: "U", OF_POSITION: "X"}


def known(unit: str) -> str:
    """The unit of an option; of the input of a model that has one its own."""
    inputs = use.core().facts.inputs if unit == OF_MODEL else ()
    return str(inputs[0]["unit"]) if inputs else unit


def number_in(unit: str) -> Callable[[str], float]:
    """The parser of a number in `unit`, which is not written: a unit, NaN and infinities are refused."""

    def parse(text: str) -> float:
        value = number_of(str(text))  # defaults are parsed too
        if value is None:
            raise typer.BadParameter(f"takes a number in {known(unit)}, written without a unit, got {shown(text)}")
        if not math.isfinite(value):
            raise typer.BadParameter(f"takes a finite number in {known(unit)}, got {shown(text)}")
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


def steps_in(unit: str) -> Callable[[str], list[tuple[float, float]]]:
    """The parser of steps "t:u,t:u,..." of an input in `unit`."""
    second, ampere = number_in("s"), number_in(unit)

    def parse(text: str) -> list[tuple[float, float]]:
        steps: list[tuple[float, float]] = []
        for pair in text.split(","):
            t, colon, u = pair.partition(":")
            if not colon:
                raise typer.BadParameter(
                    f"takes steps t:u in s and {known(unit)}, as in 0:0,0.05:2.0, got {shown(pair)}"
                )
            steps.append((second(t), ampere(u)))
        return steps

    return parse


def option(
    meaning: str,
    *,
    unit: str | None = None,
    steps: bool = False,
    least: int | None = None,
    most: float = LARGEST,
    need: str = "",
    **how: Any,
) -> Any:
    """An option of a command: a number in a unit, or steps t:u over time; a whole number from `least` to `most`; or,
    without either, what its parameter's type says. need: what a model has to be able to, else its help leaves the option
    out. `how` goes to typer.
    """
    if unit is not None:
        about = "" if unit in METAVARS else f"[s:{unit}] " if steps else f"[{unit}] "
        metavar = "0:U,T:U,..." if steps else METAVARS.get(unit, unit.upper())
        meaning = f"{about}{meaning}"
        how |= {"parser": (steps_in if steps else number_in)(unit), "metavar": metavar}
    elif least is not None:
        how |= {"parser": number_from(least, most), "metavar": "N"}
    made: Any = typer.Option(help=meaning, **how)
    made.need = need
    return made


OPTIONS: dict[str, dict[str, Any]] = {
    "Arguments": {
        "name": typer.Argument(metavar="NAME|FILE.toml", help="one robot; default: all"),
        "number": typer.Argument(metavar="N|CLAIM", help="number of an equation, or with --claims name of a claim; default: all"),
        **{
            f"model {name}.model": typer.Argument(metavar="FILE.py|NAME", help="a model file (runs its code), or the name of a model that ships")
            for name in ("check", "build", "prove", "show")
        },
        "formula": typer.Argument(metavar="FORMULA", help="name of a formula, a group, or a number of the paper; default: all"),
        "export.folder": typer.Argument(metavar="DIR", help="new or empty; it becomes the package's root"),
        "reference write.folder": typer.Argument(metavar="DIR", help="new or empty folder"),
        "function": typer.Argument(metavar="MODULE:FUNCTION", help="the simulator (runs its code); the module may be in this directory"),
    },
    "Robot and start": {
        "robot": option("a TOML file, or a name from `hopform robots`; default: its first", metavar="NAME|FILE.toml"),
        "values": option("set a parameter, in SI units; repeatable", metavar="NAME=VALUE"),
        "export.robot": option("write it as robot.h, with a program for a board; of an FMU the starts", metavar="NAME|FILE.toml"),
        "height": option("hop height from which the robot is dropped; or give --v2", unit="m"),
        "v2": option("velocity of the body after the impact, < 0 downwards", unit="m/s"),
        "x1": option("displacement of the actuator at touchdown", unit="m"),
        "v1": option("velocity of the actuator at touchdown", unit="m/s"),
        "x2": option("height of the body at touchdown; default: zero contact force", unit="m"),
        "compression": option("compression of the leg at touchdown, in place of --x2", unit="m"),
        "start": option("initial value of a coordinate or velocity; default: 0; repeatable",
                        metavar="NAME=VALUE"),
    },
    "Input": {
        "motion.u": option(f"{use.INPUT}: a constant", unit=OF_MODEL, need="input"),
        "motion.u_steps": option(f"{use.INPUT}: steps, U from time T [s] on", unit=OF_MODEL, steps=True, need="input"),
    },
    "Current": {
        "u": option("current, constant over each stance", unit="A"),
        "u_steps": option("steps of the current: U from time T on", unit="A", steps=True),
        "control.h_des": option("desired hop height of the next apex", unit="m"),
        "datum": option("level from which heights are counted, over the ground under the foot", unit="m"),
        "stop_margin": option("least distance of x1 from x1_max", unit="m"),
        "printed": option("compare with (26), (27) as the paper prints them, on a grid of 0.01 A"),
    },
    "Map": {
        "lowest": option("lowest hop height of the map", unit="m"),
        "highest": option("highest hop height of the map", unit="m"),
        "heights": option("number of hop heights", least=2, most=MOST_CELLS // 2),
        "currents": option("number of currents, from -u_max to u_max", least=1, most=MOST_CELLS // 2),
    },
    "Uncertainty of a fit": {
        "from_fit": option("an identified robot, in place of --robot; answers get 95 % bands from its fit",
                           metavar="FILE.toml"),
        "draws": option("number of robots drawn from the fit", least=2, most=MOST_DRAWS),
        "seed": option("seed of the draws", least=0, most=math.inf),
    },
    "Solver": {
        "horizon": option("time limit of a stance", unit="s"),
        "motion.horizon": option("time limit", unit="s"),
        "max_phases": option("limit of the number of phases", least=1),
        "dtype": option("precision of the computation"),
    },
    "Output": {
        "samples": option("number of uniform times in the CSV", least=2, most=MOST_ROWS),
        "sensitivities": option("show the derivatives of the ending; JSON always has them"),
        "explain": option("show how it was solved: poles, event functions, rules of the certificate"),
        "json": option("print JSON (its schema: schema.json of the package)"),
        "toml": option("print the robot as TOML, to edit (default: the first)"),
        "c": option("print the robot as a struct of C (default: the first)", metavar="float32|float64"),
        "csv": option("write a table over time; - prints it", metavar="FILE|-"),
        "plot": option("draw the result: .svg, .pdf or .png", metavar="FILE"),
        "export.json": option("list the files as JSON"),
        "model list.json": option("print JSON"),
        "selftest.json": option("print JSON"),
        "reference write.json": option("list the files as JSON"),
        "form": option("form of the formulas"),
        "claims": option("show the paper's claims in place of its equations"),
        "model build.out": option("folder of the solver: new, empty, or written by an earlier build", metavar="DIR"),
        "model show.f32": option("C in single precision"),
        "model show.mode": option("a mode, by the masses that are held, as `model check` lists them", metavar="HELD"),
        "whole": option("in parameters, inputs, start and time alone; long parts are defined first"),
    },
    "Options": {
        "system": option(f"{', '.join(SYSTEMS)}, fmu", metavar="SYSTEM"),
        "inputs": option("with --for fmu: parameter that becomes an input; repeatable", metavar="NAME"),
        "binaries": option(f"with --for fmu: platform to compile for, with zig for another one than this: "
                           f"{', '.join(BINARIES)}; repeatable", metavar="PLATFORM"),
        "case": option("score this case only; repeatable", metavar="NAME"),
        "prefix": option("prefix of every public name", metavar="NAME"),
        "f32": option("single precision only"),
        "f64": option("double precision only"),
    },
}  # fmt: skip
"""Arguments and options by what they are about; `command.option` where other commands mean something else by the name.
"""


NAMES = {
    "values": "set",
    "lowest": "from",
    "highest": "to",
    "system": "for",
    "form": "as",
    "inputs": "input",
    "binaries": "binary",
}
"""Options that are not named as the parameter."""


Options = Mapping[str, Mapping[str, Any]]


def options_beside(own: Options) -> Options:
    """The options of commands that have more than those above: their groups in their order, then the others."""
    return {group: OPTIONS.get(group, {}) | dict(own.get(group, {})) for group in (*own, *OPTIONS)}


def key_of(options: Options, command: str, parameter: str) -> tuple[str, str]:
    """Group and key of a command's parameter."""
    keys = (f"{command}.{parameter}", parameter)
    return next((group, key) for key in keys for group, several in options.items() if key in several)


def described(command: str, function: Callable[..., None], options: Options) -> Callable[..., None]:
    """A command's function, its parameters annotated with their options."""
    for parameter, kind in get_type_hints(function).items():
        if parameter != "return":
            group, key = key_of(options, command, parameter)
            about = options[group][key]
            if group != "Arguments":
                about.param_decls = (f"--{NAMES.get(parameter, parameter).replace('_', '-')}",)
            function.__annotations__[parameter] = Annotated[kind, about]
    return function


# ---- What `hopform COMMAND --help` prints: arguments, options by what they are about, and two examples ----

EXAMPLES = {
    "robots": ("robots", "robots hopper_c --toml"),
    "equations": ("equations 14 --as numpy", "equations --claims"),
    "motion": ("motion --start y=0.02", "motion --start x1=0.02 --start v2=-1.9 --u 3 --json"),
    "stance": ("stance --height 0.20 --u 3", "stance --v2 -1.9 --u-steps 0:0,0.05:2.0 --csv stance.csv"),
    "control": ("control --height 0.20 --h-des 0.20", "control --v2 -1.9 --h-des 0.15 --printed"),
    "reach": ("reach --from 0.05 --to 0.35", "reach --heights 5 --currents 4 --json"),
    "export": ("export firmware --for cmake --robot hopper_c", "export single --f32 --prefix mine"),
    "selftest": ("selftest", "selftest --json"),
    "reference list": ("reference list", "reference list --json"),
    "reference write": ("reference write friction", "reference write friction_2 --json"),
    "reference score": ("reference score hopform.reference:smoothed", "reference score hopform.reference:solve --case drop --json"),
    "model check": ("model check joint", "model check mine.py"),
    "model build": ("model build mine.py --out mine", "model build mine.py"),
    "model prove": ("model prove joint", "model prove mine.py --json"),
    "model list": ("model list", "model list --json"),
    "model show": ("model show hopper 14 --as latex", "model show hopper x2_t --mode actuator --as c --f32"),
}  # fmt: skip
"""Two command lines each; a test runs them, those of `record` before those of `identify`."""


class GroupedCommand(TyperCommand):
    """A command whose help groups its options."""

    words: str
    options: Options
    examples: Sequence[str]

    def format_help_text(self, ctx: Any, formatter: Any) -> None:
        """What it does; columns of a recording are those of the model in use."""
        self.help = (self.help or "").replace(use.COLUMNS, use.columns())
        super().format_help_text(ctx, formatter)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Arguments, then each group that the command has, then what is in none."""
        groups: dict[str, list[tuple[str, str]]] = {name: [] for name in self.options}
        named = {str(parameter.name): parameter.get_help_record(ctx) for parameter in self.get_params(ctx)}
        for parameter, record in named.items():
            if record is not None:
                group, key = ("Options", "") if parameter == "help" else key_of(self.options, self.words, parameter)
                groups[group] += use.of_model(record, self.options[group].get(key))
        for name, records in (*groups.items(), *use.described(self.words, {*named})):
            if records:
                with formatter.section(name):
                    formatter.write_dl(records)

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """The examples, each on a line of its own."""
        with formatter.section("Examples"):
            for line in use.examples(self.words) or self.examples:
                formatter.write(f"  hopform {line}\n")
