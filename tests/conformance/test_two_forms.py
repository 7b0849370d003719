"""The form of the engine behind a switch beside the one that ships: the same lists of events, for any model.

`python -m tests.conformance.two_forms COUNT` does as many as are wanted; here are a few hundred of each model and draw.
"""

import pytest

from tests.conformance.form_draws import KINDS, Model
from tests.conformance.two_forms import NAMES, Pair

COUNT, JUDGED = 200, 6
"""Motions of a draw, and how many lists that differ are judged: as many as may."""
MANY = {"random": 4000, **dict.fromkeys(("stiff 1e+03", "stiff 1e+04", "stiff 1e+05"), 1000)}
"""Stances of the hopper, of which hardly any list may differ, and no time."""
SLICED = ("hopper", "joint", "leg_damper", "rig", "servo")
"""Both masses and one, with a contact and without, one with a damper in it, and a law; the others by night."""
SOME_FIRST = [*SLICED, *(pytest.param(name, marks=pytest.mark.nightly) for name in NAMES if name not in SLICED)]


@pytest.mark.sliced
@pytest.mark.parametrize("name", SOME_FIRST)
def test_both_forms_find_the_same_events(store, name):
    """In double precision none is wrong where they differ, which is on a threshold, where both may be right; in single
    precision they hardly differ.
    """
    model = Model(store, name)
    for double in (True, False):
        pair = Pair(store, model, double=double, level="-O0")
        for kind in KINDS if not pair.same else ():
            found = pair.compare(kind, 78, COUNT, most=JUDGED * double)
            said = f"{name}, {kind}, {'f64' if double else 'f32'}: {found.row} {found.cases}"
            assert found.motions > COUNT // 2, said
            faults = found.wrong_as_ships + max(found.stuck_as_ships - found.stuck, 0)  # of the form that ships
            assert found.wrong == 0 and found.differ <= 2 + found.motions // 50 + faults, said
            assert not double or found.stuck <= found.stuck_as_ships, said  # f32: such a list differs, too
        if name == "hopper":
            assert pair.on.asked > 3 * COUNT, "the form behind the switch was asked"


@pytest.mark.sliced
@pytest.mark.parametrize("kind", MANY)
@pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])
def test_hardly_any_list_of_many_stances_differs(store, kind, double):
    found = Pair(store, Model(store, "hopper"), double=double, level="-O0").compare(kind, 77, MANY[kind], most=0)
    assert found.motions > 0.9 * MANY[kind]
    if double:
        assert found.differ <= found.motions // 1000 and found.usual < 1e-12, f"{found.row} {found.usual}"
    else:
        assert found.differ <= max(2, found.motions // 200), found.row
