"""Which files of slower tests a change concerns: `python -m tools.slices` prints them, and why on the error stream.

Those that test a room that differs from a base, or a room that stands on it, and those that are changed themselves or
by a helper or a file that they use. All of them where no base is known, with $HOPFORM_ALL set, or where a file differs
that all rooms share. tools/rooms.py has the base and the rooms.
"""

import os
import sys
from pathlib import Path

from tools.rooms import NoBase, Suite, changed, concerned, room_of, source_of

MARKS = {"sliced", "the_first"}
"""What makes a test a slower one: the marker, or tests/needs.py for some of its parameters."""


def slices(suite: Suite) -> list[Path]:
    """The test files that have slower tests; tests/repository/test_package.py has a stage of its own."""
    return [path for path in suite.files if source_of(path).names & MARKS and path.name != "test_package.py"]


def chosen(suite: Suite, names: list[str]) -> tuple[list[Path], str]:
    """The files of slower tests that a change of the files of these names concerns, and why, in a line."""
    every = slices(suite)
    shared = [name for name in names if not name.startswith("tests/") and room_of(name) is None]
    if shared:
        return every, f"all {len(every)} files of slower tests: {shared[0]} concerns every room"
    rooms = {room for name in names if (room := room_of(name))}
    affected = concerned(rooms)
    of_tests = [name for name in names if name.startswith("tests/")]
    files = [
        path for path in every if suite.rooms(path) & affected or any(suite.touched_by(name, path) for name in of_tests)
    ]
    differ = ", ".join([*sorted(rooms), *(["tests"] if of_tests else [])]) or "nothing"
    above = ", ".join(sorted(affected - rooms))
    reason = f"{differ} changed{above and f', on which stand {above}'}"
    return files, f"{reason}: {len(files)} files of slower tests, {len(every) - len(files)} are left out"


def of_checkout(root: Path, base: str = "", everything: bool = False) -> tuple[list[Path], str]:
    """The files of slower tests to run in a checkout, and why."""
    suite = Suite(root)
    try:
        if everything:
            raise NoBase("HOPFORM_ALL is set")
        return chosen(suite, changed(root, base)[1])
    except NoBase as reason:
        every = slices(suite)
        return every, f"all {len(every)} files of slower tests: {reason}"


def main() -> None:
    root = Path(__file__).resolve().parent.parent
    files, reason = of_checkout(root, os.environ.get("HOPFORM_BASE", ""), bool(os.environ.get("HOPFORM_ALL")))
    print(*(path.relative_to(root) for path in files))
    print(reason, file=sys.stderr)


if __name__ == "__main__":
    main()
