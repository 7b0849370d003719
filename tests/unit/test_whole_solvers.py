"""A solver is complete or not there: whatever is cut short is refused in one line before any of it is run, and whenever
a build is killed the next one succeeds.
"""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import count
from pathlib import Path

import pytest

import hopform
from derive import solver as solvers
from hopform import _building as building
from hopform import _front as cli
from hopform._solver import build
from hopform._solver.choice import SOLVERS
from hopform._solver.folder import folder_at
from tests import needs
from tests.derived import MODELS, SHIPPED, built, model_file

NONE = {"ground", "hardening", "undeclared"}
"""Files of tests/models that are refused as models."""
EVERY = {path.stem for folder in (SHIPPED, MODELS) for path in folder.glob("[!_]*.py")} - NONE
pytestmark = needs.library


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch) -> Path:
    """The cache of solvers of a user who has built none."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "hopform" / "solvers"


# ---- what is cut short ----

TRY = """
import shutil, sys
from pathlib import Path
import hopform
from hopform._solver.choice import SOLVERS
whole, copy = map(Path, sys.argv[1:])
shutil.copytree(whole, copy)
def tried():
    SOLVERS.clear()
    solver = hopform.load_solver(copy)
    if (why := solver.library_message()) is not None:
        raise hopform.HopformError(why)
    return solver.solve_motion(solver.load_robot(copy / "robot.toml"), horizon=0.01).explain()
