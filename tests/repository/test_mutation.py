"""The mutants of `make mutants-all` are about the code as it is."""

from tests.mutation.__main__ import MUTANTS, ROOT


def test_what_a_mutant_replaces_stands_once():
    """So that a mutant that a change of the code has left behind is noticed by the change, and not months later."""
    texts = {path: (ROOT / path).read_text("utf-8") for path in {each.path for each in MUTANTS if each.old}}
    left_behind = [each.name for each in MUTANTS if each.old and texts[each.path].count(each.old) != 1]
    assert not left_behind
