"""Which back end solves: the compiled library where it is there and current, NumPy otherwise, which it says once."""

import warnings
from functools import cache
from typing import Literal

from hopform import arrays, native
from hopform.checks import shown
from hopform.errors import BackendError, HopformError

Backend = Literal["c", "numpy"]
MODULES = {"c": native, "numpy": arrays}


def library_message() -> str | None:
    """Why the C back end cannot be used; None if it can."""
    try:
        native.library()
    except BackendError as error:
        return str(error)
    return None


def backends() -> tuple[Backend, ...]:
    """The back ends that can be used here, the default first.

    >>> "numpy" in backends()
    True
    """
    return ("numpy",) if library_message() else ("c", "numpy")


def choose(backend: str | None) -> Backend:
    """The back end of a name, or the default; HopformError if there is none of that name, BackendError if it is unusable."""
    if backend is None:
        return _default()
    if backend == "c":
        native.library()
        return "c"
    if backend == "numpy":
        return "numpy"
    raise HopformError(f"backend must be 'c' or 'numpy', got {shown(backend)}")


@cache
def _default() -> Backend:
    message = library_message()
    if message is None:
        return "c"
    warnings.warn(f"hopform uses its NumPy back end: {message}", RuntimeWarning, stacklevel=4)
    return "numpy"
