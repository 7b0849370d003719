"""Whether a change needs the long stages of .ci/run: `python -m tools.long_stages` says why, and ends with 0 if it does.

It does if what is derived, the engine or their tests differ from a base: the commit that $HOPFORM_BASE names, else the
newest of HEAD's first parents that is 24 hours old. Where no base is known, everything runs.
"""

import os
import sys
from pathlib import Path

from tools.rooms import NoBase, Suite, changed

ROOMS = (
    "derive/", "templates/", "runtime/engine/", "generated/",
    "tests/conformance/", "tests/oracle/", "tests/fuzz/", "tests/mutation/", "tests/models/",
    "tests/repository/branch_coverage/", "tests/repository/determinism.py",
    "runtime/hopform/_solver/build.py", "tools/build_library.py", "tools/long_stages.py", "tools/rooms.py", ".ci/", "Makefile", "pyproject.toml",
)  # fmt: skip
"""Folders and files by which answers, digests or the stages themselves can change."""

OF_UNITS = {"derive", "engine", "generated"}
"""A test in tests/unit that tests one of these rooms, not by a helper alone, counts as them."""


def why(root: Path, base: str = "") -> str | None:
    """The reason for the long stages, in one line; None if nothing that they test has changed."""
    try:
        commit, names = changed(root, base)
    except NoBase as reason:
        return str(reason)
    return next((f"{name} differs from {commit[:9]}" for name in names if is_tested_long(root, name)), None)


def is_tested_long(root: Path, name: str) -> bool:
    """Whether a file that was changed, or is gone, is of ROOMS or one of their unit tests."""
    path = root / name
    if name.startswith("tests/unit/") and name.endswith(".py") and path.is_file():
        return bool(Suite(root).rooms_alone(path) & OF_UNITS)
    return name.startswith(ROOMS)


def main() -> int:
    reason = why(Path(__file__).resolve().parent.parent, os.environ.get("HOPFORM_BASE", ""))
    print(reason or "nothing that the long stages test has changed")
    return 0 if reason else 1


if __name__ == "__main__":
    sys.exit(main())
