"""Compile generated/ into the shared library that Python loads: `python tools/build_library.py`.

How is said by generated/solver.toml and done by runtime/hopform/_solver/build.py, as for any solver; the Makefile and
the wheel's build hook come here. The library is plain C99, called through ctypes, so it needs no Python.h, and it is
built for the processor's portable baseline.
"""

import runpy
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "runtime" / "hopform" / "_solver" / "build.py"
_build = runpy.run_path(str(BUILD))
LibraryNotBuilt, NoCompiler = _build["LibraryNotBuilt"], _build["NoCompiler"]
compile_solver, with_notes = _build["compile_solver"], _build["with_notes"]


def library(root: Path = ROOT, folder: Path | None = None) -> Path:
    """Where the library stands in a folder; where none is named, that of a checkout."""
    return (folder or root / "runtime" / "hopform") / f"_libhopform{_build['SUFFIX']}"


def is_fresh(root: Path = ROOT) -> bool:
    """Whether the library is younger than all it is made of; folders count too, so a deleted source is noticed."""
    target, c = library(root), root / "generated" / "c"
    made_of = [Path(__file__), BUILD, root / "generated" / "solver.toml", c, *c.rglob("*")]
    there = target.exists() and with_notes(target).exists()
    return there and all(path.exists() and path.stat().st_mtime < target.stat().st_mtime for path in made_of)


def build_library(root: Path = ROOT, folder: Path | None = None) -> Path:
    """Compile generated/ with $CC (cc if unset) and return the library, which has its notes beside it; raise
    `LibraryNotBuilt` if that fails.

    After a failure none is left: an old one would pass for the new sources'.
    """
    target = library(root, folder)
    try:
        compile_solver(root / "generated", target)
    except LibraryNotBuilt:
        for each in (target, with_notes(target)):
            each.unlink(missing_ok=True)
        raise
    return target


def main() -> None:
    if is_fresh():
        return
    try:
        print(f"built {build_library().relative_to(ROOT)}")
    except LibraryNotBuilt as error:
        sys.exit("\n".join(["hopform: " + error.args[0], *error.args[1:]]))


if __name__ == "__main__":
    main()
