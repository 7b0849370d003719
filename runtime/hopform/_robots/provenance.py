"""Where a robot's numbers come from: a fit with its covariance, a known value, or another robot.

The table `[fit]` of a robot's TOML holds it; `Robot.sample` draws robots from it.
"""

import json
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from hopform._errors import HopformError
from hopform._solver.package import ROBOT_FIELDS

_FIELDS = {field.name for field in ROBOT_FIELDS}


class Provenance(NamedTuple):
    """Fitted fields with values, ends of their 95 % intervals and covariance, all in SI units; which fields were known;
    the robot that gave the rest; whether the residuals were white.
    """

    names: tuple[str, ...]
    values: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    covariance: tuple[tuple[float, ...], ...]
    known: tuple[str, ...]
    base: str
    white: bool

    def of(self, name: str, value: float) -> str:
        """Where the value of a field comes from; a fitted one only as long as it is that of the fit."""
        if name in self.names:
            at = self.names.index(name)
            if self.values[at] == value:
                return f"fitted, 95 % {self.low[at]:.6g} .. {self.high[at]:.6g}"
            return f"changed after the fit, which gave {self.values[at]:.6g}"
        return "known" if name in self.known else f"from {self.base}, NOT IDENTIFIED"

    def draw(self, count: int, seed: int | None) -> list[dict[str, float]]:
        """Values of the fitted fields, drawn from their joint distribution: normal; of logarithms for what is positive;
        friction below 0 counts as 0.
        """
        domains = {field.name: field.domain for field in ROBOT_FIELDS}
        values = np.array(self.values)
        log = np.array([domains[name] == "positive" for name in self.names], dtype=bool)
        slopes = np.where(log, values, 1.0)
        middle = np.where(log, np.log(np.where(log, values, 1.0)), values)
        covariance = np.array(self.covariance).reshape(values.size, values.size) / np.outer(slopes, slopes)
        rng = np.random.default_rng(seed)
        drawn = rng.multivariate_normal(middle, covariance, count, method="eigh")
        lowest = np.array([0.0 if domains[name] in ("nonnegative", "fraction") else -math.inf for name in self.names])
        drawn = np.maximum(np.where(log, np.exp(np.where(log, drawn, 0.0)), drawn), lowest)
        return [dict(zip(self.names, row, strict=True)) for row in drawn.tolist()]

    def to_toml(self) -> str:
        """The table `[fit]`."""
        lines = ["[fit]", "# 95 % intervals and covariance of what was fitted, in the units above"]
        for name, value in self._asdict().items():
            if name == "covariance":
                rows = ",\n".join(f"  {list(row)!r}" for row in self.covariance)
                lines.append(f"{name} = [\n{rows},\n]")
            else:
                lines.append(f"{name} = {_toml(value)}")
        return "\n".join(lines) + "\n"


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        each: tuple[Any, ...] = value  # pyright: ignore[reportUnknownVariableType]
        return f"[{', '.join(map(_toml, each))}]"
    return toml_string(value) if isinstance(value, str) else repr(value)


def toml_string(text: str) -> str:
    """A text as a basic string of TOML, which has JSON's escapes, and one for U+007F."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", r"\u007f")


def provenance_from(table: Mapping[str, Any], where: str) -> Provenance:
    """The provenance in a table `[fit]`; HopformError for one that is none."""
    if set(table) != set(Provenance._fields):
        raise HopformError(f"[fit] must have {', '.join(Provenance._fields)}, got {', '.join(table)} {where}")
    names = tuple(map(str, np.ravel(table["names"]).tolist()))
    if not set(names) <= _FIELDS:
        raise HopformError(f"[fit] names must be parameters of the robot, got {', '.join(names)} {where}")
    count = len(names)
    try:
        values, low, high, covariance = (
            np.array(table[name], dtype=float) for name in ("values", "low", "high", "covariance")
        )
    except (TypeError, ValueError):
        raise HopformError(f"[fit] values, low, high and covariance must be numbers {where}") from None
    for name, each in (("values", values), ("low", low), ("high", high)):
        if each.shape != (count,):
            raise HopformError(f"[fit] {name} must have the shape {(count,)}, got {each.shape} {where}")
    if covariance.shape != (count, count) and covariance.size + count > 0:
        raise HopformError(f"[fit] covariance must have the shape {(count, count)}, got {covariance.shape} {where}")
    if not (np.isfinite(values).all() and np.isfinite(covariance).all()):
        raise HopformError(f"[fit] values and covariance must be finite {where}")
    return Provenance(
        names, tuple(values.tolist()), tuple(low.tolist()), tuple(high.tolist()),
        tuple(tuple(row) for row in covariance.reshape(count, count).tolist()), tuple(map(str, table["known"])),
        str(table["base"]), bool(table["white"]),
    )  # fmt: skip
