"""The table of docs/evidence/identification.md, and what it says of rows that do not hold."""

import dataclasses
import math
import re

import pytest

from tests.conformance import blind, evidence, faults
from tests.conformance.evidence import Row, misses, put, share, table, wilson, written

ROW = Row("second", "held", "sound", 6, 1, 20, 19, 0, {"-": 6}, 0, 0)


@pytest.mark.parametrize(("hits", "count"), [(0, 7), (7, 7), (19, 20), (270, 300)])
def test_the_ends_of_wilson_are_where_the_score_of_a_share_is_the_quantile(hits, count):
    """Newcombe (1998) has 0.8661 to 0.9305 for 270 of 300 without a correction."""
    for end in wilson(hits, count):
        if 0.0 < end < 1.0:
            off = abs(hits / count - end) / math.sqrt(end * (1.0 - end) / count)
            assert off == pytest.approx(1.959964, rel=1e-9)
    assert (wilson(hits, count)[0] == 0.0, wilson(hits, count)[1] == 1.0) == (hits == 0, hits == count)


def test_a_row_below_nine_in_ten_is_said_not_to_hold():
    bad, few = (dataclasses.replace(ROW, inside=n, intervals=m, fault="drift") for n, m in ((12, 40), (3, 4)))
    assert [*misses([ROW])] == ["In every row at least 90 % of the intervals contain the truth."]
    _, _, *said = misses([ROW, bad, few])
    assert said[0] == f"- held, drift (second generator): {share(12, 40)}"
    assert said[1] == f"- held, drift (second generator): {share(3, 4)}; 90 % is within the interval of this share"
    assert len(said) == 2


def test_a_table_has_the_sums_of_each_generator():
    rows = [ROW, dataclasses.replace(ROW, generator="first", names={"-": 4, "lag": 2}, wrong=1), ROW]
    second, first = [*table(rows)][-2:]
    assert "| 6 | 0 | 1 | 19 of 20: 95 % (76 to 99) | 0 of 6: 0 % (0 to 39) | 2 | 1 of 2: 50 % (9 to 91) |" in first
    assert "| 12 | 0 | 2 | 38 of 40: 95 % (83 to 99) |" in second
    part = written(rows, {"first": 6, "second": 6})
    page = f"before\n{written([ROW], {'second': 6})}\nafter\n"
    assert put(page, part) == f"before\n{part}\nafter\n"


def test_the_page_has_every_cell_and_says_which_do_not_hold():
    """The page is what the program wrote: its sentences follow from its rows."""
    text = evidence.PAGE.read_text("utf-8")
    part = text[text.index(evidence.BEGIN) : text.index(evidence.END)]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in part.splitlines() if line.startswith("| ")]
    cells = {tuple(row[:3]) for row in rows[2:] if row[1] != "all"}
    both = {"first": faults.CELLS, "second": blind.CELLS}
    assert cells == {(by, kind, name) for by, some in both.items() for kind, names in some.items() for name in names}
    counts = [(row, re.match(r"(\d+) of (\d+):", row[6])) for row in rows[2:] if row[1] != "all"]
    low = [row for row, match in counts if match and int(match[1]) < evidence.HOLDS * int(match[2])]
    assert [f"- {row[1]}, {row[2]} ({row[0]} generator): {row[6]}" for row in low] == [
        line.partition("; ")[0] for line in part.splitlines() if line.startswith("- ")
    ]
