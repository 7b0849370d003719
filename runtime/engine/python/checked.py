# SPDX-License-Identifier: MIT-0
"""Numbers against their domains, and what is said of those that lie outside."""

import sys
from dataclasses import fields
from functools import cache, cached_property
from numbers import Real as Number
from typing import Any

from .formulas import excess_of, lower_stop, upper_stop
from .records import DOMAINS, ENDS, REST_MAY_LACK, ROBOT_FIELDS, Field
from .records import Robot as Parameters

_LONGEST = 60
"""Characters of a value that an error message shows."""


def inside(domain: str, value: Any, largest: float = sys.float_info.max) -> Any:
    """Whether a number, or each of an array, lies in a domain and, where infinity does not, within +-largest."""
    allowed = DOMAINS[domain]
    low = allowed.low if allowed.with_low else max(allowed.low, -largest)
    high = allowed.high if allowed.with_high else min(allowed.high, largest)
    above = value >= low if allowed.with_low or low > allowed.low else value > low
    below = value <= high if allowed.with_high or high < allowed.high else value < high
    return above & below


def shown(value: object) -> str:
    """A value as an error message shows it: its repr, of a long one both ends."""
    try:
        text = repr(value)
    except ValueError:  # it holds a whole number of more digits than Python prints
        text = f"{type(value).__name__} of too many digits to be shown"
    half = _LONGEST // 2 - 2
    return text if len(text) <= _LONGEST else f"{text[:half]}...{text[-half:]}"


def beyond(name: str, unit: str, value: object) -> str:
    """What is said of a number that no float holds."""
    return f"{name} must lie within +-{sys.float_info.max:.2g}{unit and f' {unit}'}, got {shown(value)}"


def refusal(field: Field, value: object) -> str | None:
    """Why a value is not allowed for a field, None if it is."""
    unit = "" if field.unit == "1" else field.unit
    if isinstance(value, bool) or not isinstance(value, Number):
        return f"{field.name} must be a number{unit and f' in {unit}'}, got {shown(value)}"
    try:
        number = float(value)
    except OverflowError:
        return beyond(field.name, unit, value)
    if inside(field.domain, number):
        return None
    return f"{field.name} must be {DOMAINS[field.domain].allowed}{unit and f' {unit}'}, got {number!r}"


@cache
def attributes(kind: Any) -> dict[str, str]:
    """The attributes that are the parameters of a dataclass, by their names: `name_` where `name` is something else."""
    renamed = {str(each.metadata["parameter"]): each.name for each in fields(kind) if "parameter" in each.metadata}
    return {field.name: renamed.get(field.name, field.name) for field in ROBOT_FIELDS}


class Checked:
    """What makes a dataclass of the robot's parameters one of checked floats."""

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for field, attribute in zip(ROBOT_FIELDS, attributes(kind).values(), strict=True):
            value = getattr(self, attribute)
            if (reason := refusal(field, value)) is not None:
                raise ValueError(reason)
            object.__setattr__(self, attribute, float(value))
        below, above = lower_stop(self.parameters), upper_stop(self.parameters)
        if not below <= above:
            low, high, unit = ENDS
            raise ValueError(f"{low} must be <= {high} {unit}, got {below!r} > {above!r}")
        if REST_MAY_LACK and (least := min(excess_of(self.parameters))) < 0.0:
            what = "friction at rest must not be less than that in motion"
            raise ValueError(f"{what}, over the inertia it is by {-least!r}")

    def __getitem__(self, name: str) -> float:
        """A parameter by its name, also where an attribute of this name is something else."""
        kind: Any = type(self)
        value: float = getattr(self, attributes(kind)[name])
        return value

    @cached_property
    def parameters(self) -> Parameters:
        """The fields as the record that the solver takes."""
        return Parameters(*(self[field.name] for field in ROBOT_FIELDS))
