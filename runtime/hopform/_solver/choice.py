"""The solvers: the compiled library where it is there and current, NumPy otherwise, which it says once."""

import warnings
from functools import cache

from hopform._checks import shown
from hopform._errors import HopformError
from hopform._solver import c, c_batch, c_control, c_flight
from hopform._solver.arrays import OnArrays
from hopform._solver.library import library_message
from hopform._solver.package import OURS
from hopform._solver.protocol import Solver


class C(c.Compiled):
    """The compiled library of a generated package as a solver."""

    solve_stance = c.solve_stance
    solve_flight = c_flight.solve_flight
    choose_current = c_control.choose_current
    apexes = c_control.apexes
    solve_columns = c_batch.solve_columns
    differentiate_columns = c_batch.differentiate_columns


def choose(backend: str | None) -> Solver:
    """The solver of a name, or the default; HopformError if there is none of that name, BackendError if it is
    unusable.
    """
    if backend is None:
        return _default()
    if backend == "c":
        return _compiled()
    if backend == "numpy":
        return ON_ARRAYS
    raise HopformError(f"backend must be 'c' or 'numpy', got {shown(backend)}")


ON_ARRAYS = OnArrays(OURS)


@cache
def _compiled() -> C:
    return C(c.library())


@cache
def _default() -> Solver:
    message = library_message()
    if message is None:
        return _compiled()
    warnings.warn(f"hopform uses its NumPy back end: {message}", RuntimeWarning, stacklevel=4)
    return ON_ARRAYS
