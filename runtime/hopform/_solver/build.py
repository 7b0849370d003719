"""Compile the folder of a solver into the shared library that Python loads, and into that which explains, by the flags
and sources that its solver.toml names.

It needs Python's own library alone: the wheel's build hook and tools/build_library.py load it by its path.
"""

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from hashlib import sha256
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

PLATFORM = os.environ.get("HOPFORM_PLATFORM") or sys.platform
"""The platform of a wheel that is built for another computer, with $CC a cross compiler; or this one's."""
SUFFIX = ".dylib" if PLATFORM.startswith(("darwin", "macosx")) else ".dll" if PLATFORM.startswith("win") else ".so"


class LibraryNotBuilt(Exception):
    """Why there is no library now, in one line; what the compiler said may follow as a second argument."""


class NoCompiler(LibraryNotBuilt):
    """There is none, so that the solver is without a library, not broken."""


class Plan(NamedTuple):
    """What solver.toml says of a build: the flags, and the sources of the library and of that which has notes, by their
    paths in the folder."""

    flags: tuple[str, ...]
    sources: tuple[str, ...]
    notes: tuple[str, ...] = ()


def plan(folder: Path) -> Plan:
    """The [build] of a solver's folder."""
    said = tomllib.loads((folder / "solver.toml").read_text("utf-8"))["build"]
    return Plan(tuple(said["flags"]), tuple(said["sources"]), tuple(said.get("notes", ())))


def with_notes(library: Path) -> Path:
    """Where the library stands that explains what a library solves: beside it."""
    return library.with_stem(f"{library.stem}_notes")


def compiler() -> list[str]:
    """$CC; where it is not set cc, or zig of the extra `compiler`. NoCompiler without any, LibraryNotBuilt where $CC
    is no command.
    """
    said = os.environ.get("CC", "")
    try:
        chosen = shlex.split(said)
    except ValueError as error:
        raise LibraryNotBuilt(f"CC must be a command, as a shell splits it, got {said!r}: {error}") from None
    if chosen:
        return chosen
    if shutil.which("cc"):
        return ["cc"]
    if find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "cc", "-fno-sanitize=undefined"]
    raise NoCompiler("there is no C compiler: set CC, or install one (Debian: gcc; PyPI: hopform[compiler])")


def compile_solver(
    folder: Path, output: Path, *more: str, progress: Callable[[int, int], object] | None = None
) -> None:
    """Compile the sources of a solver's folder into a library, and beside it that which has notes; further flags come
    last, so that a level of optimisation takes effect. `progress` gets the number of steps that are done, and that of
    all.

    All is written aside and renamed, last the file of hashes without which neither library is loaded: a program that
    runs keeps the one that it loaded, and nobody loads half a file. Raises LibraryNotBuilt.
    """
    flags, sources, notes = plan(folder)
    command = compiler()
    libraries = [] if "-nostdlib" in command else ["-lm"]
    of_object = [*command, *(flag for flag in flags if flag != "-shared"), *more]
    of_object += [f"-I{folder / 'c' / each}" for each in ("include", "src")]
    of_object += [f'-DHOPFORM_SOURCE="{source_of(folder)}"', "-c"]
    units = list(dict.fromkeys([*sources, *notes]))
    try:
        with aside_in(output.parent, "objects") as aside:
            object_of = {source: Path(aside, f"{Path(source).stem}.o") for source in units}
            calls = [[*of_object, str(folder / source), "-o", str(to)] for source, to in object_of.items()]
            pool = ThreadPoolExecutor(os.cpu_count())
            try:
                for done, one in enumerate(as_completed([pool.submit(run, line) for line in calls]), 1):
                    one.result()
                    if progress is not None:
                        progress(done, len(units) + 1)
            finally:
                pool.shutdown(cancel_futures=True)  # after an error or an interrupt no further source is begun
            for target, of_it in ((with_notes(output), notes), (output, sources)):
                if of_it:
                    library = Path(aside, target.name)  # a library for Windows knows its own name
                    objects = [str(object_of[source]) for source in of_it]
                    run([*command, *flags, *more, *objects, "-o", str(library), *libraries])
            move_libraries(sealed(aside / output.name), output)
    except OSError as error:
        hint = "set CC, or on Debian: apt install gcc"
        raise NoCompiler(f"no C compiler: {command[0]}: {error.strerror} ({hint})") from error
    except subprocess.CalledProcessError as error:
        first = next((line for line in error.stderr.splitlines() if "error" in line), f"exit code {error.returncode}")
        raise LibraryNotBuilt(f"{command[0]} does not compile {folder.name}/c: {first}", error.stderr) from error


