"""Terrain: a height of the ground per hop [m]; the first is under the first touchdown, each next one from a take-off
on.

Every function returns a tuple of heights that `simulate` takes. The same seed gives the same ground.
"""

import csv
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, SupportsFloat

from hopform._checks import drawing, finite, is_number, shown, whole
from hopform._errors import HopformError

Heights = tuple[float, ...]
NAMES = ("flat", "steps", "uniform", "gaussian")
"""Kinds of terrain that `generate` knows."""
COLUMN = "height"
"""The column of a CSV that holds the heights."""


def flat(hops: int, height: SupportsFloat = 0.0) -> Heights:
    """Even ground at a height [m].

    >>> flat(3)
    (0.0, 0.0, 0.0)
    """
    return (finite("height", height, "m"),) * whole("hops", hops)


def steps(hops: int, size: SupportsFloat, length: int = 3) -> Heights:
    """Steps of a size [m], up and down again, each `length` hops long; the first is at 0.

    >>> steps(5, 0.02, length=2)
    (0.0, 0.0, 0.02, 0.02, 0.0)
    """
    rise, each = finite("size", size, "m"), whole("length", length)
    return tuple(rise if (hop // each) % 2 else 0.0 for hop in range(whole("hops", hops)))


def uniform(hops: int, size: SupportsFloat, seed: int = 0) -> Heights:
    """Independent heights, uniform within -size .. size [m].

    >>> uniform(1000, 0.02, seed=1) == uniform(1000, 0.02, seed=1) != uniform(1000, 0.02, seed=2)
    True
    """
    half = _size(size)
    finite("2 size", 2.0 * half, "m")
    return tuple(drawing(seed).uniform(-half, half, whole("hops", hops)).tolist())


def gaussian(hops: int, size: SupportsFloat, seed: int = 0) -> Heights:
    """Independent heights, normal about 0 with standard deviation `size` [m].

    >>> len(gaussian(10, 0.01, seed=3))
    10
    """
    return tuple((_size(size) * drawing(seed).standard_normal(whole("hops", hops))).tolist())


def generate(name: str, hops: int, size: SupportsFloat = 0.0, seed: int = 0) -> Heights:
    """The terrain of a name in `NAMES`; `size` [m] is the step, the half width or the standard deviation, unused if
    flat.

    >>> generate("steps", 4, 0.01)
    (0.0, 0.0, 0.0, 0.01)
    """
    if name == "flat":
        return flat(hops)
    if name == "steps":
        return steps(hops, size)
    if name == "uniform":
        return uniform(hops, size, seed)
    if name == "gaussian":
        return gaussian(hops, size, seed)
    raise HopformError(f"terrain must be one of {', '.join(NAMES)}, or a CSV file, got {name!r}")


def read(path: str | Path) -> Heights:
    """The terrain of a CSV file: a height [m] per line, or the column `height` of a table with a head.

    Raises HopformError that names file, line and column of what is no finite number, and if there is no height at all.
    """
    try:
        text = Path(path).read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise HopformError(f"{path} cannot be read: {error}") from None
    try:
        lines = list(enumerate(csv.reader(text.splitlines()), 1))
    except csv.Error as error:
        raise HopformError(f"{path} is no CSV: {error}") from None
    rows = [(number, row) for number, row in lines if any(map(str.strip, row))]
    column, title = 0, "1"
    if rows and not is_number(rows[0][1][0]):
        head = [name.strip() for name in rows[0][1]]
        if COLUMN not in head:
            raise HopformError(f"{path}, line {rows[0][0]}: there is no column {COLUMN!r}, only {', '.join(head)}")
        column, title, rows = head.index(COLUMN), repr(COLUMN), rows[1:]
    elif rows and len(rows[0][1]) > 1:
        raise HopformError(f"{path}, line {rows[0][0]}: several columns need a head, one of them named {COLUMN!r}")
    if not rows:
        raise HopformError(f"{path} holds no height")
    return tuple(_height(row, column, f"{path}, line {number}, column {title}") for number, row in rows)


def heights_of(terrain: Iterable[Any]) -> Heights:
    """The heights of a terrain as floats; HopformError if there is none, or one is not finite."""
    if isinstance(terrain, (str, bytes)) or not isinstance(terrain, Iterable):
        raise HopformError(f"terrain must be a sequence of heights in m, got {shown(terrain)}")
    dimensions = getattr(terrain, "ndim", 1)
    if dimensions != 1:
        raise HopformError(f"terrain must be of one dimension, got {dimensions}")
    heights = tuple(finite(f"terrain[{number}]", height, "m") for number, height in enumerate(terrain))
    if not heights:
        raise HopformError("terrain must have at least one height, under the first touchdown, got none")
    return heights


def _height(row: list[str], column: int, where: str) -> float:
    text = row[column].strip() if column < len(row) else ""
    if not is_number(text) or not math.isfinite(float(text)):
        raise HopformError(f"{where}: a height must be a finite number in m, got {text!r}")
    return float(text)


def _size(size: SupportsFloat) -> float:
    value = finite("size", size, "m")
    if value < 0.0:
        raise HopformError(f"size must be >= 0 m, got {value!r}")
    return value
