"""The solver in use, that of `hopform --solver DIR|NAME COMMAND` or else the hopper's, and its robots.

The solver is loaded when something of it is needed: `--help` of the front loads nothing.
"""

import math
import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, cast

import hopform
from hopform import HopformError, Robot
from hopform._checks import number_of, shown
from hopform._cli.named import NAMED
from hopform._robots import nearest
from hopform._solver import choice
from hopform._solver.folder import Table

INPUT = "the input, in its unit"
"""How the help of an option calls the input of any model."""


def in_use() -> hopform.Solver:
    """The solver of this command line."""
    return hopform.load_solver(NAMED.get() or choice.DEFAULT.name)


def core() -> choice.Solver:
    """Its package, folder and facts."""
    return in_use().Robot.solver


def usual() -> str:
    """The robot of whoever names none, the first of the solver."""
    known = in_use().ROBOTS
    if not known:
        raise HopformError(f"the solver {in_use().name} comes without a robot: --robot FILE.toml gives one")
    return known[0]


def robot_in_use(name: str | Path | None, values: Sequence[str] | None, act: str = "motion") -> Robot:
    """The robot of a name or a file, the usual one for None, with other values of some parameters.

    HopformError where the model cannot do what the command is about, one of `folder.ACTS`.
    """
    if act not in in_use().can:
        raise core().cannot(act)
    return with_values(in_use().load_robot(usual() if name is None else name), values)


def with_values(robot: Robot, values: Sequence[str] | None) -> Robot:
    """The robot with the values of --set NAME=VALUE."""
    known = [field.name for field in type(robot).all_fields()]
    given = dict[str, float]()
    for pair in values or ():
        name, equals, text = pair.partition("=")
        value = number_of(text)
        if not equals or value is None or math.isnan(value):
            raise HopformError(f"--set takes NAME=VALUE in SI units, as in {known[0]}=20, got {shown(pair)}")
        if name not in known:
            close = nearest(name, known)
            raise HopformError(f"--set: the model {robot.solver.name} has no parameter {shown(name)}{close}")
        given[name] = value
    return robot.with_parameters(given)


def start_in_use(pairs: Sequence[str] | None) -> dict[str, float]:
    """What --start NAME=VALUE has, by the names of the model; HopformError for what is no such pair, and for a name that
    is given twice.
    """
    first = core().facts.offered[0]["name"]
    given = dict[str, float]()
    for pair in pairs or ():
        name, equals, text = pair.partition("=")
        value = number_of(text)
        if not equals or value is None or math.isnan(value):
            raise HopformError(f"--start takes NAME=VALUE in SI units, as in {first}=0.1, got {shown(pair)}")
        if name in given:
            raise HopformError(f"--start: {shown(name)} is given twice")
        given[name] = value
    return given


COLUMNS = "time_s,q_rad,i_A"
"""How the help of a command names the columns of a recording: those of a joint."""


def columns() -> str:
    """The same of the solver that --solver names: coordinates and input, each with its unit."""
    if NAMED.get() is None:
        return COLUMNS
    facts = core().facts
    places = [table for axis, table in facts.axes.items() if axis in ("x1", "x2")]
    return ",".join(
        ["time_s", *(f"{each['name']}_{each['unit'].replace(' ', '')}" for each in (*places, *facts.inputs))]
    )


def input_in_words() -> str:
    """The same of the solver that --solver names: its name, unit, meaning and thing."""
    if NAMED.get() is None or not (inputs := core().facts.inputs):
        return INPUT
    return ", ".join(f"{_named(each)} {_meant(each)}" for each in inputs)


def of_model(record: tuple[str, str], about: Any) -> list[tuple[str, str]]:
    """What the help has of an option, for the model of the solver that --solver names: nothing of one that needs what
    this cannot.
    """
    need = getattr(about, "need", "")
    facts = core().facts if need and NAMED.get() is not None else None
    if facts is not None and need not in (*facts.can, *(["input"] if facts.inputs else [])):
        return []
    name, words = record
    return [(name, words.replace(INPUT, input_in_words()))]


