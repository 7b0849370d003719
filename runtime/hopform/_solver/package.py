"""The generated package that `hopform` is over; any other is a `Package` of its name."""

from importlib import import_module
from typing import Any, TypeAlias, cast

from hopform_solver import SOURCE, checked, formulas, records, touchdown
from hopform_solver.equations import EQUATIONS, Equation
from hopform_solver.records import (
    LEDGER_OF_BODY,
    LEDGER_OF_ROBOT,
    LONGEST_PREFIX,
    MOST_STEPS,
    REFUSALS,
    ROBOT_FIELDS,
    TRAVEL,
    CommandStatus,
    Contact,
    CurrentEventKind,
    Ending,
    Energy,
    EventKind,
    Field,
    FlightEnding,
    FlightLedger,
    Gains,
    Ledger,
)  # fmt: skip
from hopform_solver.robot import Robot as CheckedRobot
from hopform_solver.sensitivity import COLUMNS, ROWS

AnyEvent: TypeAlias = EventKind | CurrentEventKind | Contact
COMMANDS = cast("dict[int, CommandStatus]", records.COMMANDS)
ENDINGS = cast("dict[int, Ending]", records.ENDINGS)
EVENTS = cast("dict[int, EventKind]", records.EVENTS)
FLIGHT_ENDINGS = cast("dict[int, FlightEnding]", records.FLIGHT_ENDINGS)
FLIGHT_EVENTS = cast("dict[int, AnyEvent]", records.FLIGHT_EVENTS)

__all__ = [
    "COLUMNS", "COMMANDS", "ENDINGS", "EQUATIONS", "EVENTS", "FLIGHT_ENDINGS", "FLIGHT_EVENTS", "LEDGER_OF_BODY",
    "LEDGER_OF_ROBOT", "LONGEST_PREFIX", "MOST_STEPS", "OURS", "REFUSALS", "ROBOT_FIELDS", "ROWS", "SOURCE",
    "TRAVEL", "AnyEvent", "CheckedRobot", "CommandStatus", "Contact", "Ending", "Energy", "Equation", "Field",
    "FlightEnding", "FlightLedger", "Gains", "Ledger", "Package", "checked", "formulas", "records", "touchdown",
]  # fmt: skip


class Package:
    """A generated package: its modules are its attributes, imported when they are first used."""

    def __init__(self, name: str) -> None:
        self.name = name

    def __reduce__(self) -> Any:
        return Package, (self.name,)

    def __getattr__(self, module: str) -> Any:
        if module.startswith("__"):
            raise AttributeError(module)
        self.__dict__[module] = found = import_module(f"{self.name}.{module}")
        return found


OURS = Package("hopform_solver")
