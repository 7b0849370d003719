"""A plugin of pytest, `-p tests.other_library`: what solves is the library that HOPFORM_OTHER_LIBRARY names.

An instrumented one, or one that is broken on purpose. It takes the place of this checkout's where that is loaded, which
`import hopform` does. Where it counts, the counts are written when the tests end.
"""

import ctypes
import os
from pathlib import Path
from typing import Any

OTHER = os.environ.get("HOPFORM_OTHER_LIBRARY", "")
HERE = Path(__file__).resolve().parent.parent / "runtime" / "hopform"
_load = ctypes.CDLL


class Instead(_load):  # type: ignore[misc, valid-type]
    def __init__(self, name: Any, *arguments: Any, **named: Any) -> None:
        mine = name is not None and Path(str(name)).name.startswith("_libhopform.") and Path(str(name)).parent == HERE
        super().__init__(OTHER if mine else name, *arguments, **named)


if OTHER:
    ctypes.CDLL = Instead  # type: ignore[misc]


def pytest_unconfigure() -> None:
    dump = getattr(_load(OTHER), "write_counts", None) if OTHER else None
    if dump is not None:
        dump()
