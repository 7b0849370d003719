"""No line of a source is wider than a page."""

import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
WIDEST = 120
SUFFIXES = {".py", ".c", ".h", ".inc", ".cpp", ".sh", ".toml", ".j2"}
NAMES = {"Makefile", ".ci/run"}
MADE = ("generated/", "docs/")


def sources() -> list[str]:
    """The tracked sources, by their paths from the root."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    return [
        name
        for name in listed.split("\0")
        if (Path(name).suffix in SUFFIXES or name in NAMES) and not name.startswith(MADE)
    ]


def test_no_line_of_a_source_is_wider_than_120_columns():
    found = [name for name in sources() if (ROOT / name).is_file()]
    assert len(found) > 100
    wide = [
        f"{name}, line {number}: {len(line)} columns"
        for name in found
        for number, line in enumerate((ROOT / name).read_text("utf-8").splitlines(), 1)
        if len(line) > WIDEST
    ]
    assert not wide, "\n".join(wide)
