"""Whether a change needs the long stages of .ci/run: `python tools/long_stages.py` says why, and ends with 0 if it does.

It does if what is derived, the engine or their tests differ from a base: the commit that $HOPFORM_BASE names, else the
newest of HEAD's first parents that is 24 hours old. Where no base is known, everything runs.
"""

import os
import subprocess
import sys
from pathlib import Path

ROOMS = (
    "derive/", "templates/", "runtime/engine/", "generated/",
    "tests/conformance/", "tests/oracle/", "tests/fuzz/", "tests/mutation/", "tests/models/",
    "tests/repository/branch_coverage/", "tests/repository/determinism.py",
    "runtime/hopform/_solver/build.py", "tools/build_library.py", "tools/long_stages.py", ".ci/", "Makefile", "pyproject.toml",
)  # fmt: skip
"""Folders and files by which answers, digests or the stages themselves can change."""

OF_UNITS = ("from derive", "import derive", "_solver.build", "generated")
"""A test in tests/unit that has one of these tests one of these rooms."""


def why(root: Path, base: str = "") -> str | None:
    """The reason for the long stages, in one line; None if nothing that they test has changed."""
    try:
        if git(root, "rev-parse", "--is-shallow-repository") == "true":
            return "the history is cut off"
        base = base or git(root, "rev-list", "-1", "--first-parent", "--before=24 hours ago", "HEAD")
        if not base:
            return "no commit is 24 hours old"
        commit = git(root, "rev-parse", "--verify", "--quiet", f"{base}^{{commit}}")
        if commit == git(root, "rev-parse", "HEAD"):
            return "the base is HEAD itself"
        changed = git(root, "diff", "--name-only", "-z", commit).split("\0")
    except (OSError, subprocess.CalledProcessError):
        return f"the base {base or 'of 24 hours ago'} is unknown"
    return next((f"{name} differs from {commit[:9]}" for name in changed if is_tested_long(root, name)), None)


def is_tested_long(root: Path, name: str) -> bool:
    """Whether a file that was changed, or is gone, is of ROOMS or one of their unit tests."""
    path = root / name
    if name.startswith("tests/unit/") and path.is_file():
        return any(word in path.read_text("utf-8", errors="replace") for word in OF_UNITS)
    return name.startswith(ROOMS)


def git(root: Path, *words: str) -> str:
    done = subprocess.run(["git", "-C", str(root), *words], check=True, capture_output=True, text=True)
    return done.stdout.strip()


def main() -> int:
    reason = why(Path(__file__).resolve().parent.parent, os.environ.get("HOPFORM_BASE", ""))
    print(reason or "nothing that the long stages test has changed")
    return 0 if reason else 1


if __name__ == "__main__":
    sys.exit(main())