# ---- a library is complete or not there ----


def seal_of(library: Path) -> Path:
    """The file that is written last of a build: lines of `sha256sum`, of the library and of that which has notes."""
    return library.with_suffix(".sha256")


def sealed(library: Path) -> Path:
    """The library, whose hash and that of its notes, where there are some, are written beside it now."""
    both = (each for each in (library, with_notes(library)) if each.is_file())
    lines = (f"{sha256(each.read_bytes()).hexdigest()}  {each.name}\n" for each in both)
    seal_of(library).write_text("".join(lines), "utf-8", newline="\n")
    return library


def move_libraries(library: Path, target: Path) -> None:
    """Rename a library with its notes and hashes to where they are looked for, the hashes last."""
    for file, to in ((with_notes(library), with_notes(target)), (library, target), (seal_of(library), seal_of(target))):
        if file.is_file():
            os.replace(file, to)


def damage(library: Path, notes: bool = False) -> str | None:
    """What is wrong with a library, or with that which has notes; None where it is whole, byte for byte that which was
    built. To be asked before it is loaded: a file that was cut short ends the process by a signal.
    """
    file, seal = with_notes(library) if notes else library, seal_of(library)
    try:
        lines = seal.read_text("utf-8").splitlines(keepends=True)
        if f"{sha256(file.read_bytes()).hexdigest()}  {file.name}\n" in lines:
            return None
    except FileNotFoundError as error:
        return f"is not complete: there is no {Path(str(error.filename)).name}, which its build writes last"
    except (OSError, ValueError) as error:
        return f"cannot be read: {error}"
    return f"is damaged: its SHA-256 differs from that in {seal.name}"


ASIDE = ".hopform-build-"
LEFT_BEHIND = 86400.0
"""[B] the age in seconds of what a killed build has left; no build takes as long."""


@contextmanager
def aside_in(parent: Path, name: str) -> Generator[Path, None, None]:
    """An empty folder of a name to build in, on the disk of its parent, gone in the end but for what was renamed out of
    it. What killed builds have left in the parent goes, too.
    """
    for left in parent.glob(f"{ASIDE}*"):
        if time.time() - left.lstat().st_mtime > LEFT_BEHIND:
            shutil.rmtree(left, ignore_errors=True)
    outer = Path(tempfile.mkdtemp(prefix=ASIDE, dir=parent))
    try:
        aside = outer / name
        aside.mkdir()
        yield aside
    finally:
        shutil.rmtree(outer, ignore_errors=True)


def put(aside: Path, place: Path) -> None:
    """Rename a folder that is complete to its place, in which whatever stands is not complete, and goes."""
    try:
        if place.exists():
            place.rename(aside.with_name("replaced"))
        aside.rename(place)
    except OSError:
        if not place.is_dir():  # another process was faster, and what it put there is complete
            raise


# ---- how it is compiled ----


def source_of(folder: Path) -> str:
    """The hash of what is compiled, solver.toml and the sources in c/ of a folder, by which its libraries know them."""
    c, digest = folder / "c", sha256((folder / "solver.toml").read_bytes())
    for path in sorted(path for part in (c / "include" / "hopform", c / "notes", c / "src") for path in part.glob("*")):
        digest.update(f"{path.name}\n".encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def run(command: list[str]) -> None:
    subprocess.run(command, check=True, capture_output=True, text=True, errors="replace")
