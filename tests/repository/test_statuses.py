"""Statuses and limits stand in the header, in Python and on the pages with the same numbers."""

import html
import re
from pathlib import Path

from derive.model.kinds import LONGEST_PREFIX, MOST_STEPS
from hopform import _batch, _checks, _files, _hops, _motion, _robots
from hopform import _building as building
from hopform import _control as reach
from hopform._cli import options
from hopform._solver import c as native
from hopform._solver.package import COLUMNS, ROWS
from hopform.hopping import _compare, terrain
from hopform.hopping import _run as run
from hopform.hopping import _touchdown as touchdown
from hopform.identify import _kinds as kinds
from hopform.identify import _synthetic as synthetic

ROOT = Path(__file__).resolve().parents[2]
C = ROOT / "generated" / "c"
HEADER = (C / "include" / "hopform" / "hopform.h").read_text("utf-8")
README = (C / "README.md").read_text("utf-8")
FMU = (ROOT / "generated" / "packages" / "fmu" / "fmi3.c").read_text("utf-8")

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
    rows = {name: (int(number), html.unescape(meaning)) for number, name, meaning in ROW.findall(section)}
    assert rows == statuses()


def test_python_has_a_reason_for_each_error_and_for_nothing_else():
    assert {number: meaning for number, meaning in statuses().values() if number < 0} == native.records.REFUSALS
    for number, reason in native.records.REFUSALS.items():
        assert str(native.refusal("stance_at", number)) == reason


def test_python_takes_every_number_of_a_status_from_the_table_of_the_header():
    """Its names and numbers are the header's; in runtime/hopform no status is a number."""
    assert {name.lower(): number for name, (number, _) in statuses().items()} == native.package.NUMBERS
    for path in sorted((ROOT / "runtime" / "hopform").rglob("*.py")):
        text = path.read_text("utf-8")
        assert not re.findall(
            r"^(?:PHASES_NOT_KEPT|NO_DERIVATIVE|\w*STATUS\w*|\w*REFUS\w*) = -?\d", text, re.MULTILINE
        ), path
        assert not re.findall(r"^ +-\d+: ['\"]|(?:REFUSALS|STATUS)\[-?\d", text, re.MULTILINE), path
        assert not re.findall(r"\bstatus (?:==|!=|<=|>=|in) \(?-?[1-9]", text), path


LIMITS = {
    "stances of a batch": _checks.MEMORY // _batch.EACH,
    "stances of a batch with derivatives": _checks.MEMORY // _batch.memory_of_each(len(ROWS), len(COLUMNS), 0, 0),
    "threads of a batch": _batch.MOST_THREADS,
    "hops of a run among many": _hops.MOST_HOPS,
    "numbers of an array": _checks.MEMORY // 8,
    "times of a grid": _checks.MEMORY // _motion.EACH,
    "times of a run": run.MOST_SAMPLES,
    "rows of a table over time": options.MOST_ROWS,
    "hops of a run": terrain.MOST_HOPS,
    "runs of a comparison": _compare.MOST_RUNS,
    "cells of a map": reach.MOST_CELLS,
    "steps of a current": MOST_STEPS,
    "ticks of a sampled law in the longest stance": run.MOST_TICKS,
    "samples that a simulated detector draws": touchdown.MOST_DRAWN,
    "samples of a synthetic recording": synthetic.MOST_SAMPLES,
    "recordings of a fit": kinds.MOST_RECORDINGS,
    "known values of a fit": kinds.MOST_KNOWN,
    "robots of a sample": _robots.MOST_SAMPLES,
    "bytes of a robot file": _robots.LARGEST_TOML,
    "bytes of a model file": building.LARGEST_MODEL,
    "bytes of any other file that is read": _files.LARGEST,
    "digits of a whole number in text": _checks.MOST_DIGITS,
    "phases in a step of an FMU": int(re.findall(r"MOST_PHASES = (\d+)", FMU)[0]),
    "characters of a prefix": LONGEST_PREFIX,
}


def test_each_limit_stands_in_the_docs_with_its_number():
    page = (C.parents[1] / "docs" / "reference" / "limits.md").read_text("utf-8")
    rows = dict(re.findall(r"^\| ([a-z].+?) \| (\d+) \|", page, re.MULTILINE))
    assert {name: int(number) for name, number in rows.items()} == LIMITS
    assert f"{_checks.LARGEST}" in page


def test_the_steps_of_a_current_are_counted_alike_in_c():
    assert re.findall(r"^#define HOPFORM_MOST_STEPS (\d+)", HEADER, re.MULTILINE) == [str(MOST_STEPS)]
