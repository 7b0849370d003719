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
        "name": typer.Argument(metavar="[NAME|FILE.toml]", help="one robot; all if left out"),
        "number": typer.Argument(metavar="[N|CLAIM]", help="an equation's number, or with --claims a claim; all if left out"),
        **{
            f"model {name}.model": typer.Argument(metavar="FILE.py|NAME", help="a model file, which is run; or one that ships")
            for name in ("check", "build", "prove", "show")
        },
        "formula": typer.Argument(metavar="[FORMULA]", help="a name, a group, a number of the paper; all if left out"),
        "export.folder": typer.Argument(metavar="DIR", help="new or empty; it becomes the package's root"),
        "reference write.folder": typer.Argument(metavar="DIR", help="new or empty; it is made"),
        "function": typer.Argument(metavar="MODULE:FUNCTION", help="a simulator, which is run; the module may be in this directory"),
    },
    "Robot and start": {
        "robot": option("a TOML file, or one of `hopform robots`; the first of these if left out", metavar="NAME|FILE.toml"),
        "values": option("another value of a parameter, in SI units; repeatable", metavar="NAME=VALUE"),
        "export.robot": option("write it as robot.h, and a program for a board", metavar="NAME|FILE.toml"),
        "height": option("hop height of the drop; or give --v2", unit="m"),
        "v2": option("velocity of the body after the impact, < 0 downwards", unit="m/s"),
        "x1": option("displacement of the actuator at touchdown", unit="m"),
        "v1": option("its velocity", unit="m/s"),
        "x2": option("height of the body; from zero contact force if left out", unit="m"),
        "compression": option("of the leg, in place of --x2: as a flight has left it", unit="m"),
        "start": option("a coordinate or velocity of the model at the start, 0 if left out; repeatable",
                        metavar="NAME=VALUE"),
    },
    "Input": {
        "motion.u": option(f"{use.INPUT}; constant", unit=OF_MODEL, need="input"),
        "motion.u_steps": option(f"{use.INPUT}; in steps, times in s", unit=OF_MODEL, steps=True, need="input"),
    },
    "Current": {
        "u": option("current, constant over each stance", unit="A"),
        "u_steps": option("steps of the current", unit="A", steps=True),
        "control.h_des": option("desired hop height of the next apex", unit="m"),
        "datum": option("level that heights count from, less the ground under the foot", unit="m"),
        "stop_margin": option("x1 stays below x1_max by more than this", unit="m"),
        "printed": option("compare with (26), (27) as printed, on a grid of 0.01 A"),
    },
    "Map": {
        "lowest": option("lowest hop height of the map", unit="m"),
        "highest": option("highest hop height of the map", unit="m"),
        "heights": option("hop heights of the map", least=2, most=MOST_CELLS // 2),
        "currents": option("currents of the map, over all that is allowed", least=1, most=MOST_CELLS // 2),
    },
    "Uncertainty of a fit": {
        "from_fit": option("in place of --robot: an identified robot, and 95 % bands from its fit",
                           metavar="FILE.toml"),
        "draws": option("robots that are drawn for --from-fit", least=2, most=MOST_DRAWS),
        "seed": option("of these draws", least=0, most=math.inf),
    },
    "Solver": {
        "horizon": option("longest time of a stance", unit="s"),
        "motion.horizon": option("longest time", unit="s"),
        "max_phases": option("longest chain of phases", least=1),
        "dtype": option("precision of the computation"),
    },
    "Output": {
        "samples": option("uniform times in the CSV", least=2, most=MOST_ROWS),
        "sensitivities": option("show what the ending depends on, which JSON always has"),
        "explain": option("show how it was solved: poles, event functions, rules of the certificate"),
        "json": option("print JSON (its schema: schema.json of the package)"),
        "toml": option("print a TOML to start from (of the first if no NAME)"),
        "c": option("print a struct for the C library (of the first if no NAME)", metavar="float32|float64"),
        "csv": option("write a table over time; - prints it", metavar="FILE|-"),
        "plot": option("draw it: .svg, .pdf or .png", metavar="FILE"),
        "export.json": option("list the files as JSON"),
        "model list.json": option("as JSON"),
        "selftest.json": option("as JSON"),
        "reference write.json": option("list the files as JSON"),
        "form": option("how formulas are spelled"),
        "claims": option("the paper's claims in place of its equations"),
        "model build.out": option("where the solver goes: an empty folder, or one that this made", metavar="DIR"),
        "model show.f32": option("C in single precision"),
        "model show.mode": option("what friction or a stop holds, as `model check` lists it", metavar="HELD"),
        "whole": option("in parameters, inputs, start and time alone, long parts defined before they are read"),
    },
    "Options": {
        "system": option(f"{', '.join(SYSTEMS)}, fmu", metavar="SYSTEM"),
        "inputs": option("with --for fmu, a parameter that is an input of the FMU; repeatable", metavar="NAME"),
        "binaries": option(f"with --for fmu, a platform to compile for, by zig if it is another one: {', '.join(BINARIES)}; "
                           "this machine if left out; repeatable", metavar="PLATFORM"),
        "case": option("score this one alone; repeatable", metavar="NAME"),
        "prefix": option("of every public name", metavar="NAME"),
        "f32": option("single precision alone"),
        "f64": option("double precision alone"),
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
