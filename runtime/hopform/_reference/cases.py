"""The cases of the reference set, as their files in `data` say them; README.md is the format."""

from __future__ import annotations

import json
from bisect import bisect_right
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from hopform._checks import finite, items, shown
from hopform._errors import HopformError
from hopform._reference import formats
from hopform._robots import nearest

Floats = NDArray[np.float64]
DATA = Path(__file__).resolve().parent / "data"
ORDER = (
    "spin-down", "hold", "slow-sine", "stick-slip", "stops", "servo", "breakaway", "sea", "drop", "take-off", "hop",
)  # fmt: skip
"""The cases, from one joint to a hop."""


@dataclass(frozen=True)
class Gradient:
    """The derivative of a value by a parameter, a start or the input, all its steps alike. step: that of the
    differences by which a simulator is asked for it, to either side.
    """

    of: str
    by: str
    step: float
    value: float


@dataclass(frozen=True)
class Held:
    """Two instants between which a coordinate stands still, exactly [s]."""

    of: str
    begin: float
    end: float


@dataclass(frozen=True, eq=False)
class Answer:
    """What a case does, exactly: states by their names at its times, events (time, kind), the ending, when what stands
    still, values by name with their units, derivatives.
    """

    states: Mapping[str, Floats]
    events: tuple[tuple[float, str], ...]
    ending: str
    held: tuple[Held, ...]
    values: Mapping[str, float]
    units: Mapping[str, str]
    gradients: tuple[Gradient, ...]


@dataclass(frozen=True, eq=False)
class Case:
    """A case of the reference set, in SI units: what a simulator is handed.

    parameters, start: numbers by their names. input: the name of what drives it; steps: (time, value), each until the
    next. times: the instants of the answer [s]. outputs: the names of positions, each followed by its velocity; units:
    of all numbers, by name. family: cases of one family have one set of equations. answer: the exact answer, None in a
    case that was changed.
    """

    name: str
    title: str
    description: str
    family: str
    equations: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: Mapping[str, float]
    start: Mapping[str, float]
    input: str
    steps: tuple[tuple[float, float], ...]
    times: Floats = field(repr=False)
    units: Mapping[str, str] = field(repr=False)
    meanings: Mapping[str, str] = field(repr=False)
    margin: float
    without: Mapping[str, str] = field(repr=False)
    answer: Answer | None = field(repr=False)

    def __reduce__(self) -> Any:
        if self.answer is not None:
            return case_named, (self.name,)
        of = (getattr(self, each.name) for each in fields(self))
        return Case, tuple(dict(cast(Any, value)) if isinstance(value, Mapping) else value for value in of)

    @property
    def positions(self) -> tuple[str, ...]:
        """The outputs that are positions."""
        return self.outputs[::2]

    @property
    def velocities(self) -> tuple[str, ...]:
        """Their velocities."""
        return self.outputs[1::2]

    @property
    def numbers(self) -> dict[str, float]:
        """Parameters and start by name."""
        return {**self.parameters, **self.start}

    @property
    def values(self) -> tuple[str, ...]:
        """The names of the values that the answer has beside states and events."""
        return tuple(case_named(self.name).exact.values)

    @property
    def exact(self) -> Answer:
        """The answer; HopformError for a case that was changed, which has none."""
        if self.answer is None:
            raise HopformError(f"the case {self.name} was changed, and has no answer")
        return self.answer

    def u(self, t: float) -> float:
        """The input at a time, from a step on its new value.

        >>> case_named("stops").u(0.4)
        0.4
        """
        times = [time for time, _ in self.steps]
        return self.steps[max(bisect_right(times, t) - 1, 0)][1]

    def changed(self, **numbers: float) -> Case:
        """The case with other parameters or starts; the input's name is a number that is added to all its steps.

        Raises HopformError for a name that it does not have, and for what is no finite number.

        >>> case_named("hold").changed(F=2.0).parameters["F"]
        2.0
        """
        known = [*self.parameters, *self.start, self.input]
        for name in numbers:
            if name not in known:
                raise HopformError(f"the case {self.name} has no {shown(name)}{nearest(name, known)}")
        new = {name: finite(name, value, self.units[name]) for name, value in numbers.items()}
        added = new.get(self.input, 0.0)
        return replace(
            self,
            parameters={name: new.get(name, value) for name, value in self.parameters.items()},
            start={name: new.get(name, value) for name, value in self.start.items()},
            steps=tuple((t, u + added) for t, u in self.steps),
            answer=None,
        )

    def mjcf(self) -> str:
        """The case as a model of MuJoCo, with its present numbers; HopformError where MJCF cannot say it.

        >>> case_named("breakaway").mjcf()
        Traceback (most recent call last):
        hopform._errors.HopformError: breakaway: frictionloss of MJCF is one level, at rest as in motion
        """
        return self._as("mjcf", formats.mjcf)

    def urdf(self) -> str:
        """The case as a robot in URDF, with its present numbers; HopformError where URDF cannot say it."""
        return self._as("urdf", formats.urdf)

    def _as(self, name: str, write: Any) -> str:
        if self.without[name]:
            raise HopformError(f"{self.name}: {self.without[name]}")
        return str(write(self.name, self.family, self.parameters, self.start))


