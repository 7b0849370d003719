"""Any command line: an answer (0), or one line on the error stream (2); no traceback, and no file lost."""

import contextlib
import io
import os
import stat
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hopform import _front as cli
from hopform.identify import _commands as identify_command
from hopform.identify._joint import fit_robot
from tests.calls import DECAY, HOPPER
from tests.outside import command_lines, examples, furnish

COMMANDS = cli.commands()
QUICK = {name: each for name, each in COMMANDS.items() if name not in ("fit", "identify", "selftest")}
"""Commands that take no second in a process of their own."""


@pytest.fixture(scope="module", autouse=True)
def quick_answers():
    """One fit and one picture for all: what is tried is what stands around them."""
    fit = fit_robot(decays=DECAY, holdout=False, compare=False)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(identify_command, "fit", lambda *_, **__: fit)
        patch.setattr("hopform.identify._fit_command.fit_force", lambda *_, **__: replace(fit, base=HOPPER))
        patch.setattr("hopform.identify._models.fit_model", lambda *_, **__: replace(fit, base=HOPPER))
        patch.setattr("hopform._figures.plots.render", lambda figure, suffix: b"<svg>new</svg>")
        yield


def snapshot(folder):
    """Everything in a folder: what it is, its mode, and what is in it or where it leads."""
    found = {}
    for path in sorted(folder.rglob("*")):
        status = path.lstat()
        kind = stat.S_IFMT(status.st_mode)
        inside = path.read_bytes() if kind == stat.S_IFREG else os.readlink(path) if kind == stat.S_IFLNK else b""
        found[str(path.relative_to(folder))] = (kind, stat.S_IMODE(status.st_mode), inside)
    return found


def named_outputs(line, folder):
    """Where the outputs of a command line lead."""
    after = {"--csv", "--hops-csv", "--npz", "--plot", "--report", "--out"}
    names = [value for option, value in zip(line, line[1:], strict=False) if option in after]
    reports = [f"{name.removesuffix('.md')}.svg" for name in names]
    return {os.path.realpath(folder / name) for name in (*names, *reports) if "\0" not in name and len(name) < 4096}


def check(code, output, errors, before, after, line, folder):
    assert code in (0, 2), (code, errors[-2000:])
    assert "Traceback" not in errors
    lines = errors.splitlines()
    if code == 2:
        assert len(lines) == 1 and lines[0].startswith("hopform: ") and len(errors) < 2200 and output == ""
        assert after == before
    else:
        assert all(each.startswith("hopform: warning: ") for each in lines), errors
    if line[:1] != ["export"]:
        outputs = named_outputs(line, folder)
        changed = [name for name in before if before[name] != after.get(name)]
        assert all(os.path.realpath(folder / name) in outputs for name in changed), changed
        assert all(before[name][1] == after[name][1] for name in changed if before[name][0] == after[name][0])
    assert not [name for name in after if ".hopform-" in name]


def in_a_folder(line, run):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "inner"
        folder.mkdir()
        furnish(folder)
        before = snapshot(folder)
        code, output, errors = run(line, folder)
        check(code, output, errors, before, snapshot(folder), line, folder)


@given(st.data())
@examples(75)
def test_any_command_line_is_answered_or_refused(data):
    in_a_folder(data.draw(command_lines(COMMANDS)), in_process)


def in_process(line, folder):
    """The exit code, and what is printed on both streams."""
    output, errors = io.StringIO(), io.StringIO()
    here = Path.cwd()
    os.chdir(folder)
    try:
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            code = cli.main(line)
    finally:
        os.chdir(here)
    return code, output.getvalue(), errors.getvalue()


def in_a_process(line, folder):
    command = [sys.executable, "-m", "hopform", *line]
    done = subprocess.run(command, cwd=folder, capture_output=True, timeout=120, check=False)
    return done.returncode, done.stdout.decode(errors="replace"), done.stderr.decode(errors="replace")


@pytest.mark.nightly
def test_the_same_in_processes_of_their_own():
    """As many as processors at a time; what leaves an interpreter is seen here alone, a second exception among it."""
    lines = list[list[str]]()

    @given(command_lines(QUICK))
    @examples(50)
    def collect(line):
        if not any("\0" in each for each in line):  # which no process can be handed
            lines.append(line)

    collect()
    assert len(lines) > 40
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(lambda line: in_a_folder(line, in_a_process), lines))
