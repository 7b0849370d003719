# SPDX-License-Identifier: MIT-0
"""What the printed engine asks of memory: parts of arrays, names of slots, and what C finds out from addresses.

Memory is an object that stands for a struct, a list of such, or an array of numbers; its size is in bytes, as in C. An
object has a SIZE, and PARTS: the names of what lies in it, not behind a pointer.
"""

from collections.abc import Iterator, Sequence
from typing import Any


class Part:
    """An array from an index on: the same memory."""

    __slots__ = ("array", "first")

    def __init__(self, array: Any, first: int) -> None:
        self.array, self.first = array, first

    def __getitem__(self, index: int) -> Any:
        return self.array[self.first + index]

    def __setitem__(self, index: int, value: Any) -> None:
        self.array[self.first + index] = value


def aliases(kind: type, **names: str) -> None:
    """Further names of the slots of a class."""
    for name, slot in names.items():
        setattr(kind, name, getattr(kind, slot))


def overlap(written: Sequence[Any] | None, written_count: int, read: Sequence[Any], read_count: int) -> bool:
    """Whether a range that is written has an object, or an element of an array, in common with one that is read."""
    theirs = {cell for memory in read[:read_count] for cell in _cells(memory.first, memory.size)}
    kinds = {kind for kind, _, _ in theirs}
    return any(
        cell in theirs
        for memory in (written or ())[:written_count]
        if not _is_array_of_others(memory.first, kinds)
        for cell in _cells(memory.first, memory.size)
    )


def _is_array_of_others(memory: Any, kinds: set[type]) -> bool:
    """Whether memory is a list of objects without parts, of another kind than these."""
    first: Any = next(iter(memory), None) if hasattr(memory, "append") else None
    return getattr(first, "PARTS", None) == () and type(first) not in kinds


def refuse(
    status: int, written: Sequence[Any] | None, written_count: int, read: Sequence[Any] | None, read_count: int
) -> int:
    """The outputs of a refusal: zeros, but where one has some of what is read it stays as it is; the status."""
    for memory in (written or ())[:written_count]:
        first = memory.first
        if overlap([memory], 1, read or (), read_count):
            continue
        if hasattr(first, "SIZE"):
            first.put(type(first)())
        elif first is not None and memory.size > 0:
            for n in range(memory.size // _size(first[0])):
                if hasattr(first[n], "SIZE"):
                    first[n].put(type(first[n])())
                else:
                    first[n] = type(first[n])(0)
    return status


def put_reals(values: list[Any], memory: Any, size: int) -> None:
    """The leading numbers of memory, which take so many bytes, into an array that is long enough."""
    for n, value in zip(range(size // _size(values[0])), _numbers(memory), strict=False):
        values[n] = value


def _size(element: Any) -> int:
    """Bytes that an element of an array takes in C."""
    return int(getattr(element, "SIZE", 0) or getattr(element, "itemsize", 8))


def _cells(memory: Any, size: int) -> Iterator[tuple[type, int, int]]:
    """What memory of a size consists of: objects and elements of arrays, by their kind and identity."""
    if memory is None or size <= 0:
        return
    if hasattr(memory, "SIZE"):
        yield type(memory), id(memory), 0
        for name in memory.PARTS:
            part = getattr(memory, name)
            yield from _cells(part, size if hasattr(part, "SIZE") else len(part) * _size(part[0]))
        return
    array, first = (memory.array, memory.first) if isinstance(memory, Part) else (memory, 0)
    for n in range(first, min(first + size // _size(array[0]), len(array))) if len(array) else ():
        if hasattr(array[n], "SIZE"):
            yield from _cells(array[n], size)
        else:
            yield list, id(array), n


def _numbers(memory: Any) -> Iterator[Any]:
    """The numbers of an object or array, one after the other."""
    if hasattr(memory, "SIZE"):
        slots = (name for kind in reversed(type(memory).__mro__) for name in getattr(kind, "__slots__", ()))
        for name in slots:
            yield from _numbers(getattr(memory, name))
    elif type(memory) in (list, tuple):
        for each in memory:
            yield from _numbers(each)
    else:
        yield memory
