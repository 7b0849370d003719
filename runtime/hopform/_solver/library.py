"""The compiled library: where it is, and whether it is that of the generated package beside it.

This loads neither NumPy nor the package, so that `hopform --version` can name the back ends.
"""

import ctypes
import re
import sys
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from hopform._errors import BackendError

Backend = Literal["c", "python"]
SUFFIX = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")
LIBRARY = Path(__file__).resolve().parents[1] / f"_libhopform{SUFFIX}"


def opened(path: Path, prefix: str, package: str, layout: str) -> ctypes.CDLL:
    """The library of a package; BackendError, which names both, for one with another layout of structs and numbers."""
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
        raise BackendError(f"the compiled library {stale}; rebuild it with `make test` or reinstall hopform")
    return handle


def text_of(handle: ctypes.CDLL, name: str) -> str:
    """What a function of a library says that takes nothing and returns a text."""
    function = getattr(handle, name)
    function.restype = ctypes.c_char_p
    return bytes(function()).decode()


@cache
def handle() -> ctypes.CDLL:
    """The library that belongs to this installation; BackendError if there is none or it is stale."""
    if not LIBRARY.is_file():
        raise BackendError(f"there is no compiled library {LIBRARY.name}: hopform was installed without a C compiler")
    return opened(LIBRARY, "hopform", "hopform_solver", layout_of("hopform_solver"))


def layout_of(package: str) -> str:
    """The layout that a package names, read from its text: importing it takes much longer."""
    spec = find_spec(package)
    text = Path(spec.origin).read_text("utf-8") if spec and spec.origin else ""
    found = re.search(r'^LAYOUT = "(\w+)"$', text, re.MULTILINE)
    return found[1] if found else str(import_module(package).LAYOUT)


def library_message() -> str | None:
    """Why the C back end cannot be used; None if it can."""
    try:
        handle()
    except BackendError as error:
        return str(error)
    return None


def backends() -> tuple[Backend, ...]:
    """The back ends that can be used here, the default first.

    >>> "python" in backends()
    True
    """
    return ("python",) if library_message() else ("c", "python")
