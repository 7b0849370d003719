"""A step towards a root that is short only because its numerator vanishes lands on no root."""

import pytest

import hopform


@pytest.mark.parametrize(("v2", "u"), [(-0.4979183110887379, 1.277), (-0.4979183110887379, 2.251)])
def test_the_leg_takes_off_where_the_spring_is_long_and_not_before(v2: float, u: float) -> None:
    robot = hopform.load_robot("hopper_c")
    found = {name: hopform.solve_stance(robot, v2=v2, u=u, backend=name) for name in ("c", "python")}
    assert [event.kind for event in found["c"].events] == [event.kind for event in found["python"].events]
    assert found["c"].duration == pytest.approx(found["python"].duration, abs=1e-12)
    if found["c"].takeoff is not None:
        assert found["c"].compression(found["c"].duration * (1.0 - 1e-6)) < 1e-6