def read(name: str) -> Case:
    """A case from its file."""
    of = json.loads((DATA / f"{name}.json").read_text("utf-8"))
    stated = {**of["parameters"], **of["start"]}
    outputs = [each for table in of["coordinates"] for each in (table["name"], table["velocity"])]
    units = {name: table["unit"] for name, table in stated.items()} | {of["input"]["name"]: of["input"]["unit"]}
    meanings = {name: table["meaning"] for name, table in stated.items()}
    return Case(
        of["name"], of["title"], of["description"], of["family"], tuple(of["equations"]), tuple(outputs),
        _numbers(of["parameters"]), _numbers(of["start"]), of["input"]["name"],
        tuple((t, u) for t, u in of["input"]["steps"]), frozen(of["times"]), MappingProxyType(units),
        MappingProxyType(meanings | {of["input"]["name"]: of["input"]["meaning"]}), of["margin"],
        {format: of[format] or "" for format in ("mjcf", "urdf")}, _answer(of["answer"]),
    )  # fmt: skip


def _numbers(tables: Mapping[str, Mapping[str, Any]]) -> Mapping[str, float]:
    return MappingProxyType({name: float(table["value"]) for name, table in tables.items()})


def _answer(of: Mapping[str, Any]) -> Answer:
    values = of["values"]
    return Answer(
        MappingProxyType({name: frozen(column) for name, column in of["states"].items()}),
        tuple((each["time"], each["kind"]) for each in of["events"]),
        of["ending"],
        tuple(Held(each["of"], each["from"], each["to"]) for each in of["rests"]),
        MappingProxyType({name: float(each["value"]) for name, each in values.items()}),
        MappingProxyType({name: each["unit"] for name, each in values.items()}),
        tuple(Gradient(**each) for each in of["gradients"]),
    )


def frozen(numbers: Any) -> Floats:
    """An array that nobody changes."""
    made = np.array(numbers, float)
    made.flags.writeable = False
    return made


@cache
def every_case() -> tuple[Case, ...]:
    """All cases, from one joint to a hop."""
    return tuple(map(read, ORDER))


def case_named(name: object) -> Case:
    """The case of a name; HopformError for any other."""
    for each in every_case():
        if isinstance(name, str) and each.name == name:
            return each
    hint = nearest(name, list(ORDER)) if isinstance(name, str) else ""
    raise HopformError(f"there is no case {shown(name)}{hint}; known: {', '.join(ORDER)}")


def cases(names: str | Iterable[str] | None = None) -> tuple[Case, ...]:
    """The cases of the reference set: all, from one joint to a hop, or those of a name or of several.

    Raises HopformError for a name of no case.

    >>> [case.name for case in cases()][:3]
    ['spin-down', 'hold', 'slow-sine']
    >>> (case,) = cases("spin-down")
    >>> case.parameters["F"], case.answer.ending, round(case.answer.values["time_to_rest"], 6)
    (0.042, 'rest', 4.384441)
    """
    if names is None:
        return every_case()
    chosen = [names] if isinstance(names, str) else items("names", names, "names of cases", len(ORDER))
    return tuple(map(case_named, dict.fromkeys(chosen)))
