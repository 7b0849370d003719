"""Terrain: a height of the ground per hop [m]; the first is under the first touchdown, each next one from a take-off
on.

Every function returns a tuple of heights that `simulate` takes. The same seed gives the same ground.
"""

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any, SupportsFloat

from hopform import HopformError
from hopform.extend import finite, items, read_rows, shown, stream, whole
from hopform.hopping._roles import Role

Heights = tuple[float, ...]
NAMES = ("flat", "steps", "uniform", "gaussian")
"""Kinds of terrain that `generate` knows."""
MOST_HEIGHTS = 2**25
"""Heights of a terrain that is made, each of which takes 64 B."""
MOST_HOPS = 2**16
"""Hops of a run at most: flight and stance of each take up to 32 kB."""
COLUMN = "height"
"""The column of a CSV that holds the heights."""


def flat(hops: int, height: SupportsFloat = 0.0) -> Heights:
    """Even ground at a height [m].

    >>> flat(3)
    (0.0, 0.0, 0.0)
    """
    return (finite("height", height, "m"),) * whole("hops", hops, most=MOST_HEIGHTS)


def steps(hops: int, size: SupportsFloat, length: int = 3) -> Heights:
    """Steps of a size [m], up and down again, each `length` hops long; the first is at 0.

    >>> steps(5, 0.02, length=2)
    (0.0, 0.0, 0.02, 0.02, 0.0)
    """
    rise, spacing = finite("size", size, "m"), whole("length", length)
    return tuple(rise if (hop // spacing) % 2 else 0.0 for hop in range(whole("hops", hops, most=MOST_HEIGHTS)))


def uniform(hops: int, size: SupportsFloat, seed: int = 0) -> Heights:
    """Independent heights, uniform within -size .. size [m].

    >>> uniform(1000, 0.02, seed=1) == uniform(1000, 0.02, seed=1) != uniform(1000, 0.02, seed=2)
    True
    """
    half = finite("size", size, "m", 0.0)
    finite("2 size", 2.0 * half, "m")
    drawn = stream(Role.UNIFORM_TERRAIN, seed).uniform(-half, half, whole("hops", hops, most=MOST_HEIGHTS))
    return tuple(drawn.tolist())


def gaussian(hops: int, size: SupportsFloat, seed: int = 0) -> Heights:
    """Independent heights, normal about 0 with standard deviation `size` [m].

    >>> len(gaussian(10, 0.01, seed=3))
    10
    """
    deviation = finite("size", size, "m", 0.0)
    finite("10 size", 10.0 * deviation, "m")
    drawn = stream(Role.GAUSSIAN_TERRAIN, seed).standard_normal(whole("hops", hops, most=MOST_HEIGHTS))
    return tuple((deviation * drawn).tolist())


def generate(name: str, hops: int, size: SupportsFloat = 0.0, seed: int = 0) -> Heights:
    """The terrain of a name in `NAMES`; `size` [m] is the step, the half width or the standard deviation, unused if
    flat.

    >>> generate("steps", 4, 0.01)
    (0.0, 0.0, 0.0, 0.01)
    """
    if not isinstance(name, str) or name not in NAMES:
        raise HopformError(f"terrain must be one of {', '.join(NAMES)}, got {shown(name)}")
    if name in ("uniform", "gaussian"):
        return (uniform if name == "uniform" else gaussian)(hops, size, seed)
    return flat(hops) if name == "flat" else steps(hops, size)


def read(path: str | Path) -> Heights:
    """The terrain of a CSV file: a height [m] per line, or the column `height` of a table with a head.

    Raises HopformError that names file, line and column of what is no finite number, and if there is no height at all.
    """
    source, rows = read_rows(path)
    column, title = 0, "1"
    if rows and number_of(rows[0][1][0]) is None:
        head = [name.strip() for name in rows[0][1]]
        if COLUMN not in head:
            message = f"{source}, line {rows[0][0]}: there is no column {COLUMN!r}, only {shown(', '.join(head))[1:-1]}"
            raise HopformError(message)
        column, title, rows = head.index(COLUMN), repr(COLUMN), rows[1:]
    elif rows and len(rows[0][1]) > 1:
        raise HopformError(f"{source}, line {rows[0][0]}: several columns need a head, one of them named {COLUMN!r}")
    if not rows:
        raise HopformError(f"{source} holds no height")
    return tuple(_height(row, column, f"{source}, line {number}, column {title}") for number, row in rows)


def heights_of(terrain: Iterable[Any]) -> Heights:
    """The heights of a terrain as floats; HopformError if there is none, or one is not finite."""
    given = items("terrain", terrain, "a sequence of heights in m", MOST_HOPS)
    heights = tuple(finite(f"terrain[{number}]", height, "m") for number, height in enumerate(given))
    if not heights:
        raise HopformError("terrain must have at least one height, under the first touchdown, got none")
    return heights


def _height(row: list[str], column: int, where: str) -> float:
    text = row[column].strip() if column < len(row) else ""
    height = number_of(text)
    if height is None or not math.isfinite(height):
        raise HopformError(f"{where}: a height must be a finite number in m, got {shown(text)}")
    return height


def number_of(text: str) -> float | None:
    """The number that a text writes; what other readers of a CSV do not take, 1_0 and digits of other scripts, is
    none.
    """
    try:
        return float(text) if text.isascii() and "_" not in text else None
    except ValueError:
        return None
