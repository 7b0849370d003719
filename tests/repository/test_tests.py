"""The rooms of the tests: every test has one. What an oracle may import stands in pyproject.toml."""

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
