"""What .ci/run leaves out where a change cannot concern it, and what it never leaves out."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tools.long_stages import ROOMS, why

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
