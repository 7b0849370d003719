"""The form of the engine behind a switch beside the one that ships: the same lists of events, for any model.

`python -m tests.conformance.two_forms COUNT` does as many as are wanted; here are a few hundred of each model and draw.
"""

import pytest

from tests.conformance.form_draws import KINDS, Model
from tests.conformance.two_forms import NAMES, Pair

COUNT = 200
HOPPER_FIRST = ["hopper", *(name for name in NAMES if name != "hopper")]
both_precisions = pytest.mark.parametrize("double", [True, False], ids=["f64", "f32"])


@pytest.mark.sliced
@both_precisions
@pytest.mark.parametrize("name", HOPPER_FIRST)
def test_both_forms_find_the_same_events(store, name, double):
    model = Model(store, name)
    pair = Pair(store, model, double=double, level="-O0")
    for kind in KINDS if not pair.same else ():
        found = pair.compare(kind, 77, COUNT)
        said = f"{name}, {kind}: {found.row} {found.cases}"
        assert found.motions > COUNT // 2, said
        assert found.wrong <= found.wrong_as_ships and found.stuck <= found.stuck_as_ships, said
    if name == "hopper":
        assert pair.on.asked > 3 * COUNT, "the form behind the switch was asked"
