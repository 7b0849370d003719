"""The compiled library: where it is, and whether it is that of the generated package beside it.

This loads neither NumPy nor the package, so that `hopform --version` can say it.
"""

import ctypes
import os
import re
import sys
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from hopform._errors import BackendError

SUFFIX = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")
LIBRARY = Path(__file__).resolve().parents[1] / f"_libhopform{SUFFIX}"
REINSTALL = "reinstall hopform"
REBUILD = "`python tools/build_library.py` makes it again"
"""What mends a stale library, in a wheel and in a checkout."""


def opened(
    path: Path, prefix: str, package: str, layout: str, mend: str = REINSTALL, folder: Path | None = None
) -> ctypes.CDLL:
    """The library of a package; BackendError, which names both and what mends it, for one with another layout of
    structs and numbers, or one that was compiled from other sources than a folder has.
    """
    try:
        handle = ctypes.CDLL(str(path))
    except OSError as error:
        raise BackendError(f"the compiled library {path.name} cannot be loaded: {error}") from None
    try:
        of_library = text_of(handle, f"{prefix}_layout")
    except AttributeError:
        raise BackendError(f"{path.name} is no library of {package}: it does not name its layout") from None
    if of_library != layout:
        stale = f"{path.name} is stale: its layout is {of_library}, that of {package} {layout}"
        raise BackendError(f"the compiled library {stale}; {mend}")
    if folder is not None and (of_library := text_of(handle, f"{prefix}_source")) != (source := source_of(folder)):
        stale = f"{path.name} is stale: it is of the sources {of_library or 'unknown'}, {folder.name}/c has {source}"
        raise BackendError(f"the compiled library {stale}; {mend}")
    return handle


def source_of(folder: Path) -> str:
    """The hash of what the library of a solver's folder is compiled from."""
    from hopform._solver import build

    return build.source_of(folder)


def text_of(handle: ctypes.CDLL, name: str) -> str:
    """What a function of a library says that takes nothing and returns a text."""
    function = getattr(handle, name)
    function.restype = ctypes.c_char_p
    return bytes(function()).decode()


@cache
def handle() -> ctypes.CDLL:
    """The library that belongs to this installation; BackendError if there is none or it is stale."""
    path, mend, folder = own_library()
    return opened(path, "hopform", "hopform_solver", layout_of("hopform_solver"), mend, folder)


def own_library() -> tuple[Path, str, Path | None]:
    """Where that library is, what mends it, and in a checkout the folder of whose sources it must be: that of a wheel
    was made with it. BackendError if it is nowhere, or not whole.
    """
    checkout = LIBRARY.parents[2] / "generated"
    if (checkout / "solver.toml").is_file():
        return whole(LIBRARY, checkout, REBUILD), REBUILD, checkout
    return whole(LIBRARY, LIBRARY.parent, REINSTALL), REINSTALL, None


def whole(library: Path, folder: Path, mend: str) -> Path:
    """The library, byte for byte as it was built; one of a folder's sources in its place where there is none.
    BackendError, with what mends it, for one that is damaged.
    """
    if not library.is_file():
        return compiled_once(folder, library.name)
    refuse_damage(library, mend)
    return library


def refuse_damage(library: Path, mend: str, notes: bool = False) -> None:
    """BackendError for a library, or that of its notes, which is not whole."""
    from hopform._solver import build

    if (damage := build.damage(library, notes)) is not None:
        name = build.with_notes(library).name if notes else library.name
        raise BackendError(f"the compiled library {name} {damage}; {mend}")


def compiled_once(folder: Path, name: str) -> Path:
    """The library of a folder that has none: made at its first use, by `cc` or the extra `compiler`, and kept in the
    user's cache by the hash of its sources. BackendError without a compiler, or where it cannot be made.
    """
    from hopform._solver import build

    absent = f"there is no compiled library {name}"
    try:
        place = cache_of_user() / "libraries" / build.source_of(folder)
        if build.damage(place / name) is not None:
            place.parent.mkdir(parents=True, exist_ok=True)
            with build.aside_in(place.parent, place.name) as aside:
                build.compile_solver(folder, aside / name)
                build.put(aside, place)
    except build.NoCompiler:
        extra = f"{sys.executable} -m pip install 'hopform[compiler]'"
        ways = f"install one (Debian: gcc) or name it by CC, run `{extra}`, or install a wheel of hopform that has a library"
        raise BackendError(f"{absent}, and no C compiler makes it: {ways}") from None
    except build.LibraryNotBuilt as error:
        raise BackendError(f"{absent}, and it cannot be made: {error.args[0]}") from None
    except (OSError, RuntimeError) as error:  # RuntimeError: there is no home
        raise BackendError(f"{absent}, and it cannot be made: {error}") from None
    return place / name


def cache_of_user() -> Path:
    """Where what is made for this user is kept."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".cache") / "hopform"


def layout_of(package: str) -> str:
    """The layout that a package names, read from its text: importing it takes much longer."""
    spec = find_spec(package)
    text = Path(spec.origin).read_text("utf-8") if spec and spec.origin else ""
    match = re.search(r'^LAYOUT = "(\w+)"$', text, re.MULTILINE)
    return match[1] if match else str(import_module(package).LAYOUT)


def library_message() -> str | None:
    """Why the compiled library cannot be used; None if it can."""
    try:
        handle()
    except BackendError as error:
        return str(error)
    return None
