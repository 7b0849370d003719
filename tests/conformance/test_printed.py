"""The engine printed as Python is the engine in C: digests, and every bit of whatever either computes."""

import json
import random
import sys
from pathlib import Path

import numpy as np
import pytest

import hopform
from hopform._cli import main
from tests.conformance.printed import ENGINES, Both, drawn, found

FOUND = sorted((Path(__file__).resolve().parents[1] / "fuzz" / "found").iterdir())
RECORD = Path(__file__).resolve().parents[1] / "repository" / "gate" / "record.json"
DIGESTS = {suffix: int(digest, 16) for suffix, digest in json.loads(RECORD.read_text("utf-8"))["selftest"].items()}
EACH = pytest.mark.parametrize("suffix", ENGINES)
HOPPER = (25.0, 3.0, 1200.0, 0.4, 0.0, 150.0, 5.0, 0.78, 0.6, -65.0, 9.81, 0.0, 0.08, 3.0, 0.05, 0.3, 0.2)


@EACH
def test_the_selftest_gives_the_digest_of_c(suffix):
    engine = ENGINES[suffix]
    with np.errstate(all="ignore"):
        digest = engine.selftest(engine.Search(), [engine.Phase() for _ in range(32)], 32)
    assert digest == DIGESTS[suffix]
    assert engine.selftest(engine.Search(), [], 0) == 0


def test_the_command_prints_the_digests_of_both_back_ends(capsys):
    expected = "".join(f"hopform_selftest_{suffix} {digest:08x}\n" for suffix, digest in DIGESTS.items())
    for backend in hopform.backends():
        assert main(["selftest", "--backend", backend]) == 0
        assert capsys.readouterr().out == expected
    assert len(hopform.backends()) == 2


def compare(count: int, suffix: str, seed: int) -> list[tuple[int, list[str]]]:
    draw = random.Random(seed)
    return [(n, both.differ) for n in range(count) if (both := drawn(draw, suffix)).differ]


@pytest.mark.parametrize(("suffix", "count"), [("f32", 20), ("f64", 50)])
def test_random_robots_move_alike_to_the_last_bit(suffix, count):
    assert not compare(count, suffix, 1)


@pytest.mark.nightly
@EACH
def test_many_random_robots_move_alike_to_the_last_bit(suffix):
    assert not compare(400, suffix, 2)


def compare_found(files: list[Path], suffix: str) -> dict[str, list[str]]:
    return {file.name: both.differ for file in files for both in found(file.read_bytes(), suffix) if both.differ}


@EACH
def test_what_fuzzing_found_is_solved_alike_to_the_last_bit(suffix):
    files = [file for file in FOUND if file.name.endswith(suffix)]
    assert not compare_found(files, suffix) and len(files) >= 8


@pytest.mark.sliced
@EACH
def test_what_fuzzing_found_is_solved_alike_in_the_other_precision(suffix):
    assert not compare_found([file for file in FOUND if not file.name.endswith(suffix)], suffix)


@EACH
def test_a_comparison_sees_one_bit(suffix):
    both = Both(suffix, HOPPER)
    both.plan[1].rates.a1_y += abs(both.plan[1].rates.a1_y) * (2e-16 if suffix == "f64" else both.real(1e-7))
    assert both.solve((0.0, 0.0, -1.93, 0.0), [(0.0, 3.0)], 2.0, 64, 64) == 0
    assert both.differ == ["solve_stance"]


# ---- memory ----


@EACH
def test_what_overlaps_is_refused_and_not_written(suffix):
    """Objects and lists in the place of addresses: the same one, or one within another."""
    both = Both(suffix, HOPPER)
    engine, real, plan = ENGINES[suffix], both.real, both.plan[1]
    assert both.solve((0.0, 0.0, -1.93, 0.0), [(0.0, 3.0)], 2.0, 64, 64) == 0
    _, steps = both.steps
    _, phases = both.phases
    _, stance = both.stance
    of, zero = (plan, steps, phases, stance), real(0.0)
    times = [real(0.1), real(0.2)]
    columns = [times, *([real(1.0), zero] for _ in range(3))]
    with np.errstate(all="ignore"):
        assert engine.stance_states(*of, times, 2, columns) == engine.ERROR_OVERLAP
        assert times == [real(0.1), real(0.2)]  # a refusal writes nothing that lies in an input
        assert columns[1:] == [[0.0, 0.0]] * 3  # the others are zeros
        apart = [[zero] * 4 for _ in range(4)]
        assert engine.stance_states(*of, [real(0.1)], 1, apart) == engine.OK
        inside = engine.Part(apart[0], 2)
        assert engine.stance_states(*of, apart[0], 2, [inside, *apart[1:]]) == engine.OK  # the two behind these
        inside = engine.Part(apart[0], 1)
        assert engine.stance_states(*of, apart[0], 2, [inside, *apart[1:]]) == engine.ERROR_OVERLAP
        assert engine.stance_at(*of, real(0.1), stance.end) == engine.ERROR_OVERLAP
        assert (
            engine.solve_stance(plan, stance.end, steps, 1, real(2.0), 8, phases, 8, stance) >= 0
        )  # a start may lie there
        flight, hops = engine.Flight(), [engine.FlightPhase() for _ in range(8)]
        begin = plan, engine.State(zero, zero, real(1.0), zero)
        assert engine.solve_flight(*begin, zero, None, real(2.0), 8, hops, 8, flight) == engine.OK
        assert engine.flight_at(plan, hops, flight, [zero], 1, [flight.end]) == engine.ERROR_OVERLAP
        search, command = engine.Search(), engine.Command()
        wanted = engine.Target(real(0.1), zero, zero, real(2.0), 0, 0)
        assert engine.choose_current_begin(search, plan, search.start, wanted, command) == engine.SEARCHING
        assert engine.choose_current_step(search, phases, 64, command) >= 0


@EACH
def test_numbers_out_of_range_are_refused_and_raise_nothing(suffix):
    for value in (np.nan, np.inf, -np.inf, 1e38, 1e-38):
        robot = [value if name == "b1" else x for name, x in zip(("", *["x"] * 4, "b1"), HOPPER, strict=False)]
        both = Both(suffix, (*robot, *HOPPER[len(robot) :]))
        both.solve((0.0, value, -1.93, value), [(0.0, value)], value, 64, 64)
        both.fly((0.0, value, 1.0, 0.0), value, (value, value), 2.0, 64, 64)
        both.choose((0.0, value, -1.0, 0.0), (value, 0.0, 0.0, 2.0), 64)
        assert not both.differ


def test_a_number_becomes_whole_as_in_c_where_that_is_defined():
    for suffix, engine in ENGINES.items():
        whole, real = engine.whole, np.float32 if suffix == "f32" else float
        assert [whole(real(x)) for x in (2.9, -2.9, 0.0, 2147483520.0)] == [2, -2, 0, 2147483520]
        least = -(2**31)
        assert {whole(real(x)) for x in (np.nan, np.inf, -np.inf, 1e30)} == {least} and least > -sys.maxsize
