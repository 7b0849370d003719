"""Load a solver from its folder: its package under a name of its own, its library, and the facts of both.

Loading runs the programs that the folder holds. Two of them stand side by side: a package is loaded as
`hopform._solvers.SOURCE`, its modules name each other relatively, and nothing is put on sys.path.
"""

import os
import re
import sys
from collections.abc import Callable, Iterator
from functools import cache, partial
from hashlib import sha256
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

from hopform._checks import shown
from hopform._errors import HopformError
from hopform._files import name_of, path_of
from hopform._solver import c
from hopform._solver.choice import DEFAULT, SOLVERS, Solver
from hopform._solver.folder import FACTS, MADE_AGAIN, Folder, built_solvers, folder_at, folder_of, is_name
from hopform._solver.library import whole
from hopform._solver.package import LOADED, Package

PACKAGE = "python/hopform_solver"
MANIFEST = "MANIFEST"


def loaded(name_or_folder: str | Path, shipped: Callable[[str], Path | None] = lambda _: None) -> Solver:
    """The solver of a folder, which is a Path or a text with a separator; or of a name, any other text: "hopper", or
    that of a model that was built, or that ships: `shipped` gives its folder. What lies in the current folder never
    changes what a name means.

    Raises HopformError: no such solver, a model file, a folder that is no solver's.
    """
    path = path_of("solver", name_or_folder)
    if path.suffix == ".py":
        raise HopformError(f"{name_of(path)} is a model file; build it first: hopform model build {name_of(path)}")
    if is_name(name_or_folder):
        return _of_name(str(name_or_folder), shipped)
    if os.path.isdir(path):
        if not os.path.isfile(path / FACTS):
            remedy = f"`hopform model build FILE --out {name_of(path)}` makes one"
            raise HopformError(f"{name_of(path)} is not a solver: it has no {FACTS}: {remedy}")
        return _of_folder(path.resolve())
    if os.path.lexists(path):
        raise HopformError(f"{name_of(path)} is not a solver, which is a folder with {FACTS}")
    raise HopformError(f"there is no folder {name_of(path)}: `hopform model build FILE --out {name_of(path)}` makes it")


def _of_name(name: str, shipped: Callable[[str], Path | None]) -> Solver:
    """The solver of a name; the newest of those that were built under it, else of the model that ships."""
    if name == DEFAULT.name:
        return DEFAULT
    if (place := folder_of(name) or shipped(name)) is not None:
        return _of_folder(place)
    names = ", ".join([DEFAULT.name, *sorted({own for _, own in built_solvers()} - {DEFAULT.name})])
    folder = (
        f"the folder is {name_of(os.path.join(os.curdir, name))}"
        if os.path.isdir(name)
        else "a folder is written with a separator, as in ./joint"
    )
    raise HopformError(
        f"there is no solver {shown(name)}; known: {names}; {folder}; models that ship "
        "(`hopform model list`) are built when they are named"
    )


def _of_folder(path: Path) -> Solver:
    folder = folder_at(path)
    facts = folder.facts
    source = _source_of(path)
    if source not in SOLVERS:
        package = _imported(path / PACKAGE, source)
        if (layout := str(sys.modules[package.name].LAYOUT)) != facts.layout:
            raise HopformError(f"{name_of(path)}: {FACTS} has the layout {facts.layout}, its package {layout}")
        library = cache(partial(_library, folder, package))
        SOLVERS[source], c.LIBRARIES[package.name] = Solver(package, library, folder, source), library
    return SOLVERS[source]


def _source_of(path: Path) -> str:
    """A word for the facts and the package of a solver; HopformError where they are not those that were built."""
    digest = sha256()
    for name, content in programs_of(path).items():
        digest.update(f"{name.rpartition('/')[2]}\n".encode() + content)
    return digest.hexdigest()[:16]


def programs_of(path: Path) -> dict[str, bytes]:
    """The facts and the package in a folder of one's own, by path in it, each as MANIFEST has it, to be asked before
    any of it is run. HopformError otherwise: a build was killed, a copy was cut short, a file was edited.
    """
    digests = dict(_digests(path))
    names = [FACTS, *sorted(each for each in digests if each.startswith(f"{PACKAGE}/") and each.endswith(".py"))]
    programs = {name: _read(path / name) for name in names}
    for name, content in programs.items():
        if sha256(content).hexdigest() != digests.get(name):
            raise HopformError(f"{name_of(path / name)} was changed after its build: {MADE_AGAIN}")
    return programs


def _digests(path: Path) -> Iterator[tuple[str, str]]:
    """What MANIFEST has of the files that a folder was built with: path in it, SHA-256. Of a file that a build was about
    to replace it has two, the new one behind.
    """
    text = _read(path / MANIFEST).decode("utf-8", "replace")
    if not (whole := re.fullmatch(rf"# made\n((?:{_LINE})*)# made from\n(?:{_LINE})*", text)):
        raise HopformError(f"{name_of(path / MANIFEST)} was changed after its build: {MADE_AGAIN}")
    for line in whole[1].splitlines():
        digest, _, name = line.partition("  ")
        yield name, digest


_LINE = r"[0-9a-f]{64}  [^\x00-\x1f]+\n"


def _read(path: Path) -> bytes:
    """The bytes of a file of a solver; HopformError where there is none."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise HopformError(f"{name_of(path)} cannot be read: {error.strerror}; {MADE_AGAIN}") from None


def _imported(folder: Path, source: str) -> Package:
    """The package in a folder."""
    name = f"{LOADED}{source}"
    spec = spec_from_file_location(name, folder / "__init__.py", submodule_search_locations=[str(folder)])
    if spec is None or spec.loader is None or not (folder / "__init__.py").is_file():
        raise HopformError(f"{name_of(folder)} holds no package of a solver")
    sys.modules[name] = module = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except BaseException as error:
        del sys.modules[name]
        if not isinstance(error, Exception):
            raise
        raise HopformError(f"{name_of(folder)} cannot be loaded: {type(error).__name__}: {error}") from error
    return Package(name)


def _library(folder: Folder, package: Package) -> c.Library:
    """The compiled library of a folder, which is made where it has none; BackendError if it cannot be, or for one of
    other sources than the folder has, or one that is not whole.
    """
    path = whole(folder.library, folder.library.parent, MADE_AGAIN)
    return c.Library(path, "hopform", package, MADE_AGAIN, folder.library.parent)
