"""Each status of the C library stands in the header, in the README's table and in Python's reasons, with one number."""

import re
from pathlib import Path

from hopform._solver import c as native

C = Path(__file__).resolve().parents[2] / "generated" / "c"
HEADER = (C / "include" / "hopform" / "hopform.h").read_text("utf-8")
README = (C / "README.md").read_text("utf-8")

MACRO = re.compile(r"^#define HOPFORM_(\w+) \(?(-?\d+)\)? */\*\*< (.+) \*/$", re.MULTILINE)
ROW = re.compile(r"^\| (-?\d+) \| `HOPFORM_(\w+)` \| (.+) \|$", re.MULTILINE)


def statuses() -> dict[str, tuple[int, str]]:
    """Number and meaning of each status, by name: the block of the header behind its comment."""
    (block,) = re.findall(r"^/\*\* Status: .*\*/\n((?:#define .*\n)+)", HEADER, re.MULTILINE)
    found = {name: (int(number), meaning) for name, number, meaning in MACRO.findall(block)}
    assert len(found) == block.count("#define ")
    return found


def test_no_status_is_defined_elsewhere_and_no_number_twice():
    known = statuses()
    assert {"OK", "PHASES_NOT_KEPT", "ERROR_NULL", "ERROR_DETECTOR", "ERROR_OVERLAP"} <= known.keys()
    errors = set(re.findall(r"^#define HOPFORM_(ERROR_\w+)", HEADER, re.MULTILINE))
    assert errors == {name for name, (number, _) in known.items() if number < 0}
    numbers = [number for number, _ in known.values()]
    assert len(numbers) == len(set(numbers))


def test_the_table_of_the_readme_lists_them_all():
    (section,) = re.findall(r"^Status: .*\n\n((?:\|.*\n)+)", README, re.MULTILINE)
    rows = {name: (int(number), meaning) for number, name, meaning in ROW.findall(section)}
    assert rows == statuses()


def test_python_has_a_reason_for_each_error_and_for_nothing_else():
    assert {number: meaning for number, meaning in statuses().values() if number < 0} == native.REFUSALS
    for number, reason in native.REFUSALS.items():
        assert str(native.refusal("stance_at", number)) == reason


def test_the_warnings_that_python_acts_on_have_the_numbers_of_the_header():
    for name in ("PHASES_NOT_KEPT", "NO_DERIVATIVE"):
        assert getattr(native, name) == statuses()[name][0]
