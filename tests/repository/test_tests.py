"""The rooms of the tests: every test has one, and an oracle shares nothing with what it judges."""

import ast
import sys
from collections import Counter
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
ROOMS = {"unit", "oracle", "conformance", "repository", "bench", "fuzz", "mutation"}
SHARED = {"models"}
"""Models of a user, which tests of several rooms and the README derive from."""


def test_every_test_stands_in_a_room():
    folders = {path.name for path in TESTS.iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert folders == ROOMS | SHARED
    assert not list(TESTS.glob("test_*.py"))


def test_no_two_files_of_tests_have_one_name():
    """The order in which conftest.py begins them goes by their names."""
    count = Counter(path.name for path in TESTS.rglob("test_*.py"))
    assert not [name for name, times in count.items() if times > 1]


def test_an_oracle_imports_nothing_of_what_it_judges():
    allowed = sys.stdlib_module_names | {"numpy", "scipy", "mpmath"}
    found = [path for path in (TESTS / "oracle").rglob("*.py") if not path.name.startswith("test_")]
    assert len(found) > 10
    for path in found:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                names = [str(node.module)]
            for name in names:
                assert name.split(".")[0] in allowed or name.startswith("tests.oracle"), f"{path}: {name}"
