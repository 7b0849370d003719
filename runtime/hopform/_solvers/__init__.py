"""Solvers as people have them: `load_solver`, and what it gives. Their packages are modules of this one, by source."""

from collections.abc import Callable, Iterable, Mapping
from ctypes import byref
from functools import cache, wraps
from inspect import isfunction, signature
from pathlib import Path
from typing import Any, ClassVar, Literal, SupportsFloat, cast

from hopform._building import shipped_solver
from hopform._checks import MEMORY, finite, items, shown, whole
from hopform._errors import BackendError, HopformError
from hopform._motion import DOUBLE
from hopform._robots import BaseRobot, checked_robot, robot_class, robot_file, robot_of, shipped
from hopform._robots import Robot as Hopper
from hopform._solver import choice
from hopform._solver.choice import SOLVERS
from hopform._solver.loading import loaded
from hopform._solver.package import Claim, Equation, not_loaded, records

MOST_SAMPLES = MEMORY // 64
"""Samples of a signal at most: each takes 64 B."""


class Solver:
    """Everything that `hopform` has and a model can, for the robots of one solver.

    Its functions are those of `hopform` under the same names; they take robots of its class `Robot` and refuse those of
    another solver. A function that the model cannot do raises HopformError, which says what the model lacks.

    >>> from hopform import load_solver
    >>> solver = load_solver("hopper")
    >>> stance = solver.solve_stance(solver.load_robot("hopper_c"), v2=-1.93, u=2.0)
    >>> solver.name, stance.status, solver.can[:3]
    ('hopper', 'takeoff', ('motion', 'fit', 'batches'))
    """

    Robot: type[Hopper]
    """the class of its robots"""
    _offered: ClassVar[Mapping[str, Any]]
    """What `hopform` offers, by name; `_all`, which stands above, binds it."""

    def __init__(self, core: choice.Solver) -> None:
        self._core, self.Robot = core, robot_class(core)

    def __repr__(self) -> str:
        return f"Solver {self.name} of source {self._core.source}: {', '.join(self.can)}"

    def __reduce__(self) -> Any:
        return _solver_again, (self._core.source,)

    @property
    def name(self) -> str:
        """The name of the model."""
        return self._core.name

    @property
    def title(self) -> str:
        """The model in a sentence."""
        return self._core.facts.title

    @property
    def can(self) -> tuple[str, ...]:
        """What the model can: motion, stance, flight, hop, command, reach, identify."""
        return self._core.facts.can

    @property
    def ROBOTS(self) -> tuple[str, ...]:
        """Names of the robots that it has; a solver of one's own has that of its folder."""
        return tuple(shipped(self.Robot))

    def load_robot(self, name_or_path: str | Path) -> Hopper:
        """A robot of this solver by its name, or of a TOML file; as `hopform.load_robot`.

        Raises HopformError for a file with `model = "NAME"` of another model, or with other parameters.
        """
        return robot_of(self.Robot, name_or_path)

    def robot_file(self, name_or_path: str | Path | None) -> Path | None:
        """The file that gives a robot; None for one that the solver has by that name, and for no robot."""
        return None if name_or_path is None else robot_file(name_or_path, self.Robot)

    def own(self, robot: object) -> Hopper:
        """The robot; HopformError for one of another solver."""
        if isinstance(robot, BaseRobot) and not isinstance(robot, self.Robot):
            other = robot.solver
            raise HopformError(
                f"robot {robot.name or 'given'} is of the solver {other.name} (source {other.source}), "
                f"not of {self.name} (source {self._core.source})"
            )
        return checked_robot(robot)

    def library_message(self) -> str | None:
        """Why its compiled library cannot be used; None if it can."""
        try:
            self._core.compiled()
        except BackendError as error:
            return str(error)
        return None

    @property
    def answers(self) -> Mapping[str, Mapping[str, str]]:
        """What JSON and tables of the commands hold: the fields of each object, with their types or units."""
        known: Mapping[str, Mapping[str, str]] = self._core.package.answers.ANSWERS
        return known

    def contacts(
        self, samples: Iterable[SupportsFloat], high: SupportsFloat, low: SupportsFloat, count: int
    ) -> list[tuple[int, Literal["touchdown", "takeoff"]]]:
        """Where a signal says that contact begins or ends: the number of the sample that confirms it, and "touchdown" or
        "takeoff". By the C that a board runs, `hopform_touchdown`: it begins with `count` samples in a row of which the
        first is at least `high`, the others at least `low`, and it ends with as many below `low`. Raises HopformError for
        a number that is not finite, and a count below 1.

        >>> load_solver("hopper").contacts([0.0, 0.7, 0.9, 0.1, 0.0], 0.6, 0.4, 2)
        [(2, 'touchdown'), (4, 'takeoff')]
        """
        library = self._core.compiled().library
        types = library.types(DOUBLE)
        unit = "units of the signal"
        levels = finite("high", high, unit), finite("low", low, unit)
        settings, contact = types.Detector(*levels, whole("count", count)), types.Contact()
        given = enumerate(items("samples", samples, "a sequence of numbers in units of the signal", MOST_SAMPLES))
        values = (types.real(finite(f"samples[{n}]", each, unit)) for n, each in given)
        advance = library.function("touchdown", types)
        events = (advance(byref(settings), byref(contact), each) for each in values)
        return [(n, cast(Any, records.CONTACTS[event])) for n, event in enumerate(events) if event]

    def equations(self) -> tuple[Equation, ...]:
        """The register of the paper's equations, on which every model rests."""
        register: tuple[Equation, ...] = self._core.package.equations.EQUATIONS
        return register

    def claims(self) -> tuple[Claim, ...]:
        """The register of what the paper claims, with numbers of the hoppers that ship."""
        register: tuple[Claim, ...] = self._core.package.equations.CLAIMS
        return register

    def __getattr__(self, name: str) -> Any:
        """What `hopform` has of this name: a function of a robot for this solver; else the same."""
        if name not in self._offered:
            raise AttributeError(f"a solver has no attribute {name!r}", name=name, obj=self)
        found = self._offered[name]
        if isfunction(found):
            found = self._bound(found)
        self.__dict__[name] = found
        return found

    def _bound(self, function: Callable[..., Any]) -> Callable[..., Any]:
        if next(iter(signature(function).parameters), "") != "robot":
            return function

        @wraps(function)
        def of_robot(robot: object, *arguments: Any, **named: Any) -> Any:
            return function(self.own(robot), *arguments, **named)

        return of_robot

    def __dir__(self) -> list[str]:
        return sorted({*object.__dir__(self), *self._offered} - {"load_solver"})


def load_solver(name_or_folder: str | Path) -> Solver:
    """A solver: that of a folder which `hopform model build FILE --out DIR` has filled, that of a model that was
    built under a name, the newest, or that ships, or "hopper", which `hopform` itself is. A folder is a Path or a text with
    a separator, as in "./joint"; any other text is a name. The solver of a model that ships is built into the cache the
    first time, which a line on the error stream says.

    Loading runs the programs in the folder: load what you have built, or trust. Raises HopformError for a name or a
    folder without a solver, and for a model file, which is to be built first.

    >>> import hopform
    >>> load_solver("hopper").Robot is hopform.Robot
    True
    """
    return _solver(loaded(name_or_folder, shipped_solver))


@cache
def _solver(core: choice.Solver) -> Solver:
    return Solver(core)


def _solver_again(source: str) -> Solver:
    """The solver of a pickle; HopformError where it is not loaded."""
    if source not in SOLVERS:
        raise HopformError(not_loaded("this", shown(source)))
    return _solver(SOLVERS[source])
