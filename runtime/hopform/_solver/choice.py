"""A solver: a generated package with its back ends, the compiled library where it is there and current, else the engine
that is printed as Python.
"""

import sys
import warnings
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

from hopform._checks import shown
from hopform._errors import BackendError, HopformError
from hopform._solver import c
from hopform._solver.folder import SHIPPED, Facts, Folder
from hopform._solver.package import OURS, Package
from hopform._solver.printed import Python, Solved
from hopform._solver.printed import SolvedFlight as PrintedFlight

BackEnd: TypeAlias = c.C | Python
"""A back end over any generated package, by its compiled library or by its Python; both have the same methods.

A state is x1, v1, v2 and the compression y. HopformError where numbers leave the range of the precision.
"""
SolvedStance: TypeAlias = c.Solved | Solved
SolvedFlight: TypeAlias = c.SolvedFlight | PrintedFlight
"""A stance and a flight as their back end keeps them; arrays of times have one dimension."""


_HOPFORM = str(Path(__file__).resolve().parents[1])
NUMPY_IS_PYTHON = 'backend="numpy" is backend="python" now, the C printed as Python: about 0.3 ms for each stance'


ACTS = {
    "motion": "motion", "stance": "stance", "flight": "flight", "hop": "hops", "command": "controller",
    "reach": "map of apexes", "identify": "identification",
}  # fmt: skip
"""What a model can, in words."""


class Solver:
    """What every function of hopform solves with: a package, its back ends and its facts. The class of a robot names
    it.

    source: a word for the texts of the package, by which a pickle finds it.
    """

    def __init__(
        self, package: Package, library: Callable[[], c.Library], folder: Folder = SHIPPED, source: str = OURS.name
    ) -> None:
        """library: loads the compiled one; BackendError if there is none or it is stale."""
        self.package, self.python, self.folder, self.source = package, Python(package), folder, source
        self._library = library
        self._compiled: c.C | None = None
        self._best: BackEnd | None = None

    @cached_property
    def facts(self) -> Facts:
        """Names, units, words, and what the model can."""
        return self.folder.facts

    @cached_property
    def can(self) -> frozenset[str]:
        """What the model can, of ACTS."""
        return frozenset(self.facts.can)

    @property
    def name(self) -> str:
        return self.facts.name

    def cannot(self, act: str) -> HopformError:
        """The error about what the model cannot do, which says what it lacks."""
        lacks = self.facts.lacks.get(act, "what that needs")
        return HopformError(f"the model {self.name} has no {ACTS[act]}: it lacks {lacks}")

    def back_end(self, name: str | None) -> BackEnd:
        """The back end of a name, or the best; HopformError if there is none of that name, BackendError if it is
        unusable.
        """
        if name is None:
            return self._best or self._found()
        if isinstance(name, str) and name == "numpy":
            warnings.warn(NUMPY_IS_PYTHON, DeprecationWarning, stacklevel=_up_to_caller())
        if isinstance(name, str) and name in ("c", "python", "numpy"):
            return self.compiled() if name == "c" else self.python
        raise HopformError(f"backend must be 'c' or 'python', got {shown(name)}")

    def compiled(self) -> c.C:
        """The compiled library; BackendError if it is unusable."""
        self._compiled = self._compiled or c.C(self._library())
        return self._compiled

    def _found(self) -> BackEnd:
        """The best back end, which is looked for once; where it is not the library a warning says why."""
        try:
            self._best = self.compiled()
        except BackendError as error:
            self._best = self.python
            warnings.warn(f"hopform uses its Python back end: {error}", RuntimeWarning, stacklevel=_up_to_caller())
        return self._best


def _up_to_caller() -> int:
    """How many frames above the function that asks stands the first that is not hopform's, as `warn` counts them."""
    frame, level = sys._getframe(1), 1  # pyright: ignore[reportPrivateUsage]
    while frame.f_back is not None and frame.f_code.co_filename.startswith(_HOPFORM):
        frame, level = frame.f_back, level + 1
    return level


DEFAULT = Solver(OURS, c.library)
"""That of the package that is installed with hopform."""
SOLVERS: dict[str, Solver] = {DEFAULT.source: DEFAULT}
"""The solvers of this process by their source."""
