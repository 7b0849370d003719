"""What several tests need and one makes: objects and libraries, compiled once per command and run of the tests."""

import fcntl
import hashlib
import os
import shlex
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

from tests.conformance.firmware.targets import C
from tests.rings import made_for_all, processor_seconds

SHARED = ("-std=c99", "-O0", "-ffp-contract=off", "-fPIC", "-shared")


def once(made: Path, make: Callable[[Path], object]) -> Path:
    """A file or folder that one process of the run makes while the others wait.

    It is made aside and renamed: nobody sees half of it, and what failed is made again by the next one.
    """
    with made.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not made.exists():
            aside, before = made.with_name(f"{made.stem}.{os.getpid()}.tmp"), processor_seconds()
            make(aside)
            aside.replace(made)
            made_for_all.append(processor_seconds() - before)
    return made


def key(*parts: object) -> str:
    """A word for what something is made of."""
    return hashlib.sha256("\0".join(map(str, parts)).encode()).hexdigest()[:16]


def run_compiler(*command: str | Path) -> None:
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def compiled(store: Path, command: tuple[str, ...], source: Path) -> Path:
    """The object of a source of generated/c, in a folder that all processes of the run share."""
    whole = [*command, "-I", str(C / "include"), "-c", str(source)]
    return once(store / f"{source.stem}_{key(*whole)}.o", lambda aside: run_compiler(*whole, "-o", aside))


def shared_library(store: Path, name: str, sources: Sequence[Path], *flags: str) -> Path:
    """A library of some sources beside those of generated/c, whose headers they may include."""
    compiler = shlex.split(os.environ.get("CC") or "cc")
    include = ("-I", C / "include", "-I", C / "src")
    whole = [*compiler, *SHARED, *flags, *include, *sources]
    return once(store / f"{name}_{key(*whole)}.so", lambda aside: run_compiler(*whole, "-o", aside, "-lm"))
