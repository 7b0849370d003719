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
with_notes = _build["with_notes"]


def library(root: Path = ROOT, folder: Path | None = None) -> Path:
    """Where the library stands in a folder; where none is named, that of a checkout."""
    return (folder or root / "runtime" / "hopform") / f"_libhopform{_build['SUFFIX']}"


def is_fresh(root: Path = ROOT) -> bool:
    """Whether the libraries are whole and have the hash of what generated/ says now. They are not loaded: they may be
    another computer's.
    """
    source = _build["source_of"](root / "generated").encode()
    whole = not any(_build["damage"](library(root), notes) for notes in (False, True))
    return whole and all(source in path.read_bytes() for path in (library(root), with_notes(library(root))))


def build_library(root: Path = ROOT, folder: Path | None = None) -> Path:
    """Compile generated/ with $CC (cc if unset) and return the library, which has its notes beside it; raise
    `LibraryNotBuilt` if that fails, which leaves an old one, refused by its hash where it is loaded.
    """
    target = library(root, folder)
    _build["compile_solver"](root / "generated", target)
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
