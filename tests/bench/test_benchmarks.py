"""The benchmarks solve their job: their stances, their truth, two of the peers, hopform's own rows."""

import importlib.util
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import hopform
from tests.bench import (
    beside,
    casadi_peer,
    diffrax_peer,
    jobs,
    native,
    numba_peer,
    report,
    rows,
    scipy_peers,
    timing,
    truth,
)
from tests.bench.pieces import Piece
from tests.bench.timing import Outcome, Result
from tests.bench.verdicts import Verdict, assess, is_right
from tests.oracle import rules

SETS = [of.first(3) for of in jobs.sets()]
each_set = pytest.mark.parametrize("of", SETS, ids=lambda of: of.name)


def test_the_stances_are_seeded_and_exact_in_single_precision():
    for of in jobs.sets():
        assert len(of) == jobs.COUNT
        assert np.array_equal(of.table, of.table.astype(np.float32))
    drawn = jobs.random_robots.__wrapped__()
    assert np.array_equal(drawn.table, jobs.random_robots().table)


def test_the_truth_belongs_to_the_stances_and_the_reference_still_says_it():
    stored = truth.load()
    for of in SETS:
        assert len(stored[of.name]) == jobs.COUNT
        assert truth.solve((of.name, 2)) == stored[of.name][2]


def test_the_stances_hold_every_ending_but_the_cap_and_every_event():
    answers = [answer for of in truth.load().values() for answer in of]
    assert {answer["status"] for answer in answers} == {"takeoff", "rest", "horizon"}
    assert {kind for answer in answers for _, kind in answer["events"]} == set(rows.EVENTS.values())


@each_set
def test_scipy_solve_ivp_gives_the_reference_s_events(of):
    verdict = assess(of, scipy_peers.solve_ivp(of, "DOP853", 1e-10), truth.load()[of.name])
    assert verdict.wrong == 0
    assert verdict.error <= 1e-7


@each_set
def test_expm_and_brentq_give_the_reference_s_events(of):
    verdict = assess(of, scipy_peers.expm(of, 1e-10), truth.load()[of.name])
    assert verdict.wrong == 0
    assert verdict.error <= 1e-10


@each_set
def test_the_numba_peer_s_lines_give_the_reference_s_events_without_numba_too(of):
    found = jobs.answers(len(of))
    numba_peer.run(of.table, 1e-10, 1, found)
    verdict = assess(of, found, truth.load()[of.name])
    assert verdict.wrong == 0
    assert verdict.error <= 1e-6


@pytest.mark.sliced
@each_set
def test_hopform_s_rows_are_exact(of):
    exact = truth.load()[of.name]
    for row in rows.ours():
        if "f32" not in row.name and f"{rows.BATCH} at once" not in row.name:
            ready = row.ready(of)
            verdict = assess(of, ready.answers(ready.run(1)), exact)
            assert verdict.wrong == 0, row.name
            assert verdict.error <= 1e-12, row.name


@pytest.mark.sliced
def test_a_wrong_event_list_and_a_wrong_number_are_seen():
    of = SETS[0]
    exact = truth.load()[of.name]
    ready = next(rows.ours()).ready(of)
    answers = ready.answers(ready.run(1))
    assert all(is_right(row, right) for row, right in zip(answers, exact, strict=False))
    late = answers.copy()
    late[1, 1] += 1e-3
    assert assess(of, late, exact).error > 1e-4
    shorter = answers.copy()
    shorter[0, 7] -= 1
    renamed = answers.copy()
    renamed[0, len(jobs.HEAD) + 1] = 3.0
    assert assess(of, shorter, exact).wrong == assess(of, renamed, exact).wrong == 1


def test_a_peer_that_cannot_be_built_is_left_out_by_name(monkeypatch, tmp_path):
    monkeypatch.setattr(native, "OUT", tmp_path)
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(native.NotBuilt, match="no-such-compiler is not installed"):
        native.odeint()
    monkeypatch.setenv("CC", f"{shutil.which('false')}")
    with pytest.raises(native.NotBuilt, match="failed"):
        native.cvode()