STATED = {"start", "x1", "u", "files"}
"""Parameters of commands in which coordinates and inputs have their names."""


def described(command: str, parameters: set[str]) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """What --help of a command with these parameters says of the solver that --solver names: titles of lists, their
    entries and what these are.
    """
    if NAMED.get() is None:
        return
    facts = core().facts
    if parameters & STATED:
        yield f"Coordinates of {facts.name}", [(_named(each), each["meaning"]) for each in facts.offered]
        yield "Inputs", [(_named(each), _meant(each) + _limit_of(each)) for each in facts.inputs]
        yield "Set by the law", [(_named(each), each["meaning"] + _limit_of(each)) for each in facts.currents]
    if "values" in parameters or "known" in parameters:
        by = "--fitted NAME, --known NAME=VALUE" if command == "fit" else "--set NAME=VALUE"
        yield f"Parameters, by {by}", [(_named(each), _about(each)) for each in (*facts.parameters, *facts.limits)]


def examples(command: str) -> Sequence[str]:
    """Two command lines under the names of the solver that --solver names; none where those of the hopper hold for every
    model.
    """
    if NAMED.get() is None:
        return ()
    facts, solver = core().facts, f"--solver {shlex.quote(NAMED.get() or '')}"
    place, rate, *_ = (each["name"] for each in facts.offered)
    u = " --u 1" if facts.inputs else ""
    start = f"--start {place}=0.4 --start {rate}=0.5"
    first = facts.parameters[0]
    value = f"{first['name']}={first.get('default', 1.0):g}"
    log, fitted = f"record motion {start}", f"fit log.csv --known {value}"
    if (
        facts.currents and "gains" in facts.currents[0]
    ):  # a law is fitted from its target, under gains and a rate that are known
        defaults = {each["name"]: each.get("default", 1.0) for each in facts.parameters}
        gains = " ".join(f"--known {name}={defaults[name]:g}" for name in facts.currents[0]["gains"])
        log = "record motion --chirp 0.5:0.5:4 --control-rate 500"
        fitted = f"fit log.csv --rate 500 {gains} --known {value}"
    lines = {
        "robots": ("robots", f"robots --set {value} --toml"),
        "motion": (f"motion --start {place}=0.1", f"motion --start {place}=0.1 --start {rate}=0.5{u} --json"),
        "record": (f"record motion {start} --seed 1 --csv log.csv", f"record motion {start}{u} --rate 1000 --seed 2"),
        "fit": (f"{log} --seed 1 --csv log.csv", fitted),
        "export": ("export firmware --for cmake", "export single --f32 --prefix mine"),
        "selftest": ("selftest", "selftest --json"),
        "model show": ("model show joint acc_1 --as latex", "model show joint acc_1 --as c --f32"),
    }  # fmt: skip
    of_solver = "" if command.startswith("model ") else f"{solver} "
    return tuple(f"{of_solver}{line}" for line in lines.get(command, ()))


def _limit_of(driven: Table) -> str:
    """The limit of a current; a target has none."""
    return f"; |{driven['name']}| <= {driven['limit']}" if "limit" in driven else ""


def _meant(driven: Table) -> str:
    """The meaning of an input, and what gives it."""
    element = driven.get("element")
    return f"{driven['meaning']} ({element})" if element else str(driven["meaning"])


def _named(quantity: Table) -> str:
    return f"{quantity['name']} [{quantity['unit']}]"


def _about(parameter: Table) -> str:
    """Meaning, domain and default of a parameter."""
    allowed = core().package.records.DOMAINS[parameter["domain"]].allowed
    default = cast(float | None, parameter.get("default"))
    return f"{parameter['meaning']}; {allowed}{'' if default is None else f'  [default: {default:g}]'}"
