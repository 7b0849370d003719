"""Mutants are drawn by a seed and the lines' own text."""

import dataclasses

import pytest

from derive.emit.render import engine
from tests.mutation import python
from tests.mutation.evaluate import takes_longer
from tests.mutation.python import NEAREST, QUICK, ROOT, SEED, drawn

lines = pytest.importorskip("tests.mutation.draw", reason="universalmutator is absent (`sh tools/venv.sh dev` adds it)")

SOURCES = {name: path.read_text("utf-8") for name, path in engine() if name in {"c/energy_real.inc", "c/trial_real.h"}}
CODE = """/* Two lines,
 * x = 1; */
static real next_real(real x)
{
    return x + 2.0 * HOPFORM_EPS_real; /* + 1 */
}
"""


def test_a_seed_draws_the_same_mutants_and_another_draws_others():
    some = drawn(SEED, ("_checks.py", "terrain.py"))
    assert len(some) == len({(each.module, each.line, each.operator, each.occurrence) for each in some}) > 100
    assert some == drawn(SEED, ("_checks.py", "terrain.py"))
    assert some[:10] != drawn(SEED + 1, ("_checks.py", "terrain.py"))[:10]


def test_a_seed_draws_the_same_mutants_of_the_engine_and_another_draws_others():
    some = list(lines.drawn(1, SOURCES))
    assert len(some) > 100
    assert some == list(lines.drawn(1, SOURCES))
    assert some[:10] != list(lines.drawn(2, SOURCES))[:10]


def test_an_edit_elsewhere_leaves_the_draw_of_a_place_as_it_is(monkeypatch, tmp_path):
    before = drawn(SEED, ("terrain.py",))
    file = tmp_path / "runtime" / "hopform" / "terrain.py"
    file.parent.mkdir(parents=True)
    text = (ROOT / "runtime" / "hopform" / "terrain.py").read_text("utf-8")
    file.write_text(text.replace("import math\n", "# a line more\nimport math\n") + "\n\nMORE = 7 + 8\n", "utf-8")
    monkeypatch.setattr(python, "ROOT", tmp_path)
    after = [each for each in drawn(SEED, ("terrain.py",)) if "7 + 8" not in each.difference()]
    assert [dataclasses.replace(each, line=each.line - 1) for each in after] == before


def test_an_edit_elsewhere_leaves_the_draw_of_a_line_of_the_engine_as_it_is():
    more = {name: f"/* a line more */\n{text}static real more = 7.0 + 8.0;\n" for name, text in SOURCES.items()}
    after = [mutants for mutants in lines.drawn(1, more) if "7.0 + 8.0" not in mutants[0].old]
    assert [[dataclasses.replace(each, line=each.line - 1) for each in mutants] for mutants in after] == list(
        lines.drawn(1, SOURCES)
    )


def test_a_mutant_changes_one_line():
    for mutant in drawn(SEED, ("terrain.py",))[:20]:
        old = (ROOT / mutant.path).read_text("utf-8").splitlines()
        new = mutant.code().splitlines()
        changed = [n for n, (a, b) in enumerate(zip(old, new, strict=True), 1) if a != b]
        assert changed == [mutant.line], mutant


def test_a_mutant_of_the_engine_changes_code_and_no_factor_of_a_bound():
    found = [mutant for mutants in lines.drawn(1, {"c/next_real.h": CODE}) for mutant in mutants]
    assert {mutant.line for mutant in found} == {3, 4, 5, 6}  # no comment
    of_bound = {mutant.new.strip() for mutant in found if mutant.line == 5}
    assert {"return x - 2.0 * HOPFORM_EPS_real;", "return x + 2.0 / HOPFORM_EPS_real;"} <= of_bound
    assert not {"return x + 0.0 * HOPFORM_EPS_real;", "return x + (2+1).0 * HOPFORM_EPS_real;"} & of_bound
    for mutant in found:
        before, after = CODE.splitlines(), mutant.apply(CODE).splitlines()
        assert after[: mutant.line - 1] == before[: mutant.line - 1]
        assert after[len(after) - len(before) + mutant.line :] == before[mutant.line :]


def test_more_work_is_noticed_in_one_call_and_in_all():
    usual = [("stance", 1000)] * 100 + [("flight", 1000)]
    assert not takes_longer(usual, usual)
    assert not takes_longer([("stance", 1019)] * 100 + [("flight", 900)], usual)
    assert takes_longer([("stance", 1021)] * 100 + [("flight", 900)], usual)
    assert takes_longer([("stance", 1000)] * 99 + [("stance", 1151), ("flight", 900)], usual)
    assert not takes_longer([("flight", 9000)] * 101, usual)


def test_every_module_that_is_changed_has_tests_that_exist():
    for module, files in NEAREST.items():
        assert (ROOT / python.path_of(module)).is_file()
        assert files and all((ROOT / file).is_file() for file in files)
    engine_modules = {module for module in NEAREST if module.startswith("hopform_solver/")}
    assert not engine_modules & set(QUICK) and len(engine_modules) > 5
    assert {"_checks.py", "terrain.py", "_robots/__init__.py", "_hopping/run.py", "_control.py"} <= set(QUICK)
