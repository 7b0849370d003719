"""The solver in use, that of `hopform --solver DIR|NAME COMMAND` or else the hopper's, and its robots.

The solver is loaded when something of it is needed: `--help` of the front loads nothing.
"""

import math
from collections.abc import Iterator, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import cast

import hopform
from hopform import HopformError, Robot
from hopform._checks import number_of, shown
from hopform._robots import nearest
from hopform._solver import choice
from hopform._solver.folder import Table

NAMED: ContextVar[str | None] = ContextVar("NAMED", default=None)
"""What --solver names; None without it."""


def in_use() -> hopform.Solver:
    """The solver of this command line."""
    return hopform.load_solver(NAMED.get() or choice.DEFAULT.name)


def core() -> choice.Solver:
    """Its package, folder and facts."""
    return in_use().Robot.solver


def usual() -> str:
    """The robot of whoever names none: hopper_c where the solver has the shipped ones first, else the solver's own."""
    known = in_use().ROBOTS
    if not known:
        raise HopformError(f"the solver {in_use().name} comes without a robot: --robot FILE.toml gives one")
    return "hopper_c" if known[0] in hopform.ROBOTS else known[0]


def robot_in_use(name: str | Path | None, values: Sequence[str] | None, act: str = "motion") -> Robot:
    """The robot of a name or a file, the usual one for None, with other values of some parameters.

    HopformError where the model cannot do what the command is about, one of `choice.ACTS`.
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
    first = next(iter(core().facts.axes.values()))["name"]
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


def described(command: str) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """What --help of a command says of the solver that --solver names: titles of lists, their entries and what these
    are.
    """
    if NAMED.get() is None:
        return
    facts = core().facts
    yield f"Coordinates of {facts.name}", [(_named(each), each["meaning"]) for each in facts.coordinates]
    yield "Inputs", [(_named(each), each["meaning"] + _limit_of(each)) for each in facts.inputs]
    if facts.currents:
        yield "Set by the law", [(_named(each), each["meaning"] + _limit_of(each)) for each in facts.currents]
    parameters = [*facts.parameters, *facts.limits]
    by = "--fitted NAME, --known NAME=VALUE" if command == "fit" else "--set NAME=VALUE"
    yield f"Parameters, by {by}", [(_named(each), _about(each)) for each in parameters]


def examples(command: str) -> Sequence[str]:
    """Two command lines of `hopform motion` and `hopform fit` under the names of the solver that --solver names, none of
    others.
    """
    if NAMED.get() is None or command not in ("motion", "fit"):
        return ()
    place, rate, *_ = (each["name"] for each in core().facts.axes.values())
    solver, u = f"--solver {NAMED.get()}", " --u 1" if core().facts.inputs else ""
    if command == "fit":
        first = core().facts.parameters[0]
        known = f"--known {first['name']}={first.get('default', 1.0):g}"
        start = f"--start {place}=0.4 --start {rate}=0.5 --seed 1"
        return (f"{solver} record motion {start} --csv log.csv", f"{solver} fit log.csv {known}")
    start = f"{solver} motion --start {place}=0.1"
    return (start, f"{start} --start {rate}=0.5{u} --json")


def _limit_of(driven: Table) -> str:
    """The limit of a current; a target has none."""
    return f"; |{driven['name']}| <= {driven['limit']}" if "limit" in driven else ""


def _named(quantity: Table) -> str:
    return f"{quantity['name']} [{quantity['unit']}]"


def _about(parameter: Table) -> str:
    """Meaning, domain and default of a parameter."""
    allowed = core().package.records.DOMAINS[parameter["domain"]].allowed
    default = cast(float | None, parameter.get("default"))
    return f"{parameter['meaning']}; {allowed}{'' if default is None else f'  [default: {default:g}]'}"
