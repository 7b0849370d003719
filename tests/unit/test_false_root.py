"""A step towards a root that is short only because its numerator vanishes lands on no root."""

import pytest

import hopform
from tests.conformance.errors import assert_same_stance


@pytest.mark.parametrize(("v2", "u"), [(-0.4979183110887379, 1.277), (-0.4979183110887379, 2.251)])
def test_the_leg_takes_off_where_the_spring_is_long_and_not_before(v2: float, u: float) -> None:
    robot = hopform.load_robot("hopper_c")
    found = hopform.solve_stance(robot, v2=v2, u=u)
    assert_same_stance(robot, v2=v2, u=u)
    if found.takeoff is not None:
        assert found.compression(found.duration * (1.0 - 1e-6)) < 1e-6
