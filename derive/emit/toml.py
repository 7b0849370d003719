"""Data as TOML: texts, numbers, truths, lists of them, tables, and lists of tables, whose own tables stand in a line."""

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

from .texts import string_of_toml


def toml(data: Mapping[str, Any]) -> str:
    """A table as the text of a file.

    >>> print(toml({"name": "leg", "build": {"flags": ["-O2"]}, "inputs": [{"name": "u", "limit": math.inf}]}))
    name = "leg"
    <BLANKLINE>
    [build]
    flags = ["-O2"]
    <BLANKLINE>
    [[inputs]]
    name = "u"
    limit = inf
    """
    return "\n".join(_lines(data))


def _lines(data: Mapping[str, Any]) -> Iterator[str]:
    """What is no table first, because all behind the head of a table belongs to it."""
    yield from (f"{key_of(key)} = {value_of(value)}" for key, value in data.items() if not _tables(value))
    for key, value in data.items():
        head = f"[{key}]" if isinstance(value, Mapping) else f"[[{key}]]"
        for table in _tables(value):
            yield from ("", head, *(f"{key_of(name)} = {value_of(each)}" for name, each in table.items()))


def _tables(value: Any) -> tuple[Mapping[str, Any], ...]:
    """The tables that a value is: itself, or those of a list."""
    several = (value,) if isinstance(value, Mapping) else value if isinstance(value, tuple | list) else ()
    return tuple(each for each in several if isinstance(each, Mapping))


def key_of(name: str) -> str:
    """A key, which may have letters beyond ASCII in quotes alone."""
    return name if re.fullmatch("[A-Za-z0-9_-]+", name) else value_of(name)


def value_of(value: Any) -> str:
    """A value in a line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return string_of_toml(value)
    if isinstance(value, Mapping):
        return (
            f"{{ {', '.join(f'{key_of(key)} = {value_of(each)}' for key, each in value.items())} }}" if value else "{}"
        )
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(value_of, value))}]"
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0.0 else "-inf"
    return repr(value)
