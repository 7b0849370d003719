# SPDX-License-Identifier: MIT-0
"""Records of arrays, taken apart and put together lane by lane: each branch computes its own lanes only."""

from collections.abc import Callable, Iterable
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Flags = NDArray[np.bool_]
Numbers = NDArray[np.intp]
Lanes: TypeAlias = Flags | Numbers
Record = TypeVar("Record")


def _places(lanes: Lanes) -> Numbers:
    """The lanes by their numbers: a mask is gone through once, not once a field."""
    return lanes.nonzero()[0] if lanes.dtype == np.bool_ else lanes.view(np.intp)


def _at(record: Any, places: Numbers) -> Any:
    if hasattr(record, "take"):  # an array
        return record.take(places, -1)
    fields = [_at(each, places) for each in record]
    return type(record)(*fields) if hasattr(record, "_fields") else tuple(fields)


def take(record: Record, lanes: Lanes) -> Record:
    """Some lanes of an array, or of a tuple or record of such; lanes are the last axis of every array."""
    return _at(record, _places(lanes))  # type: ignore[no-any-return]


def put(record: tuple[Any, ...], lanes: Lanes, values: Iterable[object]) -> None:
    """Write the fields of some lanes."""
    places = _places(lanes)
    for field, value in zip(record, values, strict=True):
        field[places] = value


def by_case(cases: Iterable[tuple[Flags, Callable[..., Record]]], *inputs: Any) -> Record:
    """The record of which each lane is made by the function of its case, from the lanes of that case alone."""
    made: Any = None
    for lanes, function in cases:
        places = lanes.nonzero()[0]
        if places.size == lanes.size:
            return function(*inputs)
        if places.size:
            part: Any = function(*[_at(each, places) for each in inputs])
            made = made or type(part)(*[np.zeros(lanes.shape, part[0].dtype) for _ in part])
            put(made, places, part)
    return made  # type: ignore[no-any-return]


def choose(where: Flags, first: Array | float, second: Array | float) -> Array:
    """`first` where a condition holds, `second` elsewhere; for values at hand, not for branches to compute."""
    return np.asarray(np.where(where, first, second))
