"""The checker certifies what the library says of random stances,
and refuses a chain that somebody has tampered with.
"""

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hopform_solver.records import EVENTS
from tests.conformance.exhaustive import (
    HIGH_CONDITION,
    RIGHTS,
    SHARE_OF_HIGH,
    TOLERANCE,
    case_of,
    examine,
    refer,
    solved_again,
)
from tests.conformance.random_stances import draw_stances, solve_with_c, stiff_stances
from tests.oracle.checker import CERTIFIED, REASONS, certify
from tests.seeds import SEED, chosen

FOUND = Path(__file__).parent / "cases" / "found.json"
WORD = {text: number for number, text in EVENTS.items()}


def test_every_random_stance_is_certified():
    """Of 1000, by the seed that the head of the run shows:
    by the checker, or by the reference where 113 bits are too few.
    """
    found = examine(seed=SEED, count=1000, sampled=0)
    assert found.outcomes[CERTIFIED] >= 0.99 * found.stances, f"HOPFORM_SEED={SEED}: {found.reasons}"
    wrong = [case for case in map(refer, found.flagged) if case["verdict"] not in RIGHTS]
    assert not wrong, f"HOPFORM_SEED={SEED}"
    assert len(found.flagged) >= found.stances - found.outcomes[CERTIFIED]
    assert len(found.modes) == 9 and len(found.events) == len(EVENTS), f"HOPFORM_SEED={SEED}"


@pytest.mark.parametrize("stiffness", [3e1, 3e2, 1e4, 1e6])
def test_every_stance_beside_a_stiff_actuator_is_certified(stiffness: float):
    """From node to node, and one of a hundred random stances beside a far real pole."""
    problems = stiff_stances(SEED, 150, stiffness)
    answers, phases = solve_with_c(problems)
    verdicts = certify(problems, answers, phases)
    sure = verdicts["outcome"] == CERTIFIED
    doubted = [case_of(problems[i], answers[i], phases, "stiff", SEED, int(i)) for i in np.flatnonzero(~sure)]
    assert len(doubted) <= 2, f"HOPFORM_SEED={SEED}"
    assert not [case for case in map(refer, doubted) if case["verdict"] not in RIGHTS], f"HOPFORM_SEED={SEED}"
    for of in ("state", "aed"):
        errors = verdicts[f"error_{of}"][sure] / np.fmax(1.0, verdicts[f"condition_{of}"][sure])
        assert errors.max() <= TOLERANCE, f"HOPFORM_SEED={SEED}"


LONG = {"118-2367", "119-1600"}
"""Stiff cases, for which the reference takes the most of a minute."""


QUICK = 12
"""Cases of `make test`, the first that were found."""


def found_once() -> Iterator[Any]:
    for n, case in enumerate(json.loads(FOUND.read_text())):
        name = f"{case['seed']}-{case['lane']}"
        marks = pytest.mark.nightly if name in LONG else pytest.mark.sliced if n > QUICK else ()
        yield pytest.param(case, id=name, marks=marks)


@pytest.mark.parametrize("case", found_once())
def test_what_was_wrong_once_is_right(case: dict[str, Any]):
    assert solved_again(case)["verdict"] in RIGHTS


def test_a_seed_is_repeated_or_fresh():
    assert chosen("123") == 123
    assert len({chosen("fresh") for _ in range(10)}) > 1


@pytest.mark.sliced
def test_the_reference_measures_the_errors_that_the_checker_measures():
    """End states that are moved a little: two programs that share nothing must agree on error and condition."""
    problems = draw_stances(24, 14)
    answers, phases = solve_with_c(problems)
    for name in ("x1", "v1", "v2"):
        answers[name] += 3e-7
    answers["aed"] += 1e-7 * problems["m_s"] * np.maximum(np.abs(problems["v2"]), 1.0) ** 2 / 2.0
    verdicts, compared = certify(problems, answers, phases), 0
    for row, verdict in enumerate(verdicts):
        if verdict["outcome"] == CERTIFIED:
            exact = refer(case_of(problems[row], answers[row], phases, "moved", 24, row))
            for of, error in exact["errors"].items():
                if not math.isfinite(exact["conditions"].get(of, 1.0)):
                    continue  # at a threshold: other inputs, other events
                ours = verdict[f"error_{of}"] / max(1.0, verdict[f"condition_{of}"])
                assert error == pytest.approx(ours, rel=1e-2), (row, of)
                compared += 1
    assert compared >= 25


@pytest.mark.sliced
def test_hardly_a_random_stance_is_ill_conditioned():
    """Those above 1000, or that other inputs take to other events, are at most 0.1 %:
    an error is hardly ever excused.
    """
    problems = draw_stances(25, 4000)
    verdicts = certify(problems, *solve_with_c(problems))
    sure = verdicts["outcome"] == CERTIFIED
    assert sure.mean() > 0.99
    assert (verdicts["condition_state"][sure] > HIGH_CONDITION).mean() <= SHARE_OF_HIGH


