"""Copies of the project that may be broken, and tests that import them."""

import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LEFT_OUT = (".*", "__pycache__", "out", "dist", "build")
LEFT_OUT_TESTS = "not random and not page"
"""Random robots, wheels, plots and command lines take long."""
DERIVED = ("-m", "derive")
COMPILED = ("tools/build_library.py",)
TIME_LIMIT = 600
"""[s] of a processor, so that other work on the machine changes no outcome; ten times that by the clock."""
TIMED_OUT = -1


class CopyFailed(Exception):
    """Nothing to test: the unbroken copy is red, a mutant's place is not there, or nothing compiles from it."""


def copied(tree: Path) -> Path:
    """A copy of the project, derived and compiled, that its own Python imports."""
    shutil.copytree(ROOT, tree, ignore=shutil.ignore_patterns(*LEFT_OUT))
    for command in (DERIVED, COMPILED):
        run(tree, *command)
    assert_imports_the_copy(tree)
    return tree


def run(tree: Path, *command: str) -> None:
    done = python(tree, *command)
    if done.returncode != 0:
        raise CopyFailed(f"python {' '.join(command)} fails:\n{done.stdout}{done.stderr}")


def tests(tree: Path, files: tuple[str, ...], limit: int = TIME_LIMIT) -> subprocess.CompletedProcess[str]:
    present = [file for file in files if (tree / file.partition("::")[0]).is_file()]
    options = ["-x", "-q", "--tb=short", "-rfE", "-p", "no:cacheprovider", "-k", LEFT_OUT_TESTS]
    return python(tree, "-m", "pytest", *options, *present, limit=limit)


def killed_by(done: subprocess.CompletedProcess[str]) -> str | None:
    """The test that failed or could not be collected, None if all passed."""
    if done.returncode == 0:
        return None
    if done.returncode == TIMED_OUT:
        return "no answer in time"
    failed = re.findall(r"^(?:FAILED|ERROR) (?:tests/)?(.+?)(?: - .*)?$", done.stdout, flags=re.MULTILINE)
    if done.returncode not in (1, 2) or not failed:
        raise CopyFailed(f"pytest ends with {done.returncode}:\n{done.stdout}{done.stderr}")
    return str(failed[0])


def python(tree: Path, *arguments: str, limit: int = TIME_LIMIT) -> subprocess.CompletedProcess[str]:
    """This interpreter in a copy, whose packages come before those that are installed; stopped at a limit [s]."""
    paths = [str(tree / "runtime"), str(tree / "generated" / "python"), str(tree)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "PYTHONDONTWRITEBYTECODE": "1"}
    command = ["sh", "-c", f'ulimit -S -t {limit}; exec "$@"', "sh", sys.executable, *arguments]
    try:
        done = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, text=True, timeout=10 * limit, check=False
        )
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, TIMED_OUT, "", "")
    if done.returncode == -signal.SIGXCPU:
        done.returncode = TIMED_OUT
    return done


def assert_imports_the_copy(tree: Path) -> None:
    """Else every mutant would survive, or be killed, for nothing."""
    where = (
        "import derive, hopform, hopform_solver as s; print(derive.__file__, hopform.__file__, s.__file__, sep='\\n')"
    )
    files = python(tree, "-c", where).stdout.splitlines()
    if len(files) != 3 or not all(Path(file).resolve().is_relative_to(tree.resolve()) for file in files):
        raise CopyFailed(f"the copy in {tree} is not what is imported: {files}")
