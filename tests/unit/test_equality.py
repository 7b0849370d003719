"""Answers are equal if all of their numbers are, one answer in two copies among them."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import hopform
from tests.calls import DECAY, HOPPER, OBJECTS, STEP

ANSWERS = OBJECTS | {"recording": DECAY}


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_equals_its_copy_and_nothing_else(name):
    one = ANSWERS[name]
    copy = pickle.loads(pickle.dumps(one))
    assert copy is not one and (one == copy) is True and (one != copy) is False
    assert (one == 3.0) is False and (one == ANSWERS["stance"]) is (name == "stance")


def test_equal_stances_flights_hops_runs_and_commands_have_one_hash():
    for name in ("stance", "resting stance", "flight", "hop", "run", "command"):
        assert len({ANSWERS[name], pickle.loads(pickle.dumps(ANSWERS[name]))}) == 1


def test_answers_that_differ_in_one_number_are_not_equal():
    batch = hopform.solve_stances(HOPPER, v2=[-1.9, -1e-3], sensitivities=True)
    assert np.isnan(batch.apex).any() and batch == hopform.solve_stances(HOPPER, v2=[-1.9, -1e-3], sensitivities=True)
    for name in ("status", "duration", "apex"):
        array = getattr(batch, name).copy()
        array[0] += 1
        assert batch != replace(batch, **{name: array}), name
    assert batch.sensitivities != hopform.solve_stances(HOPPER, v2=[-1.8, -1e-3], sensitivities=True).sensitivities
    assert batch != hopform.solve_stances(HOPPER, v2=[-1.9], sensitivities=True)
    assert DECAY != STEP
    maps = [hopform.reachability(HOPPER, [0.1, height], [0.0]) for height in (0.2, 0.2, 0.21)]
    assert maps[0] == maps[1] != maps[2]
