"""The engine's lists of events over all models and draws, by the judge of tests/conformance/judge.py.

`python -m tests.conformance.judge COUNT` does as many as are wanted; here are some hundred of each model and draw.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.conformance.judge import BATCH, LATE, NAMES, TOO_MANY, UNCERTIFIED, Engine, Judge, Motions
from tests.conformance.motion_draws import KINDS, Model, problems

COUNT, JUDGED = {True: 200, False: 50}, 6
"""Motions of a draw in double precision, and in single; how many lists of a draw that differ go to the 60 digits."""
SLICED = ("hopper", "joint", "rig", "servo")
"""Both masses and one, with a contact and without, and a law; the others by night."""
SOME_FIRST = [*SLICED, *(pytest.param(name, marks=pytest.mark.nightly) for name in NAMES if name not in SLICED)]
STIFF = {"stiff 1e+03": 3, "stiff 1e+04": 3, "stiff 1e+05": 8}
"""Of 3 000 stances of the hopper in single precision, how many lists may be wrong."""
MANY = 750
SETTLED = {"thresholds": 0.5}
"""Of how many motions the checker settles the list at least: many of these starts are within its rounding of a
threshold. Of `lever`, of which it settles the fewest, 0.605 at least in 8 seeds of 200 motions, 0.645 on average."""


@pytest.mark.sliced
@pytest.mark.parametrize("name", SOME_FIRST)
def test_no_list_is_wrong_and_no_motion_without_an_end(store, name):
    """Lists that differ from the checker's are judged by 60 digits; in single precision one of fifty may be wrong."""
    model = Model(store, name)
    for double, count in COUNT.items():
        judge = Judge(store, model, double=double, level="-O0")
        for kind in KINDS:
            found = judge.judge(kind, 78, count, most=JUDGED)
            said = f"{name}, {kind}, {'f64' if double else 'f32'}: {found.row} {found.cases}"
            assert found.motions > count // 2, said
            assert found.found_exactly > SETTLED.get(kind, 0.7) * found.motions, said
            assert found.wrong <= (0 if double else 1), said
            assert found.stuck == 0, said


@pytest.mark.sliced
@pytest.mark.parametrize("kind", STIFF)
def test_hardly_a_list_of_a_stiff_hopper_is_wrong_in_single_precision(store, kind):
    found = Judge(store, Model(store, "hopper"), double=False, level="-O0").judge(kind, 77, MANY, most=MANY)
    assert found.motions > 0.9 * MANY
    assert found.wrong <= -(-STIFF[kind] * MANY // 3000) and found.stuck == 0, f"{found.row} {found.cases}"


@pytest.mark.sliced
def test_times_of_equal_lists_hardly_differ(store):
    judge = Judge(store, Model(store, "hopper"), double=True, level="-O0")
    found = judge.judge("random", 77, 1000, most=0)
    unsettled = found.motions - found.found_exactly
    assert found.motions > 900 and unsettled < 0.06 * found.motions
    assert found.differ - unsettled < 0.01 * found.motions
    assert found.late == 0 and found.usual < 1e-12, f"{found.row} {found.usual}"


@pytest.mark.sliced
def test_no_stiff_motion_in_single_precision_is_without_an_end(store):
    """Beside a fast pole d = g'' + a g' has no digits at a minimum, and cutting there must come to an end."""
    model = Model(store, "rig")
    found = Engine(store, model, double=False, level="-O0").solve(problems(model, "stiff 1e+05", 1, BATCH, False))
    assert not (found.answers["ending"] == UNCERTIFIED).any()


# ---- the judge itself ----


def without_an_event(motions: Motions, lane: int) -> None:
    motions.answers["count"][lane] -= 1


def of_another_kind(motions: Motions, lane: int) -> None:
    kinds, first = motions.events["kind"], motions.answers["first"][lane]
    kinds[first] = 1 + kinds[first] % 4


def of_another_ending(motions: Motions, lane: int) -> None:
    """At rest for at the horizon, or the other way round."""
    motions.answers["ending"][lane] = 5 - motions.answers["ending"][lane]


def late(motions: Motions, lane: int) -> None:
    motions.events["t"][motions.answers["first"][lane]] += 2.0 * LATE * motions.answers["duration"][lane]


def without_an_end(motions: Motions, lane: int) -> None:
    motions.answers["ending"][lane] = UNCERTIFIED


def given_up(motions: Motions, lane: int) -> None:
    """At an event after which the exact motion has few phases."""
    motions.answers["ending"][lane] = TOO_MANY


class Faulty:
    """An engine with a fault in the first motion of two events or more."""

    def __init__(self, engine: Engine, fault: Callable[[Motions, int], None]) -> None:
        self.engine, self.fault = engine, fault

    def solve(self, lanes: Any) -> Motions:
        motions = self.engine.solve(lanes)
        found = replace(motions, answers=motions.answers.copy(), events=motions.events.copy())
        self.fault(found, int(np.flatnonzero(found.answers["count"] >= 2)[0]))
        return found


@pytest.mark.sliced
@pytest.mark.parametrize("draw", ["random", "thresholds"])
def test_the_judge_finds_each_kind_of_fault(store, draw):
    """One in 40 motions, by the checker and by what the engine said before; of a sound engine nothing."""
    judge = Judge(store, Model(store, "joint"), double=True, level="-O0")
    sound, engine = judge.judge(draw, 5, 40), judge.engine
    assert (sound.wrong, sound.stuck, sound.late, sound.unsettled) == (0, 0, 0, 0)
    assert sound.motions >= 38 and sound.found_exactly >= 36
    faults = (without_an_event, of_another_kind, of_another_ending, late, without_an_end, given_up)
    for before, fault in [*((None, fault) for fault in faults), (engine, without_an_event), (engine, given_up)]:
        judge.before, judge.engine = before, Faulty(engine, fault)  # type: ignore[assignment]
        found = judge.judge(draw, 5, 40)
        assert found.differ == sound.differ * (before is None) + 1, fault
        assert found.judged >= 1 and found.wrong_before == 0, (fault, found.cases)
        assert found.wrong == (fault is not given_up), (fault, found.cases)  # as far as it goes it is right
        assert found.late == (fault is late), fault
        assert found.stuck == (fault in (without_an_end, given_up)), fault
