"""The folder of a solver: where its files lie, and its facts, solver.toml, which are read before any of it is imported.

A folder is what `hopform model build --out DIR` writes, with the compiled library beside it. That of the hopper lies in
the wheel beside this package, or in a checkout in generated/.
"""

import os
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from hopform._errors import HopformError
from hopform._solver.library import LIBRARY, SUFFIX, cache_of_user

FORMAT = 3
"""Of solver.toml, and of the functions and structs of the library beside it, as they are used here."""
MADE_AGAIN = "`hopform model build FILE --out DIR` makes it again"
FACTS = "solver.toml"
LARGEST = 2**20
"""[B] the largest file of facts."""
_HOPFORM = Path(__file__).resolve().parents[1]

ACTS = {
    "motion": "motion", "stance": "stance", "flight": "flight", "hop": "hop", "command": "controller",
    "reach": "map of apexes", "identify": "identification",
}  # fmt: skip
"""What some models alone can, in words."""
STANDING = ("stance", "flight", "hop")
"""What a contact brings."""

Table = dict[str, Any]
MASSES = "12"
"""How the engine numbers the masses."""


@dataclass(frozen=True)
class Facts:
    """What is known of a solver: what derive/emit/facts.py writes, by the same names."""

    name: str
    title: str
    version: str
    layout: str
    can: tuple[str, ...]
    lacks: dict[str, str]
    coordinates: tuple[Table, ...]
    parameters: tuple[Table, ...]
    limits: tuple[Table, ...]
    elements: tuple[Table, ...]
    inputs: tuple[Table, ...]
    outputs: tuple[Table, ...]
    energies: tuple[Table, ...]
    dimensions: Table
    """Powers of the base units, and of rad, in each unit."""
    currents: tuple[Table, ...] = ()
    """What a law sets; a file has it where the model has one."""

    @cached_property
    def units(self) -> dict[str, str]:
        """Units of coordinates, parameters, inputs, currents that a law sets, and outputs by name."""
        tables = (self.coordinates, self.parameters, self.limits, self.inputs, self.currents, self.outputs)
        return {each["name"]: each["unit"] for table in tables for each in table}

    @cached_property
    def events(self) -> dict[str, str]:
        """The words for each event."""
        return {event: words for each in self.elements for event, words in each.get("events", {}).items()}

    @cached_property
    def ledger(self) -> dict[str, str]:
        """What a table calls each entry of the ledger."""
        return {entry: label for each in self.elements for entry, label in each["ledger"].items()}

    @cached_property
    def moving(self) -> tuple[Table, ...]:
        """The masses that may move, in the order of the engine's."""
        return tuple(each for each in self.elements if each["kind"] == "mass" and not each.get("fixed"))

    @cached_property
    def axes(self) -> dict[str, Table]:
        """What a state is given by: coordinates by the engine's axes x1, v1, x2, v2, of masses that may move, and y,
        where both may.
        """
        named = {each.get("axis", each["name"]): each for each in self.coordinates}
        velocities = {each["velocity"] for each in self.moving}
        moving = [n for n in MASSES if f"v{n}" in named and named[f"v{n}"]["name"] in velocities]
        axes = [f"{letter}{n}" for n in moving for letter in "xv"] + (["y"] if len(moving) == len(MASSES) else [])
        return {axis: named[axis] for axis in axes}

    @cached_property
    def offered(self) -> tuple[Table, ...]:
        """The coordinates and velocities that a start is offered by: those of the file, and of a leg that stands the
        compression, too. Of another model the stretch of the spring between two masses follows from the file's own.
        """
        return tuple(table for axis, table in self.axes.items() if axis != "y" or "stance" in self.can)

    def cannot(self, act: str) -> HopformError:
        """The error about what the model cannot do, one of ACTS, with what else the same lack rules out; of what needs a
        stance that is not listed beside it, but for the act.
        """
        why = self.lacks.get(act, "what that needs")
        same = [each for each in ACTS if each == act or self.lacks.get(each) == why]
        shown = [each for each in same if each in (*STANDING, act)] if {*STANDING} & {*same} else same
        *others, last = (ACTS[each] for each in shown)
        listed = f"{', '.join(others)} or {last}" if others else last
        has_not = f"has no {why[2:]}" if why.startswith("a ") else f"does not have {why}"
        return HopformError(f"no {listed}: the model {self.name} {has_not}")

    @cached_property
    def directions(self) -> tuple[tuple[str, str], ...]:
        """Of each mass the words for its two directions."""
        return tuple(
            (up, down) for each in self.elements if each["kind"] == "mass" for up, down in [each["directions"]]
        )


@dataclass(frozen=True)
class Folder:
    """Where the files of a solver lie: in the first of some roots that has them; and its compiled library."""

    roots: tuple[Path, ...]
    library: Path

    def path(self, name: str) -> Path:
        """A file or folder of the solver; HopformError if there is none."""
        places = [root / name for root in self.roots]
        for place in places:
            if place.exists():
                return place
        raise HopformError(f"{name} is missing: it is not {' or '.join(map(str, places))}")

    @cached_property
    def facts(self) -> Facts:
        """The facts of the solver; HopformError for a file of another format."""
        return facts_in(self.path(FACTS))


SHIPPED = Folder((_HOPFORM, _HOPFORM.parents[1] / "generated"), LIBRARY)
"""That of the hopper of the paper."""


def folder_at(path: Path) -> Folder:
    """The folder of a solver that a path names."""
    return Folder((path,), path / f"libhopform{SUFFIX}")


def facts_in(path: Path) -> Facts:
    """The facts in a file; HopformError for one that holds no facts, or facts of another format."""
    try:
        with path.open("rb") as file:
            data = tomllib.loads(file.read(LARGEST).decode())
    except (OSError, ValueError, RecursionError) as error:
        raise HopformError(f"{path} cannot be read: {error}") from None
    if data.get("format") != FORMAT:
        refusal = f"must be of format {FORMAT}, which this hopform reads, got {data.get('format')!r}"
        raise HopformError(f"{path} {refusal}; {MADE_AGAIN}")
    try:
        data.setdefault("currents", Facts.currents)
        tables = {name: _kind_of(kind)(data[name]) for name, kind in Facts.__annotations__.items()}
        facts = Facts(**tables)
        read = facts.units, facts.events, facts.directions, facts.axes
        _ = facts.ledger  # which is empty where nothing does work
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise HopformError(f"{path} holds no facts of a solver: {type(error).__name__}: {error}") from None
    if not all(read):
        raise HopformError(f"{path} holds no facts of a solver: its parameters, coordinates or events are missing")
    return facts


def _kind_of(annotation: Any) -> Any:
    return getattr(annotation, "__origin__", annotation)


def built() -> Path:
    """Where `hopform model build` keeps the solvers that it makes for this user, a folder each."""
    return cache_of_user() / "solvers"


def built_solvers() -> Iterator[tuple[Path, str]]:
    """The folders of the solvers that were built for this user, with their names, the newest last; what cannot be read
    is left out, and what begins with a dot, which is being built.
    """
    for path in sorted(built().glob(f"[!.]*/{FACTS}"), key=os.path.getmtime):
        with suppress(HopformError):
            yield path.parent, facts_in(path).name


def is_name(solver: str | Path) -> bool:
    """Whether a solver is given by its name: a text without a separator, whatever lies in the current folder."""
    return isinstance(solver, str) and not {os.sep, os.altsep} & {*solver} and not solver.endswith(".py")


def folder_of(name: str) -> Path | None:
    """The folder of the newest solver that was built under a name; None where there is none."""
    return {own: folder for folder, own in built_solvers()}.get(name)
