"""Where a robot's numbers come from: a fit with its covariance, a known value, or another robot.

The table `[fit]` of a robot's TOML holds it; `Robot.sample` draws robots from it.
"""

import json
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hopform._checks import array_of, flag, items, refuse_any, shown
from hopform._errors import HopformError
from hopform._solver.package import records

_FIELDS = {field.name for field in records.ROBOT_FIELDS}


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

    def draw(self, count: int, draw: "np.random.Generator") -> list[dict[str, float]]:
        """Values of the fitted fields, drawn from their joint distribution: normal; of logarithms for what is positive;
        friction below 0 counts as 0.
        """
        domains = {field.name: field.domain for field in records.ROBOT_FIELDS}
        values = np.array(self.values)
        log = np.array([domains[name] == "positive" for name in self.names], dtype=bool)
        slopes = np.where(log, values, 1.0)
        middle = np.where(log, np.log(np.where(log, values, 1.0)), values)
        covariance = np.array(self.covariance).reshape(values.size, values.size) / np.outer(slopes, slopes)
        drawn = draw.multivariate_normal(middle, covariance, count, method="eigh", check_valid="ignore")
        lowest = np.array([0.0 if domains[name] in ("nonnegative", "fraction") else -math.inf for name in self.names])
        drawn = np.maximum(np.where(log, np.exp(np.where(log, drawn, 0.0)), drawn), lowest)
        return [dict(zip(self.names, row, strict=True)) for row in drawn.tolist()]

    def to_toml(self) -> str:
        """The table `[fit]`."""
        lines = ["[fit]", "# 95 % intervals and covariance of what was fitted, in the units above"]
        for name, value in self._asdict().items():
            if name == "covariance":
                lines += [f"{name} = [", *(f"  {list(row)!r}," for row in self.covariance), "]"]
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
        raise HopformError(f"[fit] must have {', '.join(Provenance._fields)}, got {shown(list(table))} {where}")
    try:
        names, known = (_fields_in(name, table[name]) for name in ("names", "known"))
        count = len(names)
        values, covariance = _array("values", table["values"], (count,)), table["covariance"]
        rows = _array("covariance", covariance, (count, count)) if count or covariance else values.reshape(0, 0)
        _refuse_no_covariance(rows)
        low, high = (_array(name, table[name], (count,), finite=False) for name in ("low", "high"))
        if not isinstance(table["base"], str):
            raise HopformError(f"base must be a text, got {shown(table['base'])}")
        return Provenance(
            names, tuple(values.tolist()), tuple(low.tolist()), tuple(high.tolist()), tuple(map(tuple, rows.tolist())),
            known, table["base"], flag("white", table["white"]),
        )  # fmt: skip
    except HopformError as error:
        raise HopformError(f"[fit] {error} {where}") from None


def _fields_in(name: str, value: object) -> tuple[str, ...]:
    found = items(name, value, "a list of parameters of the robot", len(_FIELDS))
    if not all(isinstance(each, str) and each in _FIELDS for each in found) or len(set(found)) < len(found):
        raise HopformError(f"{name} must be parameters of the robot, each once, got {shown(found)}")
    return tuple(found)


def _refuse_no_covariance(rows: NDArray[Any]) -> None:
    spread = np.sqrt(np.maximum(np.diagonal(rows), 0.0))
    units = np.outer(spread, spread)
    correlation = np.divide(rows, units, out=np.where(rows == 0.0, 0.0, np.inf), where=units > 0.0)
    sound = np.isfinite(correlation).all() and np.allclose(correlation, correlation.T, atol=1e-6)
    if not sound or np.linalg.eigvalsh(correlation).min(initial=0.0) < -1e-6:
        raise HopformError(f"covariance must be symmetric and positive semidefinite, got {shown(rows.tolist())}")


def _array(name: str, value: object, shape: tuple[int, ...], *, finite: bool = True) -> NDArray[Any]:
    """Numbers in a shape; an end of an interval may be infinite."""
    try:
        found = np.array(value, dtype=object)
    except ValueError:
        found = np.array(None)
    if found.shape != shape:
        raise HopformError(f"{name} must be numbers of the shape {shape}, got {shown(value)}")
    made = array_of(name, found, "SI units") if found.size else found.astype(float)
    refuse_any(
        name, made, np.isfinite(made) if finite else ~np.isnan(made), lambda bad: f"must be a number, got {bad!r}"
    )
    return made.astype(float)
