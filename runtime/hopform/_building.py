"""Solvers of model files: derived, compiled, and put into a folder or the cache of this user's solvers.

A model file is a program, and reading it runs it. The derivation, and what compiles, is imported when it is asked for.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import hopform.model as door
from hopform._checks import shown
from hopform._errors import HopformError, printable
from hopform._files import check_folder, name_of, path_of, read_text
from hopform._progress import progress_bar
from hopform._solver import build
from hopform._solver.folder import FACTS, built, folder_at
from hopform._solver.loading import programs_of

LARGEST_MODEL = 2**20
"""[B] the largest model file."""
USUAL = "some 20 s"
"""How long a build takes: 7 s of processor time for a joint, 12 s for a hopper, 15 to 22 s on two shared processors."""


@contextmanager
def in_one_line() -> Generator[None, None, None]:
    """What the derivation refuses is bad input, said in one line."""
    try:
        yield
    except Exception as error:  # an interrupt loads nothing: it may have come while sympy was loaded
        if isinstance(error, door.ModelError):  # the other part cannot be loaded where the hopper is no model
            raise HopformError(str(error)) from None
        if isinstance(error, door.part("emit.folder").FolderError):
            raise HopformError(str(error)) from None
        raise


def readable(model: str) -> str:
    """A model file that can be read, or the name of a model that ships; HopformError for anything else."""
    with in_one_line():
        shipped = door.part("derivation").SHIPPED
    if model not in shipped:
        if not model.endswith(".py"):
            allowed = f"a model file, whose name ends in .py, or one of {', '.join(shipped)}"
            raise HopformError(f"FILE must be {allowed}, got {shown(model)}")
        read_text(path_of("FILE", model), LARGEST_MODEL)
    return model


class Made(NamedTuple):
    """The folder of a solver, and how long its build took [s]; None where it was there already."""

    folder: Path
    seconds: float | None


def solver_of(model: str, out: Path | None, bar: Callable[..., None]) -> Made:
    """The solver of a model file, or of a model that ships, in a folder; without one in the cache, by a hash of the
    model, hopform and the compiler. Once it compiles, a line on the error stream says how long that takes. HopformError
    where it cannot be built.
    """
    with in_one_line():
        text = str(door.part("solver").source_of(model))
    try:
        folder = built() / hash_of(text) if out is None else out
        check_folder(folder)
    except (HopformError, RuntimeError) as error:  # RuntimeError: there is no home
        elsewhere = "; --out DIR builds it elsewhere" if out is None else ""
        raise HopformError(f"{error}{elsewhere}") from None
    compiler_in_words()  # which refuses a $CC that is no command
    if out is None and is_whole(folder):
        os.utime(folder / FACTS)  # the newest of its name is the one that its name means
        return Made(folder, None)
    begin = time.monotonic()
    make(model, folder, bar, in_cache=out is None)
    return Made(folder, time.monotonic() - begin)


def shipped_solver(name: str) -> Path | None:
    """The folder of the solver of a model that ships, which is built where it is not in the cache; None for another
    name.
    """
    if name not in door.shipped():
        return None
    with progress_bar("deriving") as bar:
        return solver_of(name, None, bar).folder


def hash_of(text: str) -> str:
    """A word for all that a solver in the cache depends on: model, derivation, version, compiler and flags."""
    digest = sha256(f"{version('hopform')}\n{compiler_in_words()}\n{text}\n".encode())
    for name, path in door.part("emit.sources").inputs():
        digest.update(f"{name}\n".encode() + path.read_bytes())
    digest.update(Path(build.__file__).read_bytes())
    return digest.hexdigest()[:16]


def compiler_in_words() -> str:
    """The compiler and its version; nothing where there is none."""
    try:
        command = build.compiler()
        asked = [*command, "--version"]
        done = subprocess.run(
            asked, stdin=subprocess.DEVNULL, capture_output=True, check=False, text=True, errors="replace"
        )
    except (build.NoCompiler, OSError):
        return ""
    except build.LibraryNotBuilt as error:
        raise HopformError(error.args[0]) from None
    return " ".join([*command, *done.stdout.splitlines()[:1]])


def no_compiler() -> str:
    try:
        return f"{build.compiler()[0]} does not run"
    except build.NoCompiler as error:
        return str(error)


def is_whole(folder: Path) -> bool:
    """Whether a solver in the cache is as it was built; one without a compiler has no library."""
    library = folder_at(folder).library
    try:
        programs_of(folder)
    except HopformError:
        return False
    return not library.exists() or build.damage(library) is None


def say_how_long(model: str) -> None:
    """That the solver of a model is compiled now, and how long that takes, where there is a compiler."""
    if compiler_in_words() and sys.stderr is not None:
        print(printable(f"hopform: compiling the solver of {model}, which takes {USUAL}"), file=sys.stderr)


@contextmanager
def made_for(folder: Path) -> Generator[None, None, None]:
    """The folder, made with those above it where it is not there; after an error without what was made, if it is empty."""
    missing = [each for each in (folder, *folder.parents) if not each.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    try:
        yield
    except BaseException:
        for each in missing:
            with suppress(OSError):
                each.rmdir()
        raise


def make(model: str, folder: Path, bar: Callable[..., None], *, in_cache: bool) -> None:
    """Derive and compile a solver aside, and rename it as a whole. A folder of the user's that is there already keeps
    its files of other names: the library goes first and comes last, the MANIFEST says what is ours at any time.
    """
    with in_one_line():
        texts = door.part("solver").solver(model)
    files, renamed = door.part("emit.folder"), in_cache or not folder.exists()
    if not renamed:
        with in_one_line():
            files.refuse_what_is_not_ours(texts, folder)
    parent = folder.parent if renamed else folder
    with made_for(parent), build.aside_in(parent, folder.resolve().name or "solver") as aside:
        with in_one_line():
            files.write(texts, aside)
        made, target = folder_at(aside).library, folder_at(folder).library
        say_how_long(model)
        try:
            build.compile_solver(aside, made, progress=lambda done, of: bar(done, of, "compiling"))
        except build.NoCompiler:
            pass
        except build.LibraryNotBuilt as error:
            raise HopformError(f"{name_of(folder)}: {error.args[0]}") from None
        if in_cache:
            build.put(aside, folder)
        elif renamed:
            aside.rename(folder)
        else:
            target.unlink(missing_ok=True)  # an old one would pass for the new sources'
            with in_one_line():
                files.write(texts, folder)
            build.move_libraries(made, target)
