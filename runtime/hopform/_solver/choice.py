"""A solver: a generated package with its back ends, the compiled library where it is there and current, else NumPy."""

import warnings
from collections.abc import Callable
from typing import Any, Protocol, TypeAlias

from hopform._checks import shown
from hopform._errors import BackendError, HopformError
from hopform._solver import c, package
from hopform._solver.arrays import ArrayFlight, OnArrays, Solved
from hopform._solver.c import C
from hopform._solver.library import Backend
from hopform._solver.package import OURS, Array, Columns, LegState, Package, Precision, Steps, Target, records

SolvedStance: TypeAlias = c.Solved | Solved
SolvedFlight: TypeAlias = c.SolvedFlight | ArrayFlight
"""A stance and a flight as their back end keeps them; arrays of times have one dimension."""


class BackEnd(Protocol):
    """The interface of a back end over any generated package: `C` by its compiled library, `OnArrays` by NumPy.

    A state is x1, v1, v2 and the compression y. HopformError where numbers leave the range of the precision.
    """

    name: Backend

    def solve_stance(
        self, parameters: Any, start: LegState, steps: Steps, horizon: float, max_phases: int, dtype: Precision, /
    ) -> SolvedStance: ...

    def solve_flight(
        self, parameters: Any, start: LegState, ground: float, gains: records.Gains | None, horizon: float,
        max_phases: int, dtype: Precision, /,
    ) -> SolvedFlight: ...  # fmt: skip

    def choose_current(
        self, parameters: Any, start: LegState, target: Target, max_phases: int, dtype: Precision, /
    ) -> tuple[float, float, int, int]:
        """Current [A], hop height [m] (0 without take-off), status as in COMMANDS, and how many stances were solved."""
        ...

    def apexes(self, parameters: Any, starts: list[LegState], currents: Array, horizon: float) -> tuple[Array, Array]:
        """The next apex, NaN without take-off, and the largest x1, (starts, currents)."""
        ...

    def solve_columns(
        self, columns: Columns, results: Columns, readings: package.Readings, max_phases: int, events: bool, /
    ) -> package.Events:
        """Put the results and readings of stances into arrays; the events, if they are asked for."""
        ...


class Solver:
    """What every function of hopform solves with: a package and its back ends. The class of a robot names it."""

    def __init__(self, package: Package, library: Callable[[], c.Library]) -> None:
        """library: loads the compiled one; BackendError if there is none or it is stale."""
        self.package, self.arrays = package, OnArrays(package)
        self._library = library
        self._compiled: C | None = None
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

    def compiled(self) -> C:
        """The compiled library; BackendError if it is unusable."""
        self._compiled = self._compiled or C(self._library())
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
