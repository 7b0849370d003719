"""The type in which a number is handed in decides nothing but the number: all is computed in float64."""

import dataclasses
import inspect
from typing import Any

import numpy as np
import pytest
import xarray

import hopform
import hopform.identify
from hopform import HopformError
from tests.calls import CALLS, HOPPER, methods

DTYPES = ("f2", "f4", ">f4", ">f8", "i1", "u1", "i8", "u8", "g")
SLOW = {"animate"}
EVERY = {name: (call, arguments) for name, (call, arguments) in CALLS.items() if name not in SLOW}
EVERY["record"] = (hopform.identify.record, EVERY["record"][1] | {"seed": 1})
EVERY |= {name: (call, arguments) for name, call, arguments in methods() if not name.endswith("__getitem__")}


def numbers_of(call: Any, arguments: dict[str, Any]) -> dict[str, tuple[float, bool]]:
    """The arguments that are numbers, with a value that is none of a few bits, and whether they may be arrays."""
    found = {}
    for name, each in inspect.signature(call).parameters.items():
        given = arguments.get(name, each.default)
        many = "ArrayLike" in str(each.annotation)
        if isinstance(given, (int, float)) and not isinstance(given, bool) and name != "seed":
            found[name] = (given if isinstance(given, int) else given or 0.013, many)
        elif many and (given is inspect.Parameter.empty or given is None or isinstance(given, list)):
            found[name] = (0.13, many)
    return found


def flat(answer: Any) -> list[Any]:
    """All numbers and words of an answer."""
    parts: Any = None
    if isinstance(answer, xarray.Dataset):
        parts = [answer[name].values for name in sorted(map(str, answer.variables))]
    elif hasattr(answer, "_arrays"):
        parts = [np.asarray(values[1]) for _, values in sorted(answer._arrays().items())]
        parts += [answer.at(answer.duration / 3.0)] if hasattr(answer, "at") else []
    elif isinstance(answer, hopform.Robot):
        parts = answer.parameters
    elif dataclasses.is_dataclass(answer):
        parts = [getattr(answer, field.name) for field in dataclasses.fields(answer)]
    elif isinstance(answer, dict):
        parts = sorted(answer.items())
    elif isinstance(answer, (tuple, list)):
        parts = answer
    if parts is not None:
        return [flat(each) for each in parts]
    array = isinstance(answer, np.ndarray)
    return [str(answer.dtype), answer.shape, answer.tobytes()] if array else [type(answer).__name__, repr(answer)]


def answered(call: Any, arguments: dict[str, Any]) -> list[Any] | None:
    """None where it is refused."""
    try:
        return flat(call(**arguments))
    except HopformError:
        return None


def alike(call, arguments, name, value) -> bool:
    """Whether a value and the same in float64 have the same answer."""
    plain = np.asarray(value).astype(np.float64)
    reference = plain if plain.ndim else float(plain)
    return answered(call, arguments | {name: value}) == answered(call, arguments | {name: reference})


@pytest.mark.parametrize("name", sorted(EVERY))
def test_a_number_counts_as_its_value_in_whatever_type(name):
    call, arguments = EVERY[name]
    for argument, (value, many) in numbers_of(call, arguments).items():
        if isinstance(value, int) and not many:  # a count: of a number with a fraction it is refused
            for kind in (np.int8, np.uint16, np.int64) if value < 128 else ():
                one, other = (answered(call, arguments | {argument: each}) for each in (kind(value), value))
                assert one == other, (argument, kind)
            continue
        for dtype in DTYPES:
            with np.errstate(all="ignore"):
                several = np.array([value, 1.3 * value, 2.7 * value]).astype(dtype)
            for given in (several[0], several[:1].reshape(()), *([several, several[::-2]] if many else [])):
                assert alike(call, arguments, argument, given), (argument, given)


def test_halves_of_a_float_are_not_computed_in_halves():
    """5.7e-5 m off once."""
    heights = np.linspace(0.05, 0.4, 50).astype(np.float16)
    np.testing.assert_array_equal(
        hopform.next_apex(HOPPER, heights, 2.0), hopform.next_apex(HOPPER, heights.astype(float), 2.0)
    )
    labelled = xarray.DataArray(heights, dims="height")
    for given in (heights, labelled):
        one, other = (hopform.sweep(HOPPER, height=each, u=2.0).apex for each in (given, given.astype(float)))
        np.testing.assert_array_equal(one, other)