tried()
files = ["solver.toml", "MANIFEST", *sorted(str(each.relative_to(copy)) for each in copy.glob("python/*/*.py"))]
for name in (*files, *(each.name for each in copy.glob("libhopform*"))):
    content = (copy / name).read_bytes()
    cuts = {0: b"", 1: content[:-1], 2: content[: len(content) // 2], 3: content[:5000], 4: None,
            5: content[: len(content) // 3] + bytes(64) + content[len(content) // 3 + 64 :]}
    for cut in cuts.values():
        (copy / name).unlink()
        if cut is not None:
            (copy / name).write_bytes(cut)
        try:
            tried()
            print(name, "loaded", cut == content or None)
        except hopform.HopformError as error:
            print(name, "refused", len(str(error).splitlines()) == 1)
        (copy / name).unlink(missing_ok=True)
        (copy / name).write_bytes(content)
tried()
"""


@pytest.mark.parametrize(
    "name", needs.the_first(sorted(EVERY, key=lambda name: (name not in ("joint", "stranger"), name)))
)
def test_a_solver_of_which_a_file_is_cut_short_damaged_or_missing_is_one_line(store, tmp_path, name):
    """In a process of its own: half a library, where it is loaded, ends the process by a signal."""
    command = [sys.executable, "-c", TRY, str(built(store, model_file(name))), str(tmp_path / "copy")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | {"CC": "/no/compiler"})
    assert (done.returncode, done.stderr) == (0, "")
    said = [line.split() for line in done.stdout.splitlines()]
    assert len(said) > 60 and {each[0] for each in said} >= {"solver.toml", "MANIFEST", "libhopform.sha256"}
    assert [each for each in said if each[1:] not in (["refused", "True"], ["loaded", "True"])] == []


# ---- what is killed ----


class Killed(BaseException):
    """As by SIGKILL: nothing is cleaned up behind it."""


EVERY_CHANGE = ("replace", "rename", "unlink", "mkdir", "rmdir")


@contextmanager
def killed_at(step: int, monkeypatch) -> Iterator[list[str]]:
    """The process ends at a change of the file system, counted from 1; the changes that were made."""
    with monkeypatch.context() as patched, changes_until(step, patched, Killed) as done:
        patched.setattr(shutil, "rmtree", lambda *_, **__: None)
        yield done


@contextmanager
def changes_until(step: int, monkeypatch, how, names=EVERY_CHANGE) -> Iterator[list[str]]:
    """An exception at a change of the file system and at all later ones, or if it is an interrupt at that one alone."""
    done = list[str]()

    def counted(name):
        change = getattr(os, name)

        def one(*given, **named):
            if len(done) + 1 == step or (len(done) + 1 > step and how is Killed):
                if how is not Killed:
                    done.append(name)
                raise how
            done.append(name)
            return change(*given, **named)

        return one

    with monkeypatch.context() as patched:
        for name in names:
            patched.setattr(os, name, counted(name))
        yield done


@pytest.fixture
def quick(store, monkeypatch):
    """A build takes the texts of a solver that was built, with a title, and its library."""
    whole = built(store, "joint")
    texts = {each.relative_to(whole): each for each in whole.rglob("*") if each.is_file()}
    texts = {path: each.read_text("utf-8") for path, each in texts.items()
             if not path.name.startswith(("libhopform", "MANIFEST")) and "__pycache__" not in path.parts}  # fmt: skip
    title = ["first"]

    def compiled(folder, output, progress=None):
        """By the sources of the folder, of which the title is one: the library names their hash."""
        source = build.source_of(whole).encode(), build.source_of(folder).encode()
        for each in (build.with_notes, lambda path: path):
            made = each(folder_at(whole).library).read_bytes().replace(*source)
            each(output).write_bytes(made)
        if hasattr(build, "sealed"):
            build.sealed(output)

    def solver(model, *_):
        facts = texts[Path("solver.toml")]
        return texts | {Path("solver.toml"): facts.replace('title = "', f'title = "{title[0]}: ', 1)}

    monkeypatch.setattr(solvers, "solver", solver)
    monkeypatch.setattr(build, "compile_solver", compiled)
    monkeypatch.setattr(building, "hash_of", lambda text: title[0])
    return title


@pytest.fixture
def title_of(tmp_path, monkeypatch):
    """By which build a folder solves; why it does not. A copy is loaded: by one path a process loads one library."""
    monkeypatch.setattr("hopform._solver.loading.SOLVERS", known := dict(SOLVERS))
    copies = (tmp_path / f"copy_{n}" for n in count())

    def title(folder: Path) -> str:
        known.clear()
        if not folder.is_dir():
            return "refused: it is not there"
        copy = shutil.copytree(folder, next(copies), ignore=shutil.ignore_patterns("packages"))
        try:
            solver = hopform.load_solver(copy)
            if (why := solver.library_message()) is not None:
                raise hopform.HopformError(why)
        except hopform.HopformError as error:
            assert len(str(error).splitlines()) == 1
            return f"refused: {error}"
        assert solver.solve_motion(solver.load_robot("joint"), horizon=0.01).status == "rest"
        return solver.title.partition(":")[0]

    return title


def steps_of(many: int) -> list[int]:
    """Where builds are killed: at the first changes, in the middle, and at the last ones."""
    return sorted({1, 2, many // 2, *range(many - 6, many + 1)})


@pytest.mark.parametrize("where", needs.the_first(["folder of before", "new folder", "cache"], 0))
def test_a_build_that_is_killed_at_any_change_leaves_a_whole_solver_or_none(
    title_of, quick, cache, tmp_path, monkeypatch, capsys, where
):
    """And the next build succeeds, of the same model or of another one."""
    out = [] if where == "cache" else ["--out", str(tmp_path / "out")]

    def make(title: str) -> int:
        quick[0] = title
        code = cli.main(["model", "build", str(MODELS / "joint.py"), *out])
        capsys.readouterr()
        return code

    def begin() -> None:
        shutil.rmtree(tmp_path / "out", ignore_errors=True)
        shutil.rmtree(tmp_path / "cache", ignore_errors=True)
        if where == "folder of before":
            assert make("first") == 0
            (tmp_path / "out" / "mine.txt").write_text("years of work")

    folder = {"cache": cache / "second"}.get(where, tmp_path / "out")
    begin()
    with killed_at(10**9, monkeypatch) as done:
        assert make("second") == 0
    for step in steps_of(len(done)):
        begin()
        with killed_at(step, monkeypatch), pytest.raises(Killed):
            make("second")
        found = title_of(folder)
        assert found.partition(":")[0] in ("refused", "second", *(["first"] if where == "folder of before" else [])), (
            step
        )
        again = "third" if step % 2 else "second"
        assert make(again) == 0, step
        assert title_of(cache / again if where == "cache" else folder) == again, step
        if where == "folder of before":
            assert (tmp_path / "out" / "mine.txt").read_text() == "years of work"


@pytest.mark.parametrize("where", ["new folder", "cache"])
def test_a_build_that_is_interrupted_at_any_change_leaves_a_whole_solver_or_nothing(
    quick, cache, tmp_path, monkeypatch, capsys, where
):
    """By Ctrl-C: no line, 130, and none of what it built aside; what comes before the cleaning up is interrupted."""
    out = [] if where == "cache" else ["--out", str(tmp_path / "out")]
    line, folder = ["model", "build", str(MODELS / "joint.py"), *out], tmp_path / "out" if out else cache / "first"
    before = ("replace", "rename", "mkdir")

    def begin() -> None:
        for each in (tmp_path / "out", tmp_path / "cache"):
            shutil.rmtree(each, ignore_errors=True)
        cache.mkdir(parents=True)

    begin()
    with changes_until(10**9, monkeypatch, KeyboardInterrupt, before) as done:
        assert cli.main(line) == 0
    for step in steps_of(len(done)):
        begin()
        capsys.readouterr()
        with changes_until(step, monkeypatch, KeyboardInterrupt, before):
            assert cli.main(line) == 130, step
        out, err = capsys.readouterr()
        assert out == "" and all(line.startswith("hopform: compiling ") for line in err.splitlines()), step
        assert list(tmp_path.rglob(f"{build.ASIDE}*")) == [], step
        assert not folder.exists() or building.is_whole(folder), step


def test_an_interrupt_while_the_derivation_is_loaded_loads_nothing_more(monkeypatch, capsys):
    """Half of sympy, once more imported, ends in a traceback of its own."""
    loaded = list[str]()

    def part(name: str):
        loaded.append(name)
        raise KeyboardInterrupt

    monkeypatch.setattr(building.door, "part", part)
    assert cli.main(["model", "check", "joint"]) == 130
    assert loaded == ["derivation"] and capsys.readouterr() == ("", "")


@pytest.mark.parametrize("damage", ["empty", "facts", "package", "library"])
def test_what_is_not_whole_in_the_cache_is_built_once_more(title_of, quick, cache, capsys, damage):
    def make() -> str:
        assert cli.main(["model", "build", str(MODELS / "joint.py")]) == 0
        return capsys.readouterr().out

    folder = cache / "first"
    if damage == "empty":
        folder.mkdir(parents=True)
    else:
        make()
        files = {"facts": "solver.toml", "package": "python/hopform_solver/formulas.py", "library": "libhopform.so"}
        file = folder / files[damage]
        file.write_bytes(file.read_bytes()[:-100])
    assert "is built in" in make() and title_of(folder) == "first"
    assert "was built before" in make() and [path.name for path in cache.iterdir()] == ["first"]


def test_what_killed_builds_left_goes_at_the_next_build_a_day_later(quick, cache, capsys):
    for name in ("of_today", "of_yesterday"):
        (cache / f"{build.ASIDE}{name}" / "solver").mkdir(parents=True)
    os.utime(cache / f"{build.ASIDE}of_yesterday", 2 * (time.time() - 90_000.0,))
    assert cli.main(["model", "build", str(MODELS / "joint.py")]) == 0
    assert sorted(path.name for path in cache.iterdir()) == [f"{build.ASIDE}of_today", "first"]


def test_a_cache_that_cannot_be_written_says_where_else_a_solver_can_be_built(cache, capsys):
    cache.parent.parent.mkdir()
    cache.parent.write_text("a file")
    assert cli.main(["model", "build", "joint"]) == 2
    assert "; --out DIR builds it elsewhere" in capsys.readouterr().err
