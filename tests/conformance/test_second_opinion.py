"""The second opinion on the search for events: what the C of a derived model says, the oracle of mechanisms says, too.

The oracle has the equations of motion, 60 digits and the rules of events, and no formula, rule or line of the product.
It is asked about hoppers with a damper, a second spring and a cable, whose take-off is not where the compression ends,
and about joints, which never take off.
"""

import dataclasses
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hopform_solver.records import Robot
from tests.conformance.legs import Leg, Legs, drawn, joints
from tests.oracle.mechanism.compare import LIMITS, RIGHT, WRONG, Answer, compare

COUNT = 20
LENGTH, OFFSET = (Robot._fields.index(name) for name in ("L0", "c"))
HOPPER = {
    "motor_work": "input",
    "viscous_1": "damper viscous_1",
    "viscous_2": "damper viscous_2",
    "coulomb_1": "friction x1",
    "coulomb_2": "friction x2",
    "stop_loss": "stop_loss",
}
JOINT = {
    "motor_work": "input",
    "viscous_1": "damper viscous",
    "coulomb_1": "friction q",
    "load_1": "force load",
    "stop_loss": "stop_loss",
}
"""Entries of the ledger, by the names of the oracle's works."""


@pytest.fixture(scope="module")
def legs(store: Path) -> Legs:
    return Legs(store)


Stance = tuple[tuple[float, ...], dict[str, Any], float, dict[str, Any]]


def stances(name: str) -> Iterator[Stance]:
    """Parameters, start, horizon and problem of random ones; the two springs have one free length."""
    if name == "joint":
        yield from joints(17, COUNT)
        return
    found = ((parameters, start, 2.0, problem) for parameters, start, problem in drawn(name, 15, 4 * COUNT))
    if name == "second_spring":
        found = (each for each in found if each[0][-1] == each[0][LENGTH] + each[0][OFFSET])
    yield from islice(found, COUNT)


REST = "k_2*(L0 + c - L_2)/(k + k_2)"
"""Compression of the first of two springs where the leg carries nothing: there y is 0."""


def of_unlike_springs() -> Iterator[Stance]:
    """Parameters, start, horizon and problem of legs whose springs have two free lengths."""
    for parameters, start, problem in drawn("second_spring", 15, 4 * COUNT):
        if parameters[-1] != parameters[LENGTH] + parameters[OFFSET]:
            row = {"q": [1, -1], "constant": f"-{REST}"}
            yield (
                parameters,
                start,
                2.0,
                {
                    **problem,
                    "position": ["x1", f"x1 - y - {REST}"],
                    "outputs": {**problem["outputs"], "y": row},
                    "contact": {**problem["contact"], "compression": row},
                },
            )


def said(name: str, leg: Leg, solved: Any) -> Answer:
    """What the library says, in the oracle's words."""
    answer = leg.answer(solved)
    if name != "joint":
        return answer
    events = [(t, kind.replace("phi_", "q_")) for t, kind in answer.events]
    final = {"q": answer.final["x1"], "v": answer.final["v1"]}
    return dataclasses.replace(answer, events=events, final=final, gains={})


@pytest.mark.sliced
@pytest.mark.parametrize("name", ["leg_damper", "joint", "second_spring", "cable"])
def test_a_stance_is_that_of_the_oracle(name: str, legs: Legs) -> None:
    """Events, ending, times, states and AED within 1e-12 of their scales, times the condition where that is above 1, or
    those of a neighbour 32 ulp away; and the work of the motor and of each friction."""
    leg, endings, events = legs[name], [], 0
    for n, (parameters, start, horizon, problem) in enumerate(stances(name)):
        solved = leg.solve(parameters, start, start["u"], horizon)
        verdict = compare(problem, said(name, leg, solved))
        assert verdict.outcome != WRONG, (n, verdict.errors, verdict.exact.kinds)
        endings.append(verdict.exact.status)
        events += len(verdict.exact.events)
        if verdict.outcome == RIGHT:
            assert_works(leg, solved, verdict, n)
    assert events > 20
    assert endings.count("takeoff") >= COUNT // 4 if name != "joint" else set(endings) == {"rest", "horizon"}


def assert_works(leg: Leg, solved: Any, verdict: Any, n: int) -> None:
    """The ledger at the end, within the tolerance of the judge, in units of the largest work or the energy before."""
    truth = verdict.exact
    works = truth.ledger(truth.duration)
    ledger = {
        entry: float(values[-1])
        for entry, values in solved.ledger_at(np.array([0.0, solved.outcome()[1]]))._asdict().items()
    }
    unit = max(float(truth.given_kinetic), *(abs(float(work)) for work in works.values()))
    condition = max(1.0, *verdict.condition.values(), 1.0)
    found = {entry: works[theirs] for entry, theirs in (JOINT if leg.name == "joint" else HOPPER).items()}
    if leg.name == "leg_damper":
        ledger["damper"] = ledger["damper_1"] + ledger["damper_2"]
        found["damper"] = works["damper viscous_12"]
    for entry, work in found.items():
        assert abs(ledger[entry] - float(work)) <= LIMITS[53] * condition * unit, (n, entry)


@pytest.mark.sliced
def test_a_leg_of_two_springs_of_unlike_lengths_begins_where_it_carries_nothing(legs: Legs) -> None:
    leg, takeoffs = legs["second_spring"], 0
    for n, (parameters, start, horizon, problem) in enumerate(islice(of_unlike_springs(), COUNT)):
        answer = leg.answer(leg.solve(parameters, start, start["u"], horizon))
        verdict = compare(problem, dataclasses.replace(answer, gains={}))
        assert verdict.outcome != WRONG, (n, verdict.errors, verdict.exact.kinds)
        takeoffs += verdict.exact.status == "takeoff"
    assert takeoffs >= COUNT // 4
