"""Checks of what users hand in: each refusal names the field, the value and what is allowed.

One function for each kind of argument: a number, an array of numbers, a count, a flag, a word, a callable, a seed, a
number written as text. They raise HopformError for any object whatever, also for one whose own methods raise.
"""

# pyright: reportUnknownArgumentType=false, reportUnknownMemberType=false
# Anything may be handed in, arrays of any type among it.

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence, Sized
from dataclasses import fields
from enum import IntEnum
from itertools import islice
from typing import Any, SupportsFloat, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hopform._errors import HopformError, printable
from hopform._solver.package import checked

Array = NDArray[np.float64]
Thing = TypeVar("Thing")
LARGEST = 2**31 - 1
"""The largest count: C counts in 32 bits."""

MEMORY = 2**31
"""[B] what one call or command allocates at most; every count is bounded by what each of it takes."""

_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[+-]?\d+)?|[+-]?(?:inf(?:inity)?|nan)", re.ASCII | re.IGNORECASE)
_WHOLE = re.compile(r"[+-]?\d+", re.ASCII)
MOST_DIGITS = 4300
"""Digits of a whole number written as text; Python reads no more."""


def in_stroke(low: float, high: float, unit: str) -> str:
    """What a position between stops must be; a stop that there is none of is left out."""
    if math.isinf(low):
        return f"<= {high!r} {unit}, its upper stop"
    return f">= {low!r} {unit}, its lower stop" if math.isinf(high) else f"within its stroke {low!r} .. {high!r} {unit}"


def shown(value: object) -> str:
    """A value as an error message shows it, in a line: its repr, of a long one both ends; its class if it has none."""
    try:
        return printable(" ".join(checked.shown(value).split("\n")))
    except Exception:  # it is the object's own method that raises
        return f"an object of {type(value).__name__}, which cannot be shown"


def number_of(text: str) -> float | None:
    """The number that a text writes in decimal digits, infinities and NaN among them; None for any other text.

    Python's float() takes further spellings, which no other reader of a CSV takes: 1_0, and digits of other scripts.
    """
    written = text.strip()
    return float(written) if _NUMBER.fullmatch(written) else None


def whole_of(text: str) -> int | None:
    """The whole number that a text writes in up to `MOST_DIGITS` decimal digits, None for any other text."""
    written = text.strip()
    return int(written) if _WHOLE.fullmatch(written) and len(written) <= MOST_DIGITS else None


def is_scalar(value: object) -> bool:
    """Whether a value is one real number by its type: no bool, no text, no complex number, no masked element."""
    if isinstance(value, (np.ndarray, np.generic)):
        return value.ndim == 0 and value.dtype.kind in "iuf" and not isinstance(value, np.ma.MaskedArray)
    return hasattr(type(value), "__float__") and not isinstance(value, bool)


def is_one(value: object) -> bool:
    """Whether a value is meant as one number, be it a good one or not, and not as several."""
    return is_scalar(value) or isinstance(value, (str, bool, np.generic))


def real(name: str, value: object, unit: str) -> float:
    """The value as a float, infinities and NaN among them; HopformError for what is no number, or beyond all floats."""
    if is_scalar(value):
        try:
            return float(cast(SupportsFloat, value))
        except OverflowError:
            raise HopformError(checked.beyond(name, "" if unit == "1" else unit, _Shown(shown(value)))) from None
        except Exception:
            pass
    raise HopformError(f"{name} must be a number{'' if unit == '1' else f' in {unit}'}, got {shown(value)}")


class _Shown(str):
    """A text that is its own repr."""

    __repr__ = str.__str__


def finite(name: str, value: object, unit: str, least: float = -math.inf) -> float:
    """The value as a float; HopformError unless it is a finite number, and at least `least`."""
    if type(value) is float and least <= value < math.inf and value > -math.inf:  # the common case
        return value
    number = real(name, value, unit)
    if not math.isfinite(number):
        raise HopformError(f"{name} must be finite {unit}, got {number!r}")
    if number < least:
        raise HopformError(f"{name} must be >= {least:g} {unit}, got {number!r}")
    return number


def positive(name: str, value: object, unit: str) -> float:
    """The value as a float; HopformError unless it is finite and above zero."""
    number = finite(name, value, unit)
    if not number > 0.0:
        raise HopformError(f"{name} must be > 0 {unit}, got {number!r}")
    return number


