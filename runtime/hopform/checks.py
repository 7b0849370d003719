"""Checks of what users hand in: each refusal names the field, the value and what is allowed."""

import math
from typing import SupportsFloat

from hopform.errors import HopformError


def is_number(text: str) -> bool:
    """True where a text reads as a number, infinities and NaN among them."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def finite(name: str, value: object, unit: str) -> float:
    """The value as a float; HopformError unless it is a finite number."""
    if type(value) is float and math.isfinite(value):  # the common case, before a protocol is asked
        return value
    if isinstance(value, (bool, str)) or not isinstance(value, SupportsFloat):
        raise HopformError(f"{name} must be a number in {unit}, got {value!r}")
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise HopformError(f"{name} must be a number in {unit}, got {value!r}") from None
    if not math.isfinite(number):
        raise HopformError(f"{name} must be finite {unit}, got {number!r}")
    return number


def positive(name: str, value: object, unit: str) -> float:
    """The value as a float; HopformError unless it is finite and above zero."""
    number = finite(name, value, unit)
    if not number > 0.0:
        raise HopformError(f"{name} must be > 0 {unit}, got {number!r}")
    return number
