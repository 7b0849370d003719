"""A solver: a generated package with its back ends, the compiled library where it is there and current, else NumPy."""

import warnings
from collections.abc import Callable
from typing import TypeAlias

from hopform._checks import shown
from hopform._errors import BackendError, HopformError
from hopform._solver import c
from hopform._solver.arrays import ArrayFlight, OnArrays, Solved
from hopform._solver.package import OURS, Package

BackEnd: TypeAlias = c.C | OnArrays
"""A back end over any generated package, by its compiled library or by NumPy; both have the same methods.

A state is x1, v1, v2 and the compression y. HopformError where numbers leave the range of the precision.
"""
SolvedStance: TypeAlias = c.Solved | Solved
SolvedFlight: TypeAlias = c.SolvedFlight | ArrayFlight
"""A stance and a flight as their back end keeps them; arrays of times have one dimension."""


class Solver:
    """What every function of hopform solves with: a package and its back ends. The class of a robot names it."""

    def __init__(self, package: Package, library: Callable[[], c.Library]) -> None:
        """library: loads the compiled one; BackendError if there is none or it is stale."""
        self.package, self.arrays = package, OnArrays(package)
        self._library = library
        self._compiled: c.C | None = None
        self._best: BackEnd | None = None

    def back_end(self, name: str | None) -> BackEnd:
        """The back end of a name, or the best; HopformError if there is none of that name, BackendError if it is
        unusable.
        """
        if name is None:
            return self._best or self._found()
        if isinstance(name, str) and name in ("c", "numpy"):
            return self.compiled() if name == "c" else self.arrays
        raise HopformError(f"backend must be 'c' or 'numpy', got {shown(name)}")

    def compiled(self) -> c.C:
        """The compiled library; BackendError if it is unusable."""
        self._compiled = self._compiled or c.C(self._library())
        return self._compiled

    def _found(self) -> BackEnd:
        """The best back end, which is looked for once; where it is not the library a warning says why."""
        try:
            self._best = self.compiled()
        except BackendError as error:
            self._best = self.arrays
            warnings.warn(f"hopform uses its NumPy back end: {error}", RuntimeWarning, stacklevel=4)
        return self._best


DEFAULT = Solver(OURS, c.library)
"""That of the package that is installed with hopform."""