def nonnegative(name: str, value: object, unit: str) -> float:
    """The value as a float; HopformError unless it is finite and not below zero."""
    return abs(finite(name, value, unit, 0.0))


def whole(name: str, value: object, least: int = 1, most: float = LARGEST) -> int:
    """The value; HopformError unless it is a whole number from `least` to `most`."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
        raise HopformError(f"{name} must be a whole number >= {least}, got {shown(value)}")
    if value > most:
        raise HopformError(f"{name} must be a whole number <= {most}, got {shown(value)}")
    return int(value)


def count(name: str, value: object, each: int, least: int = 1) -> int:
    """The value; HopformError unless it is a whole number of things that take `each` [B] and fit into `MEMORY`."""
    return whole(name, value, least, min(MEMORY // each, LARGEST))


class Role(IntEnum):
    """What random numbers are drawn for. The number is part of a stream's key: a released role keeps its own. 0 to 3 and
    5 are those of hopform.hopping; 6 was that of the paper's figures, which docs/gallery draws.
    """

    ROBOTS = 4
    PLANS = 7


def stream(role: int, seed: object, *places: int) -> "np.random.Generator":
    """The random stream of a seed, a role and places, such as those of a ground and of a hop; independent of all
    others.

    seed: a whole number >= 0 of any size. The key is NumPy's `SeedSequence(seed, spawn_key=(role, *places))`, whose
    streams are as good as independent, of neighbouring seeds too. A generator from the seed alone would give equal
    numbers to everything that is drawn with it.
    """
    whole_seed = whole("seed", seed, 0, math.inf)
    return np.random.default_rng(np.random.SeedSequence(whole_seed, spawn_key=(role, *places)))


def instance(name: str, value: object, kinds: type[Thing] | tuple[type[Thing], ...], what: str) -> Thing:
    """The value; HopformError unless it is of one of these types, which are `what` in words."""
    if not isinstance(value, kinds):
        raise HopformError(f"{name} must be {what}, got {shown(value)}")
    return value


def flag(name: str, value: object) -> bool:
    """The value; HopformError unless it is True or False."""
    return bool(instance(name, value, (bool, np.bool_), "True or False"))


def word(name: str, value: object, allowed: Sequence[str]) -> str:
    """The value; HopformError unless it is one of some words."""
    if not isinstance(value, str) or value not in allowed:
        raise HopformError(f"{name} must be one of {', '.join(allowed)}, got {shown(value)}")
    return value


def function(name: str, value: object) -> Any:
    """The value; HopformError unless it can be called, or is None."""
    if value is not None and not callable(value):
        raise HopformError(f"{name} must be a function, got {shown(value)}")
    return value


def items(name: str, value: object, what: str, most: int) -> list[Any]:
    """What a sequence or an iterator holds, in a list; HopformError for no such thing, and for more than `most`.

    Of an iterator that does not end it takes one entry more than that.
    """
    reason: Exception | None = None
    if isinstance(value, np.ndarray) and value.ndim != 1:
        raise HopformError(f"{name} must be of one dimension, got {value.ndim}")
    if not isinstance(value, (str, bytes, Mapping)):
        try:
            size = len(value) if isinstance(value, Sized) else 0
            found = list(islice(cast(Iterable[Any], value), most + 1)) if size <= most else []
        except Exception as error:
            reason = error
        else:
            if max(size, len(found)) > most:
                raise HopformError(f"{name} must have at most {most} entries, got {size or 'more'}")
            return found
    raise HopformError(f"{name} must be {what}, got {shown(value)}") from reason


def pair(name: str, value: object, what: str) -> tuple[Any, Any]:
    """The two values of a sequence; HopformError for what is no pair."""
    if isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, (str, bytes)):
        try:
            first, second = cast(Any, value)
        except Exception:
            pass
        else:
            return first, second
    raise HopformError(f"{name} must be a pair {what}, got {shown(value)}")


def mapping(name: str, value: object, most: int) -> dict[Any, Any]:
    """What a mapping holds, nothing for None; HopformError for no such thing, and for more than `most` entries."""
    try:
        found = [] if value is None else list(islice(cast(Mapping[Any, Any], value).items(), most + 1))
        entries = dict(found)
    except Exception:
        raise HopformError(f"{name} must be a mapping of names to values, got {shown(value)}") from None
    if len(found) > most:
        raise HopformError(f"{name} must have at most {most} entries, got more")
    return entries


def by(check: Callable[..., object], *how: object) -> Mapping[str, Any]:
    """Metadata of a field of a `Checked` dataclass: the check of its value, and what that takes behind the value."""
    return {"check": check, "how": how}


class Checked:
    """A dataclass whose fields are checked when it is made, in their order; each keeps what its check returns."""

    def __post_init__(self) -> None:
        for each in fields(cast(Any, self)):
            if each.metadata:
                value = each.metadata["check"](each.name, getattr(self, each.name), *each.metadata["how"])
                object.__setattr__(self, each.name, value)


# ---- arrays ----


def array_of(name: str, value: object, unit: str) -> Array:
    """The value as an array of float64; HopformError for what is no real numbers, and for what is masked.

    All numbers come in here, or one by one through `real`: what follows computes in float64, whatever type a caller
    has. An array of more numbers than `MEMORY` holds is refused before anything is computed from it: a view that is
    broadcast takes no memory, what follows from it does.
    """
    try:
        size = _size_of(value)
        array = np.asarray(value if size <= MEMORY // 8 and not isinstance(value, Mapping) else None)
    except Exception:
        size, array = 0, np.asarray(None)
    if size > MEMORY // 8:
        raise HopformError(f"{name} must have at most {MEMORY // 8} numbers, got {size}")
    if isinstance(value, np.ma.MaskedArray) and bool(np.ma.getmaskarray(cast(Any, value)).any()):
        raise HopformError(f"{name} must have no masked numbers: fill them in, or leave them out")
    if array.dtype.kind in "iuf":
        with np.errstate(over="ignore"):  # of a long double that no float holds
            return array.astype(np.float64, copy=False)
    if array.dtype.kind == "O" and array.size and all(is_scalar(each) for each in array.flat):
        found = [real(f"{name}{place(index)}", each, unit) for index, each in np.ndenumerate(array)]
        return np.array(found).reshape(array.shape)
    raise HopformError(f"{name} must be numbers in {unit}, got {shown(value)}")


def _size_of(value: object) -> int:
    """How many numbers an array would have that is made of a value: of a sequence, by the first of its entries."""
    if isinstance(value, np.ndarray):
        return value.size
    if isinstance(value, Sequence) and not isinstance(value, (str, bytes)):
        several = cast(Sequence[object], value)
        return len(several) * (_size_of(several[0]) if several else 1)
    return 1


def numbers(name: str, value: object, unit: str) -> Array:
    """The value as an array of finite numbers; HopformError names the first that is none, with its index."""
    array = array_of(name, value, unit)
    refuse_any(name, array, np.isfinite(array), lambda bad: f"must be finite {unit}, got {bad!r}")
    return array


def refuse_any(name: str, array: ArrayLike, allowed: Any, reason: Callable[[float], str]) -> None:
    """HopformError about the first value that is not allowed, if there is one; the values broadcast to `allowed`."""
    if not (allowed if isinstance(allowed, (bool, np.bool_)) else np.all(allowed)):
        index = tuple(np.argwhere(~np.asarray(allowed))[0].tolist())
        raise HopformError(f"{name}{place(index)} {reason(float(np.broadcast_to(array, np.shape(allowed))[index]))}")


def place(index: tuple[int, ...]) -> str:
    """An index as it is written, nothing for that of a number."""
    return f"[{', '.join(map(str, index))}]" if index else ""


def times_within(t: ArrayLike, dtype: np.dtype[Any], longest: float, *, endless: bool = False) -> NDArray[Any]:
    """Times as an array of one dimension, contiguous; HopformError for one that is not in 0 .. longest [s], or, where
    the motion is endless, not from 0 on."""
    array = array_of("t", t, "s")
    with np.errstate(over="ignore"):
        found = np.ascontiguousarray(array, dtype=dtype).reshape(-1)
    good = (found >= 0.0) & (found <= (math.inf if endless else longest)) & np.isfinite(found)
    if not bool(np.all(good)):
        allowed = "0 <= t" if endless else f"0 <= t <= {longest!r} s"
        raise HopformError(f"t must be {allowed}, got {float(found[~good][0])!r}")
    return found


def shaped(values: Any, t: ArrayLike) -> float | NDArray[Any]:
    """Values at times as those were given: a float for one, else in their shape."""
    found = np.asarray(values)
    return float(found.reshape(-1)[0]) if np.shape(t) == () else found.reshape(np.shape(t))
