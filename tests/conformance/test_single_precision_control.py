"""The controller in single precision, as firmware calls it, judged by the model in double precision."""

import numpy as np
import pytest

import hopform
from tests import needs
from tests.seeds import SEED

STATES = 10000
"""Touchdown states of each robot."""


@pytest.mark.parametrize("name", needs.the_first(["hopper_c", "hopper_b"]))
def test_where_it_says_reached_the_apex_is_hit_to_1e_5_m(name):
    robot = hopform.load_robot(name)
    draw = np.random.default_rng(SEED)
    reached, worst = 0, 0.0
    for n in range(STATES):
        moving = n % 2
        v2 = float(np.float32(hopform.touchdown_velocity(robot, height=draw.uniform(0.02, 0.4))))
        x1 = float(np.float32(moving * draw.uniform(0.0, 0.04)))
        v1 = float(np.float32(moving * draw.uniform(-0.2, 0.2)))
        h_des = float(np.float32(draw.uniform(0.02, 0.3)))
        start = {"v2": v2, "x1": x1, "v1": v1}
        command = hopform.choose_current(robot, **start, h_des=h_des, dtype=np.float32)
        assert abs(command.u) <= robot.u_max
        if command.status != "reached":
            continue
        stance = hopform.solve_stance(robot, **start, u=command.u)
        assert stance.status == "takeoff", (start, h_des)
        reached += 1
        worst = max(worst, abs(stance.apex - h_des))
        x1s = stance.at(np.linspace(0.0, stance.duration, 50)).x1
        assert robot.x1_min <= x1s.min() + 1e-9 and x1s.max() < robot.x1_max, (start, h_des)
    assert reached > STATES // 5
    assert worst <= 1e-5
