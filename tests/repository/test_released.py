"""What docs/reference/versions.md promises, against the record of the last release, tests/repository/released.json."""

import copy
import json

import pytest

from hopform_solver import VERSION
from tests.repository.released import RECORD, ROOT, found, moved, needs_a_format

RELEASED = json.loads(RECORD.read_text("utf-8"))
RENEW = "a release of another minor version takes `python -m tests.repository.released`"


def test_nothing_that_was_released_is_gone_or_another():
    assert list(moved({**RELEASED, "version": VERSION}, found())) == [], RENEW


def test_the_record_is_of_this_minor_version():
    assert RELEASED["version"].split(".")[:2] == VERSION.split(".")[:2], RENEW


def test_the_page_and_the_citation_have_this_version():
    minor = VERSION.rpartition(".")[0]
    page = (ROOT / "docs" / "reference" / "versions.md").read_text("utf-8")
    assert f"`hopform~={minor}.0`" in page and f"`find_package(hopform {minor})`" in page
    assert f"\nversion: {VERSION}\n" in (ROOT / "CITATION.cff").read_text("utf-8")
    assert f"\n## [{VERSION}] - 20" in (ROOT / "CHANGELOG.md").read_text("utf-8")


def test_the_record_has_each_language():
    assert {"solve_stance", "Stance", "hopping.controllers.Sampled", "hopping.terrain.uniform"} <= RELEASED[
        "python"
    ].keys()
    assert "hopform_solve_stance_f32" in RELEASED["c"]["functions"]
    assert RELEASED["c"]["structs"]["State"] == [f"real {name}[1]" for name in ("x1", "v1", "v2", "y")]
    assert RELEASED["json"]["hopform stance"]["properties"]["duration"] == '{"type": "number"}'
    assert RELEASED["solver.toml"]["format"] == 3


@pytest.mark.parametrize("of", ["functions", "structs"])
def test_a_solver_that_was_built_before_c_moved_has_another_format(of):
    now = copy.deepcopy(RELEASED)
    name = next(iter(now["c"][of]))
    now["c"][of][name] = "another"
    assert len(needs_a_format(RELEASED, now)) == 1
    now["solver.toml"]["format"] += 1
    assert needs_a_format(RELEASED, now) == []


@pytest.mark.parametrize(
    "path, value",
    [
        (("python", "solve_stance", "optional", "u"), None),
        (("python", "solve_stance", "needed"), ["robot", "v2", "u"]),
        (("python", "State", "members", "x2"), None),
        (("c", "functions", "hopform_selftest_f32"), None),
        (("c", "numbers", "HOPFORM_ERROR_NULL"), "(-2)"),
        (("c", "structs", "State"), ["real x1[1]", "real v1[1]", "real v2[1]", "real y[1]", "real load[1]"]),
        (("json", "hopform stance", "always", "apex"), None),
        (("json", "hopform stance", "properties", "apex"), '{"type": "string"}'),
        (("solver.toml", "format"), 4),
    ],
)
def test_what_breaks_a_program_is_noticed(path, value):
    now = copy.deepcopy(RELEASED)
    *above, last = path
    table = now
    for name in above:
        table = table[name]
    if value is None:
        del table[last]
    else:
        table[last] = value
    (line,) = moved(RELEASED, now)
    assert line.startswith(" ".join(path))


def test_what_is_added_breaks_nothing():
    now = copy.deepcopy(RELEASED)
    now["python"]["solve_stance"]["optional"]["load"] = {}
    now["python"]["solve_everything"] = {}
    now["json"]["hopform stance"]["properties"]["load"] = "{}"
    now["c"]["functions"]["hopform_more_f32"] = "void hopform_more_f32(void);"
    assert list(moved(RELEASED, now)) == []
