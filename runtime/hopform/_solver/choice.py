"""A solver: a generated package with its compiled library."""

from collections.abc import Callable
from functools import cached_property

from hopform._errors import HopformError
from hopform._solver import c
from hopform._solver.folder import SHIPPED, Facts, Folder
from hopform._solver.package import OURS, Package


class Solver:
    """What every function of hopform solves with: a package, its library and its facts. The class of a robot names
    it.

    source: a word for the texts of the package, by which a pickle finds it.
    """

    def __init__(
        self, package: Package, library: Callable[[], c.Library], folder: Folder = SHIPPED, source: str = OURS.name
    ) -> None:
        """library: loads the compiled one; BackendError if there is none or it is stale."""
        self.package, self.folder, self.source = package, folder, source
        self._library = library
        self._compiled: c.C | None = None

    @cached_property
    def facts(self) -> Facts:
        """Names, units, words, and what the model can."""
        return self.folder.facts

    @cached_property
    def can(self) -> frozenset[str]:
        """What the model can, of `folder.ACTS`."""
        return frozenset(self.facts.can)

    @property
    def name(self) -> str:
        return self.facts.name

    def cannot(self, act: str) -> HopformError:
        """The error about what the model cannot do, which says what it lacks."""
        return self.facts.cannot(act)

    def compiled(self) -> c.C:
        """The compiled library; BackendError if it is unusable."""
        self._compiled = core = self._compiled or c.C(self._library())
        return core


DEFAULT = Solver(OURS, c.library)
"""That of the package that is installed with hopform."""
SOLVERS: dict[str, Solver] = {DEFAULT.source: DEFAULT}
"""The solvers of this process by their source."""
