# SPDX-License-Identifier: MIT-0
"""Records of arrays, taken apart and put together lane by lane: each branch computes its own lanes only."""

from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Lanes = NDArray[np.bool_] | NDArray[np.intp]
Record = TypeVar("Record", bound=tuple[Any, ...])


def _places(lanes: Lanes) -> NDArray[np.intp]:
    """The lanes by their numbers: a mask is gone through once, not once a field."""
    return lanes.nonzero()[0] if lanes.dtype == np.bool_ else lanes.view(np.intp)


def take(record: Record, lanes: Lanes) -> Record:
    """The record of some lanes; every field is an array of one dimension."""
    places = _places(lanes)
    return type(record)(*[field[places] for field in record])


def put(record: tuple[Any, ...], lanes: Lanes, values: Iterable[object]) -> None:
    """Write the fields of some lanes."""
    places = _places(lanes)
    for field, value in zip(record, values, strict=True):
        field[places] = value


def blank(kind: type[Record], like: Array) -> Record:
    """A record of zeros with the length and precision of an array."""
    return kind(*(np.zeros_like(like) for _ in kind._fields))  # type: ignore[attr-defined]


def choose(where: NDArray[np.bool_], first: Array | float, second: Array | float) -> Array:
    """`first` where a condition holds, `second` elsewhere; for values at hand, not for branches to compute."""
    return np.asarray(np.where(where, first, second))
