"""No case distinction of the solver can be seen:
a slice of `make scans`, three values on each side and the last bits of each.
"""

import numpy as np
import pytest

from tests import needs
from tests.conformance import switchovers

ALL = (*switchovers.SWITCHES, *switchovers.STANCES)


@pytest.mark.parametrize("switch", needs.the_first(ALL, 2), ids=lambda switch: switch.name)
def test_no_error_and_no_jump_across_a_switch_is_above_the_limit(switch):
    swept = switchovers.sweep(switch, 3)
    assert set(swept.curves) == {(name, precision) for name in switch.libraries for precision in switchovers.DTYPES}
    assert not switchovers.beyond(swept)


@pytest.mark.parametrize("switch", switchovers.SWITCHES, ids=lambda switch: switch.name)
def test_a_sweep_lies_on_both_sides_of_its_switch_and_next_to_it(switch):
    for dtype in switchovers.DTYPES.values():
        values = switchovers.parameters(switch.at(dtype), switch.reach, dtype, 3)
        at = dtype(switch.at(dtype))
        for direction in (0.0, np.inf):
            neighbour = at
            for _ in range(switchovers.NEIGHBOURS):
                neighbour = np.nextafter(neighbour, dtype(direction))
                assert neighbour in values
        assert values.min() < 0.9 * at < 1.1 * at < values.max()


def test_the_page_has_a_line_for_every_switch():
    page = (switchovers.ROOT / "docs" / "developers" / "switchovers.md").read_text("utf-8")
    for switch in ALL:
        assert switch.where in page, switch.name


@pytest.mark.parametrize(("precision", "late"), [("f32", 1e14), ("f64", 1e110)])
def test_beside_a_pole_at_0_the_response_of_the_other_is_a_number_however_late(precision, late):
    """Of 1/(s (s + p)), which is held by no spring: exp(-p t), 1/p, (t - 1/p)/p; its integrals are beyond the range."""
    p = 2.0
    columns = np.array([[p], [0.0], [0.0], [late]], switchovers.DTYPES[precision])
    assert switchovers.in_c(columns, precision)[0, :3] == pytest.approx([0.0, 1.0 / p, late / p], rel=1e-6)
