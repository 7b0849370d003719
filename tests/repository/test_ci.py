"""What .ci/run leaves out where a change cannot concern it, and what it never leaves out."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tools.long_stages import ROOMS, why
from tools.rooms import FOLDERS, STANDS_ON, Suite, concerned, room_of
from tools.slices import chosen, of_checkout, slices

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="git is absent (on Debian: apt install git)")


def git(root: Path, *words: str, date: str = "2026-01-01T00:00:00") -> str:
    who = {"GIT_AUTHOR_NAME": "a", "GIT_AUTHOR_EMAIL": "a@b", "GIT_COMMITTER_NAME": "a", "GIT_COMMITTER_EMAIL": "a@b"}
    when = {"GIT_AUTHOR_DATE": date, "GIT_COMMITTER_DATE": date}
    done = subprocess.run(
        ["git", *words], cwd=root, check=True, capture_output=True, text=True, env={**os.environ, **who, **when}
    )
    return done.stdout.strip()


def change(root: Path, name: str, text: str = "x\n", date: str = "2099-01-01T00:00:00") -> str:
    """A commit that writes a file; its hash."""
    (root / name).parent.mkdir(parents=True, exist_ok=True)
    (root / name).write_text(text, "utf-8")
    git(root, "add", "-A")
    git(root, "commit", "-qm", name, date=date)
    return git(root, "rev-parse", "HEAD")


@pytest.fixture
def repository(tmp_path) -> Path:
    """One with a commit that is older than a day."""
    git(tmp_path, "init", "-q")
    change(tmp_path, "README.md", date="2026-01-01T00:00:00")
    return tmp_path


def test_a_change_of_the_runtime_or_of_pages_needs_no_long_stage(repository):
    change(repository, "runtime/hopform/hopping/terrain.py")
    change(repository, "docs/README.md")
    change(repository, "tests/unit/test_terrain.py", "import hopform\n")
    assert why(repository) is None


@pytest.mark.parametrize("room", ROOMS)
def test_a_change_of_what_the_long_stages_test_needs_them(repository, room):
    name = f"{room}a.c" if room.endswith("/") else room
    change(repository, name)
    change(repository, "docs/README.md")
    assert str(why(repository)).startswith(f"{name} differs from ")


def test_a_file_that_is_deleted_or_not_committed_counts(repository):
    change(repository, "derive/a.py", date="2026-01-02T00:00:00")
    git(repository, "rm", "-q", "derive/a.py")
    git(repository, "commit", "-qm", "gone", date="2099-01-01T00:00:00")
    assert "derive/a.py" in str(why(repository))
    change(repository, "README.md", "y\n")
    (repository / "README.md").write_text("z\n", "utf-8")
    assert why(repository, "HEAD~1") is None
    (repository / "derive").mkdir()
    (repository / "derive" / "b.py").write_text("", "utf-8")
    git(repository, "add", "-A")
    assert "derive/b.py" in str(why(repository, "HEAD~1"))


def test_a_unit_test_of_the_derivation_counts_as_the_derivation(repository):
    change(repository, "tests/unit/test_a.py", "from derive.emit import ir\n")
    assert "tests/unit/test_a.py" in str(why(repository))


def test_a_base_that_is_named_is_compared_with(repository):
    base = change(repository, "derive/a.py")
    change(repository, "docs/a.md")
    assert why(repository, base) is None
    assert "derive/a.py" in str(why(repository, f"{base}~1"))


def test_without_a_base_everything_runs(repository, tmp_path_factory):
    head = git(repository, "rev-parse", "HEAD")
    assert why(repository, head) == why(repository) == "the base is HEAD itself"
    assert why(repository, "0" * 40) == f"the base {'0' * 40} is unknown"
    change(repository, "docs/a.md")
    shallow = tmp_path_factory.mktemp("shallow")
    git(shallow, "clone", "-q", "--depth", "1", f"file://{repository}", ".")
    assert why(shallow) == "the history is cut off"
    young = tmp_path_factory.mktemp("young")
    git(young, "init", "-q")
    change(young, "docs/a.md")
    assert why(young) == "no commit is 24 hours old"
    assert why(tmp_path_factory.mktemp("none")) == "the base of 24 hours ago is unknown"


def test_every_stage_has_a_target_of_make_and_packages_are_installed_nowhere_else():
    script = (ROOT / ".ci" / "run").read_text("utf-8")
    makefile = (ROOT / "Makefile").read_text("utf-8")
    targets = re.findall(r"^ *(?:stage|in_time \d+|long \d+) \S+ (?:env \S+ )?make ([\w-]+)", script, re.MULTILINE)
    assert len(targets) > 10
    assert [target for target in targets if not re.search(rf"^{target}:", makefile, re.MULTILINE)] == []
    others = [path for folder in ("tools", "tests") for path in (ROOT / folder).rglob("*.sh")]
    assert [path for path in [ROOT / "Makefile", *others] if "apt-get" in path.read_text("utf-8")] == []


@pytest.mark.parametrize(
    ("minutes", "of_tests", "more", "begins"),
    [(19, 5, "", True), (19, 10, "", False), (22, 5, "", False), (22, 5, "HOPFORM_ALL=1", True)],
)
def test_a_stage_begins_if_it_is_likely_to_end_in_time(tmp_path, minutes, of_tests, more, begins):
    """One of 140 % of the time of `make test`, in minutes, so many minutes after the beginning."""
    script = (ROOT / ".ci" / "run").read_text("utf-8")
    functions = script[script.index("row() {") : script.index("install_packages() {")]
    line = f"BUDGET=30 stages={tmp_path}/stages {more}; SECONDS={60 * minutes} of_tests={60 * of_tests} needed=1"
    done = subprocess.run(
        ["bash", "-c", f"{line}\n{functions}\nlong 140 slices echo it runs"], capture_output=True, text=True, check=True
    )
    assert ("it runs" in done.stdout.splitlines()) == begins
    assert ("left out: no time is left" in done.stdout) != begins


@pytest.fixture(scope="module")
def here() -> Suite:
    """The tests of this checkout, each of which is read once."""
    suite = Suite(ROOT)
    assert all(map(suite.stands_on, suite.files))
    return suite


def named(files: list[Path]) -> set[str]:
    return {path.name for path in files}


def test_an_arrow_is_the_only_way():
    assert {*FOLDERS.values()} == {*STANDS_ON}
    assert concerned(["engine"]) == {"engine", "generated", "core", "hopping", "identify"}
    assert concerned(["derive"]) == {"derive", "generated", "core", "hopping", "identify"}
    assert concerned(["core"]) == {"core", "hopping", "identify"}
    assert all(concerned([room]) == {room} for room in ("hopping", "identify", "pages"))
    assert room_of("runtime/hopform/_motion.py") == "core" and room_of("README.md") == "pages"
    assert room_of("pyproject.toml") is room_of("tests/fits.py") is None


@pytest.mark.parametrize("name", ["runtime/hopform/hopping/terrain.py", "runtime/hopform/identify/_fits.py"])
def test_a_change_of_an_application_runs_its_slower_tests_alone(here, name):
    files, reason = chosen(here, [name])
    room = str(room_of(name))
    assert files == [path for path in slices(here) if room in here.rooms(path)]
    assert 5 < len(files) < len(slices(here)) - 5
    assert reason == (
        f"{room} changed: {len(files)} files of slower tests, {len(slices(here)) - len(files)} are left out"
    )


def test_whose_slower_tests_a_change_of_an_application_leaves_out(here):
    hopping, _ = chosen(here, ["runtime/hopform/hopping/terrain.py"])
    identify, _ = chosen(here, ["runtime/hopform/identify/_fits.py"])
    assert "test_hops.py" in named(hopping) - named(identify)
    assert {"test_estimation.py", "test_repeats.py", "test_outliers.py"} <= named(identify) - named(hopping)
    assert not {"test_stance.py", "test_checker.py", "test_c_programs.py"} & (named(hopping) | named(identify))


@pytest.mark.parametrize("name", ["derive/ir.py", "runtime/engine/c/a.h", "runtime/hopform/_motion.py", "Makefile"])
def test_a_change_of_what_the_rooms_stand_on_runs_all_slower_tests(here, name):
    files, reason = chosen(here, [name])
    assert files == slices(here)
    assert ("Makefile concerns every room" in reason) == (name == "Makefile")


@pytest.mark.parametrize("name", ["docs/how-to/many-stances.md", "README.md", "docs/play/play.js"])
def test_a_change_of_pages_runs_the_slower_tests_of_pages_alone(here, name):
    files, _ = chosen(here, [name])
    assert files == [path for path in slices(here) if "pages" in here.rooms(path)]
    assert {"test_pages.py", "test_notebooks.py", "test_user_script.py"} <= named(files)
    assert not {"test_hops.py", "test_estimation.py", "test_stance.py"} & named(files)


def test_a_change_of_tests_runs_the_slower_tests_that_use_what_changed(here):
    assert named(chosen(here, ["tests/unit/test_grid.py"])[0]) == {"test_grid.py"}
    assert named(chosen(here, ["tests/unit/test_hopping.py"])[0]) == set()  # it has none, and none uses it
    assert "test_repeats.py" in (of := named(chosen(here, ["tests/fits.py"])[0])) and "test_grid.py" not in of
    assert "test_c_programs.py" in (of := named(chosen(here, ["tests/conformance/batches.c"])[0]))
    assert "test_grid.py" not in of
    assert all(chosen(here, [f"tests/{name}.py"])[0] == slices(here) for name in ("conftest", "rings", "seeds"))


def test_each_file_of_slower_tests_tests_a_room(here):
    assert [path for path in slices(here) if not here.rooms(path)] == []


@pytest.fixture
def rooms(repository) -> Path:
    """A repository with a test file for each way in which one reaches a room, all of them with slower tests."""
    texts = {
        "runtime/hopform/_front.py": 'COMMANDS = {"stance": "_cli.solve", "hop": "hopping._commands"}\n',
        "docs/tour.md": "`hopform hop` walks.\n",
        "tests/conftest.py": "import pytest\n",
        "tests/helper.py": "from hopform.identify import fit_robot\n",
        "tests/test_import.py": "from hopform import hopping\nfrom tests.needs import sliced\n",
        "tests/test_attribute.py": "import hopform\nfrom tests.needs import sliced\nhopform.hopping.simulate\n",
        "tests/test_command.py": 'from tests.needs import sliced\nrun("hop --height 0.2")\n',
        "tests/test_page.py": 'from tests.needs import sliced\nread("docs/tour.md")\n',
        "tests/test_helper.py": "from tests import helper\nfrom tests.needs import sliced\n",
        "tests/test_prose.py": '"""It does not hop here."""\nimport hopform\nfrom tests.needs import sliced\n',
        "tests/test_quick.py": "from hopform import hopping\n",
    }
    for name, text in texts.items():
        change(repository, name, text, date="2026-01-02T00:00:00")
    return repository


@pytest.mark.parametrize(
    ("name", "files"),
    [
        ("runtime/hopform/hopping/a.py", {"import", "attribute", "command", "page"}),
        ("runtime/hopform/identify/a.py", {"helper"}),
        ("runtime/hopform/_a.py", {"import", "attribute", "command", "page", "helper", "prose"}),
        ("docs/tour.md", {"page"}),
        ("tests/helper.py", {"helper"}),
        ("tests/test_quick.py", set()),
    ],
)
def test_a_test_file_tests_what_it_imports_runs_or_reads(rooms, name, files):
    change(rooms, name)
    assert named(of_checkout(rooms)[0]) == {f"test_{each}.py" for each in files}


def test_without_a_base_or_where_all_are_wanted_no_slower_test_is_left_out(rooms):
    every = slices(Suite(rooms))
    assert len(every) == 6
    assert of_checkout(rooms) == (every, "all 6 files of slower tests: the base is HEAD itself")
    assert of_checkout(rooms, "0" * 40)[0] == every
    change(rooms, "docs/tour.md")
    assert len(of_checkout(rooms)[0]) == 1
    assert of_checkout(rooms, everything=True) == (every, "all 6 files of slower tests: HOPFORM_ALL is set")


def test_a_pull_request_runs_the_slower_tests_that_are_named_and_the_night_all():
    script = (ROOT / ".ci" / "run").read_text("utf-8")
    assert "files=$(python3 -m tools.slices)" in script and 'make test-slices SLICES="$files"' in script
    makefile = (ROOT / "Makefile").read_text("utf-8")
    nightly = makefile[makefile.index("nightly: ##") : makefile.index("\nSLOW =")]
    assert "test-slices" in nightly and "SLICES" not in nightly


def test_tests_run_with_the_library_of_this_checkout():
    """A checkout that was updated has the library of before, which is refused: what runs tests makes it first."""
    makefile = (ROOT / "Makefile").read_text("utf-8")
    recipes = re.findall(r"^([\w-]+):([^\n#=]*)[^\n]*\n((?:\t[^\n]*\n)+)", makefile, re.MULTILINE)
    builds = {name for name, _, lines in recipes if "tools/build_library.py" in lines}
    runs = {
        name: (set(needs.split()), lines)
        for name, needs, lines in recipes
        if re.search("python -m pytest|PY\\) -m pytest", lines)
    }
    assert {"test", "precheck", "test-slices", "wheel", "site-test"} <= runs.keys()
    for name, (needs, lines) in runs.items():
        assert lines.find("tools/build_library.py") in range(lines.index("-m pytest")) or needs & builds, name
        assert needs & ({"compiler"} | builds), name
