"""Checks of what users hand in: each refusal names the field, the value and what is allowed."""

import math
from typing import Any, SupportsFloat

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._errors import HopformError
from hopform._solver.package import checked

beyond, shown = checked.beyond, checked.shown

__all__ = ["LARGEST", "drawing", "finite", "is_number", "positive", "real", "shaped", "shown", "times_of", "whole"]

LARGEST = 2**31 - 1
"""The largest count: C counts in 32 bits."""


def is_number(text: str) -> bool:
    """True where a text reads as a number, infinities and NaN among them."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def real(name: str, value: object, unit: str) -> float:
    """The value as a float, infinities and NaN among them; HopformError for what is no number, or beyond all floats."""
    if isinstance(value, (bool, str)) or not isinstance(value, SupportsFloat):
        raise HopformError(f"{name} must be a number in {unit}, got {shown(value)}")
    try:
        return float(value)
    except OverflowError:
        raise HopformError(beyond(name, unit, value)) from None
    except (TypeError, ValueError):
        raise HopformError(f"{name} must be a number in {unit}, got {shown(value)}") from None


def finite(name: str, value: object, unit: str) -> float:
    """The value as a float; HopformError unless it is a finite number."""
    if type(value) is float and math.isfinite(value):  # the common case, before a protocol is asked
        return value
    number = real(name, value, unit)
    if not math.isfinite(number):
        raise HopformError(f"{name} must be finite {unit}, got {number!r}")
    return number


def positive(name: str, value: object, unit: str) -> float:
    """The value as a float; HopformError unless it is finite and above zero."""
    number = finite(name, value, unit)
    if not number > 0.0:
        raise HopformError(f"{name} must be > 0 {unit}, got {number!r}")
    return number


def whole(name: str, value: object, least: int = 1, most: float = LARGEST) -> int:
    """The value; HopformError unless it is a whole number from `least` to `most`."""
    if isinstance(value, bool) or not isinstance(value, int) or value < least:
        raise HopformError(f"{name} must be a whole number >= {least}, got {shown(value)}")
    if value > most:
        raise HopformError(f"{name} must be a whole number <= {most}, got {shown(value)}")
    return value


def drawing(seed: object) -> "np.random.Generator":
    """The random numbers of a seed; HopformError unless it is a whole number >= 0."""
    return np.random.default_rng(whole("seed", seed, 0, math.inf))


def times_of(t: ArrayLike, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Times as an array of one dimension, contiguous; HopformError for what is no number, or beyond all floats."""
    try:
        return np.ascontiguousarray(t, dtype=dtype).reshape(-1)
    except OverflowError:
        raise HopformError(beyond("t", "s", t)) from None
    except (TypeError, ValueError):
        raise HopformError(f"t must be numbers in s, got {shown(t)}") from None


def shaped(values: Any, t: ArrayLike) -> float | NDArray[Any]:
    """Values at times as those were given: a float for one, else in their shape."""
    found = np.asarray(values)
    return float(found.reshape(-1)[0]) if np.shape(t) == () else found.reshape(np.shape(t))