def result(name: str, tolerance: float | None, time: float, wrong: int = 0, error: float = 1e-15) -> Result:
    row = rows.Row(name, tolerance, lambda of: pytest.fail("not to be run"))
    return Result(row, dict.fromkeys(report.SETS, time), dict.fromkeys(report.SETS, Verdict(wrong, error)))


OUTCOME = Outcome(
    (
        result(rows.BASE, None, 2.0),
        result(f"{rows.BASE}, plan included", None, 4.0),
        result("hasty", 1e-6, 1.0, wrong=1),
        result("right", 1e-8, 20.0, error=1e-6),
        result("accurate", 1e-10, 60.0, error=1e-10),
    ),
    ("absent: not installed",), 3, 1,
)  # fmt: skip


ALONE = 0.1, 0.105
"""[s] of the fixed loop before and after a run."""


def test_times_are_shown_only_where_a_fixed_loop_took_as_long_before_and_after():
    lines = [beside.Line("a grid", 1.734, "ns/sample"), beside.Line("many", 0.5, "us/stance", 0.25)]
    found = {("hopper_c", "f64"): (Piece("plan_init", 1819.0, 878.0),)}
    page = report.markdown(OUTCOME, found, lines, ALONE)
    for text in ("us/stance", "| 2.00 |", "| 878 |", "a grid"):
        assert text in page
    busy = report.markdown(OUTCOME, found, lines, (0.1, 0.112))
    assert "took 100 ms before and 112 ms after the run: the machine was not alone" in busy
    assert "| right, rtol 1e-08 | 10.0 | 1e-06 | 0 | 10.0 | 1e-06 | 0 |" in busy
    assert "| plan_init | hopper_c | f64 | 1819 |\n" in busy
    assert "| many | - | us/stance | 0.25 |" in busy and "a grid" not in busy
    assert not timing.agree((0.1, 0.08)) and timing.fixed_loop() > 0.0


def test_the_row_from_python_times_the_call_and_unfolds_no_events(monkeypatch):
    (row,) = (row for row in rows.ours() if row.name == "hopform from Python, solve_stance")
    ready = row.ready(SETS[0])
    monkeypatch.setattr(hopform.Stance, "events", property(lambda _: pytest.fail("not asked for")))
    assert len(ready.run(1)) == 3


def test_the_headline_is_the_ratio_to_the_fastest_peer_without_a_wrong_event_list():
    text = report.headline(OUTCOME)
    assert "without a wrong event list is right, rtol 1e-08, largest error 1e-06: it takes 10.0 x on hopper_c" in text
    assert "up to 1e-09 is accurate, rtol 1e-10, largest error 1e-10: it takes 30.0 x on hopper_c" in text
    assert "hasty" not in text


@pytest.mark.parametrize("wrong", [False, True])
def test_the_picture_has_every_row_of_the_page_in_both_sets(wrong):
    """That of the last release, or those rows of it whose event lists are wrong, which are hollow."""
    page = (native.ROOT / "docs" / "evidence" / "benchmark.md").read_text("utf-8")
    table = report.table_of(page)
    assert len(table) > 20
    for of, ax in zip(report.SETS, report.drawn(page).axes, strict=True):
        rows = [row for row in table if not wrong or row[f"{of} wrong"] != "0"]
        lines = [line for line in ax.lines if (line.get_color() == "white") == wrong]
        points = [(x, y) for line in lines for x, y in zip(*line.get_data(), strict=True)]
        assert sorted(points) == sorted((float(row[f"{of} error"]), float(row[f"{of} ratio"])) for row in rows)


def test_the_page_names_what_was_left_out():
    page = report.markdown(OUTCOME, {}, (), ALONE)
    assert "Left out: absent: not installed." in page
    assert "| right, rtol 1e-08 | 20.0 | 10.0 |" in page


