"""The mutants of `make mutants-all` are about the code as it is."""

import dataclasses

from tests.mutation import python
from tests.mutation.__main__ import MUTANTS
from tests.mutation.copies import ROOT
from tests.mutation.python import NEAREST, QUICK, SEED, drawn


def test_what_a_mutant_replaces_stands_once():
    """So that a mutant that a change of the code has left behind is noticed by the change, and not months later."""
    texts = {path: (ROOT / path).read_text("utf-8") for path in {each.path for each in MUTANTS}}
    left_behind = [each.name for each in MUTANTS if texts[each.path].count(each.old) != 1]
    assert not left_behind


def test_a_seed_draws_the_same_mutants_and_another_draws_others():
    some = drawn(SEED, ("_checks.py", "terrain.py"))
    assert len(some) == len({(each.module, each.line, each.operator, each.occurrence) for each in some}) > 100
    assert some == drawn(SEED, ("_checks.py", "terrain.py"))
    assert some[:10] != drawn(SEED + 1, ("_checks.py", "terrain.py"))[:10]


def test_an_edit_elsewhere_leaves_the_draw_of_a_place_as_it_is(monkeypatch, tmp_path):
    before = drawn(SEED, ("terrain.py",))
    file = tmp_path / "runtime" / "hopform" / "terrain.py"
    file.parent.mkdir(parents=True)
    text = (ROOT / "runtime" / "hopform" / "terrain.py").read_text("utf-8")
    file.write_text(text.replace("import math\n", "# a line more\nimport math\n") + "\n\nMORE = 7 + 8\n", "utf-8")
    monkeypatch.setattr(python, "ROOT", tmp_path)
    after = [each for each in drawn(SEED, ("terrain.py",)) if "7 + 8" not in each.difference()]
    assert [dataclasses.replace(each, line=each.line - 1) for each in after] == before


def test_a_mutant_changes_one_line():
    for mutant in drawn(SEED, ("terrain.py",))[:20]:
        old = (ROOT / mutant.path).read_text("utf-8").splitlines()
        new = mutant.code().splitlines()
        changed = [n for n, (a, b) in enumerate(zip(old, new, strict=True), 1) if a != b]
        assert changed == [mutant.line], mutant


def test_every_module_that_is_changed_has_tests_that_exist():
    for module, files in NEAREST.items():
        assert (ROOT / "runtime" / "hopform" / module).is_file()
        assert files and all((ROOT / file).is_file() for file in files)
    assert {"_checks.py", "terrain.py", "_robots/__init__.py", "_hopping/run.py", "_control/exact.py"} <= set(QUICK)
