"""`tools/venv.sh` with a Python that only notes what it is asked for: what is installed, in which order, and when not."""

import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FIND = "#!/bin/sh\necho tools/python.sh\n"
PYTHON = """#!/bin/sh
echo "$@" >>asked
case "$*" in
"-m venv"*) mkdir -p .venv/bin && cp tools/python.sh .venv/bin/python ;;
"-m pip install --help") echo "{help}" ;;
esac
"""


@pytest.fixture
def checkout(tmp_path):
    """A checkout without anything but the script; set up for `names`, it gives what pip was asked to install."""
    (tmp_path / "tools").mkdir()
    (tmp_path / "pyproject.toml").write_text("", "utf-8")
    (tmp_path / "tools" / "venv.sh").write_text((ROOT / "tools" / "venv.sh").read_text("utf-8"), "utf-8")
    (tmp_path / "tools" / "find_python.sh").write_text(FIND, "utf-8")

    def set_up(name, help_of_pip="--group"):
        python = tmp_path / "tools" / "python.sh"
        python.write_text(PYTHON.format(help=help_of_pip), "utf-8")
        python.chmod(0o755)
        (tmp_path / "asked").write_text("", "utf-8")
        subprocess.run(["sh", "tools/venv.sh", name], cwd=tmp_path, check=True, capture_output=True)
        asked = (tmp_path / "asked").read_text("utf-8").splitlines()
        made = any("venv --clear" in line for line in asked)
        installed = [re.sub(r"^-m pip install --quiet --disable-pip-version-check ", "", line) for line in asked]
        return made, [line for line in installed if not line.startswith("-m ")]

    set_up.folder = tmp_path
    return set_up


RUN = "--editable .[derive,identify,plot]"
DEV = ["--group dev", "--no-deps universalmutator==1.14.1"]


def test_the_site_is_built_without_tools_of_tests_and_without_installing_this_checkout_again(checkout):
    assert checkout("run") == (True, [RUN])
    assert checkout("docs") == (False, ["--group docs"])
    assert checkout("docs") == (False, [])
    assert checkout("zig") == (False, ["--group zig"])
    assert checkout("zig") == (False, [])


def test_what_holds_another_stands_for_it(checkout):
    assert checkout("dev") == (True, [RUN, *DEV])
    for name in ("run", "dev"):
        assert checkout(name) == (False, [])
    assert checkout("site") == (False, ["--group site", *DEV[1:]])
    for name in ("docs", "dev", "run", "site"):
        assert checkout(name) == (False, [])
    assert checkout("docs") == (False, [])


def test_an_old_pip_is_renewed_first(checkout):
    assert checkout("docs", help_of_pip="--user") == (True, [RUN, "pip>=25.1", "--group docs"])


def test_another_pyproject_is_installed_again_and_another_folder_made_anew(checkout, tmp_path):
    checkout("dev")
    (tmp_path / "pyproject.toml").write_text("# changed", "utf-8")
    assert checkout("dev") == (False, [RUN, *DEV])
    assert checkout("run") == (False, [])
    for stamp in (tmp_path / ".venv").glob("with-*"):
        stamp.write_text("/elsewhere 1 2", "utf-8")
    assert checkout("run") == (True, [RUN])