# ---- beside the table ----


@pytest.mark.skipif(
    shutil.which(native.compilers()[1][0]) is None,
    reason="no C++ compiler, which peers of the benchmarks need and hopform does not (set CXX, or apt install g++)",
)
def test_the_closed_form_by_hand_is_right_where_its_sequence_is():
    of, exact = beside.paper_sequence()
    assert len(of) >= 20
    library = native.by_hand()
    library.prepare(of)
    verdict = assess(of, library.function("by_hand", of)(1), exact)
    assert verdict.wrong == 0
    assert verdict.error <= 1e-12
    everything = jobs.hopper_c()
    library.prepare(everything)
    wrong = assess(everything, library.function("by_hand", everything)(1), truth.load()["hopper_c"]).wrong
    assert wrong > 20, "it knows no other sequence"


def test_many_stances_are_the_jobs_over_and_over():
    for of in SETS:
        robot, inputs = beside._inputs(of, 7)
        assert inputs["v2"].tolist() == [of.start(n % 3)["v2"] for n in range(7)]
        fields = inputs.get("k", np.full(7, robot.k))
        assert fields.tolist() == [of.robot(n % 3)["k"] for n in range(7)]


@pytest.mark.sliced
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="a process's peak is read from /proc")
def test_a_batch_of_a_million_stances_stays_below_400_megabytes():
    """Without event lists, measured in a process of its own."""
    peak, before = beside.memory()
    assert 10.0 < before.value < peak.value < 400.0


def test_calls_are_timed_in_turns():
    seen = []
    spent = beside.medians({"one": lambda: seen.append(1), "two": lambda: seen.append(2)}, 2)
    assert seen == [1, 2] * 3
    assert set(spent) == {"one", "two"}


def test_the_page_has_a_line_for_each_number_beside_the_table():
    lines = [beside.Line("a grid", 1.734, "ns/sample"), beside.Line("many", 0.5, "us/stance", 0.25)]
    page = report.markdown(OUTCOME, {}, lines, ALONE)
    assert "| a grid | 1.73 | ns/sample |  |\n| many | 0.50 | us/stance | 0.25 |\n" in page


# ---- peers of optional packages, which the extra `bench` holds and the tests' own `dev` does not ----

OPTIONAL = [
    peer for name, peer in (("casadi", casadi_peer), ("diffrax", diffrax_peer)) if importlib.util.find_spec(name)
]


if OPTIONAL:

    @each_set
    @pytest.mark.parametrize("peer", OPTIONAL)
    def test_a_peer_of_an_optional_package_gives_the_reference_s_events(of, peer):
        verdict = assess(of, peer.solve(of, 1e-10), truth.load()[of.name])
        assert verdict.wrong == 0
        assert verdict.error <= 1e-6


def test_the_linear_functions_of_diffrax_are_the_event_functions():
    """Anywhere within a mode, stops and held masses among them."""
    for of in SETS:
        for job in of.table.tolist():
            leg = rules.leg_of(tuple(job))
            z, side_1, side_2 = rules.begin(tuple(job), leg)
            rows = diffrax_peer._functions(leg, side_1, side_2, z)
            there = rules.Point(z.x1 + 0.01 * side_1, 0.3 * side_1, -0.2 * side_2, 0.03)
            expected = np.minimum(rules.event_functions(leg, side_1, side_2, there), 1e6)
            np.testing.assert_allclose(rows @ [*there, 1.0], expected, rtol=1e-9)


def test_a_package_that_is_not_there_is_left_out_by_name(monkeypatch):
    monkeypatch.setitem(sys.modules, "casadi", None)
    row = next(row for row in rows.peers() if row.solver == "CVODES by CasADi")
    with pytest.raises(ImportError, match="casadi"):
        row.ready(SETS[0])
