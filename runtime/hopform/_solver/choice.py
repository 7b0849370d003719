"""Which back end solves: the compiled library where it is there and current, NumPy otherwise, which it says once."""

import warnings
from functools import cache

from hopform._checks import shown
from hopform._errors import HopformError
from hopform._solver import arrays
from hopform._solver import c as native
from hopform._solver.library import Backend, library_message

MODULES = {"c": native, "numpy": arrays}


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