def test_a_start_against_a_stop_has_a_condition():
    """v1 is lost at once, whatever it was, so other inputs lead to the same events."""
    problems = draw_stances(26, 1000)
    problems["x1_min"], problems["x1_max"], problems["x1"] = 0.0, 0.05, 0.0
    problems["v1"] = np.where(problems["y"] > 0.0, -0.1, 0.5 * problems["v2"])
    problems["c"] = 0.0
    verdicts = certify(problems, *solve_with_c(problems))
    sure = verdicts["outcome"] == CERTIFIED
    assert sure.sum() >= 990
    assert np.isfinite(verdicts["condition_state"][sure]).mean() >= 0.998


Chain = tuple[Any, Any]


def cut(answers: Any, phases: Any, row: int, place: int, length: int) -> Chain:
    """The chains without `length` phases of one stance."""
    first = answers["first"][row] + place
    answers["count"][row] -= length
    answers["first"][row + 1 :] -= length
    return answers, np.delete(phases, slice(first, first + length))


def dropped_reversal(answers: Any, phases: Any, row: int, place: int) -> Chain:
    return cut(answers, phases, row, place, 1)


def dropped_pair(answers: Any, phases: Any, row: int, place: int) -> Chain:
    """Two reversals of the same mass, as if a solver had stepped over both."""
    return cut(answers, phases, row, place, 2)


def later_event(answers: Any, phases: Any, row: int, place: int) -> Chain:
    phases["t"][answers["first"][row] + place] += 1e-3 * answers["duration"][row]
    return answers, phases


def other_word(answers: Any, phases: Any, row: int, place: int) -> Chain:
    event = phases["event"][answers["first"][row] + place : answers["first"][row] + place + 1]
    event[:] = {WORD["x1_reverses"]: WORD["x1_sticks"], WORD["x2_reverses"]: WORD["x2_sticks"]}[int(event[0])]
    return answers, phases


def other_mass(answers: Any, phases: Any, row: int, place: int) -> Chain:
    event = phases["event"][answers["first"][row] + place : answers["first"][row] + place + 1]
    event[:] = WORD["x1_reverses"] + WORD["x2_reverses"] - event
    return answers, phases


def other_ending(answers: Any, phases: Any, row: int, place: int) -> Chain:
    answers["ending"][row] = 3
    return answers, phases


def sooner_ending(answers: Any, phases: Any, row: int, place: int) -> Chain:
    """A chain that takes off at its first reversal."""
    start = phases[answers["first"][row] + place]
    answers["duration"][row], answers["ending"][row] = start["t"], 1
    return cut(answers, phases, row, place, answers["count"][row] - place)


TAMPERINGS = (dropped_reversal, dropped_pair, later_event, other_word, other_mass, other_ending, sooner_ending)


def reversals(answers: Any, phases: Any) -> list[tuple[int, int]]:
    """Row and place of the first of two successive reversals of the same mass, in chains that take off."""
    found = []
    for row, answer in enumerate(answers):
        event = phases["event"][answer["first"] : answer["first"] + answer["count"]]
        places = np.flatnonzero((event[1:-1] == event[2:]) & np.isin(event[1:-1], (1, 5)))
        if places.size and answer["ending"] == 1:
            found.append((row, int(places[0]) + 1))
    return found


@pytest.mark.parametrize("tamper", TAMPERINGS, ids=lambda tamper: tamper.__name__)
def test_a_chain_that_was_tampered_with_is_refused(tamper: Callable[..., Chain]):
    problems = draw_stances(22, 1500)
    answers, phases = solve_with_c(problems)
    places = reversals(answers, phases)
    assert len(places) >= 20
    for row, place in places[:20]:
        assert certify(problems[row : row + 1], answers[row : row + 1], phases)["outcome"] == CERTIFIED
        others, chain = tamper(answers.copy(), phases.copy(), row, place)
        verdict = certify(problems[row : row + 1], others[row : row + 1], chain)[0]
        assert verdict["outcome"] != CERTIFIED, (row, place)
        assert REASONS[verdict["reason"]]


def test_a_wrong_end_state_is_an_error_of_its_size():
    problems = draw_stances(23, 50)
    answers, phases = solve_with_c(problems)
    answers["v2"] += 1e-9
    answers["aed"] += 1e-9 * problems["m_s"] * np.maximum(np.abs(problems["v2"]), 1.0) ** 2 / 2.0
    verdicts = certify(problems, answers, phases)
    sure = verdicts["outcome"] == CERTIFIED
    assert sure.sum() >= 45
    np.testing.assert_allclose(verdicts["error_state"][sure & (verdicts["condition_state"] < 100)], 1e-9, rtol=1e-3)
    np.testing.assert_allclose(verdicts["error_aed"][sure & (verdicts["condition_aed"] < 100)], 1e-9, rtol=1e-3)
