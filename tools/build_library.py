"""Compile generated/c into the shared library that Python loads: `python tools/build_library.py`.

The only place that says how: the wheel's build hook and the Makefile both come here. The library is plain C99, called
through ctypes, so it needs no Python.h, and it is built for the processor's portable baseline.
"""

import os
import shlex
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FLAGS = ["-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=default", "-ffp-contract=off", "-fno-math-errno"]
PLATFORM = os.environ.get("HOPFORM_PLATFORM") or sys.platform
"""The platform of a wheel that is built for another computer, with $CC a cross compiler; or this one's."""
SUFFIX = ".dylib" if PLATFORM.startswith(("darwin", "macosx")) else ".dll" if PLATFORM.startswith("win") else ".so"


class LibraryNotBuilt(Exception):
    """Why there is no library now, in one line; what the compiler said may follow as a second argument."""


def library(root: Path = ROOT) -> Path:
    """Where the library stands in a checkout."""
    return root / "runtime" / "hopform" / f"_libhopform{SUFFIX}"


def is_fresh(root: Path = ROOT) -> bool:
    """Whether the library is younger than all it is made of; folders count too, so a deleted source is noticed."""
    target, c = library(root), root / "generated" / "c"
    made_of = [Path(__file__), c / "src", c / "include", *(c / "src").rglob("*"), *(c / "include").rglob("*")]
    return target.exists() and all(path.exists() and path.stat().st_mtime < target.stat().st_mtime for path in made_of)


def build_library(root: Path = ROOT) -> Path:
    """Compile generated/c/src/*.c with $CC (cc if unset) and return the library; raise `LibraryNotBuilt` if that fails.

    It is written aside and renamed, so a running program keeps the one it loaded and nobody ever loads half a file.
    After a failure none is left: an old one would pass for the new sources'.
    """
    target = library(root)
    try:
        with tempfile.TemporaryDirectory(prefix="_build_", dir=target.parent) as folder:
            aside = Path(folder, target.name)  # a library for Windows knows its own name
            compile_sources(root / "generated" / "c", aside)
            os.replace(aside, target)
    except LibraryNotBuilt:
        target.unlink(missing_ok=True)
        raise
    return target


def compile_sources(c: Path, output: Path, *more: str) -> None:
    """Compile a tree of sources into a library; further flags come last,
    so that a level of optimisation takes effect.
    """
    compiler = shlex.split(os.environ.get("CC") or "cc")
    sources = sorted((c / "src").glob("*.c"))
    if not sources:
        raise LibraryNotBuilt("generated/c/src holds no C file (`make generate` writes them)")
    include = ["-I", str(c / "include"), *naming_the_source(c)]
    libraries = [] if "-nostdlib" in compiler else ["-lm"]
    for_objects = [*compiler, *(flag for flag in FLAGS if flag != "-shared"), *more, *include, "-c"]
    try:
        with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(os.cpu_count()) as pool:
            objects = [str(Path(folder, f"{source.stem}.o")) for source in sources]
            commands = ([*for_objects, str(source), "-o", made] for source, made in zip(sources, objects, strict=True))
            list(pool.map(run, commands))
            run([*compiler, *FLAGS, *more, *objects, "-o", str(output), *libraries])
    except OSError as error:
        hint = "set CC, or on Debian: apt install gcc"
        raise LibraryNotBuilt(f"no C compiler: {compiler[0]}: {error.strerror} ({hint})") from error
    except subprocess.CalledProcessError as error:
        first = next((line for line in error.stderr.splitlines() if "error" in line), f"exit code {error.returncode}")
        raise LibraryNotBuilt(f"{compiler[0]} does not compile generated/c: {first}", error.stderr) from error


def naming_the_source(c: Path) -> list[str]:
    """The flag by which a library knows the hash of the sources that it is compiled from."""
    (headers,) = (c / "include").iterdir()
    sources = sorted(path for folder in (headers, c / "src") for path in folder.iterdir())
    digest = sha256()
    for path in sources:
        digest.update(f"{path.name}\n".encode() + path.read_bytes())
    return [f'-D{headers.name.upper()}_SOURCE="{digest.hexdigest()[:16]}"']


def run(command: list[str]) -> None:
    subprocess.run(command, check=True, capture_output=True, text=True, errors="replace")


def main() -> None:
    if is_fresh():
        return
    try:
        print(f"built {build_library().relative_to(ROOT)}")
    except LibraryNotBuilt as error:
        sys.exit("\n".join(["hopform: " + error.args[0], *error.args[1:]]))


if __name__ == "__main__":
    main()
