"""The modal form of the engine beside the one that ships: the same lists of events over random stances.

`python -m tests.conformance.two_forms COUNT` does as many as are wanted; here are a few thousand.
"""

from pathlib import Path

import pytest

from tests.conformance.two_forms import DRAWS, Form, Tally, compare

COUNT = {"random": 4000}
FEWER = 1000
"""Stances of the other draws: stiff actuators have many more events."""


def tally_of(store: Path, draw: str, *, double: bool) -> Tally:
    forms = Form(store, modal=True, double=double), Form(store, modal=False, double=double)
    found = compare(DRAWS[draw], 77, COUNT.get(draw, FEWER), forms, Form(store, modal=False, double=True))
    assert found.stances > 0.9 * COUNT.get(draw, FEWER)
    assert forms[0].counts()["node"] > 3 * found.stances, "the modal form was asked"
    return found


@pytest.mark.sliced
@pytest.mark.parametrize("draw", DRAWS)
def test_both_forms_find_the_same_events_in_double_precision(store, draw):
    found = tally_of(store, draw, double=True)
    assert found.wrong == 0 and found.differ <= found.stances // 1000, str(found)
    assert found.latest < 1e-12, str(found)


@pytest.mark.sliced
@pytest.mark.parametrize("draw", DRAWS)
def test_both_forms_find_the_same_events_in_single_precision(store, draw):
    found = tally_of(store, draw, double=False)
    assert found.differ <= max(2, found.stances // 200), str(found)
